/* prepare.c - prepare IN OUT.nii.gz [--voxel MM] [--mirror] [--labels] [--above L]: an image on coarser cubes, its mirror
 * image, a mask of it. What make imaging has of one head, where a pipeline wants two images. */
#include "../../examples/common/base/cli.h"
#include "../../examples/common/imaging/resample.h"
#include "../../examples/common/imaging/segment_image.h"

#include <math.h>
#include <stdio.h>

/* The nearest voxel's value: labels are not mixed. */
static void take_nearest(const struct volume *from, const struct volume *to, float *result)
{
    float map[3][4];
    size_t n = 0;
    resample_map(to, NULL, from, map);
    for (int k = 0; k < to->dims[2]; ++k) {
        for (int j = 0; j < to->dims[1]; ++j) {
            for (int i = 0; i < to->dims[0]; ++i, ++n) {
                size_t at = 0, stride = 1;
                float x[3];
                resample_place((const float(*)[4])map, i, j, k, x);
                for (int r = 0; r < 3; ++r) {
                    const float last = (float)(from->dims[r] - 1);
                    at += stride * (size_t)fmaxf(0.0f, fminf(last, floorf(x[r] + 0.5f)));
                    stride *= (size_t)from->dims[r];
                }
                result[n] = from->data[at];
            }
        }
    }
}

/* Left for right, in the same box: along the voxel axis that runs most nearly so. */
static void mirror(struct volume *volume)
{
    const int *dims = volume->dims;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]}, total = volume_voxels(volume);
    int axis = 0;
    for (int a = 1; a < 3; ++a) {
        axis = fabsf(volume->direction[0][a]) > fabsf(volume->direction[0][axis]) ? a : axis;
    }
    for (size_t n = 0; n < total; ++n) {
        const size_t place = n / strides[axis] % (size_t)dims[axis], other = (size_t)dims[axis] - 1 - place;
        if (place < other) {
            const size_t m = n + (other - place) * strides[axis];
            const float value = volume->data[n];
            volume->data[n] = volume->data[m];
            volume->data[m] = value;
        }
    }
}

int main(int argc, char **argv)
{
    const char *in = NULL, *out = NULL;
    bool mirrored = false, labels = false;
    double side = 0.0, above = (double)NAN;
    const struct cli_option options[] = {
        {"voxel", CLI_DOUBLE, &side, "MM", "cubes of this side; 0: as they are", 0, 1000, NULL},
        {"mirror", CLI_FLAG, &mirrored, NULL, "left for right", 0, 0, NULL},
        {"labels", CLI_FLAG, &labels, NULL, "a label map: values are not mixed", 0, 0, NULL},
        {"above", CLI_DOUBLE, &above, "L", "1 where the value is above L, else 0", 0, 0, NULL},
    };
    const struct cli_positional files[] = {{"IN", &in, "image", true}, {"OUT", &out, "image to write", true}};
    const struct cli_program program = {.name = "prepare", .summary = "images that make imaging wants", .options = options,
                                        .option_count = 4, .positionals = files, .positional_count = 2};
    const int status = cli_parse(&program, argc, argv);
    struct volume image, cubes;
    char error[VOLUME_TEXT];
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (!volume_read(in, 0, &image, error)) {
        return cli_fail("prepare", CLI_EXIT_FAILURE, "%s", error);
    }
    const float spacing = cbrtf(image.spacing[0] * image.spacing[1] * image.spacing[2]);
    bool good = side > 0.0 ? volume_create_cubes(&image, (float)side, 0, &cubes) : volume_create_padded(&image, 0, &cubes);
    if (good && labels) {
        take_nearest(&image, &cubes, cubes.data);
    } else if (good) {
        good = (float)side <= spacing || segment_blur(&image, (float)side, image.data);
        resample_volume(&image, image.data, NULL, &cubes, cubes.data, NULL);
    }
    for (size_t n = 0; good && !isnan(above) && n < volume_voxels(&cubes); ++n) {
        cubes.data[n] = (double)cubes.data[n] > above;
    }
    if (good && mirrored) {
        mirror(&cubes);
    }
    if (!good) {
        snprintf(error, sizeof error, "not enough memory");
    }
    good = good && volume_write(out, &cubes, VOLUME_FLOAT32, cubes.data, error);
    if (good) {
        printf("{\"program\": \"prepare\", \"size\": [%d, %d, %d]}\n", cubes.dims[0], cubes.dims[1], cubes.dims[2]);
    }
    volume_free(&image);
    volume_free(&cubes);
    return good ? CLI_EXIT_OK : cli_fail("prepare", CLI_EXIT_FAILURE, "%s", error);
}
