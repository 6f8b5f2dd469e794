/* advect.h - moves springls by the forces (section 4.2, eq. 1 and 2): by a kernel where a device can evaluate them, else block by
   block (forces.h). */
#ifndef SPRINGLS__STAGES_ADVECT_H
#define SPRINGLS__STAGES_ADVECT_H

#include "../runtime/finite.h"
#include "../../kernels_embed/stages/advect.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "forces.h"

/* Voxels, the largest motion of one advect in a window that follows: further out a float does not resolve a 16th of a voxel. */
enum { SPRINGLS__FURTHEST_MOTION = 1000000 };

SPRINGLS__FN bool springls__has_region(const springls_forces *forces)
{
    int k;
    for (k = 0; k < 3; k++)
        if (forces->region_lower[k] != 0.0f || forces->region_upper[k] != 0.0f) return true;
    return false;
}

/* Finds the box of voxels that holds the region of the forces: that of its corners where it is given in the world. */
SPRINGLS__FN void springls__region_box(const springls_context *ctx, const springls_forces *forces, springls__v3 *lower,
                                       springls__v3 *upper)
{
    const float *first = forces->region_lower, *last = forces->region_upper;
    int corner;
    if (!springls__forces_in_world(ctx, forces)) {
        *lower = springls__from_lattice(&ctx->window, springls__load3(first));
        *upper = springls__from_lattice(&ctx->window, springls__load3(last));
        return;
    }
    *lower = *upper = springls__world_to_voxel(ctx, first);
    for (corner = 1; corner < 8; corner++) {
        const float world[3] = { corner & 1 ? last[0] : first[0], corner & 2 ? last[1] : first[1], corner & 4 ? last[2] : first[2] };
        const springls__v3 x = springls__world_to_voxel(ctx, world);
        *lower = springls__v3_make(springls__min(lower->x, x.x), springls__min(lower->y, x.y), springls__min(lower->z, x.z));
        *upper = springls__v3_make(springls__max(upper->x, x.x), springls__max(upper->y, x.y), springls__max(upper->z, x.z));
    }
}

/* Finds the region that forces act in: everywhere if none is given. */
SPRINGLS__FN void springls__region_prepare(const springls_context *ctx, const springls_forces *forces, springls__motion *motion)
{
    motion->has_region = springls__has_region(forces);
    motion->rule.window = springls__to_lattice(&ctx->window, springls__v3_make(0.0f, 0.0f, 0.0f));
    motion->rule.region_lower = springls__v3_make(-FLT_MAX, -FLT_MAX, -FLT_MAX);
    motion->rule.region_upper = springls__v3_make(FLT_MAX, FLT_MAX, FLT_MAX);
    if (motion->has_region) springls__region_box(ctx, forces, &motion->rule.region_lower, &motion->rule.region_upper);
}

/* Warns of a region that lies outside the grid: most likely it is given in other units. */
SPRINGLS__FN void springls__warn_of_region(const springls_context *ctx, const springls_forces *forces)
{
    const int *size = ctx->model.grid.size;
    const float *first = forces->region_lower, *last = forces->region_upper;
    springls__v3 lower, upper;
    if (!springls__has_region(forces)) return;
    springls__region_box(ctx, forces, &lower, &upper);
    if (lower.x < (float)size[0] && lower.y < (float)size[1] && lower.z < (float)size[2] && upper.x > -1.0f && upper.y > -1.0f
        && upper.z > -1.0f)
        return;
    springls__log(ctx, 2, "forces: the region from (%g, %g, %g) to (%g, %g, %g), in %s, lies outside the grid: nothing moves",
                  (double)first[0], (double)first[1], (double)first[2], (double)last[0], (double)last[1], (double)last[2],
                  forces->voxel_units ? "voxels, since voxel_units is true" : "world units");
}

