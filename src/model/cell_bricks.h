/* cell_bricks.h - makes bricks active that the search for springls needs. Stages do so; readers leave the grid as it is, and build the
   cell list by springls__read_cell_list (solver/follow.h). */
#ifndef SPRINGLS__MODEL_CELL_BRICKS_H
#define SPRINGLS__MODEL_CELL_BRICKS_H

#include "../runtime/arrays.h"
#include "../runtime/residency.h"
#include "cell_list.h"
#include "constellation.h"
#include "grid.h"

/* Builds the cell list, with all particles in active bricks. */
SPRINGLS__FN springls_status springls__cell_list_cover(springls_context *ctx)
{
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (ctx->particles_outside == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__activate_bricks(ctx, SPRINGLS__KERNEL_mark_outside, ctx->model.set.count, true));
    springls__discard_cell_list(ctx);
    return springls__cell_list_build(ctx);
}

/* Activates all bricks within one cell of a particle, also of springls that are in no cell. */
SPRINGLS__FN springls_status springls__cell_list_cover_around(springls_context *ctx)
{
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    return springls__activate_bricks(ctx, SPRINGLS__KERNEL_mark_cover,
                                     ctx->model.grid.active_count + ctx->model.cells.unbinned_count, true);
}

#endif
