/* test_curvature.c - motion by curvature has its true speed: as a force, and as the term of eq. 22. */
#include "fixtures.h"

static springls_params set_of(int which) { return which ? springls_default_params() : springls_paper_params(); }

/* Mean distance of the particles from a place. */
static double mean_radius(springls_context *ctx, d3 center)
{
    double sum = 0.0;
    int i;
    for (i = 0; i < springls_count(ctx); i++) sum += d3_distance(d3_of(fixture_particle(ctx, i)), center);
    return sum / springls_count(ctx);
}

/* dR/dt = -2/R: a ball of radius R has sqrt(R^2 - 4 t) after the time t. */
TEST balls_shrink_as_they_should(int which, float radius, float time, float dt, float place, double tolerance)
{
    springls_params p = set_of(which);
    springls_context *ctx = fixture_sphere(32, &p, place, 15.5f, 15.5f, radius);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, dt);
    forces.curvature_weight = 1.0f;
    ASSERT_OK(springls_run(ctx, &step, (int)(time / dt + 0.5f)));
    ASSERT_IN_RANGE(sqrt((double)(radius * radius - 4.0f * time)), mean_radius(ctx, d3_make((double)place, 15.5, 15.5)),
                    tolerance);
    springls_destroy(ctx);
    PASS();
}

/* A weight scales the time, and a callback beside it brings the springls to the host: the motion stays the same. */
static void no_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)user, (void)points, (void)normals, (void)time;
    memset(out, 0, (size_t)count * sizeof *out);
}

TEST weights_scale_time(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 10.0f);
    springls_forces forces = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.3f);
    forces.curvature_weight = 0.5f;
    forces.pressure = no_pressure;
    ASSERT_OK(springls_run(ctx, &step, 60));
    ASSERT_IN_RANGE(8.0, mean_radius(ctx, d3_make(15.5, 15.5, 15.5)), 0.01);
    springls_destroy(ctx);
    PASS();
}

/* A torus with the radii 9 and 4 about the z axis. */
static void torus(void *user, const float *points, int count, float *out)
{
    (void)user;
    for (; count-- > 0; points += 3) {
        double ring = hypot((double)points[0] - 19.6, (double)points[1] - 19.5) - 9.0;
        *out++ = (float)(hypot(ring, (double)points[2] - 19.4) - 4.0);
    }
}

/* The curvature of a torus differs from place to place: 1/4 along its small circle, and along the other one the share of the
   normal that points from the axis, over the distance to it. The surface has been moved to and fro before, so that phi is what
   springls carry. */
TEST a_torus_moves_by_its_curvature(void)
{
    float wind[3] = { 0.3f, 0.2f, -0.3f };
    springls_desc desc = fixture_desc(40, NULL);
    springls_context *ctx;
    springls_forces forces = fixture_forces(fixture_wind, wind), curvature = fixture_forces(NULL, NULL);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    double sum = 0.0, sum2 = 0.0;
    fixture_springl *before;
    int i, count;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, torus, NULL));
    for (i = 0; i < 10; i++) {
        forces.velocity_weight = i % 2 ? -1.0f : 1.0f;
        ASSERT_OK(springls_step(ctx, &step));
    }
    before = fixture_copy(ctx);
    count = springls_count(ctx);
    curvature.curvature_weight = 1.0f;
    curvature.integrator = SPRINGLS_INTEGRATOR_EULER;
    ASSERT_OK(springls_advect(ctx, &curvature, 0.0f, 0.1f));
    for (i = 0; i < count; i++) {
        d3 p = d3_sub(d3_of(before[i].p), d3_make(19.6, 19.5, 19.4));
        d3 now = d3_sub(d3_of(fixture_particle(ctx, i)), d3_make(19.6, 19.5, 19.4));
        double from_axis = hypot(p.x, p.y), ring = from_axis - 9.0, small = hypot(ring, p.z);
        double expected = 1.0 / small + ring / small / from_axis;
        double error = (small - hypot(hypot(now.x, now.y) - 9.0, now.z)) / 0.1 - expected;
        sum += error;
        sum2 += error * error;
    }
    ASSERT_IN_RANGE(0.0, sum / count, 0.003);
    ASSERT_IN_RANGE(0.0, sqrt(sum2 / count), 0.03);
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* Where springls carry the level set, lambda of eq. 22 moves both by evolve_step lambda times the curvature in each step, along
   with the forces: here a wind blows the ball to and fro. Without lambda it stays; a negative one lets it grow. */
