/* stage_clock.h - begins and ends every stage: its clock and the caller's trace. */
#ifndef SPRINGLS__RUNTIME_STAGE_CLOCK_H
#define SPRINGLS__RUNTIME_STAGE_CLOCK_H

#include "residency.h"

#if defined(_OPENMP)
#include <omp.h>
#endif
#include <time.h>

/* Returns the wall clock in seconds: POSIX's, of which strict C hides the one that nobody sets. On Windows clock() is one. */
#if defined(SPRINGLS_THREADS) && !defined(_WIN32)
#include <sys/time.h>
SPRINGLS__FN double springls__wall_seconds(void)
{
#if defined(CLOCK_MONOTONIC)
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
#else
    struct timeval now;
    gettimeofday(&now, NULL);
    return (double)now.tv_sec + 1e-6 * (double)now.tv_usec;
#endif
}
#endif

/* Returns the time in seconds: by the caller's clock, else the wall clock, else processor time. */
SPRINGLS__FN double springls__now(const springls_context *ctx)
{
    if (ctx->desc.trace.now) return (ctx->desc.trace.now)(ctx->desc.trace.user);
#if defined(_OPENMP)
    return omp_get_wtime();
#elif defined(SPRINGLS_THREADS) && !defined(_WIN32)
    return springls__wall_seconds();
#else
    return (double)clock() / (double)CLOCKS_PER_SEC;
#endif
}

/* Returns when the stage has begun, for springls__stage_end. */
SPRINGLS__FN double springls__stage_begin(springls_context *ctx, springls_stage stage)
{
    if (ctx->desc.trace.stage) (ctx->desc.trace.stage)(ctx->desc.trace.user, (int)stage, 1, 0.0);
    return springls__now(ctx);
}

SPRINGLS__FN void springls__stage_end(springls_context *ctx, springls_stage stage, double started)
{
    double seconds;
    if (ctx->on_device && ctx->backend->timed && (ctx->backend->finish)(ctx) != SPRINGLS_OK) springls__fall_back_to_host(ctx);
    seconds = springls__now(ctx) - started;
    ctx->stats.seconds[stage] += seconds;
    if (ctx->desc.trace.stage) (ctx->desc.trace.stage)(ctx->desc.trace.user, (int)stage, 0, seconds);
}

SPRINGLS_API const char *springls_stage_name(springls_stage stage)
{
    static const char *const names[SPRINGLS_STAGE_COUNT] = { "advect", "relax", "contract", "resample", "evolve", "rebuild",
                                                             "fill_gaps", "track", "unsigned_to_signed", "project",
                                                             "keep_edges", "volume_lock", "components" };
    return (int)stage >= 0 && stage < SPRINGLS_STAGE_COUNT ? names[stage] : "";
}

#endif
