/* segment_model.h - models for active contours: grid, starting shapes, and the test whether springls still move. */
#ifndef EXAMPLES_SPRINGLS_SEGMENT_MODEL_H
#define EXAMPLES_SPRINGLS_SEGMENT_MODEL_H

#include "springls.h"

/* Describes the model's grid by the geometry of a volume: voxels a side, mm between voxels, world place of voxel (0,0,0), and
 * the rows of the 3x3 matrix whose columns are the directions of the voxel axes. */
springls_grid_desc segment_model_grid(const int dims[3], const float spacing[3], const float origin[3], const float *direction);

/* Sets the model to a shape: "sphere", "cube", "torus" or "metasphere"; center and radius (or half side) in mm. */
springls_status segment_model_shape(springls_context *ctx, const char *shape, const float center[3], float radius);

/* Sets the model to the surface of a mask on the model's grid. */
springls_status segment_model_mask(springls_context *ctx, const uint8_t *mask, size_t count);

/* The springls at the last look; zero it before the first one. */
struct segment_watch {
    uint32_t *ids;
    float *particles;
    int count, room;
};

/* Computes the share of springls whose particle has moved by more than `still` voxels along the springl's normal since the
 * last look, 1 at the first look. Motion along the surface does not change the shape, and springls that are new have no motion
 * yet. Returns false if memory is short. */
bool segment_watch_look(struct segment_watch *watch, const springls_context *ctx, float still, float *moving);
void segment_watch_free(struct segment_watch *watch);

/* Returns true if fewer than 2 % of the springls move and the volume changed by less than 0.02 % a step since the last look,
 * `steps` ago. The share falls from 1 to .05 in 20 steps of a grid, on bones and a brain, and never becomes 0, because parts
 * thinner than a voxel appear and disappear. The volume shows growth along a thin object, such as a spine, by few springls.
 * *before: the volume at the last look, updated to `volume`. */
bool segment_at_rest(float moving, double volume, int steps, double *before);

#endif
