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
#include "cell_marks.h"

/* ---- what is awake already ---- */

/* An edit completes the bricks that it has changed, and leaves bricks that earlier edits have woken to the next step. So an edit costs
   what it cuts, however many edits came before it without a step between. */

/* Keeps the counts of calm steps of all slots, and the bricks of the slots, while a combination counts anew. */
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

/* ---- what a change reaches ---- */

/* Voxels: a springl further from all that come, go or move finds the seed that it found before, and hardly ever another edge. A seed lies
   within SEED_RANGE, and is fitted to springls within FIT_RADIUS or, as a distance, PROJECT_RADIUS of it. Which of those are at an edge may
   have changed by springls still further away: that is passed over. */
#define SPRINGLS__CHANGE_REACH (SPRINGLS__SEED_RANGE + SPRINGLS__FIT_RADIUS + 0.05f)

/* Makes marks, none of them set, for changes in a box. */
SPRINGLS__FN springls_status springls__change_marks_begin(springls_context *ctx, springls__cell_marks *marks, springls__box box)
{
    const float scale = 0.5f, beside = SPRINGLS__CHANGE_REACH + 2.0f; /* cells a voxel; voxels: the border cells are free */
    return springls__cell_marks_begin(ctx, marks,
                                      springls__v3_make(box.lower.x - beside, box.lower.y - beside, box.lower.z - beside),
                                      springls__v3_make(box.upper.x + beside, box.upper.y + beside, box.upper.z + beside), scale);
}

SPRINGLS__FN void springls__mark_change(const springls__cell_marks *marks, springls__v3 p)
{
    springls__mark_cells_around(marks, p, SPRINGLS__CHANGE_REACH);
}

/* Marks what the springls from number `first` on, which are new, reach. */
SPRINGLS__FN springls_status springls__mark_new_springls(springls_context *ctx, springls__cell_marks *marks, int first)
{
    const springls__springl *s = ctx->model.set.s;
    springls__box box = springls__box_empty();
    int i;
    for (i = first; i < ctx->model.set.count; i++) box = springls__box_add(box, s[i].p);
    SPRINGLS__TRY(springls__change_marks_begin(ctx, marks, box));
    for (i = first; i < ctx->model.set.count; i++) springls__mark_change(marks, s[i].p);
    return SPRINGLS_OK;
}

/* Lets the springls sleep that no change reaches. Where no brick sleeps, the array is not read, nor set. */
SPRINGLS__FN void springls__sleep_unmarked(springls_context *ctx, const springls__cell_marks *marks)
{
    const springls__springl *s = ctx->model.set.s;
    uint8_t *asleep = ctx->model.cells.asleep;
    int i;
    for (i = 0; ctx->model.grid.some_asleep && i < ctx->model.cells.asleep_count; i++)
        if (!asleep[i] && !springls__visit_cells(marks, s[i].p, s[i].p, false)) asleep[i] = SPRINGLS__UNREACHED;
}

/* ---- gaps ---- */

/* Who is awake, put aside while fewer are to be. */
typedef struct springls__awake_aside {
    springls__buffer awake;  /* of each slot    */
    springls__buffer asleep; /* of each springl */
    int slot_count, count, asleep_count, some_asleep;
} springls__awake_aside;

SPRINGLS__FN springls_status springls__put_awake_aside(springls_context *ctx, springls__awake_aside *aside)
{
    const springls__model *model = &ctx->model;
    const int slot_count = model->grid.slot_count, count = model->set.count;
    uint8_t *awake, *asleep;
    int i;
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->awake, (size_t)slot_count, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &aside->asleep, (size_t)count, 1, 0));
    awake = (uint8_t *)aside->awake.data;
    asleep = (uint8_t *)aside->asleep.data;
    for (i = 0; i < slot_count; i++) /* of a free slot: as of the brick that may come */
        awake[i] = !model->grid.some_asleep || model->grid.slot_brick[i] < 0 || model->grid.awake[i];
    for (i = 0; i < count; i++) asleep[i] = springls__is_asleep(model, i) ? model->cells.asleep[i] : 0;
    aside->slot_count = slot_count;
    aside->count = count;
    aside->asleep_count = model->cells.asleep_count;
    aside->some_asleep = model->grid.some_asleep;
    return SPRINGLS_OK;
}

/* Wakes what was awake. Bricks and springls that have come since are awake. */
SPRINGLS__FN void springls__put_awake_back(springls_context *ctx, const springls__awake_aside *aside)
{
    springls__grid *g = &ctx->model.grid;
    int i;
    springls__phi_not_kept(ctx);
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++)
        if (g->slot_brick[i] >= 0) g->awake[i] = ((const uint8_t *)aside->awake.data)[i];
    memcpy(ctx->model.cells.asleep, aside->asleep.data, (size_t)aside->count);
    ctx->model.cells.asleep_count = aside->asleep_count;
    g->some_asleep = aside->some_asleep;
}

