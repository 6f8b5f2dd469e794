/* advect.h - springls move (section 4.2, eq. 1 and 2): pressure, velocity, affine, sampled fields, curvature. */
#ifndef SPRINGLS__STAGES_ADVECT_H
#define SPRINGLS__STAGES_ADVECT_H

#include "../../kernels_embed/stages/advect.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/kernel_table.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/transform.h"

SPRINGLS__FN springls_status springls__field_prepare(springls_context *ctx, const springls_sampled_field *given, int channels,
                                                     springls__field *field)
{
    double inverse[12], product;
    int axis, column, k;
    memset(field, 0, sizeof *field);
    if (!given->data) return SPRINGLS_OK;
    field->channels = channels;
    if (given->grid.size[0] == 0 && given->grid.size[1] == 0 && given->grid.size[2] == 0) { /* the model's own */
        for (axis = 0; axis < 3; axis++) {
            field->size[axis] = ctx->desc.grid.size[axis];
            field->from_voxel[5 * axis] = 1.0f;
        }
        return SPRINGLS_OK;
    }
    if (!springls__grid_transform(&given->grid, NULL, inverse))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "the grid of a sampled field has a bad size, spacing or direction");
    for (axis = 0; axis < 3; axis++) {
        field->size[axis] = given->grid.size[axis];
        for (column = 0; column < 4; column++) {
            product = column == 3 ? inverse[4 * axis + 3] : 0.0;
            for (k = 0; k < 3; k++) product += inverse[4 * axis + k] * ctx->to_world[4 * k + column];
            field->from_voxel[4 * axis + column] = (float)product;
        }
    }
    return SPRINGLS_OK;
}

enum { SPRINGLS__ADVECT_BLOCK = 128 }; /* springls that a callback is asked about at once */

/* What a block's displacements come to. */
typedef struct springls__block_motion { float largest2; int moving, finite; } springls__block_motion;

/* sigma of eq. 1 at points[0..count). */
SPRINGLS__FN void springls__flow(const springls__motion *job, const springls__v3 *points, int count, float time,
                                 springls__v3 *out)
{
    const springls_forces *forces = &job->forces;
    float buffer[3 * SPRINGLS__ADVECT_BLOCK];
    int i;
    for (i = 0; i < count; i++) out[i] = springls__v3_make(0.0f, 0.0f, 0.0f);
    if (forces->velocity) {
        forces->velocity(forces->user, &points[0].x, count, time, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__scale(springls__v3_make(buffer[3 * i], buffer[3 * i + 1], buffer[3 * i + 2]),
                                     job->rule.velocity_weight);
    }
    if (!forces->velocity_grid.data) return;
    for (i = 0; i < count; i++) {
        springls__field_sample(&job->rule.velocity, forces->velocity_grid.data, points[i], buffer);
        out[i] = springls__mad(out[i], springls__v3_make(buffer[0], buffer[1], buffer[2]), job->rule.velocity_weight);
    }
}

/* Adds rho of eq. 1 and motion by curvature: what pushes along the normal. */
SPRINGLS__FN void springls__push(const springls__motion *job, const springls__v3 *points, const springls__v3 *normals, int count,
                                 float time, springls__v3 *out)
{
    const springls_forces *forces = &job->forces;
    float buffer[SPRINGLS__ADVECT_BLOCK];
    int i;
    if (forces->pressure) {
        forces->pressure(forces->user, &points[0].x, &normals[0].x, count, time, buffer);
        for (i = 0; i < count; i++) out[i] = springls__mad(out[i], normals[i], job->rule.pressure_weight * buffer[i]);
    }
    if (forces->pressure_grid.data) {
        for (i = 0; i < count; i++) {
            springls__field_sample(&job->rule.pressure, forces->pressure_grid.data, points[i], buffer);
            out[i] = springls__mad(out[i], normals[i], job->rule.pressure_weight * buffer[0]);
        }
    }
    if (forces->curvature_weight != 0.0f) {
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], normals[i],
                                   -forces->curvature_weight * springls__curvature_at(&job->ctx->model.grid, points[i]));
    }
}

