#define _POSIX_C_SOURCE 200809L
/* test_threads.c - the library's pool of threads: the same bits for any number of them, loops at the same time and inside each
   other, threads that get no processor, and systems that refuse threads or memory. */
#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <stdlib.h>
#include <unistd.h>

#if !defined(SPRINGLS_THREADS)
#define SPRINGLS_THREADS
#endif

/* ---- a copy of the pool whose system refuses and delays on demand ---- */

static int refuse_after;  /* so many things are given; negative: all */
static bool gate_is_shut; /* threads that are started wait before they do anything */
static pthread_mutex_t gate_lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t gate_changed = PTHREAD_COND_INITIALIZER;

static bool refused(void) { return refuse_after >= 0 && refuse_after-- == 0; }

static void *test_calloc(size_t count, size_t size) { return refused() ? NULL : calloc(count, size); }

static int test_mutex_init(pthread_mutex_t *mutex) { return refused() ? 1 : pthread_mutex_init(mutex, NULL); }

static int test_cond_init(pthread_cond_t *condition) { return refused() ? 1 : pthread_cond_init(condition, NULL); }

static void wait_at_gate(void)
{
    pthread_mutex_lock(&gate_lock);
    while (gate_is_shut) pthread_cond_wait(&gate_changed, &gate_lock);
    pthread_mutex_unlock(&gate_lock);
}

static void set_gate(bool is_shut)
{
    pthread_mutex_lock(&gate_lock);
    gate_is_shut = is_shut;
    pthread_cond_broadcast(&gate_changed);
    pthread_mutex_unlock(&gate_lock);
}

typedef struct late_start { void *(*start)(void *); void *arg; } late_start;

static void *start_late(void *user)
{
    late_start late = *(late_start *)user;
    free(user);
    wait_at_gate();
    return late.start(late.arg);
}

static int test_thread_create(pthread_t *thread, void *(*start)(void *), void *arg)
{
    late_start *late = refused() ? NULL : (late_start *)malloc(sizeof *late);
    if (!late) return 1;
    late->start = start;
    late->arg = arg;
    return pthread_create(thread, NULL, start_late, late);
}

#define springls_threads_create test_threads_create
#define springls_threads_destroy test_threads_destroy
#define springls_threads_count test_threads_count
#define springls_threads_tasks test_threads_tasks
#define SPRINGLS_API __attribute__((weak)) extern
#define calloc(count, size) test_calloc(count, size)
#define pthread_mutex_init(mutex, none) test_mutex_init(mutex)
#define pthread_cond_init(condition, none) test_cond_init(condition)
#define pthread_create(thread, none, start, arg) test_thread_create(thread, start, arg)
#include "../../src/runtime/threads.h"
#undef calloc
#undef pthread_mutex_init
#undef pthread_cond_init
#undef pthread_create
#undef SPRINGLS_API

#include "histories.h"

static springls_threads *new_pool(int count)
{
    springls_threads *pool = springls_threads_create(count);
    if (pool && springls_threads_count(pool) != count) printf("\n  this system has started fewer threads\n");
    return pool;
}

/* ---- the bits of models ---- */

TEST the_number_of_threads_does_not_matter(int history)
{
    static const int counts[4] = { 1, 2, 3, 8 };
    uint64_t expected = history_run(history, NULL, NULL);
    int i;
    ASSERT(expected != 0);
    for (i = 0; i < 4; i++) {
        springls_threads *pool = new_pool(counts[i]);
        springls_tasks tasks = springls_threads_tasks(pool);
        ASSERT(pool && tasks.parallel_for);
        ASSERT(expected == history_run(history, &tasks, NULL));
        springls_threads_destroy(pool);
    }
    PASS();
}

/* ---- ranges ---- */

typedef struct ranges {
    pthread_mutex_t lock;
    uint8_t *seen; /* how often each element came; NULL: they are too many */
    int64_t elements;
    int count, grain, calls, wrong;
} ranges;

static void note_range(void *arg, int begin, int end)
{
    ranges *r = (ranges *)arg;
    int i;
    pthread_mutex_lock(&r->lock);
    r->calls++;
    r->elements += end - begin;
    if (begin < 0 || begin >= end || end > r->count || (end - begin < r->grain && end != r->count)) r->wrong++;
    for (i = begin; r->seen && i < end; i++) r->seen[i]++;
    pthread_mutex_unlock(&r->lock);
}

