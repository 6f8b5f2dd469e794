/* paper.h - what the parts of the driver of `make paper` share: the list of runs and the report. */
#ifndef BENCH_PAPER_H
#define BENCH_PAPER_H

#include "runs.h"
#include "table.h"

#include "examples/common/base/json.h"
#include "examples/common/pictures/plot.h"

#include <stdio.h>

enum { PAPER_RUNS = 256, PAPER_GRIDS = 4 };
enum { PAPER_ALONE = 1, PAPER_TOGETHER = 0 }; /* how runs are done: one at a time, to be timed, or one a processor */

struct paper {
    bool full, keep;
    double scale; /* of the grids: 1; smaller for a quick look */
    struct run runs[PAPER_RUNS];
    int count, done; /* runs[done .. count-1] wait for paper_do */
    int failures;
    const char *heading; /* the last one */
    FILE *markdown;
    struct json_writer json;
};

extern const char *const paper_folder; /* build/paper */
extern const char *const paper_sets[2], *const paper_set_names[2]; /* "paper", "default" and how tables call them */

/* ---- runs ---- */

/* A grid of the paper, scaled, a multiple of 4. */
int paper_grid(const struct paper *paper, int grid);

/* The number of a run in the list: of before when it has been asked for already, else new, to be done by paper_do.
   `extra` is a word without blanks for the name and more options ("" for none); threads 0 = all. */
int paper_leveque(struct paper *paper, int grid, double period, const char *set, const char *name, const char *extra,
                  int threads);
int paper_zalesak(struct paper *paper, int grid, const char *set, int threads);
int paper_turns(struct paper *paper, int grid, int turns, const char *set);
void paper_do(struct paper *paper, const char *label, int at_once); /* PAPER_ALONE or PAPER_TOGETHER */
void paper_path(char path[200], const char *name); /* build/paper/NAME */

/* ---- report: to the terminal and to paper.md; tables to paper.json, too ---- */

void paper_heading(struct paper *paper, const char *text);
void paper_say(struct paper *paper, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void paper_table(struct paper *paper, const struct table *table);
struct plot_series paper_line(const char *label, const double *x, const double *y, int count, int style);
struct plot_series paper_marked_line(const char *label, const double *x, const double *y, int count, int style);
/* Writes build/paper/NAME, mentions it with its caption, frees the picture. */
void paper_picture(struct paper *paper, struct image *image, const char *name, const char *caption);
/* Two or more pictures side by side as one; frees them. */
void paper_strip(struct paper *paper, struct image *images, int count, int columns, const char *name, const char *caption);

/* ---- parts ---- */

void paper_table3(struct paper *paper);
void paper_table4(struct paper *paper);
void paper_table5(struct paper *paper);
void paper_fig8(struct paper *paper);
void paper_fig11(struct paper *paper); /* and 12 */
void paper_fig13(struct paper *paper);
void paper_fig14(struct paper *paper);
void paper_fig15(struct paper *paper);

#endif
