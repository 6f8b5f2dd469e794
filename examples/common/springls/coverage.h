/* coverage.h - how well springls cover the zero level. */
#ifndef EXAMPLES_SPRINGLS_COVERAGE_H
#define EXAMPLES_SPRINGLS_COVERAGE_H

#include "springls.h"

#include <stdbool.h>

struct coverage {
    double area;                   /* springls' area over the zero level's */
    double covered, covered_twice; /* share of the zero level within .1 voxel of a springl of its side; of two or more */
};

/* Returns false when the library fails or memory is short. */
bool coverage_measure(springls_context *ctx, struct coverage *out);

/* What was found at several times; begin with zeros. */
struct coverage_range {
    int count;
    struct coverage least, mean, most;
};

/* Measures the coverage and adds it, unless no step has resampled yet: a new model's springls are triangles of marching cubes. */
bool coverage_add(springls_context *ctx, struct coverage_range *range);

#endif