/* Begins the motion by `forces` from `time` to time + dt. */
SPRINGLS__FN springls_status springls__motion_begin(springls_context *ctx, const springls_forces *forces, float time, float dt)
{
    springls__motion *motion = &ctx->motion;
    memset(motion, 0, sizeof *motion);
    motion->ctx = ctx;
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: forces is NULL");
    if (!springls__finite_float(dt)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: dt is %g, not finite", (double)dt);
    SPRINGLS__TRY(springls__check_forces(ctx, forces));
    motion->forces = *forces;
    motion->in_world = springls__forces_in_world(ctx, forces);
    motion->rule.pressure_weight = forces->pressure_weight != 0.0f ? forces->pressure_weight : 1.0f;
    motion->rule.has_velocity = forces->velocity || forces->velocity_batch;
    motion->rule.velocity_weight = forces->velocity_weight != 0.0f ? forces->velocity_weight : 1.0f;
    motion->affine_weight = forces->affine_weight != 0.0f ? forces->affine_weight : 1.0f;
    motion->rule.euler = forces->integrator == SPRINGLS_INTEGRATOR_EULER;
    motion->rule.curvature_weight = forces->curvature_weight;
    if (motion->in_world) motion->rule.curvature_weight /= ctx->smallest_spacing * ctx->smallest_spacing;
    motion->rule.curvature_span = springls__max(ctx->curvature_span, SPRINGLS__CURVATURE_SPAN);
    motion->time = time;
    motion->dt = dt;
    springls__region_prepare(ctx, forces, motion);
    springls__field_prepare(ctx, &forces->pressure_grid, 1, &motion->rule.pressure);
    springls__field_prepare(ctx, &forces->velocity_grid, 3, &motion->rule.velocity);
    return SPRINGLS_OK;
}

/* Writes the times of the Runge-Kutta stages into the rule. */
SPRINGLS__FN void springls__motion_times(springls__motion *motion)
{
    const float spread = motion->ctx->model.params.half_time_sampling ? 0.5f * motion->dt : motion->dt;
    motion->rule.dt = motion->dt;
    motion->rule.stage_time[0] = motion->time;
    motion->rule.stage_time[1] = motion->rule.stage_time[2] = motion->time + 0.5f * spread;
    motion->rule.stage_time[3] = motion->time + spread;
    motion->rule.stop_at_topology = motion->stop_at_topology;
}

/* Returns whether the forces act on a particle: it lies in their region. A box of the world may be oblique in voxels. */
SPRINGLS__FN bool springls__acts_on(const springls__motion *motion, springls__v3 p)
{
    const springls_forces *forces = &motion->forces;
    float world[3];
    if (!springls__in_force_region(motion->rule.region_lower, motion->rule.region_upper, p)) return false;
    if (!motion->in_world) return true;
    springls__voxel_to_world(motion->ctx, p, world);
    return springls__in_force_region(springls__load3(forces->region_lower), springls__load3(forces->region_upper),
                                     springls__load3(world));
}

/* Lists the springls in the region of the forces, ascending. With a fresh cell list, as in a model at rest, only the cells of the
   region are visited. */
SPRINGLS__FN springls_status springls__list_region(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    const springls__springl *s = ctx->model.set.s;
    int i;
    if (ctx->at_rest) SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, region_springls, ctx->model.set.count));
    motion->listed = springls__region_springls(&ctx->model);
    motion->count = 0;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(IDS) | SPRINGLS__BIT(UNBINNED)
                                             | SPRINGLS__BIT(TOP),
                                    SPRINGLS__ROLE_BIT(region_springls)));
    if (ctx->cells_fresh) {
        springls__cell_walk walk = springls__cell_walk_begin(&ctx->model, motion->rule.region_lower, motion->rule.region_upper);
        while ((i = springls__cell_walk_next(&ctx->model, &walk)) >= 0)
            if (springls__acts_on(motion, s[i].p)) motion->listed[motion->count++] = i;
        qsort(motion->listed, (size_t)motion->count, sizeof *motion->listed, springls__compare_int);
        return SPRINGLS_OK;
    }
    for (i = 0; i < ctx->model.set.count; i++)
        if (springls__acts_on(motion, s[i].p)) motion->listed[motion->count++] = i;
    return SPRINGLS_OK;
}

