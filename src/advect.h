/* advect.h - springls move (section 4.2, eq. 1 and 2): pressure, velocity, affine, sampled fields, curvature. */

/* A sampled field ready for use: from the model's voxels to its own samples. */
typedef struct springls__field {
    const float *data;
    float from_voxel[12];
    int size[3], channels;
} springls__field;

SPRINGLS__FN springls_status springls__field_prepare(springls_context *ctx, const springls_sampled_field *given, int channels,
                                                     springls__field *field)
{
    double inverse[12], product;
    int axis, column, k;
    memset(field, 0, sizeof *field);
    if (!given->data) return SPRINGLS_OK;
    field->data = given->data;
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

SPRINGLS__FN void springls__field_sample(const springls__field *field, springls__v3 x, float *out)
{
    const float *m = field->from_voxel;
    float f[3], corner[8];
    int i[3], axis, channel, c;
    f[0] = m[0] * x.x + m[1] * x.y + m[2] * x.z + m[3];
    f[1] = m[4] * x.x + m[5] * x.y + m[6] * x.z + m[7];
    f[2] = m[8] * x.x + m[9] * x.y + m[10] * x.z + m[11];
    for (axis = 0; axis < 3; axis++) {
        f[axis] = springls__clamp(f[axis], 0.0f, (float)(field->size[axis] - 1));
        i[axis] = springls__imax(springls__imin((int)f[axis], field->size[axis] - 2), 0);
        f[axis] -= (float)i[axis];
    }
    for (channel = 0; channel < field->channels; channel++) {
        for (c = 0; c < 8; c++) {
            size_t sx = (size_t)springls__imin(i[0] + (c & 1), field->size[0] - 1);
            size_t sy = (size_t)springls__imin(i[1] + ((c >> 1) & 1), field->size[1] - 1);
            size_t sz = (size_t)springls__imin(i[2] + (c >> 2), field->size[2] - 1);
            corner[c] = field->data[(sx + (size_t)field->size[0] * (sy + (size_t)field->size[1] * sz)) * (size_t)field->channels + (size_t)channel];
        }
        out[channel] = springls__trilinear(corner, f[0], f[1], f[2]);
    }
}

/* The points of a springl that move: its particle, and its vertices. */
enum { SPRINGLS__MOVERS = 4, SPRINGLS__ADVECT_BLOCK = 128 };

typedef struct springls__advect_job {
    springls_context *ctx;
    const springls_forces *forces;
    springls__field pressure, velocity;
    float pressure_weight, velocity_weight, affine_weight;
    float dt, stage_time[4]; /* of the Runge-Kutta stages */
    bool stop_at_topology;
    springls__v3 *displacement; /* MOVERS a springl */
    struct springls__block_motion *motion; /* one a block */
} springls__advect_job;

/* What a block's displacements come to. */
typedef struct springls__block_motion { float largest2; int moving, finite; } springls__block_motion;

/* Mean curvature of phi at x: the Laplacian of a distance. */
SPRINGLS__FN float springls__curvature_at(const springls__grid *g, springls__v3 x)
{
    float c = springls__grid_sample(g, g->phi, x);
    float sum = springls__grid_sample(g, g->phi, springls__v3_make(x.x - 1.0f, x.y, x.z)) + springls__grid_sample(g, g->phi, springls__v3_make(x.x + 1.0f, x.y, x.z))
              + springls__grid_sample(g, g->phi, springls__v3_make(x.x, x.y - 1.0f, x.z)) + springls__grid_sample(g, g->phi, springls__v3_make(x.x, x.y + 1.0f, x.z))
              + springls__grid_sample(g, g->phi, springls__v3_make(x.x, x.y, x.z - 1.0f)) + springls__grid_sample(g, g->phi, springls__v3_make(x.x, x.y, x.z + 1.0f));
    return springls__clamp(sum - 6.0f * c, -2.0f, 2.0f);
}

/* sigma of eq. 1 at points[0..count). */
SPRINGLS__FN void springls__flow(const springls__advect_job *job, const springls__v3 *points, int count, float time, springls__v3 *out)
{
    const springls_forces *forces = job->forces;
    float buffer[3 * SPRINGLS__ADVECT_BLOCK];
    int i;
    for (i = 0; i < count; i++) out[i] = springls__v3_make(0.0f, 0.0f, 0.0f);
    if (forces->velocity) {
        forces->velocity(forces->user, &points[0].x, count, time, buffer);
        for (i = 0; i < count; i++)
            out[i] = springls__scale(springls__v3_make(buffer[3 * i], buffer[3 * i + 1], buffer[3 * i + 2]), job->velocity_weight);
    }
    if (!job->velocity.data) return;
    for (i = 0; i < count; i++) {
        springls__field_sample(&job->velocity, points[i], buffer);
        out[i] = springls__mad(out[i], springls__v3_make(buffer[0], buffer[1], buffer[2]), job->velocity_weight);
    }
}

/* Adds rho of eq. 1 and motion by curvature: what pushes along the normal. */
SPRINGLS__FN void springls__push(const springls__advect_job *job, const springls__v3 *points, const springls__v3 *normals, int count,
                                 float time, springls__v3 *out)
{
    const springls_forces *forces = job->forces;
    float buffer[SPRINGLS__ADVECT_BLOCK];
    int i;
    if (forces->pressure) {
        forces->pressure(forces->user, &points[0].x, &normals[0].x, count, time, buffer);
        for (i = 0; i < count; i++) out[i] = springls__mad(out[i], normals[i], job->pressure_weight * buffer[i]);
    }
    if (job->pressure.data) {
        for (i = 0; i < count; i++) {
            springls__field_sample(&job->pressure, points[i], buffer);
            out[i] = springls__mad(out[i], normals[i], job->pressure_weight * buffer[0]);
        }
    }
    if (forces->curvature_weight != 0.0f) {
        for (i = 0; i < count; i++)
            out[i] = springls__mad(out[i], normals[i], -forces->curvature_weight * springls__curvature_at(&job->ctx->model.grid, points[i]));
    }
}

/* Slopes of all movers of a block: x holds `count` particles, then their q0s, q1s and q2s. */
SPRINGLS__FN void springls__slopes(const springls__advect_job *job, const springls__v3 *x, const springls__v3 *a, int count,
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
    if (!job->forces->affine) return;
    job->forces->affine(job->forces->user, &x[0].x, &a[0].x, count, time, affine);
    for (m = 0; m < SPRINGLS__MOVERS; m++)
        for (i = 0; i < count; i++) {
            const float *A = affine + 12 * i;
            springls__v3 q = x[m * count + i];
            springls__v3 v = springls__v3_make(A[0] * q.x + A[1] * q.y + A[2] * q.z + A[3], A[4] * q.x + A[5] * q.y + A[6] * q.z + A[7],
                                               A[8] * q.x + A[9] * q.y + A[10] * q.z + A[11]);
            slope[m * count + i] = springls__mad(slope[m * count + i], v, job->affine_weight);
        }
}

SPRINGLS__FN springls__block_motion springls__block_motion_of(const springls__v3 *displacement, int count)
{
    springls__block_motion motion;
    int i;
    motion.largest2 = 0.0f;
    motion.moving = 0;
    motion.finite = 1;
    for (i = 0; i < SPRINGLS__MOVERS * count; i++) {
        float d2 = springls__length2(displacement[i]);
        if (!(d2 < 1e18f)) motion.finite = 0;
        if (i % SPRINGLS__MOVERS) continue;
        motion.largest2 = springls__max(motion.largest2, d2);
        motion.moving += d2 > 1e-4f;
    }
    return motion;
}

SPRINGLS__FN void springls__advect_block(const springls__advect_job *job, int first, int count)
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
    springls__slopes(job, x, a, count, job->stage_time[0], k1);
    if (job->forces->integrator == SPRINGLS_EULER) {
        for (i = 0; i < n; i++) k1[i] = springls__scale(k1[i], job->dt);
    } else {
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k1[i], 0.5f * job->dt);
        springls__slopes(job, stage, a, count, job->stage_time[1], k2);
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k2[i], 0.5f * job->dt);
        springls__slopes(job, stage, a, count, job->stage_time[2], k3);
        for (i = 0; i < n; i++) stage[i] = springls__mad(x[i], k3[i], job->dt);
        springls__slopes(job, stage, a, count, job->stage_time[3], k4);
        for (i = 0; i < n; i++) k1[i] = springls__rk4(k1[i], k2[i], k3[i], k4[i], job->dt);
    }
    for (i = 0; i < count; i++) {
        springls__v3 *d = job->displacement + (size_t)(first + i) * SPRINGLS__MOVERS;
        for (m = 0; m < SPRINGLS__MOVERS; m++) d[m] = k1[m * count + i];
        if (job->stop_at_topology
            && springls__held_by_topology(springls__grid_sample(g, g->phi, x[i]), springls__grid_sample(g, g->phi, springls__add(x[i], d[0])),
                                          d[0], springls__springl_normal(s[i])))
            memset(d, 0, SPRINGLS__MOVERS * sizeof *d);
    }
    job->motion[first / SPRINGLS__ADVECT_BLOCK] = springls__block_motion_of(job->displacement + (size_t)first * SPRINGLS__MOVERS, count);
}

