#define _POSIX_C_SOURCE 200809L

#include "springls/run_options.h"

#include "base/progress.h"
#include "base/threads.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#ifdef _OPENMP
#include <omp.h>
#endif

struct member {
    const char *name;
    size_t offset;
    bool is_float; /* else int, or an enumeration of that size */
};

#define REAL(name) {#name, offsetof(springls_params, name), true}
#define INTEGER(name) {#name, offsetof(springls_params, name), false}

static const struct member members[] = {
    REAL(d_max),                   REAL(particle_radius),         REAL(neighbor_radius),         INTEGER(max_neighbors),
    INTEGER(relax_iterations),     INTEGER(threshold),            INTEGER(weight),               INTEGER(torque),
    REAL(sharpness),               REAL(kappa_int),               REAL(kappa_ext),               REAL(relax_step_length),
    REAL(relax_step_rotation),     INTEGER(relax_same_side),      REAL(contract_distance),       REAL(min_angle),
    REAL(max_angle),               REAL(min_area),                INTEGER(reshape),              REAL(merge_distance),
    INTEGER(resample_period),      INTEGER(resample_last),        REAL(split_edge),              REAL(split_area),
    INTEGER(placement),            REAL(band_half_width),         REAL(capture_range),           INTEGER(evolve_iterations),
    REAL(evolve_step),             REAL(evolve_width),            REAL(curvature),               INTEGER(carry_level_set),
    REAL(lazy_distance),
    INTEGER(project_level_set),    INTEGER(nucleate),             INTEGER(keep_thin),            INTEGER(keep_edges),
    INTEGER(fill_from_springls),   INTEGER(topology),             REAL(nearest_rule),            INTEGER(track_iterations),
    REAL(track_step),              INTEGER(vertex_velocity),      INTEGER(half_time_sampling),   INTEGER(initial_stride),
    INTEGER(project_initial),      INTEGER(volume_lock),          INTEGER(split_input),          REAL(min_component),
    INTEGER(cover),                INTEGER(components),           INTEGER(contact),              INTEGER(contouring),
};

/* Has no value when a member of springls_params, all but the cookie, is missing from the list. */
typedef char all_members_are_listed[4 * (sizeof members / sizeof *members + 1) == sizeof(springls_params) ? 1 : -1];

static const struct member *find_member(const char *name, size_t length)
{
    for (size_t i = 0; i < sizeof members / sizeof *members; ++i) {
        if (strlen(members[i].name) == length && strncmp(members[i].name, name, length) == 0) {
            return &members[i];
        }
    }
    return NULL;
}

const char *run_member_at(size_t offset)
{
    for (size_t i = 0; i < sizeof members / sizeof *members; ++i) {
        if (members[i].offset <= offset && offset < members[i].offset + 4) {
            return members[i].name;
        }
    }
    return "one that --set does not know either";
}

/* Adds bytes to an FNV-1a hash. */
static uint32_t hash_bytes(uint32_t hash, const void *bytes, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        hash = (hash ^ ((const unsigned char *)bytes)[i]) * 16777619u;
    }
    return hash;
}

uint32_t run_params_hash(const springls_params *params)
{
    uint32_t hash = 2166136261u;
    for (size_t i = 0; i < sizeof members / sizeof *members; ++i) {
        uint32_t bits;
        memcpy(&bits, (const char *)params + members[i].offset, sizeof bits);
        if (bits != 0) {
            const unsigned char bytes[4] = {(unsigned char)bits, (unsigned char)(bits >> 8), (unsigned char)(bits >> 16),
                                            (unsigned char)(bits >> 24)};
            hash = hash_bytes(hash_bytes(hash, members[i].name, strlen(members[i].name)), bytes, sizeof bytes);
        }
    }
    return hash;
}

/* Sets one member from "name=value" of `length` characters. */
static bool set_member(springls_params *params, const char *text, size_t length)
{
    char value[64];
    const char *equals = memchr(text, '=', length);
    const struct member *member = equals ? find_member(text, (size_t)(equals - text)) : NULL;
    const size_t value_length = equals ? length - (size_t)(equals + 1 - text) : 0;
    double real = 0.0;
    int integer = 0;
    if (!member || value_length >= sizeof value) {
        return false;
    }
    memcpy(value, equals + 1, value_length);
    value[value_length] = '\0';
    char *place = (char *)params + member->offset;
    if (member->is_float && cli_read_double(value, &real) && fabs(real) <= FLT_MAX) {
        const float single = (float)real;
        memcpy(place, &single, sizeof single);
        return true;
    }
    if (!member->is_float && cli_read_int(value, &integer)) {
        memcpy(place, &integer, sizeof integer);
        return true;
    }
    return false;
}

