/* test_tiling_memory.c - snapshots of many bodies, and memory that runs out. */
#include "fixtures.h"
#include "tilings.h"

/* ---- snapshots ---- */

/* A tiling goes on from a snapshot with the same bits: another one with other bodies, and the same one after a body has vanished. What
   readers have asked before does not matter. */
TEST snapshots_go_on(void)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *other = tiling_of_size(BALL, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_context *kept;
    part ball = part_at(12.0f, 11.0f, 12.0f, 3.5f, 0);
    char *all, *frame, *again, *delta;
    size_t all_size, frame_size, size;
    uint64_t begun, end;
    int i;
    three_labels(labels, BALL, 6.0f);
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 1));
    ASSERT_OK(springls_tiling_add_implicit(other, 70, part_of_ball, &ball));
    step.velocity = swirl;
    step.dt = 0.125f;
    for (i = 0; i < 5; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    begun = springls_tiling_state_hash(tiling);
    ASSERT_OK(springls_tiling_copy_labels(tiling, labels));
    all = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &all_size);
    frame = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_FRAME, &frame_size);
    ASSERT(frame_size > 1000 && frame_size < all_size);
    kept = springls_tiling_body(other, 70);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(other, frame, frame_size));
    ASSERT_EQ(1, springls_tiling_count(other));
    ASSERT_OK(springls_tiling_restore(other, all, all_size));
    ASSERT_EQ(3, springls_tiling_count(other));
    ASSERT(springls_tiling_body(other, 70) == kept);
    ASSERT(springls_tiling_state_hash(other) == begun);
    again = block_of(other, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    ASSERT_EQ(all_size, size);
    ASSERT_MEM_EQ(all, again, size);
    for (i = 0; i < 6; i++) {
        ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        ASSERT_OK(springls_tiling_step(other, &step, NULL));
    }
    end = springls_tiling_state_hash(tiling);
    ASSERT(end != begun && springls_tiling_state_hash(other) == end);
    ASSERT_OK(springls_tiling_restore(other, frame, frame_size));
    for (i = 0; i < 6; i++) ASSERT_OK(springls_tiling_step(other, &step, NULL));
    ASSERT(springls_tiling_state_hash(other) == end);
    free(again);
    again = block_of(other, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    delta = (char *)malloc(size + 64);
    ASSERT_OK(springls_snapshot_delta(kept, again, size, all, all_size, delta, size + 64, &frame_size));
    ASSERT_LT(frame_size, all_size);
    free(again);
    free(delta);
    free(all);
    free(frame);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(other);
    PASS();
}

/* Gives a block the checksum of what it has. */
static void seal(char *block, size_t size)
{
    uint64_t word, chain[4], i, k, count = (size - 32) / 8;
    for (k = 0; k < 4; k++) chain[k] = (uint64_t)size ^ (14695981039346656037u + k);
    for (i = 0; i < count; i++) {
        memcpy(&word, block + 32 + 8 * i, 8);
        chain[i % 4] = (chain[i % 4] ^ word) * 1099511628211u;
        if (i < count / 4 * 4) chain[i % 4] ^= chain[i % 4] >> 29;
    }
    for (k = 1; k < 4; k++) chain[0] = (chain[0] ^ chain[k]) * 1099511628211u + (uint64_t)(size - 32);
    memcpy(block + 24, chain, 8);
}

/* Blocks that are altered, or of something else, are refused, and leave the tiling as it is; those without bodies are good. */
TEST bad_snapshots_are_refused(void)
{
    springls_tiling *tiling = tiling_of_size(BALL, NULL), *larger = tiling_of_size(SIZE, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    char *block, *bad, *none;
    size_t size, none_size, i, at, model;
    uint64_t bytes;
    uint64_t hash;
    int32_t number;
    float value = 1e30f;
    none = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &none_size);
    ASSERT_OK(set_two_halves(tiling, 4.0f));
    ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    hash = springls_tiling_state_hash(tiling);
    block = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &size);
    bad = (char *)malloc(size);
    memcpy(bad, block, size);
    seal(bad, size);
    ASSERT_MEM_EQ(block, bad, size);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(NULL, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, (springls_snapshot_kind)2, NULL, 0, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, bad, size - 1, &at));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_restore(NULL, block, size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_tiling_restore(tiling, NULL, size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(larger, block, size));
    ASSERT(strstr(springls_tiling_last_error(larger), "another grid"));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(springls_tiling_body(tiling, 4), block, size));
    for (i = 0; i < 200; i++) { /* any byte, in places all over the block */
        at = i < 100 ? i : (size_t)(((uint64_t)size * (i - 100u)) / 100u);
        memcpy(bad, block, size);
        bad[at] = (char)(bad[at] ^ 4);
        ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size));
        if (at >= 32) seal(bad, size); /* what is made to deceive may be good, but has no effects that are not */
        if (at >= 32 && at < 100) springls_tiling_restore(tiling, bad, size);
        ASSERT_OK(springls_tiling_restore(tiling, block, size));
        ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, block, at));
    }
    for (at = 32; memcmp(block + at, "BODY", 4) != 0; at += 8) continue;
    memcpy(bad, block, size);
    number = 4;
    memcpy(bad + at + 16, &number, 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* the first label is 0 */
    for (at = 32; memcmp(block + at, "tiling.facing", 13) != 0; at += 8) continue;
    memcpy(bad, block, size);
    memcpy(bad + at + 48, &value, 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* the model's own checksum */
    for (model = at; memcmp(block + model, "BODY", 4) != 0; model -= 8) continue;
    memcpy(&bytes, block + model + 8, sizeof bytes);
    seal(bad + model + 24, (size_t)bytes - 8);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size)); /* no label */
    memcpy(bad, block, size);
    memcpy(bad + 32, "NEWS", 4);
    seal(bad, size);
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_tiling_restore(tiling, bad, size));
    ASSERT(hash == springls_tiling_state_hash(tiling));
    ASSERT_OK(springls_tiling_restore(tiling, none, none_size));
    ASSERT_EQ(0, springls_tiling_count(tiling));
    ASSERT(!springls_tiling_body(tiling, 0));
    ASSERT_OK(springls_tiling_restore(tiling, block, size));
    ASSERT(hash == springls_tiling_state_hash(tiling));
    free(block);
    free(bad);
    free(none);
    springls_tiling_destroy(tiling);
    springls_tiling_destroy(larger);
    PASS();
}

