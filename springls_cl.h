/* springls_cl.h - the OpenCL backend of springls.h: the same calls, run on a GPU or on all cores of a processor.

     #define SPRINGLS_IMPLEMENTATION            in one source file
     #include "springls_cl.h"                   instead of springls.h, which it includes

     springls_backend *backend;
     springls_cl_create(NULL, &backend);        one more line ...
     desc.backend = backend;                    ... and this one
     springls_create(&desc, &ctx);

   NEEDS  CL/cl.h to compile, and nothing to start: the OpenCL library is loaded at run time. On a machine without one
   springls_cl_create logs a warning and sets *backend to NULL, which makes springls_create use scalar code.

   MEMORY  The model stays on the device from step to step. What host code reads (views, meshes, queries) is downloaded once,
   until the model changes again.

   BITS  On devices that round divisions and square roots correctly, results have the same bits as the scalar backend's.

   FAILURE  When the device fails, the model is read back, the work is completed by scalar code, and the context stays without a
   device from then on; the call that was running returns SPRINGLS_DEVICE_FAILED, once. When the model can no longer be read back
   it is empty, and springls_last_error() reports that. It names the kernels that were started last, since one fails unseen until
   the device is waited for. Other contexts of the backend fail in the same way, each in a call of its own; springls_cl_create
   makes a new backend where the driver can go on.

   Licence: as springls.h. */
#ifndef SPRINGLS_CL_H
#define SPRINGLS_CL_H

#ifdef SPRINGLS_NO_OPENCL
#error "SPRINGLS_NO_OPENCL, and so SPRINGLS_MINIMAL, leaves out the kernels that springls_cl.h runs: define them only without this header"
#endif
#include "springls.h"

#ifdef SPRINGLS_NAMESPACE /* as the functions of springls.h */
#define springls_cl_create SPRINGLS__NAME(springls_cl_create)
#define springls_cl_prepare SPRINGLS__NAME(springls_cl_prepare)
#define springls_cl_destroy SPRINGLS__NAME(springls_cl_destroy)
#define springls_cl_name SPRINGLS__NAME(springls_cl_name)
#define springls_cl_exact SPRINGLS__NAME(springls_cl_exact)
#define springls_cl_get_counts SPRINGLS__NAME(springls_cl_get_counts)
#define springls_cl_springl_buffer SPRINGLS__NAME(springls_cl_springl_buffer)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Names the device to choose. */
typedef enum springls_cl_kind {
    SPRINGLS_CL_KIND_ANY, /* a GPU if there is one, else what there is */
    SPRINGLS_CL_KIND_GPU,
    SPRINGLS_CL_KIND_CPU
} springls_cl_kind;

/* Keeps compiled programs. A key, 16 hexadecimal digits, stands for device, driver, options and text; a blob is at most 1 GiB. The
   driver runs blobs unchecked: nobody else should be able to write them. A blob that is damaged, or belongs to something else, is
   replaced. Callbacks run on the thread that calls the library, before springls_cl_destroy. All zero: nothing is kept. PoCL has a
   cache of its own: with it this one is not used. */
typedef struct springls_cl_cache {
    const char *folder;  /* an existing folder, in which each blob is a file; copied; NULL: the callbacks                  */
    /* Copies the blob of a key if it has at most `room` bytes (blob is NULL if room is 0); returns its size, 0: there is none. */
    size_t (*load)(void *user, const char *key, void *blob, size_t room);
    bool (*store)(void *user, const char *key, const void *blob, size_t bytes); /* false: it cannot be kept              */
    void *user;
} springls_cl_cache;

/* Describes a backend; zero-initialised members mean the default. */
typedef struct springls_cl_desc {
    springls_cl_kind kind;    /* the device to choose when `context` is NULL                                         */
    void *context;            /* the caller's cl_context, retained; NULL: a new one on the chosen device             */
    void *device;             /* a cl_device_id of `context`; NULL: its first                                        */
    void *queue;              /* the caller's in-order cl_command_queue for that device, retained; NULL: a new one   */
    const char *library;      /* file name of the OpenCL library; NULL: the system's                                 */
    int brick_items;          /* work items that share a brick, 1..64; 0: 64 on a GPU, 1 on a processor, but 64 where its driver
                                 runs several items in the lanes of a vector, as on a GPU. With 1 an item does many
                                 elements, as suits a processor, with more it does one                               */
    bool timed;               /* wait at the end of every stage, so that springls_stats.seconds are each stage's own */
    springls_velocity_fn velocity; /* a velocity callback that velocity_source replaces on the device, where forces are in voxels:
                                      on a grid of spacing 1, origin 0 and no direction, or with voxel_units         */
    const char *velocity_source;   /* the same function in OpenCL C, of lattice coordinates:
                                      float3 springls_velocity(float3 x, float time, __global const float *user)     */
    size_t velocity_user_bytes;    /* bytes of springls_forces.user, sent at every step; 0: the source reads no user */
    springls_logger logger;   /* receives what was chosen, why there is none, and build logs with lines of springls.h */
    springls_cl_cache cache;  /* where compiled programs are kept                                                    */
    springls_tasks tasks; /* threads on which springls_cl_prepare compiles; they last as long as the backend; no parallel_for: the
                             calling one */
} springls_cl_desc;

/* Makes a backend for springls_desc.backend; desc NULL: the defaults. Compiles the kernels that every step uses, which may take seconds;
   others are compiled when they are first needed, program by program, or by springls_cl_prepare. A backend and its contexts are used by one
   thread at a time; its memory comes from malloc. Strings of desc are copied. On failure *out is NULL and nothing is left allocated.
   DEVICE_FAILED: there is no OpenCL, no such device, or it cannot run the kernels; the logger has a warning and the build log.
   OUT_OF_MEMORY. INVALID_ARGUMENT: out is NULL, a member is out of range, a device or a queue comes without its context, a queue is not in
   order, only one of velocity and velocity_source is given, the source has no springls_velocity, or cache has one callback only, a folder
   and callbacks, or a folder without a name. */
SPRINGLS_API springls_status springls_cl_create(const springls_cl_desc *desc, springls_backend **out);

/* Compiles all programs that are not compiled yet, on springls_cl_desc.tasks, and starts every kernel once with nothing to do, so that no
   driver compiles anything during a step. May take a minute. progress: receives, in the calling thread, the fraction of kernels compiled
   and started, after each program or, on threads, a few of them, and after each kernel; it may cancel; NULL: none. When all is compiled, a
   call takes some milliseconds. CANCELLED: what is compiled stays; the rest is compiled when it is needed. DEVICE_FAILED, OUT_OF_MEMORY:
   the logger has the reason. INVALID_ARGUMENT: backend is NULL. */
SPRINGLS_API springls_status springls_cl_prepare(springls_backend *backend, const springls_progress *progress);

/* Destroys a backend, after the contexts that use it; NULL is allowed. */
SPRINGLS_API void springls_cl_destroy(springls_backend *backend);

/* Returns "platform: device", as OpenCL names them; the text belongs to the backend. NULL: "". */
SPRINGLS_API const char *springls_cl_name(const springls_backend *backend);

/* Returns true when the device rounds as C does: then results have the scalar backend's bits. */
SPRINGLS_API bool springls_cl_exact(const springls_backend *backend);

/* Returns the device's buffer (cl_mem) that has the springls, to draw them without a copy through the host: from *offset, in bytes,
   a multiple of 512, springls_count of them, 64 bytes each, 12 floats q0 q1 q2 p in voxels and 4 private ones. It is to be read
   only, in the backend's queue, until the next call with ctx. NULL: the model is empty, or has no backend, or ctx or offset is
   NULL; then *offset stays as it was. */
SPRINGLS_API void *springls_cl_springl_buffer(springls_context *ctx, size_t *offset);

/* Counts what all contexts of a backend have done so far: kernels started, transfers, and their bytes. */
typedef struct springls_cl_counts { uint64_t kernels, uploads, downloads, bytes_up, bytes_down; } springls_cl_counts;

