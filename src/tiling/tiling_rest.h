/* tiling_rest.h - bodies at rest. A body rests while its model sleeps (stages/sleep.h), no force acts on it, and nothing beside it has
   stirred for as many steps as it takes to close walls and to look at sheets once: the same would come of it again. It takes no part in a
   step then but for the count, so that a step costs what the bodies cost where something moves. Bits are those of a step of all bodies.

   Beside means in the same brick of the grid: each body has the bricks in whose voxels its phi is known, 3 voxels from its surface on,
   which is further than stages of a tiling look. What stirs are bricks of a body that are awake. They are found after bodies have made
   their own steps, and again after walls have been closed, so that nobody is left out who would see a change.

   Some tilings would never get there by themselves. Where several walls meet, what closing them adds to one body may be too much for that
   body's next resampling, which removes it, and moves its neighbours enough to begin again; or a resampling fills what the next one
   contracts. So a body without forces is put to rest after MOST_IDLE steps, as it is, and stays so whatever stirs beside it. The count
   begins anew where a force acts on it or on a body beside it, or a caller has changed the springls of one of them, so that what he leaves
   has as many steps to settle; where a model may not sleep it does not begin. */
#ifndef SPRINGLS__TILING_TILING_REST_H
#define SPRINGLS__TILING_TILING_REST_H

#include "../output/measure.h"
#include "../solver/step.h"
#include "../stages/sleep.h"
#include "bodies.h"

/* The box of voxels that forces act in. */
typedef struct springls__force_region { bool everywhere; float lower[3], upper[3]; } springls__force_region;

SPRINGLS__FN springls__force_region springls__whole_region(void)
{
    springls__force_region region;
    memset(&region, 0, sizeof region);
    region.everywhere = true;
    return region;
}

SPRINGLS__FN bool springls__reaches_brick(const springls__force_region *region, const int origin[3])
{
    int k;
    for (k = 0; k < 3 && !region->everywhere; k++)
        if ((float)(origin[k] + SPRINGLS__BRICK) < region->lower[k] || (float)(origin[k] - 1) > region->upper[k]) return false;
    return true;
}

/* Returns whether a body has an active brick in a region; region NULL: nowhere. */
SPRINGLS__FN bool springls__body_in_region(const springls__tiling_body *body, const springls__force_region *region)
{
    const springls__grid *g = &body->ctx->model.grid;
    int i, origin[3];
    for (i = 0; region && i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], origin);
        if (springls__reaches_brick(region, origin)) return true;
    }
    return false;
}

/* ---- bricks that are marked ---- */

/* Clears the marks: from now on another byte marks a brick, and all bytes are set if none is left. */
SPRINGLS__FN springls_status springls__clear_marks(springls_tiling *tiling)
{
    const springls__grid *g = &tiling->host->model.grid;
    const size_t bricks = (size_t)g->bricks[0] * (size_t)g->bricks[1] * (size_t)g->bricks[2];
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->marked, bricks, 1, 0));
    if (tiling->mark == 0 || tiling->mark == UINT8_MAX) {
        memset(tiling->marked.data, 0, bricks);
        tiling->mark = 0;
    }
    tiling->mark++;
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__mark_brick(springls_tiling *tiling, int brick) { ((uint8_t *)tiling->marked.data)[brick] = tiling->mark; }

/* Marks the active bricks of a body that lie in a region. */
SPRINGLS__FN void springls__mark_region(springls_tiling *tiling, const springls__tiling_body *body, const springls__force_region *region)
{
    const springls__grid *g = &body->ctx->model.grid;
    int i, origin[3];
    for (i = 0; i < g->active_count; i++) {
        springls__slot_origin(g, g->active[i], origin);
        if (springls__reaches_brick(region, origin)) springls__mark_brick(tiling, g->slot_brick[g->active[i]]);
    }
}

/* Returns the brick along axis k that a place is in, the nearest one of the grid. */
SPRINGLS__FN int springls__brick_of_place(const springls__grid *g, int k, float x)
{
    return springls__cell_coordinate(x, 0, g->size[k]) / SPRINGLS__BRICK;
}

