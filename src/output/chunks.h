/* chunks.h - meshes the zero level brick by brick, and lists the bricks whose mesh has changed; contour_chunks.h does so for the mesh of
   what springls hold. Each consumer has a published
   level set: a voxel of it takes the model's value only when the two differ by more than `tolerance`. All chunks are meshed
   from it, so two neighbors share the bits of their common vertices, whenever either was meshed. */
#ifndef SPRINGLS__OUTPUT_CHUNKS_H
#define SPRINGLS__OUTPUT_CHUNKS_H

#include "../runtime/finite.h"
#include "../../kernels_embed/output/isosurface.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/step.h"
#include "../stages/window.h"
#include "../stages/surface_parts.h"
#include "vertex_material.h"
#include "chunk_signature.h"
#include "contour_chunks.h"
#include "contour_region.h"

/* What springls_chunks_begin and _continue have done so far. */
typedef enum springls__chunks_state {
    SPRINGLS__CHUNKS_IDLE,
    SPRINGLS__CHUNKS_IN_PROGRESS, /* begun; begins again where ctx->step has been dropped or is another's */
    SPRINGLS__CHUNKS_READY
} springls__chunks_state;

struct springls_chunks {
    springls_chunks_desc desc;
    springls__grid published;              /* its table, plane, top, slot_brick, free_slots and phi; the rest is not used     */
    springls__brick_signature *signature;  /* [published slot] when the brick was last meshed                          */
    uint8_t *dirty, *has_mesh;             /* [published entry] 1: mesh it again; 1: its last mesh had triangles       */
    uint32_t *affected;                    /* [list entry] mask of the bricks around it whose mesh a change affects    */
    int *list;                             /* entries of bricks whose values may differ from the published ones        */
    springls_chunk *chunk;                 /* those that have changed                                                  */
    int window[3];                         /* voxels: where the window was at the last update                          */
    springls__lattice_brick *left;         /* [left_count] bricks with a mesh that the window has left behind          */
    int left_count;
    int listed, count;                     /* bricks of list, chunks                                                   */
    bool publishing;       /* some values may be published whose bricks are not dirty yet                              */
    springls__chunks_state state;
    springls__contour_chunks contours;     /* what is published of what springls hold, instead of phi                  */
    springls__buffer plane_memory, top_memory, slot_brick_memory, free_slots_memory, phi_memory, signature_memory, dirty_memory;
    springls__buffer has_mesh_memory, affected_memory, list_memory, chunk_memory, vertex_memory, corner_memory, left_memory;
};

SPRINGLS__FN void springls__chunks_free(springls_context *ctx, springls_chunks *c)
{
    springls__buffer *const buffers[] = { &c->plane_memory, &c->top_memory, &c->slot_brick_memory, &c->free_slots_memory,
                                          &c->phi_memory, &c->signature_memory, &c->dirty_memory, &c->has_mesh_memory,
                                          &c->affected_memory, &c->list_memory, &c->chunk_memory, &c->vertex_memory,
                                          &c->corner_memory, &c->left_memory };
    size_t i;
    for (i = 0; i < sizeof buffers / sizeof *buffers; i++) springls__buffer_free(ctx, buffers[i]);
    springls__contour_chunks_free(ctx, &c->contours);
    springls__release(ctx, c, sizeof *c);
}

/* Grows the published level set to count slots. */
SPRINGLS__FN springls_status springls__chunks_reserve(springls_context *ctx, springls_chunks *c, int count)
{
    size_t n = (size_t)count, used = (size_t)c->published.slot_count;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->slot_brick_memory, n, sizeof(int), used * sizeof(int)));
    c->published.slot_brick = (int *)c->slot_brick_memory.data; /* at once: what follows may fail, and the old memory is gone */
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->free_slots_memory, n, sizeof(int),
                                        (size_t)c->published.free_count * sizeof(int)));
    c->published.free_slots = (int *)c->free_slots_memory.data;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->phi_memory, n * SPRINGLS__BRICK_VOXELS, sizeof(float),
                                        used * SPRINGLS__BRICK_VOXELS * sizeof(float)));
    c->published.phi = (float *)c->phi_memory.data;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->signature_memory, n, sizeof *c->signature, used * sizeof *c->signature));
    c->signature = (springls__brick_signature *)c->signature_memory.data;
    return SPRINGLS_OK;
}

/* ---- a top table or a window that has moved ---- */

/* Returns the place on the lattice of the brick of a published entry. */
SPRINGLS__FN springls__lattice_brick springls__lattice_place(const springls_chunks *c, int entry)
{
    springls__lattice_brick place;
    int axis;
    springls__entry_origin(&c->published, entry, place.at);
    for (axis = 0; axis < 3; axis++) place.at[axis] = (place.at[axis] + c->window[axis]) / SPRINGLS__BRICK;
    return place;
}

/* Finds the place in a window of a brick of the lattice, counted in bricks; false: it is beyond. */
SPRINGLS__FN bool springls__place_in_window(const springls__grid *g, const int window[3], const springls__lattice_brick *brick,
                                            int place[3])
{
    int axis;
    bool within = true;
    for (axis = 0; axis < 3; axis++) {
        place[axis] = brick->at[axis] - window[axis] / SPRINGLS__BRICK;
        within = within && place[axis] >= 0 && place[axis] < g->bricks[axis];
    }
    return within;
}

/* Drops the published bricks that the window leaves behind, notes those with a mesh, and gives the others their new numbers. They
   are meshed again: vertices may differ in the last bit, and neighbours repeat them. The top table is as before the move. */
SPRINGLS__FN void springls__move_published(springls_chunks *c, const int bricks[3])
{
    springls__grid *g = &c->published;
    float moved[3];
    int count = (int)springls__entry_count(g), i, k;
    for (i = 0; i < count; i++) {
        const int to = springls__brick_after_move(g, springls__brick_of_entry(g, i), bricks), slot = g->top[i];
        if (to < 0 && c->has_mesh[i]) c->left[c->left_count++] = springls__lattice_place(c, i);
        if (slot < SPRINGLS__FIRST_SLOT) continue;
        g->slot_brick[slot] = to;
        c->dirty[i] = 1;
        if (to < 0) g->free_slots[g->free_count++] = slot;
        for (k = 0; k < 3; k++) moved[k] = -(float)(SPRINGLS__BRICK * bricks[k]) * (float)c->signature[slot].count;
        c->signature[slot].particles = springls__add(c->signature[slot].particles, springls__v3_make(moved[0], moved[1], moved[2]));
    }
}

/* Replaces the top table of the published level set and what it has for each entry, after its bricks have moved by `bricks`.
   Nothing has changed on failure. */
