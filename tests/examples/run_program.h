/* run_program.h - runs a program's main in a test; what it prints goes into files of the scratch folder. Wants _POSIX_C_SOURCE. */
#ifndef RUN_PROGRAM_H
#define RUN_PROGRAM_H

#include "scratch.h"

#include <stdint.h>
#include <unistd.h>

/* Returns the program's status. `arguments` and `more` end with NULL; more: behind them, may be NULL. */
SHARED int run_program(int (*program)(int, char **), const char *const *arguments, const char *const *more)
{
    const char *all[24];
    int count = 0;
    while (*arguments) all[count++] = *arguments++;
    while (more && *more) all[count++] = *more++;
    fflush(NULL);
    const int keep_error = dup(STDERR_FILENO), keep_output = dup(STDOUT_FILENO);
    if (!freopen(scratch("stderr"), "w", stderr) || !freopen(scratch("stdout"), "w", stdout)) return -99;
    const int status = program(count, (char **)(uintptr_t)all);
    fflush(NULL);
    dup2(keep_error, STDERR_FILENO);
    dup2(keep_output, STDOUT_FILENO);
    close(keep_error);
    close(keep_output);
    return status;
}

/* Returns what the last run has printed: "stdout" or "stderr". */
SHARED const char *printed(const char *name)
{
    static char text[2048];
    FILE *file = fopen(scratch(name), "r");
    const size_t length = file ? fread(text, 1, sizeof text - 1, file) : 0;
    if (file) fclose(file);
    text[length] = '\0';
    return text;
}

#endif
