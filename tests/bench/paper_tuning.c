/* paper_tuning.c - sections 5.1 and 5.2: the functions of Fig. 8 and the choice among them, Figs. 11 and 12. */
#define SPRINGLS_STATIC
#define SPRINGLS_IMPLEMENTATION /* Fig. 8 draws the library's own functions, which are internal */
#include "springls.h"

#include "paper.h"

#include <math.h>
#include <string.h>

/* Pair p is H p / 4 with W p % 4. */
enum { H_COUNT = 2, W_COUNT = 4, PAIRS = H_COUNT * W_COUNT, PAIR_SPRINGS = 0, PAIR_CHOSEN = W_COUNT };

static const char *const h_names[H_COUNT] = {"H_a = x", "H_b = tanh(x)"};
static const char *const w_names[W_COUNT] = {"W_a = x", "W_b = atanh(x)", "W_c, peak at d_max", "W_d, peak at d_max/2"};

static const char *pair_name(int pair, char text[64])
{
    snprintf(text, 64, "H_%c, W_%c", "ab"[pair / W_COUNT], "abcd"[pair % W_COUNT]);
    return text;
}

/* ---- Fig. 8 ---- */

void paper_fig8(struct paper *paper)
{
    enum { POINTS = 200 };
    static double x[POINTS], h[H_COUNT][POINTS], w[W_COUNT][POINTS];
    const springls_params params = springls_paper_params();
    struct plot_series series[2][W_COUNT];
    struct image images[2];
    for (int i = 0; i < POINTS; ++i) {
        x[i] = 0.9 * i / (POINTS - 1);
        for (int k = 0; k < H_COUNT; ++k) {
            h[k][i] = (double)springls__threshold((springls_threshold)k, (float)x[i]);
        }
        for (int k = 0; k < W_COUNT; ++k) {
            w[k][i] = (double)springls__weight((springls_weight)k, (float)x[i], params.d_max, params.neighbor_radius);
        }
    }
    for (int k = 0; k < W_COUNT; ++k) {
        series[0][k] = paper_line(h_names[k % H_COUNT], x, h[k % H_COUNT], POINTS, k);
        series[1][k] = paper_line(w_names[k], x, w[k], POINTS, k);
    }
    const struct plot threshold = {.title = "Fig. 8a: threshold functions", .x_label = "x", .y_label = "H(x)",
                                   .series = series[0], .series_count = H_COUNT};
    const struct plot weight = {.title = "Fig. 8b: weight functions", .x_label = "x", .y_label = "W(x)",
                                .series = series[1], .series_count = W_COUNT};
    plot_render(&threshold, 620, 460, &images[0]);
    plot_render(&weight, 620, 460, &images[1]);
    paper_strip(paper, images, NULL, 2, 2, 900, "fig08.png",
                "Fig. 8: threshold functions H and weight functions W, as the library computes them");
}

/* ---- Figs. 11 and 12 ---- */

/* The text names neither the ranges nor the steps of the figure's axes; these enclose the chosen 0.3 and 5. */
enum { KAPPAS = 5, LAMBDAS = 4, CELLS = KAPPAS * LAMBDAS, METRICS = 4, CHOSEN_CELL = 2 + 2 * KAPPAS };
static const double kappas[KAPPAS] = {0.03, 0.1, 0.3, 1.0, 3.0}, lambdas[LAMBDAS] = {1.0, 2.0, 5.0, 10.0};
static const char *const kappa_names[KAPPAS] = {"0.03", "0.1", "0.3", "1", "3"};
static const char *const lambda_names[LAMBDAS] = {"1", "2", "5", "10"};
static const char *const metric_names[METRICS] = {"deformation error", "tracking error", "1000 springls, mean",
                                                  "1000 added and removed"};

struct sweep {
    int runs[PAIRS][CELLS];
    double metrics[METRICS][PAIRS][CELLS], total[PAIRS][CELLS]; /* total = deformation + tracking */
};

