/* field_io.c - displacement fields in files. */
#include "registration/field.h"

#include "base/write_error.h"

/* Needs -I with Debian's folder /usr/include/nifti, which also contains the znzlib.h that this header includes. */
#include <nifti2_io.h>
#include <zlib.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const float lps[3] = {-1.0f, -1.0f, 1.0f}; /* the same signs in both directions */

static bool path_error(char error[VOLUME_TEXT], const char *path, const char *text)
{
    const size_t length = strlen(path); /* the end of a long path is more useful */
    snprintf(error, VOLUME_TEXT, "%s%s: %s", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path, text);
    return false;
}

/* Checks that an image is a displacement field. Returns NULL, or what is wrong. */
static const char *fault(const struct volume *first)
{
    const nifti_image *header = first->header;
    if (!header && first->frame_count != 3) { /* in NRRD and MetaImage a vector's components count as frames */
        return "no displacement field: it has no three components";
    }
    if (header && (header->dim[0] != 5 || header->dim[4] != 1 || header->dim[5] != 3)) {
        return "no displacement field: the dimensions are not (nx, ny, nz, 1, 3)";
    }
    if (header && header->intent_code != NIFTI_INTENT_VECTOR && header->intent_code != NIFTI_INTENT_DISPVECT) {
        return "no displacement field: the intent is neither vector (1007) nor displacement (1006)";
    }
    return first->replaced > 0 ? "a displacement is not finite" : NULL;
}

bool field_read(const char *path, struct field *field, char error[VOLUME_TEXT])
{
    memset(field, 0, sizeof *field);
    for (int c = 0; c < 3; ++c) {
        struct volume component;
        const char *wrong = NULL;
        if (!volume_read(path, c, &component, error)) {
            field_free(field);
            if (c == 0) {
                return false;
            }
            return strstr(error, "there is no frame")
                       ? path_error(error, path, "no displacement field: it has no three frames")
                       : false;
        }
        wrong = fault(&component);
        if (!wrong && c == 0 && !field_create(&component, field)) {
            wrong = "not enough memory";
        }
        for (size_t n = 0; !wrong && n < volume_voxels(&component); ++n) {
            field->mm[3 * n + (size_t)c] = lps[c] * component.data[n];
        }
        volume_free(&component);
        if (wrong) {
            field_free(field);
            return path_error(error, path, wrong);
        }
    }
    return true;
}

/* Returns true if a rotation and the voxel sizes alone can place the voxels. */
static bool perpendicular(const struct volume *grid)
{
    float maximum = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3;
        float dot = 0.0f;
        for (int r = 0; r < 3; ++r) {
            dot += grid->direction[r][a] * grid->direction[r][b];
        }
        maximum = fmaxf(maximum, fabsf(dot));
    }
    return maximum < 1e-4f;
}

static nifti_1_header make_header(const struct volume *grid)
{
    nifti_1_header h;
    memset(&h, 0, sizeof h);
    h.sizeof_hdr = (int)sizeof h;
    h.dim[0] = 5;
    h.dim[4] = h.dim[6] = h.dim[7] = 1;
    h.dim[5] = 3;
    h.pixdim[0] = h.pixdim[4] = h.pixdim[5] = 1.0f;
    for (int a = 0; a < 3; ++a) {
        h.dim[a + 1] = (short)grid->dims[a];
        h.pixdim[a + 1] = grid->spacing[a];
    }
    for (int c = 0; c < 4; ++c) {
        h.srow_x[c] = (float)grid->affine[0][c];
        h.srow_y[c] = (float)grid->affine[1][c];
        h.srow_z[c] = (float)grid->affine[2][c];
    }
    /* Write a qform wherever it can represent the geometry, because some programs read only that. */
    nifti_dmat44 m;
    double qb, qc, qd, qx, qy, qz, dx, dy, dz, qfac;
    memcpy(m.m, grid->affine, sizeof m.m);
    nifti_dmat44_to_quatern(m, &qb, &qc, &qd, &qx, &qy, &qz, &dx, &dy, &dz, &qfac);
    h.pixdim[0] = (float)qfac;
    h.quatern_b = (float)qb, h.quatern_c = (float)qc, h.quatern_d = (float)qd;
    h.qoffset_x = (float)qx, h.qoffset_y = (float)qy, h.qoffset_z = (float)qz;
    h.sform_code = NIFTI_XFORM_SCANNER_ANAT;
    h.qform_code = perpendicular(grid) ? NIFTI_XFORM_SCANNER_ANAT : NIFTI_XFORM_UNKNOWN;
    h.datatype = DT_FLOAT32;
    h.bitpix = 32;
    h.vox_offset = (float)(sizeof h + 4);
    h.scl_slope = 1.0f;
    h.xyzt_units = NIFTI_UNITS_MM;
    h.intent_code = NIFTI_INTENT_VECTOR;
    memcpy(h.magic, "n+1", 4);
    return h;
}

/* Writes one component of every voxel. */
static bool write_component(gzFile file, const struct field *field, size_t c)
{
    enum { BLOCK = 4096 };
    float block[BLOCK];
    const size_t total = volume_voxels(&field->grid);
    for (size_t done = 0; done < total;) {
        const size_t count = total - done < BLOCK ? total - done : BLOCK;
        for (size_t n = 0; n < count; ++n) {
            block[n] = lps[c] * field->mm[3 * (done + n) + c];
        }
        if (gzwrite(file, block, (unsigned)(count * sizeof *block)) != (int)(count * sizeof *block)) {
            return false;
        }
        done += count;
    }
    return true;
}

bool field_write(const char *path, const struct field *field, char error[VOLUME_TEXT])
{
    const size_t length = strlen(path);
    const bool compressed = length > 3 && strcmp(path + length - 3, ".gz") == 0;
    const nifti_1_header header = make_header(&field->grid);
    const char no_extensions[4] = {0, 0, 0, 0};
    for (int a = 0; a < 3; ++a) {
        if (field->grid.dims[a] > 32767) {
            return path_error(error, path, "too large: more than 32767 voxels along a side");
        }
    }
    gzFile file = gzopen(path, compressed ? "wb6" : "wbT"); /* T: plain bytes */
    if (!file) {
        return volume_write_error(error, path);
    }
    bool good = gzwrite(file, &header, sizeof header) == (int)sizeof header && gzwrite(file, no_extensions, 4) == 4;
    for (size_t c = 0; c < 3; ++c) {
        good = good && write_component(file, field, c);
    }
    good = gzclose(file) == Z_OK && good;
    if (!good) {
        volume_write_error(error, path);
        partial_file_remove(path);
        return false;
    }
    return true;
}
