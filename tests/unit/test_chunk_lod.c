/* test_chunk_lod.c - chunks at levels of detail, by either contouring: closed at any levels of neighbors, within the tolerance, made of the
   chunk's own vertices, fewer triangles with each level, the same for any threads. */
#include "fixtures.h"

enum { SIZE = 40, SIDE = 5, BRICKS = SIDE * SIDE * SIDE };

/* What an engine keeps of a chunk, and what it draws. */
typedef struct scene {
    springls_context *ctx;
    springls_chunks *chunks;
    springls_chunk chunk[BRICKS];
    springls_lod lod[BRICKS];
    int level[BRICKS];
    springls_tasks tasks;
} scene;

/* A ball, a plate with sharp edges, a thin rod, a droplet, and a ball that the border of the grid cuts. World units. */
static void shapes(void *user, const float *points, int count, float *out)
{
    static const springls_box plate = {{27.0f, 20.0f, 20.4f}, {9.3f, 11.2f, 1.6f}}, rod = {{22.0f, 33.1f, 30.2f}, {14.0f, 0.8f, 0.9f}};
    static const springls_sphere ball[3] = {{{13.2f, 18.7f, 20.3f}, 9.1f}, {{33.0f, 32.0f, 7.1f}, 2.2f}, {{6.0f, 35.0f, 33.0f}, 8.0f}};
    float part[64];
    int i, k, n;
    (void)user;
    for (; count > 0; count -= n, points += 3 * n, out += n) {
        n = springls__imin(count, 64);
        springls_implicit_box((void *)(uintptr_t)&plate, points, n, out);
        springls_implicit_box((void *)(uintptr_t)&rod, points, n, part);
        for (i = 0; i < n; i++) out[i] = springls__min(out[i], part[i]);
        for (k = 0; k < 3; k++) {
            springls_implicit_sphere((void *)(uintptr_t)&ball[k], points, n, part);
            for (i = 0; i < n; i++) out[i] = springls__min(out[i], part[i]);
        }
    }
}

/* Turns about z, faster at the top. */
static void twist(void *user, const float *x, int count, float time, float *v)
{
    (void)user;
    (void)time;
    for (; count > 0; count--, x += 3, v += 3) {
        v[0] = -(x[1] - 20.0f) * x[2] / 20.0f;
        v[1] = (x[0] - 20.0f) * x[2] / 20.0f;
        v[2] = 0.0f;
    }
}

static void *copy_of(const void *from, size_t bytes)
{
    void *to = malloc(bytes + 1);
    memcpy(to, from, bytes);
    return to;
}

static void keep_chunk(scene *s, const springls_chunk *from)
{
    const int i = from->brick[0] + SIDE * (from->brick[1] + SIDE * from->brick[2]);
    const size_t vertices = 3 * (size_t)from->vertex_count * sizeof(float);
    springls_chunk *to = &s->chunk[i];
    if (from->triangle_count == 0) return;
    *to = *from;
    to->positions = (float *)copy_of(from->positions, vertices);
    to->correspondences = (float *)copy_of(from->correspondences, vertices);
    to->triangles = (uint16_t *)copy_of(from->triangles, 3 * (size_t)from->triangle_count * sizeof(uint16_t));
    s->lod[i].triangles = (uint16_t *)malloc(3 * (size_t)from->triangle_count * sizeof(uint16_t));
}

/* The world of the shapes on another grid: stretched along z, or mirrored. */
typedef enum place { UPRIGHT, MIRRORED, STRETCHED } place;

