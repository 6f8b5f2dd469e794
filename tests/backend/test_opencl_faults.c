/* test_opencl_faults.c - every call into OpenCL fails once, or from there on, while a model is worked on: one clear error, nothing
   leaked, and the context goes on with scalar code: where the model could be read back, to the same bits. Skipped
   without OpenCL. */
#include "springls_under_test.h"
#include "histories.h"
#include "every_call.h"
#include "springls_cl.h"
#include "opencl_stub.h"

static const stub_controls *stub; /* NULL: there is none here, or no OpenCL behind it */
static char stub_path[512];
static springls_backend *reliable; /* made without a fault; for many contexts */
static int objects_before; /* the test */

#define NEEDS_STUB() do { if (!stub) SKIPm("there is no OpenCL device, or no stub before it"); } while (0)

/* ---- what is logged ---- */

typedef struct fault_log { int errors, warnings; char error[256], lines[1024]; } fault_log;

FIXTURE void fault_logger(void *user, int level, const char *message)
{
    fault_log *log = (fault_log *)user;
    log->errors += level == 1;
    log->warnings += level == 2;
    if (level == 1) snprintf(log->error, sizeof log->error, "%s", message);
    if (level > 2 || strlen(log->lines) + strlen(message) + 2 > sizeof log->lines) return;
    strcat(strcat(log->lines, message), "\n");
}

/* ---- backends that cannot be made ---- */

FIXTURE springls_status fault_create(const char *library, fault_log *log, springls_backend **backend)
{
    springls_cl_desc desc;
    memset(&desc, 0, sizeof desc);
    memset(log, 0, sizeof *log);
    desc.library = library;
    desc.velocity = exact_flow_velocity;
    desc.velocity_source = exact_flow_source();
    desc.velocity_user_bytes = sizeof(struct exact_flow);
    desc.logger.log = fault_logger;
    desc.logger.user = log;
    return springls_cl_create(&desc, backend);
}

FIXTURE void fault_count(void)
{
    stub->begin();
    objects_before = stub->objects();
}

FIXTURE bool fault_leaves_nothing(void) { return stub->objects() == objects_before && stub->misuse()[0] == 0; }

/* Whichever call fails: no backend, a status, a message of one line, nothing left. */
TEST making_a_backend_fails(int error)
{
    int call, calls;
    fault_log log;
    springls_backend *backend;
    NEEDS_STUB();
    fault_count();
    ASSERT_OK(fault_create(stub_path, &log, &backend));
    ASSERT_EQ(0, log.errors + log.warnings);
    calls = stub->calls(NULL);
    ASSERT_GT(calls, 40); /* the kernels of the first program, and more */
    springls_cl_destroy(backend);
    ASSERT(fault_leaves_nothing());
    for (call = 0; call < calls; call++) {
        springls_status status;
        stub->begin();
        stub->fail(NULL, call, error, 0);
        status = fault_create(stub_path, &log, &backend);
        if (status == SPRINGLS_OK) { /* another platform or kind of device was tried, or a name is not known */
            ASSERT(strncmp(stub->failed(), "clGet", 5) == 0);
            ASSERT(springls_cl_exact(backend));
            springls_cl_destroy(backend);
        } else {
            ASSERT(backend == NULL);
            ASSERT(status == SPRINGLS_DEVICE_FAILED || status == SPRINGLS_OUT_OF_MEMORY);
            ASSERT_EQ(1, log.warnings);
            ASSERT_EQ(0, log.errors);
            ASSERT(strstr(log.lines, "opencl: ") != NULL && strstr(log.lines, "going on without") != NULL);
        }
        ASSERT(fault_leaves_nothing());
    }
    PASS();
}

TEST kernels_do_not_compile(void)
{
    fault_log log;
    springls_backend *backend;
    NEEDS_STUB();
    fault_count();
    stub->fail("clBuildProgram", 0, CL_BUILD_PROGRAM_FAILURE, 0);
    ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, fault_create(stub_path, &log, &backend));
    ASSERT(backend == NULL);
    ASSERT(strstr(log.lines, "springls.h:1234:5: error: made up by the stub\nand a second line\n") != NULL);
    ASSERT(strstr(log.lines, "the kernels do not compile") != NULL);
    ASSERT_EQ(3, log.warnings);
    ASSERT(fault_leaves_nothing());
    PASS();
}

TEST no_platform_and_no_library(void)
{
    fault_log log;
    springls_backend *backend;
    NEEDS_STUB();
    fault_count();
    stub->hide_platforms(1);
    ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, fault_create(stub_path, &log, &backend));
    ASSERT(backend == NULL && log.warnings == 1 && strstr(log.lines, "no device") != NULL);
    stub->begin();
    ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, fault_create("libthere-is-none.so", &log, &backend));
    ASSERT(backend == NULL && log.warnings == 1 && strstr(log.lines, "libthere-is-none.so") != NULL);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* Of the caller's queues only one in order, of the context given, is taken; it works, and is given back. */
