/* vgrid.h - arithmetic on dense arrays over a grid of cubes: smoothing, interpolation, and maps x -> x + u(x).
 *
 * A displacement u has 3 floats a voxel, x fastest, in voxels of its own grid; beyond the outermost voxels it is constant. All
 * lengths are in voxels. Sums have a fixed order, so results do not depend on the number of threads. */
#ifndef EXAMPLES_REGISTRATION_VGRID_H
#define EXAMPLES_REGISTRATION_VGRID_H

#include <stdbool.h>
#include <stddef.h>

static inline size_t vgrid_voxels(const int dims[3]) { return (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]; }

/* Interpolates `channels` (1 or 3) floats a voxel trilinearly at x. */
void vgrid_sample(const int dims[3], int channels, const float *values, const float x[3], float *out);

/* Convolves with a Gaussian of `sigma` voxels, cut off at three sigma. scratch: as large as data. Returns false if memory is
 * short. */
bool vgrid_smooth(const int dims[3], int channels, float sigma, float *data, float *scratch);

/* Samples values(x + u(x)). */
void vgrid_warp(const int dims[3], const float *values, const float *u, float *out);

/* Composes "first, then after": first(x) + after(x + first(x)). out must be neither of the two. */
void vgrid_compose(const int dims[3], const float *after, const float *first, float *out);

/* Computes the displacement of exp(scale v) for a stationary velocity v by scaling and squaring (Arsigny et al. 2006): the
 * first step is at most `longest` voxels long and of second order. scratch: as large as v. */
void vgrid_exp(const int dims[3], const float *v, float scale, float longest, float *out, float *scratch);

/* Computes the displacement of the inverse map by fixed-point iteration, inverse(x) = -u(x + inverse(x)), for maps near the
 * identity that were not made by vgrid_exp. Returns the largest remaining |u(x + inverse(x)) + inverse(x)|. scratch: as large
 * as u. */
float vgrid_invert(const int dims[3], const float *u, int iterations, float *inverse, float *scratch);

float vgrid_longest(const int dims[3], const float *u);

/* Computes det(I + du/dx) by central differences, one-sided at the border. */
void vgrid_jacobian(const int dims[3], const float *u, float *determinants);

#endif
