/* attributes.c - compares attributes that springls carry with the exact answer. A textured ball goes through LeVeque's flow
 * and back; two balls of two colors meet, are one body for a while, and separate. At T/2 and T every springl and every vertex
 * of the zero level is moved back to its start by the exact flow, which gives the attributes it should have. Three ways to
 * texture are compared: channels carried by springls, places on the original mesh for look-up (material coordinates), and
 * texture coordinates with a seam. */
#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "springls/benchmark.h"
#include "springls/exact_flows.h"
#include "springls/run_options.h"
#include "springls_cl.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

enum { TIMES = 3, COLORS = 3 };

/* ---- the flows ---- */

struct meeting { /* both sides of the plane x = middle approach it by `amplitude`, spread along it, and return */
    double middle, width, amplitude, period;
};

struct flow {
    const char *name, *title;
    springls_velocity_fn velocity;
    void *user;
    double period;
    int balls;
};

static void meeting_velocity(void *user, const float *x, int count, float time, float *v)
{
    const struct meeting *m = user;
    const double speed = m->amplitude * pi / m->period * cos(pi * (double)time / m->period);
    for (int i = 0; i < count; ++i, x += 3, v += 3) {
        const double y = tanh(((double)x[0] - m->middle) / m->width), out = 0.5 * speed / m->width * (1.0 - y * y);
        v[0] = (float)(-speed * y);
        v[1] = (float)(out * ((double)x[1] - m->middle));
        v[2] = (float)(out * ((double)x[2] - m->middle));
    }
}

/* Computes factor * u(x): the flows are u(x) cos(pi t / T), and on the way back from T/2 the factor is -sin(pi s / T). */
static void exact_velocity(const void *user, const double x[3], double factor, double v[3])
{
    const struct flow *flow = user;
    const float at[3] = {(float)x[0], (float)x[1], (float)x[2]};
    float u[3];
    flow->velocity(flow->user, at, 1, 0.0f, u);
    for (int c = 0; c < 3; ++c) {
        v[c] = factor * (double)u[c];
    }
}

static double backwards(const void *user, double time) { return -sin(pi * time / ((const struct flow *)user)->period); }

/* ---- the input ball: rings and slices, with a seam in its texture coordinates ---- */

struct textured {
    float *positions, *corner_uv;
    int *triangles, *neighbors;
    int position_count, triangle_count;
    int first_of[3];        /* the first triangle of each ball, and the end */
    float center[2][3], radius;
};

static void textured_free(struct textured *t)
{
    free(t->positions);
    free(t->corner_uv);
    free(t->triangles);
    free(t->neighbors);
}

static void ball_triangle(struct textured *t, const int corners[3], const float uv[6])
{
    memcpy(t->triangles + 3 * t->triangle_count, corners, 3 * sizeof *corners);
    memcpy(t->corner_uv + 6 * t->triangle_count, uv, 6 * sizeof *uv);
    t->triangle_count++;
}

static void add_ball(struct textured *t, int rings, int slices, const float center[3])
{
    const int first = t->position_count;
    for (int r = 0; r <= rings; ++r) {
        for (int s = 0; s < (r == 0 || r == rings ? 1 : slices); ++s) {
            const double polar = pi * r / rings, around = 2.0 * pi * s / slices;
            float *p = t->positions + 3 * t->position_count++;
            p[0] = center[0] + t->radius * (float)(sin(polar) * cos(around));
            p[1] = center[1] + t->radius * (float)(sin(polar) * sin(around));
            p[2] = center[2] + t->radius * (float)cos(polar);
        }
    }
    const int last = t->position_count - 1;
    for (int r = 0; r < rings; ++r) {
        for (int s = 0; s < slices; ++s) {
            const int next = (s + 1) % slices, above = first + 1 + (r - 1) * slices, below = above + slices;
            const float u0 = (float)s / (float)slices, u1 = (float)(s + 1) / (float)slices, um = 0.5f * (u0 + u1);
            const float v0 = (float)r / (float)rings, v1 = (float)(r + 1) / (float)rings;
            if (r == 0) {
                ball_triangle(t, (int[3]){first, below + s, below + next}, (float[6]){um, v0, u0, v1, u1, v1});
            } else if (r == rings - 1) {
                ball_triangle(t, (int[3]){above + s, last, above + next}, (float[6]){u0, v0, um, v1, u1, v0});
            } else {
                ball_triangle(t, (int[3]){above + s, below + s, below + next}, (float[6]){u0, v0, u0, v1, u1, v1});
                ball_triangle(t, (int[3]){above + s, below + next, above + next}, (float[6]){u0, v0, u1, v1, u1, v0});
            }
        }
    }
}

