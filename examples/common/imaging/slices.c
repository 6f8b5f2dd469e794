#include "imaging/slices.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A slice as a plane of the voxel grid: picture x runs along voxel axis `u` (backwards if flip_u), picture y along `v`. */
struct plane {
    int u, v, normal; /* voxel axes */
    bool flip_u, flip_v;
    int index; /* of the slice, along `normal` */
    const char *name;
    const char *left, *right, *top, *bottom;
    int width, height;
    float scale_u, scale_v; /* pixels a voxel */
};

static float grid_value(const struct volume *volume, const float *data, const struct plane *plane, int a, int b)
{
    int index[3];
    index[plane->u] = a;
    index[plane->v] = b;
    index[plane->normal] = plane->index;
    return data[(size_t)index[0]
                + (size_t)volume->dims[0] * ((size_t)index[1] + (size_t)volume->dims[1] * (size_t)index[2])];
}

/* Assigns to each world axis the nearest voxel axis, each used once, and whether it runs against the world axis. */
static void patient_axes(const struct volume *volume, int axis_of_world[3], bool against[3])
{
    bool used_world[3] = {false, false, false}, used_axis[3] = {false, false, false};
    for (int step = 0; step < 3; ++step) {
        int best_world = 0, best_axis = 0;
        float best = -1.0f;
        for (int w = 0; w < 3; ++w) {
            for (int a = 0; a < 3; ++a) {
                const float share = fabsf(volume->direction[w][a]);
                if (!used_world[w] && !used_axis[a] && share > best) {
                    best = share;
                    best_world = w;
                    best_axis = a;
                }
            }
        }
        used_world[best_world] = true;
        used_axis[best_axis] = true;
        axis_of_world[best_world] = best_axis;
        against[best_world] = volume->direction[best_world][best_axis] < 0.0f;
    }
}

static float contour_value(float value, const struct slices_contour *contour)
{
    if (contour->any_label) {
        return value != 0.0f ? -0.5f : 0.5f;
    }
    return contour->label > 0.0f ? (value == contour->label ? -0.5f : 0.5f) : value - contour->level;
}

/* Finds along every axis the slice with the most voxels inside the first contour, the middle one of equals. */
static bool find_center(const struct slices_view *view, int center[3])
{
    const int *dims = view->volume->dims;
    for (int a = 0; a < 3; ++a) {
        center[a] = view->center[a] < dims[a] ? view->center[a] : dims[a] - 1;
    }
    if (center[0] >= 0 && center[1] >= 0 && center[2] >= 0) {
        return true;
    }
    size_t *counts = calloc((size_t)dims[0] + (size_t)dims[1] + (size_t)dims[2], sizeof *counts);
    size_t *const along[3] = {counts, counts + dims[0], counts + dims[0] + dims[1]};
    const float *value = view->contour_count > 0 ? view->contours[0].data : NULL;
    for (int k = 0; counts && k < dims[2]; ++k) {
        for (int j = 0; value && j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++value) {
                const size_t inside = contour_value(*value, &view->contours[0]) < 0.0f;
                along[0][i] += inside;
                along[1][j] += inside;
                along[2][k] += inside;
            }
        }
    }
    for (int a = 0; counts && a < 3; ++a) {
        const int middle = dims[a] / 2;
        int best = middle;
        for (int i = 0; i < dims[a]; ++i) {
            const bool nearer = abs(i - middle) < abs(best - middle);
            best = along[a][i] > along[a][best] || (along[a][i] == along[a][best] && nearer) ? i : best;
        }
        center[a] = center[a] < 0 ? best : center[a];
    }
    free(counts);
    return counts != NULL;
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static bool find_window(const struct slices_view *view, const struct plane planes[3], float *lo, float *hi)
{
    size_t count = 0;
    *lo = view->window_lo;
    *hi = view->window_hi;
    if (*lo < *hi) {
        return true;
    }
    for (int p = 0; p < 3; ++p) {
        count += (size_t)view->volume->dims[planes[p].u] * (size_t)view->volume->dims[planes[p].v];
    }
    float *values = malloc(count * sizeof *values), *out = values;
    if (!values) {
        return false;
    }
    for (int p = 0; p < 3; ++p) {
        for (int b = 0; b < view->volume->dims[planes[p].v]; ++b) {
            for (int a = 0; a < view->volume->dims[planes[p].u]; ++a) {
                *out++ = grid_value(view->volume, view->volume->data, &planes[p], a, b);
            }
        }
    }
    qsort(values, count, sizeof *values, compare_floats);
    *lo = values[count / 100];
    *hi = values[count - 1 - count / 200];
    if (!(*lo < *hi)) {
        *lo = values[0];
        *hi = values[count - 1] > values[0] ? values[count - 1] : values[0] + 1.0f;
    }
    free(values);
    return true;
}

/* Converts a picture coordinate to voxels along u; voxel centers are whole numbers. */
static float voxel_u(const struct plane *p, int size, float x)
{
    const float a = x / p->scale_u - 0.5f;
    return p->flip_u ? (float)(size - 1) - a : a;
}

