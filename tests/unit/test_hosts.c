/* test_hosts.c - programs that do odd things around a model: job systems of any order, callbacks that return nonsense, cancel, look
   at their model or use another, memory of plain alignment, steps of any length, grids of any size with a surface at their
   border, arguments out of range. */
#include "fixtures.h"

/* ---- job systems ---- */

typedef struct host_jobs { int order, calls; uint32_t random; } host_jobs;
enum { JOBS_WHOLE, JOBS_REVERSED, JOBS_SHUFFLED, JOBS_RECURSIVE, JOBS_KINDS };

/* Halves the range and does the second half first, each half by a call of itself. */
static void halve(int begin, int end, springls_task task, void *arg)
{
    if (end - begin > 1) {
        const int middle = begin + (end - begin) / 2;
        halve(middle, end, task, arg);
        halve(begin, middle, task, arg);
    } else if (end > begin) task(arg, begin, end);
}

static void odd_parallel_for(void *user, int count, int grain, springls_task task, void *arg)
{
    host_jobs *jobs = (host_jobs *)user;
    int i;
    (void)grain;
    jobs->calls++;
    if (jobs->order == JOBS_WHOLE) task(arg, 0, count);
    else if (jobs->order == JOBS_RECURSIVE) halve(0, count, task, arg);
    else if (jobs->order == JOBS_REVERSED)
        for (i = count; i > 0; i--) task(arg, i - 1, i);
    else { /* begins somewhere, and takes every 7919th: a prime larger than most counts */
        int step = count % 7919 ? 7919 % count : 1, at = (int)(jobs->random++ % (uint32_t)(count > 0 ? count : 1));
        if (step == 0) step = 1;
        for (i = 0; i < count; i++, at = (int)(((int64_t)at + step) % count)) task(arg, at, at + 1);
    }
}

static uint64_t whirled(const springls_tasks *tasks, springls_mode mode)
{
    springls_desc desc = fixture_desc(24, NULL);
    struct exact_flow whirl = EXACT_DEFORMATION(24.0f, 2.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &whirl);
    springls_step_desc step = fixture_step(&forces, mode, 0.12f);
    springls_sphere ball = fixture_ball(9.0f, 9.0f, 9.0f, 4.5f);
    springls_context *ctx = NULL;
    uint64_t hash = 0;
    int i;
    if (tasks) desc.tasks = *tasks;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 0;
    springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    for (i = 0; i < 3; i++)
        if (springls_step(ctx, &step) != SPRINGLS_OK) break;
    if (i == 3) hash = springls_state_hash(ctx);
    springls_destroy(ctx);
    return hash;
}

TEST jobs_run_in_any_order(springls_mode mode)
{
    const uint64_t expected = whirled(NULL, mode);
    host_jobs jobs;
    springls_tasks tasks = { odd_parallel_for, &jobs };
    ASSERT(expected != 0);
    memset(&jobs, 0, sizeof jobs);
    for (jobs.order = 0; jobs.order < JOBS_KINDS; jobs.order++) ASSERT(whirled(&tasks, mode) == expected);
    ASSERT_GT(jobs.calls, 20);
    PASS();
}

/* ---- what has to hold after anything ---- */

static greatest_test_res check_whole(springls_context *ctx)
{
    springls_view vertices = springls_view_vertices(ctx);
    springls_mesh mesh;
    int i, k;
    for (i = 0; i < vertices.count; i++)
        for (k = 0; k < 3; k++) ASSERT(d3_length(d3_of(fixture_at(vertices, i, k))) < 1e12);
    ASSERT_OK(springls_extract_mesh(ctx, &mesh));
    if (mesh.vertex_count) {
        springls__mesh_report report = fixture_report(&mesh);
        ASSERT_EQ(0, report.boundary_edges);
        ASSERT_EQ(0, report.misoriented_edges);
    }
    springls_mesh_free(ctx, &mesh);
    PASS();
}

/* ---- callbacks that return nonsense ---- */

typedef struct host_force { float value; int after; springls_context *other; } host_force; /* the numbers after so many points */

static void odd_numbers(host_force *force, float *out, int count, int channels)
{
    int i;
    for (i = 0; i < count * channels; i++) out[i] = i / channels < force->after ? 0.01f : force->value;
}

static void odd_pressure(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    (void)points, (void)normals, (void)time;
    odd_numbers((host_force *)user, out, count, 1);
}

