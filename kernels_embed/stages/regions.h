/* regions.h - which side regions are on (springls__resolve_regions), by union-find: elements find all regions at once, and meet where
   they join and add up. Results are the same in any order: minima and sums of integers.

   Nodes are the voxels of regions, numbered as in phi, and behind them the open constant bricks. region_label has the label of
   each: a smaller number in its region, or its own; in the end the smallest, the root. -1: in no region. */
#ifndef SPRINGLS__KERNEL_STAGES_REGIONS_H
#define SPRINGLS__KERNEL_STAGES_REGIONS_H

#include "../model/grid.h"
#include "../model/model.h"
#include "unsigned_to_signed.h"

typedef struct springls__regions {
    SPRINGLS__GLOBAL int *label;
    SPRINGLS__GLOBAL int *votes; /* of a root: voxels around its region that are outside less those inside (in the memory of phi_next) */
    int voxels;          /* numbers of voxels; entries of the top table have those from here on                                */
    int rows;            /* of eight voxels, in all active bricks: elements are these rows and then the entries of the table */
} springls__regions;

SPRINGLS__MATHS springls__regions springls__regions_of(const springls__model *model)
{
    springls__regions r;
    r.label = springls__region_label(model);
    r.votes = (SPRINGLS__GLOBAL int *)model->grid.phi_next;
    r.voxels = model->grid.slot_count * SPRINGLS__BRICK_VOXELS;
    r.rows = model->grid.active_count * SPRINGLS__ROWS;
    return r;
}

/* Returns the number of a row's first voxel; finds where it lies. */
SPRINGLS__MATHS int springls__row_at(const springls__grid *g, int row, int at[3])
{
    int slot = g->active[row / SPRINGLS__ROWS];
    springls__slot_origin(g, slot, at);
    at[1] += row % 8;
    at[2] += row / 8 % 8;
    return slot * SPRINGLS__BRICK_VOXELS + row % SPRINGLS__ROWS * 8;
}

SPRINGLS__MATHS bool springls__open_brick(const springls__model *model, int entry)
{
    return model->grid.top[entry] < SPRINGLS__FIRST_SLOT && springls__brick_state(model)[entry] == SPRINGLS__OPEN;
}

/* ---- begin: every node has its own label, but neighbours along a row share one ---- */

SPRINGLS__MATHS void springls__region_begin_element(const springls__model *model, springls__arguments args, int i)
{
    springls__regions r = springls__regions_of(model);
    int first, v, at[3];
    (void)args;
    if (i >= r.rows) {
        r.label[r.voxels + i - r.rows] = springls__open_brick(model, i - r.rows) ? r.voxels + i - r.rows : -1;
        return;
    }
    first = springls__row_at(&model->grid, i, at);
    for (v = first; v < first + 8; v++) {
        bool member = springls__in_region(model, (size_t)v);
        r.label[v] = !member ? -1 : v > first && r.label[v - 1] >= 0 ? r.label[v - 1] : v;
        r.votes[v] = 0;
    }
}

/* ---- join: neighbours get one root ---- */

/* Returns the root of n as far as it is known: other work items join meanwhile. */
SPRINGLS__MATHS int springls__root_so_far(SPRINGLS__GLOBAL int *label, int n)
{
    int next = SPRINGLS__READ(label + n);
    while (next != n) {
        n = next;
        next = SPRINGLS__READ(label + n);
    }
    return n;
}

SPRINGLS__MATHS void springls__region_unite(SPRINGLS__GLOBAL int *label, int a, int b)
{
    a = springls__root_so_far(label, a);
    b = springls__root_so_far(label, b);
    while (a != b) {
        int high = springls__imax(a, b), low = springls__imin(a, b), before;
        SPRINGLS__LOWER(before, label + high, low);
        if (before == high) return;
        a = springls__root_so_far(label, before); /* another item was faster: join what it has joined */
        b = springls__root_so_far(label, low);
    }
}

/* Returns the node at a voxel of the domain, or -1. */
SPRINGLS__MATHS int springls__region_node(const springls__model *model, const springls__regions *r, int x, int y, int z)
{
    const springls__grid *g = &model->grid;
    int entry, v;
    if (!springls__table_contains(g, x, y, z)) return -1;
    entry = springls__entry_at(g, x, y, z);
    if (g->top[entry] < SPRINGLS__FIRST_SLOT) return springls__open_brick(model, entry) ? r->voxels + entry : -1;
    v = g->top[entry] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
    return springls__in_region(model, (size_t)v) ? v : -1;
}

/* Joins an open constant brick with those before it along each axis. */
SPRINGLS__MATHS void springls__join_brick(const springls__model *model, const springls__regions *r, int entry)
{
    const springls__table *t = &model->grid.table;
    int axis, stride = 1, node = r->voxels + entry;
    if (!springls__open_brick(model, entry)) return;
    for (axis = 0; axis < 3; axis++) {
        bool first = entry / stride % t->bricks[axis] == 0;
        if (!first && springls__open_brick(model, entry - stride)) springls__region_unite(r->label, node, node - stride);
        stride *= t->bricks[axis];
    }
}

