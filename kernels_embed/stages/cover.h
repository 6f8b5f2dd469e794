/* cover.h - every springl becomes an equilateral triangle of its own share of the surface (params.cover). Equal triangles cover
   the most with their corners in the gaps between neighbors, and so with their edges towards the nearest ones. */
#ifndef SPRINGLS__KERNEL_STAGES_COVER_H
#define SPRINGLS__KERNEL_STAGES_COVER_H

#include "../language/simd.h"
#include "../model/model.h"
#include "contract.h"
#include "relax.h"

/* Directions of half a turn about a springl in which its share is measured, 30 degrees apart; the other half's are opposite. */
#define SPRINGLS__SHARE_DIRECTIONS 6

/* A springl's share of the surface, voxel^2, and the third harmonic of its width by direction: its corners. */
typedef struct springls__share { float area, cosine, sine; } springls__share;

/* Shortens the arms of springl i for relax and for finding its neighbors: arms as long as its share reach across creases, and
   turn it too far. A masked one keeps its own. */
SPRINGLS__MATHS void springls__shorten_arms_element(const springls__model *model, springls__arguments args, int i)
{
    const float arm = 0.45f; /* voxel */
    springls__springl s = model->set.s[i];
    int m;
    (void)args;
    if (!model->set.mask[i] && !springls__is_fast_asleep(model, s.p))
        for (m = 0; m < 3; m++)
            s.q[m] = springls__mad(s.p, springls__normalize(springls__sub(s.q[m], s.p)), arm);
    springls__relaxed_springls(model)[i] = springls__springl_finished(s);
}

/* A springl's cell by direction, and by the opposite one: 1 / distance to the nearest side, 1 / voxel. Two of eight do not
   count. */
typedef struct springls__cell_sides {
    springls__vec ahead[8 / SPRINGLS__LANES], behind[8 / SPRINGLS__LANES];
} springls__cell_sides;

SPRINGLS__CONST float springls__share_cosines[8] = { 1.0f, 0.866025404f, 0.5f, 0.0f, -0.5f, -0.866025404f, 0.0f, 0.0f };
SPRINGLS__CONST float springls__share_sines[8] = { 0.0f, 0.5f, 0.866025404f, 1.0f, 0.866025404f, 0.5f, 0.0f, 0.0f };

/* Cuts off what lies beyond the line x X + y Y = 1. */
SPRINGLS__VEC_MATHS springls__cell_sides springls__cut_cell(springls__cell_sides sides, float x, float y)
{
    int j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) {
        springls__vec cosine = springls__vec_load(springls__share_cosines + j * SPRINGLS__LANES);
        springls__vec sine = springls__vec_load(springls__share_sines + j * SPRINGLS__LANES);
        springls__vec line = cosine * x + sine * y;
        sides.ahead[j] = springls__vec_max(sides.ahead[j], line);
        sides.behind[j] = springls__vec_max(sides.behind[j], -line);
    }
    return sides;
}

/* Measures the part of the tangent plane of springl i, with tangents u and v, that is nearer to it than to its neighbors: its
   Voronoi cell. Those on the other side of a thin sheet do not count; those beyond a crease do. */
SPRINGLS__MATHS springls__share springls__share_of(const springls__model *model, int i, springls__v3 u, springls__v3 v)
{
    const float opposite2 = 0.09f, widest = 0.75f; /* cosine^2; voxel */
    const float sector = 0.261799388f;             /* of 30 degrees: pi/12 radius^2 */
    SPRINGLS__GLOBAL const int *codes = model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW;
    springls__v3 p = model->set.s[i].p, n = springls__cross(u, v);
    float ahead[8], behind[8], odd[SPRINGLS__SHARE_DIRECTIONS];
    springls__cell_sides sides;
    springls__share share;
    int k, j;
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) sides.ahead[j] = sides.behind[j] = springls__vec_broadcast(1.0f / widest);
    for (k = 0; k < SPRINGLS__NEIGHBOR_ROW; k++) {
        SPRINGLS__GLOBAL const springls__springl *o;
        springls__v3 d, area2;
        float facing, near2;
        if (codes[k] < 0) { /* skips the rest of a vertex's list */
            k |= SPRINGLS__MAX_NEIGHBORS - 1;
            continue;
        }
        o = &model->set.s[codes[k] / 3];
        area2 = springls__tri_area2(springls__springl_tri(*o));
        facing = springls__dot(area2, n);
        if (facing < 0.0f && facing * facing >= opposite2 * springls__length2(area2)) continue;
        d = springls__sub(o->p, p);
        near2 = 2.0f / springls__max(springls__length2(d), 1e-6f);
        sides = springls__cut_cell(sides, springls__dot(d, u) * near2, springls__dot(d, v) * near2);
    }
    for (j = 0; j < 8 / SPRINGLS__LANES; j++) {
        springls__vec_store(ahead + j * SPRINGLS__LANES, sector / (sides.ahead[j] * sides.ahead[j]));
        springls__vec_store(behind + j * SPRINGLS__LANES, sector / (sides.behind[j] * sides.behind[j]));
    }
    share.area = 0.0f;
    for (j = 0; j < SPRINGLS__SHARE_DIRECTIONS; j++) {
        share.area += ahead[j] + behind[j];
        odd[j] = ahead[j] - behind[j];
    }
    share.cosine = odd[0] - odd[2] + odd[4];
    share.sine = odd[1] - odd[3] + odd[5];
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
    if (springls__is_asleep(model, i)) {
        springls__keep_asleep(model, args, i);
        return;
    }
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
