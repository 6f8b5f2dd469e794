/* run_options.h - from the command line to the arguments of springls_create: parameters, threads, output folder. */
#ifndef EXAMPLES_SPRINGLS_RUN_OPTIONS_H
#define EXAMPLES_SPRINGLS_RUN_OPTIONS_H

#include "base/cli.h"
#include "springls_cl.h"

#include <stddef.h>
#include <stdint.h>

/* Help text of the option --set, for every program that passes it to run_options. */
#define RUN_OPTIONS_SET_HELP "change parameters: name=value[,name=value...], names as in springls_params"

/* Sets params to the set named by --params, then the members in `set` ("name=value,name=value"; NULL = none). Also starts
 * the threads, makes the folder of --out, and refuses what --out and --json cannot write. Returns CLI_CONTINUE, or the exit
 * status after one line on stderr. */
int run_options(const char *program, const struct cli_common *common, const char *set, springls_params *params);

/* Sets the members of params in `set` alone, as run_options does. Returns CLI_CONTINUE, or the exit status after one line on
 * stderr. */
int run_set_members(const char *program, const char *set, springls_params *params);

/* Returns the name of the member of springls_params at this offset, or a phrase for one that --set cannot set. */
const char *run_member_at(size_t offset);

/* Returns a hash of the names and values of all members that are not 0: a member that is added and stays off changes nothing. */
uint32_t run_params_hash(const springls_params *params);

/* Makes the threads of base/threads.h a pool of so many, in place of the one before; 0: one a processor. No model that has the one
 * before may be used again. */
void run_start_threads(int count);

/* Returns these threads for springls_desc.tasks. */
springls_tasks run_tasks(void);

/* Makes a folder and those that it lies in, as far as they are missing. Returns CLI_CONTINUE, or the exit status after one line
 * on stderr. */
int run_make_folder(const char *program, const char *path);

/* Checks, before the work, that a file can be written or replaced; makes none. Returns CLI_CONTINUE, or the exit status after one
 * line on stderr. */
int run_check_output(const char *program, const char *path);

/* Builds "folder/name", cut to `size` - 1 characters. */
const char *run_path(const char *folder, const char *name, char *path, size_t size);

/* Builds the name of the folder where compiled OpenCL kernels are kept between runs: that of SPRINGLS_CACHE, or springls in the user's
 * folder for such files. Returns false when there is none, as with an empty SPRINGLS_CACHE, or when
 * the name does not fit. */
bool run_cache_folder(char *path, size_t size);

/* Makes the backend of --backend, with all kernels compiled: NULL for scalar code, or after a warning on stderr if there is no OpenCL.
 * Pass it to springls_cl_destroy after its contexts are destroyed. */
springls_backend *run_backend(const char *program, const struct cli_common *common);

/* Does so with the text in OpenCL C of a velocity callback, and how many bytes of its `user` that reads (springls_cl_desc). */
springls_backend *run_backend_with(const char *program, const struct cli_common *common, springls_velocity_fn velocity,
                                   const char *velocity_source, size_t user_bytes);

/* Returns the name for reports: "scalar", or the name of the device. */
const char *run_backend_name(const springls_backend *backend);

/* Returns true when `status` is good; else prints one line on stderr that begins with program and `doing`. */
bool run_check(const char *program, const springls_context *ctx, springls_status status, const char *doing);

/* Calls springls_create, with the threads of the program, and wall-clock timing unless desc->trace has a clock. Prints the reason of
 * a failure on stderr. Returns CLI_CONTINUE, or the exit status. */
int run_create(const char *program, springls_desc *desc, springls_context **ctx);

#endif
