/* accuracy.c - tests that the figures of README.md and docs/results.md stay true: motions with known answers, run with both
   parameter sets, are about as accurate as when the table below was written. -v prints the figures for a new table. */
#include "springls.h"

#include "known_motions.h"
#include "tests/greatest.h"

#include <math.h>

enum { GRID = 64, ANY = 0 };

/* A figure, a mean over several orders of the springls, may grow by this factor. */
static const double margin = 1.5;

/* The figures that are bounded, and their least bounds: the last digit that README.md prints, since smaller differences are chance.
   Distances are in voxels, volumes in percent; `bare` is the share of the zero level without springls, `excess` the largest
   difference between the springls' area and the surface's, as a share of the latter. */
#define FIGURES(X)                                                                                                         \
    X(deformation, 0.001) X(tracking, 0.001) X(tracking_99, 0.001) X(halfway, 0.001) X(halfway_99, 0.001)                  \
    X(surface, 0.001) X(exact_to_zero, 0.001) X(exact_to_zero_99, 0.001) X(exact_to_springls, 0.001)                       \
    X(volume_halfway, 0.01) X(volume_end, 0.01) X(bare, 0.01) X(excess, 0.01)

#define FIGURE_ENUM(name, least) FIGURE_##name,
enum { FIGURES(FIGURE_ENUM) FIGURE_COUNT };
#define FIGURE_NAME(name, least) #name,
static const char *const figure_names[FIGURE_COUNT] = {FIGURES(FIGURE_NAME)};
#define FIGURE_LEAST(name, least) least,
static const double least_bounds[FIGURE_COUNT] = {FIGURES(FIGURE_LEAST)};

/* A motion, its topology, and its figures when this was written; bounds are `margin` times those. NAN: the motion has no such
   figure, because the body does not come back to a shape to compare with. */
struct row {
    enum known_motion motion;
    bool paper;               /* the paper's parameters; else the default ones */
    int components[2], euler[2]; /* at half time and at the end; ANY: a sheet is thinner than a voxel then */
    double written[FIGURE_COUNT];
};

static const struct row rows[] = {
    /* deformation, tracking, tracking_99, halfway, halfway_99, surface, exact_to_zero, exact_to_zero_99, exact_to_springls,
       volume_halfway, volume_end, bare, excess */
    {LEVEQUE_SHORT, false, {1, 1}, {2, 2},
     {0.00085, 0.0011, 0.015, 0.0017, 0.031, 0.0047, 0.023, 0.044, 0.026, 0.17, 0.0027, 0.089, 0.065}},
    {LEVEQUE_MIDDLE, false, {1, 1}, {2, 2},
     {0.0024, 0.0032, 0.054, 0.019, 0.26, 0.0057, 0.024, 0.047, 0.027, 0.82, 0.0086, 0.093, 0.071}},
    {LEVEQUE, false, {1, 1}, {ANY, 2},
     {0.0035, 0.0046, 0.072, 0.045, 0.49, 0.0068, 0.024, 0.054, 0.027, 2.1, 0.0085, 0.11, 0.074}},
    {ZALESAK, false, {1, 1}, {2, 2},
     {0.0048, 0.0061, 0.042, 0.0056, 0.042, 0.015, 0.028, 0.27, 0.021, 0.048, 0.077, 0.12, 0.085}},
    {BREATHE, false, {1, 1}, {2, 2},
     {0.00038, 0.013, 0.029, 0.019, 0.045, 0.006, 0.03, 0.047, 0.029, 0.59, 0.012, 0.088, 0.081}},
    {ABC, false, {1, 1}, {2, 2},
     {NAN, 0.005, 0.088, 0.000052, 0.0017, NAN, 0.05, 0.31, 0.03, 0.19, 0.71, 0.09, 0.076}},
    {GYRE, false, {1, 1}, {2, 2},
     {NAN, 0.024, 0.45, 0.000092, 0.0019, NAN, 0.081, 0.91, 0.031, 0.14, 2.4, 0.12, 0.09}},
    {TWIST, false, {1, 1}, {2, 2},
     {0.000039, 0.0002, 0.00027, 0.00006, 0.00021, 0.0057, 0.012, 0.23, 0.0032, 0.34, 0.0014, 0.19, 0.14}},
    {TOUCH, false, {1, 2}, {2, 4},
     {NAN, 0.0077, 0.018, 0.0049, 0.051, NAN, 0.057, 0.21, 0.038, 4.5, 0.13, 0.13, 0.47}},
    {LEVEQUE_SHORT, true, {1, 1}, {2, 2},
     {0.051, 0.36, 1.4, 0.55, 3.3, 0.081, 0.13, 0.4, 0.11, 1.1, 1.3, 0.43, 0.16}},
    {LEVEQUE_MIDDLE, true, {1, 1}, {2, 2},
     {0.21, 0.77, 2.8, 1.6, 10.0, 0.24, 0.32, 0.82, 0.28, 4.0, 6.5, 0.5, 0.23}},
    {LEVEQUE, true, {ANY, ANY}, {ANY, ANY},
     {1.7, 2.8, 10.0, 3.7, 22.0, 1.9, 1.8, 5.4, 1.6, 36.0, 51.0, 0.55, 0.24}},
    {ZALESAK, true, {1, 1}, {2, 2},
     {0.083, 0.16, 1.3, 0.13, 1.0, 0.11, 0.25, 1.6, 0.17, 0.95, 0.3, 0.4, 0.11}},
    {BREATHE, true, {1, 1}, {2, 2},
     {0.025, 0.38, 0.96, 0.6, 1.3, 0.03, 0.089, 0.21, 0.071, 0.54, 0.36, 0.31, 0.16}},
    {ABC, true, {1, 1}, {2, 2},
     {NAN, 0.74, 3.6, 0.24, 1.5, NAN, 0.15, 0.95, 0.11, 0.78, 2.3, 0.47, 0.26}},
    {GYRE, true, {1, 1}, {2, 2},
     {NAN, 1.2, 12.0, 0.22, 1.4, NAN, 2.7, 21.0, 2.2, 1.6, 16.0, 0.48, 0.16}},
    {TWIST, true, {1, 1}, {2, 2},
     {0.088, 0.23, 1.3, 0.18, 1.2, 0.14, 0.27, 1.3, 0.2, 2.5, 2.6, 0.41, 0.17}},
    {TOUCH, true, {1, 2}, {2, 4},
     {NAN, 1.5, 28.0, 0.26, 1.7, NAN, 0.22, 0.85, 0.16, 2.5, 0.35, 0.49, 0.19}},
};

