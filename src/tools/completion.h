/* completion.h - completes a model whose springls and phi a tool has changed, where it is awake: turns phi into a distance, finds edges,
   fills gaps and projects phi onto the springls. */
#ifndef SPRINGLS__TOOLS_COMPLETION_H
#define SPRINGLS__TOOLS_COMPLETION_H

#include "../runtime/arrays.h"
#include "../runtime/memory.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../stages/components.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/sleep.h"

/* ---- what is awake already ---- */

/* An edit completes the bricks that it has changed, and leaves bricks that earlier edits have woken to the next step. So an edit costs
   what it cuts, however many edits came before it without a step between. */

/* Keeps the counts of calm steps of all slots, and the bricks of the slots, while a combination or a pass over its gaps counts anew. */
typedef struct springls__calm_aside { springls__buffer calm, bricks; int slot_count; } springls__calm_aside;

/* Puts the counts of calm steps aside, so that the whole model is asleep: what is done next wakes only what it changes. Does nothing if
   bricks may not sleep. */
SPRINGLS__FN springls_status springls__put_calm_aside(springls_context *ctx, springls__calm_aside *aside)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t slot_count = (size_t)g->slot_count;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->calm, slot_count * SPRINGLS__OCTANTS, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->bricks, slot_count, sizeof(int), 0));
    memcpy(aside->calm.data, g->calm, slot_count * SPRINGLS__OCTANTS);
    memcpy(aside->bricks.data, g->slot_brick, slot_count * sizeof(int));
    aside->slot_count = g->slot_count;
    springls__rest_all(ctx);
    return SPRINGLS_OK;
}

/* Goes back to the calm that was put aside, where it has not been ended since. */
SPRINGLS__FN void springls__put_calm_back(springls_context *ctx, const springls__calm_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *before = (const uint8_t *)aside->calm.data;
    const int *brick = (const int *)aside->bricks.data;
    int i, o;
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++)
        for (o = SPRINGLS__OCTANTS * i; g->slot_brick[i] == brick[i] && o < SPRINGLS__OCTANTS * (i + 1); o++)
            if (before[o] < g->calm[o]) g->calm[o] = before[o];
}

SPRINGLS__FN void springls__calm_aside_free(springls_context *ctx, springls__calm_aside *aside)
{
    springls__buffer_free(ctx, &aside->calm);
    springls__buffer_free(ctx, &aside->bricks);
}

/* ---- gaps ---- */

/* Which bricks are awake, put aside while fewer of them are to be. */
typedef struct springls__awake_aside {
    springls__calm_aside calm;
    springls__buffer awake, bricks; /* awake and near_awake of each slot; the bricks that they had */
    springls__buffer asleep;        /* of each springl                                             */
    int slot_count, count, asleep_count, some_asleep;
    bool at_rest;
} springls__awake_aside;

SPRINGLS__FN springls_status springls__put_awake_aside(springls_context *ctx, springls__awake_aside *aside)
{
    const springls__grid *g = &ctx->model.grid;
    const size_t slot_count = (size_t)g->slot_count, count = (size_t)ctx->model.set.count;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->awake, 2 * slot_count, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->bricks, slot_count, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->asleep, count, 1, 0));
    aside->asleep_count = ctx->model.cells.asleep_count;
    springls__find_sleepers(ctx);
    memcpy(aside->awake.data, g->awake, slot_count);
    memcpy((uint8_t *)aside->awake.data + slot_count, g->near_awake, slot_count);
    memcpy(aside->bricks.data, g->slot_brick, slot_count * sizeof(int));
    memcpy(aside->asleep.data, ctx->model.cells.asleep, count);
    aside->slot_count = g->slot_count;
    aside->count = ctx->model.set.count;
    aside->some_asleep = g->some_asleep;
    aside->at_rest = ctx->at_rest;
    return SPRINGLS_OK;
}

/* Wakes what was awake; bricks that have come since are new, and so awake. */
SPRINGLS__FN void springls__put_awake_back(springls_context *ctx, const springls__awake_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *awake = (const uint8_t *)aside->awake.data;
    const int *brick = (const int *)aside->bricks.data;
    int i;
    for (i = SPRINGLS__FIRST_SLOT; i < g->slot_count; i++) {
        const bool was_there = i < aside->slot_count && g->slot_brick[i] == brick[i];
        if (g->slot_brick[i] < 0) continue;
        g->awake[i] = was_there ? awake[i] : 1;
        g->near_awake[i] = was_there ? awake[aside->slot_count + i] : 1;
    }
    memcpy(ctx->model.cells.asleep, aside->asleep.data, (size_t)aside->count);
    ctx->model.cells.asleep_count = aside->asleep_count;
    g->some_asleep = aside->some_asleep;
    ctx->at_rest = aside->at_rest;
}

/* Finds which springls are asleep where fewer bricks are awake than before: those that were. */
SPRINGLS__FN void springls__find_more_sleepers(springls_context *ctx, const springls__awake_aside *aside)
{
    const uint8_t *before = (const uint8_t *)aside->asleep.data;
    springls__model *model = &ctx->model;
    int i;
    for (i = 0; i < model->set.count; i++)
        model->cells.asleep[i] = (i < aside->count && before[i])
                              || !model->grid.awake[springls__slot_of_place(&model->grid, model->set.s[i].p)];
    model->cells.asleep_count = model->set.count;
}

