/* unsigned_to_signed.h - makes the level set from springls alone (section 4.5): the background grows from the whole border of
   the volume, coarse to fine, and cannot leak through gaps narrower than the blocks it grows by. The rest is the object. With
   project_level_set the springls then give the side of voxels near them: narrow clefts, pockets and hollows that the background
   cannot reach are outside too. */
#ifndef SPRINGLS__STAGES_UNSIGNED_TO_SIGNED_H
#define SPRINGLS__STAGES_UNSIGNED_TO_SIGNED_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../runtime/launch.h"
#include "../runtime/residency.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/grid.h"
#include "rebuild.h"
#include "unsigned_distance.h"

/* Activates the bricks within the band of any springl, and no others. Constant bricks and phi are written afterwards. */
SPRINGLS__FN springls_status springls__bricks_around_springls(springls_context *ctx)
{
    springls__constellation_changed(ctx);
    return springls__activate_bricks(ctx, SPRINGLS__KERNEL_mark_near, ctx->model.set.count, false);
}

/* Grows the background through bricks: the coarse levels of the paper, each to its end. The top table stands for the domain, as
   all beyond it is background. */
SPRINGLS__FN springls_status springls__grow_bricks(springls_context *ctx)
{
    const springls__table *t = &ctx->model.grid.table;
    const size_t entries = springls__entry_count(&ctx->model.grid);
    springls__arguments args;
    int step = 1, axis, line_count, rounds;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, brick_state, entries));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_grown, entries * 3)); /* no fewer than lines */
    springls__run(ctx, SPRINGLS__KERNEL_brick_state, (int)entries, NULL);
    while (16 * step * 2 <= springls__imax(t->bricks[0], springls__imax(t->bricks[1], t->bricks[2]))) step *= 2;
    for (; step >= 1; step /= 2) {
        rounds = 0;
        do {
            for (axis = line_count = 0; axis < 3; axis++) {
                args.grow_line.axis = axis;
                args.grow_line.step = step;
                args.grow_line.first_flag = line_count;
                springls__run(ctx, SPRINGLS__KERNEL_grow_line, springls__lines_along(t, axis, step), &args);
                line_count += springls__lines_along(t, axis, step);
            }
        } while (!springls__checks_round(ctx, ++rounds)
                 || springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_grown), line_count, 1) > 0);
    }
    springls__run(ctx, SPRINGLS__KERNEL_brick_side, (int)entries, NULL);
    return SPRINGLS_OK;
}

/* Grows the background by blocks of voxels in the active bricks. */
SPRINGLS__FN springls_status springls__grow_voxels(springls_context *ctx, int block, int iterations)
{
    const int bricks = ctx->model.grid.active_count;
    springls__arguments args;
    bool grew = true;
    int round;
    args.grow.block = block;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, has_grown, bricks));
    for (round = 1; grew && round <= iterations; round++) {
        springls__run(ctx, SPRINGLS__KERNEL_grow, bricks, &args);
        springls__swap_phi(ctx);
        grew = !springls__checks_round(ctx, round)
            || springls__count_of(ctx, SPRINGLS__ROLE_ARRAY(has_grown), bricks, 1) > 0;
    }
    return SPRINGLS_OK;
}

/* Finds regions and resolves their sides: see springls__in_region. */
SPRINGLS__FN springls_status springls__resolve_regions(springls_context *ctx)
{
    const size_t entries = springls__entry_count(&ctx->model.grid);
    const size_t nodes = (size_t)ctx->model.grid.slot_count * SPRINGLS__BRICK_VOXELS + entries;
    const int elements = ctx->model.grid.active_count * SPRINGLS__ROWS + (int)entries;
    if (nodes > INT32_MAX) return springls__fail(ctx, SPRINGLS_OUT_OF_MEMORY, "unsigned_to_signed: the narrow band has too many voxels");
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, region_label, nodes));
    springls__run(ctx, SPRINGLS__KERNEL_region_begin, elements, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_region_join, elements, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_region_vote, elements, NULL);
    springls__run(ctx, SPRINGLS__KERNEL_region_resolve, elements, NULL);
    return SPRINGLS_OK;
}

/* Activates the bricks around springls, and no others. */
SPRINGLS__FN springls_status springls__sign_begin(springls_context *ctx)
{
    if (ctx->model.set.count == 0)
        return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "unsigned_to_signed: there are no springls");
    return springls__bricks_around_springls(ctx);
}

SPRINGLS__FN springls_status springls__grow_coarse(springls_context *ctx) { return springls__grow_voxels(ctx, 4, INT32_MAX); }

SPRINGLS__FN springls_status springls__grow_fine(springls_context *ctx)
{
    SPRINGLS__TRY(springls__grow_voxels(ctx, 2, 2));
    return springls__grow_voxels(ctx, 1, 2);
}

SPRINGLS__FN bool springls__knows_sides(const springls_context *ctx) { return ctx->model.params.project_level_set != 0; }

static const springls__entry springls__unsigned_to_signed[] = {
    SPRINGLS__DO(springls__sign_begin)
    SPRINGLS__DO(springls__omega_build) /* eq. 21 */
    SPRINGLS__DO(springls__grow_bricks)
    SPRINGLS__DO(springls__grow_coarse)
    SPRINGLS__DO(springls__grow_fine)
    SPRINGLS__IF(springls__knows_sides)
        SPRINGLS__KERNEL(sides, BRICKS)
        SPRINGLS__DO(springls__resolve_regions)
    SPRINGLS__END
    SPRINGLS__KERNEL(with_sign, BRICKS)
    SPRINGLS__DO(springls__mark_phi_synced)
    SPRINGLS__CALL(springls__rebuild)
SPRINGLS__END };

#endif