/* Returns these counts; NULL: zeros. */
SPRINGLS_API springls_cl_counts springls_cl_get_counts(const springls_backend *backend);

#ifdef __cplusplus
}
#endif

#if defined(SPRINGLS_IMPLEMENTATION) && !defined(SPRINGLS_CL_IMPLEMENTED)
#define SPRINGLS_CL_IMPLEMENTED

#include <time.h>

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#ifndef CL_USE_DEPRECATED_OPENCL_1_2_APIS
#define CL_USE_DEPRECATED_OPENCL_1_2_APIS /* for clCreateCommandQueue, which every version has */
#endif
#if defined(__APPLE__)
#include <OpenCL/cl.h>
#else
#include <CL/cl.h>
#endif

/* ---- the library, loaded at run time ---- */

#if defined(_WIN32)
/* Declares what windows.h declares, with the same types, because a program may include it before or after. */
#ifdef __cplusplus
extern "C" {
#endif
struct HINSTANCE__;
typedef intptr_t (__stdcall *springls__cl_symbol)(void);
__declspec(dllimport) struct HINSTANCE__ *__stdcall LoadLibraryA(const char *);
__declspec(dllimport) springls__cl_symbol __stdcall GetProcAddress(struct HINSTANCE__ *, const char *);
__declspec(dllimport) int __stdcall FreeLibrary(struct HINSTANCE__ *);
#ifdef __cplusplus
}
#endif
#define SPRINGLS__CL_OPEN(name) LoadLibraryA(name)
#define SPRINGLS__CL_FIND(library, name) GetProcAddress((struct HINSTANCE__ *)(library), name)
#define SPRINGLS__CL_CLOSE(library) FreeLibrary((struct HINSTANCE__ *)(library))
#define SPRINGLS__CL_LIBRARY "OpenCL.dll"
#else
#include <dlfcn.h>
typedef void *springls__cl_symbol;
#define SPRINGLS__CL_OPEN(name) dlopen(name, RTLD_NOW | RTLD_LOCAL)
#define SPRINGLS__CL_FIND(library, name) dlsym(library, name)
#define SPRINGLS__CL_CLOSE(library) dlclose(library)
#if defined(__APPLE__)
#define SPRINGLS__CL_LIBRARY "/System/Library/Frameworks/OpenCL.framework/OpenCL"
#else
#define SPRINGLS__CL_LIBRARY "libOpenCL.so.1"
#endif
#endif

/* Lists the functions of OpenCL that are used: name without cl, result, arguments. */
#define SPRINGLS__CL_FUNCTIONS(X)                                                                                                \
    X(GetPlatformIDs, cl_int, (cl_uint, cl_platform_id *, cl_uint *))                                                            \
    X(GetPlatformInfo, cl_int, (cl_platform_id, cl_platform_info, size_t, void *, size_t *))                                     \
    X(GetDeviceIDs, cl_int, (cl_platform_id, cl_device_type, cl_uint, cl_device_id *, cl_uint *))                                \
    X(GetDeviceInfo, cl_int, (cl_device_id, cl_device_info, size_t, void *, size_t *))                                           \
    X(CreateContext, cl_context, (const cl_context_properties *, cl_uint, const cl_device_id *,                                  \
                                  void (CL_CALLBACK *)(const char *, const void *, size_t, void *), void *, cl_int *))           \
    X(RetainContext, cl_int, (cl_context)) X(ReleaseContext, cl_int, (cl_context))                                               \
    X(GetContextInfo, cl_int, (cl_context, cl_context_info, size_t, void *, size_t *))                                           \
    X(CreateCommandQueue, cl_command_queue, (cl_context, cl_device_id, cl_command_queue_properties, cl_int *))                   \
    X(GetCommandQueueInfo, cl_int, (cl_command_queue, cl_command_queue_info, size_t, void *, size_t *))                          \
    X(RetainCommandQueue, cl_int, (cl_command_queue)) X(ReleaseCommandQueue, cl_int, (cl_command_queue))                         \
    X(CreateProgramWithSource, cl_program, (cl_context, cl_uint, const char **, const size_t *, cl_int *))                       \
    X(CreateProgramWithBinary, cl_program, (cl_context, cl_uint, const cl_device_id *, const size_t *, const unsigned char **,   \
                                            cl_int *, cl_int *))                                                                 \
    X(GetProgramInfo, cl_int, (cl_program, cl_program_info, size_t, void *, size_t *))                                           \
    X(BuildProgram, cl_int, (cl_program, cl_uint, const cl_device_id *, const char *,                                            \
                             void (CL_CALLBACK *)(cl_program, void *), void *))                                                  \
    X(GetProgramBuildInfo, cl_int, (cl_program, cl_device_id, cl_program_build_info, size_t, void *, size_t *))                  \
    X(ReleaseProgram, cl_int, (cl_program))                                                                                      \
    X(CreateKernel, cl_kernel, (cl_program, const char *, cl_int *)) X(ReleaseKernel, cl_int, (cl_kernel))                       \
    X(SetKernelArg, cl_int, (cl_kernel, cl_uint, size_t, const void *))                                                          \
    X(EnqueueNDRangeKernel, cl_int, (cl_command_queue, cl_kernel, cl_uint, const size_t *, const size_t *, const size_t *,       \
                                     cl_uint, const cl_event *, cl_event *))                                                     \
    X(CreateBuffer, cl_mem, (cl_context, cl_mem_flags, size_t, void *, cl_int *)) X(ReleaseMemObject, cl_int, (cl_mem))          \
    X(EnqueueReadBuffer, cl_int, (cl_command_queue, cl_mem, cl_bool, size_t, size_t, void *,                                     \
                                  cl_uint, const cl_event *, cl_event *))                                                        \
    X(EnqueueWriteBuffer, cl_int, (cl_command_queue, cl_mem, cl_bool, size_t, size_t, const void *,                              \
                                   cl_uint, const cl_event *, cl_event *))                                                       \
    X(EnqueueCopyBuffer, cl_int, (cl_command_queue, cl_mem, cl_mem, size_t, size_t, size_t,                                      \
                                  cl_uint, const cl_event *, cl_event *))                                                        \
    X(Finish, cl_int, (cl_command_queue))

typedef enum springls__program {
#define SPRINGLS__PROGRAM_NUMBER(name) SPRINGLS__PROGRAM_##name,
    SPRINGLS__PROGRAMS(SPRINGLS__PROGRAM_NUMBER)
#undef SPRINGLS__PROGRAM_NUMBER
    SPRINGLS__PROGRAM_COUNT
} springls__program;

typedef struct springls__cl_kernel { const char *name; springls__program program; int grain; bool brick; } springls__cl_kernel;

static const springls__cl_kernel springls__cl_kernels[] = {
#define SPRINGLS__CL_KERNEL(name, program, grain, writes) { #name, SPRINGLS__PROGRAM_##program, grain, false },
    SPRINGLS__KERNELS(SPRINGLS__CL_KERNEL) SPRINGLS__SIMD_KERNELS(SPRINGLS__CL_KERNEL)
    SPRINGLS__DEVICE_KERNELS(SPRINGLS__CL_KERNEL) SPRINGLS__ORDERED_KERNELS(SPRINGLS__CL_KERNEL)
#undef SPRINGLS__CL_KERNEL
#define SPRINGLS__CL_BRICK(name, program, grain, writes, floats) { #name, SPRINGLS__PROGRAM_##program, grain, true },
    SPRINGLS__BRICK_KERNELS(SPRINGLS__CL_BRICK)
#undef SPRINGLS__CL_BRICK
};

#define SPRINGLS__CL_MAX_PLATFORMS 16 /* and devices of one; others are not seen */

enum { SPRINGLS__CL_LAST = 3 }; /* kernels that the message of a failure names */

