/* mesh_io.h - triangle meshes in (mesh_io.c) and out (mesh_write.c).
 *
 * Files are read by scene_read (OBJ, PLY, STL, OFF, glTF, ...), at rest: with node transforms, bones and the default weights of morph
 * targets applied, mirrored parts turned, and polygons split into triangles. Vertices of the whole file with three bitwise equal
 * coordinates are joined; assimp's own joining keeps UV and material seams open and uses a tolerance that ruins small models. */
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
    uint32_t *source; /* of each triangle, its number in the file; NULL: not known */
    size_t dropped; /* triangles left out: two corners became one vertex */
    size_t not_finite; /* triangles left out for corners that are not finite: by mesh_read_local, where mesh_read refuses them */
};

/* Reads a mesh. Returns false with an empty mesh and one line in `error` (unreadable, no triangles, coordinates that are not
 * finite, bad index). */
bool mesh_read(const char *path, struct mesh *mesh, char error[MESH_TEXT]);
void mesh_free(struct mesh *mesh);

/* What is written; the members after the triangles may be NULL. */
struct mesh_arrays {
    const float *positions; /* 3 a vertex */
    size_t vertex_count;
    const uint32_t *indices; /* 3 a triangle; NULL, not for GLB: vertices 3t, 3t+1, 3t+2 */
    size_t triangle_count;   /* 0: a point cloud, for PLY */
    const float *normals;    /* 3 a vertex, as all that follow */
    const float *colors;     /* 0..1: as bytes in PLY, behind the place in OBJ */
    const float *originals;  /* correspondences: a_x a_y a_z in PLY, vt in OBJ */
    const char *comment;     /* one line for the header of PLY */
    const double *origin;    /* 3, added to places and correspondences: written in double precision, but for STL; in GLB as the node's */
};

/* Writes binary little-endian PLY. Returns false with one line in `error`. */
bool mesh_write_ply(const char *path, const struct mesh_arrays *mesh, char error[MESH_TEXT]);

/* Writes PLY, OBJ, binary STL (triangles alone) or GLB (without correspondences), by the extension of the path. Returns false with
 * one line in `error`. */
bool mesh_write(const char *path, const struct mesh_arrays *mesh, char error[MESH_TEXT]);

/* Checks that mesh_write has a format for this name. Returns false with the formats in `error`. */
bool mesh_can_write(const char *path, char error[MESH_TEXT]);

#endif
