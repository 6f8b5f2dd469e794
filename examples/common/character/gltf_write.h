/* gltf_write.h - glTF 2.0 binary files (GLB): a sequence of meshes as an animation, and a skinned character.
 *
 * assimp's exporter writes neither STEP animations nor colours with as many bits as dark ones need, hence this one; assimp reads
 * what it writes. */
#ifndef EXAMPLES_CHARACTER_GLTF_WRITE_H
#define EXAMPLES_CHARACTER_GLTF_WRITE_H

#include "character/character.h"

struct gltf_mesh { /* arrays by vertex; all but positions may be NULL */
    const float *positions, *normals, *uvs, *colors; /* colors: 3 a vertex, display values */
    const struct influences *influences;             /* the four largest are written */
    const int *triangles;
    int vertex_count, triangle_count;
};

/* One mesh a frame, each shown for 1/fps seconds: scaled to nothing before and after (STEP). */
bool gltf_write_sequence(const char *path, const struct gltf_mesh *frames, int count, int fps);

/* The mesh, in the neutral pose of the character whose skeleton and animation (-1: none) it gets, in keys of 1/fps seconds. */
bool gltf_write_skinned(const char *path, const struct gltf_mesh *mesh, const struct character *character, int animation,
                        int fps);

#endif
