/* step.h - Algorithms 2 and 3: tables of stages, which a step goes through row by row for each of its sub-steps. It can be left
   between any two parts of a stage (parts.h) and gone on with later: what is not in the model then is in ctx->step. */
#ifndef SPRINGLS__SOLVER_STEP_H
#define SPRINGLS__SOLVER_STEP_H

#include "../runtime/errors.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../runtime/stage_clock.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../stages/advect.h"
#include "../stages/contract.h"
#include "../stages/evolve.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/relax.h"
#include "../stages/resample.h"
#include "../stages/unsigned_to_signed.h"
#include "../stages/volume_lock.h"

/* ---- what the rows ask ---- */

SPRINGLS__FN bool springls__resample_due(const springls_context *ctx, int iteration)
{
    return iteration % ctx->model.params.resample_period == 0;
}

/* Volumes are to be locked, and nobody knows them yet. */
SPRINGLS__FN bool springls__lock_is_new(const springls_context *ctx)
{
    return ctx->model.params.volume_lock && ctx->locked_count == 0;
}

SPRINGLS__FN bool springls__locks_volume(const springls_context *ctx) { return ctx->model.params.volume_lock != 0; }

/* contract will ask for phi as it was before the springls moved. */
SPRINGLS__FN bool springls__needs_phi_before(const springls_context *ctx)
{
    return !ctx->step.desc.one_to_one && !ctx->model.params.resample_last && springls__resample_due(ctx, ctx->iteration + 1);
}

SPRINGLS__FN bool springls__resamples(const springls_context *ctx) { return ctx->step.resamples; }
SPRINGLS__FN bool springls__resamples_first(const springls_context *ctx)
{
    return ctx->step.resamples && !ctx->model.params.resample_last;
}
SPRINGLS__FN bool springls__resamples_last(const springls_context *ctx)
{
    return ctx->step.resamples && ctx->model.params.resample_last;
}
SPRINGLS__FN bool springls__not_one_to_one(const springls_context *ctx) { return !ctx->step.desc.one_to_one; }
SPRINGLS__FN bool springls__phi_is_from_springls(const springls_context *ctx) { return ctx->step.phi_from_springls; }
SPRINGLS__FN bool springls__has_edges(const springls_context *ctx)
{
    return ctx->model.params.keep_edges && ctx->model.set.at_edges > 0;
}
SPRINGLS__FN bool springls__carries(const springls_context *ctx) { return ctx->model.params.carry_level_set && !ctx->step.phi_from_springls; }
SPRINGLS__FN bool springls__iterates(const springls_context *ctx) { return ctx->step.iterations_left > 0; }

/* After eq. 23; carrying phi along has projected it already. */
SPRINGLS__FN bool springls__projects(const springls_context *ctx)
{
    return ctx->model.params.project_level_set && !(springls__carries(ctx) && ctx->model.params.evolve_iterations == 0);
}

/* ---- what is done between stages ---- */

enum { SPRINGLS__MAX_SUBSTEPS = 10000 };

/* The rest of a step is cut into parts as equal as the force allows. */
SPRINGLS__FN springls_status springls__substep_begin(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    float dt = step->longest_substep;
    if (step->time_left > 0.0f) {
        dt = step->time_left / (springls__floor(step->time_left / step->longest_substep * 0.9999f) + 1.0f);
        if (ctx->time + (double)dt == ctx->time)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: at time %g a sub-step of %g is nothing", ctx->time,
                                  (double)dt);
        if (step->substeps++ == SPRINGLS__MAX_SUBSTEPS)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps: the force has grown",
                                  SPRINGLS__MAX_SUBSTEPS);
    }
    if (!ctx->model.params.volume_lock) {
        ctx->locked_count = 0;
        ctx->stats.volume_correction = 0.0f;
    }
    SPRINGLS__TRY(springls__motion_begin(ctx, &step->forces, (float)ctx->time, dt));
    ctx->motion.max_displacement = step->time_left > 0.0f ? step->desc.max_displacement * 1.0001f : 0.0f;
    ctx->motion.stop_at_topology = step->desc.stop_at_topology;
    return SPRINGLS_OK;
}

/* Springls have moved. */
SPRINGLS__FN springls_status springls__substep_advanced(springls_context *ctx)
{
    ctx->time += (double)ctx->motion.dt;
    ctx->iteration++;
    ctx->stats.steps++;
    ctx->model.set.step = (uint32_t)ctx->stats.steps & 0x3fffffffu;
    ctx->step.resamples = !ctx->step.desc.one_to_one && springls__resample_due(ctx, ctx->iteration);
    ctx->step.phi_from_springls = ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC;
    return SPRINGLS_OK;
}

