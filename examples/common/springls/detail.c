#define _POSIX_C_SOURCE 200809L
#include "springls/detail.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CHUNK = 8, GROUP = 2 }; /* voxels of a chunk, and chunks of a group, along an axis */

#define REFINED 0.9f   /* of half a pixel */
#define COARSENED 0.8f /* of half a pixel */

double detail_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

void detail_bodies(void *user, const float *points, int count, float *out)
{
    (void)user;
    for (int i = 0; i < count; ++i, points += 3) {
        float x[3], r2 = 0.0f, wave = 1.0f;
        int number = 0;
        for (int k = 0; k < 3; ++k) {
            const float cell = floorf(points[k] / DETAIL_BODY);
            number = 3 * number + (int)cell;
            x[k] = points[k] - (cell + 0.5f) * DETAIL_BODY;
            r2 += x[k] * x[k];
        }
        for (int k = 0; k < 3; ++k) {
            wave *= sinf(0.22f * x[k] + (float)(number * (k + 1)));
        }
        out[i] = 0.6f * (sqrtf(r2) - 26.0f + 4.0f * wave);
    }
}

void detail_eye(double fraction, float grid, float eye[3])
{
    eye[0] = grid * (float)(-0.8 + 2.6 * fraction);
    eye[1] = grid * (float)(0.5 + 0.2 * sin(6.0 * fraction));
    eye[2] = grid * (float)(1.3 - 0.55 * sin(3.14159 * fraction));
}

static int brick_number(const struct detail_world *world, const int brick[3])
{
    for (int k = 0; k < 3; ++k) {
        if (brick[k] < 0 || brick[k] >= world->bricks[k]) {
            return -1;
        }
    }
    return brick[0] + world->bricks[0] * (brick[1] + world->bricks[1] * brick[2]);
}

/* Returns the neighbor of a chunk across a face; NULL: there is none. */
static struct detail_place *neighbor(const struct detail_world *world, const struct detail_place *place, int face)
{
    int brick[3];
    memcpy(brick, place->chunk.brick, sizeof brick);
    brick[face / 2] += face % 2 ? 1 : -1;
    const int number = brick_number(world, brick), at = number < 0 ? -1 : world->at[number];
    return at < 0 ? NULL : &world->place[at];
}

/* Returns a copy of `bytes`, of which the caller has one at least; NULL: there is no memory, or nothing to copy. */
static void *copy_of(const void *from, size_t bytes)
{
    void *to = from ? malloc(bytes) : NULL;
    return to ? memcpy(to, from, bytes) : NULL;
}

static size_t bytes_of(int triangles) { return 3 * (size_t)triangles * sizeof(uint16_t); }

/* Compares the groups that chunks are in. */
static int group_order(const void *a, const void *b)
{
    const springls_chunk *x = *(const springls_chunk *const *)a, *y = *(const springls_chunk *const *)b;
    for (int k = 2; k >= 0; --k) {
        if (x->brick[k] / GROUP != y->brick[k] / GROUP) {
            return x->brick[k] / GROUP < y->brick[k] / GROUP ? -1 : 1;
        }
    }
    return 0;
}

/* Takes a chunk. */
static bool take_chunk(struct detail_world *world, const springls_chunk *chunk)
{
    struct detail_place *place = &world->place[world->count];
    const size_t bytes = 3 * (size_t)chunk->vertex_count * sizeof(float);
    place->chunk = *chunk;
    place->chunk.positions = copy_of(chunk->positions, bytes);
    place->chunk.normals = copy_of(chunk->normals, bytes);
    place->chunk.triangles = copy_of(chunk->triangles, bytes_of(chunk->triangle_count));
    place->chunk.correspondences = NULL;
    place->lod.chunk = &place->chunk;
    place->lod.triangles = copy_of(chunk->triangles, bytes_of(chunk->triangle_count));
    place->lod.triangle_count = chunk->triangle_count;
    place->level[0] = (struct detail_kept){place->chunk.triangles, chunk->triangle_count, 0.0f};
    place->changed = true;
    for (int k = 0; k < 3; ++k) {
        place->middle[k] = CHUNK * ((float)chunk->brick[k] + 0.5f);
    }
    world->at[brick_number(world, chunk->brick)] = world->count++;
    return place->chunk.positions && place->chunk.normals && place->chunk.triangles && place->lod.triangles;
}

