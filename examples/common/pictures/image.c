#include "pictures/image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static float clamp01(float v) { return v < 0.0f ? 0.0f : v > 1.0f ? 1.0f : v; }

bool image_create(struct image *image, int width, int height, struct color fill)
{
    memset(image, 0, sizeof *image);
    if (width <= 0 || height <= 0 || width > 32768 || height > 32768) {
        return false;
    }
    const size_t count = (size_t)width * (size_t)height;
    image->rgb = malloc(count * 3 * sizeof *image->rgb);
    if (!image->rgb) {
        return false;
    }
    image->width = width;
    image->height = height;
    for (size_t i = 0; i < count; ++i) {
        image->rgb[3 * i] = fill.r;
        image->rgb[3 * i + 1] = fill.g;
        image->rgb[3 * i + 2] = fill.b;
    }
    return true;
}

void image_free(struct image *image)
{
    free(image->rgb);
    memset(image, 0, sizeof *image);
}

void image_blend(struct image *image, int x, int y, struct color color, float alpha)
{
    if (x < 0 || y < 0 || x >= image->width || y >= image->height || !(alpha > 0.0f)) {
        return;
    }
    float *p = image->rgb + 3 * ((size_t)y * (size_t)image->width + (size_t)x);
    const float a = alpha < 1.0f ? alpha : 1.0f;
    p[0] += a * (color.r - p[0]);
    p[1] += a * (color.g - p[1]);
    p[2] += a * (color.b - p[2]);
}

/* Finds the pixel range [*first, *last] touched by the span lo..hi; empty when *first > *last. */
static void pixel_range(float lo, float hi, int size, int *first, int *last)
{
    *first = lo > 0.0f ? (lo < (float)size ? (int)lo : size) : 0;
    *last = hi < (float)size ? (hi >= 0.0f ? (int)hi : -1) : size - 1;
    if (!(lo <= hi)) { /* also NaN */
        *first = 0;
        *last = -1;
    }
}

/* Returns the share of the pixel [i, i+1] covered by lo..hi. */
static float cover(int i, float lo, float hi)
{
    const float a = fmaxf(lo, (float)i);
    const float b = fminf(hi, (float)i + 1.0f);
    return b > a ? b - a : 0.0f;
}

void image_rect(struct image *image, float x0, float y0, float x1, float y1, struct color color, float alpha)
{
    int ix0, ix1, iy0, iy1;
    pixel_range(x0, x1, image->width, &ix0, &ix1);
    pixel_range(y0, y1, image->height, &iy0, &iy1);
    for (int y = iy0; y <= iy1; ++y) {
        for (int x = ix0; x <= ix1; ++x) {
            image_blend(image, x, y, color, alpha * cover(x, x0, x1) * cover(y, y0, y1));
        }
    }
}

void image_frame(struct image *image, float x0, float y0, float x1, float y1, float width, struct color color)
{
    image_rect(image, x0, y0, x1, y0 + width, color, 1.0f);
    image_rect(image, x0, y1 - width, x1, y1, color, 1.0f);
    image_rect(image, x0, y0 + width, x0 + width, y1 - width, color, 1.0f);
    image_rect(image, x1 - width, y0 + width, x1, y1 - width, color, 1.0f);
}

void image_disc(struct image *image, float x, float y, float radius, struct color color)
{
    image_line(image, x, y, x, y, 2.0f * radius, color);
}

static float segment_distance_squared(float px, float py, const float s[4])
{
    const float dx = s[2] - s[0], dy = s[3] - s[1];
    const float length2 = dx * dx + dy * dy;
    const float t = length2 > 0.0f ? clamp01(((px - s[0]) * dx + (py - s[1]) * dy) / length2) : 0.0f;
    const float ex = px - s[0] - t * dx, ey = py - s[1] - t * dy;
    return ex * ex + ey * ey;
}

