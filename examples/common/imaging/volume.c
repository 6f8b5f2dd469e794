#define _POSIX_C_SOURCE 200809L

#include "base/write_error.h"
#include "imaging/resample.h"
#include "imaging/volume_format.h"
#include "imaging/volume_nifti.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const float max_anisotropy = 100.0f; /* longest over shortest side of a voxel */

/* ---- shared by the formats ---- */

bool volume_error(char error[VOLUME_TEXT], const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error, VOLUME_TEXT, format, arguments);
    va_end(arguments);
    return false;
}

bool volume_write_error(char error[VOLUME_TEXT], const char *path)
{
    return write_error(error, VOLUME_TEXT, path);
}

void volume_add_warning(struct volume *volume, const char *text)
{
    const size_t used = strlen(volume->warning);
    snprintf(volume->warning + used, sizeof volume->warning - used, "%s%s", used ? "; " : "", text);
}

bool volume_ends_with(const char *text, const char *ending)
{
    const size_t a = strlen(text), b = strlen(ending);
    return a >= b && strcmp(text + a - b, ending) == 0;
}

int64_t volume_file_size(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISREG(info.st_mode) ? (int64_t)info.st_size : -1;
}

bool volume_beside(const char *path, const char *name, char *result, size_t size)
{
    const char *slash = name[0] == '/' ? NULL : strrchr(path, '/');
    const int folder = slash ? (int)(slash - path + 1) : 0;
    return snprintf(result, size, "%.*s%s", folder, path, name) < (int)size;
}

bool volume_set_sizes(struct volume *volume, const int64_t *sizes, int space, int all, int frame, char error[VOLUME_TEXT])
{
    const int64_t limit = (int64_t)1 << 31; /* 8 GiB as float */
    int64_t voxels = 1, frames = 1;
    for (int i = 0; i < all; ++i) {
        int64_t *product = i < space ? &voxels : &frames;
        if (sizes[i] < 1) {
            return volume_error(error, "bad header: size %lld in dimension %d", (long long)sizes[i], i + 1);
        }
        if (sizes[i] > limit || *product > limit / sizes[i]) {
            return volume_error(error, "too large: more than %lld %s", (long long)limit, i < space ? "voxels" : "frames");
        }
        *product *= sizes[i];
    }
    if (voxels > INT32_MAX || frames > INT32_MAX) { /* a single side may already reach the limit */
        return volume_error(error, "too large: more than %d voxels or frames", INT32_MAX);
    }
    for (int i = 0; i < 3; ++i) {
        volume->dims[i] = i < space ? (int)sizes[i] : 1;
    }
    volume->frame = frame;
    volume->frame_count = (int)frames;
    volume->dimension = 3;
    for (int i = space; i < all; ++i) {
        if (sizes[i] > 1) {
            volume->dimension = i + 4 - space;
        }
    }
    return (frame >= 0 && frame < volume->frame_count)
        || volume_error(error, "there is no frame %d: the file has %d", frame, volume->frame_count);
}

const char *volume_warning(const struct volume *image) { return image->warning[0] ? image->warning : NULL; }

void volume_print_warning(const struct volume *image, const char *program, const char *name)
{
    if (image->warning[0]) {
        fprintf(stderr, "%s: warning: %s%s%s\n", program, name ? name : "", name ? ": " : "", image->warning);
    }
}

bool volume_set_geometry(struct volume *volume)
{
    double column[3][3];
    for (int c = 0; c < 3; ++c) {
        double length2 = 0.0;
        for (int r = 0; r < 3; ++r) {
            length2 += volume->affine[r][c] * volume->affine[r][c];
        }
        const double length = sqrt(length2);
        if (!(length > 1e-9 && length < 1e9) || !(fabs(volume->affine[c][3]) < 1e9)) {
            return false;
        }
        volume->spacing[c] = (float)length;
        volume->origin[c] = (float)volume->affine[c][3];
        for (int r = 0; r < 3; ++r) {
            column[c][r] = volume->affine[r][c] / length;
            volume->direction[r][c] = (float)column[c][r];
        }
    }
    const double determinant = column[0][0] * (column[1][1] * column[2][2] - column[1][2] * column[2][1])
                               - column[0][1] * (column[1][0] * column[2][2] - column[1][2] * column[2][0])
                               + column[0][2] * (column[1][0] * column[2][1] - column[1][1] * column[2][0]);
    return fabs(determinant) > 1e-4;
}

