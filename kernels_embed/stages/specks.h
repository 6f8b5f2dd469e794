/* specks.h - phi without parts that the grid cannot resolve (params.min_component). A voxel of a limb that runs diagonally
   between voxels has no neighbour inside: where the springls show that the limb goes on it is joined to the rest, elsewhere it is
   removed. */
#ifndef SPRINGLS__KERNEL_STAGES_SPECKS_H
#define SPRINGLS__KERNEL_STAGES_SPECKS_H

#include "../model/cell_list.h"
#include "../model/grid.h"
#include "../model/marching_cubes.h"
#include "../model/model.h"
#include "../model/neighborhood.h"
#include "topology.h"

/* phi of a voxel that becomes inside, voxel: so deep that volume_lock's offsets do not open what was joined or filled. */
#define SPRINGLS__FILLED_PHI (-0.05f)

/* ---- rows ---- */

/* Returns row `row` of the brick in a tile: eight voxels. */
SPRINGLS__MATHS SPRINGLS__LOCAL const float *springls__tile_row(SPRINGLS__LOCAL const float *tile, int row)
{
    return tile + springls__tile_index(0, row & 7, row >> 3);
}

/* Returns row `row` of active brick i in phi_next. */
SPRINGLS__MATHS SPRINGLS__GLOBAL float *springls__next_row(const springls__grid *g, int i, int row)
{
    return g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS + 8 * row;
}

/* ---- parts ---- */

/* Finds voxel x of a row of the brick at o. */
SPRINGLS__MATHS void springls__row_voxel(const int o[3], int row, int x, int at[3])
{
    at[0] = o[0] + x;
    at[1] = o[1] + (row & 7);
    at[2] = o[2] + (row >> 3);
}

SPRINGLS__MATHS float springls__phi_of(const springls__grid *g, const int at[3])
{
    return springls__grid_phi(g, g->phi, at[0], at[1], at[2]);
}

#define SPRINGLS__PART_WIDTH 16 /* voxels: no part as wide as that is small */

/* A connected part of the inside or outside: its voxels in the order in which they were found, the box around them, and a bit for
   each; voxels PART_WIDTH apart have the same bit. */
typedef struct springls__part {
    int at[SPRINGLS__LARGEST_SPECK + 1][3], count, lower[3], upper[3];
    uint32_t found[SPRINGLS__PART_WIDTH * SPRINGLS__PART_WIDTH / 2]; /* two rows each */
} springls__part;

/* Returns the bit of a voxel, and in which word it is. */
SPRINGLS__MATHS uint32_t springls__part_bit(const int at[3], int *word)
{
    const int last = SPRINGLS__PART_WIDTH - 1;
    *word = ((at[1] & last) >> 1) + (at[2] & last) * (SPRINGLS__PART_WIDTH / 2);
    return 1u << ((at[0] & last) + SPRINGLS__PART_WIDTH * (at[1] & 1));
}

SPRINGLS__MATHS bool springls__part_has(const springls__part *part, const int at[3])
{
    int axis, word;
    uint32_t bit = springls__part_bit(at, &word);
    for (axis = 0; axis < 3; axis++)
        if (at[axis] < part->lower[axis] || at[axis] > part->upper[axis]) return false;
    return (part->found[word] & bit) != 0u;
}

/* Adds a voxel, unless the part has it; returns false if the part would be too wide. */
SPRINGLS__INNER bool springls__part_add(springls__part *part, const int at[3])
{
    int axis, word;
    uint32_t bit = springls__part_bit(at, &word);
    for (axis = 0; axis < 3; axis++)
        if (springls__imax(part->upper[axis], at[axis]) - springls__imin(part->lower[axis], at[axis]) >= SPRINGLS__PART_WIDTH - 1)
            return false;
    if (part->found[word] & bit) return true;
    part->found[word] |= bit;
    for (axis = 0; axis < 3; axis++) {
        part->lower[axis] = springls__imin(part->lower[axis], at[axis]);
        part->upper[axis] = springls__imax(part->upper[axis], at[axis]);
        part->at[part->count][axis] = at[axis];
    }
    part->count++;
    return true;
}

/* Finds the place of the i-th voxel of a part. */
SPRINGLS__MATHS void springls__part_place(const springls__part *part, int i, int at[3])
{
    int axis;
    for (axis = 0; axis < 3; axis++) at[axis] = part->at[i][axis];
}

