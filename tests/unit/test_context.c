/* test_context.c - the life of a context: what springls_create accepts, what belongs to whom, what fails for what reason, and
   that every function can be called without a context. */
#include "fixtures.h"

/* ---- logs ---- */

typedef struct log_book { int count[4]; char last[256]; } log_book;

static void keep_log(void *user, int level, const char *message)
{
    log_book *book = (log_book *)user;
    if (level >= 1 && level <= 3) book->count[level]++;
    else book->count[0]++;
    snprintf(book->last, sizeof book->last, "%s", message);
}

/* ---- creating ---- */

/* A description is refused: with a message, without a context and without a byte left. */
static greatest_test_res refused(springls_desc desc, const char *word)
{
    springls_context *ctx = (springls_context *)&desc; /* any value that is not NULL */
    fixture_heap heap;
    log_book book;
    memset(&book, 0, sizeof book);
    desc.allocator = fixture_allocator(&heap);
    desc.logger.log = keep_log;
    desc.logger.user = &book;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, &ctx));
    ASSERT_EQ(NULL, ctx);
    ASSERT_EQ(0, heap.blocks);
    ASSERT_EQ(1, book.count[1]);
    ASSERT(strstr(book.last, word) != NULL);
    PASS();
}

TEST descriptions_are_checked(void)
{
    static const double bad[4] = { 0.0, -1.0, NAN, INFINITY };
    springls_desc desc = fixture_desc(16, NULL);
    springls_context *ctx = NULL;
    int axis, k;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(NULL, &ctx));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, NULL));
    for (axis = 0; axis < 3; axis++) {
        static const int sizes[5] = { 3, 0, -16, 4097, INT32_MAX };
        for (k = 0; k < 5; k++) {
            desc = fixture_desc(16, NULL);
            desc.grid.size[axis] = sizes[k];
            CHECK_CALL(refused(desc, "grid"));
        }
        for (k = 0; k < 4; k++) {
            desc = fixture_desc(16, NULL);
            desc.grid.spacing[0] = desc.grid.spacing[1] = desc.grid.spacing[2] = 1.0;
            desc.grid.spacing[axis] = bad[k];
            CHECK_CALL(refused(desc, "spacing"));
            desc = fixture_desc(16, NULL);
            desc.grid.direction[0] = desc.grid.direction[4] = desc.grid.direction[8] = 1.0;
            desc.grid.direction[4 * axis] = k == 1 ? 0.0 : bad[k];
            CHECK_CALL(refused(desc, "direction"));
            if (k < 2) continue;
            desc = fixture_desc(16, NULL);
            desc.grid.origin[axis] = bad[k];
            CHECK_CALL(refused(desc, "grid"));
        }
    }
    desc = fixture_desc(16, NULL);
    desc.max_springls = -1;
    CHECK_CALL(refused(desc, "max_springls"));
    desc = fixture_desc(16, NULL);
    desc.allocator.alloc = fixture_alloc;
    desc.allocator.free = NULL;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, &ctx));
    PASS();
}

/* The smallest and the longest grid; spacing and direction zero mean one and the identity. */
TEST sizes_at_the_limit(void)
{
    static const int sizes[4][3] = { { 4, 4, 4 }, { 4096, 4, 5 }, { 4, 4096, 4 }, { 7, 4, 4096 } };
    springls_sphere ball = fixture_ball(1.5f, 1.5f, 1.5f, 1.2f);
    int k;
    for (k = 0; k < 4; k++) {
        springls_desc desc = fixture_desc(0, NULL);
        springls_context *ctx;
        springls_measures measures;
        const float x[3] = { 3.0f, 2.0f, 1.0f };
        float y[3];
        memcpy(desc.grid.size, sizes[k], sizeof desc.grid.size);
        ASSERT_OK(springls_create(&desc, &ctx));
        springls_to_world(ctx, x, 1, y);
        ASSERT_MEM_EQ(x, y, sizeof x);
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT_EQ(2, measures.euler);
        ASSERT_EQ(1, measures.components);
        springls_destroy(ctx);
    }
    PASS();
}

/* ---- parameters ---- */

/* Messages give the value and the range that is allowed. */
TEST messages_give_ranges(void)
{
    springls_context *ctx = fixture_context(16, NULL);
    springls_params p = springls_default_params();
    p.min_component = 17.5f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
    ASSERT_STR_EQ("set_params: params.min_component is not in 0 to 16: 17.5", springls_last_error(ctx));
    p = springls_default_params();
    p.relax_iterations = -3;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
    ASSERT_STR_EQ("set_params: params.relax_iterations is not in 0 to 1000: -3", springls_last_error(ctx));
    p = springls_default_params();
    p.initial_stride = 3;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
    ASSERT_STR_EQ("set_params: params.initial_stride is not 1, 2 or 4", springls_last_error(ctx));
    springls_destroy(ctx);
    PASS();
}