TEST lambda_moves_what_springls_carry(float lambda, springls_mode mode)
{
    springls_params p = springls_default_params();
    float wind[3] = { 0.3f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 0.5f);
    const int steps = 40;
    springls_context *ctx;
    springls_measures measures;
    double expected = sqrt(64.0 - 4.0 * 0.75 * (double)lambda * steps);
    int i;
    p.curvature = lambda;
    ctx = fixture_sphere(32, &p, 15.5f, 15.5f, 15.5f, 8.0f);
    for (i = 0; i < steps; i++) {
        forces.velocity_weight = i % 2 ? -1.0f : 1.0f;
        ASSERT_OK(springls_step(ctx, &step));
    }
    ASSERT_IN_RANGE(expected, mean_radius(ctx, d3_make(15.5, 15.5, 15.5)), 0.02);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_IN_RANGE(expected, cbrt(measures.volume * 0.75 / fixture_pi), 0.06); /* chords lie inside */
    springls_destroy(ctx);
    PASS();
}

/* It does not depend on dt, moves nothing in springls_advect, and takes at most half of max_displacement. */
TEST lambda_is_a_rate_a_step(void)
{
    springls_params p = springls_default_params();
    float none[3] = { 0.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, none);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.0f);
    springls_context *ctx;
    p.curvature = 0.2f;
    ctx = fixture_sphere(24, &p, 11.5f, 11.5f, 11.5f, 6.0f);
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_EQ(0.0f, springls_get_stats(ctx).largest_displacement);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_IN_RANGE(0.15 * 2.0 / 6.0, springls_get_stats(ctx).largest_displacement, 0.003);
    step.dt = 1.0f;
    step.max_displacement = 0.04f;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_GT(0.02f, springls_get_stats(ctx).largest_displacement);
    ASSERT_EQ(2, springls_get_stats(ctx).steps);
    springls_destroy(ctx);
    PASS();
}

SUITE(curvature)
{
    RUN_TESTp(balls_shrink_as_they_should, 1, 10.0f, 9.0f, 0.15f, 15.5f, 0.01);
    RUN_TESTp(balls_shrink_as_they_should, 1, 10.0f, 9.0f, 0.9f, 15.2f, 0.015);
    RUN_TESTp(balls_shrink_as_they_should, 1, 5.0f, 2.1f, 0.15f, 15.8f, 0.01);
    RUN_TESTp(balls_shrink_as_they_should, 1, 3.0f, 0.7f, 0.1f, 15.4f, 0.01);
    RUN_TESTp(balls_shrink_as_they_should, 0, 10.0f, 9.0f, 0.3f, 15.5f, 0.03);
    RUN_TEST(weights_scale_time);
    RUN_TEST(a_torus_moves_by_its_curvature);
    RUN_TESTp(lambda_moves_what_springls_carry, 0.1f, SPRINGLS_MODE_FLUID);
    RUN_TESTp(lambda_moves_what_springls_carry, 0.0f, SPRINGLS_MODE_FLUID);
    RUN_TESTp(lambda_moves_what_springls_carry, -0.1f, SPRINGLS_MODE_FLUID);
    RUN_TESTp(lambda_moves_what_springls_carry, 0.1f, SPRINGLS_MODE_ELASTIC);
    RUN_TEST(lambda_is_a_rate_a_step);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(curvature);
    GREATEST_MAIN_END();
}
