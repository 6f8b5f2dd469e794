/* carry.c - label maps, points and meshes of one image, taken to the other. Voxels are pulled: every voxel of the image that they
 * are for looks where it lies in the other one. Points are pushed. So the two need maps of opposite directions. */
#include "register/run.h"

#include "registration/points.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* From one image to another. */
struct transport {
    const char *out, *name;           /* files are out/name_labels.nii.gz and so on */
    const struct volume *from, *to;
    const struct field *pull, *push;  /* on the grids of `to` and of `from` */
    bool of_moving;                   /* `from` is the moving image */
};

static void path_of(const struct transport *t, const char *what, char path[1024])
{
    char name[64];
    snprintf(name, sizeof name, "%s_%s", t->name, what);
    run_path(t->out, name, path, 1024);
}

/* Writes what is not labels from 0 on: 16-bit integers where all are such. */
static bool write_labels(const char *path, const struct volume *like, const float *labels, char error[VOLUME_TEXT])
{
    const size_t total = volume_voxels(like);
    bool whole = true;
    for (size_t n = 0; n < total; ++n) {
        whole = whole && labels[n] >= (float)INT16_MIN && labels[n] <= (float)INT16_MAX && labels[n] == (float)(int)labels[n];
    }
    if (!whole) {
        return volume_write(path, like, VOLUME_FLOAT32, labels, error);
    }
    int16_t *integers = malloc(total * sizeof *integers);
    snprintf(error, VOLUME_TEXT, "not enough memory");
    for (size_t n = 0; integers && n < total; ++n) {
        integers[n] = (int16_t)labels[n];
    }
    const bool good = integers && volume_write(path, like, VOLUME_INT16, integers, error);
    free(integers);
    return good;
}

static bool carry_labels(const struct run *run, const struct transport *t, const char *file)
{
    char path[1024], error[VOLUME_TEXT];
    struct volume labels;
    if (!register_read_labels(run, t->of_moving, file, &labels)) {
        return false;
    }
    float *carried = labels.ids ? NULL : malloc(volume_voxels(t->to) * sizeof *carried);
    uint32_t *ids = labels.ids ? malloc(volume_voxels(t->to) * sizeof *ids) : NULL;
    bool good = true;
    path_of(t, "labels.nii.gz", path);
    if (!(carried || ids) || (ids && !field_warp_ids(t->pull, &labels, ids))) {
        good = register_no_memory();
    } else if (ids) {
        good = volume_write_labels(path, t->to, ids, error) || register_fail("%s", error);
    } else {
        field_warp_labels(t->pull, &labels, carried);
        good = write_labels(path, t->to, carried, error) || register_fail("%s", error);
    }
    free(carried);
    free(ids);
    volume_free(&labels);
    return good;
}

static bool carry_points(const struct transport *t, const char *file)
{
    char path[1024], error[VOLUME_TEXT];
    float *points;
    size_t count;
    if (!points_read(file, t->from, &points, &count, error)) {
        return register_fail("%s", error);
    }
    path_of(t, "points.txt", path);
    field_map_points(t->push, points, count, points);
    const bool good = points_write(path, points, count, error) || register_fail("%s", error);
    free(points);
    return good;
}

static bool carry_mesh(const struct transport *t, const char *file)
{
    char path[1024], error[MESH_TEXT];
    struct mesh mesh;
    if (!mesh_read(file, &mesh, error)) {
        return register_fail("%s", error);
    }
    path_of(t, "mesh.ply", path);
    field_map_points(t->push, mesh.positions, mesh.vertex_count, mesh.positions);
    const struct mesh_arrays ply = {.positions = mesh.positions, .vertex_count = mesh.vertex_count, .indices = mesh.indices,
                                 .triangle_count = mesh.triangle_count, .colors = mesh.colors,
                                 .comment = "millimetres, RAS+"};
    const bool good = mesh_write_ply(path, &ply, error) || register_fail("%s", error);
    mesh_free(&mesh);
    return good;
}

static bool carry(const struct run *run, const struct transport *t, const struct carried *files)
{
    return (!files->labels || carry_labels(run, t, files->labels)) && (!files->points || carry_points(t, files->points))
           && (!files->mesh || carry_mesh(t, files->mesh));
}

bool register_carry(const struct run *run)
{
    const struct transport warp = {.out = run->common.out, .name = "warped", .from = &run->moving, .to = &run->fixed,
                                   .pull = &run->forward, .push = &run->inverse, .of_moving = true};
    const struct transport inverse = {.out = run->common.out, .name = "inverse", .from = &run->fixed, .to = &run->moving,
                                      .pull = &run->inverse, .push = &run->forward, .of_moving = false};
    return carry(run, &warp, &run->warp) && carry(run, &inverse, &run->inverse_warp);
}