SPRINGLS__FN springls_status springls__change_published(springls_context *ctx, springls_chunks *c, const springls__table *to,
                                                        const int bricks[3])
{
    static const size_t size[4] = { sizeof(int), 1, 1, sizeof(int) };
    springls__buffer *const memory[4] = { &c->top_memory, &c->dirty_memory, &c->has_mesh_memory, &c->plane_memory };
    springls__grid changed = c->published;
    springls__buffer moved[4];
    springls_status status = SPRINGLS_OK;
    int i;
    memset(moved, 0, sizeof moved);
    for (i = 0; i < 4 && status == SPRINGLS_OK; i++)
        status = springls__buffer_grow(ctx, &moved[i], i < 3 ? springls__entries_of(to) : 6 * SPRINGLS__MOST_PLANES, size[i], 0);
    if (status != SPRINGLS_OK) {
        for (i = 0; i < 4; i++) springls__buffer_free(ctx, &moved[i]);
        return status;
    }
    if (bricks[0] || bricks[1] || bricks[2]) springls__move_published(c, bricks);
    changed.plane = (int *)moved[3].data;
    springls__take_table(&changed, to);
    for (i = 0; i < 3; i++) springls__copy_entries(&c->published, memory[i]->data, &changed, moved[i].data, size[i], bricks);
    for (i = 0; i < 4; i++) {
        springls__buffer_free(ctx, memory[i]);
        *memory[i] = moved[i];
    }
    c->published.table = *to;
    c->published.plane = changed.plane;
    c->published.top = (int *)c->top_memory.data;
    c->dirty = (uint8_t *)c->dirty_memory.data;
    c->has_mesh = (uint8_t *)c->has_mesh_memory.data;
    return SPRINGLS_OK;
}

/* Takes from the list of bricks left behind those that are in the window again: the consumer has a mesh of them. */
SPRINGLS__FN void springls__take_back_bricks(springls_chunks *c)
{
    int i, n = 0, place[3], entry;
    for (i = 0; i < c->left_count; i++) {
        if (!springls__place_in_window(&c->published, c->window, &c->left[i], place)) {
            c->left[n++] = c->left[i];
            continue;
        }
        entry = springls__entry_at(&c->published, 8 * place[0], 8 * place[1], 8 * place[2]);
        c->dirty[entry] = c->has_mesh[entry] = 1;
    }
    c->left_count = n;
}

/* Returns the table that has the bricks of a box, those that are published or have a mesh, and those that were left behind and are
   in the window again, after the published ones have moved by `bricks`. */
SPRINGLS__FN springls__table springls__table_to_publish(const springls_context *ctx, const springls_chunks *c,
                                                        springls__brick_groups groups, const int bricks[3])
{
    const springls__grid *g = &c->published;
    int i, place[3], count = (int)springls__entry_count(g);
    for (i = 0; i < count; i++)
        if (g->top[i] != SPRINGLS__OUTSIDE || c->dirty[i] || c->has_mesh[i]) springls__keep_entry(g, &groups, i, bricks);
    for (i = 0; i < c->left_count; i++)
        if (springls__place_in_window(g, ctx->window.offset, &c->left[i], place)) springls__keep_box(g, &groups, place, place, 0);
    return springls__table_of(g, &groups);
}

/* Moves what is published to where the model's window is now, and makes its top table have the bricks of the model. Nothing has
   changed on failure. */
SPRINGLS__FN springls_status springls__chunks_follow(springls_context *ctx, springls_chunks *c)
{
    springls__brick_groups groups = springls__no_groups();
    springls__table to;
    int bricks[3], axis, i, n = c->left_count;
    const int count = (int)springls__entry_count(&c->published);
    springls__keep_grid(&ctx->model.grid, &groups, springls__unmoved);
    if (springls__table_keeps(&c->published, &groups) && memcmp(c->window, ctx->window.offset, sizeof c->window) == 0
        && c->left_count == 0)
        return SPRINGLS_OK;
    for (i = 0; i < count; i++) n += c->has_mesh[i];
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->left_memory, (size_t)n + 1, sizeof *c->left,
                                        (size_t)c->left_count * sizeof *c->left));
    c->left = (springls__lattice_brick *)c->left_memory.data;
    for (axis = 0; axis < 3; axis++) bricks[axis] = (ctx->window.offset[axis] - c->window[axis]) / SPRINGLS__BRICK;
    to = springls__table_to_publish(ctx, c, groups, bricks);
    SPRINGLS__TRY(springls__change_published(ctx, c, &to, bricks));
    memcpy(c->window, ctx->window.offset, sizeof c->window);
    springls__take_back_bricks(c);
    return SPRINGLS_OK;
}

/* Allocates an empty published level set: the first update lists every chunk. */
SPRINGLS__FN springls_status springls__chunks_make(springls_context *ctx, springls_chunks *c)
{
    const springls__grid *g = &ctx->model.grid;
    memcpy(c->published.size, g->size, sizeof g->size);
    memcpy(c->published.bricks, g->bricks, sizeof g->bricks);
    SPRINGLS__TRY(springls__change_published(ctx, c, &g->table, springls__unmoved));
    SPRINGLS__TRY(springls__chunks_reserve(ctx, c, SPRINGLS__FIRST_SLOT));
    c->published.slot_count = SPRINGLS__FIRST_SLOT;
    return SPRINGLS_OK;
}

/* Returns the published entry of a chunk that counts bricks in the window. */
SPRINGLS__FN int springls__entry_of_chunk(const springls_chunks *c, const springls_chunk *chunk)
{
    const int *b = chunk->brick;
    return springls__entry_at(&c->published, SPRINGLS__BRICK * b[0], SPRINGLS__BRICK * b[1], SPRINGLS__BRICK * b[2]);
}

/* ---- finding what has changed ---- */

/* Finds the bricks whose mesh depends on voxels x of row (y, z) of a brick: a vertex on the voxels up to the end of its brick, a
   normal on voxels one further. Bits as in springls__neighbor_mask_of_row. */
SPRINGLS__FN void springls__bricks_affected_by(int y, int z, uint32_t bricks[SPRINGLS__BRICK])
{
    int x;
    bricks[0] = springls__neighbor_mask_of_row(true, false, y <= 1, y == 7, z <= 1, z == 7);
    bricks[2] = springls__neighbor_mask_of_row(false, false, y <= 1, y == 7, z <= 1, z == 7);
    bricks[7] = springls__neighbor_mask_of_row(false, true, y <= 1, y == 7, z <= 1, z == 7);
    bricks[1] = bricks[0];
    for (x = 3; x < 7; x++) bricks[x] = bricks[2];
}

/* Returns whether the published zero level may pass between voxel v of a brick and one of its six neighbors. origin: the
   brick's first voxel; brick: its values in the field of g. */
SPRINGLS__FN bool springls__may_cross(const springls__grid *g, const int origin[3], const float *brick, int v, float tolerance)
{
    int axis, direction;
    for (axis = 0; axis < 3; axis++)
        for (direction = -1; direction <= 1; direction += 2) {
            int at[3] = { v & 7, v >> 3 & 7, v >> 6 };
            float neighbor;
            at[axis] += direction;
            if (at[axis] >= 0 && at[axis] < SPRINGLS__BRICK) neighbor = brick[v + direction * (1 << 3 * axis)];
            else neighbor = springls__grid_phi(g, g->phi, origin[0] + at[0], origin[1] + at[1], origin[2] + at[2]);
            if (brick[v] < 0.0f ? neighbor >= -tolerance : neighbor <= tolerance) return true;
        }
    return false;
}

