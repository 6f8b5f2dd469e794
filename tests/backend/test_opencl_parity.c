/* test_opencl_parity.c - every run of every kernel on the device against the scalar loop over the same memory, bit by bit; whole
   scenarios on the device against the same ones without it. Skipped where there is no OpenCL device that rounds as C does. */
#include "springls_under_test.h"
#include "scenarios.h"
#include "device_velocity.h"

/* ---- one run of one kernel ---- */

/* Bytes of every array's device memory, whole buffers; an array that the device has not has none. */
typedef struct parity_copy {
    char *data[SPRINGLS__ARRAY_COUNT];
    size_t bytes[SPRINGLS__ARRAY_COUNT];
} parity_copy;

/* Stands before the backend's own functions while a test watches it. What the device has is downloaded again only where something
   else than a watched run may have written it: every run asks for sixty arrays. */
typedef struct parity_watch {
    springls_backend own;
    parity_copy before, scalar, device;
    size_t known[SPRINGLS__ARRAY_COUNT]; /* the place in device memory whose bytes `before` has, plus 1; 0: of none */
    int runs[SPRINGLS__KERNEL_COUNT];
    uint64_t changed[SPRINGLS__KERNEL_COUNT]; /* the arrays in which a run has changed a byte */
    char fault[256];                          /* the first one */
} parity_watch;

static parity_watch watch;

FIXTURE const char *parity_array_name(int array)
{
#define PARITY_NAME(name, type, block, owner, member) #name,
    static const char *const names[] = { SPRINGLS__ARRAYS(PARITY_NAME) "" };
#undef PARITY_NAME
    return names[array];
}

FIXTURE void parity_fault(int kernel, int array, size_t byte, const char *what)
{
    if (watch.fault[0]) return;
    snprintf(watch.fault, sizeof watch.fault, "%s, run %d: %s %s, element %lu, byte %lu of it", springls__kernels[kernel].name,
             watch.runs[kernel], parity_array_name(array), what,
             (unsigned long)(byte / springls__element_size((springls__array)array)),
             (unsigned long)(byte % springls__element_size((springls__array)array)));
}

FIXTURE bool parity_room(parity_copy *copy, int array, size_t bytes)
{
    char *data = copy->data[array];
    if (bytes > copy->bytes[array]) {
        free(data);
        copy->data[array] = data = (char *)malloc(bytes);
    }
    copy->bytes[array] = data ? bytes : 0;
    return data || bytes == 0;
}

FIXTURE springls_status parity_download(springls_context *ctx, int array, parity_copy *copy)
{
    springls__buffer buffer = ctx->memory[array];
    if (!parity_room(copy, array, buffer.device_bytes)) return SPRINGLS_OUT_OF_MEMORY;
    if (buffer.device_bytes == 0) return SPRINGLS_OK;
    buffer.data = copy->data[array];
    return watch.own.transfer(ctx, &buffer, buffer.device_bytes, true);
}

/* What is not in use becomes nonsense, the same in every run. */
FIXTURE springls_status parity_poison(springls_context *ctx, int array)
{
    springls__buffer buffer = ctx->memory[array];
    size_t used = springls__used(ctx, (springls__array)array) * springls__element_size((springls__array)array), i;
    if (buffer.device_bytes == 0 || !buffer.data) return SPRINGLS_OK; /* no data: an array of the device alone */
    buffer.data = watch.before.data[array];
    for (i = used; i < buffer.device_bytes && ((unsigned char *)buffer.data)[i] == 0xA5;) i++;
    if (i >= buffer.device_bytes) return SPRINGLS_OK;
    memset((char *)buffer.data + used, 0xA5, buffer.device_bytes - used);
    return watch.own.transfer(ctx, &buffer, buffer.device_bytes, false);
}

/* Fills `before`, and `scalar` with the same. */
FIXTURE springls_status parity_prepare(springls_context *ctx)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        const size_t place = ctx->memory[array].device_bytes > 0 ? ctx->memory[array].device_at + 1 : 0;
        if (place == 0 || watch.known[array] != place) SPRINGLS__TRY(parity_download(ctx, array, &watch.before));
        watch.known[array] = place;
        SPRINGLS__TRY(parity_poison(ctx, array));
        if (!parity_room(&watch.scalar, array, watch.before.bytes[array])) return SPRINGLS_OUT_OF_MEMORY;
        if (watch.before.bytes[array]) memcpy(watch.scalar.data[array], watch.before.data[array], watch.before.bytes[array]);
    }
    return SPRINGLS_OK;
}

