/* test_chunk_regions.c - chunks of what springls hold, made again around what has changed: after random strokes they are closed, near the
   mesh of all, and the same for any threads, budgets and failures. */
enum { SIZE = 64, SIDE = 8 };

#include "chunk_store.h"

typedef struct scene {
    springls_context *ctx;
    springls_chunks *chunks;
    brush brush;
    springls_forces forces;
    springls_step_desc step;
    store store;
    uint32_t random;
} scene;

typedef enum shape_of { BALL, BOX, PLATE } shape_of;

static springls_status scene_begin(scene *s, shape_of shape, const springls_desc *desc, bool correspondences)
{
    const springls_chunks_desc chunks = { .correspondences = correspondences };
    springls_sphere ball = fixture_ball(31.3f, 31.7f, 32.1f, 17.0f);
    springls_box box = { { 31.3f, 31.7f, 32.1f }, { 16.0f, 13.0f, 10.0f } };
    memset(s, 0, sizeof *s);
    s->random = 7u + (uint32_t)shape;
    s->forces = fixture_forces(push, &s->brush);
    s->step = fixture_step(&s->forces, SPRINGLS_MODE_FLUID, 1.0f);
    s->step.max_displacement = 2.0f;
    if (shape == PLATE) box.half[2] = 1.2f;
    SPRINGLS__TRY(springls_create(desc, &s->ctx));
    SPRINGLS__TRY(shape == BALL ? springls_set_implicit(s->ctx, springls_implicit_sphere, &ball)
                                : springls_set_implicit(s->ctx, springls_implicit_box, &box));
    return springls_chunks_create(s->ctx, &chunks, &s->chunks);
}

static void scene_end(scene *s)
{
    store_free(&s->store);
    springls_chunks_destroy(s->ctx, s->chunks);
    springls_destroy(s->ctx);
}

static springls_desc contoured_desc(void)
{
    static springls_params params;
    params = springls_default_params();
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    params.keep_edges = true;
    return fixture_desc(SIZE, &params);
}

static float random_in(scene *s, float least, float most)
{
    s->random = s->random * 1664525u + 1013904223u;
    return least + (most - least) * (float)(s->random >> 8) / 16777216.0f;
}

/* Steps under a brush somewhere on the surface, which pushes or pulls; every third step it goes elsewhere. */
static springls_status stroke(scene *s, int i)
{
    springls_hit hit;
    float from[3], sign = random_in(s, -1.0f, 1.0f) < 0.0f ? -1.0f : 1.0f;
    int k;
    for (k = 0; k < 3; k++) from[k] = random_in(s, 4.0f, 60.0f);
    if (i % 3 == 0) {
        SPRINGLS__TRY(springls_closest(s->ctx, SPRINGLS_SURFACE_SOUP, from, 1, &hit));
        for (k = 0; k < 3; k++) {
            s->brush.center[k] = hit.point[k];
            s->brush.velocity[k] = sign * 1.4f * hit.normal[k];
        }
        s->brush.radius = random_in(s, 2.5f, 6.0f);
    }
    return springls_step(s->ctx, &s->step);
}

static springls_status update(scene *s, int *count)
{
    const springls_chunk *changed;
    SPRINGLS__TRY(springls_chunks_update(s->ctx, s->chunks, &changed, count));
    store_put(&s->store, changed, *count);
    return SPRINGLS_OK;
}

/* Every vertex that a consumer has is within the tolerance of the mesh. */
static greatest_test_res is_near_the_mesh(const scene *s)
{
    springls_hit hit;
    int i, v;
    for (i = 0; i < SIDE * SIDE * SIDE; i++)
        for (v = 0; v < s->store.chunk[i].vertex_count; v += 5) {
            ASSERT_OK(springls_closest(s->ctx, SPRINGLS_SURFACE_WATERTIGHT, s->store.chunk[i].positions + 3 * v, 1, &hit));
            ASSERT_LT((double)hit.distance, 0.05);
        }
    PASS();
}

