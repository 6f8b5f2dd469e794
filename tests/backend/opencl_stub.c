/* opencl_stub.c - a shared library that stands before the real OpenCL library: it passes every call on, but for those
   that a test has chosen to fail, and counts objects that are made, retained and released. */
#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#define CL_USE_DEPRECATED_OPENCL_1_2_APIS
#include <CL/cl.h>
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "opencl_stub.h"

static const char build_log[] = "springls.h:1234:5: error: made up by the stub\nand a second line\n";

/* ---- threads: programs are built on several ---- */

static char busy;

static void lock(void)
{
    while (__atomic_test_and_set(&busy, __ATOMIC_ACQUIRE)) continue;
}

static void unlock(void) { __atomic_clear(&busy, __ATOMIC_RELEASE); }

/* ---- faults ---- */

typedef struct stub_count { char function[40]; int calls; } stub_count;

static struct {
    stub_count counts[64]; /* by function; the first: of all that may fail */
    char function[40], failed[40], misuse[40];
    int at, error, on, hidden, build_failed, other_driver;
} stub;

static int *calls_of(const char *function)
{
    int i;
    for (i = 1; i < 63 && stub.counts[i].function[0] && strcmp(stub.counts[i].function, function) != 0; i++) continue;
    strcpy(stub.counts[i].function, function);
    return &stub.counts[i].calls;
}

static int fails(int call) { return stub.error && (call == stub.at || (stub.on && call > stub.at)); }

/* Returns the error with which a call fails; every function that may fail begins with this. */
static cl_int fault(const char *function)
{
    int argument = strcmp(function, "clSetKernelArg") == 0, call, any, now;
    lock();
    call = (*calls_of(function))++;
    any = argument ? -1 : stub.counts[0].calls++;
    now = stub.function[0] ? strcmp(stub.function, function) == 0 && fails(call) : !argument && fails(any);
    if (stub.failed[0] && stub.on) now = 1;
    if (now && !stub.failed[0]) strcpy(stub.failed, function);
    unlock();
    return now ? stub.error : CL_SUCCESS;
}

/* ---- objects ---- */

typedef struct stub_object { const void *handle; int memory, references; } stub_object;

static stub_object objects[4096];
static int object_count;

static stub_object *find(const void *handle)
{
    int i;
    for (i = 0; i < object_count; i++)
        if (objects[i].handle == handle) return &objects[i];
    return NULL;
}

/* Returns the object that a function was given; notes when there is none. */
static stub_object *given(const char *function, const void *handle)
{
    stub_object *object = find(handle);
    if (!object && !stub.misuse[0]) strcpy(stub.misuse, function);
    return object;
}

static void used(const char *function, const void *handle)
{
    lock();
    given(function, handle);
    unlock();
}

static void made(const void *handle, int memory)
{
    lock();
    if (handle && object_count < 4096) {
        objects[object_count].handle = handle;
        objects[object_count].memory = memory;
        objects[object_count++].references = 1;
    }
    unlock();
}

static void retained(const char *function, const void *handle)
{
    stub_object *object;
    lock();
    object = given(function, handle);
    if (object) object->references++;
    unlock();
}

static void released(const char *function, const void *handle)
{
    stub_object *object;
    lock();
    object = given(function, handle);
    if (object && --object->references == 0) *object = objects[--object_count];
    unlock();
}

/* ---- kernels that have been started ---- */

typedef struct stub_launch { cl_kernel kernel; size_t local; } stub_launch;

static stub_launch launched[1024];
static int launch_count;

static void started(cl_kernel kernel, size_t local)
{
    int i;
    for (i = 0; i < launch_count; i++)
        if (launched[i].kernel == kernel && launched[i].local == local) return;
    if (launch_count == 1024) abort();
    launched[launch_count].kernel = kernel;
    launched[launch_count++].local = local;
}

/* A handle may come again. */
static void forget_kernel(cl_kernel kernel)
{
    int i;
    for (i = launch_count - 1; i >= 0; i--)
        if (launched[i].kernel == kernel) launched[i] = launched[--launch_count];
}

/* ---- what tests call ---- */

static void begin(void) { memset(&stub, 0, sizeof stub); }

static void fail(const char *function, int call, int error, int on)
{
    strcpy(stub.function, function ? function : "");
    stub.at = call;
    stub.error = error;
    stub.on = on;
}