static bool textured_make(struct textured *t, int balls)
{
    const int rings = (int)(pi * (double)t->radius / 1.1) + 3, slices = 2 * rings; /* triangles about as large as a voxel */
    const size_t vertices = (size_t)balls * ((size_t)rings * (size_t)slices + 2),
        triangles = (size_t)balls * 2 * (size_t)rings * (size_t)slices;
    t->positions = malloc(vertices * 3 * sizeof *t->positions);
    t->triangles = malloc(triangles * 3 * sizeof *t->triangles);
    t->neighbors = malloc(triangles * 3 * sizeof *t->neighbors);
    t->corner_uv = malloc(triangles * 6 * sizeof *t->corner_uv);
    if (!t->positions || !t->triangles || !t->neighbors || !t->corner_uv) {
        return false;
    }
    for (int b = 0; b < balls; ++b) {
        add_ball(t, rings, slices, t->center[b]);
        t->first_of[b + 1] = t->triangle_count;
    }
    return true;
}

/* ---- carried attributes: a smooth color and the number of the ball ---- */

static void color_at(const struct textured *t, int ball, const double x[3], double out[COLORS])
{
    const double scale = 3.0 / (double)t->radius; /* about three waves around the ball */
    for (int c = 0; c < COLORS; ++c) {
        const double y = scale * (x[c] - (double)t->center[ball][c]);
        out[c] = 0.5 + 0.25 * sin(y) + 0.2 * cos(0.7 * scale * (x[(c + 1) % 3] - (double)t->center[ball][(c + 1) % 3]) + c);
    }
}

static int ball_at(const struct textured *t, int balls, const double x[3])
{
    return balls > 1 && x[0] > 0.5 * ((double)t->center[0][0] + (double)t->center[1][0]);
}

static void uv_at(const struct textured *t, int ball, const double x[3], double uv[2])
{
    const double d[3] = {x[0] - (double)t->center[ball][0], x[1] - (double)t->center[ball][1], x[2] - (double)t->center[ball][2]};
    const double around = atan2(d[1], d[0]) / (2.0 * pi), r = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    uv[0] = around < 0.0 ? around + 1.0 : around;
    uv[1] = acos(fmax(-1.0, fmin(1.0, d[2] / r))) / pi;
}

/* ---- measures at one time ---- */

struct error {
    double mean, q95, max;
};

struct moment {
    double time;
    int springls, original, split, filled, components, euler;
    struct error carried, carried_on_mesh, looked_up, place, uv; /* colours: 0..1; place: voxels; uv: arc, voxels */
    double wrong_labels_percent, wrong_labels_on_mesh_percent;
    int triangles, torn, torn_naively; /* triangles across which u jumps by more than half */
    struct image texture, colors;
};

struct run {
    struct cli_common common;
    const char *which, *set;
    double period;
    const struct flow *flow;
    struct textured ball;
    springls_context *ctx;
    int color, label;
    struct moment moments[TIMES];
    springls_stats stats;
    double seconds;
};

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct error error_of(double *values, int count)
{
    struct error e = {0.0, 0.0, 0.0};
    for (int i = 0; i < count; ++i) {
        e.mean += values[i] / count;
    }
    if (count > 0) {
        qsort(values, (size_t)count, sizeof *values, compare);
        e.q95 = values[(int)(0.95 * (count - 1))];
        e.max = values[count - 1];
    }
    return e;
}

/* Moves points back to where the exact flow had them at the start. */
static void to_start(const struct run *run, double time, double *points, int count)
{
    if (time > 0.25 * run->flow->period && time < 0.75 * run->flow->period) { /* else they are at the start */
        const struct benchmark exact = {.flow = (void *)(uintptr_t)run->flow, .exact_velocity = exact_velocity,
                                        .exact_time_factor = backwards};
        benchmark_flow(&exact, 0.5 * run->flow->period, points, count);
    }
}

