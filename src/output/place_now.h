/* place_now.h - where material points are now: the inverse of the correspondence. Springls whose correspondences are near a place of the
   original surface give an affine map to the present. It is corrected until the correspondence of the place that it gives, by the
   quadratic fit of the springls there, is the point that was asked for. Fits know correspondences on the surface alone: of a point off it
   the foot is found so, and the map takes the rest along. */
#ifndef SPRINGLS__OUTPUT_PLACE_NOW_H
#define SPRINGLS__OUTPUT_PLACE_NOW_H

#include "error_estimates.h"
#include "query.h"

typedef struct springls__place_query {
    const springls_context *ctx;
    const float *points;
    springls_material_place *out;
} springls__place_query;

/* Springls whose side on the original surface is known: it takes a search, and each round of a fit asks for those of nearly the same
   springls. */
enum { SPRINGLS__SIDES_KNOWN = 256 };

/* The springls around a place on the original surface: the nearest, whose side counts, and a radius, voxels. */
typedef struct springls__place_search {
    springls__v3 a, normal; /* on the original surface                                         */
    int nearest;
    float radius;
    int triangle;           /* of the original surface, the last one found: the next is near it */
    struct { int springl; bool same; } side[SPRINGLS__SIDES_KNOWN];
} springls__place_search;

/* Returns the unit normal of the original surface at a correspondence; zero without one. */
SPRINGLS__FN springls__v3 springls__original_normal(const springls_context *ctx, springls__place_search *at, springls__v3 a)
{
    const springls__surface_hit hit = springls__surface_closest_from(&ctx->original, a, FLT_MAX, at->triangle);
    at->triangle = hit.triangle;
    if (hit.triangle < 0) return springls__v3_make(0.0f, 0.0f, 0.0f);
    return springls__tri_normal(springls__surface_triangle(&ctx->original, hit.triangle));
}

/* Returns whether springl i comes from the same side of the original surface as the nearest one. */
SPRINGLS__FN bool springls__is_on_same_side(const springls_context *ctx, springls__place_search *at, int i)
{
    const int n = i % SPRINGLS__SIDES_KNOWN;
    if (at->side[n].springl != i) {
        at->side[n].springl = i;
        at->side[n].same = !(springls__dot(springls__original_normal(ctx, at, ctx->model.set.a[i]), at->normal) < 0.0f);
    }
    return at->side[n].same;
}

/* Finds the springl with the nearest correspondence within four voxels: further away the surface is gone. */
SPRINGLS__FN springls__place_search springls__place_search_of(const springls__place_query *q, springls__v3 a)
{
    const springls__v3 *from = q->ctx->model.set.a;
    springls__place_search place;
    springls__near_walk walk = springls__near_walk_begin(&q->ctx->correspondences, a, 4.0f);
    float d2, least = 16.0f;
    int i;
    place.a = a;
    place.nearest = place.triangle = -1;
    for (i = 0; i < SPRINGLS__SIDES_KNOWN; i++) place.side[i].springl = -1;
    while ((i = springls__near_walk_next(&walk)) >= 0) {
        d2 = springls__length2(springls__sub(from[i], a));
        if (d2 > least || (d2 == least && place.nearest >= 0 && i > place.nearest)) continue;
        least = d2;
        place.nearest = i;
    }
    place.normal = springls__original_normal(q->ctx, &place, place.nearest < 0 ? a : from[place.nearest]);
    place.radius = 2.5f + springls__sqrt(least);
    return place;
}

/* Fits the present places of springls on the same side to their correspondences around `a`. Returns false when they are too few. */
SPRINGLS__FN bool springls__fit_place(const springls__place_query *q, springls__place_search *at, springls__v3 a, springls__v3 *place)
{
    const springls__constellation *set = &q->ctx->model.set;
    const springls__v3 normal_now = springls__springl_normal(set->s[at->nearest]);
    springls__near_walk walk = springls__near_walk_begin(&q->ctx->correspondences, a, at->radius);
    springls__affine_fit fit;
    int i;
    memset(&fit, 0, sizeof fit);
    while ((i = springls__near_walk_next(&walk)) >= 0) {
        const springls__v3 r = springls__sub(set->a[i], a);
        const float d2 = springls__length2(r) / (at->radius * at->radius);
        if (d2 >= 1.0f || !(springls__dot(springls__springl_normal(set->s[i]), normal_now) > 0.0f)) continue;
        if (!springls__is_on_same_side(q->ctx, at, i)) continue;
        springls__affine_fit_add(&fit, r, set->s[i].p, (double)((1.0f - d2) * (1.0f - d2)));
    }
    if (fit.count < 4) return false;
    springls__affine_fit_normal(&fit, q->ctx->model.grid.metric, at->normal, normal_now, 0.1 * fit.weight);
    return springls__affine_fit_solve(&fit, place);
}

