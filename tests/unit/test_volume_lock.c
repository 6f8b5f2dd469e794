/* test_volume_lock.c - every component keeps its volume (params.volume_lock): shrinking, merging, splitting. */
#include "fixtures.h"
#include "../../src/stages/volume_lock.h"

static springls_params locked(int lock)
{
    springls_params params = springls_default_params();
    params.volume_lock = lock;
    return params;
}

static const float middle = 19.7f;

/* Balls shrink towards their own middles. */
typedef struct sinks { springls_sphere ball[2]; int count; float speed; } sinks;

static void shrink(void *user, const float *x, int count, float time, float *v)
{
    const sinks *s = (const sinks *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        springls__v3 p = springls__v3_make(x[0], x[1], x[2]), best = springls__v3_make(1e3f, 0.0f, 0.0f);
        for (k = 0; k < s->count; k++) {
            springls__v3 d = springls__sub(p, springls__v3_make(s->ball[k].center[0], s->ball[k].center[1], s->ball[k].center[2]));
            if (springls__length2(d) < springls__length2(best)) best = d;
        }
        best = springls__scale(springls__normalize(best), -s->speed);
        v[0] = best.x;
        v[1] = best.y;
        v[2] = best.z;
    }
}

/* Of the springls about a ball. */
static double mean_radius(const springls_context *ctx, const springls_sphere *ball)
{
    d3 c = d3_make((double)ball->center[0], (double)ball->center[1], (double)ball->center[2]);
    double sum = 0.0;
    int i, n = 0;
    for (i = 0; i < springls_count(ctx); i++) {
        double r = d3_distance(d3_of(fixture_particle(ctx, i)), c);
        if (r > 1.5 * (double)ball->radius) continue;
        sum += r;
        n++;
    }
    return sum / n;
}

static double volume_of(springls_context *ctx, int components)
{
    springls_measures m;
    return springls_measure(ctx, &m) == SPRINGLS_OK && m.components == components ? m.volume : -1.0;
}

/* A ball that would lose a tenth of its radius keeps its volume to 1 part in 10^5; without the lock it loses it. */
TEST a_ball_cannot_shrink(void)
{
    int lock;
    for (lock = 0; lock < 2; lock++) {
        springls_params params = locked(lock);
        springls_context *ctx = fixture_sphere(40, &params, middle, middle, middle, 10.0f);
        sinks s;
        springls_forces forces = fixture_forces(shrink, &s);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        double before = volume_of(ctx, 1), after;
        s.ball[0] = fixture_ball(middle, middle, middle, 10.0f);
        s.count = 1;
        s.speed = 0.05f;
        ASSERT_OK(springls_run(ctx, &step, 20));
        after = volume_of(ctx, 1);
        if (lock) {
            ASSERT_IN_RANGE(before, after, 1e-5 * before);
            ASSERT_IN_RANGE(10.0, mean_radius(ctx, &s.ball[0]), 0.02);
            ASSERT_IN_RANGE(0.05, (double)springls_get_stats(ctx).volume_correction, 0.01);
        } else {
            ASSERT_IN_RANGE(0.729 * before, after, 0.02 * before);
            ASSERT_EQ(0.0, springls_get_stats(ctx).volume_correction);
        }
        springls_destroy(ctx);
    }
    PASS();
}

static fixture_balls far_pair(void)
{
    fixture_balls p;
    p.ball[0] = fixture_ball(13.2f, middle, middle, 8.0f);
    p.ball[1] = fixture_ball(32.1f, middle, middle, 5.0f);
    return p;
}

/* Two balls of different sizes shrink, and each keeps its own volume: the small one would have lost more of it. */
TEST each_keeps_its_own(void)
{
    springls_params params = locked(1);
    springls_context *ctx = fixture_context(40, &params);
    fixture_balls p = far_pair();
    sinks s;
    springls_forces forces = fixture_forces(shrink, &s);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    double before, after;
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &p));
    before = volume_of(ctx, 2);
    s.ball[0] = p.ball[0];
    s.ball[1] = p.ball[1];
    s.count = 2;
    s.speed = 0.05f;
    ASSERT_OK(springls_run(ctx, &step, 20));
    after = volume_of(ctx, 2);
    ASSERT_IN_RANGE(before, after, 1e-5 * before);
    ASSERT_IN_RANGE(8.0, mean_radius(ctx, &p.ball[0]), 0.02);
    ASSERT_IN_RANGE(5.0, mean_radius(ctx, &p.ball[1]), 0.03);
    springls_destroy(ctx);
    PASS();
}

/* Both halves of space move towards the plane x = 22.5, or away from it, which makes what lies between them thick, or thin before
   they leave the domain. user: the speed. */
