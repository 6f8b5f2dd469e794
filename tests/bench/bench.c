/* bench - springls beside OpenVDB's level set on the same problems in the same run, and what the library costs to compile,
 * to hold and to run on two threads. One process at a time.
 *
 *   GRID=64 make bench      another grid than 128^3
 *   FULL=1 make bench       LeVeque's test on 512^3 and 1024^3 as well: hours
 *   CC=clang make bench     the compiler of the compile-time rows
 *   ONLY=opencl, ONLY=frames, ONLY=queries   that table alone
 *   HEAD_SCAN, HEAD_LEVEL   the image that segment's row is about, and its level; without them the row is left out
 *   ONLY=cover              how well springls cover the surface, alone (make coverage)
 *
 * Prints tables; build/bench/bench.json has the same numbers and every program's own JSON. */
#define _POSIX_C_SOURCE 200809L
#include "runs.h"
#include "table.h"

#include "examples/common/base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { METHODS = 3, MEMORY_ROWS = 3, MAX_RUNS = 64 };

/* The goals, for the tables' column "wanted". */
static const double implementation_seconds = 4.0; /* of a program's build, once: nobody should mind waiting for it */
static const double declarations_seconds = 0.05;  /* of every file that includes the header: not to be noticed */
static const double model_mib = 120.0;            /* at 512^3: less than a quarter of one dense grid of floats (512 MiB) */

static const char *const folder = "build/bench/runs";
static const char *const method_names[METHODS] = {"springls, paper's parameters", "springls, default parameters",
                                                   "OpenVDB level set"};

struct bench {
    int grid;
    struct run runs[MAX_RUNS];
    int run_count;
    double compile_seconds[2]; /* implementation, declarations */
};

/* The next run of the list, named and ready for its command. */
static struct run *new_run(struct bench *bench, const char *name, int number)
{
    struct run *run = &bench->runs[bench->run_count++];
    run_name(run, "%s_%d", name, number);
    return run;
}

static bool execute(struct run *run)
{
    const struct run_options options = {.folder = folder, .label = "bench", .at_once = 1};
    return runs_do(run, 1, &options) == 0;
}

/* ---- accuracy and time ---- */

static void problem_row(struct table *table, const struct run *run, const char *method, const struct run *openvdb)
{
    const bool tracks = isfinite(run_number(run, "tracking_mean"));
    const double seconds = run_number(run, "seconds_total");
    if (!run->json) {
        table_row(table, "%s|failed", method);
        return;
    }
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", method, cell("%.1f s", seconds),
              cell("%.0f", run_number(run, "steps") / seconds), cell("%.1f s", run->cpu),
              cell2("%.2f x / %.2f x", run_number(openvdb, "seconds_total") / seconds, openvdb->cpu / run->cpu),
              run_cell(run, "%+.3f %%", "volume_change_percent"), run_cell(run, "%+.3f %%", "volume_error_percent"),
              cell2("%.3f / %.2f", run_number(run, "surface_mean"), run_number(run, "surface_max")),
              tracks ? cell2("%.3f / %.2f", run_number(run, "tracking_mean"), run_number(run, "tracking_max")) : "cannot",
              run_cell(run, "%.0f", "components"), run_cell(run, "%.0f MiB", "peak_rss_mib"));
}

