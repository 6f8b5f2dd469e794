/* gltf_builder.h - puts a glTF 2.0 binary file (GLB) together: accessors, images, materials, meshes, nodes, animations.
 *
 * A failure is remembered: gltf_finish returns it. assimp's exporter supports neither STEP animations nor colors with enough bits
 * for dark tones. */
#ifndef EXAMPLES_SURFACE_GLTF_BUILDER_H
#define EXAMPLES_SURFACE_GLTF_BUILDER_H

#include "surface/gltf_write.h"

#include <cjson/cJSON.h>

/* Targets of buffer views, specification 3.6.2.2. */
enum { GLTF_NO_TARGET = 0, GLTF_VERTICES = 34962, GLTF_INDICES = 34963 };

struct gltf {
    cJSON *root;
    unsigned char *bytes;
    size_t used, room;
    bool failed;
};

void gltf_begin(struct gltf *g);
/* Writes the file and frees everything. */
bool gltf_finish(struct gltf *g, const char *path);

/* Adds an object to a list of the file, such as "nodes", which begins when it is first used; *index is its number. */
cJSON *gltf_add(struct gltf *g, const char *list, int *index);
void gltf_number(cJSON *to, const char *name, double value);
void gltf_numbers(cJSON *to, const char *name, const double *values, int count);

/* Adds floats, width 1 a number, 2 to 4 a vector, 16 a matrix; bounded: with the bounds that positions and key times need. Returns
 * the accessor's number. */
int gltf_floats(struct gltf *g, const float *data, int count, int width, int target, bool bounded);
int gltf_shorts(struct gltf *g, const uint16_t *data, int count, int width, bool normalized);

/* Adds images and materials; without any, one that is plain and white. Returns the number of the first material. */
int gltf_materials(struct gltf *g, const struct gltf_look *look);
/* Adds a mesh, one primitive a material in use, that looks as the materials from `first_material` on, which `look` has given. */
void gltf_mesh(struct gltf *g, const struct gltf_mesh *mesh, const struct gltf_look *look, int first_material);

/* Begins an animation; adds a channel with key times in accessor `times`. */
cJSON *gltf_animation(struct gltf *g, const char *name);
void gltf_channel(struct gltf *g, cJSON *animation, int node, const char *path, int times, const float *values, int count,
                  int width, const char *interpolation);
void gltf_scene(struct gltf *g, const int *roots, int count);

#endif
