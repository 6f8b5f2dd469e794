/* thin_places.h - makes thin limbs of a level set as thick as its voxels need.
 *
 * A limb of less than about two voxels has voxels inside only here and there: where it bends it falls apart. */
#ifndef EXAMPLES_CHARACTER_THIN_PLACES_H
#define EXAMPLES_CHARACTER_THIN_PLACES_H

#include "character/solid_voxels.h"

/* Unites a level set (negative inside, voxels; it may be clamped beyond a depth of half of `thickness`, no sooner) with balls of this
 * diameter along the middle of all places into which such a ball does not fit; edges and corners of what is thick stay as they are.
 * Returns how many voxels become inside, -1: memory. */
int thin_places_thicken(const struct solid_grid *grid, float *phi, float thickness);

#endif
