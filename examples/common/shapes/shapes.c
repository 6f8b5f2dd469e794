#include "shapes/shapes.h"

#include <lapacke.h>

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- similarity transforms ---- */

struct similarity similarity_identity(void)
{
    const struct similarity s = {1.0, {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {0.0, 0.0, 0.0}};
    return s;
}

void similarity_apply(const struct similarity *s, const float in[3], float out[3])
{
    const double x = (double)in[0], y = (double)in[1], z = (double)in[2];
    for (int r = 0; r < 3; ++r) {
        const double *row = s->rotation[r];
        out[r] = (float)(s->scale * (row[0] * x + row[1] * y + row[2] * z) + s->translation[r]);
    }
}

void similarity_apply_all(const struct similarity *s, const float *in, size_t count, float *out)
{
    for (size_t v = 0; v < count; ++v) {
        similarity_apply(s, in + 3 * v, out + 3 * v);
    }
}

struct similarity similarity_inverse(const struct similarity *s)
{
    struct similarity inverse;
    inverse.scale = 1.0 / s->scale;
    for (int r = 0; r < 3; ++r) {
        inverse.translation[r] = 0.0;
        for (int c = 0; c < 3; ++c) {
            inverse.rotation[r][c] = s->rotation[c][r];
            inverse.translation[r] -= inverse.scale * s->rotation[c][r] * s->translation[c];
        }
    }
    return inverse;
}

struct similarity similarity_after(const struct similarity *first, const struct similarity *second)
{
    struct similarity both;
    both.scale = first->scale * second->scale;
    for (int r = 0; r < 3; ++r) {
        both.translation[r] = second->translation[r];
        for (int c = 0; c < 3; ++c) {
            both.rotation[r][c] = 0.0;
            for (int k = 0; k < 3; ++k) {
                both.rotation[r][c] += second->rotation[r][k] * first->rotation[k][c];
            }
            both.translation[r] += second->scale * second->rotation[r][c] * first->translation[c];
        }
    }
    return both;
}

double similarity_angle(const struct similarity *a, const struct similarity *b)
{
    double trace = 0.0;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            trace += a->rotation[r][c] * b->rotation[r][c];
        }
    }
    return acos(fmax(-1.0, fmin(1.0, 0.5 * (trace - 1.0))));
}

static void centroid(const float *points, const double *weights, size_t count, double center[3], double *total)
{
    *total = center[0] = center[1] = center[2] = 0.0;
    for (size_t v = 0; v < count; ++v) {
        const double w = weights ? weights[v] : 1.0;
        *total += w;
        for (int k = 0; k < 3; ++k) {
            center[k] += w * (double)points[3 * v + (size_t)k];
        }
    }
    for (int k = 0; k < 3; ++k) {
        center[k] = *total > 0.0 ? center[k] / *total : 0.0;
    }
}

static double determinant(const double m[9])
{
    return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
}

bool similarity_fit(const float *from, const float *to, const double *weights, size_t count, bool scaling,
                    struct similarity *result)
{
    double a[3], b[3], total, cross[9] = {0}, spread = 0.0, singular[3], u[9], vt[9], rest[2];
    size_t used = 0;
    *result = similarity_identity();
    centroid(from, weights, count, a, &total);
    centroid(to, weights, count, b, &total);
    for (size_t v = 0; v < count; ++v) {
        const double w = weights ? weights[v] : 1.0;
        used += w > 0.0;
        for (int r = 0; r < 3; ++r) {
            const double x = (double)from[3 * v + (size_t)r] - a[r];
            spread += w * x * x;
            for (int c = 0; c < 3; ++c) { /* of (to - b) (from - a)^T */
                cross[3 * c + r] += w * ((double)to[3 * v + (size_t)c] - b[c]) * x;
            }
        }
    }
    if (used < 3 || !(spread > 0.0) ||
        LAPACKE_dgesvd(LAPACK_ROW_MAJOR, 'A', 'A', 3, 3, cross, 3, singular, u, 3, vt, 3, rest) != 0) {
        return false;
    }
    const double sign[3] = {1.0, 1.0, determinant(u) * determinant(vt) < 0.0 ? -1.0 : 1.0}; /* exclude reflections */
    double sum = 0.0;
    for (int r = 0; r < 3; ++r) {
        sum += sign[r] * singular[r];
        for (int c = 0; c < 3; ++c) {
            result->rotation[r][c] = 0.0;
            for (int k = 0; k < 3; ++k) {
                result->rotation[r][c] += u[3 * r + k] * sign[k] * vt[3 * k + c];
            }
        }
    }
    result->scale = scaling ? sum / spread : 1.0;
    for (int r = 0; r < 3; ++r) {
        const double *row = result->rotation[r];
        result->translation[r] = b[r] - result->scale * (row[0] * a[0] + row[1] * a[1] + row[2] * a[2]);
    }
    return !scaling || sum > 0.0;
}