/* The methods, from the `first_method` on, one after the other on one problem. Their runs are the list's last ones afterwards. */
static void compare_on(struct bench *bench, const char *problem, int grid, const char *length, int first_method)
{
    static struct table table;
    const char *option = strcmp(problem, "leveque") == 0 ? "--period" : "--revolutions";
    const int first_run = bench->run_count;
    for (int m = first_method; m < METHODS; ++m) {
        static const char *const names[METHODS] = {"paper", "default", "openvdb"};
        char name[RUN_NAME];
        snprintf(name, sizeof name, "%s_%s", problem, names[m]);
        struct run *run = new_run(bench, name, grid);
        if (m < 2) {
            run_command(run, "build/%s --grid %d --params %s %s %s --threads 1 --quiet --json -", problem, grid,
                        names[m], option, length);
        } else {
            run_command(run, "build/bench/openvdb_advection %s %d %s", problem, grid, length);
        }
        execute(run);
    }
    table_begin(&table);
    table_row(&table, "%s %d^3, %s %s|time|steps a second|processor|OpenVDB's time / processor to this|volume change|volume error|"
                      "surface mean / max|"
                      "tracking mean / max|parts|peak memory", problem, grid, option + 2, length);
    for (int m = first_method; m < METHODS; ++m) {
        problem_row(&table, &bench->runs[first_run + m - first_method], method_names[m], &bench->runs[bench->run_count - 1]);
    }
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- the default parameters on other grids and longer ways ---- */

struct problem {
    int grid;
    const char *period;
    bool full;
};

static const struct problem problems[] = {
    {64, "2.5", false}, {64, "4", false},   {100, "1.6", false}, {128, "2.5", false}, {128, "3", false},
    {200, "1.6", false}, {256, "2.5", false}, {512, "2.5", true}, {1024, "2.5", true},
};

/* A step's time grows as the grid's side to this power, which is 2 where each springl costs the same; NAN: a run is missing. */
static double exponent(const struct run *small, const struct run *large)
{
    const double a = run_number(small, "seconds_total") / run_number(small, "steps");
    const double b = run_number(large, "seconds_total") / run_number(large, "steps");
    return log(b / a) / log(run_number(large, "grid") / run_number(small, "grid"));
}

static void default_problems(struct bench *bench, bool full)
{
    static struct table table;
    const struct run *last = NULL; /* of period 2.5 */
    char exponents[TABLE_CELL] = "";
    table_begin(&table);
    table_row(&table,
              "leveque, default parameters, 2 threads|deformation mean / max|tracking mean / max|halfway mean / max|surface mean / max|"
              "volume change|parts, Euler|springls|steps|time|ms a step|peak memory");
    for (size_t i = 0; i < sizeof problems / sizeof *problems; ++i) {
        const struct problem *p = &problems[i];
        if (p->full && !full) {
            continue;
        }
        struct run *run = new_run(bench, "leveque_beyond", (int)i);
        run_command(run, "build/leveque --grid %d --period %s --params default --threads 2 --quiet --json -", p->grid, p->period);
        execute(run);
#define PAIR(name) cell2("%.4f / %.2f", run_number(run, name "_mean"), run_number(run, name "_max"))
        table_row(&table, "%d^3, period %s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", p->grid, p->period, PAIR("deformation"),
                  PAIR("tracking"), PAIR("halfway"), PAIR("surface"), run_cell(run, "%+.3f %%", "volume_change_percent"),
                  cell2("%.0f, %.0f", run_number(run, "components"), run_number(run, "euler")), run_cell(run, "%.0f", "springls_mean"),
                  run_cell(run, "%.0f", "steps"), run_cell(run, "%.1f s", "seconds_total"),
                  cell("%.2f", 1e3 * run_number(run, "seconds_total") / run_number(run, "steps")),
                  run_cell(run, "%.0f MiB", "peak_rss_mib"));
#undef PAIR
        if (strcmp(p->period, "2.5") == 0) {
            const size_t used = strlen(exponents);
            if (last) {
                snprintf(exponents + used, sizeof exponents - used, "%s%s to %d^3", used ? ", " : "",
                         cell("%.2f", exponent(last, run)), p->grid);
            }
            last = run;
        }
    }
    table_print(&table, stdout);
    printf("A step's time grows as the grid's side to the power (period 2.5) %s.\n\n", exponents);
    fflush(stdout);
}

/* ---- where the time goes ---- */

/* Bytes a second that a = b + s c moves, of arrays that no cache holds. */
static double triad_bandwidth(void)
{
    enum { COUNT = 16 * 1024 * 1024, TIMES = 5 };
    float *a = malloc(COUNT * sizeof *a), *b = malloc(COUNT * sizeof *b), *c = malloc(COUNT * sizeof *c);
    double best = INFINITY;
    if (a && b && c) {
        for (int i = 0; i < COUNT; ++i) {
            a[i] = 0.0f;
            b[i] = 1.0f;
            c[i] = (float)i;
        }
        for (int k = 0; k < TIMES; ++k) {
            const double start = elapsed_seconds();
            for (int i = 0; i < COUNT; ++i) {
                a[i] = b[i] + 0.5f * c[i];
            }
            best = fmin(best, elapsed_seconds() - start);
        }
    }
    const double sum = a ? (double)a[COUNT / 2] : 0.0;
    free(a), free(b), free(c);
    return sum > 0.0 ? 3.0 * COUNT * sizeof(float) / best : NAN;
}

static void stages(const struct run *run)
{
    static const char *const names[] = {"advect", "relax", "contract", "resample", "project", "keep_edges", "fill_gaps"};
    static struct table table;
    const double steps = run_number(run, "steps"), springls = run_number(run, "springls_mean"), all = run_number(run, "seconds_total");
    const double bandwidth = triad_bandwidth(), model = run_number(run, "model_mib") * 1048576.0;
    table_begin(&table);
    table_row(&table, "a step of leveque, default parameters, one thread|ms|ns a springl|share");
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        char key[40];
        snprintf(key, sizeof key, "seconds_stage.%s", names[i]);
        const double seconds = run_number(run, key);
        table_row(&table, "%s|%s|%s|%s", names[i], cell("%.3f", 1e3 * seconds / steps), cell("%.0f", 1e9 * seconds / steps / springls),
                  cell("%.0f %%", 100.0 * seconds / all));
    }
    table_row(&table, "all|%s|%s|", cell("%.3f", 1e3 * all / steps), cell("%.0f", 1e9 * all / steps / springls));
    table_print(&table, stdout);
    printf("Once through the whole model, %.1f MiB, at this machine's %.1f GB/s (triad) would be %.2f ms: a step is %.0f %% of what\n"
           "memory allows. The model fits the caches: arithmetic and latency set the time.\n\n", model / 1048576.0, 1e-9 * bandwidth,
           1e3 * model / bandwidth, 100.0 * model / bandwidth / (all / steps));
    fflush(stdout);
}

