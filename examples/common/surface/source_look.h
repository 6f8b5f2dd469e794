/* source_look.h - the colors of a textured file's surface, for a surface that was made from it: those of the closest place. */
#ifndef EXAMPLES_SURFACE_SOURCE_LOOK_H
#define EXAMPLES_SURFACE_SOURCE_LOOK_H

#include "base/bvh.h"
#include "surface/scene.h"

#include <stdint.h>

struct source_look {
    struct scene scene;         /* at rest */
    struct look_triangle *triangles;
    struct bvh bvh;             /* of these */
    double texels;              /* of all images */
    int missing;                /* images that materials name and that cannot be read */
};

enum source_look_status { SOURCE_LOOK_FINE, SOURCE_LOOK_NONE, SOURCE_LOOK_FAILED };

/* Reads how a file looks, and takes the triangles with these numbers (mesh.source) for its surface. NONE, with nothing to free: no material
 * has an image that can be read (look->missing: so many cannot); FAILED, the same: one line in `error`. */
enum source_look_status source_look_make(const char *path, const uint32_t *numbers, size_t count, struct source_look *look,
                                         char error[SCENE_TEXT]);
void source_look_free(struct source_look *look);

/* Computes the color at the place that is closest to a point, as display values: of the image (bilinear, it repeats) times the base color
 * times that of the vertices. May be called by several threads. */
void source_look_color(const struct source_look *look, const float point[3], float color[3]);

#endif
