#include "character/gltf_character.h"

#include "surface/gltf_builder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- weights ---- */

static void largest_four(const struct influences *in, const int *bone_of, uint16_t joints[4], float weights[4])
{
    struct influences left = *in;
    float sum = 0.0f;
    for (int n = 0; n < 4; ++n) {
        int best = 0;
        for (int k = 1; k < CHARACTER_BONES; ++k) {
            best = left.weight[k] > left.weight[best] ? k : best;
        }
        weights[n] = left.weight[best];
        joints[n] = weights[n] > 0.0f ? (uint16_t)bone_of[left.joint[best]] : 0;
        left.weight[best] = 0.0f;
        sum += weights[n];
    }
    for (int n = 0; n < 4; ++n) {
        weights[n] /= sum;
    }
}

/* ---- skeleton ---- */

static struct affine local_neutral(const struct character *c, int joint)
{
    const int parent = c->joints[joint].parent;
    if (parent < 0) {
        return c->joints[joint].neutral;
    }
    const struct affine up = affine_inverse(&c->joints[parent].neutral);
    return affine_after(&up, &c->joints[joint].neutral);
}

/* Numbers the bones of the skin: joints with weights, and those above them. Returns how many; bone_of: one a joint, or -1. */
static int number_bones(const struct character *c, const struct influences *influences, int vertex_count, int *bone_of)
{
    int count = 0;
    for (int j = 0; j < c->joint_count; ++j) {
        bone_of[j] = -1;
    }
    for (int v = 0; v < vertex_count; ++v) {
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (influences[v].weight[k] > 0.0f) {
                bone_of[influences[v].joint[k]] = 0;
            }
        }
    }
    for (int j = c->joint_count - 1; j > 0; --j) {
        if (bone_of[j] == 0 && c->joints[j].parent > 0) {
            bone_of[c->joints[j].parent] = 0;
        }
    }
    for (int j = 0; j < c->joint_count; ++j) {
        bone_of[j] = bone_of[j] == 0 ? count++ : -1;
    }
    return count;
}

static void add_nodes(struct gltf *g, const struct character *c)
{
    for (int j = 0; j < c->joint_count; ++j) {
        const struct affine local = local_neutral(c, j);
        const struct placement p = placement_of(&local);
        const double xyzw[4] = {p.rotation[1], p.rotation[2], p.rotation[3], p.rotation[0]};
        cJSON *node = gltf_add(g, "nodes", NULL), *children = cJSON_CreateArray();
        cJSON_AddStringToObject(node, "name", c->joints[j].name);
        gltf_numbers(node, "translation", p.translation, 3);
        gltf_numbers(node, "rotation", xyzw, 4);
        gltf_numbers(node, "scale", p.scale, 3);
        for (int k = j + 1; k < c->joint_count; ++k) {
            if (c->joints[k].parent == j) {
                cJSON_AddItemToArray(children, cJSON_CreateNumber(k));
            }
        }
        if (cJSON_GetArraySize(children) > 0) {
            cJSON_AddItemToObject(node, "children", children);
        } else {
            cJSON_Delete(children);
        }
    }
}

static void add_skin(struct gltf *g, const struct character *c, const int *bone_of, int bones)
{
    float *matrices = malloc(16 * (size_t)bones * sizeof *matrices + 1);
    cJSON *skin = gltf_add(g, "skins", NULL), *joints = cJSON_AddArrayToObject(skin, "joints");
    g->failed = g->failed || !matrices;
    for (int j = 0; matrices && j < c->joint_count; ++j) {
        if (bone_of[j] < 0) {
            continue;
        }
        const struct affine back = affine_inverse(&c->joints[j].neutral);
        cJSON_AddItemToArray(joints, cJSON_CreateNumber(j));
        for (int i = 0; i < 16; ++i) { /* column-major */
            matrices[16 * bone_of[j] + i] = i % 4 == 3 ? (float)(i == 15) : (float)back.m[4 * (i % 4) + i / 4];
        }
    }
    if (matrices) {
        gltf_number(skin, "inverseBindMatrices", gltf_floats(g, matrices, bones, 16, GLTF_NO_TARGET, false));
    }
    free(matrices);
}