/* Finds the present place of a point of the original surface. Returns how far its correspondence is from the point along the surface,
   voxels: across it the fits of springls say nothing. */
SPRINGLS__FN float springls__invert_correspondence(const springls__place_query *q, springls__place_search *at, springls__v3 *place)
{
    const springls_context *ctx = q->ctx;
    springls__v3 aim = at->a, best = ctx->model.set.s[at->nearest].p, x;
    float least = springls__length(springls__sub(ctx->model.set.a[at->nearest], at->a));
    int round;
    for (round = 0; round < 4 && springls__fit_place(q, at, aim, &x); round++) {
        springls__v3 missing;
        int nearest = springls__nearest_springl_facing(&ctx->model, x, springls__springl_normal(ctx->model.set.s[at->nearest]), 2.0f);
        if (nearest < 0) nearest = at->nearest;
        missing = springls__sub(at->a, springls__correspondence_at(&ctx->model, nearest, x));
        missing = springls__mad(missing, at->normal, -springls__dot(missing, at->normal));
        if (springls__length(missing) < least) {
            least = springls__length(missing);
            best = x;
        }
        aim = springls__add(aim, missing);
    }
    *place = best;
    return least;
}

/* Moves the point that is asked for to its foot on the original surface. */
SPRINGLS__FN void springls__take_to_surface(const springls_context *ctx, springls__place_search *at)
{
    const springls__surface_hit hit = springls__surface_closest_from(&ctx->original, at->a, FLT_MAX, at->triangle);
    if (hit.triangle >= 0) at->a = hit.hit.point;
}

/* Returns the offset from the foot on the original surface to `to`, as it is now. */
SPRINGLS__FN springls__v3 springls__way_now(const springls__place_query *q, springls__place_search *at, springls__v3 to)
{
    springls__v3 here, there;
    if (!springls__fit_place(q, at, at->a, &here) || !springls__fit_place(q, at, to, &there)) return springls__sub(to, at->a);
    return springls__sub(there, here);
}

SPRINGLS__FN void springls__place_now_task(void *arg, int begin, int end)
{
    const springls__place_query *q = (const springls__place_query *)arg;
    const springls_context *ctx = q->ctx;
    const springls__model *model = &ctx->model;
    const float tilt = 0.05f; /* error for each voxel off the surface: triangles are tilted against it */
    for (; begin < end; begin++) {
        springls_material_place *out = &q->out[begin];
        springls__place_search at = springls__place_search_of(q, springls__world_to_original(ctx, q->points + 3 * (size_t)begin));
        const springls__v3 asked = at.a;
        springls__v3 x, n;
        float missed;
        memset(out, 0, sizeof *out);
        out->springl = at.nearest;
        out->error = FLT_MAX;
        if (at.nearest < 0) continue;
        out->id = model->set.id[at.nearest];
        springls__take_to_surface(ctx, &at);
        missed = springls__invert_correspondence(q, &at, &x) + tilt * springls__length(springls__sub(asked, at.a));
        n = springls__springl_normal(model->set.s[at.nearest]);
        springls__voxel_to_world(ctx, springls__add(x, springls__way_now(q, &at, asked)), out->place);
        out->error = springls__estimate_error(ctx, x, n, at.a, missed + springls__error_at_birth(model, x, n, at.a, model->set.count),
                                              false).place;
    }
}

/* Makes the hierarchy over the correspondences, each a triangle of one point, where springls have changed. */
SPRINGLS__FN springls_status springls__find_correspondences(springls_context *ctx)
{
    const int count = ctx->model.set.count;
    int i, m;
    if (ctx->correspondences_version == ctx->model_version) return SPRINGLS_OK;
    ctx->correspondences_version = 0;
    SPRINGLS__TRY(springls__surface_reserve(ctx, &ctx->correspondences, count));
    for (i = 0; i < count; i++)
        for (m = 0; m < 3; m++) ctx->correspondences.points[3 * i + m] = ctx->model.set.a[i];
    SPRINGLS__TRY(springls__surface_finish(ctx, &ctx->correspondences, count));
    ctx->correspondences_version = ctx->model_version;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_place_now(springls_context *ctx, const float *points, int count, springls_material_place *out)
{
    springls__place_query q;
    SPRINGLS__TRY(springls__check_points(ctx, points, count, out, "place_now"));
    SPRINGLS__TRY(springls__begin_reading(ctx));
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__read_cell_list(ctx));
    SPRINGLS__TRY(springls__find_correspondences(ctx));
    q.ctx = ctx;
    q.points = points;
    q.out = out;
    springls__parallel(ctx, count, 8, springls__place_now_task, &q);
    return SPRINGLS_OK;
}

#endif
