/* skeleton_align.h - one character's body rescaled so that its skeleton is another's (paper, section 5.8). */
#ifndef EXAMPLES_CHARACTER_SKELETON_ALIGN_H
#define EXAMPLES_CHARACTER_SKELETON_ALIGN_H

#include "character/character.h"

/* Which joint of `target` each joint of `source` is, -1 = none: from a file with a pair of names a line ('#' begins a remark),
 * else by equal names (letters and digits, whatever their case), else, when less than half of the smaller skeleton finds its
 * like, by hierarchy: from the bones with most bones below on, children are paired by the directions they lie in. *how: "file",
 * "names", "hierarchy".
 * Returns the number of pairs; 0: none, `error` says why. */
int skeleton_map(const struct character *source, const struct character *target, const char *file, int *map, const char **how,
                 char error[CHARACTER_TEXT]);

/* The affine map of each of the source's joints that takes the joint to its like: rotation and scale turn the bones that begin
 * there into the target's. Joints without a like go along with their parents. */
void skeleton_fit_bones(const struct character *source, const struct character *target, const int *map, struct affine *bones);

/* The source's surface in the neutral pose of the target, its weights on the target's joints. */
bool skeleton_rescale(struct character *source, const struct character *target, const int *map);

#endif