/* ---- compile time ---- */

static double fastest_of(int times, const char *command)
{
    double best = INFINITY;
    for (int i = 0; i < times; ++i) {
        const double start = elapsed_seconds();
        if (system(command) != 0) {
            return NAN;
        }
        best = fmin(best, elapsed_seconds() - start);
    }
    return best;
}

static void compile_times(struct bench *bench)
{
    const char *compiler = getenv("CC") && getenv("CC")[0] ? getenv("CC") : "cc";
    static struct table table;
    char command[400];
    double empty;
    snprintf(command, sizeof command, "echo '#include <stdio.h>' | %s -std=c99 -O2 -x c -c -o build/bench/empty.o -",
             compiler);
    empty = fastest_of(5, command);
    snprintf(command, sizeof command, "echo '#include \"springls.h\"' | %s -std=c99 -O2 -I. -DSPRINGLS_IMPLEMENTATION "
                                      "-x c -c -o build/bench/implementation.o -", compiler);
    bench->compile_seconds[0] = fastest_of(2, command);
    snprintf(command, sizeof command, "echo '#include \"springls.h\"' | %s -std=c99 -O2 -I. -x c -c "
                                      "-o build/bench/declarations.o -", compiler);
    bench->compile_seconds[1] = fastest_of(5, command);
    table_begin(&table);
    table_row(&table, "compiling springls.h, %s -O2|time|wanted", compiler);
    table_row(&table, "implementation|%s|%s", cell("%.2f s", bench->compile_seconds[0]),
              cell("%g s at most", implementation_seconds));
    table_row(&table, "declarations only|%s|%s", cell("%.3f s", bench->compile_seconds[1]),
              cell("%g s at most", declarations_seconds));
    table_row(&table, "a file with stdio.h alone|%s|", cell("%.3f s", empty));
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- memory ---- */

static void memory(struct bench *bench)
{
    static const int grids[MEMORY_ROWS] = {128, 256, 512};
    static const char *const radii[MEMORY_ROWS] = {"19.2", "38.4", "77"};
    static struct table table;
    table_begin(&table);
    table_row(&table, "a model with a sphere|springls|bricks of 8^3|empty|model|peak of the process|set up|wanted");
    for (int i = 0; i < MEMORY_ROWS; ++i) {
        struct run *run = new_run(bench, "memory", grids[i]);
        run_command(run, "build/bench/memory %d %s", grids[i], radii[i]);
        execute(run);
        table_row(&table, "%d^3, radius %s|%s|%s|%s|%s|%s|%s|%s", grids[i], radii[i], run_cell(run, "%.0f", "springls"),
                  run_cell(run, "%.0f", "bricks"), run_cell(run, "%.2f MiB", "empty_mib"),
                  run_cell(run, "%.1f MiB", "model_mib"), run_cell(run, "%.1f MiB", "peak_rss_mib"),
                  run_cell(run, "%.2f s", "seconds_total"),
                  grids[i] == 512 ? cell("less than %g MiB", model_mib) : "");
    }
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- threads ---- */

/* One against two, the one-thread run being of before. */
static void threads(struct bench *bench, const struct run *one)
{
    static struct table table;
    const int grid = (int)run_number(one, "grid");
    struct run *two = new_run(bench, "leveque_default_two_threads", grid);
    run_command(two, "build/leveque --grid %d --params default --period 2.5 --threads 2 --quiet --json -", grid);
    execute(two);
    char hash_one[32], hash_two[32];
    run_text(one, "state_hash", hash_one, sizeof hash_one);
    run_text(two, "state_hash", hash_two, sizeof hash_two);
    const double seconds_one = run_number(one, "seconds_total"), seconds_two = run_number(two, "seconds_total");
    table_begin(&table);
    table_row(&table, "leveque %d^3, default parameters|time|speed-up|result", grid);
    table_row(&table, "%s thread|%s||%s", run_cell(one, "%.0f", "threads"), cell("%.1f s", seconds_one), hash_one);
    table_row(&table, "%s threads|%s|%s|%s", run_cell(two, "%.0f", "threads"), cell("%.1f s", seconds_two),
              cell("%.2f x", seconds_one / seconds_two),
              hash_one[0] && strcmp(hash_one, hash_two) == 0 ? "the same bits" : "DIFFERENT");
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- frames ---- */

static const int frame_grids[] = {64, 128, 256};
enum { FRAME_GRIDS = sizeof frame_grids / sizeof *frame_grids };

/* Returns the run of build/bench/frames for a grid and number of threads, which is made once for all tables. */
static struct run *frames_run(struct bench *bench, int grid, int threads)
{
    char name[RUN_NAME];
    snprintf(name, sizeof name, "frames_%d", 10 * grid + threads);
    for (int i = 0; i < bench->run_count; ++i) {
        if (strcmp(bench->runs[i].name, name) == 0) {
            return &bench->runs[i];
        }
    }
    struct run *run = new_run(bench, "frames", 10 * grid + threads);
    run_command(run, "build/bench/frames %d %d", grid, threads);
    execute(run);
    return run;
}

/* A brush that pushes a ball, as in build/viewer: step and changed chunks. */
static void push_row(struct bench *bench, int grid, int threads, struct table *table)
{
    const struct run *run = frames_run(bench, grid, threads);
    table_row(table, "push %d^3|%d|%s|%s|%s|%s|%s|%s|%s|%s|%s", grid, threads, run_cell(run, "%.0f", "springls"),
              run_cell(run, "%.1f ms", "frame_ms.p50"), run_cell(run, "%.1f ms", "frame_ms.p95"), run_cell(run, "%.1f ms", "chunks_ms.p50"),
              run_cell(run, "%.1f ms", "contours_ms.p50"), run_cell(run, "%.1f ms", "processor_ms.p50"),
              run_cell(run, "%.0f %%", "chunks_percent.p50"), run_cell(run, "%.4f ms", "rest_ms.p50"),
              run_number(run, "frame_ms.p50") <= 1e3 / 60.0 ? "yes" : "no");
}

/* Balls cut out of a model at rest, one a frame. */
static void cut_row(struct bench *bench, int grid, int threads, struct table *table)
{
    const struct run *run = frames_run(bench, grid, threads);
    table_row(table, "cut %d^3|%d|%s|%s|%s|%s|%s", grid, threads, run_cell(run, "%.0f", "springls"),
              run_cell(run, "%.1f ms", "cut_ms.p50"), run_cell(run, "%.1f ms", "cut_ms.p95"),
              run_cell(run, "%.1f ms", "cut_frame_ms.p50"), run_cell(run, "%.1f ms", "cut_frame_ms.p95"));
}

/* What calls with a budget of 2 ms take. */
static void budget_row(struct bench *bench, int grid, int threads, struct table *table)
{
    if (threads > 1) {
        return;
    }
    const struct run *run = frames_run(bench, grid, threads);
    static const char *const kinds[] = {"step", "chunks", "material"};
    static const char *const names[] = {"a step", "its chunks", "its chunks with correspondences"};
    for (int k = 0; k < 3; ++k) {
        char call[3][32], whole[3][32];
        static const char *const shares[] = {"p50", "p95", "max"};
        for (int s = 0; s < 3; ++s) {
            snprintf(call[s], sizeof call[s], "%s_call_ms.%s", kinds[k], shares[s]);
            snprintf(whole[s], sizeof whole[s], "%s_whole_ms.%s", kinds[k], shares[s]);
        }
        table_row(table, "flow %d^3, %s|%s|%s|%s|%s|%s|%s", grid, names[k], run_cell(run, "%.1f ms", call[0]),
                  run_cell(run, "%.1f ms", call[1]), run_cell(run, "%.1f ms", call[2]), run_cell(run, "%.1f ms", whole[0]),
                  run_cell(run, "%.1f ms", whole[1]), run_cell(run, "%.1f ms", whole[2]));
    }
}

/* The first frames of build/morph's own pair: skinning, the target in its pose, steps of the contour. */
static void morph_row(struct bench *bench, int grid, int threads, struct table *table)
{
    struct run *run = new_run(bench, "morph", 10 * grid + threads);
    run_command(run, "build/morph --grid %d --threads %d --frames 4 --quiet --json -", grid, threads);
    execute(run);
    table_row(table, "morph %d^3|%d|%s|%s|%s|%s", grid, threads, run_cell(run, "%.2f s", "seconds_a_frame"),
              run_cell(run, "%.2f s", "seconds_a_frame_skinning"), run_cell(run, "%.2f s", "seconds_a_frame_target"),
              run_cell(run, "%.2f s", "seconds_a_frame_contour"));
}

static void frames(struct bench *bench)
{
    static const struct {
        const char *head;
        void (*row)(struct bench *bench, int grid, int threads, struct table *table);
    } tasks[] = {
        {"a frame|threads|springls|p50|p95|of which chunks, p50|chunks of what springls hold, p50|processor, p50|chunks that change|at "
         "rest|60 a second",
         push_row},
        {"a ball is cut out|threads|springls|the call, p50|p95|with a step and its chunks, p50|p95", cut_row},
        {"calls of 2 ms|p50|p95|longest|together, p50|p95|longest", budget_row},
        {"a frame|threads|mean|skinning|target|contour", morph_row},
    };
    static struct table table;
    for (size_t t = 0; t < sizeof tasks / sizeof *tasks; ++t) {
        table_begin(&table);
        table_row(&table, "%s", tasks[t].head);
        for (int g = 0; g < FRAME_GRIDS; ++g) {
            for (int threads = 1; threads <= 2; ++threads) {
                tasks[t].row(bench, frame_grids[g], threads, &table);
            }
        }
        table_print(&table, stdout);
        printf("\n");
        fflush(stdout);
    }
}

/* ---- segment ---- */

/* A step of an active contour in an image: of pressure, so that every step is whole. */
static void segment(struct bench *bench)
{
    const char *scan = getenv("HEAD_SCAN"), *level = getenv("HEAD_LEVEL");
    static struct table table;
    if (!scan || !level) {
        return;
    }
    char word[1024];
    run_word(scan, word, sizeof word);
    table_begin(&table);
    table_row(&table, "segment, the packaged brain|threads|springls, mean|steps|time|ms a step|ns a springl|"
                      "processor, whole command");
    for (int threads = 1; threads <= 2; ++threads) {
        struct run *run = new_run(bench, "segment", threads);
        run_command(run, "build/segment %s --level %s --grid 128 --threads %d --quiet --json -", word, level, threads);
        execute(run);
        const double seconds = run_number(run, "seconds"), steps = run_number(run, "steps");
        table_row(&table, "grid 128|%d|%s|%s|%s|%s|%s|%s", threads, run_cell(run, "%.0f", "springls_mean"),
                  run_cell(run, "%.0f", "steps"),
                  cell("%.1f s", seconds), cell("%.1f", 1e3 * seconds / steps),
                  cell("%.0f", 1e9 * seconds / steps / run_number(run, "springls_mean")), cell("%.1f s", run->cpu));
    }
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- queries ---- */

/* Rays and closest points of the watertight surface beside those of the springls, whose hierarchy is built after every step. */
static void queries(struct bench *bench, int grid)
{
    static const char *const names[][3] = {{"the first ray after a step", "first_ms", "%.2f ms"},
                                           {"each further ray", "ray.ns", "%.0f ns"},
                                           {"of the rays aimed inside, hit", "ray.found_percent", "%.1f %%"},
                                           {"a closest point, from 2 voxels at most", "near_point.ns", "%.0f ns"},
                                           {"a closest point, from anywhere", "far_point.ns", "%.0f ns"}};
    static struct table table;
    struct run *run = new_run(bench, "queries", grid);
    run_command(run, "build/bench/queries %d", grid);
    execute(run);
    table_begin(&table);
    table_row(&table, "queries, %d^3, %s springls|watertight|springls alone", grid, run_cell(run, "%.0f", "springls"));
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        char watertight[48], soup[48];
        snprintf(watertight, sizeof watertight, "watertight.%s", names[i][1]);
        snprintf(soup, sizeof soup, "soup.%s", names[i][1]);
        table_row(&table, "%s|%s|%s", names[i][0], run_cell(run, names[i][2], watertight), run_cell(run, names[i][2], soup));
    }
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- coverage ---- */

static void coverage_row(struct table *table, struct run *run, const char *name)
{
    execute(run);
    table_row(table, "%s|%s|%s|%s|%s|%s", name, cell("%.1f %%", 100.0 * run_number(run, "covered_mean")),
              cell("%.1f %%", 100.0 * run_number(run, "covered_min")), cell("%.1f %%", 100.0 * run_number(run, "covered_twice_max")),
              cell2("%.2f to %.2f", run_number(run, "coverage_min"), run_number(run, "coverage_max")),
              run_cell(run, "%.0f", "springls_mean"));
}

static void coverage(struct bench *bench, bool full)
{
    static const char *const periods[] = {"1.6", "2.5", "3"};
    static struct table table;
    const char *scan = getenv("HEAD_SCAN"), *level = getenv("HEAD_LEVEL");
    table_begin(&table);
    table_row(&table, "coverage|covered, mean|least|covered twice, most|area of the springls over the surface's|springls");
    for (int grid = 64; grid <= (full ? 256 : 128); grid *= 2) {
        for (size_t p = 0; p < sizeof periods / sizeof *periods; ++p) {
            struct run *run = new_run(bench, "leveque_coverage", 10 * grid + (int)p);
            run_command(run, "build/leveque --grid %d --period %s --params default --quiet --json -", grid, periods[p]);
            char name[TABLE_CELL];
            snprintf(name, sizeof name, "leveque %d^3, period %s", grid, periods[p]);
            coverage_row(&table, run, name);
        }
    }
    struct run *zalesak = new_run(bench, "zalesak_coverage", bench->grid);
    run_command(zalesak, "build/zalesak --grid %d --params default --quiet --json -", bench->grid);
    char name[TABLE_CELL];
    snprintf(name, sizeof name, "zalesak %d^3", bench->grid);
    coverage_row(&table, zalesak, name);
    if (scan && level) {
        char word[1024];
        struct run *brain = new_run(bench, "segment_coverage", 1);
        run_command(brain, "build/segment %s --level %s --grid 128 --quiet --json -", run_word(scan, word, sizeof word), level);
        coverage_row(&table, brain, "brain, segment");
    }
    table_print(&table, stdout);
    printf("\n");
    fflush(stdout);
}

/* ---- OpenCL ---- */

/* The same run by scalar code on two threads and by OpenCL, stage by stage. Kernels are compiled by a short run before. */
static void opencl(struct bench *bench, int grid)
{
    static const char *const names[] = {"advect", "relax", "contract", "resample", "project", "keep_edges", "fill_gaps"};
    static const char *const backends[] = {"scalar", "opencl"};
    static struct table table;
    char device[256], hash[2][32];
    struct run *runs[2], *warm = new_run(bench, "leveque_opencl_warm", grid);
    run_command(warm, "build/leveque --grid %d --params default --period 0.2 --backend opencl --quiet --json -", grid);
    execute(warm);
    for (int b = 0; b < 2; ++b) {
        runs[b] = new_run(bench, b ? "leveque_opencl" : "leveque_scalar_two_threads", grid);
        run_command(runs[b], "build/leveque --grid %d --params default --period 2.5 --threads 2 --backend %s --quiet --json -", grid,
                    backends[b]);
        execute(runs[b]);
        run_text(runs[b], "state_hash", hash[b], sizeof hash[b]);
    }
    run_text(runs[1], "backend", device, sizeof device);
    table_begin(&table);
    table_row(&table, "leveque %d^3, default parameters|scalar, 2 threads|OpenCL|scalar over OpenCL", grid);
    for (size_t i = 0; i <= sizeof names / sizeof *names; ++i) {
        const bool all = i == sizeof names / sizeof *names;
        char key[40];
        snprintf(key, sizeof key, all ? "seconds_total" : "seconds_stage.%s", all ? "" : names[i]);
        const double scalar = run_number(runs[0], key), seconds = run_number(runs[1], key);
        table_row(&table, "%s|%s|%s|%s", all ? "all" : names[i], cell("%.2f s", scalar), cell("%.2f s", seconds),
                  cell("%.2f x", scalar / seconds));
    }
    table_print(&table, stdout);
    printf("%s; %s. A step: %.0f kernels, %.0f times something is read back, %.0f bytes in all.\n\n", device,
           hash[0][0] && strcmp(hash[0], hash[1]) == 0 ? "the same bits" : "other bits", run_number(runs[1], "kernels_per_step"),
           run_number(runs[1], "downloads_per_step"), run_number(runs[1], "bytes_down_per_step"));
    fflush(stdout);
}

static bool write_json(const struct bench *bench)
{
    struct json_writer json;
    if (!json_open(&json, "build/bench/bench.json")) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", bench->grid);
    json_number(&json, "compile_implementation_seconds", bench->compile_seconds[0]);
    json_number(&json, "compile_declarations_seconds", bench->compile_seconds[1]);
    runs_json(bench->runs, bench->run_count, &json);
    return json_close(&json);
}

int main(void)
{
    static struct bench bench;
    int failures = 0;
    bench.grid = getenv("GRID") && getenv("GRID")[0] ? atoi(getenv("GRID")) : 128;
    if (bench.grid < 16 || bench.grid > 512) {
        fprintf(stderr, "bench: GRID must be between 16 and 512\n");
        return 2;
    }
    printf("One thread each unless noted; lengths in voxels. Time is the wall's, processor time that of the whole\n"
           "process with set-up and measuring: where the two differ much, something else was running. Surface and volume are\n"
           "those of each method's own mesh; volume error is against the exact shape, volume change against the mesh at the\n"
           "start.\n\n");
    fflush(stdout);
    if (getenv("ONLY") && strcmp(getenv("ONLY"), "opencl") == 0) {
        opencl(&bench, bench.grid);
        runs_free(bench.runs, bench.run_count);
        return 0;
    }
    if (getenv("ONLY") && strcmp(getenv("ONLY"), "frames") == 0) {
        frames(&bench);
        runs_free(bench.runs, bench.run_count);
        return 0;
    }
    if (getenv("ONLY") && strcmp(getenv("ONLY"), "cover") == 0) {
        coverage(&bench, getenv("FULL") && getenv("FULL")[0] == '1');
        runs_free(bench.runs, bench.run_count);
        return 0;
    }
    if (getenv("ONLY") && strcmp(getenv("ONLY"), "queries") == 0) {
        queries(&bench, bench.grid);
        runs_free(bench.runs, bench.run_count);
        return 0;
    }
    compile_times(&bench);
    memory(&bench);
    const int leveque = bench.run_count;
    compare_on(&bench, "leveque", bench.grid, "2.5", 0);
    compare_on(&bench, "zalesak", bench.grid, "1", 0);
    stages(&bench.runs[leveque + 1]);
    threads(&bench, &bench.runs[leveque + 1]);
    const int twice = bench.run_count;
    compare_on(&bench, "leveque", 2 * bench.grid, "2.5", 1);
    threads(&bench, &bench.runs[twice]);
    frames(&bench);
    segment(&bench);
    queries(&bench, bench.grid);
    opencl(&bench, bench.grid);
    opencl(&bench, 2 * bench.grid);
    default_problems(&bench, getenv("FULL") && getenv("FULL")[0] == '1');
    for (int i = 0; i < bench.run_count; ++i) {
        failures += bench.runs[i].json == NULL;
    }
    if (!write_json(&bench)) {
        fprintf(stderr, "bench: cannot write build/bench/bench.json\n");
        ++failures;
    }
    runs_free(bench.runs, bench.run_count);
    return failures > 0;
}
