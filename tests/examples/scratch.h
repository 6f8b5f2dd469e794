/* scratch.h - files that a test writes: names in a folder that its main makes and removes. */
#ifndef SCRATCH_H
#define SCRATCH_H

#include <stdio.h>

static char folder[256];

/* Returns the path of a file in the folder; it lasts for seven more calls. */
static const char *scratch(const char *name)
{
    static char paths[8][512];
    static int next;
    char *path = paths[next++ % 8];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

#endif
