/* components.h - gives the components of phi, or of what springls hold (params.contouring), ids that last. Springls link them: each has
   the id of its previous component, and votes for a link between that one and its current one. Links make events (events.h) and
   pass on the volumes that components are to keep (volume_lock.h). */
#ifndef SPRINGLS__STAGES_COMPONENTS_H
#define SPRINGLS__STAGES_COMPONENTS_H

#include "../runtime/parallel.h"
#include "../runtime/residency.h"
#include "label_components.h"
#include "surface_parts.h"

/* A component of the model, as it was found last. */
typedef struct springls__component {
    springls_component view;
    double target;          /* voxel^3 that it is to have (volume_lock.h); 0: not measured yet      */
    int32_t deepest[3], pad; /* the voxel furthest from its surface: shows which label is its own; of a part of the mesh its number */
} springls__component;

/* The current components that a springl bounds, -1: none. */
typedef struct springls__bounded_components { int32_t body, cavity; } springls__bounded_components;

/* A link from a previous component to a current one that it has become, both by their places in the lists. */
typedef struct springls__component_link {
    int32_t previous, current;
    int64_t votes; /* of springls; of links by `previous` only */
} springls__component_link;

/* The previous and the current components, and their links. */
typedef struct springls__component_graph {
    const springls__component *previous;
    int previous_count;
    springls__labels labels;
    springls__bounded_components *place;   /* one a springl                          */
    springls__component_link *link;        /* by `previous`, then by `current`       */
    springls__component_link *link_by_current; /* by `current`, then by `previous`   */
    int link_count;
} springls__component_graph;

SPRINGLS__FN springls__component *springls__component_list(const springls_context *ctx)
{
    return (springls__component *)ctx->component_memory.data;
}

/* Returns the place of an id in a list by ascending ids; -1: it is not there. */
SPRINGLS__FN int32_t springls__find_component(const springls__component *list, int count, uint32_t id)
{
    const int place = count > 0 ? springls__lower_bound(&list->view.id, sizeof *list, count, id) : 0;
    return place < count && list[place].view.id == id ? place : -1;
}

/* Returns true when components have ids that last. */
SPRINGLS__FN bool springls__components_enabled(const springls_context *ctx)
{
    return ctx->model.params.components || ctx->model.params.volume_lock;
}

/* Clears the list of components. New ones get ids that none has had. */
SPRINGLS__FN void springls__clear_components(springls_context *ctx)
{
    ctx->component_count = 0;
    ctx->components_found = false;
}

/* Clears the volumes that components are to keep: the next step measures them. */
SPRINGLS__FN void springls__clear_target_volumes(springls_context *ctx)
{
    int i;
    for (i = 0; i < ctx->component_count; i++) springls__component_list(ctx)[i].target = 0.0;
    ctx->volumes_locked = false;
}

/* ---- links ---- */

SPRINGLS__FN uint64_t springls__vote(int32_t previous, int32_t current) { return (uint64_t)previous << 32 | (uint64_t)current; }

typedef struct springls__place_job {
    const springls_context *ctx;
    springls__component_graph *graph;
} springls__place_job;

/* Finds the current components that springls bound. */
SPRINGLS__FN void springls__place_springls_task(void *arg, int begin, int end)
{
    const springls__place_job *job = (const springls__place_job *)arg;
    for (; begin < end; begin++) {
        springls__bounded_components *place = &job->graph->place[begin];
        if (springls__contours_springls(job->ctx)) {
            const int32_t part = springls__part_of_springl(job->ctx, begin);
            place->body = part < 0 ? -1 : springls__body_of_part(springls__surface_parts(job->ctx), part);
            place->cavity = part < 0 ? -1 : springls__cavity_of_part(springls__surface_parts(job->ctx), part);
        } else {
            springls__components_at(&job->ctx->model.grid, &job->graph->labels, job->ctx->model.set.s[begin].p, &place->body,
                                    &place->cavity);
        }
    }
}

/* Collects the votes of springls, and counts those of every component: first the previous ones, then the current ones. Returns
   how many votes there are. */
