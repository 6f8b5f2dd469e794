/* mesh_slivers.h - removes the thin triangles of a closed mesh: still closed, without new crossings, of the same topology. */
#ifndef EXAMPLES_SURFACE_MESH_SLIVERS_H
#define EXAMPLES_SURFACE_MESH_SLIVERS_H

#include <stdbool.h>

/* Merges vertices with neighbours and flips edges where triangles have angles below 15 degrees, as long as the surface moves by no more
 * than `tolerance` there and triangles become less thin. Vertices left keep their places; `kept` gets the number that each had, and may be
 * used to thin out other arrays; those that no triangle uses go too. Triangles that cross stay as they are. No others come to cross:
 * changes are made anew without those at new crossings, and where some are left after eight attempts, all changes are undone. Returns false
 * if memory is short; then the mesh is as it was. */
bool mesh_remove_slivers(float *positions, int *vertex_count, int *triangle_indices, int *triangle_count, double tolerance, int *kept);

#endif
