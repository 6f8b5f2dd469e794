/* skeleton_align.h - rescales a character's body so that its skeleton matches another's (paper, section 5.8). */
#ifndef EXAMPLES_CHARACTER_SKELETON_ALIGN_H
#define EXAMPLES_CHARACTER_SKELETON_ALIGN_H

#include "character/character.h"

/* Maps each joint of `source` to a joint of `target`, -1 = none: by a file with a pair of names a line ('#' begins a comment);
 * else by equal names (letters and digits, ignoring case); else, when less than half of the smaller skeleton is mapped by
 * names, by hierarchy: from the bone with the most bones below it, children are paired by their directions. *how: "file",
 * "names" or "hierarchy". Returns the number of pairs; 0 with the reason in `error`. */
int skeleton_map(const struct character *source, const struct character *target, const char *file, int *map, const char **how,
                 char error[CHARACTER_TEXT]);

/* Computes for each of the source's joints the affine map to its counterpart: rotation and scale bring the bones that begin
 * there onto the target's. Unmapped joints move with their parents. */
void skeleton_fit_bones(const struct character *source, const struct character *target, const int *map, struct affine *bones);

/* Moves the source's surface to the target's neutral pose and its weights to the target's joints. */
bool skeleton_rescale(struct character *source, const struct character *target, const int *map);

#endif
