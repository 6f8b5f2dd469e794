/* test_embedding.c - what programs rely on that the library is a part of: budgets, ids, painted chunks, rest, functions that are cut
   short, landmarks. */
#include "fixtures.h"

/* A budget that is used up is below 0: one phase runs. Arguments that are wrong leave the step in progress. */
TEST budgets_may_be_negative(void)
{
    float wind[3] = { 0.4f, 0.3f, 0.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f),
                     *whole = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    springls_chunks *chunks;
    const springls_chunk *changed;
    int calls = 0, count;
    bool done = false;
    ASSERT_OK(springls_step_begin(ctx, &step));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step_continue(ctx, (double)NAN, &done));
    ASSERT(springls_step_in_progress(ctx));
    for (done = false; !done; calls++) ASSERT_OK(springls_step_continue(ctx, -0.0445, &done));
    ASSERT_LT(3, calls);
    ASSERT_OK(springls_step(whole, &step));
    ASSERT_EQ(springls_state_hash(whole), springls_state_hash(ctx));
    ASSERT_OK(springls_chunks_create(ctx, NULL, &chunks));
    ASSERT_OK(springls_chunks_begin(ctx, chunks));
    for (done = false; !done;) ASSERT_OK(springls_chunks_continue(ctx, chunks, -1.0, &changed, &count, &done));
    ASSERT_LT(0, count);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(whole);
    springls_destroy(ctx);
    PASS();
}

TEST ids_find_their_springls(void)
{
    float wind[3] = { 0.9f, 0.3f, 0.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx = fixture_sphere(32, NULL, 12.5f, 15.5f, 15.5f, 8.0f);
    int i, count, *index, first = springls_count(ctx);
    uint32_t *ids;
    ASSERT_OK(springls_run(ctx, &step, 6));
    count = springls_count(ctx);
    ids = (uint32_t *)malloc((size_t)(count + first) * sizeof *ids);
    index = (int *)malloc((size_t)(count + first) * sizeof *index);
    for (i = 0; i < count; i++) ids[i] = springls_ids(ctx)[count - 1 - i];
    ASSERT_OK(springls_index_of(ctx, ids, count, index));
    for (i = 0; i < count; i++) ASSERT_EQ(count - 1 - i, index[i]);
    for (i = 0; i < first; i++) ids[i] = i % 2 ? (uint32_t)i : 0xfffffff0u - (uint32_t)i; /* every second one has never been */
    ASSERT_OK(springls_index_of(ctx, ids, first, index));
    for (i = 0; i < first; i++) {
        if (i % 2 == 0) ASSERT_EQ(-1, index[i]);
        else if (index[i] >= 0) ASSERT_EQ(ids[i], springls_ids(ctx)[index[i]]);
    }
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_index_of(ctx, NULL, 1, index));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_index_of(ctx, ids, -1, index));
    ASSERT_OK(springls_index_of(ctx, NULL, 0, NULL));
    free(ids);
    free(index);
    springls_destroy(ctx);
    PASS();
}

TEST a_mesh_of_another_moment_is_refused(void)
{
    float wind[3] = { 0.4f, 0.3f, 0.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    springls_error_estimate *errors;
    springls_mesh mesh;
    ASSERT_OK(springls_run(ctx, &step, 2));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    errors = (springls_error_estimate *)malloc((size_t)mesh.vertex_count * sizeof *errors);
    ASSERT_OK(springls_mesh_errors(ctx, &mesh, errors));
    ASSERT_OK(springls_mesh_errors(ctx, &mesh, errors)); /* to ask changes nothing */
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_mesh_errors(ctx, &mesh, errors));
    ASSERT(strstr(springls_last_error(ctx), "have changed"));
    mesh.version = 0; /* as a mesh of the caller's */
    ASSERT_OK(springls_mesh_errors(ctx, &mesh, errors));
    free(errors);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* Paint makes chunks change that show it, and no others. */
TEST paint_marks_chunks(springls_contouring contouring)
{
    springls_params params = springls_default_params();
    springls_context *ctx;
    springls_attribute_desc desc = { "rgb", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY };
    springls_chunks_desc wanted = { .correspondences = true };
    const springls_chunk *changed;
    springls_chunks *chunks;
    float *rgb;
    int i, all, count, index;
    params.contouring = contouring;
    ctx = fixture_sphere(48, &params, 23.5f, 23.5f, 23.5f, 16.0f);
    ASSERT_OK(springls_settle(ctx, 60));
    rgb = (float *)calloc((size_t)springls_count(ctx) * 3, sizeof *rgb);
    ASSERT_OK(springls_add_attribute(ctx, &desc, rgb, &index));
    ASSERT_OK(springls_chunks_create(ctx, &wanted, &chunks));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &all));
    ASSERT_OK(springls_set_attribute(ctx, index, rgb));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    ASSERT_EQ(0, count);
    for (i = 0; i < springls_count(ctx); i++)
        if (fixture_particle(ctx, i).x > 36.0f) rgb[3 * i] = 1.0f;
    ASSERT_OK(springls_set_attribute(ctx, index, rgb));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    ASSERT_LT(0, count);
    ASSERT_LT(count, all / 2);
    for (i = 0; i < count; i++) ASSERT_LTE(4, changed[i].brick[0]); /* 36 - 2.5 lies in brick 4 */
    for (i = 0; i < 3 * springls_count(ctx); i++) rgb[i] = 0.5f;
    ASSERT_OK(springls_set_attribute(ctx, index, rgb));
    ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
    ASSERT_EQ(all, count);
    free(rgb);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    PASS();
}