SPRINGLS__FN int springls__advect_blocks(const springls_context *ctx) { return (ctx->model.set.count + SPRINGLS__ADVECT_BLOCK - 1) / SPRINGLS__ADVECT_BLOCK; }

/* Of blocks: callbacks see the same batches for any division. */
SPRINGLS__FN void springls__advect_task(void *arg, int begin, int end)
{
    const springls__advect_job *job = (const springls__advect_job *)arg;
    for (; begin < end; begin++) {
        int first = begin * SPRINGLS__ADVECT_BLOCK;
        springls__advect_block(job, first, springls__imin(SPRINGLS__ADVECT_BLOCK, job->ctx->model.set.count - first));
    }
}

SPRINGLS__FN springls_status springls__advect_prepare(springls_context *ctx, const springls_forces *forces, float time, float dt,
                                                      springls__advect_job *job)
{
    float spread = ctx->model.params.half_time_sampling ? 0.5f * dt : dt;
    memset(job, 0, sizeof *job);
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: forces is NULL");
    if (!(dt > -FLT_MAX && dt < FLT_MAX)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "advect: dt is not finite");
    job->ctx = ctx;
    job->forces = forces;
    job->pressure_weight = forces->pressure_weight != 0.0f ? forces->pressure_weight : 1.0f;
    job->velocity_weight = forces->velocity_weight != 0.0f ? forces->velocity_weight : 1.0f;
    job->affine_weight = forces->affine_weight != 0.0f ? forces->affine_weight : 1.0f;
    job->dt = dt;
    job->stage_time[0] = time;
    job->stage_time[1] = job->stage_time[2] = time + 0.5f * spread;
    job->stage_time[3] = time + spread;
    SPRINGLS__TRY(springls__field_prepare(ctx, &forces->pressure_grid, 1, &job->pressure));
    SPRINGLS__TRY(springls__field_prepare(ctx, &forces->velocity_grid, 3, &job->velocity));
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)springls__advect_blocks(ctx), sizeof *job->motion, (void **)&job->motion));
    return springls__scratch(ctx, 0, (size_t)ctx->model.set.count, SPRINGLS__MOVERS * sizeof(springls__v3), (void **)&job->displacement);
}

