/* mesh_distance.h - the signed distance to a triangle mesh: its size from the closest point, its sign from the winding number. */
#ifndef SPRINGLS__MODEL_MESH_DISTANCE_H
#define SPRINGLS__MODEL_MESH_DISTANCE_H

#include "closest_point.h"
#include "winding_number.h"

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

/* Returns 1 outside and -1 inside; between them near the film that closes a hole of an open mesh. A twentieth of a winding number
   does not count, so that away from holes phi is the plain distance. */
SPRINGLS__FN float springls__mesh_side(const springls__mesh_distance *m, springls__v3 x)
{
    float w;
    if (m->balanced) {
        if (springls__beyond_bounds(m->surface, x)) return 1.0f;
        return springls__surface_winding(m->surface, x, 2.0f) > 0.5f ? -1.0f : 1.0f;
    }
    w = springls__surface_winding(m->surface, x, 2.5f);
    return 1.0f - 2.0f * springls__clamp((w - 0.05f) / 0.9f, 0.0f, 1.0f);
}

/* Returns true when both sides of a surface through x with normal n are inside: it bounds nothing there. */
SPRINGLS__FN bool springls__both_sides_inside(const springls__surface *surface, springls__v3 x, springls__v3 n)
{
    const float depth = 0.01f; /* voxel */
    return springls__surface_winding(surface, springls__mad(x, n, depth), 2.5f) > 0.5f
           && springls__surface_winding(surface, springls__mad(x, n, -depth), 2.5f) > 0.5f;
}

/* Returns true when x lies on a triangle that has the inside on both sides there. hit: its closest point. */
SPRINGLS__FN bool springls__on_inner_part(const springls__mesh_distance *m, springls__v3 x, const springls__surface_hit *hit)
{
    const float touching2 = 1e-6f; /* voxel^2 */
    if (hit->triangle < 0 || hit->hit.d2 > touching2) return false;
    return springls__both_sides_inside(m->surface, x,
                                       springls__tri_normal(springls__surface_triangle(m->nearest, hit->triangle)));
}

enum { SPRINGLS__MESH_BACK = 64, SPRINGLS__MESH_RING = 128 };

/* Uses earlier points of the batch, each with a ball about it that is free of surface: returns a lower bound of the distance of
   point i, and sets *side where a ball of radius `distance` about it overlaps one of theirs. */
SPRINGLS__FN float springls__mesh_reuse(const springls__v3 *points, const float *out, const float *sides, int i,
                                        float distance, float *side)
{
    static const int back[3] = { 1, 8, SPRINGLS__MESH_BACK };
    float known = 0.0f;
    int b;
    for (b = 0; b < 3; b++) {
        int j = i - back[b];
        float apart, past;
        if (j < 0) continue;
        past = sides[j % SPRINGLS__MESH_RING];
        if (past != 1.0f && past != -1.0f) continue;
        apart = 1.001f * springls__length(springls__sub(points[i], points[j])) + 1e-3f;
        if (distance + springls__fabs(out[j]) <= apart) continue;
        *side = past;
        known = springls__max(known, springls__fabs(out[j]) - apart);
    }
    return known;
}

/* Computes the distances of a batch of points, in voxels (a springls__distance_fn). A batch is the voxels of one brick, where
   distances beyond the band are cut short, or centers of bricks, which need more. A point takes its sign from an earlier one of
   the brick where that is certain. In a balanced mesh centers do so too, and copied signs are copied further; in an open mesh
   only computed signs are copied: they hold within a voxel, and copies of copies would pass through the holes. */
SPRINGLS__FN void springls__mesh_signed_distance(void *arg, const springls__v3 *points, int count, float *out)
{
    const springls__mesh_distance *m = (const springls__mesh_distance *)arg;
    bool voxels = count > 1 && springls__length2(springls__sub(points[1], points[0])) < 16.0f;
    bool reuse = voxels || m->balanced;
    float sides[SPRINGLS__MESH_RING], search = FLT_MAX;
    int i, guess = -1;
    /* Voxels of the band need the nearest triangle; near the film that closes an open mesh phi is a share of the distance, so there
       the triangle may lie beyond the band. */
    if (voxels) search = m->band + (m->balanced ? 0.5f : 3.0f);
    else if (m->balanced) search = m->band + 8.0f;
    for (i = 0; i < count; i++) {
        springls__surface_hit h;
        bool computed = false;
        float side = 0.0f, distance, known = reuse ? springls__mesh_reuse(points, out, sides, i, 0.0f, &side) : 0.0f;
        if (!voxels || known < m->band + 0.1f) {
            h = springls__surface_closest_from(m->nearest, points[i], search, guess);
            if (h.triangle >= 0) guess = h.triangle;
            distance = h.triangle < 0 ? search : springls__sqrt(h.hit.d2);
            if (reuse && side == 0.0f) springls__mesh_reuse(points, out, sides, i, distance, &side);
            computed = side == 0.0f;
            if (computed) side = springls__mesh_side(m, points[i]);
            if (m->nearest != m->surface && springls__on_inner_part(m, points[i], &h)) {
                side = -1.0f;
                distance = 0.5f;
            }
        } else distance = known;
        sides[i % SPRINGLS__MESH_RING] = m->balanced || computed ? side : 0.0f;
        out[i] = side * distance;
    }
}

#endif
