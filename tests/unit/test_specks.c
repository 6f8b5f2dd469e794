/* test_specks.c - params.min_component: parts of phi, inside or outside, are removed when the volume that springls_components has
   for them is less, and stay when it is not. */
#include "fixtures.h"

#include "../../kernels_embed/stages/specks.h"

enum { SIZE = 40, ACROSS = 5, BALLS = ACROSS * ACROSS * ACROSS, ORDINARY = 24 };

/* Small balls in a lattice, outside or, as bubbles, inside a large body. */
typedef struct specks { float center[BALLS][3], radius[BALLS]; int bubbles; } specks;

static void balls(void *user, const float *points, int count, float *out)
{
    const specks *s = (const specks *)user;
    int i, k, b;
    for (i = 0; i < count; i++, points += 3) {
        float least = 1e6f;
        for (b = 0; b < BALLS; b++) {
            float r2 = 0.0f;
            for (k = 0; k < 3; k++) r2 += (points[k] - s->center[b][k]) * (points[k] - s->center[b][k]);
            least = fminf(least, sqrtf(r2) - s->radius[b]);
        }
        out[i] = least;
        if (!s->bubbles) continue;
        for (k = 0; k < 3; k++) least = fminf(least, 17.0f - fabsf(points[k] - 0.5f * (float)SIZE)); /* a box around them */
        out[i] = -least;
    }
}

static specks any_specks(int seed, int bubbles)
{
    specks s;
    int b, k, at[3];
    fixture_seed((uint32_t)seed);
    s.bubbles = bubbles;
    for (b = 0; b < BALLS; b++) {
        at[0] = b % ACROSS;
        at[1] = b / ACROSS % ACROSS;
        at[2] = b / ACROSS / ACROSS;
        for (k = 0; k < 3; k++) s.center[b][k] = 6.5f + 6.0f * (float)at[k] + fixture_between(0.0f, 2.0f);
        s.radius[b] = fixture_between(0.2f, 1.3f);
    }
    return s;
}

/* Collects the voxels of one side around a place. */
static int voxels_around(const springls__grid *g, const float center[3], bool inside, int at[][3])
{
    const int reach = 2;
    int x, y, z, n = 0, c[3];
    for (x = 0; x < 3; x++) c[x] = (int)floorf(center[x] + 0.5f);
    for (z = c[2] - reach; z <= c[2] + reach; z++)
        for (y = c[1] - reach; y <= c[1] + reach; y++)
            for (x = c[0] - reach; x <= c[0] + reach; x++)
                if ((springls__grid_phi(g, g->phi, x, y, z) < 0.0f) == inside) {
                    at[n][0] = x;
                    at[n][1] = y;
                    at[n++][2] = z;
                }
    return n;
}

/* The volume by which a stage decides is that of springls_components, and the same bits from whichever voxel it begins. */
TEST parts_are_measured(int bubbles)
{
    springls_params params = springls_default_params();
    int compared = 0, seed;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    for (seed = 1; seed <= 3; seed++) {
        specks s = any_specks(seed, bubbles);
        springls_context *ctx = fixture_context(SIZE, &params);
        const springls_component *parts;
        const springls__model *model;
        int i, k, n, count, at[125][3];
        ASSERT_OK(springls_set_implicit(ctx, balls, &s));
        ASSERT_OK(springls_components(ctx, &parts, &count));
        model = fixture_here(ctx);
        for (i = 0; i < count; i++) {
            float volume = 0.0f;
            if (parts[i].volume > ORDINARY) continue;
            n = voxels_around(&model->grid, parts[i].center, !bubbles, at);
            for (k = 0; k < n; k++) {
                springls__part part;
                ASSERT(springls__find_small_part(&model->grid, at[k], SPRINGLS__LARGEST_SPECK, &part));
                if (part.count < n) break; /* voxels that meet at edges or corners */
                if (k == 0) volume = springls__volume_of_part(&model->grid, &part);
                ASSERT(springls__volume_of_part(&model->grid, &part) == volume);
            }
            if (k < n) continue;
            ASSERT_IN_RANGE(parts[i].volume, (double)volume, 1e-3);
            compared++;
        }
        springls_destroy(ctx);
    }
    ASSERT_GT(compared, 2 * BALLS);
    PASS();
}

/* What a step leaves has at least min_component: what re-distancing moves afterwards is little. */
TEST small_parts_are_removed(int bubbles)
{
    springls_params params = springls_default_params();
    float wind[3] = { 0.3f, 0.2f, 0.1f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int seed;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    for (seed = 1; seed <= 3; seed++) {
        specks s = any_specks(seed, bubbles);
        springls_context *ctx = fixture_context(SIZE, &params);
        const springls_component *parts;
        int i, count, small = 0;
        ASSERT_OK(springls_set_implicit(ctx, balls, &s));
        ASSERT_OK(springls_components(ctx, &parts, &count));
        for (i = 0; i < count; i++) small += parts[i].volume < 1.0;
        ASSERT_GT(small, 10);
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_components(ctx, &parts, &count));
        ASSERT_GT(count, 10);
        for (i = 0; i < count; i++) ASSERT_GT(parts[i].volume, 0.95);
        springls_destroy(ctx);
    }
    PASS();
}

