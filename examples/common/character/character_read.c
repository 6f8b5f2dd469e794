/* character_read.c - reads a character from a file.
 *
 * Parts may be bound in different spaces (inverse bind matrices of several skins). The first part that uses a joint determines
 * the joint's neutral placement, and all vertices are transformed to that pose. A part is moved as a whole to where a joint is that
 * it shares with parts before, or else to where its first joint rests. */
#include "character/character.h"

#include "base/vec3.h"
#include "surface/scene.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_JOINTS = 4096 };

/* Fail to compile unless texts have the same length. */
typedef char same_length[CHARACTER_TEXT == (int)SCENE_TEXT ? 1 : -1];
typedef char same_name_length[CHARACTER_NAME == (int)SCENE_NAME && CHARACTER_NAME == (int)ANIMATION_NAME ? 1 : -1];

struct reader {
    const char *path;
    struct scene scene; /* its nodes are the joints */
    struct character *character;
    struct affine *rest; /* placement of each joint when nothing moves it */
    bool *bound;         /* joints whose neutral placement a part has determined */
    char *error;
};

static bool no_memory(struct reader *r) { return scene_fail(r->error, r->path, "not enough memory"); }

/* Returns true if the map is finite and invertible. */
static bool usable(const struct affine *a)
{
    const double d = affine_determinant(a);
    bool good = isfinite(d) && fabs(d) > 1e-30;
    for (int i = 0; i < 12; ++i) {
        good = good && isfinite(a->m[i]);
    }
    return good;
}

/* ---- skeleton: every node of the file ---- */

static bool add_joints(struct reader *r)
{
    struct character *c = r->character;
    for (int j = 0; j < r->scene.node_count; ++j) {
        const struct scene_node *node = &r->scene.nodes[j];
        struct joint *joint = &c->joints[j];
        if (!usable(&node->local)) {
            return scene_fail(r->error, r->path, "node %.60s: its matrix is not finite or flattens", node->name);
        }
        memcpy(joint->name, node->name, sizeof joint->name);
        joint->parent = node->parent;
        joint->rest = node->rest;
        r->rest[j] = node->parent >= 0 ? affine_after(&r->rest[node->parent], &node->local) : node->local;
    }
    c->joint_count = r->scene.node_count;
    return true;
}

/* Returns the bone by which a part's space is found: one that is bound already, else the first joint. NULL: it has none; or, with a
 * line in r->error, one is not usable. */
static const struct scene_bone *find_anchor(struct reader *r, const struct scene_part *part)
{
    const struct scene_bone *anchor = NULL;
    for (int b = 0; b < part->bone_count; ++b) {
        const struct scene_bone *bone = &part->bones[b];
        if (!usable(&bone->offset)) {
            scene_fail(r->error, r->path, "bone %.60s: its inverse bind matrix is not finite or flattens",
                       r->character->joints[bone->node].name);
            return NULL;
        }
        const bool bound = r->bound[bone->node], before = anchor && r->bound[anchor->node];
        if (!anchor || (bound && !before) || (bound == before && bone->node < anchor->node)) { anchor = bone; }
    }
    return anchor;
}

/* Sets the neutral placements of a part's bones that no part before has. Returns false where one is not usable. */
static bool bind_part(struct reader *r, const struct scene_part *part)
{
    struct joint *joints = r->character->joints;
    const struct scene_bone *anchor = find_anchor(r, part);
    if (!anchor) { return part->bone_count == 0; }
    const struct affine *place = r->bound[anchor->node] ? &joints[anchor->node].neutral : &r->rest[anchor->node];
    const struct affine to_world = affine_after(place, &anchor->offset);
    for (int b = 0; b < part->bone_count; ++b) {
        const int node = part->bones[b].node;
        if (r->bound[node]) { continue; }
        const struct affine bound = affine_inverse(&part->bones[b].offset);
        joints[node].neutral = affine_after(&to_world, &bound);
        r->bound[node] = true;
    }
    return true;
}

