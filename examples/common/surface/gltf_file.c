#include "surface/gltf_file.h"

#include "surface/scene.h"
#include "surface/scene_files.h"

#include <meshoptimizer.h>

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct list {
    const char *name, *one;
} lists[GLTF_LISTS] = {{"buffers", "buffer"},     {"bufferViews", "buffer view"}, {"accessors", "accessor"}, {"scenes", "scene"},
                       {"nodes", "node"},         {"meshes", "mesh"},             {"skins", "skin"},         {"materials", "material"},
                       {"textures", "texture"},   {"images", "image"},            {"animations", "animation"}};

/* What a file may require: what is read, and what changes only the light on a surface or its picture (an image that cannot be decoded
 * is told). */
static const char *const known_extensions[] = {"KHR_mesh_quantization", "KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                               "KHR_texture_transform", "KHR_lights_punctual",        "KHR_texture_basisu",
                                               "EXT_texture_webp",      "EXT_texture_avif",           NULL};

/* ---- JSON ---- */

static bool fail(struct gltf_file *file, const char *text) { return scene_fail(file->error, file->path, "%s", text); }

bool gltf_fail(struct gltf_file *file, enum gltf_list list, int number, const char *format, ...)
{
    char text[SCENE_TEXT];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return scene_fail(file->error, file->path, "%s %d: %s", lists[list].one, number, text);
}

const cJSON *gltf_member(const cJSON *object, const char *name) { return cJSON_GetObjectItemCaseSensitive(object, name); }

const cJSON *gltf_extension(const cJSON *object, const char *name) { return gltf_member(gltf_member(object, "extensions"), name); }

double gltf_whole(const cJSON *object, const char *name, double otherwise)
{
    const cJSON *item = gltf_member(object, name);
    if (!item) {
        return otherwise;
    }
    const double value = item->valuedouble;
    return cJSON_IsNumber(item) && value >= 0.0 && value <= 9007199254740992.0 && floor(value) == value ? value : -1.0;
}

bool gltf_reference(struct gltf_file *file, const cJSON *object, const char *name, enum gltf_list list, int *number)
{
    const double value = gltf_whole(object, name, -2.0);
    *number = value >= 0.0 && value < file->counts[list] ? (int)value : -1;
    return *number >= 0 || value == -2.0
        || scene_fail(file->error, file->path, "%s names %s %s that there is not", name,
                      strchr("aeiou", lists[list].one[0]) ? "an" : "a", lists[list].one);
}

bool gltf_read_numbers(const cJSON *list, double *numbers, int count)
{
    const cJSON *item;
    bool good = !list || cJSON_IsArray(list);
    int k = 0;
    cJSON_ArrayForEach(item, list) {
        if (k < count) {
            good = good && cJSON_IsNumber(item) && isfinite(item->valuedouble);
            numbers[k++] = item->valuedouble;
        }
    }
    return good;
}

/* Makes an array of each list. Items are objects. */
static bool index_lists(struct gltf_file *file)
{
    for (int l = 0; l < GLTF_LISTS; ++l) {
        const cJSON *list = gltf_member(file->root, lists[l].name), *item;
        if (list && !cJSON_IsArray(list)) {
            return scene_fail(file->error, file->path, "%s is no list", lists[l].name);
        }
        file->items[l] = malloc(((size_t)cJSON_GetArraySize(list) + 1) * sizeof *file->items[l]);
        if (!file->items[l]) {
            return fail(file, "not enough memory");
        }
        cJSON_ArrayForEach(item, list) {
            if (!cJSON_IsObject(item)) {
                return gltf_fail(file, (enum gltf_list)l, file->counts[l], "it is no object");
            }
            file->items[l][file->counts[l]++] = item;
        }
    }
    file->buffers = calloc((size_t)file->counts[GLTF_BUFFERS] + 1, sizeof *file->buffers);
    file->views = calloc((size_t)file->counts[GLTF_VIEWS] + 1, sizeof *file->views);
    return (file->buffers && file->views) || fail(file, "not enough memory");
}

static bool extension_is_known(const char *name)
{
    bool known = strncmp(name, "KHR_materials_", 14) == 0;
    for (int i = 0; !known && known_extensions[i]; ++i) {
        known = strcmp(name, known_extensions[i]) == 0;
    }
    return known;
}