/* Joins the members of a row with the nodes beyond face d of it: voxels before it, and constant bricks on all sides. */
SPRINGLS__MATHS void springls__join_row(const springls__model *model, const springls__regions *r, const int at[3], int d)
{
    int x, beside = -1;
    for (x = d == 1 ? 7 : 0; x <= (d == 0 ? 0 : 7); x++) {
        int place[3], to[3], n, before = beside;
        place[0] = at[0] + x;
        place[1] = at[1];
        place[2] = at[2];
        springls__voxel_at_face(place, 1, d, 0, 0, to);
        n = springls__region_node(model, r, place[0], place[1], place[2]);
        beside = n < 0 ? -1 : springls__region_node(model, r, to[0], to[1], to[2]);
        if (beside < 0 || before >= 0 || ((d & 1) && beside < r->voxels)) continue; /* once a run of members, and once a pair */
        springls__region_unite(r->label, n, beside);
    }
}

SPRINGLS__MATHS void springls__region_join_element(const springls__model *model, springls__arguments args, int i)
{
    springls__regions r = springls__regions_of(model);
    int at[3], d, first, v;
    (void)args;
    if (i >= r.rows) {
        springls__join_brick(model, &r, i - r.rows);
        return;
    }
    first = springls__row_at(&model->grid, i, at);
    for (v = first; v < first + 8 && SPRINGLS__READ(r.label + v) < 0;) v++;
    for (d = 0; d < 6 && v < first + 8; d++) springls__join_row(model, &r, at, d);
}

/* ---- vote: the voxels around the members of a region are added up at its root ---- */

/* Returns the root of n, when all are joined. */
SPRINGLS__MATHS int springls__region_root(SPRINGLS__GLOBAL const int *label, int n)
{
    while (label[n] != n) n = label[n];
    return n;
}

SPRINGLS__MATHS int springls__vote_at(const springls__model *model, int x, int y, int z)
{
    const springls__grid *g = &model->grid;
    int slot;
    if (!springls__table_contains(g, x, y, z)) return 0;
    slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) return 0;
    return springls__vote_of_voxel(model, (size_t)slot * SPRINGLS__BRICK_VOXELS + (size_t)springls__voxel_in_brick(x, y, z));
}

/* Adds the votes around some members to their root; a root that is a brick has no voxel, and no votes. */
SPRINGLS__MATHS void springls__add_votes(const springls__regions *r, int root, int votes)
{
    if (root >= 0 && root < r->voxels && votes != 0) SPRINGLS__ADD(r->votes + root, votes);
}

SPRINGLS__MATHS void springls__vote_of_brick(const springls__model *model, const springls__regions *r, int entry)
{
    int at[3], to[3], d, k, votes = 0;
    if (!springls__open_brick(model, entry)) return;
    springls__entry_origin(&model->grid, entry, at);
    for (d = 0; d < 6; d++)
        for (k = 0; k < 64; k++) {
            springls__voxel_at_face(at, 8, d, k % 8, k / 8, to);
            votes += springls__vote_at(model, to[0], to[1], to[2]);
        }
    springls__add_votes(r, springls__region_root(r->label, r->voxels + entry), votes);
}

/* Adds up a row run by run of members: they have one root. */
SPRINGLS__MATHS void springls__vote_of_row(const springls__model *model, const springls__regions *r, int row)
{
    int at[3], first = springls__row_at(&model->grid, row, at), x, d, root = -1, votes = 0;
    for (x = 0; x <= 8; x++) {
        int label = x < 8 ? r->label[first + x] : -1;
        if (label < 0) {
            springls__add_votes(r, root, votes);
            root = -1;
            votes = 0;
            continue;
        }
        if (root < 0) root = springls__region_root(r->label, label);
        for (d = -1; d <= 1; d += 2)
            votes += springls__vote_at(model, at[0] + x + d, at[1], at[2])
                   + springls__vote_at(model, at[0] + x, at[1] + d, at[2])
                   + springls__vote_at(model, at[0] + x, at[1], at[2] + d);
    }
}

SPRINGLS__MATHS void springls__region_vote_element(const springls__model *model, springls__arguments args, int i)
{
    springls__regions r = springls__regions_of(model);
    (void)args;
    if (i >= r.rows) springls__vote_of_brick(model, &r, i - r.rows);
    else springls__vote_of_row(model, &r, i);
}

/* ---- resolve: regions with more voxels of the outside around them are outside ---- */

SPRINGLS__MATHS void springls__region_resolve_element(const springls__model *model, springls__arguments args, int i)
{
    springls__regions r = springls__regions_of(model);
    int at[3], first, v, root = -1;
    (void)args;
    if (i >= r.rows) {
        if (!springls__open_brick(model, i - r.rows)) return;
        root = springls__region_root(r.label, r.voxels + i - r.rows);
        if (root < r.voxels && r.votes[root] > 0) model->grid.top[i - r.rows] = SPRINGLS__OUTSIDE;
        return;
    }
    first = springls__row_at(&model->grid, i, at);
    for (v = first; v < first + 8; v++) {
        root = r.label[v] < 0 ? -1 : root >= 0 ? root : springls__region_root(r.label, v);
        if (root >= 0 && r.votes[root] > 0) model->grid.phi[v] = 1.0f;
    }
}

#endif
