/* mirror.h - the reflection that maps a body onto itself. */
#ifndef EXAMPLES_IMAGING_MIRROR_H
#define EXAMPLES_IMAGING_MIRROR_H

#include "imaging/volume.h"

#include <stdint.h>

/* The map x -> m x + t of world places with det m = -1. */
struct mirror {
    double m[3][3], t[3];
    double misfit; /* root mean square of the remaining differences, in the unit of `values` */
};

/* Finds the reflection in the plane x = 0 followed by a rigid motion with the smallest differences between `values` (one float
 * a voxel of the image) at the reflected and at the original places of the voxels with mask = 1 and those within `around` mm:
 * least squares by Gauss-Newton, from coarse to fine. Returns false if memory is short, or if the reflected mask lies outside
 * the image for every plane. */
bool mirror_find(const struct volume *image, const float *values, const uint8_t *mask, float around, struct mirror *mirror);

/* Samples `values` of one grid at another grid's voxels, reflected: result(x) = values(the place that the mirror maps to x);
 * beyond the outermost voxels they are constant. */
void mirror_apply(const struct mirror *mirror, const struct volume *from, const struct volume *to, float *result);

#endif
