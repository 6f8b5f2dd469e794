/* launch.h - runs kernels over their elements, on the device or on the host; counts, sums and scans by them.

   Why counts are read late: a device answers only when all that was queued before is done. So kernels leave their counts in an array
   (COUNTS), and the host waits once, when the first of them is needed, and then has them all (springls__count_found). */
#ifndef SPRINGLS__RUNTIME_LAUNCH_H
#define SPRINGLS__RUNTIME_LAUNCH_H

#include "arrays.h"
#include "errors.h"
#include "kernel_table.h"
#include "parallel.h"
#include "residency.h"

SPRINGLS__KERNELS(SPRINGLS__RANGE)
SPRINGLS__ORDERED_KERNELS(SPRINGLS__RANGE)
SPRINGLS__SIMD_KERNELS(SPRINGLS__SIMD_RANGE)
SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_RANGE)

static const springls__kernel_info springls__kernels[] = {
#define SPRINGLS__FACTS(name, program, grain, writes) { #name, springls__##name##_range, grain, writes, false, 0, false },
    SPRINGLS__KERNELS(SPRINGLS__FACTS) SPRINGLS__SIMD_KERNELS(SPRINGLS__FACTS)
#undef SPRINGLS__FACTS
#define SPRINGLS__DEVICE_FACTS(name, program, grain, writes) { #name, NULL, grain, writes, false, 0, false },
    SPRINGLS__DEVICE_KERNELS(SPRINGLS__DEVICE_FACTS)
#undef SPRINGLS__DEVICE_FACTS
#define SPRINGLS__ORDERED_FACTS(name, program, grain, writes) { #name, springls__##name##_range, grain, writes, false, 0, true },
    SPRINGLS__ORDERED_KERNELS(SPRINGLS__ORDERED_FACTS)
#undef SPRINGLS__ORDERED_FACTS
#define SPRINGLS__BRICK_FACTS(name, program, grain, writes, floats)                                                              \
    { #name, springls__##name##_range, grain, writes, true, (floats) <= SPRINGLS__STACK_FLOATS ? 0 : (floats), false },
    SPRINGLS__BRICK_KERNELS(SPRINGLS__BRICK_FACTS)
#undef SPRINGLS__BRICK_FACTS
};

SPRINGLS__FN void springls__range_work(void *arg, int begin, int end, float *memory)
{
    const springls__kernel_run *run = (const springls__kernel_run *)arg;
    (run->kernel->range)(&run->ctx->model, run->args, begin, end, memory);
}

/* ---- lanes: parts of a loop that have memory of their own, so that no thread needs it on its stack ---- */

enum { SPRINGLS__MEMORY_LANES = 64 };

typedef struct springls__lane_part {
    springls_context *ctx;
    springls__loop_work work;
    void *arg;
    size_t floats;
    int first, count, lanes;
} springls__lane_part;

/* Returns how many lanes a loop over `count` elements has, in ranges of at least `grain`: one where there is one thread. */
SPRINGLS__FN int springls__lane_count(const springls_context *ctx, int count, int grain)
{
    const int ranges = count / grain + (count % grain > 0);
#if defined(_OPENMP)
    (void)ctx;
    return springls__imin(ranges, SPRINGLS__MEMORY_LANES);
#else
    return springls__imin(ranges, ctx->desc.tasks.parallel_for ? (int)SPRINGLS__MEMORY_LANES : 1);
#endif
}

/* Makes room for the lanes of a loop over `count` elements, so many floats each. */
SPRINGLS__FN springls_status springls__reserve_lanes(springls_context *ctx, size_t floats, int count, int grain)
{
    return SPRINGLS__RESERVE(ctx, lane_memory, floats * (size_t)springls__lane_count(ctx, count, grain));
}

SPRINGLS__FN void springls__lane_task(void *arg, int begin, int end)
{
    const springls__lane_part *part = (const springls__lane_part *)arg;
    for (; begin < end; begin++) {
        int first = part->first + (int)((int64_t)part->count * begin / part->lanes);
        int last = part->first + (int)((int64_t)part->count * (begin + 1) / part->lanes);
        (part->work)(part->arg, first, last, springls__lane_memory(&part->ctx->model) + (size_t)begin * part->floats);
    }
}

SPRINGLS__FN void springls__part_task(void *arg, int begin, int end)
{
    const springls__lane_part *part = (const springls__lane_part *)arg;
    (part->work)(part->arg, part->first + begin, part->first + end, NULL);
}

/* Does work over [first, first + count) on the host. Precondition: springls__reserve_lanes, where it needs memory. */
SPRINGLS__FN void springls__do_work(springls_context *ctx, springls__loop_work work, void *arg, size_t floats, int first,
                                    int count, int grain)
{
    springls__lane_part part;
    part.ctx = ctx;
    part.work = work;
    part.arg = arg;
    part.floats = floats;
    part.first = first;
    part.count = count;
    part.lanes = springls__lane_count(ctx, count, grain);
    if (floats) springls__parallel(ctx, part.lanes, 1, springls__lane_task, &part);
    else springls__parallel(ctx, count, grain, springls__part_task, &part);
}

/* Returns a kernel with its arguments; NULL: it takes none. */
SPRINGLS__FN springls__kernel_run springls__run_of(const springls_context *ctx, springls__kernel kernel,
                                                   const springls__arguments *args)
{
    springls__kernel_run run;
    memset(&run, 0, sizeof run);
    run.ctx = ctx;
    run.kernel = &springls__kernels[kernel];
    if (args) run.args = *args;
    return run;
}

/* Returns the arrays that a run of a kernel writes: those of its row, and the one that a scan is given. */
SPRINGLS__FN uint64_t springls__writes_of(springls__kernel kernel, const springls__arguments *args)
{
    return springls__kernels[kernel].writes | (kernel == SPRINGLS__KERNEL_scan_apply ? (uint64_t)1 << args->chunk.array : 0);
}

/* Starts a kernel on the device; fails when that cannot. */
SPRINGLS__FN springls_status springls__run_on_device(springls_context *ctx, springls__kernel kernel, int count,
                                                     const springls__arguments *args)
{
    SPRINGLS__TRY(springls__to_device(ctx, springls__writes_of(kernel, args)));
    return (ctx->backend->run)(ctx, (int)kernel, count, springls__run_of(ctx, kernel, args).args);
}

/* Returns true when the device has taken the kernel. When it fails in that, falls back to the host. */
SPRINGLS__FN bool springls__ran_on_device(springls_context *ctx, springls__kernel kernel, int count,
                                          const springls__arguments *args)
{
    if (!ctx->on_device) return false;
    if (springls__run_on_device(ctx, kernel, count, args) == SPRINGLS_OK) return true;
    springls__fall_back_to_host(ctx);
    return false;
}

/* Returns true when elements that meet do so in order: what they list is sorted then. */
SPRINGLS__FN bool springls__runs_in_order(const springls_context *ctx) { return !ctx->on_device; }

/* Runs a kernel over elements [0, count). Its failures are those of the device, which the end of the call reports. */
SPRINGLS__FN void springls__run(springls_context *ctx, springls__kernel kernel, int count, const springls__arguments *args)
{
    springls__kernel_run run;
    if (count <= 0 || ctx->lost || springls__ran_on_device(ctx, kernel, count, args)) return;
    if (springls__to_host(ctx, SPRINGLS__ALL_BITS, springls__writes_of(kernel, args)) != SPRINGLS_OK) return;
    run = springls__run_of(ctx, kernel, args);
    if (run.kernel->ordered) springls__range_work(&run, 0, count, NULL);
    else springls__do_work(ctx, springls__range_work, &run, (size_t)run.kernel->floats, 0, count, run.kernel->grain);
}

/* ---- counts: kernels leave them in the array COUNTS until the host reads all of them at once (springls__late_count) ---- */

enum { SPRINGLS__CHUNKS = 1024 }; /* parts of an array that are added up by themselves, at most */

/* Reserves the arrays in which kernels count and add up. */
SPRINGLS__FN springls_status springls__reserve_counts(springls_context *ctx)
{
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_COUNTS, SPRINGLS__COUNTS, 0));
    return springls__grow(ctx, SPRINGLS__ARRAY_SUMS, 3 * SPRINGLS__CHUNKS, 0);
}

