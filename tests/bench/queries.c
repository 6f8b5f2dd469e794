/* queries GRID [RAYS] - what rays and closest points cost after a step: of the watertight surface and of the springls, in turn on
 * the same model, a ball that is turned. One JSON object on stdout. Times are the processor's, on one thread: those of the first
 * query of a frame, which includes whatever is built for it, and of every further ray or point. */
#include "springls.h"

#include "examples/common/base/json.h"
#include "examples/common/base/progress.h"
#include "examples/common/springls/exact_flows.h"
#include "examples/common/springls/run_options.h"

#include <math.h>
#include <stdlib.h>

enum { FRAMES = 10, SETTLE = 5, SURFACES = 2, KINDS = 3 };

static const char *const surfaces[SURFACES] = {"watertight", "soup"};
static const char *const kinds[KINDS] = {"ray", "near_point", "far_point"};

struct cost {
    double first, rest; /* seconds of all frames */
    int found;
};

static uint32_t random_state = 1;

static float between(float low, float high)
{
    random_state = random_state * 1664525u + 1013904223u;
    return low + (high - low) * (float)(random_state >> 8) / 16777216.0f;
}

static void on_sphere(float radius, float middle, float out[3])
{
    float d2;
    do {
        d2 = 0.0f;
        for (int k = 0; k < 3; ++k) {
            out[k] = between(-1.0f, 1.0f);
            d2 += out[k] * out[k];
        }
    } while (d2 > 1.0f || d2 < 0.01f);
    for (int k = 0; k < 3; ++k) {
        out[k] = middle + radius * out[k] / sqrtf(d2);
    }
}

struct queries {
    springls_context *ctx;
    int count;
    float *points[KINDS], *directions;
    springls_hit *hits;
};

/* Rays from around the ball to places inside; points within two voxels of its surface; points anywhere in the grid. */
static void choose(struct queries *q, float size)
{
    const float middle = 0.5f * size, radius = 0.25f * size;
    for (int i = 0; i < q->count; ++i) {
        float inside[3];
        on_sphere(1.6f * radius, middle, q->points[0] + 3 * i);
        on_sphere(radius * cbrtf(between(0.0f, 0.8f)), middle, inside);
        on_sphere(radius + between(-2.0f, 2.0f), middle, q->points[1] + 3 * i);
        for (int k = 0; k < 3; ++k) {
            q->directions[3 * i + k] = inside[k] - q->points[0][3 * i + k];
            q->points[2][3 * i + k] = between(0.0f, size);
        }
    }
}

static springls_status ask(struct queries *q, int surface, int kind, int first, int count)
{
    const springls_surface of = surface ? SPRINGLS_SURFACE_SOUP : SPRINGLS_SURFACE_WATERTIGHT;
    const float *points = q->points[kind] + 3 * first;
    if (kind == 0) {
        return springls_raycast(q->ctx, of, points, q->directions + 3 * first, count, 0.0f, q->hits + first);
    }
    return springls_closest(q->ctx, of, points, count, q->hits + first);
}

static bool measure(struct queries *q, int surface, int kind, struct cost *cost)
{
    const double begin = processor_seconds();
    if (ask(q, surface, kind, 0, 1) != SPRINGLS_OK) {
        return false;
    }
    const double second = processor_seconds();
    if (ask(q, surface, kind, 1, q->count - 1) != SPRINGLS_OK) {
        return false;
    }
    cost->first += second - begin;
    cost->rest += processor_seconds() - second;
    for (int i = 0; i < q->count; ++i) {
        cost->found += q->hits[i].springl >= 0;
    }
    return true;
}

static bool frame(struct queries *q, const springls_step_desc *step, bool counts, struct cost costs[SURFACES][KINDS])
{
    static struct cost unused;
    if (springls_step(q->ctx, step) != SPRINGLS_OK) {
        return false;
    }
    for (int s = 0; s < SURFACES; ++s) {
        for (int k = 0; k < KINDS; ++k) {
            if (!measure(q, s, k, counts ? &costs[s][k] : &unused)) {
                return false;
            }
        }
    }
    return true;
}

static void report(const struct queries *q, int grid, struct cost costs[SURFACES][KINDS])
{
    const double rest = (double)FRAMES * (q->count - 1);
    struct json_writer json;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_integer(&json, "springls", springls_count(q->ctx));
    for (int s = 0; s < SURFACES; ++s) {
        json_object_begin(&json, surfaces[s]);
        json_number(&json, "first_ms", 1e3 * costs[s][0].first / FRAMES); /* what is built serves the others too */
        for (int k = 0; k < KINDS; ++k) {
            json_object_begin(&json, kinds[k]);
            json_number(&json, "ns", 1e9 * costs[s][k].rest / rest);
            json_number(&json, "found_percent", 100.0 * costs[s][k].found / ((double)FRAMES * q->count));
            json_object_end(&json);
        }
        json_object_end(&json);
    }
    json_object_end(&json);
    json_close(&json);
}

int main(int argc, char **argv)
{
    static struct cost costs[SURFACES][KINDS];
    const int grid = argc > 1 ? atoi(argv[1]) : 0;
    struct queries q = {.count = argc > 2 ? atoi(argv[2]) : 4000};
    if (grid < 16 || grid > 1024 || q.count < 2 || q.count > 10000000) {
        fprintf(stderr, "usage: queries GRID [RAYS]\n");
        return 2;
    }
    run_start_threads(1);
    const float size = (float)grid, middle = 0.5f * size;
    springls_sphere ball = {{middle, middle, middle}, 0.25f * size};
    struct exact_flow flow = EXACT_ROTATION(middle, middle, middle, 1.0f, 2.0f, 3.0f, 2.0f / size);
    springls_desc desc = {.grid = {.size = {grid, grid, grid}}, .tasks = run_tasks()};
    springls_forces forces = {.velocity = exact_flow_velocity, .user = &flow};
    springls_step_desc step = {.forces = &forces, .dt = 1.0f, .max_displacement = 2.0f};
    bool memory = true;
    for (int k = 0; k < KINDS; ++k) {
        memory = (q.points[k] = malloc(3 * (size_t)q.count * sizeof(float))) != NULL && memory;
    }
    q.directions = malloc(3 * (size_t)q.count * sizeof(float));
    q.hits = malloc((size_t)q.count * sizeof *q.hits);
    if (!memory || !q.directions || !q.hits || springls_create(&desc, &q.ctx) != SPRINGLS_OK) {
        fprintf(stderr, "queries: no memory\n");
        return 1;
    }
    choose(&q, size);
    bool fine = springls_set_implicit(q.ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK;
    for (int i = 0; i < SETTLE + FRAMES && fine; ++i) {
        fine = frame(&q, &step, i >= SETTLE, costs);
    }
    if (fine) {
        report(&q, grid, costs);
    } else {
        fprintf(stderr, "queries: %s\n", springls_last_error(q.ctx));
    }
    springls_destroy(q.ctx);
    for (int k = 0; k < KINDS; ++k) {
        free(q.points[k]);
    }
    free(q.directions);
    free(q.hits);
    return fine ? 0 : 1;
}
