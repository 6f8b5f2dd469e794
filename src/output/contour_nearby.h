/* contour_nearby.h - closest points, rays' hits and insides for few places on the mesh of what springls hold, without making all of it.

     a ray:    the first two layers of bricks that it meets  -->  their triangles  -->  hit?  -- no: the next two layers
     a place:  the bricks as near as the zero level          -->  their triangles  -->  as near?  -- no: the bricks as near as that

   A table of some bricks has the same bits as that of all, except beside cells in which triangles would cross: those change their neighbors
   (springls__simplify_cells), and springls that contradict each other, as in noise, have some. What queries of one version of the model
   make together costs at most about as much as the whole mesh: after that it is made. */
#ifndef SPRINGLS__OUTPUT_CONTOUR_NEARBY_H
#define SPRINGLS__OUTPUT_CONTOUR_NEARBY_H

#include "../model/closest_point.h"
#include "contour_query.h"

#define SPRINGLS__FEW_QUERIES 16       /* of more in one call the whole mesh is made                        */
#define SPRINGLS__LAYERS 2             /* of bricks across a ray that are made at once                      */
#define SPRINGLS__MOST_NEARBY 64       /* bricks that are made at once. A ray meets 9 of a layer at most, of 4 layers */
#define SPRINGLS__NEARBY_BOX 4096      /* bricks that are looked at around one place                        */
#define SPRINGLS__LAYER_SLACK 1e-3     /* voxels: exceeds how far rounding moves a place                    */

/* Returns whether the next of `count` queries may make parts of the mesh: there is no whole one, and parts have cost less. */
SPRINGLS__FN bool springls__may_query_nearby(const springls_context *ctx, int count)
{
    const bool counted = ctx->nearby_version == ctx->model_version;
    return count <= SPRINGLS__FEW_QUERIES && springls__surface_is_stale(ctx)
        && (!counted || ctx->nearby_bricks <= 2 * ctx->model.grid.active_count);
}

/* ---- the bricks ---- */

/* Returns whether there may be triangles in the brick at a place: where springls are around, phi changes its sign, or the domain ends. */
SPRINGLS__FN bool springls__may_have_triangles(const springls_context *ctx, const int place[3])
{
    const springls__grid *g = &ctx->model.grid;
    bool inside = false, outside = false, active = false, ends = false;
    int d, at[3], v;
    for (d = 0; d < 27; d++) {
        int slot;
        springls__place_around(place, d, at);
        slot = springls__slot_of_brick_place(g, at);
        if (slot < SPRINGLS__FIRST_SLOT) {
            ends = ends || !springls__grid_contains(g, SPRINGLS__BRICK * at[0], SPRINGLS__BRICK * at[1], SPRINGLS__BRICK * at[2]);
            continue;
        }
        active = true;
        if (springls__cells_of(g, slot)[0] != springls__cells_of(g, slot)[SPRINGLS__CELLS - 1]) return true;
        for (v = 0; v < SPRINGLS__BRICK_VOXELS && !(inside && outside); v++) {
            const bool is_inside = g->phi[(size_t)slot * SPRINGLS__BRICK_VOXELS + (size_t)v] < 0.0f;
            inside = inside || is_inside;
            outside = outside || !is_inside;
        }
    }
    return active && (ends || (inside && outside));
}

/* The keys of bricks that are to be made. */
typedef struct springls__nearby { uint64_t key[SPRINGLS__MOST_NEARBY]; int bricks; } springls__nearby;

/* Adds the bricks from `lower` to `upper` that may have triangles. */
SPRINGLS__FN void springls__add_nearby(const springls_context *ctx, const int lower[3], const int upper[3], springls__nearby *nearby)
{
    int place[3];
    for (place[2] = lower[2]; place[2] <= upper[2]; place[2]++)
        for (place[1] = lower[1]; place[1] <= upper[1]; place[1]++)
            for (place[0] = lower[0]; place[0] <= upper[0]; place[0]++)
                if (nearby->bricks < SPRINGLS__MOST_NEARBY && springls__may_have_triangles(ctx, place))
                    nearby->key[nearby->bricks++] = springls__place_key(place);
}

