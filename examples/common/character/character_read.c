/* character_read.c - reads a character from a file through assimp.
 *
 * Parts may be bound in different spaces (inverse bind matrices of several skins). The first part that uses a joint determines
 * the joint's neutral placement, and all vertices are transformed to that pose. */
#include "character/character.h"

#include "base/vec3.h"
#include "surface/scene_read.h"

#include <assimp/cimport.h>
#include <assimp/material.h>
#include <assimp/scene.h>

#include <ctype.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_JOINTS = 4096 };

/* Fails to compile unless both texts have the same length. */
typedef char same_length[CHARACTER_TEXT == (int)SCENE_TEXT ? 1 : -1];

/* An affine map of texture coordinates as glTF has them, v downwards (KHR_texture_transform): scale, then rotation, then offset. */
struct uv_map {
    float offset[2], cosine, sine, scale[2];
};

struct reader {
    const char *path;
    const struct aiScene *scene;
    struct character *character;
    const struct aiNode **nodes; /* node of each joint */
    struct affine *rest;         /* placement of each joint when nothing moves it */
    bool *bound;                 /* joints whose neutral placement a part has determined */
    struct aiString *picture_names; /* of the images that were read */
    unsigned *uv_set;               /* texture coordinates of each material's image */
    struct uv_map *uv_map;          /* how they are moved */
    char *error;
};

