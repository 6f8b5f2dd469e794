/* mesh_distance.h - the signed distance to a triangle mesh: its size from the closest point, its sign from the winding number. */
#ifndef SPRINGLS__MODEL_MESH_DISTANCE_H
#define SPRINGLS__MODEL_MESH_DISTANCE_H

#include "packet.h"

typedef struct springls__mesh_distance {
    const springls__surface *surface; /* its winding number is the sign            */
    const springls__surface *nearest; /* its closest point is the size: the same, or less the parts inside */
    bool balanced; /* as many triangles run along every edge in one direction as in the other: the winding number is whole */
    float band;    /* where phi is clamped, voxels */
} springls__mesh_distance;

SPRINGLS__FN bool springls__beyond_bounds(const springls__surface *surface, springls__v3 x)
{
    const springls__bvh_node *n = &surface->nodes[0];
    return x.x < n->lower[0] || x.y < n->lower[1] || x.z < n->lower[2] || x.x > n->upper[0] || x.y > n->upper[1]
           || x.z > n->upper[2];
}

/* Returns the side of a place that a balanced surface winds w times around: 1 outside and -1 inside. */
SPRINGLS__FN float springls__side_of_winding(float w) { return w > 0.5f ? -1.0f : 1.0f; }

/* The same of an open surface: between them near the film that closes a hole. A twentieth of a winding number does not count, so that away
   from holes phi is the plain distance. */
SPRINGLS__FN float springls__open_side_of_winding(float w) { return 1.0f - 2.0f * springls__clamp((w - 0.05f) / 0.9f, 0.0f, 1.0f); }

/* Returns true when both sides of a surface through x with normal n are inside: it bounds nothing there. */
SPRINGLS__FN bool springls__both_sides_inside(const springls__surface *surface, springls__v3 x, springls__v3 n)
{
    const float depth = 0.01f; /* voxel */
    return springls__surface_winding(surface, springls__mad(x, n, depth), 2.5f) > 0.5f
           && springls__surface_winding(surface, springls__mad(x, n, -depth), 2.5f) > 0.5f;
}

/* Returns true when x lies on a triangle that has the inside on both sides there. */
SPRINGLS__FN bool springls__on_inner_part(const springls__mesh_distance *m, springls__v3 x)
{
    const float touching2 = 1e-6f; /* voxel^2 */
    const springls__surface_hit hit = springls__surface_closest(m->nearest, x, 0.01f);
    if (hit.triangle < 0 || hit.hit.d2 > touching2) return false;
    return springls__both_sides_inside(m->surface, x, springls__tri_normal(springls__surface_triangle(m->nearest, hit.triangle)));
}

/* ---- distances ---- */

/* Finds the distances of points that may lie anywhere, cut short at `search`. */
SPRINGLS__FN void springls__distances_of_points(const springls__mesh_distance *m, const springls__v3 *points, int count, float search,
                                                float *distance)
{
    int i, guess = -1;
    for (i = 0; i < count; i++) {
        const springls__surface_hit h = springls__surface_closest_from(m->nearest, points[i], search, guess);
        if (h.triangle >= 0) guess = h.triangle;
        distance[i] = h.triangle < 0 ? search : springls__sqrt(h.hit.d2);
    }
}

enum { SPRINGLS__MESH_BLOCK = 64, SPRINGLS__MESH_BLOCKS = SPRINGLS__BRICK_VOXELS / SPRINGLS__MESH_BLOCK };

/* The voxels of a brick are taken in blocks of 4^3, and these in packets of 2^3. Returns which voxel of the brick is number i so. */
SPRINGLS__FN int springls__voxel_of_packets(int i)
{
    const int x = (i & 1) | (i >> 3 & 1) << 1 | (i >> 6 & 1) << 2, y = (i >> 1 & 1) | (i >> 4 & 1) << 1 | (i >> 7 & 1) << 2;
    return x + 8 * y + 64 * ((i >> 2 & 1) | (i >> 5 & 1) << 1 | (i >> 8 & 1) << 2);
}

