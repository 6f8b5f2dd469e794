/* image_read.c - decodes pictures by stb_image. */
#include "pictures/image.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Disable warnings in the third-party header. */
#if defined(__GNUC__)
    #pragma GCC diagnostic push
    #pragma GCC diagnostic ignored "-Wconversion"
    #pragma GCC diagnostic ignored "-Wsign-conversion"
    #pragma GCC diagnostic ignored "-Wunused-function"
    #pragma GCC diagnostic ignored "-Wunused-but-set-variable"
    #pragma GCC diagnostic ignored "-Wshadow"
#endif
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_NO_HDR
#define STBI_NO_LINEAR
#define STBI_NO_PNM /* 16 bits a channel, in another number of channels, are read beyond their end */
#define stbi_set_unpremultiply_on_load_thread stbi__unpremultiply_on_load_thread /* declared by one name, defined by the other */
#include <stb/stb_image.h>
#if defined(__GNUC__)
    #pragma GCC diagnostic pop
#endif

enum { MAX_PIXELS = 1 << 26 };

bool image_read(const unsigned char *bytes, size_t length, struct image *image)
{
    int width = 0, height = 0, channels = 0;
    memset(image, 0, sizeof *image);
    if (length > INT32_MAX || !stbi_info_from_memory(bytes, (int)length, &width, &height, &channels)
        || (int64_t)width * height > MAX_PIXELS) {
        return false;
    }
    unsigned char *pixels = stbi_load_from_memory(bytes, (int)length, &width, &height, &channels, 3);
    const bool good = pixels && image_create(image, width, height, color_rgb(1.0f, 1.0f, 1.0f));
    for (size_t i = 0; good && i < 3 * (size_t)width * (size_t)height; ++i) {
        image->rgb[i] = (float)pixels[i] / 255.0f;
    }
    stbi_image_free(pixels);
    return good;
}

bool image_read_file(const char *path, struct image *image)
{
    FILE *file = fopen(path, "rb");
    long length = -1;
    memset(image, 0, sizeof *image);
    if (file && fseek(file, 0, SEEK_END) == 0) {
        length = ftell(file);
        rewind(file);
    }
    unsigned char *bytes = length > 0 && length < INT32_MAX ? malloc((size_t)length) : NULL;
    const bool good =
        bytes && fread(bytes, 1, (size_t)length, file) == (size_t)length && image_read(bytes, (size_t)length, image);
    free(bytes);
    if (file) {
        fclose(file);
    }
    return good;
}
