/* unsigned_to_signed.h - the level set from springls alone (section 4.5): the background grows from the whole border of
   the volume, coarse to fine, and cannot leak through gaps narrower than the blocks it grows by. What it does not reach
   is the object. */

/* Blocks closer than this to a springl stop the background. */
static const float springls__shell = 1.5f;

typedef struct springls__grow_job { springls_context *ctx; int block; uint8_t *grew; } springls__grow_job;

SPRINGLS__FN bool springls__background_at(const springls__grid *g, int x, int y, int z)
{
    return !springls__grid_contains(g, x, y, z) || springls__grid_voxel(g, g->phi, x, y, z) > 0.0f;
}

/* One growth of the background by a block of 4, 2 or 1 voxels, inside active bricks: phi (+1 background, -1 not yet) to
   phi_next. All voxels of a block are alike, so one voxel of a neighbour block speaks for it. */
SPRINGLS__FN void springls__grow_task(void *arg, int begin, int end)
{
    const springls__grow_job *job = (const springls__grow_job *)arg;
    const springls__grid *g = &job->ctx->grid;
    const int b = job->block;
    int x, y, z, i, j, k;
    for (; begin < end; begin++) {
        int slot = g->active[begin], o[3];
        const float *omega = g->omega + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        float *next = g->phi_next + (size_t)slot * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(g, slot, o);
        job->grew[begin] = 0;
        memcpy(next, phi, SPRINGLS__BRICK_VOXELS * sizeof *next);
        for (z = 0; z < 8; z += b)
            for (y = 0; y < 8; y += b)
                for (x = 0; x < 8; x += b) {
                    float nearest = FLT_MAX;
                    if (phi[x + 8 * y + 64 * z] > 0.0f) continue;
                    if (!springls__background_at(g, o[0] + x - 1, o[1] + y, o[2] + z) && !springls__background_at(g, o[0] + x + b, o[1] + y, o[2] + z)
                        && !springls__background_at(g, o[0] + x, o[1] + y - 1, o[2] + z) && !springls__background_at(g, o[0] + x, o[1] + y + b, o[2] + z)
                        && !springls__background_at(g, o[0] + x, o[1] + y, o[2] + z - 1) && !springls__background_at(g, o[0] + x, o[1] + y, o[2] + z + b))
                        continue;
                    for (k = z; k < z + b; k++)
                        for (j = y; j < y + b; j++)
                            for (i = x; i < x + b; i++) nearest = springls__min(nearest, omega[i + 8 * j + 64 * k]);
                    if (nearest <= springls__shell) continue;
                    job->grew[begin] = 1;
                    for (k = z; k < z + b; k++)
                        for (j = y; j < y + b; j++)
                            for (i = x; i < x + b; i++) next[i + 8 * j + 64 * k] = 1.0f;
                }
    }
}

SPRINGLS__FN springls_status springls__grow_voxels(springls_context *ctx, int block, int iterations)
{
    springls__grow_job job;
    int i;
    bool grew = true;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)ctx->grid.active_count, 1, (void **)&job.grew));
    job.ctx = ctx;
    job.block = block;
    for (; grew && iterations > 0; iterations--) {
        springls__parallel(ctx, ctx->grid.active_count, 8, springls__grow_task, &job);
        springls__swap_phi(&ctx->grid);
        for (grew = false, i = 0; i < ctx->grid.active_count; i++) grew = grew || job.grew[i];
    }
    return SPRINGLS_OK;
}

enum { SPRINGLS__OPEN = 0, SPRINGLS__BLOCKED = 1, SPRINGLS__BACKGROUND = 2 };

