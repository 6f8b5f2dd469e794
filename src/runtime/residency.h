/* residency.h - where the arrays of the model are: on the host, on the backend's device, or on both with one copy stale.
   Kernels leave on the device what they write. Host code calls springls__to_host before it reads or writes arrays, and only those
   are copied.

   Why no stage asks where an array is: each kernel's row says what it writes (kernels.h), and each host function what it reads and writes.
   From both follows what has to be copied, and when; a step whose stages all run on the device copies little but counts.

        kernel writes S      host copy of S is stale          springls__to_host(reads S)      copied, once
        host writes S        device copy of S is stale        the next kernel                 copied, once

   The same declarations number the versions of the model (springls__note_writes), by which whatever is derived knows that it is old. */
#ifndef SPRINGLS__RUNTIME_RESIDENCY_H
#define SPRINGLS__RUNTIME_RESIDENCY_H

#include "arrays.h"
#include "errors.h"

/* What a level set consists of. */
#define SPRINGLS__LEVEL_SET_BITS                                                                                                 \
    (SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PLANE) | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(SLOT_BRICK))

/* Notes that phi_next may not have phi in all bricks that are asleep. */
SPRINGLS__FN void springls__phi_not_kept(springls_context *ctx)
{
    ctx->work.keeps_phi = false;
    ctx->model.grid.phi_kept = 0;
}

/* Notes that arrays are being written: what was found from the level set is out of date when one of its arrays is. Kernels and
   springls__to_host do so by the arrays that they declare; what swaps, clears or puts back whole arrays does so itself. */
SPRINGLS__FN void springls__note_writes(springls_context *ctx, uint64_t writes)
{
    if (writes & SPRINGLS__LEVEL_SET_BITS) ctx->phi_version++;
    if (writes & (SPRINGLS__LEVEL_SET_BITS | SPRINGLS__SET_BITS)) ctx->model_version++;
    if (writes & (SPRINGLS__LEVEL_SET_BITS | SPRINGLS__BIT(S) | SPRINGLS__BIT(EDGE))) ctx->shape_version++;
    if (writes & (SPRINGLS__LEVEL_SET_BITS | SPRINGLS__BIT(PHI_NEXT) | SPRINGLS__BIT(AWAKE))) springls__phi_not_kept(ctx);
}

/* Replaces phi by phi_next. */
SPRINGLS__FN void springls__swap_phi(springls_context *ctx)
{
    const bool kept = ctx->work.keeps_phi;
    springls__swap(ctx, SPRINGLS__ARRAY_PHI, SPRINGLS__ARRAY_PHI_NEXT);
    springls__note_writes(ctx, SPRINGLS__BIT(PHI));
    ctx->model.grid.phi_kept = kept;
}

/* Returns the version of what components are found from: the level set or, where the surface is what springls hold, those too. */
SPRINGLS__FN uint64_t springls__components_source(const springls_context *ctx)
{
    return ctx->model.params.contouring == SPRINGLS_CONTOURING_SPRINGLS ? ctx->shape_version : ctx->phi_version;
}

/* Returns how many elements of an array are in use. */
SPRINGLS__FN size_t springls__used(const springls_context *ctx, springls__array array)
{
    const springls__model *m = &ctx->model;
    size_t all = ctx->memory[array].bytes / springls__element_size(array), used = all;
    if (springls__has_array(SPRINGLS__SET_BITS | SPRINGLS__SEARCH_BITS, (int)array))
        used = (size_t)m->set.count + (size_t)ctx->work.added; /* with those that a stage has stored and not yet counted */
    else if (springls__has_array(SPRINGLS__SLOT_BITS, (int)array)) used = (size_t)m->grid.slot_count;
    else if (array == SPRINGLS__ARRAY_TOP) used = springls__entry_count(&m->grid);
    else if (array == SPRINGLS__ARRAY_REFERENCE_TOP) used = springls__entry_count(&m->reference);
    return used < all ? used : all;
}

/* Copies an array to the host or to the device. */
SPRINGLS__FN springls_status springls__transfer(springls_context *ctx, springls__array array, bool to_host)
{
    springls__buffer *buffer = &ctx->memory[array];
    size_t bytes = springls__used(ctx, array) * springls__element_size(array);
    SPRINGLS__TRY((ctx->backend->transfer)(ctx, buffer, bytes < buffer->device_bytes ? bytes : buffer->device_bytes, to_host));
    if (to_host) buffer->host_stale = false;
    else buffer->device_stale = false;
    return SPRINGLS_OK;
}

