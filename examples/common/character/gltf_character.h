/* gltf_character.h - writes a skinned, animated character as glTF 2.0 binary (GLB). */
#ifndef EXAMPLES_CHARACTER_GLTF_CHARACTER_H
#define EXAMPLES_CHARACTER_GLTF_CHARACTER_H

#include "character/character.h"
#include "surface/gltf_write.h"

/* Writes a mesh in the neutral pose of a character, with its skeleton and all its clips. influences: one a vertex, of which the
 * four largest are written. mesh->joints and ->weights need not be set; look: see gltf_write.h. */
bool gltf_write_skinned(const char *path, const struct gltf_mesh *mesh, const struct influences *influences,
                        const struct gltf_look *look, const struct character *character);

/* Writes the character itself: its own surface, materials and images, skeleton and clips. */
bool gltf_write_character(const char *path, const struct character *character);

#endif
