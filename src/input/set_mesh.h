/* set_mesh.h - builds the springls and the level set from an indexed triangle mesh.

   The sign of phi comes from the generalized winding number w, for clean and for damaged meshes alike. An edge is balanced
   when as many triangles run along it in one direction as in the other.
     Every edge balanced: w is a whole number that changes only at the surface. Two overlapping balls free of surface lie on
     one side, so most voxels take the sign of a neighbor and w is computed for few.
     Some edge unbalanced: the surface is open. The level w = 1/2 closes its holes like a soap film, and phi is the distance
     to the triangles times |1 - 2 w|, then re-distanced: its zero level is the triangles and the film together. The holes
     are filled with springls here, because the first fill_gaps would give them correspondences at the rims.

   Bad input leaves the model unchanged; when memory runs out, or nothing is inside, the model is empty. */
#ifndef SPRINGLS__INPUT_SET_MESH_H
#define SPRINGLS__INPUT_SET_MESH_H

#include "../runtime/finite.h"
#include "../runtime/algorithms.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/resumable.h"
#include "../model/bvh.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/indexed_mesh.h"
#include "../model/mesh_distance.h"
#include "../model/transform.h"
#include "../model/winding_number.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/sleep.h"
#include "set_level_set.h"
#include "split_input.h"

/* Holds an edge: its corners (low < high), how many triangles use it, the first two of their half-edges, and how many
   triangles run from low to high less how many run from high to low. */
typedef struct springls__mesh_edge { int low, high, count, half[2], balance; } springls__mesh_edge;

enum { SPRINGLS__MESH_UNREACHED = 2 }; /* a value of springls__mesh_intake.turn */

