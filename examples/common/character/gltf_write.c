#include "character/gltf_write.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Types of components and targets of buffer views, glTF 2.0 specification, 3.6.2.2. */
enum { USHORT = 5123, UINT = 5125, FLOAT = 5126, VERTICES = 34962, INDICES = 34963 };

struct gltf {
    cJSON *root, *nodes, *meshes, *accessors, *views, *animations;
    unsigned char *bytes;
    size_t used, room;
    bool failed;
};

static cJSON *array(struct gltf *g, const char *name)
{
    cJSON *made = cJSON_AddArrayToObject(g->root, name);
    g->failed = g->failed || !made;
    return made;
}

static cJSON *object(struct gltf *g, cJSON *list)
{
    cJSON *made = cJSON_CreateObject();
    g->failed = g->failed || !made || !cJSON_AddItemToArray(list, made);
    return made;
}

static void number(cJSON *to, const char *name, double value) { cJSON_AddNumberToObject(to, name, value); }

static void doubles(cJSON *to, const char *name, const double *values, int count)
{
    cJSON_AddItemToObject(to, name, cJSON_CreateDoubleArray(values, count));
}

static void *take_bytes(struct gltf *g, size_t size)
{
    const size_t wanted = g->used + size + 4;
    if (wanted > g->room) {
        const size_t room = 2 * wanted;
        unsigned char *grown = realloc(g->bytes, room);
        if (!grown) {
            g->failed = true;
            return NULL;
        }
        g->bytes = grown;
        g->room = room;
    }
    unsigned char *made = g->bytes + g->used;
    memset(made, 0, size + 4);
    g->used += (size + 3) / 4 * 4;
    return made;
}

/* Adds an accessor with a copy of the data, on a little-endian machine, which assimp also assumes. */
static int accessor(struct gltf *g, const void *data, int count, int width, int component, int target, bool normalized)
{
    static const char *const type[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const size_t size = (size_t)count * (size_t)width * (component == USHORT ? 2 : 4), offset = g->used;
    void *bytes = take_bytes(g, size);
    if (!bytes) {
        return 0;
    }
    memcpy(bytes, data, size);
    cJSON *view = object(g, g->views), *made = object(g, g->accessors);
    number(view, "buffer", 0);
    number(view, "byteOffset", (double)offset);
    number(view, "byteLength", (double)size);
    if (target) {
        number(view, "target", target);
    }
    number(made, "bufferView", cJSON_GetArraySize(g->views) - 1);
    number(made, "componentType", component);
    number(made, "count", count);
    cJSON_AddStringToObject(made, "type", width == 16 ? "MAT4" : type[width]);
    if (normalized) {
        cJSON_AddTrueToObject(made, "normalized");
    }
    return cJSON_GetArraySize(g->accessors) - 1;
}

/* Adds an accessor with the bounds that the specification requires for positions and key times. */
static int bounded_accessor(struct gltf *g, const float *data, int count, int width, int target)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    const int made = accessor(g, data, count, width, FLOAT, target, false);
    for (int i = 0; i < count * width; ++i) {
        lo[i % width] = fmin(lo[i % width], (double)data[i]);
        hi[i % width] = fmax(hi[i % width], (double)data[i]);
    }
    doubles(cJSON_GetArrayItem(g->accessors, made), "min", lo, width);
    doubles(cJSON_GetArrayItem(g->accessors, made), "max", hi, width);
    return made;
}

static void begin(struct gltf *g)
{
    memset(g, 0, sizeof *g);
    g->root = cJSON_CreateObject();
    cJSON *asset = cJSON_AddObjectToObject(g->root, "asset");
    cJSON_AddStringToObject(asset, "version", "2.0");
    cJSON_AddStringToObject(asset, "generator", "springls");
    number(g->root, "scene", 0);
    g->nodes = array(g, "nodes");
    g->meshes = array(g, "meshes");
    g->accessors = array(g, "accessors");
    g->views = array(g, "bufferViews");
    cJSON *material = object(g, array(g, "materials")), *pbr = cJSON_AddObjectToObject(material, "pbrMetallicRoughness");
    number(pbr, "metallicFactor", 0);
    number(pbr, "roughnessFactor", 0.9);
}

