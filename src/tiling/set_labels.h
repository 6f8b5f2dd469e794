/* set_labels.h - makes a tiling of a label map, and adds bodies to one.

   Where a label map is smoothed, each label's indicator (1 in its voxels, else 0) is smoothed by itself, and a wall lies where the two
   largest at a place are equal: so neighbours have one wall, whichever of the two makes it. A voxel's own label stays the largest there:
   what smoothing would take from it is left a little inside. */
#ifndef SPRINGLS__TILING_SET_LABELS_H
#define SPRINGLS__TILING_SET_LABELS_H

#include "../input/set_level_set.h"
#include "../input/set_mesh.h"
#include "../tools/combine.h"
#include "bodies.h"

enum { SPRINGLS__MOST_PASSES = 32 };

/* Where a label is in the map: how many voxels, and their box, both ends in it. */
typedef struct springls__label_place { int count, lower[3], upper[3]; } springls__label_place;

/* A label map, and of each voxel the two largest smoothed indicators. `own` has those of the label at work in the box from `lower` on. */
typedef struct springls__label_map {
    const int32_t *labels;
    const int *size;
    int passes;                  /* of the filter (1 2 1) / 4 along each axis                                          */
    float slope;                 /* of the difference of two indicators across a flat wall, a voxel                    */
    springls__label_place *place; /* of each label there may be                                                        */
    float *first, *second, *own, *spare;
    int32_t *largest;            /* whose indicator is `first`                                                         */
    int32_t label;
    int lower[3], width[3];
    springls__buffer memory[6];
} springls__label_map;

SPRINGLS__FN size_t springls__map_index(const springls__label_map *map, const int at[3])
{
    return (size_t)at[0] + (size_t)map->size[0] * ((size_t)at[1] + (size_t)map->size[1] * (size_t)at[2]);
}

/* Finds the place of the i-th voxel of a box. */
SPRINGLS__FN void springls__place_in_box(const int lower[3], const int width[3], size_t i, int at[3])
{
    at[0] = lower[0] + (int)(i % (size_t)width[0]);
    at[1] = lower[1] + (int)(i / (size_t)width[0] % (size_t)width[1]);
    at[2] = lower[2] + (int)(i / ((size_t)width[0] * (size_t)width[1]));
}

SPRINGLS__FN size_t springls__box_voxels(const int width[3]) { return (size_t)width[0] * (size_t)width[1] * (size_t)width[2]; }

/* Fails on a grid whose voxels cannot be numbered by int. */
SPRINGLS__FN springls_status springls__check_voxels(springls_tiling *tiling, const char *call)
{
    const int *size = tiling->host->model.grid.size;
    if ((uint64_t)size[0] * (uint64_t)size[1] * (uint64_t)size[2] <= (uint64_t)INT32_MAX) return SPRINGLS_OK;
    return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: the grid has %d x %d x %d voxels: at most %d are possible here",
                          call, size[0], size[1], size[2], (int)INT32_MAX);
}

/* Finds where each label is. Fails if a voxel has an invalid label, or if a voxel at the border has a label other than 0: a body needs a
   voxel of label 0 around it. */
SPRINGLS__FN springls_status springls__place_labels(springls_tiling *tiling, springls__label_map *map)
{
    const int none[3] = { 0, 0, 0 };
    const size_t n = springls__box_voxels(map->size);
    size_t i;
    int at[3], d;
    for (i = 0; i < n; i++) {
        const int32_t label = map->labels[i];
        springls__label_place *place;
        springls__place_in_box(none, map->size, i, at);
        if (label < 0 || label > SPRINGLS__LARGEST_LABEL)
            return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                                  "tiling_set_labels: voxel (%d, %d, %d) has label %ld: labels are 0 to %d", at[0], at[1], at[2],
                                  (long)label, (int)SPRINGLS__LARGEST_LABEL);
        place = &map->place[label];
        for (d = 0; d < 3; d++) {
            if (label && (at[d] == 0 || at[d] == map->size[d] - 1))
                return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT,
                                      "tiling_set_labels: label %d touches the border of the grid at voxel (%d, %d, %d)", (int)label,
                                      at[0], at[1], at[2]);
            if (place->count == 0 || at[d] < place->lower[d]) place->lower[d] = at[d];
            if (place->count == 0 || at[d] > place->upper[d]) place->upper[d] = at[d];
        }
        place->count++;
    }
    return SPRINGLS_OK;
}

