/* turns GRID TURNS paper|default THREADS - Zalesak's notched sphere turned TURNS times, 628 steps a turn, measured after
 * every turn (paper, Fig. 14): arrays of errors in voxels and of volume changes. One JSON object on stdout. */
#include "springls.h"

#include "examples/common/base/json.h"
#include "examples/common/base/progress.h"
#include "examples/common/springls/exact_flows.h"
#include "examples/common/springls/run_options.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 628, MAX_TURNS = 100 };

struct turns {
    double deformation[MAX_TURNS], tracking[MAX_TURNS], volume_change[MAX_TURNS];
};

static void measure(springls_context *ctx, springls_notched_sphere *body, double start_volume, struct turns *turns, int turn)
{
    const springls_view p = springls_view_particles(ctx), a = springls_view_correspondences(ctx);
    springls_measures now;
    double deformation = 0.0, tracking = 0.0;
    for (int i = 0; i < p.count; ++i) {
        const float *at = (const float *)(const void *)((const char *)p.data + (size_t)i * p.stride);
        const float *from = (const float *)(const void *)((const char *)a.data + (size_t)i * a.stride);
        float d;
        springls_implicit_notched_sphere(body, at, 1, &d);
        deformation += fabs((double)d);
        tracking += sqrt(pow((double)(at[0] - from[0]), 2.0) + pow((double)(at[1] - from[1]), 2.0)
                         + pow((double)(at[2] - from[2]), 2.0));
    }
    turns->deformation[turn] = deformation / p.count;
    turns->tracking[turn] = tracking / p.count;
    turns->volume_change[turn] = NAN;
    if (springls_measure(ctx, &now) == SPRINGLS_OK) {
        turns->volume_change[turn] = 100.0 * (now.volume / start_volume - 1.0);
    }
}

int main(int argc, char **argv)
{
    const int grid = argc == 5 ? atoi(argv[1]) : 0, count = argc == 5 ? atoi(argv[2]) : 0;
    const float n = (float)grid;
    const springls_params params = argc == 5 && strcmp(argv[3], "paper") == 0 ? springls_paper_params() : springls_default_params();
    springls_notched_sphere body = {{0.5f * n, 0.75f * n, 0.5f * n}, 0.15f * n, 0.05f * n, 0.125f * n};
    struct exact_flow flow = EXACT_ROTATION(0.5f * n, 0.5f * n, 0.5f * n, 0.0f, 0.0f, 1.0f, (float)(2.0 * 3.14159265358979 / STEPS));
    springls_desc desc;
    springls_forces forces;
    springls_step_desc step;
    springls_measures start;
    springls_context *ctx;
    struct json_writer json;
    static struct turns turns;
    if (grid < 8 || count < 1 || count > MAX_TURNS) {
        fprintf(stderr, "usage: turns GRID TURNS paper|default THREADS\n");
        return 2;
    }
    run_start_threads(atoi(argv[4]));
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = grid;
    desc.params = &params;
    desc.tasks = run_tasks();
    memset(&forces, 0, sizeof forces);
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    memset(&step, 0, sizeof step);
    step.forces = &forces;
    step.dt = 1.0f;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "turns: cannot create the model\n");
        return 1;
    }
    const double before = elapsed_seconds();
    springls_status status = springls_set_implicit(ctx, springls_implicit_notched_sphere, &body);
    status = status == SPRINGLS_OK ? springls_measure(ctx, &start) : status;
    for (int k = 0; k < count * STEPS && status == SPRINGLS_OK; ++k) {
        status = springls_step(ctx, &step);
        if (status == SPRINGLS_OK && (k + 1) % STEPS == 0) {
            measure(ctx, &body, start.volume, &turns, k / STEPS);
        }
    }
    if (status != SPRINGLS_OK) {
        fprintf(stderr, "turns: %s\n", springls_last_error(ctx));
        return 1;
    }
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "zalesak");
    json_integer(&json, "grid", grid);
    json_string(&json, "params", argv[3]);
    json_integer(&json, "turns", count);
    json_numbers(&json, "deformation_mean", turns.deformation, (size_t)count);
    json_numbers(&json, "tracking_mean", turns.tracking, (size_t)count);
    json_numbers(&json, "volume_change_percent", turns.volume_change, (size_t)count);
    json_number(&json, "seconds_total", elapsed_seconds() - before);
    springls_destroy(ctx);
    return json_close(&json) ? 0 : 1;
}
