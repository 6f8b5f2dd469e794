/* vgrid.h - arithmetic on dense arrays over a grid of cubes: smoothing, interpolation, and maps x -> x + u(x).
 *
 * A displacement u holds 3 floats a voxel, x fastest, in voxels of its own grid; beyond the outermost voxels it goes on with
 * its last values. Nothing here knows of millimetres. Sums are taken in an order of their own, so results do not depend on
 * the number of threads. */
#ifndef EXAMPLES_REGISTRATION_VGRID_H
#define EXAMPLES_REGISTRATION_VGRID_H

#include <stdbool.h>
#include <stddef.h>

static inline size_t vgrid_voxels(const int dims[3]) { return (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]; }

/* Trilinear interpolation of `channels` (1 or 3) floats a voxel at x. */
void vgrid_sample(const int dims[3], int channels, const float *values, const float x[3], float *out);

/* Convolution with a Gaussian of `sigma` voxels, cut off at three sigma. scratch: as large as data. False: memory is short. */
bool vgrid_smooth(const int dims[3], int channels, float sigma, float *data, float *scratch);

/* values(x + u(x)) */
void vgrid_warp(const int dims[3], const float *values, const float *u, float *out);

/* The displacement of "first, then after": first(x) + after(x + first(x)). out is neither of the two. */
void vgrid_compose(const int dims[3], const float *after, const float *first, float *out);

/* The displacement of exp(scale v), where v is a stationary velocity, by scaling and squaring (Arsigny et al. 2006): the first
 * step is at most `longest` voxels long and of second order. scratch: as large as v. */
void vgrid_exp(const int dims[3], const float *v, float scale, float longest, float *out, float *scratch);

/* The displacement of the inverse map, by fixed-point iteration: inverse(x) = -u(x + inverse(x)). For maps near the identity
 * that were not made by vgrid_exp; returns the largest |u(x + inverse(x)) + inverse(x)| that remains. scratch: as large as u. */
float vgrid_invert(const int dims[3], const float *u, int iterations, float *inverse, float *scratch);

float vgrid_longest(const int dims[3], const float *u);

/* det(I + du/dx), by central differences (one-sided at the border). */
void vgrid_jacobian(const int dims[3], const float *u, float *determinants);

#endif
