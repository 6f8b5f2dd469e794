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

/* Counts the bricks that need some rounds more. On a device rounds that do nothing cost less than waiting for a count. */
SPRINGLS__FN springls_status springls__count_bricks(springls_context *ctx, springls__array flags)
{
    ctx->work.found = ctx->on_device ? 1 : springls__count_of(ctx, flags, ctx->model.grid.active_count, 1);
    return SPRINGLS_OK;
}

/* Counts bricks of phi_next with voxels whose side is unknown. */
SPRINGLS__FN springls_status springls__count_unknown_sides(springls_context *ctx)
{
    return springls__count_bricks(ctx, SPRINGLS__ROLE_ARRAY(has_unknown_side));
}

enum { SPRINGLS__SIDE_ROUNDS = 3 }; /* voxels: largest distance of an unknown voxel from a known one */

SPRINGLS__FN bool springls__resolves_sides(const springls_context *ctx) { return springls__round(ctx) < SPRINGLS__SIDE_ROUNDS; }

SPRINGLS__FN void springls__resolve_args(const springls_context *ctx, springls__arguments *args)
{
    const float sure = 0.5f; /* least sum of the first rounds, which leaves out neighbors next to the surface */
    args->resolve.first = springls__round(ctx) == 0;
    args->resolve.last = springls__round(ctx) == SPRINGLS__SIDE_ROUNDS - 1;
    args->resolve.min_sum = args->resolve.last ? 0.0f : sure;
}

/* Uses the memory of omega as a third field; omega is found again when it is next used. */
SPRINGLS__FN springls_status springls__lend_omega(springls_context *ctx)
{
    springls__omega_constant(ctx, ctx->model.grid.far_value, -ctx->model.grid.far_value);
    ctx->omega_fresh = false;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__return_omega(springls_context *ctx)
{
    springls__omega_constant(ctx, ctx->model.params.capture_range, ctx->model.params.capture_range);
    return SPRINGLS_OK;
}

/* Resolves unknown sides from their neighbors. */
static const springls__entry springls__resolve_sides[] = {
    SPRINGLS__DO(springls__lend_omega)
    SPRINGLS__REPEAT_WHILE(springls__resolves_sides)
        SPRINGLS__KERNEL_WITH(resolve_sides, BRICKS, springls__resolve_args)
        SPRINGLS__SWAP(ARRAY_PHI_NEXT, ARRAY_OMEGA)
    SPRINGLS__END
    SPRINGLS__DO(springls__return_omega)
SPRINGLS__END };

/* Counts the bricks with sheets or gaps so thin that phi must follow their sides closely, for springls__opposed_found. */
SPRINGLS__FN springls_status springls__find_opposed(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    if (ctx->model.params.lazy_distance == 0.0f) return SPRINGLS_OK;
    springls__count_later(ctx, SPRINGLS__COUNT_OPPOSED, SPRINGLS__ROLE_ARRAY(has_opposed), bricks, 1);
    springls__count_later(ctx, SPRINGLS__COUNT_OPPOSED_ASLEEP, SPRINGLS__ROLE_ARRAY(has_opposed), bricks,
                          SPRINGLS__OPPOSED_ASLEEP);
    return SPRINGLS_OK;
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

/* Counts bricks where parts of limbs that run between voxels may have to be joined. */
SPRINGLS__FN springls_status springls__count_joint_candidates(springls_context *ctx)
{
    return springls__count_bricks(ctx, SPRINGLS__ROLE_ARRAY(has_joint_candidates));
}

/* Joins the parts of limbs, in the bricks that have joint candidates: parts that have joined each other in the first round may join the
   rest in the second. Then removes small parts. */
static const springls__entry springls__tidy[] = {
    SPRINGLS__IF(springls__removes_specks)
        SPRINGLS__DO(springls__cell_list_cover)
        SPRINGLS__ROOM(has_joint_candidates, BRICKS)
        SPRINGLS__KERNEL(find_joint_candidates, BRICKS)
        SPRINGLS__DO(springls__count_joint_candidates)
        SPRINGLS__IF(springls__found_some)
            SPRINGLS__REPEAT_WHILE(springls__twice)
                SPRINGLS__KERNEL(join_parts, BRICKS)
                SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
            SPRINGLS__END
        SPRINGLS__END
        SPRINGLS__KERNEL(specks, BRICKS)
        SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__END
SPRINGLS__END };

/* Tidies the projected level set, and makes it a distance again beyond the springls. */
static const springls__entry springls__tidy_and_sweep[] = {
    SPRINGLS__CALL(springls__tidy)
    SPRINGLS__REPEAT_WHILE(springls__twice)
        SPRINGLS__KERNEL(redistance, BRICKS)
        SPRINGLS__SWAP(ARRAY_PHI, ARRAY_PHI_NEXT)
    SPRINGLS__END
SPRINGLS__END };

SPRINGLS__FN springls_status springls__note_displacement(springls_context *ctx)
{
    ctx->work.displacement = springls__displacement_found(ctx);
    return SPRINGLS_OK;
}

static const springls__entry springls__begin_projection[] = {
    SPRINGLS__DO(springls__find_displacement)
    SPRINGLS__DO(springls__cell_list_cover_around)
    SPRINGLS__ROOM(has_unknown_side, BRICKS)
    SPRINGLS__ROOM(has_opposed, BRICKS)
    SPRINGLS__ROOM(oriented_springls, SPRINGLS)
    SPRINGLS__DO(springls__note_displacement)
    SPRINGLS__DO(springls__find_overlap)
    SPRINGLS__KERNEL(oriented, SPRINGLS)
SPRINGLS__END };

SPRINGLS__FN void springls__project_args(const springls_context *ctx, springls__arguments *args)
{
    args->project.max_displacement = ctx->work.displacement;
}

SPRINGLS__FN void springls__carry_args(const springls_context *ctx, springls__arguments *args)
{
    springls__project_args(ctx, args);
    args->project.carry = 1;
}

SPRINGLS__FN springls_status springls__take_carried(springls_context *ctx)
{
    springls__mark_phi_synced(ctx);
    springls__commit_phi(ctx, 1 + (int)springls__min(ctx->work.displacement, ctx->model.grid.far_value));
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__take_projected(springls_context *ctx)
{
    springls__commit_phi(ctx, 1);
    return SPRINGLS_OK;
}

static const springls__entry springls__carry_level_set[] = {
    SPRINGLS__CALL(springls__begin_projection)
    SPRINGLS__KERNEL_WITH(project, BRICKS, springls__carry_args)
    SPRINGLS__DO(springls__find_opposed)
    SPRINGLS__DO(springls__count_unknown_sides)
    SPRINGLS__IF(springls__found_some) SPRINGLS__CALL(springls__resolve_sides) SPRINGLS__END
    SPRINGLS__DO(springls__take_carried)
    SPRINGLS__CALL(springls__tidy_and_sweep)
    SPRINGLS__CALL(springls__band_follow)
    SPRINGLS__DO(springls__opposed_found)
SPRINGLS__END };

static const springls__entry springls__project_level_set[] = {
    SPRINGLS__CALL(springls__begin_projection)
    SPRINGLS__KERNEL_WITH(project, BRICKS, springls__project_args)
    SPRINGLS__DO(springls__find_opposed)
    SPRINGLS__DO(springls__take_projected)
    SPRINGLS__CALL(springls__tidy_and_sweep)
    SPRINGLS__DO(springls__opposed_found)
SPRINGLS__END };

#endif
