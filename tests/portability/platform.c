/* platform.c - one small program for every platform: prints the hashes of models that have moved, and of the bytes of their
   snapshots, which must be the same everywhere; so what one platform writes, every other reads. It is one file with the library,
   compiled with no flag that the library's users would not give. */
#define SPRINGLS_IMPLEMENTATION
#include "../../springls.h"
#include "../../examples/common/springls/exact_flows.h"
#include <stdio.h>
#include "flush.h"

/* Turns and stretches space. Every sum and product is stored, so that a compiler has nothing to fuse here and rounds to float. */
static void stretch(void *user, const float *x, int count, float time, float *v)
{
    const float speed = 0.5f + time;
    int i;
    (void)user;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        const float y = 12.0f - x[1], z = x[2] - 12.0f;
        v[0] = y * speed;
        v[1] = x[0] - 12.0f;
        v[2] = z * 0.25f;
    }
}

static void print_hash(uint64_t hash, const char *name, const char *what)
{
    printf("%08lx%08lx %s%s\n", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xffffffffu), name, what);
}

/* Prints the hash of a snapshot's bytes; steps once from it, and twice more after it has been restored. */
static springls_status back_and_forth(springls_context *model, const springls_step_desc *step, const char *name)
{
    size_t size = 0, i;
    springls_status status = springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
    unsigned char *block = (unsigned char *)malloc(size + 1);
    uint64_t hash = 14695981039346656037u;
    if (!block) return SPRINGLS_OUT_OF_MEMORY;
    if (status == SPRINGLS_OK) status = springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size);
    for (i = 0; i < size; i++) hash = (hash ^ block[i]) * 1099511628211u;
    if (status == SPRINGLS_OK) status = springls_step(model, step);
    if (status == SPRINGLS_OK) status = springls_restore(model, block, size);
    free(block);
    print_hash(hash, name, ", bytes of a snapshot");
    for (i = 0; i < 2 && status == SPRINGLS_OK; i++) status = springls_step(model, step);
    return status;
}

/* Prints the hash of a ball after some steps in a flow; returns what the process shall. */
static int run(const char *name, springls_params params, springls_velocity_fn flow, void *user)
{
    springls_desc desc;
    springls_step_desc step;
    springls_forces forces;
    springls_sphere ball = { { 12, 13.5f, 11 }, 5.5f };
    springls_context *model;
    springls_status status;
    int i;
    memset(&desc, 0, sizeof desc);
    memset(&step, 0, sizeof step);
    memset(&forces, 0, sizeof forces);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 24;
    desc.params = &params;
    forces.velocity = flow;
    forces.user = user;
    step.forces = &forces;
    step.dt = 0.05f;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return 1;
    status = springls_set_implicit(model, springls_implicit_sphere, &ball);
    for (i = 0; i < 8 && status == SPRINGLS_OK; i++) status = springls_step(model, &step);
    if (status == SPRINGLS_OK) status = back_and_forth(model, &step, name);
    if (status != SPRINGLS_OK) puts(springls_last_error(model));
    else print_hash(springls_state_hash(model), name, "");
    springls_destroy(model);
    return status != SPRINGLS_OK;
}

int main(void)
{
    struct exact_flow leveque = EXACT_DEFORMATION(24, 2);
    int failed;
#ifdef FLUSH_DENORMALS
    if (!flush_denormals(true) || !denormals_are_flushed()) return puts("denormal numbers are not flushed here"), 1;
#else
    (void)flush_denormals;
    (void)denormals_are_flushed;
#endif
    failed = run("default, LeVeque's flow", springls_default_params(), exact_flow_velocity, &leveque);
    failed |= run("default, a callback", springls_default_params(), stretch, NULL);
    failed |= run("paper, a callback", springls_paper_params(), stretch, NULL);
    if (!springls_fp_contract_detected()) return failed;
    puts("this build fuses, or keeps more digits than a float has");
    return 1;
}