/* Holds the working memory of one call. Half-edge h belongs to triangle h / 3 and runs from corner[h] to the next corner. */
typedef struct springls__mesh_intake {
    springls__v3 *point;        /* [position]  voxel coordinates                                                   */
    int *weld;                  /* [position]  the first position with the same coordinates                        */
    int *table;                 /* [table_size] hash table of positions, later of edges; -1: free                  */
    int *corner;                /* [3 * count] welded corners of the triangles without a repeated corner           */
    int *triangle;              /* [count]     their numbers in the caller's mesh                                  */
    int *edge;                  /* [3 * count] index into edges, by half-edge                                      */
    springls__mesh_edge *edges; /* [edge_count]                                                                    */
    uint8_t *turn;              /* [count]     1: exchange corners 1 and 2; SPRINGLS__MESH_UNREACHED: undecided    */
    int *queue;                 /* [count]     triangles of the patch that springls__mesh_orient walks over        */
    int count, edge_count;
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
SPRINGLS__FN springls_status springls__mesh_point(springls_context *ctx, const float *world, int position, float voxel[3])
{
    const double furthest = 1e6; /* voxels */
    double x[3];
    int k;
    for (k = 0; k < 3; k++)
        if (!springls__finite_float(world[k]))
            return springls__fail(ctx, SPRINGLS_NON_FINITE, "position %d is not finite", position);
    springls__transform(ctx->window.to_voxel, (double)world[0], (double)world[1], (double)world[2], x);
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
   bounds of the mesh in voxels. */
SPRINGLS__FN springls_status springls__mesh_weld(springls_context *ctx, springls__mesh_intake *m, const float *positions,
                                                 int position_count, size_t stride, const int *triangles,
                                                 int triangle_count, float lower[3], float upper[3])
{
    size_t slot;
    int i, j, k;
    for (i = 0; i < position_count; i++) m->weld[i] = -1;
    for (slot = 0; slot < m->table_size; slot++) m->table[slot] = -1;
    for (k = 0; k < 3; k++) { lower[k] = FLT_MAX; upper[k] = -FLT_MAX; }
    for (j = 0; j < 3 * triangle_count; j++) {
        float x[3] = { 0.0f, 0.0f, 0.0f };
        i = triangles[j];
        if (i < 0 || i >= position_count)
            return springls__fail(ctx, SPRINGLS_BAD_MESH, "triangle %d uses position %d of %d", j / 3, i, position_count);
        if (m->weld[i] >= 0) continue;
        SPRINGLS__TRY(springls__mesh_point(ctx, springls__mesh_position(positions, stride, i), i, x));
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

/* Orients the patch of triangles around `seed` like the seed; a patch is connected through edges of two triangles. Writes
   the patch to m->queue, m->turn of its triangles, and in area[0] and area[1] twice the area not turned and turned, voxel^2.
   Returns the number of triangles in the patch. */
SPRINGLS__FN int springls__mesh_orient_patch(springls__mesh_intake *m, int seed, double area[2])
{
    int head = 0, tail = 0, k;
    area[0] = area[1] = 0.0;
    m->turn[seed] = 0;
    m->queue[tail++] = seed;
    while (head < tail) {
        int t = m->queue[head++];
        area[m->turn[t]] += springls__mesh_double_area(m, t);
        for (k = 0; k < 3; k++) {
            int h = 3 * t + k, other, same;
            const springls__mesh_edge *edge = &m->edges[m->edge[h]];
            if (edge->count != 2) continue;
            other = edge->half[0] == h ? edge->half[1] : edge->half[0];
            if (m->turn[other / 3] != SPRINGLS__MESH_UNREACHED) continue;
            same = springls__mesh_direction(m, h) == springls__mesh_direction(m, other);
            m->turn[other / 3] = (uint8_t)(m->turn[t] ^ same);
            m->queue[tail++] = other / 3;
        }
    }
    return tail;
}

/* Writes m->turn so that neighbors agree; of each patch the part with the smaller area is turned. */
SPRINGLS__FN void springls__mesh_orient(springls__mesh_intake *m)
{
    double area[2];
    int seed, patch, i;
    memset(m->turn, SPRINGLS__MESH_UNREACHED, (size_t)m->count);
    for (seed = 0; seed < m->count; seed++) {
        if (m->turn[seed] != SPRINGLS__MESH_UNREACHED) continue;
        patch = springls__mesh_orient_patch(m, seed, area);
        if (area[1] > area[0])
            for (i = 0; i < patch; i++) m->turn[m->queue[i]] ^= 1;
    }
}

/* Loads the corners of a listed triangle, less `center`, and its area normal (p1 - p0) x (p2 - p0). World units. */
SPRINGLS__FN void springls__mesh_world_triangle(const springls__mesh_intake *m, const float *positions, size_t stride, int t,
                                                const double center[3], double p[3][3], double normal[3])
{
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            p[i][k] = (double)springls__mesh_position(positions, stride, m->corner[3 * t + i])[k] - center[k];
    for (k = 0; k < 3; k++) {
        int u = (k + 1) % 3, w = (k + 2) % 3;
        normal[k] = (p[1][u] - p[0][u]) * (p[2][w] - p[0][w]) - (p[1][w] - p[0][w]) * (p[2][u] - p[0][u]);
    }
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

/* Returns the signed volume by the divergence theorem about `center`, world units; positive when the triangles face outwards.
   turned: orients the triangles as m->turn has it, not as they came. */
SPRINGLS__FN double springls__mesh_volume(const springls__mesh_intake *m, const float *positions, size_t stride,
                                          const double center[3], bool turned)
{
    double volume = 0.0, p[3][3], n[3];
    int t, k;
    for (t = 0; t < m->count; t++) {
        double v = 0.0;
        springls__mesh_world_triangle(m, positions, stride, t, center, p, n);
        for (k = 0; k < 3; k++) v += n[k] * p[0][k];
        volume += turned && m->turn[t] ? -v : v;
    }
    return volume / 6.0;
}

/* ---- the call ---- */

/* Logs what was repaired. repaired: the triangles' orientation was. */
SPRINGLS__FN void springls__mesh_log(const springls_context *ctx, const springls_mesh_report *r, bool repaired)
{
    if (!r->closed)
        springls__log(ctx, 2, "mesh not closed (%d boundary, %d non-manifold, %d misoriented edges): inside is where the "
                      "winding number exceeds one half; %d triangles dropped%s", r->boundary_edges,
                      r->nonmanifold_edges, r->misoriented_edges, r->triangles_dropped, repaired ? ", orientation repaired" : "");
    else if (r->flipped || r->triangles_dropped)
        springls__log(ctx, 2, "mesh%s, %d triangles dropped", r->flipped ? " was inside out and has been turned"
                      : " is closed", r->triangles_dropped);
}

/* Removes the triangles without an area from the list, which may be empty then. */
SPRINGLS__FN void springls__mesh_drop_flat(springls__mesh_intake *m)
{
    int t, k, n = 0;
    for (t = 0; t < m->count; t++) {
        if (!(springls__mesh_double_area(m, t) > 1e-10)) continue; /* the limit of springls__tri_closest */
        for (k = 0; k < 3; k++) m->corner[3 * n + k] = m->corner[3 * t + k];
        m->triangle[n] = m->triangle[t];
        m->turn[n++] = m->turn[t];
    }
    m->count = n;
}

/* Writes the corners of a listed triangle, turned as m->turn has it. */
SPRINGLS__FN void springls__mesh_corners(const springls__mesh_intake *m, int t, springls__v3 q[3])
{
    int k;
    for (k = 0; k < 3; k++) q[k] = m->point[m->corner[3 * t + (m->turn[t] && k ? 3 - k : k)]];
}

/* Makes the listed triangles the original surface. In a mirrored world all are turned once more. */
SPRINGLS__FN springls_status springls__mesh_make_original(springls_context *ctx, springls__mesh_intake *m)
{
    const uint8_t mirrored = springls__is_mirrored(ctx);
    int t;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->original, m->count));
    for (t = 0; t < m->count; t++) {
        m->turn[t] ^= mirrored;
        springls__mesh_corners(m, t, ctx->original.points + 3 * t);
    }
    SPRINGLS__TRY(springls__surface_finish(ctx, &ctx->original, m->count));
    return springls__surface_make_dipoles(ctx, &ctx->original);
}

/* Returns whether some place is inside: only places right behind triangles have to be tried. Behind a flat patch the winding
   number is one half, and between two sheets that lie on each other it is 0. */
SPRINGLS__FN bool springls__surface_has_inside(const springls__surface *surface)
{
    const float depth = 1e-3f, share = 0.01f, more_than_flat = 0.51f; /* voxel; of a triangle's size; winding number */
    int i;
    for (i = 0; i < surface->count; i++) {
        springls__tri t = springls__surface_triangle(surface, i);
        float size = springls__sqrt(springls__length(springls__tri_area2(t)));
        springls__v3 x = springls__mad(springls__tri_centroid(t), springls__tri_normal(t), -springls__min(depth, share * size));
        if (springls__surface_winding(surface, x, 2.5f) > more_than_flat) return true;
    }
    return false;
}

/* Appends the springls of the original surface's triangles, in their order. */
SPRINGLS__FN springls_status springls__mesh_append_springls(springls_context *ctx)
{
    springls__split_rule rule = springls__split_rule_of(ctx, ctx->original.count);
    int t;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->original.count));
    for (t = 0; t < ctx->original.count; t++)
        SPRINGLS__TRY(springls__append_divided(ctx, &rule, ctx->original.points + 3 * t));
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* Returns true when a springl lies inside the solid. corners: they must too, so that no seam cuts it. */
SPRINGLS__FN bool springls__springl_in_solid(const springls__surface *surface, springls__springl s, bool corners)
{
    const float largest = 3.0f, to_corner = 0.97f; /* voxels; share of the way */
    const springls__v3 n = springls__springl_normal(s);
    int m;
    if (springls__longest_edge2(springls__springl_tri(s)) > largest * largest) return false;
    if (!springls__both_sides_inside(surface, s.p, n)) return false;
    for (m = 0; corners && m < 3; m++)
        if (!springls__both_sides_inside(surface, springls__lerp(s.p, s.q[m], to_corner), n)) return false;
    return true;
}

typedef struct springls__in_solid_job { springls_context *ctx; bool corners; } springls__in_solid_job;

SPRINGLS__FN void springls__in_solid_task(void *arg, int begin, int end)
{
    const springls__in_solid_job *job = (const springls__in_solid_job *)arg;
    springls__model *model = &job->ctx->model;
    for (; begin < end; begin++)
        springls__contract_action(model)[begin] =
            springls__springl_in_solid(&job->ctx->original, model->set.s[begin], job->corners) ? SPRINGLS__REMOVE
                                                                                              : SPRINGLS__KEEP;
}

/* Removes the springls inside the solid, as where closed parts of a mesh overlap: they bound nothing. corners: only those that no
   seam cuts. */
SPRINGLS__FN springls_status springls__mesh_drop_inner(springls_context *ctx, bool corners)
{
    const int count = ctx->model.set.count;
    springls__in_solid_job job;
    job.ctx = ctx;
    job.corners = corners;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, count));
    springls__parallel(ctx, count, 64, springls__in_solid_task, &job);
    SPRINGLS__TRY(springls__constellation_compact(ctx));
    if (ctx->model.set.count == count) return SPRINGLS_OK;
    springls__constellation_changed(ctx);
    springls__log(ctx, 2, "the mesh overlaps itself: %d springls inside of it are not set", count - ctx->model.set.count);
    return SPRINGLS_OK;
}

