/* advect.h - moves springls by the forces (section 4.2, eq. 1 and 2): pressure, velocity, affine, sampled fields, curvature. */
#ifndef SPRINGLS__STAGES_ADVECT_H
#define SPRINGLS__STAGES_ADVECT_H

#include "../../kernels_embed/stages/advect.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/cell_list.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/transform.h"

/* In voxels, of one advect, with a window that follows: beyond it a float has no sixteenth of a voxel. */
enum { SPRINGLS__FURTHEST_MOTION = 1000000 };

/* Returns true when the samples of a field are those of the model's own grid. */
SPRINGLS__FN bool springls__is_on_own_grid(const springls_sampled_field *field)
{
    return field->grid.size[0] == 0 && field->grid.size[1] == 0 && field->grid.size[2] == 0;
}

/* Checks what of forces can be wrong before they act: the integrator, the region, the grids of sampled fields. */
SPRINGLS__FN springls_status springls__check_forces(springls_context *ctx, const springls_forces *forces)
{
    const springls_sampled_field *fields[2];
    double inverse[12];
    int k;
    fields[0] = &forces->pressure_grid;
    fields[1] = &forces->velocity_grid;
    if (forces->integrator != SPRINGLS_INTEGRATOR_RK4 && forces->integrator != SPRINGLS_INTEGRATOR_EULER)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "forces: there is no integrator %d: it may be 0 or 1",
                              (int)forces->integrator);
    for (k = 0; k < 3; k++) {
        const float lower = forces->region_lower[k], upper = forces->region_upper[k];
        if (!(lower >= -FLT_MAX && lower <= upper && upper <= FLT_MAX))
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT,
                                  "forces: the region is from %g to %g along axis %d, not ascending and finite",
                                  (double)lower, (double)upper, k);
    }
    for (k = 0; k < 2; k++) {
        const char *fault = NULL;
        if (fields[k]->data && !springls__is_on_own_grid(fields[k]))
            fault = springls__grid_transform(&fields[k]->grid, NULL, inverse);
        if (fault) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "forces: of a sampled field %s", fault);
    }
    return SPRINGLS_OK;
}

/* Finds how a sampled field maps the model's voxels to its own samples; channels 0 when there is no field. */
SPRINGLS__FN void springls__field_prepare(const springls_context *ctx, const springls_sampled_field *given, int channels,
                                          springls__field *field)
{
    double inverse[12], product;
    int axis, column, k;
    memset(field, 0, sizeof *field);
    if (!given->data) return;
    field->channels = channels;
    if (springls__is_on_own_grid(given)) {
        for (axis = 0; axis < 3; axis++) {
            field->size[axis] = ctx->desc.grid.size[axis];
            field->from_voxel[5 * axis] = 1.0f;
            field->from_voxel[4 * axis + 3] = (float)ctx->window.offset[axis];
        }
        return;
    }
    springls__grid_transform(&given->grid, NULL, inverse);
    for (axis = 0; axis < 3; axis++) {
        field->size[axis] = given->grid.size[axis];
        for (column = 0; column < 4; column++) {
            product = column == 3 ? inverse[4 * axis + 3] : 0.0;
            for (k = 0; k < 3; k++) product += inverse[4 * axis + k] * ctx->window.to_world[4 * k + column];
            field->from_voxel[4 * axis + column] = (float)product;
        }
    }
}

enum {
    SPRINGLS__ADVECT_BLOCK = 128,                                        /* springls in one call of a callback */
    SPRINGLS__ADVECT_POINTS = SPRINGLS__MOVERS * SPRINGLS__ADVECT_BLOCK  /* their particles, then their q0s, q1s and q2s */
};