static void odd_velocity(void *user, const float *points, int count, float time, float *out)
{
    (void)points, (void)time;
    odd_numbers((host_force *)user, out, count, 3);
}

static void odd_affine(void *user, const float *points, const float *correspondences, int count, float time, float *out)
{
    (void)points, (void)correspondences, (void)time;
    odd_numbers((host_force *)user, out, count, 12);
}

static void odd_pressure_batch(void *user, const springls_batch *batch, float *out)
{
    odd_numbers((host_force *)user, out, batch->count, 1);
}

static void odd_velocity_batch(void *user, const springls_batch *batch, float *out)
{
    odd_numbers((host_force *)user, out, batch->count, 3);
}

static void odd_affine_batch(void *user, const springls_batch *batch, float *out)
{
    odd_numbers((host_force *)user, out, batch->count, 12);
}


enum { CALLBACKS = 6 };

static springls_forces odd_forces(int callback, host_force *force)
{
    springls_forces forces = fixture_forces(NULL, force);
    if (callback == 0) forces.pressure = odd_pressure;
    if (callback == 1) forces.velocity = odd_velocity;
    if (callback == 2) forces.affine = odd_affine;
    if (callback == 3) forces.pressure_batch = odd_pressure_batch;
    if (callback == 4) forces.velocity_batch = odd_velocity_batch;
    if (callback == 5) forces.affine_batch = odd_affine_batch;
    return forces;
}

/* Not finite: the step fails, and the model is as it was. Huge: it fails, or the model is whole, wherever it has gone. */
TEST callbacks_return_nonsense(springls_mode mode)
{
    static const float values[] = { NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, 1e30f, 1e12f, -1e6f, 3e3f, FLT_MIN, 1e-45f };
    int callback;
    size_t v;
    for (callback = 0; callback < CALLBACKS; callback++)
        for (v = 0; v < sizeof values / sizeof *values; v++) {
            springls_context *ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
            host_force force = { values[v], (int)(v % 3) * 20, NULL };
            springls_forces forces = odd_forces(callback, &force);
            springls_step_desc step = fixture_step(&forces, mode, 1.0f);
            uint64_t before = springls_state_hash(ctx);
            springls_status status;
            step.max_displacement = v % 2 ? 2.0f : -1.0f;
            status = springls_step(ctx, &step);
            if (!isfinite(values[v])) ASSERT_STATUS(SPRINGLS_NON_FINITE, status);
            if (status == SPRINGLS_NON_FINITE || status == SPRINGLS_INVALID_ARGUMENT) {
                ASSERT(strlen(springls_last_error(ctx)) > 10);
                ASSERT(before == springls_state_hash(ctx) || step.max_displacement > 0.0f);
            } else ASSERT(status == SPRINGLS_OK || status == SPRINGLS_EMPTY_MODEL);
            CHECK_CALL(check_whole(ctx));
            force.value = 0.01f;
            ASSERT(springls_count(ctx) == 0 || springls_step(ctx, &step) == SPRINGLS_OK);
            springls_destroy(ctx);
        }
    PASS();
}

/* A shape function: not a number is refused, all else makes a model or none. */
static void odd_shape(void *user, const float *points, int count, float *out)
{
    host_force *force = (host_force *)user;
    springls_sphere ball = fixture_ball(7.5f, 7.5f, 7.5f, 3.5f);
    int i;
    springls_implicit_sphere(&ball, points, count, out);
    for (i = force->after; i < count; i += 5) out[i] = force->value;
}

TEST shapes_return_nonsense(void)
{
    static const float values[] = { NAN, INFINITY, -INFINITY, FLT_MAX, -FLT_MAX, 1e30f, 1e-45f, 0.0f };
    size_t v;
    for (v = 0; v < sizeof values / sizeof *values; v++) {
        springls_context *ctx = fixture_context(16, NULL);
        host_force force = { values[v], 3, NULL };
        springls_status status = springls_set_implicit(ctx, odd_shape, &force);
        if (isnan(values[v])) ASSERT_STATUS(SPRINGLS_NON_FINITE, status);
        ASSERT(status == SPRINGLS_OK || springls_count(ctx) == 0);
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_NON_FINITE || status == SPRINGLS_EMPTY_MODEL);
        CHECK_CALL(check_whole(ctx));
        springls_destroy(ctx);
    }
    PASS();
}

