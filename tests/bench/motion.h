/* motion.h - runs motions whose answer is known, in this process, and measures how far the model is from it.
 *
 * In which order bricks and springls come is chance, and chance alone moves a mean error by a third. So a motion is run in
 * several orders: its axes permuted cyclically, shape, flow and all, which is another order and the same problem. Figures
 * are means over the orders, with the least and the largest beside them. */
#ifndef BENCH_MOTION_H
#define BENCH_MOTION_H

#include "examples/common/springls/benchmark.h"
#include "examples/common/base/json.h"
#include "examples/common/surface/mesh_io.h"

enum { MOTION_ORDERS = 3 };

struct motion {
    /* Of it: name, grid, duration, reverses, shape, flow with its exact velocity. velocity NULL: the exact one serves. */
    struct benchmark problem;
    const struct mesh *mesh;                           /* the start in voxels, instead of a shape */
    bool (*on_edge)(const void *flow, const float x[3]); /* is this vertex of the start on a sharp edge? NULL: no edges */
    springls_pressure_fn pressure;                     /* moves springls too, beside problem.velocity; NULL: none */
    double halfway_volume;                             /* exact volume at half time in volumes of the start */
};

struct motion_setting {
    springls_params params;
    float max_displacement; /* voxels a step; 0: problem.steps steps of equal time, an even number */
};

/* Distances in voxels; angles in degrees; cpu of the steps alone, by the thread's clock. */
#define MOTION_FIGURES(X)                                                                                               \
    X(deformation_mean) X(deformation_max)                /* particles to the exact shape at the end */                 \
    X(tracking_mean) X(tracking_q99) X(tracking_max)      /* at the end, particle to where the exact flow takes a */    \
    X(halfway_mean) X(halfway_q99) X(halfway_max)         /* the same at half time */                                   \
    X(within_halfway) X(ratio_halfway)                    /* springls_springl_errors: share whose error is less than   */ \
    X(within_end) X(ratio_end)                            /* the estimate, percent; median of estimate over error */    \
    X(mesh_within_halfway) X(mesh_ratio_halfway)          /* springls_mesh_errors: the same of the zero level's vertices */ \
    X(mesh_within_end) X(mesh_ratio_end)                                                                                \
    X(surface_mean) X(surface_max)                        /* vertices of the zero level to the exact shape */           \
    /* From points of the given surface to the start's zero level: all, and those on sharp edges. From where the exact */ \
    /* flow takes them to the end's zero level, and to its springls. */                                                  \
    X(start_mean) X(start_q99) X(start_max) X(start_edge_mean) X(start_edge_max)                                        \
    X(end_mean) X(end_q99) X(end_max) X(end_edge_mean) X(end_edge_max)                                                  \
    X(soup_mean) X(soup_q99) X(soup_max) X(soup_edge_mean) X(soup_edge_max)                                             \
    /* Over eight times, from the first resampling on: springls' area over the zero level's; share of that in springls of its */ \
    /* side, within .1 voxel; in two or more. */                                                                         \
    X(coverage_least) X(coverage_most) X(covered_mean) X(covered_least) X(covered_twice_most)                           \
    X(volume_halfway) X(volume_end)                       /* error in percent of the exact multiple of the start's */   \
    X(components_start) X(components_halfway) X(components_end)                                                         \
    X(euler_start) X(euler_halfway) X(euler_end)                                                                        \
    X(springls_start) X(springls_mean) X(springls_end)                                                                  \
    X(smallest_angle_min) X(smallest_angle_mean)          /* of springls at the end */                                  \
    X(steps) X(cpu_ms_a_step) X(cpu_seconds)

#define MOTION_FIGURE_NAME(name) MOTION_##name,
enum motion_figure { MOTION_FIGURES(MOTION_FIGURE_NAME) MOTION_FIGURE_COUNT };
#undef MOTION_FIGURE_NAME

/* What several settings have come to. */
struct motion_case {
    const char *name;
    const struct motion *motion;
    struct motion_setting setting;
    double figures[MOTION_ORDERS][MOTION_FIGURE_COUNT]; /* NAN: does not apply, or the run did not come so far */
    char failures[MOTION_ORDERS][300];                  /* "": none */
};

/* Runs each case in the first `orders` orders, on one thread a processor, one a run. */
void motion_run_all(struct motion_case *cases, int count, int orders);

struct motion_spread {
    double mean, least, most; /* NAN when a run failed, or it does not apply */
};
struct motion_spread motion_spread(const struct motion_case *c, int orders, enum motion_figure figure);
double motion_mean(const struct motion_case *c, int orders, enum motion_figure figure);

/* A line on stdout for each run that failed; how many they are. */
int motion_print_failures(const struct motion_case *cases, int count, int orders);
/* Members of the object that is open: a case's name and an array of every figure, a number an order. */
void motion_json(struct json_writer *json, const struct motion_case *c, int orders);

/* The environment's number of this name; `otherwise` when it has none. */
double environment_number(const char *name, double otherwise);

#endif
