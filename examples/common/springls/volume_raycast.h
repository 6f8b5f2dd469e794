/* volume_raycast.h - rays through the volume of a model (paper, Fig. 3): its zero level, the capsules of its springls, its surfels.
 *
 * A capsule is what lies within a radius of a springl's triangle (section 4.1); a surfel is a disk about a springl's particle
 * (section 6). Both are filed by voxel in bricks of 8^3 voxels. A ray passes over bricks without any, and meets exact shapes, not
 * samples. The zero level is phi's, by springls_raycast. All in world units. */
#ifndef EXAMPLES_SPRINGLS_VOLUME_RAYCAST_H
#define EXAMPLES_SPRINGLS_VOLUME_RAYCAST_H

#include "pictures/raycast.h"
#include "springls.h"

enum volume_shape { VOLUME_CAPSULES, VOLUME_SURFELS };

struct volume_scene {
    enum volume_shape shape;
    int count;
    float *elements;     /* capsules: 9 floats, the triangle; surfels: 7, as springls_extract_surfels writes them */
    float radius;        /* of capsules */
    float voxel, low[3]; /* side of a voxel, and where the bricks begin */
    int bricks[3];
    int *brick_cells;    /* one a brick: its first voxel in cell_begin, or -1 if the brick is empty */
    int *cell_begin;     /* cells are lists: cell c has ids[cell_begin[c] .. cell_begin[c + 1] - 1] */
    int *ids;
};

struct volume_hit {
    float distance;  /* along the ray, whose direction has length 1; 0 if it begins within a capsule */
    float normal[3]; /* unit; of a surfel: its own */
    int element;
};

/* File shapes by voxel. Elements are copied; those that are not finite are left out. Return false with an empty scene when memory
 * is short or they extend over more than 2^27 bricks. */
bool volume_scene_capsules(const float *triangles, int count, float radius, float voxel, struct volume_scene *scene);
bool volume_scene_surfels(const float *surfels, int count, float voxel, struct volume_scene *scene);
void volume_scene_free(struct volume_scene *scene);

/* Finds the first hit at a distance of 0 or more. `direction` has length 1. Returns false if the ray meets nothing. */
bool volume_raycast(const struct volume_scene *scene, const float origin[3], const float direction[3], struct volume_hit *hit);

/* Draws a model by rays: the zero level (scene NULL), or the shapes of a scene, each in a gray of its own. Hollows are darker,
 * by phi. voxel: side of the model's voxels. Returns false when a call of the library fails or memory is short. */
bool volume_picture(springls_context *ctx, const struct volume_scene *scene, float voxel, const struct raycast_camera *camera,
                    int width, int height, struct image *picture);

#endif
