/* contour_chunks.h - chunks of the mesh of what springls hold (params.contouring). A consumer has a published contour: bricks of vertices,
   each with the key of the edge, face or cell of the grid that it lies on, and of triangles between keys. A published vertex stays
   where it is until it has moved by more than the tolerance; a chunk has changed where its triangles have, or a vertex of them.

     the table  -->  bricks of the new contour, by place  -->  vertices: published or new  -->  chunks that differ

   All chunks are made from the published contour, so two neighbors share the bits of their common vertices, whenever either was made.
   Most updates make a table of the region alone where something has changed (contour_region.h), and keep the other bricks. */
#ifndef SPRINGLS__OUTPUT_CONTOUR_CHUNKS_H
#define SPRINGLS__OUTPUT_CONTOUR_CHUNKS_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/memory.h"
#include "../runtime/resumable.h"
#include "../model/transform.h"
#include "../stages/surface_table.h"
#include "chunk_signature.h"
#include "vertex_material.h"

/* A vertex of a published contour, voxels. key: springls__contour_key; springl: of the model when it was made; id: the springl's, for a
   consumer with correspondences, else 0; changed: 1 where x, n or id is not as published before. */
typedef struct springls__contour_vertex {
    springls__v3 x, n;
    uint32_t key, id;
    int springl, changed;
} springls__contour_vertex;

/* A brick of a published contour. at: its place on the lattice; chunk: that of the chunk with its triangles, another one at the border of
   the grid; table: its number in the table; the complement of its number in the published contour where it is kept; changed: whether a
   vertex of it is; beside_changed: whether one of the bricks around is, or it itself. evidence: phi of its voxels
   (springls__evidence_of); constant: SPRINGLS__INSIDE or SPRINGLS__OUTSIDE if the grid had that for all of them,
   or -1. */
typedef struct springls__contour_brick {
    springls__lattice_brick at, chunk;
    springls__brick_signature signature;
    int first_vertex, vertices, first_triangle, triangles, table, constant;
    int8_t evidence[SPRINGLS__BRICK_VOXELS];
    bool dirty, changed, beside_changed;
} springls__contour_brick;

/* A springl that a published contour was made from. */
typedef struct springls__seen_springl {
    springls__v3 p, n;
    uint32_t id, flags; /* springls__see_springl */
} springls__seen_springl;

/* A published contour. stale: its vertices cannot be compared with those of another; whatever has triangles changes. */
typedef struct springls__contour_store {
    springls__contour_brick *brick; /* by their chunks, then by their places */
    springls__contour_vertex *vertex;
    uint32_t *corner; /* 3 a triangle: springls__contour_corner */
    springls__seen_springl *seen; /* [springls] */
    int *seen_table;   /* [seen_size] numbers of springls by their ids: springls__find_seen */
    size_t seen_size;
    int bricks, vertices, triangles, springls, window[3];
    bool stale;
    springls__buffer brick_memory, vertex_memory, corner_memory, seen_memory, seen_table_memory;
} springls__contour_store;

/* What the chunks of one consumer have of contours. The published one is store[now]; the other one is made by an update. */
typedef struct springls__contour_chunks {
    const springls_context *ctx;
    springls__contour_store store[2];
    int now;
    float tolerance;       /* voxels                                                                       */
    bool with_ids;         /* the consumer wants correspondences and ids                                   */
    bool in_use;           /* the consumer's chunks are contours                                           */
    int *first_brick;      /* [chunk] of the new contour; brick_count of them belong to it                 */
    int *brick_count;
    int *of_table;         /* [brick of the table] its vertices, then its brick of the new contour or -1   */
    uint64_t *vertex_key;  /* [vertex of the mesh] its brick in the table << 32 | its key                  */
    uint64_t *order;       /* [corner of the new contour] to sort by vertices                              */
    int *used, *number;    /* a chunk's vertices, in the new contour, and its corners, by their order there */
    uint64_t *region;      /* keys of the places in the window of the region's bricks, ascending: springls__place_key */
    float *reach;          /* [springl] voxels: where it may change the published mesh, 0: it is as published */
    int *seen_as;          /* [springl] its number among the published ones, -1: none                      */
    uint8_t *is_left;      /* [published springl] 1: there still is one with its id                        */
    uint8_t *moved_phi;    /* [published brick] a bit for each eighth where phi is not as published        */
    int region_bricks, region_in_table; /* of those the table of all bricks would have                     */
    int last_box[6];       /* of bricks, the last one added to the region                                  */
    int region_lower[3], region_upper[3]; /* places in the window around the region                        */
    bool whole, open;      /* the table is of all bricks; the new contour is still to be made, or made again */
    springls__buffer first_brick_memory, of_table_memory, vertex_key_memory, order_memory, used_memory, region_memory;
    springls__buffer reach_memory, seen_as_memory, is_left_memory, moved_phi_memory;
} springls__contour_chunks;