typedef struct springls__cl {
    springls_backend base;  /* the first member, so that a backend is a springls__cl                            */
    springls_logger logger;
    void *library;
    cl_context context;
    cl_device_id device;
    cl_command_queue queue;
    cl_program programs[SPRINGLS__PROGRAM_COUNT]; /* NULL: not compiled yet, and so are its kernels                 */
    bool refused[SPRINGLS__PROGRAM_COUNT];        /* it did not compile: no step tries again                        */
    cl_kernel kernels[SPRINGLS__KERNEL_COUNT];
    char *velocity_source;
    springls_cl_cache cache;
    char *folder;           /* cache.user, where it is one                                                      */
    bool warned;            /* that a program cannot be kept: no more are                                           */
    springls_tasks tasks;
    const char *started[SPRINGLS__CL_LAST]; /* the last kernels since the device was waited for, the newest first        */
    springls_cl_counts counts;
    bool exact;
    size_t group;           /* work items that share a brick                                                     */
    char device_name[256], lack[128]; /* what the device has too little of                                       */
#define SPRINGLS__CL_POINTER(name, result, arguments) result (CL_API_CALL *name) arguments;
    SPRINGLS__CL_FUNCTIONS(SPRINGLS__CL_POINTER)
#undef SPRINGLS__CL_POINTER
} springls__cl;

SPRINGLS__FN const char *springls__cl_error(cl_int error)
{
    switch (error) {
    case CL_DEVICE_NOT_FOUND: return "no device";
    case CL_DEVICE_NOT_AVAILABLE: return "the device is lost";
    case CL_COMPILER_NOT_AVAILABLE: return "no compiler";
    case CL_MEM_OBJECT_ALLOCATION_FAILURE: return "out of device memory";
    case CL_OUT_OF_RESOURCES: return "out of device resources";
    case CL_OUT_OF_HOST_MEMORY: return "out of host memory";
    case CL_BUILD_PROGRAM_FAILURE: return "the kernels do not compile";
    case CL_INVALID_WORK_GROUP_SIZE: return "the work-group size is not allowed";
    case CL_INVALID_COMMAND_QUEUE: return "the queue is out of order, or of another context or device";
    case CL_INVALID_BUFFER_SIZE: return "a buffer is larger than the device allows";
    default: return "OpenCL error";
    }
}

SPRINGLS__FN springls_status springls__cl_status(cl_int error)
{
    if (error == CL_INVALID_COMMAND_QUEUE) return SPRINGLS_INVALID_ARGUMENT;
    return error == CL_MEM_OBJECT_ALLOCATION_FAILURE || error == CL_OUT_OF_RESOURCES || error == CL_OUT_OF_HOST_MEMORY
        || error == CL_INVALID_BUFFER_SIZE ? SPRINGLS_OUT_OF_MEMORY : SPRINGLS_DEVICE_FAILED;
}

SPRINGLS__FN springls__cl *springls__cl_of(springls_context *ctx) { return (springls__cl *)(void *)ctx->backend; }

/* Notes the reason of a failure, and the kernels that may have caused it. */
SPRINGLS__FN springls_status springls__cl_check(springls_context *ctx, cl_int error, const char *doing)
{
    const char *const *started = springls__cl_of(ctx)->started;
    int i, length;
    if (error == CL_SUCCESS) return SPRINGLS_OK;
    length = snprintf(ctx->error, sizeof ctx->error, "opencl: %s: %s (%d)", doing, springls__cl_error(error), (int)error);
    for (i = 0; i < SPRINGLS__CL_LAST && started[i] && length < (int)sizeof ctx->error; i++)
        length += snprintf(ctx->error + length, sizeof ctx->error - (size_t)length, "%s%s", i ? ", " : "; last started: ",
                           started[i]);
    return SPRINGLS_DEVICE_FAILED;
}

/* Checks a call that waits for the device, and so for all kernels that were started. */
SPRINGLS__FN springls_status springls__cl_check_wait(springls_context *ctx, cl_int error, const char *doing)
{
    SPRINGLS__TRY(springls__cl_check(ctx, error, doing));
    memset(springls__cl_of(ctx)->started, 0, sizeof springls__cl_of(ctx)->started);
    return SPRINGLS_OK;
}

/* ---- memory and kernels ---- */

SPRINGLS__FN void springls__cl_release(springls_context *ctx)
{
    if (ctx->device_memory.buffer) springls__cl_of(ctx)->ReleaseMemObject((cl_mem)ctx->device_memory.buffer);
    memset(&ctx->device_memory, 0, sizeof ctx->device_memory);
}

/* Returns how much of the memory an array of some bytes takes. The place after it stays unused: what is written beyond an array
   is found there by a device that checks (tests/backend/emulator.c). */
SPRINGLS__FN size_t springls__cl_room(size_t bytes) { return (bytes / SPRINGLS__PLACE_BYTES + 2) * SPRINGLS__PLACE_BYTES; }

/* Makes a larger buffer, for `bytes` in use and half as many beside them, or for these alone if there is no more. */
SPRINGLS__FN springls_status springls__cl_enlarge(springls_context *ctx, size_t bytes, springls__device_memory *larger)
{
    springls__cl *cl = springls__cl_of(ctx);
    cl_int error = CL_SUCCESS;
    larger->bytes = bytes + bytes / 2;
    larger->buffer = cl->CreateBuffer(cl->context, CL_MEM_READ_WRITE, larger->bytes, NULL, &error);
    if (error != CL_SUCCESS) {
        larger->bytes = bytes;
        larger->buffer = cl->CreateBuffer(cl->context, CL_MEM_READ_WRITE, bytes, NULL, &error);
    }
    return springls__cl_check(ctx, error, "device memory");
}

/* Moves all arrays to a larger buffer, one of them to a place of `bytes` with the first `keep` of what it had. */
SPRINGLS__FN springls_status springls__cl_move(springls_context *ctx, springls__buffer *resized, size_t bytes, size_t keep)
{
    springls__cl *cl = springls__cl_of(ctx);
    springls__device_memory larger;
    size_t at[SPRINGLS__ARRAY_COUNT];
    cl_int error = CL_SUCCESS;
    int array;
    memset(&larger, 0, sizeof larger);
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        const springls__buffer *buffer = &ctx->memory[array];
        at[array] = larger.used;
        if (buffer == resized || buffer->device_bytes > 0)
            larger.used += springls__cl_room(buffer == resized ? bytes : buffer->device_bytes);
    }
    SPRINGLS__TRY(springls__cl_enlarge(ctx, larger.used, &larger));
    for (array = 0; array < SPRINGLS__ARRAY_COUNT && error == CL_SUCCESS; array++) {
        const springls__buffer *buffer = &ctx->memory[array];
        const size_t kept = buffer == resized ? keep : buffer->device_bytes;
        if (kept > 0) error = cl->EnqueueCopyBuffer(cl->queue, (cl_mem)ctx->device_memory.buffer, (cl_mem)larger.buffer,
                                                    buffer->device_at, at[array], kept, 0, NULL, NULL);
    }
    if (error != CL_SUCCESS) cl->ReleaseMemObject((cl_mem)larger.buffer);
    SPRINGLS__TRY(springls__cl_check(ctx, error, "copy"));
    springls__cl_release(ctx);
    ctx->device_memory = larger;
    resized->device_bytes = bytes;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) ctx->memory[array].device_at = at[array];
    return SPRINGLS_OK;
}

/* Gives an array a new place behind the others or, if there is no room, all of them new places. */
SPRINGLS__FN springls_status springls__cl_resize(springls_context *ctx, springls__buffer *buffer, size_t bytes, size_t keep)
{
    springls__cl *cl = springls__cl_of(ctx);
    springls__device_memory *memory = &ctx->device_memory;
    cl_mem all = (cl_mem)memory->buffer;
    if (springls__cl_room(bytes) > memory->bytes - memory->used)
        return springls__cl_move(ctx, buffer, bytes, keep);
    if (keep > 0)
        SPRINGLS__TRY(springls__cl_check(
            ctx, cl->EnqueueCopyBuffer(cl->queue, all, all, buffer->device_at, memory->used, keep, 0, NULL, NULL), "copy"));
    buffer->device_at = memory->used;
    buffer->device_bytes = bytes;
    memory->used += springls__cl_room(bytes);
    return SPRINGLS_OK;
}

