/* raycast.h - pictures of triangle meshes and springl soups by ray casting on the CPU.
 *
 * It needs no window and no GPU, so it serves tests, reports and build servers. It uses the threads of base/threads.h; the
 * picture is the same for any number of threads. */
#ifndef EXAMPLES_PICTURES_RAYCAST_H
#define EXAMPLES_PICTURES_RAYCAST_H

#include "pictures/image.h"

#include <stdint.h>

struct raycast_camera {
    float eye[3], target[3], up[3];
    float field_of_view; /* degrees, vertical; 0 = orthographic */
    float ortho_height;  /* world height of the picture when orthographic */
};

/* A camera's axes; raycast_camera_frame is also for callers that draw over a picture. */
struct raycast_frame {
    float right[3], up[3], forward[3];
    float half_height, half_width; /* of the picture plane at distance 1, or in world units when orthographic */
    float distance;                /* eye to target */
    bool perspective;
};

struct raycast_frame raycast_camera_frame(const struct raycast_camera *camera, float aspect);

/* Computes the ray, of length 1, through a place of the picture: x, y in -1..1, to the right and upwards. */
void raycast_camera_ray(const struct raycast_camera *camera, const struct raycast_frame *frame, float x, float y, float origin[3],
                        float direction[3]);

/* Shades a point by two lights that move with the camera (key from upper left, fill from the right), the sky, of which `sky` is
 * visible (0..1), and a soft highlight. view: direction of the ray. Light adds up in linear values; display value = square root,
 * an approximation of the sRGB curve. */
struct color raycast_shade(const struct raycast_frame *frame, struct color color, const float normal[3], const float view[3],
                           float sky);

/* Returns a camera that shows all the points from `direction` (from the object to the eye), with a small margin. For a film
 * pass the points of all its frames. */
struct raycast_camera raycast_frame_points(const float *points, size_t count, const float direction[3],
                                           const float up[3], float field_of_view, float aspect);
/* Extends lo..hi by points (3 floats each, ignoring those that are not finite). Start with lo = +INFINITY, hi = -INFINITY. */
void raycast_grow_box(const float *points, size_t count, float lo[3], float hi[3]);

enum raycast_style {
    RAYCAST_SMOOTH, /* interpolated normals */
    RAYCAST_SPRINGL /* one normal a triangle and dark triangle edges, so that every springl is visible */
};

/* Returns the color of a point of the original surface; used with `originals`. */
typedef struct color (*raycast_color_fn)(void *user, const float original[3]);

struct raycast_scene {
    /* Triangles. NULL rules: no indices = soup, corners 3t..3t+2; no normals = area-weighted from the triangles (needs
     * indices to be smooth); no colours = base_color. Per-vertex arrays hold vertex_count * 3 floats. */
    const float *positions;
    size_t vertex_count;
    const uint32_t *indices;
    size_t triangle_count;
    const float *normals;
    const float *vertex_colors;
    const float *triangle_colors;
    /* Points of the original surface, one a vertex or one a triangle, colored by color_at (NULL = raycast_correspondence_color
     * over the box of the originals). They take precedence over colors. */
    const float *vertex_originals;
    const float *triangle_originals;
    raycast_color_fn color_at;
    void *color_user;
    /* Dots on top of the visible surface: particles (red) and another set, such as vertices (yellow). */
    const float *particles;
    size_t particle_count;
    float particle_radius; /* pixels; 0 = 2 */
    const float *marks;
    size_t mark_count;
    float mark_radius;

    enum raycast_style style;
    float shrink;     /* springl style: each triangle drawn this much smaller about its centre, 0..0.9 */
    float edge_width; /* springl style: pixels; 0 = 1.2 */
    size_t edged;     /* springl style: only the first `edged` triangles have dark edges; 0 = all */
    bool plain;       /* no ambient occlusion (faster) */
    struct color base_color, particle_color, mark_color; /* all zero = grey, red, yellow */
    struct color background_top, background_bottom;      /* all zero = light grey gradient */
    struct raycast_camera camera;
    int supersampling; /* n x n samples a pixel; 0 = 2 */
};

/* Renders the scene; without triangles the picture is the background. Returns false if there are triangles but none is finite (the
 * picture is then the background), an index is wrong, or memory is short. */
bool raycast_render(const struct raycast_scene *scene, int width, int height, struct image *result);

/* Returns a pattern that makes tracking visible: hue by direction from the center of the box lo..hi, times a checker of
 * latitude and longitude. */
struct color raycast_correspondence_color(const float original[3], const float lo[3], const float hi[3]);

#endif
