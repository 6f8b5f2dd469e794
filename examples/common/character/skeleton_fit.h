/* skeleton_fit.h - a skeleton for a body that has none: a rigged donor's, moved into it (what Pinocchio does in the paper).
 *
 * The donor's surface is laid on the body's: a similarity, then a smooth displacement (surface_fit.h), which is defined
 * between the surfaces too and takes the joints along. Both bodies stand upright and look the same way. */
#ifndef EXAMPLES_CHARACTER_SKELETON_FIT_H
#define EXAMPLES_CHARACTER_SKELETON_FIT_H

#include "character/character.h"
#include "character/heat_weights.h"

/* positions, triangles: the body's closed surface. body gets joints and animations in the place of what it had; of the
 * donor's keys only rotations. *distance: mean distance of the donor's surface from the body's afterwards. */
bool skeleton_fit(const struct character *donor, const float *positions, int vertex_count, const int *triangles,
                  int triangle_count, struct character *body, double *distance);

/* Bones as segments from each joint to those below that vertices follow; a last one goes on half as far as the one before it.
 * joints: whose each is. Returns how many; room for 2 * joint_count. */
int skeleton_bones(const struct character *character, struct bone *bones, int *joints);

#endif
