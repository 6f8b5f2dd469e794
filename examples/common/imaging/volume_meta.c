/* volume_meta.c - MetaImage files (.mha, .mhd + data): a header of "Key = value" lines, then bytes that may be one zlib
 * stream. Debian has a reader for them only inside the large toolkits ITK and VTK. */
#include "imaging/volume_format.h"

#include "base/write_error.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { MAX_DIMENSIONS = 7, LINE_SIZE = 4096, MAX_LINES = 1000 };

struct meta {
    int dimensions, channels;
    int64_t sizes[MAX_DIMENSIONS], header_size;
    double spacing[MAX_DIMENSIONS], origin[MAX_DIMENSIONS], matrix[MAX_DIMENSIONS * MAX_DIMENSIONS];
    enum volume_sample type;
    bool big_endian, compressed, text, has_sizes, has_spacing, has_matrix;
    char data_name[LINE_SIZE];
};

/* ---- header ---- */

static bool is_key(const char *key, const char *names)
{
    const size_t length = strlen(key);
    for (const char *at = names; length > 0 && (at = strstr(at, key)) != NULL; at += length) {
        if ((at == names || at[-1] == '|') && (at[length] == '|' || at[length] == '\0')) {
            return true;
        }
    }
    return false;
}

static bool is_true(const char *value) { return value[0] == 'T' || value[0] == 't' || value[0] == '1'; }

/* Reads exactly `count` finite numbers. */
static bool read_numbers(const char *value, int count, double *numbers)
{
    for (int n = 0; n < count; ++n) {
        char *end = NULL;
        numbers[n] = strtod(value, &end);
        if (end == value || !isfinite(numbers[n])) {
            return false;
        }
        value = end;
    }
    return *value == '\0';
}

static enum volume_sample type_of(const char *name)
{
    static const struct {
        const char *name;
        enum volume_sample type;
    } types[] = {{"MET_CHAR", SAMPLE_INT8},       {"MET_UCHAR", SAMPLE_UINT8},          {"MET_SHORT", SAMPLE_INT16},
                 {"MET_USHORT", SAMPLE_UINT16},   {"MET_INT", SAMPLE_INT32},            {"MET_UINT", SAMPLE_UINT32},
                 {"MET_LONG", SAMPLE_INT32},      {"MET_ULONG", SAMPLE_UINT32},         {"MET_LONG_LONG", SAMPLE_INT64},
                 {"MET_ULONG_LONG", SAMPLE_UINT64}, {"MET_FLOAT", SAMPLE_FLOAT32},      {"MET_DOUBLE", SAMPLE_FLOAT64}};
    for (size_t t = 0; t < sizeof types / sizeof *types; ++t) {
        if (strcmp(name, types[t].name) == 0) {
            return types[t].type;
        }
    }
    return SAMPLE_NONE;
}

/* Reads one "Key = value"; keys without influence on voxels or their places are skipped. */
static bool read_key(struct meta *meta, const char *key, const char *value, char error[VOLUME_TEXT])
{
    double numbers[MAX_DIMENSIONS * MAX_DIMENSIONS];
    const int n = meta->dimensions;
    bool good = true;
    if (is_key(key, "NDims")) {
        good = read_numbers(value, 1, numbers) && numbers[0] >= 2.0 && numbers[0] <= MAX_DIMENSIONS;
        meta->dimensions = good ? (int)numbers[0] : 0;
    } else if (is_key(key, "DimSize")) {
        good = n > 0 && read_numbers(value, n, numbers);
        for (int i = 0; good && i < n; ++i) {
            good = fabs(numbers[i]) < 1e15;
            meta->sizes[i] = good ? (int64_t)numbers[i] : 0;
        }
        meta->has_sizes = good;
    } else if (is_key(key, "ElementSpacing|ElementSize")) {
        good = n > 0 && read_numbers(value, n, numbers);
        if (good && (strcmp(key, "ElementSpacing") == 0 || !meta->has_spacing)) { /* the spacing takes precedence over the size */
            memcpy(meta->spacing, numbers, (size_t)n * sizeof *numbers);
            meta->has_spacing = true;
        }
    } else if (is_key(key, "Offset|Position|Origin")) {
        good = n > 0 && read_numbers(value, n, meta->origin);
    } else if (is_key(key, "TransformMatrix|Rotation|Orientation")) {
        good = meta->has_matrix = n > 0 && read_numbers(value, n * n, meta->matrix);
    } else if (is_key(key, "ElementNumberOfChannels")) {
        good = read_numbers(value, 1, numbers) && numbers[0] >= 1.0 && numbers[0] <= 1e6;
        meta->channels = good ? (int)numbers[0] : 1;
    } else if (is_key(key, "HeaderSize")) {
        good = read_numbers(value, 1, numbers) && numbers[0] >= -1.0 && numbers[0] < 1e15;
        meta->header_size = good ? (int64_t)numbers[0] : 0;
    } else if (is_key(key, "ElementType")) {
        meta->type = type_of(value);
        good = meta->type != SAMPLE_NONE;
    } else if (is_key(key, "BinaryData")) {
        meta->text = !is_true(value);
    } else if (is_key(key, "BinaryDataByteOrderMSB|ElementByteOrderMSB")) {
        meta->big_endian = is_true(value);
    } else if (is_key(key, "CompressedData")) {
        meta->compressed = is_true(value);
    } else if (is_key(key, "ElementDataFile")) {
        strcpy(meta->data_name, value);
    }
    return good || volume_error(error, "bad header: %.40s = %.100s", key, value);
}

