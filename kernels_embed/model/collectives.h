/* collectives.h - what elements do together: sums, scans, lists. Where elements meet, at a counter or in a list, a device has them in an
   order left to chance, and nothing may depend on it: counts are sums, places follow from scans over chunks, and numbers are
   sorted within each list. The host runs the elements that meet in order (SPRINGLS__ORDERED_KERNELS). */
#ifndef SPRINGLS__KERNEL_MODEL_COLLECTIVES_H
#define SPRINGLS__KERNEL_MODEL_COLLECTIVES_H

#include "cell_list.h"
#include "grid.h"
#include "model.h"

/* ---- chunks: one element adds up one chunk of an array (args.chunk) ---- */

/* Returns the sum of two counts, or the largest number where that is more. */
SPRINGLS__MATHS uint32_t springls__add_counts(uint32_t a, uint32_t b) { return a + b < a ? 0xffffffffu : a + b; }

SPRINGLS__MATHS int springls__chunk_begin(springls__chunk_arguments chunk, int i) { return i * chunk.size; }

SPRINGLS__MATHS int springls__chunk_end(springls__chunk_arguments chunk, int i)
{
    return springls__imin((i + 1) * chunk.size, chunk.count);
}

/* Replaces each of some numbers, `stride` apart, by the sum of those before it and of `sum`; returns the sum of all. */
SPRINGLS__MATHS uint32_t springls__prefix_sums(SPRINGLS__GLOBAL uint32_t *numbers, int count, int stride, uint32_t sum)
{
    int k;
    for (k = 0; k < count * stride; k += stride) {
        uint32_t number = numbers[k];
        numbers[k] = sum;
        sum = springls__add_counts(sum, number);
    }
    return sum;
}

/* Returns an array of numbers: a scratch array or brick_list_first. */
SPRINGLS__MATHS SPRINGLS__GLOBAL uint32_t *springls__numbers(const springls__model *model, int array)
{
    if (array == SPRINGLS__ARRAY_BRICK_LIST_FIRST) return model->cells.brick_list_first;
    return (SPRINGLS__GLOBAL uint32_t *)model->work.scratch[array - SPRINGLS__ARRAY_SCRATCH0];
}

/* Returns an array of bytes: a scratch array, edge or awake. */
SPRINGLS__MATHS SPRINGLS__GLOBAL const uint8_t *springls__bytes(const springls__model *model, int array)
{
    if (array == SPRINGLS__ARRAY_EDGE) return model->set.edge;
    if (array == SPRINGLS__ARRAY_AWAKE) return model->grid.awake;
    return (SPRINGLS__GLOBAL const uint8_t *)model->work.scratch[array - SPRINGLS__ARRAY_SCRATCH0];
}

/* Writes the sum of chunk i to sums[i]. */
SPRINGLS__MATHS void springls__scan_chunk_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint32_t *numbers = springls__numbers(model, args.chunk.array);
    uint32_t sum = 0;
    int k;
    for (k = springls__chunk_begin(args.chunk, i); k < springls__chunk_end(args.chunk, i); k++)
        sum = springls__add_counts(sum, numbers[k]);
    model->work.sums[i] = sum;
}

/* Replaces the sum of each chunk by that of the chunks before it; writes the sum of all to counts[args.chunk.place]. */
SPRINGLS__MATHS void springls__scan_sums_element(const springls__model *model, springls__arguments args, int i)
{
    model->work.counts[args.chunk.place + i] = springls__prefix_sums(model->work.sums, args.chunk.chunks, 1, 0u);
}

/* Replaces each number of chunk i by the sum of those before it. */
SPRINGLS__MATHS void springls__scan_apply_element(const springls__model *model, springls__arguments args, int i)
{
    const int begin = springls__chunk_begin(args.chunk, i), end = springls__chunk_end(args.chunk, i);
    springls__prefix_sums(springls__numbers(model, args.chunk.array) + begin, end - begin, 1, model->work.sums[i]);
}

/* Counts the bytes of chunk i that are args.chunk.value. */
SPRINGLS__MATHS void springls__count_chunk_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint8_t *bytes = springls__bytes(model, args.chunk.array);
    uint32_t sum = 0;
    int k;
    for (k = springls__chunk_begin(args.chunk, i); k < springls__chunk_end(args.chunk, i); k++)
        if (bytes[k] == args.chunk.value) sum++;
    model->work.sums[i] = sum;
}

/* Finds the largest float of chunk i, at least 0, and counts those above the limit. */
SPRINGLS__MATHS void springls__largest_chunk_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const float *values = (SPRINGLS__GLOBAL const float *)springls__numbers(model, args.chunk.array);
    float largest = 0.0f;
    uint32_t more = 0;
    int k;
    for (k = springls__chunk_begin(args.chunk, i); k < springls__chunk_end(args.chunk, i); k++) {
        largest = springls__max(largest, values[k]);
        if (values[k] > args.chunk.limit) more++;
    }
    model->work.sums[2 * i] = springls__float_bits(largest);
    model->work.sums[2 * i + 1] = more;
}

SPRINGLS__MATHS void springls__largest_sums_element(const springls__model *model, springls__arguments args, int i)
{
    float largest = 0.0f;
    uint32_t more = 0;
    int k;
    for (k = 0; k < args.chunk.chunks; k++) {
        largest = springls__max(largest, springls__float_of_bits((int32_t)model->work.sums[2 * k]));
        more += model->work.sums[2 * k + 1];
    }
    model->work.counts[args.chunk.place + i] = springls__float_bits(largest);
    model->work.counts[args.chunk.place + i + 1] = more;
}

SPRINGLS__MATHS void springls__counts_clear_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    model->work.counts[i] = 0u;
}

