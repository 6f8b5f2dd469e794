/* body_memory.h - memory that bodies do not keep between steps. What only stages use is given back when a body has made its own step, so
   that all bodies need it once for each thread, and copies of bodies as they were when the step has ended. The bodies of a tiling with a
   backend keep their memory, which the device knows by its place; also when the device is lost, since going back to the copies that they
   keep (springls__back_up) then takes the room that is there. */
#ifndef SPRINGLS__TILING_BODY_MEMORY_H
#define SPRINGLS__TILING_BODY_MEMORY_H

#include "../model/bvh.h"
#include "../runtime/arrays.h"
#include "bodies.h"

/* Returns whether a body may give memory back: not in the middle of an update of chunks that its caller has begun. */
SPRINGLS__FN bool springls__may_release(const springls_tiling *tiling, const springls_context *ctx)
{
    return !tiling->backend && !ctx->step.active;
}

/* Gives back the working memory of a body's stages, and its springls' own surface where that is out of date. */
SPRINGLS__FN void springls__release_work(const springls_tiling *tiling, springls_context *ctx)
{
    const uint64_t work = SPRINGLS__WORK_BITS & ~(SPRINGLS__BIT(COUNTS) | SPRINGLS__BIT(SUMS)); /* those two are reserved for good */
    int i;
    if (!springls__may_release(tiling, ctx)) return;
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

/* Gives back what a body keeps for a step alone, and the room in the arrays of the set and of the search for springls that it has no
   longer: initial springls are many. */
SPRINGLS__FN void springls__fit_body(const springls_tiling *tiling, springls__tiling_body *body)
{
    springls_context *ctx = body->ctx;
    int i;
    springls__buffer_free(ctx, &body->backup);
    springls__release_work(tiling, ctx);
    if (!springls__may_release(tiling, ctx)) return;
    for (i = 0; i < SPRINGLS__ARRAY_COUNT; i++)
        if (springls__has_array(SPRINGLS__SET_BITS | SPRINGLS__SEARCH_BITS, i))
            springls__fit_array(ctx, (springls__array)i, (size_t)ctx->model.set.count);
    springls__bind(ctx);
}

SPRINGLS__FN void springls__fit_bodies(springls_tiling *tiling)
{
    int i;
    for (i = 0; i < tiling->count; i++)
        if (tiling->body[i].rest.looks || tiling->body[i].backup.bytes) springls__fit_body(tiling, &tiling->body[i]);
}

#endif
