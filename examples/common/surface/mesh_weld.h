/* mesh_weld.h - joins borders of a mesh that run along each other, as cracks do: the same edge twice, some way apart. */
#ifndef EXAMPLES_SURFACE_MESH_WELD_H
#define EXAMPLES_SURFACE_MESH_WELD_H

#include "surface/mesh_io.h"

/* Joins pairs of border edges, each of which is the nearest one of the other, and whose ends are apart by at most `most` (unit of the
 * mesh) and by less than a third of the shorter one's length. What is joined lies in the middle, with the mean color; triangles that
 * become lines are dropped. *joined: how many pairs. Returns false if memory is short. */
bool mesh_weld(struct mesh *mesh, float most, size_t *joined);

#endif
