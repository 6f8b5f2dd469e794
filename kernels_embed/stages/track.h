/* track.h - correspondences stay on the original surface (section 4.7). */
#ifndef SPRINGLS__KERNEL_STAGES_TRACK_H
#define SPRINGLS__KERNEL_STAGES_TRACK_H

#include "../model/cell_list.h"
#include "../model/fit.h"
#include "../model/grid.h"
#include "../model/model.h"
#include "keep_edges.h"

/* Returns the correspondence a after one step of eq. 26, along the gradient of phi_ref, the signed distance to the original surface. */
SPRINGLS__MATHS springls__v3 springls__project_step(springls__v3 a, float phi, springls__v3 gradient, float step)
{
    return springls__mad(a, gradient, -step * phi);
}

/* Projects a onto the original surface (eq. 26). */
SPRINGLS__NOINLINE springls__v3 springls__project_on_original(const springls__model *model, springls__v3 a)
{
    const springls__grid *g = &model->reference;
    int i;
    for (i = 0; i < model->params.track_iterations; i++)
        a = springls__project_step(a, springls__grid_sample_smooth(g, g->phi, a), springls__grid_gradient(g, g->phi, a),
                                   model->params.track_step);
    return a;
}

/* Returns the smallest distance between the vertices and particle of one springl and the triangle of another, squared. */
SPRINGLS__MATHS float springls__springl_distance2(springls__springl s, springls__springl other)
{
    springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(other));
    float d2 = springls__tri_distance2(&plan, s.p);
    int m;
    for (m = 0; m < 3; m++) d2 = springls__min(d2, springls__tri_distance2(&plan, s.q[m]));
    return d2;
}

/* Returns the correspondence of a new springl by the paper's rule: the average of its neighbors' within R, or the nearest one's
   when that is far from the average. Neighbors are springls before `known`; R doubles until there are some. *nearest_springl: the
   nearest one's number, -1 when there is none. */
SPRINGLS__MATHS springls__v3 springls__correspondence_of_neighbors(const springls__model *model, springls__springl s, int known,
                                                                   int *nearest_springl)
{
    springls__v3 n = springls__springl_normal(s);
    float radius = model->params.neighbor_radius;
    int attempt;
    *nearest_springl = -1;
    for (attempt = 0; attempt < 6; attempt++, radius *= 2.0f) {
        springls__cell_walk walk = springls__cell_walk_around(model, s.p, radius + s.bounding_radius);
        springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f), nearest = sum;
        float best = FLT_MAX;
        int other, count = 0;
        while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
            float d2;
            if (other >= known || springls__dot(springls__springl_normal(model->set.s[other]), n) <= 0.0f)
                continue; /* on the other side of a sheet */
            d2 = springls__springl_distance2(s, model->set.s[other]);
            if (d2 > radius * radius) continue;
            if (*nearest_springl >= 0 && springls__of_two_contact_bodies(model, *nearest_springl, other)) {
                if (d2 >= best) continue;
                sum = springls__v3_make(0.0f, 0.0f, 0.0f); /* of the body of the nearest one */
                count = 0;
            }
            sum = springls__add(sum, model->set.a[other]);
            count++;
            if (d2 < best) {
                best = d2;
                nearest = model->set.a[other];
                *nearest_springl = other;
            }
        }
        if (count == 0) continue;
        sum = springls__scale(sum, 1.0f / (float)count);
        return springls__length(springls__sub(sum, nearest)) > model->params.nearest_rule ? nearest : sum;
    }
    return s.p;
}

/* Fits a quadratic at x over the particles around, of springls before `known` and of the body of springl `of`; near an edge, over
   those of one side. */
SPRINGLS__NOINLINE springls__fit_result springls__fit_at(const springls__model *model, int of, springls__v3 x, springls__v3 n,
                                                         springls__v3 a0, int known)
{
    springls__fit fit = springls__fit_begin(x, n, a0);
    springls__box correspondences = springls__box_empty();
    springls__cell_walk walk = springls__cell_walk_near(model, x, SPRINGLS__FIT_RADIUS);
    springls__fit_result result;
    int other;
    if (model->params.keep_edges && springls__place_at_edge(model, x, n, a0, known, &result)) return result;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        if (other >= known || springls__of_two_contact_bodies(model, of, other)) continue;
        if (springls__fit_add(&fit, o->p, springls__springl_normal(*o), model->set.a[other]))
            correspondences = springls__box_add(correspondences, model->set.a[other]);
    }
    return springls__fit_end_in_box(&fit, correspondences);
}

SPRINGLS__MATHS void springls__track_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    model->set.a[i] = springls__project_on_original(model, model->set.a[i]);
}

#endif
