#include "surface/assimp_scene.h"

#include "surface/ply_check.h"
#include "surface/polygon.h"
#include "surface/scene_files.h"
#include "surface/scene_uv.h"

#include <assimp/cimport.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEEPEST = 512 };

struct reader {
    const char *path;
    const struct aiScene *from;
    struct scene *to;
    const struct aiNode **nodes;    /* of each node */
    struct aiString *picture_names; /* of the images that were read */
    unsigned *uv_set;               /* texture coordinates of each material's image */
    struct uv_map *uv_map;          /* how they are moved */
    enum scene_extent extent;
    char *error;
};

static bool no_memory(struct reader *r) { return scene_fail(r->error, r->path, "not enough memory"); }

static struct affine from_assimp(const struct aiMatrix4x4 *m)
{
    const struct affine a = {{(double)m->a1, (double)m->a2, (double)m->a3, (double)m->a4, (double)m->b1, (double)m->b2,
                              (double)m->b3, (double)m->b4, (double)m->c1, (double)m->c2, (double)m->c3, (double)m->c4}};
    return a;
}

/* ---- nodes ---- */

/* Counts nodes and their parts; returns false where they are too deep. */
static bool count_nodes(const struct aiNode *node, int depth, size_t *nodes, size_t *parts)
{
    ++*nodes;
    *parts += node->mNumMeshes;
    bool good = depth < DEEPEST;
    for (unsigned i = 0; good && i < node->mNumChildren; ++i) {
        good = count_nodes(node->mChildren[i], depth + 1, nodes, parts);
    }
    return good;
}

static void add_nodes(struct reader *r, const struct aiNode *from, int parent)
{
    const int number = r->to->node_count++;
    struct scene_node *node = &r->to->nodes[number];
    node->local = from_assimp(&from->mTransformation);
    node->rest = placement_of(&node->local);
    node->parent = parent;
    snprintf(node->name, sizeof node->name, "%.*s", SCENE_NAME - 1, from->mName.data);
    r->nodes[number] = from;
    for (unsigned i = 0; i < from->mNumChildren; ++i) {
        add_nodes(r, from->mChildren[i], number);
    }
}

/* Finds a node by name; where bones and nodes of parts share a name, a node without parts is preferred. */
static int find_node(const struct reader *r, const char *name)
{
    int found = -1;
    for (int n = 0; n < r->to->node_count; ++n) {
        if (strcmp(r->nodes[n]->mName.data, name) == 0) {
            if (r->nodes[n]->mNumMeshes == 0) {
                return n;
            }
            found = found < 0 ? n : found;
        }
    }
    return found;
}

/* ---- materials ---- */

/* Copies an image of the file; NULL if there is none of that number, or it is not encoded. */
static unsigned char *read_embedded(const struct reader *r, const char *number, size_t *size)
{
    const long texture = strtol(number, NULL, 10);
    if (texture < 0 || (unsigned long)texture >= r->from->mNumTextures || r->from->mTextures[texture]->mHeight != 0) {
        return NULL;
    }
    const struct aiTexture *t = r->from->mTextures[texture];
    unsigned char *bytes = t->mWidth > 0 ? malloc(t->mWidth) : NULL;
    if (bytes) {
        memcpy(bytes, t->pcData, t->mWidth);
        *size = t->mWidth;
    }
    return bytes;
}

/* Finds or reads the image that a material names; returns its number, -1 if it cannot be read. */
static int find_picture(struct reader *r, const struct aiString *name)
{
    struct scene *to = r->to;
    for (int p = 0; p < to->picture_count; ++p) {
        if (strcmp(r->picture_names[p].data, name->data) == 0) {
            return p;
        }
    }
    size_t size = 0;
    unsigned char *bytes = name->data[0] == '*' ? read_embedded(r, name->data + 1, &size)
                                                : scene_read_beside(r->path, name->data, &size);
    if (!scene_take_picture(&to->pictures[to->picture_count], bytes, size)) {
        ++to->missing_pictures;
        return -1;
    }
    r->picture_names[to->picture_count] = *name;
    return to->picture_count++;
}

/* Reads how the coordinates of a material's image are moved. assimp turns them about the image's center, with v upwards, so its
 * shift is another. */
