/* paper_tables.c - Tables 3, 4 and 5. */
#include "paper.h"

#include <math.h>

/* Errors and counts of a run of ours; `first` is the row's beginning, with its own columns. */
static void our_row(struct table *table, const struct run *run, const char *grid, const char *name)
{
    if (!run->json) {
        table_row(table, "%s|%s|failed", grid, name);
        return;
    }
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", grid, name, cell("%.0f", run_number(run, "springls_mean")),
              cell2("%.3f +- %.3f", run_number(run, "deformation_mean"), run_number(run, "deformation_std")),
              cell2("%.3f +- %.3f", run_number(run, "tracking_mean"), run_number(run, "tracking_std")),
              cell2("%.3f +- %.3f", run_number(run, "halfway_mean"), run_number(run, "halfway_std")),
              cell("%.3f", run_number(run, "surface_mean")), cell("%+.2f %%", run_number(run, "volume_change_percent")),
              cell("%.0f", run_number(run, "steps")), cell("%.1f s", run_number(run, "seconds_total")),
              cell("%.0f", run_number(run, "threads")));
}

static void say_half_time(struct paper *paper, const struct run *plain, const struct run *half)
{
    paper_say(paper, "Half-time sampling changes the paper set's deformation error from %s to %s and its tracking error from %s to %s voxel.\n",
              cell("%.3f", run_number(plain, "deformation_mean")), cell("%.3f", run_number(half, "deformation_mean")),
              cell("%.3f", run_number(plain, "tracking_mean")), cell("%.3f", run_number(half, "tracking_mean")));
}

void paper_table3(struct paper *paper)
{
    static const int grids[PAPER_GRIDS] = {128, 256, 384, 512};
    static const char *const reported[PAPER_GRIDS] = {
        "5K|0.38 +- 0.28|0.93 +- 1.07|-|-|4.6 %|500|35 s|8 cores",
        "19K|0.34 +- 0.31|0.92 +- 1.05|-|-|1.2 %|1000|300 s|8 cores",
        "41K|0.31 +- 0.27|0.91 +- 1.08|-|-|-|1500|970 s|8 cores",
        "72K|0.32 +- 0.30|0.94 +- 1.18|-|-|-|2000|2500 s|8 cores",
    };
    static struct table table;
    const int count = paper->full ? 4 : 2;
    int ours[PAPER_GRIDS][2], half = 0;
    for (int g = 0; g < count; ++g) {
        const int grid = paper_grid(paper, grids[g]);
        for (int s = 0; s < 2; ++s) {
            ours[g][s] = paper_leveque(paper, grid, 2.5, paper_sets[s], "", "", 0);
        }
        if (g == 0) {
            half = paper_leveque(paper, grid, 2.5, "paper", "_half_time", "--set half_time_sampling=1", 0);
        }
    }
    paper_do(paper, "Table 3", PAPER_ALONE);
    paper_heading(paper, "Table 3: LeVeque's test, T = 2.5, and its volume change (section 5.3)");
    table_begin(&table);
    table_row(&table, "grid|model|springls|deformation|tracking|at half time|surface|volume|steps|time|threads");
    for (int g = 0; g < count; ++g) {
        char grid[24];
        snprintf(grid, sizeof grid, "%d^3", grids[g]);
        table_row(&table, "%s|paper reports|%s", grid, reported[g]);
        snprintf(grid, sizeof grid, "%d^3", paper_grid(paper, grids[g]));
        our_row(&table, &paper->runs[ours[g][0]], grid, paper_set_names[0]);
        if (g == 0) {
            our_row(&table, &paper->runs[half], grid, "the same, half-time sampling");
        }
        our_row(&table, &paper->runs[ours[g][1]], grid, paper_set_names[1]);
    }
    paper_table(paper, &table);
    say_half_time(paper, &paper->runs[ours[0][0]], &paper->runs[half]);
}