/* Fills phi. outer: an empty surface for what bounds a mesh that overlaps itself. */
SPRINGLS__FN springls_status springls__mesh_fill_grid(springls_context *ctx, bool balanced, bool overlaps,
                                                      springls__surface *outer)
{
    springls__mesh_distance distance;
    distance.surface = distance.nearest = &ctx->original;
    distance.balanced = balanced;
    distance.band = ctx->model.params.band_half_width + 1.0f;
    if (overlaps) {
        SPRINGLS__TRY(springls__surface_build(ctx, outer, ctx->model.set.s, ctx->model.set.count));
        distance.nearest = outer;
    }
    return springls__set_from_distance(ctx, springls__mesh_signed_distance, &distance, &ctx->original, 64.0f);
}

/* Makes the springls and the level set from the original surface. may_overlap: the mesh is balanced, and may overlap itself. */
SPRINGLS__FN springls_status springls__mesh_make_model(springls_context *ctx, bool balanced, bool may_overlap)
{
    springls__surface outer;
    springls_status status;
    bool overlaps;
    int count;
    memset(&outer, 0, sizeof outer);
    SPRINGLS__TRY(springls__mesh_append_springls(ctx));
    count = ctx->model.set.count;
    if (may_overlap) SPRINGLS__TRY(springls__mesh_drop_inner(ctx, true));
    overlaps = ctx->model.set.count < count;
    status = springls__mesh_fill_grid(ctx, balanced, overlaps, &outer);
    springls__surface_free(ctx, &outer);
    SPRINGLS__TRY(status);
    return overlaps ? springls__mesh_drop_inner(ctx, false) : SPRINGLS_OK;
}