static void squeeze(void *user, const float *x, int count, float time, float *v)
{
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        float speed = *(const float *)user, rate = speed < 0.0f ? 0.5f : 0.25f;
        float thin = springls__fabs(x[0] - 22.5f) < 2.0f ? rate * speed : 0.0f;
        v[0] = speed * springls__clamp((22.5f - x[0]) * 0.5f, -1.0f, 1.0f);
        v[1] = thin * (x[1] - middle);
        v[2] = thin * (x[2] - middle);
    }
}

/* Components but for specks, which mergers leave behind. */
static int large_parts(springls_context *ctx)
{
    const springls_component *parts;
    int i, count, large = 0;
    if (springls_components(ctx, &parts, &count) != SPRINGLS_OK) return -1;
    for (i = 0; i < count; i++) large += !parts[i].cavity && !springls__is_tiny_body(parts[i].volume);
    return large;
}

/* What merges has what its parts had. Pulled apart, the parts have that together again. */
TEST mergers_add_up_and_parts_share(springls_contouring contouring)
{
    springls_params params = locked(1);
    springls_context *ctx;
    fixture_balls p = far_pair();
    float speed = 0.25f;
    springls_forces forces = fixture_forces(squeeze, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_measures m;
    const double close = contouring == SPRINGLS_CONTOURING_SPRINGLS ? 1e-3 : 1e-6; /* where springls meet, their mesh jumps */
    double before;
    int i;
    params.contouring = contouring;
    ctx = fixture_context(40, &params);
    ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &p));
    before = volume_of(ctx, 2);
    ASSERT_EQ(2, large_parts(ctx));
    for (i = 0; i < 40; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_IN_RANGE(before, m.volume, close * before);
    }
    ASSERT_EQ(1, large_parts(ctx));
    speed = -0.25f;
    for (i = 0; i < 80; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_IN_RANGE(before, m.volume, close * before);
        if (large_parts(ctx) == 2) break;
    }
    ASSERT_EQ(2, large_parts(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Algorithm 3, and a body that is cut by the border of the domain. */
TEST volumes_are_kept_in_elastic_mode_and_at_the_border(void)
{
    springls_params params = locked(1);
    springls_context *ctx = fixture_sphere(32, &params, 4.0f, 15.3f, 15.6f, 9.0f);
    float speed = 0.2f;
    springls_forces forces = fixture_forces(squeeze, &speed);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_ELASTIC, 1.0f);
    double before = volume_of(ctx, 1);
    ASSERT_OK(springls_run(ctx, &step, 10));
    ASSERT_IN_RANGE(before, volume_of(ctx, 1), 1e-4 * before);
    springls_destroy(ctx);
    PASS();
}

/* The same bits however the work is cut. */
TEST work_may_be_cut(void)
{
    uint64_t hash[2];
    int cut;
    for (cut = 0; cut < 2; cut++) {
        springls_params params = locked(1);
        springls_desc desc = fixture_desc(40, &params);
        fixture_workers workers;
        fixture_balls p = far_pair();
        float speed = 0.25f;
        springls_forces forces = fixture_forces(squeeze, &speed);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        springls_context *ctx;
        if (cut) desc.tasks = fixture_tasks(&workers, 5, FIXTURE_THREADS);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, fixture_two_balls, &p));
        ASSERT_OK(springls_run(ctx, &step, 6));
        hash[cut] = springls_state_hash(ctx);
        springls_destroy(ctx);
    }
    ASSERT(hash[0] == hash[1]);
    PASS();
}

/* Memory that is refused at any time is reported, and given back. */
TEST refused_memory_is_reported(void)
{
    int at, refused = 0;
    for (at = 0; at < 400; at++) {
        springls_params params = locked(1);
        springls_desc desc = fixture_desc(24, &params);
        fixture_heap heap;
        springls_sphere ball = fixture_ball(11.3f, 11.6f, 11.4f, 6.0f);
        float speed = 0.2f;
        springls_forces forces = fixture_forces(squeeze, &speed);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
        springls_context *ctx;
        springls_status status;
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        heap.fail_at = heap.calls + at;
        status = springls_step(ctx, &step);
        if (status != SPRINGLS_OK) {
            ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, status);
            refused++;
        }
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
        if (status == SPRINGLS_OK) break;
    }
    ASSERT_GT(refused, 8);
    ASSERT_LT(at, 400);
    PASS();
}

SUITE(volume_lock)
{
    RUN_TEST(a_ball_cannot_shrink);
    RUN_TEST(each_keeps_its_own);
    RUN_TESTp(mergers_add_up_and_parts_share, SPRINGLS_CONTOURING_LEVEL_SET);
    RUN_TESTp(mergers_add_up_and_parts_share, SPRINGLS_CONTOURING_SPRINGLS);
    RUN_TEST(volumes_are_kept_in_elastic_mode_and_at_the_border);
    RUN_TEST(work_may_be_cut);
    RUN_TEST(refused_memory_is_reported);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(volume_lock);
    GREATEST_MAIN_END();
}
