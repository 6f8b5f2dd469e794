/* constellation.h - springls come and go: makes room, appends, compacts; and notes what has to be built again when they move.

   Why one place: new springls are appended and get the next ids; removed ones leave, and those behind them move up in order, with all their
   arrays (SPRINGLS__SPRINGL_ARRAYS). So numbers change and ids do not, and equal histories give equal numbers, whatever runs them. Cell
   list, neighbour lists, omega and hierarchies hold numbers and places of springls: who changes springls says so here, once
   (springls__triangles_changed, springls__constellation_changed), and they are found again when they are next used. */
#ifndef SPRINGLS__MODEL_CONSTELLATION_H
#define SPRINGLS__MODEL_CONSTELLATION_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"

/* Makes room for count springls; keeps those that are there. */
SPRINGLS__FN springls_status springls__constellation_reserve(springls_context *ctx, int count)
{
    return springls__grow_all(ctx, SPRINGLS__SET_BITS | SPRINGLS__BIT(ASLEEP), (size_t)count, (size_t)ctx->model.set.count);
}

/* Counts springls that springls__springl_add has put behind the others. */
SPRINGLS__FN void springls__constellation_added(springls_context *ctx, int added)
{
    ctx->model.set.count += added;
    ctx->model.set.next_id += (uint32_t)added;
}

/* Counts the springls that a stage has stored (ctx->work.added), and returns how many. */
SPRINGLS__FN int springls__count_stored(springls_context *ctx)
{
    const int added = ctx->work.added;
    ctx->work.added = 0;
    springls__constellation_added(ctx, added);
    return added;
}

/* Appends one springl with a fresh id; room must have been reserved. */
SPRINGLS__FN int springls__constellation_append(springls_context *ctx, const springls__springl *s, springls__v3 a,
                                                uint32_t generation, uint8_t mask)
{
    int i = ctx->model.set.count;
    /* the last of the arrays that grow */
    SPRINGLS_ASSERT((size_t)i < ctx->memory[SPRINGLS__ARRAY_SYNCED_POSITION].bytes / sizeof(springls__v3));
    springls__springl_add(&ctx->model, i, springls__springl_finished(*s), a, generation, mask);
    springls__constellation_added(ctx, 1);
    return i;
}

/* Finds which springls are asleep. */
SPRINGLS__FN void springls__find_sleepers(springls_context *ctx)
{
    springls__arguments args;
    args.asleep.listed = ctx->keyed == ctx->model.set.count;
    springls__run(ctx, SPRINGLS__KERNEL_asleep, ctx->model.set.count, &args);
    ctx->model.cells.asleep_count = ctx->model.set.count;
}

/* Moves `count` springls from number `from` on to number `to` on, with the keys of their cells if all have them. */
SPRINGLS__FN void springls__move_springls(springls_context *ctx, int to, int from, int count)
{
    springls__model *model = &ctx->model;
#define SPRINGLS__MOVE_MEMBER(name, type, block, owner, member)                                                                  \
    memmove(model->owner.member + to, model->owner.member + from, (size_t)count * sizeof *model->owner.member);
    SPRINGLS__SPRINGL_ARRAYS(SPRINGLS__MOVE_MEMBER)
    if (ctx->keyed == model->set.count) SPRINGLS__MOVE_MEMBER(KEY, uint32_t, 1, cells, key)
#undef SPRINGLS__MOVE_MEMBER
}

/* Drops the springls whose contract_action is REMOVE: those behind each move up. */
SPRINGLS__FN springls_status springls__drop_in_place(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    const uint8_t *action = springls__contract_action(&ctx->model);
    int from, end, n = 0;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__ROLE_BIT(contract_action), SPRINGLS__SET_BITS | SPRINGLS__BIT(KEY)));
    for (from = 0; from < count; from = end) { /* a run of springls that all go, or all stay */
        const bool goes = action[from] == SPRINGLS__REMOVE;
        for (end = from + 1; end < count && (action[end] == SPRINGLS__REMOVE) == goes; end++) continue;
        if (goes) continue;
        if (from > n) springls__move_springls(ctx, n, from, end - from);
        n += end - from;
    }
    ctx->keyed = ctx->keyed == count ? n : 0;
    ctx->model.set.count = n;
    return SPRINGLS_OK;
}

