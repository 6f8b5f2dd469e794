/* gltf_write.h - glTF 2.0 binary files (GLB): a sequence of meshes as an animation, and a skinned character.
 *
 * assimp's exporter supports neither STEP animations nor colors with enough bits for dark tones. assimp reads these files. */
#ifndef EXAMPLES_CHARACTER_GLTF_WRITE_H
#define EXAMPLES_CHARACTER_GLTF_WRITE_H

#include "character/character.h"

struct gltf_mesh { /* arrays over vertices; all but positions may be NULL */
    const float *positions, *normals, *uvs, *colors; /* colors: 3 a vertex, display values */
    const struct influences *influences;             /* the four largest are written */
    const int *triangles;
    int vertex_count, triangle_count;
};

/* Writes one mesh a frame, each shown for 1/fps seconds and scaled to zero before and after (STEP). */
bool gltf_write_sequence(const char *path, const struct gltf_mesh *frames, int count, int fps);

/* Writes a mesh in the neutral pose of a character, with its skeleton and an animation (-1: none) in keys 1/fps seconds apart. */
bool gltf_write_skinned(const char *path, const struct gltf_mesh *mesh, const struct character *character, int animation,
                        int fps);

#endif
