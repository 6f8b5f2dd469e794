/* native.c - prints the hash of the state to which check.js brings its model. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* The distance of a ball, in doubles, as JavaScript has it. */
static void ball(void *user, const float *x, int count, float *out)
{
    const double *b = user;
    for (int i = 0; i < count; i++, x += 3) {
        const double dx = x[0] - b[0], dy = x[1] - b[1], dz = x[2] - b[2];
        out[i] = (float)(sqrt(dx * dx + dy * dy + dz * dz) - b[3]);
    }
}

static void drift(void *user, const float *x, int count, float time, float *v)
{
    (void)user, (void)time;
    for (int i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = 0.5f;
        v[1] = (float)(x[0] * 0.0625);
        v[2] = 0.0f;
    }
}

int main(void)
{
    double body[4] = {3, 4, 4, 2}, hole[4] = {6.5, 5, 4, 1};
    springls_desc desc = springls_default_desc();
    const springls_forces forces = {.velocity = drift};
    const springls_step_desc step = {.forces = &forces, .dt = 1, .max_displacement = 2};
    springls_context *ctx;
    for (int axis = 0; axis < 3; axis++) {
        desc.grid.size[axis] = 32;
        desc.grid.spacing[axis] = 0.25;
    }
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 1;
    if (springls_set_implicit(ctx, ball, body) != SPRINGLS_OK) return puts(springls_last_error(ctx)), 1;
    for (int i = 0; i < 3; i++)
        if (springls_step(ctx, &step) != SPRINGLS_OK) return puts(springls_last_error(ctx)), 1;
    if (springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, ball, hole) != SPRINGLS_OK) return puts(springls_last_error(ctx)), 1;
    printf("%016" PRIx64 "\n", springls_state_hash(ctx));
    springls_destroy(ctx);
    return 0;
}