/* What the springls of a block need in between; too much for a stack. */
typedef struct springls__advect_memory {
    springls__v3 x[SPRINGLS__ADVECT_POINTS];     /* where the points were */
    springls__v3 at[SPRINGLS__ADVECT_POINTS];    /* in a stage; at last their displacements */
    springls__v3 along[SPRINGLS__ADVECT_POINTS]; /* on the way between the ends of the step */
    springls__v3 slope[4][SPRINGLS__ADVECT_POINTS];
    springls__v3 flow[4][SPRINGLS__ADVECT_BLOCK]; /* at the particles, in the stages */
    springls__v3 flow_along[SPRINGLS__ADVECT_BLOCK], residual[SPRINGLS__ADVECT_BLOCK];
    springls__v3 a[SPRINGLS__ADVECT_BLOCK], normals[SPRINGLS__ADVECT_BLOCK], push[SPRINGLS__ADVECT_BLOCK];
    float answer[12 * SPRINGLS__ADVECT_BLOCK];    /* of a callback */
    float error[SPRINGLS__ADVECT_BLOCK], before[SPRINGLS__ADVECT_BLOCK];
    int springls[SPRINGLS__ADVECT_BLOCK];
    uint32_t ids[SPRINGLS__ADVECT_BLOCK];
    springls_batch batch;
    springls_batch given; /* as callbacks get it: on the lattice, or in the world where forces->world_units is set */
    float given_points[3 * SPRINGLS__ADVECT_BLOCK], given_normals[3 * SPRINGLS__ADVECT_BLOCK];
    float given_correspondences[3 * SPRINGLS__ADVECT_BLOCK];
} springls__advect_memory;

/* Writes a place of a window as callbacks get it. */
SPRINGLS__FN void springls__give_place(const springls__motion *motion, const springls__window *window, springls__v3 x, float *out)
{
    springls__v3 at = springls__to_lattice(window, x);
    if (motion->forces.world_units) springls__window_to_world(window, x, out);
    else memcpy(out, &at.x, 3 * sizeof *out);
}

/* Returns the batch that callbacks get. */
SPRINGLS__FN const springls_batch *springls__given(const springls__motion *motion, springls__advect_memory *block)
{
    const springls_context *ctx = motion->ctx;
    const springls_batch *batch = &block->batch;
    int i;
    if (!motion->forces.world_units && springls__is_unmoved(&ctx->window) && springls__is_unmoved(&ctx->original_window))
        return batch;
    block->given = *batch;
    block->given.points = block->given_points;
    block->given.correspondences = block->given_correspondences;
    for (i = 0; i < batch->count; i++) {
        springls__give_place(motion, &ctx->window, springls__load3(batch->points + 3 * i), block->given_points + 3 * i);
        springls__give_place(motion, &ctx->original_window, block->a[i], block->given_correspondences + 3 * i);
    }
    if (!motion->forces.world_units) return &block->given;
    block->given.normals = block->given_normals;
    for (i = 0; i < batch->count; i++) {
        springls__v3 n = springls__normal_to_world(ctx, springls__load3(batch->normals + 3 * i));
        memcpy(block->given_normals + 3 * i, &n.x, 3 * sizeof(float));
    }
    return &block->given;
}

/* Returns a velocity of a callback or a sampled field in voxels. */
SPRINGLS__FN springls__v3 springls__taken(const springls__motion *motion, const float *v)
{
    const double *m = motion->ctx->window.to_voxel, x = (double)v[0], y = (double)v[1], z = (double)v[2];
    if (!motion->forces.world_units) return springls__load3(v);
    return springls__v3_make((float)(m[0] * x + m[1] * y + m[2] * z), (float)(m[4] * x + m[5] * y + m[6] * z),
                             (float)(m[8] * x + m[9] * y + m[10] * z));
}

/* Writes sigma of eq. 1 at the points of the batch. */
SPRINGLS__FN void springls__flow(const springls__motion *motion, springls__advect_memory *block, springls__v3 *out)
{
    const springls_forces *forces = &motion->forces;
    const springls_batch *batch = &block->batch, *given = springls__given(motion, block);
    const springls__v3 *points = (const springls__v3 *)(const void *)batch->points;
    float *buffer = block->answer;
    int i, count = batch->count;
    for (i = 0; i < count; i++) out[i] = springls__v3_make(0.0f, 0.0f, 0.0f);
    if (forces->velocity) {
        forces->velocity(forces->user, given->points, count, batch->time, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__scale(springls__taken(motion, buffer + 3 * i), motion->rule.velocity_weight);
    }
    if (forces->velocity_batch) {
        forces->velocity_batch(forces->user, given, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], springls__taken(motion, buffer + 3 * i), motion->rule.velocity_weight);
    }
    if (!forces->velocity_grid.data) return;
    for (i = 0; i < count; i++) {
        springls__field_sample(&motion->rule.velocity, forces->velocity_grid.data, points[i], buffer);
        out[i] = springls__mad(out[i], springls__taken(motion, buffer), motion->rule.velocity_weight);
    }
}

/* Returns what a speed of 1 along a normal of a batch is, voxels a unit of time. */
SPRINGLS__FN springls__v3 springls__unit_speed(const springls__motion *motion, const springls_batch *given, int i)
{
    return springls__taken(motion, given->normals + 3 * i);
}

