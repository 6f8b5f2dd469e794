/* relax.h - Algorithm 1: moves every springl towards equilibrium with its neighbors, all at once (Jacobi). */
#ifndef SPRINGLS__STAGES_RELAX_H
#define SPRINGLS__STAGES_RELAX_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/neighbors.h"

enum { SPRINGLS__RELAX_FIND_NEIGHBORS, SPRINGLS__RELAX_ITERATE, SPRINGLS__RELAX_ITERATED };

SPRINGLS__FN springls_status springls__relax(springls_context *ctx)
{
    switch (ctx->work.phase) {
    case SPRINGLS__RELAX_FIND_NEIGHBORS:
        if (ctx->model.set.count == 0 || ctx->model.params.relax_iterations == 0) return SPRINGLS_OK;
        SPRINGLS__TRY(springls__neighbors_build(ctx));
        return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATE);
    case SPRINGLS__RELAX_ITERATE:
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, relaxed_springls, ctx->model.set.count));
        springls__loop(ctx, SPRINGLS__KERNEL_relax, ctx->model.set.count, NULL);
        return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATED);
    case SPRINGLS__RELAX_ITERATED:
    default:
        springls__swap(ctx, SPRINGLS__ARRAY_S, SPRINGLS__ROLE_ARRAY(relaxed_springls));
        springls__constellation_moved(ctx);
        if (++ctx->work.repetition < ctx->model.params.relax_iterations)
            return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATE);
        return SPRINGLS_OK;
    }
}

/* Turns flipped triangles round (section 4.3.1). */
SPRINGLS__FN springls_status springls__orient(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_orient, ctx->model.set.count, NULL);
    ctx->springl_surface_fresh = false;
    return SPRINGLS_OK;
}

#endif
