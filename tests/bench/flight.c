/* flight GRID [FRAMES] - levels of detail in a flight over a world of bodies, without a window: which triangles a picture of 1080 rows
 * would have, and what finding them costs, by springls/detail.h with BUDGET a frame. One JSON object on stdout; milliseconds are those
 * of this thread's processor. `unmatched` counts frames in which a side of a triangle had none that runs the other way: cracks. Every
 * 50th is looked at, and the status is 1 if there are any. `waiting` groups are to change, `too_coarse` chunks are in groups beyond half
 * a pixel: in the mean, and at most. */
#include "springls.h"

#include "examples/common/base/cli.h"
#include "examples/common/base/json.h"
#include "examples/common/springls/detail.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 1080, MOST_FRAMES = 5000 };

#define BUDGET 4e-3 /* seconds a frame */

static uint64_t hash_of_side(const float *a, const float *b)
{
    uint64_t hash = 1469598103934665603u;
    float x[6];
    memcpy(x, a, 12);
    memcpy(x + 3, b, 12);
    for (int k = 0; k < 6; ++k) {
        uint32_t bits;
        memcpy(&bits, &x[k], sizeof bits);
        hash = (hash ^ bits) * 0xff51afd7ed558ccdu;
        hash ^= hash >> 32;
    }
    return hash;
}

/* Returns 0 where all sides have one that runs the other way: sums of hashes cancel. */
static uint64_t cracks(const struct detail_world *world)
{
    uint64_t sum = 0;
    for (int i = 0; i < world->count; ++i) {
        const springls_lod *lod = &world->place[i].lod;
        const float *x = lod->chunk->positions;
        for (int c = 0; c < 3 * lod->triangle_count; ++c) {
            const float *a = x + 3 * lod->triangles[c], *b = x + 3 * lod->triangles[c % 3 == 2 ? c - 2 : c + 1];
            sum += hash_of_side(a, b) - hash_of_side(b, a);
        }
    }
    return sum;
}

/* Returns how many chunks are in groups that are shown with an error of more than half a pixel: detail_choose has found what had been. */
static int too_coarse(const struct detail_world *world)
{
    int n = 0;
    for (int i = 0; i < world->group_count; ++i) {
        const struct detail_group *group = &world->group[i];
        n += group->pixels > DETAIL_HALF_A_PIXEL && group->wanted < group->level ? group->count : 0;
    }
    return n;
}

static int64_t triangles(const struct detail_world *world, bool all)
{
    int64_t n = 0;
    for (int i = 0; i < world->count; ++i) {
        n += all ? world->place[i].chunk.triangle_count : world->place[i].lod.triangle_count;
    }
    return n;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int fail(springls_context *ctx)
{
    fprintf(stderr, "flight: %s\n", springls_last_error(ctx));
    return 1;
}

int main(int argc, char **argv)
{
    static double ms[MOST_FRAMES];
    int grid = 0, frames = 600;
    const bool numbers = (argc == 2 || argc == 3) && cli_read_int(argv[1], &grid) && (argc == 2 || cli_read_int(argv[2], &frames));
    if (!numbers || grid < DETAIL_BODY || grid > 1024 || grid % DETAIL_BODY || frames < 1 || frames > MOST_FRAMES) {
        fprintf(stderr, "usage: flight GRID [FRAMES]: GRID is a multiple of %d up to 1024, FRAMES 1 to %d\n", DETAIL_BODY, MOST_FRAMES);
        return 2;
    }
    const springls_desc desc = {.grid = {.size = {grid, grid, grid}}};
    const float pixel = 2.0f * 0.57735f / (float)ROWS; /* of a view of 60 degrees, at distance 1 */
    struct detail_world world;
    springls_context *ctx;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "flight: %s\n", springls_create_error(&desc));
        return 1;
    }
    if (springls_set_implicit(ctx, detail_bodies, NULL) != SPRINGLS_OK) {
        return fail(ctx);
    }
    const double loading = detail_seconds();
    const char *failed = detail_load(&world, ctx, desc.grid.size);
    if (failed) {
        fprintf(stderr, "flight: %s\n", failed);
        return 1;
    }
    const double load_ms = 1e3 * (detail_seconds() - loading) / (3.0 * world.count);
    double drawn = 0.0, requests = 0.0, changes = 0.0, waiting = 0.0, coarse = 0.0;
    int unmatched = 0, most_requests = 0, most_coarse = 0;
    float eye[3];
    detail_eye(0.0, (float)grid, eye);
    for (int changed = 1; changed;) { /* before the flight: all that it begins with */
        if (detail_update(&world, ctx, detail_choose(&world, eye, pixel), 1e30, &changed) < 0) {
            return fail(ctx);
        }
    }
    for (int i = 0; i < frames; ++i) {
        int changed;
        detail_eye((double)i / frames, (float)grid, eye);
        const double begin = detail_seconds();
        const int due = detail_choose(&world, eye, pixel), asked = detail_update(&world, ctx, due, begin + BUDGET, &changed);
        ms[i] = 1e3 * (detail_seconds() - begin);
        if (asked < 0) {
            return fail(ctx);
        }
        drawn += (double)triangles(&world, false);
        requests += asked;
        changes += changed;
        waiting += due - changed;
        const int beyond = too_coarse(&world);
        coarse += beyond;
        most_coarse = beyond > most_coarse ? beyond : most_coarse;
        most_requests = asked > most_requests ? asked : most_requests;
        unmatched += i % 50 == 0 && cracks(&world) != 0;
    }
    qsort(ms, (size_t)frames, sizeof *ms, ascending);
    struct json_writer json;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_integer(&json, "springls", springls_count(ctx));
    json_integer(&json, "chunks", world.count);
    json_integer(&json, "frames", frames);
    json_number(&json, "triangles_full", (double)triangles(&world, true));
    json_number(&json, "triangles_drawn", drawn / frames);
    json_number(&json, "level_changes", changes / frames);
    json_number(&json, "lods", requests / frames);
    json_integer(&json, "most_lods", most_requests);
    json_number(&json, "waiting", waiting / frames);
    json_number(&json, "too_coarse", coarse / frames);
    json_integer(&json, "most_too_coarse", most_coarse);
    json_number(&json, "lod_ms", load_ms);
    json_number(&json, "frame_p50_ms", ms[frames / 2]);
    json_number(&json, "frame_p95_ms", ms[frames * 95 / 100]);
    json_number(&json, "frame_max_ms", ms[frames - 1]);
    json_integer(&json, "unmatched", unmatched);
    json_object_end(&json);
    const bool written = json_close(&json);
    detail_free(&world);
    springls_destroy(ctx);
    if (unmatched > 0) {
        fprintf(stderr, "flight: %d of the frames that were looked at have cracks\n", unmatched);
    }
    return !written || unmatched > 0;
}
