/* test_evolve.c - the level set follows the springls (section 4.5), with and without curvature. */
#include "fixtures.h"

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

/* Springls that do justice to the sphere, so that what is measured is the level set. */
static springls_context *fine_sphere(int which, float curvature, float radius)
{
    springls_params p = set_of(which);
    p.initial_stride = 1;
    p.project_initial = 1;
    p.curvature = curvature;
    return fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, radius);
}

static springls_status follow(springls_context *ctx, int times)
{
    springls_status status = SPRINGLS_OK;
    while (status == SPRINGLS_OK && times-- > 0) {
        status = springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE);
        if (status == SPRINGLS_OK) status = springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD);
    }
    return status;
}

/* The front moves to springls that have moved by half a voxel or by 1.2 voxels. One evolution maps the distance d to
   (1 - s) d beyond the zero level and stretches by 1 + s, so a front at distance d comes to d / (1 + s): 4/7 of it is left
   each time with s = 3/4, and first-order differences may add a tenth of a voxel. */
TEST front_follows(float distance, int times)
{
    springls_context *ctx = fine_sphere(0, 0.0f, 8.0f);
    double s = (double)distance / sqrt(3.0);
    fixture_error before, after;
    ASSERT_OK(fixture_translate(ctx, (float)s, (float)s, (float)s));
    before = fixture_sphere_error(ctx, d3_make(15.5 + s, 15.5 + s, 15.5 + s), 8.0);
    ASSERT_GT(before.max, 0.8 * (double)distance);
    ASSERT_OK(follow(ctx, times));
    after = fixture_sphere_error(ctx, d3_make(15.5 + s, 15.5 + s, 15.5 + s), 8.0);
    ASSERT_IN_RANGE(0.0, after.mean, 0.5 * (double)distance * pow(4.0 / 7.0, times) + 0.1);
    ASSERT_IN_RANGE(0.0, after.max, (double)distance * pow(4.0 / 7.0, times) + 0.2);
    springls_destroy(ctx);
    PASS();
}

/* The front moves towards the springls, by s / (1 + s) of the way at once: not away from them, as eq. 23 has it with its
   minus sign. */
TEST springls_attract(void)
{
    springls_context *ctx = fine_sphere(0, 0.0f, 8.0f);
    springls_measures before, after;
    int i, m;
    ASSERT_OK(springls_measure(ctx, &before));
    for (i = 0; i < springls_count(ctx); i++) { /* out by 0.6 */
        springls__springl *s = &fixture_here(ctx)->set.s[i];
        for (m = 0; m < 3; m++)
            s->q[m] = d3_float(d3_mad(d3_make(15.5, 15.5, 15.5), d3_sub(d3_of(s->q[m]), d3_make(15.5, 15.5, 15.5)), 8.6 / 8.0));
        s->p = d3_float(d3_mad(d3_make(15.5, 15.5, 15.5), d3_sub(d3_of(s->p), d3_make(15.5, 15.5, 15.5)), 8.6 / 8.0));
        *s = springls__springl_finished(*s);
    }
    springls__constellation_changed(ctx);
    ASSERT_OK(follow(ctx, 1));
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_IN_RANGE(0.6 * 0.75 / 1.75, cbrt(after.volume * 0.75 / fixture_pi) - cbrt(before.volume * 0.75 / fixture_pi), 0.05);
    springls_destroy(ctx);
    PASS();
}

/* With no springl near, curvature alone acts: lambda > 0 shrinks a sphere by step * lambda * 2/R an iteration, as motion
   by mean curvature should; lambda < 0 lets it grow by as much. */
TEST curvature_smooths(float lambda)
{
    springls_context *ctx = fine_sphere(0, lambda, 8.0f);
    uint8_t *keep = (uint8_t *)calloc((size_t)springls_count(ctx), 1);
    const int times = 16;
    springls_measures measures;
    double r, expected = 8.0;
    int i;
    fixture_keep(ctx, keep);
    free(keep);
    fixture_add(ctx, springls__v3_make(1.0f, 1.0f, 1.0f), springls__v3_make(2.0f, 1.0f, 1.0f), springls__v3_make(1.0f, 2.0f, 1.0f));
    ASSERT_OK(springls_measure(ctx, &measures));
    expected = cbrt(measures.volume * 0.75 / fixture_pi);
    for (i = 0; i < times; i++) expected -= 0.75 * (double)lambda * 2.0 / expected;
    ASSERT_OK(follow(ctx, times));
    ASSERT_OK(springls_measure(ctx, &measures));
    r = cbrt(measures.volume * 0.75 / fixture_pi);
    ASSERT_IN_RANGE(expected, r, 0.15 * fabs(8.0 - expected));
    springls_destroy(ctx);
    PASS();
}

