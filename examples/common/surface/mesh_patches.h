/* mesh_patches.h - the patches of a mesh: triangles that hang together by edges of two triangles, made to face alike. */
#ifndef EXAMPLES_SURFACE_MESH_PATCHES_H
#define EXAMPLES_SURFACE_MESH_PATCHES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct mesh_patches {
    int count;
    int *first;            /* of each patch in `triangles`, and one more: the number of triangles */
    int *triangles;        /* patch by patch */
    int *across;           /* 3 a triangle: the triangle beyond each edge, -1: none, or several */
    unsigned char *turned; /* 1: against its patch's first triangle */
    unsigned char *closed; /* of each patch: it has no edge with none or several beyond */
};

/* Returns false with nothing to free if memory is short, or there are too many triangles. */
bool mesh_patches_find(const uint32_t *indices, size_t triangle_count, struct mesh_patches *patches);
void mesh_patches_free(struct mesh_patches *patches);

#endif
