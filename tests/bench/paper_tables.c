/* paper_tables.c - Tables 3, 4 and 5, and the volume changes of section 5.3. */
#include "paper.h"

#include <math.h>

/* What the paper reports of a run; NAN where it says nothing. */
struct reported {
    int grid;
    double springls, deformation, deformation_std, tracking, tracking_std, volume, steps, seconds;
};

/* Table 3; volume changes from section 5.3. */
static const struct reported table3[PAPER_GRIDS] = {
    {128, 5e3, 0.38, 0.28, 0.93, 1.07, 4.6, 500, 35},
    {256, 19e3, 0.34, 0.31, 0.92, 1.05, 1.2, 1000, 300},
    {384, 41e3, 0.31, 0.27, 0.91, 1.08, NAN, 1500, 970},
    {512, 72e3, 0.32, 0.30, 0.94, 1.18, NAN, 2000, 2500},
};

/* Table 5 gives means alone. */
static const struct reported table5[2] = {
    {100, NAN, 0.26, NAN, 0.57, NAN, NAN, NAN, NAN},
    {200, NAN, 0.25, NAN, 0.59, NAN, NAN, NAN, NAN},
};

static const char *ratio(double ours, double theirs) { return cell("%.2g", ours / theirs); }

/* In words how far a run is from the paper's. */
static void say_difference(struct paper *paper, const struct run *run, const char *name, const struct reported *r)
{
    if (!run->json || (int)run_number(run, "grid") != r->grid) {
        return; /* another grid (--scale) is no comparison */
    }
    paper_say(paper, "- %d^3, %s: %s times the paper's deformation error, %s times its tracking error", r->grid, name,
              ratio(run_number(run, "deformation_mean"), r->deformation),
              ratio(run_number(run, "tracking_mean"), r->tracking));
    if (isfinite(r->springls)) {
        paper_say(paper, ", %s times its springls", ratio(run_number(run, "springls_mean"), r->springls));
    }
    if (isfinite(r->seconds)) {
        paper_say(paper, ", %s times its time (%s thread(s) against 8 cores)", ratio(run_number(run, "seconds_total"), r->seconds),
                  run_cell(run, "%.0f", "threads"));
    }
    if (isfinite(r->volume)) {
        paper_say(paper, "; volume changes by %s where the paper's changes by %s (sign not given)",
                  run_cell(run, "%+.2f %%", "volume_change_percent"), cell("%.1f %%", r->volume));
    }
    paper_say(paper, ".\n");
}

static const char *mean_and_std(const struct run *run, const char *name)
{
    char mean[40], std[40];
    snprintf(mean, sizeof mean, "%s_mean", name);
    snprintf(std, sizeof std, "%s_std", name);
    return cell2("%.4f +- %.4f", run_number(run, mean), run_number(run, std));
}

static void our_row(struct table *table, const struct run *run, const char *name)
{
    if (!run->json) {
        table_row(table, "-|%s|failed", name);
        return;
    }
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", run_cell(run, "%.0f^3", "grid"), name,
              run_cell(run, "%.0f", "springls_mean"), mean_and_std(run, "deformation"), mean_and_std(run, "tracking"),
              mean_and_std(run, "halfway"), run_cell(run, "%.4f", "surface_mean"),
              run_cell(run, "%+.2f %%", "volume_change_percent"), run_cell(run, "%.0f", "steps"),
              run_cell(run, "%.1f s", "seconds_total"), cell("%.1f s", run->cpu > 0.0 ? run->cpu : NAN),
              run_cell(run, "%.0f", "threads"));
}

enum { MODELS = 3 }; /* the paper's set, the same with half-time sampling, the default set */
static const char *model_name(int m) { return m == 1 ? "the same, half-time sampling" : paper_set_names[m / 2]; }

/* Numbers of the three runs of LeVeque's test. */
static void leveque_models(struct paper *paper, int grid, double period, int threads, int runs[MODELS])
{
    const int n = paper_grid(paper, grid);
    runs[0] = paper_leveque(paper, n, period, paper_sets[0], "", "", threads);
    runs[1] = paper_leveque(paper, n, period, paper_sets[0], "_half_time", "--set half_time_sampling=1", threads);
    runs[2] = paper_leveque(paper, n, period, paper_sets[1], "", "", threads);
}

