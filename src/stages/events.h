/* events.h - lists what has happened to components: births, deaths, mergers and splits, each with its parts and its place.

   Why springls tell: a label of phi has no past. A springl has: it was of one component, and is of another one now. Links between previous
   and present components are votes of springls (components.h), and a component with two links has split, or is a merger:

        previous   1     2        1 and 2 -> 3: a merger         1 -> 3 and 4: a split
                    \   /          no link to the past: a birth  no link to the present: a death
        present       3           its place: where springls of two parts are closest to each other */
#ifndef SPRINGLS__STAGES_EVENTS_H
#define SPRINGLS__STAGES_EVENTS_H

#include "components.h"

/* ---- where components have met or parted: between springls of two of them that are close to each other ---- */

/* A springl of one of the components in question. */
typedef struct springls__seam_springl { springls__v3 p; int32_t component; } springls__seam_springl;

typedef struct springls__seam {
    springls__seam_springl *item;
    uint64_t *key;          /* cell of an item, and its number; ascending           */
    int count;
    float cell;             /* voxels                                               */
    float nearest;          /* distance of two items of different components        */
    double sum[3], pairs;   /* of the middles of those that are not much further    */
} springls__seam;

enum { SPRINGLS__SEAM_BITS = 31, SPRINGLS__SEAM_CELLS = 2056 }; /* bits of the number in a key; cells an axis */

/* Returns the cell that is (dx, dy, dz) from that of p, which is moved into the domain. */
SPRINGLS__FN uint64_t springls__seam_cell(const springls__seam *seam, springls__v3 p, int dx, int dy, int dz)
{
    uint64_t x = (uint64_t)((int)(springls__clamp(p.x, 0.0f, 4096.0f) / seam->cell) + 1 + dx);
    uint64_t y = (uint64_t)((int)(springls__clamp(p.y, 0.0f, 4096.0f) / seam->cell) + 1 + dy);
    uint64_t z = (uint64_t)((int)(springls__clamp(p.z, 0.0f, 4096.0f) / seam->cell) + 1 + dz);
    return (z * SPRINGLS__SEAM_CELLS + y) * SPRINGLS__SEAM_CELLS + x;
}

