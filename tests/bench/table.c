#include "table.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>

void table_begin(struct table *table)
{
    memset(table, 0, sizeof *table);
}

void table_row(struct table *table, const char *format, ...)
{
    char line[TABLE_COLUMNS * TABLE_CELL];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    if (table->rows == TABLE_ROWS) {
        return;
    }
    char *at = line;
    for (int column = 0; at && column < TABLE_COLUMNS; ++column) {
        const size_t length = strcspn(at, "|");
        snprintf(table->cells[table->rows][column], TABLE_CELL, "%.*s", (int)length, at);
        table->columns = column + 1 > table->columns ? column + 1 : table->columns;
        at = at[length] ? at + length + 1 : NULL;
    }
    ++table->rows;
}

void table_print(const struct table *table, FILE *file)
{
    int width[TABLE_COLUMNS] = {0};
    for (int r = 0; r < table->rows; ++r) {
        for (int c = 0; c < table->columns; ++c) {
            const int length = (int)strlen(table->cells[r][c]);
            width[c] = length > width[c] ? length : width[c];
        }
    }
    for (int r = 0; r < table->rows; ++r) {
        for (int c = 0; c < table->columns; ++c) {
            fprintf(file, "| %-*s ", width[c], table->cells[r][c]);
        }
        fputs("|\n", file);
        for (int c = 0; r == 0 && c < table->columns; ++c) {
            static const char dashes[] = "------------------------------------------------------------------------"
                                         "------------------------";
            fprintf(file, "|%.*s", width[c] + 2, dashes);
        }
        if (r == 0) {
            fputs("|\n", file);
        }
    }
}

void table_json(const struct table *table, struct json_writer *json, const char *title)
{
    json_object_begin(json, NULL);
    json_string(json, "title", title);
    json_array_begin(json, "rows");
    for (int r = 0; r < table->rows; ++r) {
        json_array_begin(json, NULL);
        for (int c = 0; c < table->columns; ++c) {
            json_string(json, NULL, table->cells[r][c]);
        }
        json_array_end(json);
    }
    json_array_end(json);
    json_object_end(json);
}

static char *next_text(void)
{
    static char texts[32][TABLE_CELL];
    static int next;
    next = (next + 1) % 32;
    return texts[next];
}

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
#endif

const char *cell(const char *format, double value)
{
    char *text = next_text();
    snprintf(text, TABLE_CELL, isfinite(value) ? format : "-", value);
    return text;
}

const char *run_cell(const struct run *run, const char *format, const char *key)
{
    return cell(format, run_number(run, key));
}

const char *cell2(const char *format, double a, double b)
{
    char *text = next_text();
    snprintf(text, TABLE_CELL, isfinite(a) && isfinite(b) ? format : "-", a, b);
    return text;
}
