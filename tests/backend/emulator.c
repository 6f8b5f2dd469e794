/* emulator.c - an OpenCL library whose one device is this processor, for tests: its kernels are compiled as C (opencl_kernels.c),
   so that sanitizers watch all that they do. There is no driver and nothing to compile at run time.
   - A buffer is a block of its own, of the size asked for, and so is the memory that a group shares.
   - It is a GPU to the library: 64 items share a brick. Each is a fiber that runs up to a barrier, forwards and backwards in turn.
     A barrier that some items leave out ends the program.
   - To ThreadSanitizer fibers are threads that barriers alone put in order, so that it finds a race in any one run.
   - A sanitizer's report is followed by the kernel, the array and the index.
   - A test can say how much of a buffer is in use (device_limit): to AddressSanitizer the rest is no memory. */
#define _XOPEN_SOURCE 700 /* ucontext.h, _longjmp */
#undef _FORTIFY_SOURCE    /* takes a jump to another stack for a fault */
#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#define CL_USE_DEPRECATED_OPENCL_1_2_APIS
#include <CL/cl.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>

#include "opencl_kernels.h"

#ifndef __has_feature
#define __has_feature(name) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || __has_feature(address_sanitizer)
#define WITH_ASAN 1
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#else
#define WITH_ASAN 0
#endif
#if defined(__SANITIZE_THREAD__) || __has_feature(thread_sanitizer)
#define WITH_TSAN 1
#include <sanitizer/tsan_interface.h>
#define UNWATCHED __attribute__((no_sanitize("thread"))) /* what the device does between items is no part of them */
#else
#define WITH_TSAN 0
#define UNWATCHED
#endif
#define WITH_MSAN __has_feature(memory_sanitizer)
#define WATCHED (WITH_ASAN || WITH_TSAN || WITH_MSAN)

struct _cl_mem { size_t size; void *data; };

struct _cl_kernel {
    const device_kernel *kernel;
    device_arguments arguments;
    size_t size; /* of the memory, bytes */
};

/* Makes a block of nonsense. MemorySanitizer knows that a new block is. */
static void *block_new(size_t size)
{
    void *block = malloc(size);
    if (block && !WITH_MSAN && !WITH_TSAN) memset(block, 0xA5, size);
    return block;
}

/* ---- the items of a group ---- */

enum { ITEMS = 64, STACK = 1 << 18 };

typedef struct device_fiber {
    ucontext_t context;
    jmp_buf place;         /* where it goes on, once it has begun         */
    bool begun;
    const void *stack;
    size_t stack_size;
    void *frames, *thread; /* of AddressSanitizer and ThreadSanitizer */
    int first;             /* what it runs (device_run_item)          */
    springls__group group;
    const char *file;      /* the barrier at which it waits           */
    int line, barriers;    /* barriers: that it has come to           */
    bool done;
} device_fiber;

static struct {
    cl_kernel kernel;   /* NULL: none runs */
    float *memory;      /* of the group    */
    device_fiber *item; /* NULL: none      */
    int launches;
    char begin, end;    /* what ThreadSanitizer knows a launch by */
} running;

static device_fiber caller, fibers[ITEMS];

static void happens_before(void *place)
{
#if WITH_TSAN
    __tsan_release(place);
#else
    (void)place;
#endif
}

static void happens_after(void *place)
{
#if WITH_TSAN
    __tsan_acquire(place);
#else
    (void)place;
#endif
}

/* swapcontext is what sanitizers follow; its calls of the operating system take as long as the kernels. */
UNWATCHED static void switch_fiber(device_fiber *from, device_fiber *to)
{
#if !WATCHED
    from->begun = true;
    if (_setjmp(from->place)) return;
    if (to->begun) _longjmp(to->place, 1);
    setcontext(&to->context);
#else
#if WITH_ASAN
    __sanitizer_start_switch_fiber(&from->frames, to->stack, to->stack_size);
#endif
#if WITH_TSAN
    __tsan_switch_to_fiber(to->thread, __tsan_switch_to_fiber_no_sync);
#endif
    swapcontext(&from->context, &to->context);
#if WITH_ASAN
    __sanitizer_finish_switch_fiber(from->frames, NULL, NULL);
#endif
#endif
}

/* Runs one item after the other, for ever. */
UNWATCHED static void fiber_main(void)
{
#if WITH_ASAN
    __sanitizer_finish_switch_fiber(NULL, &caller.stack, &caller.stack_size);
#endif
    for (;;) {
        device_fiber *me = running.item;
        happens_after(&running.begin);
        device_run_item(running.kernel->kernel, &running.kernel->arguments, me->first, me->group, running.memory);
        happens_before(&running.end);
        me->done = true;
        switch_fiber(me, &caller);
    }
}

