/* opencl_small.c [LIBRARY] - a tiny model through every stage on a device: the state's hash is the scalar one. For a simulator
   that looks at every access too (tests/backend/oclgrind.sh): LIBRARY is its OpenCL, and work items of a group share a brick, as on a
   GPU. */
#include "histories.h"
#include "springls_cl.h"

enum { SMALL_SIZE = 12 };

static float small_pressure[SMALL_SIZE * SMALL_SIZE * SMALL_SIZE];

FIXTURE void small_log(void *user, int level, const char *message)
{
    (void)user;
    if (level < 3) fprintf(stderr, "%s\n", message);
}

/* A box with sharp edges in a flow, or a ball pushed by a sampled pressure whose topology is kept. */
FIXTURE uint64_t small_run(springls_backend *backend, bool paper)
{
    springls_params p = paper ? springls_paper_params() : springls_default_params();
    springls_desc desc = fixture_desc(SMALL_SIZE, &p);
    struct exact_flow flow = EXACT_DEFORMATION((float)SMALL_SIZE, 2.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc fluid = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f),
                       elastic = fixture_step(&forces, SPRINGLS_MODE_ELASTIC, 0.05f);
    springls_sphere ball = fixture_ball(5.3f, 5.4f, 5.6f, 2.6f);
    springls_box box = { { 5.4f, 5.5f, 5.6f }, { 2.2f, 2.4f, 2.0f } };
    springls_context *ctx = NULL;
    springls_mesh mesh;
    uint64_t hash = 0;
    int i, ok;
    if (paper) {
        p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        p.curvature = 0.1f;
        p.resample_period = 1;
        p.evolve_iterations = 1;
        for (i = 0; i < SMALL_SIZE * SMALL_SIZE * SMALL_SIZE; i++) small_pressure[i] = 0.01f * (float)(i % 9);
        forces.pressure_grid.data = small_pressure;
        forces.curvature_weight = 0.2f;
        fluid.stop_at_topology = true;
    }
    desc.backend = backend;
    desc.logger.log = small_log;
    ok = springls_create(&desc, &ctx) == SPRINGLS_OK
        && (paper ? springls_set_implicit(ctx, springls_implicit_sphere, &ball)
                  : springls_set_implicit(ctx, springls_implicit_box, &box))
            == SPRINGLS_OK
        && springls_step(ctx, &fluid) == SPRINGLS_OK && (paper || springls_step(ctx, &elastic) == SPRINGLS_OK)
        && springls_run_stage(ctx, SPRINGLS_STAGE_TRACK) == SPRINGLS_OK && springls_extract_mesh(ctx, &mesh) == SPRINGLS_OK;
    if (ok) {
        hash = history_mix(springls_state_hash(ctx), mesh.positions, (size_t)mesh.vertex_count * 3 * sizeof(float));
        springls_mesh_free(ctx, &mesh);
    }
    springls_destroy(ctx);
    return hash;
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    springls_cl_desc desc = fixture_device_desc();
    springls_backend *backend;
    int paper, wrong = 0;
    desc.library = argc > 1 ? argv[1] : NULL;
    if (desc.library) desc.brick_items = 4; /* else the device's own, whose kernels other tests have compiled */
    desc.logger.log = small_log;
    if (springls_cl_create(&desc, &backend) != SPRINGLS_OK) {
        if (!desc.library) fixture_no_device("there is no OpenCL device");
        return EXIT_FAILURE;
    }
    printf("%s\n", springls_cl_name(backend));
    for (paper = 0; paper < 2; paper++) {
        uint64_t hash = small_run(backend, paper), scalar = small_run(NULL, paper);
        printf("%s: %016llx, scalar %016llx\n", paper ? "paper" : "default", (unsigned long long)hash, (unsigned long long)scalar);
        wrong += hash == 0 || hash != scalar;
    }
    springls_cl_destroy(backend);
    printf("Pass: %d, fail: %d, skip: 0.\n", 2 - wrong, wrong);
    return wrong ? EXIT_FAILURE : EXIT_SUCCESS;
}
