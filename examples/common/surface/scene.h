/* scene.h - what a file of meshes and characters contains, whatever its format: nodes, parts of a surface, how they look, clips.
 *
 * glTF 2.0 is read by gltf_scene.c, all other formats by assimp (assimp_scene.c). What is here is checked: numbers of nodes,
 * vertices, bones and materials exist, weights are finite and not negative. Coordinates may be anything. */
#ifndef EXAMPLES_SURFACE_SCENE_H
#define EXAMPLES_SURFACE_SCENE_H

#include "base/affine.h"
#include "surface/animation.h"
#include "surface/material.h"

#include <stdbool.h>
#include <stddef.h>

enum { SCENE_TEXT = 320, SCENE_NAME = 64 };

struct scene_node {
    char name[SCENE_NAME];
    int parent;            /* stored before its children; -1 = none */
    struct placement rest; /* relative to the parent; without shear */
    struct affine local;   /* the same, as the file has it */
};

struct scene_bone {
    int node;
    struct affine offset; /* inverse bind matrix: from the part to the bone */
};

struct scene_weight {
    int vertex, bone; /* numbers within the part */
    float weight;
};

/* A surface of one material, where a node has it. Morph targets are applied with their default weights. */
struct scene_part {
    int node, material; /* material: -1 = none */
    int vertex_count, triangle_count, bone_count, weight_count;
    float *positions;   /* 3 a vertex */
    float *normals;     /* 3 a vertex, of any length; NULL: the file has none, as of all that follow */
    float *uvs;         /* 2 a vertex, of the material's image, v downwards */
    float *colors;      /* 3 a vertex, as in the file */
    int *triangles;     /* 3 each */
    struct scene_bone *bones;
    struct scene_weight *weights;
};

struct scene {
    int node_count, part_count, material_count, picture_count, animation_count;
    struct scene_node *nodes;
    struct scene_part *parts; /* by their nodes */
    struct material *materials;
    struct picture *pictures;
    struct animation *animations;
    int missing_pictures; /* images that materials name and that cannot be read */
    bool linear;          /* colors of vertices are, as in glTF; else they are display values */
};

enum scene_extent { SCENE_SHAPE, SCENE_ALL }; /* without images and clips; with them */

/* Reads a file, its polygons as triangles, without points and lines. Returns false with one line in `error` and nothing to free: it
 * cannot be opened, is empty or broken, promises more than it can contain, or needs an extension of glTF that is not known. */
bool scene_read(const char *path, enum scene_extent extent, struct scene *scene, char error[SCENE_TEXT]);
void scene_free(struct scene *scene);

/* Moves the vertices of all parts to where they are when nothing moves: by bones or, without any, by the node. Triangles that this
 * mirrors are turned. Normals stay. Returns false if memory is short. */
bool scene_rest(struct scene *scene);

/* Exchanges two corners of a triangle. */
void scene_turn(int triangle[3]);

/* Writes the end of the path and a reason, as one line; returns false. */
bool scene_fail(char error[SCENE_TEXT], const char *path, const char *format, ...);

#endif
