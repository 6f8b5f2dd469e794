/* fit.h - a quadratic moving-least-squares fit over neighboring particles: the surface's height and the correspondence as
   functions of two tangent coordinates. It gives split and filled springls a place and a correspondence of third-order
   accuracy; copying (section 4.7) has none. */
#ifndef SPRINGLS__KERNEL_MODEL_FIT_H
#define SPRINGLS__KERNEL_MODEL_FIT_H

#include "../language/simd.h"

#define SPRINGLS__FIT_TERMS 6  /* 1 u v uu uv vv                              */
#define SPRINGLS__FIT_VALUES 4 /* height, and the three coordinates of a      */
#define SPRINGLS__FIT_RADIUS 2.5f /* voxels */

/* What is further than this above or below the tangent plane, in radii, or faces elsewhere, by the cosine, is of another sheet. */
#define SPRINGLS__FIT_SHEET_HEIGHT 0.4f
#define SPRINGLS__FIT_SHEET_FACING 0.4f

/* The weight of a particle by the square of its distance in radii. It falls to 0 at the radius, smoothly, since particles come and
   go there, and is large at the origin, so that the fit comes close to interpolating the particles. */
#define SPRINGLS__FIT_WEIGHT(r2) ((1.0f - (r2)) * (1.0f - (r2)) / ((r2) + 0.02f))

/* A pivot that is no larger than this share of the sum of weights is 0 but for rounding: coordinates are at most 1. */
#define SPRINGLS__FIT_SINGULAR 1e-5f

typedef struct springls__fit {
    springls__v3 origin, e1, e2, n; /* the tangent frame */
    springls__v3 a0;                /* correspondences are summed relative to it */
    float normal_matrix[21];        /* lower triangle, row by row */
    float right[24];
    float count;
} springls__fit;

/* Begins a fit over no particles at `origin`; n: a unit vector. */
SPRINGLS__MATHS springls__fit springls__fit_begin(springls__v3 origin, springls__v3 n, springls__v3 a0)
{
    springls__fit fit;
    int i;
    fit.origin = origin;
    fit.n = n;
    fit.a0 = a0;
    fit.e1 = springls__any_tangent(n);
    fit.e2 = springls__cross(n, fit.e1);
    fit.count = 0.0f;
    for (i = 0; i < 21; i++) fit.normal_matrix[i] = 0.0f;
    for (i = 0; i < 24; i++) fit.right[i] = 0.0f;
    return fit;
}

/* A particle as an equation of the fit; weight 0: it is too far, faces elsewhere, or lies on another sheet. */
typedef struct springls__fit_equation {
    float term[SPRINGLS__FIT_TERMS], value[SPRINGLS__FIT_VALUES], weight;
} springls__fit_equation;

SPRINGLS__INNER springls__fit_equation springls__fit_equation_of(const springls__fit *fit, springls__v3 p, springls__v3 normal,
                                                                 springls__v3 a)
{
    springls__v3 from_origin = springls__sub(p, fit->origin);
    springls__v3 d = springls__scale(from_origin, 1.0f / SPRINGLS__FIT_RADIUS);
    float r2 = springls__length2(d), h = springls__dot(d, fit->n);
    bool within = springls__length2(from_origin) < SPRINGLS__FIT_RADIUS * SPRINGLS__FIT_RADIUS && r2 < 1.0f;
    bool counts = within && springls__fabs(h) <= SPRINGLS__FIT_SHEET_HEIGHT
               && springls__dot(normal, fit->n) >= SPRINGLS__FIT_SHEET_FACING;
    springls__fit_equation e;
    e.term[0] = 1.0f;
    e.term[1] = springls__dot(d, fit->e1);
    e.term[2] = springls__dot(d, fit->e2);
    e.term[3] = e.term[1] * e.term[1];
    e.term[4] = e.term[1] * e.term[2];
    e.term[5] = e.term[2] * e.term[2];
    e.value[0] = h;
    e.value[1] = a.x - fit->a0.x;
    e.value[2] = a.y - fit->a0.y;
    e.value[3] = a.z - fit->a0.z;
    e.weight = counts ? SPRINGLS__FIT_WEIGHT(r2) : 0.0f;
    return e;
}

/* Adds a particle with its normal and correspondence. Returns false if it is too far, faces elsewhere, or lies on another
   sheet: weight 0 changes nothing. */
SPRINGLS__MATHS bool springls__fit_add(springls__fit *fit, springls__v3 p, springls__v3 normal, springls__v3 a)
{
    const springls__fit_equation e = springls__fit_equation_of(fit, p, normal, a);
    int i, j;
    if (!(e.weight > 0.0f)) return false;
    for (i = 0; i < SPRINGLS__FIT_TERMS; i++) {
        const float scaled = e.weight * e.term[i];
        for (j = 0; j <= i; j++) fit->normal_matrix[i * (i + 1) / 2 + j] += scaled * e.term[j];
        for (j = 0; j < SPRINGLS__FIT_VALUES; j++) fit->right[SPRINGLS__FIT_VALUES * i + j] += scaled * e.value[j];
    }
    fit->count += 1.0f;
    return true;
}

/* The fitted surface at the origin. */
typedef struct springls__fit_result {
    springls__v3 point, normal, a;
    int ok; /* 0: too few neighbors, or they lie on a line */
} springls__fit_result;

