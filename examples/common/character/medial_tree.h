/* medial_tree.h - a tree of curves in the middle of a body, from its trunk to the ends of its limbs.
 *
 * Branches are added one by one, the longest first, as in TEASAR (Sato et al. 2000): the path from the farthest place that is
 * not near the tree yet. Paths prefer places far below the surface, so they follow the medial axis of phi. */
#ifndef EXAMPLES_CHARACTER_MEDIAL_TREE_H
#define EXAMPLES_CHARACTER_MEDIAL_TREE_H

#include "character/solid_voxels.h"

enum { MEDIAL_TIPS = 12 };

struct medial_tree {
    int tip_count;             /* ends of the longest branches, the longest first */
    int tip[MEDIAL_TIPS];      /* their voxels */
    float length[MEDIAL_TIPS]; /* by which each stands out of the branch that it leaves, voxels */
    int *before;  /* the voxel before each voxel of the tree on the way to the first tip, -1: first tip or none */
    float *along; /* length of the way of each voxel of the tree to the first tip, voxels; -1: not of the tree */
};

/* Builds the tree; branches that stand out by less than `shortest` voxels are left out. Returns false if memory is short. */
bool medial_tree_create(const struct solid *solid, float shortest, struct medial_tree *tree);
void medial_tree_free(struct medial_tree *tree);

/* Returns the voxel where the ways from a and b to the first tip meet. */
int medial_tree_meet(const struct medial_tree *tree, int a, int b);
float medial_tree_distance(const struct medial_tree *tree, int a, int b); /* along the tree, voxels */

/* Writes the voxels from a to b, both included; returns how many, at most `room`. */
int medial_tree_path(const struct medial_tree *tree, int a, int b, int *path, int room);

#endif
