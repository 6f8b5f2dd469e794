/* set_level_set.h - builds models from signed distances, level sets, labels and thresholds, and their initial springls. */
#ifndef SPRINGLS__INPUT_SET_LEVEL_SET_H
#define SPRINGLS__INPUT_SET_LEVEL_SET_H

#include "../runtime/finite.h"
#include "../../kernels_embed/stages/project.h"
#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/parallel.h"
#include "../runtime/resumable.h"
#include "../model/bvh.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../model/voxel_block.h"
#include "../stages/rebuild.h"
#include "initial_edges.h"

/* Returns the distance from x to the border of the domain, voxels, positive inside. The border is half a voxel beyond the
   outermost centers. */
SPRINGLS__FN float springls__border_distance(const springls__grid *g, springls__v3 x)
{
    float dx = springls__min(x.x + 0.5f, (float)g->size[0] - 0.5f - x.x);
    float dy = springls__min(x.y + 0.5f, (float)g->size[1] - 0.5f - x.y);
    float dz = springls__min(x.z + 0.5f, (float)g->size[2] - 0.5f - x.z);
    return springls__min(springls__min(dx, dy), dz);
}

/* Copies phi to the original level set: phi_ref = phi. */
SPRINGLS__FN springls_status springls__make_reference(springls_context *ctx)
{
    SPRINGLS__TRY(springls__use_host(ctx, true));
    ctx->reference_stamp = 0;
    springls__place_window(ctx, &ctx->original_window, ctx->window.offset);
    return springls__copy_to_reference(ctx, &ctx->model.grid);
}

/* Sets the original surface to the model: phi_ref = phi, and the triangles of the springls. The correspondences stay. */
SPRINGLS__FN springls_status springls__make_original(springls_context *ctx)
{
    SPRINGLS__TRY(springls__make_reference(ctx));
    return springls__surface_build(ctx, &ctx->original, ctx->model.set.s, ctx->model.set.count);
}

/* ---- from a signed distance, evaluated in the narrow band only ---- */

/* Computes the signed distance at `count` points, all in voxels, negative inside. Called from several threads at once. */
typedef void (*springls__distance_fn)(void *arg, const springls__v3 *points, int count, float *out);

typedef struct springls__distance_job {
    springls_context *ctx;
    springls__distance_fn fn;
    void *arg;
    const springls__surface *surface; /* NULL, or what is inside lies within `reach` of its bounds; voxels */
    float reach;
    springls__brick_box block; /* the bricks that are looked at                         */
    float *centers;    /* [brick of the block, x fastest] distance at its center        */
    int listed;        /* bricks near the surface                                       */
    const int *active; /* the slots that this call of springls__parallel fills          */
} springls__distance_job;

/* Evaluates the distance at the points, cut off at the border of the domain: outside of it nothing is inside. */
SPRINGLS__FN void springls__evaluate_distances(const springls__distance_job *job, const springls__v3 *points, int count,
                                               float *out)
{
    int i;
    (job->fn)(job->arg, points, count, out);
    for (i = 0; i < count; i++) /* keeps NaN */
        out[i] = springls__max(-springls__border_distance(&job->ctx->model.grid, points[i]), out[i]);
}

/* Finds the place in the domain of brick i of the block. */
SPRINGLS__FN void springls__place_in_block(const springls__brick_box *block, int i, int place[3])
{
    const int x = block->upper[0] - block->lower[0], y = block->upper[1] - block->lower[1];
    place[0] = block->lower[0] + i % x;
    place[1] = block->lower[1] + i / x % y;
    place[2] = block->lower[2] + i / (x * y);
}

/* Evaluates the distance at the centers of bricks of the block. */
SPRINGLS__FN void springls__center_task(void *arg, int begin, int end)
{
    const springls__distance_job *job = (const springls__distance_job *)arg;
    springls__v3 points[64];
    while (begin < end) {
        int count = springls__imin(64, end - begin), i;
        for (i = 0; i < count; i++) {
            int at[3];
            springls__place_in_block(&job->block, begin + i, at);
            points[i] = springls__v3_make((float)(8 * at[0]) + 3.5f, (float)(8 * at[1]) + 3.5f, (float)(8 * at[2]) + 3.5f);
        }
        springls__evaluate_distances(job, points, count, job->centers + begin);
        begin += count;
    }
}

/* Evaluates the distance at the voxels of bricks, clamped to the band's far value. */
SPRINGLS__FN void springls__voxel_task(void *arg, int begin, int end)
{
    const springls__distance_job *job = (const springls__distance_job *)arg;
    const springls__grid *g = &job->ctx->model.grid;
    springls__v3 points[SPRINGLS__BRICK_VOXELS];
    for (; begin < end; begin++) {
        float *phi = g->phi + (size_t)job->active[begin] * SPRINGLS__BRICK_VOXELS;
        int o[3], v;
        springls__slot_origin(g, job->active[begin], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) points[v] = springls__voxel_place(o, v);
        springls__evaluate_distances(job, points, SPRINGLS__BRICK_VOXELS, phi);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
            if (phi[v] == phi[v])
                phi[v] = springls__outside_on_surface(springls__clamp(phi[v], -g->far_value, g->far_value));
    }
}

enum { SPRINGLS__DISTANCE_BLOCK = 32 }; /* bricks along a side of a block */

