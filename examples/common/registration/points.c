#define _POSIX_C_SOURCE 200809L

#include "registration/points.h"

#include "base/cli.h"
#include "base/write_error.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_POINTS = 1000000, COLUMNS = 5 };

static bool path_error(char error[VOLUME_TEXT], const char *path, const char *text)
{
    const size_t length = strlen(path); /* the end of a long path is more useful */
    snprintf(error, VOLUME_TEXT, "%s%s: %s", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path, text);
    return false;
}

/* Reads a point set. Returns NULL, or what is wrong. */
static const char *read_set(FILE *file, const struct volume *image, float **points, size_t *count)
{
    char word[16];
    long number = 0;
    if (fscanf(file, "%15s %ld", word, &number) != 2 || (strcmp(word, "index") != 0 && strcmp(word, "point") != 0)) {
        return "no point set: it does not begin with index or point and a number";
    }
    if (number < 1 || number > MAX_POINTS) {
        return "the number of points is not between 1 and a million";
    }
    *points = malloc(3 * (size_t)number * sizeof **points);
    if (!*points) {
        return "not enough memory";
    }
    for (size_t n = 0; n < (size_t)number; ++n) {
        float x[3], *out = *points + 3 * n;
        if (fscanf(file, "%f %f %f", &x[0], &x[1], &x[2]) != 3) {
            return "cut off: there are fewer points than it promises";
        }
        if (word[0] == 'i') {
            volume_index_to_world(image, x, out);
        } else { /* LPS+ to RAS+ */
            out[0] = -x[0];
            out[1] = -x[1];
            out[2] = x[2];
        }
        if (!isfinite(out[0]) || !isfinite(out[1]) || !isfinite(out[2])) {
            return "a coordinate is not finite";
        }
    }
    *count = (size_t)number;
    return NULL;
}

bool points_read(const char *path, const struct volume *image, float **points, size_t *count, char error[VOLUME_TEXT])
{
    FILE *file = fopen(path, "r");
    *points = NULL;
    *count = 0;
    if (!file) {
        return path_error(error, path, "cannot open");
    }
    const char *wrong = read_set(file, image, points, count);
    fclose(file);
    if (wrong) {
        free(*points);
        *points = NULL;
        return path_error(error, path, wrong);
    }
    return true;
}

bool points_write(const char *path, const float *points, size_t count, char error[VOLUME_TEXT])
{
    FILE *file = fopen(path, "w");
    if (!file) {
        return volume_write_error(error, path);
    }
    bool good = fprintf(file, "point\n%zu\n", count) > 0;
    for (size_t n = 0; n < count; ++n) { /* RAS+ to LPS+ */
        const float *x = points + 3 * n;
        good = good && fprintf(file, "%.9g %.9g %.9g\n", -(double)x[0], -(double)x[1], (double)x[2]) > 0;
    }
    if (fclose(file) != 0 || !good) {
        volume_write_error(error, path);
        partial_file_remove(path);
        return false;
    }
    return true;
}

/* ---- landmarks of several frames ---- */

struct row {
    int landmark, frame;
    float x[3];
};

struct table {
    struct row *rows;
    size_t count, room;
    int columns[COLUMNS]; /* columns of landmark, frame, x_mm, y_mm, z_mm */
};

/* Returns the next item of a line without surrounding blanks and line end; NULL after the last. */
static char *next_item(char **rest)
{
    char *item = *rest;
    if (!item) {
        return NULL;
    }
    char *comma = strchr(item, ',');
    *rest = comma ? comma + 1 : NULL;
    if (comma) {
        *comma = '\0';
    }
    item += strspn(item, " \t");
    item[strcspn(item, " \t\r\n")] = '\0';
    return item;
}

static bool read_names(char *line, struct table *table)
{
    static const char *const names[COLUMNS] = {"landmark", "frame", "x_mm", "y_mm", "z_mm"};
    int found = 0, column = 0;
    for (char *item; (item = next_item(&line)); ++column) {
        for (int c = 0; c < COLUMNS; ++c) {
            if (strcmp(item, names[c]) == 0) {
                table->columns[c] = column;
                found |= 1 << c;
            }
        }
    }
    return found == (1 << COLUMNS) - 1;
}

