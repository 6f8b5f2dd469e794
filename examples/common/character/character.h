/* character.h - a skinned, animated character: surface, skeleton, bone weights, animations, colours.
 *
 * All of it stands in one neutral pose, the one that it was bound in, in world coordinates. In another pose vertex v is at
 * sum over its bones j of weight * skin[j] v, with skin[j] = (place of joint j in the pose) * (its neutral place)^-1: linear
 * blend skinning (Lewis et al. 2000, reference [60] of the paper). */
#ifndef EXAMPLES_CHARACTER_CHARACTER_H
#define EXAMPLES_CHARACTER_CHARACTER_H

#include "base/affine.h"
#include "pictures/image.h"

#include <stdbool.h>
#include <stddef.h>

enum { CHARACTER_TEXT = 320, CHARACTER_NAME = 64, CHARACTER_BONES = 8 };

/* Bones of a vertex; weights sum to 1, unused ones are 0. */
struct influences {
    int joint[CHARACTER_BONES];
    float weight[CHARACTER_BONES];
};

struct joint {
    char name[CHARACTER_NAME];
    int parent;             /* before its children; -1 = none */
    struct placement rest;  /* relative to the parent, where no animation moves it */
    struct affine neutral;  /* its place in the world when the surface was bound */
    bool bone;              /* some vertex follows it */
};

struct keys { /* of one property of a joint; linear between them */
    int count;
    double *times;  /* seconds, rising */
    double *values; /* 3 a key, or 4: quaternion w, x, y, z */
};

struct channel {
    int joint;
    struct keys translation, rotation, scale;
};

struct animation {
    char name[CHARACTER_NAME];
    double duration; /* seconds */
    int channel_count;
    struct channel *channels;
};

struct character {
    int joint_count, vertex_count, triangle_count, animation_count, part_count, image_count;
    struct joint *joints;
    float *positions; /* 3 a vertex */
    float *uvs;       /* 2 a vertex */
    float *colors;    /* 3 a vertex, display values; times the image's, where the triangle has one */
    struct influences *influences;
    int *triangles; /* 3 each */
    int *images_of; /* a triangle's image, or -1 */
    struct image *images;
    struct animation *animations;
    bool skinned;    /* some part has bones */
    int unnormal;    /* vertices whose weights did not sum to 1 to within a hundredth, before they were made to */
    int unweighted;  /* vertices of skinned parts without a weight: they follow the root */
    int prop_count;  /* rigid parts that hang on bones, taken or left out */
    char (*props)[CHARACTER_NAME]; /* their names */
};

/* Through assimp. props: rigid parts that hang on bones too, those whose names hold one of these words (with commas between;
 * "all";
 * NULL: none). False: one line in `error`, nothing to free. */
bool character_read(const char *path, const char *props, struct character *character, char error[CHARACTER_TEXT]);

/* Two bodies that come with the program, on one skeleton: a slim one with arms and legs, and a broad one with a tail and horns.
 * number: 0 or 1. */
bool character_build(int number, struct character *character, char error[CHARACTER_TEXT]);

void character_free(struct character *character);

/* By name, or by number as text from 0; -1: there is none. NULL: the first, if there is one. */
int character_animation(const struct character *character, const char *name);

int character_joint(const struct character *character, const char *name); /* -1: none */

/* Skinning matrices, one a joint, of an animation at a time. animation -1: neutral pose. blend: 0 the neutral pose, 1 the
 * animation's, between: on the way. places: the joints' own places in the world. */
void character_pose(const struct character *character, int animation, double time, double blend, struct affine *skin,
                    struct affine *places);

/* Linear blend skinning: sum of weight * skin[joint]. */
struct affine influences_blend(const struct influences *influences, const struct affine *skin);

/* The surface under skinning matrices. */
void character_skin(const struct character *character, const struct affine *skin, float *positions);

/* Where the joint is in the neutral pose. */
static inline void joint_place(const struct joint *joint, float place[3])
{
    for (int i = 0; i < 3; ++i) {
        place[i] = (float)joint->neutral.m[4 * i + 3];
    }
}

/* Adds weight on a joint: to its own entry, to a free one, or in the place of the smallest if that is less. */
void influences_add(struct influences *influences, int joint, float weight);
/* Scales the weights to sum 1; returns their sum before. Without any, joint `otherwise` takes all. */
float influences_normalize(struct influences *influences, int otherwise);

#endif
