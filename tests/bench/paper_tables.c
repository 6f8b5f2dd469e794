/* paper_tables.c - the two tests with both sets, Tables 3, 4 and 5, and the volume changes of section 5.3. */
#include "paper.h"

#include <math.h>
#include <unistd.h>

/* What the paper reports of a run; NAN where it has no figure. */
struct reported {
    int grid;
    double springls, deformation, deformation_std, tracking, tracking_std, volume, steps;
};

/* Table 3; volume changes from section 5.3. */
static const struct reported table3[PAPER_GRIDS] = {
    {128, 5e3, 0.38, 0.28, 0.93, 1.07, 4.6, 500},
    {256, 19e3, 0.34, 0.31, 0.92, 1.05, 1.2, 1000},
    {384, 41e3, 0.31, 0.27, 0.91, 1.08, NAN, 1500},
    {512, 72e3, 0.32, 0.30, 0.94, 1.18, NAN, 2000},
};

/* Table 5 gives means alone. */
static const struct reported table5[2] = {
    {100, NAN, 0.26, NAN, 0.57, NAN, NAN, NAN},
    {200, NAN, 0.25, NAN, 0.59, NAN, NAN, NAN},
};

/* The columns that both tests share. */
static void our_row(struct table *table, const struct run *run, const char *first)
{
    if (!run->json) {
        table_row(table, "%s|failed", first);
        return;
    }
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s", first, run_cell(run, "%.0f", "steps"), run_cell(run, "%.0f", "springls_mean"),
              paper_error(run, "deformation"), paper_error(run, "tracking"), paper_error(run, "halfway"),
              run_cell(run, "%.3f", "surface_mean"), run_cell(run, "%+.3f %%", "volume_change_percent"));
}

void paper_tests(struct paper *paper)
{
    enum { ROWS = 5 };
    static const char *const commands[ROWS] = {"`build/leveque --params default`", "`build/leveque --params default --period 3`",
                                               "`build/leveque --params paper`", "`build/zalesak --params default`",
                                               "`build/zalesak --params paper`"};
    static struct table table;
    const int grid = paper_grid(paper, 128);
    const int ours[ROWS] = {paper_leveque(paper, grid, 2.5, "default", "", ""), paper_leveque(paper, grid, 3.0, "default", "", ""),
                            paper_leveque(paper, grid, 2.5, "paper", "", ""), paper_zalesak(paper, grid, "default", "", ""),
                            paper_zalesak(paper, grid, "paper", "", "")};
    int whole = 0;
    paper_do(paper, "tests");
    table_begin(&table);
    table_row(&table, "|Steps|Springls|Deformation|Tracking|Halfway|Surface|Volume");
    for (int r = 0; r < ROWS; ++r) {
        const struct run *run = &paper->runs[ours[r]];
        our_row(&table, run, commands[r]);
        whole += run_number(run, "components") == 1.0 && run_number(run, "euler") == 2.0;
        if (r == 2) {
            table_row(&table, "the paper, Table 3 and section 5.3|500|5K|0.38 +- 0.28|0.93 +- 1.07|||4.6 %%");
        } else if (r == 4) {
            table_row(&table, "the paper, Table 4|628|2.8K|||||0.6 %%");
        }
    }
    paper_table(paper, &table);
    paper_say(paper, "\n%d of the %d runs end as one component with Euler number 2, as they began.\n", whole, (int)ROWS);
}

enum { MODELS = 3 }; /* the paper's set, the same with half-time sampling, the default set */
static const char *model_name(int m) { return m == 1 ? "the same, half-time sampling" : paper_set_names[m / 2]; }

static const char *times(double ours, double theirs)
{
    return cell(ours < 0.01 * theirs ? "less than 0.01 times" : "%.2f times", ours / theirs);
}

