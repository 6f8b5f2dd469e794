/* resample.h - splits springls that have grown too large, at their longest edge (section 4.6, Table 2).

   Why: a surface that a flow stretches needs more springls, or its triangles become too large for the detail of a voxel. Both halves are
   new places on the surface, whose correspondences nobody has carried: each is fitted to the springls around (fit.h), and its error is
   estimated. Halves are written to working memory first, and stored where a scan says, so that their order is that of their parents. */
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

/* Makes room for the springls that come of splits, and for what they inherit. */
SPRINGLS__FN springls_status springls__split_begin(springls_context *ctx)
{
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, split_halves, 2 * (size_t)ctx->work.added));
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->model.set.count + ctx->work.added));
    return springls__attributes_before_split(ctx, ctx->work.added);
}

/* Adds the springls that were written to those of the model. */
SPRINGLS__FN springls_status springls__splits_stored(springls_context *ctx)
{
    const int count = ctx->model.set.count, added = springls__count_stored(ctx);
    springls__stir(ctx, SPRINGLS__STIR_ALL, count, added);
    ctx->stats.split += added;
    springls__constellation_changed(ctx);
    springls__attributes_after_split(ctx, count);
    return SPRINGLS_OK;
}

static const springls__entry springls__resample[] = {
    SPRINGLS__ROOM(split_number, SPRINGLS)
    SPRINGLS__KERNEL(overgrown, SPRINGLS)
    SPRINGLS__DO(springls__count_splits)
    SPRINGLS__IF(springls__adds_springls)
        SPRINGLS__DO(springls__split_begin)
        SPRINGLS__KERNEL_WITH(split, SPRINGLS, springls__insert_args)
        SPRINGLS__KERNEL_WITH(split_store, SPRINGLS, springls__insert_args)
        SPRINGLS__DO(springls__splits_stored)
    SPRINGLS__END
SPRINGLS__END };

#endif
