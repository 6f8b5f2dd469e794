/* test_resample.c - splitting (section 4.6): who is split, what the halves inherit, and where new springls may not go. */
#include "fixtures.h"

static double longest_edge(const fixture_springl *s)
{
    double best = 0.0;
    int m;
    for (m = 0; m < 3; m++) best = fmax(best, d3_distance(d3_of(s->q[m]), d3_of(s->q[(m + 1) % 3])));
    return best;
}

static int overgrown(const fixture_springl *s, const springls_params *p)
{
    return longest_edge(s) > (double)p->split_edge || fixture_area(s) > (double)p->split_area;
}

/* Triangles of many sizes on a sphere of radius 20 in a grid of 48, correspondences unlike particles. */
static springls_context *sizes(const springls_params *p, int count)
{
    springls_context *ctx = fixture_sphere(48, p, 23.5f, 23.5f, 23.5f, 20.0f);
    int i, m;
    fixture_clear(ctx);
    fixture_seed(61);
    for (i = 0; i < count; i++) {
        d3 n = d3_of(fixture_direction()), u = d3_cross(n, d3_make(0.36, 0.48, 0.8)), v,
           x = d3_mad(d3_make(23.5, 23.5, 23.5), n, 20.0), q[3];
        double size = (double)fixture_between(0.4f, 2.8f);
        u = d3_scale(u, 1.0 / d3_length(u));
        v = d3_cross(n, u);
        for (m = 0; m < 3; m++) {
            double angle = 2.0 * fixture_pi * (m + (double)fixture_between(-0.2f, 0.2f)) / 3.0;
            q[m] = d3_add(x, d3_add(d3_scale(u, size * cos(angle)), d3_scale(v, size * sin(angle))));
        }
        fixture_add(ctx, d3_float(q[0]), d3_float(q[1]), d3_float(q[2]));
        ctx->model.set.a[ctx->model.set.count - 1] = fixture_point(10.0f, 30.0f);
    }
    return ctx;
}

/* Exactly the overgrown that are not of the keep mask are split, once, at the middle of the longest edge: two halves of the same
   area, plane and orientation, particles at the centroids, the correspondence copied, one generation more, an id never used
   before. */
