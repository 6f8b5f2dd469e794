/* neighbors.h - the neighbour lists of all springls (section 4.8). */
#ifndef SPRINGLS__MODEL_NEIGHBORS_H
#define SPRINGLS__MODEL_NEIGHBORS_H

#include "../runtime/arrays.h"
#include "../runtime/resumable.h"
#include "cell_bricks.h"

/* Builds the lists where they are used up: one build serves resample_period + 1 relaxations, because neighbours move together, and the
   closest points slide along their edges (section 4.3.1 keeps the lists during a relaxation for the same reason). Springls that have woken
   since get theirs then. Ends with a loop, after which springls__neighbors_found is called. */
SPRINGLS__FN springls_status springls__neighbors_build(springls_context *ctx)
{
    springls__arguments args;
    args.neighbors.missing = ctx->neighbors_uses > 0;
    if (args.neighbors.missing && !ctx->neighbors_missing) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    if (!args.neighbors.missing)
        SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEIGHBORS, (size_t)ctx->model.set.count + 1, 0));
    springls__loop(ctx, SPRINGLS__KERNEL_neighbors, ctx->model.set.count, &args);
    return SPRINGLS_OK;
}

/* Counts the use of the lists, which are complete now. */
SPRINGLS__FN springls_status springls__neighbors_found(springls_context *ctx)
{
    const bool searched = ctx->neighbors_uses == 0 || ctx->neighbors_missing;
    ctx->neighbors_missing = searched && ctx->model.grid.some_asleep;
    ctx->neighbors_uses = ctx->neighbors_uses > 0 ? ctx->neighbors_uses - 1 : ctx->model.params.resample_period;
    return SPRINGLS_OK;
}

#endif