UNWATCHED void device_barrier(const char *file, int line)
{
    device_fiber *me = running.item;
    char *place;
    if (!me) return;
    me->file = file;
    me->line = line;
    place = (char *)running.memory + me->barriers++ % 2; /* not the last barrier's: items ahead have been to the next one already */
    happens_before(place);
    switch_fiber(me, &caller);
    happens_after(place);
}

static void fiber_make(device_fiber *fiber, void *stack)
{
    getcontext(&fiber->context);
    fiber->context.uc_stack.ss_sp = stack;
    fiber->context.uc_stack.ss_size = fiber->stack_size = STACK;
    fiber->stack = stack;
    makecontext(&fiber->context, fiber_main, 0);
#if WITH_TSAN
    fiber->thread = __tsan_create_fiber(0);
#endif
}

static void fibers_make(void)
{
    static unsigned char stacks[ITEMS][STACK];
    int i;
#if WITH_TSAN
    caller.thread = __tsan_get_current_fiber();
#endif
    for (i = 0; i < ITEMS && !fibers[i].stack; i++) fiber_make(&fibers[i], stacks[i]);
}

/* Ends the program unless all items are done, or all wait at one barrier. */
static void check_barrier(device_fiber *const *items, int count)
{
    int i;
    for (i = 1; i < count; i++) {
        const device_fiber *a = items[0], *b = items[i];
        if (a->done == b->done && (a->done || (a->line == b->line && a->file == b->file))) continue;
        fprintf(stderr, "kernel %s: item %d %s, and item %d %s: %s:%d\n", running.kernel->kernel->name, 0,
                a->done ? "has ended" : "waits at a barrier", i, b->done ? "has ended" : "waits at a barrier",
                b->done ? a->file : b->file, b->done ? a->line : b->line);
        abort();
    }
}

/* Runs group number `number`. Items of the next group are other fibers, so that ThreadSanitizer compares groups too. */
UNWATCHED static void run_group(int number, int count)
{
    const bool share = running.kernel->kernel->floats > 0, backwards = running.launches % 2 != 0;
    device_fiber *items[ITEMS];
    int i;
    for (i = 0; i < count; i++) {
        items[i] = &fibers[(i + number) % ITEMS];
        items[i]->first = share ? number : number * ITEMS + i;
        items[i]->group.item = share ? i : 0;
        items[i]->group.items = share ? count : 1;
        items[i]->barriers = 0;
        items[i]->done = false;
    }
    do {
        for (i = 0; i < count; i++) {
            running.item = items[backwards ? count - 1 - i : i];
            switch_fiber(&caller, running.item);
        }
        running.item = NULL;
        check_barrier(items, count);
    } while (!items[0]->done);
}

/* Runs the groups of a kernel whose items share memory, all of them before any of that memory is given back. */
static bool run_groups(const device_kernel *kernel, int groups, int count)
{
    float **memory = (float **)calloc((size_t)groups, sizeof *memory);
    bool room = memory != NULL;
    int i;
    for (i = 0; i < groups && room; i++) room = (memory[i] = (float *)block_new(kernel->floats * sizeof **memory)) != NULL;
    happens_before(&running.begin);
    for (i = 0; i < groups && room; i++) {
        running.memory = memory[i];
        run_group(i, count);
    }
    happens_after(&running.end);
    for (i = 0; memory && i < groups; i++) free(memory[i]);
    free(memory);
    return room;
}

/* Runs items that share nothing: only ThreadSanitizer needs fibers for them. */
static void run_alone(const device_kernel *kernel, int items)
{
    int i;
    happens_before(&running.begin);
    for (i = 0; WITH_TSAN && i < items; i += ITEMS) run_group(i / ITEMS, items - i < ITEMS ? items - i : ITEMS);
    for (i = 0; !WITH_TSAN && i < items; i++)
        device_run_item(kernel, &running.kernel->arguments, i, springls__alone(), NULL);
    happens_after(&running.end);
}

/* The place before an array is nobody's: to AddressSanitizer it is no memory. */
static void guard_arrays(cl_kernel kernel)
{
#if WITH_ASAN
    const device_arguments *a = &kernel->arguments;
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++)
        if (a->places.at[array] > 0 && a->places.at[array] <= kernel->size / SPRINGLS__PLACE_BYTES)
            __asan_poison_memory_region(device_array_at(a, array) - SPRINGLS__PLACE_BYTES, SPRINGLS__PLACE_BYTES);
