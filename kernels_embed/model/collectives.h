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

/* ---- bricks come and go: those flagged become the active ones (springls__change_bricks) ---- */

/* Returns whether a brick beside that of an entry has none. */
SPRINGLS__MATHS bool springls__at_table_end(const springls__grid *g, int entry)
{
    int place[3], axis;
    bool at_end = false;
    springls__entry_origin(g, entry, place);
    for (axis = 0; axis < 3; axis++) {
        place[axis] /= SPRINGLS__BRICK;
        at_end = at_end || !springls__keeps_place(&g->table.groups, axis, springls__imax(place[axis] - 1, 0))
                 || !springls__keeps_place(&g->table.groups, axis, springls__imin(place[axis] + 1, g->bricks[axis] - 1));
    }
    return at_end;
}

/* Flags the bricks that are active, or none. The flag behind the last one is for those that the top table has no room for. */
SPRINGLS__MATHS void springls__bricks_begin_element(const springls__model *model, springls__arguments args, int i)
{
    const bool active = i < (int)springls__entry_count(&model->grid) && model->grid.top[i] >= SPRINGLS__FIRST_SLOT;
    model->work.brick_flag[i] = args.brick_flag.keep && active ? 1 : 0;
}

/* Flags a brick, and the one behind the last where the top table does not have it, or has it at its end. */
SPRINGLS__MATHS void springls__mark(const springls__model *model, const int origin[3])
{
    const springls__grid *g = &model->grid;
    int place[3], axis, entry = -1;
    for (axis = 0; axis < 3; axis++) place[axis] = origin[axis] / SPRINGLS__BRICK;
    if (springls__has_entry(g, place)) entry = springls__entry_at(g, origin[0], origin[1], origin[2]);
    if (entry >= 0) SPRINGLS__MARK(model->work.brick_flag + entry, 1);
    if (entry < 0 || (g->top[entry] < SPRINGLS__FIRST_SLOT && springls__at_table_end(g, entry)))
        SPRINGLS__MARK(model->work.brick_flag + springls__entry_count(g), 1);
}

/* Marks bricks around the one at `origin`. */
SPRINGLS__MATHS void springls__mark_around(const springls__model *model, const int origin[3], uint32_t mask)
{
    int d, at[3];
    for (d = 0; d < 27 && mask; d++)
        if ((mask >> d & 1u) && springls__brick_around(&model->grid, origin, d, at))
            springls__mark(model, at);
}

/* Marks the brick of particle i, which is outside all active ones. */
SPRINGLS__MATHS void springls__mark_outside_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    (void)args;
    if (model->cells.key[i] != SPRINGLS__OUTSIDE_KEY) return;
    springls__origin_of_place(&model->grid, model->set.s[i].p, origin);
    springls__mark(model, origin);
}

SPRINGLS__MATHS void springls__mark_cover_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    uint32_t mask = springls__bricks_to_cover(model, i, origin);
    (void)args;
    springls__mark_around(model, origin, mask);
}

/* Marks the bricks that the band of active brick i reaches. */
SPRINGLS__MATHS void springls__mark_band_element(const springls__model *model, springls__arguments args, int i)
{
    int origin[3];
    (void)args;
    springls__slot_origin(&model->grid, model->grid.active[i], origin);
    springls__mark_around(model, origin, springls__band_mask(model)[i]);
}

/* Marks the bricks within the band of springl i. */
SPRINGLS__MATHS void springls__mark_near_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__box box = springls__box_around(model->set.s[i], model->params.band_half_width + 1.0f);
    int lo[3], hi[3], at[3];
    (void)args;
    springls__origin_of_place(&model->grid, box.lower, lo);
    springls__origin_of_place(&model->grid, box.upper, hi);
    for (at[2] = lo[2]; at[2] <= hi[2]; at[2] += SPRINGLS__BRICK)
        for (at[1] = lo[1]; at[1] <= hi[1]; at[1] += SPRINGLS__BRICK)
            for (at[0] = lo[0]; at[0] <= hi[0]; at[0] += SPRINGLS__BRICK) springls__mark(model, at);
}

/* Counts, in chunk i of the top table, the bricks to drop, those to add and those that are active then: three sums a chunk. */
SPRINGLS__MATHS void springls__bricks_count_element(const springls__model *model, springls__arguments args, int i)
{
    uint32_t dropped = 0, added = 0, active = 0;
    int b;
    for (b = springls__chunk_begin(args.chunk, i); b < springls__chunk_end(args.chunk, i); b++) {
        int there = model->grid.top[b] >= SPRINGLS__FIRST_SLOT, wanted = model->work.brick_flag[b] != 0;
        dropped += there && !wanted ? 1u : 0u;
        added += wanted && !there ? 1u : 0u;
        active += wanted ? 1u : 0u;
    }
    model->work.sums[3 * i] = dropped;
    model->work.sums[3 * i + 1] = added;
    model->work.sums[3 * i + 2] = active;
}

/* Replaces one of the three sums (i) of each chunk by that of the chunks before it; counts the sum of all. */
SPRINGLS__MATHS void springls__bricks_sums_element(const springls__model *model, springls__arguments args, int i)
{
    model->work.counts[SPRINGLS__COUNT_BRICKS + i] = springls__prefix_sums(model->work.sums + i, args.chunk.chunks, 3, 0u);
    if (i == 0) model->work.counts[SPRINGLS__COUNT_BRICKS_BEYOND] = model->work.brick_flag[args.chunk.count];
}

SPRINGLS__MATHS void springls__bricks_drop_element(const springls__model *model, springls__arguments args, int i)
{
    int place = model->grid.free_count + (int)model->work.sums[3 * i], b, slot;
    for (b = springls__chunk_begin(args.chunk, i); b < springls__chunk_end(args.chunk, i); b++) {
        slot = model->grid.top[b];
        if (slot >= SPRINGLS__FIRST_SLOT && !model->work.brick_flag[b]) springls__drop_brick(&model->grid, slot, place++);
    }
}

/* Gives new bricks their slots and lists all that are active now. */
SPRINGLS__MATHS void springls__bricks_add_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    int n = (int)model->work.sums[3 * i + 1], place = (int)model->work.sums[3 * i + 2], b;
    for (b = springls__chunk_begin(args.brick_add.chunk, i); b < springls__chunk_end(args.brick_add.chunk, i); b++) {
        if (!model->work.brick_flag[b]) continue;
        if (g->top[b] < SPRINGLS__FIRST_SLOT) {
            int slot = springls__slot_of_new(g, args.brick_add.free_count, args.brick_add.slot_count, n);
            model->work.new_slots[n++] = slot;
            springls__add_brick(g, b, slot);
        }
        g->active[place++] = g->top[b];
    }
}

SPRINGLS__MATHS void springls__bricks_fill_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__fill_new_brick(&model->grid, model->work.new_slots[i]);
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
