/* gltf_problems.h - judges binary glTF files by gltf_check.py, which runs Khronos' validator too where it is installed. */
#ifndef GLTF_PROBLEMS_H
#define GLTF_PROBLEMS_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>

static int gltf_run(const char *command)
{
    fflush(stdout);
    const int status = system(command), code = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    return code == 0 ? 0 : code == 77 || code == 127 ? -1 : 1;
}

/* Prints the problems of a file. Returns 0: none, 1: some, -1: there is no Python with numpy. */
static int gltf_problems(const char *path)
{
    char command[1200];
    snprintf(command, sizeof command, "/usr/bin/python3 tests/examples/gltf_check.py '%s'", path);
    return gltf_run(command);
}

/* Returns whether every judge has looked at the files. */
static inline bool gltf_judges_are_here(void)
{
    return gltf_run("/usr/bin/python3 tests/examples/gltf_check.py") == 0;
}

#endif