/* Slopes of all movers of a block: x holds `count` particles, then their q0s, q1s and q2s. */
SPRINGLS__FN void springls__slopes(const springls__motion *job, const springls__v3 *x, const springls__v3 *a, int count,
                                   float time, springls__v3 *slope)
{
    springls__v3 normals[SPRINGLS__ADVECT_BLOCK];
    float affine[12 * SPRINGLS__ADVECT_BLOCK];
    int i, m;
    for (i = 0; i < count; i++)
        normals[i] = springls__normalize(springls__cross(springls__sub(x[2 * count + i], x[count + i]),
                                                         springls__sub(x[3 * count + i], x[count + i])));
    springls__flow(job, x, count, time, slope);
    if (!job->ctx->model.params.vertex_velocity) {
        springls__push(job, x, normals, count, time, slope);
        for (m = 1; m < SPRINGLS__MOVERS; m++) memcpy(slope + m * count, slope, (size_t)count * sizeof *slope); /* eq. 2 */
    } else { /* what pushes, pushes the springl as a whole: its vertices have no normals of their own */
        springls__v3 push[SPRINGLS__ADVECT_BLOCK];
        memset(push, 0, sizeof push);
        springls__push(job, x, normals, count, time, push);
        for (m = 1; m < SPRINGLS__MOVERS; m++) springls__flow(job, x + m * count, count, time, slope + m * count);
        for (m = 0; m < SPRINGLS__MOVERS; m++)
            for (i = 0; i < count; i++) slope[m * count + i] = springls__add(slope[m * count + i], push[i]);
    }
    if (!job->forces.affine) return;
    job->forces.affine(job->forces.user, &x[0].x, &a[0].x, count, time, affine);
    for (m = 0; m < SPRINGLS__MOVERS; m++)
        for (i = 0; i < count; i++) {
            const float *A = affine + 12 * i;
            springls__v3 q = x[m * count + i];
            springls__v3 v = springls__v3_make(A[0] * q.x + A[1] * q.y + A[2] * q.z + A[3],
                                               A[4] * q.x + A[5] * q.y + A[6] * q.z + A[7],
                                               A[8] * q.x + A[9] * q.y + A[10] * q.z + A[11]);
            slope[m * count + i] = springls__mad(slope[m * count + i], v, job->affine_weight);
        }
}

SPRINGLS__FN springls__block_motion springls__block_motion_of(const springls__movers *displacement, int count)
{
    springls__block_motion motion;
    int i, m;
    motion.largest2 = 0.0f;
    motion.moving = 0;
    motion.finite = 1;
    for (i = 0; i < count; i++) {
        float d2 = springls__length2(displacement[i].x[0]);
        for (m = 0; m < SPRINGLS__MOVERS; m++)
            if (!(springls__length2(displacement[i].x[m]) < 1e18f)) motion.finite = 0;
        motion.largest2 = springls__max(motion.largest2, d2);
        motion.moving += d2 > 1e-4f;
    }
    return motion;
}

SPRINGLS__FN void springls__advect_block(const springls__motion *job, int first, int count)
{
    enum { N = SPRINGLS__MOVERS * SPRINGLS__ADVECT_BLOCK };
    springls__v3 x[N], stage[N], k1[N], k2[N], k3[N], k4[N];
    const springls__springl *s = job->ctx->model.set.s + first;
    const springls__v3 *a = job->ctx->model.set.a + first;
    const springls__grid *g = &job->ctx->model.grid;
    int i, m, n = SPRINGLS__MOVERS * count;
    for (i = 0; i < count; i++) {
        x[i] = s[i].p;
        for (m = 0; m < 3; m++) x[(m + 1) * count + i] = s[i].q[m];
    }
    springls__slopes(job, x, a, count, job->rule.stage_time[0], k1);
    if (job->forces.integrator == SPRINGLS_INTEGRATOR_EULER) {
        for (i = 0; i < n; i++) k1[i] = springls__scale(k1[i], job->rule.dt);
    } else {
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k1[i], 0.5f * job->rule.dt);
        springls__slopes(job, stage, a, count, job->rule.stage_time[1], k2);
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k2[i], 0.5f * job->rule.dt);
        springls__slopes(job, stage, a, count, job->rule.stage_time[2], k3);
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k3[i], job->rule.dt);
        springls__slopes(job, stage, a, count, job->rule.stage_time[3], k4);
        for (i = 0; i < n; i++) k1[i] = springls__rk4(k1[i], k2[i], k3[i], k4[i], job->rule.dt);
    }
    for (i = 0; i < count; i++) {
        springls__v3 *d = job->displacement[first + i].x;
        for (m = 0; m < SPRINGLS__MOVERS; m++) d[m] = k1[m * count + i];
        if (job->rule.stop_at_topology
            && springls__held_by_topology(springls__grid_sample(g, g->phi, x[i]),
                                          springls__grid_sample(g, g->phi, springls__add(x[i], d[0])), d[0],
                                          springls__springl_normal(s[i])))
            memset(d, 0, SPRINGLS__MOVERS * sizeof *d);
    }
    job->blocks[first / SPRINGLS__ADVECT_BLOCK] = springls__block_motion_of(job->displacement + first, count);
}

