/* device.cl - what is done in another way on a device than in C (src/), for the same result: with atomics, which C99 has not.
   Whatever order they come in, results are the same: minima and sums of integers. */
#ifndef SPRINGLS__KERNEL_DEVICE_REGIONS_CL
#define SPRINGLS__KERNEL_DEVICE_REGIONS_CL

#include "kernels.h"

/* ---- regions (src/unsigned_to_signed.h): labels are joined by union-find ----
   Nodes are the unsettled voxels, numbered as in phi, and behind them the open constant bricks. SCRATCH1 has the label of each: a
   smaller number in its region, or itself; in the end the smallest, the root. -1: not in a region. */

typedef struct springls__regions {
    const springls__model *model;
    __global int *label;
    __global int *votes; /* of roots: voxels around their region that are outside less those inside (in phi_next's place) */
    int voxels;          /* numbers of voxels; those from here on are bricks */
} springls__regions;

SPRINGLS__MATHS springls__regions springls__regions_of(const springls__model *model)
{
    springls__regions r;
    r.model = model;
    r.label = (__global int *)model->scratch[1];
    r.votes = (__global int *)model->grid.phi_next;
    r.voxels = model->grid.slot_count * SPRINGLS__BRICK_VOXELS;
    return r;
}

/* The first voxel of row `row` of all active bricks' rows, and where it lies. */
SPRINGLS__MATHS int springls__row_at(const springls__grid *g, int row, int at[3])
{
    int slot = g->active[row / SPRINGLS__ROWS];
    springls__slot_origin(g, slot, at);
    at[1] += row % 8;
    at[2] += row / 8 % 8;
    return slot * SPRINGLS__BRICK_VOXELS + row % SPRINGLS__ROWS * 8;
}

SPRINGLS__MATHS bool springls__open_brick(const springls__model *model, int brick)
{
    __global const uint8_t *state = (__global const uint8_t *)model->scratch[2];
    return model->grid.top[brick] < SPRINGLS__FIRST_SLOT && state[brick] == SPRINGLS__OPEN;
}

/* Elements here: rows of the active bricks, then bricks of the top table. */
SPRINGLS__MATHS void springls__region_begin_element(const springls__model *model, springls__job job, int i)
{
    springls__regions r = springls__regions_of(model);
    int rows = model->grid.active_count * SPRINGLS__ROWS, first, v, at[3];
    (void)job;
    if (i >= rows) {
        r.label[r.voxels + i - rows] = springls__open_brick(model, i - rows) ? r.voxels + i - rows : -1;
        return;
    }
    first = springls__row_at(&model->grid, i, at);
    for (v = first; v < first + 8; v++) { /* neighbours along the row are joined at once */
        bool member = springls__unsettled(model, (size_t)v);
        r.label[v] = !member ? -1 : v > first && r.label[v - 1] >= 0 ? r.label[v - 1] : v;
        r.votes[v] = 0;
    }
}

/* The root of n as far as it is known: others join meanwhile. */
SPRINGLS__MATHS int springls__region_root(__global int *label, int n)
{
    int next = atomic_or(&label[n], 0);
    while (next != n) {
        n = next;
        next = atomic_or(&label[n], 0);
    }
    return n;
}

SPRINGLS__MATHS void springls__region_unite(__global int *label, int a, int b)
{
    a = springls__region_root(label, a);
    b = springls__region_root(label, b);
    while (a != b) {
        int high = springls__imax(a, b), low = springls__imin(a, b), was = atomic_min(&label[high], low);
        if (was == high) return;
        a = springls__region_root(label, was); /* somebody else was faster: what high was joined to is joined */
        b = springls__region_root(label, low);
    }
}

/* The node at a voxel of the domain, or -1. */
SPRINGLS__MATHS int springls__region_node(const springls__regions *r, int x, int y, int z)
{
    const springls__grid *g = &r->model->grid;
    int brick, v;
    if (!springls__grid_contains(g, x, y, z)) return -1;
    brick = springls__brick_at(g, x, y, z);
    if (g->top[brick] < SPRINGLS__FIRST_SLOT) return springls__open_brick(r->model, brick) ? r->voxels + brick : -1;
    v = g->top[brick] * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
    return springls__unsettled(r->model, (size_t)v) ? v : -1;
}

