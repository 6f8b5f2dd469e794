#include "shapes/shape_pictures.h"

#include "base/vec3.h"
#include "shapes/surface_fit.h"

#include <lapacke.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Computes the sum of the triangles' area-weighted normals over their total area: zero for a closed surface. */
static void mean_normal(const struct shape_mesh *mesh, float mean[3])
{
    float area = 0.0f;
    memset(mean, 0, 3 * sizeof *mean);
    for (int t = 0; t < mesh->triangle_count; ++t) {
        float corners[9], normal[3];
        for (int k = 0; k < 3; ++k) {
            memcpy(corners + 3 * k, mesh->positions + 3 * mesh->triangles[3 * t + k], 3 * sizeof *corners);
        }
        const float a = vec3_triangle_normal(corners, normal);
        vec3_add_scaled(mean, a, normal, mean);
        area += a;
    }
    for (int k = 0; k < 3; ++k) {
        mean[k] /= fmaxf(area, 1e-20f);
    }
}

struct shape_view shape_view_make(const struct shape_mesh *mesh, int width, int height)
{
    const float *shape = mesh->positions;
    const int vertices = mesh->vertex_count;
    const struct shape_view none = {.width = width, .height = height};
    struct shape_view view = none;
    double center[3], radius, spread[9] = {0}, extents[3];
    float axis[3][3], outward[3], direction[3] = {0.0f, 0.0f, 0.0f};
    shape_size(shape, (size_t)vertices, center, &radius);
    for (int v = 0; v < vertices; ++v) {
        for (int r = 0; r < 3; ++r) {
            for (int c = 0; c < 3; ++c) {
                spread[3 * r + c] += ((double)shape[3 * v + r] - center[r]) * ((double)shape[3 * v + c] - center[c]);
            }
        }
    }
    if (LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'V', 'U', 3, spread, 3, extents) != 0) {
        return view;
    }
    mean_normal(mesh, outward);
    for (int k = 0; k < 3; ++k) { /* thinnest first; with a definite sign, so that pictures are not turned */
        int largest = 0;
        for (int r = 0; r < 3; ++r) {
            axis[k][r] = (float)spread[3 * r + k];
            largest = fabsf(axis[k][r]) > fabsf(axis[k][largest]) ? r : largest;
        }
        const float out = vec3_dot(axis[k], outward), sign = (fabsf(out) > 0.1f ? out : axis[k][largest]) < 0.0f ? -1.0f : 1.0f;
        for (int r = 0; r < 3; ++r) {
            axis[k][r] *= sign;
        }
    }
    vec3_add_scaled(direction, 1.0f, axis[0], direction);
    vec3_add_scaled(direction, 0.35f, axis[1], direction);
    vec3_add_scaled(direction, 0.25f, axis[2], direction);
    view.camera = raycast_frame_points(shape, (size_t)vertices, direction, axis[1], 24.0f, (float)width / (float)height);
    return view;
}

void shape_view_include(struct shape_view *view, const float *shape, int vertices)
{
    const float margin = 1.04f, degree = 0.01745329f;
    const struct raycast_frame frame = raycast_camera_frame(&view->camera, (float)view->width / (float)view->height);
    float half = frame.half_height;
    for (int v = 0; v < vertices; ++v) {
        float d[3];
        vec3_sub(shape + 3 * v, view->camera.eye, d);
        const float depth = vec3_dot(d, frame.forward);
        if (depth > 0.0f) {
            const float x = fabsf(vec3_dot(d, frame.right)) / depth, y = fabsf(vec3_dot(d, frame.up)) / depth;
            half = fmaxf(half, margin * fmaxf(y, x * (float)view->height / (float)view->width));
        }
    }
    view->camera.field_of_view = 2.0f * atanf(half) / degree;
}

void colors_by_offset(const struct shape_mesh *from, const float *to, float full, float *colors)
{
    mesh_normals(from->positions, (size_t)from->vertex_count, from->triangles, (size_t)from->triangle_count, colors);
    for (int v = 0; v < from->vertex_count; ++v) {
        float d[3];
        vec3_sub(to + 3 * v, from->positions + 3 * v, d);
        const float along = vec3_dot(d, colors + 3 * v) / (full > 0.0f ? full : 1.0f);
        const struct color end = along > 0.0f ? color_rgb(0.80f, 0.20f, 0.12f) : color_rgb(0.15f, 0.35f, 0.80f);
        const struct color c = color_mix(color_rgb(0.85f, 0.84f, 0.82f), end, fminf(fabsf(along), 1.0f));
        colors[3 * v] = c.r;
        colors[3 * v + 1] = c.g;
        colors[3 * v + 2] = c.b;
    }
}

void colors_by_region(const uint32_t *regions, int vertices, float *colors)
{
    for (int v = 0; v < vertices; ++v) {
        const struct color c = regions[v] > 0 ? color_category((int)((regions[v] - 1) % 64)) : color_rgb(0.78f, 0.76f, 0.72f);
        colors[3 * v] = c.r;
        colors[3 * v + 1] = c.g;
        colors[3 * v + 2] = c.b;
    }
}

bool shape_picture(const struct shape_mesh *mesh, const float *shape, const float *colors, const float *originals,
                   const struct shape_view *view, struct image *picture)
{
    struct raycast_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.positions = shape;
    scene.vertex_count = (size_t)mesh->vertex_count;
    scene.indices = (const uint32_t *)(const void *)mesh->triangles;
    scene.triangle_count = (size_t)mesh->triangle_count;
    scene.vertex_colors = colors;
    scene.vertex_originals = originals;
    scene.base_color = color_rgb(0.78f, 0.76f, 0.72f);
    scene.background_top = scene.background_bottom = color_rgb(1.0f, 1.0f, 1.0f);
    scene.camera = view->camera;
    return raycast_render(&scene, view->width, view->height, picture);
}

bool pictures_write(struct image *pictures, const char *const *captions, int count, int columns, const char *path)
{
    errno = 0; /* not every failure below sets it */
    struct image strip = {0, 0, NULL};
    const bool good =
        image_strip(pictures, captions, count, columns, color_rgb(1.0f, 1.0f, 1.0f), &strip) && image_write_png(&strip, path);
    for (int i = 0; i < count; ++i) {
        image_free(&pictures[i]);
    }
    image_free(&strip);
    return good;
}
