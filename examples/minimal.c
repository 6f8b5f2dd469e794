/* minimal.c - a surface moving in twenty lines: a ball of springls in a vortex that turns its top faster. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"
#include <stdio.h>

/* Evaluates a velocity field at a batch of points: places in the world in, velocities out. */
static void vortex(void *user, const float *x, int count, float time, float *v)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = -(x[1] - 32) * x[2] / 32;
        v[1] = (x[0] - 32) * x[2] / 32;
        v[2] = 0;
    }
}

int main(void)
{
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_sphere ball = {{32, 44, 32}, 12}; /* center, radius */
    springls_threads *threads = springls_threads_create(0); /* one a processor */
    springls_context *model;
    springls_measures m;

    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 64;
    desc.tasks = springls_threads_tasks(threads);
    forces.velocity = vortex;
    step.forces = &forces;
    step.dt = 0.02f;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
    springls_set_implicit(model, springls_implicit_sphere, &ball);
    for (int i = 0; i <= 100; i++) {
        if (i % 25 == 0 && springls_measure(model, &m) == SPRINGLS_OK)
            printf("time %.1f: %5d springls, volume %.0f, area %.0f\n",
                   springls_time(model), springls_count(model), m.volume, m.area);
        if (springls_step(model, &step) != SPRINGLS_OK) return puts(springls_last_error(model)), 1;
    }
    springls_destroy(model);
    springls_threads_destroy(threads);
    return 0;
}
