/* top_table.h - which bricks a top table has entries for: it follows the bricks that are not outside, so that memory and time
   do not depend on the size of the domain, nor on how far bodies are from each other. */
#ifndef SPRINGLS__MODEL_TOP_TABLE_H
#define SPRINGLS__MODEL_TOP_TABLE_H

#include "../../kernels_embed/model/grid.h"
#include "../runtime/arrays.h"
#include "../runtime/residency.h"

/* A box of bricks of the domain, counted in bricks: lower <= place < upper. */
typedef struct springls__brick_box { int lower[3], upper[3]; } springls__brick_box;

static const int springls__unmoved[3] = { 0, 0, 0 };

SPRINGLS__FN springls__brick_groups springls__no_groups(void)
{
    springls__brick_groups groups;
    memset(&groups, 0, sizeof groups);
    return groups;
}

/* Keeps the groups of the bricks within `around` of those from lower to upper, counted in bricks, and of the ones beside these. */
SPRINGLS__FN void springls__keep_box(const springls__grid *g, springls__brick_groups *groups, const int lower[3],
                                     const int upper[3], int around)
{
    int axis, group;
    for (axis = 0; axis < 3; axis++) {
        const int first = springls__imax(lower[axis] - around - 1, 0) >> 2;
        const int last = springls__imin(upper[axis] + around + 1, g->bricks[axis] - 1) >> 2;
        for (group = first; group <= last; group++) groups->kept[axis * SPRINGLS__GROUP_WORDS + (group >> 5)] |= 1u << (group & 31);
    }
}

SPRINGLS__FN void springls__keep_brick(const springls__grid *g, springls__brick_groups *groups, int brick)
{
    int place[3];
    springls__brick_place(g, brick, place);
    springls__keep_box(g, groups, place, place, 0);
}

/* Keeps the groups of the brick of an entry, after it has moved by `bricks` through the domain, unless it leaves that. */
SPRINGLS__FN void springls__keep_entry(const springls__grid *g, springls__brick_groups *groups, int entry, const int bricks[3])
{
    int place[3], axis;
    springls__entry_origin(g, entry, place);
    for (axis = 0; axis < 3; axis++) {
        place[axis] = place[axis] / SPRINGLS__BRICK - bricks[axis];
        if (place[axis] < 0 || place[axis] >= g->bricks[axis]) return;
    }
    springls__keep_box(g, groups, place, place, 0);
}

/* Keeps the groups of all bricks of a grid that are not outside, after they have moved. */
SPRINGLS__FN void springls__keep_grid(const springls__grid *g, springls__brick_groups *groups, const int bricks[3])
{
    int i, count = (int)springls__entry_count(g);
    for (i = 0; i < count; i++)
        if (g->top[i] != SPRINGLS__OUTSIDE) springls__keep_entry(g, groups, i, bricks);
}

/* Returns the plane of the first place from `place` on, given that of the place before it; -1: there is none before it. */
SPRINGLS__FN int springls__next_plane(const springls__brick_groups *groups, int axis, int first, int place, int plane)
{
    const bool starts = place == first || springls__keeps_place(groups, axis, place)
                     || springls__keeps_place(groups, axis, place - 1);
    return plane + starts;
}

/* Returns the table that keeps some groups; without any it has one entry, for the first brick. */
SPRINGLS__FN springls__table springls__table_of(const springls__grid *g, const springls__brick_groups *groups)
{
    springls__table t;
    int axis, place, first, end, plane;
    t.groups = *groups;
    for (axis = 0; axis < 3; axis++) {
        for (first = 0; first < g->bricks[axis] && !springls__keeps_place(groups, axis, first);) first++;
        for (end = g->bricks[axis]; end > first && !springls__keeps_place(groups, axis, end - 1);) end--;
        if (first == end) {
            first = 0;
            end = 1;
        }
        for (place = first, plane = -1; place < end; place++) plane = springls__next_plane(groups, axis, first, place, plane);
        t.lower[axis] = SPRINGLS__BRICK * first;
        t.upper[axis] = springls__imin(SPRINGLS__BRICK * end, g->size[axis]);
        t.bricks[axis] = plane + 1;
    }
    return t;
}

/* Gives a grid a table, and its planes. Places beyond the table have its first or last plane. */
SPRINGLS__FN void springls__take_table(springls__grid *g, const springls__table *t)
{
    int axis, place, stride = 1;
    g->table = *t;
    for (axis = 0; axis < 3; axis++) {
        int *plane_at = g->plane + axis * SPRINGLS__MOST_PLANES, *place_of = plane_at + 3 * SPRINGLS__MOST_PLANES, plane = -1;
        const int first = t->lower[axis] / SPRINGLS__BRICK, end = (t->upper[axis] + SPRINGLS__BRICK - 1) / SPRINGLS__BRICK;
        for (place = 0; place < g->bricks[axis]; place++) {
            const int before = plane;
            if (place >= first && place < end) plane = springls__next_plane(&t->groups, axis, first, place, plane);
            if (plane > before) place_of[plane] = place;
            plane_at[place] = stride * springls__imax(plane, 0);
        }
        stride *= t->bricks[axis];
    }
}

