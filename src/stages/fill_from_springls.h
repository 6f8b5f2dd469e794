/* fill_from_springls.h - fills holes among springls (params.fill_from_springls). Where a sheet is thin the zero level comes and
   goes with the voxels that happen to lie inside; the springls beside a hole give a better place. */
#ifndef SPRINGLS__STAGES_FILL_FROM_SPRINGLS_H
#define SPRINGLS__STAGES_FILL_FROM_SPRINGLS_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "inherit.h"
#include "sleep.h"

/* Counts the seeds that have neither been chosen nor dropped. */
SPRINGLS__FN springls_status springls__count_undecided_seeds(springls_context *ctx)
{
    const springls__array actions = SPRINGLS__ROLE_ARRAY(seed_action);
    ctx->work.found = springls__count_of(ctx, actions, ctx->model.set.count, SPRINGLS__UNDECIDED);
    return SPRINGLS_OK;
}

/* The same at the end of a round, when rounds are to be checked. */
SPRINGLS__FN springls_status springls__end_seed_round(springls_context *ctx)
{
    return springls__checks_traded_round(ctx, springls__round(ctx) + 1) ? springls__count_undecided_seeds(ctx) : SPRINGLS_OK;
}

/* Counts the chosen seeds in ctx->work.added, as many as there is room for, and makes that room. */
SPRINGLS__FN springls_status springls__count_seeds(springls_context *ctx)
{
    int count = ctx->model.set.count, wanted = 0, room;
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(seed_number), count, &wanted));
    room = springls__imin(wanted, springls__imax(ctx->desc.max_springls - count, 0));
    ctx->stats.refused += wanted - room;
    ctx->work.added = room;
    return room > 0 ? springls__constellation_reserve(ctx, count + room) : SPRINGLS_OK;
}

/* Adds the seeds that were written to the springls of the model. */
SPRINGLS__FN springls_status springls__seeds_inserted(springls_context *ctx)
{
    int count = ctx->model.set.count, added = springls__count_stored(ctx);
    ctx->stats.added += added;
    springls__stir(ctx, SPRINGLS__STIR_ALL, count, added);
    springls__constellation_changed_behind(ctx, springls__imin(ctx->keyed, count));
    return springls__attributes_after_fill(ctx, count);
}

/* Finds seeds, places beside springls where a springl is missing; chooses seeds that are far enough apart; adds springls there. */
static const springls__entry springls__fill_holes[] = {
    SPRINGLS__DO(springls__cell_list_cover)
    SPRINGLS__ROOM(seeds, SPRINGLS)
    SPRINGLS__ROOM(seed_action, SPRINGLS)
    SPRINGLS__ROOM(next_seed_action, SPRINGLS)
    SPRINGLS__ROOM(seed_number, SPRINGLS)
    SPRINGLS__KERNEL(seed, SPRINGLS)
    SPRINGLS__DO(springls__count_undecided_seeds)
    SPRINGLS__REPEAT_WHILE(springls__found_some)
        SPRINGLS__KERNEL(seed_choose, SPRINGLS)
        SPRINGLS__SWAP(ROLE_seed_action, ROLE_next_seed_action)
        SPRINGLS__DO(springls__end_seed_round)
    SPRINGLS__END
    SPRINGLS__KERNEL(seed_count, SPRINGLS)
    SPRINGLS__DO(springls__count_seeds)
    SPRINGLS__IF(springls__adds_springls)
        SPRINGLS__KERNEL_WITH(insert_seeds, SPRINGLS, springls__insert_args)
        SPRINGLS__DO(springls__seeds_inserted)
    SPRINGLS__END
SPRINGLS__END };

#endif
