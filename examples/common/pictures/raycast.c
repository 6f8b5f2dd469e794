#include "pictures/raycast.h"

#include "base/bvh.h"
#include "base/threads.h"
#include "base/vec3.h"
#include "pictures/raycast_rows.h"

#include <stdlib.h>
#include <string.h>

enum { OCCLUSION_DIRECTIONS = 64 };

/* Data that all pixels need, computed once. */
struct renderer {
    const struct raycast_scene *scene;
    struct bvh bvh;
    struct raycast_rows rows;
    struct raycast_frame frame;
    float *corners;   /* the triangles drawn: 9 floats each */
    float *normals;   /* smooth style: one a vertex */
    float *occlusion; /* arriving light, 0..1, by vertex (smooth style) or triangle; negative: not computed yet */
    float lo[3], hi[3];
    float originals_lo[3], originals_hi[3];
    float mean_edge;
    struct color base, top, bottom;
    bool smooth;
};

static struct color color_or(struct color given, float r, float g, float b)
{
    const bool unset = given.r == 0.0f && given.g == 0.0f && given.b == 0.0f;
    return unset ? color_rgb(r, g, b) : given;
}

static size_t corner_vertex(const struct raycast_scene *scene, size_t triangle, size_t corner)
{
    return scene->indices ? scene->indices[3 * triangle + corner] : 3 * triangle + corner;
}

static bool indices_valid(const struct raycast_scene *scene)
{
    for (size_t i = 0; i < 3 * scene->triangle_count; ++i) {
        if ((scene->indices ? (size_t)scene->indices[i] : i) >= scene->vertex_count) {
            return false;
        }
    }
    return true;
}

/* Copies the triangles, shrunk for the springl style, and computes their mean edge length. */
static void make_corners(struct renderer *r)
{
    const struct raycast_scene *scene = r->scene;
    const float shrink = scene->style == RAYCAST_SPRINGL ? fmaxf(0.0f, fminf(0.9f, scene->shrink)) : 0.0f;
    double edges = 0.0;
    size_t finite = 0;
    for (size_t t = 0; t < scene->triangle_count; ++t) {
        float *c = r->corners + 9 * t;
        for (size_t k = 0; k < 3; ++k) {
            memcpy(c + 3 * k, scene->positions + 3 * corner_vertex(scene, t, k), 3 * sizeof *c);
        }
        for (int i = 0; i < 3; ++i) {
            const float center = (c[i] + c[3 + i] + c[6 + i]) / 3.0f;
            for (int k = 0; k < 3; ++k) {
                c[3 * k + i] += shrink * (center - c[3 * k + i]);
            }
        }
        float e[3];
        vec3_sub(c + 3, c, e);
        const float length = vec3_length(e);
        if (isfinite(length)) {
            edges += (double)length;
            ++finite;
        }
    }
    r->mean_edge = finite ? (float)(edges / (double)finite) : 0.0f;
}

static void make_normals(struct renderer *r)
{
    const struct raycast_scene *scene = r->scene;
    if (scene->normals) {
        memcpy(r->normals, scene->normals, 3 * scene->vertex_count * sizeof *r->normals);
    } else {
        memset(r->normals, 0, 3 * scene->vertex_count * sizeof *r->normals);
        for (size_t t = 0; t < scene->triangle_count; ++t) {
            float normal[3];
            const float area = vec3_triangle_normal(r->corners + 9 * t, normal);
            for (size_t k = 0; k < 3 && isfinite(area); ++k) {
                float *n = r->normals + 3 * corner_vertex(scene, t, k);
                vec3_add_scaled(n, area, normal, n);
            }
        }
    }
    for (size_t v = 0; v < scene->vertex_count; ++v) {
        vec3_normalize(r->normals + 3 * v);
    }
}

/* Returns the share of the sky visible from a point, by fixed cosine-weighted directions: neighboring points differ smoothly,
 * and there is no noise. */
static float sky_share(const struct renderer *r, const float point[3], const float normal[3], float max_distance)
{
    float origin[3], open = 0.0f, sum = 0.0f;
    vec3_add_scaled(point, 0.4f * r->mean_edge, normal, origin);
    for (int i = 0; i < OCCLUSION_DIRECTIONS; ++i) {
        const float z = 1.0f - (2.0f * (float)i + 1.0f) / OCCLUSION_DIRECTIONS, turn = 2.3999632f * (float)i;
        const float ring = sqrtf(1.0f - z * z);
        const float d[3] = {ring * cosf(turn), ring * sinf(turn), z};
        const float cosine = vec3_dot(d, normal);
        if (cosine > 0.05f) {
            sum += cosine;
            if (!bvh_any_hit(&r->bvh, origin, d, 0.0f, max_distance)) {
                open += cosine;
            }
        }
    }
    return sum > 0.0f ? open / sum : 1.0f;
}

