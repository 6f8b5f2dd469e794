/* resample.h - splitting at the longest edge (section 4.6). */
#ifndef SPRINGLS__KERNEL_STAGES_RESAMPLE_H
#define SPRINGLS__KERNEL_STAGES_RESAMPLE_H

#include "../model/error_estimates.h"
#include "../model/fit.h"
#include "../model/model.h"
#include "track.h"

/* Returns the longest edge: 0, 1 or 2, from that vertex to the next. */
SPRINGLS__MATHS int springls__longest_edge(springls__tri t)
{
    float ab = springls__length2(springls__sub(t.b, t.a)), bc = springls__length2(springls__sub(t.c, t.b));
    float ca = springls__length2(springls__sub(t.a, t.c));
    if (ab >= bc && ab >= ca) return 0;
    return bc >= ca ? 1 : 2;
}

SPRINGLS__MATHS float springls__longest_edge2(springls__tri t)
{
    return springls__max(springls__length2(springls__sub(t.b, t.a)),
                         springls__max(springls__length2(springls__sub(t.c, t.b)), springls__length2(springls__sub(t.a, t.c))));
}

/* Returns one half of a triangle cut from the middle of its longest edge to the opposite vertex; both halves keep its
   orientation. */
SPRINGLS__MATHS springls__tri springls__split_half(springls__tri t, int second)
{
    int edge = springls__longest_edge(t);
    springls__tri turned = t, child;
    springls__v3 middle;
    if (edge == 1) { turned.a = t.b; turned.b = t.c; turned.c = t.a; }
    if (edge == 2) { turned.a = t.c; turned.b = t.a; turned.c = t.b; }
    middle = springls__lerp(turned.a, turned.b, 0.5f);
    child.a = second ? middle : turned.a;
    child.b = second ? turned.b : middle;
    child.c = turned.c;
    return child;
}

/* Half of a springl that is split. */
typedef struct springls__half { springls__springl s; springls__v3 a; float error; } springls__half;

/* Places a child of half of springl i's triangle. The quadratic rule moves it onto the fitted surface and gives it the fitted
   correspondence; the paper's rule leaves it in the triangle's plane, with the parent's correspondence. */
SPRINGLS__MATHS springls__half springls__place_child(const springls__model *model, int i, int second)
{
    springls__half child;
    springls__tri t = springls__split_half(springls__springl_tri(model->set.s[i]), second);
    springls__fit_result fit;
    child.s = springls__springl_make(t, springls__tri_centroid(t));
    child.a = model->set.a[i];
    child.error = 0.0f;
    if (model->params.placement != SPRINGLS_PLACEMENT_QUADRATIC) return child;
    fit = springls__fit_at(model, i, child.s.p, springls__tri_normal(t), child.a, model->set.count);
    if (!fit.ok) return child;
    child.s = springls__springl_finished(springls__moved_to(child.s, fit.point));
    child.a = springls__project_on_original(model, fit.a);
    return child;
}

/* Makes a child of half of springl i's triangle, and estimates its error. */
SPRINGLS__MATHS springls__half springls__child_of(const springls__model *model, int i, int second)
{
    springls__half child = springls__place_child(model, i, second);
    child.error = springls__error_at_birth(model, child.s.p, springls__springl_normal(child.s), child.a, model->set.count);
    return child;
}

/* Returns true when springl i has grown too large, and is neither masked nor asleep. */
SPRINGLS__MATHS bool springls__is_overgrown(const springls__model *model, int i)
{
    const springls_params *p = &model->params;
    springls__tri t = springls__springl_tri(model->set.s[i]);
    return !model->set.mask[i] && !springls__is_asleep(model, i)
        && (springls__longest_edge2(t) > p->split_edge * p->split_edge
            || springls__length2(springls__tri_area2(t)) > 4.0f * p->split_area * p->split_area);
}

/* Flags springl i in split_number when it is to be split. */
SPRINGLS__MATHS void springls__overgrown_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__split_number(model)[i] = springls__is_overgrown(model, i) ? 1u : 0u;
}

/* Returns true when springl i is to be split and among the first args.insert.count of those. */
SPRINGLS__MATHS bool springls__is_split(const springls__model *model, int i, springls__arguments args)
{
    return springls__split_number(model)[i] < (uint32_t)args.insert.count
        && springls__is_overgrown(model, i);
}

/* Splits springl i into halves, stored by its number. */
SPRINGLS__MATHS void springls__split_element(const springls__model *model, springls__arguments args, int i)
{
    uint32_t n = springls__split_number(model)[i], second;
    if (!springls__is_split(model, i, args)) return;
    for (second = 0u; second < 2u; second++)
        springls__split_halves(model)[2u * n + second] = springls__child_of(model, i, (int)second);
}

/* Stores the halves of a springl: the first in its place, the second behind all springls. Halves of a filled springl count as filled. */
SPRINGLS__MATHS void springls__split_store_element(const springls__model *model, springls__arguments args, int i)
{
    uint32_t number = springls__split_number(model)[i];
    springls__v3 moved = springls__sub(model->set.s[i].p, model->set.synced_position[i]);
    springls__half first, second;
    bool filled = (model->set.birth[i] & 3u) == SPRINGLS__KIND_FILLED;
    int n = model->set.count + (int)number;
    if (!springls__is_split(model, i, args)) return;
    first = springls__split_halves(model)[2u * number];
    second = springls__split_halves(model)[2u * number + 1u];
    model->set.generation[i]++;
    springls__springl_add(model, n, second.s, second.a, model->set.generation[i], 0u);
    model->set.synced_position[n] = springls__sub(second.s.p, moved);
    model->set.parent[n] = model->set.id[i];
    springls__inherit_components(model, n, i);
    model->set.overlapped[n] = model->set.overlapped[i];
    model->set.birth[i] = springls__birth_of(model, filled ? SPRINGLS__KIND_FILLED : SPRINGLS__KIND_SPLIT);
    model->set.birth[n] = model->set.birth[i];
    model->set.s[i] = first.s;
    model->set.a[i] = first.a;
    model->set.error[i] = first.error;
    model->set.error[n] = second.error;
    model->set.synced_position[i] = springls__sub(first.s.p, moved);
}

#endif
