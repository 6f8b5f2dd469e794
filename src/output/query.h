/* query.h - samples the level set, and finds closest points and ray hits, for batches of points in world coordinates. */
#ifndef SPRINGLS__OUTPUT_QUERY_H
#define SPRINGLS__OUTPUT_QUERY_H

#include "../runtime/finite.h"
#include "../../kernels_embed/model/neighborhood.h"
#include "../../kernels_embed/stages/track.h"
#include "../runtime/errors.h"
#include "../runtime/parallel.h"
#include "../runtime/residency.h"
#include "../model/closest_point.h"
#include "../model/host_access.h"
#include "../model/ray.h"
#include "../model/springl_surface.h"
#include "../model/transform.h"
#include "../solver/follow.h"
#include "contour_nearby.h"
#include "zero_level.h"

/* Fails when an array is missing or a point is not finite. */
SPRINGLS__FN springls_status springls__check_points(springls_context *ctx, const float *points, int count, const void *out,
                                                    const char *name)
{
    size_t i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (count < 0) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: the count %d is negative", name, count);
    if (count > 0 && (!points || !out)) return springls__fail_null(ctx, name, points ? "out" : "points");
    for (i = 0; i < 3 * (size_t)count; i++)
        if (!springls__finite_float(points[i]))
            return springls__fail(ctx, SPRINGLS_NON_FINITE, "%s: point %lu is not finite", name, (unsigned long)(i / 3));
    return SPRINGLS_OK;
}

/* ---- the level set ---- */

typedef struct springls__field_query {
    const springls_context *ctx;
    const float *points;
    float *out;
    uint8_t *inside;
} springls__field_query;

/* Finds whether the distance at a world point is that to the closest place of the zero level, which search->best and d2 then have: where
   the spacing is not uniform, within the band. Else phi is it. */
SPRINGLS__FN bool springls__needs_closest(springls__level_search *search, const float *point, float phi)
{
    const springls__grid *g = &search->ctx->model.grid;
    return !springls__is_uniform(g->metric) && springls__fabs(phi) < g->far_value && springls__level_closest(search, point).found;
}

/* Samples the signed distance in world units, or where phi is negative. */
SPRINGLS__FN void springls__sample_distance_task(void *arg, int begin, int end)
{
    const springls__field_query *q = (const springls__field_query *)arg;
    const springls_context *ctx = q->ctx;
    const springls__grid *g = &ctx->model.grid;
    springls__level_search search;
    int i;
    springls__level_search_begin(ctx, &search);
    for (i = begin; i < end; i++) {
        const float *point = q->points + 3 * (size_t)i;
        float phi = springls__grid_sample(g, g->phi, springls__world_to_voxel(ctx, point));
        if (q->inside) {
            q->inside[i] = phi < 0.0f;
            continue;
        }
        if (springls__needs_closest(&search, point, phi)) {
            const float distance = springls__min(springls__sqrt(search.d2), g->far_value); /* what all directions reach */
            phi = phi < 0.0f ? -distance : distance;
        }
        q->out[i] = phi * ctx->smallest_spacing;
    }
}

/* Returns the gradient of the distance at a world point if the spacing is not uniform and phi has the gradient g: of unit length
   within the band. */
SPRINGLS__FN springls__v3 springls__world_gradient(springls__level_search *search, const float *point, springls__v3 x, springls__v3 g)
{
    const float close = 0.5f; /* smallest spacings: nearer to a triangle its corners would show, and phi's normal is as good */
    const springls_context *ctx = search->ctx;
    const springls__grid *grid = &ctx->model.grid;
    const springls__v3 normal = springls__normal_to_world(ctx, g);
    const float phi = springls__grid_sample(grid, grid->phi, x);
    springls__v3 away;
    if (!springls__needs_closest(search, point, phi)) return springls__scale(normal, springls__length(g));
    if (search->d2 < close * close) return normal;
    away = springls__normalize(springls__voxel_to_model(ctx, springls__sub(x, search->best.place)));
    return phi < 0.0f ? springls__scale(away, -1.0f) : away;
}

SPRINGLS__FN void springls__sample_gradient_task(void *arg, int begin, int end)
{
    const springls__field_query *q = (const springls__field_query *)arg;
    const springls_context *ctx = q->ctx;
    const springls__grid *grid = &ctx->model.grid;
    springls__level_search search;
    int i;
    springls__level_search_begin(ctx, &search);
    for (i = begin; i < end; i++) {
        const float *point = q->points + 3 * (size_t)i;
        float *out = q->out + 3 * (size_t)i;
        const springls__v3 x = springls__world_to_voxel(ctx, point), g = springls__grid_gradient(grid, grid->phi, x);
        if (springls__is_uniform(grid->metric)) springls__covector_to_world(ctx, g, (double)ctx->smallest_spacing, out);
        else {
            const springls__v3 world = springls__world_gradient(&search, point, x, g);
            memcpy(out, &world.x, 3 * sizeof *out);
        }
    }
}

