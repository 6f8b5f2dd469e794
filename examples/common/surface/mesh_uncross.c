#include "surface/mesh_uncross.h"

#include "base/vec3.h"
#include "surface/mesh_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 12 };

struct uncross {
    float *positions;
    const int *triangles;
    int vertex_count, triangle_count;
    unsigned char *marks; /* of vertices */
    float *before;        /* places of all vertices */
    double *sums;         /* 4 a vertex: the places of its neighbors, and how many */
};

static bool has_area(const struct uncross *u, const int *t)
{
    return vec3_triangle_area(u->positions + 3 * (size_t)t[0], u->positions + 3 * (size_t)t[1], u->positions + 3 * (size_t)t[2]) > 0.0;
}

/* Marks the vertices of what is wrong; returns how much is, -1: memory. */
static int mark(const struct uncross *u, int *crossings)
{
    memset(u->marks, 0, (size_t)u->vertex_count);
    *crossings = mesh_mark_crossings(u->positions, u->triangles, u->triangle_count, u->marks);
    int wrong = *crossings;
    for (int i = 0; wrong >= 0 && i < u->triangle_count; ++i) {
        const int *t = u->triangles + 3 * (size_t)i;
        if (!has_area(u, t)) {
            ++wrong;
            u->marks[t[0]] = u->marks[t[1]] = u->marks[t[2]] = 1;
        }
    }
    return wrong;
}

/* Moves marked vertices half the way to the mean of their neighbors. */
static void smooth(const struct uncross *u, float furthest)
{
    const float half = 0.5f;
    memset(u->sums, 0, 4 * (size_t)u->vertex_count * sizeof *u->sums);
    for (int i = 0; i < 3 * u->triangle_count; ++i) {
        const int v = u->triangles[i], next = u->triangles[i % 3 == 2 ? i - 2 : i + 1];
        for (int k = 0; u->marks[v] && k < 4; ++k) {
            u->sums[4 * (size_t)v + (size_t)k] += k < 3 ? (double)u->positions[3 * (size_t)next + (size_t)k] : 1.0;
        }
    }
    for (int v = 0; v < u->vertex_count; ++v) {
        const double *sum = u->sums + 4 * (size_t)v;
        const float *from = u->before + 3 * (size_t)v;
        float *at = u->positions + 3 * (size_t)v, way[3];
        if (!(sum[3] > 0.0)) {
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            way[k] = at[k] + half * ((float)(sum[k] / sum[3]) - at[k]) - from[k];
        }
        const float length = sqrtf(vec3_dot(way, way));
        vec3_add_scaled(from, length > furthest ? furthest / length : 1.0f, way, at);
    }
}

bool mesh_uncross(float *positions, int vertex_count, const int *triangles, int triangle_count, double furthest)
{
    const size_t vertices = (size_t)vertex_count + 1;
    struct uncross u = {.positions = positions, .triangles = triangles, .vertex_count = vertex_count, .triangle_count = triangle_count};
    int first_pairs = 0;
    u.marks = malloc(vertices);
    u.before = malloc(3 * vertices * sizeof *u.before);
    u.sums = malloc(4 * vertices * sizeof *u.sums);
    int wrong = u.marks && u.before && u.sums ? mark(&u, &first_pairs) : -1;
    const int first = wrong;
    int pairs = first_pairs;
    if (wrong > 0) {
        memcpy(u.before, positions, 3 * (size_t)vertex_count * sizeof *positions);
    }
    for (int i = 0; wrong > 0 && i < ROUNDS; ++i) {
        smooth(&u, (float)furthest);
        wrong = mark(&u, &pairs);
    }
    if (first > 0 && (wrong < 0 || wrong >= first || pairs > first_pairs)) {
        memcpy(positions, u.before, 3 * (size_t)vertex_count * sizeof *positions);
    }
    free(u.marks);
    free(u.before);
    free(u.sums);
    return wrong >= 0;
}
