/* surface_table.h - springl contouring (params.contouring): a closed mesh of what the springls hold, made brick by brick. crossings.h,
   faces.h and patches.h have the formulas; here are the list of bricks, the arrays and the order of the kernels:
   hits -> sides of nodes -> crossings of edges -> arcs on faces -> triangles in cells. */
#ifndef SPRINGLS__OUTPUT_SURFACE_TABLE_H
#define SPRINGLS__OUTPUT_SURFACE_TABLE_H

#include "../../kernels_embed/output/isosurface.h"
#include "../../kernels_embed/output/patches.h"
#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/memory.h"
#include "../runtime/parallel.h"
#include "../model/host_access.h"
#include "../solver/follow.h"

typedef enum springls__surface_kernel {
    SPRINGLS__SURFACE_COUNT_HITS,
    SPRINGLS__SURFACE_FIND_HITS,
    SPRINGLS__SURFACE_FIND_SIDES,
    SPRINGLS__SURFACE_COUNT_CROSSINGS,
    SPRINGLS__SURFACE_FIND_CROSSINGS,
    SPRINGLS__SURFACE_COUNT_ARCS,
    SPRINGLS__SURFACE_FIND_ARCS,
    SPRINGLS__SURFACE_COUNT_LINKS,
    SPRINGLS__SURFACE_FIND_PATCHES
} springls__surface_kernel;

/* The table while it is made. */
typedef struct springls__surface_job {
    springls_context *ctx;
    springls__contour contour;
    springls__v3 *normal;
    uint8_t *creased;
    springls__surface_kernel kernel;
    int bricks;
} springls__surface_job;

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
        case SPRINGLS__SURFACE_COUNT_HITS: springls__brick_hits(model, contour, begin, false, &work->trims); break;
        case SPRINGLS__SURFACE_FIND_HITS: springls__brick_hits(model, contour, begin, true, &work->trims); break;
        case SPRINGLS__SURFACE_FIND_SIDES: springls__find_node_sides(model, contour, begin, &work->line); break;
        case SPRINGLS__SURFACE_COUNT_CROSSINGS: springls__find_crossings(model, contour, begin, false, &work->line); break;
        case SPRINGLS__SURFACE_FIND_CROSSINGS: springls__find_crossings(model, contour, begin, true, &work->line); break;
        case SPRINGLS__SURFACE_COUNT_ARCS: springls__count_arcs(contour, begin, &work->face); break;
        case SPRINGLS__SURFACE_FIND_ARCS: springls__find_arcs(model, contour, begin, &work->face); break;
        case SPRINGLS__SURFACE_COUNT_LINKS: contour->brick[begin].links = springls__count_links(contour, begin, &work->cell); break;
        case SPRINGLS__SURFACE_FIND_PATCHES: springls__find_patches(contour, begin, &work->cell); break;
        }
    }
}

SPRINGLS__FN springls_status springls__surface_run(springls__surface_job *job, springls__surface_kernel kernel)
{
    const size_t floats = sizeof(springls__surface_work) / sizeof(float) + 1;
    SPRINGLS__TRY(springls__reserve_lanes(job->ctx, floats, job->bricks));
    job->kernel = kernel;
    springls__do_work(job->ctx, springls__surface_brick_task, job, floats, 0, job->bricks, 1);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__surface_normal_task(void *arg, int begin, int end)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    for (; begin < end; begin++) job->normal[begin] = springls__springl_normal(job->ctx->model.set.s[begin]);
}

SPRINGLS__FN void springls__surface_crease_task(void *arg, int begin, int end)
{
    const springls__surface_job *job = (const springls__surface_job *)arg;
    for (; begin < end; begin++) job->creased[begin] = springls__is_creased(&job->ctx->model, job->normal, begin);
}

/* ---- the list of bricks: those active and all around them, also beyond the border of the domain ---- */

