/* tilings [PAGE] - many bodies in one space: two half-balls in LeVeque's flow beside their exact wall, what that and more bodies cost
   beside one model, eight octants, wedges alone, sheets under pressure, double bubbles, and balls that grow until they meet.
   Writes a page of Markdown; ONLY=NAME prints one section of it, FULL=1 adds a row of a thousand balls. Times are the processor's; one
   thread, where nothing else is said. */
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#include "springls.h"

#include "examples/common/springls/exact_flows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_POINTS = 20000, MOST_BALLS = 1000, BALL_STEPS = 40 };

static double seconds(void) { return (double)clock() / (double)CLOCKS_PER_SEC; }

static double by_the_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void check(springls_status status, const springls_tiling *tiling)
{
    if (status == SPRINGLS_OK) return;
    fprintf(stderr, "tilings: %s\n", tiling ? springls_tiling_last_error(tiling) : springls_status_string(status));
    exit(1);
}

/* ---- places and distances ---- */

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void difference(const double *a, const double *b, double *out)
{
    int k;
    for (k = 0; k < 3; k++) out[k] = a[k] - b[k];
}

/* Returns the squared distance of p from the segment from a to b. */
static double to_segment(const double *p, const double *a, const double *b)
{
    double ab[3], ap[3], d[3], t, l2;
    int k;
    difference(b, a, ab);
    difference(p, a, ap);
    l2 = dot(ab, ab);
    t = l2 > 0.0 ? dot(ab, ap) / l2 : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    for (k = 0; k < 3; k++) d[k] = ap[k] - t * ab[k];
    return dot(d, d);
}

/* Returns the squared distance of p from a triangle. */
static double to_triangle(const double *p, double q[3][3])
{
    double u[3], v[3], w[3], uu, uv, vv, wu, wv, det, best = HUGE_VAL;
    int k;
    difference(q[1], q[0], u);
    difference(q[2], q[0], v);
    difference(p, q[0], w);
    uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
    det = uu * vv - uv * uv;
    if (det > 1e-14) {
        const double s = (vv * wu - uv * wv) / det, t = (uu * wv - uv * wu) / det;
        double foot[3];
        for (k = 0; k < 3; k++) foot[k] = w[k] - s * u[k] - t * v[k];
        if (s >= 0.0 && t >= 0.0 && s + t <= 1.0) return dot(foot, foot);
    }
    for (k = 0; k < 3; k++) {
        const double d = to_segment(p, q[k], q[(k + 1) % 3]);
        if (d < best) best = d;
    }
    return best;
}

/* Errors of exact points: distances to what they belong to; points with nothing within `reach` are missing. */
typedef struct errors { double mean, largest, at_99, missing; } errors;

static const double reach = 4.0; /* voxels */

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void corner_of(const springls_walls *walls, int vertex, double *out)
{
    int k;
    for (k = 0; k < 3; k++) out[k] = (double)walls->positions[3 * vertex + k];
}

/* Returns the distance of a point from the wall between two labels, or, lines: from the edges where walls meet. */
static double distance_to(const springls_walls *walls, int lines, int one, int other, const double *p)
{
    double best = HUGE_VAL, q[3][3], d;
    int i, k;
    for (i = 0; i < (lines ? walls->edge_count : walls->triangle_count); i++) {
        if (!lines && !(walls->labels[2 * i] == one && walls->labels[2 * i + 1] == other)
            && !(walls->labels[2 * i] == other && walls->labels[2 * i + 1] == one)) continue;
        for (k = 0; k < (lines ? 2 : 3); k++) corner_of(walls, lines ? walls->edges[2 * i + k] : walls->triangles[3 * i + k], q[k]);
        d = lines ? to_segment(p, q[0], q[1]) : to_triangle(p, q);
        if (d < best) best = d;
    }
    return sqrt(best);
}

static errors errors_of(const springls_walls *walls, int lines, int one, int other, const double *points, int count)
{
    static double all[MOST_POINTS];
    errors e = { 0.0, 0.0, 0.0, 0.0 };
    int i, n = 0;
    for (i = 0; i < count; i++) {
        const double d = distance_to(walls, lines, one, other, points + 3 * i);
        if (d > reach) continue;
        all[n++] = d;
        e.mean += d;
    }
    e.missing = 100.0 * (double)(count - n) / (double)count;
    if (n == 0) return e;
    qsort(all, (size_t)n, sizeof *all, compare);
    e.mean /= (double)n;
    e.largest = all[n - 1];
    e.at_99 = all[(int)(0.99 * (double)(n - 1))];
    return e;
}

/* ---- two half-balls in LeVeque's flow ---- */

/* The ball, cut by a plane askew to the grid; side 0: whole. */
typedef struct cut_ball { double center[3], radius, offset, normal[3], across[3], up[3]; int side; } cut_ball;

static void cut_ball_distance(void *user, const float *points, int count, float *out)
{
    const cut_ball *ball = (const cut_ball *)user;
    int i, k;
    for (i = 0; i < count; i++) {
        double d[3], v, h;
        for (k = 0; k < 3; k++) d[k] = (double)points[3 * i + k] - ball->center[k];
        v = sqrt(dot(d, d)) - ball->radius;
        h = (double)ball->side * (dot(d, ball->normal) - ball->offset);
        out[i] = (float)(ball->side && h > v ? h : v);
    }
}

