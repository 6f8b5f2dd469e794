/* relax.h - Algorithm 1: every springl seeks equilibrium with its neighbours, all at once (Jacobi). */

SPRINGLS__FN springls__relax_rule springls__relax_rule_of(const springls_params *params)
{
    springls__relax_rule rule;
    rule.rest = 2.0f * params->particle_radius;
    rule.radius = params->neighbor_radius;
    rule.d_max = params->d_max;
    rule.kappa_int = params->kappa_int;
    rule.kappa_ext = params->kappa_ext;
    rule.sharpness = params->sharpness;
    rule.step_length = params->relax_step_length;
    rule.step_rotation = params->relax_step_rotation;
    rule.threshold = (int)params->threshold;
    rule.weight = (int)params->weight;
    rule.physical = params->torque == SPRINGLS_TORQUE_PHYSICAL;
    return rule;
}

SPRINGLS__FN void springls__relax_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__springl *all = ctx->set.s;
    springls__springl *next = (springls__springl *)ctx->scratch[1].data;
    springls__relax_rule rule = springls__relax_rule_of(&ctx->params);
    springls__relax_range(rule, all, (const int *)ctx->neighbors.data, begin, end, next);
    for (; begin < end; begin++)
        if (ctx->set.mask[begin]) next[begin] = all[begin];
}

SPRINGLS__FN springls_status springls__relax(springls_context *ctx)
{
    int iteration;
    if (ctx->set.count == 0 || ctx->params.relax_iterations == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__neighbors_build(ctx));
    SPRINGLS__TRY(springls__grow(ctx, &ctx->scratch[1], (size_t)ctx->set.count, sizeof(springls__springl), 0));
    for (iteration = 0; iteration < ctx->params.relax_iterations; iteration++) {
        springls__buffer memory;
        springls__parallel(ctx, ctx->set.count, 128, springls__relax_task, ctx);
        memory = ctx->set.s_memory;
        ctx->set.s_memory = ctx->scratch[1];
        ctx->scratch[1] = memory;
        ctx->set.s = (springls__springl *)ctx->set.s_memory.data;
    }
    springls__constellation_moved(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__orient_task(void *arg, int begin, int end)
{
    springls_context *ctx = (springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    for (; begin < end; begin++) {
        springls__springl *s = &ctx->set.s[begin];
        springls__v3 gradient = springls__grid_gradient(g, g->phi, s->p), q = s->q[1];
        bool certain = springls__length2(gradient) > 0.49f && springls__fabs(springls__grid_sample(g, g->phi, s->p)) < 0.5f;
        if (!certain || springls__dot(springls__springl_normal(s), gradient) >= 0.0f) continue;
        s->q[1] = s->q[2];
        s->q[2] = q;
        springls__springl_finish(s);
    }
}

/* Section 4.3.1: n . grad phi < 0 is a flipped triangle. Only where phi is certain of its gradient, on one clear sheet. */
SPRINGLS__FN springls_status springls__orient(springls_context *ctx)
{
    springls__parallel(ctx, ctx->set.count, 256, springls__orient_task, ctx);
    ctx->model_fresh = false;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_relax(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_RELAX, springls__relax);
}