int run_set_members(const char *program, const char *set, springls_params *params)
{
    for (const char *item = set; item && *item;) {
        const size_t length = strcspn(item, ",");
        if (!set_member(params, item, length)) {
            return cli_fail(program, CLI_EXIT_USAGE, "--set %.*s: expected name=number with a member of springls_params",
                            (int)length, item);
        }
        item += length + (item[length] == ',' ? 1 : 0);
    }
    return CLI_CONTINUE;
}

/* Makes a folder and those that it lies in, as far as they are missing, with the rights of `mode`. */
static bool make_folders(const char *path, mode_t mode)
{
    char folder[1024];
    for (size_t n = 1; n < sizeof folder; ++n) {
        const char end = path[n];
        if (end == '/' || end == '\0') {
            memcpy(folder, path, n);
            folder[n] = '\0';
            if (mkdir(folder, mode) != 0 && errno != EEXIST) {
                return false;
            }
        }
        if (end == '\0') {
            return true;
        }
    }
    errno = ENAMETOOLONG;
    return false;
}

/* Returns whether a folder takes files, by making one and removing it; errno has the reason. */
static bool takes_files(const char *folder)
{
    char file[1100];
    snprintf(file, sizeof file, "%s/.springls_XXXXXX", folder);
    const int descriptor = mkstemp(file);
    if (descriptor < 0) {
        return false;
    }
    close(descriptor);
    unlink(file);
    return true;
}

int run_make_folder(const char *program, const char *path)
{
    const bool made = make_folders(path, 0777);
    struct stat info;
    if (!made) {
        return cli_fail(program, CLI_EXIT_FAILURE, "cannot make the folder %s: %s", path, strerror(errno));
    }
    if (stat(path, &info) != 0 || !S_ISDIR(info.st_mode)) {
        return cli_fail(program, CLI_EXIT_FAILURE, "%s is no folder", path);
    }
    return takes_files(path) ? CLI_CONTINUE
                             : cli_fail(program, CLI_EXIT_FAILURE, "cannot write into %s: %s", path, strerror(errno));
}

/* Returns whether a file can be written or replaced; errno has the reason. One that exists is not opened: it may be a pipe. */
static bool can_be_written(const char *path)
{
    char folder[1024] = ".";
    struct stat info;
    const char *slash = strrchr(path, '/');
    if (stat(path, &info) == 0) {
        errno = EISDIR;
        return !S_ISDIR(info.st_mode) && access(path, W_OK) == 0;
    }
    if (slash) { snprintf(folder, sizeof folder, "%.*s", (int)(slash - path + 1), path); }
    return takes_files(folder);
}

int run_check_output(const char *program, const char *path)
{
    if (!can_be_written(path)) {
        cli_write_failed(program, path);
        return CLI_EXIT_FAILURE;
    }
    errno = 0; /* stat has left that there is no such file */
    return CLI_CONTINUE;
}

static springls_threads *pool; /* of the program, until it ends */

static void end_threads(void)
{
    threads_use(NULL, NULL, 1);
    springls_threads_destroy(pool);
    pool = NULL;
}

springls_tasks run_tasks(void)
{
    return springls_threads_tasks(pool);
}

void run_start_threads(int count)
{
    static bool ends = false;
    end_threads();
#ifdef _OPENMP /* make OPENMP=1, for comparison: the library's loops are OpenMP's */
    if (count > 0) {
        omp_set_num_threads(count);
    }
    threads_use(NULL, NULL, omp_get_max_threads());
#else
    pool = springls_threads_create(count);
    threads_use(run_tasks().parallel_for, pool, springls_threads_count(pool));
#endif
    ends = ends || atexit(end_threads) == 0;
}

int run_options(const char *program, const struct cli_common *common, const char *set, springls_params *params)
{
    *params = strcmp(common->params, "paper") == 0 ? springls_paper_params() : springls_default_params();
    const int status = run_set_members(program, set, params);
    if (status != CLI_CONTINUE) {
        return status;
    }
    run_start_threads(common->threads);
    /* Before the run, so that a mistake is found early; the folder first, since the report may go into it. */
    const int has_folder = common->out ? run_make_folder(program, common->out) : CLI_CONTINUE;
    const bool to_file = common->json && strcmp(common->json, "-") != 0;
    return has_folder == CLI_CONTINUE && to_file ? run_check_output(program, common->json) : has_folder;
}