static springls_status scene_begin(scene *s, springls_contouring contouring, place at)
{
    springls_params params = springls_default_params();
    springls_forces forces = fixture_forces(twist, NULL);
    const springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.05f);
    springls_chunks_desc desc = { .correspondences = true };
    const springls_chunk *changed;
    springls_desc d;
    int i, count;
    memset(s, 0, sizeof *s);
    forces.voxel_units = true;
    params.contouring = contouring;
    d = fixture_desc(SIZE, &params);
    d.tasks = s->tasks;
    for (i = 0; i < 3; i++) d.grid.spacing[i] = at == STRETCHED && i == 2 ? 2.0 : 1.0;
    d.grid.direction[0] = at == MIRRORED ? -1.0 : 1.0;
    d.grid.direction[4] = d.grid.direction[8] = 1.0;
    d.grid.origin[0] = at == MIRRORED ? 39.0 : 0.0;
    SPRINGLS__TRY(springls_create(&d, &s->ctx));
    SPRINGLS__TRY(springls_set_implicit(s->ctx, shapes, NULL));
    SPRINGLS__TRY(springls_run(s->ctx, &step, 3));
    SPRINGLS__TRY(springls_chunks_create(s->ctx, &desc, &s->chunks));
    SPRINGLS__TRY(springls_chunks_update(s->ctx, s->chunks, &changed, &count));
    for (i = 0; i < count; i++) keep_chunk(s, &changed[i]);
    return SPRINGLS_OK;
}

static void scene_end(scene *s)
{
    int i;
    for (i = 0; i < BRICKS; i++) {
        free(s->chunk[i].positions);
        free(s->chunk[i].correspondences);
        free(s->chunk[i].triangles);
        free(s->lod[i].triangles);
    }
    springls_chunks_destroy(s->ctx, s->chunks);
    springls_destroy(s->ctx);
}

/* Finds the triangles of all chunks at s->level. */
static springls_status find_lods(scene *s)
{
    static const int step[3] = { 1, SIDE, SIDE * SIDE };
    int i, face;
    for (i = 0; i < BRICKS; i++) {
        s->lod[i].chunk = &s->chunk[i];
        s->lod[i].level = s->level[i];
        for (face = 0; face < 6; face++) {
            const int at = i / step[face / 2] % SIDE, to = at + (face % 2 ? 1 : -1);
            s->lod[i].neighbors[face] = to >= 0 && to < SIDE ? s->level[i + (face % 2 ? 1 : -1) * step[face / 2]] : 0;
        }
    }
    return springls_chunks_lod(s->ctx, s->lod, BRICKS);
}

static int count_triangles(const scene *s)
{
    int i, n = 0;
    for (i = 0; i < BRICKS; i++) n += s->lod[i].triangle_count;
    return n;
}

typedef struct side { float x[6]; } side;
static int compare_sides(const void *a, const void *b) { return memcmp(a, b, sizeof(side)); }

/* As many sides of triangles run one way as the other way, bit by bit. */
static greatest_test_res is_closed(const scene *s)
{
    const size_t most = 3 * (size_t)count_triangles(s);
    side *there = (side *)malloc((most + 1) * sizeof *there), *back = (side *)malloc((most + 1) * sizeof *back);
    size_t n = 0;
    int i, c;
    for (i = 0; i < BRICKS; i++)
        for (c = 0; c < 3 * s->lod[i].triangle_count; c++, n++) {
            const uint16_t *t = s->lod[i].triangles;
            const float *from = s->chunk[i].positions + 3 * t[c], *to = s->chunk[i].positions + 3 * t[c % 3 == 2 ? c - 2 : c + 1];
            memcpy(there[n].x, from, 12);
            memcpy(there[n].x + 3, to, 12);
            memcpy(back[n].x, to, 12);
            memcpy(back[n].x + 3, from, 12);
        }
    ASSERT_EQ(most, n);
    qsort(there, n, sizeof *there, compare_sides);
    qsort(back, n, sizeof *back, compare_sides);
    ASSERT(memcmp(there, back, n * sizeof *there) == 0);
    free(there);
    free(back);
    PASS();
}