void paper_table3(struct paper *paper)
{
    static struct table table;
    const int count = paper->full ? PAPER_GRIDS : 2;
    int ours[PAPER_GRIDS][MODELS];
    for (int g = 0; g < count; ++g) {
        const int n = paper_grid(paper, table3[g].grid);
        if (g == 0) {
            leveque_models(paper, table3[g].grid, 2.5, 0, ours[g]);
        } else { /* how times are sampled shows at one grid */
            ours[g][0] = paper_leveque(paper, n, 2.5, paper_sets[0], "", "", 0);
            ours[g][1] = -1;
            ours[g][2] = paper_leveque(paper, n, 2.5, paper_sets[1], "", "", 0);
        }
    }
    paper_do(paper, "Table 3", PAPER_ALONE);
    paper_heading(paper, "Table 3: LeVeque's test, T = 2.5, and its volume change (section 5.3)");
    table_begin(&table);
    table_row(&table, "grid|model|springls|deformation|tracking|at half time|surface|volume|steps|time|processor|threads");
    for (int g = 0; g < count; ++g) {
        const struct reported *r = &table3[g];
        table_row(&table, "%d^3|paper reports|%s|%s|%s|-|-|%s|%s|%s|-|8 cores", r->grid, cell("%.0f", r->springls),
                  cell2("%.2f +- %.2f", r->deformation, r->deformation_std), cell2("%.2f +- %.2f", r->tracking, r->tracking_std),
                  cell("%.1f %%", r->volume), cell("%.0f", r->steps), cell("%.0f s", r->seconds));
        for (int m = 0; m < MODELS; ++m) {
            if (ours[g][m] >= 0) {
                our_row(&table, &paper->runs[ours[g][m]], model_name(m));
            }
        }
    }
    paper_table(paper, &table);
    for (int g = 0; g < count; ++g) {
        for (int m = 0; m < MODELS; ++m) {
            if (ours[g][m] >= 0) {
                say_difference(paper, &paper->runs[ours[g][m]], model_name(m), &table3[g]);
            }
        }
    }
    paper_say(paper, "- Section 5.3 also quotes MarkerLS at 128^3: volume change 1.8 %%, with 98K particles.\n");
}

void paper_table5(struct paper *paper)
{
    static const char *const others[2][2] = {{"LSID|0.34|1.7", "LSPC|0.34|0.63"}, {"LSID|0.38|1.4", "LSPC|0.38|0.68"}};
    static struct table table;
    int ours[2][MODELS];
    for (int g = 0; g < 2; ++g) {
        leveque_models(paper, table5[g].grid, 1.6, 1, ours[g]);
    }
    paper_do(paper, "Table 5", PAPER_TOGETHER);
    paper_heading(paper, "Table 5: LeVeque's test, T = 1.6");
    table_begin(&table);
    table_row(&table, "grid|method|deformation|tracking|at half time|springls|volume");
    for (int g = 0; g < 2; ++g) {
        for (int i = 0; i < 2; ++i) {
            table_row(&table, "%d^3|paper reports: %s|-|-|-", table5[g].grid, others[g][i]);
        }
        table_row(&table, "%d^3|paper reports: SpringLS|%.2f|%.2f|-|-|-", table5[g].grid, table5[g].deformation, table5[g].tracking);
        for (int m = 0; m < MODELS; ++m) {
            const struct run *run = &paper->runs[ours[g][m]];
            table_row(&table, "%s|%s|%s|%s|%s|%s|%s", run_cell(run, "%.0f^3", "grid"), model_name(m),
                      run_cell(run, "%.4f", "deformation_mean"), run_cell(run, "%.4f", "tracking_mean"),
                      run_cell(run, "%.4f", "halfway_mean"), run_cell(run, "%.0f", "springls_mean"),
                      run_cell(run, "%+.2f %%", "volume_change_percent"));
        }
    }
    paper_table(paper, &table);
    for (int g = 0; g < 2; ++g) {
        for (int m = 0; m < MODELS; ++m) {
            say_difference(paper, &paper->runs[ours[g][m]], model_name(m), &table5[g]);
        }
    }
}

void paper_table4(struct paper *paper)
{
    static struct table table;
    const int grid = paper_grid(paper, 128);
    int ours[2];
    for (int s = 0; s < 2; ++s) {
        ours[s] = paper_zalesak(paper, grid, paper_sets[s], 0);
    }
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
        table_row(&table, "%s, %d^3|yes|%s thread(s)|%s|%s|%s|%s|%s|%s", paper_set_names[s], grid, run_cell(run, "%.0f", "threads"),
                  cell("%.1f fps", run_number(run, "steps") / run_number(run, "seconds_total")),
                  run_cell(run, "%+.2f %%", "volume_change_percent"), run_cell(run, "%.0f", "springls_mean"),
                  mean_and_std(run, "deformation"), mean_and_std(run, "tracking"), run_cell(run, "%.4f", "surface_mean"));
    }
    paper_table(paper, &table);
    paper_say(paper, "The paper gives no errors for this test but that they are below a voxel (section 5.4), and no sign of the\n"
                     "volume change.\n");
}
