/* character.h - a skinned, animated character: surface, skeleton, bone weights, animations, colors.
 *
 * Everything is stored in the neutral pose, in which the surface was bound, in world coordinates. In another pose vertex v is
 * at the sum over its bones j of weight * skin[j] v, with skin[j] = (placement of joint j in the pose) * (neutral
 * placement)^-1: linear blend skinning (Lewis et al. 2000, reference [60] of the paper). */
#ifndef EXAMPLES_CHARACTER_CHARACTER_H
#define EXAMPLES_CHARACTER_CHARACTER_H

#include "base/affine.h"
#include "surface/animation.h"
#include "surface/material.h"

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
    int parent;             /* stored before its children; -1 = none */
    struct placement rest;  /* relative to the parent, where no animation moves it */
    struct affine neutral;  /* placement in the world when the surface was bound */
    bool bone;              /* at least one vertex has a weight on it */
};

struct character {
    int joint_count, vertex_count, triangle_count, animation_count, part_count, material_count, picture_count;
    struct joint *joints;
    float *positions; /* 3 a vertex */
    float *normals;   /* 3 a vertex, of length 1 */
    float *uvs;       /* 2 a vertex, of the material's image */
    float *colors;    /* 3 a vertex, display values; 1 where the file has none; the material's base color multiplies them */
    struct influences *influences;
    int *triangles; /* 3 each */
    int *materials_of; /* one a triangle */
    struct material *materials;
    struct picture *pictures;
    struct animation *animations;
    bool skinned;    /* at least one part has bones */
    int unnormal;    /* vertices whose weights did not sum to 1 within 0.01 in the file */
    int unweighted;  /* vertices of skinned parts without a weight: attached to the root */
    int missing_pictures; /* images that materials name and that cannot be read */
    int prop_count;  /* rigid parts attached to bones, whether read or skipped */
    char (*props)[CHARACTER_NAME]; /* their names */
};

/* Reads a file (surface/scene.h). props: words, comma-separated, "all" or NULL: rigid parts attached to bones are read if their
 * name contains one of the words. Returns false with one line in `error` and nothing to free. */
bool character_read(const char *path, const char *props, struct character *character, char error[CHARACTER_TEXT]);

/* Returns true if a rigid part attached to a bone has a name that contains this one, ignoring case. */
bool character_has_prop(const struct character *character, const char *name);

/* Builds one of two bodies that need no file, on the same skeleton: 0 a slim one with arms and legs, 1 a broad one with a tail
 * and horns. */
bool character_build(int number, struct character *character, char error[CHARACTER_TEXT]);

void character_free(struct character *character);
bool character_has_colors(const struct character *character); /* a vertex color is not white */
void character_free_rig(struct character *character); /* only joints and animations */

/* Computes smooth normals of vertices from `first_vertex` on by the triangles from `first_triangle` on; vertices at the same
 * place, such as those of seams, get the same. Returns false if memory is short. */
bool character_smooth(struct character *character, int first_vertex, int first_triangle);

/* Finds an animation by name, or by number from 0 as text. Returns -1 if there is none; NULL selects the first. */
int character_animation(const struct character *character, const char *name);

int character_joint(const struct character *character, const char *name); /* -1: none */

/* Computes the skinning matrices, one a joint, of an animation at a time. animation -1: neutral pose. blend: 0 the neutral
 * pose, 1 the animation's pose, in between interpolated. places: the joints' placements in the world. */
void character_pose(const struct character *character, int animation, double time, double blend, struct affine *skin,
                    struct affine *places);

/* Returns the linear blend skinning matrix: the sum of weight * skin[joint]. */
struct affine influences_blend(const struct influences *influences, const struct affine *skin);

/* Transforms the surface by skinning matrices. */
void character_skin(const struct character *character, const struct affine *skin, float *positions);

/* Returns the joint's position in the neutral pose. */
static inline void joint_place(const struct joint *joint, float place[3])
{
    for (int i = 0; i < 3; ++i) {
        place[i] = (float)joint->neutral.m[4 * i + 3];
    }
}

/* Adds weight on a joint: to its own entry, to a free one, or replacing the smallest if that is less. */
void influences_add(struct influences *influences, int joint, float weight);
/* Scales the weights to sum 1 and returns their sum before. If there are none, joint `otherwise` gets weight 1. */
float influences_normalize(struct influences *influences, int otherwise);

#endif