/* Publishes the voxels of one brick that differ by more than the tolerance and, if there are any, all voxels that affect this brick alone.
   now: the model's values; published: the consumer's. Returns the mask of the bricks to be meshed again. */
SPRINGLS__FN uint32_t springls__publish_brick(const springls__grid *g, const int origin[3], const float *now, float *published,
                                              float tolerance)
{
    const float deep = 1.5f; /* voxels: a value further from the surface moves a vertex only where phi is steep (may_cross) */
    const uint32_t own = 1u << 13;
    uint32_t affected = 0u, bricks[SPRINGLS__BRICK];
    int v, y, z;
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
        const float before = published[v];
        if ((v & 7) == 0) springls__bricks_affected_by(v >> 3 & 7, v >> 6, bricks);
        if (springls__fabs(now[v] - before) <= tolerance) continue;
        published[v] = now[v];
        if ((affected & bricks[v & 7]) == bricks[v & 7]) continue;
        if (tolerance == 0.0f || springls__min(springls__fabs(now[v]), springls__fabs(before)) < deep
            || (now[v] < 0.0f) != (before < 0.0f) || springls__may_cross(g, origin, now, v, tolerance))
            affected |= bricks[v & 7];
    }
    if (!affected) return 0u;
    for (z = 2; z < 7; z++)
        for (y = 2; y < 7; y++) {
            v = springls__voxel_in_brick(2, y, z);
            memcpy(published + v, now + v, 5 * sizeof *now);
        }
    return affected | own;
}

/* Returns the slot that the model has for the brick of a published entry. */
SPRINGLS__FN int springls__slot_published(const springls__grid *g, const springls__grid *published, int entry)
{
    int at[3];
    springls__entry_origin(published, entry, at);
    return springls__slot_of_voxel(g, at[0], at[1], at[2]);
}

SPRINGLS__FN void springls__publish_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    springls_chunks *c = ctx->step.chunks;
    const springls__grid *g = &ctx->model.grid;
    int origin[3];
    (void)memory;
    for (; begin < end; begin++) {
        int slot = c->published.top[c->list[begin]];
        const float *now = g->phi + (size_t)springls__slot_published(g, &c->published, c->list[begin]) * SPRINGLS__BRICK_VOXELS;
        springls__slot_origin(&c->published, slot, origin);
        c->affected[begin] = springls__publish_brick(g, origin, now, c->published.phi + (size_t)slot * SPRINGLS__BRICK_VOXELS,
                                                     c->desc.tolerance);
    }
}

/* Gives a slot to the constant brick of a published entry, and fills it with the constant. */
SPRINGLS__FN void springls__add_published_brick(springls_chunks *c, int entry)
{
    springls__grid *published = &c->published;
    int side = published->top[entry];
    int slot = published->free_count ? published->free_slots[--published->free_count] : published->slot_count++;
    published->top[entry] = slot;
    published->slot_brick[slot] = springls__brick_of_entry(published, entry);
    springls__fill(published->phi, slot, side == SPRINGLS__INSIDE ? -published->far_value : published->far_value);
    memset(&c->signature[slot], 0, sizeof c->signature[slot]);
}

/* Returns whether the model's values in the brick of a published entry may differ from the published ones. */
SPRINGLS__FN bool springls__may_differ(const springls__grid *g, const springls__grid *published, int entry)
{
    return published->top[entry] >= SPRINGLS__FIRST_SLOT || springls__slot_published(g, published, entry) != published->top[entry];
}

/* Writes c->list, the bricks that may differ; each gets a slot of the published level set. */
SPRINGLS__FN springls_status springls__list_bricks(springls_context *ctx, springls_chunks *c)
{
    const springls__grid *g = &ctx->model.grid;
    springls__grid *published = &c->published;
    int entries = (int)springls__entry_count(published), i, n = 0, added = 0;
    for (i = 0; i < entries; i++) {
        if (!springls__may_differ(g, published, i)) continue;
        n++;
        added += published->top[i] < SPRINGLS__FIRST_SLOT;
    }
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->list_memory, (size_t)n + 1, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->affected_memory, (size_t)n + 1, sizeof(uint32_t), 0));
    SPRINGLS__TRY(springls__chunks_reserve(ctx, c, published->slot_count + added));
    c->list = (int *)c->list_memory.data;
    c->affected = (uint32_t *)c->affected_memory.data;
    published->far_value = g->far_value;
    springls__fill(published->phi, SPRINGLS__OUTSIDE, g->far_value);
    springls__fill(published->phi, SPRINGLS__INSIDE, -g->far_value);
    for (i = n = 0; i < entries; i++) {
        if (!springls__may_differ(g, published, i)) continue;
        c->list[n++] = i;
        if (published->top[i] < SPRINGLS__FIRST_SLOT) springls__add_published_brick(c, i);
    }
    c->listed = n;
    return SPRINGLS_OK;
}

/* Marks as dirty the bricks whose mesh depends on what has changed in entry i of the list. */
SPRINGLS__FN void springls__mark_affected(springls_chunks *c, int i)
{
    int origin[3], at[3], d;
    springls__slot_origin(&c->published, c->published.top[c->list[i]], origin);
    for (d = 0; d < 27 && c->affected[i]; d++)
        if ((c->affected[i] >> d & 1u) && springls__brick_around(&c->published, origin, d, at))
            c->dirty[springls__entry_at(&c->published, at[0], at[1], at[2])] = 1;
}

/* Returns the published slot of a place; -1: it has none. */
SPRINGLS__FN int springls__signature_slot(const springls_context *ctx, const springls_chunks *c, springls__v3 p)
{
    const int slot = springls__slot_of_place(&c->published, p);
    (void)ctx;
    return slot < SPRINGLS__FIRST_SLOT ? -1 : slot;
}

/* Marks as dirty the bricks whose springls have changed since they were meshed. */
SPRINGLS__FN springls_status springls__mark_moved_springls(springls_context *ctx, springls_chunks *c)
{
    springls__brick_signature *now;
    int slot;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_signatures, c->published.slot_count));
    now = springls__brick_signatures(&ctx->model);
    springls__collect_signatures(ctx, c, springls__signature_slot, c->published.slot_count, now);
    for (slot = SPRINGLS__FIRST_SLOT; slot < c->published.slot_count; slot++) {
        if (c->published.slot_brick[slot] < 0) continue;
        if (springls__signatures_agree(&now[slot], &c->signature[slot], c->desc.tolerance)) continue;
        c->signature[slot] = now[slot];
        c->dirty[springls__entry_of_brick(&c->published, c->published.slot_brick[slot])] = 1;
    }
    return SPRINGLS_OK;
}

/* Returns the slots of listed bricks that have become constant in the model. */
SPRINGLS__FN void springls__drop_published_bricks(springls_context *ctx, springls_chunks *c)
{
    int i;
    for (i = 0; i < c->listed; i++) {
        const int entry = c->list[i], slot = c->published.top[entry];
        const int side = springls__slot_published(&ctx->model.grid, &c->published, entry);
        if (side >= SPRINGLS__FIRST_SLOT) continue;
        c->published.top[entry] = side;
        c->published.slot_brick[slot] = -1;
        c->published.free_slots[c->published.free_count++] = slot;
    }
}

