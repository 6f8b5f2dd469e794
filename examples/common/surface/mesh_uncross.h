/* mesh_uncross.h - takes apart the few triangles of a mesh that cross, or that have no area. */
#ifndef EXAMPLES_SURFACE_MESH_UNCROSS_H
#define EXAMPLES_SURFACE_MESH_UNCROSS_H

#include <stdbool.h>

/* Moves vertices of triangles that cross, or have no area, towards the middle of their neighbors, by at most `furthest` (world units),
 * until there are none, in twelve rounds at most. If no fewer are left then, all stay in their places. Returns false, and changes
 * nothing, if memory is short. */
bool mesh_uncross(float *positions, int vertex_count, const int *triangles, int triangle_count, double furthest);

#endif
