/* cells.h - the hash grid (section 4.8): springls by the cell of their particle, by counting sort. Deterministic: ids ascend
   within a cell, and no cell overflows. A springl whose reach exceeds the cap is kept in `large` instead,
   so that one huge triangle does not widen every search. */
#ifndef SPRINGLS__MODEL_CELL_LIST_H
#define SPRINGLS__MODEL_CELL_LIST_H

#include "../runtime/arrays.h"
#include "../runtime/kernel_table.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "grid.h"

/* Every particle's cell, its brick being made active if need be. */
SPRINGLS__FN springls_status springls__cell_keys(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, n = 0, *missing;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_KEY, (size_t)ctx->model.set.count + 1, 0));
    SPRINGLS__TRY(springls__scratch(ctx, 0, (size_t)ctx->model.set.count, sizeof(int), (void **)&missing));
    springls__run(ctx, SPRINGLS__KERNEL_cell_key, ctx->model.set.count, springls__no_job());
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY), 0));
    for (i = 0; i < ctx->model.set.count; i++) {
        springls__v3 p = ctx->model.set.s[i].p;
        if (ctx->model.cells.key[i] == SPRINGLS__MISSING_KEY)
            missing[n++] = springls__brick_at(g, springls__cell_coordinate(p.x, g->size[0]),
                                              springls__cell_coordinate(p.y, g->size[1]),
                                              springls__cell_coordinate(p.z, g->size[2]));
    }
    if (n == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_add_bricks(ctx, missing, n));
    springls__run(ctx, SPRINGLS__KERNEL_cell_key, ctx->model.set.count, springls__no_job());
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__cell_list_build(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    springls__cell_list *cells = &ctx->model.cells;
    const springls__springl *s = ctx->model.set.s;
    size_t n = (size_t)ctx->model.set.count;
    uint32_t running = 0;
    int i, c;
    if (ctx->cells_fresh) return SPRINGLS_OK;
    if (ctx->on_device) {
        springls_status status = ctx->backend->cells_build(ctx);
        ctx->cells_fresh = status == SPRINGLS_OK;
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__cell_keys(ctx));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_IDS, n + 1, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_LARGE, n + 1, 0));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(KEY) | SPRINGLS__BIT(ACTIVE),
                                    SPRINGLS__BIT(IDS) | SPRINGLS__BIT(LARGE) | SPRINGLS__BIT(CELL)));
    cells->bounding_radius = 0.0f;
    cells->large_count = 0;
    for (i = 0; i < g->active_count; i++)
        memset(g->cell + (size_t)g->active[i] * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    for (i = 0; i < ctx->model.set.count; i++) { /* count, one place late: see the scan */
        if (cells->key[i] == SPRINGLS__LARGE_KEY) {
            cells->large[cells->large_count++] = (uint32_t)i;
            continue;
        }
        cells->bounding_radius = springls__max(cells->bounding_radius, s[i].bounding_radius);
        g->cell[cells->key[i]]++;
    }
    for (i = 0; i < g->active_count; i++) { /* scan: entry c+1 becomes where cell c starts */
        uint32_t *cell = g->cell + (size_t)g->active[i] * SPRINGLS__CELLS;
        cell[0] = running;
        for (c = 1; c < SPRINGLS__CELLS; c++) {
            uint32_t count = cell[c];
            cell[c] = running;
            running += count;
        }
    }
    for (i = 0; i < ctx->model.set.count; i++) /* scatter: entry c+1 moves on to where cell c ends */
        if (cells->key[i] != SPRINGLS__LARGE_KEY) cells->ids[g->cell[cells->key[i]]++] = (uint32_t)i;
    ctx->cells_fresh = true;
    return SPRINGLS_OK;
}

/* Bricks within one cell of any particle; those of the large springls too, which are in no cell. */
SPRINGLS__FN springls_status springls__cell_list_cover_around(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int i, d, n = 0, *missing;
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    if (ctx->on_device) {
        springls_status status = ctx->backend->cells_cover_around(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx,
                                    SPRINGLS__BIT(S) | SPRINGLS__BIT(LARGE) | SPRINGLS__BIT(CELL) | SPRINGLS__BIT(SLOT_BRICK)
                                        | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(ACTIVE),
                                    0));
    SPRINGLS__TRY(springls__scratch(ctx, 0, 26 * ((size_t)g->active_count + (size_t)ctx->model.cells.large_count), sizeof(int),
                                    (void **)&missing));
    for (i = 0; i < g->active_count + ctx->model.cells.large_count; i++) {
        uint32_t reach = ~0u;
        int o[3];
        if (i < g->active_count) {
            springls__slot_origin(g, g->active[i], o);
            reach = springls__cells_neighbor_mask(g->cell + (size_t)g->active[i] * SPRINGLS__CELLS);
        } else {
            springls__v3 p = ctx->model.set.s[ctx->model.cells.large[i - g->active_count]].p;
            o[0] = springls__cell_coordinate(p.x, g->size[0]) & ~7;
            o[1] = springls__cell_coordinate(p.y, g->size[1]) & ~7;
            o[2] = springls__cell_coordinate(p.z, g->size[2]) & ~7;
        }
        for (d = 0; d < 27 && reach; d++) {
            int x = o[0] + 8 * (d % 3 - 1), y = o[1] + 8 * (d / 3 % 3 - 1), z = o[2] + 8 * (d / 9 - 1);
            if (!(reach >> d & 1u) || !springls__grid_contains(g, x, y, z)) continue;
            if (springls__slot_at(g, x, y, z) < SPRINGLS__FIRST_SLOT) missing[n++] = springls__brick_at(g, x, y, z);
        }
    }
    return springls__grid_add_bricks(ctx, missing, n);
}

#endif
