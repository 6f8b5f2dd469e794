/* algorithm_tables.h - Algorithms 2 and 3 as tables of stages, the step that runs them once for each sub-step, and the work between the
   stages. */
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
    const springls_step_desc *desc = &ctx->step.desc;
    return desc->mode == SPRINGLS_MODE_FLUID && !desc->one_to_one && !ctx->model.params.resample_last
        && springls__resample_due(ctx, 1);
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

/* Returns true while eq. 23 is to be applied again: at least three times where phi has just been computed from springls alone, because
   it closes the gaps between them. */
SPRINGLS__FN bool springls__iterates(const springls_context *ctx)
{
    const int enough = 3;
    int iterations = ctx->model.params.evolve_iterations;
    if (ctx->model.params.carry_level_set && ctx->step.phi_from_springls) iterations = springls__imax(iterations, enough);
    return springls__round(ctx) < iterations;
}

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
   eq. 23, but by at most half of max_displacement. Where they do not, evolve moves phi instead, and it is 0. */
SPRINGLS__FN float springls__smoothing(const springls_params *params, float max_displacement)
{
    float smoothing = params->carry_level_set ? params->evolve_step * params->curvature : 0.0f;
    float limit = 0.25f * max_displacement; /* curvature is clamped at 2 */
    return springls__clamp(smoothing, -limit, limit);
}

/* Returns how far a particle may move in a sub-step of the step that is described, voxels; FLT_MAX: dt is never divided. Unless the
   description has a number of its own, it suits the parameters: phi that is carried along is known in a band around the surface,
   while eq. 23 finds springls again within d_max. */
SPRINGLS__FN float springls__displacement_limit(const springls_params *params, const springls_step_desc *desc)
{
    if (desc->max_displacement > 0.0f) return desc->max_displacement;
    if (desc->max_displacement < 0.0f && desc->dt > 0.0f) return FLT_MAX;
    return params->carry_level_set ? 2.0f : params->d_max;
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
        ctx->motion.rule.smoothing = springls__smoothing(&ctx->model.params, step->max_displacement);
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
    float longest = ctx->step.max_displacement, limit = even * springls__lazy_limit(ctx), part;
    if (!springls__may_be_lazy(ctx) || limit <= longest) return longest;
    part = limit / (springls__floor(limit / longest * 0.9999f) + 1.0f);
    if (part < enough * longest || 2.0f * part * motion->turned > SPRINGLS__LAZY_TURN * motion->moved) return longest;
    return part;
}

/* Ends the step, or chooses another sub-step: as long as the displacement of the last one permits, at most half as long again. */
SPRINGLS__FN springls_status springls__substep_end(springls_context *ctx)
{
    const float growth = 1.5f;
    springls__stepping *step = &ctx->step;
    float longest, moved = ctx->motion.moved;
    if (step->time_left == 0.0f) return SPRINGLS_OK;
    longest = springls__longest_displacement(ctx);
    step->time_left = (float)(step->end_time - ctx->time);
    step->longest_substep = ctx->motion.dt * (growth * moved > longest ? longest / moved : growth);
    step->longest_displacement = longest;
    step->expected = springls__min(growth * moved, longest);
    if (step->time_left > 1e-6f * step->desc.dt) return SPRINGLS_OK;
    ctx->time = step->end_time;
    step->time_left = 0.0f;
    return SPRINGLS_OK;
}

/* Returns true when a step's first sub-step, or another one, is to be done. */
SPRINGLS__FN bool springls__step_goes_on(const springls_context *ctx)
{
    return springls__round(ctx) == 0 || ctx->step.time_left > 0.0f;
}

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
    ctx->step.is_lazy = springls__stays_lazy(ctx);
    if (ctx->step.is_lazy) {
        ctx->lag += ctx->motion.moved;
        ctx->lag_turned += ctx->motion.turned;
        return SPRINGLS_OK;
    }
    if (ctx->step.desc.mode == SPRINGLS_MODE_ADVECT_ONLY) ctx->lag = FLT_MAX;
    springls__count_whole_step(ctx);
    ctx->step.phi_from_springls = ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC;
    return SPRINGLS_OK;
}