/* Finds the box in which the smoothed indicator of a label is not 0; that of label 0 is the whole grid. */
SPRINGLS__FN void springls__begin_label(springls__label_map *map, int32_t label)
{
    const springls__label_place *place = &map->place[label];
    int d;
    map->label = label;
    for (d = 0; d < 3; d++) {
        const int lower = label ? springls__imax(place->lower[d] - map->passes, 0) : 0;
        const int upper = label ? springls__imin(place->upper[d] + map->passes, map->size[d] - 1) : map->size[d] - 1;
        map->lower[d] = lower;
        map->width[d] = upper - lower + 1;
    }
}

/* Runs the filter (1 2 1) / 4 along an axis of the box, from `own` to `spare`, and exchanges them. Beyond the box all is as at its
   border: 0, or, for label 0, 1. */
SPRINGLS__FN void springls__filter_axis(springls__label_map *map, int axis)
{
    const size_t n = springls__box_voxels(map->width);
    const size_t step = axis == 0 ? 1 : axis == 1 ? (size_t)map->width[0] : (size_t)map->width[0] * (size_t)map->width[1];
    const int none[3] = { 0, 0, 0 };
    float *swap = map->own;
    size_t i;
    int at[3];
    for (i = 0; i < n; i++) {
        float before, after;
        springls__place_in_box(none, map->width, i, at);
        before = map->own[at[axis] > 0 ? i - step : i];
        after = map->own[at[axis] + 1 < map->width[axis] ? i + step : i];
        map->spare[i] = 0.5f * map->own[i] + 0.25f * (before + after);
    }
    map->own = map->spare;
    map->spare = swap;
}

/* Finds the smoothed indicator of a label in its box. */
SPRINGLS__FN void springls__smooth_label(springls__label_map *map, int32_t label)
{
    size_t i, n;
    int at[3], axis, pass;
    springls__begin_label(map, label);
    n = springls__box_voxels(map->width);
    for (i = 0; i < n; i++) {
        springls__place_in_box(map->lower, map->width, i, at);
        map->own[i] = map->labels[springls__map_index(map, at)] == label ? 1.0f : 0.0f;
    }
    for (pass = 0; pass < map->passes; pass++)
        for (axis = 0; axis < 3; axis++) springls__filter_axis(map, axis);
}

/* Enters the label at work where its indicator is one of the two largest. */
SPRINGLS__FN void springls__enter_label(springls__label_map *map)
{
    const size_t n = springls__box_voxels(map->width);
    size_t i, v;
    int at[3];
    for (i = 0; i < n; i++) {
        springls__place_in_box(map->lower, map->width, i, at);
        v = springls__map_index(map, at);
        if (map->own[i] > map->first[v]) {
            map->second[v] = map->first[v];
            map->first[v] = map->own[i];
            map->largest[v] = map->label;
        } else if (map->own[i] > map->second[v]) {
            map->second[v] = map->own[i];
        }
    }
}

/* Returns the level set of the label at work at a voxel, about in voxels; of label 0 that of its outside. */
SPRINGLS__FN float springls__map_value(const void *arg, size_t index)
{
    const springls__label_map *map = (const springls__label_map *)arg;
    const int none[3] = { 0, 0, 0 };
    const float kept = 0.02f; /* the least that a voxel's own label is ahead */
    const bool inside = map->labels[index] == map->label;
    float own = 0.0f, d;
    int at[3], k;
    springls__place_in_box(none, map->size, index, at);
    for (k = 0; k < 3; k++) at[k] -= map->lower[k];
    if (at[0] >= 0 && at[1] >= 0 && at[2] >= 0 && at[0] < map->width[0] && at[1] < map->width[1] && at[2] < map->width[2])
        own = map->own[(size_t)at[0] + (size_t)map->width[0] * ((size_t)at[1] + (size_t)map->width[1] * (size_t)at[2])];
    d = map->largest[index] == map->label ? map->second[index] - own : map->first[index] - own;
    d = inside ? springls__min(d, -kept) : springls__max(d, kept);
    d = springls__clamp(d / map->slope, -3.0f, 3.0f);
    return map->label == 0 ? -d : d;
}

/* Makes room for the arrays of a map. */
SPRINGLS__FN springls_status springls__map_reserve(springls_tiling *tiling, springls__label_map *map)
{
    const size_t n = springls__box_voxels(map->size);
    const size_t labels = (size_t)SPRINGLS__LARGEST_LABEL + 1;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &map->memory[0], labels, sizeof *map->place, 0));
    for (i = 1; i < 6; i++) SPRINGLS__TRY(springls__buffer_grow(tiling->host, &map->memory[i], n, sizeof(float), 0));
    map->place = (springls__label_place *)map->memory[0].data;
    map->first = (float *)map->memory[1].data;
    map->second = (float *)map->memory[2].data;
    map->own = (float *)map->memory[3].data;
    map->spare = (float *)map->memory[4].data;
    map->largest = (int32_t *)map->memory[5].data;
    memset(map->place, 0, labels * sizeof *map->place);
    memset(map->first, 0, n * sizeof(float));
    memset(map->second, 0, n * sizeof(float));
    return SPRINGLS_OK;
}

