/* project.h - phi near the springls becomes their oriented distance, which takes the chord error of flat triangles and the lag
   of the moving front out of the level set. With params.predict phi is first carried along: the value at a voxel is that
   of the place it has come from, by the way of the springls around. Else eq. 23 has decided the side before. */

/* Doubtful voxels of phi_next ask their neighbours. The flood needs a third field: omega lends its memory, which is taken afresh
   when it is next asked for. */
SPRINGLS__FN void springls__settle(springls_context *ctx)
{
    const int voxels = 3; /* from what a springl reaches to what it may have passed; it goes no further than far_value */
    const float sure = 0.5f; /* first those speak that are not next to the surface themselves */
    const springls__grid *g = &ctx->model.grid;
    int i;
    if (springls__count_of(ctx, SPRINGLS__ARRAY_SCRATCH1, g->active_count, 1) == 0) return;
    springls__omega_constant(ctx, g->far_value, -g->far_value);
    for (i = 0; i < voxels; i++) {
        springls__job job = springls__job_of(i == voxels - 1);
        job.f[0] = i == voxels - 1 ? 0.0f : sure;
        springls__run(ctx, SPRINGLS__KERNEL_settle, g->active_count, job);
        springls__swap(ctx, SPRINGLS__ARRAY_PHI_NEXT, SPRINGLS__ARRAY_OMEGA);
    }
    springls__omega_constant(ctx, ctx->model.params.capture, ctx->model.params.capture);
    ctx->omega_fresh = false;
}

SPRINGLS__FN springls_status springls__project(springls_context *ctx, bool carry)
{
    springls__job job = springls__job_of(carry);
    int bricks, springls = ctx->model.set.count;
    SPRINGLS__TRY(springls__cells_cover_around(ctx));
    bricks = ctx->model.grid.active_count;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)bricks, 1, NULL));
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)springls, sizeof(springls__oriented), NULL));
    SPRINGLS__TRY(springls__way_since_phi(ctx, &job.f[0]));
    springls__run(ctx, SPRINGLS__KERNEL_oriented, springls, springls__no_job());
    springls__run(ctx, SPRINGLS__KERNEL_project, bricks, job);
    if (carry) {
        springls__settle(ctx);
        springls__phi_in_step(ctx);
    }
    springls__commit_phi(ctx, carry ? 1 + (int)springls__min(job.f[0], ctx->model.grid.far_value) : 1);
    if (carry && ctx->model.params.topology == SPRINGLS_TOPOLOGY_FREE) {
        springls__run(ctx, SPRINGLS__KERNEL_specks, bricks, springls__no_job());
        springls__swap_phi(ctx);
    }
    springls__redistance_sweeps(ctx, 2);
    return carry ? springls__band_move(ctx) : SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__carry_level_set(springls_context *ctx) { return springls__project(ctx, true); }
SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx) { return springls__project(ctx, false); }