/* Every member out of range is refused by name, in create and in set_params, which keeps what it had. */
TEST parameters_are_checked(void)
{
#define FLOAT(member) { #member, offsetof(springls_params, member), 0 }
#define INT(member) { #member, offsetof(springls_params, member), 1 }
    static const struct { const char *name; size_t offset; int whole; } members[] = {
        FLOAT(d_max), FLOAT(particle_radius), FLOAT(neighbor_radius), INT(max_neighbors), INT(relax_iterations), INT(threshold),
        INT(weight), INT(torque), FLOAT(sharpness), FLOAT(kappa_int), FLOAT(kappa_ext), FLOAT(relax_step_length),
        FLOAT(relax_step_rotation), FLOAT(contract_distance), FLOAT(min_angle), FLOAT(max_angle), FLOAT(min_area),
        FLOAT(merge_distance), INT(resample_period), FLOAT(split_edge), FLOAT(split_area), INT(placement),
        FLOAT(band_half_width), FLOAT(capture_range), INT(evolve_iterations), FLOAT(evolve_step), FLOAT(evolve_width),
        FLOAT(curvature), INT(topology), FLOAT(nearest_rule), INT(track_iterations), FLOAT(track_step), INT(initial_stride)
    };
#undef FLOAT
#undef INT
    static const float bad_float[4] = { NAN, INFINITY, -INFINITY, -1.0f };
    static const int bad_int[3] = { -1, INT32_MAX, INT32_MIN };
    springls_context *ctx = fixture_context(16, NULL);
    springls_params before = springls_get_params(ctx), p, now;
    size_t i;
    int k;
    for (i = 0; i < sizeof members / sizeof *members; i++)
        for (k = 0; k < (members[i].whole ? 3 : 4); k++) {
            springls_desc desc = fixture_desc(16, &p);
            p = springls_default_params();
            if (members[i].whole) memcpy((char *)&p + members[i].offset, &bad_int[k], sizeof bad_int[k]);
            else memcpy((char *)&p + members[i].offset, &bad_float[k], sizeof bad_float[k]);
            ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
            ASSERT(strstr(springls_last_error(ctx), members[i].name) != NULL);
            now = springls_get_params(ctx);
            ASSERT_MEM_EQ(&before, &now, sizeof now);
            CHECK_CALL(refused(desc, members[i].name));
        }
    memset(&p, 0, sizeof p); /* zero is a value of many members, so zeros are no parameters */
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, NULL));
    springls_destroy(ctx);
    PASS();
}

/* Both sets are accepted and come back as they were; the band's width is fixed while there is a model. */
TEST parameters_can_be_replaced(void)
{
    springls_params p = springls_paper_params(), q;
    springls_context *ctx = fixture_context(24, NULL);
    springls_sphere ball = fixture_ball(11.5f, 11.5f, 11.5f, 6.0f);
    ASSERT_OK(springls_set_params(ctx, &p));
    q = springls_get_params(ctx);
    ASSERT_MEM_EQ(&p, &q, sizeof p);
    p.band_half_width = 4.0f;
    ASSERT_OK(springls_set_params(ctx, &p));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    p.curvature = 0.1f;
    ASSERT_OK(springls_set_params(ctx, &p));
    p.band_half_width = 3.0f;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_params(ctx, &p));
    ASSERT_OK(springls_reset(ctx));
    ASSERT_OK(springls_set_params(ctx, &p));
    springls_destroy(ctx);
    PASS();
}

/* ---- memory ---- */

typedef struct guarded_heap {
    fixture_heap heap;
    int strangers; /* calls from other threads than the caller's */
#if FIXTURE_THREADS
    pthread_t owner;
#endif
} guarded_heap;

static void check_thread(guarded_heap *g)
{
#if FIXTURE_THREADS
    if (!pthread_equal(g->owner, pthread_self())) g->strangers++;
#else
    (void)g;
#endif
}

static void *guarded_alloc(size_t bytes, void *user)
{
    check_thread((guarded_heap *)user);
    return fixture_alloc(bytes, &((guarded_heap *)user)->heap);
}

static void guarded_free(void *memory, size_t bytes, void *user)
{
    check_thread((guarded_heap *)user);
    fixture_free(memory, bytes, &((guarded_heap *)user)->heap);
}

