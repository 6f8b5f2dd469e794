/* interpolation.h - interpolates attributes in material space: as functions of the correspondence, on one side of the surface. */
#ifndef SPRINGLS__MODEL_INTERPOLATION_H
#define SPRINGLS__MODEL_INTERPOLATION_H

#include "../../kernels_embed/model/fit.h"
#include "../../kernels_embed/model/neighbors.h"
#include "attribute_values.h"
#include "closest_point.h"
#include "transform.h"

enum { SPRINGLS__MAX_SOURCES = 24 };

/* The springls that a value is interpolated from, by ascending d2, equals by index. */
typedef struct springls__interpolation_sources {
    int index[SPRINGLS__MAX_SOURCES], count;
    float d2[SPRINGLS__MAX_SOURCES], weight[SPRINGLS__MAX_SOURCES]; /* d2: squared distance of correspondences  */
} springls__interpolation_sources;

typedef struct springls__interpolation_search {
    const springls_context *ctx;   /* its springl_surface has the triangles of the springls with values         */
    const springls__v3 *a;         /* their correspondences                                                     */
    int known;                     /* how many they are                                                         */
} springls__interpolation_search;

/* ---- weights ---- */

/* Solves the symmetric positive 3x3 system m x = b. */
SPRINGLS__FN void springls__solve3(double m[3][3], const double b[3], double x[3])
{
    double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
               + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    int k;
    for (k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        double c[3];
        c[0] = m[u][1] * m[v][2] - m[u][2] * m[v][1];
        c[1] = m[u][2] * m[v][0] - m[u][0] * m[v][2];
        c[2] = m[u][0] * m[v][1] - m[u][1] * m[v][0];
        x[k] = (c[0] * b[0] + c[1] * b[1] + c[2] * b[2]) / det;
    }
}

/* A plane of values fitted to weighted sources: the sum of their weights, the mean of their places, and the slope at them. */
typedef struct springls__plane { double weight, mean[3], slope[3]; } springls__plane;

SPRINGLS__FN springls__plane springls__interpolation_plane(const springls__interpolation_sources *sources,
                                                           double r[SPRINGLS__MAX_SOURCES][3])
{
    const double ridge = 1e-4; /* across the original surface, where the sources have no extent */
    springls__plane plane;
    double m[3][3], trace;
    int i, j, k;
    memset(&plane, 0, sizeof plane);
    memset(m, 0, sizeof m);
    for (i = 0; i < sources->count; i++) {
        plane.weight += (double)sources->weight[i];
        for (k = 0; k < 3; k++) plane.mean[k] += (double)sources->weight[i] * r[i][k];
    }
    for (k = 0; k < 3; k++) plane.mean[k] /= plane.weight;
    for (i = 0; i < sources->count; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++)
                m[j][k] += (double)sources->weight[i] * (r[i][j] - plane.mean[j]) * (r[i][k] - plane.mean[k]);
    trace = m[0][0] + m[1][1] + m[2][2];
    for (k = 0; k < 3; k++) m[k][k] += ridge * trace + 1e-12 * plane.weight;
    springls__solve3(m, plane.mean, plane.slope);
    return plane;
}

/* Sets weights that fall with distance, and each source's place relative to a. */
SPRINGLS__FN void springls__interpolation_begin(springls__interpolation_sources *sources, const springls__v3 *places,
                                                springls__v3 a, double r[SPRINGLS__MAX_SOURCES][3])
{
    float range2 = 1.1f * sources->d2[sources->count - 1] + 1e-6f;
    int i;
    for (i = 0; i < sources->count; i++) {
        float t = sources->d2[i] / range2;
        springls__v3 d = springls__sub(places[sources->index[i]], a);
        sources->weight[i] = SPRINGLS__FIT_WEIGHT(t);
        r[i][0] = (double)d.x; r[i][1] = (double)d.y; r[i][2] = (double)d.z;
    }
}

/* Finds how much the plane's slope takes from each source: more than 1 makes its weight negative. Returns the source whose
   weight is the most negative one, or -1. */
SPRINGLS__FN int springls__interpolation_worst(const springls__interpolation_sources *sources, const springls__plane *plane,
                                               double r[SPRINGLS__MAX_SOURCES][3], double taken[SPRINGLS__MAX_SOURCES])
{
    double lowest = 0.0;
    int i, k, worst = -1;
    for (i = 0; i < sources->count; i++) {
        double below;
        taken[i] = 0.0;
        for (k = 0; k < 3; k++) taken[i] += plane->weight * (r[i][k] - plane->mean[k]) * plane->slope[k];
        if (sources->weight[i] == 0.0f || taken[i] <= 1.0) continue;
        below = (double)sources->weight[i] * (taken[i] - 1.0);
        if (worst >= 0 && below <= lowest) continue;
        lowest = below;
        worst = i;
    }
    return worst;
}

/* Sets the weights of moving least squares of degree 1 at the correspondence a: the weighted sum of values is that of the fitted
   plane at a, exact for linear functions. A source that would get a negative weight is left out, the worst first, while more
   than three are left; then the slope is reduced. So the result is a mean of values, and stays within their range. */