/* Adds rho of eq. 1 and motion by curvature at the particles of the batch, along the normals. */
SPRINGLS__FN void springls__push(const springls__motion *motion, springls__advect_memory *block, springls__v3 *out)
{
    const springls_forces *forces = &motion->forces;
    const springls_batch *batch = &block->batch, *given = springls__given(motion, block);
    const springls__v3 *points = (const springls__v3 *)(const void *)batch->points;
    float *buffer = block->answer;
    int i, count = batch->count;
    if (forces->pressure) {
        forces->pressure(forces->user, given->points, given->normals, count, batch->time, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], springls__unit_speed(motion, given, i), motion->rule.pressure_weight * buffer[i]);
    }
    if (forces->pressure_batch) {
        forces->pressure_batch(forces->user, given, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], springls__unit_speed(motion, given, i), motion->rule.pressure_weight * buffer[i]);
    }
    if (forces->pressure_grid.data) {
        for (i = 0; i < count; i++) {
            springls__field_sample(&motion->rule.pressure, forces->pressure_grid.data, points[i], buffer);
            out[i] = springls__mad(out[i], springls__unit_speed(motion, given, i), motion->rule.pressure_weight * buffer[0]);
        }
    }
    if (forces->curvature_weight != 0.0f) {
        for (i = 0; i < count; i++) {
            springls__v3 n = springls__load3(batch->normals + 3 * i);
            springls__v3 velocity =
                springls__curvature_velocity(&motion->ctx->model.grid, points[i], n, motion->rule.curvature_span);
            out[i] = springls__mad(out[i], velocity, motion->rule.curvature_weight);
        }
    }
}

/* Adds to the slopes of all points of a block the affine maps of their springls, 12 floats each. */
SPRINGLS__FN void springls__add_affine(const springls__motion *motion, const float *affine, const springls__v3 *x, int count,
                                       springls__v3 *slope)
{
    int i, k, m;
    for (m = 0; m < SPRINGLS__MOVERS; m++)
        for (i = 0; i < count; i++) {
            const float *A = affine + 12 * i;
            float q[3], v[3];
            springls__give_place(motion, &motion->ctx->window, x[m * count + i], q);
            for (k = 0; k < 3; k++) v[k] = A[4 * k] * q[0] + A[4 * k + 1] * q[1] + A[4 * k + 2] * q[2] + A[4 * k + 3];
            slope[m * count + i] = springls__mad(slope[m * count + i], springls__taken(motion, v), motion->affine_weight);
        }
}

/* Sets the points of a batch to those of mover m of a block: particles for 0, vertices m - 1 for 1, 2, 3. */
SPRINGLS__FN void springls__batch_points(springls_batch *batch, const springls__v3 *x, int m)
{
    batch->points = &x[m * batch->count].x;
    batch->vertex = m - 1;
}

/* Returns whether any force is given the springls' normals; they are not defined where none is. */
SPRINGLS__FN bool springls__reads_normals(const springls_forces *forces)
{
    return forces->pressure || forces->pressure_batch || forces->pressure_grid.data || forces->velocity_batch
           || forces->affine_batch || forces->curvature_weight != 0.0f || forces->world_units;
}

/* Finds the flow at the particles of a block, where its points are at x. */
SPRINGLS__FN void springls__particle_flow(const springls__motion *motion, springls__advect_memory *block, const springls__v3 *x,
                                          float time, springls__v3 *flow)
{
    springls_batch *batch = &block->batch;
    springls__v3 *normals = block->normals;
    int i, count = batch->count;
    for (i = 0; i < count && springls__reads_normals(&motion->forces); i++)
        normals[i] = springls__normalize(springls__cross(springls__sub(x[2 * count + i], x[count + i]),
                                                         springls__sub(x[3 * count + i], x[count + i])));
    batch->normals = &normals[0].x;
    batch->time = time;
    springls__batch_points(batch, x, 0);
    springls__flow(motion, block, flow);
}

