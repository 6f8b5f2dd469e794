/* skeleton_picture.h - a picture of a body with its skeleton over it. */
#ifndef EXAMPLES_CHARACTER_SKELETON_PICTURE_H
#define EXAMPLES_CHARACTER_SKELETON_PICTURE_H

#include "character/character.h"
#include "pictures/raycast.h"

/* Mixes a color of each bone by the weights. */
void influences_color(const struct influences *influences, float color[3]);

/* Draws the scene and over it each joint with a line to its parent; left ones (".L" in the name) are red. places: 3 floats a joint.
 * bones: only joints that vertices have weights on. image: to be freed by image_free.
 * Returns false if the scene cannot be drawn. */
bool skeleton_picture(const struct raycast_scene *scene, const struct character *character, const float *places, bool bones, int width,
                      int height, struct image *image);

#endif
