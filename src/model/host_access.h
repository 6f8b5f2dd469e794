/* host_access.h - what calls that run on the host begin and end with. */
#ifndef SPRINGLS__MODEL_HOST_ACCESS_H
#define SPRINGLS__MODEL_HOST_ACCESS_H

#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "bvh.h"
#include "constellation.h"
#include "grid.h"

/* Empty model, empty grid. */
SPRINGLS__FN void springls__clear_model(springls_context *ctx)
{
    springls__abandon_step(ctx);
    ctx->model.set.count = ctx->model.set.at_edges = 0;
    ctx->model.set.next_id = ctx->model.set.step = 0;
    ctx->attribute_count = 0;
    ctx->iteration = 0;
    ctx->locked_count = 0;
    ctx->time = 0.0;
    memset(&ctx->stats, 0, sizeof ctx->stats);
    springls__grids_clear(ctx);
    springls__surface_forget(&ctx->original);
    springls__constellation_changed(ctx);
}

/* On failure the model is left empty. */
SPRINGLS__FN springls_status springls__clear_on_failure(springls_context *ctx, springls_status status)
{
    if (status != SPRINGLS_OK) springls__clear_model(ctx);
    return status;
}

/* A failure of the backend is told once, at the end of the outermost call, when all has been done that can be. */
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

/* From now on they run here, on all of the model: for inputs and queries. */
SPRINGLS__FN springls_status springls__use_host(springls_context *ctx, bool writes)
{
    ctx->on_device = false;
    if (ctx->calls > 0 || !ctx->step.active) springls__forget_work(ctx); /* a step that has been left still needs it */
    return springls__report_device_failure(ctx, springls__to_host(ctx, SPRINGLS__ALL_BITS & ~SPRINGLS__SCRATCH_BITS,
                                                 writes ? SPRINGLS__ALL_BITS & ~SPRINGLS__SCRATCH_BITS : 0));
}

/* Brings what is about to be read; it changes nothing that anybody can see. */
SPRINGLS__FN springls_status springls__ensure_on_host(const springls_context *ctx, uint64_t reads)
{
    springls_context *owner = (springls_context *)ctx;
    return owner ? springls__report_device_failure(owner, springls__to_host(owner, reads, 0)) : SPRINGLS_OK;
}

#endif
