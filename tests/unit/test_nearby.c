/* test_nearby.c - queries of few places, for which parts of the mesh of what springls hold are made: to the bit what those of many places
   find on the whole mesh. Balls, edges, sheets, the border of the grid, grids of any spacing and direction; memory that runs out. */
#include "springls_under_test.h"
#include "fixtures.h"

GREATEST_MAIN_DEFS();

enum { QUERIES = 40 };

/* Queries of one model, and what the whole mesh answers. */
typedef struct queries {
    float points[3 * QUERIES], origins[3 * QUERIES], directions[3 * QUERIES];
    springls_hit closest[QUERIES], hit[QUERIES];
    uint8_t inside[QUERIES];
} queries;

static void to_world(const springls_context *ctx, springls__v3 voxel, float *world)
{
    const float x[3] = { voxel.x, voxel.y, voxel.z };
    springls_to_world(ctx, x, 1, world);
}

/* Chooses places near springls and anywhere, and rays towards springls, some from far, from inside, along the grid or past the model. */
static void choose(const springls_context *ctx, queries *q, float size)
{
    const int count = springls_count(ctx);
    int i, k;
    for (i = 0; i < QUERIES; i++) {
        const springls__v3 p = fixture_particle(ctx, (int)fixture_bits() % count);
        const springls__v3 near = springls__mad(p, fixture_direction(), fixture_between(0.0f, 2.0f));
        const springls__v3 from = i % 5 == 0 ? near : fixture_point(-0.5f * size, 1.5f * size);
        float towards[3];
        to_world(ctx, i % 4 == 3 ? fixture_point(-4.0f, size + 4.0f) : near, q->points + 3 * i);
        to_world(ctx, from, q->origins + 3 * i);
        to_world(ctx, i % 7 == 6 ? fixture_point(0.0f, size) : p, towards);
        for (k = 0; k < 3; k++) q->directions[3 * i + k] = towards[k] - q->origins[3 * i + k];
        if (i % 6 == 5) /* along a line of the grid, through nodes */
            for (k = 0; k < 3; k++) {
                q->directions[3 * i + k] = k == i / 6 % 3 ? (i & 1 ? -1.0f : 1.0f) : 0.0f;
                q->origins[3 * i + k] = k == i / 6 % 3 ? q->origins[3 * i + k] : springls__floor(towards[k]);
            }
    }
}

/* Makes the model forget its mesh, and what parts of it have cost. */
static void forget(springls_context *ctx)
{
    ctx->surface_version = 0;
    ctx->nearby_version = 0;
}

static bool same_hit(const springls_hit *a, const springls_hit *b) { return memcmp(a, b, sizeof *a) == 0; }

/* Calls with 2 to 16 queries, one after the other: near ones and far ones, until parts have cost what the whole mesh does and after. */
TEST batches_are_as_many(springls_context *ctx, const queries *q)
{
    springls_hit hit[16];
    uint8_t inside[16];
    int first, i, count = 2;
    forget(ctx);
    for (first = 0; first + count <= QUERIES; first += count, count = count < 15 ? count + 7 : 2) {
        ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, q->points + 3 * first, count, hit));
        for (i = 0; i < count; i++) ASSERT(same_hit(&q->closest[first + i], &hit[i]));
        ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, q->origins + 3 * first, q->directions + 3 * first, count, 0.0f, hit));
        for (i = 0; i < count; i++) ASSERT(same_hit(&q->hit[first + i], &hit[i]));
        ASSERT_OK(springls_sample_inside(ctx, q->points + 3 * first, count, inside));
        for (i = 0; i < count; i++) ASSERT_EQ(q->inside[first + i], inside[i]);
    }
    PASS();
}