void paper_table4(struct paper *paper)
{
    static struct table table;
    const int grid = paper_grid(paper, 128);
    const int ours[2] = {paper_zalesak(paper, grid, paper_sets[0], 0), paper_zalesak(paper, grid, paper_sets[1], 0)};
    paper_do(paper, "Table 4", PAPER_ALONE);
    paper_heading(paper, "Table 4: Zalesak's test, 128^3, one turn in 628 steps");
    table_begin(&table);
    table_row(&table, "method|re-sampling|device|speed|volume change|particles|deformation|tracking|surface");
    table_row(&table, "paper reports: SpringLS|yes|8 cores|20 fps|0.6 %%|2.8K|-|-|-");
    table_row(&table, "paper reports: PLS|yes|1 core|2.5 fps|2.6 %%|80K|-|-|-");
    table_row(&table, "paper reports: PLS|no|1 core|3 fps|0.3 %%|86K|-|-|-");
    table_row(&table, "paper reports: MarkerLS|no|GPU|28 fps|0.9 %%|49K|-|-|-");
    for (int s = 0; s < 2; ++s) {
        const struct run *run = &paper->runs[ours[s]];
        table_row(&table, "%s, %d^3|yes|%s thread(s)|%s|%s|%s|%s|%s|%s", paper_set_names[s], grid, cell("%.0f", run_number(run, "threads")),
                  cell("%.1f fps", run_number(run, "steps") / run_number(run, "seconds_total")),
                  cell("%+.2f %%", run_number(run, "volume_change_percent")), cell("%.0f", run_number(run, "springls_mean")),
                  cell2("%.3f +- %.3f", run_number(run, "deformation_mean"), run_number(run, "deformation_std")),
                  cell2("%.3f +- %.3f", run_number(run, "tracking_mean"), run_number(run, "tracking_std")),
                  cell("%.3f", run_number(run, "surface_mean")));
    }
    paper_table(paper, &table);
    paper_say(paper, "Section 5.3 gives MarkerLS on LeVeque's test (128^3, T = 2.5) a volume change of 1.8 %%, with 98K particles.\n");
}

void paper_table5(struct paper *paper)
{
    static const int grids[2] = {100, 200};
    static const char *const reported[2][3] = {{"LSID|0.34|1.7", "LSPC|0.34|0.63", "SpringLS|0.26|0.57"},
                                               {"LSID|0.38|1.4", "LSPC|0.38|0.68", "SpringLS|0.25|0.59"}};
    static struct table table;
    int ours[2][2], half[2];
    for (int g = 0; g < 2; ++g) {
        const int grid = paper_grid(paper, grids[g]);
        for (int s = 0; s < 2; ++s) {
            ours[g][s] = paper_leveque(paper, grid, 1.6, paper_sets[s], "", "", 1);
        }
        half[g] = paper_leveque(paper, grid, 1.6, "paper", "_half_time", "--set half_time_sampling=1", 1);
    }
    paper_do(paper, "Table 5", PAPER_TOGETHER);
    paper_heading(paper, "Table 5: LeVeque's test, T = 1.6");
    table_begin(&table);
    table_row(&table, "grid|method|deformation|tracking|at half time|springls|volume");
    for (int g = 0; g < 2; ++g) {
        for (int i = 0; i < 3; ++i) {
            table_row(&table, "%d^3|paper reports: %s|-|-|-", grids[g], reported[g][i]);
        }
        for (int i = 0; i < 3; ++i) {
            static const char *const names[3] = {"springls, paper's parameters", "the same, half-time sampling", "springls, default parameters"};
            const struct run *run = &paper->runs[i == 1 ? half[g] : ours[g][i / 2]];
            table_row(&table, "%d^3|%s|%s|%s|%s|%s|%s", paper_grid(paper, grids[g]), names[i], cell("%.3f", run_number(run, "deformation_mean")),
                      cell("%.3f", run_number(run, "tracking_mean")), cell("%.3f", run_number(run, "halfway_mean")),
                      cell("%.0f", run_number(run, "springls_mean")), cell("%+.2f %%", run_number(run, "volume_change_percent")));
        }
    }
    paper_table(paper, &table);
}
