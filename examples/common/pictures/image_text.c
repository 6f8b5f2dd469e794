/* image_text.c - text, strips and PNG files of image.h. */
#include "base/write_error.h"
#include "pictures/image.h"
#include "pictures/image_font.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

/* The compressor of stb_image_write.h: at this level zlib is faster than its own, and files are smaller. Returns what free() takes, NULL if
 * memory is short. */
static unsigned char *compress_rows(unsigned char *rows, int length, int *packed_length, int quality)
{
    uLongf size = compressBound((uLong)length);
    unsigned char *packed = malloc(size);
    (void)quality;
    if (packed && compress2(packed, &size, rows, (uLong)length, 3) != Z_OK) {
        free(packed);
        packed = NULL;
    }
    *packed_length = (int)size;
    return packed;
}

/* Disable warnings in the third-party header. */
#if defined(__GNUC__)
    #pragma GCC diagnostic push
    #pragma GCC diagnostic ignored "-Wconversion"
    #pragma GCC diagnostic ignored "-Wsign-conversion"
    #pragma GCC diagnostic ignored "-Wmissing-field-initializers"
    #pragma GCC diagnostic ignored "-Wunused-function"
    #pragma GCC diagnostic ignored "-Wunused-parameter"
    #pragma GCC diagnostic ignored "-Wshadow"
#endif
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBIW_ZLIB_COMPRESS compress_rows
#include <stb/stb_image_write.h>
#if defined(__GNUC__)
    #pragma GCC diagnostic pop
#endif

/* Converts to bytes, to be freed; NULL if the picture is empty or memory is short. */
static unsigned char *image_bytes(const struct image *image)
{
    const size_t count = 3 * (size_t)image->width * (size_t)image->height;
    unsigned char *bytes = count > 0 ? malloc(count) : NULL;
    for (size_t i = 0; bytes && i < count; ++i) {
        const float v = image->rgb[i];
        bytes[i] = (unsigned char)(v > 0.0f ? fminf(v, 1.0f) * 255.0f + 0.5f : 0.0f); /* NaN is black */
    }
    return bytes;
}

bool byte_image_encode_png(const struct byte_image *image, unsigned char **encoded, size_t *size)
{
    int length = 0;
    *encoded = image->rgb ? stbi_write_png_to_mem(image->rgb, 3 * image->width, image->width, image->height, 3, &length) : NULL;
    *size = (size_t)length;
    return *encoded != NULL;
}

bool image_encode_png(const struct image *image, unsigned char **encoded, size_t *size)
{
    const struct byte_image bytes = {image->width, image->height, image_bytes(image)};
    const bool good = byte_image_encode_png(&bytes, encoded, size);
    free(bytes.rgb);
    return good;
}

/* Not by stbi_write_png, which does not notice a full disk. */
bool image_write_png(const struct image *image, const char *path)
{
    unsigned char *encoded;
    size_t size;
    FILE *file = image_encode_png(image, &encoded, &size) ? fopen(path, "wb") : NULL;
    bool good = file && fwrite(encoded, 1, size, file) == size;
    good = file && fclose(file) == 0 && good;
    if (file && !good) { partial_file_remove(path); }
    free(encoded);
    return good;
}

static const unsigned char *glyph_rows(char c)
{
    const int code = (unsigned char)c;
    return font_rows[(code >= FONT_FIRST && code <= FONT_LAST ? code : '?') - FONT_FIRST];
}

static bool is_set(const unsigned char *rows, int x, int y)
{
    return x >= 0 && x < FONT_WIDTH && y >= 0 && y < FONT_HEIGHT && ((rows[y] >> (FONT_WIDTH - 1 - x)) & 1);
}

/* Finds the strokes of a letter in font pixels: neighbors are joined, diagonal ones only where no pixel beside both joins them
 * already, which would fill corners. A lone pixel is a stroke of length zero. */
static int glyph_strokes(char c, float strokes[FONT_WIDTH * FONT_HEIGHT * 4][4])
{
    const unsigned char *rows = glyph_rows(c);
    int count = 0;
    for (int y = 0; y < FONT_HEIGHT; ++y) {
        for (int x = 0; x < FONT_WIDTH; ++x) {
            static const int dx[4] = {1, 0, 1, -1}, dy[4] = {0, 1, 1, 1};
            bool joined = false;
            if (!is_set(rows, x, y)) {
                continue;
            }
            for (int k = 0; k < 4; ++k) {
                const bool corner = k >= 2 && (is_set(rows, x + dx[k], y) || is_set(rows, x, y + dy[k]));
                if (!corner && is_set(rows, x + dx[k], y + dy[k])) {
                    const float stroke[4] = {(float)x, (float)y, (float)(x + dx[k]), (float)(y + dy[k])};
                    memcpy(strokes[count++], stroke, sizeof stroke);
                    joined = true;
                }
            }
            if (!joined) { /* may be joined already from its other side: drawing it twice does not show */
                const float dot[4] = {(float)x, (float)y, (float)x, (float)y};
                memcpy(strokes[count++], dot, sizeof dot);
            }
        }
    }
    return count;
}