/* Marks the bricks in which the last step has left a body: a caller may have moved it away. */
SPRINGLS__FN void springls__mark_box(springls_tiling *tiling, const springls__tiling_body *body)
{
    const springls__grid *g = &tiling->host->model.grid;
    const float reach = 2.0f; /* voxels */
    const float *lower = &body->rest.box.lower.x, *upper = &body->rest.box.upper.x;
    int first[3], last[3], at[3], k;
    if (body->rest.stepped == 0 || lower[0] > upper[0]) return;
    for (k = 0; k < 3; k++) {
        first[k] = springls__brick_of_place(g, k, lower[k] - reach);
        last[k] = springls__brick_of_place(g, k, upper[k] + reach);
    }
    for (at[2] = first[2]; at[2] <= last[2]; at[2]++)
        for (at[1] = first[1]; at[1] <= last[1]; at[1]++)
            for (at[0] = first[0]; at[0] <= last[0]; at[0]++)
                springls__mark_brick(tiling, at[0] + g->bricks[0] * (at[1] + g->bricks[1] * at[2]));
}

/* Marks the bricks of a body in which something stirs: bricks that are awake, and bricks that have gained or lost springls since. */
SPRINGLS__FN void springls__mark_stirring(springls_tiling *tiling, const springls__tiling_body *body)
{
    const springls__grid *g = &body->ctx->model.grid;
    const int limit = springls__calm_limit(&body->ctx->model);
    int i, o;
    for (i = 0; i < g->active_count; i++) {
        const int slot = g->active[i];
        bool stirs = !springls_at_rest(body->ctx) && g->awake[slot];
        for (o = 0; o < SPRINGLS__OCTANTS && !stirs; o++) stirs = g->calm[slot * SPRINGLS__OCTANTS + o] < limit;
        if (stirs) springls__mark_brick(tiling, g->slot_brick[slot]);
    }
}

/* Returns whether a body has an active brick that is marked. */
SPRINGLS__FN bool springls__is_marked(const springls_tiling *tiling, const springls__tiling_body *body)
{
    const springls__grid *g = &body->ctx->model.grid;
    int i;
    for (i = 0; i < g->active_count; i++)
        if (((const uint8_t *)tiling->marked.data)[g->slot_brick[g->active[i]]] == tiling->mark) return true;
    return false;
}

/* ---- who takes part ---- */

SPRINGLS__FN bool springls__is_changed(const springls__tiling_body *body) { return body->ctx->springls_version != body->rest.stepped; }

/* Returns whether a body counts its steps anew: its springls have been changed, or a caller has woken the body after MOST_IDLE steps. */
SPRINGLS__FN bool springls__begins_anew(const springls__tiling_body *body)
{
    const springls__body_rest *rest = &body->rest;
    return springls__is_changed(body) || (rest->idle == SPRINGLS__MOST_IDLE && rest->slept && !springls_at_rest(body->ctx));
}

/* Begins anew to count for bodies that a caller has changed, or woken, since the last step, and for those beside them. */
SPRINGLS__FN springls_status springls__note_changes(springls_tiling *tiling)
{
    const springls__force_region all = springls__whole_region();
    bool changed = false;
    int i;
    for (i = 0; i < tiling->count; i++) changed = changed || springls__begins_anew(&tiling->body[i]);
    if (!changed) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__clear_marks(tiling));
    for (i = 0; i < tiling->count; i++) {
        if (!springls__begins_anew(&tiling->body[i])) continue;
        springls__mark_region(tiling, &tiling->body[i], &all);
        springls__mark_box(tiling, &tiling->body[i]);
    }
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        if (springls__begins_anew(body) || springls__is_marked(tiling, body)) body->rest.idle = body->rest.calm = 0;
    }
    return SPRINGLS_OK;
}

/* Begins the step of a body: what is known of it without the others. calm: steps, as many as it takes to look at all once. */
SPRINGLS__FN void springls__wake_body(springls__tiling_body *body, const springls__force_region *region, int calm)
{
    springls__body_rest *rest = &body->rest;
    const bool may_sleep = springls__may_sleep(body->ctx);
    rest->version = body->ctx->springls_version;
    rest->forced = springls__body_in_region(body, region);
    rest->driven = rest->forced || !may_sleep;
    rest->slept = springls_at_rest(body->ctx) && may_sleep;
    rest->beside = false;
    rest->put = !rest->driven && rest->idle == SPRINGLS__MOST_IDLE;
    rest->looks = rest->driven || !rest->slept || rest->calm < calm;
    rest->awake = rest->looks && !(rest->put && rest->slept);
}

