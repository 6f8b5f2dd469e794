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
    return which < SPRINGLS__SCRATCHES ? (__global uint *)model->scratch[which] : model->cells.brick_list_first;
}

/* The array of bytes number `which`: scratches, then edge. */
SPRINGLS__MATHS __global const uchar *springls__bytes(const springls__model *model, int which)
{
    return which < SPRINGLS__SCRATCHES ? (__global const uchar *)model->scratch[which] : model->set.edge;
}

SPRINGLS__MATHS void springls__scan_chunk_element(const springls__model *model, springls__job job, int i)
{
    __global const uint *numbers = springls__numbers(model, job.i[0]);
    uint sum = 0;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) sum += numbers[k];
    model->sums[i] = sum;
}

/* The first job.i[3] sums become those of the chunks before; the sum of all to counts[0]. */
SPRINGLS__MATHS void springls__scan_sums_element(const springls__model *model, springls__job job, int i)
{
    uint sum = 0, one;
    int k;
    for (k = 0; k < job.i[3]; k++) {
        one = model->sums[k];
        model->sums[k] = sum;
        sum += one;
    }
    model->counts[i] = sum;
}

SPRINGLS__MATHS void springls__scan_apply_element(const springls__model *model, springls__job job, int i)
{
    __global uint *numbers = springls__numbers(model, job.i[0]);
    uint sum = model->sums[i], one;
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
    model->sums[i] = sum;
}

SPRINGLS__MATHS void springls__largest_chunk_element(const springls__model *model, springls__job job, int i)
{
    __global const float *values = (__global const float *)model->scratch[job.i[0]];
    float largest = 0.0f;
    int k;
    for (k = springls__chunk_begin(job, i); k < springls__chunk_end(job, i); k++) largest = springls__max(largest, values[k]);
    ((__global float *)model->sums)[i] = largest;
}

SPRINGLS__MATHS void springls__largest_sums_element(const springls__model *model, springls__job job, int i)
{
    float largest = 0.0f;
    int k;
    for (k = 0; k < job.i[3]; k++) largest = springls__max(largest, ((__global const float *)model->sums)[k]);
    ((__global float *)model->counts)[i] = largest;
}

SPRINGLS__MATHS void springls__counts_clear_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    model->counts[i] = 0u;
}

/* ---- springls by cells (section 4.8) ---- */

SPRINGLS__MATHS void springls__cells_clear_element(const springls__model *model, springls__job job, int i)
{
    __global uint *cell = model->grid.cell + (size_t)model->grid.active[i] * SPRINGLS__CELLS;
    int c;
    (void)job;
    for (c = 0; c < SPRINGLS__CELLS; c++) cell[c] = 0u;
}

/* counts: of missing bricks, the largest reach, of large springls. */
SPRINGLS__MATHS void springls__cells_count_element(const springls__model *model, springls__job job, int i)
{
    uint key = model->cells.key[i];
    (void)job;
    if (key == SPRINGLS__MISSING_KEY) {
        atomic_inc(SPRINGLS__ATOMIC(model->counts));
    } else if (key == SPRINGLS__LARGE_KEY) {
        atomic_inc(SPRINGLS__ATOMIC(model->counts + 2));
    } else {
        atomic_inc(SPRINGLS__ATOMIC(model->grid.cell + key));
        atomic_max(SPRINGLS__ATOMIC(model->counts + 1), as_uint(model->set.s[i].bounding_radius)); /* floats above 0 are ordered as their bits are */
    }
}

/* Entry c + 1 becomes where cell c starts, counted in the brick; how many it has goes to SCRATCH0. */
SPRINGLS__MATHS void springls__cells_prefix_element(const springls__model *model, springls__job job, int i)
{
    __global uint *cell = model->grid.cell + (size_t)model->grid.active[i] * SPRINGLS__CELLS;
    uint sum = 0, one;
    int c;
    (void)job;
    for (c = 1; c < SPRINGLS__CELLS; c++) {
        one = cell[c];
        cell[c] = sum;
        sum += one;
    }
    ((__global uint *)model->scratch[0])[i] = sum;
}

