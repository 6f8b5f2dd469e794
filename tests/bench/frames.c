/* frames GRID THREADS [FRAMES] - what a frame of interactive work costs: a ball-shaped brush of 0.08 grids pushes the
 * surface of a sphere of radius 0.25 grids in by a voxel a frame, going round; then the chunks that have changed are
 * meshed. Then nothing moves: rest_ms. One JSON object on stdout: milliseconds of the wall's clock and, less disturbed by what
 * else runs, of the processor. Before, the model settles in calls of 2 ms: settle_call_ms, and settle_whole_ms of each step;
 * first_ms are the first ten frames of the brush, of the processor. Then, one a frame, balls of 0.04 grids are cut out of it:
 * cut_ms is the call, cut_frame_ms the call, a step and its chunks.
 *
 * Besides, in this thread and by its processor time: a ball in LeVeque's deformation, where everything moves, is stepped by
 * springls_step_continue and meshed by springls_chunks_continue, without correspondences (chunks) and with them (material), in
 * calls of 2 ms. *_call_ms are calls, *_whole_ms the calls of a step or an update together; step_budget and material_budget have
 * how many calls took more than 3 ms, the longest, and in which stage. */
#define _POSIX_C_SOURCE 200809L
#include "springls.h"

#include "examples/common/base/json.h"
#include "examples/common/base/progress.h"
#include "examples/common/springls/exact_flows.h"
#include "examples/common/springls/run_options.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

enum { FIRST = 10, REST = 50, CUTS = 60, MOST = 1 << 17, FLOW_STEPS = 100 };

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

static double thread_seconds(void *user)
{
    struct timespec t;
    (void)user;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The stage at work, or the last one. */
static void follow_stage(void *user, int stage, int begin, double seconds)
{
    (void)seconds;
    if (begin) {
        *(int *)user = stage;
    }
}

static void here(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)user;
    (void)grain;
    task(arg, 0, count);
}

/* Calls with a budget: how long they take, what they do together, and which stage the longest was in. */
struct calls {
    struct series call, whole; /* milliseconds */
    int count, over, stage;
    double longest, sum, sum_before;
};

static void append(struct series *s, double value)
{
    if (s->count < MOST) {
        s->value[s->count++] = value;
    }
}

static void count_call(struct calls *calls, double seconds, int stage)
{
    ++calls->count;
    append(&calls->call, 1e3 * seconds);
    calls->over += seconds > 3e-3;
    calls->sum += seconds;
    if (seconds > calls->longest) {
        calls->longest = seconds;
        calls->stage = stage;
    }
}

/* Ends the calls that belong together. */
static void count_whole(struct calls *calls)
{
    append(&calls->whole, 1e3 * (calls->sum - calls->sum_before));
    calls->sum_before = calls->sum;
}

static void report_calls(struct json_writer *json, const char *key, const struct calls *calls)
{
    json_object_begin(json, key);
    json_integer(json, "calls", calls->count);
    json_number(json, "over_3_ms_percent", 100.0 * calls->over / calls->count);
    json_number(json, "mean_ms", 1e3 * calls->sum / calls->count);
    json_number(json, "longest_ms", 1e3 * calls->longest);
    json_string(json, "longest_in", calls->stage < 0 ? "chunks" : springls_stage_name((springls_stage)calls->stage));
    json_object_end(json);
}

/* Brings a model to rest, in calls with a budget. */
static springls_status settle_in_calls(springls_context *ctx, double seconds, struct calls *calls)
{
    const springls_step_desc nothing = {.dt = 0.0f};
    springls_status status = SPRINGLS_OK;
    while (status == SPRINGLS_OK && !springls_at_rest(ctx)) {
        status = springls_step_begin(ctx, &nothing);
        for (bool done = false; status == SPRINGLS_OK && !done;) {
            const double begin = thread_seconds(NULL);
            status = springls_step_continue(ctx, seconds, &done);
            count_call(calls, thread_seconds(NULL) - begin, -1);
        }
        count_whole(calls);
    }
    return status;
}

/* Updates chunks in calls with a budget. */
static springls_status update_in_calls(springls_context *ctx, springls_chunks *chunks, double seconds, struct calls *calls)
{
    const springls_chunk *changed;
    int count;
    springls_status status = springls_chunks_begin(ctx, chunks);
    for (bool done = false; status == SPRINGLS_OK && !done;) {
        const double begin = thread_seconds(NULL);
        status = springls_chunks_continue(ctx, chunks, seconds, &changed, &count, &done);
        count_call(calls, thread_seconds(NULL) - begin, -1);
    }
    count_whole(calls);
    return status;
}