/* ---- memory that runs out ---- */

enum { CALL_tiling_create, CALL_tiling_set_labels, CALL_tiling_add_implicit, CALL_tiling_add_mesh, CALL_tiling_facing, CALL_tiling_step,
       CALL_first_step, CALL_tiling_join, CALL_tiling_sample_labels, CALL_tiling_copy_labels, CALL_tiling_measure, CALL_tiling_extract,
       CALL_tiling_closest_wall,       CALL_tiling_snapshot, CALL_tiling_restore, CALLS };

/* A block of bodies that tilings which are to be starved do not have, but for label 3. */
static char *restored;
static size_t restored_size;

static void make_restored(void)
{
    springls_tiling *tiling = tiling_of_size(BALL, NULL);
    part one = part_at(12.0f, 12.0f, 12.0f, 4.5f, 1), other = part_at(12.0f, 12.0f, 12.0f, 4.5f, -1);
    if (springls_tiling_add_implicit(tiling, 3, part_of_ball, &one) == SPRINGLS_OK
        && springls_tiling_add_implicit(tiling, 5, part_of_ball, &other) == SPRINGLS_OK)
        restored = block_of(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, &restored_size);
    springls_tiling_destroy(tiling);
}

static springls_film all_join(void *user, int32_t low, int32_t high, float *rupture_thickness)
{
    (void)user;
    (void)low;
    *rupture_thickness = high == 70 ? 0.3f : 0.0f;
    return SPRINGLS_FILM_JOIN;
}

