/* frames GRID THREADS [FRAMES] - what a frame of interactive work costs: a ball-shaped brush of 0.08 grids pushes the
 * surface of a sphere of radius 0.25 grids in by a voxel a frame, going round; then the chunks that have changed are
 * meshed. Then nothing moves: rest_ms. One JSON object on stdout: milliseconds of the wall's clock and, less disturbed by what
 * else runs, of the processor. Frames after 20 to settle. */
#define _POSIX_C_SOURCE 200809L
#include "springls.h"

#include "examples/common/base/json.h"
#include "examples/common/base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>
#if defined(_OPENMP)
#include <omp.h>
#endif

enum { SETTLE = 20, REST = 50, MOST = 2000 };

struct brush {
    float center[3], radius, velocity[3];
};

static void push(void *user, const float *points, int count, float time, float *out)
{
    const struct brush *b = user;
    (void)time;
    for (int i = 0; i < count; ++i, points += 3, out += 3) {
        float d2 = 0.0f;
        for (int k = 0; k < 3; ++k) {
            d2 += (points[k] - b->center[k]) * (points[k] - b->center[k]);
        }
        const float w = fmaxf(1.0f - d2 / (b->radius * b->radius), 0.0f);
        for (int k = 0; k < 3; ++k) {
            out[k] = w * w * b->velocity[k];
        }
    }
}

/* One quantity of every frame. */
struct series {
    double value[MOST];
    int count;
};

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(struct json_writer *json, const char *key, struct series *s)
{
    qsort(s->value, (size_t)s->count, sizeof *s->value, ascending);
    json_object_begin(json, key);
    json_number(json, "p50", s->value[s->count / 2]);
    json_number(json, "p95", s->value[s->count * 95 / 100]);
    json_number(json, "max", s->value[s->count - 1]);
    json_object_end(json);
}

static double processor_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int fail(springls_context *ctx)
{
    fprintf(stderr, "frames: %s\n", springls_last_error(ctx));
    return 1;
}

int main(int argc, char **argv)
{
    static struct series frame, processor, step, chunk, share, rest;
    const int grid = argc > 2 ? atoi(argv[1]) : 0, threads = argc > 2 ? atoi(argv[2]) : 0;
    const int frames = SETTLE + (argc > 3 ? atoi(argv[3]) : 100);
    if (grid < 16 || grid > 1024 || threads < 1 || frames <= SETTLE || frames > SETTLE + MOST) {
        fprintf(stderr, "usage: frames GRID THREADS [FRAMES]\n");
        return 2;
    }
#if defined(_OPENMP)
    omp_set_num_threads(threads);
#endif
    const float size = (float)grid, middle = 0.5f * size, radius = 0.25f * size;
    springls_sphere ball = {{middle, middle, middle}, radius};
    struct brush brush = {{middle, middle, middle}, 0.08f * size, {0.0f, 0.0f, 0.0f}};
    springls_desc desc = {.grid = {.size = {grid, grid, grid}}};
    springls_forces forces = {.velocity = push, .user = &brush};
    springls_step_desc one = {.forces = &forces, .dt = 1.0f, .max_displacement = 2.0f};
    springls_context *ctx;
    springls_chunks *chunks;
    const springls_chunk *changed;
    int count, all;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "frames: cannot create a model of %d^3\n", grid);
        return 1;
    }
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) != SPRINGLS_OK
        || springls_chunks_create(ctx, NULL, &chunks) != SPRINGLS_OK
        || springls_chunks_update(ctx, chunks, &changed, &all) != SPRINGLS_OK) {
        return fail(ctx);
    }
    for (int i = 0; i < frames; ++i) {
        const float turn = 0.02f * (float)i;
        brush.center[0] = middle + radius * cosf(turn);
        brush.center[1] = middle + radius * sinf(turn);
        brush.velocity[0] = i < SETTLE ? 0.0f : -cosf(turn);
        brush.velocity[1] = i < SETTLE ? 0.0f : -sinf(turn);
        for (int k = 0; k < 3; ++k) {
            forces.region_lower[k] = brush.center[k] - brush.radius;
            forces.region_upper[k] = brush.center[k] + brush.radius;
        }
        const double busy = processor_seconds(), begin = elapsed_seconds();
        if (springls_step(ctx, &one) != SPRINGLS_OK) {
            return fail(ctx);
        }
        const double stepped = elapsed_seconds();
        if (springls_chunks_update(ctx, chunks, &changed, &count) != SPRINGLS_OK) {
            return fail(ctx);
        }
        const double end = elapsed_seconds();
        if (i < SETTLE) {
            continue;
        }
        frame.value[frame.count++] = 1e3 * (end - begin);
        processor.value[processor.count++] = 1e3 * (processor_seconds() - busy);
        step.value[step.count++] = 1e3 * (stepped - begin);
        chunk.value[chunk.count++] = 1e3 * (end - stepped);
        share.value[share.count++] = 100.0 * count / all;
    }
    const springls_step_desc none = {.dt = 1.0f, .max_displacement = 2.0f};
    for (int i = 0; i < 2 * REST; ++i) {
        const double begin = elapsed_seconds();
        if (springls_step(ctx, &none) != SPRINGLS_OK) {
            return fail(ctx);
        }
        if (i >= REST) {
            rest.value[rest.count++] = 1e3 * (elapsed_seconds() - begin);
        }
    }
    struct json_writer json;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_integer(&json, "threads", threads);
    json_integer(&json, "springls", springls_count(ctx));
    json_integer(&json, "chunks", all);
    report(&json, "frame_ms", &frame);
    report(&json, "processor_ms", &processor);
    report(&json, "step_ms", &step);
    report(&json, "chunks_ms", &chunk);
    report(&json, "chunks_percent", &share);
    report(&json, "rest_ms", &rest);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    return json_close(&json) ? 0 : 1;
}
