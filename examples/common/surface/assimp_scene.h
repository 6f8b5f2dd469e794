/* assimp_scene.h - scenes from files of formats other than glTF 2.0. */
#ifndef EXAMPLES_SURFACE_ASSIMP_SCENE_H
#define EXAMPLES_SURFACE_ASSIMP_SCENE_H

#include "surface/scene.h"

/* Reads a file that scene_read has checked; what it leaves in `scene` is to be freed even where it fails. */
bool assimp_scene_read(const char *path, enum scene_extent extent, struct scene *scene, char error[SCENE_TEXT]);

#endif
