/* same_file.h - whether two paths lead to one file, which may not be there yet. */
#ifndef EXAMPLES_BASE_SAME_FILE_H
#define EXAMPLES_BASE_SAME_FILE_H

#include <stdbool.h>

/* Returns whether there is a regular file. */
bool file_exists(const char *path);

/* Returns whether both paths lead to one regular file. Where neither is there, their folders and names are compared. */
bool same_file(const char *a, const char *b);

/* Returns whether the path leads into the folder, to a file whose name there fits one of the patterns "labels.*|mode*.ply|points/?*",
 * of fnmatch but for their folders. */
bool file_fits(const char *path, const char *folder, const char *patterns);

#endif