static springls_status call_of(springls_tiling *tiling, int call)
{
    static int32_t labels[BALL_VOXELS];
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_measures measures[8];
    springls_walls walls;
    springls_status status;
    float point[3] = { 12.0f, 12.0f, 12.0f };
    part ball = part_at(18.9f, 18.7f, 18.8f, 2.5f, 0);
    static const float corners[12] = { 16.0f, 16.0f, 16.0f, 21.0f, 16.0f, 16.0f, 16.0f, 21.0f, 16.0f, 16.0f, 16.0f, 21.0f };
    static const int faces[12] = { 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3 };
    springls_tiling_hold hold;
    springls_wall_hit hit;
    char *block;
    size_t size;
    memset(&hold, 0, sizeof hold);
    hold.label = 70;
    step.velocity = swirl;
    step.dt = 1.0f;
    step.wall_period = 1;
    step.tension = 0.1f;
    step.held = &hold;
    step.held_count = call == CALL_first_step;
    step.film = call == CALL_first_step ? all_join : NULL;
    switch (call) {
    case CALL_tiling_set_labels: three_labels(labels, BALL, 3.6f); return springls_tiling_set_labels(tiling, labels, 1);
    case CALL_tiling_add_implicit: return springls_tiling_add_implicit(tiling, 12, part_of_ball, &ball);
    case CALL_tiling_add_mesh: return springls_tiling_add_mesh(tiling, 12, corners, 4, 0, faces, 4, NULL);
    case CALL_tiling_closest_wall: return springls_tiling_closest_wall(tiling, point, 1, &hit);
    case CALL_tiling_facing: return springls_tiling_facing(tiling, 3, labels);
    case CALL_tiling_join: return springls_tiling_join(tiling, 70, 3);
    case CALL_first_step:
    case CALL_tiling_step: return springls_tiling_step(tiling, &step, NULL);
    case CALL_tiling_sample_labels: return springls_tiling_sample_labels(tiling, point, 1, labels);
    case CALL_tiling_copy_labels: return springls_tiling_copy_labels(tiling, labels);
    case CALL_tiling_measure: return springls_tiling_measure(tiling, measures);
    case CALL_tiling_snapshot:
        status = springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size);
        block = status == SPRINGLS_OK ? (char *)malloc(size) : NULL;
        if (block) status = springls_tiling_snapshot(tiling, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size);
        free(block);
        return status;
    case CALL_tiling_restore: return springls_tiling_restore(tiling, restored, restored_size);
    case CALL_tiling_extract:
        status = springls_tiling_extract(tiling, &walls);
        springls_walls_free(tiling, &walls);
        return status;
    default: return SPRINGLS_OK;
    }
}

