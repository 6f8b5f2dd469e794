/* host_access.h - the begin of calls that work on the host, and the end of all calls: failures of the device, an empty model. */
#ifndef SPRINGLS__MODEL_HOST_ACCESS_H
#define SPRINGLS__MODEL_HOST_ACCESS_H

#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "bvh.h"
#include "constellation.h"
#include "grid.h"
#include "transform.h"

/* Empties the model and its grid; keeps memory and parameters. Abandons a step in progress. */
SPRINGLS__FN void springls__clear_model(springls_context *ctx)
{
    springls__abandon_step(ctx);
    ctx->model.set.count = ctx->model.set.at_edges = 0;
    ctx->model.set.next_id = ctx->model.set.step = 0;
    ctx->attribute_count = 0;
    ctx->iteration = 0;
    ctx->component_count = ctx->event_count = ctx->event_part_count = ctx->new_events = 0;
    ctx->last_component_id = ctx->last_contact_body = 0;
    ctx->components_found = ctx->volumes_locked = false;
    ctx->lag = ctx->lag_turned = 0.0f;
    ctx->away = FLT_MAX;
    ctx->opposed = true;
    ctx->saved.in_use = false;
    ctx->time = 0.0;
    springls__windows_reset(ctx);
    memset(&ctx->stats, 0, sizeof ctx->stats);
    springls__grids_clear(ctx);
    springls__surface_forget(&ctx->original);
    springls__constellation_changed(ctx);
}

/* Empties the model if `status` is a failure; returns it. */
SPRINGLS__FN springls_status springls__clear_on_failure(springls_context *ctx, springls_status status)
{
    if (status != SPRINGLS_OK) springls__clear_model(ctx);
    return status;
}

/* Returns `status`, or, once and at the end of the outermost call, the failure of the device that happened in it. Empties the
   model if that was lost. */
SPRINGLS__FN springls_status springls__report_device_failure(springls_context *ctx, springls_status status)
{
    bool lost = ctx->lost;
    if (ctx->backend_status == SPRINGLS_OK) return status;
    if (ctx->calls > 0) return lost ? ctx->backend_status : status;
    if (lost || status == SPRINGLS_OK) status = ctx->backend_status;
    ctx->backend_status = SPRINGLS_OK;
    ctx->lost = false;
    if (lost) springls__clear_model(ctx);
    return status;
}

/* Runs kernels on the host from now on, and brings all of the model there. writes: the caller changes it, and ends the calm
   of the bricks where it does. */
SPRINGLS__FN springls_status springls__use_host_calmly(springls_context *ctx, bool writes)
{
    springls_status status;
    ctx->on_device = false;
    if (ctx->calls > 0 || !ctx->step.active) springls__forget_work(ctx); /* a step in progress still needs it */
    status = springls__to_host(ctx, SPRINGLS__ALL_BITS & ~SPRINGLS__WORK_BITS,
                               writes ? SPRINGLS__ALL_BITS & ~SPRINGLS__WORK_BITS : 0);
    return springls__report_device_failure(ctx, status);
}

/* The same for inputs, queries and tools that may change all of the model. */
SPRINGLS__FN springls_status springls__use_host(springls_context *ctx, bool writes)
{
    springls_status status = springls__use_host_calmly(ctx, writes);
    if (status == SPRINGLS_OK && writes) springls__wake_all(ctx);
    return status;
}

/* Brings arrays to the host before a call reads them. ctx is const for the caller: the model itself does not change. */
SPRINGLS__FN springls_status springls__ensure_on_host(const springls_context *ctx, uint64_t reads)
{
    springls_context *owner = (springls_context *)ctx;
    return owner ? springls__report_device_failure(owner, springls__to_host(owner, reads, 0)) : SPRINGLS_OK;
}

#endif
