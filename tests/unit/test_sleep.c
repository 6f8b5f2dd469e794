/* test_sleep.c - work follows motion: a model at rest keeps its bits, forces act in their region, and what sleeps wakes. */
#include "fixtures.h"

enum { SIZE = 48 };

/* A tool that pushes what is within its radius, and counts the points that it is given. */
typedef struct tool { float center[3], radius, velocity[3]; } tool;

static void push(void *user, const float *points, int count, float time, float *out)
{
    const tool *t = (const tool *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++) {
        float d2 = 0.0f, weight;
        for (k = 0; k < 3; k++) d2 += (points[3 * i + k] - t->center[k]) * (points[3 * i + k] - t->center[k]);
        weight = springls__max(1.0f - d2 / (t->radius * t->radius), 0.0f);
        for (k = 0; k < 3; k++) out[3 * i + k] = weight * weight * t->velocity[k];
    }
}

/* At the lower x end of the ball of `ball_at_rest`. */
static tool some_tool(void)
{
    tool t = { { 9.0f, 23.5f, 23.5f }, 4.0f, { 0.5f, 0.0f, 0.0f } };
    return t;
}

static springls_step_desc no_motion(void)
{
    springls_step_desc step;
    memset(&step, 0, sizeof step);
    return step;
}

/* A ball of radius 14, after so many steps in which nothing moves. */
static springls_context *resting_ball(int steps)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 23.5f, 23.5f, 23.5f, 14.0f);
    springls_step_desc step = no_motion();
    while (steps-- > 0)
        if (springls_step(ctx, &step) != SPRINGLS_OK) return NULL;
    return ctx;
}

/* Steps that a new ball takes until it is at rest. */
enum { SETTLED = 40 };

TEST a_model_at_rest_keeps_its_bits(void)
{
    springls_context *ctx = resting_ball(SETTLED);
    springls_step_desc step = no_motion();
    uint64_t hash = springls_state_hash(ctx);
    int i;
    ASSERT(ctx->at_rest);
    for (i = 0; i < 12; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_EQ(hash, springls_state_hash(ctx));
        ASSERT_EQ(SETTLED + i + 1, springls_get_stats(ctx).steps);
        ASSERT_EQ_FMT(0.0, (double)springls_get_stats(ctx).largest_displacement, "%g");
    }
    springls_destroy(ctx);
    PASS();
}

/* A velocity that is zero, and forces whose region has no springl, are no motion either. */
TEST forces_that_move_nothing_wake_nothing(void)
{
    springls_context *ctx = resting_ball(SETTLED);
    tool t = some_tool();
    springls_forces forces = fixture_forces(push, &t);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    uint64_t hash = springls_state_hash(ctx);
    t.velocity[0] = 0.0f;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(hash, springls_state_hash(ctx));
    t.velocity[0] = 1.0f;
    forces.region_lower[0] = forces.region_lower[1] = forces.region_lower[2] = 20.0f;
    forces.region_upper[0] = forces.region_upper[1] = forces.region_upper[2] = 27.0f;
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(hash, springls_state_hash(ctx));
    springls_destroy(ctx);
    PASS();
}

/* With a region a step does what it does without, where the force is zero outside. */
TEST a_region_changes_no_bits(int settled)
{
    springls_context *with = resting_ball(settled), *without = resting_ball(settled);
    tool t = some_tool();
    springls_forces forces = fixture_forces(push, &t);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int i, k;
    step.max_displacement = 2.0f;
    for (i = 0; i < 6; i++) {
        memset(forces.region_lower, 0, sizeof forces.region_lower);
        memset(forces.region_upper, 0, sizeof forces.region_upper);
        ASSERT_OK(springls_step(without, &step));
        for (k = 0; k < 3; k++) {
            forces.region_lower[k] = t.center[k] - 5.0f;
            forces.region_upper[k] = t.center[k] + 5.0f;
        }
        ASSERT_OK(springls_step(with, &step));
        ASSERT_EQ(springls_state_hash(without), springls_state_hash(with));
        t.center[1] += 1.0f;
    }
    springls_destroy(with);
    springls_destroy(without);
    PASS();
}

/* Springls outside do not move, whatever the force; the batches have only those inside. */
static int outside;

