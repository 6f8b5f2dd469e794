/* resumable.h - runs tables of entries (entries.h), so that they can be left after any entry and resumed later.
   ctx->work has the place: the entry that follows, in the table at work and in those that have called it. An entry ends with at most
   one loop over elements (springls__loop), which runs in pieces. */
#ifndef SPRINGLS__RUNTIME_RESUMABLE_H
#define SPRINGLS__RUNTIME_RESUMABLE_H

#include "arrays.h"
#include "entries.h"
#include "kernel_table.h"
#include "launch.h"
#include "parallel.h"
#include "residency.h"
#include "stage_clock.h"

/* ---- loops in pieces ---- */

/* Ends an entry with a loop: work over [0, count). Precondition: springls__reserve_lanes, where floats > 0. */
SPRINGLS__FN void springls__loop_over(springls_context *ctx, int count, int grain, size_t floats, springls__loop_work work,
                                      void *arg)
{
    springls__pieces *loop = &ctx->work.loop;
    loop->work = work;
    loop->arg = arg;
    loop->floats = floats;
    loop->grain = grain;
    loop->count = count;
    loop->next = loop->piece = 0;
    loop->pace = 0.0;
}

/* Ends an entry with a loop: a kernel over `count` elements. A device runs it at once, whole. */
SPRINGLS__FN void springls__loop(springls_context *ctx, springls__kernel kernel, int count, const springls__arguments *args)
{
    if (count <= 0 || ctx->lost || springls__ran_on_device(ctx, kernel, count, args)) return;
    if (springls__to_host(ctx, SPRINGLS__ALL_BITS, springls__kernels[kernel].writes) != SPRINGLS_OK) return;
    ctx->work.loop.kernel = springls__run_of(ctx, kernel, args);
    springls__loop_over(ctx, count, springls__kernels[kernel].grain, (size_t)springls__kernels[kernel].floats,
                        springls__range_work, &ctx->work.loop.kernel);
}

SPRINGLS__FN bool springls__in_loop(const springls_context *ctx) { return ctx->work.loop.next < ctx->work.loop.count; }

/* Runs the next n elements of the loop. */
SPRINGLS__FN void springls__run_next(springls_context *ctx, int n)
{
    springls__pieces *loop = &ctx->work.loop;
    springls__do_work(ctx, loop->work, loop->arg, loop->floats, loop->next, n, loop->grain);
    loop->next += n;
}

/* Runs what is left of the loop. */
SPRINGLS__FN void springls__finish_loop(springls_context *ctx)
{
    springls__pieces *loop = &ctx->work.loop;
    if (springls__in_loop(ctx)) springls__run_next(ctx, loop->count - loop->next);
}

/* Grains in the smallest piece. */
enum { SPRINGLS__PIECE_GRAINS = 2 };

/* Runs as much of the loop as takes a quarter of the time until `until` at its pace, at most twice as much as the piece before. The
   pace is that of the piece before, or of a slower one not long ago: elements differ in cost, and similar ones follow each other. */
SPRINGLS__FN void springls__run_piece(springls_context *ctx, double until)
{
    springls__pieces *loop = &ctx->work.loop;
    double now = springls__now(ctx), pace, fits = loop->pace > 0.0 ? 0.25 * (until - now) / loop->pace : 0.0;
    int least = SPRINGLS__PIECE_GRAINS * loop->grain, rest = loop->count - loop->next, n = least;
    if (fits > (double)least) n = fits < 2.0 * loop->piece ? (int)fits / loop->grain * loop->grain : 2 * loop->piece;
    n = springls__imin(n, rest);
    springls__run_next(ctx, n);
    pace = (springls__now(ctx) - now) / (double)n;
    loop->pace = pace > 0.8 * loop->pace ? pace : 0.8 * loop->pace;
    loop->piece = n;
}

/* Returns true when the smallest next piece would end after `until`. */
SPRINGLS__FN bool springls__too_late(const springls_context *ctx, double until)
{
    const springls__pieces *loop = &ctx->work.loop;
    double next = springls__in_loop(ctx) ? loop->pace * (double)(SPRINGLS__PIECE_GRAINS * loop->grain) : 0.0;
    return !(springls__now(ctx) + next < until);
}

/* ---- tables ---- */

SPRINGLS__FN springls__place *springls__place_at_work(springls_context *ctx) { return &ctx->work.place[ctx->work.depth - 1]; }

/* Returns how often the loop around the entry at work has been run to its end: 0 the first time. */
SPRINGLS__FN int springls__round(const springls_context *ctx) { return ctx->work.place[ctx->work.depth - 1].round; }

/* Returns true when an entry has counted some. */
SPRINGLS__FN bool springls__found_some(const springls_context *ctx) { return ctx->work.found > 0; }

