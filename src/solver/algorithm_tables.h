/* algorithm_tables.h - Algorithms 2 and 3 as tables of stages, with the work between the stages. Each table is one sub-step. */
#ifndef SPRINGLS__SOLVER_ALGORITHM_TABLES_H
#define SPRINGLS__SOLVER_ALGORITHM_TABLES_H

#include "../runtime/errors.h"
#include "../model/constellation.h"
#include "../stages/advect.h"
#include "../stages/contact_bodies.h"
#include "../stages/contract.h"
#include "../stages/evolve.h"
#include "../stages/fill_gaps.h"
#include "../stages/keep_edges.h"
#include "../stages/project.h"
#include "../stages/rebuild.h"
#include "../stages/relax.h"
#include "../stages/resample.h"
#include "../stages/sleep.h"
#include "../stages/unsigned_to_signed.h"
#include "../stages/volume_lock.h"
#include "../stages/window.h"
#include "follow.h"

/* ---- conditions of entries ---- */

/* Returns true when resampling is due in a whole step that counts as `counts_as` steps. */
SPRINGLS__FN bool springls__resample_due(const springls_context *ctx, int counts_as)
{
    const int period = ctx->model.params.resample_period;
    return ctx->iteration % period + counts_as >= period;
}

SPRINGLS__FN bool springls__locks_volume(const springls_context *ctx) { return ctx->model.params.volume_lock != 0; }

/* Returns true when volumes are to be locked that have not been measured yet. */
SPRINGLS__FN bool springls__lock_is_new(const springls_context *ctx)
{
    return springls__locks_volume(ctx) && !ctx->volumes_locked;
}

/* Returns true when components are followed without keeping their volumes. */
SPRINGLS__FN bool springls__follows_components(const springls_context *ctx)
{
    return springls__components_enabled(ctx) && !springls__locks_volume(ctx);
}

