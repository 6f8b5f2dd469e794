/* test_top_table.c - the top table has entries for the bricks near to bodies only: what a grid costs, and every bit of a result, do
   not depend on how large the domain is, nor on how far bodies are from each other. */
#include "fixtures.h"

enum { SMALL = 128, HUGE_GRID = 4096 };
#ifdef SPRINGLS_NO_SIMD
enum { WITHOUT_SIMD = 1 };
#else
enum { WITHOUT_SIMD = 0 };
#endif

/* An allocator that notes the most bytes that were held at once. */
typedef struct counted_heap { fixture_heap heap; size_t peak; } counted_heap;

static void *counted_alloc(size_t size, void *user)
{
    counted_heap *counted = (counted_heap *)user;
    void *memory = fixture_alloc(size, &counted->heap);
    if (counted->heap.bytes > counted->peak) counted->peak = counted->heap.bytes;
    return memory;
}

static void counted_free(void *memory, size_t size, void *user) { fixture_free(memory, size, &((counted_heap *)user)->heap); }

static springls_allocator counted_allocator(counted_heap *counted)
{
    springls_allocator allocator = fixture_allocator(&counted->heap);
    counted->peak = 0;
    allocator.alloc = counted_alloc;
    allocator.free = counted_free;
    allocator.user = counted;
    return allocator;
}

static springls_status run(springls_context *ctx, springls_mode mode, float x, float y, float z, int steps)
{
    float wind[3];
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    wind[0] = x;
    wind[1] = y;
    wind[2] = z;
    return springls_run(ctx, &step, steps);
}

/* The slots are those of the table's entries, and all that is not outside has entries around it, each of one brick. */
static bool table_is_sound(springls_context *ctx)
{
    const springls__grid *g = &ctx->model.grid;
    int i, k, axis, active = 0, place[3];
    if (springls__to_host(ctx, SPRINGLS__GRID_BITS, 0) != SPRINGLS_OK) return false;
    for (i = 0; i < (int)springls__entry_count(g); i++) {
        if (springls__entry_of_brick(g, springls__brick_of_entry(g, i)) != i) return false;
        if (g->top[i] == SPRINGLS__OUTSIDE) continue;
        active += g->top[i] >= SPRINGLS__FIRST_SLOT;
        springls__brick_place(g, springls__brick_of_entry(g, i), place);
        for (axis = 0; axis < 3; axis++)
            for (k = springls__imax(place[axis] - 1, 0); k <= springls__imin(place[axis] + 1, g->bricks[axis] - 1); k++)
                if (!springls__keeps_place(&g->table.groups, axis, k)) return false;
    }
    for (i = 0; i < g->active_count; i++)
        if (springls__slot_of_brick(g, g->slot_brick[g->active[i]]) != g->active[i]) return false;
    return active == g->active_count;
}

/* Returns whether two models have the same springls and the same mesh, bit by bit; their domains may differ. */
static bool same_bits(springls_context *a, springls_context *b)
{
    springls_mesh one, two;
    int i, k;
    bool same = springls_count(a) == springls_count(b) && springls_count(a) > 0;
    for (i = 0; i < springls_count(a) && same; i++) {
        springls__v3 p = fixture_particle(a, i), q = fixture_particle(b, i), s = fixture_origin(a, i), t = fixture_origin(b, i);
        same = memcmp(&p, &q, sizeof p) == 0 && memcmp(&s, &t, sizeof s) == 0 && springls_ids(a)[i] == springls_ids(b)[i];
        for (k = 0; k < 3 && same; k++) {
            springls__v3 x = fixture_vertex(a, i, k), y = fixture_vertex(b, i, k);
            same = memcmp(&x, &y, sizeof x) == 0;
        }
    }
    if (springls_extract_mesh(a, &one) != SPRINGLS_OK || springls_extract_mesh(b, &two) != SPRINGLS_OK) return false;
    same = same && one.vertex_count == two.vertex_count && one.triangle_count == two.triangle_count
        && memcmp(one.positions, two.positions, (size_t)one.vertex_count * 3 * sizeof(float)) == 0
        && memcmp(one.triangles, two.triangles, (size_t)one.triangle_count * 3 * sizeof(int)) == 0;
    springls_mesh_free(a, &one);
    springls_mesh_free(b, &two);
    return same;
}

