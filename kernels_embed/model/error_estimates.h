/* error_estimates.h - estimates how far a springl's correspondence is from where its particle has come from. That error comes
   with a split or a fill and lasts: the particle and the place that it has come from move together. */
#ifndef SPRINGLS__KERNEL_MODEL_ERROR_ESTIMATES_H
#define SPRINGLS__KERNEL_MODEL_ERROR_ESTIMATES_H

#include "cell_list.h"
#include "fit.h"
#include "model.h"

#define SPRINGLS__ERROR_FACTOR 1.5f /* makes 95 % of errors smaller than estimated, on the motions of tests and benchmarks */
#define SPRINGLS__UNKNOWN_ERROR 4.0f /* voxels: of a springl with too few neighbors for a fit, as beside a tear */

/* The surface around a place as its springls span it, for estimates. */
typedef struct springls__span {
    springls__fit fit;
    springls__fit_solution solution;
    float original_length[2]; /* the smaller and the larger length on the original surface of a voxel's length here */
} springls__span;

/* Finds how lengths along the surface map to the original: the singular values of the gradient of a. */
SPRINGLS__MATHS void springls__find_stretch(springls__span *span)
{
    float uu = 0.0f, uv = 0.0f, vv = 0.0f, mean, spread;
    const float least = 1e-2f; /* a voxel of the original counts as at most a hundred here */
    int v;
    for (v = 1; v < SPRINGLS__FIT_VALUES; v++) {
        float u = span->solution.x[v][1] * (1.0f / SPRINGLS__FIT_RADIUS);
        float w = span->solution.x[v][2] * (1.0f / SPRINGLS__FIT_RADIUS);
        uu += u * u;
        uv += u * w;
        vv += w * w;
    }
    mean = 0.5f * (uu + vv);
    spread = springls__sqrt(0.25f * (uu - vv) * (uu - vv) + uv * uv);
    span->original_length[0] = springls__max(springls__sqrt(springls__max(mean - spread, 0.0f)), least);
    span->original_length[1] = springls__max(springls__sqrt(mean + spread), least);
}

/* Fits the surface around p, facing n, over springls before `known`, by heights over p and correspondences relative to a. */
SPRINGLS__MATHS springls__span springls__span_at(const springls__model *model, springls__v3 p, springls__v3 n, springls__v3 a,
                                                 int known)
{
    springls__cell_walk walk = springls__cell_walk_near(model, p, SPRINGLS__FIT_RADIUS);
    springls__span span;
    int other;
    span.fit = springls__fit_begin(p, n, a);
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        if (other < known) springls__fit_add(&span.fit, o->p, springls__springl_normal(*o), model->set.a[other]);
    }
    span.solution = springls__fit_solve(&span.fit);
    if (span.solution.terms) springls__find_stretch(&span);
    return span;
}

/* Sums of squares over the springls of a span, by the weights of its fit. */
typedef struct springls__span_sums { float weight, height2, a2, error2; } springls__span_sums;

SPRINGLS__MATHS springls__span_sums springls__sum_residuals(const springls__model *model, const springls__span *span, int known)
{
    springls__cell_walk walk = springls__cell_walk_near(model, span->fit.origin, SPRINGLS__FIT_RADIUS);
    springls__span_sums sums;
    int other, v, i;
    sums.weight = sums.height2 = sums.a2 = sums.error2 = 0.0f;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &model->set.s[other];
        springls__fit_equation e;
        if (other >= known) continue;
        e = springls__fit_equation_of(&span->fit, o->p, springls__springl_normal(*o), model->set.a[other]);
        if (!(e.weight > 0.0f)) continue;
        sums.weight += e.weight;
        sums.error2 += e.weight * model->set.error[other] * model->set.error[other];
        for (v = 0; v < SPRINGLS__FIT_VALUES; v++) {
            float r = e.value[v];
            for (i = 0; i < span->solution.terms; i++) r -= span->solution.x[v][i] * e.term[i];
            if (v == 0) sums.height2 += e.weight * r * r;
            else sums.a2 += e.weight * r * r;
        }
    }
    return sums;
}

/* Estimates the error of a new springl with particle p, facing n, and correspondence a, from springls before `known`, in voxels
   of the original surface: standard errors of a fit at p, its difference from that fit, and the errors of its sources. Heights
   count by as much as the surface has become thinner, as without a change of volume. Sources that deviate from the fit by more
   than a voxel are of two sheets, and count in full. */
SPRINGLS__NOINLINE float springls__error_at_birth(const springls__model *model, springls__v3 p, springls__v3 n, springls__v3 a,
                                                  int known)
{
    const float standard_errors = 2.0f;
    springls__span span = springls__span_at(model, p, n, a, known);
    springls__span_sums sums;
    float unit[SPRINGLS__FIT_TERMS], height, shift2, variance, thinner, residual2, mixed;
    int i, spare;
    if (!span.solution.terms) return SPRINGLS__UNKNOWN_ERROR;
    sums = springls__sum_residuals(model, &span, known);
    for (i = 0; i < SPRINGLS__FIT_TERMS; i++) unit[i] = i == 0 ? 1.0f : 0.0f;
    springls__fit_substitute(span.solution.l, span.solution.terms, unit);
    spare = springls__imax((int)span.fit.count - span.solution.terms, 1);
    variance = standard_errors * standard_errors * unit[0] / (float)spare;
    thinner = SPRINGLS__FIT_RADIUS / (span.original_length[0] * span.original_length[1]);
    height = span.solution.x[0][0] * thinner;
    shift2 = span.solution.x[1][0] * span.solution.x[1][0] + span.solution.x[2][0] * span.solution.x[2][0]
           + span.solution.x[3][0] * span.solution.x[3][0];
    residual2 = sums.a2 + sums.height2 * thinner * thinner;
    mixed = standard_errors * springls__max(springls__sqrt(residual2 / sums.weight) - 1.0f, 0.0f);
    return springls__sqrt(variance * residual2 + mixed * mixed + shift2 + height * height + sums.error2 / sums.weight);
}

/* Returns the error of a place from one on the original surface. That of an original springl has grown as lengths have; that of
   a split or fill by the fourth root of it, as it began on a surface that was stretched already. */
SPRINGLS__MATHS float springls__error_at_place(const springls__span *span, float error, int original)
{
    float a = 1.0f, b = 1.0f, c = 1.0f, growth;
    if (span->solution.terms) {
        a = 1.0f / span->original_length[0];
        b = 1.0f / span->original_length[1];
        c = span->original_length[0] * span->original_length[1];
    }
    growth = springls__sqrt((a * a + b * b + c * c) * (1.0f / 3.0f));
    return error * (original ? growth : springls__sqrt(springls__sqrt(growth)));
}

#endif
