/* apng.h - an animated picture: PNG with several frames (APNG), which browsers and most viewers play; others show the first. */
#ifndef EXAMPLES_MORPH_APNG_H
#define EXAMPLES_MORPH_APNG_H

#include "pictures/image.h"

/* All frames of one size; each is shown for 1/fps seconds, and all again without end. */
bool apng_write(const char *path, const struct image *frames, int count, int fps);

#endif
