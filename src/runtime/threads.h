/* threads.h - a pool of threads behind springls_tasks, where SPRINGLS_THREADS is defined.

   A loop is cut into chunks, which an atomic counter gives away one by one. Whoever runs a loop takes chunks itself until none
   is left, and then waits only for those that others are in:

     caller    |==0==|==1==|==3==|==4==|..........|   returns when chunk 5 is done
     thread 1         (wakes) |==2==|=====5=====|
     thread 2         (gets no processor)             nobody waits for it: it has begun nothing

   So on a machine with other work a loop takes about as long as its caller alone would. A pool that divides loops beforehand,
   or whose threads meet at the end of each, waits there for every thread's turn. Between loops threads sleep in the operating
   system. */
#ifndef SPRINGLS__RUNTIME_THREADS_H
#define SPRINGLS__RUNTIME_THREADS_H

#include "base.h"
#include "../../kernels_embed/language/vector.h"

#if defined(SPRINGLS_THREADS)

/* ---- what the operating system has: a lock, conditions, threads, an atomic counter ---- */

#if defined(_WIN32)

#include <windows.h>
#include <process.h>

typedef SRWLOCK springls__mutex;
typedef CONDITION_VARIABLE springls__condition;
typedef HANDLE springls__thread;

#define SPRINGLS__THREAD_MAIN(name, arg) static unsigned __stdcall name(void *arg)

SPRINGLS__FN bool springls__mutex_create(springls__mutex *mutex) { InitializeSRWLock(mutex); return true; }
SPRINGLS__FN void springls__mutex_destroy(springls__mutex *mutex) { (void)mutex; }
SPRINGLS__FN void springls__mutex_lock(springls__mutex *mutex) { AcquireSRWLockExclusive(mutex); }
SPRINGLS__FN void springls__mutex_unlock(springls__mutex *mutex) { ReleaseSRWLockExclusive(mutex); }

SPRINGLS__FN bool springls__condition_create(springls__condition *condition)
{
    InitializeConditionVariable(condition);
    return true;
}
SPRINGLS__FN void springls__condition_destroy(springls__condition *condition) { (void)condition; }
SPRINGLS__FN void springls__condition_signal(springls__condition *condition) { WakeConditionVariable(condition); }
SPRINGLS__FN void springls__condition_broadcast(springls__condition *condition) { WakeAllConditionVariable(condition); }
SPRINGLS__FN void springls__condition_wait(springls__condition *condition, springls__mutex *mutex)
{
    SleepConditionVariableSRW(condition, mutex, INFINITE, 0);
}

SPRINGLS__FN bool springls__thread_start(springls__thread *thread, unsigned(__stdcall *start)(void *), void *arg)
{
    *thread = (HANDLE)_beginthreadex(NULL, 0, start, arg, 0, NULL);
    return *thread != NULL;
}
SPRINGLS__FN void springls__thread_join(springls__thread thread)
{
    WaitForSingleObject(thread, INFINITE);
    CloseHandle(thread);
}

SPRINGLS__FN long springls__processors(void)
{
    SYSTEM_INFO info;
    GetSystemInfo(&info);
    return (long)info.dwNumberOfProcessors;
}

#else

#include <pthread.h>
#include <unistd.h>

typedef pthread_mutex_t springls__mutex;
typedef pthread_cond_t springls__condition;
typedef pthread_t springls__thread;

#define SPRINGLS__THREAD_MAIN(name, arg) static void *name(void *arg)

SPRINGLS__FN bool springls__mutex_create(springls__mutex *mutex) { return pthread_mutex_init(mutex, NULL) == 0; }
SPRINGLS__FN void springls__mutex_destroy(springls__mutex *mutex) { pthread_mutex_destroy(mutex); }
SPRINGLS__FN void springls__mutex_lock(springls__mutex *mutex) { pthread_mutex_lock(mutex); }
SPRINGLS__FN void springls__mutex_unlock(springls__mutex *mutex) { pthread_mutex_unlock(mutex); }

SPRINGLS__FN bool springls__condition_create(springls__condition *condition) { return pthread_cond_init(condition, NULL) == 0; }
SPRINGLS__FN void springls__condition_destroy(springls__condition *condition) { pthread_cond_destroy(condition); }
SPRINGLS__FN void springls__condition_signal(springls__condition *condition) { pthread_cond_signal(condition); }
SPRINGLS__FN void springls__condition_broadcast(springls__condition *condition) { pthread_cond_broadcast(condition); }
SPRINGLS__FN void springls__condition_wait(springls__condition *condition, springls__mutex *mutex)
{
    pthread_cond_wait(condition, mutex);
}

