/* paper_figures.c - Figs. 13, 14 and 15. */
#include "paper.h"

#include <math.h>
#include <string.h>

/* ---- Fig. 13: time per iteration ---- */

enum { GROUPS = 6, GROUP_STAGES = 3, MAX_GRIDS = 5 };
static const char *const group_names[GROUPS] = {"all", "evolve, rebuild, project", "relax", "advect",
                                               "contract, resample", "fill gaps, track"};
/* The paper has no "project", which finishes what evolve and rebuild leave. */
static const char *const group_stages[GROUPS][GROUP_STAGES] = {
    {"seconds", "", ""}, {"evolve", "rebuild", "project"}, {"relax", "", ""}, {"advect", "", ""},
    {"contract", "resample", ""}, {"fill_gaps", "track", ""}};

/* Seconds of one group in all steps; group 0 is everything. */
static double group_seconds(const struct run *run, int group)
{
    double seconds = group == 0 ? run_number(run, "seconds_total") : 0.0;
    for (int i = 0; i < GROUP_STAGES && group > 0; ++i) {
        char key[60];
        snprintf(key, sizeof key, "seconds_stage.%s", group_stages[group][i]);
        seconds += group_stages[group][i][0] ? run_number(run, key) : 0.0;
    }
    return seconds;
}

static double share(const struct run *run, int group) { return group_seconds(run, group) / group_seconds(run, 0); }

static double step_seconds(const struct run *run) { return group_seconds(run, 0) / run_number(run, "steps"); }

/* The sum over rows of a run's series. */
static double seconds_of_rows(const struct csv *csv, int from, int to, int group)
{
    double seconds = 0.0;
    for (int i = 0; i < GROUP_STAGES; ++i) {
        const int column = csv_column(csv, group_stages[group][i]);
        for (int row = from; row < to && column >= 0; ++row) {
            seconds += csv_at(csv, row, column);
        }
    }
    return seconds;
}

/* steps: of the run, of which a row of the series may have several. */
static bool plot_over_iterations(const char *csv_path, const char *title, double steps, struct image *image)
{
    enum { WINDOWS = 50 };
    static double x[WINDOWS], y[GROUPS][WINDOWS];
    struct plot_series series[GROUPS];
    struct csv csv;
    memset(image, 0, sizeof *image);
    if (!csv_read(csv_path, &csv)) {
        return false;
    }
    const int windows = csv.rows < WINDOWS ? csv.rows : WINDOWS;
    const double mean = seconds_of_rows(&csv, 0, csv.rows, 0) / csv.rows;
    for (int w = 0; w < windows; ++w) { /* means: a resampling step costs more than its neighbours */
        const int from = csv.rows * w / windows, to = csv.rows * (w + 1) / windows;
        x[w] = 0.5 * (from + to) * steps / csv.rows;
        for (int g = 0; g < GROUPS; ++g) {
            y[g][w] = seconds_of_rows(&csv, from, to, g) / (to - from) / mean;
        }
    }
    for (int g = 0; g < GROUPS; ++g) {
        series[g] = paper_line(group_names[g], x, y[g], windows, g);
    }
    const struct plot plot = {.title = title, .x_label = "iteration", .y_label = "time over the mean iteration", .series = series,
                              .series_count = GROUPS, .y_from_zero = true};
    csv_free(&csv);
    return plot_render(&plot, 700, 500, image);
}

/* The paper's time an iteration over that on 128^3, by Table 3: total time over iterations. */
static const double paper_grids[PAPER_GRIDS] = {128, 256, 384, 512};
static const double paper_growth[PAPER_GRIDS] = {1.0, 300.0 / 1000 / (35.0 / 500), 970.0 / 1500 / (35.0 / 500),
                                                 2500.0 / 2000 / (35.0 / 500)};

static const char *const paper_shares[PAPER_GRIDS] = {"76 %", "", "", "82 %"}; /* of level set evolution (section 5.3) */

static bool plot_over_grids(const double *grids, const double *const growth[2], int count, struct image *image)
{
    const struct plot_series series[3] = {paper_marked_line(paper_set_names[0], grids, growth[0], count, 0),
                                          paper_marked_line(paper_set_names[1], grids, growth[1], count, 1),
                                          paper_marked_line("the paper, Table 3", paper_grids, paper_growth, PAPER_GRIDS, 2)};
    const struct plot plot = {.title = "Fig. 13b: time per iteration by grid", .x_label = "grid",
                              .y_label = "over that on 128^3", .log_x = true, .log_y = true, .series = series, .series_count = 3};
    return plot_render(&plot, 700, 500, image);
}

