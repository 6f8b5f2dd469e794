/* mesh_intake.h - reads the indexed mesh that springls_set_mesh is given: welds equal points, drops repeated triangles, and finds the
   edges. */
#ifndef SPRINGLS__INPUT_MESH_INTAKE_H
#define SPRINGLS__INPUT_MESH_INTAKE_H

#include "../runtime/algorithms.h"
#include "../runtime/errors.h"
#include "../runtime/finite.h"
#include "../runtime/memory.h"
#include "../model/bvh.h"
#include "../model/indexed_mesh.h"
#include "../model/transform.h"

/* Holds an edge: its corners (low < high), how many triangles use it, the first two of their half-edges, and how many
   triangles run from low to high less how many run from high to low. */
typedef struct springls__mesh_edge { int low, high, count, half[2], balance; } springls__mesh_edge;

/* Holds the working memory of one call. Half-edge h belongs to triangle h / 3 and runs from corner[h] to the next corner. */
typedef struct springls__mesh_intake {
    springls__v3 *point;        /* [position]  voxel coordinates                                                   */
    int *weld;                  /* [position]  the first position with the same coordinates                        */
    int *table;                 /* [table_size] hash table of positions, later of edges; -1: free                  */
    int *corner;                /* [3 * count] welded corners of the triangles without a repeated corner           */
    int *triangle;              /* [count]     their numbers in the caller's mesh                                  */
    int *edge;                  /* [3 * count] index into edges, by half-edge                                      */
    springls__mesh_edge *edges; /* [edge_count]                                                                    */
    uint8_t *turn;              /* [count]     1: exchange corners 1 and 2                                         */
    int *queue;                 /* [count]     triangles, part by part                                             */
    int positions, count, edge_count;
    size_t table_size;          /* a power of two                                                                  */
    springls__buffer memory[9];
} springls__mesh_intake;

SPRINGLS__FN void springls__mesh_intake_free(springls_context *ctx, springls__mesh_intake *m)
{
    int i;
    for (i = 0; i < 9; i++) springls__buffer_free(ctx, &m->memory[i]);
}

/* Allocates the working memory for a mesh of that many positions and triangles. */
SPRINGLS__FN springls_status springls__mesh_intake_reserve(springls_context *ctx, springls__mesh_intake *m, int positions,
                                                           int triangles)
{
    size_t n = (size_t)positions, t = (size_t)triangles;
    m->positions = positions;
    m->table_size = springls__table_size(n > 3 * t ? n : 3 * t);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[0], n, sizeof *m->point, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[1], n, sizeof *m->weld, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[2], m->table_size, sizeof *m->table, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[3], 3 * t, sizeof *m->corner, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[4], t, sizeof *m->triangle, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[5], 3 * t, sizeof *m->edge, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[6], 3 * t, sizeof *m->edges, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[7], t, sizeof *m->turn, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &m->memory[8], t, sizeof *m->queue, 0));
    m->point = (springls__v3 *)m->memory[0].data;
    m->weld = (int *)m->memory[1].data;
    m->table = (int *)m->memory[2].data;
    m->corner = (int *)m->memory[3].data;
    m->triangle = (int *)m->memory[4].data;
    m->edge = (int *)m->memory[5].data;
    m->edges = (springls__mesh_edge *)m->memory[6].data;
    m->turn = (uint8_t *)m->memory[7].data;
    m->queue = (int *)m->memory[8].data;
    return SPRINGLS_OK;
}

/* Converts a position of the caller to voxels. Fails when it is not finite, or too far away for float32 to resolve a
   twentieth of a voxel. */
SPRINGLS__FN springls_status springls__mesh_point(springls_context *ctx, const springls__window *window, const float *world,
                                                  int position, float voxel[3])
{
    const double furthest = 1e6; /* voxels */
    double x[3];
    int k;
    for (k = 0; k < 3; k++)
        if (!springls__finite_float(world[k]))
            return springls__fail(ctx, SPRINGLS_NON_FINITE, "position %d is not finite", position);
    springls__transform(window->to_voxel, (double)world[0], (double)world[1], (double)world[2], x);
    for (k = 0; k < 3; k++) {
        if (x[k] < -furthest || x[k] > furthest)
            return springls__fail(ctx, SPRINGLS_BAD_MESH, "position %d lies more than a million voxels from the grid", position);
        voxel[k] = (float)x[k] + 0.0f; /* no negative zero: equal points have equal bits */
    }
    return SPRINGLS_OK;
}

