/* grid.h - the sparse grid: bricks of 8x8x8 voxels near the surface, constant elsewhere.

   Border rule: a voxel outside the domain is outside the object, at the distance of the nearest voxel of the domain. So the
   object ends half a voxel beyond the outermost voxel centers, and its surface is always closed. */
#ifndef SPRINGLS__KERNEL_MODEL_GRID_H
#define SPRINGLS__KERNEL_MODEL_GRID_H

#include "model.h"

/* Returns which voxel of its brick a voxel is. */
SPRINGLS__MATHS int springls__voxel_in_brick(int x, int y, int z) { return (x & 7) + 8 * (y & 7) + 64 * (z & 7); }

/* Finds voxel v of the brick whose first voxel is `origin`. */
SPRINGLS__MATHS void springls__voxel_of_brick(const int origin[3], int v, int at[3])
{
    at[0] = origin[0] + (v & 7);
    at[1] = origin[1] + (v >> 3 & 7);
    at[2] = origin[2] + (v >> 6);
}

/* Returns the place of voxel v of the brick whose first voxel is `origin`. */
SPRINGLS__MATHS springls__v3 springls__voxel_place(const int origin[3], int v)
{
    int at[3];
    springls__voxel_of_brick(origin, v, at);
    return springls__v3_make((float)at[0], (float)at[1], (float)at[2]);
}

/* Finds the voxel next to `at` in direction d: -x +x -y +y -z +z. */
SPRINGLS__MATHS void springls__neighbor_voxel(const int at[3], int d, int to[3])
{
    to[0] = at[0] + (d == 1) - (d == 0);
    to[1] = at[1] + (d == 3) - (d == 2);
    to[2] = at[2] + (d == 5) - (d == 4);
}

/* Returns the brick of a voxel of the domain. */
SPRINGLS__MATHS int springls__brick_at(const springls__grid *g, int x, int y, int z)
{
    return (x >> 3) + g->bricks[0] * ((y >> 3) + g->bricks[1] * (z >> 3));
}

/* Returns the entry of a voxel that the top table has. g->plane has, for each place of a brick along each axis, the plane of
   entries there, times their stride; then for each plane the first place that it stands for (springls__take_table). */
SPRINGLS__MATHS int springls__entry_at(const springls__grid *g, int x, int y, int z)
{
    return g->plane[x >> 3] + g->plane[SPRINGLS__MOST_PLANES + (y >> 3)] + g->plane[2 * SPRINGLS__MOST_PLANES + (z >> 3)];
}

/* Returns the entry of the brick x, y and z bricks (-1, 0 or 1) beside one that is active: the top table has a layer around it. */
SPRINGLS__MATHS int springls__entry_beside(const springls__grid *g, int entry, int x, int y, int z)
{
    return entry + x + g->table.bricks[0] * (y + g->table.bricks[1] * z);
}

/* Returns the first brick, as a place along an axis, of a plane of the top table. */
SPRINGLS__MATHS int springls__place_of_plane(const springls__grid *g, int axis, int plane)
{
    return g->plane[(3 + axis) * SPRINGLS__MOST_PLANES + plane];
}

/* Returns whether a place along an axis, counted in bricks, is in a group that is kept. The word is selected, not indexed: groups
   are a kernel's argument, which Mesa reads at one index for several work items. */
SPRINGLS__MATHS bool springls__keeps_place(const springls__brick_groups *groups, int axis, int place)
{
    uint32_t word = 0u;
    int w;
    for (w = 0; w < SPRINGLS__GROUP_WORDS; w++)
        if (place >> 7 == w) word = groups->kept[axis * SPRINGLS__GROUP_WORDS + w];
    return (word >> ((place >> 2) & 31) & 1u) != 0u;
}

/* Returns whether the top table has an entry for a brick, at a place counted in bricks, alone. */
SPRINGLS__MATHS bool springls__has_entry(const springls__grid *g, const int place[3])
{
    const springls__brick_groups *groups = &g->table.groups;
    return springls__keeps_place(groups, 0, place[0]) && springls__keeps_place(groups, 1, place[1])
        && springls__keeps_place(groups, 2, place[2]);
}

/* Returns the slot of a voxel that the top table has. */
SPRINGLS__MATHS int springls__slot_at(const springls__grid *g, int x, int y, int z)
{
    return g->top[springls__entry_at(g, x, y, z)];
}

/* Returns whether the top table has a voxel. */
SPRINGLS__MATHS bool springls__table_contains(const springls__grid *g, int x, int y, int z)
{
    const springls__table *t = &g->table;
    return x >= t->lower[0] && y >= t->lower[1] && z >= t->lower[2] && x < t->upper[0] && y < t->upper[1] && z < t->upper[2];
}

/* Returns the slot of any voxel of the domain. */
SPRINGLS__MATHS int springls__slot_of_voxel(const springls__grid *g, int x, int y, int z)
{
    return springls__table_contains(g, x, y, z) ? springls__slot_at(g, x, y, z) : SPRINGLS__OUTSIDE;
}

