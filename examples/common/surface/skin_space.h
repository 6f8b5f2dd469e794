/* skin_space.h - the free space around a triangle mesh, as voxels: how large a ball gets where from infinity. */
#ifndef EXAMPLES_SURFACE_SKIN_SPACE_H
#define EXAMPLES_SURFACE_SKIN_SPACE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct skin_space {
    int size[3];
    float origin[3], spacing; /* world place of voxel 0; size of a voxel */
    float *distance;          /* of each voxel's center to the nearest triangle, voxels */
    float *width;             /* radius of the largest ball whose center gets there from outside, voxels; at most `limit` */
    float limit;
};

/* Measures the space around a mesh, with room for balls of radius `limit` (voxels, at least 1) on all sides. Returns false with nothing
 * to free if memory is short or there is no triangle. */
bool skin_space_make(const float *positions, const uint32_t *indices, size_t triangle_count, float spacing, float limit,
                     struct skin_space *space);
void skin_space_free(struct skin_space *space);

/* Returns the radius of the largest ball whose center gets to a corner of the cell around a place. */
float skin_space_width(const struct skin_space *space, const float place[3]);

/* Returns how many voxels the center of a ball of a radius gets to where a larger one, of radius `fitting`, fits but does not get (voxels):
 * chambers behind openings. */
size_t skin_space_chambers(const struct skin_space *space, float radius, float fitting);

/* Puts the center of each `step`-th voxel of those chambers into `places`, at most `most` of them; returns how many. */
size_t skin_space_places_in_chambers(const struct skin_space *space, float radius, float fitting, size_t step, size_t most,
                                     float (*places)[3]);

/* Returns the volume that balls of a radius (voxels) leave free, world units; -1: memory. */
double skin_space_closed(const struct skin_space *space, float radius);

#endif
