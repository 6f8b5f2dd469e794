#include "viewer/camera.h"

#include "base/vec3.h"

#include <string.h>

#define FIELD_OF_VIEW 35.0f /* degrees */

void viewer_camera_fit(struct viewer_camera *camera, const float middle[3], float radius, float scene_radius)
{
    memcpy(camera->target, middle, sizeof camera->target);
    memcpy(camera->middle, middle, sizeof camera->middle);
    camera->yaw = 0.5f;
    camera->pitch = 0.35f;
    camera->distance = 1.15f * radius / sinf(0.5f * FIELD_OF_VIEW * 0.01745329f);
    camera->scene_radius = scene_radius;
}

struct raycast_frame viewer_camera_frame(const struct viewer_camera *camera, float aspect, float eye[3])
{
    const float towards[3] = {sinf(camera->yaw) * cosf(camera->pitch), sinf(camera->pitch),
                              cosf(camera->yaw) * cosf(camera->pitch)};
    struct raycast_camera view = {.up = {0.0f, 1.0f, 0.0f}, .field_of_view = FIELD_OF_VIEW};
    memcpy(view.target, camera->target, sizeof view.target);
    vec3_add_scaled(camera->target, camera->distance, towards, view.eye);
    memcpy(eye, view.eye, sizeof view.eye);
    return raycast_camera_frame(&view, aspect);
}

void viewer_camera_orbit(struct viewer_camera *camera, float dx, float dy)
{
    camera->yaw -= 4.0f * dx;
    camera->pitch = fmaxf(-1.5f, fminf(1.5f, camera->pitch + 4.0f * dy));
}

void viewer_camera_pan(struct viewer_camera *camera, float dx, float dy)
{
    float eye[3];
    const struct raycast_frame frame = viewer_camera_frame(camera, 1.0f, eye);
    const float height = 2.0f * frame.half_height * frame.distance;
    vec3_add_scaled(camera->target, -dx * height, frame.right, camera->target);
    vec3_add_scaled(camera->target, dy * height, frame.up, camera->target);
}

void viewer_camera_zoom(struct viewer_camera *camera, float notches)
{
    const float nearer = camera->distance * powf(0.88f, notches);
    camera->distance = fmaxf(0.02f * camera->scene_radius, fminf(10.0f * camera->scene_radius, nearer));
}

struct viewer_ray viewer_camera_ray(const struct viewer_camera *camera, float x, float y, int width, int height)
{
    struct viewer_ray ray;
    const struct raycast_frame frame = viewer_camera_frame(camera, (float)width / (float)height, ray.origin);
    vec3_add_scaled(frame.forward, (2.0f * x / (float)width - 1.0f) * frame.half_width, frame.right, ray.direction);
    vec3_add_scaled(ray.direction, (1.0f - 2.0f * y / (float)height) * frame.half_height, frame.up, ray.direction);
    vec3_normalize(ray.direction);
    return ray;
}

void viewer_camera_matrix(const struct viewer_camera *camera, float aspect, float matrix[16])
{
    float eye[3], away[3];
    const struct raycast_frame frame = viewer_camera_frame(camera, aspect, eye);
    vec3_sub(camera->middle, eye, away);
    const float depth = vec3_dot(away, frame.forward);
    const float far = fmaxf(depth + camera->scene_radius, 0.02f * camera->scene_radius);
    const float near = fmaxf(depth - camera->scene_radius, 0.002f * far);
    const float *rows[3] = {frame.right, frame.up, frame.forward};
    const float scale[3] = {1.0f / frame.half_width, 1.0f / frame.half_height, (far + near) / (far - near)};
    for (int c = 0; c < 4; ++c) {
        for (int r = 0; r < 3; ++r) {
            matrix[4 * c + r] = scale[r] * (c < 3 ? rows[r][c] : -vec3_dot(rows[r], eye));
        }
        matrix[4 * c + 3] = c < 3 ? frame.forward[c] : -vec3_dot(frame.forward, eye);
    }
    matrix[14] -= 2.0f * far * near / (far - near);
}