/* Returns the voxel along an axis that x lies in, the nearest one of [lower, upper). */
SPRINGLS__MATHS int springls__cell_coordinate(float x, int lower, int upper)
{
    return springls__iclamp((int)springls__floor(springls__clamp(x, (float)lower, (float)upper)), lower, upper - 1);
}

/* Finds the voxel that x lies in; outside of the top table, the table's nearest voxel. */
SPRINGLS__INNER void springls__voxel_of_place(const springls__grid *g, springls__v3 x, int voxel[3])
{
    voxel[0] = springls__cell_coordinate(x.x, g->table.lower[0], g->table.upper[0]);
    voxel[1] = springls__cell_coordinate(x.y, g->table.lower[1], g->table.upper[1]);
    voxel[2] = springls__cell_coordinate(x.z, g->table.lower[2], g->table.upper[2]);
}

/* Finds the place of a brick in the domain, counted in bricks. */
SPRINGLS__MATHS void springls__brick_place(const springls__grid *g, int brick, int place[3])
{
    place[0] = brick % g->bricks[0];
    place[1] = brick / g->bricks[0] % g->bricks[1];
    place[2] = brick / (g->bricks[0] * g->bricks[1]);
}

/* Finds the first voxel of a brick. */
SPRINGLS__MATHS void springls__brick_origin(const springls__grid *g, int brick, int origin[3])
{
    int axis;
    springls__brick_place(g, brick, origin);
    for (axis = 0; axis < 3; axis++) origin[axis] *= SPRINGLS__BRICK;
}

/* Finds the first voxel of the brick of an entry of the top table; of those left out, of the first one. */
SPRINGLS__MATHS void springls__entry_origin(const springls__grid *g, int entry, int origin[3])
{
    const springls__table *t = &g->table;
    origin[0] = SPRINGLS__BRICK * springls__place_of_plane(g, 0, entry % t->bricks[0]);
    origin[1] = SPRINGLS__BRICK * springls__place_of_plane(g, 1, entry / t->bricks[0] % t->bricks[1]);
    origin[2] = SPRINGLS__BRICK * springls__place_of_plane(g, 2, entry / (t->bricks[0] * t->bricks[1]));
}

/* Returns the brick of an entry. Bricks ascend as entries do. */
SPRINGLS__MATHS int springls__brick_of_entry(const springls__grid *g, int entry)
{
    int origin[3];
    springls__entry_origin(g, entry, origin);
    return springls__brick_at(g, origin[0], origin[1], origin[2]);
}

/* Returns the entry of a brick; -1: the top table does not have it. */
SPRINGLS__MATHS int springls__entry_of_brick(const springls__grid *g, int brick)
{
    int origin[3];
    springls__brick_origin(g, brick, origin);
    if (!springls__table_contains(g, origin[0], origin[1], origin[2])) return -1;
    return springls__entry_at(g, origin[0], origin[1], origin[2]);
}

/* Returns the slot of any brick of the domain. */
SPRINGLS__MATHS int springls__slot_of_brick(const springls__grid *g, int brick)
{
    int entry = springls__entry_of_brick(g, brick);
    return entry < 0 ? SPRINGLS__OUTSIDE : g->top[entry];
}

SPRINGLS__MATHS void springls__slot_origin(const springls__grid *g, int slot, int origin[3])
{
    springls__brick_origin(g, g->slot_brick[slot], origin);
}

/* Finds the first voxel of the brick that x lies in, in voxels; places outside the domain are in the nearest brick. */
SPRINGLS__MATHS void springls__origin_of_place(const springls__grid *g, springls__v3 x, int origin[3])
{
    origin[0] = springls__cell_coordinate(x.x, 0, g->size[0]) & ~7;
    origin[1] = springls__cell_coordinate(x.y, 0, g->size[1]) & ~7;
    origin[2] = springls__cell_coordinate(x.z, 0, g->size[2]) & ~7;
}

/* Returns the bricks next to a row of voxels (or cells) along x, given the faces of its own brick that it touches, as a mask: bit
   (dx+1) + 3(dy+1) + 9(dz+1). */
SPRINGLS__MATHS uint32_t springls__neighbor_mask_of_row(bool first_x, bool last_x, bool first_y, bool last_y, bool first_z,
                                                        bool last_z)
{
    uint32_t x = 2u | (uint32_t)first_x | (uint32_t)last_x << 2;
    uint32_t xy = x << 3 | (first_y ? x : 0u) | (last_y ? x << 6 : 0u);
    return xy << 9 | (first_z ? xy : 0u) | (last_z ? xy << 18 : 0u);
}

/* Returns the value at a voxel that the top table has. */
SPRINGLS__INNER float springls__grid_voxel(const springls__grid *g, SPRINGLS__GLOBAL const float *field, int x, int y, int z)
{
    return field[(size_t)springls__slot_at(g, x, y, z) * SPRINGLS__BRICK_VOXELS + (size_t)springls__voxel_in_brick(x, y, z)];
}