/* Returns whether a block is near to the bounds of the surface. */
SPRINGLS__FN bool springls__block_is_near(const springls__distance_job *job)
{
    const springls__bvh_node *bounds = &job->surface->nodes[0];
    int axis;
    for (axis = 0; axis < 3; axis++)
        if ((float)(SPRINGLS__BRICK * job->block.lower[axis]) > bounds->upper[axis] + job->reach
            || (float)(SPRINGLS__BRICK * job->block.upper[axis]) < bounds->lower[axis] - job->reach) return false;
    return true;
}

/* Returns false if all of a block is outside and far from the surface: by the distance at its center, where that is a distance
   everywhere. */
SPRINGLS__FN bool springls__may_have_surface(const springls__distance_job *job)
{
    const float half_diagonal = 0.8661f * (float)(SPRINGLS__BRICK * SPRINGLS__DISTANCE_BLOCK); /* rounded up */
    const springls__brick_box *block = &job->block;
    springls__v3 center = springls__v3_make(4.0f * (float)(block->lower[0] + block->upper[0]) - 0.5f,
                                            4.0f * (float)(block->lower[1] + block->upper[1]) - 0.5f,
                                            4.0f * (float)(block->lower[2] + block->upper[2]) - 0.5f);
    float d;
    if (job->surface) return springls__block_is_near(job);
    springls__evaluate_distances(job, &center, 1, &d);
    return !(d > half_diagonal + job->ctx->model.grid.far_value);
}

/* Evaluates the distance at the centers of the bricks of the block; adds to brick_list those so near to the surface that the band
   may pass through them, and makes the rest inside or outside. */
SPRINGLS__FN springls_status springls__look_at_block(springls_context *ctx, springls__distance_job *job)
{
    springls__grid *g = &ctx->model.grid;
    const float half_diagonal = 6.1f; /* of a brick, voxels, rounded up */
    const float near_band = ctx->model.params.band_half_width + 1.0f + half_diagonal;
    springls__brick_groups inside = springls__no_groups();
    int count = 1, place[3], i, brick;
    for (i = 0; i < 3; i++) count *= job->block.upper[i] - job->block.lower[i];
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_centers, count));
    SPRINGLS__TRY(springls__array_grow(ctx, SPRINGLS__ROLE_ARRAY(brick_list), (size_t)(job->listed + count), sizeof(int),
                                       (size_t)job->listed));
    job->centers = springls__brick_centers(&ctx->model);
    springls__parallel(ctx, count, 512, springls__center_task, job);
    for (i = 0; i < count; i++) {
        float d = job->centers[i];
        springls__place_in_block(&job->block, i, place);
        brick = springls__brick_at(g, 8 * place[0], 8 * place[1], 8 * place[2]);
        if (springls__is_nan_float(d)) return springls__fail(ctx, SPRINGLS_NON_FINITE, "the signed distance is NaN at brick %d", brick);
        if (d < 0.0f) springls__keep_box(g, &inside, place, place, 0);
        if (springls__fabs(d) <= near_band) springls__brick_list(&ctx->model)[job->listed++] = brick;
    }
    SPRINGLS__TRY(springls__table_cover(ctx, inside));
    for (i = 0; i < count; i++) {
        springls__place_in_block(&job->block, i, place);
        if (job->centers[i] < 0.0f) g->top[springls__entry_at(g, 8 * place[0], 8 * place[1], 8 * place[2])] = SPRINGLS__INSIDE;
    }
    return SPRINGLS_OK;
}

/* ---- bricks that only a bound keeps: a lower bound that is cut short says at the center of a brick no more than that the surface is
   not within it. So it is evaluated at the centers of cells of 4^3 and then of 2^3 voxels, where the surface may pass through the cell.
   The bricks stay that the band about such a cell meets. Of exact distances all bricks stay that have a voxel in the band. ---- */

/* Returns the mask of the bricks around a brick (springls__brick_around) that come within `reach` of a place; at: from its first voxel. */
SPRINGLS__FN uint32_t springls__bricks_within(const float at[3], float reach)
{
    uint32_t mask = 0u;
    int d;
    for (d = 0; d < 27; d++) {
        const int step[3] = { d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1 };
        bool meets = true;
        int k;
        for (k = 0; k < 3; k++) {
            const float first = (float)(SPRINGLS__BRICK * step[k]);
            meets = meets && at[k] + reach >= first && at[k] - reach <= first + (float)(SPRINGLS__BRICK - 1);
        }
        if (meets) mask |= 1u << d;
    }
    return mask;
}

/* Returns the mask of the bricks around one at `origin` that the band meets about those cells of a part of it that the surface may pass
   through. center, width: of the part, voxels. */
SPRINGLS__FN uint32_t springls__band_of_part(const springls__distance_job *job, springls__v3 origin, springls__v3 center, float width)
{
    const float reach = job->ctx->model.params.band_half_width + 2.0f, part = 0.5f * width; /* reach: and half a cell of 2^3 */
    springls__v3 centers[8];
    uint32_t mask = 0u;
    float d[8];
    int k;
    for (k = 0; k < 8; k++) {
        const springls__v3 way = springls__v3_make((float)(k & 1) - 0.5f, (float)(k >> 1 & 1) - 0.5f, (float)(k >> 2) - 0.5f);
        centers[k] = springls__mad(center, way, part);
    }
    springls__evaluate_distances(job, centers, 8, d);
    for (k = 0; k < 8; k++) {
        const springls__v3 from = springls__sub(centers[k], origin);
        const float at[3] = { from.x, from.y, from.z };
        if (springls__fabs(d[k]) > 0.8661f * part) continue; /* NaN goes on, and is found at the voxels */
        mask |= part > 2.0f ? springls__band_of_part(job, origin, centers[k], part) : springls__bricks_within(at, reach);
    }
    return mask;
}