/* Lets the bodies beside those that are driven begin anew to count. region NULL: no force acts. */
SPRINGLS__FN springls_status springls__drive_others(springls_tiling *tiling, const springls__force_region *region)
{
    const springls__force_region all = springls__whole_region();
    bool driven = false;
    int i;
    for (i = 0; i < tiling->count; i++) driven = driven || tiling->body[i].rest.driven;
    if (!driven) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__clear_marks(tiling));
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].rest.driven)
            springls__mark_region(tiling, &tiling->body[i], springls__may_sleep(tiling->body[i].ctx) ? region : &all);
    for (i = 0; i < tiling->count; i++) {
        springls__body_rest *rest = &tiling->body[i].rest;
        if (!rest->driven && !springls__is_marked(tiling, &tiling->body[i])) continue;
        rest->driven = rest->beside = rest->awake = rest->looks = true;
        rest->put = false;
    }
    return SPRINGLS_OK;
}

/* Finds which bodies take part in a step: forces act in the region, NULL: nowhere. */
SPRINGLS__FN springls_status springls__wake_bodies(springls_tiling *tiling, const springls__force_region *region, int calm)
{
    int i;
    SPRINGLS__TRY(springls__note_changes(tiling));
    for (i = 0; i < tiling->count; i++) springls__wake_body(&tiling->body[i], region, calm);
    SPRINGLS__TRY(springls__drive_others(tiling, region));
    for (i = 0; i < tiling->count; i++) tiling->body[i].rest.idle_before = tiling->body[i].rest.idle;
    return SPRINGLS_OK;
}

/* Wakes the bodies beside which something stirs now; *woken: there are such that were not awake. */
SPRINGLS__FN springls_status springls__wake_beside_stirring(springls_tiling *tiling, bool *woken)
{
    int i;
    *woken = false;
    if (!springls__has_bodies(tiling, SPRINGLS__AWAKE_BODIES)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__clear_marks(tiling));
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].rest.awake) springls__mark_stirring(tiling, &tiling->body[i]);
    for (i = 0; i < tiling->count; i++) {
        springls__body_rest *rest = &tiling->body[i].rest;
        if (!springls__is_marked(tiling, &tiling->body[i])) continue;
        rest->beside = rest->looks = true;
        if (rest->put) continue;
        *woken = *woken || !rest->awake;
        rest->awake = true;
    }
    return SPRINGLS_OK;
}

/* ---- after MOST_IDLE steps ---- */

/* Lets a model sleep, with phi where its springls are. */
SPRINGLS__FN springls_status springls__put_to_rest(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    if (springls__settles(body)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__begin_change(body->ctx));
    SPRINGLS__TRY(springls__body_to_host(tiling, body, arg));
    SPRINGLS__TRY(springls__to_host(body->ctx, 0, SPRINGLS__BIT(CALM)));
    springls__rest_all(body->ctx);
    return SPRINGLS_OK;
}

/* Counts a step, after bodies have made theirs. */
SPRINGLS__FN void springls__count_idle(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        springls__body_rest *rest = &tiling->body[i].rest;
        if (rest->driven) rest->idle = 0;
        else if (rest->idle < SPRINGLS__MOST_IDLE) rest->idle++;
    }
}

/* Notes after a step which bodies it has left as they were: springls that sleep, and what they face. */
SPRINGLS__FN void springls__note_rest(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        const springls__tiling_body *body = &tiling->body[i];
        springls__body_rest *rest = &tiling->body[i].rest;
        const size_t bytes = (size_t)springls_count(body->ctx) * sizeof(float);
        uint64_t hash;
        bool same;
        if (!rest->looks) continue;
        hash = springls__hash(SPRINGLS__HASH_BEGIN, springls__facing_values(body), bytes);
        same = rest->slept && springls_at_rest(body->ctx) && !rest->beside && rest->version == body->ctx->springls_version;
        rest->calm = same && hash == rest->facing_hash ? springls__imin(rest->calm, INT32_MAX - 1) + 1 : 0;
        rest->facing_hash = hash;
    }
}

/* Notes the springls as a step has left them, and where. Reading a model, which may move its phi for a while, leaves them. */
SPRINGLS__FN void springls__note_springls(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        const springls__tiling_body *body = &tiling->body[i];
        springls__body_rest *rest = &tiling->body[i].rest;
        if (!springls__is_changed(body)) continue;
        rest->box = body->boxed == body->ctx->springls_version ? body->box : springls__particle_box(body->ctx);
        rest->stepped = body->ctx->springls_version;
    }
}

#endif
