/* resample.h - splitting at the longest edge (section 4.6). */
#ifndef SPRINGLS__KERNEL_STAGES_RESAMPLE_H
#define SPRINGLS__KERNEL_STAGES_RESAMPLE_H

#include "../model/fit.h"
#include "../model/model.h"
#include "track.h"

/* 0, 1 or 2: the edge from that vertex to the next. */
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

/* Half of a triangle cut from the middle of its longest edge to the opposite vertex; both halves keep the orientation. */
SPRINGLS__MATHS springls__tri springls__split_half(springls__tri t, int second)
{
    int edge = springls__longest_edge(t);
    springls__tri turned = t, part;
    springls__v3 middle;
    if (edge == 1) { turned.a = t.b; turned.b = t.c; turned.c = t.a; }
    if (edge == 2) { turned.a = t.c; turned.b = t.a; turned.c = t.b; }
    middle = springls__lerp(turned.a, turned.b, 0.5f);
    part.a = second ? middle : turned.a;
    part.b = second ? turned.b : middle;
    part.c = turned.c;
    return part;
}

/* A springl that has been split in two; and where the halves have to go. */
typedef struct springls__half { springls__springl s; springls__v3 a; float pad; } springls__half;

/* A flat child from half of the parent's triangle. With the quadratic rule it then moves onto the fitted surface and
   takes the fitted correspondence; the paper's rule leaves it flat, with the parent's. */
SPRINGLS__MATHS springls__half springls__child_of(const springls__model *model, int i, int second)
{
    springls__half child;
    springls__tri t = springls__split_half(springls__springl_tri(model->set.s[i]), second);
    springls__fit_result fit;
    int m;
    child.s = springls__springl_make(t, springls__tri_centroid(t));
    child.a = model->set.a[i];
    child.pad = 0.0f;
    if (model->params.placement == SPRINGLS_PLACEMENT_QUADRATIC) {
        fit = springls__fit_at(model, child.s.p, springls__tri_normal(t), child.a, model->set.count);
        if (fit.ok) {
            for (m = 0; m < 3; m++) child.s.q[m] = springls__add(child.s.q[m], springls__sub(fit.point, child.s.p));
            child.s.p = fit.point;
            child.s = springls__springl_finished(child.s);
            child.a = springls__project_on_original(model, fit.a);
        }
    }
    return child;
}

SPRINGLS__MATHS bool springls__is_overgrown(const springls__model *model, springls__tri t)
{
    return springls__longest_edge2(t) > model->params.split_edge * model->params.split_edge
        || springls__length2(springls__tri_area2(t)) > 4.0f * model->params.split_area * model->params.split_area;
}

/* To SCRATCH1: 1 for a springl that is to be split; a scan makes it the number of its second child. */
SPRINGLS__MATHS void springls__overgrown_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__split_number(model)[i] = springls__is_overgrown(model,
                                                                                 springls__springl_tri(model->set.s[i])) ? 1u
                                                                                     : 0u;
}

/* To SCRATCH2: the halves of the first job.i[0] of them. */
SPRINGLS__MATHS void springls__split_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL springls__half *halves = springls__split_halves(model);
    uint32_t at = springls__split_number(model)[i];
    if (!springls__is_overgrown(model, springls__springl_tri(model->set.s[i])) || at >= (uint32_t)args.insert.count) return;
    halves[2u * at] = springls__child_of(model, i, 0);
    halves[2u * at + 1u] = springls__child_of(model, i, 1);
}

/* The first half takes the parent's place, the second goes behind all that were there. A springl that was filled stays one. */
SPRINGLS__MATHS void springls__split_store_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const springls__half *halves = springls__split_halves(model);
    uint32_t at = springls__split_number(model)[i];
    springls__v3 moved = springls__sub(model->set.s[i].p, model->set.synced_position[i]);
    springls__half first, second;
    int n = model->set.count + (int)at;
    if (!springls__is_overgrown(model, springls__springl_tri(model->set.s[i])) || at >= (uint32_t)args.insert.count) return;
    first = halves[2u * at];
    second = halves[2u * at + 1u];
    model->set.generation[i]++;
    springls__springl_add(model, n, second.s, second.a, model->set.generation[i], model->set.mask[i]);
    model->set.synced_position[n] = springls__sub(second.s.p, moved);
    model->set.parent[n] = model->set.id[i];
    model->set.birth[i] = springls__birth_of(model,
                                             (model->set.birth[i] & 3u) == SPRINGLS__KIND_FILLED ? SPRINGLS__KIND_FILLED : SPRINGLS__KIND_SPLIT);
    model->set.birth[n] = model->set.birth[i];
    model->set.s[i] = first.s;
    model->set.a[i] = first.a;
    model->set.synced_position[i] = springls__sub(first.s.p, moved);
}

#endif
