/* test_reading.c - calls that read a model leave it as it was, and what they find is of the present level set. */
#include "fixtures.h"

static springls_context *moved_ball(float distance)
{
    springls_context *ctx = fixture_sphere(48, NULL, 14.0f, 23.5f, 23.5f, 6.0f);
    float wind[3] = { distance, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    return springls_advect(ctx, &forces, 0.0f, 1.0f) == SPRINGLS_OK ? ctx : NULL;
}

static size_t snapshot_bytes(springls_context *ctx)
{
    size_t bytes = 0;
    springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &bytes);
    return bytes;
}

/* Reads a model by every call that looks for springls near places. */
static springls_status read_all(springls_context *ctx)
{
    const float points[6] = { 14.0f, 23.5f, 23.5f, 30.0f, 20.0f, 23.5f }, directions[6] = { 1.0f, 0.0f, 0.0f, -1.0f, 0.0f, 0.0f };
    springls_error_estimate *errors = (springls_error_estimate *)malloc((size_t)springls_count(ctx) * sizeof *errors);
    springls_chunks_desc desc = { .correspondences = true };
    springls_chunks *chunks;
    const springls_chunk *changed;
    int count;
    springls_mesh mesh;
    springls_hit hits[2];
    springls_measures measures;
    SPRINGLS__TRY(springls_extract_mesh(ctx, &mesh));
    springls_mesh_free(ctx, &mesh);
    SPRINGLS__TRY(springls_chunks_create(ctx, &desc, &chunks));
    SPRINGLS__TRY(springls_chunks_update(ctx, chunks, &changed, &count));
    springls_chunks_destroy(ctx, chunks);
    SPRINGLS__TRY(springls_springl_errors(ctx, errors));
    free(errors);
    SPRINGLS__TRY(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 2, hits));
    SPRINGLS__TRY(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, directions, 2, 0.0f, hits));
    return springls_measure(ctx, &measures);
}

/* Springls that have been carried into bricks which are not active do not make these active. */
TEST readers_leave_the_grid(void)
{
    springls_step_desc rest = springls_default_step_desc();
    springls_context *read = moved_ball(20.0f), *other = moved_ball(20.0f);
    uint64_t hash;
    ASSERT(read && other);
    hash = springls_state_hash(read);
    ASSERT_OK(read_all(read));
    ASSERT_EQ(hash, springls_state_hash(read));
    ASSERT_EQ(snapshot_bytes(other), snapshot_bytes(read));
    ASSERT_OK(springls_step(read, &rest));
    ASSERT_OK(springls_step(other, &rest));
    ASSERT_EQ(springls_state_hash(other), springls_state_hash(read));
    springls_destroy(read);
    springls_destroy(other);
    PASS();
}

/* Bricks that come for the time of reading are no reason to find components anew: the volumes that bodies are to keep stay known. */
TEST readers_leave_locked_volumes(void)
{
    springls_params params = springls_default_params();
    springls_step_desc rest = fixture_step(NULL, SPRINGLS_MODE_FLUID, 1.0f);
    float wind[3] = { 20.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    const springls_component *components;
    springls_context *ctx;
    void *before, *after;
    size_t size;
    int count;
    params.volume_lock = 1;
    ctx = fixture_sphere(48, &params, 14.0f, 23.5f, 23.5f, 6.0f);
    ASSERT_OK(springls_step(ctx, &rest));
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    size = snapshot_bytes(ctx);
    before = malloc(size);
    after = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, before, size, &size));
    ASSERT_OK(read_all(ctx));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(size, snapshot_bytes(ctx));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, after, size, &size));
    ASSERT_EQ(0, memcmp(before, after, size));
    free(before);
    free(after);
    springls_destroy(ctx);
    PASS();
}

/* Returns the volume of the only component. */
static double component_volume(springls_context *ctx)
{
    const springls_component *components;
    int count;
    return springls_components(ctx, &components, &count) == SPRINGLS_OK && count == 1 ? components->volume : -1.0;
}

/* After each stage that moves the level set alone, components are those of the level set. */
TEST components_are_of_the_present_level_set(void)
{
    static const springls_stage stages[] = { SPRINGLS_STAGE_EVOLVE, SPRINGLS_STAGE_REBUILD, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED };
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_measures m;
    size_t i;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    params.evolve_iterations = 4;
    ctx = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 8.0f);
    for (i = 0; i < sizeof stages / sizeof *stages; i++) {
        const float x[3] = { 15.5f, 15.5f, 15.5f };
        uint32_t id;
        double before = component_volume(ctx);
        float grow[3] = { 1.5f, 0.0f, 0.0f };
        springls_forces forces = fixture_forces(fixture_wind, grow);
        ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
        ASSERT_EQ(before, component_volume(ctx)); /* advect moves springls alone */
        ASSERT_OK(springls_run_stage(ctx, stages[i]));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_IN_RANGE(m.volume, component_volume(ctx), 1e-6 * m.volume);
        ASSERT_OK(springls_component_of(ctx, x, 1, &id));
        ASSERT_EQ(1, id);
    }
    springls_destroy(ctx);
    PASS();
}

