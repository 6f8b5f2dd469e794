/* contract.h - removes poor springls and those far from the zero level (section 4.6). */

/* phi at x. Beyond the domain samples are constant, so the way back to it is added: springls that have been pushed out of the
   grid are far from the zero level. */
SPRINGLS__FN float springls__phi_or_beyond(const springls__grid *g, springls__v3 x)
{
    springls__v3 border = springls__v3_make(springls__clamp(x.x, -1.0f, (float)g->size[0]), springls__clamp(x.y, -1.0f, (float)g->size[1]),
                                            springls__clamp(x.z, -1.0f, (float)g->size[2]));
    return springls__grid_sample(g, g->phi, x) + springls__length(springls__sub(x, border));
}

SPRINGLS__FN void springls__sample_phi_task(void *arg, int begin, int end)
{
    springls_context *ctx = (springls_context *)arg;
    for (; begin < end; begin++) ctx->set.phi[begin] = springls__phi_or_beyond(&ctx->grid, ctx->set.s[begin].p);
}

/* phi_n: to be taken when the level set has caught up with the springls. In Algorithm 2 that is before they move: after
   a step as long as d_max a good springl is further from the old zero level than contract allows. */
SPRINGLS__FN void springls__sample_phi(springls_context *ctx)
{
    springls__parallel(ctx, ctx->set.count, 512, springls__sample_phi_task, ctx);
}

/* True when a springl far from the zero level belongs to a sheet too thin for phi: the sheet's other side is behind it, or
   neighbours beside it say so at the rim and where the other side is bare. phi is outside in front of either; in front of
   springls that are left over where two bodies have merged it is inside, which nothing else would tell from here. */
SPRINGLS__FN bool springls__on_thin_sheet(const springls_context *ctx, int i)
{
    const float r = 1.6f, ahead = 1.5f;
    const int enough = 3;
    const springls__springl *s = &ctx->set.s[i];
    springls__v3 n = springls__springl_normal(s);
    springls__cell_walk walk;
    int other, beside = 0;
    if (ctx->set.phi[i] > ctx->grid.far_value) return false; /* pushed out of the grid */
    if (springls__phi_or_beyond(&ctx->grid, springls__mad(s->p, n, ahead)) <= 0.0f) return false;
    walk = springls__cell_walk_near(ctx, s->p, r);
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        springls__v3 d = springls__sub(ctx->set.s[other].p, s->p), m;
        if (other == i || springls__length2(d) > r * r) continue;
        if (springls__at_edge(ctx, other)) return false; /* beyond a sharp edge it would look the same */
        m = springls__springl_normal(&ctx->set.s[other]);
        if (springls__is_far_side(d, n, m)) return true;
        beside += springls__is_beside(d, n, m);
        if (beside >= enough && ctx->set.phi[i] > 0.0f) return true;
    }
    return false;
}

/* True when what lies before a springl is inside: bodies have met there, and nothing but the springls left between them makes
   the projection hold phi near zero. */
SPRINGLS__FN bool springls__is_buried(const springls_context *ctx, const springls__springl *s)
{
    const float ahead = 0.75f, deep = -0.2f;
    return springls__phi_or_beyond(&ctx->grid, springls__mad(s->p, springls__springl_normal(s), ahead)) < deep;
}

enum { SPRINGLS__REMOVE, SPRINGLS__KEEP, SPRINGLS__RESHAPE };

typedef struct springls__contract_job {
    springls_context *ctx;
    uint8_t *keep; /* what becomes of a springl */
    float cos_min, cos_max;
} springls__contract_job;

SPRINGLS__FN void springls__contract_task(void *arg, int begin, int end)
{
    const springls__contract_job *job = (const springls__contract_job *)arg;
    const springls_context *ctx = job->ctx;
    for (; begin < end; begin++) {
        const springls__springl *s = &ctx->set.s[begin];
        bool distant = springls__fabs(ctx->set.phi[begin]) > ctx->params.contract_distance;
        job->keep[begin] = SPRINGLS__KEEP;
        if (ctx->params.project_level_set && springls__is_buried(ctx, s)) job->keep[begin] = SPRINGLS__REMOVE;
        else if (distant && !(ctx->params.keep_thin && springls__on_thin_sheet(ctx, begin))) job->keep[begin] = SPRINGLS__REMOVE;
        else if (!ctx->set.mask[begin] && springls__bad_shape(springls__springl_tri(s), job->cos_min, job->cos_max, ctx->params.min_area))
            job->keep[begin] = ctx->params.reshape ? SPRINGLS__RESHAPE : SPRINGLS__REMOVE;
    }
}

