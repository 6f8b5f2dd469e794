/* test_allocation.c - memory that runs out, at every allocation in turn: the call fails with that status, later calls survive, the
   context can be used again and gives back every byte. */
#include "every_call.h"

enum { INPUTS, MESHES, RAW_SPRINGLS, FLUID, FLUID_PAPER, ELASTIC, STAGES, FRAMES, READING, SCENARIOS };
enum { SIZE = 14, VOXELS = SIZE * SIZE * SIZE };

/* One sphere as every kind of input. */
typedef struct props {
    springls_sphere ball;
    springls_mesh mesh;
    float *vertices; /* of its triangles, as springls */
    float phi[VOXELS], copy[VOXELS];
    int32_t labels[VOXELS];
} props;

static springls_context *make_props(props *p)
{
    springls_context *ctx;
    int i, k;
    memset(p, 0, sizeof *p);
    p->ball = fixture_ball(6.5f, 6.5f, 6.5f, 2.6f);
    ctx = fixture_context(SIZE, NULL);
    springls_set_implicit(ctx, springls_implicit_sphere, &p->ball);
    springls_extract_mesh(ctx, &p->mesh);
    p->vertices = (float *)malloc((size_t)p->mesh.triangle_count * 9 * sizeof *p->vertices);
    for (i = 0; i < 3 * p->mesh.triangle_count; i++)
        for (k = 0; k < 3; k++) p->vertices[3 * i + k] = p->mesh.positions[3 * p->mesh.triangles[i] + k];
    for (i = 0; i < VOXELS; i++) {
        d3 x = d3_make(i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE));
        p->phi[i] = (float)(d3_distance(x, d3_make(6.5, 6.5, 6.5)) - 2.6);
        p->labels[i] = p->phi[i] < 0.0f ? 2 : 0;
    }
    return ctx;
}

static void free_props(springls_context *ctx, props *p)
{
    free(p->vertices);
    springls_mesh_free(ctx, &p->mesh);
    springls_destroy(ctx);
}

/* How the calls of a scenario ended: in success, for want of memory, without a model after that, or otherwise. */
typedef struct outcome { int calls, starved, empty, wrong; } outcome;

static void count(outcome *o, const springls_context *ctx, springls_status status)
{
    o->calls++;
    o->starved += status == SPRINGLS_OUT_OF_MEMORY && strlen(springls_last_error(ctx)) > 0;
    o->empty += status == SPRINGLS_EMPTY_MODEL;
    o->wrong += status != SPRINGLS_OK && status != SPRINGLS_OUT_OF_MEMORY && status != SPRINGLS_EMPTY_MODEL;
}

static void read_all(springls_context *ctx, props *p, outcome *o)
{
    springls_mesh mesh;
    springls_measures measures;
    springls_hit hits[4];
    float points[12], out[12], *all = (float *)malloc((size_t)(springls_count(ctx) + 500) * 16 * sizeof *all);
    uint8_t inside[4];
    int i;
    for (i = 0; i < 12; i++) points[i] = (float)(1 + i);
    count(o, ctx, springls_extract_mesh(ctx, &mesh));
    springls_mesh_free(ctx, &mesh);
    count(o, ctx, springls_extract_soup(ctx, &mesh));
    springls_mesh_free(ctx, &mesh);
    count(o, ctx, springls_measure(ctx, &measures));
    count(o, ctx, springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 4, hits));
    count(o, ctx, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, points, 4, 0.0f, hits));
    count(o, ctx, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, points, 4, hits));
    count(o, ctx, springls_sample_distance(ctx, points, 4, out));
    count(o, ctx, springls_sample_gradient(ctx, points, 4, out));
    count(o, ctx, springls_sample_inside(ctx, points, 4, inside));
    count(o, ctx, springls_copy_level_set(ctx, p->copy));
    count(o, ctx, springls_pack_matrix(ctx, all));
    count(o, ctx, springls_extract_surfels(ctx, all));
    free(all);
}

