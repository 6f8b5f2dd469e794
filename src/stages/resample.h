/* resample.h - splits springls that have grown too large, at their longest edge (section 4.6, Table 2). */
#ifndef SPRINGLS__STAGES_RESAMPLE_H
#define SPRINGLS__STAGES_RESAMPLE_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "inherit.h"
#include "sleep.h"

/* Counts the springls that are to be split in ctx->work.added, as many as there is room for. A device builds the cell list, which
   fill_gaps needs next, before the count is read, so that the host waits only once. */
SPRINGLS__FN springls_status springls__count_splits(springls_context *ctx)
{
    int count = ctx->model.set.count, room = springls__imax(ctx->desc.max_springls - count, 0), wanted = 0;
    springls__scan_later(ctx, SPRINGLS__COUNT_SPLITS, SPRINGLS__ROLE_ARRAY(split_number), count);
    if (ctx->on_device) SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(springls__scan_found(ctx, SPRINGLS__COUNT_SPLITS, &wanted));
    ctx->work.added = springls__imin(wanted, room);
    ctx->stats.refused += wanted - ctx->work.added;
    return SPRINGLS_OK;
}

enum { SPRINGLS__RESAMPLE_FIND, SPRINGLS__RESAMPLE_SPLIT, SPRINGLS__RESAMPLE_STORE, SPRINGLS__RESAMPLE_STORED };

SPRINGLS__FN springls_status springls__resample(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    springls__arguments args;
    int added;
    switch (ctx->work.phase) {
    case SPRINGLS__RESAMPLE_FIND:
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, split_number, count));
        springls__loop(ctx, SPRINGLS__KERNEL_overgrown, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__RESAMPLE_SPLIT);
    case SPRINGLS__RESAMPLE_SPLIT:
        SPRINGLS__TRY(springls__count_splits(ctx));
        if (ctx->work.added == 0) return SPRINGLS_OK;
        args.insert.count = ctx->work.added;
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, split_halves, 2 * (size_t)ctx->work.added));
        SPRINGLS__TRY(springls__cell_list_cover(ctx));
        SPRINGLS__TRY(springls__constellation_reserve(ctx, count + ctx->work.added));
        SPRINGLS__TRY(springls__attributes_before_split(ctx, ctx->work.added));
        springls__loop(ctx, SPRINGLS__KERNEL_split, count, &args);
        return springls__next_phase(ctx, SPRINGLS__RESAMPLE_STORE);
    case SPRINGLS__RESAMPLE_STORE:
        args.insert.count = ctx->work.added;
        springls__loop(ctx, SPRINGLS__KERNEL_split_store, count, &args);
        return springls__next_phase(ctx, SPRINGLS__RESAMPLE_STORED);
    case SPRINGLS__RESAMPLE_STORED:
    default:
        added = springls__count_stored(ctx);
        springls__stir(ctx, SPRINGLS__STIR_ALL, count, added);
        ctx->stats.split += added;
        springls__constellation_changed(ctx);
        springls__attributes_after_split(ctx, count);
        return SPRINGLS_OK;
    }
}

#endif
