/* contour_region.h - where the mesh of what springls hold has to be made again for chunks: around what has changed since it was published.
   For each eighth of a brick, 4^3 voxels, its springls and phi are summed up in a hash.

     eighths that differ  -->  the bricks within 4 voxels, or 8 at creases  -->  their table  -->  closed with the bricks around?
                                          ^                                                             |
                                          `------------------- one more brick all around ---------- no -'

   A springl's hits lie within 2.5 voxels of it, those of the springls that it creases within 5.7. How far a line's sides may follow is
   not bounded: so the new triangles are kept only where their border is the one of the triangles that they replace. */
#ifndef SPRINGLS__OUTPUT_CONTOUR_REGION_H
#define SPRINGLS__OUTPUT_CONTOUR_REGION_H

#include "contour_chunks.h"

#define SPRINGLS__LARGEST_REGION_SHARE 3 /* a region of more than this part of the bricks is no cheaper, with its margin, than the whole */

/* ---- what eighths of bricks are made from ---- */

SPRINGLS__FN uint64_t springls__mixed(uint64_t h)
{
    h = (h ^ h >> 32) * 0xD6E8FEB86659FD93u;
    return h ^ h >> 32;
}

/* Returns a hash of all that the table takes from springl i. */
SPRINGLS__FN uint64_t springls__hash_springl(const springls__model *model, int i)
{
    const springls__springl s = model->set.s[i];
    const uint32_t flags = (springls__is_overlapped(model, i) ? 1u : 0u) | (springls__at_edge(model, i) ? 2u : 0u);
    uint64_t hash = springls__hash(SPRINGLS__HASH_BEGIN ^ flags, &s, sizeof s);
    return springls__mixed((hash ^ model->set.id[i]) * 1099511628211u);
}

/* Adds the springls of an active brick to the hashes of its eighths. */
SPRINGLS__FN void springls__hash_springls(const springls__model *model, int slot, uint64_t eighth[8])
{
    const uint32_t *cell = springls__cells_of(&model->grid, slot);
    int c;
    uint32_t at;
    for (c = 0; c < SPRINGLS__CELLS - 1; c++) /* cells of 2^3 voxels, x fastest */
        for (at = cell[c]; at < cell[c + 1]; at++)
            eighth[(c >> 1 & 1) | (c >> 3 & 1) << 1 | (c >> 5) << 2] += springls__hash_springl(model, (int)model->cells.ids[at]);
}

/* Adds phi of an active brick to the hashes of its eighths: as far as it is evidence of a side (springls__phi_evidence). */
SPRINGLS__FN void springls__hash_phi(const springls__grid *g, int slot, uint64_t eighth[8])
{
    const float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int row, half, k;
    for (row = 0; row < 64; row++) /* of eight voxels along x */
        for (half = 0; half < 2; half++) {
            uint64_t hash = (uint64_t)(row + 1);
            for (k = 0; k < 4; k++) {
                const float value = springls__clamp(phi[8 * row + 4 * half + k], -1.0f, 1.0f);
                uint32_t bits;
                memcpy(&bits, &value, sizeof bits);
                hash = (hash ^ bits) * 1099511628211u;
            }
            eighth[half | (row >> 2 & 1) << 1 | (row >> 5) << 2] += springls__mixed(hash);
        }
}

/* Finds what the eighths of the brick at a place in the window are made from. */
SPRINGLS__FN void springls__hash_eighths(const springls__model *model, const int place[3], uint64_t eighth[8])
{
    const int slot = springls__slot_of_brick_place(&model->grid, place);
    int k;
    for (k = 0; k < 8; k++) eighth[k] = (uint64_t)(slot < SPRINGLS__FIRST_SLOT ? slot : SPRINGLS__FIRST_SLOT);
    if (slot < SPRINGLS__FIRST_SLOT) return;
    springls__hash_springls(model, slot, eighth);
    springls__hash_phi(&model->grid, slot, eighth);
}

/* Finds the place in the window of a brick of a contour. */
SPRINGLS__FN void springls__place_of_contour_brick(const springls_context *ctx, const springls__contour_brick *brick, int place[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) place[axis] = brick->at.at[axis] - ctx->window.offset[axis] / SPRINGLS__BRICK;
}

/* Returns, as bits, which eighths of an active brick have springls that the table has found to be creased. */
SPRINGLS__FN uint8_t springls__creased_eighths(const springls_context *ctx, const int place[3])
{
    const springls__model *model = &ctx->model;
    const springls__surfel *surfel = (const springls__surfel *)ctx->surface_memory[SPRINGLS__SURFACE_SURFEL].data;
    const int slot = springls__slot_of_brick_place(&model->grid, place);
    const uint32_t *cell;
    uint8_t creased = 0;
    uint32_t at;
    int c;
    if (slot < SPRINGLS__FIRST_SLOT) return 0;
    cell = springls__cells_of(&model->grid, slot);
    for (c = 0; c < SPRINGLS__CELLS - 1; c++)
        for (at = cell[c]; at < cell[c + 1]; at++)
            if (surfel[model->cells.ids[at]].creased) creased |= (uint8_t)(1u << ((c >> 1 & 1) | (c >> 3 & 1) << 1 | (c >> 5) << 2));
    return creased;
}

