/* solid_mesh.c - the mesh of a solid: extracted, without specks and slivers, measured. */
#include "solids/solid_mesh.h"

#include "base/cli.h"
#include "springls/run_options.h"
#include "surface/mesh_check.h"
#include "surface/mesh_simplify.h"
#include "surface/mesh_slivers.h"
#include "surface/mesh_uncross.h"
#include "surface/outer_skin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int solid_contouring(const char *program, const char *params_name, const char *set, springls_params *params,
                     springls_contouring *contouring)
{
    springls_params chosen = *params;
    chosen.contouring = strcmp(params_name, "paper") == 0 ? SPRINGLS_CONTOURING_LEVEL_SET : SPRINGLS_CONTOURING_SPRINGLS;
    const int status = run_set_members(program, set, &chosen);
    *contouring = chosen.contouring;
    params->contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    return status;
}

bool solid_extract(springls_context *ctx, springls_contouring contouring, double smallest, springls_mesh *mesh, int *dropped)
{
    const springls_params before = springls_get_params(ctx);
    springls_params params = before;
    int count = 0;
    params.contouring = contouring;
    memset(mesh, 0, sizeof *mesh);
    if (springls_set_params(ctx, &params) != SPRINGLS_OK || springls_extract_mesh(ctx, mesh) != SPRINGLS_OK
        || springls_set_params(ctx, &before) != SPRINGLS_OK) {
        return false;
    }
    if (contouring != SPRINGLS_CONTOURING_LEVEL_SET) {
        const double largest = mesh_largest_volume(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count);
        count = largest < 0.0 ? -1
                              : mesh_drop_specks(mesh->positions, mesh->vertex_count, mesh->triangles, &mesh->triangle_count,
                                                 fmin(smallest, OUTER_SKIN_SPECK_SHARE * largest));
    }
    if (dropped) {
        *dropped = count;
    }
    return count >= 0;
}

/* Moves the three numbers of each vertex that is left to its new place. Returns false if memory is short. */
static bool gather(float *values, const int *kept, int count)
{
    float *moved = malloc(((size_t)count + 1) * 3 * sizeof *moved);
    for (int v = 0; moved && values && v < count; ++v) {
        memcpy(moved + 3 * (size_t)v, values + 3 * (size_t)kept[v], 3 * sizeof *moved);
    }
    const bool fine = moved != NULL;
    if (moved && values) {
        memcpy(values, moved, (size_t)count * 3 * sizeof *moved);
    }
    free(moved);
    return fine;
}

static bool gather_all(springls_mesh *mesh, const int *kept, float *colors)
{
    return gather(mesh->normals, kept, mesh->vertex_count) && gather(mesh->correspondences, kept, mesh->vertex_count)
           && gather(colors, kept, mesh->vertex_count);
}

bool solid_remove_slivers(springls_mesh *mesh, double spacing, float *colors)
{
    const double tolerance = 0.03, furthest = 0.5; /* voxels */
    int *kept = malloc(((size_t)mesh->vertex_count + 1) * sizeof *kept);
    const bool fine = kept
                      && mesh_remove_slivers(mesh->positions, &mesh->vertex_count, mesh->triangles, &mesh->triangle_count,
                                             tolerance * spacing, kept)
                      && gather_all(mesh, kept, colors)
                      && mesh_uncross(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, furthest * spacing);
    free(kept);
    return fine;
}

bool solid_thin_out(springls_mesh *mesh, int triangles, double tolerance, float *colors)
{
    int *kept = malloc(((size_t)mesh->vertex_count + 1) * sizeof *kept);
    const bool fine = kept
                      && mesh_simplify(mesh->positions, &mesh->vertex_count, mesh->triangles, &mesh->triangle_count, triangles, tolerance,
                                       kept)
                      && gather_all(mesh, kept, colors);
    free(kept);
    return fine;
}

static double area_of(const springls_mesh *mesh)
{
    double twice = 0.0;
    for (int t = 0; t < mesh->triangle_count; ++t) {
        const int *corner = mesh->triangles + 3 * (size_t)t;
        double u[3], v[3];
        for (int c = 0; c < 3; ++c) {
            const double a = (double)mesh->positions[3 * (size_t)corner[0] + (size_t)c];
            u[c] = (double)mesh->positions[3 * (size_t)corner[1] + (size_t)c] - a;
            v[c] = (double)mesh->positions[3 * (size_t)corner[2] + (size_t)c] - a;
        }
        twice += sqrt(pow(u[1] * v[2] - u[2] * v[1], 2.0) + pow(u[2] * v[0] - u[0] * v[2], 2.0) + pow(u[0] * v[1] - u[1] * v[0], 2.0));
    }
    return 0.5 * twice;
}

bool solid_measure(const springls_mesh *mesh, springls_measures *measures)
{
    memset(measures, 0, sizeof *measures);
    measures->volume = mesh_volume(mesh->positions, mesh->triangles, mesh->triangle_count);
    measures->area = area_of(mesh);
    measures->components = mesh_components(mesh->vertex_count, mesh->triangles, mesh->triangle_count);
    measures->euler = mesh->vertex_count - mesh->triangle_count / 2; /* a closed mesh has three edges for two triangles */
    return measures->components >= 0;
}
