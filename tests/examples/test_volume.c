/* Volumes in three formats: places to the micrometre, frames, what is written, and files that are broken. Compiled like
 * test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_volume_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_volume_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "../../examples/common/imaging/volume.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>

static char folder[] = "/tmp/springls_volume_XXXXXX";
static char error[VOLUME_TEXT];

static const char *in_folder(const char *name)
{
    static char path[4][256];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

/* A header as text, and after it bytes. */
static const char *make_file(const char *name, const char *header, const void *bytes, size_t count)
{
    const char *path = in_folder(name);
    FILE *file = fopen(path, "wb");
    if (file) {
        fputs(header, file);
        fwrite(bytes, 1, count, file);
        fclose(file);
    }
    return path;
}

enum { NX = 4, NY = 3, NZ = 2, COUNT = NX * NY * NZ };

static greatest_test_res holds_ramp(const struct volume *v, float first, float step)
{
    ASSERT_EQ(NX, v->dims[0]);
    ASSERT_EQ(NY, v->dims[1]);
    ASSERT_EQ(NZ, v->dims[2]);
    for (int n = 0; n < COUNT; ++n) ASSERT_EQ(first + step * (float)n, v->data[n]);
    PASS();
}

static greatest_test_res lies_at(const struct volume *v, float i, float j, float k, float x, float y, float z)
{
    const float index[3] = {i, j, k}, expected[3] = {x, y, z};
    float world[3];
    volume_index_to_world(v, index, world);
    for (int a = 0; a < 3; ++a) ASSERT_IN_RANGE(expected[a], world[a], 1e-4f);
    PASS();
}

static size_t gzip(const void *bytes, size_t count, int window_bits, unsigned char *packed, size_t room)
{
    z_stream z;
    memset(&z, 0, sizeof z);
    if (deflateInit2(&z, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY) != Z_OK) return 0;
    unsigned char *copy = malloc(count); /* zlib's pointer is not const */
    if (!copy) return 0;
    memcpy(copy, bytes, count);
    z.next_in = copy;
    z.avail_in = (unsigned)count;
    z.next_out = packed;
    z.avail_out = (unsigned)room;
    deflate(&z, Z_FINISH);
    free(copy);
    deflateEnd(&z);
    return z.total_out;
}

/* ---- hand-made files: the values below were worked out from the formats' definitions ---- */

/* Columns of the directions: x of the file runs along +y of its space, y along -x, z up; the space is LPS. */
#define NRRD_PLACE "space: left-posterior-superior\nspace directions: (0,1.5,0) (-2,0,0) (0,0,4)\nspace origin: (10,20,30)\n"
#define META_PLACE "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 1.5 2 4\n"

static greatest_test_res is_the_ramp(const char *path)
{
    struct volume v;
    ASSERTm(error, volume_read(path, 0, &v, error));
    CHECK_CALL(holds_ramp(&v, 100.0f, 3.0f));
    CHECK_CALL(lies_at(&v, 0, 0, 0, -10, -20, 30));
    CHECK_CALL(lies_at(&v, 1, 0, 0, -10, -21.5f, 30));
    CHECK_CALL(lies_at(&v, 0, 1, 0, -8, -20, 30));
    CHECK_CALL(lies_at(&v, 3, 2, 1, -6, -24.5f, 34));
    ASSERT_EQ(1, v.frame_count);
    ASSERT_EQ(100.0f, v.minimum);
    ASSERT_EQ(100.0f + 3.0f * (COUNT - 1), v.maximum);
    volume_free(&v);
    ASSERT_FALSE(volume_read(path, 1, &v, error));
    PASS();
}

