/* level_set.h - an active contour that is only a level set, for comparison with springls.
 *
 * phi is a dense array on a grid of cubes, in voxels, negative inside, kept a signed distance within a narrow band:
 *
 *   phi_t = -(F - w kappa) |grad phi|       F the speed outward along the normal, kappa = div(grad phi / |grad phi|)
 *
 * F uses Godunov's upwind scheme, the curvature central differences (Osher and Fedkiw, chapters 4 to 6). After every step
 * phi_tau = sign(phi) (1 - |grad phi|) restores the distance and keeps the zero in place by the sub-voxel rule of Russo and
 * Smereka (J. Comput. Phys. 163, 2000). Everything is of first order in space and time. */
#ifndef EXAMPLES_IMAGING_LEVEL_SET_H
#define EXAMPLES_IMAGING_LEVEL_SET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Computes the speed along the outward normal at points (voxels, 3 floats each) in voxels a unit of time. Called from any
 * thread. */
typedef void (*level_set_speed)(void *user, const float *points, const float *normals, int count, float *out);

struct level_set {
    int dims[3];
    float *phi;
    level_set_speed speed;
    void *user;
    float curvature; /* w */
    float fastest;   /* upper bound of |F|, which determines the sub-steps */
    /* private */
    float *next, *before, *looked;
    bool has_looked;
    uint8_t *near;
    size_t *band, band_count;
};

/* Copies `phi` (voxels, a distance near its zero). Fill in the other members except dims before the first step. */
bool level_set_create(struct level_set *set, const int dims[3], const float *phi);
void level_set_step(struct level_set *set, float dt);
/* Returns the share of voxels beside the surface whose phi has changed by more than `still` since the last call; 1 at first. */
float level_set_moving(struct level_set *set, float still);
void level_set_free(struct level_set *set);

#endif