/* ---- meshes ---- */

/* Returns the number of the vertex on an edge of cube (x, y, z): the same for all cubes around the edge. */
SPRINGLS__FN int springls__edge_number(int x, int y, int z, int edge)
{
    int corner = springls__mc_edge_corner(edge);
    return 3 * springls__tile_index(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)) + springls__mc_edge_axis(edge);
}

/* Runs marching cubes on a chunk and counts its vertices and triangles. vertex: voxels, in the order in which triangles use
   them; corner: 3 a triangle. Both NULL: only counts. */
SPRINGLS__FN void springls__mesh_chunk(const springls_chunks *c, springls_chunk *chunk, springls__v3 *vertex, uint16_t *corner)
{
    const springls__grid *g = &c->published;
    float tile[SPRINGLS__TILE_VOXELS], signs[SPRINGLS__TILE * SPRINGLS__TILE];
    uint32_t row[4];
    uint16_t number[3 * SPRINGLS__TILE_VOXELS]; /* [edge] 1 + index of its vertex; 0: none yet */
    int slot = g->top[springls__entry_of_chunk(c, chunk)], x, y, z, k;
    springls__cube_range range;
    chunk->vertex_count = chunk->triangle_count = 0;
    if (slot < SPRINGLS__FIRST_SLOT) return;
    memset(number, 0, sizeof number);
    range = springls__brick_cubes(g, slot);
    springls__load_tile(g, g->phi, slot, springls__alone(), tile);
    for (k = 0; k < SPRINGLS__TILE * SPRINGLS__TILE; k++) signs[k] = (float)springls__signs_of_row(tile + SPRINGLS__TILE * k);
    for (z = range.lo[2]; z <= range.hi[2]; z++)
        for (y = range.lo[1]; y <= range.hi[1]; y++) {
            if (!springls__signs_around(signs, y, z, row)) continue;
            for (x = range.lo[0]; x <= range.hi[0]; x++) {
                const int mask = springls__case_between(row, x);
                springls__mc_cell cell;
                if (springls__mc_count(mask) == 0) continue;
                cell = springls__tile_cube(tile, x, y, z);
                for (k = 0; k < 3 * springls__mc_count(mask); k++) {
                    int edge = springls__mc_edge(mask, 0, k);
                    uint16_t *n = &number[springls__edge_number(x, y, z, edge)];
                    if (!*n) {
                        if (vertex) vertex[chunk->vertex_count] = springls__cube_vertex(&range, cell, x, y, z, edge);
                        *n = (uint16_t)++chunk->vertex_count;
                    }
                    if (corner) corner[3 * chunk->triangle_count + k] = (uint16_t)(*n - 1);
                }
                chunk->triangle_count += springls__mc_count(mask);
            }
        }
}

SPRINGLS__FN void springls__count_chunk_work(void *arg, int begin, int end, float *memory)
{
    springls_chunks *c = ((const springls_context *)arg)->step.chunks;
    (void)memory;
    for (; begin < end; begin++) springls__mesh_chunk(c, &c->chunk[begin], NULL, NULL);
}

/* Writes the correspondences and ids of a chunk vertex by vertex. vertex: voxels. */
SPRINGLS__FN void springls__fill_single_material(const springls_context *ctx, springls_chunk *chunk, const springls__v3 *vertex)
{
    int i;
    for (i = 0; i < chunk->vertex_count; i++) {
        const int nearest = springls__nearest_springl(&ctx->model, vertex[i], SPRINGLS__MATERIAL_RADIUS);
        const springls__v3 a = springls__vertex_correspondence_at(&ctx->model, vertex[i], nearest);
        springls__write_chunk_material(ctx, chunk, i, vertex[i], nearest, a);
    }
}

/* Writes the correspondences and ids of a chunk. vertex: voxels. */
SPRINGLS__FN void springls__fill_chunk_material(const springls_context *ctx, springls_chunk *chunk, const springls__v3 *vertex,
                                                springls__candidates *candidates)
{
    springls__box box = springls__box_empty();
    springls__v3 a[SPRINGLS__LANES];
    int i, k, count, springl[SPRINGLS__LANES];
    for (i = 0; i < chunk->vertex_count; i++) box = springls__box_add(box, vertex[i]);
    if (!springls__find_candidates(&ctx->model, box, candidates)) {
        springls__fill_single_material(ctx, chunk, vertex);
        return;
    }
    springls__order_vertices(vertex, chunk->vertex_count, box.lower, candidates->order);
    for (i = 0; i < chunk->vertex_count; i += count) {
        const uint16_t *number = candidates->order + i;
        count = springls__imin(SPRINGLS__LANES, chunk->vertex_count - i);
        springls__group_material(&ctx->model, candidates, vertex, number, count, springl, a);
        for (k = 0; k < count; k++)
            springls__write_chunk_material(ctx, chunk, number[k], vertex[number[k]], springl[k], a[k]);
    }
}

/* A wide tile: a brick with a margin of three voxels. */
#define SPRINGLS__WIDE_MARGIN 3
#define SPRINGLS__WIDE 14
#define SPRINGLS__WIDE_VOXELS 2744

typedef struct springls__wide_tile {
    int origin[3];
    float *value; /* WIDE_VOXELS */
} springls__wide_tile;

/* Returns the wide tile of the brick at `origin`, in `memory`. */
SPRINGLS__FN springls__wide_tile springls__load_wide_tile(const springls__grid *g, const int origin[3], float *memory)
{
    springls__wide_tile tile;
    bool border = false;
    int axis;
    tile.value = memory;
    for (axis = 0; axis < 3; axis++) {
        tile.origin[axis] = origin[axis];
        border = border || origin[axis] == 0 || origin[axis] + 8 + SPRINGLS__WIDE_MARGIN > g->size[axis];
    }
    springls__load_rows(g, g->phi, origin, border, SPRINGLS__WIDE_MARGIN, springls__alone(), memory);
    return tile;
}

/* Interpolates between t[0], t[s], t[r] and t[r + s]: by u over the stride s, by v over the stride r. */
SPRINGLS__FN float springls__square_sample(const float *t, int s, float u, int r, float v)
{
    const float lower = t[0] + (t[s] - t[0]) * u, upper = t[r] + (t[r + s] - t[r]) * u;
    return lower + (upper - lower) * v;
}

/* Returns springls__grid_gradient at vertex x of the tile's brick. x lies on an edge of the voxel grid, so that of the six
   trilinear samples half a voxel from it two are linear and four bilinear. */
