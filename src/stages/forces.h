/* forces.h - evaluates the caller's callbacks and sampled fields (eq. 1 and 2) for blocks of springls, on the host. What a device
   evaluates is in kernels_embed/device/displace_body.h; both integrate by kernels_embed/stages/integrate_body.h. */
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

/* Returns whether forces have to be converted from the world to voxels. */
SPRINGLS__FN bool springls__forces_in_world(const springls_context *ctx, const springls_forces *forces)
{
    return !forces->voxel_units && !ctx->lattice_is_world;
}

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

/* ---- blocks: springls whose paths are integrated together ----

   A callback gets a block of points at once, as it wants them: xyz, xyz, ... Between its calls the sums and products of the
   Runge-Kutta scheme go over the same memory several numbers at a time, whichever coordinate they are. A block is small enough for
   its path to stay in a processor's nearest caches. */

enum { SPRINGLS__ADVECT_BLOCK = 128 }; /* springls */

#define SPRINGLS__GROUPS (SPRINGLS__ADVECT_BLOCK / SPRINGLS__LANES)

struct springls__vec_path;
typedef springls__vec3 springls__points[SPRINGLS__GROUPS]; /* one a springl */

SPRINGLS__FN int springls__vec_flow_movers(const struct springls__vec_path *path);
SPRINGLS__FN void springls__vec_find_flow(const springls__model *model, const springls__force_rule *rule,
                                          struct springls__vec_path *path, springls__points *x, int m, int k, springls__vec3 *flow);
SPRINGLS__FN void springls__vec_add_push(const springls__model *model, const springls__force_rule *rule,
                                         struct springls__vec_path *path, springls__points *x, springls__vec3 *push);
SPRINGLS__FN void springls__vec_add_affine(const springls__force_rule *rule, struct springls__vec_path *path, springls__points *x,
                                           springls__points *slope);

/* Returns the points of a group, one a lane. */
SPRINGLS__VEC_MATHS springls__vec3 springls__vec_by_lane(springls__vec3 points)
{
    float xyz[3 * SPRINGLS__LANES];
    springls__vec_store(xyz, points.x);
    springls__vec_store(xyz + SPRINGLS__LANES, points.y);
    springls__vec_store(xyz + 2 * SPRINGLS__LANES, points.z);
    return springls__vec_gather3(xyz);
}

#include "../../kernels_embed/language/width_simd.h"
#include "../../kernels_embed/stages/integrate_body.h"

/* The working memory of a block, which is too large for a stack. */
typedef struct springls__force_block {
    springls__vec_path path; /* the first member: see springls__block_of */
    springls__points answer; /* of a callback that gives velocities */
    const springls__motion *motion;
    float a[3 * SPRINGLS__ADVECT_BLOCK], normals[3 * SPRINGLS__ADVECT_BLOCK];
    float affine[12 * SPRINGLS__ADVECT_BLOCK], rho[SPRINGLS__ADVECT_BLOCK]; /* of other callbacks */
    float before[SPRINGLS__ADVECT_BLOCK]; /* errors of the correspondences so far */
    int springls[SPRINGLS__ADVECT_BLOCK];
    uint32_t ids[SPRINGLS__ADVECT_BLOCK];
    springls_batch batch;
    springls_batch given; /* as callbacks get it: in the world, or on the lattice with forces->voxel_units */
    float given_points[3 * SPRINGLS__ADVECT_BLOCK], given_normals[3 * SPRINGLS__ADVECT_BLOCK];
    float given_correspondences[3 * SPRINGLS__ADVECT_BLOCK];
} springls__force_block;

SPRINGLS__FN springls__force_block *springls__block_of(struct springls__vec_path *path)
{
    return (springls__force_block *)(void *)path;
}

/* Returns the coordinates of points: xyz, xyz, ... */
SPRINGLS__FN float *springls__coordinates(springls__vec3 *points) { return (float *)(void *)points; }

/* Returns whether any force reads the springls' normals. If none does, they are not computed. */
SPRINGLS__FN bool springls__reads_normals(const springls_forces *forces)
{
    return springls__has_pressure(forces) || forces->velocity_batch || forces->affine_batch || forces->curvature_weight != 0.0f;
}

/* Returns whether any callback reads the springls' correspondences. */
SPRINGLS__FN bool springls__reads_correspondences(const springls_forces *forces)
{
    return forces->pressure_batch || forces->velocity_batch || springls__has_affine(forces);
}

/* Writes a place of a window as callbacks get it. */
SPRINGLS__FN void springls__callback_place(const springls__motion *motion, const springls__window *window, springls__v3 x,
                                           float *out)
{
    springls__v3 at = springls__to_lattice(window, x);
    if (motion->in_world) springls__window_to_world(window, x, out);
    else memcpy(out, &at.x, 3 * sizeof *out);
}

