/* mesh_local.h - meshes whose coordinates are too large for floats, as metres of a national grid: read in double precision and moved to a
 * local origin. */
#ifndef EXAMPLES_SURFACE_MESH_LOCAL_H
#define EXAMPLES_SURFACE_MESH_LOCAL_H

#include "surface/mesh_io.h"

/* Reads a mesh as mesh_read does; but one of PLY, OBJ or STL that lies many times its own size from the origin is read in double precision,
 * without materials, and its places are less `origin`, whole numbers (0 for all others). Without materials are also files that only
 * plain_mesh_read reads; corners that are not finite are left out of their faces,
 * and mesh->not_finite counts the triangles that this takes. */
bool mesh_read_local(const char *path, struct mesh *mesh, double origin[3], char error[MESH_TEXT]);

/* Prints a warning where triangles were left out for corners that are not finite. */
void mesh_warn_not_finite(const char *program, const char *path, const struct mesh *mesh);

/* Returns the size of the steps, at places of a mesh, of the floats that they are read in. */
double mesh_float_step(const struct mesh *mesh);

#endif
