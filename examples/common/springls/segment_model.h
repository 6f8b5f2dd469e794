/* segment_model.h - what an active contour needs of the library: grid, starting shapes, and whether springls still move. */
#ifndef EXAMPLES_SPRINGLS_SEGMENT_MODEL_H
#define EXAMPLES_SPRINGLS_SEGMENT_MODEL_H

#include "springls.h"

/* Describes the model's grid by the geometry of a volume: voxels a side, mm between voxels, world place of voxel (0,0,0), and
 * the rows of the 3x3 matrix whose columns are the directions of the voxel axes. */
springls_grid_desc segment_model_grid(const int dims[3], const float spacing[3], const float origin[3], const float *direction);

/* shape: "sphere", "cube", "torus" or "metasphere"; centre and radius (or half side) in mm. */
springls_status segment_model_shape(springls_context *ctx, const char *shape, const float center[3], float radius);

/* The surface of a mask on the model's grid. */
springls_status segment_model_mask(springls_context *ctx, const uint8_t *mask, size_t count);

/* Where springls were when they were last looked at. Zero it before the first look. */
struct segment_watch {
    uint32_t *ids;
    float *particles;
    int count, room;
};

/* The share of springls whose particle has moved by more than `still` voxels, along the springl's normal, since the last
 * look; 1 at the first look. Motion along the surface does not change the shape, and springls that have come since have
 * no motion to tell. False: memory is short. */
bool segment_watch_look(struct segment_watch *watch, const springls_context *ctx, float still, float *moving);
void segment_watch_free(struct segment_watch *watch);

/* Springls are at rest when fewer than 2 % of them still move: the share falls from 1 to .05 in 20 steps of a grid, on bones
 * and a brain, and never becomes 0, because parts thinner than a voxel come and go. What still grows along a thin object, a
 * spine for instance, does so with few springls: so neither may the volume change by more than 0.2 % from one look to the
 * next. *before: the volume at the last look; becomes that of this one. */
bool segment_at_rest(float moving, double volume, double *before);

#endif
