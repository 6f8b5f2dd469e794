/* test_determinism.c - the same bits for every number of workers, every cut of the work into ranges, and every order of the
   ranges. Compilers and optimisation levels are compared by `make compile-matrix`, threads of OpenMP by `make test-all OPENMP=1`. */
#include "histories.h"
#include "../portability/flush.h"

#ifdef __SANITIZE_THREAD__
enum { MOST_WORKERS = 1 }; /* it looks for races, at twenty times the cost */
#else
enum { MOST_WORKERS = 5 };
#endif

/* The calling thread that does everything at once is the measure; then ranges cut at random, run by as many threads as there are
   workers, and in a random order by one thread. */
TEST workers_do_not_matter(int history)
{
    static const struct { int workers, threads; } with[5] = { { 3, 1 }, { 2, 1 }, { 8, 1 }, { 1, 0 }, { 8, 0 } };
    uint64_t expected = history_run(history, NULL, NULL);
    int i;
    ASSERT(expected != 0);
    for (i = 0; i < MOST_WORKERS; i++) {
        fixture_workers state;
        springls_tasks tasks = fixture_tasks(&state, with[i].workers, with[i].threads);
        ASSERT(expected == history_run(history, &tasks, NULL));
        ASSERT_GT(state.calls, 100);
    }
    PASS();
}

/* A host whose threads flush denormal numbers gets the same bits. */
TEST flushing_denormals_does_not_matter(int history)
{
    uint64_t expected = history_run(history, NULL, NULL), flushed;
    bool is_flushing;
    if (!flush_denormals(true)) SKIPm("this processor's float unit is unknown here");
    is_flushing = denormals_are_flushed();
    flushed = history_run(history, NULL, NULL);
    flush_denormals(false);
    ASSERT(is_flushing && !denormals_are_flushed());
    ASSERT(expected == flushed);
    PASS();
}

/* A device leaves what scalar code leaves, each time. */
TEST the_device_does_not_matter(int history)
{
    uint64_t expected = history_run(history, NULL, NULL);
    int i;
    ASSERT(expected != 0);
    for (i = 0; i < 2; i++) {
        uint64_t kernels = fixture_kernels();
        ASSERT(expected == history_run(history, NULL, fixture_backend()));
        ASSERT_GT(fixture_kernels() - kernels, 100);
    }
    PASS();
}

/* Different lives leave different digests: they see something. */
TEST histories_differ(void)
{
    uint64_t digest[HISTORIES];
    int i, j;
    for (i = 0; i < HISTORIES; i++) {
        digest[i] = history_run(i, NULL, fixture_backend());
        for (j = 0; j < i; j++) ASSERT(digest[i] != digest[j]);
    }
    PASS();
}

/* The state hash sees one bit anywhere: of a particle, a correspondence, an id, a voxel. */
TEST hash_sees_every_bit(void)
{
    springls_context *ctx = fixture_sphere(24, NULL, 11.5f, 11.5f, 11.5f, 6.0f);
    uint64_t hash = springls_state_hash(ctx);
    int i = springls_count(ctx) / 2, slot, k;
    springls__model *model = fixture_here(ctx);
    unsigned char *byte[4];
    slot = model->grid.active[model->grid.active_count / 2];
    byte[0] = (unsigned char *)&model->set.s[i].p.y;
    byte[1] = (unsigned char *)&model->set.a[i].z;
    byte[2] = (unsigned char *)&model->set.id[i];
    byte[3] = (unsigned char *)&model->grid.phi[slot * SPRINGLS__BRICK_VOXELS + 77];
    for (k = 0; k < 4; k++) {
        *byte[k] ^= 1u;
        ASSERT(hash != springls_state_hash(ctx));
        *byte[k] ^= 1u;
        ASSERT(hash == springls_state_hash(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

/* Whoever builds without -ffp-contract=off can find out. */
TEST build_does_not_fuse(void)
{
    ASSERT(!springls_fp_contract_detected());
    PASS();
}

SUITE(determinism)
{
    int history;
    for (history = 0; history < HISTORIES; history++)
        if (fixture_backend()) RUN_TESTp(the_device_does_not_matter, history);
        else RUN_TESTp(workers_do_not_matter, history);
    for (history = 0; history < HISTORIES; history++)
        if (!fixture_backend()) RUN_TESTp(flushing_denormals_does_not_matter, history);
    RUN_TEST(histories_differ);
    RUN_TEST(hash_sees_every_bit);
    RUN_TEST(build_does_not_fuse);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(determinism);
    GREATEST_MAIN_END();
}