/* Makes room for so many chunks, at the same number of groups at most. */
static bool make_room(struct detail_world *world, int count)
{
    const size_t bricks = (size_t)world->bricks[0] * (size_t)world->bricks[1] * (size_t)world->bricks[2], n = (size_t)count + 1;
    world->at = malloc(bricks * sizeof *world->at);
    world->place = calloc(n, sizeof *world->place);
    world->group = calloc(n, sizeof *world->group);
    world->request = calloc(n, sizeof *world->request);
    world->due = calloc(n, sizeof *world->due);
    if (world->at) {
        memset(world->at, -1, bricks * sizeof *world->at);
    }
    return world->at && world->place && world->group && world->request && world->due;
}

/* Takes the chunks of an update that have triangles, by groups. */
static bool take(struct detail_world *world, const springls_chunk *listed, int count)
{
    const springls_chunk **sorted = malloc(((size_t)count + 1) * sizeof *sorted);
    bool good = sorted && make_room(world, count);
    int n = 0;
    for (int i = 0; i < count && good; ++i) {
        if (listed[i].triangle_count > 0) {
            sorted[n++] = &listed[i];
        }
    }
    if (good) {
        qsort(sorted, (size_t)n, sizeof *sorted, group_order);
    }
    for (int i = 0; i < n && good; ++i) {
        if (i == 0 || group_order(&sorted[i - 1], &sorted[i]) != 0) {
            world->group[world->group_count++].first = i;
        }
        world->group[world->group_count - 1].count++;
        good = take_chunk(world, sorted[i]);
    }
    free(sorted);
    return good;
}

static const char no_memory[] = "out of memory";

/* Finds the triangles of a level, and its errors. Returns what has failed; NULL: nothing. */
static const char *find_level(struct detail_world *world, springls_context *model, int level)
{
    for (int i = 0; i < world->count; ++i) {
        world->request[i] = world->place[i].lod;
        world->request[i].level = level;
        for (int face = 0; face < 6; ++face) {
            world->request[i].neighbors[face] = level;
        }
    }
    if (springls_chunks_lod(model, world->request, world->count) != SPRINGLS_OK) {
        return springls_last_error(model);
    }
    bool good = true;
    for (int i = 0; i < world->count && good; ++i) {
        const springls_lod *lod = &world->request[i];
        uint16_t *triangles = copy_of(lod->triangles, bytes_of(lod->triangle_count));
        world->place[i].level[level] = (struct detail_kept){triangles, lod->triangle_count, lod->error};
        good = lod->triangle_count == 0 || triangles;
    }
    return good ? NULL : no_memory;
}

/* Shows all chunks at level 0. */
static void show_all(struct detail_world *world)
{
    for (int i = 0; i < world->count; ++i) {
        struct detail_place *place = &world->place[i];
        memcpy(place->lod.triangles, place->level[0].triangles, bytes_of(place->level[0].count));
        for (int face = 0; face < 6; ++face) {
            place->lod.neighbors[face] = neighbor(world, place, face) ? 0 : DETAIL_LEVELS - 1;
        }
    }
}

const char *detail_load(struct detail_world *world, springls_context *model, const int size[3])
{
    springls_chunks *chunks;
    const springls_chunk *listed;
    const char *failed = NULL;
    int count;
    memset(world, 0, sizeof *world);
    for (int k = 0; k < 3; ++k) {
        world->bricks[k] = (size[k] + CHUNK - 1) / CHUNK;
    }
    const springls_chunks_desc zero_level = {.zero_level = true}; /* a large world: a tenth of the time */
    if (springls_chunks_create(model, &zero_level, &chunks) != SPRINGLS_OK) {
        return springls_last_error(model);
    }
    if (springls_chunks_update(model, chunks, &listed, &count) != SPRINGLS_OK) {
        failed = springls_last_error(model);
    } else if (!take(world, listed, count)) {
        failed = no_memory;
    }
    springls_chunks_destroy(model, chunks);
    for (int level = 1; level < DETAIL_LEVELS && !failed; ++level) {
        failed = find_level(world, model, level);
    }
    if (!failed) {
        show_all(world);
    }
    return failed;
}

void detail_free(struct detail_world *world)
{
    for (int i = 0; i < world->count; ++i) {
        struct detail_place *place = &world->place[i];
        free(place->chunk.positions);
        free(place->chunk.normals);
        free(place->lod.triangles);
        for (int level = 0; level < DETAIL_LEVELS; ++level) {
            free(place->level[level].triangles);
        }
    }
    free(world->at);
    free(world->place);
    free(world->group);
    free(world->request);
    free(world->due);
    memset(world, 0, sizeof *world);
}

/* What is too coarse by most comes first, then what may be coarser, the least visible first. */
static int more_urgent(const void *a, const void *b)
{
    const struct detail_group *x = *(struct detail_group *const *)a, *y = *(struct detail_group *const *)b;
    const bool refined[2] = {x->wanted < x->level, y->wanted < y->level};
    const float more = x->pixels - y->pixels;
    if (refined[0] != refined[1]) {
        return refined[0] ? -1 : 1;
    }
    return more == 0.0f ? 0 : (more > 0.0f) == refined[0] ? -1 : 1;
}