SPRINGLS__MATHS void springls__cells_base_element(const springls__model *model, springls__job job, int i)
{
    __global uint *cell = model->grid.cell + (size_t)model->grid.active[i] * SPRINGLS__CELLS;
    uint base = ((__global const uint *)model->scratch[0])[i];
    int c;
    (void)job;
    cell[0] = base;
    for (c = 1; c < SPRINGLS__CELLS; c++) cell[c] += base;
}

/* Entry c + 1 moves on to where cell c ends. */
SPRINGLS__MATHS void springls__cells_scatter_element(const springls__model *model, springls__job job, int i)
{
    uint key = model->cells.key[i];
    (void)job;
    if (key != SPRINGLS__LARGE_KEY) model->cells.ids[atomic_inc(SPRINGLS__ATOMIC(model->grid.cell + key))] = (uint)i;
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
    __global const uint *cell = model->grid.cell + (size_t)model->grid.active[i] * SPRINGLS__CELLS;
    int c;
    (void)job;
    for (c = 0; c + 1 < SPRINGLS__CELLS; c++) springls__sort(model->cells.ids + cell[c], cell[c + 1] - cell[c]);
}

SPRINGLS__MATHS void springls__large_flag_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((__global uint *)model->scratch[0])[i] = model->cells.key[i] == SPRINGLS__LARGE_KEY ? 1u : 0u;
}

SPRINGLS__MATHS void springls__large_scatter_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    if (model->cells.key[i] == SPRINGLS__LARGE_KEY) model->cells.large[((__global const uint *)model->scratch[0])[i]] = (uint)i;
}

/* ---- bricks: those flagged are to be active ---- */

/* job.i[0]: those that are stay so. */
SPRINGLS__MATHS void springls__bricks_begin_element(const springls__model *model, springls__job job, int i)
{
    model->brick_flag[i] = job.i[0] && model->grid.top[i] >= SPRINGLS__FIRST_SLOT ? 1u : 0u;
}

SPRINGLS__MATHS void springls__mark(const springls__model *model, int x, int y, int z)
{
    atomic_or(SPRINGLS__ATOMIC(model->brick_flag + springls__brick_at(&model->grid, x, y, z)), 1u);
}

/* Bricks that particles have come to. */
SPRINGLS__MATHS void springls__mark_missing_element(const springls__model *model, springls__job job, int i)
{
    springls__v3 p = model->set.s[i].p;
    (void)job;
    if (model->cells.key[i] != SPRINGLS__MISSING_KEY) return;
    springls__mark(model, springls__cell_coordinate(p.x, model->grid.size[0]), springls__cell_coordinate(p.y, model->grid.size[1]),
                   springls__cell_coordinate(p.z, model->grid.size[2]));
}

SPRINGLS__MATHS void springls__mark_neighbors(const springls__model *model, const int origin[3], uint reach)
{
    int d, at[3];
    for (d = 0; d < 27 && reach; d++)
        if ((reach >> d & 1u) && springls__brick_around(&model->grid, origin, d, at)) springls__mark(model, at[0], at[1], at[2]);
}

/* Bricks within one cell of the particles of an active brick, or of a large springl. */
SPRINGLS__MATHS void springls__mark_around_element(const springls__model *model, springls__job job, int i)
{
    int origin[3];
    springls__v3 p;
    (void)job;
    if (i < model->grid.active_count) {
        springls__slot_origin(&model->grid, model->grid.active[i], origin);
        springls__mark_neighbors(model, origin, springls__cells_neighbor_mask(model->grid.cell + (size_t)model->grid.active[i] * SPRINGLS__CELLS));
        return;
    }
    p = model->set.s[model->cells.large[i - model->grid.active_count]].p;
    origin[0] = springls__cell_coordinate(p.x, model->grid.size[0]) & ~7;
    origin[1] = springls__cell_coordinate(p.y, model->grid.size[1]) & ~7;
    origin[2] = springls__cell_coordinate(p.z, model->grid.size[2]) & ~7;
    springls__mark_neighbors(model, origin, 0x7ffffffu);
}

