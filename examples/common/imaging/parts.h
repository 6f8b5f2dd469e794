/* parts.h - parts of a volume that are connected through faces, from runs of voxels (Rosenfeld and Pfaltz 1966). */
#ifndef EXAMPLES_IMAGING_PARTS_H
#define EXAMPLES_IMAGING_PARTS_H

#include <stdbool.h>

/* Voxels of one row, side by side. */
struct parts_run {
    int first, count; /* voxels */
    int root;         /* the part's first run, in the order of the voxels; a root has itself */
    int voxels;       /* of the whole part; 0 where the run is no root */
};

struct parts {
    struct parts_run *runs;
    int count;
};

/* Finds the parts of the voxels below zero, or of all others. Returns false if memory is short; otherwise to be freed by parts_free. */
bool parts_find(const int dims[3], const float *values, bool below, struct parts *parts);
void parts_free(struct parts *parts);

/* Returns the root of the part with the most voxels, the first one of several; -1: there are no parts. */
int parts_largest(const struct parts *parts);

#endif
