/* skeleton_embed.h - places the joints of a template in a body (compare Baran & Popovic 2007, the paper's reference [59]).
 *
 * 1. The ends of the medial tree are assigned to the template's ends by a discrete search (skeleton_roles.c). Its cost does
 *    not distinguish left and right: it counts asymmetry, limbs in the wrong order, wrong proportions and ends that get no role.
 * 2. Up is where the body stands, forward is where a biped's feet point or a quadruped's head is. Left follows from both.
 * 3. Joints are placed along the medial curves (skeleton_embed.c): first those with a place of their own, such as where a limb
 *    leaves the trunk, then those between, as in the rest pose but nearer to where the limb is thin. */
#ifndef EXAMPLES_CHARACTER_SKELETON_EMBED_H
#define EXAMPLES_CHARACTER_SKELETON_EMBED_H

#include "character/medial_tree.h"
#include "character/skeleton_template.h"

enum { SKELETON_HEAD, SKELETON_TAIL, SKELETON_FIRST_PAIR, SKELETON_SECOND_PAIR, SKELETON_ROLES };

/* Ends of the medial tree in their roles: numbers of tips. */
struct skeleton_roles {
    int trunk[2];   /* head, tail; -1: none */
    int limb[2][2]; /* of each pair: on one side, on the other; which is left comes later */
    float cost;
    /* Of each role: 1 - cost / the least cost with another end of the body in it; 0 is a guess. An end nearby is no other one. */
    float confidence[SKELETON_ROLES];
};

struct skeleton_embedding {
    float place[TEMPLATE_JOINTS][3]; /* world */
    bool present[TEMPLATE_JOINTS];   /* false: of an optional limb that the body lacks */
    float left[3], up[3], forward[3];
    float height; /* of the body along up */
    float facing; /* how far feet stand out to the front, over the height; for quadrupeds from tail to head */
    float
        asymmetry; /* mean distance of a joint from its partner's mirror image over the height, before they are averaged */
    struct skeleton_roles roles;
};

/* Finds the roles with the least cost, and how far each is from a guess. up: known, or NULL. Returns false with one line in `error` if the
 * tree has too few ends. */
bool skeleton_find_roles(const struct skeleton_template *skeleton, const struct solid *solid,
                         const struct medial_tree *tree, const float *up, struct skeleton_roles *roles,
                         char error[CHARACTER_TEXT]);

/* Places all joints. up, facing: known directions, or NULL. Returns false with one line in `error`. */
bool skeleton_embed(const struct skeleton_template *skeleton, const struct solid *solid, const float *up,
                    const float *facing, struct skeleton_embedding *embedding, char error[CHARACTER_TEXT]);

#endif
