/* mirror.h - the other side of a body: the reflection that lays an image onto itself. */
#ifndef EXAMPLES_IMAGING_MIRROR_H
#define EXAMPLES_IMAGING_MIRROR_H

#include "imaging/volume.h"

#include <stdint.h>

/* World to world: x -> m x + t with det m = -1. */
struct mirror {
    double m[3][3], t[3];
    double misfit; /* root mean square of the differences it leaves, in the unit of `values` */
};

/* The reflection in the plane x = 0, then the rigid motion, after which `values` (the image, or what of it matters: one float a
 * voxel) at the reflected places of the voxels with mask = 1, and of those within `around` mm, differs least from what it is
 * at the voxels themselves: least squares by Gauss and Newton, from coarse to fine. False: memory is short, or the reflected
 * mask lies outside the image wherever the plane is. */
bool mirror_find(const struct volume *image, const float *values, const uint8_t *mask, float around, struct mirror *mirror);

/* `values` of one grid on another one's voxels, reflected: result(x) = values(the place that the mirror takes to x); beyond
 * the outermost voxels they stay constant. */
void mirror_apply(const struct mirror *mirror, const struct volume *from, const struct volume *to, float *result);

#endif
