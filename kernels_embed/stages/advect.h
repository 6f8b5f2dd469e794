/* advect.h - moving points (section 4.2) and the two flows with exact answers (section 5.2). */
#ifndef SPRINGLS__KERNEL_STAGES_ADVECT_H
#define SPRINGLS__KERNEL_STAGES_ADVECT_H

#include "../model/error_estimates.h"
#include "../model/grid.h"
#include "../model/model.h"

/* Returns n s(t) of the deformation, s(t) = cos(pi t / T). */
SPRINGLS__MATHS float springls__deformation_amplitude(float n, float period, float time)
{
    return n * springls__cospi(time / period);
}

#include "../language/width_float.h"
#include "advect_body.h"
#include "../language/width_simd.h"
#include "advect_body.h"

SPRINGLS__MATHS springls__v3 springls__rotation_velocity(springls__v3 x, springls__v3 center, springls__v3 axis, float omega)
{
    return springls__scale(springls__cross(axis, springls__sub(x, center)), omega);
}

/* Returns the displacement of the classical fourth-order Runge-Kutta scheme from its four slopes. */
SPRINGLS__MATHS springls__v3 springls__rk4(springls__v3 k1, springls__v3 k2, springls__v3 k3, springls__v3 k4, float dt)
{
    springls__v3 middle = springls__add(k2, k3);
    return springls__scale(springls__add(springls__add(k1, k4), springls__scale(middle, 2.0f)), dt * (1.0f / 6.0f));
}

/* Returns the displacement at half time of the cubic between the ends of a step, from the displacement and the slopes at both. */
SPRINGLS__MATHS springls__v3 springls__cubic_middle(springls__v3 displacement, springls__v3 first, springls__v3 last, float dt)
{
    return springls__mad(springls__scale(displacement, 0.5f), springls__sub(first, last), 0.125f * dt);
}

/* Estimates the error of that step. residual: what the slopes at half time and at the end of the cubic, weighted 4 and 1, exceed
   k2, k3, k4 by, weighted 2, 2, 1; so a sixth of it is the difference from Simpson's rule along the path. The second difference
   of the slopes shows what that rule leaves out. */
SPRINGLS__MATHS float springls__rk4_error(springls__v3 k1, springls__v3 k2, springls__v3 k3, springls__v3 k4,
                                          springls__v3 residual, float dt)
{
    const float path = 0.2f, rule = 0.01f;
    springls__v3 bend = springls__sub(springls__add(k1, k4), springls__add(k2, k3));
    float speed2 = springls__max(springls__max(springls__length2(k1), springls__length2(k2)), springls__length2(k4));
    float sum = path * springls__length(residual);
    if (speed2 > 0.0f) sum += rule * springls__length2(bend) / springls__sqrt(speed2);
    return springls__fabs(dt) * sum;
}

/* Returns 1 when the topology constraint holds a springl back (eq. 24-25), given phi at its particle before and after the
   displacement. phi must grow when the springl moves along its normal, and fall when it moves against it; else it has run into
   the sheet on the far side of voxels that may not change. A springl that moves along its surface is free, because there phi
   hardly changes, and the error of the normal would decide. */
SPRINGLS__MATHS int springls__held_by_topology(float phi_before, float phi_after, springls__v3 displacement, springls__v3 normal)
{
    float along = springls__dot(displacement, normal), normally = springls__fabs(along);
    return normally > 0.05f && normally > 0.5f * springls__length(displacement) && (phi_after - phi_before) * along < 0.0f;
}

/* Returns true when the topology constraint holds springl s back from a displacement of its particle. */
SPRINGLS__MATHS bool springls__is_held(const springls__grid *g, springls__springl s, springls__v3 displacement)
{
    float before = springls__grid_sample(g, g->phi, s.p);
    float after = springls__grid_sample(g, g->phi, springls__add(s.p, displacement));
    return springls__held_by_topology(before, after, displacement, springls__springl_normal(s)) != 0;
}

/* A sampled field: from the model's voxels to its own samples. */
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

/* Returns the velocity of motion by curvature at x: along -n by div(n), 1/voxel, the sum of the two principal curvatures of phi's
   level there. n is phi's normal, which is smoother than a triangle's; the triangle's `normal` only chooses its sign, because phi
   may have lost a drop or a sheet. Without a gradient there is no motion. Differences of phi over the distance h along six
   tangents stay near the surface, where phi is a distance, and leave out the second derivative along n. The circle of curvature k
   that touches the tangent at x has at h along it the distance d = k (h^2 - d^2) / 2. */