/* Returns the first place of `key` with a cell not before `cell`. */
SPRINGLS__FN int springls__seam_find(const springls__seam *seam, uint64_t cell)
{
    int low = 0, high = seam->count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (seam->key[middle] >> SPRINGLS__SEAM_BITS < cell) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Takes a pair into account: in the first pass for the least distance, in the second for the mean of the middles. */
SPRINGLS__FN void springls__seam_pair(springls__seam *seam, springls__v3 a, springls__v3 b, bool second)
{
    const float range = 1.0f; /* voxels */
    float distance = springls__length(springls__sub(a, b));
    if (!second) {
        seam->nearest = springls__min(seam->nearest, distance);
    } else if (distance <= seam->nearest + range) {
        seam->sum[0] += 0.5 * ((double)a.x + (double)b.x);
        seam->sum[1] += 0.5 * ((double)a.y + (double)b.y);
        seam->sum[2] += 0.5 * ((double)a.z + (double)b.z);
        seam->pairs += 1.0;
    }
}

/* Pairs item i with those after it in the 27 cells around it. */
SPRINGLS__FN void springls__seam_pairs_of(springls__seam *seam, int i, bool second)
{
    const uint64_t number = ((uint64_t)1 << SPRINGLS__SEAM_BITS) - 1;
    const springls__seam_springl *a = &seam->item[i];
    int row, k;
    for (row = 0; row < 9; row++) {
        uint64_t first = springls__seam_cell(seam, a->p, -1, row % 3 - 1, row / 3 - 1);
        for (k = springls__seam_find(seam, first); k < seam->count; k++) {
            const springls__seam_springl *b = &seam->item[seam->key[k] & number];
            if (seam->key[k] >> SPRINGLS__SEAM_BITS > first + 2) break;
            if (b > a && b->component != a->component) springls__seam_pair(seam, a->p, b->p, second);
        }
    }
}

/* Finds the middle between the components of the items, voxels; false if they are not within 16 voxels. */
SPRINGLS__FN bool springls__find_seam(springls__seam *seam, springls__v3 *middle)
{
    const float furthest = 16.0f;
    int i;
    for (seam->cell = 2.0f; seam->cell <= furthest; seam->cell *= 2.0f) {
        for (i = 0; i < seam->count; i++)
            seam->key[i] = springls__seam_cell(seam, seam->item[i].p, 0, 0, 0) << SPRINGLS__SEAM_BITS | (uint64_t)i;
        springls__sort_keys(seam->key, (size_t)seam->count);
        seam->nearest = FLT_MAX;
        for (i = 0; i < seam->count; i++) springls__seam_pairs_of(seam, i, false);
        if (!(seam->nearest + 1.0f <= seam->cell)) continue;
        seam->sum[0] = seam->sum[1] = seam->sum[2] = seam->pairs = 0.0;
        for (i = 0; i < seam->count; i++) springls__seam_pairs_of(seam, i, true);
        *middle = springls__v3_make((float)(seam->sum[0] / seam->pairs), (float)(seam->sum[1] / seam->pairs),
                                    (float)(seam->sum[2] / seam->pairs));
        return true;
    }
    return false;
}

/* ---- the list ---- */

/* Drops the events of the last step, before another begins. Those that calls since then have made stay: the next step's list has
   them, whether or not somebody has read them before. */
SPRINGLS__FN void springls__drop_past_events(springls_context *ctx)
{
    springls_event *event = (springls_event *)ctx->event_memory.data;
    springls_component *part = (springls_component *)ctx->event_part_memory.data;
    const int past = ctx->event_count - ctx->new_events;
    int i, parts = 0;
    for (i = 0; i < past; i++) parts += event[i].before_count + event[i].after_count;
    ctx->event_count -= past;
    ctx->event_part_count -= parts;
    ctx->new_events = 0;
    if (ctx->event_count > 0) memmove(event, event + past, (size_t)ctx->event_count * sizeof *event);
    if (ctx->event_part_count > 0) memmove(part, part + parts, (size_t)ctx->event_part_count * sizeof *part);
}

/* Appends an event without parts. */
SPRINGLS__FN springls_event *springls__add_event(springls_context *ctx, springls_event_kind kind, bool cavity)
{
    springls_event *event = (springls_event *)ctx->event_memory.data + ctx->event_count++;
    memset(event, 0, sizeof *event);
    event->kind = kind;
    event->cavity = cavity;
    event->step = ctx->stats.steps;
    event->time = ctx->time;
    return event;
}

/* Appends a part to the last event. */
SPRINGLS__FN void springls__add_event_part(springls_context *ctx, const springls_component *part)
{
    memcpy((springls_component *)ctx->event_part_memory.data + ctx->event_part_count++, part, sizeof *part);
}

SPRINGLS__FN void springls__add_current_part(springls_context *ctx, const springls__component_graph *graph, int32_t current)
{
    springls_component part;
    springls__write_component_view(ctx, &graph->labels.item[current], &part);
    springls__add_event_part(ctx, &part);
}

/* Sets the place of an event to the middle of the centers of its parts, which are the last ones. */
SPRINGLS__FN void springls__place_at_centers(springls_context *ctx, springls_event *event)
{
    int parts = event->before_count + event->after_count, i, c;
    const springls_component *part = (const springls_component *)ctx->event_part_memory.data + ctx->event_part_count - parts;
    for (i = 0; i < parts; i++)
        for (c = 0; c < 3; c++) event->place[c] += part[i].center[c] / (float)parts;
}

/* Sets the place of a split of `previous`, or, with previous < 0, of a merger into `current`. */
SPRINGLS__FN springls_status springls__place_at_seam(springls_context *ctx, const springls__component_graph *graph,
                                                     int32_t previous, int32_t current, springls_event *event)
{
    const springls__constellation *set = &ctx->model.set;
    springls__seam seam;
    springls__v3 middle;
    int i;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, seam_springls, set->count));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, seam_keys, set->count));
    seam.item = springls__seam_springls(&ctx->model);
    seam.key = springls__seam_keys(&ctx->model);
    seam.count = 0;
    for (i = 0; i < set->count; i++) {
        uint32_t id = event->cavity ? set->cavity[i] : set->component[i];
        int32_t previous_component = springls__find_component(graph->previous, graph->previous_count, id);
        int32_t current_component = event->cavity ? graph->place[i].cavity : graph->place[i].body;
        if (previous_component < 0 || current_component < 0) continue;
        if (previous >= 0 ? previous_component != previous : current_component != current) continue;
        seam.item[seam.count].p = set->s[i].p;
        seam.item[seam.count++].component = previous >= 0 ? current_component : previous_component;
    }
    if (springls__find_seam(&seam, &middle)) springls__voxel_to_world(ctx, middle, event->place);
    else springls__place_at_centers(ctx, event);
    return SPRINGLS_OK;
}

