/* volume_nifti.h - private to volume*.c: reads a NIfTI header into a checked nifti_image. */
#ifndef EXAMPLES_IMAGING_VOLUME_NIFTI_H
#define EXAMPLES_IMAGING_VOLUME_NIFTI_H

#include "imaging/volume_format.h"

/* Needs -I with Debian's folder /usr/include/nifti, which also contains the znzlib.h that this header includes. */
#include <nifti2_io.h>
#include <zlib.h>

enum volume_sample volume_nifti_sample(int datatype); /* SAMPLE_NONE: not a single real number */

/* Reads and checks the header at the start of `file`. `single` = data in the same file. Returns NULL with the reason in
 * `error`. */
nifti_image *volume_header_read(gzFile file, struct volume *volume, bool *single, char error[VOLUME_TEXT]);

/* Fills affine, spacing, origin and direction. */
bool volume_header_geometry(const nifti_image *header, struct volume *volume, char error[VOLUME_TEXT]);

#endif
