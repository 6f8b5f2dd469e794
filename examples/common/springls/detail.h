/* detail.h - levels of detail of the chunks of a world at rest, for a camera that flies through it. Groups of two chunks along each axis
 * are shown at the highest level whose error is less than half a pixel at the distance of each chunk: so most chunks have no finer
 * neighbor, and their triangles are kept from the start. A group is refined at nine tenths of that already and made coarser at eight
 * tenths, so that few change to and fro; what is most wrong comes first, for as long as a caller lets it. */
#ifndef EXAMPLES_SPRINGLS_DETAIL_H
#define EXAMPLES_SPRINGLS_DETAIL_H

#include "springls.h"

#include <stdbool.h>
#include <stdint.h>

enum { DETAIL_LEVELS = 4, DETAIL_BODY = 128 };

#define DETAIL_HALF_A_PIXEL 0.5f

/* The triangles of a chunk at a level, beside neighbors that are no finer. */
struct detail_kept {
    uint16_t *triangles;
    int count;
    float error;
};

/* A chunk of the world, and what is shown of it: lod.triangles. */
struct detail_place {
    springls_chunk chunk; /* positions, normals and triangles are copies */
    springls_lod lod;
    struct detail_kept level[DETAIL_LEVELS];
    float middle[3];
    bool asked;              /* for other triangles                                 */
    bool changed;            /* others are shown since the caller set it to false   */
};

/* Chunks that have one level. */
struct detail_group {
    int first, count; /* of their places                                           */
    int level, wanted;
    float pixels;     /* that the largest of their errors showed as at the last choice */
};

struct detail_world {
    int bricks[3], count;
    int *at;                    /* [brick] its place in `place`; -1: it is empty */
    struct detail_place *place; /* `count` of them, by groups                    */
    struct detail_group *group;
    int group_count;
    springls_lod *request;
    struct detail_group **due;  /* those that are to change                      */
};

/* Copies the chunks of a model on a grid of `size`, and finds the triangles of every level once. Returns NULL, or what has failed, a text
 * that lives as long as the model does and no other call of it fails. detail_free in any case. */
const char *detail_load(struct detail_world *world, springls_context *model, const int size[3]);
void detail_free(struct detail_world *world);

/* Finds the level that each group should have, seen from `eye` (world) in a picture whose pixels are `pixel` wide at distance 1; lists
 * those that have another one. Returns how many. */
int detail_choose(struct detail_world *world, const float eye[3], float pixel);

/* Changes the listed groups, `due` of them, until detail_seconds() is `until`; one in any case. Returns for how many chunks triangles
 * were asked for, and in *changed how many groups have another level; -1: a failure, and the reason is the model's last error. */
int detail_update(struct detail_world *world, springls_context *model, int due, double until, int *changed);

/* Seconds of this thread's processor. */
double detail_seconds(void);

/* Distance to balls with dents, each turned otherwise, one in every cube of DETAIL_BODY voxels. A springls_implicit_fn. */
void detail_bodies(void *user, const float *points, int count, float *out);

/* Where the camera is at a fraction of a flight over a world of `grid` voxels: from one side to the other, down to between the bodies. */
void detail_eye(double fraction, float grid, float eye[3]);

#endif
