/* evolve.h - the signed level set follows the springls (section 4.5, eq. 23). */

/* phi_next from phi and omega. */
SPRINGLS__FN void springls__evolve_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const springls__grid *g = &ctx->grid;
    const float width = ctx->params.evolve_width, step = ctx->params.evolve_step, lambda = ctx->params.curvature;
    float phi[SPRINGLS__TILE_VOXELS], omega[SPRINGLS__TILE_VOXELS], block[27];
    int x, y, z, d;
    for (; begin < end; begin++) {
        int slot = g->active[begin];
        float *out = g->phi_next + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        springls__load_tile(g, g->phi, slot, phi);
        springls__load_tile(g, g->omega, slot, omega);
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++) {
                int at = springls__tile_index(0, y, z);
                springls__evolve_row(phi + at, omega + at, width, step, out + 8 * y + 64 * z);
            }
        if (lambda == 0.0f) continue;
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++)
                for (x = 0; x < 8; x++) {
                    if (springls__fabs(phi[springls__tile_index(x, y, z)]) > width) continue;
                    for (d = 0; d < 27; d++) block[d] = phi[springls__tile_index(x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1)];
                    out[x + 8 * y + 64 * z] += step * lambda * springls__curvature_motion(block);
                }
    }
}

/* phi_next becomes phi; where topology is preserved, only as far as it may, a voxel a pass. */
SPRINGLS__FN void springls__commit_phi(springls_context *ctx, int passes)
{
    if (ctx->params.topology == SPRINGLS_TOPOLOGY_PRESERVED) springls__preserve_topology(ctx, passes);
    springls__swap_phi(&ctx->grid);
}

SPRINGLS__FN springls_status springls__evolve(springls_context *ctx)
{
    SPRINGLS__TRY(springls__omega_build(ctx));
    springls__parallel(ctx, ctx->grid.active_count, 4, springls__evolve_task, ctx);
    springls__commit_phi(ctx, 1);
    springls__phi_in_step(ctx);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_evolve(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_EVOLVE, springls__evolve);
}