/* Computes the occlusion of a vertex (smooth style) or a triangle. */
static float occlusion(const struct renderer *r, size_t i)
{
    const float size[3] = {r->hi[0] - r->lo[0], r->hi[1] - r->lo[1], r->hi[2] - r->lo[2]};
    const float max_distance = 0.35f * vec3_length(size), *c = r->corners + 9 * i;
    if (r->smooth) {
        return sky_share(r, r->scene->positions + 3 * i, r->normals + 3 * i, max_distance);
    }
    float normal[3], center[3];
    vec3_triangle_normal(c, normal);
    for (int k = 0; k < 3; ++k) {
        center[k] = (c[k] + c[3 + k] + c[6 + k]) / 3.0f;
    }
    return sky_share(r, center, normal, max_distance);
}

/* Returns the occlusion of a vertex or triangle, computed when a ray first meets it: most of a scene is not visible. Threads that
 * meet it at once compute the same number. */
static float occlusion_at(const struct renderer *r, size_t i)
{
    float light;
    __atomic_load(r->occlusion + i, &light, __ATOMIC_RELAXED);
    if (light < 0.0f) {
        light = occlusion(r, i);
        __atomic_store(r->occlusion + i, &light, __ATOMIC_RELAXED);
    }
    return light;
}

static struct color surface_color(const struct renderer *r, size_t triangle, const float w[3])
{
    const struct raycast_scene *scene = r->scene;
    const float *per_vertex = scene->vertex_originals ? scene->vertex_originals : scene->vertex_colors;
    const float *per_triangle = scene->triangle_originals ? scene->triangle_originals : scene->triangle_colors;
    const bool originals = scene->vertex_originals || scene->triangle_originals;
    float value[3] = {0.0f, 0.0f, 0.0f};
    if (scene->triangle_originals || (!scene->vertex_originals && !scene->vertex_colors && per_triangle)) {
        memcpy(value, per_triangle + 3 * triangle, sizeof value);
    } else if (per_vertex) {
        for (size_t k = 0; k < 3; ++k) {
            vec3_add_scaled(value, w[k], per_vertex + 3 * corner_vertex(scene, triangle, k), value);
        }
    } else {
        return r->base;
    }
    if (!originals) {
        return color_rgb(value[0], value[1], value[2]);
    }
    return scene->color_at ? scene->color_at(scene->color_user, value)
                           : raycast_correspondence_color(value, r->originals_lo, r->originals_hi);
}

/* Returns the distance in the triangle's plane from the hit to the nearest side, and the radius of the inscribed circle. */
static float side_distance(const float *c, const float w[3], float *inner_radius)
{
    float normal[3], best = INFINITY, around = 0.0f;
    const float area = vec3_triangle_normal(c, normal);
    for (int k = 0; k < 3; ++k) {
        float e[3];
        vec3_sub(c + 3 * ((k + 1) % 3), c + 3 * ((k + 2) % 3), e);
        const float length = vec3_length(e);
        around += length;
        best = fminf(best, w[k] * 2.0f * area / fmaxf(length, 1e-30f));
    }
    *inner_radius = 2.0f * area / fmaxf(around, 1e-30f);
    return best;
}

