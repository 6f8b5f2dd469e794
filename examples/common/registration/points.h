/* points.h - landmarks from text files. */
#ifndef EXAMPLES_REGISTRATION_POINTS_H
#define EXAMPLES_REGISTRATION_POINTS_H

#include "imaging/volume.h"

/* Reads elastix's point sets: the word "index" (voxels of the image) or "point" (mm, LPS+), the number of points, then three
 * numbers each. image: the grid of indices. *points: 3 floats each, mm, RAS+, to be freed. Returns false with the reason in
 * `error`. */
bool points_read(const char *path, const struct volume *image, float **points, size_t *count, char error[VOLUME_TEXT]);

/* Writes points (mm, RAS+, 3 floats each) as elastix's text file of "point" (mm, LPS+). Returns false, and leaves no file, with the
 * reason in `error`. */
bool points_write(const char *path, const float *points, size_t count, char error[VOLUME_TEXT]);

/* Reads comma-separated values with a line of column names, of which landmark, frame, x_mm, y_mm, z_mm (RAS+) are used: the
 * same landmarks, numbered from 0, in every frame from 0. *points: 3 floats each, landmarks of frame 0 first. */
bool points_read_frames(const char *path, float **points, size_t *landmarks, size_t *frames, char error[VOLUME_TEXT]);

#endif