static struct known_motions known;

/* Runs a row with the steps that suit its set: of two voxels; with the paper's set as many as the paper takes, else of half a
   voxel. */
static void run_row(const struct row *row, struct motion_case *c)
{
    c->name = known.names[row->motion];
    c->motion = &known.motions[row->motion];
    c->setting.params = row->paper ? springls_paper_params() : springls_default_params();
    c->setting.max_displacement = !row->paper ? 2.0f : c->motion->problem.steps > 0 ? 0.0f : 0.5f;
    motion_run_all(c, 1, MOTION_ORDERS);
}

/* Returns the mean absolute value of a figure over the orders. */
static double mean_magnitude(const struct motion_case *c, enum motion_figure figure)
{
    double sum = 0.0;
    for (int order = 0; order < MOTION_ORDERS; ++order) {
        sum += fabs(c->figures[order][figure]);
    }
    return sum / MOTION_ORDERS;
}

static void take_figures(const struct motion_case *c, double figures[FIGURE_COUNT])
{
    static const enum motion_figure sources[FIGURE_bare] = {
        MOTION_deformation_mean, MOTION_tracking_mean, MOTION_tracking_q99, MOTION_halfway_mean, MOTION_halfway_q99,
        MOTION_surface_mean, MOTION_end_mean, MOTION_end_q99, MOTION_soup_mean, MOTION_volume_halfway, MOTION_volume_end};
    for (int k = 0; k < FIGURE_bare; ++k) {
        figures[k] = mean_magnitude(c, sources[k]);
    }
    figures[FIGURE_bare] = 1.0 - mean_magnitude(c, MOTION_covered_mean);
    figures[FIGURE_excess] = fmax(1.0 - mean_magnitude(c, MOTION_coverage_least), mean_magnitude(c, MOTION_coverage_most) - 1.0);
}

static void print_row(const struct motion_case *c, const double figures[FIGURE_COUNT])
{
    printf("\n    %s: {", c->name);
    for (int k = 0; k < FIGURE_COUNT; ++k) {
        printf(isnan(figures[k]) ? "%sNAN" : "%s%.2g", k > 0 ? ", " : "", figures[k]);
    }
    printf("}\n");
}

static greatest_test_res check_count(const struct motion_case *c, enum motion_figure figure, int expected)
{
    for (int order = 0; order < MOTION_ORDERS && expected != ANY; ++order) {
        ASSERT_EQ_FMT((double)expected, c->figures[order][figure], "%g");
    }
    PASS();
}

TEST accuracy_is_kept(const struct row *row)
{
    static struct motion_case c;
    double figures[FIGURE_COUNT];
    run_row(row, &c);
    for (int order = 0; order < MOTION_ORDERS; ++order) {
        ASSERT_STR_EQ("", c.failures[order]);
    }
    take_figures(&c, figures);
    if (GREATEST_IS_VERBOSE()) {
        print_row(&c, figures);
    }
    for (int k = 0; k < FIGURE_COUNT; ++k) {
        const double bound = fmax(margin * row->written[k], least_bounds[k]);
        ASSERT_EQm(figure_names[k], isnan(row->written[k]), isnan(figures[k]));
        if (figures[k] > bound) {
            printf("\n  %s: %s is %.3g, at most %.3g is allowed, it was %.3g\n", c.name, figure_names[k], figures[k], bound,
                   row->written[k]);
            FAILm(figure_names[k]);
        }
    }
    CHECK_CALL(check_count(&c, MOTION_components_halfway, row->components[0]));
    CHECK_CALL(check_count(&c, MOTION_components_end, row->components[1]));
    CHECK_CALL(check_count(&c, MOTION_euler_halfway, row->euler[0]));
    CHECK_CALL(check_count(&c, MOTION_euler_end, row->euler[1]));
    PASS();
}

SUITE(accuracy)
{
    for (size_t i = 0; i < sizeof rows / sizeof *rows; ++i) {
        greatest_set_test_suffix(known.names[rows[i].motion]);
        RUN_TESTp(accuracy_is_kept, &rows[i]);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    known_motions_make(GRID, false, &known);
    RUN_SUITE(accuracy);
    known_motions_free(&known);
    GREATEST_MAIN_END();
}
