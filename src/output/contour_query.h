/* contour_query.h - finds closest points, rays' hits and insides on the mesh of what springls hold (params.contouring), by a hierarchy over
   its triangles in model coordinates (springl_surface.h). */
#ifndef SPRINGLS__OUTPUT_CONTOUR_QUERY_H
#define SPRINGLS__OUTPUT_CONTOUR_QUERY_H

#include "../model/bvh.h"
#include "../model/ray.h"
#include "../model/transform.h"
#include "../solver/follow.h"
#include "../stages/surface_table.h"
#include "zero_level.h"

/* Returns whether the watertight surface is what springls hold. While a step is in progress, whose working memory the mesh would take, it
   is the zero level. */
SPRINGLS__FN bool springls__shows_springls(const springls_context *ctx)
{
    return ctx->model.params.contouring == SPRINGLS_CONTOURING_SPRINGLS && !ctx->step.active;
}

/* Makes the hierarchy of the triangles that the table has. */
SPRINGLS__FN springls_status springls__make_contour_hierarchy(springls_context *ctx)
{
    springls__raw_mesh mesh;
    int k;
    ctx->contour_surface.count = 0;
    if (ctx->surface_triangles == 0) return SPRINGLS_OK;
    springls__use_surface_mesh(ctx, &mesh);
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->contour_surface, ctx->surface_triangles));
    for (k = 0; k < 3 * ctx->surface_triangles; k++)
        ctx->contour_surface.points[k] = springls__voxel_to_model(ctx, mesh.positions[mesh.triangles[k]]);
    return springls__surface_finish(ctx, &ctx->contour_surface, ctx->surface_triangles);
}

/* Prepares what the mesh is made from. Phi must have followed. */
SPRINGLS__FN springls_status springls__prepare_contour(springls_context *ctx)
{
    SPRINGLS__TRY(springls__use_host(ctx, false));
    return springls__read_cell_list(ctx);
}

/* Makes the mesh and the hierarchy where the model has changed. Phi must have followed. */
SPRINGLS__FN springls_status springls__contour_surface_refresh(springls_context *ctx)
{
    SPRINGLS__TRY(springls__prepare_contour(ctx));
    SPRINGLS__TRY(springls__refresh_surface_mesh(ctx));
    if (ctx->contour_surface_version == ctx->surface_version) return SPRINGLS_OK;
    ctx->contour_surface_version = 0;
    SPRINGLS__TRY(springls__make_contour_hierarchy(ctx));
    ctx->contour_surface_version = ctx->surface_version;
    return SPRINGLS_OK;
}

/* Converts a hit on the mesh to voxels; n: between the normals of its vertices. */
SPRINGLS__FN springls__level_hit springls__contour_hit(const springls_context *ctx, const springls__surface_hit *h)
{
    springls__raw_mesh mesh;
    springls__level_hit found;
    int k;
    found.found = h->triangle >= 0;
    found.place = found.n = springls__v3_make(0.0f, 0.0f, 0.0f);
    springls__use_surface_mesh(ctx, &mesh);
    for (k = 0; found.found && k < 3; k++) {
        const int v = mesh.triangles[3 * (size_t)h->triangle + (size_t)k];
        found.place = springls__mad(found.place, mesh.positions[v], h->hit.bary[k]);
        found.n = springls__mad(found.n, mesh.normals[v], h->hit.bary[k]);
    }
    return found;
}

/* Returns the direction of rays that tell inside from outside: along no axis, plane or diagonal of the grid. */
SPRINGLS__FN springls__v3 springls__way_out(void) { return springls__v3_make(0.61237f, 0.53033f, 0.58631f); }

/* Returns whether the first hit of a ray along springls__way_out is one from behind: then its beginning is inside. */
SPRINGLS__FN bool springls__comes_from_inside(const springls_context *ctx, const springls__surface_hit *h)
{
    float facing;
    if (h->triangle < 0) return false;
    facing = springls__dot(springls__tri_area2(springls__surface_triangle(&ctx->contour_surface, h->triangle)), springls__way_out());
    return springls__is_mirrored(ctx) ? facing < 0.0f : facing > 0.0f;
}

/* Returns where a ray from a place, model coordinates, leaves the mesh that bounds it: there it meets the mesh first, from behind. No
   triangle: the place is outside. */
SPRINGLS__FN springls__surface_hit springls__contour_exit(const springls_context *ctx, springls__v3 x)
{
    springls__surface_hit h = springls__surface_ray(&ctx->contour_surface, x, springls__way_out(), 1e18f);
    if (!springls__comes_from_inside(ctx, &h)) h.triangle = -1;
    return h;
}

typedef struct springls__contour_inside { const springls_context *ctx; const float *points; uint8_t *out; } springls__contour_inside;

SPRINGLS__FN void springls__contour_inside_task(void *arg, int begin, int end)
{
    const springls__contour_inside *q = (const springls__contour_inside *)arg;
    for (; begin < end; begin++)
        q->out[begin] = springls__contour_exit(q->ctx, springls__world_to_model(q->ctx, q->points + 3 * (size_t)begin)).triangle >= 0;
}

#endif
