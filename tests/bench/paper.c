/* paper - the paper's tables and figures from runs of the example programs, beside the paper's own numbers.
 *
 *   make paper                         everything, on grids that a small computer can afford
 *   make paper FULL=1                  384^3 and 512^3 as well, and the parameter sweep at 128^3
 *   make paper PAPER="table3 fig14"    some parts
 *   make paper KEEP=1                  takes results of before where program and command are the same
 *   build/bench/paper --scale 0.5      every grid half as large
 *
 * Writes build/paper/paper.md, paper.json and pictures; build/paper/runs has what every run said. */
#include "paper.h"

#include "examples/common/base/progress.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

const char *const paper_folder = "build/paper";
const char *const paper_sets[2] = {"paper", "default"};
const char *const paper_set_names[2] = {"springls, paper's parameters", "springls, default parameters"};

/* ---- runs ---- */

int paper_grid(const struct paper *paper, int grid)
{
    return 4 * (int)fmax(4.0, floor(0.25 * grid * paper->scale + 0.5));
}

void paper_path(char path[200], const char *name)
{
    snprintf(path, 200, "%s/%s", paper_folder, name);
}

/* The run that has this name, or room for a new one. */
static struct run *find_run(struct paper *paper, const char *name, bool *is_new)
{
    for (int i = 0; i < paper->count; ++i) {
        if (strcmp(paper->runs[i].name, name) == 0) {
            *is_new = false;
            return &paper->runs[i];
        }
    }
    if (paper->count == PAPER_RUNS) {
        fprintf(stderr, "paper: more than %d runs\n", (int)PAPER_RUNS);
        exit(1);
    }
    struct run *run = &paper->runs[paper->count++];
    run_name(run, "%s", name);
    *is_new = true;
    return run;
}

int paper_leveque(struct paper *paper, int grid, double period, const char *set, const char *name, const char *extra,
                  int threads)
{
    char full_name[RUN_NAME];
    bool is_new;
    snprintf(full_name, sizeof full_name, "leveque_%d_%g_%s%s", grid, period, set, name);
    struct run *run = find_run(paper, full_name, &is_new);
    if (is_new) {
        run_command(run, "build/leveque --grid %d --period %g --params %s --threads %d --quiet --json -", grid, period, set,
                    threads);
        run_add(run, "--series %s/runs/%s.csv", paper_folder, full_name);
        if (extra[0]) {
            run_add(run, "%s", extra);
        }
    }
    return (int)(run - paper->runs);
}

int paper_zalesak(struct paper *paper, int grid, const char *set, int threads)
{
    char name[RUN_NAME];
    bool is_new;
    snprintf(name, sizeof name, "zalesak_%d_%s", grid, set);
    struct run *run = find_run(paper, name, &is_new);
    if (is_new) {
        run_command(run, "build/zalesak --grid %d --params %s --threads %d --quiet --json -", grid, set, threads);
    }
    return (int)(run - paper->runs);
}

int paper_turns(struct paper *paper, int grid, int turns, const char *set)
{
    char name[RUN_NAME];
    bool is_new;
    snprintf(name, sizeof name, "turns_%d_%d_%s", grid, turns, set);
    struct run *run = find_run(paper, name, &is_new);
    if (is_new) {
        run_command(run, "build/bench/turns %d %d %s 1", grid, turns, set);
    }
    return (int)(run - paper->runs);
}

void paper_do(struct paper *paper, const char *label, int at_once)
{
    char folder[200];
    paper_path(folder, "runs");
    const struct run_options options = {.folder = folder, .label = label, .at_once = at_once, .keep = paper->keep};
    paper->failures += runs_do(paper->runs + paper->done, paper->count - paper->done, &options);
    paper->done = paper->count;
}

/* ---- report ---- */

void paper_say(struct paper *paper, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    va_start(arguments, format);
    vfprintf(paper->markdown, format, arguments);
    va_end(arguments);
    fflush(stdout);
    fflush(paper->markdown);
}

void paper_heading(struct paper *paper, const char *text)
{
    paper->heading = text;
    paper_say(paper, "\n## %s\n\n", text);
}

void paper_table(struct paper *paper, const struct table *table)
{
    table_print(table, stdout);
    table_print(table, paper->markdown);
    paper_say(paper, "\n");
    table_json(table, &paper->json, paper->heading);
}

struct plot_series paper_line(const char *label, const double *x, const double *y, int count, int style)
{
    const struct plot_series series = {.label = label, .x = x, .y = y, .count = (size_t)count, .style = style};
    return series;
}

struct plot_series paper_marked_line(const char *label, const double *x, const double *y, int count, int style)
{
    struct plot_series series = paper_line(label, x, y, count, style);
    series.marks = true;
    return series;
}

void paper_picture(struct paper *paper, struct image *image, const char *name, const char *caption)
{
    char path[200];
    paper_path(path, name);
    if (image->rgb && image_write_png(image, path)) {
        printf("%s\n-> %s\n", caption, path);
        fflush(stdout);
        fprintf(paper->markdown, "\n![%s](%s)\n\n%s\n", name, name, caption);
    } else {
        fprintf(stderr, "paper: cannot draw %s\n", path);
        ++paper->failures;
    }
    image_free(image);
}

void paper_strip(struct paper *paper, struct image *images, int count, int columns, const char *name, const char *caption)
{
    struct image strip;
    memset(&strip, 0, sizeof strip);
    image_strip(images, NULL, count, columns, color_rgb(1.0f, 1.0f, 1.0f), &strip);
    for (int i = 0; i < count; ++i) {
        image_free(&images[i]);
    }
    paper_picture(paper, &strip, name, caption);
}

