/* chunks.h - the zero level brick by brick, and which bricks have changed. What was shown last is kept: a level set of its own in
   bricks like the model's, each voxel of which follows the model's only when that has gone further away than `tolerance`. All
   chunks are made of it, so where two meet they have the same vertices to the bit, whenever either was made. */
#ifndef SPRINGLS__OUTPUT_CHUNKS_H
#define SPRINGLS__OUTPUT_CHUNKS_H

#include "../../kernels_embed/output/isosurface.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/cell_list.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/step.h"

/* Of the springls of a brick, to tell whether correspondences have moved along the surface. */
typedef struct springls__brick_signature { uint64_t ids; springls__v3 places, origins; int count; } springls__brick_signature; /* sums of p and a */

struct springls_chunks {
    springls_chunks_desc desc;
    springls__grid shown;       /* top, slot_brick, free_slots and phi                                          */
    springls__brick_signature *crew;       /* of a slot, when it was last meshed                                           */
    uint8_t *dirty, *has_mesh;  /* of a brick                                                                   */
    uint32_t *touched;          /* of a listed brick: the bricks around it that a change reaches                */
    int *list;
    springls_chunk *chunk;      /* those that have changed                                                      */
    springls__buffer top, slot_brick, free_slots, phi, crews, dirt, meshes, touch, lists, chunks, vertices, corners;
};

SPRINGLS__FN void springls__chunks_free(springls_context *ctx, springls_chunks *c)
{
    springls__buffer *const buffers[] = { &c->top, &c->slot_brick, &c->free_slots, &c->phi, &c->crews, &c->dirt,
                                          &c->meshes, &c->touch, &c->lists,
                                          &c->chunks, &c->vertices, &c->corners };
    size_t i;
    for (i = 0; i < sizeof buffers / sizeof *buffers; i++) springls__buffer_free(ctx, buffers[i]);
    springls__release(ctx, c, sizeof *c);
}

/* Room for slots of bricks that are shown. */
SPRINGLS__FN springls_status springls__chunks_reserve(springls_context *ctx, springls_chunks *c, int slots)
{
    size_t n = (size_t)slots, used = (size_t)c->shown.slot_count;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->slot_brick, n, sizeof(int), used * sizeof(int)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->free_slots, n, sizeof(int), (size_t)c->shown.free_count * sizeof(int)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->phi, n * SPRINGLS__BRICK_VOXELS, sizeof(float),
                                        used * SPRINGLS__BRICK_VOXELS * sizeof(float)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->crews, n, sizeof *c->crew, used * sizeof *c->crew));
    c->shown.slot_brick = (int *)c->slot_brick.data;
    c->shown.free_slots = (int *)c->free_slots.data;
    c->shown.phi = (float *)c->phi.data;
    c->crew = (springls__brick_signature *)c->crews.data;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__chunks_make(springls_context *ctx, springls_chunks *c)
{
    const springls__grid *g = &ctx->model.grid;
    size_t bricks = springls__brick_count(g), i;
    memcpy(c->shown.size, g->size, sizeof g->size);
    memcpy(c->shown.bricks, g->bricks, sizeof g->bricks);
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->top, bricks, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->dirt, bricks, 1, 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->meshes, bricks, 1, 0));
    SPRINGLS__TRY(springls__chunks_reserve(ctx, c, SPRINGLS__FIRST_SLOT));
    c->shown.top = (int *)c->top.data;
    c->dirty = (uint8_t *)c->dirt.data;
    c->has_mesh = (uint8_t *)c->meshes.data;
    for (i = 0; i < bricks; i++) c->shown.top[i] = SPRINGLS__OUTSIDE;
    memset(c->dirty, 0, bricks);
    memset(c->has_mesh, 0, bricks);
    c->shown.slot_count = SPRINGLS__FIRST_SLOT;
    return SPRINGLS_OK;
}

/* ---- what has changed ---- */

/* Bricks that a voxel of a brick matters to, where there is a mesh: a vertex hangs on voxels up to its brick's end, and its
   normal on voxels one further. Bits as in springls__neighbor_mask_of_row. */
