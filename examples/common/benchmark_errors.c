/* benchmark_errors.c - the error measures of benchmark.h. */
#include "benchmark.h"

#include <math.h>
#include <stdlib.h>

struct sums {
    double sum, squares, max;
    int count;
};

static void sums_add(struct sums *s, double value)
{
    s->sum += value;
    s->squares += value * value;
    s->max = fmax(s->max, value);
    s->count++;
}

static struct benchmark_error sums_result(const struct sums *s)
{
    struct benchmark_error e = {NAN, NAN, NAN};
    if (s->count > 0) {
        e.mean = s->sum / s->count;
        e.std = sqrt(fmax(0.0, s->squares / s->count - e.mean * e.mean));
        e.max = s->max;
    }
    return e;
}

static const float *item(springls_view view, int i)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride);
}

static double distance(const float a[3], const double b[3])
{
    return sqrt(pow(a[0] - b[0], 2.0) + pow(a[1] - b[1], 2.0) + pow(a[2] - b[2], 2.0));
}

struct benchmark_error benchmark_deformation(const struct benchmark *b, springls_view particles)
{
    struct sums s = {0.0, 0.0, 0.0, 0};
    for (int i = 0; i < particles.count; ++i) {
        float phi = 0.0f;
        b->shape(b->shape_data, item(particles, i), 1, &phi);
        sums_add(&s, fabs((double)phi));
    }
    return sums_result(&s);
}

struct benchmark_error benchmark_tracking(springls_view particles, springls_view correspondences)
{
    struct sums s = {0.0, 0.0, 0.0, 0};
    for (int i = 0; i < particles.count; ++i) {
        const float *a = item(correspondences, i);
        const double start[3] = {a[0], a[1], a[2]};
        sums_add(&s, distance(item(particles, i), start));
    }
    return sums_result(&s);
}

/* x moved by one classical Runge-Kutta step; factors at the begin, the middle and the end of the step. */
static void exact_step(const struct benchmark *b, const double factors[3], double h, double x[3])
{
    double k[4][3], y[3];
    static const double reach[4] = {0.0, 0.5, 0.5, 1.0};
    static const int stage[4] = {0, 1, 1, 2};
    for (int s = 0; s < 4; ++s) {
        for (int c = 0; c < 3; ++c) {
            y[c] = x[c] + (s > 0 ? reach[s] * h * k[s - 1][c] : 0.0);
        }
        b->exact_velocity(b->flow, y, factors[stage[s]], k[s]);
    }
    for (int c = 0; c < 3; ++c) {
        x[c] += h / 6.0 * (k[0][c] + 2.0 * k[1][c] + 2.0 * k[2][c] + k[3][c]);
    }
}

struct benchmark_error benchmark_flow_error(const struct benchmark *b, double time, springls_view particles,
                                            springls_view correspondences)
{
    enum { STEPS = 256 }; /* leaves less than 1/1000 voxel */
    double factors[2 * STEPS + 1];
    struct sums s = {0.0, 0.0, 0.0, 0};
    double *errors = malloc(sizeof *errors * (size_t)(particles.count + 1));
    if (!errors) {
        return sums_result(&s);
    }
    for (int k = 0; k <= 2 * STEPS; ++k) {
        factors[k] = b->exact_time_factor(b->flow, time * k / (2 * STEPS));
    }
#pragma omp parallel for schedule(static)
    for (int i = 0; i < particles.count; ++i) {
        const float *a = item(correspondences, i);
        double x[3] = {a[0], a[1], a[2]};
        for (int k = 0; k < STEPS; ++k) {
            exact_step(b, factors + 2 * k, time / STEPS, x);
        }
        errors[i] = distance(item(particles, i), x);
    }
    for (int i = 0; i < particles.count; ++i) {
        sums_add(&s, errors[i]);
    }
    free(errors);
    return sums_result(&s);
}