SPRINGLS__FN void springls__move_task(void *arg, int begin, int end)
{
    const springls__advect_job *job = (const springls__advect_job *)arg;
    int m;
    for (; begin < end; begin++) {
        springls__springl *s = &job->ctx->model.set.s[begin];
        const springls__v3 *d = job->displacement + (size_t)begin * SPRINGLS__MOVERS;
        s->p = springls__add(s->p, d[0]);
        for (m = 0; m < 3; m++) s->q[m] = springls__add(s->q[m], d[m + 1]);
        *s = springls__springl_finished(*s);
    }
}

/* The largest particle displacement, or a negative number when any point's is not finite. */
SPRINGLS__FN float springls__largest_displacement(const springls__advect_job *job, int *moving)
{
    float largest2 = 0.0f;
    int i;
    *moving = 0;
    for (i = 0; i < springls__advect_blocks(job->ctx); i++) {
        if (!job->motion[i].finite) return -1.0f;
        largest2 = springls__max(largest2, job->motion[i].largest2);
        *moving += job->motion[i].moving;
    }
    return springls__sqrt(largest2);
}

/* Moves all springls by dt, unless a particle would go further than `most` (0: any way is allowed): then nothing moves.
   *moved: how far the fastest one goes. */
SPRINGLS__FN springls_status springls__advect(springls_context *ctx, const springls_forces *forces, float time, float dt, bool stop_at_topology,
                                              float most, float *moved)
{
    springls__advect_job job;
    int moving;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__advect_prepare(ctx, forces, time, dt, &job));
    job.stop_at_topology = stop_at_topology;
    springls__parallel(ctx, springls__advect_blocks(ctx), 1, springls__advect_task, &job);
    *moved = springls__largest_displacement(&job, &moving);
    if (*moved < 0.0f) return springls__fail(ctx, SPRINGLS_NON_FINITE, "advect: a force is NaN or infinite at time %g", (double)time);
    if (most > 0.0f && *moved > most) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(S)));
    springls__parallel(ctx, ctx->model.set.count, 512, springls__move_task, &job);
    ctx->stats.moved = *moved;
    ctx->stats.moving = ctx->model.set.count ? (float)moving / (float)ctx->model.set.count : 0.0f;
    springls__constellation_moved(ctx);
    if (ctx->neighbors_age >= 0) ctx->neighbors_age++;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_advect(springls_context *ctx, const springls_forces *forces, float time, float dt)
{
    springls_status status;
    double started;
    float moved;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    started = springls__stage_begin(ctx, SPRINGLS_STAGE_ADVECT);
    status = springls__advect(ctx, forces, time, dt, false, 0.0f, &moved);
    springls__stage_end(ctx, SPRINGLS_STAGE_ADVECT, started);
    return status;
}

