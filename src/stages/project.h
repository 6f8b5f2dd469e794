/* project.h - sets phi near the springls to their oriented distance, which removes the chord error of flat triangles and the
   lag of the moving front. With params.carry_level_set springls first carry phi along: the value at a voxel is that of the
   place it has come from, by the displacements of the springls around. Else eq. 23 has decided the side before. */
#ifndef SPRINGLS__STAGES_PROJECT_H
#define SPRINGLS__STAGES_PROJECT_H

#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../model/cell_list.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "contact_bodies.h"
#include "evolve.h"
#include "rebuild.h"

/* Resolves the voxels of phi_next whose side is unknown, from their neighbors. This needs a third field: the memory of omega,
   which is found again when it is next used. */
SPRINGLS__FN void springls__resolve_sides(springls_context *ctx)
{
    const int voxels = 3;    /* largest distance of an unknown voxel from a known one */
    const float sure = 0.5f; /* least sum of the first rounds, which leaves out neighbors next to the surface */
    const springls__grid *g = &ctx->model.grid;
    int i;
    if (springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_unknown_side), g->active_count, 1) == 0) return;
    springls__omega_constant(ctx, g->far_value, -g->far_value);
    for (i = 0; i < voxels; i++) {
        springls__arguments args;
        args.resolve.last = i == voxels - 1;
        args.resolve.min_sum = args.resolve.last ? 0.0f : sure;
        springls__run(ctx, SPRINGLS__KERNEL_resolve_sides, g->active_count, &args);
        springls__swap(ctx, SPRINGLS__ARRAY_PHI_NEXT, SPRINGLS__ARRAY_OMEGA);
    }
    springls__omega_constant(ctx, ctx->model.params.capture_range, ctx->model.params.capture_range);
    ctx->omega_fresh = false;
}

/* Finds whether the model has sheets or gaps so thin that phi must follow their sides closely. */
SPRINGLS__FN void springls__find_opposed(springls_context *ctx)
{
    if (ctx->model.params.lazy_distance == 0.0f) return;
    ctx->opposed = springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_opposed), ctx->model.grid.active_count, 1) > 0;
}

SPRINGLS__FN bool springls__removes_specks(const springls_context *ctx)
{
    return ctx->model.params.min_component > 0.0f && ctx->model.params.topology == SPRINGLS_TOPOLOGY_FREE;
}

/* Joins the parts of limbs that run between voxels, in the bricks that have joint candidates. Parts that have joined each other
   in the first round may join the rest in the second. */
SPRINGLS__FN void springls__join_parts(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    int rounds = 2;
    if (springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_joint_candidates), bricks, 1) == 0) return;
    for (; rounds > 0; rounds--) {
        springls__run(ctx, SPRINGLS__KERNEL_join_parts, bricks, NULL);
        springls__swap_phi(ctx);
    }
}

/* Joins the parts of limbs and removes small parts, in a level set that has just been made. */
SPRINGLS__FN springls_status springls__tidy_level_set(springls_context *ctx)
{
    if (!springls__removes_specks(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__cell_list_build(ctx));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_joint_candidates, ctx->model.grid.active_count));
    springls__run(ctx, SPRINGLS__KERNEL_find_joint_candidates, ctx->model.grid.active_count, NULL);
    springls__join_parts(ctx);
    springls__run(ctx, SPRINGLS__KERNEL_specks, ctx->model.grid.active_count, NULL);
    springls__swap_phi(ctx);
    return SPRINGLS_OK;
}

enum {
    SPRINGLS__PROJECT_PHI,
    SPRINGLS__PROJECT_COMMIT,
    SPRINGLS__PROJECT_JOINED,
    SPRINGLS__PROJECT_NO_SPECKS,
    SPRINGLS__PROJECT_SWEEP,
    SPRINGLS__PROJECT_SWEPT
};

SPRINGLS__FN springls_status springls__project(springls_context *ctx, bool carry)
{
    const int sweeps = 2;
    springls__arguments args;
    float *displacement = &ctx->work.displacement;
    switch (ctx->work.phase) {
    case SPRINGLS__PROJECT_PHI:
        SPRINGLS__TRY(springls__cell_list_cover_around(ctx));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_unknown_side, ctx->model.grid.active_count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_opposed, ctx->model.grid.active_count));
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, oriented_springls, ctx->model.set.count));
        SPRINGLS__TRY(springls__reserve_lanes(ctx, (size_t)springls__kernels[SPRINGLS__KERNEL_project].floats,
                                              ctx->model.grid.active_count));
        SPRINGLS__TRY(springls__displacement_since_phi(ctx, displacement));
        SPRINGLS__TRY(springls__find_overlap(ctx));
        springls__run(ctx, SPRINGLS__KERNEL_oriented, ctx->model.set.count, NULL);
        args.project.carry = carry;
        args.project.max_displacement = *displacement;
        springls__loop(ctx, SPRINGLS__KERNEL_project, ctx->model.grid.active_count, &args);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_COMMIT);
    case SPRINGLS__PROJECT_COMMIT:
        springls__find_opposed(ctx);
        if (carry) {
            springls__resolve_sides(ctx);
            springls__mark_phi_synced(ctx);
        }
        springls__commit_phi(ctx, carry ? 1 + (int)springls__min(*displacement, ctx->model.grid.far_value) : 1);
        if (!springls__removes_specks(ctx)) return springls__next_phase(ctx, SPRINGLS__PROJECT_SWEEP);
        SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_joint_candidates, ctx->model.grid.active_count));
        springls__loop(ctx, SPRINGLS__KERNEL_find_joint_candidates, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_JOINED);
    case SPRINGLS__PROJECT_JOINED:
        springls__join_parts(ctx);
        springls__loop(ctx, SPRINGLS__KERNEL_specks, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_NO_SPECKS);
    case SPRINGLS__PROJECT_NO_SPECKS:
        springls__swap_phi(ctx);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_SWEEP);
    case SPRINGLS__PROJECT_SWEEP:
        springls__loop(ctx, SPRINGLS__KERNEL_redistance, ctx->model.grid.active_count, NULL);
        return springls__next_phase(ctx, SPRINGLS__PROJECT_SWEPT);
    case SPRINGLS__PROJECT_SWEPT:
    default:
        springls__swap_phi(ctx);
        if (++ctx->work.repetition < sweeps) return springls__next_phase(ctx, SPRINGLS__PROJECT_SWEEP);
        return carry ? springls__band_move(ctx) : SPRINGLS_OK;
    }
}

SPRINGLS__FN springls_status springls__carry_level_set(springls_context *ctx) { return springls__project(ctx, true); }
SPRINGLS__FN springls_status springls__project_level_set(springls_context *ctx) { return springls__project(ctx, false); }

#endif