float image_text_width(float size, const char *text)
{
    const size_t length = strlen(text);
    return length ? size / 6.0f * ((float)length * (FONT_WIDTH + 1.0f) - 2.0f) : 0.0f;
}

/* Draws text along the reading direction (ux, uy); the letters' downward direction is (-uy, ux). */
static void draw_text(struct image *image, float x, float y, float size, float anchor, struct color color,
                      const char *text, float ux, float uy)
{
    const float pixel = size / 6.0f; /* capitals span 7 rows = 6 pixel distances */
    const float start = -anchor * image_text_width(size, text);
    for (size_t i = 0; text[i]; ++i) {
        float strokes[FONT_WIDTH * FONT_HEIGHT * 4][4];
        const int count = glyph_strokes(text[i], strokes);
        const float left = start + pixel * (float)i * (FONT_WIDTH + 1.0f);
        const float width = fmaxf(1.0f, 0.95f * pixel);
        for (int s = 0; s < count; ++s) {
            for (int k = 0; k < 4; k += 2) {
                const float along = left + pixel * strokes[s][k];
                const float down = pixel * (strokes[s][k + 1] - (FONT_BASELINE - 1.0f));
                strokes[s][k] = x + along * ux - down * uy;
                strokes[s][k + 1] = y + along * uy + down * ux;
            }
        }
        image_strokes(image, (const float(*)[4])strokes, (size_t)count, width, color);
    }
}

void image_text(struct image *image, float x, float y, float size, float anchor, struct color color, const char *text)
{
    draw_text(image, x, y, size, anchor, color, text, 1.0f, 0.0f);
}

void image_text_upward(struct image *image, float x, float y, float size, float anchor, struct color color,
                       const char *text)
{
    draw_text(image, x, y, size, anchor, color, text, 0.0f, -1.0f);
}

/* Returns the middle of the columns in which a picture differs from a color: 0 at its left side, 1 at its right one. */
static float middle_of_content(const struct image *image, struct color background)
{
    const float color[3] = {background.r, background.g, background.b};
    int first = image->width, last = -1;
    for (int i = 0; i < image->width * image->height; ++i) {
        for (int c = 0; c < 3; ++c) {
            if (fabsf(image->rgb[3 * (size_t)i + (size_t)c] - color[c]) > 0.02f) {
                const int x = i % image->width;
                first = x < first ? x : first;
                last = x > last ? x : last;
            }
        }
    }
    return first <= last ? 0.5f * (float)(first + last + 1) / (float)image->width : 0.5f;
}

/* Draws a caption under what its picture shows, within the `width` pixels of its column, which it shrinks to. */
static void draw_caption(struct image *strip, const struct image *image, int column_x, int width, int y, struct color background,
                         struct color ink, const char *text)
{
    float size = 11.0f;
    while (size > 7.0f && image_text_width(size, text) > (float)width) {
        size -= 0.5f;
    }
    const float half = 0.5f * image_text_width(size, text), left = (float)column_x, right = left + (float)width;
    float x = left + 0.5f * (float)(width - image->width) + middle_of_content(image, background) * (float)image->width;
    x = half < 0.5f * (float)width ? fmaxf(left + half, fminf(right - half, x)) : 0.5f * (left + right);
    image_text(strip, x, (float)y, size, 0.5f, ink, text);
}

bool image_strip(const struct image *images, const char *const *captions, int count, int columns,
                 struct color background, struct image *result)
{
    const int gap = 12, caption = captions ? 26 : 0;
    int width = 0, height = 0;
    memset(result, 0, sizeof *result);
    if (count < 1) {
        return false;
    }
    columns = columns < 1 || columns > count ? count : columns;
    for (int i = 0; i < count; ++i) {
        width = images[i].width > width ? images[i].width : width;
        height = images[i].height > height ? images[i].height : height;
    }
    const int rows = (count + columns - 1) / columns;
    if (!image_create(result, columns * (width + gap) + gap, rows * (height + caption + gap) + gap, background)) {
        return false;
    }
    const bool dark = background.r + background.g + background.b < 1.5f;
    const struct color ink = dark ? color_rgb(0.9f, 0.9f, 0.9f) : color_rgb(0.15f, 0.15f, 0.17f);
    for (int i = 0; i < count; ++i) {
        const int cell_x = gap + i % columns * (width + gap);
        const int y = gap + i / columns * (height + caption + gap);
        image_paste(result, &images[i], cell_x + (width - images[i].width) / 2, y + (height - images[i].height) / 2);
        if (captions && captions[i]) {
            draw_caption(result, &images[i], cell_x, width, y + height + 19, background, ink, captions[i]);
        }
    }
    return true;
}