TEST attached_and_detached_raw_and_compressed(void)
{
    int16_t ramp[COUNT];
    unsigned char big[2 * COUNT], packed[1024];
    for (int n = 0; n < COUNT; ++n) {
        ramp[n] = (int16_t)(100 + 3 * n);
        big[2 * n] = (unsigned char)(ramp[n] >> 8);
        big[2 * n + 1] = (unsigned char)(ramp[n] & 255);
    }
    const char *const nrrd = "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\n" NRRD_PLACE;
    const char *const meta = "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n" META_PLACE;
    char header[1024];

    snprintf(header, sizeof header, "%sendian: little\nencoding: raw\n\n", nrrd);
    CHECK_CALL(is_the_ramp(make_file("raw.nrrd", header, ramp, sizeof ramp)));
    snprintf(header, sizeof header, "%sendian: big\nencoding: raw\n\n", nrrd);
    CHECK_CALL(is_the_ramp(make_file("big.nrrd", header, big, sizeof big)));
    size_t size = gzip(ramp, sizeof ramp, 31, packed, sizeof packed);
    snprintf(header, sizeof header, "%sendian: little\nencoding: gzip\n\n", nrrd);
    CHECK_CALL(is_the_ramp(make_file("packed.nrrd", header, packed, size)));
    make_file("voxels.raw.gz", "", packed, size);
    snprintf(header, sizeof header, "%sendian: little\nencoding: gzip\ndata file: voxels.raw.gz\n", nrrd);
    CHECK_CALL(is_the_ramp(make_file("packed.nhdr", header, "", 0)));
    make_file("voxels.raw", "skip", ramp, sizeof ramp);
    snprintf(header, sizeof header, "%sendian: little\nencoding: raw\nbyte skip: 4\ndata file: ./voxels.raw\n", nrrd);
    CHECK_CALL(is_the_ramp(make_file("raw.nhdr", header, "", 0)));

    snprintf(header, sizeof header, "%sElementDataFile = LOCAL\n", meta);
    CHECK_CALL(is_the_ramp(make_file("raw.mha", header, ramp, sizeof ramp)));
    snprintf(header, sizeof header, "%sBinaryDataByteOrderMSB = True\nElementDataFile = LOCAL\n", meta);
    CHECK_CALL(is_the_ramp(make_file("big.mha", header, big, sizeof big)));
    snprintf(header, sizeof header, "%sHeaderSize = -1\nElementDataFile = voxels.raw\n", meta);
    CHECK_CALL(is_the_ramp(make_file("raw.mhd", header, "", 0)));
    size = gzip(ramp, sizeof ramp, 15, packed, sizeof packed);
    snprintf(header, sizeof header, "%sCompressedData = True\r\nElementDataFile = LOCAL\n", meta);
    CHECK_CALL(is_the_ramp(make_file("packed.mha", header, packed, size)));
    make_file("voxels.zraw", "", packed, size);
    snprintf(header, sizeof header, "%sCompressedData = True\nElementDataFile = voxels.zraw\n", meta);
    CHECK_CALL(is_the_ramp(make_file("packed.mhd", header, "", 0)));
    PASS();
}

TEST a_folder_is_called_a_folder(void)
{
    struct volume v;
    ASSERT(!volume_read(folder, 0, &v, error));
    ASSERT(strstr(error, "a folder, not an image") != NULL);
    PASS();
}

/* A vector a voxel, and two times: each part of each is a frame. */
TEST channels_and_times_are_frames(void)
{
    float values[2 * COUNT * 2];
    struct volume v;
    for (int t = 0; t < 2; ++t)
        for (int n = 0; n < COUNT; ++n)
            for (int c = 0; c < 2; ++c) values[(t * COUNT + n) * 2 + c] = (float)(1000 * t + 100 * c + n);
    const char *paths[2];
    paths[0] = make_file("frames.nrrd", "NRRD0004\ntype: float\ndimension: 5\nspace: right-anterior-superior\nsizes: 2 4 3 2 2\n"
                         "space directions: none (1,0,0) (0,1,0) (0,0,1) none\nkinds: vector domain domain domain time\n"
                         "space units: \"cm\" \"cm\" \"cm\"\nendian: little\nencoding: raw\n\n", values, sizeof values);
    paths[1] = make_file("frames.mha", "ObjectType = Image\nNDims = 4\nDimSize = 4 3 2 2\nElementNumberOfChannels = 2\n"
                         "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n", values, sizeof values);
    for (int p = 0; p < 2; ++p) {
        for (int f = 0; f < 4; ++f) { /* the faster one first */
            ASSERTm(error, volume_read(paths[p], f, &v, error));
            ASSERT_EQ(4, v.frame_count);
            ASSERT_EQ(5, v.dimension);
            CHECK_CALL(holds_ramp(&v, (float)(1000 * (f / 2) + 100 * (f % 2)), 1.0f));
            if (p == 0) CHECK_CALL(lies_at(&v, 1, 1, 1, 10, 10, 10));
            volume_free(&v);
        }
        ASSERT_FALSE(volume_read(paths[p], 4, &v, error));
    }
    PASS();
}