/* Copies the first bytes of an array to the host; they have arrived on return. */
SPRINGLS__FN springls_status springls__cl_download(springls_context *ctx, const springls__buffer *buffer, size_t bytes)
{
    springls__cl *cl = springls__cl_of(ctx);
    cl->counts.downloads++;
    cl->counts.bytes_down += bytes;
    return springls__cl_check_wait(ctx, cl->EnqueueReadBuffer(cl->queue, (cl_mem)ctx->device_memory.buffer, CL_TRUE,
                                                              buffer->device_at, bytes, buffer->data, 0, NULL, NULL),
                                   "download");
}

SPRINGLS__FN springls_status springls__cl_send(springls_context *ctx, const springls__buffer *buffer, size_t bytes, const void *from)
{
    springls__cl *cl = springls__cl_of(ctx);
    cl->counts.uploads++;
    cl->counts.bytes_up += bytes;
    return springls__cl_check_wait(ctx, cl->EnqueueWriteBuffer(cl->queue, (cl_mem)ctx->device_memory.buffer, CL_TRUE,
                                                               buffer->device_at, bytes, from, 0, NULL, NULL),
                                   "upload");
}

SPRINGLS__FN springls_status springls__cl_transfer(springls_context *ctx, springls__buffer *buffer, size_t bytes, bool to_host)
{
    if (bytes == 0) return SPRINGLS_OK;
    return to_host ? springls__cl_download(ctx, buffer, bytes) : springls__cl_send(ctx, buffer, bytes, buffer->data);
}

SPRINGLS__FN springls_status springls__cl_finish(springls_context *ctx)
{
    springls__cl *cl = springls__cl_of(ctx);
    return springls__cl_check_wait(ctx, cl->Finish(cl->queue), "wait");
}

SPRINGLS__FN springls_status springls__cl_upload(springls_context *ctx, springls__buffer *buffer, const void *data, size_t bytes)
{
    if (buffer->device_bytes < bytes) SPRINGLS__TRY(springls__cl_resize(ctx, buffer, bytes, 0));
    return springls__cl_send(ctx, buffer, bytes, data);
}

/* An array that the device has not is behind all others. */
SPRINGLS__FN springls__places springls__cl_places(const springls_context *ctx)
{
    const uint32_t beyond = (uint32_t)(ctx->device_memory.bytes / SPRINGLS__PLACE_BYTES) + 1;
    springls__places places;
    int array;
    for (array = 0; array < SPRINGLS__ARRAY_COUNT; array++) {
        const springls__buffer *buffer = &ctx->memory[array];
        places.at[array] = buffer->device_bytes > 0 ? (uint32_t)(buffer->device_at / SPRINGLS__PLACE_BYTES) : beyond;
    }
    return places;
}

SPRINGLS__FN cl_int springls__cl_arguments(springls__cl *cl, cl_kernel kernel, cl_mem memory, springls__places places,
                                           const springls__model *model, springls__arguments args, cl_int count, cl_int grain)
{
    springls__shape shape = springls__shape_of(model);
    springls_params params = model->params;
    cl_uint i = 0;
    cl_int error = cl->SetKernelArg(kernel, i++, sizeof memory, &memory);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i++, sizeof places, &places);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i++, sizeof shape, &shape);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i++, sizeof params, &params);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i++, sizeof args, &args);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i++, sizeof count, &count);
    if (error == CL_SUCCESS) error = cl->SetKernelArg(kernel, i, sizeof grain, &grain);
    return error;
}

/* Starts `groups` work groups of a kernel for bricks, or as many items of another, in whole groups. */
SPRINGLS__FN cl_int springls__cl_enqueue(springls__cl *cl, cl_kernel kernel, size_t groups, bool brick)
{
    const size_t items = brick ? groups * cl->group : (groups + cl->group - 1) / cl->group * cl->group;
    return cl->EnqueueNDRangeKernel(cl->queue, kernel, 1, NULL, &items, &cl->group, 0, NULL, NULL);
}

SPRINGLS__FN cl_int springls__cl_need(springls__cl *cl, springls__program program);

/* Starts a kernel: a work item does as many elements as a task of the scalar backend on a processor, one on a GPU. OpenCL before
   2.1 refuses to start one over nothing. */
SPRINGLS__FN springls_status springls__cl_launch(springls_context *ctx, int kernel, int count, springls__arguments args)
{
    const springls__cl_kernel *info = &springls__cl_kernels[kernel];
    springls__cl *cl = springls__cl_of(ctx);
    const int grain = cl->group > 1 ? 1 : info->grain;
    cl_int error;
    if (count <= 0) return SPRINGLS_OK;
    error = springls__cl_need(cl, info->program);
    if (error == CL_SUCCESS)
        error = springls__cl_arguments(cl, cl->kernels[kernel], (cl_mem)ctx->device_memory.buffer, springls__cl_places(ctx),
                                       &ctx->model, args, count, grain);
    SPRINGLS__TRY(springls__cl_check(ctx, error, info->name));
    cl->counts.kernels++;
    error = springls__cl_enqueue(cl, cl->kernels[kernel], ((size_t)count + (size_t)grain - 1) / (size_t)grain, info->brick);
    SPRINGLS__TRY(springls__cl_check(ctx, error, info->name));
    memmove(cl->started + 1, cl->started, (SPRINGLS__CL_LAST - 1) * sizeof *cl->started);
    cl->started[0] = info->name;
    return SPRINGLS_OK;
}

/* ---- compiled programs that are kept ---- */

SPRINGLS__FN void springls__cl_log(const springls_logger *logger, int level, const char *format, const char *what)
{
    char line[512];
    if (!logger->log) return;
    snprintf(line, sizeof line, format, what);
    (logger->log)(logger->user, level, line);
}

/* Returns three strings as one, from malloc; NULL: no memory. */
SPRINGLS__FN char *springls__cl_join(const char *a, const char *b, const char *c)
{
    const size_t size = strlen(a) + strlen(b) + strlen(c) + 1;
    char *joined = (char *)malloc(size);
    if (joined) snprintf(joined, size, "%s%s%s", a, b, c);
    return joined;
}

SPRINGLS__FN size_t springls__cl_load_file(void *folder, const char *key, void *blob, size_t room)
{
    char *path = springls__cl_join((const char *)folder, "/", key);
    FILE *file = path ? fopen(path, "rb") : NULL;
    long size = 0;
    free(path);
    if (!file) return 0;
    if (fseek(file, 0, SEEK_END) == 0) size = ftell(file);
    if (size > 0 && (size_t)size <= room) {
        rewind(file);
        if (fread(blob, 1, (size_t)size, file) != (size_t)size) size = 0;
    }
    fclose(file);
    return size > 0 ? (size_t)size : 0;
}

SPRINGLS__FN bool springls__cl_write_file(const char *path, const void *blob, size_t bytes)
{
    FILE *file = fopen(path, "wb");
    bool written;
    if (!file) return false;
    written = fwrite(blob, 1, bytes, file) == bytes;
    return fclose(file) == 0 && written;
}

/* Gives a whole file its name, in the place of another one. */
SPRINGLS__FN bool springls__cl_rename_file(const char *from, const char *to)
{
#if defined(_WIN32)
    remove(to);
#endif
    return rename(from, to) == 0;
}

SPRINGLS__FN bool springls__cl_store_file(void *folder, const char *key, const void *blob, size_t bytes)
{
    char mark[40]; /* another one in each call and, but by chance, in each process */
    char *path = springls__cl_join((const char *)folder, "/", key), *part = NULL;
    bool stored = false;
    snprintf(mark, sizeof mark, ".%lx%lx.part", (unsigned long)time(NULL), (unsigned long)(uintptr_t)blob);
    if (path) part = springls__cl_join(path, mark, "");
    if (part) {
        stored = springls__cl_write_file(part, blob, bytes) && springls__cl_rename_file(part, path);
        if (!stored) remove(part);
    }
    free(part);
    free(path);
    return stored;
}

