/* rebuild.h - phi becomes a distance again, and the narrow band moves with the surface. */

/* Sub-voxel distances at the interface; the rest keeps its value as a first guess. */
SPRINGLS__FN void springls__interface_task(void *arg, int begin, int end)
{
    const springls__grid *g = &((const springls_context *)arg)->grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int y, z;
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++)
                springls__interface_row(tile + springls__tile_index(0, y, z), g->far_value, out + 8 * y + 64 * z);
    }
}

/* One Jacobi sweep of |grad phi| = 1; voxels at the interface keep their distance. */
SPRINGLS__FN void springls__redistance_task(void *arg, int begin, int end)
{
    const springls__grid *g = &((const springls_context *)arg)->grid;
    float tile[SPRINGLS__TILE_VOXELS];
    int y, z;
    for (; begin < end; begin++) {
        float *out = g->phi_next + (size_t)g->active[begin] * SPRINGLS__BRICK_VOXELS;
        springls__load_tile(g, g->phi, g->active[begin], tile);
        for (z = 0; z < 8; z++)
            for (y = 0; y < 8; y++)
                springls__redistance_row(tile + springls__tile_index(0, y, z), g->far_value, out + 8 * y + 64 * z);
    }
}

SPRINGLS__FN void springls__redistance_sweeps(springls_context *ctx, int sweeps)
{
    for (; sweeps > 0; sweeps--) {
        springls__parallel(ctx, ctx->grid.active_count, 8, springls__redistance_task, ctx);
        springls__swap_phi(&ctx->grid);
    }
}

/* Which of the 27 bricks around (and including) a brick the band reaches. */
SPRINGLS__FN uint32_t springls__band_reach(const float *phi, float half_width)
{
    uint32_t reach = 0;
    int x, y, z;
    for (z = 0; z < 8; z++)
        for (y = 0; y < 8; y++) {
            uint32_t row = 0;
            for (x = 0; x < 8; x++) row |= (uint32_t)(springls__fabs(phi[x + 8 * y + 64 * z]) < half_width) << x;
            if (row) reach |= springls__reach_of_row((row & 1u) != 0, row >> 7 != 0, y == 0, y == 7, z == 0, z == 7);
        }
    return reach;
}

SPRINGLS__FN void springls__band_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    uint32_t *reach = (uint32_t *)ctx->scratch[0].data;
    for (; begin < end; begin++)
        reach[begin] = springls__band_reach(ctx->grid.phi + (size_t)ctx->grid.active[begin] * SPRINGLS__BRICK_VOXELS,
                                            ctx->params.band_half_width);
}

/* Bricks that the band has reached are added, bricks that it has left are dropped. */
SPRINGLS__FN springls_status springls__band_move(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    uint32_t *reach;
    uint8_t *keep;
    int *wanted, *rank, i, d, missing = 0;
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)g->active_count, sizeof(uint32_t), (void **)&reach));
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)g->active_count, sizeof(uint8_t), (void **)&keep));
    SPRINGLS__TRY(springls__scratch(ctx, 2, (size_t)g->active_count * 26, sizeof(int), (void **)&wanted));
    SPRINGLS__TRY(springls__scratch(ctx, 3, (size_t)g->slot_count, sizeof(int), (void **)&rank));
    springls__parallel(ctx, g->active_count, 32, springls__band_task, ctx);
    for (i = 0; i < g->active_count; i++) {
        rank[g->active[i]] = i;
        keep[i] = 0;
    }
    for (i = 0; i < g->active_count; i++) {
        int origin[3];
        springls__slot_origin(g, g->active[i], origin);
        for (d = 0; d < 27; d++) {
            int x = origin[0] + 8 * (d % 3 - 1), y = origin[1] + 8 * (d / 3 % 3 - 1), z = origin[2] + 8 * (d / 9 - 1);
            int brick;
            if (!(reach[i] >> d & 1u) || !springls__grid_contains(g, x, y, z)) continue;
            brick = springls__brick_at(g, x, y, z);
            if (g->top[brick] >= SPRINGLS__FIRST_SLOT) keep[rank[g->top[brick]]] = 1;
            else wanted[missing++] = brick;
        }
    }
    springls__grid_drop_bricks(g, keep);
    ctx->cells_fresh = false; /* they live in the bricks */
    return springls__grid_add_bricks(ctx, g, wanted, missing);
}

SPRINGLS__FN springls_status springls__rebuild(springls_context *ctx)
{
    springls__parallel(ctx, ctx->grid.active_count, 8, springls__interface_task, ctx);
    springls__swap_phi(&ctx->grid);
    springls__redistance_sweeps(ctx, (int)ctx->params.band_half_width); /* one a voxel of the way */
    return springls__band_move(ctx);
}

SPRINGLS_API springls_status springls_rebuild(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_REBUILD, springls__rebuild);
}
