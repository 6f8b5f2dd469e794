/* benchmark_errors.c - error measures. */
#include "springls/benchmark.h"

#include "base/threads.h"

#include <math.h>
#include <stdlib.h>

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

struct benchmark_error benchmark_summary(double *values, int count)
{
    struct benchmark_error e = {NAN, NAN, NAN, NAN};
    double sum = 0.0, squares = 0.0;
    if (count <= 0) {
        return e;
    }
    for (int i = 0; i < count; ++i) {
        sum += values[i];
        squares += values[i] * values[i];
    }
    e.mean = sum / count;
    e.std = sqrt(fmax(0.0, squares / count - e.mean * e.mean));
    qsort(values, (size_t)count, sizeof *values, ascending);
    e.q99 = values[(int)ceil(0.99 * count) - 1];
    e.max = values[count - 1];
    return e;
}

/* Summarizes `count` values and frees them; NULL, for memory that was short, gives NAN. */
static struct benchmark_error summary_of(double *values, int count)
{
    const struct benchmark_error e = benchmark_summary(values, values ? count : 0);
    free(values);
    return e;
}

static double *room_for(int count)
{
    return malloc(sizeof(double) * (size_t)(count + 1));
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
    double *errors = room_for(particles.count);
    for (int i = 0; errors && i < particles.count; ++i) {
        float phi = 0.0f;
        b->shape(b->shape_data, item(particles, i), 1, &phi);
        errors[i] = fabs((double)phi);
    }
    return summary_of(errors, particles.count);
}

struct benchmark_error benchmark_tracking(springls_view particles, springls_view correspondences)
{
    double *errors = room_for(particles.count);
    for (int i = 0; errors && i < particles.count; ++i) {
        const float *a = item(correspondences, i);
        const double start[3] = {a[0], a[1], a[2]};
        errors[i] = distance(item(particles, i), start);
    }
    return summary_of(errors, particles.count);
}

/* Moves x by one classical Runge-Kutta step; factors at the beginning, the middle and the end of the step. */
static void exact_step(const struct benchmark *b, const double factors[3], double h, double x[3])
{
    double k[4][3], y[3];
    static const double fraction[4] = {0.0, 0.5, 0.5, 1.0};
    static const int stage[4] = {0, 1, 1, 2};
    for (int s = 0; s < 4; ++s) {
        for (int c = 0; c < 3; ++c) {
            y[c] = x[c] + (s > 0 ? fraction[s] * h * k[s - 1][c] : 0.0);
        }
        b->exact_velocity(b->flow, y, factors[stage[s]], k[s]);
    }
    for (int c = 0; c < 3; ++c) {
        x[c] += h / 6.0 * (k[0][c] + 2.0 * k[1][c] + 2.0 * k[2][c] + k[3][c]);
    }
}

enum { STEPS = 256 }; /* of the exact flow: error below 1/1000 voxel */

struct flow_loop {
    const struct benchmark *b;
    double time;
    const double *factors;
    double *points;
};

static void run_flow_loop(void *arg, int begin, int end)
{
    const struct flow_loop *loop = arg;
    const struct benchmark *b = loop->b;
    const double time = loop->time;
    const double *factors = loop->factors;
    double *points = loop->points;
    for (int i = begin; i < end; ++i) {
        for (int k = 0; k < STEPS; ++k) {
            exact_step(b, factors + 2 * k, time / STEPS, points + 3 * i);
        }
    }
}

void benchmark_flow(const struct benchmark *b, double time, double *points, int count)
{
    double factors[2 * STEPS + 1];
    for (int k = 0; k <= 2 * STEPS; ++k) {
        factors[k] = b->exact_time_factor(b->flow, time * k / (2 * STEPS));
    }
    struct flow_loop loop = {b, time, factors, points};
    threads_for(count, 64, run_flow_loop, &loop);
}

struct benchmark_error benchmark_flow_error(const struct benchmark *b, double time, springls_view particles,
                                            springls_view correspondences)
{
    double *errors = room_for(particles.count), *moved = room_for(3 * particles.count);
    if (errors && moved) {
        for (int i = 0; i < 3 * particles.count; ++i) {
            moved[i] = (double)item(correspondences, i / 3)[i % 3];
        }
        benchmark_flow(b, time, moved, particles.count);
        for (int i = 0; i < particles.count; ++i) {
            errors[i] = distance(item(particles, i), moved + 3 * i);
        }
    }
    const struct benchmark_error e = summary_of(errors, moved ? particles.count : 0);
    free(moved);
    return e;
}