/* What grows holds little more than is used, and advect leaves springls no memory that was sized for something else. */
TEST memory_grows_by_little(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 9.0f);
    size_t one = sizeof *ctx->model.set.error;
    int i;
    for (i = 0; i < 12; i++) ASSERT_OK(fixture_translate(ctx, 0.1f, 0.0f, 0.0f));
    ASSERT_LT(ctx->memory[SPRINGLS__ARRAY_ERROR].bytes, 4 * one * (size_t)springls_count(ctx));
    ASSERT_OK(springls__grow(ctx, SPRINGLS__ARRAY_ERROR, 100000, 0));
    ASSERT_OK(springls__grow(ctx, SPRINGLS__ARRAY_ERROR, 120000, 0));
    ASSERT(ctx->memory[SPRINGLS__ARRAY_ERROR].bytes >= 120000 * one);
    ASSERT(ctx->memory[SPRINGLS__ARRAY_ERROR].bytes <= 140000 * one);
    springls_destroy(ctx);
    PASS();
}

/* All memory comes from the allocator, called from the caller's thread only; memory_used counts every byte; frees get back
   the sizes that were allocated; a mesh lives until it is freed; reset keeps memory, destroy returns all. */
TEST memory_is_accounted_for(void)
{
    guarded_heap g;
    fixture_workers workers;
    springls_desc desc = fixture_desc(32, NULL);
    springls_sphere ball = fixture_ball(15.5f, 15.5f, 15.5f, 8.0f);
    float wind[3] = { 0.4f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_context *ctx;
    springls_mesh mesh;
    size_t held;
    int i;
    memset(&g, 0, sizeof g);
    fixture_allocator(&g.heap);
#if FIXTURE_THREADS
    g.owner = pthread_self();
#endif
    desc.allocator.alloc = guarded_alloc;
    desc.allocator.free = guarded_free;
    desc.allocator.user = &g;
    desc.tasks = fixture_tasks(&workers, 3, 1);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_EQ(g.heap.bytes, springls_memory_used(ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    ASSERT_EQ(g.heap.bytes, springls_memory_used(ctx));
    for (i = 0; i < 6; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(g.heap.bytes, springls_memory_used(ctx));
    held = springls_memory_used(ctx);
    ASSERT_OK(springls_reset(ctx));
    ASSERT_EQ(held, springls_memory_used(ctx));
    ASSERT_EQ(0, springls_count(ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    ASSERT_EQ(held, springls_memory_used(ctx)); /* what was there serves again */
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    held = springls_memory_used(ctx);
    ASSERT_GT(mesh.bytes, 0u);
    springls_mesh_free(ctx, &mesh);
    ASSERT_EQ(g.heap.bytes, springls_memory_used(ctx));
    ASSERT_LT(springls_memory_used(ctx), held);
    springls_destroy(ctx);
    ASSERT_EQ(0, g.heap.blocks);
    ASSERT_EQ(0u, g.heap.bytes);
    ASSERT_EQ(0, g.heap.wrong_sizes);
    ASSERT_EQ(0, g.strangers);
    ASSERT_GT(workers.calls, 0);
    PASS();
}

/* Memory grows with the surface, not with the volume: the same sphere in a grid of eight times the voxels takes only the
   top tables more, an int a brick of 512 voxels for the model and one for the original. */
TEST memory_follows_the_surface(void)
{
    size_t used[2];
    int k;
    for (k = 0; k < 2; k++) {
        springls_context *ctx = fixture_sphere(64 << k, NULL, 31.5f, 31.5f, 31.5f, 12.0f);
        used[k] = springls_memory_used(ctx);
        springls_destroy(ctx);
    }
    ASSERT_LT(used[1] - used[0], 16u * (16 * 16 * 16 - 8 * 8 * 8)); /* two ints, two work arrays */
    PASS();
}

/* ---- errors and messages ---- */

TEST errors_belong_to_a_context(void)
{
    springls_desc desc = fixture_desc(16, NULL);
    springls_context *one, *two;
    log_book book;
    memset(&book, 0, sizeof book);
    desc.logger.log = keep_log;
    desc.logger.user = &book;
    ASSERT_OK(springls_create(&desc, &one));
    ASSERT_OK(springls_create(&desc, &two));
    ASSERT_STR_EQ("", springls_last_error(one));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_level_set(one, NULL));
    ASSERT(strlen(springls_last_error(one)) > 0);
    ASSERT_STR_EQ("", springls_last_error(two));
    ASSERT_EQ(1, book.count[1]);
    ASSERT_STR_EQ(springls_last_error(one), book.last);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_run_stage(two, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_STR_EQ(springls_last_error(two), book.last);
    ASSERT(strcmp(springls_last_error(one), springls_last_error(two)) != 0);
    ASSERT_EQ(0, book.count[0]);
    springls_destroy(one);
    springls_destroy(two);
    PASS();
}

TEST status_and_version_have_words(void)
{
    char version[32];
    int i, j;
    for (i = 0; i >= SPRINGLS_BAD_SNAPSHOT; i--)
        for (j = 0; j > i; j--)
            ASSERT(strcmp(springls_status_string((springls_status)i), springls_status_string((springls_status)j)) != 0);
    ASSERT_STR_EQ("ok", springls_status_string(SPRINGLS_OK));
    ASSERT(springls_status_string((springls_status)1) != NULL);
    ASSERT(springls_status_string((springls_status)-1000) != NULL);
    ASSERT_EQ(SPRINGLS_VERSION, springls_version());
    snprintf(version, sizeof version, "%d.%d.%d", SPRINGLS_VERSION_MAJOR, SPRINGLS_VERSION_MINOR, SPRINGLS_VERSION_PATCH);
    ASSERT_STR_EQ(version, springls_version_string());
    PASS();
}

/* ---- progress of inputs ---- */

typedef struct reports { int count, stop_at, rising; float last; } reports;

static int report(void *user, float fraction)
{
    reports *r = (reports *)user;
    r->rising = r->rising && fraction > r->last && fraction <= 1.0f;
    r->last = fraction;
    return ++r->count == r->stop_at;
}

/* Long inputs report; one that is cancelled leaves an empty model that can be set again. */
TEST inputs_report_and_can_be_cancelled(void)
{
    springls_desc desc = fixture_desc(48, NULL);
    springls_sphere ball = fixture_ball(23.5f, 23.5f, 23.5f, 12.0f);
    springls_context *ctx;
    springls_mesh mesh;
    reports r;
    memset(&r, 0, sizeof r);
    r.rising = 1;
    desc.progress.report = report;
    desc.progress.user = &r;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    ASSERT_GT(r.count, 5);
    ASSERT(r.rising);
    ASSERT_EQ(1.0f, r.last);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    memset(&r, 0, sizeof r);
    r.stop_at = 3;
    ASSERT_STATUS(SPRINGLS_CANCELLED,
                  springls_set_mesh(ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_EQ(3, r.count);
    ASSERT_EQ(0, springls_count(ctx));
    r.stop_at = 0;
    ASSERT_OK(springls_set_mesh(ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL));
    ASSERT_EQ(mesh.triangle_count, springls_count(ctx));
    springls_mesh_free(ctx, &mesh);
    springls_destroy(ctx);
    PASS();
}

/* ---- models ---- */

/* After a reset everything is as after create; the same input and steps then give the same bits. */
TEST reset_forgets(void)
{
    springls_context *ctx = fixture_sphere(32, NULL, 15.5f, 15.5f, 15.5f, 8.0f);
    springls_sphere ball = fixture_ball(15.5f, 15.5f, 15.5f, 8.0f);
    float wind[3] = { 0.4f, 0.1f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_stats stats, zero;
    uint64_t hash = 0;
    int i, round;
    memset(&zero, 0, sizeof zero);
    for (round = 0; round < 2; round++) {
        for (i = 0; i < 6; i++) ASSERT_OK(springls_step(ctx, &step));
        if (round) ASSERT(hash == springls_state_hash(ctx));
        hash = springls_state_hash(ctx);
        ASSERT_OK(springls_reset(ctx));
        stats = springls_get_stats(ctx);
        ASSERT_MEM_EQ(&zero, &stats, sizeof stats);
        ASSERT_EQ(0.0, springls_time(ctx));
        ASSERT_EQ(0, springls_view_particles(ctx).count);
        ASSERT_EQ(NULL, springls_view_particles(ctx).data);
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        ASSERT_EQ(0u, springls_ids(ctx)[0]);
    }
    springls_destroy(ctx);
    PASS();
}

/* Two contexts that take turns do what each does alone. */
TEST contexts_are_independent(void)
{
    float wind[2][3] = { { 0.4f, 0.1f, 0.0f }, { -0.2f, 0.3f, 0.1f } };
    springls_context *alone, *ctx[2];
    springls_forces forces[2];
    springls_step_desc step[2];
    springls_params p[2];
    uint64_t expected[2];
    int i, k;
    p[0] = springls_default_params();
    p[1] = springls_paper_params();
    for (k = 0; k < 2; k++) {
        forces[k] = fixture_forces(fixture_wind, wind[k]);
        step[k] = fixture_step(&forces[k], SPRINGLS_MODE_FLUID, 1.0f);
        alone = fixture_sphere(32, &p[k], 15.5f, 15.5f, 15.5f, 7.0f);
        for (i = 0; i < 6; i++) ASSERT_OK(springls_step(alone, &step[k]));
        expected[k] = springls_state_hash(alone);
        springls_destroy(alone);
        ctx[k] = fixture_sphere(32, &p[k], 15.5f, 15.5f, 15.5f, 7.0f);
    }
    for (i = 0; i < 12; i++) ASSERT_OK(springls_step(ctx[i % 2], &step[i % 2]));
    for (k = 0; k < 2; k++) {
        ASSERT(expected[k] == springls_state_hash(ctx[k]));
        springls_destroy(ctx[k]);
    }
    PASS();
}

/* What does not fit into max_springls is refused and counted, not failed. */
TEST room_is_limited(void)
{
    springls_desc desc = fixture_desc(32, NULL);
    springls_sphere ball = fixture_ball(15.5f, 15.5f, 15.5f, 8.0f);
    float triangle[9] = { 1.0f, 1.0f, 1.0f, 2.0f, 1.0f, 1.0f, 1.0f, 2.0f, 1.0f };
    springls_context *ctx;
    int all;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    all = springls_count(ctx);
    ASSERT_EQ(0, springls_get_stats(ctx).refused);
    springls_destroy(ctx);
    desc.max_springls = 100;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    ASSERT_IN_RANGE(97.0, springls_count(ctx), 3.0); /* a cube has up to five triangles */
    ASSERT_EQ(all - springls_count(ctx), springls_get_stats(ctx).refused);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_set_springls(ctx, triangle, NULL, NULL, 101));
    springls_destroy(ctx);
    PASS();
}

/* World and voxel coordinates are inverse to each other, in place too. */
TEST coordinates_go_both_ways(void)
{
    springls_desc desc = fixture_desc(16, NULL);
    const double direction[9] = { 0.0, -1.0, 0.0, 0.6, 0.0, -0.8, 0.8, 0.0, 0.6 };
    springls_context *ctx;
    int i, k;
    desc.grid.spacing[0] = 0.5;
    desc.grid.spacing[1] = 2.0;
    desc.grid.spacing[2] = 0.8;
    desc.grid.origin[0] = 100.0;
    desc.grid.origin[1] = -40.0;
    desc.grid.origin[2] = 7.0;
    memcpy(desc.grid.direction, direction, sizeof direction);
    ASSERT_OK(springls_create(&desc, &ctx));
    fixture_seed(61);
    for (i = 0; i < 100; i++) {
        springls__v3 x = fixture_point(-5.0f, 20.0f), y;
        float world[6];
        springls_to_world(ctx, &x.x, 1, world);
        for (k = 0; k < 3; k++) {
            double expected = desc.grid.origin[k] + direction[3 * k] * 0.5 * (double)x.x + direction[3 * k + 1] * 2.0 * (double)x.y
                            + direction[3 * k + 2] * 0.8 * (double)x.z;
            ASSERT_IN_RANGE(expected, world[k], 1e-5);
        }
        memcpy(world + 3, world, 3 * sizeof *world);
        springls_to_voxel(ctx, world, 2, world);
        y = springls__v3_make(world[3], world[4], world[5]);
        ASSERT_LT(d3_distance(d3_of(x), d3_of(y)), 1e-4);
        ASSERT_MEM_EQ(world, (world + 3), 3 * sizeof *world);
    }
    springls_destroy(ctx);
    PASS();
}

/* ---- without a context, without arrays ---- */

TEST every_call_survives_null(void)
{
    springls_context *ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 4.0f);
    float x[16] = { 1.0f };
    int32_t labels[1] = { 0 };
    uint8_t inside[1];
    int triangle[3] = { 0, 1, 2 };
    springls_forces forces = fixture_forces(fixture_wind, x);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_params p = springls_default_params(), q;
    springls_mesh mesh;
    springls_hit hit;
    springls_measures measures;
    uint64_t before = springls_state_hash(ctx);
    const springls_status invalid = SPRINGLS_INVALID_ARGUMENT;
    memset(&mesh, 0, sizeof mesh);
    springls_destroy(NULL);
    ASSERT_EQ(invalid, springls_reset(NULL));
    ASSERT_STR_EQ("no context", springls_last_error(NULL));
    q = springls_get_params(NULL);
    ASSERT_MEM_EQ(&p, &q, sizeof p);
    ASSERT_EQ(invalid, springls_set_params(NULL, &p));
    springls_to_voxel(NULL, x, 1, x);
    springls_to_world(NULL, x, 1, x);
    springls_to_voxel(ctx, NULL, 1, x);
    springls_to_world(ctx, x, 1, NULL);
    ASSERT_EQ(0u, springls_memory_used(NULL));
    ASSERT_EQ(invalid, springls_set_mesh(NULL, x, 3, 0, triangle, 1, NULL));
    ASSERT_EQ(invalid, springls_set_mesh(ctx, NULL, 3, 0, triangle, 1, NULL));
    ASSERT_EQ(invalid, springls_set_mesh(ctx, x, 3, 0, NULL, 1, NULL));
    ASSERT_EQ(invalid, springls_set_level_set(NULL, x));
    ASSERT_EQ(invalid, springls_set_level_set(ctx, NULL));
    ASSERT_EQ(invalid, springls_set_labels(NULL, labels, 1));
    ASSERT_EQ(invalid, springls_set_labels(ctx, NULL, 1));
    ASSERT_EQ(invalid, springls_set_threshold(NULL, x, 0.0f, 1.0f));
    ASSERT_EQ(invalid, springls_set_threshold(ctx, NULL, 0.0f, 1.0f));
    ASSERT_EQ(invalid, springls_set_implicit(NULL, springls_implicit_sphere, x));
    ASSERT_EQ(invalid, springls_set_implicit(ctx, NULL, x));
    ASSERT_EQ(invalid, springls_set_springls(NULL, x, NULL, NULL, 1));
    ASSERT_EQ(invalid, springls_set_springls(ctx, NULL, NULL, NULL, 1));
    ASSERT_EQ(invalid, springls_set_reference(NULL));
    ASSERT_EQ(invalid, springls_set_keep_mask(NULL, inside));
    ASSERT_EQ(invalid, springls_max_speed(NULL, &forces, 0.0f, x));
    ASSERT_EQ(invalid, springls_max_speed(ctx, NULL, 0.0f, x));
    ASSERT_EQ(invalid, springls_max_speed(ctx, &forces, 0.0f, NULL));
    ASSERT_EQ(invalid, springls_advect(NULL, &forces, 0.0f, 1.0f));
    ASSERT_EQ(invalid, springls_advect(ctx, NULL, 0.0f, 1.0f));
    ASSERT_EQ(invalid, springls_run_stage(NULL, SPRINGLS_STAGE_RELAX));
    ASSERT_EQ(invalid, springls_run_stage(ctx, SPRINGLS_STAGE_ADVECT));
    ASSERT_EQ(invalid, springls_run_stage(ctx, SPRINGLS_STAGE_PROJECT));
    ASSERT_EQ(invalid, springls_run_stage(ctx, SPRINGLS_STAGE_COMPONENTS));
    ASSERT_EQ(invalid, springls_run_stage(ctx, (springls_stage)-1));
    ASSERT_EQ(invalid, springls_step(NULL, &step));
    ASSERT_EQ(invalid, springls_step(ctx, NULL));
    ASSERT_EQ(invalid, springls_run(NULL, &step, 1));
    ASSERT_EQ(invalid, springls_run(ctx, NULL, 1));
    ASSERT_EQ(0.0, springls_time(NULL));
    springls_set_time(NULL, 1.0);
    ASSERT_EQ(0, springls_count(NULL));
    ASSERT_EQ(0, springls_view_vertices(NULL).count);
    ASSERT_EQ(NULL, springls_view_vertices(NULL).data);
    ASSERT_EQ(NULL, springls_view_particles(NULL).data);
    ASSERT_EQ(NULL, springls_view_correspondences(NULL).data);
    ASSERT_EQ(NULL, springls_ids(NULL));
    ASSERT_EQ(NULL, springls_generations(NULL));
    ASSERT_EQ(invalid, springls_pack_matrix(NULL, x));
    ASSERT_EQ(invalid, springls_pack_matrix(ctx, NULL));
    ASSERT_EQ(invalid, springls_extract_surfels(NULL, x));
    ASSERT_EQ(invalid, springls_extract_surfels(ctx, NULL));
    ASSERT_EQ(invalid, springls_extract_mesh(NULL, &mesh));
    ASSERT_EQ(invalid, springls_extract_mesh(ctx, NULL));
    ASSERT_EQ(invalid, springls_extract_soup(NULL, &mesh));
    ASSERT_EQ(invalid, springls_extract_soup(ctx, NULL));
    springls_mesh_free(NULL, &mesh);
    springls_mesh_free(ctx, NULL);
    ASSERT_EQ(invalid, springls_copy_level_set(NULL, x));
    ASSERT_EQ(invalid, springls_copy_level_set(ctx, NULL));
    ASSERT_EQ(invalid, springls_sample_distance(NULL, x, 1, x));
    ASSERT_EQ(invalid, springls_sample_distance(ctx, NULL, 1, x));
    ASSERT_EQ(invalid, springls_sample_distance(ctx, x, 1, NULL));
    ASSERT_EQ(invalid, springls_sample_distance(ctx, x, -1, x));
    ASSERT_EQ(invalid, springls_sample_gradient(NULL, x, 1, x));
    ASSERT_EQ(invalid, springls_sample_gradient(ctx, x, 1, NULL));
    ASSERT_EQ(invalid, springls_sample_inside(NULL, x, 1, inside));
    ASSERT_EQ(invalid, springls_sample_inside(ctx, x, 1, NULL));
    ASSERT_EQ(invalid, springls_closest(NULL, SPRINGLS_SURFACE_WATERTIGHT, x, 1, &hit));
    ASSERT_EQ(invalid, springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, 1, NULL));
    ASSERT_EQ(invalid, springls_raycast(NULL, SPRINGLS_SURFACE_WATERTIGHT, x, x, 1, 0.0f, &hit));
    ASSERT_EQ(invalid, springls_raycast(ctx, SPRINGLS_SURFACE_WATERTIGHT, x, NULL, 1, 0.0f, &hit));
    ASSERT_EQ(invalid, springls_measure(NULL, &measures));
    ASSERT_EQ(invalid, springls_measure(ctx, NULL));
    ASSERT_EQ(0, springls_get_stats(NULL).springls);
    ASSERT(springls_state_hash(NULL) == 0);
    springls_kernel_source(NULL, NULL);
    ASSERT(before == springls_state_hash(ctx)); /* none of it touched the model */
    springls_destroy(ctx);
    PASS();
}

/* Stages of an empty model do nothing, or say that it is empty. */
TEST stages_survive_an_empty_model(void)
{
    springls_context *ctx = fixture_context(16, NULL);
    float wind[3] = { 1.0f, 0.0f, 0.0f }, speed = 7.0f;
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_hit hit;
    ASSERT_OK(springls_advect(ctx, &forces, 0.0f, 1.0f));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_CONTRACT));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RESAMPLE));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_EVOLVE));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_REBUILD));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_FILL_GAPS));
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_TRACK));
    ASSERT_OK(springls_max_speed(ctx, &forces, 0.0f, &speed));
    ASSERT_EQ(0.0f, speed);
    ASSERT_OK(springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, wind, 1, &hit));
    ASSERT_EQ(-1, hit.springl);
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_run_stage(ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    ASSERT_STATUS(SPRINGLS_EMPTY_MODEL, springls_set_reference(ctx));
    ASSERT_EQ(0, springls_count(ctx));
    springls_destroy(ctx);
    PASS();
}