SPRINGLS__FN void springls__contour_store_free(springls_context *ctx, springls__contour_store *store)
{
    springls__buffer_free(ctx, &store->brick_memory);
    springls__buffer_free(ctx, &store->vertex_memory);
    springls__buffer_free(ctx, &store->corner_memory);
    springls__buffer_free(ctx, &store->seen_memory);
    springls__buffer_free(ctx, &store->seen_table_memory);
}

SPRINGLS__FN void springls__contour_chunks_free(springls_context *ctx, springls__contour_chunks *c)
{
    springls__contour_store_free(ctx, &c->store[0]);
    springls__contour_store_free(ctx, &c->store[1]);
    springls__buffer_free(ctx, &c->first_brick_memory);
    springls__buffer_free(ctx, &c->of_table_memory);
    springls__buffer_free(ctx, &c->vertex_key_memory);
    springls__buffer_free(ctx, &c->order_memory);
    springls__buffer_free(ctx, &c->used_memory);
    springls__buffer_free(ctx, &c->region_memory);
    springls__buffer_free(ctx, &c->reach_memory);
    springls__buffer_free(ctx, &c->seen_as_memory);
    springls__buffer_free(ctx, &c->is_left_memory);
    springls__buffer_free(ctx, &c->moved_phi_memory);
}

/* ---- keys ---- */

enum { SPRINGLS__KEY_OF_EDGE, SPRINGLS__KEY_OF_FACE, SPRINGLS__KEY_OF_CELL };

/* Returns the key of a vertex in its brick: the edge, face or cell on which the vertex lies, and its ordinal there. Vertices in cells
   belong to one chunk, and are counted in the whole brick. Keys ascend as the table's numbers of vertices do. */
SPRINGLS__FN uint32_t springls__contour_key(int kind, int element, int ordinal)
{
    return (uint32_t)kind << 25 | (uint32_t)element << 6 | (uint32_t)ordinal;
}

/* Returns what vertices have in common that are published together: an edge, a face, or the cells of a brick. */
SPRINGLS__FN uint32_t springls__group_of_key(uint32_t key)
{
    return key >> 25 == (uint32_t)SPRINGLS__KEY_OF_CELL ? key >> 25 << 25 : key >> 6 << 6;
}

/* Returns a triangle's corner: the key of a vertex, and the direction (0 to 26) of its brick from the triangle's. */
SPRINGLS__FN uint32_t springls__contour_corner(int direction, uint32_t key) { return (uint32_t)direction << 27 | key; }

/* ---- the order of bricks ---- */

/* Compares places, x fastest. */
SPRINGLS__FN int springls__compare_places(const int a[3], const int b[3])
{
    int axis;
    for (axis = 2; axis > 0 && a[axis] == b[axis]; axis--) continue;
    return (a[axis] > b[axis]) - (a[axis] < b[axis]);
}

SPRINGLS__FN int springls__compare_contour_bricks(const void *first, const void *second)
{
    const springls__contour_brick *a = (const springls__contour_brick *)first, *b = (const springls__contour_brick *)second;
    const int chunks = springls__compare_places(a->chunk.at, b->chunk.at);
    return chunks ? chunks : springls__compare_places(a->at.at, b->at.at);
}

/* Returns the place of the chunk that has the triangles of the brick at a place of the lattice: what begins beyond the border of the grid
   is in the chunk at the border. */
SPRINGLS__FN springls__lattice_brick springls__chunk_of_place(const springls_context *ctx, const int at[3])
{
    springls__lattice_brick chunk;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        const int window = ctx->window.offset[axis] / SPRINGLS__BRICK;
        chunk.at[axis] = springls__iclamp(at[axis] - window, 0, ctx->model.grid.bricks[axis] - 1) + window;
    }
    return chunk;
}

/* Returns the brick of a contour at a place of the lattice; -1: there is none. */
SPRINGLS__FN int springls__find_contour_brick(const springls_context *ctx, const springls__contour_store *store, const int at[3])
{
    springls__contour_brick wanted;
    int first = 0, end = store->bricks;
    memcpy(wanted.at.at, at, sizeof wanted.at.at);
    wanted.chunk = springls__chunk_of_place(ctx, at);
    while (first < end) {
        const int middle = first + (end - first) / 2, order = springls__compare_contour_bricks(&store->brick[middle], &wanted);
        if (order == 0) return middle;
        if (order < 0) first = middle + 1;
        else end = middle;
    }
    return -1;
}

/* The bricks around a brick of a contour: found when they are asked for. */
typedef struct springls__contour_around {
    const springls_context *ctx;
    const springls__contour_store *store;
    int center[3], brick[27]; /* SPRINGLS__NOT_FOUND_YET, or as springls__find_contour_brick has found it */
} springls__contour_around;

#define SPRINGLS__NOT_FOUND_YET (-2)

SPRINGLS__FN springls__contour_around springls__around_contour_brick(const springls_context *ctx, const springls__contour_store *store,
                                                                     int brick)
{
    springls__contour_around around;
    int d;
    around.ctx = ctx;
    around.store = store;
    memcpy(around.center, store->brick[brick].at.at, sizeof around.center);
    for (d = 0; d < 27; d++) around.brick[d] = SPRINGLS__NOT_FOUND_YET;
    around.brick[13] = brick;
    return around;
}

