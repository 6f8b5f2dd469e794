/* minimal.c - the whole library in one page: a ball is stirred by a flow and comes back.
 *
 *   cc -O2 -I. examples/minimal.c -o minimal -lm */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"
#include <stdio.h>

int main(void)
{
    springls_desc desc = {.grid.size = {48, 48, 48}};
    springls_context *model;
    if (springls_create(&desc, &model) != SPRINGLS_OK) {
        return 1;
    }
    springls_sphere ball = {{17, 17, 17}, 7};
    springls_deformation_flow flow = {.grid_size = 48, .period = 1};
    springls_forces forces = {.velocity = springls_velocity_deformation, .user = &flow};
    springls_step_desc step = {.forces = &forces, .dt = 1.0f / 60};
    springls_measures before, after;

    springls_status status = springls_set_implicit(model, springls_implicit_sphere, &ball);
    if (!status) status = springls_measure(model, &before);
    int count = springls_count(model);
    if (!status) status = springls_run(model, &step, 60);
    if (!status) status = springls_measure(model, &after);

    if (status) {
        fprintf(stderr, "minimal: %s\n", springls_last_error(model));
    } else {
        printf("before: %d springls around %.1f voxels\n", count, before.volume);
        printf("after:  %d springls around %.1f voxels\n", springls_count(model), after.volume);
    }
    springls_destroy(model);
    return status ? 1 : 0;
}
