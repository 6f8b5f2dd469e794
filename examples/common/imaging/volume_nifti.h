/* volume_nifti.h - private to volume*.c: from the bytes of a NIfTI header to a checked nifti_image. */
#ifndef EXAMPLES_IMAGING_VOLUME_NIFTI_H
#define EXAMPLES_IMAGING_VOLUME_NIFTI_H

#include "imaging/volume_format.h"

/* Debian keeps it in /usr/include/nifti, together with the znzlib.h that it asks for: compile with that folder as -I. */
#include <nifti2_io.h>
#include <zlib.h>

enum volume_sample volume_nifti_sample(int datatype); /* SAMPLE_NONE: not one real number */

/* Reads and checks the header at the start of `file`. `single` = data in the same file. NULL: see `error`. */
nifti_image *volume_header_read(gzFile file, struct volume *volume, bool *single, char error[VOLUME_TEXT]);

/* Fills affine, spacing, origin and direction. */
bool volume_header_geometry(const nifti_image *header, struct volume *volume, char error[VOLUME_TEXT]);

#endif