SPRINGLS__FN springls_status springls__field_query_run(springls_context *ctx, const float *points, int count, float *out,
                                                       uint8_t *inside, springls_task task, const char *name)
{
    springls__field_query q;
    SPRINGLS__TRY(springls__check_points(ctx, points, count, inside ? (const void *)inside : (const void *)out, name));
    SPRINGLS__TRY(springls__read_level_set(ctx));
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(TOP) | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE)
                                           | SPRINGLS__BIT(SLOT_BRICK)));
    q.ctx = ctx;
    q.points = points;
    q.out = out;
    q.inside = inside;
    springls__parallel(ctx, count, 1024, task, &q);
    return SPRINGLS_OK;
}

SPRINGLS__QUERIES_API springls_status springls_sample_distance(springls_context *ctx, const float *points, int count, float *out)
{
    return springls__field_query_run(ctx, points, count, out, NULL, springls__sample_distance_task, "sample_distance");
}

SPRINGLS__QUERIES_API springls_status springls_sample_gradient(springls_context *ctx, const float *points, int count, float *out)
{
    return springls__field_query_run(ctx, points, count, out, NULL, springls__sample_gradient_task, "sample_gradient");
}

/* Finds which points the mesh of what springls hold bounds. */
SPRINGLS__FN springls_status springls__contour_insides(springls_context *ctx, const float *points, int count, uint8_t *out)
{
    springls__contour_inside q;
    int i;
    SPRINGLS__TRY(springls__prepare_contour(ctx));
    if (springls__may_query_nearby(ctx, count)) {
        for (i = 0; i < count; i++) {
            springls__surface_hit h;
            SPRINGLS__TRY(springls__nearby_ray(ctx, count, springls__world_to_model(ctx, points + 3 * (size_t)i), springls__way_out(),
                                               1e18f, &h));
            out[i] = springls__comes_from_inside(ctx, &h);
        }
        return SPRINGLS_OK;
    }
    SPRINGLS__TRY(springls__contour_surface_refresh(ctx));
    q.ctx = ctx;
    q.points = points;
    q.out = out;
    springls__parallel(ctx, count, 256, springls__contour_inside_task, &q);
    return SPRINGLS_OK;
}

SPRINGLS__QUERIES_API springls_status springls_sample_inside(springls_context *ctx, const float *points, int count, uint8_t *out)
{
    if (ctx && springls__shows_springls(ctx)) {
        SPRINGLS__TRY(springls__check_points(ctx, points, count, out, "sample_inside"));
        SPRINGLS__TRY(springls__read_level_set(ctx));
        return springls__report_device_failure(ctx, springls__contour_insides(ctx, points, count, out));
    }
    return springls__field_query_run(ctx, points, count, NULL, out, springls__sample_distance_task, "sample_inside");
}

/* ---- material coordinates ---- */

/* Holds the normal equations of a least-squares fit of the affine map p -> a around a place x of the model,
   a(x + r) = c + A r, with the unknowns (c, row of A) for each coordinate of a. Exact for a model that moved rigidly. */
typedef struct springls__affine_fit { double m[4][4], rhs[4][3], weight; int count; } springls__affine_fit;

/* Adds the equations constant c + A r = v. */
SPRINGLS__FN void springls__affine_fit_equations(springls__affine_fit *fit, double constant, springls__v3 r, springls__v3 v,
                                                 double weight)
{
    const double row[4] = { constant, (double)r.x, (double)r.y, (double)r.z };
    const double value[3] = { (double)v.x, (double)v.y, (double)v.z };
    int i, j;
    for (i = 0; i < 4; i++) {
        for (j = 0; j < 4; j++) fit->m[i][j] += weight * row[i] * row[j];
        for (j = 0; j < 3; j++) fit->rhs[i][j] += weight * row[i] * value[j];
    }
}

/* Adds the equation a(x + r) = a. */
SPRINGLS__FN void springls__affine_fit_add(springls__affine_fit *fit, springls__v3 r, springls__v3 a, double weight)
{
    springls__affine_fit_equations(fit, 1.0, r, a, weight);
    fit->weight += weight;
    fit->count++;
}

