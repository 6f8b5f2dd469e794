/* image_read.c - decodes pictures by stb_image. */
#include "pictures/image.h"

#include <math.h>
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

/* MAX_PIXELS_A_BYTE: the most pixels that a byte of a file can stand for: deflate turns a byte into at most 1032, each 8 pixels of a
 * black and white picture. Without this limit a short file could reserve much. */
enum { MAX_PIXELS = 1 << 26, MAX_PIXELS_A_BYTE = 8 * 1032 };

/* Returns whether the first IDAT chunk of a PNG is empty: stb_image would copy it to NULL. */
static bool png_data_is_empty(const unsigned char *bytes, size_t length)
{
    size_t at = 8; /* behind the signature */
    if (length < at || memcmp(bytes, "\x89PNG\r\n\x1a\n", 8) != 0) {
        return false;
    }
    while (length - at >= 8) { /* length and type; data and checksum follow unless the file is cut off */
        const unsigned char *chunk = bytes + at;
        const size_t size = (size_t)chunk[0] << 24 | (size_t)chunk[1] << 16 | (size_t)chunk[2] << 8 | chunk[3];
        if (memcmp(chunk + 4, "IDAT", 4) == 0) {
            return size == 0;
        }
        if (length - at < 12 || size > length - at - 12) {
            return false;
        }
        at += 12 + size;
    }
    return false;
}

bool byte_image_read(const unsigned char *bytes, size_t length, struct byte_image *image)
{
    int channels = 0;
    memset(image, 0, sizeof *image);
    const bool known = length <= INT32_MAX && !png_data_is_empty(bytes, length)
        && stbi_info_from_memory(bytes, (int)length, &image->width, &image->height, &channels);
    const int64_t pixels = (int64_t)image->width * image->height;
    if (known && pixels <= MAX_PIXELS && pixels <= (int64_t)length * MAX_PIXELS_A_BYTE) {
        image->rgb = stbi_load_from_memory(bytes, (int)length, &image->width, &image->height, &channels, 3);
    }
    if (!image->rgb) { memset(image, 0, sizeof *image); }
    return image->rgb != NULL;
}

void byte_image_free(struct byte_image *image)
{
    stbi_image_free(image->rgb);
    memset(image, 0, sizeof *image);
}

/* Returns a texel index; pixel centers are at half integers and the image repeats. */
static int texel(float u, int size, float *part)
{
    const float x = (u - floorf(u)) * (float)size - 0.5f, whole = floorf(x);
    *part = x - whole;
    return ((int)whole + size) % size;
}

void byte_image_sample(const struct byte_image *image, const float uv[2], float color[3])
{
    float s, t;
    const int x = texel(uv[0], image->width, &s), y = texel(uv[1], image->height, &t);
    const int x1 = (x + 1) % image->width, y1 = (y + 1) % image->height;
    const unsigned char *row = image->rgb + 3 * (size_t)y * (size_t)image->width,
                        *row1 = image->rgb + 3 * (size_t)y1 * (size_t)image->width;
    for (int k = 0; k < 3; ++k) {
        const float top = (1.0f - s) * ((float)row[3 * x + k] / 255.0f) + s * ((float)row[3 * x1 + k] / 255.0f);
        const float bottom = (1.0f - s) * ((float)row1[3 * x + k] / 255.0f) + s * ((float)row1[3 * x1 + k] / 255.0f);
        color[k] = (1.0f - t) * top + t * bottom;
    }
}

bool image_read(const unsigned char *bytes, size_t length, struct image *image)
{
    struct byte_image read;
    memset(image, 0, sizeof *image);
    const bool good = byte_image_read(bytes, length, &read)
        && image_create(image, read.width, read.height, color_rgb(1.0f, 1.0f, 1.0f));
    for (size_t i = 0; good && i < 3 * (size_t)read.width * (size_t)read.height; ++i) {
        image->rgb[i] = (float)read.rgb[i] / 255.0f;
    }
    byte_image_free(&read);
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