SPRINGLS__FN uint32_t springls__bricks_touched_by(int v)
{
    int x = v & 7, y = v >> 3 & 7, z = v >> 6;
    return springls__neighbor_mask_of_row(x <= 1, x == 7, y <= 1, y == 7, z <= 1, z == 7);
}

/* May the zero level that is shown pass between voxel v of a brick and one of the six around it? */
SPRINGLS__FN bool springls__may_cross(const springls__grid *g, const int origin[3], const float *brick, int v, float tolerance)
{
    int axis, way;
    for (axis = 0; axis < 3; axis++)
        for (way = -1; way <= 1; way += 2) {
            int at[3] = { v & 7, v >> 3 & 7, v >> 6 };
            float beside;
            at[axis] += way;
            if (at[axis] >= 0 && at[axis] < SPRINGLS__BRICK) beside = brick[v + way * (1 << 3 * axis)];
            else beside = springls__grid_phi(g, g->phi, origin[0] + at[0], origin[1] + at[1], origin[2] + at[2]);
            if (brick[v] < 0.0f ? beside >= -tolerance : beside <= tolerance) return true;
        }
    return false;
}

typedef struct springls__chunk_job { springls_context *ctx; springls_chunks *chunks; } springls__chunk_job;

/* Voxels of a listed brick that have left the tolerance are shown as they are now, and those that matter to no other brick with
   them. */
SPRINGLS__FN void springls__show_task(void *arg, int begin, int end)
{
    const springls__chunk_job *job = (const springls__chunk_job *)arg;
    springls_chunks *c = job->chunks;
    const springls__grid *g = &job->ctx->model.grid;
    const float tolerance = c->desc.tolerance, deep = 1.5f;
    const uint32_t own = 1u << 13;
    int v, origin[3];
    for (; begin < end; begin++) {
        const float *now = g->phi + (size_t)g->top[c->list[begin]] * SPRINGLS__BRICK_VOXELS;
        float *shown = c->shown.phi + (size_t)c->shown.top[c->list[begin]] * SPRINGLS__BRICK_VOXELS;
        uint32_t touched = 0u;
        springls__slot_origin(&c->shown, c->shown.top[c->list[begin]], origin);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            float before = shown[v];
            if (springls__fabs(now[v] - before) <= tolerance) continue;
            shown[v] = now[v];
            /* further from the surface it moves no vertices, and normals hardly; but phi may be steep there */
            if (tolerance == 0.0f || springls__min(springls__fabs(now[v]), springls__fabs(before)) < deep
                || (now[v] < 0.0f) != (before < 0.0f) || springls__may_cross(g, origin, now, v, tolerance))
                touched |= springls__bricks_touched_by(v);
        }
        for (v = 0; touched && v < SPRINGLS__BRICK_VOXELS; v++)
            if (springls__bricks_touched_by(v) == own) shown[v] = now[v];
        c->touched[begin] = touched ? touched | own : 0u;
    }
}

/* Bricks whose values may differ from those shown, to `list`; each is given a slot. */
SPRINGLS__FN springls_status springls__list_bricks(springls_context *ctx, springls_chunks *c, int *count)
{
    const springls__grid *g = &ctx->model.grid;
    springls__grid *shown = &c->shown;
    int bricks = (int)springls__brick_count(g), i, n = 0, fresh = 0;
    for (i = 0; i < bricks; i++) {
        bool here = shown->top[i] >= SPRINGLS__FIRST_SLOT;
        if (!here && g->top[i] == shown->top[i]) continue;
        n++;
        fresh += !here;
    }
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->lists, (size_t)n + 1, sizeof(int), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->touch, (size_t)n + 1, sizeof(uint32_t), 0));
    SPRINGLS__TRY(springls__chunks_reserve(ctx, c, shown->slot_count + fresh));
    c->list = (int *)c->lists.data;
    c->touched = (uint32_t *)c->touch.data;
    shown->far_value = g->far_value;
    springls__fill(shown->phi, SPRINGLS__OUTSIDE, g->far_value);
    springls__fill(shown->phi, SPRINGLS__INSIDE, -g->far_value);
    for (i = n = 0; i < bricks; i++) {
        int side = shown->top[i], slot;
        if (side < SPRINGLS__FIRST_SLOT && g->top[i] == side) continue;
        c->list[n++] = i;
        if (side >= SPRINGLS__FIRST_SLOT) continue;
        slot = shown->free_count ? shown->free_slots[--shown->free_count] : shown->slot_count++;
        shown->top[i] = slot;
        shown->slot_brick[slot] = i;
        springls__fill(shown->phi, slot, side == SPRINGLS__INSIDE ? -g->far_value : g->far_value);
        memset(&c->crew[slot], 0, sizeof c->crew[slot]);
    }
    *count = n;
    return SPRINGLS_OK;
}

