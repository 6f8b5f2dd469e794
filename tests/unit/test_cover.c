/* test_cover.c - springls cover the surface (params.cover): the shape of one, and the area and true coverage of many in
   motion. */
#include "fixtures.h"

/* A whirl that draws a ball out into a sheet and, after half the time, back. */
typedef struct flow { float size, period; } flow;

static void deform(void *user, const float *x, int count, float time, float *v)
{
    const flow *f = (const flow *)user;
    struct exact_flow deformation = EXACT_DEFORMATION(f->size, f->period);
    exact_flow_velocity(&deformation, x, count, time, v);
}

static void turn(void *user, const float *x, int count, float time, float *v)
{
    const float middle = 0.5f * ((const flow *)user)->size, rate = 6.2831853f / ((const flow *)user)->period;
    int i;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        v[0] = -rate * (x[1] - middle);
        v[1] = rate * (x[0] - middle);
        v[2] = 0.0f;
    }
}

/* A wind along x that slides round a ball in the middle, which stays. */
static void wind(void *user, const float *x, int count, float time, float *v)
{
    const float middle = 0.5f * ((const flow *)user)->size;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++, x += 3, v += 3) {
        float d[3], r = 0.0f;
        for (k = 0; k < 3; k++) r += (x[k] - middle) * (x[k] - middle);
        r = sqrtf(r) + 1e-6f;
        for (k = 0; k < 3; k++) d[k] = (x[k] - middle) / r;
        for (k = 0; k < 3; k++) v[k] = 4.0f * ((k == 0 ? 1.0f : 0.0f) - d[0] * d[k]);
    }
}

/* ---- true coverage ---- */

/* Shares of random places of the zero level that lie over a springl of their side, within a tenth of a voxel, and over two or
   more. */
typedef struct true_coverage { double in_one, in_more; } true_coverage;

static bool is_over(springls__springl s, springls__v3 x, springls__v3 facing)
{
    const float high = 0.1f;
    springls__v3 n = springls__springl_normal(s);
    int e;
    if (springls__dot(n, facing) <= 0.0f || springls__fabs(springls__dot(springls__sub(x, s.q[0]), n)) > high) return false;
    for (e = 0; e < 3; e++) {
        springls__v3 edge = springls__sub(s.q[(e + 1) % 3], s.q[e]);
        if (springls__dot(springls__cross(n, edge), springls__sub(x, s.q[e])) < 0.0f) return false;
    }
    return true;
}

static true_coverage measure_true_coverage(springls_context *ctx)
{
    springls_mesh mesh;
    true_coverage found = { 0.0, 0.0 };
    int t, i, places = 0;
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return found;
    springls__ensure_on_host(ctx, SPRINGLS__BIT(S));
    for (t = 0; t < mesh.triangle_count; t++) {
        springls__v3 c[3], n, x;
        float u = fixture_between(0.0f, 1.0f), v = fixture_between(0.0f, 1.0f);
        int k, in = 0;
        for (k = 0; k < 3; k++) memcpy(&c[k], mesh.positions + 3 * mesh.triangles[3 * t + k], sizeof c[k]);
        n = springls__cross(springls__sub(c[1], c[0]), springls__sub(c[2], c[0]));
        if (fixture_between(0.0f, 1.3f) > springls__length(n)) continue; /* by area: a triangle has at most 0.65 voxel^2 */
        if (u + v > 1.0f) { u = 1.0f - u; v = 1.0f - v; }
        x = springls__mad(springls__mad(c[0], springls__sub(c[1], c[0]), u), springls__sub(c[2], c[0]), v);
        for (i = 0; i < ctx->model.set.count; i++) in += is_over(ctx->model.set.s[i], x, n);
        places++;
        found.in_one += in > 0;
        found.in_more += in > 1;
    }
    springls_mesh_free(ctx, &mesh);
    found.in_one /= places;
    found.in_more /= places;
    return found;
}

/* ---- motions ---- */

typedef struct motion {
    springls_velocity_fn velocity;
    springls_implicit_fn shape;
    void *shape_data;
    float size, period;
    int calls;
} motion;

/* What is found after the steps of a motion: the range of the coverage from the first resampling on. */
typedef struct range { double least, most; } range;

static springls_context *moved(motion m, int cover, range *coverage)
{
    springls_params p = springls_default_params();
    springls_context *ctx;
    springls_forces forces;
    springls_step_desc step;
    springls_measures measures;
    flow f;
    int i;
    f.size = m.size;
    f.period = m.period;
    p.cover = cover;
    ctx = fixture_context((int)m.size, &p);
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.velocity = m.velocity;
    forces.user = &f;
    step.forces = &forces;
    step.dt = m.period / (float)m.calls;
    coverage->least = 10.0;
    coverage->most = 0.0;
    if (springls_set_implicit(ctx, m.shape, m.shape_data) != SPRINGLS_OK) return ctx;
    for (i = 1; i <= m.calls; i++) {
        if (springls_step(ctx, &step) != SPRINGLS_OK || springls_measure(ctx, &measures) != SPRINGLS_OK) return ctx;
        if (i < p.resample_period) continue;
        coverage->least = measures.coverage < coverage->least ? measures.coverage : coverage->least;
        coverage->most = measures.coverage > coverage->most ? measures.coverage : coverage->most;
    }
    return ctx;
}

