/* volume_nifti_header.c - reads the bytes of a NIfTI header into a checked nifti_image. */
#include "imaging/volume_nifti.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum volume_sample volume_nifti_sample(int datatype)
{
    switch (datatype) {
    case DT_UINT8: return SAMPLE_UINT8;
    case DT_INT8: return SAMPLE_INT8;
    case DT_INT16: return SAMPLE_INT16;
    case DT_UINT16: return SAMPLE_UINT16;
    case DT_INT32: return SAMPLE_INT32;
    case DT_UINT32: return SAMPLE_UINT32;
    case DT_INT64: return SAMPLE_INT64;
    case DT_UINT64: return SAMPLE_UINT64;
    case DT_FLOAT32: return SAMPLE_FLOAT32;
    case DT_FLOAT64: return SAMPLE_FLOAT64;
    default: return SAMPLE_NONE;
    }
}

static const char *type_problem(int datatype)
{
    if (volume_nifti_sample(datatype) != SAMPLE_NONE) {
        return NULL;
    }
    switch (datatype) {
    case DT_RGB24:
    case DT_RGBA32:
        return "colour voxels";
    case DT_COMPLEX64:
    case DT_COMPLEX128:
    case DT_COMPLEX256:
        return "complex voxels";
    case DT_BINARY:
        return "one-bit voxels";
    case DT_FLOAT128:
        return "128-bit reals";
    default:
        return "an unknown data type";
    }
}

/* The fields that determine memory and file offsets, the same for both versions, in this machine's byte order. */
struct essentials {
    int64_t dim[8];
    int datatype, bitpix;
    double offset, slope, intercept;
    int header_size;
};

static bool check(const struct essentials *e, bool single, struct volume *volume, char error[VOLUME_TEXT])
{
    struct volume sizes;
    if (e->dim[0] < 1 || e->dim[0] > 7) {
        return volume_error(error, "bad header: number of dimensions is %lld", (long long)e->dim[0]);
    }
    const int all = (int)e->dim[0];
    if (!volume_set_sizes(&sizes, e->dim + 1, all < 3 ? all : 3, all, 0, error)) {
        return false;
    }
    const char *problem = type_problem(e->datatype);
    if (problem) {
        return volume_error(error, "cannot use %s (datatype %d)", problem, e->datatype);
    }
    if (e->bitpix != 8 * (int)volume_sample_size(volume_nifti_sample(e->datatype))) {
        volume_add_warning(volume, "header names a wrong number of bits a voxel, the data type is believed");
    }
    if (!isfinite(e->offset) || e->offset < 0.0 || e->offset > 1e15
        || (single && e->offset > 0.0 && e->offset < e->header_size)) {
        return volume_error(error, "bad header: data offset %g", e->offset);
    }
    if (!isfinite(e->slope) || !isfinite(e->intercept)) {
        volume_add_warning(volume, "slope or intercept is not finite: voxel values are not scaled");
    }
    return true;
}

static nifti_image *read_version_1(const unsigned char *bytes, bool *single, struct volume *volume,
                                   char error[VOLUME_TEXT])
{
    nifti_1_header h;
    struct essentials e;
    memcpy(&h, bytes, sizeof h);
    if (memcmp(h.magic, "n+1", 4) != 0 && memcmp(h.magic, "ni1", 4) != 0) {
        const bool blank = h.magic[0] == '\0';
        volume_error(error, blank ? "an ANALYZE 7.5 header, which stores no orientation: convert it to NIfTI"
                                  : "bad header: no NIfTI magic");
        return NULL;
    }
    *single = h.magic[1] == '+';
    const bool swapped = h.sizeof_hdr != (int)sizeof h;
    if (swapped) {
        nifti_swap_as_nifti1(&h);
    }
    for (int i = 0; i < 8; ++i) {
        e.dim[i] = h.dim[i];
    }
    e.datatype = h.datatype;
    e.bitpix = h.bitpix;
    e.offset = (double)h.vox_offset;
    e.slope = (double)h.scl_slope;
    e.intercept = (double)h.scl_inter;
    e.header_size = (int)sizeof h;
    if (!check(&e, *single, volume, error)) {
        return NULL;
    }
    for (int i = 1; i < 8; ++i) { /* the library requires a positive size in unused dimensions */
        h.dim[i] = (short)(i <= h.dim[0] ? h.dim[i] : 1);
    }
    h.vox_offset = 0.0f; /* kept by the caller, because the library prints warnings about odd ones */
    nifti_image *header = nifti_convert_n1hdr2nim(h, NULL);
    if (header) {
        header->iname_offset = (int64_t)e.offset;
        header->swapsize = swapped ? header->swapsize : 0; /* the library saw a header in this machine's byte order */
    }
    return header;
}

