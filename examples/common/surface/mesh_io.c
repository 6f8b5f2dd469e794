#include "surface/mesh_io.h"

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool fail(char error[MESH_TEXT], const char *path, const char *format, ...)
{
    const size_t length = strlen(path);
    const int used =
        snprintf(error, MESH_TEXT, "%s%s: ", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error + used, MESH_TEXT - (size_t)used, format, arguments);
    va_end(arguments);
    for (char *c = error; *c; ++c) { /* assimp's texts may contain line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

/* Compares the element counts of PLY and OFF headers with the file's length, an element taking at least one byte: assimp would
 * allocate memory for any count. */
bool mesh_counts_plausible(const char *path, char error[MESH_TEXT])
{
    char line[512];
    FILE *file = fopen(path, "rb");
    if (!file) {
        return fail(error, path, "cannot open");
    }
    if (fseek(file, 0, SEEK_END) != 0) {
        fclose(file);
        return fail(error, path, "not a regular file");
    }
    const long size = ftell(file);
    rewind(file);
    bool good = size > 0;
    bool ply = false, off = false, ply_end = false;
    if (!good) {
        fail(error, path, "empty file");
    }
    for (int row = 0; good && row < 200 && fgets(line, sizeof line, file); ++row) {
        if (row == 0) {
            ply = strncmp(line, "ply", 3) == 0;
            off = strncmp(line, "OFF", 3) == 0;
            if (!ply && !off) {
                break;
            }
            continue;
        }
        double count[2] = {0.0, 0.0};
        bool counts = false;
        if (ply) {
            if (strncmp(line, "end_header", 10) == 0) {
                ply_end = true;
                break;
            }
            counts = sscanf(line, "element %*s %lf", &count[0]) == 1;
        } else {
            counts = line[0] != '#' && sscanf(line, "%lf %lf", &count[0], &count[1]) >= 1;
        }
        if (counts
            && (!(count[0] >= 0.0 && count[0] <= (double)size) || !(count[1] >= 0.0 && count[1] <= (double)size))) {
            good = fail(error, path, "the header promises %.0f elements, the file has %ld bytes",
                        count[0] < 0.0 || count[0] > (double)size ? count[0] : count[1], size);
        }
        if (off && counts) {
            break;
        }
    }
    if (good && ply && !ply_end) {
        good = fail(error, path, "the PLY header has no end");
    }
    fclose(file);
    return good;
}

static uint32_t hash_position(const float p[3])
{
    uint32_t word[3];
    memcpy(word, p, sizeof word);
    uint32_t h = word[0] * 0x9E3779B1u ^ word[1] * 0x85EBCA77u ^ word[2] * 0xC2B2AE3Du;
    h ^= h >> 15;
    h *= 0x2C1B3C6Du;
    return h ^ h >> 13;
}

static bool has_colors(const struct aiScene *scene)
{
    unsigned materials = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        if (scene->mMeshes[m]->mColors[0]) {
            return true;
        }
        materials += m == 0 || scene->mMeshes[m]->mMaterialIndex != scene->mMeshes[0]->mMaterialIndex;
    }
    return materials > 1;
}

/* Returns the color of a vertex of a part: its own, or the part's material's. */
static struct aiColor4D color_of(const struct aiScene *scene, const struct aiMesh *part, unsigned vertex)
{
    struct aiColor4D color = {0.8f, 0.8f, 0.8f, 1.0f};
    if (part->mColors[0]) {
        return part->mColors[0][vertex];
    }
    aiGetMaterialColor(scene->mMaterials[part->mMaterialIndex], AI_MATKEY_COLOR_DIFFUSE, &color);
    return color;
}

/* Stores a vertex's color; of vertices that become one the first one's is kept. */
static void take_color(struct mesh *mesh, uint32_t vertex, struct aiColor4D color)
{
    const float rgb[3] = {color.r, color.g, color.b};
    for (int i = 0; i < 3; ++i) {
        mesh->colors[3 * (size_t)vertex + (size_t)i] = rgb[i] > 0.0f ? fminf(rgb[i], 1.0f) : 0.0f;
    }
}

/* A file that is being turned into a mesh. */
struct builder {
    const char *path;
    const struct aiScene *scene;
    struct mesh *mesh;
    uint32_t *table; /* open addressing: numbers of vertices + 1, 0 = free */
    size_t mask;     /* slots - 1, where the slots are a power of two */
    char *error;
};

/* Allocates for all triangles of the file, as if they had no vertex in common. */
static bool allocate(struct builder *b)
{
    size_t triangles = 0, slots = 16;
    for (unsigned m = 0; m < b->scene->mNumMeshes; ++m) {
        triangles += b->scene->mMeshes[m]->mNumFaces;
    }
    if (triangles == 0) {
        return fail(b->error, b->path, "no triangles");
    }
    if (triangles > UINT32_MAX / 8) {
        return fail(b->error, b->path, "too many triangles: %zu", triangles);
    }
    while (slots < 6 * triangles) {
        slots *= 2;
    }
    const bool colored = has_colors(b->scene);
    b->mask = slots - 1;
    b->table = calloc(slots, sizeof *b->table);
    b->mesh->positions = malloc(9 * triangles * sizeof *b->mesh->positions);
    b->mesh->indices = malloc(3 * triangles * sizeof *b->mesh->indices);
    b->mesh->colors = colored ? malloc(9 * triangles * sizeof *b->mesh->colors) : NULL;
    if (!b->table || !b->mesh->positions || !b->mesh->indices || (colored && !b->mesh->colors)) {
        return fail(b->error, b->path, "not enough memory for %zu triangles", triangles);
    }
    return true;
}

/* Adds a vertex at p unless there is one; returns its number. */
static uint32_t weld(struct builder *b, const float p[3])
{
    struct mesh *mesh = b->mesh;
    size_t slot = hash_position(p) & b->mask;
    while (b->table[slot] != 0) {
        if (memcmp(mesh->positions + 3 * (size_t)(b->table[slot] - 1), p, 3 * sizeof *p) == 0) {
            return b->table[slot] - 1;
        }
        slot = (slot + 1) & b->mask;
    }
    memcpy(mesh->positions + 3 * mesh->vertex_count, p, 3 * sizeof *p);
    b->table[slot] = (uint32_t)++mesh->vertex_count;
    return b->table[slot] - 1;
}

/* Adds vertex `index` of a part of the file unless there is one at its place. */
static bool add_corner(struct builder *b, const struct aiMesh *part, unsigned index, uint32_t *corner)
{
    if (index >= part->mNumVertices) {
        return fail(b->error, b->path, "a face names vertex %u of %u", index, part->mNumVertices);
    }
    const struct aiVector3D *v = &part->mVertices[index];
    const float p[3] = {v->x + 0.0f, v->y + 0.0f, v->z + 0.0f}; /* -0 and 0 are the same place */
    if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
        return fail(b->error, b->path, "a vertex is not finite");
    }
    const size_t before = b->mesh->vertex_count;
    *corner = weld(b, p);
    if (b->mesh->colors && b->mesh->vertex_count > before) {
        take_color(b->mesh, *corner, color_of(b->scene, part, index));
    }
    return true;
}

