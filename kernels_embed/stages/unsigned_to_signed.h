/* unsigned_to_signed.h - the level set from springls alone (section 4.5): the background grows from the border, coarse to fine,
   through bricks and then voxels; then voxels near springls get the side of the nearest ones. */
#ifndef SPRINGLS__KERNEL_STAGES_UNSIGNED_TO_SIGNED_H
#define SPRINGLS__KERNEL_STAGES_UNSIGNED_TO_SIGNED_H

#include "../model/grid.h"
#include "../model/model.h"
#include "unsigned_distance.h"

/* Blocks closer than this to a springl stop the background. */
#define SPRINGLS__SHELL 1.5f

/* States of a brick. */
#define SPRINGLS__OPEN 0
#define SPRINGLS__BLOCKED 1
#define SPRINGLS__BACKGROUND 2

/* Finds whether the brick of entry i is blocked: a voxel of it is closer than SHELL to a springl. */
SPRINGLS__MATHS void springls__brick_state_element(const springls__model *model, springls__arguments args, int i,
                                                   SPRINGLS__LOCAL float *nearest)
{
    const springls__grid *g = &model->grid;
    const springls__group group = model->group;
    SPRINGLS__GLOBAL const float *omega = g->omega + (size_t)g->top[i] * SPRINGLS__BRICK_VOXELS;
    float least = FLT_MAX;
    int row, v;
    (void)args;
    for (row = group.item; row < SPRINGLS__ROWS && g->top[i] >= SPRINGLS__FIRST_SLOT; row += group.items)
        for (v = 8 * row; v < 8 * row + 8; v++) least = springls__min(least, omega[v]);
    SPRINGLS__BARRIER;
    nearest[group.item] = least;
    SPRINGLS__BARRIER;
    for (v = 0; v < group.items; v++) least = springls__min(least, nearest[v]);
    if (group.item == 0)
        springls__brick_state(model)[i] = least <= SPRINGLS__SHELL ? SPRINGLS__BLOCKED : SPRINGLS__OPEN;
}

/* Adds a block of step^3 entries to the background; false when one of them is blocked. */
SPRINGLS__MATHS bool springls__take_block(const springls__table *t, SPRINGLS__GLOBAL uint8_t *state, const int at[3], int step)
{
    int hi[3], x, y, z, axis;
    for (axis = 0; axis < 3; axis++) hi[axis] = springls__imin(at[axis] + step, t->bricks[axis]);
    for (z = at[2]; z < hi[2]; z++)
        for (y = at[1]; y < hi[1]; y++)
            for (x = at[0]; x < hi[0]; x++)
                if (state[x + t->bricks[0] * (y + t->bricks[1] * z)] == SPRINGLS__BLOCKED) return false;
    for (z = at[2]; z < hi[2]; z++)
        for (y = at[1]; y < hi[1]; y++)
            for (x = at[0]; x < hi[0]; x++) state[x + t->bricks[0] * (y + t->bricks[1] * z)] = SPRINGLS__BACKGROUND;
    return true;
}

/* Returns how many lines along an axis there are, of blocks of step^3 entries. */
SPRINGLS__MATHS int springls__lines_along(const springls__table *t, int axis, int step)
{
    return (t->bricks[(axis + 1) % 3] + step - 1) / step * ((t->bricks[(axis + 2) % 3] + step - 1) / step);
}

/* Grows the background along line i of blocks, forwards and backwards; beyond the top table is background. A block is uniform, so
   one of its entries stands for it. Notes whether the line has grown. Lines do not read each other, so growth ends in the same
   state in any order. */
SPRINGLS__MATHS void springls__grow_line_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__table *t = &model->grid.table;
    SPRINGLS__GLOBAL uint8_t *state = springls__brick_state(model);
    const int axis = args.grow_line.axis, step = args.grow_line.step, b = (axis + 1) % 3, c = (axis + 2) % 3;
    const int across = (t->bricks[b] + step - 1) / step, along = (t->bricks[axis] + step - 1) / step;
    int at[3], k;
    bool at_border, before = true, grew = false;
    at[b] = i % across * step;
    at[c] = i / across * step;
    at_border = at[b] == 0 || at[c] == 0 || at[b] + step >= t->bricks[b] || at[c] + step >= t->bricks[c];
    for (k = 0; k < 2 * along; k++) {
        bool background;
        if (k == along) before = true;
        at[axis] = (k < along ? k : 2 * along - 1 - k) * step;
        background = state[at[0] + t->bricks[0] * (at[1] + t->bricks[1] * at[2])] == SPRINGLS__BACKGROUND;
        if (!background && (before || at_border) && springls__take_block(t, state, at, step)) background = grew = true;
        before = background;
    }
    springls__has_grown(model)[args.grow_line.first_flag + i] = grew;
}

/* Sets the side of the brick of entry i from its state: a constant brick is outside or inside, in an active one phi is 1 (background)
   or -1. */