static void hide_platforms(int hidden) { stub.hidden = hidden; }
static int calls(const char *function) { return function ? *calls_of(function) : stub.counts[0].calls; }
static int live(void) { return object_count; }
static int launches(void) { return launch_count; }

static void other_driver(int kind) { stub.other_driver = kind; }

static int live_memories(void)
{
    int i, n = 0;
    for (i = 0; i < object_count; i++) n += objects[i].memory;
    return n;
}

static const char *misuse(void) { return stub.misuse; }
static const char *failed(void) { return stub.failed; }

extern const stub_controls stub_control;
const stub_controls stub_control = { begin, fail, hide_platforms, calls, launches, live, live_memories, misuse, failed,
                                     other_driver };

/* ---- OpenCL ---- */

static void *real(const char *function)
{
    static void *library;
    void *symbol;
    if (!library) library = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
    symbol = library ? dlsym(library, function) : NULL;
    if (!symbol) {
        fprintf(stderr, "opencl_stub: there is no real %s\n", function);
        abort();
    }
    return symbol;
}

/* The same function of the real library. */
#define REAL(function, ...) (*(__typeof__(function) *)real_pointer(#function))(__VA_ARGS__)

typedef void stub_function(void);

static stub_function *real_pointer(const char *function)
{
    void *symbol = real(function);
    stub_function *pointer;
    memcpy(&pointer, &symbol, sizeof pointer);
    return pointer;
}

