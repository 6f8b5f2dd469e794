/* tiling_step.h - a step of a tiling: every body by itself, side by side, then the walls. What fails on the way leaves the tiling as it
   was. */
#ifndef SPRINGLS__TILING_TILING_STEP_H
#define SPRINGLS__TILING_TILING_STEP_H

#include "../output/restore.h"
#include "../solver/step.h"
#include "body_memory.h"
#include "films.h"
#include "join.h"
#include "mirror.h"
#include "sheets.h"
#include "tiling_rest.h"

enum { SPRINGLS__MIRROR_PERIOD = 8, SPRINGLS__TILING_BLOCK = 64, SPRINGLS__DOUBTFUL = 64 }; /* DOUBTFUL: voxels; fewer may be none */

/* ---- forces ---- */

/* What the callbacks of a body's model get: whose they are. */
typedef struct springls__tiling_push {
    const springls_tiling_step_desc *desc;
    const springls__tiling_body *body;
    const springls_tiling *tiling;
} springls__tiling_push;

/* The callback that is asked, and how many floats it answers a point. */
typedef struct springls__tiling_ask { springls_tiling_fn fn; int width; } springls__tiling_ask;

/* Returns whether a callback moves springls. */
SPRINGLS__FN bool springls__pushes(const springls_tiling_step_desc *desc)
{
    return desc->dt > 0.0f && (desc->velocity || desc->pressure);
}

/* Returns whether it does so in a box alone. */
SPRINGLS__FN bool springls__has_box(const springls_tiling_step_desc *desc)
{
    int k;
    for (k = 0; k < 3; k++)
        if (desc->region_lower[k] != 0.0f || desc->region_upper[k] != 0.0f) return true;
    return false;
}

/* Asks the user's callback about part of a batch, at most SPRINGLS__TILING_BLOCK points from `first` on. Normals point away from the
   label: those of the model of label 0 point into it. */
SPRINGLS__FN void springls__ask_part(const springls__tiling_push *push, springls__tiling_ask ask, const springls_batch *given, int first,
                                     int count, float *out)
{
    const float *facing = springls__facing_values(push->body);
    int32_t labels[SPRINGLS__TILING_BLOCK];
    float normals[3 * SPRINGLS__TILING_BLOCK];
    springls_tiling_batch batch;
    int i;
    for (i = 0; i < count; i++) labels[i] = facing ? (int32_t)facing[given->springls[first + i]] : SPRINGLS__NO_LABEL;
    for (i = 0; i < 3 * count; i++) normals[i] = push->body->sign * given->normals[3 * first + i];
    batch.label = push->body->label;
    batch.facing = labels;
    batch.batch = *given;
    batch.batch.count = count;
    batch.batch.points = given->points + 3 * first;
    batch.batch.normals = normals;
    batch.batch.correspondences = given->correspondences + 3 * first;
    batch.batch.springls = given->springls + first;
    batch.batch.ids = given->ids + first;
    (ask.fn)(push->desc->user, &batch, out + ask.width * first);
}

SPRINGLS__FN void springls__ask(const springls__tiling_push *push, springls_tiling_fn fn, int width, const springls_batch *given,
                                float *out)
{
    springls__tiling_ask ask;
    int first;
    ask.fn = fn;
    ask.width = width;
    for (first = 0; first < given->count; first += SPRINGLS__TILING_BLOCK)
        springls__ask_part(push, ask, given, first, springls__imin(SPRINGLS__TILING_BLOCK, given->count - first), out);
}

/* Returns forces that add nothing, in the region and the units of the description. */
SPRINGLS__FN springls_forces springls__tiling_forces(const springls_tiling_step_desc *desc)
{
    springls_forces forces = springls_default_forces();
    forces.integrator = desc->integrator;
    forces.voxel_units = desc->voxel_units;
    memcpy(forces.region_lower, desc->region_lower, sizeof forces.region_lower);
    memcpy(forces.region_upper, desc->region_upper, sizeof forces.region_upper);
    return forces;
}

/* Finds where anything may move bodies that are at rest; returns false if nothing does. */
SPRINGLS__FN bool springls__region_of_step(const springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                           springls__force_region *region)
{
    const springls_forces forces = springls__tiling_forces(desc);
    springls__v3 lower, upper;
    memset(region, 0, sizeof *region);
    region->everywhere = desc->film || !springls__has_box(desc);
    springls__region_box(tiling->host, &forces, &lower, &upper);
    memcpy(region->lower, &lower.x, sizeof region->lower);
    memcpy(region->upper, &upper.x, sizeof region->upper);
    return springls__has_films(desc) || desc->film || springls__pushes(desc);
}

