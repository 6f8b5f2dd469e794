/* neighbors_of_bodies.h - which bodies share walls, and which have met or parted. Where a wall shrinks to nothing its bodies part, and two
   others meet in its place: a change of neighbours (T1) of a foam.

   A wall begins with several springls, and ends when none is left: so that one springl at a line where walls meet, which faces one body
   now and another then, is no event. */
#ifndef SPRINGLS__TILING_NEIGHBORS_OF_BODIES_H
#define SPRINGLS__TILING_NEIGHBORS_OF_BODIES_H

#include "bodies.h"

enum { SPRINGLS__MET = 6 }; /* springls, both sides together: a wall begins */

SPRINGLS__FN int springls__compare_pairs(const springls__pair *a, const springls__pair *b)
{
    if (a->low != b->low) return a->low < b->low ? -1 : 1;
    return a->high < b->high ? -1 : a->high > b->high;
}

/* Returns the first pair of a sorted list that is not before two labels. */
SPRINGLS__FN int springls__pair_place(const springls__pair_list *list, int32_t low, int32_t high)
{
    springls__pair wanted;
    int begin = 0, end = list->count;
    wanted.low = low;
    wanted.high = high;
    while (begin < end) {
        const int middle = begin + (end - begin) / 2;
        if (springls__compare_pairs(&list->pair[middle], &wanted) < 0) begin = middle + 1;
        else end = middle;
    }
    return begin;
}

SPRINGLS__FN const springls__pair *springls__find_pair(const springls__pair_list *list, int32_t low, int32_t high)
{
    const int i = springls__pair_place(list, low, high);
    return i < list->count && list->pair[i].low == low && list->pair[i].high == high ? &list->pair[i] : NULL;
}

/* Adds springls that face another body, and the sum of their gaps, to a sorted list in memory of a model's. */
SPRINGLS__FN springls_status springls__add_to_pair(springls_context *ctx, springls__buffer *memory, springls__pair_list *list,
                                                   const springls__pair *added)
{
    const size_t bytes = (size_t)list->count * sizeof *list->pair;
    const int at = springls__pair_place(list, added->low, added->high);
    if (!springls__find_pair(list, added->low, added->high)) {
        SPRINGLS__TRY(springls__buffer_grow(ctx, memory, (size_t)list->count + 1, sizeof *added, bytes));
        list->pair = (springls__pair *)memory->data;
        memmove(list->pair + at + 1, list->pair + at, (size_t)(list->count++ - at) * sizeof *added);
        list->pair[at] = *added;
        return SPRINGLS_OK;
    }
    list->pair[at].springls += added->springls;
    list->pair[at].gap += added->gap;
    return SPRINGLS_OK;
}

/* Lists the pairs that a body is part of, where its sheets have been looked at. */
SPRINGLS__FN springls_status springls__list_own_pairs(springls_tiling *tiling, springls__tiling_body *body, const void *arg)
{
    const float *facing = springls__facing_values(body), *gap = (const float *)tiling->gap.data + body->first;
    springls__pair pair;
    int i;
    (void)arg;
    body->pairs.pair = NULL;
    body->pairs.count = 0;
    for (i = 0; body->label > 0 && i < body->ctx->model.set.count; i++) {
        const int32_t label = (int32_t)facing[i];
        if (label <= 0 || gap[i] == FLT_MAX) continue;
        pair.low = label < body->label ? label : body->label;
        pair.high = label < body->label ? body->label : label;
        pair.springls = 1;
        pair.gap = (double)springls__fabs(gap[i]);
        SPRINGLS__TRY(springls__add_to_pair(body->ctx, &body->pair_memory, &body->pairs, &pair));
    }
    return SPRINGLS_OK;
}

/* Lists the pairs of bodies that face each other now, label 0 left out, where sheets have been looked at. */
SPRINGLS__FN springls_status springls__list_pairs(springls_tiling *tiling, const char *call, springls__pair_list *list)
{
    int i, k;
    list->pair = NULL;
    list->count = 0;
    SPRINGLS__TRY(springls__for_some(tiling, call, SPRINGLS__LOOKING_BODIES, springls__list_own_pairs, NULL));
    for (i = 1; i < tiling->count; i++)
        for (k = 0; k < tiling->body[i].pairs.count; k++)
            SPRINGLS__TRY(springls__add_to_pair(tiling->host, &tiling->pairs, list, &tiling->body[i].pairs.pair[k]));
    return SPRINGLS_OK;
}

/* Appends two labels to a list of pairs; *count of them so far. */
SPRINGLS__FN springls_status springls__note_pair(springls_tiling *tiling, springls__buffer *memory, int *count, int32_t one, int32_t other)
{
    int32_t *labels;
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, memory, 2 * (size_t)*count + 2, sizeof *labels, 2 * (size_t)*count * sizeof *labels));
    labels = (int32_t *)memory->data + 2 * (size_t)(*count)++;
    labels[0] = one;
    labels[1] = other;
    return SPRINGLS_OK;
}

/* Finds out which bodies are neighbours now, of the pairs that face each other and those that were neighbours before, and reports what has
   changed; the first time nothing has. `next` becomes the list of neighbours when the step has succeeded. */
SPRINGLS__FN springls_status springls__find_changes(springls_tiling *tiling, const springls__pair_list *pairs,
                                                    springls_tiling_report *report)
{
    springls__pair_list before, *next = &tiling->next_pairs;
    int i;
    before.pair = (springls__pair *)tiling->neighbors.data;
    before.count = tiling->neighbor_count;
    next->count = 0;
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &tiling->next, (size_t)pairs->count + 1, sizeof(springls__pair), 0));
    next->pair = (springls__pair *)tiling->next.data;
    for (i = 0; i < pairs->count; i++) {
        const springls__pair *pair = &pairs->pair[i];
        const bool was = before.count > 0 && springls__find_pair(&before, pair->low, pair->high);
        if (!was && pair->springls < SPRINGLS__MET) continue;
        next->pair[next->count++] = *pair;
        if (was || !tiling->neighbors_known) continue;
        SPRINGLS__TRY(springls__note_pair(tiling, &tiling->met, &report->met_count, pair->low, pair->high));
    }
    for (i = 0; i < before.count && tiling->neighbors_known; i++)
        if (!springls__find_pair(pairs, before.pair[i].low, before.pair[i].high))
            SPRINGLS__TRY(springls__note_pair(tiling, &tiling->parted, &report->parted_count, before.pair[i].low, before.pair[i].high));
    report->met = report->met_count ? (const int32_t *)tiling->met.data : NULL;
    report->parted = report->parted_count ? (const int32_t *)tiling->parted.data : NULL;
    tiling->has_next = true;
    return SPRINGLS_OK;
}

/* Takes over the list of neighbours that the step has found, if it has looked. */
SPRINGLS__FN void springls__take_neighbors(springls_tiling *tiling)
{
    const springls__buffer swap = tiling->neighbors;
    if (!tiling->has_next) return;
    tiling->neighbors = tiling->next;
    tiling->next = swap;
    tiling->neighbor_count = tiling->next_pairs.count;
    tiling->neighbors_known = true;
    tiling->has_next = false;
}

#endif