/* Makes a part of one voxel. */
SPRINGLS__MATHS void springls__part_begin(springls__part *part, const int at[3])
{
    int i;
    for (i = 0; i < 3; i++) part->lower[i] = part->upper[i] = at[i];
    for (i = 0; i < SPRINGLS__PART_WIDTH * SPRINGLS__PART_WIDTH / 2; i++) part->found[i] = 0u;
    part->count = 0;
    springls__part_add(part, at);
}

/* Adds all voxels of the side of its first one that a part of one voxel reaches through faces; returns false when it has more than
   `largest`. */
SPRINGLS__MATHS bool springls__part_grow(const springls__grid *g, int largest, springls__part *part)
{
    bool inside;
    int i, d, from[3], to[3];
    springls__part_place(part, 0, from);
    inside = springls__phi_of(g, from) < 0.0f;
    for (i = 0; i < part->count; i++)
        for (d = 0; d < 6; d++) {
            springls__part_place(part, i, from);
            springls__neighbor_voxel(from, d, to);
            if ((springls__phi_of(g, to) < 0.0f) != inside) continue;
            if (!springls__part_add(part, to) || part->count > largest) return false;
        }
    return true;
}

/* Finds the part of its side that a voxel is of; returns false when it has more than `largest` voxels. */
SPRINGLS__MATHS bool springls__find_small_part(const springls__grid *g, const int at[3], int largest, springls__part *part)
{
    springls__part_begin(part, at);
    return springls__part_grow(g, largest, part);
}

/* Returns true when voxel `at`, outside, is the only way out of a small part of the outside. */
SPRINGLS__MATHS bool springls__is_mouth(const springls__grid *g, const int at[3])
{
    springls__part part;
    int d, to[3], word;
    uint32_t bit;
    for (d = 0; d < 6; d++) {
        springls__neighbor_voxel(at, d, to);
        if (springls__phi_of(g, to) < 0.0f) continue;
        springls__part_begin(&part, to);
        bit = springls__part_bit(at, &word);
        part.found[word] |= bit; /* counts as found, so that the part does not grow through it */
        if (springls__part_grow(g, SPRINGLS__LARGEST_SPECK, &part)) return true;
    }
    return false;
}

/* ---- joining ---- */

#define SPRINGLS__JOIN_PHI 0.6f /* voxel: no voxel further outside joins two others */

/* Finds joint candidates among several voxels: outside, between inside voxels in directions d1 and d2 of a tile, and the fourth
   voxel of the square outside too. */
SPRINGLS__VEC_MATHS springls__vmask springls__are_joint_candidates(SPRINGLS__LOCAL const float *phi, int d1, int d2)
{
    springls__vec c = springls__vec_load(phi);
    return (c >= 0.0f) & (c < SPRINGLS__JOIN_PHI) & (springls__vec_load(phi + d1) < 0.0f)
         & (springls__vec_load(phi + d2) < 0.0f) & (springls__vec_load(phi + d1 + d2) >= 0.0f);
}

/* A voxel outside that may join a part to an inside voxel beyond it; phi: of it. */
typedef struct springls__joint { int at[3]; float phi; } springls__joint;

/* Returns true when joint a is to be preferred to b: it is nearer to the surface; equal ones have the order of their places. */
SPRINGLS__MATHS bool springls__better_joint(springls__joint a, springls__joint b)
{
    if (a.phi != b.phi) return a.phi < b.phi;
    if (a.at[2] != b.at[2]) return a.at[2] < b.at[2];
    return a.at[1] != b.at[1] ? a.at[1] < b.at[1] : a.at[0] < b.at[0];
}

/* Replaces the best joint of a part by the voxel beside inside voxel `from` in direction d1, to the voxel beside that in
   direction d2, when it is better and the springls show that a limb passes between. */
SPRINGLS__MATHS void springls__take_better_joint(const springls__model *model, const springls__part *part, const int from[3],
                                                 int d1, int d2, springls__joint *best)
{
    const float near_by = 1.6f; /* voxels */
    const springls__grid *g = &model->grid;
    springls__joint joint, other;
    int to[3];
    if (d1 >> 1 == d2 >> 1) return;
    springls__neighbor_voxel(from, d1, joint.at);
    springls__neighbor_voxel(from, d2, other.at);
    joint.phi = springls__phi_of(g, joint.at);
    other.phi = springls__phi_of(g, other.at);
    if (joint.phi < 0.0f || other.phi < 0.0f) return;
    if (!springls__better_joint(joint, *best) || springls__better_joint(other, joint)) return;
    if (!springls__grid_contains(g, joint.at[0], joint.at[1], joint.at[2])) return;
    springls__neighbor_voxel(joint.at, d2, to);
    if (springls__phi_of(g, to) >= 0.0f || springls__part_has(part, to)) return;
    if (springls__side_of_springls(model, springls__v3_make(0.5f * (float)(from[0] + to[0]), 0.5f * (float)(from[1] + to[1]),
                                                            0.5f * (float)(from[2] + to[2])), -1, near_by) < 0)
        *best = joint;
}

