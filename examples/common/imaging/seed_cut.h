/* seed_cut.h - an object between places that are known to lie in it and places that do not: a graph cut. */
#ifndef EXAMPLES_IMAGING_SEED_CUT_H
#define EXAMPLES_IMAGING_SEED_CUT_H

#include "imaging/volume.h"

#include <stdint.h>

enum { SEED_NONE, SEED_INSIDE, SEED_OUTSIDE };

/* Divides the image. marks: of each voxel. inside: 1 in the object, of which every part has a voxel marked as SEED_INSIDE, and which has no
 * cavities without one marked as SEED_OUTSIDE; marks of both kinds have to be there. Returns false if memory is short. */
bool seed_cut(const struct volume *image, const uint8_t *marks, uint8_t *inside);

#endif