/* Returns the first position with the same coordinates as m->point[i], and enters i into the hash table if it is the first. */
SPRINGLS__FN int springls__mesh_first_equal(springls__mesh_intake *m, int i)
{
    const springls__v3 x = m->point[i];
    size_t mask = m->table_size - 1;
    size_t slot = springls__hash3(springls__float_bits(x.x), springls__float_bits(x.y), springls__float_bits(x.z)) & mask;
    for (; m->table[slot] >= 0; slot = (slot + 1) & mask) {
        springls__v3 other = m->point[m->table[slot]];
        if (other.x == x.x && other.y == x.y && other.z == x.z) break;
    }
    if (m->table[slot] < 0) m->table[slot] = i;
    return m->table[slot];
}

/* Checks every index and every used position, and welds positions that are equal. Writes m->point and m->weld, and the
   bounds of the mesh in voxels, of the grid where an input puts it. */
SPRINGLS__FN springls_status springls__mesh_weld(springls_context *ctx, springls__mesh_intake *m, const float *positions,
                                                 int position_count, size_t stride, const int *triangles,
                                                 int triangle_count, float lower[3], float upper[3])
{
    springls__window home = ctx->window;
    size_t slot;
    int i, j, k;
    springls__place_window(ctx, &home, ctx->home);
    for (i = 0; i < position_count; i++) m->weld[i] = -1;
    for (slot = 0; slot < m->table_size; slot++) m->table[slot] = -1;
    for (k = 0; k < 3; k++) { lower[k] = FLT_MAX; upper[k] = -FLT_MAX; }
    for (j = 0; j < 3 * triangle_count; j++) {
        float x[3] = { 0.0f, 0.0f, 0.0f };
        i = triangles[j];
        if (i < 0 || i >= position_count)
            return springls__fail(ctx, SPRINGLS_BAD_MESH, "triangle %d uses position %d of %d", j / 3, i, position_count);
        if (m->weld[i] >= 0) continue;
        SPRINGLS__TRY(springls__mesh_point(ctx, &home, springls__mesh_position(positions, stride, i), i, x));
        for (k = 0; k < 3; k++) {
            lower[k] = springls__min(lower[k], x[k]);
            upper[k] = springls__max(upper[k], x[k]);
        }
        m->point[i] = springls__v3_make(x[0], x[1], x[2]);
        m->weld[i] = springls__mesh_first_equal(m, i);
    }
    return SPRINGLS_OK;
}

/* Lists the triangles whose three welded corners differ. Writes m->corner, m->triangle and m->count. */
SPRINGLS__FN void springls__mesh_list_triangles(springls__mesh_intake *m, const int *triangles, int triangle_count)
{
    int j;
    m->count = 0;
    for (j = 0; j < triangle_count; j++) {
        int a = m->weld[triangles[3 * j]], b = m->weld[triangles[3 * j + 1]], c = m->weld[triangles[3 * j + 2]];
        if (a == b || b == c || c == a) continue;
        m->corner[3 * m->count] = a;
        m->corner[3 * m->count + 1] = b;
        m->corner[3 * m->count + 2] = c;
        m->triangle[m->count++] = j;
    }
}

/* Returns 1 when three corners ascend cyclically, as (1, 2, 3), (2, 3, 1) and (3, 1, 2) do; else -1. */
SPRINGLS__FN int springls__mesh_corner_order(const int c[3])
{
    return (c[0] < c[1]) + (c[1] < c[2]) + (c[2] < c[0]) == 2 ? 1 : -1;
}

/* Returns the first listed triangle with the same corners as triangle t, and enters t into the hash table if it is the first. */
SPRINGLS__FN int springls__mesh_first_alike(springls__mesh_intake *m, int t)
{
    const int *c = m->corner + 3 * t;
    const int low = springls__imin(springls__imin(c[0], c[1]), c[2]), high = springls__imax(springls__imax(c[0], c[1]), c[2]);
    const size_t mask = m->table_size - 1;
    size_t slot = springls__hash3((uint32_t)low, (uint32_t)high, (uint32_t)c[0] ^ (uint32_t)c[1] ^ (uint32_t)c[2]) & mask;
    for (; m->table[slot] >= 0; slot = (slot + 1) & mask) {
        const int *d = m->corner + 3 * m->table[slot];
        if (springls__imin(springls__imin(d[0], d[1]), d[2]) == low && springls__imax(springls__imax(d[0], d[1]), d[2]) == high
            && (d[0] ^ d[1] ^ d[2]) == (c[0] ^ c[1] ^ c[2])) break;
    }
    if (m->table[slot] < 0) m->table[slot] = t;
    return m->table[slot];
}