static double color_error(const struct run *run, const double start[3], const float *color)
{
    double exact[COLORS], sum = 0.0;
    color_at(&run->ball, ball_at(&run->ball, run->flow->balls, start), start, exact);
    for (int c = 0; c < COLORS; ++c) {
        sum += (exact[c] - (double)color[c]) * (exact[c] - (double)color[c]);
    }
    return sqrt(sum / COLORS);
}

static const float *row(springls_view view,
                        int i) { return (const float *)(const void *)((const char *)(const void *)view.data
                                                                      + (size_t)i * view.stride); }

/* Measures the colors and labels that springls carry. */
static bool measure_springls(const struct run *run, struct moment *m)
{
    const springls_view p = springls_view_particles(run->ctx), colors = springls_view_attribute(run->ctx, run->color);
    const springls_view labels = springls_view_attribute(run->ctx, run->label);
    const int n = springls_count(run->ctx);
    double *start = malloc(((size_t)n + 1) * 3 * sizeof *start), *errors = malloc(((size_t)n + 1) * sizeof *errors);
    springls_provenance *confidence = malloc(((size_t)n + 1) * sizeof *confidence);
    bool fine = start && errors && confidence && springls_get_provenance(run->ctx, confidence) == SPRINGLS_OK;
    int wrong = 0;
    for (int i = 0; fine && i < n; ++i) {
        for (int c = 0; c < 3; ++c) {
            start[3 * i + c] = (double)row(p, i)[c];
        }
        m->original += confidence[i].kind == SPRINGLS_KIND_ORIGINAL;
        m->split += confidence[i].kind == SPRINGLS_KIND_SPLIT;
        m->filled += confidence[i].kind == SPRINGLS_KIND_FILLED;
    }
    if (fine) {
        to_start(run, m->time, start, n);
    }
    for (int i = 0; fine && i < n; ++i) {
        errors[i] = color_error(run, start + 3 * i, row(colors, i));
        wrong += (int)row(labels, i)[0] != ball_at(&run->ball, run->flow->balls, start + 3 * i);
    }
    m->springls = n;
    if (fine) {
        m->carried = error_of(errors, n);
        m->wrong_labels_percent = n > 0 ? 100.0 * wrong / n : 0.0;
    }
    free(start);
    free(errors);
    free(confidence);
    return fine;
}

/* Attributes of the vertices and corners of the zero level: colors and labels blended from springls; places, colors and
 * texture coordinates looked up on the input mesh. */
struct surface_data {
    springls_mesh mesh;
    springls_material *places, *corners, *naive;
    float *colors, *labels, *at, *looked_up, *original_colors, *uv, *naive_uv;
    double *start, *errors, *centroids;
};

static void surface_data_free(const struct run *run, struct surface_data *d)
{
    springls_mesh_free(run->ctx, &d->mesh);
    free(d->places);
    free(d->corners);
    free(d->naive);
    free(d->colors);
    free(d->labels);
    free(d->at);
    free(d->looked_up);
    free(d->original_colors);
    free(d->uv);
    free(d->naive_uv);
    free(d->start);
    free(d->errors);
    free(d->centroids);
}

