#include "pictures/plot.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct color INK = {0.15f, 0.15f, 0.18f};
static const struct color GRID = {0.88f, 0.88f, 0.90f};
static const struct color PAPER = {1.0f, 1.0f, 1.0f};

enum { MAX_TICKS = 24, MARGIN_TOP = 44, MARGIN_RIGHT = 28, MARGIN_BOTTOM = 58, MARGIN_LEFT = 86 };

struct axis {
    bool logarithmic;
    bool fractions; /* some value is not a whole number; if all are, ticks are whole numbers too */
    double lo, hi; /* in log10 units on a logarithmic axis */
    double ticks[MAX_TICKS];
    int tick_count;
    float pixel_lo, pixel_hi;
};

static double axis_value(const struct axis *axis, double v)
{
    return axis->logarithmic ? (v > 0.0 ? log10(v) : NAN) : v;
}

static float axis_pixel(const struct axis *axis, double v)
{
    const double t = (axis_value(axis, v) - axis->lo) / (axis->hi - axis->lo);
    return axis->pixel_lo + (float)t * (axis->pixel_hi - axis->pixel_lo);
}

static void axis_include(struct axis *axis, double v)
{
    const double a = axis_value(axis, v);
    if (isfinite(a)) {
        axis->lo = fmin(axis->lo, a);
        axis->hi = fmax(axis->hi, a);
        axis->fractions = axis->fractions || a != floor(a);
    }
}

/* Returns a step of 1, 2 or 5 times a power of ten that divides the span into about `wanted` steps. */
static double round_step(double span, int wanted)
{
    const double raw = span / wanted, power = pow(10.0, floor(log10(raw))), share = raw / power;
    return power * (share < 1.5 ? 1.0 : share < 3.5 ? 2.0 : share < 7.5 ? 5.0 : 10.0);
}

/* Sets ticks at powers of ten; where there are few decades, at 1, 2 and 5 in each. */
static void set_logarithmic_ticks(struct axis *axis)
{
    static const double inside[3] = {1.0, 2.0, 5.0};
    const bool fine = axis->hi - axis->lo < 2.5;
    const double margin = 0.03 * (axis->hi - axis->lo);
    axis->lo -= margin;
    axis->hi += margin;
    const int skip = (int)fmax(1.0, ceil((axis->hi - axis->lo) / 10.0));
    for (int decade = (int)floor(axis->lo); decade <= (int)ceil(axis->hi); decade += fine ? 1 : skip) {
        for (int k = 0; k < (fine ? 3 : 1); ++k) {
            const double v = inside[k] * pow(10.0, decade), a = log10(v);
            if (a >= axis->lo && a <= axis->hi && axis->tick_count < MAX_TICKS) {
                axis->ticks[axis->tick_count++] = v;
            }
        }
    }
}

/* Sets about `wanted` ticks at round values and extends the axis to whole steps. */
static void set_linear_ticks(struct axis *axis, int wanted)
{
    const double round = round_step(axis->hi - axis->lo, wanted), step = axis->fractions ? round : fmax(1.0, round);
    axis->lo = step * floor(axis->lo / step + 1e-9);
    axis->hi = step * ceil(axis->hi / step - 1e-9);
    for (int i = 0; i < MAX_TICKS && axis->lo + i * step <= axis->hi + 0.5 * step; ++i) {
        const double v = axis->lo + i * step;
        axis->ticks[axis->tick_count++] = fabs(v) < 1e-9 * step ? 0.0 : v;
    }
}

static void axis_finish(struct axis *axis, int wanted)
{
    if (!(axis->hi - axis->lo > 1e-12 * fmax(1.0, fabs(axis->hi)))) {
        const double margin = axis->logarithmic ? 0.3 : fmax(0.5 * fabs(axis->hi), 1e-6);
        axis->lo -= margin;
        axis->hi += margin;
    }
    if (axis->logarithmic) {
        set_logarithmic_ticks(axis);
    } else {
        set_linear_ticks(axis, wanted);
    }
}

