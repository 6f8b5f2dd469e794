/* cell_list.h - the hash grid (section 4.8): springls by the cell of their particle. A springl with too large a bounding radius
   is listed in `unbinned` instead, so that one huge triangle does not widen every search; so is one whose particle lies outside all
   active bricks, for the cells are in these. */
#ifndef SPRINGLS__KERNEL_MODEL_CELL_LIST_H
#define SPRINGLS__KERNEL_MODEL_CELL_LIST_H

#include "../language/simd.h"
#include "grid.h"
#include "model.h"

/* Returns the cell of a voxel within its brick. */
SPRINGLS__MATHS int springls__cell_in_brick(int x, int y, int z)
{
    return (x & 7) / SPRINGLS__CELL + 4 * ((y & 7) / SPRINGLS__CELL) + 16 * ((z & 7) / SPRINGLS__CELL);
}

/* Notes the particle of the springl that is number `at` in cells.ids. */
SPRINGLS__MATHS void springls__put_place(const springls__model *model, uint32_t at, springls__v3 p)
{
    SPRINGLS__GLOBAL float *block = model->cells.places + 24 * (size_t)(at >> 3) + (at & 7u);
    block[0] = p.x;
    block[8] = p.y;
    block[16] = p.z;
}

/* Fills the last block of places: it is read whole. */
SPRINGLS__MATHS void springls__fill_last_places(const springls__model *model)
{
    uint32_t at = (uint32_t)(model->set.count - model->cells.unbinned_count);
    for (; at & 7u; at++) springls__put_place(model, at, springls__v3_make(0.0f, 0.0f, 0.0f));
}

/* Returns a bit for each place of a block within the square root of r2 of x. */
SPRINGLS__VEC_MATHS uint32_t springls__places_within(SPRINGLS__GLOBAL const float *block, springls__v3 x, float r2)
{
    uint32_t bits = 0u;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec3 d;
        d.x = springls__vec_load(block + i) - x.x;
        d.y = springls__vec_load(block + 8 + i) - x.y;
        d.z = springls__vec_load(block + 16 + i) - x.z;
        bits |= springls__vec_bits(springls__vec_length2(d) <= r2) << i;
    }
    return bits;
}

/* A walk over the springls whose particle lies in a box of cells, row by row within each brick; then over those in no cell. Of those
   in cells it may be limited to particles near a place. */
typedef struct springls__cell_walk {
    int lo[3], hi[3], x, y, z;
    int slot, first, last;                /* of the row: its brick, its cells in there; slot -1: of those in no cell     */
    SPRINGLS__GLOBAL const uint32_t *ids; /* springls of the row that are left: next, ..., end - 1                       */
    uint32_t next, end;
    uint32_t block, found;                /* the first of the eight springls looked at, and a bit for each that is left  */
    springls__v3 near_to;
    float r2;                             /* squared limit of the distance from there; below 0: none                     */
} springls__cell_walk;

SPRINGLS__INNER springls__cell_walk springls__cell_walk_begin(const springls__model *model, springls__v3 lower,
                                                              springls__v3 upper)
{
    springls__cell_walk walk;
    const springls__grid *g = &model->grid;
    springls__voxel_of_place(g, lower, walk.lo);
    springls__voxel_of_place(g, upper, walk.hi);
    walk.x = walk.lo[0] &= -SPRINGLS__CELL;
    walk.y = walk.lo[1] &= -SPRINGLS__CELL;
    walk.z = walk.lo[2] &= -SPRINGLS__CELL;
    walk.slot = walk.first = walk.last = 0;
    walk.ids = model->cells.ids;
    walk.next = walk.end = walk.block = walk.found = 0u;
    walk.near_to = lower;
    walk.r2 = -1.0f;
    return walk;
}