/* Reads up to the line ElementDataFile, which is the last one. */
static bool read_header(FILE *file, struct meta *meta, char error[VOLUME_TEXT])
{
    char line[LINE_SIZE];
    memset(meta, 0, sizeof *meta);
    meta->channels = 1;
    meta->type = SAMPLE_NONE;
    for (int l = 0; l < MAX_LINES && !meta->data_name[0] && fgets(line, sizeof line, file); ++l) {
        char *value = strchr(line, '='), *end = line + strlen(line);
        if (end > line && end[-1] != '\n' && end == line + sizeof line - 1) {
            break;
        }
        while (end > line && isspace((unsigned char)end[-1])) {
            *--end = '\0';
        }
        if (!value) {
            if (end > line) {
                return volume_error(error, "bad header: a line without '='");
            }
            continue;
        }
        char *key_end = value;
        do {
            ++value;
        } while (isspace((unsigned char)*value));
        while (key_end > line && isspace((unsigned char)key_end[-1])) {
            --key_end;
        }
        *key_end = '\0';
        if (!read_key(meta, line, value, error)) {
            return false;
        }
    }
    return !meta->has_sizes              ? volume_error(error, "bad header: NDims or DimSize is missing")
           : meta->type == SAMPLE_NONE   ? volume_error(error, "bad header: ElementType is missing")
           : !meta->data_name[0]         ? volume_error(error, "bad header: ElementDataFile is missing")
           : meta->text                  ? volume_error(error, "cannot use voxels written as text (BinaryData = False)")
           : strcmp(meta->data_name, "LIST") == 0 || strchr(meta->data_name, '%')
               ? volume_error(error, "cannot use voxels spread over several files")
               : true;
}

static bool set_geometry(const struct meta *meta, struct volume *volume, char error[VOLUME_TEXT])
{
    const int n = meta->dimensions;
    memset(volume->affine, 0, sizeof volume->affine);
    for (int c = 0; c < 3; ++c) {
        const double spacing = meta->has_spacing && c < n ? meta->spacing[c] : 1.0;
        for (int r = 0; r < 3; ++r) { /* the file lists the direction of the first axis first */
            const double direction = meta->has_matrix && c < n && r < n ? meta->matrix[c * n + r] : r == c;
            volume->affine[r][c] = spacing * direction;
        }
        volume->affine[c][3] = c < n ? meta->origin[c] : 0.0;
    }
    volume->affine[3][3] = 1.0;
    volume_flip_to_ras(volume->affine);
    return volume_set_geometry(volume)
        || volume_error(error, "bad header: no usable voxel-to-world map (singular, zero or not finite)");
}

/* ---- voxels ---- */

/* Reads the voxels of one frame: channels are interleaved, further dimensions follow each other, and both count as frames. */
static bool read_voxels(struct volume_stream *s, const struct meta *meta, struct volume *volume, char error[VOLUME_TEXT])
{
    const uint16_t one = 1;
    const bool swapped = (*(const unsigned char *)&one == 0) != meta->big_endian;
    const size_t size = volume_sample_size(meta->type), channels = (size_t)meta->channels;
    const size_t voxels = volume_voxels(volume), images = (size_t)volume->frame_count / channels;
    const size_t image = (size_t)volume->frame / channels, channel = (size_t)volume->frame % channels;
    const size_t together = channels * size > 65536 ? 1 : 65536 / (channels * size); /* voxels read at once */
    unsigned char *block = malloc(together * channels * size), surplus;
    bool good = block || volume_error(error, "not enough memory");
    for (size_t m = 0; good && m < (s->compressed ? images : image + 1); ++m) { /* read all, to check the stream */
        for (size_t done = 0; good && done < voxels;) {
            const size_t count = voxels - done < together ? voxels - done : together, bytes = count * channels * size;
            good = volume_stream_read(s, block, bytes) == bytes
                || volume_error(error, s->compressed ? "cut off or damaged: the compressed data are broken"
                                                     : "cut off: the header promises more voxels than the file holds");
            for (size_t i = 0; good && m == image && i < count; ++i) {
                volume_store(volume, done + i, volume_sample(block + (i * channels + channel) * size, meta->type, swapped));
            }
            done += count;
        }
    }
    if (good && s->compressed && (volume_stream_read(s, &surplus, 1) != 0 || !s->ended)) {
        good = volume_error(error, "damaged: the compressed data do not end with the last voxel");
    }
    free(block);
    return good;
}

