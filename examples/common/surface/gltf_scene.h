/* gltf_scene.h - scenes from glTF 2.0: nodes and parts (gltf_scene.c), looks (gltf_look.c), clips (gltf_motion.c).
 *
 * Read: all of the core but cameras, the animation of morph weights, and what a material has beyond its base color, metal and
 * roughness; KHR_mesh_quantization, KHR_texture_transform, KHR_draco_mesh_compression, EXT_meshopt_compression, the diffuse part of
 * KHR_materials_pbrSpecularGlossiness. */
#ifndef EXAMPLES_SURFACE_GLTF_SCENE_H
#define EXAMPLES_SURFACE_GLTF_SCENE_H

#include "surface/gltf_file.h"
#include "surface/scene.h"
#include "surface/scene_uv.h"

struct gltf_scene {
    struct gltf_file file;
    enum scene_extent extent;
    struct scene *to;
    int *node_of;          /* the scene's number of each node of the file, -1: it is in no scene */
    int *picture_of;       /* that of each image, NO_PICTURE: cannot be read, NEW_PICTURE: not wanted yet */
    int *uv_set;           /* texture coordinates of each material's image */
    struct uv_map *uv_map; /* how they are moved */
};

enum { GLTF_NO_PICTURE = -1, GLTF_NEW_PICTURE = -2 };

/* Reads an open file; what it leaves in `scene` is to be freed even where it fails, with one line. Closes the file. */
bool gltf_scene_read(const struct gltf_file *file, enum scene_extent extent, struct scene *scene);

bool gltf_read_materials(struct gltf_scene *g);
bool gltf_read_animations(struct gltf_scene *g);

bool gltf_no_memory(struct gltf_scene *g);

#endif
