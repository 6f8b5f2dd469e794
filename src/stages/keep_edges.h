/* keep_edges.h - keeps sharp edges sharp (params.keep_edges): a springl at a crease belongs to one side of it. Places stay
   exact when springls move; what wears off are normals, which neighbors across the crease turn, and whatever is averaged over
   both sides. */
#ifndef SPRINGLS__STAGES_KEEP_EDGES_H
#define SPRINGLS__STAGES_KEEP_EDGES_H

#include "../../kernels_embed/stages/keep_edges.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"

enum {
    SPRINGLS__EDGES_NORMALS,
    SPRINGLS__EDGES_CANDIDATES,
    SPRINGLS__EDGES_SIDES,
    SPRINGLS__EDGES_TURN,
    SPRINGLS__EDGES_TURNED
};

/* Finds the springls at creases (edge), and the normal that each has on its side; with `search` in a model that has just been set
   (springls__edge_arguments), else it turns them, each about its particle, into their sides. */
SPRINGLS__FN springls_status springls__sort_sides(springls_context *ctx, bool search)
{
    const int count = ctx->model.set.count;
    springls__arguments args;
    switch (ctx->work.phase) {
    case SPRINGLS__EDGES_NORMALS:
        SPRINGLS__TRY(springls__cell_list_cover(ctx));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, side_normal, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, edge_candidate, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, was_at_edge, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, edge_cells, 2 * (size_t)ctx->model.grid.slot_count));
        springls__loop(ctx, SPRINGLS__KERNEL_edge_normal, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_CANDIDATES);
    case SPRINGLS__EDGES_CANDIDATES:
        args.edge.search = search;
        if (!search) springls__run(ctx, SPRINGLS__KERNEL_edge_cells, ctx->model.grid.slot_count, NULL);
        springls__loop(ctx, SPRINGLS__KERNEL_edge_candidate, count, &args);
        return springls__next_phase(ctx, SPRINGLS__EDGES_SIDES);
    case SPRINGLS__EDGES_SIDES:
        springls__loop(ctx, SPRINGLS__KERNEL_edge_side, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_TURN);
    case SPRINGLS__EDGES_TURN:
        ctx->model.set.at_edges = springls__count_of(ctx, SPRINGLS__ARRAY_EDGE, count, 1);
        if (search) return SPRINGLS_OK;
        springls__loop(ctx, SPRINGLS__KERNEL_edge_turn, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EDGES_TURNED);
    case SPRINGLS__EDGES_TURNED:
    default:
        ctx->omega_fresh = false;
        ctx->springl_surface_fresh = false;
        return SPRINGLS_OK;
    }
}

SPRINGLS__FN springls_status springls__sort_new_sides(springls_context *ctx) { return springls__sort_sides(ctx, true); }

/* Finds the edges of a model that has just been set. Later no others are searched for: what bends sharply in motion is no
   edge. */
SPRINGLS__FN springls_status springls__find_edges(springls_context *ctx)
{
    return springls__run_to_completion(ctx, springls__sort_new_sides);
}

/* Turns springls at a crease into their sides. */
SPRINGLS__FN springls_status springls__keep_edges(springls_context *ctx) { return springls__sort_sides(ctx, false); }

#endif
