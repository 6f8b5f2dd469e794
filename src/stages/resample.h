/* resample.h - splits springls that have grown too large, at their longest edge (section 4.6, Table 2). */
#ifndef SPRINGLS__STAGES_RESAMPLE_H
#define SPRINGLS__STAGES_RESAMPLE_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../model/cell_list.h"
#include "../model/constellation.h"
#include "inherit.h"
#include "sleep.h"

SPRINGLS__FN springls_status springls__resample(springls_context *ctx)
{
    springls__arguments args;
    int count = ctx->model.set.count, room = springls__imax(ctx->desc.max_springls - count, 0), wanted = 0, splits;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, split_number, count));
    springls__run(ctx, SPRINGLS__KERNEL_overgrown, count, NULL);
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(split_number), count, &wanted));
    splits = springls__imin(wanted, room);
    ctx->stats.refused += wanted - splits;
    if (splits == 0) return SPRINGLS_OK;
    args.insert.count = splits;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, split_halves, 2 * (size_t)splits));
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count + splits));
    SPRINGLS__TRY(springls__attributes_before_split(ctx, splits));
    springls__run(ctx, SPRINGLS__KERNEL_split, count, &args);
    springls__run(ctx, SPRINGLS__KERNEL_split_store, count, &args);
    springls__constellation_added(ctx, splits);
    springls__stir(ctx, SPRINGLS__STIR_ALL, count, splits);
    ctx->stats.split += splits;
    springls__constellation_changed(ctx);
    springls__attributes_after_split(ctx, count);
    return SPRINGLS_OK;
}

#endif