/* Lists the death or split of a previous component. */
SPRINGLS__FN springls_status springls__list_split_or_death(springls_context *ctx, const springls__component_graph *graph,
                                                           int32_t previous)
{
    const springls_component *view = &graph->previous[previous].view;
    int parts, i;
    const springls__component_link *link = springls__links_of(graph, previous, false, &parts);
    springls_event *event;
    if (parts == 1) return SPRINGLS_OK;
    event = springls__add_event(ctx, parts ? SPRINGLS_EVENT_KIND_SPLIT : SPRINGLS_EVENT_KIND_DEATH, view->cavity);
    event->before_count = 1;
    event->after_count = parts;
    springls__add_event_part(ctx, view);
    for (i = 0; i < parts; i++) springls__add_current_part(ctx, graph, link[i].current);
    if (parts) return springls__place_at_seam(ctx, graph, previous, -1, event);
    springls__place_at_centers(ctx, event);
    return SPRINGLS_OK;
}

/* Lists the birth or merger of a current component. */
SPRINGLS__FN springls_status springls__list_merger_or_birth(springls_context *ctx, const springls__component_graph *graph,
                                                            int32_t current)
{
    int parts, i;
    const springls__component_link *link = springls__links_of(graph, current, true, &parts);
    springls_event *event;
    if (parts == 1) return SPRINGLS_OK;
    event = springls__add_event(ctx, parts ? SPRINGLS_EVENT_KIND_MERGE : SPRINGLS_EVENT_KIND_BIRTH,
                                graph->labels.item[current].cavity);
    event->before_count = parts;
    event->after_count = 1;
    for (i = 0; i < parts; i++) springls__add_event_part(ctx, &graph->previous[link[i].previous].view);
    springls__add_current_part(ctx, graph, current);
    if (parts) return springls__place_at_seam(ctx, graph, -1, current, event);
    springls__place_at_centers(ctx, event);
    return SPRINGLS_OK;
}

/* Lists deaths and splits of the previous components by their ids, then births and mergers of the current ones. Springls have
   their previous ids still. On failure the list stays as it was. */
SPRINGLS__FN springls_status springls__list_events(springls_context *ctx, const springls__component_graph *graph)
{
    const int events = ctx->event_count, parts = ctx->event_part_count;
    const size_t most = (size_t)graph->previous_count + (size_t)graph->labels.count;
    springls_status status = SPRINGLS_OK;
    int i;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->event_memory, (size_t)events + most + 1, sizeof(springls_event),
                                        (size_t)events * sizeof(springls_event)));
    SPRINGLS__TRY(springls__buffer_grow(ctx, &ctx->event_part_memory, (size_t)parts + 2 * (most + (size_t)graph->link_count) + 1,
                                        sizeof(springls_component), (size_t)parts * sizeof(springls_component)));
    for (i = 0; i < graph->previous_count && status == SPRINGLS_OK; i++) status = springls__list_split_or_death(ctx, graph, i);
    for (i = 0; i < graph->labels.count && status == SPRINGLS_OK; i++) status = springls__list_merger_or_birth(ctx, graph, i);
    if (status == SPRINGLS_OK && !ctx->step.active) ctx->new_events += ctx->event_count - events;
    if (status == SPRINGLS_OK) return SPRINGLS_OK;
    ctx->event_count = events;
    ctx->event_part_count = parts;
    return status;
}

/* ---- following ---- */

/* Finds the current components and their ids. */
SPRINGLS__FN springls_status springls__identify_components(springls_context *ctx, springls__component_graph *graph)
{
    SPRINGLS__TRY(springls__link_components(ctx, graph));
    SPRINGLS__TRY(springls__assign_component_ids(ctx, graph));
    return springls__component_list_reserve(ctx, graph->labels.count);
}

/* Lists the events, unless the components are the first ones, and replaces the previous components by the current ones. */
SPRINGLS__FN springls_status springls__commit_components(springls_context *ctx, const springls__component_graph *graph)
{
    if (ctx->components_found) SPRINGLS__TRY(springls__list_events(ctx, graph));
    springls__store_components(ctx, graph);
    springls__label_springls(ctx, graph);
    return SPRINGLS_OK;
}

/* Follows the components without keeping their volumes. */
SPRINGLS__FN springls_status springls__update_components(springls_context *ctx)
{
    springls__component_graph graph;
    SPRINGLS__TRY(springls__components_to_host(ctx, SPRINGLS__BIT(COMPONENT) | SPRINGLS__BIT(CAVITY)));
    SPRINGLS__TRY(springls__identify_components(ctx, &graph));
    return springls__commit_components(ctx, &graph);
}

/* Returns true when components are followed, and are not those of the present phi. */
SPRINGLS__FN bool springls__components_outdated(const springls_context *ctx)
{
    return springls__components_enabled(ctx) && (!ctx->components_found || ctx->components_version != springls__components_source(ctx));
}

#endif