static cut_ball cut_ball_of(int grid)
{
    cut_ball ball;
    double n[3] = { 1.0, 0.4, 0.25 }, a[3] = { -0.3, 1.0, 0.5 }, l;
    int k;
    memset(&ball, 0, sizeof ball);
    ball.radius = 0.15 * (double)grid;
    for (l = sqrt(dot(n, n)), k = 0; k < 3; k++) n[k] /= l;
    for (l = dot(a, n), k = 0; k < 3; k++) a[k] -= l * n[k];
    for (l = sqrt(dot(a, a)), k = 0; k < 3; k++) a[k] /= l;
    for (k = 0; k < 3; k++) {
        ball.center[k] = 0.35 * (double)grid;
        ball.normal[k] = n[k];
        ball.across[k] = a[k];
        ball.up[k] = n[(k + 1) % 3] * a[(k + 2) % 3] - n[(k + 2) % 3] * a[(k + 1) % 3];
    }
    return ball;
}

static void place_on(const cut_ball *ball, double a, double b, double *out)
{
    int k;
    for (k = 0; k < 3; k++) out[k] = ball->center[k] + a * ball->across[k] + b * ball->up[k];
}

/* The velocity in double precision, for exact points. */
static void exact_velocity(const double *x, double time, double grid, double period, double *v)
{
    const double pi = 3.14159265358979323846, f = cos(pi * time / period) * grid;
    double s[3], d[3];
    int k;
    for (k = 0; k < 3; k++) {
        s[k] = sin(pi * x[k] / grid);
        d[k] = 2.0 * s[k] * cos(pi * x[k] / grid);
        s[k] *= s[k];
    }
    v[0] = f * 2.0 * s[0] * d[1] * d[2];
    v[1] = -f * d[0] * s[1] * d[2];
    v[2] = -f * d[0] * d[1] * s[2];
}

/* Carries exact points from one time to another by the fourth-order Runge-Kutta method, in 300 steps. */
static void carry(double *points, int count, double from, double to, double grid, double period)
{
    const int steps = 300;
    const double h = (to - from) / (double)steps;
    int i, n, k;
    for (i = 0; i < count; i++)
        for (n = 0; n < steps; n++) {
            double *p = points + 3 * i, a[3], b[3], c[3], d[3], q[3];
            const double t = from + h * (double)n;
            exact_velocity(p, t, grid, period, a);
            for (k = 0; k < 3; k++) q[k] = p[k] + 0.5 * h * a[k];
            exact_velocity(q, t + 0.5 * h, grid, period, b);
            for (k = 0; k < 3; k++) q[k] = p[k] + 0.5 * h * b[k];
            exact_velocity(q, t + 0.5 * h, grid, period, c);
            for (k = 0; k < 3; k++) q[k] = p[k] + h * c[k];
            exact_velocity(q, t + h, grid, period, d);
            for (k = 0; k < 3; k++) p[k] += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
        }
}

static void flow_of_all(void *user, const springls_tiling_batch *batch, float *out)
{
    exact_flow_velocity(user, batch->batch.points, batch->batch.count, batch->batch.time, out);
}

/* Returns the seconds that the flow takes with one model, the whole ball. */
static double seconds_of_one(int grid, double period, int steps)
{
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, (float)period);
    cut_ball ball = cut_ball_of(grid);
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_context *ctx;
    double begin;
    int i;
    for (i = 0; i < 3; i++) desc.grid.size[i] = grid;
    check(springls_create(&desc, &ctx), NULL);
    check(springls_set_implicit(ctx, cut_ball_distance, &ball), NULL);
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    step.forces = &forces;
    step.dt = (float)(period / (double)steps);
    begin = seconds();
    check(springls_run(ctx, &step, steps), NULL);
    begin = seconds() - begin;
    springls_destroy(ctx);
    return begin;
}

static void report(FILE *file, int grid, const char *when, springls_tiling *tiling, const double *wall, int wall_points, const double *line,
                   int line_points, const springls_tiling_measures *start, const char *gap)
{
    springls_tiling_measures now[2];
    springls_walls walls;
    errors w, l;
    check(springls_tiling_measure(tiling, now), tiling);
    check(springls_tiling_extract(tiling, &walls), tiling);
    w = errors_of(&walls, 0, 1, 2, wall, wall_points);
    l = errors_of(&walls, 1, 0, 0, line, line_points);
    fprintf(file, "| %d | %s | %.4f | %.3f | %.2f | %.2f | %.3f | %.2f | %+.2f, %+.2f | %+.2f, %+.2f | %s | %d |\n", grid, when, w.mean,
            w.at_99, w.largest, w.missing, l.mean, l.missing, 100.0 * (now[0].volume / start[0].volume - 1.0),
            100.0 * (now[1].volume / start[1].volume - 1.0), 100.0 * ((double)now[0].voxels / (double)start[0].voxels - 1.0),
            100.0 * ((double)now[1].voxels / (double)start[1].voxels - 1.0), gap, walls.triangle_count);
    springls_walls_free(tiling, &walls);
}

