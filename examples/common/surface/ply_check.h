/* ply_check.h - whether a PLY file contains what its header promises; assimp reserves memory for any count, and reads beyond the end of
 * an incomplete file. */
#ifndef EXAMPLES_SURFACE_PLY_CHECK_H
#define EXAMPLES_SURFACE_PLY_CHECK_H

#include "surface/scene.h"

#include <stdio.h>

/* Reads the header and all elements. file: at its start; size: its bytes. Returns false with one line in `error`. */
bool ply_check(FILE *file, const char *path, long size, char error[SCENE_TEXT]);

/* Returns where the elements of a binary file begin, which ply_check has found to be good; 0: an ASCII file, or no PLY file. file: at its
 * start. */
long ply_binary_elements(FILE *file);

/* Returns the whole number that a word is, -1 unless it is 1 to 15 digits alone. assimp stops at the first other character: it takes
 * 300000000e-8, which strtod reads as 3, for 300 million. */
double ply_whole_number(const char *word);

#endif
