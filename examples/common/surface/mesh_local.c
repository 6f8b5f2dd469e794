#include "surface/mesh_local.h"

#include "surface/plain_mesh.h"
#include "surface/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Finds whether floats resolve a mesh's places badly, and an origin of whole numbers in its middle. */
static bool is_distant(const struct plain_mesh *f, double origin[3])
{
    const double least = 512.0; /* sizes: a hundredth of a voxel of 128 along the mesh */
    double size = 0.0, furthest = 0.0;
    for (size_t k = 0; k < 3; ++k) {
        double lower = DBL_MAX, upper = -DBL_MAX;
        for (size_t i = 0; i < 3 * f->triangle_count; ++i) {
            const double x = f->places[3 * (size_t)f->indices[i] + k];
            lower = fmin(lower, x);
            upper = fmax(upper, x);
            furthest = fmax(furthest, fabs(x));
        }
        size = fmax(size, upper - lower);
        origin[k] = floor(0.5 * lower + 0.5 * upper);
    }
    return size > 0.0 && furthest < 1e15 && furthest > least * size;
}

static const double *sort_places; /* of compare_places */

static int compare_places(const void *a, const void *b)
{
    const uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    const double *x = sort_places + 3 * (size_t)i, *y = sort_places + 3 * (size_t)j;
    for (int k = 0; k < 3; ++k) {
        if (x[k] != y[k]) {
            return x[k] < y[k] ? -1 : 1;
        }
    }
    return i < j ? -1 : i > j;
}

/* Joins vertices at the same place: writes the first of them for each. */
static bool join(const struct plain_mesh *f, uint32_t *first)
{
    uint32_t *order = malloc((f->vertex_count + 1) * sizeof *order);
    if (!order) {
        return false;
    }
    for (size_t v = 0; v < f->vertex_count; ++v) {
        order[v] = (uint32_t)v;
    }
    sort_places = f->places;
    qsort(order, f->vertex_count, sizeof *order, compare_places);
    for (size_t i = 0; i < f->vertex_count; ++i) {
        const bool same =
            i > 0 && memcmp(f->places + 3 * (size_t)order[i], f->places + 3 * (size_t)order[i - 1], 3 * sizeof *f->places) == 0;
        first[order[i]] = same ? first[order[i - 1]] : order[i];
    }
    free(order);
    return true;
}

/* Takes the place and color of a vertex over, unless that is done. place: of each vertex in the mesh, + 1; 0: not there. */
static uint32_t take_vertex(const struct plain_mesh *f, const double origin[3], uint32_t from, uint32_t *place, struct mesh *mesh)
{
    if (place[from] == 0) {
        const size_t to = mesh->vertex_count++;
        for (size_t k = 0; k < 3; ++k) {
            mesh->positions[3 * to + k] = (float)(f->places[3 * (size_t)from + k] - origin[k]);
        }
        if (mesh->colors) {
            memcpy(mesh->colors + 3 * to, f->colors + 3 * (size_t)from, 3 * sizeof *mesh->colors);
        }
        place[from] = (uint32_t)to + 1;
    }
    return place[from] - 1;
}

/* Makes the mesh, less the origin, of the vertices that triangles name; it takes over the indices. */
static bool make_mesh(struct plain_mesh *f, const double origin[3], struct mesh *mesh)
{
    uint32_t *first = malloc((f->vertex_count + 1) * sizeof *first), *place = calloc(f->vertex_count + 1, sizeof *place);
    memset(mesh, 0, sizeof *mesh);
    mesh->positions = malloc((f->vertex_count + 1) * 3 * sizeof *mesh->positions);
    mesh->colors = f->colors ? malloc((f->vertex_count + 1) * 3 * sizeof *mesh->colors) : NULL;
    const bool fine = first && place && mesh->positions && (mesh->colors || !f->colors) && join(f, first);
    for (size_t t = 0; fine && t < f->triangle_count; ++t) {
        const uint32_t *from = f->indices + 3 * t;
        uint32_t corner[3] = {first[from[0]], first[from[1]], first[from[2]]};
        if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
            ++mesh->dropped;
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            corner[k] = take_vertex(f, origin, corner[k], place, mesh);
        }
        memcpy(f->indices + 3 * mesh->triangle_count++, corner, sizeof corner);
    }
    free(first);
    free(place);
    if (!fine) {
        mesh_free(mesh);
        return false;
    }
    mesh->indices = f->indices;
    f->indices = NULL;
    return true;
}

/* Makes a mesh, of one triangle or more, of what plain_mesh_read read. */
static bool take_plain(const char *path, struct plain_mesh *plain, const double origin[3], struct mesh *mesh, char error[MESH_TEXT])
{
    if (plain->triangle_count == 0) {
        return scene_fail(error, path, plain->not_finite ? "no triangles: all have corners that are not finite" : "no triangles");
    }
    if (!make_mesh(plain, origin, mesh)) {
        return scene_fail(error, path, "not enough memory");
    }
    mesh->not_finite = plain->not_finite;
    if (mesh->triangle_count == 0) {
        mesh_free(mesh);
        return scene_fail(error, path, "no triangles: all of them are degenerate");
    }
    return true;
}

/* Returns whether a mesh lacks triangles that the file has: assimp leaves out faces of OBJ before an empty line behind a backslash. */
static bool lacks_faces(const struct mesh *mesh, const struct plain_mesh *plain)
{
    return mesh->triangle_count + mesh->dropped < plain->triangle_count;
}

bool mesh_read_local(const char *path, struct mesh *mesh, double origin[3], char error[MESH_TEXT])
{
    struct plain_mesh plain;
    const bool is_plain = plain_mesh_read(path, &plain), distant = is_plain && !plain.single && is_distant(&plain, origin);
    if (!distant) {
        origin[0] = origin[1] = origin[2] = 0.0;
    }
    bool taken = !distant && mesh_read(path, mesh, error);
    if (taken && is_plain && lacks_faces(mesh, &plain)) {
        mesh_free(mesh);
        taken = false;
    }
    taken = taken || (is_plain && take_plain(path, &plain, origin, mesh, error));
    plain_mesh_free(&plain);
    return taken;
}

void mesh_warn_not_finite(const char *program, const char *path, const struct mesh *mesh)
{
    if (mesh->not_finite > 0) {
        fprintf(stderr, "%s: warning: %s: %zu triangle%s left out: corners that are not finite\n", program, path, mesh->not_finite,
                mesh->not_finite == 1 ? " is" : "s are");
    }
}

double mesh_float_step(const struct mesh *mesh)
{
    double furthest = 0.0;
    for (size_t i = 0; i < 3 * mesh->vertex_count; ++i) {
        furthest = fmax(furthest, fabs((double)mesh->positions[i]));
    }
    return furthest * (double)FLT_EPSILON;
}