static bool finish(struct gltf *g, const char *path)
{
    cJSON *buffer = object(g, array(g, "buffers"));
    number(buffer, "byteLength", (double)g->used);
    char *text = g->failed || g->used > UINT32_MAX / 2 ? NULL : cJSON_PrintUnformatted(g->root);
    FILE *file = text ? fopen(path, "wb") : NULL;
    bool good = file != NULL;
    if (good) {
        const size_t length = strlen(text), padded = (length + 3) / 4 * 4;
        const uint32_t head[5] = {0x46546C67u, 2u, (uint32_t)(28 + padded + g->used), (uint32_t)padded, 0x4E4F534Au};
        const uint32_t data[2] = {(uint32_t)g->used, 0x004E4942u};
        good = fwrite(head, 1, sizeof head, file) == sizeof head && fwrite(text, 1, length, file) == length
               && fwrite("   ", 1, padded - length, file) == padded - length
               && fwrite(data, 1, sizeof data, file) == sizeof data && fwrite(g->bytes, 1, g->used, file) == g->used;
        good = fclose(file) == 0 && good;
    }
    cJSON_free(text);
    cJSON_Delete(g->root);
    free(g->bytes);
    return good;
}

/* ---- meshes ---- */

/* Adds vertex colors, which are linear in glTF. */
static void add_colors(struct gltf *g, cJSON *attributes, const struct gltf_mesh *mesh)
{
    uint16_t *linear = malloc(8 * (size_t)mesh->vertex_count + 8);
    g->failed = g->failed || !linear;
    for (int v = 0; linear && v < mesh->vertex_count; ++v) {
        for (int i = 0; i < 3; ++i) {
            linear[4 * v + i] = (uint16_t)(65535.0f * powf(fmaxf(0.0f, fminf(1.0f, mesh->colors[3 * v + i])), 2.2f) + 0.5f);
        }
        linear[4 * v + 3] = 65535;
    }
    if (linear) {
        number(attributes, "COLOR_0", accessor(g, linear, mesh->vertex_count, 4, USHORT, VERTICES, true));
    }
    free(linear);
}

static void largest_four(const struct influences *in, uint16_t joints[4], float weights[4])
{
    struct influences left = *in;
    float sum = 0.0f;
    for (int n = 0; n < 4; ++n) {
        int best = 0;
        for (int k = 1; k < CHARACTER_BONES; ++k) {
            best = left.weight[k] > left.weight[best] ? k : best;
        }
        weights[n] = left.weight[best];
        joints[n] = weights[n] > 0.0f ? (uint16_t)left.joint[best] : 0;
        left.weight[best] = 0.0f;
        sum += weights[n];
    }
    for (int n = 0; n < 4; ++n) {
        weights[n] /= sum;
    }
}

static void add_influences(struct gltf *g, cJSON *attributes, const struct gltf_mesh *mesh)
{
    uint16_t *joints = malloc(8 * (size_t)mesh->vertex_count + 8);
    float *weights = malloc(16 * (size_t)mesh->vertex_count + 16);
    g->failed = g->failed || !joints || !weights;
    for (int v = 0; joints && weights && v < mesh->vertex_count; ++v) {
        largest_four(&mesh->influences[v], joints + 4 * v, weights + 4 * v);
    }
    if (joints && weights) {
        number(attributes, "JOINTS_0", accessor(g, joints, mesh->vertex_count, 4, USHORT, VERTICES, false));
        number(attributes, "WEIGHTS_0", accessor(g, weights, mesh->vertex_count, 4, FLOAT, VERTICES, false));
    }
    free(joints);
    free(weights);
}

static void add_mesh(struct gltf *g, const struct gltf_mesh *mesh)
{
    cJSON *made = object(g, g->meshes);
    cJSON *primitive = object(g, cJSON_AddArrayToObject(made, "primitives"));
    cJSON *attributes = cJSON_AddObjectToObject(primitive, "attributes");
    number(attributes, "POSITION", bounded_accessor(g, mesh->positions, mesh->vertex_count, 3, VERTICES));
    if (mesh->normals) {
        number(attributes, "NORMAL", accessor(g, mesh->normals, mesh->vertex_count, 3, FLOAT, VERTICES, false));
    }
    if (mesh->uvs) {
        number(attributes, "TEXCOORD_0", accessor(g, mesh->uvs, mesh->vertex_count, 2, FLOAT, VERTICES, false));
    }
    if (mesh->colors) {
        add_colors(g, attributes, mesh);
    }
    if (mesh->influences) {
        add_influences(g, attributes, mesh);
    }
    number(primitive, "indices", accessor(g, mesh->triangles, 3 * mesh->triangle_count, 1, UINT, INDICES, false));
    number(primitive, "material", 0);
}

