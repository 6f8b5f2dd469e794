/* scene_read.h - files of meshes and characters, read by assimp: what it trusts is checked before, since it ends the program, or
 * goes on for ever, where that does not hold. */
#ifndef EXAMPLES_SURFACE_SCENE_READ_H
#define EXAMPLES_SURFACE_SCENE_READ_H

#include <stdbool.h>

struct aiScene;

enum { SCENE_TEXT = 320 };

/* Reads a file, its polygons as triangles, without points and lines. steps: more of assimp's (aiProcess_...). Returns what
 * aiReleaseImport frees, or NULL with one line in `error`: it cannot be opened, is empty, its header promises more than it can
 * contain or does not end, a face has no corners or names a vertex that there is not. */
const struct aiScene *scene_read(const char *path, unsigned steps, char error[SCENE_TEXT]);

/* Writes the end of the path and a reason, as one line; returns false. */
bool scene_fail(char error[SCENE_TEXT], const char *path, const char *format, ...);

/* Returns the whole number that a word is, -1 unless it is 1 to 15 digits alone. assimp stops at the first other character: it takes
 * 300000000e-8, which strtod reads as 3, for 300 million. */
double scene_whole_number(const char *word);

#endif
