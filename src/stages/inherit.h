/* inherit.h - how attributes follow springls that split, are filled in, merge or are removed (section 4.7).
   Springls change as they would without attributes; at the end of a stage that has added or removed some, their values follow, on
   the host. A new springl is known by its `parent`, a removed one by its contract_action; BLEND interpolates among the springls
   around (interpolation.h). All that can fail is done before anything changes. */
#ifndef SPRINGLS__STAGES_INHERIT_H
#define SPRINGLS__STAGES_INHERIT_H

#include "../runtime/algorithms.h"
#include "../runtime/parallel.h"
#include "../runtime/residency.h"
#include "../model/attribute_values.h"
#include "../model/closest_point.h"
#include "../model/constellation.h"
#include "../model/interpolation.h"
#include "../model/springl_surface.h"
#include "../model/transform.h"

/* ---- split ---- */

SPRINGLS__FN int springls__channels_split_by(const springls_context *ctx, springls_policy policy)
{
    int i, channels = 0;
    for (i = 0; i < ctx->attribute_count; i++) channels += ctx->attributes[i].split == policy ? ctx->attributes[i].channels : 0;
    return channels;
}

/* Makes room for the values of `splits` more springls, and keeps the correspondences that BLEND will need. */
SPRINGLS__FN springls_status springls__attributes_before_split(springls_context *ctx, int splits)
{
    size_t count = (size_t)ctx->model.set.count, blended = (size_t)springls__channels_split_by(ctx, SPRINGLS_POLICY_BLEND);
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__values_reserve(ctx, &ctx->attributes[i], ctx->model.set.count + splits, ctx->model.set.count));
    if (!blended) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__OLD_PLACES, count, sizeof(springls__v3)));
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__NEW_VALUES, 2 * (size_t)splits * blended, sizeof(float)));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A), 0));
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    memcpy(ctx->attribute_memory[SPRINGLS__OLD_PLACES].data, ctx->model.set.a, count * sizeof(springls__v3));
    return SPRINGLS_OK;
}

/* Returns which of the first `count` springls has an id: ids ascend. */
SPRINGLS__FN int springls__springl_of_id(const springls_context *ctx, uint32_t id, int count)
{
    return springls__lower_bound(ctx->model.set.id, sizeof *ctx->model.set.id, count, id);
}

/* Values for new springls; the search has those that were there before. */
typedef struct springls__inherit_job {
    springls_context *ctx;
    springls__interpolation_search search;
    int blended;   /* channels of all attributes that are blended                                               */
    float *values; /* of both halves of each split springl                                                     */
} springls__inherit_job;

/* Returns the springl that a new one was split from: now its other half. */
SPRINGLS__FN int springls__other_half(const springls__inherit_job *job, int child)
{
    return springls__springl_of_id(job->ctx, job->ctx->model.set.parent[child], job->search.known);
}

/* Computes the blended values of both halves, from the values before the split. */
SPRINGLS__FN void springls__blend_halves_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    float *out = job->values + 2 * (size_t)begin * (size_t)job->blended;
    int half, i;
    for (; begin < end; begin++)
        for (half = 0; half < 2; half++) {
            int child = job->search.known + begin;
            int springl = half ? child : springls__other_half(job, child);
            springls__interpolation_sources sources = springls__interpolation_sources_of_springl(&job->search, springl);
            for (i = 0; i < job->ctx->attribute_count; i++) {
                const springls__attribute *attribute = &job->ctx->attributes[i];
                if (attribute->split != SPRINGLS_POLICY_BLEND) continue;
                springls__interpolate_value(attribute, &sources, true, out);
                out += attribute->channels;
            }
        }
}

/* Gives both halves their values. */
SPRINGLS__FN void springls__split_values_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    const float *in = job->values + 2 * (size_t)begin * (size_t)job->blended;
    int i, c;
    for (; begin < end; begin++, in += 2 * job->blended) {
        int child = job->search.known + begin, other = springls__other_half(job, child), at = 0;
        for (i = 0; i < job->ctx->attribute_count; i++) {
            const springls__attribute *attribute = &job->ctx->attributes[i];
            float *first = springls__values_of(attribute, other), *second = springls__values_of(attribute, child);
            for (c = 0; c < attribute->channels; c++) {
                if (attribute->split == SPRINGLS_POLICY_BLEND) first[c] = in[at + c];
                if (attribute->split == SPRINGLS_POLICY_SHARE) first[c] *= 0.5f;
                second[c] = attribute->split == SPRINGLS_POLICY_BLEND ? in[job->blended + at + c] : first[c];
            }
            if (attribute->split == SPRINGLS_POLICY_BLEND) at += attribute->channels;
        }
    }
}