SPRINGLS__MATHS bool springls__grid_contains(const springls__grid *g, int x, int y, int z)
{
    return x >= 0 && y >= 0 && z >= 0 && x < g->size[0] && y < g->size[1] && z < g->size[2];
}

/* Returns phi at any voxel, by the border rule beyond the domain. It holds beyond the top table too, where phi is far outside. */
SPRINGLS__INNER float springls__grid_phi(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, int x, int y, int z)
{
    const springls__table *t = &g->table;
    float v = springls__grid_voxel(g, phi, springls__iclamp(x, t->lower[0], t->upper[0] - 1),
                                   springls__iclamp(y, t->lower[1], t->upper[1] - 1),
                                   springls__iclamp(z, t->lower[2], t->upper[2] - 1));
    return springls__table_contains(g, x, y, z) ? v : springls__fabs(v);
}

/* Returns the voxel along an axis, of those that the top table has, that is nearest to n. */
SPRINGLS__INNER int springls__table_place(const springls__table *t, int axis, int n)
{
    return springls__iclamp(n, t->lower[axis], t->upper[axis] - 1);
}

/* Reads phi at the eight corners of the cube at any voxel (i, j, k), by the border rule beyond the domain. */
SPRINGLS__MATHS void springls__grid_corners(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, int i, int j, int k,
                                            float corner[8])
{
    const springls__table *t = &g->table;
    int c;
    bool inner = i >= t->lower[0] && j >= t->lower[1] && k >= t->lower[2] && i + 1 < t->upper[0] && j + 1 < t->upper[1]
                 && k + 1 < t->upper[2];
    if (inner && (i & 7) != 7 && (j & 7) != 7 && (k & 7) != 7) { /* all eight in one brick */
        SPRINGLS__GLOBAL const float *b = phi + (size_t)springls__slot_at(g, i, j, k) * SPRINGLS__BRICK_VOXELS
                                          + springls__voxel_in_brick(i, j, k);
        corner[0] = b[0];  corner[1] = b[1];  corner[2] = b[8];  corner[3] = b[9];
        corner[4] = b[64]; corner[5] = b[65]; corner[6] = b[72]; corner[7] = b[73];
    } else {
        const int x[2] = { springls__table_place(t, 0, i), springls__table_place(t, 0, i + 1) };
        const int y[2] = { springls__table_place(t, 1, j), springls__table_place(t, 1, j + 1) };
        const int z[2] = { springls__table_place(t, 2, k), springls__table_place(t, 2, k + 1) };
        SPRINGLS__GLOBAL const int *top = g->top + springls__entry_at(g, x[0], y[0], z[0]);
        const int dx = (x[1] >> 3) - (x[0] >> 3), dy = ((y[1] >> 3) - (y[0] >> 3)) * t->bricks[0];
        const int dz = ((z[1] >> 3) - (z[0] >> 3)) * t->bricks[0] * t->bricks[1];
        for (c = 0; c < 8; c++) {
            const int a = c & 1, b = c >> 1 & 1, d = c >> 2;
            float v = phi[(size_t)top[a * dx + b * dy + d * dz] * SPRINGLS__BRICK_VOXELS
                            + (size_t)springls__voxel_in_brick(x[a], y[b], z[d])];
            corner[c] = inner || springls__table_contains(g, i + a, j + b, k + d) ? v : springls__fabs(v);
        }
    }
}

/* Interpolates phi at x (voxels), trilinear, with the border rule. */
SPRINGLS__MATHS float springls__grid_sample(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, springls__v3 x)
{
    float fx = springls__clamp(x.x, -1.0f, (float)g->size[0]), fy = springls__clamp(x.y, -1.0f, (float)g->size[1]);
    float fz = springls__clamp(x.z, -1.0f, (float)g->size[2]);
    int i = (int)springls__floor(fx), j = (int)springls__floor(fy), k = (int)springls__floor(fz);
    float corner[8];
    springls__grid_corners(g, phi, i, j, k, corner);
    return springls__trilinear(corner, fx - (float)i, fy - (float)j, fz - (float)k);
}

/* Interpolates phi at x, in voxels from the first one of the brick at `origin`, trilinear. Within three voxels of the brick the
   place keeps all its digits. */
SPRINGLS__MATHS float springls__grid_sample_from(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, const int origin[3],
                                                 springls__v3 x)
{
    const float lower = -3.0f, upper = 10.0f;
    float i = springls__floor(x.x), j = springls__floor(x.y), k = springls__floor(x.z), corner[8];
    if (!(i >= lower && j >= lower && k >= lower && i < upper && j < upper && k < upper)) {
        springls__v3 first = springls__v3_make((float)origin[0], (float)origin[1], (float)origin[2]);
        return springls__grid_sample(g, phi, springls__add(x, first));
    }
    springls__grid_corners(g, phi, origin[0] + (int)i, origin[1] + (int)j, origin[2] + (int)k, corner);
    return springls__trilinear(corner, x.x - i, x.y - j, x.z - k);
}

