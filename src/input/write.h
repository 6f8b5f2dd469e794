/* write.h - puts springls where the caller has moved them: phi follows in the next step, as after advect. */
#ifndef SPRINGLS__INPUT_WRITE_H
#define SPRINGLS__INPUT_WRITE_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/follow.h"
#include "../solver/step.h"
#include "../stages/sleep.h"

/* Sends one of the caller's arrays to the device. NULL: nothing. */
SPRINGLS__FN springls_status springls__upload_written(springls_context *ctx, springls__array array, const float *data,
                                                      size_t points)
{
    return data ? (ctx->backend->upload)(ctx, &ctx->memory[array], data, points * sizeof(springls__v3)) : SPRINGLS_OK;
}

/* Writes springls on the device, which is sent the range alone. */
SPRINGLS__FN springls_status springls__write_on_device(springls_context *ctx, const springls__arguments *args, int count,
                                                       const float *vertices, const float *particles)
{
    SPRINGLS__TRY(springls__to_device(ctx, springls__kernels[SPRINGLS__KERNEL_write].writes));
    SPRINGLS__TRY(springls__upload_written(ctx, SPRINGLS__ARRAY_WRITTEN_VERTICES, vertices, 3 * (size_t)count));
    SPRINGLS__TRY(springls__upload_written(ctx, SPRINGLS__ARRAY_WRITTEN_PARTICLES, particles, (size_t)count));
    return (ctx->backend->run)(ctx, SPRINGLS__KERNEL_write, count, *args);
}

/* Writes a range of springls. The array that is NULL follows the other one. */
SPRINGLS__FN springls_status springls__write(springls_context *ctx, int first, int count, const float *vertices,
                                             const float *particles)
{
    springls__arguments args;
    memset(&args, 0, sizeof args);
    args.write.first = first;
    args.write.vertices = vertices != NULL;
    args.write.particles = particles != NULL;
    if (ctx->on_device) {
        springls_status status = springls__write_on_device(ctx, &args, count, vertices, particles);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    ctx->model.force.written_vertices = (springls__v3 *)(void *)vertices;
    ctx->model.force.written_particles = (springls__v3 *)(void *)particles;
    springls__run(ctx, SPRINGLS__KERNEL_write, count, &args);
    springls__bind(ctx);
    return SPRINGLS_OK;
}

/* Fails when a point of the caller's is not finite, or far outside. first: the first springl's number; each: points a springl. */
SPRINGLS__FN springls_status springls__check_written(springls_context *ctx, const float *points, int first, int count, int each)
{
    size_t i, n = points ? (size_t)count * (size_t)each : 0;
    for (i = 0; i < n; i++)
        if (!springls__valid_point(points + 3 * i))
            return springls__fail(ctx, SPRINGLS_NON_FINITE,
                                  "write: a coordinate of springl %d is NaN or not between -1e6 and 1e6 voxels",
                                  first + (int)(i / (size_t)each));
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_write(springls_context *ctx, int first, int count, const float *vertices,
                                            const float *particles)
{
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (springls_step_in_progress(ctx)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "write: a step is in progress");
    SPRINGLS__TRY(springls__finish_step(ctx)); /* an update of chunks */
    if (first < 0 || count < 0 || first > ctx->model.set.count - count)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "write: %d springls from %d on, of %d", count, first,
                              ctx->model.set.count);
    if (count == 0) return SPRINGLS_OK;
    if (!vertices && !particles)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "write: vertices and particles are NULL");
    SPRINGLS__TRY(springls__check_written(ctx, vertices, first, count, 3));
    SPRINGLS__TRY(springls__check_written(ctx, particles, first, count, 1));
    SPRINGLS__TRY(springls__begin_change(ctx));
    springls__use_device(ctx);
    ctx->calls++;
    ctx->lag = ctx->away = FLT_MAX;
    status = springls__write(ctx, first, count, vertices, particles);
    if (status == SPRINGLS_OK) springls__stir(ctx, SPRINGLS__STIR_ALL, first, count);
    ctx->calls--;
    if (status == SPRINGLS_OK) springls__constellation_changed(ctx); /* neighbours may be others now */
    return springls__report_device_failure(ctx, status);
}

#endif