SPRINGLS__FN springls__v3 springls__tile_gradient(const springls__wide_tile *tile, springls__v3 x)
{
    static const int stride[3] = { 1, SPRINGLS__WIDE, SPRINGLS__WIDE * SPRINGLS__WIDE };
    const float at[3] = { x.x, x.y, x.z };
    const float *voxel = tile->value;
    float u, side[6];
    int d, axis, edge = 0, first[3];
    for (axis = 0; axis < 3; axis++) {
        const float whole = springls__floor(at[axis]);
        if (whole != at[axis]) edge = axis;
        first[axis] = (int)whole - tile->origin[axis];
        voxel += stride[axis] * (first[axis] + SPRINGLS__WIDE_MARGIN);
    }
    u = at[edge] - (float)(first[edge] + tile->origin[edge]);
    for (d = 0; d < 6; d++) {
        float p, whole;
        const float *t;
        axis = d >> 1;
        p = at[axis] + (d & 1 ? 0.5f : -0.5f) - (float)tile->origin[axis];
        whole = springls__floor(p);
        t = voxel + stride[axis] * ((int)whole - first[axis]);
        if (axis == edge) side[d] = t[0] + (t[stride[edge]] - t[0]) * (p - whole);
        else if (axis < edge) side[d] = springls__square_sample(t, stride[axis], p - whole, stride[edge], u);
        else side[d] = springls__square_sample(t, stride[edge], u, stride[axis], p - whole);
    }
    return springls__v3_make(side[1] - side[0], side[3] - side[2], side[5] - side[4]);
}

/* Writes the normals of a chunk. vertex: voxels; memory: WIDE_VOXELS floats. */
SPRINGLS__FN void springls__fill_normals(const springls_context *ctx, const springls__grid *g, springls_chunk *chunk,
                                         const springls__v3 *vertex, float *memory)
{
    springls__wide_tile tile;
    const int *b = chunk->brick;
    const int origin[3] = { 8 * b[0], 8 * b[1], 8 * b[2] };
    const bool border = springls__tile_at_border(g, origin);
    int i;
    if (!border) tile = springls__load_wide_tile(g, origin, memory);
    for (i = 0; i < chunk->vertex_count; i++) {
        const springls__v3 n = springls__normal_to_world(ctx, border ? springls__grid_gradient(g, g->phi, vertex[i])
                                                                     : springls__tile_gradient(&tile, vertex[i]));
        memcpy(chunk->normals + 3 * i, &n, sizeof n);
    }
}

/* The working memory of a lane, for one chunk at a time: phi around it, and the springls near it. */
typedef struct springls__chunk_memory {
    float phi[SPRINGLS__WIDE_VOXELS];
    springls__candidates candidates; /* only with correspondences */
} springls__chunk_memory;

/* Returns how many floats of a springls__chunk_memory are needed. */
SPRINGLS__FN size_t springls__chunk_floats(const springls_chunks *c)
{
    return c->desc.correspondences ? sizeof(springls__chunk_memory) / sizeof(float) : SPRINGLS__WIDE_VOXELS;
}

/* Fills the arrays of a counted chunk. Its positions are in voxels first, then in world units. */
SPRINGLS__FN void springls__fill_chunk(const springls_context *ctx, const springls_chunks *c, springls_chunk *chunk,
                                       springls__chunk_memory *memory)
{
    springls__v3 *vertex = (springls__v3 *)(void *)chunk->positions;
    int i;
    if (chunk->vertex_count == 0) return;
    springls__mesh_chunk(c, chunk, vertex, chunk->triangles);
    if (c->desc.correspondences) springls__fill_chunk_material(ctx, chunk, vertex, &memory->candidates);
    springls__fill_normals(ctx, &c->published, chunk, vertex, memory->phi);
    for (i = 0; i < chunk->vertex_count; i++) springls__voxel_to_world(ctx, vertex[i], chunk->positions + 3 * i);
    for (i = 0; i < chunk->triangle_count && springls__is_mirrored(ctx); i++) { /* counter-clockwise seen from outside */
        uint16_t corner = chunk->triangles[3 * i + 1];
        chunk->triangles[3 * i + 1] = chunk->triangles[3 * i + 2];
        chunk->triangles[3 * i + 2] = corner;
    }
}

SPRINGLS__FN void springls__fill_chunk_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    for (; begin < end; begin++)
        springls__fill_chunk(ctx, ctx->step.chunks, &ctx->step.chunks->chunk[begin],
                             (springls__chunk_memory *)(void *)memory);
}

/* Writes c->chunk, a chunk without arrays for each dirty brick. */
SPRINGLS__FN springls_status springls__list_chunks(springls_context *ctx, springls_chunks *c)
{
    const springls__grid *g = &c->published;
    int entries = (int)springls__entry_count(g), i, axis, n = 0;
    for (i = 0; i < entries; i++) n += c->dirty[i];
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->chunk_memory, (size_t)(n + c->left_count) + 1, sizeof *c->chunk, 0));
    c->chunk = (springls_chunk *)c->chunk_memory.data;
    memset(c->chunk, 0, (size_t)n * sizeof *c->chunk);
    for (i = n = 0; i < entries; i++) {
        if (!c->dirty[i]) continue;
        springls__entry_origin(g, i, c->chunk[n].brick);
        for (axis = 0; axis < 3; axis++) c->chunk[n].brick[axis] /= SPRINGLS__BRICK;
        n++;
    }
    c->count = n;
    return SPRINGLS_OK;
}

/* Allocates the arrays of all counted chunks and gives each chunk its part. Leaves out chunks that have no triangle and had
   none. */
SPRINGLS__FN springls_status springls__allocate_chunks(springls_context *ctx, springls_chunks *c)
{
    const size_t words = c->desc.correspondences ? 10 : 6; /* floats a vertex; an id takes one */
    size_t vertices = 0, corners = 0;
    int i, n = 0;
    for (i = 0; i < c->count; i++) {
        vertices += (size_t)c->chunk[i].vertex_count;
        corners += 3 * (size_t)c->chunk[i].triangle_count;
        if (c->contours.in_use || c->chunk[i].triangle_count || c->has_mesh[springls__entry_of_chunk(c, &c->chunk[i])])
            c->chunk[n++] = c->chunk[i];
    }
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->vertex_memory, vertices * words + 1, sizeof(float), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->corner_memory, corners + 1, sizeof(uint16_t), 0));
    c->count = n;
    vertices = corners = 0;
    for (i = 0; i < n; i++) {
        springls_chunk *chunk = &c->chunk[i];
        size_t v = (size_t)chunk->vertex_count;
        if (!v) continue;
        chunk->positions = (float *)c->vertex_memory.data + vertices * words;
        chunk->normals = chunk->positions + 3 * v;
        if (c->desc.correspondences) {
            chunk->correspondences = chunk->normals + 3 * v;
            chunk->ids = (uint32_t *)(void *)(chunk->correspondences + 3 * v);
        }
        chunk->triangles = (uint16_t *)c->corner_memory.data + corners;
        vertices += v;
        corners += 3 * (size_t)chunk->triangle_count;
    }
    return SPRINGLS_OK;
}

/* Orders chunks by brick, x fastest. */
SPRINGLS__FN int springls__compare_chunks(const void *first, const void *second)
{
    const springls_chunk *a = (const springls_chunk *)first, *b = (const springls_chunk *)second;
    return springls__compare_places(a->brick, b->brick);
}

