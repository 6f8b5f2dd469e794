/* skeleton_align.h - rescales a character's body so that its skeleton matches another's (paper, section 5.8). */
#ifndef EXAMPLES_CHARACTER_SKELETON_ALIGN_H
#define EXAMPLES_CHARACTER_SKELETON_ALIGN_H

#include "character/character.h"

/* How the source's joints go with the target's. */
struct alignment {
    int pairs;
    const char *how;      /* "file", "names" or "limbs" */
    int *map;             /* joint of the target for each joint of the source, -1: none */
    struct affine *bones; /* of each joint of the source: carries what it moves to the target's neutral pose */
    int *shrinks, *grows; /* of each joint of the source and of the target: the first joint of a limb that only one has, or -1 */
    int *bone_above;      /* of each joint of the target: where the bone begins that ends here, if both have it, else -1 */
};

/* Pairs joints by a file with a pair of names a line ('#' begins a comment); else by equal names (letters and digits, ignoring
 * case), if these map 9 in 10 joints of the smaller skeleton; else limb by limb (skeleton_limbs.h). Returns false with the
 * reason in `error` and nothing to free. */
bool skeleton_align(const struct character *source, const struct character *target, const char *file,
                    struct alignment *alignment, char error[CHARACTER_TEXT]);
void alignment_free(struct alignment *alignment);

/* Computes for each of the source's joints the affine map to its counterpart: rotation and scale bring the bones that begin
 * there onto the target's. Unmapped joints move with their parents. */
void skeleton_fit_bones(const struct character *source, const struct character *target, const int *map, struct affine *bones);

/* Moves the source's surface to the target's neutral pose and its weights to the target's joints. shrink, grow: 3 floats for
 * each vertex of the source and of the target, the way by which a limb that the other lacks shrinks into what it hangs on. */
void skeleton_rescale(struct character *source, const struct character *target, const struct alignment *alignment,
                      float *shrink, float *grow);

#endif
