/* test_opencl_cache.c - compiled programs are kept: found again, compiled again where they are damaged or of something else, and
   nothing fails because they cannot be kept. The driver is PoCL behind a stub that gives it another name, and a program's text for
   compiled code where the driver's own code is not what is tested. Skipped without OpenCL. */
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- allocations of springls_cl.h, which can fail ---- */

static int cache_allocations, cache_fail_at = -1, cache_blocks;

/* Threads allocate too. */
static void *cache_allocated(void *memory)
{
    if (memory) __sync_fetch_and_add(&cache_blocks, 1);
    return memory;
}

static bool cache_fails(void) { return __sync_fetch_and_add(&cache_allocations, 1) == cache_fail_at; }
static void *cache_malloc(size_t bytes) { return cache_fails() ? NULL : cache_allocated(malloc(bytes)); }
static void *cache_calloc(size_t count, size_t bytes) { return cache_fails() ? NULL : cache_allocated(calloc(count, bytes)); }

static void cache_free(void *memory)
{
    if (memory) __sync_fetch_and_sub(&cache_blocks, 1);
    free(memory);
}

#define malloc(bytes) cache_malloc(bytes)
#define calloc(count, bytes) cache_calloc(count, bytes)
#define free(memory) cache_free(memory)
#include "springls_under_test.h"
#include "springls_cl.h"
#undef malloc
#undef calloc
#undef free

#include "fixtures.h"
#include "opencl_stub.h"

#include <dirent.h>
#include <sys/stat.h>

static const stub_controls *stub; /* NULL: there is none here, or no OpenCL behind it */
static char stub_path[512];
static int objects_before, blocks_before; /* the test */

#define NEEDS_STUB() do { if (!stub) SKIPm("there is no OpenCL device, or no stub before it"); } while (0)

enum { PROGRAMS = SPRINGLS__PROGRAM_COUNT, OTHER_NAME = 1, TEXT_FOR_CODE = 2 };

/* ---- a cache in memory ---- */

typedef struct cache_entry { char key[24]; unsigned char *blob; size_t bytes; } cache_entry;

typedef struct cache_memory {
    cache_entry entries[16];
    int count, loads, hits, stores;
    size_t lie;    /* bytes that a blob is said to have; 0: as many as it has */
    bool refuses;  /* to keep anything                                        */
    bool fails;    /* to copy                                                 */
} cache_memory;

FIXTURE cache_entry *cache_find(cache_memory *memory, const char *key)
{
    int i;
    for (i = 0; i < memory->count && strcmp(memory->entries[i].key, key) != 0; i++) continue;
    return &memory->entries[i];
}

FIXTURE size_t cache_load(void *user, const char *key, void *blob, size_t room)
{
    cache_memory *memory = (cache_memory *)user;
    const cache_entry *entry = cache_find(memory, key);
    memory->loads++;
    if (!entry->blob) return 0;
    if (room < entry->bytes || memory->fails) return room == 0 ? (memory->lie ? memory->lie : entry->bytes) : 0;
    memory->hits++;
    memcpy(blob, entry->blob, entry->bytes);
    return entry->bytes;
}

FIXTURE bool cache_store(void *user, const char *key, const void *blob, size_t bytes)
{
    cache_memory *memory = (cache_memory *)user;
    cache_entry *entry = cache_find(memory, key);
    memory->stores++;
    if (memory->refuses || memory->count == 15) return false;
    if (!entry->blob) snprintf(memory->entries[memory->count++].key, sizeof entry->key, "%s", key);
    free(entry->blob);
    entry->blob = (unsigned char *)malloc(bytes);
    entry->bytes = bytes;
    memcpy(entry->blob, blob, bytes);
    return true;
}

FIXTURE void cache_forget(cache_memory *memory)
{
    int i;
    for (i = 0; i < memory->count; i++) free(memory->entries[i].blob);
    memset(memory, 0, sizeof *memory);
}

/* ---- a folder ---- */

static char folder[560];

/* Calls `each` for every file of the folder; returns how many there are. */
FIXTURE int folder_files(void (*each)(const char *path))
{
    DIR *dir = opendir(folder);
    struct dirent *entry;
    int count = 0;
    while (dir && (entry = readdir(dir)) != NULL) {
        char path[900];
        if (entry->d_name[0] == '.') continue;
        count++;
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (each) each(path);
    }
    if (dir) closedir(dir);
    return count;
}