/* Finds the slopes of all points of a block, where they are at x, and the flow at its particles. */
SPRINGLS__FN void springls__slopes(const springls__motion *motion, springls__advect_memory *block, const springls__v3 *x,
                                   float time, springls__v3 *slope, springls__v3 *flow)
{
    const springls_forces *forces = &motion->forces;
    springls_batch *batch = &block->batch;
    springls__v3 *push = block->push;
    const springls_batch *given;
    int i, m, count = batch->count;
    springls__particle_flow(motion, block, x, time, flow);
    memcpy(slope, flow, (size_t)count * sizeof *slope);
    if (!motion->ctx->model.params.vertex_velocity) {
        springls__push(motion, block, slope);
        for (m = 1; m < SPRINGLS__MOVERS; m++) memcpy(slope + m * count, slope, (size_t)count * sizeof *slope); /* eq. 2 */
    } else { /* what pushes, pushes the springl as a whole: its vertices have no normals of their own */
        memset(push, 0, (size_t)count * sizeof *push);
        springls__push(motion, block, push);
        for (m = 1; m < SPRINGLS__MOVERS; m++) {
            springls__batch_points(batch, x, m);
            springls__flow(motion, block, slope + m * count);
        }
        for (m = 0; m < SPRINGLS__MOVERS; m++)
            for (i = 0; i < count; i++) slope[m * count + i] = springls__add(slope[m * count + i], push[i]);
    }
    springls__batch_points(batch, x, 0);
    given = springls__given(motion, block);
    if (forces->affine) {
        forces->affine(forces->user, given->points, given->correspondences, count, time, block->answer);
        springls__add_affine(motion, block->answer, x, count, slope);
    }
    if (forces->affine_batch) {
        forces->affine_batch(forces->user, given, block->answer);
        springls__add_affine(motion, block->answer, x, count, slope);
    }
}

/* Finds springls__simpson_residual for the particles of a block, which a step displaces by `at`. */
SPRINGLS__FN void springls__path_residuals(const springls__motion *motion, springls__advect_memory *block)
{
    const springls__force_rule *rule = &motion->rule;
    springls__v3 *along = block->along, *flow = block->flow_along, *residual = block->residual;
    int i, count = block->batch.count, n = SPRINGLS__MOVERS * count;
    memset(residual, 0, (size_t)count * sizeof *residual);
    if (!motion->forces.velocity && !motion->forces.velocity_batch && !motion->forces.velocity_grid.data) return;
    for (i = 0; i < n; i++) along[i] = springls__add(block->x[i], block->at[i]);
    springls__particle_flow(motion, block, along, rule->stage_time[3], flow);
    for (i = 0; i < count; i++) residual[i] = springls__sub(flow[i], block->flow[3][i]);
    for (i = 0; i < n; i++) {
        springls__v3 end = springls__add(block->slope[3][i], residual[i % count]);
        along[i] = springls__cubic_middle(block->x[i], block->at[i], block->slope[0][i], end, rule->dt);
    }
    springls__particle_flow(motion, block, along, rule->stage_time[1], flow);
    for (i = 0; i < count; i++)
        residual[i] = springls__simpson_residual(block->flow[1][i], block->flow[2][i], flow[i], residual[i]);
}

/* Reads the springls of a block. */
SPRINGLS__FN void springls__advect_read(const springls__motion *motion, int first, int count, springls__advect_memory *block)
{
    const springls__constellation *set = &motion->ctx->model.set;
    int i, m;
    memset(&block->batch, 0, sizeof block->batch);
    block->batch.correspondences = &block->a[0].x;
    block->batch.springls = block->springls;
    block->batch.ids = block->ids;
    block->batch.count = count;
    for (i = 0; i < count; i++) {
        int springl = block->springls[i] = motion->listed ? motion->listed[first + i] : first + i;
        block->a[i] = set->a[springl];
        block->ids[i] = set->id[springl];
        block->before[i] = set->error[springl];
        block->x[i] = set->s[springl].p;
        for (m = 0; m < 3; m++) block->x[(m + 1) * count + i] = set->s[springl].q[m];
    }
}