/* Several images in one file are chosen from, never the first taken by itself; a file that goes with an image may have one. */
TEST frames_are_chosen(void)
{
    static const float values[6 * COUNT];
    static const char header[] = "ObjectType = Image\nNDims = %d\nDimSize = 4 3 2 %s\nElementNumberOfChannels = %d\n"
                                 "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
    static const struct {
        const char *name, *sizes, *dimension;
        int axes, channels;
    } files[] = {{"one.mha", "1", NULL, 4, 1}, {"four.mha", "2", "4-D", 4, 1}, {"five.mha", "3", "5-D", 4, 2},
                 {"vectors.mha", "1", "5-D", 4, 3}};
    char text[200];
    struct volume v;
    for (size_t f = 0; f < sizeof files / sizeof *files; ++f) {
        const bool one = !files[f].dimension;
        snprintf(text, sizeof text, header, files[f].axes, files[f].sizes, files[f].channels);
        const char *path = make_file(files[f].name, text, values, sizeof values);
        for (int frame = -1; frame < 2; ++frame) {
            ASSERT_EQ(one ? frame < 1 : frame >= 0, volume_read_one(path, frame, "--frame", &v, error));
            ASSERT(frame >= 0 || one || (strstr(error, files[f].dimension) && strstr(error, "--frame")));
            volume_free(&v);
            ASSERT_EQ(one || frame >= 0, volume_read_companion(path, frame, &v, error));
            ASSERT(frame >= 0 || one || strstr(error, "where one is needed"));
            volume_free(&v);
        }
    }
    PASS();
}

TEST written_files_come_back(void)
{
    static const char *const names[] = {"out.nii.gz", "out.nrrd", "out.mha"};
    const int dims[3] = {NX, NY, NZ};
    const float spacing[3] = {0.7f, 1.3f, 2.9f}, origin[3] = {-12.25f, 7.5f, 101.0f};
    struct volume made, turned, back;
    uint8_t labels[COUNT];
    ASSERT(volume_create(dims, spacing, origin, &turned));
    turned.affine[0][0] = 0.42, turned.affine[0][1] = -1.04; /* turned about z by atan(0.8 / 0.6), z mirrored */
    turned.affine[1][0] = 0.56, turned.affine[1][1] = 0.78;
    turned.affine[2][2] = -2.9;
    ASSERT(volume_create_padded(&turned, 0, &made)); /* takes origin and direction from the affine */
    volume_free(&turned);
    for (int n = 0; n < COUNT; ++n) {
        made.data[n] = 0.25f * (float)n - 1.0f;
        labels[n] = (uint8_t)(n % 7);
    }
    for (int f = 0; f < 3; ++f) {
        ASSERTm(error, volume_write(in_folder(names[f]), &made, VOLUME_FLOAT32, made.data, error));
        ASSERTm(error, volume_read(in_folder(names[f]), 0, &back, error));
        ASSERT(volume_same_grid(&made, &back));
        CHECK_CALL(holds_ramp(&back, -1.0f, 0.25f));
        ASSERT(strstr(names[f], back.extension) != NULL);
        for (int g = 0; g < 3; ++g) { /* labels in the geometry of a file that was read */
            struct volume again;
            ASSERTm(error, volume_write(in_folder(names[g]), &back, VOLUME_UINT8, labels, error));
            ASSERTm(error, volume_read(in_folder(names[g]), 0, &again, error));
            ASSERT(volume_same_grid(&back, &again));
            for (int n = 0; n < COUNT; ++n) ASSERT_EQ((float)labels[n], again.data[n]);
            volume_free(&again);
        }
        volume_free(&back);
        ASSERT_FALSE(volume_write(f == 1 ? "/nowhere/at/all.nrrd" : "/nowhere/at/all.mha", &made, VOLUME_UINT8, labels, error));
        ASSERT(error[0] && !strchr(error, '\n'));
    }
    volume_free(&made);
    PASS();
}

/* ---- broken ones ---- */

/* Labels in the voxels of an image, stored along axes that are exchanged and turned around, or beside them by less than a tenth of a
 * voxel, are those of the image; other grids are refused with what differs. */
