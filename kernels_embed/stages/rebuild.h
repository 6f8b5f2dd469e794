/* rebuild.h - re-distancing: phi becomes a signed distance again without moving its zero level (Table 2). */
#ifndef SPRINGLS__KERNEL_STAGES_REBUILD_H
#define SPRINGLS__KERNEL_STAGES_REBUILD_H

#include "../model/grid.h"
#include "../model/model.h"

/* Returns the square of the slope along one axis: central, or the steeper side where the two disagree (a ridge or a thin
   sheet). One side flat makes the central slope half of the steeper: that is a ridge, whatever the rounding. */
SPRINGLS__VEC_MATHS springls__vec springls__slope2(springls__vec m, springls__vec c, springls__vec p)
{
    springls__vec flat = springls__vec_fabs(0.5f * (p - m));
    springls__vec steep = springls__vec_max(springls__vec_fabs(c - m), springls__vec_fabs(p - c));
    springls__vec slope = springls__vec_select(flat < 0.65f * steep, steep, flat);
    return slope * slope;
}

/* Returns the sub-voxel distance of a voxel near the interface: phi over its slope. A slope within 5 % of 1 counts as 1, from
   10 % on in full: so repeated rebuilding does not move what is a distance already. */
SPRINGLS__VEC_MATHS springls__vec springls__interface_distance(springls__cross7 v)
{
    springls__vec g2 = springls__slope2(v.xm, v.c, v.xp) + springls__slope2(v.ym, v.c, v.yp) + springls__slope2(v.zm, v.c, v.zp);
    springls__vec excess = springls__vec_sqrt(springls__vec_max(g2, springls__vec_broadcast(1e-4f))) - 1.0f;
    springls__vec share = springls__vec_clamp(20.0f * springls__vec_fabs(excess) - 1.0f, 0.0f, 1.0f);
    return v.c / (1.0f + share * excess);
}

/* Beside a plane a voxel that is not at the interface is at least 1/sqrt(3) away. Beside a sharp edge or corner it can be
   nearer, and a distance from its neighbours would be too long. So a voxel gets its distance from its own slope, too, if one of its 26
   neighbours is on the other side. A near voxel without such a neighbour is the remnant of a part that has vanished. */
#define SPRINGLS__NEAR 0.577f

/* Returns where one of the 26 neighbours is on the other side; phi points into a tile. */
SPRINGLS__VEC_MATHS springls__vmask springls__touches_other_side(SPRINGLS__LOCAL const float *phi)
{
    springls__vec c = springls__vec_load(phi), lo = c, hi = c;
    int i;
    for (i = 0; i < 27; i++) {
        springls__vec v = springls__vec_load(phi + springls__tile_step(i));
        lo = springls__vec_min(lo, v);
        hi = springls__vec_max(hi, v);
    }
    return springls__crosses(c, lo, hi);
}

/* Returns |c| in [NEAR, far_value] with the side of c: the first guess for voxels that get their distance from their
   neighbours. */
SPRINGLS__VEC_MATHS springls__vec springls__distance_guess(springls__vec c, float far_value)
{
    springls__vec d = springls__vec_clamp(springls__vec_fabs(c), SPRINGLS__NEAR, far_value);
    return springls__vec_select(c < 0.0f, -d, d);
}

/* Writes sub-voxel distances at the interface and at sharp edges, guesses elsewhere, of a row of eight voxels; phi points into a
   tile. */
SPRINGLS__MATHS void springls__interface_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__cross7 v = springls__tile_cross(phi + i);
        springls__vec d = springls__distance_guess(v.c, far_value), own;
        springls__vmask takes_own = springls__at_interface(v), edge = springls__vec_fabs(v.c) < 1.0f;
        if (springls__vec_any(takes_own | edge)) {
            own = springls__interface_distance(v);
            edge = edge & springls__vec_not(takes_own) & (springls__vec_fabs(own) < SPRINGLS__NEAR);
            if (springls__vec_any(edge)) takes_own = takes_own | (edge & springls__touches_other_side(phi + i));
            d = springls__vec_select(takes_own, own, d);
        }
        springls__vec_store(out + i, d);
    }
}