SUITE(context)
{
    RUN_TEST(memory_grows_by_little);
    RUN_TEST(descriptions_are_checked);
    RUN_TEST(sizes_at_the_limit);
    RUN_TEST(messages_give_ranges);
    RUN_TEST(parameters_are_checked);
    RUN_TEST(parameters_can_be_replaced);
    RUN_TEST(memory_is_accounted_for);
    RUN_TEST(memory_follows_the_surface);
    RUN_TEST(errors_belong_to_a_context);
    RUN_TEST(status_and_version_have_words);
    RUN_TEST(inputs_report_and_can_be_cancelled);
    RUN_TEST(reset_forgets);
    RUN_TEST(contexts_are_independent);
    RUN_TEST(room_is_limited);
    RUN_TEST(coordinates_go_both_ways);
    RUN_TEST(every_call_survives_null);
    RUN_TEST(stages_survive_an_empty_model);
}

/* Why a description is refused can be asked for, one sentence for each cause. */
TEST create_has_reasons(void)
{
    static const char *const expected[] = { "desc is NULL", "grid.size is less than 4", "grid.size is more than 4096",
                                            "grid.spacing is not positive", "grid.origin is no number between", "in one plane",
                                            "params.d_max", "params do not come from", "max_springls", "allocator.free" };
    springls_params strange = springls_default_params(), foreign = strange;
    springls_context *ctx;
    int cause;
    strange.d_max = -1.0f;
    foreign.cookie = 0;
    for (cause = 0; cause < 10; cause++) {
        springls_desc desc = fixture_desc(16, NULL);
        fixture_heap heap;
        if (cause == 1) desc.grid.size[2] = 3;
        if (cause == 2) desc.grid.size[1] = 5000;
        if (cause == 3) desc.grid.spacing[1] = 1.0;
        if (cause == 4) desc.grid.origin[2] = HUGE_VAL;
        if (cause == 5) desc.grid.direction[0] = 1.0;
        if (cause == 6) desc.params = &strange;
        if (cause == 7) desc.params = &foreign;
        if (cause == 8) desc.max_springls = -1;
        if (cause == 9) {
            desc.allocator = fixture_allocator(&heap);
            desc.allocator.free = NULL;
        }
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(cause ? &desc : NULL, &ctx));
        if (!strstr(springls_create_error(cause ? &desc : NULL), expected[cause])) FAILm(expected[cause]);
    }
    PASS();
}