/* Returns the box of bricks that have voxels of a label, or are beside such; of label 0, which has all others inside, all bricks. */
SPRINGLS__FN springls__brick_box springls__bricks_of_label(const springls_tiling *tiling, const springls__label_map *map, int32_t label)
{
    const springls__label_place *place = &map->place[label];
    springls__brick_box box = springls__all_bricks(&tiling->host->model.grid);
    int d;
    for (d = 0; d < 3 && label; d++) {
        box.lower[d] = springls__imax(place->lower[d] - 1, 0) / SPRINGLS__BRICK;
        box.upper[d] = springls__imin((place->upper[d] + 1) / SPRINGLS__BRICK + 1, box.upper[d]);
    }
    return box;
}

/* Moves the model of a body into memory that is no larger than it needs: it was made of many more bricks than it has. */
SPRINGLS__FN springls_status springls__pack_body(springls_tiling *tiling, const char *call, springls__tiling_body *body)
{
    springls__tiling_body copy;
    springls_status status;
    SPRINGLS__TRY(springls__body_create(tiling, call, body->label, &copy));
    status = springls__copy_model(copy.ctx, body->ctx);
    if (status != SPRINGLS_OK) springls__body_failed(tiling, status, call, body->label, copy.ctx);
    springls__body_free(status == SPRINGLS_OK ? body : &copy);
    if (status == SPRINGLS_OK) *body = copy;
    return status;
}

/* Makes the model of a label, or, of label 0, of all others together. */
SPRINGLS__FN springls_status springls__body_of_label(springls_tiling *tiling, springls__label_map *map, int32_t label,
                                                     springls__tiling_body *body)
{
    const springls__brick_box box = springls__bricks_of_label(tiling, map, label);
    springls_status status;
    SPRINGLS__TRY(springls__body_create(tiling, "tiling_set_labels", label, body));
    springls__smooth_label(map, label);
    status = springls__set_voxels_in(body->ctx, springls__map_value, map, &box);
    if (status == SPRINGLS_OK) status = springls__make_facing(body);
    if (status == SPRINGLS_OK) return springls__pack_body(tiling, "tiling_set_labels", body);
    if (status == SPRINGLS_EMPTY_MODEL)
        springls__fail(tiling->host, status, "tiling_set_labels: label %d, of %d voxels, is too little to have a surface", (int)label,
                       map->place[label].count);
    else springls__body_failed(tiling, status, "tiling_set_labels", label, body->ctx);
    return status;
}

/* Makes the bodies of a map whose memory has been reserved; *count of them so far. */
SPRINGLS__FN springls_status springls__bodies_of_map(springls_tiling *tiling, springls__label_map *map, springls__buffer *bodies,
                                                     int *count)
{
    int32_t label;
    int labels = 1, pass;
    SPRINGLS__TRY(springls__place_labels(tiling, map));
    for (label = 1; label <= SPRINGLS__LARGEST_LABEL; label++) labels += map->place[label].count > 0;
    if (labels == 1)
        return springls__fail(tiling->host, SPRINGLS_EMPTY_MODEL, "tiling_set_labels: all voxels have label 0: there is no body");
    map->slope = 2.0f;
    for (pass = 1; pass <= map->passes; pass++) map->slope *= (float)(2 * pass - 1) / (float)(2 * pass);
    for (label = 0; label <= SPRINGLS__LARGEST_LABEL; label++) {
        if (map->place[label].count == 0) continue;
        springls__smooth_label(map, label);
        springls__enter_label(map);
    }
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, bodies, (size_t)labels, sizeof(springls__tiling_body), 0));
    memset(bodies->data, 0, bodies->bytes);
    for (label = 0; label <= SPRINGLS__LARGEST_LABEL; label++)
        if (map->place[label].count > 0)
            SPRINGLS__TRY(springls__body_of_label(tiling, map, label, (springls__tiling_body *)bodies->data + (*count)++));
    return SPRINGLS_OK;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_set_labels(springls_tiling *tiling, const int32_t *labels, int smooth)
{
    springls__label_map map;
    springls__buffer bodies;
    springls_status status;
    int count = 0, i;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!labels) return springls__fail_null(tiling->host, "tiling_set_labels", "labels");
    if (smooth < 0 || smooth > SPRINGLS__MOST_PASSES)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "tiling_set_labels: smooth is %d: it may be 0 to %d", smooth,
                              (int)SPRINGLS__MOST_PASSES);
    SPRINGLS__TRY(springls__check_voxels(tiling, "tiling_set_labels"));
    memset(&map, 0, sizeof map);
    memset(&bodies, 0, sizeof bodies);
    map.labels = labels;
    map.size = tiling->host->model.grid.size;
    map.passes = smooth;
    status = springls__map_reserve(tiling, &map);
    if (status == SPRINGLS_OK) status = springls__bodies_of_map(tiling, &map, &bodies, &count);
    for (i = 0; i < 6; i++) springls__buffer_free(tiling->host, &map.memory[i]);
    if (status == SPRINGLS_OK) springls__take_bodies(tiling, &bodies, count);
    else springls__bodies_free(tiling->host, &bodies, count);
    return status;
}

