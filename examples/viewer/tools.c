#include "viewer/tools.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

/* A brush in voxels of the lattice and its effect in a step of duration 1, for force callbacks. */
struct stroke {
    float center[3], radius;
    float displacement[3];    /* drag */
    float amount;    /* inflate, smooth */
    bool everywhere; /* without fading: on the whole body */
};

/* Limits smoothing: the Laplacian of a distance is the sum of the principal curvatures, and explicit steps are stable up to
 * h^2 / 6. */
#define MAX_SMOOTHING 0.16f

static float fading(const float from_center[3], float radius)
{
    const float q = 1.0f - vec3_dot(from_center, from_center) / (radius * radius);
    return q > 0.0f ? q * q : 0.0f;
}

/* Adds the place of the grid on the lattice to voxel coordinates, or takes it away: forces are on the lattice, which stays where
 * it is when the grid moves (springls_desc.follow). */
static void move_to_lattice(const struct viewer_model *model, float sign, float *points, size_t count)
{
    int offset[3];
    springls_window_offset(model->ctx, offset);
    for (size_t i = 0; i < 3 * count; ++i) {
        points[i] += sign * (float)offset[i % 3];
    }
}

static struct stroke in_voxels(const struct viewer_model *model, const struct viewer_brush *brush)
{
    struct stroke stroke = {.everywhere = !brush};
    if (brush) {
        springls_to_voxel(model->ctx, brush->center, 1, stroke.center);
        move_to_lattice(model, 1.0f, stroke.center, 1);
        stroke.radius = brush->radius / model->voxel;
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

/* Limits a displacement to a quarter of R: the gradient of w is at most 1.54 / R, so the map x + displacement * w(x) has a
 * Jacobian of 0.6 or more. */
float viewer_max_displacement(const struct viewer_model *model, const struct viewer_brush *brush)
{
    return fminf(2.0f * model->voxel, 0.25f * brush->radius);
}

static void drag_velocity(void *user, const float *points, int count, float time, float *out)
{
    const struct stroke *s = user;
    float center[3], from_center[3];
    vec3_add_scaled(s->center, time, s->displacement, center); /* the ball moves with its content */
    for (int i = 0; i < 3 * count; i += 3) {
        vec3_sub(points + i, center, from_center);
        const float w = fading(from_center, s->radius);
        for (int a = 0; a < 3; ++a) {
            out[i + a] = w * s->displacement[a];
        }
    }
}

bool viewer_drag(struct viewer_model *model, struct viewer_brush *brush, const float displacement[3])
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces forces = {.velocity = drag_velocity, .user = &stroke};
    for (int a = 0; a < 3; ++a) {
        stroke.displacement[a] = displacement[a] / model->voxel;
    }
    if (!viewer_model_finish(model)) {
        return false;
    }
    springls_set_time(model->ctx, 0.0);
    if (!viewer_model_step(model, &forces, sizeof stroke, NULL)) {
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

static void brush_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct stroke *s = user;
    float from_center[3];
    (void)normals, (void)time;
    for (int i = 0; i < count; ++i) {
        vec3_sub(points + 3 * i, s->center, from_center);
        out[i] = s->amount * (s->everywhere ? 1.0f : fading(from_center, s->radius));
    }
}

bool viewer_inflate(struct viewer_model *model, const struct viewer_brush *brush, float distance)
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces forces = {.pressure = brush_pressure, .user = &stroke};
    stroke.amount = distance / model->voxel;
    return viewer_model_step(model, &forces, sizeof stroke, NULL);
}

/* ---- smoothing ---- */

/* Computes the voxels lo .. lo + size - 1 around the brush, with a border outside it. */
static void voxels_of(const struct stroke *stroke, int lo[3], int size[3])
{
    for (int a = 0; a < 3; ++a) {
        lo[a] = (int)floorf(stroke->center[a] - stroke->radius) - 1;
        size[a] = (int)ceilf(stroke->center[a] + stroke->radius) + 2 - lo[a];
    }
}

/* Samples phi at these voxels and one more on each side, in voxels. */
static bool read_distances(struct viewer_model *model, const int lo[3], const int size[3], float *points, float *phi)
{
    size_t n = 0;
    for (int k = -1; k <= size[2]; ++k) {
        for (int j = -1; j <= size[1]; ++j) {
            for (int i = -1; i <= size[0]; ++i, ++n) {
                points[3 * n] = (float)(lo[0] + i);
                points[3 * n + 1] = (float)(lo[1] + j);
                points[3 * n + 2] = (float)(lo[2] + k);
            }
        }
    }
    move_to_lattice(model, -1.0f, points, n);
    springls_to_world(model->ctx, points, (int)n, points);
    return viewer_model_check(model, springls_sample_distance(model->ctx, points, (int)n, phi));
}

/* Sets the pressure to -amount * w * curvature at each voxel; the curvature force would smooth the whole body. */
static void fill_pressure(const struct stroke *stroke, const int lo[3], const int size[3], float voxel, const float *phi,
                          float *pressure)
{
    const int row = size[0] + 2, slice = row * (size[1] + 2);
    for (int k = 0; k < size[2]; ++k) {
        for (int j = 0; j < size[1]; ++j) {
            for (int i = 0; i < size[0]; ++i) {
                const float *p = phi + (i + 1) + (j + 1) * row + (k + 1) * slice;
                const float x[3] = {(float)(lo[0] + i), (float)(lo[1] + j), (float)(lo[2] + k)};
                const float curvature = (p[1] + p[-1] + p[row] + p[-row] + p[slice] + p[-slice] - 6.0f * p[0]) / voxel;
                float from_center[3];
                vec3_sub(x, stroke->center, from_center);
                *pressure++ = -stroke->amount * fading(from_center, stroke->radius) * fmaxf(-2.0f, fminf(2.0f, curvature));
            }
        }
    }
}

static bool smooth_in_brush(struct viewer_model *model, struct stroke *stroke)
{
    springls_forces forces = {0};
    int lo[3], size[3];
    voxels_of(stroke, lo, size);
    const size_t inner = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    const size_t outer = (size_t)(size[0] + 2) * (size_t)(size[1] + 2) * (size_t)(size[2] + 2);
    float *room = calloc(4 * outer, sizeof *room), *pressure = malloc(inner * sizeof *pressure);
    bool good = room && pressure ? viewer_model_finish(model) && read_distances(model, lo, size, room + outer, room)
                                 : viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    if (good) {
        fill_pressure(stroke, lo, size, model->voxel, room, pressure);
        forces.pressure_grid.data = pressure;
        forces.pressure_grid.grid = model->desc.grid;
        for (int a = 0; a < 3; ++a) {
            forces.pressure_grid.grid.size[a] = size[a];
            forces.pressure_grid.grid.origin[a] += model->desc.grid.spacing[a] * lo[a];
        }
        good = viewer_model_step(model, &forces, 0, pressure);
    } else {
        free(pressure);
    }
    free(room);
    return good;
}

bool viewer_smooth(struct viewer_model *model, const struct viewer_brush *brush, float amount)
{
    struct stroke stroke = in_voxels(model, brush);
    const springls_forces everywhere_forces = {.curvature_weight = MAX_SMOOTHING * amount};
    stroke.amount = MAX_SMOOTHING * amount;
    return brush ? smooth_in_brush(model, &stroke) : viewer_model_step(model, &everywhere_forces, 0, NULL);
}
