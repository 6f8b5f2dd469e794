/* scan.c - a contour on a scan whose slices are three times as far apart as its pixels: the volume of a ball of 12 mm. */
#include "springls.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { NX = 48, NY = 48, NZ = 16 };

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

int main(void)
{
    static float intensity[NZ][NY][NX], rho[NZ][NY][NX];
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_sphere seed = {{23, 24, 23}, 6}; /* mm */
    springls_context *model;
    springls_measures m;

    for (int z = 0; z < NZ; z++)
        for (int y = 0; y < NY; y++)
            for (int x = 0; x < NX; x++) {
                float distance = sqrtf((float)((x - 24) * (x - 24) + (y - 24) * (y - 24) + 9 * (z - 8) * (z - 8))) - 12;
                intensity[z][y][x] = 100 - 80 * fminf(fmaxf(distance / 3, -1), 1); /* 180 inside, 100 at the border */
                rho[z][y][x] = (intensity[z][y][x] - 100) / 80;                    /* grows where it is bright */
            }
    /* millimetres; origin and direction as in the file's header */
    desc.grid = (springls_grid_desc){.size = {NX, NY, NZ}, .spacing = {1, 1, 3}};
    if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
    ok(model, springls_set_implicit(model, springls_implicit_sphere, &seed));
    forces.pressure_grid.data = &rho[0][0][0];
    forces.curvature_weight = 0.02f;
    step.forces = &forces;
    step.dt = 0.5f;
    step.stop_at_rest = true;
    ok(model, springls_run(model, &step, 200));
    ok(model, springls_measure(model, &m));
    printf("from a seed: %.2f ml, %.1f x %.1f x %.1f mm\n", m.volume / 1000, m.upper[0] - m.lower[0], m.upper[1] - m.lower[1],
           m.upper[2] - m.lower[2]);
    ok(model, springls_set_threshold(model, &intensity[0][0][0], 100, INFINITY)); /* without a contour */
    ok(model, springls_measure(model, &m));
    printf("threshold:   %.2f ml; the ball has 7.24 ml\n", m.volume / 1000);
    springls_destroy(model);
    return 0;
}
