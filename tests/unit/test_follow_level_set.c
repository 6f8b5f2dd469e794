/* test_follow_level_set.c - a new level set in each frame: volumes, ids and correspondences of what stays, springls and values of drops
   that come and go, models that rest, refusals, memory that runs out. */
#include "fixtures.h"

enum { SIZE = 40 };

typedef struct drops { springls_metasphere shape; springls_sphere ball[3]; int asked; } drops;

static void drops_at(drops *d, int count)
{
    memset(d, 0, sizeof *d);
    d->ball[0] = fixture_ball(13.3f, 19.7f, 19.4f, 7.0f);
    d->ball[1] = fixture_ball(33.0f, 33.0f, 19.4f, 3.0f);
    d->shape.spheres = d->ball;
    d->shape.count = count;
}

static void union_of(void *user, const float *points, int count, float *out)
{
    drops *d = (drops *)user;
    springls_implicit_metasphere(&d->shape, points, count, out);
}

/* Values of springls that come from none: their attribute's number, and 7. */
static void values_of_new(void *user, int attribute, const float *points, int count, float *out)
{
    drops *d = (drops *)user;
    int i;
    d->asked += count;
    for (i = 0; i < count; i++) {
        out[2 * i] = (float)attribute + (points[3 * i] > 25.0f ? 0.0f : 100.0f);
        out[2 * i + 1] = 7.0f;
    }
}

static void move_along(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)user, (void)points, (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = i % 3 ? 0.0f : 1.0f;
}

static springls_follow_desc follow_of(drops *d)
{
    springls_follow_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.fn = union_of;
    desc.user = d;
    desc.values = values_of_new;
    return desc;
}

static springls_context *ball_of(const drops *d)
{
    return fixture_sphere(SIZE, NULL, d->ball[0].center[0], d->ball[0].center[1], d->ball[0].center[2], d->ball[0].radius);
}

static double volume_of(springls_context *ctx, int *components)
{
    springls_measures m;
    if (springls_measure(ctx, &m) != SPRINGLS_OK) return -1.0;
    *components = m.components;
    return m.volume;
}

static double ball_volume(double r) { return 4.0 / 3.0 * fixture_pi * r * r * r; }

/* A ball that moves and breathes: the volume is the new level set's, and correspondences are those of the ball as it was. */
TEST springls_come_along(void)
{
    drops d;
    springls_context *ctx;
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_follow_desc follow;
    d3 start, center;
    double drift = 0.0;
    int i, components;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    start = d3_make(d.ball[0].center[0], d.ball[0].center[1], d.ball[0].center[2]);
    follow = follow_of(&d);
    forces.velocity = move_along;
    step.forces = &forces;
    step.dt = 0.5f;
    for (i = 1; i <= 16; i++) {
        d.ball[0].center[0] += 0.5f;
        d.ball[0].radius = 7.0f + 0.4f * sinf(0.5f * (float)i);
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_follow_level_set(ctx, &follow));
        ASSERT_IN_RANGE(ball_volume(d.ball[0].radius), volume_of(ctx, &components), 0.015 * ball_volume(7.0));
        ASSERT_EQ(1, components);
    }
    ASSERT_EQ(0, d.asked);
    center = d3_make(d.ball[0].center[0], d.ball[0].center[1], d.ball[0].center[2]);
    for (i = 0; i < springls_count(ctx); i++) {
        const springls_view a = springls_view_correspondences(ctx);
        const float *place = (const float *)(const void *)((const char *)a.data + (size_t)i * a.stride);
        const d3 way = d3_sub(d3_of(fixture_particle(ctx, i)), center);
        drift += d3_distance(d3_mad(start, way, 7.0 / d3_length(way)), d3_make(place[0], place[1], place[2]));
    }
    ASSERT_LT(drift / (double)springls_count(ctx), 0.2);
    springls_destroy(ctx);
    PASS();
}

