/* brush.c - a brush that pulls a surface out, and undo: the strokes run in a box, a snapshot is taken before each. */
#include "springls.h"
#include <stdio.h>
#include <stdlib.h>

typedef struct brush { float center[3], radius, speed; } brush;

/* Pulls along the normal, fading out towards the brush's border; world units. */
static void pull(void *user, const float *x, const float *normals, int count, float time, float *out)
{
    const brush *b = user;
    (void)normals, (void)time;
    for (int i = 0; i < count; i++, x += 3) {
        float dx = x[0] - b->center[0], dy = x[1] - b->center[1], dz = x[2] - b->center[2];
        float fade = 1 - (dx * dx + dy * dy + dz * dz) / (b->radius * b->radius);
        out[i] = fade > 0 ? b->speed * fade : 0;
    }
}

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

static void stroke(springls_context *model, brush *b)
{
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    forces.pressure = pull;
    forces.user = b;
    for (int k = 0; k < 3; k++) {
        forces.region_lower[k] = b->center[k] - b->radius;
        forces.region_upper[k] = b->center[k] + b->radius;
    }
    step.forces = &forces;
    step.dt = 0.1f;
    for (int i = 0; i < 10; i++) ok(model, springls_step(model, &step));
}

static double top_of(springls_context *model)
{
    springls_measures m;
    ok(model, springls_measure(model, &m));
    return m.upper[1];
}

int main(void)
{
    springls_desc desc = springls_default_desc();
    springls_sphere ball = {{0.32f, 0.32f, 0.32f}, 0.2f};
    brush b = {{0.32f, 0.52f, 0.32f}, 0.08f, 0.05f};
    springls_context *model;
    size_t size;

    for (int k = 0; k < 3; k++) desc.grid.size[k] = 64, desc.grid.spacing[k] = 0.01;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
    ok(model, springls_set_implicit(model, springls_implicit_sphere, &ball));
    ok(model, springls_settle(model, 100));

    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_FRAME, NULL, 0, &size));
    void *undo = malloc(size);
    if (!undo) return 1;
    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_FRAME, undo, size, &size));
    printf("before the stroke: top %.3f\n", top_of(model));
    stroke(model, &b);
    printf("after it:          top %.3f\n", top_of(model));
    ok(model, springls_restore(model, undo, size));
    printf("undone:            top %.3f\n", top_of(model));
    free(undo);
    springls_destroy(model);
    return 0;
}