SPRINGLS__MATHS void springls__brick_side_element(const springls__model *model, springls__arguments args, int i,
                                                  SPRINGLS__LOCAL float *memory)
{
    const springls__grid *g = &model->grid;
    bool background = springls__brick_state(model)[i] == SPRINGLS__BACKGROUND;
    int slot = g->top[i], row, v;
    SPRINGLS__GLOBAL float *phi = g->phi + (size_t)slot * SPRINGLS__BRICK_VOXELS;
    (void)args;
    (void)memory;
    SPRINGLS__BARRIER; /* all items have read the slot before one writes it */
    if (slot < SPRINGLS__FIRST_SLOT && model->group.item == 0) g->top[i] = background ? SPRINGLS__OUTSIDE : SPRINGLS__INSIDE;
    for (row = model->group.item; row < SPRINGLS__ROWS && slot >= SPRINGLS__FIRST_SLOT; row += model->group.items)
        for (v = 8 * row; v < 8 * row + 8; v++) phi[v] = background ? 1.0f : -1.0f;
}

SPRINGLS__INNER bool springls__background_at(const springls__grid *g, int x, int y, int z)
{
    return !springls__table_contains(g, x, y, z) || springls__grid_voxel(g, g->phi, x, y, z) > 0.0f;
}

/* Returns true when the background is beside a block of b^3 voxels. */
SPRINGLS__MATHS bool springls__background_beside(const springls__grid *g, int x, int y, int z, int b)
{
    return springls__background_at(g, x - 1, y, z) || springls__background_at(g, x + b, y, z)
           || springls__background_at(g, x, y - 1, z) || springls__background_at(g, x, y + b, z)
           || springls__background_at(g, x, y, z - 1) || springls__background_at(g, x, y, z + b);
}

/* Returns omega of the voxel of a block of b^3 that is nearest to a springl; omega: of the block's brick. */
SPRINGLS__MATHS float springls__least_omega(SPRINGLS__GLOBAL const float *omega, int x, int y, int z, int b)
{
    float least = FLT_MAX;
    int i, j, k;
    for (k = z; k < z + b; k++)
        for (j = y; j < y + b; j++)
            for (i = x; i < x + b; i++) least = springls__min(least, omega[i + 8 * j + 64 * k]);
    return least;
}

/* Grows the background once by blocks of args.grow.block^3 voxels, in an active brick, from phi to phi_next, and notes whether
   it has grown. A block is uniform, so one of its voxels stands for it. */
SPRINGLS__MATHS void springls__grow_element(const springls__model *model, springls__arguments args, int index,
                                            SPRINGLS__LOCAL float *grown)
{
    const springls__grid *g = &model->grid;
    const springls__group group = model->group;
    const int b = args.grow.block, across = 8 / b;
    size_t first = (size_t)g->active[index] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL const float *phi = g->phi + first;
    float grew = 0.0f;
    int o[3], block, v;
    springls__slot_origin(g, g->active[index], o);
    for (block = group.item; block < across * across * across; block += group.items) {
        int x = block % across * b, y = block / across % across * b, z = block / (across * across) * b, i, j, k;
        bool background = phi[x + 8 * y + 64 * z] > 0.0f;
        if (!background && springls__background_beside(g, o[0] + x, o[1] + y, o[2] + z, b)) {
            background = springls__least_omega(g->omega + first, x, y, z, b) > SPRINGLS__SHELL;
            if (background) grew = 1.0f;
        }
        for (k = z; k < z + b; k++)
            for (j = y; j < y + b; j++)
                for (i = x; i < x + b; i++) g->phi_next[first + (size_t)(i + 8 * j + 64 * k)] = background ? 1.0f : -1.0f;
    }
    SPRINGLS__BARRIER;
    grown[group.item] = grew;
    SPRINGLS__BARRIER;
    for (v = 0; v < group.items; v++) grew = springls__max(grew, grown[v]);
    if (group.item == 0) springls__has_grown(model)[index] = grew > 0.0f;
}

/* Returns the vote of one springl on the side of x: the height of x over it, positive in front, with a weight that falls off so
   fast that the nearest springls decide. With a solid angle the far side of a thin sheet would count as much as the near one. */
SPRINGLS__VEC_MATHS springls__vec springls__side(const springls__tri_plan *plan, springls__vec3 x)
{
    springls__vec d2 = springls__vec_tri_distance2(plan, x) + 0.01f;
    springls__vec3 da = springls__vec_sub(x, springls__vec_broadcast3(plan->t.a));
    return springls__vec_dot(springls__vec_broadcast3(plan->n), da) / (d2 * d2 * springls__vec_sqrt(d2));
}

/* Adds the vote of a springl at (x + i, y, z) to side[i], i = 0..7, where omega is less than `capture` and the springl's bounding
   sphere (center, radius) is at most half a voxel further than the nearest springl. */