/* Any two levels beside each other in all places, and random ones. */
TEST borders_fit(springls_contouring contouring, place at)
{
    scene s;
    int i, k;
    memset(&s, 0, sizeof s);
    ASSERT_OK(scene_begin(&s, contouring, at));
    for (k = 0; k < 16; k++) {
        for (i = 0; i < BRICKS; i++) s.level[i] = (i % SIDE + i / SIDE % SIDE + i / SIDE / SIDE) % 2 ? k % 4 : k / 4;
        ASSERT_OK(find_lods(&s));
        CHECK_CALL(is_closed(&s));
    }
    for (k = 0; k < 10; k++) {
        fixture_seed((uint32_t)k);
        for (i = 0; i < BRICKS; i++) s.level[i] = (int)(fixture_bits() >> 8 & 3u);
        ASSERT_OK(find_lods(&s));
        CHECK_CALL(is_closed(&s));
    }
    scene_end(&s);
    PASS();
}

static d3 d3_at(const float *x) { return d3_make((double)x[0], (double)x[1], (double)x[2]); }

/* Returns how far a place is from triangles of a chunk. */
static double distance_from(const springls_chunk *chunk, const uint16_t *triangles, int count, d3 x)
{
    double least = HUGE_VAL;
    int t, k;
    for (t = 0; t < count; t++) {
        d3 corner[3];
        for (k = 0; k < 3; k++) corner[k] = d3_at(chunk->positions + 3 * triangles[3 * t + k]);
        least = fmin(least, d3_triangle_distance(corner, x));
    }
    return least;
}

/* The errors are what they promise to be, of vertices and of the middles of the new triangles, and triangles are fewer. */
TEST errors_are_bounded(springls_contouring contouring, double most_triangles[4])
{
    scene s;
    int level, i, v, t, full = 0;
    memset(&s, 0, sizeof s);
    ASSERT_OK(scene_begin(&s, contouring, UPRIGHT));
    for (level = 0; level < 4; level++) {
        const double tolerance = level ? 0.125 * (1 << level) : 0.0;
        double back = 0.0;
        for (i = 0; i < BRICKS; i++) s.level[i] = level;
        ASSERT_OK(find_lods(&s));
        for (i = 0; i < BRICKS; i++) {
            const springls_chunk *chunk = &s.chunk[i];
            const springls_lod *lod = &s.lod[i];
            for (v = 0; v < chunk->vertex_count; v++) {
                const double d = distance_from(chunk, lod->triangles, lod->triangle_count, d3_at(chunk->positions + 3 * v));
                ASSERT_LTE(d, (double)lod->error + 1e-4);
            }
            for (t = 0; t < lod->triangle_count; t++) {
                const uint16_t *c = lod->triangles + 3 * t;
                const d3 middle = d3_scale(d3_add(d3_add(d3_at(chunk->positions + 3 * c[0]), d3_at(chunk->positions + 3 * c[1])),
                                                  d3_at(chunk->positions + 3 * c[2])), 1.0 / 3.0);
                back = fmax(back, distance_from(chunk, chunk->triangles, chunk->triangle_count, middle));
            }
            ASSERT_LTE((double)lod->error, tolerance + 1e-4);
        }
        if (level == 0) full = count_triangles(&s);
        ASSERT_LTE((double)count_triangles(&s), most_triangles[level] * full);
        ASSERT_LTE(back, 1.5 * tolerance + 1e-4);
    }
    scene_end(&s);
    PASS();
}

/* Threads change no bit. */
TEST threads_change_nothing(void)
{
    fixture_workers workers;
    uint64_t hash[2];
    int k, i;
    for (k = 0; k < 2; k++) {
        scene s;
        springls_tasks tasks = fixture_tasks(&workers, 3, 1);
        memset(&s, 0, sizeof s);
        ASSERT_OK(scene_begin(&s, SPRINGLS_CONTOURING_LEVEL_SET, UPRIGHT));
        if (k) s.ctx->desc.tasks = tasks;
        fixture_seed(5u);
        for (i = 0; i < BRICKS; i++) s.level[i] = (int)(fixture_bits() >> 8 & 3u);
        ASSERT_OK(find_lods(&s));
        for (hash[k] = 1, i = 0; i < BRICKS; i++) {
            hash[k] = springls__hash(hash[k], s.lod[i].triangles, 3 * (size_t)s.lod[i].triangle_count * sizeof(uint16_t));
            hash[k] = springls__hash(hash[k], &s.lod[i].error, sizeof(float));
        }
        scene_end(&s);
    }
    ASSERT_EQ(hash[0], hash[1]);
    PASS();
}