/* Solves |grad d| = 1 (Godunov) from the smaller neighbour distance along each axis. */
SPRINGLS__VEC_MATHS springls__vec springls__eikonal(springls__vec3 n)
{
    const springls__vec zero = springls__vec_broadcast(0.0f);
    springls__vec a = springls__vec_min(n.x, springls__vec_min(n.y, n.z)), c = springls__vec_max(n.x, springls__vec_max(n.y, n.z));
    springls__vec b = springls__vec_max(springls__vec_min(n.x, n.y), springls__vec_min(springls__vec_max(n.x, n.y), n.z));
    springls__vec one = a + 1.0f, two, three, sum, d;
    two = 0.5f * (a + b + springls__vec_sqrt(springls__vec_max(2.0f - (a - b) * (a - b), zero)));
    sum = a + b + c;
    three = sum * sum - 3.0f * (a * a + b * b + c * c - 1.0f);
    three = (sum + springls__vec_sqrt(springls__vec_max(three, zero))) * (1.0f / 3.0f);
    d = springls__vec_select(one > b, two, one);
    return springls__vec_select(d > c, three, d);
}

/* Writes new distances of a row of eight voxels from their neighbours'; phi points into a tile. A voxel keeps its own distance at
   the interface, and below NEAR where one of its 26 neighbours is on the other side. */
SPRINGLS__MATHS void springls__redistance_row(SPRINGLS__LOCAL const float *phi, float far_value, SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__cross7 v = springls__tile_cross(phi + i);
        springls__vec3 n = springls__nearer_of_pairs(v);
        springls__vec d = springls__vec_broadcast(far_value);
        springls__vmask kept = springls__at_interface(v);
        springls__vmask near_by = springls__vec_not(kept) & (springls__vec_fabs(v.c) < SPRINGLS__NEAR);
        if (springls__vec_any(near_by)) kept = kept | (near_by & springls__touches_other_side(phi + i));
        if (springls__vec_any(springls__vec_min(n.x, springls__vec_min(n.y, n.z)) < d))
            d = springls__vec_min(springls__eikonal(n), d);
        d = springls__vec_select(v.c < 0.0f, -d, d);
        springls__vec_store(out + i, springls__vec_select(kept, v.c, d));
    }
}

/* Writes to phi_next sub-voxel distances at the interface of a brick, first guesses elsewhere. */
SPRINGLS__MATHS void springls__subvoxel_element(const springls__model *model, springls__arguments args, int i,
                                                SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row;
    (void)args;
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        springls__interface_row(tile + springls__tile_index(0, row & 7, row >> 3), g->far_value, out + 8 * row);
}

/* Writes to phi_next one Jacobi sweep of |grad phi| = 1 over a brick; voxels at the interface keep their distance. */
SPRINGLS__MATHS void springls__redistance_element(const springls__model *model, springls__arguments args, int i,
                                                  SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row;
    (void)args;
    if (springls__keeps_phi(model, i)) return;
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        springls__redistance_row(tile + springls__tile_index(0, row & 7, row >> 3), g->far_value, out + 8 * row);
}

/* Returns which of the 27 bricks around (and including) a brick the band reaches, as bits. */
SPRINGLS__VEC_MATHS uint32_t springls__band_neighbor_mask(SPRINGLS__GLOBAL const float *phi, float half_width)
{
    uint32_t mask = 0;
    int x, y, z;
    for (z = 0; z < 8; z++)
        for (y = 0; y < 8; y++) {
            uint32_t row = 0;
            for (x = 0; x < 8; x += SPRINGLS__LANES)
                row |= springls__vec_bits(springls__vec_fabs(springls__vec_load(phi + x + 8 * y + 64 * z)) < half_width) << x;
            if (row) mask |= springls__neighbor_mask_of_row((row & 1u) != 0, row >> 7 != 0, y == 0, y == 7, z == 0, z == 7);
        }
    return mask;
}

/* Finds the bricks around active brick i that the band reaches. */
SPRINGLS__MATHS void springls__band_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__band_mask(model)[i] = springls__band_neighbor_mask(
        model->grid.phi + (size_t)model->grid.active[i] * SPRINGLS__BRICK_VOXELS, model->params.band_half_width);
}

#endif
