/* topology.h - topology preservation (section 4.5, after Han et al.): a voxel may change sides only where it is simple.
   Inside is 6-connected and outside 26-connected, here and in marching cubes.

   Why in eight colours: whether a voxel is simple depends on the 26 around it, so two voxels that touch must not change at once, or
   both may be simple and the pair not. Voxels of one colour, 2 apart along each axis, never touch: they are decided in parallel,
   and the result does not depend on the order, which devices and threads do not promise. */
#ifndef SPRINGLS__STAGES_TOPOLOGY_H
#define SPRINGLS__STAGES_TOPOLOGY_H

#include "../runtime/launch.h"

/* Takes over the changes of phi_next that keep the topology. A pass moves the front by about a voxel: `passes` of them allow a
   step of that many voxels. */
SPRINGLS__FN void springls__preserve_topology(springls_context *ctx, int passes)
{
    springls__arguments args;
    for (; passes > 0; passes--)
        for (args.commit_simple.color = 0; args.commit_simple.color < 8; args.commit_simple.color++)
            springls__run(ctx, SPRINGLS__KERNEL_commit_simple_color, ctx->model.grid.active_count, &args);
    springls__run(ctx, SPRINGLS__KERNEL_revert_unsimple, ctx->model.grid.active_count, NULL);
}

#endif
