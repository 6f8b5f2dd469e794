#include "viewer/tools.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

/* A brush in voxels of the lattice and its effect in a step of duration 1, for force callbacks. */
struct stroke {
    springls_context *ctx;
    int mask;                 /* the attribute; -1: none */
    int balls;                /* 1, with symmetry 2 */
    float center[2][3], radius;
    enum viewer_falloff falloff;
    float displacement[2][3]; /* drag */
    float amount;             /* inflate, smooth */
    const float *curvatures;  /* smooth: one a springl; NULL: 1 for all */
    int curvature_count;
    bool everywhere;          /* without fading: on the whole body */
};

/* Limits smoothing: the Laplacian of a distance is the sum of the principal curvatures, and explicit steps are stable up to
 * h^2 / 6. */
#define MAX_SMOOTHING 0.16f

static float fading(const struct stroke *s, const float from_center[3])
{
    const float q = vec3_dot(from_center, from_center) / (s->radius * s->radius), rest = 1.0f - q;
    if (!(rest > 0.0f)) {
        return 0.0f;
    }
    switch (s->falloff) {
    case VIEWER_FALLOFF_POINTED: return rest * rest * (rest * rest);
    case VIEWER_FALLOFF_FLAT: return (1.0f - q * q) * (1.0f - q * q);
    default: return rest * rest;
    }
}

/* Computes the weight of each ball at a place; together they have at most 1. The balls move with their content. */
static float weigh(const struct stroke *s, const float place[3], float time, float weights[2])
{
    float sum = 0.0f;
    for (int b = 0; b < s->balls; ++b) {
        float center[3], from_center[3];
        vec3_add_scaled(s->center[b], time, s->displacement[b], center);
        vec3_sub(place, center, from_center);
        weights[b] = fading(s, from_center);
        sum += weights[b];
    }
    for (int b = 0; b < s->balls && sum > 1.0f; ++b) {
        weights[b] /= sum;
    }
    return s->everywhere ? 1.0f : fminf(1.0f, sum);
}

/* Adds the place of the grid on the lattice to voxel coordinates: forces are on the lattice, which stays where it is when the grid
 * moves (springls_desc.follow). */
static void move_to_lattice(const springls_context *ctx, float *points, int count)
{
    int offset[3];
    springls_window_offset(ctx, offset);
    for (int i = 0; i < 3 * count; ++i) {
        points[i] += (float)offset[i % 3];
    }
}

/* Reflects a place, or a displacement, at the middle of the body at the start. */
static void mirror(const struct viewer_model *model, int axis, bool is_place, float v[3])
{
    v[axis] = (is_place ? model->lower[axis] + model->upper[axis] : 0.0f) - v[axis];
}

static struct stroke in_voxels(const struct viewer_model *model, const struct viewer_brush *brush)
{
    struct stroke stroke = {.ctx = model->ctx, .mask = model->mask, .everywhere = !brush};
    if (brush) {
        stroke.balls = brush->symmetry > 0 ? 2 : 1;
        stroke.radius = brush->radius / model->voxel;
        stroke.falloff = brush->falloff;
        for (int b = 0; b < stroke.balls; ++b) {
            float center[3] = {brush->center[0], brush->center[1], brush->center[2]};
            if (b == 1) {
                mirror(model, brush->symmetry - 1, true, center);
            }
            springls_to_voxel(model->ctx, center, 1, stroke.center[b]);
            move_to_lattice(model->ctx, stroke.center[b], 1);
        }
    }
    return stroke;
}

/* ---- finding the surface ---- */

bool viewer_pick(struct viewer_model *model, const struct viewer_ray *ray, struct viewer_brush *brush)
{
    springls_hit hit;
    const springls_status status = springls_raycast(model->ctx, SPRINGLS_SURFACE_WATERTIGHT, ray->origin, ray->direction, 1,
                                                    0.0f, &hit);
    if (!viewer_model_check(model, status) || hit.springl < 0) {
        return false;
    }
    memcpy(brush->center, hit.point, sizeof hit.point);
    memcpy(brush->normal, hit.normal, sizeof hit.normal);
    return true;
}

/* ---- motion ---- */

/* Limits a displacement so that the map x + displacement * w(x) has a Jacobian of 0.6 or more: the gradient of w is at most 1.54,
 * 1.91 or 2.43 / R. */
float viewer_max_displacement(const struct viewer_model *model, const struct viewer_brush *brush)
{
    static const float share[VIEWER_FALLOFFS] = {0.25f, 0.2f, 0.16f};
    return fminf(2.0f * model->voxel, share[brush->falloff] * brush->radius);
}

static void drag_velocity(void *user, const springls_batch *batch, float *out)
{
    const struct stroke *s = user;
    const springls_view mask = springls_view_attribute(s->ctx, s->mask);
    for (int i = 0; i < batch->count; ++i, out += 3) {
        float weights[2];
        weigh(s, batch->points + 3 * i, batch->time, weights);
        memset(out, 0, 3 * sizeof *out);
        for (int b = 0; b < s->balls; ++b) {
            const float w = weights[b] * (1.0f - viewer_model_mask_of(&mask, batch->springls[i]));
            vec3_add_scaled(out, w, s->displacement[b], out);
        }
    }
}

bool viewer_drag(struct viewer_model *model, struct viewer_brush *brush, const float displacement[3])
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces forces = {.velocity_batch = drag_velocity, .user = &stroke, .voxel_units = true};
    for (int b = 0; b < stroke.balls; ++b) {
        for (int a = 0; a < 3; ++a) {
            stroke.displacement[b][a] = displacement[a] / model->voxel;
        }
    }
    if (stroke.balls == 2) {
        mirror(model, brush->symmetry - 1, false, stroke.displacement[1]);
    }
    if (!viewer_model_finish(model)) {
        return false;
    }
    springls_set_time(model->ctx, 0.0);
    if (!viewer_model_step(model, &forces, sizeof stroke, NULL, NULL)) {
        return false;
    }
    vec3_add_scaled(brush->center, 1.0f, displacement, brush->center);
    return true;
}

