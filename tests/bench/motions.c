/* motions - the default parameters, the same for all, on motions whose answer is known: bodies that are twisted, sheared and
 * blown up and brought back, two that touch and part, a part with sharp edges that turns, a ball that a vortex rolls up.
 *
 *   GRID=64 make motions     another grid than 128^3
 *   STEP=1 make motions      voxels a step at most, instead of 2
 *   ORDERS=1 make motions    quick: one order of the springls instead of the mean over three
 *   ONLY=cover make motions  the table of coverage alone
 *
 * The scanned bodies come from SPRINGLS_DATA; without it other shapes stand in for them. Prints tables;
 * build/bench/motions.json has every figure of every run. */
#include "springls.h"

#include "known_motions.h"
#include "table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- tables ---- */

/* Three figures that belong together: mean, 99 in 100, largest. */
static const char *error_cell(const struct motion_case *c, int orders, enum motion_figure first, char text[TABLE_CELL])
{
    double means[3];
    for (int k = 0; k < 3; ++k) {
        means[k] = motion_mean(c, orders, (enum motion_figure)((int)first + k));
    }
    snprintf(text, TABLE_CELL, isfinite(means[0]) ? "%.4f / %.3f / %.2f" : "-", means[0], means[1], means[2]);
    return text;
}

/* Mean and largest. */
static const char *edge_cell(const struct motion_case *c, int orders, enum motion_figure first)
{
    return cell2("%.3f / %.2f", motion_mean(c, orders, first), motion_mean(c, orders, (enum motion_figure)((int)first + 1)));
}

/* A count at the start, at half time and at the end; a range where the orders differ. */
static const char *phases_cell(const struct motion_case *c, int orders, enum motion_figure first, char text[TABLE_CELL])
{
    size_t length = 0;
    for (int k = 0; k < 3; ++k) {
        const struct motion_spread s = motion_spread(c, orders, (enum motion_figure)((int)first + k));
        const char *number = s.least < s.most ? cell2("%g..%g", s.least, s.most) : cell("%g", s.mean);
        length += (size_t)snprintf(text + length, TABLE_CELL - length, "%s%s", k > 0 ? ", " : "", number);
    }
    return text;
}

static void print_errors(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table,
              "errors|tracking mean / 99 %% / max|tracking mean, orders|at half time|volume at half time|volume at the end");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        const struct motion_spread tracking = motion_spread(c, orders, MOTION_tracking_mean);
        char end[TABLE_CELL], halfway[TABLE_CELL];
        table_row(&table, "%s|%s|%s|%s|%s|%s", c->name, error_cell(c, orders, MOTION_tracking_mean, end),
                  cell2("%.4f..%.4f", tracking.least, tracking.most), error_cell(c, orders, MOTION_halfway_mean, halfway),
                  cell("%+.3f %%", motion_mean(c, orders, MOTION_volume_halfway)),
                  cell("%+.3f %%", motion_mean(c, orders, MOTION_volume_end)));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_error_estimates(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "half time / end|springls within the estimate|median estimate over error|"
                      "vertices of the zero level within it|median");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        static const char share[] = "%.1f %% / %.1f %%", ratio[] = "%.1f / %.1f";
        table_row(&table, "%s|%s|%s|%s|%s", c->name,
                  cell2(share, motion_mean(c, orders, MOTION_within_halfway), motion_mean(c, orders, MOTION_within_end)),
                  cell2(ratio, motion_mean(c, orders, MOTION_ratio_halfway), motion_mean(c, orders, MOTION_ratio_end)),
                  cell2(share, motion_mean(c, orders, MOTION_mesh_within_halfway),
                        motion_mean(c, orders, MOTION_mesh_within_end)),
                  cell2(ratio, motion_mean(c, orders, MOTION_mesh_ratio_halfway), motion_mean(c, orders, MOTION_mesh_ratio_end)));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_surfaces(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "from the exact surface|to the zero level, start mean / 99 %% / max|to the zero level|to springls|"
                      "at sharp edges: to the zero level, start mean / max|to the zero level|to springls");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        char start[TABLE_CELL], end[TABLE_CELL], soup[TABLE_CELL];
        table_row(&table, "%s|%s|%s|%s|%s|%s|%s", c->name, error_cell(c, orders, MOTION_start_mean, start),
                  error_cell(c, orders, MOTION_end_mean, end), error_cell(c, orders, MOTION_soup_mean, soup),
                  edge_cell(c, orders, MOTION_start_edge_mean), edge_cell(c, orders, MOTION_end_edge_mean),
                  edge_cell(c, orders, MOTION_soup_edge_mean));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_coverage(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "coverage|covered, mean|least|covered twice, most|area of the springls over the surface's");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        table_row(&table, "%s|%s|%s|%s|%s", c->name, cell("%.1f %%", 100.0 * motion_mean(c, orders, MOTION_covered_mean)),
                  cell("%.1f %%", 100.0 * motion_spread(c, orders, MOTION_covered_least).least),
                  cell("%.1f %%", 100.0 * motion_spread(c, orders, MOTION_covered_twice_most).most),
                  cell2("%.2f to %.2f", motion_spread(c, orders, MOTION_coverage_least).least,
                        motion_spread(c, orders, MOTION_coverage_most).most));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_topology(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "start, half time, end|parts wanted|parts|Euler");
    for (int m = 0; m < MOTIONS; ++m) {
        char parts[TABLE_CELL], euler[TABLE_CELL];
        table_row(&table, "%s|%d, %d, %d|%s|%s", cases[m].name, known_components[m][0], known_components[m][1],
                  known_components[m][2], phases_cell(&cases[m], orders, MOTION_components_start, parts),
                  phases_cell(&cases[m], orders, MOTION_euler_start, euler));
    }
    table_print(&table, stdout);
    printf("\n");
}

