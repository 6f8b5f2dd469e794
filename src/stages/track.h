/* track.h - keeps correspondences on the original surface (section 4.7). */
#ifndef SPRINGLS__STAGES_TRACK_H
#define SPRINGLS__STAGES_TRACK_H

#include "../runtime/launch.h"

SPRINGLS__FN springls_status springls__track(springls_context *ctx)
{
    springls__run(ctx, SPRINGLS__KERNEL_track, ctx->model.set.count, NULL);
    return SPRINGLS_OK;
}

#endif
