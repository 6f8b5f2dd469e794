/* ply_check.h - whether a PLY file has what its header promises: assimp reserves memory for any count, and reads beyond the end of what
 * is not whole. */
#ifndef EXAMPLES_SURFACE_PLY_CHECK_H
#define EXAMPLES_SURFACE_PLY_CHECK_H

#include "surface/scene_read.h"

#include <stdio.h>

/* Walks through the header and all elements of a file, which stands at its start. Returns false with one line in `error`. */
bool ply_check(FILE *file, const char *path, long size, char error[SCENE_TEXT]);

#endif
