/* Folders of DICOM files, which the test writes: order, places, slopes, compression, gaps, several series. Compiled like test_common.c,
 * else skipped. Where GDCM was not found, what is said instead. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_dicom_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_dicom_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "../../examples/common/imaging/volume.h"
#include "scratch.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char error[VOLUME_TEXT];

/* ---- files ---- */

enum { COLUMNS = 7, ROWS = 5, SLICES = 6, EXPLICIT_LITTLE, RLE };

/* A slice of a series; places in mm along the normal, and from there along the rows; frames: 0 is one without a number;
 * grouped, they have places, so many mm from one to the next, and a slope and intercept each;
 * dose: planes 1.5 mm apart, with one slope of 2. */
struct slice {
    const char *name, *series, *description;
    int number, syntax;
    double at, slope, intercept, beside;
    int frames;
    bool grouped, dose;
    double step;
};

/* Axes of the rows and columns, and their normal: turned about z and tilted. */
static const double along[3] = {0.8, 0.6, 0.0}, down[3] = {-0.36, 0.48, 0.8}, normal[3] = {0.48, -0.64, 0.6};
static const double column_mm = 0.5, row_mm = 0.75, first_mm[3] = {10.0, -20.0, 30.0};

static void put16(FILE *file, unsigned value)
{
    fputc((int)(value & 255), file);
    fputc((int)(value >> 8 & 255), file);
}

static void put32(FILE *file, uint32_t value)
{
    put16(file, value & 65535);
    put16(file, value >> 16);
}

/* An element with a short length. */
static void put_bytes(FILE *file, unsigned group, unsigned element, const char *type, const void *bytes, size_t count)
{
    put16(file, group);
    put16(file, element);
    fputs(type, file);
    put16(file, (unsigned)count);
    fwrite(bytes, 1, count, file);
}

static void put_text(FILE *file, unsigned group, unsigned element, const char *type, const char *text)
{
    char padded[256];
    size_t length = strlen(text);
    memcpy(padded, text, length + 1);
    if (length % 2) {
        padded[length++] = type[0] == 'U' ? '\0' : ' ';
    }
    put_bytes(file, group, element, type, padded, length);
}

static void put_number(FILE *file, unsigned element, unsigned value)
{
    const unsigned char bytes[2] = {(unsigned char)(value & 255), (unsigned char)(value >> 8)};
    put_bytes(file, 0x0028, element, "US", bytes, 2);
}

static int stored(int i, int j, double at) { return i + 10 * j + 100 * (int)lround(at) - 300; }

/* Two segments, of high and of low bytes, in runs of literals. */
static void put_packed(FILE *file, const unsigned char high[], const unsigned char low[], unsigned count)
{
    const unsigned segment = count + 1 + (count + 1) % 2;
    put32(file, 0xe000fffeu); /* no table of offsets */
    put32(file, 0);
    put32(file, 0xe000fffeu);
    put32(file, 64 + 2 * segment);
    put32(file, 2);
    put32(file, 64);
    put32(file, 64 + segment);
    for (int n = 3; n < 16; ++n) {
        put32(file, 0);
    }
    for (int part = 0; part < 2; ++part) {
        fputc((int)count - 1, file);
        fwrite(part ? low : high, 1, count, file);
        for (unsigned n = count + 1; n < segment; ++n) {
            fputc(0, file);
        }
    }
    put32(file, 0xe0ddfffeu);
    put32(file, 0);
}

static void put_voxels(FILE *file, const struct slice *slice)
{
    enum { COUNT = COLUMNS * ROWS };
    unsigned char high[COUNT], low[COUNT];
    for (int n = 0; n < COUNT; ++n) {
        const unsigned value = (unsigned)stored(n % COLUMNS, n / COLUMNS, slice->at) & 65535;
        high[n] = (unsigned char)(value >> 8);
        low[n] = (unsigned char)(value & 255);
    }
    put16(file, 0x7fe0);
    put16(file, 0x0010);
    fputs(slice->syntax == RLE ? "OB" : "OW", file);
    put16(file, 0);
    put32(file, slice->syntax == RLE ? 0xffffffffu : 2 * COUNT * (uint32_t)(slice->frames > 0 ? slice->frames : 1));
    if (slice->syntax == RLE) {
        put_packed(file, high, low, COUNT);
        return;
    }
    for (int n = 0; n < COUNT * (slice->frames > 0 ? slice->frames : 1); ++n) {
        fputc(low[n % COUNT], file);
        fputc(high[n % COUNT], file);
    }
}