SPRINGLS_API springls_status springls_max_speed(springls_context *ctx, const springls_forces *forces, float time, float *speed)
{
    springls__advect_job job;
    springls_forces euler;
    int moving;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!speed) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "max_speed: speed is NULL");
    *speed = 0.0f;
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "max_speed: forces is NULL");
    euler = *forces;
    euler.integrator = SPRINGLS_EULER;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__advect_prepare(ctx, &euler, time, 1.0f, &job));
    springls__parallel(ctx, springls__advect_blocks(ctx), 1, springls__advect_task, &job);
    *speed = springls__largest_displacement(&job, &moving);
    if (*speed < 0.0f) return springls__fail(ctx, SPRINGLS_NON_FINITE, "max_speed: a force is NaN or infinite");
    return SPRINGLS_OK;
}

SPRINGLS_API void springls_velocity_deformation(void *deformation_flow, const float *points, int count, float time, float *out)
{
    const springls_deformation_flow *flow = (const springls_deformation_flow *)deformation_flow;
    int i = springls__deformation_velocities(points, count, flow->grid_size, flow->period, time, out);
    for (; i < count; i++) {
        springls__v3 u = springls__deformation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]),
                                                        flow->grid_size, flow->period, time);
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
        springls__v3 u = springls__rotation_velocity(springls__v3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]), center, axis,
                                                     flow->angular_velocity);
        out[3 * i] = u.x;
        out[3 * i + 1] = u.y;
        out[3 * i + 2] = u.z;
    }
}
