/* image_small.c - small PNG files: fewer pixels; a palette by median cut (Heckbert 1982) and Lloyd's rounds, one byte a pixel. */
#include "base/write_error.h"
#include "pictures/image.h"
#include "pictures/png_chunk.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { PALETTE = 256, ROUNDS = 8, LEVELS = 64, CELLS = LEVELS * LEVELS * LEVELS }; /* colors are counted in cells of 6 bits a channel */

/* Colors of a picture by cell: how many pixels, and their sums. Boxes are ranges of `cells`, which holds the cells in use. */
struct census {
    double sum[CELLS][3];
    long count[CELLS];
    int cells[CELLS], used;
    unsigned char index[CELLS]; /* of the palette */
};

struct box {
    int from, to;
};

static int cell_level(int cell, int channel)
{
    return cell / (channel == 0 ? LEVELS * LEVELS : channel == 1 ? LEVELS : 1) % LEVELS;
}

static int cell_of(const float rgb[3])
{
    int cell = 0;
    for (int c = 0; c < 3; ++c) {
        const float v = rgb[c] > 0.0f ? (rgb[c] < 1.0f ? rgb[c] : 1.0f) : 0.0f;
        cell = cell * LEVELS + (int)(v * ((float)LEVELS - 0.001f));
    }
    return cell;
}

static void take_census(const struct image *image, struct census *census)
{
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    for (size_t p = 0; p < pixels; ++p) {
        const int cell = cell_of(image->rgb + 3 * p);
        for (int c = 0; c < 3; ++c) {
            census->sum[cell][c] += (double)image->rgb[3 * p + (size_t)c];
        }
        if (census->count[cell]++ == 0) {
            census->cells[census->used++] = cell;
        }
    }
}

/* Returns the channel along which a box is longest, and that length times the number of its pixels: what dividing it is worth. */
static double longest_side(const struct census *census, struct box box, int *channel)
{
    double pixels = 0.0;
    int longest = 0;
    *channel = 0;
    for (int i = box.from; i < box.to; ++i) {
        pixels += (double)census->count[census->cells[i]];
    }
    for (int c = 0; c < 3; ++c) {
        int low = LEVELS, high = 0;
        for (int i = box.from; i < box.to; ++i) {
            const int level = cell_level(census->cells[i], c);
            low = level < low ? level : low;
            high = level > high ? level : high;
        }
        if (high - low > longest) {
            longest = high - low;
            *channel = c;
        }
    }
    return box.to - box.from > 1 ? (double)longest * pixels : 0.0;
}

/* Sorts the cells of a box by a channel, by counting, and returns where half of its pixels are passed. */
static int divide(struct census *census, struct box box, int channel)
{
    int *sorted = malloc((size_t)(box.to - box.from) * sizeof *sorted), used = 0, middle;
    double pixels = 0.0, passed = 0.0;
    if (!sorted) {
        return box.to;
    }
    for (int level = 0; level < LEVELS; ++level) {
        for (int i = box.from; i < box.to; ++i) {
            if (cell_level(census->cells[i], channel) == level) {
                sorted[used++] = census->cells[i];
                pixels += (double)census->count[census->cells[i]];
            }
        }
    }
    memcpy(census->cells + box.from, sorted, (size_t)used * sizeof *sorted);
    free(sorted);
    for (middle = box.from; middle < box.to - 1; ++middle) {
        passed += (double)census->count[census->cells[middle]];
        if (2.0 * passed >= pixels) {
            break;
        }
    }
    return middle + 1 < box.to ? middle + 1 : box.to - 1;
}

/* Divides the box that is worth most until there are `most`; returns how many there are. */
static int make_boxes(struct census *census, int most, struct box boxes[PALETTE])
{
    int count = 1;
    boxes[0] = (struct box){0, census->used};
    while (count < most) {
        int best = -1, best_channel = 0;
        double worth = 0.0;
        for (int b = 0; b < count; ++b) {
            int channel;
            const double w = longest_side(census, boxes[b], &channel);
            if (w > worth) {
                worth = w;
                best = b;
                best_channel = channel;
            }
        }
        const int middle = best < 0 ? 0 : divide(census, boxes[best], best_channel);
        if (best < 0 || middle >= boxes[best].to) {
            break;
        }
        boxes[count++] = (struct box){middle, boxes[best].to};
        boxes[best].to = middle;
    }
    return count;
}

/* Gives the cells of each box its number. */
static void number_boxes(struct census *census, const struct box *boxes, int count)
{
    for (int b = 0; b < count; ++b) {
        for (int i = boxes[b].from; i < boxes[b].to; ++i) {
            census->index[census->cells[i]] = (unsigned char)b;
        }
    }
}

/* Computes the mean color of the pixels of each number; a number that has none keeps its color. */
static void compute_means(const struct census *census, int count, double palette[PALETTE][3])
{
    double sum[PALETTE][3] = {{0.0}}, pixels[PALETTE] = {0.0};
    for (int i = 0; i < census->used; ++i) {
        const int cell = census->cells[i], n = census->index[cell];
        pixels[n] += (double)census->count[cell];
        for (int c = 0; c < 3; ++c) {
            sum[n][c] += census->sum[cell][c];
        }
    }
    for (int n = 0; n < count; ++n) {
        for (int c = 0; c < 3 && pixels[n] > 0.0; ++c) {
            palette[n][c] = sum[n][c] / pixels[n];
        }
    }
}