/* Returns the velocity of the walls at a place as a callback gets it, in the units of the forces. */
SPRINGLS__FN springls__v3 springls__film_velocity_at(const springls__tiling_push *push, int32_t facing, const float *place)
{
    const springls_context *host = push->tiling->host;
    const bool in_voxels = push->desc->voxel_units || host->lattice_is_world; /* the grid of a tiling does not move */
    const springls__v3 x = in_voxels ? springls__load3(place) : springls__world_to_voxel(host, place);
    const springls__v3 v = springls__film_velocity(push->tiling, push->body->label, facing, x);
    return in_voxels ? v : springls__transform_vector(host->window.to_world, v);
}

/* Adds the velocities of the walls. */
SPRINGLS__FN void springls__add_film_velocity(const springls__tiling_push *push, const springls_batch *given, float *out)
{
    const float *facing = springls__facing_values(push->body);
    int i, k;
    for (i = 0; i < given->count; i++) {
        const int32_t faced = facing ? (int32_t)facing[given->springls[i]] : SPRINGLS__NO_LABEL;
        const springls__v3 v = springls__film_velocity_at(push, faced, given->points + 3 * i);
        for (k = 0; k < 3; k++) out[3 * i + k] += (&v.x)[k];
    }
}

SPRINGLS__FN void springls__tiling_velocity(void *user, const springls_batch *given, float *out)
{
    const springls__tiling_push *push = (const springls__tiling_push *)user;
    memset(out, 0, 3 * (size_t)given->count * sizeof *out);
    if (push->desc->velocity) springls__ask(push, push->desc->velocity, 3, given, out);
    if (springls__has_films(push->desc)) springls__add_film_velocity(push, given, out);
}

SPRINGLS__FN void springls__tiling_pressure(void *user, const springls_batch *given, float *out)
{
    const springls__tiling_push *push = (const springls__tiling_push *)user;
    int i;
    springls__ask(push, push->desc->pressure, 1, given, out);
    for (i = 0; i < given->count; i++) out[i] *= push->body->sign;
}

/* ---- as it was ---- */

/* Keeps a body's model as it is, if that has not been done in this step, and makes sure that going back to it needs no memory. Steps leave
   original surfaces as they are, but a model that is lost with its device loses them, too. */
SPRINGLS__FN springls_status springls__back_up(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    springls_context *ctx = body->ctx;
    const springls_snapshot_kind kind = tiling->backend ? SPRINGLS_SNAPSHOT_KIND_ALL : SPRINGLS_SNAPSHOT_KIND_FRAME;
    springls__snapshot_state state;
    springls__layout layout;
    springls__table tables[2];
    (void)arg;
    if (body->backup_size) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__snapshot_begin(ctx, kind, &state, &layout));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &body->backup, (size_t)layout.size, 1, 0));
    springls__snapshot_write(ctx, &state, &layout, (char *)body->backup.data);
    springls__tables_of_block(ctx, &state, &layout, (const char *)body->backup.data, tables);
    SPRINGLS__TRY(springls__snapshot_reserve(ctx, &state, tables));
    body->backup_size = (size_t)layout.size;
    return SPRINGLS_OK;
}

/* Keeps what a step may change of a body that rests. Its model need not be kept: it is on the host, and a step of it starts no kernel,
   so that it is not lost with the device. */
SPRINGLS__FN void springls__keep_counts(springls__tiling_body *body)
{
    const springls_context *ctx = body->ctx;
    body->counts.time = ctx->time;
    body->counts.iteration = ctx->iteration;
    body->counts.steps = ctx->stats.steps;
    body->counts.step = ctx->model.set.step;
}

SPRINGLS__FN void springls__put_counts_back(const springls__tiling_body *body)
{
    springls_context *ctx = body->ctx;
    ctx->time = body->counts.time;
    ctx->iteration = body->counts.iteration;
    ctx->stats.steps = body->counts.steps;
    ctx->model.set.step = body->counts.step;
}