/* Returns true for the first two rounds of a loop. */
SPRINGLS__FN bool springls__twice(const springls_context *ctx) { return springls__round(ctx) < 2; }

/* Begins a table, under the clock of a stage; -1: none. */
SPRINGLS__FN void springls__enter(springls_context *ctx, const springls__entry *table, int stage)
{
    springls__place *place = &ctx->work.place[ctx->work.depth++];
    SPRINGLS_ASSERT(ctx->work.depth <= SPRINGLS__MAX_CALLS);
    memset(place, 0, sizeof *place);
    place->table = table;
    place->stage = stage;
    if (stage >= 0) place->clock = springls__stage_begin(ctx, (springls_stage)stage);
}

/* Ends the table at work where it is. */
SPRINGLS__FN void springls__leave(springls_context *ctx)
{
    const springls__place *place = &ctx->work.place[--ctx->work.depth];
    if (place->stage >= 0) springls__stage_end(ctx, (springls_stage)place->stage, place->clock);
}

/* Stops the clocks of all stages at work, or lets them run on: see springls__place. The time in between does not count. */
SPRINGLS__FN void springls__turn_clocks(springls_context *ctx)
{
    const double now = springls__now(ctx);
    int i;
    for (i = 0; i < ctx->work.depth; i++) ctx->work.place[i].clock = now - ctx->work.place[i].clock;
}

/* Returns the other end of a block, searched for from entry i on in direction `way`: 1 from its begin, -1 from its end; -1: what ends is
   the table. */
SPRINGLS__FN int springls__other_end(const springls__entry *table, int i, int way)
{
    int depth = way;
    while (depth != 0 && (i += way) >= 0) {
        if (table[i].kind == SPRINGLS__ENTRY_IF || table[i].kind == SPRINGLS__ENTRY_REPEAT_WHILE) depth++;
        if (table[i].kind == SPRINGLS__ENTRY_END) depth--;
    }
    return i;
}

/* Ends the block or the table whose END has just been passed. */
SPRINGLS__FN void springls__end_block(springls_context *ctx)
{
    springls__place *place = springls__place_at_work(ctx);
    const int begin = springls__other_end(place->table, place->next - 1, -1);
    if (begin < 0) {
        springls__leave(ctx);
    } else if (place->table[begin].kind == SPRINGLS__ENTRY_REPEAT_WHILE) {
        place->round++;
        place->next = begin;
    }
}

/* Goes to the next entry that does something, if there is one: through blocks and into tables. */
SPRINGLS__FN void springls__go_to_next_entry(springls_context *ctx)
{
    while (ctx->work.depth > 0) {
        springls__place *place = springls__place_at_work(ctx);
        const springls__entry *entry = &place->table[place->next];
        if (entry->kind < SPRINGLS__ENTRY_CALL) return;
        place->next++;
        if (entry->kind == SPRINGLS__ENTRY_CALL) {
            springls__enter(ctx, entry->table, entry->what);
        } else if (entry->kind == SPRINGLS__ENTRY_END) {
            springls__end_block(ctx);
        } else if (!(entry->when)(ctx)) {
            if (entry->kind == SPRINGLS__ENTRY_REPEAT_WHILE) place->round = 0;
            place->next = springls__other_end(place->table, place->next - 1, 1) + 1;
        }
    }
}

/* Returns how many elements an extent has. */
SPRINGLS__FN int springls__extent_of(const springls_context *ctx, int extent)
{
    if (extent == (int)SPRINGLS__OVER_SPRINGLS) return ctx->model.set.count;
    return extent == (int)SPRINGLS__OVER_BRICKS ? ctx->model.grid.active_count : ctx->model.grid.slot_count;
}

/* Returns whether a kernel computes phi_next from phi, and leaves phi as it is in bricks that are asleep (springls__keeps_phi). */
SPRINGLS__FN bool springls__kernel_keeps_phi(springls__kernel kernel)
{
    return kernel == SPRINGLS__KERNEL_redistance || kernel == SPRINGLS__KERNEL_project || kernel == SPRINGLS__KERNEL_join_parts
           || kernel == SPRINGLS__KERNEL_specks;
}

