/* surface_table.h - springl contouring (params.contouring): a closed mesh of what the springls hold, made brick by brick. crossings.h,
   faces.h and patches.h have the formulas; here are the list of bricks, the arrays and the order of the kernels:
   hits -> sides of nodes -> crossings of edges -> arcs on faces -> triangles in cells.

   The table is of all bricks, or of a region: those whose triangles are wanted, and a margin of the bricks around them, which have no
   triangles, but hits and all that the cells of the region share with theirs. */
#ifndef SPRINGLS__STAGES_SURFACE_TABLE_H
#define SPRINGLS__STAGES_SURFACE_TABLE_H

#include "../../kernels_embed/output/isosurface.h"
#include "../../kernels_embed/output/patches.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../runtime/resumable.h"
#include "../model/host_access.h"

typedef enum springls__surface_kernel {
    SPRINGLS__SURFACE_SORT_HITS,
    SPRINGLS__SURFACE_WEIGH_HITS,
    SPRINGLS__SURFACE_FIND_SIDES,
    SPRINGLS__SURFACE_COUNT_CROSSINGS,
    SPRINGLS__SURFACE_FIND_CROSSINGS,
    SPRINGLS__SURFACE_COUNT_ARCS,
    SPRINGLS__SURFACE_FIND_ARCS,
    SPRINGLS__SURFACE_COUNT_LINKS,
    SPRINGLS__SURFACE_FIND_PATCHES
} springls__surface_kernel;

/* The table while it is made: in SPRINGLS__SURFACE_JOB, from one entry to the next. */
typedef struct springls__surface_job {
    springls_context *ctx;
    springls__contour contour;
    springls__surfel *surfel;
    int *springl;              /* [springls] those whose hits may lie in the table; those that are known beside them */
    springls__row_hit *found;  /* hits by springl: those of the i-th of them from first_found[i] on */
    int *first_found, springls;
    springls__surface_kernel kernel;
    int bricks, places;        /* places: those of bricks, and of the bricks around a region's whose springls are known */
    size_t table_size;
} springls__surface_job;

SPRINGLS__FN springls__surface_job *springls__surface_job_of(const springls_context *ctx)
{
    return (springls__surface_job *)ctx->surface_memory[SPRINGLS__SURFACE_JOB].data;
}

/* Working memory of one lane. */
typedef union springls__surface_work {
    springls__trims trims;
    springls__line_work line;
    springls__face_work face;
    springls__cell_work cell;
} springls__surface_work;

SPRINGLS__FN springls_status springls__reserve_table(springls_context *ctx, int buffer, size_t count, size_t element)
{
    return springls__buffer_grow(ctx, &ctx->surface_memory[buffer], count + 1, element, 0);
}

/* ---- kernels ---- */

SPRINGLS__FN void springls__surface_brick_task(void *arg, int begin, int end, float *memory)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    const springls__model *model = &job->ctx->model;
    const springls__contour *contour = &job->contour;
    springls__surface_work *work = (springls__surface_work *)(void *)memory;
    for (; begin < end; begin++) {
        if (contour->brick[begin].ready) continue;
        switch (job->kernel) {
        case SPRINGLS__SURFACE_SORT_HITS: springls__sort_hits(contour, begin); break;
        case SPRINGLS__SURFACE_WEIGH_HITS: springls__weigh_hits(contour, begin, &work->line); break;
        case SPRINGLS__SURFACE_FIND_SIDES: springls__find_node_sides(model, contour, begin, &work->line); break;
        case SPRINGLS__SURFACE_COUNT_CROSSINGS: springls__count_crossings(contour, begin); break;
        case SPRINGLS__SURFACE_FIND_CROSSINGS: springls__find_crossings(model, contour, begin, &work->line); break;
        case SPRINGLS__SURFACE_COUNT_ARCS: springls__count_arcs(contour, begin); break;
        case SPRINGLS__SURFACE_FIND_ARCS: springls__find_arcs(model, contour, begin, &work->face); break;
        case SPRINGLS__SURFACE_COUNT_LINKS: contour->brick[begin].links = springls__count_links(contour, begin, &work->cell); break;
        case SPRINGLS__SURFACE_FIND_PATCHES: springls__find_patches(contour, begin, &work->cell); break;
        }
    }
}

/* Ends an entry with a loop over `count` elements, each lane with its working memory. */
SPRINGLS__FN springls_status springls__surface_loop(springls_context *ctx, int count, int grain, springls__loop_work work)
{
    const size_t floats = sizeof(springls__surface_work) / sizeof(float) + 1;
    SPRINGLS__TRY(springls__reserve_lanes(ctx, floats, count, grain));
    springls__loop_over(ctx, count, grain, floats, work, springls__surface_job_of(ctx));
    return SPRINGLS_OK;
}

/* Ends an entry with a kernel over all bricks. */
SPRINGLS__FN springls_status springls__surface_run(springls_context *ctx, springls__surface_kernel kernel)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    job->kernel = kernel;
    return springls__surface_loop(ctx, job->bricks, 1, springls__surface_brick_task);
}

/* Returns the slot of the grid's brick that begins at a voxel, which may lie beyond the domain: SPRINGLS__OUTSIDE then. */
SPRINGLS__FN int springls__slot_of_origin(const springls__grid *g, const int origin[3])
{
    return springls__grid_contains(g, origin[0], origin[1], origin[2]) ? springls__slot_of_voxel(g, origin[0], origin[1], origin[2])
                                                                        : SPRINGLS__OUTSIDE;
}

