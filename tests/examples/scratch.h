/* scratch.h - files that a test writes: names in a folder that its main makes and removes. */
#ifndef SCRATCH_H
#define SCRATCH_H

#include <stdio.h>
#include <stdlib.h>

#define SHARED __attribute__((unused)) static /* of a header: not every program uses all of it */

static char folder[256];

/* Makes the folder, in TMPDIR or /tmp; returns 0 after one line on stderr where it cannot. */
SHARED int make_folder(void)
{
    const char *temporary = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/springls_test_XXXXXX", temporary && *temporary ? temporary : "/tmp");
    if (mkdtemp(folder)) return 1;
    perror(folder);
    return 0;
}

/* Removes the folder with what is in it; returns 0 where it cannot. */
SHARED int remove_folder(void)
{
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command) == 0;
}

/* Returns the path of a file in the folder; it lasts for seven more calls. */
SHARED const char *scratch(const char *name)
{
    static char paths[8][512];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

#endif
