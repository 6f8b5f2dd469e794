/* test_unsigned_distance.c - the unsigned level set (eq. 21) and the distances it is made of, against double precision. */
#include "fixtures.h"
#include "../../src/stages/unsigned_distance.h"

static springls__tri random_triangle(int kind)
{
    springls__tri t;
    float size = kind % 4 == 1 ? 0.02f : kind % 4 == 2 ? 20.0f : 1.5f;
    t.a = fixture_point(2.0f, 20.0f);
    t.b = springls__mad(t.a, fixture_direction(), size * fixture_between(0.1f, 1.0f));
    t.c = springls__mad(t.a, fixture_direction(), size * fixture_between(0.1f, 1.0f));
    if (kind % 16 == 3) t.c = springls__lerp(t.a, t.b, fixture_between(-0.5f, 1.5f)); /* no area, nearly */
    if (kind % 16 == 7) t.b = t.a;
    if (kind % 16 == 11) t.b = t.c = t.a;
    return t;
}

/* Both distances of a point to a triangle agree with double precision for triangles of every shape and size, and
   for points near and far, above the face, beside an edge and beyond a corner. */
TEST triangle_distances_are_exact(void)
{
    int i;
    fixture_seed(31);
    for (i = 0; i < 60000; i++) {
        springls__tri t = random_triangle(i);
        springls__v3 x = springls__mad(i % 3 ? t.a : springls__tri_centroid(t), fixture_direction(),
                                       fixture_between(0.0f, i % 5 ? 2.0f : 15.0f));
        springls__tri_plan plan = springls__tri_plan_make(t);
        springls__tri_hit hit = springls__tri_closest(t, x);
        d3 corners[3];
        double exact, tolerance;
        corners[0] = d3_of(t.a);
        corners[1] = d3_of(t.b);
        corners[2] = d3_of(t.c);
        exact = d3_triangle_distance(corners, d3_of(x));
        tolerance = 1e-5 + 2e-6 * exact;
        ASSERT_IN_RANGE(exact, sqrt((double)hit.d2), tolerance);
        ASSERT_IN_RANGE(exact, sqrt((double)springls__tri_distance2(&plan, x)), tolerance);
        ASSERT_IN_RANGE(exact, d3_distance(d3_of(hit.point), d3_of(x)), tolerance);
        ASSERT_IN_RANGE(1.0, hit.bary[0] + hit.bary[1] + hit.bary[2], 1e-5);
        ASSERT(hit.bary[0] >= 0.0f && hit.bary[1] >= -1e-6f && hit.bary[2] >= -1e-6f);
    }
    PASS();
}

/* No point of the triangle, sampled densely, is closer than the closest point. */
TEST no_sample_is_closer(void)
{
    int i, u, v;
    fixture_seed(32);
    for (i = 0; i < 150; i++) {
        springls__tri t = random_triangle(4 * i);
        springls__v3 x = springls__mad(t.a, fixture_direction(), fixture_between(0.0f, 3.0f));
        float d = springls__sqrt(springls__tri_closest(t, x).d2);
        for (u = 0; u <= 20; u++)
            for (v = 0; u + v <= 20; v++) {
                springls__tri_hit sample =
                    springls__tri_hit_make(t, x, (float)u / 20.0f, (float)v / 20.0f, (float)(20 - u - v) / 20.0f);
                ASSERT(d <= springls__sqrt(sample.d2) + 1e-5f);
            }
    }
    PASS();
}

/* omega is min(capture, distance to the springls) at every voxel of every active brick, for springls of all sizes,
   inside, across and outside the domain. */