static bool extensions_are_known(struct gltf_file *file)
{
    const cJSON *name;
    cJSON_ArrayForEach(name, gltf_member(file->root, "extensionsRequired")) {
        if (!cJSON_IsString(name) || !extension_is_known(name->valuestring)) {
            return scene_fail(file->error, file->path, "it requires the extension %.80s, which is not known here",
                              cJSON_IsString(name) ? name->valuestring : "?");
        }
    }
    return true;
}

/* Reads the version that the asset has; an older reader may do where it names one. */
static enum gltf_version find_version(struct gltf_file *file)
{
    const cJSON *asset = gltf_member(file->root, "asset"), *version = gltf_member(asset, "version"),
                *least = gltf_member(asset, "minVersion");
    const char *needed = cJSON_IsString(least) ? least->valuestring : cJSON_IsString(version) ? version->valuestring : NULL;
    if (!needed) {
        fail(file, "no glTF file: its asset has no version");
        return GLTF_BROKEN;
    }
    if (strncmp(needed, "1.", 2) == 0) {
        return GLTF_1;
    }
    if (least ? strcmp(needed, "2.0") != 0 : strncmp(needed, "2.", 2) != 0) {
        scene_fail(file->error, file->path, "version %.20s of glTF, 2.0 is read", needed);
        return GLTF_BROKEN;
    }
    return GLTF_2;
}

static enum gltf_version read_json(struct gltf_file *file, const unsigned char *text, size_t length)
{
    const char *end = NULL;
    file->root = cJSON_ParseWithLengthOpts((const char *)text, length, &end, 0);
    if (!cJSON_IsObject(file->root)) {
        scene_fail(file->error, file->path, "no glTF file: its JSON is broken at byte %ld",
                   end ? (long)(end - (const char *)text) : 0L);
        return GLTF_BROKEN;
    }
    const enum gltf_version version = find_version(file);
    return version == GLTF_2 && !(extensions_are_known(file) && index_lists(file)) ? GLTF_BROKEN : version;
}

/* ---- the container ---- */

/* Returns a number of four bytes, the lowest first. */
static size_t number_of(const unsigned char bytes[4])
{
    return bytes[0] | (size_t)bytes[1] << 8 | (size_t)bytes[2] << 16 | (size_t)bytes[3] << 24;
}

/* Reads the chunks of a GLB file: JSON, then perhaps binary, then what is not known; each has its length and its kind before it.
 * Behind the length that the file's header has, there may be anything. */
static enum gltf_version read_chunks(struct gltf_file *file)
{
    enum { FILE_HEADER = 12, CHUNK_HEADER = 8, JSON_CHUNK = 0x4E4F534A, BINARY_CHUNK = 0x004E4942 };
    if (file->size < FILE_HEADER) {
        fail(file, "the GLB file ends in its header");
        return GLTF_BROKEN;
    }
    const size_t version = number_of(file->content + 4), total = number_of(file->content + 8);
    const size_t end = total < file->size ? total : file->size;
    const unsigned char *json = NULL;
    size_t json_size = 0;
    if (version != 2) {
        scene_fail(file->error, file->path, "version %zu of GLB, 2 is read", version);
        return version == 1 ? GLTF_1 : GLTF_BROKEN;
    }
    for (size_t at = FILE_HEADER, number = 0; at < end; ++number) {
        if (file->size - at < CHUNK_HEADER) {
            fail(file, "the GLB file ends in the middle of a chunk");
            return GLTF_BROKEN;
        }
        const size_t length = number_of(file->content + at), kind = number_of(file->content + at + 4);
        const size_t left = file->size - at - CHUNK_HEADER;
        if (length > left) {
            scene_fail(file->error, file->path, "a chunk of the GLB file has %zu bytes, but the file ends after %zu of them",
                       length, left);
            return GLTF_BROKEN;
        }
        at += CHUNK_HEADER;
        if (number == 0 && kind == JSON_CHUNK) {
            json = file->content + at;
            json_size = length;
        } else if (number == 1 && kind == BINARY_CHUNK) {
            file->binary.at = file->content + at;
            file->binary.size = length;
        }
        at += length;
    }
    if (!json) {
        fail(file, "the GLB file has no JSON");
        return GLTF_BROKEN;
    }
    return read_json(file, json, json_size);
}

