/* gltf_draco.h - meshes that are compressed by Draco (KHR_draco_mesh_compression). */
#ifndef EXAMPLES_SURFACE_GLTF_DRACO_H
#define EXAMPLES_SURFACE_GLTF_DRACO_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct gltf_draco;

/* Decodes a mesh. Returns NULL with a reason: it is broken, or has more vertices or triangles than 2^27. */
struct gltf_draco *gltf_draco_decode(const unsigned char *bytes, size_t size, const char **reason);
void gltf_draco_free(struct gltf_draco *mesh);

size_t gltf_draco_vertices(const struct gltf_draco *mesh);
size_t gltf_draco_triangles(const struct gltf_draco *mesh);

/* Copies the corners of all triangles. */
void gltf_draco_corners(const struct gltf_draco *mesh, int *corners);

/* Returns how many numbers a vertex has of the attribute with that id, 0: there is none. */
int gltf_draco_width(const struct gltf_draco *mesh, unsigned id);

/* Copies an attribute, gltf_draco_width numbers a vertex, integers as they are. */
bool gltf_draco_values(const struct gltf_draco *mesh, unsigned id, double *values);

#ifdef __cplusplus
}
#endif

#endif