/* Writes what the bricks of the new contour that are not kept were made from. */
SPRINGLS__FN void springls__hash_contour_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    int place[3];
    (void)memory;
    for (; begin < end; begin++) {
        springls__contour_brick *brick = &c->store[1 - c->now].brick[begin];
        if (brick->table < 0) continue;
        springls__place_of_contour_brick(c->ctx, brick, place);
        springls__hash_eighths(&c->ctx->model, place, brick->eighth);
        brick->creased = springls__creased_eighths(c->ctx, place);
    }
}

/* ---- what has changed ---- */

/* Returns whether springls in an eighth of a brick, or as near to it as they may crease those in it, face different ways. */
SPRINGLS__FN bool springls__may_be_creased(const springls__model *model, const int place[3], int eighth)
{
    const float r = SPRINGLS__TRIM_RADIUS, width = 4.0f + 2.0f * r;
    const springls__v3 lower = springls__v3_make((float)(8 * place[0] + 4 * (eighth & 1)) - r,
                                                 (float)(8 * place[1] + 4 * (eighth >> 1 & 1)) - r,
                                                 (float)(8 * place[2] + 4 * (eighth >> 2)) - r);
    const springls__v3 upper = springls__v3_make(lower.x + width, lower.y + width, lower.z + width);
    springls__cell_walk walk = springls__cell_walk_begin(model, lower, upper);
    const int first = springls__cell_walk_next(model, &walk);
    springls__v3 n;
    int i;
    if (first < 0) return false;
    n = springls__springl_normal(model->set.s[first]);
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__fabs(springls__dot(springls__springl_normal(model->set.s[i]), n)) < springls__least_uncreased_cosine()) return true;
    return false;
}

/* Returns, as bits, which eighths of the brick at a place differ from those of a published brick, which may be NULL; 256 times that: which
   of those may be, or have been, creased. */
SPRINGLS__FN uint32_t springls__moved_eighths(const springls__model *model, const int place[3], const springls__contour_brick *before)
{
    uint64_t eighth[8];
    uint32_t moved = 0;
    int k;
    springls__hash_eighths(model, place, eighth);
    for (k = 0; k < 8; k++) {
        if (before && eighth[k] == before->eighth[k]) continue;
        moved |= 1u << k;
        if (!before || (before->creased >> k & 1u) || springls__may_be_creased(model, place, k)) moved |= 256u << k;
    }
    return moved;
}

/* Finds what has changed in published bricks. */
SPRINGLS__FN void springls__find_moved_work(void *arg, int begin, int end, float *memory)
{
    const springls__contour_chunks *c = (const springls__contour_chunks *)arg;
    int place[3];
    (void)memory;
    for (; begin < end; begin++) {
        const springls__contour_brick *brick = &c->store[c->now].brick[begin];
        springls__place_of_contour_brick(c->ctx, brick, place);
        c->moved[begin] = springls__moved_eighths(&c->ctx->model, place, brick);
    }
}

/* Returns, as bits, the bricks around one that its eighths `moved` reach. */
SPRINGLS__FN uint32_t springls__bricks_reached(uint32_t moved)
{
    uint32_t reached = 0;
    int k, d;
    for (k = 0; k < 8; k++)
        for (d = 0; d < 27 && (moved >> k & 1u); d++) {
            const int to[3] = { d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1 };
            bool reaches = true;
            int axis;
            for (axis = 0; axis < 3; axis++) /* the brick beside it on its own side, or the other one too */
                reaches = reaches && (to[axis] == 0 || to[axis] == (k >> axis & 1 ? 1 : -1) || (moved >> (8 + k) & 1u));
            if (reaches) reached |= 1u << d;
        }
    return reached;
}

/* ---- the region ---- */

/* Adds the bricks around a place that are in a mask to the region. */
SPRINGLS__FN void springls__add_to_region(springls__contour_chunks *c, const int center[3], uint32_t mask)
{
    int d, place[3];
    for (d = 0; d < 27; d++) {
        if (!(mask >> d & 1u)) continue;
        springls__place_around(center, d, place);
        c->region[c->region_bricks++] = springls__place_key(place);
    }
}

/* Sorts the region's keys, each once. */
SPRINGLS__FN void springls__sort_region(springls__contour_chunks *c)
{
    int i, n = 0;
    springls__sort_keys(c->region, (size_t)c->region_bricks);
    for (i = 0; i < c->region_bricks; i++)
        if (n == 0 || c->region[i] != c->region[n - 1]) c->region[n++] = c->region[i];
    c->region_bricks = n;
}

/* Makes room for the region, keeping it. */
SPRINGLS__FN springls_status springls__reserve_region(springls_context *ctx, springls__contour_chunks *c, size_t most)
{
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->region_memory, most + 1, sizeof *c->region, (size_t)c->region_bricks * sizeof *c->region));
    c->region = (uint64_t *)c->region_memory.data;
    return SPRINGLS_OK;
}

