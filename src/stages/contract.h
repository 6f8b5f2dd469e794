/* contract.h - removes springls that are poor or far from the zero level, and merges crowded ones (section 4.6).

   Why rounds of merging: of two springls that merge the older stays, unless a third, older still, has removed it. One after the other,
   that is work for one thread. In rounds, a springl decides as soon as every older partner has:

       rank   1 -- 2 -- 3 -- 4        partners in a row. Round 1: 1 stays. Round 2: 1 removes 2. Round 3: 3 stays, since 2 is gone.
              +    x    +    x        Round 4: 3 removes 4. All springls decide at once, to the same end as one after the other.

   A springl that is only badly shaped is reshaped instead: its particle, and so its exact path and correspondence, stay. */
#ifndef SPRINGLS__STAGES_CONTRACT_H
#define SPRINGLS__STAGES_CONTRACT_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "inherit.h"
#include "sleep.h"

SPRINGLS__FN bool springls__has_springls(const springls_context *ctx) { return ctx->model.set.count > 0; }

/* Lets thin sheets, lost parts, and bodies that touch, be searched for. */
SPRINGLS__FN springls_status springls__contract_begin(springls_context *ctx)
{
    const springls_params *params = &ctx->model.params;
    const bool searches = params->keep_thin || params->min_component > 0.0f || params->contact == SPRINGLS_CONTACT_SEPARATE;
    return searches ? springls__cell_list_cover(ctx) : SPRINGLS_OK;
}

SPRINGLS__FN void springls__contract_args(const springls_context *ctx, springls__arguments *args)
{
    args->contract.min_angle_cosine = springls__cospi(ctx->model.params.min_angle / 180.0f);
    args->contract.max_angle_cosine = springls__cospi(ctx->model.params.max_angle / 180.0f);
}

/* Counts the springls that have been reshaped. */
SPRINGLS__FN springls_status springls__triangles_reshaped(springls_context *ctx)
{
    springls__count_later(ctx, SPRINGLS__COUNT_RESHAPED, SPRINGLS__ROLE_ARRAY(contract_action), ctx->model.set.count,
                          SPRINGLS__RESHAPE);
    springls__triangles_changed(ctx);
    ctx->neighbors_uses = 0;
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

/* Decides about the springls that rounds have left undecided, one after the other by rank: a springl that is kept removes all that merge
   with it. Masked springls outrank all, and the first round has decided about their partners. */
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

SPRINGLS__FN bool springls__merges_springls(const springls_context *ctx) { return ctx->model.params.merge_distance > 0.0f; }

/* Counts the springls that rounds of merging have left undecided, when rounds are to be checked. */
SPRINGLS__FN springls_status springls__end_merge_round(springls_context *ctx)
{
    if (springls__checks_traded_round(ctx, springls__round(ctx) + 1))
        ctx->work.found = springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(contract_action), ctx->model.set.count, SPRINGLS__UNDECIDED);
    return SPRINGLS_OK;
}

/* Returns true while another round of merging is to be done: not where springls are so dense that a round decides only a few and searches
   around all. */
SPRINGLS__FN bool springls__merges_in_rounds(const springls_context *ctx)
{
    const int most = 16, rounds = springls__round(ctx), undecided = ctx->work.found;
    if (rounds == 0 || !springls__checks_traded_round(ctx, rounds)) return true;
    return undecided > 0 && rounds < most && undecided < ctx->model.set.count / 8;
}

/* Merges springls: marks those that may be merged as undecided, then decides about them. */
static const springls__entry springls__merge[] = {
    SPRINGLS__DO(springls__cell_list_cover)
    SPRINGLS__ROOM(next_contract_action, SPRINGLS)
    SPRINGLS__KERNEL(merge_begin, SPRINGLS)
    SPRINGLS__REPEAT_WHILE(springls__merges_in_rounds)
        SPRINGLS__KERNEL(merge, SPRINGLS)
        SPRINGLS__SWAP(ROLE_contract_action, ROLE_next_contract_action)
        SPRINGLS__DO(springls__end_merge_round)
    SPRINGLS__END
    SPRINGLS__IF(springls__found_some) SPRINGLS__DO(springls__merge_by_rank) SPRINGLS__END
SPRINGLS__END };

/* Decides for each springl whether it stays, is reshaped, merged or removed, by phi_n: phi at its particle. */
static const springls__entry springls__contract[] = {
    SPRINGLS__IF(springls__has_springls)
        SPRINGLS__ROOM(contract_action, SPRINGLS)
        SPRINGLS__DO(springls__contract_begin)
        SPRINGLS__KERNEL_WITH(contract, SPRINGLS, springls__contract_args)
        SPRINGLS__KERNEL(reshape, SPRINGLS)
        SPRINGLS__DO(springls__triangles_reshaped)
        SPRINGLS__IF(springls__merges_springls) SPRINGLS__CALL(springls__merge) SPRINGLS__END
        SPRINGLS__DO(springls__remove_poor)
    SPRINGLS__END
SPRINGLS__END };

/* Contracts by phi as it is now. Algorithm 2 samples phi before springls move: after a step as long as d_max a good springl is further
   from the old zero level than contract allows. */
static const springls__entry springls__contract_now[] = {
    SPRINGLS__KERNEL(sample_phi, SPRINGLS)
    SPRINGLS__CALL(springls__contract)
SPRINGLS__END };

#endif