/* Finds brick `place` in the table, or where it is to go. Places begin at -1. */
SPRINGLS__FN int *springls__surface_slot(const springls__surface_job *job, size_t size, const int place[3])
{
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

/* Makes the bricks of the table, without contents. */
SPRINGLS__FN springls_status springls__surface_bricks(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    const springls__grid *g = &ctx->model.grid;
    const size_t most = 27 * (size_t)g->active_count, size = springls__table_size(most);
    int i, d, k, place[3], center[3], *places, *table;
    size_t slot;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_HASH, size, sizeof(int)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_RANK, 3 * most, sizeof(int)));
    table = (int *)ctx->surface_memory[SPRINGLS__SURFACE_HASH].data;
    places = (int *)ctx->surface_memory[SPRINGLS__SURFACE_RANK].data;
    for (slot = 0; slot < size; slot++) table[slot] = -1;
    for (i = 0; i < g->active_count; i++) {
        springls__brick_place(g, g->slot_brick[g->active[i]], center);
        for (d = 0; d < 27; d++) {
            int *at;
            springls__place_around(center, d, place);
            at = springls__surface_slot(job, size, place);
            if (*at >= 0) continue;
            *at = job->bricks;
            memcpy(places + 3 * (size_t)job->bricks++, place, sizeof place);
        }
    }
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_BRICK_LIST, (size_t)job->bricks, sizeof(springls__surface_brick)));
    job->contour.brick = (springls__surface_brick *)ctx->surface_memory[SPRINGLS__SURFACE_BRICK_LIST].data;
    memset(job->contour.brick, 0, (size_t)job->bricks * sizeof(springls__surface_brick));
    for (i = 0; i < job->bricks; i++) {
        springls__surface_brick *brick = job->contour.brick + i;
        for (k = 0; k < 3; k++) brick->origin[k] = SPRINGLS__BRICK * places[3 * i + k];
        for (d = 0; d < 27; d++) {
            springls__place_around(places + 3 * (size_t)i, d, place);
            brick->around[d] = *springls__surface_slot(job, size, place);
        }
    }
    return SPRINGLS_OK;
}

/* ---- sums between kernels ---- */

/* Fails when a count does not fit an int. */
SPRINGLS__FN springls_status springls__surface_fits(springls_context *ctx, int64_t count)
{
    return count > INT32_MAX / 8 ? springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a mesh has too many triangles") : SPRINGLS_OK;
}

/* Finds all hits. */
SPRINGLS__FN springls_status springls__surface_hits(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    uint64_t sum = 0;
    int b, k;
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_COUNT_HITS));
    for (b = 0; b < job->bricks; b++) {
        springls__surface_brick *brick = job->contour.brick + b;
        brick->quiet = 1;
        for (k = 0; k < 27; k++)
            if (brick->around[k] >= 0 && job->contour.brick[brick->around[k]].hit) brick->quiet = 0;
    }
    for (b = 0; b < job->bricks; b++) {
        springls__surface_brick *brick = job->contour.brick + b;
        uint32_t begin = 0;
        brick->first_hit = (uint32_t)sum;
        for (k = 0; k < 192; k++) {
            brick->line_begin[k] = begin;
            begin += brick->line_end[k];
            brick->line_end[k] = brick->line_begin[k];
        }
        sum += begin;
        SPRINGLS__TRY(springls__surface_fits(ctx, (int64_t)sum));
    }
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_HIT, (size_t)sum, sizeof(springls__hit)));
    job->contour.hit = (springls__hit *)ctx->surface_memory[SPRINGLS__SURFACE_HIT].data;
    return springls__surface_run(job, SPRINGLS__SURFACE_FIND_HITS);
}

/* Finds all crossings; their number is that of the first vertex that is none. */
SPRINGLS__FN springls_status springls__surface_crossings(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    int64_t sum = 0;
    int b;
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_FIND_SIDES));
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_COUNT_CROSSINGS));
    for (b = 0; b < job->bricks; b++) {
        job->contour.brick[b].first_crossing = (int)sum;
        sum += job->contour.brick[b].edge_end[1535];
        SPRINGLS__TRY(springls__surface_fits(ctx, sum));
    }
    job->contour.first_corner = (int)sum;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_CROSSING, (size_t)sum, sizeof(springls__crossing)));
    job->contour.crossing = (springls__crossing *)ctx->surface_memory[SPRINGLS__SURFACE_CROSSING].data;
    return springls__surface_run(job, SPRINGLS__SURFACE_FIND_CROSSINGS);
}

