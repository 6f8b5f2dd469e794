/* points.c - writes what corresponds: a mesh, particles and plain tables for each subject, and weights of the modes. */
#include "atlas/atlas.h"

#include "base/write_error.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_NAME = 200 };

/* Closes a file. Removes it and prints one line if it could not be written. */
static bool close_table(FILE *file, const char *path)
{
    const bool written = !ferror(file);
    if (fclose(file) == 0 && written) { return true; }
    partial_file_remove(path);
    return cli_write_failed("atlas", path);
}

/* Writes points and, beside them, the places of the mean shape that they correspond to. */
static bool write_table(const char *folder, const char *name, const char *first, const float *points, const float *means, int count)
{
    char path[1024];
    FILE *file = fopen(run_path(folder, name, path, sizeof path), "w");
    if (!file) {
        return cli_write_failed("atlas", path);
    }
    fprintf(file, "%s,x_mm,y_mm,z_mm,mean_x_mm,mean_y_mm,mean_z_mm\n", first);
    for (int i = 0; i < count; ++i) {
        const float *x = points + 3 * i, *a = means + 3 * i;
        fprintf(file, "%d,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", i, (double)x[0], (double)x[1], (double)x[2], (double)a[0], (double)a[1],
                (double)a[2]);
    }
    return close_table(file, path);
}

static bool write_ply(const char *folder, const char *name, const struct shape_mesh *mesh, const float *points, int count,
                      const float *means)
{
    char path[1024], error[MESH_TEXT];
    const struct mesh_arrays ply = {.positions = points, .vertex_count = (size_t)count,
                                 .indices = mesh ? (const uint32_t *)(const void *)mesh->triangles : NULL,
                                 .triangle_count = mesh ? (size_t)mesh->triangle_count : 0, .originals = means,
                                 .comment = "millimetres; a: the corresponding place on the mean shape"};
    return mesh_write_ply(run_path(folder, name, path, sizeof path), &ply, error) || atlas_fail("%s", error);
}

/* Computes the means of the triangles' corners. */
static float *centroids(const struct shape_mesh *mesh)
{
    float *places = malloc((3 * (size_t)mesh->triangle_count + 1) * sizeof *places);
    for (int i = 0; places && i < 3 * mesh->triangle_count; ++i) {
        const int *corner = mesh->triangles + 3 * (i / 3), axis = i % 3;
        const float *x = mesh->positions + axis;
        places[i] = (x[3 * corner[0]] + x[3 * corner[1]] + x[3 * corner[2]]) / 3.0f;
    }
    return places;
}

bool atlas_write_vertices(const char *folder, const char *name, const struct shape_mesh *mean, const float *shape)
{
    char ply[MAX_NAME], table[MAX_NAME];
    snprintf(ply, sizeof ply, "%s.ply", name);
    snprintf(table, sizeof table, "%s.csv", name);
    return write_ply(folder, ply, mean, shape, mean->vertex_count, mean->positions)
        && write_table(folder, table, "vertex", shape, mean->positions, mean->vertex_count);
}

bool atlas_write_particles(const char *folder, const char *name, const struct shape_mesh *mean, const float *particles)
{
    char ply[MAX_NAME], table[MAX_NAME];
    float *places = centroids(mean);
    snprintf(ply, sizeof ply, "%s.ply", name);
    snprintf(table, sizeof table, "%s.csv", name);
    const bool good = (places || atlas_no_memory()) && write_ply(folder, ply, NULL, particles, mean->triangle_count, places)
                   && write_table(folder, table, "springl", particles, places, mean->triangle_count);
    free(places);
    return good;
}

bool atlas_write_weights(const char *folder, const struct atlas *atlas, const char *const *names, float *const *shapes, int count)
{
    const int modes = atlas->model.modes;
    char path[1024];
    double weights[ATLAS_MAX_MODES] = {0.0};
    FILE *file = fopen(run_path(folder, "weights.csv", path, sizeof path), "w");
    if (!file) {
        return cli_write_failed("atlas", path);
    }
    fputs("subject", file);
    for (int m = 0; m < modes; ++m) {
        fprintf(file, ",mode%d", m + 1);
    }
    fputc('\n', file);
    for (int s = 0; s < count; ++s) {
        shape_model_weights(&atlas->model, shapes[s], modes, weights);
        fputs(names[s], file);
        for (int m = 0; m < modes; ++m) {
            fprintf(file, ",%.6g", weights[m]);
        }
        fputc('\n', file);
    }
    return close_table(file, path);
}

void atlas_short_name(const char *name, int number, char *text, size_t size)
{
    const char *slash = strrchr(name, '/'), *base = slash ? slash + 1 : name;
    base += strspn(base, "0123456789") == 3 && base[3] == '_' ? 4 : 0; /* named here before */
    snprintf(text, size, "%03d_%.*s", number, (int)strcspn(base, "."), base);
    for (char *c = text; *c; ++c) {
        *c = *c == ':' ? '_' : *c;
    }
}