/* A wrong request is refused, writes nothing and leaves nothing behind; so does a lack of memory. */
TEST wrong_requests_are_refused(void)
{
    fixture_heap heap;
    springls_desc desc;
    scene s;
    springls_chunk chunk;
    springls_lod lod;
    uint16_t corner[3];
    size_t bytes;
    float kept;
    int i;
    memset(&s, 0, sizeof s);
    ASSERT_OK(scene_begin(&s, SPRINGLS_CONTOURING_LEVEL_SET, UPRIGHT));
    for (i = 0; s.chunk[i].triangle_count == 0; i++) continue;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_lod(NULL, &lod, 1));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_lod(s.ctx, NULL, 1));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_lod(s.ctx, &lod, -1));
    ASSERT_OK(springls_chunks_lod(s.ctx, NULL, 0));
#define REFUSED(change) do {                                                                  \
        memset(&lod, 0, sizeof lod);                                                          \
        chunk = s.chunk[i];                                                                   \
        lod.chunk = &chunk;                                                                   \
        lod.level = 1;                                                                        \
        lod.triangles = s.lod[i].triangles;                                                   \
        change;                                                                               \
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_chunks_lod(s.ctx, &lod, 1));        \
    } while (0)
    REFUSED(lod.chunk = NULL);
    REFUSED(lod.level = 4);
    REFUSED(lod.level = -1);
    REFUSED(lod.neighbors[5] = 4);
    REFUSED(lod.triangles = NULL);
    REFUSED(chunk.positions = NULL);
    REFUSED(chunk.vertex_count = -1);
    REFUSED(chunk.vertex_count = 65537);
    REFUSED(chunk.triangle_count = INT32_MAX / 3 + 1);
    corner[0] = corner[1] = 0;
    corner[2] = (uint16_t)chunk.vertex_count;
    REFUSED((chunk.triangles = corner, chunk.triangle_count = 1));
    kept = s.chunk[i].correspondences[4];
    s.chunk[i].correspondences[4] = (float)INFINITY;
    REFUSED((void)0);
    s.chunk[i].correspondences[4] = kept;
    kept = s.chunk[i].positions[4];
    s.chunk[i].positions[4] = (float)NAN;
    REFUSED((void)0);
    s.chunk[i].positions[4] = kept;

    desc = fixture_desc(SIZE, NULL);
    desc.allocator = fixture_allocator(&heap);
    springls_chunks_destroy(s.ctx, s.chunks);
    springls_destroy(s.ctx);
    ASSERT_OK(springls_create(&desc, &s.ctx));
    for (i++; s.chunk[i].triangle_count == 0; i++) continue;
    bytes = heap.bytes;
    heap.fail_at = heap.calls; /* the next */
    memset(&lod, 0, sizeof lod);
    lod.chunk = &s.chunk[i];
    lod.level = 3;
    lod.triangles = s.lod[i].triangles;
    ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, springls_chunks_lod(s.ctx, &lod, 1));
    ASSERT_OK(springls_chunks_lod(s.ctx, &lod, 1));
    ASSERT_EQ(bytes, heap.bytes);
    for (i = 0; i < BRICKS; i++) s.level[i] = 1;
    i = heap.calls;
    ASSERT_OK(find_lods(&s)); /* of two batches: no allocation may fail after the first of them */
    ASSERT_EQ(i + 1, heap.calls);
    ASSERT_EQ(0, heap.wrong_sizes);
    s.chunks = NULL;
    scene_end(&s);
    PASS();
}