/* Finds all arcs, and makes room for triangles. */
SPRINGLS__FN springls_status springls__surface_arcs(springls__surface_job *job)
{
    springls_context *ctx = job->ctx;
    int64_t sum = 0;
    int b;
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_COUNT_ARCS));
    for (b = 0; b < job->bricks; b++) {
        job->contour.brick[b].first_arc = (int)sum;
        sum += job->contour.brick[b].face_end[1535];
        SPRINGLS__TRY(springls__surface_fits(ctx, sum));
    }
    job->contour.first_inner = job->contour.first_corner + 2 * (int)sum;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_ARC, (size_t)sum, sizeof(springls__arc)));
    job->contour.arc = (springls__arc *)ctx->surface_memory[SPRINGLS__SURFACE_ARC].data;
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_FIND_ARCS));
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_COUNT_LINKS));
    for (b = 0, sum = 0; b < job->bricks; b++) {
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

/* Takes crossing k of an edge of a brick, and the next one, away. */
SPRINGLS__FN void springls__remove_pair(const springls__surface_job *job, springls__surface_brick *brick, int edge, int k)
{
    springls__crossing *crossing = job->contour.crossing + brick->first_crossing;
    int e;
    memmove(crossing + k, crossing + k + 2, (size_t)(brick->edge_end[1535] - k - 2) * sizeof *crossing);
    for (e = edge; e < 1536; e++) brick->edge_end[e] -= 2;
}

/* Takes the nearest two crossings of one edge of a cell away. Returns whether there were any. */
SPRINGLS__FN bool springls__thin_cell(const springls__surface_job *job, const springls__surface_brick *brick, int node)
{
    springls__surface_brick *best_brick = NULL;
    float least = FLT_MAX;
    int axis, side, k, best = 0, best_edge = 0, at[3];
    for (axis = 0; axis < 3; axis++)
        for (side = 0; side < 4; side++) {
            int other, edge, begin;
            springls__surface_brick *owner;
            springls__node_of_brick(node, at);
            at[springls__axis_after(axis)] += side & 1;
            at[springls__axis_after(springls__axis_after(axis))] += side >> 1;
            other = springls__table_node(brick, at, &edge);
            if (other < 0) continue;
            owner = job->contour.brick + other;
            edge = 3 * edge + axis;
            begin = edge ? owner->edge_end[edge - 1] : 0;
            for (k = begin; k + 1 < owner->edge_end[edge]; k++) {
                const springls__crossing *pair = job->contour.crossing + owner->first_crossing + k;
                const float gap = springls__along(pair[1].x, axis) - springls__along(pair[0].x, axis);
                if (gap >= least) continue;
                least = gap;
                best_brick = owner;
                best_edge = edge;
                best = k;
            }
        }
    if (best_brick) springls__remove_pair(job, best_brick, best_edge, best);
    return best_brick != NULL;
}

/* Makes the cells simpler in which triangles cross: their faces get no more corners than they need, then they lose pairs of crossings.
   Returns whether there is anything to do again. */
SPRINGLS__FN bool springls__simplify_cells(const springls__surface_job *job)
{
    bool some = false;
    int b, node, d;
    for (b = 0; b < job->bricks; b++) job->contour.brick[b].ready = 1;
    for (b = 0; b < job->bricks; b++) {
        springls__surface_brick *brick = job->contour.brick + b;
        for (node = 0; node < 512; node++) {
            if (!springls__bit_of(brick->conflict, node)) continue;
            if (brick->plain[node] && !springls__thin_cell(job, brick, node)) continue;
            brick->plain[node] = 1;
            some = true;
            for (d = 0; d < 27; d++)
                if (brick->around[d] >= 0) job->contour.brick[brick->around[d]].ready = 0;
        }
    }
    return some;
}

/* Finds all triangles. */
SPRINGLS__FN springls_status springls__surface_triangles(springls__surface_job *job)
{
    SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_FIND_PATCHES));
    while (springls__simplify_cells(job)) {
        SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_COUNT_ARCS));
        SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_FIND_ARCS));
        SPRINGLS__TRY(springls__surface_run(job, SPRINGLS__SURFACE_FIND_PATCHES));
    }
    return SPRINGLS_OK;
}

/* ---- the mesh ---- */

