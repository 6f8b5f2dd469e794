/* resumable.h - stages that can be left between two phases and resumed later.
   A stage is a function that is called once for each of its phases: it does ctx->work.phase and returns springls__next_phase, or
   SPRINGLS_OK after its last phase. A phase ends with at most one loop over elements (springls__loop), which runs in pieces.
   ctx->work holds what one phase leaves for the next. A stage that does not read the phase has one phase. */
#ifndef SPRINGLS__RUNTIME_RESUMABLE_H
#define SPRINGLS__RUNTIME_RESUMABLE_H

#include "kernel_table.h"
#include "launch.h"
#include "parallel.h"
#include "residency.h"
#include "stage_clock.h"

/* Ends a phase: `phase` of the same stage follows. */
SPRINGLS__FN springls_status springls__next_phase(springls_context *ctx, int phase)
{
    ctx->work.phase = phase;
    ctx->work.pending = true;
    return SPRINGLS_OK;
}

/* Ends the last phase of a stage: all phases of another stage follow. */
SPRINGLS__FN springls_status springls__next_stage(springls_context *ctx, springls__stage_fn stage)
{
    ctx->work.stage = stage;
    ctx->work.repetition = 0;
    return springls__next_phase(ctx, 0);
}

/* ---- loops in pieces ---- */

/* Ends the phase with a loop: work over [0, count). Precondition: springls__reserve_lanes, where floats > 0. */
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

/* Ends the phase with a loop: a kernel over `count` elements. A device runs it at once, whole. */
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

/* ---- phases ---- */

SPRINGLS__FN void springls__begin_phases(springls_context *ctx, springls__stage_fn stage)
{
    memset(&ctx->work, 0, sizeof ctx->work);
    springls__next_stage(ctx, stage);
}

SPRINGLS__FN bool springls__phases_done(const springls_context *ctx) { return !ctx->work.pending && !springls__in_loop(ctx); }

SPRINGLS__FN springls_status springls__run_phase(springls_context *ctx)
{
    ctx->work.pending = false;
    return (ctx->work.stage)(ctx);
}

/* Resumes the stage at work until the clock shows *until; NULL: to its end. Runs at least one phase or piece. */
SPRINGLS__FN springls_status springls__resume(springls_context *ctx, const double *until)
{
    while (!springls__phases_done(ctx)) {
        if (!springls__in_loop(ctx)) SPRINGLS__TRY(springls__run_phase(ctx));
        else if (until) springls__run_piece(ctx, *until);
        else springls__finish_loop(ctx);
        if (ctx->lost) return ctx->backend_status;
        if (until && springls__too_late(ctx, *until)) break;
    }
    return SPRINGLS_OK;
}

/* Runs all of a stage, also from inside a phase of another one. */
SPRINGLS__FN springls_status springls__run_to_completion(springls_context *ctx, springls__stage_fn stage)
{
    const springls__work outer = ctx->work;
    springls_status status;
    springls__begin_phases(ctx, stage);
    status = springls__resume(ctx, NULL);
    ctx->work = outer;
    return status;
}

/* ---- the step in progress ---- */

/* Stops the clock of the step's stage at work. */
SPRINGLS__FN void springls__entry_end(springls_context *ctx, double started)
{
    if (ctx->step.stage >= 0) springls__stage_end(ctx, (springls_stage)ctx->step.stage, started);
    ctx->step.stage = -1;
}

/* Ends the step in progress where it is. The model keeps what has been done. */
SPRINGLS__FN void springls__abandon_step(springls_context *ctx)
{
    if (ctx->step.active) springls__entry_end(ctx, springls__now(ctx) - ctx->step.stage_seconds);
    ctx->step.active = false;
    memset(&ctx->work, 0, sizeof ctx->work);
}

#endif