/* Stores for each triangle of the original surface its number in the caller's mesh, times 2, plus 1 if it was turned. */
SPRINGLS__FN springls_status springls__mesh_store_sources(springls_context *ctx, const springls__mesh_intake *m, int given)
{
    int t;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->original.source_memory, (size_t)m->count, sizeof(int), 0));
    ctx->original.source = (int *)ctx->original.source_memory.data;
    ctx->original.given = given;
    for (t = 0; t < m->count; t++) ctx->original.source[t] = 2 * m->triangle[t] + m->turn[t];
    return SPRINGLS_OK;
}

/* Covers the film that closes the holes of an open mesh with springls. */
SPRINGLS__FN springls_status springls__mesh_fill_holes(springls_context *ctx)
{
    SPRINGLS__TRY(springls__find_exposed(ctx, ctx->model.params.d_max, ctx->model.params.d_max));
    springls__finish_loop(ctx);
    SPRINGLS__TRY(springls__fill_exposed(ctx));
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__mesh_no_inside(springls_context *ctx)
{
    return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh has no inside: it is flat, its triangles lie on each other, or it is "
                          "smaller than a voxel or than min_component");
}

/* Replaces the model by the listed triangles. given: triangles in the caller's mesh; balanced: every edge is. On failure the model is left unfinished. */
SPRINGLS__FN springls_status springls__mesh_replace_model(springls_context *ctx, springls__mesh_intake *m, int given,
                                                          bool balanced, bool may_overlap)
{
    springls__clear_model(ctx);
    SPRINGLS__TRY(springls__mesh_make_original(ctx, m));
    if (!springls__surface_has_inside(&ctx->original)) return springls__mesh_no_inside(ctx);
    SPRINGLS__TRY(springls__mesh_make_model(ctx, balanced, balanced && may_overlap));
    if (!balanced) SPRINGLS__TRY(springls__run_to_completion(ctx, springls__rebuild));
    SPRINGLS__TRY(springls__tidy_level_set(ctx));
    if (!springls__has_inside(&ctx->model.grid)) return springls__mesh_no_inside(ctx);
    if (ctx->model.params.keep_edges) SPRINGLS__TRY(springls__find_edges(ctx));
    SPRINGLS__TRY(springls__make_reference(ctx));
    SPRINGLS__TRY(springls__mesh_store_sources(ctx, m, given));
    if (!balanced) return springls__mesh_fill_holes(ctx);
    springls__rest_all(ctx);
    return SPRINGLS_OK;
}