/* Runs the flow; returns its seconds. */
static double half_balls(FILE *file, int grid, double period, int steps)
{
    static double wall[3 * MOST_POINTS], line[3 * MOST_POINTS];
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, (float)period);
    cut_ball first = cut_ball_of(grid), second = first;
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report steps_report;
    springls_tiling_measures start[2];
    springls_tiling *tiling;
    char gap[32] = "-";
    double begin, taken = 0.0, a, b;
    int i, part, walls = 0, lines = 0;
    for (i = 0; i < 3; i++) desc.grid.size[i] = grid;
    check(springls_tiling_create(&desc, &tiling), NULL);
    first.side = 1;
    second.side = -1;
    check(springls_tiling_add_implicit(tiling, 1, cut_ball_distance, &first), tiling);
    check(springls_tiling_add_implicit(tiling, 2, cut_ball_distance, &second), tiling);
    check(springls_tiling_measure(tiling, start), tiling);
    for (a = -first.radius; a < first.radius; a += 0.3)
        for (b = -first.radius; b < first.radius; b += 0.3)
            if (a * a + b * b < first.radius * first.radius) place_on(&first, a, b, wall + 3 * walls++);
    for (i = 0; i < 400; i++) {
        const double angle = 2.0 * 3.14159265358979323846 * (double)i / 400.0;
        place_on(&first, first.radius * cos(angle), first.radius * sin(angle), line + 3 * lines++);
    }
    report(file, grid, "start", tiling, wall, walls, line, lines, start, gap);
    step.velocity = flow_of_all;
    step.user = &flow;
    step.dt = (float)(period / (double)steps);
    for (part = 0; part < 2; part++) {
        begin = seconds();
        for (i = 0; i < steps / 2; i++) {
            check(springls_tiling_step(tiling, &step, &steps_report), tiling);
            if (steps_report.faced) snprintf(gap, sizeof gap, "%.3f, %.3f", (double)steps_report.mean_gap, (double)steps_report.rms_gap);
        }
        taken += seconds() - begin;
        carry(wall, walls, period / 2.0 * part, period / 2.0 * (part + 1), (double)grid, period);
        carry(line, lines, period / 2.0 * part, period / 2.0 * (part + 1), (double)grid, period);
        report(file, grid, part ? "end" : "half time", tiling, wall, walls, line, lines, start, gap);
    }
    springls_tiling_destroy(tiling);
    return taken;
}

/* ---- eight octants, and a wedge alone ---- */

/* An octant of the ball: bit k of `mask` is the side of the plane square to axis k of the ball (normal, across, up). */
typedef struct octant { cut_ball ball; int mask; } octant;

static const double *axis_of(const cut_ball *ball, int k) { return k == 0 ? ball->normal : k == 1 ? ball->across : ball->up; }

static void octant_distance(void *user, const float *points, int count, float *out)
{
    const octant *o = (const octant *)user;
    int i, k;
    for (i = 0; i < count; i++) {
        double d[3], v;
        for (k = 0; k < 3; k++) d[k] = (double)points[3 * i + k] - o->ball.center[k];
        v = sqrt(dot(d, d)) - o->ball.radius;
        for (k = 0; k < 3; k++) v = fmax(v, (o->mask >> k & 1 ? 1.0 : -1.0) * dot(d, axis_of(&o->ball, k)));
        out[i] = (float)v;
    }
}

/* Lists places on the wall between two octants that differ in their side of plane 0: in a quadrant of that plane. */
static int places_between(const cut_ball *ball, int quadrant, double *out)
{
    int count = 0;
    double a, b;
    for (a = 0.15; a < ball->radius; a += 0.4)
        for (b = 0.15; b < ball->radius; b += 0.4)
            if (a * a + b * b < ball->radius * ball->radius)
                place_on(ball, quadrant & 1 ? -a : a, quadrant & 2 ? -b : b, out + 3 * count++);
    return count;
}

static void report_octants(FILE *file, int grid, double period, const char *when, springls_tiling *tiling, double *points, const int *count)
{
    springls_walls walls;
    errors all = { 0.0, 0.0, 0.0, 0.0 }, e;
    double found = 0.0, worst = 0.0;
    int q, total = 0;
    check(springls_tiling_extract(tiling, &walls), tiling);
    for (q = 0; q < 4; q++) {
        const int mask = (q & 1 ? 2 : 0) | (q & 2 ? 4 : 0);
        e = errors_of(&walls, 0, mask + 1, mask + 2, points + 3 * total, count[q]);
        found += (1.0 - 0.01 * e.missing) * (double)count[q];
        all.mean += e.mean * (1.0 - 0.01 * e.missing) * (double)count[q];
        worst = fmax(worst, e.missing);
        total += count[q];
    }
    fprintf(file, "| %d | %.1f | %s | %.4f | %.2f | %.2f |\n", grid, period, when, all.mean / found, 100.0 * (1.0 - found / (double)total),
            worst);
    springls_walls_free(tiling, &walls);
}

/* Eight octants of the ball in the flow: the walls on the first plane. */
static void octants(FILE *file, int grid, double period, int steps)
{
    static double points[4 * 3 * MOST_POINTS];
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, (float)period);
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling *tiling;
    octant o;
    int i, part, count[4], total = 0;
    o.ball = cut_ball_of(grid);
    for (i = 0; i < 3; i++) desc.grid.size[i] = grid;
    check(springls_tiling_create(&desc, &tiling), NULL);
    for (o.mask = 0; o.mask < 8; o.mask++) check(springls_tiling_add_implicit(tiling, o.mask + 1, octant_distance, &o), tiling);
    for (i = 0; i < 4; i++) total += count[i] = places_between(&o.ball, i, points + 3 * total);
    step.velocity = flow_of_all;
    step.user = &flow;
    step.dt = (float)(period / (double)steps);
    for (part = 0; part < 2; part++) {
        for (i = 0; i < steps / 2; i++) check(springls_tiling_step(tiling, &step, NULL), tiling);
        carry(points, total, period / 2.0 * part, period / 2.0 * (part + 1), (double)grid, period);
        report_octants(file, grid, period, part ? "end" : "half time", tiling, points, count);
    }
    springls_tiling_destroy(tiling);
}

