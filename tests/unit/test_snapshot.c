/* test_snapshot.c - a snapshot goes on to the bit, here, elsewhere and on the other backend; a block that is not good is
   refused, and the model stays as it was. */
#include "fixtures.h"
#include "snapshot_seal.h"

enum { FLUID, FLUID_PAPER, ELASTIC, LOCKED, PRESERVED, EDGES, MESH, COMBINED, SCENES };
enum { SIZE = 24 };

typedef struct scene {
    springls_context *ctx;
    struct exact_flow flow;
    springls_forces forces;
    springls_step_desc step;
} scene;

/* A sphere as a mesh of 320 triangles turned inside out: it has a source. */
static springls_status ball_mesh(springls_context *ctx)
{
    springls_context *other = fixture_sphere(SIZE, NULL, 11.0f, 11.5f, 12.0f, 4.8f);
    springls_mesh mesh;
    springls_status status = springls_extract_mesh(other, &mesh);
    int t;
    for (t = 0; t < mesh.triangle_count; t++) {
        int corner = mesh.triangles[3 * t];
        mesh.triangles[3 * t] = mesh.triangles[3 * t + 1];
        mesh.triangles[3 * t + 1] = corner;
    }
    if (status == SPRINGLS_OK)
        status =
            springls_set_mesh(ctx, mesh.positions, mesh.vertex_count, 0, mesh.triangles, mesh.triangle_count, NULL);
    springls_mesh_free(other, &mesh);
    springls_destroy(other);
    return status;
}

/* tasks NULL: none; empty: a context without a model. */
static springls_status scene_begin(scene *s, int which, const springls_tasks *tasks, springls_backend *backend, int empty)
{
    const int paper = which == FLUID_PAPER || which == PRESERVED;
    springls_params p = paper ? springls_paper_params() : springls_default_params();
    springls_desc desc = fixture_desc(SIZE, empty ? NULL : &p);
    springls_sphere ball = fixture_ball(10.0f, 11.0f, 12.0f, 4.8f);
    springls_box box = { { 11.5f, 11.5f, 11.5f }, { 4.0f, 3.0f, 5.0f } };
    springls_attribute_desc colour = {"colour", 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND},
                            label = {"label", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY};
    int i;
    memset(s, 0, sizeof *s);
    p.resample_period = 3;
    p.volume_lock = which == LOCKED;
    if (which == PRESERVED) p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    if (tasks) desc.tasks = *tasks;
    desc.backend = backend;
    s->flow.size = (float)SIZE;
    s->flow.period = 3.0f;
    s->forces = fixture_forces(exact_flow_velocity, &s->flow);
    s->step = fixture_step(&s->forces, which == ELASTIC ? SPRINGLS_MODE_ELASTIC : SPRINGLS_MODE_FLUID, 0.03f);
    SPRINGLS__TRY(springls_create(&desc, &s->ctx));
    if (empty) return SPRINGLS_OK;
    if (which == MESH) SPRINGLS__TRY(ball_mesh(s->ctx));
    else
        SPRINGLS__TRY(which == EDGES ? springls_set_implicit(s->ctx, springls_implicit_box, &box)
                                     : springls_set_implicit(s->ctx, springls_implicit_sphere, &ball));
    if (which == COMBINED) {
        springls_sphere bite = fixture_ball(14.0f, 11.0f, 12.0f, 4.0f);
        SPRINGLS__TRY(springls_combine_implicit(s->ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &bite));
    }
    if (which == FLUID || which == MESH) {
        float *values = (float *)malloc(3 * (size_t)springls_count(s->ctx) * sizeof *values);
        for (i = 0; i < 3 * springls_count(s->ctx); i++) values[i] = 0.01f * (float)(i % 97);
        SPRINGLS__TRY(springls_add_attribute(s->ctx, &colour, values, NULL));
        SPRINGLS__TRY(springls_add_attribute(s->ctx, &label, values, NULL));
        free(values);
    }
    return SPRINGLS_OK;
}

static springls_status steps(scene *s, int count)
{
    for (; count > 0; count--) SPRINGLS__TRY(springls_step(s->ctx, &s->step));
    return SPRINGLS_OK;
}

/* All that can be told of a model, as one number. */
static uint64_t digest(springls_context *ctx)
{
    uint64_t hash = springls_state_hash(ctx);
    springls_stats stats = springls_get_stats(ctx);
    float points[9] = { 5.0f, 12.0f, 12.0f, 11.0f, 3.0f, 13.0f, 20.0f, 21.0f, 9.0f };
    double numbers[6];
    springls_hit hits[3];
    int i;
    for (i = 0; i < springls_attribute_count(ctx); i++) {
        springls_view view = springls_view_attribute(ctx, i);
        hash = springls__hash(hash, view.data, (size_t)view.count * view.stride);
    }
    hash = springls__hash(hash, springls_generations(ctx), (size_t)springls_count(ctx) * sizeof(uint32_t));
    numbers[0] = springls_time(ctx);
    numbers[1] = (double)stats.added;
    numbers[2] = (double)stats.removed;
    numbers[3] = (double)stats.steps;
    numbers[4] = (double)stats.at_edges;
    numbers[5] = (double)springls_material_triangle_count(ctx);
    hash = springls__hash(hash, numbers, sizeof numbers);
    memset(hits, 0, sizeof hits);
    if (springls_count(ctx) && springls_closest(ctx, SPRINGLS_SURFACE_WATERTIGHT, points, 3, hits) != SPRINGLS_OK) return 0;
    return springls__hash(hash, hits, sizeof hits);
}

typedef struct block { void *bytes; size_t size; } block;

static springls_status take(springls_context *ctx, springls_snapshot_kind kind, block *b)
{
    SPRINGLS__TRY(springls_snapshot(ctx, kind, NULL, 0, &b->size));
    b->bytes = malloc(b->size);
    return springls_snapshot(ctx, kind, b->bytes, b->size, &b->size);
}

/* After each of seven steps: what follows is the same from a snapshot, with threads, in an empty context, and on the scalar
   backend as on the other. */
