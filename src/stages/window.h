/* window.h - moves the grid with the model (springls_desc.follow): by whole bricks, so that bricks are renamed and never changed,
   and by whole voxels, so that a coordinate that gets smaller keeps all its digits. */
#ifndef SPRINGLS__STAGES_WINDOW_H
#define SPRINGLS__STAGES_WINDOW_H

#include "../../kernels_embed/stages/window.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "../model/transform.h"
#include "components.h"

enum {
    SPRINGLS__WINDOW_MARGIN = 16,             /* voxels between the model and the border: when there are fewer, the window moves */
    SPRINGLS__FURTHEST_WINDOW = 1 << 30,      /* voxels */
    SPRINGLS__FURTHEST_MOVE = 1 << 20         /* bricks: further than springls are apart, and exact as voxels in a float */
};

/* ---- a move ---- */

/* Returns the number that a brick has after its window has moved by `bricks`; -1: it is outside. */
SPRINGLS__FN int springls__brick_after_move(const springls__grid *g, int brick, const int bricks[3])
{
    int place[3], axis;
    springls__brick_place(g, brick, place);
    for (axis = 0; axis < 3; axis++) {
        place[axis] -= bricks[axis];
        if (place[axis] < 0 || place[axis] >= g->bricks[axis]) return -1;
    }
    return place[0] + g->bricks[0] * (place[1] + g->bricks[1] * place[2]);
}

/* Renames the bricks of the model. Bricks that the window has left are dropped; bricks that the window has reached are outside. */
SPRINGLS__FN void springls__move_bricks(springls__grid *g, const int bricks[3])
{
    int i, n = 0;
    for (i = 0; i < g->active_count; i++) {
        int slot = g->active[i], brick = springls__brick_after_move(g, g->slot_brick[slot], bricks);
        g->slot_brick[slot] = brick;
        if (brick >= 0) g->active[n++] = slot;
        else {
            g->awake[slot] = 0;
            g->free_slots[g->free_count++] = slot;
        }
    }
    g->active_count = n;
}

/* Changes the coordinates of springls and components. Correspondences are in a window of their own, which stays. */
SPRINGLS__FN void springls__move_places(springls_context *ctx, const int voxels[3])
{
    springls__constellation *set = &ctx->model.set;
    int i, m;
    for (i = 0; i < set->count; i++) {
        springls__springl *s = &set->s[i];
        s->p = springls__after_move(s->p, voxels);
        for (m = 0; m < 3; m++) s->q[m] = springls__after_move(s->q[m], voxels);
        *s = springls__springl_finished(*s);
        set->synced_position[i] = springls__after_move(set->synced_position[i], voxels);
    }
    for (i = 0; i < ctx->component_count; i++)
        for (m = 0; m < 3; m++) {
            int32_t *deepest = &springls__component_list(ctx)[i].deepest[m];
            *deepest = springls__iclamp(*deepest - voxels[m], 0, ctx->model.grid.size[m] - 1);
        }
}

/* Moves the window by whole bricks. Nothing has changed on failure. */
SPRINGLS__FN springls_status springls__move_window(springls_context *ctx, const int bricks[3])
{
    const uint64_t moved = SPRINGLS__BIT(TOP) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(FREE_SLOTS)
                         | SPRINGLS__BIT(AWAKE) | SPRINGLS__BIT(S) | SPRINGLS__BIT(SYNCED_POSITION);
    springls__brick_groups groups = springls__no_groups();
    springls__table table;
    int voxels[3], offset[3], axis;
    for (axis = 0; axis < 3; axis++) {
        voxels[axis] = SPRINGLS__BRICK * bricks[axis];
        offset[axis] = ctx->window.offset[axis] + voxels[axis];
    }
    SPRINGLS__TRY(springls__to_host(ctx, moved, moved));
    springls__keep_grid(&ctx->model.grid, &groups, bricks);
    table = springls__table_of(&ctx->model.grid, &groups);
    SPRINGLS__TRY(springls__table_change(ctx, &table, bricks));
    springls__move_bricks(&ctx->model.grid, bricks);
    springls__move_places(ctx, voxels);
    springls__place_window(ctx, &ctx->window, offset);
    ctx->springl_surface_fresh = false;
    springls__discard_cell_list(ctx);
    return SPRINGLS_OK;
}

/* ---- when it moves ---- */

/* Returns the largest of springls__extent_element over all springls. */
SPRINGLS__FN float springls__largest_extent(springls_context *ctx, int side)
{
    springls__arguments args;
    args.extent.side = side;
    args.extent.margin = (float)SPRINGLS__WINDOW_MARGIN;
    springls__run(ctx, SPRINGLS__KERNEL_extent, ctx->model.set.count, &args);
    return springls__find_largest(ctx, SPRINGLS__ROLE_ARRAY(extent), ctx->model.set.count, 0.0f).value;
}

/* Returns by how many bricks the window has to move along an axis for a box to be in its middle, as far as one move may go. */
SPRINGLS__FN int springls__bricks_to_middle(const springls_context *ctx, int axis, double lower, double upper)
{
    const double furthest = (double)SPRINGLS__FURTHEST_MOVE;
    const int limit = SPRINGLS__FURTHEST_WINDOW / SPRINGLS__BRICK, at = ctx->window.offset[axis] / SPRINGLS__BRICK;
    double bricks = floor((lower + upper - (double)(ctx->model.grid.size[axis] - 1)) / (2.0 * SPRINGLS__BRICK) + 0.5);
    int wanted = (int)(bricks > furthest ? furthest : bricks < -furthest ? -furthest : bricks);
    return springls__iclamp(wanted, -limit - at, limit - at);
}

SPRINGLS__FN bool springls__window_follows(const springls_context *ctx) { return ctx->desc.follow; }

/* Moves the window so that the model is in its middle, if that has come near to its border. A model that is too large for the
   margin moves the window whenever that brings it nearer to the middle. */
SPRINGLS__FN springls_status springls__follow_model(springls_context *ctx)
{
    int bricks[3], axis;
    if (ctx->model.set.count == 0 || (ctx->at_rest && ctx->motion.none)) return SPRINGLS_OK;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, extent, ctx->model.set.count));
    if (!(springls__largest_extent(ctx, 0) > 0.0f)) return SPRINGLS_OK;
    for (axis = 0; axis < 3; axis++) {
        double lower = (double)SPRINGLS__EXTENT_BEYOND - (double)springls__largest_extent(ctx, 2 * axis + 1);
        double upper = (double)springls__largest_extent(ctx, 2 * axis + 2) - (double)SPRINGLS__EXTENT_BEYOND;
        bricks[axis] = springls__bricks_to_middle(ctx, axis, lower, upper);
    }
    if (bricks[0] == 0 && bricks[1] == 0 && bricks[2] == 0) return SPRINGLS_OK;
    return springls__move_window(ctx, bricks);
}

#endif