/* Displaces by callbacks and sampled fields, which needs the host's threads. Ends with a loop. */
SPRINGLS__FN springls_status springls__displace_in_blocks(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    bool reads_phi = motion->rule.curvature_weight != 0.0f || motion->rule.smoothing != 0.0f || motion->rule.stop_at_topology;
    uint64_t grid = reads_phi ? SPRINGLS__BIT(PHI) | SPRINGLS__BIT(TOP) : 0;
    const size_t floats = springls__block_floats();
    if (motion->has_region) SPRINGLS__TRY(springls__list_region(motion));
    if (motion->count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID) | SPRINGLS__BIT(ERROR) | grid,
                                    springls__kernels[SPRINGLS__KERNEL_displace].writes));
    SPRINGLS__TRY(springls__reserve_lanes(ctx, floats, springls__advect_blocks(motion), 1));
    springls__loop_over(ctx, springls__advect_blocks(motion), 1, floats, springls__advect_work, motion);
    return SPRINGLS_OK;
}

/* Finds how many particles springls__displace_all has moved, how far springls turn at most, and the largest displacement: negative
   where that of a point is not finite. Without particles to displace nothing is asked of the device, which may fail. */
SPRINGLS__FN void springls__displaced(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    springls__largest largest;
    if (motion->count == 0) {
        motion->moving = 0;
        motion->moved = motion->turned = 0.0f;
        motion->none = true;
        return;
    }
    springls__largest_later(ctx, SPRINGLS__COUNT_LARGEST, SPRINGLS__ROLE_ARRAY(displacement2), motion->count, SPRINGLS__MOVING2);
    springls__largest_later(ctx, SPRINGLS__COUNT_TURNING, SPRINGLS__ROLE_ARRAY(turning2), motion->count, FLT_MAX);
    largest = springls__largest_found(ctx, SPRINGLS__COUNT_LARGEST);
    motion->moved = largest.value < 1e18f ? springls__sqrt(largest.value) : -1.0f;
    motion->moving = largest.more;
    motion->turned = springls__sqrt(springls__largest_found(ctx, SPRINGLS__COUNT_TURNING).value);
    motion->none = largest.value == 0.0f
        && springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(motion_class), motion->count, SPRINGLS__MOTION_NONE) == motion->count;
}

/* Returns true when the device can evaluate the forces: samples, motion by curvature, and a velocity of which it has the text. */
SPRINGLS__FN bool springls__device_can_displace(const springls__motion *motion)
{
    const springls_forces *forces = &motion->forces;
    const springls_backend *backend = motion->ctx->backend;
    if (!motion->ctx->on_device || motion->in_world) return false;
    if (forces->pressure || forces->pressure_batch || forces->velocity_batch || springls__has_affine(forces)) return false;
    return !forces->velocity || (forces->velocity == backend->user_velocity && (backend->user_bytes == 0 || forces->user));
}

/* Sends a sampled field to the device, unless the same version of it is there. */
SPRINGLS__FN springls_status springls__field_to_device(springls_context *ctx, springls__array array,
                                                       const springls_sampled_field *given, const springls__field *field)
{
    springls_sampled_field *last = &ctx->on_device_field[array - SPRINGLS__ARRAY_FORCE_PRESSURE];
    size_t floats = (size_t)field->size[0] * (size_t)field->size[1] * (size_t)field->size[2] * (size_t)field->channels;
    if (!given->data) return SPRINGLS_OK;
    if (given->version && given->version == last->version && given->data == last->data
        && floats * sizeof(float) <= ctx->memory[array].device_bytes)
        return SPRINGLS_OK;
    SPRINGLS__TRY((ctx->backend->upload)(ctx, &ctx->memory[array], given->data, floats * sizeof(float)));
    *last = *given;
    return SPRINGLS_OK;
}