void image_strokes(struct image *image, const float (*segments)[4], size_t count, float width, struct color color)
{
    const float radius = 0.5f * fmaxf(width, 1.0f);
    const float strength = fminf(width, 1.0f); /* lines thinner than a pixel become paler instead */
    float box[4] = {1e30f, 1e30f, -1e30f, -1e30f};
    int x0, x1, y0, y1;
    for (size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 4; k += 2) {
            box[0] = fminf(box[0], segments[i][k]);
            box[1] = fminf(box[1], segments[i][k + 1]);
            box[2] = fmaxf(box[2], segments[i][k]);
            box[3] = fmaxf(box[3], segments[i][k + 1]);
        }
    }
    pixel_range(box[0] - radius - 1.0f, box[2] + radius + 1.0f, image->width, &x0, &x1);
    pixel_range(box[1] - radius - 1.0f, box[3] + radius + 1.0f, image->height, &y0, &y1);
    for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            float nearest = 1e30f;
            for (size_t i = 0; i < count; ++i) {
                nearest = fminf(nearest, segment_distance_squared((float)x + 0.5f, (float)y + 0.5f, segments[i]));
            }
            const float edge = radius + 0.5f;
            if (nearest < edge * edge) {
                image_blend(image, x, y, color, strength * clamp01(edge - sqrtf(nearest)));
            }
        }
    }
}

void image_line(struct image *image, float x0, float y0, float x1, float y1, float width, struct color color)
{
    const float segment[1][4] = {{x0, y0, x1, y1}};
    image_strokes(image, segment, 1, width, color);
}

void image_polygon(struct image *image, const float *points, size_t count, struct color color)
{
    enum { MAX_CORNERS = 64 };
    float segments[MAX_CORNERS][4];
    float box[4] = {1e30f, 1e30f, -1e30f, -1e30f};
    int x0, x1, y0, y1;
    if (count < 3 || count > MAX_CORNERS) {
        return;
    }
    for (size_t i = 0; i < count; ++i) {
        const float *a = points + 2 * i;
        const float *b = points + 2 * ((i + 1) % count);
        segments[i][0] = a[0];
        segments[i][1] = a[1];
        segments[i][2] = b[0];
        segments[i][3] = b[1];
        box[0] = fminf(box[0], a[0]);
        box[1] = fminf(box[1], a[1]);
        box[2] = fmaxf(box[2], a[0]);
        box[3] = fmaxf(box[3], a[1]);
    }
    pixel_range(box[0] - 1.0f, box[2] + 1.0f, image->width, &x0, &x1);
    pixel_range(box[1] - 1.0f, box[3] + 1.0f, image->height, &y0, &y1);
    for (int y = y0; y <= y1; ++y) {
        for (int x = x0; x <= x1; ++x) {
            const float px = (float)x + 0.5f, py = (float)y + 0.5f;
            float nearest = 1e30f;
            bool inside = false;
            for (size_t i = 0; i < count; ++i) {
                const float *s = segments[i];
                nearest = fminf(nearest, segment_distance_squared(px, py, s));
                if ((s[1] > py) != (s[3] > py) && px < s[0] + (py - s[1]) * (s[2] - s[0]) / (s[3] - s[1])) {
                    inside = !inside;
                }
            }
            const float distance = sqrtf(nearest);
            image_blend(image, x, y, color, clamp01(0.5f + (inside ? distance : -distance)));
        }
    }
}