/* A row with those below and before it, and with constant bricks on all sides; a constant brick with those before it. */
SPRINGLS__MATHS void springls__region_join_element(const springls__model *model, springls__job job, int i)
{
    springls__regions r = springls__regions_of(model);
    int rows = model->grid.active_count * SPRINGLS__ROWS, at[3], d, x;
    (void)job;
    if (i >= rows) {
        int brick = i - rows, stride = 1;
        if (!springls__open_brick(model, brick)) return;
        for (d = 0; d < 3; d++) {
            bool first = brick / stride % model->grid.bricks[d] == 0;
            int n = r.voxels + brick;
            if (!first && springls__open_brick(model, brick - stride)) springls__region_unite(r.label, n, n - stride);
            stride *= model->grid.bricks[d];
        }
        return;
    }
    springls__row_at(&model->grid, i, at);
    for (d = 0; d < 6; d++) {
        int axis = d >> 1, by = d & 1 ? 1 : -1, beside = -1, to[3];
        to[1] = at[1] + (axis == 1 ? by : 0);
        to[2] = at[2] + (axis == 2 ? by : 0);
        for (x = d == 1 ? 7 : 0; x <= (d == 0 ? 0 : 7); x++) {
            int n = springls__region_node(&r, at[0] + x, at[1], at[2]), before = beside;
            to[0] = at[0] + x + (axis == 0 ? by : 0);
            beside = n < 0 ? -1 : springls__region_node(&r, to[0], to[1], to[2]);
            if (beside < 0 || before >= 0 || (by > 0 && beside < r.voxels)) continue; /* once a run, and once a pair */
            springls__region_unite(r.label, n, beside);
        }
    }
}

/* What a voxel beside a region says. */
SPRINGLS__MATHS int springls__region_vote(const springls__model *model, int x, int y, int z)
{
    const springls__grid *g = &model->grid;
    size_t v;
    int slot;
    if (!springls__grid_contains(g, x, y, z)) return 0;
    slot = springls__slot_at(g, x, y, z);
    v = (size_t)slot * SPRINGLS__BRICK_VOXELS + (size_t)springls__voxel_in_brick(x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT || g->omega[v] >= model->params.capture_range) return 0;
    return g->phi[v] > 0.0f ? 1 : -1;
}

/* What the settled voxels around the members of a region say is added up at its root. Open bricks have none around them. */
SPRINGLS__MATHS void springls__region_vote_element(const springls__model *model, springls__job job, int i)
{
    springls__regions r = springls__regions_of(model);
    const springls__grid *g = &model->grid;
    int rows = g->active_count * SPRINGLS__ROWS, at[3], d, v, k, n, root = -1, votes = 0;
    (void)job;
    if (i >= rows) {
        int brick = i - rows;
        if (!springls__open_brick(model, brick)) return;
        root = springls__region_root(r.label, r.voxels + brick);
        at[0] = 8 * (brick % g->bricks[0]);
        at[1] = 8 * (brick / g->bricks[0] % g->bricks[1]);
        at[2] = 8 * (brick / (g->bricks[0] * g->bricks[1]));
        for (d = 0; d < 6; d++)
            for (k = 0; k < 64; k++) {
                int to[3], axis = d >> 1;
                to[axis] = at[axis] + (d & 1 ? 8 : -1);
                to[(axis + 1) % 3] = at[(axis + 1) % 3] + k % 8;
                to[(axis + 2) % 3] = at[(axis + 2) % 3] + k / 8;
                votes += springls__region_vote(model, to[0], to[1], to[2]);
            }
        if (root < r.voxels && votes != 0) atomic_add(&r.votes[root], votes);
        return;
    }
    n = springls__row_at(g, i, at);
    for (v = 0; v <= 8; v++) { /* run by run */
        int label = v < 8 ? r.label[n + v] : -1;
        if (label < 0) {
            if (root >= 0 && votes != 0) atomic_add(&r.votes[root], votes);
            root = -1;
            votes = 0;
            continue;
        }
        if (root < 0) root = springls__region_root(r.label, label);
        for (d = -1; d <= 1; d += 2)
            votes += springls__region_vote(model, at[0] + v + d, at[1], at[2])
                   + springls__region_vote(model, at[0] + v, at[1] + d, at[2])
                   + springls__region_vote(model, at[0] + v, at[1], at[2] + d);
    }
}

/* Regions with more voxels of the outside around them are outside. */
SPRINGLS__MATHS void springls__region_resolve_element(const springls__model *model, springls__job job, int i)
{
    springls__regions r = springls__regions_of(model);
    int rows = model->grid.active_count * SPRINGLS__ROWS, at[3], n, v, root = -1;
    (void)job;
    if (i >= rows) {
        if (!springls__open_brick(model, i - rows)) return;
        root = springls__region_root(r.label, r.voxels + i - rows);
        if (root < r.voxels && r.votes[root] > 0) model->grid.top[i - rows] = SPRINGLS__OUTSIDE;
        return;
    }
    n = springls__row_at(&model->grid, i, at);
    for (v = n; v < n + 8; v++) {
        root = r.label[v] < 0 ? -1 : root >= 0 ? root : springls__region_root(r.label, v);
        if (root >= 0 && r.votes[root] > 0) model->grid.phi[v] = 1.0f;
    }
}

#endif