/* ---- alignment ---- */

void shape_size(const float *shape, size_t vertices, double center[3], double *radius)
{
    double total, sum = 0.0;
    centroid(shape, NULL, vertices, center, &total);
    for (size_t i = 0; i < 3 * vertices; ++i) {
        const double d = (double)shape[i] - center[i % 3];
        sum += d * d;
    }
    *radius = vertices > 0 ? sqrt(sum / (double)vertices) : 0.0;
}

static void mean_shape(float *const *shapes, int count, size_t vertices, float *mean)
{
    for (size_t i = 0; i < 3 * vertices; ++i) {
        double sum = 0.0;
        for (int s = 0; s < count; ++s) {
            sum += (double)shapes[s][i];
        }
        mean[i] = (float)(sum / count);
    }
}

bool shapes_align(float *const *shapes, int count, size_t vertices, bool scaling, float *mean)
{
    enum { MAX_ROUNDS = 50 };
    double center[3], size = 0.0, radius;
    if (count < 1 || vertices < 3) {
        return false;
    }
    for (int s = 0; s < count; ++s) {
        shape_size(shapes[s], vertices, center, &radius);
        size += radius / count;
    }
    memcpy(mean, shapes[0], 3 * vertices * sizeof *mean);
    float *before = malloc(3 * vertices * sizeof *before);
    float *first = malloc(3 * vertices * sizeof *first);
    bool good = before && first;
    if (good) {
        memcpy(first, shapes[0], 3 * vertices * sizeof *first);
    }
    for (int round = 0; good && round < MAX_ROUNDS; ++round) {
        struct similarity fit;
        for (int s = 0; good && s < count; ++s) {
            good = similarity_fit(shapes[s], mean, NULL, vertices, scaling, &fit);
            similarity_apply_all(&fit, shapes[s], vertices, shapes[s]);
        }
        memcpy(before, mean, 3 * vertices * sizeof *before);
        mean_shape(shapes, count, vertices, mean);
        /* Fix position and size of the mean, which would drift and shrink: those of the first shape, and the mean size. */
        good = good && similarity_fit(mean, first, NULL, vertices, false, &fit);
        shape_size(mean, vertices, center, &radius);
        struct similarity grow = similarity_identity();
        grow.scale = scaling && radius > 0.0 ? size / radius : 1.0;
        for (int k = 0; k < 3; ++k) {
            grow.translation[k] = (1.0 - grow.scale) * center[k];
        }
        fit = similarity_after(&grow, &fit);
        similarity_apply_all(&fit, mean, vertices, mean);
        for (int s = 0; s < count; ++s) {
            similarity_apply_all(&fit, shapes[s], vertices, shapes[s]);
        }
        if (shapes_distance(before, mean, vertices) < 1e-6 * size) {
            break;
        }
    }
    free(before);
    free(first);
    return good;
}

double shapes_distance(const float *a, const float *b, size_t vertices)
{
    double sum = 0.0;
    for (size_t v = 0; v < vertices; ++v) {
        const double x = (double)a[3 * v] - (double)b[3 * v], y = (double)a[3 * v + 1] - (double)b[3 * v + 1],
                     z = (double)a[3 * v + 2] - (double)b[3 * v + 2];
        sum += sqrt(x * x + y * y + z * z);
    }
    return vertices > 0 ? sum / (double)vertices : 0.0;
}

