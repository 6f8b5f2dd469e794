/* fill_gaps.h - springls for exposed zero crossings of the signed level set (section 4.4). */
#ifndef SPRINGLS__KERNEL_STAGES_FILL_GAPS_H
#define SPRINGLS__KERNEL_STAGES_FILL_GAPS_H

#include "../model/cell_list.h"
#include "../model/error_estimates.h"
#include "../model/fit.h"
#include "../model/grid.h"
#include "../model/marching_cubes.h"
#include "../model/model.h"
#include "track.h"

/* Returns the square of the distance from x to springl s, FLT_MAX where it is certainly more than `within`. */
SPRINGLS__MATHS float springls__distance2_to_springl(SPRINGLS__GLOBAL const springls__springl *s, springls__v3 x, float within)
{
    springls__tri_plan plan;
    within += s->bounding_radius;
    if (springls__length2(springls__sub(s->p, x)) > within * within) return FLT_MAX;
    plan = springls__tri_plan_make(springls__springl_tri(*s));
    return springls__tri_distance2(&plan, x);
}

/* Returns true when no springl covers place x of the zero level, facing n: none comes within `covered` or, beside a thin sheet,
   within `covered_on_sheets`. Near thin sheets the zero level moves with the few voxels that happen to lie inside. Looks at the
   springls right beside x first, which cover most places. */
SPRINGLS__MATHS bool springls__is_exposed(const springls__model *model, springls__v3 x, springls__v3 n,
                                          springls__exposure_arguments distance)
{
    const float covered = distance.covered, r = springls__max(distance.covered_on_sheets, covered);
    springls__cell_walk walk = springls__cell_walk_near(model, x, covered);
    float nearest2 = FLT_MAX;
    bool sheet = false;
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__distance2_to_springl(&model->set.s[i], x, covered) <= covered * covered) return false;
    walk = springls__cell_walk_around(model, x, r);
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        float d2 = springls__distance2_to_springl(&model->set.s[i], x, r);
        if (d2 == FLT_MAX) continue;
        nearest2 = springls__min(nearest2, d2);
        if (nearest2 <= covered * covered) return false;
        sheet = sheet || springls__dot(springls__springl_normal(model->set.s[i]), n) < -0.5f;
    }
    return sheet ? nearest2 > r * r : nearest2 > covered * covered;
}

#define SPRINGLS__CUBES 729 /* of marching cubes, a brick: 9 x 9 x 9 */

/* Returns the exposed triangles of a cube: bit k for the k-th one. */
SPRINGLS__MATHS uint32_t springls__exposed_triangles(const springls__model *model, const springls__cube_range *range,
                                                     springls__mc_cell cell, int x, int y, int z,
                                                     springls__exposure_arguments distance)
{
    const int mask = springls__mc_case(cell), count = springls__mc_count(mask);
    uint32_t bits = 0u;
    int k;
    for (k = 0; k < count; k++) {
        springls__tri t = springls__cube_triangle(range, cell, mask, x, y, z, k);
        if (springls__is_exposed(model, springls__tri_centroid(t), springls__tri_normal(t), distance)) bits |= 1u << k;
    }
    return bits;
}

/* Finds the exposed triangles of active brick i, and how many they are. */
SPRINGLS__MATHS void springls__exposure_element(const springls__model *model, springls__arguments args, int i,
                                                SPRINGLS__LOCAL float *tile)
{
    SPRINGLS__GLOBAL uint8_t *exposed = springls__exposed(model) + (size_t)i * SPRINGLS__CUBES;
    SPRINGLS__GLOBAL uint32_t *total = springls__exposed_count(model) + i;
    springls__cube_range range = springls__brick_cubes(&model->grid, model->grid.active[i]);
    int x, y, z, row;
    if (model->group.item == 0) *total = 0u;
    if (springls__is_brick_asleep(&model->grid, i)) {
        for (row = model->group.item; row < 81; row += model->group.items)
            for (x = 0; x < 9; x++) exposed[9 * row + x] = 0;
        return;
    }
    springls__load_tile(&model->grid, model->grid.phi, model->grid.active[i], model->group, tile);
    for (row = model->group.item; row < 81; row += model->group.items) {
        for (x = 0; x < 9; x++) exposed[9 * row + x] = 0;
        y = row % 9 - 1;
        z = row / 9 - 1;
        if (y < range.lo[1] || y > range.hi[1] || z < range.lo[2] || z > range.hi[2]) continue;
        for (x = range.lo[0]; x <= range.hi[0]; x++) {
            springls__mc_cell cell = springls__tile_cube(tile, x, y, z);
            uint32_t bits = springls__exposed_triangles(model, &range, cell, x, y, z, args.exposure);
            exposed[9 * row + x + 1] = (uint8_t)bits;
            for (; bits; bits &= bits - 1u) SPRINGLS__NEXT(total);
        }
    }
}

/* Turns the exposed triangles of active brick i into springls; their correspondences are their own places. */
SPRINGLS__MATHS void springls__fill_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint8_t *exposed = springls__exposed(model) + (size_t)i * SPRINGLS__CUBES;
    int at = (int)springls__exposed_count(model)[i], cube, k;
    springls__cube_range range = springls__brick_cubes(&model->grid, model->grid.active[i]);
    for (cube = 0; cube < SPRINGLS__CUBES; cube++) {
        int x = cube % 9 - 1, y = cube / 9 % 9 - 1, z = cube / 81 - 1;
        springls__mc_cell cell;
        if (!exposed[cube]) continue;
        cell = springls__grid_cube(&model->grid, range.origin[0] + x, range.origin[1] + y, range.origin[2] + z);
        for (k = 0; k < 8; k++) {
            springls__tri t;
            springls__v3 p;
            if (!(exposed[cube] >> k & 1)) continue;
            if (at >= args.insert.count) return;
            t = springls__cube_triangle(&range, cell, springls__mc_case(cell), x, y, z, k);
            p = springls__tri_centroid(t);
            springls__springl_add(model, model->set.count + at++, springls__springl_make(t, p), p, 1u, 0);
        }
    }
}

/* Fits the i-th new springl: finds its correspondence and, by the quadratic rule, its place. */
SPRINGLS__MATHS void springls__fit_new_springls_element(const springls__model *model, springls__arguments args, int i)
{
    int first = args.fit.first, n = first + i, beside;
    springls__springl s = model->set.s[n];
    springls__v3 a = springls__correspondence_of_neighbors(model, s, first, &beside);
    if (beside >= 0) springls__inherit_components(model, n, beside);
    if (model->params.placement == SPRINGLS_PLACEMENT_QUADRATIC) {
        springls__fit_result fit = springls__fit_at(model, n, s.p, springls__springl_normal(s), a, first);
        if (fit.ok) {
            s = springls__moved_to(s, fit.point);
            a = fit.a;
        }
    }
    model->set.s[n] = springls__springl_finished(s);
    model->set.a[n] = springls__project_on_original(model, a);
    model->set.error[n] = springls__error_at_birth(model, s.p, springls__springl_normal(s), model->set.a[n], first);
    model->set.synced_position[n] = s.p;
}

#endif