/* Adds the equation that A maps the unit way along one normal, in the world, to that along the other: neighbors in a plane do not
   determine it. */
SPRINGLS__FN void springls__affine_fit_normal(springls__affine_fit *fit, springls__metric metric, springls__v3 n, springls__v3 n_a,
                                              double weight)
{
    springls__affine_fit_equations(fit, 0.0, springls__along_normal(metric, n), springls__along_normal(metric, n_a), weight);
}

/* Solves for c by elimination without pivoting, because the matrix is symmetric and positive. Returns false when it is nearly
   singular. */
SPRINGLS__FN bool springls__affine_fit_solve(springls__affine_fit *fit, springls__v3 *c)
{
    int order[4], i, j, k;
    for (i = 0; i < 4; i++) order[i] = 3 - i; /* c is eliminated last, and needs no back substitution */
    for (i = 0; i < 3; i++) {
        int p = order[i];
        if (!(fit->m[p][p] > 1e-4 * fit->weight)) return false;
        for (j = i + 1; j < 4; j++) {
            int q = order[j];
            double f = fit->m[q][p] / fit->m[p][p];
            for (k = i; k < 4; k++) fit->m[q][order[k]] -= f * fit->m[p][order[k]];
            for (k = 0; k < 3; k++) fit->rhs[q][k] -= f * fit->rhs[p][k];
        }
    }
    if (!(fit->m[0][0] > 1e-6 * fit->weight)) return false;
    *c = springls__v3_make((float)(fit->rhs[0][0] / fit->m[0][0]), (float)(fit->rhs[0][1] / fit->m[0][0]),
                           (float)(fit->rhs[0][2] / fit->m[0][0]));
    return true;
}

/* Returns the place on the original surface of place x of a springl that has too few neighbors for a fit: the same barycentric
   coordinates in the triangle `own` that an original springl came from; the correspondence of any other. Voxels. */
SPRINGLS__FN springls__v3 springls__own_correspondence(const springls_context *ctx, int springl, springls__v3 x,
                                                       springls__tri own)
{
    springls__tri t = springls__springl_tri(ctx->model.set.s[springl]);
    springls__tri_hit at = springls__tri_closest(t, x), center = springls__tri_closest(t, ctx->model.set.s[springl].p);
    springls__v3 a = ctx->model.set.a[springl];
    if (ctx->model.set.generation[springl]) return a;
    a = springls__mad(a, own.a, at.bary[0] - center.bary[0]);
    a = springls__mad(a, own.b, at.bary[1] - center.bary[1]);
    return springls__mad(a, own.c, at.bary[2] - center.bary[2]);
}

/* A fit around place x of a springl, voxels. */
typedef struct springls__place_fit {
    const springls_context *ctx;
    int springl;
    springls__v3 x, normal; /* of the springl */
    float radius;
    springls__affine_fit fit;
} springls__place_fit;

/* Adds springl j, if it is near, faces the same way and comes from the same part of the original. */
SPRINGLS__FN void springls__place_fit_add(springls__place_fit *place, int j)
{
    const springls__constellation *set = &place->ctx->model.set;
    const float radius2 = place->radius * place->radius;
    springls__v3 r = springls__sub(set->s[j].p, place->x);
    float d2 = springls__length2(r) / radius2;
    if (d2 >= 1.0f || !(springls__dot(springls__springl_normal(set->s[j]), place->normal) > 0.0f)) return;
    if (springls__length2(springls__sub(set->a[j], set->a[place->springl])) > 16.0f * radius2) return;
    springls__affine_fit_add(&place->fit, r, set->a[j], (double)((1.0f - d2) * (1.0f - d2)));
}

/* Adds the springls around, from the cell list or from the hierarchy: whichever is fresh. */
SPRINGLS__FN void springls__place_fit_around(springls__place_fit *place, bool cells)
{
    const springls_context *ctx = place->ctx;
    int j;
    if (cells) {
        springls__cell_walk walk = springls__cell_walk_near(&ctx->model, place->x, place->radius);
        while ((j = springls__cell_walk_next(&ctx->model, &walk)) >= 0) springls__place_fit_add(place, j);
    } else {
        springls__near_walk walk = springls__near_walk_begin(&ctx->springl_surface, springls__voxel_to_model(ctx, place->x),
                                                             place->radius * ctx->largest_spacing / ctx->smallest_spacing);
        while ((j = springls__near_walk_next(&walk)) >= 0) springls__place_fit_add(place, j);
    }
}