/* A half-ball alone in the flow, without a tiling. */
static void wedge(FILE *file, int grid, int steps, int side, int keep_edges)
{
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, 2.5f);
    cut_ball ball = cut_ball_of(grid);
    springls_desc desc = springls_default_desc();
    springls_params params = springls_default_params();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_measures before, after;
    springls_view places, origins;
    springls_context *ctx;
    int i, k, beyond = 0;
    for (i = 0; i < 3; i++) desc.grid.size[i] = grid;
    params.keep_edges = keep_edges;
    desc.params = &params;
    ball.side = side;
    check(springls_create(&desc, &ctx), NULL);
    check(springls_set_implicit(ctx, cut_ball_distance, &ball), NULL);
    check(springls_measure(ctx, &before), NULL);
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    step.forces = &forces;
    step.dt = (float)(2.5 / (double)steps);
    check(springls_run(ctx, &step, steps), NULL);
    check(springls_measure(ctx, &after), NULL);
    places = springls_view_particles(ctx);
    origins = springls_view_correspondences(ctx);
    for (i = 0; i < springls_count(ctx); i++) {
        double p[3], a[3], d[3];
        for (k = 0; k < 3; k++) {
            p[k] = (double)((const float *)(const void *)((const char *)places.data + (size_t)i * places.stride))[k];
            a[k] = (double)((const float *)(const void *)((const char *)origins.data + (size_t)i * origins.stride))[k];
        }
        difference(p, a, d);
        beyond += dot(d, d) > 1.0;
    }
    fprintf(file, "| %d | %s | %s | %+.3f | %.2f |\n", grid, side > 0 ? "first" : "second", keep_edges ? "kept" : "not kept",
            100.0 * (after.volume / before.volume - 1.0), 100.0 * (double)beyond / (double)springls_count(ctx));
    springls_destroy(ctx);
}

/* ---- sheets that are pushed to and fro ---- */

static void to_and_fro(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->batch.count; i++) {
        const float speed = fmodf(batch->batch.time, 8.0f) < 4.0f ? 0.4f : -0.4f;
        out[i] = batch->label == 1 && batch->facing[i] == 2 ? speed : batch->label == 2 && batch->facing[i] == 1 ? -speed : 0.0f;
    }
}

/* A thousand steps of pressure across the wall between two half-balls. */
static void pressed(FILE *file)
{
    enum { GRID = 40 };
    cut_ball part = cut_ball_of(GRID);
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_report now;
    springls_tiling *tiling;
    int i;
    part.radius = 10.0;
    for (i = 0; i < 3; i++) {
        desc.grid.size[i] = GRID;
        part.center[i] = 0.5 * (double)GRID + 0.1 * (double)i;
    }
    check(springls_tiling_create(&desc, &tiling), NULL);
    for (part.side = 1; part.side >= -1; part.side -= 2)
        check(springls_tiling_add_implicit(tiling, part.side > 0 ? 1 : 2, cut_ball_distance, &part), tiling);
    step.pressure = to_and_fro;
    step.dt = 0.25f;
    for (i = 1; i <= 1000; i++) {
        check(springls_tiling_step(tiling, &step, &now), tiling);
        if (i == 10 || i == 100 || i == 1000)
            fprintf(file, "| %d | %.3f | %.3f | %.2f |\n", i, (double)now.mean_gap, (double)now.rms_gap, (double)now.largest_gap);
    }
    springls_tiling_destroy(tiling);
}

/* ---- many bodies at equal wall area ---- */

/* A ball in cells: the places nearest to its seeds; one seed: whole. */
static void cell_labels(int32_t *labels, int grid, double radius, int cells)
{
    double seed[64][3];
    uint32_t state = 5u;
    int i, k, v;
    for (i = 0; i < cells; i++)
        for (k = 0; k < 3; k++) {
            state = state * 1664525u + 1013904223u;
            seed[i][k] = 0.35 * (double)grid + radius * (1.4 * (double)(state >> 8) / 16777216.0 - 0.7);
        }
    for (v = 0; v < grid * grid * grid; v++) {
        const double x[3] = { v % grid, v / grid % grid, v / (grid * grid) };
        double d[3], least = HUGE_VAL, from_middle = 0.0;
        labels[v] = 0;
        for (k = 0; k < 3; k++) from_middle += (x[k] - 0.35 * (double)grid) * (x[k] - 0.35 * (double)grid);
        for (i = 0; i < cells && from_middle < radius * radius; i++) {
            difference(x, seed[i], d);
            if (dot(d, d) >= least) continue;
            least = dot(d, d);
            labels[v] = i + 1;
        }
    }
}

static double area_of_walls(springls_tiling *tiling)
{
    springls_walls walls;
    double area = 0.0, q[3][3], u[3], v[3];
    int t, k;
    check(springls_tiling_extract(tiling, &walls), tiling);
    for (t = 0; t < walls.triangle_count; t++) {
        for (k = 0; k < 3; k++) corner_of(&walls, walls.triangles[3 * t + k], q[k]);
        difference(q[1], q[0], u);
        difference(q[2], q[0], v);
        area += 0.5 * sqrt(fmax(dot(u, u) * dot(v, v) - dot(u, v) * dot(u, v), 0.0));
    }
    springls_walls_free(tiling, &walls);
    return area;
}