SPRINGLS__FN int springls__contour_brick_around(springls__contour_around *around, int d)
{
    int at[3];
    if (around->brick[d] != SPRINGLS__NOT_FOUND_YET) return around->brick[d];
    springls__place_around(around->center, d, at);
    return around->brick[d] = springls__find_contour_brick(around->ctx, around->store, at);
}

/* Returns the vertex of a triangle's corner. around: the triangle's brick. */
SPRINGLS__FN int springls__vertex_of_corner(springls__contour_around *around, uint32_t corner)
{
    const springls__contour_store *store = around->store;
    const springls__contour_brick *brick = store->brick + springls__contour_brick_around(around, (int)(corner >> 27));
    const uint32_t key = corner & ((1u << 27) - 1u);
    int first = brick->first_vertex, end = first + brick->vertices;
    while (end - first > 1) {
        const int middle = first + (end - first) / 2;
        if (store->vertex[middle].key <= key) first = middle;
        else end = middle;
    }
    return first;
}

/* ---- the region ---- */

/* Returns whether the region has the brick whose key that is. */
SPRINGLS__FN bool springls__region_has(const springls__contour_chunks *c, uint64_t key)
{
    int first = 0, end = c->region_bricks;
    while (first < end) {
        const int middle = first + (end - first) / 2;
        if (c->region[middle] < key) first = middle + 1;
        else end = middle;
    }
    return first < c->region_bricks && c->region[first] == key;
}

/* Returns whether a brick of a contour is in the region. window: of the contour, voxels. */
SPRINGLS__FN bool springls__is_in_region(const springls__contour_chunks *c, const int window[3], const springls__contour_brick *brick)
{
    int place[3], axis;
    for (axis = 0; axis < 3; axis++) place[axis] = brick->at.at[axis] - window[axis] / SPRINGLS__BRICK;
    return springls__region_has(c, springls__place_key(place));
}

/* ---- from the table to a contour ---- */

/* The table of the mesh that is kept, as springls__surface_table has left it. */
typedef struct springls__kept_table {
    const springls__surface_brick *brick;
    const int *rank, *corners;
    int first_corner, first_inner;
    springls__raw_mesh mesh;
} springls__kept_table;

SPRINGLS__FN springls__kept_table springls__kept_table_of(const springls_context *ctx)
{
    springls__kept_table table;
    memset(&table, 0, sizeof table);
    table.brick = (const springls__surface_brick *)ctx->surface_memory[SPRINGLS__SURFACE_BRICK_LIST].data;
    table.rank = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    table.corners = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_TRIANGLE].data;
    if (ctx->surface_bricks == 0) return table;
    table.first_corner = table.brick[ctx->surface_bricks - 1].begin[SPRINGLS__OF_CROSSINGS][SPRINGLS__TABLE_ROWS];
    table.first_inner = table.first_corner + 2 * table.brick[ctx->surface_bricks - 1].begin[SPRINGLS__OF_ARCS][SPRINGLS__TABLE_ROWS];
    springls__use_surface_mesh(ctx, &table.mesh);
    return table;
}

/* Where the vertices of a brick of the table go. vertex, vertex_key: NULL: not written. */
typedef struct springls__vertex_writer {
    const springls__kept_table *table;
    springls__contour_vertex *vertex;
    uint64_t *vertex_key;
    int brick, count;
} springls__vertex_writer;

/* Writes a vertex that triangles use. */
SPRINGLS__FN void springls__write_contour_vertex(springls__vertex_writer *writer, int number, uint32_t key)
{
    const int i = writer->table->rank[number] - 1;
    springls__contour_vertex *v;
    if (i < 0) return;
    if (writer->vertex) {
        v = writer->vertex + writer->count;
        v->x = writer->table->mesh.positions[i];
        v->n = writer->table->mesh.normals[i];
        v->springl = writer->table->mesh.springls[i];
        v->key = key;
        v->changed = 1;
    }
    if (writer->vertex_key) writer->vertex_key[i] = (uint64_t)writer->brick << 32 | key;
    writer->count++;
}

/* Writes the vertices on edges and faces of a row of a brick of the table. */
SPRINGLS__FN void springls__write_row(springls__vertex_writer *writer, const springls__surface_brick *brick, int of, int row)
{
    const uint8_t *count = of == SPRINGLS__OF_CROSSINGS ? brick->crossings : brick->arcs;
    int number = brick->begin[of][row], k, i;
    if (number == brick->begin[of][row + 1]) return;
    for (k = 8 * row; k < 8 * row + 8; k++)
        for (i = 0; i < count[k]; i++, number++) {
            if (of == SPRINGLS__OF_CROSSINGS) {
                springls__write_contour_vertex(writer, number, springls__contour_key(SPRINGLS__KEY_OF_EDGE, k, i));
                continue;
            }
            springls__write_contour_vertex(writer, writer->table->first_corner + 2 * number,
                                           springls__contour_key(SPRINGLS__KEY_OF_FACE, k, 2 * i));
            springls__write_contour_vertex(writer, writer->table->first_corner + 2 * number + 1,
                                           springls__contour_key(SPRINGLS__KEY_OF_FACE, k, 2 * i + 1));
        }
}