TEST it_goes_on_to_the_bit(int which)
{
    fixture_workers workers;
    springls_tasks tasks = fixture_tasks(&workers, 3, 1);
    scene s, other;
    int k;
    for (k = 0; k < 7; k++) {
        block all, frame;
        uint64_t end;
        ASSERT_OK(scene_begin(&s, which, NULL, fixture_backend(), 0));
        ASSERT_OK(steps(&s, k));
        ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &all));
        ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &frame));
        ASSERT_LT(frame.size, all.size);
        ASSERT_OK(steps(&s, 4));
        end = digest(s.ctx);
        ASSERT(end != 0);
        ASSERT_OK(springls_restore(s.ctx, frame.bytes, frame.size)); /* back, here */
        ASSERT_OK(steps(&s, 4));
        ASSERT_EQ(end, digest(s.ctx));
        ASSERT_OK(scene_begin(&other, which, &tasks, k % 2 ? NULL : fixture_backend(), 1)); /* elsewhere */
        ASSERT_OK(springls_restore(other.ctx, all.bytes, all.size));
        ASSERT_OK(steps(&other, 1));
        ASSERT_OK(springls_restore(other.ctx, frame.bytes, frame.size)); /* the same original surface now */
        ASSERT_OK(steps(&other, 4));
        ASSERT_EQ(end, digest(other.ctx));
        springls_destroy(s.ctx);
        springls_destroy(other.ctx);
        free(all.bytes);
        free(frame.bytes);
    }
    PASS();
}

/* Taking one changes nothing, and one of what has been restored is the same bytes. */
TEST snapshots_change_nothing_and_are_repeatable(int which)
{
    scene s, plain, other;
    block first, again;
    int i;
    ASSERT_OK(scene_begin(&s, which, NULL, fixture_backend(), 0));
    ASSERT_OK(scene_begin(&plain, which, NULL, fixture_backend(), 0));
    for (i = 0; i < 4; i++) {
        ASSERT_OK(steps(&s, 1));
        ASSERT_OK(steps(&plain, 1));
        ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &first));
        free(first.bytes);
        ASSERT_EQ(digest(plain.ctx), digest(s.ctx));
    }
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &first));
    ASSERT_OK(scene_begin(&other, which, NULL, NULL, 1));
    ASSERT_OK(springls_restore(other.ctx, first.bytes, first.size));
    ASSERT_OK(take(other.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &again));
    ASSERT_EQ(first.size, again.size);
    ASSERT(memcmp(first.bytes, again.bytes, first.size) == 0);
    springls_destroy(s.ctx);
    springls_destroy(plain.ctx);
    springls_destroy(other.ctx);
    free(first.bytes);
    free(again.bytes);
    PASS();
}

/* An empty model, too. */
TEST nothing_is_kept_as_nothing(void)
{
    scene s, other;
    block b;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 1));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    ASSERT_OK(scene_begin(&other, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(springls_restore(other.ctx, b.bytes, b.size));
    ASSERT_EQ(0, springls_count(other.ctx));
    ASSERT_EQ(0, springls_attribute_count(other.ctx));
    ASSERT_EQ(springls_state_hash(s.ctx), springls_state_hash(other.ctx));
    springls_destroy(s.ctx);
    springls_destroy(other.ctx);
    free(b.bytes);
    PASS();
}

static greatest_test_res is_refused(springls_context *ctx, const void *bytes, size_t size, uint64_t before)
{
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(ctx, bytes, size));
    ASSERT_GT(strlen(springls_last_error(ctx)), 0u);
    ASSERT_EQ(before, springls_state_hash(ctx));
    PASS();
}

