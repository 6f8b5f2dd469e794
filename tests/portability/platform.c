/* platform.c - one small program for every platform: prints the hashes of two models that have moved, which must be the same
   everywhere. It is one file with the library, compiled with no flag that the library's users would not give. */
#define SPRINGLS_IMPLEMENTATION
#include "../../springls.h"
#include <stdio.h>

/* Turns and stretches space. No product is added to anything, so that a compiler has nothing to fuse here. */
static void stretch(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = (16.0f - x[1]) * (0.5f + time);
        v[1] = x[0] - 16.0f;
        v[2] = (x[2] - 16.0f) * 0.25f;
    }
}

/* Prints the hash of a ball after some steps in a flow; returns what the process shall. */
static int run(const char *name, springls_params params, springls_velocity_fn flow, void *user)
{
    springls_desc desc;
    springls_step_desc step;
    springls_forces forces;
    springls_sphere ball = { { 16, 18, 15 }, 7 };
    springls_context *model;
    springls_status status;
    uint64_t hash;
    int i;
    memset(&desc, 0, sizeof desc);
    memset(&step, 0, sizeof step);
    memset(&forces, 0, sizeof forces);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 32;
    desc.params = &params;
    forces.velocity = flow;
    forces.user = user;
    step.forces = &forces;
    step.dt = 0.05f;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return 1;
    status = springls_set_implicit(model, springls_implicit_sphere, &ball);
    for (i = 0; i < 12 && status == SPRINGLS_OK; i++) status = springls_step(model, &step);
    hash = springls_state_hash(model);
    if (status != SPRINGLS_OK) puts(springls_last_error(model));
    else printf("%08lx%08lx %s\n", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xffffffffu), name);
    springls_destroy(model);
    return status != SPRINGLS_OK;
}

int main(void)
{
    springls_deformation_flow leveque = { 32, 2 };
    int failed = run("default, the library's flow", springls_default_params(), springls_velocity_deformation, &leveque);
    failed |= run("default, a callback", springls_default_params(), stretch, NULL);
    failed |= run("paper, a callback", springls_paper_params(), stretch, NULL);
    if (!springls_fp_contract_detected()) return failed;
    puts("this build fuses, or keeps more digits than a float has");
    return 1;
}