SPRINGLS__FN size_t springls__collect_votes(const springls_context *ctx, const springls__component_graph *graph, uint64_t *votes,
                                            int64_t *count)
{
    const springls__constellation *set = &ctx->model.set;
    size_t n = 0;
    int i, c;
    for (i = 0; i < set->count; i++) {
        int32_t previous[2], current[2];
        previous[0] = springls__find_component(graph->previous, graph->previous_count, set->component[i]);
        previous[1] = springls__find_component(graph->previous, graph->previous_count, set->cavity[i]);
        current[0] = graph->place[i].body;
        current[1] = graph->place[i].cavity;
        for (c = 0; c < 2; c++) {
            if (previous[c] >= 0) count[previous[c]]++;
            if (current[c] >= 0) count[graph->previous_count + current[c]]++;
            if (previous[c] >= 0 && current[c] >= 0) votes[n++] = springls__vote(previous[c], current[c]);
        }
    }
    return n;
}

/* Returns whether `votes` of all that a component has make a link: a tenth of them, and three, or more than half. Where two come
   close, single springls vote for the wrong one. */
SPRINGLS__FN bool springls__is_link(int64_t votes, int64_t all) { return 10 * votes >= all && (votes >= 3 || 2 * votes > all); }

/* Links components that enough votes of either one link. */
SPRINGLS__FN void springls__link_by_votes(springls__component_graph *graph, const uint64_t *votes, size_t vote_count,
                                          const int64_t *count)
{
    size_t i = 0, first;
    graph->link_count = 0;
    while (i < vote_count) {
        springls__component_link link;
        int64_t votes_here;
        link.previous = (int32_t)(votes[i] >> 32);
        link.current = (int32_t)(votes[i] & 0xffffffffu);
        for (first = i; i < vote_count && votes[i] == votes[first]; i++) continue;
        link.votes = votes_here = (int64_t)(i - first);
        if (graph->previous[link.previous].view.cavity != graph->labels.item[link.current].cavity) continue;
        if (springls__is_link(votes_here, count[link.previous])
            || springls__is_link(votes_here, count[graph->previous_count + link.current]))
            graph->link[graph->link_count++] = link;
    }
}

/* Sorts links by their current components. key: room for one a link. */
SPRINGLS__FN void springls__sort_links_by_current(springls__component_graph *graph, uint64_t *key)
{
    int i;
    for (i = 0; i < graph->link_count; i++) key[i] = springls__vote(graph->link[i].current, graph->link[i].previous);
    springls__sort_keys(key, (size_t)graph->link_count);
    graph->link_by_current = graph->link + graph->link_count;
    for (i = 0; i < graph->link_count; i++) {
        graph->link_by_current[i].current = (int32_t)(key[i] >> 32);
        graph->link_by_current[i].previous = (int32_t)(key[i] & 0xffffffffu);
        graph->link_by_current[i].votes = 0;
    }
}

/* Finds the links of a previous or a current component. Returns the first of *count. */
SPRINGLS__FN const springls__component_link *springls__links_of(const springls__component_graph *graph, int32_t component,
                                                                bool current, int *count)
{
    const springls__component_link *list = current ? graph->link_by_current : graph->link;
    const int32_t *number = current ? &list->current : &list->previous;
    const int first = springls__lower_bound(number, sizeof *list, graph->link_count, (uint32_t)component);
    *count = springls__lower_bound(number, sizeof *list, graph->link_count, (uint32_t)component + 1u) - first;
    return list + first;
}

/* Finds the current components, and links them to the previous ones. */
SPRINGLS__FN springls_status springls__link_components(springls_context *ctx, springls__component_graph *graph)
{
    size_t springls = (size_t)ctx->model.set.count, nodes, votes, i;
    uint64_t *vote;
    int64_t *count;
    springls__place_job job;
    if (springls__contours_springls(ctx)) SPRINGLS__TRY(springls__find_part_components(ctx, &graph->labels));
    else SPRINGLS__TRY(springls__find_components(ctx, &graph->labels));
    graph->previous = springls__component_list(ctx);
    graph->previous_count = ctx->component_count;
    nodes = (size_t)graph->previous_count + (size_t)graph->labels.count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, springl_components, springls));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_votes, 2 * springls));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, vote_counts, nodes));
    graph->place = springls__springl_components(&ctx->model);
    vote = springls__component_votes(&ctx->model);
    count = springls__vote_counts(&ctx->model);
    for (i = 0; i < nodes; i++) count[i] = 0;
    job.ctx = ctx;
    job.graph = graph;
    springls__parallel(ctx, ctx->model.set.count, 512, springls__place_springls_task, &job);
    votes = springls__collect_votes(ctx, graph, vote, count);
    springls__sort_keys(vote, votes);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_links, 2 * votes));
    graph->link = springls__component_links(&ctx->model);
    springls__link_by_votes(graph, vote, votes, count);
    springls__sort_links_by_current(graph, vote);
    return SPRINGLS_OK;
}