/* Bytes that are in use, and the most that have been, of one thread. */
typedef struct heap { size_t now, most; } heap;

static void *heap_get(size_t size, void *user)
{
    heap *counted = (heap *)user;
    counted->now += size;
    if (counted->now > counted->most) counted->most = counted->now;
    return malloc(size);
}

static void heap_put(void *memory, size_t size, void *user)
{
    ((heap *)user)->now -= memory ? size : 0;
    free(memory);
}

/* What is compared: seconds of a step for a voxel^2 of one model, and area and bytes of two bodies. */
typedef struct compared { double one, area, bytes; } compared;

/* A row of the table; 0 cells: one model of the ball, and no row. */
static void equal_area(FILE *file, int cells, compared *other)
{
    enum { GRID = 96, STEPS = 24 };
    heap counted = { 0, 0 };
    static int32_t labels[GRID * GRID * GRID];
    struct exact_flow flow = EXACT_DEFORMATION((float)GRID, 2.5f);
    const double radius = 0.2 * (double)GRID;
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling *tiling;
    double begin, each, area, held;
    size_t most;
    int i;
    if (cells == 0) {
        springls_forces forces = springls_default_forces();
        springls_step_desc plain = springls_default_step_desc();
        springls_measures measures;
        springls_sphere ball;
        springls_context *ctx;
        for (i = 0; i < 3; i++) ball.center[i] = 0.35f * (float)GRID;
        ball.radius = (float)radius;
        for (i = 0; i < 3; i++) desc.grid.size[i] = GRID;
        check(springls_create(&desc, &ctx), NULL);
        check(springls_set_implicit(ctx, springls_implicit_sphere, &ball), NULL);
        forces.velocity = exact_flow_velocity;
        forces.user = &flow;
        plain.forces = &forces;
        plain.dt = 2.5f / 240.0f;
        begin = seconds();
        check(springls_run(ctx, &plain, STEPS), NULL);
        each = (seconds() - begin) / (double)STEPS;
        check(springls_measure(ctx, &measures), NULL);
        other->one = each / measures.area;
        springls_destroy(ctx);
        return;
    }
    for (i = 0; i < 3; i++) desc.grid.size[i] = GRID;
    desc.allocator.alloc = heap_get;
    desc.allocator.free = heap_put;
    desc.allocator.user = &counted;
    cell_labels(labels, GRID, radius, cells);
    check(springls_tiling_create(&desc, &tiling), NULL);
    check(springls_tiling_set_labels(tiling, labels, 2), tiling);
    step.velocity = flow_of_all;
    step.user = &flow;
    step.dt = 2.5f / 240.0f;
    begin = seconds();
    for (i = 0; i < STEPS; i++) {
        counted.most = counted.now;
        check(springls_tiling_step(tiling, &step, NULL), tiling);
    }
    each = (seconds() - begin) / (double)STEPS;
    most = counted.most;
    held = (double)springls_tiling_memory_used(tiling);
    area = area_of_walls(tiling);
    if (other->bytes == 0.0) {
        other->bytes = held;
        other->area = area;
    }
    fprintf(file, "| %d | %.0f | %.1f | %.2f | %.0f | %.2f | %.2f | %.0f |\n", cells, area, 1e3 * each, each / area / other->one,
            held / 1048576.0, held / other->bytes, held / other->bytes * other->area / area, (double)most / 1048576.0);
    springls_tiling_destroy(tiling);
}

/* ---- double bubbles ---- */

/* Fits a sphere to points in least squares; returns its radius. */
static double fit_sphere(const double *points, int count, double center[3])
{
    double m[4][5] = { { 0.0 } }, q[3];
    int i, k, a, b;
    for (i = 0; i < count; i++) {
        double row[4], y;
        difference(points + 3 * i, points, q);
        for (k = 0; k < 3; k++) row[k] = 2.0 * q[k];
        row[3] = 1.0;
        y = dot(q, q);
        for (a = 0; a < 4; a++) {
            for (b = 0; b < 4; b++) m[a][b] += row[a] * row[b];
            m[a][4] += row[a] * y;
        }
    }
    for (k = 0; k < 4; k++)
        for (a = 0; a < 4; a++) {
            const double f = m[a][k] / m[k][k];
            for (b = k; b < 5 && a != k; b++) m[a][b] -= f * m[k][b];
        }
    for (k = 0; k < 3; k++) {
        q[k] = m[k][4] / m[k][k];
        center[k] = q[k] + points[k];
    }
    return sqrt(m[3][4] / m[3][3] + dot(q, q));
}

/* Lists the corners of the triangles between two labels, those within two voxels of an edge left out. */
static int points_of_wall(const springls_walls *walls, int one, int other, double *out)
{
    int i, j, k, count = 0;
    for (i = 0; i < walls->triangle_count; i++) {
        if (!(walls->labels[2 * i] == one && walls->labels[2 * i + 1] == other)
            && !(walls->labels[2 * i] == other && walls->labels[2 * i + 1] == one)) continue;
        for (j = 0; j < 3; j++) {
            double p[3], q[3], d[3];
            corner_of(walls, walls->triangles[3 * i + j], p);
            for (k = 0; k < walls->edge_count; k++) {
                corner_of(walls, walls->edges[2 * k], q);
                difference(p, q, d);
                if (dot(d, d) < 4.0) break;
            }
            if (k < walls->edge_count || count == MOST_POINTS) continue;
            memcpy(out + 3 * count++, p, sizeof p);
        }
    }
    return count;
}

