/* decode.h - what label is where: that of the model whose phi is lowest, the lower label where two are equal. The outside of label 0 has
   phi of all bodies together, negated. So every place has one label, and no body a gap or an overlap beside it. */
#ifndef SPRINGLS__TILING_DECODE_H
#define SPRINGLS__TILING_DECODE_H

#include "../model/transform.h"
#include "../output/measure.h"
#include "../output/query.h"
#include "set_labels.h"
#include "sheets.h"

/* Makes phi of a body agree with its springls, for reading, and finds the body's box. */
SPRINGLS__FN springls_status springls__read_body(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    SPRINGLS__TRY(springls__body_for_reading(tiling, body, arg));
    return springls__look_at_body(tiling, body, arg);
}

/* The same for all bodies of a tiling that has some. */
SPRINGLS__FN springls_status springls__read_bodies(springls_tiling *tiling, const char *call)
{
    if (springls_tiling_count(tiling) == 0)
        return springls__fail(tiling->host, SPRINGLS_EMPTY_MODEL, "%s: the tiling has no bodies", call);
    return springls__for_bodies(tiling, call, springls__read_body, NULL);
}

/* Returns the number of the body at a place, voxels. Beyond its box and the band phi of a body is that of its outside. */
SPRINGLS__FN int springls__tiling_body_at(const springls_tiling *tiling, springls__v3 x)
{
    float least = 0.0f;
    int i, found = 0;
    for (i = 0; i < tiling->count; i++) {
        const springls__grid *g = &tiling->body[i].ctx->model.grid;
        float phi;
        if (i > 0 && !springls__in_reach(&tiling->body[i].box, x, g->far_value + 2.0f)) continue;
        phi = tiling->body[i].sign * springls__grid_sample(g, g->phi, x);
        if (i > 0 && phi >= least) continue;
        least = phi;
        found = i;
    }
    return found;
}

typedef struct springls__labels_query { const springls_tiling *tiling; const float *points; int32_t *out; } springls__labels_query;

SPRINGLS__FN void springls__sample_labels_task(void *arg, int begin, int end)
{
    const springls__labels_query *q = (const springls__labels_query *)arg;
    for (; begin < end; begin++) {
        const springls__v3 x = springls__world_to_voxel(q->tiling->host, q->points + 3 * (size_t)begin);
        q->out[begin] = q->tiling->body[springls__tiling_body_at(q->tiling, x)].label;
    }
}

SPRINGLS__TILINGS_API springls_status springls_tiling_sample_labels(springls_tiling *tiling, const float *points, int count, int32_t *out)
{
    springls__labels_query q;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_points(tiling->host, points, count, out, "tiling_sample_labels"));
    SPRINGLS__TRY(springls__read_bodies(tiling, "tiling_sample_labels"));
    q.tiling = tiling;
    q.points = points;
    q.out = out;
    springls__parallel(tiling->host, count, 256, springls__sample_labels_task, &q);
    return SPRINGLS_OK;
}

/* ---- every voxel ---- */

/* Enters a body in the brick of an entry of its top table, wherever its phi is below that of the bodies before it. */
SPRINGLS__FN void springls__decode_brick(const springls__tiling_body *body, int entry, float *least, int32_t *out)
{
    const springls__grid *g = &body->ctx->model.grid;
    const float *phi = g->phi + (size_t)g->top[entry] * SPRINGLS__BRICK_VOXELS;
    int o[3], at[3], v;
    springls__entry_origin(g, entry, o);
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
        const float value = body->sign * phi[v];
        size_t i;
        springls__voxel_of_brick(o, v, at);
        if (!springls__grid_contains(g, at[0], at[1], at[2])) continue;
        i = springls__voxel_index(g, at[0], at[1], at[2]);
        if (body->label != 0 && value >= least[i]) continue;
        least[i] = value;
        out[i] = body->label;
    }
}

/* Finds the label of every voxel, and the phi of its body, which has been made to agree with the springls. */
SPRINGLS__FN void springls__decode(const springls_tiling *tiling, float *least, int32_t *out)
{
    const size_t n = springls__box_voxels(tiling->host->model.grid.size);
    size_t v;
    int i, e;
    for (v = 0; v < n; v++) {
        least[v] = -tiling->body[0].ctx->model.grid.far_value;
        out[v] = 0;
    }
    for (i = 0; i < tiling->count; i++) {
        const springls__grid *g = &tiling->body[i].ctx->model.grid;
        const int entries = (int)springls__entry_count(g);
        for (e = 0; e < entries; e++)
            if (g->top[e] != SPRINGLS__OUTSIDE) springls__decode_brick(&tiling->body[i], e, least, out);
    }
}

SPRINGLS__TILINGS_API springls_status springls_tiling_copy_labels(springls_tiling *tiling, int32_t *out)
{
    springls__buffer least;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail_null(tiling->host, "tiling_copy_labels", "out");
    SPRINGLS__TRY(springls__read_bodies(tiling, "tiling_copy_labels"));
    memset(&least, 0, sizeof least);
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &least, springls__box_voxels(tiling->host->model.grid.size), sizeof(float), 0));
    springls__decode(tiling, (float *)least.data, out);
    springls__buffer_free(tiling->host, &least);
    return SPRINGLS_OK;
}

/* ---- measures ---- */

/* Counts the voxels of each label, and measures each body's surface. */
SPRINGLS__FN springls_status springls__measure_tiling(springls_tiling *tiling, const int32_t *labels, springls_tiling_measures *out)
{
    const size_t n = springls__box_voxels(tiling->host->model.grid.size);
    springls_measures measures;
    size_t v;
    int i;
    for (i = 1; i < tiling->count; i++) {
        springls__tiling_body *body = &tiling->body[i];
        const springls_status status = springls_measure(body->ctx, &measures);
        if (status != SPRINGLS_OK) return springls__body_failed(tiling, status, "tiling_measure", body->label, body->ctx);
        out[i - 1].label = body->label;
        out[i - 1].springls = springls_count(body->ctx);
        out[i - 1].voxels = 0;
        out[i - 1].volume = measures.volume;
        out[i - 1].area = measures.area;
    }
    for (v = 0; v < n; v++)
        if (labels[v]) out[springls__body_number(tiling, labels[v]) - 1].voxels++;
    return SPRINGLS_OK;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_measure(springls_tiling *tiling, springls_tiling_measures *out)
{
    springls__buffer labels;
    springls_status status;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail_null(tiling->host, "tiling_measure", "out");
    memset(&labels, 0, sizeof labels);
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &labels, springls__box_voxels(tiling->host->model.grid.size), sizeof(int32_t), 0));
    status = springls_tiling_copy_labels(tiling, (int32_t *)labels.data);
    if (status == SPRINGLS_OK) status = springls__measure_tiling(tiling, (const int32_t *)labels.data, out);
    springls__buffer_free(tiling->host, &labels);
    return status;
}

SPRINGLS__TILINGS_API uint64_t springls_tiling_state_hash(const springls_tiling *tiling)
{
    uint64_t hash = SPRINGLS__HASH_BEGIN;
    int i;
    for (i = 0; tiling && i < tiling->count; i++) {
        const springls__tiling_body *body = &tiling->body[i];
        const uint64_t of_body = springls_state_hash(body->ctx);
        const float *facing = springls__facing_values(body);
        hash = springls__hash(hash, &body->label, sizeof body->label);
        hash = springls__hash(hash, &of_body, sizeof of_body);
        if (facing && tiling->facing_known) hash = springls__hash(hash, facing, (size_t)springls_count(body->ctx) * sizeof *facing);
    }
    return tiling ? hash : 0;
}

#endif
