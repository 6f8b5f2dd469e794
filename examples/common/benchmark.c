#define _POSIX_C_SOURCE 200809L

#include "benchmark.h"

#include "image.h"
#include "json.h"
#include "progress.h"
#include "raycast.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#ifdef _OPENMP
#include <omp.h>
#endif

enum { FRAMES = 5, FRAME_SIZE = 440, FLOW_STEPS = 400 };

/* ---- parameters by name ---- */

static const struct {
    const char *name;
    bool is_float;
    size_t offset;
} members[] = {
#define REAL(name) {#name, true, offsetof(springls_params, name)}
#define WHOLE(name) {#name, false, offsetof(springls_params, name)} /* enumerations too: by number */
    REAL(d_max), REAL(particle_radius), REAL(neighbor_radius), WHOLE(max_neighbors),
    WHOLE(relax_iterations), WHOLE(threshold), WHOLE(weight), WHOLE(torque), REAL(sharpness), REAL(kappa_int),
    REAL(kappa_ext), REAL(relax_step_length), REAL(relax_step_rotation), WHOLE(relax_same_side),
    REAL(contract_distance), REAL(min_angle), REAL(max_angle), REAL(min_area), WHOLE(reshape), REAL(merge_distance),
    WHOLE(resample_period), WHOLE(resample_last), REAL(split_edge), REAL(split_area), WHOLE(placement),
    REAL(band_half_width), REAL(capture), WHOLE(evolve_iterations), REAL(evolve_step), REAL(evolve_width),
    REAL(curvature), WHOLE(project_level_set), WHOLE(topology),
    REAL(nearest_rule), WHOLE(track_iterations), REAL(track_step),
    WHOLE(vertex_velocity), WHOLE(half_time_sampling), WHOLE(initial_stride), WHOLE(project_initial),
#undef REAL
#undef WHOLE
};

static bool set_member(springls_params *params, const char *name, size_t length, const char *value)
{
    for (size_t i = 0; i < sizeof members / sizeof *members; ++i) {
        if (strlen(members[i].name) != length || strncmp(members[i].name, name, length) != 0) {
            continue;
        }
        char *place = (char *)params + members[i].offset;
        double real;
        int whole;
        if (members[i].is_float && cli_read_double(value, &real)) {
            const float narrow = (float)real;
            memcpy(place, &narrow, sizeof narrow);
            return true;
        }
        if (!members[i].is_float && cli_read_int(value, &whole)) {
            memcpy(place, &whole, sizeof whole);
            return true;
        }
        return false;
    }
    return false;
}

/* "name=value,name=value". False: `bad` holds the item that is wrong. */
static bool set_members(springls_params *params, const char *text, char bad[80])
{
    while (text && *text) {
        const size_t length = strcspn(text, ",");
        snprintf(bad, 80, "%.*s", (int)(length < 79 ? length : 79), text);
        const char *equals = strchr(bad, '=');
        if (!equals || !set_member(params, bad, (size_t)(equals - bad), equals + 1)) {
            return false;
        }
        text += length + (text[length] == ',');
    }
    return true;
}

int benchmark_parse(struct benchmark_options *options, const char *name, const char *summary,
                    const struct cli_option *own, int argc, char **argv)
{
    const struct benchmark_options defaults = {cli_common_defaults(), 0, NULL, "free", false};
    *options = defaults;
    const struct cli_option table[] = {
        *own,
        {.name = "steps", .type = CLI_INT, .destination = &options->steps, .value = "K",
         .help = "steps in all (0: the usual number)", .minimum = 0, .maximum = 1e8},
        {.name = "set", .type = CLI_STRING, .destination = &options->settings, .value = "NAME=VALUE",
         .help = "members of springls_params; more after commas"},
        {.name = "topology", .type = CLI_CHOICE, .destination = &options->topology,
         .help = "whether the surface may split and merge", .choices = "free|preserved"},
        {.name = "every-step", .type = CLI_FLAG, .destination = &options->every_step,
         .help = "check components and Euler number after each step"},
    };
    const struct cli_program program = {.name = name, .summary = summary, .common = &options->common,
                                        .common_without = CLI_WITHOUT_SEED, .options = table,
                                        .option_count = (int)(sizeof table / sizeof *table)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_GO_ON) {
        return status;
    }
    springls_params params = springls_default_params();
    char bad[80];
    if (!set_members(&params, options->settings, bad)) {
        return cli_fail(name, CLI_EXIT_USAGE, "--set: '%s' is not a member of springls_params and its value", bad);
    }
    if (options->common.grid == 0) {
        options->common.grid = 64;
    }
    if (options->common.grid < 16) {
        return cli_fail(name, CLI_EXIT_USAGE, "--grid must be 16 or more");
    }
    if (strcmp(options->common.backend, "opencl") == 0) {
        return cli_fail(name, CLI_EXIT_FAILURE, "this program has no OpenCL backend; use --backend scalar");
    }
    return CLI_GO_ON;
}