/* Keeps one of the listed triangles that have the same corners: the first that faces as most of them do. Where as many face
   either way, keeps one of each: a sheet with two sides. Overwrites m->edge and m->queue. */
SPRINGLS__FN void springls__mesh_drop_repeated(springls__mesh_intake *m)
{
    enum { FORWARD = 1, BACKWARD = 2 };
    int *facing = m->edge, t, k, n = 0;
    size_t slot;
    for (slot = 0; slot < m->table_size; slot++) m->table[slot] = -1;
    for (t = 0; t < m->count; t++) {
        facing[t] = 0;
        m->queue[t] = springls__mesh_first_alike(m, t);
        facing[m->queue[t]] += springls__mesh_corner_order(m->corner + 3 * t);
    }
    for (t = 0; t < m->count; t++)
        if (m->queue[t] == t) facing[t] = (facing[t] >= 0 ? FORWARD : 0) | (facing[t] <= 0 ? BACKWARD : 0);
    for (t = 0; t < m->count; t++) {
        int side = springls__mesh_corner_order(m->corner + 3 * t) > 0 ? FORWARD : BACKWARD;
        if (!(facing[m->queue[t]] & side)) continue;
        facing[m->queue[t]] &= ~side;
        for (k = 0; k < 3; k++) m->corner[3 * n + k] = m->corner[3 * t + k];
        m->triangle[n++] = m->triangle[t];
    }
    m->count = n;
}

/* Returns 1 when a half-edge runs from the lower corner of its edge to the higher, else -1. */
SPRINGLS__FN int springls__mesh_direction(const springls__mesh_intake *m, int half)
{
    return m->corner[half] < m->corner[springls__mesh_next(half)] ? 1 : -1;
}

/* Finds the edges of the listed triangles. Writes m->edges, m->edge and m->edge_count. */
SPRINGLS__FN void springls__mesh_edges(springls__mesh_intake *m)
{
    size_t mask = m->table_size - 1, slot;
    int h;
    for (slot = 0; slot < m->table_size; slot++) m->table[slot] = -1;
    m->edge_count = 0;
    for (h = 0; h < 3 * m->count; h++) {
        int a = m->corner[h], b = m->corner[springls__mesh_next(h)], low = a < b ? a : b, high = a < b ? b : a;
        springls__mesh_edge *edge;
        slot = springls__hash3((uint32_t)low, (uint32_t)high, 0u) & mask;
        while (m->table[slot] >= 0 && (m->edges[m->table[slot]].low != low || m->edges[m->table[slot]].high != high))
            slot = (slot + 1) & mask;
        if (m->table[slot] < 0) {
            m->table[slot] = m->edge_count;
            edge = &m->edges[m->edge_count++];
            memset(edge, 0, sizeof *edge);
            edge->low = low;
            edge->high = high;
        }
        m->edge[h] = m->table[slot];
        edge = &m->edges[m->edge[h]];
        if (edge->count < 2) edge->half[edge->count] = h;
        edge->count++;
    }
}

/* Computes the balance of every edge, of triangles turned as m->turn has it; returns how many edges are not balanced. */
SPRINGLS__FN int springls__mesh_balance(springls__mesh_intake *m)
{
    int e, h, unbalanced = 0;
    for (e = 0; e < m->edge_count; e++) m->edges[e].balance = 0;
    for (h = 0; h < 3 * m->count; h++)
        m->edges[m->edge[h]].balance += springls__mesh_direction(m, h) * (m->turn[h / 3] ? -1 : 1);
    for (e = 0; e < m->edge_count; e++) unbalanced += m->edges[e].balance != 0;
    return unbalanced;
}