SPRINGLS__FN bool springls__thread_start(springls__thread *thread, void *(*start)(void *), void *arg)
{
    return pthread_create(thread, NULL, start, arg) == 0;
}
SPRINGLS__FN void springls__thread_join(springls__thread thread) { pthread_join(thread, NULL); }

SPRINGLS__FN long springls__processors(void) { return sysconf(_SC_NPROCESSORS_ONLN); }

#endif

/* Adds 1 and returns what was there. What a chunk reads and writes is ordered by the pool's lock. */
SPRINGLS__FN long springls__take_number(long *counter)
{
#if defined(__GNUC__)
    return __atomic_fetch_add(counter, 1, __ATOMIC_RELAXED);
#else
    return InterlockedIncrement(counter) - 1;
#endif
}

/* ---- loops ---- */

enum {
    SPRINGLS__MOST_THREADS = 256,
    SPRINGLS__CHUNKS_A_THREAD = 64 /* so many at most: a larger number only makes the counter's traffic more */
};

/* A loop that is run, on its caller's stack. `taken` is shared without the lock, `helpers` and `awaited` under it. */
typedef struct springls__pool_loop {
    struct springls__pool_loop *next;
    springls_task task;
    void *arg;
    int count, chunk, chunks;
    long taken;   /* chunks that have been given away, or refused                                                   */
    int helpers;  /* threads of the pool that are in one of its chunks                                              */
    bool awaited; /* its caller sleeps until there are none                                                         */
} springls__pool_loop;

struct springls_threads {
    springls__mutex lock;
    springls__condition begun;  /* there is a loop, or the end                                                      */
    springls__condition helped; /* a loop that is awaited has no helpers                                            */
    springls__pool_loop *loops;      /* those that may have chunks left, the newest first                                */
    springls__thread threads[SPRINGLS__MOST_THREADS];
    int count;  /* of `threads` */
    int asleep; /* of these     */
    bool ending;
};

/* Returns a chunk that nobody has begun, or -1. */
SPRINGLS__FN int springls__take_chunk(springls__pool_loop *loop)
{
    long chunk = springls__take_number(&loop->taken);
    return chunk < loop->chunks ? (int)chunk : -1;
}

/* Runs this chunk, and others until none is left. */
SPRINGLS__FN void springls__run_chunks(springls__pool_loop *loop, int chunk)
{
    for (; chunk >= 0; chunk = springls__take_chunk(loop)) {
        int begin = chunk * loop->chunk, left = loop->count - begin;
        (loop->task)(loop->arg, begin, begin + springls__imin(left, loop->chunk));
    }
}

/* Takes a chunk of the newest loop that has one, and forgets the loops that have none. *chunk is -1 when there is no loop.
   Under the lock. */
SPRINGLS__FN springls__pool_loop *springls__join_loop(springls_threads *pool, int *chunk)
{
    *chunk = -1;
    while (pool->loops && (*chunk = springls__take_chunk(pool->loops)) < 0) pool->loops = pool->loops->next;
    return pool->loops;
}

SPRINGLS__FN void springls__help(springls_threads *pool, springls__pool_loop *loop, int chunk)
{
    loop->helpers++;
    springls__mutex_unlock(&pool->lock);
    springls__run_chunks(loop, chunk);
    springls__mutex_lock(&pool->lock);
    if (--loop->helpers == 0 && loop->awaited) springls__condition_broadcast(&pool->helped);
}

SPRINGLS__THREAD_MAIN(springls__thread_main, user)
{
    springls_threads *pool = (springls_threads *)user;
    springls__mutex_lock(&pool->lock);
    while (!pool->ending) {
        int chunk;
        springls__pool_loop *loop = springls__join_loop(pool, &chunk);
        if (loop) {
            springls__help(pool, loop, chunk);
        } else {
            pool->asleep++;
            springls__condition_wait(&pool->begun, &pool->lock);
            pool->asleep--;
        }
    }
    springls__mutex_unlock(&pool->lock);
    return 0;
}

