/* mesh_io.h - triangle meshes in and out.
 *
 * Reading goes through assimp (OBJ, PLY, STL, OFF, glTF, ...), with node transforms applied and polygons cut into
 * triangles. Vertices are then joined across the whole file where their three coordinates are equal to the last bit:
 * assimp's own joining keeps UV and material seams open and uses a tolerance that ruins small models. */
#ifndef EXAMPLES_SURFACE_MESH_IO_H
#define EXAMPLES_SURFACE_MESH_IO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MESH_TEXT = 320 };

struct mesh {
    float *positions; /* 3 a vertex */
    size_t vertex_count;
    uint32_t *indices; /* 3 a triangle */
    size_t triangle_count;
    float *colors;  /* 3 a vertex, 0..1: the file's vertex colours, or those of several materials; NULL: it has none */
    size_t dropped; /* triangles left out: two corners became one vertex */
};

/* False: empty mesh, one line in `error` (unreadable, no triangles, coordinates that are not finite, bad index). */
bool mesh_read(const char *path, struct mesh *mesh, char error[MESH_TEXT]);
void mesh_free(struct mesh *mesh);

/* False, with one line in `error`: the file cannot be opened, is empty, or its header promises more than it can hold. For whoever
 * hands a file to assimp, which believes headers. */
bool mesh_counts_plausible(const char *path, char error[MESH_TEXT]);

struct mesh_ply {
    const float *positions;
    size_t vertex_count;
    const uint32_t *indices; /* NULL = soup: vertices 3t, 3t+1, 3t+2 */
    size_t triangle_count;   /* 0 = a point cloud */
    const float *normals;    /* the rest: 3 floats a vertex, or NULL */
    const float *colors;     /* 0..1, written as uchar red green blue */
    const float *originals;  /* correspondences, written as float a_x a_y a_z */
    const char *comment;     /* one line for the header, or NULL */
};

/* Binary little-endian PLY. */
bool mesh_write_ply(const char *path, const struct mesh_ply *ply, char error[MESH_TEXT]);

#endif