/* Makes the triangles of bricks, and their hierarchy. */
SPRINGLS__FN springls_status springls__make_nearby(springls_context *ctx, springls__nearby *nearby)
{
    int *region, i;
    springls__forget_surface(ctx);
    ctx->contour_surface_version = 0;
    ctx->contour_surface.count = 0;
    if (ctx->nearby_version != ctx->model_version) ctx->nearby_bricks = 0;
    ctx->nearby_version = ctx->model_version;
    if (nearby->bricks == 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__reserve_table(ctx, SPRINGLS__SURFACE_REGION, 3 * (size_t)nearby->bricks, sizeof(int)));
    region = (int *)ctx->surface_memory[SPRINGLS__SURFACE_REGION].data;
    springls__sort_keys(nearby->key, (size_t)nearby->bricks);
    for (i = 0; i < nearby->bricks; i++) springls__place_of_key(nearby->key[i], region + 3 * i);
    ctx->surface_region = nearby->bricks;
    SPRINGLS__TRY(springls__run_table(ctx, springls__surface_kernels));
    ctx->nearby_bricks += ctx->surface_bricks;
    return springls__make_contour_hierarchy(ctx);
}

/* ---- rays ---- */

/* A ray in voxels, by the parameter that it has in model coordinates. It is followed through the layers of bricks across `axis`. */
typedef struct springls__layered_ray { double from[3], along[3]; int axis, last[3]; } springls__layered_ray;

SPRINGLS__FN springls__layered_ray springls__layers_of_ray(const springls_context *ctx, springls__v3 x, springls__v3 direction)
{
    springls__layered_ray ray;
    int k;
    springls__model_to_voxel(ctx, x, ray.from);
    springls__model_to_voxel(ctx, direction, ray.along);
    ray.axis = 0;
    for (k = 0; k < 3; k++) {
        ray.last[k] = (ctx->model.grid.size[k] + SPRINGLS__BRICK - 1) / SPRINGLS__BRICK;
        if (fabs(ray.along[k]) > fabs(ray.along[ray.axis])) ray.axis = k;
    }
    return ray;
}

/* Returns the brick along an axis that a coordinate lies in, of those from -1 to `last` the nearest one. */
SPRINGLS__FN int springls__brick_along(double x, int last)
{
    const double brick = floor(x / SPRINGLS__BRICK);
    return brick < -1.0 ? -1 : brick > (double)last ? last : (int)brick;
}

/* Returns the parameter with which the ray comes to the lower (0) or upper (1) side of a layer. */
SPRINGLS__FN double springls__layer_side(const springls__layered_ray *ray, int layer, int side)
{
    return ((double)(SPRINGLS__BRICK * (layer + side)) - ray->from[ray->axis]) / ray->along[ray->axis];
}

/* Adds the bricks of a layer that the ray meets within `longest`. */
SPRINGLS__FN void springls__add_layer(const springls_context *ctx, const springls__layered_ray *ray, int layer, double longest,
                                      springls__nearby *nearby)
{
    const bool forward = ray->along[ray->axis] > 0.0;
    const double enters = springls__layer_side(ray, layer, !forward), leaves = springls__layer_side(ray, layer, forward);
    int lower[3], upper[3], k;
    if (layer < -1 || layer > ray->last[ray->axis]) return;
    for (k = 0; k < 3; k++) {
        const double a = ray->from[k] + ray->along[k] * (enters > 0.0 ? enters : 0.0);
        const double b = ray->from[k] + ray->along[k] * (leaves < longest ? leaves : longest);
        lower[k] = springls__brick_along((a < b ? a : b) - SPRINGLS__LAYER_SLACK, ray->last[k]);
        upper[k] = springls__brick_along((a < b ? b : a) + SPRINGLS__LAYER_SLACK, ray->last[k]);
    }
    lower[ray->axis] = upper[ray->axis] = layer;
    springls__add_nearby(ctx, lower, upper, nearby);
}

/* Finds the first hit of a ray on the parts of the mesh that it meets. */
SPRINGLS__FN springls_status springls__follow_nearby(springls_context *ctx, springls__v3 x, springls__v3 direction, float longest,
                                                     springls__surface_hit *hit)
{
    const springls__layered_ray ray = springls__layers_of_ray(ctx, x, direction);
    const int axis = ray.axis, step = ray.along[axis] > 0.0 ? 1 : -1;
    int layer = springls__brick_along(ray.from[axis] - step * SPRINGLS__LAYER_SLACK, ray.last[axis]), layers = SPRINGLS__LAYERS;
    memset(hit, 0, sizeof *hit);
    hit->triangle = -1;
    while (layer >= -1 && layer <= ray.last[axis] && springls__layer_side(&ray, layer, step < 0) <= (double)longest) {
        const double ends = springls__layer_side(&ray, layer + step * (layers - 1), step > 0);
        springls__nearby nearby;
        int k;
        nearby.bricks = 0;
        for (k = 0; k < layers; k++) springls__add_layer(ctx, &ray, layer + step * k, (double)longest, &nearby);
        SPRINGLS__TRY(springls__make_nearby(ctx, &nearby));
        *hit = springls__surface_ray(&ctx->contour_surface, x, direction, longest);
        if (hit->triangle < 0) {
            layer += step * layers;
            layers = SPRINGLS__LAYERS;
            continue;
        }
        if (layers > SPRINGLS__LAYERS || (double)hit->t < ends - SPRINGLS__LAYER_SLACK / fabs(ray.along[axis])) break;
        layers = 2 * SPRINGLS__LAYERS; /* a hit where they end: the layer behind may have an earlier one beside it */
    }
    return SPRINGLS_OK;
}