/* ---- memory ---- */

/* A ball in a huge grid, what it does and what is read of it cost what they cost in a small one. */
TEST memory_does_not_depend_on_the_domain(void)
{
    static const int size[2] = { 256, HUGE_GRID };
    springls_params params = springls_default_params();
    size_t peak[2];
    int i;
    params.components = 1;
    for (i = 0; i < 2; i++) {
        springls_desc desc = fixture_desc(size[i], &params);
        springls_sphere sphere = fixture_ball(120.0f, 120.0f, 120.0f, 12.0f);
        springls_context *ctx;
        springls_chunks *chunks;
        const springls_chunk *changed;
        const springls_component *component;
        counted_heap counted;
        int count;
        desc.allocator = counted_allocator(&counted);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_LT(counted.peak, (size_t)1 << 17);
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
        ASSERT_OK(springls_chunks_create(ctx, NULL, &chunks));
        ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 1.5f, 0.5f, 0.0f, 4));
        ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
        ASSERT_OK(springls_components(ctx, &component, &count));
        ASSERT_EQ(1, count);
        ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
        ASSERT_GT(count, 0);
        springls_chunks_destroy(ctx, chunks);
        springls_destroy(ctx);
        ASSERT_EQ(0u, counted.heap.bytes);
        peak[i] = counted.peak;
    }
    ASSERT_LT(peak[1], peak[0] + ((size_t)1 << 16));
    PASS();
}

/* A ball that goes far takes its table along. */
TEST the_table_goes_with_the_model(void)
{
    springls_context *ctx = fixture_sphere(1024, NULL, 40.0f, 40.0f, 40.0f, 6.0f);
    size_t entries = springls__entry_count(&ctx->model.grid);
    int i;
    for (i = 0; i < 40; i++) {
        ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 7.0f, 3.0f, 5.0f, 1));
        ASSERT(table_is_sound(ctx));
        ASSERT_LT(springls__entry_count(&ctx->model.grid), 8 * entries);
    }
    ASSERT_GT(ctx->model.grid.table.lower[0], 200);
    ASSERT_GT(springls_count(ctx), 0);
    springls_destroy(ctx);
    PASS();
}

typedef struct watched_ball { springls_sphere sphere; long points; } watched_ball;

static void watched(void *user, const float *points, int count, float *out)
{
    watched_ball *ball = (watched_ball *)user;
    ball->points += count;
    springls_implicit_sphere(&ball->sphere, points, count, out);
}

static void inline_task(void *user, int count, int grain, springls_task task, void *arg)
{
    (void)user;
    (void)grain;
    task(arg, 0, count);
}

/* A function is not looked at where it is far from zero: in fewer places than there are bricks. */
TEST functions_are_looked_at_near_their_zero(void)
{
    springls_desc desc = fixture_desc(HUGE_GRID, NULL);
    springls_context *ctx;
    watched_ball ball;
    desc.tasks.parallel_for = inline_task;
    ball.sphere = fixture_ball(3000.0f, 500.0f, 1111.0f, 20.0f);
    ball.points = 0;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, watched, &ball));
    ASSERT_LT(ball.points, 512L * 512L * 512L / 50L);
    springls_destroy(ctx);
    PASS();
}

/* ---- bits ---- */