/* ---- measures ---- */

struct spread {
    double mean, std, max;
};

static struct spread spread_of(const float *values, int count)
{
    struct spread s = {0.0, 0.0, 0.0};
    double squares = 0.0;
    for (int i = 0; i < count; ++i) {
        const double v = fabs((double)values[i]);
        s.mean += v / count;
        s.max = v > s.max ? v : s.max;
    }
    for (int i = 0; i < count; ++i) {
        const double d = fabs((double)values[i]) - s.mean;
        squares += d * d / count;
    }
    s.std = sqrt(squares);
    return s;
}

static float *new_floats(int count, int each) { return malloc(((size_t)count * (size_t)each + 1) * sizeof(float)); }

/* A dense copy of a view, `each` floats an item; NULL when memory is short. */
static float *copy_view(springls_view view, int each)
{
    float *copy = new_floats(view.count, each);
    for (int i = 0; copy && i < view.count; ++i) {
        memcpy(copy + (ptrdiff_t)each * i, (const char *)view.data + (size_t)i * view.stride,
               (size_t)each * sizeof(float));
    }
    return copy;
}

static bool shape_spread(const struct benchmark_problem *problem, const float *points, int count, struct spread *out)
{
    float *distances = new_floats(count, 1);
    if (!distances) {
        return false;
    }
    problem->shape(problem->shape_data, points, count, distances);
    *out = spread_of(distances, count);
    free(distances);
    return true;
}

static void between(const float *a, const float *b, int count, float *lengths)
{
    for (int i = 0; i < count; ++i) {
        const double x = a[3 * i] - b[3 * i], y = a[3 * i + 1] - b[3 * i + 1], z = a[3 * i + 2] - b[3 * i + 2];
        lengths[i] = (float)sqrt(x * x + y * y + z * z);
    }
}

/* Carries one point by the exact flow from time 0 to `time`: Runge-Kutta in small steps, summed in double. */
static void carry(const struct benchmark_problem *problem, double time, float point[3])
{
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const double h = time / FLOW_STEPS;
    double x[3] = {point[0], point[1], point[2]};
    for (int step = 0; step < FLOW_STEPS; ++step) {
        float k[3] = {0.0f, 0.0f, 0.0f};
        double sum[3] = {0.0, 0.0, 0.0};
        for (int stage = 0; stage < 4; ++stage) {
            float y[3];
            for (int c = 0; c < 3; ++c) {
                y[c] = (float)(x[c] + at[stage] * h * k[c]);
            }
            problem->velocity(problem->velocity_data, y, 1, (float)((step + at[stage]) * h), k);
            for (int c = 0; c < 3; ++c) {
                sum[c] += weight[stage] * k[c];
            }
        }
        for (int c = 0; c < 3; ++c) {
            x[c] += h * sum[c];
        }
    }
    for (int c = 0; c < 3; ++c) {
        point[c] = (float)x[c];
    }
}

/* |flow(a) - p| now; |a - p| when not `carried`. */
static bool tracking_spread(const struct benchmark_problem *problem, const springls_context *model, bool carried,
                            struct spread *out)
{
    const int count = springls_count(model);
    float *p = copy_view(springls_view_particles(model), 3), *a = copy_view(springls_view_correspondences(model), 3);
    float *lengths = new_floats(count, 1);
    const bool ok = p && a && lengths;
    if (ok) {
#ifdef _OPENMP
#pragma omp parallel for schedule(static)
#endif
        for (int i = 0; i < (carried ? count : 0); ++i) {
            carry(problem, springls_time(model), a + 3 * (ptrdiff_t)i);
        }
        between(a, p, count, lengths);
        *out = spread_of(lengths, count);
    }
    free(p);
    free(a);
    free(lengths);
    return ok;
}

struct result {
    int steps, initial, final, threads;
    double mean, seconds;
    springls_measures before, after;
    struct spread deformation, tracking, halfway, surface;
    springls_stats stats;
    uint64_t hash;
    int components_max, euler_min, euler_max, first_change; /* of --every-step; first_change 0 = never */
};

/* ---- pictures ---- */

