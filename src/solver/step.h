/* step.h - runs a step: its table (algorithm_tables.h). It can be left after any entry and resumed later: until then ctx->step and
   ctx->work hold what is not in the model. */
#ifndef SPRINGLS__SOLVER_STEP_H
#define SPRINGLS__SOLVER_STEP_H

#include "../runtime/finite.h"
#include "../runtime/errors.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../runtime/stage_clock.h"
#include "../model/host_access.h"
#include "algorithm_tables.h"
#include "follow.h"
#include "rest.h"

/* Resumes the step in progress until the clock shows *until; NULL: to its end. Does nothing without one. */
SPRINGLS__FN springls_status springls__resume_step(springls_context *ctx, const double *until)
{
    springls_status status = SPRINGLS_OK;
    if (!ctx->step.active) return SPRINGLS_OK;
    ctx->calls++;
    springls__turn_clocks(ctx);
    if (ctx->step.go_on) status = (ctx->step.go_on)(ctx);
    if (status == SPRINGLS_OK) status = springls__resume(ctx, until);
    if (status != SPRINGLS_OK) springls__unwind(ctx);
    springls__turn_clocks(ctx);
    ctx->calls--;
    ctx->step.active = ctx->work.depth > 0;
    if (status != SPRINGLS_OK && ctx->step.chunks) springls__end_reading(ctx); /* phi may have followed only in part */
    if (!ctx->step.active) springls__tell_end(ctx, status);
    return ctx->step.active ? SPRINGLS_OK : springls__report_device_failure(ctx, status);
}

/* Ends the step, the update of chunks or the combination that is in progress, if any. Calls that change the model or need its working
   memory begin with this. */
SPRINGLS__FN springls_status springls__finish_step(springls_context *ctx) { return springls__resume_step(ctx, NULL); }

/* Ends the step in progress, if any, and makes phi follow for a call that reads it. */
SPRINGLS__FN springls_status springls__begin_reading(springls_context *ctx)
{
    SPRINGLS__TRY(springls__finish_step(ctx));
    return springls__read_level_set(ctx);
}

/* Finds the components where they are outdated. Calls that read them, and calls that change phi, begin with this: so components get
   the ids that they would have got if somebody had read them before. */
SPRINGLS__FN springls_status springls__update_outdated_components(springls_context *ctx)
{
    if (!springls__components_outdated(ctx)) return SPRINGLS_OK;
    return springls__report_device_failure(ctx, springls__find_present_components(ctx));
}

/* Finds the components where they are outdated, for a call that stores them or ends following them, and goes back to the level set as the
   steps have left it; no step is in progress. */
SPRINGLS__FN springls_status springls__settle_components(springls_context *ctx)
{
    if (springls__components_outdated(ctx)) {
        SPRINGLS__TRY(springls__read_level_set(ctx));
        SPRINGLS__TRY(springls__update_outdated_components(ctx));
    }
    springls__end_reading(ctx);
    return SPRINGLS_OK;
}

/* Ends the step in progress, if any, and makes phi follow, and components settle, for a call that changes the model. */
SPRINGLS__FN springls_status springls__begin_change(springls_context *ctx)
{
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__change_level_set(ctx));
    return springls__update_outdated_components(ctx);
}

/* Fails when a description's max_displacement is not finite, or so short that it is a mistake. */
SPRINGLS__FN springls_status springls__check_max_displacement(springls_context *ctx, const char *call, float x)
{
    const float least = 1e-3f;
    if (!springls__finite((double)x))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: max_displacement is %g, not finite", call, (double)x);
    if (x > 0.0f && x < least)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: max_displacement is %g, below a thousandth of a voxel, and not 0",
                              call, (double)x);
    return SPRINGLS_OK;
}

/* springls_step_begin without its warning of a region outside the grid. */
SPRINGLS__FN springls_status springls__step_begin(springls_context *ctx, const springls_step_desc *step)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    if (!step) return springls__fail_null(ctx, "step", "the description");
    SPRINGLS__TRY(springls__check_amount(ctx, "step", "dt", (double)step->dt));
    SPRINGLS__TRY(springls__check_max_displacement(ctx, "step", step->max_displacement));
    if (step->mode != SPRINGLS_MODE_FLUID && step->mode != SPRINGLS_MODE_ELASTIC && step->mode != SPRINGLS_MODE_ADVECT_ONLY)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: there is no mode %d: it may be 0 to 2", (int)step->mode);
    SPRINGLS__TRY(springls__check_amount(ctx, "step", "rest_share", (double)step->rest_share));
    SPRINGLS__TRY(springls__check_amount(ctx, "step", "rest_displacement", (double)step->rest_displacement));
    if (step->forces) SPRINGLS__TRY(springls__check_forces(ctx, step->forces));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "step: there are no springls");
    springls__abandon_step(ctx);
    springls__end_reading(ctx);
    springls__drop_past_events(ctx);
    memset(&ctx->step, 0, sizeof ctx->step);
    ctx->step.desc = *step;
    if (step->forces) ctx->step.forces = *step->forces;
    ctx->step.max_displacement = springls__displacement_limit(&ctx->model.params, step);
    springls__begin_step(ctx, springls__step);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_step_begin(springls_context *ctx, const springls_step_desc *step)
{
    SPRINGLS__TRY(springls__step_begin(ctx, step));
    if (step->forces) springls__warn_of_region(ctx, step->forces);
    return SPRINGLS_OK;
}