/* CT, plain or with many frames. */
static const char *kind_of(const struct slice *slice)
{
    return slice->dose ? "1.2.840.10008.5.1.4.1.1.481.2" : slice->grouped ? "1.2.840.10008.5.1.4.1.1.2.1" : "1.2.840.10008.5.1.4.1.1.2";
}

static void put_meta(FILE *file, const struct slice *slice, const char *instance)
{
    const char *syntax = slice->syntax == RLE ? "1.2.840.10008.1.2.5" : "1.2.840.10008.1.2.1";
    static const char preamble[128];
    fwrite(preamble, 1, sizeof preamble, file);
    fputs("DICM", file);
    put_text(file, 2, 2, "UI", kind_of(slice));
    put_text(file, 2, 3, "UI", instance);
    put_text(file, 2, 0x10, "UI", syntax);
}

static void begin_item(FILE *file, unsigned group, unsigned element)
{
    put16(file, group);
    put16(file, element);
    fputs("SQ", file);
    put16(file, 0);
    put32(file, 0xffffffffu);
    put32(file, 0xe000fffeu);
    put32(file, 0xffffffffu);
}

static void end_item(FILE *file, bool last)
{
    put32(file, 0xe00dfffeu);
    put32(file, 0);
    put32(file, last ? 0xe0ddfffeu : 0xe000fffeu);
    put32(file, last ? 0 : 0xffffffffu);
}

static void put_place(FILE *file, double at, double beside)
{
    double place[3];
    char text[256];
    for (int r = 0; r < 3; ++r) {
        place[r] = first_mm[r] + at * normal[r] + beside * along[r];
    }
    snprintf(text, sizeof text, "%.10g\\%.10g\\%.10g", place[0], place[1], place[2]);
    put_text(file, 0x20, 0x32, "DS", text);
}

static void put_axes(FILE *file)
{
    char text[256];
    snprintf(text, sizeof text, "%g\\%g\\%g\\%g\\%g\\%g", along[0], along[1], along[2], down[0], down[1], down[2]);
    put_text(file, 0x20, 0x37, "DS", text);
}

static void put_sides(FILE *file)
{
    char text[256];
    snprintf(text, sizeof text, "%g\\%g", row_mm, column_mm);
    put_text(file, 0x28, 0x30, "DS", text);
}

static void put_scale(FILE *file, double intercept, double slope)
{
    char text[256];
    snprintf(text, sizeof text, "%g", intercept);
    put_text(file, 0x28, 0x1052, "DS", text);
    snprintf(text, sizeof text, "%g", slope);
    put_text(file, 0x28, 0x1053, "DS", text);
}

/* What frames share, and what each has, out of order. */
static void put_groups(FILE *file, const struct slice *slice)
{
    begin_item(file, 0x5200, 0x9229);
    begin_item(file, 0x20, 0x9116);
    put_axes(file);
    end_item(file, true);
    begin_item(file, 0x28, 0x9110);
    put_sides(file);
    end_item(file, true);
    end_item(file, true);
    begin_item(file, 0x5200, 0x9230);
    for (int f = 0; f < slice->frames; ++f) {
        const int k = (f * 5 + 2) % slice->frames;
        begin_item(file, 0x20, 0x9113);
        put_place(file, slice->step * k, 0.0);
        end_item(file, true);
        begin_item(file, 0x28, 0x9145);
        put_scale(file, 10.0 * k, 1.0 + k);
        end_item(file, true);
        end_item(file, f + 1 == slice->frames);
    }
}