/* Returns the color that a ray brings. width_at_one: of a pixel at distance 1; height_share: of the picture, above the ray. */
static struct color sample(const struct renderer *r, const struct raycast_ray *ray, float width_at_one, float height_share)
{
    const struct bvh_hit hit = ray->hit;
    const float *direction = ray->direction;
    const struct raycast_scene *scene = r->scene;
    if (!isfinite(hit.t)) {
        const struct color back = color_mix(r->top, r->bottom, height_share);
        return color_rgb(back.r * back.r, back.g * back.g, back.b * back.b);
    }
    const size_t t = hit.triangle;
    const float w[3] = {1.0f - hit.u - hit.v, hit.u, hit.v};
    float normal[3] = {0.0f, 0.0f, 0.0f}, face[3], sky = 1.0f;
    struct color color = surface_color(r, t, w);
    vec3_triangle_normal(r->corners + 9 * t, face);
    if (r->smooth) {
        for (size_t k = 0; k < 3; ++k) {
            vec3_add_scaled(normal, w[k], r->normals + 3 * corner_vertex(scene, t, k), normal);
        }
        vec3_normalize(normal);
    } else {
        memcpy(normal, face, sizeof normal);
    }
    if (r->occlusion) {
        sky = r->smooth ? 0.0f : occlusion_at(r, t);
        for (size_t k = 0; r->smooth && k < 3; ++k) {
            sky += w[k] * occlusion_at(r, corner_vertex(scene, t, k));
        }
    }
    if (vec3_dot(face, direction) > 0.0f) { /* the back side, of an open surface or through a hole: tinted to be noticed */
        for (int i = 0; i < 3; ++i) {
            normal[i] = -normal[i];
        }
        color = color_mix(color, color_rgb(0.45f, 0.35f, 0.40f), 0.5f);
        sky = 0.5f;
    }
    if (scene->style == RAYCAST_SPRINGL && (scene->edged == 0 || t < scene->edged)) {
        const float pixel =
            width_at_one * (r->frame.perspective ? hit.t * vec3_dot(direction, r->frame.forward) : 1.0f);
        const float width = scene->edge_width > 0.0f ? scene->edge_width : 1.2f;
        float
            inner; /* small triangles get thin, pale edges instead of turning black */
        const float edge = side_distance(r->corners + 9 * t, w, &inner) / fmaxf(pixel, 1e-30f);
        const float room = fminf(1.0f, 0.4f * inner / fmaxf(width * pixel, 1e-30f));
        const float dark = fmaxf(0.0f, fminf(1.0f, 0.5f * width * room + 0.5f - edge));
        color =
            color_mix(color, color_rgb(0.12f * color.r, 0.12f * color.g, 0.14f * color.b), 0.8f * dark * sqrtf(room));
    }
    return raycast_shade(&r->frame, color, normal, direction, sky);
}

/* Renders some rows of pixels. Returns false if memory is short. */
static bool render_band(const struct renderer *r, struct image *image, int band)
{
    const int n = r->rows.samples;
    const size_t line = (size_t)(image->width * n);
    const float width_at_one = 2.0f * r->frame.half_height / (float)image->height, scale = 1.0f / (float)(n * n);
    struct raycast_ray *rays = malloc((size_t)(RAYCAST_BAND * n) * line * sizeof *rays);
    if (!rays) {
        return false;
    }
    raycast_band_trace(&r->rows, band, rays);
    for (int row = 0; row < RAYCAST_BAND && band * RAYCAST_BAND + row < image->height; ++row) {
        const int y = band * RAYCAST_BAND + row;
        for (int x = 0; x < image->width; ++x) {
            struct color sum = {0.0f, 0.0f, 0.0f};
            for (int k = 0; k < n * n; ++k) {
                const struct raycast_ray *ray = rays + (size_t)(row * n + k / n) * line + (size_t)(x * n + k % n);
                const float share = raycast_sample(y * n + k / n, n) / (float)image->height;
                const struct color c = sample(r, ray, width_at_one, share);
                sum = color_rgb(sum.r + c.r, sum.g + c.g, sum.b + c.b);
            }
            image_blend(image, x, y, color_rgb(sqrtf(sum.r * scale), sqrtf(sum.g * scale), sqrtf(sum.b * scale)), 1.0f);
        }
    }
    free(rays);
    return true;
}

/* Draws dots with a dark rim. A dot is hidden as a whole, by one ray to its point, whose last fraction of an edge is ignored,
 * because particles lie on their own triangle. */
static void draw_dots(const struct renderer *r, struct image *image, const float *points, size_t count, float radius,
                      struct color color)
{
    for (size_t i = 0; i < count; ++i) {
        float d[3], origin[3], direction[3];
        vec3_sub(points + 3 * i, r->scene->camera.eye, d);
        const float depth = vec3_dot(d, r->frame.forward), scale = r->frame.perspective ? depth : 1.0f;
        if (!(depth > 0.0f)) {
            continue;
        }
        const float x = vec3_dot(d, r->frame.right) / (scale * r->frame.half_width);
        const float y = vec3_dot(d, r->frame.up) / (scale * r->frame.half_height);
        if (!(fabsf(x) < 1.1f && fabsf(y) < 1.1f)) {
            continue;
        }
        raycast_camera_ray(&r->scene->camera, &r->frame, x, y, origin, direction);
        vec3_sub(points + 3 * i, origin, d);
        if (!bvh_any_hit(&r->bvh, origin, direction, 0.0f, vec3_length(d) - 0.3f * r->mean_edge)) {
            const float px = 0.5f * (x + 1.0f) * (float)image->width, py = 0.5f * (1.0f - y) * (float)image->height;
            image_disc(image, px, py, radius + 0.5f, color_mix(color, color_rgb(0.0f, 0.0f, 0.0f), 0.65f));
            image_disc(image, px, py, radius - 0.3f, color);
        }
    }
}