/* Steps and meshes what is in a flow, in calls with a budget. */
static springls_status run_calls(springls_context *ctx, int grid, bool material, const int *stage, struct calls *step_calls,
                                 struct calls *chunk_calls)
{
    const double seconds = 2e-3;
    const springls_chunks_desc desc = {.correspondences = material};
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, 2.5f);
    springls_forces forces = {.velocity = exact_flow_velocity, .user = &flow};
    const springls_step_desc step = {.forces = &forces, .max_displacement = 0.5f};
    springls_chunks *chunks;
    springls_status status = springls_chunks_create(ctx, &desc, &chunks);
    for (int i = 0; i < FLOW_STEPS && status == SPRINGLS_OK; ++i) {
        status = springls_step_begin(ctx, &step);
        for (bool done = false; status == SPRINGLS_OK && !done;) {
            const double begin = thread_seconds(NULL);
            status = springls_step_continue(ctx, seconds, &done);
            count_call(step_calls, thread_seconds(NULL) - begin, *stage);
        }
        count_whole(step_calls);
        if (status == SPRINGLS_OK) {
            status = update_in_calls(ctx, chunks, seconds, chunk_calls);
        }
    }
    springls_chunks_destroy(ctx, chunks);
    return status;
}

/* Cuts balls out of a sphere, round its equator. */
static springls_status run_cuts(springls_context *ctx, springls_chunks *chunks, const springls_sphere *sphere, float size,
                                struct series *cut, struct series *frame)
{
    const springls_step_desc one = {.dt = 1.0f};
    const springls_chunk *changed;
    int count;
    springls_status status = SPRINGLS_OK;
    for (int i = 0; i < CUTS && status == SPRINGLS_OK; ++i) {
        const float turn = -0.1f * (float)(i + 1);
        springls_sphere ball = *sphere;
        ball.center[0] += sphere->radius * cosf(turn);
        ball.center[1] += sphere->radius * sinf(turn);
        ball.radius = 0.04f * size;
        const double begin = elapsed_seconds();
        status = springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &ball);
        append(cut, 1e3 * (elapsed_seconds() - begin));
        if (status == SPRINGLS_OK) {
            status = springls_step(ctx, &one);
        }
        if (status == SPRINGLS_OK) {
            status = springls_chunks_update(ctx, chunks, &changed, &count);
        }
        append(frame, 1e3 * (elapsed_seconds() - begin));
    }
    return status;
}

/* Updates chunks of what springls hold, of a model whose other chunks are of the zero level. */
static springls_status update_contours(springls_context *ctx, springls_chunks *contours)
{
    springls_params params = springls_get_params(ctx);
    const springls_chunk *changed;
    int count;
    params.contouring = SPRINGLS_CONTOURING_SPRINGLS;
    springls_status status = springls_set_params(ctx, &params);
    if (status == SPRINGLS_OK) {
        status = springls_chunks_update(ctx, contours, &changed, &count);
    }
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    return status == SPRINGLS_OK ? springls_set_params(ctx, &params) : status;
}

static int fail(springls_context *ctx)
{
    fprintf(stderr, "frames: %s\n", springls_last_error(ctx));
    return 1;
}