/* Returns the best joint of a part; its phi is JOIN_PHI when there is none. */
SPRINGLS__MATHS springls__joint springls__best_joint(const springls__model *model, const springls__part *part)
{
    springls__joint best;
    int i, d, from[3];
    best.at[0] = best.at[1] = best.at[2] = -1;
    best.phi = SPRINGLS__JOIN_PHI;
    for (i = 0; i < part->count; i++) {
        springls__part_place(part, i, from);
        for (d = 0; d < 36; d++) springls__take_better_joint(model, part, from, d / 6, d % 6, &best);
    }
    return best;
}

/* Returns true when voxel `at`, outside, is a joint candidate: a corner of a square whose other diagonal has inside voxel `from`,
   in direction d1, and another inside voxel, and whose fourth corner is outside. */
SPRINGLS__MATHS bool springls__is_joint_candidate(const springls__grid *g, const int at[3], const int from[3], int d1)
{
    int d2, to[3], other[3];
    for (d2 = 0; d2 < 6; d2++) {
        if (d1 >> 1 == d2 >> 1) continue;
        springls__neighbor_voxel(at, d2, to);
        springls__neighbor_voxel(from, d2, other);
        if (springls__phi_of(g, to) < 0.0f && springls__phi_of(g, other) >= 0.0f) return true;
    }
    return false;
}

/* Returns true when voxel `at`, outside, is the best joint of a small part beside it. Since every part has one joint, and all
   parts have the same order of joints, no tunnel results. */
SPRINGLS__MATHS bool springls__is_best_joint(const springls__model *model, const int at[3])
{
    springls__part part;
    int d, from[3];
    for (d = 0; d < 6; d++) {
        springls__joint best;
        springls__neighbor_voxel(at, d, from);
        if (springls__phi_of(&model->grid, from) >= 0.0f || !springls__is_joint_candidate(&model->grid, at, from, d)
            || !springls__find_small_part(&model->grid, from, SPRINGLS__LARGEST_SPECK, &part)) continue;
        best = springls__best_joint(model, &part);
        if (best.at[0] == at[0] && best.at[1] == at[1] && best.at[2] == at[2]) return true;
    }
    return false;
}

/* Returns true when one of eight voxels is a joint candidate; phi points into a tile. */
SPRINGLS__INNER bool springls__row_has_joint_candidate(SPRINGLS__LOCAL const float *phi)
{
    const int y = SPRINGLS__TILE, z = SPRINGLS__TILE * SPRINGLS__TILE;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec c = springls__vec_load(phi + i);
        springls__vmask m;
        if (!springls__vec_any((c >= 0.0f) & (c < SPRINGLS__JOIN_PHI))) continue;
        m = springls__are_joint_candidates(phi + i, 1, y) | springls__are_joint_candidates(phi + i, -1, y)
          | springls__are_joint_candidates(phi + i, 1, -y) | springls__are_joint_candidates(phi + i, -1, -y)
          | springls__are_joint_candidates(phi + i, 1, z) | springls__are_joint_candidates(phi + i, -1, z)
          | springls__are_joint_candidates(phi + i, 1, -z) | springls__are_joint_candidates(phi + i, -1, -z)
          | springls__are_joint_candidates(phi + i, y, z) | springls__are_joint_candidates(phi + i, -y, z)
          | springls__are_joint_candidates(phi + i, y, -z) | springls__are_joint_candidates(phi + i, -y, -z);
        if (springls__vec_any(m)) return true;
    }
    return false;
}