SPRINGLS__MATHS springls__v3 springls__curvature_velocity(const springls__grid *g, springls__v3 x, springls__v3 normal, float h)
{
    const float largest = springls__min(0.7f * h, g->far_value - 1.0f);
    springls__v3 gradient = springls__grid_gradient(g, g->phi, x);
    springls__v3 n = springls__normalize(springls__dot(gradient, normal) < 0.0f ? springls__scale(gradient, -1.0f) : gradient);
    springls__v3 e1 = springls__any_tangent(n), e2 = springls__scale(springls__cross(n, e1), 0.8660254f);
    float c = springls__grid_sample_spline(g, g->phi, x), sum = 0.0f;
    int k;
    for (k = 0; k < 6; k++) { /* tangents 60 degrees apart */
        springls__v3 t = k % 3 == 0 ? e1 : springls__mad(k % 3 == 1 ? e2 : springls__scale(e2, -1.0f), e1, 0.5f);
        float d = springls__grid_sample_spline(g, g->phi, springls__mad(x, t, k < 3 ? h : -h)) - c;
        d = springls__clamp(d, -largest, largest);
        sum += d / (h * h - d * d);
    }
    return springls__scale(n, springls__clamp(sum * (-4.0f / 6.0f), -2.0f, 2.0f));
}

/* Names the flows that kernels compute without a callback (eq. 1). */
#define SPRINGLS__FLOW_NONE 0
#define SPRINGLS__FLOW_DEFORMATION 1
#define SPRINGLS__FLOW_ROTATION 2
#define SPRINGLS__FLOW_USER 3

typedef struct springls__force_rule {
    springls__field pressure, velocity; /* channels 0: none */
    float pressure_weight, velocity_weight, curvature_weight, curvature_span;
    int flow;
    float flow_numbers[8]; /* of the deformation: n, period; of the rotation: center, axis, angular velocity */
    float dt, stage_time[4]; /* of the Runge-Kutta stages */
    float smoothing;         /* voxel^2: motion by curvature in addition, whatever dt is (eq. 22) */
    int euler, stop_at_topology;
    springls__v3 region_lower, region_upper; /* voxels: particles outside do not move */
} springls__force_rule;

SPRINGLS__USER_VELOCITY

/* Returns sigma of eq. 1 at x. */
SPRINGLS__MATHS springls__v3 springls__flow_at(const springls__model *model, const springls__force_rule *rule, springls__v3 x,
                                               float time)
{
    const float *n = rule->flow_numbers;
    springls__v3 out = springls__v3_make(0.0f, 0.0f, 0.0f);
    float v[3];
    if (rule->flow == SPRINGLS__FLOW_DEFORMATION)
        out = springls__deformation_velocity(x, n[0], springls__deformation_amplitude(n[0], n[1], time));
    if (rule->flow == SPRINGLS__FLOW_ROTATION)
        out = springls__rotation_velocity(x, springls__v3_make(n[0], n[1], n[2]), springls__v3_make(n[3], n[4], n[5]), n[6]);
    if (rule->flow == SPRINGLS__FLOW_USER) out = springls__user_velocity(x, time, model->force.user);
    if (rule->flow != SPRINGLS__FLOW_NONE) out = springls__scale(out, rule->velocity_weight);
    if (rule->velocity.channels == 0) return out;
    springls__field_sample(&rule->velocity, model->force.velocity, x, v);
    return springls__mad(out, springls__v3_make(v[0], v[1], v[2]), rule->velocity_weight);
}

/* Returns true where there is a sigma of eq. 1. */
SPRINGLS__MATHS bool springls__has_flow(const springls__force_rule *rule)
{
    return rule->flow != SPRINGLS__FLOW_NONE || rule->velocity.channels != 0;
}

/* Returns `out` plus rho of eq. 1 and motion by curvature, both along the unit normal n. */
SPRINGLS__MATHS springls__v3 springls__pushed(const springls__model *model, const springls__force_rule *rule, springls__v3 x,
                                              springls__v3 n, springls__v3 out)
{
    float rho;
    if (rule->pressure.channels != 0) {
        springls__field_sample(&rule->pressure, model->force.pressure, x, &rho);
        out = springls__mad(out, n, rule->pressure_weight * rho);
    }
    if (rule->curvature_weight != 0.0f)
        out = springls__mad(out, springls__curvature_velocity(&model->grid, x, n, rule->curvature_span),
                            rule->curvature_weight);
    return out;
}

/* The points of a springl that move: its particle, and its vertices. */
#define SPRINGLS__MOVERS 4

