/* fill_gaps.h - adds springls at exposed zero crossings of the signed level set (section 4.4).

   Why phi decides where: springls that move apart leave a gap, and no springl can see it. phi, which is closed, can: a triangle of its zero
   level that no springl is near is exposed, and becomes a springl.

        springls    --- ---         --- ---
        phi = 0     ~~~~~~~~~~~~~~~~~~~~~~~        the new springls are fitted to those around (track), because the zero level
                            === ===                under a gap is a guess, and the springls beside the gap are not. */
#ifndef SPRINGLS__STAGES_FILL_GAPS_H
#define SPRINGLS__STAGES_FILL_GAPS_H

#include "../../kernels_embed/stages/fill_gaps.h"
#include "../runtime/arrays.h"
#include "../runtime/launch.h"
#include "../runtime/resumable.h"
#include "../runtime/stage_clock.h"
#include "../model/cell_bricks.h"
#include "../model/constellation.h"
#include "fill_from_springls.h"
#include "inherit.h"
#include "sleep.h"

/* Finds the triangles of the zero level that no springl covers: see springls__is_exposed. Ends with a loop. */
SPRINGLS__FN springls_status springls__find_exposed(springls_context *ctx, float covered, float on_sheets)
{
    springls__arguments args;
    int bricks;
    SPRINGLS__TRY(springls__cell_list_cover(ctx));
    bricks = ctx->model.grid.active_count;
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, exposed, (size_t)bricks * SPRINGLS__CUBES));
    SPRINGLS__TRY(SPRINGLS__RESERVE(ctx, exposed_count, bricks));
    args.exposure.covered = covered;
    args.exposure.covered_on_sheets = on_sheets;
    springls__loop(ctx, SPRINGLS__KERNEL_exposure, bricks, &args);
    return SPRINGLS_OK;
}

/* Adds springls at the exposed triangles, as many as there is room for. */
SPRINGLS__FN springls_status springls__fill_exposed(springls_context *ctx)
{
    springls__arguments args;
    int bricks = ctx->model.grid.active_count, wanted = 0, room;
    SPRINGLS__TRY(springls__scan(ctx, SPRINGLS__ROLE_ARRAY(exposed_count), bricks, &wanted));
    room = springls__imin(wanted, springls__imax(ctx->desc.max_springls - ctx->model.set.count, 0));
    ctx->stats.refused += wanted - room;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->model.set.count + room));
    args.insert.count = room;
    if (room > 0) springls__run(ctx, SPRINGLS__KERNEL_fill, bricks, &args);
    springls__constellation_added(ctx, room);
    return SPRINGLS_OK;
}

/* Fits the new springls, from number `first` on, to those before them; the cell list has only the latter. */
SPRINGLS__FN void springls__fit_new_springls(springls_context *ctx, int first)
{
    springls__arguments args;
    int added = ctx->model.set.count - first;
    double started;
    if (added == 0) return;
    args.fit.first = first;
    started = springls__stage_begin(ctx, SPRINGLS_STAGE_TRACK);
    springls__run(ctx, SPRINGLS__KERNEL_fit_new_springls, added, &args);
    springls__stage_end(ctx, SPRINGLS_STAGE_TRACK, started);
    ctx->stats.added += added;
    springls__stir(ctx, SPRINGLS__STIR_ALL, first, added);
    springls__constellation_changed_behind(ctx, springls__imin(ctx->keyed, first));
}

SPRINGLS__FN bool springls__fills_from_springls(const springls_context *ctx) { return ctx->model.params.fill_from_springls != 0; }

/* Finds what springls leave bare. After filling from springls, less of the zero level is. Ends with a loop. */
SPRINGLS__FN springls_status springls__find_bare(springls_context *ctx)
{
    const float covered = 0.75f, on_sheets = 1.5f; /* voxels */
    const float d_max = ctx->model.params.d_max;
    if (!springls__fills_from_springls(ctx)) return springls__find_exposed(ctx, d_max, d_max);
    return springls__find_exposed(ctx, springls__max(covered, d_max), on_sheets);
}

SPRINGLS__FN springls_status springls__fill_bare(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    SPRINGLS__TRY(springls__fill_exposed(ctx));
    springls__fit_new_springls(ctx, count);
    return springls__attributes_after_fill(ctx, count);
}

static const springls__entry springls__fill_gaps[] = {
    SPRINGLS__IF(springls__fills_from_springls) SPRINGLS__CALL(springls__fill_holes) SPRINGLS__END
    SPRINGLS__DO(springls__find_bare)
    SPRINGLS__DO(springls__fill_bare)
SPRINGLS__END };

#endif
