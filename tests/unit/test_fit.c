/* test_fit.c - the quadratic fit: exact for what it can represent, planar with few neighbours, silent with fewer. */
#include "fixtures.h"
#include "../../src/model/cell_bricks.h"

typedef struct patch { d3 origin, e1, e2, n; double height[6], a[3][6]; } patch;

static double quadratic(const double c[6], double u, double v)
{
    return c[0] + c[1] * u + c[2] * v + c[3] * u * u + c[4] * u * v + c[5] * v * v;
}

/* A surface and correspondences that are polynomials over a tangent plane; degree 1: planar. */
static patch random_patch(int degree)
{
    patch s;
    int i, k;
    s.origin = d3_of(fixture_point(10.0f, 20.0f));
    s.n = d3_of(fixture_direction());
    s.e1 = d3_cross(s.n, fabs(s.n.x) < 0.6 ? d3_make(1.0, 0.0, 0.0) : d3_make(0.0, 1.0, 0.0));
    s.e1 = d3_scale(s.e1, 1.0 / d3_length(s.e1));
    s.e2 = d3_cross(s.n, s.e1);
    for (i = 0; i < 6; i++) {
        s.height[i] = (double)fixture_between(-0.08f, 0.08f) * (i >= 3 && degree < 2 ? 0.0 : 1.0);
        for (k = 0; k < 3; k++)
            s.a[k][i] = (double)fixture_between(-0.5f, 0.5f) * (i >= 3 && degree < 2 ? 0.0 : 1.0) + (i == 0 ? 12.0 : 0.0);
    }
    return s;
}

static d3 patch_point(const patch *s, double u, double v)
{
    return d3_mad(d3_mad(d3_mad(s->origin, s->e1, u), s->e2, v), s->n, quadratic(s->height, u, v));
}

static d3 patch_a(const patch *s, double u, double v)
{
    return d3_make(quadratic(s->a[0], u, v), quadratic(s->a[1], u, v), quadratic(s->a[2], u, v));
}

static springls__fit_result fit_patch(const patch *s, int count, int spread)
{
    springls__fit fit = springls__fit_begin(d3_float(s->origin), d3_float(s->n), springls__v3_make(11.0f, 11.5f, 12.5f));
    int i;
    for (i = 0; i < count; i++) {
        double angle = 2.4 * i, r = 0.3 + 1.7 * sqrt((i + 0.5) / count), u = r * cos(angle), v = spread ? r * sin(angle) : 0.0;
        springls__fit_add(&fit, d3_float(patch_point(s, u, v)), d3_float(s->n), d3_float(patch_a(s, u, v)));
    }
    return springls__fit_end(&fit);
}

/* With ten neighbours or more a quadratic surface and quadratic correspondences are met exactly, the normal too. */
TEST quadratics_are_exact(void)
{
    int i;
    fixture_seed(81);
    for (i = 0; i < 500; i++) {
        patch s = random_patch(2);
        springls__fit_result r = fit_patch(&s, 12 + i % 30, 1);
        d3 n = d3_sub(d3_sub(s.n, d3_scale(s.e1, s.height[1])), d3_scale(s.e2, s.height[2]));
        ASSERT(r.ok);
        ASSERT_LT(d3_distance(patch_point(&s, 0.0, 0.0), d3_of(r.point)), 2e-4);
        ASSERT_LT(d3_distance(patch_a(&s, 0.0, 0.0), d3_of(r.a)), 5e-4);
        ASSERT_GT(d3_dot(d3_scale(n, 1.0 / d3_length(n)), d3_of(r.normal)), 0.9999);
    }
    PASS();
}

/* With four to nine neighbours a plane and linear correspondences are met exactly. */
TEST planes_are_exact(void)
{
    int i;
    fixture_seed(82);
    for (i = 0; i < 300; i++) {
        patch s = random_patch(1);
        springls__fit_result r = fit_patch(&s, 4 + i % 6, 1);
        ASSERT(r.ok);
        ASSERT_LT(d3_distance(patch_point(&s, 0.0, 0.0), d3_of(r.point)), 1e-4);
        ASSERT_LT(d3_distance(patch_a(&s, 0.0, 0.0), d3_of(r.a)), 2e-4);
    }
    PASS();
}