/* Springls may have come too far for phi to be carried along. */
SPRINGLS__FN springls_status springls__check_displacement(springls_context *ctx)
{
    float way;
    SPRINGLS__TRY(springls__displacement_since_phi(ctx, &way));
    ctx->step.phi_from_springls = ctx->model.params.carry_level_set && way > ctx->model.grid.far_value;
    return SPRINGLS_OK;
}

/* How often eq. 23 is needed: it closes what gaps between springls have left open where phi has just been made afresh of them. */
SPRINGLS__FN springls_status springls__follow_begin(springls_context *ctx)
{
    const int enough = 3;
    ctx->step.iterations_left = ctx->model.params.evolve_iterations;
    if (ctx->model.params.carry_level_set && ctx->step.phi_from_springls) ctx->step.iterations_left = springls__imax(ctx->step.iterations_left, enough);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__iteration_done(springls_context *ctx)
{
    ctx->step.iterations_left--;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__substep_end(springls_context *ctx);

/* ---- the algorithms ---- */

#define SPRINGLS__DO(run) { SPRINGLS__ENTRY_RUN, -1, NULL, run }
#define SPRINGLS__DO_IF(when, run) { SPRINGLS__ENTRY_RUN, -1, when, run }
#define SPRINGLS__STAGE(name, run) { SPRINGLS__ENTRY_RUN, SPRINGLS_STAGE_##name, NULL, run }
#define SPRINGLS__STAGE_IF(when, name, run) { SPRINGLS__ENTRY_RUN, SPRINGLS_STAGE_##name, when, run }
#define SPRINGLS__REPEAT_WHILE(when) { SPRINGLS__ENTRY_REPEAT_WHILE, -1, when, NULL }
#define SPRINGLS__END_REPEAT { SPRINGLS__ENTRY_END_REPEAT, -1, NULL, NULL }

#define SPRINGLS__BEGIN_SUBSTEP                                                              \
    SPRINGLS__DO(springls__substep_begin),                                                   \
    SPRINGLS__STAGE_IF(springls__lock_is_new, VOLUME_LOCK, springls__volume_lock)
#define SPRINGLS__MOVE                                                                       \
    SPRINGLS__STAGE(ADVECT, springls__advect),                                               \
    SPRINGLS__DO(springls__substep_advanced)
/* The level set follows the springls. */
#define SPRINGLS__FOLLOW                                                                     \
    SPRINGLS__DO(springls__follow_begin),                                                    \
    SPRINGLS__STAGE_IF(springls__has_edges, KEEP_EDGES, springls__keep_edges),               \
    SPRINGLS__STAGE_IF(springls__carries, PROJECT, springls__carry_level_set),               \
    SPRINGLS__REPEAT_WHILE(springls__iterates),                                              \
        SPRINGLS__STAGE(EVOLVE, springls__evolve),                                           \
        SPRINGLS__STAGE(REBUILD, springls__rebuild),                                         \
        SPRINGLS__DO(springls__iteration_done),                                              \
    SPRINGLS__END_REPEAT,                                                                    \
    SPRINGLS__STAGE_IF(springls__projects, PROJECT, springls__project_level_set)
#define SPRINGLS__END_SUBSTEP                                                                \
    SPRINGLS__STAGE_IF(springls__locks_volume, VOLUME_LOCK, springls__volume_lock),          \
    SPRINGLS__DO(springls__substep_end)

static const springls__step_entry springls__fluid[] = { /* Algorithm 2 */
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__DO_IF(springls__needs_phi_before, springls__sample_phi),
    SPRINGLS__MOVE,
    SPRINGLS__STAGE(RELAX, springls__relax),
    SPRINGLS__STAGE_IF(springls__resamples_first, CONTRACT, springls__contract),
    SPRINGLS__STAGE_IF(springls__resamples_first, RESAMPLE, springls__resample),
    SPRINGLS__STAGE_IF(springls__resamples_first, RELAX, springls__relax),
    SPRINGLS__DO(springls__check_displacement),
    SPRINGLS__STAGE_IF(springls__phi_is_from_springls, UNSIGNED_TO_SIGNED, springls__unsigned_to_signed),
    SPRINGLS__FOLLOW,
    SPRINGLS__DO_IF(springls__resamples, springls__orient),
    SPRINGLS__STAGE_IF(springls__resamples_last, CONTRACT, springls__contract_now),
    SPRINGLS__STAGE_IF(springls__resamples_last, RESAMPLE, springls__resample),
    SPRINGLS__STAGE_IF(springls__resamples, FILL_GAPS, springls__fill_gaps),
    SPRINGLS__END_SUBSTEP
};

static const springls__step_entry springls__elastic[] = { /* Algorithm 3 */
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__MOVE,
    SPRINGLS__STAGE(UNSIGNED_TO_SIGNED, springls__unsigned_to_signed),
    SPRINGLS__FOLLOW,
    SPRINGLS__STAGE(RELAX, springls__relax),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, FILL_GAPS, springls__fill_gaps),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, CONTRACT, springls__contract_now),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, RESAMPLE, springls__resample),
    SPRINGLS__END_SUBSTEP
};

