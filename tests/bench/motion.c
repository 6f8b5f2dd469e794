/* motion.c - one motion, run and measured, in any of three orders of the axes. */
#define _POSIX_C_SOURCE 200809L
#include "springls_cl.h"

#include "motion.h"

#include "examples/common/base/bvh.h"
#include "examples/common/base/progress.h"
#include "examples/common/base/threads.h"
#include "examples/common/springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MAX_SAMPLES = 30000, BATCH = 64, PIECES = 4 };

/* A run in progress. The problem's coordinate c is the model's coordinate (c + order) % 3. */
struct course {
    const struct motion *motion;
    int order;
    double *figures;
    springls_context *ctx;
    springls_forces forces;
    springls_measures start;
    struct coverage_range coverage;
    double *samples; /* points of the start's surface, problem coordinates */
    bool *on_edge;   /* of each: on a sharp edge? */
    int sample_count;
};

static void *room(size_t count, size_t size)
{
    void *memory = calloc(count + 1, size);
    if (!memory) {
        fprintf(stderr, "out of memory\n");
        exit(1);
    }
    return memory;
}

/* ---- orders of the axes ---- */

static void to_problem(int order, const float *model, int count, float *problem)
{
    for (int i = 0; i < 3 * count; ++i) {
        problem[i] = model[i - i % 3 + (i % 3 + order) % 3];
    }
}

static void to_model(int order, const float *problem, int count, float *model)
{
    for (int i = 0; i < 3 * count; ++i) {
        model[i - i % 3 + (i % 3 + order) % 3] = problem[i];
    }
}

static void ordered_shape(void *user, const float *points, int count, float *out)
{
    const struct course *course = user;
    const struct benchmark *problem = &course->motion->problem;
    for (int done = 0; done < count; done += BATCH) {
        float x[3 * BATCH];
        const int n = count - done < BATCH ? count - done : BATCH;
        to_problem(course->order, points + 3 * done, n, x);
        problem->shape(problem->shape_data, x, n, out + done);
    }
}

static void exact_velocities(const struct benchmark *problem, const float *points, int count, float time, float *out)
{
    const double factor = problem->exact_time_factor(problem->flow, (double)time);
    for (int i = 0; i < count; ++i) {
        const double x[3] = {points[3 * i], points[3 * i + 1], points[3 * i + 2]};
        double v[3];
        problem->exact_velocity(problem->flow, x, factor, v);
        for (int c = 0; c < 3; ++c) {
            out[3 * i + c] = (float)v[c];
        }
    }
}

static void ordered_velocity(void *user, const float *points, int count, float time, float *out)
{
    const struct course *course = user;
    const struct benchmark *problem = &course->motion->problem;
    for (int done = 0; done < count; done += BATCH) {
        float x[3 * BATCH], v[3 * BATCH];
        const int n = count - done < BATCH ? count - done : BATCH;
        to_problem(course->order, points + 3 * done, n, x);
        if (problem->velocity) {
            problem->velocity(problem->flow, x, n, time, v);
        } else {
            exact_velocities(problem, x, n, time, v);
        }
        to_model(course->order, v, n, out + 3 * done);
    }
}

static void ordered_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct course *course = user;
    for (int done = 0; done < count; done += BATCH) {
        float x[3 * BATCH], normal[3 * BATCH];
        const int n = count - done < BATCH ? count - done : BATCH;
        to_problem(course->order, points + 3 * done, n, x);
        to_problem(course->order, normals + 3 * done, n, normal);
        course->motion->pressure(course->motion->problem.flow, x, normal, n, time, out + done);
    }
}

/* What a view shows, `points` points an item, in the problem's coordinates; the caller frees its data. */
static springls_view problem_view(const struct course *course, springls_view view, int points)
{
    float *copy = room((size_t)view.count * (size_t)points, 3 * sizeof(float));
    for (int i = 0; i < view.count; ++i) {
        const float *item = (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride);
        to_problem(course->order, item, points, copy + 3 * points * i);
    }
    const springls_view copied = {copy, view.count * points, 3 * sizeof(float)};
    return copied;
}