static void draw_axes(struct image *image, const struct plot *plot, const struct axis *x, const struct axis *y)
{
    char text[32];
    for (int i = 0; i < x->tick_count; ++i) {
        const float p = axis_pixel(x, x->ticks[i]);
        image_line(image, p, y->pixel_lo, p, y->pixel_hi, 1.0f, GRID);
        image_line(image, p, y->pixel_lo, p, y->pixel_lo + 5.0f, 1.0f, INK);
        snprintf(text, sizeof text, "%g", x->ticks[i]);
        image_text(image, p, y->pixel_lo + 19.0f, 8.5f, 0.5f, INK, text);
    }
    for (int i = 0; i < y->tick_count; ++i) {
        const float p = axis_pixel(y, y->ticks[i]);
        image_line(image, x->pixel_lo, p, x->pixel_hi, p, 1.0f, GRID);
        image_line(image, x->pixel_lo - 5.0f, p, x->pixel_lo, p, 1.0f, INK);
        snprintf(text, sizeof text, "%g", y->ticks[i]);
        image_text(image, x->pixel_lo - 9.0f, p + 4.0f, 8.5f, 1.0f, INK, text);
    }
    image_line(image, x->pixel_lo, y->pixel_lo, x->pixel_hi, y->pixel_lo, 1.3f, INK);
    image_line(image, x->pixel_lo, y->pixel_lo, x->pixel_lo, y->pixel_hi, 1.3f, INK);
    if (plot->title) {
        image_text(image, 0.5f * (x->pixel_lo + x->pixel_hi), 27.0f, 11.5f, 0.5f, INK, plot->title);
    }
    if (plot->x_label) {
        image_text(image, 0.5f * (x->pixel_lo + x->pixel_hi), (float)image->height - 14.0f, 9.5f, 0.5f, INK,
                   plot->x_label);
    }
    if (plot->y_label) {
        image_text_upward(image, 22.0f, 0.5f * (y->pixel_lo + y->pixel_hi), 9.5f, 0.5f, INK, plot->y_label);
    }
}

/* Position and size of a legend. */
struct legend {
    int rows, corner; /* bit 0 right, bit 1 bottom */
    float width, height;
};

enum { LEGEND_ROW = 18, LEGEND_GAP = 8 };

static struct legend measure_legend(const struct plot *plot)
{
    struct legend legend = {0, 1, 0.0f, 0.0f};
    for (int s = 0; s < plot->series_count; ++s) {
        if (plot->series[s].label) {
            legend.width = fmaxf(legend.width, image_text_width(8.5f, plot->series[s].label) + 52.0f);
            ++legend.rows;
        }
    }
    legend.height = (float)(LEGEND_ROW * legend.rows) + 10.0f;
    return legend;
}

/* Returns true if a legend in this corner would hide a point or a line between two. */
static bool hides(const struct plot *plot, const struct axis *x, const struct axis *y, const struct legend *legend,
                  int corner)
{
    enum { PIECES = 16 };
    const float width = legend->width + 12.0f, height = legend->height + 12.0f;
    for (int s = 0; s < plot->series_count; ++s) {
        const struct plot_series *series = &plot->series[s];
        for (size_t i = 0; i < series->count; ++i) {
            const size_t before = i > 0 && !series->no_line ? i - 1 : i;
            const float qx = axis_pixel(x, series->x[before]), qy = axis_pixel(y, series->y[before]);
            const float dx = axis_pixel(x, series->x[i]) - qx, dy = axis_pixel(y, series->y[i]) - qy;
            for (int k = 1; k <= PIECES; ++k) {
                const float px = qx + dx * (float)k / PIECES, py = qy + dy * (float)k / PIECES;
                const bool in_x = corner & 1 ? px > x->pixel_hi - width : px < x->pixel_lo + width;
                const bool in_y = corner & 2 ? py > y->pixel_lo - height : py < y->pixel_hi + height;
                if (in_x && in_y) {
                    return true;
                }
            }
        }
    }
    return false;
}

/* Chooses a corner where nothing is hidden; returns false when there is none. */
static bool find_corner(const struct plot *plot, const struct axis *x, const struct axis *y, struct legend *legend)
{
    static const int order[4] = {1, 0, 3, 2};
    for (int k = 0; k < 4; ++k) {
        if (!hides(plot, x, y, legend, order[k])) {
            legend->corner = order[k];
            return true;
        }
    }
    return false;
}

static void draw_sample(struct image *image, const struct plot_series *s, float x, float y)
{
    const struct color color = color_category(s->style);
    if (!s->no_line) {
        image_line(image, x, y, x + 26.0f, y, 2.2f, color);
    }
    if (s->marks || s->no_line) {
        image_glyph(image, s->style, x + 13.0f, y, 5.0f, color);
    }
}