/* Returns true when contract will use phi as it was before the springls moved. */
SPRINGLS__FN bool springls__needs_phi_before(const springls_context *ctx)
{
    return !ctx->step.desc.one_to_one && !ctx->model.params.resample_last && springls__resample_due(ctx, 1);
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

/* Returns true when this step adds or removes springls, so that shares of the surface change. */
SPRINGLS__FN bool springls__covers_again(const springls_context *ctx)
{
    return ctx->model.params.cover && ctx->model.params.relax_iterations > 0 && !ctx->step.desc.one_to_one
        && (ctx->step.resamples || ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC);
}

/* Returns true when a flow alone moves springls, their vertices too: triangles turn as the surface does. */
SPRINGLS__FN bool springls__vertices_flow(const springls_context *ctx)
{
    const springls_forces *forces = &ctx->step.forces;
    return springls__has_velocity(forces) && !springls__has_pressure(forces) && forces->curvature_weight == 0.0f
        && ctx->model.params.vertex_velocity && ctx->model.params.curvature == 0.0f;
}

/* Returns true when relax and keep_edges may wait until springls are resampled: a velocity alone moves springls, and turns them as
   it turns the surface. */
SPRINGLS__FN bool springls__may_relax_later(const springls_context *ctx)
{
    const springls_step_desc *desc = &ctx->step.desc;
    return ctx->model.params.cover && desc->mode == SPRINGLS_MODE_FLUID && !desc->one_to_one && springls__vertices_flow(ctx);
}

/* Returns true when relax runs whole, shares of the surface too, before phi follows. With params.cover it runs so after resampling
   instead, or waits for that while a flow turns the springls. */
SPRINGLS__FN bool springls__relaxes(const springls_context *ctx)
{
    return !springls__covers_again(ctx) && !springls__may_relax_later(ctx);
}

SPRINGLS__FN bool springls__phi_is_from_springls(const springls_context *ctx) { return ctx->step.phi_from_springls; }

/* Returns true when the step in progress may leave phi behind: nothing in it reads phi, or the normals that relax keeps. */
SPRINGLS__FN bool springls__may_be_lazy(const springls_context *ctx)
{
    const springls_params *params = &ctx->model.params;
    const springls_step_desc *desc = &ctx->step.desc;
    const springls_forces *forces = &ctx->step.forces;
    return params->lazy_distance > 0.0f && desc->mode == SPRINGLS_MODE_FLUID && !desc->stop_at_topology
        && params->carry_level_set && params->evolve_iterations == 0 && params->curvature == 0.0f && params->resample_last
        && params->topology == SPRINGLS_TOPOLOGY_FREE && params->contact == SPRINGLS_CONTACT_MERGE
        && !springls__components_enabled(ctx) && forces->curvature_weight == 0.0f && !springls__has_pressure(forces);
}

/* Returns true when phi has been left behind and the step in progress needs it, or moves springls so much further than those
   before that phi could not be carried along. */
SPRINGLS__FN bool springls__must_catch_up(const springls_context *ctx)
{
    return springls__phi_lags(ctx)
        && (!springls__may_be_lazy(ctx) || ctx->lag + ctx->step.expected > ctx->model.grid.far_value);
}

/* Returns how far springls may move before phi follows, voxels. The sides of thin sheets and gaps may move against each other,
   and phi would lose what is between them: they are followed more closely. */
SPRINGLS__FN float springls__lazy_limit(const springls_context *ctx)
{
    const float opposed_limit = 0.15f, margin = 0.5f; /* margin: to the end of the band that phi is known in */
    float limit = springls__min(ctx->model.params.lazy_distance, ctx->model.grid.far_value - margin);
    return ctx->opposed ? springls__min(opposed_limit, limit) : limit;
}

/* How far springls may turn or stretch before phi follows: see springls__turned2. */
#define SPRINGLS__LAZY_TURN 0.18f

/* Returns true when springls may move and turn once more, as far as just now, before phi follows. */
SPRINGLS__FN bool springls__stays_lazy(const springls_context *ctx)
{
    const springls__motion *motion = &ctx->motion;
    return springls__may_be_lazy(ctx) && motion->moved > 0.0f && ctx->lag + 2.0f * motion->moved <= springls__lazy_limit(ctx)
        && ctx->lag_turned + 2.0f * motion->turned <= SPRINGLS__LAZY_TURN;
}

/* Returns true when edges are to be found again, and springls kept at them. */
SPRINGLS__FN bool springls__keeps_edges(const springls_context *ctx)
{
    return ctx->model.params.keep_edges && ctx->model.set.at_edges > 0
        && (ctx->step.resamples || !springls__may_relax_later(ctx));
}

SPRINGLS__FN bool springls__carries(const springls_context *ctx)
{
    return ctx->model.params.carry_level_set && !ctx->step.phi_from_springls;
}

SPRINGLS__FN bool springls__iterates(const springls_context *ctx) { return ctx->step.iterations_left > 0; }

/* Returns true when phi is to be projected after eq. 23. Carrying phi along projects it too, unless eq. 23 follows. */
SPRINGLS__FN bool springls__projects(const springls_context *ctx)
{
    return ctx->model.params.project_level_set && !(springls__carries(ctx) && ctx->model.params.evolve_iterations == 0);
}

/* ---- between stages ---- */

enum { SPRINGLS__MAX_SUBSTEPS = 10000 };

/* Returns in *dt the length of the next sub-step: the time that is left, cut into parts as equal as the force permits. Fails
   when the step needs too many sub-steps, or one so short that the time does not change. */
SPRINGLS__FN springls_status springls__choose_substep(springls_context *ctx, float *dt)
{
    springls__stepping *step = &ctx->step;
    *dt = step->longest_substep;
    if (step->time_left <= 0.0f) return SPRINGLS_OK;
    *dt = step->time_left / (springls__floor(step->time_left / step->longest_substep * 0.9999f) + 1.0f);
    if (ctx->time + (double)*dt == ctx->time)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: at time %g a sub-step of %g does not change the time",
                              ctx->time, (double)*dt);
    if (step->substeps++ == SPRINGLS__MAX_SUBSTEPS)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps: the force has grown",
                              SPRINGLS__MAX_SUBSTEPS);
    return SPRINGLS_OK;
}