static void free_view(springls_view view)
{
    free((void *)(uintptr_t)view.data);
}

/* ---- start ---- */

static springls_status set_mesh(struct course *course)
{
    const struct mesh *mesh = course->motion->mesh;
    float *positions = room(mesh->vertex_count, 3 * sizeof(float));
    int *triangles = room(mesh->triangle_count, 3 * sizeof(int));
    to_model(course->order, mesh->positions, (int)mesh->vertex_count, positions);
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        triangles[i] = (int)mesh->indices[i];
    }
    const springls_status status = springls_set_mesh(course->ctx, positions, (int)mesh->vertex_count, 0, triangles,
                                                     (int)mesh->triangle_count, NULL);
    free(positions);
    free(triangles);
    return status;
}

/* The start's springls lie on its surface, and where they come from a mesh they have its corners. */
static void take_samples(struct course *course)
{
    const struct motion *motion = course->motion;
    const springls_view corners = problem_view(course, springls_view_vertices(course->ctx), 3);
    const int stride = motion->on_edge ? 1 : corners.count / MAX_SAMPLES + 1;
    course->sample_count = corners.count / stride;
    course->samples = room((size_t)course->sample_count, 3 * sizeof(double));
    course->on_edge = room((size_t)course->sample_count, sizeof(bool));
    for (int i = 0; i < course->sample_count; ++i) {
        const float *x = corners.data + 3 * i * stride;
        for (int c = 0; c < 3; ++c) {
            course->samples[3 * i + c] = (double)x[c];
        }
        course->on_edge[i] = motion->on_edge && motion->on_edge(motion->problem.flow, x);
    }
    free_view(corners);
}

/* ---- measures ---- */

