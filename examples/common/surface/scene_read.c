/* scene_read.c - chooses the reader of a file, and checks before what assimp trusts: it ends the program, or goes on for ever, where
 * that does not hold. */
#define _POSIX_C_SOURCE 200809L
#include "surface/assimp_scene.h"
#include "surface/gltf_scene.h"
#include "surface/ply_check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LONGEST_LINE = 4096 };

/* ---- files: assimp reserves memory for any count, and reads beyond the end of what is not whole ---- */

struct header {
    const char *path;
    FILE *file;
    long size; /* of the file, where an element takes at least one byte */
    char line[LONGEST_LINE];
    bool gltf; /* checks itself */
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
    count[0] = ply_whole_number(words[0]);
    count[1] = ply_whole_number(words[1]);
    return count[0] >= 0.0 && count[1] >= 0.0;
}

/* Returns whether as many vertices and faces follow as the counts behind the first word promise. assimp reads beyond the end of a file in
   which lines are missing, and takes other vertices for those that do not exist. */
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

static bool ends_with(const char *text, const char *end)
{
    const size_t length = strlen(text), tail = strlen(end);
    return length >= tail && strcasecmp(text + length - tail, end) == 0;
}

/* Returns whether a binary STL file has as many triangles as its header promises; assimp names another reason. */
static bool stl_is_whole(struct header *h)
{
    unsigned char bytes[84];
    rewind(h->file);
    if (fread(bytes, 1, sizeof bytes, h->file) != sizeof bytes
        || (strncasecmp(h->line, "solid", 5) == 0 && !memchr(bytes, '\0', sizeof bytes))) { /* a text */
        return true;
    }
    const double count = bytes[80] + 256.0 * (bytes[81] + 256.0 * (bytes[82] + 256.0 * bytes[83]));
    return 84.0 + 50.0 * count <= (double)h->size
           || scene_fail(h->error, h->path, "the header promises %.0f triangles, the file has room for %.0f", count,
                         floor((double)(h->size - 84) / 50.0));
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
    if (memcmp(h->line, "glTF", 4) == 0 || ends_with(h->path, ".gltf")) {
        h->gltf = true;
        return true;
    }
    if (ends_with(h->path, ".stl")) {
        return stl_is_whole(h);
    }
    const char *off = h->line + strspn(h->line, "STCN4n"); /* what its vertices have beside their places */
    if (strncmp(off, "OFF", 3) == 0) {
        return off_is_whole(h, off + 3);
    }
    return !is_off || scene_fail(h->error, h->path, "an OFF file begins with OFF");
}

/* Checks what assimp trusts; *gltf: the file is glTF of some version. */
static bool file_is_good(const char *path, bool *gltf, char error[SCENE_TEXT])
{
    struct header h = {.path = path, .file = fopen(path, "rb"), .error = error};
    if (!h.file) {
        return scene_fail(error, path, "cannot open");
    }
    const bool good = header_is_good(&h);
    *gltf = h.gltf;
    fclose(h.file);
    return good;
}

static bool read_gltf(const char *path, enum scene_extent extent, struct scene *scene, char error[SCENE_TEXT])
{
    struct gltf_file file;
    const enum gltf_version version = gltf_open(path, &file, error);
    if (version == GLTF_2) {
        return gltf_scene_read(&file, extent, scene);
    }
    gltf_close(&file);
    return version == GLTF_1 && assimp_scene_read(path, extent, scene, error);
}

bool scene_read(const char *path, enum scene_extent extent, struct scene *scene, char error[SCENE_TEXT])
{
    bool gltf = false;
    memset(scene, 0, sizeof *scene);
    error[0] = '\0';
    if (!file_is_good(path, &gltf, error)) {
        return false;
    }
    const bool good = gltf ? read_gltf(path, extent, scene, error) : assimp_scene_read(path, extent, scene, error);
    scene->linear = gltf;
    if (!good) {
        scene_free(scene);
    }
    return good;
}