/* Writes the vertices that a brick of the table owns. Returns how many. */
SPRINGLS__FN int springls__write_contour_vertices(const springls__kept_table *table, int brick, springls__contour_vertex *vertex,
                                                  uint64_t *vertex_key)
{
    const springls__surface_brick *from = table->brick + brick;
    springls__vertex_writer writer;
    int row, k;
    writer.table = table;
    writer.vertex = vertex;
    writer.vertex_key = vertex_key;
    writer.brick = brick;
    writer.count = 0;
    for (k = SPRINGLS__OF_CROSSINGS; k <= SPRINGLS__OF_ARCS; k++)
        for (row = 0; row < SPRINGLS__TABLE_ROWS && from->begin[k][0] != from->begin[k][SPRINGLS__TABLE_ROWS]; row++)
            springls__write_row(&writer, from, k, row);
    for (k = 0; k < from->inner; k++)
        springls__write_contour_vertex(&writer, table->first_inner + from->first_inner + k,
                                       springls__contour_key(SPRINGLS__KEY_OF_CELL, 0, k));
    return writer.count;
}

/* What the loops over bricks take. */
typedef struct springls__contour_update {
    springls__kept_table table;
    const springls__contour_store *before;
    springls__contour_store *after;
    float tolerance;
} springls__contour_update;

SPRINGLS__FN springls__contour_update springls__contour_update_of(springls__contour_chunks *c)
{
    springls__contour_update update;
    update.table = springls__kept_table_of(c->ctx);
    update.before = &c->store[c->now];
    update.after = &c->store[1 - c->now];
    update.tolerance = c->tolerance;
    return update;
}

/* Counts the vertices of bricks of the table: [brick of the table] of_table. */
SPRINGLS__FN void springls__count_contour_work(void *arg, int begin, int end, float *memory)
{
    springls__contour_chunks *c = (springls__contour_chunks *)arg;
    const springls__contour_update update = springls__contour_update_of(c);
    (void)memory;
    for (; begin < end; begin++)
        c->of_table[begin] = springls__write_contour_vertices(&update.table, begin, NULL, NULL);
}

/* Writes the ids that a brick's vertices show: a springl of another brick may be split, merged or tracked. */
SPRINGLS__FN void springls__write_contour_ids(const springls__contour_chunks *c, const springls__contour_brick *brick,
                                              springls__contour_vertex *vertex)
{
    int i;
    for (i = 0; i < brick->vertices; i++)
        vertex[i].id = !c->with_ids ? 0 : vertex[i].springl < 0 ? UINT32_MAX : c->ctx->model.set.id[vertex[i].springl];
}

/* Writes the vertices of bricks of the table that are in the new contour, and the keys of all. */
SPRINGLS__FN void springls__fill_contour_work(void *arg, int begin, int end, float *memory)
{
    springls__contour_chunks *c = (springls__contour_chunks *)arg;
    const springls__contour_update update = springls__contour_update_of(c);
    (void)memory;
    for (; begin < end; begin++) {
        const springls__contour_brick *brick = c->of_table[begin] < 0 ? NULL : update.after->brick + c->of_table[begin];
        springls__contour_vertex *vertex = brick ? update.after->vertex + brick->first_vertex : NULL;
        springls__write_contour_vertices(&update.table, begin, vertex, c->vertex_key);
        if (brick) springls__write_contour_ids(c, brick, vertex);
    }
}

/* Writes the triangles of bricks that are not kept. */
SPRINGLS__FN void springls__fill_corners_work(void *arg, int begin, int end, float *memory)
{
    springls__contour_chunks *c = (springls__contour_chunks *)arg;
    const springls__contour_update update = springls__contour_update_of(c);
    const uint64_t *key = c->vertex_key;
    int k, d;
    (void)memory;
    for (; begin < end; begin++) {
        const springls__contour_brick *brick = update.after->brick + begin;
        uint32_t *to = update.after->corner + 3 * (size_t)brick->first_triangle;
        const springls__surface_brick *from;
        const int *corner;
        if (brick->table < 0) continue;
        from = update.table.brick + brick->table;
        corner = update.table.corners + 3 * (size_t)from->first_triangle;
        for (k = 0, d = 13; k < 3 * from->triangles; k++) {
            const uint64_t v = key[update.table.rank[corner[k]] - 1];
            if (from->around[d] != (int)(v >> 32))
                for (d = 0; from->around[d] != (int)(v >> 32); d++) continue;
            to[k] = springls__contour_corner(d, (uint32_t)v);
        }
    }
}

/* ---- the border of triangles ---- */

SPRINGLS__FN uint64_t springls__mixed(uint64_t h)
{
    h = (h ^ h >> 32) * 0xD6E8FEB86659FD93u;
    return h ^ h >> 32;
}

/* Returns the sum over the directed edges of a brick's triangles of hashes that are opposite for opposite edges: triangles with the same
   border have the same sum. */
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