SPRINGLS__FN void springls__brick_reach_task(void *arg, int begin, int end)
{
    const springls__distance_job *job = (const springls__distance_job *)arg;
    const springls__model *model = &job->ctx->model;
    const float middle = 0.5f * (float)(SPRINGLS__BRICK - 1);
    for (; begin < end; begin++) {
        int at[3];
        springls__v3 origin;
        springls__brick_place(&model->grid, springls__brick_list(model)[begin], at);
        origin = springls__v3_make((float)(SPRINGLS__BRICK * at[0]), (float)(SPRINGLS__BRICK * at[1]), (float)(SPRINGLS__BRICK * at[2]));
        springls__brick_reach(model)[begin] = springls__band_of_part(
            job, origin, springls__add(origin, springls__v3_make(middle, middle, middle)), (float)SPRINGLS__BRICK);
    }
}

/* Drops the bricks of the list that no band meets. */
SPRINGLS__FN springls_status springls__drop_bricks_off_band(springls_context *ctx, springls__distance_job *job)
{
    const springls__grid *g = &ctx->model.grid;
    int *list = springls__brick_list(&ctx->model), i, d, n = 0;
    uint8_t *wanted;
    if (job->listed == 0) return SPRINGLS_OK;
    qsort(list, (size_t)job->listed, sizeof *list, springls__compare_int);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_reach, job->listed));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_wanted, job->listed));
    wanted = springls__brick_wanted(&ctx->model);
    memset(wanted, 0, (size_t)job->listed);
    springls__parallel(ctx, job->listed, 4, springls__brick_reach_task, job);
    for (i = 0; i < job->listed; i++) {
        const uint32_t mask = springls__brick_reach(&ctx->model)[i];
        int place[3];
        springls__brick_place(g, list[i], place);
        for (d = 0; d < 27; d++) {
            const int at[3] = { place[0] + d % 3 - 1, place[1] + d / 3 % 3 - 1, place[2] + d / 9 - 1 };
            const int *found;
            int brick;
            if (!(mask >> d & 1u) || at[0] < 0 || at[1] < 0 || at[2] < 0 || at[0] >= g->bricks[0] || at[1] >= g->bricks[1]
                || at[2] >= g->bricks[2]) continue;
            brick = at[0] + g->bricks[0] * (at[1] + g->bricks[1] * at[2]);
            found = (const int *)bsearch(&brick, list, (size_t)job->listed, sizeof *list, springls__compare_int);
            if (found) wanted[found - list] = 1;
        }
    }
    for (i = 0; i < job->listed; i++)
        if (wanted[i]) list[n++] = list[i];
    job->listed = n;
    return SPRINGLS_OK;
}

/* Finds the bricks near to the surface, block by block, and makes them active; all others become inside or outside. */
SPRINGLS__FN springls_status springls__bricks_near_surface(springls_context *ctx, springls__distance_job *job)
{
    const int *bricks = ctx->model.grid.bricks;
    const bool single = springls__imax(bricks[0], springls__imax(bricks[1], bricks[2])) <= SPRINGLS__DISTANCE_BLOCK;
    int at[3], axis;
    for (at[2] = 0; at[2] < bricks[2]; at[2] += SPRINGLS__DISTANCE_BLOCK)
        for (at[1] = 0; at[1] < bricks[1]; at[1] += SPRINGLS__DISTANCE_BLOCK)
            for (at[0] = 0; at[0] < bricks[0]; at[0] += SPRINGLS__DISTANCE_BLOCK) {
                for (axis = 0; axis < 3; axis++) {
                    job->block.lower[axis] = at[axis];
                    job->block.upper[axis] = springls__imin(at[axis] + SPRINGLS__DISTANCE_BLOCK, bricks[axis]);
                }
                if (single || springls__may_have_surface(job)) SPRINGLS__TRY(springls__look_at_block(ctx, job));
            }
    if (!job->surface) SPRINGLS__TRY(springls__drop_bricks_off_band(ctx, job));
    return springls__grid_add_bricks(ctx, springls__brick_list(&ctx->model), job->listed);
}

/* Evaluates the distance at the voxels of all active bricks, in sixteen pieces, and reports progress after each. */
SPRINGLS__FN springls_status springls__fill_active_bricks(springls_context *ctx, springls__distance_job *job)
{
    const springls__grid *g = &ctx->model.grid;
    const int piece = g->active_count / 16 + 1;
    int i, n, v;
    for (i = 0; i < g->active_count; i += piece) {
        n = springls__imin(piece, g->active_count - i);
        job->active = g->active + i;
        springls__parallel(ctx, n, 2, springls__voxel_task, job);
        if (springls__cancelled(ctx, (float)(i + n) / (float)g->active_count))
            return springls__fail(ctx, SPRINGLS_CANCELLED, "the input is cancelled");
    }
    for (i = 0; i < g->active_count; i++) {
        const float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
            if (springls__is_nan_float(phi[v]))
                return springls__fail(ctx, SPRINGLS_NON_FINITE, "the signed distance is NaN in brick %d",
                                      g->slot_brick[g->active[i]]);
    }
    return SPRINGLS_OK;
}

