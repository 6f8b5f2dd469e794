/* max_flow.h - the smallest cut of a grid of voxels, by the library libmaxflow (Boykov and Kolmogorov) where it was found. */
#ifndef EXAMPLES_IMAGING_MAX_FLOW_H
#define EXAMPLES_IMAGING_MAX_FLOW_H

#include <stdbool.h>
#include <stdint.h>

/* Returns true if libmaxflow was found when this was compiled; else max_flow_cut fails. */
bool max_flow_is_there(void);

/* Divides voxels into an inside (1) and an outside (0), so that the sum of what is lost is the smallest one. gain: what a voxel loses
 * outside where it is above 0, and less 0 what it loses inside. walls: what two neighbours lose that are divided, of each voxel the one
 * further along x, y, z. Returns false if memory is short. */
bool max_flow_cut(const int dims[3], const float *gain, const float *walls, uint8_t *inside);

#endif
