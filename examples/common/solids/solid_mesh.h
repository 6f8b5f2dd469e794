/* solid_mesh.h - the mesh of a solid, as mend and csg write it: what the springls hold, with sharp edges and few thin triangles. */
#ifndef EXAMPLES_SOLIDS_SOLID_MESH_H
#define EXAMPLES_SOLIDS_SOLID_MESH_H

#include "springls.h"

#include <stdbool.h>

/* Chooses what a mesh shows: what the springls hold, which have sharp edges, unless the paper's set or --set (NULL: none) have it
 * otherwise. `params` are given the zero level: a model works with that until its mesh is extracted. Returns CLI_CONTINUE, or what main
 * returns. */
int solid_contouring(const char *program, const char *params_name, const char *set, springls_params *params,
                     springls_contouring *contouring);

/* Extracts a model's surface as `contouring` has it, without what such a surface has left of sheets: closed parts that enclose less than
 * `smallest` world units^3, and less than a thousandth of what the largest one does. dropped: how many (NULL: not wanted). The model has
 * its parameters back. Returns false where the library fails (springls_last_error), or memory is short. */
bool solid_extract(springls_context *ctx, springls_contouring contouring, double smallest, springls_mesh *mesh, int *dropped);

/* Removes thin triangles, as long as the surface moves by no more than .03 voxels of `spacing`, and takes apart what crosses, by up to
 * half a voxel. The vertices left keep their normals, correspondences, and colors (three numbers each; NULL: none). Returns false if memory
 * is short. */
bool solid_remove_slivers(springls_mesh *mesh, double spacing, float *colors);

/* Leaves at most `triangles` (0: any number), or as few as keep the surface within `tolerance` world units, as mesh_simplify does it. The
 * vertices left keep what solid_remove_slivers lets them keep. Returns false if memory is short. */
bool solid_thin_out(springls_mesh *mesh, int triangles, double tolerance, float *colors);

/* Measures a closed mesh. Returns false if memory is short. */
bool solid_measure(const springls_mesh *mesh, springls_measures *measures);

#endif