/* Bricks that the band of an active one reaches (SCRATCH0). */
SPRINGLS__MATHS void springls__mark_band_element(const springls__model *model, springls__job job, int i)
{
    int origin[3];
    (void)job;
    springls__slot_origin(&model->grid, model->grid.active[i], origin);
    springls__mark_neighbors(model, origin, ((__global const uint *)model->scratch[0])[i]);
}

/* Bricks within the band of a springl. */
SPRINGLS__MATHS void springls__mark_near_element(const springls__model *model, springls__job job, int i)
{
    int lo[3], hi[3], x, y, z;
    (void)job;
    springls__springl_bricks(&model->grid, &model->set.s[i], model->params.band_half_width + 1.0f, lo, hi);
    for (z = lo[2]; z <= hi[2]; z++)
        for (y = lo[1]; y <= hi[1]; y++)
            for (x = lo[0]; x <= hi[0]; x++) springls__mark(model, 8 * x, 8 * y, 8 * z);
}

/* Chunks of all bricks: sums of those that go, come, and are active then. */
SPRINGLS__MATHS void springls__bricks_count_element(const springls__model *model, springls__job job, int i)
{
    uint gone = 0, come = 0, active = 0;
    int b;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        int there = model->grid.top[b] >= SPRINGLS__FIRST_SLOT, wanted = model->brick_flag[b] != 0u;
        gone += there && !wanted ? 1u : 0u;
        come += wanted && !there ? 1u : 0u;
        active += wanted ? 1u : 0u;
    }
    model->sums[3 * i] = gone;
    model->sums[3 * i + 1] = come;
    model->sums[3 * i + 2] = active;
}

/* One of the three (i): sums of the chunks before; of all to counts[i]. */
SPRINGLS__MATHS void springls__bricks_sums_element(const springls__model *model, springls__job job, int i)
{
    uint sum = 0, one;
    int k;
    for (k = 0; k < job.i[3]; k++) {
        one = model->sums[3 * k + i];
        model->sums[3 * k + i] = sum;
        sum += one;
    }
    model->counts[i] = sum;
}

SPRINGLS__MATHS void springls__bricks_drop_element(const springls__model *model, springls__job job, int i)
{
    uint place = (uint)model->grid.free_count + model->sums[3 * i];
    int b, slot;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        slot = model->grid.top[b];
        if (slot < SPRINGLS__FIRST_SLOT || model->brick_flag[b]) continue;
        model->grid.top[b] = model->grid.phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
        model->grid.slot_brick[slot] = -1;
        model->grid.free_slots[place++] = slot;
    }
}

/* A new brick takes a free slot, of the job.i[0] there are now, or one behind all. */
SPRINGLS__MATHS void springls__bricks_add_element(const springls__model *model, springls__job job, int i)
{
    const springls__grid *g = &model->grid;
    int come = (int)model->sums[3 * i + 1], place = (int)model->sums[3 * i + 2], b, slot;
    for (b = springls__chunk_begin(job, i); b < springls__chunk_end(job, i); b++) {
        if (!model->brick_flag[b]) continue;
        slot = g->top[b];
        if (slot < SPRINGLS__FIRST_SLOT) {
            int inside = slot == SPRINGLS__INSIDE;
            slot = come < job.i[0] ? g->free_slots[job.i[0] - 1 - come] : g->slot_count + come - job.i[0];
            model->new_slots[come++] = slot;
            g->slot_brick[slot] = b;
            g->top[b] = slot;
            g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] = inside ? -g->far_value : g->far_value;
        }
        g->active[place++] = slot;
    }
}

/* A new brick goes on with the constant it had. */
SPRINGLS__MATHS void springls__bricks_fill_element(const springls__model *model, springls__job job, int i)
{
    size_t slot = (size_t)model->new_slots[i];
    float value = model->grid.phi[slot * SPRINGLS__BRICK_VOXELS];
    int v;
    (void)job;
    for (v = 0; v < SPRINGLS__BRICK_VOXELS; v++) {
        model->grid.phi[slot * SPRINGLS__BRICK_VOXELS + (size_t)v] = value;
        model->grid.phi_next[slot * SPRINGLS__BRICK_VOXELS + (size_t)v] = value;
        model->grid.omega[slot * SPRINGLS__BRICK_VOXELS + (size_t)v] = -1.0f; /* unknown */
    }
    for (v = 0; v < SPRINGLS__CELLS; v++) model->grid.cell[slot * SPRINGLS__CELLS + (size_t)v] = 0u;
}