static void add_channel(struct gltf *g, cJSON *animation, int node, const char *path, int times, const float *values, int count,
                        int width, const char *interpolation)
{
    cJSON *samplers = cJSON_GetObjectItem(animation, "samplers");
    cJSON *sampler = object(g, samplers), *channel = object(g, cJSON_GetObjectItem(animation, "channels"));
    number(sampler, "input", times);
    number(sampler, "output", accessor(g, values, count, width, FLOAT, 0, false));
    cJSON_AddStringToObject(sampler, "interpolation", interpolation);
    number(channel, "sampler", cJSON_GetArraySize(samplers) - 1);
    cJSON *target = cJSON_AddObjectToObject(channel, "target");
    number(target, "node", node);
    cJSON_AddStringToObject(target, "path", path);
}

static cJSON *begin_animation(struct gltf *g, const char *name)
{
    cJSON *made = object(g, array(g, "animations"));
    cJSON_AddStringToObject(made, "name", name);
    cJSON_AddArrayToObject(made, "samplers");
    cJSON_AddArrayToObject(made, "channels");
    return made;
}

static void set_scene(struct gltf *g, const int *roots, int count)
{
    cJSON *scene = object(g, array(g, "scenes"));
    cJSON_AddItemToObject(scene, "nodes", cJSON_CreateIntArray(roots, count));
}

bool gltf_write_sequence(const char *path, const struct gltf_mesh *frames, int count, int fps)
{
    struct gltf g;
    begin(&g);
    cJSON *animation = begin_animation(&g, "morph");
    for (int f = 0; f < count; ++f) {
        char name[32];
        snprintf(name, sizeof name, "frame %d", f);
        cJSON *node = object(&g, g.nodes);
        cJSON_AddStringToObject(node, "name", name);
        number(node, "mesh", f);
        add_mesh(&g, &frames[f]);
        /* Each mesh is hidden, shown, hidden; the first frame has no time before and the last none after. */
        const float start = (float)f / (float)fps, end = (float)(f + 1) / (float)fps;
        const float times[3] = {0.0f, start, end}, scales[9] = {0, 0, 0, 1, 1, 1, 0, 0, 0};
        const int skip = f == 0, keys = 3 - skip - (f == count - 1 && count > 1);
        if (f > 0) {
            doubles(node, "scale", (const double[3]){0, 0, 0}, 3);
        }
        add_channel(&g, animation, f, "scale", bounded_accessor(&g, times + skip, keys, 1, 0), scales + 3 * skip, keys, 3,
                    "STEP");
    }
    cJSON *root = object(&g, g.nodes), *children = cJSON_AddArrayToObject(root, "children");
    for (int f = 0; f < count; ++f) {
        cJSON_AddItemToArray(children, cJSON_CreateNumber(f));
    }
    set_scene(&g, &count, 1);
    return finish(&g, path);
}

/* ---- a skinned character ---- */

static struct placement joint_placement(const struct character *character, const struct affine *places, int joint)
{
    const int parent = character->joints[joint].parent;
    struct affine local = places[joint];
    if (parent >= 0) {
        const struct affine up = affine_inverse(&places[parent]);
        local = affine_after(&up, &places[joint]);
    }
    return placement_of(&local);
}

/* Splits a placement for glTF, whose quaternions are x, y, z, w. */
static void spread(const struct placement *p, float translation[3], float rotation[4], float scale[3])
{
    for (int i = 0; i < 3; ++i) {
        translation[i] = (float)p->translation[i];
        scale[i] = (float)p->scale[i];
        rotation[i] = (float)p->rotation[i + 1];
    }
    rotation[3] = (float)p->rotation[0];
}