/* Returns the place near the original surface of place x of a springl, voxels: the affine map fitted to the springls around it
   that face the same way. own: the original triangle at the springl's correspondence. */
SPRINGLS__FN springls__v3 springls__fit_correspondence(const springls_context *ctx, int springl, springls__v3 x,
                                                       springls__tri own, bool cells)
{
    const springls__springl *s = &ctx->model.set.s[springl];
    springls__place_fit place;
    springls__v3 result;
    memset(&place, 0, sizeof place);
    place.ctx = ctx;
    place.springl = springl;
    place.x = x;
    place.normal = springls__springl_normal(*s);
    place.radius = 2.5f * springls__max(1.0f, s->bounding_radius);
    springls__place_fit_around(&place, cells);
    if (place.fit.count >= 4) {
        springls__affine_fit_normal(&place.fit, ctx->model.grid.metric, place.normal, springls__tri_normal(own),
                                    0.1 * place.fit.weight);
        if (springls__affine_fit_solve(&place.fit, &result)) return result;
    }
    return springls__own_correspondence(ctx, springl, x, own);
}

/* Converts a hit on the original surface to triangle and barycentric coordinates of the caller's mesh. */
SPRINGLS__FN void springls__source_of(const springls__surface *surface, const springls__surface_hit *h, int *triangle,
                                      float bary[3])
{
    int source = surface->source ? surface->source[h->triangle] : 2 * h->triangle;
    *triangle = source / 2;
    bary[0] = h->hit.bary[0];
    bary[1] = h->hit.bary[source & 1 ? 2 : 1];
    bary[2] = h->hit.bary[source & 1 ? 1 : 2];
}

/* Returns the place on the original surface of place x (voxels) of a springl; triangle -1 when there is no such surface. cells: the
   cell list is fresh, else the hierarchy of the springls is. */
SPRINGLS__FN springls__surface_hit springls__material_at(const springls_context *ctx, int springl, springls__v3 x, bool cells)
{
    springls__surface_hit own = springls__surface_closest(&ctx->original, ctx->model.set.a[springl], FLT_MAX);
    springls__v3 a;
    if (own.triangle < 0) return own;
    a = springls__fit_correspondence(ctx, springl, x, springls__surface_triangle(&ctx->original, own.triangle), cells);
    return springls__surface_closest_from(&ctx->original, a, FLT_MAX, own.triangle);
}

/* Returns the place on the original surface of place x (voxels) of a springl by the quadratic fit. The cell list must be fresh.
   guess: a triangle of the original surface, or -1. */
SPRINGLS__FN springls__surface_hit springls__fitted_material_at(const springls_context *ctx, int springl, springls__v3 x,
                                                                int guess)
{
    springls__v3 a = ctx->model.set.a[springl];
    springls__fit_result fit = springls__fit_at(&ctx->model, springl, x, springls__springl_normal(ctx->model.set.s[springl]), a,
                                                ctx->model.set.count);
    if (fit.ok) return springls__surface_closest_from(&ctx->original, fit.a, FLT_MAX, guess);
    return springls__material_at(ctx, springl, x, true);
}

/* ---- closest points, rays ---- */

typedef struct springls__hit_query {
    const springls_context *ctx;
    const float *points, *directions;
    float max_distance; /* world units */
    bool cells;         /* the cell list is fresh */
    bool contour;       /* the mesh of what springls hold is searched */
    const springls__surface *surface; /* that is searched, if it has a hierarchy */
    springls_hit *out;
} springls__hit_query;

/* Begins a hit on a springl: point (voxels) and normal, bary in the springl, distance in world units. */
SPRINGLS__FN void springls__hit_begin(const springls_context *ctx, int springl, springls__v3 point, springls__v3 normal,
                                      const float bary[3], float distance, springls_hit *out)
{
    springls__v3 n = springls__normal_to_world(ctx, normal);
    out->springl = springl;
    out->id = ctx->model.set.id[springl];
    springls__voxel_to_world(ctx, point, out->point);
    out->normal[0] = n.x; out->normal[1] = n.y; out->normal[2] = n.z;
    memcpy(out->barycentric, bary, sizeof out->barycentric);
    out->distance = distance;
}

SPRINGLS__FN void springls__hit_none(springls_hit *out)
{
    memset(out, 0, sizeof *out);
    out->springl = out->material_triangle = -1;
}

/* Adds to a hit its place on the original surface, where there is one. */
SPRINGLS__FN void springls__hit_material(const springls_context *ctx, const springls__surface_hit *material, springls_hit *out)
{
    if (material->triangle < 0) return;
    springls__original_to_world(ctx, material->hit.point, out->material);
    springls__source_of(&ctx->original, material, &out->material_triangle, out->material_barycentric);
}

