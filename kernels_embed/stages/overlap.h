/* overlap.h - springls that lie in another body (params.contact = SEPARATE): both bodies keep their surfaces while they overlap,
   and phi is that of their union. */
#ifndef SPRINGLS__KERNEL_STAGES_OVERLAP_H
#define SPRINGLS__KERNEL_STAGES_OVERLAP_H

#include "../model/model.h"
#include "../model/neighborhood.h"

/* Finds whether springl i lies in another body, by the springls of that one near it. Deep in it there are none, and nothing
   changes. */
SPRINGLS__MATHS void springls__overlap_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = 2.5f; /* voxels: springls move by no more than two at once */
    int side = springls__is_asleep(model, i) ? 0 : springls__side_of_springls(model, model->set.s[i].p, i, radius);
    (void)args;
    if (side != 0) model->set.overlapped[i] = side < 0;
}

#endif
