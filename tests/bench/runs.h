/* runs.h - starts programs, a few at a time, and reads the JSON object that each writes to its standard output.

   A run called NAME leaves three files in a folder: NAME.json (standard output), NAME.log (standard error) and
   NAME.command. */
#ifndef BENCH_RUNS_H
#define BENCH_RUNS_H

#include "examples/common/base/json.h"

#include <stdbool.h>
#include <stddef.h>

enum { RUN_NAME = 80, RUN_COMMAND = 4096 };

struct run {
    char name[RUN_NAME];
    char command[RUN_COMMAND]; /* words between blanks, as a shell has them: \ before a blank makes it part of a word */
    char *json;                /* NULL when it failed */
    int exit_status;           /* -1: killed */
    double wall, cpu;          /* seconds from start to end, and of processor time; 0 when an earlier result was kept */
};

struct run_options {
    const char *folder; /* made if need be, with its parents */
    const char *label;  /* for the progress lines on stderr; NULL = no such lines */
    int at_once;        /* how many may run together: 1 while timing; 0 = one a processor */
    bool keep;          /* take NAME.json of before when the command is the same and the program older than it */
};

/* Name and command by printf. */
void run_name(struct run *run, const char *format, ...);
void run_command(struct run *run, const char *format, ...);
void run_add(struct run *run, const char *format, ...); /* a blank and more words */
/* Text that may hold blanks, as one word of a command; returns `word`. */
const char *run_word(const char *text, char *word, size_t size);

/* Does them all; the number of failures. A failure is printed on stderr with the name of its log. */
int runs_do(struct run *runs, int count, const struct run_options *options);
void runs_free(struct run *runs, int count);
/* The member "runs" of the object that is open: what each said, by its name; null when it failed. */
void runs_json(const struct run *runs, int count, struct json_writer *json);

/* A number of the object, or of an object in it ("seconds_stage.relax"). NAN: there is none. */
double run_number(const struct run *run, const char *key);
int run_numbers(const struct run *run, const char *key, double *values, int most); /* an array; how many there are */
bool run_text(const struct run *run, const char *key, char *text, size_t size); /* "" and false: there is none */

bool make_folder(const char *path); /* with its parents */
char *read_whole_file(const char *path); /* NULL: cannot; the caller frees it */

/* A table of numbers with a line of names on top; columns are found by name. */
struct csv {
    int rows, columns;
    char names[40][40];
    double *values; /* rows * columns; what is no number is NAN */
};
bool csv_read(const char *path, struct csv *csv);
int csv_column(const struct csv *csv, const char *name); /* -1: none */
double csv_at(const struct csv *csv, int row, int column); /* NAN: column -1 */
void csv_free(struct csv *csv);

#endif
