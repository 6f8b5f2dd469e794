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

/* Makes room for the marks of cells with springls that were at an edge. */
SPRINGLS__FN springls_status springls__edge_cells_begin(springls_context *ctx)
{
    return SPRINGLS__RESERVE(ctx, edge_cells, 2 * (size_t)ctx->model.grid.slot_count);
}

SPRINGLS__FN springls_status springls__count_edges(springls_context *ctx)
{
    ctx->model.set.at_edges = springls__count_of(ctx, SPRINGLS__ARRAY_EDGE, ctx->model.set.count, 1);
    return SPRINGLS_OK;
}

/* Notes that springls have been turned about their particles, which stay. */
SPRINGLS__FN springls_status springls__sides_turned(springls_context *ctx)
{
    ctx->omega_fresh = false;
    ctx->springl_surface_fresh = false;
    return SPRINGLS_OK;
}

static const springls__entry springls__edge_normals[] = {
    SPRINGLS__DO(springls__cell_list_cover)
    SPRINGLS__ROOM(side_normal, SPRINGLS)
    SPRINGLS__ROOM(edge_candidate, SPRINGLS)
    SPRINGLS__ROOM(was_at_edge, SPRINGLS)
    SPRINGLS__DO(springls__edge_cells_begin)
    SPRINGLS__KERNEL(edge_normal, SPRINGLS)
SPRINGLS__END };

SPRINGLS__FN void springls__search_args(const springls_context *ctx, springls__arguments *args)
{
    (void)ctx;
    args->edge.search = 1;
}

/* Finds the springls at creases (edge), and the normal that each has on its side, in a model that has just been set. Later no others are
   searched for: what bends sharply in motion is no edge. */
static const springls__entry springls__find_edges[] = {
    SPRINGLS__CALL(springls__edge_normals)
    SPRINGLS__KERNEL_WITH(edge_candidate, SPRINGLS, springls__search_args)
    SPRINGLS__KERNEL(edge_side, SPRINGLS)
    SPRINGLS__DO(springls__count_edges)
SPRINGLS__END };

/* Turns springls at a crease, each about its particle, into their sides. */
static const springls__entry springls__keep_edges[] = {
    SPRINGLS__CALL(springls__edge_normals)
    SPRINGLS__KERNEL(edge_cells, SLOTS)
    SPRINGLS__KERNEL(edge_candidate, SPRINGLS)
    SPRINGLS__KERNEL(edge_side, SPRINGLS)
    SPRINGLS__DO(springls__count_edges)
    SPRINGLS__KERNEL(edge_turn, SPRINGLS)
    SPRINGLS__DO(springls__sides_turned)
SPRINGLS__END };

#endif