FIXTURE void parity_forget(const springls__buffer *buffer)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (watch.known[array] == buffer->device_at + 1) watch.known[array] = 0;
}

FIXTURE springls_status parity_resize(springls_context *ctx, springls__buffer *buffer, size_t bytes, size_t keep)
{
    memset(watch.known, 0, sizeof watch.known); /* others may move */
    return watch.own.resize(ctx, buffer, bytes, keep);
}

FIXTURE void parity_release(springls_context *ctx)
{
    memset(watch.known, 0, sizeof watch.known);
    watch.own.release(ctx);
}

FIXTURE springls_status parity_transfer(springls_context *ctx, springls__buffer *buffer, size_t bytes, bool to_host)
{
    if (!to_host) parity_forget(buffer);
    return watch.own.transfer(ctx, buffer, bytes, to_host);
}

FIXTURE springls_status parity_upload(springls_context *ctx, springls__buffer *buffer, const void *data, size_t bytes)
{
    parity_forget(buffer);
    return watch.own.upload(ctx, buffer, data, bytes);
}

typedef void (*parity_limit)(cl_mem memory, size_t at, size_t used, size_t bytes);

/* Leaves a kernel what is in use of each array, with the springls that it adds; NULL: all of it. emulator.c has this for
   AddressSanitizer, real devices have not. */
FIXTURE void parity_limit_kernel(springls_context *ctx, const springls__kernel_info *kernel, springls__arguments args)
{
    const springls__cl_symbol symbol = SPRINGLS__CL_FIND(springls__cl_of(ctx)->library, "device_limit");
    const bool adds = kernel && (kernel->writes & SPRINGLS__SET_BITS) == SPRINGLS__SET_BITS;
    parity_limit limit;
    int array;
    memcpy(&limit, &symbol, sizeof limit);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT && limit; array++) {
        const springls__buffer *buffer = &ctx->memory[array];
        size_t used = springls__used(ctx, (springls__array)array);
        if (adds && springls__has_array(SPRINGLS__SET_BITS, array)) used += (size_t)args.insert.count;
        used *= springls__element_size((springls__array)array);
        if (!kernel || !buffer->data || used > buffer->device_bytes) used = buffer->device_bytes;
        limit((cl_mem)ctx->device_memory.buffer, buffer->device_at, used, buffer->device_bytes);
    }
}

FIXTURE void parity_free(parity_copy *copy)
{
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) free(copy->data[array]);
    memset(copy, 0, sizeof *copy);
}

FIXTURE void parity_scalar(const springls_context *ctx, int kernel, int count, springls__arguments args)
{
    springls__model model = ctx->model;
    float *lane;
    int i;
#define PARITY_BIND(name, type, block, owner, member) model.owner.member = (type *)watch.scalar.data[SPRINGLS__ARRAY_##name];
    SPRINGLS__ARRAYS(PARITY_BIND)
#undef PARITY_BIND
    lane = (float *)malloc((size_t)springls__kernels[kernel].floats * sizeof *lane + 1);
    if (springls__kernels[kernel].range) springls__kernels[kernel].range(&model, args, 0, count, lane);
    for (i = 0; i < count && kernel == SPRINGLS__KERNEL_displace; i++) springls__displace_element(&model, args, i);
    free(lane);
}

FIXTURE size_t parity_first_difference(const void *a, const void *b, size_t bytes)
{
    size_t i = 0;
    if (memcmp(a, b, bytes) == 0) return bytes;
    while (((const char *)a)[i] == ((const char *)b)[i]) i++;
    return i;
}

/* Returns true for kernels that list numbers, or link labels, in an order left to chance, or copy the bytes between members. */
FIXTURE bool parity_leaves_chance(int kernel)
{
    return kernel == SPRINGLS__KERNEL_cells_scatter || kernel == SPRINGLS__KERNEL_brick_lists_scatter
        || kernel == SPRINGLS__KERNEL_region_join || kernel == SPRINGLS__KERNEL_compact_out;
}

