/* overlap.h - how well two label maps of the same grid agree.
 *
 * Definitions, because tools differ (A and B = sets of voxels with the label; both measures are 1 when A and B are empty):
 *   Dice    = 2 |A and B| / (|A| + |B|)      Jaccard = |A and B| / |A or B| */
#ifndef EXAMPLES_IMAGING_OVERLAP_H
#define EXAMPLES_IMAGING_OVERLAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct overlap {
    size_t a, b, both; /* voxel counts */
    double dice, jaccard;
};

/* Compares the voxels with the value `label`; a negative label stands for any value but 0. */
struct overlap overlap_labels(const float *a, const float *b, size_t count, float label);
struct overlap overlap_masks(const uint8_t *a, const uint8_t *b, size_t count); /* not 0 = inside */

/* Returns the volume of `voxels` voxels in millilitres, for grids without shear. */
double overlap_milliliters(size_t voxels, const float spacing[3]);

#endif
