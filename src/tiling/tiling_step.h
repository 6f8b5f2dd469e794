/* tiling_step.h - a step of a tiling: every body by itself, side by side, then the walls. What fails on the way leaves the tiling as it was. */
#ifndef SPRINGLS__TILING_TILING_STEP_H
#define SPRINGLS__TILING_TILING_STEP_H

#include "../output/restore.h"
#include "../solver/step.h"
#include "mirror.h"
#include "sheets.h"

enum { SPRINGLS__MIRROR_PERIOD = 8, SPRINGLS__TILING_BLOCK = 64 };

/* ---- forces ---- */

/* What the callbacks of a body's model get: whose they are. */
typedef struct springls__tiling_push {
    const springls_tiling_step_desc *desc;
    const springls__tiling_body *body;
} springls__tiling_push;

/* The callback that is asked, and how many floats it answers a point. */
typedef struct springls__tiling_ask { springls_tiling_fn fn; int width; } springls__tiling_ask;

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

SPRINGLS__FN void springls__ask(const springls__tiling_push *push, springls_tiling_fn fn, int width, const springls_batch *given, float *out)
{
    springls__tiling_ask ask;
    int first;
    ask.fn = fn;
    ask.width = width;
    for (first = 0; first < given->count; first += SPRINGLS__TILING_BLOCK)
        springls__ask_part(push, ask, given, first, springls__imin(SPRINGLS__TILING_BLOCK, given->count - first), out);
}

SPRINGLS__FN void springls__tiling_velocity(void *user, const springls_batch *given, float *out)
{
    const springls__tiling_push *push = (const springls__tiling_push *)user;
    springls__ask(push, push->desc->velocity, 3, given, out);
}

SPRINGLS__FN void springls__tiling_pressure(void *user, const springls_batch *given, float *out)
{
    const springls__tiling_push *push = (const springls__tiling_push *)user;
    int i;
    springls__ask(push, push->desc->pressure, 1, given, out);
    for (i = 0; i < given->count; i++) out[i] *= push->body->sign;
}

/* ---- as it was ---- */

/* Keeps a body's model as it is, and makes sure that going back to it needs no memory. */
SPRINGLS__FN springls_status springls__back_up(springls__tiling_body *body)
{
    springls_context *ctx = body->ctx;
    const springls_snapshot_kind kind = SPRINGLS_SNAPSHOT_KIND_FRAME; /* steps leave original surfaces as they are */
    springls__snapshot_state state;
    springls__layout layout;
    springls__table tables[2];
    size_t size;
    body->backup_size = 0;
    SPRINGLS__TRY(springls_snapshot(ctx, kind, NULL, 0, &size));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &body->backup, size, 1, 0));
    SPRINGLS__TRY(springls_snapshot(ctx, kind, body->backup.data, size, &size));
    SPRINGLS__TRY(springls__snapshot_read(ctx, (const char *)body->backup.data, size, &state, &layout));
    springls__tables_of_block(ctx, &state, &layout, (const char *)body->backup.data, tables);
    SPRINGLS__TRY(springls__snapshot_reserve(ctx, &state, tables));
    body->backup_size = size;
    return SPRINGLS_OK;
}

/* Goes back to the models as they were, where they have been kept. */
SPRINGLS__FN void springls__go_back(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        springls_status status = SPRINGLS_OK;
        if (body->backup_size) status = springls_restore(body->ctx, body->backup.data, body->backup_size);
        SPRINGLS_ASSERT(status == SPRINGLS_OK);
        (void)status;
        body->backup_size = 0;
    }
}

/* ---- the step ---- */

SPRINGLS__FN springls_status springls__step_body(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    const springls_tiling_step_desc *desc = (const springls_tiling_step_desc *)arg;
    springls__tiling_push push;
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    (void)tiling;
    SPRINGLS__TRY(springls__back_up(body));
    if (body->ctx->model.set.count == 0) return SPRINGLS_OK;
    push.desc = desc;
    push.body = body;
    forces.user = &push;
    if (desc->velocity) forces.velocity_batch = springls__tiling_velocity;
    if (desc->pressure) forces.pressure_batch = springls__tiling_pressure;
    forces.curvature_weight = desc->curvature_weight;
    forces.integrator = desc->integrator;
    step.forces = desc->dt > 0.0f ? &forces : NULL;
    step.dt = desc->dt;
    step.max_displacement = desc->dt > 0.0f ? desc->max_displacement : 0.0f;
    return springls_step(body->ctx, &step);
}