static bool read_surface_data(const struct run *run, struct surface_data *d)
{
    const struct textured *ball = &run->ball;
    if (springls_extract_mesh(run->ctx, &d->mesh) != SPRINGLS_OK) {
        return false;
    }
    const size_t v = (size_t)d->mesh.vertex_count + 1, t = (size_t)d->mesh.triangle_count + 1;
    d->places = malloc(v * sizeof *d->places);
    d->corners = malloc(3 * t * sizeof *d->corners);
    d->naive = malloc(3 * t * sizeof *d->naive);
    d->colors = malloc(v * COLORS * sizeof *d->colors);
    d->labels = malloc(v * sizeof *d->labels);
    d->at = malloc(v * 3 * sizeof *d->at);
    d->looked_up = malloc(v * COLORS * sizeof *d->looked_up);
    d->original_colors = malloc(((size_t)ball->position_count + 1) * COLORS * sizeof *d->original_colors);
    d->uv = malloc(6 * t * sizeof *d->uv);
    d->naive_uv = malloc(6 * t * sizeof *d->naive_uv);
    d->start = malloc(3 * v * sizeof *d->start);
    d->errors = malloc((v + t) * sizeof *d->errors);
    d->centroids = malloc(3 * t * sizeof *d->centroids);
    if (!d->places || !d->corners || !d->naive || !d->colors || !d->labels || !d->at || !d->looked_up || !d->original_colors
        || !d->uv
        || !d->naive_uv || !d->start || !d->errors || !d->centroids) {
        return false;
    }
    for (int i = 0; i < ball->position_count; ++i) {
        const double x[3] = {(double)ball->positions[3 * i], (double)ball->positions[3 * i + 1],
                             (double)ball->positions[3 * i + 2]};
        double color[COLORS];
        color_at(ball, ball_at(ball, run->flow->balls, x), x, color);
        for (int c = 0; c < COLORS; ++c) {
            d->original_colors[COLORS * i + c] = (float)color[c];
        }
    }
    const int vertices = d->mesh.vertex_count, corners = 3 * d->mesh.triangle_count, given = ball->triangle_count;
    if (springls_mesh_attribute(run->ctx, &d->mesh, run->color, d->colors) != SPRINGLS_OK
        || springls_mesh_attribute(run->ctx, &d->mesh, run->label, d->labels) != SPRINGLS_OK
        || springls_mesh_materials(run->ctx, &d->mesh, d->places) != SPRINGLS_OK
        || springls_corner_materials(run->ctx, &d->mesh, ball->neighbors, d->corners) != SPRINGLS_OK) {
        return false;
    }
    for (int i = 0; i < corners; ++i) { /* per vertex, which ignores the seam */
        d->naive[i] = d->places[d->mesh.triangles[i]];
    }
    return springls_interpolate_material(d->places, vertices, ball->positions, 3, ball->triangles, given, d->at) == SPRINGLS_OK
           && springls_interpolate_material(d->places, vertices, d->original_colors, COLORS, ball->triangles, given,
                                            d->looked_up) == SPRINGLS_OK
           && springls_interpolate_material(d->corners, corners, ball->corner_uv, 2, NULL, given, d->uv) == SPRINGLS_OK
           && springls_interpolate_material(d->naive, corners, ball->corner_uv, 2, NULL, given, d->naive_uv) == SPRINGLS_OK;
}

static int count_torn(const float *uv, int triangles)
{
    int torn = 0;
    for (int t = 0; t < triangles; ++t) {
        const float u[3] = {uv[6 * t], uv[6 * t + 2], uv[6 * t + 4]}, v = (uv[6 * t + 1] + uv[6 * t + 3] + uv[6 * t + 5]) / 3.0f;
        const bool at_pole = v < 0.05f || v > 0.95f; /* where all meridians meet */
        torn += !at_pole && fmaxf(u[0], fmaxf(u[1], u[2])) - fminf(u[0], fminf(u[1], u[2])) > 0.5f;
    }
    return torn;
}

/* Measures texture coordinates in the middle of every triangle, as arcs on the ball. */
static struct error uv_error(const struct run *run, struct surface_data *d, double time)
{
    const int triangles = d->mesh.triangle_count;
    for (int i = 0; i < 3 * triangles; ++i) {
        const int t = i / 3, c = i % 3;
        d->centroids[i] = 0.0;
        for (int k = 0; k < 3; ++k) {
            d->centroids[i] += (double)d->mesh.positions[3 * d->mesh.triangles[3 * t + k] + c] / 3.0;
        }
    }
    to_start(run, time, d->centroids, triangles);
    for (int t = 0; t < triangles; ++t) {
        const double *x = d->centroids + 3 * t, radius = (double)run->ball.radius;
        double exact[2], uv[2] = {0.0, 0.0};
        uv_at(&run->ball, ball_at(&run->ball, run->flow->balls, x), x, exact);
        for (int k = 0; k < 6; ++k) {
            uv[k % 2] += (double)d->uv[6 * t + k] / 3.0;
        }
        const double du = fabs(uv[0] - exact[0]), around = 2.0 * pi * radius * sin(pi * exact[1]) * fmin(du, 1.0 - du);
        d->errors[t] = hypot(around, pi * radius * (uv[1] - exact[1]));
    }
    return error_of(d->errors, triangles);
}

