/* volume_header.h - private to volume*.c: from the bytes of a NIfTI header to a checked nifti_image. */
#ifndef EXAMPLES_COMMON_VOLUME_HEADER_H
#define EXAMPLES_COMMON_VOLUME_HEADER_H

#include "volume.h"

/* Debian keeps it in /usr/include/nifti, together with the znzlib.h that it asks for: compile with that folder as -I. */
#include <nifti2_io.h>
#include <zlib.h>

/* Prints into an error buffer; always false, so that callers can return it. */
bool volume_error(char error[VOLUME_TEXT], const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void volume_note(struct volume *volume, const char *text);

/* Reads and checks the header at the start of `file`. `single` = data in the same file. NULL: see `error`. */
nifti_image *volume_header_read(gzFile file, struct volume *volume, bool *single, char error[VOLUME_TEXT]);

/* Fills affine, spacing, origin and direction. */
bool volume_header_geometry(const nifti_image *header, struct volume *volume, char error[VOLUME_TEXT]);

/* From volume->affine: spacing, origin, direction. False if the affine cannot be inverted. */
bool volume_set_geometry(struct volume *volume);

#endif