/* Goes back to the models as they were, where they have been kept, to the counts of the others, and to the counts of rest. */
SPRINGLS__FN void springls__go_back(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        springls_status status = SPRINGLS_OK;
        if (body->backup_size) status = springls_restore(body->ctx, body->backup.data, body->backup_size);
        else springls__put_counts_back(body);
        SPRINGLS_ASSERT(status == SPRINGLS_OK);
        (void)status;
        if (body->rest.looks || body->backup_size) body->rest.calm = 0;
        if (body->backup_size) body->rest.slept = false; /* a model that has been restored has to fall asleep again */
        body->backup_size = 0;
        body->rest.idle = body->rest.idle_before;
    }
}

/* ---- the step ---- */

SPRINGLS__FN springls_status springls__step_body(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    const springls_tiling_step_desc *desc = (const springls_tiling_step_desc *)arg;
    springls__tiling_push push;
    springls_forces forces = springls__tiling_forces(desc);
    springls_step_desc step;
    if (body->ctx->model.set.count == 0) return SPRINGLS_OK;
    push.tiling = tiling;
    push.desc = desc;
    push.body = body;
    forces.user = &push;
    if (body->rest.forced && (desc->velocity || springls__has_films(desc))) forces.velocity_batch = springls__tiling_velocity;
    if (body->rest.forced && desc->pressure) forces.pressure_batch = springls__tiling_pressure;
    memset(&step, 0, sizeof step);
    step.forces = desc->dt > 0.0f ? &forces : NULL;
    step.dt = desc->dt;
    step.max_displacement = desc->max_displacement;
    SPRINGLS__TRY(springls__step_begin(body->ctx, &step)); /* the tiling warns of the region: once, not by each body */
    SPRINGLS__TRY(springls__finish_step(body->ctx));
    springls__release_work(tiling, body->ctx);
    return springls__body_to_host(tiling, body, NULL);
}

/* Returns whether a voxel is among the bricks of a table, beyond which all is outside. */
SPRINGLS__FN bool springls__in_table(const springls__table *t, const int at[3])
{
    return at[0] >= t->lower[0] && at[0] < t->upper[0] && at[1] >= t->lower[1] && at[1] < t->upper[1] && at[2] >= t->lower[2]
           && at[2] < t->upper[2];
}

/* Returns whether the phi of body `own`, which is negative at a voxel, is the lowest of all, as where a place has its label. */
SPRINGLS__FN bool springls__has_voxel(const springls_tiling *tiling, int own, float phi, const int at[3])
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        const springls__grid *g = &tiling->body[i].ctx->model.grid;
        float other;
        if (i > 0 && !springls__in_table(&g->table, at)) continue;
        other = tiling->body[i].sign * springls__grid_phi(g, g->phi, at[0], at[1], at[2]);
        if (i != own && (i < own ? other <= phi : other < phi)) return false;
    }
    return true;
}

/* Returns how many voxels have the label of body `own` by phi, at most SPRINGLS__DOUBTFUL. */
SPRINGLS__FN int springls__count_voxels(const springls_tiling *tiling, int own)
{
    const springls__grid *g = &tiling->body[own].ctx->model.grid;
    const int entries = (int)springls__entry_count(g);
    int e, v, o[3], at[3], count = 0;
    for (e = 0; e < entries; e++) {
        const float *phi = g->phi + (size_t)g->top[e] * SPRINGLS__BRICK_VOXELS;
        if (g->top[e] == SPRINGLS__OUTSIDE) continue;
        springls__entry_origin(g, e, o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            if (phi[v] >= 0.0f) continue;
            springls__voxel_of_brick(o, v, at);
            if (!springls__grid_contains(g, at[0], at[1], at[2]) || !springls__has_voxel(tiling, own, phi[v], at)) continue;
            if (++count == SPRINGLS__DOUBTFUL) return count;
        }
    }
    return count;
}

/* Returns whether no voxel has the label of a body any more. Where that is in doubt, phi of it and of those around it is made to agree
   with the springls for the answer. */
SPRINGLS__FN springls_status springls__find_vanished(springls_tiling *tiling, const char *call, int own, bool *vanished)
{
    springls_status status;
    int i, springls;
    *vanished = tiling->body[own].ctx->model.set.count == 0;
    if (*vanished || springls__count_voxels(tiling, own) == SPRINGLS__DOUBTFUL) return SPRINGLS_OK;
    status = springls__look_at_bodies(tiling, call, &springls);
    for (i = 0; i < tiling->count && status == SPRINGLS_OK; i++) {
        if (!springls__boxes_meet(&tiling->body[i].box, &tiling->body[own].box, 2.0f)) continue;
        status = springls__body_for_reading(tiling, &tiling->body[i], NULL);
        if (status != SPRINGLS_OK) springls__body_failed(tiling, status, call, tiling->body[i].label, tiling->body[i].ctx);
    }
    if (status == SPRINGLS_OK) *vanished = springls__count_voxels(tiling, own) == 0;
    for (i = 0; i < tiling->count; i++) springls__end_reading(tiling->body[i].ctx);
    return status;
}

