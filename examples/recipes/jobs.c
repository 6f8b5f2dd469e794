/* jobs.c - loops on the program's own threads: a job system of a few lines, which a game has already. */
#include "springls.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct job { springls_task task; void *arg; int begin, end; } job;

static void *run_job(void *memory)
{
    const job *j = memory;
    j->task(j->arg, j->begin, j->end);
    return NULL;
}

/* Divides a loop among four threads, the caller's among them; one that cannot be started is run here. */
static void parallel_for(void *user, int count, int grain, springls_task task, void *arg)
{
    enum { MOST = 4 };
    pthread_t threads[MOST];
    job jobs[MOST];
    int pieces = count / grain < MOST ? count / grain + 1 : MOST, i;
    bool started[MOST];
    (void)user;
    for (i = 0; i < pieces; i++) {
        jobs[i] = (job){task, arg, (int)((long long)count * i / pieces), (int)((long long)count * (i + 1) / pieces)};
        started[i] = i + 1 < pieces && pthread_create(&threads[i], NULL, run_job, &jobs[i]) == 0;
        if (!started[i]) run_job(&jobs[i]);
    }
    for (i = 0; i < pieces; i++)
        if (started[i]) pthread_join(threads[i], NULL);
}

int main(void)
{
    uint64_t hash[2];
    for (int threaded = 0; threaded < 2; threaded++) {
        springls_desc desc = springls_default_desc();
        springls_step_desc still = {0};
        springls_torus ring = {{32, 32, 32}, {0, 0, 1}, 18, 7};
        springls_context *model;
        desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 64;
        if (threaded) desc.tasks.parallel_for = parallel_for;
        if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
        if (springls_set_implicit(model, springls_implicit_torus, &ring) != SPRINGLS_OK
            || springls_run(model, &still, 5) != SPRINGLS_OK) return puts(springls_last_error(model)), 1;
        hash[threaded] = springls_state_hash(model);
        springls_destroy(model);
    }
    puts(hash[0] == hash[1] ? "four threads: the same bits as one" : "the bits differ");
    return 0;
}
