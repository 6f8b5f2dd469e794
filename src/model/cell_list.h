/* cell_list.h - the hash grid (section 4.8): lists springls by the cell of their particle, by counting sort. Numbers ascend in a
   cell, and no cell overflows. A springl with too large a bounding radius is in the list `large` instead, so that one huge
   triangle does not widen every search. */
#ifndef SPRINGLS__MODEL_CELL_LIST_H
#define SPRINGLS__MODEL_CELL_LIST_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "grid.h"

/* Finds the cells of the particles whose bricks were missing. */
SPRINGLS__FN springls_status springls__missing_keys(springls_context *ctx)
{
    springls__arguments none;
    int i;
    memset(&none, 0, sizeof none);
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__GRID_BITS | SPRINGLS__BIT(S), SPRINGLS__BIT(KEY)));
    for (i = 0; i < ctx->model.set.count; i++)
        if (ctx->model.cells.key[i] == SPRINGLS__MISSING_KEY) springls__cell_key_element(&ctx->model, none, i);
    return SPRINGLS_OK;
}

/* Finds the cell of every particle. Makes bricks active that have a particle and are not. */
SPRINGLS__FN springls_status springls__cell_keys(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, n = 0, *missing, origin[3];
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, missing_bricks, ctx->model.set.count));
    missing = springls__missing_bricks(&ctx->model);
    springls__run(ctx, SPRINGLS__KERNEL_cell_key, ctx->model.set.count, NULL);
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY), 0));
    for (i = 0; i < ctx->model.set.count; i++) {
        if (ctx->model.cells.key[i] != SPRINGLS__MISSING_KEY) continue;
        springls__origin_of_place(g, ctx->model.set.s[i].p, origin);
        missing[n++] = springls__brick_at(g, origin[0], origin[1], origin[2]);
    }
    if (n == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_add_bricks(ctx, missing, n));
    return springls__missing_keys(ctx);
}

/* Counts the springls of each cell, one place late for the scan, and lists the large ones apart. */
SPRINGLS__FN void springls__count_cells(springls__model *model)
{
    springls__cell_list *cells = &model->cells;
    int i;
    cells->bounding_radius = 0.0f;
    cells->large_count = 0;
    for (i = 0; i < model->grid.active_count; i++) springls__clear_cells(springls__cells_of(&model->grid, model->grid.active[i]));
    for (i = 0; i < model->set.count; i++) {
        if (cells->key[i] == SPRINGLS__LARGE_KEY) {
            cells->large[cells->large_count++] = (uint32_t)i;
            continue;
        }
        cells->bounding_radius = springls__max(cells->bounding_radius, model->set.s[i].bounding_radius);
        springls__count_in_cell(model, i);
    }
}

/* Finds the largest bounding radius after triangles have changed. Returns false where a springl has become large, or is no longer:
   the list is to be built anew then. */
SPRINGLS__FN bool springls__update_radii(springls__model *model)
{
    springls__cell_list *cells = &model->cells;
    float largest = 0.0f;
    int i;
    for (i = 0; i < model->set.count; i++) {
        float radius = model->set.s[i].bounding_radius;
        if ((cells->key[i] == SPRINGLS__LARGE_KEY) != springls__is_large(radius)) return false;
        if (cells->key[i] != SPRINGLS__LARGE_KEY) largest = springls__max(largest, radius);
    }
    cells->bounding_radius = largest;
    return true;
}

/* Builds the lists if springls have changed since they were built. */
SPRINGLS__FN springls_status springls__cell_list_build(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    size_t n = (size_t)ctx->model.set.count;
    uint32_t before = 0;
    int i;
    if (ctx->cells_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow_all(ctx, SPRINGLS__BIT(KEY) | SPRINGLS__BIT(IDS) | SPRINGLS__BIT(LARGE), n + 1, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_PLACES, n + 8, 0));
    if (ctx->on_device) {
        springls_status status;
        ctx->particles_listed = false;
        status = (ctx->backend->cell_list_build)(ctx);
        ctx->cells_fresh = status == SPRINGLS_OK;
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    if (ctx->particles_listed) {
        SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY), 0));
        ctx->cells_fresh = springls__update_radii(&ctx->model);
        if (ctx->cells_fresh) return SPRINGLS_OK;
    }
    ctx->particles_listed = false; /* until all of the list is new */
    SPRINGLS__TRY(springls__cell_keys(ctx));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY) | SPRINGLS__BIT(ACTIVE),
                                    SPRINGLS__BIT(IDS) | SPRINGLS__BIT(PLACES) | SPRINGLS__BIT(LARGE) | SPRINGLS__BIT(CELL)));
    springls__count_cells(&ctx->model);
    for (i = 0; i < g->active_count; i++) before = springls__scan_cells(springls__cells_of(g, g->active[i]), before);
    for (i = 0; i < ctx->model.set.count; i++) springls__put_in_cell(&ctx->model, i);
    springls__fill_last_places(&ctx->model);
    ctx->cells_fresh = ctx->particles_listed = true;
    return SPRINGLS_OK;
}

/* Makes all bricks within one cell of a particle active, also of the large springls, which are in no cell. */
SPRINGLS__FN springls_status springls__cell_list_cover_around(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, d, n = 0, *missing;
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (ctx->on_device) {
        springls_status status = (ctx->backend->cell_list_cover_around)(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx,
                                    SPRINGLS__BIT(S) | SPRINGLS__BIT(LARGE) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(SLOT_BRICK)
                                        | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(ACTIVE),
                                    0));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, missing_bricks, 26 * ((size_t)g->active_count + (size_t)ctx->model.cells.large_count)));
    missing = springls__missing_bricks(&ctx->model);
    for (i = 0; i < g->active_count + ctx->model.cells.large_count; i++) {
        int origin[3], at[3];
        uint32_t around = springls__bricks_to_cover(&ctx->model, i, origin);
        for (d = 0; d < 27 && around; d++)
            if ((around >> d & 1u) && springls__brick_around(g, origin, d, at)
                && springls__slot_at(g, at[0], at[1], at[2]) < SPRINGLS__FIRST_SLOT)
                missing[n++] = springls__brick_at(g, at[0], at[1], at[2]);
    }
    return springls__grid_add_bricks(ctx, missing, n);
}

#endif
