/* leveque.c - LeVeque's deformation test (paper, sections 5.2 to 5.5): a flow draws a sphere out into a thin disk and, time
 * being reversed at T/2, back again. Domain [0,1]^3, voxel i at i/N; sphere of radius 0.15 at (0.35, 0.35, 0.35). */
#include "springls.h"
#include "springls/benchmark.h"
#include "springls/exact_flows.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static double time_factor(const void *user, double time)
{
    const struct exact_flow *flow = user;
    return cos(pi * time / (double)flow->period);
}

static void velocity(const void *user, const double x[3], double factor, double v[3])
{
    const struct exact_flow *flow = user;
    const double n = (double)flow->size;
    double sin_squared[3], sin_double[3]; /* sin^2(pi x), sin(2 pi x) */
    for (int c = 0; c < 3; ++c) {
        const double s = sin(pi * x[c] / n), k = cos(pi * x[c] / n);
        sin_squared[c] = s * s;
        sin_double[c] = 2.0 * s * k;
    }
    v[0] = factor * n * 2.0 * sin_squared[0] * sin_double[1] * sin_double[2];
    v[1] = -factor * n * sin_double[0] * sin_squared[1] * sin_double[2];
    v[2] = -factor * n * sin_double[0] * sin_double[1] * sin_squared[2];
}

static const struct benchmark_published published[] = {
    {128, 2.5, "paper, Table 3", "5K", "0.38 +- 0.28", "0.93 +- 1.07", "4.6 %", "35 s"},
    {256, 2.5, "paper, Table 3", "19K", "0.34 +- 0.31", "0.92 +- 1.05", "1.2 %", "300 s"},
    {384, 2.5, "paper, Table 3", "41K", "0.31 +- 0.27", "0.91 +- 1.08", NULL, "970 s"},
    {512, 2.5, "paper, Table 3", "72K", "0.32 +- 0.30", "0.94 +- 1.18", NULL, "2500 s"},
    {100, 1.6, "paper, Table 5", NULL, "0.26", "0.57", NULL, NULL},
    {200, 1.6, "paper, Table 5", NULL, "0.25", "0.59", NULL, NULL},
};

int main(int argc, char **argv)
{
    struct benchmark_options options = benchmark_defaults();
    double period = 2.5;
    const struct cli_option own = {"period", CLI_DOUBLE, &period, "T", "period of the flow", 0.01, 100.0, NULL};
    const int status = benchmark_parse("leveque", "LeVeque's test: a sphere drawn out into a thin disk and back", own, &options,
                                       argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    const int grid = options.common.grid > 0 ? options.common.grid : 128;
    const float n = (float)grid;
    springls_sphere sphere = {{0.35f * n, 0.35f * n, 0.35f * n}, 0.15f * n};
    struct exact_flow flow = EXACT_DEFORMATION(n, (float)period);
    const double radius = 0.15 * grid;
    const bool papers = strcmp(options.common.params, "paper") == 0;
    const int usual_steps = papers ? (int)fmax(1.0, floor(period * grid / 0.64 + 0.5)) : 0;
    const struct benchmark benchmark = {.name = "leveque",
                                        .title = "LeVeque's test",
                                        .grid = grid,
                                        .steps = options.steps > 0 ? options.steps : usual_steps,
                                        .period = period,
                                        .duration = period,
                                        .reverses = true,
                                        .shape = springls_implicit_sphere,
                                        .shape_data = &sphere,
                                        .shape_volume = 4.0 / 3.0 * pi * radius * radius * radius,
                                        .velocity = exact_flow_velocity,
                                        .velocity_source = exact_flow_source(),
                                        .flow = &flow,
                                        .flow_bytes = sizeof flow,
                                        .exact_velocity = velocity,
                                        .exact_time_factor = time_factor,
                                        .view = {1.0f, -1.2f, 0.6f},
                                        .up = {0.0f, 0.0f, 1.0f},
                                        .published = published,
                                        .published_count = (int)(sizeof published / sizeof *published)};
    return benchmark_main(&benchmark, &options);
}
