/* bodies.h - the bodies of a tiling: one two-phase model for each, and one for all of them together, whose outside is label 0. Each wall
   between two bodies is so two sheets of springls, one of each body, and no stage has to know about labels. What keeps the sheets
   together is in sheets.h and mirror.h.

   Why no place can have two labels or none: the label of a place is that of the model whose phi is lowest there (decode.h), whatever
   the models hold by themselves. */
#ifndef SPRINGLS__TILING_BODIES_H
#define SPRINGLS__TILING_BODIES_H

#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../lifecycle/create.h"
#include "../model/host_access.h"
#include "../output/attributes.h"
#include "../solver/step.h"

enum { SPRINGLS__LARGEST_LABEL = 65535, SPRINGLS__NO_LABEL = -1, SPRINGLS__MOST_IDLE = 256 };

/* The volume of a body, and what holds it (films.h), world units; target 0: nothing does. */
typedef struct springls__held { double target, drift, volume, pressure, missing, way, product; bool is_given; } springls__held;

/* Two bodies that face each other: by how many springls that have a sheet before them, and the sum of their gaps, voxels. */
typedef struct springls__pair { int32_t low, high; int springls; double gap; } springls__pair;

typedef struct springls__pair_list { springls__pair *pair; int count; } springls__pair_list;

/* The springls of a body that have a sheet before them: how many, the sums of their gaps and their squares, and the largest, voxels. */
typedef struct springls__gaps { int springls; double sum, sum2; float largest; } springls__gaps;

/* What a step of a resting model changes: it only counts. */
typedef struct springls__counts { double time; int iteration, steps; uint32_t step; } springls__counts;

/* How a body comes to rest, and whether it takes part in the step at work (tiling_rest.h). One that is not awake has slept as the step
   began, and only counts. One that is put, and has slept, may look, but takes no part. One that is put and not asleep takes part without
   being drawn to others. One that is awake looks. */
typedef struct springls__body_rest {
    uint64_t version, stepped; /* springls_version of the model: as the step began, and after the last one            */
    springls__box box;         /* of its particles after the last step, voxels                                         */
    int idle, idle_before;     /* steps without forces, the last ones, at most MOST_IDLE; as the step began            */
    int calm;                  /* how many steps, the last ones, have changed nothing of it nor beside it              */
    uint64_t facing_hash;      /* of what its springls faced after the last one in which it was awake                  */
    bool awake;                /* takes part in the step                                                               */
    bool looks;                /* its sheets are looked at, where the step looks                                       */
    bool put;                  /* it has been put to rest as it is, and stays so                                       */
    bool forced, driven;       /* forces act on it; or on a body beside it, or one of them may not sleep               */
    bool slept, beside;        /* the model was asleep as the step began; something has stirred in one of its bricks   */
} springls__body_rest;

/* One body. Label 0 comes first: its model is the union of all other bodies, and the inside of that model is the outside of label 0. */
typedef struct springls__tiling_body {
    springls_context *ctx;
    int32_t label;
    float sign;                /* of phi and normals: -1 for label 0                                                 */
    springls__box box;         /* of its particles, voxels (springls__look_at_bodies)                                */
    uint64_t boxed;            /* the springls_version that it is of; 0: there is none                               */
    springls__buffer backup;   /* the model as it was when the step began; memory of ctx                             */
    size_t backup_size;
    springls__counts counts;   /* as the step began: all that changes of a body without a backup                       */
    size_t block_size;         /* of the model in a snapshot that is being written                                   */
    springls_status status;    /* of the work that was done for all bodies                                           */
    springls__held held;
    int first;                 /* its springls begin there in arrays of all springls                                 */
    springls__body_rest rest;
    springls__gaps gaps;       /* as of the last look at its sheets; and the pairs that it is part of, label 0 left out */
    springls__pair_list pairs;
    springls__buffer pair_memory; /* memory of ctx                                                                   */
} springls__tiling_body;