/* Returns true in a sub-step by Algorithm 2 that is not lazy. */
SPRINGLS__FN bool springls__is_fluid(const springls_context *ctx)
{
    return ctx->step.desc.mode == SPRINGLS_MODE_FLUID && !ctx->step.is_lazy;
}

SPRINGLS__FN bool springls__is_elastic(const springls_context *ctx) { return ctx->step.desc.mode == SPRINGLS_MODE_ELASTIC; }

/* Wakes all bricks. */
SPRINGLS__FN springls_status springls__wake(springls_context *ctx)
{
    springls__wake_all(ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__is_not_at_rest(const springls_context *ctx) { return !ctx->at_rest; }

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

/* Returns true when the length of a step's sub-steps follows from the speed of the springls. */
SPRINGLS__FN bool springls__needs_speed(const springls_context *ctx)
{
    return ctx->step.desc.dt == 0.0f || ctx->step.max_displacement < FLT_MAX;
}

/* Begins a step: as one sub-step, unless springls__cut_step finds that it is several. */
SPRINGLS__FN springls_status springls__plan_step(springls_context *ctx)
{
    ctx->step.time_left = 0.0f;
    ctx->step.longest_substep = ctx->step.desc.dt;
    ctx->step.expected = 0.0f;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__measure_speed(springls_context *ctx)
{
    return springls__max_speed_begin(ctx, &ctx->step.forces, (float)ctx->time, springls__voxel_lengths());
}

/* Decides whether the step is cut into sub-steps, and how long the first one may be. */
SPRINGLS__FN springls_status springls__cut_step(springls_context *ctx)
{
    springls__stepping *step = &ctx->step;
    const springls_step_desc *desc = &step->desc;
    float speed = 0.0f, limit = step->max_displacement;
    SPRINGLS__TRY(springls__max_speed_end(ctx, "step", &speed));
    if (desc->dt == 0.0f) { /* section 4.8: dt = d_max / f_max */
        step->expected = speed > 1e-6f ? limit : 0.0f;
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

/* The level set follows the springls. */
static const springls__entry springls__follow_motion[] = {
    SPRINGLS__IF(springls__keeps_edges) SPRINGLS__STAGE(KEEP_EDGES, springls__keep_edges) SPRINGLS__END
    SPRINGLS__IF(springls__carries) SPRINGLS__STAGE(PROJECT, springls__carry_level_set) SPRINGLS__END
    SPRINGLS__REPEAT_WHILE(springls__iterates)
        SPRINGLS__STAGE(EVOLVE, springls__evolve) /* section 4.5 */
        SPRINGLS__STAGE(REBUILD, springls__rebuild)
    SPRINGLS__END
    SPRINGLS__IF(springls__projects) SPRINGLS__STAGE(PROJECT, springls__project_level_set) SPRINGLS__END
SPRINGLS__END };

static const springls__entry springls__end_of_substep[] = {
    SPRINGLS__IF(springls__locks_volume) SPRINGLS__STAGE(VOLUME_LOCK, springls__lock_volumes) SPRINGLS__END
    SPRINGLS__IF(springls__follows_components) SPRINGLS__STAGE(COMPONENTS, springls__components) SPRINGLS__END
SPRINGLS__END };

/* Algorithm 2, after advect. */
static const springls__entry springls__algorithm_2[] = {
    SPRINGLS__IF(springls__relaxes) SPRINGLS__STAGE(RELAX, springls__relax) SPRINGLS__END /* section 4.3 */
    SPRINGLS__IF(springls__covers_again) SPRINGLS__STAGE(RELAX, springls__relax_normals) SPRINGLS__END
    SPRINGLS__IF(springls__resamples_first)
        SPRINGLS__STAGE(CONTRACT, springls__contract) /* section 4.6, as resample */
        SPRINGLS__STAGE(RESAMPLE, springls__resample)
        SPRINGLS__STAGE(RELAX, springls__relax)
    SPRINGLS__END
    SPRINGLS__DO(springls__check_displacement)
    SPRINGLS__IF(springls__phi_is_from_springls)
        SPRINGLS__STAGE(UNSIGNED_TO_SIGNED, springls__unsigned_to_signed)
    SPRINGLS__END
    SPRINGLS__CALL(springls__follow_motion)
    SPRINGLS__IF(springls__resamples) SPRINGLS__CALL(springls__orient) SPRINGLS__END
    SPRINGLS__IF(springls__resamples_last)
        SPRINGLS__STAGE(CONTRACT, springls__contract_now)
        SPRINGLS__STAGE(RESAMPLE, springls__resample)
    SPRINGLS__END
    SPRINGLS__IF(springls__resamples) SPRINGLS__STAGE(FILL_GAPS, springls__fill_gaps) SPRINGLS__END /* section 4.4 */
    SPRINGLS__IF(springls__covers_again) SPRINGLS__STAGE(RELAX, springls__cover) SPRINGLS__END
    SPRINGLS__CALL(springls__end_of_substep)
SPRINGLS__END };

/* Algorithm 3, after advect. */
static const springls__entry springls__algorithm_3[] = {
    SPRINGLS__DO(springls__wake)
    SPRINGLS__STAGE(UNSIGNED_TO_SIGNED, springls__unsigned_to_signed)
    SPRINGLS__CALL(springls__follow_motion)
    SPRINGLS__IF(springls__relaxes) SPRINGLS__STAGE(RELAX, springls__relax) SPRINGLS__END
    SPRINGLS__IF(springls__covers_again) SPRINGLS__STAGE(RELAX, springls__relax_normals) SPRINGLS__END
    SPRINGLS__IF(springls__not_one_to_one)
        SPRINGLS__STAGE(FILL_GAPS, springls__fill_gaps)
        SPRINGLS__STAGE(CONTRACT, springls__contract_now)
        SPRINGLS__STAGE(RESAMPLE, springls__resample)
    SPRINGLS__END
    SPRINGLS__IF(springls__covers_again) SPRINGLS__STAGE(RELAX, springls__cover) SPRINGLS__END
    SPRINGLS__CALL(springls__end_of_substep)
SPRINGLS__END };

static const springls__entry springls__step[] = {
    SPRINGLS__DO(springls__plan_step)
    SPRINGLS__IF(springls__needs_speed)
        SPRINGLS__DO(springls__measure_speed)
        SPRINGLS__DO(springls__cut_step)
    SPRINGLS__END
    SPRINGLS__REPEAT_WHILE(springls__step_goes_on)
        SPRINGLS__DO(springls__substep_begin)
        SPRINGLS__IF(springls__must_catch_up)
            SPRINGLS__CALL(springls__wake_moved)
            SPRINGLS__STAGE(PROJECT, springls__carry_level_set)
        SPRINGLS__END
        SPRINGLS__IF(springls__contact_bodies_are_new) SPRINGLS__DO(springls__find_contact_bodies) SPRINGLS__END
        SPRINGLS__IF(springls__components_outdated) SPRINGLS__STAGE(COMPONENTS, springls__components) SPRINGLS__END
        SPRINGLS__IF(springls__lock_is_new) SPRINGLS__STAGE(VOLUME_LOCK, springls__lock_volumes) SPRINGLS__END
        SPRINGLS__IF(springls__needs_phi_before) SPRINGLS__KERNEL(sample_phi, SPRINGLS) SPRINGLS__END
        SPRINGLS__STAGE(ADVECT, springls__advect) /* section 4.2 */
        SPRINGLS__IF(springls__window_follows) SPRINGLS__DO(springls__follow_model) SPRINGLS__END
        SPRINGLS__DO(springls__substep_advanced)
        SPRINGLS__IF(springls__is_fluid)
            SPRINGLS__CALL(springls__wake_moving)
            SPRINGLS__IF(springls__is_not_at_rest) SPRINGLS__CALL(springls__algorithm_2) SPRINGLS__END
        SPRINGLS__END
        SPRINGLS__IF(springls__is_elastic) SPRINGLS__CALL(springls__algorithm_3) SPRINGLS__END
        SPRINGLS__DO(springls__substep_end)
    SPRINGLS__END
SPRINGLS__END };

#endif