/* ---- what is published ---- */

/* Returns whether vertices of a new and a published contour are the same within half the tolerance: what has not been noticed since the
   brick was made is less than the other half (contour_region.h). Normals may have turned by twice as much. */
SPRINGLS__FN bool springls__vertices_agree(const springls__contour_vertex *now, const springls__contour_vertex *before, float tolerance)
{
    return now->key == before->key && now->id == before->id
        && springls__length2(springls__sub(now->x, before->x)) <= 0.25f * tolerance * tolerance
        && springls__length2(springls__sub(now->n, before->n)) <= 4.0f * tolerance * tolerance;
}

/* Keeps the published places of a group of `count` vertices, if there are as many and all agree. Returns whether that is so. */
SPRINGLS__FN bool springls__keep_vertices(springls__contour_vertex *now, int count, const springls__contour_vertex *before, int published,
                                          float tolerance)
{
    int k;
    if (count != published) return false;
    for (k = 0; k < count; k++)
        if (!springls__vertices_agree(now + k, before + k, tolerance)) return false;
    for (k = 0; k < count; k++) {
        now[k].x = before[k].x;
        now[k].n = before[k].n;
        now[k].changed = 0;
    }
    return true;
}

/* Returns the first vertex from i on that is not of a group. */
SPRINGLS__FN int springls__end_of_group(const springls__contour_vertex *vertex, int i, int end, uint32_t group)
{
    for (; i < end && springls__group_of_key(vertex[i].key) == group; i++) continue;
    return i;
}

/* Publishes the vertices of a brick that are not within the tolerance of those that were published. */
SPRINGLS__FN void springls__publish_contour_brick(const springls__contour_update *update, springls__contour_brick *now,
                                                  const springls__contour_brick *before)
{
    springls__contour_vertex *vertex = update->after->vertex + now->first_vertex;
    const springls__contour_vertex *old = before ? update->before->vertex + before->first_vertex : NULL;
    int i, end, j = 0, old_end = 0;
    for (i = 0; i < now->vertices; i = end) {
        const uint32_t group = springls__group_of_key(vertex[i].key);
        end = springls__end_of_group(vertex, i, now->vertices, group);
        for (; before && j < before->vertices && springls__group_of_key(old[j].key) < group; j++) continue;
        if (before) old_end = springls__end_of_group(old, j, before->vertices, group);
        if (!before || !springls__keep_vertices(vertex + i, end - i, old + j, old_end - j, update->tolerance)) now->changed = true;
        j = old_end;
    }
}

/* Returns the published brick that a brick of the new contour replaces; NULL: none. */
SPRINGLS__FN const springls__contour_brick *springls__brick_before(const springls_context *ctx, const springls__contour_update *update,
                                                                   const springls__contour_brick *now)
{
    const int i = update->before->stale ? -1 : springls__find_contour_brick(ctx, update->before, now->at.at);
    return i < 0 ? NULL : update->before->brick + i;
}

SPRINGLS__FN void springls__publish_contour_work(void *arg, int begin, int end, float *memory)
{
    springls__contour_chunks *c = (springls__contour_chunks *)arg;
    const springls__contour_update update = springls__contour_update_of(c);
    (void)memory;
    for (; begin < end; begin++) {
        springls__contour_brick *now = update.after->brick + begin;
        if (now->table >= 0) springls__publish_contour_brick(&update, now, springls__brick_before(c->ctx, &update, now));
    }
}

/* Marks the bricks around those with a changed vertex. */
SPRINGLS__FN void springls__mark_beside_changed(const springls__contour_chunks *c)
{
    const springls__contour_store *store = &c->store[1 - c->now];
    int i, d, other;
    for (i = 0; i < store->bricks; i++) {
        springls__contour_around around;
        if (!store->brick[i].changed) continue;
        around = springls__around_contour_brick(c->ctx, store, i);
        for (d = 0; d < 27; d++)
            if ((other = springls__contour_brick_around(&around, d)) >= 0) store->brick[other].beside_changed = true;
    }
}

/* Returns whether a vertex of the triangles of a brick of the new contour has changed. */
SPRINGLS__FN bool springls__has_changed_vertex(const springls__contour_chunks *c, int brick)
{
    const springls__contour_store *store = &c->store[1 - c->now];
    const springls__contour_brick *of = store->brick + brick;
    const uint32_t *corner = store->corner + 3 * (size_t)of->first_triangle;
    springls__contour_around around = springls__around_contour_brick(c->ctx, store, brick);
    int k;
    for (k = 0; of->beside_changed && k < 3 * of->triangles; k++)
        if (store->brick[springls__contour_brick_around(&around, (int)(corner[k] >> 27))].changed
            && store->vertex[springls__vertex_of_corner(&around, corner[k])].changed) return true;
    return false;
}