/* Returns the motion by eq. 22's curvature term in a sub-step, voxel^2, for springls that carry phi: as in one iteration of
   eq. 23, but by at most half of max_displacement (0: no limit). Where they do not, evolve moves phi instead, and it is 0. */
SPRINGLS__FN float springls__smoothing(const springls_params *params, float max_displacement)
{
    float smoothing = params->carry_level_set ? params->evolve_step * params->curvature : 0.0f;
    float limit = 0.25f * max_displacement; /* curvature is clamped at 2 */
    return max_displacement > 0.0f ? springls__clamp(smoothing, -limit, limit) : smoothing;
}

SPRINGLS__FN springls_status springls__substep_begin(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    float dt;
    SPRINGLS__TRY(springls__choose_substep(ctx, &dt));
    if (!ctx->model.params.volume_lock) {
        springls__clear_target_volumes(ctx);
        ctx->stats.volume_correction = 0.0f;
    }
    SPRINGLS__TRY(springls__motion_begin(ctx, &step->forces, (float)ctx->time, dt));
    ctx->motion.max_displacement = step->time_left > 0.0f ? step->longest_displacement * 1.0001f : 0.0f;
    ctx->motion.stop_at_topology = step->desc.stop_at_topology;
    if (step->desc.mode != SPRINGLS_MODE_ADVECT_ONLY)
        ctx->motion.rule.smoothing = springls__smoothing(&ctx->model.params, step->desc.max_displacement);
    return SPRINGLS_OK;
}

/* Returns how far a particle may move in a sub-step, voxels: max_displacement. Where phi may stay behind, an equal part of the lazy
   limit, so that phi follows just at that limit; not where the part is much shorter, which would cost more sub-steps than it
   saves, nor where springls turn so much that no such sub-step would be lazy, by the motion that was measured last. */
SPRINGLS__FN float springls__longest_displacement(const springls_context *ctx)
{
    const float even = 0.995f;  /* parts differ a little */
    const float enough = 0.75f; /* of max_displacement */
    const springls__motion *motion = &ctx->motion;
    float longest = ctx->step.desc.max_displacement, limit = even * springls__lazy_limit(ctx), part;
    if (!springls__may_be_lazy(ctx) || limit <= longest) return longest;
    part = limit / (springls__floor(limit / longest * 0.9999f) + 1.0f);
    if (part < enough * longest || 2.0f * part * motion->turned > SPRINGLS__LAZY_TURN * motion->moved) return longest;
    return part;
}

/* Ends the step, or begins another sub-step: as long as the displacement of the last one permits, at most half as long again. */
SPRINGLS__FN springls_status springls__substep_end(springls_context *ctx)
{
    const float growth = 1.5f;
    springls__stepping *step = &ctx->step;
    float longest, moved = ctx->motion.moved;
    if (step->time_left == 0.0f) {
        step->active = false;
        return SPRINGLS_OK;
    }
    longest = springls__longest_displacement(ctx);
    step->time_left = (float)(step->end_time - ctx->time);
    step->longest_substep = ctx->motion.dt * (growth * moved > longest ? longest / moved : growth);
    step->longest_displacement = longest;
    step->expected = springls__min(growth * moved, longest);
    if (step->time_left > 1e-6f * step->desc.dt) {
        step->next = step->algorithm;
        return SPRINGLS_OK;
    }
    ctx->time = step->end_time;
    step->active = false;
    return SPRINGLS_OK;
}

/* The rest of a lazy sub-step, after its springls have moved. */
static const springls__step_entry springls__lazy_end[] = { { SPRINGLS__ENTRY_RUN, -1, NULL, springls__substep_end } };

