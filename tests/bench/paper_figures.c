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

/* Milliseconds a step of one group; group 0 is everything. */
static double group_time(const struct run *run, int group)
{
    double seconds = group == 0 ? run_number(run, "seconds_total") : 0.0;
    for (int i = 0; i < GROUP_STAGES && group > 0; ++i) {
        char key[60];
        snprintf(key, sizeof key, "seconds_stage.%s", group_stages[group][i]);
        seconds += group_stages[group][i][0] ? run_number(run, key) : 0.0;
    }
    return 1000.0 * seconds / run_number(run, "steps");
}

/* The mean over rows of a run's series. */
static double group_time_of_rows(const struct csv *csv, int from, int to, int group)
{
    double seconds = 0.0;
    for (int i = 0; i < GROUP_STAGES; ++i) {
        const int column = csv_column(csv, group_stages[group][i]);
        for (int row = from; row < to && column >= 0; ++row) {
            seconds += csv_at(csv, row, column);
        }
    }
    return 1000.0 * seconds / (to - from);
}

static bool plot_over_iterations(const char *csv_path, const char *title, struct image *image)
{
    enum { WINDOWS = 50 };
    static double x[WINDOWS], y[GROUPS][WINDOWS];
    struct plot_series series[GROUPS];
    struct csv csv;
    memset(image, 0, sizeof *image);
    if (!csv_read(csv_path, &csv) || csv.rows < WINDOWS) {
        csv_free(&csv);
        return false;
    }
    for (int w = 0; w < WINDOWS; ++w) { /* means: a resampling step costs more than its neighbours */
        const int from = csv.rows * w / WINDOWS, to = csv.rows * (w + 1) / WINDOWS;
        x[w] = 0.5 * (from + to);
        for (int g = 0; g < GROUPS; ++g) {
            y[g][w] = group_time_of_rows(&csv, from, to, g);
        }
    }
    for (int g = 0; g < GROUPS; ++g) {
        series[g] = paper_line(group_names[g], x, y[g], WINDOWS, g);
    }
    const struct plot plot = {.title = title, .x_label = "iteration", .y_label = "ms per iteration", .series = series,
                              .series_count = GROUPS, .y_from_zero = true};
    csv_free(&csv);
    return plot_render(&plot, 700, 500, image);
}

static bool plot_over_grids(const struct run *const *runs, const int *grids, int count, const char *title,
                            struct image *image)
{
    static double x[MAX_GRIDS], y[GROUPS][MAX_GRIDS];
    /* Table 3: total time over iterations. */
    static const double paper_x[PAPER_GRIDS] = {128, 256, 384, 512};
    static const double paper_y[PAPER_GRIDS] = {35e3 / 500, 300e3 / 1000, 970e3 / 1500, 2500e3 / 2000};
    struct plot_series series[GROUPS + 1];
    for (int g = 0; g < GROUPS; ++g) {
        for (int i = 0; i < count; ++i) {
            x[i] = grids[i];
            y[g][i] = group_time(runs[i], g);
        }
        series[g] = paper_marked_line(group_names[g], x, y[g], count, g);
    }
    series[GROUPS] = paper_marked_line("paper, all, 8 cores", paper_x, paper_y, PAPER_GRIDS, GROUPS);
    const struct plot plot = {.title = title, .x_label = "grid", .y_label = "ms per iteration", .log_x = true, .log_y = true,
                              .series = series, .series_count = GROUPS + 1};
    return plot_render(&plot, 700, 500, image);
}