static void print_costs(const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "springls|at the start|mean|at the end|smallest angle min / mean|steps|ms a step|s");
    for (const struct motion_case *c = cases; c < cases + MOTIONS; ++c) {
        table_row(&table, "%s|%s|%s|%s|%s|%s|%s|%s", c->name, cell("%.0f", motion_mean(c, orders, MOTION_springls_start)),
                  cell("%.0f", motion_mean(c, orders, MOTION_springls_mean)),
                  cell("%.0f", motion_mean(c, orders, MOTION_springls_end)),
                  cell2("%.1f / %.1f", motion_mean(c, orders, MOTION_smallest_angle_min),
                        motion_mean(c, orders, MOTION_smallest_angle_mean)),
                  cell("%.0f", motion_mean(c, orders, MOTION_steps)), cell("%.1f", motion_mean(c, orders, MOTION_cpu_ms_a_step)),
                  cell("%.2f", motion_mean(c, orders, MOTION_cpu_seconds)));
    }
    table_print(&table, stdout);
}

static bool write_json(const struct motion_case *cases, int orders)
{
    struct json_writer json;
    if (!make_folder("build/bench") || !json_open(&json, "build/bench/motions.json")) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", cases[0].motion->problem.grid);
    json_number(&json, "max_displacement", (double)cases[0].setting.max_displacement);
    json_array_begin(&json, "cases");
    for (int m = 0; m < MOTIONS; ++m) {
        json_object_begin(&json, NULL);
        motion_json(&json, &cases[m], orders);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json);
}

int main(void)
{
    static struct known_motions all;
    static struct motion_case cases[MOTIONS];
    const int grid = (int)environment_number("GRID", 128.0);
    const double step = environment_number("STEP", 2.0);
    const int orders = (int)environment_number("ORDERS", MOTION_ORDERS);
    if (grid < 32 || grid > 512 || !(step > 0.0 && step <= 8.0) || orders < 1 || orders > MOTION_ORDERS) {
        fprintf(stderr, "motions: GRID is 32..512, STEP up to 8, ORDERS 1..%d\n", (int)MOTION_ORDERS);
        return 2;
    }
    known_motions_make(grid, true, &all);
    for (int m = 0; m < MOTIONS; ++m) {
        cases[m].name = all.names[m];
        cases[m].motion = &all.motions[m];
        cases[m].setting.params = springls_default_params();
        cases[m].setting.max_displacement = (float)step;
    }
    printf("Default parameters on %d^3, at most %g voxels a step. Lengths in voxels; every figure is the mean over %d orders of\n"
           "the springls, which differ by chance alone. Tracking is from a particle to the place where the exact flow takes its\n"
           "correspondence; the exact surface is that of the start moved by the exact flow, by points of it. ms and s are\n"
           "processor time of the steps.\n\n", grid, step, orders);
    fflush(stdout);
    motion_run_all(cases, MOTIONS, orders);
    const char *only = getenv("ONLY");
    if (!only || strcmp(only, "cover") != 0) {
        print_errors(cases, orders);
        print_error_estimates(cases, orders);
        print_surfaces(cases, orders);
        print_topology(cases, orders);
        print_costs(cases, orders);
    }
    print_coverage(cases, orders);
    int failures = motion_print_failures(cases, MOTIONS, orders);
    if (!write_json(cases, orders)) {
        fprintf(stderr, "motions: cannot write build/bench/motions.json\n");
        ++failures;
    }
    known_motions_free(&all);
    return failures > 0;
}