/* Drops the springls whose contract_action is REMOVE; the others stay in order. All at once they go by way of a copy. */
SPRINGLS__FN springls_status springls__drop_removed(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    int kept = 0;
    if (springls__runs_in_order(ctx)) return springls__drop_in_place(ctx);
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, stay_number, count));
    springls__run(ctx, SPRINGLS__KERNEL_compact_flag, count, NULL);
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(stay_number), count, &kept));
    if (kept == count) return SPRINGLS_OK;
    ctx->keyed = 0;
    SPRINGLS__TRY(springls__grow(ctx, SPRINGLS__ARRAY_SPARE, (size_t)count, 0));
    springls__run(ctx, SPRINGLS__KERNEL_compact_out, count, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_compact_in, kept, NULL);
    ctx->model.set.count = kept;
    return SPRINGLS_OK;
}

/* Drops the springls whose contract_action is REMOVE; the others stay in order, but get other numbers: so those that are asleep are
   found again. */
SPRINGLS__FN springls_status springls__constellation_compact(springls_context *ctx)
{
    SPRINGLS__TRY(springls__drop_removed(ctx));
    if (ctx->model.grid.some_asleep) springls__find_sleepers(ctx);
    return SPRINGLS_OK;
}

/* Notes that the level set agrees with the springls as they are now: carry_level_set measures motion from here on. */
SPRINGLS__FN springls_status springls__mark_phi_synced(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_mark_phi_synced, ctx->model.set.count, NULL);
    ctx->lag = ctx->lag_turned = 0.0f;
    ctx->away = SPRINGLS__REST; /* of springls that are asleep */
    return SPRINGLS_OK;
}

/* Finds the largest displacement of a particle since phi was last synced, for springls__displacement_found. */
SPRINGLS__FN springls_status springls__find_displacement(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, synced_distance2, count));
    springls__run(ctx, SPRINGLS__KERNEL_displacement, count, NULL);
    springls__largest_later(ctx, SPRINGLS__COUNT_DISPLACEMENT, SPRINGLS__ROLE_ARRAY(synced_distance2), count, 0.0f);
    return SPRINGLS_OK;
}

/* Returns what springls__find_displacement has found, voxels. */
SPRINGLS__FN float springls__displacement_found(springls_context *ctx)
{
    return springls__sqrt(springls__largest_found(ctx, SPRINGLS__COUNT_DISPLACEMENT).value);
}

/* Finds the largest displacement of a particle since phi was last synced, voxels. */
SPRINGLS__FN springls_status springls__displacement_since_phi(springls_context *ctx, float *displacement)
{
    SPRINGLS__TRY(springls__find_displacement(ctx));
    *displacement = springls__displacement_found(ctx);
    return SPRINGLS_OK;
}

/* Returns true if the bricks of the level set are gone while there are springls: a moved window has left them all behind. */
SPRINGLS__FN bool springls__has_lost_level_set(const springls_context *ctx)
{
    return ctx->model.grid.active_count == 0 && ctx->model.set.count > 0;
}

/* Notes that triangles have changed about their particles: the radii of the cell list, omega and the hierarchy of triangles are out
   of date. */
SPRINGLS__FN void springls__triangles_changed(springls_context *ctx)
{
    ctx->springls_version++;
    ctx->model_version++;
    ctx->shape_version++;
    ctx->at_rest = false;
    ctx->cells_fresh = false;
    ctx->omega_fresh = false;
    ctx->springl_surface_fresh = false;
}

/* Returns true when the stage at work adds springls. */
SPRINGLS__FN bool springls__adds_springls(const springls_context *ctx) { return ctx->work.added > 0; }

SPRINGLS__FN void springls__insert_args(const springls_context *ctx, springls__arguments *args)
{
    args->insert.count = ctx->work.added;
}

/* Notes that the cell list is to be built anew, because particles or bricks have changed. */
SPRINGLS__FN void springls__discard_cell_list(springls_context *ctx)
{
    ctx->cells_fresh = ctx->particles_listed = false;
    ctx->keyed = 0;
}

/* Notes that springls have moved: particles may be in other cells, too. */
SPRINGLS__FN void springls__constellation_moved(springls_context *ctx)
{
    springls__triangles_changed(ctx);
    springls__discard_cell_list(ctx);
}

/* Notes that springls have been added, removed or replaced: neighbour lists are out of date too. */
SPRINGLS__FN void springls__constellation_changed(springls_context *ctx)
{
    springls__constellation_moved(ctx);
    ctx->neighbors_uses = 0;
}

/* Notes that springls have been added behind the others, or removed, and that the first `keyed` are in the cells that they were in. */
SPRINGLS__FN void springls__constellation_changed_behind(springls_context *ctx, int keyed)
{
    springls__constellation_changed(ctx);
    ctx->keyed = keyed;
}

#endif