/* What a ball becomes in a wind, and then in a narrower one, does not depend on the domain. */
TEST a_huge_grid_has_the_bits_of_a_small_one(springls_mode mode)
{
    springls_context *small = fixture_sphere(SMALL, NULL, 40.0f, 50.0f, 60.0f, 9.0f);
    springls_context *huge = fixture_sphere(HUGE_GRID, NULL, 40.0f, 50.0f, 60.0f, 9.0f);
    int i;
    ASSERT(same_bits(small, huge));
    for (i = 0; i < 8; i++) {
        ASSERT_OK(run(small, mode, 4.0f, 1.0f, -1.0f, 1));
        ASSERT_OK(run(huge, mode, 4.0f, 1.0f, -1.0f, 1));
        ASSERT(table_is_sound(small));
        ASSERT(table_is_sound(huge));
    }
    ASSERT(same_bits(small, huge));
    ASSERT_OK(springls_run_stage(small, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_OK(springls_run_stage(huge, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT(table_is_sound(huge));
    ASSERT(same_bits(small, huge));
    springls_destroy(small);
    springls_destroy(huge);
    PASS();
}

/* Meshes, offsets and solids with a hollow are the same in both. */
TEST tools_do_not_depend_on_the_domain(void)
{
    springls_context *ctx[2];
    springls_sphere hollow = fixture_ball(60.0f, 60.0f, 60.0f, 16.0f);
    springls_mesh mesh;
    int i;
    for (i = 0; i < 2; i++) {
        ctx[i] = fixture_sphere(i ? HUGE_GRID : SMALL, NULL, 60.0f, 60.0f, 60.0f, 30.0f);
        ASSERT_OK(springls_combine_implicit(ctx[i], SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &hollow));
        ASSERT(table_is_sound(ctx[i]));
        ASSERT_OK(springls_offset(ctx[i], -2.0f));
        ASSERT(table_is_sound(ctx[i]));
    }
    ASSERT(same_bits(ctx[0], ctx[1]));
    ASSERT_OK(springls_extract_mesh(ctx[0], &mesh));
    for (i = 0; i < 2; i++)
        ASSERT_OK(springls_set_mesh(ctx[i], mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT(same_bits(ctx[0], ctx[1]));
    ASSERT(table_is_sound(ctx[1]));
    springls_mesh_free(ctx[0], &mesh);
    springls_destroy(ctx[0]);
    springls_destroy(ctx[1]);
    PASS();
}

/* Chunks have the same names and the same triangles in both, while the model and its table move. */
TEST chunks_do_not_depend_on_the_domain(void)
{
    springls_context *ctx[2];
    springls_chunks *chunks[2];
    const springls_chunk *changed[2];
    int i, k, step, count[2];
    for (i = 0; i < 2; i++) {
        ctx[i] = fixture_sphere(i ? HUGE_GRID : SMALL, NULL, 30.0f, 40.0f, 50.0f, 9.0f);
        ASSERT_OK(springls_chunks_create(ctx[i], NULL, &chunks[i]));
    }
    for (step = 0; step < 10; step++) {
        for (i = 0; i < 2; i++) {
            ASSERT_OK(run(ctx[i], SPRINGLS_MODE_FLUID, 5.0f, 2.0f, 0.0f, 1));
            ASSERT_OK(springls_chunks_update(ctx[i], chunks[i], &changed[i], &count[i]));
        }
        ASSERT_EQ(count[0], count[1]);
        for (k = 0; k < count[0]; k++) {
            const springls_chunk *a = &changed[0][k], *b = &changed[1][k];
            ASSERT_MEM_EQ(a->brick, b->brick, sizeof a->brick);
            ASSERT_EQ(a->vertex_count, b->vertex_count);
            ASSERT_EQ(a->triangle_count, b->triangle_count);
            if (!a->vertex_count) continue;
            ASSERT_MEM_EQ(a->positions, b->positions, (size_t)a->vertex_count * 3 * sizeof(float));
            ASSERT_MEM_EQ(a->triangles, b->triangles, (size_t)a->triangle_count * 3 * sizeof(uint16_t));
        }
    }
    for (i = 0; i < 2; i++) {
        springls_chunks_destroy(ctx[i], chunks[i]);
        springls_destroy(ctx[i]);
    }
    PASS();
}

/* Rays and closest points find the ball from far away, and beyond the table there is nothing. */
TEST queries_reach_beyond_the_table(void)
{
    springls_context *ctx = fixture_sphere(HUGE_GRID, NULL, 3000.0f, 100.0f, 2000.0f, 10.0f);
    float from[3] = { 5.0f, 100.0f, 2000.0f }, along[3] = { 1.0f, 0.0f, 0.0f }, distance;
    springls_hit hit;
    uint8_t inside;
    ASSERT_OK(springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, from, along, 1, 0.0f, &hit));
    ASSERT_LT(fabs((double)hit.distance - 2985.0), 0.05);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, from, 1, &hit));
    ASSERT_LT(fabs((double)hit.distance - 2985.0), 0.05);
    ASSERT_OK(springls_sample_distance(ctx, from, 1, &distance));
    ASSERT_EQ(4.0f, distance);
    ASSERT_OK(springls_sample_inside(ctx, from, 1, &inside));
    ASSERT_EQ(0, inside);
    springls_destroy(ctx);
    PASS();
}

/* At the ends of the domain the table ends with it. */
TEST the_ends_of_the_domain_are_closed(void)
{
    springls_context *ctx = fixture_sphere(HUGE_GRID, NULL, 4093.0f, 2.0f, 4080.0f, 9.0f);
    springls_measures measures;
    ASSERT(table_is_sound(ctx));
    ASSERT_EQ(HUGE_GRID, ctx->model.grid.table.upper[0]);
    ASSERT_EQ(0, ctx->model.grid.table.lower[1]);
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(1, measures.components);
    ASSERT_EQ(2, measures.euler);
    ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 0.5f, -0.5f, 0.5f, 3));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT(table_is_sound(ctx));
    springls_destroy(ctx);
    PASS();
}

/* ---- bodies far apart ---- */

/* A wind that parts two balls along z, by eight voxels a step, or brings them together. */
static void part_or_meet(void *user, const float *points, int count, float time, float *out)
{
    const float speed = 8.0f * (float)*(const int *)user;
    int i;
    (void)time;
    for (i = 0; i < count; i++) {
        out[3 * i] = out[3 * i + 1] = 0.0f;
        out[3 * i + 2] = points[3 * i + 2] > 85.0f ? speed : 0.0f;
    }
}

typedef struct two_balls { springls_sphere ball[2]; } two_balls;

static void either_ball(void *user, const float *points, int count, float *out)
{
    two_balls *balls = (two_balls *)user;
    float other;
    int i;
    springls_implicit_sphere(&balls->ball[0], points, count, out);
    for (i = 0; i < count; i++) {
        springls_implicit_sphere(&balls->ball[1], points + 3 * i, 1, &other);
        if (other < out[i]) out[i] = other;
    }
}

/* Two balls at opposite corners of a huge grid take the memory of two balls, also while they move, are meshed, combined, remembered
   and made again from springls alone. */
TEST far_bodies_cost_no_more_than_near_ones(void)
{
    const size_t limit = (size_t)24 << 20; /* bytes: a table of the whole box would have a GiB */
    counted_heap counted;
    springls_desc desc = fixture_desc(HUGE_GRID, NULL);
    springls_context *ctx, *restored;
    springls_chunks *chunks;
    const springls_chunk *changed;
    springls_measures measures;
    springls_sphere third = fixture_ball(2000.0f, 60.0f, 4000.0f, 9.0f);
    two_balls balls;
    size_t size;
    char *block;
    int i, count;
    balls.ball[0] = fixture_ball(60.0f, 50.0f, 70.0f, 11.0f);
    balls.ball[1] = fixture_ball(4030.0f, 4020.0f, 4050.0f, 13.0f);
    desc.allocator = counted_allocator(&counted);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, either_ball, &balls));
    ASSERT(table_is_sound(ctx));
    ASSERT_OK(springls_chunks_create(ctx, NULL, &chunks));
    for (i = 0; i < 3; i++) {
        ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, -0.75f, 1.5f, 0.5f, 1));
        ASSERT(table_is_sound(ctx));
        ASSERT_OK(springls_chunks_update(ctx, chunks, &changed, &count));
        ASSERT_GT(count, 0);
    }
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(2, measures.components);
    ASSERT_EQ(4, measures.euler);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    ASSERT_LT(size, limit / 2);
    block = (char *)malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    restored = fixture_sphere(HUGE_GRID, NULL, 3000.0f, 3000.0f, 3000.0f, 5.0f);
    ASSERT_OK(springls_restore(restored, block, size));
    free(block);
    ASSERT(table_is_sound(restored));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(restored));
    ASSERT_OK(springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &third));
    ASSERT(table_is_sound(ctx));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT(table_is_sound(ctx));
    ASSERT_OK(springls_measure(ctx, &measures));
    ASSERT_EQ(3, measures.components);
    ASSERT_EQ(6, measures.euler);
    ASSERT_LT(counted.peak, 2 * limit);
    ASSERT_LT(springls_memory_used(ctx), limit);
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    springls_destroy(restored);
    PASS();
}

