/* fly.h - a flight over a world of bodies, whose chunks are drawn at levels of detail. */
#ifndef EXAMPLES_VIEWER_FLY_H
#define EXAMPLES_VIEWER_FLY_H

#include "springls.h"

/* Flies in so many frames, in a window of width * height; or without one, where `picture` names a PNG file for the frame after a third of
 * them. Each level has its color. Writes one JSON object into `json` (NULL: standard output): milliseconds of a frame, what it draws, and
 * how much of it is beyond half a pixel. Returns the exit status. */
int viewer_fly(const springls_desc *desc, int frames, int width, int height, const char *picture, const char *json);

#endif