/* Begins a blob; what the driver has made follows. */
typedef struct springls__cl_head { char magic[8]; char key[24]; uint64_t bytes, hash; } springls__cl_head;

#define SPRINGLS__CL_MAGIC "springl1"

SPRINGLS__FN uint64_t springls__cl_hash(uint64_t hash, const void *data, size_t bytes)
{
    const unsigned char *at = (const unsigned char *)data, *end = at + bytes;
    for (; at < end; at++) hash = (hash ^ *at) * 1099511628211u;
    return hash;
}

SPRINGLS__FN springls__cl_head springls__cl_head_of(const char *key, const void *binary, size_t bytes)
{
    springls__cl_head head;
    memset(&head, 0, sizeof head);
    memcpy(head.magic, SPRINGLS__CL_MAGIC, sizeof head.magic);
    memcpy(head.key, key, strlen(key));
    head.bytes = bytes;
    head.hash = springls__cl_hash(SPRINGLS__HASH_BEGIN, binary, bytes);
    return head;
}

/* Returns the blob of a key, whole and its own, from malloc; its head is followed by a program. NULL: there is none. */
SPRINGLS__FN unsigned char *springls__cl_load_blob(const springls_cl_cache *cache, const char *key)
{
    const size_t most = (size_t)1 << 30;
    const size_t size = cache->load ? (cache->load)(cache->user, key, NULL, 0) : 0;
    unsigned char *blob = size > sizeof(springls__cl_head) && size < most ? (unsigned char *)malloc(size) : NULL;
    springls__cl_head head;
    if (!blob) return NULL;
    if ((cache->load)(cache->user, key, blob, size) == size) {
        head = springls__cl_head_of(key, blob + sizeof head, size - sizeof head);
        if (memcmp(blob, &head, sizeof head) == 0) return blob;
    }
    free(blob);
    return NULL;
}

/* ---- programs ---- */

/* A program on its way: springls__cl_begin_build, then springls__cl_build, which may run on another thread, then
   springls__cl_end_build. */
typedef struct springls__cl_build_state {
    springls__cl *cl;
    springls__program number;
    char key[24];
    const char **text;    /* the program's, `count` strings                                                    */
    int count;
    unsigned char *blob;  /* a head and a compiled program: from the cache, or for it                          */
    size_t bytes;         /* of that program                                                                   */
    bool loaded;          /* it is from the cache                                                              */
    cl_program program;
    cl_int error;
} springls__cl_build_state;

SPRINGLS__FN void springls__cl_options(const springls__cl *cl, char options[100])
{
    snprintf(options, 100, "-cl-std=CL1.2%s%s", cl->exact ? " -cl-fp32-correctly-rounded-divide-sqrt" : "",
             cl->group > 1 ? "" : " -DSPRINGLS__ON_PROCESSOR");
}

/* Makes the list of strings that a program consists of: which kernels it has, the text of all, the velocity. That is part of the
   program that calls it, and of the first, so that springls_cl_create finds its faults. */
SPRINGLS__FN cl_int springls__cl_take_text(springls__cl_build_state *b)
{
#define SPRINGLS__CL_CHOICE(name)                                                                                                \
    { "#define SPRINGLS__IN_" #name "(define, name, floats)\n",                                                                  \
      "#define SPRINGLS__IN_" #name "(define, name, floats) define(name, floats)\n" },
    static const char *const choice[][2] = { SPRINGLS__PROGRAMS(SPRINGLS__CL_CHOICE) };
#undef SPRINGLS__CL_CHOICE
    const char *const *strings;
    int count, i;
    springls_kernel_source(&strings, &count);
    b->text = (const char **)malloc(((size_t)count + SPRINGLS__PROGRAM_COUNT + 2) * sizeof *b->text);
    if (!b->text) return CL_OUT_OF_HOST_MEMORY;
    for (i = 0; i < (int)SPRINGLS__PROGRAM_COUNT; i++) b->text[b->count++] = choice[i][i == (int)b->number];
    memcpy(b->text + b->count, strings, (size_t)count * sizeof *b->text);
    b->count += count;
    b->text[b->count++] = "#line 1 \"velocity_source\"\n";
    b->text[b->count++] = b->cl->velocity_source && (b->number == SPRINGLS__PROGRAM_LISTS || b->number == SPRINGLS__PROGRAM_MOVE)
                        ? b->cl->velocity_source
                        : "float3 springls_velocity(float3 x, float t, __global const float *u) { return x; }\n";
    return CL_SUCCESS;
}

/* Makes the key of a program: a hash of all that its compilation depends on. */
SPRINGLS__FN void springls__cl_make_key(springls__cl_build_state *b)
{
    static const cl_device_info facts[] = { CL_DEVICE_NAME, CL_DEVICE_VENDOR, CL_DEVICE_VERSION, CL_DRIVER_VERSION };
    char words[256];
    uint64_t hash = SPRINGLS__HASH_BEGIN;
    size_t i;
    int line;
    for (line = 0; line < b->count; line++) hash = springls__cl_hash(hash, b->text[line], strlen(b->text[line]));
    springls__cl_options(b->cl, words);
    hash = springls__cl_hash(hash, words, strlen(words) + 1);
    for (i = 0; i < sizeof facts / sizeof *facts; i++) {
        memset(words, 0, sizeof words);
        b->cl->GetDeviceInfo(b->cl->device, facts[i], sizeof words - 1, words, NULL);
        hash = springls__cl_hash(hash, words, strlen(words) + 1);
    }
    snprintf(b->key, sizeof b->key, "%08lx%08lx", (unsigned long)(hash >> 32), (unsigned long)(hash & 0xffffffffu));
}

/* Gets ready what springls__cl_build needs: the program of the cache, if it is there, and the text. */
SPRINGLS__FN void springls__cl_begin_build(springls__cl *cl, springls__program number, springls__cl_build_state *b)
{
    memset(b, 0, sizeof *b);
    b->cl = cl;
    b->number = number;
    b->error = springls__cl_take_text(b);
    if (b->error != CL_SUCCESS || !cl->cache.load) return;
    springls__cl_make_key(b);
    b->blob = springls__cl_load_blob(&cl->cache, b->key);
    b->loaded = b->blob != NULL;
    if (b->loaded) b->bytes = (size_t)((const springls__cl_head *)(const void *)b->blob)->bytes;
}

/* Builds b->program and its kernels. */
SPRINGLS__FN cl_int springls__cl_build_kernels(springls__cl_build_state *b)
{
    springls__cl *cl = b->cl;
    char options[100], entry[64];
    cl_int error;
    int kernel;
    springls__cl_options(cl, options);
    error = cl->BuildProgram(b->program, 1, &cl->device, options, NULL, NULL);
    for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT && error == CL_SUCCESS; kernel++) {
        if (springls__cl_kernels[kernel].program != b->number) continue;
        snprintf(entry, sizeof entry, "springls_%s", springls__cl_kernels[kernel].name);
        cl->kernels[kernel] = cl->CreateKernel(b->program, entry, &error);
    }
    return error;
}

SPRINGLS__FN void springls__cl_release_program(springls__cl *cl, springls__program number, cl_program program)
{
    int kernel;
    for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT; kernel++) {
        if (springls__cl_kernels[kernel].program != number || !cl->kernels[kernel]) continue;
        cl->ReleaseKernel(cl->kernels[kernel]);
        cl->kernels[kernel] = NULL;
    }
    if (program) cl->ReleaseProgram(program);
}

SPRINGLS__FN cl_int springls__cl_build_binary(springls__cl_build_state *b)
{
    const unsigned char *binary = b->blob + sizeof(springls__cl_head);
    cl_int error = CL_SUCCESS, taken = CL_SUCCESS;
    b->program = b->cl->CreateProgramWithBinary(b->cl->context, 1, &b->cl->device, &b->bytes, &binary, &taken, &error);
    if (error == CL_SUCCESS) error = taken;
    return error == CL_SUCCESS ? springls__cl_build_kernels(b) : error;
}

