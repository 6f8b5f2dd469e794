/* paper.h - what the parts of the driver of `make paper` share: the list of runs, and the fragments of the page. */
#ifndef BENCH_PAPER_H
#define BENCH_PAPER_H

#include "runs.h"
#include "table.h"

#include "examples/common/pictures/plot.h"

#include <stdio.h>

enum { PAPER_RUNS = 256, PAPER_GRIDS = 4, PAPER_PATH = 300 };

struct paper {
    bool full, keep;
    int jobs;            /* runs at a time; 0 = one a processor */
    double scale;        /* of the grids: 1; smaller for a quick look, which leaves the page of docs/ as it is */
    const char *docs;    /* the folder of the page */
    struct run runs[PAPER_RUNS];
    int count, done;     /* runs[done .. count-1] wait for paper_do */
    int failures;
    FILE *fragment;      /* of the part in progress */
};

extern const char *const paper_folder; /* build/paper */
extern const char *const paper_sets[2], *const paper_set_names[2]; /* "paper", "default" and how tables call them */

/* ---- runs ---- */

/* A grid of the paper, scaled, a multiple of 4. */
int paper_grid(const struct paper *paper, int grid);

/* The number of a run in the list: of before when it has been asked for already, else new, to be done by paper_do.
   `extra` is a word without blanks for the name and more options ("" for none). Every run has one thread. */
int paper_leveque(struct paper *paper, int grid, double period, const char *set, const char *name, const char *extra);
int paper_zalesak(struct paper *paper, int grid, const char *set, const char *name, const char *extra);
int paper_turns(struct paper *paper, int grid, int turns, const char *set);
int paper_run(struct paper *paper, const char *name, const char *command); /* any other */
void paper_do(struct paper *paper, const char *label);
/* Runs the imaging programs on the packaged head (build/bench/imaging), once; false after a failure. */
bool paper_imaging(struct paper *paper);
void paper_path(char path[PAPER_PATH], const char *name); /* build/paper/NAME */

/* ---- report: to the terminal and to the part's fragment ---- */

void paper_say(struct paper *paper, const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void paper_table(struct paper *paper, const struct table *table);
/* mean +- deviation of a run's error, as "tracking". */
const char *paper_error(const struct run *run, const char *name);
struct plot_series paper_line(const char *label, const double *x, const double *y, int count, int style);
struct plot_series paper_marked_line(const char *label, const double *x, const double *y, int count, int style);
/* Writes DOCS/pictures/NAME, at most `width` pixels wide, shows it with its caption, and frees it. */
void paper_picture(struct paper *paper, struct image *image, int width, const char *name, const char *caption);
/* Two or more pictures side by side as one; frees them. labels: one each, or NULL. */
void paper_strip(struct paper *paper, struct image *images, const char *const *labels, int count, int columns, int width,
                 const char *name, const char *caption);

/* ---- parts ---- */

void paper_tests(struct paper *paper);
void paper_table3(struct paper *paper);
void paper_table4(struct paper *paper);
void paper_table5(struct paper *paper);
void paper_table6(struct paper *paper);
void paper_fig1(struct paper *paper);
void paper_fig3(struct paper *paper);
void paper_fig6(struct paper *paper);
void paper_fig8(struct paper *paper);
void paper_fig9(struct paper *paper);
void paper_fig10(struct paper *paper);
void paper_fig11(struct paper *paper); /* and 12 */
void paper_fig13(struct paper *paper);
void paper_fig14(struct paper *paper);
void paper_fig15(struct paper *paper);
void paper_fig16(struct paper *paper);
void paper_fig17(struct paper *paper); /* and 18 */
void paper_fig19(struct paper *paper); /* and 20 */
void paper_fig21(struct paper *paper);

#endif