/* Finds whether active brick i has joint candidates. */
SPRINGLS__MATHS void springls__find_joint_candidates_element(const springls__model *model, springls__arguments args, int i,
                                                SPRINGLS__LOCAL float *tile)
{
    SPRINGLS__GLOBAL uint8_t *candidates = springls__has_joint_candidates(model) + i;
    int row;
    (void)args;
    if (model->group.item == 0) *candidates = 0;
    if (springls__is_brick_asleep(&model->grid, i)) return;
    springls__load_tile(&model->grid, model->grid.phi, model->grid.active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        if (springls__row_has_joint_candidate(springls__tile_row(tile, row))) SPRINGLS__MARK(candidates, 1);
}

/* Loads active brick i into a tile, copies its phi to phi_next, and finds its first voxel. */
SPRINGLS__INNER void springls__copy_brick(const springls__model *model, int i, SPRINGLS__LOCAL float *tile, int origin[3])
{
    const springls__grid *g = &model->grid;
    int row, x;
    springls__slot_origin(g, g->active[i], origin);
    springls__load_tile(g, g->phi, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        for (x = 0; x < 8; x++) springls__next_row(g, i, row)[x] = springls__tile_row(tile, row)[x];
}

/* Copies phi of active brick i to phi_next, with the joints of small parts inside. */
SPRINGLS__MATHS void springls__join_parts_element(const springls__model *model, springls__arguments args, int i,
                                                  SPRINGLS__LOCAL float *tile)
{
    int row, x, o[3], at[3];
    (void)args;
    if (springls__keeps_phi(model, i)) return;
    springls__copy_brick(model, i, tile, o);
    if (!springls__has_joint_candidates(model)[i]) return;
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items) {
        SPRINGLS__LOCAL const float *phi = springls__tile_row(tile, row);
        if (!springls__row_has_joint_candidate(phi)) continue;
        for (x = 0; x < 8; x++) {
            if (phi[x] < 0.0f || phi[x] >= SPRINGLS__JOIN_PHI) continue;
            springls__row_voxel(o, row, x, at);
            if (springls__is_best_joint(model, at)) springls__next_row(&model->grid, i, row)[x] = SPRINGLS__FILLED_PHI;
        }
    }
}

/* ---- punctures ---- */

#define SPRINGLS__PUNCTURE_PHI 0.5f /* voxel: a hole through which no ball of a voxel in diameter passes */

/* Returns true when a voxel outside may puncture a sheet: it is nearer than PUNCTURE_PHI, lies in a ring of inside voxels and
   connects two parts of the outside. mask27: of the voxels around (topology.h). */
SPRINGLS__MATHS bool springls__punctures(float phi, unsigned mask27)
{
    return phi >= 0.0f && phi < SPRINGLS__PUNCTURE_PHI && springls__touches_one_inside(mask27)
        && !springls__touches_one_outside(mask27);
}

/* Returns true when voxel `at` punctures a sheet. */
SPRINGLS__MATHS bool springls__is_puncture(const springls__grid *g, const int at[3])
{
    float phi = springls__phi_of(g, at);
    if (phi < 0.0f || phi >= SPRINGLS__PUNCTURE_PHI || !springls__grid_contains(g, at[0], at[1], at[2])) return false;
    return springls__punctures(phi, springls__inside_mask(g, g->phi, at[0], at[1], at[2]));
}

/* Returns true when a puncture is to be filled: none around is nearer to the surface, so that each is filled once, and no bubble
   is left behind it. */
SPRINGLS__MATHS bool springls__fills_puncture(const springls__grid *g, const int at[3])
{
    springls__joint here, there;
    int d, axis;
    if (!springls__is_puncture(g, at)) return false;
    for (axis = 0; axis < 3; axis++) here.at[axis] = at[axis];
    here.phi = springls__phi_of(g, at);
    for (d = 0; d < 27; d++) {
        there.at[0] = at[0] + d % 3 - 1;
        there.at[1] = at[1] + d / 3 % 3 - 1;
        there.at[2] = at[2] + d / 9 - 1;
        there.phi = springls__phi_of(g, there.at);
        if (springls__better_joint(there, here) && springls__is_puncture(g, there.at)) return false;
    }
    return !springls__is_mouth(g, at);
}

/* ---- removal ---- */

#define SPRINGLS__AROUND_PUNCTURE 3.0f /* neighbours outside, of six, at most */

/* The most voxels that a part of less than min_component may have: in all, many where it is thin; of a voxel and the 26 around it;
   of the six beside a voxel. */
typedef struct springls__speck_limits {
    int in_all, around;
    float beside;
} springls__speck_limits;

SPRINGLS__MATHS springls__speck_limits springls__speck_limits_of(float min_component)
{
    springls__speck_limits limits;
    const int compact = (int)(4.0f * min_component);
    limits.in_all = springls__imin(4 * compact + 1, SPRINGLS__LARGEST_SPECK);
    limits.around = springls__imax(compact + 1, 8);
    limits.beside = (float)springls__imax(compact, 4);
    return limits;
}

/* Finds the signs of the nine rows around a row of voxels; phi points into a tile. */
SPRINGLS__MATHS void springls__signs_of_rows_around(SPRINGLS__LOCAL const float *phi, uint32_t around[9])
{
    int k;
    for (k = 0; k < 9; k++) around[k] = springls__signs_of_row(phi + springls__tile_step(3 * k));
}

/* Returns the sides of the voxels around voxel x of that row, as topology.h has them. */
SPRINGLS__MATHS unsigned springls__mask27_of_rows(const uint32_t around[9], int x)
{
    unsigned mask = 0u;
    int k;
    for (k = 0; k < 9; k++) mask |= (unsigned)(around[k] >> x & 7u) << 3 * k;
    return mask;
}

/* Returns 1 a lane where a neighbour x is on the side of a voxel, else 0. */
SPRINGLS__VEC_MATHS springls__vec springls__same_side(springls__vec x, springls__vmask inside)
{
    springls__vec one = springls__vec_broadcast(1.0f), none = springls__vec_broadcast(0.0f);
    return springls__vec_select(x < 0.0f, springls__vec_select(inside, one, none), springls__vec_select(inside, none, one));
}

/* Writes how many of the six neighbours of each of eight voxels are on its side; returns whether any has no more than
   `max_neighbors`. phi points into a tile. */
SPRINGLS__MATHS bool springls__count_beside(SPRINGLS__LOCAL const float *phi, float max_neighbors, float beside[8])
{
    bool some = false;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__cross7 v = springls__tile_cross(phi + i);
        springls__vmask inside = v.c < 0.0f;
        springls__vec n = springls__same_side(v.xm, inside) + springls__same_side(v.xp, inside)
                        + springls__same_side(v.ym, inside) + springls__same_side(v.yp, inside)
                        + springls__same_side(v.zm, inside) + springls__same_side(v.zp, inside);
        springls__vec_store(beside + i, n);
        some = some || springls__vec_any(n <= max_neighbors);
    }
    return some;
}