static void do_sweep(struct paper *paper, int grid, double period, struct sweep *sweep)
{
    const int failures_before = paper->failures;
    fprintf(stderr, "Some of these choices lose all springls; their runs fail and become empty cells.\n");
    for (int pair = 0; pair < PAIRS; ++pair) {
        for (int c = 0; c < CELLS; ++c) {
            char name[60], set[120];
            const double kappa = kappas[c % KAPPAS], lambda = lambdas[c / KAPPAS];
            snprintf(name, sizeof name, "_H%d_W%d_%g_%g", pair / W_COUNT, pair % W_COUNT, kappa, lambda);
            snprintf(set, sizeof set, "--set threshold=%d,weight=%d,kappa_int=%g,sharpness=%g", pair / W_COUNT,
                     pair % W_COUNT, kappa, lambda);
            sweep->runs[pair][c] = paper_leveque(paper, grid, period, "paper", name, set);
        }
    }
    paper_do(paper, "Fig. 11");
    paper->failures = failures_before;
    for (int pair = 0; pair < PAIRS; ++pair) {
        for (int c = 0; c < CELLS; ++c) {
            const struct run *run = &paper->runs[sweep->runs[pair][c]];
            paper->failures += !run->json && run->exit_status != 1; /* 1: a step failed */
            sweep->metrics[0][pair][c] = run_number(run, "deformation_mean");
            sweep->metrics[1][pair][c] = run_number(run, "tracking_mean");
            sweep->metrics[2][pair][c] = 1e-3 * run_number(run, "springls_mean");
            sweep->metrics[3][pair][c] =
                1e-3 * (run_number(run, "added") + run_number(run, "split") + run_number(run, "removed"));
            sweep->total[pair][c] = sweep->metrics[0][pair][c] + sweep->metrics[1][pair][c];
        }
    }
}

/* The place of the smallest; 0 when none is finite. */
static int smallest(const double *values, int count)
{
    int best = 0;
    for (int i = 1; i < count; ++i) {
        best = values[i] < values[best] || !isfinite(values[best]) ? i : best;
    }
    return best;
}

static int best_pair(const struct sweep *sweep, int c)
{
    double all[PAIRS];
    for (int pair = 0; pair < PAIRS; ++pair) {
        all[pair] = sweep->total[pair][c];
    }
    return smallest(all, PAIRS);
}

/* The picture with, to its right, what the glyphs mean: the shape is W's, the colour H's. */
static void add_pair_legend(struct image *image)
{
    struct image both;
    const struct color ink = color_rgb(0.15f, 0.15f, 0.18f);
    const float left = (float)image->width;
    if (!image_create(&both, image->width + 150, image->height, color_rgb(1.0f, 1.0f, 1.0f))) {
        return;
    }
    image_paste(&both, image, 0, 0);
    for (int pair = 0; pair < PAIRS; ++pair) {
        char text[64];
        const float y = 60.0f + 25.0f * (float)pair;
        image_glyph(&both, pair % W_COUNT, left + 12.0f, y, 8.0f, color_category(pair / W_COUNT));
        image_text(&both, left + 30.0f, y + 4.5f, 9.0f, 0.0f, ink, pair_name(pair, text));
    }
    image_free(image);
    *image = both;
}

static void draw_best(struct paper *paper, const struct sweep *sweep, const char *setting)
{
    double least[CELLS];
    int shapes[CELLS], colors[CELLS];
    char title[120];
    struct image image;
    for (int c = 0; c < CELLS; ++c) {
        const int pair = best_pair(sweep, c);
        least[c] = sweep->total[pair][c];
        shapes[c] = pair % W_COUNT;
        colors[c] = pair / W_COUNT;
    }
    snprintf(title, sizeof title, "Fig. 11: best pair, %s", setting);
    const struct heat_map map = {.title = title, .row_label = "lambda_c", .column_label = "kappa_int",
                                 .value_label = "total error, voxels", .rows = LAMBDAS, .columns = KAPPAS,
                                 .row_names = lambda_names, .column_names = kappa_names,
                                 .values = least, .glyph_shapes = shapes, .glyph_colors = colors};
    if (heat_map_render(&map, 64, &image)) {
        add_pair_legend(&image);
    }
    paper_picture(paper, &image, 560, "fig11.png",
                  "Fig. 11: the least total error of the eight pairs; the glyph is the pair that has it");
}

