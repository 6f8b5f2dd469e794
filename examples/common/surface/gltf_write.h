/* gltf_write.h - glTF 2.0 binary files (GLB) of meshes: one, or a sequence as an animation. */
#ifndef EXAMPLES_SURFACE_GLTF_WRITE_H
#define EXAMPLES_SURFACE_GLTF_WRITE_H

#include "surface/material.h"

#include <stdint.h>

struct gltf_mesh { /* arrays over vertices; all but positions may be NULL */
    const float *positions, *normals, *uvs, *colors; /* colors: 3 a vertex, display values */
    const uint16_t *joints;                          /* 4 a vertex, of a skin; */
    const float *weights;                            /* their sum is 1, unused joints are 0 */
    const int *triangles;
    const double *origin;    /* 3, of gltf_write_mesh: where the node is; NULL: at 0 */
    const int *materials_of; /* one a triangle; NULL: the first for all */
    int vertex_count, triangle_count;
};

/* How meshes look; NULL or 0: plain and white, apart from vertex colors. */
struct gltf_look {
    const struct material *materials;
    const struct picture *pictures;
    int material_count, picture_count;
};

bool gltf_write_mesh(const char *path, const struct gltf_mesh *mesh, const struct gltf_look *look);

/* Writes one mesh a frame, each shown for 1/fps seconds and scaled to zero before and after (STEP). */
bool gltf_write_sequence(const char *path, const struct gltf_mesh *frames, int count, int fps, const struct gltf_look *look);

#endif
