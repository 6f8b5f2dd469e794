/* gvf.h - gradient vector flow: a vector field that points to the edges of an image from far away.
 *
 * C. Xu, J. L. Prince, "Snakes, Shapes, and Gradient Vector Flow", IEEE Trans. Image Processing 7(3), 1998. The flow v of an
 * edge map f equals the gradient of f where that is large and is smooth elsewhere (their eq. 12): it minimizes
 *
 *   integral of  mu |grad v|^2 + |grad f|^2 |v - grad f|^2
 *
 * Lengths are in `unit` mm, and f is scaled to a maximum of 1. The minimum is found on a pyramid of grids, each half as fine
 * as the next, by Gauss-Seidel sweeps that start from the coarser grid's field. So the flow spreads over the whole image in a
 * few sweeps, where a single grid would need as many as it has voxels. */
#ifndef EXAMPLES_IMAGING_GVF_H
#define EXAMPLES_IMAGING_GVF_H

#include "imaging/volume.h"

struct gvf {
    struct volume grid; /* data: the edge map */
    float *field;       /* 3 a voxel, along the grid's axes; of length 1 except within about a voxel of edges */
};

/* Computes the flow to the edges of `image` on its grid (halvings = 0), or on one with voxels twice (1) or four times (2) as
 * large. Returns false if memory is short. */
bool gvf_compute(const struct volume *image, int halvings, float mu, float unit, struct gvf *gvf);
void gvf_sample(const struct gvf *gvf, const float index[3], float v[3]); /* trilinear, constant beyond the grid */
void gvf_free(struct gvf *gvf);

#endif
