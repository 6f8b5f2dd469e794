/* skeleton_retarget.h - moves a body with a template's skeleton by an animation of another character. */
#ifndef EXAMPLES_CHARACTER_SKELETON_RETARGET_H
#define EXAMPLES_CHARACTER_SKELETON_RETARGET_H

#include "character/skeleton_embed.h"

/* Makes the joints of a body from an embedding: those present that are no ends, without rotations. body: its joints and
 * animations are replaced. joint_of: of each template joint, -1: none. Returns false if memory is short. */
bool skeleton_make_joints(const struct skeleton_template *skeleton, const struct skeleton_embedding *embedding,
                          struct character *body, int *joint_of);

/* Pairs each template joint with a joint of a rigged character, -1: none. embedding: of the template in the character's surface.
 * A partner is near, below the partner of the joint above, and better if its name contains a word of the template's hint.
 * Returns the number of pairs. */
int skeleton_pair(const struct skeleton_template *skeleton, const struct skeleton_embedding *embedding,
                  const struct character *rigged, int *pair);

/* Adds an animation of the other character to the body, in keys 1/fps seconds apart. Each joint turns as its partner turns from
 * its neutral pose, seen from left, up and forward; limbs first take the directions of the other's limbs. Hips move in
 * proportion to their height. Returns false if memory is short. */
bool skeleton_retarget(const struct skeleton_template *skeleton, const struct skeleton_embedding *ours,
                       const int *joint_of, const struct character *other, const struct skeleton_embedding *theirs,
                       const int *pair, int animation, int fps, struct character *body);

#endif