/* Gives springls known, known + 1, ... and their other halves their values. */
SPRINGLS__FN void springls__attributes_after_split(springls_context *ctx, int known)
{
    springls__inherit_job job;
    springls_status status;
    int added = ctx->model.set.count - known;
    if (!ctx->attribute_count) return;
    status = springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID) | SPRINGLS__BIT(PARENT), 0);
    if (status != SPRINGLS_OK) return;
    job.ctx = ctx;
    job.search.ctx = ctx;
    job.search.a = (const springls__v3 *)ctx->attribute_memory[SPRINGLS__OLD_PLACES].data;
    job.search.known = known;
    job.blended = springls__channels_split_by(ctx, SPRINGLS_POLICY_BLEND);
    job.values = (float *)ctx->attribute_memory[SPRINGLS__NEW_VALUES].data;
    if (job.blended) springls__parallel(ctx, added, 32, springls__blend_halves_task, &job);
    springls__parallel(ctx, added, 256, springls__split_values_task, &job);
}

/* ---- fill ---- */

SPRINGLS__FN void springls__fill_values_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    int i;
    for (; begin < end; begin++) {
        int child = job->search.known + begin;
        springls__interpolation_sources sources = springls__interpolation_sources_of_springl(&job->search, child);
        for (i = 0; i < job->ctx->attribute_count; i++) {
            const springls__attribute *attribute = &job->ctx->attributes[i];
            float *values = springls__values_of(attribute, child);
            if (attribute->fill == SPRINGLS_POLICY_SHARE) memset(values, 0, (size_t)attribute->channels * sizeof *values);
            else springls__interpolate_value(attribute, &sources, attribute->fill == SPRINGLS_POLICY_BLEND, values);
        }
    }
}

SPRINGLS__FN springls_status springls__attributes_fill(springls_context *ctx, int known)
{
    springls__inherit_job job;
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__values_reserve(ctx, &ctx->attributes[i], ctx->model.set.count, known));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A), 0));
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.search.ctx = ctx;
    job.search.a = ctx->model.set.a;
    job.search.known = known;
    springls__parallel(ctx, ctx->model.set.count - known, 32, springls__fill_values_task, &job);
    return SPRINGLS_OK;
}

/* Gives springls known, known + 1, ... their values. On failure removes these springls again. */
SPRINGLS__FN springls_status springls__attributes_after_fill(springls_context *ctx, int known)
{
    springls_status status;
    if (!ctx->attribute_count || ctx->model.set.count == known) return SPRINGLS_OK;
    status = springls__attributes_fill(ctx, known);
    if (status == SPRINGLS_OK) return SPRINGLS_OK;
    ctx->stats.added -= ctx->model.set.count - known;
    ctx->model.set.count = known;
    springls__constellation_changed(ctx);
    return status;
}

/* ---- merge ---- */

/* Of a removed springl: the nearest springl of its side that stays, -1 when there is none, and its distance. Of any: its area. */
typedef struct springls__merge_target { int index; float distance, area; } springls__merge_target;

SPRINGLS__FN springls__merge_target springls__merge_target_of(const springls_context *ctx, const uint8_t *action, int i)
{
    const float range = SPRINGLS__FIT_RADIUS, alike = 0.3f;
    const springls__springl *s = ctx->model.set.s;
    springls__near_walk walk = springls__near_walk_begin(&ctx->springl_surface, springls__voxel_to_model(ctx, s[i].p),
                                                         range * ctx->largest_spacing / ctx->smallest_spacing);
    springls__v3 n = springls__springl_normal(s[i]);
    float best = range * range;
    springls__merge_target target;
    int j;
    target.index = -1;
    target.area = 0.5f * springls__length(springls__tri_area2(springls__springl_tri(s[i])));
    while (action[i] == SPRINGLS__REMOVE && (j = springls__near_walk_next(&walk)) >= 0) {
        float d2 = springls__length2(springls__sub(s[j].p, s[i].p));
        if (action[j] == SPRINGLS__REMOVE || d2 > best || (d2 == best && target.index >= 0 && j > target.index)) continue;
        if (springls__dot(springls__springl_normal(s[j]), n) <= alike) continue;
        best = d2;
        target.index = j;
    }
    target.distance = springls__sqrt(best);
    return target;
}