struct springls_tiling {
    springls_context *host;    /* an empty model: memory, errors, threads, the grid's place                          */
    springls_backend *backend; /* of all bodies, one after the other; NULL: they are worked on side by side, on threads */
    springls__tiling_body *body; /* ascending by label, label 0 first; memory of `bodies`                            */
    int count;                 /* with that of label 0; 0: nothing has been set                                      */
    springls__buffer bodies;
    springls__buffer shift, gap, flag, added, vanished; /* working memory: of all springls, of one body's, events    */
    springls__buffer films, film_memory[4]; /* working memory: of the walls' vertices, of all voxels (films.h)        */
    springls__buffer junctions; /* working memory: vertices of the walls with four labels (films.h)                  */
    int junction_count;
    springls__pair_list next_pairs; /* neighbours after the step that runs                                          */
    springls__buffer neighbors, next; /* bodies that share walls (neighbors_of_bodies.h): as of the last look, and of the step that runs */
    int neighbor_count;
    bool neighbors_known, has_next;
    springls__buffer met, parted, joined, pairs; /* working memory: events, and all pairs that face each other        */
    springls__buffer joins;    /* bodies that are to be one when the step has succeeded (join.h)                       */
    int join_count;
    springls_walls walls;      /* in a step that has surface tension, or holds volumes                               */
    uint32_t steps;            /* since all bodies were set                                                          */
    bool facing_known;         /* a step has given every springl the label that it faces                             */
    springls__buffer marked;   /* working memory: a byte for each brick of the grid, `mark` where it is marked (tiling_rest.h) */
    uint8_t mark;
};

/* The attribute that holds the label that a springl faces. */
static const char *const springls__facing_name = "tiling.facing";

/* Returns the number of the body of a label, -1 if there is none. */
SPRINGLS__FN int springls__body_number(const springls_tiling *tiling, int32_t label)
{
    int low = 0, high = tiling->count;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (tiling->body[middle].label < label) low = middle + 1;
        else high = middle;
    }
    return low < tiling->count && tiling->body[low].label == label ? low : -1;
}

/* Frees a body's model and its backup. */
SPRINGLS__FN void springls__body_free(springls__tiling_body *body)
{
    if (body->ctx) springls__buffer_free(body->ctx, &body->backup);
    if (body->ctx) springls__buffer_free(body->ctx, &body->pair_memory);
    springls_destroy(body->ctx);
    memset(body, 0, sizeof *body);
}

SPRINGLS__FN void springls__bodies_free(springls_context *host, springls__buffer *bodies, int count)
{
    int i;
    for (i = 0; i < count; i++) springls__body_free((springls__tiling_body *)bodies->data + i);
    springls__buffer_free(host, bodies);
}

/* Fails with what went wrong in the model of a label; its text follows the call's name. */
SPRINGLS__FN springls_status springls__body_failed(springls_tiling *tiling, springls_status status, const char *call, int32_t label,
                                                   const springls_context *ctx)
{
    return springls__fail(tiling->host, status, "%s: label %d: %.180s", call, (int)label,
                          ctx ? ctx->error : springls_status_string(status));
}

/* Creates an empty model for a label. */
SPRINGLS__FN springls_status springls__body_create(springls_tiling *tiling, const char *call, int32_t label,
                                                   springls__tiling_body *body)
{
    memset(body, 0, sizeof *body);
    SPRINGLS__TRY(springls__create_alike_on(tiling->host, call, tiling->backend, &body->ctx));
    body->label = label;
    body->sign = label == 0 ? -1.0f : 1.0f;
    return SPRINGLS_OK;
}

/* Lets all bodies begin anew to come to rest. */
SPRINGLS__FN void springls__end_rest(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++) {
        springls__body_rest *rest = &tiling->body[i].rest;
        rest->idle = rest->calm = 0;
        rest->put = false;
    }
}

/* Replaces the bodies by `count` others, ascending by label. */
SPRINGLS__FN void springls__take_bodies(springls_tiling *tiling, springls__buffer *bodies, int count)
{
    springls__bodies_free(tiling->host, &tiling->bodies, tiling->count);
    tiling->bodies = *bodies;
    tiling->body = (springls__tiling_body *)bodies->data;
    tiling->count = count;
    tiling->steps = 0;
    tiling->facing_known = false;
    tiling->neighbors_known = false;
    tiling->neighbor_count = 0;
    springls__end_rest(tiling);
}

/* Orders bodies by their labels. Nearly all are in order. */
SPRINGLS__FN void springls__sort_bodies(springls__tiling_body *body, int count)
{
    int i, k;
    for (i = 1; i < count; i++) {
        const springls__tiling_body moved = body[i];
        for (k = i; k > 0 && body[k - 1].label > moved.label; k--) body[k] = body[k - 1];
        body[k] = moved;
    }
}