/* Puts bodies that have vanished behind the others in the list, so that no wall is made with a vanished body, though two sheets of it may
   be left. */
SPRINGLS__FN springls_status springls__set_vanished_aside(springls_tiling *tiling, const char *call)
{
    int i, k;
    for (i = tiling->count - 1; i > 0; i--) {
        const springls__tiling_body body = tiling->body[i];
        bool vanished;
        if (!body.rest.awake) continue;
        SPRINGLS__TRY(springls__find_vanished(tiling, call, i, &vanished));
        if (!vanished) continue;
        tiling->count--;
        for (k = i; k < tiling->count; k++) tiling->body[k] = tiling->body[k + 1];
        tiling->body[k] = body;
    }
    return SPRINGLS_OK;
}

/* Frees the bodies that have been set aside, `count` with them, and lists their labels; there is room for them. Nothing faces them from
   now on. */
SPRINGLS__FN void springls__drop_vanished(springls_tiling *tiling, int count, springls_tiling_report *report)
{
    int32_t *vanished = (int32_t *)tiling->vanished.data;
    int i, k;
    if (count == tiling->count) return;
    report->vanished = vanished;
    for (i = tiling->count; i < count; i++) {
        vanished[report->vanished_count++] = tiling->body[i].label;
        springls__body_free(&tiling->body[i]);
    }
    for (i = 0; i < tiling->count; i++) {
        float *facing = springls__facing_values(&tiling->body[i]);
        for (k = 0; k < springls_count(tiling->body[i].ctx); k++) {
            if (springls__body_number(tiling, (int32_t)facing[k]) >= 0) continue;
            facing[k] = (float)SPRINGLS__NO_LABEL;
            tiling->body[i].rest.calm = 0;
        }
    }
}

/* Sums up the gaps of all bodies. */
SPRINGLS__FN void springls__report_gaps(const springls_tiling *tiling, springls_tiling_report *report)
{
    double sum = 0.0, sum2 = 0.0;
    int i, found = 0;
    for (i = 0; i < tiling->count; i++) {
        const springls__gaps *gaps = &tiling->body[i].gaps;
        found += gaps->springls;
        sum += gaps->sum;
        sum2 += gaps->sum2;
        report->largest_gap = springls__max(report->largest_gap, gaps->largest);
    }
    if (found) {
        report->mean_gap = (float)(sum / (double)found);
        report->rms_gap = (float)sqrt(sum2 / (double)found);
    }
    report->faced = found;
}

/* Returns whether sheets are looked at in this step: in a flow that all labels share they come apart slowly. */
SPRINGLS__FN bool springls__looks_now(const springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const uint32_t usual = desc->pressure || desc->dt == 0.0f ? 1u : (uint32_t)SPRINGLS__MIRROR_PERIOD;
    const uint32_t period = desc->wall_period > 0 ? (uint32_t)desc->wall_period : usual;
    return tiling->steps % period == 0;
}

/* Wakes the bodies beside which something stirs, and lets them make their own step, in which nothing of them changes. */
SPRINGLS__FN springls_status springls__step_woken(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc)
{
    bool woken;
    int i;
    SPRINGLS__TRY(springls__wake_beside_stirring(tiling, &woken));
    for (i = 0; i < tiling->count && woken; i++) {
        springls__tiling_body *body = &tiling->body[i];
        if (!body->rest.awake || body->backup_size) continue;
        body->status = springls__back_up(tiling, body, NULL);
        if (body->status == SPRINGLS_OK) body->status = springls__step_body(tiling, body, desc);
        if (body->status != SPRINGLS_OK) return springls__body_failed(tiling, body->status, call, body->label, body->ctx);
    }
    return SPRINGLS_OK;
}