SPRINGLS_API bool springls_step_in_progress(const springls_context *ctx)
{
    return ctx && ctx->step.active && !ctx->step.chunks && !ctx->step.combination;
}

SPRINGLS_API springls_status springls_step_continue(springls_context *ctx, double seconds, bool *done)
{
    springls_status status;
    double until;
    if (done) *done = !springls_step_in_progress(ctx);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!done) return springls__fail_null(ctx, "step_continue", "done");
    if (springls__is_nan(seconds)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step_continue: the seconds are NaN");
    if (!springls_step_in_progress(ctx)) return SPRINGLS_OK;
    until = springls__now(ctx) + (seconds > 0.0 ? seconds : 0.0); /* a budget that is used up is below 0 */
    status = springls__resume_step(ctx, &until);
    *done = !ctx->step.active;
    return status;
}

SPRINGLS_API springls_status springls_step(springls_context *ctx, const springls_step_desc *step)
{
    SPRINGLS__TRY(springls_step_begin(ctx, step));
    return springls__finish_step(ctx);
}

/* Finds after step number `step` of a run, from 1 on, whether the contour has arrived. */
SPRINGLS__FN springls_status springls__has_arrived(springls_context *ctx, const springls_step_desc *desc, int step,
                                                   springls__rest_watch *watch, bool *arrived)
{
    const float still = desc->rest_share > 0.0f ? desc->rest_share : 1e-3f;
    float share = ctx->stats.moving_share;
    *arrived = false;
    if (!desc->stop_at_rest || (desc->rest_steps > 1 && step % desc->rest_steps != 0)) return SPRINGLS_OK;
    if (desc->rest_steps > 1)
        SPRINGLS__TRY(springls__rest_look(ctx, watch, desc->rest_displacement > 0.0f ? desc->rest_displacement : 0.01f, &share));
    *arrived = share <= still;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__run_steps(springls_context *ctx, const springls_step_desc *step, int steps,
                                                 springls__rest_watch *watch)
{
    bool arrived = false;
    int i;
    for (i = 0; i < steps && !arrived; i++) {
        SPRINGLS__TRY(springls_step(ctx, step));
        if (springls__cancelled(ctx, (float)(i + 1) / (float)steps))
            return springls__fail(ctx, SPRINGLS_CANCELLED, "run: cancelled after step %d of %d", i + 1, steps);
        SPRINGLS__TRY(springls__has_arrived(ctx, step, i + 1, watch, &arrived));
    }
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_run(springls_context *ctx, const springls_step_desc *step, int steps)
{
    springls__rest_watch watch;
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (steps < 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "run: %d steps, not 0 or more", steps);
    memset(&watch, 0, sizeof watch);
    status = springls__run_steps(ctx, step, steps, &watch);
    springls__rest_watch_free(ctx, &watch);
    return status;
}

SPRINGLS_API bool springls_at_rest(const springls_context *ctx) { return ctx && ctx->at_rest; }

SPRINGLS_API springls_status springls_settle(springls_context *ctx, int steps)
{
    springls_step_desc rest;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (steps < 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "settle: %d steps, not 0 or more", steps);
    memset(&rest, 0, sizeof rest);
    SPRINGLS__TRY(springls__finish_step(ctx));
    while (steps-- > 0 && !ctx->at_rest) SPRINGLS__TRY(springls_step(ctx, &rest));
    return SPRINGLS_OK;
}

/* Finds whether springls have moved since phi followed them, by springls_write or a lone springls_advect: *moved. No step is in
   progress. */
SPRINGLS__FN springls_status springls__moved_since_phi(springls_context *ctx, bool *moved)
{
    float displacement = 0.0f;
    if (ctx->model.set.count && ctx->model.params.carry_level_set)
        SPRINGLS__TRY(springls__displacement_since_phi(ctx, &displacement));
    *moved = displacement > 0.0f;
    return SPRINGLS_OK;
}

/* Makes phi follow springls that have moved. Calls that replace phi as a whole do this first, so that no motion is lost. */
SPRINGLS__FN springls_status springls__follow_written(springls_context *ctx)
{
    springls_step_desc rest;
    bool moved;
    SPRINGLS__TRY(springls__moved_since_phi(ctx, &moved));
    if (!moved) return SPRINGLS_OK;
    memset(&rest, 0, sizeof rest);
    return springls_step(ctx, &rest);
}

/* Ends the step in progress, and makes phi follow all springls that have moved. */
SPRINGLS__FN springls_status springls__follow_all(springls_context *ctx)
{
    SPRINGLS__TRY(springls__begin_change(ctx));
    return springls__follow_written(ctx);
}

SPRINGLS_API double springls_time(const springls_context *ctx) { return ctx ? ctx->time : 0.0; }

SPRINGLS_API void springls_set_time(springls_context *ctx, double time)
{
    if (!ctx || !springls__finite(time)) return;
    springls__finish_step(ctx);
    ctx->time = time;
}

#endif