/* A shape with a number that is not finite is refused, whichever it is. */
TEST shapes_are_finite(float bad)
{
    const float box[6] = { 8, 8, 8, 4, 3, 4 }, torus[8] = { 8, 8, 8, 0, 0, 1, 4, 2 }, notched[6] = { 8, 8, 8, 5, 2, 6 };
    const struct {
        springls_implicit_fn shape;
        const float *numbers;
        int count;
    } shapes[] = {{springls_implicit_box, box, 6}, {springls_implicit_torus, torus, 8},
                  {springls_implicit_notched_sphere, notched, 6}, {springls_implicit_sphere, notched, 4}};
    size_t s;
    int k;
    for (s = 0; s < sizeof shapes / sizeof *shapes; s++)
        for (k = 0; k < shapes[s].count; k++) {
            springls_context *ctx = fixture_context(16, NULL);
            float numbers[8];
            memcpy(numbers, shapes[s].numbers, (size_t)shapes[s].count * sizeof *numbers);
            ASSERT_OK(springls_set_implicit(ctx, shapes[s].shape, numbers));
            numbers[k] = bad;
            ASSERT_STATUS(SPRINGLS_NON_FINITE, springls_set_implicit(ctx, shapes[s].shape, numbers));
            springls_destroy(ctx);
        }
    PASS();
}

/* A velocity that is not a number in one call only. */
typedef struct host_count { int calls, bad; } host_count;

static void odd_once(void *user, const float *points, int count, float time, float *out)
{
    host_count *at = (host_count *)user;
    float wind[3] = { 0.3f, 0.1f, -0.2f };
    fixture_wind(wind, points, count, time, out);
    if (at->calls++ == at->bad) out[3 * (count - 1) + 2] = NAN;
}

/* Whichever call of the callback it is: the step fails, the model is whole, and a step without it goes on; where there is one
   sub-step, from the bits of before. */
TEST a_callback_fails_at_any_call(springls_mode mode, int substeps)
{
    host_count at = { 0, 0 };
    springls_forces forces = fixture_forces(odd_once, &at);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    springls_status status = SPRINGLS_NON_FINITE;
    if (substeps > 1) step.max_displacement = 0.4f / (float)substeps;
    for (at.bad = 0; status == SPRINGLS_NON_FINITE; at.bad++) {
        springls_context *ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f), *alone;
        uint64_t before = springls_state_hash(ctx);
        at.calls = 0;
        status = springls_step(ctx, &step);
        if (status != SPRINGLS_OK) {
            ASSERT_STATUS(SPRINGLS_NON_FINITE, status);
            ASSERT_GTE(at.calls, at.bad + 1);
            ASSERT(substeps > 1 || springls_state_hash(ctx) == before);
        }
        CHECK_CALL(check_whole(ctx));
        if (substeps == 1 && status != SPRINGLS_OK) { /* now as if nothing had been */
            alone = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
            at.calls = at.bad + 1;
            ASSERT_OK(springls_step(ctx, &step));
            at.calls = at.bad + 1;
            ASSERT_OK(springls_step(alone, &step));
            ASSERT(springls_state_hash(ctx) == springls_state_hash(alone));
            springls_destroy(alone);
        } else if (status != SPRINGLS_OK) ASSERT_OK(springls_step(ctx, &step));
        springls_destroy(ctx);
    }
    ASSERT_OK(status);
    ASSERT_GT(at.bad, substeps * 3);
    PASS();
}

/* ---- callbacks that look at the model they serve ---- */

typedef struct host_view { springls_context *ctx; int wrong; } host_view;

/* Counts, views and ids of the model that is being stepped. */
static void looking_velocity(void *user, const float *points, int count, float time, float *out)
{
    host_view *view = (host_view *)user;
    float wind[3] = { 0.3f, 0.1f, -0.2f };
    const springls_view particles = springls_view_particles(view->ctx);
    const int n = springls_count(view->ctx);
    view->wrong += n <= 0 || particles.count != n || !springls_ids(view->ctx) || count > n;
    fixture_wind(wind, points, count, time, out);
}

