/* surface_place.h - what is at a place on a character's surface: bone weights, UV, colour.
 *
 * A place is a triangle and barycentric weights of its corners, so what is looked up is what the artist put there: nothing is
 * interpolated across a seam of the texture, and one place has one UV however often springls are split. */
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

/* False: no triangle, or memory. */
bool places_create(const struct character *character, struct places *places);
void places_free(struct places *places);

/* The nearest place of the neutral surface; returns its distance. */
float places_find(const struct places *places, const float point[3], struct place *place);

struct influences place_influences(const struct character *character, const struct place *place);
void place_uv(const struct character *character, const struct place *place, float uv[2]);
/* Vertex colour times the image there (bilinear, the image repeats); display values. */
void place_color(const struct character *character, const struct place *place, float color[3]);

#endif