/* Compares the mesh's bounds with the grid's, in voxels. Fails when they do not meet. *beyond: a part lies outside. */
SPRINGLS__FN springls_status springls__mesh_check_bounds(springls_context *ctx, const float lower[3], const float upper[3],
                                                         bool *beyond)
{
    bool outside = false;
    int k;
    *beyond = false;
    for (k = 0; k < 3; k++) {
        float last = (float)ctx->desc.grid.size[k] - 0.5f;
        *beyond = *beyond || lower[k] < -0.5f || upper[k] > last;
        outside = outside || upper[k] < -0.5f || lower[k] > last;
    }
    if (outside) return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh lies outside the grid: voxels (%g %g %g) to (%g %g %g)",
                                       (double)lower[0], (double)lower[1], (double)lower[2], (double)upper[0],
                                       (double)upper[1], (double)upper[2]);
    return SPRINGLS_OK;
}

/* Writes the report's counts of edges and components. Overwrites m->weld. */
SPRINGLS__FN void springls__mesh_report_topology(springls__mesh_intake *m, springls_mesh_report *report)
{
    int e;
    for (e = 0; e < m->edge_count; e++) {
        const springls__mesh_edge *edge = &m->edges[e];
        report->boundary_edges += edge->count == 1;
        report->nonmanifold_edges += edge->count > 2;
        report->misoriented_edges += edge->count == 2 && springls__mesh_direction(m, edge->half[0])
                                                             == springls__mesh_direction(m, edge->half[1]);
    }
    report->closed = !report->boundary_edges && !report->nonmanifold_edges && !report->misoriented_edges;
    report->used_winding = !report->closed;
    report->components = springls__mesh_components(m);
}

/* Writes m->turn so that neighbors agree and the triangles face outwards, and the report's area, volume (as the triangles
   came) and flipped. Returns how many edges are not balanced then. */