/* ---- clips ---- */

/* Key times as glTF wants them: at least 0 and strictly rising; groups: of values a key, 3 where it has tangents. */
struct track {
    float *times, *values;
    int count, groups;
};

static bool take_keys(const struct keys *keys, int width, struct track *track)
{
    const int numbers = keys_width(keys, width);
    track->count = 0;
    track->groups = numbers / width;
    track->times = malloc(((size_t)keys->count + 1) * sizeof *track->times);
    track->values = malloc((size_t)numbers * ((size_t)keys->count + 1) * sizeof *track->values);
    if (!track->times || !track->values) {
        return false;
    }
    for (int k = 0; k < keys->count; ++k) {
        const float time = (float)keys->times[k];
        if (time < 0.0f || (track->count > 0 && time <= track->times[track->count - 1])) {
            continue;
        }
        for (int i = 0; i < numbers; ++i) { /* quaternions are stored w, x, y, z */
            const int from = width == 4 ? i - i % 4 + (i + 1) % 4 : i;
            track->values[numbers * track->count + i] = (float)keys->values[numbers * k + from];
        }
        track->times[track->count++] = time;
    }
    return true;
}

/* Keeps one key where all are equal and have no tangents. */
static void shorten(struct track *track, int width)
{
    if (track->groups > 1) {
        return;
    }
    for (int i = width; i < width * track->count; ++i) {
        if (track->values[i] != track->values[i % width]) {
            return;
        }
    }
    track->count = track->count > 0;
}

/* A clip that is being written. Many of its tracks have the same key times, which are stored once. */
struct clip {
    cJSON *json;
    float *times;
    int count, accessor;
};

static int times_accessor(struct gltf *g, struct clip *clip, struct track *track)
{
    const size_t size = (size_t)track->count * sizeof *track->times;
    if (clip->count != track->count || memcmp(clip->times, track->times, size) != 0) {
        free(clip->times);
        clip->times = track->times;
        clip->count = track->count;
        clip->accessor = gltf_floats(g, track->times, track->count, 1, GLTF_NO_TARGET, true);
        track->times = NULL;
    }
    return clip->accessor;
}

/* Adds a property's channel: the clip's keys or, where it has none, the resting joint's; none where the node has these anyway. */
static void add_track(struct gltf *g, struct clip *clip, int node, const char *path, int width, const struct keys *keys,
                      double *rest, const double *neutral)
{
    double start = 0.0, apart = 0.0;
    static const char *const names[] = {"LINEAR", "STEP", "CUBICSPLINE"};
    const struct keys still = {1, &start, rest, KEYS_LINEAR};
    const struct keys *from = keys && keys->count > 0 ? keys : &still;
    struct track track = {NULL, NULL, 0, 1};
    g->failed = g->failed || !take_keys(from, width, &track);
    if (!g->failed) {
        shorten(&track, width);
    }
    for (int i = 0; track.count > 0 && i < width; ++i) {
        const float value = track.values[(track.groups > 1 ? width : 0) + i];
        apart = fmax(apart, fabs((double)value - neutral[width == 4 ? (i + 1) % 4 : i]));
    }
    if (track.count > 1 || apart > 1e-6) {
        const int times = times_accessor(g, clip, &track);
        gltf_channel(g, clip->json, node, path, times, track.values, track.count * track.groups, width,
                     names[from->interpolation]);
    }
    free(track.times);
    free(track.values);
}