/* A ball whose distance is cut short at `limit`, and how often it is evaluated; in one thread. */
typedef struct cut_ball { float limit; long points; } cut_ball;

static void cut_distance(void *user, const float *points, int count, float *out)
{
    cut_ball *ball = (cut_ball *)user;
    ball->points += count;
    for (; count-- > 0; points += 3, out++) {
        const float x = points[0] - 63.5f, y = points[1] - 63.5f, z = points[2] - 63.5f;
        *out = springls__clamp(springls__sqrt(x * x + y * y + z * z) - 20.0f, -ball->limit, ball->limit);
    }
}

static void in_one_thread(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)user, (void)grain;
    task(arg, 0, count);
}

/* Bounds that are cut short give the model of the exact distance, for not many more evaluations. */
TEST bounds_may_be_cut_short(void)
{
    static const float limits[4] = { 1e6f, 8.0f, 5.0f, 4.0f };
    uint64_t hash[4];
    long points[4];
    int k;
    for (k = 0; k < 4; k++) {
        springls_desc desc = fixture_desc(128, NULL);
        cut_ball ball = { 0.0f, 0 };
        springls_context *ctx;
        ball.limit = limits[k];
        desc.tasks.parallel_for = in_one_thread;
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, cut_distance, &ball));
        hash[k] = springls_state_hash(ctx);
        points[k] = ball.points;
        springls_destroy(ctx);
    }
    for (k = 0; k < 4; k++) {
        ASSERT_EQ(hash[0], hash[k]);
        ASSERT_LT(points[k], 200000); /* the grid has 2,097,152 voxels, and all were evaluated */
    }
    PASS();
}

/* After springls_settle the model sleeps, and a step without forces changes no bit. */
TEST a_settled_model_is_at_rest(void)
{
    springls_context *ctx = fixture_sphere(48, NULL, 23.5f, 23.5f, 23.5f, 14.0f);
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 0.1f);
    springls_measures before, measures;
    uint64_t hash;
    int steps;
    ASSERT_OK(springls_measure(ctx, &before));
    ASSERT(!springls_at_rest(ctx));
    ASSERT_OK(springls_settle(ctx, 0));
    ASSERT(!springls_at_rest(ctx));
    ASSERT_OK(springls_settle(ctx, 200));
    ASSERT(springls_at_rest(ctx));
    steps = springls_get_stats(ctx).steps;
    ASSERT_LT(steps, 100);
    ASSERT_OK(springls_settle(ctx, 200));
    ASSERT_EQ(steps, springls_get_stats(ctx).steps);
    hash = springls_state_hash(ctx);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(hash, springls_state_hash(ctx));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(before.volume, measures.volume, 0.001 * before.volume);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_settle(ctx, -1));
    springls_destroy(ctx);
    PASS();
}

/* Draws a contour to the radius 10, with noise of up to half a voxel a step that changes from step to step. */
static void noisy(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)user, (void)normals;
    for (; count-- > 0; points += 3, out++) {
        const float x = points[0] - 15.5f, y = points[1] - 15.5f, z = points[2] - 15.5f;
        *out = 0.5f * (10.0f - springls__sqrt(x * x + y * y + z * z)) + 0.05f * sinf(3.0f * x + 5.0f * y + 7.0f * z + 40.0f * time);
    }
}

TEST noisy_contours_arrive(void)
{
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.4f);
    springls_measures measures;
    int k;
    forces.pressure = noisy;
    step.stop_at_rest = true;
    for (k = 0; k < 2; k++) {
        springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 7.0f);
        step.rest_steps = k ? 8 : 0;
        step.rest_share = k ? 0.02f : 0.0f;
        step.rest_displacement = k ? 0.1f : 0.0f;
        ASSERT_OK(springls_run(ctx, &step, 120));
        if (k) ASSERT_LT(springls_get_stats(ctx).steps, 80);
        else ASSERT_EQ(120, springls_get_stats(ctx).steps);
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT_IN_RANGE(4.0 / 3.0 * fixture_pi * 1000.0, measures.volume, 80.0);
        springls_destroy(ctx);
    }
    step.rest_share = -1.0f;
    {
        springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 7.0f);
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_run(ctx, &step, 1));
        springls_destroy(ctx);
    }
    PASS();
}

