#include "surface/gltf_builder.h"

#include "base/output_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Types of components, specification 3.6.2.2. */
enum { USHORT = 5123, UINT = 5125, FLOAT = 5126 };

enum { SHORT_INDICES = 65535 }; /* the largest 16-bit number may not be an index */

void gltf_begin(struct gltf *g)
{
    memset(g, 0, sizeof *g);
    g->root = cJSON_CreateObject();
    cJSON *asset = cJSON_AddObjectToObject(g->root, "asset");
    cJSON_AddStringToObject(asset, "version", "2.0");
    cJSON_AddStringToObject(asset, "generator", "springls");
    gltf_number(g->root, "scene", 0);
}

static bool write_file(const struct gltf *g, const char *text, const char *path)
{
    struct output_file output;
    if (!output_file_open(&output, path)) {
        return false;
    }
    const size_t length = strlen(text), padded = (length + 3) / 4 * 4;
    const uint32_t head[5] = {0x46546C67u, 2u, (uint32_t)(28 + padded + g->used), (uint32_t)padded, 0x4E4F534Au};
    const uint32_t data[2] = {(uint32_t)g->used, 0x004E4942u};
    FILE *file = output.file;
    const bool good = fwrite(head, 1, sizeof head, file) == sizeof head && fwrite(text, 1, length, file) == length
        && fwrite("   ", 1, padded - length, file) == padded - length && fwrite(data, 1, sizeof data, file) == sizeof data
        && fwrite(g->bytes, 1, g->used, file) == g->used;
    return output_file_close(&output, good);
}

bool gltf_finish(struct gltf *g, const char *path)
{
    gltf_number(gltf_add(g, "buffers", NULL), "byteLength", (double)g->used);
    char *text = g->failed || g->used == 0 || g->used > UINT32_MAX / 2 ? NULL : cJSON_PrintUnformatted(g->root);
    const bool good = text && write_file(g, text, path);
    cJSON_free(text);
    cJSON_Delete(g->root);
    free(g->bytes);
    return good;
}

cJSON *gltf_add(struct gltf *g, const char *list, int *index)
{
    cJSON *items = cJSON_GetObjectItem(g->root, list), *made = cJSON_CreateObject();
    items = items ? items : cJSON_AddArrayToObject(g->root, list);
    if (index) {
        *index = cJSON_GetArraySize(items);
    }
    if (!made || !cJSON_AddItemToArray(items, made)) {
        cJSON_Delete(made);
        made = NULL;
    }
    g->failed = g->failed || !made;
    return made;
}

void gltf_number(cJSON *to, const char *name, double value) { cJSON_AddNumberToObject(to, name, value); }

void gltf_numbers(cJSON *to, const char *name, const double *values, int count)
{
    cJSON_AddItemToObject(to, name, cJSON_CreateDoubleArray(values, count));
}

/* ---- accessors ---- */

/* Adds a buffer view with a copy of the data, on a little-endian machine. Returns its number. */
static int add_view(struct gltf *g, const void *data, size_t size, int target)
{
    const size_t offset = g->used, wanted = offset + size + 4;
    if (wanted > g->room) {
        unsigned char *grown = realloc(g->bytes, 2 * wanted);
        if (!grown) {
            g->failed = true;
            return 0;
        }
        g->bytes = grown;
        g->room = 2 * wanted;
    }
    memset(g->bytes + offset, 0, size + 4);
    memcpy(g->bytes + offset, data, size);
    g->used += (size + 3) / 4 * 4;
    int index;
    cJSON *view = gltf_add(g, "bufferViews", &index);
    gltf_number(view, "buffer", 0);
    gltf_number(view, "byteOffset", (double)offset);
    gltf_number(view, "byteLength", (double)size);
    if (target != GLTF_NO_TARGET) {
        gltf_number(view, "target", target);
    }
    return index;
}

