/* springl_surface.h - the hierarchy over the triangles of the springls.

   The model's triangles are kept in a hierarchy of their own, in "model" coordinates: the world's axes, the grid's origin
   at zero, the smallest spacing as the unit. So distances are the world's whatever the grid's spacing and direction, and
   no digits are lost to a far origin. It is built again by the first query after the springls have moved. */
#ifndef SPRINGLS__MODEL_SPRINGL_SURFACE_H
#define SPRINGLS__MODEL_SPRINGL_SURFACE_H

#include "bvh.h"
#include "transform.h"

SPRINGLS__FN springls_status springls__model_refresh(springls_context *ctx)
{
    int i, m;
    if (ctx->model_fresh) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->springl_surface, ctx->model.set.count));
    for (i = 0; i < ctx->model.set.count; i++)
        for (m = 0; m < 3; m++) ctx->springl_surface.points[3 * i + m] = springls__voxel_to_model(ctx, ctx->model.set.s[i].q[m]);
    SPRINGLS__TRY(springls__surface_finish(ctx, &ctx->springl_surface, ctx->model.set.count));
    ctx->model_fresh = true;
    return SPRINGLS_OK;
}

#endif
