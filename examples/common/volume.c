#define _POSIX_C_SOURCE 200809L

#include "volume_header.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static bool ends_with(const char *text, const char *ending)
{
    const size_t a = strlen(text), b = strlen(ending);
    return a >= b && strcmp(text + a - b, ending) == 0;
}

static int64_t file_size(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISREG(info.st_mode) ? (int64_t)info.st_size : -1;
}

/* One voxel of the file as a double. `bytes` has this machine's order already. */
static double voxel_value(const unsigned char *bytes, int datatype)
{
    union {
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        int64_t i64;
        uint64_t u64;
        float f32;
        double f64;
    } v;
    switch (datatype) {
    case DT_INT8:
        memcpy(&v, bytes, 1);
        return v.i8;
    case DT_UINT8:
        memcpy(&v, bytes, 1);
        return v.u8;
    case DT_INT16:
        memcpy(&v, bytes, 2);
        return v.i16;
    case DT_UINT16:
        memcpy(&v, bytes, 2);
        return v.u16;
    case DT_INT32:
        memcpy(&v, bytes, 4);
        return v.i32;
    case DT_UINT32:
        memcpy(&v, bytes, 4);
        return v.u32;
    case DT_INT64:
        memcpy(&v, bytes, 8);
        return (double)v.i64;
    case DT_UINT64:
        memcpy(&v, bytes, 8);
        return (double)v.u64;
    case DT_FLOAT32:
        memcpy(&v, bytes, 4);
        return (double)v.f32;
    default:
        memcpy(&v, bytes, 8);
        return v.f64;
    }
}

/* Where the voxels of a .hdr lie: the same name with .img or .img.gz. */
static bool image_path(const char *header_path, char *path, size_t size)
{
    static const char *const endings[] = {".img", ".img.gz", ".IMG"};
    size_t stem = strlen(header_path);
    stem -= ends_with(header_path, ".gz") ? 3 : 0;
    stem -= stem >= 4 ? 4 : 0;
    for (size_t i = 0; i < sizeof endings / sizeof *endings; ++i) {
        if (snprintf(path, size, "%.*s%s", (int)stem, header_path, endings[i]) < (int)size && file_size(path) >= 0) {
            return true;
        }
    }
    return false;
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
    const size_t bytes = (size_t)header->nbyper, total = volume_voxels(volume);
    const bool scaled = header->scl_slope != 0.0;
    const bool swap = header->swapsize > 1;
    volume->minimum = INFINITY;
    volume->maximum = -INFINITY;
    for (size_t done = 0; done < total;) {
        const size_t count = total - done < BLOCK ? total - done : BLOCK;
        const int got = gzread(file, block, (unsigned)(count * bytes));
        if (got != (int)(count * bytes)) {
            return volume_error(error, got < 0 ? "damaged: the compressed data are broken"
                                               : "cut off: the header promises more voxels than the file holds");
        }
        if (swap) {
            nifti_swap_Nbytes((int64_t)count, header->swapsize, block);
        }
        for (size_t i = 0; i < count; ++i, ++done) {
            const double raw = voxel_value(block + i * bytes, header->datatype);
            const float value = (float)(scaled ? raw * header->scl_slope + header->scl_inter : raw);
            volume->data[done] = value;
            if (isfinite(value)) {
                volume->minimum = fminf(volume->minimum, value);
                volume->maximum = fmaxf(volume->maximum, value);
            } else {
                ++volume->replaced;
            }
        }
    }
    /* On to the end: only there does zlib compare the checksum. */
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
    const int64_t start = header->iname_offset + frame * frame_bytes, on_disk = file_size(path);
    gzFile file = gzopen(path, "rb");
    bool good = false;
    if (!file) {
        return volume_error(error, "cannot open %s", path);
    }
    gzbuffer(file, 1 << 17);
    /* deflate cannot shrink by more than about 1032, so this bounds what a compressed file can hold, too. */
    if (start > (INT64_MAX >> 1) - frame_bytes || (start + frame_bytes) / (gzdirect(file) ? 1 : 1040) > on_disk) {
        volume_error(error, "cut off: the header promises %lld bytes of voxels at %lld, the file has %lld%s",
                     (long long)frame_bytes, (long long)start, (long long)on_disk,
                     gzdirect(file) ? "" : " compressed");
    } else if (!(volume->data = malloc((size_t)voxels * sizeof *volume->data))) {
        volume_error(error, "not enough memory for %lld voxels", (long long)voxels);
    } else if (!skip_to(file, start)) {
        volume_error(error, "cut off or damaged before the voxels of frame %d", frame);
    } else {
        good = read_voxels(file, header, volume, error);
    }
    gzclose(file);
    return good;
}

