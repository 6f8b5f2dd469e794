/* project_brick.h - phi near the springls becomes their oriented distance (project.h), brick by brick. */
#ifndef SPRINGLS__KERNEL_STAGES_PROJECT_BRICK_H
#define SPRINGLS__KERNEL_STAGES_PROJECT_BRICK_H

#include "../model/cell_list.h"
#include "../model/fit.h"
#include "../model/grid.h"
#include "../model/model.h"
#include "../model/neighborhood.h"
#include "keep_edges.h"
#include "overlap.h"
#include "project.h"

#define SPRINGLS__FAR_AWAY 1e6f /* voxels: near no voxel */

/* Writes oriented springl i, far away when another body covers it: springls in the order of the cells, then those in no cell,
   so that those near a brick lie side by side. */
SPRINGLS__MATHS void springls__oriented_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL springls__oriented *o = springls__oriented_springls(model) + i;
    int in_cells = model->set.count - model->cells.unbinned_count;
    uint32_t n = i < in_cells ? model->cells.ids[i] : model->cells.unbinned[i - in_cells];
    springls__springl s;
    (void)args;
    if (i < in_cells && springls__is_listed_fast_asleep(model, (int)n)) return;
    s = model->set.s[n];
    o->p = s.p;
    o->n = springls__springl_normal(s);
    o->moved = springls__sub(s.p, model->set.synced_position[n]);
    o->edge = springls__at_edge(model, (int)n);
    if (!springls__is_overlapped(model, (int)n)) return;
    o->p.x = SPRINGLS__FAR_AWAY;
    o->edge = 0;
}

SPRINGLS__MATHS SPRINGLS__GLOBAL const springls__oriented *springls__all_oriented(const springls__model *model)
{
    return springls__oriented_springls(model);
}

/* Ranges of oriented springls that may be near a brick: rows of cells along x, of the brick and one cell around it, and the
   springls in no cell. */
#define SPRINGLS__NEAR_RANGES 109 /* 6 * 6 * 3 + 1 */

typedef struct springls__near_ranges {
    int first[SPRINGLS__NEAR_RANGES], end[SPRINGLS__NEAR_RANGES], count;
    int y[SPRINGLS__NEAR_RANGES], z[SPRINGLS__NEAR_RANGES]; /* of a row of cells, from the brick's first voxel */
    int rows;                                               /* ranges that are rows of cells, the first ones */
} springls__near_ranges;

SPRINGLS__MATHS void springls__near_ranges_add(springls__near_ranges *near_by, int first, int end, int y, int z)
{
    if (first == end) return;
    near_by->y[near_by->count] = y;
    near_by->z[near_by->count] = z;
    near_by->first[near_by->count] = first;
    near_by->end[near_by->count++] = end;
}

SPRINGLS__MATHS springls__near_ranges springls__near_brick(const springls__model *model, const int origin[3])
{
    const springls__grid *g = &model->grid;
    const int entry = springls__entry_at(g, origin[0], origin[1], origin[2]);
    springls__near_ranges near_by;
    int x, y, z;
    near_by.count = 0;
    for (z = -SPRINGLS__CELL; z < 8 + SPRINGLS__CELL; z += SPRINGLS__CELL)
        for (y = -SPRINGLS__CELL; y < 8 + SPRINGLS__CELL; y += SPRINGLS__CELL)
            for (x = -8; x <= 8; x += 8) {
                int bx = origin[0] + x, by = origin[1] + y, bz = origin[2] + z, first, last;
                SPRINGLS__GLOBAL const uint32_t *cell;
                if (bx < 0 || by < 0 || bz < 0 || bx >= 8 * g->bricks[0] || by >= 8 * g->bricks[1] || bz >= 8 * g->bricks[2])
                    continue;
                cell = springls__cells_of(g, g->top[springls__entry_beside(g, entry, x >> 3, y >> 3, z >> 3)]);
                first = springls__cell_in_brick(x < 0 ? 8 - SPRINGLS__CELL : 0, by, bz);
                last = springls__cell_in_brick(x > 0 ? 0 : 8 - SPRINGLS__CELL, by, bz);
                springls__near_ranges_add(&near_by, (int)cell[first], (int)cell[last + 1], y, z);
            }
    near_by.rows = near_by.count;
    springls__near_ranges_add(&near_by, model->set.count - model->cells.unbinned_count, model->set.count, 0, 0);
    return near_by;
}

