/* volume_picture.c - pictures by the rays of volume_raycast.h. */
#include "springls/volume_raycast.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The samples of a row of pixels: rays and what they meet. */
struct samples {
    int count;
    float *directions, *origins, *points, *normals, *places; /* 3 floats a sample */
    float *shares, *phi;                                     /* one a sample */
    struct color *colors;
    bool *met;
    springls_hit *hits;
};

enum { SAMPLES = 3, PER_PIXEL = SAMPLES * SAMPLES }; /* of a pixel: along each axis, and in all */
enum { OUTWARD = 3 };                                 /* places along the normal at which phi is read */

static bool make_samples(int width, struct samples *samples)
{
    const size_t n = (size_t)width * PER_PIXEL;
    *samples = (struct samples){.count = (int)n};
    samples->directions = malloc(17 * n * sizeof(float));
    samples->colors = malloc(n * sizeof *samples->colors);
    samples->met = malloc(n * sizeof *samples->met);
    samples->hits = malloc(n * sizeof *samples->hits);
    if (!samples->directions || !samples->colors || !samples->met || !samples->hits) {
        return false;
    }
    samples->origins = samples->directions + 3 * n;
    samples->points = samples->origins + 3 * n;
    samples->normals = samples->points + 3 * n;
    samples->places = samples->normals + 3 * n;
    samples->shares = samples->places + 3 * n;
    samples->phi = samples->shares + n;
    return true;
}

static void free_samples(struct samples *samples)
{
    free(samples->directions);
    free(samples->colors);
    free(samples->met);
    free(samples->hits);
}

static const struct color plain = {0.80f, 0.79f, 0.76f};

/* Meets the zero level, all rays of a row at once. */
static bool meet_level(springls_context *ctx, struct samples *samples)
{
    if (springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, samples->origins, samples->directions, samples->count, 0.0f,
                         samples->hits) != SPRINGLS_OK) {
        return false;
    }
    for (int i = 0; i < samples->count; ++i) {
        samples->met[i] = samples->hits[i].springl >= 0;
        memcpy(samples->points + 3 * i, samples->hits[i].point, 3 * sizeof(float));
        memcpy(samples->normals + 3 * i, samples->hits[i].normal, 3 * sizeof(float));
        samples->colors[i] = plain;
    }
    return true;
}

/* Returns a gray of an element's own, so that neighbours can be told apart. */
static struct color element_color(int element)
{
    const uint32_t h = ((uint32_t)element * 2654435761u) >> 24;
    const float light = 0.80f + 0.25f * ((float)h / 255.0f);
    return color_rgb(plain.r * light, plain.g * light, plain.b * light);
}

struct meet_loop {
    const struct volume_scene *scene;
    struct samples *samples;
};

static void run_meet_loop(void *arg, int begin, int end)
{
    const struct meet_loop *loop = arg;
    const struct volume_scene *scene = loop->scene;
    struct samples *samples = loop->samples;
    for (int i = begin; i < end; ++i) {
        struct volume_hit hit;
        samples->met[i] = volume_raycast(scene, samples->origins + 3 * i, samples->directions + 3 * i, &hit);
        if (samples->met[i]) {
            vec3_add_scaled(samples->origins + 3 * i, hit.distance, samples->directions + 3 * i, samples->points + 3 * i);
            memcpy(samples->normals + 3 * i, hit.normal, 3 * sizeof(float));
            samples->colors[i] = element_color(hit.element);
        }
    }
}

static void meet_scene(const struct volume_scene *scene, struct samples *samples)
{
    struct meet_loop loop = {scene, samples};
    threads_for(samples->count, 64, run_meet_loop, &loop);
}

/* Computes the share of the sky at each sample from phi 1, 2 and 3 voxels further out: less where the surface is hollow. */
static bool share_sky(springls_context *ctx, float voxel, struct samples *samples)
{
    for (int i = 0; i < samples->count; ++i) {
        samples->shares[i] = 1.0f;
    }
    for (int k = 1; k <= OUTWARD; ++k) {
        const float out = (float)k * voxel;
        for (int i = 0; i < samples->count; ++i) {
            for (int c = 0; c < 3; ++c) {
                const int n = 3 * i + c;
                samples->places[n] = samples->met[i] ? samples->points[n] + out * samples->normals[n] : 0.0f;
            }
        }
        if (springls_sample_distance(ctx, samples->places, samples->count, samples->phi) != SPRINGLS_OK) {
            return false;
        }
        for (int i = 0; i < samples->count; ++i) {
            samples->shares[i] -= 0.3f * fminf(1.0f, fmaxf(0.0f, (out - samples->phi[i]) / out));
        }
    }
    return true;
}

/* Aims the rays of a row of pixels. */
static void aim(const struct raycast_camera *camera, const struct raycast_frame *frame, const struct image *picture, int y,
                struct samples *samples)
{
    const float width = (float)picture->width, height = (float)picture->height;
    for (int i = 0; i < samples->count; ++i) {
        const int k = i % PER_PIXEL;
        const float px = (float)(i / PER_PIXEL) + ((float)(k % SAMPLES) + 0.5f) / SAMPLES,
                    py = (float)y + ((float)(k / SAMPLES) + 0.5f) / SAMPLES;
        raycast_camera_ray(camera, frame, 2.0f * px / width - 1.0f, 1.0f - 2.0f * py / height, samples->origins + 3 * i,
                           samples->directions + 3 * i);
    }
}

/* Shades a sample; white where the ray meets nothing. */
static struct color shade(const struct raycast_frame *frame, const struct samples *samples, int i)
{
    const float *normal = samples->normals + 3 * i, *view = samples->directions + 3 * i;
    const float side = vec3_dot(normal, view) > 0.0f ? -1.0f : 1.0f;
    const float to_eye[3] = {side * normal[0], side * normal[1], side * normal[2]};
    const struct color white = {1.0f, 1.0f, 1.0f};
    return samples->met[i] ? raycast_shade(frame, samples->colors[i], to_eye, view, samples->shares[i]) : white;
}

/* Means the samples of each pixel of a row. */
static void blend_row(const struct raycast_frame *frame, const struct samples *samples, int y, struct image *picture)
{
    for (int x = 0; x < picture->width; ++x) {
        struct color sum = {0.0f, 0.0f, 0.0f};
        for (int i = x * PER_PIXEL; i < (x + 1) * PER_PIXEL; ++i) {
            const struct color c = shade(frame, samples, i);
            sum = color_rgb(sum.r + c.r, sum.g + c.g, sum.b + c.b);
        }
        const float share = 1.0f / PER_PIXEL;
        image_blend(picture, x, y, color_rgb(sqrtf(sum.r * share), sqrtf(sum.g * share), sqrtf(sum.b * share)), 1.0f);
    }
}

bool volume_picture(springls_context *ctx, const struct volume_scene *scene, float voxel, const struct raycast_camera *camera,
                    int width, int height, struct image *picture)
{
    struct samples samples;
    bool good = make_samples(width, &samples) && image_create(picture, width, height, color_rgb(1.0f, 1.0f, 1.0f));
    const struct raycast_frame frame = raycast_camera_frame(camera, (float)width / (float)height);
    for (int y = 0; y < height && good; ++y) {
        aim(camera, &frame, picture, y, &samples);
        if (scene) {
            meet_scene(scene, &samples);
        } else {
            good = meet_level(ctx, &samples);
        }
        good = good && share_sky(ctx, voxel, &samples);
        blend_row(&frame, &samples, y, picture);
    }
    free_samples(&samples);
    return good;
}
