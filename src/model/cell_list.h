/* cell_list.h - the hash grid (section 4.8): lists springls by the cell of their particle, by counting sort. Numbers ascend in a
   cell, and no cell overflows. A springl with too large a bounding radius is in the list `unbinned` instead, so that one huge
   triangle does not widen every search; so is one whose particle lies outside all active bricks: the list leaves the grid as it
   is. Stages make such bricks active first (cell_bricks.h), readers for the time of reading (solver/follow.h). */
#ifndef SPRINGLS__MODEL_CELL_LIST_H
#define SPRINGLS__MODEL_CELL_LIST_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"

/* Counts the springls of each cell, one place late for the scan, and lists those in no cell. Returns how many of these lie outside
   active bricks. */
SPRINGLS__FN int springls__count_cells(springls__model *model)
{
    springls__cell_list *cells = &model->cells;
    int i, outside = 0;
    cells->bounding_radius = 0.0f;
    cells->unbinned_count = 0;
    for (i = 0; i < model->grid.active_count; i++) springls__clear_cells(springls__cells_of(&model->grid, model->grid.active[i]));
    for (i = 0; i < model->set.count; i++) {
        if (springls__is_in_cell(cells->key[i])) {
            cells->bounding_radius = springls__max(cells->bounding_radius, model->set.s[i].bounding_radius);
            springls__count_in_cell(model, i);
            continue;
        }
        cells->unbinned[cells->unbinned_count++] = (uint32_t)i;
        outside += cells->key[i] == SPRINGLS__OUTSIDE_KEY;
    }
    return outside;
}

/* Finds the largest bounding radius after triangles have changed. Returns false where a springl has become too large, or is no
   longer, or is outside: the list is to be built anew then. */
SPRINGLS__FN bool springls__update_radii(springls__model *model)
{
    springls__cell_list *cells = &model->cells;
    float largest = 0.0f;
    int i;
    for (i = 0; i < model->set.count; i++) {
        float radius = model->set.s[i].bounding_radius;
        if (springls__is_in_cell(cells->key[i]) == springls__is_large(radius)) return false;
        if (springls__is_in_cell(cells->key[i])) largest = springls__max(largest, radius);
    }
    cells->bounding_radius = largest;
    return true;
}

/* Builds the lists if springls have changed since they were built. ctx->particles_outside: how many lie outside active bricks. */
SPRINGLS__FN springls_status springls__cell_list_build(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    size_t n = (size_t)ctx->model.set.count;
    uint32_t before = 0;
    int i;
    if (ctx->cells_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grow_all(ctx, SPRINGLS__BIT(KEY) | SPRINGLS__BIT(IDS) | SPRINGLS__BIT(UNBINNED), n + 1, 0));
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
    springls__run(ctx, SPRINGLS__KERNEL_cell_key, ctx->model.set.count, NULL);
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY) | SPRINGLS__BIT(ACTIVE),
                                    SPRINGLS__BIT(IDS) | SPRINGLS__BIT(PLACES) | SPRINGLS__BIT(UNBINNED) | SPRINGLS__BIT(CELL)));
    ctx->particles_outside = springls__count_cells(&ctx->model);
    for (i = 0; i < g->active_count; i++) before = springls__scan_cells(springls__cells_of(g, g->active[i]), before);
    for (i = 0; i < ctx->model.set.count; i++) springls__put_in_cell(&ctx->model, i);
    springls__fill_last_places(&ctx->model);
    ctx->cells_fresh = ctx->particles_listed = true;
    return SPRINGLS_OK;
}

#endif