/* Returns whether springls of a range may be within PROJECT_RADIUS of voxel v of the brick. */
SPRINGLS__MATHS bool springls__range_reaches(const springls__near_ranges *near_by, int r, int v)
{
    const int before = -1, behind = SPRINGLS__CELL + 1; /* voxels: from the row's first one */
    int y = (v >> 3 & 7) - near_by->y[r], z = (v >> 6) - near_by->z[r];
    return r >= near_by->rows || (y >= before && y <= behind && z >= before && z <= behind);
}

/* Returns where a row's sums begin: eight of the first member, one a voxel, then eight of the next member. */
SPRINGLS__MATHS int springls__sums_of_row(int row) { return 8 * SPRINGLS__SUM_MEMBERS * row; }

/* Takes one springl as the nearest of the voxels `first` to `last` of a row, where it is; sums: of the row; offset: from the
   particle to the row's first voxel. */
SPRINGLS__MATHS void springls__nearest_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int first,
                                           int last)
{
    const float n[3] = { s.n.x, s.n.y, s.n.z }, yz2 = offset.y * offset.y + offset.z * offset.z;
    int i, k;
    for (i = first; i <= last; i += SPRINGLS__LANES) {
        SPRINGLS__LOCAL float *nearest2 = sums + 8 * SPRINGLS__NEAREST2 + i;
        springls__vec x = offset.x + springls__vec_from(i), d2 = x * x + yz2, best = springls__vec_load(nearest2);
        springls__vmask nearer = d2 < best;
        springls__vec_store(nearest2, springls__vec_select(nearer, d2, best));
        for (k = 0; k < 3; k++) {
            SPRINGLS__LOCAL float *facing = sums + 8 * (SPRINGLS__FACING + k) + i;
            springls__vec_store(facing, springls__vec_select(nearer, springls__vec_broadcast(n[k]), springls__vec_load(facing)));
        }
    }
}

SPRINGLS__VEC_MATHS void springls__sum_add(SPRINGLS__LOCAL float *sums, int member, int i, springls__vec value)
{
    SPRINGLS__LOCAL float *at = sums + 8 * member + i;
    springls__vec_store(at, springls__vec_load(at) + value);
}

/* Returns the weights of a springl at voxels of a row, 0 if the nearest springl does not face about the same way: there it is of
   another sheet, which is noted in *opposed when it faces against. sums: of the voxels. */
SPRINGLS__VEC_MATHS springls__vec springls__same_sheet_weight(springls__vec weight, springls__v3 n,
                                                              SPRINGLS__LOCAL const float *sums,
                                                              SPRINGLS__GLOBAL uint8_t *opposed)
{
    springls__vec along = springls__vec_load(sums + 8 * SPRINGLS__FACING) * n.x
                        + springls__vec_load(sums + 8 * (SPRINGLS__FACING + 1)) * n.y
                        + springls__vec_load(sums + 8 * (SPRINGLS__FACING + 2)) * n.z;
    if (springls__vec_any((along < SPRINGLS__FACING_AGAINST) & (weight > 0.0f))) SPRINGLS__MARK(opposed, 1);
    return springls__vec_select(along > SPRINGLS__SAME_SHEET, weight, springls__vec_broadcast(0.0f));
}

/* Adds one springl to the moments of the voxels `first` to `last` of a row, where it is of their sheet. */
SPRINGLS__MATHS void springls__moments_row(springls__oriented s, springls__v3 offset, SPRINGLS__LOCAL float *sums, int first,
                                           int last, bool one_sheet, SPRINGLS__GLOBAL uint8_t *opposed)
{
    float yz2 = offset.y * offset.y + offset.z * offset.z, yz = s.n.y * offset.y + s.n.z * offset.z;
    int i;
    for (i = first; i <= last; i += SPRINGLS__LANES) {
        springls__vec x = offset.x + springls__vec_from(i), w = springls__vec_project_weight(x * x + yz2);
        if (!one_sheet) w = springls__same_sheet_weight(w, s.n, sums + i, opposed);
        springls__sum_add(sums, SPRINGLS__SUM_WEIGHT, i, w);
        springls__sum_add(sums, SPRINGLS__SUM_HEIGHT, i, w * (s.n.x * x + yz));
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET, i, x * w);
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET + 1, i, offset.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_OFFSET + 2, i, offset.z * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL, i, s.n.x * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL + 1, i, s.n.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_NORMAL + 2, i, s.n.z * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED, i, s.moved.x * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED + 1, i, s.moved.y * w);
        springls__sum_add(sums, SPRINGLS__SUM_MOVED + 2, i, s.moved.z * w);
    }
}

