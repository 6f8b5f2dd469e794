/* relax.h - Algorithm 1: moves every springl towards equilibrium with its neighbors, all at once (Jacobi). */
#ifndef SPRINGLS__STAGES_RELAX_H
#define SPRINGLS__STAGES_RELAX_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "../model/neighbors.h"

enum {
    SPRINGLS__RELAX_BEGIN,
    SPRINGLS__RELAX_SHORTENED,
    SPRINGLS__RELAX_FIND_NEIGHBORS,
    SPRINGLS__RELAX_NEIGHBORS_FOUND,
    SPRINGLS__RELAX_ITERATE,
    SPRINGLS__RELAX_ITERATED,
    SPRINGLS__RELAX_COVER,
    SPRINGLS__RELAX_COVERED
};

/* Replaces the springls by those that a kernel has written to relaxed_springls. */
SPRINGLS__FN void springls__take_relaxed(springls_context *ctx)
{
    springls__swap(ctx, SPRINGLS__ARRAY_S, SPRINGLS__ROLE_ARRAY(relaxed_springls));
    springls__triangles_changed(ctx);
}

/* Relaxes springls; with `covers` each gets the triangle of its share at the end, if params.cover. */
SPRINGLS__FN springls_status springls__relax_and(springls_context *ctx, bool covers)
{
    const springls_params *params = &ctx->model.params;
    const int count = ctx->model.set.count;
    springls__arguments args;
    args.relax.kept = ctx->work.kept;
    switch (ctx->work.phase) {
    case SPRINGLS__RELAX_BEGIN:
        if (count == 0 || params->relax_iterations == 0) return SPRINGLS_OK;
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, relaxed_springls, count));
        if (!params->cover) return springls__next_phase(ctx, SPRINGLS__RELAX_FIND_NEIGHBORS);
        springls__loop(ctx, SPRINGLS__KERNEL_shorten_arms, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__RELAX_SHORTENED);
    case SPRINGLS__RELAX_SHORTENED:
        springls__take_relaxed(ctx); /* springls with their own arms stay in relaxed_springls, for those that are asleep */
        ctx->work.kept = true;
        return springls__next_phase(ctx, SPRINGLS__RELAX_FIND_NEIGHBORS);
    case SPRINGLS__RELAX_FIND_NEIGHBORS:
        SPRINGLS__TRY(springls__neighbors_build(ctx));
        return springls__next_phase(ctx, SPRINGLS__RELAX_NEIGHBORS_FOUND);
    case SPRINGLS__RELAX_NEIGHBORS_FOUND:
        springls__neighbors_found(ctx);
        return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATE);
    case SPRINGLS__RELAX_ITERATE:
        if (ctx->work.repetition == params->relax_iterations)
            return covers && params->cover ? springls__next_phase(ctx, SPRINGLS__RELAX_COVER) : SPRINGLS_OK;
        springls__loop(ctx, SPRINGLS__KERNEL_relax, count, &args);
        return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATED);
    case SPRINGLS__RELAX_ITERATED:
        springls__take_relaxed(ctx);
        ctx->work.kept = false;
        ctx->work.repetition++;
        return springls__next_phase(ctx, SPRINGLS__RELAX_ITERATE);
    case SPRINGLS__RELAX_COVER:
        springls__loop(ctx, SPRINGLS__KERNEL_cover, count, &args);
        return springls__next_phase(ctx, SPRINGLS__RELAX_COVERED);
    case SPRINGLS__RELAX_COVERED:
    default:
        springls__take_relaxed(ctx);
        return SPRINGLS_OK;
    }
}

SPRINGLS__FN springls_status springls__relax(springls_context *ctx) { return springls__relax_and(ctx, true); }
SPRINGLS__FN springls_status springls__relax_normals(springls_context *ctx) { return springls__relax_and(ctx, false); }

/* Measures the shares of all springls again, after some springls have come or gone. */
SPRINGLS__FN springls_status springls__cover(springls_context *ctx)
{
    springls_status status = springls__next_stage(ctx, springls__relax);
    ctx->work.repetition = ctx->model.params.relax_iterations;
    return status;
}

enum { SPRINGLS__ORIENT_TURN, SPRINGLS__ORIENT_TURNED };

/* Turns flipped triangles round (section 4.3.1). */
SPRINGLS__FN springls_status springls__orient(springls_context *ctx)
{
    if (ctx->work.phase == SPRINGLS__ORIENT_TURN) {
        if (ctx->model.params.contact == SPRINGLS_CONTACT_SEPARATE) SPRINGLS__TRY(springls__cell_list_cover(ctx));
        springls__loop(ctx, SPRINGLS__KERNEL_orient, ctx->model.set.count, NULL);
        return springls__next_phase(ctx, SPRINGLS__ORIENT_TURNED);
    }
    ctx->springl_surface_fresh = false;
    return SPRINGLS_OK;
}

#endif
