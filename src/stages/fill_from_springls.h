/* fill_from_springls.h - fills holes among springls (params.fill_from_springls). Where a sheet is thin the zero level comes and
   goes with the voxels that happen to lie inside; the springls beside a hole give a better place. */
#ifndef SPRINGLS__STAGES_FILL_FROM_SPRINGLS_H
#define SPRINGLS__STAGES_FILL_FROM_SPRINGLS_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "sleep.h"

/* Finds the springls missing beside others. Ends with a loop. */
SPRINGLS__FN springls_status springls__find_seeds(springls_context *ctx)
{
    int count = ctx->model.set.count;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, seeds, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, seed_action, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, next_seed_action, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, seed_number, count));
    springls__loop(ctx, SPRINGLS__KERNEL_seed, count, NULL);
    return SPRINGLS_OK;
}

/* Returns true when all seeds have been chosen or dropped, after so many rounds. */
SPRINGLS__FN bool springls__seeds_decided(springls_context *ctx, int rounds)
{
    return springls__checks_traded_round(ctx, rounds)
        && springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(seed_action), ctx->model.set.count, SPRINGLS__UNDECIDED) == 0;
}

/* Writes the chosen seeds behind the springls, as many as there is room for (ctx->work.added). Ends with a loop. */
SPRINGLS__FN springls_status springls__insert_seeds(springls_context *ctx)
{
    springls__arguments args;
    int count = ctx->model.set.count, wanted = 0, room;
    springls__run(ctx, SPRINGLS__KERNEL_seed_count, count, NULL);
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(seed_number), count, &wanted));
    room = springls__imin(wanted, springls__imax(ctx->desc.max_springls - count, 0));
    ctx->stats.refused += wanted - room;
    ctx->work.added = room;
    if (room == 0) return SPRINGLS_OK;
    args.insert.count = room;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count + room));
    springls__loop(ctx, SPRINGLS__KERNEL_insert_seeds, count, &args);
    return SPRINGLS_OK;
}

/* Adds the seeds that were written to the springls of the model. */
SPRINGLS__FN void springls__seeds_inserted(springls_context *ctx)
{
    int count = ctx->model.set.count, added = springls__count_stored(ctx);
    if (added == 0) return;
    ctx->stats.added += added;
    springls__stir(ctx, SPRINGLS__STIR_ALL, count, added);
    springls__constellation_changed(ctx);
}

#endif