/* Sets neutral placements: of bones by their parts, of all others along the hierarchy. */
static bool bind_joints(struct reader *r)
{
    struct character *c = r->character;
    for (int p = 0; p < r->scene.part_count; ++p) {
        if (!bind_part(r, &r->scene.parts[p])) { return false; }
    }
    for (int j = 0; j < c->joint_count; ++j) {
        struct joint *joint = &c->joints[j];
        if (r->bound[j]) { continue; }
        joint->neutral = r->rest[j];
        for (int up = joint->parent; up >= 0; up = c->joints[up].parent) {
            if (r->bound[up]) { /* below a bone */
                const struct affine local = placement_matrix(&joint->rest);
                joint->neutral = affine_after(&c->joints[joint->parent].neutral, &local);
                break;
            }
        }
    }
    return true;
}

/* ---- materials ---- */

/* Takes the materials over, and a plain one more for parts that name none. */
static bool take_materials(struct reader *r)
{
    struct character *c = r->character;
    const size_t count = (size_t)r->scene.material_count;
    c->materials = malloc((count + 1) * sizeof *c->materials);
    if (!c->materials) {
        return no_memory(r);
    }
    memcpy(c->materials, r->scene.materials, count * sizeof *c->materials);
    c->materials[count] = material_plain();
    c->material_count = (int)count + 1;
    c->pictures = r->scene.pictures;
    c->picture_count = r->scene.picture_count;
    c->missing_pictures = r->scene.missing_pictures;
    r->scene.pictures = NULL;
    r->scene.picture_count = 0;
    return true;
}

/* ---- parts ---- */

/* Turns the triangles of a part that come out mirrored. */
static void turn_mirrored(struct character *c, const struct affine *bring, int first_triangle)
{
    for (int t = first_triangle; t < c->triangle_count; ++t) {
        int *corner = c->triangles + 3 * (size_t)t;
        const struct affine blend = influences_blend(&c->influences[corner[0]], bring);
        if (affine_determinant(&blend) < 0.0) {
            scene_turn(corner);
        }
    }
}

/* Transforms a part's vertices from the part's space to the neutral pose, each by its bones. */
static bool bring_vertices(struct reader *r, const struct scene_part *part, int first, int first_triangle)
{
    struct character *c = r->character;
    struct affine *bring = malloc((size_t)c->joint_count * sizeof *bring);
    if (!bring) {
        return no_memory(r);
    }
    for (int j = 0; j < c->joint_count; ++j) {
        bring[j] = c->joints[j].neutral; /* a part without bones is in its node's space */
    }
    int root = part->bone_count > 0 ? part->bones[0].node : part->node;
    for (int b = 0; b < part->bone_count; ++b) {
        const int j = part->bones[b].node;
        bring[j] = affine_after(&c->joints[j].neutral, &part->bones[b].offset);
        root = j < root ? j : root;
    }
    bool good = true;
    for (int v = first; good && v < c->vertex_count; ++v) {
        const float sum = influences_normalize(&c->influences[v], root);
        c->unnormal += part->bone_count > 0 && sum > 0.0f && fabsf(sum - 1.0f) > 0.01f;
        c->unweighted += part->bone_count > 0 && !(sum > 0.0f);
        const struct affine blend = influences_blend(&c->influences[v], bring);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            c->joints[c->influences[v].joint[k]].bone |= c->influences[v].weight[k] > 0.0f;
        }
        affine_apply(&blend, c->positions + 3 * v, c->positions + 3 * v);
        affine_normal(&blend, c->normals + 3 * v, c->normals + 3 * v);
        good = vec3_within_reach(c->positions + 3 * v) || scene_fail(r->error, r->path, VEC3_TOO_FAR);
    }
    turn_mirrored(c, bring, first_triangle);
    free(bring);
    return good;
}