/* Cut anywhere, or with any bit turned: refused. */
TEST damage_is_refused(void)
{
    scene s;
    block b;
    unsigned char *bytes;
    uint64_t before;
    size_t i;
    ASSERT_OK(scene_begin(&s, LOCKED, NULL, fixture_backend(), 0));
    ASSERT_OK(steps(&s, 2));
    before = springls_state_hash(s.ctx);
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    bytes = (unsigned char *)b.bytes;
    ASSERT_OK(steps(&s, 1));
    before = springls_state_hash(s.ctx);
    for (i = 0; i < b.size; i += i < 4000 ? 7 : 4099) {
        void *piece = malloc(i ? i : 1); /* of its own, so that reading beyond is seen */
        memcpy(piece, bytes, i);
        CHECK_CALL(is_refused(s.ctx, piece, i, before));
        free(piece);
    }
    CHECK_CALL(is_refused(s.ctx, bytes, b.size - 1, before));
    for (i = 0; i < b.size; i += i < 200 ? 1 : 1 + b.size / 600) {
        unsigned char bit = (unsigned char)(1u << (i % 8));
        bytes[i] ^= bit;
        CHECK_CALL(is_refused(s.ctx, bytes, b.size, before));
        bytes[i] ^= bit;
    }
    ASSERT_OK(springls_restore(s.ctx, bytes, b.size));
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* A section without data is as if it was not there, also one of neighbor lists, whatever the numbers say of them. */
TEST empty_sections_are_none(const char *tag, const char *number, int32_t value)
{
    scene s, other;
    block b;
    char *bytes;
    uint32_t sections;
    size_t i;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(scene_begin(&other, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    bytes = (char *)calloc(b.size + SPRINGLS__SECTION_HEAD_BYTES, 1);
    memcpy(bytes, b.bytes, b.size);
    for (i = 0; strcmp(bytes + i, "neighbors_uses") != 0; i++) continue;
    memset(bytes + i, 0, SPRINGLS__NAMED_BYTES);
    strcpy(bytes + i, number);
    memcpy(bytes + i + SPRINGLS__NAME_BYTES, &value, sizeof value);
    memcpy(bytes + b.size, tag, 4);
    memcpy(&sections, bytes + 12, 4);
    sections++;
    memcpy(bytes + 12, &sections, 4);
    fixture_seal(bytes, b.size + SPRINGLS__SECTION_HEAD_BYTES);
    ASSERT_OK(springls_restore(other.ctx, bytes, b.size + SPRINGLS__SECTION_HEAD_BYTES));
    ASSERT_OK(steps(&s, 3));
    ASSERT_OK(steps(&other, 3));
    ASSERT_EQ(digest(s.ctx), digest(other.ctx));
    springls_destroy(s.ctx);
    springls_destroy(other.ctx);
    free(b.bytes);
    free(bytes);
    PASS();
}

/* Numbers that cannot be, under a good checksum: refused, or else harmless. */
TEST impossible_numbers_are_refused(int frame)
{
    static const uint32_t words[] = { 0u, 1u, 0x7fffffffu, 0x80000000u, 0xffffffffu, 0x7fc00000u, 0x10000u };
    springls_snapshot_kind kind = frame ? SPRINGLS_SNAPSHOT_KIND_FRAME : SPRINGLS_SNAPSHOT_KIND_ALL;
    scene s;
    block b;
    char *bytes;
    size_t i, w, refused = 0, taken = 0, end;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(steps(&s, 2));
    ASSERT_OK(take(s.ctx, kind, &b));
    bytes = (char *)b.bytes;
    end = SPRINGLS__HEAD_BYTES + 2 * SPRINGLS__SECTION_HEAD_BYTES
        + (SPRINGLS__NUMBERS_WRITTEN + SPRINGLS__PARAMS_NAMED) * SPRINGLS__NAMED_BYTES;
    for (i = SPRINGLS__HEAD_BYTES; i + 4 <= b.size; i += i < end + 400 ? 4 : 4 * (b.size / 4 / 300)) {
        if (i > 64 && i < end && i % 16 < 8 && i % 20) continue; /* most of the names */
        for (w = 0; w < (i < end ? 7u : 4u); w++) {
            springls_status status;
            uint64_t before = springls_state_hash(s.ctx);
            uint32_t kept;
            memcpy(&kept, bytes + i, 4);
            memcpy(bytes + i, &words[i < end ? w : w + 2], 4);
            fixture_seal(bytes, b.size);
            status = springls_restore(s.ctx, bytes, b.size);
            if (status == SPRINGLS_OK) {
                taken++;
                if (taken % 50 == 0) springls_step(s.ctx, &s.step); /* whatever its status, memory stays whole */
                memcpy(bytes + i, &kept, 4);
                fixture_seal(bytes, b.size);
                ASSERT_OK(springls_restore(s.ctx, bytes, b.size));
            } else {
                ASSERT(status == SPRINGLS_BAD_SNAPSHOT || status == SPRINGLS_OUT_OF_MEMORY);
                ASSERT_EQ(before, springls_state_hash(s.ctx));
                refused++;
                memcpy(bytes + i, &kept, 4);
            }
        }
    }
    ASSERT_GT(refused, 500u);
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* Finds a section of a block; returns where its data begins. */
static char *section_of(char *bytes, size_t size, const char *tag)
{
    size_t at = SPRINGLS__HEAD_BYTES;
    while (at < size && memcmp(bytes + at, tag, 4) != 0) {
        uint64_t length;
        springls__copy_numbers(&length, bytes + at + 8, 1, sizeof length);
        at += SPRINGLS__SECTION_HEAD_BYTES + (size_t)springls__padded(length);
    }
    return at < size ? bytes + at + SPRINGLS__SECTION_HEAD_BYTES : NULL;
}

/* Runs of bricks inside that are empty, overlap, leave the domain, or take bricks that have voxels: refused. */
TEST runs_of_bricks_are_checked(void)
{
    static const int32_t wrong[][2] = {{-1, 1}, {0, 0}, {0, -5}, {0, INT32_MAX}, {INT32_MAX, 2}, {300, 1}, {0, 511}};
    springls_context *ctx = fixture_sphere(64, NULL, 32.0f, 32.0f, 32.0f, 26.0f);
    uint64_t before = springls_state_hash(ctx);
    char *runs;
    block b;
    size_t i;
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    runs = section_of((char *)b.bytes, b.size, "INSD");
    ASSERT(runs != NULL);
    for (i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char kept[8];
        memcpy(kept, runs, 8);
        springls__copy_numbers(runs, wrong[i], 2, sizeof(int32_t));
        fixture_seal((char *)b.bytes, b.size);
        ASSERT_EQ(SPRINGLS_BAD_SNAPSHOT, springls_restore(ctx, b.bytes, b.size));
        ASSERT_EQ(before, springls_state_hash(ctx));
        memcpy(runs, kept, 8);
    }
    fixture_seal((char *)b.bytes, b.size);
    ASSERT_OK(springls_restore(ctx, b.bytes, b.size));
    ASSERT_EQ(before, springls_state_hash(ctx));
    springls_destroy(ctx);
    free(b.bytes);
    PASS();
}

/* Another grid, another original surface, no block at all, too little room. */
TEST strangers_are_refused(void)
{
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere ball = fixture_ball(10.0f, 11.0f, 12.0f, 4.8f);
    springls_context *larger = fixture_sphere(SIZE + 8, NULL, 11.0f, 11.0f, 11.0f, 5.0f), *moved;
    scene s, other;
    block all, frame;
    size_t size;
    desc.grid.origin[1] = 3.0;
    ASSERT_OK(springls_create(&desc, &moved));
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(scene_begin(&other, EDGES, NULL, fixture_backend(), 0));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &all));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &frame));
    CHECK_CALL(is_refused(larger, all.bytes, all.size, springls_state_hash(larger)));
    CHECK_CALL(is_refused(moved, all.bytes, all.size, springls_state_hash(moved)));
    CHECK_CALL(is_refused(other.ctx, frame.bytes, frame.size, springls_state_hash(other.ctx)));
    ASSERT_OK(steps(&s, 1));
    ASSERT_OK(springls_set_reference(s.ctx)); /* its own, but of another time */
    CHECK_CALL(is_refused(s.ctx, frame.bytes, frame.size, springls_state_hash(s.ctx)));
    ASSERT_OK(springls_restore(s.ctx, all.bytes, all.size));
    ASSERT_OK(springls_restore(s.ctx, frame.bytes, frame.size));
    ASSERT_OK(springls_set_implicit(s.ctx, springls_implicit_sphere, &ball)); /* the same once more */
    ASSERT_OK(springls_restore(s.ctx, frame.bytes, frame.size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_restore(s.ctx, NULL, 100));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_restore(NULL, all.bytes, all.size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, all.bytes, all.size - 1, &size));
    ASSERT_EQ(all.size, size);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot(s.ctx, (springls_snapshot_kind)7, NULL, 0, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, NULL));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot(NULL, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    springls_destroy(s.ctx);
    springls_destroy(other.ctx);
    springls_destroy(larger);
    springls_destroy(moved);
    free(all.bytes);
    free(frame.bytes);
    PASS();
}