/* Lets all sleep but what the springls from number `first` on reach, of that which was awake. */
SPRINGLS__FN springls_status springls__wake_beside(springls_context *ctx, int first, const springls__awake_aside *aside,
                                                   springls__cell_marks *marks)
{
    springls__grid *g = &ctx->model.grid;
    int i, o[3];
    if (!springls__may_sleep(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__mark_new_springls(ctx, marks, first));
    springls__put_awake_back(ctx, aside);
    for (i = SPRINGLS__FIRST_SLOT; i < aside->slot_count; i++) {
        if (!g->awake[i] || g->slot_brick[i] < 0) continue;
        springls__slot_origin(g, i, o);
        g->awake[i] = springls__visit_cells(marks, springls__v3_make((float)o[0], (float)o[1], (float)o[2]),
                                            springls__v3_make((float)o[0] + 8.0f, (float)o[1] + 8.0f, (float)o[2] + 8.0f), false);
    }
    g->some_asleep = 1;
    memset(ctx->model.cells.asleep + aside->count, 0, (size_t)(ctx->model.set.count - aside->count));
    ctx->model.cells.asleep_count = ctx->model.set.count;
    springls__sleep_unmarked(ctx, marks);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__awake_aside_free(springls_context *ctx, springls__awake_aside *aside)
{
    springls__buffer_free(ctx, &aside->awake);
    springls__buffer_free(ctx, &aside->asleep);
}

/* A model that is being completed: ctx->completion. */
typedef struct springls__completion {
    bool project;                  /* projects phi onto the springls too, if params.project_level_set is set */
    int first;                     /* fill_gaps has added the springls from this number on                   */
    springls__awake_aside aside;
    springls__cell_marks change;   /* what the change reaches; bits NULL: it is not known                    */
    springls__cell_marks filled;   /* what the springls of the last pass over gaps reach                     */
} springls__completion;

SPRINGLS__FN void springls__completion_free(springls_context *ctx, springls__completion *completion)
{
    springls__awake_aside_free(ctx, &completion->aside);
    springls__buffer_free(ctx, &completion->change.memory);
    springls__buffer_free(ctx, &completion->filled.memory);
}

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

/* Lets all sleep but what the springls that the last pass has added reach: elsewhere the next would find what it has found. */
SPRINGLS__FN springls_status springls__wake_filled(springls_context *ctx)
{
    springls__completion *c = ctx->completion;
    SPRINGLS__TRY(springls__wake_beside(ctx, c->first, &c->aside, &c->filled));
    return springls__gaps_begin(ctx);
}

SPRINGLS__FN springls_status springls__fill_again_end(springls_context *ctx)
{
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
    springls__clear_target_volumes(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__finds_edges(const springls_context *ctx) { return ctx->model.params.keep_edges != 0; }

SPRINGLS__FN bool springls__projects_completed(const springls_context *ctx)
{
    return ctx->completion->project && ctx->model.params.project_level_set;
}

/* Lets the springls sleep that the change does not reach, while edges and gaps are looked for. */
SPRINGLS__FN springls_status springls__sleep_beyond_change(springls_context *ctx)
{
    if (ctx->completion->change.bits && springls__may_sleep(ctx)) springls__sleep_unmarked(ctx, &ctx->completion->change);
    return SPRINGLS_OK;
}

/* Wakes the springls that the change does not reach, in bricks that are awake: phi follows them too. */
SPRINGLS__FN springls_status springls__wake_in_bricks(springls_context *ctx)
{
    uint8_t *asleep = ctx->model.cells.asleep;
    int i;
    for (i = 0; ctx->model.grid.some_asleep && i < ctx->model.cells.asleep_count; i++)
        if (asleep[i] == SPRINGLS__UNREACHED) asleep[i] = 0;
    return SPRINGLS_OK;
}

static const springls__entry springls__complete[] = {
    SPRINGLS__DO(springls__completion_begin)
    SPRINGLS__REPEAT_WHILE(springls__sweeps_band)
        SPRINGLS__KERNEL(redistance, BRICKS)
        SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__END
    SPRINGLS__CALL(springls__band_follow)
    SPRINGLS__DO(springls__sleep_beyond_change)
    SPRINGLS__IF(springls__finds_edges) SPRINGLS__CALL(springls__find_edges) SPRINGLS__END
    SPRINGLS__CALL(springls__fill_every_gap)
    SPRINGLS__IF(springls__finds_edges) SPRINGLS__CALL(springls__find_edges) SPRINGLS__END
    SPRINGLS__DO(springls__wake_in_bricks)
    SPRINGLS__IF(springls__projects_completed) SPRINGLS__CALL(springls__project_level_set) SPRINGLS__END
    SPRINGLS__DO(springls__mark_phi_synced)
SPRINGLS__END };

/* Runs one of these tables to its end, after springls have changed. */
SPRINGLS__FN springls_status springls__run_completion(springls_context *ctx, const springls__entry *table)
{
    springls__completion completion;
    springls_status status;
    memset(&completion, 0, sizeof completion);
    ctx->completion = &completion;
    springls__constellation_changed(ctx);
    status = springls__run_table(ctx, table);
    ctx->completion = NULL;
    springls__completion_free(ctx, &completion);
    return status;
}

#endif
