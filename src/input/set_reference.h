/* set_reference.h - replaces the original surface: by the present model, or by a mesh. */
#ifndef SPRINGLS__INPUT_SET_REFERENCE_H
#define SPRINGLS__INPUT_SET_REFERENCE_H

#include "../runtime/arrays.h"
#include "../runtime/errors.h"
#include "../model/grid.h"
#include "../model/host_access.h"
#include "../solver/step.h"
#include "../lifecycle/create.h"
#include "set_level_set.h"
#include "set_mesh.h"

SPRINGLS_API springls_status springls_set_reference(springls_context *ctx)
{
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__begin_change(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, true));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "set_reference: there are no springls");
    SPRINGLS__TRY(springls__make_original(ctx));
    for (i = 0; i < ctx->model.set.count; i++) ctx->model.set.a[i] = ctx->model.set.s[i].p;
    return SPRINGLS_OK;
}

/* Takes the original surface and phi_ref of another model, and gives it this model's surface for them to be freed together. Both
   models have the same grid and allocator. */
SPRINGLS__FN springls_status springls__take_reference(springls_context *ctx, springls_context *other)
{
    springls__surface original = ctx->original;
    size_t own = springls__surface_bytes(&ctx->original), taken = springls__surface_bytes(&other->original);
    SPRINGLS__TRY(springls__copy_to_reference(ctx, &other->model.reference));
    ctx->original = other->original;
    other->original = original;
    ctx->memory_used = ctx->memory_used - own + taken;
    other->memory_used = other->memory_used - taken + own;
    ctx->reference_stamp = 0;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_set_reference_mesh(springls_context *ctx, const float *positions, int position_count,
                                                         size_t stride, const int *triangles, int triangle_count,
                                                         springls_mesh_report *report)
{
    springls_context *other;
    springls_status status;
    if (report) memset(report, 0, sizeof *report);
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    if (ctx->model.set.count == 0) return springls__fail(ctx, SPRINGLS_EMPTY_MODEL, "set_reference_mesh: there are no springls");
    SPRINGLS__TRY(springls__create_alike(ctx, "set_reference_mesh", &other));
    memcpy(other->home, ctx->original_window.offset, sizeof other->home); /* correspondences keep their bits */
    status = springls_set_mesh(other, positions, position_count, stride, triangles, triangle_count, report);
    if (status != SPRINGLS_OK) springls__fail(ctx, status, "set_reference_mesh: %.200s", other->error);
    else status = springls__use_host(ctx, true);
    if (status == SPRINGLS_OK) status = springls__take_reference(ctx, other);
    springls_destroy(other);
    return status;
}

#endif