/* Memory that runs out leaves the model as it was. */
TEST memory_may_run_out(void)
{
    springls_sphere small = fixture_ball(8.0f, 8.0f, 8.0f, 3.0f);
    fixture_heap heap;
    scene s;
    block b;
    int k, failed = 0;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(steps(&s, 4));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    for (k = 0; k < 60; k++) {
        springls_desc desc = fixture_desc(SIZE, NULL);
        springls_context *ctx;
        springls_status status;
        uint64_t before, end;
        desc.allocator = fixture_allocator(&heap);
        ASSERT_OK(springls_create(&desc, &ctx));
        ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &small));
        ASSERT_OK(springls_step(ctx, &s.step));
        before = digest(ctx);
        heap.fail_at = heap.calls + k;
        status = springls_restore(ctx, b.bytes, b.size);
        heap.fail_at = -1;
        if (status != SPRINGLS_OK) {
            failed++;
            ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, status);
            ASSERT_EQ(before, digest(ctx));
            ASSERT_OK(springls_step(ctx, &s.step));
            ASSERT_OK(springls_restore(ctx, b.bytes, b.size));
        }
        end = digest(ctx);
        ASSERT_EQ(digest(s.ctx), end);
        springls_destroy(ctx);
        ASSERT_EQ(0, heap.blocks);
        ASSERT_EQ(0, heap.wrong_sizes);
    }
    ASSERT_GT(failed, 10);
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* In the middle of a step, a whole one: restore drops it. */
TEST restore_drops_the_step(void)
{
    scene s;
    block b;
    springls_step_desc whole;
    uint64_t end;
    bool done;
    int i;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &b));
    ASSERT_OK(steps(&s, 3));
    end = digest(s.ctx);
    whole = s.step;
    whole.stop_at_topology = true; /* lets no step be lazy */
    ASSERT_OK(springls_step_begin(s.ctx, &whole));
    for (i = 0; i < 10; i++) ASSERT_OK(springls_step_continue(s.ctx, 0.0, &done));
    ASSERT(!done);
    ASSERT_OK(springls_restore(s.ctx, b.bytes, b.size));
    ASSERT(!springls_step_in_progress(s.ctx));
    ASSERT_OK(steps(&s, 3));
    ASSERT_EQ(end, digest(s.ctx));
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* Amounts that add up to more than a float holds: what has been written is taken back. */
TEST values_may_overflow(void)
{
    springls_context *ctx = fixture_sphere(SIZE, NULL, 11.0f, 11.0f, 11.0f, 5.0f);
    springls_attribute_desc amount = { "amount", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_SHARE };
    springls_view view;
    float *values;
    block b;
    int i, infinite = 0;
    ASSERT(ctx);
    values = (float *)malloc((size_t)springls_count(ctx) * sizeof *values);
    for (i = 0; i < springls_count(ctx); i++) values[i] = 3e38f;
    ASSERT_OK(springls_add_attribute(ctx, &amount, values, NULL));
    ASSERT_OK(springls_remesh(ctx));
    view = springls_view_attribute(ctx, 0);
    for (i = 0; i < view.count; i++) infinite += !(view.data[i] <= FLT_MAX);
    ASSERT_GT(infinite, 0);
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    ASSERT_OK(springls_reset(ctx));
    ASSERT_OK(springls_restore(ctx, b.bytes, b.size));
    view = springls_view_attribute(ctx, 0);
    for (i = 0; i < view.count; i++) infinite -= !(view.data[i] <= FLT_MAX);
    ASSERT_EQ(0, infinite);
    springls_destroy(ctx);
    free(values);
    free(b.bytes);
    PASS();
}

/* ---- the format ---- */

/* Two runs of the same model are the same bytes, whatever time they took; and the times of a context are its own. */
TEST equal_states_are_equal_bytes(void)
{
    scene s[2];
    block b[2];
    springls_stats stats;
    int i;
    for (i = 0; i < 2; i++) {
        ASSERT_OK(scene_begin(&s[i], LOCKED, NULL, fixture_backend(), 0));
        ASSERT_OK(steps(&s[i], 3));
        ASSERT_OK(take(s[i].ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b[i]));
    }
    ASSERT_EQ(b[0].size, b[1].size);
    ASSERT(memcmp(b[0].bytes, b[1].bytes, b[0].size) == 0);
    stats = springls_get_stats(s[0].ctx);
    ASSERT_OK(steps(&s[1], 1));
    ASSERT_OK(springls_restore(s[0].ctx, b[1].bytes, b[1].size));
    ASSERT(memcmp(stats.seconds, springls_get_stats(s[0].ctx).seconds, sizeof stats.seconds) == 0);
    for (i = 0; i < 2; i++) {
        springls_destroy(s[i].ctx);
        free(b[i].bytes);
    }
    PASS();
}

/* Reads a number of `width` bytes, the least significant first. */
static uint64_t number_at(const void *bytes, size_t at, int width)
{
    const unsigned char *p = (const unsigned char *)bytes + at;
    uint64_t value = 0;
    while (width-- > 0) value = value << 8 | p[width];
    return value;
}

