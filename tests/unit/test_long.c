/* test_long.c - lives of models that last: memory stays steady, volume where the flow keeps it, nothing small is left behind, and
   the bits are the same in another run and after a restore half way. LONG_STEPS and LONG_EDITS set their lengths: make long. */
#include "greatest.h"
#include "long_lives.h"

#include <stdio.h>

enum { LOOKS = 20 }; /* at each of as many parts of a life */

#define ASSERT_OK(call) ASSERT_EQ(SPRINGLS_OK, call)

static int length_of(int kind)
{
    const char *text = getenv(kind == LIFE_FLOW ? "LONG_STEPS" : "LONG_EDITS");
    const int length = text && text[0] ? atoi(text) : kind == LIFE_FLOW ? 200 : 20;
    return length < LOOKS ? LOOKS : length - length % LOOKS;
}

typedef struct half { void *bytes; size_t size; life at; } half; /* a snapshot, and what decides how it goes on */

static greatest_test_res keep_half(const life *l, half *h)
{
    ASSERT_OK(springls_snapshot(l->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &h->size));
    h->bytes = malloc(h->size);
    ASSERT(h->bytes != NULL);
    ASSERT_OK(springls_snapshot(l->ctx, SPRINGLS_SNAPSHOT_KIND_ALL, h->bytes, h->size, &h->size));
    h->at = *l;
    PASS();
}

static void print_look(const life *l, const life_state *first, const life_state *now)
{
    printf("%7d: volume %+.4f %%, %d components, Euler %d, %d springls, %.1f MiB", l->done,
           100.0 * (now->volume / first->volume - 1.0), now->components, now->euler, now->springls,
           (double)now->memory / 1048576.0);
    if (l->kind == LIFE_EDITS) printf(", the smallest part %.1f voxels, %d begun anew", now->smallest, l->restarts);
    printf("\n");
    fflush(stdout);
}

/* Runs a life from its beginning to look number `last`; looks[0] is the beginning. h: NULL, or takes the half. */
static greatest_test_res live(int kind, int length, int last, life_state looks[LOOKS + 1], half *h)
{
    life l;
    int i;
    ASSERT_OK(life_begin(&l, kind));
    ASSERT_OK(life_look(&l, &looks[0]));
    for (i = 1; i <= last; i++) {
        ASSERT_OK(life_go(&l, length / LOOKS));
        ASSERT_OK(life_look(&l, &looks[i]));
        if (GREATEST_IS_VERBOSE()) print_look(&l, &looks[0], &looks[i]);
        if (h && i == LOOKS / 2) CHECK_CALL(keep_half(&l, h));
    }
    life_end(&l);
    PASS();
}

/* Goes on from the half to the end. */
static greatest_test_res live_from_half(const half *h, int length, const life_state looks[LOOKS + 1])
{
    life l;
    life_state state;
    int i;
    ASSERT_OK(life_create(&l, h->at.kind));
    ASSERT_OK(springls_restore(l.ctx, h->bytes, h->size));
    l.done = h->at.done;
    l.random = h->at.random;
    for (i = LOOKS / 2 + 1; i <= LOOKS; i++) {
        ASSERT_OK(life_go(&l, length / LOOKS));
        ASSERT_OK(life_look(&l, &state));
        ASSERT(state.hash == looks[i].hash);
    }
    life_end(&l);
    PASS();
}

/* Bytes for each of the most springls that there were up to a look: bodies may grow, and memory with them. */
static double memory_a_springl(const life_state *looks, int last)
{
    double memory = 0.0, springls = 1.0;
    int i;
    for (i = 1; i <= last; i++) {
        memory = fmax(memory, (double)looks[i].memory);
        springls = fmax(springls, (double)looks[i].springls);
    }
    return memory / springls;
}

TEST a_long_life(int kind)
{
    static life_state looks[LOOKS + 1], again[LOOKS + 1];
    const int length = length_of(kind);
    half h;
    int i;
    CHECK_CALL(live(kind, length, LOOKS, looks, &h));
    ASSERT_LTE(memory_a_springl(looks, LOOKS), 1.25 * memory_a_springl(looks, LOOKS / 2));
    for (i = 1; i <= LOOKS; i++) {
        if (kind == LIFE_FLOW) {
            ASSERT_IN_RANGE(looks[0].volume, looks[i].volume, 0.001 * looks[0].volume);
            ASSERT_EQ_FMT(1, looks[i].components, "%d");
            ASSERT_EQ_FMT(2, looks[i].euler, "%d");
        } else ASSERT_GT(looks[i].smallest, 0.5 * (double)springls_default_params().min_component); /* re-distancing follows */
    }
    CHECK_CALL(live(kind, length, LOOKS / 2, again, NULL)); /* once more to the half, and from there by the snapshot */
    for (i = 0; i <= LOOKS / 2; i++) ASSERT(looks[i].hash == again[i].hash);
    CHECK_CALL(live_from_half(&h, length, looks));
    free(h.bytes);
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
