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
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
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

/* ---- a tool that moves a part of a model ---- */

/* Pushes the ball in for so many steps, the tool going up. awake: nothing sleeps. */
static springls_status stroke(springls_context *ctx, int steps, int awake)
{
    tool t = some_tool();
    springls_forces forces = fixture_forces(push, &t);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    int k;
    step.max_displacement = 2.0f;
    t.center[1] -= 3.0f;
    for (; steps > 0; steps--) {
        t.center[1] += 0.5f;
        for (k = 0; k < 3; k++) {
            forces.region_lower[k] = t.center[k] - t.radius;
            forces.region_upper[k] = t.center[k] + t.radius;
        }
        if (awake) springls__wake_all(ctx);
        SPRINGLS__TRY(springls_step(ctx, &step));
    }
    return SPRINGLS_OK;
}

/* Takes a small ball out at the same end, and goes on for some steps. */
static springls_status cut_ball_out(springls_context *ctx)
{
    springls_sphere ball = fixture_ball(10.0f, 23.5f, 23.5f, 5.0f);
    springls_step_desc step = no_motion();
    int i;
    SPRINGLS__TRY(springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &ball));
    for (i = 0; i < 4; i++) SPRINGLS__TRY(springls_step(ctx, &step));
    return SPRINGLS_OK;
}

TEST far_from_a_tool_all_bits_stay(int cut)
{
    const size_t voxels = (size_t)SIZE * SIZE * SIZE;
    springls_context *ctx = resting_ball(SETTLED);
    int count = springls_count(ctx), i, m = 0, far_away = 0, changed = 0;
    springls__springl *before = (springls__springl *)malloc((size_t)count * sizeof *before);
    uint32_t *ids = (uint32_t *)malloc((size_t)count * sizeof *ids);
    float *phi = (float *)malloc(2 * voxels * sizeof *phi);
    springls__model *model;
    size_t v;
    ASSERT(ctx->at_rest);
    ASSERT_OK(springls_copy_level_set(ctx, phi));
    model = &ctx->model;
    ASSERT_OK(springls__ensure_on_host(ctx, SPRINGLS__SET_BITS));
    memcpy(before, model->set.s, (size_t)count * sizeof *before);
    memcpy(ids, model->set.id, (size_t)count * sizeof *ids);
    ASSERT_OK(cut ? cut_ball_out(ctx) : stroke(ctx, 30, 0));
    ASSERT_OK(springls_copy_level_set(ctx, phi + voxels));
    ASSERT_OK(springls__ensure_on_host(ctx, SPRINGLS__SET_BITS));
    for (i = 0; i < model->set.count; i++) {
        while (m < count && ids[m] < model->set.id[i]) m++;
        if (m == count) break;
        if (ids[m] != model->set.id[i]) continue;
        if (before[m].p.x < 32.0f) {
            changed += memcmp(&before[m], &model->set.s[i], sizeof *before) != 0;
            continue;
        }
        far_away++;
        ASSERT_EQ(0, memcmp(&before[m], &model->set.s[i], sizeof *before));
    }
    for (v = 0; v < voxels; v++)
        if (v % SIZE >= 32) ASSERT_EQ_FMT((double)phi[v], (double)phi[voxels + v], "%g");
    ASSERT_GT(far_away, 300);
    ASSERT_GT(changed, 200 - 100 * cut);
    free(before);
    free(ids);
    free(phi);
    springls_destroy(ctx);
    PASS();
}

