/* advect.h - moving points (section 4.2). */
#ifndef SPRINGLS__KERNEL_STAGES_ADVECT_H
#define SPRINGLS__KERNEL_STAGES_ADVECT_H

#include "../model/error_estimates.h"
#include "../model/grid.h"
#include "../model/model.h"

/* Returns true when the topology constraint holds a springl back (eq. 24-25), given phi at its particle before and after the
   displacement. phi must grow when the springl moves along its normal, and fall when it moves against it; else it has run into
   the sheet on the far side of voxels that may not change. A springl that moves along its surface is free, because there phi
   hardly changes, and the error of the normal would decide. */
SPRINGLS__MATHS bool springls__held_by_topology(float phi_before, float phi_after, springls__v3 displacement, springls__v3 normal)
{
    float along = springls__dot(displacement, normal), normally = springls__fabs(along);
    return normally > 0.05f && normally > 0.5f * springls__length(displacement) && (phi_after - phi_before) * along < 0.0f;
}

/* Returns true when the topology constraint holds a springl at p, facing n, back from a displacement of its particle. */
SPRINGLS__MATHS bool springls__is_held(const springls__grid *g, springls__v3 p, springls__v3 n, springls__v3 displacement)
{
    float before = springls__grid_sample(g, g->phi, p);
    float after = springls__grid_sample(g, g->phi, springls__add(p, displacement));
    return springls__held_by_topology(before, after, displacement, n);
}

/* A sampled field; from_voxel maps the model's voxel coordinates to those of its samples. */
typedef struct springls__field { float from_voxel[12]; int size[3], channels; } springls__field;

SPRINGLS__MATHS void springls__field_sample(const springls__field *field, SPRINGLS__GLOBAL const float *data, springls__v3 x,
                                            float *out)
{
    const float *m = field->from_voxel;
    float f[3], corner[8];
    int i[3], axis, channel, c;
    f[0] = m[0] * x.x + m[1] * x.y + m[2] * x.z + m[3];
    f[1] = m[4] * x.x + m[5] * x.y + m[6] * x.z + m[7];
    f[2] = m[8] * x.x + m[9] * x.y + m[10] * x.z + m[11];
    for (axis = 0; axis < 3; axis++) {
        f[axis] = springls__clamp(f[axis], 0.0f, (float)(field->size[axis] - 1));
        i[axis] = springls__imax(springls__imin((int)f[axis], field->size[axis] - 2), 0);
        f[axis] -= (float)i[axis];
    }
    for (channel = 0; channel < field->channels; channel++) {
        for (c = 0; c < 8; c++) {
            size_t sx = (size_t)springls__imin(i[0] + (c & 1), field->size[0] - 1);
            size_t sy = (size_t)springls__imin(i[1] + ((c >> 1) & 1), field->size[1] - 1);
            size_t sz = (size_t)springls__imin(i[2] + (c >> 2), field->size[2] - 1);
            corner[c] = data[(sx + (size_t)field->size[0] * (sy + (size_t)field->size[1] * sz)) * (size_t)field->channels
                             + (size_t)channel];
        }
        out[channel] = springls__trilinear(corner, f[0], f[1], f[2]);
    }
}

/* How far along tangents curvature is measured, voxels. A shorter span is noisier, and stable in shorter steps only. */
#define SPRINGLS__CURVATURE_SPAN 1.5f

/* Returns how far from x, along steps of the length 1, phi has the value `level`: by Newton's method, at most `largest` either way.
   slope: of phi along the step, where the surface is smooth. */
SPRINGLS__MATHS float springls__level_height(const springls__grid *g, springls__v3 x, springls__v3 step, float slope, float level,
                                             float largest)
{
    float height = 0.0f;
    int i;
    for (i = 0; i < 3; i++) {
        springls__v3 at = springls__mad(x, step, height);
        float rise = springls__max(springls__dot(springls__grid_gradient(g, g->phi, at), step), 0.3f * slope);
        height -= (springls__grid_sample_spline(g, g->phi, at) - level) / rise;
        height = springls__clamp(height, -largest, largest);
    }
    return height;
}