/* Leaves the backend after a failure, whose reason is in ctx->error: copies to the host what is only on the device, so that the
   host can go on from there. Fails when a copy fails: then the model is lost. */
SPRINGLS__FN springls_status springls__fall_back_to_host(springls_context *ctx)
{
    int array;
    char error[sizeof ctx->error];
    memcpy(error, ctx->error, sizeof error);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (buffer->host_stale && !ctx->lost) ctx->lost = springls__transfer(ctx, (springls__array)array, true) != SPRINGLS_OK;
        buffer->device_bytes = 0;
        buffer->host_stale = buffer->device_stale = false;
    }
    (ctx->backend->release)(ctx);
    ctx->backend = NULL;
    ctx->on_device = false;
    ctx->backend_status = springls__fail(ctx, SPRINGLS_DEVICE_FAILED, "%.180s; going on without the device%s", error,
                                         ctx->lost ? ", the model is lost" : "");
    return ctx->lost ? SPRINGLS_DEVICE_FAILED : SPRINGLS_OK;
}

/* Returns true when the host has to repeat a call of the backend that ended with *status, because the device has failed. Else
   *status is the result: that of the device, or the failure to copy the model to the host. */
SPRINGLS__FN bool springls__repeat_on_host(springls_context *ctx, springls_status *status)
{
    if (*status != SPRINGLS_DEVICE_FAILED) return false;
    if (!ctx->on_device) return true; /* the call has fallen back itself */
    *status = springls__fall_back_to_host(ctx);
    return *status == SPRINGLS_OK;
}

/* Brings arrays to the host, before it reads them (bits of `reads`) or writes some of their elements (`writes`). */
SPRINGLS__FN springls_status springls__to_host(springls_context *ctx, uint64_t reads, uint64_t writes)
{
    int array;
    springls__note_writes(ctx, writes);
    if (ctx->lost) return ctx->backend_status;
    if (!ctx->backend) return SPRINGLS_OK;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (!springls__has_array(reads | writes, array)) continue;
        if (buffer->host_stale && springls__transfer(ctx, (springls__array)array, true) != SPRINGLS_OK)
            return springls__fall_back_to_host(ctx);
        if (springls__has_array(writes, array)) buffer->device_stale = buffer->device_bytes > 0;
    }
    return SPRINGLS_OK;
}

/* Brings all arrays to the device, before a kernel runs; those that it writes become stale on the host. */
SPRINGLS__FN springls_status springls__to_device(springls_context *ctx, uint64_t writes)
{
    int array;
    springls__note_writes(ctx, writes);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (buffer->device_bytes < buffer->bytes) {
            SPRINGLS__TRY((ctx->backend->resize)(ctx, buffer, buffer->bytes,
                                               buffer->device_stale ? 0 : buffer->device_bytes));
            buffer->device_stale = !buffer->host_stale;
        }
        if (buffer->device_stale) SPRINGLS__TRY(springls__transfer(ctx, (springls__array)array, false));
        if (springls__has_array(writes, array)) buffer->host_stale = true;
    }
    return SPRINGLS_OK;
}

/* Copies the first bytes of an array to the host, for one reading: the array counts as stale there still. */
SPRINGLS__FN springls_status springls__fetch(springls_context *ctx, springls__array array, size_t bytes)
{
    if (ctx->lost) return ctx->backend_status;
    if (!ctx->memory[array].host_stale || (ctx->backend->transfer)(ctx, &ctx->memory[array], bytes, true) == SPRINGLS_OK)
        return SPRINGLS_OK;
    return springls__fall_back_to_host(ctx);
}

/* Runs kernels on the device from now on, if there is one: called by stages. */
SPRINGLS__FN void springls__use_device(springls_context *ctx) { ctx->on_device = ctx->backend != NULL; }

/* Declares the host's arrays current, without a copy: the model has been replaced. */
SPRINGLS__FN void springls__discard_device_copies(springls_context *ctx)
{
    int array;
    ctx->on_device = false;
    springls__note_writes(ctx, SPRINGLS__ALL_BITS);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        ctx->memory[array].host_stale = false;
        ctx->memory[array].device_stale = ctx->memory[array].device_bytes > 0;
    }
}

/* Drops the contents of working memory, which are undefined between stages, so that nobody transfers them. */
SPRINGLS__FN void springls__forget_work(springls_context *ctx)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (springls__has_array(SPRINGLS__WORK_BITS, array))
            ctx->memory[array].host_stale = ctx->memory[array].device_stale = false;
}

#endif