static bool read_row(char *line, const struct table *table, struct row *row)
{
    int found = 0, column = 0;
    for (char *item; (item = next_item(&line)); ++column) {
        for (int c = 0; c < COLUMNS; ++c) {
            double value = 0.0;
            if (table->columns[c] != column) {
                continue;
            }
            if (c == 0 ? !cli_read_int(item, &row->landmark) : c == 1 ? !cli_read_int(item, &row->frame)
                : !cli_read_double(item, &value) || fabs(value) > (double)FLT_MAX) {
                return false;
            }
            if (c >= 2) {
                row->x[c - 2] = (float)value;
            }
            found |= 1 << c;
        }
    }
    return found == (1 << COLUMNS) - 1 && row->landmark >= 0 && row->landmark < MAX_POINTS && row->frame >= 0
           && row->frame < MAX_POINTS;
}

static const char *read_table(FILE *file, struct table *table)
{
    char line[1024];
    if (!fgets(line, sizeof line, file) || !read_names(line, table)) {
        return "no landmarks: the first line does not name landmark, frame, x_mm, y_mm and z_mm";
    }
    while (fgets(line, sizeof line, file)) {
        if (line[strspn(line, " \t\r\n")] == '\0') {
            continue;
        }
        if (table->count == table->room) {
            const size_t room = table->room > 0 ? 2 * table->room : 1024;
            struct row *rows = room <= MAX_POINTS ? realloc(table->rows, room * sizeof *rows) : NULL;
            if (!rows) {
                return "too many landmarks";
            }
            table->rows = rows;
            table->room = room;
        }
        if (!read_row(line, table, &table->rows[table->count])) {
            return "a line is not that of a landmark";
        }
        ++table->count;
    }
    return table->count > 0 ? NULL : "there are no landmarks";
}

/* Sorts the rows into *points and checks that every landmark is there once in every frame. Returns NULL, or what is wrong. */
static const char *arrange(const struct table *table, float **points, size_t *landmarks, size_t *frames)
{
    size_t l = 0, f = 0;
    for (size_t n = 0; n < table->count; ++n) {
        l = (size_t)table->rows[n].landmark >= l ? (size_t)table->rows[n].landmark + 1 : l;
        f = (size_t)table->rows[n].frame >= f ? (size_t)table->rows[n].frame + 1 : f;
    }
    if (table->count != l * f) {
        return "not every landmark is there once in every frame";
    }
    *points = malloc(3 * l * f * sizeof **points);
    if (!*points) {
        return "not enough memory";
    }
    for (size_t n = 0; n < 3 * l * f; ++n) {
        (*points)[n] = NAN;
    }
    for (size_t n = 0; n < table->count; ++n) {
        memcpy(*points + 3 * ((size_t)table->rows[n].frame * l + (size_t)table->rows[n].landmark), table->rows[n].x,
               3 * sizeof(float));
    }
    for (size_t n = 0; n < 3 * l * f; ++n) {
        if (isnan((*points)[n])) {
            return "not every landmark is there once in every frame";
        }
    }
    *landmarks = l;
    *frames = f;
    return NULL;
}

bool points_read_frames(const char *path, float **points, size_t *landmarks, size_t *frames, char error[VOLUME_TEXT])
{
    struct table table;
    FILE *file = fopen(path, "r");
    memset(&table, 0, sizeof table);
    *points = NULL;
    *landmarks = *frames = 0;
    if (!file) {
        return path_error(error, path, "cannot open");
    }
    const char *wrong = read_table(file, &table);
    fclose(file);
    wrong = wrong ? wrong : arrange(&table, points, landmarks, frames);
    free(table.rows);
    if (wrong) {
        free(*points);
        *points = NULL;
        return path_error(error, path, wrong);
    }
    return true;
}