SPRINGLS__MATHS void springls__side_row(const springls__tri_plan *plan, springls__v3 center, float radius, float capture, int x,
                                        int y, int z, SPRINGLS__GLOBAL const float *omega, SPRINGLS__LOCAL float *side)
{
    const springls__vec zero = springls__vec_broadcast(0.0f);
    springls__vec3 at = springls__vec_broadcast3(springls__v3_make((float)x, (float)y, (float)z));
    int i;
    for (i = 0; i < 8; i += SPRINGLS__LANES) {
        springls__vec nearest = springls__vec_load(omega + i), within = nearest + 0.5f + radius, d2, vote;
        springls__vmask counts;
        at.x = (float)x + springls__vec_from(i);
        d2 = springls__vec_length2(springls__vec_sub(at, springls__vec_broadcast3(center)));
        counts = (nearest < capture) & (d2 < within * within);
        if (!springls__vec_any(counts)) continue;
        vote = springls__vec_select(counts, springls__side(plan, at), zero);
        springls__vec_store(side + i, springls__vec_load(side + i) + vote);
    }
}

/* Adds the votes of springl s to the sides of a brick's voxels near it; origin: the brick's first voxel. */
SPRINGLS__MATHS void springls__add_side(const springls__model *model, SPRINGLS__GLOBAL const springls__springl *s,
                                        const int origin[3], SPRINGLS__GLOBAL const float *omega, SPRINGLS__LOCAL float *side)
{
    const float capture = model->params.capture_range, r = s->bounding_radius + capture;
    const springls__v3 p = springls__sub(s->p, springls__voxel_place(origin, 0)), reach = springls__v3_make(r, r, r);
    const springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(*s));
    const springls__row_range rows = springls__rows_between(springls__sub(p, reach), springls__add(p, reach));
    int y, z;
    for (z = rows.z0; z <= rows.z1; z++)
        for (y = rows.y0; y <= rows.y1; y++) {
            const int v = 8 * y + 64 * z;
            if (springls__is_mine(model->group, y + 8 * z))
                springls__side_row(&plan, s->p, s->bounding_radius, capture, origin[0], origin[1] + y, origin[2] + z, omega + v,
                                   side + v);
        }
}

/* Sets the sign of phi in active brick i, near springls, to the side of the nearest ones. */
SPRINGLS__MATHS void springls__sides_element(const springls__model *model, springls__arguments args, int i,
                                             SPRINGLS__LOCAL float *side)
{
    const springls__grid *g = &model->grid;
    const float capture = model->params.capture_range;
    SPRINGLS__GLOBAL float *phi = g->phi + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL const float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    int row, v, o[3];
    uint32_t k;
    (void)args;
    springls__slot_origin(g, g->active[i], o);
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        for (v = 8 * row; v < 8 * row + 8; v++) side[v] = 0.0f;
    for (k = model->cells.brick_list_first[i]; k < model->cells.brick_list_first[i + 1]; k++) {
        int n = (int)model->cells.brick_list_ids[k];
        if (!springls__is_overlapped(model, n)) springls__add_side(model, &model->set.s[n], o, omega, side);
    }
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        for (v = 8 * row; v < 8 * row + 8; v++)
            if (omega[v] < capture && side[v] != 0.0f) phi[v] = side[v] > 0.0f ? 1.0f : -1.0f;
}

/* ---- regions: connected foreground that no springl is near ----
   The inside of the object, a hollow in it, a pocket with a narrow entrance. Each lies on one side as a whole: that of most
   voxels around it. Members are voxels and open constant bricks. */

SPRINGLS__MATHS bool springls__in_region(const springls__model *model, size_t voxel)
{
    return model->grid.omega[voxel] >= model->params.capture_range && model->grid.phi[voxel] < 0.0f;
}

/* Returns what a voxel beside a region counts for its side: 1 outside, -1 inside, 0 if no springl is near. */
SPRINGLS__MATHS int springls__vote_of_voxel(const springls__model *model, size_t voxel)
{
    if (model->grid.omega[voxel] >= model->params.capture_range) return 0;
    return model->grid.phi[voxel] > 0.0f ? 1 : -1;
}

/* Turns phi of active brick i into a distance: omega with the sign of phi. */
SPRINGLS__MATHS void springls__with_sign_element(const springls__model *model, springls__arguments args, int i,
                                                 SPRINGLS__LOCAL float *memory)
{
    size_t first = (size_t)model->grid.active[i] * SPRINGLS__BRICK_VOXELS;
    SPRINGLS__GLOBAL float *phi = model->grid.phi + first;
    SPRINGLS__GLOBAL const float *omega = model->grid.omega + first;
    int row, v;
    (void)args;
    (void)memory;
    for (row = model->group.item; row < SPRINGLS__ROWS; row += model->group.items)
        for (v = 8 * row; v < 8 * row + 8; v++) phi[v] = phi[v] < 0.0f ? -omega[v] : omega[v];
}

#endif