/* Loads the packet that begins at number `first`. */
SPRINGLS__FN springls__packet springls__packet_of_voxels(const springls__v3 *points, int first)
{
    springls__packet packet;
    int i;
    for (i = 0; i < SPRINGLS__PACKET; i++) {
        const springls__v3 x = points[springls__voxel_of_packets(first + i)];
        packet.x[i] = x.x;
        packet.y[i] = x.y;
        packet.z[i] = x.z;
    }
    springls__packet_bound(&packet);
    return packet;
}

/* Returns the side, 1 or -1, of all places within `half` of x, or 0 if the side is not certain. Precondition: the open surface is further
   from x than `distance`. There the winding number w is harmonic. If 0 <= w <= 1 around x, Harnack's inequality bounds w within `half` by
   `times` w(x); less than a twentieth does not change a side. Surfaces that overlap themselves or are inside out have other w: a w(x)
   beyond 0 and 1, by more than the error of directed areas, decides nothing. */
SPRINGLS__FN float springls__open_side_around(const springls__mesh_distance *m, springls__v3 x, float distance, float half)
{
    const float q = half / distance, times = (1.0f + q) / ((1.0f - q) * (1.0f - q));
    const float w = springls__surface_winding(m->surface, x, 2.5f);
    if (w < -0.01f || w > 1.01f) return 0.0f;
    return times * w < 0.05f ? 1.0f : times * (1.0f - w) < 0.05f ? -1.0f : 0.0f;
}

/* Finds the distances of a block, cut short at `search`; where all of it is beyond the band, the band will do. Returns a triangle near it,
   or -1, as `guess` is. *side: that of a block beyond the band of an open surface, 0 if it is not known. */
SPRINGLS__FN int springls__distances_of_block(const springls__mesh_distance *m, const springls__v3 *points, int block, float search,
                                              int guess, float *distance, float *side)
{
    const float beyond = m->band + 0.1f;
    const int begin = SPRINGLS__MESH_BLOCK * block, end = begin + SPRINGLS__MESH_BLOCK;
    const springls__v3 a = points[springls__voxel_of_packets(begin)], b = points[springls__voxel_of_packets(end - 1)];
    const float half = 0.5005f * springls__length(springls__sub(b, a)) + 1e-3f;
    const springls__v3 center = springls__lerp(a, b, 0.5f);
    const float reach = (m->balanced ? beyond : search) + half;
    const springls__surface_hit h = springls__surface_closest_from(m->nearest, center, reach, guess);
    const float from_center = h.triangle < 0 ? reach : springls__sqrt(h.hit.d2);
    bool far_away = from_center >= beyond + half;
    int first, i;
    *side = far_away && !m->balanced ? springls__open_side_around(m, center, from_center, half) : 0.0f;
    far_away = far_away && (m->balanced || *side != 0.0f);
    if (h.triangle >= 0) guess = h.triangle;
    for (i = begin; far_away && i < end; i++) distance[springls__voxel_of_packets(i)] = beyond;
    if (far_away) return guess;
    for (first = begin; first < end; first += SPRINGLS__PACKET) {
        const springls__packet packet = springls__packet_of_voxels(points, first);
        float d2[SPRINGLS__PACKET];
        const int near_packet = springls__packet_closest(m->nearest, &packet, search, guess, d2);
        if (near_packet >= 0) guess = near_packet;
        for (i = 0; i < SPRINGLS__PACKET; i++) distance[springls__voxel_of_packets(first + i)] = springls__sqrt(d2[i]);
    }
    return guess;
}

/* Finds the distances of the voxels of a brick, cut short: those of the band need the nearest triangle. Near the film that closes an open
   mesh phi is a share of the distance, so there the triangle may lie beyond the band. */
SPRINGLS__FN void springls__distances_of_voxels(const springls__mesh_distance *m, const springls__v3 *points, float *distance,
                                                float sides[SPRINGLS__MESH_BLOCKS])
{
    const float search = m->band + (m->balanced ? 0.5f : 3.0f);
    int block, guess = -1;
    for (block = 0; block < SPRINGLS__MESH_BLOCKS; block++)
        guess = springls__distances_of_block(m, points, block, search, guess, distance, &sides[block]);
}

/* ---- sides ---- */