typedef struct springls__movers {
    springls__v3 x[SPRINGLS__MOVERS];
    float error; /* of a displacement: estimated error of the particle's integration; negative: not estimated (Euler) */
} springls__movers;

#define SPRINGLS__MOVING2 1e-4f /* voxel^2: a particle moves where the square of its displacement is larger */
#define SPRINGLS__STIRRING2 1e-6f /* voxel^2: the same of a point of a springl that stirs (sleep.h) */

/* Names how far a springl moves: not at all; less than it takes to stir; more; so far that its particle counts as moving. */
#define SPRINGLS__MOVED_NOT 0
#define SPRINGLS__MOVED_LESS 1
#define SPRINGLS__MOVED_MORE 2
#define SPRINGLS__MOVED_FAR 3

/* Returns how far a springl moves, by its displacements. */
SPRINGLS__MATHS uint8_t springls__how_far(springls__movers d)
{
    float largest2 = 0.0f;
    int m;
    for (m = 0; m < SPRINGLS__MOVERS; m++) largest2 = springls__max(largest2, springls__length2(d.x[m]));
    if (springls__length2(d.x[0]) > SPRINGLS__MOVING2) return SPRINGLS__MOVED_FAR;
    if (largest2 > SPRINGLS__STIRRING2) return SPRINGLS__MOVED_MORE;
    return largest2 > 0.0f ? SPRINGLS__MOVED_LESS : SPRINGLS__MOVED_NOT;
}

/* Returns whether forces act on a particle: it lies in their region. */
SPRINGLS__MATHS bool springls__in_force_region(springls__v3 lower, springls__v3 upper, springls__v3 p)
{
    return p.x >= lower.x && p.y >= lower.y && p.z >= lower.z && p.x <= upper.x && p.y <= upper.y && p.z <= upper.z;
}

/* Returns true when the displacements of all points are finite, and their squares too. */
SPRINGLS__MATHS bool springls__all_finite_movers(springls__movers d)
{
    int m, finite = 1;
    for (m = 0; m < SPRINGLS__MOVERS; m++) finite = finite && springls__length2(d.x[m]) < 1e18f;
    return finite != 0;
}

/* Returns the slopes of all points of a springl (eq. 2): that of the particle, or, with vertex_velocity, the flow at each point
   and the push at the particle. flow: that at the particle, without the push. */
SPRINGLS__MATHS springls__movers springls__slopes_of(const springls__model *model, const springls__force_rule *rule,
                                                     springls__movers at, float time, springls__v3 *flow)
{
    springls__v3 n = springls__normalize(springls__cross(springls__sub(at.x[2], at.x[1]), springls__sub(at.x[3], at.x[1]))), push;
    springls__movers slope;
    int m;
    slope.error = 0.0f;
    *flow = slope.x[0] = springls__flow_at(model, rule, at.x[0], time);
    if (!model->params.vertex_velocity) {
        slope.x[0] = springls__pushed(model, rule, at.x[0], n, slope.x[0]);
        for (m = 1; m < SPRINGLS__MOVERS; m++) slope.x[m] = slope.x[0];
        return slope;
    }
    push = springls__pushed(model, rule, at.x[0], n, springls__v3_make(0.0f, 0.0f, 0.0f));
    for (m = 1; m < SPRINGLS__MOVERS; m++) slope.x[m] = springls__flow_at(model, rule, at.x[m], time);
    for (m = 0; m < SPRINGLS__MOVERS; m++) slope.x[m] = springls__add(slope.x[m], push);
    return slope;
}

/* Returns all points, moved by s times their slopes. */
SPRINGLS__MATHS springls__movers springls__moved_by(springls__movers at, springls__movers slope, float s)
{
    int m;
    for (m = 0; m < SPRINGLS__MOVERS; m++) at.x[m] = springls__mad(at.x[m], slope.x[m], s);
    return at;
}

/* Finds how the flow along the cubic between the ends of a step differs from that at its stages: see springls__rk4_error. flow:
   at the stages after the first; what pushes is taken to be as it was there. */
SPRINGLS__MATHS springls__v3 springls__path_residual(const springls__model *model, const springls__force_rule *rule,
                                                     springls__v3 x, springls__v3 d, springls__v3 k1, springls__v3 k4,
                                                     const springls__v3 *flow)
{
    springls__v3 last = springls__flow_at(model, rule, springls__add(x, d), rule->stage_time[3]), change, middle;
    change = springls__sub(last, flow[2]);
    middle = springls__add(x, springls__cubic_middle(d, k1, springls__add(k4, change), rule->dt));
    middle = springls__sub(springls__flow_at(model, rule, middle, rule->stage_time[1]),
                           springls__scale(springls__add(flow[0], flow[1]), 0.5f));
    return springls__mad(change, middle, 4.0f);
}