TEST omega_is_the_distance(int which)
{
    springls_params p = springls_paper_params();
    springls_context *ctx;
    springls__grid *g;
    int i, v, met = 0;
    p.capture_range = which == 2 ? 3.5f : 2.0f;
    ctx = fixture_context(20, &p);
    g = &ctx->model.grid;
    fixture_seed(33);
    fixture_random_soup(ctx, 150, -2.0f, 21.0f, which == 1 ? 8.0f : 1.2f);
    for (i = 0; i < 27; i += which ? 1 : 2) ASSERT_OK(springls__grid_add_bricks(ctx, &i, 1));
    ASSERT_OK(fixture_stage(ctx, springls__omega_build));
    for (i = 0; i < g->active_count; i++) {
        int o[3];
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v += 3) {
            d3 x = d3_make(o[0] + (v & 7), o[1] + (v >> 3 & 7), o[2] + (v >> 6));
            double d = fixture_distance(ctx, x);
            if (d > (double)p.capture_range) d = (double)p.capture_range;
            else met++;
            ASSERT_IN_RANGE(d, g->omega[g->active[i] * SPRINGLS__BRICK_VOXELS + v], 2e-5);
        }
    }
    ASSERT_GT(met, 200);
    springls_destroy(ctx);
    PASS();
}

/* Moving, removing and adding springls makes omega anew at the next call that needs it. */
TEST omega_is_never_stale(void)
{
    springls_context *ctx = fixture_sphere(20, NULL, 9.5f, 9.5f, 9.5f, 5.0f);
    springls__grid *g = &ctx->model.grid;
    springls__v3 corner = springls__v3_make(9.5f, 9.5f, 4.5f);
    uint8_t *keep;
    int i;
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    ASSERT_OK(fixture_translate(ctx, 0.0f, 0.0f, 1.0f));
    ASSERT_OK(fixture_stage(ctx, springls__omega_build));
    ASSERT_IN_RANGE(fixture_distance(ctx, d3_make(9.0, 9.0, 4.0)), springls__grid_voxel(g, g->omega, 9, 9, 4), 1e-5);
    keep = (uint8_t *)malloc((size_t)springls_count(ctx));
    for (i = 0; i < springls_count(ctx); i++)
        keep[i] =
            springls__length(springls__sub(fixture_particle(ctx, i), springls__add(corner, springls__v3_make(0.0f, 0.0f, 1.0f))))
            > 2.5f;
    ASSERT_OK(fixture_keep(ctx, keep));
    free(keep);
    ASSERT_OK(fixture_stage(ctx, springls__omega_build));
    ASSERT_IN_RANGE(2.0, springls__grid_voxel(g, g->omega, 9, 9, 4), 1e-5);
    fixture_add(ctx, springls__v3_make(9.0f, 9.0f, 4.5f), springls__v3_make(10.0f, 9.0f, 4.5f),
                springls__v3_make(9.0f, 10.0f, 4.5f));
    ASSERT_OK(fixture_stage(ctx, springls__omega_build));
    ASSERT_IN_RANGE(0.5, springls__grid_voxel(g, g->omega, 9, 9, 4), 1e-5);
    springls_destroy(ctx);
    PASS();
}

/* A new clamp is that of the constant bricks, too. */
TEST capture_may_change(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 5.0f);
    springls_params p = springls_get_params(ctx);
    p.capture_range = 1.25f;
    ASSERT_OK(springls_set_params(ctx, &p));
    ASSERT_OK(fixture_stage(ctx, springls__omega_build));
    ASSERT_EQ(1.25f, springls__grid_voxel(&ctx->model.grid, ctx->model.grid.omega, 0, 0, 0));
    ASSERT_EQ(1.25f, springls__grid_voxel(&ctx->model.grid, ctx->model.grid.omega, 15, 15, 12));
    springls_destroy(ctx);
    PASS();
}

SUITE(omega)
{
    RUN_TEST(triangle_distances_are_exact);
    RUN_TEST(no_sample_is_closer);
    RUN_TESTp(omega_is_the_distance, 0);
    RUN_TESTp(omega_is_the_distance, 1);
    RUN_TESTp(omega_is_the_distance, 2);
    RUN_TEST(omega_is_never_stale);
    RUN_TEST(capture_may_change);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(omega);
    GREATEST_MAIN_END();
}