/* Finds which springls of the table's bricks are creased; behind those, which springls in no cell are. */
SPRINGLS__FN void springls__crease_work(void *arg, int begin, int end, float *memory)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    const springls__model *model = &job->ctx->model;
    (void)memory;
    for (; begin < end && begin < job->bricks; begin++) {
        const int slot = springls__slot_of_origin(&model->grid, job->contour.brick[begin].origin);
        if (slot >= SPRINGLS__FIRST_SLOT) springls__find_creased(model, job->surfel, slot);
    }
    for (; begin < end; begin++) {
        const int i = (int)model->cells.unbinned[begin - job->bricks];
        job->surfel[i].creased = springls__is_creased(model, job->surfel, i);
    }
}

/* ---- the list of bricks: those active and all around them, also beyond the border of the domain ---- */

/* Returns the key of the place in the window of a brick, which may be one before it; keys ascend as places do, x fastest. */
SPRINGLS__FN uint64_t springls__place_key(const int place[3])
{
    return (uint64_t)(place[2] + 2) << 42 | (uint64_t)(place[1] + 2) << 21 | (uint64_t)(place[0] + 2);
}

/* Finds the place whose key that is. */
SPRINGLS__FN void springls__place_of_key(uint64_t key, int place[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) place[axis] = (int)(key >> 21 * axis & 0x1fffffu) - 2;
}

/* Finds brick `place` in the table, or where it is to go. Places begin at -1. */
SPRINGLS__FN int *springls__surface_slot(const springls__surface_job *job, const int place[3])
{
    const size_t size = job->table_size;
    int *table = (int *)job->ctx->surface_memory[SPRINGLS__SURFACE_HASH].data;
    size_t slot = springls__hash3((uint32_t)(place[0] + 1), (uint32_t)(place[1] + 1), (uint32_t)(place[2] + 1)) & (size - 1);
    for (; table[slot] >= 0; slot = (slot + 1) & (size - 1)) {
        const int *other = (int *)job->ctx->surface_memory[SPRINGLS__SURFACE_RANK].data + 3 * (size_t)table[slot];
        if (other[0] == place[0] && other[1] == place[1] && other[2] == place[2]) break;
    }
    return table + slot;
}

/* Finds the place of the d-th brick around another. */
SPRINGLS__FN void springls__place_around(const int center[3], int d, int place[3])
{
    place[0] = center[0] + d % 3 - 1;
    place[1] = center[1] + d / 3 % 3 - 1;
    place[2] = center[2] + d / 9 - 1;
}

/* Returns the slot of the grid's brick at a place. */
SPRINGLS__FN int springls__slot_of_brick_place(const springls__grid *g, const int place[3])
{
    const int origin[3] = { SPRINGLS__BRICK * place[0], SPRINGLS__BRICK * place[1], SPRINGLS__BRICK * place[2] };
    return springls__slot_of_origin(g, origin);
}

/* Returns whether the table of all bricks has the one at a place: it or one around it is active. */
SPRINGLS__FN bool springls__surface_reaches(const springls__grid *g, const int place[3])
{
    int d, at[3];
    for (d = 0; d < 27; d++) {
        springls__place_around(place, d, at);
        if (springls__slot_of_brick_place(g, at) >= SPRINGLS__FIRST_SLOT) return true;
    }
    return false;
}

SPRINGLS__FN void springls__clear_surface_slots(springls__surface_job *job)
{
    int *table = (int *)job->ctx->surface_memory[SPRINGLS__SURFACE_HASH].data;
    size_t slot;
    for (slot = 0; slot < job->table_size; slot++) table[slot] = -1;
    job->places = 0;
}

/* Adds the brick at a place to the table, if it is new there. */
SPRINGLS__FN void springls__add_surface_brick(springls__surface_job *job, const int place[3])
{
    int *at = springls__surface_slot(job, place);
    if (*at >= 0) return;
    *at = job->places;
    memcpy((int *)job->ctx->surface_memory[SPRINGLS__SURFACE_RANK].data + 3 * (size_t)job->places++, place, 3 * sizeof *place);
}

/* Adds the bricks around a place that the table of all bricks has. */
SPRINGLS__FN void springls__add_surface_bricks_around(springls__surface_job *job, const int center[3])
{
    int d, place[3];
    for (d = 0; d < 27; d++) {
        springls__place_around(center, d, place);
        if (springls__surface_reaches(&job->ctx->model.grid, place)) springls__add_surface_brick(job, place);
    }
}

/* Lists the places of the table's bricks: those that are active and all around them, in the order of their keys, in which a region has them
   too: then the first of two triangles is the same one in both. */
