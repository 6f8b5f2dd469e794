/* relation.h - how the intensities of two images that lie on each other go together: on one scale, by a straight line, by a curve
 * (the correlation ratio: A. Roche, G. Malandain, X. Pennec, N. Ayache, MICCAI 1998), and how much of one follows from the other.
 *
 * Values are pairs: a[n] of the fixed and b[n] of the moving image at one place, both about 0..1. A pair with a NaN has no data. */
#ifndef EXAMPLES_REGISTRATION_RELATION_H
#define EXAMPLES_REGISTRATION_RELATION_H

#include <stdbool.h>
#include <stddef.h>

enum relation_kind {
    RELATION_SAME,        /* equal tissue has equal intensity */
    RELATION_LINE,        /* a = gain b + offset; gain < 0: one image is inverted */
    RELATION_CURVE,       /* a = curve(b): the moving image's values follow the curve */
    RELATION_FIXED_CURVE  /* b = curve(a): the fixed image's values do */
};

enum { RELATION_NODES = 64 };

struct relation {
    enum relation_kind kind;
    float gain, offset;                        /* RELATION_LINE */
    float at[RELATION_NODES], to[RELATION_NODES]; /* the curves: straight between their nodes, constant beyond */
    int nodes;
    double explained; /* share of the variance that follows from the other image: r^2 of a line, the correlation ratio of a curve */
};

/* Fits one relation of a kind. Returns false where there are fewer than 16 pairs or memory is short; a constant image has
 * `explained` 0. */
bool relation_fit(const float *a, const float *b, size_t count, enum relation_kind kind, struct relation *relation);

/* Fits a line and both curves, and takes a curve only where it leaves clearly less variance unexplained. */
bool relation_choose(const float *a, const float *b, size_t count, struct relation *relation);

bool relation_clearly_better(const struct relation *curve, const struct relation *line);

/* Applies a relation to the values that it is for; nothing is to be done for RELATION_SAME. */
bool relation_of_fixed(const struct relation *relation);
void relation_apply(const struct relation *relation, float *values, size_t count);

/* Returns the share of what the line leaves unexplained that goes away where gain and offset may change linearly across space.
 * a, b: one value a voxel of a grid. */
double relation_shading(const float *a, const float *b, const int dims[3]);

/* Fits a = sum of shading[i] times functions of b and of its place, up to the second order in space: a gain and an offset that change
 * slowly. Pairs weigh less the farther they are from it, as in relation_fit. u: where b's values lie, as voxels from those of the grid, 3 a
 * voxel. line: the relation to begin with. Returns false where the pairs do not determine it. */
enum { RELATION_SHADING = 20 };
bool relation_fit_shading(const float *a, const float *b, const int dims[3], const float *u, const struct relation *line,
                          double shading[RELATION_SHADING]);
float relation_unshade(const double shading[RELATION_SHADING], const int dims[3], const float index[3], float value);

/* Returns the mutual information of two images in bits, from a joint histogram of 32 x 32 classes between their extremes. */
double relation_mutual_information(const float *a, const float *b, size_t count);

/* Returns Pearson's correlation over the items where both are finite, 0 where one of them is constant. *common: their number. */
double relation_correlation(const float *a, const float *b, size_t count, size_t *common);

#endif