void paper_fig13(struct paper *paper)
{
    static const int nominal[MAX_GRIDS] = {64, 128, 256, 384, 512};
    static struct table table;
    const struct run *runs[2][MAX_GRIDS];
    const int count = paper->full ? 5 : 3;
    int grids[MAX_GRIDS], ours[2][MAX_GRIDS];
    struct image images[4];
    for (int i = 0; i < count; ++i) {
        grids[i] = paper_grid(paper, nominal[i]);
        for (int s = 0; s < 2; ++s) {
            ours[s][i] = paper_leveque(paper, grids[i], 2.5, paper_sets[s], "", "", 0);
        }
    }
    paper_do(paper, "Fig. 13", PAPER_ALONE);
    paper_heading(paper, "Fig. 13: computation time per iteration, LeVeque's test, T = 2.5");
    table_begin(&table);
    table_row(&table, "grid|model|all|evolve, rebuild|relax|advect|contract, resample|fill gaps, track|"
                      "share of evolve, rebuild|threads");
    for (int s = 0; s < 2; ++s) {
        for (int i = 0; i < count; ++i) {
            const struct run *run = runs[s][i] = &paper->runs[ours[s][i]];
            table_row(&table, "%d^3|%s|%s|%s|%s|%s|%s|%s|%s|%s", grids[i], paper_set_names[s],
                      cell("%.1f ms", group_time(run, 0)), cell("%.1f ms", group_time(run, 1)),
                      cell("%.1f ms", group_time(run, 2)), cell("%.2f ms", group_time(run, 3)),
                      cell("%.2f ms", group_time(run, 4)), cell("%.2f ms", group_time(run, 5)),
                      cell("%.0f %%", 100.0 * group_time(run, 1) / group_time(run, 0)), run_cell(run, "%.0f", "threads"));
        }
    }
    table_row(&table, "128^3|paper reports|70 ms|-|-|-|-|-|76 %%|8 cores");
    table_row(&table, "256^3|paper reports|300 ms|-|-|-|-|-|-|8 cores");
    table_row(&table, "512^3|paper reports|1250 ms|-|-|-|-|-|82 %%|8 cores");
    paper_table(paper, &table);
    paper_say(paper, "all is the whole step; the stages beside it leave out what happens between them.\n\n");
    for (int s = 0; s < 2; ++s) {
        char title[120], path[200], name[RUN_NAME + 16];
        snprintf(name, sizeof name, "runs/%s.csv", runs[s][1]->name);
        paper_path(path, name);
        snprintf(title, sizeof title, "Fig. 13a: %s parameters, %d^3", s == 0 ? "paper's" : "default", grids[1]);
        plot_over_iterations(path, title, &images[2 * s]);
        snprintf(title, sizeof title, "Fig. 13b: %s parameters", s == 0 ? "paper's" : "default");
        plot_over_grids(runs[s], grids, count, title, &images[2 * s + 1]);
    }
    paper_strip(paper, images, 4, 2, "fig13_time.png",
                "Time per iteration by stage, over the iterations and over the grids.");
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
        for (int s = 0; s < 2; ++s) { /* the one at 2.5 is Table 3's */
            ours[s][i] = paper_leveque(paper, grid, periods[i], paper_sets[s], "", "", periods[i] == 2.5 ? 0 : 1);
        }
    }
    paper_do(paper, "Fig. 14, LeVeque", PAPER_TOGETHER);
    table_begin(&table);
    table_row(&table, "T|model|deformation|tracking|at half time|volume|components at the end");
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            const struct run *run = &paper->runs[ours[s][i]];
            errors[2 * s][i] = run_number(run, "deformation_mean");
            errors[2 * s + 1][i] = run_number(run, "tracking_mean");
            table_row(&table, "%g|%s|%s|%s|%s|%s|%s", periods[i], paper_set_names[s], cell("%.4f", errors[2 * s][i]),
                      cell("%.4f", errors[2 * s + 1][i]), run_cell(run, "%.4f", "halfway_mean"),
                      run_cell(run, "%+.2f %%", "volume_change_percent"), run_cell(run, "%.0f", "components"));
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
    paper_do(paper, "Fig. 14, Zalesak", PAPER_TOGETHER);
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
    table_row(&table, "turns|model|deformation|tracking|volume");
    for (int i = 0; i < count; ++i) {
        for (int s = 0; s < 2; ++s) {
            table_row(&table, "%d|%s|%s|%s|%s", i + 1, paper_set_names[s], cell("%.4f", errors[2 * s][i]),
                      cell("%.4f", errors[2 * s + 1][i]), cell("%+.2f %%", volume[s][i]));
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
    paper_heading(paper, "Fig. 14: errors against deformation and revolutions");
    paper_say(paper, "The paper prints a picture, no numbers; its caption says 128^3, its text 256^3.\n\n");
    leveque_over_periods(paper, &images[1]);
    zalesak_over_turns(paper, &images[0]);
    paper_strip(paper, images, 2, 2, "fig14_errors.png",
                "The paper: errors of Zalesak's test are below a voxel; those of LeVeque's grow with T, steeply from T = 3,\n"
                "where the object tears.");
}

/* ---- Fig. 15: topology preserved ---- */

void paper_fig15(struct paper *paper)
{
    static struct table table;
    const int grid = paper_grid(paper, paper->full ? 256 : 128);
    int ours[2];
    for (int s = 0; s < 2; ++s) {
        char options[240];
        snprintf(options, sizeof options, "--topology preserved --every-step --frames 5 --out %s/fig15_%s", paper_folder,
                 paper_sets[s]);
        ours[s] = paper_leveque(paper, grid, 3.0, paper_sets[s], "_preserved", options, 1);
    }
    paper_do(paper, "Fig. 15", PAPER_TOGETHER);
    paper_heading(paper, "Fig. 15: LeVeque's test, T = 3, topology preserved");
    table_begin(&table);
    table_row(&table, "grid|model|components, least to most|Euler number, least to most|topology kept at every step|deformation|"
                      "tracking|volume");
    for (int s = 0; s < 2; ++s) {
        const struct run *run = &paper->runs[ours[s]];
        const bool kept = run_number(run, "components_least") == 1.0 && run_number(run, "components_most") == 1.0
                          && run_number(run, "euler_least") == 2.0 && run_number(run, "euler_most") == 2.0;
        table_row(&table, "%d^3|%s|%s|%s|%s|%s|%s|%s", grid, paper_set_names[s],
                  cell2("%.0f to %.0f", run_number(run, "components_least"), run_number(run, "components_most")),
                  cell2("%.0f to %.0f", run_number(run, "euler_least"), run_number(run, "euler_most")), kept ? "yes" : "NO",
                  run_cell(run, "%.4f", "deformation_mean"), run_cell(run, "%.4f", "tracking_mean"),
                  run_cell(run, "%+.2f %%", "volume_change_percent"));
        if (!kept) {
            fprintf(stderr, "Fig. 15: topology was not kept (%s)\n", run->name);
            ++paper->failures;
        }
    }
    paper_table(paper, &table);
    paper_say(paper, "The paper claims that topology is preserved and shows it; it states neither grid nor errors.\n"
                     "Pictures: %s/fig15_paper/leveque.png and %s/fig15_default/leveque.png.\n", paper_folder, paper_folder);
}