struct frame {
    float *corners, *originals;
    int count;
    char caption[32];
};

struct box {
    float lo[3], hi[3];
};

static struct color color_in_box(void *user, const float original[3])
{
    const struct box *box = user;
    return raycast_correspondence_color(original, box->lo, box->hi);
}

static bool take_frame(const springls_context *model, struct frame *frame)
{
    frame->count = springls_count(model);
    frame->corners = copy_view(springls_view_vertices(model), 9);
    frame->originals = copy_view(springls_view_correspondences(model), 3);
    snprintf(frame->caption, sizeof frame->caption, "t = %.4g", springls_time(model));
    return frame->corners && frame->originals;
}

/* All frames through one camera, with the colours of the first. */
static bool write_strip(const struct benchmark_problem *problem, const struct frame frames[FRAMES], const char *path)
{
    struct image images[FRAMES], strip = {0, 0, NULL};
    const char *captions[FRAMES];
    const float up[3] = {0.0f, 1.0f, 0.0f};
    struct box all = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}, first = all;
    bool ok = true;
    memset(images, 0, sizeof images);
    raycast_grow_box(frames[0].originals, (size_t)frames[0].count, first.lo, first.hi);
    for (int i = 0; i < FRAMES; ++i) {
        raycast_grow_box(frames[i].corners, 3 * (size_t)frames[i].count, all.lo, all.hi);
    }
    for (int i = 0; i < FRAMES && ok; ++i) {
        struct raycast_scene scene;
        memset(&scene, 0, sizeof scene);
        scene.positions = frames[i].corners;
        scene.vertex_count = 3 * (size_t)frames[i].count;
        scene.triangle_count = (size_t)frames[i].count;
        scene.triangle_originals = frames[i].originals;
        scene.color_at = color_in_box;
        scene.color_user = &first;
        scene.style = RAYCAST_SPRINGL;
        scene.edge_width = 0.6f;
        scene.camera = raycast_frame_box(all.lo, all.hi, problem->view, up, 30.0f, 1.0f);
        ok = raycast_render(&scene, FRAME_SIZE, FRAME_SIZE, &images[i]);
        captions[i] = frames[i].caption;
    }
    ok = ok && image_strip(images, captions, FRAMES, FRAMES, color_rgb(1.0f, 1.0f, 1.0f), &strip);
    ok = ok && image_write_png(&strip, path);
    for (int i = 0; i < FRAMES; ++i) {
        image_free(&images[i]);
    }
    image_free(&strip);
    return ok;
}

/* ---- reports ---- */

static double percent(double value, double of) { return 100.0 * (value / of - 1.0); }

static void json_spread(struct json_writer *json, const char *name, const struct spread *s)
{
    char key[40];
    snprintf(key, sizeof key, "%s_mean", name);
    json_number(json, key, s->mean);
    snprintf(key, sizeof key, "%s_std", name);
    json_number(json, key, s->std);
    snprintf(key, sizeof key, "%s_max", name);
    json_number(json, key, s->max);
}

static bool write_json(const struct benchmark_options *options, const struct benchmark_problem *problem,
                       const struct result *r)
{
    struct json_writer json;
    char hash[24];
    if (!json_open(&json, options->common.json)) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", problem->name);
    json_integer(&json, "grid", options->common.grid);
    json_number(&json, "period", problem->period);
    json_integer(&json, "steps", r->steps);
    json_string(&json, "params", options->common.params);
    json_string(&json, "set", options->settings);
    json_string(&json, "topology", options->topology);
    json_string(&json, "backend", options->common.backend);
    json_integer(&json, "threads", r->threads);
    json_integer(&json, "springls_initial", r->initial);
    json_number(&json, "springls_mean", r->mean);
    json_integer(&json, "springls_final", r->final);
    json_spread(&json, "deformation", &r->deformation);
    json_spread(&json, "tracking", &r->tracking);
    json_spread(&json, "halfway", &r->halfway);
    json_number(&json, "surface_mean", r->surface.mean);
    json_number(&json, "surface_max", r->surface.max);
    json_number(&json, "volume_change_percent", percent(r->after.volume, r->before.volume));
    json_number(&json, "volume_error_percent", percent(r->after.volume, problem->volume));
    json_integer(&json, "components", r->after.components);
    json_integer(&json, "euler", r->after.euler);
    if (options->every_step) {
        json_object_begin(&json, "every_step");
        json_integer(&json, "components_max", r->components_max);
        json_integer(&json, "euler_min", r->euler_min);
        json_integer(&json, "euler_max", r->euler_max);
        json_integer(&json, "first_change", r->first_change);
        json_object_end(&json);
    }
    json_number(&json, "seconds_total", r->seconds);
    json_object_begin(&json, "seconds_stage");
    for (int i = 0; i < SPRINGLS_STAGE_COUNT; ++i) {
        json_number(&json, springls_stage_name((springls_stage)i), r->stats.seconds[i]);
    }
    json_object_end(&json);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)r->hash);
    json_string(&json, "state_hash", hash);
    json_object_end(&json);
    return json_close(&json);
}

