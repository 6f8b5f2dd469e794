/* project.h - sets phi near the springls to their oriented distance, which removes the chord error of flat triangles and the
   lag of the moving front. With params.carry_level_set springls first carry phi along: the value at a voxel is that of the
   place it has come from, by the displacements of the springls around. Else eq. 23 has decided the side before.

   Why not the paper's evolution alone: eq. 23 moves phi by half a voxel an iteration and stops where triangles are, a chord's
   height inside of a curved surface. Springls know better. Each is a place and a normal; the distance of a voxel to the surface
   is their weighted mean height over the planes, with the bend of the surface between them taken off:

         p1 .--^--. p2        v's distance: to the arc through p1 and p2, and not to the chord between them. Only springls that
           /   |   \          face as the nearest one does count, so the other side of a thin sheet never enters the mean.
               v
   The side, in or out, is never guessed from one springl: it is carried along, and where nothing near has a say the voxels around
   decide. Two sweeps make phi a distance again beyond the springls' reach, and the band moves with its zero level. */
#ifndef SPRINGLS__STAGES_PROJECT_H
#define SPRINGLS__STAGES_PROJECT_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "contact_bodies.h"
#include "evolve.h"
#include "rebuild.h"

/* Returns whether phi_next may have voxels whose side is unknown. On a device resolving none costs less than waiting for a count. */
SPRINGLS__FN bool springls__may_have_unknown_sides(springls_context *ctx)
{
    return ctx->on_device
        || springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_unknown_side), ctx->model.grid.active_count, 1) > 0;
}

enum { SPRINGLS__SIDE_ROUNDS = 3 }; /* voxels: largest distance of an unknown voxel from a known one */

/* Resolves unknown sides from their neighbors, one round of SPRINGLS__SIDE_ROUNDS. This needs a third field: the memory of omega,
   which is found again when it is next used. Ends with a loop. */
SPRINGLS__FN void springls__resolve_sides(springls_context *ctx, int round)
{
    const float sure = 0.5f; /* least sum of the first rounds, which leaves out neighbors next to the surface */
    const springls__grid *g = &ctx->model.grid;
    springls__arguments args;
    if (round == 0) springls__omega_constant(ctx, g->far_value, -g->far_value);
    ctx->omega_fresh = false;
    args.resolve.first = round == 0;
    args.resolve.last = round == SPRINGLS__SIDE_ROUNDS - 1;
    args.resolve.min_sum = args.resolve.last ? 0.0f : sure;
    springls__loop(ctx, SPRINGLS__KERNEL_resolve_sides, g->active_count, &args);
}

/* Counts the bricks with sheets or gaps so thin that phi must follow their sides closely, for springls__opposed_found. */
SPRINGLS__FN void springls__find_opposed(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    if (ctx->model.params.lazy_distance == 0.0f) return;
    springls__count_later(ctx, SPRINGLS__COUNT_OPPOSED, SPRINGLS__ROLE_ARRAY(has_opposed), bricks, 1);
    springls__count_later(ctx, SPRINGLS__COUNT_OPPOSED_ASLEEP, SPRINGLS__ROLE_ARRAY(has_opposed), bricks,
                          SPRINGLS__OPPOSED_ASLEEP);
}

/* Finds whether there are any. A model that had some may still have them in bricks that are asleep. */
SPRINGLS__FN springls_status springls__opposed_found(springls_context *ctx)
{
    if (ctx->model.params.lazy_distance == 0.0f) return SPRINGLS_OK;
    ctx->opposed = springls__count_found(ctx, SPRINGLS__COUNT_OPPOSED) > 0
                   || (ctx->opposed && springls__count_found(ctx, SPRINGLS__COUNT_OPPOSED_ASLEEP) > 0);
    return SPRINGLS_OK;
}

SPRINGLS__FN bool springls__removes_specks(const springls_context *ctx)
{
    return ctx->model.params.min_component > 0.0f && ctx->model.params.topology == SPRINGLS_TOPOLOGY_FREE;
}

/* Returns whether parts of limbs that run between voxels may have to be joined; see springls__may_have_unknown_sides. */
SPRINGLS__FN bool springls__may_have_joints(springls_context *ctx)
{
    return ctx->on_device
        || springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_joint_candidates), ctx->model.grid.active_count, 1) > 0;
}

enum {
    SPRINGLS__TIDY_FIND,
    SPRINGLS__TIDY_JOIN,
    SPRINGLS__TIDY_JOINED,
    SPRINGLS__TIDY_SPECKS,
    SPRINGLS__TIDY_SPECKS_REMOVED
};

/* Joins the parts of limbs, in the bricks that have joint candidates, and removes small parts. Parts that have joined each other in
   the first round may join the rest in the second. after: the stage that follows; NULL: none. */
SPRINGLS__FN springls_status springls__tidy(springls_context *ctx, springls__stage_fn after)
{
    const int rounds = 2, bricks = ctx->model.grid.active_count;
    switch (ctx->work.phase) {
    case SPRINGLS__TIDY_FIND:
        if (!springls__removes_specks(ctx)) break;
        SPRINGLS__TRY(springls__cell_list_cover(ctx));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_joint_candidates, ctx->model.grid.active_count));
        springls__loop(ctx, SPRINGLS__KERNEL_find_joint_candidates, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__TIDY_JOIN);
    case SPRINGLS__TIDY_JOIN:
        if (ctx->work.repetition == rounds || (ctx->work.repetition == 0 && !springls__may_have_joints(ctx)))
            return springls__next_phase(ctx, SPRINGLS__TIDY_SPECKS);
        springls__loop(ctx, SPRINGLS__KERNEL_join_parts, bricks, NULL);
        return springls__next_phase(ctx, SPRINGLS__TIDY_JOINED);
    case SPRINGLS__TIDY_JOINED:
        springls__swap_phi(ctx);
        ctx->work.repetition++;
        return springls__next_phase(ctx, SPRINGLS__TIDY_JOIN);
    case SPRINGLS__TIDY_SPECKS:
        springls__loop(ctx, SPRINGLS__KERNEL_specks, bricks, NULL);
        return springls__next_phase(ctx, SPRINGLS__TIDY_SPECKS_REMOVED);
    case SPRINGLS__TIDY_SPECKS_REMOVED:
    default:
        springls__swap_phi(ctx);
    }
    return after ? springls__next_stage(ctx, after) : SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__tidy_alone(springls_context *ctx) { return springls__tidy(ctx, NULL); }