/* Makes the top table of a model that of the whole domain: nothing is left out from now on. */
static springls_status keep_everything(springls_context *ctx)
{
    const int first[3] = { 0, 0, 0 };
    springls__brick_groups all = springls__no_groups();
    springls__keep_box(&ctx->model.grid, &all, first, ctx->model.grid.bricks, 0);
    return springls__table_cover(ctx, all);
}

/* Two balls part and meet again: what is between them is left out of one table and not of the other, and the bits are the same. */
TEST what_is_left_out_changes_no_bit(springls_mode mode)
{
    springls_context *ctx[2];
    springls_desc desc = fixture_desc(256, NULL);
    two_balls balls;
    int i, k, way;
    balls.ball[0] = fixture_ball(60.0f, 50.0f, 70.0f, 8.0f);
    balls.ball[1] = fixture_ball(50.0f, 60.0f, 95.0f, 8.0f);
    for (i = 0; i < 2; i++) {
        ASSERT_OK(springls_create(&desc, &ctx[i]));
        ASSERT_OK(springls_set_implicit(ctx[i], either_ball, &balls));
    }
    for (way = 1; way >= -1; way -= 2) {
        for (k = 0; k < 14; k++) {
            ASSERT_OK(keep_everything(ctx[1])); /* again: some steps begin with an empty table */
            ASSERT_EQ(32 * 32 * 32, (int)springls__entry_count(&ctx[1]->model.grid));
            for (i = 0; i < 2; i++) {
                springls_forces forces = fixture_forces(part_or_meet, &way);
                springls_step_desc step = fixture_step(&forces, mode, 1.0f);
                ASSERT_OK(springls_step(ctx[i], &step));
                ASSERT(table_is_sound(ctx[i]));
            }
            ASSERT_EQ(springls_state_hash(ctx[0]), springls_state_hash(ctx[1]));
        }
        ASSERT(same_bits(ctx[0], ctx[1]));
        if (way < 0) continue; /* where they are far apart something is left out */
        ASSERT_LT(SPRINGLS__BRICK * ctx[0]->model.grid.table.bricks[2],
                  ctx[0]->model.grid.table.upper[2] - ctx[0]->model.grid.table.lower[2]);
    }
    springls_destroy(ctx[0]);
    springls_destroy(ctx[1]);
    PASS();
}

