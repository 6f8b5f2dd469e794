/* segment_image.h - what an active contour needs of an image besides the contour: threshold, pressure, distances. */
#ifndef EXAMPLES_COMMON_SEGMENT_IMAGE_H
#define EXAMPLES_COMMON_SEGMENT_IMAGE_H

#include "volume.h"

#include <stdint.h>

/* Otsu's threshold over 1024 classes between the 0.1st and the 99.9th percentile. */
float segment_otsu(const struct volume *image);

/* The intensity below which `share` (0..1) of the voxels lie, within 1/4096 of the range. */
float segment_percentile(const struct volume *image, double share);

/* -1..1, positive where low < intensity < high: the distance to the nearer bound over `ramp`. */
void segment_pressure(const struct volume *image, float low, float high, float ramp, float *pressure);

/* mask: 1 where the volume has one of the labels; count = 0: where it is not 0. Returns the voxels set. */
size_t segment_mask(const struct volume *labels, const int *wanted, int count, uint8_t *mask);

/* Millimetres from a level set in voxels: phi over the length of its gradient in the world. The same to first order
 * near the surface for any spacing, and exact where the spacing is uniform. */
void segment_distance(const struct volume *image, const float *phi, float *distance);

/* How far the surface moved between two level sets: the mean of |after - before|, voxels, where either is within one
 * voxel of the surface. */
double segment_motion(const float *before, const float *after, size_t count);

#endif