/* Gives the table the region: those of its bricks that the table of all would have. Where they are many, it is the whole. */
SPRINGLS__FN springls_status springls__take_region(springls_context *ctx, springls__contour_chunks *c)
{
    int *places, i, n = 0;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_REGION, 3 * (size_t)c->region_bricks, sizeof(int)));
    places = (int *)ctx->surface_memory[SPRINGLS__SURFACE_REGION].data;
    for (i = 0; i < c->region_bricks; i++) {
        const uint64_t key = c->region[i];
        int place[3], axis;
        for (axis = 0; axis < 3; axis++) place[axis] = (int)(key >> 21 * axis & 0x1fffffu) - 2;
        if (springls__surface_reaches(&ctx->model.grid, place)) memcpy(places + 3 * (size_t)n++, place, sizeof place);
    }
    ctx->surface_region = n;
    c->whole = SPRINGLS__LARGEST_REGION_SHARE * n > c->store[c->now].bricks;
    return SPRINGLS_OK;
}

/* Collects the bricks that have to be made again: the region. Precondition: c->moved is known. */
SPRINGLS__FN springls_status springls__collect_region(springls_context *ctx, springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now];
    const springls__grid *g = &ctx->model.grid;
    size_t most = (size_t)g->active_count;
    int i, place[3], at[3], axis;
    for (i = 0; i < before->bricks; i++) most += c->moved[i] != 0;
    c->region_bricks = 0;
    SPRINGLS__TRY(springls__reserve_region(ctx, c, 27 * most));
    for (i = 0; i < before->bricks; i++) {
        if (c->moved[i] == 0) continue;
        springls__place_of_contour_brick(ctx, &before->brick[i], place);
        springls__add_to_region(c, place, springls__bricks_reached(c->moved[i]));
    }
    for (i = 0; i < g->active_count; i++) { /* those that are new */
        springls__brick_place(g, g->slot_brick[g->active[i]], place);
        for (axis = 0; axis < 3; axis++) at[axis] = place[axis] + ctx->window.offset[axis] / SPRINGLS__BRICK;
        if (springls__find_contour_brick(ctx, before, at) < 0) springls__add_to_region(c, place, (1u << 27) - 1u);
    }
    springls__sort_region(c);
    return springls__take_region(ctx, c);
}

/* Adds all bricks around the region to it. */
SPRINGLS__FN springls_status springls__widen_region(springls_context *ctx, springls__contour_chunks *c)
{
    const int bricks = c->region_bricks;
    int i;
    SPRINGLS__TRY(springls__reserve_region(ctx, c, 28 * (size_t)bricks));
    for (i = 0; i < bricks; i++) {
        const uint64_t key = c->region[i];
        int place[3], axis;
        for (axis = 0; axis < 3; axis++) place[axis] = (int)(key >> 21 * axis & 0x1fffffu) - 2;
        springls__add_to_region(c, place, (1u << 27) - 1u);
    }
    springls__sort_region(c);
    return springls__take_region(ctx, c);
}

/* ---- whether the new triangles fit ---- */

/* Returns the sum over the directed edges of a brick's triangles of hashes that are opposite for opposite edges: over triangles whose border
   is the same such sums are the same. */
SPRINGLS__FN uint64_t springls__border_of_brick(const springls__contour_store *store, const springls__contour_brick *brick)
{
    const uint32_t *corner = store->corner + 3 * (size_t)brick->first_triangle;
    uint64_t sum = 0;
    int t, k, at[3];
    for (t = 0; t < brick->triangles; t++) {
        uint64_t vertex[3];
        for (k = 0; k < 3; k++) {
            const uint32_t c = corner[3 * t + k];
            springls__place_around(brick->at.at, (int)(c >> 27), at);
            vertex[k] = springls__mixed((uint64_t)springls__hash3((uint32_t)at[0], (uint32_t)at[1], (uint32_t)at[2])
                                        ^ (uint64_t)(c & ((1u << 27) - 1u)) * 0x9E3779B97F4A7C15u);
        }
        for (k = 0; k < 3; k++) {
            const uint64_t from = vertex[k], to = vertex[k < 2 ? k + 1 : 0];
            const uint64_t edge = springls__mixed((from < to ? from : to) * 0xBF58476D1CE4E5B9u ^ (from < to ? to : from));
            sum += from < to ? edge : ~edge + 1u;
        }
    }
    return sum;
}

/* Returns whether the new triangles of the region have the border of those that they replace. */
SPRINGLS__FN bool springls__region_fits(const springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now], *after = &c->store[1 - c->now];
    uint64_t was = 0, is = 0;
    int i;
    for (i = 0; i < before->bricks; i++)
        if (springls__is_in_region(c, before->window, &before->brick[i])) was += springls__border_of_brick(before, &before->brick[i]);
    for (i = 0; i < after->bricks; i++)
        if (after->brick[i].table >= 0) is += springls__border_of_brick(after, &after->brick[i]);
    return was == is;
}

#endif