void paper_fig13(struct paper *paper)
{
    enum { REFERENCE = 1 };
    static const int nominal[MAX_GRIDS] = {64, 128, 256, 384, 512};
    static double grids[MAX_GRIDS], growth[2][MAX_GRIDS];
    static struct table table;
    const struct run *runs[2][MAX_GRIDS];
    const int count = paper->full ? MAX_GRIDS : 3;
    int ours[2][MAX_GRIDS];
    struct image images[3];
    for (int i = 0; i < count; ++i) {
        grids[i] = paper_grid(paper, nominal[i]);
        for (int s = 0; s < 2; ++s) {
            ours[s][i] = paper_leveque(paper, (int)grids[i], 2.5, paper_sets[s], "", "");
        }
    }
    paper_do(paper, "Fig. 13");
    table_begin(&table);
    table_row(&table, "Grid, model|Evolve, rebuild, project|Relax|Advect|Contract, resample|Fill gaps, track|Step, over 128^3's");
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            const struct run *run = runs[s][i] = &paper->runs[ours[s][i]];
            growth[s][i] = step_seconds(run) / step_seconds(&paper->runs[ours[s][REFERENCE]]);
            table_row(&table, "%.0f^3, %s|%s|%s|%s|%s|%s|%s", grids[i], paper_set_names[s], cell("%.0f %%", 100.0 * share(run, 1)),
                      cell("%.0f %%", 100.0 * share(run, 2)), cell("%.0f %%", 100.0 * share(run, 3)),
                      cell("%.0f %%", 100.0 * share(run, 4)), cell("%.0f %%", 100.0 * share(run, 5)), cell("%.2f", growth[s][i]));
        }
        for (int g = 0; g < PAPER_GRIDS; ++g) {
            if (paper_grids[g] == grids[i]) {
                table_row(&table, "%.0f^3, the paper|%s|||||%.2f", grids[i], paper_shares[g], paper_growth[g]);
            }
        }
    }
    paper_table(paper, &table);
    for (int s = 0; s < 2; ++s) {
        char title[120], path[PAPER_PATH], name[RUN_NAME + 16];
        snprintf(name, sizeof name, "runs/%s.csv", runs[s][REFERENCE]->name);
        paper_path(path, name);
        snprintf(title, sizeof title, "Fig. 13a: %s parameters, %.0f^3", s == 0 ? "paper's" : "default", grids[REFERENCE]);
        plot_over_iterations(path, title, run_number(runs[s][REFERENCE], "steps"), &images[s]);
    }
    const double *const both[2] = {growth[0], growth[1]};
    plot_over_grids(grids, both, count, &images[2]);
    paper_strip(paper, images, NULL, 3, 3, 1200, "fig13.png",
                "Fig. 13: time per iteration by stage over the iterations, and over the grids");
}

/* ---- Fig. 14: errors against deformation ---- */

static bool plot_errors(const double *x, const double *const errors[4], int count, const char *title, const char *x_label,
                        struct image *image)
{
    static const char *const names[4] = {"deformation, paper's parameters", "tracking, paper's parameters",
                                         "deformation, default parameters", "tracking, default parameters"};
    struct plot_series series[4];
    for (int i = 0; i < 4; ++i) {
        series[i] = paper_marked_line(names[i], x, errors[i], count, i);
    }
    const struct plot plot = {.title = title, .x_label = x_label, .y_label = "mean error, voxels", .log_y = true,
                              .series = series, .series_count = 4};
    return plot_render(&plot, 700, 500, image);
}

enum { MAX_TIMES = 8, MAX_TURNS = 10 };

static void leveque_over_periods(struct paper *paper, struct image *image)
{
    static const double every[MAX_TIMES] = {0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0}, some[5] = {1.0, 1.5, 2.5, 3.0, 3.5};
    static struct table table;
    static double errors[4][MAX_TIMES];
    const double *periods = paper->full ? every : some;
    const int count = paper->full ? MAX_TIMES : 5, grid = paper_grid(paper, 128);
    int ours[2][MAX_TIMES];
    char title[100];
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            ours[s][i] = paper_leveque(paper, grid, periods[i], paper_sets[s], "", "");
        }
    }
    paper_do(paper, "Fig. 14, LeVeque");
    table_begin(&table);
    table_row(&table, "T, model|Deformation|Tracking|Halfway|Volume|Components at the end");
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            const struct run *run = &paper->runs[ours[s][i]];
            errors[2 * s][i] = run_number(run, "deformation_mean");
            errors[2 * s + 1][i] = run_number(run, "tracking_mean");
            table_row(&table, "%g, %s|%s|%s|%s|%s|%s", periods[i], paper_set_names[s], cell("%.4f", errors[2 * s][i]),
                      cell("%.4f", errors[2 * s + 1][i]), run_cell(run, "%.4f", "halfway_mean"),
                      run_cell(run, "%+.3f %%", "volume_change_percent"), run_cell(run, "%.0f", "components"));
        }
    }
    paper_table(paper, &table);
    const double *const all[4] = {errors[0], errors[1], errors[2], errors[3]};
    snprintf(title, sizeof title, "Fig. 14: LeVeque's test, %d^3", grid);
    plot_errors(periods, all, count, title, "T", image);
}