static const springls__step_entry springls__advect_only[] = {
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__MOVE,
    SPRINGLS__DO(springls__substep_end)
};

SPRINGLS__FN void springls__first_entry(springls_context *ctx)
{
    ctx->step.next = ctx->step.desc.mode == SPRINGLS_MODE_FLUID     ? springls__fluid
                    : ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC ? springls__elastic
                                                              : springls__advect_only;
}

/* Is there another sub-step? The next one is as long as the last one permitted. */
SPRINGLS__FN springls_status springls__substep_end(springls_context *ctx)
{
    const float growth = 1.5f;
    springls__stepping *step = &ctx->step;
    float longest = step->desc.max_displacement, moved = ctx->motion.moved;
    if (step->time_left == 0.0f) {
        step->active = false;
        return SPRINGLS_OK;
    }
    step->time_left = (float)(step->end_time - ctx->time);
    step->longest_substep = ctx->motion.dt * (growth * moved > longest ? longest / moved : growth);
    if (step->time_left > 1e-6f * step->desc.dt) {
        springls__first_entry(ctx);
        return SPRINGLS_OK;
    }
    ctx->time = step->end_time;
    step->active = false;
    return SPRINGLS_OK;
}

/* How the step is cut into sub-steps: left is 0 where it is not. */
SPRINGLS__FN springls_status springls__plan_step(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    const springls_step_desc *desc = &step->desc;
    float speed = 0.0f, limit = desc->max_displacement > 0.0f ? desc->max_displacement : ctx->model.params.d_max;
    step->time_left = 0.0f;
    step->longest_substep = desc->dt;
    springls__first_entry(ctx);
    if (desc->dt > 0.0f && desc->max_displacement == 0.0f) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__max_speed(ctx, &step->forces, (float)ctx->time, &speed));
    if (desc->dt == 0.0f) { /* section 4.8: dt = d_max / f_max */
        step->longest_substep = speed > 1e-6f ? limit / speed : 0.0f;
        return SPRINGLS_OK;
    }
    if (!(speed * desc->dt <= (float)SPRINGLS__MAX_SUBSTEPS * limit))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps of max_displacement",
                              SPRINGLS__MAX_SUBSTEPS);
    step->time_left = desc->dt;
    step->end_time = ctx->time + (double)desc->dt;
    step->longest_substep = speed * desc->dt > limit ? limit / speed : desc->dt;
    return SPRINGLS_OK;
}

static const springls__step_entry springls__plan[] = { SPRINGLS__DO(springls__plan_step) };

#undef SPRINGLS__DO
#undef SPRINGLS__DO_IF
#undef SPRINGLS__STAGE
#undef SPRINGLS__STAGE_IF
#undef SPRINGLS__REPEAT_WHILE
#undef SPRINGLS__END_REPEAT
#undef SPRINGLS__BEGIN_SUBSTEP
#undef SPRINGLS__MOVE
#undef SPRINGLS__FOLLOW
#undef SPRINGLS__END_SUBSTEP

/* ---- from entry to entry ---- */

/* The entry that runs next, at or after `entry`: follows loops and passes over entries whose condition is false. */
SPRINGLS__FN const springls__step_entry *springls__due_entry(const springls_context *ctx, const springls__step_entry *entry)
{
    for (;; entry++) {
        if (entry->kind == SPRINGLS__ENTRY_END_REPEAT)
            while (entry->kind != SPRINGLS__ENTRY_REPEAT_WHILE) entry--;
        if (entry->kind == SPRINGLS__ENTRY_REPEAT_WHILE && !entry->when(ctx))
            while (entry->kind != SPRINGLS__ENTRY_END_REPEAT) entry++;
        if (entry->kind == SPRINGLS__ENTRY_RUN && (!entry->when || entry->when(ctx))) return entry;
    }
}

