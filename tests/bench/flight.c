/* flight GRID [FRAMES] - levels of detail in a flight over a world of bodies, without a window: which triangles a picture of 1080 rows would
 * have, and what finding them costs. Each chunk is drawn at the highest level whose error is less than half a pixel at its distance; at most
 * CHANGES chunks a frame change their level, those that need it most. One JSON object on stdout; milliseconds are those of this thread's
 * processor. `unmatched` counts frames in which a side of a triangle had none that runs the other way: cracks. Every 50th is
 * looked at, and the status is 1 if there are any. `waiting` chunks are to change, of which `too_coarse` are beyond half a pixel. */
#define _POSIX_C_SOURCE 200809L
#include "springls.h"

#include "examples/common/base/cli.h"
#include "examples/common/base/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LEVELS = 4, CHANGES = 16, ROWS = 1080, BODY = 128, MOST_FRAMES = 5000 };

/* A chunk of the world, and what is shown of it. */
struct place {
    springls_chunk chunk;
    springls_lod lod;
    float error[LEVELS], middle[3];
    int wanted, pixels; /* the level that it should have; how many hundredths of a pixel its error is beyond */
    bool asked; /* for other triangles */
};

struct world {
    int bricks, count;
    int *at;             /* [brick] its place in `place`; -1: it is empty */
    struct place *place;
    springls_lod *request;
};

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Bodies of 128 voxels: balls with dents, each turned otherwise. */
static void bodies(void *user, const float *points, int count, float *out)
{
    (void)user;
    for (int i = 0; i < count; ++i, points += 3) {
        float x[3], r2 = 0.0f, wave = 1.0f;
        int number = 0;
        for (int k = 0; k < 3; ++k) {
            const float cell = floorf(points[k] / BODY);
            number = 3 * number + (int)cell;
            x[k] = points[k] - (cell + 0.5f) * BODY;
            r2 += x[k] * x[k];
        }
        for (int k = 0; k < 3; ++k) {
            wave *= sinf(0.22f * x[k] + (float)(number * (k + 1)));
        }
        out[i] = 0.6f * (sqrtf(r2) - 26.0f + 4.0f * wave);
    }
}

static int brick_number(const struct world *world, const int brick[3])
{
    for (int k = 0; k < 3; ++k) {
        if (brick[k] < 0 || brick[k] >= world->bricks) {
            return -1;
        }
    }
    return brick[0] + world->bricks * (brick[1] + world->bricks * brick[2]);
}

/* Returns the neighbor of a chunk across a face; NULL: there is none. */
static struct place *neighbor(const struct world *world, const struct place *place, int face)
{
    int brick[3];
    memcpy(brick, place->chunk.brick, sizeof brick);
    brick[face / 2] += face % 2 ? 1 : -1;
    const int number = brick_number(world, brick), at = number < 0 ? -1 : world->at[number];
    return at < 0 ? NULL : &world->place[at];
}

static void *copy_of(const void *from, size_t bytes)
{
    void *to = malloc(bytes + 1);
    if (!to) {
        fprintf(stderr, "flight: out of memory\n");
        exit(1);
    }
    return memcpy(to, from, bytes);
}

/* Takes the chunks of an update. */
static void take(struct world *world, const springls_chunk *changed, int count)
{
    const size_t bricks = (size_t)world->bricks * (size_t)world->bricks * (size_t)world->bricks;
    world->at = malloc(bricks * sizeof *world->at);
    world->place = calloc((size_t)count + 1, sizeof *world->place);
    world->request = calloc((size_t)count + 1, sizeof *world->request);
    if (!world->at || !world->place || !world->request) {
        fprintf(stderr, "flight: out of memory\n");
        exit(1);
    }
    memset(world->at, -1, bricks * sizeof *world->at);
    for (int i = 0; i < count; ++i) {
        struct place *place = &world->place[world->count];
        if (changed[i].triangle_count == 0) {
            continue;
        }
        place->chunk = changed[i];
        place->chunk.positions = copy_of(changed[i].positions, 3 * (size_t)changed[i].vertex_count * sizeof(float));
        place->chunk.triangles = copy_of(changed[i].triangles, 3 * (size_t)changed[i].triangle_count * sizeof(uint16_t));
        place->lod.chunk = &place->chunk;
        place->lod.triangles = copy_of(changed[i].triangles, 3 * (size_t)changed[i].triangle_count * sizeof(uint16_t));
        place->lod.triangle_count = changed[i].triangle_count;
        for (int k = 0; k < 3; ++k) {
            place->middle[k] = 8.0f * (float)changed[i].brick[k] + 4.0f;
        }
        world->at[brick_number(world, changed[i].brick)] = world->count++;
    }
}