/* Components that nobody has asked for get the same ids, and their events are in the same lists. */
TEST reading_components_changes_nothing_later(void)
{
    springls_params params = springls_default_params();
    springls_step_desc rest = springls_default_step_desc();
    springls_context *ctx[2];
    const springls_event *events;
    int i, k, count[2];
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    for (k = 0; k < 2; k++) {
        springls_sphere cut = fixture_ball(15.5f, 15.5f, 15.5f, 4.0f);
        ctx[k] = fixture_sphere(32, &params, 15.5f, 15.5f, 15.5f, 9.0f);
        ASSERT_OK(springls_combine_implicit(ctx[k], SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &cut));
        if (k == 0) ASSERT_OK(springls_events(ctx[k], &events, &i));
        ASSERT_OK(springls_run_stage(ctx[k], SPRINGLS_STAGE_EVOLVE));
        if (k == 0) ASSERT_OK(springls_events(ctx[k], &events, &i));
        ASSERT_OK(springls_step(ctx[k], &rest));
        ASSERT_OK(springls_events(ctx[k], &events, &count[k]));
    }
    ASSERT_GT(count[0], 0); /* a bubble was born */
    ASSERT_EQ(count[1], count[0]);
    ASSERT_EQ(snapshot_bytes(ctx[1]), snapshot_bytes(ctx[0]));
    for (k = 0; k < 2; k++) {
        ASSERT_OK(springls_step(ctx[k], &rest));
        ASSERT_OK(springls_events(ctx[k], &events, &count[k]));
        ASSERT_EQ(0, count[k]);
        springls_destroy(ctx[k]);
    }
    PASS();
}

/* Writes springls where they would link components that nobody has asked for to the wrong ones: each ball's go to the other's place. */
static springls_status exchange(springls_context *ctx)
{
    const int count = springls_count(ctx);
    float *p = (float *)malloc((size_t)count * 3 * sizeof *p);
    springls_status status;
    int i;
    for (i = 0; i < count; i++) {
        springls__v3 at = fixture_particle(ctx, i);
        p[3 * i] = at.x < 23.5f ? at.x + 24.0f : at.x - 24.0f;
        p[3 * i + 1] = at.y;
        p[3 * i + 2] = at.z;
    }
    status = springls_write(ctx, 0, count, NULL, p);
    free(p);
    return status;
}

/* Components are found before springls are written, not only when somebody asks: the larger ball keeps its id. */
TEST writing_changes_no_ids(int ask)
{
    springls_params params = springls_default_params();
    springls_sphere second = fixture_ball(36.0f, 23.5f, 23.5f, 5.0f);
    const springls_component *components;
    const springls_event *events;
    springls_context *ctx;
    int count;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ctx = fixture_sphere(48, &params, 12.0f, 23.5f, 23.5f, 7.0f);
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(1, components[0].id);
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &second));
    if (ask) ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_OK(exchange(ctx));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(2, count);
    ASSERT_EQ(1, components[0].id);
    ASSERT_GT(components[0].volume, components[1].volume);
    ASSERT_OK(springls_events(ctx, &events, &count));
    ASSERT_EQ(1, count);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_BIRTH, events[0].kind);
    ASSERT_GT(events[0].place[0], 30.0f);
    springls_destroy(ctx);
    PASS();
}

/* A call that moves neither springls nor phi leaves the components as they are, those that no springl bounds too. */
TEST masks_change_no_ids(void)
{
    springls_params params = springls_default_params();
    springls_sphere second = fixture_ball(36.0f, 23.5f, 23.5f, 5.0f);
    const springls_component *components;
    springls_context *ctx;
    uint32_t id;
    float *p;
    int count, i;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ctx = fixture_sphere(48, &params, 12.0f, 23.5f, 23.5f, 7.0f);
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &second));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(2, count);
    p = (float *)malloc((size_t)springls_count(ctx) * 3 * sizeof *p);
    for (i = 0; i < springls_count(ctx); i++) {
        const springls__v3 at = fixture_particle(ctx, i);
        p[3 * i] = at.x < 23.5f ? at.x : at.x - 24.0f; /* the second ball has none any more */
        p[3 * i + 1] = at.y;
        p[3 * i + 2] = at.z;
    }
    ASSERT_OK(springls_write(ctx, 0, springls_count(ctx), NULL, p));
    free(p);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(2, count);
    id = components[1].id;
    ASSERT_OK(springls_set_keep_mask(ctx, NULL));
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(id, components[1].id);
    springls_destroy(ctx);
    PASS();
}

/* Components that are followed no longer leave what they would have left had somebody asked for them before. */
TEST following_ends_as_if_asked(void)
{
    springls_params params = springls_default_params();
    springls_sphere second = fixture_ball(36.0f, 23.5f, 23.5f, 5.0f);
    const springls_component *components;
    springls_context *ctx[2];
    int k, count;
    for (k = 0; k < 2; k++) {
        params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
        ctx[k] = fixture_sphere(48, &params, 12.0f, 23.5f, 23.5f, 7.0f);
        ASSERT_OK(springls_components(ctx[k], &components, &count));
        ASSERT_OK(springls_combine_implicit(ctx[k], SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &second));
        if (k) ASSERT_OK(springls_components(ctx[k], &components, &count));
        params.components = 0;
        ASSERT_OK(springls_set_params(ctx[k], &params));
    }
    ASSERT_EQ(snapshot_bytes(ctx[1]), snapshot_bytes(ctx[0]));
    for (k = 0; k < 2; k++) springls_destroy(ctx[k]);
    PASS();
}

SUITE(reading)
{
    RUN_TESTp(writing_changes_no_ids, 0);
    RUN_TESTp(writing_changes_no_ids, 1);
    RUN_TEST(readers_leave_the_grid);
    RUN_TEST(readers_leave_locked_volumes);
    RUN_TEST(components_are_of_the_present_level_set);
    RUN_TEST(reading_components_changes_nothing_later);
    RUN_TEST(masks_change_no_ids);
    RUN_TEST(following_ends_as_if_asked);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(reading);
    GREATEST_MAIN_END();
}
