/* join.h - makes one body of two that share a wall. Their sheets there are pushed through each other, so that a union takes both away;
   springls elsewhere stay as they are, with their correspondences, which lie on both original surfaces together. The model of label 0 is
   that of all bodies, and stays as it is. */
#ifndef SPRINGLS__TILING_JOIN_H
#define SPRINGLS__TILING_JOIN_H

#include "../tools/combine.h"
#include "neighbors_of_bodies.h"
#include "sheets.h"

/* Two bodies that become one: its model, which is new, and the label that is gone. */
typedef struct springls__coalescence { springls__tiling_body body; int32_t gone; } springls__coalescence;

/* Pushes the springls of a copy of a body that face a label through the wall. */
SPRINGLS__FN springls_status springls__push_through(springls__tiling_body *copy, int32_t label)
{
    const float push = 0.4f; /* voxel: more than walls have gaps */
    const springls__constellation *set = &copy->ctx->model.set;
    const float *facing = springls__facing_values(copy);
    springls__buffer moved;
    springls_status status;
    springls__v3 *q;
    int i, m;
    memset(&moved, 0, sizeof moved);
    if (!facing) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(copy->ctx, &moved, (size_t)set->count, 4 * sizeof *q, 0));
    q = (springls__v3 *)moved.data;
    for (i = 0; i < set->count; i++) {
        const springls__v3 n = springls__springl_normal(set->s[i]);
        const float way = (int32_t)facing[i] == label ? push : 0.0f;
        for (m = 0; m < 3; m++) q[3 * i + m] = springls__mad(set->s[i].q[m], n, way);
        q[3 * set->count + i] = springls__mad(set->s[i].p, n, way);
    }
    status = springls_write(copy->ctx, 0, set->count, &q->x, &q[3 * set->count].x);
    springls__buffer_free(copy->ctx, &moved);
    return status;
}

/* Lets nothing face a label any more, but another one: of the springls of a body. */
SPRINGLS__FN void springls__face_instead(springls__tiling_body *body, int32_t gone, int32_t instead)
{
    float *facing = springls__facing_values(body);
    int i;
    for (i = 0; facing && i < springls_count(body->ctx); i++) {
        if ((int32_t)facing[i] != gone) continue;
        facing[i] = (float)instead;
        body->rest.calm = 0;
    }
}

/* Makes the model of two bodies that share a wall; they stay as they are. */
SPRINGLS__FN springls_status springls__make_joined(springls_tiling *tiling, const char *call, const springls__tiling_body *kept,
                                                   const springls__tiling_body *gone, springls__coalescence *join)
{
    springls__tiling_body copy;
    springls_status status;
    memset(join, 0, sizeof *join);
    memset(&copy, 0, sizeof copy);
    join->gone = gone->label;
    SPRINGLS__TRY(springls__body_create(tiling, call, kept->label, &join->body));
    status = springls__body_create(tiling, call, gone->label, &copy);
    if (status == SPRINGLS_OK) {
        status = springls__copy_model(join->body.ctx, kept->ctx);
        if (status == SPRINGLS_OK) status = springls__copy_model(copy.ctx, gone->ctx);
        if (status == SPRINGLS_OK) status = springls__push_through(&copy, kept->label);
        if (status == SPRINGLS_OK) status = springls_combine(join->body.ctx, SPRINGLS_OPERATION_UNION, copy.ctx);
        if (status != SPRINGLS_OK) springls__body_failed(tiling, status, call, gone->label, join->body.ctx);
    }
    springls__body_free(&copy);
    if (status == SPRINGLS_OK) {
        springls__face_instead(&join->body, gone->label, SPRINGLS__NO_LABEL);
        springls__face_instead(&join->body, kept->label, SPRINGLS__NO_LABEL);
    } else springls__body_free(&join->body);
    return status;
}

/* Puts a joined body in the place of the two that it was made of. */
SPRINGLS__FN void springls__take_joined(springls_tiling *tiling, springls__coalescence *join)
{
    const int kept = springls__body_number(tiling, join->body.label), gone = springls__body_number(tiling, join->gone);
    int i;
    springls__body_free(&tiling->body[kept]);
    springls__body_free(&tiling->body[gone]);
    tiling->body[kept] = join->body;
    tiling->count--;
    for (i = gone; i < tiling->count; i++) tiling->body[i] = tiling->body[i + 1];
    memset(&tiling->body[tiling->count], 0, sizeof *tiling->body);
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].label != join->body.label) springls__face_instead(&tiling->body[i], join->gone, join->body.label);
    tiling->neighbors_known = false;
}

/* Frees the joined bodies that have been prepared, and not been taken. */
SPRINGLS__FN void springls__free_joins(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->join_count; i++) springls__body_free(&((springls__coalescence *)tiling->joins.data)[i].body);
    tiling->join_count = 0;
}

/* ---- in a step ---- */