/* From voxels of 1e-15 to those of 1e15 all measures are numbers; beyond that the grid is refused. */
TEST worlds_of_any_size(void)
{
    static const double spacing[] = { 1e-14, 1e-10, 1.0, 1e10, 1e14 }, refused[] = { 1e-16, 1e16 };
    int i, k;
    for (i = 0; i < 7; i++) {
        springls_desc desc = fixture_desc(16, NULL);
        const double unit = i < 5 ? spacing[i] : refused[i - 5];
        springls_sphere ball = fixture_ball((float)(7.3 * unit), (float)(7.4 * unit), (float)(7.5 * unit), (float)(4.0 * unit));
        springls_measures m;
        springls_context *ctx;
        for (k = 0; k < 3; k++) desc.grid.spacing[k] = unit;
        if (i >= 5) {
            ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_create(&desc, &ctx));
            ASSERT(strstr(springls_create_error(&desc), "1e") != NULL);
            continue;
        }
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        ASSERT_OK(springls_measure(ctx, &m));
        ASSERT_IN_RANGE(1.0, m.volume / (268.08 * unit * unit * unit), 0.05);
        ASSERT_IN_RANGE(1.0, m.area / (201.06 * unit * unit), 0.05);
        ASSERT_IN_RANGE(1.0, m.coverage, 0.1);
        springls_destroy(ctx);
    }
    PASS();
}