SPRINGLS__FN springls_status springls__list_all_bricks(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    const springls__grid *g = &ctx->model.grid;
    int i, d, place[3], center[3], bricks;
    uint64_t *key;
    for (i = 0; i < g->active_count; i++) {
        springls__brick_place(g, g->slot_brick[g->active[i]], center);
        for (d = 0; d < 27; d++) {
            springls__place_around(center, d, place);
            springls__add_surface_brick(job, place);
        }
    }
    bricks = job->places;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_KEY, (size_t)bricks, sizeof *key));
    key = (uint64_t *)ctx->surface_memory[SPRINGLS__SURFACE_KEY].data;
    for (i = 0; i < bricks; i++) key[i] = springls__place_key((int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data + 3 * (size_t)i);
    springls__sort_keys(key, (size_t)bricks);
    springls__clear_surface_slots(job);
    for (i = 0; i < bricks; i++) {
        springls__place_of_key(key[i], place);
        springls__add_surface_brick(job, place);
    }
    job->bricks = bricks;
    return SPRINGLS_OK;
}

/* Lists the places of a region's bricks, those of its margin, and those around the margin. */
SPRINGLS__FN void springls__list_region_bricks(springls__surface_job *job)
{
    const springls_context *ctx = job->ctx;
    const int *region = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_REGION].data;
    const int *places = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    int i;
    for (i = 0; i < ctx->surface_region; i++) springls__add_surface_brick(job, region + 3 * (size_t)i);
    for (i = 0; i < ctx->surface_region; i++) springls__add_surface_bricks_around(job, region + 3 * (size_t)i);
    job->bricks = job->places;
    for (i = ctx->surface_region; i < job->bricks; i++) springls__add_surface_bricks_around(job, places + 3 * (size_t)i);
}

/* Finds where the region lies around a brick of the margin. */
SPRINGLS__FN void springls__find_margin(const springls__surface_job *job, springls__surface_brick *brick)
{
    int d;
    for (d = 0; d < 27; d++)
        if (brick->around[d] >= 0 && brick->around[d] < job->ctx->surface_region) brick->margin |= 1u << d;
}

/* Returns whether the hits of a springl in a brick may be of use: in a margin those are that lie near the region. */
SPRINGLS__FN bool springls__is_near_region(const springls__surface_brick *brick, springls__v3 p)
{
    static const uint32_t before[3] = { 0x1249249u, 0x1c0e07u, 0x1ffu }; /* the bricks around that lie before it along an axis */
    const float reach = 5.0f; /* voxels: what a line takes from beyond its brick, and how far a springl's hits lie from it */
    uint32_t region = brick->margin;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        const float at = springls__along(p, axis) - (float)brick->origin[axis];
        if (at > reach) region &= ~before[axis];
        if (at < 8.0f - reach) region &= ~(before[axis] << 2 * springls__direction_step(axis));
    }
    return brick->margin == 0u || region != 0u;
}

/* Makes the bricks of the table, without contents. */
SPRINGLS__FN springls_status springls__surface_bricks(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    const springls__grid *g = &ctx->model.grid;
    const bool all = ctx->surface_region == SPRINGLS__SURFACE_OF_ALL;
    const size_t most = all ? 27 * (size_t)g->active_count : 125 * (size_t)ctx->surface_region, size = springls__table_size(most);
    int i, d, k, place[3], *places;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_HASH, size, sizeof(int)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_RANK, 3 * most, sizeof(int)));
    places = (int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    job->table_size = size;
    springls__clear_surface_slots(job);
    if (all) SPRINGLS__TRY(springls__list_all_bricks(job));
    else springls__list_region_bricks(job);
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_BRICK_LIST, (size_t)job->bricks, sizeof(springls__surface_brick)));
    job->contour.brick = (springls__surface_brick *)ctx->surface_memory[SPRINGLS__SURFACE_BRICK_LIST].data;
    for (i = 0; i < job->bricks; i++)
        for (d = 14; d < 27; d++) job->contour.brick[i].around[d] = -1;
    for (i = 0; i < job->bricks; i++) {
        springls__surface_brick *brick = job->contour.brick + i;
        int last[3];
        for (k = 0; k < 3; k++) {
            brick->origin[k] = SPRINGLS__BRICK * places[3 * i + k];
            last[k] = brick->origin[k] + SPRINGLS__BRICK - 1;
        }
        brick->slot = -1;
        if (springls__grid_contains(g, brick->origin[0], brick->origin[1], brick->origin[2])
            && springls__grid_contains(g, last[0], last[1], last[2]))
            brick->slot = springls__table_contains(g, last[0], last[1], last[2])
                       && springls__table_contains(g, brick->origin[0], brick->origin[1], brick->origin[2])
                        ? springls__slot_at(g, last[0], last[1], last[2]) : SPRINGLS__OUTSIDE;
        brick->ready = 0;
        brick->margin = 0u;
        memset(brick->begin[SPRINGLS__OF_HITS], 0, sizeof brick->begin[SPRINGLS__OF_HITS]);
        memset(brick->beside_hits, 0, sizeof brick->beside_hits);
        memset(brick->plain, 0, sizeof brick->plain);
        brick->around[13] = i;
        for (d = 0; d < 13; d++) { /* the others are found from there */
            int other;
            springls__place_around(places + 3 * (size_t)i, d, place);
            other = *springls__surface_slot(job, place);
            brick->around[d] = other = other < job->bricks ? other : -1;
            if (other >= 0) job->contour.brick[other].around[26 - d] = i;
        }
    }
    for (i = all ? job->bricks : ctx->surface_region; i < job->bricks; i++) springls__find_margin(job, job->contour.brick + i);
    return SPRINGLS_OK;
}

/* ---- the springls of the table ---- */