/* Takes from a trilinear value at x, c, u (1 - u) / 2 times the second difference along each axis, `bend`. */
SPRINGLS__MATHS float springls__third_order(springls__v3 x, float c, springls__v3 bend)
{
    float u = x.x - springls__floor(x.x), v = x.y - springls__floor(x.y), w = x.z - springls__floor(x.z);
    return c - 0.5f * (u * (1.0f - u) * bend.x + v * (1.0f - v) * bend.y + w * (1.0f - w) * bend.z);
}

/* Interpolates phi at x to third order. */
SPRINGLS__MATHS float springls__grid_sample_smooth(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, springls__v3 x)
{
    springls__v3 step = springls__v3_make(1.0f, 0.0f, 0.0f), bend = springls__v3_make(0.0f, 0.0f, 0.0f);
    float c = springls__grid_sample(g, phi, x);
    int axis;
    for (axis = 0; axis < 3; axis++) {
        float before = springls__grid_sample(g, phi, springls__sub(x, step));
        bend = springls__v3_make(bend.y, bend.z, before + springls__grid_sample(g, phi, springls__add(x, step)) - 2.0f * c);
        step = springls__v3_make(step.z, step.x, step.y);
    }
    return springls__third_order(x, c, bend);
}

/* Reads the 3x3x3 voxels from `first` on, x fastest, by the border rule beyond the domain. */
SPRINGLS__MATHS void springls__grid_block27(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, const int first[3],
                                            float block[27])
{
    bool one_brick = true, inner = true;
    int axis, d;
    for (axis = 0; axis < 3; axis++) {
        inner = inner && first[axis] >= g->table.lower[axis] && first[axis] + 2 < g->table.upper[axis];
        one_brick = one_brick && (first[axis] & 7) < 6;
    }
    if (inner && one_brick) {
        size_t slot = (size_t)springls__slot_at(g, first[0], first[1], first[2]);
        SPRINGLS__GLOBAL const float *b = phi + slot * SPRINGLS__BRICK_VOXELS
                                          + springls__voxel_in_brick(first[0], first[1], first[2]);
        for (d = 0; d < 27; d++) block[d] = b[d % 3 + 8 * (d / 3 % 3) + 64 * (d / 9)];
    } else {
        for (d = 0; d < 27; d++) {
            int x = first[0] + d % 3, y = first[1] + d / 3 % 3, z = first[2] + d / 9;
            block[d] = inner ? springls__grid_voxel(g, phi, x, y, z) : springls__grid_phi(g, phi, x, y, z);
        }
    }
}

/* Smooths phi at x by quadratic B-splines over 3x3x3 voxels, so that second differences do not depend on where x lies between
   voxels. */
SPRINGLS__MATHS float springls__grid_sample_spline(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, springls__v3 x)
{
    const float at[3] = { springls__clamp(x.x, -1.0f, (float)g->size[0]), springls__clamp(x.y, -1.0f, (float)g->size[1]),
                          springls__clamp(x.z, -1.0f, (float)g->size[2]) };
    float w[9], block[27], sum = 0.0f;
    int first[3], axis, d;
    for (axis = 0; axis < 3; axis++) {
        float nearest = springls__floor(at[axis] + 0.5f), t = at[axis] - nearest;
        first[axis] = (int)nearest - 1;
        w[3 * axis] = 0.5f * (0.5f - t) * (0.5f - t);
        w[3 * axis + 2] = 0.5f * (0.5f + t) * (0.5f + t);
        w[3 * axis + 1] = 1.0f - w[3 * axis] - w[3 * axis + 2];
    }
    springls__grid_block27(g, phi, first, block);
    for (d = 0; d < 9; d++)
        sum += w[3 + d % 3] * w[6 + d / 3] * (w[0] * block[3 * d] + w[1] * block[3 * d + 1] + w[2] * block[3 * d + 2]);
    return sum;
}

/* Returns the gradient of the trilinear values by central differences over one voxel. */
SPRINGLS__INNER springls__v3 springls__grid_gradient(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, springls__v3 x)
{
    springls__v3 step = springls__v3_make(0.5f, 0.0f, 0.0f), slope = springls__v3_make(0.0f, 0.0f, 0.0f);
    int axis;
    for (axis = 0; axis < 3; axis++) {
        float d = springls__grid_sample(g, phi, springls__add(x, step)) - springls__grid_sample(g, phi, springls__sub(x, step));
        slope = springls__v3_make(slope.y, slope.z, d);
        step = springls__v3_make(step.z, step.x, step.y);
    }
    return slope;
}

/* A tile: a brick with a margin of one voxel, 10x10x10 values, x fastest. */
#define SPRINGLS__TILE 10
#define SPRINGLS__TILE_VOXELS 1000

SPRINGLS__MATHS int springls__tile_index(int x, int y, int z)
{
    return x + 1 + SPRINGLS__TILE * (y + 1 + SPRINGLS__TILE * (z + 1));
}

