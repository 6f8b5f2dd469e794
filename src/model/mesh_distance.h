/* mesh_distance.h - the signed distance to a triangle mesh: size from the hierarchy, sign from the winding number. */
#ifndef SPRINGLS__MODEL_MESH_DISTANCE_H
#define SPRINGLS__MODEL_MESH_DISTANCE_H

#include "bvh.h"

typedef struct springls__mesh_distance {
    const springls__surface *surface;
    bool balanced;
    float band; /* where phi is clamped */
} springls__mesh_distance;

SPRINGLS__FN bool springls__beyond_bounds(const springls__surface *surface, springls__v3 x)
{
    const springls__bvh_node *n = &surface->nodes[0];
    return x.x < n->lower[0] || x.y < n->lower[1] || x.z < n->lower[2] || x.x > n->upper[0] || x.y > n->upper[1]
           || x.z > n->upper[2];
}

/* 1 outside, -1 inside, and between them where the film of an open mesh is nearer than its triangles. A twentieth of a
   winding number does not count, so that phi is the plain distance away from holes. */
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

enum { SPRINGLS__MESH_BACK = 64, SPRINGLS__MESH_RING = 128 };

/* What earlier points of the batch tell about point x: a ball around each of them is free of surface. Returns how far the
   surface is at least; *side is set when a ball of radius `distance` around x overlaps one of theirs. */
SPRINGLS__FN float springls__mesh_known(const springls__v3 *points, const float *out, const float *sides, int i,
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

/* A springls__distance_fn. Batches are voxels of one brick, where distances beyond the band are cut short, or centres of
   bricks, which must be told apart further out. Points of a brick learn from each other. Bricks of a balanced mesh may,
   too: their signs are exact, so it makes no difference. In an open mesh only points that have asked for their side are
   believed: what they say ends within a voxel, and hearsay would get in through the holes. */
SPRINGLS__FN void springls__mesh_signed_distance(void *arg, const springls__v3 *points, int count, float *out)
{
    const springls__mesh_distance *m = (const springls__mesh_distance *)arg;
    bool voxels = count > 1 && springls__length2(springls__sub(points[1], points[0])) < 16.0f;
    bool learn = voxels || m->balanced;
    float sides[SPRINGLS__MESH_RING], search = voxels ? m->band + 3.0f : m->balanced ? m->band + 8.0f : FLT_MAX;
    int i, guess = -1;
    for (i = 0; i < count; i++) {
        springls__surface_hit h;
        bool asked = false;
        float side = 0.0f, distance, known = learn ? springls__mesh_known(points, out, sides, i, 0.0f, &side) : 0.0f;
        if (!voxels || known < m->band + 0.1f) {
            h = springls__surface_closest_from(m->surface, points[i], search, guess);
            if (h.triangle >= 0) guess = h.triangle;
            distance = h.triangle < 0 ? search : springls__sqrt(h.hit.d2);
            if (learn && side == 0.0f) springls__mesh_known(points, out, sides, i, distance, &side);
            asked = side == 0.0f;
            if (asked) side = springls__mesh_side(m, points[i]);
        } else distance = known;
        sides[i % SPRINGLS__MESH_RING] = m->balanced || asked ? side : 0.0f;
        out[i] = side * distance;
    }
}

#endif