static struct uv_map read_uv_map(const struct aiMaterial *material, enum aiTextureType type)
{
    struct uv_map map = uv_map_none();
    struct aiUVTransform t;
    if (aiGetMaterialUVTransform(material, AI_MATKEY_UVTRANSFORM(type, 0), &t) != aiReturn_SUCCESS || !isfinite(t.mRotation)
        || !isfinite(t.mTranslation.x + t.mTranslation.y) || !isfinite(t.mScaling.x + t.mScaling.y)) {
        return map;
    }
    map.cosine = cosf(t.mRotation);
    map.sine = -sinf(t.mRotation);
    map.scale[0] = t.mScaling.x;
    map.scale[1] = t.mScaling.y;
    map.offset[0] = t.mTranslation.x - 0.5f * map.scale[0] * (1.0f - map.cosine + map.sine);
    map.offset[1] = 1.0f - map.scale[1] + 0.5f * map.scale[1] * (map.sine + map.cosine - 1.0f) - t.mTranslation.y;
    return map;
}

/* Reads how a material looks: its color and the image of it. These formats have no metal. */
static void read_material(struct reader *r, unsigned number)
{
    struct material *made = &r->to->materials[number];
    const struct aiMaterial *material = r->from->mMaterials[number];
    struct aiColor4D base = {1.0f, 1.0f, 1.0f, 1.0f};
    struct aiString name;
    int two_sided = 0;
    *made = material_plain();
    if (aiGetMaterialString(material, AI_MATKEY_NAME, &name) == aiReturn_SUCCESS) {
        snprintf(made->name, sizeof made->name, "%.*s", MATERIAL_NAME - 1, name.data);
    }
    if (aiGetMaterialColor(material, AI_MATKEY_BASE_COLOR, &base) != aiReturn_SUCCESS) {
        aiGetMaterialColor(material, AI_MATKEY_COLOR_DIFFUSE, &base);
    }
    const float rgba[4] = {base.r, base.g, base.b, base.a};
    for (int i = 0; i < 4; ++i) {
        made->base[i] = isfinite(rgba[i]) ? fmaxf(0.0f, fminf(1.0f, rgba[i])) : 1.0f;
    }
    if (aiGetMaterialIntegerArray(material, AI_MATKEY_TWOSIDED, &two_sided, NULL) == aiReturn_SUCCESS) {
        made->two_sided = two_sided != 0;
    }
    const enum aiTextureType types[2] = {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE};
    r->uv_map[number] = uv_map_none();
    for (int t = 0, found = 0; t < 2 && !found && r->extent == SCENE_ALL; ++t) {
        r->uv_map[number] = read_uv_map(material, types[t]);
        found = aiGetMaterialTexture(material, types[t], 0, &name, NULL, &r->uv_set[number], NULL, NULL, NULL, NULL)
            == aiReturn_SUCCESS;
        made->image = found ? find_picture(r, &name) : made->image;
    }
}

static bool read_materials(struct reader *r)
{
    struct scene *to = r->to;
    const size_t count = r->from->mNumMaterials;
    to->materials = calloc(count + 1, sizeof *to->materials);
    to->pictures = calloc(count + 1, sizeof *to->pictures);
    r->picture_names = calloc(count + 1, sizeof *r->picture_names);
    r->uv_set = calloc(count + 1, sizeof *r->uv_set);
    r->uv_map = calloc(count + 1, sizeof *r->uv_map);
    if (!to->materials || !to->pictures || !r->picture_names || !r->uv_set || !r->uv_map) {
        return no_memory(r);
    }
    for (unsigned m = 0; m < count; ++m) {
        read_material(r, m);
    }
    to->material_count = (int)count;
    return true;
}

/* ---- parts ---- */

static float *copy_vectors(const struct aiVector3D *from, unsigned count)
{
    float *made = malloc(3 * ((size_t)count + 1) * sizeof *made);
    for (size_t v = 0; made && v < count; ++v) {
        made[3 * v] = from[v].x, made[3 * v + 1] = from[v].y, made[3 * v + 2] = from[v].z;
    }
    return made;
}

