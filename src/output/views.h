/* views.h - reads the springls and the level set: views, packed forms, dense copies. */
#ifndef SPRINGLS__OUTPUT_VIEWS_H
#define SPRINGLS__OUTPUT_VIEWS_H

#include "../runtime/errors.h"
#include "../model/host_access.h"
#include "../model/transform.h"
#include "../solver/follow.h"

SPRINGLS_API int springls_count(const springls_context *ctx) { return ctx ? ctx->model.set.count : 0; }

/* Returns a view of an array of the springls, after copying it from the device if need be. array: SPRINGLS__BIT of it. */
SPRINGLS__FN springls_view springls__view(const springls_context *ctx, uint64_t array, const void *data, size_t stride)
{
    springls_view view;
    springls__ensure_on_host(ctx, array);
    view.count = springls_count(ctx);
    view.data = view.count ? (const float *)data : NULL;
    view.stride = stride;
    return view;
}

SPRINGLS_API springls_view springls_view_vertices(const springls_context *ctx)
{
    return springls__view(ctx, SPRINGLS__BIT(S), ctx && ctx->model.set.s ? ctx->model.set.s->q : NULL, sizeof(springls__springl));
}

SPRINGLS_API springls_view springls_view_particles(const springls_context *ctx)
{
    return springls__view(ctx, SPRINGLS__BIT(S), ctx && ctx->model.set.s ? &ctx->model.set.s->p : NULL,
                          sizeof(springls__springl));
}

SPRINGLS_API springls_view springls_view_correspondences(const springls_context *ctx)
{
    return springls__view(ctx, SPRINGLS__BIT(A), ctx ? ctx->model.set.a : NULL, sizeof(springls__v3));
}

SPRINGLS_API const uint32_t *springls_ids(const springls_context *ctx)
{
    springls__ensure_on_host(ctx, SPRINGLS__BIT(ID));
    return ctx ? ctx->model.set.id : NULL;
}

SPRINGLS_API const uint32_t *springls_generations(const springls_context *ctx)
{
    springls__ensure_on_host(ctx, SPRINGLS__BIT(GENERATION));
    return ctx ? ctx->model.set.generation : NULL;
}

SPRINGLS_API springls_status springls_pack_matrix(springls_context *ctx, float *out)
{
    int i, m;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__read_level_set(ctx));
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI)));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "pack_matrix: NULL array");
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__springl *s = &ctx->model.set.s[i];
        float *row = out + 16 * (size_t)i;
        memcpy(row, &s->p, 3 * sizeof *row);
        row[3] = springls__grid_sample(&ctx->model.grid, ctx->model.grid.phi, s->p);
        for (m = 0; m < 3; m++) memcpy(row + 4 * m + 4, &s->q[m], 3 * sizeof *row);
        row[7] = ctx->model.set.a[i].x; row[11] = ctx->model.set.a[i].y; row[15] = ctx->model.set.a[i].z;
    }
    return SPRINGLS_OK;
}

/* Returns the direction of grad phi at a springl's particle (section 6); the normal of its triangle where phi has next to no
   gradient. */
SPRINGLS__FN springls__v3 springls__surfel_normal(const springls__grid *g, springls__springl s)
{
    springls__v3 gradient = springls__grid_gradient(g, g->phi, s.p);
    return springls__length2(gradient) > 0.01f ? gradient : springls__springl_normal(s);
}

/* Sets the radius to the distance of the furthest vertex, so that the surfels cover what the triangles cover. */
SPRINGLS_API springls_status springls_extract_surfels(springls_context *ctx, float *out)
{
    int i, m;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__read_level_set(ctx));
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI)));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "extract_surfels: NULL array");
    for (i = 0; i < ctx->model.set.count; i++) {
        const springls__springl *s = &ctx->model.set.s[i];
        springls__v3 n = springls__normal_to_world(ctx, springls__surfel_normal(&ctx->model.grid, *s));
        float *surfel = out + 7 * (size_t)i;
        springls__voxel_to_world(ctx, s->p, surfel);
        surfel[3] = n.x; surfel[4] = n.y; surfel[5] = n.z;
        surfel[6] = 0.0f;
        for (m = 0; m < 3; m++) {
            springls__v3 to = springls__voxel_to_model(ctx, springls__sub(s->q[m], s->p));
            surfel[6] = springls__max(surfel[6], springls__length(to) * ctx->smallest_spacing);
        }
    }
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_copy_level_set(springls_context *ctx, float *out)
{
    const springls__grid *g;
    int x, y, z;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__read_level_set(ctx));
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI)));
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "copy_level_set: NULL array");
    g = &ctx->model.grid;
    for (z = 0; z < g->size[2]; z++)
        for (y = 0; y < g->size[1]; y++)
            for (x = 0; x < g->size[0]; x += SPRINGLS__BRICK) { /* one row of a brick */
                int n = springls__imin(SPRINGLS__BRICK, g->size[0] - x);
                const float *brick = g->phi + (size_t)springls__slot_of_voxel(g, x, y, z) * SPRINGLS__BRICK_VOXELS;
                memcpy(out, brick + springls__voxel_in_brick(x, y, z), (size_t)n * sizeof *out);
                out += n;
            }
    return SPRINGLS_OK;
}

#endif
