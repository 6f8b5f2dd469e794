/* track.h - where on the original surface a springl belongs (section 4.7). */

SPRINGLS__FN springls_status springls__track(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_track, ctx->model.set.count, springls__no_job());
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_track(springls_context *ctx)
{
    return springls__run_stage_call(ctx, SPRINGLS_STAGE_TRACK, springls__track);
}