/* Returns a loop's ranges; `wrong` is 0 where they are what springls_tasks promises. */
static ranges loop_ranges(springls_threads *pool, int count, int grain, uint8_t *seen)
{
    springls_tasks tasks = springls_threads_tasks(pool);
    ranges r = { PTHREAD_MUTEX_INITIALIZER, NULL, 0, 0, 0, 0, 0 };
    int i;
    r.seen = seen;
    r.count = count;
    r.grain = grain;
    for (i = 0; seen && i < count; i++) seen[i] = 0;
    tasks.parallel_for(tasks.user, count, grain, note_range, &r);
    for (i = 0; seen && i < count; i++) r.wrong += seen[i] != 1;
    return r;
}

TEST ranges_cover_each_element_once(void)
{
    static const int pools[3] = { 1, 2, 5 }, grains[6] = { INT32_MIN, 0, 1, 7, 300, INT32_MAX };
    static uint8_t seen[5000];
    int p, g, count;
    for (p = 0; p < 3; p++) {
        springls_threads *pool = new_pool(pools[p]);
        ASSERT(pool);
        for (g = 0; g < 6; g++) {
            for (count = 1; count <= 5000; count = count < 20 ? count + 1 : 3 * count - 1)
                ASSERT_EQ(0, loop_ranges(pool, count, grains[g], seen).wrong);
            ASSERT_EQ(0, loop_ranges(pool, 0, grains[g], NULL).calls);
            ASSERT_EQ(0, loop_ranges(pool, -3, grains[g], NULL).calls);
        }
        springls_threads_destroy(pool);
    }
    PASS();
}

TEST the_largest_loop_does_not_overflow(void)
{
    springls_threads *pool = new_pool(4);
    ranges r = loop_ranges(pool, INT32_MAX, 1, NULL);
    ASSERT_EQ(0, r.wrong);
    ASSERT(r.elements == INT32_MAX);
    ASSERT_LT(r.calls, 1000);
    springls_threads_destroy(pool);
    PASS();
}

/* ---- loops inside loops ---- */

typedef struct nest { springls_tasks tasks; int depth; int sums[4][4][4]; int at; } nest;

static void add_leaf(void *arg, int begin, int end)
{
    int *row = (int *)arg, i;
    for (i = begin; i < end; i++) row[i] += 1 + i;
}

static void add_rows(void *arg, int begin, int end)
{
    nest *n = (nest *)arg;
    int i;
    for (i = begin; i < end; i++) n->tasks.parallel_for(n->tasks.user, 4, 1, add_leaf, n->sums[n->at][i]);
}

static void add_layers(void *arg, int begin, int end)
{
    nest *n = (nest *)arg;
    int i;
    for (i = begin; i < end; i++) n[i].tasks.parallel_for(n[i].tasks.user, 4, 1, add_rows, &n[i]);
}

TEST loops_may_be_inside_loops(void)
{
    static nest layers[4];
    springls_threads *pool = new_pool(4);
    int round, i, j, k;
    ASSERT(pool);
    memset(layers, 0, sizeof layers);
    for (i = 0; i < 4; i++) {
        layers[i].tasks = springls_threads_tasks(pool);
        layers[i].at = i;
    }
    for (round = 0; round < 500; round++) layers[0].tasks.parallel_for(pool, 4, 1, add_layers, layers);
    for (i = 0; i < 4; i++)
        for (j = 0; j < 4; j++)
            for (k = 0; k < 4; k++) ASSERT_EQ(500 * (1 + k), layers[i].sums[i][j][k]);
    springls_threads_destroy(pool);
    PASS();
}

/* A force that runs its batch as a loop of the pool which has called it. */
typedef struct looped_force {
    springls_tasks tasks;
    const float *points;
    float *out;
    float time;
} looped_force;

static void some_points(void *arg, int begin, int end)
{
    const looped_force *f = (const looped_force *)arg;
    struct exact_flow whirl = EXACT_DEFORMATION(24.0f, 2.0f);
    exact_flow_velocity(&whirl, f->points + 3 * begin, end - begin, f->time, f->out + 3 * begin);
}