void volume_flip_to_ras(double affine[4][4])
{
    for (int c = 0; c < 4; ++c) {
        affine[0][c] = 0.0 - affine[0][c]; /* not -0 */
        affine[1][c] = 0.0 - affine[1][c];
    }
}

bool volume_allocate(struct volume *volume, char error[VOLUME_TEXT])
{
    volume->minimum = INFINITY;
    volume->maximum = -INFINITY;
    volume->data = malloc(volume_voxels(volume) * sizeof *volume->data);
    volume->ids = volume->data && volume->wants_ids ? malloc(volume_voxels(volume) * sizeof *volume->ids) : NULL;
    return (volume->data && (volume->ids || !volume->wants_ids))
        || volume_error(error, "not enough memory for %zu voxels", volume_voxels(volume));
}

void volume_store(struct volume *volume, size_t voxel, double value)
{
    const float stored = (float)value;
    volume->data[voxel] = stored;
    if (volume->ids) {
        const bool is_id = value >= 0.0 && value <= (double)UINT32_MAX && value == floor(value);
        volume->ids[voxel] = is_id ? (uint32_t)value : 0;
        volume->wants_ids = volume->wants_ids && is_id;
    }
    if (isfinite(stored)) {
        volume->minimum = fminf(volume->minimum, stored);
        volume->maximum = fmaxf(volume->maximum, stored);
    } else {
        ++volume->replaced;
    }
}

size_t volume_sample_size(enum volume_sample type)
{
    static const size_t sizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 0};
    return sizes[type];
}

double volume_sample(const unsigned char *bytes, enum volume_sample type, bool swapped)
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
        unsigned char bytes[8];
    } v = {0};
    const size_t size = volume_sample_size(type);
    for (size_t b = 0; b < size; ++b) {
        v.bytes[b] = bytes[swapped ? size - 1 - b : b];
    }
    switch (type) {
    case SAMPLE_INT8: return v.i8;
    case SAMPLE_UINT8: return v.u8;
    case SAMPLE_INT16: return v.i16;
    case SAMPLE_UINT16: return v.u16;
    case SAMPLE_INT32: return v.i32;
    case SAMPLE_UINT32: return v.u32;
    case SAMPLE_INT64: return (double)v.i64;
    case SAMPLE_UINT64: return (double)v.u64;
    case SAMPLE_FLOAT32: return (double)v.f32;
    case SAMPLE_FLOAT64: return v.f64;
    case SAMPLE_NONE: break;
    }
    return 0.0;
}

size_t volume_type_size(enum volume_type type)
{
    static const size_t sizes[] = {1, 2, 4, 4};
    return sizes[type];
}

bool volume_stream_open(struct volume_stream *stream, FILE *file, bool compressed)
{
    memset(stream, 0, sizeof *stream);
    stream->file = file;
    stream->compressed = compressed;
    return !compressed || inflateInit2(&stream->z, 15 + 32) == Z_OK; /* + 32: zlib or gzip, by the first bytes */
}

size_t volume_stream_read(struct volume_stream *stream, unsigned char *bytes, size_t count)
{
    if (!stream->compressed) {
        return fread(bytes, 1, count, stream->file);
    }
    stream->z.next_out = bytes;
    stream->z.avail_out = (unsigned)count;
    while (stream->z.avail_out > 0 && !stream->ended) {
        if (stream->z.avail_in == 0) {
            stream->z.next_in = stream->input;
            stream->z.avail_in = (unsigned)fread(stream->input, 1, sizeof stream->input, stream->file);
        }
        const int code = inflate(&stream->z, Z_NO_FLUSH);
        stream->ended = code == Z_STREAM_END;
        if (code != Z_OK && !stream->ended) {
            break;
        }
    }
    return count - stream->z.avail_out;
}

