#include "surface/scene_files.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

unsigned char *scene_read_file(const char *path, size_t *size)
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

unsigned char *scene_read_beside(const char *path, const char *name, size_t *size)
{
    const char *slash = strrchr(path, '/');
    const size_t folder = slash ? (size_t)(slash - path + 1) : 0, length = folder + strlen(name) + 1;
    char *beside = malloc(length);
    if (!beside) {
        return NULL;
    }
    memcpy(beside, path, folder);
    memcpy(beside + folder, name, length - folder);
    unsigned char *bytes = scene_read_file(beside, size);
    if (!bytes) {
        decode_uri(beside + folder);
        bytes = scene_read_file(beside, size);
    }
    free(beside);
    return bytes;
}

bool scene_take_picture(struct picture *picture, unsigned char *bytes, size_t size)
{
    memset(picture, 0, sizeof *picture);
    if (bytes && byte_image_read(bytes, size, &picture->image)) {
        picture->bytes = bytes;
        picture->size = size;
        return true;
    }
    free(bytes);
    memset(picture, 0, sizeof *picture);
    return false;
}
