#include "morph/apng.h"

#include "base/write_error.h"
#include "pictures/png_chunk.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* Compresses rows as differences from the row above (filter 2); the result begins with space for a frame's number. */
static unsigned char *pack(const struct image *image, size_t *length)
{
    const size_t row = 3 * (size_t)image->width, size = (row + 1) * (size_t)image->height;
    unsigned char *rows = malloc(size), *above = calloc(1, row), *packed = malloc(4 + compressBound((uLong)size));
    uLongf used = compressBound((uLong)size);
    bool good = rows && above && packed;
    for (int y = 0; good && y < image->height; ++y) {
        unsigned char *out = rows + (row + 1) * (size_t)y;
        *out++ = 2;
        for (size_t i = 0; i < row; ++i) {
            const float v = image->rgb[row * (size_t)y + i];
            const unsigned char byte = (unsigned char)(v > 0.0f ? fminf(v, 1.0f) * 255.0f + 0.5f : 0.0f);
            out[i] = (unsigned char)(byte - above[i]);
            above[i] = byte;
        }
    }
    good = good && compress2(packed + 4, &used, rows, (uLong)size, 6) == Z_OK;
    free(rows);
    free(above);
    if (!good) {
        free(packed);
        return NULL;
    }
    *length = used;
    return packed;
}

static bool write_frame(FILE *file, const struct image *image, int number, int fps, uint32_t *sequence)
{
    unsigned char control[26] = {0};
    size_t length = 0;
    unsigned char *packed = pack(image, &length);
    if (!packed) {
        return false;
    }
    png_put32(control, (*sequence)++);
    png_put32(control + 4, (uint32_t)image->width);
    png_put32(control + 8, (uint32_t)image->height);
    control[21] = 1; /* delay: 1/fps */
    control[23] = (unsigned char)fps;
    bool good = png_write_chunk(file, "fcTL", control, sizeof control);
    if (number == 0) {
        good = good && png_write_chunk(file, "IDAT", packed + 4, length);
    } else {
        png_put32(packed, (*sequence)++);
        good = good && png_write_chunk(file, "fdAT", packed, length + 4);
    }
    free(packed);
    return good;
}

bool apng_write(const char *path, const struct image *frames, int count, int fps)
{
    unsigned char header[13] = {0}, animation[8] = {0};
    FILE *file = count > 0 && fps > 0 && fps < 256 ? fopen(path, "wb") : NULL;
    uint32_t sequence = 0;
    if (!file) {
        return false;
    }
    png_put32(header, (uint32_t)frames[0].width);
    png_put32(header + 4, (uint32_t)frames[0].height);
    header[8] = 8; /* bits a channel */
    header[9] = 2; /* RGB */
    png_put32(animation, (uint32_t)count);
    bool good = png_write_signature(file) && png_write_chunk(file, "IHDR", header, sizeof header)
                && png_write_chunk(file, "acTL", animation, sizeof animation);
    for (int f = 0; good && f < count; ++f) {
        good = frames[f].width == frames[0].width && frames[f].height == frames[0].height
               && write_frame(file, &frames[f], f, fps, &sequence);
    }
    good = good && png_write_chunk(file, "IEND", animation, 0);
    good = fclose(file) == 0 && good;
    if (!good) { partial_file_remove(path); }
    return good;
}