TEST queues_of_the_caller(void)
{
    const springls__cl *cl = (const springls__cl *)(const void *)reliable;
    cl_context own, other;
    cl_command_queue queues[3];
    springls_cl_desc desc;
    springls_backend *backend;
    fault_log log;
    cl_int error;
    int i;
    NEEDS_STUB();
    fault_count();
    own = cl->CreateContext(NULL, 1, &cl->device, NULL, NULL, &error);
    other = cl->CreateContext(NULL, 1, &cl->device, NULL, NULL, &error);
    queues[0] = cl->CreateCommandQueue(own, cl->device, 0, &error);
    queues[1] = cl->CreateCommandQueue(own, cl->device, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, &error);
    queues[2] = cl->CreateCommandQueue(other, cl->device, 0, &error);
    for (i = 0; i < 3; i++) {
        if (!queues[i]) continue; /* out of order is an option of the device */
        memset(&desc, 0, sizeof desc);
        memset(&log, 0, sizeof log);
        desc.library = stub_path;
        desc.context = own;
        desc.queue = queues[i];
        desc.logger.log = fault_logger;
        desc.logger.user = &log;
        ASSERT_STATUS(i == 0 ? SPRINGLS_OK : SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
        ASSERT_EQ(i == 0, backend != NULL);
        ASSERT_EQ(i == 0, strstr(log.lines, "the queue is out of order, or of another context") == NULL);
        if (i == 0) ASSERT_EQ(queues[0], ((springls__cl *)(void *)backend)->queue);
        springls_cl_destroy(backend);
        cl->ReleaseCommandQueue(queues[i]);
    }
    cl->ReleaseContext(own);
    cl->ReleaseContext(other);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- springls_cl_prepare ---- */

typedef struct preparing { int reports, stop; float fraction; bool ordered; } preparing;

FIXTURE int prepare_report(void *user, float fraction)
{
    preparing *p = (preparing *)user;
    p->ordered = p->ordered && fraction > p->fraction;
    p->fraction = fraction;
    return ++p->reports == p->stop;
}

FIXTURE springls_status prepare(springls_backend *backend, int stop, preparing *p)
{
    springls_progress progress = { prepare_report, p };
    memset(p, 0, sizeof *p);
    p->stop = stop;
    p->ordered = true;
    return springls_cl_prepare(backend, &progress);
}

/* After it no step starts a kernel that has not run. */
TEST kernels_are_compiled_before_the_first_step(void)
{
    const int kernels = (int)SPRINGLS__KERNEL_COUNT, programs = SPRINGLS__PROGRAM_COUNT;
    springls_sphere ball = { { 9.5f, 9.5f, 9.5f }, 5.0f };
    springls_desc desc;
    springls_step_desc step;
    springls_forces forces;
    struct exact_flow flow = EXACT_DEFORMATION(20.0f, 2.0f);
    springls_backend *backend;
    springls_context *ctx;
    fault_log log;
    preparing p;
    int compiled, i;
    NEEDS_STUB();
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_prepare(NULL, NULL));
    fault_count();
    ASSERT_OK(fault_create(stub_path, &log, &backend));
    compiled = stub->compiled();
    ASSERT_STATUS(SPRINGLS_CANCELLED, prepare(backend, 5, &p));
    ASSERT_EQ(5, p.reports);
    ASSERT_EQ(1 + 5, stub->calls("clBuildProgram"));
    ASSERT_EQ(compiled, stub->compiled());
    ASSERT_STATUS(SPRINGLS_CANCELLED, prepare(backend, programs - 6 + 3, &p));
    ASSERT_EQ(programs, stub->calls("clBuildProgram"));
    ASSERT_EQ(compiled + 3, stub->compiled());
    ASSERT_OK(prepare(backend, 0, &p));
    ASSERT_EQ(1 + kernels, p.reports);
    ASSERT(p.ordered && p.fraction == 1.0f);
    ASSERT_EQ(compiled + kernels, stub->compiled());
    ASSERT_OK(springls_cl_prepare(backend, NULL));
    memset(&desc, 0, sizeof desc);
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 20;
    desc.backend = backend;
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    step.forces = &forces;
    ASSERT_OK(springls_create(&desc, &ctx));
    ASSERT_OK(springls_set_implicit(ctx, springls_implicit_sphere, &ball));
    for (i = 0; i < 26; i++) ASSERT_OK(springls_step(ctx, &step));
    ASSERT_EQ(programs, stub->calls("clBuildProgram"));
    ASSERT_GT(springls_cl_get_counts(backend).kernels, 100);
    ASSERT_EQ(compiled + kernels, stub->compiled());
    springls_destroy(ctx);
    springls_cl_destroy(backend);
    ASSERT_EQ(0, log.errors + log.warnings);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* A device that fails meanwhile: one error. */
TEST preparing_fails(const char *function, int error)
{
    fault_log log;
    springls_backend *backend;
    preparing p;
    NEEDS_STUB();
    fault_count();
    ASSERT_OK(fault_create(stub_path, &log, &backend));
    stub->fail(function, stub->calls(function) + (strcmp(function, "clCreateBuffer") ? 3 : 0), error, 0);
    ASSERT_STATUS(springls__cl_status(error), prepare(backend, 0, &p));
    ASSERT_EQ(1, log.errors);
    ASSERT(strstr(log.error, "opencl: prepare: ") != NULL);
    ASSERT_OK(prepare(backend, 0, &p));
    springls_cl_destroy(backend);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* Writes a copy of the stub that lacks the function `name`. */
FIXTURE bool fault_library_without(const char *name, const char *path)
{
    FILE *file = fopen(stub_path, "rb");
    char *bytes;
    long size, i;
    size_t length = strlen(name) + 1;
    bool done;
    if (!file) return false;
    fseek(file, 0, SEEK_END);
    size = ftell(file);
    rewind(file);
    bytes = (char *)malloc((size_t)size);
    done = bytes && fread(bytes, 1, (size_t)size, file) == (size_t)size;
    fclose(file);
    for (i = 0; done && i + (long)length <= size; i++)
        if (memcmp(bytes + i, name, length) == 0) bytes[i] = 'x';
    file = done ? fopen(path, "wb") : NULL;
    done = file && fwrite(bytes, 1, (size_t)size, file) == (size_t)size;
    if (file) fclose(file);
    free(bytes);
    return done;
}

/* A library that lacks any one of the functions is no library. */
TEST functions_are_missing(void)
{
#define FAULT_FUNCTION(name, result, arguments) "cl" #name,
    static const char *const functions[] = { SPRINGLS__CL_FUNCTIONS(FAULT_FUNCTION) };
#undef FAULT_FUNCTION
    char path[sizeof stub_path + 8];
    fault_log log;
    springls_backend *backend;
    size_t i;
    NEEDS_STUB();
    fault_count();
    for (i = 0; i < sizeof functions / sizeof *functions; i++) {
        snprintf(path, sizeof path, "%s.part", stub_path);
        ASSERT(fault_library_without(functions[i], path));
        ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, fault_create(path, &log, &backend));
        remove(path);
        ASSERT(backend == NULL && log.warnings == 1 && strstr(log.lines, functions[i]) != NULL);
    }
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- a device that fails while it works ---- */

enum { FAULT_SIZE = 20 };

typedef struct fault_outcome {
    uint64_t hash;
    int calls;               /* into OpenCL                                               */
    int failures;            /* calls that have returned one                                */
    int lost;                /* models                                                    */
    springls_status status;  /* of the failure                                            */
    char text[256];
    fault_log log;
    const char *fault;       /* what was wrong                                            */
} fault_outcome;

typedef struct fault_bench {
    springls_context *ctx;
    springls_forces forces;
    springls_step_desc fluid, elastic;
    float field[3 * FAULT_SIZE * FAULT_SIZE * FAULT_SIZE];
} fault_bench;

FIXTURE springls_status fault_begin(fault_bench *bench)
{
    springls_sphere ball = fixture_ball(7.5f, 7.0f, 7.2f, 3.5f);
    springls_params p = springls_default_params();
    SPRINGLS__TRY(springls_set_params(bench->ctx, &p)); /* it may be the second model */
    return springls_set_implicit(bench->ctx, springls_implicit_sphere, &ball);
}

enum { FAULT_CALLS = 9, FAULT_QUERY = 7 /* from here on calls only read */ };

/* Makes call number `call`, of FAULT_CALLS, on the model. */
FIXTURE springls_status fault_call(fault_bench *bench, int call)
{
    static const float vertices[2 * 9] = { 11.0f, 7.0f, 7.2f, 11.0f, 7.5f, 7.2f, 11.0f, 7.0f, 7.7f,
                                           7.5f, 10.5f, 7.2f, 7.5f, 10.5f, 7.7f, 8.0f, 10.5f, 7.2f };
    springls_params p = springls_get_params(bench->ctx);
    springls_mesh mesh;
    springls_status status;
    switch (call) {
    case 0: return fault_begin(bench);
    case 1: case 4: return springls_step(bench->ctx, &bench->fluid);
    case 2: return springls_step(bench->ctx, &bench->elastic);
    case 3:
        p.capture_range = 2.2f;
        p.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        return springls_set_params(bench->ctx, &p);
    case 5: return springls_write(bench->ctx, 1, 2, vertices, NULL);
    case FAULT_QUERY:
        status = springls_extract_mesh(bench->ctx, &mesh);
        if (status == SPRINGLS_OK) springls_mesh_free(bench->ctx, &mesh);
        return status;
    case 8: return springls_copy_level_set(bench->ctx, bench->field);
    default: return springls_run_stage(bench->ctx, SPRINGLS_STAGE_RELAX);
    }
}

FIXTURE void fault_note(fault_outcome *out, const char *fault) { if (!out->fault) out->fault = fault; }

/* Notes the message of a failure, and whether the context goes on after it. */
FIXTURE void fault_after(fault_bench *bench, fault_outcome *out, int call, springls_status status)
{
    int i;
    out->failures++;
    out->status = status;
    snprintf(out->text, sizeof out->text, "%s", springls_last_error(bench->ctx));
    if (stub && stub->memories() != 0) fault_note(out, "device memory is left");
    if (springls_count(bench->ctx) == 0) {
        out->lost++;
        if (strstr(out->text, "the model is lost") == NULL) fault_note(out, "the model is gone without a message");
        if (springls_get_stats(bench->ctx).bricks != 0) fault_note(out, "the level set is left of a lost model");
        for (i = 0; i <= call; i++) /* another one, the same */
            if (fault_call(bench, i) != SPRINGLS_OK) fault_note(out, "the context does not go on after the model was lost");
    } else if (call >= FAULT_QUERY) {
        if (fault_call(bench, call) != SPRINGLS_OK) fault_note(out, "a query does not work when asked again");
    }
}

/* Makes all calls on a new model. function: whose calls into OpenCL are counted, NULL: those of all. */
FIXTURE fault_outcome fault_run(springls_backend *backend, const char *function)
{
    static fault_bench bench;
    springls_params p = springls_default_params();
    springls_desc desc = fixture_desc(FAULT_SIZE, &p);
    struct exact_flow flow = EXACT_DEFORMATION((float)FAULT_SIZE, 2.0f);
    fixture_heap heap;
    fault_outcome out;
    int i;
    memset(&out, 0, sizeof out);
    memset(&bench, 0, sizeof bench);
    desc.allocator = fixture_allocator(&heap);
    bench.forces = fixture_forces(exact_flow_velocity, &flow);
    bench.forces.velocity_grid.data = bench.field;
    for (i = 0; i < 3 * FAULT_SIZE * FAULT_SIZE * FAULT_SIZE; i++) bench.field[i] = 0.01f * (float)(i % 7);
    bench.fluid = fixture_step(&bench.forces, SPRINGLS_MODE_FLUID, 0.08f);
    bench.elastic = fixture_step(&bench.forces, SPRINGLS_MODE_ELASTIC, 0.05f);
    desc.backend = backend;
    desc.logger.log = fault_logger;
    desc.logger.user = &out.log;
    if (springls_create(&desc, &bench.ctx) != SPRINGLS_OK) {
        fault_note(&out, "no context");
        return out;
    }
    for (i = 0; i < FAULT_CALLS; i++) {
        springls_status status = fault_call(&bench, i);
        if (status != SPRINGLS_OK) fault_after(&bench, &out, i, status);
    }
    out.calls = stub->calls(function);
    stub->fail(NULL, 0, CL_SUCCESS, 0); /* the hash has no status */
    out.hash = springls_state_hash(bench.ctx);
    springls_destroy(bench.ctx);
    if (heap.blocks != 0 || heap.wrong_sizes != 0) fault_note(&out, "memory is left");
    return out;
}

/* Returns what is wrong after call number `call` of `function` has failed; NULL: nothing. */
FIXTURE const char *fault_verdict(const char *function, int call, int error, int on, uint64_t expected, int *lost)
{
    static char message[512];
    fault_outcome out;
    const char *fault;
    int failures = 1;
    stub->begin();
    stub->fail(function, call, error, on);
    out = fault_run(reliable, function);
    fault = out.fault;
    *lost += out.lost;
    if (!fault && stub->failed()[0] == 0) fault = "nothing has failed";
    if (!on && strcmp(stub->failed(), "clCreateBuffer") == 0) failures = 0; /* less memory is asked for next, and given */
    if (!fault && !fault_leaves_nothing()) fault = stub->misuse()[0] ? "something is used that there is not" : "something is left";
    if (!fault && out.log.errors != out.failures) fault = "errors logged and returned are not the same";
    if (!fault && out.failures != failures) fault = failures ? "not one failure is returned" : "a failure is returned";
    if (!fault && failures && out.status != SPRINGLS_DEVICE_FAILED) fault = "its status is not that of the device";
    if (!fault && failures
        && (strcmp(out.text, out.log.error) != 0 || strstr(out.text, "opencl: ") != out.text
            || strstr(out.text, "going on without the device") == NULL))
        fault = "the text is not clear";
    if (!fault && out.hash != expected) fault = "the model is another one";
    if (!fault) return NULL;
    snprintf(message, sizeof message, "call %d, %s, error %d%s: %s. %d returned, %d lost; \"%s\"", call, stub->failed(), error,
             on ? " and all after it" : "", fault, out.failures, out.lost, out.text);
    return message;
}

TEST a_call_fails(const char *function, int error, int on, int stride)
{
    uint64_t expected;
    int call, calls, lost = 0;
    fault_outcome clean;
    NEEDS_STUB();
    fault_count();
    expected = fault_run(NULL, function).hash;
    ASSERT(expected != 0);
    clean = fault_run(reliable, function);
    ASSERT(clean.failures == 0 && clean.log.errors == 0 && clean.fault == NULL);
    ASSERT(clean.hash == expected);
    ASSERT(fault_leaves_nothing());
    calls = clean.calls;
    ASSERT_GT(calls, 20);
    for (call = 0; call < calls; call += stride) {
        const char *verdict = fault_verdict(function, call, error, on, expected, &lost);
        if (verdict) FAILm(verdict);
    }
    if (GREATEST_IS_VERBOSE()) printf("  %d calls, %d models lost\n", calls, lost);
    if (on) ASSERT_GT(lost, 0);
    PASS();
}

/* A view, which has no status, shows nothing of a lost model, and all of one that was read back. */
TEST a_view_fails(int on)
{
    fault_log log;
    fault_bench bench;
    springls_params p = springls_default_params();
    springls_desc desc = fixture_desc(FAULT_SIZE, &p);
    springls_view view;
    int count, before;
    NEEDS_STUB();
    fault_count();
    memset(&log, 0, sizeof log);
    desc.backend = reliable;
    desc.logger.log = fault_logger;
    desc.logger.user = &log;
    ASSERT_OK(springls_create(&desc, &bench.ctx));
    ASSERT_OK(fault_begin(&bench));
    ASSERT_OK(springls_run_stage(bench.ctx, SPRINGLS_STAGE_RELAX));
    before = springls_count(bench.ctx);
    stub->fail("clEnqueueReadBuffer", stub->calls("clEnqueueReadBuffer"), CL_OUT_OF_RESOURCES, on);
    view = springls_view_particles(bench.ctx);
    count = springls_count(bench.ctx);
    ASSERT_EQ(1, log.errors);
    ASSERT_EQ(on ? 0 : before, count);
    ASSERT_EQ(count, view.count);
    ASSERT_EQ(on, view.data == NULL);
    ASSERT(strstr(springls_last_error(bench.ctx), "opencl: download: out of device resources") != NULL);
    ASSERT_STATUS(on ? SPRINGLS_EMPTY_MODEL : SPRINGLS_OK, springls_run_stage(bench.ctx, SPRINGLS_STAGE_UNSIGNED_TO_SIGNED));
    springls_destroy(bench.ctx);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- programs that do not compile, and devices that are lost ---- */

/* Makes a context on a backend, with the model of the calls above, and moves it. */
FIXTURE springls_status fault_context(springls_backend *backend, fault_log *log, fault_bench *bench)
{
    springls_params p = springls_default_params();
    springls_desc desc = fixture_desc(FAULT_SIZE, &p);
    memset(log, 0, sizeof *log);
    desc.backend = backend;
    desc.logger.log = fault_logger;
    desc.logger.user = log;
    SPRINGLS__TRY(springls_create(&desc, &bench->ctx));
    return fault_begin(bench);
}

/* The call that first needs a program reports that it does not compile, and names the kernel; so does, without compiling again, that
   of another context. */
TEST a_program_does_not_compile(void)
{
    fault_log log, logs[2];
    fault_bench benches[2];
    springls_backend *backend;
    uint64_t expected;
    int i;
    NEEDS_STUB();
    ASSERT_OK(fault_context(NULL, logs, benches));
    ASSERT_OK(springls_run_stage(benches[0].ctx, SPRINGLS_STAGE_RELAX));
    expected = springls_state_hash(benches[0].ctx);
    springls_destroy(benches[0].ctx);
    fault_count();
    ASSERT_OK(fault_create(stub_path, &log, &backend));
    for (i = 0; i < 2; i++) ASSERT_OK(fault_context(backend, &logs[i], &benches[i]));
    for (i = 0; i < 2; i++) {
        stub->begin();
        stub->fail("clBuildProgram", 0, CL_BUILD_PROGRAM_FAILURE, 0);
        ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, springls_run_stage(benches[i].ctx, SPRINGLS_STAGE_RELAX));
        ASSERT_EQ(i == 0, stub->calls("clBuildProgram"));
        ASSERT(strstr(springls_last_error(benches[i].ctx), "opencl: shorten_arms: the kernels do not compile (-11)") != NULL);
        ASSERT(expected == springls_state_hash(benches[i].ctx));
        ASSERT_OK(springls_run_stage(benches[i].ctx, SPRINGLS_STAGE_RELAX));
        ASSERT_EQ(1, logs[i].errors);
    }
    ASSERT(strstr(log.lines, "springls.h:1234:5: error: made up by the stub\nand a second line\n") != NULL);
    ASSERT_EQ(2, log.warnings);
    for (i = 0; i < 2; i++) springls_destroy(benches[i].ctx);
    springls_cl_destroy(backend);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* When a device starts no kernels any more, or (lost) does nothing at all, each of its contexts fails once and goes on; a new backend
   works once the driver has a device again. */
TEST the_device_of_two_contexts_fails(int lost)
{
    fault_log log, logs[3];
    fault_bench benches[3];
    springls_backend *backend;
    uint64_t hash;
    int i;
    NEEDS_STUB();
    fault_count();
    for (i = 0; i < 2; i++) {
        ASSERT_OK(fault_context(reliable, &logs[i], &benches[i]));
        ASSERT_OK(springls_run_stage(benches[i].ctx, SPRINGLS_STAGE_RELAX));
    }
    hash = springls_state_hash(benches[0].ctx);
    for (i = 0; i < 2; i++) {
        if (i == 0 || !lost)
            stub->fail("clEnqueueNDRangeKernel", stub->calls("clEnqueueNDRangeKernel"), CL_DEVICE_NOT_AVAILABLE, lost);
        ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, springls_run_stage(benches[i].ctx, SPRINGLS_STAGE_RELAX));
        ASSERT(strstr(springls_last_error(benches[i].ctx), "the device is lost") != NULL);
        ASSERT_EQ(lost, (springls_count(benches[i].ctx) == 0));
        ASSERT_OK(fault_begin(&benches[i]));
        ASSERT_OK(springls_run_stage(benches[i].ctx, SPRINGLS_STAGE_RELAX));
        ASSERT(hash == springls_state_hash(benches[i].ctx));
        ASSERT_EQ(1, logs[i].errors);
    }
    if (lost) ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, fault_create(stub_path, &log, &backend));
    stub->begin();
    ASSERT_OK(fault_create(stub_path, &log, &backend));
    ASSERT_OK(fault_context(backend, &logs[2], &benches[2]));
    ASSERT_OK(springls_run_stage(benches[2].ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_GT(springls_cl_get_counts(backend).kernels, 5);
    ASSERT(hash == springls_state_hash(benches[2].ctx));
    for (i = 0; i < 3; i++) springls_destroy(benches[i].ctx);
    springls_cl_destroy(backend);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- tilings ---- */

/* Makes two balls that touch, on a backend, and three steps. */
FIXTURE springls_status fault_tiling(springls_backend *backend, fixture_heap *heap, springls_tiling **tiling)
{
    springls_desc desc = fixture_desc(24, NULL);
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    springls_status status;
    int i;
    desc.backend = backend;
    desc.allocator = fixture_allocator(heap);
    status = springls_tiling_create(&desc, tiling);
    for (i = 0; i < 2 && status == SPRINGLS_OK; i++) {
        springls_sphere ball = { { 7.5f, 11.5f, 11.5f }, 3.9f };
        if (i) ball.center[0] = 15.4f;
        status = springls_tiling_add_implicit(*tiling, 1 + i, springls_implicit_sphere, &ball);
    }
    step.dt = step.tension = 0.25f;
    for (i = 0; i < 3 && status == SPRINGLS_OK; i++) status = springls_tiling_step(*tiling, &step, NULL);
    return status;
}

/* The step that the device may fail in. */
FIXTURE springls_status fault_tiling_step(springls_tiling *tiling)
{
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    step.dt = step.tension = 0.25f;
    return springls_tiling_step(tiling, &step, NULL);
}

/* Wherever the device fails in a step, once or (on) for good, the tiling is as before, and the next step has the same bits. */
TEST a_step_of_a_tiling_fails(int on)
{
    enum { PLACES = 24 };
    springls_tiling *tiling;
    fixture_heap heap;
    uint64_t before, after;
    int calls, k;
    NEEDS_STUB();
    fault_count();
    ASSERT_OK(fault_tiling(NULL, &heap, &tiling));
    before = springls_tiling_state_hash(tiling);
    ASSERT_OK(fault_tiling_step(tiling));
    after = springls_tiling_state_hash(tiling);
    springls_tiling_destroy(tiling);
    for (calls = 0, k = -1; k < PLACES; k++) {
        int first;
        stub->begin();
        ASSERT_OK(fault_tiling(reliable, &heap, &tiling));
        ASSERT(before == springls_tiling_state_hash(tiling));
        first = stub->calls(NULL);
        if (k >= 0)
            stub->fail(NULL, first + (2 * k + 1) * calls / (2 * PLACES), on ? CL_DEVICE_NOT_AVAILABLE : CL_MEM_OBJECT_ALLOCATION_FAILURE,
                       on);
        ASSERT_STATUS(k < 0 ? SPRINGLS_OK : SPRINGLS_DEVICE_FAILED, fault_tiling_step(tiling));
        if (k < 0) calls = stub->calls(NULL) - first;
        stub->fail(NULL, 0, CL_SUCCESS, 0);
        if (k >= 0) {
            ASSERT(strstr(springls_tiling_last_error(tiling), "going on without the device") != NULL);
            ASSERT(before == springls_tiling_state_hash(tiling));
            ASSERT_OK(fault_tiling_step(tiling));
        }
        ASSERT(after == springls_tiling_state_hash(tiling));
        springls_tiling_destroy(tiling);
        ASSERT_EQ(0, heap.blocks);
        ASSERT(fault_leaves_nothing());
    }
    ASSERT_GT(calls, 100);
    PASS();
}

/* A step in which no force acts. */
FIXTURE springls_status fault_resting_step(springls_tiling *tiling)
{
    springls_tiling_step_desc step = springls_default_tiling_step_desc();
    step.dt = 0.125f;
    return springls_tiling_step(tiling, &step, NULL);
}

/* Makes the balls, and steps until all three bodies are at rest. */
FIXTURE springls_status fault_resting_tiling(springls_backend *backend, fixture_heap *heap, springls_tiling **tiling)
{
    springls_status status = fault_tiling(backend, heap, tiling);
    int i, body, resting = 0;
    for (i = 0; i < 600 && resting < 3 && status == SPRINGLS_OK; i++) {
        status = fault_resting_step(*tiling);
        for (resting = body = 0; body < 3; body++) resting += !(*tiling)->body[body].rest.awake;
    }
    return resting == 3 ? status : SPRINGLS_CANCELLED;
}

/* Returns whether the models have the springls and the counts of steps given, and are `dt` later. */
FIXTURE bool fault_rests(const springls_tiling *tiling, const springls_stats stats[3], const double times[3], double dt)
{
    int i;
    for (i = 0; i < 3; i++) {
        const springls_context *ctx = tiling->body[i].ctx;
        const springls_stats now = springls_get_stats(ctx);
        if (springls_count(ctx) == 0 || now.springls != stats[i].springls) return false;
        if (now.steps != stats[i].steps + (dt > 0.0) || springls_time(ctx) != times[i] + dt) return false;
    }
    return true;
}

/* Bodies at rest ask nothing of a device that is lost. Where stages are timed they wait for it: that fails, once for each body, which
   leaves all bodies as they are, also those that had counted the step. */
TEST a_step_of_resting_bodies_fails(bool timed)
{
    springls_tiling *tiling;
    springls_stats stats[3];
    double times[3];
    fixture_heap heap;
    uint64_t before;
    int i, first;
    NEEDS_STUB();
    fault_count();
    ASSERT_OK(fault_resting_tiling(reliable, &heap, &tiling));
    before = springls_tiling_state_hash(tiling);
    for (i = 0; i < 3; i++) {
        stats[i] = springls_get_stats(tiling->body[i].ctx);
        times[i] = springls_time(tiling->body[i].ctx);
    }
    reliable->timed = timed;
    first = stub->calls(NULL);
    stub->fail(NULL, first + timed, CL_DEVICE_NOT_AVAILABLE, 1); /* timed: the second body's */
    ASSERT_STATUS(timed ? SPRINGLS_DEVICE_FAILED : SPRINGLS_OK, fault_resting_step(tiling));
    reliable->timed = false;
    if (!timed) ASSERT_EQ(first, stub->calls(NULL));
    stub->fail(NULL, 0, CL_SUCCESS, 0);
    ASSERT(fault_rests(tiling, stats, times, timed ? 0.0 : 0.125));
    ASSERT(before == springls_tiling_state_hash(tiling));
    ASSERT_OK(fault_resting_step(tiling));
    if (timed) ASSERT(fault_rests(tiling, stats, times, 0.125));
    springls_tiling_destroy(tiling);
    ASSERT_EQ(0, heap.blocks);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- what the message says ---- */

/* A kernel fails unseen until the device is waited for: the message names those that were started since it last was. */
TEST a_failure_names_the_last_kernels(void)
{
    fault_log log;
    fault_bench bench;
    NEEDS_STUB();
    fault_count();
    ASSERT_OK(fault_context(reliable, &log, &bench));
    stub->fail("clEnqueueReadBuffer", stub->calls("clEnqueueReadBuffer"), CL_OUT_OF_RESOURCES, 0);
    ASSERT_STATUS(SPRINGLS_DEVICE_FAILED, springls_run_stage(bench.ctx, SPRINGLS_STAGE_RELAX));
    ASSERT_STR_EQ("opencl: download: out of device resources (-5); last started: cells_count, cells_clear, counts_clear; "
                  "going on without the device",
                  springls_last_error(bench.ctx));
    springls_destroy(bench.ctx);
    ASSERT(fault_leaves_nothing());
    PASS();
}

/* ---- each public call by itself ---- */

/* The model after a call, and how many calls into OpenCL that has made. */
typedef struct call_end_state {
    springls_status status;
    uint64_t hash;
    int count, calls;
    fault_log log;
    char text[256];
} call_end_state;

/* Returns whether a call consists of steps: those that were complete when the device failed stay, and the call adds to them when it
   is made again. */
FIXTURE bool call_has_steps(const call_row *call) { return call->run == call_run || call->run == call_smooth; }
FIXTURE bool call_combines(const call_row *call)
{
    return call->run == call_combine || call->run == call_combine_begin || call->run == call_combine_continue;
}

/* Makes a call on a model that has moved; call number fail_at into OpenCL fails, once or (on) from there on; -1: none. A call that
   has failed is made again unless it has been completed without the device. Returns what is wrong; NULL: nothing. */
FIXTURE const char *call_with_fault(const call_row *call, call_bench *b, int fail_at, int on, const call_end_state *expected,
                                    call_end_state *end)
{
    const char *fault = NULL;
    fixture_heap heap;
    memset(end, 0, sizeof *end);
    b->desc.allocator = fixture_allocator(&heap);
    b->desc.logger.log = fault_logger;
    b->desc.logger.user = &end->log;
    if (call_begin(b, CALL_STATE_MOVED) != SPRINGLS_OK) return "the model cannot be brought to the device";
    end->calls = stub->calls(NULL);
    if (fail_at >= 0)
        stub->fail(NULL, end->calls + fail_at, on ? CL_DEVICE_NOT_AVAILABLE : CL_MEM_OBJECT_ALLOCATION_FAILURE, on);
    end->status = call->run(b);
    end->calls = stub->calls(NULL) - end->calls;
    snprintf(end->text, sizeof end->text, "%s", springls_last_error(b->ctx));
    stub->fail(NULL, 0, CL_SUCCESS, 0);
    end->hash = springls_state_hash(b->ctx);
    end->count = springls_count(b->ctx);
    if (fail_at >= 0 && end->status != expected->status) {
        if (end->status != SPRINGLS_DEVICE_FAILED) fault = "it is not reported as a failure of the device";
        else if (!strstr(end->text, "going on without the device")) fault = "the text is not clear";
        else if (end->count == 0 && springls_restore(b->ctx, b->snapshots[1], b->sizes[1]) != SPRINGLS_OK) fault = "no other model";
        else if ((end->count == 0 || end->hash != expected->hash) && call->run(b) != expected->status) fault = "no second time";
        else if (!call_has_steps(call) && springls_state_hash(b->ctx) != expected->hash) fault = "the model is another one";
    }
    call_end(b);
    if (!fault && end->log.errors > 1 + call_combines(call)) fault = "it is reported twice"; /* two models report */
    if (!fault && (heap.blocks != 0 || heap.wrong_sizes != 0 || !fault_leaves_nothing())) fault = "something is left";
    return fault;
}

enum { CALL_FAULTS = 12 }; /* of each kind in a call */

TEST a_public_call_fails(const call_row *call, call_bench *b)
{
    static call_end_state expected, clean, end;
    int on, k;
    NEEDS_STUB();
    fault_count();
    b->desc.backend = NULL;
    ASSERT_EQ(NULL, call_with_fault(call, b, -1, 0, NULL, &expected));
    b->desc.backend = reliable;
    ASSERT_EQ(NULL, call_with_fault(call, b, -1, 0, NULL, &clean));
    ASSERT_EQ(expected.status, clean.status);
    ASSERT(expected.hash == clean.hash);
    ASSERT_EQ(0, clean.log.errors);
    for (on = 0; on < 2; on++)
        for (k = 0; k < CALL_FAULTS && k < clean.calls; k++) {
            const int fail_at = (2 * k + 1) * clean.calls / (2 * CALL_FAULTS);
            const char *fault = call_with_fault(call, b, fail_at, on, &expected, &end);
            if (fault) {
                printf("\n  %s, call %d of %d%s: %s; %s, \"%s\"\n", call->name, fail_at, clean.calls, on ? " and all after it" : "",
                       fault, springls_status_string(end.status), end.text);
                FAILm(fault);
            }
        }
    PASS();
}

SUITE(calls)
{
    RUN_EVERY_CALL(a_public_call_fails);
}

SUITE(making)
{
    RUN_TESTp(making_a_backend_fails, CL_OUT_OF_HOST_MEMORY);
    RUN_TEST(kernels_do_not_compile);
    RUN_TEST(no_platform_and_no_library);
    RUN_TEST(queues_of_the_caller);
    RUN_TEST(functions_are_missing);
    RUN_TEST(kernels_are_compiled_before_the_first_step);
    RUN_TESTp(preparing_fails, "clEnqueueNDRangeKernel", CL_OUT_OF_RESOURCES);
    RUN_TESTp(preparing_fails, "clFinish", CL_DEVICE_NOT_AVAILABLE);
    RUN_TESTp(preparing_fails, "clCreateBuffer", CL_MEM_OBJECT_ALLOCATION_FAILURE);
    RUN_TESTp(preparing_fails, "clSetKernelArg", CL_OUT_OF_HOST_MEMORY);
}

SUITE(working)
{
    int on;
    for (on = 0; on < 2; on++) {
        greatest_set_test_suffix(on ? "for_good" : "once");
        RUN_TESTp(a_view_fails, on);
        greatest_set_test_suffix(on ? "for_good" : "once");
        RUN_TESTp(the_device_of_two_contexts_fails, on);
        greatest_set_test_suffix(on ? "for_good" : "once");
        RUN_TESTp(a_step_of_a_tiling_fails, on);
    }
    RUN_TESTp(a_step_of_resting_bodies_fails, false);
    greatest_set_test_suffix("timed");
    RUN_TESTp(a_step_of_resting_bodies_fails, true);
    RUN_TEST(a_program_does_not_compile);
    RUN_TEST(a_failure_names_the_last_kernels);
    greatest_set_test_suffix("out_of_memory");
    RUN_TESTp(a_call_fails, NULL, CL_MEM_OBJECT_ALLOCATION_FAILURE, 0, 1);
    greatest_set_test_suffix("device_lost");
    RUN_TESTp(a_call_fails, NULL, CL_DEVICE_NOT_AVAILABLE, 1, 1);
    greatest_set_test_suffix("work_group_limit");
    RUN_TESTp(a_call_fails, "clEnqueueNDRangeKernel", CL_INVALID_WORK_GROUP_SIZE, 0, 5);
    greatest_set_test_suffix("argument");
    RUN_TESTp(a_call_fails, "clSetKernelArg", CL_OUT_OF_RESOURCES, 0,
              97); /* all kernels are given the same ones: some of them all */
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    const char *slash = strrchr(argv[0], '/');
    void *library;
    fault_log log;
    GREATEST_MAIN_BEGIN();
    snprintf(stub_path, sizeof stub_path, "%.*s/opencl_stub.so", slash ? (int)(slash - argv[0]) : 1,
             slash ? argv[0] : "."); /* beside this program */
    library = SPRINGLS__CL_OPEN(stub_path);
    if (library) stub = (const stub_controls *)SPRINGLS__CL_FIND(library, "stub_control");
    if (!stub) printf("there is no %s\n", stub_path);
    if (stub) stub->begin();
    if (stub && (fault_create(stub_path, &log, &reliable) != SPRINGLS_OK || !springls_cl_exact(reliable))) stub = NULL;
    if (stub && springls_cl_prepare(reliable, NULL) != SPRINGLS_OK) stub = NULL; /* no call of a test compiles anything */
    RUN_SUITE(making);
    RUN_SUITE(working);
    RUN_SUITE(calls);
    springls_cl_destroy(reliable);
    GREATEST_MAIN_END();
}