/* Finds the voxel at corner c of the cube whose corner 0 is voxel `cube`. */
SPRINGLS__MATHS void springls__cube_corner(const int cube[3], int c, int at[3])
{
    at[0] = cube[0] + (c & 1);
    at[1] = cube[1] + (c >> 1 & 1);
    at[2] = cube[2] + (c >> 2);
}

/* Returns the first corner of a cube that is of a part; 8: none. */
SPRINGLS__MATHS int springls__first_corner_of_part(const springls__part *part, const int cube[3])
{
    int c, at[3];
    for (c = 0; c < 8; c++) {
        springls__cube_corner(cube, c, at);
        if (springls__part_has(part, at)) return c;
    }
    return 8;
}

#define SPRINGLS__VOLUME_UNITS 65536.0f /* a voxel^3: sums of whole numbers are the same from whichever voxel they begin */

/* Returns six times the volume between tip and the triangles of a part's surface in a cube, VOLUME_UNITS. */
SPRINGLS__MATHS int springls__cube_volume6(const springls__grid *g, const springls__part *part, bool inside, const int cube[3],
                                           const int tip[3])
{
    const springls__mc_cell cell = springls__grid_cube(g, cube[0], cube[1], cube[2]);
    const int mask = springls__mc_case(cell), count = springls__mc_count(mask);
    springls__v3 p[3];
    int volume = 0, t, m, edge, corner, at[3];
    for (t = 0; t < count; t++) {
        for (m = 0; m < 3; m++) {
            edge = springls__mc_edge(mask, t, m);
            p[m] = springls__mc_point(cube[0] - tip[0], cube[1] - tip[1], cube[2] - tip[2], edge,
                                      springls__mc_edge_crossing(cell, edge));
        }
        corner = springls__mc_edge_corner(edge);
        if ((mask >> corner & 1) != (int)inside) corner |= 1 << springls__mc_edge_axis(edge);
        springls__cube_corner(cube, corner, at);
        if (springls__part_has(part, at))
            volume += (int)(SPRINGLS__VOLUME_UNITS * springls__dot(p[0], springls__cross(p[1], p[2])));
    }
    return volume;
}