/* Returns the box of a model's particles, voxels. */
SPRINGLS__FN springls__box springls__particle_box(const springls_context *ctx)
{
    const springls__constellation *set = &ctx->model.set;
    springls__box box = springls__box_empty();
    int i;
    for (i = 0; i < set->count; i++) box = springls__box_add(box, set->s[i].p);
    return box;
}

/* Returns whether the sheets of a body are drawn to those of others: it has not been put to rest as it is. */
SPRINGLS__FN bool springls__settles(const springls__tiling_body *body) { return body->rest.idle < SPRINGLS__MOST_IDLE; }

/* Returns the labels that the springls of a body face, as floats; NULL if they have none. */
SPRINGLS__FN float *springls__facing_values(const springls__tiling_body *body)
{
    const int i = springls_find_attribute(body->ctx, springls__facing_name);
    return i < 0 || body->ctx->attributes[i].channels != 1 ? NULL : (float *)body->ctx->attributes[i].values.data;
}

/* Gives the springls of a body the attribute for what they face, where they have none: it is gone when a caller has replaced the model. */
SPRINGLS__FN springls_status springls__make_facing(springls__tiling_body *body)
{
    const springls_attribute_desc desc
        = { springls__facing_name, 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    return springls__facing_values(body) ? SPRINGLS_OK : springls_add_attribute(body->ctx, &desc, NULL, NULL);
}

/* Returns whether the attribute of every body has what its springls face. */
SPRINGLS__FN bool springls__facing_is_known(const springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (!springls__facing_values(&tiling->body[i])) return false;
    return tiling->facing_known;
}

/* A loop over bodies, each by itself on any thread, or with a backend on the caller's; the status of each is in body->status. */
typedef springls_status (*springls__body_fn)(springls_tiling *tiling, springls__tiling_body *body, const void *arg);
typedef enum springls__which {
    SPRINGLS__ALL_BODIES,
    SPRINGLS__AWAKE_BODIES,
    SPRINGLS__RESTING_BODIES, /* the others */
    SPRINGLS__LOOKING_BODIES
} springls__which;
typedef struct springls__body_job {
    springls_tiling *tiling;
    springls__which which;
    springls__body_fn run;
    const void *arg;
} springls__body_job;

SPRINGLS__FN bool springls__is_among(const springls__tiling_body *body, springls__which which)
{
    if (which == SPRINGLS__LOOKING_BODIES) return body->rest.looks;
    return which == SPRINGLS__ALL_BODIES || body->rest.awake == (which == SPRINGLS__AWAKE_BODIES);
}

SPRINGLS__FN void springls__body_task(void *arg, int begin, int end)
{
    const springls__body_job *job = (const springls__body_job *)arg;
    for (; begin < end; begin++) {
        springls__tiling_body *body = &job->tiling->body[begin];
        body->status = SPRINGLS_OK;
        if (springls__is_among(body, job->which)) body->status = (job->run)(job->tiling, body, job->arg);
    }
}

SPRINGLS__FN bool springls__has_bodies(const springls_tiling *tiling, springls__which which)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (springls__is_among(&tiling->body[i], which)) return true;
    return false;
}

/* Runs a function for each of these bodies; fails with the failure of the lowest label. */
SPRINGLS__FN springls_status springls__for_some(springls_tiling *tiling, const char *call, springls__which which, springls__body_fn run,
                                                const void *arg)
{
    springls__body_job job;
    int i;
    if (!springls__has_bodies(tiling, which)) return SPRINGLS_OK;
    job.tiling = tiling;
    job.which = which;
    job.run = run;
    job.arg = arg;
    if (tiling->backend) springls__body_task(&job, 0, tiling->count);
    else springls__parallel(tiling->host, tiling->count, 1, springls__body_task, &job);
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].status != SPRINGLS_OK)
            return springls__body_failed(tiling, tiling->body[i].status, call, tiling->body[i].label, tiling->body[i].ctx);
    return SPRINGLS_OK;
}

/* Runs a function for each body. */
SPRINGLS__FN springls_status springls__for_bodies(springls_tiling *tiling, const char *call, springls__body_fn run, const void *arg)
{
    return springls__for_some(tiling, call, SPRINGLS__ALL_BODIES, run, arg);
}

/* Brings a body's model to the host, where the walls are worked on. */
SPRINGLS__FN springls_status springls__body_to_host(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    (void)tiling, (void)arg;
    return springls__use_host_calmly(body->ctx, false);
}

