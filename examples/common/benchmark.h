/* benchmark.h - a closed shape goes through a flow whose answer is known: run, measure, report.
 *
 * What leveque.c and zalesak.c share. A program fills a benchmark_problem; the flow must bring the shape back to where
 * it began at time `period`. All lengths are voxels: voxel (i,j,k) lies at (i,j,k), and the domain [0,1]^3 of the
 * literature is [0,N]^3.
 *
 *   deformation  |exact signed distance| of the particles at the end
 *   tracking     |p - a|, particle against correspondence, at the end: the exact flow brings p back to a
 *   halfway      |flow(a) - p| in the middle, a carried by the exact flow: no credit for errors that undo themselves
 *   surface      |exact signed distance| of the vertices of the welded iso-surface at the end */
#ifndef EXAMPLES_COMMON_BENCHMARK_H
#define EXAMPLES_COMMON_BENCHMARK_H

#include "cli.h"
#include "springls.h"

struct benchmark_options {
    struct cli_common common;
    int steps;            /* 0 = the problem's */
    const char *settings; /* name=value,name=value of springls_params */
    const char *topology;
    bool every_step; /* look at the topology after each step */
};

struct benchmark_problem {
    const char *name;
    springls_implicit_fn shape; /* exact signed distance at the beginning and the end */
    void *shape_data;
    double volume; /* exact */
    springls_velocity_fn velocity;
    void *velocity_data;
    double period;
    int steps;
    float view[3]; /* from the domain towards the eye of the pictures */
    const char *paper_deformation, *paper_tracking, *paper_volume, *paper_speed; /* NULL = the paper has none */
};

/* Reads the command line: the common flags, those of benchmark_options and one of the program's own. Returns what
 * cli_parse returns; after CLI_GO_ON the grid is set. */
int benchmark_parse(struct benchmark_options *options, const char *name, const char *summary,
                    const struct cli_option *own, int argc, char **argv);

/* Runs, prints and writes; the exit status of main. */
int benchmark_run(const struct benchmark_options *options, const struct benchmark_problem *problem);

#endif