TEST labels_are_laid_on_the_grid_of_their_image(void)
{
    const int dims[3] = {NX, NY, NZ}, other[3] = {NZ, NX, NY};
    const float spacing[3] = {0.7f, 1.3f, 2.9f}, exchanged[3] = {2.9f, 0.7f, 1.3f}, origin[3] = {-12.25f, 7.5f, 101.0f};
    struct volume image, stored, laid;
    uint32_t ids[COUNT];
    ASSERT(volume_create(dims, spacing, origin, &image));
    ASSERT(volume_create(other, exchanged, origin, &stored));
    memset(stored.affine, 0, sizeof stored.affine);
    stored.affine[2][0] = -2.9, stored.affine[0][1] = 0.7, stored.affine[1][2] = -1.3, stored.affine[3][3] = 1.0;
    stored.affine[0][3] = (double)origin[0];
    stored.affine[1][3] = (double)origin[1] + 1.3 * (NY - 1);
    stored.affine[2][3] = (double)origin[2] + 2.9 * (NZ - 1);
    for (int n = 0; n < COUNT; ++n) {
        const int k = NZ - 1 - n % NZ, i = n / NZ % NX, j = NY - 1 - n / (NZ * NX);
        ids[n] = 4000000000u + (uint32_t)(i + NX * (j + NY * k));
    }
    ASSERTm(error, volume_write(in_folder("turned.nii.gz"), &stored, VOLUME_UINT32, ids, error));
    ASSERTm(error, volume_read_like(&image, "the image", in_folder("turned.nii.gz"), -1, &laid, error));
    ASSERT(volume_same_grid(&image, &laid));
    for (uint32_t n = 0; n < COUNT; ++n) ASSERT_EQ(4000000000u + n, laid.ids[n]);
    ASSERTm(laid.warning, strstr(laid.warning, "another orientation than the image"));
    volume_free(&laid);
    volume_free(&stored);
    const struct {
        float shift;
        const char *note;
    } cases[] = {{0.01f, "up to 0.01 mm beside the grid of the image"},
                 {0.3f, "not on the grid of the image: its first voxel lies at -11.95,"}};
    for (int c = 0; c < 2; ++c) {
        ASSERT(volume_create(dims, spacing, (const float[3]){origin[0] + cases[c].shift, origin[1], origin[2]}, &stored));
        ASSERTm(error, volume_write(in_folder("beside.nii"), &stored, VOLUME_UINT32, ids, error));
        ASSERT_EQ(c == 0, volume_read_like(&image, "the image", in_folder("beside.nii"), -1, &laid, error));
        ASSERTm(c == 0 ? laid.warning : error, strstr(c == 0 ? laid.warning : error, cases[c].note));
        volume_free(&laid);
        volume_free(&stored);
    }
    ASSERT(volume_create(other, exchanged, origin, &stored));
    ASSERTm(error, volume_write(in_folder("other.nii"), &stored, VOLUME_UINT32, ids, error));
    ASSERT_FALSE(volume_read_like(&image, "the image", in_folder("other.nii"), -1, &laid, error));
    ASSERTm(error, strstr(error, "voxels, not"));
    volume_free(&stored);
    volume_free(&image);
    PASS();
}

TEST damaged_packed_data_are_noticed(void)
{
    uint8_t bytes[COUNT] = {1, 2, 3, 4, 5};
    unsigned char packed[1024];
    struct volume v;
    const char *const nrrd = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 3 2\nencoding: gzip\n\n";
    const char *const meta =
        "NDims = 3\nDimSize = 4 3 2\nElementType = MET_UCHAR\nCompressedData = True\nElementDataFile = LOCAL\n";
    for (int format = 0; format < 2; ++format) {
        const size_t size = gzip(bytes, sizeof bytes, format == 0 ? 31 : 15, packed, sizeof packed);
        const char *name = format == 0 ? "hurt.nrrd" : "hurt.mha", *header = format == 0 ? nrrd : meta;
        ASSERTm(error, volume_read(make_file(name, header, packed, size), 0, &v, error));
        volume_free(&v);
        for (size_t cut = 0; cut < size; ++cut) ASSERT_FALSE(volume_read(make_file(name, header, packed, cut), 0, &v, error));
        packed[size - (format == 0 ? 5 : 1)] ^= 1; /* the checksum's last byte */
        ASSERT_FALSE(volume_read(make_file(name, header, packed, size), 0, &v, error));
        const size_t short_size = gzip(bytes, sizeof bytes - 1, format == 0 ? 31 : 15, packed, sizeof packed);
        ASSERT_FALSE(volume_read(make_file(name, header, packed, short_size), 0, &v, error));
    }
    PASS();
}

