/* scene_files.h - files that the file of a scene names: images, buffers. */
#ifndef EXAMPLES_SURFACE_SCENE_FILES_H
#define EXAMPLES_SURFACE_SCENE_FILES_H

#include "surface/material.h"

#include <stddef.h>

/* Reads a file into memory, to be freed; NULL: it cannot be read, is empty or larger than 2 GB. */
unsigned char *scene_read_file(const char *path, size_t *size);

/* Reads a file that lies beside the one at `path`, by its name as it is or with %20 and the like replaced. */
unsigned char *scene_read_beside(const char *path, const char *name, size_t *size);

/* Decodes a picture's image, which takes the bytes over; frees them, and returns false, where that is not possible. */
bool scene_take_picture(struct picture *picture, unsigned char *bytes, size_t size);

#endif