/* Sends what the kernel needs of the forces to the device. */
SPRINGLS__FN springls_status springls__forces_to_device(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    SPRINGLS__TRY(
        springls__field_to_device(ctx, SPRINGLS__ARRAY_FORCE_PRESSURE, &motion->forces.pressure_grid, &motion->rule.pressure));
    SPRINGLS__TRY(
        springls__field_to_device(ctx, SPRINGLS__ARRAY_FORCE_VELOCITY, &motion->forces.velocity_grid, &motion->rule.velocity));
    if (motion->rule.has_velocity && ctx->backend->user_bytes > 0)
        SPRINGLS__TRY(
            (ctx->backend->upload)(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_USER], motion->forces.user, ctx->backend->user_bytes));
    return (ctx->backend->upload)(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_RULE], &motion->rule, sizeof motion->rule);
}

/* Returns true when no force moves springls. */
SPRINGLS__FN bool springls__has_no_force(const springls__motion *motion)
{
    const springls_forces *f = &motion->forces;
    return !springls__has_pressure(f) && !springls__has_velocity(f) && !springls__has_affine(f) && f->curvature_weight == 0.0f
        && motion->rule.smoothing == 0.0f;
}

/* Displaces all springls, into moved_springls. Ends with a loop, after which springls__displaced is to be called. */
SPRINGLS__FN springls_status springls__displace_all(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    int count = ctx->model.set.count;
    springls__motion_times(motion);
    motion->listed = NULL;
    motion->count = springls__has_no_force(motion) ? 0 : count;
    if (motion->count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, moved_springls, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, moved_error, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, displacement2, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, turning2, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, motion_class, count));
    if (springls__device_can_displace(motion)) {
        springls_status status = springls__forces_to_device(motion);
        if (status == SPRINGLS_OK) status = springls__run_on_device(ctx, SPRINGLS__KERNEL_displace, count, NULL);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    return springls__displace_in_blocks(motion);
}

/* Replaces the springls and their errors by moved_springls and moved_error. Where only some are listed these are copied to their places,
   the last one first: an index is never below its place in the list, so no motion_class is overwritten before it is read. */
SPRINGLS__FN springls_status springls__take_moved(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    springls__constellation *set = &ctx->model.set;
    uint8_t *motion_class;
    int i;
    if (!motion->listed) {
        springls__swap(ctx, SPRINGLS__ARRAY_S, SPRINGLS__ROLE_ARRAY(moved_springls));
        springls__swap(ctx, SPRINGLS__ARRAY_ERROR, SPRINGLS__ROLE_ARRAY(moved_error));
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(S) | SPRINGLS__BIT(ERROR) | SPRINGLS__ROLE_BIT(motion_class)));
    motion_class = springls__motion_class(&ctx->model);
    memset(motion_class + motion->count, SPRINGLS__MOTION_NONE, (size_t)(set->count - motion->count));
    for (i = motion->count - 1; i >= 0; i--) {
        int to = motion->listed[i];
        uint8_t moved = motion_class[i];
        motion_class[i] = SPRINGLS__MOTION_NONE;
        motion_class[to] = moved;
        set->s[to] = springls__moved_springls(&ctx->model)[i];
        set->error[to] = springls__moved_error(&ctx->model)[i];
    }
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__displace_springls(springls_context *ctx) { return springls__displace_all(&ctx->motion); }

/* Finds whether all displacements are to be computed again: where a particle would go further than max_displacement (0: no limit), with a
   dt a little shorter than a uniform force would need. After TRIES attempts the limit is dropped. */