/* The corners of a triangle come from places as far apart as they are: in a model just set, from where they are. */
TEST corners_have_their_own_correspondences(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    springls_mesh soup;
    double sum = 0.0;
    int i;
    ASSERT_OK(springls_extract_soup(ctx, &soup));
    for (i = 0; i < soup.vertex_count; i++)
        sum += d3_distance(d3_of(springls__load3(soup.positions + 3 * i)), d3_of(springls__load3(soup.correspondences + 3 * i)));
    ASSERT_LT(sum / soup.vertex_count, 0.02); /* it was two thirds of a voxel */
    springls_mesh_free(ctx, &soup);
    springls_destroy(ctx);
    PASS();
}

/* Landmarks on a ball that a rotation carries, and on one that a swirl shears, are where the flow has them. */
static void shear(void *user, const float *points, int count, float time, float *out)
{
    (void)user, (void)time;
    for (; count-- > 0; points += 3, out += 3) {
        out[0] = 0.1f * (points[2] - 15.5f);
        out[1] = out[2] = 0.0f;
    }
}

TEST landmarks_are_where_the_flow_has_them(bool turned)
{
    enum { COUNT = 200 };
    static float points[3 * COUNT];
    static springls_material_place places[COUNT];
    struct exact_flow flow = EXACT_ROTATION(15.5f, 15.5f, 15.5f, 1.0f, 2.0f, 2.0f, 0.5f);
    springls_forces forces = fixture_forces(turned ? exact_flow_velocity : shear, &flow);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.2f);
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    const d3 middle = d3_make(15.5, 15.5, 15.5);
    double sum = 0.0, largest = 0.0;
    int i, good = 0;
    fixture_seed(3);
    for (i = 0; i < COUNT; i++) {
        const springls__v3 x = springls__mad(springls__v3_make(15.5f, 15.5f, 15.5f), fixture_direction(), 9.0f);
        memcpy(points + 3 * i, &x.x, sizeof x);
    }
    ASSERT_OK(springls_run(ctx, &step, 20));
    ASSERT_OK(springls_place_now(ctx, points, COUNT, places));
    for (i = 0; i < COUNT; i++) {
        const d3 from = d3_sub(d3_of(springls__load3(points + 3 * i)), middle);
        const d3 to = turned ? d3_rotate(from, d3_make(2.0 / 3.0, 4.0 / 3.0, 4.0 / 3.0)) : d3_make(from.x + 0.4 * from.z, from.y, from.z);
        const double error = d3_distance(d3_add(to, middle), d3_of(springls__load3(places[i].place)));
        ASSERT_LTE(0, places[i].springl);
        ASSERT_EQ(springls_ids(ctx)[places[i].springl], places[i].id);
        good += error <= (double)places[i].error;
        sum += error;
        if (error > largest) largest = error;
    }
    ASSERT_LT(sum / COUNT, 0.02);
    ASSERT_LT(largest, 0.15);
    ASSERT_LTE(190, good);
    springls_destroy(ctx);
    PASS();
}

/* A landmark on what was cut off has no place any more; on what is left it has. */
TEST landmarks_that_are_gone_say_so(void)
{
    springls_sphere knife = { { 24.5f, 15.5f, 15.5f }, 7.0f };
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    float points[6] = { 24.5f, 15.5f, 15.5f, 6.5f, 15.5f, 15.5f };
    springls_material_place places[2];
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &knife));
    ASSERT_OK(springls_place_now(ctx, points, 2, places));
    ASSERT_EQ(-1, places[0].springl);
    ASSERT_LT(1e30f, places[0].error);
    ASSERT_LTE(0, places[1].springl);
    ASSERT_LT(d3_distance(d3_make(6.5, 15.5, 15.5), d3_of(springls__load3(places[1].place))), 0.02);
    points[0] = NAN;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_place_now(ctx, points, 2, places));
    springls_destroy(ctx);
    PASS();
}

SUITE(embedding)
{
    RUN_TEST(budgets_may_be_negative);
    RUN_TEST(ids_find_their_springls);
    RUN_TEST(a_mesh_of_another_moment_is_refused);
    RUN_TESTp(paint_marks_chunks, SPRINGLS_CONTOURING_LEVEL_SET);
    RUN_TESTp(paint_marks_chunks, SPRINGLS_CONTOURING_SPRINGLS);
    RUN_TEST(bounds_may_be_cut_short);
    RUN_TEST(a_settled_model_is_at_rest);
    RUN_TEST(noisy_contours_arrive);
    RUN_TEST(corners_have_their_own_correspondences);
    RUN_TESTp(landmarks_are_where_the_flow_has_them, false);
    RUN_TESTp(landmarks_are_where_the_flow_has_them, true);
    RUN_TEST(landmarks_that_are_gone_say_so);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(embedding);
    GREATEST_MAIN_END();
}
