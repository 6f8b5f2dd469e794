/* rebuild.h - turns phi into a distance again, and moves the narrow band with the surface.

   Why: steps change phi near its zero level only, and eq. 23, the capsules and the band itself count on |phi| as a distance. The voxels
   beside the zero level come first: phi over its slope, which leaves the zero level where it is (subvoxel). Each sweep then carries
   distances one voxel further out, so that band_half_width sweeps reach the end of the band. Bricks that no distance reaches any more
   become constant, and bricks that the band reaches are added: memory follows the surface. */
#ifndef SPRINGLS__STAGES_REBUILD_H
#define SPRINGLS__STAGES_REBUILD_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/cell_list.h"
#include "../model/constellation.h"
#include "../model/grid.h"

SPRINGLS__FN void springls__redistance_sweeps(springls_context *ctx, int sweeps)
{
    for (; sweeps > 0; sweeps--) {
        springls__run(ctx, SPRINGLS__KERNEL_redistance, ctx->model.grid.active_count, NULL);
        springls__swap_phi(ctx);
    }
}

/* Adds the bricks that the band has reached (band_mask), and drops those that it has left. The cell list lives in bricks. */
SPRINGLS__FN springls_status springls__change_band(springls_context *ctx)
{
    SPRINGLS__TRY(springls__activate_bricks(ctx, SPRINGLS__KERNEL_mark_band, ctx->model.grid.active_count, false));
    if (springls__count_found(ctx, SPRINGLS__COUNT_BRICKS) + springls__count_found(ctx, SPRINGLS__COUNT_BRICKS_ADDED) > 0
        && !springls__cell_list_survives(ctx)) springls__discard_cell_list(ctx);
    return SPRINGLS_OK;
}

/* Moves the band to where phi is small now. */
static const springls__entry springls__band_follow[] = {
    SPRINGLS__ROOM(band_mask, BRICKS)
    SPRINGLS__KERNEL(band, BRICKS)
    SPRINGLS__DO(springls__change_band)
SPRINGLS__END };

/* Returns true while phi is to be swept again: once a voxel of the band. */
SPRINGLS__FN bool springls__sweeps_band(const springls_context *ctx)
{
    return springls__round(ctx) < (int)ctx->model.params.band_half_width;
}

static const springls__entry springls__rebuild[] = {
    SPRINGLS__KERNEL(subvoxel, BRICKS)
    SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__REPEAT_WHILE(springls__sweeps_band)
        SPRINGLS__KERNEL(redistance, BRICKS)
        SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__END
    SPRINGLS__CALL(springls__band_follow)
SPRINGLS__END };

#endif