/* Divides the first `count` elements of an array into chunks, on the host into large ones, each worth a thread. late: the count of what
   they add up to. */
SPRINGLS__FN springls__arguments springls__chunks_of(const springls_context *ctx, springls__array array, int count,
                                                     springls__late_count late)
{
    const int least = ctx->on_device ? 64 : 65536;
    springls__arguments args;
    memset(&args, 0, sizeof args);
    args.chunk.array = (int)array;
    args.chunk.size = springls__imax((count + SPRINGLS__CHUNKS - 1) / SPRINGLS__CHUNKS, least);
    args.chunk.count = count;
    args.chunk.place = (int)late;
    args.chunk.chunks = (count + args.chunk.size - 1) / args.chunk.size;
    return args;
}

/* Notes that `number` counts from `late` on have been found. */
SPRINGLS__FN void springls__note_counts(springls_context *ctx, springls__late_count late, int number)
{
    ctx->late_unread |= ((1u << number) - 1u) << late;
}

/* Returns a count that has been found. Waits for the device, unless the host has read the count already. */
SPRINGLS__FN uint32_t springls__count_found(springls_context *ctx, springls__late_count late)
{
    if (ctx->late_unread >> late & 1u) {
        springls__to_host(ctx, SPRINGLS__BIT(COUNTS), 0);
        ctx->late_unread = 0;
    }
    return ctx->lost ? 0u : ctx->model.work.counts[late];
}