static nifti_image *read_version_2(const unsigned char *bytes, bool *single, struct volume *volume,
                                   char error[VOLUME_TEXT])
{
    nifti_2_header h;
    struct essentials e;
    memcpy(&h, bytes, sizeof h);
    if (memcmp(h.magic, "n+2", 4) != 0 && memcmp(h.magic, "ni2", 4) != 0) {
        volume_error(error, "bad header: no NIfTI magic");
        return NULL;
    }
    *single = h.magic[1] == '+';
    const bool swapped = h.sizeof_hdr != (int)sizeof h;
    if (swapped) {
        nifti_swap_as_nifti2(&h);
    }
    for (int i = 0; i < 8; ++i) {
        e.dim[i] = h.dim[i];
    }
    e.datatype = h.datatype;
    e.bitpix = h.bitpix;
    e.offset = (double)h.vox_offset;
    e.slope = h.scl_slope;
    e.intercept = h.scl_inter;
    e.header_size = (int)sizeof h;
    if (!check(&e, *single, volume, error)) {
        return NULL;
    }
    for (int i = 1; i < 8; ++i) {
        h.dim[i] = i <= h.dim[0] ? h.dim[i] : 1;
    }
    h.vox_offset = 0;
    nifti_image *header = nifti_convert_n2hdr2nim(h, NULL);
    if (header) {
        header->iname_offset = (int64_t)e.offset;
        header->swapsize = swapped ? header->swapsize : 0; /* the library saw a header in this machine's byte order */
    }
    return header;
}

nifti_image *volume_header_read(gzFile file, struct volume *volume, bool *single, char error[VOLUME_TEXT])
{
    unsigned char bytes[sizeof(nifti_2_header)];
    nifti_image *header = NULL;
    nifti_set_debug_level(0);
    if (gzread(file, bytes, 4) != 4) {
        volume_error(error, "empty, or too short for a header");
        return NULL;
    }
    const unsigned little = bytes[0] | (unsigned)bytes[1] << 8 | (unsigned)bytes[2] << 16 | (unsigned)bytes[3] << 24;
    const unsigned big = bytes[3] | (unsigned)bytes[2] << 8 | (unsigned)bytes[1] << 16 | (unsigned)bytes[0] << 24;
    const unsigned size = little == sizeof(nifti_1_header) || little == sizeof(nifti_2_header) ? little : big;
    if (size != sizeof(nifti_1_header) && size != sizeof(nifti_2_header)) {
        volume_error(error, "not a NIfTI, NRRD or MetaImage file");
        return NULL;
    }
    if (gzread(file, bytes + 4, size - 4) != (int)(size - 4)) {
        volume_error(error, "cut off inside the header");
        return NULL;
    }
    error[0] = '\0';
    header = size == sizeof(nifti_1_header) ? read_version_1(bytes, single, volume, error)
                                            : read_version_2(bytes, single, volume, error);
    if (!header && !error[0]) {
        volume_error(error, "bad header");
    }
    if (header && (!isfinite(header->scl_slope) || !isfinite(header->scl_inter))) {
        header->scl_slope = 0.0; /* = not scaled; check() has noted it */
        header->scl_inter = 0.0;
    }
    return header;
}