/* Adds a triangle unless two of its corners coincide; skips points and lines. */
static bool add_face(struct builder *b, const struct aiMesh *part, const struct aiFace *face)
{
    uint32_t *corner = b->mesh->indices + 3 * b->mesh->triangle_count;
    if (face->mNumIndices != 3) {
        return true;
    }
    for (unsigned k = 0; k < 3; ++k) {
        if (!add_corner(b, part, face->mIndices[k], &corner[k])) {
            return false;
        }
    }
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
        ++b->mesh->dropped;
    } else {
        ++b->mesh->triangle_count;
    }
    return true;
}

/* Builds the mesh from all parts of the file. */
static bool build(struct builder *b)
{
    bool good = allocate(b);
    for (unsigned m = 0; good && m < b->scene->mNumMeshes; ++m) {
        const struct aiMesh *part = b->scene->mMeshes[m];
        for (unsigned f = 0; good && f < part->mNumFaces; ++f) {
            good = add_face(b, part, &part->mFaces[f]);
        }
    }
    free(b->table);
    if (good && b->mesh->triangle_count == 0) {
        good = fail(b->error, b->path, "no triangles%s", b->mesh->dropped ? ": all of them are degenerate" : "");
    }
    return good;
}

bool mesh_read(const char *path, struct mesh *mesh, char error[MESH_TEXT])
{
    memset(mesh, 0, sizeof *mesh);
    error[0] = '\0';
    if (!mesh_counts_plausible(path, error)) {
        return false;
    }
    struct aiPropertyStore *properties = aiCreatePropertyStore();
    if (!properties) {
        return fail(error, path, "not enough memory");
    }
    aiSetImportPropertyInteger(properties, AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const struct aiScene *scene = aiImportFileExWithProperties(
        path, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_PreTransformVertices, NULL, properties);
    aiReleasePropertyStore(properties);
    if (!scene) {
        const char *reason = aiGetErrorString();
        return fail(error, path, "%.180s", reason && *reason ? reason : "cannot be read");
    }
    struct builder builder = {.path = path, .scene = scene, .mesh = mesh, .error = error};
    const bool good = build(&builder);
    aiReleaseImport(scene);
    if (!good) {
        mesh_free(mesh);
    }
    return good;
}

void mesh_free(struct mesh *mesh)
{
    free(mesh->positions);
    free(mesh->indices);
    free(mesh->colors);
    memset(mesh, 0, sizeof *mesh);
}