void volume_stream_close(struct volume_stream *stream)
{
    if (stream->compressed) {
        inflateEnd(&stream->z);
    }
}

/* ---- reading ---- */

typedef bool (*reader)(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT]);

static bool is_folder(const char *path)
{
    struct stat info;
    return stat(path, &info) == 0 && S_ISDIR(info.st_mode);
}

static bool read_dicom_file(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    (void)path, (void)frame, (void)volume;
    return volume_error(error, "one file of a DICOM series: give the folder in which all lie");
}

/* Chooses by the first bytes, whatever the file's name is; a MetaImage header is text without a magic word. */
static reader choose_reader(const char *path, struct volume *volume)
{
    enum { DICOM_AT = 128 };
    static const char *const first_keys[] = {"ObjectType", "NDims", "Comment", "ObjectSubType"};
    char begin[DICOM_AT + 5] = "";
    volume->extension = ".nii.gz";
    if (is_folder(path)) {
        return volume_read_dicom;
    }
    FILE *file = fopen(path, "rb");
    if (file) {
        begin[fread(begin, 1, sizeof begin - 1, file)] = '\0';
        fclose(file);
    }
    if (memcmp(begin + DICOM_AT, "DICM", 4) == 0) {
        return read_dicom_file;
    }
    bool meta = volume_ends_with(path, ".mha") || volume_ends_with(path, ".mhd");
    for (size_t k = 0; k < sizeof first_keys / sizeof *first_keys; ++k) {
        meta = meta || strncmp(begin, first_keys[k], strlen(first_keys[k])) == 0;
    }
    const bool nrrd = strncmp(begin, "NRRD", 4) == 0 || volume_ends_with(path, ".nrrd") || volume_ends_with(path, ".nhdr");
    volume->extension = nrrd ? ".nrrd" : meta ? ".mha" : ".nii.gz";
    return nrrd ? volume_read_nrrd : meta ? volume_read_meta : volume_read_nifti;
}

/* Compares the sides along axes with more than one voxel. */
static bool anisotropy_is_small(const struct volume *volume)
{
    float shortest = INFINITY, longest = 0.0f;
    for (int a = 0; a < 3; ++a) {
        if (volume->dims[a] > 1) {
            shortest = fminf(shortest, volume->spacing[a]);
            longest = fmaxf(longest, volume->spacing[a]);
        }
    }
    return longest <= max_anisotropy * shortest;
}

/* Replaces values that are not finite, by the minimum or (keep_gaps) NaN. */
static void fill_gaps(struct volume *volume, bool keep_gaps)
{
    char text[96], now[32] = "no data";
    for (size_t i = 0; i < volume_voxels(volume); ++i) {
        volume->data[i] = isfinite(volume->data[i]) ? volume->data[i] : keep_gaps ? NAN : volume->minimum;
    }
    if (!keep_gaps) {
        snprintf(now, sizeof now, "now %g", (double)volume->minimum);
    }
    snprintf(text, sizeof text, "%zu of %zu voxels are NaN or infinite, %s", volume->replaced, volume_voxels(volume), now);
    volume_add_warning(volume, text);
    volume->replaced = keep_gaps ? 0 : volume->replaced;
}

/* What is kept of a file's values. */
enum keep { KEEP_FINITE, KEEP_GAPS, KEEP_IDS };

static bool read_all(const char *path, int frame, enum keep keep, struct volume *volume, char error[VOLUME_TEXT])
{
    if (!is_folder(path) && volume_file_size(path) < 0) {
        return volume_error(error, "no such file, or not a plain one");
    }
    if (!is_folder(path) && volume_series_is_chosen()) {
        return volume_error(error, "%.60s is for folders of DICOM files", volume_series_is_chosen());
    }
    if (!choose_reader(path, volume)(path, frame, volume, error)) {
        return false;
    }
    if (!anisotropy_is_small(volume)) {
        return volume_error(error, "voxels of %g x %g x %g mm: their sides may differ by a factor of %g at most",
                            (double)volume->spacing[0], (double)volume->spacing[1], (double)volume->spacing[2], (double)max_anisotropy);
    }
    if (volume->replaced == volume_voxels(volume)) {
        return volume_error(error, "no voxel is finite");
    }
    if (volume->replaced > 0) {
        fill_gaps(volume, keep == KEEP_GAPS);
    }
    if (!volume->wants_ids) {
        free(volume->ids);
        volume->ids = NULL;
    }
    return true;
}