static double mean_tracking(springls_context *ctx)
{
    double sum = 0.0;
    int i, count = springls_count(ctx);
    springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A));
    for (i = 0; i < count; i++) sum += d3_distance(d3_of(ctx->model.set.s[i].p), d3_of(ctx->model.set.a[i]));
    return sum / count;
}

TEST deformation_keeps_the_surface_covered(void)
{
    springls_sphere ball = { { 16.8f, 16.8f, 16.8f }, 7.2f };
    motion m = { deform, springls_implicit_sphere, NULL, 48.0f, 1.0f, 30 };
    range with, without;
    true_coverage found;
    springls_context *one, *two;
    m.shape_data = &ball;
    one = moved(m, 1, &with);
    two = moved(m, 0, &without);
    ASSERT_GT(with.least, 0.85);
    ASSERT_LT(with.most, 1.1);
    ASSERT_LT(without.most, 0.6); /* else the test shows nothing */
    found = measure_true_coverage(one);
    ASSERT_GT(found.in_one, 0.88);
    ASSERT_LT(found.in_more, 0.2);
    ASSERT_LT(springls_count(one), 1.02 * springls_count(two));
    ASSERT_LT(mean_tracking(one), 1.3 * mean_tracking(two) + 1e-3);
    springls_destroy(one);
    springls_destroy(two);
    PASS();
}

TEST a_ball_at_rest_in_a_wind_stays_covered(void)
{
    springls_sphere ball = { { 20.0f, 20.0f, 20.0f }, 9.0f };
    motion m = { wind, springls_implicit_sphere, NULL, 40.0f, 1.0f, 16 };
    range coverage;
    true_coverage found;
    springls_context *ctx;
    m.shape_data = &ball;
    ctx = moved(m, 1, &coverage);
    ASSERT_GT(coverage.least, 0.85);
    ASSERT_LT(coverage.most, 1.1);
    found = measure_true_coverage(ctx);
    ASSERT_GT(found.in_one, 0.9);
    ASSERT_LT(found.in_more, 0.2);
    springls_destroy(ctx);
    PASS();
}

TEST a_box_stays_sharp_and_covered(void)
{
    springls_box box = { { 20.2f, 26.1f, 20.0f }, { 6.3f, 5.1f, 6.2f } };
    motion m = { turn, springls_implicit_box, NULL, 40.0f, 1.0f, 48 };
    range coverage[2];
    double error[2] = { 0.0, 0.0 };
    int cover, i;
    m.shape_data = &box;
    for (cover = 0; cover < 2; cover++) {
        springls_context *ctx = moved(m, cover, &coverage[cover]);
        springls_mesh mesh;
        ASSERT_OK(springls_extract_mesh(ctx, &mesh));
        for (i = 0; i < mesh.vertex_count; i++) {
            float d;
            springls_implicit_box(&box, mesh.positions + 3 * i, 1, &d);
            error[cover] += fabs((double)d) / mesh.vertex_count;
        }
        springls_mesh_free(ctx, &mesh);
        springls_destroy(ctx);
    }
    ASSERT_GT(coverage[1].least, 0.85);
    ASSERT_LT(coverage[1].most, 1.2); /* corners of triangles stick out beyond edges */
    ASSERT_LT(error[1], 1.1 * error[0]);
    PASS();
}

/* ---- one springl ---- */

/* Relaxes, and has the springls on the host. */
static springls_status relaxed(springls_context *ctx)
{
    springls_status status = springls_run_stage(ctx, SPRINGLS_STAGE_RELAX);
    return status == SPRINGLS_OK ? springls__ensure_on_host(ctx, SPRINGLS__BIT(S)) : status;
}

/* Adds an equilateral springl in the plane z = 8 with an arm in the direction of an angle. */
static void add_flat(springls_context *ctx, float x, float y, float arm, float angle)
{
    springls__v3 q[3];
    int m;
    for (m = 0; m < 3; m++) {
        float at = angle + 2.0943951f * (float)m;
        q[m] = springls__v3_make(x + arm * cosf(at), y + arm * sinf(at), 8.0f);
    }
    fixture_add(ctx, q[0], q[1], q[2]);
}

