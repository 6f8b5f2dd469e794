/* The pool of threads through public calls alone: the same bits for any number of threads, and of contexts at the same time.
   Prints nothing and returns 0 when they are. */
#define SPRINGLS_THREADS
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"
#include "examples/common/springls/exact_flows.h"

static uint64_t life(springls_tasks tasks)
{
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    struct exact_flow whirl;
    springls_sphere ball;
    springls_context *ctx = NULL;
    uint64_t hash = 0;
    int k;
    memset(&whirl, 0, sizeof whirl);
    whirl.size = 24.0f;
    whirl.period = 2.0f;
    for (k = 0; k < 3; k++) {
        desc.grid.size[k] = 24;
        ball.center[k] = 9.0f;
    }
    ball.radius = 4.5f;
    desc.tasks = tasks;
    forces.velocity = exact_flow_velocity;
    forces.user = &whirl;
    step.forces = &forces;
    step.dt = 0.12f;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 0;
    springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    if (springls_run(ctx, &step, 3) == SPRINGLS_OK) hash = springls_state_hash(ctx);
    springls_destroy(ctx);
    return hash;
}

/* Lives of their own, each of which runs its loops on the pool that runs this one. */
typedef struct lives { springls_tasks tasks; uint64_t hash[6]; } lives;

static void some_lives(void *arg, int begin, int end)
{
    lives *all = (lives *)arg;
    for (; begin < end; begin++) all->hash[begin] = life(all->tasks);
}

int main(void)
{
    uint64_t expected = life(springls_threads_tasks(NULL));
    int count, i;
    if (!expected) return 1;
    for (count = 1; count <= 4; count++) {
        springls_threads *pool = springls_threads_create(count);
        lives all;
        if (springls_threads_count(pool) != count) return 2;
        all.tasks = springls_threads_tasks(pool);
        if (life(all.tasks) != expected) return 3;
        all.tasks.parallel_for(all.tasks.user, 6, 1, some_lives, &all);
        for (i = 0; i < 6; i++)
            if (all.hash[i] != expected) return 4;
        springls_threads_destroy(pool);
    }
    return 0;
}