const char *run_path(const char *folder, const char *name, char *path, size_t size)
{
    snprintf(path, size, "%s/%s", folder, name);
    return path;
}

static void warn(void *user, int level, const char *message)
{
    if (level < 3) {
        cli_fail(user, 0, "%s", message);
    }
}

bool run_cache_folder(char *path, size_t size)
{
    static const char *const users[][2] = {{"XDG_CACHE_HOME", ""}, {"LOCALAPPDATA", ""}, {"HOME", "/.cache"}};
    const char *own = getenv("SPRINGLS_CACHE");
    if (own) {
        return *own && snprintf(path, size, "%s", own) < (int)size;
    }
    for (size_t i = 0; i < sizeof users / sizeof *users; ++i) {
        const char *user = getenv(users[i][0]);
        if (user && *user) {
            return snprintf(path, size, "%s%s/springls", user, users[i][1]) < (int)size;
        }
    }
    return false;
}

static int show_compilation(void *bar, float fraction)
{
    progress_update(bar, (size_t)(1000.0f * fraction), NULL);
    return 0;
}

/* Compiles all kernels, so that no step is timed with it. */
static bool prepare(springls_backend *backend, const char *program, bool quiet)
{
    struct progress bar;
    const springls_progress progress = {show_compilation, &bar};
    char label[100];
    snprintf(label, sizeof label, "%s: compile", program);
    progress_begin(&bar, label, 1000, quiet);
    const springls_status status = springls_cl_prepare(backend, &progress);
    progress_end(&bar);
    return status == SPRINGLS_OK;
}

springls_backend *run_backend(const char *program, const struct cli_common *common)
{
    return run_backend_with(program, common, NULL, NULL, 0);
}

springls_backend *run_backend_with(const char *program, const struct cli_common *common, springls_velocity_fn velocity,
                                   const char *velocity_source, size_t user_bytes)
{
    springls_cl_desc desc;
    springls_backend *backend = NULL;
    char folder[1024];
    if (strcmp(common->backend, "opencl") != 0) {
        return NULL;
    }
    memset(&desc, 0, sizeof desc);
    desc.timed = true;
    desc.tasks = run_tasks();
    desc.velocity = velocity;
    desc.velocity_source = velocity_source;
    desc.velocity_user_bytes = user_bytes;
    desc.logger.log = warn;
    desc.logger.user = (void *)(uintptr_t)program;
    desc.cache.folder = run_cache_folder(folder, sizeof folder) && make_folders(folder, 0700) ? folder : NULL;
    if (springls_cl_create(&desc, &backend) == SPRINGLS_OK && !prepare(backend, program, common->quiet)) {
        springls_cl_destroy(backend);
        backend = NULL;
    }
    return backend;
}

const char *run_backend_name(const springls_backend *backend)
{
    return backend ? springls_cl_name(backend) : "scalar";
}

static void keep_message(void *user, int level, const char *message)
{
    (void)level;
    snprintf(user, 256, "%s", message);
}

/* Returns the wall clock in seconds. */
static double run_clock(void *user)
{
    (void)user;
    return elapsed_seconds();
}

int run_create(const char *program, springls_desc *desc, springls_context **ctx)
{
    char message[256] = "no reason given";
    desc->trace.now = desc->trace.now ? desc->trace.now : run_clock;
    desc->tasks = run_tasks();
    springls_desc noting = *desc;
    noting.logger.log = keep_message;
    noting.logger.user = message;
    springls_status status = springls_create(&noting, ctx);
    if (status == SPRINGLS_OK) { /* create it again with the caller's logger, because this one is local */
        springls_destroy(*ctx);
        status = springls_create(desc, ctx);
    }
    if (status != SPRINGLS_OK) {
        const bool usage = status == SPRINGLS_INVALID_ARGUMENT;
        return cli_fail(program, usage ? CLI_EXIT_USAGE : CLI_EXIT_FAILURE, "%s%s", usage ? "parameter or grid: " : "", message);
    }
    return CLI_CONTINUE;
}

bool run_check(const char *program, const springls_context *ctx, springls_status status, const char *doing)
{
    const char *why = status == SPRINGLS_OK ? "" : springls_last_error(ctx);
    if (status == SPRINGLS_OK) {
        return true;
    }
    cli_fail(program, CLI_EXIT_FAILURE, "%s: %s", doing,
             status == SPRINGLS_EMPTY_MODEL ? "no surface inside the image" : why[0] ? why : springls_status_string(status));
    return false;
}