/* Gives each cell the number of the color that is nearest to its mean: that of its box may be far off, where a box that has few pixels
 * of many colors was not worth dividing. */
static void number_by_nearest(struct census *census, int count, double palette[PALETTE][3])
{
    for (int i = 0; i < census->used; ++i) {
        const int cell = census->cells[i];
        double nearest = 1e30;
        for (int n = 0; n < count; ++n) {
            double distance = 0.0;
            for (int c = 0; c < 3; ++c) {
                const double d = census->sum[cell][c] / (double)census->count[cell] - palette[n][c];
                distance += d * d;
            }
            if (distance < nearest) {
                nearest = distance;
                census->index[cell] = (unsigned char)n;
            }
        }
    }
}

/* Computes the palette from the boxes: their means, then means of what is nearest to each (Lloyd). */
static void make_palette(struct census *census, const struct box *boxes, int count, unsigned char bytes[3 * PALETTE])
{
    double palette[PALETTE][3] = {{0.0}};
    number_boxes(census, boxes, count);
    for (int round = 0; round < ROUNDS; ++round) {
        compute_means(census, count, palette);
        number_by_nearest(census, count, palette);
    }
    for (int i = 0; i < 3 * count; ++i) {
        const double v = palette[i / 3][i % 3];
        bytes[i] = (unsigned char)(255.0 * (v > 0.0 ? (v < 1.0 ? v : 1.0) : 0.0) + 0.5);
    }
}

static bool write_file(const struct image *image, const struct census *census, const unsigned char *palette, int colors,
                       const char *path)
{
    const size_t row = (size_t)image->width + 1, size = row * (size_t)image->height;
    uLongf packed_size = compressBound((uLong)size);
    unsigned char *rows = malloc(size), *packed = malloc(packed_size), header[13] = {0};
    FILE *file = rows && packed ? fopen(path, "wb") : NULL;
    for (int y = 0; file && y < image->height; ++y) {
        unsigned char *out = rows + row * (size_t)y;
        *out++ = 0; /* no filter: neighbouring indices have nothing to do with each other */
        for (int x = 0; x < image->width; ++x) {
            out[x] = census->index[cell_of(image->rgb + 3 * ((size_t)y * (size_t)image->width + (size_t)x))];
        }
    }
    png_put32(header, (uint32_t)image->width);
    png_put32(header + 4, (uint32_t)image->height);
    header[8] = 8; /* bits */
    header[9] = 3; /* indices into a palette */
    bool good = file && compress2(packed, &packed_size, rows, (uLong)size, 9) == Z_OK;
    good = good && png_write_signature(file) && png_write_chunk(file, "IHDR", header, sizeof header)
           && png_write_chunk(file, "PLTE", palette, 3 * (size_t)colors) && png_write_chunk(file, "IDAT", packed, packed_size)
           && png_write_chunk(file, "IEND", header, 0);
    good = (!file || fclose(file) == 0) && good;
    if (file && !good) { partial_file_remove(path); }
    free(rows);
    free(packed);
    return good;
}

bool image_write_small_png(const struct image *image, int colors, const char *path)
{
    struct census *census = calloc(1, sizeof *census);
    struct box boxes[PALETTE];
    unsigned char palette[3 * PALETTE];
    bool good = census && image->rgb && colors > 0;
    if (good) {
        take_census(image, census);
        const int count = make_boxes(census, colors < PALETTE ? colors : PALETTE, boxes);
        make_palette(census, boxes, count, palette);
        good = write_file(image, census, palette, count, path);
    }
    free(census);
    return good;
}

/* Returns how much of the pixel `i` of a side of `small` pixels lies over the pixel `j` of a side of `large` ones. */
static float overlap(int i, int j, int small, int large)
{
    const float ratio = (float)large / (float)small, from = (float)i * ratio, to = from + ratio;
    const float low = from > (float)j ? from : (float)j, high = to < (float)j + 1.0f ? to : (float)j + 1.0f;
    return high > low ? high - low : 0.0f;
}

/* Adds the pixels of `large` that the pixel (x, y) of `small` covers, weighted by how much. */
static void average(const struct image *large, const struct image *small, int x, int y, float out[3])
{
    float sum = 0.0f, wide, high;
    for (int v = y * large->height / small->height;
         v < large->height && (high = overlap(y, v, small->height, large->height)) > 0.0f; ++v) {
        for (int u = x * large->width / small->width;
             u < large->width && (wide = overlap(x, u, small->width, large->width)) > 0.0f; ++u) {
            const float *in = large->rgb + 3 * ((size_t)v * (size_t)large->width + (size_t)u);
            for (int c = 0; c < 3; ++c) {
                out[c] += wide * high * in[c];
            }
            sum += wide * high;
        }
    }
    for (int c = 0; c < 3 && sum > 0.0f; ++c) {
        out[c] /= sum;
    }
}

bool image_shrink(struct image *image, int width)
{
    struct image small;
    const int height = (int)((double)image->height * width / image->width + 0.5);
    if (width >= image->width) {
        return true;
    }
    if (!image_create(&small, width, height > 0 ? height : 1, color_rgb(0.0f, 0.0f, 0.0f))) {
        return false;
    }
    for (int y = 0; y < small.height; ++y) {
        for (int x = 0; x < small.width; ++x) {
            average(image, &small, x, y, small.rgb + 3 * ((size_t)y * (size_t)small.width + (size_t)x));
        }
    }
    image_free(image);
    *image = small;
    return true;
}
