/* plain_mesh.h - OBJ, PLY and STL in double precision, with places, faces and PLY's colors alone: for coordinates that floats do not hold,
 * and for files that assimp does not read: elements in any order, lines that begin with blanks or a byte order mark, old line ends,
 * STL in capitals, without a count, or with more behind its triangles. */
#ifndef EXAMPLES_SURFACE_PLAIN_MESH_H
#define EXAMPLES_SURFACE_PLAIN_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct plain_mesh {
    double *places;    /* 3 a vertex */
    float *colors;     /* 3 a vertex; NULL: none */
    uint32_t *indices; /* 3 a triangle */
    size_t vertex_count, triangle_count;
    size_t vertex_room, triangle_room;
    size_t not_finite; /* triangles that are not there, for corners that are not finite as floats: such corners are left out of faces */
    bool single; /* the file has floats: it is no more precise than these */
};

/* Reads a file, by its extension. Returns false, with nothing to free, where it is of another format, is not whole, or memory is short;
 * mesh_read names the reason. A mesh may have no triangles. */
bool plain_mesh_read(const char *path, struct plain_mesh *mesh);
void plain_mesh_free(struct plain_mesh *mesh);

#endif