/* Measures of a double bubble, summed over several looks, and of its volumes, over all steps between them. */
typedef struct bubble { double angle, radius[3], missing[2], missing2[2], pressure[2]; } bubble;

/* Adds what the volumes miss of their targets, %, and the pressures. */
static void add_held(const springls_tiling_hold *held, bubble *sum)
{
    int i;
    for (i = 0; i < 2; i++) {
        const double missing = 100.0 * (held[i].volume / held[i].target - 1.0);
        sum->missing[i] += missing;
        sum->missing2[i] += missing * missing;
        sum->pressure[i] += held[i].pressure;
    }
}

static void add_bubble(springls_tiling *tiling, bubble *sum)
{
    static double points[3 * MOST_POINTS];
    const double degree = 57.295779513082320877;
    double center[2][3], d[3], radius[3];
    springls_walls walls;
    int i;
    check(springls_tiling_extract(tiling, &walls), tiling);
    for (i = 0; i < 2; i++) radius[i] = fit_sphere(points, points_of_wall(&walls, 0, i + 1, points), center[i]);
    radius[2] = fit_sphere(points, points_of_wall(&walls, 1, 2, points), d);
    difference(center[0], center[1], d);
    sum->angle += 180.0 - degree * acos((radius[0] * radius[0] + radius[1] * radius[1] - dot(d, d)) / (2.0 * radius[0] * radius[1]));
    for (i = 0; i < 3; i++) sum->radius[i] += radius[i];
    springls_walls_free(tiling, &walls);
}

/* A ball cut in two by a plane at an offset from its center relaxes. */
static void double_bubble(FILE *file, double offset)
{
    enum { GRID = 40, STEPS = 600, LOOKS = 20, BETWEEN = 10 };
    const double last = (double)(BETWEEN * LOOKS);
    cut_ball ball = cut_ball_of(GRID), part[2];
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling_hold held[2];
    springls_tiling *tiling;
    bubble b;
    double begin = seconds();
    int i, k;
    ball.radius = 9.0;
    for (k = 0; k < 3; k++) desc.grid.size[k] = GRID;
    for (k = 0; k < 3; k++) ball.center[k] = 0.5 * (double)GRID + 0.1 * (double)k;
    memset(held, 0, sizeof held);
    memset(&b, 0, sizeof b);
    check(springls_tiling_create(&desc, &tiling), NULL);
    for (i = 0; i < 2; i++) {
        part[i] = ball;
        part[i].side = i ? -1 : 1;
        part[i].offset = offset;
        held[i].label = i + 1;
        check(springls_tiling_add_implicit(tiling, i + 1, cut_ball_distance, &part[i]), tiling);
    }
    step.tension = 1.0f;
    step.held = held;
    step.held_count = 2;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = 0.5f;
    for (i = 0; i < STEPS; i++) {
        check(springls_tiling_step(tiling, &step, NULL), tiling);
        if (i >= STEPS - BETWEEN * LOOKS) add_held(held, &b);
        if (i >= STEPS - BETWEEN * LOOKS && i % BETWEEN == BETWEEN - 1) add_bubble(tiling, &b);
    }
    for (i = 0; i < 3; i++) b.radius[i] /= (double)LOOKS;
    fprintf(file, "| %.0f : %.0f | %.2f | %.3f, %.3f |", held[0].target, held[1].target, b.angle / (double)LOOKS, b.radius[0], b.radius[1]);
    if (offset == 0.0) fprintf(file, " %.3f | flat |", cbrt(held[0].target * 8.0 / (9.0 * 3.14159265358979323846)));
    else fprintf(file, " - | %.2f, by the others %.2f |", b.radius[2], 1.0 / (1.0 / b.radius[1] - 1.0 / b.radius[0]));
    fprintf(file, " %+.3f, %+.3f | %.3f, %.3f | %.4f, %.4f | %.4f, %.4f | %.1f |\n", b.missing[0] / last, b.missing[1] / last,
            sqrt(b.missing2[0] / last), sqrt(b.missing2[1] / last), b.pressure[0] / last, b.pressure[1] / last, 2.0 / b.radius[0],
            2.0 / b.radius[1], seconds() - begin);
    springls_tiling_destroy(tiling);
}

/* ---- balls that meet ---- */

typedef struct balls { springls_sphere ball[MOST_BALLS]; int count, grid; } balls;

/* Returns pseudo-random numbers from 0 to 1. */
static double random_number(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) / 16777216.0;
}

static void place_balls(balls *all)
{
    const double margin = 0.2 * (double)all->grid;
    uint32_t state = 7u;
    int n = 0, i, k;
    while (n < all->count) {
        springls_sphere *ball = &all->ball[n];
        bool fits = true;
        for (k = 0; k < 3; k++) ball->center[k] = (float)(margin + random_number(&state) * ((double)all->grid - 2.0 * margin));
        ball->radius = (float)(2.5 + random_number(&state));
        for (i = 0; i < n; i++) {
            double d[3], apart = (double)(ball->radius + all->ball[i].radius) + 2.0;
            for (k = 0; k < 3; k++) d[k] = (double)(ball->center[k] - all->ball[i].center[k]);
            fits = fits && dot(d, d) > apart * apart;
        }
        n += fits;
    }
}

static void outwards(void *user, const springls_tiling_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->batch.count; i++) out[i] = batch->label == 0 ? -1.0f : batch->facing[i] == 0 ? 1.0f : 0.0f;
}

