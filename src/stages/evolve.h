/* evolve.h - moves the signed level set to the springls (section 4.5, eq. 23).

   This is the paper's way to make phi follow: phi moves down the slope of omega^2 to the nearest springls, about half a voxel an
   iteration, and a little by its own curvature, which smooths it over gaps. The default set takes project.h instead, which goes all the
   way at once. */
#ifndef SPRINGLS__STAGES_EVOLVE_H
#define SPRINGLS__STAGES_EVOLVE_H

#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "topology.h"
#include "unsigned_distance.h"

/* Replaces the level set by phi_next; where topology is preserved, with simple changes only, up to a voxel a pass. */
SPRINGLS__FN void springls__commit_phi(springls_context *ctx, int passes)
{
    if (ctx->model.params.topology == SPRINGLS_TOPOLOGY_PRESERVED) springls__preserve_topology(ctx, passes);
    springls__swap_phi(ctx);
}

SPRINGLS__FN springls_status springls__take_evolved(springls_context *ctx)
{
    springls__commit_phi(ctx, 1);
    return springls__mark_phi_synced(ctx);
}

static const springls__entry springls__evolve[] = {
    SPRINGLS__DO(springls__omega_build) /* eq. 21 */
    SPRINGLS__KERNEL(evolve, BRICKS) /* eq. 23 */
    SPRINGLS__DO(springls__take_evolved)
SPRINGLS__END };

#endif
