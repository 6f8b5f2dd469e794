/* top_table.h - the box of bricks that a top table has entries for: it follows the bricks that are not outside, so that memory and
   time do not depend on the size of the domain. */
#ifndef SPRINGLS__MODEL_TOP_TABLE_H
#define SPRINGLS__MODEL_TOP_TABLE_H

#include "../../kernels_embed/model/grid.h"
#include "../runtime/arrays.h"
#include "../runtime/residency.h"

/* A box of bricks of the domain, counted in bricks: lower <= place < upper. */
typedef struct springls__brick_box { int lower[3], upper[3]; } springls__brick_box;

static const int springls__unmoved[3] = { 0, 0, 0 };

SPRINGLS__FN springls__brick_box springls__empty_box(void)
{
    springls__brick_box box;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        box.lower[axis] = INT32_MAX;
        box.upper[axis] = 0;
    }
    return box;
}

/* Makes a box have the bricks within `around` of a place, which is counted in bricks. */
SPRINGLS__FN void springls__box_add(springls__brick_box *box, const int place[3], int around)
{
    int axis;
    for (axis = 0; axis < 3; axis++) {
        box->lower[axis] = springls__imin(box->lower[axis], place[axis] - around);
        box->upper[axis] = springls__imax(box->upper[axis], place[axis] + around + 1);
    }
}

SPRINGLS__FN void springls__box_add_brick(const springls__grid *g, springls__brick_box *box, int brick, int around)
{
    int place[3];
    springls__brick_place(g, brick, place);
    springls__box_add(box, place, around);
}

/* Makes a box have the bricks that a grid has `entry` of a table for, after these have moved by `bricks` through the domain; those
   that leave it are none of it. */
SPRINGLS__FN void springls__box_add_entry(const springls__grid *g, springls__brick_box *box, int entry, const int bricks[3])
{
    int place[3], axis;
    springls__entry_origin(g, entry, place);
    for (axis = 0; axis < 3; axis++) {
        place[axis] = place[axis] / SPRINGLS__BRICK - bricks[axis];
        if (place[axis] < 0 || place[axis] >= g->bricks[axis]) return;
    }
    springls__box_add(box, place, 0);
}

/* Makes a box have all bricks of a grid that are not outside, after they have moved. */
SPRINGLS__FN void springls__box_add_grid(const springls__grid *g, springls__brick_box *box, const int bricks[3])
{
    int i, count = (int)springls__entry_count(g);
    for (i = 0; i < count; i++)
        if (g->top[i] != SPRINGLS__OUTSIDE) springls__box_add_entry(g, box, i, bricks);
}

/* Returns the table for the bricks of a box: with a layer of bricks around them and some more, that it seldom changes, as far as
   the domain goes. An empty box gets one brick. */
SPRINGLS__FN springls__table springls__table_for(const springls__grid *g, const springls__brick_box *box)
{
    const int unit = 4; /* bricks */
    springls__table t;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        int lower = springls__imax(springls__imin(box->lower[axis], box->upper[axis]) - 1, 0) / unit * unit;
        int upper = springls__imin((box->upper[axis] + unit) / unit * unit, g->bricks[axis]);
        if (box->lower[axis] >= box->upper[axis]) {
            lower = 0;
            upper = 1;
        }
        t.lower[axis] = SPRINGLS__BRICK * lower;
        t.upper[axis] = springls__imin(SPRINGLS__BRICK * upper, g->size[axis]);
        t.bricks[axis] = upper - lower;
    }
    t.first = (t.lower[0] + t.bricks[0] * (t.lower[1] + t.bricks[1] * t.lower[2])) / SPRINGLS__BRICK;
    return t;
}

SPRINGLS__FN size_t springls__entries_of(const springls__table *t)
{
    return (size_t)t->bricks[0] * (size_t)t->bricks[1] * (size_t)t->bricks[2];
}

/* Returns whether a table has the bricks of a box and a layer around them, as far as the domain goes. */
SPRINGLS__FN bool springls__table_covers(const springls__grid *g, const springls__brick_box *box)
{
    int axis;
    for (axis = 0; axis < 3; axis++) {
        if (box->lower[axis] >= box->upper[axis]) return true;
        if (g->table.lower[axis] > SPRINGLS__BRICK * springls__imax(box->lower[axis] - 1, 0)) return false;
        if (g->table.upper[axis] < springls__imin(SPRINGLS__BRICK * (box->upper[axis] + 1), g->size[axis])) return false;
    }
    return true;
}