static bool read_vertices(struct reader *r, const struct aiMesh *from, struct scene_part *part)
{
    const unsigned count = from->mNumVertices, set = part->material >= 0 ? r->uv_set[part->material] : 0;
    const struct aiVector3D *uvs = set < AI_MAX_NUMBER_OF_TEXTURECOORDS ? from->mTextureCoords[set] : NULL;
    const struct aiColor4D *colors = from->mColors[0];
    const struct uv_map none = uv_map_none(), *map = part->material >= 0 ? &r->uv_map[part->material] : &none;
    part->positions = copy_vectors(from->mVertices, count);
    part->normals = from->mNormals ? copy_vectors(from->mNormals, count) : NULL;
    part->uvs = uvs ? malloc(2 * ((size_t)count + 1) * sizeof *part->uvs) : NULL;
    part->colors = colors ? malloc(3 * ((size_t)count + 1) * sizeof *part->colors) : NULL;
    if (!part->positions || (from->mNormals && !part->normals) || (uvs && !part->uvs) || (colors && !part->colors)) {
        return no_memory(r);
    }
    part->vertex_count = (int)count;
    for (size_t v = 0; v < count; ++v) {
        if (uvs) {
            uv_map_apply(map, uvs[v].x, 1.0f - uvs[v].y, part->uvs + 2 * v); /* assimp's v runs upwards */
        }
        if (colors) {
            part->colors[3 * v] = colors[v].r, part->colors[3 * v + 1] = colors[v].g, part->colors[3 * v + 2] = colors[v].b;
        }
    }
    return true;
}

/* Cuts a face and adds its triangles to a part. Points and lines have none. */
static bool add_face(const struct aiMesh *from, const struct aiFace *face, double *places, struct scene_part *part)
{
    const size_t count = face->mNumIndices;
    int *triangles = part->triangles + 3 * (size_t)part->triangle_count;
    if (count < 3) {
        return true;
    }
    for (size_t k = 0; k < count; ++k) {
        const struct aiVector3D *v = &from->mVertices[face->mIndices[k]];
        places[3 * k] = (double)v->x, places[3 * k + 1] = (double)v->y, places[3 * k + 2] = (double)v->z;
    }
    const bool fine = polygon_cut(places, count, triangles);
    for (size_t i = 0; fine && i < 3 * (count - 2); ++i) {
        triangles[i] = (int)face->mIndices[triangles[i]];
    }
    part->triangle_count += (int)count - 2;
    return fine;
}

static bool read_triangles(struct reader *r, const struct aiMesh *from, struct scene_part *part)
{
    size_t most = 0, triangles = 0;
    for (unsigned f = 0; f < from->mNumFaces; ++f) {
        const size_t count = from->mFaces[f].mNumIndices;
        most = count > most ? count : most;
        triangles += count > 2 ? count - 2 : 0;
    }
    if (triangles > INT32_MAX / 16) {
        return scene_fail(r->error, r->path, "too many triangles");
    }
    double *places = malloc((3 * most + 1) * sizeof *places);
    part->triangles = malloc((3 * triangles + 1) * sizeof *part->triangles);
    bool fine = places && part->triangles;
    for (unsigned f = 0; fine && f < from->mNumFaces; ++f) {
        fine = add_face(from, &from->mFaces[f], places, part);
    }
    free(places);
    return fine || no_memory(r);
}

static bool read_bones(struct reader *r, const struct aiMesh *from, struct scene_part *part)
{
    size_t weights = 0;
    for (unsigned b = 0; b < from->mNumBones; ++b) {
        weights += from->mBones[b]->mNumWeights;
    }
    part->bones = malloc(((size_t)from->mNumBones + 1) * sizeof *part->bones);
    part->weights = weights < INT32_MAX ? malloc((weights + 1) * sizeof *part->weights) : NULL;
    if (!part->bones || !part->weights) {
        return no_memory(r);
    }
    for (unsigned b = 0; b < from->mNumBones; ++b) {
        const struct aiBone *bone = from->mBones[b];
        const struct scene_bone made = {find_node(r, bone->mName.data), from_assimp(&bone->mOffsetMatrix)};
        if (made.node < 0) {
            return scene_fail(r->error, r->path, "bone %.60s has no node", bone->mName.data);
        }
        part->bones[part->bone_count++] = made;
        for (unsigned w = 0; w < bone->mNumWeights; ++w) {
            const struct aiVertexWeight *weight = &bone->mWeights[w];
            if (weight->mVertexId >= from->mNumVertices || !isfinite(weight->mWeight) || weight->mWeight < 0.0f) {
                return scene_fail(r->error, r->path, "bone %.60s: a weight that is negative or not finite, or vertex %u of %u",
                                  bone->mName.data, weight->mVertexId, from->mNumVertices);
            }
            const struct scene_weight one = {(int)weight->mVertexId, (int)b, weight->mWeight};
            part->weights[part->weight_count++] = one;
        }
    }
    return true;
}

