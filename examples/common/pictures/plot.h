/* plot.h - line plots and heat maps. */
#ifndef EXAMPLES_PICTURES_PLOT_H
#define EXAMPLES_PICTURES_PLOT_H

#include "pictures/image.h"

struct plot_series {
    const char *label; /* for the legend; NULL = not listed */
    const double *x, *y;
    size_t count; /* points that are not finite (or not positive on a log axis) break the line */
    int style;    /* colour and mark: color_category(style), glyph `style` */
    bool marks;   /* a mark at every point */
    bool no_line;
};

struct plot {
    const char *title, *x_label, *y_label; /* NULL = none */
    bool log_x, log_y;
    bool y_from_zero; /* start the y axis at 0 even if the data do not (linear axis only) */
    const struct plot_series *series;
    int series_count;
};

/* Makes a new picture of width x height pixels. Returns false if there is nothing finite to draw or memory is short. */
bool plot_render(const struct plot *plot, int width, int height, struct image *result);

struct heat_map {
    const char *title, *row_label, *column_label, *value_label;
    int rows, columns;
    const char *const *row_names;    /* may be NULL */
    const char *const *column_names; /* may be NULL */
    const double *values;            /* rows * columns, row by row; not finite = hatched cell */
    const int *glyph_shapes;         /* one a cell, negative = none; NULL = no glyphs */
    const int *glyph_colors;         /* color_category index a cell; NULL = by shape */
    bool print_values; /* %.3g in every cell without a glyph */
};

bool heat_map_render(const struct heat_map *map, int cell_size, struct image *result);

#endif