FIXTURE void remove_file(const char *path) { remove(path); }

/* ---- backends ---- */

typedef struct cache_log { int errors, warnings; char line[256]; } cache_log;

static cache_log log_lines;

FIXTURE void cache_logger(void *user, int level, const char *message)
{
    cache_log *log = (cache_log *)user;
    log->errors += level == 1;
    log->warnings += level == 2;
    if (level < 3) snprintf(log->line, sizeof log->line, "%s", message);
}

FIXTURE springls_cl_desc cache_desc(const char *in_folder, cache_memory *memory)
{
    springls_cl_desc desc;
    memset(&desc, 0, sizeof desc);
    memset(&log_lines, 0, sizeof log_lines);
    desc.library = stub_path;
    desc.logger.log = cache_logger;
    desc.logger.user = &log_lines;
    desc.cache.folder = in_folder;
    if (memory) {
        desc.cache.load = cache_load;
        desc.cache.store = cache_store;
        desc.cache.user = memory;
    }
    return desc;
}

/* Counts calls from now on, of a driver of the kind. */
FIXTURE void count_calls(int driver)
{
    stub->begin();
    stub->other_driver(driver);
    objects_before = stub->objects();
    blocks_before = cache_blocks;
}

FIXTURE bool nothing_is_left(void)
{
    return stub->objects() == objects_before && stub->misuse()[0] == 0 && cache_blocks == blocks_before;
}

FIXTURE int from_text(void) { return stub->calls("clCreateProgramWithSource"); }
FIXTURE int from_cache(void) { return stub->calls("clCreateProgramWithBinary"); }

/* Makes and destroys a backend, with its first program or with all. */
FIXTURE springls_status make_first(const springls_cl_desc *desc)
{
    springls_backend *backend;
    springls_status status = springls_cl_create(desc, &backend);
    springls_cl_destroy(backend);
    return status;
}

FIXTURE springls_status make_all(const springls_cl_desc *desc)
{
    springls_backend *backend;
    springls_status status = springls_cl_create(desc, &backend);
    if (status == SPRINGLS_OK) status = springls_cl_prepare(backend, NULL);
    springls_cl_destroy(backend);
    return status;
}

/* Returns the hash of a model that a backend has moved. */
FIXTURE uint64_t hash_on(springls_backend *backend)
{
    springls_params p = springls_default_params();
    springls_desc desc = fixture_desc(20, &p);
    springls_sphere ball = fixture_ball(9.5f, 9.5f, 9.5f, 5.0f);
    springls_context *ctx;
    uint64_t hash = 0;
    desc.backend = backend;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 0;
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
        && springls_run_stage(ctx, SPRINGLS_STAGE_RELAX) == SPRINGLS_OK)
        hash = springls_state_hash(ctx);
    springls_destroy(ctx);
    return hash;
}

/* ---- tests ---- */

/* The first start compiles all programs and keeps each in a file; the second compiles none, and works the same. */
TEST programs_are_kept_in_a_folder(void)
{
    springls_cl_desc desc = cache_desc(folder, NULL);
    springls_backend *backend;
    NEEDS_STUB();
    folder_files(remove_file);
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(springls_cl_create(&desc, &backend));
    ASSERT_EQ(1, folder_files(NULL));
    ASSERT_OK(springls_cl_prepare(backend, NULL));
    springls_cl_destroy(backend);
    ASSERT_EQ(PROGRAMS, folder_files(NULL));
    ASSERT_EQ(PROGRAMS, from_text());
    ASSERT_EQ(0, from_cache());
    ASSERT(nothing_is_left());
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(springls_cl_create(&desc, &backend));
    ASSERT_OK(springls_cl_prepare(backend, NULL));
    ASSERT_EQ(0, from_text());
    ASSERT_EQ(PROGRAMS, from_cache());
    ASSERT_EQ(PROGRAMS, folder_files(NULL));
    ASSERT(hash_on(backend) == hash_on(NULL));
    springls_cl_destroy(backend);
    ASSERT_EQ(0, log_lines.errors + log_lines.warnings);
    ASSERT(nothing_is_left());
    PASS();
}

