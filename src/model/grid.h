/* grid.h - the memory of the sparse grid (kernels_embed/model/grid.h), and bricks that come and go. */
#ifndef SPRINGLS__MODEL_GRID_H
#define SPRINGLS__MODEL_GRID_H

#include "../runtime/algorithms.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "top_table.h"

/* Sets all voxels of a slot. */
SPRINGLS__FN void springls__fill(float *field, int slot, float value)
{
    float *brick = field + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    int i;
    for (i = 0; i < SPRINGLS__BRICK_VOXELS; i++) brick[i] = value;
}

/* Sets the constant bricks of omega. */
SPRINGLS__FN void springls__omega_constant(springls_context *ctx, float outside, float inside)
{
    springls__arguments args;
    args.omega_constant.outside = outside;
    args.omega_constant.inside = inside;
    springls__run(ctx, SPRINGLS__KERNEL_omega_constant, SPRINGLS__FIRST_SLOT * SPRINGLS__BRICK_VOXELS, &args);
}

/* Makes room for count slots; keeps those that are there. */
SPRINGLS__FN springls_status springls__grid_reserve(springls_context *ctx, int count)
{
    return springls__grow_all(ctx, SPRINGLS__SLOT_BITS, (size_t)count, (size_t)ctx->model.grid.slot_count);
}

/* Sets the constant bricks of a grid's phi, far outside and far inside. */
SPRINGLS__FN void springls__grid_constants(const springls_context *ctx, springls__grid *g)
{
    g->far_value = ctx->model.params.band_half_width + 1.0f;
    springls__fill(g->phi, SPRINGLS__OUTSIDE, g->far_value);
    springls__fill(g->phi, SPRINGLS__INSIDE, -g->far_value);
}

/* Sets all fields of the constant bricks of the model's grid. */
SPRINGLS__FN void springls__model_constants(springls_context *ctx)
{
    springls__grid *g = &ctx->model.grid;
    int slot;
    springls__grid_constants(ctx, g);
    for (slot = 0; slot < SPRINGLS__FIRST_SLOT; slot++) {
        g->slot_brick[slot] = -1;
        springls__fill(g->phi_next, slot, g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS]);
        springls__fill(g->omega, slot, ctx->model.params.capture_range);
        springls__clear_cells(springls__cells_of(g, slot));
        springls__wake_slot(g, slot);
    }
}

/* Wakes all bricks: before springls or phi change anywhere but in a step, and where all of phi is made anew. */
SPRINGLS__FN void springls__wake_all(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_wake, ctx->model.grid.slot_count, NULL);
    ctx->model.grid.some_asleep = 0;
    ctx->at_rest = false;
}

/* Empties a grid: all of it is outside; keeps memory. */
SPRINGLS__FN void springls__grid_clear(springls_context *ctx, springls__grid *g)
{
    springls__note_writes(ctx, SPRINGLS__LEVEL_SET_BITS);
    springls__table_clear(g);
    g->active_count = g->free_count = 0;
    g->slot_count = SPRINGLS__FIRST_SLOT;
    g->some_asleep = 0;
    springls__grid_constants(ctx, g);
}

/* Empties the model's grid and its reference: all is outside. */
SPRINGLS__FN void springls__grids_clear(springls_context *ctx)
{
    springls__discard_device_copies(ctx);
    springls__grid_clear(ctx, &ctx->model.reference);
    springls__grid_clear(ctx, &ctx->model.grid);
    springls__model_constants(ctx);
    ctx->reference_stamp = 0;
}

/* Makes the model's grid and its reference, all outside, of the size in the description. */
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
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_TOP, 1, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, 1, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_PLANE, 6 * SPRINGLS__MOST_PLANES, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PLANE, 6 * SPRINGLS__MOST_PLANES, 0));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, SPRINGLS__FIRST_SLOT, 0));
    SPRINGLS__TRY(springls__reserve_counts(ctx));
    SPRINGLS__TRY(springls__grid_reserve(ctx, SPRINGLS__FIRST_SLOT));
    springls__grids_clear(ctx);
    return SPRINGLS_OK;
}

/* Counts the slots that n new bricks take (springls__slot_of_new). */
SPRINGLS__FN void springls__take_slots(springls__grid *g, int n)
{
    int reused = springls__imin(n, g->free_count);
    g->free_count -= reused;
    g->slot_count += n - reused;
}

/* ---- bricks come and go: begin, flag those to have (springls__mark, brick_flag), count, change ---- */

/* Begins a change: flags the bricks that are active, or none. */
SPRINGLS__FN springls_status springls__flags_begin(springls_context *ctx, bool keep)
{
    const size_t entries = springls__entry_count(&ctx->model.grid);
    springls__arguments args;
    args.brick_flag.keep = keep;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_BRICK_FLAG, entries + 1, 0));
    springls__run(ctx, SPRINGLS__KERNEL_bricks_begin, (int)entries + 1, &args);
    return SPRINGLS_OK;
}

/* Counts the flagged bricks, and those to add and to drop; returns the chunks of the top table that they were counted in. */
SPRINGLS__FN springls__arguments springls__count_flags(springls_context *ctx)
{
    const int entries = (int)springls__entry_count(&ctx->model.grid);
    const springls__arguments chunks = springls__chunks_of(ctx, SPRINGLS__ARRAY_TOP, entries, SPRINGLS__COUNT_BRICKS);
    springls__run(ctx, SPRINGLS__KERNEL_bricks_count, chunks.chunk.chunks, &chunks);
    springls__run(ctx, SPRINGLS__KERNEL_bricks_sums, 3, &chunks);
    springls__note_counts(ctx, SPRINGLS__COUNT_BRICKS, 4);
    return chunks;
}

