/* shape_pictures.h - pictures of shapes in correspondence, all with the same camera. */
#ifndef EXAMPLES_SHAPES_SHAPE_PICTURES_H
#define EXAMPLES_SHAPES_SHAPE_PICTURES_H

#include "pictures/raycast.h"
#include "shapes/shapes.h"

/* A common view: across the widest extent of a shape, a little from above and from the side; open shapes from outside. */
struct shape_view {
    struct raycast_camera camera;
    int width, height; /* of one picture, pixels */
};

struct shape_view shape_view_make(const struct shape_mesh *mesh, int width, int height);

/* Widens a view so that it has another shape as a whole. */
void shape_view_include(struct shape_view *view, const float *shape, int vertices);

/* Compute colors, 3 floats a vertex. */
void colors_by_offset(const struct shape_mesh *from, const float *to, float full, float *colors); /* outward red, inward blue */
void colors_by_region(const uint32_t *regions, int vertices, float *colors);

/* Draws a shape, gray when colors and originals are NULL. */
bool shape_picture(const struct shape_mesh *mesh, const float *shape, const float *colors, const float *originals,
                   const struct shape_view *view, struct image *picture);

/* Writes the pictures as one file and frees them; returns false if that fails. */
bool pictures_write(struct image *pictures, const char *const *captions, int count, int columns, const char *path);

#endif
