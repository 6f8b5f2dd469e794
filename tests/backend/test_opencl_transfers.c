/* test_opencl_transfers.c - host and device exchange only what is needed, and once. Skipped where there is no OpenCL device that
   rounds as C does. */
#include "springls_under_test.h"
#include "scenarios.h"

/* A query downloads nothing that an earlier one has downloaded, until the model changes, and uploads nothing. */
TEST questions_fetch_once(void)
{
    springls_cl_counts before, after;
    springls_context *ctx;
    springls_hit first[8], second[8];
    float points[3 * 8];
    int i;
    scenario s;
    NEEDS_DEVICE();
    for (i = 0; i < 3 * 8; i++) points[i] = 2.0f * (float)(i % 13);
    scenario_make(&s, SCENARIO_THIN);
    ctx = scenario_context(&s, test_device);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &s.step));
    before = springls_cl_get_counts(test_device);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 8, first));
    after = springls_cl_get_counts(test_device);
    ASSERT_GT(after.downloads, before.downloads);
    ASSERT(after.uploads == before.uploads);
    before = after;
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 8, second));
    ASSERT_MEM_EQ(first, second, sizeof first);
    ASSERT(springls_state_hash(ctx) != 0);
    after = springls_cl_get_counts(test_device);
    ASSERT(after.downloads == before.downloads);
    ASSERT(after.kernels == before.kernels);
    springls_destroy(ctx);
    PASS();
}

/* Advect waits for the device once: one reading finds the largest displacement and how many springls move. */
TEST advect_reads_once(void)
{
    struct exact_flow flow = EXACT_DEFORMATION(32.0f, 1.5f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_cl_counts before, after;
    springls_context *ctx;
    scenario s;
    NEEDS_DEVICE();
    scenario_make(&s, SCENARIO_THIN);
    ctx = scenario_context(&s, test_device);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_advect(ctx, &forces, 0.3f, 0.01f));
    before = springls_cl_get_counts(test_device);
    ASSERT_OK(springls_advect(ctx, &forces, 0.31f, 0.01f));
    after = springls_cl_get_counts(test_device);
    ASSERT_EQ(1, (int)(after.downloads - before.downloads));
    springls_destroy(ctx);
    PASS();
}

/* Steps wait for the device a few times each: what several stages count is read together. */
TEST steps_read_little(void)
{
    enum { LAZY, WHOLE, RESAMPLING, KINDS, FIRST = 16 }; /* before FIRST half of the springls merge, in many rounds */
    /* a whole step has 51 to 58 kernels, and 5 more where it lists springls larger than a cell */
    static const struct { int downloads, kernels; } most[KINDS] = { { 1, 5 }, { 4, 63 }, { 17, 190 } };
    springls_context *ctx;
    int i, seen[KINDS] = { 0, 0, 0 };
    scenario s;
    NEEDS_DEVICE();
    scenario_make(&s, SCENARIO_ELASTIC);
    s.step.mode = SPRINGLS_MODE_FLUID;
    ctx = scenario_context(&s, test_device);
    ASSERT(ctx != NULL);
    for (i = 0; i < 48; i++) {
        springls_cl_counts before = springls_cl_get_counts(test_device), after;
        int kind;
        s.step.dt = i % 2 ? 0.001f : 0.04f;
        ASSERT_OK(springls_step(ctx, &s.step));
        after = springls_cl_get_counts(test_device);
        kind = springls__phi_lags(ctx) ? LAZY : ctx->step.resamples ? RESAMPLING : WHOLE;
        if (i < FIRST) continue;
        ASSERT_LTE((int)(after.downloads - before.downloads), most[kind].downloads);
        ASSERT_LTE((int)(after.kernels - before.kernels), most[kind].kernels);
        seen[kind]++;
    }
    for (i = 0; i < KINDS; i++) ASSERT_GT(seen[i], 1);
    springls_destroy(ctx);
    PASS();
}

/* A write sends its range to the device and nothing more, and fetches nothing. */
TEST writes_send_their_range(void)
{
    springls_cl_counts before, after;
    springls_context *ctx;
    float vertices[9 * 10], particles[3 * 10];
    int i, m;
    scenario s;
    NEEDS_DEVICE();
    scenario_make(&s, SCENARIO_THIN);
    ctx = scenario_context(&s, test_device);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &s.step));
    for (i = 0; i < 10; i++) {
        springls__v3 p = fixture_particle(ctx, 20 + i);
        memcpy(particles + 3 * i, &p, sizeof p);
        for (m = 0; m < 3; m++) {
            springls__v3 q = fixture_vertex(ctx, 20 + i, m);
            memcpy(vertices + 9 * i + 3 * m, &q, sizeof q);
        }
        particles[3 * i] += 0.5f;
    }
    before = springls_cl_get_counts(test_device);
    ASSERT_OK(springls_write(ctx, 20, 10, vertices, particles));
    after = springls_cl_get_counts(test_device);
    ASSERT_EQ(sizeof vertices + sizeof particles, after.bytes_up - before.bytes_up);
    ASSERT_EQ(0u, after.bytes_down - before.bytes_down);
    for (i = 0; i < 10; i++) ASSERT_EQ(particles[3 * i], fixture_particle(ctx, 20 + i).x);
    springls_destroy(ctx);
    PASS();
}

/* The buffer that an engine draws from has what a view shows. */
TEST the_device_hands_out_its_springls(void)
{
    springls_context *ctx;
    springls__springl *there;
    springls__cl *cl;
    springls_view view;
    void *memory;
    scenario s;
    size_t bytes, offset = 0;
    int i, k;
    NEEDS_DEVICE();
    ASSERT(springls_cl_springl_buffer(NULL, &offset) == NULL);
    scenario_make(&s, SCENARIO_THIN);
    ctx = scenario_context(&s, test_device);
    ASSERT(ctx != NULL);
    ASSERT_OK(springls_step(ctx, &s.step));
    ASSERT(springls_cl_springl_buffer(ctx, NULL) == NULL);
    memory = springls_cl_springl_buffer(ctx, &offset);
    ASSERT(memory != NULL);
    ASSERT_EQ(0, offset % 512);
    bytes = (size_t)springls_count(ctx) * sizeof *there;
    there = (springls__springl *)malloc(bytes);
    ASSERT(there != NULL);
    cl = (springls__cl *)(void *)test_device;
    ASSERT_EQ(CL_SUCCESS, cl->EnqueueReadBuffer(cl->queue, (cl_mem)memory, CL_TRUE, offset, bytes, there, 0, NULL, NULL));
    view = springls_view_vertices(ctx);
    for (i = 0; i < view.count; i++)
        for (k = 0; k < 9; k++)
            ASSERT_EQ(((const float *)(const void *)((const char *)view.data + (size_t)i * view.stride))[k], (&there[i].q[0].x)[k]);
    free(there);
    springls_reset(ctx);
    ASSERT(springls_cl_springl_buffer(ctx, &offset) == NULL);
    springls_destroy(ctx);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    scenarios_begin();
    RUN_TEST(questions_fetch_once);
    RUN_TEST(advect_reads_once);
    RUN_TEST(steps_read_little);
    RUN_TEST(writes_send_their_range);
    RUN_TEST(the_device_hands_out_its_springls);
    springls_cl_destroy(test_device);
    GREATEST_MAIN_END();
}
