/* components.h - gives the components of phi ids that last. Springls are the kinship: each has the id of the component that it
   was in, and votes for a link between that one and the one that it is in now. Links make events (events.h) and pass on the
   volumes that components are to keep (volume_lock.h). */
#ifndef SPRINGLS__STAGES_COMPONENTS_H
#define SPRINGLS__STAGES_COMPONENTS_H

#include "../runtime/residency.h"
#include "label_components.h"

/* A component of the model, as it was found last. */
typedef struct springls__component {
    springls_component seen;
    double target;          /* voxel^3 that it is to have (volume_lock.h); 0: not measured yet      */
    int32_t deepest[3], pad; /* the voxel furthest from its surface: shows which label is its own  */
} springls__component;

/* The components that a springl bounds now, -1: none. */
typedef struct springls__place_now { int32_t body, cavity; } springls__place_now;

/* A component before, by its place in the list, and one of those it has become. */
typedef struct springls__link { int32_t before, now; } springls__link;

/* The components before and now, and what links them. */
typedef struct springls__kinship {
    const springls__component *before;
    int before_count;
    springls__labels labels;
    springls__place_now *place;   /* one a springl                          */
    springls__link *link;         /* by `before`, then by `now`             */
    int link_count;
} springls__kinship;

SPRINGLS__FN springls__component *springls__component_list(const springls_context *ctx)
{
    return (springls__component *)ctx->component_memory.data;
}

/* Returns the place of an id in a list by ascending ids; -1: it is not there. */
SPRINGLS__FN int32_t springls__find_component(const springls__component *list, int count, uint32_t id)
{
    int low = 0, high = count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (list[middle].seen.id < id) low = middle + 1;
        else high = middle;
    }
    return low < count && list[low].seen.id == id ? low : -1;
}

/* Returns true when components have ids that last. */
SPRINGLS__FN bool springls__follows_components(const springls_context *ctx)
{
    return ctx->model.params.components || ctx->model.params.volume_lock;
}

/* Forgets the components: ids go on where they were. */
SPRINGLS__FN void springls__forget_components(springls_context *ctx)
{
    ctx->component_count = 0;
    ctx->components_known = ctx->components_fresh = false;
}

/* Forgets the volumes that components are to keep: the next step measures them. */
SPRINGLS__FN void springls__forget_targets(springls_context *ctx)
{
    int i;
    for (i = 0; i < ctx->component_count; i++) springls__component_list(ctx)[i].target = 0.0;
    ctx->volumes_locked = false;
}

/* ---- links ---- */

SPRINGLS__FN uint64_t springls__vote(int32_t before, int32_t now) { return (uint64_t)before << 32 | (uint64_t)now; }

/* Finds what every springl bounds now, and its votes. Returns how many. Counts those of every component, those before first. */
SPRINGLS__FN size_t springls__collect_votes(const springls_context *ctx, springls__kinship *k, uint64_t *votes, int64_t *count)
{
    const springls__constellation *set = &ctx->model.set;
    size_t n = 0;
    int i, c;
    for (i = 0; i < set->count; i++) {
        int32_t before[2], now[2];
        springls__components_at(&ctx->model.grid, &k->labels, set->s[i].p, &k->place[i].body, &k->place[i].cavity);
        before[0] = springls__find_component(k->before, k->before_count, set->component[i]);
        before[1] = springls__find_component(k->before, k->before_count, set->cavity[i]);
        now[0] = k->place[i].body;
        now[1] = k->place[i].cavity;
        for (c = 0; c < 2; c++) {
            if (before[c] >= 0) count[before[c]]++;
            if (now[c] >= 0) count[k->before_count + now[c]]++;
            if (before[c] >= 0 && now[c] >= 0) votes[n++] = springls__vote(before[c], now[c]);
        }
    }
    return n;
}

/* Returns whether `votes` of all that a component has make a link: a tenth of them, and three, or more than half. Where two come
   close, single springls vote for the wrong one. */