/* Fills an empty grid with the narrow band of a signed distance. Beyond the band a lower bound of its size is enough. surface:
   NULL, or what is inside lies within `reach` of its bounds (voxels), and far distances are cut short. On failure (NaN, cancelled,
   out of memory) the grid is left unfinished. */
SPRINGLS__FN springls_status springls__set_from_distance(springls_context *ctx, springls__distance_fn fn, void *arg,
                                                         const springls__surface *surface, float reach)
{
    springls__distance_job job;
    job.ctx = ctx;
    job.fn = fn;
    job.arg = arg;
    job.surface = surface;
    job.reach = reach;
    job.listed = 0;
    SPRINGLS__TRY(springls__bricks_near_surface(ctx, &job));
    SPRINGLS__TRY(springls__fill_active_bricks(ctx, &job));
    return springls__run_table(ctx, springls__band_follow);
}

/* ---- from dense voxels ---- */

/* Returns the value of a voxel, negative inside; index: x fastest. */
typedef float (*springls__voxel_fn)(const void *arg, size_t index);

SPRINGLS__FN size_t springls__voxel_index(const springls__grid *g, int x, int y, int z)
{
    return (size_t)x + (size_t)g->size[0] * ((size_t)y + (size_t)g->size[1] * (size_t)z);
}

/* Counts the voxels of a brick and of the layer of one voxel around it, and those that are inside. Fails when one is not
   finite. */
SPRINGLS__FN springls_status springls__count_inside(springls_context *ctx, springls__voxel_fn value, const void *arg,
                                                    const int brick[3], int *inside, int *total)
{
    const springls__grid *g = &ctx->model.grid;
    int lo[3], hi[3], x, y, z, d;
    for (d = 0; d < 3; d++) {
        lo[d] = springls__imax(8 * brick[d] - 1, 0);
        hi[d] = springls__imin(8 * brick[d] + 9, g->size[d]);
    }
    *inside = *total = 0;
    for (z = lo[2]; z < hi[2]; z++)
        for (y = lo[1]; y < hi[1]; y++)
            for (x = lo[0]; x < hi[0]; x++) {
                float v = (value)(arg, springls__voxel_index(g, x, y, z));
                if (!springls__finite_float(v))
                    return springls__fail(ctx, SPRINGLS_NON_FINITE, "voxel (%d, %d, %d) is not finite", x, y, z);
                *inside += v < 0.0f;
                (*total)++;
            }
    return SPRINGLS_OK;
}

enum { SPRINGLS__WANTED = 1, SPRINGLS__SOLID = 2 }; /* of a brick: becomes active; has nothing but inside voxels around */

/* Marks a brick and those of its 26 neighbors that exist. */
SPRINGLS__FN void springls__mark_neighborhood(const int bricks[3], const int brick[3], uint8_t *wanted)
{
    int d;
    for (d = 0; d < 27; d++) {
        int i = brick[0] + d % 3 - 1, j = brick[1] + d / 3 % 3 - 1, k = brick[2] + d / 9 - 1;
        if (i >= 0 && j >= 0 && k >= 0 && i < bricks[0] && j < bricks[1] && k < bricks[2])
            wanted[i + bricks[0] * (j + bricks[1] * k)] |= SPRINGLS__WANTED;
    }
}

SPRINGLS__FN springls__brick_box springls__all_bricks(const springls__grid *g)
{
    springls__brick_box all;
    memset(&all, 0, sizeof all);
    memcpy(all.upper, g->bricks, sizeof all.upper);
    return all;
}

SPRINGLS__FN bool springls__box_has_brick(const springls__brick_box *box, const int place[3])
{
    int d;
    for (d = 0; d < 3; d++)
        if (place[d] < box->lower[d] || place[d] >= box->upper[d]) return false;
    return true;
}

/* Activates the bricks that the surface passes through, and all around them, whose values its slopes need. The surface
   passes where the function changes sign, and where the inside meets the border of the domain. Bricks that are not in the box are
   outside. */
