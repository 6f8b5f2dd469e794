/* step.h - Algorithms 2 and 3. */

SPRINGLS__FN springls_status springls__evolve_and_rebuild(springls_context *ctx)
{
    SPRINGLS__TRY(springls_evolve(ctx));
    return springls_rebuild(ctx);
}

/* The level set catches up with the springls: carried along by them or, where it has just been made afresh of them, by eq. 23,
   which closes what gaps between springls have left open. */
SPRINGLS__FN springls_status springls__follow(springls_context *ctx, bool afresh)
{
    const int enough = 3;
    bool carry = ctx->model.params.predict && !afresh;
    int iterations = ctx->model.params.predict && afresh ? springls__imax(ctx->model.params.evolve_iterations, enough) : ctx->model.params.evolve_iterations, z;
    if (ctx->model.params.keep_edges && ctx->model.set.at_edges > 0)
        SPRINGLS__TRY(springls__staged(ctx, SPRINGLS_STAGE_KEEP_EDGES, springls__keep_edges));
    if (carry) SPRINGLS__TRY(springls__staged(ctx, SPRINGLS_STAGE_PROJECT, springls__carry_level_set));
    for (z = 0; z < iterations; z++) SPRINGLS__TRY(springls__evolve_and_rebuild(ctx));
    if (!ctx->model.params.project_level_set || (carry && iterations == 0)) return SPRINGLS_OK;
    return springls__staged(ctx, SPRINGLS_STAGE_PROJECT, springls__project_level_set);
}

SPRINGLS__FN bool springls__resample_due(const springls_context *ctx, int iteration) { return iteration % ctx->model.params.resample_period == 0; }

/* Algorithm 2 after Advect. */
SPRINGLS__FN springls_status springls__fluid_step(springls_context *ctx, bool one_to_one)
{
    float way;
    bool last = ctx->model.params.resample_last != 0, resample = !one_to_one && springls__resample_due(ctx, ctx->iteration), afresh;
    SPRINGLS__TRY(springls_relax(ctx));
    if (resample && !last) {
        SPRINGLS__TRY(springls__staged(ctx, SPRINGLS_STAGE_CONTRACT, springls__contract));
        SPRINGLS__TRY(springls_resample(ctx));
        SPRINGLS__TRY(springls_relax(ctx));
    }
    SPRINGLS__TRY(springls__way_since_phi(ctx, &way));
    afresh = ctx->model.params.predict && way > ctx->model.grid.far_value; /* too far to be carried */
    if (afresh) SPRINGLS__TRY(springls_unsigned_to_signed(ctx));
    SPRINGLS__TRY(springls__follow(ctx, afresh));
    if (!resample) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__orient(ctx));
    if (last) {
        SPRINGLS__TRY(springls_contract(ctx));
        SPRINGLS__TRY(springls_resample(ctx));
    }
    return springls_fill_gaps(ctx);
}

/* Algorithm 3 after Advect. */
SPRINGLS__FN springls_status springls__elastic_step(springls_context *ctx, bool one_to_one)
{
    SPRINGLS__TRY(springls_unsigned_to_signed(ctx));
    SPRINGLS__TRY(springls__follow(ctx, true));
    SPRINGLS__TRY(springls_relax(ctx));
    if (one_to_one) return SPRINGLS_OK;
    SPRINGLS__TRY(springls_fill_gaps(ctx));
    SPRINGLS__TRY(springls_contract(ctx));
    return springls_resample(ctx);
}

/* The chosen algorithm after Advect. */
SPRINGLS__FN springls_status springls__after_advect(springls_context *ctx, const springls_step_desc *step)
{
    if (step->mode == SPRINGLS_ADVECT_ONLY) return SPRINGLS_OK;
    SPRINGLS__TRY(step->mode == SPRINGLS_FLUID ? springls__fluid_step(ctx, step->one_to_one) : springls__elastic_step(ctx, step->one_to_one));
    return ctx->model.params.volume_lock ? springls__staged(ctx, SPRINGLS_STAGE_VOLUME_LOCK, springls__volume_lock) : SPRINGLS_OK;
}

/* One step of at most *dt, in which no particle goes further than `longest` voxels (0: any way); *dt becomes the time that has
   passed. A force may be stronger during the step than at its start: then a shorter one is tried, a little shorter than would
   do if the force were even, and at last any way is allowed. */