SPRINGLS__FN springls_status springls__check_motion(springls_context *ctx)
{
    enum { TRIES = 40 };
    springls__motion *motion = &ctx->motion;
    springls__displaced(motion);
    if (motion->moved < 0.0f)
        return springls__fail(ctx, SPRINGLS_NON_FINITE,
                              "advect: a force is NaN, or would move a springl by 1e9 voxels or more, at time %g",
                              (double)motion->time);
    motion->again = motion->max_displacement > 0.0f && motion->moved > motion->max_displacement && ++motion->tries < TRIES;
    if (motion->again) motion->dt *= springls__max(0.95f * motion->max_displacement / motion->moved, 0.1f);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__displaces(const springls_context *ctx) { return springls__round(ctx) == 0 || ctx->motion.again; }

/* Takes the motion over. */
SPRINGLS__FN springls_status springls__take_motion(springls_context *ctx)
{
    const springls__motion *motion = &ctx->motion;
    const int count = ctx->model.set.count;
    if (ctx->desc.follow && motion->moved > (float)SPRINGLS__FURTHEST_MOTION)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: a springl would move by %g voxels, at most %d are possible",
                              (double)motion->moved, (int)SPRINGLS__FURTHEST_MOTION);
    if (!motion->none) {
        SPRINGLS__TRY(springls__take_moved(&ctx->motion));
        ctx->away += motion->moved;
        springls__constellation_moved(ctx);
    }
    ctx->stats.largest_displacement = motion->moved;
    ctx->stats.moving_share = count ? (float)motion->moving / (float)count : 0.0f;
    return SPRINGLS_OK;
}

/* Moves all springls by the context's motion. */
static const springls__entry springls__advect[] = {
    SPRINGLS__REPEAT_WHILE(springls__displaces)
        SPRINGLS__DO(springls__displace_springls) /* eq. 1, 2 */
        SPRINGLS__DO(springls__check_motion)
    SPRINGLS__END
    SPRINGLS__DO(springls__take_motion)
SPRINGLS__END };

/* Returns the metric that stands for voxels. */
SPRINGLS__FN springls__metric springls__voxel_lengths(void)
{
    const springls__metric none = { 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f };
    return none;
}

/* Begins to find the largest speed of a particle, for springls__max_speed_end: by `lengths`, in voxels where they are all zero. Ends with
   a loop. */
SPRINGLS__FN springls_status springls__max_speed_begin(springls_context *ctx, const springls_forces *forces, float time,
                                                       springls__metric lengths)
{
    springls__motion *motion = &ctx->motion;
    SPRINGLS__TRY(springls__motion_begin(ctx, forces, time, 1.0f));
    motion->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    motion->rule.euler = 1;
    motion->rule.lengths = lengths;
    return springls__displace_all(motion);
}

/* Writes the speed that springls__max_speed_begin has found. call: for the message of a failure. */
SPRINGLS__FN springls_status springls__max_speed_end(springls_context *ctx, const char *call, float *speed)
{
    springls__motion *motion = &ctx->motion;
    springls__displaced(motion);
    if (motion->moved < 0.0f)
        return springls__fail(ctx, SPRINGLS_NON_FINITE,
                              "%s: a force is NaN, or a speed is 1e9 voxels a unit of time or more", call);
    *speed = motion->moved;
    return SPRINGLS_OK;
}

/* Finds the largest speed of a particle in the units of the forces. */
SPRINGLS__FN springls_status springls__max_speed(springls_context *ctx, const char *call, const springls_forces *forces, float time,
                                                 float *speed)
{
    const springls__metric metric = ctx->model.grid.metric;
    const bool in_world = forces && springls__forces_in_world(ctx, forces);
    const springls__metric lengths =
        in_world && !springls__is_uniform(metric) ? springls__metric_inverse(metric) : springls__voxel_lengths();
    springls__use_device(ctx);
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__max_speed_begin(ctx, forces, time, lengths)));
    springls__finish_loop(ctx);
    SPRINGLS__TRY(springls__max_speed_end(ctx, call, speed));
    if (in_world) *speed *= ctx->smallest_spacing;
    return SPRINGLS_OK;
}

#endif
