/* memory.h - errors, log, progress, allocation and the parallel loop. */

SPRINGLS__FN void springls__log(const springls_context *ctx, int level, const char *format, ...)
{
    char message[256];
    va_list args;
    if (!ctx->desc.logger.log) return;
    va_start(args, format);
    vsnprintf(message, sizeof message, format, args);
    va_end(args);
    ctx->desc.logger.log(ctx->desc.logger.user, level, message);
}

SPRINGLS__FN springls_status springls__fail(springls_context *ctx, springls_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(ctx->error, sizeof ctx->error, format, args);
    va_end(args);
    springls__log(ctx, 1, "%s", ctx->error);
    return status;
}

/* Tells how far a long call has come; true when the caller wants it to end. */
SPRINGLS__FN bool springls__cancelled(const springls_context *ctx, float fraction)
{
    return ctx->desc.progress.report && ctx->desc.progress.report(ctx->desc.progress.user, fraction) != 0;
}

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

SPRINGLS__FN void *springls__allocate(springls_context *ctx, size_t size)
{
    void *memory = ctx->desc.allocator.alloc(size, ctx->desc.allocator.user);
    if (memory) ctx->memory_used += size;
    return memory;
}

SPRINGLS__FN void springls__release(springls_context *ctx, void *memory, size_t size)
{
    if (!memory) return;
    ctx->memory_used -= size;
    ctx->desc.allocator.free(memory, size, ctx->desc.allocator.user);
}

/* Makes room for count elements; keeps the first `keep` bytes. Grows by half again so that repeated growth is cheap. */
SPRINGLS__FN springls_status springls__buffer_grow(springls_context *ctx, springls__buffer *buffer, size_t count,
                                                   size_t element, size_t keep)
{
    size_t bytes;
    void *memory;
    if (count > (SIZE_MAX / 2) / element) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a size overflows");
    bytes = count * element;
    if (bytes <= buffer->bytes) return SPRINGLS_OK;
    if (buffer->data) bytes += bytes / 2;
    memory = springls__allocate(ctx, bytes);
    if (!memory) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "out of memory: %zu bytes refused", bytes);
    if (keep) memcpy(memory, buffer->data, keep);
    springls__release(ctx, buffer->data, buffer->bytes);
    buffer->data = memory;
    buffer->bytes = bytes;
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__buffer_free(springls_context *ctx, springls__buffer *buffer)
{
    if (buffer->device) ctx->backend->release(ctx, buffer);
    springls__release(ctx, buffer->data, buffer->bytes);
    memset(buffer, 0, sizeof *buffer);
}

/* The model's pointers, after memory has moved. */
SPRINGLS__FN void springls__bind(springls_context *ctx)
{
#define SPRINGLS__BIND(name, type, block, owner, member) ctx->model.owner.member = (type *)ctx->memory[SPRINGLS__ARRAY_##name].data;
    SPRINGLS__ARRAYS(SPRINGLS__BIND)
#undef SPRINGLS__BIND
}

SPRINGLS__FN size_t springls__element_size(springls__array array)
{
#define SPRINGLS__SIZE(name, type, block, owner, member) sizeof(type) * (block),
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

/* Makes room for count elements in each of some arrays (bits); keeps the first `keep`. */
SPRINGLS__FN springls_status springls__grow_all(springls_context *ctx, uint64_t arrays, size_t count, size_t keep)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (springls__has_array(arrays, array)) SPRINGLS__TRY(springls__grow(ctx, (springls__array)array, count, keep));
    return SPRINGLS_OK;
}

/* Working memory `index` of the running stage, at least count elements; contents are undefined. */
SPRINGLS__FN springls_status springls__scratch(springls_context *ctx, int index, size_t count, size_t element, void **out)
{
    SPRINGLS__TRY(springls__array_grow(ctx, (springls__array)(SPRINGLS__ARRAY_SCRATCH0 + index), count, element, 0));
    if (out) *out = ctx->model.work.scratch[index];
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

/* Runs task over [0, count) through the caller's job system, OpenMP, or here. Every task writes only what its own
   indices own, so results cannot depend on the number of workers. */
SPRINGLS__FN void springls__parallel(const springls_context *ctx, int count, int grain, springls_task task, void *arg)
{
    if (count <= 0) return;
    if (ctx->desc.tasks.parallel_for) {
        ctx->desc.tasks.parallel_for(ctx->desc.tasks.user, count, grain, task, arg);
        return;
    }
#if defined(_OPENMP)
    {
        int blocks = (count + grain - 1) / grain, b;
        #pragma omp parallel for schedule(dynamic) if (blocks > 1)
        for (b = 0; b < blocks; b++) {
            int begin = b * grain, end = begin + grain < count ? begin + grain : count;
            task(arg, begin, end);
        }
    }
#else
    (void)grain;
    task(arg, 0, count);
#endif
}