/* Counts how many of the first `count` bytes of an array are `value`, for springls__count_found. */
SPRINGLS__FN void springls__count_later(springls_context *ctx, springls__late_count late, springls__array array, int count,
                                        uint8_t value)
{
    springls__arguments args = springls__chunks_of(ctx, array, count, late);
    args.chunk.value = value;
    springls__run(ctx, SPRINGLS__KERNEL_count_chunk, args.chunk.chunks, &args);
    springls__run(ctx, SPRINGLS__KERNEL_scan_sums, 1, &args);
    springls__note_counts(ctx, late, 1);
}

/* Returns how many of the first `count` bytes of an array are `value`. */
SPRINGLS__FN int springls__count_of(springls_context *ctx, springls__array array, int count, uint8_t value)
{
    springls__count_later(ctx, SPRINGLS__COUNT_NOW, array, count, value);
    return (int)springls__count_found(ctx, SPRINGLS__COUNT_NOW);
}

/* Finds the largest of the first `count` floats of an array, at least 0, and how many are more than the limit, for
   springls__largest_found: counts number `late` and `late` + 1. */
SPRINGLS__FN void springls__largest_later(springls_context *ctx, springls__late_count late, springls__array array, int count,
                                          float limit)
{
    springls__arguments args = springls__chunks_of(ctx, array, count, late);
    args.chunk.limit = limit;
    springls__run(ctx, SPRINGLS__KERNEL_largest_chunk, args.chunk.chunks, &args);
    springls__run(ctx, SPRINGLS__KERNEL_largest_sums, 1, &args);
    springls__note_counts(ctx, late, 2);
}

SPRINGLS__FN springls__largest springls__largest_found(springls_context *ctx, springls__late_count late)
{
    springls__largest found;
    found.value = springls__float_of_bits((int32_t)springls__count_found(ctx, late));
    found.more = (int)springls__count_found(ctx, (springls__late_count)(late + 1));
    return found;
}

/* Finds the largest of the first `count` floats of an array, and how many are more than the limit. */
SPRINGLS__FN springls__largest springls__find_largest(springls_context *ctx, springls__array array, int count, float limit)
{
    springls__largest_later(ctx, SPRINGLS__COUNT_LARGEST, array, count, limit);
    return springls__largest_found(ctx, SPRINGLS__COUNT_LARGEST);
}

/* Replaces each of the first `count` numbers of an array by the sum of those before it; the sum of all, which an int has to hold,
   is for springls__scan_found. */
SPRINGLS__FN void springls__scan_later(springls_context *ctx, springls__late_count late, springls__array array, int count)
{
    springls__arguments args = springls__chunks_of(ctx, array, count, late);
    springls__run(ctx, SPRINGLS__KERNEL_scan_chunk, args.chunk.chunks, &args);
    springls__run(ctx, SPRINGLS__KERNEL_scan_sums, 1, &args);
    springls__run(ctx, SPRINGLS__KERNEL_scan_apply, args.chunk.chunks, &args); /* alone changes the numbers */
    springls__note_counts(ctx, late, 1);
}

/* Writes the sum of springls__scan_later to *total; fails when it is more than an int holds. */
SPRINGLS__FN springls_status springls__scan_found(springls_context *ctx, springls__late_count late, int *total)
{
    uint32_t sum = springls__count_found(ctx, late);
    if (ctx->lost) return ctx->backend_status;
    if (sum > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "a count overflows");
    *total = (int)sum;
    return SPRINGLS_OK;
}

/* Replaces each of the first `count` numbers of an array by the sum of those before it. *total: the sum of all; fails when it is
   more than an int holds. */
SPRINGLS__FN springls_status springls__scan(springls_context *ctx, springls__array array, int count, int *total)
{
    springls__scan_later(ctx, SPRINGLS__COUNT_NOW, array, count);
    return springls__scan_found(ctx, SPRINGLS__COUNT_NOW, total);
}

/* Returns true when rounds that are repeated until one changes nothing are to be checked for that. On a device some more, which
   change nothing, cost less than waiting after each. */
SPRINGLS__FN bool springls__checks_round(const springls_context *ctx, int rounds)
{
    const int between = 4;
    return !ctx->on_device || rounds % between == 0;
}

/* Returns true when rounds whose actions trade places between two scratch arrays are to be checked: after an even number, when the
   arrays are where they were. They have grown by other roles, and in each other's places they would grow again. */
SPRINGLS__FN bool springls__checks_traded_round(const springls_context *ctx, int rounds)
{
    return rounds % 2 == 0 && springls__checks_round(ctx, rounds);
}

#endif