/* Ways of spoiling a blob; returns false when there are no more. */
FIXTURE bool spoil(cache_memory *memory, int way)
{
    cache_entry *first = &memory->entries[0], *second = &memory->entries[1];
    switch (way) {
    case 0: first->blob[first->bytes - 1] ^= 1; break;          /* a bit of the program   */
    case 1: first->blob[sizeof(springls__cl_head)] ^= 128; break;
    case 2: first->blob[0] ^= 1; break;                         /* of the head            */
    case 3: first->blob[offsetof(springls__cl_head, key)] ^= 1; break;
    case 4: first->blob[offsetof(springls__cl_head, bytes)] ^= 1; break;
    case 5: first->blob[offsetof(springls__cl_head, hash)] ^= 1; break;
    case 6: first->bytes /= 2; break;                           /* it is cut              */
    case 7: first->bytes = sizeof(springls__cl_head); break;
    case 8: first->bytes = 3; break;
    case 9:                                                     /* it is of another program */
        free(first->blob);
        first->bytes = second->bytes;
        first->blob = (unsigned char *)malloc(first->bytes);
        memcpy(first->blob, second->blob, first->bytes);
        break;
    default: return false;
    }
    return true;
}

/* Whatever is wrong with a blob, its program is compiled and kept anew. */
TEST a_spoilt_blob_is_replaced(void)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    int way;
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(make_all(&desc));
    ASSERT_EQ(PROGRAMS, memory.count);
    for (way = 0; spoil(&memory, way); way++) {
        count_calls(TEXT_FOR_CODE);
        memory.stores = 0;
        ASSERT_OK(make_first(&desc));
        ASSERT_EQ(1, from_text());
        ASSERT_EQ(1, memory.stores);
        ASSERT_OK(make_first(&desc));
        ASSERT_EQ(1, from_text());
        ASSERT_EQ(1, from_cache());
        ASSERT_EQ(1, memory.stores);
        ASSERT(nothing_is_left());
    }
    ASSERT_EQ(10, way);
    ASSERT_EQ(0, log_lines.errors + log_lines.warnings);
    cache_forget(&memory);
    PASS();
}

/* A driver that does not take a program back gets its text. */
TEST a_driver_refuses_a_program(const char *function)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(make_all(&desc));
    stub->begin();
    stub->other_driver(TEXT_FOR_CODE);
    stub->fail(function, 0, CL_INVALID_BINARY, 0);
    ASSERT_OK(make_all(&desc));
    ASSERT_STR_EQ(function, stub->failed());
    ASSERT_EQ(1, from_text());
    ASSERT_EQ(PROGRAMS + 1, memory.stores);
    ASSERT_EQ(0, log_lines.errors + log_lines.warnings);
    ASSERT(nothing_is_left());
    cache_forget(&memory);
    PASS();
}

/* A driver that does not give a program away is no failure. */
TEST a_driver_keeps_its_program(int call)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(TEXT_FOR_CODE);
    stub->fail("clGetProgramInfo", call, CL_OUT_OF_RESOURCES, 0);
    ASSERT_OK(make_all(&desc));
    ASSERT_EQ(PROGRAMS - 1, memory.stores);
    ASSERT(nothing_is_left());
    cache_forget(&memory);
    PASS();
}

/* Where nothing can be kept, one warning tells so, and all works. */
TEST nothing_can_be_kept(const char *in_folder)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(in_folder, in_folder ? NULL : &memory);
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    memory.refuses = true;
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(make_all(&desc));
    ASSERT_EQ(PROGRAMS, from_text());
    ASSERT_EQ(1, log_lines.warnings);
    ASSERT_EQ(0, log_lines.errors);
    ASSERT(strstr(log_lines.line, "opencl: compiled programs cannot be kept in ") == log_lines.line);
    ASSERT(strstr(log_lines.line, in_folder ? in_folder : "the cache") != NULL);
    ASSERT(nothing_is_left());
    PASS();
}

/* Callbacks that say one thing and do another cost a compilation. */
TEST callbacks_fail(void)
{
    static const size_t lies[] = { 0, 1, 100, (size_t)1 << 29, SIZE_MAX };
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    size_t i;
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(make_first(&desc));
    memory.fails = true;
    for (i = 0; i < sizeof lies / sizeof *lies; i++) {
        memory.lie = lies[i];
        count_calls(TEXT_FOR_CODE);
        ASSERT_OK(make_first(&desc));
        ASSERT_EQ(1, from_text());
        ASSERT_EQ(0, memory.hits);
        ASSERT(nothing_is_left());
    }
    cache_forget(&memory);
    PASS();
}