/* Whole buffers are compared, not only what is in use: a kernel that writes beyond its elements is found. */
FIXTURE void parity_compare(int kernel, springls__arguments args)
{
    const uint64_t writes = springls__writes_of((springls__kernel)kernel, &args);
    int array;
    watch.runs[kernel]++;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        const char *before = watch.before.data[array], *scalar = watch.scalar.data[array], *device = watch.device.data[array];
        size_t bytes = watch.device.bytes[array], at;
        bool listed = writes >> array & 1u;
        if (bytes == 0) continue;
        if (memcmp(before, device, bytes) != 0) watch.changed[kernel] |= (uint64_t)1 << array;
        if ((!listed || !parity_leaves_chance(kernel)) && (at = parity_first_difference(scalar, device, bytes)) < bytes)
            parity_fault(kernel, array, at, "differs");
        if (listed) continue;
        if ((at = parity_first_difference(before, device, bytes)) < bytes)
            parity_fault(kernel, array, at, "is written and not listed");
    }
}

FIXTURE springls_status parity_run(springls_context *ctx, int kernel, int count, springls__arguments args)
{
    parity_copy now;
    springls_status status;
    int array;
    SPRINGLS__TRY(parity_prepare(ctx));
    parity_scalar(ctx, kernel, count, args);
    parity_limit_kernel(ctx, &springls__kernels[kernel], args);
    status = watch.own.run(ctx, kernel, count, args);
    parity_limit_kernel(ctx, NULL, args);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT && status == SPRINGLS_OK; array++)
        status = parity_download(ctx, array, &watch.device);
    SPRINGLS__TRY(status);
    parity_compare(kernel, args);
    now = watch.device;
    watch.device = watch.before;
    watch.before = now;
    return SPRINGLS_OK;
}

FIXTURE uint64_t parity_scenario_hash(int which)
{
    uint64_t hash;
    watch.fault[0] = 0;
    watch.own = *test_device;
    test_device->run = parity_run;
    test_device->resize = parity_resize;
    test_device->release = parity_release;
    test_device->transfer = parity_transfer;
    test_device->upload = parity_upload;
    hash = scenario_hash(which, test_device);
    *test_device = watch.own;
    parity_free(&watch.before);
    parity_free(&watch.scalar);
    parity_free(&watch.device);
    return hash;
}

/* ---- kernel by kernel ---- */

TEST every_run_has_the_scalar_bits(int which)
{
    uint64_t hash;
    NEEDS_DEVICE();
    hash = parity_scenario_hash(which);
    if (watch.fault[0]) FAILm(watch.fault);
    ASSERT(hash != 0);
    ASSERT(hash == scenario_hash(which, NULL));
    PASS();
}

/* After the scenarios above: no kernel has been left out, and none lists an array that it never writes, which would only cost
   transfers. */
TEST every_kernel_was_seen_to_write_what_it_lists(int kernel)
{
    static char message[256];
    uint64_t missing;
    int array;
    NEEDS_DEVICE();
    snprintf(message, sizeof message, "%s has run", springls__kernels[kernel].name);
    ASSERTm(message, watch.runs[kernel] > 0);
    missing = springls__kernels[kernel].writes & ~watch.changed[kernel];
    if (kernel == SPRINGLS__KERNEL_cells_sort || kernel == SPRINGLS__KERNEL_brick_lists_sort) missing = 0; /* chance may have sorted */
    if (kernel == SPRINGLS__KERNEL_region_resolve) missing &= ~SPRINGLS__BIT(TOP); /* a pocket with a whole brick in it is seldom */
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (missing >> array & 1u) {
            snprintf(message, sizeof message, "%s has changed %s", springls__kernels[kernel].name, parity_array_name(array));
            FAILm(message);
        }
    PASS();
}

/* ---- whole scenarios ---- */

TEST same_bits_from_run_to_run(int which)
{
    uint64_t hash;
    NEEDS_DEVICE();
    hash = scenario_hash(which, test_device);
    ASSERT(hash != 0);
#ifndef __SANITIZE_THREAD__ /* which finds a race in any one run, and takes forty times as long */
    ASSERT(hash == scenario_hash(which, test_device));
#endif
    ASSERT(hash == scenario_hash(which, NULL));
    PASS();
}

