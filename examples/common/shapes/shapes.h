/* shapes.h - statistics of shapes in correspondence: similarity transforms, Procrustes alignment, principal modes.
 *
 * A shape is 3 floats a vertex; vertex v is the same place on every shape (Cootes et al. 1995, "Active shape models").
 * A shape of the model is mean + sum over modes m of weight[m] * deviation[m] * mode[m], weights counted in deviations. */
#ifndef EXAMPLES_SHAPES_SHAPES_H
#define EXAMPLES_SHAPES_SHAPES_H

#include <stdbool.h>
#include <stddef.h>

/* A triangle mesh; arrays from malloc. */
struct shape_mesh {
    float *positions;
    int *triangles;
    int vertex_count, triangle_count;
};

/* x -> scale * rotation * x + translation. */
struct similarity {
    double scale, rotation[3][3], translation[3];
};

struct similarity similarity_identity(void);
void similarity_apply(const struct similarity *s, const float in[3], float out[3]);
void similarity_apply_all(const struct similarity *s, const float *in, size_t count, float *out); /* in = out is allowed */
struct similarity similarity_inverse(const struct similarity *s);
struct similarity similarity_after(const struct similarity *first, const struct similarity *second); /* second o first */
double similarity_angle(const struct similarity *a, const struct similarity *b); /* between their rotations, radians */

/* The one that takes `from` nearest to `to` in the sense of weighted least squares (Umeyama 1991); weights NULL: all 1.
 * Without scaling its scale is 1. False: less than three points that count, or no spread. */
bool similarity_fit(const float *from, const float *to, const double *weights, size_t count, bool scaling,
                    struct similarity *result);

/* Where a shape's vertices have their middle, and how far from it they are (root of the mean square). */
void shape_size(const float *shape, size_t vertices, double center[3], double *radius);

/* Generalised Procrustes alignment: every shape is moved, turned and (with scaling) scaled onto the mean of all, which
 * keeps the position and orientation of shapes[0] and the shapes' mean size. mean: 3 floats a vertex. */
bool shapes_align(float *const *shapes, int count, size_t vertices, bool scaling, float *mean);

struct shape_model {
    size_t vertices;
    int modes;          /* at most shapes - 1; those without variance are left out */
    float *mean;        /* 3 a vertex */
    float *mode;        /* [m * 3 * vertices]: of length 1 over all coordinates */
    double *deviation;  /* of the shapes along each mode, in the unit of coordinates, falling */
};

/* Principal modes of aligned shapes (eigenvectors of their Gram matrix by LAPACK). False: memory, or LAPACK refuses. */
bool shape_model_build(float *const *shapes, int count, size_t vertices, int max_modes, struct shape_model *model);
void shape_model_free(struct shape_model *model);

void shape_model_shape(const struct shape_model *model, const double *weights, int modes, float *shape);

/* Weights of the shape's nearest model shape (the shape is aligned already). */
void shape_model_weights(const struct shape_model *model, const float *shape, int modes, double *weights);

/* Mean distance between corresponding vertices. */
double shapes_distance(const float *a, const float *b, size_t vertices);

/* Curves over the number of modes 1 .. modes (Davies 2002): what a model of these shapes is worth.
 *   compactness    share of the variance that the first m modes hold
 *   generalisation mean distance of a shape left out from its nearest shape of the model made of the others
 *   specificity    mean distance of random shapes of the model (normal weights, `samples` of them) from the nearest of
 *                  those it was made of */
struct shape_curves {
    int modes;
    double *compactness, *generalization, *specificity;
};

bool shape_curves_make(float *const *shapes, int count, size_t vertices, int samples, struct shape_curves *curves);
void shape_curves_free(struct shape_curves *curves);

#endif
