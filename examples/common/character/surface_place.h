/* surface_place.h - bone weights, UV and color at a place on a character's surface.
 *
 * A place is a triangle and barycentric weights of its corners. So values are never interpolated across a seam of the texture,
 * and a place has the same UV however often springls are split. */
#ifndef EXAMPLES_CHARACTER_SURFACE_PLACE_H
#define EXAMPLES_CHARACTER_SURFACE_PLACE_H

#include "base/bvh.h"
#include "character/character.h"

struct place {
    int triangle;
    float weight[3];
};

struct places {
    const struct character *character; /* borrowed; its positions must not change */
    struct bvh bvh;
};

/* Builds the search structure; returns false if there is no triangle or memory is short. */
bool places_create(const struct character *character, struct places *places);
void places_free(struct places *places);

/* Finds the nearest place of the neutral surface; returns its distance. */
float places_find(const struct places *places, const float point[3], struct place *place);

struct influences place_influences(const struct character *character, const struct place *place);
void place_uv(const struct character *character, const struct place *place, float uv[2]);
/* Computes vertex color times base color times image color (bilinear, the image repeats), as display values. */
void place_color(const struct character *character, const struct place *place, float color[3]);

#endif