/* Lists the springls in the brick at a place. */
SPRINGLS__FN void springls__list_springls_of(springls__surface_job *job, const int place[3])
{
    const springls__model *model = &job->ctx->model;
    const int slot = springls__slot_of_brick_place(&model->grid, place);
    const uint32_t *cell;
    uint32_t at;
    if (slot < SPRINGLS__FIRST_SLOT) return;
    cell = springls__cells_of(&model->grid, slot);
    for (at = cell[0]; at < cell[SPRINGLS__CELLS - 1]; at++) job->springl[job->springls++] = (int)model->cells.ids[at];
}

/* Lists the springls that the table is made from: all, or those in its bricks and in the bricks around, which may crease them. */
SPRINGLS__FN springls_status springls__list_surface_springls(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    const int count = ctx->model.set.count, *places = (const int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    int i;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_SPRINGLS, (size_t)count, sizeof(int)));
    job->springl = (int *)ctx->surface_memory[SPRINGLS__SURFACE_SPRINGLS].data;
    if (ctx->surface_region != SPRINGLS__SURFACE_OF_ALL)
        for (i = 0; i < job->places; i++) springls__list_springls_of(job, places + 3 * (size_t)i);
    else
        for (i = 0; i < count; i++) job->springl[job->springls++] = i;
    return SPRINGLS_OK;
}

/* ---- hits ---- */

/* Makes the surfels of springls. */
SPRINGLS__FN void springls__surfel_work(void *arg, int begin, int end, float *memory)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    const springls__model *model = &job->ctx->model;
    int place[3], k;
    (void)memory;
    for (; begin < end; begin++) {
        const springls__springl s = model->set.s[job->springl[begin]];
        springls__surfel *surfel = job->surfel + job->springl[begin];
        surfel->p = s.p;
        surfel->n = springls__springl_normal(s);
        springls__voxel_of_place(&model->grid, surfel->p, place);
        for (k = 0; k < 3; k++) place[k] >>= 3;
        surfel->home = *springls__surface_slot(job, place);
        if (surfel->home >= job->bricks || (surfel->home >= 0 && !springls__is_near_region(job->contour.brick + surfel->home, s.p)))
            surfel->home = -1;
        surfel->creased = 0;
    }
}

SPRINGLS__FN void springls__count_hits_work(void *arg, int begin, int end, float *memory)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    (void)memory;
    for (; begin < end; begin++)
        job->first_found[begin] = springls__most_hits(&job->ctx->model, &job->contour, job->springl[begin]);
}

/* Finds the hits of springls, and where those of the next one begin at most. */
SPRINGLS__FN void springls__find_hits_work(void *arg, int begin, int end, float *memory)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    springls__surface_work *work = (springls__surface_work *)(void *)memory;
    for (; begin < end; begin++) {
        springls__row_hit *found = job->found + job->first_found[begin];
        const int count = springls__springl_hits(&job->ctx->model, &job->contour, job->springl[begin], &work->trims, found);
        if (job->first_found[begin] + count < job->first_found[begin + 1]) found[count].row = -1; /* that is the end */
    }
}

/* Fails when a count does not fit an int. */
SPRINGLS__FN springls_status springls__surface_fits(springls_context *ctx, int64_t count)
{
    return count > INT32_MAX / 8 ? springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a mesh has too many triangles") : SPRINGLS_OK;
}

/* Returns how many crossings or arcs a row has. */
SPRINGLS__FN int springls__count_of_row(const springls__surface_brick *brick, int of, int row)
{
    uint64_t counts; /* eight, whose sum the product has in its highest byte */
    memcpy(&counts, (of == SPRINGLS__OF_CROSSINGS ? brick->crossings : brick->arcs) + 8 * row, sizeof counts);
    return (int)(counts * 0x0101010101010101u >> 56);
}

/* Finds where the contents of all rows begin, and makes room for them in a buffer; begin: how many hits each row has. total: their sum. */
SPRINGLS__FN springls_status springls__begin_rows(springls__surface_job *job, int of, int buffer, size_t element, int *total)
{
    int64_t sum = 0;
    int b, row;
    for (b = 0; b < job->bricks; b++) {
        int *begin = job->contour.brick[b].begin[of];
        for (row = 0; row < SPRINGLS__TABLE_ROWS; row++) {
            const int count = of == SPRINGLS__OF_HITS ? begin[row] : springls__count_of_row(job->contour.brick + b, of, row);
            begin[row] = (int)sum;
            sum += count;
        }
        begin[SPRINGLS__TABLE_ROWS] = (int)sum;
        SPRINGLS__TRY(springls__surface_fits(job->ctx, sum));
    }
    *total = (int)sum;
    return springls__reserve_table(job->ctx, buffer, (size_t)sum, element);
}

/* Finds where the hits of springls begin, as they were counted, and makes room for them. */
SPRINGLS__FN springls_status springls__begin_hits(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    const int count = job->springls;
    int64_t sum = 0;
    int i;
    for (i = 0; i < count; i++) {
        const int hits = job->first_found[i];
        job->first_found[i] = (int)sum;
        sum += hits;
        SPRINGLS__TRY(springls__surface_fits(ctx, sum));
    }
    job->first_found[count] = (int)sum;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_FOUND, (size_t)sum, sizeof(springls__row_hit)));
    job->found = (springls__row_hit *)ctx->surface_memory[SPRINGLS__SURFACE_FOUND].data;
    return SPRINGLS_OK;
}