/* Returns the distance in a tile from a voxel to neighbour d = 0..26 of its 3x3x3 block, x fastest. */
SPRINGLS__MATHS int springls__tile_step(int d)
{
    return d % 3 - 1 + SPRINGLS__TILE * (d / 3 % 3 - 1 + SPRINGLS__TILE * (d / 9 - 1));
}

/* Returns whether the tile of the brick at `origin` goes beyond the domain. */
SPRINGLS__MATHS bool springls__tile_at_border(const springls__grid *g, const int origin[3])
{
    return origin[0] == 0 || origin[1] == 0 || origin[2] == 0 || origin[0] + 9 > g->size[0] || origin[1] + 9 > g->size[1]
           || origin[2] + 9 > g->size[2];
}

/* Copies a row of eight voxels into a tile. */
SPRINGLS__MATHS void springls__copy_row(SPRINGLS__GLOBAL const float *from, SPRINGLS__LOCAL float *to)
{
    int x;
    for (x = 0; x < 8; x += SPRINGLS__LANES) springls__vec_store(to + x, springls__vec_load(from + x));
}

/* Copies a row of eight voxels within the model. */
SPRINGLS__MATHS void springls__copy_voxel_row(SPRINGLS__GLOBAL const float *from, SPRINGLS__GLOBAL float *to)
{
    int x;
    for (x = 0; x < 8; x += SPRINGLS__LANES) springls__vec_store(to + x, springls__vec_load(from + x));
}

/* Loads row (y, z) of a tile as springls__load_tile_row does, by the border rule: beyond the domain are the values at its border,
   without their sign. */
SPRINGLS__MATHS void springls__load_border_row(const springls__grid *g, SPRINGLS__GLOBAL const float *field, const int origin[3],
                                               int margin, int y, int z, SPRINGLS__LOCAL float *out)
{
    const springls__table *t = &g->table;
    const int before = origin[0] - t->lower[0], behind = t->upper[0] - origin[0]; /* voxels to the borders */
    const int j = springls__iclamp(origin[1] + y, t->lower[1], t->upper[1] - 1);
    const int k = springls__iclamp(origin[2] + z, t->lower[2], t->upper[2] - 1);
    const bool beyond = j != origin[1] + y || k != origin[2] + z;
    SPRINGLS__GLOBAL const int *top = g->top + springls__entry_at(g, origin[0], j, k);
    SPRINGLS__GLOBAL const float *in = field + springls__voxel_in_brick(0, j, k);
    SPRINGLS__LOCAL float *own = out + margin;
    int x;
    springls__copy_row(in + (size_t)top[0] * SPRINGLS__BRICK_VOXELS, own);
    for (x = -margin; x < 0; x++)
        own[x] = before > 0 ? (in + (size_t)top[-1] * SPRINGLS__BRICK_VOXELS)[SPRINGLS__BRICK + x] : springls__fabs(own[0]);
    for (x = springls__imin(SPRINGLS__BRICK, behind); x < SPRINGLS__BRICK + margin; x++)
        own[x] = x < behind ? (in + (size_t)top[1] * SPRINGLS__BRICK_VOXELS)[x - SPRINGLS__BRICK] : springls__fabs(own[behind - 1]);
    for (x = -margin; beyond && x < SPRINGLS__BRICK + margin; x++) own[x] = springls__fabs(own[x]);
}

/* Loads row (y, z), counted from a brick's first voxel, of a tile of it with `margin` voxels around. entry: of the brick. */
SPRINGLS__INNER void springls__load_tile_row(const springls__grid *g, SPRINGLS__GLOBAL const float *field, const int origin[3],
                                             int entry, bool border, int margin, int y, int z, SPRINGLS__LOCAL float *out)
{
    int x;
    if (border) {
        springls__load_border_row(g, field, origin, margin, y, z, out);
    } else {
        SPRINGLS__GLOBAL const int *top = g->top + springls__entry_beside(g, entry, 0, y >> 3, z >> 3);
        SPRINGLS__GLOBAL const float *in = field + springls__voxel_in_brick(0, y, z);
        SPRINGLS__GLOBAL const float *before = in + (size_t)top[-1] * SPRINGLS__BRICK_VOXELS + SPRINGLS__BRICK - margin;
        SPRINGLS__GLOBAL const float *behind = in + (size_t)top[1] * SPRINGLS__BRICK_VOXELS;
        for (x = 0; x < margin; x++) out[x] = before[x];
        springls__copy_row(in + (size_t)top[0] * SPRINGLS__BRICK_VOXELS, out + margin);
        for (x = 0; x < margin; x++) out[margin + SPRINGLS__BRICK + x] = behind[x];
    }
}

/* Loads a tile with `margin` voxels around, each item of a group some of its rows; it is complete for all items on return. */
SPRINGLS__INNER void springls__load_rows(const springls__grid *g, SPRINGLS__GLOBAL const float *field, const int origin[3],
                                         bool border, int margin, springls__group group, SPRINGLS__LOCAL float *tile)
{
    const int width = SPRINGLS__BRICK + 2 * margin, entry = springls__entry_at(g, origin[0], origin[1], origin[2]);
    int row = group.item, y = row, z = 0;
    SPRINGLS__BARRIER; /* other items may still read the old values */
    for (; row < width * width; row += group.items, y += group.items) {
        for (; y >= width; y -= width) z++;
        springls__load_tile_row(g, field, origin, entry, border, margin, y - margin, z - margin, tile + width * row);
    }
    SPRINGLS__BARRIER;
}

