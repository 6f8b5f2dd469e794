#define _POSIX_C_SOURCE 200809L
#include "surface/scene_read.h"

#include "surface/ply_check.h"

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <cjson/cJSON.h>

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LONGEST_LINE = 4096 };

bool scene_fail(char error[SCENE_TEXT], const char *path, const char *format, ...)
{
    const size_t length = strlen(path);
    const int used =
        snprintf(error, SCENE_TEXT, "%s%s: ", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error + used, SCENE_TEXT - (size_t)used, format, arguments);
    va_end(arguments);
    for (char *c = error; *c; ++c) { /* assimp's texts may contain line ends */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return false;
}

double scene_whole_number(const char *word)
{
    const size_t digits = strspn(word, "0123456789");
    return digits >= 1 && digits <= 15 && word[digits] == '\0' ? strtod(word, NULL) : -1.0;
}

/* ---- files: assimp reserves memory for any count, and reads beyond the end of what is not whole ---- */

struct header {
    const char *path;
    FILE *file;
    long size; /* of the file, where an element takes at least one byte */
    char line[LONGEST_LINE];
    char *error;
};

static bool count_fits(struct header *h, double count)
{
    return count <= (double)h->size
           || scene_fail(h->error, h->path, "the header promises %.0f elements, the file has %ld bytes", count, h->size);
}

/* Reads the next line that is neither blank nor a comment. */
static bool next_line(struct header *h)
{
    const char *text;
    do {
        if (!fgets(h->line, LONGEST_LINE, h->file)) {
            return false;
        }
        for (int c = 0; !strchr(h->line, '\n') && c != '\n' && c != EOF;) {
            c = fgetc(h->file);
        }
        text = h->line + strspn(h->line, " \t\r\n");
    } while (*text == '\0' || *text == '#');
    return true;
}

/* Returns whether the line of a face in an OFF file names 1 to 9 corners, which is what assimp reads, all of them vertices that
 * there are. */
static bool face_is_good(struct header *h, double number, double vertices)
{
    char *rest;
    const long corners = strtol(h->line, &rest, 10);
    if (corners < 1 || corners > 9) { return scene_fail(h->error, h->path, "face %.0f has not 1 to 9 corners", number); }
    for (long k = 0; k < corners; ++k) {
        const char *text = rest;
        const long vertex = strtol(text, &rest, 10);
        if (rest == text) { return scene_fail(h->error, h->path, "face %.0f has fewer than %ld corners", number, corners); }
        if (vertex < 0 || (double)vertex >= vertices) {
            return scene_fail(h->error, h->path, "face %.0f names vertex %ld of %.0f", number, vertex, vertices);
        }
    }
    return true;
}

/* Reads the numbers of vertices and faces, which stand behind the first word or on the line after it. */
static bool read_off_counts(struct header *h, const char *behind, double count[2])
{
    char words[2][32];
    const char first = behind[strspn(behind, " \t\r\n")];
    const char *text = first != '\0' && first != '#' ? behind : next_line(h) ? h->line : "";
    if (sscanf(text, "%31s %31s", words[0], words[1]) != 2) { return false; }
    count[0] = scene_whole_number(words[0]);
    count[1] = scene_whole_number(words[1]);
    return count[0] >= 0.0 && count[1] >= 0.0;
}

/* Returns whether as many vertices and faces follow as the counts behind the first word promise. assimp reads beyond the end of a file in which lines are missing, and takes other vertices for those that do not exist. */
static bool off_is_whole(struct header *h, const char *behind)
{
    double count[2];
    if (!read_off_counts(h, behind, count)) {
        return scene_fail(h->error, h->path, "the OFF file has no numbers of vertices and faces");
    }
    if (!count_fits(h, count[0]) || !count_fits(h, count[1])) {
        return false;
    }
    for (double i = 0.0; i < count[0] + count[1]; ++i) {
        if (!next_line(h)) {
            return scene_fail(h->error, h->path, "the OFF file ends before its %.0f vertices and %.0f faces", count[0], count[1]);
        }
        if (i >= count[0] && !face_is_good(h, i - count[0], count[0])) { return false; }
    }
    return true;
}

/* Returns whether each skin has the matrices that assimp reads; glTF allows skins without them. length: of its JSON, which begins at
 * `at`. What is no JSON is left to assimp. */
static bool skins_are_bound(struct header *h, long at, long length)
{
    char *text = malloc((size_t)length + 1);
    bool good = text != NULL && fseek(h->file, at, SEEK_SET) == 0;
    if (!good) {
        free(text);
        return scene_fail(h->error, h->path, "not enough memory");
    }
    cJSON *root = cJSON_ParseWithLength(text, fread(text, 1, (size_t)length, h->file));
    const cJSON *skin;
    cJSON_ArrayForEach(skin, cJSON_GetObjectItem(root, "skins")) { good = good && cJSON_GetObjectItem(skin, "inverseBindMatrices"); }
    cJSON_Delete(root);
    free(text);
    return good || scene_fail(h->error, h->path, "a skin has no inverseBindMatrices, without which it cannot be read");
}

/* Returns a number of four bytes, the lowest first. */
static double number_of(const unsigned char bytes[4])
{
    return bytes[0] + 256.0 * (bytes[1] + 256.0 * (bytes[2] + 256.0 * bytes[3]));
}

/* Returns whether the chunks of a GLB file of version 2 lie within it: each has its length and its kind, of four bytes, before it.
 * Behind the length that the file's header has, there may be anything. */
static bool glb_is_whole(struct header *h)
{
    enum { FILE_HEADER = 12, CHUNK_HEADER = 8 };
    unsigned char start[FILE_HEADER], chunk[CHUNK_HEADER];
    rewind(h->file);
    if (fread(start, 1, FILE_HEADER, h->file) != FILE_HEADER) {
        return scene_fail(h->error, h->path, "the GLB file ends in its header");
    }
    if (number_of(start + 4) != 2.0) {
        return true;
    }
    const double total = number_of(start + 8);
    for (long at = FILE_HEADER; at < h->size && (double)at < total;) {
        if (fseek(h->file, at, SEEK_SET) != 0 || fread(chunk, 1, CHUNK_HEADER, h->file) != CHUNK_HEADER) {
            return scene_fail(h->error, h->path, "the GLB file ends in the middle of a chunk");
        }
        const long left = h->size - at - CHUNK_HEADER;
        const double length = number_of(chunk);
        if (length > (double)left) {
            return scene_fail(h->error, h->path, "a chunk of the GLB file has %.0f bytes, but the file ends after %ld of them",
                              length, left);
        }
        if (at == FILE_HEADER && !skins_are_bound(h, at + CHUNK_HEADER, (long)length)) {
            return false;
        }
        at += CHUNK_HEADER + (long)length;
    }
    return true;
}

static bool ends_with(const char *text, const char *end)
{
    const size_t length = strlen(text), tail = strlen(end);
    return length >= tail && strcasecmp(text + length - tail, end) == 0;
}

static bool header_is_good(struct header *h)
{
    if (fseek(h->file, 0, SEEK_END) != 0) {
        return scene_fail(h->error, h->path, "not a regular file");
    }
    h->size = ftell(h->file);
    rewind(h->file);
    if (h->size <= 0) {
        return scene_fail(h->error, h->path, "empty file");
    }
    const bool is_off = ends_with(h->path, ".off");
    if (is_off ? !next_line(h) : !fgets(h->line, LONGEST_LINE, h->file)) {
        /* assimp reports what is missing */
        return !ferror(h->file) || scene_fail(h->error, h->path, "a folder, or a file that cannot be read");
    }
    if (strncasecmp(h->line, "ply", 3) == 0) {
        rewind(h->file);
        return ply_check(h->file, h->path, h->size, h->error);
    }
    if (ends_with(h->path, ".ply")) { /* assimp finds the word further on, and reads beyond the end */
        return scene_fail(h->error, h->path, "a PLY file begins with ply");
    }
    if (memcmp(h->line, "glTF", 4) == 0) {
        return glb_is_whole(h);
    }
    if (ends_with(h->path, ".gltf")) {
        return skins_are_bound(h, 0, h->size);
    }
    const char *off = h->line + strspn(h->line, "STCN4n"); /* what its vertices have beside their places */
    if (strncmp(off, "OFF", 3) == 0) {
        return off_is_whole(h, off + 3);
    }
    return !is_off || scene_fail(h->error, h->path, "an OFF file begins with OFF");
}

static bool file_is_good(const char *path, char error[SCENE_TEXT])
{
    struct header h = {.path = path, .file = fopen(path, "rb"), .error = error};
    if (!h.file) {
        return scene_fail(error, path, "cannot open");
    }
    const bool good = header_is_good(&h);
    fclose(h.file);
    return good;
}

/* ---- faces: assimp's steps end the program where one has no corners, and read beyond the vertices ---- */

static bool faces_are_good(const struct aiMesh *part, const char *path, char error[SCENE_TEXT])
{
    for (unsigned f = 0; f < part->mNumFaces; ++f) {
        const struct aiFace *face = &part->mFaces[f];
        if (face->mNumIndices == 0) {
            return scene_fail(error, path, "a face has no corners");
        }
        for (unsigned k = 0; k < face->mNumIndices; ++k) {
            if (face->mIndices[k] >= part->mNumVertices) {
                return scene_fail(error, path, "a face names vertex %d of %u", (int)face->mIndices[k],
                                  part->mNumVertices);
            }
        }
    }
    return true;
}

static bool all_faces_are_good(const struct aiScene *scene, const char *path, char error[SCENE_TEXT])
{
    bool good = true;
    for (unsigned m = 0; good && m < scene->mNumMeshes; ++m) {
        good = faces_are_good(scene->mMeshes[m], path, error);
    }
    return good;
}

static const struct aiScene *import(const char *path, unsigned steps, const struct aiPropertyStore *properties,
                                    char error[SCENE_TEXT])
{
    const struct aiScene *scene = aiImportFileExWithProperties(path, steps, NULL, properties);
    if (!scene) {
        const char *reason = aiGetErrorString();
        scene_fail(error, path, "%.180s", reason && *reason ? reason : "cannot be read");
    }
    return scene;
}

/* Reads the file twice, in a tenth of a second for 5 MB: aiApplyPostProcessing frees a scene twice where a step fails. */
const struct aiScene *scene_read(const char *path, unsigned steps, char error[SCENE_TEXT])
{
    error[0] = '\0';
    if (!file_is_good(path, error)) {
        return NULL;
    }
    struct aiPropertyStore *properties = aiCreatePropertyStore();
    if (!properties) {
        scene_fail(error, path, "not enough memory");
        return NULL;
    }
    aiSetImportPropertyInteger(properties, AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const struct aiScene *scene = import(path, 0, properties, error);
    if (scene) {
        const bool good = all_faces_are_good(scene, path, error);
        aiReleaseImport(scene);
        scene = good ? import(path, aiProcess_Triangulate | aiProcess_SortByPType | steps, properties, error) : NULL;
    }
    aiReleasePropertyStore(properties);
    return scene;
}