TEST bad_headers_end_in_one_line(void)
{
    static const char *const headers[] = {
        ("NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nspace: left-posterior-superior\n"
         "space directions: (1,0,0) (1,0,0) (0,0,1)\nencoding: raw\n\n"),
        "NRRD0004\ntype: block\nblock size: 2\ndimension: 3\nsizes: 4 3 2\nencoding: raw\n\n",
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\nencoding: raw\ndata file: nothing.raw\n",
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 60000 60000 60000\nencoding: raw\n\n",
        "NRRD0004\n\n", "NRRD", "NRRD0004\ntype: short\ndimension: 99\nsizes: 1\nencoding: raw\n\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 -2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_FISH\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\n",
        "NDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nElementSpacing = 0 1 1\nElementDataFile = LOCAL\n",
        "NDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nElementSpacing = nan 1 1\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nElementDataFile = nothing.raw\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nElementDataFile = LIST\na\nb\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nBinaryData = False\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nDimSize = 4 3 2\nNDims = 3\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 3\nDimSize = 60000 60000 60000\nElementType = MET_SHORT\nElementDataFile = LOCAL\n",
        "ObjectType = Image\nNDims = 99\n", "ObjectType\n",
        "NDims = 3\nDimSize = 4 3 2\nElementType = MET_SHORT\nHeaderSize = 1e9\nElementDataFile = LOCAL\n",
    };
    unsigned char voxels[2 * COUNT] = {0};
    for (size_t h = 0; h < sizeof headers / sizeof *headers; ++h) {
        struct volume v;
        error[0] = '\0';
        ASSERT_FALSEm(headers[h], volume_read(make_file("bad", headers[h], voxels, sizeof voxels), 0, &v, error));
        ASSERTm(headers[h], error[0] && !strchr(error, '\n') && v.data == NULL);
    }
    PASS();
}

/* Every file of the collection: those that have voxels in a known place are read, the others are refused. */
TEST collection_of_bad_files(void)
{
    static const char *const good =
        " anisotropic_1x1x6.nii.gz bitpix_mismatch.nii constant.nii.gz flipped_x.nii.gz float_nan_inf.nii.gz "
        "not_gz_named_gz.nii.gz ok.mha ok_big_endian.nii ok_gzip.nrrd ok_int16.nii ok_raw.nrrd ok_z.mha one_voxel_fg.nii.gz "
        "pixdim_nan.nii pixdim_zero_neg.nii scl_slope_nan.nii scl_slope_zero.nii sheared_affine.nii.gz single_slice.nii "
        "touches_border.nii.gz example4d.nii.gz example_nifti2.nii.gz functional.nii standard.nii.gz ";
    const char *data = getenv("SPRINGLS_DATA");
    char command[1024], path[1024], name[300];
    int read = 0, refused = 0;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(command, sizeof command, "ls -d '%s'/bad/volumes_generated/* '%s'/bad/nibabel/*", data, data);
    FILE *list = popen(command, "r");
    ASSERT(list != NULL);
    while (fgets(path, sizeof path, list)) {
        struct volume v;
        path[strcspn(path, "\n")] = '\0';
        snprintf(name, sizeof name, " %.290s ", strrchr(path, '/') + 1);
        error[0] = '\0';
        const bool was_read = volume_read(path, 0, &v, error);
        ASSERT_EQm(path, strstr(good, name) != NULL, was_read);
        ASSERTm(path, was_read || (error[0] && !strchr(error, '\n') && v.data == NULL));
        read += was_read;
        refused += !was_read;
        volume_free(&v);
    }
    pclose(list);
    ASSERT_EQ(24, read);
    ASSERT_EQ(33, refused);
    PASS();
}