TEST a_callback_looks_at_its_model(springls_mode mode)
{
    float wind[3] = { 0.3f, 0.1f, -0.2f };
    host_view view = { NULL, 0 };
    springls_forces plain = fixture_forces(fixture_wind, wind), looking = fixture_forces(looking_velocity, &view);
    springls_step_desc step = fixture_step(&plain, mode, 1.0f), looking_step = fixture_step(&looking, mode, 1.0f);
    springls_context *alone = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    int i;
    view.ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    for (i = 0; i < 4; i++) {
        ASSERT_OK(springls_step(alone, &step));
        ASSERT_OK(springls_step(view.ctx, &looking_step));
    }
    ASSERT_EQ(0, view.wrong);
    ASSERT(springls_state_hash(alone) == springls_state_hash(view.ctx));
    springls_destroy(alone);
    springls_destroy(view.ctx);
    PASS();
}

/* ---- memory that is aligned as malloc's, and no better ---- */

/* Memory 16 bytes beyond a multiple of 64; before it stands where malloc's begins. */
static void *odd_alloc(size_t size, void *user)
{
    char *start = (char *)malloc(size + 128), *at;
    (void)user;
    if (!start) return NULL;
    at = start + 128 - (uintptr_t)start % 64 - 48;
    memcpy(at - sizeof start, &start, sizeof start);
    return at;
}

static void odd_free(void *memory, size_t size, void *user)
{
    char *start;
    (void)size, (void)user;
    memcpy(&start, (char *)memory - sizeof start, sizeof start);
    free(start);
}

TEST memory_is_aligned_as_mallocs(springls_mode mode)
{
    springls_desc desc = fixture_desc(16, NULL);
    float wind[3] = { 0.3f, 0.1f, -0.2f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, mode, 1.0f);
    springls_sphere ball = fixture_ball(7.5f, 7.5f, 7.5f, 3.5f);
    springls_context *ctx, *alone = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    int i;
    desc.allocator.alloc = odd_alloc;
    desc.allocator.free = odd_free;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    for (i = 0; i < 4; i++) {
        ASSERT_OK(springls_step(alone, &step));
        ASSERT_OK(springls_step(ctx, &step));
    }
    CHECK_CALL(check_whole(ctx));
    ASSERT(springls_state_hash(alone) == springls_state_hash(ctx));
    springls_destroy(alone);
    springls_destroy(ctx);
    PASS();
}

/* ---- callbacks that use another model ---- */

/* Steps another model, and queries it, once in every call; and looks at its own springls. */
static void busy_velocity(void *user, const float *points, int count, float time, float *out)
{
    host_force *force = (host_force *)user;
    struct exact_flow whirl = EXACT_DEFORMATION(16.0f, 2.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &whirl);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.02f);
    float distance[1];
    if (springls_step(force->other, &step) != SPRINGLS_OK) force->value = NAN;
    if (springls_sample_distance(force->other, points, 1, distance) != SPRINGLS_OK) force->value = NAN;
    exact_flow_velocity(&whirl, points, count, time, out);
    if (isnan(force->value)) out[0] = NAN;
}

TEST a_callback_uses_another_model(void)
{
    springls_context *alone = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    springls_context *busy = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    springls_context *other = fixture_sphere(16, NULL, 8.5f, 7.5f, 6.5f, 3.0f);
    struct exact_flow whirl = EXACT_DEFORMATION(16.0f, 2.0f);
    host_force force = { 0.0f, 0, NULL };
    springls_forces plain = fixture_forces(exact_flow_velocity, &whirl), forces = fixture_forces(busy_velocity, &force);
    springls_step_desc step = fixture_step(&plain, SPRINGLS_MODE_FLUID, 0.1f);
    springls_step_desc busy_step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    int i;
    force.other = other;
    for (i = 0; i < 3; i++) {
        ASSERT_OK(springls_step(alone, &step));
        ASSERT_OK(springls_step(busy, &busy_step));
    }
    ASSERT(springls_state_hash(alone) == springls_state_hash(busy));
    ASSERT_GT(springls_get_stats(other).steps, 8);
    CHECK_CALL(check_whole(other));
    springls_destroy(alone);
    springls_destroy(busy);
    springls_destroy(other);
    PASS();
}

/* ---- cancelling ---- */

typedef struct host_watch { int left, reports; } host_watch;

static int watch(void *user, float fraction)
{
    host_watch *w = (host_watch *)user;
    (void)fraction;
    w->reports++;
    return w->left-- == 0;
}

enum { CANCEL_MESH, CANCEL_IMPLICIT, CANCEL_COMBINE, CANCEL_OFFSET, CANCEL_RUN, CANCELS };

