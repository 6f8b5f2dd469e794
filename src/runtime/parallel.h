/* parallel.h - the parallel loop.

   Why results have the same bits for any number of threads, any compiler and any device, which a save file, a replay and two
   players of one game need:
     - A task writes only what belongs to its own indices. What several would add to is gathered by the one that owns it.
     - Sums and scans go by blocks of a fixed size, in order, whoever computes them. Atomic additions only count.
     - Lists are sorted by keys that are their own: bricks by place, springls by index. No order comes from a race.
     - Operations are IEEE additions, multiplications, divisions and square roots, as written: no fused ones, no functions of libm
       but those whose results are exact (springls_fp_contract_detected). Vectors do to each lane what plain C does. */
#ifndef SPRINGLS__RUNTIME_PARALLEL_H
#define SPRINGLS__RUNTIME_PARALLEL_H

#include "base.h"
#include "context.h"

/* Runs task over [0, count) through the caller's job system, OpenMP, or in this thread, in ranges of at least `grain` elements: one
   range is not worth another thread. A task writes only what belongs to its own indices: so results do not depend on the number of
   threads. */
SPRINGLS__FN void springls__parallel(const springls_context *ctx, int count, int grain, springls_task task, void *arg)
{
    if (count <= 0) return;
    if (count > grain && ctx->desc.tasks.parallel_for) {
        (ctx->desc.tasks.parallel_for)(ctx->desc.tasks.user, count, grain, task, arg);
        return;
    }
#if defined(_OPENMP)
    {
        int blocks = (count + grain - 1) / grain, b;
        #pragma omp parallel for schedule(dynamic) if (blocks > 1)
        for (b = 0; b < blocks; b++) {
            int begin = b * grain, end = begin + grain < count ? begin + grain : count;
            (task)(arg, begin, end);
        }
    }
#else
    (void)grain;
    (task)(arg, 0, count);
#endif
}

#endif
