/* polygon.h - polygons as files have them: concave, with corners in a line, not quite flat. */
#ifndef EXAMPLES_SURFACE_POLYGON_H
#define EXAMPLES_SURFACE_POLYGON_H

#include <stdbool.h>
#include <stddef.h>

/* Cuts a polygon of at least three corners (places: 3 each) into count - 2 triangles of three numbers of corners, each turned as the
 * polygon. One that crosses itself is cut all the same, somehow. Returns false if memory is short. */
bool polygon_cut(const double *places, size_t count, int *triangles);

#endif