enum gltf_version gltf_open(const char *path, struct gltf_file *file, char *error)
{
    memset(file, 0, sizeof *file);
    file->path = path;
    file->error = error;
    file->content = scene_read_file(path, &file->size);
    if (!file->content) {
        fail(file, "it cannot be read, or has more than 2 GB");
        return GLTF_BROKEN;
    }
    return file->size >= 4 && memcmp(file->content, "glTF", 4) == 0 ? read_chunks(file)
                                                                    : read_json(file, file->content, file->size);
}

void gltf_close(struct gltf_file *file)
{
    for (int b = 0; file->buffers && b < file->counts[GLTF_BUFFERS]; ++b) {
        free(file->buffers[b].owned);
    }
    for (int v = 0; file->views && v < file->counts[GLTF_VIEWS]; ++v) {
        free(file->views[v].owned);
    }
    for (int l = 0; l < GLTF_LISTS; ++l) {
        free(file->items[l]);
    }
    free(file->buffers);
    free(file->views);
    cJSON_Delete(file->root);
    free(file->content);
    memset(file, 0, sizeof *file);
}

/* ---- bytes ---- */

/* Decodes base64 up to its end or padding (RFC 4648); to be freed. */
static unsigned char *decode_base64(const char *text, size_t *size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned char *bytes = malloc(strlen(text) / 4 * 3 + 4);
    unsigned word = 0;
    int bits = 0;
    *size = 0;
    for (; bytes && *text && *text != '='; ++text) {
        const char *digit = strchr(digits, *text);
        if (!digit) {
            free(bytes);
            return NULL;
        }
        word = (word << 6 | (unsigned)(digit - digits)) & 0xffffu;
        bits += 6;
        if (bits >= 8) {
            bits -= 8;
            bytes[(*size)++] = (unsigned char)(word >> bits & 0xffu);
        }
    }
    return bytes;
}

unsigned char *gltf_read_uri(const struct gltf_file *file, const char *uri, size_t *size)
{
    static const char base64[] = ";base64,";
    *size = 0;
    if (strncmp(uri, "data:", 5) != 0) {
        return scene_read_beside(file->path, uri, size);
    }
    const char *data = strstr(uri, base64);
    return data ? decode_base64(data + sizeof base64 - 1, size) : NULL;
}

/* Returns the bytes of a buffer. Only the first may be that of the GLB file. */
static const struct gltf_bytes *read_buffer(struct gltf_file *file, int number)
{
    struct gltf_bytes *buffer = &file->buffers[number];
    const cJSON *item = file->items[GLTF_BUFFERS][number], *uri = gltf_member(item, "uri");
    if (buffer->read) {
        return buffer;
    }
    if (cJSON_IsString(uri)) {
        buffer->at = buffer->owned = gltf_read_uri(file, uri->valuestring, &buffer->size);
    } else if (number == 0) {
        *buffer = file->binary;
    }
    const double length = gltf_whole(item, "byteLength", -1.0);
    if (!buffer->at) {
        gltf_fail(file, GLTF_BUFFERS, number, cJSON_IsString(uri) ? "%.100s cannot be read" : "it has no bytes",
                  cJSON_IsString(uri) && strncmp(uri->valuestring, "data:", 5) != 0 ? uri->valuestring : "its data");
        return NULL;
    }
    if (length < 0.0 || length > (double)buffer->size) {
        gltf_fail(file, GLTF_BUFFERS, number, "its length is wrong or more than the %zu bytes that there are", buffer->size);
        return NULL;
    }
    buffer->size = (size_t)length;
    buffer->read = true;
    return buffer;
}

