/* run_options.h - from the command line to what springls_create wants: parameters, threads, output folder. */
#ifndef EXAMPLES_SPRINGLS_RUN_OPTIONS_H
#define EXAMPLES_SPRINGLS_RUN_OPTIONS_H

#include "base/cli.h"
#include "springls_cl.h"

#include <stddef.h>

/* Help text of the option --set of every program that passes it on to run_options. */
#define RUN_OPTIONS_SET_HELP "change parameters: name=value[,name=value...], names as in springls_params"

/* The set named by --params, then the members named by `set` ("name=value,name=value"; NULL = none). Also sets the number
 * of threads and makes the folder of --out. CLI_CONTINUE, or the exit status after one line on stderr. */
int run_options(const char *program, const struct cli_common *common, const char *set, springls_params *params);

/* The name of the member of springls_params at this offset, or a phrase: --set does not know it. */
const char *run_member_at(size_t offset);

int run_threads(void); /* threads that parallel loops use now */

/* "folder/name", cut to `size` - 1 characters. */
const char *run_path(const char *folder, const char *name, char *path, size_t size);

/* Where --backend wants the stages to run: NULL for scalar code, or when there is no OpenCL, of which one line on stderr warns.
 * springls_cl_destroy it after the contexts. */
springls_backend *run_backend(const char *program, const struct cli_common *common);

/* What reports call it: "scalar", or the name of the device. */
const char *run_backend_name(const springls_backend *backend);

/* True when `status` is good; else one line on stderr, which begins with program and `doing`. */
bool run_check(const char *program, const springls_context *ctx, springls_status status, const char *doing);

/* springls_create, with its reason for a refusal on stderr: CLI_CONTINUE, or the exit status. Timed by the wall clock. */
int run_create(const char *program, springls_desc *desc, springls_context **ctx);

#endif