SPRINGLS__FN int springls__advect_blocks(const springls_context *ctx)
{
    return (ctx->model.set.count + SPRINGLS__ADVECT_BLOCK - 1) / SPRINGLS__ADVECT_BLOCK;
}

/* Of blocks: callbacks see the same batches for any division. */
SPRINGLS__FN void springls__advect_task(void *arg, int begin, int end)
{
    const springls__motion *job = (const springls__motion *)arg;
    for (; begin < end; begin++) {
        int first = begin * SPRINGLS__ADVECT_BLOCK;
        springls__advect_block(job, first, springls__imin(SPRINGLS__ADVECT_BLOCK, job->ctx->model.set.count - first));
    }
}

/* The context's motion: what `forces` do from `time` on in a time of dt. */
SPRINGLS__FN springls_status springls__motion_begin(springls_context *ctx, const springls_forces *forces, float time, float dt)
{
    springls__motion *job = &ctx->motion;
    memset(job, 0, sizeof *job);
    job->ctx = ctx;
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: forces is NULL");
    job->forces = *forces;
    job->rule.pressure_weight = forces->pressure_weight != 0.0f ? forces->pressure_weight : 1.0f;
    job->rule.velocity_weight = forces->velocity_weight != 0.0f ? forces->velocity_weight : 1.0f;
    job->affine_weight = forces->affine_weight != 0.0f ? forces->affine_weight : 1.0f;
    job->rule.euler = forces->integrator == SPRINGLS_INTEGRATOR_EULER;
    job->rule.curvature_weight = forces->curvature_weight;
    job->time = time;
    job->dt = dt;
    SPRINGLS__TRY(springls__field_prepare(ctx, &forces->pressure_grid, 1, &job->rule.pressure));
    return springls__field_prepare(ctx, &forces->velocity_grid, 3, &job->rule.velocity);
}

SPRINGLS__FN springls_status springls__motion_times(springls__motion *job)
{
    float spread = job->ctx->model.params.half_time_sampling ? 0.5f * job->dt : job->dt;
    if (!(job->dt > -FLT_MAX && job->dt < FLT_MAX))
        return springls__fail(job->ctx, SPRINGLS_INVALID_ARGUMENT, "advect: dt is not finite");
    job->rule.dt = job->dt;
    job->rule.stage_time[0] = job->time;
    job->rule.stage_time[1] = job->rule.stage_time[2] = job->time + 0.5f * spread;
    job->rule.stage_time[3] = job->time + spread;
    job->rule.stop_at_topology = job->stop_at_topology;
    return SPRINGLS_OK;
}

/* Displacements by the host's threads, which callbacks want. Ends with a loop. */
SPRINGLS__FN springls_status springls__displace_on_host(springls__motion *job)
{
    springls_context *ctx = job->ctx;
    uint64_t grid = job->rule.curvature_weight != 0.0f || job->rule.stop_at_topology ? SPRINGLS__BIT(PHI) | SPRINGLS__BIT(TOP)
                                                                                     : 0;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, block_motions, springls__advect_blocks(ctx)));
    job->blocks = springls__block_motions(&ctx->model);
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | grid,
                                    SPRINGLS__ROLE_BIT(displacement) | SPRINGLS__ROLE_BIT(block_motions)));
    springls__loop_task(ctx, springls__advect_blocks(ctx), 1, springls__advect_task, job);
    return SPRINGLS_OK;
}

/* After that: the largest particle displacement, or a negative number when any point's is not finite. */
SPRINGLS__FN void springls__displaced(springls__motion *job)
{
    float largest2 = 0.0f;
    bool finite = true;
    int i;
    if (!job->blocks) return; /* the device has told */
    job->moving = 0;
    for (i = 0; i < springls__advect_blocks(job->ctx); i++) {
        finite = finite && job->blocks[i].finite;
        largest2 = springls__max(largest2, job->blocks[i].largest2);
        job->moving += job->blocks[i].moving;
    }
    job->moved = finite ? springls__sqrt(largest2) : -1.0f;
}