/* Offers a loop to the threads that sleep. */
SPRINGLS__FN void springls__offer_loop(springls_threads *pool, springls__pool_loop *loop)
{
    int wanted;
    springls__mutex_lock(&pool->lock);
    loop->next = pool->loops;
    pool->loops = loop;
    wanted = springls__imin(pool->asleep, loop->chunks - 1);
    springls__mutex_unlock(&pool->lock);
    while (wanted-- > 0) springls__condition_signal(&pool->begun);
}

/* Takes back a loop that has no chunks left, and sleeps until nobody is in one. */
SPRINGLS__FN void springls__end_loop(springls_threads *pool, springls__pool_loop *loop)
{
    springls__pool_loop **link = &pool->loops;
    springls__mutex_lock(&pool->lock);
    while (*link && *link != loop) link = &(*link)->next;
    if (*link) *link = loop->next;
    loop->awaited = true;
    while (loop->helpers > 0) springls__condition_wait(&pool->helped, &pool->lock);
    springls__mutex_unlock(&pool->lock);
}

SPRINGLS__FN void springls__threads_for(void *user, int count, int grain, springls_task task, void *arg)
{
    springls_threads *pool = (springls_threads *)user;
    springls__pool_loop loop;
    int most = SPRINGLS__CHUNKS_A_THREAD * (pool->count + 1);
    if (count <= 0) return;
    memset(&loop, 0, sizeof loop);
    loop.task = task;
    loop.arg = arg;
    loop.count = count;
    loop.chunk = springls__imax(springls__imax(grain, 1), count / most + 1);
    loop.chunks = (count - 1) / loop.chunk + 1;
    if (loop.chunks == 1 || pool->count == 0) {
        (task)(arg, 0, count);
        return;
    }
    springls__offer_loop(pool, &loop);
    springls__run_chunks(&loop, springls__take_chunk(&loop));
    springls__end_loop(pool, &loop);
}

/* ---- life ---- */

/* Returns true when the pool has what its threads meet by; leaves nothing otherwise. */
SPRINGLS__FN bool springls__create_locks(springls_threads *pool)
{
    if (!springls__mutex_create(&pool->lock)) return false;
    if (springls__condition_create(&pool->begun)) {
        if (springls__condition_create(&pool->helped)) return true;
        springls__condition_destroy(&pool->begun);
    }
    springls__mutex_destroy(&pool->lock);
    return false;
}

SPRINGLS_API springls_threads *springls_threads_create(int count)
{
    springls_threads *pool = (springls_threads *)calloc(1, sizeof *pool);
    long wanted = count > 0 ? count : springls__processors();
    if (wanted > SPRINGLS__MOST_THREADS) wanted = SPRINGLS__MOST_THREADS;
    if (!pool) return NULL;
    if (!springls__create_locks(pool)) {
        free(pool);
        return NULL;
    }
    springls__mutex_lock(&pool->lock); /* a thread that has started sees the number of all */
    while (pool->count + 1 < wanted && springls__thread_start(&pool->threads[pool->count], springls__thread_main, pool))
        pool->count++;
    springls__mutex_unlock(&pool->lock);
    return pool;
}

SPRINGLS_API void springls_threads_destroy(springls_threads *threads)
{
    int i;
    if (!threads) return;
    springls__mutex_lock(&threads->lock);
    threads->ending = true;
    springls__mutex_unlock(&threads->lock);
    springls__condition_broadcast(&threads->begun);
    for (i = 0; i < threads->count; i++) springls__thread_join(threads->threads[i]);
    springls__condition_destroy(&threads->helped);
    springls__condition_destroy(&threads->begun);
    springls__mutex_destroy(&threads->lock);
    free(threads);
}

SPRINGLS_API int springls_threads_count(const springls_threads *threads) { return threads ? threads->count + 1 : 1; }

SPRINGLS_API springls_tasks springls_threads_tasks(springls_threads *threads)
{
    springls_tasks tasks;
    tasks.parallel_for = threads ? springls__threads_for : NULL;
    tasks.user = threads;
    return tasks;
}

#else

SPRINGLS_API springls_threads *springls_threads_create(int count) { return (void)count, (springls_threads *)NULL; }
SPRINGLS_API void springls_threads_destroy(springls_threads *threads) { (void)threads; }
SPRINGLS_API int springls_threads_count(const springls_threads *threads) { return (void)threads, 1; }

SPRINGLS_API springls_tasks springls_threads_tasks(springls_threads *threads)
{
    springls_tasks tasks = { NULL, NULL };
    (void)threads;
    return tasks;
}

#endif

#endif
