/* arrays.h - room for the arrays of the model and for the working memory of stages. */
#ifndef SPRINGLS__RUNTIME_ARRAYS_H
#define SPRINGLS__RUNTIME_ARRAYS_H

#include "memory.h"

/* Sets the model's pointers, after memory has moved. */
SPRINGLS__FN void springls__bind(springls_context *ctx)
{
#define SPRINGLS__BIND(name, type, block, owner, member)                                                     \
    ctx->model.owner.member = (type *)ctx->memory[SPRINGLS__ARRAY_##name].data;
    SPRINGLS__ARRAYS(SPRINGLS__BIND)
#undef SPRINGLS__BIND
}

/* Returns the bytes of an element: of a brick's 512 values where an array has those. */
SPRINGLS__FN size_t springls__element_size(springls__array array)
{
#define SPRINGLS__SIZE(name, type, block, owner, member) sizeof(type) * (block),
    static const size_t sizes[] = { SPRINGLS__ARRAYS(SPRINGLS__SIZE) 0 };
#undef SPRINGLS__SIZE
    return sizes[array];
}

/* Makes room for count elements of `element` bytes in an array of the model; keeps the first `keep`. The device's copy grows when
   a kernel next uses it (springls__to_device). */
SPRINGLS__FN springls_status springls__array_grow(springls_context *ctx, springls__array array, size_t count, size_t element,
                                                  size_t keep)
{
    springls__buffer *buffer = &ctx->memory[array];
    size_t kept = buffer->host_stale ? 0 : keep * element;
    springls_status status = springls__buffer_grow(ctx, buffer, count ? count : 1, element, kept);
    springls__bind(ctx);
    return status;
}

SPRINGLS__FN springls_status springls__grow(springls_context *ctx, springls__array array, size_t count, size_t keep)
{
    return springls__array_grow(ctx, array, count, springls__element_size(array), keep);
}

/* Makes room for count elements in each of some arrays (bits); keeps the first `keep`. */
SPRINGLS__FN springls_status springls__grow_all(springls_context *ctx, uint64_t arrays, size_t count, size_t keep)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (springls__has_array(arrays, array)) SPRINGLS__TRY(springls__grow(ctx, (springls__array)array, count, keep));
    return SPRINGLS_OK;
}

SPRINGLS__HOST_ROLES(SPRINGLS__ROLE_ACCESSOR)

/* Makes room for count elements of a role of the working memory (scratch.h); they are undefined. */
#define SPRINGLS__RESERVE(ctx, role, count)                                                                                      \
    springls__array_grow(ctx, (springls__array)SPRINGLS__ROLE_##role, (size_t)(count), sizeof *springls__##role(&(ctx)->model), 0)

/* Exchanges two arrays of one element size, on the host and on the device. */
SPRINGLS__FN void springls__swap(springls_context *ctx, springls__array a, springls__array b)
{
    springls__buffer memory = ctx->memory[a];
    ctx->memory[a] = ctx->memory[b];
    ctx->memory[b] = memory;
    springls__bind(ctx);
}

#endif
