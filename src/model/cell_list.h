/* cell_list.h - the hash grid (section 4.8): lists springls by the cell of their particle, by counting sort. Numbers ascend in a
   cell, and no cell overflows. A springl with too large a bounding radius is in the list `unbinned` instead, so that one huge
   triangle does not widen every search; so is one whose particle lies outside all active bricks: the list leaves the grid as it
   is. Stages make such bricks active first (cell_bricks.h), readers for the time of reading (solver/follow.h). */
#ifndef SPRINGLS__MODEL_CELL_LIST_H
#define SPRINGLS__MODEL_CELL_LIST_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"

/* Finds the largest bounding radius after triangles have changed. Returns false if a springl has become too large, or is no
   longer, or is outside: the list is to be built anew then. */
SPRINGLS__FN bool springls__update_radii(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_counts_clear, SPRINGLS__COUNT_BRICKS, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_cells_radius, ctx->model.set.count, NULL);
    springls__note_counts(ctx, SPRINGLS__COUNT_OUTSIDE, SPRINGLS__COUNT_BRICKS);
    if (springls__count_found(ctx, SPRINGLS__COUNT_UNBINNED) > 0) return false;
    ctx->model.cells.bounding_radius = springls__float_of_bits((int32_t)springls__count_found(ctx, SPRINGLS__COUNT_RADIUS));
    return true;
}

/* Finds the cells of all springls and counts them, and those in no cell. */
SPRINGLS__FN void springls__count_cells(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    springls__arguments args;
    args.cell_key.first = ctx->keyed;
    springls__run(ctx, SPRINGLS__KERNEL_cell_key, count - ctx->keyed, &args);
    springls__run(ctx, SPRINGLS__KERNEL_counts_clear, SPRINGLS__COUNT_BRICKS, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_cells_clear, ctx->model.grid.active_count, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_cells_count, count, NULL);
    springls__note_counts(ctx, SPRINGLS__COUNT_OUTSIDE, SPRINGLS__COUNT_BRICKS);
    ctx->particles_outside = (int)springls__count_found(ctx, SPRINGLS__COUNT_OUTSIDE);
    ctx->keyed = ctx->particles_outside ? 0 : count; /* bricks that come change the keys of those outside */
    ctx->model.cells.bounding_radius = springls__float_of_bits((int32_t)springls__count_found(ctx, SPRINGLS__COUNT_RADIUS));
    ctx->model.cells.unbinned_count = (int)springls__count_found(ctx, SPRINGLS__COUNT_UNBINNED);
}

/* Lists the springls that springls__count_cells has counted. */
SPRINGLS__FN springls_status springls__list_cells(springls_context *ctx)
{
    const int count = ctx->model.set.count, bricks = ctx->model.grid.active_count;
    const bool sorted = springls__runs_in_order(ctx);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, cell_count, bricks));
    springls__run(ctx, SPRINGLS__KERNEL_cells_prefix, bricks, NULL);
    springls__scan_later(ctx, SPRINGLS__COUNT_NOW, SPRINGLS__ROLE_ARRAY(cell_count), bricks);
    springls__run(ctx, SPRINGLS__KERNEL_cells_base, bricks, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_cells_scatter, count, NULL);
    if (!sorted) springls__run(ctx, SPRINGLS__KERNEL_cells_sort, bricks, NULL);
    if (ctx->model.cells.unbinned_count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, unbinned_number, count));
    springls__run(ctx, SPRINGLS__KERNEL_unbinned_flag, count, NULL);
    springls__scan_later(ctx, SPRINGLS__COUNT_NOW, SPRINGLS__ROLE_ARRAY(unbinned_number), count);
    springls__run(ctx, SPRINGLS__KERNEL_unbinned_scatter, count, NULL);
    return SPRINGLS_OK;
}

/* Returns whether the list is as it would be built now, after bricks have come or gone: no springl was in those that went. */
SPRINGLS__FN bool springls__cell_list_survives(const springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    int i, count = 0;
    if (ctx->on_device || !ctx->particles_listed || ctx->particles_outside || ctx->model.cells.unbinned_count) return false;
    for (i = 0; i < g->active_count; i++) {
        const uint32_t *cell = springls__cells_of(g, g->active[i]);
        count += (int)(cell[SPRINGLS__CELLS - 1] - cell[0]);
    }
    return count == ctx->model.set.count;
}

/* Builds the lists if springls have changed since they were built. ctx->particles_outside: how many lie outside active bricks. */
SPRINGLS__FN springls_status springls__cell_list_build(springls_context *ctx)
{
    const size_t n = (size_t)ctx->model.set.count;
    if (ctx->cells_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow_all(ctx, SPRINGLS__BIT(IDS) | SPRINGLS__BIT(UNBINNED), n + 1, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_KEY, n + 1, (size_t)ctx->keyed));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_PLACES, n + 8, 0));
    ctx->cells_fresh = ctx->particles_listed && springls__update_radii(ctx);
    if (ctx->cells_fresh) return SPRINGLS_OK;
    if (ctx->particles_listed) ctx->keyed = 0; /* a springl has become too large for its cell, or is no longer */
    ctx->particles_listed = false; /* until all of the list is new */
    springls__count_cells(ctx);
    SPRINGLS__TRY(springls__list_cells(ctx));
    if (ctx->lost) return ctx->backend_status;
    ctx->cells_fresh = ctx->particles_listed = true;
    return SPRINGLS_OK;
}

#endif