SPRINGLS__FN void springls__advect_block(const springls__motion *motion, int first, int count, springls__advect_memory *block)
{
    springls__v3 *x = block->x, *at = block->at, (*k)[SPRINGLS__ADVECT_POINTS] = block->slope;
    springls_context *ctx = motion->ctx;
    const float *time = motion->rule.stage_time, dt = motion->rule.dt;
    int i, n = SPRINGLS__MOVERS * count;
    springls__advect_read(motion, first, count, block);
    springls__slopes(motion, block, x, time[0], k[0], block->flow[0]);
    if (motion->forces.integrator == SPRINGLS_INTEGRATOR_EULER) {
        for (i = 0; i < n; i++) at[i] = springls__scale(k[0][i], dt);
        memset(block->error, 0, sizeof block->error);
    } else {
        for (i = 0; i < n; i++) at[i] = springls__mad(x[i], k[0][i], 0.5f * dt);
        springls__slopes(motion, block, at, time[1], k[1], block->flow[1]);
        for (i = 0; i < n; i++) at[i] = springls__mad(x[i], k[1][i], 0.5f * dt);
        springls__slopes(motion, block, at, time[2], k[2], block->flow[2]);
        for (i = 0; i < n; i++) at[i] = springls__mad(x[i], k[2][i], dt);
        springls__slopes(motion, block, at, time[3], k[3], block->flow[3]);
        for (i = 0; i < n; i++) at[i] = springls__rk4(k[0][i], k[1][i], k[2][i], k[3][i], dt);
        springls__path_residuals(motion, block);
        for (i = 0; i < count; i++)
            block->error[i] = springls__rk4_error(k[0][i], k[1][i], k[2][i], k[3][i], block->residual[i], dt);
    }
    for (i = 0; i + SPRINGLS__LANES <= count; i += SPRINGLS__LANES)
        springls__vec_displace_by(&ctx->model, &motion->rule, first + i, x + i, at + i, count, block->error + i,
                                  block->before + i);
    for (; i < count; i++)
        springls__displace_by(&ctx->model, &motion->rule, first + i, x + i, at + i, count, block->error + i, block->before + i);
}

SPRINGLS__FN int springls__advect_blocks(const springls__motion *motion)
{
    return (motion->count + SPRINGLS__ADVECT_BLOCK - 1) / SPRINGLS__ADVECT_BLOCK;
}

/* Displaces some blocks: callbacks see the same batches for any division of the loop. */
SPRINGLS__FN void springls__advect_work(void *arg, int begin, int end, float *memory)
{
    const springls__motion *motion = (const springls__motion *)arg;
    for (; begin < end; begin++) {
        int first = begin * SPRINGLS__ADVECT_BLOCK;
        springls__advect_block(motion, first, springls__imin(SPRINGLS__ADVECT_BLOCK, motion->count - first),
                               (springls__advect_memory *)(void *)memory);
    }
}

/* Finds the region that forces act in: everywhere where none is given. */
SPRINGLS__FN void springls__region_prepare(const springls_context *ctx, const springls_forces *forces, springls__motion *motion)
{
    const float *lower = forces->region_lower, *upper = forces->region_upper;
    int k;
    for (k = 0; k < 3; k++) motion->has_region = motion->has_region || lower[k] != 0.0f || upper[k] != 0.0f;
    motion->rule.window = springls__to_lattice(&ctx->window, springls__v3_make(0.0f, 0.0f, 0.0f));
    motion->rule.region_lower = springls__v3_make(-FLT_MAX, -FLT_MAX, -FLT_MAX);
    motion->rule.region_upper = springls__v3_make(FLT_MAX, FLT_MAX, FLT_MAX);
    if (!motion->has_region) return;
    motion->rule.region_lower = springls__from_lattice(&ctx->window, springls__load3(lower));
    motion->rule.region_upper = springls__from_lattice(&ctx->window, springls__load3(upper));
}

/* Begins the motion by `forces` from `time` to time + dt. */
SPRINGLS__FN springls_status springls__motion_begin(springls_context *ctx, const springls_forces *forces, float time, float dt)
{
    springls__motion *motion = &ctx->motion;
    memset(motion, 0, sizeof *motion);
    motion->ctx = ctx;
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: forces is NULL");
    SPRINGLS__TRY(springls__check_forces(ctx, forces));
    motion->forces = *forces;
    motion->rule.pressure_weight = forces->pressure_weight != 0.0f ? forces->pressure_weight : 1.0f;
    motion->rule.velocity_weight = forces->velocity_weight != 0.0f ? forces->velocity_weight : 1.0f;
    motion->affine_weight = forces->affine_weight != 0.0f ? forces->affine_weight : 1.0f;
    motion->rule.euler = forces->integrator == SPRINGLS_INTEGRATOR_EULER;
    motion->rule.curvature_weight = forces->curvature_weight;
    if (forces->world_units) motion->rule.curvature_weight /= ctx->smallest_spacing * ctx->smallest_spacing;
    motion->rule.curvature_span = springls__max(ctx->curvature_span, SPRINGLS__CURVATURE_SPAN);
    motion->time = time;
    motion->dt = dt;
    springls__region_prepare(ctx, forces, motion);
    springls__field_prepare(ctx, &forces->pressure_grid, 1, &motion->rule.pressure);
    springls__field_prepare(ctx, &forces->velocity_grid, 3, &motion->rule.velocity);
    return SPRINGLS_OK;
}