/* Goes on to the next row; returns false at the end. */
SPRINGLS__INNER bool springls__cell_walk_row(const springls__model *model, springls__cell_walk *walk)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const uint32_t *cell;
    int last, row;
    if (walk->z > walk->hi[2]) {
        if (walk->slot < 0) return false;
        walk->slot = -1;
        walk->ids = model->cells.unbinned;
        walk->next = 0;
        walk->end = (uint32_t)model->cells.unbinned_count;
        return true;
    }
    last = springls__imin(walk->x | 7, walk->hi[0]);
    row = springls__cell_in_brick(0, walk->y, walk->z);
    walk->slot = springls__slot_at(g, walk->x, walk->y, walk->z);
    walk->first = row + (walk->x & 7) / SPRINGLS__CELL;
    walk->last = row + (last & 7) / SPRINGLS__CELL;
    cell = g->cell + (size_t)walk->slot * SPRINGLS__CELLS;
    walk->next = cell[walk->first];
    walk->end = cell[walk->last + 1];
    walk->x = last + 1;
    if (walk->x > walk->hi[0]) {
        walk->x = walk->lo[0];
        walk->y += SPRINGLS__CELL;
        if (walk->y > walk->hi[1]) {
            walk->y = walk->lo[1];
            walk->z += SPRINGLS__CELL;
        }
    }
    return true;
}

/* Looks at the next springls of the row, up to the end of their block. */
SPRINGLS__MATHS void springls__cell_walk_block(const springls__model *model, springls__cell_walk *walk)
{
    uint32_t left = walk->end - (walk->next & ~7u), from = walk->next & 7u;
    walk->block = walk->next & ~7u;
    walk->found = 0xffu;
    if (walk->slot >= 0 && walk->r2 >= 0.0f)
        walk->found = springls__places_within(model->cells.places + 3 * (size_t)walk->block, walk->near_to, walk->r2);
    if (left < 8u) walk->found &= (1u << left) - 1u;
    walk->found = walk->found >> from << from;
    walk->next = left < 8u ? walk->end : walk->block + 8u;
}

/* Goes on to the next springls; returns false at the end. */
SPRINGLS__MATHS bool springls__cell_walk_on(const springls__model *model, springls__cell_walk *walk)
{
    while (walk->found == 0u)
        if (walk->next != walk->end) springls__cell_walk_block(model, walk);
        else if (!springls__cell_walk_row(model, walk)) return false;
    return true;
}

/* Returns the next springl; -1 at the end. */
SPRINGLS__MATHS int springls__cell_walk_next(const springls__model *model, springls__cell_walk *walk)
{
    uint32_t at;
    if (walk->found == 0u && !springls__cell_walk_on(model, walk)) return -1;
    at = walk->block + (uint32_t)springls__lowest_bit(walk->found);
    walk->found &= walk->found - 1u;
    return (int)walk->ids[at];
}

/* Begins a walk over the springls whose particle lies within r of x, and over those in no cell, whose distance the caller tests. */
SPRINGLS__MATHS springls__cell_walk springls__cell_walk_near(const springls__model *model, springls__v3 x, float r)
{
    springls__cell_walk walk = springls__cell_walk_begin(model, springls__v3_make(x.x - r, x.y - r, x.z - r),
                                                         springls__v3_make(x.x + r, x.y + r, x.z + r));
    walk.near_to = x;
    walk.r2 = r * r;
    return walk;
}

/* Begins a walk over all springls of which some point may lie within `radius` of x. */
SPRINGLS__MATHS springls__cell_walk springls__cell_walk_around(const springls__model *model, springls__v3 x, float radius)
{
    return springls__cell_walk_near(model, x, radius + model->cells.bounding_radius);
}

/* Returns whether a springl of this bounding radius is too large for cells. */
SPRINGLS__MATHS bool springls__is_large(float bounding_radius)
{
    const float largest = 2.5f; /* voxels: twice that of a springl about to be split */
    return bounding_radius > largest;
}

/* Finds the key of particle args.cell_key.first + i: its cell, counted through all slots, plus 1 for the scan. */
SPRINGLS__INNER void springls__cell_key_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    const int n = args.cell_key.first + i;
    SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[n];
    int at[3], slot;
    uint32_t key;
    springls__voxel_of_place(g, s->p, at);
    slot = springls__slot_at(g, at[0], at[1], at[2]);
    key = (uint32_t)slot * SPRINGLS__CELLS + (uint32_t)springls__cell_in_brick(at[0], at[1], at[2]) + 1u;
    if (springls__is_large(s->bounding_radius)) key = SPRINGLS__LARGE_KEY;
    model->cells.key[n] = slot < SPRINGLS__FIRST_SLOT ? SPRINGLS__OUTSIDE_KEY : key;
}

