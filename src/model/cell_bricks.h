/* cell_bricks.h - makes bricks active that the search for springls needs. Stages do so; readers leave the grid as it is, and build the
   cell list by springls__read_cell_list (solver/follow.h). */
#ifndef SPRINGLS__MODEL_CELL_BRICKS_H
#define SPRINGLS__MODEL_CELL_BRICKS_H

#include "../runtime/arrays.h"
#include "../runtime/residency.h"
#include "cell_list.h"
#include "constellation.h"
#include "grid.h"

/* Activates the bricks that have a particle. Precondition: the cell list. */
SPRINGLS__FN springls_status springls__add_outside_bricks(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    const springls__cell_list *cells = &ctx->model.cells;
    int i, n = 0, *missing, origin[3];
    if (ctx->on_device) {
        springls_status status = (ctx->backend->add_outside_bricks)(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY) | SPRINGLS__BIT(UNBINNED), 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, missing_bricks, ctx->particles_outside));
    missing = springls__missing_bricks(&ctx->model);
    for (i = 0; i < cells->unbinned_count; i++) {
        if (cells->key[cells->unbinned[i]] != SPRINGLS__OUTSIDE_KEY) continue;
        springls__origin_of_place(g, ctx->model.set.s[cells->unbinned[i]].p, origin);
        missing[n++] = springls__brick_at(g, origin[0], origin[1], origin[2]);
    }
    return springls__grid_add_bricks(ctx, missing, n);
}

/* Builds the cell list, with all particles in active bricks. */
SPRINGLS__FN springls_status springls__cell_list_cover(springls_context *ctx)
{
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (ctx->particles_outside == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__add_outside_bricks(ctx));
    springls__discard_cell_list(ctx);
    return springls__cell_list_build(ctx);
}

/* Activates all bricks within one cell of a particle, also of springls that are in no cell. */
SPRINGLS__FN springls_status springls__cell_list_cover_around(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, d, n = 0, *missing;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    if (ctx->on_device) {
        springls_status status = (ctx->backend->cell_list_cover_around)(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx,
                                    SPRINGLS__BIT(S) | SPRINGLS__BIT(UNBINNED) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(SLOT_BRICK)
                                        | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(ACTIVE),
                                    0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, missing_bricks, 26 * ((size_t)g->active_count + (size_t)ctx->model.cells.unbinned_count)));
    missing = springls__missing_bricks(&ctx->model);
    for (i = 0; i < g->active_count + ctx->model.cells.unbinned_count; i++) {
        int origin[3], at[3];
        uint32_t around = springls__bricks_to_cover(&ctx->model, i, origin);
        for (d = 0; d < 27 && around; d++)
            if ((around >> d & 1u) && springls__brick_around(g, origin, d, at)
                && springls__slot_at(g, at[0], at[1], at[2]) < SPRINGLS__FIRST_SLOT)
                missing[n++] = springls__brick_at(g, at[0], at[1], at[2]);
    }
    return springls__grid_add_bricks(ctx, missing, n);
}

#endif