SPRINGLS__FN springls_status springls__bricks_of_voxels(springls_context *ctx, springls__voxel_fn value, const void *arg,
                                                        const springls__brick_box *box)
{
    springls__grid *g = &ctx->model.grid;
    const int *b = g->bricks, bricks = b[0] * b[1] * b[2];
    springls__brick_groups solid = springls__no_groups();
    int n = 0, brick, *list, d;
    uint8_t *wanted;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_wanted, bricks));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_list, bricks));
    wanted = springls__brick_wanted(&ctx->model);
    list = springls__brick_list(&ctx->model);
    memset(wanted, 0, (size_t)bricks);
    for (brick = 0; brick < bricks; brick++) {
        int at[3], inside, total;
        bool at_border = false;
        springls__brick_place(g, brick, at);
        if (!springls__box_has_brick(box, at)) continue;
        SPRINGLS__TRY(springls__count_inside(ctx, value, arg, at, &inside, &total));
        if (inside == total) {
            springls__keep_box(g, &solid, at, at, 0);
            wanted[brick] |= SPRINGLS__SOLID;
        }
        for (d = 0; d < 3; d++) at_border = at_border || at[d] == 0 || at[d] + 1 == b[d];
        if (inside == 0 || (inside == total && !at_border)) continue;
        springls__mark_neighborhood(b, at, wanted);
    }
    SPRINGLS__TRY(springls__table_cover(ctx, solid));
    for (brick = 0; brick < bricks; brick++) {
        if (wanted[brick] & SPRINGLS__SOLID) g->top[springls__entry_of_brick(g, brick)] = SPRINGLS__INSIDE;
        if (wanted[brick] & SPRINGLS__WANTED) list[n++] = brick;
    }
    return springls__grid_add_bricks(ctx, list, n);
}

/* Returns the mean difference of values between neighbor voxels on different sides; 1 when there are none. */
SPRINGLS__FN double springls__slope_at_zero(const springls__grid *g)
{
    float tile[SPRINGLS__TILE_VOXELS];
    double sum = 0.0, count = 0.0;
    int i, v, d;
    for (i = 0; i < g->active_count; i++) {
        springls__load_tile(g, g->phi, g->active[i], springls__alone(), tile);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            static const int next[3] = { 1, SPRINGLS__TILE, SPRINGLS__TILE * SPRINGLS__TILE };
            const float *c = tile + springls__tile_index(v & 7, v >> 3 & 7, v >> 6);
            for (d = 0; d < 3; d++) {
                if ((*c < 0.0f) == (c[next[d]] < 0.0f)) continue;
                sum += fabs((double)*c - (double)c[next[d]]);
                count += 1.0;
            }
        }
    }
    return sum > 0.0 ? sum / count : 1.0;
}

/* Copies the caller's values into the active bricks. */
SPRINGLS__FN void springls__copy_voxels(const springls__grid *g, springls__voxel_fn value, const void *arg)
{
    int i, v;
    for (i = 0; i < g->active_count; i++) {
        float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        int o[3], at[3];
        springls__slot_origin(g, g->active[i], o);
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            springls__voxel_of_brick(o, v, at);
            if (springls__grid_contains(g, at[0], at[1], at[2])) phi[v] = (value)(arg, springls__voxel_index(g, at[0], at[1], at[2]));
        }
    }
}

/* Multiplies the values of the active bricks by `scale`, and keeps them within float32's useful range: none inside becomes 0. */
SPRINGLS__FN void springls__scale_voxels(const springls__grid *g, double scale)
{
    const float smallest = 1e-6f, largest = 1e6f;
    int i, v;
    for (i = 0; i < g->active_count; i++) {
        float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
            double scaled = fabs((double)phi[v]) * scale;
            float size = scaled < (double)largest ? (float)scaled : largest;
            if (phi[v] < 0.0f) size = springls__max(size, smallest);
            phi[v] = phi[v] < 0.0f ? -size : size;
        }
    }
}

/* Fills an empty grid from any function that is negative inside, nowhere outside of a box of bricks. Values whose slope is far from 1 are
   scaled first; then phi is re-distanced outwards from its zero. */
SPRINGLS__FN springls_status springls__set_from_voxels(springls_context *ctx, springls__voxel_fn value, const void *arg,
                                                       const springls__brick_box *box)
{
    const springls__grid *g = &ctx->model.grid;
    double slope;
    int pass;
    SPRINGLS__TRY(springls__bricks_of_voxels(ctx, value, arg, box));
    springls__copy_voxels(g, value, arg);
    slope = springls__slope_at_zero(g);
    springls__scale_voxels(g, slope > 0.1 && slope < 10.0 ? 1.0 : 1.0 / slope);
    springls__run(ctx, SPRINGLS__KERNEL_subvoxel, g->active_count, NULL);
    springls__swap_phi(ctx);
    for (pass = 0; pass < 2; pass++) {
        springls__redistance_sweeps(ctx, 6);
        SPRINGLS__TRY(springls__run_table(ctx, springls__band_follow));
    }
    springls__redistance_sweeps(ctx, 4);
    return SPRINGLS_OK;
}

/* Turns phi into a distance in voxels after springls__set_from_distance by a distance of the world, which is none if the spacing is not
   uniform. */
SPRINGLS__FN springls_status springls__redistance_in_voxels(springls_context *ctx)
{
    if (springls__is_uniform(ctx->model.grid.metric)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__run_table(ctx, springls__rebuild));
    springls__redistance_sweeps(ctx, 8);
    return SPRINGLS_OK;
}

/* ---- the initial springls ---- */

/* Moves a point near the zero level of phi by a Newton step of up to half a voxel. */
SPRINGLS__FN springls__v3 springls__newton_step(const springls__grid *g, springls__v3 x)
{
    const springls__voxel_block block = springls__voxel_block_about(g, x);
    const springls__v3 n = springls__block_gradient(&block, x);
    const float n2 = springls__length2(n);
    if (!(n2 > 0.1f)) return x;
    return springls__mad(x, n, -springls__clamp(springls__block_sample_smooth(&block, x) / n2, -0.5f, 0.5f));
}

