/* unsigned_distance.h - the unsigned level set omega (eq. 21) in every active brick: exact distance to the springls, clamped. */
#ifndef SPRINGLS__STAGES_UNSIGNED_DISTANCE_H
#define SPRINGLS__STAGES_UNSIGNED_DISTANCE_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "contact_bodies.h"

/* Lists the springls within `margin` voxels of each active brick, by counting sort: they ascend within a brick. */
SPRINGLS__FN springls_status springls__brick_lists_build(springls_context *ctx, float margin)
{
    const int count = ctx->model.set.count, bricks = ctx->model.grid.active_count;
    const bool sorted = springls__runs_in_order(ctx);
    springls__arguments args;
    int total = 0;
    args.brick_list.margin = margin;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_FIRST, (size_t)bricks + 2, 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_rank, ctx->model.grid.slot_count));
    springls__run(ctx, SPRINGLS__KERNEL_brick_lists_rank, bricks, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_brick_lists_clear, bricks + 2, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_brick_lists_count, count, &args);
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ARRAY_BRICK_LIST_FIRST, bricks + 2, &total));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_IDS, (size_t)total + 1, 0));
    springls__run(ctx, SPRINGLS__KERNEL_brick_lists_scatter, count, &args);
    if (!sorted) springls__run(ctx, SPRINGLS__KERNEL_brick_lists_sort, bricks, NULL);
    return SPRINGLS_OK;
}

/* Finds omega where it is unknown: everywhere after springls have moved, else in bricks that are new since. Ends with a loop. */
SPRINGLS__FN springls_status springls__omega_build(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    springls__arguments args;
    SPRINGLS__TRY(springls__find_overlap(ctx)); /* each time: it adds bricks, which must not depend on what omega is known */
    args.omega_forget.all = !ctx->omega_fresh;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, omega_missing, g->active_count));
    springls__run(ctx, SPRINGLS__KERNEL_omega_forget, g->active_count, &args);
    if (springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(omega_missing), g->active_count, 1) > 0) {
        SPRINGLS__TRY(springls__brick_lists_build(ctx, ctx->model.params.capture_range));
        springls__loop(ctx, SPRINGLS__KERNEL_omega, g->active_count, NULL);
    }
    ctx->omega_fresh = true;
    return SPRINGLS_OK;
}

#endif