/* Returns the batch that callbacks get. */
SPRINGLS__FN const springls_batch *springls__callback_batch(const springls__motion *motion, springls__force_block *block)
{
    const springls_context *ctx = motion->ctx;
    const springls_batch *batch = &block->batch;
    const bool reads_correspondences = springls__reads_correspondences(&motion->forces);
    int i;
    if (!motion->in_world && springls__is_unmoved(&ctx->window) && springls__is_unmoved(&ctx->original_window))
        return batch;
    block->given = *batch;
    block->given.points = block->given_points;
    block->given.correspondences = block->given_correspondences;
    for (i = 0; i < batch->count; i++) {
        springls__callback_place(motion, &ctx->window, springls__load3(batch->points + 3 * i), block->given_points + 3 * i);
        if (reads_correspondences)
            springls__callback_place(motion, &ctx->original_window, springls__load3(block->a + 3 * i),
                                     block->given_correspondences + 3 * i);
    }
    if (!motion->in_world || !springls__reads_normals(&motion->forces)) return &block->given;
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
    const springls__v3 given = springls__load3(v);
    return motion->in_world ? springls__transform_vector(motion->ctx->window.to_voxel, given) : given;
}

/* Converts velocities of a callback or a sampled field to voxels, in place. */
SPRINGLS__FN void springls__velocities_to_voxel(const springls__motion *motion, float *v, int count)
{
    int i;
    for (i = 0; i < count && motion->in_world; i++) {
        const springls__v3 in_voxels = springls__velocity_to_voxel(motion, v + 3 * i);
        memcpy(v + 3 * i, &in_voxels.x, 3 * sizeof *v);
    }
}

SPRINGLS__FN int springls__vec_flow_movers(const struct springls__vec_path *path)
{
    const springls__force_block *block = (const springls__force_block *)(const void *)path;
    return springls__reads_normals(&block->motion->forces) ? SPRINGLS__MOVERS : 1;
}

/* Finds the normals of a block of springls whose vertices are at x[1], x[2] and x[3]. */
SPRINGLS__FN void springls__find_normals(springls__force_block *block, springls__points *x)
{
    float n[3][SPRINGLS__LANES], *out = block->normals;
    int g, lane, k;
    for (g = 0; g < SPRINGLS__GROUPS; g++) {
        const springls__vec3 normal = springls__vec_normal_of(
            springls__vec_by_lane(x[1][g]), springls__vec_by_lane(x[2][g]), springls__vec_by_lane(x[3][g]));
        springls__vec_store(n[0], normal.x);
        springls__vec_store(n[1], normal.y);
        springls__vec_store(n[2], normal.z);
        for (lane = 0; lane < SPRINGLS__LANES; lane++)
            for (k = 0; k < 3; k++) *out++ = n[k][lane];
    }
}

/* Sets the points of a block's batch to those of mover m: particles for 0, vertices m - 1 for 1, 2, 3. */
SPRINGLS__FN void springls__batch_points(springls__force_block *block, springls__points *x, int m)
{
    block->batch.points = springls__coordinates(x[m]);
    block->batch.vertex = m - 1;
}

/* Adds what the last callback has answered to sigma. */
SPRINGLS__FN void springls__add_answer(springls__force_block *block, springls__vec3 *flow)
{
    const springls__vec weight = springls__vec_broadcast(block->motion->rule.velocity_weight);
    int g;
    springls__velocities_to_voxel(block->motion, springls__coordinates(block->answer), block->batch.count);
    for (g = 0; g < SPRINGLS__GROUPS; g++) flow[g] = springls__vec_mad(flow[g], block->answer[g], weight);
}

