/* zalesak.c - Zalesak's test in three dimensions (Enright et al.): a ball with a slot turns about the middle of the
 * domain. A rigid motion: every rounded edge is the method's doing. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include "common/benchmark.h"

#include <math.h>

#define PI 3.14159265358979
#define STEPS_PER_TURN 628

/* The ball less its slot, |x| < width/2 from the ball's bottom up to y = depth - radius: Simpson's rule over x, where
 * the section of the slot is a disc of radius s, of which the part below y = roof is taken away. */
static double notched_volume(double radius, double width, double depth)
{
    const int intervals = 1000;
    const double roof = depth - radius;
    double slot = 0.0;
    for (int i = 0; i <= intervals; ++i) {
        const double x = 0.5 * width * i / intervals, s = sqrt(radius * radius - x * x);
        const double h = roof < s ? roof : s;
        const double below = s * s * (0.5 * PI + asin(h / s)) + h * sqrt(s * s - h * h);
        slot += below * (i == 0 || i == intervals ? 1.0 : i % 2 ? 4.0 : 2.0);
    }
    slot *= 2.0 * (0.5 * width / intervals) / 3.0;
    return 4.0 / 3.0 * PI * radius * radius * radius - slot;
}

int main(int argc, char **argv)
{
    int revolutions = 1;
    const struct cli_option own = {.name = "revolutions", .type = CLI_INT, .destination = &revolutions, .value = "R",
                                   .help = "turns, of 628 steps each", .minimum = 1, .maximum = 1000};
    struct benchmark_options options;
    const int status = benchmark_parse(&options, "zalesak", "A ball with a slot in rigid rotation.", &own, argc, argv);
    if (status != CLI_GO_ON) {
        return status;
    }
    const float n = (float)options.common.grid;
    springls_notched_sphere body = {{0.5f * n, 0.75f * n, 0.5f * n}, 0.15f * n, 0.05f * n, 0.125f * n};
    springls_rotation_flow flow = {{0.5f * n, 0.5f * n, 0.5f * n}, {0.0f, 0.0f, 1.0f}, (float)(2.0 * PI / STEPS_PER_TURN)};
    const struct benchmark_problem problem = {
        .name = "zalesak",
        .shape = springls_implicit_notched_sphere,
        .shape_data = &body,
        .volume = notched_volume(0.15 * n, 0.05 * n, 0.125 * n),
        .velocity = springls_velocity_rotation,
        .velocity_data = &flow,
        .period = (double)STEPS_PER_TURN * revolutions,
        .steps = STEPS_PER_TURN * revolutions,
        .view = {0.25f, 0.2f, 1.0f},
        .paper_volume = "0.6 %",
        .paper_speed = "20 on 8 cores",
    };
    return benchmark_run(&options, &problem);
}