SPRINGLS__FN bool springls__is_link(int64_t votes, int64_t all) { return 10 * votes >= all && (votes >= 3 || 2 * votes > all); }

/* Links components that enough votes of either one link. */
SPRINGLS__FN void springls__link_by_votes(springls__kinship *k, const uint64_t *votes, size_t vote_count, const int64_t *count)
{
    size_t i = 0, first;
    k->link_count = 0;
    while (i < vote_count) {
        springls__link link;
        int64_t votes_here;
        link.before = (int32_t)(votes[i] >> 32);
        link.now = (int32_t)(votes[i] & 0xffffffffu);
        for (first = i; i < vote_count && votes[i] == votes[first]; i++) continue;
        votes_here = (int64_t)(i - first);
        if (k->before[link.before].seen.cavity != k->labels.item[link.now].cavity) continue;
        if (springls__is_link(votes_here, count[link.before]) || springls__is_link(votes_here, count[k->before_count + link.now]))
            k->link[k->link_count++] = link;
    }
}

/* Finds the components as they are now, and links them to those before. */
SPRINGLS__FN springls_status springls__find_kinship(springls_context *ctx, springls__kinship *k)
{
    size_t springls = (size_t)ctx->model.set.count, nodes, votes, i;
    uint64_t *vote;
    int64_t *count;
    SPRINGLS__TRY(springls__find_components(ctx, &k->labels));
    k->before = springls__component_list(ctx);
    k->before_count = ctx->component_count;
    nodes = (size_t)k->before_count + (size_t)k->labels.count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, places_now, springls));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_votes, 2 * springls));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vote_counts, nodes));
    k->place = springls__places_now(&ctx->model);
    vote = springls__component_votes(&ctx->model);
    count = springls__vote_counts(&ctx->model);
    for (i = 0; i < nodes; i++) count[i] = 0;
    votes = springls__collect_votes(ctx, k, vote, count);
    springls__sort_keys(vote, votes);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_links, votes));
    k->link = springls__component_links(&ctx->model);
    springls__link_by_votes(k, vote, votes, count);
    return SPRINGLS_OK;
}

/* ---- ids ---- */

/* Returns the component before with the largest volume that has not passed on its id yet, of equal ones that with the lower id;
   -1: none. */
SPRINGLS__FN int32_t springls__next_heir(const springls__kinship *k, const uint8_t *done)
{
    int32_t i, best = -1;
    for (i = 0; i < k->before_count; i++)
        if (!done[i] && (best < 0 || k->before[i].seen.volume > k->before[best].seen.volume)) best = i;
    return best;
}

/* Gives ids: from the largest on, each component passes its own to its largest part that has none yet. Other parts get new ones. */
SPRINGLS__FN springls_status springls__pass_on_ids(springls_context *ctx, springls__kinship *k)
{
    springls__component_now *item = k->labels.item;
    uint8_t *done;
    int32_t before;
    int i;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_done, k->before_count + 1));
    done = springls__component_done(&ctx->model);
    memset(done, 0, (size_t)k->before_count);
    while ((before = springls__next_heir(k, done)) >= 0) {
        int32_t largest = -1;
        for (i = 0; i < k->link_count; i++) {
            int32_t now = k->link[i].now;
            if (k->link[i].before != before || item[now].id) continue;
            if (largest < 0 || item[now].volume > item[largest].volume) largest = now;
        }
        done[before] = 1;
        if (largest >= 0) item[largest].id = k->before[before].seen.id;
    }
    for (i = 0; i < k->labels.count; i++)
        if (!item[i].id) item[i].id = ++ctx->last_component_id;
    return SPRINGLS_OK;
}

