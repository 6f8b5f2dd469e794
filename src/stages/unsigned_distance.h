/* omega.h - the unsigned level set omega (eq. 21) in every active brick: exact distance to the springls, clamped. */
#ifndef SPRINGLS__STAGES_UNSIGNED_DISTANCE_H
#define SPRINGLS__STAGES_UNSIGNED_DISTANCE_H

#include "../runtime/arrays.h"
#include "../runtime/kernel_table.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"

/* Springls near each active brick, by counting sort; ids ascend within a brick. Two passes over the same walk. */
SPRINGLS__FN springls_status springls__brick_lists_build(springls_context *ctx, float margin)
{
    springls__grid *g = &ctx->model.grid;
    springls__cell_list *cells = &ctx->model.cells;
    int *rank, i, pass, total = 0;
    if (ctx->on_device) {
        springls_status status = ctx->backend->near_build(ctx, margin);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)g->slot_count, sizeof(int), (void **)&rank));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_FIRST, (size_t)g->active_count + 2, 0));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(ACTIVE),
                                    SPRINGLS__BIT(BRICK_LIST_FIRST) | SPRINGLS__BIT(BRICK_LIST_IDS) | SPRINGLS__BIT(SCRATCH0)));
    memset(cells->brick_list_first, 0, ((size_t)g->active_count + 2) * sizeof(uint32_t));
    for (i = 0; i < g->active_count; i++) rank[g->active[i]] = i;
    for (pass = 0; pass < 2; pass++) {
        for (i = 0; i < ctx->model.set.count; i++) {
            int lo[3], hi[3], x, y, z;
            springls__springl_bricks(g, &ctx->model.set.s[i], margin, lo, hi);
            for (z = lo[2]; z <= hi[2]; z++)
                for (y = lo[1]; y <= hi[1]; y++)
                    for (x = lo[0]; x <= hi[0]; x++) {
                        int slot = g->top[x + g->bricks[0] * (y + g->bricks[1] * z)];
                        if (slot < SPRINGLS__FIRST_SLOT) continue;
                        if (pass == 0) cells->brick_list_first[rank[slot] + 2]++;
                        else cells->brick_list_ids[cells->brick_list_first[rank[slot] + 1]++] = (uint32_t)i;
                    }
        }
        if (pass == 1) break;
        for (i = 0; i < g->active_count; i++) { /* entry i+1 becomes the start of brick i; the second pass moves it on */
            cells->brick_list_first[i + 2] += cells->brick_list_first[i + 1];
        }
        total = (int)cells->brick_list_first[g->active_count + 1];
        SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_LIST_IDS, (size_t)total + 1, 0));
    }
    return SPRINGLS_OK;
}

/* omega where it is unknown: everywhere after springls have moved, else in the bricks that the band has reached since. Ends with a loop. */
SPRINGLS__FN springls_status springls__omega_build(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    SPRINGLS__TRY(springls__scratch(ctx, 1, (size_t)g->active_count, 1, NULL));
    springls__run(ctx, SPRINGLS__KERNEL_omega_forget, g->active_count, springls__job_of(!ctx->omega_fresh));
    if (springls__count_of(ctx, SPRINGLS__ARRAY_SCRATCH1, g->active_count, 1) > 0) {
        SPRINGLS__TRY(springls__brick_lists_build(ctx, ctx->model.params.capture_range));
        springls__loop(ctx, SPRINGLS__KERNEL_omega, g->active_count, springls__no_job());
    }
    ctx->omega_fresh = true;
    return SPRINGLS_OK;
}

#endif
