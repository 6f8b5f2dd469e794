/* landmarks.c - springls that keep their indices (one_to_one), and landmarks on a body that turns and stretches. */
#include "springls.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Turns about the axis through (32, 32) and stretches along it; world units, world units a unit of time. */
static void motion(void *user, const float *x, int count, float time, float *v)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = -(x[1] - 32);
        v[1] = x[0] - 32;
        v[2] = 0.2f * (x[2] - 32);
    }
}

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

int main(void)
{
    const float landmarks[] = {52, 32, 32, 32, 48, 44, 32, 32, 12}; /* three places on the ball as it was set */
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_sphere ball = {{32, 32, 32}, 20};
    springls_material_place now[3];
    springls_context *model;

    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 64;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
    ok(model, springls_set_implicit(model, springls_implicit_sphere, &ball));
    int count = springls_count(model);
    forces.velocity = motion;
    step.forces = &forces;
    step.dt = 0.05f;
    step.one_to_one = true;
    ok(model, springls_run(model, &step, 20));
    ok(model, springls_place_now(model, landmarks, 3, now));
    for (int i = 0; i < 3; i++) {
        const float *a = landmarks + 3 * i;
        float c = cosf(1), s = sinf(1), x = a[0] - 32, y = a[1] - 32;
        printf("(%g %g %g) is at (%.2f %.2f %.2f), +- %.2f; exact: (%.2f %.2f %.2f)\n", a[0], a[1], a[2], now[i].place[0],
               now[i].place[1], now[i].place[2], now[i].error, 32 + c * x - s * y, 32 + s * x + c * y, 32 + expf(0.2f) * (a[2] - 32));
    }
    printf("springls: %d before, %d after\n", count, springls_count(model));
    springls_destroy(model);
    return 0;
}