/* A backend serves several contexts; here they take turns. */
TEST two_contexts_on_one_backend(void)
{
    springls_context *ctx[2];
    scenario s[2];
    int i, k;
    NEEDS_DEVICE();
    for (k = 0; k < 2; k++) {
        scenario_make(&s[k], k ? SCENARIO_ELASTIC : SCENARIO_THIN);
        ctx[k] = scenario_context(&s[k], test_device);
        ASSERT(ctx[k] != NULL);
    }
    for (i = 0; i < 7; i++)
        for (k = 0; k < 2; k++)
            if (i < s[k].steps) ASSERT_OK(springls_step(ctx[k], &s[k].step));
    for (k = 0; k < 2; k++) {
        ASSERT(scenario_mesh(ctx[k]) == scenario_hash(s[k].which, NULL));
        springls_destroy(ctx[k]);
    }
    PASS();
}

FIXTURE springls_status disturb_with_questions(springls_context *ctx, scenario *s, int step)
{
    (void)s;
    (void)step;
    return history_digest(ctx) ? SPRINGLS_OK : SPRINGLS_INVALID_ARGUMENT;
}

FIXTURE springls_status disturb_with_views(springls_context *ctx, scenario *s, int step)
{
    static float phi[SCENARIO_SIZE * SCENARIO_SIZE * SCENARIO_SIZE];
    springls_view vertices = springls_view_vertices(ctx), particles = springls_view_particles(ctx),
                  origins = springls_view_correspondences(ctx);
    float sum = 0.0f;
    int i;
    (void)s;
    (void)step;
    for (i = 0; i < springls_count(ctx); i++) {
        springls__v3 p = fixture_at(particles, i, 0);
        float furthest = springls__length(springls__sub(fixture_at(vertices, i, 1), p));
        if (!(furthest > 0.0f && furthest < 5.0f)) return SPRINGLS_INVALID_ARGUMENT;
        sum += fixture_at(origins, i, 0).x + (float)springls_ids(ctx)[i] + (float)springls_generations(ctx)[i];
    }
    SPRINGLS__TRY(springls_copy_level_set(ctx, phi));
    return sum > 0.0f && phi[0] > 0.0f ? SPRINGLS_OK : SPRINGLS_INVALID_ARGUMENT;
}

FIXTURE springls_status disturb_with_parameters(springls_context *ctx, scenario *s, int step)
{
    springls_params p = springls_get_params(ctx);
    (void)s;
    p.capture_range = step % 2 ? 2.0f : 2.5f;
    p.relax_iterations = 1 + step % 3;
    p.neighbor_radius = 0.6f + 0.1f * (float)(step % 2);
    p.evolve_iterations = step % 2 ? 4 : p.evolve_iterations;
    p.resample_period = 1 + step % 2;
    return springls_set_params(ctx, &p);
}

FIXTURE springls_status disturb_with_modes(springls_context *ctx, scenario *s, int step)
{
    static const springls_mode modes[3] = { SPRINGLS_MODE_ADVECT_ONLY, SPRINGLS_MODE_ELASTIC, SPRINGLS_MODE_FLUID };
    (void)ctx;
    s->step.mode = modes[step % 3];
    s->step.one_to_one = step % 4 == 3;
    return SPRINGLS_OK;
}

FIXTURE springls_status disturb_with_inputs(springls_context *ctx, scenario *s, int step)
{
    if (step == 1) return springls_set_reference(ctx);
    if (step == 2) return springls_reset(ctx) == SPRINGLS_OK ? scenario_begin(s, ctx) : SPRINGLS_INVALID_ARGUMENT;
    if (step == 3) return history_blobs(ctx);
    if (step == 4) return scenario_mask(ctx);
    return SPRINGLS_OK;
}

/* A pressure by host code: it is called for every block of springls, between kernels. */
FIXTURE void scenario_breath(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    int i;
    (void)user;
    (void)normals;
    for (i = 0; i < count; i++) out[i] = 0.3f * (points[3 * i] > 15.0f ? 1.0f : -1.0f) + 0.1f * time;
}

FIXTURE springls_status disturb_with_writes(springls_context *ctx, scenario *s, int step)
{
    (void)s;
    (void)step;
    return scenario_write(ctx);
}

