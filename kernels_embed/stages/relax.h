/* relax.h - one springl seeks equilibrium with its neighbours (section 4.3). */
#ifndef SPRINGLS__KERNEL_STAGES_RELAX_H
#define SPRINGLS__KERNEL_STAGES_RELAX_H

#include "../model/grid.h"
#include "../model/model.h"
#include "../model/neighborhood.h"

typedef struct springls__relax_rule {
    float rest, radius, d_max;       /* 2r, R, d_max (Table 1)                   */
    float kappa_int, kappa_ext;      /* eq. 4, 5                                 */
    float sharpness;                 /* lambda_c                                 */
    float step_length, step_rotation; /* xi, rho (eq. 17, 18)                    */
    springls_threshold threshold;    /* H                                         */
    springls_weight weight;          /* W                                         */
    int physical;                    /* torque: eq. 19, else eq. 20               */
} springls__relax_rule;

SPRINGLS__MATHS springls__relax_rule springls__relax_rule_of(const springls_params *params)
{
    springls__relax_rule rule;
    rule.rest = 2.0f * params->particle_radius;
    rule.radius = params->neighbor_radius;
    rule.d_max = params->d_max;
    rule.kappa_int = params->kappa_int;
    rule.kappa_ext = params->kappa_ext;
    rule.sharpness = params->sharpness;
    rule.step_length = params->cover ? 0.0f : params->relax_step_length; /* springs turn a triangle; its share sizes it */
    rule.step_rotation = params->relax_step_rotation;
    rule.threshold = params->threshold;
    rule.weight = params->weight;
    rule.physical = params->torque == SPRINGLS_TORQUE_PHYSICAL;
    return rule;
}

#include "../language/width_float.h"
#include "relax_body.h"
#include "../language/width_simd.h"
#include "relax_body.h"

/* Leaves in relaxed_springls springl i, which is asleep, as it was before shorten_arms. args.relax.kept: it is there already. */
SPRINGLS__MATHS void springls__keep_asleep(const springls__model *model, springls__arguments args, int i)
{
    if (!args.relax.kept) springls__relaxed_springls(model)[i] = model->set.s[i];
}

/* Does one iteration of Algorithm 1 for springl i, from S to relaxed_springls. Springls that are masked or asleep stay as they
   are. */
SPRINGLS__MATHS void springls__relax_element(const springls__model *model, springls__arguments args, int i)
{
    if (springls__is_asleep(model, i)) springls__keep_asleep(model, args, i);
    else if (model->set.mask[i]) springls__relaxed_springls(model)[i] = model->set.s[i];
    else springls__relax_springl(model, springls__relax_rule_of(&model->params), i);
}

/* Does one iteration of Algorithm 1 for springls begin, ..., end - 1, several at once. */
SPRINGLS__MATHS void springls__relax_elements(const springls__model *model, springls__arguments args, int begin, int end)
{
    const springls__relax_rule rule = springls__relax_rule_of(&model->params);
    int i;
    for (; begin + SPRINGLS__LANES <= end; begin += SPRINGLS__LANES) {
        bool all = true;
        for (i = begin; i < begin + SPRINGLS__LANES; i++) all = all && !model->set.mask[i] && !springls__is_asleep(model, i);
        if (all) springls__vec_relax_springl(model, rule, begin);
        else
            for (i = begin; i < begin + SPRINGLS__LANES; i++) springls__relax_element(model, args, i);
    }
    for (; begin < end; begin++) springls__relax_element(model, args, begin);
}

/* Returns true when a triangle at p with normal n is flipped, n . grad phi < 0 (section 4.3.1), by more than `aslant`, where the
   gradient of phi is reliable: beside a single sheet. */
SPRINGLS__MATHS bool springls__is_flipped(const springls__grid *g, springls__v3 p, springls__v3 n, float aslant)
{
    springls__v3 gradient = springls__grid_gradient(g, g->phi, p);
    return springls__dot(n, gradient) < -aslant && springls__length2(gradient) > 0.49f
        && springls__fabs(springls__grid_sample(g, g->phi, p)) < 0.5f;
}

/* Turns a flipped triangle, unless its springl is masked, asleep or beside another body. */
SPRINGLS__MATHS void springls__orient_element(const springls__model *model, springls__arguments args, int i)
{
    const float beside = 1.6f; /* voxels */
    /* Beside the rim of a gap that phi has closed, its gradient lies along the triangles of both sides. */
    const float aslant = model->params.keep_thin ? 0.2f : 0.0f;
    springls__springl s = model->set.s[i];
    (void)args;
    if (model->set.mask[i] || springls__is_asleep(model, i) || springls__is_overlapped(model, i)
        || !springls__is_flipped(&model->grid, s.p, springls__springl_normal(s), aslant)) return;
    if (model->params.contact == SPRINGLS_CONTACT_SEPARATE && springls__side_of_springls(model, s.p, i, beside) != 0) return;
    model->set.s[i] = springls__reversed(s);
}

#endif
