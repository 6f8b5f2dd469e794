/* neighbors.h - the neighbour lists of all springls (section 4.8). */
#ifndef SPRINGLS__MODEL_NEIGHBORS_H
#define SPRINGLS__MODEL_NEIGHBORS_H

#include "../runtime/arrays.h"
#include "../runtime/resumable.h"
#include "cell_list.h"

/* Builds the lists, unless fewer relaxations have used them than there are steps in the resampling period: neighbours move
   together, and the closest points slide along their edges (section 4.3.1 keeps the lists during a relaxation for the same
   reason). Springls that have woken since get theirs then. Ends with a loop. */
SPRINGLS__FN springls_status springls__neighbors_build(springls_context *ctx)
{
    springls__arguments args;
    args.neighbors.missing = ctx->neighbors_age >= 0 && ctx->neighbors_age < ctx->model.params.resample_period;
    if (args.neighbors.missing) {
        ctx->neighbors_age++;
        if (!ctx->neighbors_missing) return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (!args.neighbors.missing) {
        SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)ctx->model.set.count + 1, 0));
        ctx->neighbors_age = 0;
    }
    springls__loop(ctx, SPRINGLS__KERNEL_neighbors, ctx->model.set.count, &args);
    ctx->neighbors_missing = ctx->model.grid.some_asleep != 0;
    return SPRINGLS_OK;
}

#endif
