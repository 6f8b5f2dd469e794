/* mesh_simplify.h - fewer triangles for a closed mesh, by meshoptimizer: still closed, without crossings, of the same topology. */
#ifndef EXAMPLES_SURFACE_MESH_SIMPLIFY_H
#define EXAMPLES_SURFACE_MESH_SIMPLIFY_H

#include <stdbool.h>

/* Merges vertices until at most `triangles` are left (0: as many as the tolerance needs) or the surface would move by more than `tolerance`
 * (0: any way; by quadrics, an estimate). Those left keep their places; `kept` gets the number that each had, and may be used to thin out
 * other arrays. What would open the mesh, make it cross itself or change its topology is undone, and fewer or more are tried. Returns false
 * if memory is short; then the mesh may have lost its order. */
bool mesh_simplify(float *positions, int *vertex_count, int *triangle_indices, int *triangle_count, int triangles, double tolerance,
                   int *kept);

#endif