static void draw_legend(struct image *image, const struct plot *plot, const struct legend *legend, const struct axis *x,
                        const struct axis *y)
{
    const float left = legend->corner & 1 ? x->pixel_hi - legend->width - LEGEND_GAP : x->pixel_lo + LEGEND_GAP;
    float top = legend->corner & 2 ? y->pixel_lo - legend->height - LEGEND_GAP : y->pixel_hi + LEGEND_GAP;
    image_rect(image, left, top, left + legend->width, top + legend->height, PAPER, 0.85f);
    image_frame(image, left, top, left + legend->width, top + legend->height, 1.0f, GRID);
    for (int s = 0; s < plot->series_count; ++s) {
        if (plot->series[s].label) {
            draw_sample(image, &plot->series[s], left + 8.0f, top + 14.0f);
            image_text(image, left + 42.0f, top + 18.0f, 8.5f, 0.0f, INK, plot->series[s].label);
            top += LEGEND_ROW;
        }
    }
}

/* Extends both axes by all points that can be drawn. Returns false if there are none. */
static bool include_points(const struct plot *plot, struct axis *x, struct axis *y)
{
    for (int s = 0; s < plot->series_count; ++s) {
        const struct plot_series *series = &plot->series[s];
        for (size_t i = 0; i < series->count; ++i) {
            if (isfinite(axis_value(x, series->x[i])) && isfinite(axis_value(y, series->y[i]))) {
                axis_include(x, series->x[i]);
                axis_include(y, series->y[i]);
            }
        }
    }
    if (plot->y_from_zero && !plot->log_y) {
        axis_include(y, 0.0);
    }
    return x->lo <= x->hi;
}

/* Sets ticks and places the legend: in a free corner, else above all data, for which the y axis is extended. */
static void finish_axes(const struct plot *plot, const struct image *image, struct axis *x, struct axis *y, struct legend *legend)
{
    struct axis higher = *y;
    const float room = legend->height + 3.0f * LEGEND_GAP;
    higher.hi += (y->hi - y->lo) * (double)(room / fmaxf(1.0f, y->pixel_lo - y->pixel_hi - room));
    axis_finish(x, image->width / 90);
    axis_finish(y, image->height / 60);
    if (legend->rows > 0 && !find_corner(plot, x, y, legend)) {
        axis_finish(&higher, image->height / 60);
        *y = higher;
    }
}

/* Draws the points of a series and the lines between them; a point that is not finite breaks the line. */
static void draw_series(struct image *image, const struct plot_series *series, const struct axis *x, const struct axis *y)
{
    const struct color color = color_category(series->style);
    for (size_t i = 0; i < series->count; ++i) {
        const float px = axis_pixel(x, series->x[i]), py = axis_pixel(y, series->y[i]);
        if (!isfinite(px) || !isfinite(py)) {
            continue;
        }
        if (i > 0 && !series->no_line) {
            const float qx = axis_pixel(x, series->x[i - 1]), qy = axis_pixel(y, series->y[i - 1]);
            if (isfinite(qx) && isfinite(qy)) {
                image_line(image, qx, qy, px, py, 2.2f, color);
            }
        }
        if (series->marks || series->no_line) {
            image_glyph(image, series->style, px, py, 5.0f, color);
        }
    }
}

bool plot_render(const struct plot *plot, int width, int height, struct image *result)
{
    struct axis x = {.logarithmic = plot->log_x, .lo = INFINITY, .hi = -INFINITY};
    struct axis y = {.logarithmic = plot->log_y, .lo = INFINITY, .hi = -INFINITY};
    struct legend legend = measure_legend(plot);
    memset(result, 0, sizeof *result);
    if (!include_points(plot, &x, &y) || width < MARGIN_LEFT + MARGIN_RIGHT + 20 || height < MARGIN_TOP + MARGIN_BOTTOM + 20
        || !image_create(result, width, height, PAPER)) {
        return false;
    }
    x.pixel_lo = MARGIN_LEFT;
    x.pixel_hi = (float)(width - MARGIN_RIGHT);
    y.pixel_lo = (float)(height - MARGIN_BOTTOM);
    y.pixel_hi = MARGIN_TOP;
    finish_axes(plot, result, &x, &y, &legend);
    draw_axes(result, plot, &x, &y);
    for (int s = 0; s < plot->series_count; ++s) {
        draw_series(result, &plot->series[s], &x, &y);
    }
    if (legend.rows > 0) {
        draw_legend(result, plot, &legend, &x, &y);
    }
    return true;
}

/* ---- heat map ---- */

struct heat_scale {
    double lo, hi;
};