/* Returns where a section's head begins; 0: there is none. */
static size_t find_section(const block *b, const char *tag)
{
    size_t at = 32;
    while (at < b->size) {
        if (memcmp((const char *)b->bytes + at, tag, 4) == 0) return at;
        at += 16 + ((size_t)number_at(b->bytes, at + 8, 8) + 7) / 8 * 8;
    }
    return 0;
}

/* Returns where the value of a number with a name is. */
static size_t find_number(const block *b, const char *tag, const char *name)
{
    size_t at = find_section(b, tag), end = at + 16 + (size_t)number_at(b->bytes, at + 8, 8);
    for (at += 16; at < end; at += 32)
        if (strcmp((const char *)b->bytes + at, name) == 0) return at + 24;
    return 0;
}

/* A block that was written by the first version with this format: a ball of 32 springls at 8^3 that has been turned twice. */
static bool read_golden(block *b)
{
    FILE *file = fopen("tests/unit/snapshot_1.bin", "rb");
    b->bytes = malloc(20000);
    b->size = file && b->bytes ? fread(b->bytes, 1, 20000, file) : 0;
    if (file) fclose(file);
    return b->size == 15392;
}

static springls_context *golden_context(void)
{
    springls_desc desc = fixture_desc(8, NULL);
    springls_context *ctx = NULL;
    int i;
    for (i = 0; i < 3; i++) desc.grid.spacing[i] = 0.5;
    desc.grid.origin[1] = -2.0;
    desc.backend = fixture_backend();
    return springls_create(&desc, &ctx) == SPRINGLS_OK ? ctx : NULL;
}

/* What the first version has written can be read for good. */
TEST the_first_version_can_be_read(void)
{
    springls_context *ctx = golden_context();
    const springls_component *components;
    springls_attribute_desc heat;
    springls_params params;
    springls_step_desc step = springls_default_step_desc();
    springls_stats stats;
    block b;
    int count;
    ASSERT(ctx);
    ASSERT(read_golden(&b));
    ASSERT_OK(springls_restore(ctx, b.bytes, b.size));
    ASSERT_EQ(32, springls_count(ctx));
    ASSERT(springls_state_hash(ctx) == 0x50662682fa02ec1cu);
    ASSERT_EQ(0.5, springls_time(ctx));
    stats = springls_get_stats(ctx);
    ASSERT_EQ(2, stats.steps);
    ASSERT_EQ(0, stats.added);
    params = springls_get_params(ctx);
    ASSERT_EQ(4.5f, params.sharpness);
    ASSERT_EQ(2, params.initial_stride);
    ASSERT_EQ(1, springls_attribute_count(ctx));
    ASSERT_OK(springls_describe_attribute(ctx, 0, &heat));
    ASSERT_STR_EQ("heat", heat.name);
    ASSERT_EQ(SPRINGLS_POLICY_BLEND, heat.fill);
    ASSERT_EQ(SPRINGLS_POLICY_SHARE, heat.merge);
    ASSERT_EQ(7.75f, springls_view_attribute(ctx, 0).data[31]);
    ASSERT_OK(springls_components(ctx, &components, &count));
    ASSERT_EQ(1, count);
    ASSERT_EQ(1u, components[0].id);
    ASSERT_IN_RANGE(2.97209711, components[0].volume, 1e-8);
    ASSERT_OK(springls_run_stage(ctx, SPRINGLS_STAGE_RELAX));
    step.dt = 0.1f;
    step.max_displacement = 0.0f;
    ASSERT_OK(springls_step(ctx, &step));
    springls_destroy(ctx);
    free(b.bytes);
    PASS();
}

/* The head and the heads of sections, byte by byte. */
TEST bytes_are_as_documented(void)
{
    scene s;
    block b;
    size_t at, name;
    unsigned sections = 0;
    uint64_t bits;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(steps(&s, 2));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    ASSERT(memcmp(b.bytes, "springls\1\0\0\0", 12) == 0);
    ASSERT_EQ((uint64_t)b.size, number_at(b.bytes, 16, 8));
    for (at = 32; at < b.size; sections++) at += 16 + ((size_t)number_at(b.bytes, at + 8, 8) + 7) / 8 * 8;
    ASSERT_EQ(b.size, at);
    ASSERT_EQ((uint64_t)sections, number_at(b.bytes, 12, 4));
    ASSERT_EQ((uint64_t)SIZE, number_at(b.bytes, find_section(&b, "GRID") + 16, 4));
    ASSERT_EQ((uint64_t)springls_count(s.ctx), number_at(b.bytes, find_number(&b, "NUMB", "springls"), 4));
    ASSERT_EQ(number_at(b.bytes, find_number(&b, "NUMB", "springls"), 8), number_at(b.bytes, find_section(&b, "SPRG") + 8, 8) / 48);
    name = find_number(&b, "PARM", "sharpness");
    ASSERT_EQ(0x40a00000u, number_at(b.bytes, name, 8)); /* 5.0f */
    memcpy(&bits, springls_view_vertices(s.ctx).data, 8);
    if (springls__little_endian()) ASSERT(bits == number_at(b.bytes, find_section(&b, "SPRG") + 16, 8));
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* Appends a section to a block. */
static block with_section(const block *b, const char *tag, unsigned flags, unsigned bytes)
{
    block more;
    unsigned char *end;
    more.size = b->size + 16 + (bytes + 7) / 8 * 8;
    more.bytes = calloc(1, more.size);
    memcpy(more.bytes, b->bytes, b->size);
    ((unsigned char *)more.bytes)[12]++;
    end = (unsigned char *)more.bytes + b->size;
    memcpy(end, tag, 4);
    end[4] = (unsigned char)flags;
    end[8] = (unsigned char)bytes;
    fixture_seal(more.bytes, more.size);
    return more;
}

static greatest_test_res is_refused_for(springls_context *ctx, const block *b, const char *reason)
{
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_restore(ctx, b->bytes, b->size));
    if (!strstr(springls_last_error(ctx), reason)) FAILm(springls_last_error(ctx));
    PASS();
}

