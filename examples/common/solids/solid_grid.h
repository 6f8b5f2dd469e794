/* solid_grid.h - a grid of cubes around solids. */
#ifndef EXAMPLES_SOLIDS_SOLID_GRID_H
#define EXAMPLES_SOLIDS_SOLID_GRID_H

#include "springls.h"

#include <math.h>
#include <string.h>

/* Makes a grid with `cells` voxels along the longest side of a box (world units), some of them beyond each end for the band. */
static inline springls_grid_desc solid_grid_of(const double lower[3], const double upper[3], int cells)
{
    const int margin = 5; /* voxels: the band and some more */
    springls_grid_desc grid;
    double longest = 0.0;
    memset(&grid, 0, sizeof grid);
    for (int c = 0; c < 3; ++c) {
        longest = fmax(longest, upper[c] - lower[c]);
    }
    const double spacing = longest / (cells - 2 * margin);
    for (int c = 0; c < 3; ++c) {
        grid.size[c] = (int)ceil((upper[c] - lower[c]) / spacing) + 2 * margin;
        grid.spacing[c] = spacing;
        grid.origin[c] = lower[c] - spacing * (margin - 0.5);
    }
    return grid;
}

#endif
