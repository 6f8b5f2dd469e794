/* gltf_look.c - materials and images of a glTF file. */
#include "surface/gltf_scene.h"

#include "surface/scene_files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Reads the bytes of an image; *bytes: NULL where they cannot be had, which is told where the picture is missed. */
static bool image_bytes(struct gltf_scene *g, int image, unsigned char **bytes, size_t *size)
{
    const cJSON *item = g->file.items[GLTF_IMAGES][image], *uri = gltf_member(item, "uri");
    int view;
    *bytes = NULL;
    *size = 0;
    if (cJSON_IsString(uri)) {
        *bytes = gltf_read_uri(&g->file, uri->valuestring, size);
        return true;
    }
    if (!gltf_reference(&g->file, item, "bufferView", GLTF_VIEWS, &view)) {
        return false;
    }
    const struct gltf_bytes *from = view >= 0 ? gltf_view(&g->file, view) : NULL;
    if (!from) {
        return view < 0;
    }
    *bytes = malloc(from->size);
    *size = from->size;
    if (*bytes) {
        memcpy(*bytes, from->at, from->size);
    }
    return *bytes || gltf_no_memory(g);
}

/* Finds or reads the image of a texture. */
static bool find_picture(struct gltf_scene *g, int texture, int *picture)
{
    int image;
    if (!gltf_reference(&g->file, g->file.items[GLTF_TEXTURES][texture], "source", GLTF_IMAGES, &image)) {
        return false;
    }
    *picture = image >= 0 ? g->picture_of[image] : GLTF_NO_PICTURE; /* without a source: in a format of an extension */
    if (*picture == GLTF_NEW_PICTURE) {
        unsigned char *bytes;
        size_t size;
        if (!image_bytes(g, image, &bytes, &size)) {
            return false;
        }
        *picture = scene_take_picture(&g->to->pictures[g->to->picture_count], bytes, size) ? g->to->picture_count++ : GLTF_NO_PICTURE;
        g->picture_of[image] = *picture;
    }
    g->to->missing_pictures += *picture == GLTF_NO_PICTURE;
    return true;
}

/* Reads how KHR_texture_transform moves the coordinates of a texture, and their set. */
static void read_uv_map(struct gltf_scene *g, const cJSON *texture, int material)
{
    const cJSON *transform = gltf_extension(texture, "KHR_texture_transform"), *turn = gltf_member(transform, "rotation");
    double offset[2] = {0.0, 0.0}, scale[2] = {1.0, 1.0};
    const double set = gltf_whole(transform, "texCoord", gltf_whole(texture, "texCoord", 0.0)),
                 angle = cJSON_IsNumber(turn) && isfinite(turn->valuedouble) ? turn->valuedouble : 0.0;
    struct uv_map *map = &g->uv_map[material];
    gltf_read_numbers(gltf_member(transform, "offset"), offset, 2);
    gltf_read_numbers(gltf_member(transform, "scale"), scale, 2);
    g->uv_set[material] = set >= 0.0 && set < 100.0 ? (int)set : 0;
    map->cosine = (float)cos(angle);
    map->sine = (float)sin(angle);
    for (int i = 0; i < 2; ++i) {
        map->offset[i] = (float)offset[i];
        map->scale[i] = (float)scale[i];
    }
}

static float share(const cJSON *object, const char *name, float otherwise)
{
    const cJSON *item = gltf_member(object, name);
    const double value = cJSON_IsNumber(item) ? item->valuedouble : (double)otherwise;
    return isfinite(value) ? (float)fmax(0.0, fmin(1.0, value)) : otherwise;
}

static bool read_material(struct gltf_scene *g, int number)
{
    const cJSON *item = g->file.items[GLTF_MATERIALS][number], *pbr = gltf_member(item, "pbrMetallicRoughness"),
                *older = gltf_extension(item, "KHR_materials_pbrSpecularGlossiness"),
                *name = gltf_member(item, "name"), *alpha = gltf_member(item, "alphaMode"),
                *texture = gltf_member(pbr ? pbr : older, pbr ? "baseColorTexture" : "diffuseTexture");
    struct material *made = &g->to->materials[number];
    double base[4] = {1.0, 1.0, 1.0, 1.0};
    int image;
    *made = material_plain();
    gltf_read_numbers(gltf_member(pbr ? pbr : older, pbr ? "baseColorFactor" : "diffuseFactor"), base, 4);
    for (int i = 0; i < 4; ++i) {
        made->base[i] = isfinite(base[i]) ? (float)fmax(0.0, fmin(1.0, base[i])) : 1.0f;
    }
    snprintf(made->name, sizeof made->name, "%.*s", MATERIAL_NAME - 1, cJSON_IsString(name) ? name->valuestring : "");
    made->metallic = share(pbr, "metallicFactor", pbr || !older ? 1.0f : 0.0f);
    made->roughness = share(pbr, "roughnessFactor", 1.0f);
    made->cutoff = share(item, "alphaCutoff", made->cutoff);
    made->two_sided = cJSON_IsTrue(gltf_member(item, "doubleSided"));
    if (cJSON_IsString(alpha)) {
        made->alpha = strcmp(alpha->valuestring, "MASK") == 0  ? MATERIAL_MASK
                      : strcmp(alpha->valuestring, "BLEND") == 0 ? MATERIAL_BLEND
                                                                 : MATERIAL_OPAQUE;
    }
    if (g->extent == SCENE_SHAPE || !texture) {
        return true;
    }
    if (!gltf_reference(&g->file, texture, "index", GLTF_TEXTURES, &image)) {
        return false;
    }
    read_uv_map(g, texture, number);
    return image < 0 || find_picture(g, image, &made->image);
}

/* Reads all materials, and behind them the one of primitives that name none: white metal, 3.9. */
bool gltf_read_materials(struct gltf_scene *g)
{
    struct scene *to = g->to;
    const int count = g->file.counts[GLTF_MATERIALS], images = g->file.counts[GLTF_IMAGES];
    to->materials = calloc((size_t)count + 1, sizeof *to->materials);
    to->pictures = calloc((size_t)images + 1, sizeof *to->pictures);
    g->picture_of = malloc(((size_t)images + 1) * sizeof *g->picture_of);
    g->uv_set = calloc((size_t)count + 1, sizeof *g->uv_set);
    g->uv_map = malloc(((size_t)count + 1) * sizeof *g->uv_map);
    if (!to->materials || !to->pictures || !g->picture_of || !g->uv_set || !g->uv_map) {
        return gltf_no_memory(g);
    }
    for (int i = 0; i < images; ++i) {
        g->picture_of[i] = GLTF_NEW_PICTURE;
    }
    bool good = true;
    for (int m = 0; good && m < count; ++m) {
        g->uv_map[m] = uv_map_none();
        good = read_material(g, m);
    }
    g->uv_map[count] = uv_map_none();
    to->materials[count] = material_plain();
    to->materials[count].metallic = to->materials[count].roughness = 1.0f;
    to->material_count = count + 1;
    return good;
}