/* ---- principal modes ---- */

/* Computes the Gram matrix of the shapes' differences from the mean, row-major count x count. */
static void gram_matrix(float *const *shapes, int count, size_t vertices, const float *mean, double *gram)
{
    for (int a = 0; a < count; ++a) {
        for (int b = 0; b <= a; ++b) {
            double sum = 0.0;
            for (size_t i = 0; i < 3 * vertices; ++i) {
                sum += ((double)shapes[a][i] - (double)mean[i]) * ((double)shapes[b][i] - (double)mean[i]);
            }
            gram[a * count + b] = gram[b * count + a] = sum;
        }
    }
}

/* Computes a mode as the sum over shapes of coefficient * difference, scaled to length 1. */
static void make_mode(float *const *shapes, int count, size_t vertices, const float *mean, const double *coefficients,
                      size_t stride, double eigenvalue, float *mode)
{
    for (size_t i = 0; i < 3 * vertices; ++i) {
        double sum = 0.0;
        for (int s = 0; s < count; ++s) {
            sum += coefficients[(size_t)s * stride] * ((double)shapes[s][i] - (double)mean[i]);
        }
        mode[i] = (float)(sum / sqrt(eigenvalue));
    }
}

bool shape_model_build(float *const *shapes, int count, size_t vertices, int max_modes, struct shape_model *model)
{
    const size_t n = (size_t)(count > 1 ? count : 1), maximum = (size_t)(max_modes < count - 1 ? max_modes : count - 1);
    memset(model, 0, sizeof *model);
    model->vertices = vertices;
    model->mean = malloc(3 * vertices * sizeof *model->mean);
    model->mode = malloc((3 * vertices * maximum + 1) * sizeof *model->mode);
    model->deviation = calloc(maximum + 1, sizeof *model->deviation);
    double *gram = malloc(n * n * sizeof *gram), *eigenvalues = malloc(n * sizeof *eigenvalues);
    bool good = model->mean && model->mode && model->deviation && gram && eigenvalues;
    if (good) {
        mean_shape(shapes, count, vertices, model->mean);
        gram_matrix(shapes, count, vertices, model->mean, gram);
        good = LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'V', 'U', (lapack_int)n, gram, (lapack_int)n, eigenvalues) == 0;
    }
    for (size_t m = 0; good && m < maximum; ++m) { /* eigenvalues ascend; rounding leaves about 1e-7 of float coordinates */
        const size_t last = n - 1 - m;
        if (!(eigenvalues[last] > 1e-10 * eigenvalues[n - 1]) || !(eigenvalues[last] > 0.0)) {
            break;
        }
        model->deviation[m] = sqrt(eigenvalues[last] / (double)(count - 1));
        make_mode(shapes, count, vertices, model->mean, gram + last, n, eigenvalues[last], model->mode + 3 * vertices * m);
        model->modes++;
    }
    free(gram);
    free(eigenvalues);
    if (!good) {
        shape_model_free(model);
    }
    return good;
}

void shape_model_free(struct shape_model *model)
{
    free(model->mean);
    free(model->mode);
    free(model->deviation);
    memset(model, 0, sizeof *model);
}

void shape_model_shape(const struct shape_model *model, const double *weights, int modes, float *shape)
{
    memcpy(shape, model->mean, 3 * model->vertices * sizeof *shape);
    for (int m = 0; m < modes && m < model->modes; ++m) {
        const float *mode = model->mode + 3 * model->vertices * (size_t)m;
        const float amount = (float)(weights[m] * model->deviation[m]);
        for (size_t i = 0; i < 3 * model->vertices; ++i) {
            shape[i] += amount * mode[i];
        }
    }
}