/* ---- what is kept, and windows ---- */

TEST snapshots_restore_the_table(void)
{
    springls_context *ctx = fixture_sphere(1024, NULL, 700.0f, 300.0f, 500.0f, 20.0f);
    springls_context *other = fixture_sphere(1024, NULL, 20.0f, 20.0f, 20.0f, 5.0f);
    size_t size;
    char *block;
    ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 2.0f, 0.0f, 0.0f, 3));
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    block = (char *)malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    ASSERT_OK(springls_restore(other, block, size));
    free(block);
    ASSERT(table_is_sound(other));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 5.0f, 0.0f, 0.0f, 6));
    ASSERT_OK(run(other, SPRINGLS_MODE_FLUID, 5.0f, 0.0f, 0.0f, 6));
    ASSERT_EQ(springls_state_hash(ctx), springls_state_hash(other));
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

/* A block has no byte more for a larger domain. */
TEST snapshots_do_not_grow_with_the_domain(void)
{
    static const int sizes[2] = { SMALL, HUGE_GRID };
    size_t bytes[2];
    int i;
    for (i = 0; i < 2; i++) {
        springls_context *ctx = fixture_sphere(sizes[i], NULL, 60.0f, 50.0f, 70.0f, 30.0f);
        ASSERT(ctx != NULL);
        ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &bytes[i]));
        springls_destroy(ctx);
    }
    ASSERT_EQ(bytes[0], bytes[1]);
    PASS();
}

/* A huge window moves with a model that comes from its border, and forward and back again. */
TEST huge_windows_follow(void)
{
    static const float way[3][3] = { { -6.0f, 0.0f, 0.0f }, { 0.0f, 6.0f, -6.0f }, { 6.0f, -6.0f, 6.0f } };
    springls_desc desc = fixture_desc(HUGE_GRID, NULL);
    springls_sphere sphere = fixture_ball(24.0f, 4070.0f, 24.0f, 7.0f);
    springls_context *ctx;
    springls_measures before, after;
    int i, k, offset[3];
    desc.follow = true;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    ASSERT_OK(springls_measure(ctx, &before));
    for (i = 0; i < 3; i++)
        for (k = 0; k < 5; k++) {
            ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, way[i][0], way[i][1], way[i][2], 1));
            ASSERT(table_is_sound(ctx));
        }
    springls_window_offset(ctx, offset);
    ASSERT(offset[0] != 0 && offset[1] != 0 && offset[2] != 0);
    ASSERT_OK(springls_measure(ctx, &after));
    ASSERT_LT(fabs(after.volume / before.volume - 1.0), 0.01);
    ASSERT_LT(springls_memory_used(ctx), (size_t)16 << 20);
    springls_destroy(ctx);
    PASS();
}