static bool read_part(struct reader *r, int node, unsigned number)
{
    const struct aiMesh *from = r->from->mMeshes[number];
    struct scene_part *part = &r->to->parts[r->to->part_count++];
    part->node = node;
    part->material = from->mMaterialIndex < r->from->mNumMaterials ? (int)from->mMaterialIndex : -1;
    if (from->mNumVertices > INT32_MAX / 16) {
        return scene_fail(r->error, r->path, "too many triangles");
    }
    return read_vertices(r, from, part) && read_triangles(r, from, part) && read_bones(r, from, part);
}

/* ---- animations ---- */

static bool make_keys(struct reader *r, struct keys *keys, unsigned count, size_t width)
{
    keys->times = malloc(((size_t)count + 1) * sizeof *keys->times);
    keys->values = malloc(width * ((size_t)count + 1) * sizeof *keys->values);
    return (keys->times && keys->values) || no_memory(r);
}

static bool read_vectors(struct reader *r, const struct aiVectorKey *from, unsigned count, double second, struct keys *keys)
{
    bool good = make_keys(r, keys, count, 3);
    for (unsigned k = 0; good && k < count; ++k) {
        const double value[3] = {(double)from[k].mValue.x, (double)from[k].mValue.y, (double)from[k].mValue.z};
        keys->times[k] = from[k].mTime / second;
        memcpy(keys->values + 3 * k, value, sizeof value);
        good = (isfinite(keys->times[k]) && isfinite(value[0] + value[1] + value[2]))
            || scene_fail(r->error, r->path, "a key is not finite");
    }
    keys->count = good ? (int)count : 0;
    return good;
}

static bool read_rotations(struct reader *r, const struct aiQuatKey *from, unsigned count, double second, struct keys *keys)
{
    bool good = make_keys(r, keys, count, 4);
    for (unsigned k = 0; good && k < count; ++k) {
        const double q[4] = {(double)from[k].mValue.w, (double)from[k].mValue.x, (double)from[k].mValue.y,
                             (double)from[k].mValue.z};
        keys->times[k] = from[k].mTime / second;
        quaternion_slerp(q, q, 0.0, keys->values + 4 * k); /* of length 1 */
        good = (isfinite(keys->times[k]) && isfinite(q[0] + q[1] + q[2] + q[3]))
            || scene_fail(r->error, r->path, "a key is not finite");
    }
    keys->count = good ? (int)count : 0;
    return good;
}

static bool read_animation(struct reader *r, const struct aiAnimation *from, struct animation *to)
{
    const double second = from->mTicksPerSecond > 0.0 ? from->mTicksPerSecond : 1.0; /* ticks */
    snprintf(to->name, sizeof to->name, "%.*s", ANIMATION_NAME - 1, from->mName.data);
    to->duration = from->mDuration / second;
    to->channels = calloc((size_t)from->mNumChannels + 1, sizeof *to->channels);
    if (!to->channels) {
        return no_memory(r);
    }
    bool good = isfinite(to->duration) || scene_fail(r->error, r->path, "animation %.60s: its length is not finite", to->name);
    for (unsigned k = 0; good && k < from->mNumChannels; ++k) {
        const struct aiNodeAnim *node = from->mChannels[k];
        struct channel *channel = &to->channels[to->channel_count++];
        channel->joint = find_node(r, node->mNodeName.data);
        good = read_vectors(r, node->mPositionKeys, node->mNumPositionKeys, second, &channel->translation)
               && read_rotations(r, node->mRotationKeys, node->mNumRotationKeys, second, &channel->rotation)
               && read_vectors(r, node->mScalingKeys, node->mNumScalingKeys, second, &channel->scale);
    }
    return good;
}

static bool read_animations(struct reader *r)
{
    struct scene *to = r->to;
    to->animations = calloc((size_t)r->from->mNumAnimations + 1, sizeof *to->animations);
    bool good = to->animations || no_memory(r);
    for (unsigned a = 0; good && a < r->from->mNumAnimations; ++a) {
        good = read_animation(r, r->from->mAnimations[a], &to->animations[to->animation_count++]);
    }
    return good;
}

/* ---- all ---- */

