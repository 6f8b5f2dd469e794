/* mesh_check.h - checks whether a triangle mesh is watertight and whether it intersects itself. */
#ifndef EXAMPLES_SURFACE_MESH_CHECK_H
#define EXAMPLES_SURFACE_MESH_CHECK_H

#include <stdbool.h>

struct mesh_check {
    int open_edges;    /* edges without exactly two triangles that use them in opposite directions */
    int intersections; /* pairs of triangles that cross outside the corners they share */
    int components;    /* connected by edges */
    int euler;         /* vertices - edges + triangles */
};

/* Checks a mesh. Returns false if memory is short or an index is out of range. */
bool mesh_check(const float *positions, int vertex_count, const int *triangles, int triangle_count, struct mesh_check *check);

/* Returns how many pairs of triangles cross, -1: memory. marks: of vertices; those of triangles that cross are set to 1; may be NULL. */
int mesh_mark_crossings(const float *positions, const int *triangles, int triangle_count, unsigned char *marks);

/* Returns the number of components of a mesh, -1: memory. */
int mesh_components(int vertex_count, const int *triangles, int triangle_count);

/* Returns what a closed mesh encloses, cavities less. */
double mesh_volume(const float *positions, const int *triangles, int triangle_count);

/* Returns the share of the edges at which the normals of two triangles include an angle with a cosine below `cosine`; -1:
 * memory. Edges of folds are near -1. */
double mesh_bent_edges(const float *positions, const int *triangles, int triangle_count, float cosine);

/* Returns the share of the angles that are below so many degrees. */
double mesh_sharp_angles(const float *positions, const int *triangles, int triangle_count, double degrees);

/* Returns the most that one component of a closed mesh encloses, -1: memory. */
double mesh_largest_volume(const float *positions, int vertex_count, const int *triangles, int triangle_count);

/* Removes the inner skins of a body that is a wall: closed components that face inwards, in the box of the component that encloses
 * most, and enclose more than half as much. Vertices at the same place count as one, so that seams are no borders; they stay. Returns
 * how many, -1: memory. */
int mesh_drop_inner_skins(const float *positions, int vertex_count, int *triangles, int *triangle_count);

/* Removes components that enclose less than `smallest`, bubbles too; the vertices stay. Returns how many, -1: memory. */
int mesh_drop_specks(const float *positions, int vertex_count, int *triangles, int *triangle_count, double smallest);

#endif
