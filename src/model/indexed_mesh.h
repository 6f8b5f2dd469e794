/* indexed_mesh.h - reads the indexed meshes that callers pass. */
#ifndef SPRINGLS__MODEL_INDEXED_MESH_H
#define SPRINGLS__MODEL_INDEXED_MESH_H

#include "../runtime/base.h"
#include "../runtime/errors.h"

/* Returns position i of an array whose positions are `stride` bytes apart. */
SPRINGLS__FN const float *springls__mesh_position(const float *positions, size_t stride, int i)
{
    return (const float *)(const void *)((const char *)(const void *)positions + (size_t)i * stride);
}

/* Returns the next half-edge of the triangle; half-edge h begins at corner h % 3 of triangle h / 3. */
SPRINGLS__FN int springls__mesh_next(int half) { return half % 3 == 2 ? half - 2 : half + 1; }

/* Refuses a mesh that is NULL, and `out` that is NULL while the mesh has vertices. */
SPRINGLS__FN springls_status springls__check_mesh(springls_context *ctx, const springls_mesh *mesh, const void *out,
                                                  const char *call)
{
    if (!mesh || (mesh->vertex_count > 0 && !out)) return springls__fail_null(ctx, call, mesh ? "out" : "mesh");
    return SPRINGLS_OK;
}

#endif