/* All that a change of listed brick i reaches is to be meshed again. */
SPRINGLS__FN void springls__mark_around(springls_chunks *c, int i)
{
    int origin[3], at[3], d;
    springls__slot_origin(&c->shown, c->shown.top[c->list[i]], origin);
    for (d = 0; d < 27 && c->touched[i]; d++)
        if ((c->touched[i] >> d & 1u) && springls__brick_around(&c->shown, origin, d, at))
            c->dirty[springls__brick_at(&c->shown, at[0], at[1], at[2])] = 1;
}

/* Who is where: to tell change of correspondences. By slot of what is shown. */
SPRINGLS__FN springls_status springls__collect_signatures(springls_context *ctx, springls_chunks *c)
{
    const springls__grid *g = &ctx->model.grid;
    springls__brick_signature *crew;
    int i, slot;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_signatures, c->shown.slot_count));
    crew = springls__brick_signatures(&ctx->model);
    memset(crew, 0, (size_t)c->shown.slot_count * sizeof *crew);
    for (i = 0; i < ctx->model.set.count; i++) {
        springls__v3 p = ctx->model.set.s[i].p;
        slot =
            springls__slot_at(&c->shown, springls__cell_coordinate(p.x, g->size[0]),
                              springls__cell_coordinate(p.y, g->size[1]), springls__cell_coordinate(p.z, g->size[2]));
        crew[slot].ids += springls__hash(14695981039346656037u, &ctx->model.set.id[i], sizeof(uint32_t));
        crew[slot].places = springls__add(crew[slot].places, p);
        crew[slot].origins = springls__add(crew[slot].origins, ctx->model.set.a[i]);
        crew[slot].count++;
    }
    for (slot = SPRINGLS__FIRST_SLOT; slot < c->shown.slot_count; slot++) {
        float most = c->desc.tolerance * (float)crew[slot].count;
        if (c->shown.slot_brick[slot] < 0) continue;
        if (crew[slot].ids == c->crew[slot].ids
            && springls__length2(springls__sub(crew[slot].places, c->crew[slot].places)) <= most * most
            && springls__length2(springls__sub(crew[slot].origins, c->crew[slot].origins)) <= most * most)
            continue;
        c->crew[slot] = crew[slot];
        c->dirty[c->shown.slot_brick[slot]] = 1;
    }
    return SPRINGLS_OK;
}

/* Bricks that have become constant give their slot back. */
SPRINGLS__FN void springls__drop_shown(springls_context *ctx, springls_chunks *c, int count)
{
    int i;
    for (i = 0; i < count; i++) {
        int brick = c->list[i], side = ctx->model.grid.top[brick], slot = c->shown.top[brick];
        if (side >= SPRINGLS__FIRST_SLOT) continue;
        c->shown.top[brick] = side;
        c->shown.slot_brick[slot] = -1;
        c->shown.free_slots[c->shown.free_count++] = slot;
    }
}

/* ---- meshes ---- */

/* The vertex that lies on an edge of a cube: one number for all cubes around the edge. */
SPRINGLS__FN int springls__edge_number(int x, int y, int z, int edge)
{
    int corner = springls__mc_edge_corner(edge);
    return 3 * springls__tile_index(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)) + springls__mc_edge_axis(edge);
}