/* Allocates the triangles, normals and occlusion. */
static bool allocate(struct renderer *r)
{
    const struct raycast_scene *scene = r->scene;
    const size_t shaded = r->smooth ? scene->vertex_count : scene->triangle_count;
    r->corners = malloc(9 * scene->triangle_count * sizeof *r->corners);
    r->normals = r->smooth ? malloc(3 * scene->vertex_count * sizeof *r->normals) : NULL;
    r->occlusion = scene->plain ? NULL : malloc(shaded * sizeof *r->occlusion);
    return r->corners && (r->normals || !r->smooth) && (r->occlusion || scene->plain);
}

/* Computes the boxes of the drawn triangles and of the original surface. */
static void make_boxes(struct renderer *r)
{
    const struct raycast_scene *scene = r->scene;
    for (int i = 0; i < 3; ++i) {
        r->lo[i] = r->bvh.nodes[0].lo[i];
        r->hi[i] = r->bvh.nodes[0].hi[i];
        r->originals_lo[i] = INFINITY;
        r->originals_hi[i] = -INFINITY;
    }
    if (scene->triangle_originals) {
        raycast_grow_box(scene->triangle_originals, scene->triangle_count, r->originals_lo, r->originals_hi);
    } else if (scene->vertex_originals) {
        raycast_grow_box(scene->vertex_originals, scene->vertex_count, r->originals_lo, r->originals_hi);
    }
}

/* Computes all that the pixels of a picture need. Returns false if an index is wrong or memory is short. */
static bool prepare(struct renderer *r)
{
    if (r->scene->triangle_count == 0) {
        return true; /* only the background */
    }
    if (!indices_valid(r->scene) || !allocate(r)) {
        return false;
    }
    make_corners(r);
    if (!bvh_build(&r->bvh, r->corners, NULL, r->scene->triangle_count)) {
        return false;
    }
    make_boxes(r);
    if (r->smooth) {
        make_normals(r);
    }
    for (size_t i = 0; r->occlusion && i < (r->smooth ? r->scene->vertex_count : r->scene->triangle_count); ++i) {
        r->occlusion[i] = -1.0f;
    }
    return true;
}

static void draw_marks(const struct renderer *r, struct image *image)
{
    const struct raycast_scene *scene = r->scene;
    draw_dots(r, image, scene->marks, scene->mark_count, scene->mark_radius > 0.0f ? scene->mark_radius : 2.0f,
              color_or(scene->mark_color, 0.98f, 0.85f, 0.15f));
    draw_dots(r, image, scene->particles, scene->particle_count, scene->particle_radius > 0.0f ? scene->particle_radius : 2.0f,
              color_or(scene->particle_color, 0.88f, 0.12f, 0.10f));
}

struct band_loop {
    const struct renderer *r;
    struct image *result;
    int *failed;
};

static void run_band_loop(void *arg, int begin, int end)
{
    const struct band_loop *loop = arg;
    const struct renderer *r = loop->r;
    struct image *result = loop->result;
    int failed = 0;
    for (int band = begin; band < end; ++band) {
        failed += !render_band(r, result, band);
    }
    threads_lock();
    *loop->failed += failed;
    threads_unlock();
}

bool raycast_render(const struct raycast_scene *scene, int width, int height, struct image *result)
{
    struct renderer r;
    memset(&r, 0, sizeof r);
    r.scene = scene;
    r.base = color_or(scene->base_color, 0.80f, 0.80f, 0.82f);
    r.top = color_or(scene->background_top, 0.97f, 0.98f, 0.99f);
    r.bottom = color_or(scene->background_bottom, 0.84f, 0.87f, 0.91f);
    r.smooth = scene->style == RAYCAST_SMOOTH;
    if (!image_create(result, width, height, r.bottom)) {
        return false;
    }
    r.frame = raycast_camera_frame(&scene->camera, (float)width / (float)height);
    const int samples = scene->supersampling > 0 ? (scene->supersampling < 8 ? scene->supersampling : 8) : 2;
    r.rows = (struct raycast_rows){.camera = &scene->camera, .frame = r.frame, .width = width, .height = height, .samples = samples};
    const bool prepared = prepare(&r);
    r.rows.corners = r.corners;
    const bool sorted = raycast_rows_create(&r.rows, prepared ? scene->triangle_count : 0); /* none: only the background */
    int bands = r.rows.items ? raycast_band_count(&r.rows) : 0, failed = 0;
    struct band_loop loop = {&r, result, &failed};
    threads_for(bands, 1, run_band_loop, &loop);
    const bool good = prepared && sorted && failed == 0;
    if (good) {
        draw_marks(&r, result);
    }
    bvh_free(&r.bvh);
    raycast_rows_free(&r.rows);
    free(r.corners);
    free(r.normals);
    free(r.occlusion);
    return good;
}
