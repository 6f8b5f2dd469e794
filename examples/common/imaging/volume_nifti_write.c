/* volume_nifti_write.c - writes NIfTI files for volume_write. */
#include "imaging/volume_nifti.h"

#include "base/write_error.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Makes a header with the geometry of `like`: the original one for other data, or one with only the sform. */
static nifti_image *make_header(const struct volume *like, int datatype)
{
    const int64_t dims[8] = {3, like->dims[0], like->dims[1], like->dims[2], 1, 1, 1, 1};
    nifti_image *header = nifti_make_new_nim(dims, datatype, 0);
    const nifti_image *original = like->header;
    if (!header) {
        return NULL;
    }
    header->xyz_units = NIFTI_UNITS_MM;
    for (int i = 0; i < 3; ++i) {
        header->pixdim[i + 1] = (double)like->spacing[i];
    }
    header->dx = header->pixdim[1];
    header->dy = header->pixdim[2];
    header->dz = header->pixdim[3];
    if (original) { /* copied, so that readers get exactly the same grid, both forms and the unit */
        memcpy(header->pixdim + 1, original->pixdim + 1, 3 * sizeof *header->pixdim);
        header->dx = original->dx;
        header->dy = original->dy;
        header->dz = original->dz;
        header->xyz_units = original->xyz_units;
        header->qform_code = original->qform_code;
        header->quatern_b = original->quatern_b;
        header->quatern_c = original->quatern_c;
        header->quatern_d = original->quatern_d;
        header->qoffset_x = original->qoffset_x;
        header->qoffset_y = original->qoffset_y;
        header->qoffset_z = original->qoffset_z;
        header->qfac = original->qfac;
        header->qto_xyz = original->qto_xyz;
        header->sform_code = original->sform_code;
        header->sto_xyz = original->sto_xyz;
    } else {
        header->sform_code = NIFTI_XFORM_SCANNER_ANAT;
        for (int r = 0; r < 4; ++r) {
            for (int c = 0; c < 4; ++c) {
                header->sto_xyz.m[r][c] = like->affine[r][c];
            }
        }
    }
    return header;
}

bool volume_write_nifti(const char *path, const struct volume *like, enum volume_type type, const void *data,
                        char error[VOLUME_TEXT])
{
    static const int datatypes[] = {DT_UINT8, DT_INT16, DT_FLOAT32, DT_UINT32};
    const nifti_image *original = like->header;
    const bool version_2 =
        (original && (original->nifti_type == NIFTI_FTYPE_NIFTI2_1 || original->nifti_type == NIFTI_FTYPE_NIFTI2_2))
        || like->dims[0] > 32767 || like->dims[1] > 32767 || like->dims[2] > 32767;
    const bool compressed = volume_ends_with(path, ".gz");
    unsigned char bytes[sizeof(nifti_2_header) + 4];
    size_t header_size = 0;
    nifti_set_debug_level(0);
    nifti_image *header = make_header(like, datatypes[type]);
    if (!header) {
        return volume_error(error, "%.200s: not enough memory for a header", path);
    }
    memset(bytes, 0, sizeof bytes); /* the four bytes after the header: no extensions */
    if (version_2) {
        nifti_2_header h;
        header->nifti_type = NIFTI_FTYPE_NIFTI2_1;
        nifti_convert_nim2n2hdr(header, &h);
        h.vox_offset = (int64_t)sizeof h + 4;
        header_size = sizeof h;
        memcpy(bytes, &h, sizeof h);
    } else {
        nifti_1_header h;
        header->nifti_type = NIFTI_FTYPE_NIFTI1_1;
        nifti_convert_nim2n1hdr(header, &h);
        h.vox_offset = (float)(sizeof h + 4);
        header_size = sizeof h;
        memcpy(bytes, &h, sizeof h);
    }
    nifti_image_free(header);

    gzFile file = gzopen(path, compressed ? "wb6" : "wbT"); /* T: plain bytes */
    if (!file) {
        return volume_write_error(error, path);
    }
    bool good = gzwrite(file, bytes, (unsigned)header_size + 4) == (int)header_size + 4;
    const size_t total = volume_voxels(like) * volume_type_size(type), step = (size_t)1 << 24;
    for (size_t done = 0; good && done < total; done += step) {
        const size_t count = total - done < step ? total - done : step;
        good = gzwrite(file, (const unsigned char *)data + done, (unsigned)count) == (int)count;
    }
    good = gzclose(file) == Z_OK && good;
    if (!good) {
        volume_write_error(error, path);
        partial_file_remove(path);
        return false;
    }
    return true;
}
