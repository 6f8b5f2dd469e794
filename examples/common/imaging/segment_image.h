/* segment_image.h - image processing for active contours: thresholds, pressure, distances. */
#ifndef EXAMPLES_IMAGING_SEGMENT_IMAGE_H
#define EXAMPLES_IMAGING_SEGMENT_IMAGE_H

#include "imaging/volume.h"

#include <stdint.h>

/* Removes details that voxels of `size` mm cannot represent, by a Gaussian along every axis with smaller voxels. A voxel's
 * width counts as a standard deviation of half of it. Returns false if memory is short. */
bool segment_blur(const struct volume *image, float size, float *values);

/* Computes Otsu's threshold over 1024 classes between the 0.1st and the 99.9th percentile of the finite voxels. */
float segment_otsu(const struct volume *image);

/* Returns the intensity below which `share` (0..1) of the finite voxels lie, within 1/4096 of the range: of all of them, or of
 * 99 % where the others lie far away. */
float segment_percentile(const struct volume *image, double share);

/* Computes the pressure, -1..1, positive where low < intensity < high: the distance of the intensity from the window's nearer
 * end over `ramp`, or over the change of the intensity across `size` mm where that is larger. So the pressure changes by at
 * most about 1 over `size`, and a contour does not overshoot the level. Beyond the image it falls to -1 over `size`. padded:
 * the image's grid with a margin. */
void segment_pressure(const struct volume *image, const float *values, float low, float high, float ramp, float size,
                      const struct volume *padded);

/* Sets full outward pressure also in cavities of the object: where a ball of three voxels cannot come that enters along the
 * edges of the image's box and moves where there is no outward pressure. So marrow belongs to its bone, despite small holes
 * and where the image's border cuts the bone. Returns false if memory is short. */
bool segment_pressure_solid(const struct volume *image, float size, const struct volume *padded);

/* The forces on a contour along its normal, -1..1: pressure of a window, region and edges of the image, and the push back from
 * too far away from the start. Lengths in mm. */
struct segment_push {
    const float *pressure;          /* on the padded grid */
    const float *image;              /* blurred as for the pressure */
    const float *away;              /* distance from the start, on the padded grid; NULL: none */
    float pressure_weight, region_weight;
    float inside, outside;          /* mean intensities of the two phases */
    float edge_weight;              /* 0..1: share of the push that stops at edges */
    float ramp;                     /* intensity change over `size` that counts as an edge */
    float stay, size;
};
void segment_combine(const struct volume *image, const struct segment_push *push, const struct volume *padded);

/* Sets the mask to 1 where the volume has one of the labels (count = 0: any label but 0), by its ids where it was read with them. Returns
 * the number of voxels set. */
size_t segment_mask(const struct volume *labels, const uint32_t *wanted, int count, uint8_t *mask);

/* Keeps only the largest component (joined through faces) of the voxels below zero: the signs of the others, and of enclosed
 * voxels above zero, are reversed. Returns false if memory is short. */
bool segment_keep_largest(const int dims[3], float *phi);

/* Reverses the signs of the parts below zero that reach one of the twelve edges of the image's box. padded: on the image's grid with a
 * margin, where no value is below zero. Returns false if memory is short. */
bool segment_clear_edges(const struct volume *image, const struct volume *padded);

/* The parts (connected through faces) of the voxels below zero. */
struct segment_parts {
    int kept, removed;
    size_t voxels; /* of the parts that were kept */
};

/* Removes the parts of fewer than `least` voxels, and with `largest` all but the largest part: reverses the sign of their
 * voxels. Returns false if memory is short. */
bool segment_remove_parts(const int dims[3], float *phi, size_t least, bool largest, struct segment_parts *left);

/* Extends a distance in mm that is right where it is less than `known` to all voxels, to first order (|grad| = 1 by fast
 * sweeping, Zhao 2005). */
void segment_extend_distance(const struct volume *image, float known, float *distance);

#endif
