/* collect.cl - collectives: sums, lists and sorting by counting, for devices. What several work items do together is the same
   whatever their order: counts by atomic operations, places by scans over chunks, numbers sorted inside each cell. */
#ifndef SPRINGLS__KERNEL_DEVICE_COLLECTIVES_CL
#define SPRINGLS__KERNEL_DEVICE_COLLECTIVES_CL

#include "kernels.h"

#define SPRINGLS__ATOMIC(pointer) ((volatile __global uint *)(pointer))

/* ---- chunks: job.i[1] elements each, of job.i[2] in all ---- */

SPRINGLS__MATHS int springls__chunk_begin(springls__job job, int chunk) { return chunk * job.i[1]; }
SPRINGLS__MATHS int springls__chunk_end(springls__job job, int chunk) { return springls__imin((chunk + 1) * job.i[1], job.i[2]); }

/* The array of numbers number `which`: scratches, then brick_list_first. */
SPRINGLS__MATHS __global uint *springls__numbers(const springls__model *model, int which)
{
    return which < SPRINGLS__SCRATCHES ? (__global uint *)model->work.scratch[which] : model->cells.brick_list_first;
}

/* The array of bytes number `which`: scratches, then edge. */
SPRINGLS__MATHS __global const uchar *springls__bytes(const springls__model *model, int which)
{
    return which < SPRINGLS__SCRATCHES ? (__global const uchar *)model->work.scratch[which] : model->set.edge;
}

SPRINGLS__MATHS void springls__scan_chunk_element(const springls__model *model, springls__job job, int i)
{
    __global const uint *numbers = springls__numbers(model, job.i[0]);
    uint sum = 0;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) sum += numbers[k];
    model->work.sums[i] = sum;
}

/* The first job.i[3] sums become those of the chunks before; the sum of all to counts[0]. */
SPRINGLS__MATHS void springls__scan_sums_element(const springls__model *model, springls__job job, int i)
{
    uint sum = 0, one;
    int k;
    for (k = 0; k < job.i[3]; k++) {
        one = model->work.sums[k];
        model->work.sums[k] = sum;
        sum += one;
    }
    model->work.counts[i] = sum;
}

SPRINGLS__MATHS void springls__scan_apply_element(const springls__model *model, springls__job job, int i)
{
    __global uint *numbers = springls__numbers(model, job.i[0]);
    uint sum = model->work.sums[i], one;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) {
        one = numbers[k];
        numbers[k] = sum;
        sum += one;
    }
}

/* How many bytes are job.f[0]. */
SPRINGLS__MATHS void springls__count_chunk_element(const springls__model *model, springls__job job, int i)
{
    __global const uchar *bytes = springls__bytes(model, job.i[0]);
    uint sum = 0;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) sum += bytes[k] == (uchar)job.f[0] ? 1u : 0u;
    model->work.sums[i] = sum;
}

SPRINGLS__MATHS void springls__largest_chunk_element(const springls__model *model, springls__job job, int i)
{
    __global const float *values = (__global const float *)model->work.scratch[job.i[0]];
    float largest = 0.0f;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) largest = springls__max(largest, values[k]);
    ((__global float *)model->work.sums)[i] = largest;
}

SPRINGLS__MATHS void springls__largest_sums_element(const springls__model *model, springls__job job, int i)
{
    float largest = 0.0f;
    int k;
    for (k = 0; k < job.i[3]; k++) largest = springls__max(largest, ((__global const float *)model->work.sums)[k]);
    ((__global float *)model->work.counts)[i] = largest;
}

SPRINGLS__MATHS void springls__counts_clear_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    model->work.counts[i] = 0u;
}

/* ---- springls by cells (section 4.8) ---- */

SPRINGLS__MATHS void springls__cells_clear_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__clear_cells(springls__cells_of(&model->grid, model->grid.active[i]));
}

/* counts: of missing bricks, the largest reach, of large springls. */
SPRINGLS__MATHS void springls__cells_count_element(const springls__model *model, springls__job job, int i)
{
    uint key = model->cells.key[i];
    (void)job;
    if (key == SPRINGLS__MISSING_KEY) {
        SPRINGLS__NEXT(model->work.counts);
    } else if (key == SPRINGLS__LARGE_KEY) {
        SPRINGLS__NEXT(model->work.counts + 2);
    } else {
        springls__count_in_cell(model, i);
        atomic_max(SPRINGLS__ATOMIC(model->work.counts + 1), as_uint(model->set.s[i].bounding_radius)); /* floats above 0 are ordered as their bits are */
    }
}