SPRINGLS__FN void springls__vec_find_flow(const springls__model *model, const springls__force_rule *rule,
                                          struct springls__vec_path *path, springls__points *x, int m, int k, springls__vec3 *flow)
{
    springls__force_block *block = springls__block_of(path);
    const springls__motion *motion = block->motion;
    const springls_forces *forces = &motion->forces;
    const springls__vec weight = springls__vec_broadcast(rule->velocity_weight);
    const springls_batch *given;
    float *v = springls__coordinates(flow), *answer = springls__coordinates(block->answer);
    const int count = block->batch.count;
    int i;
    (void)model;
    block->batch.time = rule->stage_time[k];
    if (m == 0 && springls__reads_normals(forces)) springls__find_normals(block, x);
    springls__batch_points(block, x, m);
    given = springls__callback_batch(motion, block);
    memset(v, 0, sizeof(springls__points));
    if (forces->velocity) {
        (forces->velocity)(forces->user, given->points, count, given->time, v);
        springls__velocities_to_voxel(motion, v, count);
        for (i = 0; i < SPRINGLS__GROUPS; i++) flow[i] = springls__vec_scale(flow[i], weight);
    }
    if (forces->velocity_batch) {
        (forces->velocity_batch)(forces->user, given, answer);
        springls__add_answer(block, flow);
    }
    if (!forces->velocity_grid.data) return;
    for (i = 0; i < count; i++) {
        const springls__v3 at = springls__load3(block->batch.points + 3 * i);
        const springls__v3 sampled = springls__sampled_velocity(rule, forces->velocity_grid.data, at);
        memcpy(answer + 3 * i, &sampled.x, 3 * sizeof *answer);
    }
    springls__add_answer(block, flow);
}

/* Adds pressures, one a particle of a batch, along its normals. */
SPRINGLS__FN void springls__add_pressure(const springls__motion *motion, const springls_batch *given, const float *rho, float *push)
{
    int i;
    for (i = 0; i < given->count; i++) {
        const springls__v3 unit_speed = springls__velocity_to_voxel(motion, given->normals + 3 * i);
        const springls__v3 pressed = springls__pressed(&motion->rule, rho[i], unit_speed, springls__load3(push + 3 * i));
        memcpy(push + 3 * i, &pressed.x, 3 * sizeof *push);
    }
}

/* Adds the pressures of callbacks and samples at the particles of a block. */
SPRINGLS__FN void springls__add_pressures(springls__force_block *block, float *push)
{
    const springls__motion *motion = block->motion;
    const springls_forces *forces = &motion->forces;
    const springls_batch *given = springls__callback_batch(motion, block);
    int i;
    if (forces->pressure) {
        (forces->pressure)(forces->user, given->points, given->normals, given->count, given->time, block->rho);
        springls__add_pressure(motion, given, block->rho, push);
    }
    if (forces->pressure_batch) {
        (forces->pressure_batch)(forces->user, given, block->rho);
        springls__add_pressure(motion, given, block->rho, push);
    }
    if (!forces->pressure_grid.data) return;
    for (i = 0; i < given->count; i++)
        block->rho[i] = springls__sampled_pressure(&motion->rule, forces->pressure_grid.data,
                                                   springls__load3(block->batch.points + 3 * i));
    springls__add_pressure(motion, given, block->rho, push);
}

SPRINGLS__FN void springls__vec_add_push(const springls__model *model, const springls__force_rule *rule,
                                         struct springls__vec_path *path, springls__points *x, springls__vec3 *push)
{
    springls__force_block *block = springls__block_of(path);
    float *out = springls__coordinates(push);
    int i;
    springls__batch_points(block, x, 0);
    if (springls__has_pressure(&block->motion->forces)) springls__add_pressures(block, out);
    for (i = 0; i < block->batch.count && rule->curvature_weight != 0.0f; i++) {
        const springls__v3 at = springls__load3(block->batch.points + 3 * i), n = springls__load3(block->normals + 3 * i);
        const springls__v3 curved = springls__curved(&model->grid, rule, at, n, springls__load3(out + 3 * i));
        memcpy(out + 3 * i, &curved.x, 3 * sizeof *out);
    }
}

/* Adds the velocities of affine maps, one a springl, to the slopes of all points of a block. */
SPRINGLS__FN void springls__add_maps(const springls__force_block *block, springls__points *x, springls__points *slope)
{
    const springls__motion *motion = block->motion;
    int i, k, m;
    for (m = 0; m < SPRINGLS__MOVERS; m++)
        for (i = 0; i < block->batch.count; i++) {
            const float *A = block->affine + 12 * i;
            float q[3], v[3], *out = springls__coordinates(slope[m]) + 3 * i;
            springls__v3 sum;
            springls__callback_place(motion, &motion->ctx->window, springls__load3(springls__coordinates(x[m]) + 3 * i), q);
            for (k = 0; k < 3; k++) v[k] = A[4 * k] * q[0] + A[4 * k + 1] * q[1] + A[4 * k + 2] * q[2] + A[4 * k + 3];
            sum = springls__mad(springls__load3(out), springls__velocity_to_voxel(motion, v), motion->affine_weight);
            memcpy(out, &sum.x, 3 * sizeof *out);
        }
}