/* Finds the errors of each level once. */
static springls_status find_errors(springls_context *ctx, struct world *world)
{
    springls_status status = SPRINGLS_OK;
    for (int level = 1; level < LEVELS && status == SPRINGLS_OK; ++level) {
        for (int i = 0; i < world->count; ++i) {
            world->request[i] = world->place[i].lod;
            world->request[i].level = level;
            for (int face = 0; face < 6; ++face) {
                world->request[i].neighbors[face] = level;
            }
        }
        status = springls_chunks_lod(ctx, world->request, world->count);
        for (int i = 0; i < world->count; ++i) {
            world->place[i].error[level] = world->request[i].error;
        }
    }
    for (int i = 0; i < world->count; ++i) { /* the triangles of level 0 again */
        const struct place *place = &world->place[i];
        memcpy(place->lod.triangles, place->chunk.triangles, 3 * (size_t)place->chunk.triangle_count * sizeof(uint16_t));
    }
    return status;
}

/* Where the camera is in a frame: over the world, from one side to the other, down to between the bodies. */
static void eye_at(double fraction, float grid, float eye[3])
{
    eye[0] = grid * (float)(-0.8 + 2.6 * fraction);
    eye[1] = grid * (float)(0.5 + 0.2 * sin(6.0 * fraction));
    eye[2] = grid * (float)(1.3 - 0.55 * sin(3.14159 * fraction));
}

/* Finds the level that each chunk should have. Returns how many have another one. */
static int choose(struct world *world, const float eye[3])
{
    const float pixel = 2.0f * 0.57735f / (float)ROWS; /* of a view of 60 degrees, at distance 1 */
    int n = 0;
    for (int i = 0; i < world->count; ++i) {
        struct place *place = &world->place[i];
        float d2 = 0.0f;
        for (int k = 0; k < 3; ++k) {
            d2 += (place->middle[k] - eye[k]) * (place->middle[k] - eye[k]);
        }
        const float unit = pixel * fmaxf(sqrtf(d2) - 7.0f, 1.0f);
        for (place->wanted = LEVELS - 1; place->wanted > 0 && place->error[place->wanted] > 0.5f * unit; --place->wanted) {
        }
        place->pixels = (int)fminf(100.0f * place->error[place->lod.level] / unit, 1e6f);
        n += place->wanted != place->lod.level;
    }
    return n;
}

/* Changes the level of a chunk, and asks for it and for the neighbors whose border changes by that. */
static void change(struct world *world, struct place *place)
{
    const int before = place->lod.level;
    place->lod.level = place->wanted;
    place->asked = true;
    for (int face = 0; face < 6; ++face) {
        struct place *other = neighbor(world, place, face);
        if (!other) {
            continue;
        }
        const int level = other->lod.level;
        other->lod.neighbors[face ^ 1] = place->wanted;
        other->asked = other->asked || (before < level ? before : level) != (place->wanted < level ? place->wanted : level);
    }
}

/* Changes up to CHANGES chunks: first those that are too coarse by most, then those that may be coarser. Returns how many triangles were
 * asked for; -1: a failure. */