/* Steps in parts, what has changed after each, back to the start and on again. */
static void frames(springls_context *ctx, const springls_step_desc *step, outcome *o)
{
    springls_chunks_desc desc = { .correspondences = true };
    springls_chunks *chunks;
    const springls_chunk *changed;
    char *block = NULL;
    size_t size;
    int i, number;
    count(o, ctx, springls_chunks_create(ctx, &desc, &chunks));
    count(o, ctx, springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = (char *)malloc(size);
    count(o, ctx, springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    for (i = 0; i < 3; i++) {
        bool done = false;
        springls_status status = springls_step_begin(ctx, step);
        while (status == SPRINGLS_OK && !done) status = springls_step_continue(ctx, 0.0, &done);
        count(o, ctx, status);
        if (chunks) count(o, ctx, springls_chunks_update(ctx, chunks, &changed, &number));
    }
    count(o, ctx, springls_restore(ctx, block, size));
    count(o, ctx, springls_step(ctx, step));
    springls_chunks_destroy(ctx, chunks);
    free(block);
}

static void run(springls_context *ctx, int scenario, props *p, outcome *o)
{
    float wind[3] = { 0.5f, 0.2f, 0.0f }, speed;
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, scenario == ELASTIC ? SPRINGLS_MODE_ELASTIC : SPRINGLS_MODE_FLUID, 0.6f);
    springls_step_desc follow = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.0f);
    springls_params params = scenario == FLUID_PAPER ? springls_paper_params() : springls_default_params();
    int i, half = p->mesh.triangle_count / 2;
    params.resample_period = 2;
    params.split_edge = 1.2f;
    if (scenario == FRAMES || scenario == READING) params.keep_edges = 0; /* the other scenarios have it, and it takes its time */
    count(o, ctx, springls_set_params(ctx, &params));
    switch (scenario) {
    case INPUTS:
        count(o, ctx, springls_set_level_set(ctx, p->phi));
        count(o, ctx, springls_set_labels(ctx, p->labels, 2));
        count(o, ctx, springls_set_threshold(ctx, p->phi, -100.0f, -1.0f));
        count(o, ctx, springls_set_implicit(ctx, springls_implicit_sphere, &p->ball));
        count(o, ctx, springls_set_reference(ctx));
        break;
    case MESHES: /* closed, and open */
        count(o, ctx,
              springls_set_mesh(ctx, p->mesh.positions, p->mesh.vertex_count, 0, p->mesh.triangles, p->mesh.triangle_count, NULL));
        count(o, ctx, springls_set_mesh(ctx, p->mesh.positions, p->mesh.vertex_count, 0, p->mesh.triangles, half, NULL));
        break;
    case RAW_SPRINGLS:
        count(o, ctx, springls_set_springls(ctx, p->vertices, NULL, p->vertices, half));
        count(o, ctx, springls_set_springls(ctx, p->vertices, NULL, NULL, 2 * half));
        count(o, ctx, springls_set_reference_mesh(ctx, p->mesh.positions, p->mesh.vertex_count, 0, p->mesh.triangles, half,
                                                  NULL));
        break;
    case FLUID:
    case FLUID_PAPER:
    case ELASTIC:
        count(o, ctx, springls_set_implicit(ctx, springls_implicit_sphere, &p->ball));
        forces.pressure_grid.data = p->phi; /* positive outside: the model grows, and its buffers with it */
        forces.pressure_weight = 2.0f;
        for (i = 0; i < 3; i++) count(o, ctx, springls_step(ctx, &step));
        break;
    case STAGES:
        count(o, ctx, springls_set_implicit(ctx, springls_implicit_sphere, &p->ball));
        count(o, ctx, springls_max_speed(ctx, &forces, 0.0f, &speed));
        count(o, ctx, springls_advect(ctx, &forces, 0.0f, 2.0f));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
        count(o, ctx, springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
        if (springls_count(ctx) > 0) count(o, ctx, springls_write(ctx, 0, 1, p->vertices, NULL));
        count(o, ctx, springls_step(ctx, &follow));
        break;
    case FRAMES:
        count(o, ctx, springls_set_implicit(ctx, springls_implicit_sphere, &p->ball));
        frames(ctx, &step, o);
        break;
    default:
        count(o, ctx, springls_set_implicit(ctx, springls_implicit_sphere, &p->ball));
        read_all(ctx, p, o);
    }
}

/* One allocation fails, or it and all later ones; the scenario goes on to its end nevertheless. */
static greatest_test_res starve(int scenario, props *p, int fail_at, int fail_on)
{
    fixture_heap heap;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_params plain;
    springls_context *ctx;
    outcome o;
    springls_status status;
    memset(&o, 0, sizeof o);
    desc.allocator = fixture_allocator(&heap);
    heap.fail_at = fail_at;
    heap.fail_on = fail_on;
    status = springls_create(&desc, &ctx);
    if (status != SPRINGLS_OK) {
        ASSERT_EQ(SPRINGLS_OUT_OF_MEMORY, status);
        ASSERT_EQ(NULL, ctx);
        ASSERT_EQ(0, heap.blocks);
        PASS();
    }
    run(ctx, scenario, p, &o);
    ASSERT_GT(o.starved, 0);
    if (!fail_on) ASSERT_EQ(1, o.starved);
    ASSERT_EQ(0, o.wrong);
    ASSERT_EQ(heap.bytes, springls_memory_used(ctx));
    heap.fail_at = -1; /* memory is back: the context serves again */
    plain = springls_get_params(ctx);
    plain.keep_edges = 0;
    ASSERT_OK(springls_set_params(ctx, &plain));
    ASSERT_OK(springls_set_level_set(ctx, p->phi));
    ASSERT_GT(springls_count(ctx), 30);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0u, heap.bytes);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

TEST every_allocation_may_fail(int scenario, int fail_on)
{
    static props p;
    springls_context *owner = make_props(&p), *ctx;
    fixture_heap heap;
    springls_desc desc = fixture_desc(SIZE, NULL);
    outcome o;
    int k, allocations;
    memset(&o, 0, sizeof o);
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    run(ctx, scenario, &p, &o);
    ASSERT_EQ(0, o.starved + o.empty + o.wrong);
    allocations = heap.calls;
    ASSERT_GT(allocations, 20);
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    for (k = 0; k < allocations; k += fail_on ? 3 : 1) CHECK_CALL(starve(scenario, &p, k, fail_on));
    free_props(owner, &p);
    PASS();
}

/* An input that runs out of memory leaves an empty model, not half of one. */
TEST inputs_leave_all_or_nothing(void)
{
    static props p;
    springls_context *owner = make_props(&p), *ctx;
    fixture_heap heap;
    springls_desc desc = fixture_desc(SIZE, NULL);
    int k, failed = 0;
    for (k = 0; k < 60; k++) {
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        heap.fail_at = heap.calls + k;
        if (springls_set_mesh(ctx, p.mesh.positions, p.mesh.vertex_count, 0, p.mesh.triangles, p.mesh.triangle_count, NULL)
            == SPRINGLS_OK) {
            ASSERT_EQ(p.mesh.triangle_count, springls_count(ctx));
        } else {
            springls_measures measures;
            failed++;
            ASSERT_EQ(0, springls_count(ctx));
            heap.fail_at = -1;
            ASSERT_OK(springls_measure(ctx, &measures));
            ASSERT_EQ(0, measures.components);
        }
        springls_destroy(ctx);
    }
    ASSERT_GT(failed, 10);
    free_props(owner, &p);
    PASS();
}

/* ---- each public call by itself, in each state of a model ---- */

static size_t held(const call_bench *b) { return springls_memory_used(b->ctx) + springls_memory_used(b->other); }

/* Calls with allocation number fail_at of the call failing, counted from 0; -1: none does. *failed: one did. */
static greatest_test_res starve_call(const call_row *call, int state, call_bench *b, int fail_at, springls_status *expected,
                                     int *failed)
{
    fixture_heap heap;
    springls_status status;
    uint64_t before, after;
    b->desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(call_begin(b, state));
    before = springls_state_hash(b->ctx);
    if (fail_at >= 0) heap.fail_at = heap.calls + fail_at;
    status = call->run(b);
    *failed = fail_at >= 0 && heap.calls > heap.fail_at;
    heap.fail_at = -1;
    if (fail_at < 0) *expected = status;
    ASSERT(status == *expected || (*failed && status == SPRINGLS_OUT_OF_MEMORY));
    if (status == SPRINGLS_OUT_OF_MEMORY && call->run != call_create) ASSERT_GT(strlen(springls_last_error(b->ctx)), 0u);
    ASSERT_EQ(heap.bytes, held(b));
    after = springls_state_hash(b->ctx);
    if (call->reads && state != CALL_STATE_IN_STEP && state != CALL_STATE_IN_CHUNKS) ASSERT(before == after);
    if (status == SPRINGLS_OUT_OF_MEMORY) status = call->run(b); /* memory is back */
    ASSERT(status == *expected || status == SPRINGLS_EMPTY_MODEL);
    ASSERT_OK(springls_restore(b->ctx, b->snapshots[0], b->sizes[0]));
    ASSERT_OK(springls_step(b->ctx, &b->step));
    ASSERT_GT(springls_count(b->ctx), 30);
    call_end(b);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0u, heap.bytes);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

/* All allocations of a model that has moved, some in the other states; devices take their time: fewer there. */
TEST every_allocation_of_a_call_may_fail(const call_row *call, call_bench *b)
{
    int state, total = 0;
    for (state = 0; state < CALL_STATES; state++) {
        const int stride = (state == CALL_STATE_MOVED ? 1 : 4) * (fixture_backend() ? 9 : 1);
        springls_status expected = SPRINGLS_OK;
        int k, failed = 0;
        CHECK_CALL(starve_call(call, state, b, -1, &expected, &failed));
        for (k = 0, failed = 1; failed; k += stride) {
            CHECK_CALL(starve_call(call, state, b, k, &expected, &failed));
            total += failed;
        }
    }
    if (GREATEST_IS_VERBOSE()) printf("  %s: %d\n", call->name, total);
    PASS();
}

SUITE(calls)
{
    RUN_EVERY_CALL(every_allocation_of_a_call_may_fail);
}

SUITE(allocation)
{
    int scenario;
    for (scenario = 0; scenario < SCENARIOS; scenario++) {
        /* The others are taken call by call, below. */
        if (scenario >= FLUID && scenario != READING) RUN_TESTp(every_allocation_may_fail, scenario, 0);
        RUN_TESTp(every_allocation_may_fail, scenario, 1);
    }
    RUN_TEST(inputs_leave_all_or_nothing);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(allocation);
    RUN_SUITE(calls);
    GREATEST_MAIN_END();
}