static springls_status long_call(springls_context *ctx, int call, const springls_mesh *mesh, const springls_step_desc *step)
{
    springls_sphere ball = fixture_ball(14.5f, 11.5f, 11.5f, 4.0f);
    switch (call) {
    case CANCEL_MESH:
        return springls_set_mesh(ctx, mesh->positions, mesh->vertex_count, 0, mesh->triangles, mesh->triangle_count, NULL);
    case CANCEL_IMPLICIT: return springls_set_implicit(ctx, springls_implicit_sphere, &ball);
    case CANCEL_COMBINE: return springls_combine_implicit(ctx, SPRINGLS_OPERATION_UNION, springls_implicit_sphere, &ball);
    case CANCEL_OFFSET: return springls_offset(ctx, 1.5f);
    default: return springls_run(ctx, step, 5);
    }
}

/* At each report in turn: an input is empty then, a run has done whole steps, and the call succeeds when it is made again. */
TEST a_call_is_cancelled_anywhere(int call)
{
    springls_desc desc = fixture_desc(24, NULL);
    springls_context *maker = fixture_sphere(24, NULL, 9.5f, 11.5f, 11.5f, 5.0f), *ctx;
    struct exact_flow whirl = EXACT_DEFORMATION(24.0f, 2.0f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &whirl);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 0.1f);
    springls_mesh mesh;
    fixture_heap heap;
    host_watch w = { -1, 0 };
    int at, reports;
    ASSERT_OK(springls_extract_mesh(maker, &mesh));
    desc.allocator = fixture_allocator(&heap);
    desc.progress.report = watch;
    desc.progress.user = &w;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(long_call(ctx, CANCEL_MESH, &mesh, &step));
    w.reports = 0;
    ASSERT_OK(long_call(ctx, call, &mesh, &step));
    reports = w.reports;
    ASSERT_GT(reports, 3);
    for (at = 0; at < reports; at += 1 + reports / 6) {
        springls_status status;
        w.left = -1;
        ASSERT_OK(long_call(ctx, CANCEL_MESH, &mesh, &step));
        w.left = at;
        w.reports = 0;
        status = long_call(ctx, call, &mesh, &step);
        if (at == reports - 1 && status == SPRINGLS_OK) break; /* the last report: nothing is left to cancel */
        ASSERT_STATUS(SPRINGLS_CANCELLED, status);
        ASSERT_EQ(at + 1, w.reports);
        ASSERT(strlen(springls_last_error(ctx)) > 0);
        if (call == CANCEL_RUN) ASSERT_EQ(at + 1, springls_get_stats(ctx).steps);
        if (call == CANCEL_MESH || call == CANCEL_IMPLICIT) ASSERT_EQ(0, springls_count(ctx));
        CHECK_CALL(check_whole(ctx));
        w.left = -1;
        ASSERT_OK(long_call(ctx, CANCEL_MESH, &mesh, &step));
        ASSERT_OK(long_call(ctx, call, &mesh, &step));
    }
    springls_mesh_free(maker, &mesh);
    springls_destroy(maker);
    springls_destroy(ctx);
    ASSERT_EQ(0, heap.blocks);
    PASS();
}

/* ---- steps of any length ---- */

/* Thirteen decades of time. A step is done, or refused with the model as it was. */
TEST steps_of_any_length(springls_mode mode, int paper)
{
    springls_params params = paper ? springls_paper_params() : springls_default_params();
    int decade, divided;
    for (decade = -6; decade <= 6; decade += mode == SPRINGLS_MODE_ELASTIC ? 3 : 1)
        for (divided = 0; divided < 2; divided++) {
            springls_context *ctx = fixture_sphere(16, &params, 7.5f, 7.5f, 7.5f, 3.5f);
            struct exact_flow turn = EXACT_ROTATION(7.5f, 7.5f, 7.5f, 0.0f, 0.6f, 0.8f, 1e-4f);
            springls_forces forces = fixture_forces(exact_flow_velocity, &turn);
            springls_step_desc step = fixture_step(&forces, mode, (float)pow(10.0, decade));
            uint64_t before = springls_state_hash(ctx);
            springls_status status;
            int i;
            step.max_displacement = divided ? 0.0f : -1.0f;
            for (i = 0; i < 3; i++) {
                status = springls_step(ctx, &step);
                if (status == SPRINGLS_INVALID_ARGUMENT && i == 0) ASSERT(before == springls_state_hash(ctx));
                ASSERT(status == SPRINGLS_OK || status == SPRINGLS_INVALID_ARGUMENT || status == SPRINGLS_NON_FINITE
                       || (status == SPRINGLS_EMPTY_MODEL && springls_count(ctx) == 0));
                if (decade < 4) ASSERT_OK(status);
            }
            CHECK_CALL(check_whole(ctx));
            if (decade < 4) ASSERT_GT(springls_count(ctx), 50);
            springls_destroy(ctx);
        }
    PASS();
}

