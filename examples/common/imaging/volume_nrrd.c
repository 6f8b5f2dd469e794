/* volume_nrrd.c - NRRD files, through teem. */
#include "imaging/volume_format.h"

#include "base/write_error.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <teem/nrrd.h>

/* Reports the last line of teem's message, which names the cause. */
static bool teem_error(char error[VOLUME_TEXT])
{
    char *text = biffGetDone(NRRD);
    size_t length = text ? strlen(text) : 0;
    while (length > 0 && text[length - 1] == '\n') {
        text[--length] = '\0';
    }
    const char *line = length > 0 ? strrchr(text, '\n') : NULL;
    line = line ? line + 1 : length > 0 ? text : "not readable";
    const char *words = strstr(line, ": ");
    volume_error(error, "%.200s", words ? words + 2 : line);
    free(text);
    return false;
}

/* ---- geometry ---- */

/* Finds the axes of space (at most 3, the others count as frames) and the affine. */
static bool find_space(const Nrrd *nrrd, double affine[4][4], int axes[3], int *count, char error[VOLUME_TEXT])
{
    static const double turned[][3] = {{1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}}; /* RAS, LAS, LPS */
    int turn = 2; /* unnamed spaces as in ITK */
    if (nrrd->space == nrrdSpaceRightAnteriorSuperior || nrrd->space == nrrdSpaceRightAnteriorSuperiorTime) {
        turn = 0;
    } else if (nrrd->space == nrrdSpaceLeftAnteriorSuperior || nrrd->space == nrrdSpaceLeftAnteriorSuperiorTime) {
        turn = 1;
    }
    *count = 0;
    memset(affine, 0, 16 * sizeof affine[0][0]);
    affine[3][3] = 1.0;
    for (unsigned a = 0; a < nrrd->dim; ++a) {
        double spacing = 1.0, vector[NRRD_SPACE_DIM_MAX] = {0};
        const int status = nrrdSpacingCalculate(nrrd, a, &spacing, vector), kind = nrrd->axis[a].kind;
        const bool in_space = nrrd->spaceDim > 0 ? status == nrrdSpacingStatusDirection && kind != nrrdKindTime
                                                 : kind == nrrdKindUnknown || kind == nrrdKindDomain || kind == nrrdKindSpace;
        if (!in_space || *count == 3) {
            continue;
        }
        for (int r = 0; r < 3; ++r) {
            const double direction = nrrd->spaceDim > 0 ? (r < (int)nrrd->spaceDim ? vector[r] : 0.0) : r == *count;
            affine[r][*count] = turned[turn][r] * direction * (isfinite(spacing) ? spacing : 1.0) + 0.0; /* not -0 */
        }
        axes[(*count)++] = (int)a;
    }
    for (int c = *count; c < 3; ++c) { /* a flat image lies in x and y */
        affine[c][c] = turned[turn][c];
    }
    if (*count == 0) {
        return volume_error(error, "no axis of space");
    }
    double origin[NRRD_SPACE_DIM_MAX] = {0};
    unsigned domain[3];
    for (int c = 0; c < *count; ++c) {
        domain[c] = (unsigned)axes[c];
    }
    const bool placed = nrrdOriginCalculate(nrrd, domain, (unsigned)*count, nrrdCenterCell, origin) == nrrdOriginStatusOkay;
    for (int r = 0; r < 3; ++r) {
        const double place = nrrd->spaceDim > 0 ? nrrd->spaceOrigin[r] : placed ? origin[r] : 0.0;
        affine[r][3] = isfinite(place) && (nrrd->spaceDim == 0 || r < (int)nrrd->spaceDim) ? turned[turn][r] * place + 0.0 : 0.0;
    }
    return true;
}