TEST halves_inherit(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx = sizes(&p, 400);
    fixture_springl *before = fixture_copy(ctx);
    uint8_t mask[400];
    int i, k, m, split = 0, next = 400;
    for (i = 0; i < 400; i++) mask[i] = (uint8_t)(i % 4 == 0);
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    for (i = 0; i < 400; i++) {
        fixture_springl s[2];
        d3 sum = d3_make(0.0, 0.0, 0.0);
        s[0] = fixture_get(ctx, i);
        ASSERT_EQ(before[i].id, s[0].id);
        if (fabs(longest_edge(&before[i]) - (double)p.split_edge) < 1e-5
            || fabs(fixture_area(&before[i]) - (double)p.split_area) < 1e-5)
            continue;
        if (mask[i] || !overgrown(&before[i], &p)) {
            ASSERT_MEM_EQ(&before[i], &s[0], sizeof s[0]);
            continue;
        }
        split++;
        ASSERT_LT(next, springls_count(ctx));
        s[1] = fixture_get(ctx, next);
        ASSERT_EQ((uint32_t)next, s[1].id);
        fixture_here(ctx);
        ASSERT_EQ(0, ctx->model.set.mask[next]);
        next++;
        for (k = 0; k < 2; k++) {
            d3 mean = d3_make(0.0, 0.0, 0.0);
            ASSERT_IN_RANGE(0.5 * fixture_area(&before[i]), fixture_area(&s[k]), 1e-4);
            ASSERT_GT(d3_dot(fixture_normal(&before[i]), fixture_normal(&s[k])), 0.99999);
            ASSERT_MEM_EQ(&before[i].a, &s[k].a, sizeof s[k].a);
            ASSERT_EQ(before[i].generation + 1, s[k].generation);
            ASSERT(longest_edge(&s[k]) < longest_edge(&before[i]) - 1e-3);
            for (m = 0; m < 3; m++) mean = d3_mad(mean, d3_of(s[k].q[m]), 1.0 / 3.0);
            ASSERT_LT(d3_distance(mean, d3_of(s[k].p)), 1e-5);
            sum = d3_mad(sum, d3_of(s[k].p), 0.5);
        }
        ASSERT_LT(d3_distance(sum, d3_of(before[i].p)), 1e-5); /* together they are the parent */
    }
    ASSERT_GT(split, 100);
    ASSERT_LT(split, 350);
    ASSERT_EQ(next, springls_count(ctx));
    ASSERT_EQ(split, springls_get_stats(ctx).split);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* Splitting again and again ends, with nothing overgrown and the whole area there. */
TEST splitting_ends(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx = sizes(&p, 200);
    double before = 0.0, after = 0.0;
    int i, rounds;
    for (i = 0; i < 200; i++) {
        fixture_springl s = fixture_get(ctx, i);
        before += fixture_area(&s);
    }
    for (rounds = 0; rounds < 20; rounds++) {
        int count = springls_count(ctx);
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
        if (count == springls_count(ctx)) break;
    }
    ASSERT_LT(rounds, 8);
    for (i = 0; i < springls_count(ctx); i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_FALSE(overgrown(&s, &p));
        after += fixture_area(&s);
    }
    ASSERT_IN_RANGE(before, after, 1e-4 * before);
    springls_destroy(ctx);
    PASS();
}

/* Ids are never given twice, whatever is removed in between. */
TEST ids_are_never_reused(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx = sizes(&p, 100);
    unsigned char seen[4096];
    uint8_t keep[4096];
    int i, round;
    memset(seen, 0, sizeof seen);
    for (i = 0; i < 100; i++) seen[springls_ids(ctx)[i]] = 1;
    for (round = 0; round < 6; round++) {
        uint32_t largest = ctx->model.set.next_id;
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
        for (i = 0; i < springls_count(ctx); i++) {
            uint32_t id = springls_ids(ctx)[i];
            ASSERT_LT(id, 4096u);
            if (id >= largest) ASSERT_EQ(0, seen[id]);
            seen[id] = 1;
            keep[i] = fixture_bits() % 3u != 0;
        }
        fixture_keep(ctx, keep);
        for (i = 0; i < 10; i++) /* something to split next time */
            fixture_add(ctx, springls__v3_make(20.0f, 20.0f, 20.0f), springls__v3_make(25.0f, 20.0f, 20.0f),
                        springls__v3_make(20.0f, 25.0f, 20.0f));
        for (i = springls_count(ctx) - 10; i < springls_count(ctx); i++) seen[springls_ids(ctx)[i]] = 1;
    }
    springls_destroy(ctx);
    PASS();
}

/* max_springls is never exceeded: the first in order are split, the others wait and are counted as refused. */
TEST room_is_respected(void)
{
    springls_params p = springls_paper_params();
    springls_desc desc = fixture_desc(32, &p);
    springls_context *ctx;
    int i;
    desc.max_springls = 23;
    ASSERT_OK(springls_create(&desc, &ctx));
    for (i = 0; i < 20; i++) {
        float x = (float)i + 4.0f;
        fixture_add(ctx, springls__v3_make(x, 5.0f, 5.0f), springls__v3_make(x, 9.0f, 5.0f), springls__v3_make(x, 5.0f, 9.0f));
    }
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    ASSERT_EQ(23, springls_count(ctx));
    ASSERT_EQ(3, springls_get_stats(ctx).split);
    ASSERT_EQ(17, springls_get_stats(ctx).refused);
    for (i = 0; i < 20; i++) ASSERT_EQ(i < 3 ? 1u : 0u, springls_generations(ctx)[i]);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    ASSERT_EQ(23, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

/* The quadratic rule puts the halves of a sphere's springls onto the sphere, with correspondences where they belong;
   copying leaves them on the chord, with their parent's. */
TEST quadratic_halves_are_exact(void)
{
    double off[2], wrong[2];
    int rule;
    for (rule = 0; rule < 2; rule++) {
        springls_params p = springls_default_params();
        springls_context *ctx;
        int i, n = 0;
        p.placement = rule ? SPRINGLS_PLACEMENT_QUADRATIC : SPRINGLS_PLACEMENT_COPY;
        p.split_edge = 1.1f;
        ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 9.0f);
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
        off[rule] = wrong[rule] = 0.0;
        for (i = 0; i < springls_count(ctx); i++) {
            d3 x = d3_of(fixture_particle(ctx, i));
            if (springls_generations(ctx)[i] == 0) continue;
            off[rule] += fabs(d3_distance(x, d3_make(15.5, 15.5, 15.5)) - 9.0);
            wrong[rule] += d3_distance(x, d3_of(fixture_origin(ctx, i))); /* nothing has moved: a should be p */
            n++;
        }
        ASSERT_GT(n, 500);
        off[rule] /= n;
        wrong[rule] /= n;
        springls_destroy(ctx);
    }
    ASSERT_LT(off[1], 0.01);
    ASSERT_LT(wrong[1], 0.01);
    ASSERT_GT(wrong[0], 0.1);
    PASS();
}

SUITE(resample)
{
    RUN_TEST(halves_inherit);
    RUN_TEST(splitting_ends);
    RUN_TEST(ids_are_never_reused);
    RUN_TEST(room_is_respected);
    RUN_TEST(quadratic_halves_are_exact);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(resample);
    GREATEST_MAIN_END();
}