SPRINGLS__FN springls_status springls__substep(springls_context *ctx, const springls_step_desc *step, float longest, float *dt, float *moved)
{
    enum { TRIES = 40 };
    springls_status status = SPRINGLS_OK;
    double started;
    int tries;
    if (!ctx->model.params.volume_lock) {
        ctx->locked_count = 0;
        ctx->stats.volume_correction = 0.0f;
    }
    if (ctx->model.params.volume_lock && ctx->locked_count == 0) SPRINGLS__TRY(springls__staged(ctx, SPRINGLS_STAGE_VOLUME_LOCK, springls__volume_lock));
    started = springls__stage_begin(ctx, SPRINGLS_STAGE_ADVECT);
    springls__use_device(ctx);
    if (step->mode == SPRINGLS_FLUID && !step->one_to_one && !ctx->model.params.resample_last && springls__resample_due(ctx, ctx->iteration + 1))
        springls__sample_phi(ctx); /* for contract */
    for (tries = 1; tries <= TRIES; tries++) {
        status = springls__advect(ctx, step->forces, (float)ctx->time, *dt, step->stop_at_topology, tries < TRIES ? longest : 0.0f, moved);
        if (status != SPRINGLS_OK || longest == 0.0f || *moved <= longest) break;
        *dt *= springls__max(0.95f * longest / *moved, 0.1f);
    }
    status = springls__told(ctx, status);
    springls__stage_end(ctx, SPRINGLS_STAGE_ADVECT, started);
    if (status != SPRINGLS_OK) return status;
    ctx->time += (double)*dt;
    ctx->iteration++;
    ctx->stats.steps++;
    ctx->model.set.step = (uint32_t)ctx->stats.steps & 0x3fffffffu;
    return springls__after_advect(ctx, step);
}

enum { SPRINGLS__MOST_PARTS = 10000 };

/* The rest of a step is cut into parts as equal as the force allows: *dt is the longest that the last part permitted. */
SPRINGLS__FN springls_status springls__substeps(springls_context *ctx, const springls_step_desc *step, float dt)
{
    const float longest = step->max_displacement, growth = 1.5f;
    const double end = ctx->time + (double)step->dt;
    float left = step->dt, moved;
    int parts;
    for (parts = 0; left > 1e-6f * step->dt; parts++) {
        float taken = left / (springls__floor(left / dt * 0.9999f) + 1.0f);
        if (ctx->time + (double)taken == ctx->time)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: at time %g a sub-step of %g is nothing", ctx->time, (double)taken);
        if (parts == SPRINGLS__MOST_PARTS)
            return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps: the force has grown", SPRINGLS__MOST_PARTS);
        SPRINGLS__TRY(springls__substep(ctx, step, longest * 1.0001f, &taken, &moved));
        left = (float)(end - ctx->time);
        dt = taken * (growth * moved > longest ? longest / moved : growth);
    }
    ctx->time = end;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__step(springls_context *ctx, const springls_step_desc *step)
{
    float speed, limit, dt, moved;
    if (!step || !step->forces || !(step->dt >= 0.0f && step->dt < FLT_MAX) || !(step->max_displacement >= 0.0f && step->max_displacement < FLT_MAX))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: forces is NULL, or dt or max_displacement is negative or not finite");
    if (step->max_displacement > 0.0f && step->max_displacement < 1e-3f)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: max_displacement is below a thousandth of a voxel");
    if (step->mode != SPRINGLS_FLUID && step->mode != SPRINGLS_ELASTIC && step->mode != SPRINGLS_ADVECT_ONLY)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: there is no mode %d", (int)step->mode);
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "step: there are no springls");
    dt = step->dt;
    if (dt > 0.0f && step->max_displacement == 0.0f) return springls__substep(ctx, step, 0.0f, &dt, &moved);
    limit = step->max_displacement > 0.0f ? step->max_displacement : ctx->model.params.d_max;
    SPRINGLS__TRY(springls_max_speed(ctx, step->forces, (float)ctx->time, &speed));
    if (dt == 0.0f) { /* section 4.8: dt = d_max / f_max */
        dt = speed > 1e-6f ? limit / speed : 0.0f;
        return springls__substep(ctx, step, 0.0f, &dt, &moved);
    }
    if (!(speed * dt <= (float)SPRINGLS__MOST_PARTS * limit))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "step: dt needs more than %d sub-steps of max_displacement", SPRINGLS__MOST_PARTS);
    return springls__substeps(ctx, step, speed * dt > limit ? limit / speed : dt);
}

SPRINGLS_API springls_status springls_step(springls_context *ctx, const springls_step_desc *step)
{
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    ctx->calls++;
    status = springls__step(ctx, step);
    ctx->calls--;
    return springls__told(ctx, status);
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
        if (step->stop_at_rest && ctx->stats.moving <= still) return SPRINGLS_OK;
    }
    return SPRINGLS_OK;
}

SPRINGLS_API double springls_time(const springls_context *ctx) { return ctx ? ctx->time : 0.0; }

SPRINGLS_API void springls_set_time(springls_context *ctx, double time)
{
    if (ctx && time > -DBL_MAX && time < DBL_MAX) ctx->time = time;
}