/* Fewer than four neighbours, or neighbours on a line, say nothing: the fit is refused. */
TEST poor_neighbourhoods_are_refused(void)
{
    int i, count;
    fixture_seed(83);
    for (i = 0; i < 100; i++) {
        patch s = random_patch(1);
        for (count = 0; count < 4; count++) ASSERT_FALSE(fit_patch(&s, count, 1).ok);
        ASSERT_FALSE(fit_patch(&s, 8, 0).ok);
        ASSERT_FALSE(fit_patch(&s, 20, 0).ok);
    }
    PASS();
}

/* Particles that face the other way, lie on another sheet or are too far away count for nothing. */
TEST others_do_not_count(void)
{
    patch s;
    springls__fit fit;
    int before;
    fixture_seed(84);
    s = random_patch(1);
    fit = springls__fit_begin(d3_float(s.origin), d3_float(s.n), springls__v3_make(0.0f, 0.0f, 0.0f));
    springls__fit_add(&fit, d3_float(patch_point(&s, 0.5, 0.5)), d3_float(s.n), springls__v3_make(1.0f, 1.0f, 1.0f));
    before = (int)fit.count;
    ASSERT_EQ(1, before);
    springls__fit_add(&fit, d3_float(patch_point(&s, 0.4, 0.5)), d3_float(d3_scale(s.n, -1.0)),
                      springls__v3_make(9.0f, 9.0f, 9.0f));
    springls__fit_add(&fit, d3_float(d3_mad(s.origin, s.n, 1.5)), d3_float(s.n), springls__v3_make(9.0f, 9.0f, 9.0f));
    springls__fit_add(&fit, d3_float(patch_point(&s, 2.6, 0.0)), d3_float(s.n), springls__v3_make(9.0f, 9.0f, 9.0f));
    ASSERT_EQ(before, (int)fit.count);
    PASS();
}

/* On a sphere of springls the fit finds the sphere and the correspondence anywhere on it, to far below a voxel. */
TEST sphere_is_found(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    d3 center = d3_make(15.5, 15.5, 15.5);
    int i;
    ASSERT_OK(fixture_stage(ctx, springls__cell_list_cover));
    fixture_seed(85);
    for (i = 0; i < 500; i++) {
        springls__v3 n = fixture_direction(), x;
        springls__fit_result r;
        x = d3_float(d3_mad(center, d3_of(n), 9.0 + (double)fixture_between(-0.2f, 0.2f)));
        r = springls__fit_at(&ctx->model, 0, x, n, x, ctx->model.set.count);
        ASSERT(r.ok);
        ASSERT_IN_RANGE(9.0, d3_distance(d3_of(r.point), center), 0.02);
        ASSERT_LT(d3_distance(d3_mad(center, d3_of(n), 9.0), d3_of(r.a)), 0.03);
        ASSERT_GT(d3_dot(d3_of(n), d3_of(r.normal)), 0.999);
    }
    springls_destroy(ctx);
    PASS();
}

/* Neighbours that all lie further than 1.5 voxels to one side determine the correspondence, but no place. */
TEST a_rim_gives_no_place(void)
{
    int i, k;
    fixture_seed(86);
    for (i = 0; i < 100; i++) {
        patch s = random_patch(1);
        springls__fit fit = springls__fit_begin(d3_float(s.origin), d3_float(s.n), springls__v3_make(11.0f, 11.5f, 12.5f));
        springls__fit_result r;
        for (k = 0; k < 15; k++) {
            double u = 1.6 + 0.2 * (k % 3), v = 0.3 * (k / 3 - 2);
            springls__fit_add(&fit, d3_float(patch_point(&s, u, v)), d3_float(s.n), d3_float(patch_a(&s, u, v)));
        }
        ASSERT_EQ(15, (int)fit.count);
        r = springls__fit_end(&fit);
        ASSERT(r.ok);
        ASSERT_EQ(0.0, d3_distance(d3_of(r.point), d3_of(fit.origin)));
        ASSERT_LT(d3_distance(patch_a(&s, 0.0, 0.0), d3_of(r.a)), 2e-3);
    }
    PASS();
}

SUITE(fit)
{
    RUN_TEST(quadratics_are_exact);
    RUN_TEST(planes_are_exact);
    RUN_TEST(poor_neighbourhoods_are_refused);
    RUN_TEST(others_do_not_count);
    RUN_TEST(sphere_is_found);
    RUN_TEST(a_rim_gives_no_place);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(fit);
    GREATEST_MAIN_END();
}