static int update(springls_context *ctx, struct world *world, int *changed)
{
    int count = 0;
    for (*changed = 0; *changed < CHANGES; ++*changed) {
        struct place *best = NULL;
        for (int i = 0; i < world->count; ++i) {
            struct place *place = &world->place[i];
            if (place->wanted == place->lod.level) {
                continue;
            }
            if (place->wanted < place->lod.level ? !best || best->wanted > best->lod.level || place->pixels > best->pixels
                                                 : !best || (best->wanted > best->lod.level && place->pixels < best->pixels)) {
                best = place;
            }
        }
        if (!best) {
            break;
        }
        change(world, best);
    }
    for (int i = 0; i < world->count; ++i) {
        struct place *place = &world->place[i];
        if (place->asked) {
            place->asked = false;
            world->request[count++] = place->lod;
        }
    }
    if (springls_chunks_lod(ctx, world->request, count) != SPRINGLS_OK) {
        return -1;
    }
    for (int i = 0; i < count; ++i) {
        const int at = world->at[brick_number(world, world->request[i].chunk->brick)];
        world->place[at].lod = world->request[i];
    }
    return count;
}

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
static uint64_t cracks(const struct world *world)
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

/* Returns how many chunks are shown with an error of more than half a pixel. */
static int too_coarse(const struct world *world)
{
    int n = 0;
    for (int i = 0; i < world->count; ++i) {
        n += world->place[i].wanted < world->place[i].lod.level;
    }
    return n;
}

static int64_t triangles(const struct world *world, bool all)
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
    if (!numbers || grid < BODY || grid > 1024 || grid % BODY || frames < 1 || frames > MOST_FRAMES) {
        fprintf(stderr, "usage: flight GRID [FRAMES]: GRID is a multiple of %d up to 1024, FRAMES 1 to %d\n", BODY, MOST_FRAMES);
        return 2;
    }
    const springls_desc desc = {.grid = {.size = {grid, grid, grid}}};
    struct world world = {.bricks = grid / 8};
    springls_context *ctx;
    springls_chunks *chunks;
    const springls_chunk *listed;
    int count;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "flight: %s\n", springls_create_error(&desc));
        return 1;
    }
    if (springls_set_implicit(ctx, bodies, NULL) != SPRINGLS_OK || springls_chunks_create(ctx, NULL, &chunks) != SPRINGLS_OK
        || springls_chunks_update(ctx, chunks, &listed, &count) != SPRINGLS_OK) {
        return fail(ctx);
    }
    take(&world, listed, count);
    const double loading = seconds();
    if (find_errors(ctx, &world) != SPRINGLS_OK) {
        return fail(ctx);
    }
    const double load_ms = 1e3 * (seconds() - loading) / (3.0 * world.count);
    double drawn = 0.0, requests = 0.0, changes = 0.0, waiting = 0.0, coarse = 0.0;
    int unmatched = 0, most_requests = 0;
    float eye[3];
    eye_at(0.0, (float)grid, eye);
    for (int changed = 1; changed;) { /* before the flight: all that it begins with */
        choose(&world, eye);
        if (update(ctx, &world, &changed) < 0) {
            return fail(ctx);
        }
    }
    for (int i = 0; i < frames; ++i) {
        int changed;
        eye_at((double)i / frames, (float)grid, eye);
        const double begin = seconds();
        const int due = choose(&world, eye), asked = update(ctx, &world, &changed);
        ms[i] = 1e3 * (seconds() - begin);
        if (asked < 0) {
            return fail(ctx);
        }
        drawn += (double)triangles(&world, false);
        requests += asked;
        changes += changed;
        waiting += due - changed;
        coarse += too_coarse(&world);
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
    json_number(&json, "lod_ms", load_ms);
    json_number(&json, "frame_p50_ms", ms[frames / 2]);
    json_number(&json, "frame_p95_ms", ms[frames * 95 / 100]);
    json_number(&json, "frame_max_ms", ms[frames - 1]);
    json_integer(&json, "unmatched", unmatched);
    json_object_end(&json);
    const bool written = json_close(&json);
    for (int i = 0; i < world.count; ++i) {
        free(world.place[i].chunk.positions);
        free(world.place[i].chunk.triangles);
        free(world.place[i].lod.triangles);
    }
    free(world.at);
    free(world.place);
    free(world.request);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    if (unmatched > 0) {
        fprintf(stderr, "flight: %d of the frames that were looked at have cracks\n", unmatched);
    }
    return !written || unmatched > 0;
}