static bool convert(struct reader *r)
{
    struct scene *to = r->to;
    size_t nodes = 0, parts = 0;
    if (!r->from->mRootNode || !count_nodes(r->from->mRootNode, 0, &nodes, &parts) || nodes > INT32_MAX || parts > INT32_MAX) {
        return scene_fail(r->error, r->path, nodes == 0 ? "no nodes" : "nodes within themselves, or too many");
    }
    to->nodes = calloc(nodes, sizeof *to->nodes);
    to->parts = calloc(parts + 1, sizeof *to->parts);
    r->nodes = calloc(nodes, sizeof *r->nodes);
    if (!to->nodes || !to->parts || !r->nodes) {
        return no_memory(r);
    }
    add_nodes(r, r->from->mRootNode, -1);
    bool good = read_materials(r);
    for (int n = 0; good && n < to->node_count; ++n) {
        for (unsigned m = 0; good && m < r->nodes[n]->mNumMeshes; ++m) {
            good = read_part(r, n, r->nodes[n]->mMeshes[m]);
        }
    }
    return good && (r->extent == SCENE_SHAPE || read_animations(r));
}

/* Returns whether all faces have corners, which are vertices that there are. */
static bool faces_are_good(const struct aiScene *scene, const char *path, char error[SCENE_TEXT])
{
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *part = scene->mMeshes[m];
        for (unsigned f = 0; f < part->mNumFaces; ++f) {
            const struct aiFace *face = &part->mFaces[f];
            if (face->mNumIndices == 0) {
                return scene_fail(error, path, "a face has no corners");
            }
            for (unsigned k = 0; k < face->mNumIndices; ++k) {
                if (face->mIndices[k] >= part->mNumVertices) {
                    return scene_fail(error, path, "a face names vertex %d of %u", (int)face->mIndices[k], part->mNumVertices);
                }
            }
        }
    }
    return true;
}

/* A file as assimp is to read it: from `bytes` where these are not NULL. */
struct source {
    const char *path;
    unsigned char *bytes;
    size_t size;
};

/* Returns where the elements of a binary PLY file begin if assimp would lose that place, else 0. It ends the header at the first line end
 * of any kind, and passes over another one, which may be the first byte of a number. */
static long elements_to_guard(FILE *file)
{
    static const char plain[] = "\nend_header\n";
    char end[sizeof plain]; /* and one byte of the elements */
    const long elements = ply_binary_elements(file);
    if (elements == 0 || fseek(file, elements - (long)strlen(plain), SEEK_SET) != 0 || fread(end, 1, sizeof end, file) != sizeof end) {
        return 0;
    }
    return memcmp(end, plain, strlen(plain)) == 0 && end[strlen(plain)] != '\n' ? 0 : elements;
}

/* Loads a file that needs it, with a header that has one line end and another one for assimp to pass over. */
static bool guard_first_number(struct source *source, char error[SCENE_TEXT])
{
    FILE *file = fopen(source->path, "rb");
    if (!file) {
        return scene_fail(error, source->path, "cannot open");
    }
    const size_t header = (size_t)elements_to_guard(file);
    fclose(file);
    if (header == 0) {
        return true;
    }
    size_t size;
    unsigned char *bytes = scene_read_file(source->path, &size);
    unsigned char *grown = size >= header ? realloc(bytes, size + 1) : NULL;
    if (!grown) {
        free(bytes);
        return scene_fail(error, source->path, "cannot be loaded whole: not enough memory, or larger than 2 GB");
    }
    memmove(grown + header + 1, grown + header, size - header);
    grown[header] = '\n';
    for (unsigned char *c = grown + header - 2; c > grown && *c != '\n'; --c) { /* behind end_header */
        *c = isspace(*c) ? ' ' : *c;
    }
    source->bytes = grown;
    source->size = size + 1;
    return true;
}

/* None of assimp's steps is taken: they read beyond the vertices where faces are bad, and cut concave polygons with corners in a line
 * wrongly. */
static const struct aiScene *import(const struct source *source, char error[SCENE_TEXT])
{
    const struct aiScene *scene =
        source->bytes ? aiImportFileFromMemory((const char *)source->bytes, (unsigned)source->size, 0, "ply")
                      : aiImportFile(source->path, 0);
    if (!scene) {
        const char *reason = aiGetErrorString();
        scene_fail(error, source->path, "%.180s", reason && *reason ? reason : "cannot be read");
    }
    return scene;
}

bool assimp_scene_read(const char *path, enum scene_extent extent, struct scene *scene, char error[SCENE_TEXT])
{
    struct reader r = {.path = path, .to = scene, .extent = extent, .error = error};
    struct source source = {.path = path};
    if (!guard_first_number(&source, error)) {
        return false;
    }
    r.from = import(&source, error);
    free(source.bytes);
    const bool good = r.from && faces_are_good(r.from, path, error) && convert(&r);
    aiReleaseImport(r.from);
    free(r.nodes);
    free(r.picture_names);
    free(r.uv_set);
    free(r.uv_map);
    return good;
}
