/* sleep.h - finds which bricks are awake: stages leave the others, and the springls in them, as they are.

   Why: a stroke of a brush moves some hundred springls of a model, and should cost as much as those. Rest is a matter of bricks,
   since each stage works by brick and looks one brick far: what sleeps has no neighbour that moves, so leaving it changes nothing
   that a stage would have seen. A brick has to be calm for resample_period + 1 steps, so that a resampling, too, has found nothing
   to do in it. From then on it is the same to the bit, however long the rest moves. */
#ifndef SPRINGLS__STAGES_SLEEP_H
#define SPRINGLS__STAGES_SLEEP_H

#include "../../kernels_embed/stages/sleep.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/grid.h"

/* Returns true when bricks may sleep: phi moves by the springls alone. */
SPRINGLS__FN bool springls__may_sleep(const springls_context *ctx)
{
    const springls_params *params = &ctx->model.params;
    return params->carry_level_set && params->evolve_iterations == 0 && !params->volume_lock;
}

/* Ends the calm of the bricks of springls `first`, ..., first + count - 1 that stir. */
SPRINGLS__FN void springls__stir(springls_context *ctx, int which, int first, int count)
{
    springls__arguments args;
    args.stir.first = first;
    args.stir.which = which;
    if (springls__may_sleep(ctx)) springls__run(ctx, SPRINGLS__KERNEL_stir, count, &args);
}

/* Lets all bricks fall asleep until a springl moves: the level set is as exact as the input. */
SPRINGLS__FN void springls__rest_all(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i;
    for (i = 0; i < g->active_count; i++)
        memset(g->calm + g->active[i] * SPRINGLS__OCTANTS, springls__calm_limit(&ctx->model), SPRINGLS__OCTANTS);
}

/* Finds the bricks that are awake, by how long they have been calm. Wakes all where nothing may sleep. */
SPRINGLS__FN springls_status springls__find_awake(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int awake;
    if (!springls__may_sleep(ctx)) {
        springls__wake_all(ctx);
        return SPRINGLS_OK;
    }
    springls__run(ctx, SPRINGLS__KERNEL_lull, g->active_count, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_awake, g->active_count, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_near_awake, g->active_count, NULL);
    springls__find_sleepers(ctx);
    g->some_asleep = 1;
    ctx->at_rest = false;
    if (ctx->on_device && ctx->motion.moved > SPRINGLS__REST) return SPRINGLS_OK; /* saves a blocking read */
    awake = springls__count_of(ctx, SPRINGLS__ARRAY_AWAKE, g->slot_count, 1) - SPRINGLS__FIRST_SLOT;
    g->some_asleep = awake < g->active_count;
    ctx->at_rest = awake == 0 && !springls__has_lost_level_set(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__stir_moved(springls_context *ctx)
{
    springls__stir(ctx, SPRINGLS__STIR_AWAY, 0, ctx->model.set.count);
    return SPRINGLS_OK;
}

/* Ends the calm of what has just moved or, where nothing has, of what had moved before. */
SPRINGLS__FN springls_status springls__stir_moving(springls_context *ctx)
{
    springls__stir(ctx, ctx->motion.none ? SPRINGLS__STIR_AWAY : SPRINGLS__STIR_MOVING, 0, ctx->model.set.count);
    return SPRINGLS_OK;
}

/* Returns true if the bricks that are awake may have become others by the last motion. */
SPRINGLS__FN bool springls__may_wake(const springls_context *ctx) { return !(ctx->motion.none && ctx->at_rest); }

static const springls__entry springls__count_calm[] = {
    SPRINGLS__ROOM(synced_distance2, SPRINGLS)
    SPRINGLS__KERNEL(displacement, SPRINGLS)
    SPRINGLS__KERNEL(calm, BRICKS)
SPRINGLS__END };

/* Finds the bricks that are awake, after the springls have moved. */
static const springls__entry springls__wake_moving[] = {
    SPRINGLS__IF(springls__may_wake)
        SPRINGLS__IF(springls__may_sleep)
            SPRINGLS__CALL(springls__count_calm)
            SPRINGLS__DO(springls__stir_moving)
        SPRINGLS__END
        SPRINGLS__DO(springls__find_awake)
    SPRINGLS__END
SPRINGLS__END };

/* Finds the bricks that have to follow springls which have moved before. */
static const springls__entry springls__wake_moved[] = {
    SPRINGLS__IF(springls__may_sleep)
        SPRINGLS__CALL(springls__count_calm)
        SPRINGLS__DO(springls__stir_moved)
    SPRINGLS__END
    SPRINGLS__DO(springls__find_awake)
SPRINGLS__END };

#endif
