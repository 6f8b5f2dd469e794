/* grid.h - the sparse grid (kernels_embed/grid.h): its memory, and bricks that come and go. */
#ifndef SPRINGLS__MODEL_GRID_H
#define SPRINGLS__MODEL_GRID_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/kernel_table.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"

/* What was written becomes the field. */
SPRINGLS__FN void springls__swap_phi(springls_context *ctx) { springls__swap(ctx, SPRINGLS__ARRAY_PHI, SPRINGLS__ARRAY_PHI_NEXT); }

SPRINGLS__FN void springls__fill(float *field, int slot, float value)
{
    float *brick = field + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int i;
    for (i = 0; i < SPRINGLS__BRICK_VOXELS; i++) brick[i] = value;
}

/* The constant bricks of omega. */
SPRINGLS__FN void springls__omega_constant(springls_context *ctx, float outside, float inside)
{
    springls__job job = springls__no_job();
    job.f[0] = outside;
    job.f[1] = inside;
    springls__run(ctx, SPRINGLS__KERNEL_omega_constant, SPRINGLS__FIRST_SLOT * SPRINGLS__BRICK_VOXELS, job);
}

/* Room for `slots` slots. */
SPRINGLS__FN springls_status springls__grid_reserve(springls_context *ctx, int slots)
{
    const springls__grid *g = &ctx->model.grid;
    size_t n = (size_t)slots, used = (size_t)g->slot_count;
    int array;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_SLOT_BRICK, n, used));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_ACTIVE, n, (size_t)g->active_count));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_FREE_SLOTS, n, (size_t)g->free_count));
    for (array = SPRINGLS__ARRAY_PHI; array <= SPRINGLS__ARRAY_CELL; array++) SPRINGLS__TRY(springls__grow(ctx, (springls__array)array, n, used));
    return SPRINGLS_OK;
}

/* The constant bricks of a grid, far outside and far inside. */
SPRINGLS__FN void springls__grid_constants(const springls_context *ctx, springls__grid *g)
{
    g->far_value = ctx->model.params.band_half_width + 1.0f;
    springls__fill(g->phi, SPRINGLS__OUTSIDE, g->far_value);
    springls__fill(g->phi, SPRINGLS__INSIDE, -g->far_value);
}

/* ... and what the model's grid has besides. */
SPRINGLS__FN void springls__model_constants(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int slot;
    springls__grid_constants(ctx, g);
    for (slot = 0; slot < SPRINGLS__FIRST_SLOT; slot++) {
        g->slot_brick[slot] = -1;
        springls__fill(g->phi_next, slot, g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS]);
        springls__fill(g->omega, slot, ctx->model.params.capture_range);
        memset(g->cell + (size_t)slot * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    }
}

/* Everything of a grid outside: keeps memory. */
SPRINGLS__FN void springls__grid_clear(springls_context *ctx, springls__grid *g)
{
    size_t i, bricks = springls__brick_count(g);
    for (i = 0; i < bricks; i++) g->top[i] = SPRINGLS__OUTSIDE;
    g->active_count = g->free_count = 0;
    g->slot_count = SPRINGLS__FIRST_SLOT;
    springls__grid_constants(ctx, g);
}

/* The model and its reference are empty. */
SPRINGLS__FN void springls__grids_clear(springls_context *ctx)
{
    springls__discard_device_copies(ctx);
    springls__grid_clear(ctx, &ctx->model.reference);
    springls__grid_clear(ctx, &ctx->model.grid);
    springls__model_constants(ctx);
    ctx->reference_stamp = 0;
}

SPRINGLS__FN springls_status springls__grids_create(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        g->size[axis] = ctx->desc.grid.size[axis];
        g->bricks[axis] = (g->size[axis] + 7) / 8;
    }
    ctx->model.reference = *g;
    ctx->model.group = springls__alone();
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_TOP, springls__brick_count(g), 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, springls__brick_count(g), 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, SPRINGLS__FIRST_SLOT, 0));
    SPRINGLS__TRY(springls__grid_reserve(ctx, SPRINGLS__FIRST_SLOT));
    springls__grids_clear(ctx);
    return SPRINGLS_OK;
}

/* Gives every brick of the list (any order, repetitions and present bricks allowed) a slot that continues the constant
   it had, and keeps `active` ordered by brick. */
SPRINGLS__FN springls_status springls__grid_add_bricks(springls_context *ctx, int *list, int count)
{
    springls__grid *g = &ctx->model.grid;
    int i, n = 0, write, read;
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(FREE_SLOTS) | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__BIT(OMEGA) | SPRINGLS__BIT(CELL)));
    qsort(list, (size_t)count, sizeof *list, springls__compare_int);
    for (i = 0; i < count; i++)
        if (g->top[list[i]] < SPRINGLS__FIRST_SLOT && (n == 0 || list[n - 1] != list[i])) list[n++] = list[i];
    if (n == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_reserve(ctx, g->slot_count + n));
    write = g->active_count + n - 1;
    read = g->active_count - 1;
    g->active_count += n;
    for (i = n - 1; i >= 0; i--) { /* merge from the back */
        int slot = g->free_count ? g->free_slots[--g->free_count] : g->slot_count++;
        int side = g->top[list[i]];
        while (read >= 0 && g->slot_brick[g->active[read]] > list[i]) g->active[write--] = g->active[read--];
        g->active[write--] = slot;
        g->slot_brick[slot] = list[i];
        g->top[list[i]] = slot;
        springls__fill(g->phi, slot, side == SPRINGLS__INSIDE ? -g->far_value : g->far_value);
        springls__fill(g->phi_next, slot, side == SPRINGLS__INSIDE ? -g->far_value : g->far_value);
        springls__fill(g->omega, slot, -1.0f); /* unknown */
        memset(g->cell + (size_t)slot * SPRINGLS__CELLS, 0, SPRINGLS__CELLS * sizeof *g->cell);
    }
    return SPRINGLS_OK;
}

/* Drops the active slots with keep[i] == 0 (i: place in `active`); their bricks become constant. */
SPRINGLS__FN void springls__grid_drop_bricks(springls__grid *g, const uint8_t *keep)
{
    int i, n = 0;
    for (i = 0; i < g->active_count; i++) {
        int slot = g->active[i];
        if (keep[i]) {
            g->active[n++] = slot;
            continue;
        }
        g->top[g->slot_brick[slot]] = g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
        g->slot_brick[slot] = -1;
        g->free_slots[g->free_count++] = slot;
    }
    g->active_count = n;
}

/* phi_ref = phi: the same slots. */
SPRINGLS__FN springls_status springls__reference_copy(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    springls__grid *reference = &ctx->model.reference;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, (size_t)g->slot_count, 0));
    reference->far_value = g->far_value;
    reference->slot_count = g->slot_count;
    memcpy(reference->top, g->top, springls__brick_count(g) * sizeof *g->top);
    memcpy(reference->phi, g->phi, (size_t)g->slot_count * SPRINGLS__BRICK_VOXELS * sizeof *g->phi);
    return SPRINGLS_OK;
}

#endif
