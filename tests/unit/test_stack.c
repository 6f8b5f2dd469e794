#define _POSIX_C_SOURCE 200809L
/* test_stack.c - what jobs need of their threads' stacks: at most 16 KB, in every history. */
#include "histories.h"
#include <pthread.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__EMSCRIPTEN__)
#define OWN_FRAMES 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(memory_sanitizer) || __has_feature(thread_sanitizer)
#define OWN_FRAMES 0
#endif
#endif
#ifndef OWN_FRAMES
#define OWN_FRAMES 1
#endif

enum { STACK = 256 * 1024, LIMIT = 16 * 1024, PAINT = 0x5a };

/* One thread with a painted stack, which does all jobs. */
typedef struct worker {
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    springls_task task;
    void *arg;
    int count, jobs;
    bool waiting, ended;
    unsigned char *stack;
} worker;

static void *worker_main(void *user)
{
    worker *w = (worker *)user;
    pthread_mutex_lock(&w->lock);
    for (;;) {
        while (!w->waiting && !w->ended) pthread_cond_wait(&w->changed, &w->lock);
        if (!w->waiting) break;
        w->task(w->arg, 0, w->count);
        w->waiting = false;
        pthread_cond_signal(&w->changed);
    }
    pthread_mutex_unlock(&w->lock);
    return NULL;
}

static void worker_for(void *user, int count, int grain, springls_task task, void *arg)
{
    worker *w = (worker *)user;
    (void)grain;
    pthread_mutex_lock(&w->lock);
    w->task = task;
    w->arg = arg;
    w->count = count;
    w->jobs++;
    w->waiting = true;
    pthread_cond_signal(&w->changed);
    while (w->waiting) pthread_cond_wait(&w->changed, &w->lock);
    pthread_mutex_unlock(&w->lock);
}

static bool worker_begin(worker *w)
{
    pthread_attr_t attributes;
    bool good;
    memset(w, 0, sizeof *w);
    if (posix_memalign((void **)&w->stack, 4096, STACK) != 0) return false;
    memset(w->stack, PAINT, STACK);
    pthread_mutex_init(&w->lock, NULL);
    pthread_cond_init(&w->changed, NULL);
    pthread_attr_init(&attributes);
    good = pthread_attr_setstack(&attributes, w->stack, STACK) == 0;
    good = good && pthread_create(&w->thread, &attributes, worker_main, w) == 0;
    pthread_attr_destroy(&attributes);
    return good;
}

static void worker_end(worker *w)
{
    pthread_mutex_lock(&w->lock);
    w->ended = true;
    pthread_cond_signal(&w->changed);
    pthread_mutex_unlock(&w->lock);
    pthread_join(w->thread, NULL);
    free(w->stack);
}

/* Returns the bytes of the stack that have been touched. It grows downwards. */
static int touched(const worker *w)
{
    int i = 0;
    while (i < STACK && w->stack[i] == PAINT) i++;
    return STACK - i;
}

static void no_job(void *arg, int begin, int end) { (void)arg, (void)begin, (void)end; }

TEST jobs_need_little_stack(int history)
{
    worker w;
    springls_tasks tasks;
    int before, after;
    if (!OWN_FRAMES) SKIPm("a sanitizer's frames are larger");
    ASSERT(worker_begin(&w));
    tasks.parallel_for = worker_for;
    tasks.user = &w;
    worker_for(&w, 1, 1, no_job, NULL);
    before = touched(&w);
    ASSERT(history_run(history, &tasks, NULL) != 0);
    after = touched(&w);
    ASSERT_GT(w.jobs, 100);
    worker_end(&w);
    ASSERT_GT(after, before);
    ASSERT_LT(after - before, LIMIT);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int history;
    GREATEST_MAIN_BEGIN();
    for (history = 0; history < HISTORIES; history++) RUN_TESTp(jobs_need_little_stack, history);
    GREATEST_MAIN_END();
}
