/* grid.c - the finest grid, and what a run leaves: islands removed, the result on the image's grid. */
#include "segment/segment.h"

#include "base/progress.h"
#include "base/threads.h"
#include "imaging/resample.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MIN_CELLS = 24 };

/* Bytes for each cell face between the inside and the outside of the window, measured on brains and bones of 0.9 to 100 million cells.
 * A start from the threshold has springls on all of them, also on those of noise. A contour from elsewhere has them on those of its
 * object, and curvature keeps it from folding around each voxel: at most so many bytes for each cell of the grid, measured on uniform
 * noise and on a chest. */
static const double face_bytes = 1100.0, reached = 0.5, reached_cell_bytes = 64.0;
static const double program = 10.0; /* MiB: the program itself, which counts in small images */

static float longest_side(const struct volume *image)
{
    const float *spacing = image->spacing;
    const int *dims = image->dims;
    return fmaxf(spacing[0] * (float)dims[0], fmaxf(spacing[1] * (float)dims[1], spacing[2] * (float)dims[2]));
}

struct faces_loop {
    const struct segment *run;
    const struct segment_result *result;
    double *areas; /* of each slice */
};

static bool is_inside(const struct faces_loop *loop, float value) { return value > loop->result->low && value < loop->result->high; }

static void run_faces_loop(void *arg, int begin, int end)
{
    const struct faces_loop *loop = arg;
    const struct volume *image = &loop->run->image;
    const int *dims = image->dims;
    const float *spacing = image->spacing, *data = image->data;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * strides[2], faces[3] = {0, 0, 0};
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const bool inside = is_inside(loop, data[n]);
                faces[0] += i > 0 && inside != is_inside(loop, data[n - strides[0]]);
                faces[1] += j > 0 && inside != is_inside(loop, data[n - strides[1]]);
                faces[2] += k > 0 && inside != is_inside(loop, data[n - strides[2]]);
            }
        }
        loop->areas[k] = 0.0;
        for (int a = 0; a < 3; ++a) {
            loop->areas[k] += (double)faces[a] * (double)(spacing[(a + 1) % 3] * spacing[(a + 2) % 3]);
        }
    }
}

/* Computes the area of the voxel faces between the inside and the outside of a window, mm^2; of the objects the largest. Returns 0 if
 * memory is short. */
static double window_area(const struct segment *run)
{
    double largest = 0.0, *areas = malloc((size_t)run->image.dims[2] * sizeof *areas);
    for (int o = 0; areas && o < run->settings.object_count; ++o) {
        struct faces_loop loop = {run, &run->results[o], areas};
        double sum = 0.0;
        threads_for(run->image.dims[2], 1, run_faces_loop, &loop);
        for (int k = 0; k < run->image.dims[2]; ++k) {
            sum += areas[k];
        }
        largest = fmax(largest, sum);
    }
    free(areas);
    return largest;
}

/* Returns what is there already: the program and the image, MiB. */
static double memory_here(const struct segment *run) { return program + (double)run->voxels * sizeof(float) / (1024.0 * 1024.0); }

/* Estimates the memory that a run on cells of this side takes in all, MiB. area: by window_area. */
static double memory_for(const struct segment *run, double area, double side)
{
    const struct segment_settings *set = &run->settings;
    double cells = 1.0;
    for (int a = 0; a < 3; ++a) {
        cells *= ceil((double)run->image.spacing[a] * run->image.dims[a] / side) + 6.0;
    }
    const double arrays = 2.0 + (set->region > 0.0 ? 2.0 : set->edge > 0.0 ? 1.0 : 0.0) + (set->stay > 0.0 ? 2.0 : 0.0)
                        + (set->gvf > 0.0 ? 6.0 : 0.0) + (set->object_count > 1 ? 2.0 : 0.0) + (set->reference ? 2.0 : 0.0);
    const double faces = face_bytes * area / (side * side);
    const double springls = strcmp(set->init, "threshold") == 0 ? faces : fmin(reached * faces, reached_cell_bytes * cells);
    return memory_here(run) + (arrays * sizeof(float) * (double)run->voxels + sizeof(float) * cells + springls) / (1024.0 * 1024.0);
}

