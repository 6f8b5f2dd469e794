/* body_memory.h - memory that bodies do not keep between steps. What only stages use is given back when a body has made its own step, so
   that all bodies need it once for each thread, and copies of bodies as they were when the step has ended. A model with a backend keeps
   its memory, which the device knows by its place. */
#ifndef SPRINGLS__TILING_BODY_MEMORY_H
#define SPRINGLS__TILING_BODY_MEMORY_H

#include "../model/bvh.h"
#include "../runtime/arrays.h"
#include "bodies.h"

/* Gives back the working memory of a model's stages. */
SPRINGLS__FN void springls__release_work(springls_context *ctx)
{
    const uint64_t work = SPRINGLS__WORK_BITS & ~(SPRINGLS__BIT(COUNTS) | SPRINGLS__BIT(SUMS)); /* those two are reserved for good */
    int i;
    if (ctx->backend) return;
    for (i = 0; i < SPRINGLS__ARRAY_COUNT; i++)
        if (springls__has_array(work, i)) springls__buffer_free(ctx, &ctx->memory[i]);
    for (i = 0; i < SPRINGLS__ATTRIBUTE_BUFFERS; i++) springls__buffer_free(ctx, &ctx->attribute_memory[i]);
    springls__buffer_free(ctx, &ctx->bvh_memory);
    if (!ctx->springl_surface_fresh) springls__surface_free(ctx, &ctx->springl_surface);
    springls__bind(ctx);
}

/* Gives back the room of an array behind its first `count` elements and a few more, where that is more than half of it; not if there is no
   memory to copy to. */
SPRINGLS__FN void springls__fit_array(springls_context *ctx, springls__array array, size_t count)
{
    springls__buffer *buffer = &ctx->memory[array];
    const size_t element = springls__element_size(array), used = count * element, wanted = used + used / 8 + 8 * element;
    void *memory;
    if (buffer->bytes / 2 <= wanted) return;
    memory = springls__allocate(ctx, wanted);
    if (!memory) return;
    memcpy(memory, buffer->data, used);
    springls__release(ctx, buffer->data, buffer->bytes);
    buffer->data = memory;
    buffer->bytes = wanted;
}

/* Gives back what a body keeps for a step alone, and the room of springls that it has no longer: initial springls are many. */
SPRINGLS__FN void springls__fit_body(springls__tiling_body *body)
{
    springls_context *ctx = body->ctx;
    int i;
    springls__buffer_free(ctx, &body->backup);
    springls__release_work(ctx);
    if (ctx->backend) return;
    for (i = 0; i < SPRINGLS__ARRAY_COUNT; i++)
        if (springls__has_array(SPRINGLS__SET_BITS | SPRINGLS__SEARCH_BITS, i))
            springls__fit_array(ctx, (springls__array)i, (size_t)ctx->model.set.count);
    springls__bind(ctx);
}

SPRINGLS__FN void springls__fit_bodies(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].rest.looks || tiling->body[i].backup.bytes) springls__fit_body(&tiling->body[i]);
}

#endif
