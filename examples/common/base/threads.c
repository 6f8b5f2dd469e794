#include "base/threads.h"

#include <pthread.h>
#include <stddef.h>

static threads_parallel_for *run_loop;
static void *run_loop_user;
static int number = 1;
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

void threads_use(threads_parallel_for *parallel_for, void *user, int count)
{
    run_loop = parallel_for;
    run_loop_user = user;
    number = count;
}

int threads_count(void)
{
    return number;
}

void threads_for(int count, int grain, threads_task *task, void *arg)
{
    if (count > 0 && run_loop) {
        run_loop(run_loop_user, count, grain, task, arg);
    } else if (count > 0) {
        task(arg, 0, count);
    }
}

void threads_lock(void)
{
    pthread_mutex_lock(&lock);
}

void threads_unlock(void)
{
    pthread_mutex_unlock(&lock);
}
