/* test_not_finite.c - NaN and infinity are refused in every input, by the same name and sentence, whatever flags the library was
   compiled with: tests/portability/host.sh links this with libraries of -Ofast. */
#include "fixtures.h"

enum { SIZE = 16, VOXELS = SIZE * SIZE * SIZE };

static const float bad_floats[3] = { NAN, INFINITY, -INFINITY };

/* Whether the call failed with the status and gave the reason. */
static int refused(const springls_context *ctx, springls_status status, springls_status expected, const char *reason)
{
    if (status == expected && strstr(springls_last_error(ctx), reason)) return 1;
    printf("\n  %s: \"%s\"", springls_status_string(status), springls_last_error(ctx));
    return 0;
}
#define ASSERT_REFUSED(ctx, call, status, reason) ASSERTm(#call, refused(ctx, call, status, reason))
#define ASSERT_ARGUMENT(ctx, call, reason) ASSERT_REFUSED(ctx, call, SPRINGLS_INVALID_ARGUMENT, reason)
#define ASSERT_NUMBER(ctx, call, reason) ASSERT_REFUSED(ctx, call, SPRINGLS_NON_FINITE, reason)

static springls_context *ball(void) { return fixture_sphere(SIZE, NULL, 7.5f, 7.5f, 7.5f, 4.0f); }

/* All members of the parameters that are floats, by their places. */
TEST parameters(float bad)
{
    static const size_t places[] = {
        offsetof(springls_params, d_max), offsetof(springls_params, particle_radius), offsetof(springls_params, neighbor_radius),
        offsetof(springls_params, sharpness), offsetof(springls_params, kappa_int), offsetof(springls_params, kappa_ext),
        offsetof(springls_params, relax_step_length), offsetof(springls_params, relax_step_rotation),
        offsetof(springls_params, contract_distance), offsetof(springls_params, min_angle), offsetof(springls_params, max_angle),
        offsetof(springls_params, min_area), offsetof(springls_params, merge_distance), offsetof(springls_params, split_edge),
        offsetof(springls_params, split_area), offsetof(springls_params, band_half_width), offsetof(springls_params, capture_range),
        offsetof(springls_params, evolve_step), offsetof(springls_params, evolve_width), offsetof(springls_params, curvature),
        offsetof(springls_params, lazy_distance), offsetof(springls_params, min_component), offsetof(springls_params, nearest_rule),
        offsetof(springls_params, track_step)
    };
    springls_context *ctx = ball();
    size_t i;
    for (i = 0; i < sizeof places / sizeof *places; i++) {
        springls_params params = springls_default_params();
        springls_desc desc = springls_default_desc();
        memcpy((char *)&params + places[i], &bad, sizeof bad);
        ASSERT_ARGUMENT(ctx, springls_set_params(ctx, &params), "is not in");
        desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = SIZE;
        desc.params = &params;
        ASSERT(strstr(springls_create_error(&desc), "is not in"));
    }
    springls_destroy(ctx);
    PASS();
}

TEST grids(double bad)
{
    springls_desc desc = springls_default_desc();
    springls_context *ctx;
    double *const numbers[3] = { desc.grid.origin, desc.grid.spacing, desc.grid.direction };
    const int counts[3] = { 3, 3, 9 };
    int kind, i;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = SIZE;
    for (kind = 0; kind < 3; kind++)
        for (i = 0; i < counts[kind]; i++) {
            const double good = numbers[kind][i];
            numbers[kind][i] = bad;
            ASSERT(strncmp(springls_create_error(&desc), "grid.", 5) == 0);
            ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, &ctx));
            numbers[kind][i] = good;
        }
    ASSERT_STR_EQ("", springls_create_error(&desc));
    PASS();
}

TEST steps_and_forces(float bad)
{
    springls_context *ctx = ball();
    const uint64_t before = springls_state_hash(ctx);
    float wind[3] = { 0.2f, 0.0f, 0.0f }, speed, data[3] = { 0.0f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, bad);
    float *const weights[4] = { &forces.pressure_weight, &forces.velocity_weight, &forces.affine_weight, &forces.curvature_weight };
    bool done;
    int i;
    ASSERT_ARGUMENT(ctx, springls_step(ctx, &step), "dt is");
    step.dt = 1.0f;
    step.max_displacement = bad;
    ASSERT_ARGUMENT(ctx, springls_step(ctx, &step), "max_displacement is");
    step.max_displacement = 0.0f;
    if (springls__is_nan_float(bad)) ASSERT_ARGUMENT(ctx, springls_step_continue(ctx, (double)bad, &done), "seconds are NaN");
    ASSERT_ARGUMENT(ctx, springls_advect(ctx, &forces, bad, 1.0f), "time is");
    ASSERT_ARGUMENT(ctx, springls_advect(ctx, &forces, 0.0f, bad), "dt is");
    ASSERT_ARGUMENT(ctx, springls_max_speed(ctx, &forces, bad, &speed), "time is");
    for (i = 0; i < 4; i++) { /* also those of forces that there are none of */
        *weights[i] = bad;
        ASSERT_ARGUMENT(ctx, springls_advect(ctx, &forces, 0.0f, 1.0f), "_weight is");
        ASSERT_ARGUMENT(ctx, springls_step(ctx, &step), "_weight is");
        ASSERT_ARGUMENT(ctx, springls_max_speed(ctx, &forces, 0.0f, &speed), "_weight is");
        *weights[i] = 0.0f;
    }
    forces.region_upper[2] = bad;
    ASSERT_ARGUMENT(ctx, springls_step(ctx, &step), "ascending and finite");
    forces.region_upper[2] = 0.0f;
    forces.velocity_grid.data = data;
    forces.velocity_grid.grid.size[0] = forces.velocity_grid.grid.size[1] = forces.velocity_grid.grid.size[2] = 1;
    forces.velocity_grid.grid.origin[1] = (double)bad;
    ASSERT_ARGUMENT(ctx, springls_step(ctx, &step), "grid.origin");
    springls_set_time(ctx, (double)bad);
    ASSERT_EQ(0.0, springls_time(ctx));
    ASSERT_EQ(before, springls_state_hash(ctx));
    /* what a callback answers */
    forces.velocity_grid.data = NULL;
    wind[1] = bad;
    ASSERT_NUMBER(ctx, springls_step(ctx, &step), "a force is NaN");
    ASSERT_NUMBER(ctx, springls_max_speed(ctx, &forces, 0.0f, &speed), "a force is NaN");
    springls_destroy(ctx);
    PASS();
}

