/* evolve.h - the signed level set follows the springls (section 4.5, eq. 23). */

/* phi_next becomes phi; where topology is preserved, only as far as it may, a voxel a pass. */
SPRINGLS__FN void springls__commit_phi(springls_context *ctx, int passes)
{
    if (ctx->model.params.topology == SPRINGLS_TOPOLOGY_PRESERVED) springls__preserve_topology(ctx, passes);
    springls__swap_phi(ctx);
}

SPRINGLS__FN springls_status springls__evolve(springls_context *ctx)
{
    switch (ctx->work.phase) {
    case 0:
        SPRINGLS__TRY(springls__omega_build(ctx));
        return springls__next_phase(ctx, 1);
    case 1:
        springls__loop(ctx, SPRINGLS__KERNEL_evolve, ctx->model.grid.active_count, springls__no_job());
        return springls__next_phase(ctx, 2);
    default:
        springls__commit_phi(ctx, 1);
        springls__mark_phi_synced(ctx);
        return SPRINGLS_OK;
    }
}

SPRINGLS_API springls_status springls_evolve(springls_context *ctx)
{
    return springls__run_stage_call(ctx, SPRINGLS_STAGE_EVOLVE, springls__evolve);
}