SPRINGLS__MATHS void springls__count_in_cell(const springls__model *model, int i)
{
    SPRINGLS__NEXT(model->grid.cell + model->cells.key[i]);
}

/* Replaces the counts of a brick's cells, entry c + 1 for cell c, by where the cells begin in `ids`, given where the brick begins.
   Putting springls in place advances each entry to the end of its cell. Returns where the next brick begins. */
SPRINGLS__MATHS uint32_t springls__scan_cells(SPRINGLS__GLOBAL uint32_t *cell, uint32_t begin)
{
    int c;
    cell[0] = begin;
    for (c = 1; c < SPRINGLS__CELLS; c++) {
        uint32_t count = cell[c];
        cell[c] = begin;
        begin += count;
    }
    return begin;
}

SPRINGLS__MATHS void springls__put_in_cell(const springls__model *model, int i)
{
    uint32_t at;
    if (!springls__is_in_cell(model->cells.key[i])) return;
    at = SPRINGLS__NEXT(model->grid.cell + model->cells.key[i]);
    model->cells.ids[at] = (uint32_t)i;
    springls__put_place(model, at, model->set.s[i].p);
}

/* Counts a springl in the lists of the bricks it comes within `margin` of, entry r + 1 of brick_list_first for active brick r; a scan
   replaces the counts by where the lists begin. */
SPRINGLS__MATHS void springls__count_in_brick_lists(const springls__model *model, float margin, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const uint32_t *rank = springls__brick_rank(model);
    springls__brick_walk walk = springls__brick_walk_begin(g, model->set.s[i], margin);
    int entry;
    while ((entry = springls__brick_walk_next(g, &walk)) >= 0)
        if (g->top[entry] >= SPRINGLS__FIRST_SLOT) SPRINGLS__NEXT(model->cells.brick_list_first + rank[g->top[entry]] + 1);
}

/* Puts springl i into the lists that springls__count_in_brick_lists has counted it in, and so advances their entries to their
   ends. */
SPRINGLS__MATHS void springls__put_in_brick_lists(const springls__model *model, float margin, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const uint32_t *rank = springls__brick_rank(model);
    springls__brick_walk walk = springls__brick_walk_begin(g, model->set.s[i], margin);
    int entry;
    while ((entry = springls__brick_walk_next(g, &walk)) >= 0)
        if (g->top[entry] >= SPRINGLS__FIRST_SLOT)
            model->cells.brick_list_ids[SPRINGLS__NEXT(model->cells.brick_list_first + rank[g->top[entry]] + 1)] = (uint32_t)i;
}

/* Finds the bricks that the particles of a brick are within one cell of, given its cells: a mask as springls__brick_around
   counts. */
SPRINGLS__MATHS uint32_t springls__cells_neighbor_mask(SPRINGLS__GLOBAL const uint32_t *cell)
{
    uint32_t mask = 0;
    int y, z;
    for (z = 0; z < 4; z++)
        for (y = 0; y < 4; y++, cell += 4)
            if (cell[4] > cell[0])
                mask |= springls__neighbor_mask_of_row(cell[1] > cell[0], cell[4] > cell[3], y == 0, y == 3, z == 0, z == 3);
    return mask;
}

/* Finds the bricks that searches around active brick i need, as a mask about `origin`: those within one cell of its particles.
   From active_count on i counts the springls in no cell: all bricks around theirs. */
SPRINGLS__MATHS uint32_t springls__bricks_to_cover(const springls__model *model, int i, int origin[3])
{
    const springls__grid *g = &model->grid;
    if (i < g->active_count) {
        springls__slot_origin(g, g->active[i], origin);
        return springls__cells_neighbor_mask(springls__cells_of(g, g->active[i]));
    }
    springls__origin_of_place(g, model->set.s[model->cells.unbinned[i - g->active_count]].p, origin);
    return SPRINGLS__ALL_AROUND;
}

#endif
