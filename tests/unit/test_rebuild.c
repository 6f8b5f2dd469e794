/* test_rebuild.c - phi becomes a distance again without moving, and the narrow band moves with the surface (Table 2). */
#include "fixtures.h"

static const d3 middle = { 15.5, 15.5, 15.5 };

static double sphere_distance(d3 x) { return d3_distance(x, middle) - 8.0; }

static double box_distance(d3 x)
{
    d3 q = d3_make(fabs(x.x - 15.5) - 7.3, fabs(x.y - 15.5) - 7.3, fabs(x.z - 15.5) - 7.3);
    double in = fmax(q.x, fmax(q.y, q.z));
    return in <= 0.0 ? in : sqrt(pow(fmax(q.x, 0.0), 2.0) + pow(fmax(q.y, 0.0), 2.0) + pow(fmax(q.z, 0.0), 2.0));
}

static double torus_distance(d3 x)
{
    double ring = hypot(x.x - 15.5, x.y - 15.5) - 9.0;
    return hypot(ring, x.z - 15.5) - 4.0;
}

static springls_context *shape(int which)
{
    return which == 0   ? fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f)
           : which == 1 ? fixture_torus(32, NULL, 9.0f, 4.0f)
                        : fixture_box(32, NULL, 7.3f);
}

static double exact_distance(int which, d3 x)
{
    return which == 0 ? sphere_distance(x) : which == 1 ? torus_distance(x) : box_distance(x);
}

/* phi times a smooth positive factor between 1/2 and 2: the same zero level, another function. */
static void distort(springls_context *ctx)
{
    springls__grid *g = &fixture_here(ctx)->grid;
    int i, v;
    for (i = 0; i < g->active_count; i++) {
        int o[3];
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            double x = o[0] + (v & 7), y = o[1] + (v >> 3 & 7), z = o[2] + (v >> 6);
            double factor = exp2(sin(0.11 * x + 0.2) * cos(0.09 * y) * sin(0.1 * z + 1.0));
            g->phi[g->active[i] * SPRINGLS__BRICK_VOXELS + v] *= (float)factor;
        }
    }
}

/* Mean and largest distance of the zero level to the shape. */
static fixture_error zero_level(springls_context *ctx, int which)
{
    fixture_error error;
    springls_mesh mesh;
    int i;
    memset(&error, 0, sizeof error);
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK) return error;
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *x = mesh.positions + 3 * i;
        double d = exact_distance(which, d3_make((double)x[0], (double)x[1], (double)x[2]));
        error.mean += d / mesh.vertex_count; /* with its sign: the shift */
        error.max = fmax(error.max, fabs(d));
    }
    error.count = mesh.vertex_count;
    springls_mesh_free(ctx, &mesh);
    return error;
}

/* A distorted phi is a distance again: |grad phi| is 1 in the band and phi is the distance to the exact shape, up to
   what first-order differences can do; no voxel changes sides and the zero level does not shift. */
