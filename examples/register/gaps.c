/* gaps.c - what has no data in an image: voxels outside a mask, and padding such as the -2048 around a scanner's circle. */
#include "register/run.h"

#include "imaging/segment_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const double least_share = 0.002; /* of the voxels, for a value to count as padding */
static const float gap = 0.1f;           /* range of the other values by which padding lies below them */
static const float below_air = -1025.0f; /* no tissue of a CT has such a value */

static void find_extremes(struct volume *image)
{
    image->minimum = INFINITY;
    image->maximum = -INFINITY;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        if (isfinite(image->data[n])) {
            image->minimum = fminf(image->minimum, image->data[n]);
            image->maximum = fmaxf(image->maximum, image->data[n]);
        }
    }
}

/* Sets voxels of one value to NaN; returns their number. */
static size_t cut_out(struct volume *image, float value)
{
    size_t count = 0;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        if (image->data[n] == value) {
            image->data[n] = NAN;
            ++count;
        }
    }
    find_extremes(image);
    return count;
}

static void put_back(struct volume *image, float value, const float *copy)
{
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        image->data[n] = copy[n];
    }
    image->minimum = value;
}

/* Returns the mean of the voxels that have a neighbour along x or y without data. */
static float mean_beside_gaps(const struct volume *image, const float *copy, float value)
{
    const int *dims = image->dims;
    double sum = 0.0, number = 0.0;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        int place[3];
        size_t stride = 1;
        bool beside = false;
        volume_place(dims, n, place);
        for (int a = 0; a < 2; ++a, stride *= (size_t)dims[0]) {
            beside = beside || (place[a] > 0 && copy[n - stride] == value) || (place[a] + 1 < dims[a] && copy[n + stride] == value);
        }
        if (beside && isfinite(image->data[n])) {
            sum += (double)image->data[n];
            number += 1.0;
        }
    }
    return number > 0.0 ? (float)(sum / number) : INFINITY;
}

/* Padding is the one smallest value, far below all others, and either lower than a CT's air or beside the darkest of the others:
 * the ground of a brain without its skull is neither, and says where the brain ends. */
static bool is_padding(struct volume *image, const float *copy, float value, size_t count)
{
    const float low = segment_percentile(image, 0.005), high = segment_percentile(image, 0.995), range = high - low;
    if ((double)count < least_share * (double)volume_voxels(image) || !(range > 0.0f) || low - value < gap * range) {
        return false;
    }
    return (value < below_air && low < -700.0f) || mean_beside_gaps(image, copy, value) < low + 0.25f * range;
}

static bool drop_padding(const char *name, struct volume *image)
{
    const size_t total = volume_voxels(image);
    const float value = image->minimum;
    float *copy = malloc(total * sizeof *copy);
    if (!copy) {
        return register_no_memory();
    }
    for (size_t n = 0; n < total; ++n) {
        copy[n] = image->data[n];
    }
    const size_t count = cut_out(image, value);
    if (is_padding(image, copy, value, count)) {
        fprintf(stderr, "register: note: %.1f %% of the %s image are %g, below all other values: padding, taken for no data\n",
                100.0 * (double)count / (double)total, name, (double)value);
    } else {
        put_back(image, value, copy);
    }
    free(copy);
    return true;
}

static bool apply_mask(const struct run *run, bool of_moving, const char *path, struct volume *image)
{
    struct volume mask;
    size_t left = 0;
    if (!register_read_labels(run, of_moving, path, &mask)) {
        return false;
    }
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        image->data[n] = mask.data[n] > 0.0f ? image->data[n] : NAN;
        left += isfinite(image->data[n]) != 0;
    }
    volume_free(&mask);
    find_extremes(image);
    return left > 0 || register_fail("%s: no voxel of the image is in the mask", path);
}

bool register_drop_gaps(struct run *run)
{
    if (!drop_padding("fixed", &run->fixed) || !drop_padding("moving", &run->moving)) {
        return false;
    }
    return (!run->fixed_mask_path || apply_mask(run, false, run->fixed_mask_path, &run->fixed))
           && (!run->moving_mask_path || apply_mask(run, true, run->moving_mask_path, &run->moving));
}
