/* camera.h - a camera that orbits around a point: orbit, pan, zoom, the ray through a pixel. y is up. */
#ifndef EXAMPLES_VIEWER_CAMERA_H
#define EXAMPLES_VIEWER_CAMERA_H

#include "pictures/raycast.h"

struct viewer_camera {
    float target[3];
    float yaw, pitch; /* radians; 0, 0: seen from +z */
    float distance;   /* target to eye */
    float scene_radius;      /* radius of everything drawn, around the middle of the grid */
    float middle[3];
};

struct viewer_ray {
    float origin[3], direction[3]; /* direction of length 1 */
};

/* Shows a ball around `middle`; nothing is drawn farther from there than `scene_radius`. */
void viewer_camera_fit(struct viewer_camera *camera, const float middle[3], float radius, float scene_radius);

/* Move the camera by motions of the pointer, in heights of the window; y grows downwards. */
void viewer_camera_orbit(struct viewer_camera *camera, float dx, float dy);
void viewer_camera_pan(struct viewer_camera *camera, float dx, float dy);
void viewer_camera_zoom(struct viewer_camera *camera, float notches); /* positive: closer */

struct raycast_frame viewer_camera_frame(const struct viewer_camera *camera, float aspect, float eye[3]);

/* Returns the ray through the point (x, y) of a window, (0, 0) its upper left corner. */
struct viewer_ray viewer_camera_ray(const struct viewer_camera *camera, float x, float y, int width, int height);

/* Computes the matrix from world to clip coordinates, column-major for OpenGL. */
void viewer_camera_matrix(const struct viewer_camera *camera, float aspect, float matrix[16]);

#endif