/* ---- far away ---- */

/* Finds the middle of the grid in the world. Returns the radius of the ball around it that holds the grid, world units. */
SPRINGLS__FN double springls__grid_ball(const springls_context *ctx, double middle[3])
{
    const int *size = ctx->model.grid.size;
    const double *m = ctx->window.to_world;
    double radius = 0.0;
    int k;
    springls__transform(m, 0.5 * (size[0] - 1), 0.5 * (size[1] - 1), 0.5 * (size[2] - 1), middle);
    for (k = 0; k < 3; k++) /* half the sum of the edges exceeds half the diagonal */
        radius += 0.5 * (size[k] + 2) * sqrt(m[k] * m[k] + m[4 + k] * m[4 + k] + m[8 + k] * m[8 + k]);
    return radius;
}

/* Writes to near_point a query point or, if it is more than 10^7 voxels from the middle of the grid, the point that far away in its
   direction: a float does not resolve by how much the closest place may differ. Returns the distance left out, world units. */
SPRINGLS__FN double springls__bring_near(const springls_context *ctx, const float *world, float near_point[3])
{
    const double furthest = 1e7 * (double)ctx->smallest_spacing;
    double middle[3], d[3], length;
    int k;
    springls__grid_ball(ctx, middle);
    for (k = 0; k < 3; k++) d[k] = (double)world[k] - middle[k];
    length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (k = 0; k < 3; k++) near_point[k] = length > furthest ? (float)(middle[k] + d[k] * (furthest / length)) : world[k];
    return length > furthest ? length - furthest : 0.0;
}

/* Returns distance + left_out, at most FLT_MAX. */
SPRINGLS__FN float springls__whole_distance(double distance, double left_out)
{
    return distance + left_out < (double)FLT_MAX ? (float)(distance + left_out) : FLT_MAX;
}

/* Writes to `from` where the search along a ray begins: at its origin or, if that is more than 10^4 voxels before the grid, where
   the ray comes near the grid. That point follows from the ray's moment about the world's origin, whose products of floats are
   exact in double: no digit is lost however far the ray begins. The direction must not be zero. Returns the distance left out,
   world units. */
SPRINGLS__FN double springls__begin_near(const springls_context *ctx, const float *origin, const float *direction, double from[3])
{
    const double far_away = 1e4 * (double)ctx->smallest_spacing;
    double middle[3], o[3], d[3], moment[3], length2 = 0.0, along = 0.0, before = 0.0, radius = springls__grid_ball(ctx, middle);
    int k;
    for (k = 0; k < 3; k++) {
        from[k] = o[k] = (double)origin[k];
        d[k] = (double)direction[k];
        length2 += d[k] * d[k];
    }
    for (k = 0; k < 3; k++) moment[k] = o[(k + 1) % 3] * d[(k + 2) % 3] - o[(k + 2) % 3] * d[(k + 1) % 3];
    for (k = 0; k < 3; k++) {
        along += d[k] * middle[k] / sqrt(length2);
        before -= d[k] * o[k] / sqrt(length2);
    }
    if (!(along + before - radius > far_away)) return 0.0;
    for (k = 0; k < 3; k++)
        from[k] = (d[(k + 1) % 3] * moment[(k + 2) % 3] - d[(k + 2) % 3] * moment[(k + 1) % 3]) / length2
                + (along - radius) * d[k] / sqrt(length2);
    return along + before - radius;
}

/* Returns what is left of a ray's max_distance after the part left out; negative: nothing. */
SPRINGLS__FN double springls__left_to_go(float max_distance, double left_out)
{
    return max_distance < FLT_MAX ? (double)max_distance - left_out : DBL_MAX;
}

/* ---- on the springls ---- */

/* Converts a hit on the springls to the public form. distance: world units. */
SPRINGLS__FN void springls__soup_hit(const springls_context *ctx, const springls__surface_hit *h, float distance,
                                     springls_hit *out)
{
    springls__surface_hit material;
    springls__tri t;
    springls__v3 voxel;
    springls__hit_none(out);
    if (h->triangle < 0) return;
    t = springls__springl_tri(ctx->model.set.s[h->triangle]);
    voxel = springls__tri_point(t, h->hit.bary);
    springls__hit_begin(ctx, h->triangle, voxel, springls__tri_area2(t), h->hit.bary, distance, out);
    material = springls__material_at(ctx, h->triangle, voxel, false);
    springls__hit_material(ctx, &material, out);
}

