#include "springls/model_pictures.h"

#include "base/vec3.h"
#include "springls/indices.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct pattern {
    float lo[3], hi[3];
};

static struct color pattern_color(void *user, const float original[3])
{
    const struct pattern *pattern = user;
    return raycast_correspondence_color(original, pattern->lo, pattern->hi);
}

bool model_frame_take(springls_context *ctx, const char *caption, struct model_frame *frame)
{
    memset(frame, 0, sizeof *frame);
    snprintf(frame->caption, sizeof frame->caption, "%s", caption);
    return springls_extract_mesh(ctx, &frame->surface) == SPRINGLS_OK
           && springls_extract_soup(ctx, &frame->soup) == SPRINGLS_OK;
}

/* Returns true if the map from voxels to the world turns a triangle's sides around. */
static bool mirrors(const springls_context *ctx)
{
    const float voxels[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    float world[12], x[3], y[3], z[3], across[3];
    springls_to_world(ctx, voxels, 4, world);
    vec3_sub(world + 3, world, x);
    vec3_sub(world + 6, world, y);
    vec3_sub(world + 9, world, z);
    vec3_cross(x, y, across);
    return vec3_dot(across, z) < 0.0f;
}

bool model_frame_take_plain(springls_context *ctx, const char *caption, struct model_frame *frame)
{
    const springls_view view = springls_view_vertices(ctx);
    const int second = mirrors(ctx) ? 6 : 3; /* where the second corner goes */
    memset(frame, 0, sizeof *frame);
    snprintf(frame->caption, sizeof frame->caption, "%s", caption);
    frame->corners = malloc(((size_t)view.count * 9 + 1) * sizeof *frame->corners);
    for (int i = 0; frame->corners && i < view.count; ++i) {
        float corners[9], *to = frame->corners + 9 * (size_t)i;
        springls_to_world(ctx, (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride), 3, corners);
        memcpy(to, corners, 3 * sizeof *to);
        memcpy(to + second, corners + 3, 3 * sizeof *to);
        memcpy(to + 9 - second, corners + 6, 3 * sizeof *to);
    }
    frame->corner_count = view.count;
    return frame->corners && springls_extract_mesh(ctx, &frame->surface) == SPRINGLS_OK;
}

void model_frame_free(springls_context *ctx, struct model_frame *frame)
{
    free(frame->corners);
    frame->corners = NULL;
    springls_mesh_free(ctx, &frame->surface);
    springls_mesh_free(ctx, &frame->soup);
}

static const float *frame_corners(const struct model_frame *frame) { return frame->corners ? frame->corners : frame->soup.positions; }

static size_t frame_springls(const struct model_frame *frame)
{
    return (size_t)(frame->corners ? frame->corner_count : frame->soup.triangle_count);
}

static int view_width(const struct model_view *view) { return view->width > 0 ? view->width : 420; }
static int view_height(const struct model_view *view) { return view->height > 0 ? view->height : view_width(view); }

static struct raycast_scene make_scene(const struct raycast_camera *camera)
{
    struct raycast_scene scene;
    memset(&scene, 0, sizeof scene);
    scene.base_color = color_rgb(0.78f, 0.76f, 0.72f);
    scene.background_top = scene.background_bottom = color_rgb(1.0f, 1.0f, 1.0f);
    scene.camera = *camera;
    return scene;
}

static bool render_surface(const springls_mesh *mesh, const struct raycast_camera *camera, struct pattern *pattern,
                           const struct model_view *view, struct image *picture)
{
    struct raycast_scene scene = make_scene(camera);
    uint32_t *indices = unsigned_indices(mesh);
    scene.positions = mesh->positions;
    scene.vertex_count = (size_t)mesh->vertex_count;
    scene.triangle_count = (size_t)mesh->triangle_count;
    scene.indices = indices;
    scene.normals = mesh->normals;
    scene.style = RAYCAST_SMOOTH;
    if (pattern) {
        scene.vertex_originals = mesh->correspondences;
        scene.color_at = pattern_color;
        scene.color_user = pattern;
    }
    const bool rendered = indices && raycast_render(&scene, view_width(view), view_height(view), picture);
    free(indices);
    return rendered;
}

/* Triangles with colors for the springl style. */
struct patchwork {
    float *positions, *colors; /* 9 and 3 floats a triangle */
    size_t count, edged;
};

/* Adds springls whose outer side faces the eye: the inner sides of the far ones would clutter the gaps. */
static void add_springls(struct patchwork *work, const struct model_frame *frame, const float eye[3], struct pattern *pattern,
                         struct color plain)
{
    for (size_t t = 0; t < frame_springls(frame); ++t) {
        const float *corners = frame_corners(frame) + 9 * t;
        float to_eye[3], normal[3];
        vec3_triangle_normal(corners, normal);
        vec3_sub(eye, corners, to_eye);
        if (vec3_dot(to_eye, normal) > 0.0f) {
            const struct color c = pattern ? pattern_color(pattern, frame->soup.correspondences + 9 * t) : plain;
            const float rgb[3] = {c.r, c.g, c.b};
            memcpy(work->positions + 9 * work->count, corners, 9 * sizeof *corners);
            memcpy(work->colors + 3 * work->count++, rgb, sizeof rgb);
        }
    }
    work->edged = work->count;
}

/* Adds the zero level, moved inward by `depth` below the springls. */
static void add_surface(struct patchwork *work, const springls_mesh *surface, float depth, struct color color)
{
    const float rgb[3] = {color.r, color.g, color.b};
    for (size_t t = 0; t < (size_t)surface->triangle_count; ++t) {
        for (int k = 0; k < 3; ++k) {
            const int v = 3 * surface->triangles[3 * t + (size_t)k];
            vec3_add_scaled(surface->positions + v, -depth, surface->normals + v, work->positions + 9 * work->count + 3 * k);
        }
        memcpy(work->colors + 3 * work->count++, rgb, sizeof rgb);
    }
}

static float mean_edge(const springls_mesh *mesh)
{
    double sum = 0.0;
    for (size_t t = 0; t < (size_t)mesh->triangle_count; ++t) {
        float edge[3];
        vec3_sub(mesh->positions + 3 * mesh->triangles[3 * t + 1], mesh->positions + 3 * mesh->triangles[3 * t], edge);
        sum += (double)vec3_length(edge) / (double)mesh->triangle_count;
    }
    return (float)sum;
}

static bool render_springls(const struct model_frame *frame, const struct raycast_camera *camera, struct pattern *pattern,
                            const struct model_view *view, struct image *picture)
{
    const size_t capacity = frame_springls(frame) + (size_t)frame->surface.triangle_count;
    struct raycast_scene scene = make_scene(camera);
    struct patchwork work = {malloc((capacity + 1) * 12 * sizeof *work.positions), NULL, 0, 0};
    if (!work.positions) {
        return false;
    }
    work.colors = work.positions + 9 * capacity;
    add_springls(&work, frame, camera->eye, pattern, scene.base_color);
    if (view->over_surface) {
        add_surface(&work, &frame->surface, 0.3f * mean_edge(&frame->surface), color_rgb(0.52f, 0.60f, 0.74f));
    }
    scene.positions = work.positions;
    scene.vertex_count = 3 * work.count;
    scene.triangle_count = work.count;
    scene.triangle_colors = work.colors;
    scene.edged = work.edged;
    scene.style = RAYCAST_SPRINGL;
    scene.edge_width = 0.9f;
    const bool rendered = raycast_render(&scene, view_width(view), view_height(view), picture);
    free(work.positions);
    return rendered;
}

static void frame_center(const struct model_frame *frame, float center[3])
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    raycast_grow_box(frame->surface.positions, (size_t)frame->surface.vertex_count, lo, hi);
    for (int c = 0; c < 3; ++c) {
        center[c] = lo[c] <= hi[c] ? 0.5f * (lo[c] + hi[c]) : 0.0f;
    }
}

