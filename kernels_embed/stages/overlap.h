/* overlap.h - springls that lie in another body (params.contact = SEPARATE): both bodies keep their surfaces while they overlap,
   and phi is that of their union. */
#ifndef SPRINGLS__KERNEL_STAGES_OVERLAP_H
#define SPRINGLS__KERNEL_STAGES_OVERLAP_H

#include "../model/model.h"
#include "../model/neighborhood.h"

/* Returns how far from a springl the surface that it has passed may be, in voxels, when springls have moved by max_displacement
   since phi was last synced: two bodies may have done so against each other. */
SPRINGLS__MATHS float springls__overlap_radius(float max_displacement)
{
    const float least = 2.5f, largest = 4.5f; /* for 1 and 2 voxels, and half of one between springls */
    return springls__clamp(2.0f * max_displacement + 0.5f, least, largest);
}

/* Finds whether springl i lies in another body, by the springls of that one near it. Deep in it there are none, and nothing
   changes. */
SPRINGLS__MATHS void springls__overlap_element(const springls__model *model, springls__arguments args, int i)
{
    float radius = springls__overlap_radius(args.overlap.max_displacement);
    int side = springls__is_asleep(model, i) ? 0 : springls__side_of_springls(model, model->set.s[i].p, i, radius);
    if (side != 0) model->set.overlapped[i] = side < 0;
}

/* Returns on which side of bodies that are near each other x lies: 1 outside of all, -1 in one; 0: no two are near. Where bodies
   overlap phi is that of their union, so what comes out when they part was nowhere in it. */
SPRINGLS__MATHS int springls__side_of_bodies(const springls__model *model, springls__v3 x, float max_displacement)
{
    float radius = springls__overlap_radius(max_displacement);
    int body, pass, side = 1;
    if (model->params.contact != SPRINGLS_CONTACT_SEPARATE) return 0;
    body = springls__nearest_springl(model, x, radius);
    if (body < 0) return 0;
    for (pass = 0; pass < 2 && side > 0; pass++) /* of the bodies but the nearest, then of all */
        side = springls__side_of_springls(model, x, pass ? -1 : body, radius);
    return side;
}

#endif
