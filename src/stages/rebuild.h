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

/* Adds the bricks that the band has reached (band_mask), and drops those that it has left. The cell list lives in bricks. */
SPRINGLS__FN springls_status springls__change_band(springls_context *ctx)
{
    SPRINGLS__TRY(springls__activate_bricks(ctx, SPRINGLS__KERNEL_mark_band, ctx->model.grid.active_count, false));
    if (springls__count_found(ctx, SPRINGLS__COUNT_BRICKS) + springls__count_found(ctx, SPRINGLS__COUNT_BRICKS_ADDED) > 0)
        springls__discard_cell_list(ctx);
    return SPRINGLS_OK;
}

enum { SPRINGLS__BAND_FIND, SPRINGLS__BAND_CHANGE };

/* Moves the band to where phi is small now. */
SPRINGLS__FN springls_status springls__band_follow(springls_context *ctx)
{
    if (ctx->work.phase == SPRINGLS__BAND_CHANGE) return springls__change_band(ctx);
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