/* Looks at the walls of the bodies that are awake, closes them, and finds which bodies have met, parted or joined. */
SPRINGLS__FN springls_status springls__work_on_walls(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                     springls_tiling_report *report)
{
    const char *call = "tiling_step";
    springls__pair_list pairs;
    if (tiling->steps % SPRINGLS__MIRROR_PERIOD == 0) {
        SPRINGLS__TRY(springls__mirror_walls(tiling, call, &report->mirrored));
        SPRINGLS__TRY(springls__step_woken(tiling, call, desc));
    }
    if (!springls__looks_now(tiling, desc)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__draw_sheets(tiling, call, desc));
    SPRINGLS__TRY(springls__list_pairs(tiling, call, &pairs));
    SPRINGLS__TRY(springls__find_changes(tiling, &pairs, report));
    SPRINGLS__TRY(springls__prepare_joins(tiling, call, desc, &pairs));
    return springls__report_joins(tiling, report);
}

/* Fails if the time of a resting body is so large that adding dt does not change it: before anything is done. */
SPRINGLS__FN springls_status springls__check_times(springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    int i;
    for (i = 0; i < tiling->count && desc->dt > 0.0f; i++) {
        const springls__tiling_body *body = &tiling->body[i];
        const double time = body->ctx->time;
        if (body->rest.awake || time + (double)desc->dt != time) continue;
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                              "tiling_step: label %d: at time %g a step of %g does not change the time", (int)body->label, time,
                              (double)desc->dt);
    }
    return SPRINGLS_OK;
}

/* Does the work of the bodies that are awake, on a checked description. On failure models are left as they are. */
SPRINGLS__FN springls_status springls__run_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                       springls_tiling_report *report)
{
    const char *call = "tiling_step";
    const bool known = springls__facing_is_known(tiling);
    int i;
    for (i = 0; i < tiling->count && !known; i++) tiling->body[i].rest.awake = tiling->body[i].rest.looks = true;
    SPRINGLS__TRY(springls__for_some(tiling, call, SPRINGLS__AWAKE_BODIES, springls__back_up, NULL));
    SPRINGLS__TRY(springls__find_facing(tiling, call));
    if (springls__has_films(desc)) SPRINGLS__TRY(springls__pull_films(tiling, call, desc));
    SPRINGLS__TRY(springls__for_some(tiling, call, SPRINGLS__AWAKE_BODIES, springls__step_body, desc));
    SPRINGLS__TRY(springls__step_woken(tiling, call, desc));
    SPRINGLS__TRY(springls__set_vanished_aside(tiling, call));
    tiling->steps++;
    springls__count_idle(tiling);
    if (springls__has_bodies(tiling, SPRINGLS__LOOKING_BODIES)) SPRINGLS__TRY(springls__work_on_walls(tiling, desc, report));
    if (springls__looks_now(tiling, desc)) springls__report_gaps(tiling, report);
    SPRINGLS__TRY(springls__for_some(tiling, call, SPRINGLS__AWAKE_BODIES, springls__put_to_rest, NULL));
    return springls__for_some(tiling, call, SPRINGLS__RESTING_BODIES, springls__step_body, desc); /* they only count */
}

/* Fails if the box that forces act in is none. */
SPRINGLS__FN springls_status springls__check_box(springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const springls_forces forces = springls__tiling_forces(desc);
    SPRINGLS__TRY(springls__check_forces(tiling->host, &forces));
    if (!springls__has_films(desc) || !springls__has_box(desc)) return SPRINGLS_OK;
    return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                          "tiling_step: a region is given, but surface tension and held volumes act everywhere");
}

SPRINGLS__FN springls_status springls__check_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const char *call = "tiling_step";
    if (!desc) return springls__fail_null(tiling->host, call, "the description");
    SPRINGLS__TRY(springls__check_amount(tiling->host, call, "dt", (double)desc->dt));
    SPRINGLS__TRY(springls__check_max_displacement(tiling->host, call, desc->max_displacement));
    SPRINGLS__TRY(springls__check_box(tiling, desc));
    if (desc->wall_period < 0)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: wall_period is %d, not 0 or more", call, desc->wall_period);
    SPRINGLS__TRY(springls__check_held(tiling, call, desc));
    if (springls__has_films(desc)) SPRINGLS__TRY(springls__check_voxels(tiling, call));
    if (springls_tiling_count(tiling) == 0)
        return springls__fail(tiling->host, SPRINGLS_EMPTY_MODEL, "%s: the tiling has no bodies", call);
    return SPRINGLS_OK;
}

