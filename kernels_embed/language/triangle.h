/* triangle.h - distances and shapes of one triangle. */
#ifndef SPRINGLS__KERNEL_LANGUAGE_TRIANGLE_H
#define SPRINGLS__KERNEL_LANGUAGE_TRIANGLE_H

#include "simd.h"

typedef struct springls__tri { springls__v3 a, b, c; } springls__tri;

/* A triangle prepared for many points: everything a distance needs that does not depend on the point. */
typedef struct springls__tri_plan {
    springls__tri t;
    springls__v3 edge[3], inward[3], n; /* inward: in-plane normal of an edge (not unit); n: twice the area vector */
    float inverse_edge2[3], inverse_n2;
} springls__tri_plan;

#include "width_float.h"
#include "triangle_body.h"
#include "width_simd.h"
#include "triangle_body.h"

/* The point of a triangle closest to another point; bary: its weights on a, b, c. */
typedef struct springls__tri_hit { springls__v3 point; float d2; float bary[3]; } springls__tri_hit;

/* Returns the point of a triangle with weights on a, b, c. */
SPRINGLS__MATHS springls__v3 springls__tri_point(springls__tri t, const float bary[3])
{
    return springls__v3_make(t.a.x * bary[0] + t.b.x * bary[1] + t.c.x * bary[2],
                             t.a.y * bary[0] + t.b.y * bary[1] + t.c.y * bary[2],
                             t.a.z * bary[0] + t.b.z * bary[1] + t.c.z * bary[2]);
}

SPRINGLS__INNER springls__tri_hit springls__tri_hit_make(springls__tri t, springls__v3 x, float u, float v, float w)
{
    springls__tri_hit h;
    h.bary[0] = u; h.bary[1] = v; h.bary[2] = w;
    h.point = springls__tri_point(t, h.bary);
    h.d2 = springls__length2(springls__sub(x, h.point));
    return h;
}

/* Returns the closest point of triangle t to x, by Voronoi regions; of a triangle without area the closest point of an edge. */
SPRINGLS__MATHS springls__tri_hit springls__tri_closest(springls__tri t, springls__v3 x)
{
    springls__v3 ab = springls__sub(t.b, t.a), ac = springls__sub(t.c, t.a);
    springls__v3 n = springls__cross(ab, ac), ax = springls__sub(x, t.a);
    float n2 = springls__length2(n);
    springls__tri_hit best, h;
    float s;
    if (n2 > 1e-20f) {
        float w = springls__dot(springls__cross(ab, ax), n) / n2;
        float v = springls__dot(springls__cross(ax, ac), n) / n2;
        float u = 1.0f - v - w;
        if (u >= 0.0f && v >= 0.0f && w >= 0.0f) return springls__tri_hit_make(t, x, u, v, w);
    }
    s = springls__segment_parameter(x, t.a, springls__sub(t.b, t.a), springls__inverse_length2(t.a, t.b));
    best = springls__tri_hit_make(t, x, 1.0f - s, s, 0.0f);
    s = springls__segment_parameter(x, t.b, springls__sub(t.c, t.b), springls__inverse_length2(t.b, t.c));
    h = springls__tri_hit_make(t, x, 0.0f, 1.0f - s, s);
    if (h.d2 < best.d2) best = h;
    s = springls__segment_parameter(x, t.c, springls__sub(t.a, t.c), springls__inverse_length2(t.c, t.a));
    h = springls__tri_hit_make(t, x, s, 0.0f, 1.0f - s);
    if (h.d2 < best.d2) best = h;
    return best;
}

/* Returns twice the vector area: its direction is the outward normal of a counter-clockwise triangle. */
SPRINGLS__INNER springls__v3 springls__tri_area2(springls__tri t)
{
    return springls__cross(springls__sub(t.b, t.a), springls__sub(t.c, t.a));
}

SPRINGLS__INNER springls__v3 springls__tri_normal(springls__tri t) { return springls__normalize(springls__tri_area2(t)); }

SPRINGLS__MATHS springls__v3 springls__tri_centroid(springls__tri t)
{
    return springls__scale(springls__add(springls__add(t.a, t.b), t.c), 1.0f / 3.0f);
}

SPRINGLS__INNER springls__tri_plan springls__tri_plan_make(springls__tri t)
{
    springls__tri_plan plan;
    float n2;
    plan.t = t;
    plan.n = springls__tri_area2(t);
    n2 = springls__length2(plan.n);
    plan.inverse_n2 = n2 > 1e-20f ? 1.0f / n2 : 0.0f; /* no area: only the edges count */
    plan.edge[0] = springls__sub(t.b, t.a);
    plan.edge[1] = springls__sub(t.c, t.b);
    plan.edge[2] = springls__sub(t.a, t.c);
    plan.inward[0] = springls__cross(plan.n, plan.edge[0]);
    plan.inward[1] = springls__cross(plan.n, plan.edge[1]);
    plan.inward[2] = springls__cross(plan.n, plan.edge[2]);
    plan.inverse_edge2[0] = springls__inverse_length2(t.a, t.b);
    plan.inverse_edge2[1] = springls__inverse_length2(t.b, t.c);
    plan.inverse_edge2[2] = springls__inverse_length2(t.c, t.a);
    return plan;
}

#endif