/* Returns whether the vertices of a brick's published triangles are there, unchanged, in the new contour. */
SPRINGLS__FN bool springls__has_vertices_of(const springls__contour_chunks *c, int brick, const uint32_t *corner, int corners)
{
    const springls__contour_store *store = &c->store[1 - c->now];
    springls__contour_around around = springls__around_contour_brick(c->ctx, store, brick);
    int k;
    for (k = 0; k < corners; k++) {
        const int of = springls__contour_brick_around(&around, (int)(corner[k] >> 27));
        const springls__contour_vertex *v;
        if (of < 0 || store->brick[of].vertices == 0) return false;
        v = &store->vertex[springls__vertex_of_corner(&around, corner[k])];
        if (v->key != (corner[k] & ((1u << 27) - 1u)) || (store->brick[of].changed && v->changed)) return false;
    }
    return true;
}

/* Returns whether a brick of the new contour has the triangles that are published, or may keep them: where their vertices are the same, and
   so is their border, they are as good. */
SPRINGLS__FN bool springls__keeps_triangles(const springls__contour_chunks *c, const springls__contour_update *update, int brick)
{
    const springls__contour_brick *now = update->after->brick + brick, *before;
    uint32_t *corner = update->after->corner + 3 * (size_t)now->first_triangle;
    const uint32_t *published;
    if (now->table < 0) return true;
    before = springls__brick_before(c->ctx, update, now);
    if (!before || before->triangles != now->triangles) return false;
    published = update->before->corner + 3 * (size_t)before->first_triangle;
    if (memcmp(published, corner, 3 * (size_t)now->triangles * sizeof *corner) == 0) return true;
    if (springls__border_of_brick(update->before, before) != springls__border_of_brick(update->after, now)
        || !springls__has_vertices_of(c, brick, published, 3 * now->triangles)) return false;
    memcpy(corner, published, 3 * (size_t)now->triangles * sizeof *corner);
    return true;
}

/* Finds which bricks have other triangles than those published, or triangles with vertices that have changed. */
SPRINGLS__FN void springls__compare_contour_work(void *arg, int begin, int end, float *memory)
{
    springls__contour_chunks *c = (springls__contour_chunks *)arg;
    const springls__contour_update update = springls__contour_update_of(c);
    (void)memory;
    for (; begin < end; begin++) {
        springls__contour_brick *now = update.after->brick + begin;
        if (!springls__keeps_triangles(c, &update, begin) || springls__has_changed_vertex(c, begin)) now->dirty = true;
    }
}

/* ---- the new contour's arrays ---- */

SPRINGLS__FN springls_status springls__reserve_contour(springls_context *ctx, springls__contour_store *store)
{
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->brick_memory, (size_t)store->bricks + 1, sizeof *store->brick, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->vertex_memory, (size_t)store->vertices + 1, sizeof *store->vertex, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &store->corner_memory, 3 * (size_t)store->triangles + 1, sizeof *store->corner, 0));
    store->brick = (springls__contour_brick *)store->brick_memory.data;
    store->vertex = (springls__contour_vertex *)store->vertex_memory.data;
    store->corner = (uint32_t *)store->corner_memory.data;
    return SPRINGLS_OK;
}

/* Makes room for what the update has for each brick of the table and each vertex. */
SPRINGLS__FN springls_status springls__reserve_contour_update(springls_context *ctx, springls__contour_chunks *c)
{
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->of_table_memory, (size_t)ctx->surface_bricks + 1, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->vertex_key_memory, (size_t)ctx->surface_vertices + 1, sizeof(uint64_t), 0));
    c->of_table = (int *)c->of_table_memory.data;
    c->vertex_key = (uint64_t *)c->vertex_key_memory.data;
    return SPRINGLS_OK;
}

/* Adds brick `brick` of the table to the new contour, without contents. */
SPRINGLS__FN springls__contour_brick springls__contour_brick_of(const springls_context *ctx, const springls__contour_chunks *c,
                                                                const springls__surface_brick *table, int brick)
{
    springls__contour_brick made;
    int axis;
    memset(&made, 0, sizeof made);
    for (axis = 0; axis < 3; axis++) made.at.at[axis] = (table[brick].origin[axis] + ctx->window.offset[axis]) / SPRINGLS__BRICK;
    made.chunk = springls__chunk_of_place(ctx, made.at.at);
    made.table = brick;
    made.constant = -1;
    made.vertices = c->of_table[brick];
    made.triangles = table[brick].triangles;
    return made;
}

/* Puts the `fresh` bricks of the new contour, which lie behind room for `kept` ones, and those that are kept in order. */
SPRINGLS__FN void springls__merge_contour_bricks(const springls__contour_chunks *c, int kept, int fresh)
{
    const springls__contour_store *before = &c->store[c->now];
    springls__contour_brick *to = c->store[1 - c->now].brick;
    int i, j = kept, n;
    for (i = n = 0; n < kept + fresh; n++) {
        while (i < before->bricks && springls__is_in_region(c, before->window, &before->brick[i])) i++;
        if (i < before->bricks && (j == kept + fresh || springls__compare_contour_bricks(&before->brick[i], &to[j]) < 0)) {
            to[n] = before->brick[i];
            to[n].table = ~i;
            to[n].dirty = to[n].changed = to[n].beside_changed = false;
            i++;
        } else {
            to[n] = to[j++];
        }
    }
}