SPRINGLS__FN void springls__entry_begin(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    const springls__step_entry *entry = springls__due_entry(ctx, step->next);
    step->next = entry + 1;
    step->stage = entry->stage;
    step->stage_seconds = 0.0;
    if (step->stage >= 0) springls__stage_begin(ctx, (springls_stage)step->stage);
    springls__begin_phases(ctx, entry->run);
}

/* Goes on with the stage at work. Its clock stands still while nobody does. */
SPRINGLS__FN springls_status springls__resume_entry(springls_context *ctx, const double *until)
{
    springls__stepping *step = &ctx->step;
    double started = springls__now(ctx) - step->stage_seconds;
    springls_status status;
    springls__use_device(ctx);
    status = springls__resume(ctx, until);
    if (status == SPRINGLS_OK && !springls__phases_done(ctx)) step->stage_seconds = springls__now(ctx) - started;
    else springls__entry_end(ctx, started);
    return status;
}

/* Goes on with the step in progress for a while; NULL: to its end. */
SPRINGLS__FN springls_status springls__resume_step(springls_context *ctx, const double *until)
{
    springls_status status = SPRINGLS_OK;
    if (!ctx->step.active) return SPRINGLS_OK;
    ctx->calls++;
    do {
        if (springls__phases_done(ctx)) springls__entry_begin(ctx);
        status = springls__resume_entry(ctx, until);
    } while (status == SPRINGLS_OK && ctx->step.active && !(until && springls__too_late(ctx, *until)));
    ctx->calls--;
    if (status == SPRINGLS_OK && ctx->step.active) return SPRINGLS_OK;
    springls__abandon_step(ctx);
    return springls__report_device_failure(ctx, status);
}

SPRINGLS__FN springls_status springls__finish_step(springls_context *ctx) { return springls__resume_step(ctx, NULL); }

SPRINGLS_API springls_status springls_step_begin(springls_context *ctx, const springls_step_desc *step)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    if (!step || !step->forces || !(step->dt >= 0.0f && step->dt < FLT_MAX)
        || !(step->max_displacement >= 0.0f && step->max_displacement < FLT_MAX))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT,
                              "step: forces is NULL, or dt or max_displacement is negative or not finite");
    if (step->max_displacement > 0.0f && step->max_displacement < 1e-3f)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: max_displacement is below a thousandth of a voxel");
    if (step->mode != SPRINGLS_MODE_FLUID && step->mode != SPRINGLS_MODE_ELASTIC && step->mode != SPRINGLS_MODE_ADVECT_ONLY)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: there is no mode %d", (int)step->mode);
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "step: there are no springls");
    springls__abandon_step(ctx);
    memset(&ctx->step, 0, sizeof ctx->step);
    ctx->step.desc = *step;
    ctx->step.forces = *step->forces;
    ctx->step.next = springls__plan;
    ctx->step.stage = -1;
    ctx->step.active = true;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_step_continue(springls_context *ctx, double seconds, bool *done)
{
    springls_status status;
    double until;
    if (done) *done = true;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!done || !(seconds >= 0.0))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT,
                              "step_continue: done is NULL, or seconds is negative or not a number");
    until = springls__now(ctx) + seconds;
    status = springls__resume_step(ctx, &until);
    *done = !ctx->step.active;
    return status;
}

SPRINGLS_API bool springls_step_in_progress(const springls_context *ctx) { return ctx && ctx->step.active; }

SPRINGLS_API springls_status springls_step(springls_context *ctx, const springls_step_desc *step)
{
    SPRINGLS__TRY(springls_step_begin(ctx, step));
    return springls__finish_step(ctx);
}

SPRINGLS_API springls_status springls_run(springls_context *ctx, const springls_step_desc *step, int steps)
{
    const float still = 1e-3f; /* share of moving springls at which an active contour has arrived */
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (steps < 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "run: a negative number of steps");
    for (i = 0; i < steps; i++) {
        SPRINGLS__TRY(springls_step(ctx, step));
        if (springls__cancelled(ctx, (float)(i + 1) / (float)steps))
            return springls__fail(ctx, SPRINGLS_CANCELLED, "run: cancelled after step %d of %d", i + 1, steps);
        if (step->stop_at_rest && ctx->stats.moving_share <= still) return SPRINGLS_OK;
    }
    return SPRINGLS_OK;
}

SPRINGLS_API double springls_time(const springls_context *ctx) { return ctx ? ctx->time : 0.0; }

SPRINGLS_API void springls_set_time(springls_context *ctx, double time)
{
    if (!ctx || !(time > -DBL_MAX && time < DBL_MAX)) return;
    springls__finish_step(ctx);
    ctx->time = time;
}

#endif