/* The same label map in three formats; a tumour lies inside its brain; masks fit their images. */
TEST collection_fits_together(void)
{
    static const char *const same[] = {"ok_int16.nii", "ok_raw.nrrd", "ok_gzip.nrrd", "ok.mha", "ok_z.mha"};
    static const char *const pairs[][2] = {{"labels/brain1_image.nrrd", "labels/brain1_label.nrrd"},
                                           {"ct/ct_lung_elastix.mha", "labels/lung_elastix_baseline_mask.mha"},
                                           {"ct/ct_pelvis_TS.nii.gz", "labels/seg_pelvis_TS_104.nii.gz"}};
    const char *data = getenv("SPRINGLS_DATA");
    char path[1024];
    struct volume first, other;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    for (int f = 0; f < 5; ++f) {
        snprintf(path, sizeof path, "%s/bad/volumes_generated/%s", data, same[f]);
        ASSERTm(error, volume_read(path, 0, f == 0 ? &first : &other, error));
        if (f > 0) {
            ASSERT_MEM_EQ(first.data, other.data, volume_voxels(&first) * sizeof(float));
            volume_free(&other);
        }
    }
    volume_free(&first);
    for (int p = 0; p < 3; ++p) {
        snprintf(path, sizeof path, "%s/%s", data, pairs[p][0]);
        ASSERTm(error, volume_read(path, 0, &first, error));
        snprintf(path, sizeof path, "%s/%s", data, pairs[p][1]);
        ASSERTm(error, volume_read(path, 0, &other, error));
        ASSERT(volume_same_grid(&first, &other));
        volume_free(&first);
        volume_free(&other);
    }
    snprintf(path, sizeof path, "%s/ct/ct_head_vtk_quarter.mhd", data);
    ASSERTm(error, volume_read(path, 0, &first, error));
    ASSERT_EQ(64, first.dims[0]);
    ASSERT_EQ(93, first.dims[2]);
    ASSERT_EQ(3926.0f, first.maximum);
    CHECK_CALL(lies_at(&first, 1, 1, 1, -3.2f, -3.2f, 1.5f));
    volume_free(&first);
    PASS();
}

/* A label map has few whole numbers, in regions; a scan in its place is refused. */
TEST scans_are_no_labels(void)
{
    enum { SIDE = 24 };
    struct volume v;
    const int dims[3] = {SIDE, SIDE, SIDE};
    const float spacing[3] = {1, 1, 1}, origin[3] = {0, 0, 0};
    uint32_t random = 1;
    ASSERT(volume_create(dims, spacing, origin, &v));
    for (int kind = 0; kind < 5; ++kind) {
        for (int n = 0; n < SIDE * SIDE * SIDE; ++n) {
            random = random * 1664525u + 1013904223u;
            const float noise = (float)(random >> 22); /* 0 to 1023 */
            v.data[n] = kind == 0 ? (float)(n % SIDE > 9) * 3000.0f     /* one label */
                      : kind == 1 ? (float)(n / SIDE)                   /* 576 labels, in rows */
                      : kind == 2 ? floorf(noise / 32.0f)               /* 32 labels, at random */
                      : kind == 3 ? floorf(noise / 4.0f)                /* a scan of bytes */
                                  : noise / 1024.0f;                    /* a scan of fractions */
        }
        ASSERT_EQ(kind < 3, volume_check_labels(&v, "file.nii", error));
        ASSERT(kind < 3 || strstr(error, "file.nii: a label map is wanted"));
    }
    volume_free(&v);
    PASS();
}

/* Writes a NIfTI file of floats with these voxel sizes: by the sform, along x by pixdim, and moved along x by the qform. */
static const char *make_nifti(const char *name, float sform, float pixdim, float moved, bool pair)
{
    static const float values[COUNT];
    unsigned char bytes[352 + sizeof values];
    const int16_t dim[8] = {3, 4, 3, 2, 1, 1, 1, 1}, type = 16, bits = 32, code = 1;
    const int32_t size = 348;
    const float pixels[4] = {1.0f, pixdim, sform, sform}, offset = pair ? 0.0f : 352.0f;
    memset(bytes, 0, sizeof bytes);
    memcpy(bytes, &size, 4);
    memcpy(bytes + 40, dim, sizeof dim);
    memcpy(bytes + 70, &type, 2);
    memcpy(bytes + 72, &bits, 2);
    memcpy(bytes + 76, pixels, sizeof pixels);
    memcpy(bytes + 108, &offset, 4);
    bytes[123] = 2; /* mm */
    memcpy(bytes + 252, &code, 2);
    memcpy(bytes + 254, &code, 2);
    memcpy(bytes + 268, &moved, 4);
    for (int r = 0; r < 3; ++r) {
        memcpy(bytes + 280 + 20 * r, &sform, 4); /* the diagonal */
    }
    memcpy(bytes + 344, pair ? "ni1" : "n+1", 4);
    if (!pair) {
        return make_file(name, "", bytes, sizeof bytes);
    }
    char image[64];
    snprintf(image, sizeof image, "%.*s.img", (int)strlen(name) - 4, name);
    make_file(image, "", values, sizeof values);
    return make_file(name, "", bytes, 348);
}