static bool write_slice(const char *folder_path, const struct slice *slice)
{
    char path[512], text[256], instance[64];
    snprintf(path, sizeof path, "%s/%s", folder_path, slice->name);
    snprintf(instance, sizeof instance, "%s.%d", slice->series, (int)lround(100.0 * slice->at) + 1);
    FILE *file = fopen(path, "wb");
    if (!file) {
        return false;
    }
    put_meta(file, slice, instance);
    put_text(file, 8, 0x16, "UI", kind_of(slice));
    put_text(file, 8, 0x18, "UI", instance);
    put_text(file, 8, 0x60, "CS", "CT");
    put_text(file, 8, 0x103e, "LO", slice->description);
    put_text(file, 0x20, 0xd, "UI", "1.2.3");
    put_text(file, 0x20, 0xe, "UI", slice->series);
    snprintf(text, sizeof text, "%d", slice->number);
    put_text(file, 0x20, 0x11, "IS", text);
    if (!slice->grouped) {
        put_place(file, slice->at, slice->beside);
        put_axes(file);
    }
    put_number(file, 0x2, 1);
    put_text(file, 0x28, 4, "CS", "MONOCHROME2");
    if (slice->frames > 0) {
        snprintf(text, sizeof text, "%d", slice->frames);
        put_text(file, 0x28, 8, "IS", text);
    }
    put_number(file, 0x10, ROWS);
    put_number(file, 0x11, COLUMNS);
    if (!slice->grouped) {
        put_sides(file);
    }
    put_number(file, 0x100, 16);
    put_number(file, 0x101, 16);
    put_number(file, 0x102, 15);
    put_number(file, 0x103, 1);
    if (slice->grouped) {
        put_groups(file, slice);
    } else if (slice->dose) {
        put_text(file, 0x3004, 0xc, "DS", "0\\1.5\\3\\4.5");
        put_text(file, 0x3004, 0xe, "DS", "2");
    } else {
        put_scale(file, slice->intercept, slice->slope);
    }
    put_voxels(file, slice);
    return fclose(file) == 0;
}

/* A series with slices at 0, 2, 4, ... mm, whose files are out of order; `change` may be NULL. */
static bool write_series(const char *folder_path, struct slice like, void (*change)(int k, struct slice *))
{
    bool good = true;
    for (int k = 0; k < SLICES; ++k) {
        char name[64];
        snprintf(name, sizeof name, "%s_%d", like.series, (k * 5 + 2) % SLICES);
        like.name = name;
        like.at = 2.0 * k;
        struct slice slice = like;
        if (change) {
            change(k, &slice);
        }
        good = good && (slice.slope == 0.0 || write_slice(folder_path, &slice));
    }
    return good;
}

static const struct slice usual = {.series = "1.2.3.1", .description = "thick", .number = 3, .syntax = EXPLICIT_LITTLE, .slope = 2.0,
                                   .intercept = -1024.0};

/* Returns the path of an empty folder, NULL: there is none. */
static const char *new_folder(const char *name)
{
    const char *path = scratch(name);
    return mkdir(path, 0700) == 0 ? path : NULL;
}

/* ---- tests ---- */

/* Every voxel has its value and its place; the axes of DICOM point left and back. */
static greatest_test_res is_the_series(const struct volume *v, double slope, double intercept)
{
    ASSERT_EQ(COLUMNS, v->dims[0]);
    ASSERT_EQ(ROWS, v->dims[1]);
    ASSERT_EQ(SLICES, v->dims[2]);
    for (size_t n = 0; n < volume_voxels(v); ++n) {
        int at[3];
        volume_place(v->dims, n, at);
        ASSERT_IN_RANGE((float)(slope * stored(at[0], at[1], 2.0 * at[2]) + intercept), v->data[n], 1e-3f);
        for (int r = 0; r < 3; ++r) {
            const double lps = first_mm[r] + at[0] * column_mm * along[r] + at[1] * row_mm * down[r] + 2.0 * at[2] * normal[r];
            const double ras = v->affine[r][3] + v->affine[r][0] * at[0] + v->affine[r][1] * at[1] + v->affine[r][2] * at[2];
            ASSERT_IN_RANGE(r < 2 ? -lps : lps, ras, 1e-6);
        }
    }
    PASS();
}

TEST slices_find_their_order_places_and_values(void)
{
    struct volume v;
    for (int syntax = EXPLICIT_LITTLE; syntax <= RLE; ++syntax) {
        const char *path = new_folder(syntax == RLE ? "packed" : "plain");
        struct slice like = usual;
        like.syntax = syntax;
        ASSERT(path && write_series(path, like, NULL));
        ASSERTm(error, volume_read(path, 0, &v, error));
        ASSERT_STR_EQ("", v.warning);
        ASSERT_STR_EQ(".nii.gz", v.extension);
        CHECK_CALL(is_the_series(&v, 2.0, -1024.0));
        volume_free(&v);
    }
    PASS();
}