/* A model that two tools have cut: two joints in its original surface. */
static springls_context *model_with_tools(void)
{
    springls_context *ctx = fixture_sphere(18, NULL, 8.5f, 8.5f, 8.5f, 4.5f);
    springls_sphere one = fixture_ball(4.5f, 8.5f, 8.5f, 2.5f), two = fixture_ball(12.5f, 8.5f, 8.5f, 2.5f);
    if (springls_combine_implicit(ctx, SPRINGLS_OPERATION_DIFFERENCE, springls_implicit_sphere, &one) != SPRINGLS_OK
        || springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &two) != SPRINGLS_OK) springls_reset(ctx);
    return ctx;
}

/* The first triangles of tools are numbers of triangles that there are, ascend, and are as many as the number of them says. */
TEST tools_are_checked(void)
{
    springls_context *ctx = model_with_tools();
    const uint64_t before = springls_state_hash(ctx);
    const int count = ctx->original.count, a = count / 3, b = count / 2;
    int32_t bad[8][2];
    char *joints, *number;
    block all;
    int32_t value;
    size_t i;
    ASSERT_EQ(2, ctx->original.joints);
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &all));
    joints = (char *)all.bytes + find_section(&all, "TOOL") + SPRINGLS__SECTION_HEAD_BYTES;
    number = (char *)all.bytes + find_number(&all, "NUMB", "original_tools");
    ASSERT_EQ(2, (int)number_at(all.bytes, (size_t)(number - (char *)all.bytes), 4));
    for (i = 0; i < 8; i++) { bad[i][0] = a; bad[i][1] = b; }
    bad[0][1] = a;            /* equal */
    bad[1][0] = b; bad[1][1] = a;
    bad[2][0] = 0;
    bad[3][0] = -1;
    bad[4][1] = count;        /* behind the last */
    bad[5][1] = count + 1;
    bad[6][1] = INT32_MAX;
    bad[7][1] = INT32_MIN;
    for (i = 0; i < 8; i++) {
        char kept[8];
        memcpy(kept, joints, 8);
        springls__copy_numbers(joints, bad[i], 2, sizeof(int32_t));
        fixture_seal(all.bytes, all.size);
        CHECK_CALL(is_refused_for(ctx, &all, "damaged"));
        memcpy(joints, kept, 8);
    }
    for (i = 0; i < 5; i++) { /* numbers that are not those of the section */
        static const int32_t numbers[5] = { -1, 1, 3, INT32_MAX, INT32_MIN };
        springls__copy_numbers(number, &numbers[i], 1, sizeof(int32_t));
        fixture_seal(all.bytes, all.size);
        CHECK_CALL(is_refused_for(ctx, &all, "damaged"));
    }
    value = 2;
    springls__copy_numbers(number, &value, 1, sizeof value);
    joints[3 - (int)SPRINGLS__SECTION_HEAD_BYTES] = 'X'; /* an unknown section, which may be skipped: so there is none of tools */
    joints[4 - (int)SPRINGLS__SECTION_HEAD_BYTES] = SPRINGLS__SECTION_OPTIONAL;
    fixture_seal(all.bytes, all.size);
    CHECK_CALL(is_refused_for(ctx, &all, "damaged"));
    joints[3 - (int)SPRINGLS__SECTION_HEAD_BYTES] = 'L';
    joints[4 - (int)SPRINGLS__SECTION_HEAD_BYTES] = 0;
    fixture_seal(all.bytes, all.size);
    ASSERT_EQ(before, springls_state_hash(ctx));
    ASSERT_OK(springls_restore(ctx, all.bytes, all.size));
    ASSERT_EQ(before, springls_state_hash(ctx));
    ASSERT_EQ(2, ctx->original.joints);
    free(all.bytes);
    springls_destroy(ctx);
    PASS();
}