/* Activates the flagged bricks, and no others. New ones are filled with the constant that they had; those dropped become constant. */
SPRINGLS__FN springls_status springls__change_bricks(springls_context *ctx, springls__arguments chunks)
{
    springls__grid *g = &ctx->model.grid;
    const int dropped = (int)springls__count_found(ctx, SPRINGLS__COUNT_BRICKS);
    const int added = (int)springls__count_found(ctx, SPRINGLS__COUNT_BRICKS_ADDED);
    springls__arguments args;
    if (dropped + added == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__grid_reserve(ctx, g->slot_count + springls__imax(added - dropped - g->free_count, 0)));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_NEW_SLOTS, (size_t)added, 0));
    springls__run(ctx, SPRINGLS__KERNEL_bricks_drop, chunks.chunk.chunks, &chunks);
    g->free_count += dropped;
    args.brick_add.chunk = chunks.chunk;
    args.brick_add.free_count = g->free_count;
    args.brick_add.slot_count = g->slot_count;
    springls__take_slots(g, added);
    springls__run(ctx, SPRINGLS__KERNEL_bricks_add, chunks.chunk.chunks, &args);
    springls__run(ctx, SPRINGLS__KERNEL_bricks_fill, added, NULL);
    g->active_count = (int)springls__count_found(ctx, SPRINGLS__COUNT_BRICKS_ACTIVE);
    return SPRINGLS_OK;
}

/* Activates the bricks that the kernel `mark` flags for `count` elements, and with `keep` leaves those that are active. Where the top
   table lacks some it is extended first to all that springls, and the bricks around active ones, can need: seldom, and so on the
   host. */
SPRINGLS__FN springls_status springls__activate_bricks(springls_context *ctx, springls__kernel mark, int count, bool keep)
{
    const uint64_t reads = SPRINGLS__BIT(S) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(SLOT_BRICK) | SPRINGLS__BIT(TOP);
    springls__arguments chunks;
    SPRINGLS__TRY(springls__flags_begin(ctx, keep));
    springls__run(ctx, mark, count, NULL);
    chunks = springls__count_flags(ctx);
    if (springls__count_found(ctx, SPRINGLS__COUNT_BRICKS_BEYOND) > 0) {
        SPRINGLS__TRY(springls__to_host(ctx, reads, 0));
        SPRINGLS__TRY(springls__table_cover(ctx, springls__groups_of_model(&ctx->model, true)));
        SPRINGLS__TRY(springls__flags_begin(ctx, keep));
        springls__run(ctx, mark, count, NULL);
        chunks = springls__count_flags(ctx);
    }
    return springls__change_bricks(ctx, chunks);
}

/* Activates every brick of a list, in any order, and with repetitions; leaves those that are active. */
SPRINGLS__FN springls_status springls__grid_add_bricks(springls_context *ctx, const int *list, int count)
{
    springls__grid *g = &ctx->model.grid;
    springls__brick_groups groups = springls__no_groups();
    int i;
    for (i = 0; i < count; i++) springls__keep_brick(g, &groups, list[i]);
    SPRINGLS__TRY(springls__table_cover(ctx, groups));
    SPRINGLS__TRY(springls__flags_begin(ctx, true));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(PLANE), SPRINGLS__BIT(BRICK_FLAG)));
    for (i = 0; i < count; i++) ctx->model.work.brick_flag[springls__entry_of_brick(g, list[i])] = 1;
    return springls__change_bricks(ctx, springls__count_flags(ctx));
}

/* Copies phi of a grid to phi_ref, in the same slots. Without memory phi_ref stays as it was. */
SPRINGLS__FN springls_status springls__copy_to_reference(springls_context *ctx, const springls__grid *g)
{
    springls__grid *reference = &ctx->model.reference;
    const size_t kept = springls__entry_count(reference);
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_TOP, springls__entry_count(g), kept));
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_REFERENCE_PHI, (size_t)g->slot_count, 0));
    reference->far_value = g->far_value;
    reference->slot_count = g->slot_count;
    springls__take_table(reference, &g->table);
    memcpy(reference->top, g->top, springls__entry_count(g) * sizeof *g->top);
    memcpy(reference->phi, g->phi, (size_t)g->slot_count * SPRINGLS__BRICK_VOXELS * sizeof *g->phi);
    return SPRINGLS_OK;
}

/* Returns the gradient of phi at a voxel by central differences. */
SPRINGLS__FN springls__v3 springls__voxel_gradient(const springls__grid *g, int x, int y, int z)
{
    return springls__v3_make(0.5f * (springls__grid_phi(g, g->phi, x + 1, y, z) - springls__grid_phi(g, g->phi, x - 1, y, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y + 1, z) - springls__grid_phi(g, g->phi, x, y - 1, z)),
                             0.5f * (springls__grid_phi(g, g->phi, x, y, z + 1) - springls__grid_phi(g, g->phi, x, y, z - 1)));
}

/* Returns whether any voxel is inside. */
SPRINGLS__FN bool springls__has_inside(const springls__grid *g)
{
    size_t i, entries = springls__entry_count(g);
    int k, v;
    for (i = 0; i < entries; i++)
        if (g->top[i] == SPRINGLS__INSIDE) return true;
    for (k = 0; k < g->active_count; k++)
        for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++)
            if (g->phi[(size_t)g->active[k] * SPRINGLS__BRICK_VOXELS + (size_t)v] < 0.0f) return true;
    return false;
}

#endif