/* The defaults mean what zeros mean. */
TEST defaults_are_those_of_zeros(void)
{
    springls_desc desc[2];
    springls_step_desc step = springls_default_step_desc();
    springls_forces forces[2];
    struct exact_flow flow = EXACT_ROTATION(8.0f, 8.0f, 8.0f, 0.0f, 0.0f, 1.0f, 1.0f);
    springls_sphere ball = fixture_ball(9.0f, 8.0f, 8.0f, 4.0f);
    uint64_t hash[2];
    int i, k;
    desc[0] = springls_default_desc();
    forces[0] = springls_default_forces();
    memset(&desc[1], 0, sizeof desc[1]);
    memset(&forces[1], 0, sizeof forces[1]);
    for (i = 0; i < 2; i++) {
        springls_context *ctx;
        for (k = 0; k < 3; k++) desc[i].grid.size[k] = 16;
        ASSERT_STR_EQ("", springls_create_error(&desc[i]));
        ASSERT_OK(springls_create(&desc[i], &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
        forces[i].velocity = exact_flow_velocity;
        forces[i].user = &flow;
        step.forces = &forces[i];
        step.dt = 0.1f;
        ASSERT_OK(springls_step(ctx, &step));
        hash[i] = springls_state_hash(ctx);
        springls_destroy(ctx);
    }
    ASSERT_EQ(hash[0], hash[1]);
    PASS();
}

/* Each cause has a sentence of its own. */
TEST steps_have_reasons(void)
{
    static const char *const expected[] = {"description is NULL",
                                           "dt is -1, not 0 or more",
                                           "dt is inf, not 0 or more and finite",
                                           "max_displacement is -inf, not finite",
                                           "max_displacement is",
                                           "thousandth",
                                           "no mode"};
    springls_context *ctx = fixture_sphere(16, NULL, 8.0f, 8.0f, 8.0f, 4.0f);
    int cause;
    ASSERT(ctx);
    for (cause = 0; cause < 7; cause++) {
        springls_step_desc step = springls_default_step_desc();
        if (cause == 1) step.dt = -1.0f;
        if (cause == 2) step.dt = (float)HUGE_VAL;
        if (cause == 3) step.max_displacement = -(float)HUGE_VAL;
        if (cause == 4) step.max_displacement = (float)HUGE_VAL - (float)HUGE_VAL;
        if (cause == 5) step.max_displacement = 1e-4f;
        if (cause == 6) step.mode = (springls_mode)9;
        ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_step(ctx, cause ? &step : NULL));
        if (!strstr(springls_last_error(ctx), expected[cause])) FAILm(springls_last_error(ctx));
    }
    springls_destroy(ctx);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(context);
    RUN_TEST(create_has_reasons);
    RUN_TEST(worlds_of_any_size);
    RUN_TEST(defaults_are_those_of_zeros);
    RUN_TEST(steps_have_reasons);
    GREATEST_MAIN_END();
}