/* Tidies a level set that has just been made. */
SPRINGLS__FN springls_status springls__tidy_level_set(springls_context *ctx)
{
    return springls__run_to_completion(ctx, springls__tidy_alone);
}

enum { SPRINGLS__SWEEP, SPRINGLS__SWEPT };

/* Moves the band after phi has been carried along. */
SPRINGLS__FN springls_status springls__band_follow_carried(springls_context *ctx)
{
    SPRINGLS__TRY(springls__band_follow(ctx));
    return ctx->work.pending ? SPRINGLS_OK : springls__opposed_found(ctx);
}

/* Makes the projected level set a distance again beyond the springls. */
SPRINGLS__FN springls_status springls__sweep(springls_context *ctx)
{
    const int sweeps = 2;
    if (ctx->work.phase == SPRINGLS__SWEPT) {
        springls__swap_phi(ctx);
        if (++ctx->work.repetition == sweeps)
            return ctx->work.carries ? springls__next_stage(ctx, springls__band_follow_carried) : springls__opposed_found(ctx);
    }
    springls__loop(ctx, SPRINGLS__KERNEL_redistance, ctx->model.grid.active_count, NULL);
    return springls__next_phase(ctx, SPRINGLS__SWEPT);
}

SPRINGLS__FN springls_status springls__tidy_projected(springls_context *ctx) { return springls__tidy(ctx, springls__sweep); }

enum {
    SPRINGLS__PROJECT_MEASURE,
    SPRINGLS__PROJECT_BEGIN,
    SPRINGLS__PROJECT_ORIENT,
    SPRINGLS__PROJECT_PHI,
    SPRINGLS__PROJECT_SIDES,
    SPRINGLS__PROJECT_RESOLVED,
    SPRINGLS__PROJECT_COMMIT
};

/* Prepares the loops of the stage. */
SPRINGLS__FN springls_status springls__project_begin(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_unknown_side, bricks));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_opposed, bricks));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, oriented_springls, ctx->model.set.count));
    SPRINGLS__TRY(
        springls__reserve_lanes(ctx, (size_t)springls__kernels[SPRINGLS__KERNEL_project].floats, bricks));
    ctx->work.displacement = springls__displacement_found(ctx);
    return springls__find_overlap(ctx);
}

SPRINGLS__FN springls_status springls__project(springls_context *ctx, bool carry)
{
    const springls__grid *g = &ctx->model.grid;
    springls__arguments args;
    switch (ctx->work.phase) {
    case SPRINGLS__PROJECT_MEASURE:
        ctx->work.carries = carry;
        SPRINGLS__TRY(springls__find_displacement(ctx));
        return springls__next_phase(ctx, SPRINGLS__PROJECT_BEGIN);
    case SPRINGLS__PROJECT_BEGIN:
        SPRINGLS__TRY(springls__cell_list_cover_around(ctx));
        return springls__next_phase(ctx, SPRINGLS__PROJECT_ORIENT);
    case SPRINGLS__PROJECT_ORIENT:
        SPRINGLS__TRY(springls__project_begin(ctx));
        springls__loop(ctx, SPRINGLS__KERNEL_oriented, ctx->model.set.count, NULL);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_PHI);
    case SPRINGLS__PROJECT_PHI:
        args.project.carry = carry;
        args.project.max_displacement = ctx->work.displacement;
        springls__loop(ctx, SPRINGLS__KERNEL_project, g->active_count, &args);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_SIDES);
    case SPRINGLS__PROJECT_SIDES:
        if (ctx->work.repetition == 0) springls__find_opposed(ctx);
        if (!carry || (ctx->work.repetition == 0 && !springls__may_have_unknown_sides(ctx)))
            return springls__next_phase(ctx, SPRINGLS__PROJECT_COMMIT);
        springls__resolve_sides(ctx, ctx->work.repetition);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_RESOLVED);
    case SPRINGLS__PROJECT_RESOLVED:
        springls__swap(ctx, SPRINGLS__ARRAY_PHI_NEXT, SPRINGLS__ARRAY_OMEGA);
        if (++ctx->work.repetition < SPRINGLS__SIDE_ROUNDS) return springls__next_phase(ctx, SPRINGLS__PROJECT_SIDES);
        springls__omega_constant(ctx, ctx->model.params.capture_range, ctx->model.params.capture_range);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_COMMIT);
    case SPRINGLS__PROJECT_COMMIT:
    default:
        if (carry) springls__mark_phi_synced(ctx);
        springls__commit_phi(ctx, carry ? 1 + (int)springls__min(ctx->work.displacement, g->far_value) : 1);
        return springls__next_stage(ctx, springls__tidy_projected);
    }
}

SPRINGLS__FN springls_status springls__carry_level_set(springls_context *ctx) { return springls__project(ctx, true); }
SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx) { return springls__project(ctx, false); }

#endif