/* Holds a welded mesh, positions in voxels. Its arrays are scratch memory of the model. normals: of a mesh of springls; else NULL. */
typedef struct springls__raw_mesh {
    springls__v3 *positions, *normals;
    int *triangles, vertex_count, triangle_count;
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
    v.springl = -1;
    return v;
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
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_positions, mesh->vertex_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, surface_corners, 3 * (size_t)mesh->triangle_count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vertex_gradient, mesh->vertex_count));
    mesh->positions = springls__surface_positions(&ctx->model);
    mesh->triangles = springls__surface_corners(&ctx->model);
    mesh->normals = springls__vertex_gradient(&ctx->model);
    for (k = 0; k < numbers; k++) {
        springls__crossing v;
        if (rank[k] == 0) continue;
        v = springls__surface_vertex(job, k);
        mesh->positions[rank[k] - 1] = v.x;
        mesh->normals[rank[k] - 1] = v.n;
    }
    for (b = 0; b < job->bricks; b++) {
        const springls__surface_brick *brick = job->contour.brick + b;
        const int *corner = job->contour.corners + 3 * (size_t)brick->first_triangle;
        for (k = 0; k < 3 * brick->triangles; k++) mesh->triangles[at++] = rank[corner[k]] - 1;
    }
    return SPRINGLS_OK;
}

/* Adds the areas of triangles to the normals of vertices that have none, as where a change of side is all that is known. */
SPRINGLS__FN void springls__surface_normals(springls__raw_mesh *mesh)
{
    int t, k;
    for (k = 0; k < mesh->vertex_count; k++) mesh->normals[k] = springls__normalize(mesh->normals[k]);
    for (t = 0; t < mesh->triangle_count; t++) {
        const int *corner = mesh->triangles + 3 * (size_t)t;
        springls__tri tri;
        springls__v3 area;
        tri.a = mesh->positions[corner[0]];
        tri.b = mesh->positions[corner[1]];
        tri.c = mesh->positions[corner[2]];
        area = springls__scale(springls__tri_area2(tri), 1e-4f); /* beside a unit normal it is nothing */
        for (k = 0; k < 3; k++)
            if (springls__length2(mesh->normals[corner[k]]) < 0.5f) mesh->normals[corner[k]] = springls__add(mesh->normals[corner[k]], area);
    }
    for (k = 0; k < mesh->vertex_count; k++) mesh->normals[k] = springls__normalize(mesh->normals[k]);
}

/* Makes the mesh that the springls show, on the host. The cell list must be fresh. */
SPRINGLS__FN springls_status springls__contour_springls(springls_context *ctx, springls__raw_mesh *mesh)
{
    const int count = ctx->model.set.count;
    springls__surface_job job;
    memset(mesh, 0, sizeof *mesh);
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    if (ctx->model.grid.active_count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_NORMAL, (size_t)count, sizeof(springls__v3)));
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_CREASED, (size_t)count, 1));
    job.contour.normal = job.normal = (springls__v3 *)ctx->surface_memory[SPRINGLS__SURFACE_NORMAL].data;
    job.contour.creased = job.creased = (uint8_t *)ctx->surface_memory[SPRINGLS__SURFACE_CREASED].data;
    springls__parallel(ctx, count, 1024, springls__surface_normal_task, &job);
    springls__parallel(ctx, count, 256, springls__surface_crease_task, &job);
    SPRINGLS__TRY(springls__surface_bricks(&job));
    SPRINGLS__TRY(springls__surface_hits(&job));
    SPRINGLS__TRY(springls__surface_crossings(&job));
    SPRINGLS__TRY(springls__surface_arcs(&job));
    SPRINGLS__TRY(springls__surface_triangles(&job));
    SPRINGLS__TRY(springls__surface_gather(&job, mesh));
    springls__surface_normals(mesh);
    return SPRINGLS_OK;
}

/* Finds the correspondences and springls of the mesh's vertices, of springls that face the same way. */
SPRINGLS__FN void springls__surface_material_task(void *arg, int begin, int end)
{
    const springls__model *model = (const springls__model *)arg;
    for (; begin < end; begin++) {
        const springls__v3 x = springls__surface_positions(model)[begin], n = springls__vertex_gradient(model)[begin];
        const int nearest = springls__nearest_springl_facing(model, x, n, SPRINGLS__MATERIAL_RADIUS);
        springls__vertex_correspondence(model)[begin] = nearest < 0 ? x : springls__correspondence_at(model, nearest, x);
        springls__vertex_springl(model)[begin] = nearest;
    }
}

#endif
