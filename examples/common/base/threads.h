/* threads.h - the threads of a program: its models and its own loops have the same ones. */
#ifndef EXAMPLES_BASE_THREADS_H
#define EXAMPLES_BASE_THREADS_H

/* Does the work of the elements begin <= i < end. */
typedef void threads_task(void *arg, int begin, int end);

/* Runs a task over ranges of [0, count), as springls_tasks.parallel_for. */
typedef void threads_parallel_for(void *user, int count, int grain, threads_task *task, void *arg);

/* Sets who runs the loops of this program from now on, on so many threads; NULL, as before any call: the calling thread. */
void threads_use(threads_parallel_for *parallel_for, void *user, int count);

int threads_count(void);

/* Runs task(arg, begin, end) over ranges of [0, count), of at least `grain` elements but for the last, on all threads. A task
 * writes only what belongs to its own elements: so results do not depend on the number of threads. */
void threads_for(int count, int grain, threads_task *task, void *arg);

/* One thread at a time is between these, for what tasks share. */
void threads_lock(void);
void threads_unlock(void);

#endif