/* Leaves a function that gives an error code, or one that makes an object. */
#define MAY_FAIL(function) \
    do { cl_int error_ = fault(#function); if (error_ != CL_SUCCESS) return error_; } while (0)
#define MAY_MAKE_NOTHING(function, code) \
    do { cl_int error_ = fault(#function); if (error_ != CL_SUCCESS) { if (code) *(code) = error_; return NULL; } } while (0)

cl_int clGetPlatformIDs(cl_uint most, cl_platform_id *platforms, cl_uint *count)
{
    MAY_FAIL(clGetPlatformIDs);
    if (!stub.hidden) return REAL(clGetPlatformIDs, most, platforms, count);
    if (count) *count = 0;
    return CL_SUCCESS;
}

cl_int clGetPlatformInfo(cl_platform_id platform, cl_platform_info what, size_t size, void *value, size_t *size_out)
{
    MAY_FAIL(clGetPlatformInfo);
    if (stub.other_driver && what == CL_PLATFORM_NAME && value) {
        snprintf((char *)value, size, "a stub");
        return CL_SUCCESS;
    }
    return REAL(clGetPlatformInfo, platform, what, size, value, size_out);
}

cl_int clGetDeviceIDs(cl_platform_id platform, cl_device_type type, cl_uint most, cl_device_id *devices, cl_uint *count)
{
    MAY_FAIL(clGetDeviceIDs);
    return REAL(clGetDeviceIDs, platform, type, most, devices, count);
}

cl_int clGetDeviceInfo(cl_device_id device, cl_device_info what, size_t size, void *value, size_t *size_out)
{
    MAY_FAIL(clGetDeviceInfo);
    return REAL(clGetDeviceInfo, device, what, size, value, size_out);
}

cl_context clCreateContext(const cl_context_properties *properties, cl_uint count, const cl_device_id *devices,
                           void (CL_CALLBACK *notify)(const char *, const void *, size_t, void *), void *user, cl_int *code)
{
    cl_context context;
    MAY_MAKE_NOTHING(clCreateContext, code);
    context = REAL(clCreateContext, properties, count, devices, notify, user, code);
    made(context, 0);
    return context;
}

cl_int clRetainContext(cl_context context)
{
    MAY_FAIL(clRetainContext);
    retained("clRetainContext", context);
    return REAL(clRetainContext, context);
}

cl_int clReleaseContext(cl_context context)
{
    released("clReleaseContext", context);
    return REAL(clReleaseContext, context);
}

cl_int clGetContextInfo(cl_context context, cl_context_info what, size_t size, void *value, size_t *size_out)
{
    MAY_FAIL(clGetContextInfo);
    used("clGetContextInfo", context);
    return REAL(clGetContextInfo, context, what, size, value, size_out);
}

cl_command_queue clCreateCommandQueue(cl_context context, cl_device_id device, cl_command_queue_properties properties, cl_int *code)
{
    cl_command_queue queue;
    MAY_MAKE_NOTHING(clCreateCommandQueue, code);
    used("clCreateCommandQueue", context);
    queue = REAL(clCreateCommandQueue, context, device, properties, code);
    made(queue, 0);
    return queue;
}

cl_int clGetCommandQueueInfo(cl_command_queue queue, cl_command_queue_info what, size_t size, void *value, size_t *size_out)
{
    MAY_FAIL(clGetCommandQueueInfo);
    used("clGetCommandQueueInfo", queue);
    return REAL(clGetCommandQueueInfo, queue, what, size, value, size_out);
}

cl_int clRetainCommandQueue(cl_command_queue queue)
{
    MAY_FAIL(clRetainCommandQueue);
    retained("clRetainCommandQueue", queue);
    return REAL(clRetainCommandQueue, queue);
}

cl_int clReleaseCommandQueue(cl_command_queue queue)
{
    released("clReleaseCommandQueue", queue);
    return REAL(clReleaseCommandQueue, queue);
}

/* The text of a program; text NULL: an unused entry. Compiled programs are their text, with other_driver(2). */
typedef struct stub_program { cl_program program; char *text; size_t bytes; } stub_program;

static stub_program programs[256];

/* Notes the text of a program, of `bytes` bytes, which it takes. */
static void keep_text(cl_program program, char *text, size_t bytes)
{
    int i;
    lock();
    for (i = 0; i < 255 && programs[i].text; i++) continue;
    free(programs[i].text);
    programs[i].program = program;
    programs[i].text = text;
    programs[i].bytes = bytes;
    unlock();
}

static stub_program *text_of(cl_program program)
{
    int i;
    for (i = 0; i < 255 && (!programs[i].text || programs[i].program != program); i++) continue;
    return &programs[i];
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char **lines, const size_t *lengths, cl_int *code)
{
    cl_program program;
    MAY_MAKE_NOTHING(clCreateProgramWithSource, code);
    used("clCreateProgramWithSource", context);
    program = REAL(clCreateProgramWithSource, context, count, lines, lengths, code);
    made(program, 0);
    if (program && stub.other_driver == 2) {
        size_t bytes = 0;
        cl_uint i;
        char *text;
        for (i = 0; i < count; i++) bytes += strlen(lines[i]);
        text = (char *)calloc(bytes + 1, 1);
        for (bytes = 0, i = 0; i < count; bytes += strlen(lines[i++])) memcpy(text + bytes, lines[i], strlen(lines[i]));
        keep_text(program, text, bytes);
    }
    return program;
}

cl_program clCreateProgramWithBinary(cl_context context, cl_uint count, const cl_device_id *devices, const size_t *sizes,
                                     const unsigned char **binaries, cl_int *status, cl_int *code)
{
    cl_program program;
    MAY_MAKE_NOTHING(clCreateProgramWithBinary, code);
    used("clCreateProgramWithBinary", context);
    if (stub.other_driver == 2) {
        const char *text = (const char *)*binaries;
        char *copy = (char *)malloc(*sizes);
        program = REAL(clCreateProgramWithSource, context, 1, &text, sizes, code);
        memcpy(copy, *binaries, *sizes);
        keep_text(program, copy, *sizes);
        *status = CL_SUCCESS;
    } else {
        program = REAL(clCreateProgramWithBinary, context, count, devices, sizes, binaries, status, code);
    }
    made(program, 0);
    return program;
}

cl_int clGetProgramInfo(cl_program program, cl_program_info what, size_t size, void *value, size_t *size_out)
{
    const stub_program *known;
    MAY_FAIL(clGetProgramInfo);
    used("clGetProgramInfo", program);
    if (stub.other_driver != 2 || (what != CL_PROGRAM_BINARY_SIZES && what != CL_PROGRAM_BINARIES))
        return REAL(clGetProgramInfo, program, what, size, value, size_out);
    lock();
    known = text_of(program);
    if (what == CL_PROGRAM_BINARY_SIZES) *(size_t *)value = known->bytes;
    else memcpy(*(unsigned char **)value, known->text, known->bytes);
    unlock();
    return CL_SUCCESS;
}

cl_int clBuildProgram(cl_program program, cl_uint count, const cl_device_id *devices, const char *options,
                      void (CL_CALLBACK *notify)(cl_program, void *), void *user)
{
    cl_int error = fault("clBuildProgram");
    used("clBuildProgram", program);
    stub.build_failed = error == CL_BUILD_PROGRAM_FAILURE;
    return error != CL_SUCCESS ? error : REAL(clBuildProgram, program, count, devices, options, notify, user);
}

cl_int clGetProgramBuildInfo(cl_program program, cl_device_id device, cl_program_build_info what, size_t size, void *value,
                             size_t *size_out)
{
    MAY_FAIL(clGetProgramBuildInfo);
    used("clGetProgramBuildInfo", program);
    if (!stub.build_failed || what != CL_PROGRAM_BUILD_LOG)
        return REAL(clGetProgramBuildInfo, program, device, what, size, value, size_out);
    if (size_out) *size_out = sizeof build_log;
    if (value && size < sizeof build_log) return CL_INVALID_VALUE;
    if (value) memcpy(value, build_log, sizeof build_log);
    return CL_SUCCESS;
}

cl_int clReleaseProgram(cl_program program)
{
    stub_program *known;
    released("clReleaseProgram", program);
    lock();
    known = text_of(program);
    free(known->text);
    known->text = NULL;
    unlock();
    return REAL(clReleaseProgram, program);
}

cl_kernel clCreateKernel(cl_program program, const char *name, cl_int *code)
{
    cl_kernel kernel;
    MAY_MAKE_NOTHING(clCreateKernel, code);
    used("clCreateKernel", program);
    kernel = REAL(clCreateKernel, program, name, code);
    made(kernel, 0);
    return kernel;
}

cl_int clReleaseKernel(cl_kernel kernel)
{
    released("clReleaseKernel", kernel);
    forget_kernel(kernel);
    return REAL(clReleaseKernel, kernel);
}

cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void *value)
{
    MAY_FAIL(clSetKernelArg);
    used("clSetKernelArg", kernel);
    return REAL(clSetKernelArg, kernel, index, size, value);
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions, const size_t *offset,
                              const size_t *global, const size_t *local, cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    MAY_FAIL(clEnqueueNDRangeKernel);
    used("clEnqueueNDRangeKernel", queue);
    used("clEnqueueNDRangeKernel", kernel);
    started(kernel, local ? *local : 0);
    return REAL(clEnqueueNDRangeKernel, queue, kernel, dimensions, offset, global, local, wait_count, wait, event);
}

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void *host, cl_int *code)
{
    cl_mem memory;
    MAY_MAKE_NOTHING(clCreateBuffer, code);
    used("clCreateBuffer", context);
    memory = REAL(clCreateBuffer, context, flags, size, host, code);
    made(memory, 1);
    return memory;
}

cl_int clReleaseMemObject(cl_mem memory)
{
    released("clReleaseMemObject", memory);
    return REAL(clReleaseMemObject, memory);
}

cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking, size_t offset, size_t size, void *to,
                           cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    MAY_FAIL(clEnqueueReadBuffer);
    used("clEnqueueReadBuffer", queue);
    used("clEnqueueReadBuffer", memory);
    return REAL(clEnqueueReadBuffer, queue, memory, blocking, offset, size, to, wait_count, wait, event);
}

cl_int clEnqueueWriteBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking, size_t offset, size_t size, const void *from,
                            cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    MAY_FAIL(clEnqueueWriteBuffer);
    used("clEnqueueWriteBuffer", queue);
    used("clEnqueueWriteBuffer", memory);
    return REAL(clEnqueueWriteBuffer, queue, memory, blocking, offset, size, from, wait_count, wait, event);
}

cl_int clEnqueueCopyBuffer(cl_command_queue queue, cl_mem from, cl_mem to, size_t from_offset, size_t to_offset, size_t size,
                           cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    MAY_FAIL(clEnqueueCopyBuffer);
    used("clEnqueueCopyBuffer", queue);
    used("clEnqueueCopyBuffer", from);
    used("clEnqueueCopyBuffer", to);
    return REAL(clEnqueueCopyBuffer, queue, from, to, from_offset, to_offset, size, wait_count, wait, event);
}

cl_int clFinish(cl_command_queue queue)
{
    MAY_FAIL(clFinish);
    used("clFinish", queue);
    return REAL(clFinish, queue);
}