/* Returns the k-th hit that the i-th springl has found, NULL at the end. */
SPRINGLS__FN const springls__row_hit *springls__found_hit(const springls__surface_job *job, int i, int k)
{
    const springls__row_hit *hit = job->found + job->first_found[i] + k;
    return job->first_found[i] + k < job->first_found[i + 1] && hit->row >= 0 ? hit : NULL;
}

/* Notes which bricks have no hits around them. */
SPRINGLS__FN void springls__find_quiet_bricks(springls__surface_job *job)
{
    int b, k;
    for (b = 0; b < job->bricks; b++) {
        springls__surface_brick *brick = job->contour.brick + b;
        brick->quiet = 1;
        for (k = 0; k < 27; k++) {
            const springls__surface_brick *other = job->contour.brick + brick->around[k];
            if (brick->around[k] >= 0 && other->begin[SPRINGLS__OF_HITS][0] != other->begin[SPRINGLS__OF_HITS][SPRINGLS__TABLE_ROWS])
                brick->quiet = 0;
        }
    }
}

/* Puts the hits of all springls into rows. */
SPRINGLS__FN springls_status springls__put_hits(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    const springls__row_hit *hit;
    int i, b, k, hits;
    for (i = 0; i < job->springls; i++)
        for (k = 0; (hit = springls__found_hit(job, i, k)) != NULL; k++)
            job->contour.brick[hit->row / SPRINGLS__TABLE_ROWS].begin[SPRINGLS__OF_HITS][hit->row % SPRINGLS__TABLE_ROWS]++;
    SPRINGLS__TRY(springls__begin_rows(job, SPRINGLS__OF_HITS, SPRINGLS__SURFACE_HIT, sizeof(springls__hit), &hits));
    job->contour.hit = (springls__hit *)ctx->surface_memory[SPRINGLS__SURFACE_HIT].data;
    springls__find_quiet_bricks(job);
    for (b = 0; b < job->bricks; b++) { /* begin[row + 1]: where the next hit goes */
        int *begin = job->contour.brick[b].begin[SPRINGLS__OF_HITS];
        memmove(begin + 1, begin, SPRINGLS__TABLE_ROWS * sizeof *begin);
    }
    for (i = 0; i < job->springls; i++)
        for (k = 0; (hit = springls__found_hit(job, i, k)) != NULL; k++) springls__put_hit(&job->contour, *hit);
    return SPRINGLS_OK;
}

/* Makes room for all crossings. Their vertices have the first numbers; of those some are not used. */
SPRINGLS__FN springls_status springls__reserve_crossings(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    SPRINGLS__TRY(springls__begin_rows(job, SPRINGLS__OF_CROSSINGS, SPRINGLS__SURFACE_CROSSING, sizeof(springls__crossing),
                                       &job->contour.first_corner));
    job->contour.crossing = (springls__crossing *)ctx->surface_memory[SPRINGLS__SURFACE_CROSSING].data;
    return SPRINGLS_OK;
}

/* Makes room for all arcs. */
SPRINGLS__FN springls_status springls__reserve_arcs(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    int arcs;
    SPRINGLS__TRY(springls__begin_rows(job, SPRINGLS__OF_ARCS, SPRINGLS__SURFACE_ARC, sizeof(springls__arc), &arcs));
    job->contour.first_inner = job->contour.first_corner + 2 * arcs;
    job->contour.arc = (springls__arc *)ctx->surface_memory[SPRINGLS__SURFACE_ARC].data;
    return SPRINGLS_OK;
}

/* Makes room for triangles, and for vertices in cells. */
SPRINGLS__FN springls_status springls__reserve_triangles(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    int64_t sum = 0;
    int b;
    for (b = 0; b < job->bricks; b++) {
        job->contour.brick[b].first_triangle = 6 * (int)sum;
        job->contour.brick[b].first_inner = 3 * (int)sum;
        sum += job->contour.brick[b].links;
        SPRINGLS__TRY(springls__surface_fits(ctx, 6 * sum));
    }
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_TRIANGLE, 18 * (size_t)sum, sizeof(int)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_INNER, 3 * (size_t)sum, sizeof(springls__crossing)));
    job->contour.corners = (int *)ctx->surface_memory[SPRINGLS__SURFACE_TRIANGLE].data;
    job->contour.inner = (springls__crossing *)ctx->surface_memory[SPRINGLS__SURFACE_INNER].data;
    return SPRINGLS_OK;
}

/* ---- cells whose triangles cross ---- */

/* The nearest two crossings of one edge that have been found, and where the row of the edge is. */
typedef struct springls__near_pair { float gap; int brick, row, edge, crossing; } springls__near_pair;

/* Looks for a nearer pair on an edge along an axis that begins at a node, which may be up to 8 beyond a brick's own. */
SPRINGLS__FN springls__near_pair springls__nearer_pair(const springls__surface_job *job, const springls__surface_brick *brick,
                                                       const int at[3], int axis, springls__near_pair best)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    const springls__owned owned = springls__crossings_of_edge(&job->contour, brick, at, axis);
    int k, node;
    for (k = owned.first; k + 1 < owned.first + owned.count; k++) {
        const springls__crossing *pair = job->contour.crossing + k;
        const float gap = springls__along(pair[1].x, axis) - springls__along(pair[0].x, axis);
        if (gap >= best.gap) continue;
        best.gap = gap;
        best.crossing = k;
        best.brick = springls__table_node(brick, at, &node);
        best.row = 64 * axis + (at[b] & 7) + 8 * (at[c] & 7);
        best.edge = 8 * best.row + (at[axis] & 7);
    }
    return best;
}