/* Changes the bricks of chunks to those of the lattice, and adds empty chunks for those that the window has left behind. */
SPRINGLS__FN void springls__name_chunks(springls_chunks *c)
{
    int i, axis;
    for (i = 0; i < c->count; i++)
        for (axis = 0; axis < 3; axis++) c->chunk[i].brick[axis] += c->window[axis] / SPRINGLS__BRICK;
    if (c->left_count == 0) return;
    for (i = 0; i < c->left_count; i++) {
        springls_chunk *chunk = &c->chunk[c->count++];
        memset(chunk, 0, sizeof *chunk);
        memcpy(chunk->brick, c->left[i].at, sizeof chunk->brick);
    }
    c->left_count = 0;
    qsort(c->chunk, (size_t)c->count, sizeof *c->chunk, springls__compare_chunks);
}

/* ---- an update of chunks of what springls hold ---- */

/* Takes the consumer's chunks of the zero level as bricks of a contour that has gone. */
SPRINGLS__FN springls_status springls__change_to_contours(springls_context *ctx, springls_chunks *c)
{
    springls__contour_store *store = &c->contours.store[c->contours.now];
    const int entries = (int)springls__entry_count(&c->published);
    int i, count = c->left_count;
    if (c->contours.in_use) return SPRINGLS_OK;
    for (i = 0; i < entries; i++) count += c->has_mesh[i];
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->brick_memory, (size_t)count + 1, sizeof *store->brick, 0));
    store->brick = (springls__contour_brick *)store->brick_memory.data;
    memset(store->brick, 0, (size_t)count * sizeof *store->brick);
    for (store->bricks = 0; store->bricks < c->left_count; store->bricks++) store->brick[store->bricks].chunk = c->left[store->bricks];
    for (i = 0; i < entries; i++)
        if (c->has_mesh[i]) store->brick[store->bricks++].chunk = springls__lattice_place(c, i);
    for (i = 0; i < store->bricks; i++) store->brick[i].triangles = 1;
    qsort(store->brick, (size_t)store->bricks, sizeof *store->brick, springls__compare_contour_bricks);
    store->stale = true;
    memset(c->has_mesh, 0, (size_t)entries);
    c->left_count = 0;
    c->contours.in_use = true;
    return SPRINGLS_OK;
}

/* Takes the consumer's chunks of what springls hold as bricks with a mesh that the window has left behind. */
SPRINGLS__FN springls_status springls__change_to_level_set(springls_context *ctx, springls_chunks *c)
{
    springls__contour_store *store = &c->contours.store[c->contours.now];
    int i;
    if (!c->contours.in_use) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->left_memory, (size_t)store->bricks + 1, sizeof *c->left, 0));
    c->left = (springls__lattice_brick *)c->left_memory.data;
    for (i = c->left_count = 0; i < store->bricks; i++)
        if (store->brick[i].triangles > 0 && (c->left_count == 0
            || springls__compare_places(c->left[c->left_count - 1].at, store->brick[i].chunk.at) != 0))
            c->left[c->left_count++] = store->brick[i].chunk;
    store->bricks = 0;
    c->publishing = true; /* all are meshed again */
    c->contours.in_use = false;
    return SPRINGLS_OK;
}

/* Returns the brick of the new contour that a place is in; -1: there is none. */
SPRINGLS__FN int springls__signature_brick(const springls_context *ctx, const springls_chunks *c, springls__v3 p)
{
    int at[3], axis;
    springls__voxel_of_place(&ctx->model.grid, p, at);
    for (axis = 0; axis < 3; axis++) at[axis] = (at[axis] >> 3) + ctx->window.offset[axis] / SPRINGLS__BRICK;
    return springls__find_contour_brick(ctx, &c->contours.store[1 - c->contours.now], at);
}

/* Marks as dirty the bricks whose springls have changed since they were meshed. */
SPRINGLS__FN springls_status springls__mark_moved_contours(springls_context *ctx, springls_chunks *c)
{
    springls__contour_store *store = &c->contours.store[1 - c->contours.now];
    const springls__contour_update update = springls__contour_update_of(&c->contours);
    springls__brick_signature *now;
    int i;
    if (!c->desc.correspondences) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_signatures, store->bricks));
    now = springls__brick_signatures(&ctx->model);
    springls__collect_signatures(ctx, c, springls__signature_brick, store->bricks, now);
    for (i = 0; i < store->bricks; i++) {
        const springls__contour_brick *before = springls__brick_before(ctx, &update, &store->brick[i]);
        const bool agree = before && springls__signatures_agree(&now[i], &before->signature, c->desc.tolerance);
        store->brick[i].signature = agree ? before->signature : now[i];
        if (!agree) store->brick[i].dirty = true;
    }
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__number_chunk_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    springls_chunks *c = ctx->step.chunks;
    (void)memory;
    for (; begin < end; begin++)
        springls__number_chunk(&c->contours, c->contours.first_brick[begin], c->contours.brick_count[begin], &c->chunk[begin]);
}

SPRINGLS__FN void springls__fill_contour_chunk_work(void *arg, int begin, int end, float *memory)
{
    const springls_context *ctx = (const springls_context *)arg;
    springls_chunks *c = ctx->step.chunks;
    for (; begin < end; begin++)
        if (c->chunk[begin].triangle_count > 0)
            springls__fill_contour_chunk(ctx, &c->contours, c->contours.first_brick[begin], &c->chunk[begin],
                                         (springls__candidates *)(void *)memory);
}

/* Fails if a chunk has more vertices than 16 bits can number. */
SPRINGLS__FN springls_status springls__numbers_fit(springls_context *ctx, const springls_chunks *c)
{
    int i;
    for (i = 0; i < c->count; i++)
        if (c->chunk[i].vertex_count > (int)UINT16_MAX)
            return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "chunks: a chunk has %d vertices", c->chunk[i].vertex_count);
    return SPRINGLS_OK;
}

/* ---- an update of what springls hold: writes c->chunk. The published contour stays until the consumer has received the list ---- */

SPRINGLS__FN springls__contour_store *springls__new_contour(const springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    return &contours->store[1 - contours->now];
}

SPRINGLS__FN void springls__loop_over_contour(springls_context *ctx, springls__loop_work work)
{
    springls__loop_over(ctx, springls__new_contour(ctx)->bricks, 16, 0, work, &ctx->step.chunks->contours);
}

SPRINGLS__FN springls_status springls__read_springls(springls_context *ctx)
{
    ctx->work.on_device = false;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    return springls__read_cell_list(ctx);
}

