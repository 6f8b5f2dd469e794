/* mesh_voxels.h - the signed distance of a closed mesh on a grid, fast enough for every frame of an animation.
 *
 * The mesh may overlap itself, as a skinned one does at bent joints: inside is where the winding number is positive. */
#ifndef EXAMPLES_CHARACTER_MESH_VOXELS_H
#define EXAMPLES_CHARACTER_MESH_VOXELS_H

#include "character/solid_voxels.h"

/* Computes the signed distance, voxels, negative inside: exact up to `band` voxels from the surface, within a voxel beyond.
 * positions: voxel coordinates, 3 a vertex; triangles: 3 indices each, counter-clockwise from outside. nearest: the triangle
 * nearest to each voxel, -1 beyond the band. Returns false if memory is short. */
bool mesh_voxels(const struct solid_grid *grid, const float *positions, const int *triangles, int triangle_count, float band,
                 float *phi, int *nearest);

#endif