/* Moves a point near the zero level of phi onto it, by three Newton steps. */
SPRINGLS__FN springls__v3 springls__to_zero_level(const springls__grid *g, springls__v3 x)
{
    int i;
    for (i = 0; i < 3; i++) x = springls__newton_step(g, x);
    return x;
}

/* The marching cubes of an active brick on every `stride`-th voxel: where the first begin, and where none begins any more. At the
   lower border of the domain they begin outside, so that the closing surface is met too. */
typedef struct springls__initial_cubes { int lo[3], hi[3], stride; } springls__initial_cubes;

SPRINGLS__FN springls__initial_cubes springls__initial_cubes_of(const springls_context *ctx, int i)
{
    const springls__grid *g = &ctx->model.grid;
    springls__initial_cubes cubes;
    int o[3], d;
    cubes.stride = ctx->model.params.initial_stride;
    springls__slot_origin(g, g->active[i], o);
    for (d = 0; d < 3; d++) {
        cubes.lo[d] = o[d] == 0 ? -cubes.stride : o[d];
        cubes.hi[d] = springls__imin(o[d] + 8, g->size[d]);
    }
    return cubes;
}

/* Moves on to the next cube, x fastest; false after the last one. */
SPRINGLS__FN bool springls__next_initial_cube(const springls__initial_cubes *cubes, int at[3])
{
    int d;
    for (d = 0; d < 3; d++) {
        at[d] += cubes->stride;
        if (at[d] < cubes->hi[d]) return true;
        at[d] = cubes->lo[d];
    }
    return false;
}

SPRINGLS__FN springls__mc_cell springls__initial_cell(const springls__grid *g, const int at[3], int stride)
{
    const int last = springls__imax(springls__imax(at[0] & 7, at[1] & 7), at[2] & 7) + stride; /* the furthest corner in the brick */
    springls__mc_cell cell;
    int c;
    if (last < SPRINGLS__BRICK && springls__table_contains(g, at[0], at[1], at[2])
        && springls__table_contains(g, at[0] + stride, at[1] + stride, at[2] + stride)) { /* in one brick, as most cubes are */
        const float *phi = g->phi + (size_t)springls__slot_at(g, at[0], at[1], at[2]) * SPRINGLS__BRICK_VOXELS
                         + (size_t)springls__voxel_in_brick(at[0], at[1], at[2]);
        for (c = 0; c < 8; c++) cell.phi[c] = phi[stride * ((c & 1) + 8 * (c >> 1 & 1) + 64 * (c >> 2))];
        return cell;
    }
    for (c = 0; c < 8; c++)
        cell.phi[c] = springls__grid_phi(g, g->phi, at[0] + stride * (c & 1), at[1] + stride * ((c >> 1) & 1),
                                         at[2] + stride * (c >> 2));
    return cell;
}

/* Vertices that are known on the edges of a layer of cubes, which share them. An edge that begins in plane z of corners has
   its place in layer z & 1. */
enum { SPRINGLS__INITIAL_SIDE = 10, SPRINGLS__INITIAL_LAYER = 3 * SPRINGLS__INITIAL_SIDE * SPRINGLS__INITIAL_SIDE };
typedef struct springls__initial_vertices {
    bool known[2][SPRINGLS__INITIAL_LAYER];
    springls__v3 at[2][SPRINGLS__INITIAL_LAYER];
} springls__initial_vertices;

/* Forgets what the layer of cubes that begins at this cube does not share with the one before; any other cube changes nothing. */
SPRINGLS__FN void springls__begin_initial_layer(const springls__initial_cubes *cubes, const int at[3],
                                                springls__initial_vertices *vertices)
{
    const int layer = (at[2] - cubes->lo[2]) / cubes->stride;
    if (at[0] != cubes->lo[0] || at[1] != cubes->lo[1]) return;
    if (layer == 0) memset(vertices->known[0], 0, sizeof vertices->known[0]);
    memset(vertices->known[(layer + 1) & 1], 0, sizeof vertices->known[0]);
}

/* Returns where the zero level crosses an edge of the cube at `at`. */
SPRINGLS__FN springls__v3 springls__initial_crossing(const springls__initial_cubes *cubes, springls__mc_cell cell, const int at[3],
                                                      int edge)
{
    const springls__v3 x = springls__v3_make((float)at[0], (float)at[1], (float)at[2]);
    return springls__mad(x, springls__mc_point(0, 0, 0, edge, springls__mc_edge_crossing(cell, edge)), (float)cubes->stride);
}

/* Returns the vertex on an edge of the cube at `at`, on the zero level with project_initial = 1. */
SPRINGLS__FN springls__v3 springls__initial_vertex(const springls_context *ctx, const springls__initial_cubes *cubes,
                                                   springls__mc_cell cell, const int at[3], int edge,
                                                   springls__initial_vertices *vertices)
{
    const int corner = springls__mc_edge_corner(edge);
    int place[3], d, n, layer;
    for (d = 0; d < 3; d++) place[d] = (at[d] - cubes->lo[d]) / cubes->stride + (corner >> d & 1);
    n = place[0] + SPRINGLS__INITIAL_SIDE * (place[1] + SPRINGLS__INITIAL_SIDE * springls__mc_edge_axis(edge));
    layer = place[2] & 1;
    if (!vertices->known[layer][n]) {
        springls__v3 x = springls__initial_crossing(cubes, cell, at, edge);
        if (ctx->model.params.project_initial) x = springls__to_zero_level(&ctx->model.grid, x);
        vertices->at[layer][n] = x;
        vertices->known[layer][n] = true;
    }
    return vertices->at[layer][n];
}