SPRINGLS__FN int springls__mesh_face_outwards(springls__mesh_intake *m, const float *positions, size_t stride,
                                              springls_mesh_report *report)
{
    double center[3];
    int t, unbalanced;
    memset(m->turn, 0, (size_t)m->count);
    report->area = springls__mesh_area(m, positions, stride, center);
    report->volume = springls__mesh_volume(m, positions, stride, center, false);
    if (report->misoriented_edges) springls__mesh_orient(m);
    unbalanced = springls__mesh_balance(m);
    report->flipped = springls__mesh_volume(m, positions, stride, center, true) < 0.0;
    for (t = 0; report->flipped && t < m->count; t++) m->turn[t] ^= 1;
    return unbalanced;
}

/* Does the work of springls_set_mesh on arguments that have been checked and a report of zeros. */
SPRINGLS__FN springls_status springls__mesh_take(springls_context *ctx, springls__mesh_intake *m, const float *positions,
                                                 int position_count, size_t stride, const int *triangles, int triangle_count,
                                                 springls_mesh_report *report)
{
    float lower[3], upper[3];
    bool beyond;
    int unbalanced;
    springls_status status;
    SPRINGLS__TRY(springls__mesh_intake_reserve(ctx, m, position_count, triangle_count));
    SPRINGLS__TRY(springls__mesh_weld(ctx, m, positions, position_count, stride, triangles, triangle_count, lower, upper));
    springls__mesh_list_triangles(m, triangles, triangle_count);
    SPRINGLS__TRY(springls__mesh_check_bounds(ctx, lower, upper, &beyond));
    springls__mesh_drop_repeated(m);
    springls__mesh_edges(m);
    springls__mesh_report_topology(m, report);
    unbalanced = springls__mesh_face_outwards(m, positions, stride, report);
    springls__mesh_drop_flat(m);
    report->triangles_dropped = triangle_count - m->count;
    if (!m->count) return springls__fail(ctx, SPRINGLS_BAD_MESH, "no triangle of %d has an area", triangle_count);
    status = springls__mesh_replace_model(ctx, m, triangle_count, unbalanced == 0,
                                          report->components > 1 || report->nonmanifold_edges > 0);
    SPRINGLS__TRY(springls__clear_on_failure(ctx, status));
    report->springls = ctx->model.set.count;
    springls__mesh_log(ctx, report, !unbalanced && report->misoriented_edges);
    if (beyond) springls__log(ctx, 2, "the mesh reaches beyond the grid: its level set ends at the grid's border");
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_set_mesh(springls_context *ctx, const float *positions, int position_count,
                                               size_t stride, const int *triangles, int triangle_count,
                                               springls_mesh_report *report)
{
    springls__mesh_intake intake;
    springls_mesh_report own;
    springls_status status;
    if (!report) report = &own;
    memset(report, 0, sizeof *report);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (stride == 0) stride = 3 * sizeof(float);
    if (position_count < 0 || triangle_count < 0 || triangle_count > INT32_MAX / 6)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: %d positions and %d triangles: there may be 0 to %d, and 0 to %d",
                              position_count, triangle_count, INT32_MAX, INT32_MAX / 6);
    if (stride < 3 * sizeof(float) || stride % sizeof(float))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: a stride of %lu bytes, not 0 or a multiple of 4 from 12 on",
                              (unsigned long)stride);
    if ((!positions && position_count) || (!triangles && triangle_count))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_mesh: NULL array");
    if (!triangle_count) return springls__fail(ctx, SPRINGLS_BAD_MESH, "the mesh has no triangles");
    memset(&intake, 0, sizeof intake);
    status = springls__mesh_take(ctx, &intake, positions, position_count, stride, triangles, triangle_count, report);
    springls__mesh_intake_free(ctx, &intake);
    return status;
}

#endif