/* A program has another key where its text or the driver is another one. */
TEST keys_differ(void)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    springls_backend *backend;
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(TEXT_FOR_CODE);
    ASSERT_OK(make_all(&desc));
    ASSERT_EQ(PROGRAMS, memory.count);
    desc.velocity = exact_flow_velocity; /* part of two programs */
    desc.velocity_source = "float3 springls_velocity(float3 x, float t, __global const float *u) { return x * t; }\n";
    ASSERT_OK(springls_cl_create(&desc, &backend));
    ASSERT_EQ(CL_SUCCESS, springls__cl_need((springls__cl *)(void *)backend, SPRINGLS__PROGRAM_MOVE));
    ASSERT_EQ(CL_SUCCESS, springls__cl_need((springls__cl *)(void *)backend, SPRINGLS__PROGRAM_EDGES));
    springls_cl_destroy(backend);
    ASSERT_EQ(PROGRAMS + 2, memory.count);
    desc.velocity = NULL;
    desc.velocity_source = NULL;
    desc.brick_items = 2; /* other options */
    ASSERT_OK(springls_cl_create(&desc, &backend));
    springls_cl_destroy(backend);
    ASSERT_EQ(PROGRAMS + 3, memory.count);
    cache_forget(&memory);
    PASS();
}

TEST descriptions_are_checked(void)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(folder, &memory);
    springls_backend *backend;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    desc = cache_desc("", NULL);
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    desc = cache_desc(NULL, NULL);
    desc.velocity = exact_flow_velocity;
    desc.velocity_source = "float3 springls_velocty(float3 x, float t, __global const float *u) { return x; }\n";
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    desc = cache_desc(NULL, &memory);
    desc.cache.load = NULL;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    desc.cache.load = cache_load;
    desc.cache.store = NULL;
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    desc = cache_desc(NULL, NULL);
    desc.device = &desc; /* of no context */
    ASSERT_STATUS(SPRINGLS_INVALID_ARGUMENT, springls_cl_create(&desc, &backend));
    PASS();
}

/* Whichever allocation fails, with an empty folder and with a full one: all works, or there is a status; nothing is left. */
TEST allocations_fail(int full)
{
    springls_cl_desc desc = cache_desc(folder, NULL);
    int calls, call;
    NEEDS_STUB();
    folder_files(remove_file);
    count_calls(TEXT_FOR_CODE);
    if (full) ASSERT_OK(make_first(&desc));
    cache_allocations = 0;
    ASSERT_OK(make_first(&desc));
    calls = cache_allocations;
    ASSERT_GT(calls, 5);
    for (call = 0; call < calls; call++) {
        springls_status status;
        if (!full) folder_files(remove_file);
        count_calls(TEXT_FOR_CODE);
        cache_allocations = 0;
        cache_fail_at = call;
        status = make_first(&desc);
        cache_fail_at = -1;
        ASSERT(status == SPRINGLS_OK || status == SPRINGLS_OUT_OF_MEMORY);
        ASSERT(nothing_is_left());
    }
    PASS();
}

typedef struct on_threads { float last; int reports, stop; bool ordered; } on_threads;

FIXTURE int thread_report(void *user, float fraction)
{
    on_threads *p = (on_threads *)user;
    p->ordered = p->ordered && fraction > p->last;
    p->last = fraction;
    return ++p->reports == p->stop;
}

/* Threads compile the same programs; reports come from the calling thread, after some programs each. */
TEST threads_compile(int full)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    fixture_workers workers;
    springls_backend *backend;
    on_threads p = { 0.0f, 0, 1, true };
    springls_progress progress;
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    progress.report = thread_report;
    progress.user = &p;
    count_calls(TEXT_FOR_CODE);
    if (full) ASSERT_OK(make_all(&desc));
    count_calls(TEXT_FOR_CODE);
    desc.tasks = fixture_tasks(&workers, 3, 1);
    ASSERT_OK(springls_cl_create(&desc, &backend));
    ASSERT_STATUS(SPRINGLS_CANCELLED, springls_cl_prepare(backend, &progress));
    ASSERT_EQ(1 + SPRINGLS__CL_AT_ONCE, from_text() + from_cache());
    ASSERT_OK(springls_cl_prepare(backend, &progress));
    ASSERT_EQ(PROGRAMS, full ? from_cache() : from_text());
    ASSERT_EQ(2 + (int)SPRINGLS__KERNEL_COUNT, p.reports);
    ASSERT(p.ordered && p.last == 1.0f);
    ASSERT_EQ(PROGRAMS, memory.count);
    ASSERT(hash_on(backend) == hash_on(NULL));
    springls_cl_destroy(backend);
    ASSERT(nothing_is_left());
    cache_forget(&memory);
    PASS();
}

