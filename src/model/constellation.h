/* constellation.h - the arrays of springls: room, finishing touches, stable compaction. */
#ifndef SPRINGLS__MODEL_CONSTELLATION_H
#define SPRINGLS__MODEL_CONSTELLATION_H

#include "../runtime/arrays.h"
#include "../runtime/kernel_table.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"

/* Room for count springls, keeping those that are there. */
SPRINGLS__FN springls_status springls__constellation_reserve(springls_context *ctx, int count)
{
    int array;
    for (array = SPRINGLS__ARRAY_S; array <= SPRINGLS__ARRAY_SYNCED_POSITION; array++)
        SPRINGLS__TRY(springls__grow(ctx, (springls__array)array, (size_t)count, (size_t)ctx->model.set.count));
    return SPRINGLS_OK;
}

/* Springls have been put behind the others by springls__springl_add. */
SPRINGLS__FN void springls__constellation_added(springls_context *ctx, int added)
{
    ctx->model.set.count += added;
    ctx->model.set.next_id += (uint32_t)added;
}

/* Appends one springl with a fresh id; room must have been reserved. */
SPRINGLS__FN int springls__constellation_append(springls_context *ctx, const springls__springl *s, springls__v3 a,
                                                uint32_t generation, uint8_t mask)
{
    int i = ctx->model.set.count;
    SPRINGLS_ASSERT((size_t)i < ctx->memory[SPRINGLS__ARRAY_SYNCED_POSITION].bytes / sizeof(springls__v3)); /* the last array to be grown */
    springls__springl_add(&ctx->model, i, springls__springl_finished(*s), a, generation, mask);
    springls__constellation_added(ctx, 1);
    return i;
}

/* Drops every springl whose byte in SCRATCH1 is 0; the others stay in order. */
SPRINGLS__FN springls_status springls__constellation_compact(springls_context *ctx)
{
    const uint8_t *keep = (const uint8_t *)ctx->model.scratch[1];
    int array, i, n = 0, count = ctx->model.set.count;
    if (ctx->on_device) {
        springls_status status = ctx->backend->constellation_compact(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(SCRATCH1), SPRINGLS__SET_BITS));
    for (array = SPRINGLS__ARRAY_S; array <= SPRINGLS__ARRAY_SYNCED_POSITION; array++) {
        char *data = (char *)ctx->memory[array].data;
        size_t element = springls__element_size((springls__array)array);
        for (i = n = 0; i < count; i++) {
            if (!keep[i]) continue;
            if (n != i) memcpy(data + (size_t)n * element, data + (size_t)i * element, element);
            n++;
        }
    }
    ctx->model.set.count = n;
    return SPRINGLS_OK;
}

/* To be called when the level set has been made to follow the springls: carry_level_set measures motion from here on. */
SPRINGLS__FN void springls__mark_phi_synced(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_mark_phi_synced, ctx->model.set.count, springls__no_job());
}

/* The longest way of any particle since then, voxels. In SCRATCH7. */
SPRINGLS__FN springls_status springls__displacement_since_phi(springls_context *ctx, float *way)
{
    SPRINGLS__TRY(springls__scratch(ctx, 7, (size_t)ctx->model.set.count, sizeof(float), NULL));
    springls__run(ctx, SPRINGLS__KERNEL_displacement, ctx->model.set.count, springls__no_job());
    *way = springls__sqrt(springls__largest(ctx, 7, ctx->model.set.count));
    return SPRINGLS_OK;
}

/* To be called after anything that moves springls. */
SPRINGLS__FN void springls__constellation_moved(springls_context *ctx)
{
    ctx->cells_fresh = false;
    ctx->omega_fresh = false;
    ctx->model_fresh = false;
}

/* To be called after anything that adds, removes or replaces springls. */
SPRINGLS__FN void springls__constellation_changed(springls_context *ctx)
{
    springls__constellation_moved(ctx);
    ctx->neighbors_age = -1;
}

#endif