/* Collects the vertices of all frames, relative to their own center when the camera follows. */
static float *film_points(const struct model_frame *frames, int count, bool follow, size_t *points)
{
    size_t vertices = 0;
    for (int f = 0; f < count; ++f) {
        vertices += (size_t)frames[f].surface.vertex_count;
    }
    float *all = malloc((vertices + 1) * 3 * sizeof *all);
    *points = 0;
    for (int f = 0; all && f < count; ++f) {
        float center[3] = {0.0f, 0.0f, 0.0f};
        if (follow) {
            frame_center(&frames[f], center);
        }
        for (size_t v = 0; v < (size_t)frames[f].surface.vertex_count; ++v) {
            vec3_sub(frames[f].surface.positions + 3 * v, center, all + 3 * (*points)++);
        }
    }
    return all;
}

/* Computes one camera for all frames; returns false when there is nothing to draw. */
static bool film_camera(const struct model_frame *frames, int count, const struct model_view *view,
                        struct raycast_camera *camera)
{
    size_t points = 0;
    float *all = film_points(frames, count, view->follow, &points);
    if (all && points > 0) {
        *camera = raycast_frame_points(all, points, view->direction, view->up, 24.0f,
                                       (float)view_width(view) / (float)view_height(view));
    }
    free(all);
    return all && points > 0;
}

static struct raycast_camera frame_camera(const struct raycast_camera *film, const struct model_frame *frame, bool follow)
{
    struct raycast_camera camera = *film;
    float center[3] = {0.0f, 0.0f, 0.0f};
    if (follow) {
        frame_center(frame, center);
    }
    vec3_add_scaled(film->eye, 1.0f, center, camera.eye);
    vec3_add_scaled(film->target, 1.0f, center, camera.target);
    return camera;
}