SPRINGLS__FN void springls__interpolation_weigh(springls__interpolation_sources *sources, const springls__v3 *places,
                                                springls__v3 a)
{
    double r[SPRINGLS__MAX_SOURCES][3], taken[SPRINGLS__MAX_SOURCES], limit = 1.0;
    springls__plane plane;
    int i, left = sources->count, worst;
    springls__interpolation_begin(sources, places, a, r);
    do {
        plane = springls__interpolation_plane(sources, r);
        worst = springls__interpolation_worst(sources, &plane, r, taken);
        if (worst >= 0 && left > 3) sources->weight[worst] = 0.0f;
    } while (worst >= 0 && left-- > 3);
    for (i = 0; i < sources->count; i++)
        if (sources->weight[i] > 0.0f && taken[i] * limit > 1.0) limit = 1.0 / taken[i];
    for (i = 0; i < sources->count; i++) sources->weight[i] *= (float)((1.0 - limit * taken[i]) / plane.weight);
}

/* ---- sources ---- */

/* Finds the springls within a radius of x that face the same way as n. stretch: model units in the longest spacing. */
SPRINGLS__FN void springls__sources_facing(const springls__interpolation_search *search, springls__v3 x, springls__v3 n,
                                           springls__v3 a, float radius, float stretch,
                                           springls__interpolation_sources *sources)
{
    const springls__surface *surface = &search->ctx->springl_surface;
    const float alike = 0.3f; /* cosine */
    springls__near_walk walk = springls__near_walk_begin(surface, x, radius * stretch);
    int j;
    sources->count = 0;
    while ((j = springls__near_walk_next(&walk)) >= 0) {
        springls__tri t;
        if (j >= search->known) continue;
        t = springls__surface_triangle(surface, j);
        if (springls__dot(springls__tri_normal(t), n) <= alike) continue;
        if (springls__tri_closest(t, x).d2 > radius * radius * stretch * stretch) continue;
        sources->count = springls__insert_nearest(sources->d2, sources->index, sources->count, SPRINGLS__MAX_SOURCES,
                                                  springls__length2(springls__sub(search->a[j], a)), j);
    }
}

/* Finds the springl nearest to x, whichever way it faces. */
SPRINGLS__FN void springls__nearest_source(const springls__interpolation_search *search, springls__v3 x,
                                           springls__interpolation_sources *sources)
{
    const springls__surface *surface = &search->ctx->springl_surface;
    springls__near_walk walk = springls__near_walk_begin(surface, x, 1e18f);
    const float wider = 1.0001f; /* what is as far away stays within it, however it is rounded */
    float best = FLT_MAX;
    int j;
    while ((j = springls__near_walk_next(&walk)) >= 0) {
        float d2;
        if (j >= search->known) continue;
        d2 = springls__tri_closest(springls__surface_triangle(surface, j), x).d2;
        if (d2 > best || (d2 == best && sources->count && j > sources->index[0])) continue;
        best = d2;
        walk.r = wider * springls__sqrt(best); /* nothing further away is looked at */
        sources->index[0] = j;
        sources->count = 1;
    }
    sources->d2[0] = 0.0f;
}

/* Returns the springls around x that face the same way as n (both in model coordinates), those with the correspondences nearest
   to a, with their weights. bounding_radius: of the springl at x, voxels. If none face that way, the nearest of all. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_at(const springls__interpolation_search *search,
                                                                                springls__v3 x, springls__v3 n, springls__v3 a,
                                                                                float bounding_radius)
{
    const float near_radius = 2.5f * springls__max(1.0f, bounding_radius);
    const float stretch = search->ctx->largest_spacing / search->ctx->smallest_spacing;
    springls__interpolation_sources sources;
    float radius = near_radius, further2;
    int attempt;
    sources.count = 0;
    for (attempt = 0; attempt < 4 && sources.count < 3; attempt++, radius *= 2.0f)
        springls__sources_facing(search, x, n, a, radius, stretch, &sources);
    if (sources.count == 0) springls__nearest_source(search, x, &sources);
    further2 = 2.0f * sources.d2[0] + 16.0f * near_radius * near_radius; /* beyond it: from another part of the original */
    while (sources.count > 1 && sources.d2[sources.count - 1] > further2) sources.count--;
    if (sources.count) springls__interpolation_weigh(&sources, search->a, a);
    return sources;
}

/* Returns the sources at the place of springl i. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_of_springl(
    const springls__interpolation_search *search, int i)
{
    const springls_context *ctx = search->ctx;
    springls__springl s = ctx->model.set.s[i];
    springls__tri t;
    t.a = springls__voxel_to_model(ctx, s.q[0]);
    t.b = springls__voxel_to_model(ctx, s.q[1]);
    t.c = springls__voxel_to_model(ctx, s.q[2]);
    return springls__interpolation_sources_at(search, springls__voxel_to_model(ctx, s.p), springls__tri_normal(t),
                                              ctx->model.set.a[i], s.bounding_radius);
}

/* ---- values ---- */

SPRINGLS__FN void springls__interpolate_blended(const springls__attribute *attribute,
                                             const springls__interpolation_sources *sources, float *out)
{
    int i, c;
    for (c = 0; c < attribute->channels; c++) out[c] = 0.0f;
    for (i = 0; i < sources->count; i++)
        for (c = 0; c < attribute->channels; c++)
            out[c] += sources->weight[i] * springls__values_of(attribute, sources->index[i])[c];
}

/* Writes the values interpolated from the sources, or, without `blend`, those of the nearest; zeros if there are none. */
SPRINGLS__FN void springls__interpolate_value(const springls__attribute *attribute,
                                              const springls__interpolation_sources *sources, bool blend, float *out)
{
    size_t bytes = (size_t)attribute->channels * sizeof *out;
    if (sources->count == 0) memset(out, 0, bytes);
    else if (blend) springls__interpolate_blended(attribute, sources, out);
    else memcpy(out, springls__values_of(attribute, sources->index[0]), bytes);
}

#endif