/* Returns how many steps of resample_period a whole step counts as: the voxels that springls have moved since phi last followed,
   over those of a usual step, rounded; at least 1. Without resample_last always 1: contract needs phi from before the motion. */
SPRINGLS__FN int springls__counts_as(const springls_context *ctx)
{
    const float usual = 2.0f, rounding = 0.45f; /* below 0.5: 3 voxels are one step, 3.5 are two */
    float moved = springls__phi_lags(ctx) ? ctx->lag + ctx->motion.moved : ctx->motion.moved;
    return ctx->model.params.resample_last ? (int)springls__max(1.0f, moved / usual + rounding) : 1;
}

/* Counts a whole step, and decides whether springls are resampled in it. */
SPRINGLS__FN void springls__count_whole_step(springls_context *ctx)
{
    const int counts_as = springls__counts_as(ctx);
    const bool due = springls__resample_due(ctx, counts_as);
    ctx->iteration = due ? 0 : ctx->iteration + counts_as;
    ctx->step.resamples = due && !ctx->step.desc.one_to_one;
}

/* Counts the sub-step whose springls have just moved, and decides how it goes on. */
SPRINGLS__FN springls_status springls__substep_advanced(springls_context *ctx)
{
    ctx->time += (double)ctx->motion.dt;
    ctx->stats.steps++;
    ctx->model.set.step = (uint32_t)ctx->stats.steps & 0x3fffffffu;
    if (springls__stays_lazy(ctx)) {
        ctx->lag += ctx->motion.moved;
        ctx->lag_turned += ctx->motion.turned;
        ctx->step.next = springls__lazy_end;
        return SPRINGLS_OK;
    }
    if (ctx->step.desc.mode == SPRINGLS_MODE_ADVECT_ONLY) ctx->lag = FLT_MAX;
    springls__count_whole_step(ctx);
    ctx->step.phi_from_springls = ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC;
    return SPRINGLS_OK;
}

/* Wakes all bricks. */
SPRINGLS__FN springls_status springls__wake(springls_context *ctx)
{
    springls__wake_all(ctx);
    return SPRINGLS_OK;
}

/* Finds which bricks the rest of the sub-step works in. */
SPRINGLS__FN springls_status springls__rouse(springls_context *ctx)
{
    if (ctx->motion.still && ctx->at_rest) return SPRINGLS_OK;
    return springls__find_awake(ctx, ctx->motion.still ? SPRINGLS__STIR_AWAY : SPRINGLS__STIR_MOVING);
}

SPRINGLS__FN bool springls__is_at_rest(const springls_context *ctx) { return ctx->at_rest; }

/* Decides whether springls have moved further than phi can be carried along: beyond the band that phi is known in, or out of all
   bricks that a moved window has kept. */
SPRINGLS__FN springls_status springls__check_displacement(springls_context *ctx)
{
    const float certain = 0.9f; /* share of the band: springls no further away are within it, however places are rounded */
    float displacement = 0.0f;
    if (!ctx->model.params.carry_level_set) return SPRINGLS_OK;
    if (ctx->away > certain * ctx->model.grid.far_value) SPRINGLS__TRY(springls__displacement_since_phi(ctx, &displacement));
    ctx->step.phi_from_springls = displacement > ctx->model.grid.far_value || springls__has_lost_level_set(ctx);
    if (ctx->step.phi_from_springls) springls__wake_all(ctx);
    return SPRINGLS_OK;
}

/* Decides how often eq. 23 is applied: at least three times where phi has just been computed from springls alone, because it
   closes the gaps between them. */
