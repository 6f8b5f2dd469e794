/* cut.c - a start from a graph cut between seeds (--cut). */
#include "segment/segment.h"

#include "base/progress.h"
#include "imaging/max_flow.h"
#include "imaging/resample.h"
#include "imaging/seed_cut.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t most_voxels = 4000000; /* of a cut */
static const double voxel_bytes = 400.0;   /* nodes and edges of libmaxflow, ways, queues: an estimate */

const char *segment_cut_lacks(void)
{
    return max_flow_is_there() ? NULL
                               : "--cut: this program was made without libmaxflow (Debian: libmaxflow-dev); install it, then make segment";
}

float segment_cut_side(const struct volume *image)
{
    const float *spacing = image->spacing, side = cbrtf(spacing[0] * spacing[1] * spacing[2]);
    const double times = (double)volume_voxels(image) / (double)most_voxels;
    return times > 1.0 ? side * (float)cbrt(times) : side;
}

/* Makes the cut's grid and samples the image there: the image's own voxels, or cubes where those would be too many. */
static bool sample_image(struct segment *run, struct volume *grid)
{
    const struct volume *image = &run->image;
    const bool own = volume_voxels(image) <= most_voxels;
    const float side = segment_cut_side(image);
    float *blurred = malloc(run->voxels * sizeof *blurred);
    memset(grid, 0, sizeof *grid);
    bool good = blurred && (own ? volume_create_padded(image, 0, grid) : volume_create_cubes(image, side, 0, grid));
    if (good) {
        memcpy(blurred, image->data, run->voxels * sizeof *blurred);
        good = own || segment_blur(image, side, blurred);
        resample_volume(image, blurred, NULL, grid, grid->data, NULL);
    }
    grid->minimum = image->minimum;
    grid->maximum = image->maximum;
    free(blurred);
    return good || segment_no_memory();
}

/* Marks the voxels of the ball around a seed, at least its own, where they are nearer to it than to the seeds before it. */
static bool mark_ball(const struct segment *run, const struct volume *grid, const float seed[3], float radius, uint8_t kind, uint8_t *marks,
                      float *nearest)
{
    float at[3];
    volume_world_to_index(&run->image, seed, at);
    if (!resample_in_box(run->image.dims, at)) {
        return segment_fail("%s %g,%g,%g lies outside the image", kind == SEED_INSIDE ? "--seed" : "--outside-seed", (double)seed[0],
                            (double)seed[1], (double)seed[2]);
    }
    volume_world_to_index(grid, seed, at);
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        int place[3];
        float square = 0.0f, voxels = 0.0f;
        volume_place(grid->dims, n, place);
        for (int a = 0; a < 3; ++a) {
            const float d = (float)place[a] - at[a];
            square += d * d * grid->spacing[a] * grid->spacing[a];
            voxels = fmaxf(voxels, fabsf(d));
        }
        if ((square <= radius * radius || voxels <= 0.5f) && square < nearest[n]) {
            nearest[n] = square;
            marks[n] = kind;
        }
    }
    return true;
}

/* Are the seeds of both kinds in different voxels? No voxel is in the object and outside. */
static bool seeds_agree(const struct segment *run, const struct volume *grid)
{
    const struct segment_settings *set = &run->settings;
    for (int s = 0; s < set->seed_count; ++s) {
        for (int o = 0; o < set->outside_count; ++o) {
            const float *in = set->seeds[s], *out = set->outside_seeds[o];
            float a[3], b[3];
            volume_world_to_index(grid, in, a);
            volume_world_to_index(grid, out, b);
            if (roundf(a[0]) == roundf(b[0]) && roundf(a[1]) == roundf(b[1]) && roundf(a[2]) == roundf(b[2])) {
                return segment_fail("--seed %g,%g,%g and --outside-seed %g,%g,%g lie in one voxel of the cut", (double)in[0], (double)in[1],
                                    (double)in[2], (double)out[0], (double)out[1], (double)out[2]);
            }
        }
    }
    return true;
}

/* Are there marks of both kinds? A cut lies between them. */
static bool both_kinds(const struct segment *run, const struct volume *grid, const uint8_t *marks, float radius)
{
    const float *seed = run->settings.seeds[0];
    bool inside = false, outside = false;
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        inside = inside || marks[n] == SEED_INSIDE;
        outside = outside || marks[n] == SEED_OUTSIDE;
    }
    return (inside && outside)
        || segment_fail("the balls of %g mm around --seed %g,%g,%g%s leave no voxel %s: another --radius is needed", (double)radius,
                        (double)seed[0], (double)seed[1], (double)seed[2], inside ? "" : " and --outside-seed",
                        inside ? "that is not in the object" : "of the object");
}

/* Marks the balls around the seeds, and what is left of the image's border as outside. */
static bool mark(const struct segment *run, const struct volume *grid, uint8_t *marks, float *nearest)
{
    const struct segment_settings *set = &run->settings;
    const float radius = set->radius > 0.0 ? (float)set->radius : segment_seed_cells * segment_cut_side(&run->image);
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        int place[3];
        bool border = false;
        volume_place(grid->dims, n, place);
        for (int a = 0; a < 3; ++a) {
            border = border || place[a] == 0 || place[a] == grid->dims[a] - 1;
        }
        marks[n] = border ? SEED_OUTSIDE : SEED_NONE;
        nearest[n] = INFINITY;
    }
    bool good = true;
    for (int s = 0; good && s < set->seed_count; ++s) {
        good = mark_ball(run, grid, set->seeds[s], radius, SEED_INSIDE, marks, nearest);
    }
    for (int s = 0; good && s < set->outside_count; ++s) {
        good = mark_ball(run, grid, set->outside_seeds[s], radius, SEED_OUTSIDE, marks, nearest);
    }
    return good && seeds_agree(run, grid) && both_kinds(run, grid, marks, radius);
}

/* Says what the cut takes before it begins, and refuses it where memory does not suffice. */
static bool fits_in_memory(const struct segment *run)
{
    const bool own = volume_voxels(&run->image) <= most_voxels;
    const double voxels = own ? (double)run->voxels : (double)most_voxels, needed = voxels * voxel_bytes / (1024.0 * 1024.0);
    const double there_is = free_memory_mib();
    if (!own && cli_may_print(&run->settings.common)) {
        printf("note: the graph cut has voxels of %.3g mm, for memory; the springls have their own\n",
               (double)segment_cut_side(&run->image));
    }
    return there_is <= 0.0 || needed <= there_is
        || segment_fail("--cut takes about %.0f MiB for this image, and %.0f are free: cut a part of the image out", needed, there_is);
}

bool segment_cut(struct segment *run, struct volume *start)
{
    memset(start, 0, sizeof *start);
    if (!fits_in_memory(run) || !sample_image(run, start)) {
        return false;
    }
    const size_t voxels = volume_voxels(start);
    uint8_t *marks = malloc(voxels), *inside = malloc(voxels);
    float *nearest = malloc(voxels * sizeof *nearest);
    bool good = (marks && inside && nearest) || segment_no_memory();
    good = good && mark(run, start, marks, nearest);
    free(nearest);
    good = good && (seed_cut(start, marks, inside) || segment_no_memory());
    for (size_t n = 0; good && n < voxels; ++n) {
        start->data[n] = inside[n] ? -0.5f : 0.5f;
    }
    free(marks);
    free(inside);
    return good;
}
