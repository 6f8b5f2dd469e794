/* indices.h - corners of triangles, between the library's int and the uint32_t of mesh files. */
#ifndef EXAMPLES_SPRINGLS_INDICES_H
#define EXAMPLES_SPRINGLS_INDICES_H

#include "springls.h"

#include <stdint.h>
#include <stdlib.h>

/* Copies them, to be freed; NULL: memory. */
static inline int *signed_indices(const uint32_t *indices, size_t triangle_count)
{
    int *triangles = (int *)malloc((3 * triangle_count + 1) * sizeof *triangles);
    for (size_t i = 0; triangles && i < 3 * triangle_count; ++i) {
        triangles[i] = (int)indices[i];
    }
    return triangles;
}

static inline uint32_t *unsigned_indices(const springls_mesh *mesh)
{
    const size_t n = 3 * (size_t)mesh->triangle_count;
    uint32_t *indices = (uint32_t *)malloc((n + 1) * sizeof *indices);
    for (size_t i = 0; indices && i < n; ++i) {
        indices[i] = (uint32_t)mesh->triangles[i];
    }
    return indices;
}

#endif
