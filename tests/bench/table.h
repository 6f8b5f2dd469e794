/* table.h - tables that read well on a terminal and are Markdown. */
#ifndef BENCH_TABLE_H
#define BENCH_TABLE_H

#include "runs.h"

#include <stdio.h>

enum { TABLE_ROWS = 40, TABLE_COLUMNS = 16, TABLE_CELL = 96 };

struct table {
    int rows, columns;
    char cells[TABLE_ROWS][TABLE_COLUMNS][TABLE_CELL]; /* row 0: names */
};

/* One row by printf, its cells between '|'. The first row names the columns. */
void table_begin(struct table *table);
void table_row(struct table *table, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void table_print(const struct table *table, FILE *file);
/* An object of the array that is open: "title" and "rows", arrays of texts. */
void table_json(const struct table *table, struct json_writer *json, const char *title);

/* A number for a cell: "-" when it is not finite. Good until 32 more are asked for. */
const char *cell(const char *format, double value);
const char *run_cell(const struct run *run, const char *format, const char *key); /* run_number's */
const char *cell2(const char *format, double a, double b); /* mean +- deviation and the like */

#endif