int main(int argc, char **argv)
{
    static struct series frame, first, processor, step, chunk, contour, share, rest, cut, cut_frame;
    const int grid = argc > 2 ? atoi(argv[1]) : 0, threads = argc > 2 ? atoi(argv[2]) : 0;
    const int frames = argc > 3 ? atoi(argv[3]) : 100;
    if (grid < 16 || grid > 1024 || threads < 1 || frames < FIRST || frames > 2000) {
        fprintf(stderr, "usage: frames GRID THREADS [FRAMES]\n");
        return 2;
    }
    run_start_threads(threads);
    const float size = (float)grid, middle = 0.5f * size, radius = 0.25f * size;
    springls_sphere ball = {{middle, middle, middle}, radius};
    struct brush brush = {{middle, middle, middle}, 0.08f * size, {0.0f, 0.0f, 0.0f}};
    springls_desc desc = {.grid = {.size = {grid, grid, grid}}, .tasks = run_tasks()};
    springls_forces forces = {.velocity = push, .user = &brush};
    springls_step_desc one = {.forces = &forces, .dt = 1.0f, .max_displacement = 2.0f};
    springls_context *ctx;
    springls_chunks *chunks, *contours;
    const springls_chunk *changed;
    static struct calls settling;
    int count, all;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "frames: cannot create a model of %d^3\n", grid);
        return 1;
    }
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) != SPRINGLS_OK
        || springls_chunks_create(ctx, NULL, &chunks) != SPRINGLS_OK
        || springls_chunks_create(ctx, NULL, &contours) != SPRINGLS_OK
        || springls_chunks_update(ctx, chunks, &changed, &all) != SPRINGLS_OK
        || settle_in_calls(ctx, 2e-3, &settling) != SPRINGLS_OK
        || springls_chunks_update(ctx, chunks, &changed, &count) != SPRINGLS_OK || update_contours(ctx, contours) != SPRINGLS_OK) {
        return fail(ctx);
    }
    for (int i = 0; i < frames; ++i) {
        const float turn = 0.02f * (float)i;
        brush.center[0] = middle + radius * cosf(turn);
        brush.center[1] = middle + radius * sinf(turn);
        brush.velocity[0] = -cosf(turn);
        brush.velocity[1] = -sinf(turn);
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
        const double end = elapsed_seconds(), used = 1e3 * (processor_seconds() - busy);
        if (update_contours(ctx, contours) != SPRINGLS_OK) {
            return fail(ctx);
        }
        if (i < FIRST) {
            first.value[first.count++] = used;
        }
        contour.value[contour.count++] = 1e3 * (elapsed_seconds() - end);
        frame.value[frame.count++] = 1e3 * (end - begin);
        processor.value[processor.count++] = used;
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
    if (run_cuts(ctx, chunks, &ball, size, &cut, &cut_frame) != SPRINGLS_OK) {
        return fail(ctx);
    }
    static struct calls step_calls, chunk_calls[2];
    int stage = 0;
    springls_sphere drop = {{0.35f * size, 0.35f * size, 0.35f * size}, 0.15f * size};
    desc.tasks.parallel_for = here;
    desc.trace = (springls_trace){.now = thread_seconds, .stage = follow_stage, .user = &stage};
    for (int material = 0; material < 2; ++material) {
        springls_context *flowing;
        if (springls_create(&desc, &flowing) != SPRINGLS_OK) {
            fprintf(stderr, "frames: cannot create a second model of %d^3\n", grid);
            return 1;
        }
        if (springls_set_implicit(flowing, springls_implicit_sphere, &drop) != SPRINGLS_OK
            || run_calls(flowing, grid, material != 0, &stage, &step_calls, &chunk_calls[material]) != SPRINGLS_OK) {
            return fail(flowing);
        }
        springls_destroy(flowing);
    }
    struct json_writer json;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_integer(&json, "threads", threads);
    json_integer(&json, "springls", springls_count(ctx));
    json_integer(&json, "chunks", all);
    report(&json, "settle_call_ms", &settling.call);
    report(&json, "settle_whole_ms", &settling.whole);
    report(&json, "first_ms", &first);
    report(&json, "frame_ms", &frame);
    report(&json, "processor_ms", &processor);
    report(&json, "step_ms", &step);
    report(&json, "chunks_ms", &chunk);
    report(&json, "contours_ms", &contour);
    report(&json, "chunks_percent", &share);
    report(&json, "rest_ms", &rest);
    report(&json, "cut_ms", &cut);
    report(&json, "cut_frame_ms", &cut_frame);
    report(&json, "step_call_ms", &step_calls.call);
    report(&json, "step_whole_ms", &step_calls.whole);
    report(&json, "chunks_call_ms", &chunk_calls[0].call);
    report(&json, "chunks_whole_ms", &chunk_calls[0].whole);
    report(&json, "material_call_ms", &chunk_calls[1].call);
    report(&json, "material_whole_ms", &chunk_calls[1].whole);
    report_calls(&json, "step_budget", &step_calls);
    report_calls(&json, "material_budget", &chunk_calls[1]);
    springls_chunks_destroy(ctx, chunks);
    springls_chunks_destroy(ctx, contours);
    springls_destroy(ctx);
    return json_close(&json) ? 0 : 1;
}