/* Sorts numbers ascending, by gaps that shrink. */
SPRINGLS__MATHS void springls__sort(SPRINGLS__GLOBAL uint32_t *ids, uint32_t count)
{
    uint32_t gap = 1, i, k, id;
    while (gap < count / 3u) gap = 3u * gap + 1u;
    for (; gap > 0u; gap /= 3u)
        for (i = gap; i < count; i++) {
            id = ids[i];
            for (k = i; k >= gap && ids[k - gap] > id; k -= gap) ids[k] = ids[k - gap];
            ids[k] = id;
        }
}

/* ---- springls by cells (section 4.8): springls__cell_list_build ---- */

SPRINGLS__MATHS void springls__cells_clear_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__clear_cells(springls__cells_of(&model->grid, model->grid.active[i]));
}

/* Takes a bounding radius into the largest of those in cells: floats above 0 are ordered as their bits are. */
SPRINGLS__INNER void springls__raise_radius(const springls__model *model, float radius)
{
    SPRINGLS__RAISE(model->work.counts + SPRINGLS__COUNT_RADIUS, springls__float_bits(radius));
}

/* Counts springl i in its cell, or among those in no cell, and there also when it is outside active bricks. */
SPRINGLS__MATHS void springls__cells_count_element(const springls__model *model, springls__arguments args, int i)
{
    const uint32_t key = model->cells.key[i];
    (void)args;
    if (springls__is_in_cell(key)) {
        springls__count_in_cell(model, i);
        springls__raise_radius(model, model->set.s[i].bounding_radius);
        return;
    }
    SPRINGLS__NEXT(model->work.counts + SPRINGLS__COUNT_UNBINNED);
    if (key == SPRINGLS__OUTSIDE_KEY) SPRINGLS__NEXT(model->work.counts + SPRINGLS__COUNT_OUTSIDE);
}

/* Finds the largest radius anew after triangles have changed; counts a springl that has become too large for its cell, or is no
   longer, or is outside: the list is to be built anew then. */
SPRINGLS__MATHS void springls__cells_radius_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = model->set.s[i].bounding_radius;
    (void)args;
    if (springls__is_in_cell(model->cells.key[i]) == springls__is_large(radius))
        SPRINGLS__NEXT(model->work.counts + SPRINGLS__COUNT_UNBINNED);
    else if (springls__is_in_cell(model->cells.key[i])) springls__raise_radius(model, radius);
}

/* Scans the cells of active brick i as if it began at 0; a scan of what they hold gives where it begins. */
SPRINGLS__MATHS void springls__cells_prefix_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__cell_count(model)[i] = springls__scan_cells(springls__cells_of(&model->grid, model->grid.active[i]), 0u);
}

SPRINGLS__MATHS void springls__cells_base_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL uint32_t *cell = springls__cells_of(&model->grid, model->grid.active[i]);
    int c;
    (void)args;
    for (c = 0; c < SPRINGLS__CELLS; c++) cell[c] += springls__cell_count(model)[i];
    if (i == 0) springls__fill_last_places(model);
}

SPRINGLS__MATHS void springls__cells_scatter_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__put_in_cell(model, i);
}

SPRINGLS__MATHS void springls__cells_sort_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint32_t *cell = springls__cells_of(&model->grid, model->grid.active[i]);
    int c;
    uint32_t k;
    (void)args;
    for (c = 0; c + 1 < SPRINGLS__CELLS; c++) springls__sort(model->cells.ids + cell[c], cell[c + 1] - cell[c]);
    for (k = cell[0]; k < cell[SPRINGLS__CELLS - 1]; k++)
        springls__put_place(model, k, model->set.s[model->cells.ids[k]].p);
}

SPRINGLS__MATHS void springls__unbinned_flag_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__unbinned_number(model)[i] = springls__is_in_cell(model->cells.key[i]) ? 0u : 1u;
}

SPRINGLS__MATHS void springls__unbinned_scatter_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    if (!springls__is_in_cell(model->cells.key[i])) model->cells.unbinned[springls__unbinned_number(model)[i]] = (uint32_t)i;
}

/* ---- springls by the bricks they come near: springls__brick_lists_build ---- */

SPRINGLS__MATHS void springls__brick_lists_rank_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__brick_rank(model)[model->grid.active[i]] = (uint32_t)i;
}

SPRINGLS__MATHS void springls__brick_lists_clear_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    model->cells.brick_list_first[i] = 0u;
}

SPRINGLS__MATHS void springls__brick_lists_count_element(const springls__model *model, springls__arguments args, int i)
{
    springls__count_in_brick_lists(model, args.brick_list.margin, i);
}

SPRINGLS__MATHS void springls__brick_lists_scatter_element(const springls__model *model, springls__arguments args, int i)
{
    springls__put_in_brick_lists(model, args.brick_list.margin, i);
}

SPRINGLS__MATHS void springls__brick_lists_sort_element(const springls__model *model, springls__arguments args, int i)
{
    uint32_t first = model->cells.brick_list_first[i];
    (void)args;
    springls__sort(model->cells.brick_list_ids + first, model->cells.brick_list_first[i + 1] - first);
}

/* ---- springls that stay: springls__constellation_compact ---- */

SPRINGLS__MATHS void springls__compact_flag_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__stay_number(model)[i] = springls__contract_action(model)[i] != SPRINGLS__REMOVE ? 1u : 0u;
}

/* Moves springls by way of a spare copy: where one goes another may not have left yet. */
SPRINGLS__MATHS void springls__compact_out_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    if (springls__contract_action(model)[i] != SPRINGLS__REMOVE)
        model->work.spare[springls__stay_number(model)[i]] = springls__record_load(model, i);
}

SPRINGLS__MATHS void springls__compact_in_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__record_store(model, i, model->work.spare[i]);
}

#endif