static void add_clip(struct gltf *g, const struct character *c, const struct animation *animation)
{
    struct clip clip = {gltf_animation(g, animation->name[0] ? animation->name : "animation"), NULL, 0, 0};
    for (int j = 0; j < c->joint_count; ++j) {
        const struct affine local = local_neutral(c, j);
        const struct placement neutral = placement_of(&local);
        struct placement rest = c->joints[j].rest;
        const struct channel *channel = NULL;
        for (int k = 0; k < animation->channel_count; ++k) {
            channel = animation->channels[k].joint == j ? &animation->channels[k] : channel;
        }
        add_track(g, &clip, j, "translation", 3, channel ? &channel->translation : NULL, rest.translation, neutral.translation);
        add_track(g, &clip, j, "rotation", 4, channel ? &channel->rotation : NULL, rest.rotation, neutral.rotation);
        add_track(g, &clip, j, "scale", 3, channel ? &channel->scale : NULL, rest.scale, neutral.scale);
    }
    if (cJSON_GetArraySize(cJSON_GetObjectItem(clip.json, "channels")) == 0) { /* glTF has no clip without a channel */
        cJSON *clips = cJSON_GetObjectItem(g->root, "animations");
        cJSON_DeleteItemFromArray(clips, cJSON_GetArraySize(clips) - 1);
        if (cJSON_GetArraySize(clips) == 0) {
            cJSON_DeleteItemFromObject(g->root, "animations");
        }
    }
    free(clip.times);
}

/* ---- all ---- */

static void set_roots(struct gltf *g, const struct character *c, int body)
{
    int *roots = malloc(((size_t)c->joint_count + 1) * sizeof *roots), count = 0;
    g->failed = g->failed || !roots;
    for (int j = 0; roots && j < c->joint_count; ++j) {
        if (c->joints[j].parent < 0) {
            roots[count++] = j;
        }
    }
    if (roots) {
        roots[count++] = body;
        gltf_scene(g, roots, count);
    }
    free(roots);
}

bool gltf_write_skinned(const char *path, const struct gltf_mesh *mesh, const struct influences *influences,
                        const struct gltf_look *look, const struct character *c)
{
    struct gltf g;
    struct gltf_mesh skinned = *mesh;
    int *bone_of = malloc(((size_t)c->joint_count + 1) * sizeof *bone_of), body;
    uint16_t *joints = malloc(8 * (size_t)mesh->vertex_count + 8);
    float *weights = malloc(16 * (size_t)mesh->vertex_count + 16);
    gltf_begin(&g);
    g.failed = !bone_of || !joints || !weights;
    if (!g.failed) {
        const int bones = number_bones(c, influences, mesh->vertex_count, bone_of);
        for (int v = 0; v < mesh->vertex_count; ++v) {
            largest_four(&influences[v], bone_of, joints + 4 * v, weights + 4 * v);
        }
        skinned.joints = joints;
        skinned.weights = weights;
        gltf_mesh(&g, &skinned, look, gltf_materials(&g, look));
        add_nodes(&g, c);
        add_skin(&g, c, bone_of, bones);
        cJSON *node = gltf_add(&g, "nodes", &body);
        cJSON_AddStringToObject(node, "name", "body");
        gltf_number(node, "mesh", 0);
        gltf_number(node, "skin", 0);
        for (int a = 0; a < c->animation_count; ++a) {
            add_clip(&g, c, &c->animations[a]);
        }
        set_roots(&g, c, body);
    }
    free(bone_of);
    free(joints);
    free(weights);
    return gltf_finish(&g, path);
}

bool gltf_write_character(const char *path, const struct character *c)
{
    const struct gltf_look look = {c->materials, c->pictures, c->material_count, c->picture_count};
    const struct gltf_mesh mesh = {.positions = c->positions, .normals = c->normals, .uvs = c->uvs,
                                   .colors = character_has_colors(c) ? c->colors : NULL, .triangles = c->triangles,
                                   .materials_of = c->materials_of, .vertex_count = c->vertex_count,
                                   .triangle_count = c->triangle_count};
    return gltf_write_skinned(path, &mesh, c->influences, &look, c);
}