static bool read_named(const char *path, int frame, enum keep keep, struct volume *volume, char error[VOLUME_TEXT])
{
    char reason[VOLUME_TEXT] = "";
    memset(volume, 0, sizeof *volume);
    volume->wants_ids = keep == KEEP_IDS;
    error[0] = '\0';
    if (read_all(path, frame, keep, volume, reason)) {
        return true;
    }
    volume_free(volume);
    const size_t length = strlen(path); /* the end of a long path is more useful */
    return volume_error(error, "%s%s: %.200s", length > 100 ? "..." : "", length > 100 ? path + length - 97 : path,
                        reason);
}

bool volume_read(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    return read_named(path, frame, KEEP_FINITE, volume, error);
}

static bool read_one(const char *path, int frame, const char *option, enum keep keep, struct volume *volume, char error[VOLUME_TEXT])
{
    if (!read_named(path, frame < 0 ? 0 : frame, keep, volume, error)) {
        return false;
    }
    const int count = volume->frame_count, dimension = volume->dimension;
    if (count == 1 || frame >= 0) {
        return true;
    }
    volume_free(volume);
    return option ? volume_error(error, "%.200s: %d images in one file (%d-D): choose one with %s", path, count, dimension, option)
                  : volume_error(error, "%.200s: %d images in one file (%d-D), where one is needed", path, count, dimension);
}

bool volume_read_one(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT])
{
    return read_one(path, frame, option, KEEP_FINITE, volume, error);
}

bool volume_read_gaps(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT])
{
    return read_one(path, frame, option, KEEP_GAPS, volume, error);
}

bool volume_read_labels(const char *path, int frame, const char *option, struct volume *volume, char error[VOLUME_TEXT])
{
    if (!read_one(path, frame, option, KEEP_IDS, volume, error)) {
        return false;
    }
    if (volume->ids) {
        return true;
    }
    volume_free(volume);
    return volume_error(error, "%.200s: labels are whole numbers from 0 to 4294967295; this has others: a scan?", path);
}

bool volume_read_companion(const char *path, int frame, struct volume *volume, char error[VOLUME_TEXT])
{
    if (!read_named(path, 0, KEEP_IDS, volume, error)) {
        return false;
    }
    if (volume->frame_count == 1) {
        return true;
    }
    volume_free(volume);
    return read_one(path, frame, NULL, KEEP_IDS, volume, error);
}

/* How the voxels of one grid lie among those of another. */
struct placement_of {
    float map[3][4];    /* from voxels of the one to those of the other */
    float furthest;     /* from the middle of a voxel, in voxels; INFINITY: one lies outside */
    double millimetres; /* the same */
    bool turned;        /* the axes are others, or point the other way */
};

/* The corners of the box bound all voxels. */
static void find_placement(const struct volume *like, const struct volume *volume, struct placement_of *at)
{
    resample_map(like, NULL, volume, at->map);
    at->furthest = 0.0f;
    at->millimetres = 0.0;
    at->turned = false;
    for (int a = 0; a < 3; ++a) {
        at->turned = at->turned || !(at->map[a][a] > 0.5f);
    }
    for (int corner = 0; corner < 8; ++corner) {
        float x[3];
        double square = 0.0;
        resample_place((const float(*)[4])at->map, corner & 1 ? like->dims[0] - 1 : 0, corner & 2 ? like->dims[1] - 1 : 0,
                       corner & 4 ? like->dims[2] - 1 : 0, x);
        for (int a = 0; a < 3; ++a) {
            const float middle = roundf(x[a]), beside = fabsf(x[a] - middle);
            const bool inside = middle >= 0.0f && middle <= (float)(volume->dims[a] - 1);
            at->furthest = inside ? fmaxf(at->furthest, beside) : INFINITY;
            square += (double)(beside * volume->spacing[a]) * (double)(beside * volume->spacing[a]);
        }
        at->millimetres = fmax(at->millimetres, sqrt(square));
    }
    at->furthest = volume_voxels(like) == volume_voxels(volume) ? at->furthest : INFINITY;
}