void shape_model_weights(const struct shape_model *model, const float *shape, int modes, double *weights)
{
    for (int m = 0; m < modes && m < model->modes; ++m) {
        const float *mode = model->mode + 3 * model->vertices * (size_t)m;
        double sum = 0.0;
        for (size_t i = 0; i < 3 * model->vertices; ++i) {
            sum += (double)mode[i] * ((double)shape[i] - (double)model->mean[i]);
        }
        weights[m] = sum / model->deviation[m];
    }
}

/* ---- curves ---- */

/* Returns a normal deviate: the sum of twelve uniform ones of a linear congruential generator, minus six. */
static double normal_deviate(uint64_t *state)
{
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) {
        *state = *state * 6364136223846793005u + 1442695040888963407u;
        sum += (double)(*state >> 11) / 9007199254740992.0;
    }
    return sum;
}

static bool generalize(float *const *shapes, int count, size_t vertices, int modes, double *curve)
{
    float **others = malloc((size_t)count * sizeof *others), *nearest = malloc(3 * vertices * sizeof *nearest);
    double *weights = malloc((size_t)(modes + 1) * sizeof *weights);
    bool good = others && nearest && weights;
    for (int left_out = 0; good && left_out < count; ++left_out) {
        struct shape_model model;
        for (int s = 0, o = 0; s < count; ++s) {
            if (s != left_out) {
                others[o++] = shapes[s];
            }
        }
        good = shape_model_build(others, count - 1, vertices, modes, &model);
        for (int m = 1; good && m <= modes; ++m) {
            shape_model_weights(&model, shapes[left_out], m, weights);
            shape_model_shape(&model, weights, m, nearest);
            curve[m - 1] += shapes_distance(nearest, shapes[left_out], vertices) / count;
        }
        shape_model_free(&model);
    }
    free(others);
    free(nearest);
    free(weights);
    return good;
}

static bool specify(float *const *shapes, int count, const struct shape_model *model, int modes, int samples, double *curve)
{
    float *random = malloc(3 * model->vertices * sizeof *random);
    double *weights = malloc((size_t)(modes + 1) * sizeof *weights);
    uint64_t state = 1;
    for (int i = 0; random && weights && i < samples; ++i) {
        for (int m = 0; m < modes; ++m) {
            weights[m] = normal_deviate(&state);
        }
        for (int m = 1; m <= modes; ++m) {
            double minimum = INFINITY;
            shape_model_shape(model, weights, m, random);
            for (int s = 0; s < count; ++s) {
                minimum = fmin(minimum, shapes_distance(random, shapes[s], model->vertices));
            }
            curve[m - 1] += minimum / samples;
        }
    }
    const bool good = random && weights;
    free(random);
    free(weights);
    return good;
}

bool shape_curves_make(float *const *shapes, int count, size_t vertices, int samples, struct shape_curves *curves)
{
    struct shape_model model;
    memset(curves, 0, sizeof *curves);
    if (!shape_model_build(shapes, count, vertices, count, &model)) {
        return false;
    }
    curves->modes = model.modes;
    const size_t room = (size_t)model.modes + 1;
    curves->compactness = calloc(room, sizeof(double));
    curves->generalization = calloc(room, sizeof(double));
    curves->specificity = calloc(room, sizeof(double));
    bool good = curves->compactness && curves->generalization && curves->specificity;
    double total = 0.0, held = 0.0;
    for (int m = 0; m < model.modes; ++m) {
        total += model.deviation[m] * model.deviation[m];
    }
    for (int m = 0; good && m < model.modes; ++m) {
        held += model.deviation[m] * model.deviation[m];
        curves->compactness[m] = held / total;
    }
    good = good && (count < 3 || generalize(shapes, count, vertices, model.modes, curves->generalization))
        && specify(shapes, count, &model, model.modes, samples, curves->specificity);
    shape_model_free(&model);
    if (!good) {
        shape_curves_free(curves);
    }
    return good;
}

void shape_curves_free(struct shape_curves *curves)
{
    free(curves->compactness);
    free(curves->generalization);
    free(curves->specificity);
    memset(curves, 0, sizeof *curves);
}
