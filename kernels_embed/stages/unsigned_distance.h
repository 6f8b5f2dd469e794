/* unsigned_distance.h - the unsigned level set: distance to a springl's triangle (eq. 21). */
#ifndef SPRINGLS__KERNEL_STAGES_UNSIGNED_DISTANCE_H
#define SPRINGLS__KERNEL_STAGES_UNSIGNED_DISTANCE_H

#include "../model/grid.h"
#include "../model/model.h"

/* Lowers row[i] to the distance from (x + i, y, z) to the springl of the plan, eight voxels, where its bounding sphere, of this
   center and radius, comes closer than row[i]. */
SPRINGLS__MATHS void springls__omega_row(const springls__tri_plan *plan, springls__v3 center, float radius, int x, int y, int z,
                                         SPRINGLS__GLOBAL float *row)
{
    springls__vec3 at = springls__vec_broadcast3(springls__v3_make((float)x, (float)y, (float)z)), d;
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec best = springls__vec_load(row + i), within = best + radius;
        at.x = (float)x + springls__vec_from(i);
        d = springls__vec_sub(at, springls__vec_broadcast3(center));
        if (!springls__vec_any(springls__vec_length2(d) < within * within)) continue;
        best = springls__vec_min(best, springls__vec_sqrt(springls__vec_tri_distance2(plan, at)));
        springls__vec_store(row + i, best);
    }
}

/* Returns whether omega of a brick is unknown, because the brick is new or springls have moved: its first voxel is below zero. */
SPRINGLS__MATHS bool springls__omega_unknown(const springls__grid *g, int slot)
{
    return g->omega[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f;
}

/* Lowers omega of a brick, whose first voxel is `origin`, to the distance to springl s, up to params.capture_range. */
SPRINGLS__MATHS void springls__omega_of_springl(const springls__model *model, SPRINGLS__GLOBAL const springls__springl *s,
                                                const int origin[3], SPRINGLS__GLOBAL float *omega)
{
    const float radius = s->bounding_radius * 1.0001f + 1e-3f; /* no rounding may exclude a springl that is nearer */
    const springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(*s));
    const springls__box box = springls__box_around(*s, model->params.capture_range);
    const springls__v3 first = springls__voxel_place(origin, 0);
    const springls__row_range rows = springls__rows_between(springls__sub(box.lower, first), springls__sub(box.upper, first));
    int y, z;
    for (z = rows.z0; z <= rows.z1; z++)
        for (y = rows.y0; y <= rows.y1; y++)
            if (springls__is_mine(model->group, y + 8 * z))
                springls__omega_row(&plan, s->p, radius, origin[0], origin[1] + y, origin[2] + z, omega + 8 * y + 64 * z);
}

/* Finds omega in active brick i where it is unknown: the exact distance to the springls, clamped at params.capture_range. */
SPRINGLS__MATHS void springls__omega_element(const springls__model *model, springls__arguments args, int i,
                                             SPRINGLS__LOCAL float *memory)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    bool unknown = springls__omega_unknown(g, g->active[i]);
    int origin[3], row, v;
    uint32_t k;
    (void)args;
    (void)memory;
    SPRINGLS__BARRIER; /* all items have read it before one writes omega */
    if (!unknown) return;
    springls__slot_origin(g, g->active[i], origin);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        for (v = 8 * row; v < 8 * row + 8; v++) omega[v] = model->params.capture_range;
    for (k = model->cells.brick_list_first[i]; k < model->cells.brick_list_first[i + 1]; k++) {
        int n = (int)model->cells.brick_list_ids[k];
        if (!springls__is_overlapped(model, n)) springls__omega_of_springl(model, &model->set.s[n], origin, omega);
    }
}

/* Sets omega at voxel i of the two constant bricks. */
SPRINGLS__MATHS void springls__omega_constant_element(const springls__model *model, springls__arguments args, int i)
{
    bool inside = i / SPRINGLS__BRICK_VOXELS == SPRINGLS__INSIDE;
    model->grid.omega[i] = inside ? args.omega_constant.inside : args.omega_constant.outside;
}

/* Finds whether omega is unknown in active brick i; args.omega_forget.all makes it so. */
SPRINGLS__MATHS void springls__omega_forget_element(const springls__model *model, springls__arguments args, int i)
{
    int slot = model->grid.active[i];
    if (args.omega_forget.all) model->grid.omega[(size_t)slot * SPRINGLS__BRICK_VOXELS] = -1.0f;
    springls__omega_missing(model)[i] = springls__omega_unknown(&model->grid, slot) ? 1 : 0;
}

#endif