/* Takes the nearest two crossings of one edge of a cell away. Returns whether there were any. */
SPRINGLS__FN bool springls__thin_cell(const springls__surface_job *job, const springls__surface_brick *brick, int cell)
{
    springls__near_pair best = { FLT_MAX, -1, 0, 0, 0 };
    springls__surface_brick *owner;
    springls__crossing *crossing = job->contour.crossing;
    int axis, side, end, at[3];
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 4; side++) {
            springls__node_of_brick(cell, at);
            at[springls__axis_after(axis)] += side & 1;
            at[springls__axis_after(springls__axis_after(axis))] += side >> 1;
            best = springls__nearer_pair(job, brick, at, axis, best);
        }
    if (best.brick < 0) return false;
    owner = job->contour.brick + best.brick;
    end = owner->begin[SPRINGLS__OF_CROSSINGS][best.row] + springls__count_of_row(owner, SPRINGLS__OF_CROSSINGS, best.row);
    memmove(crossing + best.crossing, crossing + best.crossing + 2, (size_t)(end - best.crossing - 2) * sizeof *crossing);
    owner->crossings[best.edge] = (uint8_t)(owner->crossings[best.edge] - 2);
    return true;
}

/* Simplifies the cells in which triangles cross: their faces get no more corners than they need, then they lose pairs of crossings.
   Counts those cells (springls__found_some): arcs and patches are to be made again in the bricks around them. */
SPRINGLS__FN springls_status springls__simplify_cells(springls_context *ctx)
{
    const springls__surface_job *job = springls__surface_job_of(ctx);
    int b, w, d;
    ctx->work.found = 0;
    for (b = 0; b < job->bricks; b++) job->contour.brick[b].ready = 1;
    for (b = 0; b < job->bricks; b++) {
        springls__surface_brick *brick = job->contour.brick + b;
        for (w = 0; w < 16; w++) {
            uint32_t conflicts = brick->conflict[w];
            for (; conflicts; conflicts &= conflicts - 1u) {
                const int node = 32 * w + springls__lowest_bit(conflicts);
                if (brick->plain[node] && !springls__thin_cell(job, brick, node)) continue;
                brick->plain[node] = 1;
                ctx->work.found++;
                for (d = 0; d < 27; d++)
                    if (brick->around[d] >= 0) job->contour.brick[brick->around[d]].ready = 0;
            }
        }
    }
    return SPRINGLS_OK;
}

/* ---- the mesh ---- */

/* Holds a welded mesh, positions in voxels. Its arrays are scratch memory of the model. normals, springls: of a mesh of springls; else
   NULL. */
typedef struct springls__raw_mesh {
    springls__v3 *positions, *normals;
    int *springls, *triangles, vertex_count, triangle_count;
} springls__raw_mesh;

/* Returns a vertex by its number in the table. */
SPRINGLS__FN springls__crossing springls__surface_vertex(const springls__surface_job *job, int number)
{
    const springls__contour *contour = &job->contour;
    springls__crossing v;
    const springls__arc *arc;
    int k;
    if (number < contour->first_corner) return contour->crossing[number];
    if (number >= contour->first_inner) return contour->inner[number - contour->first_inner];
    arc = contour->arc + (number - contour->first_corner) / 2;
    k = (number - contour->first_corner) % 2;
    v.x = arc->corner[k];
    v.n = springls__add(k == 0 ? contour->crossing[arc->from].n : arc->rim,
                        k == arc->corners - 1 ? contour->crossing[arc->to].n : arc->rim);
    v.side = 0;
    v.springl = contour->crossing[k == 0 ? arc->from : arc->to].springl;
    return v;
}

/* Finds the arrays of the mesh that is kept. */
SPRINGLS__FN void springls__use_surface_mesh(const springls_context *ctx, springls__raw_mesh *mesh)
{
    mesh->positions = (springls__v3 *)ctx->surface_memory[SPRINGLS__SURFACE_MESH_POSITION].data;
    mesh->normals = (springls__v3 *)ctx->surface_memory[SPRINGLS__SURFACE_MESH_NORMAL].data;
    mesh->springls = (int *)ctx->surface_memory[SPRINGLS__SURFACE_MESH_SPRINGL].data;
    mesh->triangles = (int *)ctx->surface_memory[SPRINGLS__SURFACE_MESH_CORNER].data;
}