static void draw_heat_bar(struct image *image, const struct heat_map *map, const struct heat_scale *scale, float left,
                          float top, float bottom)
{
    char text[32];
    const float right = left + 18.0f;
    for (int y = (int)top; y < (int)bottom; ++y) {
        const float t = (bottom - (float)y - 0.5f) / (bottom - top);
        image_rect(image, left, (float)y, right, (float)y + 1.0f, colormap_sequential(t), 1.0f);
    }
    image_frame(image, left, top, right, bottom, 1.0f, INK);
    for (int i = 0; i <= 4; ++i) {
        const double v = scale->lo + (scale->hi - scale->lo) * i / 4.0;
        snprintf(text, sizeof text, "%.3g", v);
        image_text(image, right + 6.0f, bottom - (bottom - top) * (float)i / 4.0f + 4.0f, 8.5f, 0.0f, INK, text);
    }
    if (map->value_label) {
        image_text_upward(image, right + 68.0f, 0.5f * (top + bottom), 9.0f, 0.5f, INK, map->value_label);
    }
}

static void draw_heat_cell(struct image *image, const struct heat_map *map, const struct heat_scale *scale, int cell,
                           float x, float y, float size)
{
    const double value = map->values[cell];
    char text[32];
    if (!isfinite(value)) {
        image_rect(image, x, y, x + size, y + size, color_rgb(0.93f, 0.93f, 0.93f), 1.0f);
        image_line(image, x + 4.0f, y + size - 4.0f, x + size - 4.0f, y + 4.0f, 1.5f, color_rgb(0.75f, 0.75f, 0.75f));
        return;
    }
    const double span = scale->hi - scale->lo;
    const float t = span > 0.0 ? (float)((value - scale->lo) / span) : 0.0f;
    image_rect(image, x, y, x + size - 1.0f, y + size - 1.0f, colormap_sequential(t), 1.0f);
    const float cx = x + 0.5f * size - 0.5f, cy = y + 0.5f * size - 0.5f;
    if (map->glyph_shapes && map->glyph_shapes[cell] >= 0) {
        const int shape = map->glyph_shapes[cell];
        const struct color color = color_category(map->glyph_colors ? map->glyph_colors[cell] : shape);
        image_glyph(image, shape, cx, cy, 0.36f * size + 2.0f, PAPER); /* white rim, visible on every background */
        image_glyph(image, shape, cx, cy, 0.36f * size - 1.0f, color);
    } else if (map->print_values) {
        snprintf(text, sizeof text, "%.3g", value);
        image_text(image, cx, cy + 4.0f, 8.0f, 0.5f, t > 0.6f ? INK : PAPER, text);
    }
}

bool heat_map_render(const struct heat_map *map, int cell_size, struct image *result)
{
    struct heat_scale scale = {INFINITY, -INFINITY};
    float name_width = 0.0f;
    memset(result, 0, sizeof *result);
    if (map->rows < 1 || map->columns < 1 || cell_size < 4) {
        return false;
    }
    for (int i = 0; i < map->rows * map->columns; ++i) {
        const double v = map->values[i];
        if (isfinite(v)) {
            scale.lo = fmin(scale.lo, v);
            scale.hi = fmax(scale.hi, v);
        }
    }
    if (!(scale.lo <= scale.hi)) {
        return false;
    }
    for (int r = 0; map->row_names && r < map->rows; ++r) {
        name_width = fmaxf(name_width, image_text_width(8.5f, map->row_names[r]));
    }
    const float size = (float)cell_size, left = 44.0f + name_width, top = MARGIN_TOP;
    const float right = left + size * (float)map->columns, bottom = top + size * (float)map->rows;
    if (!image_create(result, (int)right + 126, (int)bottom + MARGIN_BOTTOM, PAPER)) {
        return false;
    }
    for (int r = 0; r < map->rows; ++r) {
        const float y = top + size * (float)r;
        for (int c = 0; c < map->columns; ++c) {
            draw_heat_cell(result, map, &scale, r * map->columns + c, left + size * (float)c, y, size);
        }
        if (map->row_names) {
            image_text(result, left - 8.0f, y + 0.5f * size + 4.0f, 8.5f, 1.0f, INK, map->row_names[r]);
        }
    }
    for (int c = 0; map->column_names && c < map->columns; ++c) {
        image_text(result, left + size * ((float)c + 0.5f), bottom + 18.0f, 8.5f, 0.5f, INK, map->column_names[c]);
    }
    if (map->title) {
        image_text(result, 0.5f * (left + right), 27.0f, 11.5f, 0.5f, INK, map->title);
    }
    if (map->column_label) {
        image_text(result, 0.5f * (left + right), (float)result->height - 14.0f, 9.5f, 0.5f, INK, map->column_label);
    }
    if (map->row_label) {
        image_text_upward(result, 22.0f, 0.5f * (top + bottom), 9.5f, 0.5f, INK, map->row_label);
    }
    draw_heat_bar(result, map, &scale, right + 26.0f, top, bottom);
    return true;
}