/* A drop that comes, with the values that the callback gives, and goes; the ball's springls keep ids and values. */
TEST drops_come_and_go(void)
{
    const springls_attribute_desc two = { "two", 2, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    drops d;
    springls_context *ctx;
    springls_follow_desc follow;
    springls_view values;
    float *ones;
    int i, components, before, on_drop = 0;
    uint32_t last = 0;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    follow = follow_of(&d);
    before = springls_count(ctx);
    ones = (float *)malloc(2 * (size_t)before * sizeof *ones);
    for (i = 0; i < 2 * before; i++) ones[i] = 1.0f;
    for (i = 0; i < before; i++) last = springls_ids(ctx)[i] > last ? springls_ids(ctx)[i] : last;
    ASSERT_OK(springls_add_attribute(ctx, &two, ones, NULL));
    free(ones);
    d.shape.count = 2;
    ASSERT_OK(springls_follow_level_set(ctx, &follow));
    ASSERT_IN_RANGE(ball_volume(7.0) + ball_volume(3.0), volume_of(ctx, &components), 30.0);
    ASSERT_EQ(2, components);
    ASSERT_GT(d.asked, 50);
    values = springls_view_attribute(ctx, 0);
    for (i = 0; i < springls_count(ctx); i++) {
        const float *value = (const float *)(const void *)((const char *)values.data + (size_t)i * values.stride);
        const bool drop = fixture_particle(ctx, i).x > 25.0f;
        ASSERT_EQ(drop ? 0.0f : 1.0f, value[0]);
        ASSERT_EQ(drop ? 7.0f : 1.0f, value[1]);
        if (drop) ASSERT_GT(springls_ids(ctx)[i], last);
        on_drop += drop;
    }
    ASSERT_GT(on_drop, 50);
    d.shape.count = 1;
    ASSERT_OK(springls_follow_level_set(ctx, &follow));
    ASSERT_IN_RANGE(ball_volume(7.0), volume_of(ctx, &components), 30.0);
    ASSERT_EQ(1, components);
    for (i = 0; i < springls_count(ctx); i++) ASSERT(fixture_particle(ctx, i).x < 25.0f);
    ASSERT_EQ(before, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

/* A level set that does not change: the model becomes the same to the bit, frame after frame, also from a dense volume. */
TEST what_rests_does_not_flicker(int dense)
{
    static float phi[SIZE * SIZE * SIZE];
    const springls_step_desc rest = { 0 };
    drops d;
    springls_context *ctx;
    springls_follow_desc follow;
    uint64_t hash;
    int i;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    follow = follow_of(&d);
    for (i = 0; i < SIZE * SIZE * SIZE; i++) {
        const float point[3] = { (float)(i % SIZE), (float)(i / SIZE % SIZE), (float)(i / (SIZE * SIZE)) };
        union_of(&d, point, 1, &phi[i]);
    }
    if (dense) {
        follow.fn = NULL;
        follow.phi = phi;
    }
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_step(ctx, &rest));
        ASSERT_OK(springls_follow_level_set(ctx, &follow));
    }
    hash = springls_state_hash(ctx);
    for (i = 0; i < 6; i++) {
        ASSERT_OK(springls_step(ctx, &rest));
        ASSERT_OK(springls_follow_level_set(ctx, &follow));
        ASSERT_EQ(hash, springls_state_hash(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

TEST wrong_calls_are_refused(void)
{
    drops d;
    springls_context *ctx;
    springls_follow_desc follow;
    uint64_t hash;
    float phi = 1.0f;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    hash = springls_state_hash(ctx);
    follow = follow_of(&d);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(NULL, &follow));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, NULL));
    follow.phi = &phi;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, &follow));
    follow.phi = NULL;
    follow.fn = NULL;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, &follow));
    follow = follow_of(&d);
    follow.reach = 100.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, &follow));
    follow.reach = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, &follow));
    follow = follow_of(&d);
    follow.tolerance = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_follow_level_set(ctx, &follow));
    follow = follow_of(&d);
    d.ball[0].center[0] = 1000.0f;
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_follow_level_set(ctx, &follow));
    ASSERT_EQ(hash, springls_state_hash(ctx));
    ASSERT_OK(springls_reset(ctx));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_follow_level_set(ctx, &follow));
    springls_destroy(ctx);
    PASS();
}

/* Springls that were written, and that no step has seen since, lie on the new zero level too. */
TEST written_springls_come_along(void)
{
    drops d;
    springls_follow_desc desc = follow_of(&d);
    springls_context *ctx;
    float *p;
    int i;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    p = (float *)malloc((size_t)springls_count(ctx) * 3 * sizeof *p);
    for (i = 0; i < springls_count(ctx); i++) {
        const springls__v3 at = fixture_particle(ctx, i);
        p[3 * i] = at.x;
        p[3 * i + 1] = at.y;
        p[3 * i + 2] = at.z + 1.0f;
    }
    ASSERT_OK(springls_write(ctx, 0, springls_count(ctx), NULL, p));
    free(p);
    ASSERT_OK(springls_follow_level_set(ctx, &desc));
    for (i = 0; i < springls_count(ctx); i++)
        ASSERT_IN_RANGE((double)d.ball[0].radius, d3_distance(d3_of(fixture_particle(ctx, i)), d3_make(13.3, 19.7, 19.4)), 0.1);
    springls_destroy(ctx);
    PASS();
}

static void values_of_none(void *user, int attribute, const float *points, int count, float *out)
{
    (void)user, (void)attribute, (void)points;
    while (count-- > 0) *out++ = NAN;
}

TEST values_are_finite(void)
{
    const springls_attribute_desc attribute = { "heat", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    drops d;
    springls_follow_desc desc = follow_of(&d);
    springls_context *ctx;
    drops_at(&d, 1);
    ctx = ball_of(&d);
    ASSERT_OK(springls_add_attribute(ctx, &attribute, NULL, NULL));
    drops_at(&d, 2);
    desc.values = values_of_none;
    ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_follow_level_set(ctx, &desc));
    ASSERT_EQ(0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

TEST every_allocation_may_fail(void)
{
    int k, failed = 0;
    for (k = 0; k < 150; k += 3) {
        springls_desc desc = fixture_desc(SIZE, NULL);
        fixture_heap heap;
        springls_context *ctx;
        springls_status status;
        springls_follow_desc follow;
        drops d;
        drops_at(&d, 2);
        d.ball[0].radius = 4.0f;
        follow = follow_of(&d);
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &d.ball[0]));
        heap.fail_at = heap.calls + k;
        status = springls_follow_level_set(ctx, &follow);
        heap.fail_at = -1;
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        failed += status != SPRINGLS_OK;
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &d.ball[0]));
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    ASSERT_GT(failed, 5);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(springls_come_along);
    RUN_TEST(drops_come_and_go);
    RUN_TESTp(what_rests_does_not_flicker, 0);
    RUN_TESTp(what_rests_does_not_flicker, 1);
    RUN_TEST(wrong_calls_are_refused);
    RUN_TEST(written_springls_come_along);
    RUN_TEST(values_are_finite);
    RUN_TEST(every_allocation_may_fail);
    GREATEST_MAIN_END();
}