/* Gathers the triangles of all bricks, and the vertices that they use in the order of their numbers. */
SPRINGLS__FN springls_status springls__surface_gather(springls__surface_job *job, springls__raw_mesh *mesh)
{
    springls_context *ctx = job->ctx;
    const springls__surface_brick *last = job->contour.brick + job->bricks - 1;
    const int numbers = job->contour.first_inner + last->first_inner + 3 * last->links;
    int *rank, b, k, at = 0;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_RANK, (size_t)numbers, sizeof(int)));
    rank = (int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    memset(rank, 0, (size_t)numbers * sizeof *rank);
    for (b = 0; b < job->bricks; b++) {
        const springls__surface_brick *brick = job->contour.brick + b;
        for (k = 0; k < 3 * brick->triangles; k++) rank[job->contour.corners[3 * (size_t)brick->first_triangle + (size_t)k]] = 1;
        mesh->triangle_count += brick->triangles;
    }
    for (k = 0; k < numbers; k++) rank[k] = rank[k] ? ++mesh->vertex_count : 0;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_MESH_POSITION, (size_t)mesh->vertex_count, sizeof(springls__v3)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_MESH_NORMAL, (size_t)mesh->vertex_count, sizeof(springls__v3)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_MESH_SPRINGL, (size_t)mesh->vertex_count, sizeof(int)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_MESH_CORNER, 3 * (size_t)mesh->triangle_count, sizeof(int)));
    springls__use_surface_mesh(ctx, mesh);
    for (k = 0; k < numbers; k++) {
        springls__crossing v;
        if (rank[k] == 0) continue;
        v = springls__surface_vertex(job, k);
        mesh->positions[rank[k] - 1] = v.x;
        mesh->normals[rank[k] - 1] = v.n;
        mesh->springls[rank[k] - 1] = v.springl;
    }
    for (b = 0; b < job->bricks; b++) {
        const springls__surface_brick *brick = job->contour.brick + b;
        const int *corner = job->contour.corners + 3 * (size_t)brick->first_triangle;
        for (k = 0; k < 3 * brick->triangles; k++) mesh->triangles[at++] = rank[corner[k]] - 1;
    }
    return SPRINGLS_OK;
}

/* Normalises the normals of vertices: where springls give none, as where a change of side is all that is known, the gradient of phi
   is it; where phi has none either, the areas of the triangles around. */
SPRINGLS__FN void springls__surface_normals(const springls__grid *g, springls__raw_mesh *mesh)
{
    int t, k;
    for (k = 0; k < mesh->vertex_count; k++) {
        springls__v3 *n = &mesh->normals[k];
        *n = springls__normalize(*n);
        if (springls__length2(*n) < 0.5f) *n = springls__normalize(springls__grid_gradient(g, g->phi, mesh->positions[k]));
    }
    for (t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangles + 3 * (size_t)t;
        springls__tri tri;
        springls__v3 area;
        tri.a = mesh->positions[corner[0]];
        tri.b = mesh->positions[corner[1]];
        tri.c = mesh->positions[corner[2]];
        area = springls__scale(springls__tri_area2(tri), 1e-4f); /* beside a unit normal it is nothing */
        for (k = 0; k < 3; k++)
            if (springls__length2(mesh->normals[corner[k]]) < 0.5f)
                mesh->normals[corner[k]] = springls__add(mesh->normals[corner[k]], area);
    }
    for (k = 0; k < mesh->vertex_count; k++) mesh->normals[k] = springls__normalize(mesh->normals[k]);
}

/* ---- the order of the kernels ---- */

/* Leaves a table of no bricks. */
SPRINGLS__FN void springls__forget_surface(springls_context *ctx)
{
    ctx->surface_version = 0;
    ctx->surface_bricks = ctx->surface_vertices = ctx->surface_triangles = 0;
}

/* Begins the table: its bricks, and what is known of each springl. */
SPRINGLS__FN springls_status springls__surface_begin(springls_context *ctx)
{
    springls__surface_job *job;
    springls__forget_surface(ctx);
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_JOB, 1, sizeof *job));
    job = springls__surface_job_of(ctx);
    memset(job, 0, sizeof *job);
    job->ctx = ctx;
    SPRINGLS__TRY(springls__surface_bricks(job));
    SPRINGLS__TRY(springls__list_surface_springls(job));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_SURFEL, (size_t)ctx->model.set.count, sizeof(springls__surfel)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_FIRST_FOUND, (size_t)job->springls + 1, sizeof(int)));
    job->contour.surfel = job->surfel = (springls__surfel *)ctx->surface_memory[SPRINGLS__SURFACE_SURFEL].data;
    job->first_found = (int *)ctx->surface_memory[SPRINGLS__SURFACE_FIRST_FOUND].data;
    springls__loop_over(ctx, job->springls, 1024, 0, springls__surfel_work, job);
    return SPRINGLS_OK;
}

/* Ends the table: its mesh is kept until the model changes. */
SPRINGLS__FN springls_status springls__surface_end(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    springls__raw_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    if (job->bricks > 0) SPRINGLS__TRY(springls__surface_gather(job, &mesh));
    springls__surface_normals(&ctx->model.grid, &mesh);
    ctx->surface_bricks = job->bricks;
    ctx->surface_vertices = mesh.vertex_count;
    ctx->surface_triangles = mesh.triangle_count;
    if (ctx->surface_region == SPRINGLS__SURFACE_OF_ALL) ctx->surface_version = ctx->model_version;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__surface_of_all(springls_context *ctx)
{
    ctx->surface_region = SPRINGLS__SURFACE_OF_ALL;
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__surface_has_bricks(const springls_context *ctx) { return springls__surface_job_of(ctx)->bricks > 0; }

SPRINGLS__FN bool springls__surface_is_stale(const springls_context *ctx) { return ctx->surface_version != ctx->model_version; }

SPRINGLS__FN springls_status springls__find_creases(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    springls__loop_over(ctx, job->bricks + ctx->model.cells.unbinned_count, 8, 0, springls__crease_work, job);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__count_hits(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    springls__loop_over(ctx, job->springls, 256, 0, springls__count_hits_work, job);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__find_hits(springls_context *ctx)
{
    springls__surface_job *job = springls__surface_job_of(ctx);
    SPRINGLS__TRY(springls__begin_hits(job));
    return springls__surface_loop(ctx, job->springls, 64, springls__find_hits_work);
}

SPRINGLS__FN springls_status springls__sort_all_hits(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_SORT_HITS);
}

SPRINGLS__FN springls_status springls__weigh_all_hits(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_WEIGH_HITS);
}

SPRINGLS__FN springls_status springls__find_sides_of_nodes(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_FIND_SIDES);
}

SPRINGLS__FN springls_status springls__count_all_crossings(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_COUNT_CROSSINGS);
}

