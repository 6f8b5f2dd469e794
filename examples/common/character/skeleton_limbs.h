/* skeleton_limbs.h - pairs the joints of two different skeletons limb by limb, by geometry and hierarchy, not by names.
 *
 * A skeleton has a plane of symmetry. Joints on it form the trunk, from the hips to the head, and a tail. The two longest
 * pairs of chains that leave the trunk are arms (or front legs), nearer to the head, and legs. y is up; forward is where the
 * head of a lying trunk or the feet of a standing one point; left is up x forward. Joints of two chains are paired by the
 * length of the way to them along the chain. */
#ifndef EXAMPLES_CHARACTER_SKELETON_LIMBS_H
#define EXAMPLES_CHARACTER_SKELETON_LIMBS_H

#include "character/character.h"

enum limb_role { LIMB_TRUNK, LIMB_TAIL, LIMB_ARM_LEFT, LIMB_ARM_RIGHT, LIMB_LEG_LEFT, LIMB_LEG_RIGHT, LIMB_ROLES };

enum { LIMB_JOINTS = 24 };

struct limb {
    int count; /* 0: the skeleton has no such limb */
    int joints[LIMB_JOINTS];
    float places[LIMB_JOINTS + 1][3]; /* of the joints in the neutral pose; the last is the limb's end on the surface */
    float along[LIMB_JOINTS + 1];     /* length of the way to each from the first, 1 at the end */
    float radius;                     /* mean distance of the limb's surface from it */
};

struct skeleton_limbs {
    struct limb limbs[LIMB_ROLES];
    float left[3], up[3], forward[3];
    float head[3], head_size; /* middle and size (root mean square) of what moves with the last joint of the trunk */
    float size;               /* of the whole body, likewise */
};

const char *limb_name(enum limb_role role);

/* Finds the limbs. Returns false if there is no bone or memory is short. */
bool skeleton_limbs_find(const struct character *character, struct skeleton_limbs *limbs);

/* Maps the source's joints to the target's, -1: of a limb that the target lacks, and of what hangs on a limb, such as fingers.
 * bones: for each joint of the source the affine map that carries what it moves to the target's neutral pose. Returns the
 * number of pairs. */
int skeleton_limbs_pair(const struct character *source, const struct skeleton_limbs *ours, const struct skeleton_limbs *theirs,
                        int *map, struct affine *bones);

/* Returns the first joint of what only this skeleton has and `joint` belongs to: a limb, or what hangs on one, such as a finger
 * or a horn; -1: nothing. */
int skeleton_limbs_alone(const struct character *character, const struct skeleton_limbs *ours,
                         const struct skeleton_limbs *theirs, int joint);

/* Returns the joint before `joint` in its limb, for a limb's first joint the one of the trunk that it hangs on, -1: none. */
int skeleton_limbs_above(const struct character *character, const struct skeleton_limbs *limbs, int joint);

#endif
