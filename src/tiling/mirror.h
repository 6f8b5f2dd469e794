/* mirror.h - closes the walls: a springl whose wall has no sheet of the other body before it gives that body one, turned round, with its
   own correspondence. Each body by itself fills its gaps along a sharp rim late, and from its own side alone; the other body, on
   whose face the rim's wall is smooth, knows where it lies. */
#ifndef SPRINGLS__TILING_MIRROR_H
#define SPRINGLS__TILING_MIRROR_H

#include "../stages/inherit.h"
#include "../stages/sleep.h"
#include "sheets.h"

/* A springl to be added to a body, in the coordinates of the body's model, and the label that the springl faces. */
typedef struct springls__mirrored { springls__springl s; springls__v3 a; uint32_t generation; int32_t facing; } springls__mirrored;

/* Marks the springls of body `from` that face body `to` and have no partner there. Those that sleep give none: they have given theirs
   before, and what has been removed since would be removed again. */
typedef struct springls__mirror_job {
    const springls__tiling_body *from, *to;
    const float *facing;
    uint8_t *alone; /* a springl of `from` */
} springls__mirror_job;

/* Returns whether a springl of another body, at p and with normal m, is the partner of one at x with normal n. */
SPRINGLS__FN bool springls__is_partner(springls__v3 x, springls__v3 n, springls__v3 p, springls__v3 m)
{
    const float opposed = -0.3f; /* cosine, at most */
    return springls__length2(springls__sub(p, x)) < SPRINGLS__WALL_REACH * SPRINGLS__WALL_REACH && springls__dot(m, n) < opposed;
}

/* Returns whether the body has a partner for a springl at x with normal n. */
SPRINGLS__FN bool springls__has_partner(const springls__tiling_body *body, springls__v3 x, springls__v3 n)
{
    const springls__model *model = &body->ctx->model;
    springls__cell_walk walk = springls__cell_walk_near(model, x, SPRINGLS__WALL_REACH);
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__is_partner(x, n, model->set.s[i].p,
                                 springls__scale(springls__springl_normal(model->set.s[i]), body->sign))) return true;
    return false;
}

SPRINGLS__FN void springls__mirror_task(void *arg, int begin, int end)
{
    const springls__mirror_job *job = (const springls__mirror_job *)arg;
    for (; begin < end; begin++) {
        const springls__springl *s = &job->from->ctx->model.set.s[begin];
        job->alone[begin] = (int32_t)job->facing[begin] == job->to->label && !springls__is_asleep(&job->from->ctx->model, begin)
            && !springls__has_partner(job->to, s->p, springls__scale(springls__springl_normal(*s), job->from->sign));
    }
}

/* Returns whether one of the springls that are to be added is already the partner of this one. */
SPRINGLS__FN bool springls__is_mirrored_in(const springls__mirrored *added, int count, float sign, springls__v3 x, springls__v3 n)
{
    int i;
    for (i = 0; i < count; i++)
        if (springls__is_partner(x, n, added[i].s.p, springls__scale(springls__springl_normal(added[i].s), sign))) return true;
    return false;
}

/* Collects what body `to` gets from body `from`, behind *count others. */
SPRINGLS__FN springls_status springls__collect_mirrored(springls_tiling *tiling, const springls__tiling_body *from,
                                                        const springls__tiling_body *to, int *count)
{
    const springls__constellation *set = &from->ctx->model.set;
    springls__mirror_job job;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->flag, (size_t)set->count + 1, 1, 0));
    job.from = from;
    job.to = to;
    job.facing = springls__facing_values(from);
    job.alone = (uint8_t *)tiling->flag.data;
    springls__parallel(tiling->host, set->count, 64, springls__mirror_task, &job);
    for (i = 0; i < set->count; i++) {
        const springls__v3 n = springls__scale(springls__springl_normal(set->s[i]), from->sign);
        springls__mirrored *added = (springls__mirrored *)tiling->added.data;
        if (!job.alone[i] || springls__is_mirrored_in(added, *count, to->sign, set->s[i].p, n)) continue;
        SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->added, (size_t)*count + 1, sizeof *added,
                                            (size_t)*count * sizeof *added));
        added = (springls__mirrored *)tiling->added.data + (*count)++;
        added->s = from->sign == to->sign ? springls__reversed(set->s[i]) : set->s[i];
        added->a = set->a[i];
        added->generation = set->generation[i] + 1u;
        added->facing = from->label;
    }
    return SPRINGLS_OK;
}

/* Adds the first `count` springls that have been collected to a body, or none where max_springls has no room for all. Other attributes
   of theirs follow the policy for fills. */
SPRINGLS__FN springls_status springls__add_mirrored(springls_tiling *tiling, springls__tiling_body *body, const springls__mirrored *added,
                                                    int count)
{
    springls_context *ctx = body->ctx;
    const int before = ctx->model.set.count;
    float *facing;
    int i;
    if (count == 0) return SPRINGLS_OK;
    if (before + count > ctx->desc.max_springls) {
        ctx->stats.refused += count;
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__begin_change(ctx)); /* phi follows: it agrees with the new springls where they are now */
    SPRINGLS__TRY(springls__body_to_host(tiling, body, NULL));
    SPRINGLS__TRY(springls__constellation_reserve(ctx, before + count));
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__SET_BITS));
    for (i = 0; i < count; i++) springls__constellation_append(ctx, &added[i].s, added[i].a, added[i].generation, 0);
    springls__stir(ctx, SPRINGLS__STIR_ALL, before, count);
    ctx->stats.added += count;
    springls__constellation_changed(ctx);
    SPRINGLS__TRY(springls__attributes_after_fill(ctx, before));
    facing = springls__facing_values(body);
    for (i = 0; i < count; i++) facing[before + i] = (float)added[i].facing;
    return SPRINGLS_OK;
}

/* Gives each body that is awake the springls that its walls miss; *mirrored counts them. */
SPRINGLS__FN springls_status springls__mirror_walls(springls_tiling *tiling, const char *call, int *mirrored)
{
    int springls, to, from, count;
    SPRINGLS__TRY(springls__look_at_bodies(tiling, call, &springls));
    for (to = 0; to < tiling->count; to++) {
        springls__tiling_body *body = &tiling->body[to];
        const int before = body->ctx->model.set.count;
        springls_status status;
        if (!body->rest.awake || body->rest.put) continue;
        status = springls__read_cell_list(body->ctx);
        for (from = count = 0; from < tiling->count && status == SPRINGLS_OK; from++)
            if (from != to && tiling->body[from].rest.awake && springls__boxes_meet(&body->box, &tiling->body[from].box, 1.0f))
                SPRINGLS__TRY(springls__collect_mirrored(tiling, &tiling->body[from], body, &count));
        if (status == SPRINGLS_OK) status = springls__add_mirrored(tiling, body, (const springls__mirrored *)tiling->added.data, count);
        if (status != SPRINGLS_OK) return springls__body_failed(tiling, status, call, body->label, body->ctx);
        *mirrored += body->ctx->model.set.count - before;
    }
    return SPRINGLS_OK;
}

#endif