/* ---- on the zero level ---- */

/* Returns the springl nearest to a place on the zero level: one that faces its side, if there is any within a voxel. */
SPRINGLS__FN int springls__springl_at(const springls_context *ctx, const springls__level_hit *h)
{
    float radius;
    int nearest = -1;
    for (radius = 0.25f; nearest < 0; radius *= 2.0f) { /* there is one at some distance */
        nearest = springls__nearest_springl_facing(&ctx->model, h->place, h->n, radius);
        if (nearest < 0 && radius >= 1.0f) nearest = springls__nearest_springl(&ctx->model, h->place, radius);
    }
    return nearest;
}

/* Returns the gradient of phi, or the normal of the triangle where the two do not agree, as in a thin sheet; of any length. */
SPRINGLS__FN springls__v3 springls__level_normal(const springls_context *ctx, const springls__level_hit *h)
{
    springls__v3 n = springls__grid_gradient(&ctx->model.grid, ctx->model.grid.phi, h->place);
    return springls__dot(n, h->n) > 0.1f * springls__length(h->n) ? n : h->n;
}

/* Converts a hit on the zero level to the public form. *guess: the triangle of the original surface where the last one was. */
SPRINGLS__FN void springls__level_hit_out(const springls__hit_query *q, const springls__level_hit *h, float distance, int *guess,
                                          springls_hit *out)
{
    const springls_context *ctx = q->ctx;
    springls__surface_hit material;
    springls__tri_hit nearest;
    int springl;
    springls__hit_none(out);
    if (!h->found) return;
    if (q->cells) springl = springls__springl_at(ctx, h);
    else springl = springls__surface_closest(&ctx->springl_surface, springls__voxel_to_model(ctx, h->place), FLT_MAX).triangle;
    nearest = springls__tri_closest(springls__springl_tri(ctx->model.set.s[springl]), h->place);
    springls__hit_begin(ctx, springl, h->place, q->contour ? h->n : springls__level_normal(ctx, h), nearest.bary, distance, out);
    material = q->cells ? springls__fitted_material_at(ctx, springl, h->place, *guess)
                        : springls__material_at(ctx, springl, h->place, false);
    *guess = material.triangle;
    springls__hit_material(ctx, &material, out);
}

SPRINGLS__FN void springls__closest_level_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    springls__level_search search;
    int i, guess = -1;
    springls__level_search_begin(q->ctx, &search);
    for (i = begin; i < end; i++) {
        float point[3];
        double left_out = springls__bring_near(q->ctx, q->points + 3 * (size_t)i, point);
        springls__level_hit h = springls__level_closest(&search, point);
        float distance = springls__whole_distance((double)(springls__sqrt(search.d2) * q->ctx->smallest_spacing), left_out);
        springls__level_hit_out(q, &h, distance, &guess, &q->out[i]);
    }
}

/* Converts a ray to voxels, for a parameter in world units. Returns false when the direction has no length. *left_out: how much
   later it begins than `origin` (springls__begin_near). */
SPRINGLS__FN bool springls__ray_to_voxel(const springls_context *ctx, const float *origin, const float *direction, double from[3],
                                         double along[3], double *left_out)
{
    const double *m = ctx->window.to_voxel;
    const double d[3] = { (double)direction[0], (double)direction[1], (double)direction[2] };
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double start[3];
    int k;
    if (!(length > 0.0)) return false;
    *left_out = springls__begin_near(ctx, origin, direction, start);
    springls__transform(m, start[0], start[1], start[2], from);
    for (k = 0; k < 3; k++) along[k] = (m[4 * k] * d[0] + m[4 * k + 1] * d[1] + m[4 * k + 2] * d[2]) / length;
    return true;
}

SPRINGLS__FN void springls__raycast_level_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    int i, guess = -1;
    for (i = begin; i < end; i++) {
        double from[3], along[3], left_out = 0.0, t = 0.0;
        springls__level_hit h;
        h.found = false;
        if (springls__ray_to_voxel(q->ctx, q->points + 3 * (size_t)i, q->directions + 3 * (size_t)i, from, along, &left_out)) {
            t = springls__left_to_go(q->max_distance, left_out);
            if (t >= 0.0) h = springls__level_ray_first(&q->ctx->model.grid, from, along, &t);
        }
        springls__level_hit_out(q, &h, springls__whole_distance(t, left_out), &guess, &q->out[i]);
    }
}

/* ---- on triangles with a hierarchy: the springls, or the mesh of what they hold ---- */