void segment_choose_side(struct segment *run)
{
    const float *spacing = run->image.spacing;
    const int grid = run->settings.common.grid;
    const double own = cbrt((double)(spacing[0] * spacing[1] * spacing[2])), there_is = free_memory_mib(), area = window_area(run);
    double side = grid > 0 ? (double)longest_side(&run->image) / grid : own;
    const double most = (double)longest_side(&run->image) / (2.0 * MIN_CELLS);
    while (grid == 0 && there_is > 0.0 && memory_for(run, area, side) > memory_here(run) + there_is && side < most) {
        side *= 1.25;
    }
    run->side = (float)side;
    if (cli_may_print(&run->settings.common)) {
        if (side > own && grid == 0) {
            printf("note: cells of the image's %.3g mm would take about %.0f MiB in all, and %.0f are free: --grid decides otherwise\n",
                   own, memory_for(run, area, own), there_is);
        }
        printf("grid: cells of %.3g mm, %.0f along the longest side; about %.0f MiB\n", side,
               (double)longest_side(&run->image) / side, memory_for(run, area, side));
    }
}

/* Returns the number of grids, each half as fine as the next; a start at the object needs no coarser ones. */
int segment_choose_levels(const struct segment *run)
{
    const float cells = longest_side(&run->image) / run->side;
    int levels = 1;
    if (run->settings.levels > 0 || !segment_starts_far(run)) {
        return run->settings.levels > 0 ? run->settings.levels : 1;
    }
    while (levels < SEGMENT_MAX_LEVELS && ldexpf(cells, -levels) >= (float)MIN_CELLS) {
        levels++;
    }
    return levels;
}

/* ---- the end ---- */

/* Removes parts that --min-volume and --keep-largest exclude, without them those of a single voxel. size: of a voxel, mm^3. */
static bool remove_parts(const struct segment *run, const int dims[3], double size, float *phi, struct segment_parts *parts)
{
    const struct segment_settings *set = &run->settings;
    const size_t least = isnan(set->min_volume) ? 2 : (size_t)ceil(set->min_volume / size);
    if (!segment_remove_parts(dims, phi, least, set->keep_largest, parts)) {
        return segment_no_memory();
    }
    return parts->voxels > 0
        || segment_fail(isnan(set->min_volume) ? "nothing is left: no part of the result has more than one voxel"
                                               : "nothing is left: no part of the result has the volume of --min-volume");
}

bool segment_remove_islands(struct segment *run)
{
    const double side = (double)run->grid.spacing[0];
    struct segment_parts parts;
    if (!remove_parts(run, run->grid.dims, side * side * side, run->grid.data, &parts)) {
        return false;
    }
    run->result->islands = parts.removed;
    run->refitted = parts.removed > 0;
    return !run->refitted || segment_check(run->ctx, springls_set_level_set(run->ctx, run->grid.data), "without islands");
}

bool segment_map_back(struct segment *run)
{
    const float size = run->grid.spacing[0], *spacing = run->image.spacing;
    struct segment_parts parts;
    resample_volume(&run->grid, run->grid.data, NULL, &run->image, run->distance, NULL);
    if (!remove_parts(run, run->image.dims, (double)(spacing[0] * spacing[1] * spacing[2]), run->distance, &parts)) {
        return false;
    }
    run->result->label_components = parts.kept;
    run->result->share = (double)parts.voxels / (double)run->voxels;
    for (size_t n = 0; n < run->voxels; ++n) {
        run->distance[n] *= size;
        run->inside[n] = run->distance[n] < 0.0f;
    }
    if (run->settings.common.out) {
        segment_extend_distance(&run->image, 2.0f * size, run->distance);
    }
    return true;
}
