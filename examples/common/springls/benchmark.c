#include "springls/benchmark.h"

#include "base/progress.h"
#include "base/threads.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_FRAMES = 16 };

/* One run in progress. */
struct run {
    const struct benchmark *benchmark;
    const struct benchmark_options *options;
    struct benchmark_result result;
    springls_backend *backend;
    springls_context *ctx;
    springls_measures start;
    FILE *series;
    struct model_frame frames[MAX_FRAMES];
    int frames_taken;
    double stage_before[SPRINGLS_STAGE_COUNT];
};

struct benchmark_options benchmark_defaults(void)
{
    struct benchmark_options options;
    memset(&options, 0, sizeof options);
    options.common = cli_common_defaults();
    options.topology = "free";
    options.frames = 5;
    return options;
}

int benchmark_parse(const char *name, const char *summary, struct cli_option own, struct benchmark_options *o, int argc,
                    char **argv)
{
    const struct cli_option options[] = {
        {"steps", CLI_INT, &o->steps, "K",
         "time steps (0: as the paper, with --params paper; else two voxels a step at most)", 0.0, 10000000.0, NULL},
        {"set", CLI_STRING, &o->set, "LIST", RUN_OPTIONS_SET_HELP, 0.0, 0.0, NULL},
        {"topology", CLI_CHOICE, &o->topology, NULL, "may the level set change its topology?", 0.0, 0.0, "free|preserved"},
        {"every-step", CLI_FLAG, &o->every_step, NULL, "count components and the Euler number after every step", 0.0, 0.0, NULL},
        {"series", CLI_OUTPUT, &o->series, "FILE", "write springls and stage times of every step as CSV", 0.0, 0.0, NULL},
        {"processor-time", CLI_FLAG, &o->processor_time, NULL, "times are the processor's, all threads'", 0.0, 0.0, NULL},
        {"frames", CLI_INT, &o->frames, "K", "pictures in the film strip of --out", 2.0, (double)MAX_FRAMES, NULL},
        own,
    };
    char pictures[64];
    snprintf(pictures, sizeof pictures, "%s.png|%s_start_end.png", name, name);
    const struct cli_writes writes[] = {{.files = pictures}};
    const struct cli_program program = {.name = name,
                                        .summary = summary,
                                        .common = &o->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    return cli_parse(&program, argc, argv);
}

static int fail(const struct run *run, const char *what)
{
    return cli_fail(run->benchmark->name, CLI_EXIT_FAILURE, "%s: %s", what, springls_last_error(run->ctx));
}

/* Where the body becomes thinner than a voxel the paper's set loses it: there phi alone decides what is left. */
static int nothing_left(const struct run *run, int done, int calls)
{
    return cli_fail(run->benchmark->name, CLI_EXIT_FAILURE,
                    "nothing is left after %d of %d steps: a finer --grid%s keeps what becomes thinner than a voxel", done, calls,
                    strcmp(run->options->common.params, "paper") == 0 ? ", or --params default," : "");
}

static double processor_clock(void *user)
{
    (void)user;
    return processor_seconds();
}

static double run_seconds(const struct run *run)
{
    return run->options->processor_time ? processor_seconds() : elapsed_seconds();
}

static int make_model(struct run *run)
{
    const struct benchmark *b = run->benchmark;
    springls_params params;
    springls_desc desc;
    const int status = run_options(b->name, &run->options->common, run->options->set, &params);
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (strcmp(run->options->topology, "preserved") == 0) {
        params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    }
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = b->grid;
    desc.params = &params;
    desc.backend = run->backend =
        run_backend_with(b->name, &run->options->common, b->velocity, b->velocity_source, b->flow_bytes);
    snprintf(run->result.backend, sizeof run->result.backend, "%s", run_backend_name(run->backend));
    desc.trace.now = run->options->processor_time ? processor_clock : NULL;
    const int created = run_create(b->name, &desc, &run->ctx);
    if (created != CLI_CONTINUE) {
        return created;
    }
    if (springls_set_implicit(run->ctx, b->shape, b->shape_data) != SPRINGLS_OK
        || springls_measure(run->ctx, &run->start) != SPRINGLS_OK) {
        return fail(run, "start");
    }
    run->result.springls_initial = springls_count(run->ctx);
    run->result.components_min = run->result.components_max = run->start.components;
    run->result.euler_min = run->result.euler_max = run->start.euler;
    return CLI_CONTINUE;
}

static int open_series(struct run *run)
{
    if (!run->options->series) {
        return CLI_CONTINUE;
    }
    run->series = fopen(run->options->series, "w");
    if (!run->series) {
        cli_write_failed(run->benchmark->name, run->options->series);
        return CLI_EXIT_FAILURE;
    }
    fprintf(run->series, "step,time,springls,seconds");
    for (int s = 0; s < SPRINGLS_STAGE_COUNT; ++s) {
        fprintf(run->series, ",%s", springls_stage_name((springls_stage)s));
    }
    fprintf(run->series, run->options->every_step ? ",components,euler\n" : "\n");
    return CLI_CONTINUE;
}

static int minimum(int a, int b) { return a < b ? a : b; }
static int maximum(int a, int b) { return a > b ? a : b; }

/* Writes what --every-step and --series report after a step. */
static bool report_step(struct run *run, int step, double seconds)
{
    struct benchmark_result *r = &run->result;
    springls_measures m;
    memset(&m, 0, sizeof m);
    if (run->options->every_step) {
        if (springls_measure(run->ctx, &m) != SPRINGLS_OK) {
            return false;
        }
        r->components_min = minimum(r->components_min, m.components);
        r->components_max = maximum(r->components_max, m.components);
        r->euler_min = minimum(r->euler_min, m.euler);
        r->euler_max = maximum(r->euler_max, m.euler);
    }
    if (run->series) {
        const springls_stats stats = springls_get_stats(run->ctx);
        fprintf(run->series, "%d,%.9g,%d,%.6f", step, springls_time(run->ctx), stats.springls, seconds);
        for (int s = 0; s < SPRINGLS_STAGE_COUNT; ++s) {
            fprintf(run->series, ",%.6f", stats.seconds[s] - run->stage_before[s]);
            run->stage_before[s] = stats.seconds[s];
        }
        fprintf(run->series, run->options->every_step ? ",%d,%d\n" : "\n", m.components, m.euler);
    }
    return true;
}

/* Takes a picture at every (frames - 1)-th part of the run. */
static bool report_frame(struct run *run, double share)
{
    const int wanted = run->options->frames, k = run->frames_taken;
    char caption[48];
    const double due = (double)k / (wanted - 1), turns = run->benchmark->duration / run->benchmark->period;
    if (!run->options->common.out || k >= wanted || share < due - 1e-9) {
        return true;
    }
    if (run->benchmark->reverses) {
        snprintf(caption, sizeof caption, k == 0 ? "t = 0" : k == wanted - 1 ? "t = T" : "t = %.3g T", due * turns);
    } else {
        snprintf(caption, sizeof caption, "%.0f degrees", 360.0 * due * turns);
    }
    run->frames_taken++;
    return model_frame_take(run->ctx, caption, &run->frames[k]);
}

enum { PARTS = 24 };

/* Returns the number of calls of a run: one a step, or fixed parts in which the library chooses its steps. */
static int calls_of(const struct benchmark *b)
{
    return b->steps > 0 ? b->steps : PARTS;
}

/* Adds the device's work between two counts. */
static void count_work(struct benchmark_result *result, springls_cl_counts before, springls_cl_counts after)
{
    result->kernels_per_step += (double)(after.kernels - before.kernels);
    result->downloads_per_step += (double)(after.downloads - before.downloads);
    result->bytes_down_per_step += (double)(after.bytes_down - before.bytes_down);
}

/* Measures the coverage at every 24th part of a run. */
static bool measure_coverage(struct run *run, int call, int calls)
{
    const int every = calls > PARTS ? calls / PARTS : 1;
    return call % every != 0 || coverage_add(run->ctx, &run->result.coverage);
}

static int take_steps(struct run *run)
{
    const struct benchmark *b = run->benchmark;
    const int calls = calls_of(b);
    springls_forces forces;
    springls_step_desc step;
    struct progress progress;
    double springls = 0.0;
    memset(&forces, 0, sizeof forces);
    forces.velocity = b->velocity;
    forces.user = b->flow;
    memset(&step, 0, sizeof step);
    step.forces = &forces;
    step.dt = (float)(b->duration / calls);
    step.max_displacement = b->steps > 0 ? -1.0f : 2.0f;
    if (!report_frame(run, 0.0)) {
        return fail(run, "picture");
    }
    progress_begin(&progress, b->name, (size_t)calls, run->options->common.quiet);
    for (int k = 1; k <= calls; ++k) {
        springls_set_time(run->ctx, b->duration * (k - 1) / calls);
        const springls_cl_counts before = springls_cl_get_counts(run->backend);
        const double started = run_seconds(run);
        const springls_status status = springls_step(run->ctx, &step);
        if (status != SPRINGLS_OK) {
            progress_end(&progress);
            return status == SPRINGLS_EMPTY_MODEL ? nothing_left(run, k - 1, calls) : fail(run, "step");
        }
        const double seconds = run_seconds(run) - started;
        run->result.seconds_total += seconds;
        count_work(&run->result, before, springls_cl_get_counts(run->backend));
        springls += springls_count(run->ctx);
        if (k == calls / 2) {
            run->result.halfway = benchmark_flow_error(b, b->duration * k / calls, springls_view_particles(run->ctx),
                                                       springls_view_correspondences(run->ctx));
        }
        if (!measure_coverage(run, k, calls) || !report_step(run, k, seconds) || !report_frame(run, (double)k / calls)) {
            progress_end(&progress);
            return fail(run, "report");
        }
        progress_update(&progress, (size_t)k, NULL);
    }
    progress_end(&progress);
    run->result.springls_mean = springls / calls;
    const double steps = springls_get_stats(run->ctx).steps;
    run->result.kernels_per_step /= steps;
    run->result.downloads_per_step /= steps;
    run->result.bytes_down_per_step /= steps;
    return CLI_CONTINUE;
}

static int measure_end(struct run *run)
{
    const struct benchmark *b = run->benchmark;
    struct benchmark_result *r = &run->result;
    springls_measures end;
    springls_mesh mesh;
    r->deformation = benchmark_deformation(b, springls_view_particles(run->ctx));
    r->tracking = benchmark_tracking(springls_view_particles(run->ctx), springls_view_correspondences(run->ctx));
    r->springls_final = springls_count(run->ctx);
    r->state_hash = springls_state_hash(run->ctx);
    r->stats = springls_get_stats(run->ctx);
    r->steps = r->stats.steps;
    r->model_bytes = springls_memory_used(run->ctx);
    memcpy(r->seconds_stage, r->stats.seconds, sizeof r->seconds_stage);
    if (springls_measure(run->ctx, &end) != SPRINGLS_OK || springls_extract_mesh(run->ctx, &mesh) != SPRINGLS_OK) {
        return fail(run, "end");
    }
    const springls_view vertices = {mesh.positions, mesh.vertex_count, 3 * sizeof(float)};
    const bool empty = mesh.triangle_count == 0;
    r->surface = benchmark_deformation(b, vertices);
    springls_mesh_free(run->ctx, &mesh);
    if (empty) {
        return nothing_left(run, r->steps, r->steps);
    }
    r->volume_change_percent = 100.0 * (end.volume / run->start.volume - 1.0);
    r->volume_error_percent = 100.0 * (end.volume / b->shape_volume - 1.0);
    r->components = end.components;
    r->euler = end.euler;
    r->threads = threads_count();
    return CLI_CONTINUE;
}

static int write_pictures(const struct run *run)
{
    const struct benchmark *b = run->benchmark;
    char path[1024], name[64];
    struct model_view view;
    if (!run->options->common.out) {
        return CLI_CONTINUE;
    }
    memset(&view, 0, sizeof view);
    memcpy(view.direction, b->view, sizeof view.direction);
    memcpy(view.up, b->up, sizeof view.up);
    view.by_correspondence = true;
    view.follow = !b->reverses;
    view.height = b->reverses ? 300 : 0;
    snprintf(name, sizeof name, "%s.png", b->name);
    run_path(run->options->common.out, name, path, sizeof path);
    if (!model_film_write(run->frames, run->frames_taken, &view, path)) {
        cli_write_failed(b->name, path);
        return CLI_EXIT_FAILURE;
    }
    /* Write the first and the last frame alone, larger. */
    const struct model_frame ends[2] = {run->frames[0], run->frames[run->frames_taken - 1]};
    view.width = view.height = 640;
    snprintf(name, sizeof name, "%s_start_end.png", b->name);
    run_path(run->options->common.out, name, path, sizeof path);
    return model_film_write(ends, 2, &view, path) || cli_write_failed(b->name, path) ? CLI_CONTINUE : CLI_EXIT_FAILURE;
}

static int run_all(struct run *run)
{
    const bool json_on_stdout = run->options->common.json && strcmp(run->options->common.json, "-") == 0;
    int status = make_model(run);
    status = status == CLI_CONTINUE ? open_series(run) : status;
    status = status == CLI_CONTINUE ? take_steps(run) : status;
    status = status == CLI_CONTINUE ? measure_end(run) : status;
    status = status == CLI_CONTINUE ? write_pictures(run) : status;
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (run->options->common.json && !benchmark_write_json(run->benchmark, run->options, &run->result)) {
        cli_write_failed(run->benchmark->name, run->options->common.json);
        return CLI_EXIT_FAILURE;
    }
    if (!json_on_stdout && !run->options->common.quiet) {
        benchmark_print_table(run->benchmark, run->options, &run->result);
    }
    return CLI_EXIT_OK;
}

int benchmark_main(const struct benchmark *benchmark, const struct benchmark_options *options)
{
    static struct run run;
    memset(&run, 0, sizeof run);
    run.benchmark = benchmark;
    run.options = options;
    int status = run_all(&run);
    for (int f = 0; f < run.frames_taken; ++f) {
        model_frame_free(run.ctx, &run.frames[f]);
    }
    if (run.series && fclose(run.series) != 0 && status == CLI_EXIT_OK) {
        cli_write_failed(benchmark->name, options->series);
        status = CLI_EXIT_FAILURE;
    }
    springls_destroy(run.ctx);
    springls_cl_destroy(run.backend);
    return status;
}
