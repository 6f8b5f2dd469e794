/* mesh_check.h - is a triangle mesh watertight, and does it cut through itself? */
#ifndef EXAMPLES_SURFACE_MESH_CHECK_H
#define EXAMPLES_SURFACE_MESH_CHECK_H

#include <stdbool.h>

struct mesh_check {
    int open_edges;    /* that do not belong to two triangles which run along them in opposite directions */
    int intersections; /* pairs of triangles that cross outside the corners they share */
    int components;    /* connected by edges */
    int euler;         /* vertices - edges + triangles */
};

/* False: memory, or an index out of range. */
bool mesh_check(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct mesh_check *check);

/* Leaves out components that enclose less than `smallest`, bubbles too; the vertices stay. Returns how many went, -1: memory. */
int mesh_drop_specks(const float *positions, int vertex_count, int *triangles, int *triangle_count, double smallest);

#endif
