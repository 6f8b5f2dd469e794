/* volume.h - three-dimensional images in and out: NIfTI-1 and -2, NRRD, MetaImage; folders of DICOM files in, where GDCM was found.
 *
 * The format is found by the first bytes of the file: .nii, .nii.gz and .hdr + .img (either gzip-compressed); .nrrd and .nhdr
 * + data (through teem, all its encodings); .mha and .mhd + data (raw or zlib-compressed). Both byte orders, all integer and
 * real data types. Dimensions beside the three axes of space, such as time or the components of a vector, count as frames.
 *
 * World coordinates are millimetres in RAS+ axes (x right, y anterior, z superior), as NIfTI defines them; the LPS axes of
 * NRRD and MetaImage and other units are converted. NIfTI's orientation is the sform when its code is above 0, else the qform
 * when its code is above 0, else the pixel sizes alone. A NRRD without a named space counts as LPS, as in ITK.
 *
 * Sizes in a file are checked against its length before memory is allocated; a bad file gives one line of text, and the
 * libraries print nothing themselves. Voxels whose sides differ by more than a factor of 100 are refused: the programs resample to
 * cubes, which would be far too many or far too coarse. */
#ifndef EXAMPLES_IMAGING_VOLUME_H
#define EXAMPLES_IMAGING_VOLUME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { VOLUME_TEXT = 320 }; /* size of error and warning buffers */

struct volume {
    int dims[3];           /* voxel (i,j,k) is data[i + dims[0] * (j + dims[1] * k)] */
    float spacing[3];      /* mm between neighbours along i, j, k: column lengths of the affine */
    float origin[3];       /* world place of voxel (0,0,0) */
    float direction[3][3]; /* column c = direction of voxel axis c, length 1 (not always orthogonal: sheared files) */
    double affine[4][4];   /* voxel index -> world mm, RAS+ */
    float *data;           /* scaled by the file's slope and intercept; above 2^24 not every whole number */
    uint32_t *ids;         /* the same of a label map, exact; NULL: not read as one, or not whole numbers from 0 to 2^32 - 1 */
    float minimum, maximum;
    size_t replaced; /* voxels that were NaN or infinite: now `minimum` */
    int frame, frame_count;
    int dimension;         /* of the file: its last axis longer than 1, at least 3 */
    char warning[VOLUME_TEXT]; /* about the file, by "; "; empty if there is none */
    const char *extension;  /* of the format read, for writing in the same one: ".nii.gz", ".nrrd", ".mha"; else NULL */
    bool wants_ids;         /* of the reader: ids are read, and all values so far are such */
    void *header;           /* a NIfTI file's header, for writing in the same geometry; else NULL */
};

static inline size_t volume_voxels(const struct volume *v)
{
    return (size_t)v->dims[0] * (size_t)v->dims[1] * (size_t)v->dims[2];
}

/* Computes the voxel coordinates of data[n]. */
static inline void volume_place(const int dims[3], size_t n, int place[3])
{
    place[0] = (int)(n % (size_t)dims[0]);
    place[1] = (int)(n / (size_t)dims[0] % (size_t)dims[1]);
    place[2] = (int)(n / ((size_t)dims[0] * (size_t)dims[1]));
}

/* Reads frame `frame` (0 for a 3-D file). On failure returns false, leaves an empty volume and puts the reason in `error`. */
bool volume_read(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);

/* Chooses the series of a folder of DICOM files for what is read from now on, by number, description or UID (NULL: the only one), and the
 * option that errors name to choose by (NULL: none). The texts stay the caller's, and have to stay there. */
void volume_choose_series(const char *series, const char *option);
/* Returns true if such folders can be read: GDCM was found when this was compiled. */
bool volume_has_dicom(void);

/* Reads as volume_read_one does, but voxels that are NaN or infinite stay, as NaN: places without data. */
bool volume_read_gaps(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT]);

/* Reads as volume_read_one does, with ids. A file that has none is refused. */
bool volume_read_labels(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT]);

/* Returns true if the image looks like a label map: few whole numbers, of which nearly all neighbours are equal. */
bool volume_is_label_map(const struct volume *volume);

/* Returns true if the image can be a label map; else false, with the reason in `error`: a scan given in its place. */
bool volume_check_labels(const struct volume *volume, const char *path, char error[VOLUME_TEXT]);

/* Reads frame `frame`. -1: the file's only image; several are an error, which names `option` (NULL: none) to choose by. */
bool volume_read_one(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT]);

/* Reads a file that belongs to frame `frame` of an image (-1: to its only one), such as a label map: the file's only image, or the
 * same frame of several; with ids, where it has any. */
bool volume_read_companion(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);
/* Does the same on the grid of `like`, which messages call `name`. A file whose voxels are those of `like` to a tenth of a voxel, or the
 * same in another order, is resampled by nearest neighbours, with a warning; another one is refused with what differs. */
bool volume_read_like(const struct volume *like, const char *name, const char *path, int frame, struct volume *volume,
                      char error[VOLUME_TEXT]);

/* Prints the warning of an image, if it has one, on stderr, behind the image's name (NULL: none). */
void volume_print_warning(const struct volume *image, const char *program, const char *name);
/* Returns the warning for a report; NULL: none. */
const char *volume_warning(const struct volume *image);

/* Makes a zero-filled volume with the axes of the world. */
bool volume_create(const int dims[3], const float spacing[3], const float origin[3], struct volume *volume);

/* Make zero-filled volumes over the box of another one (which ends half a voxel beyond its outermost centers), along its axes.
 * padded: the same voxels and `margin` more on every side. cubes: voxels with sides of `side` mm and `margin` more. */
bool volume_create_padded(const struct volume *like, int margin, struct volume *volume);
bool volume_create_cubes(const struct volume *like, float side, int margin, struct volume *volume);
void volume_free(struct volume *volume);

/* Returns true if the two lie on the same voxel grid: equal sizes, affines within a thousandth of a voxel. */
bool volume_same_grid(const struct volume *a, const struct volume *b);

void volume_index_to_world(const struct volume *volume, const float index[3], float world[3]);
void volume_world_to_index(const struct volume *volume, const float world[3], float index[3]);

/* Applies a map between two worlds, the rows of a 3x4 matrix. y may be x. */
void volume_apply(const double map[3][4], const float x[3], float y[3]);

enum volume_type { VOLUME_UINT8, VOLUME_INT16, VOLUME_FLOAT32, VOLUME_UINT32 };

/* Writes `data` (of the given type, volume_voxels(like) items) in the geometry of `like`. The name selects the format: .nrrd
 * and .mha, compressed; else NIfTI, compressed if the name ends in .gz: NIfTI-1, or NIfTI-2 when `like` was read from one or a
 * side is longer than 32767. A failed write leaves no file. */
bool volume_write(const char *path, const struct volume *like, enum volume_type type, const void *data,
                  char error[VOLUME_TEXT]);
/* Writes labels so, in 16 bits where all are below 32768, else in 32. */
bool volume_write_labels(const char *path, const struct volume *like, const uint32_t *labels, char error[VOLUME_TEXT]);
/* Puts into `error` that a file cannot be written, with the reason in errno; always returns false. */
bool volume_write_error(char error[VOLUME_TEXT], const char *path);

#endif