/* Returns whether a place, counted from a brick's first voxel, comes near one of the brick's along one axis. */
SPRINGLS__MATHS bool springls__near_axis(float x) { return x > -SPRINGLS__PROJECT_RADIUS && x < 7.0f + SPRINGLS__PROJECT_RADIUS; }

/* Returns the first voxel of the brick within `radius` of such a place along one axis. */
SPRINGLS__MATHS int springls__first_near(float x, float radius) { return (int)springls__max(x - radius + 1.0f, 0.0f); }

/* Returns the last voxel of the brick within `radius` of such a place along one axis. */
SPRINGLS__MATHS int springls__last_near(float x, float radius) { return (int)springls__min(x + radius, 7.0f); }

/* What springls__take_into_rows does with a springl. */
#define SPRINGLS__TAKE_NEAREST 0   /* makes it the nearest springl of the voxels that have no nearer one */
#define SPRINGLS__TAKE_SUMS 1      /* adds it to the sums of the voxels of its sheet */
#define SPRINGLS__TAKE_ONE_SHEET 2 /* adds it to the sums of all: the springls near the brick are of one sheet */

/* The sums of a brick while springls are taken into them. */
typedef struct springls__brick_sums {
    SPRINGLS__LOCAL float *value;     /* SUMS_FLOATS; those of rows that no springl has reached are not set */
    SPRINGLS__GLOBAL uint8_t *opposed; /* whether springls near one voxel face against each other */
    uint8_t reached[SPRINGLS__ROWS];  /* of a row: 1 when springls are near */
} springls__brick_sums;

/* Sets the sums of a row to none and its nearest springl to none, if no springl has reached it before. */
SPRINGLS__MATHS void springls__reach_row(springls__brick_sums *sums, int row)
{
    const float farthest2 = SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS;
    SPRINGLS__LOCAL float *value = sums->value + springls__sums_of_row(row);
    int i;
    if (sums->reached[row]) return;
    sums->reached[row] = 1;
    for (i = 0; i < 8 * SPRINGLS__SUM_MEMBERS; i++) value[i] = 0.0f;
    for (i = 0; i < 8; i++) value[8 * SPRINGLS__NEAREST2 + i] = farthest2;
}

/* Takes a springl into the rows of a brick that are near it. It is near at most four voxels of a row. */
SPRINGLS__MATHS void springls__take_into_rows(const springls__oriented s, const int origin[3], springls__group group, int take,
                                              springls__brick_sums *sums)
{
    const float radius = SPRINGLS__PROJECT_RADIUS;
    springls__v3 p = springls__v3_make(s.p.x - (float)origin[0], s.p.y - (float)origin[1], s.p.z - (float)origin[2]), offset;
    int first, last, y, y0, y1, z, z0, z1;
    if (!springls__near_axis(p.x) || !springls__near_axis(p.y) || !springls__near_axis(p.z)) return;
    first = springls__imin(springls__first_near(p.x, radius), 8 - SPRINGLS__LANES);
    last = springls__last_near(p.x, radius);
    y0 = springls__first_near(p.y, radius);
    y1 = springls__last_near(p.y, radius);
    z0 = springls__first_near(p.z, radius);
    z1 = springls__last_near(p.z, radius);
    if (group.items == SPRINGLS__ROWS) { /* an item has one row, and passes over no other: Mesa ends loops after 65,535 rounds in all */
        y0 = springls__imax(y0, group.item & 7);
        y1 = springls__imin(y1, group.item & 7);
        z0 = springls__imax(z0, group.item >> 3);
        z1 = springls__imin(z1, group.item >> 3);
    }
    offset.x = -p.x;
    for (z = z0; z <= z1; z++) {
        offset.z = (float)z - p.z;
        for (y = y0; y <= y1; y++) {
            SPRINGLS__LOCAL float *row = sums->value + springls__sums_of_row(y + 8 * z);
            offset.y = (float)y - p.y;
            if (!springls__is_mine(group, y + 8 * z)) continue;
            springls__reach_row(sums, y + 8 * z);
            if (take == SPRINGLS__TAKE_NEAREST) springls__nearest_row(s, offset, row, first, last);
            else springls__moments_row(s, offset, row, first, last, take == SPRINGLS__TAKE_ONE_SHEET, sums->opposed);
        }
    }
}

