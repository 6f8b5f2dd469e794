/* report.c - report [--grid N] PART...: what a machine with an OpenCL device has to tell beside the tests, as sections of
   Markdown (tests/device/run.sh puts the page together).
     device      its name, versions and limits
     start       how long the kernels take to compile
     scenarios   the tests' scenarios against scalar code, with a wait after every kernel, so that a failure has a name
     kernels     which kernels a step of LeVeque's flow on N^3 spends its time in, by the device's own clock
     brush       frames of interactive work on N^3: a step, and the chunks that have changed
   Exits with 1 when a scenario has other bits than scalar code, or fails; with 2 and its usage when an argument is wrong. */
#define _POSIX_C_SOURCE 200809L
#include "springls_under_test.h"
#include "backend/scenarios.h"

#include <time.h>

static double report_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

FIXTURE void report_log(void *user, int level, const char *message)
{
    (void)user;
    if (level < 3) fprintf(stderr, "%s\n", message);
}

/* Opens a device; a process that has lost one may get another. */
FIXTURE springls__cl *report_open(const springls_cl_desc *desc)
{
    springls_cl_desc d = *desc;
    springls_backend *backend;
    d.logger.log = report_log;
    return springls_cl_create(&d, &backend) == SPRINGLS_OK ? (springls__cl *)(void *)backend : NULL;
}

/* ---- a watch on the kernels that are started ---- */

enum { WATCH_OFF, WATCH_WAITS, WATCH_TIMES };
enum { WATCHED_MOST = 256, EVENTS_MOST = 1 << 16 };

typedef struct watched { cl_kernel kernel; char name[64]; int runs; double seconds; } watched;

/* Functions of OpenCL that the library itself does not need. */
#define REPORT_FUNCTIONS(X)                                                                                                      \
    X(GetKernelInfo, cl_int, (cl_kernel, cl_kernel_info, size_t, void *, size_t *))                                              \
    X(GetEventProfilingInfo, cl_int, (cl_event, cl_profiling_info, size_t, void *, size_t *))                                    \
    X(ReleaseEvent, cl_int, (cl_event))

static struct {
    springls__cl *cl;
    int mode, count, event_count;
    watched kernels[WATCHED_MOST];
    cl_event events[EVENTS_MOST];
    int event_kernel[EVENTS_MOST];
    char fault[128]; /* the first kernel that failed, and how */
    cl_int (CL_API_CALL *start)(cl_command_queue, cl_kernel, cl_uint, const size_t *, const size_t *, const size_t *, cl_uint,
                                const cl_event *, cl_event *);
#define REPORT_POINTER(name, result, arguments) result (CL_API_CALL *name) arguments;
    REPORT_FUNCTIONS(REPORT_POINTER)
#undef REPORT_POINTER
} watch;

FIXTURE int watch_index(cl_kernel kernel)
{
    int i;
    for (i = 0; i < watch.count; i++)
        if (watch.kernels[i].kernel == kernel) return i;
    if (watch.count == WATCHED_MOST) return WATCHED_MOST - 1;
    memset(&watch.kernels[i], 0, sizeof watch.kernels[i]);
    watch.kernels[i].kernel = kernel;
    watch.GetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof watch.kernels[i].name - 1, watch.kernels[i].name, NULL);
    return watch.count++;
}

FIXTURE const char *watch_name(int i)
{
    const char *name = watch.kernels[i].name;
    return strncmp(name, "springls_", 9) == 0 ? name + 9 : name;
}

/* Stands before clEnqueueNDRangeKernel. */
FIXTURE cl_int CL_API_CALL watch_start(cl_command_queue queue, cl_kernel kernel, cl_uint axes, const size_t *offset,
                                       const size_t *items, const size_t *group, cl_uint waits, const cl_event *wait,
                                       cl_event *event)
{
    const int i = watch_index(kernel);
    const bool timed = watch.mode == WATCH_TIMES && watch.event_count < EVENTS_MOST;
    cl_int error = watch.start(queue, kernel, axes, offset, items, group, waits, wait,
                               timed ? &watch.events[watch.event_count] : event);
    watch.kernels[i].runs++;
    if (timed && error == CL_SUCCESS) watch.event_kernel[watch.event_count++] = i;
    if (watch.mode == WATCH_WAITS && error == CL_SUCCESS) error = watch.cl->Finish(queue);
    if (error != CL_SUCCESS && !watch.fault[0])
        snprintf(watch.fault, sizeof watch.fault, "%s, %lu items: %s (%d)", watch_name(i), (unsigned long)items[0],
                 springls__cl_error(error), (int)error);
    return error;
}