static void print_row(const char *name, const char *ours, const char *paper)
{
    printf("  %-28s %-26s %s\n", name, ours, paper ? paper : "");
}

static void print_spread(const char *name, const struct spread *s, const char *paper)
{
    char text[64];
    snprintf(text, sizeof text, "%.3f +- %.3f, max %.2f", s->mean, s->std, s->max);
    print_row(name, text, paper);
}

static void print_table(const struct benchmark_options *options, const struct benchmark_problem *problem,
                        const struct result *r)
{
    char text[80];
    printf("%s, %d^3 voxels, %d steps, %s parameters, %d threads\n", problem->name, options->common.grid, r->steps,
           options->common.params, r->threads);
    print_row("", "here", "paper (128^3)");
    print_spread("deformation, voxels", &r->deformation, problem->paper_deformation);
    print_spread("tracking, voxels", &r->tracking, problem->paper_tracking);
    print_spread("tracking halfway, voxels", &r->halfway, NULL);
    print_spread("iso-surface, voxels", &r->surface, NULL);
    snprintf(text, sizeof text, "%+.3f %%", percent(r->after.volume, r->before.volume));
    print_row("volume change", text, problem->paper_volume);
    snprintf(text, sizeof text, "%+.3f %%", percent(r->after.volume, problem->volume));
    print_row("volume against exact", text, NULL);
    snprintf(text, sizeof text, "%d, mean %.0f, %d", r->initial, r->mean, r->final);
    print_row("springls: first, mean, last", text, NULL);
    snprintf(text, sizeof text, "%d, %d", r->after.components, r->after.euler);
    print_row("components, Euler number", text, NULL);
    if (options->every_step) {
        snprintf(text, sizeof text, r->first_change ? "changed first at step %d" : "never changed", r->first_change);
        print_row("topology at every step", text, NULL);
    }
    snprintf(text, sizeof text, "%.1f", r->steps / r->seconds);
    print_row("steps a second", text, problem->paper_speed);
}

/* ---- the run ---- */

static void watch_topology(struct result *r, const springls_measures *now, int step)
{
    r->components_max = now->components > r->components_max ? now->components : r->components_max;
    r->euler_min = now->euler < r->euler_min ? now->euler : r->euler_min;
    r->euler_max = now->euler > r->euler_max ? now->euler : r->euler_max;
    if (!r->first_change && (now->components != r->before.components || now->euler != r->before.euler)) {
        r->first_change = step;
    }
}

/* Steps, with what is looked at on the way. The clock runs only while the library works. */
static springls_status run_steps(const struct benchmark_options *options, const struct benchmark_problem *problem,
                                 springls_context *model, struct frame frames[FRAMES], struct result *r)
{
    springls_forces forces;
    springls_step_desc step;
    struct progress progress;
    springls_status status = SPRINGLS_OK;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.velocity = problem->velocity;
    forces.user = problem->velocity_data;
    step.forces = &forces;
    step.dt = (float)(problem->period / r->steps);
    progress_begin(&progress, problem->name, (size_t)r->steps, options->common.quiet);
    for (int k = 1, next = 0; k <= r->steps && status == SPRINGLS_OK; ++k) {
        for (; frames && next < FRAMES - 1 && (long long)next * r->steps / (FRAMES - 1) == k - 1; ++next) {
            status = take_frame(model, &frames[next]) ? status : SPRINGLS_OUT_OF_MEMORY;
        }
        const double begin = elapsed_seconds();
        if (status == SPRINGLS_OK) status = springls_step(model, &step);
        r->seconds += elapsed_seconds() - begin;
        r->mean += (double)springls_count(model) / r->steps;
        if (status == SPRINGLS_OK && options->every_step) {
            springls_measures now;
            status = springls_measure(model, &now);
            if (status == SPRINGLS_OK) watch_topology(r, &now, k);
        }
        if (status == SPRINGLS_OK && k == (r->steps + 1) / 2 && !tracking_spread(problem, model, true, &r->halfway)) {
            status = SPRINGLS_OUT_OF_MEMORY;
        }
        progress_update(&progress, (size_t)k, NULL);
    }
    progress_end(&progress);
    if (status == SPRINGLS_OK && frames && !take_frame(model, &frames[FRAMES - 1])) {
        status = SPRINGLS_OUT_OF_MEMORY;
    }
    return status;
}

