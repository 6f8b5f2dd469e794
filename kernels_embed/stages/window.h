/* window.h - the grid as a window that moves with the model: how near springls are to its border, and which have left it. */
#ifndef SPRINGLS__KERNEL_STAGES_WINDOW_H
#define SPRINGLS__KERNEL_STAGES_WINDOW_H

#include "../model/grid.h"
#include "../model/model.h"

#define SPRINGLS__EXTENT_BEYOND 1048576.0f /* voxels: further than a particle is after one advect */

/* Returns by how much x lies nearer to the border of the window than `margin` (voxels), along the axis where that is most. */
SPRINGLS__MATHS float springls__nearness(const springls__grid *g, springls__v3 x, float margin)
{
    float dx = springls__max(margin - x.x, x.x + margin - (float)(g->size[0] - 1));
    float dy = springls__max(margin - x.y, x.y + margin - (float)(g->size[1] - 1));
    float dz = springls__max(margin - x.z, x.z + margin - (float)(g->size[2] - 1));
    return springls__max(springls__max(dx, dy), dz);
}

/* Finds the extent of the particle of springl i. side 0: into the margin of the window, voxels; 1, 2, ... 6: along -x, x, -y, y,
   -z, z, from SPRINGLS__EXTENT_BEYOND on the other side. */
SPRINGLS__MATHS void springls__extent_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__v3 p = model->set.s[i].p;
    const int side = args.extent.side;
    float along = side < 3 ? p.x : side < 5 ? p.y : p.z;
    if (side == 0) springls__extent(model)[i] = springls__nearness(&model->grid, p, args.extent.margin);
    else springls__extent(model)[i] = (side & 1 ? -along : along) + SPRINGLS__EXTENT_BEYOND;
}

/* Finds whether contract removes springl i because it has left the window: 1. */
SPRINGLS__MATHS void springls__departed_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__has_departed(model)[i] = springls__contract_action(model)[i] == SPRINGLS__REMOVE
                                           && springls__nearness(&model->grid, model->set.s[i].p, -0.5f) > 0.0f
                                       ? 1 : 0;
}

#endif