/* Watches the kernels of a backend; false when its library lacks what that needs. */
FIXTURE bool watch_begin(springls__cl *cl, int mode)
{
    springls__cl_symbol symbol = NULL;
    memset(&watch, 0, sizeof watch);
#define REPORT_LOAD(name, result, arguments)                                                                                     \
    symbol = SPRINGLS__CL_FIND(cl->library, "cl" #name);                                                                         \
    memcpy(&watch.name, &symbol, sizeof symbol);                                                                                 \
    if (!symbol) return false;
    REPORT_FUNCTIONS(REPORT_LOAD)
#undef REPORT_LOAD
    watch.cl = cl;
    watch.mode = mode;
    watch.start = cl->EnqueueNDRangeKernel;
    cl->EnqueueNDRangeKernel = watch_start;
    return true;
}

/* Adds up the times of the events so far. */
FIXTURE void watch_collect(void)
{
    int i;
    watch.cl->Finish(watch.cl->queue);
    for (i = 0; i < watch.event_count; i++) {
        cl_ulong begin = 0, end = 0;
        watch.GetEventProfilingInfo(watch.events[i], CL_PROFILING_COMMAND_START, sizeof begin, &begin, NULL);
        watch.GetEventProfilingInfo(watch.events[i], CL_PROFILING_COMMAND_END, sizeof end, &end, NULL);
        watch.kernels[watch.event_kernel[i]].seconds += 1e-9 * (double)(end - begin);
        watch.ReleaseEvent(watch.events[i]);
    }
    watch.event_count = 0;
}

/* ---- the device ---- */

FIXTURE void report_text(const springls__cl *cl, const char *what, cl_device_info info)
{
    char text[256] = "";
    cl->GetDeviceInfo(cl->device, info, sizeof text - 1, text, NULL);
    printf("| %s | %s |\n", what, text);
}

FIXTURE void report_number(const springls__cl *cl, const char *what, cl_device_info info, double unit)
{
    cl_ulong number = 0; /* the shorter ones leave the upper half 0, where the lower comes first */
    cl->GetDeviceInfo(cl->device, info, sizeof number, &number, NULL);
    printf("| %s | %.0f |\n", what, (double)number / unit);
}

FIXTURE bool report_device(int grid)
{
    springls_cl_desc desc;
    springls__cl *cl;
    cl_device_type type = 0;
    (void)grid;
    memset(&desc, 0, sizeof desc);
    cl = report_open(&desc);
    if (!cl) return false;
    cl->GetDeviceInfo(cl->device, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    printf("## The device\n\n| | |\n|---|---|\n| Device | %s |\n| Kind | %s |\n", springls_cl_name(&cl->base),
           type & CL_DEVICE_TYPE_CPU ? "processor" : "GPU");
    report_text(cl, "OpenCL", CL_DEVICE_VERSION);
    report_text(cl, "Driver", CL_DRIVER_VERSION);
    report_number(cl, "Compute units", CL_DEVICE_MAX_COMPUTE_UNITS, 1.0);
    report_number(cl, "Memory, MiB", CL_DEVICE_GLOBAL_MEM_SIZE, 1048576.0);
    report_number(cl, "Local memory, KiB", CL_DEVICE_LOCAL_MEM_SIZE, 1024.0);
    report_number(cl, "Items of a group, at most", CL_DEVICE_MAX_WORK_GROUP_SIZE, 1.0);
    printf("| Items that share a brick | %lu |\n| Rounds as C does | %s |\n\n", (unsigned long)cl->group, cl->exact ? "yes" : "no");
    springls_cl_destroy(&cl->base);
    return true;
}

FIXTURE bool report_start(int grid)
{
    springls_threads *threads = springls_threads_create(0);
    const char *folder = getenv("SPRINGLS_CACHE");
    springls_cl_desc desc;
    springls__cl *cl;
    double begin = report_seconds(), created, prepared;
    springls_status status = SPRINGLS_DEVICE_FAILED;
    (void)grid;
    memset(&desc, 0, sizeof desc);
    desc.tasks = springls_threads_tasks(threads);
    desc.cache.folder = folder && *folder ? folder : NULL;
    cl = report_open(&desc);
    if (cl) {
        created = report_seconds();
        status = springls_cl_prepare(&cl->base, NULL);
        prepared = report_seconds();
        printf("%.2f | %.2f\n", created - begin, prepared - created);
        springls_cl_destroy(&cl->base);
    }
    springls_threads_destroy(threads);
    return status == SPRINGLS_OK;
}

/* ---- scenarios ---- */

FIXTURE bool report_scenarios(int grid)
{
    springls_cl_desc desc;
    springls__cl *cl = NULL;
    bool good = true;
    int i, k, runs;
    (void)grid;
    memset(&desc, 0, sizeof desc);
    scenario_image();
    printf("## Scenarios\n\nEach is run with a wait after every kernel, and compared with scalar code.\n\n"
           "| Scenario | Kernels | Bits | First failure |\n|---|---|---|---|\n");
    for (i = 0; i < SCENARIOS; i++) {
        uint64_t hash, scalar = scenario_hash(i, NULL);
        if (!cl && ((cl = report_open(&desc)) == NULL || !watch_begin(cl, WATCH_WAITS))) return false;
        for (k = 0; k < watch.count; k++) watch.kernels[k].runs = 0;
        hash = scenario_hash(i, &cl->base);
        for (k = runs = 0; k < watch.count; k++) runs += watch.kernels[k].runs;
        printf("| %s | %d | %s | %s |\n", scenario_name(i), runs, hash == scalar ? "equal" : "differ",
               watch.fault[0] ? watch.fault : "none");
        fflush(stdout);
        good = good && !watch.fault[0] && (hash == scalar || !cl->exact);
        if (!watch.fault[0]) continue;
        springls_cl_destroy(&cl->base); /* its context is lost */
        cl = NULL;
    }
    printf("\n");
    if (cl) springls_cl_destroy(&cl->base);
    return good;
}

/* ---- kernels ---- */

FIXTURE int report_longer_first(const void *a, const void *b)
{
    const double x = ((const watched *)a)->seconds, y = ((const watched *)b)->seconds;
    return (x < y) - (x > y);
}

/* A ball in LeVeque's flow. */
FIXTURE springls_context *report_leveque(springls_backend *backend, int grid)
{
    const float size = (float)grid;
    springls_sphere ball = fixture_ball(0.35f * size, 0.35f * size, 0.35f * size, 0.15f * size);
    springls_desc desc = fixture_desc(grid, NULL);
    springls_context *ctx = NULL;
    desc.backend = backend;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return NULL;
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK) return ctx;
    springls_destroy(ctx);
    return NULL;
}

FIXTURE bool report_kernels(int grid)
{
    enum { STEPS = 60, ROWS = 15 };
    springls_cl_desc desc;
    struct exact_flow flow = EXACT_DEFORMATION((float)grid, 2.5f);
    springls_forces forces = fixture_forces(exact_flow_velocity, &flow);
    springls_step_desc step;
    springls_context *ctx;
    springls__cl *cl;
    cl_int error = CL_SUCCESS;
    double begin, wall, device = 0.0;
    int i, kernels = 0, steps;
    memset(&desc, 0, sizeof desc);
    memset(&step, 0, sizeof step);
    desc.velocity = exact_flow_velocity;
    desc.velocity_source = exact_flow_source();
    desc.velocity_user_bytes = sizeof flow;
    step.forces = &forces;
    step.max_displacement = 0.5f;
    cl = report_open(&desc);
    if (!cl) return false;
    cl->ReleaseCommandQueue(cl->queue); /* for one that keeps times */
    cl->queue = cl->CreateCommandQueue(cl->context, cl->device, CL_QUEUE_PROFILING_ENABLE, &error);
    if (error != CL_SUCCESS || !watch_begin(cl, WATCH_TIMES)) return false;
    ctx = report_leveque(&cl->base, grid);
    for (steps = 0; ctx && steps < STEPS / 4 && springls_step(ctx, &step) == SPRINGLS_OK; steps++) watch_collect();
    for (i = 0; i < watch.count; i++) watch.kernels[i].runs = 0, watch.kernels[i].seconds = 0.0; /* the first steps compile */
    begin = report_seconds();
    for (steps = 0; ctx && steps < STEPS && springls_step(ctx, &step) == SPRINGLS_OK; steps++) watch_collect();
    wall = report_seconds() - begin;
    for (i = 0; i < watch.count; i++) {
        device += watch.kernels[i].seconds;
        kernels += watch.kernels[i].runs;
    }
    qsort(watch.kernels, (size_t)watch.count, sizeof *watch.kernels, report_longer_first);
    printf("## Kernels\n\n%d steps of LeVeque's flow on %d^3, %.2f ms each (times are kept, and the device is waited for after each), of "
           "which kernels run %.2f ms; %.0f kernels a step.\n\n| Kernel | Runs a step | us a run | %% of all |\n|---|---|---|---|\n",
           steps, grid, 1e3 * wall / steps, 1e3 * device / steps, (double)kernels / steps);
    for (i = 0; i < ROWS && i < watch.count; i++)
        printf("| %s | %.1f | %.1f | %.1f |\n", watch_name(i), (double)watch.kernels[i].runs / steps,
               1e6 * watch.kernels[i].seconds / watch.kernels[i].runs, 100.0 * watch.kernels[i].seconds / device);
    printf("\n");
    springls_destroy(ctx);
    springls_cl_destroy(&cl->base);
    return steps == STEPS;
}

/* ---- a brush ---- */

/* What the callback and its text for the device take. */
typedef struct brush { float center[3], radius, velocity[3]; } brush;

FIXTURE void brush_push(void *user, const float *points, int count, float time, float *out)
{
    const brush *b = (const brush *)user;
    int i, k;
    (void)time;
    for (i = 0; i < count; i++, points += 3, out += 3) {
        float d2 = 0.0f, w;
        for (k = 0; k < 3; k++) d2 += (points[k] - b->center[k]) * (points[k] - b->center[k]);
        w = springls__max(1.0f - d2 / (b->radius * b->radius), 0.0f);
        for (k = 0; k < 3; k++) out[k] = w * w * b->velocity[k];
    }
}

static const char brush_text[] = "float3 springls_velocity(float3 x, float time, __global const float *b)\n"
                                 "{\n"
                                 "    float3 d = x - (float3)(b[0], b[1], b[2]);\n"
                                 "    float w = fmax(1.0f - (d.x * d.x + d.y * d.y + d.z * d.z) / (b[3] * b[3]), 0.0f);\n"
                                 "    return w * w * (float3)(b[4], b[5], b[6]);\n"
                                 "}\n";

FIXTURE int report_ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Prints a row: milliseconds of frames in which a brush goes round a ball. */
FIXTURE bool report_brush_row(const char *what, springls_backend *backend, int grid)
{
    enum { SETTLE = 20, FRAMES = 100 };
    static double step_ms[FRAMES], frame_ms[FRAMES];
    const float size = (float)grid, middle = 0.5f * size, radius = 0.25f * size;
    springls_sphere ball = fixture_ball(middle, middle, middle, radius);
    brush b = { { middle, middle, middle }, 0.08f * size, { 0.0f, 0.0f, 0.0f } };
    springls_forces forces = fixture_forces(brush_push, &b);
    springls_step_desc step = fixture_step(&forces, SPRINGLS_MODE_FLUID, 1.0f);
    springls_desc desc = fixture_desc(grid, NULL);
    springls_context *ctx = NULL;
    springls_chunks *chunks = NULL;
    const springls_chunk *changed;
    int i, k, count;
    bool good;
    desc.backend = backend;
    step.max_displacement = 2.0f;
    good = springls_create(&desc, &ctx) == SPRINGLS_OK
        && springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
        && springls_chunks_create(ctx, NULL, &chunks) == SPRINGLS_OK;
    for (i = 0; good && i < SETTLE + FRAMES; i++) {
        const float turn = 0.02f * (float)i;
        double begin = report_seconds(), stepped;
        b.center[0] = middle + radius * cosf(turn);
        b.center[1] = middle + radius * sinf(turn);
        b.velocity[0] = i < SETTLE ? 0.0f : -cosf(turn);
        b.velocity[1] = i < SETTLE ? 0.0f : -sinf(turn);
        for (k = 0; k < 3; k++) {
            forces.region_lower[k] = b.center[k] - b.radius;
            forces.region_upper[k] = b.center[k] + b.radius;
        }
        good = springls_step(ctx, &step) == SPRINGLS_OK;
        stepped = report_seconds();
        good = good && springls_chunks_update(ctx, chunks, &changed, &count) == SPRINGLS_OK;
        if (i < SETTLE) continue;
        step_ms[i - SETTLE] = 1e3 * (stepped - begin);
        frame_ms[i - SETTLE] = 1e3 * (report_seconds() - begin);
    }
    qsort(step_ms, FRAMES, sizeof *step_ms, report_ascending);
    qsort(frame_ms, FRAMES, sizeof *frame_ms, report_ascending);
    if (good)
        printf("| %s | %.2f | %.2f | %.2f | %.2f |\n", what, step_ms[FRAMES / 2], step_ms[FRAMES * 95 / 100], frame_ms[FRAMES / 2],
               frame_ms[FRAMES * 95 / 100]);
    else printf("| %s | %s | | | |\n", what, springls_last_error(ctx));
    springls_chunks_destroy(ctx, chunks);
    springls_destroy(ctx);
    return good;
}

FIXTURE bool report_brush(int grid)
{
    springls_cl_desc desc;
    springls__cl *cl;
    bool good;
    memset(&desc, 0, sizeof desc);
    printf("## A brush\n\nFrames in which a brush of .08 grids pushes a ball of radius .25 on %d^3 in by a voxel, and the chunks that have "
           "changed are meshed.\n\n| | Step, ms: p50 | p95 | Step and chunks: p50 | p95 |\n|---|---|---|---|---|\n", grid);
    good = report_brush_row("scalar, one thread", NULL, grid);
    cl = report_open(&desc);
    if (!cl) return false;
    good = report_brush_row("device, velocity by a callback", &cl->base, grid) && good;
    springls_cl_destroy(&cl->base);
    desc.velocity = brush_push;
    desc.velocity_source = brush_text;
    desc.velocity_user_bytes = sizeof(brush);
    cl = report_open(&desc);
    if (!cl) return false;
    good = report_brush_row("device, velocity in OpenCL C", &cl->base, grid) && good;
    springls_cl_destroy(&cl->base);
    printf("\n");
    return good;
}

FIXTURE int report_usage(void)
{
    fprintf(stderr, "usage: report [--grid 16..1024] device|start|scenarios|kernels|brush ...\n");
    return 2;
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    static const struct { const char *name; bool (*print)(int grid); } parts[] = {
        { "device", report_device }, { "start", report_start }, { "scenarios", report_scenarios },
        { "kernels", report_kernels }, { "brush", report_brush }
    };
    int i, grid = 128;
    size_t k;
    bool good = true;
    for (i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--grid") == 0 && i + 1 < argc) {
            grid = atoi(argv[++i]);
            continue;
        }
        for (k = 0; k < sizeof parts / sizeof *parts && strcmp(parts[k].name, argv[i]) != 0; k++) continue;
        if (k == sizeof parts / sizeof *parts || grid < 16 || grid > 1024) return report_usage();
        good = (parts[k].print)(grid) && good;
    }
    return argc > 1 ? !good : report_usage();
}