/* Marching cubes of a chunk, vertices (voxels) numbered as triangles come to them. Both NULL: it only counts. */
SPRINGLS__FN void springls__mesh_chunk(const springls_chunks *c, springls_chunk *chunk, springls__v3 *vertex, uint16_t *corner)
{
    const springls__grid *g = &c->shown;
    float tile[SPRINGLS__TILE_VOXELS];
    uint16_t number[3 * SPRINGLS__TILE_VOXELS]; /* from 1 on; 0: none yet */
    int slot = springls__slot_at(g, 8 * chunk->brick[0], 8 * chunk->brick[1], 8 * chunk->brick[2]), x, y, z, k;
    springls__cube_range range;
    chunk->vertex_count = chunk->triangle_count = 0;
    if (slot < SPRINGLS__FIRST_SLOT) return;
    memset(number, 0, sizeof number);
    range = springls__brick_cubes(g, slot);
    springls__load_tile(g, g->phi, slot, springls__alone(), tile);
    for (z = range.lo[2]; z <= range.hi[2]; z++)
        for (y = range.lo[1]; y <= range.hi[1]; y++)
            for (x = range.lo[0]; x <= range.hi[0]; x++) {
                springls__mc_cell cell = springls__tile_cube(tile, x, y, z);
                int mask = springls__mc_case(cell);
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

SPRINGLS__FN void springls__count_chunk_task(void *arg, int begin, int end)
{
    const springls__chunk_job *job = (const springls__chunk_job *)arg;
    for (; begin < end; begin++) springls__mesh_chunk(job->chunks, &job->chunks->chunk[begin], NULL, NULL);
}

/* Its arrays are there; positions hold voxels, then the world. */
SPRINGLS__FN void springls__fill_chunk(const springls_context *ctx, const springls_chunks *c, springls_chunk *chunk)
{
    springls__v3 *place = (springls__v3 *)(void *)chunk->positions;
    int i;
    springls__mesh_chunk(c, chunk, place, chunk->triangles);
    for (i = 0; i < chunk->vertex_count; i++) {
        springls__v3 x = place[i], n = springls__normal_to_world(ctx, springls__grid_gradient(&c->shown, c->shown.phi, x)), a = x;
        memcpy(chunk->normals + 3 * i, &n, sizeof n);
        springls__voxel_to_world(ctx, x, chunk->positions + 3 * i);
        if (c->desc.correspondences) {
            int nearest = springls__nearest_springl(&ctx->model, x, 1.0f);
            if (nearest >= 0) a = springls__correspondence_at(&ctx->model, nearest, x);
            springls__voxel_to_world(ctx, a, chunk->correspondences + 3 * i);
            chunk->ids[i] = nearest >= 0 ? ctx->model.set.id[nearest] : UINT32_MAX;
        }
    }
    for (i = 0; i < chunk->triangle_count && springls__is_mirrored(ctx); i++) { /* counter-clockwise seen from outside */
        uint16_t one = chunk->triangles[3 * i + 1];
        chunk->triangles[3 * i + 1] = chunk->triangles[3 * i + 2];
        chunk->triangles[3 * i + 2] = one;
    }
}

SPRINGLS__FN void springls__fill_chunk_task(void *arg, int begin, int end)
{
    const springls__chunk_job *job = (const springls__chunk_job *)arg;
    for (; begin < end; begin++) springls__fill_chunk(job->ctx, job->chunks, &job->chunks->chunk[begin]);
}

/* The dirty bricks as chunks without arrays. */
SPRINGLS__FN springls_status springls__list_chunks(springls_context *ctx, springls_chunks *c, int *count)
{
    const springls__grid *g = &c->shown;
    int bricks = (int)springls__brick_count(g), i, n = 0;
    for (i = 0; i < bricks; i++) n += c->dirty[i];
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->chunks, (size_t)n + 1, sizeof *c->chunk, 0));
    c->chunk = (springls_chunk *)c->chunks.data;
    memset(c->chunk, 0, (size_t)n * sizeof *c->chunk);
    for (i = n = 0; i < bricks; i++) {
        if (!c->dirty[i]) continue;
        c->chunk[n].brick[0] = i % g->bricks[0];
        c->chunk[n].brick[1] = i / g->bricks[0] % g->bricks[1];
        c->chunk[n++].brick[2] = i / (g->bricks[0] * g->bricks[1]);
    }
    *count = n;
    return SPRINGLS_OK;
}

