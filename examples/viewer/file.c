#define _POSIX_C_SOURCE 200809L

#include "viewer/file.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool ends_with(const char *path, const char *suffix)
{
    const size_t length = strlen(path), tail = strlen(suffix);
    return length > tail && strcasecmp(path + length - tail, suffix) == 0;
}

/* Writes floats with all their bits. */
static void write_three(FILE *file, const char *key, const float v[3])
{
    fprintf(file, "%s %.9g %.9g %.9g", key, (double)v[0], (double)v[1], (double)v[2]);
}

static void write_rows(FILE *file, const char *key, const float *values, int count)
{
    for (int v = 0; v < count; ++v) {
        write_three(file, key, values + 3 * v);
        fputc('\n', file);
    }
}

static bool write_obj(const char *path, const springls_mesh *mesh, const float *colors, char error[MESH_TEXT])
{
    FILE *file = fopen(path, "w");
    if (!file) {
        snprintf(error, MESH_TEXT, "%.200s: cannot write there", path);
        return false;
    }
    fputs("# v: the surface, vt: where each point was at the start, vn: normals\n", file);
    for (int v = 0; v < mesh->vertex_count; ++v) { /* the color follows the place, a common extension */
        write_three(file, "v", mesh->positions + 3 * v);
        if (colors) {
            write_three(file, "", colors + 3 * v);
        }
        fputc('\n', file);
    }
    write_rows(file, "vt", mesh->correspondences, mesh->vertex_count);
    write_rows(file, "vn", mesh->normals, mesh->vertex_count);
    for (int t = 0; t < mesh->triangle_count; ++t) {
        const int *i = mesh->triangles + 3 * t;
        fprintf(file, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", i[0] + 1, i[0] + 1, i[0] + 1, i[1] + 1, i[1] + 1, i[1] + 1, i[2] + 1,
                i[2] + 1, i[2] + 1);
    }
    const bool bad = ferror(file) != 0;
    if (fclose(file) != 0 || bad) {
        remove(path);
        snprintf(error, MESH_TEXT, "%.200s: writing failed (disk full?)", path);
        return false;
    }
    return true;
}

static bool write_ply(const char *path, const springls_mesh *mesh, const float *colors, char error[MESH_TEXT])
{
    const struct mesh_ply ply = {.positions = mesh->positions,
                                 .vertex_count = (size_t)mesh->vertex_count,
                                 .indices = (const uint32_t *)mesh->triangles,
                                 .triangle_count = (size_t)mesh->triangle_count,
                                 .normals = mesh->normals,
                                 .colors = colors,
                                 .originals = mesh->correspondences,
                                 .comment = "a_x a_y a_z: where each point was at the start"};
    return mesh_write_ply(path, &ply, error);
}

bool viewer_save(struct viewer_model *model, const char *path)
{
    springls_mesh mesh;
    const bool obj = ends_with(path, ".obj");
    if (!obj && !ends_with(path, ".ply")) {
        snprintf(model->error, sizeof model->error, "%.200s: the name should end with .ply or .obj", path);
        return false;
    }
    if (!viewer_model_finish(model) || !viewer_model_check(model, springls_extract_mesh(model->ctx, &mesh))) {
        return false;
    }
    float *colors = viewer_model_colors(model, &mesh);
    const bool good = obj ? write_obj(path, &mesh, colors, model->error) : write_ply(path, &mesh, colors, model->error);
    free(colors);
    springls_mesh_free(model->ctx, &mesh);
    return good;
}
