/* bvh_winding.h - the generalised winding number of a set of triangles (Barill et al. 2018), by directed areas where it is distant. */
#ifndef EXAMPLES_BASE_BVH_WINDING_H
#define EXAMPLES_BASE_BVH_WINDING_H

#include "base/bvh.h"

struct bvh_winding {
    const struct bvh *bvh;
    struct bvh_dipole {
        float center[3], area[3], radius;
    } * dipoles; /* one a node */
};

/* Sums up a tree, which has to stay. Returns false if memory is short. */
bool bvh_winding_make(const struct bvh *bvh, struct bvh_winding *winding);
void bvh_winding_free(struct bvh_winding *winding);

/* Returns how often the triangles wind around a point: 1 in a closed surface that faces outwards, 0 outside, between them beside holes. */
double bvh_winding_at(const struct bvh_winding *winding, const float point[3]);

#endif