#else
    (void)kernel;
#endif
}

static cl_int launch(cl_kernel kernel, int items, int group)
{
    bool room = true;
    guard_arrays(kernel);
    fibers_make();
    running.kernel = kernel;
    if (kernel->kernel->floats) room = run_groups(kernel->kernel, items / group, group);
    else run_alone(kernel->kernel, items);
    running.kernel = NULL;
    running.launches++;
    return room ? CL_SUCCESS : CL_OUT_OF_HOST_MEMORY;
}

/* ---- faults ---- */

#if WITH_ASAN
/* Writes the last array of the kernel that begins before an address. */
static void print_array(const char *address)
{
    const device_arguments *a = &running.kernel->arguments;
    int array, found = -1;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        const char *begin = device_array_at(a, array);
        if (a->places.at[array] > running.kernel->size / SPRINGLS__PLACE_BYTES || begin > address) continue;
        if (found < 0 || begin > device_array_at(a, found)) found = array;
    }
    if (found < 0) return;
    fprintf(stderr, "array %s: element %ld, byte %ld\n", device_arrays[found].name,
            (long)((size_t)(address - device_array_at(a, found)) / device_arrays[found].element),
            (long)(address - device_array_at(a, found)));
}
#endif

#if WITH_ASAN || WITH_TSAN || WITH_MSAN
void __sanitizer_set_death_callback(void (*callback)(void));

static void print_fault(void)
{
    if (!running.kernel) return;
    fprintf(stderr, "kernel %s", running.kernel->kernel->name);
    if (running.item) fprintf(stderr, ", group %d, item %d", running.item->first, running.item->group.item);
    fprintf(stderr, "\n");
#if WITH_ASAN
    if (__asan_report_present()) print_array((const char *)__asan_get_report_address());
#endif
}

static void name_faults(void) { __sanitizer_set_death_callback(print_fault); }
#else
static void name_faults(void) {}
#endif

/* ---- OpenCL, as far as springls_cl.h uses it ---- */

static char platform, device, context, queue, program; /* there is one of each; their addresses stand for them */

static void *made(void *object, cl_int *code)
{
    if (code) *code = object ? CL_SUCCESS : CL_OUT_OF_HOST_MEMORY;
    return object;
}

/* Gives a value as clGet...Info do. */
static cl_int give(const void *from, size_t bytes, size_t room, void *to, size_t *size)
{
    if (size) *size = bytes;
    if (to && room < bytes) return CL_INVALID_VALUE;
    if (to) memcpy(to, from, bytes);
    return CL_SUCCESS;
}

cl_int clGetPlatformIDs(cl_uint most, cl_platform_id *platforms, cl_uint *count)
{
    void *only = &platform;
    if (count) *count = 1;
    return platforms ? give(&only, sizeof only, most * sizeof only, platforms, NULL) : CL_SUCCESS;
}

cl_int clGetPlatformInfo(cl_platform_id of, cl_platform_info what, size_t room, void *to, size_t *size)
{
    (void)of;
    return what == CL_PLATFORM_NAME ? give("tests", sizeof "tests", room, to, size) : CL_INVALID_VALUE;
}

cl_int clGetDeviceIDs(cl_platform_id of, cl_device_type type, cl_uint most, cl_device_id *devices, cl_uint *count)
{
    void *only = &device;
    (void)of;
    if (!(type & CL_DEVICE_TYPE_GPU)) return CL_DEVICE_NOT_FOUND;
    if (count) *count = 1;
    return devices ? give(&only, sizeof only, most * sizeof only, devices, NULL) : CL_SUCCESS;
}

cl_int clGetDeviceInfo(cl_device_id of, cl_device_info what, size_t room, void *to, size_t *size)
{
    static const char name[] = "kernels compiled as C", version[] = "OpenCL 1.2 tests";
    const cl_device_type type = CL_DEVICE_TYPE_GPU;
    const cl_device_fp_config floats = CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT | CL_FP_DENORM;
    const cl_ulong memory = 1 << 15; /* as OpenCL promises */
    const size_t items = ITEMS;
    void *only = &platform;
    (void)of;
    switch (what) {
    case CL_DEVICE_PLATFORM: return give(&only, sizeof only, room, to, size);
    case CL_DEVICE_NAME: return give(name, sizeof name, room, to, size);
    case CL_DEVICE_VERSION: case CL_DRIVER_VERSION: return give(version, sizeof version, room, to, size);
    case CL_DEVICE_TYPE: return give(&type, sizeof type, room, to, size);
    case CL_DEVICE_SINGLE_FP_CONFIG: return give(&floats, sizeof floats, room, to, size);
    case CL_DEVICE_LOCAL_MEM_SIZE: return give(&memory, sizeof memory, room, to, size);
    case CL_DEVICE_MAX_WORK_GROUP_SIZE: return give(&items, sizeof items, room, to, size);
    default: return CL_INVALID_VALUE;
    }
}