/* Returns the ball whose surface is nearest to a place inside; 0: it is in none. */
static int32_t ball_of(const balls *all, const double *x)
{
    double least = 0.0, d[3];
    int32_t found = 0;
    int i, k;
    for (i = 0; i < all->count; i++) {
        double h;
        for (k = 0; k < 3; k++) d[k] = x[k] - (double)all->ball[i].center[k];
        h = sqrt(dot(d, d)) - (double)all->ball[i].radius;
        if (h >= least) continue;
        least = h;
        found = i + 1;
    }
    return found;
}

/* Returns which of the voxels that are in a ball, by the truth or by the labels, have the right one, %. */
static double right_voxels(const balls *all, const int32_t *labels)
{
    const int n = all->grid;
    int v, either = 0, right = 0;
    for (v = 0; v < n * n * n; v++) {
        const double x[3] = { v % n, v / n % n, v / (n * n) };
        const int32_t truth = ball_of(all, x);
        either += truth || labels[v];
        right += (truth || labels[v]) && truth == labels[v];
    }
    return 100.0 * (double)right / (double)either;
}

/* Balls grow until they meet. */
static void growing_balls(FILE *file, int count, int grid, int threads)
{
    static balls all;
    springls_desc desc = springls_default_desc();
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_tiling *tiling;
    springls_walls walls;
    int32_t *labels = (int32_t *)malloc((size_t)grid * (size_t)grid * (size_t)grid * sizeof *labels);
    springls_threads *pool = NULL;
    double set, taken, extract, clock;
    int i;
    if (!labels) exit(1);
    all.count = count;
    all.grid = grid;
    for (i = 0; i < 3; i++) desc.grid.size[i] = grid;
    if (threads > 1) {
        pool = springls_threads_create(threads);
        desc.tasks = springls_threads_tasks(pool);
    }
    place_balls(&all);
    clock = by_the_clock();
    check(springls_tiling_create(&desc, &tiling), NULL);
    set = seconds();
    for (i = 0; i < count; i++) check(springls_tiling_add_implicit(tiling, i + 1, springls_implicit_sphere, &all.ball[i]), tiling);
    set = seconds() - set;
    step.pressure = outwards;
    step.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.dt = 0.25f;
    taken = seconds();
    for (i = 0; i < BALL_STEPS; i++) check(springls_tiling_step(tiling, &step, NULL), tiling);
    taken = seconds() - taken;
    for (i = 0; i < count; i++) all.ball[i].radius += 0.25f * (float)BALL_STEPS;
    extract = seconds();
    check(springls_tiling_extract(tiling, &walls), tiling);
    extract = seconds() - extract;
    clock = by_the_clock() - clock;
    check(springls_tiling_copy_labels(tiling, labels), tiling);
    fprintf(file,
            "| %d | %d | %d | %d | %.2f | %.1f | %.1f | %.1f | %.0f | %d | %.0f |\n", count, grid, threads, springls_tiling_count(tiling),
            right_voxels(&all, labels), set, taken, extract, clock, walls.triangle_count,
            (double)springls_tiling_memory_used(tiling) / 1048576.0);
    springls_walls_free(tiling, &walls);
    springls_tiling_destroy(tiling);
    springls_threads_destroy(pool);
    free(labels);
}

/* ---- the page ---- */

static void walls_and_cost(FILE *file)
{
    double two[2], one[2];
    int i;
    fprintf(
        file,
        "\n## A wall in a flow\n\nA ball, cut in two by a plane askew to the grid, in LeVeque's flow with T = 2.5, which comes "
        "back. Exact points of the wall and\nof its rim, where both bodies and what is around them meet, are carried by the flow; errors "
        "are their distances in voxels to the\nextracted wall and to its edges, of those that have one within 4 voxels. At half time the "
        "bodies are sheets thinner than a voxel:\nthere a mesh on the voxels of the grid, even of exact phi, is no nearer than about "
        ".23. Volumes: of each body's own zero level.\nGaps between the two sheets of a wall: mean, rms.\n\n"
        "| Grid | When | Wall: mean | 99 %% | Largest | Missing, %% | Rim: mean | Missing, %% | Volumes, %% | Voxels, %% | Gaps | "
        "Triangles |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (i = 0; i < 2; i++) {
        const int grid = i ? 96 : 64, steps = i ? 240 : 160;
        two[i] = half_balls(file, grid, 2.5, steps);
        one[i] = seconds_of_one(grid, 2.5, steps);
    }
    fprintf(file,
            "\n## What it costs\n\nSeconds of one processor for the same flow: the tiling of two bodies, and one model of the whole "
            "ball.\n\n| Grid | Two bodies | One model | Ratio |\n|---|---|---|---|\n");
    for (i = 0; i < 2; i++) fprintf(file, "| %d | %.2f | %.2f | %.1f |\n", i ? 96 : 64, two[i], one[i], two[i] / one[i]);
}

static void cells(FILE *file)
{
    compared other = { 0.0, 0.0, 0.0 };
    fprintf(
        file,
        "\n## Cells\n\nA ball cut into cells takes 24 steps of the flow, on a grid of 96^3. Area: of all walls, in squared voxels. "
        "Times one model: the time of\na step for each squared voxel of wall, beside that of one model of the whole ball. MiB: the memory "
        "between steps; beside that of two\nbodies, and the same for each squared voxel of wall. MiB in a step: the most, since a step "
        "keeps a copy of the bodies. Where others use\nthe machine too, ratios of such short runs vary by a third.\n\n"
        "| Bodies | Area | Step, ms | Times one model | MiB | Times two bodies | For the same area | MiB in a step |\n"
        "|---|---|---|---|---|---|---|---|\n");
    equal_area(file, 0, &other);
    equal_area(file, 2, &other);
    equal_area(file, 8, &other);
    equal_area(file, 61, &other);
}