/* Copies the entries of one table, `size` bytes each, to their places in another, whose bricks it has at places that are smaller
   by `bricks`; the rest become zeros (SPRINGLS__OUTSIDE). */
SPRINGLS__FN void springls__copy_entries(const springls__table *from, const void *old, const springls__table *to, void *out,
                                         size_t size, const int bricks[3])
{
    int lower[3], upper[3], first[3], axis, y, z;
    memset(out, 0, springls__entries_of(to) * size);
    for (axis = 0; axis < 3; axis++) { /* of `to`, in entries along each axis */
        first[axis] = (to->lower[axis] - from->lower[axis]) / SPRINGLS__BRICK + bricks[axis];
        lower[axis] = springls__imax(-first[axis], 0);
        upper[axis] = springls__imin(from->bricks[axis] - first[axis], to->bricks[axis]);
        if (lower[axis] >= upper[axis]) return;
    }
    for (z = lower[2]; z < upper[2]; z++)
        for (y = lower[1]; y < upper[1]; y++) {
            size_t row = (size_t)(y + first[1]) + (size_t)from->bricks[1] * (size_t)(z + first[2]);
            size_t at = (size_t)(lower[0] + first[0]) + (size_t)from->bricks[0] * row;
            size_t out_at = (size_t)lower[0] + (size_t)to->bricks[0] * ((size_t)y + (size_t)to->bricks[1] * (size_t)z);
            memcpy((char *)out + out_at * size, (const char *)old + at * size, (size_t)(upper[0] - lower[0]) * size);
        }
}

/* Replaces the table of the model's grid by another, and moves its bricks to places that are smaller by `bricks`. Nothing has
   changed on failure. */
SPRINGLS__FN springls_status springls__table_change(springls_context *ctx, const springls__table *to, const int bricks[3])
{
    springls__grid *g = &ctx->model.grid;
    springls__buffer old;
    springls_status status;
    memset(&old, 0, sizeof old);
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(TOP)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &old, springls__entry_count(g), sizeof *g->top, 0));
    memcpy(old.data, g->top, springls__entry_count(g) * sizeof *g->top);
    status = springls__grow(ctx, SPRINGLS__ARRAY_TOP, springls__entries_of(to), 0);
    if (status == SPRINGLS_OK) {
        springls__copy_entries(&g->table, old.data, to, g->top, sizeof *g->top, bricks);
        g->table = *to;
        ctx->labels_fresh = false; /* they have numbers of entries */
    }
    springls__buffer_free(ctx, &old);
    return status;
}

/* Makes the top table have the bricks of a box and a layer around them; bricks that it has for no reason any more may go. */
SPRINGLS__FN springls_status springls__table_cover(springls_context *ctx, springls__brick_box box)
{
    springls__grid *g = &ctx->model.grid;
    springls__table to;
    if (springls__table_covers(g, &box)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(TOP), 0));
    springls__box_add_grid(g, &box, springls__unmoved);
    to = springls__table_for(g, &box);
    return springls__table_change(ctx, &to, springls__unmoved);
}

/* Makes the top table of a grid the smallest one, all outside. */
SPRINGLS__FN void springls__table_clear(springls__grid *g)
{
    const springls__brick_box none = springls__empty_box();
    g->table = springls__table_for(g, &none);
    g->top[0] = SPRINGLS__OUTSIDE;
}

/* Finds the box of the bricks that springls may need, and of those around the active ones. */
SPRINGLS__FN springls__brick_box springls__box_of_model(const springls__model *model, bool active)
{
    const springls__grid *g = &model->grid;
    const float margin = model->params.band_half_width + 1.0f;
    springls__brick_box box = springls__empty_box();
    springls__v3 place[3];
    int i, k, voxel[3];
    for (i = 0; i < model->set.count; i++) {
        place[2] = model->set.s[i].p;
        springls__box_around(model->set.s[i], margin, &place[0], &place[1]);
        for (k = 0; k < 3; k++) {
            springls__origin_of_place(g, place[k], voxel);
            springls__box_add_brick(g, &box, springls__brick_at(g, voxel[0], voxel[1], voxel[2]), 0);
        }
    }
    for (i = 0; i < g->active_count && active; i++) springls__box_add_brick(g, &box, g->slot_brick[g->active[i]], 1);
    return box;
}

#endif