/* The header's own chapter: it cannot go stale. */
static void say_deviations(struct paper *paper)
{
    char *text = read_whole_file("springls.h");
    const char *from = text ? strstr(text, "   DEVIATIONS of") : NULL, *to = from ? strstr(from, "\n\n\n") : NULL;
    paper_heading(paper, "Deviations of the paper's parameter set from the paper's text");
    for (const char *line = from ? strchr(from, '\n') : NULL; line && line < to; line = strchr(line + 1, '\n')) {
        const char *begin = line + 1 + strspn(line + 1, " ");
        const bool is_first = strncmp(begin, "- ", 2) == 0 || *begin == '\n';
        paper_say(paper, "%s%.*s\n", is_first ? "" : "  ", (int)strcspn(begin, "\n"), begin);
    }
    if (!to) {
        paper_say(paper, "springls.h has no such chapter.\n");
        ++paper->failures;
    }
    free(text);
    paper_say(paper, "\nThe paper leaves open, and we chose: Zalesak's body has the proportions of Enright et al. 2002 (radius 0.15,\n"
                     "slot 0.05 wide and 0.125 deep); LeVeque's test takes T N / 0.64 steps, which gives the paper's counts of\n"
                     "iterations; volume is that of the welded zero level; `half_time_sampling` repeats the author's program, whose\n"
                     "Runge-Kutta stages sample half a step of the reversing flow, so that even exact particles do not return.\n");
}

/* Tables go to paper.json as they are made, runs at the end. */
static bool begin_json(struct paper *paper)
{
    char path[200];
    paper_path(path, "paper.json");
    if (!json_open(&paper->json, path)) {
        return false;
    }
    json_object_begin(&paper->json, NULL);
    json_number(&paper->json, "scale", paper->scale);
    json_bool(&paper->json, "full", paper->full);
    json_array_begin(&paper->json, "tables");
    return true;
}

static bool end_json(struct paper *paper)
{
    json_array_end(&paper->json);
    runs_json(paper->runs, paper->done, &paper->json);
    return json_close(&paper->json);
}

struct part {
    const char *name;
    void (*act)(struct paper *paper);
};

static const struct part parts[] = {
    {"deviations", say_deviations}, {"table3", paper_table3}, {"table4", paper_table4}, {"table5", paper_table5},
    {"fig8", paper_fig8}, {"fig11", paper_fig11}, {"fig13", paper_fig13}, {"fig14", paper_fig14}, {"fig15", paper_fig15},
};
enum { PART_COUNT = (int)(sizeof parts / sizeof *parts) };

/* False after one line on stderr. */
static bool read_words(struct paper *paper, int argc, char **argv, bool wanted[PART_COUNT])
{
    bool any = false;
    for (int i = 1; i < argc; ++i) {
        bool known = false;
        if (strcmp(argv[i], "--full") == 0) {
            paper->full = known = true;
        } else if (strcmp(argv[i], "--keep") == 0) {
            paper->keep = known = true;
        } else if (strcmp(argv[i], "--scale") == 0 && i + 1 < argc) {
            paper->scale = atof(argv[++i]);
            known = paper->scale > 0.05 && paper->scale <= 4.0;
        }
        for (int p = 0; p < PART_COUNT; ++p) {
            if (strcmp(argv[i], parts[p].name) == 0) {
                wanted[p] = any = known = true;
            }
        }
        if (!known) {
            fprintf(stderr, "paper: what is '%s'? --full, --keep, --scale S, or parts:", argv[i]);
            for (int p = 0; p < PART_COUNT; ++p) {
                fprintf(stderr, " %s", parts[p].name);
            }
            fprintf(stderr, "\n");
            return false;
        }
    }
    for (int p = 0; p < PART_COUNT && !any; ++p) {
        wanted[p] = true;
    }
    return true;
}

int main(int argc, char **argv)
{
    static struct paper paper;
    bool wanted[PART_COUNT] = {false};
    char path[200];
    paper.scale = 1.0;
    if (!read_words(&paper, argc, argv, wanted)) {
        return 2;
    }
    paper_path(path, "paper.md");
    if (!make_folder(paper_folder) || !(paper.markdown = fopen(path, "w"))) {
        fprintf(stderr, "paper: cannot write %s\n", path);
        return 1;
    }
    if (!begin_json(&paper)) {
        fprintf(stderr, "paper: cannot write %s/paper.json\n", paper_folder);
        return 1;
    }
    const double start = elapsed_seconds();
    paper_say(&paper, "# Spring Level Sets: the paper's results and ours\n\n"
                      "Lengths are voxels; errors are means +- deviations over all springls at the end. deformation: distance from\n"
                      "the exact shape; tracking: distance from the place of origin; at half time: tracking at t = T/2, by carrying\n"
                      "the place of origin there with the exact flow, which gives no credit for errors that the reversed flow takes\n"
                      "back. The paper ran on 8 cores (two Xeon E5630) through OpenCL; our rows say how many threads they had.\n");
    for (int p = 0; p < PART_COUNT; ++p) {
        if (wanted[p]) {
            const double before = elapsed_seconds();
            fprintf(stderr, "%s ...\n", parts[p].name);
            parts[p].act(&paper);
            fprintf(stderr, "%s took %.0f s\n", parts[p].name, elapsed_seconds() - before);
        }
    }
    if (!end_json(&paper)) {
        fprintf(stderr, "paper: cannot write paper.json\n");
        ++paper.failures;
    }
    printf("\n%.0f s in all; see %s/paper.md and paper.json\n", elapsed_seconds() - start, paper_folder);
    if (fclose(paper.markdown) != 0) {
        ++paper.failures;
    }
    if (paper.failures) {
        fprintf(stderr, "paper: %d failures\n", paper.failures);
    }
    runs_free(paper.runs, paper.count);
    return paper.failures > 0;
}