SPRINGLS__FN size_t springls__entries_of(const springls__table *t)
{
    return (size_t)t->bricks[0] * (size_t)t->bricks[1] * (size_t)t->bricks[2];
}

/* Returns whether the table of a grid keeps all of some groups. */
SPRINGLS__FN bool springls__table_keeps(const springls__grid *g, const springls__brick_groups *groups)
{
    int i;
    for (i = 0; i < 3 * SPRINGLS__GROUP_WORDS; i++)
        if (groups->kept[i] & ~g->table.groups.kept[i]) return false;
    return true;
}

/* Copies what one grid has for each entry, `size` bytes, to the entries of another of the same domain, whose bricks it has at
   places that are smaller by `bricks`; the rest become zeros (SPRINGLS__OUTSIDE). */
SPRINGLS__FN void springls__copy_entries(const springls__grid *from, const void *old, const springls__grid *to, void *out,
                                         size_t size, const int bricks[3])
{
    int i, count = (int)springls__entry_count(to), place[3], axis;
    memset(out, 0, (size_t)count * size);
    for (i = 0; i < count; i++) {
        bool there = true;
        springls__entry_origin(to, i, place);
        for (axis = 0; axis < 3; axis++) {
            place[axis] = place[axis] / SPRINGLS__BRICK + bricks[axis];
            there = there && place[axis] >= 0 && place[axis] < from->bricks[axis];
        }
        if (!there || !springls__has_entry(from, place)) continue;
        memcpy((char *)out + (size_t)i * size,
               (const char *)old + (size_t)springls__entry_at(from, 8 * place[0], 8 * place[1], 8 * place[2]) * size, size);
    }
}

/* Replaces the table of the model's grid by another, and moves its bricks to places that are smaller by `bricks`. Nothing has
   changed on failure. */
SPRINGLS__FN springls_status springls__table_change(springls_context *ctx, const springls__table *to, const int bricks[3])
{
    springls__grid *g = &ctx->model.grid, from;
    const size_t entries = springls__entry_count(g), planes = 6 * SPRINGLS__MOST_PLANES;
    springls__buffer old;
    springls_status status;
    memset(&old, 0, sizeof old);
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PLANE)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &old, entries + planes, sizeof(int), 0));
    from = *g;
    from.top = (int *)old.data;
    from.plane = from.top + entries;
    memcpy(from.top, g->top, entries * sizeof(int));
    memcpy(from.plane, g->plane, planes * sizeof(int));
    status = springls__grow(ctx, SPRINGLS__ARRAY_TOP, springls__entries_of(to), entries);
    if (status == SPRINGLS_OK) {
        springls__take_table(g, to);
        springls__copy_entries(&from, from.top, g, g->top, sizeof *g->top, bricks);
    }
    springls__buffer_free(ctx, &old);
    return status;
}

/* Keeps some groups in the top table; those that it keeps for no reason any more may go. */
SPRINGLS__FN springls_status springls__table_cover(springls_context *ctx, springls__brick_groups groups)
{
    springls__grid *g = &ctx->model.grid;
    springls__table to;
    if (springls__table_keeps(g, &groups)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(TOP), 0));
    springls__keep_grid(g, &groups, springls__unmoved);
    to = springls__table_of(g, &groups);
    return springls__table_change(ctx, &to, springls__unmoved);
}

/* Shrinks the top table of a grid to the smallest one, all outside. */
SPRINGLS__FN void springls__table_clear(springls__grid *g)
{
    const springls__brick_groups none = springls__no_groups();
    const springls__table smallest = springls__table_of(g, &none);
    springls__take_table(g, &smallest);
    g->top[0] = SPRINGLS__OUTSIDE;
}

/* Returns the groups of the bricks that springls may need, and of those around the active ones. */
SPRINGLS__FN springls__brick_groups springls__groups_of_model(const springls__model *model, bool active)
{
    const springls__grid *g = &model->grid;
    const float margin = model->params.band_half_width + 1.0f;
    springls__brick_groups groups = springls__no_groups();
    int i, axis, first[3], last[3];
    for (i = 0; i < model->set.count; i++) {
        const springls__box box = springls__box_add(springls__box_around(model->set.s[i], margin), model->set.s[i].p);
        springls__origin_of_place(g, box.lower, first);
        springls__origin_of_place(g, box.upper, last);
        for (axis = 0; axis < 3; axis++) {
            first[axis] /= SPRINGLS__BRICK;
            last[axis] /= SPRINGLS__BRICK;
        }
        springls__keep_box(g, &groups, first, last, 0);
    }
    for (i = 0; i < g->active_count && active; i++) {
        springls__brick_place(g, g->slot_brick[g->active[i]], first);
        springls__keep_box(g, &groups, first, first, 1);
    }
    return groups;
}

#endif
