/* sleep.h - work follows motion: bricks in and around which nothing has stirred for a while are asleep, and steps leave them and
   their springls as they are. A springl stirs when a point of it moves, and when it comes or goes. */
#ifndef SPRINGLS__KERNEL_STAGES_SLEEP_H
#define SPRINGLS__KERNEL_STAGES_SLEEP_H

#include "../model/grid.h"
#include "../model/model.h"
#include "advect.h"

/* Voxel: a springl whose points have moved by less does not stir. */
#define SPRINGLS__REST 1e-3f

/* Names which springls stir: those that are away from where phi last followed them; these and those of which any point moves in
   this step; all of a range; those that contract removes or reshapes. */
#define SPRINGLS__STIR_AWAY 0
#define SPRINGLS__STIR_MOVING 1
#define SPRINGLS__STIR_ALL 2
#define SPRINGLS__STIR_CONTRACTED 3

/* Returns after how many calm steps a brick falls asleep: when a resampling has changed nothing there. */
SPRINGLS__MATHS int springls__calm_limit(const springls__model *model)
{
    return springls__imin(model->params.resample_period + 1, 255);
}

/* Wakes the brick of slot i, if it is not free. */
SPRINGLS__MATHS void springls__wake_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    if (i < SPRINGLS__FIRST_SLOT || model->grid.slot_brick[i] >= 0) springls__wake_slot(&model->grid, i);
}

/* Counts a calm step of active brick i. */
SPRINGLS__MATHS void springls__calm_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL uint8_t *calm = model->grid.calm + model->grid.active[i] * SPRINGLS__OCTANTS;
    const int limit = springls__calm_limit(model);
    int o;
    (void)args;
    for (o = 0; o < SPRINGLS__OCTANTS; o++) calm[o] = (uint8_t)springls__imin(calm[o] + 1, limit);
}

SPRINGLS__MATHS bool springls__stirs(const springls__model *model, int i, int which)
{
    if (which == SPRINGLS__STIR_CONTRACTED) {
        uint8_t action = springls__contract_action(model)[i];
        return action == SPRINGLS__REMOVE || action == SPRINGLS__RESHAPE;
    }
    if (which == SPRINGLS__STIR_ALL || springls__synced_distance2(model)[i] > SPRINGLS__REST * SPRINGLS__REST) return true;
    return which == SPRINGLS__STIR_MOVING && springls__motion_class(model)[i] >= SPRINGLS__MOTION_STIRS;
}

/* Returns which octant of its brick a voxel lies in. */
SPRINGLS__MATHS int springls__octant_of(const int voxel[3])
{
    return (voxel[0] >> 2 & 1) | (voxel[1] >> 1 & 2) | (voxel[2] & 4);
}

/* Ends the calm of the octant that a place lies in. */
SPRINGLS__INNER void springls__end_calm_at(const springls__grid *g, springls__v3 x)
{
    int voxel[3];
    springls__voxel_of_place(g, x, voxel);
    SPRINGLS__MARK(g->calm + springls__slot_at(g, voxel[0], voxel[1], voxel[2]) * SPRINGLS__OCTANTS + springls__octant_of(voxel), 0);
}

/* Ends the calm of the octants that a springl lies in, and lay in when phi last followed, where it stirs. Several springls may end
   that of one octant: they write the same. */
SPRINGLS__MATHS void springls__stir_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    int n = args.stir.first + i;
    if (!springls__stirs(model, n, args.stir.which)) return;
    springls__end_calm_at(g, model->set.s[n].p);
    springls__end_calm_at(g, model->set.synced_position[n]);
}

/* Returns the octants of the d-th brick around a brick (springls__brick_around) that touch it, a bit each. */
SPRINGLS__MATHS int springls__octants_beside(int d)
{
    const int x = d % 3, y = d / 3 % 3, z = d / 9;
    return (x == 0 ? 0xaa : x == 2 ? 0x55 : 0xff) & (y == 0 ? 0xcc : y == 2 ? 0x33 : 0xff) & (z == 0 ? 0xf0 : z == 2 ? 0x0f : 0xff);
}

/* Lets active brick i sleep, until springls__awake_element and near_awake_element find that it is awake. */
SPRINGLS__MATHS void springls__lull_element(const springls__model *model, springls__arguments args, int i)
{
    const int slot = model->grid.active[i];
    (void)args;
    model->grid.awake[slot] = model->grid.near_awake[slot] = 0;
}

/* Wakes the bricks that touch an octant of active brick i in which springls have stirred lately. Few bricks have one, so this costs as
   much as what is awake. */
SPRINGLS__MATHS void springls__awake_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    SPRINGLS__GLOBAL const uint8_t *calm = g->calm + g->active[i] * SPRINGLS__OCTANTS;
    const int limit = springls__calm_limit(model);
    int origin[3], d, o, stirred = 0;
    (void)args;
    for (o = 0; o < SPRINGLS__OCTANTS; o++) stirred |= (calm[o] < limit) << o;
    if (!stirred) return;
    springls__slot_origin(g, g->active[i], origin);
    for (d = 0; d < 27; d++) {
        const int slot = springls__slot_around(g, origin, d);
        const int beside = springls__octants_beside(26 - d); /* of this brick as seen from that one */
        if (slot >= SPRINGLS__FIRST_SLOT && (beside & stirred)) SPRINGLS__MARK(g->awake + slot, 1);
    }
}

/* Marks the bricks around active brick i, and itself, as near one that is awake, if it is. */
SPRINGLS__MATHS void springls__near_awake_element(const springls__model *model, springls__arguments args, int i)
{
    const springls__grid *g = &model->grid;
    int origin[3], d;
    (void)args;
    if (!g->awake[g->active[i]]) return;
    springls__slot_origin(g, g->active[i], origin);
    for (d = 0; d < 27; d++) {
        const int slot = springls__slot_around(g, origin, d);
        if (slot >= SPRINGLS__FIRST_SLOT) SPRINGLS__MARK(g->near_awake + slot, 1);
    }
}

#endif