/* Returns whether the springls near a brick are all of one sheet, whatever the voxel. */
SPRINGLS__MATHS bool springls__are_one_sheet(const springls__model *model, const springls__near_ranges *near_by)
{
    const float along = 0.84f; /* two directions this close to a third differ by less than SAME_SHEET permits */
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f);
    int r, k;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) sum = springls__add(sum, oriented[k].n);
    sum = springls__normalize(sum);
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++)
            if (!(springls__dot(sum, oriented[k].n) > along)) return false;
    return true;
}

/* Finds the nearest springl of every voxel, where they are not all of one sheet, then sums over those that face the same way. */
SPRINGLS__MATHS void springls__brick_sums_take(const springls__model *model, const springls__near_ranges *near_by,
                                               const int origin[3], springls__brick_sums *sums)
{
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    bool one_sheet = springls__are_one_sheet(model, near_by);
    int last = one_sheet ? SPRINGLS__TAKE_ONE_SHEET : SPRINGLS__TAKE_SUMS, take, r, k;
    for (take = one_sheet ? SPRINGLS__TAKE_ONE_SHEET : SPRINGLS__TAKE_NEAREST; take <= last; take++)
        for (r = 0; r < near_by->count; r++)
            for (k = near_by->first[r]; k < near_by->end[r]; k++)
                springls__take_into_rows(oriented[k], origin, model->group, take, sums);
}

/* Returns the box of the places that springls at an edge may be near; empty if there are none. */
SPRINGLS__MATHS springls__box springls__edge_box_of(const springls__model *model, const springls__near_ranges *near_by)
{
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    springls__box box = springls__box_empty();
    int r, k;
    if (!model->params.keep_edges || model->set.at_edges == 0) return box;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++)
            if (oriented[k].edge) box = springls__box_add(box, oriented[k].p);
    return springls__box_widened(box, SPRINGLS__PROJECT_RADIUS);
}

/* Returns a weight that falls from 1 at x to 0 at PROJECT_RADIUS, and is negative beyond. */
SPRINGLS__MATHS float springls__edge_weight(springls__v3 p, springls__v3 x)
{
    const float radius2 = SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS;
    return 1.0f - springls__length2(springls__sub(p, x)) / radius2;
}

/* Returns whether a springl at an edge is near voxel v of the brick, at x. */
SPRINGLS__MATHS bool springls__voxel_near_edge(const springls__model *model, const springls__near_ranges *near_by, int v,
                                               springls__v3 x)
{
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    int r, k;
    for (r = 0; r < near_by->count; r++) {
        if (!springls__range_reaches(near_by, r, v)) continue;
        for (k = near_by->first[r]; k < near_by->end[r]; k++)
            if (oriented[k].edge && springls__edge_weight(oriented[k].p, x) > 0.0f) return true;
    }
    return false;
}

/* Returns the height of voxel v of the brick, at x, over the sides of the crease that springls about it lie at; weight 0 if
   there is none. */
SPRINGLS__MATHS springls__estimate springls__height_at_edge(const springls__model *model, const springls__near_ranges *near_by,
                                                            int v, springls__v3 x)
{
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    springls__sample_set samples;
    springls__estimate none;
    int r, k;
    none.weight = none.distance = 0.0f;
    if (!springls__voxel_near_edge(model, near_by, v, x)) return none;
    samples.count = 0;
    for (r = 0; r < near_by->count; r++) {
        if (!springls__range_reaches(near_by, r, v)) continue;
        for (k = near_by->first[r]; k < near_by->end[r]; k++) {
            SPRINGLS__GLOBAL const springls__oriented *s = &oriented[k];
            float weight = springls__edge_weight(s->p, x);
            if (weight > 0.0f) springls__sample_set_add(&samples, s->p, s->n, s->p, weight * weight, k);
        }
    }
    return springls__edge_distance(&samples, model->grid.metric, x);
}

/* Returns whether some springl faces against the mean normal of the sums at voxel x and has x on the same side as they have:
   behind it (side 1, x lies in a sheet) or before it (side -1, x lies in a gap). */
