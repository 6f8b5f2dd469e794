/* follow.h - makes phi follow the springls that lazy steps (params.lazy_distance) have moved, before anything but a lazy step
   uses it. For a reader phi follows, and bricks are added, for the time of reading only: the next step begins from phi as the
   steps have left it, so that reading changes no later bits.

   Why phi may stay behind: a flow moves springls exactly, in an eighth of a step's time; phi takes most of the rest, and is interpolated
   once more each time that it is carried along. While springls are nearer to where phi last followed than phi is known,
   nothing is lost by carrying it later, in one motion:

     step        1     2     3     4     5
     springls   -->   -->   -->   -->   -->
     phi                    ======>     ======>     3.5 voxels behind, or springls have turned by 0.18

   The sides of a thin sheet or gap move against each other, and phi would lose what lies between: there 0.15 voxel is the limit. */
#ifndef SPRINGLS__SOLVER_FOLLOW_H
#define SPRINGLS__SOLVER_FOLLOW_H

#include "../runtime/arrays.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../runtime/stage_clock.h"
#include "../model/cell_bricks.h"
#include "../model/host_access.h"
#include "../stages/events.h"
#include "../stages/project.h"
#include "../stages/sleep.h"

/* Returns true when phi is behind the springls by lazy steps. */
SPRINGLS__FN bool springls__phi_lags(const springls_context *ctx) { return ctx->lag > 0.0f && ctx->lag < FLT_MAX; }

/* The arrays that projecting changes, except those that are found again when they are needed. */
#define SPRINGLS__SAVED_BITS                                                                                                     \
    (((SPRINGLS__GRID_BITS) & ~(SPRINGLS__BIT(OMEGA) | SPRINGLS__BIT(CELL))) | SPRINGLS__BIT(SYNCED_POSITION))

/* Lists the numbers that are saved besides: X(name in springls__saved_level_set, member of the context). */
#define SPRINGLS__SAVED_NUMBERS(X)                                                                                               \
    X(table, model.grid.table) X(active_count, model.grid.active_count) X(free_count, model.grid.free_count)                     \
    X(slot_count, model.grid.slot_count) X(some_asleep, model.grid.some_asleep)                                                  \
    X(lag, lag) X(lag_turned, lag_turned) X(away, away) X(opposed, opposed)

/* Copies the arrays of SAVED_BITS to saved memory, or back; returns their bytes. Memory NULL: copies nothing. */
SPRINGLS__FN size_t springls__copy_saved(springls_context *ctx, char *memory, bool back)
{
    size_t at = 0;
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        size_t bytes;
        if (!springls__has_array(SPRINGLS__SAVED_BITS, array)) continue;
        bytes = springls__used(ctx, (springls__array)array) * springls__element_size((springls__array)array);
        if (memory && !back) {
            memcpy(memory + at, buffer->data, bytes);
        } else if (memory) {
            memcpy(buffer->data, memory + at, bytes);
            buffer->host_stale = false;
            buffer->device_stale = buffer->device_bytes > 0;
        }
        at += bytes;
    }
    return at;
}

/* Remembers the level set as the steps have left it. */
SPRINGLS__FN springls_status springls__save_level_set(springls_context *ctx)
{
    springls__saved_level_set *saved = &ctx->saved;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__SAVED_BITS, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &saved->memory, springls__copy_saved(ctx, NULL, false) + 1, 1, 0));
    springls__copy_saved(ctx, (char *)saved->memory.data, false);
#define SPRINGLS__SAVE(name, member) saved->name = ctx->member;
    SPRINGLS__SAVED_NUMBERS(SPRINGLS__SAVE)
#undef SPRINGLS__SAVE
    saved->in_use = true;
    return SPRINGLS_OK;
}

/* Goes back to the level set as the steps have left it. Calls that continue from there begin with this. */
SPRINGLS__FN void springls__end_reading(springls_context *ctx)
{
    springls__saved_level_set *saved = &ctx->saved;
    const bool found = ctx->components_version == springls__components_source(ctx);
    if (!saved->in_use) return;
#define SPRINGLS__GET_SAVED(name, member) ctx->member = saved->name;
    SPRINGLS__SAVED_NUMBERS(SPRINGLS__GET_SAVED)
#undef SPRINGLS__GET_SAVED
    springls__copy_saved(ctx, (char *)saved->memory.data, true); /* as many elements as these numbers have in use */
    ctx->at_rest = false;
    ctx->omega_fresh = false;
    springls__note_writes(ctx, SPRINGLS__SAVED_BITS);
    springls__discard_cell_list(ctx);
    if (found && !springls__phi_lags(ctx)) ctx->components_version = springls__components_source(ctx); /* only bricks have come and gone */
    saved->in_use = false;
}

static const springls__entry springls__follow_springls[] = {
    SPRINGLS__CALL(springls__wake_moved)
    SPRINGLS__CALL(springls__carry_level_set)
SPRINGLS__END };

/* Makes phi follow; springls stay as they are. */
SPRINGLS__FN springls_status springls__follow(springls_context *ctx)
{
    springls_status status;
    springls__use_device(ctx);
    ctx->calls++;
    status = springls__run_stage(ctx, SPRINGLS_STAGE_PROJECT, springls__follow_springls);
    ctx->calls--;
    return springls__report_device_failure(ctx, status);
}

/* Makes phi and springls agree for a call that reads the level set, if no step is in progress. Every such call does this. */
SPRINGLS__FN springls_status springls__read_level_set(springls_context *ctx)
{
    springls_status status;
    if (ctx->step.active || !springls__phi_lags(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__save_level_set(ctx)));
    status = springls__follow(ctx);
    if (status != SPRINGLS_OK) springls__end_reading(ctx);
    return status;
}

/* Builds the cell list for a reader. Bricks that particles outside all active ones need are there for the time of reading. */
SPRINGLS__FN springls_status springls__read_cell_list(springls_context *ctx)
{
    const bool found = ctx->components_version == springls__components_source(ctx);
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (ctx->particles_outside == 0) return SPRINGLS_OK;
    if (!ctx->saved.in_use) SPRINGLS__TRY(springls__save_level_set(ctx));
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    if (found) ctx->components_version = springls__components_source(ctx); /* new bricks are outside: components stay */
    return SPRINGLS_OK;
}

/* Finds the components of the present model. Those of what springls hold are found as a reader finds the mesh, also from springls outside
   all active bricks. */
SPRINGLS__FN springls_status springls__find_present_components(springls_context *ctx)
{
    const bool reading = ctx->saved.in_use;
    springls_status status = SPRINGLS_OK;
    if (springls__contours_springls(ctx)) {
        SPRINGLS__TRY(springls__use_host_calmly(ctx, false));
        status = springls__read_cell_list(ctx);
    }
    if (status == SPRINGLS_OK) status = springls__update_components(ctx);
    if (!reading) springls__end_reading(ctx);
    return status;
}

static const springls__entry springls__components[] = { SPRINGLS__DO(springls__find_present_components) SPRINGLS__END };

/* Makes phi and springls agree for good, for a call that changes the model; no step is in progress. */
SPRINGLS__FN springls_status springls__change_level_set(springls_context *ctx)
{
    springls__end_reading(ctx);
    return springls__phi_lags(ctx) ? springls__follow(ctx) : SPRINGLS_OK;
}

#endif
