#include "surface/mesh_simplify.h"

#include "surface/mesh_check.h"

#include <meshoptimizer.h>

#include <stdlib.h>
#include <string.h>

/* A mesh that is being thinned out: as it was, and as it may become. */
struct thinning {
    const float *positions;
    const int *indices;
    int vertex_count, triangle_count;
    unsigned *left;   /* 3 a triangle */
    float *places;    /* of the vertices left */
    int *corners, *number, *kept; /* triangles left by those; their numbers, -1: none; what each was */
    int vertices_left, triangles_left;
};

/* Lists the vertices that triangles left use. */
static void compact(struct thinning *t)
{
    t->vertices_left = 0;
    for (int v = 0; v < t->vertex_count; ++v) {
        t->number[v] = -1;
    }
    for (int i = 0; i < 3 * t->triangles_left; ++i) {
        const unsigned v = t->left[i];
        if (t->number[v] < 0) {
            memcpy(t->places + 3 * (size_t)t->vertices_left, t->positions + 3 * (size_t)v, 3 * sizeof *t->places);
            t->kept[t->vertices_left] = (int)v;
            t->number[v] = t->vertices_left++;
        }
        t->corners[i] = t->number[v];
    }
}

/* Thins out to a target, and finds whether the result is as the mesh was. Returns false if memory is short. */
static bool try_target(struct thinning *t, int triangles, float error, const struct mesh_check *before, bool *good)
{
    struct mesh_check after;
    t->triangles_left = (int)(meshopt_simplify(t->left, (const unsigned *)t->indices, 3 * (size_t)t->triangle_count, t->positions,
                                               (size_t)t->vertex_count, 3 * sizeof *t->positions, 3 * (size_t)triangles, error, 0, NULL)
                              / 3);
    compact(t);
    *good = false;
    if (!mesh_check(t->places, t->vertices_left, t->corners, t->triangles_left, &after)) {
        return false;
    }
    *good = t->triangles_left > 0 && after.open_edges == 0 && after.intersections <= before->intersections
            && after.components == before->components && after.euler == before->euler;
    return true;
}

static bool allocate(struct thinning *t)
{
    const size_t vertices = (size_t)t->vertex_count + 1, corners = 3 * (size_t)t->triangle_count + 1;
    t->left = malloc(corners * sizeof *t->left);
    t->places = malloc(3 * vertices * sizeof *t->places);
    t->corners = malloc(corners * sizeof *t->corners);
    t->number = malloc(vertices * sizeof *t->number);
    return t->left && t->places && t->corners && t->number;
}

bool mesh_simplify(float *positions, int *vertex_count, int *triangle_indices, int *triangle_count, int triangles, double tolerance,
                   int *kept)
{
    static const double shares[] = {1.0, 0.97, 0.93, 0.88}; /* of the target: other merges, which may not cross */
    const int tries = 10, others = (int)(sizeof shares / sizeof *shares);
    struct thinning t = {.positions = positions, .indices = triangle_indices, .vertex_count = *vertex_count,
                         .triangle_count = *triangle_count, .kept = kept};
    struct mesh_check before;
    bool good = false, fine = allocate(&t) && mesh_check(positions, *vertex_count, triangle_indices, *triangle_count, &before);
    const float scale = fine ? meshopt_simplifyScale(positions, (size_t)*vertex_count, 3 * sizeof *positions) : 1.0f;
    float error = tolerance > 0.0 ? (float)tolerance / scale : 1.0f;
    for (int i = 0; fine && !good && i < tries && triangles < *triangle_count; ++i) {
        fine = try_target(&t, i < others ? (int)(shares[i] * triangles) : triangles, error, &before, &good);
        triangles += triangles > 0 && i >= others - 1 ? (*triangle_count - triangles) / 4 + 1 : 0;
        error *= tolerance > 0.0 ? 0.7f : 1.0f;
    }
    if (fine && good) {
        memcpy(positions, t.places, 3 * (size_t)t.vertices_left * sizeof *positions);
        memcpy(triangle_indices, t.corners, 3 * (size_t)t.triangles_left * sizeof *triangle_indices);
        *vertex_count = t.vertices_left;
        *triangle_count = t.triangles_left;
    }
    for (int v = 0; fine && !good && v < *vertex_count; ++v) {
        kept[v] = v;
    }
    free(t.left);
    free(t.places);
    free(t.corners);
    free(t.number);
    return fine;
}
