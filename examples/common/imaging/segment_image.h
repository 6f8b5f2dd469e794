/* segment_image.h - what an active contour needs of an image besides the contour: threshold, pressure, distances. */
#ifndef EXAMPLES_IMAGING_SEGMENT_IMAGE_H
#define EXAMPLES_IMAGING_SEGMENT_IMAGE_H

#include "imaging/volume.h"

#include <stdint.h>

/* From voxels of `to` to voxels of `from`: rows of a 3x4 matrix. */
void segment_voxel_map(const struct volume *to, const struct volume *from, float map[3][4]);

/* The value at a place in voxels; beyond the outermost voxels they stay constant. */
float segment_trilinear(const int dims[3], const float *values, const float x[3]);

/* Trilinear: values on one grid at the voxels of another; beyond the outermost voxels they stay constant. */
void segment_resample(const struct volume *from, const float *values, const struct volume *to, float *result);

/* Takes details away that voxels of `size` mm cannot hold: a Gaussian along every axis with smaller ones. A voxel's own
 * width counts as a standard deviation of half of it. False: memory is short. */
bool segment_blur(const struct volume *image, float size, float *values);

/* Otsu's threshold over 1024 classes between the 0.1st and the 99.9th percentile. */
float segment_otsu(const struct volume *image);

/* The intensity below which `share` (0..1) of the voxels lie, within 1/4096 of the range. */
float segment_percentile(const struct volume *image, double share);

/* -1..1, positive where low < intensity < high: how far the intensity is inside, over `ramp`; where the intensity changes
 * by more than that over `size` mm, over this change. So the pressure never changes much faster than by 1 over `size`, and
 * what it pushes does not shoot over the level. Beyond the image it falls to -1 over `size`. padded: the image's grid with
 * a margin. */
void segment_pressure(const struct volume *image, const float *values, float low, float high, float ramp, float size,
                      const struct volume *padded);

/* Full pressure outward also where the object shuts a place in: where a ball of three voxels, which is let in along the edges
 * of the image's box and passes where there is no pressure outward, does not come. So marrow belongs to its bone, whatever
 * small holes there are, and so where the image's border cuts the bone. False: memory is short. */
bool segment_pressure_solid(const struct volume *image, float size, const struct volume *padded);

/* What pushes a contour along its normal, -1..1: pressure of a window, region and edges of the image, and the way back from
 * too far away of the start. Lengths in mm. */
struct segment_push {
    const float *pressure;          /* on the padded grid */
    const float *image;              /* the image, as blurred as the pressure was made from */
    const float *away;              /* distance from the start, on the padded grid; NULL: none */
    float pressure_weight, region_weight;
    float inside, outside;          /* mean intensities of the two phases */
    float edge_weight;              /* 0..1: the share of the push that stops at edges */
    float ramp;                     /* an edge changes by this over `size` */
    float stay, size;
};
void segment_combine(const struct volume *image, const struct segment_push *push, const struct volume *padded);

/* mask: 1 where the volume has one of the labels; count = 0: where it is not 0. Returns the voxels set. */
size_t segment_mask(const struct volume *labels, const int *wanted, int count, uint8_t *mask);

/* Of the voxels below zero only the largest part stays (joined through faces); the others become their opposite, and so
 * does what lies above zero but is closed in. False: memory is short. */
bool segment_keep_largest(const int dims[3], float *phi);

/* A distance in mm that is right where it is less than `known` becomes a distance everywhere, to first order
 * (|grad| = 1 by fast sweeping, Zhao 2005). */
void segment_extend_distance(const struct volume *image, float known, float *distance);

#endif