TEST strokes_stay_closed_and_near(shape_of shape)
{
    const springls_desc desc = contoured_desc();
    scene s;
    int i, count, all = 0, listed = 0;
    ASSERT_OK(scene_begin(&s, shape, &desc, false));
    for (i = 0; i < 15; i++) {
        ASSERT_OK(update(&s, &count));
        if (i == 0) all = count;
        else listed += count;
        CHECK_CALL(is_watertight(&s.store));
        if (i % 7 == 6) CHECK_CALL(is_near_the_mesh(&s));
        ASSERT_OK(update(&s, &count));
        ASSERT_EQ(0, count);
        ASSERT_OK(stroke(&s, i));
    }
    ASSERT_LT(listed, 14 * all / 4);
    scene_end(&s);
    PASS();
}

/* A job system that cuts loops in odd ways, in threads where there are any, and an update in slices list the same chunks. */
TEST threads_and_budgets_change_nothing(void)
{
    springls_desc desc = contoured_desc();
    fixture_workers workers;
    scene one, many;
    int i, count, slices = 0;
    ASSERT_OK(scene_begin(&one, BOX, &desc, true));
    desc.tasks = fixture_tasks(&workers, 5, FIXTURE_THREADS);
    ASSERT_OK(scene_begin(&many, BOX, &desc, true));
    for (i = 0; i < 8; i++) {
        const springls_chunk *expected, *changed = NULL;
        int n = 0;
        bool done = false;
        ASSERT_OK(springls_chunks_update(one.ctx, one.chunks, &expected, &count));
        ASSERT_OK(springls_chunks_begin(many.ctx, many.chunks));
        for (; !done; slices++) ASSERT_OK(springls_chunks_continue(many.ctx, many.chunks, 0.0, &changed, &n, &done));
        ASSERT_EQ(count, n);
        ASSERT_EQ(hash_of(expected, count), hash_of(changed, n));
        ASSERT_OK(stroke(&one, i));
        ASSERT_OK(stroke(&many, i));
    }
    ASSERT_GT(slices, 100);
    scene_end(&one);
    scene_end(&many);
    PASS();
}

/* Memory that runs out in an update leaves what was published: the next one is as if nothing had been. */
TEST memory_may_run_out(void)
{
    const springls_chunks_desc desc = { .correspondences = true };
    springls_desc d = contoured_desc();
    springls_chunks *other;
    fixture_heap heap;
    scene s;
    int k, failed = 0;
    d.allocator = fixture_allocator(&heap);
    ASSERT_OK(scene_begin(&s, BOX, &d, true));
    for (k = 0; k < 16; k++) {
        const springls_chunk *changed;
        uint64_t expected;
        int count, n;
        springls_chunks_destroy(s.ctx, s.chunks); /* a new consumer has all its memory to ask for */
        ASSERT_OK(springls_chunks_create(s.ctx, &desc, &s.chunks));
        ASSERT_OK(springls_chunks_create(s.ctx, &desc, &other));
        ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &count));
        ASSERT_OK(springls_chunks_update(s.ctx, other, &changed, &count));
        ASSERT_OK(stroke(&s, 3 * k));
        heap.fail_at = heap.calls + k;
        if (springls_chunks_update(s.ctx, s.chunks, &changed, &n) != SPRINGLS_OK) {
            failed++;
            ASSERT_EQ(0, n);
            heap.fail_at = -1;
            ASSERT_OK(springls_chunks_update(s.ctx, s.chunks, &changed, &n));
        }
        heap.fail_at = -1;
        expected = hash_of(changed, n);
        ASSERT_OK(springls_chunks_update(s.ctx, other, &changed, &count));
        ASSERT_EQ(count, n);
        ASSERT_EQ(expected, hash_of(changed, count));
        springls_chunks_destroy(s.ctx, other);
    }
    ASSERT_GT(failed, 8);
    scene_end(&s);
    ASSERT_EQ(0, heap.blocks);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    static const char *const name[] = { "ball", "box", "plate" };
    int shape;
    GREATEST_MAIN_BEGIN();
    for (shape = BALL; shape <= PLATE; shape++) {
        greatest_set_test_suffix(name[shape]);
        RUN_TESTp(strokes_stay_closed_and_near, (shape_of)shape);
    }
    RUN_TEST(threads_and_budgets_change_nothing);
    RUN_TEST(memory_may_run_out);
    GREATEST_MAIN_END();
}