/* Loads the tile of a slot. */
SPRINGLS__MATHS void springls__load_tile(const springls__grid *g, SPRINGLS__GLOBAL const float *field, int slot,
                                         springls__group group, SPRINGLS__LOCAL float *tile)
{
    int o[3];
    springls__slot_origin(g, slot, o);
    springls__load_rows(g, field, o, springls__tile_at_border(g, o), 1, group, tile);
}

/* Returns which voxels of a row of a tile are inside, as bits. */
SPRINGLS__MATHS uint32_t springls__signs_of_row(SPRINGLS__LOCAL const float *row)
{
    uint32_t signs = 0u;
    int x;
    for (x = 0; x < SPRINGLS__TILE; x++) signs |= (uint32_t)(row[x] < 0.0f) << x;
    return signs;
}

/* Voxels of a row and their six neighbours, one voxel a lane. */
typedef struct springls__cross7 { springls__vec c, xm, xp, ym, yp, zm, zp; } springls__cross7;

/* Reads voxels t[0], t[1], ... of a tile. */
SPRINGLS__VEC_MATHS springls__cross7 springls__tile_cross(SPRINGLS__LOCAL const float *t)
{
    springls__cross7 v;
    v.c = springls__vec_load(t);
    v.xm = springls__vec_load(t - 1);
    v.xp = springls__vec_load(t + 1);
    v.ym = springls__vec_load(t - SPRINGLS__TILE);
    v.yp = springls__vec_load(t + SPRINGLS__TILE);
    v.zm = springls__vec_load(t - SPRINGLS__TILE * SPRINGLS__TILE);
    v.zp = springls__vec_load(t + SPRINGLS__TILE * SPRINGLS__TILE);
    return v;
}

/* Returns the smallest of the six neighbours. */
SPRINGLS__VEC_MATHS springls__vec springls__cross_min(springls__cross7 v)
{
    return springls__vec_min(springls__vec_min(springls__vec_min(v.xm, v.xp), springls__vec_min(v.ym, v.yp)),
                             springls__vec_min(v.zm, v.zp));
}

/* Returns the largest of the six neighbours. */
SPRINGLS__VEC_MATHS springls__vec springls__cross_max(springls__cross7 v)
{
    return springls__vec_max(springls__vec_max(springls__vec_max(v.xm, v.xp), springls__vec_max(v.ym, v.yp)),
                             springls__vec_max(v.zm, v.zp));
}

/* Returns along each axis the smaller |value| of the two neighbours. */
SPRINGLS__VEC_MATHS springls__vec3 springls__nearer_of_pairs(springls__cross7 v)
{
    return springls__vec_v3_make(springls__vec_min(springls__vec_fabs(v.xm), springls__vec_fabs(v.xp)),
                                 springls__vec_min(springls__vec_fabs(v.ym), springls__vec_fabs(v.yp)),
                                 springls__vec_min(springls__vec_fabs(v.zm), springls__vec_fabs(v.zp)));
}

/* Returns where c lies on another side than lo or hi, the smallest and largest of its neighbours. */
SPRINGLS__VEC_MATHS springls__vmask springls__crosses(springls__vec c, springls__vec lo, springls__vec hi)
{
    springls__vmask inside = c < 0.0f;
    return (inside & (hi >= 0.0f)) | (springls__vec_not(inside) & (lo < 0.0f));
}

/* Returns where a voxel and one of its six neighbours lie on different sides. */
SPRINGLS__VEC_MATHS springls__vmask springls__at_interface(springls__cross7 v)
{
    return springls__crosses(v.c, springls__cross_min(v), springls__cross_max(v));
}

/* Returns how many bricks the domain has. */
SPRINGLS__MATHS size_t springls__brick_count(const springls__grid *g)
{
    return (size_t)g->bricks[0] * (size_t)g->bricks[1] * (size_t)g->bricks[2];
}

/* Returns how many entries the top table has. */
SPRINGLS__MATHS size_t springls__entry_count(const springls__grid *g)
{
    return (size_t)g->table.bricks[0] * (size_t)g->table.bricks[1] * (size_t)g->table.bricks[2];
}

/* Finds the first voxel of one of the 27 bricks around (and including) the one at `origin`, d = 0..26, bits of the masks of
   springls__neighbor_mask_of_row; false if there is none. */
SPRINGLS__MATHS bool springls__brick_around(const springls__grid *g, const int origin[3], int d, int at[3])
{
    at[0] = origin[0] + 8 * (d % 3 - 1);
    at[1] = origin[1] + 8 * (d / 3 % 3 - 1);
    at[2] = origin[2] + 8 * (d / 9 - 1);
    return springls__grid_contains(g, at[0], at[1], at[2]);
}