static void looped_velocity(void *user, const float *points, int count, float time, float *out)
{
    looped_force f = *(looped_force *)user;
    f.points = points;
    f.out = out;
    f.time = time;
    if (f.tasks.parallel_for) f.tasks.parallel_for(f.tasks.user, count, 16, some_points, &f);
    else some_points(&f, 0, count);
}

static uint64_t whirled(springls_threads *pool, float dt)
{
    springls_desc desc = fixture_desc(24, NULL);
    looped_force force;
    springls_forces forces = fixture_forces(looped_velocity, &force);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, dt);
    springls_sphere ball = fixture_ball(9.0f, 9.0f, 9.0f, 4.5f);
    springls_context *ctx = NULL;
    uint64_t hash = 0;
    memset(&force, 0, sizeof force);
    desc.backend = NULL; /* a device has one queue, for one thread of the host */
    force.tasks = desc.tasks = springls_threads_tasks(pool);
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 0;
    springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    if (springls_run(ctx, &step, 3) == SPRINGLS_OK) hash = springls_state_hash(ctx);
    springls_destroy(ctx);
    return hash;
}

TEST a_force_may_run_a_loop(void)
{
    springls_threads *pool = new_pool(3);
    uint64_t expected = whirled(NULL, 0.12f);
    ASSERT(pool && expected != 0);
    ASSERT(expected == whirled(pool, 0.12f));
    springls_threads_destroy(pool);
    PASS();
}

/* A thread of the host with a model of its own on the pool of all. */
typedef struct host {
    pthread_t thread;
    springls_threads *pool;
    float dt;
    uint64_t hash;
} host;

static void *run_host(void *user)
{
    host *h = (host *)user;
    h->hash = whirled(h->pool, h->dt);
    return NULL;
}

TEST contexts_share_a_pool(void)
{
    enum { HOSTS = 4 };
    host hosts[HOSTS];
    springls_threads *pool = new_pool(3);
    int i;
    ASSERT(pool);
    for (i = 0; i < HOSTS; i++) {
        hosts[i].pool = pool;
        hosts[i].dt = 0.06f + 0.02f * (float)i;
        ASSERT_EQ(0, pthread_create(&hosts[i].thread, NULL, run_host, &hosts[i]));
    }
    for (i = 0; i < HOSTS; i++) {
        pthread_join(hosts[i].thread, NULL);
        ASSERT(hosts[i].hash != 0 && hosts[i].hash == whirled(NULL, hosts[i].dt));
    }
    springls_threads_destroy(pool);
    PASS();
}

/* ---- threads that get no processor ---- */

TEST threads_that_do_not_begin_delay_nothing(void)
{
    springls_threads *pool;
    static uint8_t seen[1000];
    uint64_t expected = whirled(NULL, 0.12f);
    set_gate(true);
    pool = new_pool(4);
    ASSERT(pool);
    ASSERT_EQ(0, loop_ranges(pool, 1000, 1, seen).wrong);
    ASSERT(expected == whirled(pool, 0.12f));
    set_gate(false);
    springls_threads_destroy(pool);
    PASS();
}

static void stand_at_gate(void *arg, int begin, int end)
{
    (void)arg, (void)begin, (void)end;
    wait_at_gate();
}

static void *run_at_gate(void *pool)
{
    springls_tasks tasks = springls_threads_tasks((springls_threads *)pool);
    tasks.parallel_for(tasks.user, 2, 1, stand_at_gate, NULL);
    return NULL;
}

static bool helpers_in_loop(springls_threads *pool, int wanted)
{
    bool reached;
    springls__mutex_lock(&pool->lock);
    reached = pool->count - pool->asleep == wanted;
    springls__mutex_unlock(&pool->lock);
    return reached;
}