static void measure_mesh(const struct run *run, struct surface_data *d, struct moment *m)
{
    const int n = d->mesh.vertex_count;
    int wrong = 0;
    for (int i = 0; i < 3 * n; ++i) {
        d->start[i] = (double)d->mesh.positions[i];
    }
    to_start(run, m->time, d->start, n);
    for (int i = 0; i < n; ++i) {
        d->errors[i] = color_error(run, d->start + 3 * i, d->colors + COLORS * i);
        wrong += (int)lrintf(d->labels[i]) != ball_at(&run->ball, run->flow->balls, d->start + 3 * i);
    }
    m->carried_on_mesh = error_of(d->errors, n);
    m->wrong_labels_on_mesh_percent = n > 0 ? 100.0 * wrong / n : 0.0;
    for (int i = 0; i < n; ++i) {
        d->errors[i] = color_error(run, d->start + 3 * i, d->looked_up + COLORS * i);
    }
    m->looked_up = error_of(d->errors, n);
    for (int i = 0; i < n; ++i) {
        double sum = 0.0;
        for (int c = 0; c < 3; ++c) {
            sum += (d->start[3 * i + c] - (double)d->at[3 * i + c]) * (d->start[3 * i + c] - (double)d->at[3 * i + c]);
        }
        d->errors[i] = sqrt(sum);
    }
    m->place = error_of(d->errors, n);
    m->uv = uv_error(run, d, m->time);
    m->triangles = d->mesh.triangle_count;
    m->torn = count_torn(d->uv, m->triangles);
    m->torn_naively = count_torn(d->naive_uv, m->triangles);
}

/* ---- pictures ---- */

/* Draws meridians and parallels, and a line of its own at the seam. */
static struct color texture_color(void *user, const float uvb[3])
{
    (void)user;
    const bool dark = ((int)floorf(16.0f * uvb[0]) + (int)floorf(8.0f * uvb[1])) & 1;
    if (uvb[0] < 0.006f || uvb[0] > 0.994f) {
        return color_rgb(0.9f, 0.1f, 0.1f);
    }
    return color_mix(color_hsv(uvb[0] * 2.0f + 0.3f * uvb[2], 0.55f, 0.95f), color_rgb(0.15f, 0.15f, 0.25f), dark ? 0.55f : 0.0f);
}

static bool draw(const struct run *run, const struct surface_data *d, struct moment *m)
{
    const size_t corners = 3 * (size_t)d->mesh.triangle_count;
    float *soup = malloc((3 * corners + 1) * sizeof *soup), *normals = malloc((3 * corners + 1) * sizeof *normals);
    float *uvb = malloc((3 * corners + 1) * sizeof *uvb), *colors = malloc((3 * corners + 1) * sizeof *colors);
    bool fine = soup && normals && uvb && colors;
    for (size_t i = 0; fine && i < corners; ++i) {
        const size_t v = 3 * (size_t)d->mesh.triangles[i];
        memcpy(soup + 3 * i, d->mesh.positions + v, 3 * sizeof *soup);
        memcpy(normals + 3 * i, d->mesh.normals + v, 3 * sizeof *normals);
        memcpy(colors + 3 * i, d->colors + v, 3 * sizeof *colors);
        uvb[3 * i] = d->uv[2 * i];
        uvb[3 * i + 1] = d->uv[2 * i + 1];
        uvb[3 * i + 2] = d->labels[v / 3];
    }
    if (fine) {
        const float direction[3] = {0.9f, -0.55f, 0.45f}, up[3] = {0.0f, 0.0f, 1.0f};
        struct raycast_scene scene = {.positions = soup, .vertex_count = corners, .triangle_count = corners / 3,
                                      .normals = normals};
        scene.camera = raycast_frame_points(soup, corners, direction, up, 0.0f, 1.0f);
        scene.background_top = scene.background_bottom = color_rgb(1.0f, 1.0f, 1.0f);
        scene.vertex_originals = uvb;
        scene.color_at = texture_color;
        fine = raycast_render(&scene, 460, 460, &m->texture);
        scene.vertex_originals = NULL;
        scene.vertex_colors = colors;
        fine = fine && raycast_render(&scene, 460, 460, &m->colors);
    }
    (void)run;
    free(soup);
    free(normals);
    free(uvb);
    free(colors);
    return fine;
}