/* Makes a tiling that has moved, and lets allocation number k of a call fail, or all from there on. *failed: it did. */
static greatest_test_res starve(int call, int k, bool for_good, bool *failed)
{
    fixture_heap heap;
    springls_desc desc = fixture_desc(BALL, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_status status;
    uint64_t before;
    int i;
    desc.allocator = fixture_allocator(&heap);
    heap.fail_on = for_good;
    if (call == CALL_tiling_create) heap.fail_at = k;
    status = springls_tiling_create(&desc, &tiling);
    step.velocity = swirl;
    step.dt = 0.5f;
    if (call != CALL_tiling_create) {
        ASSERT_OK(call_of(tiling, CALL_tiling_set_labels));
        for (i = 0; i < 7 && call == CALL_tiling_step; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
        before = springls_tiling_state_hash(tiling);
        heap.fail_at = heap.calls + k;
        status = call_of(tiling, call);
        if (status != SPRINGLS_OK) {
            ASSERT_GT(strlen(springls_tiling_last_error(tiling)), 0u);
            ASSERT(before == springls_tiling_state_hash(tiling));
        }
    }
    *failed = heap.calls > heap.fail_at;
    ASSERT(status == SPRINGLS_OK || (*failed && status == SPRINGLS_OUT_OF_MEMORY));
    heap.fail_at = -1;
    if (tiling) ASSERT_EQ(heap.bytes, springls_tiling_memory_used(tiling));
    if (status != SPRINGLS_OK && tiling) ASSERT_OK(call_of(tiling, call));
    springls_tiling_destroy(tiling);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(0, heap.wrong_sizes);
    PASS();
}

/* Each allocation of a step and of create fails, and of other calls the first ones and every 37th. */
TEST allocations_may_fail(int call)
{
    bool failed = true;
    int k, total = 0;
    for (k = 0; failed; k += k < 4 || call == CALL_tiling_step || call == CALL_tiling_create ? 1 : 37) {
        CHECK_CALL(starve(call, k, true, &failed));
        CHECK_CALL(starve(call, k, false, &failed));
        total += failed;
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d\n", total);
    ASSERT(total > 0 || call == CALL_tiling_sample_labels || call == CALL_tiling_snapshot); /* these may need none */
    PASS();
}

/* Small bodies have memory as small: a ball of 250 springls less than half a MiB between steps, wherever it lies in the grid. Models of one
   alone have more: of the bricks that its input was made of, and of stages. */
TEST small_bodies_are_small(void)
{
    enum { PITCH = 14, ROW = 3, SIDE = 8 + PITCH * ROW };
    static int32_t labels[SIDE * SIDE * SIDE];
    springls_desc desc = fixture_desc(SIDE, NULL);
    springls_tiling *tiling = NULL;
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    size_t largest = 0;
    int i, k;
    desc.backend = NULL; /* with one, steps keep original surfaces, too */
    ASSERT_OK(springls_tiling_create(&desc, &tiling));
    for (i = 0; i < SIDE * SIDE * SIDE; i++) {
        int at[3], cell[3];
        double r2 = 0.0;
        for (k = 0; k < 3; k++) {
            at[k] = (k == 0 ? i % SIDE : k == 1 ? i / SIDE % SIDE : i / (SIDE * SIDE)) - 4;
            cell[k] = at[k] < 0 ? 0 : at[k] / PITCH < ROW ? at[k] / PITCH : ROW - 1;
            r2 += (at[k] - PITCH * (cell[k] + 0.5)) * (at[k] - PITCH * (cell[k] + 0.5));
        }
        labels[i] = r2 < 16.0 ? 1 + cell[0] + ROW * (cell[1] + ROW * cell[2]) : 0;
    }
    ASSERT_OK(springls_tiling_set_labels(tiling, labels, 2));
    step.dt = 0.125f;
    for (i = 0; i < 12; i++) ASSERT_OK(springls_tiling_step(tiling, &step, NULL));
    ASSERT_EQ(ROW * ROW * ROW, springls_tiling_count(tiling));
    for (i = 1; i <= ROW * ROW * ROW; i++) {
        const size_t bytes = springls_memory_used(springls_tiling_body(tiling, i));
        if (bytes > largest) largest = bytes;
    }
    if (GREATEST_IS_VERBOSE())
        printf("  at most %.0f KiB a body, %d springls\n", (double)largest / 1024.0, springls_count(springls_tiling_body(tiling, 14)));
    ASSERT_LT((double)largest, 480.0 * 1024.0);
    springls_tiling_destroy(tiling);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int call;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(snapshots_go_on);
    RUN_TEST(bad_snapshots_are_refused);
    make_restored();
    for (call = 0; call < CALLS; call++) RUN_TESTp(allocations_may_fail, call);
    free(restored);
    RUN_TEST(small_bodies_are_small);
    GREATEST_MAIN_END();
}
