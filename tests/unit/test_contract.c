/* test_contract.c - which springls go (section 4.6), in what order the others stay, what reshaping and merging keep. */
#include "fixtures.h"

static const d3 center = { 15.5, 15.5, 15.5 };
static const double radius = 10.0;

/* A triangle with angles (degrees) alpha at its first and beta at its second corner, its centroid at x, facing n. */
static int add_shape(springls_context *ctx, d3 x, d3 n, double alpha, double beta, double size)
{
    d3 u = fabs(n.x) < 0.6 ? d3_cross(n, d3_make(1.0, 0.0, 0.0)) : d3_cross(n, d3_make(0.0, 1.0, 0.0)), v, q[3], shift;
    double a = alpha * fixture_pi / 180.0, b = beta * fixture_pi / 180.0, side = size * sin(b) / sin(a + b);
    u = d3_scale(u, 1.0 / d3_length(u));
    v = d3_cross(n, u);
    q[0] = d3_make(0.0, 0.0, 0.0);
    q[1] = d3_scale(u, size);
    q[2] = d3_add(d3_scale(u, side * cos(a)), d3_scale(v, side * sin(a)));
    shift = d3_sub(x, d3_scale(d3_add(q[1], q[2]), 1.0 / 3.0));
    return fixture_add(ctx, d3_float(d3_add(q[0], shift)), d3_float(d3_add(q[1], shift)), d3_float(d3_add(q[2], shift)));
}

static springls_context *sphere_without_springls(const springls_params *p)
{
    springls_context *ctx = fixture_sphere(32, p, 15.5f, 15.5f, 15.5f, 10.0f);
    fixture_clear(ctx);
    return ctx;
}

static d3 random_direction(void) { return d3_of(fixture_direction()); }

/* A springl goes exactly when an angle is outside [20, 160] degrees or its particle is further than contract_distance
   from the zero level; those that stay keep their order and every bit. */