/* Of what has been counted: each chunk gets its share of the arrays; those that have and had nothing are left out. */
SPRINGLS__FN springls_status springls__share_out(springls_context *ctx, springls_chunks *c, int *count)
{
    const size_t words = c->desc.correspondences ? 10 : 6; /* a vertex */
    size_t vertices = 0, corners = 0;
    int i, n = 0;
    for (i = 0; i < *count; i++) {
        const int *b = c->chunk[i].brick;
        vertices += (size_t)c->chunk[i].vertex_count;
        corners += 3 * (size_t)c->chunk[i].triangle_count;
        if (c->chunk[i].triangle_count || c->has_mesh[springls__brick_at(&c->shown, 8 * b[0], 8 * b[1], 8 * b[2])])
            c->chunk[n++] = c->chunk[i];
    }
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->vertices, vertices * words + 1, sizeof(float), 0));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &c->corners, corners + 1, sizeof(uint16_t), 0));
    *count = n;
    vertices = corners = 0;
    for (i = 0; i < n; i++) {
        springls_chunk *chunk = &c->chunk[i];
        size_t v = (size_t)chunk->vertex_count;
        if (!v) continue;
        chunk->positions = (float *)c->vertices.data + vertices * words;
        chunk->normals = chunk->positions + 3 * v;
        if (c->desc.correspondences) {
            chunk->correspondences = chunk->normals + 3 * v;
            chunk->ids = (uint32_t *)(void *)(chunk->correspondences + 3 * v);
        }
        chunk->triangles = (uint16_t *)c->corners.data + corners;
        vertices += v;
        corners += 3 * (size_t)chunk->triangle_count;
    }
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__chunks_update(springls_context *ctx, springls_chunks *c, int *count)
{
    springls__chunk_job job;
    int listed, i;
    job.ctx = ctx;
    job.chunks = c;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    if (c->desc.correspondences) SPRINGLS__TRY(springls__cell_list_build(ctx));
    SPRINGLS__TRY(springls__list_bricks(ctx, c, &listed));
    springls__parallel(ctx, listed, 16, springls__show_task, &job);
    for (i = 0; i < listed; i++) springls__mark_around(c, i);
    if (c->desc.correspondences) SPRINGLS__TRY(springls__collect_signatures(ctx, c));
    springls__drop_shown(ctx, c, listed);
    SPRINGLS__TRY(springls__list_chunks(ctx, c, count));
    springls__parallel(ctx, *count, 4, springls__count_chunk_task, &job);
    SPRINGLS__TRY(springls__share_out(ctx, c, count));
    springls__parallel(ctx, *count, 1, springls__fill_chunk_task, &job);
    memset(c->dirty, 0, springls__brick_count(&c->shown));
    for (i = 0; i < *count; i++) {
        const int *b = c->chunk[i].brick;
        c->has_mesh[springls__brick_at(&c->shown, 8 * b[0], 8 * b[1], 8 * b[2])] = c->chunk[i].triangle_count > 0;
    }
    return SPRINGLS_OK;
}

/* ---- the calls ---- */

SPRINGLS_API springls_status springls_chunks_create(springls_context *ctx, const springls_chunks_desc *desc,
                                                    springls_chunks **out)
{
    springls_chunks *c;
    springls_status status;
    if (out) *out = NULL;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!out || (desc && !(desc->tolerance > -FLT_MAX && desc->tolerance <= 0.5f)))
        return springls__fail(
            ctx, SPRINGLS_INVALID_ARGUMENT,
            "chunks_create: out is NULL, or the tolerance is more than half a voxel or not a number");
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

SPRINGLS_API void springls_chunks_destroy(springls_context *ctx, springls_chunks *chunks)
{
    if (ctx && chunks) springls__chunks_free(ctx, chunks);
}

SPRINGLS_API springls_status springls_chunks_update(springls_context *ctx, springls_chunks *chunks,
                                                    const springls_chunk **changed, int *count)
{
    springls_status status;
    if (changed) *changed = NULL;
    if (count) *count = 0;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!chunks || !changed || !count)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "chunks_update: chunks, changed or count is NULL");
    SPRINGLS__TRY(springls__finish_step(ctx));
    status = springls__chunks_update(ctx, chunks, count);
    if (status == SPRINGLS_OK) *changed = chunks->chunk;
    else *count = 0;
    return springls__report_device_failure(ctx, status);
}

#endif
