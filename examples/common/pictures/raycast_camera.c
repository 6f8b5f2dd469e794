/* raycast_camera.c - cameras and their rays, light, boxes and the correspondence pattern of raycast.h. */
#include "pictures/raycast.h"

#include "base/vec3.h"

#include <string.h>

void raycast_grow_box(const float *points, size_t count, float lo[3], float hi[3])
{
    for (size_t i = 0; i < count; ++i) {
        const float *p = points + 3 * i;
        if (isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2])) {
            for (int k = 0; k < 3; ++k) {
                lo[k] = fminf(lo[k], p[k]);
                hi[k] = fmaxf(hi[k], p[k]);
            }
        }
    }
}

struct raycast_frame raycast_camera_frame(const struct raycast_camera *camera, float aspect)
{
    struct raycast_frame frame;
    vec3_sub(camera->target, camera->eye, frame.forward);
    frame.distance = vec3_normalize(frame.forward);
    vec3_cross(frame.forward, camera->up, frame.right);
    if (!(vec3_length(frame.right) > 1e-6f * vec3_length(camera->up))) { /* looking along `up`: choose any other up direction */
        const float other[3] = {fabsf(frame.forward[0]) < 0.5f ? 1.0f : 0.0f,
                                fabsf(frame.forward[0]) < 0.5f ? 0.0f : 1.0f, 0.0f};
        vec3_cross(frame.forward, other, frame.right);
    }
    vec3_normalize(frame.right);
    vec3_cross(frame.right, frame.forward, frame.up);
    frame.perspective = camera->field_of_view > 0.0f;
    frame.half_height =
        frame.perspective ? tanf(0.5f * camera->field_of_view * 0.01745329f) : 0.5f * camera->ortho_height;
    frame.half_width = frame.half_height * aspect;
    return frame;
}

struct raycast_camera raycast_frame_points(const float *points, size_t count, const float direction[3],
                                           const float up[3], float field_of_view, float aspect)
{
    struct raycast_camera camera;
    float towards[3] = {direction[0], direction[1], direction[2]};
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    const float margin = 1.08f;
    float distance = 0.0f, height = 0.0f;
    vec3_normalize(towards);
    memset(&camera, 0, sizeof camera);
    raycast_grow_box(points, count, lo, hi);
    for (int i = 0; i < 3; ++i) {
        camera.target[i] = lo[i] <= hi[i] ? 0.5f * (lo[i] + hi[i]) : 0.0f;
        camera.eye[i] = camera.target[i] + towards[i];
        camera.up[i] = up[i];
    }
    camera.field_of_view = field_of_view;
    camera.ortho_height = 2.0f;
    const struct raycast_frame frame = raycast_camera_frame(&camera, aspect);
    for (size_t v = 0; v < count; ++v) { /* every point must project into the picture */
        float d[3];
        vec3_sub(points + 3 * v, camera.target, d);
        const float x = fabsf(vec3_dot(d, frame.right)) * margin, y = fabsf(vec3_dot(d, frame.up)) * margin;
        const float depth = vec3_dot(d, towards);
        height = fmaxf(height, fmaxf(2.0f * y, 2.0f * x / aspect)); /* fmaxf passes over NaN */
        if (frame.perspective) {
            distance = fmaxf(distance, depth + fmaxf(y / frame.half_height, x / frame.half_width));
        } else {
            distance = fmaxf(distance, depth + vec3_length(d));
        }
    }
    camera.ortho_height = height > 0.0f ? height : 1.0f;
    distance = distance > 0.0f ? distance : 1.0f;
    for (int i = 0; i < 3; ++i) {
        camera.eye[i] = camera.target[i] + distance * towards[i];
    }
    return camera;
}

void raycast_camera_ray(const struct raycast_camera *camera, const struct raycast_frame *frame, float x, float y, float origin[3],
                        float direction[3])
{
    const float sx = x * frame->half_width, sy = y * frame->half_height;
    for (int i = 0; i < 3; ++i) {
        const float offset = sx * frame->right[i] + sy * frame->up[i];
        origin[i] = frame->perspective ? camera->eye[i] : camera->eye[i] + offset;
        direction[i] = frame->perspective ? frame->forward[i] + offset : frame->forward[i];
    }
    vec3_normalize(direction);
}

struct color raycast_shade(const struct raycast_frame *frame, struct color color, const float normal[3], const float view[3],
                           float sky)
{
    static const float key[3] = {-0.50f, 0.62f, 0.60f},
                       fill[3] = {0.78f, -0.10f, 0.61f}; /* right, up, towards the eye */
    float n[3] = {vec3_dot(normal, frame->right), vec3_dot(normal, frame->up),
                  -vec3_dot(normal, frame->forward)};
    const float v[3] = {vec3_dot(view, frame->right), vec3_dot(view, frame->up),
                        -vec3_dot(view, frame->forward)};
    float half[3] = {key[0] - v[0], key[1] - v[1], key[2] - v[2]};
    vec3_normalize(half);
    const float light_key = fmaxf(0.0f, vec3_dot(n, key)), light_fill = fmaxf(0.0f, vec3_dot(n, fill));
    const float ambient = 0.30f + 0.10f * n[1];
    float gloss = fmaxf(0.0f, vec3_dot(n, half));
    gloss *= gloss, gloss *= gloss, gloss *= gloss, gloss *= gloss; /* to the 16th */
    const float direct = (0.72f * light_key + 0.22f * light_fill) * (0.45f + 0.55f * sky);
    const float light = ambient * sky + direct, shine = 0.10f * gloss * sky;
    return color_rgb(color.r * color.r * light + shine, color.g * color.g * light + shine,
                     color.b * color.b * light + shine);
}

struct color raycast_correspondence_color(const float original[3], const float lo[3], const float hi[3])
{
    float d[3];
    for (int i = 0; i < 3; ++i) {
        d[i] = original[i] - 0.5f * (lo[i] + hi[i]);
    }
    vec3_normalize(d);
    const float longitude = atan2f(d[1], d[0]) / 6.2831853f,
                latitude = acosf(fmaxf(-1.0f, fminf(1.0f, d[2]))) / 3.1415927f;
    const int square = (int)floorf(longitude * 16.0f + 64.0f) + (int)floorf(latitude * 8.0f);
    return color_hsv(longitude + 0.08f, 0.55f + 0.2f * latitude, square & 1 ? 0.95f : 0.62f);
}