/* Where the springls cover only half of a sphere, the covered half stays while curvature moves the other. */
TEST covered_parts_stay(void)
{
    springls_context *ctx = fine_sphere(0, 0.1f, 8.0f);
    int i, count = springls_count(ctx);
    uint8_t *keep = (uint8_t *)malloc((size_t)count);
    springls_mesh mesh;
    double moved = 0.0;
    int n = 0;
    for (i = 0; i < count; i++) keep[i] = fixture_particle(ctx, i).z < 17.5f;
    fixture_keep(ctx, keep);
    free(keep);
    ASSERT_OK(follow(ctx, 12));
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *x = mesh.positions + 3 * i;
        double off = d3_distance(d3_make((double)x[0], (double)x[1], (double)x[2]), d3_make(15.5, 15.5, 15.5)) - 8.0;
        if (x[2] < 14.0f) ASSERT_IN_RANGE(0.0, off, 0.2); /* curvature and springls balance 0.06 inside */
        if (x[2] > 21.0f) {
            moved -= off;
            n++;
        }
    }
    ASSERT_GT(n, 20);
    ASSERT_GT(moved / n, 0.15);
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* A model at rest stays: fifty evolutions and rebuilds by eq. 23 alone move the zero level by less than a tenth of a
   voxel; fifty steps of the default algorithm, which also projects, by less than a thirtieth. */
TEST rest_is_rest(int which, int shape, double tolerance)
{
    springls_params p = set_of(which);
    springls_context *ctx;
    springls_measures before, after;
    int i;
    p.initial_stride = 1;
    p.project_initial = 1;
    ctx = shape == 0 ? fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 8.0f)
        : shape == 1 ? fixture_torus(32, &p, 9.0f, 4.0f)
                     : fixture_box(32, &p, 7.3f);
    ASSERT_OK(springls_measure(ctx, &before));
    if (which) {
        float still[3] = { 0.0f, 0.0f, 0.0f };
        springls_forces forces = fixture_forces(fixture_wind, still);
        springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
        for (i = 0; i < 50; i++) ASSERT_OK(springls_step(ctx, &step));
    } else {
        ASSERT_OK(follow(ctx, 50));
    }
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_IN_RANGE(0.0, (after.volume - before.volume) / before.area, tolerance); /* the mean shift of the surface */
    ASSERT_EQ(before.components, after.components);
    ASSERT_EQ(before.euler, after.euler);
    if (shape == 0) ASSERT_IN_RANGE(0.0, fixture_sphere_error(ctx, d3_make(15.5, 15.5, 15.5), 8.0).max, 0.2);
    springls_destroy(ctx);
    PASS();
}

/* Only voxels within evolve_width of the zero level change. */
TEST far_voxels_stay(void)
{
    springls_context *ctx = fine_sphere(0, 0.1f, 8.0f);
    float *before = fixture_phi(ctx), *after;
    int i, changed = 0;
    ASSERT_OK(fixture_translate(ctx, 0.7f, 0.0f, 0.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    after = fixture_phi(ctx);
    for (i = 0; i < 32 * 32 * 32; i++) {
        if (fabsf(before[i]) > 1.5f) ASSERT_EQ(before[i], after[i]);
        else changed += before[i] != after[i];
    }
    ASSERT_GT(changed, 1000);
    free(before);
    free(after);
    springls_destroy(ctx);
    PASS();
}

SUITE(evolve)
{
    RUN_TESTp(front_follows, 0.5f, 4);
    RUN_TESTp(front_follows, 1.2f, 4);
    RUN_TESTp(front_follows, 1.2f, 12);
    RUN_TEST(springls_attract);
    RUN_TESTp(curvature_smooths, 0.1f);
    RUN_TESTp(curvature_smooths, -0.1f);
    RUN_TEST(covered_parts_stay);
    RUN_TESTp(rest_is_rest, 0, 0, 0.1);
    RUN_TESTp(rest_is_rest, 0, 1, 0.1);
    RUN_TESTp(rest_is_rest, 0, 2, 0.1);
    RUN_TESTp(rest_is_rest, 1, 0, 0.033);
    RUN_TESTp(rest_is_rest, 1, 1, 0.033);
    RUN_TEST(far_voxels_stay);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(evolve);
    GREATEST_MAIN_END();
}
