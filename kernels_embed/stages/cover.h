/* cover.h - every springl becomes an equilateral triangle of its own share of the surface (params.cover). Equal triangles cover
   the most with their corners in the gaps between neighbors, and so with their edges towards the nearest ones. */
#ifndef SPRINGLS__KERNEL_STAGES_COVER_H
#define SPRINGLS__KERNEL_STAGES_COVER_H

#include "../model/model.h"
#include "contract.h"

/* What the neighbors of a springl add up to: their weights, and the third harmonic of their directions in its plane. */
typedef struct springls__surroundings { float weight, cosine, sine; } springls__surroundings;

/* Halves the arms of springl i for relax: long ones reach across creases, and turn it too far. */
SPRINGLS__MATHS void springls__draw_in_element(const springls__model *model, springls__arguments args, int i)
{
    springls__springl s = model->set.s[i];
    int m;
    (void)args;
    if (!model->set.mask[i])
        for (m = 0; m < 3; m++) s.q[m] = springls__lerp(s.p, s.q[m], 0.5f);
    springls__relaxed_springls(model)[i] = springls__springl_finished(s);
}

/* Returns true when the springl of codes[k] is in no code before (neighbors.h). */
SPRINGLS__MATHS bool springls__is_first_code(SPRINGLS__GLOBAL const int *codes, int k)
{
    int j;
    for (j = 0; j < k; j++)
        if (codes[j] >= 0 && codes[j] / 3 == codes[k] / 3) return false;
    return true;
}

/* Adds up the neighbors of springl i, within r of it; u, v: its tangents. Those of the other side of a thin sheet do not count;
   those beyond a crease do. */
SPRINGLS__MATHS springls__surroundings springls__surroundings_of(const springls__model *model, int i, float r, springls__v3 u,
                                                                 springls__v3 v)
{
    const float opposite = -0.3f;
    SPRINGLS__GLOBAL const int *codes = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    springls__v3 p = model->set.s[i].p, n = springls__cross(u, v);
    springls__surroundings sum;
    int k;
    sum.weight = sum.cosine = sum.sine = 0.0f;
    for (k = 0; k < SPRINGLS__NEIGHBOR_ROW; k++) {
        springls__springl o = model->set.s[codes[k] >= 0 ? codes[k] / 3 : i];
        springls__v3 d = springls__sub(o.p, p);
        float w = 1.0f - springls__length2(d) / (r * r), x = springls__dot(d, u), y = springls__dot(d, v);
        if (codes[k] < 0 || w <= 0.0f || !springls__is_first_code(codes, k)) continue;
        if (springls__dot(springls__springl_normal(o), n) <= opposite) continue;
        w = w * w;
        sum.weight += w;
        sum.cosine += w * x * (x * x - 3.0f * y * y);
        sum.sine += w * y * (3.0f * x * x - y * y);
    }
    return sum;
}

/* Returns the direction of the first arm of the equilateral triangle that is most like the triangle of s, which faces n. */
SPRINGLS__MATHS springls__v3 springls__first_arm(springls__springl s, springls__v3 n)
{
    springls__v3 arm = springls__sub(s.q[0], springls__lerp(s.q[1], s.q[2], 0.5f));
    arm = springls__mad(arm, springls__cross(n, springls__sub(s.q[2], s.q[1])), 0.866025404f);
    arm = springls__normalize(springls__mad(arm, n, -springls__dot(n, arm)));
    return springls__length2(arm) > 0.5f ? arm : springls__any_tangent(n);
}

/* Returns u, turned towards v by a third of the angle of (c, s), to two degrees. */
SPRINGLS__MATHS springls__v3 springls__turn_by_third(springls__v3 u, springls__v3 v, float c, float s)
{
    float along = springls__sqrt(c * c + s * s) + c;
    return springls__mad(springls__scale(u, springls__sqrt(along * along + s * s * (4.0f / 27.0f))), v, s * (2.0f / 3.0f));
}

/* Gives springl i, from S to relaxed_springls, the triangle of its share: the area over which the weights of its neighbors and its
   own add up to what they do where springls are even. A masked one stays as it is. */
SPRINGLS__MATHS void springls__cover_element(const springls__model *model, springls__arguments args, int i)
{
    const float r = 1.3f, overlap = 1.08f; /* voxels; area of the triangle over that of the share */
    const float largest = 0.42f * model->params.split_edge * model->params.split_edge; /* an edge is almost as long then */
    springls__springl s = model->set.s[i];
    springls__v3 n, u, v;
    springls__surroundings sum;
    float share;
    (void)args;
    if (!model->set.mask[i]) {
        n = springls__facing(model, s);
        u = springls__first_arm(s, n);
        v = springls__cross(n, u);
        sum = springls__surroundings_of(model, i, r, u, v);
        share = 1.04719755f * r * r / (1.0f + sum.weight); /* (1 - d^2/r^2)^2 adds up to (pi/3) r^2 over an area of 1 */
        u = springls__turn_by_third(u, v, -sum.cosine, -sum.sine);
        s = springls__springl_make(springls__equilateral(s.p, n, u, springls__min(overlap * share, largest)), s.p);
    }
    springls__relaxed_springls(model)[i] = s;
}

#endif