/* Finds the bytes that a view, or its compression, names. */
static bool find_bytes(struct gltf_file *file, int view, const cJSON *item, struct gltf_bytes *bytes)
{
    int buffer;
    if (!gltf_reference(file, item, "buffer", GLTF_BUFFERS, &buffer)) {
        return false;
    }
    const struct gltf_bytes *from = buffer >= 0 ? read_buffer(file, buffer) : NULL;
    const double offset = gltf_whole(item, "byteOffset", 0.0), length = gltf_whole(item, "byteLength", -1.0),
                 stride = gltf_whole(item, "byteStride", 0.0);
    if (!from) {
        return buffer >= 0 ? false : gltf_fail(file, GLTF_VIEWS, view, "it names no buffer");
    }
    if (offset < 0.0 || length < 1.0 || offset + length > (double)from->size) {
        return gltf_fail(file, GLTF_VIEWS, view, "it is not within buffer %d, which has %zu bytes", buffer, from->size);
    }
    if (stride < 0.0 || stride > 256.0) {
        return gltf_fail(file, GLTF_VIEWS, view, "its stride is none of 4 to 252 bytes");
    }
    bytes->at = from->at + (size_t)offset;
    bytes->size = (size_t)length;
    bytes->stride = (size_t)stride;
    return true;
}

static bool is(const cJSON *object, const char *name, const char *value, bool otherwise)
{
    const cJSON *item = gltf_member(object, name);
    return item ? cJSON_IsString(item) && strcmp(item->valuestring, value) == 0 : otherwise;
}

/* Undoes the filter of EXT_meshopt_compression; false where there is no such filter for elements of that size. */
static bool undo_filter(const cJSON *item, unsigned char *bytes, size_t count, size_t stride)
{
    if (is(item, "filter", "NONE", true)) {
        return true;
    }
    if (is(item, "filter", "OCTAHEDRAL", false) && (stride == 4 || stride == 8)) {
        meshopt_decodeFilterOct(bytes, count, stride);
    } else if (is(item, "filter", "QUATERNION", false) && stride == 8) {
        meshopt_decodeFilterQuat(bytes, count, stride);
    } else if (is(item, "filter", "EXPONENTIAL", false) && stride % 4 == 0) {
        meshopt_decodeFilterExp(bytes, count, stride);
    } else {
        return false;
    }
    return true;
}

/* Decodes by meshoptimizer, whose decoders take any bytes, but only these sizes; returns whether that worked. */
static bool decode_meshopt(const cJSON *item, const struct gltf_bytes *from, unsigned char *to, size_t count)
{
    const size_t stride = from->stride;
    if (is(item, "mode", "ATTRIBUTES", false)) {
        return stride % 4 == 0 && meshopt_decodeVertexBuffer(to, count, stride, from->at, from->size) == 0
            && undo_filter(item, to, count, stride);
    }
    if (stride != 2 && stride != 4) {
        return false;
    }
    if (is(item, "mode", "TRIANGLES", false)) {
        return count % 3 == 0 && meshopt_decodeIndexBuffer(to, count, stride, from->at, from->size) == 0;
    }
    return is(item, "mode", "INDICES", false) && meshopt_decodeIndexSequence(to, count, stride, from->at, from->size) == 0;
}

/* Decompresses a view. A byte of the file stands for at most 64 of a vertex buffer and fewer indices. */
static bool decompress(struct gltf_file *file, int view, const cJSON *compression, struct gltf_bytes *bytes)
{
    enum { MOST_EXPANSION = 64, HEADER = 4096 };
    struct gltf_bytes from = {0};
    const double count = gltf_whole(compression, "count", -1.0);
    if (!find_bytes(file, view, compression, &from)) {
        return false;
    }
    const double size = count * (double)from.stride;
    if (count < 1.0 || size < 1.0 || size > MOST_EXPANSION * (double)from.size + HEADER) {
        return gltf_fail(file, GLTF_VIEWS, view, "its EXT_meshopt_compression promises more than it can contain");
    }
    bytes->owned = malloc((size_t)size);
    if (!bytes->owned) {
        return fail(file, "not enough memory");
    }
    bytes->at = bytes->owned;
    bytes->size = (size_t)size;
    bytes->stride = from.stride;
    return decode_meshopt(compression, &from, bytes->owned, (size_t)count)
        || gltf_fail(file, GLTF_VIEWS, view, "its EXT_meshopt_compression cannot be decoded");
}

const struct gltf_bytes *gltf_view(struct gltf_file *file, int view)
{
    struct gltf_bytes *bytes = &file->views[view];
    const cJSON *item = file->items[GLTF_VIEWS][view], *compression = gltf_extension(item, "EXT_meshopt_compression");
    if (!bytes->read) {
        bytes->read = compression ? decompress(file, view, compression, bytes) : find_bytes(file, view, item, bytes);
    }
    return bytes->read ? bytes : NULL;
}