/* ---- grids of any size ---- */

/* A slanted plane that leaves the grid through all of its sides but two. */
static void slope(void *user, const float *points, int count, float *out)
{
    const float *size = (const float *)user;
    int i;
    for (i = 0; i < count; i++)
        out[i] = 0.6f * (points[3 * i] - 0.5f * size[0]) + 0.5f * (points[3 * i + 1] - 0.5f * size[1])
                 + 0.6245f * (points[3 * i + 2] - 0.4f * size[2]);
}

TEST surfaces_at_the_border(int axis, int length)
{
    springls_desc desc = fixture_desc(length > 1000 ? 4 : 9, NULL);
    springls_context *ctx;
    springls_measures measures;
    springls_forces forces;
    springls_step_desc step;
    springls_box box;
    float size[3], wind[3] = { 0.3f, 0.2f, -0.1f };
    int k, shape;
    desc.grid.size[axis] = length;
    for (k = 0; k < 3; k++) size[k] = (float)desc.grid.size[k];
    forces = fixture_forces(fixture_wind, wind);
    step = fixture_step(&forces, SPRINGLS_MODE_FLUID, length > 1000 ? 6.0f : 1.0f); /* longer: phi follows */
    for (k = 0; k < 3; k++) {
        box.center[k] = 0.5f * size[k] - 0.5f;
        box.half[k] = 0.5f * size[k] - 0.6f; /* just inside the outermost centres */
    }
    ASSERT_OK(springls_create(&desc, &ctx));
    for (shape = length > 1000; shape < 2; shape++) {
        ASSERT_OK(shape ? springls_set_implicit(ctx, springls_implicit_box, &box) : springls_set_implicit(ctx, slope, size));
        CHECK_CALL(check_whole(ctx));
        for (k = 0; k < (length > 1000 ? 1 : 3); k++) {
            springls_status status = springls_step(ctx, &step);
            ASSERT(status == SPRINGLS_OK || status == SPRINGLS_EMPTY_MODEL);
        }
        CHECK_CALL(check_whole(ctx));
        ASSERT_OK(springls_measure(ctx, &measures));
        ASSERT(measures.volume >= 0.0 && measures.volume < (double)size[0] * (double)size[1] * (double)size[2]);
    }
    springls_destroy(ctx);
    PASS();
}

/* Springls that are blown out of the grid are counted, to the last one. */
TEST what_leaves_is_counted(int paper)
{
    springls_params params = paper ? springls_paper_params() : springls_default_params();
    springls_context *ctx = fixture_sphere(24, &params, 11.5f, 11.5f, 11.5f, 5.0f);
    float wind[3] = { 1.5f, 0.0f, 0.0f };
    springls_forces forces = fixture_forces(fixture_wind, wind);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, paper ? 0.3f : 1.0f);
    springls_stats stats, restored;
    void *snapshot;
    size_t size;
    int i;
    springls_status status = SPRINGLS_OK;
    for (i = 0; i < 200 && springls_get_stats(ctx).left == 0 && status == SPRINGLS_OK; i++) status = springls_step(ctx, &step);
    ASSERT_OK(status);
    stats = springls_get_stats(ctx);
    ASSERT_LTE(stats.left, stats.removed);
    ASSERT_GT(springls_count(ctx), 100);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    snapshot = malloc(size);
    ASSERT_OK(springls_snapshot(ctx, SPRINGLS_SNAPSHOT_KIND_ALL, snapshot, size, &size));
    for (i = 0; i < 200 && status == SPRINGLS_OK && springls_count(ctx) > 0; i++) status = springls_step(ctx, &step);
    ASSERT_EQ(0, springls_count(ctx));
    ASSERT_GT(springls_get_stats(ctx).left, stats.left + 100);
    ASSERT_OK(springls_restore(ctx, snapshot, size));
    restored = springls_get_stats(ctx);
    ASSERT_EQ(stats.left, restored.left);
    free(snapshot);
    springls_destroy(ctx);
    PASS();
}