static float voxel_v(const struct plane *p, int size, float y)
{
    const float b = y / p->scale_v - 0.5f;
    return p->flip_v ? (float)(size - 1) - b : b;
}

static void draw_gray(const struct volume *volume, const struct plane *p, float lo, float hi, struct image *image)
{
    const int nu = volume->dims[p->u], nv = volume->dims[p->v];
    for (int y = 0; y < p->height; ++y) {
        for (int x = 0; x < p->width; ++x) {
            const float a = fmaxf(0.0f, fminf((float)(nu - 1), voxel_u(p, nu, (float)x + 0.5f)));
            const float b = fmaxf(0.0f, fminf((float)(nv - 1), voxel_v(p, nv, (float)y + 0.5f)));
            const int a0 = (int)a, b0 = (int)b, a1 = a0 + 1 < nu ? a0 + 1 : a0, b1 = b0 + 1 < nv ? b0 + 1 : b0;
            const float s = a - (float)a0, t = b - (float)b0;
            const float top = (1.0f - s) * grid_value(volume, volume->data, p, a0, b0)
                              + s * grid_value(volume, volume->data, p, a1, b0);
            const float bottom = (1.0f - s) * grid_value(volume, volume->data, p, a0, b1)
                                 + s * grid_value(volume, volume->data, p, a1, b1);
            const float gray = fmaxf(0.0f, fminf(1.0f, ((1.0f - t) * top + t * bottom - lo) / (hi - lo)));
            image_blend(image, x, y, color_rgb(gray, gray, gray), 1.0f);
        }
    }
}

/* Draws a contour by marching squares: a segment in every cell of four voxels, two at a saddle, split by the corners' mean. */
static void draw_contour(const struct volume *volume, const struct plane *p, const struct slices_contour *contour,
                         struct image *image)
{
    const int nu = volume->dims[p->u], nv = volume->dims[p->v];
    const float width = contour->width > 0.0f ? contour->width : 1.6f;
    for (int b = 0; b + 1 < nv; ++b) {
        for (int a = 0; a + 1 < nu; ++a) {
            static const int du[4] = {0, 1, 1, 0}, dv[4] = {0, 0, 1, 1};
            float value[4], crossing[4][2], mean = 0.0f;
            int cut[4], cuts = 0;
            for (int k = 0; k < 4; ++k) {
                value[k] = contour_value(grid_value(volume, contour->data, p, a + du[k], b + dv[k]), contour);
                mean += 0.25f * value[k];
            }
            for (int k = 0; k < 4; ++k) {
                const int n = (k + 1) % 4;
                if ((value[k] < 0.0f) == (value[n] < 0.0f) || !isfinite(value[k]) || !isfinite(value[n])) {
                    continue;
                }
                const float t = value[k] / (value[k] - value[n]);
                const float u = (float)(a + du[k]) + t * (float)(du[n] - du[k]);
                const float v = (float)(b + dv[k]) + t * (float)(dv[n] - dv[k]);
                crossing[k][0] = ((p->flip_u ? (float)(nu - 1) - u : u) + 0.5f) * p->scale_u;
                crossing[k][1] = ((p->flip_v ? (float)(nv - 1) - v : v) + 0.5f) * p->scale_v;
                cut[cuts++] = k;
            }
            if (cuts == 2) {
                image_line(image, crossing[cut[0]][0], crossing[cut[0]][1], crossing[cut[1]][0], crossing[cut[1]][1],
                           width, contour->color);
            } else if (cuts
                       == 4) { /* side k lies between corners k and k+1: pair the sides around the corners cut off */
                const int shift = (value[0] < 0.0f) == (mean < 0.0f) ? 0 : 3;
                for (int k = 0; k < 4; k += 2) {
                    const int s = (k + shift) % 4, e = (s + 1) % 4;
                    image_line(image, crossing[s][0], crossing[s][1], crossing[e][0], crossing[e][1], width,
                               contour->color);
                }
            }
        }
    }
}

/* Draws a letter that is legible on any gray. */
static void draw_letter(struct image *image, float x, float y, float anchor, const char *text)
{
    for (int d = 0; d < 9; ++d) {
        image_text(image, x + (float)(d % 3 - 1), y + (float)(d / 3 - 1), 8.0f, anchor, color_rgb(0.0f, 0.0f, 0.0f), text);
    }
    image_text(image, x, y, 8.0f, anchor, color_rgb(0.95f, 0.95f, 0.6f), text);
}

static void draw_letters(const struct plane *p, struct image *image)
{
    const float w = (float)p->width, h = (float)p->height;
    draw_letter(image, 6.0f, 0.5f * h, 0.0f, p->left);
    draw_letter(image, w - 6.0f, 0.5f * h, 1.0f, p->right);
    draw_letter(image, 0.5f * w, 14.0f, 0.5f, p->top);
    draw_letter(image, 0.5f * w, h - 6.0f, 0.5f, p->bottom);
}

