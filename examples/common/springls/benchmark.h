/* benchmark.h - moves a shape through a flow with a known answer and measures the errors of springls.
 *
 * Lengths are in voxels: the model's world is its grid. Measured over all springls at the end (t = T):
 *   deformation  |phi_exact(p)|                      distance of particles from the exact surface
 *   tracking     |p - a|                             distance of particles from their start, where the flow ends
 *   halfway      |flow(a, 0 -> T/2) - p| at t = T/2  tracking without the advantage of reversed time
 *   surface      |phi_exact(v)| over the vertices of the zero level
 *   volume       enclosed by the zero level (divergence theorem): change = against t = 0, error = against the exact shape */
#ifndef EXAMPLES_SPRINGLS_BENCHMARK_H
#define EXAMPLES_SPRINGLS_BENCHMARK_H

#include "base/cli.h"
#include "springls.h"
#include "springls/coverage.h"
#include "springls/model_pictures.h"

#include <stddef.h>

/* The paper's figures for a setting: texts for the table, NULL where it has none. */
struct benchmark_published {
    int grid;
    double period;
    const char *source, *springls, *deformation, *tracking, *volume, *time;
};

struct benchmark {
    const char *name, *title;
    int grid, steps; /* 0 steps: the library's, of two voxels */
    double period, duration; /* of the flow; of the whole run, in the flow's time */
    bool reverses;           /* time reverses at T/2; else the body rotates */
    springls_implicit_fn shape;
    void *shape_data;
    double shape_volume;
    springls_velocity_fn velocity;
    const char *velocity_source; /* the same in OpenCL C */
    void *flow;                  /* `user` of the velocity */
    size_t flow_bytes;
    /* Computes the same velocity in double precision; time_factor is the part that depends on time. */
    void (*exact_velocity)(const void *flow, const double x[3], double time_factor, double v[3]);
    double (*exact_time_factor)(const void *flow, double time);
    float view[3], up[3]; /* of pictures: from the object to the eye; the direction upwards */
    const struct benchmark_published *published;
    int published_count;
};

struct benchmark_options {
    struct cli_common common;
    const char *set, *topology, *series;
    bool every_step, processor_time;
    int steps, frames;
};

struct benchmark_options benchmark_defaults(void);
/* Reads the command line of a benchmark that has one option of its own; returns as cli_parse does. */
int benchmark_parse(const char *name, const char *summary, struct cli_option own, struct benchmark_options *options, int argc,
                    char **argv);

struct benchmark_error {
    double mean, std, q99, max; /* q99: the 99th percentile */
};

struct benchmark_result {
    int steps, springls_initial, springls_final, threads;
    double springls_mean;
    struct coverage_range coverage; /* over 24 times, after the first resampling */
    struct benchmark_error deformation, tracking, halfway, surface;
    double volume_change_percent, volume_error_percent;
    int components, euler;
    int components_min, components_max, euler_min, euler_max; /* over all steps, with --every-step */
    double seconds_total, seconds_stage[SPRINGLS_STAGE_COUNT];
    size_t model_bytes;
    uint64_t state_hash;
    char backend[256]; /* "scalar", or the device's name */
    double kernels_per_step, downloads_per_step, bytes_down_per_step; /* on the device, without measuring */
    springls_stats stats;
};

/* Runs the benchmark; returns the exit status. */
int benchmark_main(const struct benchmark *benchmark, const struct benchmark_options *options);

/* ---- building blocks ---- */
struct benchmark_error benchmark_summary(double *values, int count); /* sorts them; NAN when there are none */
/* Moves points, 3 numbers each, by the exact flow from time 0 to `time`. */
void benchmark_flow(const struct benchmark *benchmark, double time, double *points, int count);
struct benchmark_error benchmark_deformation(const struct benchmark *benchmark, springls_view particles);
struct benchmark_error benchmark_tracking(springls_view particles, springls_view correspondences);
/* Compares correspondences, moved by the exact flow to `time`, with the particles. */
struct benchmark_error benchmark_flow_error(const struct benchmark *benchmark, double time, springls_view particles,
                                            springls_view correspondences);

bool benchmark_write_json(const struct benchmark *benchmark, const struct benchmark_options *options,
                          const struct benchmark_result *result);
void benchmark_print_table(const struct benchmark *benchmark, const struct benchmark_options *options,
                           const struct benchmark_result *result);

#endif