/* Returns the springl of three vertices. Its particle stays in their plane. */
SPRINGLS__FN springls__springl springls__initial_springl(const springls_context *ctx, const springls__v3 vertices[3])
{
    springls__springl s;
    int m;
    for (m = 0; m < 3; m++) s.q[m] = vertices[m];
    s.p = springls__tri_centroid(springls__springl_tri(s));
    if (ctx->model.params.project_initial) {
        springls__v3 p = springls__to_zero_level(&ctx->model.grid, s.p);
        for (m = 0; m < 3; m++) s.q[m] = springls__add(s.q[m], springls__sub(p, s.p));
        s.p = p;
    }
    return s;
}

enum { SPRINGLS__ANY_NUMBER = 0x7fffffff };

/* Returns how many springls the cubes of active brick i have, without the cubes that exceed `room`; with vertices, makes them
   from number `first` on. */
SPRINGLS__FN int springls__initial_brick(const springls_context *ctx, int i, int first, int room,
                                         springls__initial_vertices *vertices)
{
    const springls__initial_cubes cubes = springls__initial_cubes_of(ctx, i);
    int at[3], count = 0, k, m;
    memcpy(at, cubes.lo, sizeof at);
    do {
        const springls__mc_cell cell = springls__initial_cell(&ctx->model.grid, at, cubes.stride);
        const int mask = springls__mc_case(cell), triangles = springls__mc_count(mask);
        if (vertices) springls__begin_initial_layer(&cubes, at, vertices);
        if (count + triangles > room) continue;
        for (k = 0; vertices && k < triangles; k++) {
            springls__v3 corners[3];
            springls__springl s;
            for (m = 0; m < 3; m++)
                corners[m] = springls__initial_vertex(ctx, &cubes, cell, at, springls__mc_edge(mask, k, m), vertices);
            s = springls__initial_springl(ctx, corners);
            springls__springl_add(&ctx->model, first + count + k, springls__springl_finished(s), s.p, 0, 0);
        }
        count += triangles;
    } while (springls__next_initial_cube(&cubes, at));
    return count;
}

SPRINGLS__FN void springls__count_initial_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    for (; begin < end; begin++)
        springls__initial_before(&ctx->model)[begin] = springls__initial_brick(ctx, begin, 0, SPRINGLS__ANY_NUMBER, NULL);
}

SPRINGLS__FN void springls__make_initial_task(void *arg, int begin, int end)
{
    const springls_context *ctx = (const springls_context *)arg;
    const int *before = springls__initial_before(&ctx->model);
    springls__initial_vertices vertices;
    for (; begin < end; begin++)
        if (before[begin] < before[begin + 1])
            springls__initial_brick(ctx, begin, before[begin], before[begin + 1] - before[begin], &vertices);
}

/* Finds how many initial springls come before each active brick, and returns how many there are. Those of cubes that exceed
   max_springls are refused. */
SPRINGLS__FN int springls__scan_initial_counts(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    int *before = springls__initial_before(&ctx->model), count = 0, i;
    for (i = 0; i < bricks; i++) {
        const int room = ctx->desc.max_springls - count, wanted = before[i];
        const int allowed = wanted <= room ? wanted : room > 0 ? springls__initial_brick(ctx, i, 0, room, NULL) : 0;
        ctx->stats.refused += wanted - allowed;
        before[i] = count;
        count += allowed;
    }
    before[bricks] = count;
    return count;
}

/* Counts the initial springls of each active brick. Fails when there are none. */
SPRINGLS__FN springls_status springls__count_initial(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    int i;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, initial_before, bricks + 1));
    springls__parallel(ctx, bricks, 16, springls__count_initial_task, ctx);
    for (i = 0; i < bricks; i++)
        if (springls__initial_before(&ctx->model)[i] > 0) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "the level set has no zero inside the grid, or is steeper than a distance");
}

/* Makes the initial springls, `count`, that the scan has found. */
SPRINGLS__FN springls_status springls__make_counted_springls(springls_context *ctx, int count)
{
    if (count == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count));
    springls__parallel(ctx, ctx->model.grid.active_count, 4, springls__make_initial_task, ctx);
    springls__constellation_added(ctx, count);
    springls__constellation_changed(ctx);
    return SPRINGLS_OK;
}

/* Makes the springls of an empty constellation by marching cubes of phi on every `initial_stride`-th voxel (section 4.1). Fails when
   there are none. */
SPRINGLS__FN springls_status springls__springls_of_level_set(springls_context *ctx)
{
    SPRINGLS__TRY(springls__count_initial(ctx));
    SPRINGLS__TRY(springls__make_counted_springls(ctx, springls__scan_initial_counts(ctx)));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "max_springls leaves room for no springl");
    if (ctx->model.params.keep_edges && ctx->model.params.project_initial) springls__initial_edges(ctx);
    return SPRINGLS_OK;
}