/* Replaces the voxels by those that lie nearest to the voxels of `like`, and the grid by that of `like`. */
static bool take_nearest(const struct volume *like, const struct placement_of *at, struct volume *volume)
{
    const size_t total = volume_voxels(like);
    float *data = malloc(total * sizeof *data);
    uint32_t *ids = volume->ids ? malloc(total * sizeof *ids) : NULL;
    if (!data || (volume->ids && !ids)) {
        free(data);
        free(ids);
        return false;
    }
    for (size_t n = 0; n < total; ++n) {
        int place[3];
        float x[3];
        volume_place(like->dims, n, place);
        resample_place((const float(*)[4])at->map, place[0], place[1], place[2], x);
        const size_t from = (size_t)lroundf(x[0])
            + (size_t)volume->dims[0] * ((size_t)lroundf(x[1]) + (size_t)volume->dims[1] * (size_t)lroundf(x[2]));
        data[n] = volume->data[from];
        if (ids) {
            ids[n] = volume->ids[from];
        }
    }
    free(volume->data);
    free(volume->ids);
    if (volume->header) { /* of the grid that it had */
        nifti_image_free((nifti_image *)volume->header);
    }
    volume->data = data;
    volume->ids = ids;
    volume->header = NULL;
    memcpy(volume->dims, like->dims, sizeof volume->dims);
    memcpy(volume->spacing, like->spacing, sizeof volume->spacing);
    memcpy(volume->origin, like->origin, sizeof volume->origin);
    memcpy(volume->direction, like->direction, sizeof volume->direction);
    memcpy(volume->affine, like->affine, sizeof volume->affine);
    return true;
}

/* Puts into `error` in what a grid differs: sizes, voxels, or place. */
static void what_differs(const struct volume *like, const struct volume *volume, const struct placement_of *at, const char *name,
                         const char *path, char error[VOLUME_TEXT])
{
    const int *d = volume->dims, *e = like->dims;
    const float *s = volume->spacing, *t = like->spacing;
    float largest = 0.0f;
    for (int a = 0; a < 3; ++a) {
        largest = fmaxf(largest, fabsf(s[a] - t[a]) / t[a]);
    }
    if (memcmp(d, e, 3 * sizeof *d) != 0) {
        volume_error(error, "%.120s: not on the grid of %s: %d x %d x %d voxels, not %d x %d x %d", path, name, d[0], d[1], d[2], e[0],
                     e[1], e[2]);
    } else if (largest > 1e-3f) {
        volume_error(error, "%.120s: not on the grid of %s: voxels of %g x %g x %g mm, not %g x %g x %g", path, name, (double)s[0],
                     (double)s[1], (double)s[2], (double)t[0], (double)t[1], (double)t[2]);
    } else {
        volume_error(error, "%.120s: not on the grid of %s: its first voxel lies at %g,%g,%g mm, not %g,%g,%g%s", path, name,
                     (double)volume->origin[0], (double)volume->origin[1], (double)volume->origin[2], (double)like->origin[0],
                     (double)like->origin[1], (double)like->origin[2], at->turned ? ", along other axes" : "");
    }
}

bool volume_read_like(const struct volume *like, const char *name, const char *path, int frame, struct volume *volume,
                      char error[VOLUME_TEXT])
{
    if (!volume_read_companion(path, frame, volume, error)) {
        return false;
    }
    if (volume_same_grid(volume, like)) {
        return true;
    }
    struct placement_of at;
    find_placement(like, volume, &at);
    if (at.furthest <= 0.1f) {
        if (!take_nearest(like, &at, volume)) {
            volume_free(volume);
            return volume_error(error, "%.200s: not enough memory", path);
        }
        char note[VOLUME_TEXT];
        if (at.turned) {
            snprintf(note, sizeof note, "stored in another orientation than %s: put into its order", name);
        } else {
            snprintf(note, sizeof note, "up to %.2g mm beside the grid of %s: taken by nearest voxels", at.millimetres, name);
        }
        volume_add_warning(volume, note);
        return true;
    }
    what_differs(like, volume, &at, name, path, error);
    volume_free(volume);
    return false;
}