/* ---- one body more ---- */

/* Returns the label of a body that a new one would overlap, -1 for none: a voxel lies deeper than a quarter of a voxel in both. */
SPRINGLS__FN int32_t springls__body_in_the_way(const springls_tiling *tiling, const springls_context *added)
{
    const springls__grid *g = &added->model.grid;
    const float deep = -0.25f; /* voxel */
    int entries = (int)springls__entry_count(g), i, e, v;
    for (i = 1; i < tiling->count; i++) {
        const springls__grid *other = &tiling->body[i].ctx->model.grid;
        for (e = 0; e < entries; e++) {
            const float *a = g->phi + (size_t)g->top[e] * SPRINGLS__BRICK_VOXELS, *b;
            if (g->top[e] == SPRINGLS__OUTSIDE) continue;
            b = springls__phi_of_entry(other, g, e);
            for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
                if (a[v] < deep && b[v] < deep) return tiling->body[i].label;
        }
    }
    return SPRINGLS__NO_LABEL;
}

/* Returns whether a model has an inside at the border of the grid. */
SPRINGLS__FN bool springls__reaches_border(const springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    int entries = (int)springls__entry_count(g), o[3], at[3], e, v, d;
    for (e = 0; e < entries; e++) {
        const float *phi = g->phi + (size_t)g->top[e] * SPRINGLS__BRICK_VOXELS;
        if (g->top[e] == SPRINGLS__OUTSIDE) continue;
        springls__entry_origin(g, e, o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            if (phi[v] >= 0.0f) continue;
            springls__voxel_of_brick(o, v, at);
            for (d = 0; d < 3; d++)
                if (at[d] == 0 || at[d] == g->size[d] - 1) return true;
        }
    }
    return false;
}

/* What a new body is: a call's name, its label, and a function or a mesh. */
typedef struct springls__new_body {
    const char *call;
    int32_t label;
    springls_implicit_fn fn; /* NULL: the mesh                                                                        */
    void *user;
    const float *positions;
    const int *triangles;
    int position_count, triangle_count;
    size_t stride;
    springls_mesh_report *report;
} springls__new_body;

/* Makes the model of a new body, and checks where it is. */
SPRINGLS__FN springls_status springls__make_body(springls_tiling *tiling, const springls__new_body *given, springls__tiling_body *body)
{
    const char *call = given->call;
    const int32_t label = given->label;
    springls_status status;
    int32_t other;
    int i;
    SPRINGLS__TRY(springls__body_create(tiling, call, label, body));
    if (given->fn) status = springls_set_implicit(body->ctx, given->fn, given->user);
    else status = springls_set_mesh(body->ctx, given->positions, given->position_count, given->stride, given->triangles,
                                    given->triangle_count, given->report);
    if (status == SPRINGLS_OK) status = springls__make_facing(body);
    if (status == SPRINGLS_OK) status = springls__body_to_host(tiling, body, NULL);
    if (status != SPRINGLS_OK) return springls__body_failed(tiling, status, call, label, body->ctx);
    if (tiling->count) springls_set_time(body->ctx, springls_time(tiling->body[0].ctx));
    if (springls__reaches_border(body->ctx))
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: label %d touches the border of the grid", call, (int)label);
    for (i = 0; i < tiling->count; i++) {
        status = springls__body_for_reading(tiling, &tiling->body[i], NULL);
        if (status != SPRINGLS_OK) return springls__body_failed(tiling, status, call, tiling->body[i].label, tiling->body[i].ctx);
    }
    other = springls__body_in_the_way(tiling, body->ctx);
    if (other == SPRINGLS__NO_LABEL) return SPRINGLS_OK;
    return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: label %d would be where label %d is", call, (int)label, (int)other);
}