/* Writes in words how far a run is from the paper's. */
static void say_difference(struct paper *paper, const struct run *run, const char *name, const struct reported *r)
{
    if (!run->json || (int)run_number(run, "grid") != r->grid) {
        return; /* another grid (--scale) is no comparison */
    }
    paper_say(paper, "- %d^3, %s: %s the paper's deformation error, %s its tracking error", r->grid, name,
              times(run_number(run, "deformation_mean"), r->deformation), times(run_number(run, "tracking_mean"), r->tracking));
    if (isfinite(r->springls)) {
        paper_say(paper, ", %s its springls", times(run_number(run, "springls_mean"), r->springls));
    }
    paper_say(paper, ".\n");
}

void paper_table3(struct paper *paper)
{
    static struct table table;
    const int count = paper->full ? PAPER_GRIDS : 2;
    int ours[PAPER_GRIDS][MODELS];
    for (int g = 0; g < count; ++g) { /* how times are sampled shows at one grid */
        const int n = paper_grid(paper, table3[g].grid);
        ours[g][0] = paper_leveque(paper, n, 2.5, paper_sets[0], "", "");
        ours[g][1] = g == 0 ? paper_leveque(paper, n, 2.5, paper_sets[0], "_half_time", "--set half_time_sampling=1") : -1;
        ours[g][2] = paper_leveque(paper, n, 2.5, paper_sets[1], "", "");
    }
    paper_do(paper, "Table 3");
    table_begin(&table);
    table_row(&table, "Grid, model|Steps|Springls|Deformation|Tracking|Halfway|Surface|Volume");
    for (int g = 0; g < count; ++g) {
        const struct reported *r = &table3[g];
        table_row(&table, "%d^3, the paper|%.0f|%.0fK|%.2f +- %.2f|%.2f +- %.2f|||%s", r->grid, r->steps, 1e-3 * r->springls,
                  r->deformation, r->deformation_std, r->tracking, r->tracking_std,
                  isfinite(r->volume) ? cell("%.1f %%", r->volume) : "");
        for (int m = 0; m < MODELS; ++m) {
            if (ours[g][m] >= 0) {
                char name[TABLE_CELL];
                const struct run *run = &paper->runs[ours[g][m]];
                snprintf(name, sizeof name, "%s, %s", run_cell(run, "%.0f^3", "grid"), model_name(m));
                our_row(&table, run, name);
            }
        }
    }
    paper_table(paper, &table);
    paper_say(paper, "\n");
    for (int g = 0; g < count; ++g) {
        for (int m = 0; m < MODELS; ++m) {
            if (ours[g][m] >= 0) {
                say_difference(paper, &paper->runs[ours[g][m]], model_name(m), &table3[g]);
            }
        }
    }
}

void paper_table5(struct paper *paper)
{
    static const char *const others[2][2] = {{"LSID|0.34|1.7", "LSPC|0.34|0.63"}, {"LSID|0.38|1.4", "LSPC|0.38|0.68"}};
    static struct table table;
    int ours[2][2];
    for (int g = 0; g < 2; ++g) {
        for (int s = 0; s < 2; ++s) {
            ours[g][s] = paper_leveque(paper, paper_grid(paper, table5[g].grid), 1.6, paper_sets[s], "", "");
        }
    }
    paper_do(paper, "Table 5");
    table_begin(&table);
    table_row(&table, "Grid, method|Deformation|Tracking|Halfway|Springls|Volume");
    for (int g = 0; g < 2; ++g) {
        for (int i = 0; i < 2; ++i) {
            table_row(&table, "%d^3, the paper: %s", table5[g].grid, others[g][i]);
        }
        table_row(&table, "%d^3, the paper: SpringLS|%.2f|%.2f", table5[g].grid, table5[g].deformation, table5[g].tracking);
        for (int s = 0; s < 2; ++s) {
            const struct run *run = &paper->runs[ours[g][s]];
            table_row(&table, "%s, %s|%s|%s|%s|%s|%s", run_cell(run, "%.0f^3", "grid"), paper_set_names[s],
                      run_cell(run, "%.4f", "deformation_mean"), run_cell(run, "%.4f", "tracking_mean"),
                      run_cell(run, "%.4f", "halfway_mean"), run_cell(run, "%.0f", "springls_mean"),
                      run_cell(run, "%+.3f %%", "volume_change_percent"));
        }
    }
    paper_table(paper, &table);
    paper_say(paper, "\n");
    for (int g = 0; g < 2; ++g) {
        for (int s = 0; s < 2; ++s) {
            say_difference(paper, &paper->runs[ours[g][s]], paper_set_names[s], &table5[g]);
        }
    }
}