static bool read_data(FILE *file, const struct meta *meta, int64_t on_disk, struct volume *volume, char error[VOLUME_TEXT])
{
    const int64_t bytes = (int64_t)volume_voxels(volume) * volume->frame_count * (int64_t)volume_sample_size(meta->type);
    int64_t start = (int64_t)ftell(file) + (meta->header_size > 0 ? meta->header_size : 0);
    if (meta->header_size < 0) { /* the voxels are the last bytes */
        if (meta->compressed) {
            return volume_error(error, "bad header: HeaderSize = -1 does not go with compressed data");
        }
        start = on_disk - bytes;
    }
    if (start < 0 || start > on_disk || bytes / (meta->compressed ? 1040 : 1) > on_disk - start) {
        return volume_error(error, "cut off: the header promises %lld bytes of voxels, the file has %lld%s", (long long)bytes,
                            (long long)(start > 0 && start < on_disk ? on_disk - start : 0),
                            meta->compressed ? " compressed" : "");
    }
    struct volume_stream stream;
    if (fseek(file, (long)start, SEEK_SET) != 0 || !volume_stream_open(&stream, file, meta->compressed)) {
        return volume_error(error, "cannot be read");
    }
    const bool good = volume_allocate(volume, error) && read_voxels(&stream, meta, volume, error);
    volume_stream_close(&stream);
    return good;
}

bool volume_read_meta(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    struct meta meta;
    int64_t sizes[MAX_DIMENSIONS + 1];
    char data_path[LINE_SIZE];
    FILE *file = fopen(path, "rb");
    if (!file) {
        return volume_error(error, "cannot open");
    }
    bool good = read_header(file, &meta, error);
    const int space = meta.dimensions < 3 ? meta.dimensions : 3;
    if (good) {
        memcpy(sizes, meta.sizes, sizeof meta.sizes);
        sizes[meta.dimensions] = meta.channels;
        good = volume_set_sizes(volume, sizes, space, meta.dimensions + 1, frame, error) && set_geometry(&meta, volume, error);
    }
    if (good && strcmp(meta.data_name, "LOCAL") != 0 && strcmp(meta.data_name, "Local") != 0) {
        fclose(file);
        file = volume_beside(path, meta.data_name, data_path, sizeof data_path) && volume_file_size(data_path) >= 0
                 ? fopen(data_path, "rb") : NULL;
        path = data_path;
        good = file || volume_error(error, "the file with the voxels is missing: %.150s", meta.data_name);
    }
    good = good && read_data(file, &meta, volume_file_size(path), volume, error);
    if (file) {
        fclose(file);
    }
    return good;
}

/* ---- writing ---- */

static bool write_header(FILE *file, const struct volume *like, const char *type, size_t size)
{
    double affine[4][4];
    memcpy(affine, like->affine, sizeof affine);
    volume_flip_to_ras(affine); /* back to LPS */
    fprintf(file, "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = True\n"
            "CompressedDataSize = %zu\nTransformMatrix =", size);
    for (int n = 0; n < 9; ++n) {
        fprintf(file, " %.17g", affine[n % 3][n / 3] / (double)like->spacing[n / 3]);
    }
    fprintf(file, "\nOffset = %.17g %.17g %.17g\nCenterOfRotation = 0 0 0\nElementSpacing = %.9g %.9g %.9g\n", affine[0][3],
            affine[1][3], affine[2][3], (double)like->spacing[0], (double)like->spacing[1], (double)like->spacing[2]);
    fprintf(file, "DimSize = %d %d %d\nElementType = %s\nElementDataFile = LOCAL\n", like->dims[0], like->dims[1],
            like->dims[2], type);
    return !ferror(file);
}

bool volume_write_meta(const char *path, const struct volume *like, enum volume_type type, const void *data,
                       char error[VOLUME_TEXT])
{
    static const char *const types[] = {"MET_UCHAR", "MET_SHORT", "MET_FLOAT", "MET_UINT"};
    const uLong bytes = (uLong)(volume_voxels(like) * volume_type_size(type));
    uLongf size = compressBound(bytes);
    unsigned char *packed = malloc(size);
    if (!packed || compress2(packed, &size, data, bytes, 6) != Z_OK) {
        free(packed);
        return volume_error(error, "%.200s: not enough memory to compress", path);
    }
    FILE *file = fopen(path, "wb");
    bool good = file && write_header(file, like, types[type], size) && fwrite(packed, 1, size, file) == size;
    good = file && fclose(file) == 0 && good;
    good = good || volume_write_error(error, path);
    free(packed);
    if (!good && file) {
        partial_file_remove(path);
    }
    return good;
}