SPRINGLS__MATHS bool springls__between_sides(const springls__model *model, const springls__near_ranges *near_by, springls__v3 x,
                                             springls__v3 normal, float side)
{
    SPRINGLS__GLOBAL const springls__oriented *oriented = springls__all_oriented(model);
    int r, k;
    for (r = 0; r < near_by->count; r++)
        for (k = near_by->first[r]; k < near_by->end[r]; k++) {
            SPRINGLS__GLOBAL const springls__oriented *s = &oriented[k];
            springls__v3 d = springls__sub(x, s->p);
            if (springls__length2(d) >= SPRINGLS__PROJECT_RADIUS * SPRINGLS__PROJECT_RADIUS) continue;
            if (springls__dot(s->n, normal) >= SPRINGLS__FACING_AGAINST) continue;
            if (springls__votes_inside(d, springls__scale(s->n, side), SPRINGLS__PROJECT_RADIUS, 0.6f)) return true;
        }
    return false;
}

#define SPRINGLS__BESIDE_ZERO 1.2f /* voxels: none beyond it is next to the zero level */

/* Returns phi at a voxel that the surface may have passed and no springl is near: on its side of two bodies (0: they are not near),
   else as it was where it lies deep, or with the mark of an unknown side. */
SPRINGLS__MATHS float springls__passed_phi(const springls__model *model, int side, float phi, float max_displacement)
{
    if (side != 0 && (side < 0) == (phi < 0.0f)) return phi;
    if (side != 0) return (float)side * SPRINGLS__PROJECT_RADIUS;
    return springls__fabs(phi) < max_displacement ? springls__side_unknown(phi, model->grid.far_value) : phi;
}

/* Returns phi at voxel v of the brick. Where springls are near, which have carried `phi` there: their distance, on the other side
   where phi has lost a sheet or gap thinner than a voxel and v lies between its two sides; a thread may break. passed: none is near.
   sums: of the voxel. The side of bodies is found in one place: a compiler that inlines all doubles the kernel otherwise. */
SPRINGLS__MATHS float springls__project_voxel(const springls__model *model, const springls__near_ranges *near_by,
                                              const int origin[3], int v, bool passed, SPRINGLS__LOCAL const float *sums,
                                              springls__arguments args, springls__box edges, float phi)
{
    const float max_displacement = args.project.max_displacement;
    springls__v3 x = springls__voxel_place(origin, v);
    springls__projection f;
    springls__estimate edge;
    int side = 0;
    f.distance = f.trust = edge.weight = edge.distance = 0.0f;
    if (!passed) {
        springls__moments sum = springls__moments_load(sums);
        f = springls__moments_distance(sum);
        if (springls__fabs(phi) < SPRINGLS__BESIDE_ZERO && springls__box_contains(edges, x))
            edge = springls__height_at_edge(model, near_by, v, x);
        if (edge.weight > 0.0f && springls__is_of_edge(phi, edge.distance))
            return springls__on_known_side(edge.distance, phi);
        if (model->params.nucleate && springls__can_nucleate(phi, f)
            && springls__between_sides(model, near_by, x, springls__normalize(sum.normal), phi < 0.0f ? -1.0f : 1.0f)
            && springls__in_sheet(model, x, springls__normalize(sum.normal)))
            return f.distance;
    }
    if (passed || springls__other_side(f.distance, phi)) side = springls__side_of_bodies(model, x, max_displacement);
    if (passed) return springls__passed_phi(model, side, phi, max_displacement);
    if (side != 0 && (side < 0) == (f.distance < 0.0f)) return f.distance;
    return edge.weight > 0.0f ? phi : springls__on_known_side(springls__corrected_phi(phi, f), phi);
}

/* Returns where voxels, SPRINGLS__LANES of a row from number `first` on, may need springls__project_voxel: elsewhere only the sums
   count. */
SPRINGLS__VEC_MATHS springls__vmask springls__needs_project_voxel(const springls__model *model, const int origin[3], int first,
                                                                  springls__box edges, springls__vec phi,
                                                                  springls__vec_projection f)
{
    springls__v3 x = springls__voxel_place(origin, first);
    springls__vec along_x = x.x + springls__vec_from(0);
    springls__vmask needed = phi < phi; /* nowhere */
    if (model->params.contact == SPRINGLS_CONTACT_SEPARATE) needed = springls__vec_other_side(f.distance, phi);
    if (model->params.nucleate) needed = needed | springls__vec_can_nucleate(phi, f);
    if (x.y >= edges.lower.y && x.y <= edges.upper.y && x.z >= edges.lower.z && x.z <= edges.upper.z)
        needed = needed | ((springls__vec_fabs(phi) < SPRINGLS__BESIDE_ZERO) & (along_x >= edges.lower.x)
                           & (along_x <= edges.upper.x));
    return needed;
}

