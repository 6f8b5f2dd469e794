/* tiling_rest.h - a tiling at rest. All models sleep (stages/sleep.h), and the walls have been looked at and closed without a change, so
   that the same would come of it again: then a step without forces only counts, model by model, as a step of a model at rest does. */
#ifndef SPRINGLS__TILING_TILING_REST_H
#define SPRINGLS__TILING_TILING_REST_H

#include "../output/measure.h"
#include "bodies.h"

/* Returns whether all models sleep. */
SPRINGLS__FN bool springls__bodies_sleep(const springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (!springls_at_rest(tiling->body[i].ctx)) return false;
    return tiling->count > 0;
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