/* A good shape about the same particle, which keeps its exact path and correspondence. */
SPRINGLS__FN void springls__reshape(springls_context *ctx, int i)
{
    const float smallest = 0.15f; /* voxel^2: what has collapsed must reach its neighbours again */
    springls__springl *s = &ctx->set.s[i];
    springls__tri t = springls__springl_tri(s);
    springls__v3 area2 = springls__tri_area2(t), n;
    float area = 0.5f * springls__length(area2);
    n = area > 1e-4f ? springls__normalize(area2) : springls__normalize(springls__grid_gradient(&ctx->grid, ctx->grid.phi, s->p));
    if (springls__length2(n) < 0.5f) n = springls__v3_make(0.0f, 0.0f, 1.0f);
    t = springls__equilateral(s->p, n, springls__sub(t.a, s->p), springls__max(area, smallest));
    s->q[0] = t.a;
    s->q[1] = t.b;
    s->q[2] = t.c;
    springls__springl_finish(s);
}

/* True when an older kept springl on the same side sits closer than merge_distance. */
SPRINGLS__FN bool springls__is_crowded(const springls_context *ctx, const uint8_t *keep, int i)
{
    const float r = ctx->params.merge_distance;
    const springls__springl *s = &ctx->set.s[i];
    springls__v3 n = springls__springl_normal(s);
    springls__cell_walk walk = springls__cell_walk_near(ctx, s->p, r);
    int other;
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        const springls__springl *o = &ctx->set.s[other];
        bool older = ctx->set.generation[other] < ctx->set.generation[i]
                  || (ctx->set.generation[other] == ctx->set.generation[i] && other < i);
        if (!older || !keep[other] || springls__length2(springls__sub(o->p, s->p)) >= r * r) continue;
        if (springls__dot(springls__springl_normal(o), n) > 0.3f) return true;
    }
    return false;
}

/* Of two springls that sit on each other the younger goes: oldest first, so that only kept ones displace others. */
SPRINGLS__FN springls_status springls__merge_crowded(springls_context *ctx, uint8_t *keep)
{
    enum { AGES = 256 }; /* older ones count as of one age */
    int first[AGES + 1], *order, i, age, count = ctx->set.count;
    SPRINGLS__TRY(springls__cells_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 2, (size_t)count, sizeof(int), (void **)&order));
    memset(first, 0, sizeof first);
    for (i = 0; i < count; i++) first[springls__imin((int)ctx->set.generation[i], AGES - 1) + 1]++;
    for (age = 0; age < AGES; age++) first[age + 1] += first[age];
    for (i = 0; i < count; i++) order[first[springls__imin((int)ctx->set.generation[i], AGES - 1)]++] = i;
    for (i = 0; i < count; i++)
        if (keep[order[i]] && springls__is_crowded(ctx, keep, order[i])) keep[order[i]] = SPRINGLS__REMOVE;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__contract(springls_context *ctx)
{
    springls__contract_job job;
    int i;
    if (ctx->set.count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)ctx->set.count, 1, (void **)&job.keep));
    if (ctx->params.keep_thin) SPRINGLS__TRY(springls__cells_build(ctx));
    job.ctx = ctx;
    job.cos_min = springls__cospi(ctx->params.min_angle / 180.0f);
    job.cos_max = springls__cospi(ctx->params.max_angle / 180.0f);
    springls__parallel(ctx, ctx->set.count, 256, springls__contract_task, &job);
    for (i = 0; i < ctx->set.count; i++) {
        if (job.keep[i] != SPRINGLS__RESHAPE) continue;
        springls__reshape(ctx, i);
        ctx->stats.reshaped++;
    }
    if (ctx->params.merge_distance > 0.0f) {
        springls__constellation_changed(ctx);
        SPRINGLS__TRY(springls__merge_crowded(ctx, job.keep));
    }
    ctx->stats.removed += springls__constellation_compact(ctx, job.keep);
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_contract(springls_context *ctx)
{
    if (ctx) springls__sample_phi(ctx);
    return springls__staged(ctx, SPRINGLS_STAGE_CONTRACT, springls__contract);
}
