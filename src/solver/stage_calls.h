/* stage_calls.h - the public calls of single stages. Each ends a step in progress first. */
#ifndef SPRINGLS__SOLVER_STAGE_CALLS_H
#define SPRINGLS__SOLVER_STAGE_CALLS_H

#include "../runtime/finite.h"
#include "../runtime/errors.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../runtime/stage_clock.h"
#include "../model/host_access.h"
#include "../stages/advect.h"
#include "../stages/contract.h"
#include "../stages/evolve.h"
#include "../stages/fill_gaps.h"
#include "../stages/rebuild.h"
#include "../stages/relax.h"
#include "../stages/resample.h"
#include "../stages/track.h"
#include "../stages/unsigned_to_signed.h"
#include "step.h"

/* Runs one stage under its clock. */
SPRINGLS__FN springls_status springls__run_stage_call(springls_context *ctx, springls_stage stage, const springls__entry *table)
{
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__begin_change(ctx));
    ctx->lag = FLT_MAX; /* the next step is a whole one */
    springls__use_device(ctx);
    springls__wake_all(ctx);
    ctx->calls++;
    status = springls__run_stage(ctx, (int)stage, table);
    ctx->calls--;
    return springls__report_device_failure(ctx, status);
}

/* Fails when a time that callbacks are to get is not finite. */
SPRINGLS__FN springls_status springls__check_time(springls_context *ctx, const char *call, float time)
{
    if (springls__finite_float(time)) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: the time is %g, not finite", call, (double)time);
}

SPRINGLS_API springls_status springls_max_speed(springls_context *ctx, const springls_forces *forces, float time, float *speed)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!speed) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "max_speed: speed is NULL");
    *speed = 0.0f;
    if (!forces) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "max_speed: forces is NULL");
    SPRINGLS__TRY(springls__check_time(ctx, "max_speed", time));
    SPRINGLS__TRY(forces->curvature_weight != 0.0f ? springls__begin_reading(ctx) : springls__finish_step(ctx));
    return springls__max_speed(ctx, "max_speed", forces, time, speed);
}

SPRINGLS_API springls_status springls_advect(springls_context *ctx, const springls_forces *forces, float time, float dt)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_time(ctx, "advect", time));
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__motion_begin(ctx, forces, time, dt));
    springls__warn_of_region(ctx, forces);
    return springls__run_stage_call(ctx, SPRINGLS_STAGE_ADVECT, springls__advect);
}

/* Returns the table of a stage that springls_run_stage runs; NULL: it runs none of that number. */
SPRINGLS__FN const springls__entry *springls__table_of_stage(springls_stage stage)
{
    switch (stage) {
    case SPRINGLS_STAGE_RELAX: return springls__relax;
    case SPRINGLS_STAGE_CONTRACT: return springls__contract_now;
    case SPRINGLS_STAGE_RESAMPLE: return springls__resample;
    case SPRINGLS_STAGE_EVOLVE: return springls__evolve;
    case SPRINGLS_STAGE_REBUILD: return springls__rebuild;
    case SPRINGLS_STAGE_FILL_GAPS: return springls__fill_gaps;
    case SPRINGLS_STAGE_TRACK: return springls__track;
    case SPRINGLS_STAGE_UNSIGNED_TO_SIGNED: return springls__unsigned_to_signed;
    default: return NULL;
    }
}

SPRINGLS_API springls_status springls_run_stage(springls_context *ctx, springls_stage stage)
{
    const springls__entry *table = springls__table_of_stage(stage);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (table) return springls__run_stage_call(ctx, stage, table);
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "run_stage: stage %d does not run alone: it may be %d to %d", (int)stage,
                          (int)SPRINGLS_STAGE_RELAX, (int)SPRINGLS_STAGE_UNSIGNED_TO_SIGNED);
}

#endif