/* Scans a brick's cells as if it began at 0; how many springls it has goes to SCRATCH0, whose scan tells where it begins. */
SPRINGLS__MATHS void springls__cells_prefix_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((__global uint *)model->work.scratch[0])[i] = springls__scan_cells(springls__cells_of(&model->grid, model->grid.active[i]), 0u);
}

SPRINGLS__MATHS void springls__cells_base_element(const springls__model *model, springls__job job, int i)
{
    __global uint *cell = springls__cells_of(&model->grid, model->grid.active[i]);
    int c;
    (void)job;
    for (c = 0; c < SPRINGLS__CELLS; c++) cell[c] += ((__global const uint *)model->work.scratch[0])[i];
}

SPRINGLS__MATHS void springls__cells_scatter_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__put_in_cell(model, i);
}

/* Ascending, by gaps that shrink. */
SPRINGLS__MATHS void springls__sort(__global uint *ids, uint count)
{
    uint gap = 1, i, k, id;
    while (gap < count / 3u) gap = 3u * gap + 1u;
    for (; gap > 0u; gap /= 3u)
        for (i = gap; i < count; i++) {
            id = ids[i];
            for (k = i; k >= gap && ids[k - gap] > id; k -= gap) ids[k] = ids[k - gap];
            ids[k] = id;
        }
}

SPRINGLS__MATHS void springls__cells_sort_element(const springls__model *model, springls__job job, int i)
{
    __global const uint *cell = springls__cells_of(&model->grid, model->grid.active[i]);
    int c;
    (void)job;
    for (c = 0; c + 1 < SPRINGLS__CELLS; c++) springls__sort(model->cells.ids + cell[c], cell[c + 1] - cell[c]);
}

SPRINGLS__MATHS void springls__large_flag_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((__global uint *)model->work.scratch[0])[i] = model->cells.key[i] == SPRINGLS__LARGE_KEY ? 1u : 0u;
}

SPRINGLS__MATHS void springls__large_scatter_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    if (model->cells.key[i] == SPRINGLS__LARGE_KEY) model->cells.large[((__global const uint *)model->work.scratch[0])[i]] = (uint)i;
}

/* ---- bricks: those flagged are to be active ---- */

/* job.i[0]: those that are stay so. */
SPRINGLS__MATHS void springls__bricks_begin_element(const springls__model *model, springls__job job, int i)
{
    model->work.brick_flag[i] = job.i[0] && model->grid.top[i] >= SPRINGLS__FIRST_SLOT ? 1u : 0u;
}

SPRINGLS__MATHS void springls__mark(const springls__model *model, int brick)
{
    atomic_or(SPRINGLS__ATOMIC(model->work.brick_flag + brick), 1u);
}

/* Marks bricks around the one at `origin`. */
SPRINGLS__MATHS void springls__mark_around(const springls__model *model, const int origin[3], uint mask)
{
    int d, at[3];
    for (d = 0; d < 27 && mask; d++)
        if ((mask >> d & 1u) && springls__brick_around(&model->grid, origin, d, at))
            springls__mark(model, springls__brick_at(&model->grid, at[0], at[1], at[2]));
}

/* Marks the brick that particle i has come to. */
SPRINGLS__MATHS void springls__mark_missing_element(const springls__model *model, springls__job job, int i)
{
    int origin[3];
    (void)job;
    if (model->cells.key[i] != SPRINGLS__MISSING_KEY) return;
    springls__origin_of_place(&model->grid, model->set.s[i].p, origin);
    springls__mark(model, springls__brick_at(&model->grid, origin[0], origin[1], origin[2]));
}

SPRINGLS__MATHS void springls__mark_cover_element(const springls__model *model, springls__job job, int i)
{
    int origin[3];
    uint mask = springls__bricks_to_cover(model, i, origin);
    (void)job;
    springls__mark_around(model, origin, mask);
}

/* Marks the bricks that the band of active brick i reaches (SCRATCH0). */
SPRINGLS__MATHS void springls__mark_band_element(const springls__model *model, springls__job job, int i)
{
    int origin[3];
    (void)job;
    springls__slot_origin(&model->grid, model->grid.active[i], origin);
    springls__mark_around(model, origin, ((__global const uint *)model->work.scratch[0])[i]);
}

/* Marks the bricks within the band of springl i. */
SPRINGLS__MATHS void springls__mark_near_element(const springls__model *model, springls__job job, int i)
{
    springls__brick_walk walk = springls__brick_walk_begin(&model->grid, model->set.s[i], model->params.band_half_width + 1.0f);
    int brick;
    (void)job;
    while ((brick = springls__brick_walk_next(&model->grid, &walk)) >= 0) springls__mark(model, brick);
}