/* Returns springls__curvature_velocity where the grid's spacing is not uniform: n is the unit normal in voxels, gradient that of phi.
   Off its zero phi is no distance in the world, so heights of its level over the tangent plane take its place: the circle of curvature
   k has at h along the tangent the height d = k (h^2 + d^2) / 2. Three directions in the plane give the second fundamental form
   a u^2 + 2 b u v + c v^2 along e1 and e2. The sum of the principal curvatures is its trace in the plane's metric. */
SPRINGLS__MATHS springls__v3 springls__world_curvature_velocity(const springls__grid *g, springls__v3 x, springls__v3 n,
                                                                springls__v3 gradient, float h)
{
    const springls__metric lengths = springls__metric_inverse(g->metric);
    const springls__v3 step = springls__along_normal(g->metric, n), e1 = springls__any_tangent(n), e2 = springls__cross(n, e1);
    const springls__v3 up = springls__dot(gradient, n) < 0.0f ? springls__scale(step, -1.0f) : step; /* phi grows along it */
    const float slope = springls__dot(gradient, up), level = springls__grid_sample_spline(g, g->phi, x);
    const float uu = springls__metric_product(lengths, e1, e1), uv = springls__metric_product(lengths, e1, e2);
    const float vv = springls__metric_product(lengths, e2, e2);
    float bend[3] = { 0.0f, 0.0f, 0.0f }, b, c;
    int k;
    for (k = 0; k < 6; k++) { /* at 0, 60, 120 degrees, and opposite */
        const float along1 = k % 3 == 0 ? 1.0f : 0.5f, along2 = k % 3 == 0 ? 0.0f : k % 3 == 1 ? 0.8660254f : -0.8660254f;
        springls__v3 t = springls__mad(springls__scale(e1, along1), e2, along2);
        float length2 = springls__metric_product(lengths, t, t), span2 = h * h * length2, d;
        d = springls__level_height(g, springls__mad(x, t, k < 3 ? h : -h), up, slope, level,
                                   0.7f * springls__sqrt(span2));
        bend[k % 3] -= d * length2 / (span2 + d * d);
    }
    c = (2.0f * (bend[1] + bend[2]) - bend[0]) * (1.0f / 3.0f);
    b = (bend[1] - bend[2]) * 0.5773503f;
    return springls__scale(step, springls__clamp((2.0f * b * uv - bend[0] * vv - c * uu) / (uu * vv - uv * uv), -2.0f, 2.0f));
}

/* Returns the velocity of motion by curvature at x: along -n by div(n), the sum of the two principal curvatures of phi's level there,
   in smallest spacings of the grid. n is phi's normal, which is smoother than a triangle's; the triangle's `normal` only chooses its sign,
   because phi may have lost a drop or a sheet. Without a gradient there is no motion. Differences of phi over the distance h along six
   tangents stay near the surface, where phi is a distance, and leave out the second derivative along n. The circle of curvature k that
   touches the tangent at x has at h along it the distance d = k (h^2 - d^2) / 2. */
SPRINGLS__MATHS springls__v3 springls__curvature_velocity(const springls__grid *g, springls__v3 x, springls__v3 normal, float h)
{
    const float largest = springls__min(0.7f * h, g->far_value - 1.0f);
    springls__v3 gradient = springls__grid_gradient(g, g->phi, x);
    springls__v3 n = springls__normalize(springls__dot(gradient, normal) < 0.0f ? springls__scale(gradient, -1.0f) : gradient);
    springls__v3 e1 = springls__any_tangent(n), e2 = springls__scale(springls__cross(n, e1), 0.8660254f);
    float c, sum = 0.0f;
    int k;
    if (!springls__is_uniform(g->metric)) return springls__world_curvature_velocity(g, x, n, gradient, h);
    c = springls__grid_sample_spline(g, g->phi, x);
    for (k = 0; k < 6; k++) { /* tangents 60 degrees apart */
        springls__v3 t = k % 3 == 0 ? e1 : springls__mad(k % 3 == 1 ? e2 : springls__scale(e2, -1.0f), e1, 0.5f);
        float d = springls__grid_sample_spline(g, g->phi, springls__mad(x, t, k < 3 ? h : -h)) - c;
        d = springls__clamp(d, -largest, largest);
        sum += d / (h * h - d * d);
    }
    return springls__scale(n, springls__clamp(sum * (-4.0f / 6.0f), -2.0f, 2.0f));
}

