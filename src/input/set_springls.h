/* set_springls.h - models from springls themselves, and which of their springls are kept. */
#ifndef SPRINGLS__INPUT_SET_SPRINGLS_H
#define SPRINGLS__INPUT_SET_SPRINGLS_H

#include "../runtime/errors.h"
#include "../runtime/resumable.h"
#include "../model/constellation.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../stages/evolve.h"
#include "../stages/rebuild.h"
#include "../stages/unsigned_to_signed.h"
#include "../solver/step.h"
#include "set_level_set.h"

SPRINGLS_API springls_status springls_set_keep_mask(springls_context *ctx, const uint8_t *mask)
{
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__report_device_failure(ctx, springls__to_host(ctx, 0, SPRINGLS__BIT(MASK)))); /* components stay */
    springls__wake_all(ctx);
    for (i = 0; i < ctx->model.set.count; i++) ctx->model.set.mask[i] = mask && mask[i] ? 1 : 0;
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__check_springls(springls_context *ctx, const float *vertices, const float *particles,
                                                      const float *correspondences, int count)
{
    int i;
    if (!vertices) return springls__fail_null(ctx, "set_springls", "vertices");
    if (count <= 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_springls: the count %d is not positive", count);
    if (count > ctx->desc.max_springls)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "set_springls: the count %d exceeds max_springls, %d", count,
                              ctx->desc.max_springls);
    for (i = 0; i < count; i++)
        if (!springls__valid_point(vertices + 9 * i) || !springls__valid_point(vertices + 9 * i + 3)
            || !springls__valid_point(vertices + 9 * i + 6) || !springls__valid_point(particles ? particles + 3 * i : NULL)
            || !springls__valid_point(correspondences ? correspondences + 3 * i : NULL))
            return springls__fail(ctx, SPRINGLS_NON_FINITE,
                                  "set_springls: a coordinate of springl %d is NaN or not between -1e6 and 1e6 voxels", i);
    return SPRINGLS_OK;
}

/* Fills an empty model with the springls, and a level set that follows from them. particles NULL: the centroids. */
SPRINGLS__FN springls_status springls__take_springls(springls_context *ctx, const float *vertices, const float *particles,
                                                     int count)
{
    int i, m;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, count));
    for (i = 0; i < count; i++) {
        springls__springl s;
        for (m = 0; m < 3; m++) s.q[m] = springls__load3(vertices + 9 * i + 3 * m);
        s.p = particles ? springls__load3(particles + 3 * i) : springls__tri_centroid(springls__springl_tri(s));
        springls__constellation_append(ctx, &s, s.p, 0, 0);
    }
    SPRINGLS__TRY(springls__run_table(ctx, springls__unsigned_to_signed));
    for (i = 0; i < 4; i++) {
        SPRINGLS__TRY(springls__run_table(ctx, springls__evolve));
        SPRINGLS__TRY(springls__run_table(ctx, springls__rebuild));
    }
    return springls__make_original(ctx);
}

SPRINGLS_API springls_status springls_set_springls(springls_context *ctx, const float *vertices, const float *particles,
                                                   const float *correspondences, int count)
{
    springls_status status;
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_springls(ctx, vertices, particles, correspondences, count));
    springls__clear_model(ctx);
    status = springls__take_springls(ctx, vertices, particles, count);
    for (i = 0; i < count && status == SPRINGLS_OK && correspondences; i++)
        ctx->model.set.a[i] = springls__load3(correspondences + 3 * i);
    return springls__clear_on_failure(ctx, status);
}

#endif