/* One sweep of the background by blocks of `step` bricks; a block with a blocked brick stays. Returns whether it grew. */
SPRINGLS__FN bool springls__grow_bricks(const springls__grid *g, uint8_t *state, int step)
{
    const int *n = g->bricks;
    int x, y, z, i, j, k, d;
    bool grew = false;
    for (z = 0; z < n[2]; z += step)
        for (y = 0; y < n[1]; y += step)
            for (x = 0; x < n[0]; x += step) {
                int hi[3];
                bool open = true, touches = x == 0 || y == 0 || z == 0 || x + step >= n[0] || y + step >= n[1] || z + step >= n[2];
                hi[0] = springls__imin(x + step, n[0]);
                hi[1] = springls__imin(y + step, n[1]);
                hi[2] = springls__imin(z + step, n[2]);
                if (state[x + n[0] * (y + n[1] * z)] == SPRINGLS__BACKGROUND) continue;
                for (d = 0; d < 6 && !touches; d++) { /* blocks are uniform: one brick of the neighbour block speaks */
                    int nx = x + (d == 0 ? -1 : d == 1 ? step : 0), ny = y + (d == 2 ? -1 : d == 3 ? step : 0), nz = z + (d == 4 ? -1 : d == 5 ? step : 0);
                    touches = state[nx + n[0] * (ny + n[1] * nz)] == SPRINGLS__BACKGROUND;
                }
                for (k = z; k < hi[2] && open && touches; k++)
                    for (j = y; j < hi[1] && open; j++)
                        for (i = x; i < hi[0] && open; i++) open = state[i + n[0] * (j + n[1] * k)] != SPRINGLS__BLOCKED;
                if (!open || !touches) continue;
                grew = true;
                for (k = z; k < hi[2]; k++)
                    for (j = y; j < hi[1]; j++)
                        for (i = x; i < hi[0]; i++) state[i + n[0] * (j + n[1] * k)] = SPRINGLS__BACKGROUND;
            }
    return grew;
}

/* Bricks within the band of any springl; everything else is dropped first. */
SPRINGLS__FN springls_status springls__bricks_around_springls(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    int i, x, y, z, lo[3], hi[3], pass, *list = NULL;
    size_t total = 0;
    springls__grid_clear(ctx, g, false);
    springls__constellation_changed(ctx);
    for (pass = 0; pass < 2; pass++) {
        if (pass) SPRINGLS__TRY(springls__scratch(ctx, 1, total, sizeof(int), (void **)&list));
        for (total = 0, i = 0; i < ctx->set.count; i++) {
            springls__springl_bricks(g, &ctx->set.s[i], ctx->params.band_half_width + 1.0f, lo, hi);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++, total++)
                        if (pass) list[total] = x + g->bricks[0] * (y + g->bricks[1] * z);
        }
        if (total > (size_t)INT32_MAX) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "the springls are too large for the grid");
    }
    return springls__grid_add_bricks(ctx, g, list, (int)total);
}

SPRINGLS__FN springls_status springls__unsigned_to_signed(springls_context *ctx)
{
    springls__grid *g = &ctx->grid;
    size_t bricks = (size_t)g->bricks[0] * (size_t)g->bricks[1] * (size_t)g->bricks[2], b;
    uint8_t *state;
    int i, v, step = 1;
    if (ctx->set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "unsigned_to_signed: there are no springls");
    SPRINGLS__TRY(springls__bricks_around_springls(ctx));
    SPRINGLS__TRY(springls__omega_build(ctx));
    SPRINGLS__TRY(springls__scratch(ctx, 2, bricks, 1, (void **)&state));
    memset(state, SPRINGLS__OPEN, bricks);
    for (i = 0; i < g->active_count; i++) {
        const float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        float nearest = FLT_MAX;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) nearest = springls__min(nearest, omega[v]);
        if (nearest <= springls__shell) state[g->slot_brick[g->active[i]]] = SPRINGLS__BLOCKED;
    }
    while (16 * 8 * step * 2 <= springls__imax(g->size[0], springls__imax(g->size[1], g->size[2]))) step *= 2;
    for (; step >= 1; step /= 2) /* the paper's coarse levels, each to its end */
        while (springls__grow_bricks(g, state, step)) continue;
    for (b = 0; b < bricks; b++)
        if (g->top[b] < SPRINGLS__FIRST_SLOT) g->top[b] = state[b] == SPRINGLS__BACKGROUND ? SPRINGLS__OUTSIDE : SPRINGLS__INSIDE;
    for (i = 0; i < g->active_count; i++)
        springls__fill(g->phi, g->active[i], state[g->slot_brick[g->active[i]]] == SPRINGLS__BACKGROUND ? 1.0f : -1.0f);
    SPRINGLS__TRY(springls__grow_voxels(ctx, 4, INT32_MAX));
    SPRINGLS__TRY(springls__grow_voxels(ctx, 2, 2));
    SPRINGLS__TRY(springls__grow_voxels(ctx, 1, 2));
    for (i = 0; i < g->active_count; i++) {
        float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        const float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) phi[v] *= omega[v]; /* phi = -omega in the foreground */
    }
    return springls__rebuild(ctx);
}

SPRINGLS_API springls_status springls_unsigned_to_signed(springls_context *ctx)
{
    return springls__staged(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED, springls__unsigned_to_signed);
}