/* Can the device take these forces by itself? */
SPRINGLS__FN bool springls__device_can_displace(springls__motion *job)
{
    const springls_forces *forces = &job->forces;
    float *n = job->rule.flow_numbers;
    if (forces->pressure || forces->affine) return false;
    job->rule.flow = SPRINGLS__FLOW_NONE;
    if (forces->velocity == springls_velocity_deformation) {
        const springls_deformation_flow *flow = (const springls_deformation_flow *)forces->user;
        job->rule.flow = SPRINGLS__FLOW_DEFORMATION;
        n[0] = flow->grid_size;
        n[1] = flow->period;
    } else if (forces->velocity == springls_velocity_rotation) {
        const springls_rotation_flow *flow = (const springls_rotation_flow *)forces->user;
        springls__v3 axis = springls__normalize(springls__load3(flow->axis));
        job->rule.flow = SPRINGLS__FLOW_ROTATION;
        memcpy(n, flow->center, 3 * sizeof *n);
        n[3] = axis.x; n[4] = axis.y; n[5] = axis.z;
        n[6] = flow->angular_velocity;
    } else if (forces->velocity) {
        const springls_backend *backend = job->ctx->backend;
        if (forces->velocity != backend->user_velocity || (backend->user_bytes > 0 && !forces->user)) return false;
        job->rule.flow = SPRINGLS__FLOW_USER;
    }
    return true;
}

/* A sampled field goes to the device once as long as its version stays. */
SPRINGLS__FN springls_status springls__field_to_device(springls_context *ctx, springls__array array,
                                                       const springls_sampled_field *given, const springls__field *field)
{
    springls_sampled_field *last = &ctx->on_device_field[array - SPRINGLS__ARRAY_FORCE_PRESSURE];
    size_t floats = (size_t)field->size[0] * (size_t)field->size[1] * (size_t)field->size[2] * (size_t)field->channels;
    if (!given->data) return SPRINGLS_OK;
    if (given->version && given->version == last->version && given->data == last->data
        && floats * sizeof(float) <= ctx->memory[array].device_bytes)
        return SPRINGLS_OK;
    SPRINGLS__TRY(ctx->backend->upload(ctx, &ctx->memory[array], given->data, floats * sizeof(float)));
    *last = *given;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__displace_on_device(springls__motion *job)
{
    springls_context *ctx = job->ctx;
    int count = ctx->model.set.count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, displacement2, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, is_moving, count));
    SPRINGLS__TRY(
        springls__field_to_device(ctx, SPRINGLS__ARRAY_FORCE_PRESSURE, &job->forces.pressure_grid, &job->rule.pressure));
    SPRINGLS__TRY(
        springls__field_to_device(ctx, SPRINGLS__ARRAY_FORCE_VELOCITY, &job->forces.velocity_grid, &job->rule.velocity));
    SPRINGLS__TRY(ctx->backend->upload(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_RULE], &job->rule, sizeof job->rule));
    if (job->rule.flow == SPRINGLS__FLOW_USER && ctx->backend->user_bytes > 0)
        SPRINGLS__TRY(
            ctx->backend->upload(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_USER], job->forces.user, ctx->backend->user_bytes));
    SPRINGLS__TRY(springls__run_on_device(ctx, SPRINGLS__KERNEL_displace, count, NULL));
    job->moved = springls__sqrt(springls__largest(ctx, SPRINGLS__ROLE_ARRAY(displacement2), count));
    job->moving = springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(is_moving), count, 1);
    if (!(job->moved < 1e9f)) job->moved = -1.0f;
    return ctx->backend_status;
}

/* Ends with a loop, after which springls__displaced is to be called. */
SPRINGLS__FN springls_status springls__displace(springls__motion *job)
{
    springls_context *ctx = job->ctx;
    SPRINGLS__TRY(springls__motion_times(job));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, displacement, ctx->model.set.count));
    job->displacement = springls__displacement(&ctx->model);
    job->blocks = NULL;
    if (ctx->on_device && springls__device_can_displace(job)) {
        springls_status status = springls__displace_on_device(job);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    return springls__displace_on_host(job);
}

enum { SPRINGLS__ADVECT_DISPLACE, SPRINGLS__ADVECT_MOVE };

