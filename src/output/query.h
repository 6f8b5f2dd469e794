/* query.h - samples the level set, and finds closest points and ray hits, for batches of points in world coordinates. */
#ifndef SPRINGLS__OUTPUT_QUERY_H
#define SPRINGLS__OUTPUT_QUERY_H

#include "../runtime/errors.h"
#include "../runtime/parallel.h"
#include "../model/closest_point.h"
#include "../model/host_access.h"
#include "../model/ray.h"
#include "../model/springl_surface.h"
#include "../model/transform.h"

/* Fails when an array is missing or a point is not finite; then makes the model available on the host. */
SPRINGLS__FN springls_status springls__check_points(springls_context *ctx, const float *points, int count, const void *out,
                                                    const char *name)
{
    size_t i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__use_host(ctx, false));
    if (count < 0 || (count > 0 && (!points || !out)))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: NULL array or negative count", name);
    for (i = 0; i < 3 * (size_t)count; i++)
        if (!(points[i] >= -FLT_MAX && points[i] <= FLT_MAX))
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

/* Samples phi in world units, or where it is negative. */
SPRINGLS__FN void springls__sample_distance_task(void *arg, int begin, int end)
{
    const springls__field_query *q = (const springls__field_query *)arg;
    const springls_context *ctx = q->ctx;
    int i;
    for (i = begin; i < end; i++) {
        float phi = springls__grid_sample(&ctx->model.grid, ctx->model.grid.phi,
                                          springls__world_to_voxel(ctx, q->points + 3 * (size_t)i));
        if (q->inside) q->inside[i] = phi < 0.0f;
        else q->out[i] = phi * ctx->smallest_spacing;
    }
}

SPRINGLS__FN void springls__sample_gradient_task(void *arg, int begin, int end)
{
    const springls__field_query *q = (const springls__field_query *)arg;
    const springls_context *ctx = q->ctx;
    int i;
    for (i = begin; i < end; i++) {
        springls__v3 x = springls__world_to_voxel(ctx, q->points + 3 * (size_t)i);
        springls__covector_to_world(ctx, springls__grid_gradient(&ctx->model.grid, ctx->model.grid.phi, x),
                                    (double)ctx->smallest_spacing, q->out + 3 * (size_t)i);
    }
}

