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

/* The region that is flooded: see springls__in_region. A device joins labels by union-find instead (regions.cl), as one flood
   is the work of one thread. */
typedef struct springls__region {
    springls_context *ctx;
    uint8_t *state;       /* of the entries of the top table                            */
    int64_t *member;      /* a voxel's place in phi, or -1 - entry for a constant brick */
    int64_t count, votes; /* votes: voxels around it that are outside less those inside */
} springls__region;

enum { SPRINGLS__COUNTED = 3 };              /* a brick that is in a region */
static const float springls__counted = -2.0f; /* a voxel that is            */

/* Returns the place in phi of the i-th voxel of the active bricks. */
SPRINGLS__FN int64_t springls__active_voxel(const springls__grid *g, int64_t i)
{
    return (int64_t)g->active[i / SPRINGLS__BRICK_VOXELS] * SPRINGLS__BRICK_VOXELS + i % SPRINGLS__BRICK_VOXELS;
}

SPRINGLS__FN bool springls__uncounted(const springls__region *r, int64_t v)
{
    return springls__in_region(&r->ctx->model, (size_t)v) && r->ctx->model.grid.phi[v] != springls__counted;
}

/* Adds a voxel, or the open constant brick it is in, to the region, or counts its vote. */
SPRINGLS__FN void springls__region_visit(springls__region *r, int x, int y, int z)
{
    springls__grid *g = &r->ctx->model.grid;
    int slot;
    int64_t v;
    if (!springls__table_contains(g, x, y, z)) return;
    slot = springls__slot_at(g, x, y, z);
    if (slot < SPRINGLS__FIRST_SLOT) {
        int entry = springls__entry_at(g, x, y, z);
        if (r->state[entry] != SPRINGLS__OPEN) return;
        r->state[entry] = SPRINGLS__COUNTED;
        r->member[r->count++] = -1 - (int64_t)entry;
        return;
    }
    v = (int64_t)slot * SPRINGLS__BRICK_VOXELS + springls__voxel_in_brick(x, y, z);
    r->votes += springls__vote_of_voxel(&r->ctx->model, (size_t)v);
    if (!springls__uncounted(r, v)) return;
    g->phi[v] = springls__counted;
    r->member[r->count++] = v;
}

/* Visits what lies beside a voxel, or beside the faces of a constant brick. */
SPRINGLS__FN void springls__region_step(springls__region *r, int64_t member)
{
    const springls__grid *g = &r->ctx->model.grid;
    int v = member < 0 ? 0 : (int)(member % SPRINGLS__BRICK_VOXELS), n = member < 0 ? 8 : 1, d, i, j;
    int origin[3], at[3], to[3];
    if (member < 0) springls__entry_origin(g, (int)(-1 - member), origin);
    else springls__slot_origin(g, (int)(member / SPRINGLS__BRICK_VOXELS), origin);
    springls__voxel_of_brick(origin, v, at);
    for (d = 0; d < 6; d++)
        for (j = 0; j < n; j++)
            for (i = 0; i < n; i++) {
                springls__voxel_at_face(at, n, d, i, j, to);
                springls__region_visit(r, to[0], to[1], to[2]);
            }
}

/* Floods the region of a voxel; puts it outside when more voxels around it are outside. */
SPRINGLS__FN void springls__region_resolve(springls__region *r, int64_t first)
{
    springls__grid *g = &r->ctx->model.grid;
    int64_t i;
    r->count = r->votes = 0;
    g->phi[first] = springls__counted;
    r->member[r->count++] = first;
    for (i = 0; i < r->count; i++) springls__region_step(r, r->member[i]);
    if (r->votes <= 0) return;
    for (i = 0; i < r->count; i++) {
        if (r->member[i] < 0) g->top[-1 - r->member[i]] = SPRINGLS__OUTSIDE;
        else g->phi[r->member[i]] = 1.0f;
    }
}

/* Floods the regions one after the other, each from its first voxel, and resolves their sides. */
SPRINGLS__FN springls_status springls__resolve_regions(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    const int64_t voxels = (int64_t)g->active_count * SPRINGLS__BRICK_VOXELS;
    springls__region region;
    size_t room = springls__entry_count(g);
    int64_t v;
    if (ctx->on_device) {
        springls_status status = (ctx->backend->resolve_regions)(ctx);
        if (!springls__repeat_on_host(ctx, &status)) return status;
    }
    region.ctx = ctx;
    region.state = springls__brick_state(&ctx->model);
    for (v = 0; v < voxels; v++) room += springls__uncounted(&region, springls__active_voxel(g, v));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, region_members, room));
    region.member = springls__region_members(&ctx->model);
    for (v = 0; v < voxels; v++) {
        int64_t first = springls__active_voxel(g, v);
        if (springls__uncounted(&region, first)) springls__region_resolve(&region, first);
    }
    return SPRINGLS_OK;
}

enum {
    SPRINGLS__SIGN_OMEGA,
    SPRINGLS__SIGN_GROW_BRICKS,
    SPRINGLS__SIGN_GROW_COARSE,
    SPRINGLS__SIGN_GROW_FINE,
    SPRINGLS__SIGN_SIDES,
    SPRINGLS__SIGN_COMMIT
};

SPRINGLS__FN springls_status springls__unsigned_to_signed(springls_context *ctx)
{
    const int bricks = ctx->model.grid.active_count;
    const bool project = ctx->model.params.project_level_set != 0;
    switch (ctx->work.phase) {
    case SPRINGLS__SIGN_OMEGA:
        if (ctx->model.set.count == 0)
            return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "unsigned_to_signed: there are no springls");
        SPRINGLS__TRY(springls__bricks_around_springls(ctx));
        SPRINGLS__TRY(springls__omega_build(ctx));
        return springls__next_phase(ctx, SPRINGLS__SIGN_GROW_BRICKS);
    case SPRINGLS__SIGN_GROW_BRICKS:
        SPRINGLS__TRY(springls__grow_bricks(ctx));
        return springls__next_phase(ctx, SPRINGLS__SIGN_GROW_COARSE);
    case SPRINGLS__SIGN_GROW_COARSE:
        SPRINGLS__TRY(springls__grow_voxels(ctx, 4, INT32_MAX));
        return springls__next_phase(ctx, SPRINGLS__SIGN_GROW_FINE);
    case SPRINGLS__SIGN_GROW_FINE:
        SPRINGLS__TRY(springls__grow_voxels(ctx, 2, 2));
        SPRINGLS__TRY(springls__grow_voxels(ctx, 1, 2));
        return springls__next_phase(ctx, SPRINGLS__SIGN_SIDES);
    case SPRINGLS__SIGN_SIDES:
        if (project) springls__loop(ctx, SPRINGLS__KERNEL_sides, bricks, NULL);
        return springls__next_phase(ctx, SPRINGLS__SIGN_COMMIT);
    case SPRINGLS__SIGN_COMMIT:
    default:
        if (project) SPRINGLS__TRY(springls__resolve_regions(ctx));
        springls__run(ctx, SPRINGLS__KERNEL_with_sign, bricks, NULL);
        springls__mark_phi_synced(ctx);
        return springls__next_stage(ctx, springls__rebuild);
    }
}

#endif
