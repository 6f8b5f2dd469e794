/* topology.h - simple points: voxels that may change sides without changing the topology of the object.
   Inside is 6-connected and outside 26-connected, as in marching_cubes.h. A neighborhood of 3 x 3 x 3 voxels is a mask of 27
   bits, set = inside: voxel (dx, dy, dz), each -1, 0 or 1, is bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1). The center, bit 13, is not
   used: whether a voxel is simple does not depend on the side it is on. */
#ifndef SPRINGLS__KERNEL_STAGES_TOPOLOGY_H
#define SPRINGLS__KERNEL_STAGES_TOPOLOGY_H

#include "../model/grid.h"
#include "../model/model.h"

SPRINGLS__MATHS unsigned int springls__mask27_bit(int dx, int dy, int dz) { return 1u << (dx + 3 * dy + 9 * dz + 13); }

/* Spreads a mask by one voxel along +-x, +-y or +-z; bits that leave the block are lost. */
SPRINGLS__MATHS unsigned int springls__mask27_spread_x(unsigned int m)
{
    return m | (m & 0x36db6dbu) << 1 | (m & 0x6db6db6u) >> 1;
}

SPRINGLS__MATHS unsigned int springls__mask27_spread_y(unsigned int m)
{
    return m | (m & 0x0fc7e3fu) << 3 | (m & 0x7e3f1f8u) >> 3;
}

SPRINGLS__MATHS unsigned int springls__mask27_spread_z(unsigned int m)
{
    return m | (m & 0x003ffffu) << 9 | m >> 9;
}

/* Returns true when the center is next to exactly one component of the inside (topological number T6 = 1). Components are
   6-connected through the 18 neighbors that share a face or an edge with the center; only those with one of the 6 face
   neighbors count. */
SPRINGLS__INNER bool springls__touches_one_inside(unsigned int mask27)
{
    unsigned int faces = mask27 & 0x0415410u;
    unsigned int near18 = mask27 & 0x2ebdebau;
    unsigned int component = faces & (~faces + 1u), before = 0u;
    while (component != before) {
        before = component;
        component = springls__mask27_spread_x(before) | springls__mask27_spread_y(before) | springls__mask27_spread_z(before);
        component &= near18;
    }
    return faces != 0u && (faces & ~component) == 0u;
}

/* Returns true when the center is next to exactly one component of the outside, 26-connected through its 26 neighbors (T26 = 1). */
SPRINGLS__INNER bool springls__touches_one_outside(unsigned int mask27)
{
    unsigned int outside = ~mask27 & 0x7ffdfffu;
    unsigned int component = outside & (~outside + 1u), before = 0u;
    while (component != before) {
        before = component;
        component = springls__mask27_spread_z(springls__mask27_spread_y(springls__mask27_spread_x(component))) & outside;
    }
    return outside != 0u && component == outside;
}

/* Returns true when the center may change sides: no component, hole or cavity of the object would appear, merge or vanish. */
SPRINGLS__MATHS bool springls__is_simple(unsigned int mask27)
{
    return springls__touches_one_inside(mask27) && springls__touches_one_outside(mask27);
}

SPRINGLS__MATHS unsigned springls__inside_mask(const springls__grid *g, SPRINGLS__GLOBAL const float *phi, int x, int y, int z)
{
    unsigned mask = 0;
    int d;
    for (d = 0; d < 27; d++)
        if (springls__grid_phi(g, phi, x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1) < 0.0f) mask |= 1u << d;
    return mask;
}

/* Takes the changes of side in phi_next over to phi, in active brick i, for the simple voxels of one color (the parities of x,
   y and z). Voxels of one color are not neighbors, so they may change together, in any order. */
SPRINGLS__MATHS void springls__commit_simple_color_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL const float *next = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int color = args.commit_simple.color, x, y, z, o[3];
    springls__slot_origin(g, g->active[i], o);
    for (z = color >> 2; z < 8; z += 2)
        for (y = color >> 1 & 1; y < 8; y += 2)
            for (x = color & 1; x < 8; x += 2) {
                int v = x + 8 * y + 64 * z;
                if ((phi[v] < 0.0f) == (next[v] < 0.0f) || !springls__grid_contains(g, o[0] + x, o[1] + y, o[2] + z)) continue;
                if (springls__is_simple(springls__inside_mask(g, g->phi, o[0] + x, o[1] + y, o[2] + z))) phi[v] = next[v];
            }
}

/* Reverts the changes of side in phi_next that were not taken over. */
SPRINGLS__MATHS void springls__revert_unsimple_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    const float held = 0.25f; /* voxel: |phi| of a voxel that may not change, next to the interface */
    SPRINGLS__GLOBAL const float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL float *next = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int x;
    (void)args;
    for (x = 0; x < SPRINGLS__BRICK_VOXELS; x++)
        if ((phi[x] < 0.0f) != (next[x] < 0.0f)) next[x] = phi[x] < 0.0f ? -held : held;
}

#endif