/* A velocity by index and id of springls. */
FIXTURE void scenario_by_springl(void *user, const springls_batch *batch, float *out)
{
    int i;
    (void)user;
    for (i = 0; i < batch->count; i++) {
        out[3 * i] = 0.1f * (float)(batch->springls[i] % 3);
        out[3 * i + 1] = 0.05f * (float)(batch->ids[i] % 5);
        out[3 * i + 2] = 0.02f * batch->correspondences[3 * i] - 0.3f;
    }
}

FIXTURE springls_status disturb_with_callbacks(springls_context *ctx, scenario *s, int step)
{
    float speed;
    s->forces.pressure = step % 2 ? scenario_breath : NULL;
    s->forces.affine = step % 3 ? history_affine : NULL;
    s->forces.velocity = step % 4 ? history_inwards : NULL;
    s->forces.velocity_batch = step % 4 == 1 ? scenario_by_springl : NULL;
    s->step.dt = 0.2f;
    return springls_max_speed(ctx, &s->forces, 0.0f, &speed);
}

TEST what_happens_between_steps(scenario_disturb disturb, bool changes_nothing)
{
    static const int which[] = { SCENARIO_THIN, SCENARIO_FLUID_PAPER, SCENARIO_SEGMENT };
    size_t i;
    NEEDS_DEVICE();
    for (i = 0; i < sizeof which / sizeof *which; i++) {
        uint64_t hash = scenario_disturbed(which[i], test_device, disturb);
        ASSERT(hash != 0);
        ASSERT(hash == scenario_disturbed(which[i], NULL, disturb));
        ASSERT(changes_nothing == (hash == scenario_hash(which[i], NULL)));
    }
    PASS();
}

/* Rays and closest points of either surface have the same bits after the same steps. */
TEST queries_are_equal(void)
{
    enum { COUNT = 200 };
    static springls_hit hits[2][COUNT];
    float points[3 * COUNT], directions[3 * COUNT];
    springls_context *ctx[2];
    int i, b, surface, found = 0;
    scenario s;
    NEEDS_DEVICE();
    scenario_make(&s, SCENARIO_THIN);
    for (b = 0; b < 2; b++) {
        ctx[b] = scenario_context(&s, b ? test_device : NULL);
        ASSERT(ctx[b] != NULL);
        ASSERT_OK(springls_run(ctx[b], &s.step, 2));
    }
    fixture_seed(23);
    for (i = 0; i < 3 * COUNT; i++) {
        points[i] = fixture_between(0.0f, 30.0f);
        directions[i] = fixture_between(8.0f, 22.0f) - points[i];
    }
    for (surface = 0; surface < 2; surface++) {
        for (b = 0; b < 2; b++)
            ASSERT_OK(springls_raycast(ctx[b], (springls_surface)surface, points, directions, COUNT, 0.0f, hits[b]));
        ASSERT_MEM_EQ(hits[0], hits[1], sizeof hits[0]);
        for (i = 0; i < COUNT; i++) found += hits[0][i].springl >= 0;
        for (b = 0; b < 2; b++) ASSERT_OK(springls_closest(ctx[b], (springls_surface)surface, points, COUNT, hits[b]));
        ASSERT_MEM_EQ(hits[0], hits[1], sizeof hits[0]);
    }
    ASSERT_GT(found, 20);
    for (b = 0; b < 2; b++) springls_destroy(ctx[b]);
    PASS();
}

/* A context that has worked on the device takes springls with correspondences of their own, and works on. */
FIXTURE uint64_t scenario_of_springls(springls_backend *backend)
{
    static float vertices[9 * 20000], origins[3 * 20000];
    springls_context *ctx;
    uint64_t hash = 0;
    int i, m, count;
    scenario s;
    scenario_make(&s, SCENARIO_ELASTIC);
    ctx = scenario_context(&s, backend);
    if (!ctx) return 0;
    if (springls_step(ctx, &s.step) == SPRINGLS_OK && springls_count(ctx) <= 20000) {
        count = springls_count(ctx);
        for (i = 0; i < count; i++) {
            springls__v3 a = fixture_origin(ctx, i);
            for (m = 0; m < 3; m++) {
                springls__v3 q = fixture_vertex(ctx, i, m);
                memcpy(vertices + 9 * i + 3 * m, &q.x, sizeof q);
            }
            origins[3 * i] = a.x + 0.25f;
            origins[3 * i + 1] = a.y;
            origins[3 * i + 2] = a.z;
        }
        if (springls_set_springls(ctx, vertices, NULL, origins, count) == SPRINGLS_OK && springls_step(ctx, &s.step) == SPRINGLS_OK)
            hash = scenario_mesh(ctx);
    }
    springls_destroy(ctx);
    return hash;
}

