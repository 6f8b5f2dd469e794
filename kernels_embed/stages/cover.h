/* cover.h - every springl becomes an equilateral triangle of its own share of the surface (params.cover). Equal triangles cover
   the most with their corners in the gaps between neighbors, and so with their edges towards the nearest ones. */
#ifndef SPRINGLS__KERNEL_STAGES_COVER_H
#define SPRINGLS__KERNEL_STAGES_COVER_H

#include "../model/model.h"
#include "contract.h"

/* Directions about a springl in which its share is measured, 30 degrees apart. */
#define SPRINGLS__SHARE_DIRECTIONS 12

/* A springl's share of the surface, voxel^2, and the third harmonic of its width by direction: its corners. */
typedef struct springls__share { float area, cosine, sine; } springls__share;

/* Gives springl i short arms for relax, and for finding its neighbors: arms as long as its share reach across creases, and turn it
   too far. A masked one keeps its own. */
SPRINGLS__MATHS void springls__draw_in_element(const springls__model *model, springls__arguments args, int i)
{
    const float arm = 0.45f; /* voxel */
    springls__springl s = model->set.s[i];
    int m;
    (void)args;
    if (!model->set.mask[i])
        for (m = 0; m < 3; m++)
            s.q[m] = springls__mad(s.p, springls__normalize(springls__sub(s.q[m], s.p)), arm);
    springls__relaxed_springls(model)[i] = springls__springl_finished(s);
}

/* Measures the part of the tangent plane of springl i, with tangents u and v, that is nearer to it than to its neighbors: its
   Voronoi cell. Those on the other side of a thin sheet do not count; those beyond a crease do. */
SPRINGLS__MATHS springls__share springls__share_of(const springls__model *model, int i, springls__v3 u, springls__v3 v)
{
    const float opposite = -0.3f, widest = 0.75f; /* cosine; voxel */
    const float cosine[SPRINGLS__SHARE_DIRECTIONS] = { 1.0f, 0.866025404f, 0.5f, 0.0f, -0.5f, -0.866025404f,
                                                       -1.0f, -0.866025404f, -0.5f, 0.0f, 0.5f, 0.866025404f };
    SPRINGLS__GLOBAL const int *codes = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    springls__v3 p = model->set.s[i].p, n = springls__cross(u, v);
    float inverse[SPRINGLS__SHARE_DIRECTIONS], cell[SPRINGLS__SHARE_DIRECTIONS];
    springls__share share;
    int k, j;
    for (j = 0; j < SPRINGLS__SHARE_DIRECTIONS; j++) inverse[j] = 1.0f / widest;
    for (k = 0; k < SPRINGLS__NEIGHBOR_ROW; k++) {
        springls__springl o = model->set.s[codes[k] >= 0 ? codes[k] / 3 : i];
        springls__v3 d = springls__sub(o.p, p);
        float x, y, near2 = 2.0f / springls__max(springls__length2(d), 1e-6f);
        if (codes[k] < 0 || springls__dot(springls__springl_normal(o), n) <= opposite) continue;
        x = springls__dot(d, u) * near2;
        y = springls__dot(d, v) * near2;
        for (j = 0; j < SPRINGLS__SHARE_DIRECTIONS; j++)
            inverse[j] = springls__max(inverse[j], x * cosine[j] + y * cosine[(j + 9) % SPRINGLS__SHARE_DIRECTIONS]);
    }
    share.area = 0.0f;
    for (j = 0; j < SPRINGLS__SHARE_DIRECTIONS; j++) {
        cell[j] = 0.261799388f / (inverse[j] * inverse[j]); /* of a sector of 30 degrees: pi/12 radius^2 */
        share.area += cell[j];
    }
    share.cosine = cell[0] - cell[2] + cell[4] - cell[6] + cell[8] - cell[10];
    share.sine = cell[1] - cell[3] + cell[5] - cell[7] + cell[9] - cell[11];
    return share;
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

/* Gives springl i, from S to relaxed_springls, the triangle of its share. A masked one stays as it is. */
SPRINGLS__MATHS void springls__cover_element(const springls__model *model, springls__arguments args, int i)
{
    const float overlap = 1.04f; /* area of the triangle over that of the share */
    const float steady = 0.02f;  /* keeps triangles from turning where their shares have no corners */
    const float largest = 0.42f * model->params.split_edge * model->params.split_edge; /* an edge is almost as long then */
    springls__springl s = model->set.s[i];
    springls__v3 n, u, v;
    springls__share share;
    (void)args;
    if (!model->set.mask[i]) {
        n = springls__facing(model, s);
        u = springls__first_arm(s, n);
        v = springls__cross(n, u);
        share = springls__share_of(model, i, u, v);
        u = springls__turn_by_third(u, v, share.cosine + steady * share.area, share.sine);
        s = springls__springl_make(springls__equilateral(s.p, n, u, springls__min(overlap * share.area, largest)), s.p);
    }
    springls__relaxed_springls(model)[i] = s;
}

#endif