/* Wakes the bricks beside the springls from number `first` on, of those that were awake, and lets the others sleep. */
SPRINGLS__FN springls_status springls__wake_beside(springls_context *ctx, int first, springls__awake_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    const uint8_t *awake = (const uint8_t *)aside->awake.data;
    const int *brick = (const int *)aside->bricks.data;
    int i;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    springls__put_calm_back(ctx, &aside->calm);
    SPRINGLS__TRY(springls__put_calm_aside(ctx, &aside->calm));
    springls__stir(ctx, SPRINGLS__STIR_ALL, first, ctx->model.set.count - first);
    springls__find_awake_bricks(ctx);
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++)
        if (g->slot_brick[i] == brick[i]) g->awake[i] &= awake[i];
    springls__find_more_sleepers(ctx, aside);
    g->some_asleep = 1;
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__awake_aside_free(springls_context *ctx, springls__awake_aside *aside)
{
    springls__calm_aside_free(ctx, &aside->calm);
    springls__buffer_free(ctx, &aside->awake);
    springls__buffer_free(ctx, &aside->asleep);
    springls__buffer_free(ctx, &aside->bricks);
}

/* A model that is being completed: ctx->completion. */
typedef struct springls__completion {
    bool project;                  /* projects phi onto the springls too, if params.project_level_set is set */
    int first;                     /* fill_gaps has added the springls from this number on                   */
    springls__awake_aside aside;
} springls__completion;

SPRINGLS__FN springls_status springls__gaps_begin(springls_context *ctx)
{
    ctx->completion->first = ctx->model.set.count;
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__has_filled(const springls_context *ctx) { return ctx->completion->first != ctx->model.set.count; }

SPRINGLS__FN springls_status springls__fill_again_begin(springls_context *ctx)
{
    return springls__put_awake_aside(ctx, &ctx->completion->aside);
}

/* A wide gap takes more than one pass: six with the first. */
SPRINGLS__FN bool springls__fills_again(const springls_context *ctx)
{
    const int max_passes = 5;
    return springls__round(ctx) < max_passes && springls__has_filled(ctx);
}

/* Lets all sleep but the bricks beside the springls that the last pass has added: elsewhere the next would find what it has found. */
SPRINGLS__FN springls_status springls__wake_filled(springls_context *ctx)
{
    SPRINGLS__TRY(springls__wake_beside(ctx, ctx->completion->first, &ctx->completion->aside));
    return springls__gaps_begin(ctx);
}

SPRINGLS__FN springls_status springls__fill_again_end(springls_context *ctx)
{
    springls__put_calm_back(ctx, &ctx->completion->aside.calm);
    if (springls__may_sleep(ctx)) springls__put_awake_back(ctx, &ctx->completion->aside);
    return SPRINGLS_OK;
}

/* Runs fill_gaps until it adds no springl, at most six times. */
static const springls__entry springls__fill_every_gap[] = {
    SPRINGLS__DO(springls__gaps_begin)
    SPRINGLS__CALL(springls__fill_gaps)
    SPRINGLS__IF(springls__has_filled)
        SPRINGLS__DO(springls__fill_again_begin)
        SPRINGLS__REPEAT_WHILE(springls__fills_again)
            SPRINGLS__DO(springls__wake_filled)
            SPRINGLS__CALL(springls__fill_gaps)
        SPRINGLS__END
        SPRINGLS__DO(springls__fill_again_end)
    SPRINGLS__END
SPRINGLS__END };

SPRINGLS__FN springls_status springls__completion_begin(springls_context *ctx)
{
    springls__constellation_changed(ctx);
    springls__clear_target_volumes(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__finds_edges(const springls_context *ctx) { return ctx->model.params.keep_edges != 0; }

SPRINGLS__FN bool springls__projects_completed(const springls_context *ctx)
{
    return ctx->completion->project && ctx->model.params.project_level_set;
}

static const springls__entry springls__complete[] = {
    SPRINGLS__DO(springls__completion_begin)
    SPRINGLS__REPEAT_WHILE(springls__sweeps_band)
        SPRINGLS__KERNEL(redistance, BRICKS)
        SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__END
    SPRINGLS__CALL(springls__band_follow)
    SPRINGLS__IF(springls__finds_edges) SPRINGLS__CALL(springls__find_edges) SPRINGLS__END
    SPRINGLS__CALL(springls__fill_every_gap)
    SPRINGLS__IF(springls__finds_edges) SPRINGLS__CALL(springls__find_edges) SPRINGLS__END
    SPRINGLS__IF(springls__projects_completed) SPRINGLS__CALL(springls__project_level_set) SPRINGLS__END
    SPRINGLS__DO(springls__mark_phi_synced)
SPRINGLS__END };

/* Runs one of these tables to its end. */
SPRINGLS__FN springls_status springls__run_completion(springls_context *ctx, const springls__entry *table)
{
    springls__completion completion;
    springls_status status;
    memset(&completion, 0, sizeof completion);
    ctx->completion = &completion;
    status = springls__run_table(ctx, table);
    ctx->completion = NULL;
    springls__awake_aside_free(ctx, &completion.aside);
    return status;
}

#endif