static bool write_picture(const struct run *run)
{
    char path[1024], name[64], captions[2 * TIMES][64];
    const char *texts[2 * TIMES];
    struct image images[2 * TIMES], strip = {0};
    for (int i = 0; i < 2 * TIMES; ++i) {
        const struct moment *m = &run->moments[i % TIMES];
        images[i] = i < TIMES ? m->texture : m->colors;
        snprintf(captions[i], sizeof captions[i], i < TIMES ? "t = %.2f: texture, looked up" : "t = %.2f: colours, carried",
                 m->time);
        texts[i] = captions[i];
    }
    snprintf(name, sizeof name, "attributes-%s.png", run->flow->name);
    run_path(run->common.out, name, path, sizeof path);
    errno = 0; /* not every failure below sets it */
    const bool fine =
        image_strip(images, texts, 2 * TIMES, TIMES, color_rgb(1.0f, 1.0f, 1.0f), &strip) && image_write_png(&strip, path);
    image_free(&strip);
    return fine || cli_write_failed("attributes", path);
}

/* ---- one run ---- */

static bool take_moment(struct run *run, int index)
{
    struct moment *m = &run->moments[index];
    struct surface_data d;
    springls_measures measures;
    memset(&d, 0, sizeof d);
    m->time = springls_time(run->ctx);
    bool fine = measure_springls(run, m) && read_surface_data(run, &d) && springls_measure(run->ctx, &measures) == SPRINGLS_OK;
    if (fine) {
        measure_mesh(run, &d, m);
        m->components = measures.components;
        m->euler = measures.euler;
        fine = !run->common.out || draw(run, &d, m);
    }
    surface_data_free(run, &d);
    return fine;
}

static bool give_attributes(struct run *run)
{
    const springls_view p = springls_view_particles(run->ctx);
    const int n = springls_count(run->ctx);
    const springls_attribute_desc color = {"colour", COLORS, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY};
    const springls_attribute_desc label = {"label", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY};
    float *values = malloc(((size_t)n + 1) * COLORS * sizeof *values), *labels = malloc(((size_t)n + 1) * sizeof *labels);
    bool fine = values && labels;
    for (int i = 0; fine && i < n; ++i) {
        const double x[3] = {(double)row(p, i)[0], (double)row(p, i)[1], (double)row(p, i)[2]};
        const int ball = ball_at(&run->ball, run->flow->balls, x);
        double exact[COLORS];
        color_at(&run->ball, ball, x, exact);
        for (int c = 0; c < COLORS; ++c) {
            values[COLORS * i + c] = (float)exact[c];
        }
        labels[i] = (float)ball;
    }
    fine = fine && springls_add_attribute(run->ctx, &color, values, &run->color) == SPRINGLS_OK
           && springls_add_attribute(run->ctx, &label, labels, &run->label) == SPRINGLS_OK;
    free(values);
    free(labels);
    return fine;
}

static bool set_up(struct run *run)
{
    struct textured *b = &run->ball;
    return textured_make(b, run->flow->balls)
           && springls_set_mesh(run->ctx, b->positions, b->position_count, 0, b->triangles, b->triangle_count,
                                NULL) == SPRINGLS_OK
           && springls_find_seams(run->ctx, b->positions, b->position_count, 0, b->triangles, b->triangle_count, b->corner_uv, 2,
                                  b->neighbors) == SPRINGLS_OK
           && give_attributes(run);
}

static bool move(struct run *run)
{
    const springls_forces forces = {.velocity = run->flow->velocity, .user = run->flow->user};
    const int calls = 20;
    const springls_step_desc step = {.forces = &forces, .dt = (float)(run->flow->period / (2 * calls)), .max_displacement = 2.0f};
    struct progress bar;
    progress_begin(&bar, run->flow->name, (size_t)(2 * calls), run->common.quiet);
    bool fine = take_moment(run, 0);
    for (int i = 1; fine && i <= 2 * calls; ++i) {
        fine = springls_step(run->ctx, &step) == SPRINGLS_OK;
        if (fine && i % calls == 0) {
            fine = take_moment(run, i / calls);
        }
        progress_update(&bar, (size_t)i, NULL);
    }
    progress_end(&bar);
    run->stats = springls_get_stats(run->ctx);
    return fine;
}