TEST few_are_as_many(springls_context *ctx, float size)
{
    static queries q;
    springls_hit hit;
    uint8_t inside;
    int i, found = 0, within = 0;
    choose(ctx, &q, size);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, q.points, QUERIES, q.closest));
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, q.origins, q.directions, QUERIES, 0.0f, q.hit));
    ASSERT_OK(springls_sample_inside(ctx, q.points, QUERIES, q.inside));
    for (i = 0; i < QUERIES; i++) {
        const float short_of = 0.999f * q.hit[i].distance;
        forget(ctx);
        ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, q.points + 3 * i, 1, &hit));
        ASSERT(same_hit(&q.closest[i], &hit));
        forget(ctx);
        ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, q.origins + 3 * i, q.directions + 3 * i, 1, 0.0f, &hit));
        ASSERT(same_hit(&q.hit[i], &hit));
        ASSERT(springls__surface_is_stale(ctx)); /* the whole mesh was not made */
        ASSERT_OK(springls_sample_inside(ctx, q.points + 3 * i, 1, &inside));
        ASSERT_EQ(q.inside[i], inside);
        found += hit.springl >= 0;
        within += inside;
        if (hit.springl < 0 || !(short_of > 0.0f)) continue;
        ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, q.origins + 3 * i, q.directions + 3 * i, 1, short_of, &hit));
        ASSERT_EQ(-1, hit.springl);
    }
    ASSERT(found > QUERIES / 2 && within > 2);
    CHECK_CALL(batches_are_as_many(ctx, &q));
    PASS();
}

static springls_params contoured(void)
{
    springls_params params = springls_default_params();
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    return params;
}

/* A ball in a deformation: a sheet with rims. */
TEST of_a_ball_and_a_sheet(void)
{
    const springls_params params = contoured();
    const springls_desc desc = fixture_desc(48, &params);
    const springls_sphere ball = { { 16.8f, 16.8f, 16.8f }, 7.2f };
    struct exact_flow flow = EXACT_DEFORMATION(48.0f, 3.0f);
    springls_forces forces;
    springls_step_desc step;
    springls_context *ctx;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.velocity = exact_flow_velocity;
    forces.voxel_units = true;
    forces.user = &flow;
    step.forces = &forces;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, (void *)&ball));
    fixture_seed(1u);
    CHECK_CALL(few_are_as_many(ctx, 48.0f));
    while (springls_time(ctx) < 1.4) ASSERT_OK(springls_step(ctx, &step));
    CHECK_CALL(few_are_as_many(ctx, 48.0f));
    springls_destroy(ctx);
    PASS();
}

static void turned_box(void *user, const float *points, int count, float *out)
{
    const float *half = (const float *)user;
    int i;
    for (i = 0; i < count; i++) {
        const float x = points[3 * i] - 20.3f, y = points[3 * i + 1] - 19.6f, z = fabsf(points[3 * i + 2] - 20.1f) - half[2];
        const float u = fabsf(0.92f * x + 0.39f * y) - half[0], v = fabsf(0.92f * y - 0.39f * x) - half[1];
        out[i] = fmaxf(u, fmaxf(v, z));
    }
}

/* Boxes with edges, and one that the border of the grid cuts off. */
TEST of_a_box(float half, float height)
{
    const springls_params params = contoured();
    const springls_desc desc = fixture_desc(40, &params);
    float box[3];
    springls_context *ctx;
    box[0] = box[1] = half;
    box[2] = height;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, turned_box, box));
    fixture_seed((uint32_t)half);
    CHECK_CALL(few_are_as_many(ctx, 40.0f));
    springls_destroy(ctx);
    PASS();
}

static void thick_ball(void *user, const float *points, int count, float *out)
{
    const float *middle = (const float *)user;
    int i, k;
    for (i = 0; i < count; i++) {
        float d2 = 0.0f;
        for (k = 0; k < 3; k++) d2 += (points[3 * i + k] - middle[k]) * (points[3 * i + k] - middle[k]);
        out[i] = sqrtf(d2) - 14.0f;
    }
}

/* Voxels that are no cubes, along axes that are turned, or a grid that is mirrored. */
TEST of_any_grid(bool mirrored)
{
    const springls_params params = contoured();
    const float turned[9] = { 0.8f, -0.6f, 0.0f, 0.6f, 0.8f, 0.0f, 0.0f, 0.0f, 1.0f };
    springls_desc desc = fixture_desc(48, &params);
    float middle[3], center[3];
    springls_context *ctx;
    int k;
    desc.grid.size[2] = 24;
    desc.grid.spacing[0] = desc.grid.spacing[1] = 1.0f;
    desc.grid.spacing[2] = 2.5f;
    for (k = 0; k < 9; k++) desc.grid.direction[k] = mirrored && k % 3 == 0 ? -turned[k] : turned[k];
    center[0] = center[1] = 24.2f;
    center[2] = 12.1f;
    ASSERT_OK(springls_create(&desc, &ctx));
    springls_to_world(ctx, center, 1, middle);
    ASSERT_OK(springls_set_implicit(ctx, thick_ball, middle));
    fixture_seed(5u);
    CHECK_CALL(few_are_as_many(ctx, 40.0f));
    springls_destroy(ctx);
    PASS();
}