static int compare_values(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Returns a voxel's value, exact where there are ids. */
static double value_at(const struct volume *volume, size_t n) { return volume->ids ? (double)volume->ids[n] : (double)volume->data[n]; }

/* Returns how many values the image has, when they are few whole numbers; else 0. */
static size_t few_values(const struct volume *volume)
{
    enum { MOST = 1024 };
    double values[MOST];
    size_t count = 0;
    for (size_t n = 0; n < volume_voxels(volume); ++n) {
        const double value = value_at(volume, n);
        if (!isfinite(value) || (n > 0 && value == value_at(volume, n - 1))
            || bsearch(&value, values, count, sizeof *values, compare_values)) {
            continue;
        }
        if (value != floor(value) || count == MOST) {
            return 0;
        }
        size_t at = count++;
        for (; at > 0 && values[at - 1] > value; --at) {
            values[at] = values[at - 1];
        }
        values[at] = value;
    }
    return count;
}

bool volume_is_label_map(const struct volume *volume)
{
    const double mostly = 0.75;
    double pairs = 0.0, equal = 0.0;
    if (!few_values(volume)) {
        return false;
    }
    for (size_t n = 1; n < volume_voxels(volume); ++n) { /* neighbours along x; the ground does not count */
        const double a = value_at(volume, n - 1), b = value_at(volume, n), ground = (double)volume->minimum;
        if (a > ground && b > ground) {
            pairs += 1.0;
            equal += a == b ? 1.0 : 0.0;
        }
    }
    return equal > mostly * pairs;
}

bool volume_check_labels(const struct volume *volume, const char *path, char error[VOLUME_TEXT])
{
    const size_t certain = 64; /* so few values are no scan, however noisy */
    const size_t values = few_values(volume);
    if (values > 0 && (values <= certain || volume_is_label_map(volume))) {
        return true;
    }
    return volume_error(error, "%.200s: a label map is wanted, with few whole numbers; this looks like a scan", path);
}

bool volume_write(const char *path, const struct volume *like, enum volume_type type, const void *data,
                  char error[VOLUME_TEXT])
{
    error[0] = '\0';
    return volume_ends_with(path, ".nrrd")  ? volume_write_nrrd(path, like, type, data, error)
           : volume_ends_with(path, ".mha") ? volume_write_meta(path, like, type, data, error)
                                            : volume_write_nifti(path, like, type, data, error);
}

bool volume_write_labels(const char *path, const struct volume *like, const uint32_t *labels, char error[VOLUME_TEXT])
{
    const size_t total = volume_voxels(like);
    uint32_t most = 0;
    for (size_t n = 0; n < total; ++n) {
        most = labels[n] > most ? labels[n] : most;
    }
    if (most > INT16_MAX) {
        return volume_write(path, like, VOLUME_UINT32, labels, error);
    }
    int16_t *narrow = malloc(total * sizeof *narrow);
    if (!narrow) {
        return volume_error(error, "not enough memory");
    }
    for (size_t n = 0; n < total; ++n) {
        narrow[n] = (int16_t)labels[n];
    }
    const bool good = volume_write(path, like, VOLUME_INT16, narrow, error);
    free(narrow);
    return good;
}

/* ---- new volumes ---- */

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

/* Makes a volume whose box has the same center and axes as that of `like`. */
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
    free(volume->ids);
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

void volume_apply(const double map[3][4], const float x[3], float y[3])
{
    double out[3];
    for (int r = 0; r < 3; ++r) {
        out[r] = map[r][0] * (double)x[0] + map[r][1] * (double)x[1] + map[r][2] * (double)x[2] + map[r][3];
    }
    for (int r = 0; r < 3; ++r) {
        y[r] = (float)out[r];
    }
}
