/* volume_format.h - private to volume*.c: declarations shared by the readers and writers of the file formats. */
#ifndef EXAMPLES_IMAGING_VOLUME_FORMAT_H
#define EXAMPLES_IMAGING_VOLUME_FORMAT_H

#include "imaging/volume.h"

#include <stdint.h>
#include <stdio.h>
#include <zlib.h>

/* Read one frame: affine, data, minimum, maximum, frame_count; values that are not finite are kept. */
bool volume_read_nifti(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);
bool volume_read_nrrd(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);
bool volume_read_meta(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);

/* Reads the series that was chosen, or the only one, of a folder of DICOM files (frame 0). */
bool volume_read_dicom(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);
/* Returns the option by which a series was chosen; NULL: none was. */
const char *volume_series_is_chosen(void);
/* Looks whether a file is DICOM ("DICM" at byte 128), and shorter than its elements say, or empty. */
enum volume_dicom { NO_DICOM, DICOM_CUT, DICOM_WHOLE };
enum volume_dicom volume_look_at_dicom(const char *path);

bool volume_write_nifti(const char *path, const struct volume *like, enum volume_type type, const void *data,
                        char error[VOLUME_TEXT]);
bool volume_write_nrrd(const char *path, const struct volume *like, enum volume_type type, const void *data,
                       char error[VOLUME_TEXT]);
bool volume_write_meta(const char *path, const struct volume *like, enum volume_type type, const void *data,
                       char error[VOLUME_TEXT]);

/* Prints into an error buffer; always returns false, so that callers can return it. */
bool volume_error(char error[VOLUME_TEXT], const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 2, 3)))
#endif
    ;
void volume_add_warning(struct volume *volume, const char *text);

bool volume_ends_with(const char *text, const char *ending);
int64_t volume_file_size(const char *path); /* -1: missing, or not a plain file */
/* Builds the path of "name" beside the file `path`, unless it begins with a slash. Returns false if it is longer than `size` -
 * 1. */
bool volume_beside(const char *path, const char *name, char *result, size_t size);

/* Sets dims from the sizes of space and frame_count from all others (time, channels). Returns false when they are implausibly
 * large or there is no such frame. */
bool volume_set_sizes(struct volume *volume, const int64_t *sizes, int space, int all, int frame, char error[VOLUME_TEXT]);

/* Derives spacing, origin and direction from volume->affine. Returns false if the affine cannot be inverted. */
bool volume_set_geometry(struct volume *volume);
/* Converts from or to axes that point to the left and to the back (DICOM's), which ITK's formats use. */
void volume_flip_to_ras(double affine[4][4]);

/* Allocates the voxels. */
bool volume_allocate(struct volume *volume, char error[VOLUME_TEXT]);
void volume_store(struct volume *volume, size_t voxel, double value);

/* Types of numbers in files. */
enum volume_sample { SAMPLE_INT8, SAMPLE_UINT8, SAMPLE_INT16, SAMPLE_UINT16, SAMPLE_INT32, SAMPLE_UINT32, SAMPLE_INT64,
                     SAMPLE_UINT64, SAMPLE_FLOAT32, SAMPLE_FLOAT64, SAMPLE_NONE };
size_t volume_sample_size(enum volume_sample type);
double volume_sample(const unsigned char *bytes, enum volume_sample type, bool swapped);
size_t volume_type_size(enum volume_type type);

/* A stream of the bytes of an open file from its present position, unpacked if they are one zlib or gzip stream. */
struct volume_stream {
    FILE *file;
    bool compressed, ended; /* ended: the last byte has been read and its checksum is right */
    z_stream z;
    unsigned char input[16384];
};
bool volume_stream_open(struct volume_stream *stream, FILE *file, bool compressed);
size_t volume_stream_read(struct volume_stream *stream, unsigned char *bytes, size_t count); /* returns less at the end */
void volume_stream_close(struct volume_stream *stream); /* the file stays open */

#endif