/* Chunks of all bricks: sums of those that go, come, and are active then. */
SPRINGLS__MATHS void springls__bricks_count_element(const springls__model *model, springls__job job, int i)
{
    uint gone = 0, come = 0, active = 0;
    int b;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        int there = model->grid.top[b] >= SPRINGLS__FIRST_SLOT, wanted = model->work.brick_flag[b] != 0u;
        gone += there && !wanted ? 1u : 0u;
        come += wanted && !there ? 1u : 0u;
        active += wanted ? 1u : 0u;
    }
    model->work.sums[3 * i] = gone;
    model->work.sums[3 * i + 1] = come;
    model->work.sums[3 * i + 2] = active;
}

/* One of the three (i): sums of the chunks before; of all to counts[i]. */
SPRINGLS__MATHS void springls__bricks_sums_element(const springls__model *model, springls__job job, int i)
{
    uint sum = 0, one;
    int k;
    for (k = 0; k < job.i[3]; k++) {
        one = model->work.sums[3 * k + i];
        model->work.sums[3 * k + i] = sum;
        sum += one;
    }
    model->work.counts[i] = sum;
}

SPRINGLS__MATHS void springls__bricks_drop_element(const springls__model *model, springls__job job, int i)
{
    int place = model->grid.free_count + (int)model->work.sums[3 * i], b, slot;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        slot = model->grid.top[b];
        if (slot < SPRINGLS__FIRST_SLOT || model->work.brick_flag[b]) continue;
        springls__drop_brick(&model->grid, slot, place++);
    }
}

/* Gives new bricks their slots, of which job.i[0] are free now, and lists all active ones. */
SPRINGLS__MATHS void springls__bricks_add_element(const springls__model *model, springls__job job, int i)
{
    const springls__grid *g = &model->grid;
    int n = (int)model->work.sums[3 * i + 1], place = (int)model->work.sums[3 * i + 2], b;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        if (!model->work.brick_flag[b]) continue;
        if (g->top[b] < SPRINGLS__FIRST_SLOT) {
            int slot = springls__slot_of_new(g, job.i[0], n);
            model->work.new_slots[n++] = slot;
            springls__add_brick(g, b, slot);
        }
        g->active[place++] = g->top[b];
    }
}

SPRINGLS__MATHS void springls__bricks_fill_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__fill_new_brick(&model->grid, model->work.new_slots[i]);
}

/* ---- springls by bricks they come near: job.f[0] is the margin ---- */

SPRINGLS__MATHS __global uint *springls__brick_ranks(const springls__model *model) { return (__global uint *)model->work.scratch[0]; }

SPRINGLS__MATHS void springls__brick_lists_rank_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__brick_ranks(model)[model->grid.active[i]] = (uint)i;
}

SPRINGLS__MATHS void springls__brick_lists_clear_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    model->cells.brick_list_first[i] = 0u;
}

SPRINGLS__MATHS void springls__brick_lists_count_element(const springls__model *model, springls__job job, int i)
{
    springls__count_in_brick_lists(model, springls__brick_ranks(model), job.f[0], i);
}

SPRINGLS__MATHS void springls__brick_lists_scatter_element(const springls__model *model, springls__job job, int i)
{
    springls__put_in_brick_lists(model, springls__brick_ranks(model), job.f[0], i);
}

SPRINGLS__MATHS void springls__brick_lists_sort_element(const springls__model *model, springls__job job, int i)
{
    uint first = model->cells.brick_list_first[i];
    (void)job;
    springls__sort(model->cells.brick_list_ids + first, model->cells.brick_list_first[i + 1] - first);
}

/* ---- springls that stay: those whose byte in SCRATCH1 is not 0 ---- */

SPRINGLS__MATHS void springls__compact_flag_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((__global uint *)model->work.scratch[0])[i] = ((__global const uchar *)model->work.scratch[1])[i] ? 1u : 0u;
}

SPRINGLS__MATHS void springls__compact_out_element(const springls__model *model, springls__job job, int i)
{
    uint place = ((__global const uint *)model->work.scratch[0])[i];
    (void)job;
    if (((__global const uchar *)model->work.scratch[1])[i]) model->work.spare[place] = springls__record_load(model, i);
}

SPRINGLS__MATHS void springls__compact_in_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__record_store(model, i, model->work.spare[i]);
}

#endif
