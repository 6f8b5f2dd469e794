/* rebuild.h - makes phi a distance again, and moves the narrow band with the surface. */
#ifndef SPRINGLS__STAGES_REBUILD_H
#define SPRINGLS__STAGES_REBUILD_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/grid.h"

SPRINGLS__FN void springls__redistance_sweeps(springls_context *ctx, int sweeps)
{
    for (; sweeps > 0; sweeps--) {
        springls__run(ctx, SPRINGLS__KERNEL_redistance, ctx->model.grid.active_count, NULL);
        springls__swap_phi(ctx);
    }
}

/* Finds, from band_mask, which active bricks the band reaches (band_keeps), how many they are, and which others it reaches
   (band_bricks). Returns the number of the latter. */
SPRINGLS__FN int springls__find_band_bricks(const springls__model *model, int *kept)
{
    const springls__grid *g = &model->grid;
    const uint32_t *mask = springls__band_mask(model);
    uint8_t *keep = springls__band_keeps(model);
    int *rank = springls__band_rank(model), i, d, missing = 0;
    for (i = 0; i < g->active_count; i++) {
        rank[g->active[i]] = i;
        keep[i] = 0;
    }
    for (i = 0; i < g->active_count; i++) {
        int origin[3], at[3];
        springls__slot_origin(g, g->active[i], origin);
        for (d = 0; d < 27; d++) {
            int slot;
            if (!(mask[i] >> d & 1u) || !springls__brick_around(g, origin, d, at)) continue;
            slot = springls__slot_at(g, at[0], at[1], at[2]);
            if (slot >= SPRINGLS__FIRST_SLOT) keep[rank[slot]] = 1;
            else springls__band_bricks(model)[missing++] = springls__brick_at(g, at[0], at[1], at[2]);
        }
    }
    for (*kept = i = 0; i < g->active_count; i++) *kept += keep[i];
    return missing;
}

/* Adds the bricks that the band has reached (band_mask), and drops those that it has left. */
SPRINGLS__FN springls_status springls__change_bricks(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int missing, kept;
    if (ctx->on_device) {
        springls_status status = (ctx->backend->band_move)(ctx);
        springls__discard_cell_list(ctx); /* it lives in the bricks */
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, band_keeps, g->active_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, band_bricks, (size_t)g->active_count * 26));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, band_rank, g->slot_count));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__ROLE_BIT(band_mask) | SPRINGLS__BIT(PHI),
                                    SPRINGLS__BIT(TOP) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(ACTIVE)
                                        | SPRINGLS__BIT(FREE_SLOTS) | SPRINGLS__ROLE_BIT(band_keeps)
                                        | SPRINGLS__ROLE_BIT(band_bricks) | SPRINGLS__ROLE_BIT(band_rank)));
    missing = springls__find_band_bricks(&ctx->model, &kept);
    if (missing == 0 && kept == g->active_count) return SPRINGLS_OK;
    springls__discard_cell_list(ctx);
    springls__grid_drop_bricks(g, springls__band_keeps(&ctx->model));
    return springls__grid_add_bricks(ctx, springls__band_bricks(&ctx->model), missing);
}

enum { SPRINGLS__BAND_FIND, SPRINGLS__BAND_CHANGE };

/* Moves the band to where phi is small now. */
SPRINGLS__FN springls_status springls__band_follow(springls_context *ctx)
{
    if (ctx->work.phase == SPRINGLS__BAND_CHANGE) return springls__change_bricks(ctx);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, band_mask, ctx->model.grid.active_count));
    springls__loop(ctx, SPRINGLS__KERNEL_band, ctx->model.grid.active_count, NULL);
    return springls__next_phase(ctx, SPRINGLS__BAND_CHANGE);
}

SPRINGLS__FN springls_status springls__band_move(springls_context *ctx)
{
    return springls__run_to_completion(ctx, springls__band_follow);
}

enum { SPRINGLS__REBUILD_INTERFACE, SPRINGLS__REBUILD_SWEEP };

SPRINGLS__FN springls_status springls__rebuild(springls_context *ctx)
{
    const int sweeps = (int)ctx->model.params.band_half_width; /* one a voxel of the band */
    switch (ctx->work.phase) {
    case SPRINGLS__REBUILD_INTERFACE:
        springls__loop(ctx, SPRINGLS__KERNEL_subvoxel, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__REBUILD_SWEEP);
    case SPRINGLS__REBUILD_SWEEP:
    default:
        springls__swap_phi(ctx);
        if (ctx->work.repetition++ == sweeps) return springls__next_stage(ctx, springls__band_follow);
        springls__loop(ctx, SPRINGLS__KERNEL_redistance, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__REBUILD_SWEEP);
    }
}

#endif