static int add_accessor(struct gltf *g, const void *data, int count, int width, int component, int target, cJSON **made)
{
    static const char *const type[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    const size_t size = (size_t)count * (size_t)width * (component == USHORT ? 2 : 4);
    const int view = add_view(g, data, size, target);
    int index;
    *made = gltf_add(g, "accessors", &index);
    gltf_number(*made, "bufferView", view);
    gltf_number(*made, "componentType", component);
    gltf_number(*made, "count", count);
    cJSON_AddStringToObject(*made, "type", width == 16 ? "MAT4" : type[width]);
    return index;
}

int gltf_floats(struct gltf *g, const float *data, int count, int width, int target, bool bounded)
{
    double lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    cJSON *made;
    const int index = add_accessor(g, data, count, width, FLOAT, target, &made);
    for (int i = 0; bounded && i < count * width; ++i) {
        lo[i % width] = fmin(lo[i % width], (double)data[i]);
        hi[i % width] = fmax(hi[i % width], (double)data[i]);
    }
    if (bounded) {
        gltf_numbers(made, "min", lo, width);
        gltf_numbers(made, "max", hi, width);
    }
    return index;
}

int gltf_shorts(struct gltf *g, const uint16_t *data, int count, int width, bool normalized)
{
    cJSON *made;
    const int index = add_accessor(g, data, count, width, USHORT, GLTF_VERTICES, &made);
    if (normalized) {
        cJSON_AddTrueToObject(made, "normalized");
    }
    return index;
}

/* Adds the corners of triangles, as 16-bit numbers where these are enough. */
static int add_indices(struct gltf *g, const int *corners, int count, int vertex_count)
{
    cJSON *made;
    uint16_t *shorts = vertex_count < SHORT_INDICES ? malloc(2 * (size_t)count + 2) : NULL;
    if (!shorts) {
        return add_accessor(g, corners, count, 1, UINT, GLTF_INDICES, &made);
    }
    for (int i = 0; i < count; ++i) {
        shorts[i] = (uint16_t)corners[i];
    }
    const int index = add_accessor(g, shorts, count, 1, USHORT, GLTF_INDICES, &made);
    free(shorts);
    return index;
}

/* ---- materials ---- */

/* Adds a texture with an image: as it was in its file where that was PNG or JPEG, which glTF allows, otherwise as PNG. */
static void add_picture(struct gltf *g, const struct picture *picture)
{
    static const unsigned char png_sign[4] = {0x89, 'P', 'N', 'G'}, jpeg_sign[3] = {0xFF, 0xD8, 0xFF};
    const bool png = picture->size > 4 && memcmp(picture->bytes, png_sign, 4) == 0,
               jpeg = picture->size > 3 && memcmp(picture->bytes, jpeg_sign, 3) == 0;
    unsigned char *made = NULL;
    size_t size = picture->size;
    if (!png && !jpeg && !byte_image_encode_png(&picture->image, &made, &size)) {
        g->failed = true;
        return;
    }
    const int view = add_view(g, made ? made : picture->bytes, size, GLTF_NO_TARGET);
    int index;
    cJSON *image = gltf_add(g, "images", &index);
    gltf_number(image, "bufferView", view);
    cJSON_AddStringToObject(image, "mimeType", jpeg ? "image/jpeg" : "image/png");
    gltf_number(gltf_add(g, "textures", NULL), "source", index);
    free(made);
}

static void add_material(struct gltf *g, const struct material *m, int first_texture)
{
    static const char *const alpha[] = {"OPAQUE", "MASK", "BLEND"};
    cJSON *made = gltf_add(g, "materials", NULL), *pbr = cJSON_AddObjectToObject(made, "pbrMetallicRoughness");
    double base[4];
    bool white = true;
    for (int i = 0; i < 4; ++i) {
        base[i] = fmax(0.0, fmin(1.0, (double)m->base[i]));
        white = white && base[i] == 1.0;
    }
    if (m->name[0]) {
        cJSON_AddStringToObject(made, "name", m->name);
    }
    if (!white) {
        gltf_numbers(pbr, "baseColorFactor", base, 4);
    }
    if (m->image >= 0) {
        gltf_number(cJSON_AddObjectToObject(pbr, "baseColorTexture"), "index", first_texture + m->image);
    }
    gltf_number(pbr, "metallicFactor", fmax(0.0, fmin(1.0, (double)m->metallic)));
    gltf_number(pbr, "roughnessFactor", fmax(0.0, fmin(1.0, (double)m->roughness)));
    if (m->alpha != MATERIAL_OPAQUE) {
        cJSON_AddStringToObject(made, "alphaMode", alpha[m->alpha]);
    }
    if (m->alpha == MATERIAL_MASK) {
        gltf_number(made, "alphaCutoff", (double)m->cutoff);
    }
    if (m->two_sided) {
        cJSON_AddTrueToObject(made, "doubleSided");
    }
}

int gltf_materials(struct gltf *g, const struct gltf_look *look)
{
    const int first = cJSON_GetArraySize(cJSON_GetObjectItem(g->root, "materials")),
              texture = cJSON_GetArraySize(cJSON_GetObjectItem(g->root, "textures"));
    const struct material plain = material_plain();
    for (int p = 0; look && p < look->picture_count; ++p) {
        add_picture(g, &look->pictures[p]);
    }
    for (int m = 0; look && m < look->material_count; ++m) {
        add_material(g, &look->materials[m], texture);
    }
    if (!look || look->material_count == 0) {
        add_material(g, &plain, texture);
    }
    return first;
}

/* ---- meshes ---- */

/* Adds vertex colors, which are linear in glTF. */
static int add_colors(struct gltf *g, const struct gltf_mesh *mesh)
{
    uint16_t *linear = malloc(8 * (size_t)mesh->vertex_count + 8);
    int index = 0;
    g->failed = g->failed || !linear;
    for (int v = 0; linear && v < mesh->vertex_count; ++v) {
        for (int i = 0; i < 3; ++i) {
            linear[4 * v + i] = (uint16_t)(65535.0f * color_linear(mesh->colors[3 * v + i]) + 0.5f);
        }
        linear[4 * v + 3] = 65535;
    }
    if (linear) {
        index = gltf_shorts(g, linear, mesh->vertex_count, 4, true);
    }
    free(linear);
    return index;
}

static cJSON *add_attributes(struct gltf *g, const struct gltf_mesh *mesh, bool textured)
{
    cJSON *attributes = cJSON_CreateObject();
    const int count = mesh->vertex_count;
    gltf_number(attributes, "POSITION", gltf_floats(g, mesh->positions, count, 3, GLTF_VERTICES, true));
    if (mesh->normals) {
        gltf_number(attributes, "NORMAL", gltf_floats(g, mesh->normals, count, 3, GLTF_VERTICES, false));
    }
    if (mesh->uvs && textured) {
        gltf_number(attributes, "TEXCOORD_0", gltf_floats(g, mesh->uvs, count, 2, GLTF_VERTICES, false));
    }
    if (mesh->colors) {
        gltf_number(attributes, "COLOR_0", add_colors(g, mesh));
    }
    if (mesh->joints) {
        gltf_number(attributes, "JOINTS_0", gltf_shorts(g, mesh->joints, count, 4, false));
        gltf_number(attributes, "WEIGHTS_0", gltf_floats(g, mesh->weights, count, 4, GLTF_VERTICES, false));
    }
    return attributes;
}

/* Copies the corners of the triangles of a material; returns how many. */
static int corners_of(const struct gltf_mesh *mesh, int material, int *corners)
{
    int count = 0;
    for (int t = 0; t < mesh->triangle_count; ++t) {
        if ((mesh->materials_of ? mesh->materials_of[t] : 0) == material) {
            memcpy(corners + count, mesh->triangles + 3 * t, 3 * sizeof *corners);
            count += 3;
        }
    }
    return count;
}

void gltf_mesh(struct gltf *g, const struct gltf_mesh *mesh, const struct gltf_look *look, int first_material)
{
    cJSON *primitives = cJSON_AddArrayToObject(gltf_add(g, "meshes", NULL), "primitives"), *attributes = NULL;
    int *corners = malloc((3 * (size_t)mesh->triangle_count + 1) * sizeof *corners);
    const int materials = look && look->material_count > 0 ? look->material_count : 1;
    bool textured = false;
    g->failed = g->failed || !corners;
    for (int m = 0; look && m < look->material_count; ++m) {
        textured = textured || look->materials[m].image >= 0;
    }
    for (int m = 0; corners && m < materials; ++m) {
        const int count = corners_of(mesh, m, corners);
        cJSON *primitive = count > 0 ? cJSON_CreateObject() : NULL;
        if (!primitive || !cJSON_AddItemToArray(primitives, primitive)) {
            continue;
        }
        attributes = attributes ? cJSON_Duplicate(attributes, true) : add_attributes(g, mesh, textured);
        cJSON_AddItemToObject(primitive, "attributes", attributes);
        gltf_number(primitive, "indices", add_indices(g, corners, count, mesh->vertex_count));
        gltf_number(primitive, "material", first_material + m);
    }
    g->failed = g->failed || !attributes;
    free(corners);
}

/* ---- animations and scenes ---- */

cJSON *gltf_animation(struct gltf *g, const char *name)
{
    cJSON *made = gltf_add(g, "animations", NULL);
    cJSON_AddStringToObject(made, "name", name);
    cJSON_AddArrayToObject(made, "samplers");
    cJSON_AddArrayToObject(made, "channels");
    return made;
}

void gltf_channel(struct gltf *g, cJSON *animation, int node, const char *path, int times, const float *values, int count,
                  int width, const char *interpolation)
{
    cJSON *samplers = cJSON_GetObjectItem(animation, "samplers"), *sampler = cJSON_CreateObject(), *channel = cJSON_CreateObject();
    g->failed = g->failed || !cJSON_AddItemToArray(samplers, sampler)
        || !cJSON_AddItemToArray(cJSON_GetObjectItem(animation, "channels"), channel);
    if (g->failed) {
        return;
    }
    gltf_number(sampler, "input", times);
    gltf_number(sampler, "output", gltf_floats(g, values, count, width, GLTF_NO_TARGET, false));
    cJSON_AddStringToObject(sampler, "interpolation", interpolation);
    gltf_number(channel, "sampler", cJSON_GetArraySize(samplers) - 1);
    cJSON *target = cJSON_AddObjectToObject(channel, "target");
    gltf_number(target, "node", node);
    cJSON_AddStringToObject(target, "path", path);
}

void gltf_scene(struct gltf *g, const int *roots, int count)
{
    cJSON_AddItemToObject(gltf_add(g, "scenes", NULL), "nodes", cJSON_CreateIntArray(roots, count));
}