static bool make_planes(const struct slices_view *view, struct plane planes[3])
{
    const struct volume *volume = view->volume;
    int axis[3], center[3];
    bool against[3];
    float tallest = 0.0f;
    patient_axes(volume, axis, against);
    if (!find_center(view, center)) {
        return false;
    }
    const struct plane made[3] = {
        /* picture x towards the patient's left (world -x), y towards posterior; and so on */
        {axis[0], axis[1], axis[2], !against[0], !against[1], 0, "axial", "R", "L", "A", "P", 0, 0, 0.0f, 0.0f},
        {axis[0], axis[2], axis[1], !against[0], !against[2], 0, "coronal", "R", "L", "S", "I", 0, 0, 0.0f, 0.0f},
        {axis[1], axis[2], axis[0], !against[1], !against[2], 0, "sagittal", "A", "P", "S", "I", 0, 0, 0.0f, 0.0f},
    };
    for (int p = 0; p < 3; ++p) {
        planes[p] = made[p];
        planes[p].index = center[planes[p].normal];
        tallest = fmaxf(tallest, volume->spacing[planes[p].v] * (float)volume->dims[planes[p].v]);
    }
    const float pixels = (float)(view->height > 0 ? view->height : 420) / tallest; /* a mm */
    for (int p = 0; p < 3; ++p) {
        const float width = volume->spacing[planes[p].u] * (float)volume->dims[planes[p].u] * pixels;
        const float height = volume->spacing[planes[p].v] * (float)volume->dims[planes[p].v] * pixels;
        planes[p].width = (int)fmaxf(16.0f, fminf(4096.0f, width + 0.5f));
        planes[p].height = (int)fmaxf(16.0f, fminf(4096.0f, height + 0.5f));
        planes[p].scale_u = (float)planes[p].width / (float)volume->dims[planes[p].u];
        planes[p].scale_v = (float)planes[p].height / (float)volume->dims[planes[p].v];
    }
    return true;
}

enum { LEGEND_LINE = 24, LEGEND_TEXT = 8, LEGEND_GAP = 28 }; /* pixels: a contour's line, from it to its name, to the next line */
static const float legend_size = 8.5f;

static float legend_width(const struct slices_view *view)
{
    float width = -(float)LEGEND_GAP;
    for (int c = 0; c < view->contour_count; ++c) {
        if (view->contours[c].name) {
            width += (float)(LEGEND_LINE + LEGEND_TEXT + LEGEND_GAP) + image_text_width(legend_size, view->contours[c].name);
        }
    }
    return width;
}

/* Adds the title above the strip and below it, in the middle as both are of all three slices, the legend. */
static bool add_words(const struct slices_view *view, const struct image *strip, struct color background,
                      struct image *result)
{
    const struct color ink = {0.90f, 0.91f, 0.93f};
    const float legend = legend_width(view);
    const int top = view->title ? 30 : 0, bottom = legend > 0.0f ? 26 : 0;
    if (!image_create(result, strip->width, strip->height + top + bottom, background)) {
        return false;
    }
    image_paste(result, strip, 0, top);
    if (view->title) {
        image_text(result, 0.5f * (float)result->width, 26.0f, 11.0f, 0.5f, ink, view->title);
    }
    float x = 0.5f * ((float)result->width - legend);
    const float y = (float)(result->height - 14);
    for (int c = 0; c < view->contour_count; ++c) {
        if (view->contours[c].name) {
            image_line(result, x, y - 4.0f, x + (float)LEGEND_LINE, y - 4.0f, 3.0f, view->contours[c].color);
            x += (float)(LEGEND_LINE + LEGEND_TEXT);
            image_text(result, x, y, legend_size, 0.0f, ink, view->contours[c].name);
            x += (float)LEGEND_GAP + image_text_width(legend_size, view->contours[c].name);
        }
    }
    return true;
}

bool slices_render(const struct slices_view *view, struct image *result)
{
    const struct color background = {0.07f, 0.07f, 0.08f};
    struct plane planes[3];
    struct image pictures[3], strip;
    char captions[3][48];
    const char *caption_list[3];
    float lo = 0.0f, hi = 1.0f;
    memset(pictures, 0, sizeof pictures);
    memset(&strip, 0, sizeof strip);
    memset(result, 0, sizeof *result);
    bool good = make_planes(view, planes) && find_window(view, planes, &lo, &hi);
    for (int p = 0; p < 3 && good; ++p) {
        good = image_create(&pictures[p], planes[p].width, planes[p].height, background);
        if (good) {
            draw_gray(view->volume, &planes[p], lo, hi, &pictures[p]);
            for (int c = 0; c < view->contour_count; ++c) {
                draw_contour(view->volume, &planes[p], &view->contours[c], &pictures[p]);
            }
            draw_letters(&planes[p], &pictures[p]);
            snprintf(captions[p], sizeof captions[p], "%s, slice %d of %d", planes[p].name, planes[p].index + 1,
                     view->volume->dims[planes[p].normal]);
            caption_list[p] = captions[p];
        }
    }
    good = good && image_strip(pictures, caption_list, 3, 3, background, &strip)
           && add_words(view, &strip, background, result);
    for (int p = 0; p < 3; ++p) {
        image_free(&pictures[p]);
    }
    image_free(&strip);
    return good;
}