/* A header that contradicts itself is warned of, as are numbers that are no millimetres. */
TEST nifti_geometry_is_compared(void)
{
    static const struct {
        float sform, pixdim, moved;
        const char *warning;
    } files[] = {{2.0f, 2.0f, 0.0f, ""}, {2.0f, 2.0f, 30.0f, "place a corner 30 mm apart"}, {2.0f, 2.5f, 0.0f, "by pixdim"},
                 {0.002f, 0.002f, 0.0f, "0.008 mm long"}};
    struct volume v;
    for (size_t f = 0; f < sizeof files / sizeof *files; ++f) {
        ASSERTm(error, volume_read(make_nifti("compared.nii", files[f].sform, files[f].pixdim, files[f].moved, false), 0, &v, error));
        ASSERTm(v.warning, files[f].warning[0] ? strstr(v.warning, files[f].warning) != NULL : v.warning[0] == '\0');
        ASSERT_EQ(files[f].sform, v.spacing[0]);
        volume_free(&v);
    }
    PASS();
}

/* A pair is read by either of its names. */
TEST nifti_pairs_have_two_names(void)
{
    char path[512];
    struct volume v;
    snprintf(path, sizeof path, "%s", make_nifti("two.hdr", 2.0f, 2.0f, 0.0f, true));
    ASSERTm(error, volume_read(path, 0, &v, error));
    volume_free(&v);
    memcpy(path + strlen(path) - 4, ".img", 4);
    ASSERTm(error, volume_read(path, 0, &v, error));
    ASSERT_EQ(4, v.dims[0]);
    volume_free(&v);
    ASSERT_EQ(0, remove(in_folder("two.hdr")));
    ASSERT_FALSE(volume_read(path, 0, &v, error));
    ASSERT(strstr(error, ".hdr file is missing") != NULL);
    PASS();
}

/* Units of length of a NRRD file by the spellings that are in use; a word that is not known is warned about. */
TEST nrrd_units_are_known(void)
{
    static const struct {
        const char *name;
        float mm;
    } units[] = {{"microns", 2e-3f}, {"micrometer", 2e-3f}, {"micrometers", 2e-3f}, {"um", 2e-3f}, {"nm", 2e-6f}, {"inch", 50.8f},
                 {"mm", 2.0f}, {"cubits", 2.0f}};
    char text[300];
    for (size_t u = 0; u < sizeof units / sizeof *units; ++u) {
        struct volume volume;
        snprintf(text, sizeof text, "NRRD0004\ntype: uchar\ndimension: 3\nspace dimension: 3\nsizes: 2 2 2\n"
                 "space directions: (2,0,0) (0,2,0) (0,0,2)\nspace units: \"%s\" \"%s\" \"%s\"\nencoding: raw\n\n",
                 units[u].name, units[u].name, units[u].name);
        const char *path = make_file("units.nrrd", text, "12345678", 8);
        ASSERTm(error, volume_read(path, 0, &volume, error));
        ASSERT(fabsf(volume.spacing[0] / units[u].mm - 1.0f) < 1e-5f);
        ASSERT((strstr(volume.warning, "not known") != NULL) == (strcmp(units[u].name, "cubits") == 0));
        volume_free(&volume);
    }
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!mkdtemp(folder)) return 1;
    RUN_TEST(attached_and_detached_raw_and_compressed);
    RUN_TEST(a_folder_is_called_a_folder);
    RUN_TEST(channels_and_times_are_frames);
    RUN_TEST(frames_are_chosen);
    RUN_TEST(written_files_come_back);
    RUN_TEST(labels_are_laid_on_the_grid_of_their_image);
    RUN_TEST(damaged_packed_data_are_noticed);
    RUN_TEST(bad_headers_end_in_one_line);
    RUN_TEST(collection_of_bad_files);
    RUN_TEST(collection_fits_together);
    RUN_TEST(nifti_geometry_is_compared);
    RUN_TEST(nifti_pairs_have_two_names);
    RUN_TEST(scans_are_no_labels);
    RUN_TEST(nrrd_units_are_known);
    char command[300];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) return 1;
    GREATEST_MAIN_END();
}

#endif
