/* contract.h - removes poor springls and those far from the zero level (section 4.6). */
#ifndef SPRINGLS__STAGES_CONTRACT_H
#define SPRINGLS__STAGES_CONTRACT_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
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

/* Decides for each springl whether it stays, is reshaped or removed. Ends with a loop. */
SPRINGLS__FN springls_status springls__find_poor(springls_context *ctx)
{
    const springls_params *params = &ctx->model.params;
    springls__arguments args;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, contract_action, ctx->model.set.count));
    if (params->keep_thin || params->contact == SPRINGLS_CONTACT_SEPARATE) SPRINGLS__TRY(springls__cell_list_cover(ctx));
    args.contract.min_angle_cosine = springls__cospi(params->min_angle / 180.0f);
    args.contract.max_angle_cosine = springls__cospi(params->max_angle / 180.0f);
    springls__loop(ctx, SPRINGLS__KERNEL_contract, ctx->model.set.count, &args);
    return SPRINGLS_OK;
}

/* Counts the springls that have been reshaped. */
SPRINGLS__FN void springls__triangles_reshaped(springls_context *ctx)
{
    springls__count_later(ctx, SPRINGLS__COUNT_RESHAPED, SPRINGLS__ROLE_ARRAY(contract_action), ctx->model.set.count,
                          SPRINGLS__RESHAPE);
    springls__triangles_changed(ctx);
    ctx->neighbors_uses = 0;
}

/* Marks springls that may be merged as undecided, for rounds of merging. */
SPRINGLS__FN springls_status springls__merge_begin(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, next_contract_action, count));
    springls__run(ctx, SPRINGLS__KERNEL_merge_begin, count, NULL);
    return SPRINGLS_OK;
}

/* Removes the undecided springls that merge with springl i, which is kept. */
SPRINGLS__FN void springls__remove_merged(const springls__model *model, uint8_t *action, int i)
{
    springls__v3 n = springls__springl_normal(model->set.s[i]);
    springls__cell_walk walk = springls__cell_walk_near(model, model->set.s[i].p, model->params.merge_distance);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0)
        if (action[other] == SPRINGLS__UNDECIDED && springls__merges(model, i, n, other)) action[other] = SPRINGLS__REMOVE;
}

/* Decides about the springls that rounds have left undecided: one after the other by rank, each that is kept removes those that
   merge with it. The rounds have decided about those that merge with one of the mask. */
SPRINGLS__FN springls_status springls__merge_by_rank(springls_context *ctx)
{
    const springls__constellation *set = &ctx->model.set;
    uint8_t *action = springls__contract_action(&ctx->model);
    uint32_t generation = 0, next;
    int i;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__ALL_BITS, SPRINGLS__ROLE_BIT(contract_action)));
    do {
        next = UINT32_MAX;
        for (i = 0; i < set->count; i++) {
            if (action[i] == SPRINGLS__REMOVE) continue;
            if (set->generation[i] > generation && set->generation[i] < next) next = set->generation[i];
            if (set->generation[i] != generation) continue;
            if (action[i] == SPRINGLS__UNDECIDED) action[i] = SPRINGLS__KEEP;
            springls__remove_merged(&ctx->model, action, i);
        }
        generation = next;
    } while (next != UINT32_MAX);
    return SPRINGLS_OK;
}

/* Removes the springls whose contract_action is SPRINGLS__REMOVE. */
SPRINGLS__FN springls_status springls__remove_poor(springls_context *ctx)
{
    const int count = ctx->model.set.count;
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

enum {
    SPRINGLS__CONTRACT_FIND,
    SPRINGLS__CONTRACT_RESHAPE,
    SPRINGLS__CONTRACT_RESHAPED,
    SPRINGLS__CONTRACT_MERGE,
    SPRINGLS__CONTRACT_MERGED,
    SPRINGLS__CONTRACT_MERGE_BY_RANK,
    SPRINGLS__CONTRACT_REMOVE
};

/* Ends a round of merging; returns the phase that follows. Where springls are dense, a round decides only a few and searches around
   all. */
SPRINGLS__FN int springls__phase_after_merging(springls_context *ctx)
{
    const int most = 16, count = ctx->model.set.count, rounds = ++ctx->work.repetition;
    int undecided;
    springls__swap(ctx, SPRINGLS__ROLE_ARRAY(contract_action), SPRINGLS__ROLE_ARRAY(next_contract_action));
    if (!springls__checks_traded_round(ctx, rounds)) return SPRINGLS__CONTRACT_MERGE;
    undecided = springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(contract_action), count, SPRINGLS__UNDECIDED);
    if (undecided == 0) return SPRINGLS__CONTRACT_REMOVE;
    return rounds < most && undecided < count / 8 ? SPRINGLS__CONTRACT_MERGE : SPRINGLS__CONTRACT_MERGE_BY_RANK;
}

SPRINGLS__FN springls_status springls__contract(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    switch (ctx->work.phase) {
    case SPRINGLS__CONTRACT_FIND:
        if (count == 0) return SPRINGLS_OK;
        SPRINGLS__TRY(springls__find_poor(ctx));
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_RESHAPE);
    case SPRINGLS__CONTRACT_RESHAPE:
        springls__loop(ctx, SPRINGLS__KERNEL_reshape, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_RESHAPED);
    case SPRINGLS__CONTRACT_RESHAPED:
        springls__triangles_reshaped(ctx);
        if (!(ctx->model.params.merge_distance > 0.0f)) return springls__next_phase(ctx, SPRINGLS__CONTRACT_REMOVE);
        SPRINGLS__TRY(springls__merge_begin(ctx));
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_MERGE);
    case SPRINGLS__CONTRACT_MERGE:
        springls__loop(ctx, SPRINGLS__KERNEL_merge, count, NULL);
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_MERGED);
    case SPRINGLS__CONTRACT_MERGED:
        return springls__next_phase(ctx, springls__phase_after_merging(ctx));
    case SPRINGLS__CONTRACT_MERGE_BY_RANK:
        SPRINGLS__TRY(springls__merge_by_rank(ctx));
        return springls__next_phase(ctx, SPRINGLS__CONTRACT_REMOVE);
    case SPRINGLS__CONTRACT_REMOVE:
    default:
        return springls__remove_poor(ctx);
    }
}

/* Contracts by phi as it is now. */
SPRINGLS__FN springls_status springls__contract_now(springls_context *ctx)
{
    SPRINGLS__TRY(springls__sample_phi(ctx));
    return springls__next_stage(ctx, springls__contract);
}

#endif