SPRINGLS__FN void springls__vec_add_affine(const springls__force_rule *rule, struct springls__vec_path *path, springls__points *x,
                                           springls__points *slope)
{
    springls__force_block *block = springls__block_of(path);
    const springls_forces *forces = &block->motion->forces;
    const springls_batch *given;
    (void)rule;
    if (!springls__has_affine(forces)) return;
    springls__batch_points(block, x, 0);
    given = springls__callback_batch(block->motion, block);
    if (forces->affine) {
        (forces->affine)(forces->user, given->points, given->correspondences, given->count, given->time, block->affine);
        springls__add_maps(block, x, slope);
    }
    if (forces->affine_batch) {
        (forces->affine_batch)(forces->user, given, block->affine);
        springls__add_maps(block, x, slope);
    }
}

/* Reads the springls of a block. Groups are whole: what is beyond the last springl lies at 0. */
SPRINGLS__FN void springls__advect_read(const springls__motion *motion, int first, int count, springls__force_block *block)
{
    const springls__constellation *set = &motion->ctx->model.set;
    float *x = springls__coordinates(block->path.x[0]);
    int i, m;
    memset(&block->batch, 0, sizeof block->batch);
    if (count < SPRINGLS__ADVECT_BLOCK) memset(x, 0, sizeof block->path.x);
    memset(block->answer, 0, sizeof block->answer);
    block->motion = motion;
    block->batch.correspondences = block->a;
    block->batch.normals = block->normals;
    block->batch.springls = block->springls;
    block->batch.ids = block->ids;
    block->batch.count = count;
    for (i = 0; i < count; i++) {
        const int springl = block->springls[i] = motion->listed ? motion->listed[first + i] : first + i;
        memcpy(block->a + 3 * i, &set->a[springl].x, 3 * sizeof *x);
        block->ids[i] = set->id[springl];
        block->before[i] = set->error[springl];
        memcpy(x + 3 * i, &set->s[springl].p.x, 3 * sizeof *x);
        for (m = 0; m < 3; m++)
            memcpy(x + 3 * ((m + 1) * SPRINGLS__ADVECT_BLOCK + i), &set->s[springl].q[m].x, 3 * sizeof *x);
    }
}

/* Displaces the springls first, ..., first + count - 1 of a motion. */
SPRINGLS__FN void springls__advect_block(const springls__motion *motion, int first, int count, springls__force_block *block)
{
    const springls__model *model = &motion->ctx->model;
    const springls__force_rule *rule = &motion->rule;
    const float *x = springls__coordinates(block->path.x[0]), *d = springls__coordinates(block->path.at[0]);
    const float *error = (const float *)(const void *)block->path.error;
    int i;
    springls__advect_read(motion, first, count, block);
    springls__vec_integrate(model, rule, &block->path);
    for (i = 0; i + SPRINGLS__LANES <= count; i += SPRINGLS__LANES)
        springls__vec_displace_by(model, rule, first + i, x + 3 * i, d + 3 * i, SPRINGLS__ADVECT_BLOCK, error + i, block->before + i);
    for (; i < count; i++)
        springls__displace_by(model, rule, first + i, x + 3 * i, d + 3 * i, SPRINGLS__ADVECT_BLOCK, error + i, block->before + i);
}

/* Returns how many blocks the springls of a motion are. */
SPRINGLS__FN int springls__advect_blocks(const springls__motion *motion)
{
    return (motion->count + SPRINGLS__ADVECT_BLOCK - 1) / SPRINGLS__ADVECT_BLOCK;
}

enum { SPRINGLS__BLOCK_ALIGNMENT = 64 }; /* bytes: of a cache line, and of the widest vector */

/* Returns how many floats a lane needs to hold a block, wherever it begins. */
SPRINGLS__FN size_t springls__block_floats(void)
{
    return (sizeof(springls__force_block) + 2 * SPRINGLS__BLOCK_ALIGNMENT) / SPRINGLS__BLOCK_ALIGNMENT
         * (SPRINGLS__BLOCK_ALIGNMENT / sizeof(float));
}

/* Displaces some blocks: callbacks see the same batches for any division of the loop. */
SPRINGLS__FN void springls__advect_work(void *arg, int begin, int end, float *memory)
{
    const springls__motion *motion = (const springls__motion *)arg;
    const size_t beyond = (size_t)(uintptr_t)memory % SPRINGLS__BLOCK_ALIGNMENT;
    char *start = (char *)(void *)memory + (beyond ? SPRINGLS__BLOCK_ALIGNMENT - beyond : 0);
    for (; begin < end; begin++) {
        int first = begin * SPRINGLS__ADVECT_BLOCK;
        springls__advect_block(motion, first, springls__imin(SPRINGLS__ADVECT_BLOCK, motion->count - first),
                               (springls__force_block *)(void *)start);
    }
}

#undef SPRINGLS__GROUPS

#endif
