/* indexed_mesh.h - reads an indexed mesh of the caller's. */
#ifndef SPRINGLS__MODEL_INDEXED_MESH_H
#define SPRINGLS__MODEL_INDEXED_MESH_H

#include "../runtime/base.h"

/* Position i of an array with `stride` bytes between two. */
SPRINGLS__FN const float *springls__mesh_position(const float *positions, size_t stride, int i)
{
    return (const float *)(const void *)((const char *)(const void *)positions + (size_t)i * stride);
}

/* The half-edge that follows in the triangle: half-edge h runs from corner h % 3 of triangle h / 3. */
SPRINGLS__FN int springls__mesh_next(int half) { return half % 3 == 2 ? half - 2 : half + 1; }

#endif
