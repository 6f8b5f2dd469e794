/* interpolation.h - interpolates attributes in material space: as functions of the correspondence, on one side of the surface. */
#ifndef SPRINGLS__MODEL_INTERPOLATION_H
#define SPRINGLS__MODEL_INTERPOLATION_H

#include "attribute_rows.h"
#include "bvh.h"
#include "transform.h"

enum { SPRINGLS__MAX_SOURCES = 24 };

/* index[0] has the nearest correspondence. */
typedef struct springls__interpolation_sources {
    int index[SPRINGLS__MAX_SOURCES], count;
    float d2[SPRINGLS__MAX_SOURCES], weight[SPRINGLS__MAX_SOURCES]; /* squared distance of correspondences */
} springls__interpolation_sources;

typedef struct springls__interpolation_search {
    const springls_context *ctx;   /* its springl_surface holds the springls that are asked */
    const springls__v3 *a;         /* and this their correspondences                        */
    int known;                     /* how many have values                                  */
} springls__interpolation_search;

SPRINGLS__FN void springls__interpolation_sources_add(springls__interpolation_sources *donors, int index, float d2)
{
    int i, last = donors->count - 1;
    if (donors->count == SPRINGLS__MAX_SOURCES
        && (donors->d2[last] < d2 || (donors->d2[last] == d2 && donors->index[last] < index))) return;
    i = donors->count < SPRINGLS__MAX_SOURCES ? donors->count++ : last;
    for (; i > 0 && (donors->d2[i - 1] > d2 || (donors->d2[i - 1] == d2 && donors->index[i - 1] > index)); i--) {
        donors->d2[i] = donors->d2[i - 1];
        donors->index[i] = donors->index[i - 1];
    }
    donors->d2[i] = d2;
    donors->index[i] = index;
}

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

/* Sums over the donors, each with its weight: what is needed to fit a plane about the correspondence a. */
typedef struct springls__plane { double weight, mean[3], slope[3]; } springls__plane;

SPRINGLS__FN springls__plane springls__interpolation_plane(const springls__interpolation_sources *donors, double r[SPRINGLS__MAX_SOURCES][3])
{
    const double ridge = 1e-4; /* across the original surface, where the donors have no extent */
    springls__plane plane;
    double m[3][3], trace;
    int i, j, k;
    memset(&plane, 0, sizeof plane);
    memset(m, 0, sizeof m);
    for (i = 0; i < donors->count; i++) {
        plane.weight += (double)donors->weight[i];
        for (k = 0; k < 3; k++) plane.mean[k] += (double)donors->weight[i] * r[i][k];
    }
    for (k = 0; k < 3; k++) plane.mean[k] /= plane.weight;
    for (i = 0; i < donors->count; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) m[j][k] += (double)donors->weight[i] * (r[i][j] - plane.mean[j]) * (r[i][k] - plane.mean[k]);
    trace = m[0][0] + m[1][1] + m[2][2];
    for (k = 0; k < 3; k++) m[k][k] += ridge * trace + 1e-12 * plane.weight;
    springls__solve3(m, plane.mean, plane.slope);
    return plane;
}

/* Moving least squares of degree 1 about the correspondence a: the sum of weight[j] v(a_j) is what the fitted plane says at a,
   exact for linear functions. Donors that would get a negative weight are left out, the worst first, and the plane is fitted
   again; where that does not end, beyond the rim of the donors, the slope is reduced instead. So the result is a mean of
   values, and stays within their range. */
SPRINGLS__FN void springls__interpolation_weigh(springls__interpolation_sources *donors, const springls__v3 *places, springls__v3 a)
{
    double r[SPRINGLS__MAX_SOURCES][3], lean[SPRINGLS__MAX_SOURCES], limit = 1.0, below, lowest = 0.0;
    float range2 = 1.1f * donors->d2[donors->count - 1] + 1e-6f;
    springls__plane plane;
    int i, k, left = donors->count, worst;
    for (i = 0; i < donors->count; i++) {
        float t = donors->d2[i] / range2;
        springls__v3 d = springls__sub(places[donors->index[i]], a);
        donors->weight[i] = (1.0f - t) * (1.0f - t) / (t + 0.02f);
        r[i][0] = (double)d.x; r[i][1] = (double)d.y; r[i][2] = (double)d.z;
    }
    do {
        plane = springls__interpolation_plane(donors, r);
        worst = -1;
        for (i = 0; i < donors->count; i++) {
            lean[i] = 0.0;
            for (k = 0; k < 3; k++) lean[i] += plane.weight * (r[i][k] - plane.mean[k]) * plane.slope[k];
            if (donors->weight[i] == 0.0f || lean[i] <= 1.0) continue;
            below = (double)donors->weight[i] * (lean[i] - 1.0);
            if (worst >= 0 && below <= lowest) continue;
            lowest = below;
            worst = i;
        }
        if (worst >= 0 && left > 3) donors->weight[worst] = 0.0f;
    } while (worst >= 0 && left-- > 3);
    for (i = 0; i < donors->count; i++)
        if (donors->weight[i] > 0.0f && lean[i] * limit > 1.0) limit = 1.0 / lean[i];
    for (i = 0; i < donors->count; i++) donors->weight[i] *= (float)((1.0 - limit * lean[i]) / plane.weight);
}