/* Returns the furthest distance, in the file's unit, between the places that two maps give a corner of the volume. */
static double furthest_corner(const nifti_image *header, const nifti_dmat44 *a, const nifti_dmat44 *b)
{
    double furthest = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        double apart = 0.0;
        for (int r = 0; r < 3; ++r) {
            double d = a->m[r][3] - b->m[r][3];
            for (int c = 0; c < 3; ++c) {
                d += corner >> c & 1 ? (a->m[r][c] - b->m[r][c]) * (double)(header->dim[c + 1] - 1) : 0.0;
            }
            apart += d * d;
        }
        furthest = fmax(furthest, sqrt(apart));
    }
    return furthest;
}

/* Warns where the header contradicts itself: sform, qform and pixel sizes; and of numbers that are metres rather than mm. */
static void warn_of_geometry(const nifti_image *header, double unit, struct volume *volume)
{
    const double other_size = 0.01, shortest = 2.0; /* share of a pixel's size; mm */
    const float *side = volume->spacing;
    double length = 0.0, pixel = 0.0;
    char text[200];
    for (int a = 0; a < 3; ++a) {
        length = fmax(length, (double)side[a] * volume->dims[a]);
        pixel = fmax(pixel, (double)side[a]);
    }
    if (header->sform_code > 0 && header->qform_code > 0) {
        const double apart = unit * furthest_corner(header, &header->sto_xyz, &header->qto_xyz);
        if (apart > 0.5 * pixel) {
            snprintf(text, sizeof text, "sform and qform place a corner %.3g mm apart: the sform is used", apart);
            volume_add_warning(volume, text);
        }
    }
    for (int a = 0; a < 3 && header->sform_code > 0; ++a) {
        const double size = unit * fabs(header->pixdim[a + 1]);
        if (size > 0.0 && volume->dims[a] > 1 && fabs(size - (double)side[a]) > other_size * size) {
            snprintf(text, sizeof text, "voxels are %.4g x %.4g x %.4g mm by the sform, %.4g x %.4g x %.4g by pixdim: the sform is used",
                     (double)side[0], (double)side[1], (double)side[2], unit * fabs(header->pixdim[1]), unit * fabs(header->pixdim[2]),
                     unit * fabs(header->pixdim[3]));
            volume_add_warning(volume, text);
            break;
        }
    }
    if (unit == 1.0 && length < shortest) {
        snprintf(text, sizeof text, "the image is %.3g mm long: are its numbers metres?", length);
        volume_add_warning(volume, text);
    }
}

bool volume_header_geometry(const nifti_image *header, struct volume *volume, char error[VOLUME_TEXT])
{
    const char *source = header->sform_code > 0 ? "sform" : header->qform_code > 0 ? "qform" : "pixel sizes";
    const double unit = header->xyz_units == NIFTI_UNITS_METER    ? 1000.0
                        : header->xyz_units == NIFTI_UNITS_MICRON ? 0.001
                                                                  : 1.0;
    memset(volume->affine, 0, sizeof volume->affine);
    volume->affine[3][3] = 1.0;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
            if (header->sform_code > 0) {
                volume->affine[r][c] = unit * header->sto_xyz.m[r][c];
            } else if (header->qform_code > 0) {
                volume->affine[r][c] = unit * header->qto_xyz.m[r][c];
            } else if (r == c) {
                volume->affine[r][c] = unit * fabs(header->pixdim[c + 1]);
            }
        }
    }
    if (!volume_set_geometry(volume)) {
        return volume_error(error,
                            "bad header: the %s give%s no usable voxel-to-world map (singular, zero or not finite)",
                            source, header->sform_code > 0 || header->qform_code > 0 ? "s" : "");
    }
    warn_of_geometry(header, unit, volume);
    return true;
}
