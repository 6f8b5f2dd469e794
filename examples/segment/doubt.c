/* doubt.c - does the result agree with its start? A region force, or a wrong level, may make the contour leave the object and take the
   air. */
#include "segment/segment.h"

#include "imaging/resample.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Returns true if the start was laid on the object by the user: by seeds, a mask, a mesh, or a shape at a place. */
static bool starts_at_object(const struct segment_settings *set)
{
    return set->seed_count > 0 || strcmp(set->init, "mask") == 0 || strcmp(set->init, "mesh") == 0 || !isnan(set->center[0]);
}

bool segment_look_at_start(struct segment *run)
{
    struct segment_result *result = run->result;
    const struct volume *grid = &run->grid;
    double sum = 0.0, number = 0.0;
    result->start_mean = (double)NAN;
    if (!(run->settings.region > 0.0) || !starts_at_object(&run->settings)) {
        return true;
    }
    if (!segment_check(run->ctx, springls_copy_level_set(run->ctx, run->grid.data), "level set")) {
        return false;
    }
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        int at[3];
        float place[3], index[3];
        volume_place(grid->dims, n, at);
        volume_index_to_world(grid, (const float[3]){(float)at[0], (float)at[1], (float)at[2]}, place);
        volume_world_to_index(&run->image, place, index);
        if (grid->data[n] < 0.0f && resample_in_box(run->image.dims, index)) {
            sum += (double)resample_at(run->image.dims, run->image.data, index);
            number += 1.0;
        }
    }
    result->start_mean = number > 0.0 ? sum / number : (double)NAN;
    return true;
}

static int seeds_inside(const struct segment *run)
{
    const int *dims = run->image.dims;
    int count = 0;
    for (int s = 0; s < run->settings.seed_count; ++s) {
        float at[3];
        int voxel[3];
        volume_world_to_index(&run->image, run->settings.seeds[s], at);
        for (int a = 0; a < 3; ++a) {
            voxel[a] = (int)fmaxf(0.0f, fminf((float)(dims[a] - 1), floorf(at[a] + 0.5f)));
        }
        count += run->inside[(size_t)voxel[0] + (size_t)dims[0] * ((size_t)voxel[1] + (size_t)dims[1] * (size_t)voxel[2])] != 0;
    }
    return count;
}

/* Returns the words that name the object where there are several. */
static const char *which_object(const struct segment *run, char words[32])
{
    words[0] = 0;
    if (run->settings.object_count > 1) {
        snprintf(words, 32, " label %lu:", (unsigned long)run->result->object->written);
    }
    return words;
}

bool segment_agrees_with_start(const struct segment *run)
{
    const double start = run->result->start_mean;
    double sums[2] = {0.0, 0.0}, numbers[2] = {0.0, 0.0};
    char label[32];
    if (run->settings.seed_count > 0 && seeds_inside(run) == 0) {
        return segment_fail("%.200s:%s not to be trusted: the object found has %.4g ml and contains no seed", run->settings.image,
                            which_object(run, label), run->result->measures.volume / 1000.0);
    }
    for (size_t n = 0; n < run->voxels; ++n) {
        const int side = run->inside[n] ? 1 : 0;
        sums[side] += (double)run->image.data[n];
        numbers[side] += 1.0;
    }
    const double outside = sums[0] / fmax(numbers[0], 1.0), inside = sums[1] / fmax(numbers[1], 1.0);
    if (numbers[0] < 1.0 || numbers[1] < 1.0 || !(fabs(start - inside) > fabs(start - outside))) {
        return true;
    }
    return segment_fail(
        "%.200s:%s not to be trusted: the object found has %.4g ml and a mean intensity of %.4g, and %.4g where the contour "
        "started, closer to the %.4g in the rest of the image",
        run->settings.image, which_object(run, label), run->result->measures.volume / 1000.0, inside, start, outside);
}