static void bad_distance(void *bad, const float *points, int count, float *out)
{
    int i;
    (void)points;
    for (i = 0; i < count; i++) out[i] = *(const float *)bad;
}

TEST surfaces(float bad)
{
    static const int triangles[12] = { 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3 };
    float corners[12] = { 4, 4, 4, 11, 4, 4, 4, 11, 4, 4, 4, 11 }, phi[VOXELS], springl[9] = { 4, 4, 4, 5, 4, 4, 4, 5, 4 };
    springls_context *ctx = fixture_context(SIZE, NULL);
    int i;
    for (i = 0; i < VOXELS; i++) phi[i] = 2.0f;
    phi[VOXELS / 2] = bad;
    ASSERT_NUMBER(ctx, springls_set_level_set(ctx, phi), "is not finite");
    if (bad != bad) ASSERT_NUMBER(ctx, springls_set_implicit(ctx, bad_distance, &bad), "is NaN");
    if (bad != bad) ASSERT_ARGUMENT(ctx, springls_set_threshold(ctx, phi, bad, 5.0f), "is not below");
    if (bad != bad) ASSERT_ARGUMENT(ctx, springls_set_threshold(ctx, phi, 1.0f, bad), "is not below");
    for (i = 0; i < 12; i++) {
        const float good = corners[i];
        corners[i] = bad;
        ASSERT_NUMBER(ctx, springls_set_mesh(ctx, corners, 4, 0, triangles, 4, NULL), "is not finite");
        corners[i] = good;
    }
    for (i = 0; i < 9; i++) {
        const float good = springl[i];
        springl[i] = bad;
        ASSERT_NUMBER(ctx, springls_set_springls(ctx, springl, NULL, NULL, 1), "springl 0 is NaN");
        springl[i] = good;
    }
    ASSERT_EQ(0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

TEST changes_and_questions(float bad)
{
    springls_context *ctx = ball();
    const uint64_t before = springls_state_hash(ctx);
    springls_chunks_desc desc;
    springls_chunks *chunks;
    springls_hit hit;
    float x[9] = { 0, 0, 0, 0, 0, 0, 0, 0, 0 }, out[3], *values = (float *)calloc((size_t)springls_count(ctx), sizeof *values);
    springls_attribute_desc attribute;
    memset(&attribute, 0, sizeof attribute);
    attribute.name = "heat";
    attribute.channels = 1;
    memset(&desc, 0, sizeof desc);
    desc.tolerance = bad;
    x[1] = bad;
    values[springls_count(ctx) - 1] = bad;
    ASSERT_NUMBER(ctx, springls_add_attribute(ctx, &attribute, values, NULL), "is not finite");
    ASSERT_NUMBER(ctx, springls_write(ctx, 0, 1, x, NULL), "is NaN");
    ASSERT_NUMBER(ctx, springls_sample_distance(ctx, x, 1, out), "is not finite");
    ASSERT_NUMBER(ctx, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, 1, &hit), "is not finite");
    ASSERT_NUMBER(ctx, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, x + 3, x, 1, 0.0f, &hit), "is not finite");
    if (bad != INFINITY) ASSERT_ARGUMENT(ctx, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, x + 3, x + 3, 1, bad, &hit), "max_distance");
    ASSERT_ARGUMENT(ctx, springls_offset(ctx, bad), "a distance of");
    ASSERT_ARGUMENT(ctx, springls_smooth(ctx, bad, false), "a length of");
    ASSERT_ARGUMENT(ctx, springls_chunks_create(ctx, &desc, &chunks), "tolerance");
    ASSERT_EQ(before, springls_state_hash(ctx));
    free(values);
    springls_destroy(ctx);
    PASS();
}

SUITE(not_finite)
{
    int i;
    for (i = 0; i < 3; i++) {
        RUN_TESTp(parameters, bad_floats[i]);
        RUN_TESTp(grids, (double)bad_floats[i]);
        RUN_TESTp(steps_and_forces, bad_floats[i]);
        RUN_TESTp(surfaces, bad_floats[i]);
        RUN_TESTp(changes_and_questions, bad_floats[i]);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(not_finite);
    GREATEST_MAIN_END();
}