SPRINGLS__FN void springls__triangle_hit(const springls__hit_query *q, const springls__surface_hit *h, float distance, int *guess,
                                         springls_hit *out)
{
    springls__level_hit on_mesh;
    if (!q->contour) {
        springls__soup_hit(q->ctx, h, distance, out);
        return;
    }
    on_mesh = springls__contour_hit(q->ctx, h);
    springls__level_hit_out(q, &on_mesh, distance, guess, out);
}

SPRINGLS__FN void springls__closest_hit_out(const springls__hit_query *q, double left_out, const springls__surface_hit *h, int *guess,
                                            springls_hit *out)
{
    const double distance = (double)(springls__sqrt(h->hit.d2) * q->ctx->smallest_spacing);
    springls__triangle_hit(q, h, springls__whole_distance(distance, left_out), guess, out);
}

/* Finds closest points; each search begins at the triangle of the last one. */
SPRINGLS__FN void springls__closest_triangle_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    int i, guess = -1, original_guess = -1;
    for (i = begin; i < end; i++) {
        float point[3];
        double left_out = springls__bring_near(q->ctx, q->points + 3 * (size_t)i, point);
        springls__v3 x = springls__world_to_model(q->ctx, point);
        springls__surface_hit h = springls__surface_closest_from(q->surface, x, FLT_MAX, guess);
        guess = h.triangle;
        springls__closest_hit_out(q, left_out, &h, &original_guess, &q->out[i]);
    }
}

/* A ray in model coordinates: the direction has unit length. left_out: how much later it begins than it was asked (world units). */
typedef struct springls__model_ray { springls__v3 x, direction; float longest; double left_out; } springls__model_ray;

/* Finds ray i of a query. Returns false when it cannot hit anything. */
SPRINGLS__FN bool springls__ray_of_query(const springls__hit_query *q, int i, springls__model_ray *ray)
{
    const float *origin = q->points + 3 * (size_t)i, *direction = q->directions + 3 * (size_t)i;
    const springls__v3 d = springls__load3(direction);
    const float largest = springls__max_coordinate(d);
    double from[3], left_to_go;
    if (!(largest > 0.0f)) return false;
    ray->left_out = springls__begin_near(q->ctx, origin, direction, from);
    left_to_go = springls__left_to_go(q->max_distance, ray->left_out) / (double)q->ctx->smallest_spacing;
    ray->x = springls__place_to_model(q->ctx, from);
    ray->direction = springls__normalize(springls__v3_make(d.x / largest, d.y / largest, d.z / largest));
    ray->longest = left_to_go < 1e18 ? (float)left_to_go : 1e18f;
    return left_to_go >= 0.0;
}

SPRINGLS__FN void springls__ray_hit_out(const springls__hit_query *q, const springls__model_ray *ray, const springls__surface_hit *h,
                                        int *guess, springls_hit *out)
{
    springls__triangle_hit(q, h, springls__whole_distance((double)(h->t * q->ctx->smallest_spacing), ray->left_out), guess, out);
}

SPRINGLS__FN void springls__raycast_triangle_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    int i, guess = -1;
    for (i = begin; i < end; i++) {
        springls__model_ray ray;
        springls__surface_hit h;
        springls__hit_none(&q->out[i]);
        if (!springls__ray_of_query(q, i, &ray)) continue;
        h = springls__surface_ray(q->surface, ray.x, ray.direction, ray.longest);
        springls__ray_hit_out(q, &ray, &h, &guess, &q->out[i]);
    }
}

/* Queries the mesh of what springls hold at few places, without making all of it. */
SPRINGLS__FN springls_status springls__query_nearby(springls_context *ctx, const springls__hit_query *q, int count)
{
    int i, guess = -1;
    for (i = 0; i < count; i++) {
        springls__surface_hit h;
        if (q->directions) {
            springls__model_ray ray;
            springls__hit_none(&q->out[i]);
            if (!springls__ray_of_query(q, i, &ray)) continue;
            SPRINGLS__TRY(springls__nearby_ray(ctx, count, ray.x, ray.direction, ray.longest, &h));
            springls__ray_hit_out(q, &ray, &h, &guess, &q->out[i]);
        } else {
            float point[3];
            const double left_out = springls__bring_near(ctx, q->points + 3 * (size_t)i, point);
            SPRINGLS__TRY(springls__nearby_closest(ctx, count, point, &h));
            springls__closest_hit_out(q, left_out, &h, &guess, &q->out[i]);
        }
    }
    return SPRINGLS_OK;
}

/* ---- the calls ---- */