/* Returns the slot of the d-th brick around an active one, a constant one beyond the domain. */
SPRINGLS__MATHS int springls__slot_around(const springls__grid *g, const int origin[3], int d)
{
    int at[3];
    return springls__brick_around(g, origin, d, at) ? springls__slot_at(g, at[0], at[1], at[2]) : SPRINGLS__OUTSIDE;
}

#define SPRINGLS__ALL_AROUND 0x7ffffffu

/* Finds the voxel (i, j) beside face d (-x +x -y +y -z +z) of a block of size^3 voxels at `at`. */
SPRINGLS__MATHS void springls__voxel_at_face(const int at[3], int size, int d, int i, int j, int to[3])
{
    const int axis = d >> 1;
    to[axis] = at[axis] + (d & 1 ? size : -1);
    to[(axis + 1) % 3] = at[(axis + 1) % 3] + i;
    to[(axis + 2) % 3] = at[(axis + 2) % 3] + j;
}

/* A walk over the bricks that a springl comes near. */
typedef struct springls__brick_walk { int lo[3], hi[3], at[3]; } springls__brick_walk;

/* Returns the box within `margin` voxels of a triangle. */
SPRINGLS__MATHS springls__box springls__box_around(springls__springl s, float margin)
{
    springls__box box = springls__box_empty();
    int m;
    for (m = 0; m < 3; m++) box = springls__box_add(box, s.q[m]);
    return springls__box_widened(box, margin);
}

/* Rows of eight voxels of a brick, along y from y0 to y1 and along z from z0 to z1. */
typedef struct springls__row_range { int y0, y1, z0, z1; } springls__row_range;

/* Returns the rows between two corners, in voxels from the brick's first one; the nearest row where that is beyond the brick. */
SPRINGLS__MATHS springls__row_range springls__rows_between(springls__v3 lower, springls__v3 upper)
{
    springls__row_range rows;
    rows.y0 = (int)springls__clamp(lower.y, 0.0f, 7.0f);
    rows.y1 = (int)springls__clamp(upper.y, 0.0f, 7.0f);
    rows.z0 = (int)springls__clamp(lower.z, 0.0f, 7.0f);
    rows.z1 = (int)springls__clamp(upper.z, 0.0f, 7.0f);
    return rows;
}

/* Begins at the bricks of the top table within `margin` voxels of the box around a triangle. */
SPRINGLS__MATHS springls__brick_walk springls__brick_walk_begin(const springls__grid *g, springls__springl s, float margin)
{
    const springls__box box = springls__box_around(s, margin);
    springls__brick_walk walk;
    int m;
    springls__voxel_of_place(g, box.lower, walk.lo);
    springls__voxel_of_place(g, box.upper, walk.hi);
    for (m = 0; m < 3; m++) walk.at[m] = walk.lo[m] &= ~7;
    return walk;
}

/* Returns the entry of the next brick; -1 at the end. */
SPRINGLS__MATHS int springls__brick_walk_next(const springls__grid *g, springls__brick_walk *walk)
{
    int entry = springls__entry_at(g, walk->at[0], walk->at[1], walk->at[2]), axis;
    if (walk->at[2] > walk->hi[2]) return -1;
    for (axis = 0; axis < 3; axis++) {
        walk->at[axis] += 8;
        if (walk->at[axis] <= walk->hi[axis] || axis == 2) break;
        walk->at[axis] = walk->lo[axis];
    }
    return entry;
}

/* ---- bricks come and go ---- */

/* Frees an active brick: it becomes constant, on the side of its first voxel; its slot becomes the free one of number `place`. */
SPRINGLS__MATHS void springls__drop_brick(const springls__grid *g, int slot, int place)
{
    bool inside = g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f;
    g->top[springls__entry_of_brick(g, g->slot_brick[slot])] = inside ? SPRINGLS__INSIDE : SPRINGLS__OUTSIDE;
    g->slot_brick[slot] = -1;
    g->awake[slot] = 0;
    g->free_slots[place] = slot;
}

/* Returns the slot of the n-th of some new bricks: one of the `free_count` free slots, the last one first, or one behind all. */
SPRINGLS__MATHS int springls__slot_of_new(const springls__grid *g, int free_count, int slot_count, int n)
{
    return n < free_count ? g->free_slots[free_count - 1 - n] : slot_count + n - free_count;
}

/* Activates the constant brick of an entry; the slot's first voxel gets the constant. */
SPRINGLS__MATHS void springls__add_brick(const springls__grid *g, int entry, int slot)
{
    g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS] = g->top[entry] == SPRINGLS__INSIDE ? -g->far_value : g->far_value;
    g->slot_brick[slot] = springls__brick_of_entry(g, entry);
    g->top[entry] = slot;
}

SPRINGLS__MATHS SPRINGLS__GLOBAL uint32_t *springls__cells_of(const springls__grid *g, int slot)
{
    return g->cell + (size_t)slot * SPRINGLS__CELLS;
}

