/* leveque.c - LeVeque's deformation: a ball is drawn out into thin sheets, and the flow, reversed at half time, brings it
 * back (section 5.2 and Table 3 of the paper). */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include "common/benchmark.h"

int main(int argc, char **argv)
{
    double period = 2.5;
    const struct cli_option own = {.name = "period", .type = CLI_DOUBLE, .destination = &period, .value = "T",
                                   .help = "period of the flow", .minimum = 0.01, .maximum = 100.0};
    struct benchmark_options options;
    const int status = benchmark_parse(&options, "leveque", "A ball in LeVeque's deformation flow, there and back.",
                                       &own, argc, argv);
    if (status != CLI_GO_ON) {
        return status;
    }
    const float n = (float)options.common.grid;
    springls_sphere ball = {{0.35f * n, 0.35f * n, 0.35f * n}, 0.15f * n};
    springls_deformation_flow flow = {n, (float)period};
    const double radius = 0.15 * n;
    const struct benchmark_problem problem = {
        .name = "leveque",
        .shape = springls_implicit_sphere,
        .shape_data = &ball,
        .volume = 4.0 / 3.0 * 3.14159265358979 * radius * radius * radius,
        .velocity = springls_velocity_deformation,
        .velocity_data = &flow,
        .period = period,
        .steps = (int)(period * n / 0.64 + 0.5),
        .view = {0.5f, 0.45f, 1.0f},
        .paper_deformation = "0.38 +- 0.28",
        .paper_tracking = "0.93 +- 1.07",
    };
    return benchmark_run(&options, &problem);
}