/* OpenVDB's level set beside the two sets: Zalesak's test, and LeVeque's with T = 3. */
static void beside_openvdb(struct paper *paper, const int zalesak[2])
{
    enum { PROBLEMS = 2, METHODS = 3 };
    static struct table table;
    static const char *const titles[PROBLEMS] = {"zalesak, one turn", "leveque, T = 3"};
    const bool installed = access("build/bench/openvdb_advection", X_OK) == 0;
    const int grid = paper_grid(paper, 128);
    int runs[PROBLEMS][METHODS];
    for (int s = 0; s < 2; ++s) {
        runs[0][s] = zalesak[s];
        runs[1][s] = paper_leveque(paper, grid, 3.0, paper_sets[s], "", "");
    }
    for (int p = 0; p < PROBLEMS && installed; ++p) {
        char name[RUN_NAME], command[RUN_NAME];
        snprintf(name, sizeof name, "openvdb_%d_%d", p, grid);
        snprintf(command, sizeof command, "build/bench/openvdb_advection %s %d %s", p == 0 ? "zalesak" : "leveque", grid,
                 p == 0 ? "1" : "3");
        runs[p][2] = paper_run(paper, name, command);
    }
    paper_do(paper, "OpenVDB");
    table_begin(&table);
    table_row(&table, "%d^3|Volume, end against start|Volume, against the exact body|Surface, mean|Surface, largest|Tracking|"
                      "Components, Euler number", grid);
    for (int p = 0; p < PROBLEMS; ++p) {
        for (int m = 0; m < (installed ? METHODS : 2); ++m) {
            const struct run *run = &paper->runs[runs[p][m]];
            table_row(&table, "%s: %s|%s|%s|%s|%s|%s|%s", titles[p], m < 2 ? paper_set_names[m] : "OpenVDB's level set",
                      run_cell(run, "%+.3f %%", "volume_change_percent"), run_cell(run, "%+.3f %%", "volume_error_percent"),
                      run_cell(run, "%.3f", "surface_mean"), run_cell(run, "%.2f", "surface_max"),
                      m < 2 ? paper_error(run, "tracking") : "cannot",
                      cell2("%.0f, %.0f", run_number(run, "components"), run_number(run, "euler")));
        }
    }
    paper_say(paper, "\n");
    paper_table(paper, &table);
    if (!installed) {
        paper_say(paper, "\nOpenVDB was not installed when this was made: its rows are missing.\n");
    }
}

void paper_table4(struct paper *paper)
{
    static struct table table;
    const int grid = paper_grid(paper, 128);
    int ours[2];
    for (int s = 0; s < 2; ++s) {
        ours[s] = paper_zalesak(paper, grid, paper_sets[s], "", "");
    }
    paper_do(paper, "Table 4");
    table_begin(&table);
    table_row(&table, "Method|Re-sampling|Volume change|Particles|Deformation|Tracking|Surface");
    table_row(&table, "the paper: SpringLS|yes|0.6 %%|2.8K|||");
    table_row(&table, "the paper: PLS|yes|2.6 %%|80K|||");
    table_row(&table, "the paper: PLS|no|0.3 %%|86K|||");
    table_row(&table, "the paper: MarkerLS|no|0.9 %%|49K|||");
    for (int s = 0; s < 2; ++s) {
        const struct run *run = &paper->runs[ours[s]];
        table_row(&table, "%s|yes|%s|%s|%s|%s|%s", paper_set_names[s], run_cell(run, "%+.3f %%", "volume_change_percent"),
                  run_cell(run, "%.0f", "springls_mean"), paper_error(run, "deformation"), paper_error(run, "tracking"),
                  run_cell(run, "%.3f", "surface_mean"));
    }
    paper_table(paper, &table);
    beside_openvdb(paper, ours);
}