static void eight_octants(FILE *file)
{
    fprintf(
        file,
        "\n## Eight octants\n\n"
        "The ball in eight, by three planes, in the flow: the four walls on one plane. Missing: places of all four, and of the "
        "worst,\nwithout their wall within 4 voxels.\n\n| Grid | T | When | Wall: mean | Missing, %% | Of the worst, %% |\n"
        "|---|---|---|---|---|---|\n");
    octants(file, 64, 1.5, 96);
    octants(file, 96, 2.5, 240);
}

static void wedges(FILE *file)
{
    int i;
    fprintf(
        file,
        "\n## A wedge alone\n\n"
        "Each half of the ball as a model of its own in the flow with T = 2.5, with and without `keep_edges`. Beyond: springls more "
        "than\na voxel off their own correspondence in the end.\n\n| Grid | Half | Edges | Volume, %% | Beyond, %% |\n"
        "|---|---|---|---|---|\n");
    for (i = 0; i < 4; i++) wedge(file, 96, 240, i & 1 ? -1 : 1, i < 2);
}

static void sheets(FILE *file)
{
    fprintf(
        file,
        "\n## Sheets under pressure\n\n"
        "The wall between two halves of a ball is pushed to and fro by a tenth of a voxel a step, 16 steps each way. "
        "Gaps\nbetween its two sheets, voxels.\n\n| Steps | Mean | rms | Largest |\n|---|---|---|---|\n");
    pressed(file);
}

static void bubbles(FILE *file)
{
    fprintf(
        file,
        "\n## Double bubbles\n\nA ball of radius 9 on a grid of 40^3, cut by a plane, relaxes for 600 steps under surface tension, "
        "with both volumes held;\nmeans over the last 200. The angle where the walls meet is that between spheres that fit the two outer "
        "walls; the third wall's radius is\n1 / (1 / R2 - 1 / R1). By Laplace's law a pressure is 2 / R. Volumes: what they miss in the "
        "mean, and the rms of single steps, which\nmirroring and resampling move.\n\n"
        "| Volumes | Angle (120) | Radii | Exact | Third wall | Volumes, %% | rms, %% | Pressures | 2 / R | Seconds |\n"
        "|---|---|---|---|---|---|---|---|---|---|\n");
    double_bubble(file, 0.0);
    double_bubble(file, 3.0);
}

static void balls_that_meet(FILE *file)
{
    const char *full = getenv("FULL");
    fprintf(
        file,
        "\n## Balls that meet\n\n"
        "Balls of 2.5 to 3.5 voxels grow by a quarter of a voxel a step for 40 steps, where they face label 0, until they\nfill the space "
        "between them. The truth is the ball whose surface is nearest. Seconds are the processor's, of all threads together,\nand all "
        "three by the clock, which is longer where others use the machine too.\n\n"
        "| Balls | Grid | Threads | Alive | Voxels of the right ball, %% | Set, s | Steps, s | Extract, s | By the clock, s | Triangles | "
        "MiB |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|\n");
    growing_balls(file, 100, 96, 1);
    if (full && full[0] == '1') growing_balls(file, MOST_BALLS, 192, 2);
}

/* The sections of the page: ONLY=NAME prints one. */
typedef struct section { const char *name; void (*write)(FILE *file); } section;

static const section sections[] = { { "walls", walls_and_cost }, { "cells", cells },     { "octants", eight_octants },
                                    { "wedges", wedges },        { "sheets", sheets },   { "bubbles", bubbles },
                                    { "balls", balls_that_meet } };

enum { SECTIONS = sizeof sections / sizeof *sections };

/* Prints the section of a name. Returns the exit status. */
static int print_section(const char *name)
{
    int i;
    for (i = 0; i < SECTIONS; i++)
        if (strcmp(name, sections[i].name) == 0) return (sections[i].write)(stdout), 0;
    fprintf(stderr, "tilings: no section %s; there are", name);
    for (i = 0; i < SECTIONS; i++) fprintf(stderr, " %s", sections[i].name);
    fprintf(stderr, "\n");
    return 2;
}

int main(int argc, char **argv)
{
    const char *only = getenv("ONLY"), *full = getenv("FULL");
    FILE *file;
    int i;
    if (only && only[0]) {
        if (argc == 1) return print_section(only);
        fprintf(stderr, "tilings: ONLY prints a part of the page: leave out ONLY or PAGE\n");
        return 2;
    }
    file = argc > 1 ? fopen(argv[1], "w") : stdout;
    if (!file) {
        fprintf(stderr, "tilings: cannot write %s\n", argv[1]);
        return 1;
    }
    fprintf(file,
            "<!-- written by: make tilings%s PAGE=docs/tilings.md -->\n\n# Many bodies in one space\n\n"
            "The interface is `springls_tiling` (the manual in `springls.h`, MANY BODIES).\n",
            full && full[0] == '1' ? " FULL=1" : "");
    for (i = 0; i < SECTIONS; i++) (sections[i].write)(file);
    return file == stdout || fclose(file) == 0 ? 0 : 1;
}