static void add_joints(struct gltf *g, const struct character *character, struct affine *places)
{
    float *matrices = malloc(16 * (size_t)character->joint_count * sizeof *matrices);
    g->failed = g->failed || !matrices;
    for (int j = 0; matrices && j < character->joint_count; ++j) {
        places[j] = character->joints[j].neutral;
        const struct affine back = affine_inverse(&places[j]);
        for (int i = 0; i < 16; ++i) { /* column-major */
            matrices[16 * j + i] = i % 4 == 3 ? (float)(i == 15) : (float)back.m[4 * (i % 4) + i / 4];
        }
    }
    for (int j = 0; matrices && j < character->joint_count; ++j) {
        cJSON *node = object(g, g->nodes), *children = cJSON_CreateArray();
        const struct placement p = joint_placement(character, places, j);
        const double xyzw[4] = {p.rotation[1], p.rotation[2], p.rotation[3], p.rotation[0]};
        cJSON_AddStringToObject(node, "name", character->joints[j].name);
        doubles(node, "translation", p.translation, 3);
        doubles(node, "rotation", xyzw, 4);
        doubles(node, "scale", p.scale, 3);
        for (int k = j + 1; k < character->joint_count; ++k) {
            if (character->joints[k].parent == j) {
                cJSON_AddItemToArray(children, cJSON_CreateNumber(k));
            }
        }
        if (cJSON_GetArraySize(children) > 0) {
            cJSON_AddItemToObject(node, "children", children);
        } else {
            cJSON_Delete(children);
        }
    }
    cJSON *skin = object(g, array(g, "skins")), *joints = cJSON_AddArrayToObject(skin, "joints");
    for (int j = 0; j < character->joint_count; ++j) {
        cJSON_AddItemToArray(joints, cJSON_CreateNumber(j));
    }
    if (matrices) {
        number(skin, "inverseBindMatrices", accessor(g, matrices, character->joint_count, 16, FLOAT, 0, false));
    }
    free(matrices);
}

static void add_motion(struct gltf *g, const struct character *character, int number_of, int fps, struct affine *places)
{
    const struct animation *animation = &character->animations[number_of];
    const int keys = (int)fmin(10000.0, ceil(animation->duration * fps)) + 1;
    const size_t joints = (size_t)character->joint_count;
    float *values = malloc(10 * (size_t)keys * joints * sizeof *values), *times = malloc((size_t)keys * sizeof *times);
    struct affine *skin = malloc(joints * sizeof *skin);
    g->failed = g->failed || !values || !times || !skin;
    for (int k = 0; !g->failed && k < keys; ++k) {
        times[k] = (float)fmin((double)k / fps, 0.9999 * animation->duration); /* the end of the animation is its beginning */
        character_pose(character, number_of, (double)times[k], 1.0, skin, places);
        for (int j = 0; j < character->joint_count; ++j) {
            const struct placement p = joint_placement(character, places, j);
            float *t = values + 10 * (size_t)keys * (size_t)j, *r = t + 3 * keys, *s = r + 4 * keys;
            spread(&p, t + 3 * k, r + 4 * k, s + 3 * k);
        }
    }
    if (!g->failed) {
        cJSON *made = begin_animation(g, animation->name[0] ? animation->name : "animation");
        const int input = bounded_accessor(g, times, keys, 1, 0);
        for (int j = 0; j < character->joint_count; ++j) {
            const float *t = values + 10 * (size_t)keys * (size_t)j, *r = t + 3 * keys, *s = r + 4 * keys;
            add_channel(g, made, j, "translation", input, t, keys, 3, "LINEAR");
            add_channel(g, made, j, "rotation", input, r, keys, 4, "LINEAR");
            add_channel(g, made, j, "scale", input, s, keys, 3, "LINEAR");
        }
    }
    free(values);
    free(times);
    free(skin);
}

bool gltf_write_skinned(const char *path, const struct gltf_mesh *mesh, const struct character *character, int animation, int fps)
{
    struct gltf g;
    int roots[64], count = 0;
    struct affine *places = malloc((size_t)character->joint_count * sizeof *places);
    if (!places) {
        return false;
    }
    begin(&g);
    add_mesh(&g, mesh);
    add_joints(&g, character, places);
    for (int j = 0; j < character->joint_count && count < 63; ++j) {
        if (character->joints[j].parent < 0) {
            roots[count++] = j;
        }
    }
    cJSON *node = object(&g, g.nodes);
    cJSON_AddStringToObject(node, "name", "body");
    number(node, "mesh", 0);
    number(node, "skin", 0);
    roots[count++] = character->joint_count;
    if (animation >= 0) {
        add_motion(&g, character, animation, fps, places);
    }
    set_scene(&g, roots, count);
    free(places);
    return finish(&g, path);
}
