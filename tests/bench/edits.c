/* edits GRID [EDITS] - digs in a ball of .3 grids, each a ball of 4 voxels that is cut out of its surface, with a step after each: spread
 * over the whole surface; then, in a new model, within 10 voxels of one place, where every other edit fills a ball instead. One JSON
 * object on stdout: of each, how many springls there are in the end, what the model holds at the start and after each fifth, MiB, and the
 * median and the longest of the edits, milliseconds of this thread's processor, in the first tenth and in the last; so of the steps. */
#define _POSIX_C_SOURCE 200809L
#include "springls.h"

#include "examples/common/base/cli.h"
#include "examples/common/base/json.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

enum { MOST_EDITS = 10000, FIFTHS = 5 };

static double ms[MOST_EDITS], step_ms[MOST_EDITS];

static double processor_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A number from 0 to 1, the same in each run. */
static float next_number(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216.0f;
}

/* Places dig i: in turns of the golden angle over the ball, or near its top. */
static springls_sphere dig(int i, int edits, bool at_one_place, const springls_sphere *body, uint32_t *state)
{
    springls_sphere ball = *body;
    ball.radius = 4.0f;
    if (at_one_place) {
        ball.center[0] += 20.0f * next_number(state) - 10.0f;
        ball.center[1] += 20.0f * next_number(state) - 10.0f;
        ball.center[2] += body->radius + 4.0f * next_number(state) - 2.0f;
        return ball;
    }
    const float z = 1.0f - 2.0f * ((float)i + 0.5f) / (float)edits, r = sqrtf(1.0f - z * z), turn = 2.399963f * (float)i;
    ball.center[0] += body->radius * r * cosf(turn);
    ball.center[1] += body->radius * r * sinf(turn);
    ball.center[2] += body->radius * z;
    return ball;
}

static void report_times(struct json_writer *json, const char *key, double *times, int count)
{
    qsort(times, (size_t)count, sizeof *times, ascending);
    json_object_begin(json, key);
    json_number(json, "p50", times[count / 2]);
    json_number(json, "max", times[count - 1]);
    json_object_end(json);
}

static springls_status run(struct json_writer *json, const char *key, int grid, int edits, bool at_one_place)
{
    const springls_desc desc = {.grid = {.size = {grid, grid, grid}}};
    const float middle = 0.5f * (float)grid;
    const springls_sphere body = {{middle, middle, middle}, 0.3f * (float)grid};
    const springls_step_desc still = {.dt = 0.0f};
    const int tenth = (edits + 9) / 10;
    double held[FIFTHS + 1] = {0.0};
    uint32_t state = 1;
    springls_context *ctx;
    springls_status status = springls_create(&desc, &ctx);
    if (status != SPRINGLS_OK) {
        return status;
    }
    status = springls_set_implicit(ctx, springls_implicit_sphere, (void *)&body);
    if (status == SPRINGLS_OK) {
        status = springls_settle(ctx, 1000);
    }
    held[0] = (double)springls_memory_used(ctx) / 1048576.0;
    for (int i = 0; i < edits && status == SPRINGLS_OK; ++i) {
        springls_sphere ball = dig(i, edits, at_one_place, &body, &state);
        double begun = processor_ms();
        const springls_operation operation = at_one_place && i % 2 ? SPRINGLS_OPERATION_UNION : SPRINGLS_OPERATION_DIFFERENCE;
        status = springls_combine_implicit(ctx, operation, springls_implicit_sphere, &ball);
        ms[i] = processor_ms() - begun;
        begun = processor_ms();
        if (status == SPRINGLS_OK) {
            status = springls_step(ctx, &still);
        }
        step_ms[i] = processor_ms() - begun;
        if ((i + 1) * FIFTHS % edits < FIFTHS) {
            held[(i + 1) * FIFTHS / edits] = (double)springls_memory_used(ctx) / 1048576.0;
        }
    }
    if (status != SPRINGLS_OK) {
        fprintf(stderr, "edits: %s\n", springls_last_error(ctx));
        springls_destroy(ctx);
        return status;
    }
    json_object_begin(json, key);
    json_integer(json, "springls", springls_count(ctx));
    json_array_begin(json, "mib");
    for (int i = 0; i <= FIFTHS; ++i) {
        json_number(json, NULL, held[i]);
    }
    json_array_end(json);
    report_times(json, "first_tenth_ms", ms, tenth);
    report_times(json, "last_tenth_ms", ms + edits - tenth, tenth);
    report_times(json, "step_ms", step_ms, edits);
    json_object_end(json);
    springls_destroy(ctx);
    return SPRINGLS_OK;
}

int main(int argc, char **argv)
{
    int grid = 0, edits = 600;
    const bool numbers = (argc == 2 || argc == 3) && cli_read_int(argv[1], &grid) && (argc == 2 || cli_read_int(argv[2], &edits));
    if (!numbers || grid < 64 || grid > 1024 || edits < FIFTHS || edits > MOST_EDITS) {
        fprintf(stderr, "usage: edits GRID [EDITS]: GRID 64 to 1024, EDITS %d to %d\n", FIFTHS, MOST_EDITS);
        return 2;
    }
    struct json_writer json;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_integer(&json, "edits", edits);
    springls_status status = run(&json, "spread", grid, edits, false);
    if (status == SPRINGLS_OK) {
        status = run(&json, "at_one_place", grid, edits, true);
    }
    json_object_end(&json);
    return !json_close(&json) || status != SPRINGLS_OK;
}