/* Writes into the rule the times of the Runge-Kutta stages, and what follows from them. */
SPRINGLS__FN springls_status springls__motion_times(springls__motion *motion)
{
    int k;
    float spread = motion->ctx->model.params.half_time_sampling ? 0.5f * motion->dt : motion->dt;
    if (!(motion->dt >= -FLT_MAX && motion->dt <= FLT_MAX))
        return springls__fail(motion->ctx, SPRINGLS_INVALID_ARGUMENT, "advect: dt is %g, not finite", (double)motion->dt);
    motion->rule.dt = motion->dt;
    motion->rule.stage_time[0] = motion->time;
    motion->rule.stage_time[1] = motion->rule.stage_time[2] = motion->time + 0.5f * spread;
    motion->rule.stage_time[3] = motion->time + spread;
    motion->rule.stop_at_topology = motion->stop_at_topology;
    for (k = 0; k < 4 && motion->rule.flow == SPRINGLS__FLOW_DEFORMATION; k++)
        motion->rule.flow_amplitude[k] = springls__deformation_amplitude(
            motion->rule.flow_numbers[0], motion->rule.flow_numbers[1], motion->rule.stage_time[k]);
    return SPRINGLS_OK;
}

/* Lists the springls in the region of the forces, ascending. Of a model at rest only the cells of the region are looked at. */
SPRINGLS__FN springls_status springls__list_region(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    const springls__springl *s = ctx->model.set.s;
    springls__v3 lower = motion->rule.region_lower, upper = motion->rule.region_upper;
    int i;
    if (ctx->at_rest) SPRINGLS__TRY(springls__cell_list_build(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, region_springls, ctx->model.set.count));
    motion->listed = springls__region_springls(&ctx->model);
    motion->count = 0;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(IDS) | SPRINGLS__BIT(LARGE)
                                             | SPRINGLS__BIT(TOP),
                                    SPRINGLS__ROLE_BIT(region_springls)));
    if (ctx->cells_fresh) {
        springls__cell_walk walk = springls__cell_walk_begin(&ctx->model, lower, upper);
        while ((i = springls__cell_walk_next(&walk)) >= 0)
            if (springls__in_force_region(lower, upper, s[i].p)) motion->listed[motion->count++] = i;
        qsort(motion->listed, (size_t)motion->count, sizeof *motion->listed, springls__compare_int);
        return SPRINGLS_OK;
    }
    for (i = 0; i < ctx->model.set.count; i++)
        if (springls__in_force_region(lower, upper, s[i].p)) motion->listed[motion->count++] = i;
    return SPRINGLS_OK;
}

/* Displaces by callbacks and sampled fields, which needs the host's threads. Ends with a loop. */
SPRINGLS__FN springls_status springls__displace_in_blocks(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    bool reads_phi = motion->rule.curvature_weight != 0.0f || motion->rule.smoothing != 0.0f || motion->rule.stop_at_topology;
    uint64_t grid = reads_phi ? SPRINGLS__BIT(PHI) | SPRINGLS__BIT(TOP) : 0;
    const size_t floats = (sizeof(springls__advect_memory) + 63) / 64 * 16; /* lanes begin on cache lines */
    if (motion->has_region) SPRINGLS__TRY(springls__list_region(motion));
    if (motion->count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID) | SPRINGLS__BIT(ERROR) | grid,
                                    springls__kernels[SPRINGLS__KERNEL_displace].writes));
    SPRINGLS__TRY(springls__reserve_lanes(ctx, floats, springls__advect_blocks(motion)));
    springls__loop_over(ctx, springls__advect_blocks(motion), 1, floats, springls__advect_work, motion);
    return SPRINGLS_OK;
}

/* Finds, after that, how many particles move, how far springls turn at most, and the largest displacement: negative where that of a
   point is not finite. */