static void push_batch(void *user, const springls_batch *batch, float *out)
{
    const springls_context *ctx = (const springls_context *)user;
    int i;
    for (i = 0; i < batch->count; i++) {
        if (batch->time == 0.0f && batch->vertex < 0 && batch->points[3 * i] > 20.0f) outside++;
        if (batch->ids[i] != ctx->model.set.id[batch->springls[i]]) outside++;
        if (memcmp(&ctx->model.set.a[batch->springls[i]], batch->correspondences + 3 * i, sizeof(springls__v3)) != 0) outside++;
        out[3 * i] = 0.7f;
        out[3 * i + 1] = out[3 * i + 2] = 0.0f;
    }
}

TEST forces_act_in_their_region(void)
{
    springls_context *ctx = resting_ball(0);
    springls_forces forces;
    springls__v3 *before = (springls__v3 *)malloc((size_t)springls_count(ctx) * sizeof *before);
    springls__model *model = fixture_here(ctx);
    int i, moved = 0;
    memset(&forces, 0, sizeof forces);
    forces.velocity_batch = push_batch;
    forces.user = ctx;
    forces.region_upper[0] = 20.0f;
    forces.region_upper[1] = forces.region_upper[2] = (float)SIZE;
    for (i = 0; i < springls_count(ctx); i++) before[i] = model->set.s[i].p;
    outside = 0;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_EQ(0, outside);
    model = fixture_here(ctx);
    for (i = 0; i < springls_count(ctx); i++) {
        float by = before[i].x <= 20.0f ? 0.7f : 0.0f;
        ASSERT_EQ_FMT((double)(before[i].x + by), (double)model->set.s[i].p.x, "%g");
        moved += by > 0.0f;
    }
    ASSERT_GT(moved, 100);
    forces.region_upper[0] = -1.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_advect(ctx, &forces, 0.0f, 1.0f));
    forces.region_upper[0] = NAN;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_advect(ctx, &forces, 0.0f, 1.0f));
    free(before);
    springls_destroy(ctx);
    PASS();
}

/* A snapshot in the middle of falling asleep goes on with the same bits. */
TEST snapshots_have_the_calm(void)
{
    springls_context *ctx = resting_ball(12), *other = fixture_context(SIZE, NULL);
    springls_step_desc step = no_motion();
    size_t size;
    void *block;
    int i;
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(other, block, size));
    for (i = 0; i < 16; i++) {
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_step(other, &step));
        ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
        ASSERT_EQ(ctx->at_rest, other->at_rest);
    }
    ASSERT(ctx->at_rest);
    free(block);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* What is done to a model at rest wakes it: motion, writing, parameters, stages. */
TEST a_model_at_rest_wakes(void)
{
    springls_context *ctx = resting_ball(SETTLED);
    springls_step_desc step = no_motion();
    springls_params params = springls_get_params(ctx);
    float up[3];
    uint64_t hash = springls_state_hash(ctx);
    int k;
    ASSERT_OK(springls_set_params(ctx, &params));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_FALSE(ctx->at_rest);
    ASSERT(hash != springls_state_hash(ctx));
    for (k = 0; k < SETTLED; k++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT(ctx->at_rest);
    ASSERT_OK(springls_relax(ctx));
    ASSERT_FALSE(ctx->at_rest);
    for (k = 0; k < SETTLED; k++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT(ctx->at_rest);
    for (k = 0; k < 3; k++)
        up[k] = ((const float *)(const void *)((const char *)springls_view_particles(ctx).data))[k] + (k == 2 ? 0.3f : 0.0f);
    hash = springls_state_hash(ctx);
    ASSERT_OK(springls_write(ctx, 0, 1, NULL, up));
    ASSERT_OK(springls_step(ctx, &step));
    ASSERT_FALSE(ctx->at_rest);
    springls_destroy(ctx);
    PASS();
}

SUITE(sleep_suite)
{
    RUN_TEST(a_model_at_rest_keeps_its_bits);
    RUN_TEST(forces_that_move_nothing_wake_nothing);
    RUN_TESTp(a_region_changes_no_bits, 0);
    RUN_TESTp(a_region_changes_no_bits, SETTLED);
    RUN_TEST(forces_act_in_their_region);
    RUN_TEST(snapshots_have_the_calm);
    RUN_TEST(a_model_at_rest_wakes);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(sleep_suite);
    GREATEST_MAIN_END();
}