cl_context clCreateContext(const cl_context_properties *properties, cl_uint count, const cl_device_id *devices,
                           void (CL_CALLBACK *notify)(const char *, const void *, size_t, void *), void *user, cl_int *code)
{
    (void)properties, (void)count, (void)devices, (void)notify, (void)user;
    name_faults();
    return made(&context, code);
}

cl_int clRetainContext(cl_context of) { return of ? CL_SUCCESS : CL_INVALID_CONTEXT; }
cl_int clReleaseContext(cl_context of) { return of ? CL_SUCCESS : CL_INVALID_CONTEXT; }

cl_int clGetContextInfo(cl_context of, cl_context_info what, size_t room, void *to, size_t *size)
{
    void *only = &device;
    (void)of;
    return what == CL_CONTEXT_DEVICES ? give(&only, sizeof only, room, to, size) : CL_INVALID_VALUE;
}

cl_command_queue clCreateCommandQueue(cl_context of, cl_device_id on, cl_command_queue_properties properties, cl_int *code)
{
    (void)of, (void)on, (void)properties;
    return made(&queue, code);
}

cl_int clGetCommandQueueInfo(cl_command_queue of, cl_command_queue_info what, size_t room, void *to, size_t *size)
{
    const cl_command_queue_properties properties = 0;
    void *only = what == CL_QUEUE_CONTEXT ? &context : &device;
    (void)of;
    return what == CL_QUEUE_PROPERTIES ? give(&properties, sizeof properties, room, to, size) : give(&only, sizeof only, room, to, size);
}

cl_int clRetainCommandQueue(cl_command_queue of) { return of ? CL_SUCCESS : CL_INVALID_COMMAND_QUEUE; }
cl_int clReleaseCommandQueue(cl_command_queue of) { return of ? CL_SUCCESS : CL_INVALID_COMMAND_QUEUE; }

cl_program clCreateProgramWithSource(cl_context of, cl_uint count, const char **lines, const size_t *lengths, cl_int *code)
{
    (void)of, (void)count, (void)lines, (void)lengths;
    return made(&program, code);
}

cl_program clCreateProgramWithBinary(cl_context of, cl_uint count, const cl_device_id *devices, const size_t *lengths,
                                     const unsigned char **binaries, cl_int *each, cl_int *code)
{
    (void)of, (void)count, (void)devices, (void)lengths, (void)binaries, (void)each;
    if (code) *code = CL_INVALID_BINARY;
    return NULL;
}

/* There is nothing to keep of a program. */
cl_int clGetProgramInfo(cl_program of, cl_program_info what, size_t room, void *to, size_t *size)
{
    const size_t none = 0;
    (void)of;
    return what == CL_PROGRAM_BINARY_SIZES ? give(&none, sizeof none, room, to, size) : CL_INVALID_VALUE;
}

cl_int clBuildProgram(cl_program of, cl_uint count, const cl_device_id *devices, const char *options,
                      void (CL_CALLBACK *notify)(cl_program, void *), void *user)
{
    (void)of, (void)count, (void)devices, (void)options, (void)notify, (void)user;
    return CL_SUCCESS;
}

cl_int clGetProgramBuildInfo(cl_program of, cl_device_id on, cl_program_build_info what, size_t room, void *to, size_t *size)
{
    (void)of, (void)on, (void)what;
    return give("", 1, room, to, size);
}

cl_int clReleaseProgram(cl_program of) { return of ? CL_SUCCESS : CL_INVALID_PROGRAM; }

cl_kernel clCreateKernel(cl_program of, const char *name, cl_int *code)
{
    const device_kernel *kernel = device_kernels;
    cl_kernel one;
    (void)of;
    while (kernel->name && strcmp(kernel->name, name + strlen("springls_")) != 0) kernel++;
    if (!kernel->name) {
        if (code) *code = CL_INVALID_KERNEL_NAME;
        return NULL;
    }
    one = (cl_kernel)calloc(1, sizeof *one);
    if (one) one->kernel = kernel;
    return (cl_kernel)made(one, code);
}

cl_int clReleaseKernel(cl_kernel kernel)
{
    free(kernel);
    return CL_SUCCESS;
}