SPRINGLS__FN void springls__displaced(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    springls__largest largest;
    springls__largest_later(ctx, SPRINGLS__COUNT_LARGEST, SPRINGLS__ROLE_ARRAY(displacement2), motion->count, SPRINGLS__MOVING2);
    springls__largest_later(ctx, SPRINGLS__COUNT_TURNING, SPRINGLS__ROLE_ARRAY(turning2), motion->count, FLT_MAX);
    largest = springls__largest_found(ctx, SPRINGLS__COUNT_LARGEST);
    motion->moved = largest.value < 1e18f ? springls__sqrt(largest.value) : -1.0f;
    motion->moving = largest.more;
    motion->turned = springls__sqrt(springls__largest_found(ctx, SPRINGLS__COUNT_TURNING).value);
    motion->still = largest.value == 0.0f
        && springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(is_moving), motion->count, SPRINGLS__MOVED_NOT) == motion->count;
}

/* Returns true when the kernel can evaluate the forces, and completes the rule for it. On the host it has no samples, and does
   not skip springls outside of a region. */
SPRINGLS__FN bool springls__kernel_can_displace(springls__motion *motion)
{
    const springls_forces *forces = &motion->forces;
    float *n = motion->rule.flow_numbers;
    if (forces->world_units) return false;
    if (!motion->ctx->on_device && (forces->pressure_grid.data || forces->velocity_grid.data || motion->has_region)) return false;
    if (forces->pressure || forces->affine || forces->pressure_batch || forces->velocity_batch || forces->affine_batch)
        return false;
    motion->rule.flow = SPRINGLS__FLOW_NONE;
    if (forces->velocity == springls_velocity_deformation) {
        const springls_deformation_flow *flow = (const springls_deformation_flow *)forces->user;
        motion->rule.flow = SPRINGLS__FLOW_DEFORMATION;
        n[0] = flow->grid_size;
        n[1] = flow->period;
    } else if (forces->velocity == springls_velocity_rotation) {
        const springls_rotation_flow *flow = (const springls_rotation_flow *)forces->user;
        springls__v3 axis = springls__normalize(springls__load3(flow->axis));
        motion->rule.flow = SPRINGLS__FLOW_ROTATION;
        memcpy(n, flow->center, 3 * sizeof *n);
        n[3] = axis.x; n[4] = axis.y; n[5] = axis.z;
        n[6] = flow->angular_velocity;
    } else if (forces->velocity) {
        const springls_backend *backend = motion->ctx->backend;
        if (!motion->ctx->on_device) return false;
        if (forces->velocity != backend->user_velocity || (backend->user_bytes > 0 && !forces->user)) return false;
        motion->rule.flow = SPRINGLS__FLOW_USER;
    }
    return true;
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
    SPRINGLS__TRY(ctx->backend->upload(ctx, &ctx->memory[array], given->data, floats * sizeof(float)));
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
    if (motion->rule.flow == SPRINGLS__FLOW_USER && ctx->backend->user_bytes > 0)
        SPRINGLS__TRY(
            ctx->backend->upload(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_USER], motion->forces.user, ctx->backend->user_bytes));
    return ctx->backend->upload(ctx, &ctx->memory[SPRINGLS__ARRAY_FORCE_RULE], &motion->rule, sizeof motion->rule);
}

/* Returns true where there is nothing that moves springls. */
SPRINGLS__FN bool springls__has_no_force(const springls__motion *motion)
{
    const springls_forces *f = &motion->forces;
    return !f->pressure && !f->velocity && !f->affine && !f->pressure_batch && !f->velocity_batch && !f->affine_batch
        && !f->pressure_grid.data && !f->velocity_grid.data && f->curvature_weight == 0.0f && motion->rule.smoothing == 0.0f;
}

/* Finds what becomes of all springls. Ends with a loop, after which springls__displaced is to be called. */
SPRINGLS__FN springls_status springls__displace_all(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    int count = ctx->model.set.count;
    bool by_kernel = springls__kernel_can_displace(motion);
    SPRINGLS__TRY(springls__motion_times(motion));
    motion->listed = NULL;
    motion->count = springls__has_no_force(motion) ? 0 : count;
    if (motion->count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, moved_springls, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, moved_error, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, displacement2, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, turning2, count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, is_moving, count));
    if (ctx->on_device) SPRINGLS__TRY(springls__reserve_counts(ctx));
    if (by_kernel && ctx->on_device) {
        springls_status status = springls__forces_to_device(motion);
        if (status == SPRINGLS_OK) status = springls__run_on_device(ctx, SPRINGLS__KERNEL_displace, count, NULL);
        if (!springls__repeat_on_host(ctx, &status)) return status;
        by_kernel = springls__kernel_can_displace(motion);
    }
    if (!by_kernel) return springls__displace_in_blocks(motion);
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_FORCE_RULE, 1, 0));
    *ctx->model.force.rule = motion->rule;
    springls__loop(ctx, SPRINGLS__KERNEL_displace, count, NULL);
    return SPRINGLS_OK;
}

