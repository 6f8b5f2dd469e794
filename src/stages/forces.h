/* forces.h - evaluates the caller's callbacks and sampled fields (eq. 1 and 2) for blocks of springls, on the host. The flows that
   need no callback are those of a kernel: kernels_embed/stages/advect.h. */
#ifndef SPRINGLS__STAGES_FORCES_H
#define SPRINGLS__STAGES_FORCES_H

#include "../runtime/finite.h"
#include "../../kernels_embed/stages/advect.h"
#include "../runtime/errors.h"
#include "../model/transform.h"

SPRINGLS__FN bool springls__has_pressure(const springls_forces *f)
{
    return f->pressure || f->pressure_batch || f->pressure_grid.data;
}

SPRINGLS__FN bool springls__has_velocity(const springls_forces *f)
{
    return f->velocity || f->velocity_batch || f->velocity_grid.data;
}

SPRINGLS__FN bool springls__has_affine(const springls_forces *f) { return f->affine || f->affine_batch; }

/* Returns true when the samples of a field are those of the model's own grid. */
SPRINGLS__FN bool springls__is_on_own_grid(const springls_sampled_field *field)
{
    return field->grid.size[0] == 0 && field->grid.size[1] == 0 && field->grid.size[2] == 0;
}

/* Checks the integrator, the weights, the region and the grids of sampled fields. */
SPRINGLS__FN springls_status springls__check_forces(springls_context *ctx, const springls_forces *forces)
{
    static const char *const weight_names[4] = { "pressure", "velocity", "affine", "curvature" };
    const springls_sampled_field *fields[2];
    double inverse[12];
    float weights[4];
    int k;
    fields[0] = &forces->pressure_grid;
    fields[1] = &forces->velocity_grid;
    weights[0] = forces->pressure_weight;
    weights[1] = forces->velocity_weight;
    weights[2] = forces->affine_weight;
    weights[3] = forces->curvature_weight;
    if (forces->integrator != SPRINGLS_INTEGRATOR_RK4 && forces->integrator != SPRINGLS_INTEGRATOR_EULER)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "forces: there is no integrator %d: it may be 0 or 1",
                              (int)forces->integrator);
    for (k = 0; k < 4; k++)
        if (!springls__finite_float(weights[k]))
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "forces: %s_weight is %g, not finite", weight_names[k],
                                  (double)weights[k]);
    for (k = 0; k < 3; k++) {
        const float lower = forces->region_lower[k], upper = forces->region_upper[k];
        if (!springls__finite_float(lower) || !springls__finite_float(upper) || lower > upper)
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

/* The working memory of a block of springls, which is too large for a stack. */
typedef struct springls__force_block {
    springls__v3 x[SPRINGLS__ADVECT_POINTS];     /* where the points are before the step */
    springls__v3 at[SPRINGLS__ADVECT_POINTS];    /* where they are in a stage; in the end, their displacements */
    springls__v3 along[SPRINGLS__ADVECT_POINTS]; /* on the cubic through the ends of the step */
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
} springls__force_block;

/* Writes a place of a window as callbacks get it. */
SPRINGLS__FN void springls__callback_place(const springls__motion *motion, const springls__window *window, springls__v3 x,
                                           float *out)
{
    springls__v3 at = springls__to_lattice(window, x);
    if (motion->forces.world_units) springls__window_to_world(window, x, out);
    else memcpy(out, &at.x, 3 * sizeof *out);
}

/* Returns the batch that callbacks get. */
SPRINGLS__FN const springls_batch *springls__callback_batch(const springls__motion *motion, springls__force_block *block)
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
        springls__callback_place(motion, &ctx->window, springls__load3(batch->points + 3 * i), block->given_points + 3 * i);
        springls__callback_place(motion, &ctx->original_window, block->a[i], block->given_correspondences + 3 * i);
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
SPRINGLS__FN springls__v3 springls__velocity_to_voxel(const springls__motion *motion, const float *v)
{
    const double *m = motion->ctx->window.to_voxel, x = (double)v[0], y = (double)v[1], z = (double)v[2];
    if (!motion->forces.world_units) return springls__load3(v);
    return springls__v3_make((float)(m[0] * x + m[1] * y + m[2] * z), (float)(m[4] * x + m[5] * y + m[6] * z),
                             (float)(m[8] * x + m[9] * y + m[10] * z));
}

/* Writes sigma of eq. 1 at the points of the batch. */
SPRINGLS__FN void springls__flow(const springls__motion *motion, springls__force_block *block, springls__v3 *out)
{
    const springls_forces *forces = &motion->forces;
    const springls_batch *batch = &block->batch, *given = springls__callback_batch(motion, block);
    const springls__v3 *points = (const springls__v3 *)(const void *)batch->points;
    float *buffer = block->answer;
    int i, count = batch->count;
    for (i = 0; i < count; i++) out[i] = springls__v3_make(0.0f, 0.0f, 0.0f);
    if (forces->velocity) {
        (forces->velocity)(forces->user, given->points, count, batch->time, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__scale(springls__velocity_to_voxel(motion, buffer + 3 * i), motion->rule.velocity_weight);
    }
    if (forces->velocity_batch) {
        (forces->velocity_batch)(forces->user, given, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], springls__velocity_to_voxel(motion, buffer + 3 * i), motion->rule.velocity_weight);
    }
    if (!forces->velocity_grid.data) return;
    for (i = 0; i < count; i++) {
        springls__field_sample(&motion->rule.velocity, forces->velocity_grid.data, points[i], buffer);
        out[i] = springls__mad(out[i], springls__velocity_to_voxel(motion, buffer), motion->rule.velocity_weight);
    }
}

/* Adds pressures, one a point of a batch, along its normals. */
SPRINGLS__FN void springls__add_pressure(const springls__motion *motion, const springls_batch *given, const float *rho,
                                         springls__v3 *out)
{
    int i;
    for (i = 0; i < given->count; i++) {
        const springls__v3 unit_speed = springls__velocity_to_voxel(motion, given->normals + 3 * i);
        out[i] = springls__mad(out[i], unit_speed, motion->rule.pressure_weight * rho[i]);
    }
}

/* Adds rho of eq. 1 and motion by curvature at the particles of the batch, along the normals. */
SPRINGLS__FN void springls__push(const springls__motion *motion, springls__force_block *block, springls__v3 *out)
{
    const springls_forces *forces = &motion->forces;
    const springls_batch *batch = &block->batch, *given = springls__callback_batch(motion, block);
    const springls__v3 *points = (const springls__v3 *)(const void *)batch->points;
    float *buffer = block->answer;
    int i, count = batch->count;
    if (forces->pressure) {
        (forces->pressure)(forces->user, given->points, given->normals, count, batch->time, buffer);
        springls__add_pressure(motion, given, buffer, out);
    }
    if (forces->pressure_batch) {
        (forces->pressure_batch)(forces->user, given, buffer);
        springls__add_pressure(motion, given, buffer, out);
    }
    if (forces->pressure_grid.data) {
        for (i = 0; i < count; i++)
            springls__field_sample(&motion->rule.pressure, forces->pressure_grid.data, points[i], buffer + i);
        springls__add_pressure(motion, given, buffer, out);
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
            springls__callback_place(motion, &motion->ctx->window, x[m * count + i], q);
            for (k = 0; k < 3; k++) v[k] = A[4 * k] * q[0] + A[4 * k + 1] * q[1] + A[4 * k + 2] * q[2] + A[4 * k + 3];
            slope[m * count + i] = springls__mad(slope[m * count + i], springls__velocity_to_voxel(motion, v),
                                                 motion->affine_weight);
        }
}

/* Sets the points of a batch to those of mover m of a block: particles for 0, vertices m - 1 for 1, 2, 3. */
SPRINGLS__FN void springls__batch_points(springls_batch *batch, const springls__v3 *x, int m)
{
    batch->points = &x[m * batch->count].x;
    batch->vertex = m - 1;
}

/* Returns whether any force reads the springls' normals. Where none does, they are not computed. */
SPRINGLS__FN bool springls__reads_normals(const springls_forces *forces)
{
    return springls__has_pressure(forces) || forces->velocity_batch || forces->affine_batch || forces->curvature_weight != 0.0f
           || forces->world_units;
}

/* Finds the flow at the particles of a block, where its points are at x. */
SPRINGLS__FN void springls__particle_flow(const springls__motion *motion, springls__force_block *block, const springls__v3 *x,
                                          float time, springls__v3 *flow)
{
    springls_batch *batch = &block->batch;
    springls__v3 *normals = block->normals;
    springls__tri t;
    int i, count = batch->count;
    for (i = 0; i < count && springls__reads_normals(&motion->forces); i++) {
        t.a = x[count + i];
        t.b = x[2 * count + i];
        t.c = x[3 * count + i];
        normals[i] = springls__tri_normal(t);
    }
    batch->normals = &normals[0].x;
    batch->time = time;
    springls__batch_points(batch, x, 0);
    springls__flow(motion, block, flow);
}

/* Adds the affine maps of the callbacks to the slopes of all points of a block, where they are at x. */
SPRINGLS__FN void springls__add_affine_maps(const springls__motion *motion, springls__force_block *block, const springls__v3 *x,
                                            springls__v3 *slope)
{
    const springls_forces *forces = &motion->forces;
    springls_batch *batch = &block->batch;
    const springls_batch *given;
    if (!springls__has_affine(forces)) return;
    springls__batch_points(batch, x, 0);
    given = springls__callback_batch(motion, block);
    if (forces->affine) {
        (forces->affine)(forces->user, given->points, given->correspondences, batch->count, batch->time, block->answer);
        springls__add_affine(motion, block->answer, x, batch->count, slope);
    }
    if (forces->affine_batch) {
        (forces->affine_batch)(forces->user, given, block->answer);
        springls__add_affine(motion, block->answer, x, batch->count, slope);
    }
}

/* Finds the slopes of all points of a block, where they are at x, and the flow at its particles. */
SPRINGLS__FN void springls__slopes(const springls__motion *motion, springls__force_block *block, const springls__v3 *x,
                                   float time, springls__v3 *slope, springls__v3 *flow)
{
    springls_batch *batch = &block->batch;
    springls__v3 *push = block->push;
    int i, m, count = batch->count;
    springls__particle_flow(motion, block, x, time, flow);
    memcpy(slope, flow, (size_t)count * sizeof *slope);
    if (!motion->ctx->model.params.vertex_velocity) {
        springls__push(motion, block, slope);
        for (m = 1; m < SPRINGLS__MOVERS; m++) memcpy(slope + m * count, slope, (size_t)count * sizeof *slope); /* eq. 2 */
    } else { /* a push moves the springl as a whole: its vertices have no normals of their own */
        memset(push, 0, (size_t)count * sizeof *push);
        springls__push(motion, block, push);
        for (m = 1; m < SPRINGLS__MOVERS; m++) {
            springls__batch_points(batch, x, m);
            springls__flow(motion, block, slope + m * count);
        }
        for (m = 0; m < SPRINGLS__MOVERS; m++)
            for (i = 0; i < count; i++) slope[m * count + i] = springls__add(slope[m * count + i], push[i]);
    }
    springls__add_affine_maps(motion, block, x, slope);
}

/* Finds springls__simpson_residual for the particles of a block, which a step displaces by `at`. */
SPRINGLS__FN void springls__path_residuals(const springls__motion *motion, springls__force_block *block)
{
    const springls__force_rule *rule = &motion->rule;
    springls__v3 *along = block->along, *flow = block->flow_along, *residual = block->residual;
    int i, count = block->batch.count, n = SPRINGLS__MOVERS * count;
    memset(residual, 0, (size_t)count * sizeof *residual);
    if (!springls__has_velocity(&motion->forces)) return;
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
SPRINGLS__FN void springls__advect_read(const springls__motion *motion, int first, int count, springls__force_block *block)
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

/* Displaces the points of a block by fourth-order Runge-Kutta (eq. 2), whose first slopes are known, and estimates the errors. */
SPRINGLS__FN void springls__runge_kutta(const springls__motion *motion, springls__force_block *block)
{
    springls__v3 *x = block->x, *at = block->at, (*k)[SPRINGLS__ADVECT_POINTS] = block->slope;
    const float *time = motion->rule.stage_time, dt = motion->rule.dt;
    int i, stage, count = block->batch.count, n = SPRINGLS__MOVERS * count;
    for (stage = 1; stage < 4; stage++) {
        const float span = stage == 3 ? dt : 0.5f * dt;
        for (i = 0; i < n; i++) at[i] = springls__mad(x[i], k[stage - 1][i], span);
        springls__slopes(motion, block, at, time[stage], k[stage], block->flow[stage]);
    }
    for (i = 0; i < n; i++) at[i] = springls__rk4(k[0][i], k[1][i], k[2][i], k[3][i], dt);
    springls__path_residuals(motion, block);
    for (i = 0; i < count; i++)
        block->error[i] = springls__rk4_error(k[0][i], k[1][i], k[2][i], k[3][i], block->residual[i], dt);
}

/* Displaces the springls first, ..., first + count - 1 of a motion by Runge-Kutta or one Euler step. */
SPRINGLS__FN void springls__advect_block(const springls__motion *motion, int first, int count, springls__force_block *block)
{
    springls__v3 *x = block->x, *at = block->at;
    springls_context *ctx = motion->ctx;
    int i;
    springls__advect_read(motion, first, count, block);
    springls__slopes(motion, block, x, motion->rule.stage_time[0], block->slope[0], block->flow[0]);
    if (motion->forces.integrator == SPRINGLS_INTEGRATOR_EULER) {
        for (i = 0; i < SPRINGLS__MOVERS * count; i++) at[i] = springls__scale(block->slope[0][i], motion->rule.dt);
        memset(block->error, 0, sizeof block->error);
    } else springls__runge_kutta(motion, block);
    for (i = 0; i + SPRINGLS__LANES <= count; i += SPRINGLS__LANES)
        springls__vec_displace_by(&ctx->model, &motion->rule, first + i, x + i, at + i, count, block->error + i,
                                  block->before + i);
    for (; i < count; i++)
        springls__displace_by(&ctx->model, &motion->rule, first + i, x + i, at + i, count, block->error + i, block->before + i);
}

/* Returns how many blocks the springls of a motion are. */
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
                               (springls__force_block *)(void *)memory);
    }
}

#endif