static bool fail(struct reader *r, const char *format, ...)
{
    const size_t length = strlen(r->path);
    const int used = snprintf(r->error, CHARACTER_TEXT, "%s%s: ", length > 100 ? "..." : "",
                              length > 100 ? r->path + length - 97 : r->path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(r->error + used, CHARACTER_TEXT - (size_t)used, format, arguments);
    va_end(arguments);
    for (char *c = r->error; *c; ++c) { /* assimp's texts may contain line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

static bool no_memory(struct reader *r) { return fail(r, "not enough memory"); }

static struct affine from_assimp(const struct aiMatrix4x4 *m)
{
    const struct affine a = {{(double)m->a1, (double)m->a2, (double)m->a3, (double)m->a4, (double)m->b1, (double)m->b2,
                              (double)m->b3, (double)m->b4, (double)m->c1, (double)m->c2, (double)m->c3, (double)m->c4}};
    return a;
}

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

static int count_nodes(const struct aiNode *node, int depth)
{
    int count = 1;
    for (unsigned i = 0; depth < 512 && i < node->mNumChildren; ++i) {
        count += count_nodes(node->mChildren[i], depth + 1);
        if (count > MAX_JOINTS) {
            return count;
        }
    }
    return depth < 512 ? count : MAX_JOINTS + 1;
}

static bool add_nodes(struct reader *r, const struct aiNode *node, int parent)
{
    struct character *c = r->character;
    const int number = c->joint_count++;
    struct joint *joint = &c->joints[number];
    const struct affine local = from_assimp(&node->mTransformation);
    if (!usable(&local)) {
        return fail(r, "node %.60s: its matrix is not finite or flattens", node->mName.data);
    }
    snprintf(joint->name, sizeof joint->name, "%.*s", CHARACTER_NAME - 1, node->mName.data);
    joint->parent = parent;
    joint->rest = placement_of(&local);
    r->nodes[number] = node;
    r->rest[number] = parent >= 0 ? affine_after(&r->rest[parent], &local) : local;
    bool good = true;
    for (unsigned i = 0; good && i < node->mNumChildren; ++i) {
        good = add_nodes(r, node->mChildren[i], number);
    }
    return good;
}

/* Finds a joint by name; where bones and nodes of parts share a name, a node without parts is preferred. */
static int find_joint(const struct reader *r, const char *name)
{
    int found = -1;
    for (int j = 0; j < r->character->joint_count; ++j) {
        if (strcmp(r->nodes[j]->mName.data, name) == 0) {
            if (r->nodes[j]->mNumMeshes == 0) {
                return j;
            }
            found = found < 0 ? j : found;
        }
    }
    return found;
}

/* Sets neutral placements: of bones by their parts, of all others along the hierarchy. Rotates and scales everything so that
 * the first bone is where it rests. */
static bool bind_joints(struct reader *r)
{
    struct character *c = r->character;
    struct affine to_world = affine_identity();
    bool found = false;
    for (unsigned m = 0; m < r->scene->mNumMeshes; ++m) {
        for (unsigned b = 0; b < r->scene->mMeshes[m]->mNumBones; ++b) {
            const struct aiBone *bone = r->scene->mMeshes[m]->mBones[b];
            const struct affine offset = from_assimp(&bone->mOffsetMatrix);
            const int j = find_joint(r, bone->mName.data);
            if (j < 0) {
                return fail(r, "bone %.60s has no node", bone->mName.data);
            }
            if (!usable(&offset)) {
                return fail(r, "bone %.60s: its inverse bind matrix is not finite or flattens", bone->mName.data);
            }
            if (!r->bound[j]) {
                r->bound[j] = true;
                c->joints[j].neutral = affine_inverse(&offset);
            }
        }
    }
    for (int j = 0; !found && j < c->joint_count; ++j) {
        if (r->bound[j]) {
            const struct affine back = affine_inverse(&c->joints[j].neutral);
            to_world = affine_after(&r->rest[j], &back);
            found = true;
        }
    }
    for (int j = 0; j < c->joint_count; ++j) {
        struct joint *joint = &c->joints[j];
        if (r->bound[j]) {
            joint->neutral = affine_after(&to_world, &joint->neutral);
            continue;
        }
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

/* Reads a file into memory, to be freed. */
static unsigned char *read_bytes(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    long length = -1;
    if (file && fseek(file, 0, SEEK_END) == 0) {
        length = ftell(file);
        rewind(file);
    }
    unsigned char *bytes = length > 0 && length < INT32_MAX ? malloc((size_t)length) : NULL;
    if (bytes && fread(bytes, 1, (size_t)length, file) != (size_t)length) {
        free(bytes);
        bytes = NULL;
    }
    if (file) {
        fclose(file);
    }
    *size = bytes ? (size_t)length : 0;
    return bytes;
}

/* Replaces what a URI has as %20, and turns the slashes of other systems. */
static void decode_uri(char *text)
{
    char *to = text;
    for (const char *from = text; *from; ++to) {
        unsigned code;
        if (*from == '%' && isxdigit((unsigned char)from[1]) && isxdigit((unsigned char)from[2])
            && sscanf(from + 1, "%2x", &code) == 1 && code > 0) {
            *to = (char)code;
            from += 3;
        } else {
            *to = *from == '\\' ? '/' : *from;
            ++from;
        }
    }
    *to = '\0';
}

/* Reads a file that lies beside the character's. */
static unsigned char *read_beside(const struct reader *r, const char *name, size_t *size)
{
    const char *slash = strrchr(r->path, '/');
    const size_t folder = slash ? (size_t)(slash - r->path + 1) : 0, length = folder + strlen(name) + 1;
    char *path = malloc(length);
    if (!path) {
        return NULL;
    }
    memcpy(path, r->path, folder);
    memcpy(path + folder, name, length - folder);
    unsigned char *bytes = read_bytes(path, size);
    if (!bytes) {
        decode_uri(path + folder);
        bytes = read_bytes(path, size);
    }
    free(path);
    return bytes;
}

/* Copies an image of the file; NULL if there is none of that number, or it is not encoded. */
static unsigned char *read_embedded(const struct reader *r, const char *number, size_t *size)
{
    const long texture = strtol(number, NULL, 10);
    if (texture < 0 || (unsigned long)texture >= r->scene->mNumTextures || r->scene->mTextures[texture]->mHeight != 0) {
        return NULL;
    }
    const struct aiTexture *t = r->scene->mTextures[texture];
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
    struct character *c = r->character;
    struct picture *picture = &c->pictures[c->picture_count];
    for (int p = 0; p < c->picture_count; ++p) {
        if (strcmp(r->picture_names[p].data, name->data) == 0) {
            return p;
        }
    }
    picture->bytes = name->data[0] == '*' ? read_embedded(r, name->data + 1, &picture->size)
                                          : read_beside(r, name->data, &picture->size);
    if (!picture->bytes || !byte_image_read(picture->bytes, picture->size, &picture->image)) {
        free(picture->bytes);
        memset(picture, 0, sizeof *picture);
        ++c->missing_pictures;
        return -1;
    }
    r->picture_names[c->picture_count] = *name;
    return c->picture_count++;
}

static float material_number(const struct aiMaterial *material, const char *key, float otherwise)
{
    float value = otherwise;
    aiGetMaterialFloatArray(material, key, 0, 0, &value, NULL);
    return isfinite(value) ? fmaxf(0.0f, fminf(1.0f, value)) : otherwise;
}

/* Reads how the coordinates of a material's image are moved. assimp turns them about the image's center, with v upwards, so its
 * shift is another. */
static struct uv_map read_uv_map(const struct aiMaterial *material, enum aiTextureType type)
{
    struct uv_map map = {{0.0f, 0.0f}, 1.0f, 0.0f, {1.0f, 1.0f}};
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

static void map_uv(const struct uv_map *map, const struct aiVector3D *uv, float out[2])
{
    const float u = map->scale[0] * uv->x, v = map->scale[1] * (1.0f - uv->y); /* assimp reverses glTF's v */
    out[0] = map->offset[0] + map->cosine * u + map->sine * v;
    out[1] = map->offset[1] - map->sine * u + map->cosine * v;
}

/* Reads how a material looks. Files of formats without metal, such as OBJ, are rough. */
static void read_material(struct reader *r, unsigned number)
{
    struct material *made = &r->character->materials[number];
    const struct aiMaterial *material = r->scene->mMaterials[number];
    struct aiColor4D base = {1.0f, 1.0f, 1.0f, 1.0f};
    struct aiString name, alpha;
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
    made->metallic = material_number(material, "$mat.metallicFactor", made->metallic);
    made->roughness = material_number(material, "$mat.roughnessFactor", made->roughness);
    made->cutoff = material_number(material, "$mat.gltf.alphaCutoff", made->cutoff);
    if (aiGetMaterialString(material, "$mat.gltf.alphaMode", 0, 0, &alpha) == aiReturn_SUCCESS) {
        made->alpha = strcmp(alpha.data, "MASK") == 0 ? MATERIAL_MASK
            : strcmp(alpha.data, "BLEND") == 0        ? MATERIAL_BLEND
                                                      : MATERIAL_OPAQUE;
    }
    if (aiGetMaterialIntegerArray(material, AI_MATKEY_TWOSIDED, &two_sided, NULL) == aiReturn_SUCCESS) {
        made->two_sided = two_sided != 0;
    }
    const enum aiTextureType types[2] = {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE};
    r->uv_set[number] = 0;
    for (int t = 0, found = 0; t < 2 && !found; ++t) {
        r->uv_map[number] = read_uv_map(material, types[t]);
        found = aiGetMaterialTexture(material, types[t], 0, &name, NULL, &r->uv_set[number], NULL, NULL, NULL, NULL)
            == aiReturn_SUCCESS;
        made->image = found ? find_picture(r, &name) : made->image;
    }
}

/* Reads all materials; a plain one more for parts that name none. */
static bool read_materials(struct reader *r)
{
    struct character *c = r->character;
    const size_t count = r->scene->mNumMaterials;
    c->materials = calloc(count + 1, sizeof *c->materials);
    c->pictures = calloc(count + 1, sizeof *c->pictures);
    r->picture_names = calloc(count + 1, sizeof *r->picture_names);
    r->uv_set = calloc(count + 1, sizeof *r->uv_set);
    r->uv_map = calloc(count + 1, sizeof *r->uv_map);
    if (!c->materials || !c->pictures || !r->picture_names || !r->uv_set || !r->uv_map) {
        return no_memory(r);
    }
    for (unsigned m = 0; m < r->scene->mNumMaterials; ++m) {
        read_material(r, m);
    }
    c->materials[count] = material_plain();
    c->material_count = (int)count + 1;
    return true;
}

/* ---- parts ---- */

static bool read_weights(struct reader *r, const struct aiMesh *part, int first)
{
    struct character *c = r->character;
    for (unsigned b = 0; b < part->mNumBones; ++b) {
        const struct aiBone *bone = part->mBones[b];
        const int j = find_joint(r, bone->mName.data);
        for (unsigned w = 0; w < bone->mNumWeights; ++w) {
            const struct aiVertexWeight *weight = &bone->mWeights[w];
            if (weight->mVertexId >= part->mNumVertices || !isfinite(weight->mWeight) || weight->mWeight < 0.0f) {
                return fail(r, "bone %.60s: a weight that is negative or not finite, or vertex %u of %u", bone->mName.data,
                            weight->mVertexId, part->mNumVertices);
            }
            influences_add(&c->influences[first + (int)weight->mVertexId], j, weight->mWeight);
        }
    }
    return true;
}

/* Transforms a part's vertices from the part's space to the neutral pose, each by its bones. */
static bool bring_vertices(struct reader *r, const struct aiMesh *part, int node, int first)
{
    struct character *c = r->character;
    struct affine *bring = malloc((size_t)c->joint_count * sizeof *bring);
    if (!bring) {
        return no_memory(r);
    }
    for (int j = 0; j < c->joint_count; ++j) {
        bring[j] = c->joints[j].neutral; /* a part without bones is in its node's space */
    }
    for (unsigned b = 0; b < part->mNumBones; ++b) {
        const int j = find_joint(r, part->mBones[b]->mName.data);
        const struct affine offset = from_assimp(&part->mBones[b]->mOffsetMatrix);
        bring[j] = affine_after(&c->joints[j].neutral, &offset);
    }
    int root = node;
    for (unsigned b = 0; b < part->mNumBones; ++b) {
        const int j = find_joint(r, part->mBones[b]->mName.data);
        root = b == 0 || j < root ? j : root;
    }
    bool good = true;
    for (int v = first; good && v < c->vertex_count; ++v) {
        const float sum = influences_normalize(&c->influences[v], root);
        c->unnormal += part->mNumBones > 0 && sum > 0.0f && fabsf(sum - 1.0f) > 0.01f;
        c->unweighted += part->mNumBones > 0 && !(sum > 0.0f);
        const struct affine blend = influences_blend(&c->influences[v], bring);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            c->joints[c->influences[v].joint[k]].bone |= c->influences[v].weight[k] > 0.0f;
        }
        affine_apply(&blend, c->positions + 3 * v, c->positions + 3 * v);
        affine_normal(&blend, c->normals + 3 * v, c->normals + 3 * v);
        good = vec3_within_reach(c->positions + 3 * v) || fail(r, VEC3_TOO_FAR);
    }
    free(bring);
    return good;
}

static bool add_part(struct reader *r, int node, unsigned number)
{
    struct character *c = r->character;
    const struct aiMesh *part = r->scene->mMeshes[number];
    const int first = c->vertex_count, first_triangle = c->triangle_count;
    const unsigned material = part->mMaterialIndex < r->scene->mNumMaterials ? part->mMaterialIndex : r->scene->mNumMaterials,
                   set = r->uv_set[material] < AI_MAX_NUMBER_OF_TEXTURECOORDS ? r->uv_set[material] : 0;
    const struct aiVector3D *uvs = part->mTextureCoords[set], *normals = part->mNormals;
    for (unsigned v = 0; v < part->mNumVertices; ++v) {
        const size_t at = (size_t)c->vertex_count++;
        const struct aiVector3D *p = &part->mVertices[v], *uv = uvs ? &uvs[v] : NULL;
        const struct aiColor4D *k = part->mColors[0] ? &part->mColors[0][v] : NULL;
        const float factor[3] = {k ? color_display(k->r) : 1.0f, k ? color_display(k->g) : 1.0f, k ? color_display(k->b) : 1.0f};
        c->positions[3 * at] = p->x, c->positions[3 * at + 1] = p->y, c->positions[3 * at + 2] = p->z;
        c->uvs[2 * at] = c->uvs[2 * at + 1] = 0.0f;
        if (uv && isfinite(uv->x) && isfinite(uv->y)) {
            map_uv(&r->uv_map[material], uv, c->uvs + 2 * at);
        }
        for (size_t i = 0; i < 3; ++i) {
            c->colors[3 * at + i] = isfinite(factor[i]) ? factor[i] : 1.0f;
        }
        if (normals) {
            c->normals[3 * at] = normals[v].x, c->normals[3 * at + 1] = normals[v].y, c->normals[3 * at + 2] = normals[v].z;
        }
        memset(&c->influences[at], 0, sizeof c->influences[at]);
        if (!vec3_within_reach(c->positions + 3 * at)) {
            return fail(r, VEC3_TOO_FAR);
        }
    }
    for (unsigned f = 0; f < part->mNumFaces; ++f) {
        const struct aiFace *face = &part->mFaces[f];
        for (unsigned k = 0; k < face->mNumIndices; ++k) {
            if (face->mIndices[k] >= part->mNumVertices) {
                return fail(r, "a face names vertex %u of %u", face->mIndices[k], part->mNumVertices);
            }
        }
        for (unsigned k = 0; face->mNumIndices == 3 && k < 3; ++k) {
            c->triangles[3 * c->triangle_count + (int)k] = first + (int)face->mIndices[k];
        }
        if (face->mNumIndices == 3) {
            c->materials_of[c->triangle_count++] = (int)material;
        }
    }
    if (!normals && !character_smooth(c, first, first_triangle)) {
        return no_memory(r);
    }
    c->part_count += c->triangle_count > first_triangle;
    return read_weights(r, part, first) && bring_vertices(r, part, node, first);
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
static bool wanted(struct reader *r, int node, unsigned part, const char *props)
{
    return r->scene->mMeshes[part]->mNumBones > 0 || !r->character->skinned
           || (props && (strcmp(props, "all") == 0 || named(r->character->joints[node].name, props)));
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
    for (unsigned m = 0; m < r->scene->mNumMeshes; ++m) {
        c->skinned = c->skinned || r->scene->mMeshes[m]->mNumBones > 0;
    }
    for (int j = 0; j < c->joint_count; ++j) {
        for (unsigned m = 0; m < r->nodes[j]->mNumMeshes; ++m) {
            vertices += r->scene->mMeshes[r->nodes[j]->mMeshes[m]]->mNumVertices;
            triangles += r->scene->mMeshes[r->nodes[j]->mMeshes[m]]->mNumFaces;
            rigid += c->skinned && r->scene->mMeshes[r->nodes[j]->mMeshes[m]]->mNumBones == 0;
        }
    }
    if (triangles == 0 || vertices > INT32_MAX / 16 || triangles > INT32_MAX / 16) {
        return fail(r, triangles == 0 ? "no triangles" : "too many triangles");
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
    bool good = read_materials(r);
    for (int j = 0; good && j < c->joint_count; ++j) {
        for (unsigned m = 0; good && m < r->nodes[j]->mNumMeshes; ++m) {
            const unsigned part = r->nodes[j]->mMeshes[m];
            if (c->skinned && r->scene->mMeshes[part]->mNumBones == 0) {
                memcpy(c->props[c->prop_count++], c->joints[j].name, CHARACTER_NAME);
            }
            good = !wanted(r, j, part, props) || add_part(r, j, part);
        }
    }
    return good && (c->triangle_count > 0 || fail(r, "no triangles")) && (has_size(c) || fail(r, "the body has no size"))
        && drop_unused_materials(r);
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
        good = (isfinite(keys->times[k]) && isfinite(value[0] + value[1] + value[2])) || fail(r, "a key is not finite");
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
        good = (isfinite(keys->times[k]) && isfinite(q[0] + q[1] + q[2] + q[3])) || fail(r, "a key is not finite");
    }
    keys->count = good ? (int)count : 0;
    return good;
}

static bool read_animation(struct reader *r, const struct aiAnimation *from, struct animation *to)
{
    const double second = from->mTicksPerSecond > 0.0 ? from->mTicksPerSecond : 1.0; /* ticks */
    snprintf(to->name, sizeof to->name, "%.*s", CHARACTER_NAME - 1, from->mName.data);
    to->duration = from->mDuration / second;
    to->channels = calloc((size_t)from->mNumChannels + 1, sizeof *to->channels);
    if (!to->channels) {
        return no_memory(r);
    }
    bool good = isfinite(to->duration) || fail(r, "animation %.60s: its length is not finite", to->name);
    for (unsigned k = 0; good && k < from->mNumChannels; ++k) {
        const struct aiNodeAnim *node = from->mChannels[k];
        struct channel *channel = &to->channels[to->channel_count++];
        channel->joint = find_joint(r, node->mNodeName.data);
        good = read_vectors(r, node->mPositionKeys, node->mNumPositionKeys, second, &channel->translation)
               && read_rotations(r, node->mRotationKeys, node->mNumRotationKeys, second, &channel->rotation)
               && read_vectors(r, node->mScalingKeys, node->mNumScalingKeys, second, &channel->scale);
    }
    return good;
}

static bool read_animations(struct reader *r)
{
    struct character *c = r->character;
    c->animations = calloc((size_t)r->scene->mNumAnimations + 1, sizeof *c->animations);
    bool good = c->animations || no_memory(r);
    for (unsigned a = 0; good && a < r->scene->mNumAnimations; ++a) {
        good = read_animation(r, r->scene->mAnimations[a], &c->animations[c->animation_count++]);
    }
    return good;
}

/* ---- all ---- */

static bool read_scene(struct reader *r, const char *props)
{
    struct character *c = r->character;
    const int count = r->scene->mRootNode ? count_nodes(r->scene->mRootNode, 0) : 0;
    if (count == 0 || count > MAX_JOINTS) {
        return fail(r, count == 0 ? "no nodes" : "too many nodes, or nodes within themselves");
    }
    c->joints = calloc((size_t)count, sizeof *c->joints);
    r->nodes = calloc((size_t)count, sizeof *r->nodes);
    r->rest = calloc((size_t)count, sizeof *r->rest);
    r->bound = calloc((size_t)count, sizeof *r->bound);
    if (!c->joints || !r->nodes || !r->rest || !r->bound) {
        return no_memory(r);
    }
    return add_nodes(r, r->scene->mRootNode, -1) && bind_joints(r) && read_parts(r, props) && read_animations(r);
}

bool character_read(const char *path, const char *props, struct character *character, char error[CHARACTER_TEXT])
{
    struct reader r = {.path = path, .character = character, .error = error};
    memset(character, 0, sizeof *character);
    r.scene = scene_read(path, 0, error);
    if (!r.scene) {
        return false;
    }
    const bool good = read_scene(&r, props);
    aiReleaseImport(r.scene);
    free(r.nodes);
    free(r.rest);
    free(r.bound);
    free(r.picture_names);
    free(r.uv_set);
    free(r.uv_map);
    if (!good) {
        character_free(character);
    }
    return good;
}
