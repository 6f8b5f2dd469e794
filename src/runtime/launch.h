/* run.h - a kernel over all its elements, wherever the model lives. */
#ifndef SPRINGLS__RUNTIME_LAUNCH_H
#define SPRINGLS__RUNTIME_LAUNCH_H

#include "errors.h"
#include "kernel_table.h"
#include "parallel.h"
#include "residency.h"

#define SPRINGLS__RANGE_OF(name, grain, writes) SPRINGLS__RANGE(name)
SPRINGLS__KERNELS(SPRINGLS__RANGE_OF)
#undef SPRINGLS__RANGE_OF
#define SPRINGLS__SIMD_RANGE_OF(name, grain, writes) SPRINGLS__SIMD_RANGE(name)
SPRINGLS__SIMD_KERNELS(SPRINGLS__SIMD_RANGE_OF)
#undef SPRINGLS__SIMD_RANGE_OF
#define SPRINGLS__BRICK_RANGE_OF(name, grain, writes, floats) SPRINGLS__BRICK_RANGE(name, floats)
SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_RANGE_OF)
#undef SPRINGLS__BRICK_RANGE_OF

static const springls__kernel_info springls__kernels[] = {
#define SPRINGLS__FACTS(name, grain, writes) { #name, springls__##name##_range, grain, writes, false },
    SPRINGLS__KERNELS(SPRINGLS__FACTS) SPRINGLS__SIMD_KERNELS(SPRINGLS__FACTS)
#undef SPRINGLS__FACTS
#define SPRINGLS__BRICK_FACTS(name, grain, writes, floats) { #name, springls__##name##_range, grain, writes, true },
    SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_FACTS)
#undef SPRINGLS__BRICK_FACTS
};

SPRINGLS__FN void springls__range_task(void *arg, int begin, int end)
{
    const springls__range_job *run = (const springls__range_job *)arg;
    run->kernel->range(&run->ctx->model, run->job, begin, end);
}

SPRINGLS__FN springls_status springls__run_on_device(springls_context *ctx, springls__kernel kernel, int count, springls__job job)
{
    SPRINGLS__TRY(springls__to_device(ctx, springls__kernels[kernel].writes));
    return ctx->backend->run(ctx, (int)kernel, count, job);
}

/* Has the device done it? What it cannot do is done here. */
SPRINGLS__FN bool springls__ran_on_device(springls_context *ctx, springls__kernel kernel, int count, springls__job job)
{
    if (!ctx->on_device) return false;
    if (springls__run_on_device(ctx, kernel, count, job) == SPRINGLS_OK) return true;
    springls__fall_back_to_host(ctx);
    return false;
}

SPRINGLS__FN void springls__run(springls_context *ctx, springls__kernel kernel, int count, springls__job job)
{
    springls__range_job run;
    if (count <= 0 || ctx->lost || springls__ran_on_device(ctx, kernel, count, job)) return;
    if (springls__to_host(ctx, SPRINGLS__ALL_BITS, springls__kernels[kernel].writes) != SPRINGLS_OK) return;
    run.ctx = ctx;
    run.kernel = &springls__kernels[kernel];
    run.job = job;
    springls__parallel(ctx, count, run.kernel->grain, springls__range_task, &run);
}

SPRINGLS__FN springls__job springls__job_of(int i)
{
    springls__job job;
    memset(&job, 0, sizeof job);
    job.i[0] = i;
    return job;
}

SPRINGLS__FN springls__job springls__no_job(void) { return springls__job_of(0); }

/* How many of the first `count` bytes of an array are `value`. */
SPRINGLS__FN int springls__count_of(springls_context *ctx, springls__array array, int count, uint8_t value)
{
    const uint8_t *flags;
    int i, n = 0;
    if (ctx->on_device) {
        if (ctx->backend->count_of(ctx, (int)array, count, value, &n) == SPRINGLS_OK) return n;
        springls__fall_back_to_host(ctx);
    }
    if (springls__to_host(ctx, (uint64_t)1 << array, 0) != SPRINGLS_OK) return 0;
    flags = (const uint8_t *)ctx->memory[array].data;
    for (i = 0; i < count; i++) n += flags[i] == value;
    return n;
}

/* The largest of the first `count` floats of a scratch, 0 or more. */
SPRINGLS__FN float springls__largest(springls_context *ctx, int scratch, int count)
{
    const float *values;
    float largest = 0.0f;
    int i;
    if (ctx->on_device) {
        if (ctx->backend->largest(ctx, scratch, count, &largest) == SPRINGLS_OK) return largest;
        springls__fall_back_to_host(ctx);
    }
    if (springls__to_host(ctx, SPRINGLS__BIT(SCRATCH0) << scratch, 0) != SPRINGLS_OK) return 0.0f;
    values = (const float *)ctx->model.scratch[scratch];
    for (i = 0; i < count; i++) largest = springls__max(largest, values[i]);
    return largest;
}

/* The first `count` numbers of a scratch become the sums of those before them; *total: of all. */
SPRINGLS__FN springls_status springls__scan(springls_context *ctx, int scratch, int count, int *total)
{
    uint32_t *numbers = (uint32_t *)ctx->model.scratch[scratch];
    uint64_t sum = 0;
    int i;
    if (ctx->on_device) {
        springls_status status = ctx->backend->scan(ctx, scratch, count, total);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    SPRINGLS__TRY(springls__to_host(ctx, 0, SPRINGLS__BIT(SCRATCH0) << scratch));
    for (i = 0; i < count; i++) {
        uint32_t number = numbers[i];
        numbers[i] = (uint32_t)sum;
        sum += number;
    }
    if (sum > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a count overflows");
    *total = (int)sum;
    return SPRINGLS_OK;
}

#endif