typedef struct springls__force_rule {
    springls__field pressure, velocity; /* channels 0: none */
    float pressure_weight, velocity_weight, curvature_weight, curvature_span;
    int has_velocity;        /* 1: callbacks or the user's text give a velocity */
    float dt, stage_time[4]; /* of the Runge-Kutta stages */
    float smoothing;         /* voxel^2: motion by curvature in addition, whatever dt is (eq. 22) */
    int euler, stop_at_topology;
    springls__v3 region_lower, region_upper; /* voxels: particles outside do not move */
    springls__v3 window;     /* voxels: from the window to the lattice, where velocities are given */
    springls__metric lengths; /* of the displacements that are compared, in smallest spacings; all zero: voxels */
} springls__force_rule;

/* Returns the velocity at x, linear between the samples of the rule's field. */
SPRINGLS__MATHS springls__v3 springls__sampled_velocity(const springls__force_rule *rule, SPRINGLS__GLOBAL const float *samples,
                                                        springls__v3 x)
{
    float v[3];
    springls__field_sample(&rule->velocity, samples, x, v);
    return springls__v3_make(v[0], v[1], v[2]);
}

SPRINGLS__MATHS float springls__sampled_pressure(const springls__force_rule *rule, SPRINGLS__GLOBAL const float *samples,
                                                 springls__v3 x)
{
    float rho;
    springls__field_sample(&rule->pressure, samples, x, &rho);
    return rho;
}

/* Returns `out` plus rho of eq. 1 along the unit normal n. */
SPRINGLS__MATHS springls__v3 springls__pressed(const springls__force_rule *rule, float rho, springls__v3 n, springls__v3 out)
{
    return springls__mad(out, n, rule->pressure_weight * rho);
}

/* Returns `out` plus motion by curvature at x along the unit normal n. */
SPRINGLS__MATHS springls__v3 springls__curved(const springls__grid *g, const springls__force_rule *rule, springls__v3 x,
                                              springls__v3 n, springls__v3 out)
{
    if (rule->curvature_weight == 0.0f) return out;
    return springls__mad(out, springls__curvature_velocity(g, x, n, rule->curvature_span), rule->curvature_weight);
}

/* Returns the displacement by eq. 22's curvature term at x, facing n. */
SPRINGLS__MATHS springls__v3 springls__smoothing_at(const springls__grid *g, const springls__force_rule *rule, springls__v3 x,
                                                    springls__v3 n)
{
    if (rule->smoothing == 0.0f) return springls__v3_make(0.0f, 0.0f, 0.0f);
    return springls__scale(springls__curvature_velocity(g, x, n, rule->curvature_span), rule->smoothing);
}

/* Returns true if there is a sigma of eq. 1. */
SPRINGLS__MATHS bool springls__has_flow(const springls__force_rule *rule)
{
    return rule->has_velocity || rule->velocity.channels != 0;
}

/* The points of a springl that move: its particle, and its vertices. */
#define SPRINGLS__MOVERS 4

#define SPRINGLS__MOVING2 1e-4f /* voxel^2: a springl counts as moving where the square of its particle's displacement is larger */
#define SPRINGLS__STIRRING2 1e-6f /* voxel^2: a springl stirs (sleep.h) where the square of a point's displacement is larger */

/* Names how far a springl moves: not at all; without stirring; so that it stirs; so that it counts as moving. */
#define SPRINGLS__MOTION_NONE 0
#define SPRINGLS__MOTION_CALM 1
#define SPRINGLS__MOTION_STIRS 2
#define SPRINGLS__MOTION_COUNTS 3

/* Returns how far a springl moves, from the squares of its particle's displacement and of the largest one of its points. */
SPRINGLS__MATHS uint8_t springls__motion_class_of(float particle2, float largest2)
{
    if (particle2 > SPRINGLS__MOVING2) return SPRINGLS__MOTION_COUNTS;
    if (largest2 > SPRINGLS__STIRRING2) return SPRINGLS__MOTION_STIRS;
    return largest2 > 0.0f ? SPRINGLS__MOTION_CALM : SPRINGLS__MOTION_NONE;
}

#include "../language/width_float.h"
#include "advect_body.h"
#include "../language/width_simd.h"
#include "advect_body.h"

#endif