/* Gives the bricks of the new contour their vertices and triangles; those that are kept have them then. */
SPRINGLS__FN void springls__place_contour_bricks(springls__contour_chunks *c)
{
    const springls__contour_store *before = &c->store[c->now];
    springls__contour_store *store = &c->store[1 - c->now];
    int i;
    store->vertices = store->triangles = 0;
    for (i = 0; i < store->bricks; i++) {
        springls__contour_brick *brick = &store->brick[i];
        brick->first_vertex = store->vertices;
        brick->first_triangle = store->triangles;
        store->vertices += brick->vertices;
        store->triangles += brick->triangles;
        if (brick->table >= 0) {
            c->of_table[brick->table] = i;
            continue;
        }
        memcpy(store->vertex + brick->first_vertex, before->vertex + before->brick[~brick->table].first_vertex,
               (size_t)brick->vertices * sizeof *store->vertex);
        memcpy(store->corner + 3 * (size_t)brick->first_triangle, before->corner + 3 * (size_t)before->brick[~brick->table].first_triangle,
               3 * (size_t)brick->triangles * sizeof *store->corner);
    }
}

/* Lists the bricks of the new contour: those of the table but for a margin, and those that are kept. */
SPRINGLS__FN springls_status springls__list_contour_bricks(springls_context *ctx, springls__contour_chunks *c)
{
    const springls__kept_table table = springls__kept_table_of(ctx);
    const springls__contour_store *before = &c->store[c->now];
    springls__contour_store *store = &c->store[1 - c->now];
    int i, kept = 0, fresh = 0;
    for (i = 0; i < before->bricks && !c->whole; i++) kept += !springls__is_in_region(c, before->window, &before->brick[i]);
    store->bricks = ctx->surface_bricks + kept;
    store->vertices = ctx->surface_vertices + (c->whole ? 0 : before->vertices);
    store->triangles = ctx->surface_triangles + (c->whole ? 0 : before->triangles);
    store->stale = false;
    memcpy(store->window, ctx->window.offset, sizeof store->window);
    SPRINGLS__TRY(springls__reserve_contour(ctx, store));
    for (i = 0; i < ctx->surface_bricks; i++) {
        const springls__contour_brick brick = springls__contour_brick_of(ctx, c, table.brick, i);
        if (c->whole || springls__is_in_region(c, before->window, &brick)) store->brick[kept + fresh++] = brick;
        c->of_table[i] = -1;
    }
    store->bricks = kept + fresh;
    qsort(store->brick + kept, (size_t)fresh, sizeof *store->brick, springls__compare_contour_bricks);
    if (!c->whole) springls__merge_contour_bricks(c, kept, fresh);
    springls__place_contour_bricks(c);
    return SPRINGLS_OK;
}

/* ---- chunks ---- */

/* Returns the end of the bricks that belong to the chunk of brick i; their triangles: how many they have. */
SPRINGLS__FN int springls__end_of_chunk(const springls__contour_store *store, int i, int *triangles, bool *dirty)
{
    const int *chunk = store->brick[i].chunk.at;
    *triangles = 0;
    *dirty = false;
    for (; i < store->bricks && springls__compare_places(store->brick[i].chunk.at, chunk) == 0; i++) {
        *triangles += store->brick[i].triangles;
        *dirty = *dirty || store->brick[i].dirty;
    }
    return i;
}

/* Lists the chunks that differ, without arrays, in the order of their bricks: chunks that are dirty, have other triangles, or have lost all
   their triangles. */
SPRINGLS__FN int springls__list_contour_chunks(const springls__contour_chunks *c, springls_chunk *chunk)
{
    const springls__contour_store *before = &c->store[c->now], *after = &c->store[1 - c->now];
    int i = 0, j = 0, n = 0;
    while (i < before->bricks || j < after->bricks) {
        const int order = i == before->bricks ? 1 : j == after->bricks ? -1
                        : springls__compare_places(before->brick[i].chunk.at, after->brick[j].chunk.at);
        const int *place = order < 0 ? before->brick[i].chunk.at : after->brick[j].chunk.at;
        const int first = j;
        int had = 0, has = 0;
        bool dirty = false, ignored;
        if (order <= 0) i = springls__end_of_chunk(before, i, &had, &ignored);
        if (order >= 0) j = springls__end_of_chunk(after, j, &has, &dirty);
        if (had == 0 && has == 0) continue;
        if (had == has && !dirty) continue;
        memset(&chunk[n], 0, sizeof chunk[n]);
        memcpy(chunk[n].brick, place, sizeof chunk[n].brick);
        c->first_brick[n] = first;
        c->brick_count[n++] = j - first;
    }
    return n;
}