static struct pattern film_pattern(const struct model_frame *first)
{
    struct pattern pattern = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    raycast_grow_box(first->surface.correspondences, (size_t)first->surface.vertex_count, pattern.lo, pattern.hi);
    return pattern;
}

bool model_film_write(const struct model_frame *frames, int count, const struct model_view *view, const char *path)
{
    errno = 0; /* not every failure below sets it */
    struct raycast_camera camera;
    struct image *pictures = calloc((size_t)count * 2 + 1, sizeof *pictures);
    const char **captions = calloc((size_t)count * 2 + 1, sizeof *captions);
    struct image strip = {0, 0, NULL};
    bool good = pictures && captions && count > 0 && film_camera(frames, count, view, &camera);
    struct pattern pattern = {{0.0f, 0.0f, 0.0f}, {1.0f, 1.0f, 1.0f}};
    if (good) {
        pattern = film_pattern(&frames[0]);
    }
    struct pattern *colors = view->by_correspondence ? &pattern : NULL;
    for (int f = 0; f < count && good; ++f) {
        const struct raycast_camera here = frame_camera(&camera, &frames[f], view->follow);
        good = render_surface(&frames[f].surface, &here, colors, view, &pictures[f])
               && render_springls(&frames[f], &here, colors, view, &pictures[count + f]);
        captions[count + f] = frames[f].caption;
    }
    good = good && image_strip(pictures, captions, count * 2, count, color_rgb(1.0f, 1.0f, 1.0f), &strip)
           && image_write_png(&strip, path);
    for (int i = 0; pictures && i < count * 2; ++i) {
        image_free(&pictures[i]);
    }
    image_free(&strip);
    free(pictures);
    free(captions);
    return good;
}

/* Finds the point nearest to the eye where the surface faces it. */
static const float *foremost(const springls_mesh *surface, const float eye[3])
{
    const float *best = surface->positions;
    float minimum = INFINITY;
    for (size_t v = 0; v < (size_t)surface->vertex_count; ++v) {
        float to_eye[3];
        vec3_sub(eye, surface->positions + 3 * v, to_eye);
        const float distance = vec3_normalize(to_eye);
        if (distance < minimum && vec3_dot(to_eye, surface->normals + 3 * v) > 0.95f) {
            best = surface->positions + 3 * v;
            minimum = distance;
        }
    }
    return best;
}

/* Draws a square around a point, as large as the view of a camera with `zoom`. */
static void mark_square(const struct raycast_camera *camera, const float point[3], float zoom, struct image *picture)
{
    const float width = (float)picture->width, height = (float)picture->height;
    const struct raycast_frame frame = raycast_camera_frame(camera, width / height);
    float d[3];
    vec3_sub(point, camera->eye, d);
    const float depth = vec3_dot(d, frame.forward);
    const float x = 0.5f * width * (1.0f + vec3_dot(d, frame.right) / (depth * frame.half_width));
    const float y = 0.5f * height * (1.0f - vec3_dot(d, frame.up) / (depth * frame.half_height));
    const float dx = 0.5f * width / zoom, dy = 0.5f * height / zoom;
    image_frame(picture, x - dx, y - dy, x + dx, y + dy, 1.5f, color_rgb(0.8f, 0.2f, 0.1f));
}

bool model_portrait_write(const struct model_frame *frame, const struct model_view *view, float zoom, const char *path)
{
    errno = 0; /* not every failure below sets it */
    struct raycast_camera camera, close;
    struct image pictures[2] = {{0, 0, NULL}, {0, 0, NULL}}, strip = {0, 0, NULL};
    struct pattern pattern = film_pattern(frame), *colors = view->by_correspondence ? &pattern : NULL;
    bool good = film_camera(frame, 1, view, &camera) && render_surface(&frame->surface, &camera, colors, view, &pictures[0]);
    if (good) {
        const float *point = foremost(&frame->surface, camera.eye);
        char captions[2][48];
        const char *const list[2] = {captions[0], captions[1]};
        close = camera;
        memcpy(close.target, point, sizeof close.target);
        close.field_of_view /= zoom;
        mark_square(&camera, point, zoom, &pictures[0]);
        snprintf(captions[0], sizeof captions[0], "zero level, %d triangles", frame->surface.triangle_count);
        snprintf(captions[1], sizeof captions[1], "springls, %zu in all", frame_springls(frame));
        good = render_springls(frame, &close, colors, view, &pictures[1])
               && image_strip(pictures, list, 2, 2, color_rgb(1.0f, 1.0f, 1.0f), &strip) && image_write_png(&strip, path);
    }
    image_free(&pictures[0]);
    image_free(&pictures[1]);
    image_free(&strip);
    return good;
}
