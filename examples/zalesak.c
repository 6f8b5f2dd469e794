/* zalesak.c - Zalesak's test (paper, section 5.2, Fig. 9, Table 4): a notched sphere turned by a rigid rotation, 628 steps
 * a revolution, about the axis through the middle of the domain that is parallel to z. Domain [0,1]^3, voxel i at i/N;
 * the body of Enright et al. 2002: radius 0.15 at (0.5, 0.75, 0.5), slot 0.05 wide and 0.125 deep, through all z. */
#include "springls.h"
#include "springls/benchmark.h"
#include "springls/exact_flows.h"

#include <math.h>

static const double pi = 3.14159265358979323846;
enum { STEPS_A_REVOLUTION = 628 };

static double time_factor(const void *user, double time)
{
    (void)user;
    (void)time;
    return 1.0;
}

static void velocity(const void *user, const double x[3], double factor, double v[3])
{
    const struct exact_flow *flow = user;
    const double omega = factor * 2.0 * pi / STEPS_A_REVOLUTION;
    v[0] = -omega * (x[1] - (double)flow->center[1]);
    v[1] = omega * (x[0] - (double)flow->center[0]);
    v[2] = 0.0;
}

/* Computes the sphere's volume minus the slot's: the sphere's height over the slot's rectangle, by the midpoint rule. */
static double body_volume(double radius, double width, double depth)
{
    enum { CELLS = 1000 };
    double slot = 0.0;
    for (int j = 0; j < CELLS; ++j) {
        const double y = -radius + depth * (j + 0.5) / CELLS;
        for (int i = 0; i < CELLS; ++i) {
            const double x = width * ((i + 0.5) / CELLS - 0.5);
            slot += 2.0 * sqrt(fmax(0.0, radius * radius - x * x - y * y));
        }
    }
    return 4.0 / 3.0 * pi * radius * radius * radius - slot * width * depth / CELLS / CELLS;
}

static const struct benchmark_published published[] = {
    {128, STEPS_A_REVOLUTION, "paper, Table 4", "2.8K", NULL, NULL, "0.6 %", "31 s"},
};

int main(int argc, char **argv)
{
    struct benchmark_options options = benchmark_defaults();
    int revolutions = 1;
    const struct cli_option own = {"revolutions", CLI_INT, &revolutions, "R", "turns of the body", 1.0, 1000.0, NULL};
    const int status = benchmark_parse("zalesak", "Zalesak's test: a notched sphere turned all the way round", own, &options,
                                       argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    const int grid = options.common.grid > 0 ? options.common.grid : 128;
    const float n = (float)grid;
    springls_notched_sphere body = {{0.5f * n, 0.75f * n, 0.5f * n}, 0.15f * n, 0.05f * n, 0.125f * n};
    struct exact_flow flow = EXACT_ROTATION(0.5f * n, 0.5f * n, 0.5f * n, 0.0f, 0.0f, 1.0f, (float)(2.0 * pi / STEPS_A_REVOLUTION));
    const struct benchmark benchmark = {.name = "zalesak",
                                        .title = "Zalesak's test",
                                        .grid = grid,
                                        .steps = options.steps > 0 ? options.steps : revolutions * STEPS_A_REVOLUTION,
                                        .period = STEPS_A_REVOLUTION,
                                        .duration = (double)revolutions * STEPS_A_REVOLUTION,
                                        .shape = springls_implicit_notched_sphere,
                                        .shape_data = &body,
                                        .shape_volume = body_volume(0.15 * grid, 0.05 * grid, 0.125 * grid),
                                        .velocity = exact_flow_velocity,
                                        .velocity_source = exact_flow_source(),
                                        .flow = &flow,
                                        .flow_bytes = sizeof flow,
                                        .exact_velocity = velocity,
                                        .exact_time_factor = time_factor,
                                        .view = {0.5f, -0.6f, 1.0f},
                                        .up = {0.0f, 1.0f, 0.0f},
                                        .published = published,
                                        .published_count = 1};
    return benchmark_main(&benchmark, &options);
}