/* PoCL keeps programs itself. Under another name it is a driver as any: its own compiled code is kept, and runs. */
TEST the_code_of_a_driver(void)
{
    cache_memory memory;
    springls_cl_desc desc = cache_desc(NULL, &memory);
    springls_backend *backend;
    int kernel, round;
    NEEDS_STUB();
    memset(&memory, 0, sizeof memory);
    count_calls(0);
    ASSERT_OK(springls_cl_create(&desc, &backend));
    springls_cl_destroy(backend);
    ASSERT_EQ(0, memory.loads + memory.stores);
    for (round = 0; round < 2; round++) {
        springls__cl *cl;
        cl_mem buffer;
        cl_int error;
        count_calls(OTHER_NAME);
        ASSERT_OK(springls_cl_create(&desc, &backend));
        ASSERT_EQ(round, from_cache());
        ASSERT_EQ(1, memory.stores);
        cl = (springls__cl *)(void *)backend;
        buffer = cl->CreateBuffer(cl->context, CL_MEM_READ_WRITE, 65536, NULL, &error);
        for (kernel = 0; kernel < (int)SPRINGLS__KERNEL_COUNT; kernel++)
            if (cl->kernels[kernel]) ASSERT_EQ(CL_SUCCESS, springls__cl_run_empty(cl, kernel, buffer));
        cl->ReleaseMemObject(buffer);
        springls_cl_destroy(backend);
        ASSERT(nothing_is_left());
    }
    cache_forget(&memory);
    PASS();
}

SUITE(cache)
{
    char missing[600], file[600];
    snprintf(missing, sizeof missing, "%s/none", folder);
    snprintf(file, sizeof file, "%s", stub_path); /* a file is no folder */
    RUN_TEST(programs_are_kept_in_a_folder);
    RUN_TEST(a_spoilt_blob_is_replaced);
    RUN_TESTp(a_driver_refuses_a_program, "clCreateProgramWithBinary");
    RUN_TESTp(a_driver_refuses_a_program, "clBuildProgram");
    RUN_TESTp(a_driver_refuses_a_program, "clCreateKernel");
    RUN_TESTp(a_driver_keeps_its_program, 0);
    RUN_TESTp(a_driver_keeps_its_program, 1);
    RUN_TESTp(a_driver_keeps_its_program, 2);
    RUN_TESTp(nothing_can_be_kept, missing);
    RUN_TESTp(nothing_can_be_kept, file);
    RUN_TESTp(nothing_can_be_kept, NULL);
    RUN_TEST(callbacks_fail);
    RUN_TEST(keys_differ);
    RUN_TEST(descriptions_are_checked);
    RUN_TESTp(allocations_fail, 0);
    RUN_TESTp(allocations_fail, 1);
    RUN_TESTp(threads_compile, 0);
    RUN_TESTp(threads_compile, 1);
    RUN_TEST(the_code_of_a_driver);
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    const char *slash = strrchr(argv[0], '/');
    springls_backend *backend = NULL;
    springls_cl_desc desc;
    void *library;
    GREATEST_MAIN_BEGIN();
    fixture_backend(); /* where SPRINGLS_TEST_BACKEND asks for one: its blocks are not the tests' */
    snprintf(stub_path, sizeof stub_path, "%.*s/opencl_stub.so", slash ? (int)(slash - argv[0]) : 1,
             slash ? argv[0] : "."); /* beside this program */
    snprintf(folder, sizeof folder, "%s.cache", argv[0]);
    mkdir(folder, 0700);
    library = SPRINGLS__CL_OPEN(stub_path);
    if (library) stub = (const stub_controls *)SPRINGLS__CL_FIND(library, "stub_control");
    if (!stub) printf("there is no %s\n", stub_path);
    if (stub) stub->begin();
    desc = cache_desc(NULL, NULL);
    if (stub && springls_cl_create(&desc, &backend) != SPRINGLS_OK) stub = NULL;
    springls_cl_destroy(backend);
    RUN_SUITE(cache);
    folder_files(remove_file);
    remove(folder);
    GREATEST_MAIN_END();
}