/* Counts the connected components; triangles that share a point are connected. Overwrites m->weld with a union-find forest. */
SPRINGLS__FN int springls__mesh_components(springls__mesh_intake *m)
{
    int h, components = 0;
    for (h = 0; h < 3 * m->count; h++) m->weld[m->corner[h]] = -1;
    for (h = 0; h < 3 * m->count; h++) {
        if (m->weld[m->corner[h]] >= 0) continue;
        m->weld[m->corner[h]] = m->corner[h];
        components++;
    }
    for (h = 0; h < 3 * m->count; h++)
        components -= springls__join_trees(m->weld, m->corner[h], m->corner[springls__mesh_next(h)]);
    return components;
}

/* Returns twice the area of a listed triangle, voxel^2. */
SPRINGLS__FN double springls__mesh_double_area(const springls__mesh_intake *m, int triangle)
{
    springls__tri t;
    t.a = m->point[m->corner[3 * triangle]];
    t.b = m->point[m->corner[3 * triangle + 1]];
    t.c = m->point[m->corner[3 * triangle + 2]];
    return (double)springls__length(springls__tri_area2(t));
}

/* Writes the corners of a listed triangle, turned as m->turn has it. */
SPRINGLS__FN void springls__mesh_corners(const springls__mesh_intake *m, int t, springls__v3 q[3])
{
    int k;
    for (k = 0; k < 3; k++) q[k] = m->point[m->corner[3 * t + (m->turn[t] && k ? 3 - k : k)]];
}

/* Writes the area normal (p1 - p0) x (p2 - p0) of three points. */
SPRINGLS__FN void springls__mesh_area_normal(double p[3][3], double normal[3])
{
    int k;
    for (k = 0; k < 3; k++) {
        int u = (k + 1) % 3, w = (k + 2) % 3;
        normal[k] = (p[1][u] - p[0][u]) * (p[2][w] - p[0][w]) - (p[1][w] - p[0][w]) * (p[2][u] - p[0][u]);
    }
}

/* Loads the corners of a listed triangle, turned as m->turn has it, less `center`, and its area normal. Voxels. */
SPRINGLS__FN void springls__mesh_triangle_at(const springls__mesh_intake *m, int t, const double center[3], double p[3][3],
                                             double normal[3])
{
    springls__v3 q[3];
    int i;
    springls__mesh_corners(m, t, q);
    for (i = 0; i < 3; i++) {
        p[i][0] = (double)q[i].x - center[0];
        p[i][1] = (double)q[i].y - center[1];
        p[i][2] = (double)q[i].z - center[2];
    }
    springls__mesh_area_normal(p, normal);
}

/* Loads the corners of a listed triangle as it came, less `center`, and its area normal. World units. */
SPRINGLS__FN void springls__mesh_world_triangle(const springls__mesh_intake *m, const float *positions, size_t stride, int t,
                                                const double center[3], double p[3][3], double normal[3])
{
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            p[i][k] = (double)springls__mesh_position(positions, stride, m->corner[3 * t + i])[k] - center[k];
    springls__mesh_area_normal(p, normal);
}

/* Returns the area of the listed triangles, and their center weighted by area. World units. */
SPRINGLS__FN double springls__mesh_area(const springls__mesh_intake *m, const float *positions, size_t stride, double center[3])
{
    static const double origin[3] = { 0.0, 0.0, 0.0 };
    double sum[3] = { 0.0, 0.0, 0.0 }, total = 0.0, p[3][3], n[3];
    int t, k;
    for (t = 0; t < m->count; t++) {
        double a;
        springls__mesh_world_triangle(m, positions, stride, t, origin, p, n);
        a = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        total += a;
        for (k = 0; k < 3; k++) sum[k] += a * (p[0][k] + p[1][k] + p[2][k]) / 3.0;
    }
    for (k = 0; k < 3; k++) center[k] = total > 0.0 ? sum[k] / total : 0.0;
    return 0.5 * total;
}

/* Returns the signed volume by the divergence theorem about `center`, of the triangles as they came: positive when they face
   outwards. World units. */
SPRINGLS__FN double springls__mesh_volume(const springls__mesh_intake *m, const float *positions, size_t stride,
                                          const double center[3])
{
    double volume = 0.0, p[3][3], n[3];
    int t, k;
    for (t = 0; t < m->count; t++) {
        springls__mesh_world_triangle(m, positions, stride, t, center, p, n);
        for (k = 0; k < 3; k++) volume += n[k] * p[0][k] / 6.0;
    }
    return volume;
}

#endif
