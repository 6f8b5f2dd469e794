/* mesh_local.h - meshes whose coordinates are too large for floats, as metres of a national grid: read in double precision and moved to a
 * local origin. */
#ifndef EXAMPLES_SURFACE_MESH_LOCAL_H
#define EXAMPLES_SURFACE_MESH_LOCAL_H

#include "surface/mesh_io.h"

/* Reads a mesh as mesh_read does; but one of PLY or OBJ that lies many times its own size from the origin is read in double precision,
 * without materials, and its places are less `origin`, whole numbers (0 for all others). */
bool mesh_read_local(const char *path, struct mesh *mesh, double origin[3], char error[MESH_TEXT]);

/* Returns the size of the steps, at places of a mesh, of the floats that they are read in. */
double mesh_float_step(const struct mesh *mesh);

#endif