SPRINGLS__MATHS springls__movers springls__displacement_of(const springls__model *model, const springls__force_rule *rule,
                                                           springls__movers at)
{
    springls__v3 flow[4], residual = springls__v3_make(0.0f, 0.0f, 0.0f);
    springls__movers k1 = springls__slopes_of(model, rule, at, rule->stage_time[0], flow), k2, k3, k4, d;
    int m;
    if (rule->euler) {
        for (m = 0; m < SPRINGLS__MOVERS; m++) k1.x[m] = springls__scale(k1.x[m], rule->dt);
        k1.error = -1.0f;
        return k1;
    }
    k2 = springls__slopes_of(model, rule, springls__moved_by(at, k1, 0.5f * rule->dt), rule->stage_time[1], flow + 1);
    k3 = springls__slopes_of(model, rule, springls__moved_by(at, k2, 0.5f * rule->dt), rule->stage_time[2], flow + 2);
    k4 = springls__slopes_of(model, rule, springls__moved_by(at, k3, rule->dt), rule->stage_time[3], flow + 3);
    for (m = 0; m < SPRINGLS__MOVERS; m++) d.x[m] = springls__rk4(k1.x[m], k2.x[m], k3.x[m], k4.x[m], rule->dt);
    if (springls__has_flow(rule)) residual = springls__path_residual(model, rule, at.x[0], d.x[0], k1.x[0], k4.x[0], flow + 1);
    d.error = springls__rk4_error(k1.x[0], k2.x[0], k3.x[0], k4.x[0], residual, rule->dt);
    return d;
}

/* Adds the motion by eq. 22's curvature term to the displacements of springl s, for a level set that springls carry. */
SPRINGLS__MATHS springls__movers springls__smoothed(const springls__grid *g, const springls__force_rule *rule,
                                                    springls__springl s, springls__movers d)
{
    springls__v3 smoothing;
    int m;
    if (rule->smoothing == 0.0f) return d;
    smoothing = springls__curvature_velocity(g, s.p, springls__springl_normal(s), rule->curvature_span);
    smoothing = springls__scale(smoothing, rule->smoothing);
    for (m = 0; m < SPRINGLS__MOVERS; m++) d.x[m] = springls__add(d.x[m], smoothing);
    return d;
}

/* Finds the displacements of springl i, the square of its particle's (FLT_MAX when a point's is not finite), and how far it
   moves. */
SPRINGLS__MATHS void springls__displace_element(const springls__model *model, springls__arguments args, int i)
{
    springls__force_rule rule = *model->force.rule;
    springls__springl s = model->set.s[i];
    springls__movers at, d;
    float d2;
    int m;
    (void)args;
    at.error = 0.0f;
    at.x[0] = s.p;
    for (m = 0; m < 3; m++) at.x[m + 1] = s.q[m];
    if (!springls__in_force_region(rule.region_lower, rule.region_upper, s.p)) {
        springls__displacement2(model)[i] = 0.0f;
        springls__is_moving(model)[i] = SPRINGLS__MOVED_NOT;
        return;
    }
    d = springls__smoothed(&model->grid, &rule, s, springls__displacement_of(model, &rule, at));
    if (rule.stop_at_topology && springls__is_held(&model->grid, s, d.x[0]))
        for (m = 0; m < SPRINGLS__MOVERS; m++) d.x[m] = springls__v3_make(0.0f, 0.0f, 0.0f);
    d2 = springls__length2(d.x[0]);
    springls__displacement(model)[i] = d;
    springls__displacement2(model)[i] = springls__all_finite_movers(d) ? d2 : FLT_MAX;
    springls__is_moving(model)[i] = springls__how_far(d);
}

/* Moves springl i by its displacements, if it moves at all. */
SPRINGLS__MATHS void springls__move_element(const springls__model *model, springls__arguments args, int i)
{
    springls__movers d;
    springls__springl s;
    int m;
    (void)args;
    if (springls__is_moving(model)[i] == SPRINGLS__MOVED_NOT) return;
    d = springls__displacement(model)[i];
    s = model->set.s[i];
    if (d.error >= 0.0f) model->set.error[i] = springls__error_of_motion(model->set.error[i], s, d.x, d.error);
    s.p = springls__add(s.p, d.x[0]);
    for (m = 0; m < 3; m++) s.q[m] = springls__add(s.q[m], d.x[m + 1]);
    model->set.s[i] = springls__springl_finished(s);
}

#endif