static void leave_one_out(int k, struct slice *slice) { slice->slope = k == 3 ? 0.0 : slice->slope; }

static void shift_one(int k, struct slice *slice) { slice->at += k == 3 ? 0.1 : 0.0; }

static void move_one_beside(int k, struct slice *slice) { slice->beside = k == 3 ? 0.5 : 0.0; }

static void double_one(int k, struct slice *slice) { slice->at = k == 3 ? 4.0 : slice->at; }

TEST gaps_are_named(void)
{
    struct volume v;
    const char *path = new_folder("gap");
    ASSERT(path && write_series(path, usual, leave_one_out));
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "slices are missing") && strstr(error, "4 mm apart, others 2 mm"));
    path = new_folder("twice");
    ASSERT(path && write_series(path, usual, double_one));
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "lie at one place"));
    path = new_folder("beside");
    ASSERT(path && write_series(path, usual, move_one_beside));
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "lies 0.5 mm off the line"));
    path = new_folder("uneven");
    ASSERT(path && write_series(path, usual, shift_one));
    ASSERTm(error, volume_read(path, 0, &v, error));
    ASSERTm(v.warning, strstr(v.warning, "distances of the slices differ"));
    volume_free(&v);
    PASS();
}

TEST one_of_two_series_is_chosen(void)
{
    struct volume v;
    const char *path = new_folder("two");
    struct slice other = usual;
    other.series = "1.2.3.2";
    other.description = "thin";
    other.number = 12;
    other.slope = 1.0;
    other.intercept = 0.0;
    ASSERT(path && write_series(path, usual, NULL) && write_series(path, other, NULL));
    volume_choose_series(NULL, "--series");
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "2 series in one folder: 3 (thick), 12 (thin): choose one with --series"));
    const char *const right[] = {"12", "thin", "1.2.3.2"};
    for (int k = 0; k < 3; ++k) {
        volume_choose_series(right[k], "--series");
        ASSERTm(error, volume_read(path, 0, &v, error));
        CHECK_CALL(is_the_series(&v, 1.0, 0.0));
        volume_free(&v);
    }
    volume_choose_series("4", "--series");
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "there is no series 4; there are 3 (thick), 12 (thin)"));
    char file[512];
    snprintf(file, sizeof file, "%s/1.2.3.2_0", path);
    ASSERT(!volume_read(file, 0, &v, error));
    ASSERTm(error, strstr(error, "--series is for folders of DICOM files"));
    volume_choose_series(NULL, NULL);
    PASS();
}

TEST damaged_files_are_named(void)
{
    struct volume v;
    const char *path = new_folder("cut");
    ASSERT(path && write_series(path, usual, NULL));
    char file[512];
    snprintf(file, sizeof file, "%s/1.2.3.1_0", path);
    ASSERT(!volume_read(file, 0, &v, error));
    ASSERTm(error, strstr(error, "one file of a DICOM series: give the folder"));
    struct stat info;
    ASSERT(stat(file, &info) == 0 && truncate(file, info.st_size - 20) == 0);
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "1.2.3.1_0: damaged"));
    for (long size = (long)info.st_size + 3; size >= 0; --size) { /* odd bytes behind the voxels are nothing that GDCM reads */
        ASSERT_EQ(0, truncate(file, size));
        if (size == (long)info.st_size) {
            continue;
        }
        ASSERT(!volume_read(path, 0, &v, error));
        ASSERTm(error, strstr(error, size > 0 && size < 132 ? "slices are missing" : "1.2.3.1_0: damaged")); /* "DICM" is at 128 */
    }
    PASS();
}

TEST films_are_no_volumes(void)
{
    struct volume v;
    const char *path = new_folder("film");
    struct slice film = usual;
    film.name = "cine";
    film.frames = 4;
    ASSERT(path && write_slice(path, &film));
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "cine: frames without places: a film?"));
    path = new_folder("perfusion");
    film.grouped = true;
    ASSERT(path && write_slice(path, &film));
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "lie at one place"));
    PASS();
}

