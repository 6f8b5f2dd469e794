/* fuzz_files.c - the smaller files that programs take: points, landmarks of several frames, skeletons without a body, and pictures:
   read, or refused in a line. The first byte chooses the reader. */
#define _POSIX_C_SOURCE 200809L
#include "fuzz_file.h"
#include "../../examples/common/character/skeleton_template.h"
#include "../../examples/common/pictures/image.h"
#include "../../examples/common/registration/points.h"

/* Checks that every coordinate is finite. */
static void check_points(const float *points, size_t count)
{
    size_t i;
    FUZZ_CHECK(count > 0);
    for (i = 0; i < 3 * count; i++) FUZZ_CHECK(points[i] - points[i] == 0.0f);
}

static void read_points(const char *path)
{
    static float data[1] = { 0.0f };
    struct volume image;
    char error[VOLUME_TEXT] = "";
    float *points;
    size_t count;
    memset(&image, 0, sizeof image);
    image.data = data;
    image.dims[0] = image.dims[1] = image.dims[2] = 1;
    image.affine[0][0] = image.affine[1][1] = 2.0f;
    image.affine[2][2] = -3.0f;
    if (points_read(path, &image, &points, &count, error)) check_points(points, count);
    else fuzz_check_reason(error);
    free(points);
}

static void read_landmarks(const char *path)
{
    char error[VOLUME_TEXT] = "";
    float *points;
    size_t landmarks, frames;
    if (points_read_frames(path, &points, &landmarks, &frames, error)) check_points(points, landmarks * frames);
    else fuzz_check_reason(error);
    free(points);
}

static void read_skeleton(const char *path)
{
    char error[CHARACTER_TEXT] = "";
    struct skeleton_template skeleton;
    int i;
    if (!skeleton_template_read(path, &skeleton, error)) {
        fuzz_check_reason(error);
        return;
    }
    FUZZ_CHECK(skeleton.count >= 8 && skeleton.count <= TEMPLATE_JOINTS && skeleton.height > 0.0f);
    for (i = 0; i < skeleton.count; i++) FUZZ_CHECK(skeleton.joints[i].parent < i && skeleton.joints[i].mirror < skeleton.count);
}

static void read_picture(const char *path)
{
    struct image image;
    if (image_read_file(path, &image)) FUZZ_CHECK(image.width > 0 && image.height > 0);
    image_free(&image);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static void (*const readers[])(const char *) = { read_points, read_landmarks, read_skeleton, read_picture };
    char path[256];
    if (!size) return 0;
    fuzz_file_write(path, "", data + 1, size - 1);
    readers[data[0] % 4](path);
    unlink(path);
    return 0;
}