SPRINGLS__FN springls_status springls__follow_begin(springls_context *ctx)
{
    const int enough = 3;
    ctx->step.iterations_left = ctx->model.params.evolve_iterations;
    if (ctx->model.params.carry_level_set && ctx->step.phi_from_springls)
        ctx->step.iterations_left = springls__imax(ctx->step.iterations_left, enough);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__iteration_done(springls_context *ctx)
{
    ctx->step.iterations_left--;
    return SPRINGLS_OK;
}

enum { SPRINGLS__PLAN_MEASURE, SPRINGLS__PLAN_DECIDE };

/* Decides whether the step is cut into sub-steps, and how long the first one may be. */
SPRINGLS__FN springls_status springls__plan_step(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    const springls_step_desc *desc = &step->desc;
    float speed = 0.0f, limit = desc->max_displacement > 0.0f ? desc->max_displacement : ctx->model.params.d_max;
    step->time_left = 0.0f;
    step->longest_substep = desc->dt;
    step->expected = 0.0f;
    step->next = step->algorithm;
    if (desc->dt > 0.0f && desc->max_displacement == 0.0f) return SPRINGLS_OK;
    if (ctx->work.phase == SPRINGLS__PLAN_MEASURE) {
        SPRINGLS__TRY(springls__max_speed_begin(ctx, &step->forces, (float)ctx->time));
        return springls__next_phase(ctx, SPRINGLS__PLAN_DECIDE);
    }
    SPRINGLS__TRY(springls__max_speed_end(ctx, "step", &speed));
    if (desc->dt == 0.0f) { /* section 4.8: dt = d_max / f_max */
        step->expected = limit;
        step->longest_substep = speed > 1e-6f ? limit / speed : 0.0f;
        return SPRINGLS_OK;
    }
    limit = step->longest_displacement = springls__longest_displacement(ctx);
    step->expected = springls__min(speed * desc->dt, limit);
    if (!(speed * desc->dt <= (float)SPRINGLS__MAX_SUBSTEPS * limit))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps of max_displacement",
                              SPRINGLS__MAX_SUBSTEPS);
    step->time_left = desc->dt;
    step->end_time = ctx->time + (double)desc->dt;
    step->longest_substep = speed * desc->dt > limit ? limit / speed : desc->dt;
    return SPRINGLS_OK;
}

/* ---- the tables ---- */

/* Entries: DO has no clock, STAGE has that of its stage; _IF: only where the condition is true. */
#define SPRINGLS__DO(run) { SPRINGLS__ENTRY_RUN, -1, NULL, run }
#define SPRINGLS__DO_IF(when, run) { SPRINGLS__ENTRY_RUN, -1, when, run }
#define SPRINGLS__STAGE(name, run) { SPRINGLS__ENTRY_RUN, SPRINGLS_STAGE_##name, NULL, run }
#define SPRINGLS__STAGE_IF(when, name, run) { SPRINGLS__ENTRY_RUN, SPRINGLS_STAGE_##name, when, run }
#define SPRINGLS__REPEAT_WHILE(when) { SPRINGLS__ENTRY_REPEAT_WHILE, -1, when, NULL }
#define SPRINGLS__END_REPEAT { SPRINGLS__ENTRY_END_REPEAT, -1, NULL, NULL }

#define SPRINGLS__BEGIN_SUBSTEP                                                              \
    SPRINGLS__DO(springls__substep_begin),                                                   \
    SPRINGLS__DO_IF(springls__must_catch_up, springls__rouse_moved),                         \
    SPRINGLS__STAGE_IF(springls__must_catch_up, PROJECT, springls__carry_level_set),         \
    SPRINGLS__DO_IF(springls__contact_bodies_are_new, springls__find_contact_bodies),        \
    SPRINGLS__STAGE_IF(springls__components_outdated, COMPONENTS, springls__find_present_components), \
    SPRINGLS__STAGE_IF(springls__lock_is_new, VOLUME_LOCK, springls__volume_lock)
#define SPRINGLS__MOVE                                                                       \
    SPRINGLS__STAGE(ADVECT, springls__advect),                                               \
    SPRINGLS__DO_IF(springls__window_follows, springls__follow_model),                       \
    SPRINGLS__DO(springls__substep_advanced)