/* ---- reports ---- */

static void print_error(const char *what, const char *unit, struct error e)
{
    printf("  %-34s mean %.4f  95 %% %.4f  max %.4f %s\n", what, e.mean, e.q95, e.max, unit);
}

static void print_run(const struct run *run)
{
    static const char *const when[TIMES] = {"at the start", "half way", "at the end"};
    printf("%s, grid %d, %d triangles given\n", run->flow->title, run->common.grid, run->ball.triangle_count);
    for (int i = 0; i < TIMES; ++i) {
        const struct moment *m = &run->moments[i];
        printf(" %s: %d springls (%d original, %d split, %d filled), %d component%s\n", when[i], m->springls, m->original,
               m->split, m->filled,
               m->components, m->components == 1 ? "" : "s");
        print_error("colour carried by springls", "", m->carried);
        print_error("colour carried, on vertices", "", m->carried_on_mesh);
        print_error("colour looked up, on vertices", "", m->looked_up);
        print_error("place on the original", "voxel", m->place);
        print_error("texture coordinates, as arcs", "voxel", m->uv);
        printf("  triangles torn at the seam: %d of %d (%d vertex by vertex)\n", m->torn, m->triangles, m->torn_naively);
        if (run->flow->balls > 1) {
            printf("  wrong labels: %.2f %% of springls, %.2f %% of vertices\n", m->wrong_labels_percent,
                   m->wrong_labels_on_mesh_percent);
        }
    }
}

static void json_error(struct json_writer *json, const char *key, struct error e)
{
    json_object_begin(json, key);
    json_number(json, "mean", e.mean);
    json_number(json, "q95", e.q95);
    json_number(json, "max", e.max);
    json_object_end(json);
}

static void json_run(struct json_writer *json, const struct run *run)
{
    json_object_begin(json, NULL);
    json_string(json, "problem", run->flow->name);
    json_integer(json, "grid", run->common.grid);
    json_number(json, "period", run->flow->period);
    json_integer(json, "triangles_given", run->ball.triangle_count);
    json_integer(json, "steps", run->stats.steps);
    json_integer(json, "split", run->stats.split);
    json_integer(json, "added", run->stats.added);
    json_integer(json, "removed", run->stats.removed);
    json_number(json, "seconds_total", run->seconds);
    json_array_begin(json, "moments");
    for (int i = 0; i < TIMES; ++i) {
        const struct moment *m = &run->moments[i];
        json_object_begin(json, NULL);
        json_number(json, "time", m->time);
        json_integer(json, "springls", m->springls);
        json_integer(json, "original", m->original);
        json_integer(json, "split", m->split);
        json_integer(json, "filled", m->filled);
        json_integer(json, "components", m->components);
        json_integer(json, "euler", m->euler);
        json_error(json, "carried", m->carried);
        json_error(json, "carried_on_mesh", m->carried_on_mesh);
        json_error(json, "looked_up", m->looked_up);
        json_error(json, "place", m->place);
        json_error(json, "uv", m->uv);
        json_integer(json, "triangles", m->triangles);
        json_integer(json, "torn", m->torn);
        json_integer(json, "torn_vertex_by_vertex", m->torn_naively);
        json_number(json, "wrong_labels_percent", m->wrong_labels_percent);
        json_number(json, "wrong_labels_on_mesh_percent", m->wrong_labels_on_mesh_percent);
        json_object_end(json);
    }
    json_array_end(json);
    json_object_end(json);
}

