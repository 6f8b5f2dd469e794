/* same_file.h - whether two paths lead to one file, which may not be there yet. */
#ifndef EXAMPLES_BASE_SAME_FILE_H
#define EXAMPLES_BASE_SAME_FILE_H

#include <stdbool.h>
#include <stddef.h>

/* Returns whether there is a regular file. */
bool file_exists(const char *path);

/* Returns whether both paths lead to one regular file. Where neither is there, the places are compared where they would be made. */
bool same_file(const char *a, const char *b);

/* Returns whether a file in the folder whose name fits one of the patterns "labels.*|mode*.ply|points/?*" is the file at the path, by
 * its place or by a link. Names are matched as by fnmatch; folders are taken as they are written. */
bool file_fits(const char *path, const char *folder, const char *patterns);

/* Returns whether in the folder there is a folder whose name fits one of the patterns; path: the last one looked at. */
bool folder_fits(const char *folder, const char *patterns, char *path, size_t size);

#endif