/* Begins a new contour, and finds what has changed since the last one, unless a table of all bricks is needed, or there is one. */
SPRINGLS__FN springls_status springls__find_moved_springls(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    springls__contour_chunks *contours = &c->contours;
    springls__contour_store *before = &contours->store[contours->now];
    SPRINGLS__TRY(springls__change_to_contours(ctx, c));
    if (memcmp(before->window, ctx->window.offset, sizeof ctx->window.offset) != 0) before->stale = true;
    contours->ctx = ctx;
    contours->tolerance = c->desc.tolerance;
    contours->with_ids = c->desc.correspondences;
    contours->open = true;
    contours->whole = before->stale || before->bricks == 0 || c->desc.tolerance == 0.0f
                   || ctx->particles_outside > 0 || ctx->model.cells.unbinned_count > 0;
    if (contours->whole) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__reserve_moved(ctx, contours));
    memset(contours->is_left, 0, (size_t)before->springls);
    springls__loop_over(ctx, ctx->model.set.count, 256, 0, springls__find_moved_work, contours);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__find_moved_phi(springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    const springls__contour_store *before = &contours->store[contours->now];
    if (!contours->whole) springls__loop_over(ctx, before->bricks, 16, 0, springls__find_moved_phi_work, contours);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__find_region(springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    return contours->whole ? SPRINGLS_OK : springls__collect_region(ctx, contours);
}

SPRINGLS__FN bool springls__contour_is_open(const springls_context *ctx) { return ctx->step.chunks->contours.open; }

SPRINGLS__FN bool springls__wants_whole_table(const springls_context *ctx)
{
    return ctx->step.chunks->contours.whole && springls__surface_is_stale(ctx);
}

SPRINGLS__FN bool springls__wants_region_table(const springls_context *ctx)
{
    return !ctx->step.chunks->contours.whole && springls__surface_is_stale(ctx) && ctx->surface_region > 0;
}

SPRINGLS__FN springls_status springls__count_contour(springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    SPRINGLS__TRY(springls__reserve_contour_update(ctx, contours));
    springls__loop_over(ctx, ctx->surface_bricks, 16, 0, springls__count_contour_work, contours);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_contour(springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    SPRINGLS__TRY(springls__list_contour_bricks(ctx, contours));
    springls__loop_over(ctx, ctx->surface_bricks, 16, 0, springls__fill_contour_work, contours);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_corners(springls_context *ctx)
{
    springls__loop_over_contour(ctx, springls__fill_corners_work);
    return SPRINGLS_OK;
}

/* Ends the new contour, or widens its region. */
SPRINGLS__FN springls_status springls__close_contour(springls_context *ctx)
{
    springls__contour_chunks *contours = &ctx->step.chunks->contours;
    contours->open = !contours->whole && !springls__region_fits(contours);
    if (contours->open) return springls__widen_region(ctx, contours);
    SPRINGLS__TRY(springls__reserve_seen(ctx, contours));
    springls__loop_over(ctx, ctx->model.set.count, 256, 0, springls__see_springls_work, contours);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__see_phi(springls_context *ctx)
{
    springls__list_seen(&ctx->step.chunks->contours);
    springls__loop_over_contour(ctx, springls__see_phi_work);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__publish_contour(springls_context *ctx)
{
    SPRINGLS__TRY(springls__mark_moved_contours(ctx, ctx->step.chunks));
    springls__loop_over_contour(ctx, springls__publish_contour_work);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__compare_contour(springls_context *ctx)
{
    springls__mark_beside_changed(&ctx->step.chunks->contours);
    springls__loop_over_contour(ctx, springls__compare_contour_work);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__number_contour_chunks(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    SPRINGLS__TRY(springls__reserve_contour_chunks(ctx, &c->contours, &c->chunk_memory));
    c->chunk = (springls_chunk *)c->chunk_memory.data;
    c->count = springls__list_contour_chunks(&c->contours, c->chunk);
    springls__loop_over(ctx, c->count, 4, 0, springls__number_chunk_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_contour_chunks(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    const size_t floats = c->desc.correspondences ? sizeof(springls__candidates) / sizeof(float) : 0;
    SPRINGLS__TRY(springls__numbers_fit(ctx, c));
    SPRINGLS__TRY(springls__allocate_chunks(ctx, c));
    if (floats > 0) SPRINGLS__TRY(springls__reserve_lanes(ctx, floats, c->count, 1));
    springls__loop_over(ctx, c->count, 1, floats, springls__fill_contour_chunk_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__contour_chunks_filled(springls_context *ctx)
{
    ctx->step.chunks->state = SPRINGLS__CHUNKS_READY;
    return SPRINGLS_OK;
}

static const springls__entry springls__update_contours[] = {
    SPRINGLS__DO(springls__read_springls)
    SPRINGLS__DO(springls__find_moved_springls)
    SPRINGLS__DO(springls__find_moved_phi)
    SPRINGLS__DO(springls__find_region)
    SPRINGLS__REPEAT_WHILE(springls__contour_is_open)
        SPRINGLS__IF(springls__wants_whole_table)
            SPRINGLS__CALL(springls__surface_table)
        SPRINGLS__END
        SPRINGLS__IF(springls__wants_region_table)
            SPRINGLS__CALL(springls__surface_kernels)
        SPRINGLS__END
        SPRINGLS__DO(springls__count_contour)
        SPRINGLS__DO(springls__fill_contour)
        SPRINGLS__DO(springls__fill_corners)
        SPRINGLS__DO(springls__close_contour)
    SPRINGLS__END
    SPRINGLS__DO(springls__see_phi)
    SPRINGLS__DO(springls__publish_contour)
    SPRINGLS__DO(springls__compare_contour)
    SPRINGLS__DO(springls__number_contour_chunks)
    SPRINGLS__DO(springls__fill_contour_chunks)
    SPRINGLS__DO(springls__contour_chunks_filled)
SPRINGLS__END };

/* ---- an update: what is in progress (ctx->step) instead of a step ---- */

/* Marks as dirty all bricks with values. */
SPRINGLS__FN void springls__mark_all(springls_chunks *c)
{
    size_t entries = springls__entry_count(&c->published), i;
    for (i = 0; i < entries; i++) c->dirty[i] |= c->has_mesh[i] || c->published.top[i] >= SPRINGLS__FIRST_SLOT;
}

/* Publishes what has changed. dirty stays set on failure, so that the next update lists these chunks. */
SPRINGLS__FN springls_status springls__publish_changes(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    ctx->work.on_device = false;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__change_to_level_set(ctx, c));
    SPRINGLS__TRY(springls__chunks_follow(ctx, c));
    if (c->desc.correspondences) SPRINGLS__TRY(springls__read_cell_list(ctx));
    if (c->publishing) springls__mark_all(c); /* an update was dropped halfway */
    SPRINGLS__TRY(springls__list_bricks(ctx, c));
    c->publishing = true;
    springls__loop_over(ctx, c->listed, 16, 0, springls__publish_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__count_in_chunks(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    int i;
    for (i = 0; i < c->listed; i++) springls__mark_affected(c, i);
    c->publishing = false;
    if (c->desc.correspondences) SPRINGLS__TRY(springls__mark_moved_springls(ctx, c));
    springls__drop_published_bricks(ctx, c);
    SPRINGLS__TRY(springls__list_chunks(ctx, c));
    springls__loop_over(ctx, c->count, 4, 0, springls__count_chunk_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__fill_chunks(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    SPRINGLS__TRY(springls__allocate_chunks(ctx, c));
    SPRINGLS__TRY(springls__reserve_lanes(ctx, springls__chunk_floats(c), c->count, 1));
    springls__loop_over(ctx, c->count, 1, springls__chunk_floats(c), springls__fill_chunk_work, ctx);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__chunks_filled(springls_context *ctx)
{
    springls_chunks *c = ctx->step.chunks;
    int i;
    memset(c->dirty, 0, springls__entry_count(&c->published));
    for (i = 0; i < c->count; i++)
        c->has_mesh[springls__entry_of_chunk(c, &c->chunk[i])] = c->chunk[i].triangle_count > 0;
    c->state = SPRINGLS__CHUNKS_READY;
    return SPRINGLS_OK;
}

/* Returns whether the chunks being updated are of the zero level. */
SPRINGLS__FN bool springls__updates_zero_level(const springls_context *ctx)
{
    return ctx->step.chunks->desc.zero_level || !springls__contours_springls(ctx);
}

SPRINGLS__FN bool springls__updates_contours(const springls_context *ctx) { return !springls__updates_zero_level(ctx); }

static const springls__entry springls__update_level_set_chunks[] = {
    SPRINGLS__DO(springls__publish_changes)
    SPRINGLS__DO(springls__count_in_chunks)
    SPRINGLS__DO(springls__fill_chunks)
    SPRINGLS__DO(springls__chunks_filled)
SPRINGLS__END };

/* What an update does: phi follows for a reader (springls__read_level_set), then the chunks. */
static const springls__entry springls__chunks_update[] = {
    SPRINGLS__IF(springls__phi_lags)
        SPRINGLS__DO(springls__save_level_set)
        SPRINGLS__CALL(springls__wake_moved)
        SPRINGLS__STAGE(PROJECT, springls__carry_level_set)
    SPRINGLS__END
    SPRINGLS__IF(springls__updates_contours)
        SPRINGLS__CALL(springls__update_contours)
    SPRINGLS__END
    SPRINGLS__IF(springls__updates_zero_level)
        SPRINGLS__CALL(springls__update_level_set_chunks)
    SPRINGLS__END
SPRINGLS__END };

/* Leaves what the consumer has not received to the next update, which lists it again. */
SPRINGLS__FN void springls__list_again(springls_chunks *c)
{
    int i;
    for (i = 0; i < c->count; i++) {
        const int entry = springls__entry_of_chunk(c, &c->chunk[i]);
        c->dirty[entry] = c->has_mesh[entry] = 1; /* so that a chunk that has vanished is listed too */
    }
}

/* Begins an update. No step is in progress. */
SPRINGLS__FN void springls__chunks_start(springls_context *ctx, springls_chunks *chunks)
{
    if (chunks->state == SPRINGLS__CHUNKS_READY && !chunks->contours.in_use) springls__list_again(chunks);
    memset(&ctx->step, 0, sizeof ctx->step);
    springls__begin_step(ctx, springls__chunks_update);
    ctx->step.chunks = chunks;
    chunks->state = SPRINGLS__CHUNKS_IN_PROGRESS;
}

/* ---- the calls ---- */

SPRINGLS__CHUNKS_API springls_status springls_chunks_create(springls_context *ctx, const springls_chunks_desc *desc,
                                                            springls_chunks **out)
{
    springls_chunks *c;
    springls_status status;
    if (out) *out = NULL;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail_null(ctx, "chunks_create", "out");
    if (desc && (!springls__finite_float(desc->tolerance) || desc->tolerance > 0.5f))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_create: the tolerance %g is not at most half a voxel",
                              (double)desc->tolerance);
    c = (springls_chunks *)springls__allocate(ctx, sizeof *c);
    if (!c) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "chunks_create: out of memory");
    memset(c, 0, sizeof *c);
    if (desc) c->desc = *desc;
    c->desc.tolerance = c->desc.tolerance == 0.0f ? 0.05f : springls__max(c->desc.tolerance, 0.0f);
    status = springls__chunks_make(ctx, c);
    if (status == SPRINGLS_OK) *out = c;
    else springls__chunks_free(ctx, c);
    return status;
}

SPRINGLS__CHUNKS_API void springls_chunks_destroy(springls_context *ctx, springls_chunks *chunks)
{
    if (!ctx || !chunks) return;
    if (ctx->step.active && ctx->step.chunks == chunks) {
        springls__abandon_step(ctx);
        springls__end_reading(ctx);
    }
    springls__chunks_free(ctx, chunks);
}

SPRINGLS__CHUNKS_API springls_status springls_chunks_begin(springls_context *ctx, springls_chunks *chunks)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!chunks) return springls__fail_null(ctx, "chunks_begin", "chunks");
    SPRINGLS__TRY(springls__finish_step(ctx));
    springls__chunks_start(ctx, chunks);
    return SPRINGLS_OK;
}

/* Continues an update until the clock shows *until; NULL: to its end. */
SPRINGLS__FN springls_status springls__chunks_continue(springls_context *ctx, springls_chunks *chunks, const double *until,
                                                       const springls_chunk **changed, int *count)
{
    springls_status status = SPRINGLS_OK;
    if (chunks->state == SPRINGLS__CHUNKS_IN_PROGRESS) {
        if (!ctx->step.active || ctx->step.chunks != chunks) SPRINGLS__TRY(springls_chunks_begin(ctx, chunks));
        status = springls__resume_step(ctx, until);
    }
    if (status != SPRINGLS_OK) chunks->state = SPRINGLS__CHUNKS_IDLE;
    if (chunks->state != SPRINGLS__CHUNKS_READY) return status;
    if (chunks->contours.in_use) chunks->contours.now = 1 - chunks->contours.now; /* the consumer has it now */
    else springls__name_chunks(chunks);
    *changed = chunks->chunk;
    *count = chunks->count;
    chunks->state = SPRINGLS__CHUNKS_IDLE;
    return SPRINGLS_OK;
}

SPRINGLS__CHUNKS_API springls_status springls_chunks_continue(springls_context *ctx, springls_chunks *chunks, double seconds,
                                                              const springls_chunk **changed, int *count, bool *done)
{
    springls_status status;
    double until;
    if (changed) *changed = NULL;
    if (count) *count = 0;
    if (done) *done = !chunks || chunks->state == SPRINGLS__CHUNKS_IDLE;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!chunks || !changed || !count || !done)
        return springls__fail_null(ctx, "chunks_continue",
                                   !chunks ? "chunks" : !changed ? "changed" : !count ? "count" : "done");
    if (springls__is_nan(seconds)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_continue: the seconds are NaN");
    if (chunks->state == SPRINGLS__CHUNKS_IDLE)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_continue: no update has begun");
    until = springls__now(ctx) + (seconds > 0.0 ? seconds : 0.0);
    status = springls__chunks_continue(ctx, chunks, &until, changed, count);
    *done = chunks->state == SPRINGLS__CHUNKS_IDLE;
    return status;
}

SPRINGLS__CHUNKS_API springls_status springls_chunks_update(springls_context *ctx, springls_chunks *chunks,
                                                            const springls_chunk **changed, int *count)
{
    if (changed) *changed = NULL;
    if (count) *count = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!chunks || !changed || !count)
        return springls__fail_null(ctx, "chunks_update", !chunks ? "chunks" : !changed ? "changed" : "count");
    SPRINGLS__TRY(springls_chunks_begin(ctx, chunks));
    return springls__chunks_continue(ctx, chunks, NULL, changed, count);
}

#endif