/* Copies a part's vertices; what the file does not have is 0, or white. */
static bool add_vertices(struct reader *r, const struct scene_part *part)
{
    struct character *c = r->character;
    const size_t first = (size_t)c->vertex_count, count = (size_t)part->vertex_count;
    memcpy(c->positions + 3 * first, part->positions, 3 * count * sizeof *c->positions);
    for (size_t v = 0; v < count; ++v) {
        for (size_t i = 0; i < 3; ++i) {
            const float display = part->colors ? color_display(part->colors[3 * v + i]) : 1.0f;
            c->colors[3 * (first + v) + i] = isfinite(display) ? display : 1.0f;
            c->normals[3 * (first + v) + i] = part->normals ? part->normals[3 * v + i] : 0.0f;
        }
        for (size_t i = 0; i < 2; ++i) {
            c->uvs[2 * (first + v) + i] = part->uvs ? part->uvs[2 * v + i] : 0.0f;
        }
        if (!vec3_within_reach(part->positions + 3 * v)) {
            return scene_fail(r->error, r->path, VEC3_TOO_FAR);
        }
    }
    memset(c->influences + first, 0, count * sizeof *c->influences);
    for (int w = 0; w < part->weight_count; ++w) {
        const struct scene_weight *weight = &part->weights[w];
        influences_add(&c->influences[first + (size_t)weight->vertex], part->bones[weight->bone].node, weight->weight);
    }
    c->vertex_count += part->vertex_count;
    return true;
}

static bool add_part(struct reader *r, const struct scene_part *part)
{
    struct character *c = r->character;
    const int first = c->vertex_count, first_triangle = c->triangle_count;
    if (!add_vertices(r, part)) {
        return false;
    }
    for (int t = 0; t < part->triangle_count; ++t) {
        for (int k = 0; k < 3; ++k) {
            c->triangles[3 * c->triangle_count + k] = first + part->triangles[3 * t + k];
        }
        c->materials_of[c->triangle_count++] = part->material >= 0 ? part->material : c->material_count - 1;
    }
    if (!part->normals && !character_smooth(c, first, first_triangle)) {
        return no_memory(r);
    }
    c->part_count += part->triangle_count > 0;
    return bring_vertices(r, part, first, first_triangle);
}

/* Returns true if the name contains one of the words, ignoring case. */
static bool named(const char *name, const char *words)
{
    while (*words) {
        const size_t length = strcspn(words, ",");
        for (const char *at = name; length > 0 && *at; ++at) {
            size_t k = 0;
            while (k < length && tolower((unsigned char)at[k]) == tolower((unsigned char)words[k])) {
                ++k;
            }
            if (k == length) {
                return true;
            }
        }
        words += length + (words[length] == ',');
    }
    return false;
}

/* Selects skinned parts; rigid ones only if they are requested or if there is nothing else. */
static bool wanted(struct reader *r, const struct scene_part *part, const char *props)
{
    return part->bone_count > 0 || !r->character->skinned
           || (props && (strcmp(props, "all") == 0 || named(r->character->joints[part->node].name, props)));
}

bool character_has_prop(const struct character *character, const char *name)
{
    bool found = false;
    for (int p = 0; p < character->prop_count; ++p) { found = found || named(character->props[p], name); }
    return found;
}

/* Removes materials that no triangle has, and images that no material has left. */
static bool drop_unused_materials(struct reader *r)
{
    struct character *c = r->character;
    int *number = calloc((size_t)c->material_count + (size_t)c->picture_count + 1, sizeof *number), count = 0;
    if (!number) {
        return no_memory(r);
    }
    int *picture_number = number + c->material_count;
    for (int t = 0; t < c->triangle_count; ++t) {
        number[c->materials_of[t]] = 1;
    }
    for (int m = 0; m < c->material_count; ++m) {
        if (number[m] && c->materials[m].image >= 0) {
            picture_number[c->materials[m].image] = 1;
        }
        number[m] = number[m] ? count++ : -1;
        if (number[m] >= 0) {
            c->materials[number[m]] = c->materials[m];
        }
    }
    c->material_count = count;
    count = 0;
    for (int p = 0; p < c->picture_count; ++p) {
        if (picture_number[p]) {
            picture_number[p] = count;
            c->pictures[count++] = c->pictures[p];
        } else {
            picture_free(&c->pictures[p]);
        }
    }
    c->picture_count = count;
    for (int m = 0; m < c->material_count; ++m) {
        c->materials[m].image = c->materials[m].image >= 0 ? picture_number[c->materials[m].image] : -1;
    }
    for (int t = 0; t < c->triangle_count; ++t) {
        c->materials_of[t] = number[c->materials_of[t]];
    }
    free(number);
    return true;
}