/* Warns of a box outside the grid, if it is for something. */
SPRINGLS__FN void springls__warn_of_box(const springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const springls_forces forces = springls__tiling_forces(desc);
    if (springls__pushes(desc)) springls__warn_of_region(tiling->host, &forces);
}

/* Makes a step. On failure the tiling is left as it is. */
SPRINGLS__FN springls_status springls__whole_step(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                  springls_tiling_report *report)
{
    springls_status status;
    uint32_t steps;
    springls__force_region region;
    const bool forces = springls__region_of_step(tiling, desc, &region);
    bool facing_known;
    int count, i;
    SPRINGLS__TRY(springls__bodies_to_host(tiling, "tiling_step"));
    SPRINGLS__TRY(springls__wake_bodies(tiling, forces ? &region : NULL, springls__imax(SPRINGLS__MIRROR_PERIOD, desc->wall_period)));
    SPRINGLS__TRY(springls__check_times(tiling, desc));
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->vanished, (size_t)tiling->count, sizeof(int32_t), 0));
    count = tiling->count;
    for (i = 0; i < count; i++) {
        tiling->body[i].backup_size = 0;
        springls__keep_counts(&tiling->body[i]);
    }
    steps = tiling->steps;
    facing_known = tiling->facing_known;
    status = springls__run_tiling_step(tiling, desc, report);
    springls__free_films(tiling);
    if (status == SPRINGLS_OK) {
        springls__drop_vanished(tiling, count, report);
        if (springls__has_films(desc)) springls__give_held(tiling, desc);
        springls__take_neighbors(tiling);
        springls__take_joins(tiling, desc);
        springls__note_rest(tiling);
        springls__note_springls(tiling);
        springls__fit_bodies(tiling);
        return SPRINGLS_OK;
    }
    springls__free_joins(tiling);
    tiling->has_next = false;
    memset(report, 0, sizeof *report);
    tiling->count = count;
    springls__sort_bodies(tiling->body, count);
    springls__go_back(tiling);
    tiling->steps = steps;
    tiling->facing_known = facing_known;
    springls__note_springls(tiling);
    springls__fit_bodies(tiling);
    return status;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                           springls_tiling_report *report)
{
    springls_tiling_report own;
    if (!report) report = &own;
    memset(report, 0, sizeof *report);
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_tiling_step(tiling, desc));
    springls__warn_of_box(tiling, desc);
    return springls__whole_step(tiling, desc, report);
}

SPRINGLS__TILINGS_API springls_tiling_step_desc springls_default_tiling_step_desc(void)
{
    springls_tiling_step_desc desc;
    memset(&desc, 0, sizeof desc);
    return desc;
}

/* Finds what the springls of a body face, before a step does, and leaves the tiling as it is. */
SPRINGLS__FN springls_status springls__look_ahead(springls_tiling *tiling, int number, float *facing)
{
    springls__sheets_job job;
    int springls;
    SPRINGLS__TRY(springls__look_at_bodies(tiling, "tiling_facing", &springls));
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->gap, (size_t)springls + 1, sizeof(float), 0));
    memset(&job, 0, sizeof job);
    job.tiling = tiling;
    job.own = number;
    job.facing = facing;
    job.gap = (float *)tiling->gap.data;
    springls__parallel(tiling->host, springls_count(tiling->body[number].ctx), 64, springls__sheets_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_facing(springls_tiling *tiling, int32_t label, int32_t *out)
{
    const float *facing;
    springls__buffer ahead;
    springls_status status = SPRINGLS_OK;
    int i, number, count;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    number = springls__body_number(tiling, label);
    if (number < 0)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "tiling_facing: there is no body of label %ld", (long)label);
    count = springls_count(tiling->body[number].ctx);
    if (!out && count) return springls__fail_null(tiling->host, "tiling_facing", "out");
    memset(&ahead, 0, sizeof ahead);
    facing = springls__facing_values(&tiling->body[number]);
    if (!springls__facing_is_known(tiling)) {
        SPRINGLS__TRY(springls__buffer_grow(tiling->host, &ahead, (size_t)count + 1, sizeof(float), 0));
        status = springls__look_ahead(tiling, number, (float *)ahead.data);
        facing = (const float *)ahead.data;
    }
    for (i = 0; status == SPRINGLS_OK && i < count; i++) out[i] = (int32_t)facing[i];
    springls__buffer_free(tiling->host, &ahead);
    return status;
}

#endif