/* ---- ids ---- */

/* Estimates the volume that a link has passed on, voxel^3 times `scale`: the whole of a component that has no other link; else the previous
   component's volume, shared out by the springls of its links. */
SPRINGLS__FN double springls__passed_volume(const springls__component_graph *graph, const springls__component_link *link,
                                            double scale)
{
    double previous = graph->previous[link->previous].view.volume;
    int parts, sources, i;
    int64_t votes = 0;
    const springls__component_link *all = springls__links_of(graph, link->previous, false, &parts);
    springls__links_of(graph, link->current, true, &sources);
    if (parts == 1) return previous;
    if (sources == 1) return graph->labels.item[link->current].surface.volume * scale;
    for (i = 0; i < parts; i++) votes += all[i].votes;
    return previous * (double)link->votes / (double)votes;
}

/* The largest link of a component; of equal ones the first. */
typedef struct springls__largest_link { double volume; int32_t link; } springls__largest_link;

SPRINGLS__FN void springls__note_link(springls__largest_link *largest, double volume, int32_t link)
{
    if (largest->link >= 0 && !(volume > largest->volume)) return;
    largest->volume = volume;
    largest->link = link;
}

/* Gives ids: a component passes its own to its largest part, unless that has a larger part of another; all others get new ones.
   Components that split and merge in one step get ids as if they had split a step before. */
SPRINGLS__FN springls_status springls__assign_component_ids(springls_context *ctx, springls__component_graph *graph)
{
    springls__current_component *item = graph->labels.item;
    const double scale = fabs(springls__determinant(ctx->window.to_world));
    int nodes = graph->previous_count + graph->labels.count, i;
    springls__largest_link *largest;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, largest_links, nodes));
    largest = springls__largest_links(&ctx->model);
    for (i = 0; i < nodes; i++) largest[i].link = -1;
    for (i = 0; i < graph->link_count; i++) {
        const springls__component_link *link = &graph->link[i];
        double volume = springls__passed_volume(graph, link, scale);
        springls__note_link(&largest[link->previous], volume, i);
        springls__note_link(&largest[graph->previous_count + link->current], volume, i);
    }
    for (i = 0; i < graph->labels.count; i++) {
        int32_t k = largest[graph->previous_count + i].link;
        bool both = k >= 0 && largest[graph->link[k].previous].link == k;
        item[i].id = both ? graph->previous[graph->link[k].previous].view.id : ++ctx->last_component_id;
    }
    return SPRINGLS_OK;
}

/* Writes what the interface shows of a component. */
SPRINGLS__FN void springls__write_component_view(const springls_context *ctx, const springls__current_component *item,
                                                 springls_component *out)
{
    const springls__surface_sums *sums = &item->surface;
    double scale = fabs(springls__determinant(ctx->window.to_world)), weight = sums->volume != 0.0 ? 1.0 / sums->volume : 0.0;
    memset(out, 0, sizeof *out);
    out->id = item->id;
    out->cavity = item->cavity;
    out->volume = sums->volume * scale;
    out->area = sums->world_area;
    out->correction = item->moved;
    springls__voxel_to_world(ctx, springls__v3_make((float)(sums->moment[0] * weight), (float)(sums->moment[1] * weight),
                                                    (float)(sums->moment[2] * weight)), out->center);
}

