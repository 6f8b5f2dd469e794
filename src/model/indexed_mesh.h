/* indexed_mesh.h - reads the indexed meshes that callers pass. */
#ifndef SPRINGLS__MODEL_INDEXED_MESH_H
#define SPRINGLS__MODEL_INDEXED_MESH_H

#include "../runtime/base.h"

/* Returns position i of an array whose positions are `stride` bytes apart. */
SPRINGLS__FN const float *springls__mesh_position(const float *positions, size_t stride, int i)
{
    return (const float *)(const void *)((const char *)(const void *)positions + (size_t)i * stride);
}

/* Returns the next half-edge of the triangle; half-edge h begins at corner h % 3 of triangle h / 3. */
SPRINGLS__FN int springls__mesh_next(int half) { return half % 3 == 2 ? half - 2 : half + 1; }

#endif
