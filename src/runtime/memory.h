/* memory.h - memory from the context's allocator, counted, and buffers that grow. */
#ifndef SPRINGLS__RUNTIME_MEMORY_H
#define SPRINGLS__RUNTIME_MEMORY_H

#include "errors.h"

SPRINGLS__FN void *springls__malloc(size_t size, void *user)
{
    (void)user;
    return malloc(size);
}

SPRINGLS__FN void springls__free(void *memory, size_t size, void *user)
{
    (void)user;
    (void)size;
    free(memory);
}

/* Returns memory from the context's allocator, or NULL. */
SPRINGLS__FN void *springls__allocate(springls_context *ctx, size_t size)
{
    void *memory = (ctx->desc.allocator.alloc)(size, ctx->desc.allocator.user);
    if (memory) ctx->memory_used += size;
    return memory;
}

SPRINGLS__FN void springls__release(springls_context *ctx, void *memory, size_t size)
{
    if (!memory) return;
    ctx->memory_used -= size;
    (ctx->desc.allocator.free)(memory, size, ctx->desc.allocator.user);
}

/* Makes room for count elements of `element` bytes; keeps the first `keep` bytes. A buffer grows by an eighth more than that, so
   that repeated growth is cheap. Fails without memory, and leaves the buffer as it was. */
SPRINGLS__FN springls_status springls__buffer_grow(springls_context *ctx, springls__buffer *buffer, size_t count,
                                                   size_t element, size_t keep)
{
    size_t bytes;
    void *memory;
    if (count > (SIZE_MAX / 2) / element) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a size overflows");
    bytes = count * element;
    if (bytes <= buffer->bytes) return SPRINGLS_OK;
    if (buffer->data) bytes += bytes / 8;
    memory = springls__allocate(ctx, bytes);
    if (!memory) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "out of memory: %.0f bytes refused", (double)bytes);
    if (keep) memcpy(memory, buffer->data, keep);
    springls__release(ctx, buffer->data, buffer->bytes);
    buffer->data = memory;
    buffer->bytes = bytes;
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__buffer_free(springls_context *ctx, springls__buffer *buffer)
{
    springls__release(ctx, buffer->data, buffer->bytes);
    memset(buffer, 0, sizeof *buffer);
}

#endif