typedef struct springls__merge_targets_job {
    const springls_context *ctx;
    const uint8_t *action;
    springls__merge_target *targets;
} springls__merge_targets_job;

SPRINGLS__FN void springls__merge_targets_task(void *arg, int begin, int end)
{
    const springls__merge_targets_job *job = (const springls__merge_targets_job *)arg;
    for (; begin < end; begin++) job->targets[begin] = springls__merge_target_of(job->ctx, job->action, begin);
}

SPRINGLS__FN bool springls__attributes_merge(const springls_context *ctx)
{
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        if (ctx->attributes[i].merge != SPRINGLS_POLICY_COPY) return true;
    return false;
}

/* Finds where the values of springls go that will be removed (contract_action). */
SPRINGLS__FN springls_status springls__attributes_before_removal(springls_context *ctx)
{
    springls__merge_targets_job job;
    size_t count = (size_t)ctx->model.set.count;
    if (!ctx->attribute_count) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__ROLE_BIT(contract_action), 0));
    if (!springls__attributes_merge(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S), 0));
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__MERGE_TARGETS, count, sizeof(springls__merge_target)));
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    job.ctx = ctx;
    job.action = springls__contract_action(&ctx->model);
    job.targets = (springls__merge_target *)ctx->attribute_memory[SPRINGLS__MERGE_TARGETS].data;
    springls__parallel(ctx, (int)count, 256, springls__merge_targets_task, &job);
    return SPRINGLS_OK;
}

/* Adds the values of springl `gone` to those of `target` (SHARE), or mixes them in with a weight of `share` (BLEND). */
SPRINGLS__FN void springls__merge_values(const springls__attribute *attribute, int target, int gone, float share)
{
    float *to = springls__values_of(attribute, target), *from = springls__values_of(attribute, gone);
    int c;
    for (c = 0; c < attribute->channels; c++)
        to[c] += attribute->merge == SPRINGLS_POLICY_SHARE ? from[c] : share * (from[c] - to[c]);
}

/* Passes the values of removed springls on. One that was removed because another was too close has merged with it: areas weight
   their values. One removed for another reason passes only amounts (SHARE) on. */
SPRINGLS__FN void springls__merge_all_values(springls_context *ctx, int count)
{
    springls__merge_target *targets = (springls__merge_target *)ctx->attribute_memory[SPRINGLS__MERGE_TARGETS].data;
    int i, k;
    for (i = 0; i < count; i++) {
        springls__merge_target *target = targets[i].index < 0 ? NULL : &targets[targets[i].index];
        bool merged = targets[i].distance <= ctx->model.params.merge_distance && targets[i].area > 0.0f;
        if (!target) continue;
        for (k = 0; k < ctx->attribute_count; k++)
            if (ctx->attributes[k].merge != SPRINGLS_POLICY_COPY)
                springls__merge_values(&ctx->attributes[k], targets[i].index, i,
                                       merged ? targets[i].area / (targets[i].area + target->area) : 0.0f);
        if (merged) target->area += targets[i].area;
    }
}

/* Passes values on, and closes the gaps of those that have been removed among `count` springls. */
SPRINGLS__FN void springls__attributes_after_removal(springls_context *ctx, int count)
{
    const uint8_t *action = springls__contract_action(&ctx->model);
    int i, k, n;
    if (!ctx->attribute_count || ctx->lost) return;
    if (springls__attributes_merge(ctx)) springls__merge_all_values(ctx, count);
    for (k = 0; k < ctx->attribute_count; k++)
        for (i = n = 0; i < count; i++)
            if (action[i] != SPRINGLS__REMOVE) springls__values_copy(&ctx->attributes[k], n++, i);
}

#endif