/* Returns the volume of a part, voxel^3, between the triangles of marching cubes, as springls_components measures it. */
SPRINGLS__MATHS float springls__volume_of_part(const springls__grid *g, const springls__part *part)
{
    int i, c, volume = 0, at[3], cube[3], tip[3];
    bool inside;
    springls__part_place(part, 0, at);
    inside = springls__phi_of(g, at) < 0.0f;
    for (i = 0; i < 3; i++) tip[i] = part->lower[i];
    for (i = 0; i < part->count; i++)
        for (c = 0; c < 8; c++) {
            springls__part_place(part, i, at);
            cube[0] = at[0] - (c & 1);
            cube[1] = at[1] - (c >> 1 & 1);
            cube[2] = at[2] - (c >> 2);
            if (springls__first_corner_of_part(part, cube) == c)
                volume += springls__cube_volume6(g, part, inside, cube, tip);
        }
    return springls__fabs((float)volume) / (6.0f * SPRINGLS__VOLUME_UNITS);
}

/* Returns true when a voxel is of a part of less than min_component. */
SPRINGLS__MATHS bool springls__is_speck_voxel(const springls__grid *g, const int at[3], float min_component, int max_voxels)
{
    springls__part part;
    return springls__find_small_part(g, at, max_voxels, &part) && springls__volume_of_part(g, &part) < min_component;
}

/* Returns the value of a voxel whose part is removed: the nearest to the surface of its neighbours on the other side. */
SPRINGLS__MATHS float springls__phi_without_speck(const springls__grid *g, const int at[3])
{
    float phi = springls__phi_of(g, at), best = 0.5f;
    int d, to[3];
    for (d = 0; d < 6; d++) {
        float other;
        springls__neighbor_voxel(at, d, to);
        other = springls__phi_of(g, to);
        if ((phi < 0.0f) != (other < 0.0f)) best = springls__min(best, springls__fabs(other));
    }
    return phi < 0.0f ? best : -springls__max(best, 1e-6f);
}

/* Returns true when the part of a voxel has more than `largest` voxels, by those around it alone (mask27: topology.h). */
SPRINGLS__MATHS bool springls__is_large_part(unsigned mask27, int largest)
{
    unsigned side = mask27 >> 13 & 1u ? mask27 : ~mask27, part = 1u << 13, before = 0u, rest;
    while (part != before) {
        int count = 0;
        before = part;
        part = (springls__mask27_spread_x(before) | springls__mask27_spread_y(before) | springls__mask27_spread_z(before)) & side
             & SPRINGLS__ALL_AROUND;
        for (rest = part; rest; rest &= rest - 1u) count++;
        if (count > largest) return true;
    }
    return false;
}

/* Returns phi of voxel `at` without parts, inside or outside, of less than min_component and without punctures. beside: how many
   of its six neighbours are on its side; mask27: of the voxels around (topology.h). */
SPRINGLS__MATHS float springls__without_specks(const springls__model *model, const int at[3], float phi, float beside,
                                               unsigned mask27)
{
    const springls__grid *g = &model->grid;
    const float least = model->params.min_component, around_puncture = SPRINGLS__AROUND_PUNCTURE;
    const springls__speck_limits most = springls__speck_limits_of(least);
    if (beside <= most.beside && !springls__is_large_part(mask27, most.around)
        && springls__is_speck_voxel(g, at, least, most.in_all)) return springls__phi_without_speck(g, at);
    if (beside <= around_puncture && springls__punctures(phi, mask27) && springls__fills_puncture(g, at))
        return SPRINGLS__FILLED_PHI;
    return phi;
}

/* Copies phi of active brick i to phi_next without parts of less than min_component and without punctures. */
SPRINGLS__MATHS void springls__specks_element(const springls__model *model, springls__arguments args, int i,
                                              SPRINGLS__LOCAL float *tile)
{
    const float most = springls__max(springls__speck_limits_of(model->params.min_component).beside, SPRINGLS__AROUND_PUNCTURE);
    int row, x, o[3], at[3];
    (void)args;
    if (springls__keeps_phi(model, i)) return;
    springls__copy_brick(model, i, tile, o);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items) {
        SPRINGLS__LOCAL const float *phi = springls__tile_row(tile, row);
        uint32_t around[9];
        float beside[8];
        if (!springls__count_beside(phi, most, beside)) continue;
        springls__signs_of_rows_around(phi, around);
        for (x = 0; x < 8; x++) {
            if (beside[x] > most) continue;
            springls__row_voxel(o, row, x, at);
            springls__next_row(&model->grid, i, row)[x] =
                springls__without_specks(model, at, phi[x], beside[x], springls__mask27_of_rows(around, x));
        }
    }
}

#endif
