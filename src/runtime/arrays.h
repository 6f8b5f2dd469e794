/* arrays.h - room for the arrays of the model and for the working memory of stages. */
#ifndef SPRINGLS__RUNTIME_ARRAYS_H
#define SPRINGLS__RUNTIME_ARRAYS_H

#include "memory.h"

/* The model's pointers, after memory has moved. */
SPRINGLS__FN void springls__bind(springls_context *ctx)
{
#define SPRINGLS__BIND(name, type, block, member) ctx->model.member = (type *)ctx->memory[SPRINGLS__ARRAY_##name].data;
    SPRINGLS__ARRAYS(SPRINGLS__BIND)
#undef SPRINGLS__BIND
}

SPRINGLS__FN size_t springls__element_size(springls__array array)
{
#define SPRINGLS__SIZE(name, type, block, member) sizeof(type) * (block),
    static const size_t sizes[] = { SPRINGLS__ARRAYS(SPRINGLS__SIZE) 0 };
#undef SPRINGLS__SIZE
    return sizes[array];
}

/* Room for count elements of `element` bytes in an array of the model; keeps the first `keep`. Its twin on the device follows when it is
   next used there (springls__to_device). */
SPRINGLS__FN springls_status springls__array_grow(springls_context *ctx, springls__array array, size_t count, size_t element, size_t keep)
{
    springls__buffer *buffer = &ctx->memory[array];
    springls_status status = springls__buffer_grow(ctx, buffer, count ? count : 1, element, buffer->host_stale ? 0 : keep * element);
    springls__bind(ctx);
    return status;
}

SPRINGLS__FN springls_status springls__grow(springls_context *ctx, springls__array array, size_t count, size_t keep)
{
    return springls__array_grow(ctx, array, count, springls__element_size(array), keep);
}

/* Working memory `index` of the running stage, at least count elements; contents are undefined. */
SPRINGLS__FN springls_status springls__scratch(springls_context *ctx, int index, size_t count, size_t element, void **out)
{
    SPRINGLS__TRY(springls__array_grow(ctx, (springls__array)(SPRINGLS__ARRAY_SCRATCH0 + index), count, element, 0));
    if (out) *out = ctx->model.scratch[index];
    return SPRINGLS_OK;
}

/* Two arrays of one element size change places, with their memory here and on the device. */
SPRINGLS__FN void springls__swap(springls_context *ctx, springls__array a, springls__array b)
{
    springls__buffer memory = ctx->memory[a];
    ctx->memory[a] = ctx->memory[b];
    ctx->memory[b] = memory;
    springls__bind(ctx);
}

#endif
