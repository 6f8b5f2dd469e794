/* gvf.h - gradient vector flow: a field of vectors that leads to the edges of an image from far away.
 *
 * C. Xu, J. L. Prince, "Snakes, Shapes, and Gradient Vector Flow", IEEE Trans. Image Processing 7(3), 1998. Of an edge map f
 * the flow v is the field that is the gradient of f where that is large and smooth elsewhere (their eq. 12): the minimum of
 *
 *   integral of  mu |grad v|^2 + |grad f|^2 |v - grad f|^2
 *
 * Lengths are counted in `unit` mm, and f is scaled to a maximum of 1. The minimum is found on a pyramid of grids, each half
 * as fine as the next, by Gauss-Seidel sweeps that begin with the coarser grid's field: so the flow spreads over the whole
 * image in a few sweeps, where a single grid would take as many as it has voxels. */
#ifndef EXAMPLES_IMAGING_GVF_H
#define EXAMPLES_IMAGING_GVF_H

#include "imaging/volume.h"

struct gvf {
    struct volume grid; /* data: the edge map */
    float *field;       /* 3 a voxel, along the grid's axes; of length 1 but within about a voxel of edges */
};

/* Of the edges of `image` (f = |grad seen|), on its grid (halvings = 0), or on one with voxels twice as large along each axis
 * (1), or four times (2). False: memory is short. */
bool gvf_compute(const struct volume *image, int halvings, float mu, float unit, struct gvf *gvf);
void gvf_sample(const struct gvf *gvf, const float index[3], float v[3]); /* trilinear, constant beyond the grid */
void gvf_free(struct gvf *gvf);

#endif
