/* paper - the paper's tables and figures from runs of the programs, beside the paper's own numbers: docs/results.md.
 *
 *   make paper                         everything, on grids that a small computer can afford
 *   make paper FULL=1                  larger grids as well: see PAPER=help
 *   make paper PAPER="table3 fig14"    some parts; the page keeps its sections of the others
 *   make paper PAPER=stale             those whose section is older than the library
 *   make paper PAPER=page              the page alone, after a change of its text (tests/bench/paper_page.md)
 *   make paper PAPER=help              the parts, and how long each takes
 *   make paper KEEP=1                  takes results of before where program and command are the same
 *   make paper JOBS=1                  one run at a time; without: one a processor
 *   build/bench/paper --scale 0.5      every grid half as large; the page goes into build/paper
 *
 * Each part writes its fragment of the page, build/paper/PART.md, and its pictures; build/paper/runs has what every run said. */
#include "paper.h"
#include "paper_page.h"

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

void paper_path(char path[PAPER_PATH], const char *name)
{
    snprintf(path, PAPER_PATH, "%s/%s", paper_folder, name);
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

int paper_run(struct paper *paper, const char *name, const char *command)
{
    bool is_new;
    struct run *run = find_run(paper, name, &is_new);
    if (is_new) {
        run_command(run, "%s", command);
    }
    return (int)(run - paper->runs);
}

int paper_leveque(struct paper *paper, int grid, double period, const char *set, const char *name, const char *extra)
{
    char full_name[RUN_NAME];
    bool is_new;
    snprintf(full_name, sizeof full_name, "leveque_%d_%g_%s%s", grid, period, set, name);
    struct run *run = find_run(paper, full_name, &is_new);
    if (is_new) {
        run_command(run, "build/leveque --grid %d --period %g --params %s --threads 1", grid, period, set);
        run_add(run, "--processor-time --quiet --json - --series %s/runs/%s.csv %s", paper_folder, full_name, extra);
    }
    return (int)(run - paper->runs);
}

int paper_zalesak(struct paper *paper, int grid, const char *set, const char *name, const char *extra)
{
    char full_name[RUN_NAME];
    bool is_new;
    snprintf(full_name, sizeof full_name, "zalesak_%d_%s%s", grid, set, name);
    struct run *run = find_run(paper, full_name, &is_new);
    if (is_new) {
        run_command(run, "build/zalesak --grid %d --params %s --threads 1 --quiet --json - %s", grid, set, extra);
    }
    return (int)(run - paper->runs);
}

int paper_turns(struct paper *paper, int grid, int turns, const char *set)
{
    char name[RUN_NAME], command[RUN_NAME];
    snprintf(name, sizeof name, "turns_%d_%d_%s", grid, turns, set);
    snprintf(command, sizeof command, "build/bench/turns %d %d %s 1", grid, turns, set);
    return paper_run(paper, name, command);
}

void paper_do(struct paper *paper, const char *label)
{
    char folder[PAPER_PATH];
    paper_path(folder, "runs");
    const struct run_options options = {.folder = folder, .label = label, .at_once = paper->jobs, .keep = paper->keep};
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
    vfprintf(paper->fragment, format, arguments);
    va_end(arguments);
    fflush(stdout);
}

void paper_table(struct paper *paper, const struct table *table)
{
    table_print(table, stdout);
    table_print(table, paper->fragment);
    fflush(stdout);
}

const char *paper_error(const struct run *run, const char *name)
{
    char mean[40], std[40];
    snprintf(mean, sizeof mean, "%s_mean", name);
    snprintf(std, sizeof std, "%s_std", name);
    return cell2("%.3f +- %.3f", run_number(run, mean), run_number(run, std));
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

void paper_picture(struct paper *paper, struct image *image, int width, const char *name, const char *caption)
{
    char folder[PAPER_PATH], path[PAPER_PATH + RUN_NAME];
    snprintf(folder, sizeof folder, "%s/pictures", paper->docs);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    if (image->rgb && make_folder(folder) && image_shrink(image, width) && image_write_small_png(image, 96, path)) {
        paper_say(paper, "\n![%s](pictures/%s)\n", caption, name);
        printf("-> %s\n", path);
    } else {
        fprintf(stderr, "paper: cannot draw %s\n", path);
        ++paper->failures;
    }
    image_free(image);
}

void paper_strip(struct paper *paper, struct image *images, const char *const *labels, int count, int columns, int width,
                 const char *name, const char *caption)
{
    struct image strip;
    memset(&strip, 0, sizeof strip);
    image_strip(images, labels, count, columns, color_rgb(1.0f, 1.0f, 1.0f), &strip);
    for (int i = 0; i < count; ++i) {
        image_free(&images[i]);
    }
    paper_picture(paper, &strip, width, name, caption);
}

/* ---- parts ---- */

struct part {
    const char *name, *about;
    const char *minutes, *full; /* of one processor of 2020; what FULL=1 adds */
    void (*act)(struct paper *paper);
};

static const struct part parts[] = {
    {"tests", "the two tests with both sets", "1", NULL, paper_tests},
    {"table3", "LeVeque's test, T = 2.5: 128^3, 256^3", "4", "384^3 and 512^3: 60 minutes", paper_table3},
    {"table4", "Zalesak's test; OpenVDB where it is installed", "3", NULL, paper_table4},
    {"table5", "LeVeque's test, T = 1.6: 100^3, 200^3", "1", NULL, paper_table5},
    {"table6", "segmentation of the packaged head; of a pelvis in CT, too, where SPRINGLS_DATA is set", "6", NULL, paper_table6},
    {"fig1", "the imaging pipeline (on table6's runs)", "0", NULL, paper_fig1},
    {"fig3", "one model by volumetric ray casting, 120^3", "1", NULL, paper_fig3},
    {"fig6", "physical and normalized torque", "0", NULL, paper_fig6},
    {"fig8", "threshold and weight functions", "0", NULL, paper_fig8},
    {"fig9", "film of Zalesak's test, 128^3", "1", "256^3: 10 minutes", paper_fig9},
    {"fig10", "film of LeVeque's test, 128^3", "1", "256^3: 2 minutes", paper_fig10},
    {"fig11", "choice of parameters, with Fig. 12: 160 runs", "4", "128^3 and T = 2.5: 40 minutes", paper_fig11},
    {"fig13", "time per iteration: 64^3 to 256^3", "4", "384^3 and 512^3: 60 minutes", paper_fig13},
    {"fig14", "errors against deformation and turns", "3", "more periods, ten turns: 12 minutes", paper_fig14},
    {"fig15", "topology preserved, 128^3", "2", "256^3: 30 minutes", paper_fig15},
    {"fig16", "segmentation from a cube and a torus (on table6's runs)", "0", NULL, paper_fig16},
    {"fig17", "atlas, with Fig. 18 (on table6's runs)", "0", NULL, paper_fig17},
    {"fig19", "tracking, with Fig. 20 (on table6's runs)", "0", NULL, paper_fig19},
    {"fig21", "morphing", "1", NULL, paper_fig21},
};
enum { PART_COUNT = (int)(sizeof parts / sizeof *parts) };

static void print_help(void)
{
    printf("make paper writes docs/results.md and docs/pictures. PAPER=\"part part\" runs some parts; the page keeps its\n"
           "sections of the others. PAPER=stale: those whose section is older than the library. PAPER=page: none, the page's text\n"
           "alone. KEEP=1 takes results of before where program and command are the same. JOBS=1: one run at a time.\n"
           "Minutes of one processor of about 2020; parts share runs.\n\n");
    for (int p = 0; p < PART_COUNT; ++p) {
        printf("  %-11s %3s min  %s%s%s\n", parts[p].name, parts[p].minutes, parts[p].about, parts[p].full ? "; FULL=1: " : "",
               parts[p].full ? parts[p].full : "");
    }
}

/* Writes one part's fragment; false: one of its runs or pictures failed, or the file cannot be written. */
static bool run_part(struct paper *paper, const struct part *part, const char *stamp)
{
    char name[64], path[PAPER_PATH], unfinished[PAPER_PATH + 8];
    const int before = paper->failures;
    const double start = elapsed_seconds();
    snprintf(name, sizeof name, "%s.md", part->name);
    paper_path(path, name);
    snprintf(unfinished, sizeof unfinished, "%s.new", path);
    paper->fragment = fopen(unfinished, "w");
    if (!paper->fragment) {
        fprintf(stderr, "paper: cannot write %s\n", unfinished);
        return false;
    }
    fprintf(stderr, "%s ...\n", part->name);
    printf("\n");
    paper_section_begin(paper->fragment, part->name, stamp);
    part->act(paper);
    paper_section_end(paper->fragment, part->name);
    fprintf(stderr, "%s took %.0f s\n", part->name, elapsed_seconds() - start);
    return fclose(paper->fragment) == 0 && paper->failures == before && rename(unfinished, path) == 0;
}

/* ---- the page ---- */

struct page_source {
    const char *old; /* the page of before, or NULL */
    const char *stamp;
};

static char *copy_section(const char *page, const char *name)
{
    const char *section;
    const size_t length = page ? paper_section_find(page, name, &section) : 0;
    char *copy = length > 0 ? malloc(length + 1) : NULL;
    if (copy) {
        memcpy(copy, section, length);
        copy[length] = '\0';
    }
    return copy;
}

/* A part's fragment, if the library is still as it was; else the page's own section. */
static char *section_of(void *user, const char *name)
{
    const struct page_source *source = user;
    char file[64], path[PAPER_PATH], stamp[PAPER_STAMP];
    snprintf(file, sizeof file, "%s.md", name);
    paper_path(path, file);
    char *fragment = read_whole_file(path);
    if (fragment && paper_section_stamp(fragment, stamp) && strcmp(stamp, source->stamp) == 0) {
        return fragment;
    }
    free(fragment);
    return copy_section(source->old, name);
}

static bool write_page(const struct paper *paper, const char *stamp)
{
    char path[PAPER_PATH];
    snprintf(path, sizeof path, "%s/results.md", paper->docs);
    char *text = read_whole_file("tests/bench/paper_page.md"), *old = read_whole_file(path);
    struct page_source source = {old, stamp};
    char *page = text ? paper_page(text, section_of, &source) : NULL;
    FILE *file = page ? fopen(path, "w") : NULL;
    bool good = file && fputs(page, file) >= 0;
    good = file && fclose(file) == 0 && good;
    free(text);
    free(old);
    free(page);
    if (good) {
        printf("\nsee %s\n", path);
    }
    return good;
}

/* ---- the command line ---- */

/* Asks for the parts whose section of docs/results.md is missing or has another stamp. */
static void want_stale(const char *stamp, bool wanted[PART_COUNT])
{
    char *page = read_whole_file("docs/results.md"), old[PAPER_STAMP];
    for (int p = 0; p < PART_COUNT; ++p) {
        const char *section;
        const bool found = page && paper_section_find(page, parts[p].name, &section) > 0 && paper_section_stamp(section, old);
        wanted[p] = wanted[p] || !found || strcmp(old, stamp) != 0;
    }
    free(page);
}

/* False after one line on stderr. */
static bool read_words(struct paper *paper, int argc, char **argv, const char *stamp, bool wanted[PART_COUNT])
{
    bool any = false;
    for (int i = 1; i < argc; ++i) {
        bool known = false;
        if (strcmp(argv[i], "--full") == 0) {
            paper->full = known = true;
        } else if (strcmp(argv[i], "--keep") == 0) {
            paper->keep = known = true;
        } else if (strcmp(argv[i], "page") == 0) {
            any = known = true;
        } else if (strcmp(argv[i], "stale") == 0) {
            want_stale(stamp, wanted);
            any = known = true;
        } else if (strcmp(argv[i], "--jobs") == 0 && i + 1 < argc) {
            paper->jobs = atoi(argv[++i]);
            known = paper->jobs > 0;
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
            fprintf(stderr, "paper: what is '%s'? help shows what there is\n", argv[i]);
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
    char stamp[PAPER_STAMP];
    paper.scale = 1.0;
    if (argc > 1 && strcmp(argv[1], "help") == 0) {
        print_help();
        return 0;
    }
    paper_stamp(stamp);
    if (!read_words(&paper, argc, argv, stamp, wanted)) {
        return 2;
    }
    paper.docs = paper.scale == 1.0 ? "docs" : paper_folder;
    if (paper.scale != 1.0) { /* its fragments are for no other page */
        snprintf(stamp + strlen(stamp), sizeof stamp - strlen(stamp), ", scale %g", paper.scale);
    }
    if (!make_folder(paper_folder)) {
        fprintf(stderr, "paper: cannot make %s\n", paper_folder);
        return 1;
    }
    for (int p = 0; p < PART_COUNT; ++p) {
        if (wanted[p] && !run_part(&paper, &parts[p], stamp)) {
            fprintf(stderr, "paper: %s failed; the page keeps its section of before\n", parts[p].name);
        }
    }
    if (!write_page(&paper, stamp)) {
        fprintf(stderr, "paper: cannot write %s/results.md\n", paper.docs);
        ++paper.failures;
    }
    if (paper.failures) {
        fprintf(stderr, "paper: %d failures\n", paper.failures);
    }
    runs_free(paper.runs, paper.count);
    return paper.failures > 0;
}