/* Returns millimetres a unit of the file, by the spellings that are in use; 0: a word that is not known. */
static double unit_of(const Nrrd *nrrd)
{
    static const struct {
        const char *name;
        double mm;
    } units[] = {{"mm", 1.0},           {"millimeter", 1.0},       {"millimetre", 1.0}, {"m", 1000.0},       {"meter", 1000.0},
                 {"metre", 1000.0},     {"cm", 10.0},              {"centimeter", 10.0}, {"centimetre", 10.0}, {"um", 1e-3},
                 {"\xc2\xb5m", 1e-3}, {"\xce\xbcm", 1e-3},     {"micron", 1e-3},    {"micrometer", 1e-3}, {"micrometre", 1e-3},
                 {"nm", 1e-6},          {"nanometer", 1e-6},       {"nanometre", 1e-6}, {"in", 25.4},        {"inch", 25.4},
                 {"inche", 25.4}}; /* and a plural s */
    const char *name = nrrd->spaceDim > 0 ? nrrd->spaceUnits[0] : nrrd->axis[0].units;
    if (!name || !name[0]) {
        return 1.0;
    }
    for (size_t u = 0; u < sizeof units / sizeof *units; ++u) {
        const size_t length = strlen(units[u].name);
        if (strncmp(name, units[u].name, length) == 0 && (name[length] == '\0' || (length > 2 && strcmp(name + length, "s") == 0))) {
            return units[u].mm;
        }
    }
    return 0.0;
}

/* ---- reading ---- */

/* Unpacks the whole stream to check it: teem accepts damaged gzip data, or leaks memory over them. */
static bool whole_gzip(FILE *file, int64_t bytes, char error[VOLUME_TEXT])
{
    struct volume_stream stream;
    unsigned char block[16384];
    int64_t unpacked = 0;
    size_t got = 1;
    if (!file || !volume_stream_open(&stream, file, true)) {
        return volume_error(error, "cannot be read");
    }
    while (got > 0 && unpacked <= bytes) {
        got = volume_stream_read(&stream, block, sizeof block);
        unpacked += (int64_t)got;
    }
    volume_stream_close(&stream);
    return (stream.ended && unpacked == bytes) || volume_error(error, "cut off or damaged: the compressed data are broken");
}

/* Checks that the file is as long as its header requires: numbers as text take two bytes, bzip2 cannot shrink by more than
 * 50000. */
static bool enough_there(const char *path, const Nrrd *nrrd, const NrrdIoState *io, int64_t samples, char error[VOLUME_TEXT])
{
    const int64_t bytes = samples * (int64_t)nrrdElementSize(nrrd);
    int64_t on_disk = volume_file_size(path);
    if (io->dataFNFormat || io->dataFNArr->len > 1) {
        return true; /* several files, each with a part: teem checks them */
    }
    if (io->dataFNArr->len == 1) {
        char data_path[4096];
        if (!volume_beside(path, io->dataFN[0], data_path, sizeof data_path) || (on_disk = volume_file_size(data_path)) < 0) {
            return volume_error(error, "the file with the voxels is missing");
        }
    }
    if (io->encoding == nrrdEncodingGzip) {
        return whole_gzip(io->dataFile, bytes + (io->byteSkip > 0 ? io->byteSkip : 0), error);
    }
    const int64_t minimum = io->encoding == nrrdEncodingBzip2   ? bytes / 50000
                          : io->encoding == nrrdEncodingAscii ? 2 * samples - 1
                          : io->encoding == nrrdEncodingHex   ? 2 * bytes
                                                              : bytes;
    return minimum <= on_disk
        || volume_error(error, "cut off: the header promises %lld bytes of voxels, the file has %lld", (long long)bytes,
                        (long long)on_disk);
}

static void copy_frame(const Nrrd *nrrd, const int axes[3], int count, struct volume *volume)
{
    size_t strides[NRRD_DIM_MAX], start = 0, rest = (size_t)volume->frame, stride[3] = {0, 0, 0};
    for (unsigned a = 0; a < nrrd->dim; ++a) {
        strides[a] = a > 0 ? strides[a - 1] * nrrd->axis[a - 1].size : 1;
    }
    for (unsigned a = 0; a < nrrd->dim; ++a) {
        bool in_space = false;
        for (int c = 0; c < count; ++c) {
            in_space = in_space || axes[c] == (int)a;
        }
        if (!in_space) {
            start += rest % nrrd->axis[a].size * strides[a];
            rest /= nrrd->axis[a].size;
        }
    }
    for (int c = 0; c < count; ++c) {
        stride[c] = strides[axes[c]];
    }
    double (*const look_up)(const void *, size_t) = nrrdDLookup[nrrd->type];
    size_t voxel = 0;
    for (size_t k = 0; k < (size_t)volume->dims[2]; ++k) {
        for (size_t j = 0; j < (size_t)volume->dims[1]; ++j) {
            for (size_t i = 0; i < (size_t)volume->dims[0]; ++i, ++voxel) {
                volume_store(volume, voxel, look_up(nrrd->data, start + i * stride[0] + j * stride[1] + k * stride[2]));
            }
        }
    }
}