SPRINGLS__FN springls_status springls__find_all_crossings(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_FIND_CROSSINGS);
}

SPRINGLS__FN springls_status springls__count_all_arcs(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_COUNT_ARCS);
}

SPRINGLS__FN springls_status springls__find_all_arcs(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_FIND_ARCS);
}

SPRINGLS__FN springls_status springls__count_all_links(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_COUNT_LINKS);
}

SPRINGLS__FN springls_status springls__find_all_patches(springls_context *ctx)
{
    return springls__surface_run(ctx, SPRINGLS__SURFACE_FIND_PATCHES);
}

/* Arcs, links and patches are made from what was found before them, until no triangles of a cell cross. */
static const springls__entry springls__surface_kernels[] = {
    SPRINGLS__DO(springls__surface_begin)
    SPRINGLS__IF(springls__surface_has_bricks)
        SPRINGLS__DO(springls__find_creases)
        SPRINGLS__DO(springls__count_hits)
        SPRINGLS__DO(springls__find_hits)
        SPRINGLS__DO(springls__put_hits)
        SPRINGLS__DO(springls__sort_all_hits)
        SPRINGLS__DO(springls__weigh_all_hits)
        SPRINGLS__DO(springls__find_sides_of_nodes)
        SPRINGLS__DO(springls__count_all_crossings)
        SPRINGLS__DO(springls__reserve_crossings)
        SPRINGLS__DO(springls__find_all_crossings)
        SPRINGLS__DO(springls__count_all_arcs)
        SPRINGLS__DO(springls__reserve_arcs)
        SPRINGLS__DO(springls__find_all_arcs)
        SPRINGLS__DO(springls__count_all_links)
        SPRINGLS__DO(springls__reserve_triangles)
        SPRINGLS__DO(springls__find_all_patches)
        SPRINGLS__DO(springls__simplify_cells)
        SPRINGLS__REPEAT_WHILE(springls__found_some)
            SPRINGLS__DO(springls__count_all_arcs)
            SPRINGLS__DO(springls__find_all_arcs)
            SPRINGLS__DO(springls__find_all_patches)
            SPRINGLS__DO(springls__simplify_cells)
        SPRINGLS__END
    SPRINGLS__END
    SPRINGLS__DO(springls__surface_end)
SPRINGLS__END };

static const springls__entry springls__surface_table[] = {
    SPRINGLS__DO(springls__surface_of_all)
    SPRINGLS__CALL(springls__surface_kernels)
SPRINGLS__END };

/* Makes the mesh of what springls hold where the model has changed since it was made last. The cell list must be fresh. */
SPRINGLS__FN springls_status springls__refresh_surface_mesh(springls_context *ctx)
{
    return springls__surface_is_stale(ctx) ? springls__run_table(ctx, springls__surface_table) : SPRINGLS_OK;
}

/* Returns a copy of the mesh of what springls hold, in scratch memory on the host. The cell list must be fresh. */
SPRINGLS__FN springls_status springls__contour_springls(springls_context *ctx, springls__raw_mesh *mesh)
{
    springls__raw_mesh kept;
    size_t vertices, corners;
    SPRINGLS__TRY(springls__refresh_surface_mesh(ctx));
    memset(mesh, 0, sizeof *mesh);
    vertices = (size_t)ctx->surface_vertices;
    corners = 3 * (size_t)ctx->surface_triangles;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_positions, vertices));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_corners, corners));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_gradient, vertices));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_springl, vertices));
    springls__use_surface_mesh(ctx, &kept);
    mesh->positions = springls__surface_positions(&ctx->model);
    mesh->normals = springls__vertex_gradient(&ctx->model);
    mesh->springls = springls__vertex_springl(&ctx->model);
    mesh->triangles = springls__surface_corners(&ctx->model);
    mesh->vertex_count = ctx->surface_vertices;
    mesh->triangle_count = ctx->surface_triangles;
    if (vertices == 0) return SPRINGLS_OK;
    memcpy(mesh->positions, kept.positions, vertices * sizeof *mesh->positions);
    memcpy(mesh->normals, kept.normals, vertices * sizeof *mesh->normals);
    memcpy(mesh->springls, kept.springls, vertices * sizeof *mesh->springls);
    memcpy(mesh->triangles, kept.triangles, corners * sizeof *mesh->triangles);
    return SPRINGLS_OK;
}

#endif