/* ---- arguments out of range ---- */

/* The sentence of a refusal has the value that was given and the range that is allowed. */
static greatest_test_res gives_range(springls_context *ctx, springls_status status, const char *value, const char *range)
{
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, status);
    if (!strstr(springls_last_error(ctx), value) || !strstr(springls_last_error(ctx), range))
        printf("\n  \"%s\" lacks \"%s\" or \"%s\"\n", springls_last_error(ctx), value, range);
    ASSERT(strstr(springls_last_error(ctx), value) != NULL);
    ASSERT(strstr(springls_last_error(ctx), range) != NULL);
    PASS();
}

TEST refusals_give_the_range(void)
{
    springls_context *ctx = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.5f);
    springls_context *other = fixture_sphere(16, NULL, 7.5f, 7.5f, 7.5f, 3.0f);
    const float x[9] = { 5, 5, 5, 9, 5, 5, 5, 9, 5 };
    const int triangle[3] = { 0, 1, 2 };
    springls_step_desc step = fixture_step(NULL, SPRINGLS_MODE_FLUID, 1.0f);
    springls_attribute_desc attribute = { "heat", 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_COPY };
    springls_chunks_desc chunks_desc = { .tolerance = 0.7f };
    springls_forces forces = springls_default_forces();
    springls_chunks *chunks;
    springls_hit hit;
    size_t size;
    float speed;
    bool done;
    int neighbors[3];
    uint64_t before = springls_state_hash(ctx);
    CHECK_CALL(gives_range(ctx, springls_set_mesh(ctx, x, -3, 0, triangle, 1, NULL), "-3", "0 to"));
    CHECK_CALL(gives_range(ctx, springls_set_mesh(ctx, x, 3, 7, triangle, 1, NULL), "7 bytes", "multiple of 4 from 12 on"));
    CHECK_CALL(gives_range(ctx, springls_find_seams(ctx, x, 3, 0, triangle, 1, NULL, 2000, neighbors), "2000", "0 to 1024"));
    CHECK_CALL(gives_range(ctx, springls_find_seams(ctx, x, 3, 0, triangle, -1, NULL, 0, neighbors), "-1", "0 to"));
    CHECK_CALL(gives_range(ctx, springls_find_seams(ctx, x, 3, 6, triangle, 1, NULL, 0, neighbors), "6 bytes", "from 12 on"));
    CHECK_CALL(gives_range(ctx, springls_set_springls(ctx, x, NULL, NULL, -2), "-2", "not positive"));
    CHECK_CALL(gives_range(ctx, springls_write(ctx, 5, 1 << 30, x, NULL), "1073741824 springls from 5", "of "));
    CHECK_CALL(gives_range(ctx, springls_offset(ctx, 2e5f), "200000", "10^4"));
    CHECK_CALL(gives_range(ctx, springls_smooth(ctx, -1.0f, false), "-1", "0 to below 1000"));
    CHECK_CALL(gives_range(ctx, springls_combine(ctx, (springls_operation)7, other), "7", "0 to 2"));
    CHECK_CALL(gives_range(ctx, springls_closest(ctx, (springls_surface)3, x, 1, &hit), "3", "0 or 1"));
    CHECK_CALL(gives_range(ctx, springls_closest(ctx, SPRINGLS_SURFACE_SOUP, x, -4, &hit), "-4", "negative"));
    CHECK_CALL(gives_range(ctx, springls_raycast(ctx, SPRINGLS_SURFACE_SOUP, x, x, 1, -2.0f, &hit), "-2", "0 or more"));
    CHECK_CALL(gives_range(ctx, springls_snapshot(ctx, (springls_snapshot_kind)9, NULL, 0, &size), "9", "0 or 1"));
    CHECK_CALL(gives_range(ctx, springls_chunks_create(ctx, &chunks_desc, &chunks), "0.7", "at most half a voxel"));
    CHECK_CALL(gives_range(ctx, springls_set_attribute(ctx, 4, x), "4", "among 0"));
    attribute.channels = 5000;
    CHECK_CALL(gives_range(ctx, springls_add_attribute(ctx, &attribute, NULL, NULL), "5000", "1 to 1024"));
    attribute.channels = 1;
    attribute.fill = (springls_policy)8;
    CHECK_CALL(gives_range(ctx, springls_add_attribute(ctx, &attribute, NULL, NULL), "8", "0 to 2"));
    CHECK_CALL(gives_range(ctx, springls_run_stage(ctx, SPRINGLS_STAGE_ADVECT), "stage 0", "1 to 8"));
    CHECK_CALL(gives_range(ctx, springls_run_stage(ctx, SPRINGLS_STAGE_COUNT), "13", "1 to 8"));
    step.mode = (springls_mode)6;
    CHECK_CALL(gives_range(ctx, springls_step(ctx, &step), "6", "0 to 2"));
    step.mode = SPRINGLS_MODE_FLUID;
    step.max_displacement = 1e-5f;
    CHECK_CALL(gives_range(ctx, springls_step(ctx, &step), "1e-05", "a thousandth of a voxel"));
    step.max_displacement = 0.0f;
    forces.integrator = (springls_integrator)4;
    CHECK_CALL(gives_range(ctx, springls_advect(ctx, &forces, 0.0f, 1.0f), "4", "it may be 0 or 1"));
    forces.integrator = SPRINGLS_INTEGRATOR_RK4;
    CHECK_CALL(gives_range(ctx, springls_advect(ctx, &forces, 0.0f, NAN), "dt is", "not finite"));
    CHECK_CALL(gives_range(ctx, springls_advect(ctx, &forces, (float)HUGE_VAL, 1.0f), "time is inf", "not finite"));
    CHECK_CALL(gives_range(ctx, springls_max_speed(ctx, &forces, NAN, &speed), "time is", "not finite"));
    forces.region_lower[1] = 8.0f;
    CHECK_CALL(gives_range(ctx, springls_advect(ctx, &forces, 0.0f, 1.0f), "from 8 to 0 along axis 1", "ascending and finite"));
    CHECK_CALL(gives_range(ctx, springls_step_continue(ctx, NAN, &done), "seconds", "NaN"));
    step.dt = -2.0f;
    CHECK_CALL(gives_range(ctx, springls_step(ctx, &step), "dt is -2", "0 or more and finite"));
    step.dt = 1.0f;
    CHECK_CALL(gives_range(ctx, springls_run(ctx, &step, -1), "-1", "0 or more"));
    ASSERT(before == springls_state_hash(ctx));
    springls_destroy(ctx);
    springls_destroy(other);
    PASS();
}