static springls_status measure_end(const struct benchmark_problem *problem, springls_context *model, struct result *r)
{
    springls_mesh mesh;
    springls_status status = springls_measure(model, &r->after);
    float *particles = copy_view(springls_view_particles(model), 3);
    memset(&mesh, 0, sizeof mesh);
    if (status == SPRINGLS_OK) status = springls_extract_mesh(model, &mesh);
    if (status == SPRINGLS_OK
        && !(particles && shape_spread(problem, particles, springls_count(model), &r->deformation)
             && tracking_spread(problem, model, false, &r->tracking)
             && shape_spread(problem, mesh.positions, mesh.vertex_count, &r->surface))) {
        status = SPRINGLS_OUT_OF_MEMORY;
    }
    r->final = springls_count(model);
    r->stats = springls_get_stats(model);
    r->hash = springls_state_hash(model);
    free(particles);
    springls_mesh_free(model, &mesh);
    return status;
}

static int use_threads(int wanted)
{
#ifdef _OPENMP
    if (wanted > 0) {
        omp_set_num_threads(wanted);
    }
    return omp_get_max_threads();
#else
    (void)wanted;
    return 1;
#endif
}

static int run_and_report(const struct benchmark_options *options, const struct benchmark_problem *problem,
                          springls_context *model, struct frame *frames)
{
    struct result r;
    memset(&r, 0, sizeof r);
    r.threads = use_threads(options->common.threads);
    r.steps = options->steps > 0 ? options->steps : problem->steps > 0 ? problem->steps : 1;
    springls_status status = springls_set_implicit(model, problem->shape, problem->shape_data);
    if (status == SPRINGLS_OK) status = springls_measure(model, &r.before);
    r.initial = springls_count(model);
    r.euler_min = r.euler_max = r.before.euler;
    r.components_max = r.before.components;
    if (status == SPRINGLS_OK) status = run_steps(options, problem, model, frames, &r);
    if (status == SPRINGLS_OK) status = measure_end(problem, model, &r);
    if (status != SPRINGLS_OK) {
        const char *sentence = springls_last_error(model);
        return cli_fail(problem->name, CLI_EXIT_FAILURE, "%s", *sentence ? sentence : springls_status_string(status));
    }
    if (!options->common.json || strcmp(options->common.json, "-") != 0) {
        print_table(options, problem, &r);
    }
    if (options->common.json && !write_json(options, problem, &r)) {
        return cli_fail(problem->name, CLI_EXIT_FAILURE, "cannot write %s", options->common.json);
    }
    if (frames) {
        char path[1024];
        const int length = snprintf(path, sizeof path, "%s/%s_%d.png", options->common.out, problem->name,
                                    options->common.grid);
        if (length >= (int)sizeof path || !write_strip(problem, frames, path)) {
            return cli_fail(problem->name, CLI_EXIT_FAILURE, "cannot write a picture into %s", options->common.out);
        }
    }
    return CLI_EXIT_OK;
}

int benchmark_run(const struct benchmark_options *options, const struct benchmark_problem *problem)
{
    springls_params params =
        strcmp(options->common.params, "paper") == 0 ? springls_paper_params() : springls_default_params();
    springls_desc desc;
    springls_context *model;
    struct frame frames[FRAMES];
    char bad[80];
    const char *out = options->common.out;
    if (strcmp(options->topology, "preserved") == 0) {
        params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    }
    set_members(&params, options->settings, bad); /* benchmark_parse has seen that it is right */
    if (out && mkdir(out, 0777) != 0 && errno != EEXIST) {
        return cli_fail(problem->name, CLI_EXIT_FAILURE, "cannot make the folder %s", out);
    }
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = options->common.grid;
    desc.params = &params;
    const springls_status status = springls_create(&desc, &model);
    if (status != SPRINGLS_OK) {
        return cli_fail(problem->name, CLI_EXIT_FAILURE, "%s", springls_status_string(status));
    }
    memset(frames, 0, sizeof frames);
    const int exit_status = run_and_report(options, problem, model, out ? frames : NULL);
    for (int i = 0; i < FRAMES; ++i) {
        free(frames[i].corners);
        free(frames[i].originals);
    }
    springls_destroy(model);
    return exit_status;
}