/* Chunks that were altered are worked on all the same: no call ends in a place that it does not own. */
TEST any_triangles_will_do(void)
{
    scene s;
    int i, k, c;
    memset(&s, 0, sizeof s);
    ASSERT_OK(scene_begin(&s, SPRINGLS_CONTOURING_SPRINGLS, UPRIGHT));
    for (k = 0; k < 12; k++) {
        fixture_seed((uint32_t)k);
        for (i = 0; i < BRICKS; i++) {
            s.level[i] = (int)(fixture_bits() >> 8 & 3u);
            for (c = 0; c < 3 * s.chunk[i].triangle_count; c++)
                if (fixture_between(0.0f, 1.0f) < 0.02f * (float)k)
                    s.chunk[i].triangles[c] = (uint16_t)((int)fixture_bits() % s.chunk[i].vertex_count);
        }
        ASSERT_OK(find_lods(&s));
        for (i = 0; i < BRICKS; i++) ASSERT_LTE(s.lod[i].triangle_count, s.chunk[i].triangle_count);
    }
    scene_end(&s);
    PASS();
}

/* A sliver at an edge of its brick becomes an edge of the border: there its vertices and correspondences are found. So does the last brick
   that an int can count, which has no border there. */
TEST a_chunk_vanishes(void)
{
    static float positions[12] = { 0, 0, 2, 0, 0, 4, 0, 0.1f, 3, 0.1f, 0, 3 }, from[12] = { 50, 0, 2, 50, 0, 4, 50, 0.1f, 3, 50, 0, 3 };
    static uint16_t triangles[6] = { 0, 2, 3, 1, 3, 2 };
    springls_context *ctx = fixture_context(SIZE, NULL);
    uint16_t found[6];
    springls_chunk chunk;
    springls_lod lod;
    int i;
    memset(&chunk, 0, sizeof chunk);
    memset(&lod, 0, sizeof lod);
    chunk.positions = positions;
    chunk.correspondences = from;
    chunk.triangles = triangles;
    chunk.vertex_count = 4;
    chunk.triangle_count = 2;
    lod.chunk = &chunk;
    lod.level = 1;
    lod.triangles = found;
    for (i = 0; i < 6; i++) lod.neighbors[i] = 1;
    ASSERT_OK(springls_chunks_lod(ctx, &lod, 1));
    ASSERT_EQ(0, lod.triangle_count);
    ASSERT_IN_RANGE(0.1f, lod.error, 1e-5f);
    ASSERT_IN_RANGE(0.1f, lod.material_error, 1e-5f);
    for (i = 0; i < 3; i++) chunk.brick[i] = INT32_MAX;
    ASSERT_OK(springls_chunks_lod(ctx, &lod, 1));
    ASSERT_EQ(2, lod.triangle_count);
    springls_destroy(ctx);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    static double most[4] = { 1.0, 0.4, 0.25, 0.2 };
    GREATEST_MAIN_BEGIN();
    RUN_TESTp(errors_are_bounded, SPRINGLS_CONTOURING_LEVEL_SET, most);
    RUN_TESTp(errors_are_bounded, SPRINGLS_CONTOURING_SPRINGLS, most);
    RUN_TESTp(borders_fit, SPRINGLS_CONTOURING_LEVEL_SET, UPRIGHT);
    RUN_TESTp(borders_fit, SPRINGLS_CONTOURING_SPRINGLS, UPRIGHT);
    RUN_TESTp(borders_fit, SPRINGLS_CONTOURING_LEVEL_SET, MIRRORED);
    RUN_TESTp(borders_fit, SPRINGLS_CONTOURING_SPRINGLS, STRETCHED);
    RUN_TEST(threads_change_nothing);
    RUN_TEST(wrong_requests_are_refused);
    RUN_TEST(any_triangles_will_do);
    RUN_TEST(a_chunk_vanishes);
    GREATEST_MAIN_END();
}