static void draw_metrics(struct paper *paper, const struct sweep *sweep)
{
    static const int pairs[2] = {PAIR_SPRINGS, PAIR_CHOSEN};
    struct image images[2 * METRICS];
    for (int k = 0; k < 2; ++k) {
        for (int m = 0; m < METRICS; ++m) {
            const double *values = sweep->metrics[m][pairs[k]];
            char title[120], name[64];
            int ring[CELLS];
            for (int c = 0; c < CELLS; ++c) {
                ring[c] = -1;
            }
            ring[smallest(values, CELLS)] = 6;
            snprintf(title, sizeof title, "%s: %s", pair_name(pairs[k], name), metric_names[m]);
            const struct heat_map map = {.title = title, .row_label = "lambda_c", .column_label = "kappa_int",
                                         .rows = LAMBDAS, .columns = KAPPAS, .row_names = lambda_names,
                                         .column_names = kappa_names,
                                         .values = values, .glyph_shapes = ring, .print_values = true};
            heat_map_render(&map, 62, &images[k * METRICS + m]);
        }
    }
    paper_strip(paper, images, NULL, 2 * METRICS, METRICS, 1200, "fig12.png",
                "Fig. 12: four measures, above for H_a with W_a, below for H_b with W_a; a ring marks the least");
}

static void pair_table(struct paper *paper, const struct sweep *sweep)
{
    static struct table table;
    int wins[PAIRS] = {0};
    for (int c = 0; c < CELLS; ++c) {
        ++wins[best_pair(sweep, c)];
    }
    table_begin(&table);
    table_row(&table, "Pair|Least total error|at kappa_int|at lambda_c|Best pair in|Total error at 0.3 and 5|Volume there|"
                      "Runs that lost all springls");
    for (int pair = 0; pair < PAIRS; ++pair) {
        const int best = smallest(sweep->total[pair], CELLS);
        char name[64];
        int lost = 0;
        for (int c = 0; c < CELLS; ++c) {
            lost += !isfinite(sweep->total[pair][c]);
        }
        table_row(&table, "%s|%s|%s|%s|%d of %d|%s|%s|%d", pair_name(pair, name), cell("%.3f", sweep->total[pair][best]),
                  kappa_names[best % KAPPAS], lambda_names[best / KAPPAS], wins[pair], (int)CELLS,
                  cell("%.3f", sweep->total[pair][CHOSEN_CELL]),
                  run_cell(&paper->runs[sweep->runs[pair][CHOSEN_CELL]], "%+.3f %%", "volume_change_percent"), lost);
    }
    paper_table(paper, &table);
}

void paper_fig11(struct paper *paper)
{
    static struct sweep sweep;
    const double period = paper->full ? 2.5 : 1.5;
    const int grid = paper_grid(paper, paper->full ? 128 : 64);
    char setting[60], name[64];
    do_sweep(paper, grid, period, &sweep);
    paper_say(paper, "LeVeque's test, %d^3 voxels and T = %g.\n\n", grid, period);
    pair_table(paper, &sweep);
    const int chosen = smallest(sweep.total[PAIR_CHOSEN], CELLS);
    paper_say(paper, "\nWith H_b and W_a the least total error is %s voxel, at kappa_int %s and lambda_c %s; at the paper's\n"
                     "choice it is %s, where the best pair is %s.\n",
              cell("%.3f", sweep.total[PAIR_CHOSEN][chosen]), kappa_names[chosen % KAPPAS], lambda_names[chosen / KAPPAS],
              cell("%.3f", sweep.total[PAIR_CHOSEN][CHOSEN_CELL]), pair_name(best_pair(&sweep, CHOSEN_CELL), name));
    snprintf(setting, sizeof setting, "%d^3, T = %g", grid, period);
    draw_best(paper, &sweep, setting);
    draw_metrics(paper, &sweep);
}