/* Makes phi of a body agree with its springls, for reading on the host. */
SPRINGLS__FN springls_status springls__body_for_reading(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    SPRINGLS__TRY(springls__begin_reading(body->ctx));
    return springls__body_to_host(tiling, body, arg);
}

/* Brings the models of all bodies to the host: a caller may have left them on the device. */
SPRINGLS__FN springls_status springls__bodies_to_host(springls_tiling *tiling, const char *call)
{
    return tiling->backend ? springls__for_bodies(tiling, call, springls__body_to_host, NULL) : SPRINGLS_OK;
}

/* ---- public calls ---- */

/* Returns what a tiling cannot have of a description, or NULL. */
SPRINGLS__FN const char *springls__tiling_fault(const springls_desc *desc)
{
    if (desc->follow || desc->window[0] || desc->window[1] || desc->window[2])
        return "the grid of a tiling does not move: follow and window have to be zero";
    return NULL;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_create(const springls_desc *desc, springls_tiling **out)
{
    springls_desc plain;
    springls_tiling *tiling;
    springls_context *host;
    if (out) *out = NULL;
    if (!desc) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__create_fail(desc, SPRINGLS_INVALID_ARGUMENT, "out is NULL");
    if (springls__tiling_fault(desc)) return springls__create_fail(desc, SPRINGLS_INVALID_ARGUMENT, springls__tiling_fault(desc));
    plain = *desc;
    memset(&plain.progress, 0, sizeof plain.progress);
    memset(&plain.trace, 0, sizeof plain.trace);
    plain.backend = NULL;
    SPRINGLS__TRY(springls_create(&plain, &host));
    tiling = (springls_tiling *)springls__allocate(host, sizeof *tiling);
    if (!tiling) {
        springls_destroy(host);
        return springls__create_fail(desc, SPRINGLS_OUT_OF_MEMORY, "out of memory");
    }
    memset(tiling, 0, sizeof *tiling);
    tiling->host = host;
    tiling->backend = desc->backend;
    *out = tiling;
    return SPRINGLS_OK;
}

SPRINGLS__TILINGS_API void springls_tiling_destroy(springls_tiling *tiling)
{
    springls_context *host = tiling ? tiling->host : NULL;
    int i;
    if (!tiling) return;
    springls__bodies_free(host, &tiling->bodies, tiling->count);
    springls__buffer_free(host, &tiling->shift);
    springls__buffer_free(host, &tiling->gap);
    springls__buffer_free(host, &tiling->flag);
    springls__buffer_free(host, &tiling->added);
    springls__buffer_free(host, &tiling->vanished);
    springls__buffer_free(host, &tiling->films);
    springls__buffer_free(host, &tiling->junctions);
    springls__buffer_free(host, &tiling->neighbors);
    springls__buffer_free(host, &tiling->next);
    springls__buffer_free(host, &tiling->met);
    springls__buffer_free(host, &tiling->parted);
    springls__buffer_free(host, &tiling->joined);
    springls__buffer_free(host, &tiling->pairs);
    springls__buffer_free(host, &tiling->joins);
    springls__buffer_free(host, &tiling->marked);
    for (i = 0; i < 4; i++) springls__buffer_free(host, &tiling->film_memory[i]);
    springls__release(host, tiling, sizeof *tiling);
    springls_destroy(host);
}

SPRINGLS__TILINGS_API const char *springls_tiling_last_error(const springls_tiling *tiling)
{
    return tiling ? springls_last_error(tiling->host) : "no tiling";
}

SPRINGLS__TILINGS_API size_t springls_tiling_memory_used(const springls_tiling *tiling)
{
    size_t bytes = tiling ? springls_memory_used(tiling->host) : 0;
    int i;
    for (i = 0; tiling && i < tiling->count; i++) bytes += springls_memory_used(tiling->body[i].ctx);
    return bytes;
}

SPRINGLS__TILINGS_API int springls_tiling_count(const springls_tiling *tiling)
{
    return tiling && tiling->count ? tiling->count - 1 : 0;
}

SPRINGLS__TILINGS_API int32_t springls_tiling_label(const springls_tiling *tiling, int number)
{
    return number < 0 || number >= springls_tiling_count(tiling) ? SPRINGLS__NO_LABEL : tiling->body[number + 1].label;
}

SPRINGLS__TILINGS_API springls_context *springls_tiling_body(const springls_tiling *tiling, int32_t label)
{
    const int i = tiling ? springls__body_number(tiling, label) : -1;
    return i < 0 ? NULL : tiling->body[i].ctx;
}

#endif
