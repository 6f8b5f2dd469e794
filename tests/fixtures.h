/* fixtures.h - what the tests of the stages share: models in a line, random numbers that are the same everywhere, an
   allocator that counts and fails on demand, job systems that cut work in odd ways, and oracles in double precision.
   Private functions of the library whose shape may change are called here, and as little as possible in the tests.

   A test is linked with the library (library.c). A test of private functions includes the part that holds them, before this
   file, and so has copies of them. A test that includes springls_under_test.h first has all of the library as its own. */
#ifndef FIXTURES_H
#define FIXTURES_H

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "greatest.h"
#include "parts_under_test.h"
#include "../examples/common/springls/exact_flows.h"

#include "dirty_memory.h"

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#define FIXTURE_THREADS 1
#else
#define FIXTURE_THREADS 0
#endif

#if defined(__GNUC__)
#define FIXTURE __attribute__((unused)) static inline
#else
#define FIXTURE static
#endif

/* Leaves the test unless the call returns the expected status; prints both. */
#define ASSERT_STATUS(expected, call) \
    do { \
        springls_status fixture_status = (call); \
        if (fixture_status != (expected)) \
            printf("\n  expected %s, got %s\n", springls_status_string(expected), springls_status_string(fixture_status)); \
        ASSERTm(#call " gives " #expected, fixture_status == (expected)); \
    } while (0)
#define ASSERT_OK(call) ASSERT_STATUS(SPRINGLS_OK, call)

static const double fixture_pi = 3.14159265358979323846;

/* ---- random numbers ---- */

static uint32_t fixture_state = 1u;

FIXTURE void fixture_seed(uint32_t seed) { fixture_state = seed * 2654435761u + 12345u; }

FIXTURE uint32_t fixture_bits(void) /* 24 good ones */
{
    fixture_state = fixture_state * 1664525u + 1013904223u;
    return fixture_state >> 8;
}

FIXTURE float fixture_between(float low, float high) { return low + (high - low) * (float)fixture_bits() / 16777216.0f; }

FIXTURE springls__v3 fixture_point(float low, float high)
{
    float x = fixture_between(low, high), y = fixture_between(low, high);
    return springls__v3_make(x, y, fixture_between(low, high));
}

FIXTURE springls__v3 fixture_direction(void)
{
    springls__v3 v = fixture_point(-1.0f, 1.0f);
    while (springls__length2(v) > 1.0f || springls__length2(v) < 0.01f) v = fixture_point(-1.0f, 1.0f);
    return springls__normalize(v);
}

/* ---- double precision ---- */

typedef struct d3 { double x, y, z; } d3;

FIXTURE d3 d3_make(double x, double y, double z) { d3 v; v.x = x; v.y = y; v.z = z; return v; }
FIXTURE d3 d3_of(springls__v3 v) { return d3_make((double)v.x, (double)v.y, (double)v.z); }
FIXTURE d3 d3_add(d3 a, d3 b) { return d3_make(a.x + b.x, a.y + b.y, a.z + b.z); }
FIXTURE d3 d3_sub(d3 a, d3 b) { return d3_make(a.x - b.x, a.y - b.y, a.z - b.z); }
FIXTURE d3 d3_scale(d3 a, double s) { return d3_make(a.x * s, a.y * s, a.z * s); }
FIXTURE d3 d3_mad(d3 a, d3 b, double s) { return d3_add(a, d3_scale(b, s)); }
FIXTURE double d3_dot(d3 a, d3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
FIXTURE d3 d3_cross(d3 a, d3 b) { return d3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); }
FIXTURE double d3_length(d3 a) { return sqrt(d3_dot(a, a)); }
FIXTURE double d3_distance(d3 a, d3 b) { return d3_length(d3_sub(a, b)); }

/* Returns v turned by |w| radians about w. */
FIXTURE d3 d3_rotate(d3 v, d3 w)
{
    double angle = d3_length(w);
    d3 axis;
    if (angle < 1e-300) return v;
    axis = d3_scale(w, 1.0 / angle);
    return d3_add(d3_add(d3_scale(v, cos(angle)), d3_scale(d3_cross(axis, v), sin(angle))),
                  d3_scale(axis, d3_dot(axis, v) * (1.0 - cos(angle))));
}

FIXTURE springls__v3 d3_float(d3 v) { return springls__v3_make((float)v.x, (float)v.y, (float)v.z); }

/* Returns the point of segment a-b closest to x. */
FIXTURE d3 d3_on_segment(d3 x, d3 a, d3 b)
{
    d3 e = d3_sub(b, a);
    double l2 = d3_dot(e, e), s = l2 > 0.0 ? d3_dot(d3_sub(x, a), e) / l2 : 0.0;
    return d3_mad(a, e, s < 0.0 ? 0.0 : s > 1.0 ? 1.0 : s);
}

/* Returns the distance from x to triangle t. */
FIXTURE double d3_triangle_distance(const d3 t[3], d3 x)
{
    d3 n = d3_cross(d3_sub(t[1], t[0]), d3_sub(t[2], t[0]));
    double n2 = d3_dot(n, n), best = DBL_MAX;
    int m, inside = n2 > 0.0;
    for (m = 0; m < 3; m++) {
        d3 a = t[m], b = t[(m + 1) % 3];
        double d = d3_distance(x, d3_on_segment(x, a, b));
        if (d < best) best = d;
        if (d3_dot(d3_cross(d3_sub(b, a), d3_sub(x, a)), n) < 0.0) inside = 0;
    }
    return inside ? fabs(d3_dot(d3_sub(x, t[0]), n)) / sqrt(n2) : best;
}

/* ---- memory: counted, sizes checked, failing on demand ---- */

typedef struct fixture_heap {
    size_t bytes;           /* held now                                                    */
    int blocks, calls;      /* held now; allocated so far, with those that failed          */
    int fail_at;            /* the call that fails, counted from 0; -1: none               */
    int fail_on;            /* 1: all later calls fail too                                 */
    int wrong_sizes;        /* frees whose size was not the one allocated                  */
    unsigned char *pattern; /* of dirty_memory.h                                           */
} fixture_heap;

FIXTURE void *fixture_alloc(size_t size, void *user)
{
    fixture_heap *heap = (fixture_heap *)user;
    int call = heap->calls++;
    void *memory;
    if (heap->fail_at >= 0 && (call == heap->fail_at || (heap->fail_on && call > heap->fail_at))) return NULL;
    memory = dirty_alloc(size, heap->pattern);
    if (!memory) return NULL;
    heap->bytes += size;
    heap->blocks++;
    return memory;
}

FIXTURE void fixture_free(void *memory, size_t size, void *user)
{
    fixture_heap *heap = (fixture_heap *)user;
    const size_t real = dirty_size(memory);
    if (real != size) heap->wrong_sizes++;
    heap->bytes -= real;
    heap->blocks--;
    dirty_free(memory, real, heap->pattern);
}

FIXTURE springls_allocator fixture_allocator(fixture_heap *heap)
{
    springls_allocator allocator;
    memset(heap, 0, sizeof *heap);
    heap->fail_at = -1;
    heap->pattern = dirty_pattern();
    allocator.alloc = fixture_alloc;
    allocator.free = fixture_free;
    allocator.user = heap;
    return allocator;
}

/* ---- job systems: ranges cut at random places, run in a random order, here or on threads ---- */

enum { FIXTURE_PIECES = 64 };

typedef struct fixture_workers {
    int workers, threads; /* threads: 1 runs on `workers` threads where there are threads */
    uint32_t random;
    int calls;
} fixture_workers;

typedef struct fixture_queue {
    int cut[FIXTURE_PIECES + 1], order[FIXTURE_PIECES], pieces, next;
    springls_task task;
    void *arg;
#if FIXTURE_THREADS
    pthread_mutex_t lock;
#endif
} fixture_queue;

FIXTURE uint32_t fixture_workers_random(fixture_workers *workers)
{
    workers->random = workers->random * 1664525u + 1013904223u;
    return workers->random >> 8;
}

FIXTURE int fixture_compare_int(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

FIXTURE void *fixture_work(void *queue_pointer)
{
    fixture_queue *queue = (fixture_queue *)queue_pointer;
    for (;;) {
        int mine;
#if FIXTURE_THREADS
        pthread_mutex_lock(&queue->lock);
#endif
        mine = queue->next++;
#if FIXTURE_THREADS
        pthread_mutex_unlock(&queue->lock);
#endif
        if (mine >= queue->pieces) return NULL;
        mine = queue->order[mine];
        if (queue->cut[mine] < queue->cut[mine + 1]) queue->task(queue->arg, queue->cut[mine], queue->cut[mine + 1]);
    }
}

FIXTURE void fixture_parallel_for(void *user, int count, int grain, springls_task task, void *arg)
{
    fixture_workers *workers = (fixture_workers *)user;
    fixture_queue queue;
    int i;
    (void)grain; /* results must not depend on how ranges are cut, so grain is no promise */
    workers->calls++;
    queue.pieces = workers->workers == 1 ? 1 : workers->workers * 3;
    if (queue.pieces > FIXTURE_PIECES) queue.pieces = FIXTURE_PIECES;
    queue.next = 0;
    queue.task = task;
    queue.arg = arg;
    queue.cut[0] = 0;
    for (i = 1; i < queue.pieces; i++) queue.cut[i] = (int)(fixture_workers_random(workers) % (uint32_t)(count + 1));
    queue.cut[queue.pieces] = count;
    qsort(queue.cut, (size_t)queue.pieces + 1, sizeof queue.cut[0], fixture_compare_int);
    for (i = 0; i < queue.pieces; i++) queue.order[i] = i;
    for (i = queue.pieces - 1; i > 0; i--) {
        int j = (int)(fixture_workers_random(workers) % (uint32_t)(i + 1)), swap = queue.order[i];
        queue.order[i] = queue.order[j];
        queue.order[j] = swap;
    }
#if FIXTURE_THREADS
    pthread_mutex_init(&queue.lock, NULL);
    if (workers->threads && workers->workers > 1) {
        pthread_t thread[16];
        int n = workers->workers < 16 ? workers->workers : 16, started = 0;
        for (i = 1; i < n; i++) started += pthread_create(&thread[started], NULL, fixture_work, &queue) == 0;
        fixture_work(&queue);
        for (i = 0; i < started; i++) pthread_join(thread[i], NULL);
    }
#endif
    fixture_work(&queue);
#if FIXTURE_THREADS
    pthread_mutex_destroy(&queue.lock);
#endif
}

FIXTURE springls_tasks fixture_tasks(fixture_workers *workers, int count, int threads)
{
    springls_tasks tasks;
    workers->workers = count;
    workers->threads = threads;
    workers->random = 77u + (uint32_t)count;
    workers->calls = 0;
    tasks.parallel_for = fixture_parallel_for;
    tasks.user = workers;
    return tasks;
}

/* ---- the backend: scalar, or OpenCL when SPRINGLS_TEST_BACKEND names a device; one for the program. It is cpu, gpu, or group: a
   processor with the kernels of a GPU. Its library is SPRINGLS_TEST_LIBRARY, or the system's ---- */

/* Ends the program as one that was skipped. */
FIXTURE void fixture_no_device(const char *why)
{
    printf("%s\nPass: 0, fail: 0, skip: 1.\n", why);
    exit(EXIT_SUCCESS);
}

#ifdef SPRINGLS_TEST_OPENCL
static springls_backend *fixture_device;

FIXTURE void fixture_device_log(void *user, int level, const char *message)
{
    (void)user;
    if (strstr(message, "there is no ") || strstr(message, "no device")) fixture_no_device(message);
    if (level < 3) printf("%s\n", message);
}

FIXTURE void fixture_leave_device(void)
{
    printf("%llu kernels on %s\n", (unsigned long long)springls_cl_get_counts(fixture_device).kernels,
           springls_cl_name(fixture_device));
    springls_cl_destroy(fixture_device);
}

/* Describes the device that is asked for, the default one where none is. It has the text of exact_flow_velocity. */
FIXTURE springls_cl_desc fixture_device_desc(void)
{
    const char *name = getenv("SPRINGLS_TEST_BACKEND");
    springls_cl_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.library = getenv("SPRINGLS_TEST_LIBRARY");
    desc.velocity = exact_flow_velocity;
    desc.velocity_source = exact_flow_source();
    desc.velocity_user_bytes = sizeof(struct exact_flow);
    if (!name) return desc;
    desc.kind = strcmp(name, "gpu") == 0 ? SPRINGLS_CL_KIND_GPU : SPRINGLS_CL_KIND_CPU;
    desc.brick_items = strcmp(name, "group") == 0 ? 64 : 0;
    return desc;
}

FIXTURE springls_backend *fixture_backend(void)
{
    springls_cl_desc desc = fixture_device_desc();
    if (fixture_device || !getenv("SPRINGLS_TEST_BACKEND")) return fixture_device;
    desc.logger.log = fixture_device_log;
    if (springls_cl_create(&desc, &fixture_device) != SPRINGLS_OK) exit(EXIT_FAILURE);
    atexit(fixture_leave_device);
    return fixture_device;
}

/* Returns how many kernels the device has run. */
FIXTURE uint64_t fixture_kernels(void) { return springls_cl_get_counts(fixture_device).kernels; }
#else
FIXTURE springls_backend *fixture_backend(void)
{
    if (getenv("SPRINGLS_TEST_BACKEND")) fixture_no_device("opencl: built without its headers");
    return NULL;
}

FIXTURE uint64_t fixture_kernels(void) { return 0; }
#endif

/* Returns the model with its arrays on the host, to be read and written: to be called again after whatever may leave them on the
   device. */
FIXTURE springls__model *fixture_here(springls_context *ctx)
{
    springls__use_host(ctx, true);
    return &ctx->model;
}

/* Runs the table of a private stage as a public call does; then its arrays are on the host. */
FIXTURE springls_status fixture_table(springls_context *ctx, const springls__entry *table)
{
    springls_status status;
    springls__use_device(ctx);
    status = springls__report_device_failure(ctx, springls__run_table(ctx, table));
    fixture_here(ctx);
    return status;
}

/* The same for a function that may end with a loop. */
FIXTURE springls_status fixture_stage(springls_context *ctx, springls_status (*run)(springls_context *))
{
    const springls__entry table[] = { SPRINGLS__DO(run) SPRINGLS__END };
    return fixture_table(ctx, table);
}

/* ---- models ---- */

FIXTURE springls_desc fixture_desc(int size, const springls_params *params)
{
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = size;
    desc.params = params;
    desc.allocator = dirty_allocator();
    desc.backend = fixture_backend();
    return desc;
}

/* params NULL: the defaults. Returns NULL on failure: then the first call of the test fails. */
FIXTURE springls_context *fixture_context(int size, const springls_params *params)
{
    springls_desc desc = fixture_desc(size, params);
    springls_context *ctx = NULL;
    springls_create(&desc, &ctx);
    return ctx;
}

/* Makes meshes, measures, rays and components those of the zero level: for tests of phi. Returns ctx. */
FIXTURE springls_context *fixture_of_zero_level(springls_context *ctx)
{
    springls_params params = springls_get_params(ctx);
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET;
    return springls_set_params(ctx, &params) == SPRINGLS_OK ? ctx : NULL;
}

FIXTURE springls_sphere fixture_ball(float x, float y, float z, float radius)
{
    springls_sphere sphere;
    sphere.center[0] = x;
    sphere.center[1] = y;
    sphere.center[2] = z;
    sphere.radius = radius;
    return sphere;
}

/* Two balls, which need not be apart: a springls_implicit_fn. */
typedef struct fixture_balls { springls_sphere ball[2]; } fixture_balls;

FIXTURE void fixture_two_balls(void *user, const float *points, int count, float *out)
{
    fixture_balls *b = (fixture_balls *)user;
    int i;
    for (i = 0; i < count; i++) {
        float first, second;
        springls_implicit_sphere(&b->ball[0], points + 3 * i, 1, &first);
        springls_implicit_sphere(&b->ball[1], points + 3 * i, 1, &second);
        out[i] = first < second ? first : second;
    }
}

FIXTURE springls_context *fixture_sphere(int size, const springls_params *params, float x, float y, float z, float radius)
{
    springls_sphere sphere = fixture_ball(x, y, z, radius);
    springls_context *ctx = fixture_context(size, params);
    springls_set_implicit(ctx, springls_implicit_sphere, &sphere);
    return ctx;
}

FIXTURE springls_context *fixture_box(int size, const springls_params *params, float half)
{
    springls_box box;
    springls_context *ctx = fixture_context(size, params);
    int axis;
    for (axis = 0; axis < 3; axis++) {
        box.center[axis] = 0.5f * (float)(size - 1);
        box.half[axis] = half;
    }
    springls_set_implicit(ctx, springls_implicit_box, &box);
    return ctx;
}

FIXTURE springls_context *fixture_torus(int size, const springls_params *params, float major, float minor)
{
    springls_torus torus;
    springls_context *ctx = fixture_context(size, params);
    int axis;
    for (axis = 0; axis < 3; axis++) {
        torus.center[axis] = 0.5f * (float)(size - 1);
        torus.axis[axis] = axis == 2 ? 1.0f : 0.0f;
    }
    torus.major = major;
    torus.minor = minor;
    springls_set_implicit(ctx, springls_implicit_torus, &torus);
    return ctx;
}

/* Removes all springls; ids begin at 0 again, and the level set stays. */
FIXTURE void fixture_clear(springls_context *ctx)
{
    springls__model *model = fixture_here(ctx);
    model->set.count = 0;
    model->set.next_id = 0;
    springls__constellation_changed(ctx);
}

/* Adds a springl, and returns its number; the level set stays. */
FIXTURE int fixture_add_at(springls_context *ctx, springls__v3 q0, springls__v3 q1, springls__v3 q2, springls__v3 p, springls__v3 a)
{
    springls__springl s;
    memset(&s, 0, sizeof s);
    fixture_here(ctx);
    if (springls__constellation_reserve(ctx, ctx->model.set.count + 1) != SPRINGLS_OK) return -1;
    s.q[0] = q0;
    s.q[1] = q1;
    s.q[2] = q2;
    s.p = p;
    springls__constellation_append(ctx, &s, a, 0, 0);
    springls__constellation_changed(ctx);
    return ctx->model.set.count - 1;
}

FIXTURE int fixture_add(springls_context *ctx, springls__v3 q0, springls__v3 q1, springls__v3 q2)
{
    springls__v3 p = springls__scale(springls__add(springls__add(q0, q1), q2), 1.0f / 3.0f);
    return fixture_add_at(ctx, q0, q1, q2, p, p);
}

/* Removes the springls with keep[i] == 0. */
FIXTURE springls_status fixture_keep(springls_context *ctx, const uint8_t *keep)
{
    springls_status status = SPRINGLS__RESERVE(ctx, contract_action, ctx->model.set.count);
    fixture_here(ctx);
    if (status != SPRINGLS_OK) return status;
    memcpy(springls__contract_action(&ctx->model), keep, (size_t)ctx->model.set.count);
    status = springls__constellation_compact(ctx);
    springls__constellation_changed(ctx);
    return status;
}

/* Makes a soup of `count` springls with edges of about `size`, anywhere in [low, high]^3. */
FIXTURE void fixture_random_soup(springls_context *ctx, int count, float low, float high, float size)
{
    int i, m;
    fixture_clear(ctx);
    for (i = 0; i < count; i++) {
        springls__v3 c = fixture_point(low, high), q[3];
        do {
            for (m = 0; m < 3; m++) {
                const float arm = size * fixture_between(0.4f, 1.0f); /* first: arguments have no order */
                q[m] = springls__mad(c, fixture_direction(), arm);
            }
        } while (springls__length(springls__cross(springls__sub(q[1], q[0]), springls__sub(q[2], q[0]))) < 0.4f * size * size);
        fixture_add(ctx, q[0], q[1], q[2]);
    }
}

/* ---- reading ---- */

FIXTURE springls__v3 fixture_at(springls_view view, int i, int vertex)
{
    const float *f = (const float *)(const void *)((const char *)(const void *)view.data + (size_t)i * view.stride) + 3 * vertex;
    return springls__v3_make(f[0], f[1], f[2]);
}

FIXTURE springls__v3 fixture_particle(const springls_context *ctx, int i) { return fixture_at(springls_view_particles(ctx), i, 0); }
FIXTURE springls__v3 fixture_vertex(const springls_context *ctx, int i, int m)
{
    return fixture_at(springls_view_vertices(ctx), i, m);
}
FIXTURE springls__v3 fixture_origin(const springls_context *ctx, int i)
{
    return fixture_at(springls_view_correspondences(ctx), i, 0);
}

/* A copy of what a springl is: bytes that can be compared. */
typedef struct fixture_springl { springls__v3 q[3], p, a; uint32_t id, generation; } fixture_springl;

FIXTURE fixture_springl fixture_get(const springls_context *ctx, int i)
{
    fixture_springl s;
    int m;
    for (m = 0; m < 3; m++) s.q[m] = fixture_vertex(ctx, i, m);
    s.p = fixture_particle(ctx, i);
    s.a = fixture_origin(ctx, i);
    s.id = springls_ids(ctx)[i];
    s.generation = springls_generations(ctx)[i];
    return s;
}

/* Returns copies of all springls, to be freed. */
FIXTURE fixture_springl *fixture_copy(const springls_context *ctx)
{
    int i, count = springls_count(ctx);
    fixture_springl *all = (fixture_springl *)malloc(((size_t)count + 1) * sizeof *all);
    for (i = 0; all && i < count; i++) all[i] = fixture_get(ctx, i);
    return all;
}

FIXTURE double fixture_area(const fixture_springl *s)
{
    d3 a = d3_of(s->q[0]);
    return 0.5 * d3_length(d3_cross(d3_sub(d3_of(s->q[1]), a), d3_sub(d3_of(s->q[2]), a)));
}

FIXTURE d3 fixture_normal(const fixture_springl *s)
{
    d3 a = d3_of(s->q[0]), n = d3_cross(d3_sub(d3_of(s->q[1]), a), d3_sub(d3_of(s->q[2]), a));
    return d3_scale(n, 1.0 / d3_length(n));
}

/* Returns the distance from x to the nearest springl, by looking at all of them. */
FIXTURE double fixture_distance(const springls_context *ctx, d3 x)
{
    springls_view vertices = springls_view_vertices(ctx);
    double best = DBL_MAX;
    int i, m;
    for (i = 0; i < vertices.count; i++) {
        d3 t[3];
        double d, size;
        for (m = 0; m < 3; m++) t[m] = d3_of(fixture_at(vertices, i, m));
        size = fmax(d3_distance(t[0], t[1]), d3_distance(t[0], t[2]));
        if (d3_distance(x, t[0]) - size > best) continue; /* all of the triangle is further away */
        d = d3_triangle_distance(t, x);
        if (d < best) best = d;
    }
    return best;
}

/* Returns phi as a dense array, to be freed. */
FIXTURE float *fixture_phi(springls_context *ctx)
{
    const int *size = ctx->desc.grid.size;
    float *phi = (float *)malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof *phi);
    if (phi) springls_copy_level_set(ctx, phi);
    return phi;
}

/* How far the vertices of the zero level are from a sphere, voxels. */
typedef struct fixture_error { double mean, max; int count; } fixture_error;

FIXTURE fixture_error fixture_sphere_error(springls_context *ctx, d3 center, double radius)
{
    fixture_error error;
    springls_mesh mesh;
    int i;
    memset(&error, 0, sizeof error);
    if (springls_extract_mesh(ctx, &mesh) != SPRINGLS_OK || mesh.vertex_count == 0) {
        error.mean = error.max = DBL_MAX;
        return error;
    }
    for (i = 0; i < mesh.vertex_count; i++) {
        const float *x = mesh.positions + 3 * i;
        double d = fabs(d3_distance(d3_make((double)x[0], (double)x[1], (double)x[2]), center) - radius);
        error.mean += d / mesh.vertex_count;
        if (d > error.max) error.max = d;
    }
    error.count = mesh.vertex_count;
    springls_mesh_free(ctx, &mesh);
    return error;
}

/* Counts what is wrong with a mesh, and measures what it encloses. */
FIXTURE springls__mesh_report fixture_report(const springls_mesh *mesh)
{
    springls__mesh_report report;
    size_t n = (size_t)mesh->triangle_count * 3;
    uint64_t *sides = (uint64_t *)malloc((n + 1) * sizeof *sides);
    int32_t *parent = (int32_t *)malloc(((size_t)mesh->vertex_count + 1) * sizeof *parent);
    memset(&report, 0, sizeof report);
    report.boundary_edges = -1;
    if (sides && parent)
        springls__mesh_measure(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, parent, sides, &report);
    free(sides);
    free(parent);
    return report;
}

/* ---- the digital object: voxels with phi < 0, inside 6-connected, outside 26-connected ---- */

typedef struct fixture_topology { int components, euler, cavities; } fixture_topology;

/* Counts the connected parts of the voxels with in[i] == value. all26: connected over edges and corners too. */
FIXTURE int fixture_parts(const unsigned char *in, const int size[3], int value, int all26)
{
    int n = size[0] * size[1] * size[2], parts = 0, i;
    int *stack = (int *)malloc((size_t)n * sizeof *stack);
    unsigned char *seen = (unsigned char *)calloc((size_t)n, 1);
    for (i = 0; stack && seen && i < n; i++) {
        int depth = 0;
        if (in[i] != value || seen[i]) continue;
        parts++;
        seen[i] = 1;
        stack[depth++] = i;
        while (depth > 0) {
            int v = stack[--depth], x = v % size[0], y = v / size[0] % size[1], z = v / (size[0] * size[1]), d;
            for (d = 0; d < 27; d++) {
                int dx = d % 3 - 1, dy = d / 3 % 3 - 1, dz = d / 9 - 1, u;
                if (!all26 && abs(dx) + abs(dy) + abs(dz) != 1) continue;
                if (x + dx < 0 || y + dy < 0 || z + dz < 0 || x + dx >= size[0] || y + dy >= size[1] || z + dz >= size[2]) continue;
                u = v + dx + size[0] * (dy + size[1] * dz);
                if (in[u] != value || seen[u]) continue;
                seen[u] = 1;
                stack[depth++] = u;
            }
        }
    }
    free(stack);
    free(seen);
    return parts;
}

/* Measures an object that does not touch the border. euler: voxels - pairs + squares - cubes of inside voxels. */
FIXTURE fixture_topology fixture_measure(springls_context *ctx)
{
    const int *size = ctx->desc.grid.size;
    fixture_topology topology;
    int n = size[0] * size[1] * size[2], i, box;
    float *phi = fixture_phi(ctx);
    unsigned char *in = (unsigned char *)malloc((size_t)n);
    memset(&topology, 0, sizeof topology);
    for (i = 0; i < n; i++) in[i] = phi[i] < 0.0f;
    for (i = 0; i < n; i++) {
        int x = i % size[0], y = i / size[0] % size[1], z = i / (size[0] * size[1]);
        for (box = 0; box < 8; box++) { /* the cell that reaches one voxel on along the axes of the bits */
            int c, all = 1, bits = (box & 1) + (box >> 1 & 1) + (box >> 2);
            if (x + (box & 1) >= size[0] || y + (box >> 1 & 1) >= size[1] || z + (box >> 2) >= size[2]) continue;
            for (c = 0; c < 8; c++)
                if ((c & box) == c) all = all && in[i + (c & 1) + size[0] * ((c >> 1 & 1) + size[1] * (c >> 2))];
            if (all) topology.euler += bits % 2 ? -1 : 1;
        }
    }
    topology.components = fixture_parts(in, size, 1, 0);
    topology.cavities = fixture_parts(in, size, 0, 1) - 1;
    free(phi);
    free(in);
    return topology;
}

/* ---- forces ---- */

/* A velocity that is the same everywhere. user: its three floats. */
FIXTURE void fixture_wind(void *user, const float *points, int count, float time, float *out)
{
    int i;
    (void)points;
    (void)time;
    for (i = 0; i < 3 * count; i++) out[i] = ((const float *)user)[i % 3];
}

FIXTURE springls_forces fixture_forces(springls_velocity_fn velocity, void *user)
{
    springls_forces forces;
    memset(&forces, 0, sizeof forces);
    forces.velocity = velocity;
    forces.user = user;
    return forces;
}

/* A step in one piece, however far it moves. */
FIXTURE springls_step_desc fixture_step(const springls_forces *forces, springls_mode mode, float dt)
{
    springls_step_desc step;
    memset(&step, 0, sizeof step);
    step.forces = forces;
    step.mode = mode;
    step.dt = dt;
    step.max_displacement = -1.0f;
    return step;
}

/* Moves all springls by v; the level set stays. */
FIXTURE springls_status fixture_translate(springls_context *ctx, float x, float y, float z)
{
    float v[3];
    springls_forces forces = fixture_forces(fixture_wind, v);
    v[0] = x;
    v[1] = y;
    v[2] = z;
    return springls_advect(ctx, &forces, 0.0f, 1.0f);
}

#endif