/* Takes from the driver what it has compiled for the device; leaves b->blob NULL when it does not give it. */
SPRINGLS__FN void springls__cl_take_binary(springls__cl_build_state *b)
{
    springls__cl *cl = b->cl;
    cl_device_id devices[SPRINGLS__CL_MAX_PLATFORMS];
    size_t sizes[SPRINGLS__CL_MAX_PLATFORMS], count = 0, i;
    unsigned char *binaries[SPRINGLS__CL_MAX_PLATFORMS];
    springls__cl_head head;
    cl_int error = cl->GetProgramInfo(b->program, CL_PROGRAM_DEVICES, sizeof devices, devices, &count);
    if (error == CL_SUCCESS) error = cl->GetProgramInfo(b->program, CL_PROGRAM_BINARY_SIZES, sizeof sizes, sizes, NULL);
    if (error != CL_SUCCESS) return;
    count /= sizeof *devices;
    memset(binaries, 0, sizeof binaries);
    for (i = 0; i < count; i++) {
        if (devices[i] != cl->device || sizes[i] == 0) continue;
        b->bytes = sizes[i];
        b->blob = (unsigned char *)malloc(sizeof head + b->bytes);
        if (b->blob) binaries[i] = b->blob + sizeof head;
    }
    if (!b->blob) return;
    if (cl->GetProgramInfo(b->program, CL_PROGRAM_BINARIES, count * sizeof *binaries, binaries, NULL) == CL_SUCCESS) {
        head = springls__cl_head_of(b->key, b->blob + sizeof head, b->bytes);
        memcpy(b->blob, &head, sizeof head);
        return;
    }
    free(b->blob);
    b->blob = NULL;
}

/* Compiles the text, and takes the compiled program for the cache. */
SPRINGLS__FN cl_int springls__cl_build_text(springls__cl_build_state *b)
{
    cl_int error = CL_SUCCESS;
    b->program = b->cl->CreateProgramWithSource(b->cl->context, (cl_uint)b->count, b->text, NULL, &error);
    if (error == CL_SUCCESS) error = springls__cl_build_kernels(b);
    if (error == CL_SUCCESS && b->cl->cache.store) springls__cl_take_binary(b);
    return error;
}

/* A task: builds programs from the cache, and those that are not there, or that the driver does not take, from their text. Calls
   nothing of the caller's. */
SPRINGLS__FN void springls__cl_build(void *builds, int begin, int end)
{
    springls__cl_build_state *b = (springls__cl_build_state *)builds + begin, *last = (springls__cl_build_state *)builds + end;
    for (; b < last; b++) {
        if (b->error != CL_SUCCESS) continue;
        if (b->loaded && springls__cl_build_binary(b) == CL_SUCCESS) continue;
        if (b->loaded) springls__cl_release_program(b->cl, b->number, b->program);
        free(b->blob);
        b->blob = NULL;
        b->loaded = false;
        b->program = NULL;
        b->error = springls__cl_build_text(b);
    }
}

SPRINGLS__FN void springls__cl_log_build(springls__cl *cl, cl_program program)
{
    size_t bytes = 0;
    char *text, *line, *next;
    if (!cl->logger.log || !program) return;
    if (cl->GetProgramBuildInfo(program, cl->device, CL_PROGRAM_BUILD_LOG, 0, NULL, &bytes) != CL_SUCCESS) return;
    text = (char *)calloc(bytes + 1, 1);
    if (!text) return;
    cl->GetProgramBuildInfo(program, cl->device, CL_PROGRAM_BUILD_LOG, bytes, text, NULL);
    for (line = text; line && *line; line = next) {
        next = strchr(line, '\n');
        if (next) *next++ = 0;
        if (*line) (cl->logger.log)(cl->logger.user, 2, line);
    }
    free(text);
}

/* Puts a program that has been compiled into the cache; after the first failure it warns, and keeps no more. */
SPRINGLS__FN void springls__cl_keep(const springls__cl_build_state *b)
{
    springls__cl *cl = b->cl;
    if (!b->blob || b->loaded || cl->warned) return;
    if ((cl->cache.store)(cl->cache.user, b->key, b->blob, sizeof(springls__cl_head) + b->bytes)) return;
    springls__cl_log(&cl->logger, 2, "opencl: compiled programs cannot be kept in %s", cl->folder ? cl->folder : "the cache");
    cl->warned = true;
}

/* Takes the program into the backend; returns the failure there was. */
SPRINGLS__FN cl_int springls__cl_end_build(springls__cl_build_state *b)
{
    springls__cl *cl = b->cl;
    if (b->error == CL_SUCCESS) {
        cl->programs[b->number] = b->program;
        springls__cl_keep(b);
    } else {
        springls__cl_log_build(cl, b->program);
        springls__cl_release_program(cl, b->number, b->program);
        cl->refused[b->number] = b->error == CL_BUILD_PROGRAM_FAILURE;
    }
    free(b->blob);
    free(b->text);
    return b->error;
}

/* Builds a program that has not been built yet. */
SPRINGLS__FN cl_int springls__cl_need(springls__cl *cl, springls__program program)
{
    springls__cl_build_state build;
    if (cl->programs[program]) return CL_SUCCESS;
    if (cl->refused[program]) return CL_BUILD_PROGRAM_FAILURE;
    springls__cl_begin_build(cl, program, &build);
    springls__cl_build(&build, 0, 1);
    return springls__cl_end_build(&build);
}

/* ---- creation ---- */

