/* neighborhood.h - the springls around a place: the nearest one, the widest gap between them, whether they form a sheet. */
#ifndef SPRINGLS__KERNEL_MODEL_NEIGHBORHOOD_H
#define SPRINGLS__KERNEL_MODEL_NEIGHBORHOOD_H

#include "angular_gaps.h"
#include "cell_list.h"
#include "model.h"

/* Two springls face against each other where the cosine of the angle between their normals is smaller. */
#define SPRINGLS__FACING_AGAINST (-0.5f)

/* Returns true when a springl with normal n and one at d from it, with normal m, face each other across a gap: each lies before the
   other. Two sides of a sheet lie behind each other, and so do surfaces that have passed through each other. */
SPRINGLS__MATHS bool springls__across_gap(springls__v3 d, springls__v3 n, springls__v3 m)
{
    const float touching = 0.1f; /* voxel: surfaces that have met lie deeper in each other */
    return springls__dot(n, m) < SPRINGLS__FACING_AGAINST && springls__dot(d, n) > -touching && springls__dot(d, m) < touching;
}

/* Returns how far a triangle may be that could be nearer than the one at squared distance best2, or as near: more by all rounding
   errors, at most `radius`. */
SPRINGLS__MATHS float springls__nearest_limit(float best2, float radius)
{
    return springls__min(springls__sqrt(best2) + 1e-3f, radius);
}

/* Returns the springl whose triangle is closest to x, within `radius`, of those that do not face away from n (0: of all); -1 if
   there is none. */
SPRINGLS__MATHS int springls__nearest_springl_facing(const springls__model *model, springls__v3 x, springls__v3 n, float radius)
{
    springls__cell_walk walk = springls__cell_walk_around(model, x, radius);
    float best = radius * radius, limit = radius;
    int i, nearest = -1;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
        springls__tri_plan plan;
        float d2, within = limit + s->bounding_radius;
        if (springls__length2(springls__sub(s->p, x)) > within * within) continue;
        plan = springls__tri_plan_make(springls__springl_tri(*s));
        if (springls__dot(plan.n, n) < 0.0f) continue;
        d2 = springls__tri_distance2(&plan, x);
        if (d2 < best || (d2 == best && i < nearest)) {
            best = d2;
            limit = springls__nearest_limit(best, radius);
            nearest = i;
        }
    }
    return nearest;
}

/* Returns the springl whose triangle is closest to x, within `radius`; -1 if there is none. */
SPRINGLS__MATHS int springls__nearest_springl(const springls__model *model, springls__v3 x, float radius)
{
    return springls__nearest_springl_facing(model, x, springls__v3_make(0.0f, 0.0f, 0.0f), radius);
}

/* Returns true when springl `other` lies beside x on its side of the surface: its particle is within r of x and at most `high`
   above or below its tangent plane. Those of other bodies than springl `of` do not count. */
SPRINGLS__INNER bool springls__lies_beside(const springls__model *model, int of, int other, springls__v3 x, springls__v3 n,
                                           float r, float high)
{
    springls__springl s = model->set.s[other];
    springls__v3 d = springls__sub(s.p, x);
    if (springls__length2(d) > r * r || springls__fabs(springls__dot(d, n)) > high) return false;
    return !springls__of_two_contact_bodies(model, of, other)
           && springls__dot(springls__tri_area2(springls__springl_tri(s)), n) > 0.0f;
}

/* Returns true when the springls beside x leave no gap of 102 degrees, by a test that is quick and may miss some. */
SPRINGLS__MATHS bool springls__is_surrounded(const springls__model *model, int of, springls__v3 x, springls__v3 n, float r,
                                             float high)
{
    springls__angular_gaps gaps = springls__angular_gaps_begin(n);
    springls__cell_walk walk = springls__cell_walk_near(model, x, r);
    uint32_t sectors = 0u;
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        springls__v3 d;
        float u, v;
        if (!springls__lies_beside(model, of, other, x, n, r, high)) continue;
        d = springls__sub(model->set.s[other].p, x);
        u = springls__dot(d, gaps.e1);
        v = springls__dot(d, gaps.e2);
        if (u * u + v * v < 1e-6f) continue;
        sectors |= springls__sector(u, v);
        if (springls__sectors_close(sectors)) return true;
    }
    return false;
}

/* Finds the widest gap between the directions from x to the particles beside it. */
SPRINGLS__MATHS springls__widest_gap springls__widest_gap_at(const springls__model *model, int of, springls__v3 x,
                                                             springls__v3 n, float r, float high)
{
    springls__angular_gaps gaps = springls__angular_gaps_begin(n);
    springls__cell_walk walk = springls__cell_walk_near(model, x, r);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__lies_beside(model, of, other, x, n, r, high))
            springls__angular_gaps_add(&gaps, springls__sub(model->set.s[other].p, x));
    return springls__angular_gaps_widest(&gaps);
}

/* Returns true when x lies in a sheet with normal n, and not in a thread or a drop: a thin sheet is kept, a thread thinner than
   a voxel may break. Particles of both sides count; those right above or below have no direction. */
SPRINGLS__MATHS bool springls__in_sheet(const springls__model *model, springls__v3 x, springls__v3 n)
{
    const float r = 2.0f, high = 1.0f, aside = 0.7f;
    springls__angular_gaps gaps = springls__angular_gaps_begin(n);
    springls__cell_walk walk = springls__cell_walk_near(model, x, springls__sqrt(r * r + high * high));
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        springls__v3 d = springls__sub(model->set.s[other].p, x);
        float h = springls__dot(d, n), aside2 = springls__length2(d) - h * h;
        if (springls__is_overlapped(model, other)) continue;
        if (springls__fabs(h) <= high && aside2 >= aside * aside && aside2 <= r * r) springls__angular_gaps_add(&gaps, d);
    }
    return springls__spans_sheet(&gaps);
}

/* Returns on which side of the springls nearest to it x lies: 1 before, -1 behind, 0 when there are none within `radius`. At an
   edge several are as near, and x is behind only when it is behind all of them. of: a springl, only those of other bodies count;
   -1: all do. */
SPRINGLS__MATHS int springls__side_of_springls(const springls__model *model, springls__v3 x, int of, float radius)
{
    const float same = 1e-4f;
    springls__cell_walk walk = springls__cell_walk_around(model, x, radius);
    float best = radius * radius;
    int i, side = 0;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
        float within = radius + s->bounding_radius, d2;
        springls__tri_plan plan;
        int here;
        if (of >= 0 && !springls__of_two_contact_bodies(model, of, i)) continue;
        if (springls__length2(springls__sub(s->p, x)) > within * within) continue;
        plan = springls__tri_plan_make(springls__springl_tri(*s));
        d2 = springls__tri_distance2(&plan, x);
        if (d2 > best + same) continue;
        here = springls__dot(springls__sub(x, s->q[0]), springls__springl_normal(*s)) < 0.0f ? -1 : 1;
        side = d2 < best - same || side == 0 ? here : side < 0 ? here : side;
        best = springls__min(best, d2);
    }
    return side;
}

#endif
