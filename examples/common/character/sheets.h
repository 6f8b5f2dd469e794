/* sheets.h - parts of a character that have no inside, such as capes: found and made solid. */
#ifndef EXAMPLES_CHARACTER_SHEETS_H
#define EXAMPLES_CHARACTER_SHEETS_H

#include "character/character.h"
#include "character/solid_voxels.h"

struct sheets {
    int triangles, found; /* triangles of sheets; connected sheets */
    double area;          /* voxels^2 */
};

/* Finds triangles beside which no voxel is inside (phi < 0, x fastest): those of open sheets and of solids thinner than a voxel.
 * Connected ones count from 16 voxels^2 on. sheet: one a triangle, set to 1 for these, otherwise 0. Returns false if memory is
 * short. */
bool sheets_find(const struct solid_grid *grid, const float *phi, const struct character *character, unsigned char *sheet,
                 struct sheets *found);

/* Makes solids of the marked triangles: phi becomes the least of itself and the distance to their surface, which is thick enough
 * for `thickness` voxels along the grid's axes. So a sheet of one voxel has no holes, however it lies. */
bool sheets_thicken(const struct solid_grid *grid, float *phi, const struct character *character, const unsigned char *sheet,
                    float thickness);

#endif