/* Springls that sleep differ from ones that are kept awake by what relaxing at rest moves to and fro. */
TEST a_model_asleep_is_near_one_awake(void)
{
    const size_t voxels = (size_t)SIZE * SIZE * SIZE;
    springls_context *asleep = resting_ball(SETTLED), *awake = resting_ball(SETTLED);
    float *phi = (float *)malloc(2 * voxels * sizeof *phi);
    double sum = 0.0, most = 0.0;
    int near_zero = 0;
    size_t v;
    ASSERT_OK(stroke(asleep, 30, 0));
    ASSERT_OK(stroke(awake, 30, 1));
    ASSERT_OK(springls_copy_level_set(asleep, phi));
    ASSERT_OK(springls_copy_level_set(awake, phi + voxels));
    for (v = 0; v < voxels; v++) {
        double by = fabs((double)phi[v] - (double)phi[voxels + v]);
        if (fabs((double)phi[v]) > 1.0) continue;
        near_zero++;
        sum += by;
        if (by > most) most = by;
    }
    ASSERT_LT(sum / near_zero, 0.004);
    ASSERT_LT(most, 0.1);
    ASSERT_IN_RANGE((double)springls_count(awake), (double)springls_count(asleep), 0.01 * springls_count(awake));
    free(phi);
    springls_destroy(asleep);
    springls_destroy(awake);
    PASS();
}

/* The same bits for every division of loops, and on the host. */
TEST sleep_does_not_depend_on_threads(void)
{
    springls_sphere ball = fixture_ball(23.5f, 23.5f, 23.5f, 14.0f);
    springls_context *ctx = resting_ball(SETTLED), *other = NULL;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_step_desc step = no_motion();
    fixture_workers workers;
    int i;
    desc.backend = NULL;
    desc.tasks = fixture_tasks(&workers, 3, 1);
    ASSERT_OK(springls_create(&desc, &other));
    ASSERT_OK(springls_set_implicit(other, springls_implicit_sphere, &ball));
    for (i = 0; i < SETTLED; i++) ASSERT_OK(springls_step(other, &step));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    ASSERT_OK(stroke(ctx, 30, 0));
    ASSERT_OK(stroke(other, 30, 0));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* A snapshot of a model of which a part sleeps goes on with the same bits. */
TEST snapshots_have_what_sleeps(void)
{
    springls_context *ctx = resting_ball(SETTLED), *other = fixture_context(SIZE, NULL);
    springls_step_desc step = no_motion();
    size_t size;
    void *block;
    int i;
    ASSERT_OK(stroke(ctx, 17, 0));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(other, block, size));
    for (i = 0; i < 2; i++) {
        ASSERT_OK(stroke(ctx, 16, 0));
        ASSERT_OK(stroke(other, 16, 0));
        ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
        ASSERT_OK(springls_step(ctx, &step));
        ASSERT_OK(springls_step(other, &step));
        ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    }
    free(block);
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* An octant touches a brick when its voxels and the brick's have a corner in common. */
TEST octants_beside_a_brick_touch_it(void)
{
    int d, o, k;
    for (d = 0; d < 27; d++) {
        const int away[3] = {d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1};
        for (o = 0; o < SPRINGLS__OCTANTS; o++) {
            bool touches = true;
            for (k = 0; k < 3; k++) {
                const int from = 8 * away[k] + 4 * (o >> k & 1);
                touches = touches && from <= 8 && from + 4 >= 0;
            }
            ASSERT_EQ(touches, springls__octants_beside(d) >> o & 1);
        }
    }
    PASS();
}

SUITE(sleep_suite)
{
    RUN_TEST(octants_beside_a_brick_touch_it);
    RUN_TEST(a_model_at_rest_keeps_its_bits);
    RUN_TEST(forces_that_move_nothing_wake_nothing);
    RUN_TESTp(a_region_changes_no_bits, 0);
    RUN_TESTp(a_region_changes_no_bits, SETTLED);
    RUN_TEST(forces_act_in_their_region);
    RUN_TEST(snapshots_have_the_calm);
    RUN_TEST(a_model_at_rest_wakes);
    RUN_TESTp(far_from_a_tool_all_bits_stay, 0);
    RUN_TESTp(far_from_a_tool_all_bits_stay, 1);
    RUN_TEST(a_model_asleep_is_near_one_awake);
    RUN_TEST(sleep_does_not_depend_on_threads);
    RUN_TEST(snapshots_have_what_sleeps);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(sleep_suite);
    GREATEST_MAIN_END();
}