/* Makes the model of all bodies together with one more. */
SPRINGLS__FN springls_status springls__make_outer(springls_tiling *tiling, const char *call, const springls__tiling_body *added,
                                                  springls__tiling_body *outer)
{
    const bool alone = springls_tiling_count(tiling) == 0;
    springls_status status;
    if (!alone && springls_count(tiling->body[0].ctx) == 0)
        return springls__fail(tiling->host, SPRINGLS_EMPTY_MODEL, "%s: the model of label 0 has been emptied", call);
    SPRINGLS__TRY(springls__body_create(tiling, call, 0, outer));
    status = springls__copy_model(outer->ctx, alone ? added->ctx : tiling->body[0].ctx);
    if (status == SPRINGLS_OK && !alone) status = springls_combine(outer->ctx, SPRINGLS_OPERATION_UNION, added->ctx);
    if (status == SPRINGLS_OK) status = springls__make_facing(outer);
    if (status == SPRINGLS_OK) springls_set_time(outer->ctx, springls_time(added->ctx));
    return status == SPRINGLS_OK ? status : springls__body_failed(tiling, status, call, 0, outer->ctx);
}

/* Puts a body, and the model of all together, into a copy of the list of bodies, which replaces it. */
SPRINGLS__FN springls_status springls__insert_body(springls_tiling *tiling, springls__tiling_body *outer, springls__tiling_body *added)
{
    const int before = springls__imax(tiling->count, 1);
    springls__tiling_body *body;
    springls__buffer bodies;
    int i, n = 0;
    memset(&bodies, 0, sizeof bodies);
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &bodies, (size_t)before + 1, sizeof *body, 0));
    body = (springls__tiling_body *)bodies.data;
    body[n++] = *outer;
    for (i = 1; i < tiling->count; i++) {
        if (n == i && tiling->body[i].label > added->label) body[n++] = *added;
        body[n++] = tiling->body[i];
    }
    if (n == before) body[n++] = *added;
    if (tiling->count) springls__body_free(&tiling->body[0]);
    springls__buffer_free(tiling->host, &tiling->bodies);
    tiling->bodies = bodies;
    tiling->body = body;
    tiling->count = n;
    tiling->facing_known = false;
    tiling->neighbors_known = false;
    springls__end_rest(tiling);
    return SPRINGLS_OK;
}

/* Adds a body under a new label. */
SPRINGLS__FN springls_status springls__add_body(springls_tiling *tiling, const springls__new_body *given)
{
    springls__tiling_body added, outer;
    springls_status status;
    if (given->label < 1 || given->label > SPRINGLS__LARGEST_LABEL)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: the label is %ld: it may be 1 to %d", given->call,
                              (long)given->label, (int)SPRINGLS__LARGEST_LABEL);
    if (springls__body_number(tiling, given->label) >= 0)
        return springls__fail(tiling->host, SPRINGLS_INVALID_ARGUMENT, "%s: there is a body of label %d", given->call, (int)given->label);
    memset(&added, 0, sizeof added);
    memset(&outer, 0, sizeof outer);
    status = springls__make_body(tiling, given, &added);
    if (status == SPRINGLS_OK) status = springls__make_outer(tiling, given->call, &added, &outer);
    if (status == SPRINGLS_OK) status = springls__insert_body(tiling, &outer, &added);
    if (status == SPRINGLS_OK) return SPRINGLS_OK;
    springls__body_free(&added);
    springls__body_free(&outer);
    return status;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_add_implicit(springls_tiling *tiling, int32_t label, springls_implicit_fn fn,
                                                                   void *user)
{
    springls__new_body given;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!fn) return springls__fail_null(tiling->host, "tiling_add_implicit", "the function");
    memset(&given, 0, sizeof given);
    given.call = "tiling_add_implicit";
    given.label = label;
    given.fn = fn;
    given.user = user;
    return springls__add_body(tiling, &given);
}

SPRINGLS__TILINGS_API springls_status springls_tiling_add_mesh(springls_tiling *tiling, int32_t label, const float *positions,
                                                               int position_count, size_t stride, const int *triangles, int triangle_count,
                                                               springls_mesh_report *report)
{
    springls__new_body given;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    memset(&given, 0, sizeof given);
    given.call = "tiling_add_mesh";
    given.label = label;
    given.positions = positions;
    given.position_count = position_count;
    given.stride = stride;
    given.triangles = triangles;
    given.triangle_count = triangle_count;
    given.report = report;
    return springls__add_body(tiling, &given);
}

#endif