/* Runs the kernel of an entry: in pieces, or to its end if its elements meet, which they do in order, or if a device runs it. */
SPRINGLS__FN springls_status springls__run_kernel_entry(springls_context *ctx, const springls__entry *entry)
{
    const springls__kernel kernel = (springls__kernel)entry->what;
    const springls__kernel_info *info = &springls__kernels[kernel];
    const int count = springls__extent_of(ctx, entry->other), phi_kept = ctx->model.grid.phi_kept;
    springls__arguments args;
    memset(&args, 0, sizeof args);
    if (entry->arguments) (entry->arguments)(ctx, &args);
    if (info->floats > 0) SPRINGLS__TRY(springls__reserve_lanes(ctx, (size_t)info->floats, count, info->grain));
    if (info->ordered) springls__run(ctx, kernel, count, &args);
    else springls__loop(ctx, kernel, count, &args);
    if (springls__kernel_keeps_phi(kernel)) { /* which copies that to phi_next once, and not in each sweep */
        ctx->work.keeps_phi = true;
        ctx->model.grid.phi_kept = phi_kept;
    }
    return SPRINGLS_OK;
}

/* Does what an entry says. It may end with a loop. */
SPRINGLS__FN springls_status springls__do_entry(springls_context *ctx)
{
    springls__place *place = springls__place_at_work(ctx);
    const springls__entry *entry = &place->table[place->next++];
    ctx->on_device = ctx->work.on_device && ctx->backend;
    switch (entry->kind) {
    case SPRINGLS__ENTRY_KERNEL: return springls__run_kernel_entry(ctx, entry);
    case SPRINGLS__ENTRY_ROOM:
        return springls__array_grow(ctx, (springls__array)entry->what, (size_t)springls__extent_of(ctx, entry->other), entry->element, 0);
    case SPRINGLS__ENTRY_SWAP:
        if (entry->what == SPRINGLS__ARRAY_PHI) {
            springls__swap_phi(ctx);
            return SPRINGLS_OK;
        }
        springls__swap(ctx, (springls__array)entry->what, (springls__array)entry->other);
        springls__note_writes(ctx, (uint64_t)1 << entry->what | (uint64_t)1 << entry->other);
        return SPRINGLS_OK;
    default: return (entry->run)(ctx);
    }
}

/* Resumes the table at work until the clock shows *until; NULL: to its end. Does at least one entry or piece. */
SPRINGLS__FN springls_status springls__resume(springls_context *ctx, const double *until)
{
    springls__go_to_next_entry(ctx);
    while (ctx->work.depth > 0) {
        if (!springls__in_loop(ctx)) SPRINGLS__TRY(springls__do_entry(ctx));
        else if (until) springls__run_piece(ctx, *until);
        else springls__finish_loop(ctx);
        if (ctx->lost) return ctx->backend_status;
        if (!springls__in_loop(ctx)) springls__go_to_next_entry(ctx);
        if (until && springls__too_late(ctx, *until)) break;
    }
    return SPRINGLS_OK;
}

/* Ends all tables at work where they are. */
SPRINGLS__FN void springls__unwind(springls_context *ctx)
{
    while (ctx->work.depth > 0) springls__leave(ctx);
    memset(&ctx->work, 0, sizeof ctx->work);
    ctx->model.grid.phi_kept = 0;
}

/* Runs a table under the clock of a stage (-1: none) to its end, also from inside an entry of another one. */
SPRINGLS__FN springls_status springls__run_stage(springls_context *ctx, int stage, const springls__entry *table)
{
    const springls__work outer = ctx->work;
    springls_status status;
    memset(&ctx->work, 0, sizeof ctx->work);
    springls__phi_not_kept(ctx);
    ctx->work.on_device = ctx->on_device;
    springls__enter(ctx, table, stage);
    status = springls__resume(ctx, NULL);
    springls__unwind(ctx);
    ctx->work = outer;
    springls__phi_not_kept(ctx);
    return status;
}

SPRINGLS__FN springls_status springls__run_table(springls_context *ctx, const springls__entry *table)
{
    return springls__run_stage(ctx, -1, table);
}

/* Begins a step: its table, from the next springls__resume_step on. */
SPRINGLS__FN void springls__begin_step(springls_context *ctx, const springls__entry *table)
{
    memset(&ctx->work, 0, sizeof ctx->work);
    springls__phi_not_kept(ctx);
    springls__enter(ctx, table, -1);
    ctx->work.on_device = true;
    ctx->step.active = true;
}

/* Tells what was in progress how it has ended, once. */
SPRINGLS__FN void springls__tell_end(springls_context *ctx, springls_status status)
{
    void (*ended)(springls_context *ctx, springls_status status) = ctx->step.ended;
    ctx->step.ended = NULL;
    if (ended) (ended)(ctx, status);
}

/* Ends the step in progress where it is. The model keeps what has been done. */
SPRINGLS__FN void springls__abandon_step(springls_context *ctx)
{
    if (ctx->step.active) springls__turn_clocks(ctx);
    springls__unwind(ctx);
    ctx->step.active = false;
    springls__tell_end(ctx, SPRINGLS_CANCELLED);
}

#endif