TEST distance_is_restored(int which, double mean_error, double max_error)
{
    springls_context *ctx = shape(which);
    springls__grid *g = &ctx->model.grid;
    float *before, *after;
    double sum = 0.0, worst = 0.0, slope = 0.0;
    int i, n = 0, slopes = 0;
    fixture_error error;
    distort(ctx);
    before = fixture_phi(ctx);
    for (i = 0; i < 2; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    after = fixture_phi(ctx);
    for (i = 0; i < 32 * 32 * 32; i++) {
        d3 x = d3_make(i % 32, i / 32 % 32, i / 1024);
        double exact = exact_distance(which, x);
        ASSERT_EQ(before[i] < 0.0f, after[i] < 0.0f);
        if (fabs(exact) > 2.5) continue;
        sum += fabs((double)after[i] - exact);
        worst = fmax(worst, fabs((double)after[i] - exact));
        n++;
        if (fabs(exact) < 2.0 && which == 0) {
            springls__v3 gradient = springls__grid_gradient(g, g->phi, d3_float(x));
            slope += fabs((double)springls__length(gradient) - 1.0);
            slopes++;
        }
    }
    ASSERT_GT(n, 1000);
    ASSERT_IN_RANGE(0.0, sum / n, mean_error);
    ASSERT_IN_RANGE(0.0, worst, max_error);
    if (which == 0) ASSERT_IN_RANGE(0.0, slope / slopes, 0.06);
    error = zero_level(ctx, which);
    ASSERT_IN_RANGE(0.0, error.mean, 0.02);
    free(before);
    free(after);
    springls_destroy(ctx);
    PASS();
}

/* Rebuilding a distance again and again leaves it where it is: the surface does not creep. */
TEST rebuilding_does_not_creep(int which)
{
    springls_context *ctx = shape(which);
    springls_measures before, after;
    int i;
    ASSERT_OK(springls_measure(ctx, &before));
    for (i = 0; i < 50; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_IN_RANGE(0.0, (after.volume - before.volume) / before.area, 0.01);
    ASSERT_EQ(before.euler, after.euler);
    if (which < 2) ASSERT_IN_RANGE(0.0, zero_level(ctx, which).max, 0.05); /* a box has edges to round */
    springls_destroy(ctx);
    PASS();
}

/* What is left of parts that have vanished, voxels with a small phi of the side that all around them have, gets the
   distance to the surface. */
TEST remnants_vanish(void)
{
    springls_context *ctx = shape(0);
    springls__grid *g = &fixture_here(ctx)->grid;
    int i, x = 18, y = 15;
    fixture_seed(71);
    for (i = 0; i < 3; i++) /* within 3 to 6 voxels of the surface at z = 7.5, beside each other */
        g->phi[springls__slot_at(g, x + i, y, 11) * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x + i, y, 11)] =
            fixture_between(-0.2f, -0.01f);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    fixture_here(ctx);
    for (i = 0; i < 3; i++) ASSERT_LT(springls__grid_voxel(g, g->phi, x + i, y, 11), -1.0f);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    fixture_here(ctx);
    for (i = 0; i < 3; i++) {
        double exact = sphere_distance(d3_make(x + i, y, 11));
        ASSERT_IN_RANGE(exact, springls__grid_voxel(g, g->phi, x + i, y, 11), 0.15);
    }
    springls_destroy(ctx);
    PASS();
}

/* Every voxel within the band lies in a brick of its own values; bricks that the band does not come near are constant,
   on the right side; clamped values reach one voxel beyond the band. */
static greatest_test_res check_band(springls_context *ctx, d3 center, double radius)
{
    springls__grid *g = &fixture_here(ctx)->grid;
    const int n = g->size[0];
    int x, y, z, i, dropped = 0;
    for (z = 0; z < n; z++)
        for (y = 0; y < n; y++)
            for (x = 0; x < n; x++) {
                double d = d3_distance(d3_make(x, y, z), center) - radius;
                float phi = springls__grid_phi(g, g->phi, x, y, z);
                if (fabs(d) < 2.6) {
                    ASSERT(springls__slot_of_voxel(g, x, y, z) >= SPRINGLS__FIRST_SLOT);
                    ASSERT_IN_RANGE(d, phi, 0.45);
                }
                ASSERT((phi < 0.0f) == (d < 0.0) || fabs(d) < 0.2);
                ASSERT(fabsf(phi) <= 4.0f);
                if (fabs(d) > 4.5) ASSERT(fabsf(phi) > 3.0f);
            }
    for (i = 0; i < g->bricks[0] * g->bricks[1] * g->bricks[2]; i++) {
        double closest = DBL_MAX;
        int v;
        for (v = 0; v < 1000; v++) { /* the brick and the voxels around it */
            d3 at = d3_make(8 * (i % g->bricks[0]) + v % 10 - 1, 8 * (i / g->bricks[0] % g->bricks[1]) + v / 10 % 10 - 1,
                            8 * (i / (g->bricks[0] * g->bricks[1])) + v / 100 - 1);
            closest = fmin(closest, fabs(d3_distance(at, center) - radius));
        }
        if (closest > 3.5) {
            ASSERT(springls__slot_of_brick(g, i) < SPRINGLS__FIRST_SLOT);
            dropped++;
        }
    }
    ASSERT_GT(dropped, 0);
    PASS();
}

/* The band covers the surface, is dropped elsewhere, and goes with the surface as it moves. */
TEST band_moves_with_the_surface(void)
{
    springls_sphere sphere = fixture_ball(15.5f, 23.5f, 23.5f, 8.0f);
    springls_params p = springls_default_params();
    springls_context *ctx;
    float wind[3] = { 1.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.5f);
    int i, bricks;
    p.lazy_distance = 0.0f; /* else phi follows when it is read by a call */
    ctx = fixture_context(48, &p);
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    CHECK_CALL(check_band(ctx, d3_make(15.5, 23.5, 23.5), 8.0));
    bricks = springls_get_stats(ctx).bricks;
    for (i = 0; i < 32; i++) ASSERT_OK(springls_step(ctx, &step));
    CHECK_CALL(check_band(ctx, d3_make(31.5, 23.5, 23.5), 8.0));
    ASSERT_IN_RANGE(bricks, springls_get_stats(ctx).bricks, 0.2 * bricks);
    springls_destroy(ctx);
    PASS();
}

/* A surface that leaves the domain is closed half a voxel beyond the last voxel centres. */
TEST border_closes_the_surface(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 2.0f, 11.5f, 22.0f, 7.0f);
    springls_mesh mesh;
    springls__mesh_report report;
    int i;
    for (i = 0; i < 3; i++) ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    report = fixture_report(&mesh);
    ASSERT_EQ(0, report.boundary_edges);
    ASSERT_EQ(1, report.components);
    ASSERT_EQ(2, report.euler);
    ASSERT_IN_RANGE(-0.5, report.lo[0], 1e-4);
    ASSERT_IN_RANGE(23.5, report.hi[2], 1e-4);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* A model that fills the grid wholly, or a model of one voxel, is still closed. */
TEST extremes_are_closed(void)
{
    int k, i;
    for (k = 0; k < 2; k++) {
        springls_context *ctx = fixture_of_zero_level(fixture_context(12, NULL));
        float phi[12 * 12 * 12];
        springls_measures measures;
        for (i = 0; i < 12 * 12 * 12; i++) phi[i] = k ? (i == 5 + 12 * (6 + 12 * 7) ? -0.5f : 0.5f) : -5.0f;
        ASSERT_OK(springls_set_level_set(ctx, phi));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT_EQ(1, measures.components);
        ASSERT_EQ(2, measures.euler);
        if (k == 0) ASSERT_IN_RANGE(12.0 * 12.0 * 12.0, measures.volume, 30.0); /* edges and corners are cut a little */
        springls_destroy(ctx);
    }
    PASS();
}

SUITE(rebuild)
{
    RUN_TESTp(distance_is_restored, 0, 0.08, 0.4);
    RUN_TESTp(distance_is_restored, 1, 0.08, 0.4);
    RUN_TESTp(distance_is_restored, 2, 0.08, 0.8);
    RUN_TESTp(rebuilding_does_not_creep, 0);
    RUN_TESTp(rebuilding_does_not_creep, 1);
    RUN_TESTp(rebuilding_does_not_creep, 2);
    RUN_TEST(remnants_vanish);
    RUN_TEST(band_moves_with_the_surface);
    RUN_TEST(border_closes_the_surface);
    RUN_TEST(extremes_are_closed);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(rebuild);
    GREATEST_MAIN_END();
}