/* A step of a scenario on the device and one without it leave blocks of the same bytes. */
TEST snapshots_are_equal(int which)
{
    scenario s[2];
    springls_context *ctx[2];
    int i, k;
    NEEDS_DEVICE();
    for (k = 0; k < 2; k++) {
        scenario_make(&s[k], which);
        ctx[k] = scenario_context(&s[k], k ? test_device : NULL);
        ASSERT(ctx[k] != NULL);
    }
    for (i = 0; i < s[0].steps; i++) {
        void *block[2];
        size_t size[2];
        for (k = 0; k < 2; k++) {
            ASSERT_OK(scenario_step(ctx[k], &s[k]));
            ASSERT_OK(springls_snapshot(ctx[k], SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size[k]));
            block[k] = malloc(size[k]);
            ASSERT_OK(springls_snapshot(ctx[k], SPRINGLS_SNAPSHOT_KIND_ALL, block[k], size[k], &size[k]));
        }
        ASSERT_EQ(size[0], size[1]);
        ASSERT(memcmp(block[0], block[1], size[0]) == 0);
        free(block[0]);
        free(block[1]);
    }
    for (k = 0; k < 2; k++) springls_destroy(ctx[k]);
    PASS();
}

TEST springls_are_taken_afresh(void)
{
    uint64_t hash;
    NEEDS_DEVICE();
    hash = scenario_of_springls(test_device);
    ASSERT(hash != 0);
    ASSERT(hash == scenario_of_springls(NULL));
    PASS();
}

SUITE(scenarios)
{
    static const struct {
        const char *name;
        springls_status (*disturb)(springls_context *ctx, scenario *s, int step);
        bool changes_nothing;
    } between[] = {{"questions", disturb_with_questions, true},    {"views", disturb_with_views, true},
                   {"parameters", disturb_with_parameters, false}, {"modes", disturb_with_modes, false},
                   {"inputs", disturb_with_inputs, false},         {"callbacks", disturb_with_callbacks, false},
                   {"writes", disturb_with_writes, false}};
    size_t i;
    for (i = 0; i < SCENARIOS; i++) {
        greatest_set_test_suffix(scenario_name((int)i));
        RUN_TESTp(same_bits_from_run_to_run, (int)i);
    }
    RUN_TEST(two_contexts_on_one_backend);
    for (i = 0; i < sizeof between / sizeof *between; i++) {
        greatest_set_test_suffix(between[i].name);
        RUN_TESTp(what_happens_between_steps, between[i].disturb, between[i].changes_nothing);
    }
    RUN_TEST(queries_are_equal);
    RUN_TEST(springls_are_taken_afresh);
    for (i = 0; i < SCENARIOS; i++) {
        greatest_set_test_suffix(scenario_name((int)i));
        RUN_TESTp(snapshots_are_equal, (int)i);
    }
}

SUITE(kernels)
{
    int i;
    memset(&watch, 0, sizeof watch);
    for (i = 0; i < SCENARIOS; i++) {
        greatest_set_test_suffix(scenario_name(i));
        RUN_TESTp(every_run_has_the_scalar_bits, i);
    }
    for (i = 0; i < SPRINGLS__KERNEL_COUNT; i++) {
        if (i == SPRINGLS__KERNEL_mark_outside) continue; /* no scenario has springls outside all bricks */
        greatest_set_test_suffix(springls__kernels[i].name);
        RUN_TESTp(every_kernel_was_seen_to_write_what_it_lists, i);
    }
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    scenarios_begin();
    RUN_SUITE(kernels);
    RUN_SUITE(scenarios);
    springls_cl_destroy(test_device);
    GREATEST_MAIN_END();
}
