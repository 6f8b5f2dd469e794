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
    const springls__model *model = &ctx->model;
    const int bricks = model->grid.active_count;
    uint32_t *first;
    int i;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_FIRST, (size_t)bricks + 2, 0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_rank, model->grid.slot_count));
    if (ctx->on_device) {
        springls_status status = (ctx->backend->brick_lists_build)(ctx, margin);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(ACTIVE),
                                    SPRINGLS__BIT(BRICK_LIST_FIRST) | SPRINGLS__BIT(BRICK_LIST_IDS)
                                        | SPRINGLS__ROLE_BIT(brick_rank)));
    first = model->cells.brick_list_first;
    memset(first, 0, ((size_t)bricks + 2) * sizeof *first);
    for (i = 0; i < bricks; i++) springls__brick_rank(model)[model->grid.active[i]] = (uint32_t)i;
    for (i = 0; i < model->set.count; i++) springls__count_in_brick_lists(model, margin, i);
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_IDS, (size_t)springls__prefix_sums(first, bricks + 2) + 1, 0));
    for (i = 0; i < model->set.count; i++) springls__put_in_brick_lists(model, margin, i);
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
