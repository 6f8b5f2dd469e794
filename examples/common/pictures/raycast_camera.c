/* raycast_camera.c - cameras, boxes and the correspondence pattern of raycast.h. */
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