static void note_error(double *mean, double *q99, double *most, struct benchmark_error error)
{
    *mean = error.mean;
    *most = error.max;
    if (q99) {
        *q99 = error.q99;
    }
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Two figures from `first` on: how often, and by how much, the estimates exceed the errors of places p with correspondences a. */
static void measure_error_estimates(struct course *course, double time, enum motion_figure first, springls_view p,
                                    springls_view a, const springls_error_estimate *estimates)
{
    const int count = p.count;
    double *moved = room(3 * (size_t)count + 1, sizeof(double)), *ratios = room((size_t)count + 1, sizeof(double));
    int within = 0;
    for (int i = 0; i < 3 * count; ++i) {
        moved[i] = (double)((const float *)(const void *)((const char *)a.data + (size_t)(i / 3) * a.stride))[i % 3];
    }
    benchmark_flow(&course->motion->problem, time, moved, count);
    for (int i = 0; i < count; ++i) {
        const float *x = (const float *)(const void *)((const char *)p.data + (size_t)i * p.stride);
        const double dx = (double)x[0] - moved[3 * i], dy = (double)x[1] - moved[3 * i + 1];
        const double dz = (double)x[2] - moved[3 * i + 2];
        const double error = sqrt(dx * dx + dy * dy + dz * dz);
        within += error <= (double)estimates[i].place;
        ratios[i] = (double)estimates[i].place / fmax(error, 1e-9);
    }
    if (count > 0) {
        qsort(ratios, (size_t)count, sizeof *ratios, ascending);
        course->figures[first] = 100.0 * within / count;
        course->figures[first + 1] = ratios[count / 2];
    }
    free(moved);
    free(ratios);
}

static springls_status measure_springl_errors(struct course *course, double time, enum motion_figure first)
{
    const springls_view p = problem_view(course, springls_view_particles(course->ctx), 1);
    const springls_view a = problem_view(course, springls_view_correspondences(course->ctx), 1);
    springls_error_estimate *estimates = room((size_t)p.count + 1, sizeof *estimates);
    const springls_status status = springls_springl_errors(course->ctx, estimates);
    if (status == SPRINGLS_OK) {
        measure_error_estimates(course, time, first, p, a, estimates);
    }
    free(estimates);
    free_view(p);
    free_view(a);
    return status;
}

/* The same of the vertices of the zero level. */
static springls_status measure_mesh_errors(struct course *course, double time, enum motion_figure first)
{
    springls_mesh mesh;
    springls_status status = springls_extract_mesh(course->ctx, &mesh);
    if (status == SPRINGLS_OK) {
        const springls_view positions = {mesh.positions, mesh.vertex_count, 3 * sizeof(float)};
        const springls_view correspondences = {mesh.correspondences, mesh.vertex_count, 3 * sizeof(float)};
        const springls_view p = problem_view(course, positions, 1), a = problem_view(course, correspondences, 1);
        springls_error_estimate *estimates = room((size_t)p.count + 1, sizeof *estimates);
        status = springls_mesh_errors(course->ctx, &mesh, estimates);
        if (status == SPRINGLS_OK) {
            measure_error_estimates(course, time, first, p, a, estimates);
        }
        free(estimates);
        free_view(p);
        free_view(a);
        springls_mesh_free(course->ctx, &mesh);
    }
    return status;
}

static springls_status measure_halfway(struct course *course, double time)
{
    const struct motion *motion = course->motion;
    const springls_view p = problem_view(course, springls_view_particles(course->ctx), 1);
    const springls_view a = problem_view(course, springls_view_correspondences(course->ctx), 1);
    double *f = course->figures;
    springls_measures now;
    note_error(&f[MOTION_halfway_mean], &f[MOTION_halfway_q99], &f[MOTION_halfway_max],
               benchmark_flow_error(&motion->problem, time, p, a));
    free_view(p);
    free_view(a);
    springls_status status = measure_springl_errors(course, time, MOTION_within_halfway);
    status = status == SPRINGLS_OK ? measure_mesh_errors(course, time, MOTION_mesh_within_halfway) : status;
    status = status == SPRINGLS_OK ? springls_measure(course->ctx, &now) : status;
    if (status == SPRINGLS_OK) {
        f[MOTION_volume_halfway] = 100.0 * (now.volume / (course->start.volume * motion->halfway_volume) - 1.0);
        f[MOTION_components_halfway] = now.components;
        f[MOTION_euler_halfway] = now.euler;
    }
    return status;
}

static void measure_particles(struct course *course)
{
    const struct benchmark *problem = &course->motion->problem;
    const springls_view p = problem_view(course, springls_view_particles(course->ctx), 1);
    const springls_view a = problem_view(course, springls_view_correspondences(course->ctx), 1);
    double *f = course->figures;
    note_error(&f[MOTION_tracking_mean], &f[MOTION_tracking_q99], &f[MOTION_tracking_max],
               problem->reverses ? benchmark_tracking(p, a) : benchmark_flow_error(problem, problem->duration, p, a));
    if (problem->shape && problem->reverses) {
        note_error(&f[MOTION_deformation_mean], NULL, &f[MOTION_deformation_max], benchmark_deformation(problem, p));
    }
    free_view(p);
    free_view(a);
}

/* Five figures from `first` on: mean, 99 in 100 and largest distance from the samples to triangles (NULL: a soup), mean and
   largest of those on sharp edges. */
static void measure_samples(struct course *course, enum motion_figure first, springls_view vertices, const int *triangles,
                            int triangle_count)
{
    double *f = course->figures + first;
    double *distances = room((size_t)course->sample_count, sizeof(double));
    double *edges = room((size_t)course->sample_count, sizeof(double));
    int edge_count = 0;
    struct bvh bvh;
    if (bvh_build(&bvh, vertices.data, (const uint32_t *)(const void *)triangles, (size_t)triangle_count)) {
        for (int i = 0; i < course->sample_count; ++i) {
            const double *x = course->samples + 3 * i;
            const float place[3] = {(float)x[0], (float)x[1], (float)x[2]};
            distances[i] = (double)bvh_distance(&bvh, place, NULL, NULL);
            if (course->on_edge[i]) {
                edges[edge_count++] = distances[i];
            }
        }
        note_error(&f[0], &f[1], &f[2], benchmark_summary(distances, course->sample_count));
        note_error(&f[3], NULL, &f[4], benchmark_summary(edges, edge_count));
        bvh_free(&bvh);
    }
    free(distances);
    free(edges);
}

static springls_status measure_zero_level(struct course *course, enum motion_figure first)
{
    const struct benchmark *problem = &course->motion->problem;
    double *f = course->figures;
    springls_mesh mesh;
    const springls_status status = springls_extract_mesh(course->ctx, &mesh);
    if (status == SPRINGLS_OK) {
        const springls_view own = {mesh.positions, mesh.vertex_count, 3 * sizeof(float)};
        const springls_view vertices = problem_view(course, own, 1);
        measure_samples(course, first, vertices, mesh.triangles, mesh.triangle_count);
        if (first == MOTION_end_mean && problem->shape && problem->reverses) {
            note_error(&f[MOTION_surface_mean], NULL, &f[MOTION_surface_max], benchmark_deformation(problem, vertices));
        }
        free_view(vertices);
        springls_mesh_free(course->ctx, &mesh);
    }
    return status;
}

/* How far springls are from the exact surface. */
static void measure_soup(struct course *course)
{
    const springls_view corners = problem_view(course, springls_view_vertices(course->ctx), 3);
    measure_samples(course, MOTION_soup_mean, corners, NULL, corners.count / 3);
    free_view(corners);
}

/* Degrees; 0 for a triangle with two corners in one place. */
static double smallest_angle(const float corners[9])
{
    double smallest = 180.0;
    for (int k = 0; k < 3; ++k) {
        const float *at = corners + 3 * k, *next = corners + 3 * ((k + 1) % 3), *last = corners + 3 * ((k + 2) % 3);
        double dot = 0.0, aa = 0.0, bb = 0.0;
        for (int c = 0; c < 3; ++c) {
            const double a = (double)next[c] - (double)at[c], b = (double)last[c] - (double)at[c];
            dot += a * b;
            aa += a * a;
            bb += b * b;
        }
        if (!(aa > 0.0 && bb > 0.0)) {
            return 0.0;
        }
        const double cosine = fmax(-1.0, fmin(1.0, dot / sqrt(aa * bb)));
        smallest = fmin(smallest, acos(cosine) * 180.0 / 3.14159265358979);
    }
    return smallest;
}

static void measure_angles(struct course *course)
{
    const springls_view view = springls_view_vertices(course->ctx);
    double sum = 0.0, least = 180.0;
    for (int i = 0; i < view.count; ++i) {
        const double angle = smallest_angle((const float *)(const void *)((const char *)view.data + (size_t)i * view.stride));
        sum += angle;
        least = fmin(least, angle);
    }
    course->figures[MOTION_smallest_angle_min] = least;
    course->figures[MOTION_smallest_angle_mean] = sum / view.count;
}

static springls_status measure_end(struct course *course)
{
    const struct benchmark *problem = &course->motion->problem;
    springls_measures now;
    measure_particles(course);
    measure_angles(course);
    course->figures[MOTION_coverage_least] = course->coverage.least.area;
    course->figures[MOTION_coverage_most] = course->coverage.most.area;
    course->figures[MOTION_covered_mean] = course->coverage.mean.covered;
    course->figures[MOTION_covered_least] = course->coverage.least.covered;
    course->figures[MOTION_covered_twice_most] = course->coverage.most.covered_twice;
    course->figures[MOTION_springls_end] = springls_count(course->ctx);
    course->figures[MOTION_cpu_ms_a_step] = 1e3 * course->figures[MOTION_cpu_seconds] / course->figures[MOTION_steps];
    if (!problem->reverses) {
        benchmark_flow(problem, problem->duration, course->samples, course->sample_count);
    }
    measure_soup(course);
    springls_status status = measure_springl_errors(course, problem->duration, MOTION_within_end);
    status = status == SPRINGLS_OK ? measure_mesh_errors(course, problem->duration, MOTION_mesh_within_end) : status;
    status = status == SPRINGLS_OK ? springls_measure(course->ctx, &now) : status;
    if (status != SPRINGLS_OK) {
        return status;
    }
    course->figures[MOTION_volume_end] = 100.0 * (now.volume / course->start.volume - 1.0);
    course->figures[MOTION_components_end] = now.components;
    course->figures[MOTION_euler_end] = now.euler;
    return measure_zero_level(course, MOTION_end_mean);
}

/* ---- the run ---- */

static springls_status make_model(struct course *course, const struct motion_setting *setting)
{
    const struct motion *motion = course->motion;
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = motion->problem.grid;
    desc.params = &setting->params;
    springls_status status = springls_create(&desc, &course->ctx);
    if (status == SPRINGLS_OK) {
        status = motion->mesh ? set_mesh(course) : springls_set_implicit(course->ctx, ordered_shape, course);
    }
    if (status == SPRINGLS_OK) {
        status = springls_measure(course->ctx, &course->start);
    }
    if (status == SPRINGLS_OK) {
        take_samples(course);
        course->figures[MOTION_components_start] = course->start.components;
        course->figures[MOTION_euler_start] = course->start.euler;
        course->figures[MOTION_springls_start] = springls_count(course->ctx);
        status = measure_zero_level(course, MOTION_start_mean);
    }
    return status;
}

static double thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static springls_status take_step(struct course *course, double time, double dt, float max_displacement)
{
    double *f = course->figures;
    const double started = thread_seconds();
    const int before = springls_get_stats(course->ctx).steps;
    springls_step_desc step;
    memset(&step, 0, sizeof step);
    step.forces = &course->forces;
    step.dt = (float)dt;
    step.max_displacement = max_displacement > 0.0f ? max_displacement : -1.0f;
    springls_set_time(course->ctx, time);
    const springls_status status = springls_step(course->ctx, &step);
    const double steps = springls_get_stats(course->ctx).steps - before;
    f[MOTION_cpu_seconds] += thread_seconds() - started;
    f[MOTION_springls_mean] += steps * springls_count(course->ctx); /* a sum so far */
    f[MOTION_steps] += steps;
    return status;
}

static springls_status move(struct course *course, const struct motion_setting *setting)
{
    const struct benchmark *problem = &course->motion->problem;
    const bool adaptive = setting->max_displacement > 0.0f;
    const int half = adaptive ? PIECES : problem->steps / 2; /* calls of springls_step, which cuts a piece into steps itself */
    const double dt = 0.5 * problem->duration / half;
    double *f = course->figures;
    springls_status status = SPRINGLS_OK;
    f[MOTION_cpu_seconds] = f[MOTION_springls_mean] = f[MOTION_steps] = 0.0;
    for (int k = 0; k < 2 * half && status == SPRINGLS_OK; ++k) {
        status = take_step(course, k * dt, dt, setting->max_displacement);
        if (status == SPRINGLS_OK && (k + 1) % (half / PIECES > 0 ? half / PIECES : 1) == 0
            && !coverage_add(course->ctx, &course->coverage)) {
            status = SPRINGLS_OUT_OF_MEMORY;
        }
        if (k == half - 1 && status == SPRINGLS_OK) {
            status = measure_halfway(course, 0.5 * problem->duration);
        }
    }
    f[MOTION_springls_mean] /= f[MOTION_steps];
    return status;
}

static void run_case(struct motion_case *c, int order)
{
    struct course course;
    memset(&course, 0, sizeof course);
    course.motion = c->motion;
    course.order = order;
    course.figures = c->figures[order];
    course.forces.velocity = ordered_velocity;
    course.forces.pressure = c->motion->pressure ? ordered_pressure : NULL;
    course.forces.user = &course;
    for (int f = 0; f < MOTION_FIGURE_COUNT; ++f) {
        course.figures[f] = NAN;
    }
    c->failures[order][0] = '\0';
    springls_status status = make_model(&course, &c->setting);
    status = status == SPRINGLS_OK ? move(&course, &c->setting) : status;
    status = status == SPRINGLS_OK ? measure_end(&course) : status;
    if (status != SPRINGLS_OK) {
        snprintf(c->failures[order], sizeof c->failures[order], "after %d steps: %s",
                 course.ctx ? springls_get_stats(course.ctx).steps : 0, springls_last_error(course.ctx));
    }
    springls_destroy(course.ctx);
    free(course.samples);
    free(course.on_edge);
}

struct all_runs {
    struct motion_case *cases;
    struct progress progress;
    int orders, done;
};

static void run_cases(void *arg, int begin, int end)
{
    struct all_runs *all = arg;
    for (int i = begin; i < end; ++i) {
        run_case(&all->cases[i / all->orders], i % all->orders);
        threads_lock();
        progress_update(&all->progress, (size_t)++all->done, NULL);
        threads_unlock();
    }
}

void motion_run_all(struct motion_case *cases, int count, int orders)
{
    struct all_runs all = {.cases = cases, .orders = orders};
    run_start_threads(0);
    progress_begin(&all.progress, "runs", (size_t)(count * orders), false);
    threads_for(count * orders, 1, run_cases, &all);
    progress_end(&all.progress);
}

/* ---- results ---- */

struct motion_spread motion_spread(const struct motion_case *c, int orders, enum motion_figure figure)
{
    struct motion_spread s = {0.0, INFINITY, -INFINITY};
    for (int order = 0; order < orders; ++order) {
        const double value = c->failures[order][0] ? NAN : c->figures[order][figure];
        s.mean += value / orders;
        s.least = fmin(s.least, value);
        s.most = fmax(s.most, value);
    }
    if (!isfinite(s.mean)) {
        s.least = s.most = NAN;
    }
    return s;
}

double motion_mean(const struct motion_case *c, int orders, enum motion_figure figure)
{
    return motion_spread(c, orders, figure).mean;
}

int motion_print_failures(const struct motion_case *cases, int count, int orders)
{
    int failures = 0;
    for (int i = 0; i < count * orders; ++i) {
        const struct motion_case *c = &cases[i / orders];
        if (c->failures[i % orders][0]) {
            printf("%s, order %d, stopped %s\n", c->name, i % orders, c->failures[i % orders]);
            ++failures;
        }
    }
    return failures;
}

#define MOTION_FIGURE_TEXT(name) #name,
static const char *const figure_names[MOTION_FIGURE_COUNT] = {MOTION_FIGURES(MOTION_FIGURE_TEXT)};

void motion_json(struct json_writer *json, const struct motion_case *c, int orders)
{
    json_string(json, "name", c->name);
    for (int f = 0; f < MOTION_FIGURE_COUNT; ++f) {
        double values[MOTION_ORDERS];
        for (int order = 0; order < orders; ++order) {
            values[order] = c->figures[order][f];
        }
        json_numbers(json, figure_names[f], values, (size_t)orders);
    }
    json_array_begin(json, "failures");
    for (int order = 0; order < orders; ++order) {
        json_string(json, NULL, c->failures[order]);
    }
    json_array_end(json);
}

double environment_number(const char *name, double otherwise)
{
    const char *text = getenv(name);
    return text && text[0] ? strtod(text, NULL) : otherwise;
}