/* Reads the header alone first, because teem allocates by the sizes in it. */
static bool check_header(const char *path, int frame, struct volume *volume, int axes[3], int *count, char error[VOLUME_TEXT])
{
    Nrrd *nrrd = nrrdNew();
    NrrdIoState *io = nrrdIoStateNew();
    bool good = nrrd && io;
    if (!good) {
        volume_error(error, "not enough memory");
    } else {
        io->skipData = io->keepNrrdDataFileOpen = 1;
        good = nrrdLoad(nrrd, path, io) == 0 || teem_error(error);
    }
    if (good && nrrd->type == nrrdTypeBlock) {
        good = volume_error(error, "cannot use blocks as voxels");
    }
    if (good && find_space(nrrd, volume->affine, axes, count, error)) {
        int64_t sizes[NRRD_DIM_MAX];
        int all = *count;
        for (unsigned a = 0; a < nrrd->dim; ++a) {
            const int64_t size = nrrd->axis[a].size < (size_t)INT64_MAX ? (int64_t)nrrd->axis[a].size : INT64_MAX;
            int place = -1;
            for (int c = 0; c < *count; ++c) {
                place = axes[c] == (int)a ? c : place;
            }
            sizes[place >= 0 ? place : all++] = size;
        }
        double unit = unit_of(nrrd);
        if (!(unit > 0.0)) {
            volume_add_warning(volume, "a unit of length that is not known: taken for mm");
            unit = 1.0;
        }
        for (int n = 0; n < 12; ++n) {
            volume->affine[n / 4][n % 4] *= unit;
        }
        good = volume_set_sizes(volume, sizes, *count, all, frame, error)
            && (volume_set_geometry(volume)
                || volume_error(error, "bad header: no usable voxel-to-world map (singular, zero or not finite)"))
            && enough_there(path, nrrd, io, (int64_t)volume_voxels(volume) * volume->frame_count, error);
    } else {
        good = false;
    }
    if (io && io->dataFile) {
        fclose(io->dataFile);
    }
    nrrdIoStateNix(io);
    nrrdNuke(nrrd);
    return good;
}

bool volume_read_nrrd(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    int axes[3], count = 0;
    if (!check_header(path, frame, volume, axes, &count, error)) {
        return false;
    }
    Nrrd *nrrd = nrrdNew();
    const bool good = (nrrd && nrrdLoad(nrrd, path, NULL) == 0) ? volume_allocate(volume, error) : teem_error(error);
    if (good) {
        copy_frame(nrrd, axes, count, volume);
    }
    nrrdNuke(nrrd);
    return good;
}

/* ---- writing ---- */

bool volume_write_nrrd(const char *path, const struct volume *like, enum volume_type type, const void *data,
                       char error[VOLUME_TEXT])
{
    static const int types[] = {nrrdTypeUChar, nrrdTypeShort, nrrdTypeFloat, nrrdTypeUInt};
    char reason[VOLUME_TEXT] = "";
    Nrrd *nrrd = nrrdNew();
    NrrdIoState *io = nrrdIoStateNew();
    union {
        const void *in;
        void *out;
    } borrowed = {data}; /* teem only reads it */
    size_t sizes[3];
    double affine[4][4];
    memcpy(affine, like->affine, sizeof affine);
    volume_flip_to_ras(affine); /* to LPS, which every program supports */
    for (int a = 0; a < 3; ++a) {
        sizes[a] = (size_t)like->dims[a];
    }
    bool good = nrrd && io && nrrdWrap_nva(nrrd, borrowed.out, types[type], 3, sizes) == 0
             && nrrdSpaceSet(nrrd, nrrdSpaceLeftPosteriorSuperior) == 0;
    for (int a = 0; good && a < 3; ++a) {
        nrrd->axis[a].kind = nrrdKindDomain;
        nrrd->spaceOrigin[a] = affine[a][3];
        for (int r = 0; r < 3; ++r) {
            nrrd->axis[a].spaceDirection[r] = affine[r][a];
        }
    }
    if (good) {
        io->encoding = nrrdEncodingGzip;
        good = nrrdSave(path, nrrd, io) == 0;
    }
    if (!good) {
        teem_error(reason);
        partial_file_remove(path);
        volume_error(error, "%.100s: cannot be written: %.150s", path, reason);
    }
    nrrdIoStateNix(io);
    nrrdNix(nrrd);
    return good;
}
