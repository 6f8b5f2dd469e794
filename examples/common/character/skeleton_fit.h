/* skeleton_fit.h - gives a body without bones the skeleton of a rigged donor (as Pinocchio does in the paper).
 *
 * The donor's surface is laid on the body's surface by a similarity and a smooth displacement (surface_fit.h), which is
 * defined between the surfaces too and so moves the joints. Both bodies must stand upright and face the same way. */
#ifndef EXAMPLES_CHARACTER_SKELETON_FIT_H
#define EXAMPLES_CHARACTER_SKELETON_FIT_H

#include "character/character.h"
#include "character/heat_weights.h"

/* Fits the donor to the body's closed surface, given by positions and triangles. body: its joints and animations are replaced;
 * of the donor's keys only rotations are used. *distance: mean distance of the fitted donor's surface from the body's. */
bool skeleton_fit(const struct character *donor, const float *positions, int vertex_count, const int *triangles,
                  int triangle_count, struct character *body, double *distance);

/* Lists bones as segments from each joint to those joints below it that vertices depend on; a last bone is extended by half of
 * the bone before it. joints: the joint of each bone. Returns how many; the arrays need room for 2 * joint_count. */
int skeleton_bones(const struct character *character, struct bone *bones, int *joints);

#endif