/* The pool's only thread stands in a loop of another host: this one's loops end without it. */
TEST a_loop_waits_for_its_own_chunks_only(void)
{
    springls_threads *pool = new_pool(2);
    static uint8_t seen[1000];
    pthread_t other;
    ASSERT(pool);
    while (!helpers_in_loop(pool, 0)) sched_yield();
    set_gate(true);
    ASSERT_EQ(0, pthread_create(&other, NULL, run_at_gate, pool));
    while (!helpers_in_loop(pool, 1)) sched_yield();
    ASSERT_EQ(0, loop_ranges(pool, 1000, 1, seen).wrong);
    set_gate(false);
    pthread_join(other, NULL);
    springls_threads_destroy(pool);
    PASS();
}

/* Between loops all threads sleep in the operating system: this loop ends, however long it takes. */
TEST threads_sleep_between_loops(void)
{
    springls_threads *pool = new_pool(4);
    static uint8_t seen[1000];
    int i;
    ASSERT(pool);
    for (i = 0; i < 20; i++) {
        while (!helpers_in_loop(pool, 0)) sched_yield();
        ASSERT_EQ(0, loop_ranges(pool, 1000, 1, seen).wrong);
    }
    springls_threads_destroy(pool);
    PASS();
}

/* ---- life ---- */

TEST counts_have_bounds(void)
{
    static const int given[4] = { 0, -1, INT32_MIN, 1 };
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    springls_threads *pool;
    int i;
    for (i = 0; i < 4; i++) {
        ASSERT((pool = springls_threads_create(given[i])) != NULL);
        ASSERT_EQ_FMT(given[i] == 1 ? 1 : (int)processors, springls_threads_count(pool), "%d");
        springls_threads_destroy(pool);
    }
    ASSERT((pool = springls_threads_create(INT32_MAX)) != NULL);
    ASSERT_GT(springls_threads_count(pool), 1);
    ASSERT_LT(springls_threads_count(pool), 257);
    springls_threads_destroy(pool);
    PASS();
}

TEST null_is_the_calling_thread(void)
{
    springls_tasks tasks = springls_threads_tasks(NULL);
    ASSERT(!tasks.parallel_for && !tasks.user);
    ASSERT_EQ(1, springls_threads_count(NULL));
    springls_threads_destroy(NULL);
    PASS();
}

TEST a_pool_may_end_before_it_has_begun(void)
{
    int i;
    for (i = 0; i < 300; i++) {
        springls_threads *pool = springls_threads_create(4);
        ASSERT(pool);
        if (i % 2) loop_ranges(pool, 10, 1, NULL);
        springls_threads_destroy(pool);
    }
    PASS();
}

/* Memory, the lock and two conditions come first: without one of them there is no pool. Of threads there are those before. */
TEST what_the_system_refuses_is_done_without(void)
{
    static uint8_t seen[1000];
    int given;
    for (given = 0; given < 9; given++) {
        springls_threads *pool;
        refuse_after = given;
        pool = springls_threads_create(5);
        refuse_after = -1;
        ASSERT_EQ(given >= 4, pool != NULL);
        if (!pool) continue;
        ASSERT_EQ_FMT(given - 3, springls_threads_count(pool), "%d");
        ASSERT_EQ(0, loop_ranges(pool, 1000, 1, seen).wrong);
        springls_threads_destroy(pool);
    }
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    refuse_after = -1;
    RUN_TESTp(the_number_of_threads_does_not_matter, HISTORY_FLUID);
    RUN_TESTp(the_number_of_threads_does_not_matter, HISTORY_ELASTIC_PAPER);
    RUN_TESTp(the_number_of_threads_does_not_matter, HISTORY_MERGE);
    RUN_TEST(contexts_share_a_pool);
    RUN_TEST(ranges_cover_each_element_once);
    RUN_TEST(the_largest_loop_does_not_overflow);
    RUN_TEST(loops_may_be_inside_loops);
    RUN_TEST(a_force_may_run_a_loop);
    RUN_TEST(threads_that_do_not_begin_delay_nothing);
    RUN_TEST(a_loop_waits_for_its_own_chunks_only);
    RUN_TEST(threads_sleep_between_loops);
    RUN_TEST(counts_have_bounds);
    RUN_TEST(null_is_the_calling_thread);
    RUN_TEST(a_pool_may_end_before_it_has_begun);
    RUN_TEST(what_the_system_refuses_is_done_without);
    GREATEST_MAIN_END();
}