enum { SPRINGLS__MESH_BACK = 64 };

/* Returns the side of an earlier point of the batch if balls about it and point i, free of surface, overlap; else 0. */
SPRINGLS__FN float springls__earlier_side(const springls__v3 *points, const float *distance, const float *signed_distance, int i)
{
    static const int back[3] = { 1, 8, SPRINGLS__MESH_BACK };
    int b;
    for (b = 0; b < 3; b++) {
        const int j = i - back[b];
        float apart;
        if (j < 0) continue;
        apart = 1.001f * springls__length(springls__sub(points[i], points[j])) + 1e-3f;
        if (distance[i] + distance[j] > apart) return signed_distance[j] < 0.0f ? -1.0f : 1.0f;
    }
    return 0.0f;
}

/* Signs the distances to a balanced surface. Points copy the signs of earlier ones where that is certain. */
SPRINGLS__FN void springls__sign_balanced(const springls__mesh_distance *m, const springls__v3 *points, int count, float *distance,
                                          float *out)
{
    int i;
    for (i = 0; i < count; i++) {
        float side = springls__earlier_side(points, distance, out, i);
        if (m->nearest != m->surface && distance[i] < 0.01f && springls__on_inner_part(m, points[i])) {
            side = -1.0f;
            distance[i] = 0.5f;
        }
        if (side == 0.0f)
            side = springls__beyond_bounds(m->surface, points[i])
                       ? 1.0f : springls__side_of_winding(springls__surface_winding(m->surface, points[i], 2.0f));
        out[i] = side * distance[i];
    }
}

/* Signs the distances of the voxels of a brick to an open surface. sides: of its blocks, 0 if they are not known. */
SPRINGLS__FN void springls__sign_open_voxels(const springls__mesh_distance *m, const springls__v3 *points, const float *distance,
                                             const float sides[SPRINGLS__MESH_BLOCKS], float *out)
{
    enum { PACKETS = (int)SPRINGLS__MESH_BLOCK / (int)SPRINGLS__PACKET };
    int block, i;
    for (block = 0; block < SPRINGLS__MESH_BLOCKS; block++) {
        springls__packet packets[PACKETS];
        float w[PACKETS][SPRINGLS__PACKET];
        for (i = 0; i < PACKETS; i++)
            packets[i] = springls__packet_of_voxels(points, SPRINGLS__MESH_BLOCK * block + SPRINGLS__PACKET * i);
        if (sides[block] == 0.0f) springls__packets_winding(m->surface, packets, PACKETS, 2.5f, w);
        for (i = 0; i < SPRINGLS__MESH_BLOCK; i++) {
            const int voxel = springls__voxel_of_packets(SPRINGLS__MESH_BLOCK * block + i);
            const float side = sides[block] != 0.0f ? sides[block]
                                                    : springls__open_side_of_winding(w[i / SPRINGLS__PACKET][i % SPRINGLS__PACKET]);
            out[voxel] = side * distance[voxel];
        }
    }
}

/* Computes the distances of a batch of points, in voxels (a springls__distance_fn). A batch is the voxels of one brick, where
   distances beyond the band are cut short, or other places, as centers of bricks, which need more. */
SPRINGLS__FN void springls__mesh_signed_distance(void *arg, const springls__v3 *points, int count, float *out)
{
    const springls__mesh_distance *m = (const springls__mesh_distance *)arg;
    float distance[SPRINGLS__BRICK_VOXELS], sides[SPRINGLS__MESH_BLOCKS];
    int i;
    if (count == SPRINGLS__BRICK_VOXELS) springls__distances_of_voxels(m, points, distance, sides);
    else springls__distances_of_points(m, points, count, m->balanced ? m->band + 8.0f : FLT_MAX, distance);
    if (m->balanced) springls__sign_balanced(m, points, count, distance, out);
    else if (count == SPRINGLS__BRICK_VOXELS) springls__sign_open_voxels(m, points, distance, sides, out);
    else
        for (i = 0; i < count; i++)
            out[i] = springls__open_side_of_winding(springls__surface_winding(m->surface, points[i], 2.5f)) * distance[i];
}

#endif
