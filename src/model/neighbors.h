/* neighbors.h - the neighbour lists of all springls (section 4.8). */
#ifndef SPRINGLS__MODEL_NEIGHBORS_H
#define SPRINGLS__MODEL_NEIGHBORS_H

#include "../runtime/arrays.h"
#include "../runtime/resumable.h"
#include "cell_list.h"

/* Builds the lists, unless fewer relaxations have used them than there are steps in the resampling period: neighbours move
   together, and the closest points slide along their edges (section 4.3.1 keeps the lists during a relaxation for the same
   reason). Ends with a loop. */
SPRINGLS__FN springls_status springls__neighbors_build(springls_context *ctx)
{
    if (ctx->neighbors_age >= 0 && ctx->neighbors_age < ctx->model.params.resample_period) {
        ctx->neighbors_age++;
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)ctx->model.set.count + 1, 0));
    springls__loop(ctx, SPRINGLS__KERNEL_neighbors, ctx->model.set.count, NULL);
    ctx->neighbors_age = 0;
    return SPRINGLS_OK;
}

#endif
