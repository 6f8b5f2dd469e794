/* evolve.h - moves the signed level set to the springls (section 4.5, eq. 23). */
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

enum { SPRINGLS__EVOLVE_OMEGA, SPRINGLS__EVOLVE_PHI, SPRINGLS__EVOLVE_COMMIT };

SPRINGLS__FN springls_status springls__evolve(springls_context *ctx)
{
    switch (ctx->work.phase) {
    case SPRINGLS__EVOLVE_OMEGA:
        SPRINGLS__TRY(springls__omega_build(ctx));
        return springls__next_phase(ctx, SPRINGLS__EVOLVE_PHI);
    case SPRINGLS__EVOLVE_PHI:
        springls__loop(ctx, SPRINGLS__KERNEL_evolve, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__EVOLVE_COMMIT);
    case SPRINGLS__EVOLVE_COMMIT:
    default:
        springls__commit_phi(ctx, 1);
        springls__mark_phi_synced(ctx);
        return SPRINGLS_OK;
    }
}

#endif