SUITE(hosts)
{
    static const int lengths[] = { 4, 5, 7, 8, 15, 16, 17, 63 };
    int mode, axis;
    size_t i;
    for (mode = 0; mode < 3; mode++) {
        RUN_TESTp(callbacks_return_nonsense, (springls_mode)mode);
        RUN_TESTp(a_callback_fails_at_any_call, (springls_mode)mode, 1);
        RUN_TESTp(a_callback_fails_at_any_call, (springls_mode)mode, 3);
        RUN_TESTp(a_callback_looks_at_its_model, (springls_mode)mode);
        RUN_TESTp(memory_is_aligned_as_mallocs, (springls_mode)mode);
        RUN_TESTp(steps_of_any_length, (springls_mode)mode, 0);
    }
    RUN_TESTp(steps_of_any_length, SPRINGLS_MODE_FLUID, 1);
    RUN_TESTp(jobs_run_in_any_order, SPRINGLS_MODE_FLUID);
    RUN_TESTp(jobs_run_in_any_order, SPRINGLS_MODE_ELASTIC);
    RUN_TEST(shapes_return_nonsense);
    RUN_TESTp(shapes_are_finite, NAN);
    RUN_TESTp(shapes_are_finite, INFINITY);
    RUN_TEST(a_callback_uses_another_model);
    for (i = 0; i < CANCELS; i++) RUN_TESTp(a_call_is_cancelled_anywhere, (int)i);
    for (axis = 0; axis < 3; axis++)
        for (i = 0; i < sizeof lengths / sizeof *lengths; i++) RUN_TESTp(surfaces_at_the_border, axis, lengths[i]);
    RUN_TESTp(surfaces_at_the_border, 1, 255);
    RUN_TESTp(surfaces_at_the_border, 2, 4096);
    RUN_TESTp(what_leaves_is_counted, 0);
    RUN_TESTp(what_leaves_is_counted, 1);
    RUN_TEST(refusals_give_the_range);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_SUITE(hosts);
    GREATEST_MAIN_END();
}