TEST planes_of_a_dose_are_a_volume(void)
{
    struct volume v;
    const char *path = new_folder("dose");
    struct slice dose = usual;
    dose.name = "dose";
    dose.frames = 4;
    dose.dose = true;
    ASSERT(path && write_slice(path, &dose));
    ASSERTm(error, volume_read(path, 0, &v, error));
    ASSERT_EQ(4, v.dims[2]);
    ASSERT_IN_RANGE(1.5, (double)v.spacing[2], 1e-6);
    ASSERT_IN_RANGE(2.0 * stored(3, 2, 0.0), (double)v.data[3 + COLUMNS * (2 + ROWS)], 1e-3);
    volume_free(&v);
    PASS();
}

/* Frames out of order, with values of their own. */
TEST frames_find_their_order_places_and_values(void)
{
    struct volume v;
    const char *path = new_folder("frames");
    struct slice frames = usual;
    frames.name = "all";
    frames.frames = 4;
    frames.grouped = true;
    frames.step = 1.5;
    ASSERT(path && write_slice(path, &frames));
    ASSERTm(error, volume_read(path, 0, &v, error));
    ASSERT_STR_EQ("", v.warning);
    ASSERT_EQ(4, v.dims[2]);
    for (size_t n = 0; n < volume_voxels(&v); ++n) {
        int at[3];
        volume_place(v.dims, n, at);
        ASSERT_IN_RANGE((1.0 + at[2]) * stored(at[0], at[1], 0.0) + 10.0 * at[2], (double)v.data[n], 1e-3);
    }
    for (int r = 0; r < 3; ++r) {
        ASSERT_IN_RANGE((r < 2 ? -1.5 : 1.5) * normal[r], v.affine[r][2], 1e-6);
        ASSERT_IN_RANGE((r < 2 ? -1.0 : 1.0) * first_mm[r], v.affine[r][3], 1e-6);
        ASSERT_IN_RANGE((r < 2 ? -column_mm : column_mm) * along[r], v.affine[r][0], 1e-6);
        ASSERT_IN_RANGE((r < 2 ? -row_mm : row_mm) * down[r], v.affine[r][1], 1e-6);
    }
    volume_free(&v);
    PASS();
}

/* Wherever a file ends, there is an error: of runs, or of frames and their places. */
TEST files_of_other_forms_are_never_whole_when_cut(void)
{
    for (int form = 0; form < 2; ++form) {
        struct volume v;
        struct stat info;
        char file[512];
        const char *path = new_folder(form ? "cut frames" : "cut runs");
        struct slice slice = usual;
        slice.name = "one";
        slice.syntax = form ? EXPLICIT_LITTLE : RLE;
        slice.frames = form ? 3 : 0;
        slice.grouped = form;
        slice.step = 1.0;
        ASSERT(path && write_slice(path, &slice));
        snprintf(file, sizeof file, "%s/one", path);
        ASSERT_EQ(0, stat(file, &info));
        for (long size = (long)info.st_size - 1; size >= 0; --size) {
            ASSERT_EQ(0, truncate(file, size));
            ASSERT(!volume_read(path, 0, &v, error));
        }
    }
    PASS();
}

TEST where_gdcm_is_missing_a_line_says_what_helps(void)
{
    struct volume v;
    const char *path = new_folder("plain");
    ASSERT(path);
    ASSERT(!volume_read(path, 0, &v, error));
    ASSERTm(error, strstr(error, "dcm2niix"));
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) {
        return EXIT_FAILURE;
    }
    if (volume_has_dicom()) {
        RUN_TEST(slices_find_their_order_places_and_values);
        RUN_TEST(gaps_are_named);
        RUN_TEST(one_of_two_series_is_chosen);
        RUN_TEST(damaged_files_are_named);
        RUN_TEST(files_of_other_forms_are_never_whole_when_cut);
        RUN_TEST(films_are_no_volumes);
        RUN_TEST(planes_of_a_dose_are_a_volume);
        RUN_TEST(frames_find_their_order_places_and_values);
    } else {
        RUN_TEST(where_gdcm_is_missing_a_line_says_what_helps);
    }
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