TEST rule_is_the_papers(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    fixture_springl *before;
    unsigned char bad[600];
    int i, n, kept = 0, removed = 0;
    p.merge_distance = 0.0f;
    ctx = sphere_without_springls(&p);
    fixture_seed(51);
    for (n = 0; n < 600; n++) {
        d3 dir = random_direction();
        double alpha = (double)fixture_between(3.0f, 170.0f), beta = (double)fixture_between(3.0f, 175.0f - (float)alpha);
        double least, most, gamma, off = (double)fixture_between(-1.2f, 1.2f);
        gamma = 180.0 - alpha - beta;
        least = fmin(alpha, fmin(beta, gamma));
        most = fmax(alpha, fmax(beta, gamma));
        if (fabs(least - 20.0) < 0.05 || fabs(most - 160.0) < 0.05) alpha = beta = gamma = least = most = 60.0;
        if (fabs(fabs(off) - 0.625) < 0.05) off = 0.0; /* phi is a trilinear interpolation */
        bad[n] = least < 20.0 || most > 160.0 || fabs(off) > 0.625;
        add_shape(ctx, d3_mad(center, dir, radius + off), dir, alpha, beta, 1.0);
    }
    before = fixture_copy(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    for (i = 0, n = 0; n < 600; n++) {
        fixture_springl s;
        if (bad[n]) {
            removed++;
            continue;
        }
        ASSERT_LT(i, springls_count(ctx));
        s = fixture_get(ctx, i++);
        ASSERT_EQ(before[n].id, s.id);
        ASSERT_MEM_EQ(&before[n], &s, sizeof s);
        kept++;
    }
    ASSERT_EQ(kept, springls_count(ctx));
    ASSERT_GT(kept, 50);
    ASSERT_GT(removed, 50);
    ASSERT_EQ(removed, springls_get_stats(ctx).removed);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* The angle limits are parameters, and so is the smallest area. */
TEST limits_are_parameters(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    d3 top = d3_make(15.5, 15.5, 25.5), up = d3_make(0.0, 0.0, 1.0);
    p.min_angle = 40.0f;
    p.max_angle = 95.0f;
    p.min_area = 0.3f;
    ctx = sphere_without_springls(&p);
    add_shape(ctx, top, up, 60.0, 60.0, 1.0);                              /* 0: stays, area 0.43 */
    add_shape(ctx, d3_add(top, d3_make(1.0, 0.0, 0.0)), up, 39.5, 60.0, 1.0); /* 1: too sharp        */
    add_shape(ctx, d3_add(top, d3_make(0.0, 1.0, 0.0)), up, 42.0, 42.0, 1.2); /* 2: 96 degrees       */
    add_shape(ctx, d3_add(top, d3_make(1.0, 1.0, 0.0)), up, 60.0, 60.0, 0.8); /* 3: area 0.28        */
    add_shape(ctx, d3_add(top, d3_make(0.5, 1.0, 0.0)), up, 43.5, 43.5, 1.3); /* 4: stays, 93 degrees, area 0.40 */
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(2, springls_count(ctx));
    ASSERT_EQ(0, springls_ids(ctx)[0]);
    ASSERT_EQ(4, springls_ids(ctx)[1]);
    springls_destroy(ctx);
    PASS();
}

/* Reshaping gives a bad triangle a good shape about the same particle: same id, correspondence, plane, and no less area. */
TEST reshape_keeps_the_particle(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    fixture_springl *before;
    int i, m, reshaped = 0;
    p.reshape = 1;
    ctx = sphere_without_springls(&p);
    fixture_seed(52);
    for (i = 0; i < 200; i++) {
        d3 dir = random_direction();
        double alpha = i % 2 ? 60.0 : (double)fixture_between(2.0f, 18.0f);
        add_shape(ctx, d3_mad(center, dir, radius), dir, alpha, 60.0, 1.0);
    }
    before = fixture_copy(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(200, springls_count(ctx));
    for (i = 0; i < 200; i++) {
        fixture_springl s = fixture_get(ctx, i);
        ASSERT_EQ(before[i].id, s.id);
        ASSERT_MEM_EQ(&before[i].p, &s.p, sizeof s.p);
        ASSERT_MEM_EQ(&before[i].a, &s.a, sizeof s.a);
        if (i % 2) {
            ASSERT_MEM_EQ(before[i].q, s.q, sizeof s.q);
            continue;
        }
        reshaped++;
        for (m = 0; m < 3; m++) { /* equilateral about the particle */
            ASSERT_IN_RANGE(d3_distance(d3_of(s.q[0]), d3_of(s.q[1])), d3_distance(d3_of(s.q[m]), d3_of(s.q[(m + 1) % 3])), 1e-5);
            ASSERT_IN_RANGE(d3_distance(d3_of(s.q[0]), d3_of(s.p)), d3_distance(d3_of(s.q[m]), d3_of(s.p)), 1e-5);
        }
        ASSERT_GT(d3_dot(fixture_normal(&before[i]), fixture_normal(&s)), 0.999);
        ASSERT(fixture_area(&s) > fixture_area(&before[i]) - 1e-5);
    }
    ASSERT_EQ(reshaped, springls_get_stats(ctx).reshaped);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT)); /* what was made is good */
    ASSERT_EQ(reshaped, springls_get_stats(ctx).reshaped);
    ASSERT_EQ(200, springls_count(ctx));
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* A triangle without area is removed without reshape, and with it is given one that faces out of the object. */
TEST flat_triangles_are_bad(void)
{
    int reshape;
    for (reshape = 0; reshape < 2; reshape++) {
        springls_params p = springls_paper_params();
        springls_context *ctx;
        p.reshape = reshape;
        ctx = sphere_without_springls(&p);
        fixture_add(ctx, springls__v3_make(15.0f, 15.5f, 25.5f), springls__v3_make(15.5f, 15.5f, 25.5f),
                    springls__v3_make(16.0f, 15.5f, 25.5f));
        fixture_add(ctx, springls__v3_make(15.5f, 15.5f, 5.5f), springls__v3_make(15.5f, 15.5f, 5.5f),
                    springls__v3_make(15.5f, 15.5f, 5.5f));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
        ASSERT_EQ(reshape ? 2 : 0, springls_count(ctx));
        if (reshape) {
            fixture_springl up = fixture_get(ctx, 0), down = fixture_get(ctx, 1);
            ASSERT_GT(fixture_normal(&up).z, 0.98);
            ASSERT_LT(fixture_normal(&down).z, -0.98);
            ASSERT_GT(fixture_area(&up), 0.1);
        }
        springls_destroy(ctx);
    }
    PASS();
}

/* Of particles on the same side closer than merge_distance one stays, the older; the far side of a thin sheet stays too. */
TEST merging_takes_the_younger(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    d3 top = d3_make(15.5, 15.5, 25.5), up = d3_make(0.0, 0.0, 1.0), down = d3_make(0.0, 0.0, -1.0);
    p.merge_distance = 0.6f;
    ctx = sphere_without_springls(&p);
    add_shape(ctx, top, up, 60.0, 60.0, 1.0);                                  /* 0, made young below: goes     */
    add_shape(ctx, d3_add(top, d3_make(0.4, 0.0, 0.0)), up, 60.0, 60.0, 1.0);   /* 1: stays                      */
    add_shape(ctx, d3_add(top, d3_make(0.4, 0.0, 0.05)), down, 60.0, 60.0, 1.0); /* 2, the other way: stays       */
    add_shape(ctx, d3_add(top, d3_make(1.1, 0.0, 0.0)), up, 60.0, 60.0, 1.0);   /* 3, at 0.7 from 1: stays       */
    add_shape(ctx, d3_add(top, d3_make(1.5, 0.0, 0.0)), up, 60.0, 60.0, 1.0);   /* 4, at 0.4 from 3, later: goes */
    add_shape(ctx, d3_add(top, d3_make(1.9, 0.0, -0.1)), up, 60.0, 60.0, 1.0);  /* 5, at 0.4 from 4 only: stays  */
    fixture_here(ctx)->set.generation[0] = 3;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(4, springls_count(ctx));
    ASSERT_EQ(1, springls_ids(ctx)[0]);
    ASSERT_EQ(2, springls_ids(ctx)[1]);
    ASSERT_EQ(3, springls_ids(ctx)[2]);
    ASSERT_EQ(5, springls_ids(ctx)[3]);
    springls_destroy(ctx);
    PASS();
}

/* A point of a spiral of six turns from one pole to the other: the decision about one depends on that about the one before it. */
static d3 spiral_direction(double part)
{
    double polar = fixture_pi * part, turn = 12.0 * polar;
    return d3_make(sin(polar) * cos(turn), sin(polar) * sin(turn), cos(polar));
}

static bool is_older(uint32_t id, uint32_t other, uint32_t generations)
{
    return id % generations < other % generations || (id % generations == other % generations && id < other);
}

/* After merging no two particles of one side are closer than merge_distance, and each that was removed has an older one near. */
TEST merging_leaves_no_crowd(bool in_a_row)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    fixture_springl *before;
    const uint32_t generations = in_a_row ? 3 : 1; /* that of springl i is i modulo this */
    int i, k, j = 0, count;
    p.merge_distance = 0.6f;
    ctx = sphere_without_springls(&p);
    fixture_seed(53);
    for (i = 0; i < 1500; i++) {
        d3 dir = in_a_row ? spiral_direction((i + 0.5) / 1500.0) : random_direction();
        add_shape(ctx, d3_mad(center, dir, radius), dir, 60.0, 60.0, 1.0);
        fixture_here(ctx)->set.generation[i] = (uint32_t)i % generations;
    }
    before = fixture_copy(ctx);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    count = springls_count(ctx);
    ASSERT_LT(count, 1400);
    for (i = 0; i < count; i++)
        for (k = 0; k < i; k++) ASSERT(d3_distance(d3_of(fixture_particle(ctx, i)), d3_of(fixture_particle(ctx, k))) > 0.6 - 1e-5);
    for (i = 0; i < 1500; i++) {
        int near = 0;
        if (j < count && springls_ids(ctx)[j] == before[i].id) {
            j++;
            continue;
        }
        for (k = 0; k < count; k++)
            near = near
                || (is_older(springls_ids(ctx)[k], before[i].id, generations)
                    && d3_distance(d3_of(fixture_particle(ctx, k)), d3_of(before[i].p)) < 0.6 + 1e-5);
        ASSERT(near);
    }
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* Springls that have been pushed out of the grid go, those on the surface that closes the model there stay. */
TEST none_stay_outside_the_grid(void)
{
    springls_params p = springls_paper_params();
    springls_context *ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 2.0f, 10.0f); /* cut by the border z = 0 */
    const float heights[] = { -0.5f, -3.0f, -10.0f, -1000.0f };
    int i;
    fixture_clear(ctx);
    for (i = 0; i < 4; i++) add_shape(ctx, d3_make(15.0 + i, 15.0, (double)heights[i]), d3_make(0.0, 0.0, -1.0), 60.0, 60.0, 1.0);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_EQ(1, springls_count(ctx));
    ASSERT_IN_RANGE(-0.5f, fixture_particle(ctx, 0).z, 1e-5f);
    springls_destroy(ctx);
    PASS();
}

SUITE(contract)
{
    RUN_TEST(rule_is_the_papers);
    RUN_TEST(limits_are_parameters);
    RUN_TEST(reshape_keeps_the_particle);
    RUN_TEST(flat_triangles_are_bad);
    RUN_TEST(merging_takes_the_younger);
    RUN_TESTp(merging_leaves_no_crowd, false);
    RUN_TESTp(merging_leaves_no_crowd, true);
    RUN_TEST(none_stay_outside_the_grid);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(contract);
    GREATEST_MAIN_END();
}