/* Drags everything in the brush along its normal: pressure along the springls' own normals would fold a dent. */
bool viewer_push(struct viewer_model *model, const struct viewer_brush *brush, float distance)
{
    const float still[3] = {0.0f, 0.0f, 0.0f};
    struct viewer_brush moved = *brush;
    float along[3];
    vec3_add_scaled(still, distance, brush->normal, along);
    return viewer_drag(model, &moved, along);
}

static void brush_pressure(void *user, const springls_batch *batch, float *out)
{
    const struct stroke *s = user;
    const springls_view mask = springls_view_attribute(s->ctx, s->mask);
    float weights[2];
    for (int i = 0; i < batch->count; ++i) {
        const int springl = batch->springls[i];
        const float amount = s->amount * weigh(s, batch->points + 3 * i, 0.0f, weights);
        const float curvature = !s->curvatures ? 1.0f : springl < s->curvature_count ? s->curvatures[springl] : 0.0f;
        out[i] = amount * (1.0f - viewer_model_mask_of(&mask, springl)) * curvature;
    }
}

bool viewer_inflate(struct viewer_model *model, const struct viewer_brush *brush, float distance)
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces forces = {.pressure_batch = brush_pressure, .user = &stroke, .voxel_units = true};
    stroke.amount = distance / model->voxel;
    return viewer_model_step(model, &forces, sizeof stroke, NULL, NULL);
}

/* ---- smoothing ---- */

static const float *particle(const springls_view *view, int springl)
{
    return (const float *)(const void *)((const char *)view->data + (size_t)springl * view->stride);
}

/* Returns how strongly the stroke acts on a springl, without its mask. */
static float weight_of(const struct stroke *s, const springls_view *particles, int springl)
{
    float place[3], weights[2];
    memcpy(place, particle(particles, springl), sizeof place);
    move_to_lattice(s->ctx, place, 1);
    return weigh(s, place, 0.0f, weights);
}

/* Computes the curvature at `count` particles from `first` on: the Laplacian of phi, by its samples there and a voxel away along
 * each axis. */
static bool find_curvatures(struct viewer_model *model, void *user, int first, int count)
{
    enum { SAMPLES = 7, AT_ONCE = 64 };
    struct stroke *s = user;
    const springls_view particles = springls_view_particles(model->ctx);
    float points[3 * SAMPLES * AT_ONCE], phi[SAMPLES * AT_ONCE];
    int springls[AT_ONCE], found = 0;
    for (int i = first; i < first + count; ++i) {
        if (weight_of(s, &particles, i) > 0.0f) {
            springls[found] = i;
            for (int n = 0; n < SAMPLES; ++n) {
                float *point = points + 3 * (SAMPLES * found + n);
                memcpy(point, particle(&particles, i), 3 * sizeof *point);
                if (n > 0) {
                    point[(n - 1) / 2] += n % 2 ? 1.0f : -1.0f;
                }
            }
            ++found;
        }
        if (found == AT_ONCE || (i + 1 == first + count && found > 0)) {
            springls_to_world(model->ctx, points, SAMPLES * found, points);
            if (!viewer_model_check(model, springls_sample_distance(model->ctx, points, SAMPLES * found, phi))) {
                return false;
            }
            for (int k = 0; k < found; ++k) {
                const float *p = phi + SAMPLES * k;
                const float curvature = (p[1] + p[2] + p[3] + p[4] + p[5] + p[6] - 6.0f * p[0]) / model->voxel;
                model->force_samples[springls[k]] = -fmaxf(-2.0f, fminf(2.0f, curvature));
            }
            found = 0;
        }
    }
    return true;
}

/* The curvature force would smooth the whole body, whether it is masked or not. */
bool viewer_smooth(struct viewer_model *model, const struct viewer_brush *brush, float amount)
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces everywhere_forces = {.curvature_weight = MAX_SMOOTHING * amount, .voxel_units = true};
    const springls_forces forces = {.pressure_batch = brush_pressure, .user = &stroke, .voxel_units = true};
    if (!brush && model->mask < 0) {
        return viewer_model_step(model, &everywhere_forces, 0, NULL, NULL);
    }
    if (!viewer_model_finish(model)) {
        return false;
    }
    stroke.amount = MAX_SMOOTHING * amount;
    stroke.curvature_count = springls_count(model->ctx);
    float *curvatures = calloc((size_t)stroke.curvature_count + 1, sizeof *curvatures);
    stroke.curvatures = curvatures;
    return curvatures ? viewer_model_step(model, &forces, sizeof stroke, curvatures, find_curvatures)
                      : viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
}

/* ---- the mask ---- */

bool viewer_mask(struct viewer_model *model, const struct viewer_brush *brush, float amount)
{
    if (!viewer_model_finish(model)) {
        return false;
    }
    const struct stroke stroke = in_voxels(model, brush);
    const springls_view particles = springls_view_particles(model->ctx);
    const springls_view mask = springls_view_attribute(model->ctx, model->mask);
    float *values = malloc(((size_t)particles.count + 1) * sizeof *values);
    for (int i = 0; values && i < particles.count; ++i) {
        const float value = viewer_model_mask_of(&mask, i) + amount * weight_of(&stroke, &particles, i);
        values[i] = fmaxf(0.0f, fminf(1.0f, value));
    }
    const bool good = values ? viewer_model_set_mask(model, values) : viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    free(values);
    return good;
}