/* Sections and numbers of newer versions: skipped where they may be, refused by name otherwise. */
TEST unknown_parts_are_named(void)
{
    scene s;
    block b, more;
    uint64_t before;
    char *name;
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    before = digest(s.ctx);
    more = with_section(&b, "NEWS", 1, 5);
    ASSERT_OK(springls_restore(s.ctx, more.bytes, more.size));
    ASSERT_EQ(before, digest(s.ctx));
    free(more.bytes);
    more = with_section(&b, "NEWS", 0, 5);
    CHECK_CALL(is_refused_for(s.ctx, &more, "section 'NEWS'"));
    free(more.bytes);
    more = with_section(&b, "MASK", 1, 8); /* there is one */
    CHECK_CALL(is_refused_for(s.ctx, &more, "damaged"));
    free(more.bytes);
    name = (char *)b.bytes + find_number(&b, "NUMB", "steps") - 24;
    memcpy(name, "stepz", 5);
    fixture_seal(b.bytes, b.size);
    CHECK_CALL(is_refused_for(s.ctx, &b, "number 'stepz'"));
    memcpy(name, "steps", 5);
    memset((char *)b.bytes + 8, 2, 1);
    fixture_seal(b.bytes, b.size);
    CHECK_CALL(is_refused_for(s.ctx, &b, "of another version"));
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* A number that a block does not have is 0, a parameter that of the default set. */
TEST missing_numbers_have_defaults(void)
{
    scene s;
    block b;
    size_t at, all;
    ASSERT_OK(scene_begin(&s, FLUID_PAPER, NULL, fixture_backend(), 0));
    ASSERT_OK(steps(&s, 1));
    ASSERT_EQ(0, springls_get_params(s.ctx).cover);
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    at = find_number(&b, "PARM", "cover");
    all = find_section(&b, "PARM") + 16; /* the first takes the place of both */
    memcpy((char *)b.bytes + at - 24, (char *)b.bytes + all, 32);
    at = find_number(&b, "NUMB", "steps");
    memcpy((char *)b.bytes + at - 24, (char *)b.bytes + find_section(&b, "NUMB") + 16, 32);
    fixture_seal(b.bytes, b.size);
    ASSERT_OK(springls_restore(s.ctx, b.bytes, b.size));
    ASSERT_EQ(1, springls_get_params(s.ctx).cover);
    ASSERT_EQ(0, springls_get_stats(s.ctx).steps);
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* Enumerations and booleans are checked as numbers, before they are loaded. */
TEST enumerations_are_checked(void)
{
    static const char *const params[] = { "threshold", "weight", "torque", "placement", "topology", "contact" };
    scene s;
    block b;
    size_t i, at[9];
    ASSERT_OK(scene_begin(&s, FLUID, NULL, fixture_backend(), 0));
    ASSERT_OK(take(s.ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &b));
    for (i = 0; i < 6; i++) at[i] = find_number(&b, "PARM", params[i]);
    for (; i < 9; i++) at[i] = find_section(&b, "ATTR") + 16 + 36 + 4 * (i - 6); /* its policies */
    for (i = 0; i < 9; i++) {
        char *byte = (char *)b.bytes + at[i], kept = *byte;
        *byte = 77;
        fixture_seal(b.bytes, b.size);
        CHECK_CALL(is_refused_for(s.ctx, &b, "damaged"));
        *byte = kept;
    }
    springls_destroy(s.ctx);
    free(b.bytes);
    PASS();
}

/* What has happened to components is listed by the model that goes on as by the one that was saved. */
TEST events_are_kept(void)
{
    springls_params p = springls_default_params();
    const springls_sphere balls[] = { fixture_ball(7.0f, 11.5f, 11.5f, 3.5f), fixture_ball(17.0f, 11.5f, 11.5f, 3.5f),
                                      fixture_ball(12.0f, 11.5f, 11.5f, 3.0f) };
    springls_context *ctx[2];
    const springls_event *events;
    springls_event kept[4];
    uint32_t before[4];
    size_t size;
    void *saved;
    int i, k, count[2];
    p.components = 1;
    for (i = 0; i < 2; i++) ctx[i] = fixture_context(SIZE, &p);
    ASSERT_OK(springls_set_implicit(ctx[0], springls_implicit_sphere, (void *)(uintptr_t)&balls[0]));
    for (i = 1; i < 3; i++) {
        ASSERT_OK(springls_events(ctx[0], &events, &count[0]));
        ASSERT_OK(springls_combine_implicit(ctx[0], SPRINGLS_OPERATION_UNION, springls_implicit_sphere,
                                            (void *)(uintptr_t)&balls[i]));
        ASSERT_OK(springls_events(ctx[0], &events, &count[0]));
    }
    ASSERT_EQ(2, count[0]);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_BIRTH, events[0].kind);
    ASSERT_EQ(SPRINGLS_EVENT_KIND_MERGE, events[1].kind);
    for (k = 0; k < count[0]; k++) {
        kept[k] = events[k];
        before[k] = events[k].before_count ? events[k].before[0].id : 0u;
    }
    ASSERT_OK(springls_snapshot(ctx[0], SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    saved = malloc(size);
    ASSERT_OK(springls_snapshot(ctx[0], SPRINGLS_SNAPSHOT_KIND_ALL, saved, size, &size));
    ASSERT_OK(springls_restore(ctx[1], saved, size));
    ASSERT_OK(springls_events(ctx[1], &events, &count[1]));
    ASSERT_EQ(count[0], count[1]);
    for (k = 0; k < count[1]; k++) {
        ASSERT_EQ(kept[k].kind, events[k].kind);
        ASSERT_EQ(kept[k].step, events[k].step);
        ASSERT_MEM_EQ(kept[k].place, events[k].place, sizeof kept[k].place);
        ASSERT_EQ(kept[k].before_count, events[k].before_count);
        ASSERT_EQ(kept[k].after_count, events[k].after_count);
        if (before[k]) ASSERT_EQ(before[k], events[k].before[0].id);
    }
    free(saved);
    for (i = 0; i < 2; i++) springls_destroy(ctx[i]);
    PASS();
}

/* Writes the difference from block `base` to `b`. */
static springls_status differ(springls_context *ctx, const block *base, const block *b, block *delta)
{
    const size_t room = b->size + 64;
    springls_status status;
    delta->bytes = malloc(room);
    status = springls_snapshot_delta(ctx, base->bytes, base->size, b->bytes, b->size, delta->bytes, room, &delta->size);
    return status;
}

/* Pulls at a place of the ball, cuts there or adds there, and lets some steps pass. */
static springls_status stroke(springls_context *ctx, int i)
{
    const double angle = 2.4 * (double)i, height = 1.9 * ((double)(i * 37 % 100) / 100.0 - 0.5), width = sqrt(1.0 - height * height);
    springls_sphere tool = fixture_ball(24.0f + 16.0f * (float)(width * cos(angle)), 24.0f + 16.0f * (float)(width * sin(angle)),
                                        24.0f + 16.0f * (float)height, 3.0f);
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    int k;
    for (k = 0; k < 3; k++) {
        forces.region_lower[k] = tool.center[k] - 4.0f;
        forces.region_upper[k] = tool.center[k] + 4.0f;
    }
    forces.curvature_weight = 0.5f;
    step.forces = &forces;
    step.dt = 0.5f;
    if (i % 2) return springls_run(ctx, &step, 2);
    SPRINGLS__TRY(springls_combine_implicit(ctx, i % 4 ? SPRINGLS_OPERATION_UNION : SPRINGLS_OPERATION_DIFFERENCE,
                                            springls_implicit_sphere, &tool));
    step.forces = NULL;
    step.dt = 0.0f;
    return springls_step(ctx, &step);
}

/* A hundred mixed strokes, undone one after the other from the newest block and the differences, which are small beside the blocks. */
TEST differences_undo_strokes(void)
{
    enum { STROKES = 100 };
    springls_context *ctx = fixture_sphere(48, NULL, 24.0f, 24.0f, 24.0f, 16.0f);
    static block delta[STROKES];
    static uint64_t hash[STROKES];
    block now, next;
    size_t size, sum = 0, whole = 0;
    int i;
    ASSERT_OK(springls_settle(ctx, 40));
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &now));
    for (i = 0; i < STROKES; i++) {
        hash[i] = digest(ctx);
        ASSERT_OK(stroke(ctx, i));
        ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &next));
        ASSERT_OK(differ(ctx, &next, &now, &delta[i]));
        ASSERT(delta[i].size < now.size);
        sum += delta[i].size;
        whole += now.size;
        free(now.bytes);
        now = next;
    }
    ASSERT(sum < whole / 3);
    for (i = STROKES - 1; i >= 0; i--) {
        ASSERT_OK(springls_snapshot_patch(ctx, now.bytes, now.size, delta[i].bytes, delta[i].size, NULL, 0, &next.size));
        next.bytes = malloc(next.size);
        ASSERT_OK(springls_snapshot_patch(ctx, now.bytes, now.size, delta[i].bytes, delta[i].size, next.bytes, next.size, &size));
        ASSERT_EQ(next.size, size);
        ASSERT_OK(springls_restore(ctx, next.bytes, next.size));
        ASSERT_EQ(hash[i], digest(ctx));
        free(now.bytes);
        free(delta[i].bytes);
        now = next;
    }
    free(now.bytes);
    springls_destroy(ctx);
    PASS();
}