/* The springls around x that face the way of n (both in model coordinates) with the correspondences nearest to a. Where there
   are none on this side, the nearest of all. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_at(const springls__interpolation_search *search, springls__v3 x, springls__v3 n,
                                                  springls__v3 a, float reach)
{
    const springls__surface *surface = &search->ctx->springl_surface;
    const float alike = 0.3f, stretch = search->ctx->largest_spacing / search->ctx->smallest_spacing;
    springls__interpolation_sources donors;
    float radius = 2.5f * springls__max(1.0f, reach), further2;
    int attempt, j;
    donors.count = 0;
    for (attempt = 0; attempt < 4 && donors.count < 3; attempt++, radius *= 2.0f) {
        springls__near_walk walk = springls__near_walk_begin(surface, x, radius * stretch);
        donors.count = 0;
        while ((j = springls__near_walk_next(&walk)) >= 0) {
            springls__tri t;
            if (j >= search->known) continue;
            t = springls__surface_triangle(surface, j);
            if (springls__dot(springls__tri_normal(t), n) <= alike) continue;
            if (springls__tri_closest(t, x).d2 > radius * radius * stretch * stretch) continue;
            springls__interpolation_sources_add(&donors, j, springls__length2(springls__sub(search->a[j], a)));
        }
    }
    if (donors.count == 0) {
        springls__near_walk walk = springls__near_walk_begin(surface, x, 1e18f);
        float best = FLT_MAX;
        while ((j = springls__near_walk_next(&walk)) >= 0) {
            float d2;
            if (j >= search->known) continue;
            d2 = springls__tri_closest(springls__surface_triangle(surface, j), x).d2;
            if (d2 > best || (d2 == best && donors.count && j > donors.index[0])) continue;
            best = d2;
            donors.index[0] = j;
            donors.count = 1;
        }
        donors.d2[0] = 0.0f;
    }
    radius = 2.5f * springls__max(1.0f, reach);
    further2 = 2.0f * donors.d2[0] + 16.0f * radius * radius; /* met here, but from another part of the original */
    while (donors.count > 1 && donors.d2[donors.count - 1] > further2) donors.count--;
    if (donors.count) springls__interpolation_weigh(&donors, search->a, a);
    return donors;
}

/* donors of a springl that is there now. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_of_springl(const springls__interpolation_search *search, int i)
{
    const springls_context *ctx = search->ctx;
    springls__springl s = ctx->model.set.s[i];
    springls__tri t;
    t.a = springls__voxel_to_model(ctx, s.q[0]);
    t.b = springls__voxel_to_model(ctx, s.q[1]);
    t.c = springls__voxel_to_model(ctx, s.q[2]);
    return springls__interpolation_sources_at(search, springls__voxel_to_model(ctx, s.p), springls__tri_normal(t), ctx->model.set.a[i], s.bounding_radius);
}

SPRINGLS__FN void springls__interpolate_rows(const springls__attribute *attribute, const springls__interpolation_sources *donors, float *out)
{
    int i, c;
    for (c = 0; c < attribute->channels; c++) out[c] = 0.0f;
    for (i = 0; i < donors->count; i++)
        for (c = 0; c < attribute->channels; c++)
            out[c] += donors->weight[i] * springls__attribute_row(attribute, donors->index[i])[c];
}

/* The values at a place with these neighbours: blended, or of the one with the nearest correspondence; 0 where there is none. */
SPRINGLS__FN void springls__interpolate_value(const springls__attribute *attribute, const springls__interpolation_sources *donors, bool blend,
                                         float *out)
{
    size_t bytes = (size_t)attribute->channels * sizeof *out;
    if (donors->count == 0) memset(out, 0, bytes);
    else if (blend) springls__interpolate_rows(attribute, donors, out);
    else memcpy(out, springls__attribute_row(attribute, donors->index[0]), bytes);
}

#endif