/* Loads the library; returns the name of what is missing, or NULL. */
SPRINGLS__FN const char *springls__cl_load(springls__cl *cl, const char *library)
{
    springls__cl_symbol symbol = NULL;
    if (!library) library = SPRINGLS__CL_LIBRARY;
    cl->library = SPRINGLS__CL_OPEN(library);
    if (!cl->library) return library;
#define SPRINGLS__CL_LOAD(name, result, arguments)                      \
    symbol = SPRINGLS__CL_FIND(cl->library, "cl" #name);                \
    memcpy(&cl->name, &symbol, sizeof symbol);                          \
    if (!symbol) return "cl" #name;
    SPRINGLS__CL_FUNCTIONS(SPRINGLS__CL_LOAD)
#undef SPRINGLS__CL_LOAD
    return NULL;
}

/* Chooses the first device of the kind; for ANY a GPU before others. */
SPRINGLS__FN bool springls__cl_choose_device(springls__cl *cl, springls_cl_kind kind)
{
    static const cl_device_type types[3][2] = {
        { CL_DEVICE_TYPE_GPU, CL_DEVICE_TYPE_ALL }, { CL_DEVICE_TYPE_GPU, 0 }, { CL_DEVICE_TYPE_CPU, 0 }
    };
    cl_platform_id platforms[SPRINGLS__CL_MAX_PLATFORMS];
    cl_uint count = 0, i;
    int choice;
    if (cl->GetPlatformIDs(SPRINGLS__CL_MAX_PLATFORMS, platforms, &count) != CL_SUCCESS) return false;
    if (count > SPRINGLS__CL_MAX_PLATFORMS) count = SPRINGLS__CL_MAX_PLATFORMS;
    for (choice = 0; choice < 2 && types[kind][choice]; choice++)
        for (i = 0; i < count; i++) {
            cl_uint devices = 0;
            cl_int error = cl->GetDeviceIDs(platforms[i], types[kind][choice], 1, &cl->device, &devices);
            if (error == CL_SUCCESS && devices > 0) return true;
        }
    return false;
}

/* Returns how many work items are to share a brick: one on a processor whose items have vectors of their own. Where they have none the
   driver gives an item one lane of a vector, and vectors of eight in there would not end to compile (Rusticl's llvmpipe). */
SPRINGLS__FN size_t springls__cl_brick_items(const springls__cl *cl, cl_device_type type)
{
    cl_uint width = 0;
    cl->GetDeviceInfo(cl->device, CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT, sizeof width, &width, NULL);
    return (type & CL_DEVICE_TYPE_CPU) && width > 1 ? 1 : SPRINGLS__ROWS;
}

SPRINGLS__FN cl_int springls__cl_describe(springls__cl *cl)
{
    cl_int error;
    char platform[100] = "", device[120] = "";
    cl_platform_id id = NULL;
    cl_device_type type = 0;
    cl_device_fp_config config = 0;
    cl->GetDeviceInfo(cl->device, CL_DEVICE_PLATFORM, sizeof id, &id, NULL); /* these may fail: names are only for the log */
    if (id) cl->GetPlatformInfo(id, CL_PLATFORM_NAME, sizeof platform - 1, platform, NULL);
    cl->GetDeviceInfo(cl->device, CL_DEVICE_NAME, sizeof device - 1, device, NULL);
    error = cl->GetDeviceInfo(cl->device, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    if (error == CL_SUCCESS) error = cl->GetDeviceInfo(cl->device, CL_DEVICE_SINGLE_FP_CONFIG, sizeof config, &config, NULL);
    snprintf(cl->device_name, sizeof cl->device_name, "%s: %s", platform, device);
    if (cl->group == 0) cl->group = springls__cl_brick_items(cl, type);
    /* To ask PoCL for a program makes it compile every kernel once more, for work groups of any size; it keeps them itself. */
    if (strcmp(platform, "Portable Computing Language") == 0) memset(&cl->cache, 0, sizeof cl->cache);
    cl->exact = (config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) && (config & CL_FP_DENORM);
    return error;
}

/* Returns a failure when the device has less of something than is needed. */
SPRINGLS__FN cl_int springls__cl_check_limit(springls__cl *cl, const char *what, size_t has, size_t needed)
{
    if (has >= needed) return CL_SUCCESS;
    snprintf(cl->lack, sizeof cl->lack, "%s: %lu, %lu are needed", what, (unsigned long)has, (unsigned long)needed);
    return CL_INVALID_WORK_GROUP_SIZE;
}

/* Returns a failure when the device has no room for a work group on a brick. */
SPRINGLS__FN cl_int springls__cl_check_room(springls__cl *cl)
{
#define SPRINGLS__CL_FLOATS(name, program, grain, writes, floats) (floats),
    static const size_t shared[] = { SPRINGLS__BRICK_KERNELS(SPRINGLS__CL_FLOATS) 0 };
#undef SPRINGLS__CL_FLOATS
    cl_ulong memory = 0;
    size_t items = 0, most = 0, i;
    cl_int error;
    cl->GetDeviceInfo(cl->device, CL_DEVICE_LOCAL_MEM_SIZE, sizeof memory, &memory, NULL);
    cl->GetDeviceInfo(cl->device, CL_DEVICE_MAX_WORK_GROUP_SIZE, sizeof items, &items, NULL);
    for (i = 0; i < sizeof shared / sizeof *shared; i++)
        if (shared[i] > most) most = shared[i];
    error = springls__cl_check_limit(cl, "bytes of local memory", (size_t)memory, most * sizeof(float));
    return error == CL_SUCCESS ? springls__cl_check_limit(cl, "items of a work group", items, cl->group) : error;
}

/* Takes the caller's queue, which must be in order, and of the context and device. */
SPRINGLS__FN cl_int springls__cl_take_queue(springls__cl *cl, cl_command_queue queue)
{
    cl_command_queue_properties properties = 0;
    cl_context context = NULL;
    cl_device_id device = NULL;
    cl_int error = cl->GetCommandQueueInfo(queue, CL_QUEUE_PROPERTIES, sizeof properties, &properties, NULL);
    if (error == CL_SUCCESS) error = cl->GetCommandQueueInfo(queue, CL_QUEUE_CONTEXT, sizeof context, &context, NULL);
    if (error == CL_SUCCESS) error = cl->GetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof device, &device, NULL);
    if (error != CL_SUCCESS) return error;
    if (properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) return CL_INVALID_COMMAND_QUEUE;
    if (context != cl->context || device != cl->device) return CL_INVALID_COMMAND_QUEUE;
    error = cl->RetainCommandQueue(queue);
    if (error == CL_SUCCESS) cl->queue = queue;
    return error;
}

/* Takes the caller's context, and its device, or its first one. */
SPRINGLS__FN cl_int springls__cl_take_context(springls__cl *cl, cl_context context, cl_device_id device)
{
    cl_device_id devices[SPRINGLS__CL_MAX_PLATFORMS] = { device };
    cl_int error = CL_SUCCESS;
    if (!device) error = cl->GetContextInfo(context, CL_CONTEXT_DEVICES, sizeof devices, devices, NULL);
    cl->device = devices[0];
    if (error == CL_SUCCESS) error = cl->RetainContext(context);
    if (error == CL_SUCCESS) cl->context = context;
    return error;
}

/* Sets up the caller's context and queue, or new ones, and builds the kernels. */
SPRINGLS__FN cl_int springls__cl_set_up(springls__cl *cl, const springls_cl_desc *desc)
{
    cl_int error = CL_SUCCESS;
    if (desc->context) error = springls__cl_take_context(cl, (cl_context)desc->context, (cl_device_id)desc->device);
    else if (!springls__cl_choose_device(cl, desc->kind)) return CL_DEVICE_NOT_FOUND;
    else cl->context = cl->CreateContext(NULL, 1, &cl->device, NULL, NULL, &error);
    if (error == CL_SUCCESS) error = springls__cl_describe(cl);
    if (error == CL_SUCCESS) error = springls__cl_check_room(cl);
    if (error != CL_SUCCESS) return error;
    if (desc->queue) error = springls__cl_take_queue(cl, (cl_command_queue)desc->queue);
    else cl->queue = cl->CreateCommandQueue(cl->context, cl->device, 0, &error);
    return error == CL_SUCCESS ? springls__cl_need(cl, SPRINGLS__PROGRAM_LISTS) : error;
}

SPRINGLS_API void springls_cl_destroy(springls_backend *backend)
{
    springls__cl *cl = (springls__cl *)(void *)backend;
    int kernel, program;
    if (!cl) return;
    for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT; kernel++)
        if (cl->kernels[kernel]) cl->ReleaseKernel(cl->kernels[kernel]);
    for (program = 0; program < (int)SPRINGLS__PROGRAM_COUNT; program++)
        if (cl->programs[program]) cl->ReleaseProgram(cl->programs[program]);
    if (cl->queue) cl->ReleaseCommandQueue(cl->queue);
    if (cl->context) cl->ReleaseContext(cl->context);
    if (cl->library) SPRINGLS__CL_CLOSE(cl->library);
    free(cl->velocity_source);
    free(cl->folder);
    free(cl);
}

SPRINGLS__FN void springls__cl_set_functions(springls_backend *base)
{
    base->resize = springls__cl_resize;
    base->release = springls__cl_release;
    base->transfer = springls__cl_transfer;
    base->upload = springls__cl_upload;
    base->finish = springls__cl_finish;
    base->run = springls__cl_launch;
}

/* Copies the velocity's text and the cache; returns false without memory for that. */
SPRINGLS__FN bool springls__cl_copy_strings(springls__cl *cl, const springls_cl_desc *desc)
{
    cl->cache = desc->cache;
    if (desc->velocity && !(cl->velocity_source = springls__cl_join(desc->velocity_source, "", ""))) return false;
    if (!desc->cache.folder) return true;
    cl->folder = springls__cl_join(desc->cache.folder, "", "");
    cl->cache.load = springls__cl_load_file;
    cl->cache.store = springls__cl_store_file;
    cl->cache.user = cl->folder;
    return cl->folder != NULL;
}