SPRINGLS__MATHS void springls__clear_cells(SPRINGLS__GLOBAL uint32_t *cell)
{
    int c;
    for (c = 0; c < SPRINGLS__CELLS; c++) cell[c] = 0u;
}

/* Returns the slot of the brick that a place lies in. */
SPRINGLS__MATHS int springls__slot_of_place(const springls__grid *g, springls__v3 x)
{
    int voxel[3];
    springls__voxel_of_place(g, x, voxel);
    return springls__slot_at(g, voxel[0], voxel[1], voxel[2]);
}

/* Keys of springls in no cell: large ones, and those whose particle lies outside all active bricks. */
#define SPRINGLS__LARGE_KEY 0xffffffffu
#define SPRINGLS__OUTSIDE_KEY 0xfffffffeu

SPRINGLS__MATHS bool springls__is_in_cell(uint32_t key) { return key < SPRINGLS__OUTSIDE_KEY; }

/* Values of ASLEEP, whose others are 0, awake, and 1, asleep: in a brick that is awake, but an edit passes over it (tools/completion.h);
   asleep, and so are all bricks around. */
#define SPRINGLS__UNREACHED 2
#define SPRINGLS__FAST_ASLEEP 3

/* Finds whether springl i is asleep, as its brick is. The key of its cell tells the brick, where the cell list is up to date. */
SPRINGLS__MATHS void springls__asleep_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    const uint32_t key = args.asleep.listed ? model->cells.key[i] : SPRINGLS__LARGE_KEY;
    const int slot = springls__is_in_cell(key) ? (int)((key - 1u) / SPRINGLS__CELLS) : springls__slot_of_place(g, model->set.s[i].p);
    model->cells.asleep[i] = g->awake[slot] ? 0 : g->near_awake[slot] ? 1 : SPRINGLS__FAST_ASLEEP;
}

/* Returns true when springl i is asleep: stages leave it as it is. */
SPRINGLS__MATHS bool springls__is_asleep(const springls__model *model, int i)
{
    return model->grid.some_asleep && i < model->cells.asleep_count && model->cells.asleep[i];
}

/* Marks phi as synced with particle i, unless it is asleep: stores its place. */
SPRINGLS__MATHS void springls__mark_phi_synced_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    if (!springls__is_asleep(model, i)) model->set.synced_position[i] = model->set.s[i].p;
}

/* Returns true when springl i, asleep, was out of reach of those awake when that was last found. */
SPRINGLS__MATHS bool springls__is_listed_fast_asleep(const springls__model *model, int i)
{
    return springls__is_asleep(model, i) && model->cells.asleep[i] == SPRINGLS__FAST_ASLEEP;
}

/* Returns true when a particle is out of reach of the springls that are awake. */
SPRINGLS__MATHS bool springls__is_fast_asleep(const springls__model *model, springls__v3 p)
{
    return model->grid.some_asleep && !model->grid.near_awake[springls__slot_of_place(&model->grid, p)];
}

/* Returns true when active brick i is asleep. */
SPRINGLS__MATHS bool springls__is_brick_asleep(const springls__grid *g, int i)
{
    return g->some_asleep && !g->awake[g->active[i]];
}

/* Returns true when active brick i is asleep; sees to it that phi_next has its phi. */
SPRINGLS__MATHS bool springls__keeps_phi(const springls__model *model, int i)
{
    const springls__grid *g = &model->grid;
    const size_t first = (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row;
    if (!springls__is_brick_asleep(g, i)) return false;
    for (row = model->group.item; !g->phi_kept && row < SPRINGLS__ROWS; row += model->group.items)
        springls__copy_voxel_row(g->phi + first + (size_t)(8 * row), g->phi_next + first + (size_t)(8 * row));
    return true;
}

/* Ends the calm of the brick of a slot. */
SPRINGLS__MATHS void springls__end_calm(const springls__grid *g, int slot)
{
    int o;
    for (o = 0; o < SPRINGLS__OCTANTS; o++) g->calm[slot * SPRINGLS__OCTANTS + o] = 0;
}

/* Wakes the brick of a slot: its springls count as having stirred. */
SPRINGLS__MATHS void springls__wake_slot(const springls__grid *g, int slot)
{
    springls__end_calm(g, slot);
    g->awake[slot] = g->near_awake[slot] = 1;
}

/* Fills a new brick with the constant of its first voxel; omega is unknown there, no springl is in its cells, and it is awake. */
SPRINGLS__MATHS void springls__fill_new_brick(const springls__grid *g, int slot)
{
    const size_t first = (size_t)slot * SPRINGLS__BRICK_VOXELS;
    const float value = g->phi[first];
    size_t v;
    for (v = first; v < first + SPRINGLS__BRICK_VOXELS; v++) {
        g->phi[v] = g->phi_next[v] = value;
        g->omega[v] = -1.0f;
    }
    springls__clear_cells(springls__cells_of(g, slot));
    springls__wake_slot(g, slot);
}

#endif