/* Makes room for the list of chunks and for what is known of each. */
SPRINGLS__FN springls_status springls__reserve_contour_chunks(springls_context *ctx, springls__contour_chunks *c,
                                                              springls__buffer *chunk_memory)
{
    const size_t most = (size_t)c->store[0].bricks + (size_t)c->store[1].bricks, corners = 3 * (size_t)c->store[1 - c->now].triangles;
    SPRINGLS__TRY(springls__buffer_grow(ctx, chunk_memory, most + 1, sizeof(springls_chunk), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->first_brick_memory, 2 * most + 1, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->order_memory, corners + 1, sizeof(uint64_t), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->used_memory, 2 * corners + 1, sizeof(int), 0));
    c->first_brick = (int *)c->first_brick_memory.data;
    c->brick_count = c->first_brick + most;
    c->order = (uint64_t *)c->order_memory.data;
    c->used = (int *)c->used_memory.data;
    c->number = c->used + corners;
    return SPRINGLS_OK;
}

/* Finds the vertices of a chunk, by their order in the contour, and the numbers of its corners among them. Counts both. */
SPRINGLS__FN void springls__number_chunk(springls__contour_chunks *c, int first, int bricks, springls_chunk *chunk)
{
    const springls__contour_store *store = &c->store[1 - c->now];
    int i, k, corners = 0, begin;
    if (bricks == 0) return;
    begin = 3 * store->brick[first].first_triangle;
    for (i = first; i < first + bricks; i++) {
        springls__contour_around around = springls__around_contour_brick(c->ctx, store, i);
        for (k = 0; k < 3 * store->brick[i].triangles; k++, corners++)
            c->order[begin + corners] = (uint64_t)(uint32_t)springls__vertex_of_corner(&around, store->corner[begin + corners]) << 32
                                      | (uint32_t)corners;
    }
    springls__sort_keys(c->order + begin, (size_t)corners);
    for (k = 0; k < corners; k++) {
        const uint64_t key = c->order[begin + k];
        if (k == 0 || key >> 32 != c->order[begin + k - 1] >> 32) c->used[begin + chunk->vertex_count++] = (int)(key >> 32);
        c->number[begin + (int)(uint32_t)key] = chunk->vertex_count - 1;
    }
    chunk->triangle_count = corners / 3;
}

/* Returns the springl that a published vertex shows, by its id: its number may be another one by now. -1: there is none. */
SPRINGLS__FN int springls__springl_of_vertex(const springls__model *model, const springls__contour_vertex *v)
{
    springls__cell_walk walk;
    int i = v->springl;
    if (i < 0 || (i < model->set.count && model->set.id[i] == v->id)) return i;
    walk = springls__cell_walk_near(model, v->x, SPRINGLS__LARGEST_HIT_RADIUS + 1.0f);
    while ((i = springls__cell_walk_next(model, &walk)) >= 0 && model->set.id[i] != v->id) continue;
    return i;
}

/* Writes the correspondences and the ids of a chunk's vertices, as springls__contour_material_work finds them. */
SPRINGLS__FN void springls__write_contour_material(const springls_context *ctx, const springls__contour_vertex *vertex, const int *used,
                                                   springls_chunk *chunk, springls__candidates *candidates)
{
    springls__v3 x[SPRINGLS__CLOSE_VERTICES], a[SPRINGLS__CLOSE_VERTICES];
    int springl[SPRINGLS__CLOSE_VERTICES], first, count, i;
    for (first = 0; first < chunk->vertex_count; first += count) {
        count = springls__imin(chunk->vertex_count - first, SPRINGLS__CLOSE_VERTICES);
        for (i = 0; i < count; i++) {
            const springls__contour_vertex *v = vertex + used[first + i];
            x[i] = v->x;
            springl[i] = springls__springl_of_place(&ctx->model, v->x, v->n, springls__springl_of_vertex(&ctx->model, v));
        }
        springls__correspond(&ctx->model, candidates, x, springl, count, a);
        for (i = 0; i < count; i++) springls__write_chunk_material(ctx, chunk, first + i, x[i], springl[i], a[i]);
    }
}

/* Fills the arrays of a chunk that springls__number_chunk has counted. candidates: only with correspondences. */
SPRINGLS__FN void springls__fill_contour_chunk(const springls_context *ctx, const springls__contour_chunks *c, int first,
                                               springls_chunk *chunk, springls__candidates *candidates)
{
    const springls__contour_store *store = &c->store[1 - c->now];
    const size_t begin = 3 * (size_t)store->brick[first].first_triangle;
    const bool mirrored = springls__is_mirrored(ctx);
    int i, k;
    for (i = 0; i < chunk->vertex_count; i++) {
        const springls__contour_vertex *v = store->vertex + c->used[begin + (size_t)i];
        const springls__v3 n = springls__normal_to_world(ctx, v->n);
        springls__voxel_to_world(ctx, v->x, chunk->positions + 3 * i);
        memcpy(chunk->normals + 3 * i, &n, sizeof n);
    }
    if (chunk->correspondences) springls__write_contour_material(ctx, store->vertex, c->used + begin, chunk, candidates);
    for (i = 0; i < chunk->triangle_count; i++)
        for (k = 0; k < 3; k++) /* counter-clockwise seen from outside */
            chunk->triangles[3 * i + (mirrored && k ? 3 - k : k)] = (uint16_t)c->number[begin + (size_t)(3 * i + k)];
}

#endif
