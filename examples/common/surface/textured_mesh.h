/* textured_mesh.h - a surface cut into the charts of a texture atlas (texture_atlas.h), with its colors in an image, for glTF. */
#ifndef EXAMPLES_SURFACE_TEXTURED_MESH_H
#define EXAMPLES_SURFACE_TEXTURED_MESH_H

#include "surface/gltf_write.h"
#include "surface/texture_atlas.h"

struct textured_mesh {
    struct gltf_mesh mesh; /* its arrays are those below */
    struct texture_atlas atlas;
    struct picture picture; /* a PNG; not decoded */
    float *positions, *normals;
    int *materials_of;
};

/* Makes one of a surface with normals, whose image has `size` texels a side and is that of material number `material`. Returns false,
 * with nothing to free, where the atlas cannot be made (textured->atlas.full: the charts do not fit) or memory is short. */
bool textured_mesh_make(const struct gltf_mesh *surface, int size, int material, texture_atlas_color *color, const void *user,
                        struct textured_mesh *textured);
void textured_mesh_free(struct textured_mesh *textured);

/* Writes a surface with a color at each vertex as a GLB whose image has them. */
bool textured_mesh_write(const char *path, const struct gltf_mesh *surface, int size);

#endif
