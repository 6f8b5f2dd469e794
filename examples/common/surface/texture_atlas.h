/* texture_atlas.h - unwraps a surface into charts in one square image, and bakes colors into it.
 *
 * A chart is a connected patch that is seen from one of six sides; it is projected along that axis, at one scale for all charts,
 * and charts are packed in rows. Vertices are doubled where charts meet, so that nothing is interpolated across their borders. */
#ifndef EXAMPLES_SURFACE_TEXTURE_ATLAS_H
#define EXAMPLES_SURFACE_TEXTURE_ATLAS_H

#include "pictures/image.h"

struct texture_atlas {
    int size; /* texels a side */
    int vertex_count, triangle_count;
    int *vertex_of; /* of the surface, for each vertex of the atlas */
    int *triangles; /* the surface's, by vertices of the atlas */
    float *uvs;     /* 2 a vertex, from the upper left corner as in glTF */
    bool full;      /* it could not be made, for charts need a larger image */
};

/* Returns false, with nothing to free, if there is no triangle with an area, charts do not fit (atlas->full) or memory is short. */
bool texture_atlas_unwrap(const float *positions, int vertex_count, const int *triangles, int triangle_count, int size,
                          struct texture_atlas *atlas);
void texture_atlas_free(struct texture_atlas *atlas);

/* Computes the color at a place of a triangle, as display values; may be called by several threads. */
typedef void texture_atlas_color(const void *user, int triangle, const float weight[3], float color[3]);

/* Colors each texel whose center is in a triangle, and those around charts like their neighbors. */
bool texture_atlas_bake(const struct texture_atlas *atlas, texture_atlas_color *color, const void *user, struct image *image);

#endif