/* ---- springls by bricks they come near: job.f[0] is the margin ---- */

SPRINGLS__MATHS __global uint *springls__brick_lists_cursor(const springls__model *model) { return (__global uint *)model->scratch[0] + model->grid.slot_count; }

SPRINGLS__MATHS void springls__brick_lists_rank_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    ((__global uint *)model->scratch[0])[model->grid.active[i]] = (uint)i;
}

SPRINGLS__MATHS void springls__brick_lists_clear_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    model->cells.brick_list_first[i] = 0u;
}

/* Counts springl i in every brick that it comes near, or puts it there. */
SPRINGLS__MATHS void springls__brick_lists_visit(const springls__model *model, float margin, int i, int put)
{
    const springls__grid *g = &model->grid;
    int lo[3], hi[3], x, y, z;
    springls__springl_bricks(g, &model->set.s[i], margin, lo, hi);
    for (z = lo[2]; z <= hi[2]; z++)
        for (y = lo[1]; y <= hi[1]; y++)
            for (x = lo[0]; x <= hi[0]; x++) {
                int slot = g->top[x + g->bricks[0] * (y + g->bricks[1] * z)];
                uint rank;
                if (slot < SPRINGLS__FIRST_SLOT) continue;
                rank = ((__global const uint *)model->scratch[0])[slot];
                if (put) model->cells.brick_list_ids[atomic_inc(SPRINGLS__ATOMIC(springls__brick_lists_cursor(model) + rank))] = (uint)i;
                else atomic_inc(SPRINGLS__ATOMIC(model->cells.brick_list_first + rank));
            }
}

SPRINGLS__MATHS void springls__brick_lists_count_element(const springls__model *model, springls__job job, int i) { springls__brick_lists_visit(model, job.f[0], i, 0); }
SPRINGLS__MATHS void springls__brick_lists_scatter_element(const springls__model *model, springls__job job, int i) { springls__brick_lists_visit(model, job.f[0], i, 1); }

SPRINGLS__MATHS void springls__brick_lists_cursor_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__brick_lists_cursor(model)[i] = model->cells.brick_list_first[i];
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
    ((__global uint *)model->scratch[0])[i] = ((__global const uchar *)model->scratch[1])[i] ? 1u : 0u;
}

SPRINGLS__MATHS void springls__compact_out_element(const springls__model *model, springls__job job, int i)
{
    __global springls__packed *to = (__global springls__packed *)model->spare + ((__global const uint *)model->scratch[0])[i];
    (void)job;
    if (!((__global const uchar *)model->scratch[1])[i]) return;
    to->s = model->set.s[i];
    to->a = model->set.a[i];
    to->synced_position = model->set.synced_position[i];
    to->id = model->set.id[i];
    to->generation = model->set.generation[i];
    to->component = model->set.component[i];
    to->phi = model->set.phi[i];
    to->mask = model->set.mask[i];
    to->edge = model->set.edge[i];
    to->parent = model->set.parent[i];
    to->birth = model->set.birth[i];
}

SPRINGLS__MATHS void springls__compact_in_element(const springls__model *model, springls__job job, int i)
{
    __global const springls__packed *from = (__global const springls__packed *)model->spare + i;
    (void)job;
    model->set.s[i] = from->s;
    model->set.a[i] = from->a;
    model->set.synced_position[i] = from->synced_position;
    model->set.id[i] = from->id;
    model->set.generation[i] = from->generation;
    model->set.component[i] = from->component;
    model->set.phi[i] = from->phi;
    model->set.mask[i] = (uchar)from->mask;
    model->set.edge[i] = (uchar)from->edge;
    model->set.parent[i] = from->parent;
    model->set.birth[i] = from->birth;
}

#endif