SPRINGLS__FN springls_status springls__field_query_run(springls_context *ctx, const float *points, int count, float *out,
                                                       uint8_t *inside, springls_task task, const char *name)
{
    springls__field_query q;
    SPRINGLS__TRY(springls__check_points(ctx, points, count, inside ? (const void *)inside : (const void *)out, name));
    q.ctx = ctx;
    q.points = points;
    q.out = out;
    q.inside = inside;
    springls__parallel(ctx, count, 1024, task, &q);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_sample_distance(springls_context *ctx, const float *points, int count, float *out)
{
    return springls__field_query_run(ctx, points, count, out, NULL, springls__sample_distance_task, "sample_distance");
}

SPRINGLS_API springls_status springls_sample_gradient(springls_context *ctx, const float *points, int count, float *out)
{
    return springls__field_query_run(ctx, points, count, out, NULL, springls__sample_gradient_task, "sample_gradient");
}

SPRINGLS_API springls_status springls_sample_inside(springls_context *ctx, const float *points, int count, uint8_t *out)
{
    return springls__field_query_run(ctx, points, count, NULL, out, springls__sample_distance_task, "sample_inside");
}

/* ---- material coordinates ---- */

/* Holds the normal equations of a least-squares fit of the affine map p -> a around a place x of the model,
   a(x + r) = c + A r, with the unknowns (c, row of A) for each coordinate of a. Exact for a model that moved rigidly. */
typedef struct springls__affine_fit { double m[4][4], rhs[4][3], weight; int count; } springls__affine_fit;

/* Adds the equation a(x + r) = a. */
SPRINGLS__FN void springls__affine_fit_add(springls__affine_fit *fit, springls__v3 r, springls__v3 a, double weight)
{
    double row[4], value[3];
    int i, j;
    row[0] = 1.0; row[1] = (double)r.x; row[2] = (double)r.y; row[3] = (double)r.z;
    value[0] = (double)a.x; value[1] = (double)a.y; value[2] = (double)a.z;
    for (i = 0; i < 4; i++) {
        for (j = 0; j < 4; j++) fit->m[i][j] += weight * row[i] * row[j];
        for (j = 0; j < 3; j++) fit->rhs[i][j] += weight * row[i] * value[j];
    }
    fit->weight += weight;
    fit->count++;
}

/* Adds the equation A n = n_a for the unit normals of the model and of the original: neighbors in a plane do not determine it. */
SPRINGLS__FN void springls__affine_fit_normal(springls__affine_fit *fit, springls__v3 n, springls__v3 n_a, double weight)
{
    double row[4], value[3];
    int i, j;
    row[0] = 0.0; row[1] = (double)n.x; row[2] = (double)n.y; row[3] = (double)n.z;
    value[0] = (double)n_a.x; value[1] = (double)n_a.y; value[2] = (double)n_a.z;
    for (i = 1; i < 4; i++) {
        for (j = 1; j < 4; j++) fit->m[i][j] += weight * row[i] * row[j];
        for (j = 0; j < 3; j++) fit->rhs[i][j] += weight * row[i] * value[j];
    }
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

/* Returns the place near the original surface of place x of a springl, voxels: the affine map fitted to the springls around it
   that face the same way. own: the original triangle at the springl's correspondence. */
SPRINGLS__FN springls__v3 springls__fit_correspondence(const springls_context *ctx, int springl, springls__v3 x,
                                                       springls__tri own)
{
    const float radius = 2.5f * springls__max(1.0f, ctx->model.set.s[springl].bounding_radius); /* voxels */
    const springls__springl *s = ctx->model.set.s;
    springls__v3 normal = springls__springl_normal(s[springl]), center = springls__voxel_to_model(ctx, x), result;
    springls__affine_fit fit;
    const float search = radius * ctx->largest_spacing / ctx->smallest_spacing;
    springls__near_walk walk = springls__near_walk_begin(&ctx->springl_surface, center, search);
    int j;
    memset(&fit, 0, sizeof fit);
    while ((j = springls__near_walk_next(&walk)) >= 0) {
        springls__v3 r = springls__sub(s[j].p, x);
        float d2 = springls__length2(r) / (radius * radius), apart;
        if (d2 >= 1.0f || !(springls__dot(springls__springl_normal(s[j]), normal) > 0.0f)) continue;
        apart = springls__length2(springls__sub(ctx->model.set.a[j], ctx->model.set.a[springl]));
        if (apart > 16.0f * radius * radius) continue; /* from another part of the original */
        springls__affine_fit_add(&fit, r, ctx->model.set.a[j], (double)((1.0f - d2) * (1.0f - d2)));
    }
    if (fit.count >= 4) {
        springls__affine_fit_normal(&fit, normal, springls__tri_normal(own), 0.1 * fit.weight);
        if (springls__affine_fit_solve(&fit, &result)) return result;
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

/* Returns the place on the original surface of place x (voxels) of a springl; triangle -1 when there is no such surface. */
SPRINGLS__FN springls__surface_hit springls__material_at(const springls_context *ctx, int springl, springls__v3 x)
{
    springls__surface_hit own = springls__surface_closest(&ctx->original, ctx->model.set.a[springl], FLT_MAX);
    springls__v3 a;
    if (own.triangle < 0) return own;
    a = springls__fit_correspondence(ctx, springl, x, springls__surface_triangle(&ctx->original, own.triangle));
    return springls__surface_closest_from(&ctx->original, a, FLT_MAX, own.triangle);
}

/* ---- closest point, rays ---- */

typedef struct springls__hit_query {
    const springls_context *ctx;
    const float *points, *directions;
    float max_distance; /* model units */
    springls_hit *out;
} springls__hit_query;

/* Converts a hit on the springls to the public form. distance: model units. */
SPRINGLS__FN void springls__hit_fill(const springls_context *ctx, const springls__surface_hit *h, float distance,
                                     springls_hit *out)
{
    springls__v3 voxel;
    springls__surface_hit material;
    const springls__springl *s;
    int k;
    memset(out, 0, sizeof *out);
    out->springl = h->triangle;
    out->material_triangle = -1;
    if (h->triangle < 0) return;
    s = &ctx->model.set.s[h->triangle];
    for (k = 0; k < 3; k++) out->barycentric[k] = h->hit.bary[k];
    voxel = springls__scale(s->q[0], h->hit.bary[0]);
    voxel = springls__mad(voxel, s->q[1], h->hit.bary[1]);
    voxel = springls__mad(voxel, s->q[2], h->hit.bary[2]);
    springls__voxel_to_world(ctx, voxel, out->point);
    out->distance = distance * ctx->smallest_spacing;
    material = springls__material_at(ctx, h->triangle, voxel);
    if (material.triangle < 0) return;
    springls__voxel_to_world(ctx, material.hit.point, out->material);
    springls__source_of(&ctx->original, &material, &out->material_triangle, out->material_barycentric);
}

/* Finds closest points; each search begins at the triangle of the last one. */
SPRINGLS__FN void springls__closest_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    int i, guess = -1;
    for (i = begin; i < end; i++) {
        springls__v3 x = springls__world_to_model(q->ctx, q->points + 3 * (size_t)i);
        springls__surface_hit h = springls__surface_closest_from(&q->ctx->springl_surface, x, FLT_MAX, guess);
        guess = h.triangle;
        springls__hit_fill(q->ctx, &h, springls__sqrt(h.hit.d2), &q->out[i]);
    }
}

SPRINGLS__FN void springls__raycast_task(void *arg, int begin, int end)
{
    const springls__hit_query *q = (const springls__hit_query *)arg;
    int i;
    for (i = begin; i < end; i++) {
        springls__v3 x = springls__world_to_model(q->ctx, q->points + 3 * (size_t)i);
        springls__v3 d = springls__load3(q->directions + 3 * (size_t)i);
        springls__surface_hit h;
        float largest = springls__max_coordinate(d);
        if (largest > 0.0f) d = springls__normalize(springls__v3_make(d.x / largest, d.y / largest, d.z / largest));
        h = springls__surface_ray(&q->ctx->springl_surface, x, d, q->max_distance);
        springls__hit_fill(q->ctx, &h, h.t, &q->out[i]);
    }
}

SPRINGLS_API springls_status springls_closest(springls_context *ctx, const float *points, int count, springls_hit *out)
{
    springls__hit_query q;
    SPRINGLS__TRY(springls__check_points(ctx, points, count, out, "closest"));
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    memset(&q, 0, sizeof q);
    q.ctx = ctx;
    q.points = points;
    q.out = out;
    springls__parallel(ctx, count, 64, springls__closest_task, &q);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_raycast(springls_context *ctx, const float *origins, const float *directions,
                                              int count, float max_distance, springls_hit *out)
{
    springls__hit_query q;
    SPRINGLS__TRY(springls__check_points(ctx, origins, count, out, "raycast origins"));
    SPRINGLS__TRY(springls__check_points(ctx, directions, count, out, "raycast directions"));
    if (!(max_distance >= 0.0f)) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "raycast: negative max_distance");
    SPRINGLS__TRY(springls__springl_surface_refresh(ctx));
    q.ctx = ctx;
    q.points = origins;
    q.directions = directions;
    q.max_distance = max_distance > 0.0f ? springls__min(max_distance / ctx->smallest_spacing, 1e18f) : 1e18f;
    q.out = out;
    springls__parallel(ctx, count, 64, springls__raycast_task, &q);
    return SPRINGLS_OK;
}

#endif