/* In a lattice of hexagons a springl's share is its hexagon. Its triangle keeps particle and normal, whatever its size was. */
TEST a_triangle_is_as_large_as_its_share(void)
{
    const float spacing = 0.95f, cell = 0.866025404f * 0.95f * 0.95f;
    int size;
    for (size = 0; size < 3; size++) {
        springls_params p = springls_default_params();
        springls_context *ctx = fixture_context(16, &p);
        springls__springl s;
        d3 middle;
        double area;
        int i, j, m;
        add_flat(ctx, 8.0f, 8.0f, 0.2f + 0.3f * (float)size, 0.3f);
        for (j = -3; j <= 3; j++)
            for (i = -3; i <= 3; i++)
                if (i || j)
                    add_flat(ctx, 8.0f + spacing * ((float)i + 0.5f * (float)j), 8.0f + 0.866025404f * spacing * (float)j, 0.5f,
                             (float)i);
        ASSERT_OK(relaxed(ctx));
        s = ctx->model.set.s[0];
        area = 0.5 * (double)springls__length(springls__tri_area2(springls__springl_tri(s)));
        ASSERT_IN_RANGE(1.04 * (double)cell, area, 0.02);
        middle = d3_make((double)(s.q[0].x + s.q[1].x + s.q[2].x) / 3.0, (double)(s.q[0].y + s.q[1].y + s.q[2].y) / 3.0,
                         (double)(s.q[0].z + s.q[1].z + s.q[2].z) / 3.0);
        ASSERT_LT(d3_distance(middle, d3_of(s.p)), 1e-5);
        for (m = 0; m < 3; m++) ASSERT_IN_RANGE(s.bounding_radius, springls__length(springls__sub(s.q[m], s.p)), 1e-5);
        ASSERT_IN_RANGE(1.0, springls__springl_normal(s).z, 1e-5);
        springls_destroy(ctx);
    }
    PASS();
}

/* With three neighbours its corners turn into the gaps between them. */
TEST corners_turn_between_neighbours(void)
{
    float angle;
    for (angle = -0.9f; angle < 1.0f; angle += 0.3f) {
        springls_params p = springls_default_params();
        springls_context *ctx = fixture_context(16, &p);
        springls__v3 arm;
        int j, k;
        add_flat(ctx, 8.0f, 8.0f, 0.5f, angle);
        for (j = 0; j < 3; j++)
            add_flat(ctx, 8.0f + 0.8f * cosf(2.0943951f * (float)j), 8.0f + 0.8f * sinf(2.0943951f * (float)j), 0.5f, (float)j);
        for (k = 0; k < 4; k++) ASSERT_OK(relaxed(ctx));
        arm = springls__normalize(springls__sub(ctx->model.set.s[0].q[0], ctx->model.set.s[0].p));
        ASSERT_LT(arm.x * (4.0f * arm.x * arm.x - 3.0f), -0.95f); /* cos(3 angle): corners at 60, 180 and 300 degrees */
        springls_destroy(ctx);
    }
    PASS();
}

/* kappa_int has no effect with cover, and has one without. */
TEST internal_springs_do_not_size_it(void)
{
    int cover, stiff, i;
    for (cover = 0; cover < 2; cover++) {
        springls__springl s[2][20];
        bool same;
        for (stiff = 0; stiff < 2; stiff++) {
            springls_params p = springls_default_params();
            springls_context *ctx;
            p.cover = cover;
            p.kappa_int = stiff ? 1.5f : 0.1f;
            ctx = fixture_context(16, &p);
            fixture_seed(3);
            fixture_random_soup(ctx, 20, 6.0f, 9.0f, 1.0f);
            ASSERT_OK(relaxed(ctx));
            for (i = 0; i < 20; i++) s[stiff][i] = ctx->model.set.s[i];
            springls_destroy(ctx);
        }
        same = true;
        for (i = 0; i < 20; i++) same = same && springls__length(springls__sub(s[0][i].q[0], s[1][i].q[0])) < 1e-5f;
        ASSERT_EQ(cover == 1, same);
    }
    PASS();
}

TEST masked_springls_keep_their_triangles(void)
{
    springls_params p = springls_default_params();
    springls_context *ctx = fixture_context(16, &p);
    uint8_t mask[20] = { 0 };
    springls__springl before[20];
    int i;
    fixture_seed(5);
    fixture_random_soup(ctx, 20, 6.0f, 9.0f, 1.0f);
    for (i = 0; i < 20; i++) {
        mask[i] = i % 2 == 0;
        before[i] = ctx->model.set.s[i];
    }
    ASSERT_OK(springls_set_keep_mask(ctx, mask));
    ASSERT_OK(relaxed(ctx));
    for (i = 0; i < 20; i++) ASSERT_EQ(mask[i] != 0, memcmp(&before[i].q, &ctx->model.set.s[i].q, sizeof before[i].q) == 0);
    springls_destroy(ctx);
    PASS();
}

SUITE(cover)
{
    RUN_TEST(a_triangle_is_as_large_as_its_share);
    RUN_TEST(corners_turn_between_neighbours);
    RUN_TEST(internal_springs_do_not_size_it);
    RUN_TEST(masked_springls_keep_their_triangles);
    RUN_TEST(deformation_keeps_the_surface_covered);
    RUN_TEST(a_ball_at_rest_in_a_wind_stays_covered);
    RUN_TEST(a_box_stays_sharp_and_covered);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(cover);
    GREATEST_MAIN_END();
}