/* Moves all springls by the context's motion. When a particle would go further than max_displacement (0: no limit), all
   displacements are computed again with a dt a little shorter than an even force would need; after TRIES of that there is no
   limit. */
SPRINGLS__FN springls_status springls__advect(springls_context *ctx)
{
    enum { TRIES = 40 };
    springls__motion *job = &ctx->motion;
    int count = ctx->model.set.count;
    if (ctx->work.phase == SPRINGLS__ADVECT_DISPLACE) {
        SPRINGLS__TRY(springls__displace(job));
        return springls__next_phase(ctx, SPRINGLS__ADVECT_MOVE);
    }
    springls__displaced(job);
    if (job->moved < 0.0f)
        return springls__fail(ctx, SPRINGLS_NON_FINITE, "advect: a force is NaN or infinite at time %g", (double)job->time);
    if (job->max_displacement > 0.0f && job->moved > job->max_displacement && ++job->tries < TRIES) {
        job->dt *= springls__max(0.95f * job->max_displacement / job->moved, 0.1f);
        return springls__next_phase(ctx, SPRINGLS__ADVECT_DISPLACE);
    }
    springls__run(ctx, SPRINGLS__KERNEL_move, count, NULL);
    ctx->stats.largest_displacement = job->moved;
    ctx->stats.moving_share = count ? (float)job->moving / (float)count : 0.0f;
    springls__constellation_moved(ctx);
    if (ctx->neighbors_age >= 0) ctx->neighbors_age++;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__max_speed(springls_context *ctx, const springls_forces *forces, float time, float *speed)
{
    springls__motion *job = &ctx->motion;
    SPRINGLS__TRY(springls__motion_begin(ctx, forces, time, 1.0f));
    job->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    job->rule.euler = 1;
    springls__use_device(ctx);
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__displace(job)));
    springls__finish_loop(ctx);
    springls__displaced(job);
    if (job->moved < 0.0f) return springls__fail(ctx, SPRINGLS_NON_FINITE, "max_speed: a force is NaN or infinite");
    *speed = job->moved;
    return SPRINGLS_OK;
}

/* Writes the velocities of the deformation at SPRINGLS__LANES points, xyz each, to out. */
SPRINGLS__FN void springls__deformation_velocities(const float *points, float n, float amplitude, float *out)
{
    float axis[3][SPRINGLS__LANES];
    springls__vec3 u;
    int lane, k;
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        for (k = 0; k < 3; k++) axis[k][lane] = points[3 * lane + k];
    u = springls__vec_deformation_velocity(springls__vec_load_v3(axis[0], axis[1], axis[2]), n, amplitude);
    springls__vec_store(axis[0], u.x);
    springls__vec_store(axis[1], u.y);
    springls__vec_store(axis[2], u.z);
    for (lane = 0; lane < SPRINGLS__LANES; lane++)
        for (k = 0; k < 3; k++) out[3 * lane + k] = axis[k][lane];
}

SPRINGLS_API void springls_velocity_deformation(void *deformation_flow, const float *points, int count, float time, float *out)
{
    const springls_deformation_flow *flow = (const springls_deformation_flow *)deformation_flow;
    const float n = flow->grid_size, amplitude = springls__deformation_amplitude(n, flow->period, time);
    int i;
    for (i = 0; i + SPRINGLS__LANES <= count; i += SPRINGLS__LANES)
        springls__deformation_velocities(points + 3 * i, n, amplitude, out + 3 * i);
    for (; i < count; i++) {
        springls__v3 u = springls__deformation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]),
                                                        n, amplitude);
        out[3 * i] = u.x;
        out[3 * i + 1] = u.y;
        out[3 * i + 2] = u.z;
    }
}

SPRINGLS_API void springls_velocity_rotation(void *rotation_flow, const float *points, int count, float time, float *out)
{
    const springls_rotation_flow *flow = (const springls_rotation_flow *)rotation_flow;
    springls__v3 center = springls__v3_make(flow->center[0], flow->center[1], flow->center[2]);
    springls__v3 axis = springls__normalize(springls__v3_make(flow->axis[0], flow->axis[1], flow->axis[2]));
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        springls__v3 u = springls__rotation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]),
                                                     center, axis, flow->angular_velocity);
        out[3 * i] = u.x;
        out[3 * i + 1] = u.y;
        out[3 * i + 2] = u.z;
    }
}

#endif