/* Writes what the interface shows of a component. */
SPRINGLS__FN void springls__show_component(const springls_context *ctx, const springls__component_now *item,
                                           springls_component *out)
{
    double scale = fabs(springls__determinant(ctx->to_world)), weight = item->volume != 0.0 ? 1.0 / item->volume : 0.0;
    memset(out, 0, sizeof *out);
    out->id = item->id;
    out->cavity = item->cavity;
    out->volume = item->volume * scale;
    out->area = item->world_area;
    out->correction = item->moved;
    springls__voxel_to_world(ctx, springls__v3_make((float)(item->moment[0] * weight), (float)(item->moment[1] * weight),
                                                    (float)(item->moment[2] * weight)), out->center);
}

/* Gives every springl the ids of what it bounds; one that bounds no body keeps that it had. */
SPRINGLS__FN void springls__label_springls(springls_context *ctx, const springls__kinship *k)
{
    springls__constellation *set = &ctx->model.set;
    int i;
    for (i = 0; i < set->count; i++) {
        springls__place_now now = k->place[i];
        if (now.body >= 0) set->component[i] = k->labels.item[now.body].id;
        set->cavity[i] = now.cavity >= 0 ? k->labels.item[now.cavity].id : 0u;
    }
}

/* Makes room for the list of the components now, besides that of those before, which stays. */
SPRINGLS__FN springls_status springls__component_list_reserve(springls_context *ctx, int count)
{
    return springls__buffer_grow(ctx, &ctx->next_component_memory, (size_t)count + 1, sizeof(springls__component), 0);
}

/* Replaces the list by the components now, by ascending ids. */
SPRINGLS__FN void springls__store_components(springls_context *ctx, const springls__kinship *k)
{
    springls__component *list = (springls__component *)ctx->next_component_memory.data;
    springls__buffer memory = ctx->component_memory;
    int i, j;
    for (i = 0; i < k->labels.count; i++) {
        for (j = i; j > 0 && list[j - 1].seen.id > k->labels.item[i].id; j--) memcpy(&list[j], &list[j - 1], sizeof *list);
        memset(&list[j], 0, sizeof *list);
        springls__show_component(ctx, &k->labels.item[i], &list[j].seen);
        springls__voxel_of_node(&ctx->model.grid, k->labels.item[i].deepest, list[j].deepest);
    }
    ctx->component_memory = ctx->next_component_memory;
    ctx->next_component_memory = memory;
    ctx->component_count = k->labels.count;
    ctx->components_known = ctx->components_fresh = true;
}

/* ---- which label is whose ---- */

/* Copies to the host what components are found from. */
SPRINGLS__FN springls_status springls__components_to_host(springls_context *ctx, uint64_t writes)
{
    const uint64_t reads = SPRINGLS__BIT(S) | SPRINGLS__BIT(COMPONENT) | SPRINGLS__BIT(CAVITY) | SPRINGLS__BIT(TOP)
                         | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(SLOT_BRICK);
    ctx->on_device = false;
    springls__forget_work(ctx);
    return springls__to_host(ctx, reads, writes);
}

/* Labels the voxels, unless they are labelled still, and finds the id of every label. */
SPRINGLS__FN springls_status springls__label_ids(springls_context *ctx, springls__labels *l)
{
    const springls__grid *g = &ctx->model.grid;
    uint32_t *id;
    int i;
    if (ctx->labels_fresh && ctx->labelled_bricks == g->active_count) *l = springls__kept_labels(ctx);
    else SPRINGLS__TRY(springls__label_voxels(ctx, l));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_id_memory, (size_t)l->count + 1, sizeof *id, 0));
    id = (uint32_t *)ctx->label_id_memory.data;
    memset(id, 0, (size_t)l->count * sizeof *id);
    for (i = 0; i < ctx->component_count; i++) {
        const springls__component *c = &springls__component_list(ctx)[i];
        int32_t label = springls__label_of_node(l, springls__label_node(g, l, c->deepest[0], c->deepest[1], c->deepest[2]));
        if (label >= 0) id[label] = c->seen.id;
    }
    return SPRINGLS_OK;
}

#endif