/* What queries of one model make together costs no more than the whole mesh: then that is made. */
TEST many_few_make_the_mesh(void)
{
    const springls_params params = contoured();
    const springls_desc desc = fixture_desc(64, &params);
    const springls_sphere ball = { { 32.0f, 32.0f, 32.0f }, 20.0f };
    springls_context *ctx;
    springls_hit hit;
    int i = 0;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, (void *)&ball));
    fixture_seed(9u);
    do {
        const springls__v3 d = fixture_direction();
        const float origin[3] = { 32.0f + 60.0f * d.x, 32.0f + 60.0f * d.y, 32.0f + 60.0f * d.z }, way[3] = { -d.x, -d.y, -d.z };
        ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, origin, way, 1, 0.0f, &hit));
        ASSERT_IN_RANGE(40.0, (double)hit.distance, 0.02);
    } while (++i < 1000 && springls__surface_is_stale(ctx));
    ASSERT(i > 4 && i < 200);
    springls_destroy(ctx);
    PASS();
}

/* A far point takes the whole mesh, which later ones of the call use. */
TEST a_far_point_makes_the_mesh(void)
{
    const springls_params params = contoured();
    const springls_desc desc = fixture_desc(64, &params);
    const springls_sphere ball = { { 32.0f, 32.0f, 32.0f }, 20.0f };
    const float points[9] = { 11.0f, 32.0f, 32.0f, 32.1f, 32.0f, 32.0f, 53.0f, 32.0f, 32.0f };
    springls_context *ctx;
    springls_hit hit[3];
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, (void *)&ball));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 1, hit));
    ASSERT(springls__surface_is_stale(ctx));
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 3, hit));
    ASSERT_FALSE(springls__surface_is_stale(ctx));
    ASSERT_IN_RANGE(1.0, (double)hit[0].distance, 0.02);
    ASSERT_IN_RANGE(19.9, (double)hit[1].distance, 0.02);
    ASSERT_IN_RANGE(1.0, (double)hit[2].distance, 0.02);
    springls_destroy(ctx);
    PASS();
}

/* Where memory runs out the call says so, and the next one finds what it should. */
TEST memory_may_run_out(void)
{
    const springls_params params = contoured();
    const springls_sphere ball = { { 16.0f, 16.0f, 16.0f }, 9.0f };
    const float origin[3] = { 40.0f, 17.3f, 15.8f }, way[3] = { -1.0f, 0.0f, 0.0f };
    springls_status status;
    int fail = 1;
    do {
        springls_desc desc = fixture_desc(32, &params);
        fixture_heap heap;
        springls_context *ctx;
        springls_hit hit;
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, (void *)&ball));
        heap.fail_at = heap.calls + fail++;
        status = springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, origin, way, 1, 0.0f, &hit);
        if (status == SPRINGLS_OK) status = springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, origin, 1, &hit);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        heap.fail_at = -1;
        ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, origin, way, 1, 0.0f, &hit));
        ASSERT_IN_RANGE(15.1, (double)hit.distance, 0.1);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
    } while (status != SPRINGLS_OK);
    ASSERT_GT(fail, 5);
    PASS();
}

SUITE(nearby)
{
    RUN_TEST(of_a_ball_and_a_sheet);
    RUN_TESTp(of_a_box, 11.0f, 9.0f);
    RUN_TESTp(of_a_box, 13.0f, 0.4f);
    RUN_TESTp(of_a_box, 9.0f, 30.0f);
    RUN_TESTp(of_any_grid, false);
    RUN_TESTp(of_any_grid, true);
    RUN_TEST(many_few_make_the_mesh);
    RUN_TEST(a_far_point_makes_the_mesh);
    RUN_TEST(memory_may_run_out);
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(nearby);
    GREATEST_MAIN_END();
}
