/* image.h - RGB pictures: anti-aliased drawing, text, color maps, strips, PNG.
 *
 * A picture stores float RGB as display values 0..1 (a PNG's values / 255), row 0 at the top. Coordinates are in pixels with
 * pixel centers at half integers: (0,0) is the upper left corner of the picture. Drawing is clipped. */
#ifndef EXAMPLES_PICTURES_IMAGE_H
#define EXAMPLES_PICTURES_IMAGE_H

#include <stdbool.h>
#include <stddef.h>

struct image {
    int width, height;
    float *rgb; /* 3 * width * height */
};

struct color {
    float r, g, b;
};

static inline struct color color_rgb(float r, float g, float b)
{
    struct color c = {r, g, b};
    return c;
}

/* Makes a picture. Returns false with an empty picture when the size is not positive or memory is short. */
bool image_create(struct image *image, int width, int height, struct color fill);
void image_free(struct image *image);
bool image_write_png(const struct image *image, const char *path);
/* Writes a PNG with a palette of at most `colors` (256 at most) colors: a fifth to a third of the size. */
bool image_write_small_png(const struct image *image, int colors, const char *path);
/* Makes a picture `width` pixels wide in place, each pixel the mean of those it covers; leaves one that is no wider. Returns
 * false if memory is short. */
bool image_shrink(struct image *image, int width);
/* Encodes as PNG in memory, to be freed. */
bool image_encode_png(const struct image *image, unsigned char **bytes, size_t *size);
/* Decodes PNG, JPEG and the other formats of stb_image, but PNM, from a file's bytes. Returns false with an empty picture on failure, and
 * where the file promises more pixels than its size can have. */
bool image_read(const unsigned char *bytes, size_t length, struct image *image);
bool image_read_file(const char *path, struct image *image);

/* A picture of one byte per channel, as files have: for textures, which are only read. Freed by byte_image_free. */
struct byte_image {
    int width, height;
    unsigned char *rgb; /* 3 * width * height */
};

bool byte_image_read(const unsigned char *bytes, size_t length, struct byte_image *image); /* as image_read */
void byte_image_free(struct byte_image *image);
/* Samples bilinearly, as display values; the picture repeats. uv: from its upper left corner. */
void byte_image_sample(const struct byte_image *image, const float uv[2], float color[3]);
bool byte_image_encode_png(const struct byte_image *image, unsigned char **bytes, size_t *size);

/* ---- drawing ---- */
void image_blend(struct image *image, int x, int y, struct color color, float alpha); /* one pixel */
void image_rect(struct image *image, float x0, float y0, float x1, float y1, struct color color, float alpha);
void image_frame(struct image *image, float x0, float y0, float x1, float y1, float width, struct color color);
void image_disc(struct image *image, float x, float y, float radius, struct color color);
void image_line(struct image *image, float x0, float y0, float x1, float y1, float width, struct color color);
/* Draws line segments {x0,y0,x1,y1} as one shape: a pixel takes its alpha from the nearest one, so joints are not blended
 * twice. */
void image_strokes(struct image *image, const float (*segments)[4], size_t count, float width, struct color color);
/* Fills an anti-aliased polygon of x,y pairs, at most 64 corners, by the even-odd rule. */
void image_polygon(struct image *image, const float *points, size_t count, struct color color);

/* Draws a mark centered at (x, y): shapes 0 disc, 1 square, 2 triangle, 3 diamond, 4 cross, 5 plus, 6 ring, 7 triangle down. */
enum { IMAGE_GLYPH_COUNT = 8 };
void image_glyph(struct image *image, int shape, float x, float y, float radius, struct color color);

/* ---- text ---- */
/* Draws ASCII text (other characters as '?'). `size` = height of a capital letter in pixels, at least 8 to be legible. (x, y)
 * is the left end of the baseline; anchor 0 = left, 0.5 = center, 1 = right. */
void image_text(struct image *image, float x, float y, float size, float anchor, struct color color,
                const char *text);
void image_text_upward(struct image *image, float x, float y, float size, float anchor, struct color color,
                       const char *text); /* reads from bottom to top */
float image_text_width(float size, const char *text);

/* ---- composition ---- */
void image_paste(struct image *target, const struct image *source, int x, int y);
/* Combines pictures in one or more rows of `columns`, each with a caption below (captions or single ones may be NULL). */
bool image_strip(const struct image *images, const char *const *captions, int count, int columns,
                 struct color background, struct image *result);

/* ---- colours ---- */
struct color colormap_sequential(float t); /* 0..1: violet, blue, green, yellow; lightness rises evenly */
struct color color_category(int index);    /* eight well separated colors, repeated */
struct color color_hsv(float hue, float saturation, float value); /* hue in turns, any real */
struct color color_mix(struct color a, struct color b, float t);

#endif
