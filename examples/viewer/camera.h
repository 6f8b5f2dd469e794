/* camera.h - a camera that a hand turns about a point: orbit, pan, zoom, the ray through a pixel. y is up. */
#ifndef EXAMPLES_VIEWER_CAMERA_H
#define EXAMPLES_VIEWER_CAMERA_H

#include "pictures/raycast.h"

struct viewer_camera {
    float target[3];
    float yaw, pitch; /* radians; 0, 0: from +z */
    float distance;   /* target to eye */
    float scene_radius;      /* everything lies this near to the middle of the grid */
    float middle[3];
};

struct viewer_ray {
    float origin[3], direction[3]; /* direction of length 1 */
};

/* Sees a ball about `middle`; nothing is drawn further from there than `scene_radius`. */
void viewer_camera_fit(struct viewer_camera *camera, const float middle[3], float radius, float scene_radius);

/* Ways of the pointer, in heights of the window; y grows downwards. */
void viewer_camera_orbit(struct viewer_camera *camera, float dx, float dy);
void viewer_camera_pan(struct viewer_camera *camera, float dx, float dy);
void viewer_camera_zoom(struct viewer_camera *camera, float notches); /* positive: nearer */

struct raycast_frame viewer_camera_frame(const struct viewer_camera *camera, float aspect, float eye[3]);

/* Through the point (x, y) of a window, (0, 0) its upper left corner. */
struct viewer_ray viewer_camera_ray(const struct viewer_camera *camera, float x, float y, int width, int height);

/* World to clip coordinates, column by column as OpenGL wants it. */
void viewer_camera_matrix(const struct viewer_camera *camera, float aspect, float matrix[16]);

#endif