/* Returns whether two vertices differ. */
static bool has_size(const struct character *c)
{
    for (int i = 3; i < 3 * c->vertex_count; ++i) {
        if (c->positions[i] != c->positions[i % 3]) { return true; }
    }
    return false;
}

static bool read_parts(struct reader *r, const char *props)
{
    struct character *c = r->character;
    size_t vertices = 0, triangles = 0, rigid = 0;
    for (int p = 0; p < r->scene.part_count; ++p) {
        const struct scene_part *part = &r->scene.parts[p];
        c->skinned = c->skinned || part->bone_count > 0;
        vertices += (size_t)part->vertex_count;
        triangles += (size_t)part->triangle_count;
        rigid += part->bone_count == 0;
    }
    if (triangles == 0 || vertices > INT32_MAX / 16 || triangles > INT32_MAX / 16) {
        return scene_fail(r->error, r->path, triangles == 0 ? "no triangles" : "too many triangles");
    }
    c->props = calloc(rigid + 1, sizeof *c->props);
    c->positions = malloc(3 * vertices * sizeof *c->positions);
    c->uvs = malloc(2 * vertices * sizeof *c->uvs);
    c->colors = malloc(3 * vertices * sizeof *c->colors);
    c->influences = malloc(vertices * sizeof *c->influences);
    c->triangles = malloc(3 * triangles * sizeof *c->triangles);
    c->materials_of = malloc(triangles * sizeof *c->materials_of);
    c->normals = malloc(3 * vertices * sizeof *c->normals);
    if (!c->positions || !c->normals || !c->uvs || !c->colors || !c->influences || !c->triangles || !c->materials_of || !c->props) {
        return no_memory(r);
    }
    bool good = take_materials(r);
    for (int p = 0; good && p < r->scene.part_count; ++p) {
        const struct scene_part *part = &r->scene.parts[p];
        if (c->skinned && part->bone_count == 0) {
            memcpy(c->props[c->prop_count++], c->joints[part->node].name, CHARACTER_NAME);
        }
        good = !wanted(r, part, props) || add_part(r, part);
    }
    return good && (c->triangle_count > 0 || scene_fail(r->error, r->path, "no triangles"))
        && (has_size(c) || scene_fail(r->error, r->path, "the body has no size")) && drop_unused_materials(r);
}

/* ---- all ---- */

static bool read_scene(struct reader *r, const char *props)
{
    struct character *c = r->character;
    const int count = r->scene.node_count;
    if (count > MAX_JOINTS) {
        return scene_fail(r->error, r->path, "too many nodes");
    }
    c->joints = calloc((size_t)count + 1, sizeof *c->joints);
    r->rest = calloc((size_t)count + 1, sizeof *r->rest);
    r->bound = calloc((size_t)count + 1, sizeof *r->bound);
    if (!c->joints || !r->rest || !r->bound) {
        return no_memory(r);
    }
    c->animations = r->scene.animations;
    c->animation_count = r->scene.animation_count;
    r->scene.animations = NULL;
    r->scene.animation_count = 0;
    return add_joints(r) && bind_joints(r) && read_parts(r, props);
}

bool character_read(const char *path, const char *props, struct character *character, char error[CHARACTER_TEXT])
{
    struct reader r = {.path = path, .character = character, .error = error};
    memset(character, 0, sizeof *character);
    if (!scene_read(path, SCENE_ALL, &r.scene, error)) {
        return false;
    }
    const bool good = read_scene(&r, props);
    scene_free(&r.scene);
    free(r.rest);
    free(r.bound);
    if (!good) {
        character_free(character);
    }
    return good;
}