/* ---- memory that runs out ---- */

/* A ball that leaves its table, with chunks of it, and another one. Returns how many calls were not as they should be. */
static int go_through(springls_context *ctx)
{
    springls_sphere sphere = fixture_ball(40.0f, 40.0f, 40.0f, 2.0f), other = fixture_ball(66.0f, 70.0f, 64.0f, 2.0f);
    springls_chunks *chunks = NULL;
    const springls_chunk *changed;
    springls_status status[16];
    int i, n = 0, count, wrong = 0;
    status[n++] = springls_set_implicit(ctx, springls_implicit_sphere, &sphere);
    status[n++] = springls_chunks_create(ctx, NULL, &chunks);
    for (i = 0; i < 2; i++) {
        status[n++] = run(ctx, SPRINGLS_MODE_ADVECT_ONLY, 12.0f, 15.0f, 12.0f, 1);
        status[n++] = springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED);
        if (chunks) status[n++] = springls_chunks_update(ctx, chunks, &changed, &count);
    }
    status[n++] = springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &other);
    for (i = 0; i < n; i++)
        wrong += status[i] != SPRINGLS_OK && status[i] != SPRINGLS_OUT_OF_MEMORY && status[i] != SPRINGLS_EMPTY_MODEL;
    springls_chunks_destroy(ctx, chunks);
    return wrong;
}

TEST every_allocation_may_fail(bool follow)
{
    springls_desc desc = fixture_desc(256, NULL);
    springls_context *ctx;
    springls_sphere sphere = fixture_ball(40.0f, 40.0f, 40.0f, 2.0f);
    fixture_heap heap;
    int allocations, k;
    desc.follow = follow;
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_EQ(0, go_through(ctx));
    ASSERT_GT(springls_count(ctx), 0);
    allocations = heap.calls;
    springls_destroy(ctx);
    for (k = 0; k < allocations; k++) {
        desc.allocator = fixture_allocator(&heap);
        heap.fail_at = k;
        if (springls_create(&desc, &ctx) == SPRINGLS_OK) {
            ASSERT_EQ(0, go_through(ctx));
            ASSERT(table_is_sound(ctx));
            heap.fail_at = -1;
            ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
            ASSERT_OK(run(ctx, SPRINGLS_MODE_FLUID, 9.0f, 0.0f, 0.0f, 1));
            ASSERT(table_is_sound(ctx));
            springls_destroy(ctx);
        }
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    PASS();
}

SUITE(top_table)
{
    RUN_TEST(memory_does_not_depend_on_the_domain);
    RUN_TEST(the_table_goes_with_the_model);
    RUN_TEST(functions_are_looked_at_near_their_zero);
    RUN_TESTp(a_huge_grid_has_the_bits_of_a_small_one, SPRINGLS_MODE_FLUID);
    RUN_TESTp(a_huge_grid_has_the_bits_of_a_small_one, SPRINGLS_MODE_ELASTIC);
    RUN_TEST(tools_do_not_depend_on_the_domain);
    RUN_TEST(chunks_do_not_depend_on_the_domain);
    RUN_TEST(queries_reach_beyond_the_table);
    RUN_TEST(the_ends_of_the_domain_are_closed);
    RUN_TEST(far_bodies_cost_no_more_than_near_ones);
    RUN_TESTp(what_is_left_out_changes_no_bit, SPRINGLS_MODE_FLUID);
    RUN_TESTp(what_is_left_out_changes_no_bit, SPRINGLS_MODE_ELASTIC);
    RUN_TEST(snapshots_restore_the_table);
    RUN_TEST(snapshots_do_not_grow_with_the_domain);
    RUN_TEST(huge_windows_follow);
    if (!WITHOUT_SIMD) { /* that build allocates what the other does */
        RUN_TESTp(every_allocation_may_fail, false);
        RUN_TESTp(every_allocation_may_fail, true);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(top_table);
    GREATEST_MAIN_END();
}