/* The same, and makes the model the original surface. */
SPRINGLS__FN springls_status springls__initial_springls(springls_context *ctx)
{
    SPRINGLS__TRY(springls__springls_of_level_set(ctx));
    return springls__make_original(ctx);
}

/* ---- public calls ---- */

typedef struct springls__implicit_job { springls_context *ctx; springls_implicit_fn fn; void *user; } springls__implicit_job;

/* Evaluates the user's function at points in voxels, as a distance in voxels: a lower bound if the spacing is not uniform. */
SPRINGLS__FN void springls__implicit_distance(void *arg, const springls__v3 *points, int count, float *out)
{
    const springls__implicit_job *job = (const springls__implicit_job *)arg;
    springls__v3 world[SPRINGLS__BRICK_VOXELS];
    float scale = 1.0f / job->ctx->largest_spacing;
    float *xyz = (float *)(void *)world;
    int i;
    memcpy(world, points, (size_t)count * sizeof *world);
    springls_to_world(job->ctx, xyz, count, xyz);
    (job->fn)(job->user, xyz, count, out);
    for (i = 0; i < count; i++) out[i] *= scale;
}

SPRINGLS_API springls_status springls_set_implicit(springls_context *ctx, springls_implicit_fn fn, void *user)
{
    springls__implicit_job job;
    springls_status status;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!fn) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_implicit: the function is NULL");
    job.ctx = ctx;
    job.fn = fn;
    job.user = user;
    springls__clear_model(ctx);
    status = springls__set_from_distance(ctx, springls__implicit_distance, &job, NULL, 0.0f);
    if (status == SPRINGLS_OK) status = springls__redistance_in_voxels(ctx);
    if (status == SPRINGLS_OK) status = springls__initial_springls(ctx);
    return springls__clear_on_failure(ctx, status);
}

SPRINGLS__FN float springls__level_set_value(const void *arg, size_t index) { return ((const float *)arg)[index]; }

typedef struct springls__label_source { const int32_t *labels; int32_t label; } springls__label_source;

/* Returns -0.5 in voxels of the label (of any but 0 when the label is negative), else 0.5. */
SPRINGLS__FN float springls__label_value(const void *arg, size_t index)
{
    const springls__label_source *source = (const springls__label_source *)arg;
    bool inside = source->label < 0 ? source->labels[index] != 0 : source->labels[index] == source->label;
    return inside ? -0.5f : 0.5f;
}

typedef struct springls__threshold_source { const float *intensity; float low, high, scale; } springls__threshold_source;

/* Returns the scaled distance of an intensity to [low, high], negative between them; 1 for NaN. */
SPRINGLS__FN float springls__threshold_value(const void *arg, size_t index)
{
    const springls__threshold_source *source = (const springls__threshold_source *)arg;
    float v = source->intensity[index];
    if (springls__is_nan_float(v)) return 1.0f;
    return springls__clamp(springls__max(source->low - v, v - source->high) * source->scale, -1e6f, 1e6f);
}

/* Replaces the model by one from dense voxels; empty on failure. */
SPRINGLS__FN springls_status springls__set_voxels_in(springls_context *ctx, springls__voxel_fn value, const void *arg,
                                                     const springls__brick_box *box)
{
    springls_status status;
    springls__clear_model(ctx);
    status = springls__set_from_voxels(ctx, value, arg, box);
    if (status == SPRINGLS_OK) status = springls__initial_springls(ctx);
    return springls__clear_on_failure(ctx, status);
}

SPRINGLS__FN springls_status springls__set_voxels(springls_context *ctx, springls__voxel_fn value, const void *arg)
{
    const springls__brick_box all = springls__all_bricks(&ctx->model.grid);
    return springls__set_voxels_in(ctx, value, arg, &all);
}

SPRINGLS_API springls_status springls_set_level_set(springls_context *ctx, const float *phi)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!phi) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_level_set: phi is NULL");
    return springls__set_voxels(ctx, springls__level_set_value, phi);
}

SPRINGLS_API springls_status springls_set_labels(springls_context *ctx, const int32_t *labels, int32_t label)
{
    springls__label_source source;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!labels) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_labels: labels is NULL");
    source.labels = labels;
    source.label = label;
    return springls__set_voxels(ctx, springls__label_value, &source);
}

SPRINGLS_API springls_status springls_set_threshold(springls_context *ctx, const float *intensity, float low, float high)
{
    springls__threshold_source source;
    size_t i, n;
    float lowest = FLT_MAX, highest = -FLT_MAX;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (!intensity) return springls__fail_null(ctx, "set_threshold", "intensity");
    if (springls__is_nan_float(low) || springls__is_nan_float(high) || low > high)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_threshold: low (%g) is not below high (%g)", (double)low,
                              (double)high);
    n = (size_t)ctx->model.grid.size[0] * (size_t)ctx->model.grid.size[1] * (size_t)ctx->model.grid.size[2];
    for (i = 0; i < n; i++) {
        if (!springls__finite_float(intensity[i])) continue;
        lowest = springls__min(lowest, intensity[i]);
        highest = springls__max(highest, intensity[i]);
    }
    source.intensity = intensity;
    source.low = low;
    source.high = high;
    source.scale = highest > lowest ? 256.0f / (highest - lowest) : 1.0f; /* slopes of order 1 for every unit */
    return springls__set_voxels(ctx, springls__threshold_value, &source);
}

#endif