/* Removes the bodies that have no springl left, and lists their labels; there is room for them. */
SPRINGLS__FN void springls__drop_vanished(springls_tiling *tiling)
{
    int i, n = 1;
    tiling->vanished_count = 0;
    for (i = 1; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        if (body->ctx->model.set.count == 0) {
            ((int32_t *)tiling->vanished.data)[tiling->vanished_count++] = body->label;
            springls__body_free(body);
        } else {
            tiling->body[n++] = *body;
        }
    }
    tiling->count = n;
}

/* Sums up the gaps of all springls that have a sheet before them. */
SPRINGLS__FN void springls__report_gaps(const springls_tiling *tiling, springls_tiling_report *report)
{
    const springls__tiling_body *last = &tiling->body[tiling->count - 1];
    const int springls = last->first + last->ctx->model.set.count;
    const float *gap = (const float *)tiling->gap.data;
    double sum = 0.0, sum2 = 0.0;
    int i, found = 0;
    for (i = 0; i < springls; i++) {
        if (gap[i] == FLT_MAX) continue;
        found++;
        sum += fabs((double)gap[i]);
        sum2 += (double)gap[i] * (double)gap[i];
        report->largest_gap = springls__max(report->largest_gap, springls__fabs(gap[i]));
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
    const uint32_t usual = desc->pressure || desc->curvature_weight != 0.0f || desc->dt == 0.0f ? 1u : (uint32_t)SPRINGLS__MIRROR_PERIOD;
    const uint32_t period = desc->wall_period > 0 ? (uint32_t)desc->wall_period : usual;
    return tiling->steps % period == 0;
}

/* Does the work on a checked description. On failure models are left as they are. */
SPRINGLS__FN springls_status springls__run_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                       springls_tiling_report *report)
{
    const char *call = "tiling_step";
    SPRINGLS__TRY(springls__for_bodies(tiling, call, springls__step_body, desc));
    tiling->steps++;
    if (tiling->steps % SPRINGLS__MIRROR_PERIOD == 0) SPRINGLS__TRY(springls__mirror_walls(tiling, call, &report->mirrored));
    if (!springls__looks_now(tiling, desc)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__draw_sheets(tiling, call));
    springls__report_gaps(tiling, report);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__check_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    const char *call = "tiling_step";
    if (!desc) return springls__fail_null(tiling->host, call, "the description");
    SPRINGLS__TRY(springls__check_amount(tiling->host, call, "dt", (double)desc->dt));
    SPRINGLS__TRY(springls__check_amount(tiling->host, call, "max_displacement", (double)desc->max_displacement));
    if (desc->wall_period < 0)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: wall_period is %d, not 0 or more", call, desc->wall_period);
    if (springls_tiling_count(tiling) == 0)
        return springls__fail(tiling->host, SPRINGLS_EMPTY_MODEL, "%s: the tiling has no bodies", call);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_tiling_step(springls_tiling *tiling, const springls_tiling_step_desc *desc,
                                                  springls_tiling_report *report)
{
    springls_tiling_report own;
    springls_status status;
    uint32_t steps;
    int i;
    if (!report) report = &own;
    memset(report, 0, sizeof *report);
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_tiling_step(tiling, desc));
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->vanished, (size_t)tiling->count, sizeof(int32_t), 0));
    if (!tiling->facing_known) SPRINGLS__TRY(springls__look_at_sheets(tiling, "tiling_step", false));
    for (i = 0; i < tiling->count; i++) tiling->body[i].backup_size = 0;
    steps = tiling->steps;
    status = springls__run_tiling_step(tiling, desc, report);
    if (status == SPRINGLS_OK) {
        springls__drop_vanished(tiling);
        report->vanished = tiling->vanished_count ? (const int32_t *)tiling->vanished.data : NULL;
        report->vanished_count = tiling->vanished_count;
        return SPRINGLS_OK;
    }
    memset(report, 0, sizeof *report);
    springls__go_back(tiling);
    tiling->steps = steps;
    return status;
}

SPRINGLS_API springls_tiling_step_desc springls_default_tiling_step_desc(void)
{
    springls_tiling_step_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.max_displacement = 2.0f;
    return desc;
}

SPRINGLS_API springls_status springls_tiling_facing(springls_tiling *tiling, int32_t label, int32_t *out)
{
    const float *facing;
    int i, number;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    number = springls__body_number(tiling, label);
    if (number < 0)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "tiling_facing: there is no body of label %ld", (long)label);
    if (!out && springls_count(tiling->body[number].ctx)) return springls__fail_null(tiling->host, "tiling_facing", "out");
    if (!tiling->facing_known) SPRINGLS__TRY(springls__look_at_sheets(tiling, "tiling_facing", false));
    facing = springls__facing_values(&tiling->body[number]);
    for (i = 0; i < springls_count(tiling->body[number].ctx); i++) out[i] = facing ? (int32_t)facing[i] : SPRINGLS__NO_LABEL;
    return SPRINGLS_OK;
}

#endif
