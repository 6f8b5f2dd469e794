/* skin_weights.h - bone weights of a body by heat on its closed surface (heat_weights.h), as influences of joints. */
#ifndef EXAMPLES_CHARACTER_SKIN_WEIGHTS_H
#define EXAMPLES_CHARACTER_SKIN_WEIGHTS_H

#include "character/character.h"
#include "character/heat_weights.h"

/* A closed surface, triangles counter-clockwise from outside; the arrays are borrowed. */
struct skin_surface {
    const float *positions;
    const int *triangles;
    int vertex_count, triangle_count;
};

/* Computes influences, one a vertex, of the joints at which bones begin. Returns false if no bone is visible or memory is short. */
bool skin_weights_heat(const struct skin_surface *surface, const struct bone *bones, const int *joints,
                       int bone_count, struct influences *influences, struct heat_report *report);

/* Copies to the body's own vertices the influences of the nearest vertex of the closed surface, and marks the joints in use.
 * Returns false if memory is short. */
bool skin_weights_transfer(const struct skin_surface *surface, const struct influences *influences,
                           struct character *body);

#endif