/* Carries phi of a row along with the springls near its voxels: takes it from the places that they have come from. */
SPRINGLS__MATHS void springls__carry_row(const springls__grid *g, const int origin[3], int row,
                                         SPRINGLS__LOCAL const float *sums, float phi[8])
{
    const float y = (float)(row & 7), z = (float)(row >> 3);
    float from[3][8];
    uint32_t carried = 0u;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec_moments sum = springls__vec_moments_load(sums + i);
        springls__vec back = -1.0f / sum.weight;
        carried |= springls__vec_bits(sum.weight > SPRINGLS__MIN_WEIGHT) << i;
        springls__vec_store(from[0] + i, springls__vec_from(i) + sum.moved.x * back);
        springls__vec_store(from[1] + i, y + sum.moved.y * back);
        springls__vec_store(from[2] + i, z + sum.moved.z * back);
    }
    for (; carried; carried &= carried - 1u) {
        i = springls__lowest_bit(carried);
        phi[i] = springls__grid_sample_from(g, g->phi, origin, springls__v3_make(from[0][i], from[1][i], from[2][i]));
    }
}

/* Makes phi of a row's voxels exact where springls are near; returns a bit for each that needs springls__project_voxel instead. */
SPRINGLS__MATHS uint32_t springls__correct_row(const springls__model *model, const int origin[3], int row,
                                               SPRINGLS__LOCAL const float *sums, springls__box edges, float phi[8])
{
    uint32_t needed = 0u;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec_moments sum = springls__vec_moments_load(sums + i);
        springls__vec old = springls__vec_load(phi + i), exact;
        springls__vec_projection f = springls__vec_moments_distance(sum);
        springls__vmask counts = sum.weight > SPRINGLS__MIN_WEIGHT;
        springls__vmask needs = counts & springls__needs_project_voxel(model, origin, 8 * row + i, edges, old, f);
        needed |= springls__vec_bits(needs) << i;
        exact = springls__vec_on_known_side(springls__vec_corrected_phi(old, f), old);
        springls__vec_store(phi + i, springls__vec_select(counts & springls__vec_not(needs), exact, old));
    }
    return needed;
}

/* Returns a bit for each voxel of a row that the surface may have passed and no springl is near. Where bodies overlap phi is that of
   their union, and does not bound how deep a voxel lies in the gap that opens when they part. sums: of the row, if a springl has
   reached it. */
SPRINGLS__MATHS uint32_t springls__passed_voxels(const springls__model *model, SPRINGLS__GLOBAL const float *phi, bool reached,
                                                 SPRINGLS__LOCAL const float *sums, float max_displacement)
{
    const bool in_gaps = model->params.contact == SPRINGLS_CONTACT_SEPARATE && max_displacement > SPRINGLS__PROJECT_RADIUS;
    uint32_t bits = 0u;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec value = springls__vec_load(phi + i);
        springls__vmask passed = springls__vec_fabs(value) < max_displacement;
        if (in_gaps) passed = passed | (value < 0.0f);
        if (reached)
            passed = passed & springls__vec_not(springls__vec_load(sums + 8 * SPRINGLS__SUM_WEIGHT + i) > SPRINGLS__MIN_WEIGHT);
        bits |= springls__vec_bits(passed) << i;
    }
    return bits;
}

/* Projects a row of a brick, from phi to out, by its sums, if a springl has reached it; returns whether the side of a voxel is
   unknown. */