void image_glyph(struct image *image, int shape, float x, float y, float radius, struct color color)
{
    const float r = radius, d = 0.7f * radius;
    const float square[] = {x - d, y - d, x + d, y - d, x + d, y + d, x - d, y + d};
    const float triangle[] = {x, y - r, x + 0.9f * r, y + 0.6f * r, x - 0.9f * r, y + 0.6f * r};
    const float triangle_down[] = {x, y + r, x - 0.9f * r, y - 0.6f * r, x + 0.9f * r, y - 0.6f * r};
    const float diamond[] = {x, y - r, x + 0.8f * r, y, x, y + r, x - 0.8f * r, y};
    const float cross[2][4] = {{x - d, y - d, x + d, y + d}, {x - d, y + d, x + d, y - d}};
    const float plus[2][4] = {{x - r, y, x + r, y}, {x, y - r, x, y + r}};
    switch (((shape % IMAGE_GLYPH_COUNT) + IMAGE_GLYPH_COUNT) % IMAGE_GLYPH_COUNT) {
    case 0:
        image_disc(image, x, y, 0.85f * r, color);
        break;
    case 1:
        image_polygon(image, square, 4, color);
        break;
    case 2:
        image_polygon(image, triangle, 3, color);
        break;
    case 3:
        image_polygon(image, diamond, 4, color);
        break;
    case 4:
        image_strokes(image, cross, 2, 0.4f * r, color);
        break;
    case 5:
        image_strokes(image, plus, 2, 0.4f * r, color);
        break;
    case 6: {
        float ring[24][4];
        for (int i = 0; i < 24; ++i) {
            const float a = 6.2831853f * (float)i / 24.0f, b = 6.2831853f * (float)(i + 1) / 24.0f;
            ring[i][0] = x + 0.75f * r * cosf(a);
            ring[i][1] = y + 0.75f * r * sinf(a);
            ring[i][2] = x + 0.75f * r * cosf(b);
            ring[i][3] = y + 0.75f * r * sinf(b);
        }
        image_strokes(image, (const float(*)[4])ring, 24, 0.35f * r, color);
        break;
    }
    default:
        image_polygon(image, triangle_down, 3, color);
        break;
    }
}

void image_paste(struct image *target, const struct image *source, int x, int y)
{
    for (int row = 0; row < source->height; ++row) {
        for (int column = 0; column < source->width; ++column) {
            const float *p = source->rgb + 3 * ((size_t)row * (size_t)source->width + (size_t)column);
            image_blend(target, x + column, y + row, color_rgb(p[0], p[1], p[2]), 1.0f);
        }
    }
}

struct color color_mix(struct color a, struct color b, float t)
{
    return color_rgb(a.r + t * (b.r - a.r), a.g + t * (b.g - a.g), a.b + t * (b.b - a.b));
}

static float polynomial(const float c[6], float t)
{
    return clamp01(c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5])))));
}

struct color colormap_sequential(float t)
{
    static const float red[6] = {0.2418f, 0.3195f, 0.5573f, -12.5229f, 23.9948f, -11.6053f};
    static const float green[6] = {0.0194f, 1.2374f, 0.0784f, -1.7089f, 2.6435f, -1.3653f};
    static const float blue[6] = {0.3277f, 2.0382f, -8.9569f, 22.3960f, -27.4511f, 11.7839f};
    t = t >= 0.0f ? clamp01(t) : 0.0f;
    return color_rgb(polynomial(red, t), polynomial(green, t), polynomial(blue, t));
}

struct color color_category(int index)
{
    static const struct color table[8] = {{0.12f, 0.38f, 0.70f}, {0.85f, 0.33f, 0.10f}, {0.16f, 0.58f, 0.33f},
                                          {0.62f, 0.22f, 0.62f}, {0.90f, 0.66f, 0.08f}, {0.12f, 0.64f, 0.70f},
                                          {0.75f, 0.15f, 0.28f}, {0.42f, 0.42f, 0.42f}};
    return table[((index % 8) + 8) % 8];
}

struct color color_hsv(float hue, float saturation, float value)
{
    float channel[3];
    for (int i = 0; i < 3; ++i) {
        const float turn = hue + (float)(3 - i) / 3.0f;
        const float h = 6.0f * (turn - floorf(turn));
        const float ramp = clamp01(fabsf(h - 3.0f) - 1.0f);
        channel[i] = value * (1.0f + saturation * (ramp - 1.0f));
    }
    return color_rgb(channel[0], channel[1], channel[2]);
}
