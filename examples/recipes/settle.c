/* settle.c - rest at load: the first frames of a game do not pay for what the model does by itself. */
#include "springls.h"
#include <stdio.h>
#include <stdlib.h>

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

int main(void)
{
    springls_desc desc = springls_default_desc();
    springls_step_desc still = {0}; /* no forces, no time */
    springls_torus ring = {{32, 32, 32}, {0, 0, 1}, 18, 7};
    springls_context *model;
    int steps = 0;
    bool done;

    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 64;
    if (springls_create(&desc, &model) != SPRINGLS_OK) return puts(springls_create_error(&desc)), 1;
    ok(model, springls_set_implicit(model, springls_implicit_torus, &ring));
    ok(model, springls_settle(model, 100)); /* behind a loading screen: all at once */
    printf("at rest: %s\n", springls_at_rest(model) ? "yes" : "no");
    uint64_t loaded = springls_state_hash(model);

    ok(model, springls_set_implicit(model, springls_implicit_torus, &ring));
    for (; !springls_at_rest(model) && steps < 100; steps++) { /* in frames that draw something: 2 ms each */
        ok(model, springls_step_begin(model, &still));
        for (done = false; !done; ) ok(model, springls_step_continue(model, 0.002, &done));
    }
    printf("in pieces: %s\n", springls_state_hash(model) == loaded ? "the same bits" : "other bits");
    springls_destroy(model);
    return 0;
}