/* Gives every springl the ids of what it bounds. One that bounds no body keeps the id of its body while that exists. */
SPRINGLS__FN void springls__label_springls(springls_context *ctx, const springls__component_graph *graph)
{
    springls__constellation *set = &ctx->model.set;
    int i;
    for (i = 0; i < set->count; i++) {
        springls__bounded_components current = graph->place[i];
        if (current.body >= 0) set->component[i] = graph->labels.item[current.body].id;
        else if (springls__find_component(springls__component_list(ctx), ctx->component_count, set->component[i]) < 0)
            set->component[i] = 0u;
        set->cavity[i] = current.cavity >= 0 ? graph->labels.item[current.cavity].id : 0u;
    }
}

/* Makes room for the list of `count` current components, beside that of the previous ones, and for their order. */
SPRINGLS__FN springls_status springls__component_list_reserve(springls_context *ctx, int count)
{
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, component_order, count + 1));
    return springls__buffer_grow(ctx, &ctx->next_component_memory, (size_t)count + 1, sizeof(springls__component), 0);
}

/* Replaces the list by the current components, by ascending ids. */
SPRINGLS__FN void springls__store_components(springls_context *ctx, const springls__component_graph *graph)
{
    springls__component *list = (springls__component *)ctx->next_component_memory.data;
    uint64_t *order = springls__component_order(&ctx->model);
    springls__buffer memory = ctx->component_memory;
    int i;
    for (i = 0; i < graph->labels.count; i++) order[i] = (uint64_t)graph->labels.item[i].id << 32 | (uint64_t)i;
    springls__sort_keys(order, (size_t)graph->labels.count);
    for (i = 0; i < graph->labels.count; i++) {
        const springls__current_component *item = &graph->labels.item[order[i] & 0xffffffffu];
        memset(&list[i], 0, sizeof *list);
        springls__write_component_view(ctx, item, &list[i].view);
        if (springls__contours_springls(ctx)) springls__voxel_of_number(&ctx->model.grid, item->deepest, list[i].deepest);
        else springls__labelled_voxel(&ctx->model.grid, item->deepest, list[i].deepest);
    }
    ctx->component_memory = ctx->next_component_memory;
    ctx->next_component_memory = memory;
    ctx->component_count = graph->labels.count;
    ctx->components_found = true;
    ctx->components_version = springls__components_source(ctx);
}

/* ---- labels and ids ---- */

/* Copies to the host what components are found from. */
SPRINGLS__FN springls_status springls__components_to_host(springls_context *ctx, uint64_t writes)
{
    const uint64_t reads = SPRINGLS__BIT(S) | SPRINGLS__BIT(COMPONENT) | SPRINGLS__BIT(CAVITY) | SPRINGLS__BIT(TOP)
                         | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(SLOT_BRICK);
    ctx->on_device = false;
    springls__forget_work(ctx);
    return springls__to_host(ctx, reads, writes);
}

/* Finds the labels of components: parts of the mesh, or those of voxels, unless these are fresh. */
SPRINGLS__FN springls_status springls__find_labels(springls_context *ctx, springls__labels *l)
{
    if (springls__contours_springls(ctx)) return springls__find_part_components(ctx, l);
    if (ctx->labels_version != ctx->phi_version) return springls__label_voxels(ctx, l);
    *l = springls__kept_labels(ctx);
    return SPRINGLS_OK;
}

/* Finds the labels, and the id of every one. */
SPRINGLS__FN springls_status springls__label_ids(springls_context *ctx, springls__labels *l)
{
    uint32_t *id;
    int i;
    SPRINGLS__TRY(springls__find_labels(ctx, l));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->label_id_memory, (size_t)l->count + 1, sizeof *id, 0));
    id = (uint32_t *)ctx->label_id_memory.data;
    memset(id, 0, (size_t)l->count * sizeof *id);
    for (i = 0; i < ctx->component_count; i++) {
        const springls__component *c = &springls__component_list(ctx)[i];
        int32_t label = springls__contours_springls(ctx) ? springls__number_of_voxel(&ctx->model.grid, c->deepest)
                      : springls__component_of_voxel(&ctx->model.grid, l, c->deepest[0], c->deepest[1], c->deepest[2]);
        if (label >= 0 && label < l->count) id[label] = c->view.id;
    }
    return SPRINGLS_OK;
}

#endif