/* Finds how many pixels the largest error of a group shows as, at each level. */
static void find_pixels(const struct detail_world *world, const struct detail_group *group, const float eye[3], float pixel,
                        float shown[DETAIL_LEVELS])
{
    memset(shown, 0, DETAIL_LEVELS * sizeof *shown);
    for (int i = group->first; i < group->first + group->count; ++i) {
        const struct detail_place *place = &world->place[i];
        float d2 = 0.0f;
        for (int k = 0; k < 3; ++k) {
            d2 += (place->middle[k] - eye[k]) * (place->middle[k] - eye[k]);
        }
        const float unit = pixel * fmaxf(sqrtf(d2) - 7.0f, 1.0f);
        for (int level = 1; level < DETAIL_LEVELS; ++level) {
            shown[level] = fmaxf(shown[level], place->level[level].error / unit);
        }
    }
}

int detail_choose(struct detail_world *world, const float eye[3], float pixel)
{
    int n = 0;
    for (int i = 0; i < world->group_count; ++i) {
        struct detail_group *group = &world->group[i];
        float shown[DETAIL_LEVELS];
        find_pixels(world, group, eye, pixel, shown);
        group->pixels = shown[group->level];
        group->wanted = group->level;
        while (group->wanted > 0 && shown[group->wanted] > REFINED * DETAIL_HALF_A_PIXEL) {
            --group->wanted;
        }
        for (int level = DETAIL_LEVELS - 1; level > group->wanted && group->wanted == group->level; --level) {
            if (shown[level] <= COARSENED * DETAIL_HALF_A_PIXEL) {
                group->wanted = level;
            }
        }
        if (group->wanted != group->level) {
            world->due[n++] = group;
        }
    }
    qsort(world->due, (size_t)n, sizeof *world->due, more_urgent);
    return n;
}

/* Changes the level of a chunk, and asks for it and for the neighbors whose border changes by that. */
static void change(struct detail_world *world, struct detail_place *place, int wanted)
{
    const int before = place->lod.level;
    place->lod.level = wanted;
    place->asked = true;
    for (int face = 0; face < 6; ++face) {
        struct detail_place *other = neighbor(world, place, face);
        if (!other) {
            continue;
        }
        const int level = other->lod.level;
        other->lod.neighbors[face ^ 1] = wanted;
        other->asked = other->asked || (before < level ? before : level) != (wanted < level ? wanted : level);
    }
}

/* Takes the triangles that are kept for a chunk, if no neighbor is finer. */
static bool take_kept(struct detail_place *place)
{
    const struct detail_kept *kept = &place->level[place->lod.level];
    for (int face = 0; face < 6; ++face) {
        if (place->lod.neighbors[face] < place->lod.level) {
            return false;
        }
    }
    if (kept->count) {
        memcpy(place->lod.triangles, kept->triangles, bytes_of(kept->count));
    }
    place->lod.triangle_count = kept->count;
    place->lod.error = kept->error;
    return true;
}

/* Asks for the triangles of chunk `place`, if it needs others. */
static void ask(struct detail_world *world, struct detail_place *place, int *count)
{
    if (place && place->asked) {
        place->asked = false;
        place->changed = true;
        if (!take_kept(place)) {
            world->request[(*count)++] = place->lod;
        }
    }
}

/* Changes the level of a group. Returns for how many chunks triangles were asked for; -1: a failure. */
static int change_group(struct detail_world *world, springls_context *model, struct detail_group *group)
{
    const int end = group->first + group->count;
    int count = 0;
    group->level = group->wanted;
    for (int i = group->first; i < end; ++i) {
        change(world, &world->place[i], group->level);
    }
    for (int i = group->first; i < end; ++i) {
        ask(world, &world->place[i], &count);
        for (int face = 0; face < 6; ++face) {
            ask(world, neighbor(world, &world->place[i], face), &count);
        }
    }
    if (springls_chunks_lod(model, world->request, count) != SPRINGLS_OK) {
        return -1;
    }
    for (int i = 0; i < count; ++i) {
        world->place[world->at[brick_number(world, world->request[i].chunk->brick)]].lod = world->request[i];
    }
    return count;
}

int detail_update(struct detail_world *world, springls_context *model, int due, double until, int *changed)
{
    int all = 0;
    for (*changed = 0; *changed < due && (*changed == 0 || detail_seconds() < until); ++*changed) {
        const int count = change_group(world, model, world->due[*changed]);
        if (count < 0) {
            return -1;
        }
        all += count;
    }
    return all;
}