/* Takes moved_springls and moved_error for the springls. Those of a list go to their places, the last one first: a springl's
   index is never below its place in the list, so nothing is overwritten before it has been taken. */
SPRINGLS__FN springls_status springls__take_moved(springls__motion *motion)
{
    springls_context *ctx = motion->ctx;
    springls__constellation *set = &ctx->model.set;
    uint8_t *how_far;
    int i;
    if (!motion->listed) {
        springls__swap(ctx, SPRINGLS__ARRAY_S, SPRINGLS__ROLE_ARRAY(moved_springls));
        springls__swap(ctx, SPRINGLS__ARRAY_ERROR, SPRINGLS__ROLE_ARRAY(moved_error));
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(S) | SPRINGLS__BIT(ERROR) | SPRINGLS__ROLE_BIT(is_moving)));
    how_far = springls__is_moving(&ctx->model);
    memset(how_far + motion->count, SPRINGLS__MOVED_NOT, (size_t)(set->count - motion->count));
    for (i = motion->count - 1; i >= 0; i--) {
        int to = motion->listed[i];
        uint8_t how = how_far[i];
        how_far[i] = SPRINGLS__MOVED_NOT;
        how_far[to] = how;
        set->s[to] = springls__moved_springls(&ctx->model)[i];
        set->error[to] = springls__moved_error(&ctx->model)[i];
    }
    return SPRINGLS_OK;
}

enum { SPRINGLS__ADVECT_DISPLACE, SPRINGLS__ADVECT_MOVE };

/* Moves all springls by the context's motion. When a particle would go further than max_displacement (0: no limit), all
   displacements are computed again with a dt a little shorter than an even force would need; after TRIES of that there is no
   limit. */
SPRINGLS__FN springls_status springls__advect(springls_context *ctx)
{
    enum { TRIES = 40 };
    springls__motion *motion = &ctx->motion;
    int count = ctx->model.set.count;
    if (ctx->work.phase == SPRINGLS__ADVECT_DISPLACE) {
        SPRINGLS__TRY(springls__displace_all(motion));
        return springls__next_phase(ctx, SPRINGLS__ADVECT_MOVE);
    }
    springls__displaced(motion);
    if (motion->moved < 0.0f)
        return springls__fail(ctx, SPRINGLS_NON_FINITE,
                              "advect: a force is NaN, or would move a springl by 1e9 voxels or more, at time %g",
                              (double)motion->time);
    if (motion->max_displacement > 0.0f && motion->moved > motion->max_displacement && ++motion->tries < TRIES) {
        motion->dt *= springls__max(0.95f * motion->max_displacement / motion->moved, 0.1f);
        return springls__next_phase(ctx, SPRINGLS__ADVECT_DISPLACE);
    }
    if (ctx->desc.follow && motion->moved > (float)SPRINGLS__FURTHEST_MOTION)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: a springl would move by %g voxels, at most %d are possible",
                              (double)motion->moved, (int)SPRINGLS__FURTHEST_MOTION);
    if (!motion->still) {
        SPRINGLS__TRY(springls__take_moved(motion));
        ctx->away += motion->moved;
        springls__constellation_moved(ctx);
    }
    ctx->stats.largest_displacement = motion->moved;
    ctx->stats.moving_share = count ? (float)motion->moving / (float)count : 0.0f;
    return SPRINGLS_OK;
}

/* Begins to find the largest speed of a particle, for springls__max_speed_end. Ends with a loop. */
SPRINGLS__FN springls_status springls__max_speed_begin(springls_context *ctx, const springls_forces *forces, float time)
{
    springls__motion *motion = &ctx->motion;
    SPRINGLS__TRY(springls__motion_begin(ctx, forces, time, 1.0f));
    motion->forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    motion->rule.euler = 1;
    return springls__displace_all(motion);
}

/* Writes the speed that springls__max_speed_begin has found, voxels a unit of time. call: for the message of a failure. */
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

SPRINGLS__FN springls_status springls__max_speed(springls_context *ctx, const char *call, const springls_forces *forces, float time,
                                                 float *speed)
{
    springls__use_device(ctx);
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__max_speed_begin(ctx, forces, time)));
    springls__finish_loop(ctx);
    return springls__max_speed_end(ctx, call, speed);
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
