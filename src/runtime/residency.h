/* coherence.h - with a backend every array has a twin on the device. Kernels keep what they write there; host code says what it is
   about to read and write, and only that is brought here, once. */
#ifndef SPRINGLS__RUNTIME_RESIDENCY_H
#define SPRINGLS__RUNTIME_RESIDENCY_H

#include "arrays.h"
#include "errors.h"
#include "kernel_table.h"

/* How many elements of an array are in use. */
SPRINGLS__FN size_t springls__used(const springls_context *ctx, springls__array array)
{
    const springls__model *m = &ctx->model;
    size_t all = ctx->memory[array].bytes / springls__element_size(array), used = all;
    if (array <= SPRINGLS__ARRAY_SYNCED_POSITION || array == SPRINGLS__ARRAY_IDS || array == SPRINGLS__ARRAY_KEY
        || array == SPRINGLS__ARRAY_NEIGHBORS)
        used = (size_t)m->set.count;
    else if (array >= SPRINGLS__ARRAY_SLOT_BRICK && array <= SPRINGLS__ARRAY_CELL)
        used = (size_t)m->grid.slot_count;
    return used < all ? used : all;
}

/* Brings an array to the host or to the device. */
SPRINGLS__FN springls_status springls__transfer(springls_context *ctx, springls__array array, bool to_host)
{
    springls__buffer *buffer = &ctx->memory[array];
    size_t bytes = springls__used(ctx, array) * springls__element_size(array);
    SPRINGLS__TRY(ctx->backend->transfer(ctx, buffer, bytes < buffer->device_bytes ? bytes : buffer->device_bytes, to_host));
    if (to_host) buffer->host_stale = false;
    else buffer->device_stale = false;
    return SPRINGLS_OK;
}

#define SPRINGLS__ALL_BITS (((uint64_t)1 << SPRINGLS__ARRAY_COUNT) - 1)

/* The backend has failed, as ctx->error says: what is only on its device is brought here, and what was to be done there goes on here
   from where it was. A failure when not even that can be: the model is lost. */
SPRINGLS__FN springls_status springls__fall_back_to_host(springls_context *ctx)
{
    int array;
    char error[sizeof ctx->error];
    memcpy(error, ctx->error, sizeof error);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (buffer->host_stale && !ctx->lost) ctx->lost = springls__transfer(ctx, (springls__array)array, true) != SPRINGLS_OK;
        if (buffer->device) ctx->backend->release(ctx, buffer);
        buffer->host_stale = buffer->device_stale = false;
    }
    ctx->backend = NULL;
    ctx->on_device = false;
    ctx->backend_status = springls__fail(ctx, SPRINGLS_DEVICE_FAILED, "%.180s; going on without the device%s", error,
                                         ctx->lost ? ", the model is lost" : "");
    return ctx->lost ? SPRINGLS_DEVICE_FAILED : SPRINGLS_OK;
}

/* After a call of the backend that gave *status: true when the device has failed in it and the host can do the same instead.
   False when *status is the result: of the device, or the failure to bring the model to the host. */
SPRINGLS__FN bool springls__repeat_on_host(springls_context *ctx, springls_status *status)
{
    if (*status != SPRINGLS_DEVICE_FAILED) return false;
    if (!ctx->on_device) return true; /* the call has fallen back itself */
    *status = springls__fall_back_to_host(ctx);
    return *status == SPRINGLS_OK;
}

/* To be called before host code reads arrays of the model, or writes some of their elements. */
SPRINGLS__FN springls_status springls__to_host(springls_context *ctx, uint64_t reads, uint64_t writes)
{
    int array;
    if (ctx->lost) return ctx->backend_status;
    if (!ctx->backend) return SPRINGLS_OK;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (!((reads | writes) >> array & 1u)) continue;
        if (buffer->host_stale && springls__transfer(ctx, (springls__array)array, true) != SPRINGLS_OK)
            return springls__fall_back_to_host(ctx);
        if (writes >> array & 1u) buffer->device_stale = buffer->device != NULL;
    }
    return SPRINGLS_OK;
}

/* What a kernel may touch is on the device; what it writes is only there. */
SPRINGLS__FN springls_status springls__to_device(springls_context *ctx, uint64_t writes)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        springls__buffer *buffer = &ctx->memory[array];
        if (buffer->device_bytes < buffer->bytes) {
            SPRINGLS__TRY(ctx->backend->resize(ctx, buffer, buffer->bytes,
                                               buffer->device_stale || !buffer->device ? 0 : buffer->device_bytes));
            buffer->device_stale = !buffer->host_stale;
        }
        if (buffer->device_stale) SPRINGLS__TRY(springls__transfer(ctx, (springls__array)array, false));
        if (writes >> array & 1u) buffer->host_stale = true;
    }
    return SPRINGLS_OK;
}

/* The first bytes of an array, to be read here and then forgotten. */
SPRINGLS__FN springls_status springls__fetch(springls_context *ctx, springls__array array, size_t bytes)
{
    if (ctx->lost) return ctx->backend_status;
    if (!ctx->memory[array].host_stale || ctx->backend->transfer(ctx, &ctx->memory[array], bytes, true) == SPRINGLS_OK)
        return SPRINGLS_OK;
    return springls__fall_back_to_host(ctx);
}

/* From now on kernels run on the device, where there is one: for stages. */
SPRINGLS__FN void springls__use_device(springls_context *ctx) { ctx->on_device = ctx->backend != NULL; }

/* Whatever the device has is of no use any more. */
SPRINGLS__FN void springls__discard_device_copies(springls_context *ctx)
{
    int array;
    ctx->on_device = false;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        ctx->memory[array].host_stale = false;
        ctx->memory[array].device_stale = ctx->memory[array].device != NULL;
    }
}

/* Working memory of stages: what it holds is of no use to whoever comes after them. */
#define SPRINGLS__SCRATCH_BITS                                                                                                      \
    ((uint64_t)0xff * SPRINGLS__BIT(SCRATCH0) | SPRINGLS__BIT(COUNTS) | SPRINGLS__BIT(SUMS) | SPRINGLS__BIT(BRICK_FLAG) |        \
     SPRINGLS__BIT(NEW_SLOTS) | SPRINGLS__BIT(SPARE))

SPRINGLS__FN void springls__forget_work(springls_context *ctx)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (SPRINGLS__SCRATCH_BITS >> array & 1u) ctx->memory[array].host_stale = ctx->memory[array].device_stale = false;
}

#endif