SPRINGLS__MATHS bool springls__project_row(const springls__model *model, const springls__near_ranges *near_by,
                                           const int origin[3], int row, bool reached,
                                           SPRINGLS__LOCAL const float *sums, springls__arguments args, springls__box edges,
                                           SPRINGLS__GLOBAL const float *phi, SPRINGLS__GLOBAL float *out)
{
    const bool carry = args.project.carry != 0;
    const uint32_t passed = carry ? springls__passed_voxels(model, phi, reached, sums, args.project.max_displacement) : 0u;
    uint32_t alone = passed; /* voxels that are found one by one: a loop over all eight would be unrolled, at eight times the code */
    bool unknown = false;
    float value[8];
    int i;
    if (!reached && !passed) {
        springls__copy_voxel_row(phi, out);
        return false;
    }
    for (i = 0; i < 8; i += SPRINGLS__LANES) springls__vec_store(value + i, springls__vec_load(phi + i));
    if (reached && carry) springls__carry_row(&model->grid, origin, row, sums, value);
    if (reached && model->params.project_level_set) alone |= springls__correct_row(model, origin, row, sums, edges, value);
    for (; alone; alone &= alone - 1u) {
        i = springls__lowest_bit(alone);
        value[i] = springls__project_voxel(model, near_by, origin, 8 * row + i, passed >> i & 1u, sums + i, args, edges, value[i]);
        unknown = unknown || ((passed >> i & 1u) && springls__fabs(value[i]) > model->grid.far_value);
    }
    for (i = 0; i < 8; i += SPRINGLS__LANES) springls__vec_store(out + i, springls__vec_load(value + i));
    return unknown;
}

/* In has_opposed: the brick is asleep, and was not searched. */
#define SPRINGLS__OPPOSED_ASLEEP 2

/* Projects active brick i, from phi to phi_next; with args.project.carry springls carry phi along. Finds whether it has voxels whose
   side is unknown, and voxels near springls that face against each other, as in a thin sheet or gap. */
SPRINGLS__MATHS void springls__project_element(const springls__model *model, springls__arguments args, int i,
                                               SPRINGLS__LOCAL float *memory)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL float *out = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL uint8_t *side_unknown = springls__has_unknown_side(model) + i;
    bool some;
    springls__brick_sums sums;
    springls__near_ranges near_by;
    springls__box edges;
    int row, o[3];
    sums.value = memory;
    sums.opposed = springls__has_opposed(model) + i;
    springls__slot_origin(g, g->active[i], o);
    if (model->group.item == 0) {
        *side_unknown = 0;
        *sums.opposed = springls__keeps_phi(model, i) ? SPRINGLS__OPPOSED_ASLEEP : 0;
    }
    if (springls__keeps_phi(model, i)) return;
    SPRINGLS__BARRIER; /* both are cleared before an item sets one */
    near_by = springls__near_brick(model, o);
    some = near_by.count > 0;
    edges = springls__edge_box_of(model, &near_by);
    for (row = 0; row < SPRINGLS__ROWS; row++) sums.reached[row] = 0;
    if (some) springls__brick_sums_take(model, &near_by, o, &sums);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items) {
        SPRINGLS__LOCAL const float *of_row = sums.value + springls__sums_of_row(row);
        if (springls__project_row(model, &near_by, o, row, sums.reached[row], of_row, args, edges, phi + 8 * row,
                                  out + 8 * row))
            SPRINGLS__MARK(side_unknown, 1);
    }
}

/* Resolves the unknown sides of a row of eight voxels; phi points into a tile. The last time none stays unknown. */
SPRINGLS__MATHS void springls__resolve_side_row(SPRINGLS__LOCAL const float *phi, float far_value, float min_sum, bool last,
                                                SPRINGLS__GLOBAL float *out)
{
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec c = springls__vec_load(phi + i);
        springls__vmask unknown = springls__is_side_unknown(c, far_value);
        if (springls__vec_any(unknown)) {
            c = springls__vec_select(unknown, springls__resolved_side(springls__tile_cross(phi + i), far_value, min_sum), c);
            if (last) c = springls__restored_side(c, far_value);
        }
        springls__vec_store(out + i, c);
    }
}

/* Resolves unknown sides in active brick i, from phi_next to omega: voxels take the side of their neighbors. */
SPRINGLS__MATHS void springls__resolve_sides_element(const springls__model *model, springls__arguments args, int i,
                                                     SPRINGLS__LOCAL float *tile)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const float *from = g->phi_next + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL float *out = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    bool some_unknown = springls__has_unknown_side(model)[i] != 0;
    int row;
    if (!some_unknown && !args.resolve.first) return;
    if (some_unknown) springls__load_tile(g, g->phi_next, g->active[i], model->group, tile);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items) {
        if (some_unknown)
            springls__resolve_side_row(tile + springls__tile_index(0, row & 7, row >> 3), g->far_value, args.resolve.min_sum,
                                       args.resolve.last != 0, out + 8 * row);
        else
            springls__copy_voxel_row(from + 8 * row, out + 8 * row);
    }
}

#endif
