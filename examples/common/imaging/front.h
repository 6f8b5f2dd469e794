/* front.h - a contour of whole voxels that follows the sign of a force: brings a level set near to where it comes to rest.
 *
 * As in Shi and Karl's fast level sets (IEEE Trans. Image Processing 17(5), 2008) voxels beside the contour change sides where the
 * force asks for it, and nothing is integrated. In place of curvature a voxel needs as many neighbours on its new side as a flat
 * front has, 9 of 26: so the front does not run along threads and channels. A voxel changes sides once at most, and the work is
 * that of the voxels which the contour passes over. */
#ifndef EXAMPLES_IMAGING_FRONT_H
#define EXAMPLES_IMAGING_FRONT_H

#include <stdbool.h>
#include <stddef.h>

/* Moves the zero of phi, negative inside, by at most `most` voxels, outward where force is positive and inward where it is
 * negative. dims: of both, at least 3 each; the outermost voxels are outside. Phi becomes minus the force where that has the
 * side's sign, else +-0.5: so its zero is that of the force, where the contour has come to rest. changed: receives how many
 * voxels have changed sides. Returns false if memory is short. */
bool front_move(const int dims[3], const float *force, int most, float *phi, size_t *changed);

#endif