/* Finds the first hit of a ray, model coordinates, one of `count` queries: its triangle is of ctx->contour_surface. */
SPRINGLS__FN springls_status springls__nearby_ray(springls_context *ctx, int count, springls__v3 x, springls__v3 direction, float longest,
                                                  springls__surface_hit *hit)
{
    if (springls__may_query_nearby(ctx, count)) return springls__follow_nearby(ctx, x, direction, longest, hit);
    SPRINGLS__TRY(springls__contour_surface_refresh(ctx));
    *hit = springls__surface_ray(&ctx->contour_surface, x, direction, longest);
    return SPRINGLS_OK;
}

/* ---- closest points ---- */

/* Lists the bricks that come within a radius of the place of a search, model units. Returns false when they are too many. */
SPRINGLS__FN bool springls__list_within(const springls_context *ctx, const springls__level_search *search, float radius,
                                        springls__nearby *nearby)
{
    int looked_at = 1, k, lower[3], upper[3], place[3];
    nearby->bricks = 0;
    for (k = 0; k < 3; k++) {
        const int last = (ctx->model.grid.size[k] + SPRINGLS__BRICK - 1) / SPRINGLS__BRICK;
        lower[k] = springls__brick_along((double)search->at[k] - (double)(radius / search->weight[k]), last);
        upper[k] = springls__brick_along((double)search->at[k] + (double)(radius / search->weight[k]), last);
        if (upper[k] - lower[k] >= SPRINGLS__NEARBY_BOX / looked_at) return false;
        looked_at *= upper[k] - lower[k] + 1;
    }
    for (place[2] = lower[2]; place[2] <= upper[2]; place[2]++)
        for (place[1] = lower[1]; place[1] <= upper[1]; place[1]++)
            for (place[0] = lower[0]; place[0] <= upper[0]; place[0]++) {
                int from[3], to[3];
                for (k = 0; k < 3; k++) to[k] = (from[k] = SPRINGLS__BRICK * place[k]) + SPRINGLS__BRICK;
                if (springls__level_box2(search, from, to) > radius * radius) continue;
                springls__add_nearby(ctx, place, place, nearby);
            }
    return nearby->bricks < SPRINGLS__MOST_NEARBY;
}

/* Finds the place closest to a point of the world, x in model coordinates, on the parts of the mesh that are near. found: false if they
   would be too many. */
SPRINGLS__FN springls_status springls__search_nearby(springls_context *ctx, const float *point, springls__v3 x, springls__surface_hit *hit,
                                                     bool *found)
{
    springls__level_search search;
    float radius;
    int tries;
    *found = false;
    springls__level_search_begin(ctx, &search);
    if (!springls__level_closest(&search, point).found) return SPRINGLS_OK;
    radius = springls__sqrt(search.d2) + 1.0f;
    for (tries = 0; tries < 2 && !*found; tries++) {
        springls__nearby nearby;
        float d;
        if (!springls__list_within(ctx, &search, radius, &nearby)) break;
        SPRINGLS__TRY(springls__make_nearby(ctx, &nearby));
        *hit = springls__surface_closest(&ctx->contour_surface, x, FLT_MAX);
        if (hit->triangle < 0) break;
        d = springls__sqrt(hit->hit.d2) + 2.0f * search.slack;
        *found = d <= radius;
        radius = d;
    }
    return SPRINGLS_OK;
}

/* Finds the place of the mesh closest to a point of the world, one of `count` queries: its triangle is of ctx->contour_surface. */
SPRINGLS__FN springls_status springls__nearby_closest(springls_context *ctx, int count, const float *point, springls__surface_hit *hit)
{
    const springls__v3 x = springls__world_to_model(ctx, point);
    bool found = false;
    if (springls__may_query_nearby(ctx, count)) SPRINGLS__TRY(springls__search_nearby(ctx, point, x, hit, &found));
    if (found) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__contour_surface_refresh(ctx));
    *hit = springls__surface_closest(&ctx->contour_surface, x, FLT_MAX);
    return SPRINGLS_OK;
}

#endif
