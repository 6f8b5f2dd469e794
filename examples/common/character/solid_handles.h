/* solid_handles.h - makes a body of voxels one without handles: like a ball, however it touches itself.
 *
 * Voxels inside are connected by faces, those outside also by edges and corners, as in the meshes of springls. */
#ifndef EXAMPLES_CHARACTER_SOLID_HANDLES_H
#define EXAMPLES_CHARACTER_SOLID_HANDLES_H

#include "character/solid_voxels.h"

/* Returns parts - handles + hollows of a level set (negative inside): its Euler number, 1 for a ball. */
int solid_euler(const struct solid_grid *grid, const float *phi);

/* What solid_cut_handles did. */
struct solid_handles {
    int filled; /* voxels that close tunnels */
    int cut;    /* voxels taken out of handles */
};

/* Changes a level set (negative inside, voxels) of one body without hollows, so that it has no handles: tunnels that a film of at
 * most `film` voxels closes are closed, other handles are cut where they are thinnest, by a crevice of a voxel. limbs: of each voxel,
 * not 0 where the middle of a limb is, as solid_mark_way marks it: there nothing is cut that can be cut elsewhere; NULL: none known.
 * The border of the grid is outside. Returns false if memory is short. */
bool solid_cut_handles(const struct solid_grid *grid, float *phi, const unsigned char *limbs, int film, struct solid_handles *report);

/* Marks the voxels along the straight way between two places, in voxel coordinates. */
void solid_mark_way(const struct solid_grid *grid, const float from[3], const float to[3], unsigned char *limbs);

#endif