/* Brings what queries of the zero level read to the host. Springls are found in the cell list; in the hierarchy where to
   build the list would change working memory that a step in progress uses. */
SPRINGLS__FN springls_status springls__prepare_level(springls_context *ctx, bool *cells)
{
    SPRINGLS__TRY(springls__read_level_set(ctx));
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID)
                                           | SPRINGLS__BIT(GENERATION) | SPRINGLS__BIT(EDGE) | SPRINGLS__BIT(TOP)
                                           | SPRINGLS__BIT(PHI) | SPRINGLS__BIT(ACTIVE) | SPRINGLS__BIT(SLOT_BRICK)));
    *cells = ctx->cells_fresh || !ctx->step.active;
    if (!*cells) {
        SPRINGLS__TRY(springls__use_host(ctx, false));
        return springls__springl_surface_refresh(ctx);
    }
    if (!ctx->cells_fresh) {
        springls__use_device(ctx);
        SPRINGLS__TRY(springls__report_device_failure(ctx, springls__read_cell_list(ctx)));
    }
    return springls__ensure_on_host(ctx, SPRINGLS__BIT(IDS) | SPRINGLS__BIT(PLACES) | SPRINGLS__BIT(UNBINNED) | SPRINGLS__BIT(CELL));
}

/* Runs a query of either surface. */
SPRINGLS__FN springls_status springls__hit_query_run(springls__hit_query *q, springls_context *ctx, springls_surface surface,
                                                     int count, springls_task on_level, springls_task on_triangles)
{
    int i;
    q->ctx = ctx;
    if (ctx->model.set.count == 0) {
        for (i = 0; i < count; i++) springls__hit_none(&q->out[i]);
        return SPRINGLS_OK;
    }
    if (surface == SPRINGLS_SURFACE_WATERTIGHT) {
        SPRINGLS__TRY(springls__prepare_level(ctx, &q->cells));
        q->contour = springls__shows_springls(ctx);
        if (q->contour) {
            SPRINGLS__TRY(springls__report_device_failure(ctx, springls__prepare_contour(ctx)));
            if (springls__may_query_nearby(ctx, count))
                return springls__report_device_failure(ctx, springls__query_nearby(ctx, q, count));
            SPRINGLS__TRY(springls__report_device_failure(ctx, springls__contour_surface_refresh(ctx)));
        }
    } else {
        SPRINGLS__TRY(springls__use_host(ctx, false));
        SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    }
    q->surface = q->contour ? &ctx->contour_surface : &ctx->springl_surface;
    springls__parallel(ctx, count, 64, surface == SPRINGLS_SURFACE_WATERTIGHT && !q->contour ? on_level : on_triangles, q);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__check_surface(springls_context *ctx, springls_surface surface, const char *call)
{
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    if (surface == SPRINGLS_SURFACE_WATERTIGHT || surface == SPRINGLS_SURFACE_SOUP) return SPRINGLS_OK;
    return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: there is no surface %d: it may be 0 or 1", call, (int)surface);
}

SPRINGLS__QUERIES_API springls_status springls_closest(springls_context *ctx, springls_surface surface, const float *points, int count,
                                                       springls_hit *out)
{
    springls__hit_query q;
    SPRINGLS__TRY(springls__check_surface(ctx, surface, "closest"));
    SPRINGLS__TRY(springls__check_points(ctx, points, count, out, "closest"));
    memset(&q, 0, sizeof q);
    q.points = points;
    q.out = out;
    return springls__hit_query_run(&q, ctx, surface, count, springls__closest_level_task, springls__closest_triangle_task);
}

SPRINGLS__QUERIES_API springls_status springls_raycast(springls_context *ctx, springls_surface surface, const float *origins,
                                                       const float *directions, int count, float max_distance, springls_hit *out)
{
    springls__hit_query q;
    SPRINGLS__TRY(springls__check_surface(ctx, surface, "raycast"));
    SPRINGLS__TRY(springls__check_points(ctx, origins, count, out, "raycast origins"));
    SPRINGLS__TRY(springls__check_points(ctx, directions, count, out, "raycast directions"));
    if (springls__is_nan_float(max_distance) || max_distance < 0.0f)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "raycast: max_distance is %g, not 0 or more", (double)max_distance);
    memset(&q, 0, sizeof q);
    q.points = origins;
    q.directions = directions;
    q.max_distance = max_distance > 0.0f ? max_distance : FLT_MAX;
    q.out = out;
    return springls__hit_query_run(&q, ctx, surface, count, springls__raycast_level_task, springls__raycast_triangle_task);
}

#endif