SPRINGLS_API springls_status springls_cl_create(const springls_cl_desc *desc, springls_backend **out)
{
    springls_cl_desc none;
    springls__cl *cl;
    const char *missing;
    cl_int error;
    memset(&none, 0, sizeof none);
    if (!desc) desc = &none;
    if (!out) return SPRINGLS_INVALID_ARGUMENT;
    *out = NULL;
    if ((int)desc->kind < SPRINGLS_CL_KIND_ANY || desc->kind > SPRINGLS_CL_KIND_CPU) return SPRINGLS_INVALID_ARGUMENT;
    if (desc->brick_items < 0 || desc->brick_items > SPRINGLS__ROWS) return SPRINGLS_INVALID_ARGUMENT;
    if (((desc->queue || desc->device) && !desc->context) || !desc->velocity != !desc->velocity_source) return SPRINGLS_INVALID_ARGUMENT;
    if (desc->velocity_source && !strstr(desc->velocity_source, "springls_velocity")) return SPRINGLS_INVALID_ARGUMENT;
    if (!desc->cache.load != !desc->cache.store || (desc->cache.folder && desc->cache.load)) return SPRINGLS_INVALID_ARGUMENT;
    if (desc->cache.folder && !desc->cache.folder[0]) return SPRINGLS_INVALID_ARGUMENT; /* it would be the file system's root */
    cl = (springls__cl *)calloc(1, sizeof *cl);
    if (!cl) return SPRINGLS_OUT_OF_MEMORY;
    if (!springls__cl_copy_strings(cl, desc)) {
        springls_cl_destroy(&cl->base);
        return SPRINGLS_OUT_OF_MEMORY;
    }
    cl->logger = desc->logger;
    cl->tasks = desc->tasks;
    cl->group = (size_t)desc->brick_items;
    springls__cl_set_functions(&cl->base);
    cl->base.timed = desc->timed;
    cl->base.user_velocity = desc->velocity;
    cl->base.user_bytes = desc->velocity ? desc->velocity_user_bytes : 0;
    missing = springls__cl_load(cl, desc->library);
    if (missing) {
        springls__cl_log(&desc->logger, 2, "opencl: there is no %s: going on without", missing);
        error = CL_DEVICE_NOT_AVAILABLE;
    } else {
        error = springls__cl_set_up(cl, desc);
        if (error != CL_SUCCESS) springls__cl_log(&desc->logger, 2, "opencl: %s: going on without",
                                                    cl->lack[0] ? cl->lack : springls__cl_error(error));
    }
    if (error != CL_SUCCESS) {
        springls_cl_destroy(&cl->base);
        return springls__cl_status(error);
    }
    springls__cl_log(&desc->logger, 3, "opencl: %s", cl->device_name);
    *out = &cl->base;
    return SPRINGLS_OK;
}

/* ---- springls_cl_prepare ---- */

enum { SPRINGLS__CL_AT_ONCE = 4 }; /* programs that threads build between two reports */

/* Counts kernels that are compiled and those that are started; returns true when the caller cancels. */
SPRINGLS__FN bool springls__cl_report(const springls__cl *cl, const springls_progress *progress, int started)
{
    int compiled = 0, kernel;
    if (!progress || !progress->report) return false;
    for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT; kernel++) compiled += cl->kernels[kernel] != NULL;
    return (progress->report)(progress->user, (float)(compiled + started) / (float)(2 * (int)SPRINGLS__KERNEL_COUNT)) != 0;
}

/* Builds the next programs that have not been built, from *program on; returns the first failure. */
SPRINGLS__FN cl_int springls__cl_build_some(springls__cl *cl, int *program)
{
    springls__cl_build_state builds[SPRINGLS__CL_AT_ONCE];
    const int most = cl->tasks.parallel_for ? SPRINGLS__CL_AT_ONCE : 1;
    cl_int error = CL_SUCCESS;
    int count = 0, i;
    for (; *program < (int)SPRINGLS__PROGRAM_COUNT && count < most; ++*program)
        if (!cl->programs[*program]) springls__cl_begin_build(cl, (springls__program)*program, &builds[count++]);
    if (count > 1) (cl->tasks.parallel_for)(cl->tasks.user, count, 1, springls__cl_build, builds);
    else springls__cl_build(builds, 0, count);
    for (i = 0; i < count; i++) {
        cl_int failure = springls__cl_end_build(&builds[i]);
        if (error == CL_SUCCESS) error = failure;
    }
    return error;
}

/* Runs a kernel over no elements. `memory` stands for all arrays: what a compiler reads ahead of a loop has to be somewhere. */
SPRINGLS__FN cl_int springls__cl_run_empty(springls__cl *cl, int kernel, cl_mem memory)
{
    springls__places places;
    springls__arguments args;
    springls__model model;
    cl_int error;
    memset(&places, 0, sizeof places);
    memset(&args, 0, sizeof args);
    memset(&model, 0, sizeof model);
    error = springls__cl_arguments(cl, cl->kernels[kernel], memory, places, &model, args, 0, 1);
    if (error == CL_SUCCESS) error = springls__cl_enqueue(cl, cl->kernels[kernel], 1, springls__cl_kernels[kernel].brick);
    return error == CL_SUCCESS ? cl->Finish(cl->queue) : error;
}

SPRINGLS__FN springls_status springls__cl_prepared(const springls__cl *cl, cl_int error, const char *what)
{
    char line[128];
    if (error == CL_SUCCESS) return SPRINGLS_OK;
    snprintf(line, sizeof line, "%s: %s (%d)", what, springls__cl_error(error), (int)error);
    springls__cl_log(&cl->logger, 1, "opencl: prepare: %s", line);
    return springls__cl_status(error);
}

SPRINGLS_API springls_status springls_cl_prepare(springls_backend *backend, const springls_progress *progress)
{
    const size_t enough = 65536; /* bytes: an element of every array */
    springls__cl *cl = (springls__cl *)(void *)backend;
    springls_status status = SPRINGLS_OK;
    cl_int error = CL_SUCCESS;
    cl_mem memory;
    int program = 0, kernel;
    if (!cl) return SPRINGLS_INVALID_ARGUMENT;
    while (program < (int)SPRINGLS__PROGRAM_COUNT) {
        SPRINGLS__TRY(springls__cl_prepared(cl, springls__cl_build_some(cl, &program), "compile"));
        if (springls__cl_report(cl, progress, 0)) return SPRINGLS_CANCELLED;
    }
    memory = cl->CreateBuffer(cl->context, CL_MEM_READ_WRITE, enough, NULL, &error);
    SPRINGLS__TRY(springls__cl_prepared(cl, error, "device memory"));
    for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT && status == SPRINGLS_OK; kernel++) {
        status = springls__cl_prepared(cl, springls__cl_run_empty(cl, kernel, memory), springls__cl_kernels[kernel].name);
        if (status == SPRINGLS_OK && springls__cl_report(cl, progress, kernel + 1)) status = SPRINGLS_CANCELLED;
    }
    cl->ReleaseMemObject(memory);
    return status;
}

SPRINGLS_API const char *springls_cl_name(const springls_backend *backend)
{
    return backend ? ((const springls__cl *)(const void *)backend)->device_name : "";
}

SPRINGLS_API bool springls_cl_exact(const springls_backend *backend)
{
    return backend && ((const springls__cl *)(const void *)backend)->exact;
}

SPRINGLS_API void *springls_cl_springl_buffer(springls_context *ctx, size_t *offset)
{
    if (!ctx || !offset || !ctx->backend || ctx->model.set.count == 0) return NULL;
    springls__use_device(ctx);
    if (springls__to_device(ctx, 0) != SPRINGLS_OK) {
        springls__report_device_failure(ctx, springls__fall_back_to_host(ctx));
        return NULL;
    }
    *offset = ctx->memory[SPRINGLS__ARRAY_S].device_at;
    return ctx->device_memory.buffer;
}

SPRINGLS_API springls_cl_counts springls_cl_get_counts(const springls_backend *backend)
{
    springls_cl_counts none;
    memset(&none, 0, sizeof none);
    return backend ? ((const springls__cl *)(const void *)backend)->counts : none;
}

#endif
#endif
