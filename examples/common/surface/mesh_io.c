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
    for (char *c = error; *c; ++c) { /* assimp's own texts may hold line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

/* assimp believes the element counts of PLY and OFF headers and asks for that much memory. An element takes at least one
 * byte of the file, so a larger count is a broken file. */
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

/* Open-addressing table: vertex numbers + 1, 0 = free. Returns the number of the vertex at p, adding it if new. */
static uint32_t weld(struct mesh *mesh, uint32_t *table, size_t mask, const float p[3])
{
    size_t slot = hash_position(p) & mask;
    while (table[slot] != 0) {
        if (memcmp(mesh->positions + 3 * (size_t)(table[slot] - 1), p, 3 * sizeof *p) == 0) {
            return table[slot] - 1;
        }
        slot = (slot + 1) & mask;
    }
    memcpy(mesh->positions + 3 * mesh->vertex_count, p, 3 * sizeof *p);
    table[slot] = (uint32_t)++mesh->vertex_count;
    return table[slot] - 1;
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

/* Of a vertex of a part of the file: its own colour, or the part's material's. */
static struct aiColor4D color_of(const struct aiScene *scene, const struct aiMesh *part, unsigned vertex)
{
    struct aiColor4D color = {0.8f, 0.8f, 0.8f, 1.0f};
    if (part->mColors[0]) {
        return part->mColors[0][vertex];
    }
    aiGetMaterialColor(scene->mMaterials[part->mMaterialIndex], AI_MATKEY_COLOR_DIFFUSE, &color);
    return color;
}

/* Where vertices become one the first one's colour stays. */
static void take_color(struct mesh *mesh, uint32_t vertex, struct aiColor4D color)
{
    const float rgb[3] = {color.r, color.g, color.b};
    for (int i = 0; i < 3; ++i) {
        mesh->colors[3 * (size_t)vertex + (size_t)i] = rgb[i] > 0.0f ? fminf(rgb[i], 1.0f) : 0.0f;
    }
}

static bool collect(const char *path, const struct aiScene *scene, struct mesh *mesh, char error[MESH_TEXT])
{
    size_t triangles = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        triangles += scene->mMeshes[m]->mNumFaces;
    }
    if (triangles == 0) {
        return fail(error, path, "no triangles");
    }
    if (triangles > UINT32_MAX / 8) {
        return fail(error, path, "too many triangles: %zu", triangles);
    }
    size_t slots = 16;
    while (slots < 6 * triangles) {
        slots *= 2;
    }
    uint32_t *table = calloc(slots, sizeof *table);
    mesh->positions = malloc(9 * triangles * sizeof *mesh->positions);
    mesh->indices = malloc(3 * triangles * sizeof *mesh->indices);
    mesh->colors = has_colors(scene) ? malloc(9 * triangles * sizeof *mesh->colors) : NULL;
    bool good = table && mesh->positions && mesh->indices && (mesh->colors || !has_colors(scene));
    if (!good) {
        fail(error, path, "not enough memory for %zu triangles", triangles);
    }
    for (unsigned m = 0; good && m < scene->mNumMeshes; ++m) {
        const struct aiMesh *part = scene->mMeshes[m];
        for (unsigned f = 0; good && f < part->mNumFaces; ++f) {
            const struct aiFace *face = &part->mFaces[f];
            uint32_t *corner = mesh->indices + 3 * mesh->triangle_count;
            for (unsigned k = 0; good && k < face->mNumIndices && face->mNumIndices == 3; ++k) {
                if (face->mIndices[k] >= part->mNumVertices) {
                    good = fail(error, path, "a face names vertex %u of %u", face->mIndices[k], part->mNumVertices);
                    break;
                }
                const struct aiVector3D *v = &part->mVertices[face->mIndices[k]];
                const float p[3] = {v->x + 0.0f, v->y + 0.0f, v->z + 0.0f}; /* -0 and 0 are one place */
                if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
                    good = fail(error, path, "a vertex is not finite");
                    break;
                }
                const size_t before = mesh->vertex_count;
                corner[k] = weld(mesh, table, slots - 1, p);
                if (mesh->colors && mesh->vertex_count > before) {
                    take_color(mesh, corner[k], color_of(scene, part, face->mIndices[k]));
                }
            }
            if (!good || face->mNumIndices != 3) {
                continue; /* points and lines */
            }
            if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
                ++mesh->dropped;
            } else {
                ++mesh->triangle_count;
            }
        }
    }
    free(table);
    if (good && mesh->triangle_count == 0) {
        good = fail(error, path, "no triangles%s", mesh->dropped ? ": all of them are degenerate" : "");
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
    const bool good = collect(path, scene, mesh, error);
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

/* ---- PLY ---- */

static unsigned char *put_word(unsigned char *out, uint32_t word) /* little endian on every machine */
{
    for (int i = 0; i < 4; ++i) {
        *out++ = (unsigned char)(word >> (8 * i));
    }
    return out;
}

static unsigned char *put_vector(unsigned char *out, const float v[3])
{
    for (int i = 0; i < 3; ++i) {
        uint32_t word;
        memcpy(&word, &v[i], sizeof word);
        out = put_word(out, word);
    }
    return out;
}

static void write_ply_header(FILE *file, const struct mesh_ply *ply)
{
    fputs("ply\nformat binary_little_endian 1.0\n", file);
    if (ply->comment) {
        fprintf(file, "comment %.200s\n", ply->comment);
    }
    fprintf(file, "element vertex %zu\nproperty float x\nproperty float y\nproperty float z\n", ply->vertex_count);
    if (ply->normals) {
        fputs("property float nx\nproperty float ny\nproperty float nz\n", file);
    }
    if (ply->colors) {
        fputs("property uchar red\nproperty uchar green\nproperty uchar blue\n", file);
    }
    if (ply->originals) {
        fputs("property float a_x\nproperty float a_y\nproperty float a_z\n", file);
    }
    if (ply->triangle_count > 0) {
        fprintf(file, "element face %zu\nproperty list uchar int vertex_indices\n", ply->triangle_count);
    }
    fputs("end_header\n", file);
}

bool mesh_write_ply(const char *path, const struct mesh_ply *ply, char error[MESH_TEXT])
{
    unsigned char row[64];
    error[0] = '\0';
    FILE *file = fopen(path, "wb");
    if (!file) {
        return fail(error, path, "cannot write there");
    }
    write_ply_header(file, ply);
    for (size_t v = 0; v < ply->vertex_count; ++v) {
        unsigned char *out = put_vector(row, ply->positions + 3 * v);
        if (ply->normals) {
            out = put_vector(out, ply->normals + 3 * v);
        }
        for (int i = 0; ply->colors && i < 3; ++i) {
            const float c = ply->colors[3 * v + (size_t)i];
            *out++ = (unsigned char)(c > 0.0f ? fminf(c, 1.0f) * 255.0f + 0.5f : 0.0f);
        }
        if (ply->originals) {
            out = put_vector(out, ply->originals + 3 * v);
        }
        fwrite(row, 1, (size_t)(out - row), file);
    }
    for (size_t t = 0; t < ply->triangle_count; ++t) {
        unsigned char *out = row;
        *out++ = 3;
        for (size_t k = 0; k < 3; ++k) {
            out = put_word(out, ply->indices ? ply->indices[3 * t + k] : (uint32_t)(3 * t + k));
        }
        fwrite(row, 1, (size_t)(out - row), file);
    }
    const bool bad = ferror(file) != 0;
    if (fclose(file) != 0 || bad) {
        remove(path);
        return fail(error, path, "writing failed (disk full?)");
    }
    return true;
}
