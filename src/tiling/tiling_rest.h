/* tiling_rest.h - a tiling at rest. All models sleep (stages/sleep.h), and the walls have been looked at and closed without a change, so
   that the same would come of it again: then a step without forces only counts, model by model, as a step of a model at rest does.

   Some tilings would never get there by themselves. Where several walls meet, what closing them adds to one body may be too much for that
   body's next resampling, which removes it, and moves its neighbours enough to begin again; or a resampling fills what the next one
   contracts. So a tiling without forces is put to rest after MOST_IDLE steps, as it is. The count begins anew where a caller has changed
   the springls of a body, so that what he leaves has as many steps to settle; where a model may not sleep it does not begin. */
#ifndef SPRINGLS__TILING_TILING_REST_H
#define SPRINGLS__TILING_TILING_REST_H

#include "../output/measure.h"
#include "../solver/step.h"
#include "../stages/sleep.h"
#include "bodies.h"

/* Returns whether all models sleep. */
SPRINGLS__FN bool springls__bodies_sleep(const springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (!springls_at_rest(tiling->body[i].ctx)) return false;
    return tiling->count > 0;
}

/* Lets a model sleep, with phi where its springls are. */
SPRINGLS__FN springls_status springls__put_to_rest(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    (void)tiling, (void)arg;
    SPRINGLS__TRY(springls__begin_change(body->ctx));
    springls__rest_all(body->ctx);
    return SPRINGLS_OK;
}

/* Returns whether all models may sleep. */
SPRINGLS__FN bool springls__bodies_may_sleep(const springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (!springls__may_sleep(tiling->body[i].ctx)) return false;
    return true;
}

/* Returns a number that is another after any change of springls. Reading a model, which may move its phi for a while, leaves it. */
SPRINGLS__FN uint64_t springls__bodies_version(const springls_tiling *tiling)
{
    uint64_t sum = 0;
    int i;
    for (i = 0; i < tiling->count; i++) sum += tiling->body[i].ctx->springls_version;
    return sum;
}

/* Returns how many steps without forces there have been since a caller has changed springls. */
SPRINGLS__FN int springls__idle_steps(const springls_tiling *tiling)
{
    return springls__bodies_version(tiling) == tiling->stepped ? tiling->idle : 0;
}

/* Counts a step whose bodies have just made theirs. A tiling that has been put to rest, and does not sleep, has been woken. */
SPRINGLS__FN void springls__count_idle(springls_tiling *tiling, bool forces)
{
    const bool woken = tiling->idle == SPRINGLS__MOST_IDLE && !springls__bodies_sleep(tiling);
    if (forces || woken || !springls__bodies_may_sleep(tiling)) tiling->idle = 0;
    else if (tiling->idle < SPRINGLS__MOST_IDLE) tiling->idle++;
}

/* Notes after a whole step whether it has left everything as it was: springls that sleep, and what they face. */
SPRINGLS__FN void springls__note_rest(springls_tiling *tiling, bool slept, const springls_tiling_report *report)
{
    uint64_t hash = SPRINGLS__HASH_BEGIN;
    int i;
    if (!slept || !springls__bodies_sleep(tiling)) {
        tiling->calm_steps = 0;
        return;
    }
    for (i = 0; i < tiling->count; i++)
        hash = springls__hash(hash, springls__facing_values(&tiling->body[i]), (size_t)springls_count(tiling->body[i].ctx) * sizeof(float));
    tiling->calm_steps = hash == tiling->calm_hash ? springls__imin(tiling->calm_steps, INT32_MAX - 1) + 1 : 0;
    tiling->calm_hash = hash;
    if (report->faced) tiling->calm_report = *report;
}

#endif
