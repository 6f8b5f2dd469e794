/* springl_surface.h - the hierarchy over the triangles of the springls, in model coordinates: the axes of the world, the grid's
   origin at zero, the smallest spacing as the unit. So distances are those of the world for every spacing and direction, and a
   far origin costs no digits. */
#ifndef SPRINGLS__MODEL_SPRINGL_SURFACE_H
#define SPRINGLS__MODEL_SPRINGL_SURFACE_H

#include "bvh.h"
#include "transform.h"

/* Builds the hierarchy if springls have moved since it was built. */
SPRINGLS__FN springls_status springls__springl_surface_refresh(springls_context *ctx)
{
    int i, m;
    if (ctx->springl_surface_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->springl_surface, ctx->model.set.count));
    for (i = 0; i < ctx->model.set.count; i++)
        for (m = 0; m < 3; m++) ctx->springl_surface.points[3 * i + m] = springls__voxel_to_model(ctx, ctx->model.set.s[i].q[m]);
    SPRINGLS__TRY(springls__surface_finish(ctx, &ctx->springl_surface, ctx->model.set.count));
    ctx->springl_surface_fresh = true;
    return SPRINGLS_OK;
}

#endif