/* Finds whether two bodies that share a wall are to be one. */
SPRINGLS__FN springls_status springls__is_to_join(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                  const springls__pair *pair, bool *join)
{
    const double drawn = 0.2; /* voxel: sheets that are no further apart are a wall */
    float thickness;
    const springls_film film = springls__film_between(desc, pair->low, pair->high, &thickness);
    *join = film == SPRINGLS_FILM_JOIN && thickness > 0.0f && pair->springls >= SPRINGLS__MET
            && pair->gap <= drawn * (double)pair->springls;
    return springls__film_is_valid(film, thickness) ? SPRINGLS_OK : springls__refuse_film(tiling, call, desc, pair->low, pair->high);
}

/* Returns whether a label takes part in a join that has been prepared. */
SPRINGLS__FN bool springls__is_joining(const springls_tiling *tiling, int32_t label)
{
    const springls__coalescence *join = (const springls__coalescence *)tiling->joins.data;
    int i;
    for (i = 0; i < tiling->join_count; i++)
        if (join[i].body.label == label || join[i].gone == label) return true;
    return false;
}

/* Prepares the bodies of pairs that are to be one. A body joins one other at a time. */
SPRINGLS__FN springls_status springls__prepare_joins(springls_tiling *tiling, const char *call, const springls_tiling_step_desc *desc,
                                                     const springls__pair_list *pairs)
{
    int i;
    for (i = 0; desc->film && i < pairs->count; i++) {
        const springls__pair *pair = &pairs->pair[i];
        const int kept = springls__body_number(tiling, pair->low), gone = springls__body_number(tiling, pair->high);
        const size_t bytes = (size_t)tiling->join_count * sizeof(springls__coalescence);
        bool join;
        SPRINGLS__TRY(springls__is_to_join(tiling, call, desc, pair, &join));
        if (!join || kept < 0 || gone < 0 || springls__is_joining(tiling, pair->low) || springls__is_joining(tiling, pair->high)) continue;
        SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->joins, (size_t)tiling->join_count + 1, sizeof(springls__coalescence),
                                            bytes));
        SPRINGLS__TRY(springls__make_joined(tiling, call, &tiling->body[kept], &tiling->body[gone],
                                            (springls__coalescence *)tiling->joins.data + tiling->join_count));
        tiling->join_count++;
    }
    return SPRINGLS_OK;
}

/* Makes room for the report of the joins that have been prepared. */
SPRINGLS__FN springls_status springls__report_joins(springls_tiling *tiling, springls_tiling_report *report)
{
    const springls__coalescence *join = (const springls__coalescence *)tiling->joins.data;
    int i;
    for (i = 0; i < tiling->join_count; i++)
        SPRINGLS__TRY(springls__note_pair(tiling, &tiling->joined, &report->joined_count, join[i].body.label, join[i].gone));
    report->joined = report->joined_count ? (const int32_t *)tiling->joined.data : NULL;
    return SPRINGLS_OK;
}

/* Returns the hold of a label, NULL: it is not held. */
SPRINGLS__FN springls_tiling_hold *springls__hold_of(const springls_tiling_step_desc *desc, int32_t label)
{
    int i;
    for (i = 0; i < desc->held_count; i++)
        if (desc->held[i].label == label) return &desc->held[i];
    return NULL;
}

/* Takes the bodies that have been joined. What two of them were held at is held of both together. */
SPRINGLS__FN void springls__take_joins(springls_tiling *tiling, const springls_tiling_step_desc *desc)
{
    springls__coalescence *join = (springls__coalescence *)tiling->joins.data;
    int i;
    for (i = 0; i < tiling->join_count; i++) {
        springls_tiling_hold *kept = springls__hold_of(desc, join[i].body.label), *gone = springls__hold_of(desc, join[i].gone);
        springls__take_joined(tiling, &join[i]);
        if (!kept || !gone) continue;
        kept->target += gone->target;
        kept->volume += gone->volume;
        kept->drift = 0.0;
        gone->target = gone->volume = gone->pressure = gone->drift = 0.0;
    }
    tiling->join_count = 0;
}

/* ---- at once ---- */

SPRINGLS__TILINGS_API springls_status springls_tiling_join(springls_tiling *tiling, int32_t label, int32_t other)
{
    const char *call = "tiling_join";
    springls__coalescence join;
    springls_status status;
    int i, k, kept, gone, facing = 0;
    bool known;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    kept = springls__body_number(tiling, label);
    gone = springls__body_number(tiling, other);
    if (kept < 1 || gone < 1 || kept == gone)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: labels %ld and %ld are no two bodies", call, (long)label,
                              (long)other);
    known = tiling->facing_known;
    SPRINGLS__TRY(springls__find_facing(tiling, call));
    for (i = 0; i < 2; i++) {
        const springls__tiling_body *body = &tiling->body[i ? gone : kept];
        const float *values = springls__facing_values(body);
        for (k = 0; k < springls_count(body->ctx); k++) facing += (int32_t)values[k] == (i ? label : other);
    }
    if (facing < SPRINGLS__MET)
        status = springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: labels %ld and %ld share no wall", call, (long)label,
                                (long)other);
    else status = springls__make_joined(tiling, call, &tiling->body[kept], &tiling->body[gone], &join);
    if (status == SPRINGLS_OK) springls__take_joined(tiling, &join);
    else tiling->facing_known = known;
    return status;
}

#endif
