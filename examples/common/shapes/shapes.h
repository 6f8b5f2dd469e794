/* shapes.h - statistics of shapes in correspondence: similarity transforms, Procrustes alignment, principal modes.
 *
 * A shape has 3 floats a vertex; vertex v is the same place on every shape (Cootes et al. 1995, "Active shape models"). A
 * shape of the model is mean + sum over modes m of weight[m] * deviation[m] * mode[m]: weights are in standard deviations. */
#ifndef EXAMPLES_SHAPES_SHAPES_H
#define EXAMPLES_SHAPES_SHAPES_H

#include <stdbool.h>
#include <stddef.h>

/* A triangle mesh; arrays are from malloc. */
struct shape_mesh {
    float *positions;
    int *triangles;
    int vertex_count, triangle_count;
};

/* The map x -> scale * rotation * x + translation. */
struct similarity {
    double scale, rotation[3][3], translation[3];
};

struct similarity similarity_identity(void);
void similarity_apply(const struct similarity *s, const float in[3], float out[3]);
void similarity_apply_all(const struct similarity *s, const float *in, size_t count, float *out); /* in = out is allowed */
struct similarity similarity_inverse(const struct similarity *s);
struct similarity similarity_after(const struct similarity *first, const struct similarity *second); /* second o first */
double similarity_angle(const struct similarity *a, const struct similarity *b); /* between their rotations, radians */

/* Finds the transform from `from` to `to` by weighted least squares (Umeyama 1991); weights NULL: all 1. Without scaling its
 * scale is 1. Returns false for fewer than three points with a weight, or points without spread. */
bool similarity_fit(const float *from, const float *to, const double *weights, size_t count, bool scaling,
                    struct similarity *result);

/* Computes the mean of a shape's vertices and their root mean square distance from it. */
void shape_size(const float *shape, size_t vertices, double center[3], double *radius);

/* Aligns shapes (generalized Procrustes): moves, rotates and, with scaling, scales each onto the mean of all, which keeps the
 * position and orientation of shapes[0] and the shapes' mean size. mean: 3 floats a vertex. */
bool shapes_align(float *const *shapes, int count, size_t vertices, bool scaling, float *mean);

struct shape_model {
    size_t vertices;
    int modes;          /* at most shapes - 1, without modes of zero variance */
    float *mean;        /* 3 a vertex */
    float *mode;        /* [m * 3 * vertices]: of length 1 over all coordinates */
    double *deviation;  /* of the shapes along each mode, in the unit of coordinates, descending */
};

/* Computes principal modes of aligned shapes (eigenvectors of their Gram matrix). Returns false if memory is short or LAPACK
 * fails. */
bool shape_model_build(float *const *shapes, int count, size_t vertices, int max_modes, struct shape_model *model);
void shape_model_free(struct shape_model *model);

void shape_model_shape(const struct shape_model *model, const double *weights, int modes, float *shape);

/* Computes the weights of the model shape nearest to an aligned shape. */
void shape_model_weights(const struct shape_model *model, const float *shape, int modes, double *weights);

/* Returns the mean distance between corresponding vertices. */
double shapes_distance(const float *a, const float *b, size_t vertices);

/* Quality of a model over the number of modes 1 .. modes (Davies 2002).
 *   compactness    share of the variance in the first m modes
 *   generalization mean distance of a left-out shape from its nearest shape of the model made of the others
 *   specificity    mean distance of random shapes of the model (normal weights, `samples` of them) from the nearest of the
 *                  shapes that it was made of */
struct shape_curves {
    int modes;
    double *compactness, *generalization, *specificity;
};

bool shape_curves_make(float *const *shapes, int count, size_t vertices, int samples, struct shape_curves *curves);
void shape_curves_free(struct shape_curves *curves);

#endif
