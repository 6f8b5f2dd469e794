/* volume_nifti.c - NIfTI files for volume.h. */
#include "imaging/volume_nifti.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Finds the other file of a pair: of the same name, with one of the endings in place of .hdr, .img or either and .gz. */
static bool pair_path(const char *one, const char *const endings[3], char *path, size_t size)
{
    size_t stem = strlen(one);
    stem -= volume_ends_with(one, ".gz") ? 3 : 0;
    stem -= stem >= 4 ? 4 : 0;
    for (int i = 0; i < 3; ++i) {
        if (snprintf(path, size, "%.*s%s", (int)stem, one, endings[i]) < (int)size && volume_file_size(path) >= 0) {
            return true;
        }
    }
    return false;
}

static bool is_of_voxels(const char *path)
{
    return volume_ends_with(path, ".img") || volume_ends_with(path, ".img.gz") || volume_ends_with(path, ".IMG");
}

/* Moves to `offset` of the uncompressed bytes by reading: a seek past the end of a gzip file may go unnoticed. */
static bool skip_to(gzFile file, int64_t offset)
{
    unsigned char scrap[16384];
    int64_t left = offset - (int64_t)gztell(file);
    while (left > 0) {
        const unsigned want = left < (int64_t)sizeof scrap ? (unsigned)left : (unsigned)sizeof scrap;
        if (gzread(file, scrap, want) != (int)want) {
            return false;
        }
        left -= want;
    }
    return left == 0;
}

static bool read_voxels(gzFile file, const nifti_image *header, struct volume *volume, char error[VOLUME_TEXT])
{
    enum { BLOCK = 4096 };
    unsigned char block[BLOCK * 8];
    const enum volume_sample type = volume_nifti_sample(header->datatype);
    const size_t bytes = volume_sample_size(type), total = volume_voxels(volume);
    const double slope = header->scl_slope != 0.0 ? header->scl_slope : 1.0;
    const double intercept = header->scl_slope != 0.0 ? header->scl_inter : 0.0;
    for (size_t done = 0; done < total;) {
        const size_t count = total - done < BLOCK ? total - done : BLOCK;
        const int got = gzread(file, block, (unsigned)(count * bytes));
        if (got != (int)(count * bytes)) {
            return volume_error(error, got < 0 ? "damaged: the compressed data are broken"
                                               : "cut off: the header promises more voxels than the file holds");
        }
        for (size_t i = 0; i < count; ++i, ++done) {
            volume_store(volume, done, volume_sample(block + i * bytes, type, header->swapsize > 1) * slope + intercept);
        }
    }
    /* Read on to the end: only there does zlib compare the checksum. */
    int got = 0;
    while ((got = gzread(file, block, sizeof block)) > 0) {}
    int code = Z_OK;
    gzerror(file, &code);
    if (got < 0 || (code != Z_OK && code != Z_STREAM_END)) {
        return volume_error(error, "damaged: the compressed data are cut off or their checksum is wrong");
    }
    return true;
}

static bool read_data(const char *path, int frame, const nifti_image *header, struct volume *volume,
                      char error[VOLUME_TEXT])
{
    const int64_t voxels = (int64_t)volume_voxels(volume), frame_bytes = voxels * header->nbyper;
    const int64_t start = header->iname_offset + frame * frame_bytes, on_disk = volume_file_size(path);
    gzFile file = gzopen(path, "rb");
    bool good = false;
    if (!file) {
        return volume_error(error, "cannot open %s", path);
    }
    gzbuffer(file, 1 << 17);
    /* Bound the size by the file: deflate cannot shrink by more than about 1032. */
    if (start > (INT64_MAX >> 1) - frame_bytes || (start + frame_bytes) / (gzdirect(file) ? 1 : 1040) > on_disk) {
        volume_error(error, "cut off: the header promises %lld bytes of voxels at %lld, the file has %lld%s",
                     (long long)frame_bytes, (long long)start, (long long)on_disk,
                     gzdirect(file) ? "" : " compressed");
    } else if (volume_allocate(volume, error)) {
        good = skip_to(file, start) ? read_voxels(file, header, volume, error)
                                    : volume_error(error, "cut off or damaged before the voxels of frame %d", frame);
    }
    gzclose(file);
    return good;
}

bool volume_read_nifti(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    static const char *const voxels[] = {".img", ".img.gz", ".IMG"}, *const headers[] = {".hdr", ".hdr.gz", ".HDR"};
    char data_path[4096], header_path[4096];
    bool single = true;
    if (is_of_voxels(path)) {
        if (!pair_path(path, headers, header_path, sizeof header_path)) {
            return volume_error(error, "the voxels of a pair, whose .hdr file is missing");
        }
        path = header_path;
    }
    gzFile file = gzopen(path, "rb");
    if (!file) {
        return volume_error(error, "cannot open");
    }
    nifti_image *header = volume_header_read(file, volume, &single, error);
    gzclose(file);
    if (!header) {
        return false;
    }
    volume->header = header;
    const int all = (int)header->dim[0];
    if (!volume_set_sizes(volume, header->dim + 1, all < 3 ? all : 3, all, frame, error)
        || !volume_header_geometry(header, volume, error)) {
        return false;
    }
    if (single) {
        const int64_t first = header->nifti_type == NIFTI_FTYPE_NIFTI2_1 ? 544 : 352;
        header->iname_offset = header->iname_offset > 0 ? header->iname_offset : first;
    } else if (!pair_path(path, voxels, data_path, sizeof data_path)) {
        return volume_error(error, "the .img file with the voxels is missing");
    }
    return read_data(single ? path : data_path, frame, header, volume, error);
}
