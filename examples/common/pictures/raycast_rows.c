#include "pictures/raycast_rows.h"

#include "base/vec3.h"

#include <stdlib.h>

/* A triangle in the picture: corners in samples, from the upper left; `slack` covers the rounding of the projection and of the
 * test. */
struct projection {
    double x[3], y[3], slack;
    bool whole; /* reaches behind the eye: may be anywhere */
};

/* Comparisons are inlined, which fmin and fmax are not; if b is NaN, a. */
static double least(double a, double b) { return b < a ? b : a; }
static double most(double a, double b) { return b > a ? b : a; }

static int band_rows(const struct raycast_rows *rows) { return RAYCAST_BAND * rows->samples; }

int raycast_band_count(const struct raycast_rows *rows) { return (rows->height + RAYCAST_BAND - 1) / RAYCAST_BAND; }

/* Returns false if no ray can hit the triangle: it lies behind the eye, or is not finite. */
static bool project(const struct raycast_rows *rows, const float *corners, struct projection *p)
{
    const struct raycast_frame *frame = &rows->frame;
    const double width = rows->width * rows->samples, height = rows->height * rows->samples;
    double extent = width + height;
    int behind = 0;
    for (int k = 0; k < 3; ++k) {
        float d[3];
        vec3_sub(corners + 3 * k, rows->camera->eye, d);
        const double depth = (double)vec3_dot(d, frame->forward), scale = frame->perspective ? depth : 1.0;
        if (!isfinite(depth)) {
            return false;
        }
        behind += depth <= 0.0;
        p->x[k] = 0.5 * width * (1.0 + (double)vec3_dot(d, frame->right) / (scale * (double)frame->half_width));
        p->y[k] = 0.5 * height * (1.0 - (double)vec3_dot(d, frame->up) / (scale * (double)frame->half_height));
        extent = most(extent, most(fabs(p->x[k]), fabs(p->y[k])));
    }
    p->slack = 0.02 + 4e-6 * extent;
    p->whole = frame->perspective && behind > 0;
    return behind < 3;
}

/* Finds the rows or columns whose middle lies in lo..hi; none: last < first. */
static void middles(double lo, double hi, int count, int *first, int *last)
{
    *first = (int)ceil(least(count, most(0.0, lo - 0.5)));
    *last = (int)floor(most(-1.0, least(count - 1.0, hi - 0.5)));
}

static void rows_of(const struct raycast_rows *rows, const struct projection *p, int *first, int *last)
{
    const double lo = p->whole ? -INFINITY : least(p->y[0], least(p->y[1], p->y[2])) - p->slack;
    const double hi = p->whole ? INFINITY : most(p->y[0], most(p->y[1], p->y[2])) + p->slack;
    middles(lo, hi, rows->height * rows->samples, first, last);
}

/* Finds the samples of a row that lie in the projection: those between its sides, where these cross the row. */
static void columns_of(const struct raycast_rows *rows, const struct projection *p, int row, int *first, int *last)
{
    const double above = row + 0.5 - p->slack, below = row + 0.5 + p->slack;
    double lo = p->whole ? -INFINITY : INFINITY, hi = p->whole ? INFINITY : -INFINITY;
    for (int k = 0; k < 3 && !p->whole; ++k) {
        const int m = (k + 1) % 3;
        const double rise = p->y[m] - p->y[k], run = p->x[m] - p->x[k];
        if (most(p->y[k], p->y[m]) < above || least(p->y[k], p->y[m]) > below) {
            continue;
        }
        for (int end = 0; end < 2; ++end) {
            const double at = rise != 0.0 ? most(0.0, least(1.0, ((end ? below : above) - p->y[k]) / rise)) : end;
            lo = least(lo, p->x[k] + at * run);
            hi = most(hi, p->x[k] + at * run);
        }
    }
    middles(lo - p->slack, hi + p->slack, rows->width * rows->samples, first, last);
}

/* Finds the bands that a triangle's projection reaches; none: last < first. */
static void bands_of(const struct raycast_rows *rows, size_t triangle, int *first, int *last)
{
    struct projection p;
    *first = 0;
    *last = -1;
    if (!project(rows, rows->corners + 9 * triangle, &p)) {
        return;
    }
    rows_of(rows, &p, first, last);
    if (*first <= *last) {
        *first /= band_rows(rows);
        *last /= band_rows(rows);
    }
}

bool raycast_rows_create(struct raycast_rows *rows, size_t triangle_count)
{
    const size_t bands = (size_t)raycast_band_count(rows);
    int first, last;
    rows->items = NULL;
    rows->starts = calloc(bands + 2, sizeof *rows->starts);
    if (!rows->starts) {
        return false;
    }
    for (size_t t = 0; t < triangle_count; ++t) { /* counts two bands ahead: filling moves each start on by one */
        bands_of(rows, t, &first, &last);
        for (int b = first; b <= last; ++b) {
            rows->starts[b + 2]++;
        }
    }
    for (size_t b = 0; b < bands; ++b) {
        rows->starts[b + 2] += rows->starts[b + 1];
    }
    rows->items = malloc((rows->starts[bands + 1] + 1) * sizeof *rows->items);
    for (size_t t = 0; rows->items && t < triangle_count; ++t) {
        bands_of(rows, t, &first, &last);
        for (int b = first; b <= last; ++b) {
            rows->items[rows->starts[b + 1]++] = (uint32_t)t;
        }
    }
    return rows->items != NULL;
}

void raycast_rows_free(struct raycast_rows *rows)
{
    free(rows->starts);
    free(rows->items);
    rows->starts = NULL;
    rows->items = NULL;
}

static void make_rays(const struct raycast_rows *rows, int band, struct raycast_ray *rays)
{
    const int n = rows->samples;
    for (int row = 0; row < band_rows(rows); ++row) {
        const float py = raycast_sample(band * band_rows(rows) + row, n);
        for (int column = 0; column < rows->width * n; ++column, ++rays) {
            const float px = raycast_sample(column, n);
            raycast_camera_ray(rows->camera, &rows->frame, 2.0f * px / (float)rows->width - 1.0f,
                               1.0f - 2.0f * py / (float)rows->height, rays->origin, rays->direction);
            rays->hit.t = INFINITY;
        }
    }
}

void raycast_band_trace(const struct raycast_rows *rows, int band, struct raycast_ray *rays)
{
    const int top = band * band_rows(rows), bottom = top + band_rows(rows) - 1;
    make_rays(rows, band, rays);
    for (size_t i = rows->starts[band]; i < rows->starts[band + 1]; ++i) {
        const uint32_t triangle = rows->items[i];
        struct projection p;
        int first, last;
        project(rows, rows->corners + 9 * (size_t)triangle, &p);
        rows_of(rows, &p, &first, &last);
        for (int row = first > top ? first : top; row <= (last < bottom ? last : bottom); ++row) {
            int left, right;
            columns_of(rows, &p, row, &left, &right);
            struct raycast_ray *line = rays + (size_t)(row - top) * (size_t)(rows->width * rows->samples);
            for (int x = left; x <= right; ++x) {
                if (bvh_hit_triangle(rows->corners + 9 * (size_t)triangle, line[x].origin, line[x].direction, 0.0f, line[x].hit.t,
                                     &line[x].hit)) {
                    line[x].hit.triangle = triangle;
                }
            }
        }
    }
}
