/* fill_gaps.h - springls for exposed zero crossings of the signed level set (section 4.4). */

/* Springls for the bare triangles of the zero level: see springls__is_exposed. */
SPRINGLS__FN springls_status springls__fill_from_level_set(springls_context *ctx, float covered, float on_sheets)
{
    springls__job job = springls__no_job();
    int bricks, wanted = 0, room;
    SPRINGLS__TRY(springls__cells_build(ctx));
    bricks = ctx->model.grid.active_count;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)bricks, SPRINGLS__CUBES, NULL));
    SPRINGLS__TRY(springls__scratch(ctx, 2, (size_t)bricks, sizeof(uint32_t), NULL));
    job.f[0] = covered;
    job.f[1] = on_sheets;
    springls__run(ctx, SPRINGLS__KERNEL_exposure, bricks, job);
    SPRINGLS__TRY(springls__scan(ctx, 2, bricks, &wanted));
    room = springls__imin(wanted, springls__imax(ctx->desc.max_springls - ctx->model.set.count, 0));
    ctx->stats.refused += wanted - room;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->model.set.count + room));
    if (room > 0) springls__run(ctx, SPRINGLS__KERNEL_fill, bricks, springls__job_of(room));
    springls__constellation_added(ctx, room);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__add_springls(springls_context *ctx)
{
    const float covered = 0.75f, on_sheets = 1.5f; /* what springls have left bare is filled more sparingly */
    const float d_max = ctx->model.params.d_max;
    const bool springls_first = ctx->model.params.fill_from_springls != 0;
    double started;
    int first, added;
    if (springls_first) SPRINGLS__TRY(springls__fill_from_springls(ctx));
    first = ctx->model.set.count;
    SPRINGLS__TRY(springls_first ? springls__fill_from_level_set(ctx, springls__max(covered, d_max), on_sheets)
                                 : springls__fill_from_level_set(ctx, d_max, d_max));
    added = ctx->model.set.count - first;
    if (added == 0) return SPRINGLS_OK;
    started = springls__stage_begin(ctx, SPRINGLS_STAGE_TRACK);
    springls__run(ctx, SPRINGLS__KERNEL_adopt, added, springls__job_of(first)); /* the cells still hold the known ones only */
    springls__stage_end(ctx, SPRINGLS_STAGE_TRACK, started);
    ctx->stats.added += added;
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_gaps(springls_context *ctx)
{
    int known = ctx->model.set.count;
    springls_status status = springls__add_springls(ctx), follow = springls__attributes_after_fill(ctx, known);
    return status != SPRINGLS_OK ? status : follow;
}

SPRINGLS_API springls_status springls_fill_gaps(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_FILL_GAPS, springls__fill_gaps);
}