static int run_flow(struct run *run, const springls_params *params, springls_backend *backend, struct json_writer *json)
{
    const int n = run->common.grid;
    springls_desc desc = {.grid = {.size = {n, n, n}}, .params = params, .backend = backend};
    int status = run_create("attributes", &desc, &run->ctx);
    if (status != CLI_CONTINUE) {
        return status;
    }
    const double begin = elapsed_seconds();
    bool fine = set_up(run) && move(run);
    run->seconds = elapsed_seconds() - begin;
    if (!fine) {
        status = cli_fail("attributes", CLI_EXIT_FAILURE, "%s: %s", run->flow->name,
                          *springls_last_error(run->ctx) ? springls_last_error(run->ctx) : "out of memory");
    } else if (run->common.out && !write_picture(run)) {
        status = CLI_EXIT_FAILURE;
    } else {
        if (!run->common.json || strcmp(run->common.json, "-") != 0) {
            print_run(run);
        }
        if (run->common.json) {
            json_run(json, run);
        }
    }
    for (int i = 0; i < TIMES; ++i) {
        image_free(&run->moments[i].texture);
        image_free(&run->moments[i].colors);
    }
    textured_free(&run->ball);
    springls_destroy(run->ctx);
    return status;
}

static int run_all(struct run *options, const springls_params *params, springls_backend *backend, struct json_writer *json)
{
    const double n = options->common.grid;
    struct exact_flow leveque = EXACT_DEFORMATION((float)n, (float)options->period);
    struct meeting meeting = {0.5 * n, 0.05 * n, 0.08 * n, options->period}; /* a gap of 1.5 voxels becomes one of 0.3 */;
    const struct flow flows[2] = {{"leveque", "LeVeque's flow", exact_flow_velocity, &leveque, options->period, 1},
                                  {"meeting", "two balls meet and part", meeting_velocity, &meeting, options->period, 2}};
    int status = CLI_CONTINUE;
    for (int i = 0; i < 2 && status == CLI_CONTINUE; ++i) {
        struct run run = *options;
        if (strcmp(options->which, "both") != 0 && strcmp(options->which, flows[i].name) != 0) {
            continue;
        }
        run.flow = &flows[i];
        run.ball.radius = (float)(0.15 * n);
        for (int c = 0; c < 3; ++c) {
            run.ball.center[0][c] = run.ball.center[1][c] = (float)((i == 0 ? 0.35 : 0.5) * n);
        }
        if (i == 1) {
            run.ball.center[0][0] -= run.ball.radius + 0.75f;
            run.ball.center[1][0] += run.ball.radius + 0.75f;
        }
        status = run_flow(&run, params, backend, json);
    }
    return status;
}

int main(int argc, char **argv)
{
    struct run options = {.common = cli_common_defaults(), .which = "both", .period = 2.0};
    springls_params params;
    const struct cli_option table[] = {
        {"flow", CLI_CHOICE, &options.which, "NAME", "leveque, meeting or both", 0.0, 0.0, "leveque|meeting|both"},
        {"period", CLI_DOUBLE, &options.period, "T", "period of the flow", 0.01, 100.0, NULL},
        {"set", CLI_STRING, &options.set, "LIST", RUN_OPTIONS_SET_HELP, 0.0, 0.0, NULL},
    };
    static const struct cli_writes writes[] = {{.files = "attributes-*.png"}};
    const struct cli_program program = {.name = "attributes",
                                        .summary = "what springls carry, against the exact answer",
                                        .common = &options.common,
                                        .options = table,
                                        .option_count = (int)(sizeof table / sizeof *table),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE) {
        status = run_options("attributes", &options.common, options.set, &params);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    options.common.grid = options.common.grid > 0 ? options.common.grid : 64;
    struct json_writer json;
    if (options.common.json && !json_open(&json, options.common.json)) {
        cli_write_failed("attributes", options.common.json);
        return CLI_EXIT_FAILURE;
    }
    springls_backend *backend =
        run_backend_with("attributes", &options.common, exact_flow_velocity, exact_flow_source(), sizeof(struct exact_flow));
    if (options.common.json) {
        json_object_begin(&json, NULL);
        json_string(&json, "params", options.common.params);
        json_string(&json, "backend", run_backend_name(backend));
        json_integer(&json, "threads", threads_count());
        json_array_begin(&json, "flows");
    }
    status = run_all(&options, &params, backend, &json);
    springls_cl_destroy(backend);
    if (options.common.json) {
        json_array_end(&json);
        json_object_end(&json);
        if (!json_close(&json) && status == CLI_CONTINUE) {
            cli_write_failed("attributes", options.common.json);
            status = CLI_EXIT_FAILURE;
        }
    }
    return status == CLI_CONTINUE ? CLI_EXIT_OK : status;
}
