/* resample.h - splits springls that have grown too large, at their longest edge (section 4.6, Table 2). */

/* A flat child from half of the parent's triangle. With the quadratic rule it then moves onto the fitted surface and
   takes the fitted correspondence; the paper's rule leaves it flat, with the parent's. */
SPRINGLS__FN springls__v3 springls__place_child(springls_context *ctx, springls__springl *child, springls__v3 a, int known)
{
    springls__fit_result fit;
    int m;
    child->p = springls__tri_centroid(springls__springl_tri(child));
    if (ctx->params.placement == SPRINGLS_PLACE_COPY) return a;
    fit = springls__fit_at(ctx, child->p, springls__springl_normal(child), a, known);
    if (!fit.ok) return a;
    for (m = 0; m < 3; m++) child->q[m] = springls__add(child->q[m], springls__sub(fit.point, child->p));
    child->p = fit.point;
    return springls__project_on_original(ctx, fit.a);
}

SPRINGLS__FN bool springls__is_overgrown(const springls_params *params, springls__tri t)
{
    return springls__longest_edge2(t) > params->split_edge * params->split_edge
        || springls__length2(springls__tri_area2(t)) > 4.0f * params->split_area * params->split_area;
}

SPRINGLS__FN springls_status springls__resample(springls_context *ctx)
{
    springls__constellation *set = &ctx->set;
    int i, count = set->count, splits = 0;
    for (i = 0; i < count; i++) splits += springls__is_overgrown(&ctx->params, springls__springl_tri(&set->s[i]));
    if (splits == 0) return SPRINGLS_OK;
    if (splits > ctx->desc.max_springls - count) {
        ctx->stats.refused += splits - (ctx->desc.max_springls - count);
        splits = springls__imax(ctx->desc.max_springls - count, 0);
    }
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count + splits));
    for (i = 0; i < count && splits > 0; i++) {
        springls__tri t = springls__springl_tri(&set->s[i]), half;
        springls__springl child[2];
        springls__v3 a[2], moved = springls__sub(set->s[i].p, set->was[i]);
        int k;
        if (!springls__is_overgrown(&ctx->params, t)) continue;
        for (k = 0; k < 2; k++) {
            half = springls__split_half(t, k);
            child[k] = set->s[i];
            child[k].q[0] = half.a;
            child[k].q[1] = half.b;
            child[k].q[2] = half.c;
            a[k] = springls__place_child(ctx, &child[k], set->a[i], count);
        }
        set->s[i] = child[0];
        springls__springl_finish(&set->s[i]);
        set->a[i] = a[0];
        set->generation[i]++;
        set->was[i] = springls__sub(child[0].p, moved);
        set->was[springls__constellation_append(ctx, &child[1], a[1], set->generation[i], set->mask[i])] = springls__sub(child[1].p, moved);
        ctx->stats.split++;
        splits--;
    }
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_resample(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_RESAMPLE, springls__resample);
}