static cl_int set(void *to, size_t bytes, const void *from, size_t size)
{
    if (size != bytes) return CL_INVALID_ARG_SIZE;
    memcpy(to, from, size);
    return CL_SUCCESS;
}

cl_int clSetKernelArg(cl_kernel kernel, cl_uint index, size_t size, const void *value)
{
    device_arguments *a = &kernel->arguments;
    cl_mem memory;
    switch (index) {
    case 0:
        if (set(&memory, sizeof memory, value, size) != CL_SUCCESS) return CL_INVALID_ARG_SIZE;
        a->memory = memory ? (char *)memory->data : NULL;
        kernel->size = memory ? memory->size : 0;
        return CL_SUCCESS;
    case 1: return set(&a->places, sizeof a->places, value, size);
    case 2: return set(&a->shape, sizeof a->shape, value, size);
    case 3: return set(&a->params, sizeof a->params, value, size);
    case 4: return set(&a->args, sizeof a->args, value, size);
    case 5: return set(&a->count, sizeof a->count, value, size);
    case 6: return set(&a->grain, sizeof a->grain, value, size);
    default: return CL_INVALID_ARG_INDEX;
    }
}

cl_int clEnqueueNDRangeKernel(cl_command_queue in, cl_kernel kernel, cl_uint dimensions, const size_t *offset, const size_t *global,
                              const size_t *local, cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    const size_t group = local ? *local : 1;
    (void)in, (void)offset, (void)wait_count, (void)wait, (void)event;
    if (dimensions != 1 || group == 0 || group > ITEMS || *global == 0 || *global % group != 0) return CL_INVALID_WORK_GROUP_SIZE;
    return launch(kernel, (int)*global, (int)group);
}

cl_mem clCreateBuffer(cl_context of, cl_mem_flags flags, size_t size, void *host, cl_int *code)
{
    cl_mem memory = size > 0 ? (cl_mem)malloc(sizeof *memory) : NULL;
    (void)of, (void)flags, (void)host;
    if (memory) {
        memory->size = size;
        memory->data = block_new(size);
    }
    if (memory && !memory->data) {
        free(memory);
        memory = NULL;
    }
    if (code) *code = memory ? CL_SUCCESS : size > 0 ? CL_MEM_OBJECT_ALLOCATION_FAILURE : CL_INVALID_BUFFER_SIZE;
    return memory;
}

cl_int clReleaseMemObject(cl_mem memory)
{
    free(memory->data);
    free(memory);
    return CL_SUCCESS;
}

/* Leaves kernels the first `used` bytes of an array only; dlsym finds it. */
void device_limit(cl_mem memory, size_t at, size_t used, size_t bytes);
void device_limit(cl_mem memory, size_t at, size_t used, size_t bytes)
{
#if WITH_ASAN
    __asan_unpoison_memory_region((char *)memory->data + at, bytes);
    if (used < bytes) __asan_poison_memory_region((char *)memory->data + at + used, bytes - used);
#else
    (void)memory, (void)at, (void)used, (void)bytes;
#endif
}

static bool contains(cl_mem memory, size_t offset, size_t size) { return offset <= memory->size && size <= memory->size - offset; }

cl_int clEnqueueReadBuffer(cl_command_queue in, cl_mem memory, cl_bool blocking, size_t offset, size_t size, void *to,
                           cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    (void)in, (void)blocking, (void)wait_count, (void)wait, (void)event;
    if (!contains(memory, offset, size)) return CL_INVALID_VALUE;
    memcpy(to, (const char *)memory->data + offset, size);
    return CL_SUCCESS;
}

cl_int clEnqueueWriteBuffer(cl_command_queue in, cl_mem memory, cl_bool blocking, size_t offset, size_t size, const void *from,
                            cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    (void)in, (void)blocking, (void)wait_count, (void)wait, (void)event;
    if (!contains(memory, offset, size)) return CL_INVALID_VALUE;
    memcpy((char *)memory->data + offset, from, size);
    return CL_SUCCESS;
}

cl_int clEnqueueCopyBuffer(cl_command_queue in, cl_mem from, cl_mem to, size_t from_offset, size_t to_offset, size_t size,
                           cl_uint wait_count, const cl_event *wait, cl_event *event)
{
    (void)in, (void)wait_count, (void)wait, (void)event;
    if (!contains(from, from_offset, size) || !contains(to, to_offset, size)) return CL_INVALID_VALUE;
    memcpy((char *)to->data + to_offset, (const char *)from->data + from_offset, size);
    return CL_SUCCESS;
}

cl_int clFinish(cl_command_queue in) { return in ? CL_SUCCESS : CL_INVALID_COMMAND_QUEUE; }