/* A thread along a row of voxels, and a ball. */
static void thread_and_ball(void *user, const float *points, int count, float *out)
{
    const float radius = *(const float *)user;
    int i;
    for (i = 0; i < count; i++, points += 3) {
        const double along = fmin(fmax((double)points[0], 8.0), 16.0);
        const d3 x = d3_make((double)points[0], (double)points[1], (double)points[2]);
        out[i] = (float)fmin(d3_distance(x, d3_make(along, 12.0, 12.0)) - (double)radius,
                             d3_distance(x, d3_make(26.0, 26.0, 26.0)) - 5.0);
    }
}

/* A thread may have many voxels and little volume. */
TEST thin_parts_are_removed(float radius, int stays)
{
    springls_params params = springls_default_params();
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx;
    const springls_component *parts;
    int count;
    params.components = 1;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    ctx = fixture_context(SIZE, &params);
    ASSERT_OK(springls_set_implicit(ctx, thread_and_ball, &radius));
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(2, count);
    ASSERT_EQ(stays, fmin(parts[0].volume, parts[1].volume) >= 1.0);
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_OK(springls_components(ctx, &parts, &count));
    ASSERT_EQ(1 + stays, count);
    springls_destroy(ctx);
    PASS();
}

/* Returns how many springls lie beyond x. */
static int springls_beyond(springls_context *ctx, float x)
{
    const springls_view v = springls_view_particles(ctx);
    int i, n = 0;
    for (i = 0; i < v.count; i++) n += *(const float *)((const char *)v.data + (size_t)i * v.stride) > x;
    return n;
}

/* A drop, and a body far from it. */
static void drop_and_body(void *user, const float *points, int count, float *out)
{
    const double radius = (double)*(const float *)user;
    int i;
    for (i = 0; i < count; i++, points += 3) {
        const d3 x = d3_make((double)points[0], (double)points[1], (double)points[2]);
        out[i] = (float)fmin(d3_distance(x, d3_make(12.0, 16.0, 16.0)) - 6.0, d3_distance(x, d3_make(24.0, 16.0, 16.0)) - radius);
    }
}

/* Springls do not keep what phi has lost, unless it is a sheet: of a drop all go when they are resampled. */
TEST springls_of_removed_parts_go(float radius, float min_component)
{
    const float beyond = 19.0f;
    springls_params params = springls_default_params();
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx;
    int i;
    params.min_component = min_component;
    ctx = fixture_context(SIZE, &params);
    ASSERT_OK(springls_set_implicit(ctx, drop_and_body, &radius));
    ASSERT_GT(springls_beyond(ctx, beyond), 0);
    for (i = 0; i < params.resample_period; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(0, springls_beyond(ctx, beyond));
    ASSERT_GT(springls_count(ctx), 0);
    springls_destroy(ctx);
    PASS();
}

/* Returns how many springls a drop between voxels has after a flow has moved it for a while. */
static int springls_of_moved_drop(float min_component)
{
    springls_params params = springls_default_params();
    float wind[3] = { 0.03f, 0.02f, 0.01f }, radius = 1.05f;
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx;
    int i, left;
    params.min_component = min_component;
    ctx = fixture_context(SIZE, &params);
    if (springls_set_implicit(ctx, drop_and_body, &radius)) return -1;
    for (i = 0; i < 30; i++)
        if (springls_step(ctx, &step)) return -1;
    left = springls_beyond(ctx, 19.0f);
    springls_destroy(ctx);
    return left;
}

/* A drop that phi shows keeps all springls, also those that lie off the zero level. */
TEST springls_of_other_parts_stay(void)
{
    ASSERT_GT(springls_of_moved_drop(1.0f), 8);
    ASSERT_EQ(springls_of_moved_drop(0.0f), springls_of_moved_drop(1.0f));
    PASS();
}

SUITE(parts)
{
    RUN_TEST(springls_of_other_parts_stay);
    RUN_TESTp(springls_of_removed_parts_go, 0.7f, 1.0f);
    RUN_TESTp(springls_of_removed_parts_go, 0.9f, 1.0f);
    RUN_TESTp(springls_of_removed_parts_go, 1.1f, 8.0f);
    RUN_TESTp(thin_parts_are_removed, 0.1f, 0);
    RUN_TESTp(thin_parts_are_removed, 0.4f, 1);
    RUN_TESTp(parts_are_measured, 0);
    RUN_TESTp(parts_are_measured, 1);
    RUN_TESTp(small_parts_are_removed, 0);
    RUN_TESTp(small_parts_are_removed, 1);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(parts);
    GREATEST_MAIN_END();
}