/* Makes the level set follow the springls. */
#define SPRINGLS__FOLLOW                                                                     \
    SPRINGLS__DO(springls__follow_begin),                                                    \
    SPRINGLS__STAGE_IF(springls__keeps_edges, KEEP_EDGES, springls__keep_edges),             \
    SPRINGLS__STAGE_IF(springls__carries, PROJECT, springls__carry_level_set),               \
    SPRINGLS__REPEAT_WHILE(springls__iterates),                                              \
        SPRINGLS__STAGE(EVOLVE, springls__evolve),                                           \
        SPRINGLS__STAGE(REBUILD, springls__rebuild),                                         \
        SPRINGLS__DO(springls__iteration_done),                                              \
    SPRINGLS__END_REPEAT,                                                                    \
    SPRINGLS__STAGE_IF(springls__projects, PROJECT, springls__project_level_set)
#define SPRINGLS__END_SUBSTEP                                                                \
    SPRINGLS__STAGE_IF(springls__locks_volume, VOLUME_LOCK, springls__volume_lock),          \
    SPRINGLS__STAGE_IF(springls__follows_components, COMPONENTS, springls__find_present_components), \
    SPRINGLS__DO(springls__substep_end)

static const springls__step_entry springls__plan[] = { SPRINGLS__DO(springls__plan_step) };

static const springls__step_entry springls__fluid[] = { /* Algorithm 2 */
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__DO_IF(springls__needs_phi_before, springls__sample_phi),
    SPRINGLS__MOVE,
    SPRINGLS__DO(springls__rouse),
    SPRINGLS__DO_IF(springls__is_at_rest, springls__substep_end),
    SPRINGLS__STAGE_IF(springls__relaxes, RELAX, springls__relax),
    SPRINGLS__STAGE_IF(springls__covers_again, RELAX, springls__relax_normals),
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
    SPRINGLS__STAGE_IF(springls__covers_again, RELAX, springls__cover),
    SPRINGLS__END_SUBSTEP
};

static const springls__step_entry springls__elastic[] = { /* Algorithm 3 */
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__MOVE,
    SPRINGLS__DO(springls__wake),
    SPRINGLS__STAGE(UNSIGNED_TO_SIGNED, springls__unsigned_to_signed),
    SPRINGLS__FOLLOW,
    SPRINGLS__STAGE_IF(springls__relaxes, RELAX, springls__relax),
    SPRINGLS__STAGE_IF(springls__covers_again, RELAX, springls__relax_normals),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, FILL_GAPS, springls__fill_gaps),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, CONTRACT, springls__contract_now),
    SPRINGLS__STAGE_IF(springls__not_one_to_one, RESAMPLE, springls__resample),
    SPRINGLS__STAGE_IF(springls__covers_again, RELAX, springls__cover),
    SPRINGLS__END_SUBSTEP
};

static const springls__step_entry springls__advect_only[] = {
    SPRINGLS__BEGIN_SUBSTEP,
    SPRINGLS__MOVE,
    SPRINGLS__DO(springls__substep_end)
};

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

SPRINGLS__FN const springls__step_entry *springls__algorithm_of(springls_mode mode)
{
    if (mode == SPRINGLS_MODE_FLUID) return springls__fluid;
    return mode == SPRINGLS_MODE_ELASTIC ? springls__elastic : springls__advect_only;
}

/* Returns the entry that runs next, at or after `entry`: follows loops and passes over entries whose condition is false. */
SPRINGLS__FN const springls__step_entry *springls__due_entry(const springls_context *ctx, const springls__step_entry *entry)
{
    for (;; entry++) {
        if (entry->kind == SPRINGLS__ENTRY_END_REPEAT)
            while (entry->kind != SPRINGLS__ENTRY_REPEAT_WHILE) entry--;
        if (entry->kind == SPRINGLS__ENTRY_REPEAT_WHILE && !(entry->when)(ctx))
            while (entry->kind != SPRINGLS__ENTRY_END_REPEAT) entry++;
        if (entry->kind == SPRINGLS__ENTRY_RUN && (!entry->when || (entry->when)(ctx))) return entry;
    }
}

#endif