static bool read_all(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    char data_path[4096];
    bool single = true;
    if (file_size(path) < 0) {
        return volume_error(error, "no such file");
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
    for (int i = 0; i < 3; ++i) {
        volume->dims[i] = i < header->dim[0] ? (int)header->dim[i + 1] : 1;
    }
    int64_t frames = 1;
    for (int i = 4; i <= header->dim[0]; ++i) {
        frames *= header->dim[i];
    }
    volume->frame = frame;
    volume->frame_count = frames < INT32_MAX ? (int)frames : INT32_MAX;
    if (frame < 0 || frame >= volume->frame_count) {
        return volume_error(error, "there is no frame %d: the file has %d", frame, volume->frame_count);
    }
    if (!volume_header_geometry(header, volume, error)) {
        return false;
    }
    if (single) {
        const int64_t first = header->nifti_type == NIFTI_FTYPE_NIFTI2_1 ? 544 : 352;
        header->iname_offset = header->iname_offset > 0 ? header->iname_offset : first;
    } else if (!image_path(path, data_path, sizeof data_path)) {
        return volume_error(error, "the .img file with the voxels is missing");
    }
    if (!read_data(single ? path : data_path, frame, header, volume, error)) {
        return false;
    }
    if (volume->replaced > 0) {
        char text[96];
        if (volume->replaced == volume_voxels(volume)) {
            return volume_error(error, "no voxel is finite");
        }
        for (size_t i = 0; i < volume_voxels(volume); ++i) {
            volume->data[i] = isfinite(volume->data[i]) ? volume->data[i] : volume->minimum;
        }
        snprintf(text, sizeof text, "%zu voxels were NaN or infinite, now %g", volume->replaced,
                 (double)volume->minimum);
        volume_note(volume, text);
    }
    return true;
}

bool volume_read(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    char reason[VOLUME_TEXT] = "";
    memset(volume, 0, sizeof *volume);
    error[0] = '\0';
    if (read_all(path, frame, volume, reason)) {
        return true;
    }
    volume_free(volume);
    const size_t length = strlen(path); /* of a long path the end tells more */
    return volume_error(error, "%s%s: %.200s", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path,
                        reason);
}

bool volume_create(const int dims[3], const float spacing[3], const float origin[3], struct volume *volume)
{
    memset(volume, 0, sizeof *volume);
    volume->frame_count = 1;
    volume->affine[3][3] = 1.0;
    for (int i = 0; i < 3; ++i) {
        volume->dims[i] = dims[i];
        volume->affine[i][i] = (double)spacing[i];
        volume->affine[i][3] = (double)origin[i];
    }
    if (dims[0] < 1 || dims[1] < 1 || dims[2] < 1 || !volume_set_geometry(volume)
        || !(volume->data = calloc(volume_voxels(volume), sizeof *volume->data))) {
        memset(volume, 0, sizeof *volume);
        return false;
    }
    return true;
}

/* A volume whose box has the same middle and the same axes as that of `like`. */
static bool create_over(const struct volume *like, const int dims[3], const float spacing[3], struct volume *volume)
{
    const float origin[3] = {0.0f, 0.0f, 0.0f};
    if (!volume_create(dims, spacing, origin, volume)) {
        return false;
    }
    memcpy(volume->affine, like->affine, sizeof volume->affine);
    for (int a = 0; a < 3; ++a) {
        const double step = (double)spacing[a] / (double)like->spacing[a];
        const double first = 0.5 * ((double)(like->dims[a] - 1) - step * (double)(dims[a] - 1));
        for (int r = 0; r < 3; ++r) {
            volume->affine[r][3] += first * like->affine[r][a];
            volume->affine[r][a] = step * like->affine[r][a];
        }
    }
    return volume_set_geometry(volume);
}

bool volume_create_padded(const struct volume *like, int margin, struct volume *volume)
{
    const int dims[3] = {like->dims[0] + 2 * margin, like->dims[1] + 2 * margin, like->dims[2] + 2 * margin};
    return create_over(like, dims, like->spacing, volume);
}

bool volume_create_cubes(const struct volume *like, float side, int margin, struct volume *volume)
{
    const float spacing[3] = {side, side, side};
    int dims[3];
    for (int a = 0; a < 3; ++a) {
        dims[a] = (int)ceilf(like->spacing[a] * (float)like->dims[a] / side - 1e-3f) + 2 * margin;
    }
    return create_over(like, dims, spacing, volume);
}

void volume_free(struct volume *volume)
{
    if (volume->header) {
        nifti_image_free((nifti_image *)volume->header);
    }
    free(volume->data);
    memset(volume, 0, sizeof *volume);
}

bool volume_same_grid(const struct volume *a, const struct volume *b)
{
    if (memcmp(a->dims, b->dims, sizeof a->dims) != 0) {
        return false;
    }
    const double tolerance = 1e-3 * (double)fminf(fminf(a->spacing[0], a->spacing[1]), a->spacing[2]);
    for (int corner = 0; corner < 8; ++corner) { /* the corners of the grid bound every other voxel */
        for (int r = 0; r < 3; ++r) {
            double difference = a->affine[r][3] - b->affine[r][3];
            for (int c = 0; c < 3; ++c) {
                difference += ((corner >> c) & 1 ? a->dims[c] - 1 : 0) * (a->affine[r][c] - b->affine[r][c]);
            }
            if (!(fabs(difference) < tolerance)) {
                return false;
            }
        }
    }
    return true;
}

void volume_index_to_world(const struct volume *volume, const float index[3], float world[3])
{
    double out[3];
    for (int r = 0; r < 3; ++r) {
        out[r] = volume->affine[r][3];
        for (int c = 0; c < 3; ++c) {
            out[r] += volume->affine[r][c] * (double)index[c];
        }
    }
    for (int r = 0; r < 3; ++r) {
        world[r] = (float)out[r];
    }
}

void volume_world_to_index(const struct volume *volume, const float world[3], float index[3])
{
    const double(*m)[4] = (const double(*)[4])volume->affine;
    double d[3], inverse[3][3];
    for (int r = 0; r < 3; ++r) {
        d[r] = (double)world[r] - m[r][3];
        for (int c = 0; c < 3; ++c) { /* cofactors, cyclic indices carry the sign */
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            inverse[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    }
    const double determinant = m[0][0] * inverse[0][0] + m[1][0] * inverse[0][1] + m[2][0] * inverse[0][2];
    for (int r = 0; r < 3; ++r) {
        index[r] = (float)((inverse[r][0] * d[0] + inverse[r][1] * d[1] + inverse[r][2] * d[2]) / determinant);
    }
}
