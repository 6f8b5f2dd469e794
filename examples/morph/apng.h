/* apng.h - animated PNG (APNG), which browsers and most viewers play; others show the first frame. */
#ifndef EXAMPLES_MORPH_APNG_H
#define EXAMPLES_MORPH_APNG_H

#include "pictures/image.h"

/* Writes frames of one size, each shown for 1/fps seconds, in an endless loop. */
bool apng_write(const char *path, const struct image *frames, int count, int fps);

#endif
