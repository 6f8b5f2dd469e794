/* test_long.c - models that live long keep their memory, in a flow their volume and topology, under edits no small component, and
   have the same bits in another run and after a restore half way. LONG_STEPS and LONG_EDITS set the lengths: make long. */
#include "greatest.h"
#include "long_lives.h"

#include <stdio.h>

enum { CHECKPOINTS = 20 }; /* in a life */

#define ASSERT_OK(call) ASSERT_EQ(SPRINGLS_OK, call)

static int length_of(int kind)
{
    const char *text = getenv(kind == LIFE_FLOW ? "LONG_STEPS" : "LONG_EDITS");
    const int length = text && text[0] ? atoi(text) : kind == LIFE_FLOW ? 200 : 40; /* in 20 edits bodies only grow */
    return length < CHECKPOINTS ? CHECKPOINTS : length - length % CHECKPOINTS;
}

/* A life half way: its snapshot, and what decides how it goes on. */
typedef struct half_way { void *snapshot; size_t size; life at; } half_way;

static greatest_test_res keep_half_way(const life *l, half_way *half)
{
    ASSERT_OK(springls_snapshot(l->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &half->size));
    half->snapshot = malloc(half->size);
    ASSERT(half->snapshot != NULL);
    ASSERT_OK(springls_snapshot(l->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, half->snapshot, half->size, &half->size));
    half->at = *l;
    PASS();
}

static void print_checkpoint(const life *l, const life_state *first, const life_state *now)
{
    printf("%7d: volume %+.4f %%, %d components, Euler %d, %d springls, %.1f MiB", l->done,
           100.0 * (now->volume / first->volume - 1.0), now->components, now->euler, now->springls,
           (double)now->memory / 1048576.0);
    if (l->kind == LIFE_EDITS) printf(", smallest component %.1f voxels, %d restarts", now->smallest, l->restarts);
    printf("\n");
    fflush(stdout);
}

/* Runs a life from its beginning, states[0], to checkpoint `last`. half: takes what continues it half way; may be NULL. */
static greatest_test_res live(int kind, int length, int last, life_state states[CHECKPOINTS + 1], half_way *half)
{
    life l;
    int i;
    ASSERT_OK(life_begin(&l, kind));
    ASSERT_OK(life_measure(&l, &states[0]));
    for (i = 1; i <= last; i++) {
        ASSERT_OK(life_advance(&l, length / CHECKPOINTS));
        ASSERT_OK(life_measure(&l, &states[i]));
        if (GREATEST_IS_VERBOSE()) print_checkpoint(&l, &states[0], &states[i]);
        if (half && i == CHECKPOINTS / 2) CHECK_CALL(keep_half_way(&l, half));
    }
    life_end(&l);
    PASS();
}

/* Continues a life half way to its end, and compares the states. */
static greatest_test_res live_from_half_way(const half_way *half, int length, const life_state states[CHECKPOINTS + 1])
{
    life l;
    life_state state;
    int i;
    ASSERT_OK(life_create(&l, half->at.kind));
    ASSERT_OK(springls_restore(l.ctx, half->snapshot, half->size));
    l.done = half->at.done;
    l.random = half->at.random;
    for (i = CHECKPOINTS / 2 + 1; i <= CHECKPOINTS; i++) {
        ASSERT_OK(life_advance(&l, length / CHECKPOINTS));
        ASSERT_OK(life_measure(&l, &state));
        ASSERT(state.hash == states[i].hash);
    }
    life_end(&l);
    PASS();
}

/* Returns the most memory up to a checkpoint over the most springls: bodies may grow, and memory with them. */
static double memory_per_springl(const life_state *states, int last)
{
    double memory = 0.0, springls = 1.0;
    int i;
    for (i = 1; i <= last; i++) {
        memory = fmax(memory, (double)states[i].memory);
        springls = fmax(springls, (double)states[i].springls);
    }
    return memory / springls;
}

TEST a_long_life(int kind)
{
    static life_state states[CHECKPOINTS + 1], again[CHECKPOINTS + 1];
    const int length = length_of(kind);
    const double least = 0.5 * (double)springls_default_params().min_component; /* re-distancing changes volumes after removal */
    half_way half;
    int i;
    CHECK_CALL(live(kind, length, CHECKPOINTS, states, &half));
    ASSERT_LTE(memory_per_springl(states, CHECKPOINTS), 1.25 * memory_per_springl(states, CHECKPOINTS / 2));
    for (i = 1; i <= CHECKPOINTS; i++) {
        if (kind == LIFE_FLOW) {
            ASSERT_IN_RANGE(states[0].volume, states[i].volume, 0.001 * states[0].volume);
            ASSERT_EQ_FMT(1, states[i].components, "%d");
            ASSERT_EQ_FMT(2, states[i].euler, "%d");
        } else ASSERT_GT(states[i].smallest, least);
    }
    CHECK_CALL(live(kind, length, CHECKPOINTS / 2, again, NULL));
    for (i = 0; i <= CHECKPOINTS / 2; i++) ASSERT(states[i].hash == again[i].hash);
    CHECK_CALL(live_from_half_way(&half, length, states));
    free(half.snapshot);
    PASS();
}

SUITE(lives)
{
    RUN_TESTp(a_long_life, LIFE_FLOW);
    RUN_TESTp(a_long_life, LIFE_EDITS);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(lives);
    GREATEST_MAIN_END();
}
