/* contract.h - removes poor springls and those far from the zero level (section 4.6). */
#ifndef SPRINGLS__STAGES_CONTRACT_H
#define SPRINGLS__STAGES_CONTRACT_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_list.h"
#include "../model/constellation.h"
#include "inherit.h"
#include "sleep.h"

/* Samples phi at the particles (phi_n), for contract. Algorithm 2 does so before springls move: after a step as long as d_max a
   good springl is further from the old zero level than contract allows. Ends with a loop. */
SPRINGLS__FN springls_status springls__sample_phi(springls_context *ctx)
{
    springls__loop(ctx, SPRINGLS__KERNEL_sample_phi, ctx->model.set.count, NULL);
    return SPRINGLS_OK;
}

enum {
    SPRINGLS__CONTRACT_JUDGE,
    SPRINGLS__CONTRACT_RESHAPE,
    SPRINGLS__CONTRACT_RESHAPED,
    SPRINGLS__CONTRACT_MERGE,
    SPRINGLS__CONTRACT_MERGED,
    SPRINGLS__CONTRACT_REMOVE
};

/* Returns true after the last round of merging. */
SPRINGLS__FN bool springls__merges_decided(springls_context *ctx, int rounds)
{
    return springls__checks_traded_round(ctx, rounds)
        && springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(contract_action), ctx->model.set.count, SPRINGLS__UNDECIDED) == 0;
}

SPRINGLS__FN springls_status springls__contract(springls_context *ctx)
{
    springls__arguments args;
    int count = ctx->model.set.count;
    switch (ctx->work.phase) {
    case SPRINGLS__CONTRACT_JUDGE:
        if (count == 0) return SPRINGLS_OK;
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, count));
        if (ctx->model.params.keep_thin) SPRINGLS__TRY(springls__cell_list_build(ctx));
        args.contract.min_angle_cosine = springls__cospi(ctx->model.params.min_angle / 180.0f);
        args.contract.max_angle_cosine = springls__cospi(ctx->model.params.max_angle / 180.0f);
        springls__loop(ctx, SPRINGLS__KERNEL_contract, count, &args);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_RESHAPE);
    case SPRINGLS__CONTRACT_RESHAPE:
        springls__loop(ctx, SPRINGLS__KERNEL_reshape, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_RESHAPED);
    case SPRINGLS__CONTRACT_RESHAPED:
        springls__count_later(ctx, SPRINGLS__COUNT_RESHAPED, SPRINGLS__ROLE_ARRAY(contract_action), count, SPRINGLS__RESHAPE);
        springls__triangles_changed(ctx);
        ctx->neighbors_age = -1;
        if (!(ctx->model.params.merge_distance > 0.0f)) return springls__next_phase(ctx, SPRINGLS__CONTRACT_REMOVE);
        SPRINGLS__TRY(springls__cell_list_build(ctx));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, next_contract_action, count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, awaited_springl, count));
        springls__run(ctx, SPRINGLS__KERNEL_merge_begin, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_MERGE);
    case SPRINGLS__CONTRACT_MERGE:
        springls__loop(ctx, SPRINGLS__KERNEL_merge, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_MERGED);
    case SPRINGLS__CONTRACT_MERGED:
        springls__swap(ctx, SPRINGLS__ROLE_ARRAY(contract_action), SPRINGLS__ROLE_ARRAY(next_contract_action));
        return springls__next_phase(ctx, springls__merges_decided(ctx, ++ctx->work.repetition) ? SPRINGLS__CONTRACT_REMOVE
                                                                                               : SPRINGLS__CONTRACT_MERGE);
    case SPRINGLS__CONTRACT_REMOVE:
    default:
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_departed, count));
        springls__run(ctx, SPRINGLS__KERNEL_departed, count, NULL);
        springls__count_later(ctx, SPRINGLS__COUNT_DEPARTED, SPRINGLS__ROLE_ARRAY(has_departed), count, 1);
        SPRINGLS__TRY(springls__attributes_before_removal(ctx));
        springls__stir(ctx, SPRINGLS__STIR_CONTRACTED, 0, count);
        SPRINGLS__TRY(springls__constellation_compact(ctx));
        ctx->stats.reshaped += (int)springls__count_found(ctx, SPRINGLS__COUNT_RESHAPED);
        ctx->stats.left += (int)springls__count_found(ctx, SPRINGLS__COUNT_DEPARTED);
        springls__attributes_after_removal(ctx, count);
        ctx->stats.removed += count - ctx->model.set.count;
        springls__constellation_changed(ctx);
        return SPRINGLS_OK;
    }
}

/* Contracts by phi as it is now. */
SPRINGLS__FN springls_status springls__contract_now(springls_context *ctx)
{
    SPRINGLS__TRY(springls__sample_phi(ctx));
    return springls__next_stage(ctx, springls__contract);
}

#endif