/* Differences that are damaged, of other blocks or too long are refused; memory may run out; the same bytes need next to none. */
TEST differences_are_checked(void)
{
    fixture_heap heap;
    springls_desc desc = fixture_desc(SIZE, NULL);
    springls_sphere sphere = fixture_ball(8.0f, 8.0f, 8.0f, 3.0f), other = fixture_ball(8.5f, 8.0f, 8.0f, 4.0f);
    springls_context *ctx;
    block a, b, delta, same;
    size_t size, i;
    char *out;
    desc.allocator = fixture_allocator(&heap);
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &sphere));
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, &a));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &other));
    ASSERT_OK(take(ctx, SPRINGLS_SNAPSHOT_KIND_FRAME, &b));
    ASSERT_OK(differ(ctx, &a, &a, &same));
    ASSERT_LT(same.size, 128u);
    ASSERT_OK(differ(ctx, &a, &b, &delta));
    ASSERT(delta.size <= b.size + 64);
    ASSERT_OK(springls_snapshot_delta(ctx, a.bytes, a.size, b.bytes, b.size, NULL, 0, &size));
    ASSERT_EQ(delta.size, size);
    out = (char *)malloc(b.size);
    memset(out, 0, b.size);
    ASSERT_OK(springls_snapshot_patch(ctx, a.bytes, a.size, delta.bytes, delta.size, out, b.size, &size));
    ASSERT_EQ(0, memcmp(out, b.bytes, b.size));
    for (i = 0; i < delta.size; i += 4) /* cut short anywhere */
        ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_patch(ctx, a.bytes, a.size, delta.bytes, i, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_patch(ctx, b.bytes, b.size, delta.bytes, delta.size, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_patch(ctx, a.bytes, a.size, a.bytes, a.size, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_patch(ctx, a.bytes, a.size - 4, delta.bytes, delta.size, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT,
                  springls_snapshot_patch(ctx, a.bytes, a.size, delta.bytes, delta.size, out, b.size - 1, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot_patch(ctx, a.bytes, a.size, NULL, 0, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot_patch(NULL, a.bytes, a.size, delta.bytes, delta.size, out, b.size, &size));
    ((unsigned char *)delta.bytes)[51] ^= 0x40u; /* a place beyond the base */
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_patch(ctx, a.bytes, a.size, delta.bytes, delta.size, out, b.size, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT,
                  springls_snapshot_delta(ctx, a.bytes, a.size, b.bytes, b.size, out, delta.size - 1, &size));
    ASSERT_OK(springls_snapshot_delta(ctx, a.bytes, a.size, a.bytes, a.size, out, same.size, &size));
    ASSERT_EQ(0, memcmp(out, same.bytes, same.size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot_delta(ctx, NULL, 0, b.bytes, b.size, NULL, 0, &size));
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_snapshot_delta(ctx, a.bytes, a.size, b.bytes, b.size, NULL, 0, NULL));
    ASSERT_STATUS(SPRINGLS_BAD_SNAPSHOT, springls_snapshot_delta(ctx, a.bytes, 31, b.bytes, b.size, NULL, 0, &size));
    heap.fail_at = heap.calls;
    ASSERT_STATUS(SPRINGLS_OUT_OF_MEMORY, springls_snapshot_delta(ctx, a.bytes, a.size, b.bytes, b.size, NULL, 0, &size));
    heap.fail_at = -1;
    free(out);
    free(a.bytes);
    free(b.bytes);
    free(same.bytes);
    free(delta.bytes);
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    int which;
    GREATEST_MAIN_BEGIN();
    for (which = 0; which < SCENES; which++) {
        RUN_TESTp(it_goes_on_to_the_bit, which);
        RUN_TESTp(snapshots_change_nothing_and_are_repeatable, which);
    }
    RUN_TEST(nothing_is_kept_as_nothing);
    RUN_TEST(damage_is_refused);
    RUN_TESTp(empty_sections_are_none, "NCNT", "neighbors_uses", 0);
    RUN_TESTp(empty_sections_are_none, "NEAR", "neighbors_age", -1);
    RUN_TESTp(impossible_numbers_are_refused, 0);
    RUN_TESTp(impossible_numbers_are_refused, 1);
    RUN_TEST(runs_of_bricks_are_checked);
    RUN_TEST(strangers_are_refused);
    RUN_TEST(memory_may_run_out);
    RUN_TEST(restore_drops_the_step);
    RUN_TEST(values_may_overflow);
    RUN_TEST(equal_states_are_equal_bytes);
    RUN_TEST(the_first_version_can_be_read);
    RUN_TEST(bytes_are_as_documented);
    RUN_TEST(tools_are_checked);
    RUN_TEST(unknown_parts_are_named);
    RUN_TEST(missing_numbers_have_defaults);
    RUN_TEST(enumerations_are_checked);
    RUN_TEST(events_are_kept);
    RUN_TEST(differences_undo_strokes);
    RUN_TEST(differences_are_checked);
    GREATEST_MAIN_END();
}