/* Factors the first `terms` rows of the normal matrix by Cholesky into l, row by row; false when it is close to singular. */
SPRINGLS__MATHS bool springls__fit_factor(const springls__fit *fit, int terms, float l[21])
{
    int i, j, k;
    for (i = 0; i < terms; i++) {
        for (j = 0; j <= i; j++) {
            float sum = fit->normal_matrix[i * (i + 1) / 2 + j];
            for (k = 0; k < j; k++) sum -= l[i * (i + 1) / 2 + k] * l[j * (j + 1) / 2 + k];
            if (i == j) {
                if (!(sum > SPRINGLS__FIT_SINGULAR * fit->normal_matrix[0])) return false;
                l[i * (i + 1) / 2 + i] = springls__sqrt(sum);
            } else {
                l[i * (i + 1) / 2 + j] = sum / l[j * (j + 1) / 2 + j];
            }
        }
    }
    return true;
}

/* Solves for one right-hand side, and replaces it in x by the solution. */
SPRINGLS__INNER void springls__fit_substitute(const float l[21], int terms, float x[SPRINGLS__FIT_TERMS])
{
    int i, k;
    for (i = 0; i < terms; i++) {
        float sum = x[i];
        for (k = 0; k < i; k++) sum -= l[i * (i + 1) / 2 + k] * x[k];
        x[i] = sum / l[i * (i + 1) / 2 + i];
    }
    for (i = terms - 1; i >= 0; i--) {
        float sum = x[i];
        for (k = i + 1; k < terms; k++) sum -= l[k * (k + 1) / 2 + i] * x[k];
        x[i] = sum / l[i * (i + 1) / 2 + i];
    }
}

/* The first `terms` coefficients of the height and of the three coordinates of a, the others 0, and the Cholesky factor l. */
typedef struct springls__fit_solution {
    float x[SPRINGLS__FIT_VALUES][SPRINGLS__FIT_TERMS], l[21];
    int terms; /* 6: of a quadratic, 3: of a plane, 0: the matrix is close to singular, or neighbors are too few */
} springls__fit_solution;

SPRINGLS__MATHS springls__fit_solution springls__fit_coefficients(const springls__fit *fit, int terms)
{
    springls__fit_solution s;
    int i, v;
    s.terms = springls__fit_factor(fit, terms, s.l) ? terms : 0;
    for (v = 0; v < SPRINGLS__FIT_VALUES; v++) {
        for (i = 0; i < SPRINGLS__FIT_TERMS; i++)
            s.x[v][i] = i < s.terms ? fit->right[SPRINGLS__FIT_VALUES * i + v] : 0.0f;
        springls__fit_substitute(s.l, s.terms, s.x[v]);
    }
    return s;
}

/* Solves for a quadratic with ten neighbors or more, for a plane with four or more and where the quadratic is close to
   singular. */
SPRINGLS__MATHS springls__fit_solution springls__fit_solve(const springls__fit *fit)
{
    const int terms = fit->count >= 10.0f ? 6 : fit->count >= 4.0f ? 3 : 0;
    springls__fit_solution s = springls__fit_coefficients(fit, terms);
    if (terms == 6 && s.terms == 0) s = springls__fit_coefficients(fit, 3);
    return s;
}

/* Returns the surface that springls__fit_solve finds; not ok if there is none. */
SPRINGLS__MATHS springls__fit_result springls__fit_surface(const springls__fit *fit)
{
    const springls__fit_solution s = springls__fit_solve(fit);
    springls__fit_result result;
    result.ok = s.terms > 0;
    result.point = fit->origin;
    result.normal = fit->n;
    result.a = fit->a0;
    if (!result.ok) return result;
    result.point = springls__mad(fit->origin, fit->n, s.x[0][0] * SPRINGLS__FIT_RADIUS);
    result.normal = springls__normalize(springls__sub(springls__sub(fit->n, springls__scale(fit->e1, s.x[0][1])),
                                                      springls__scale(fit->e2, s.x[0][2])));
    result.a = springls__add(fit->a0, springls__v3_make(s.x[1][0], s.x[2][0], s.x[3][0]));
    return result;
}

/* Solves the fit, but keeps the place where all neighbors lie to one side, at the rim of a wide hole: the height is unreliable
   there. */
SPRINGLS__MATHS springls__fit_result springls__fit_end(const springls__fit *fit)
{
    springls__fit_result result = springls__fit_surface(fit);
    float u = fit->normal_matrix[1], v = fit->normal_matrix[3], w = 0.6f * fit->normal_matrix[0];
    if (u * u + v * v > w * w) {
        result.point = fit->origin;
        result.normal = fit->n;
    }
    return result;
}

/* Ends a fit: clamps its correspondence to a voxel beyond the box of those of the neighbors. Not ok either where the fitted surface
   is further than a voxel from the origin, or turned away from n. */
SPRINGLS__MATHS springls__fit_result springls__fit_end_in_box(const springls__fit *fit, springls__box correspondences)
{
    const springls__box box = springls__box_widened(correspondences, 1.0f);
    springls__fit_result result = springls__fit_end(fit);
    float off2, facing;
    result.a = springls__min3(springls__max3(result.a, box.lower), box.upper);
    off2 = springls__length2(springls__sub(result.point, fit->origin));
    facing = springls__dot(result.normal, fit->n);
    result.ok = result.ok && off2 <= 1.0f && facing >= 0.3f;
    return result;
}

#endif