static void zalesak_over_turns(struct paper *paper, struct image *image)
{
    static struct table table;
    static double turns[MAX_TURNS], errors[4][MAX_TURNS], volume[2][MAX_TURNS];
    const int wanted = paper->full ? MAX_TURNS : 3, grid = paper_grid(paper, 128);
    const int ours[2] = {paper_turns(paper, grid, wanted, paper_sets[0]), paper_turns(paper, grid, wanted, paper_sets[1])};
    int count = wanted;
    char title[100];
    paper_do(paper, "Fig. 14, Zalesak");
    for (int s = 0; s < 2; ++s) {
        const struct run *run = &paper->runs[ours[s]];
        for (int i = 0; i < MAX_TURNS; ++i) {
            turns[i] = i + 1.0;
            errors[2 * s][i] = errors[2 * s + 1][i] = volume[s][i] = NAN;
        }
        run_numbers(run, "deformation_mean", errors[2 * s], count);
        run_numbers(run, "tracking_mean", errors[2 * s + 1], count);
        run_numbers(run, "volume_change_percent", volume[s], count);
    }
    table_begin(&table);
    table_row(&table, "Turns, model|Deformation|Tracking|Volume");
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            table_row(&table, "%d, %s|%s|%s|%s", i + 1, paper_set_names[s], cell("%.4f", errors[2 * s][i]),
                      cell("%.4f", errors[2 * s + 1][i]), cell("%+.3f %%", volume[s][i]));
        }
    }
    paper_table(paper, &table);
    const double *const all[4] = {errors[0], errors[1], errors[2], errors[3]};
    snprintf(title, sizeof title, "Fig. 14: Zalesak's test, %d^3", grid);
    plot_errors(turns, all, count, title, "revolutions", image);
}

void paper_fig14(struct paper *paper)
{
    struct image images[2];
    leveque_over_periods(paper, &images[1]);
    paper_say(paper, "\n");
    zalesak_over_turns(paper, &images[0]);
    paper_strip(paper, images, NULL, 2, 2, 1000, "fig14.png",
                "Fig. 14: errors of Zalesak's test after each turn, and of LeVeque's by period");
}

/* ---- Fig. 15: topology preserved ---- */

void paper_fig15(struct paper *paper)
{
    static struct table table;
    const int grid = paper_grid(paper, paper->full ? 256 : 128);
    struct image films[2];
    int ours[2];
    for (int s = 0; s < 2; ++s) {
        char options[240];
        snprintf(options, sizeof options, "--topology preserved --every-step --frames 5 --out %s/fig15_%s_%d", paper_folder,
                 paper_sets[s], grid);
        ours[s] = paper_leveque(paper, grid, 3.0, paper_sets[s], "_preserved", options);
    }
    paper_do(paper, "Fig. 15");
    table_begin(&table);
    table_row(&table, "Grid, model|Components over all steps|Euler number over all steps|Deformation|Tracking|Volume");
    for (int s = 0; s < 2; ++s) {
        const struct run *run = &paper->runs[ours[s]];
        const bool kept = run_number(run, "components_least") == 1.0 && run_number(run, "components_most") == 1.0
                          && run_number(run, "euler_least") == 2.0 && run_number(run, "euler_most") == 2.0;
        table_row(&table, "%d^3, %s|%s|%s|%s|%s|%s", grid, paper_set_names[s],
                  cell2("%.0f to %.0f", run_number(run, "components_least"), run_number(run, "components_most")),
                  cell2("%.0f to %.0f", run_number(run, "euler_least"), run_number(run, "euler_most")),
                  paper_error(run, "deformation"), paper_error(run, "tracking"),
                  run_cell(run, "%+.3f %%", "volume_change_percent"));
        if (!kept) {
            fprintf(stderr, "Fig. 15: topology was not kept (%s)\n", run->name);
            ++paper->failures;
        }
        char path[PAPER_PATH], name[60];
        snprintf(name, sizeof name, "fig15_%s_%d/leveque.png", paper_sets[s], grid);
        paper_path(path, name);
        image_read_file(path, &films[s]);
    }
    paper_table(paper, &table);
    paper_strip(paper, films, paper_set_names, 2, 1, 760, "fig15.png",
                "Fig. 15: LeVeque's test with its topology preserved, T = 3");
}
