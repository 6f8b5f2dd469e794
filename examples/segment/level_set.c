/* level_set.c - the same segmentation by a level set alone (paper, section 5.6), with equal start, grids, forces and rule of
 * rest. */
#include "segment/segment.h"

#include "base/bvh.h"
#include "base/progress.h"
#include "base/threads.h"
#include "imaging/level_set.h"
#include "imaging/segment_image.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void speed(void *user, const float *points, const float *normals, int count, float *out)
{
    segment_speed(user, points, normals, count, out);
}

/* Returns the volume inside in voxels. */
static double volume_of(const struct level_set *contour)
{
    const size_t total = (size_t)contour->dims[0] * (size_t)contour->dims[1] * (size_t)contour->dims[2];
    double volume = 0.0;
    for (size_t n = 0; n < total; ++n) {
        volume += contour->phi[n] < 0.0f;
    }
    return volume;
}

/* Runs the level set in alone->grid until it is at rest. */
static bool run_level_set_to_rest(struct segment *alone)
{
    const struct segment_settings *set = &alone->settings;
    struct volume *grid = &alone->grid;
    const size_t bytes = volume_voxels(grid) * sizeof(float);
    struct level_set contour;
    if (!segment_forces_update(alone)) {
        return false;
    }
    segment_forces(alone); /* updates the force maps */
    if (!level_set_create(&contour, grid->dims, grid->data)) {
        return segment_no_memory();
    }
    contour.speed = speed;
    contour.user = alone;
    contour.curvature = (float)set->curvature;
    contour.fastest = segment_fastest(alone);
    bool fine = true, at_rest = false;
    double volume = 0.0; /* at the last look */
    level_set_moving(&contour, 0.0f);
    for (int s = 1; fine && s <= set->steps && !at_rest; ++s) {
        level_set_step(&contour, (float)set->speed);
        if (s % segment_look_every(alone) == 0) {
            const float moving = level_set_moving(&contour, segment_still(alone));
            at_rest = segment_at_rest(moving, volume_of(&contour), segment_look_every(alone), &volume);
            if (set->region > 0.0 && !at_rest) {
                memcpy(grid->data, contour.phi, bytes);
                fine = segment_forces_update(alone);
            }
        }
    }
    memcpy(grid->data, contour.phi, bytes);
    level_set_free(&contour);
    return fine;
}

static bool run_alone(struct segment *alone)
{
    const int levels = segment_choose_levels(alone);
    struct volume coarse;
    bool fine = true;
    for (int level = levels - 1; fine && level >= 0; --level) {
        fine = segment_enter_level(alone, ldexpf(alone->side, level), &coarse)
            && (level < levels - 1 ? segment_start_from(alone, &coarse, "level set alone") : segment_start(alone))
            && segment_check(alone->ctx, springls_copy_level_set(alone->ctx, alone->grid.data), "level set alone")
            && run_level_set_to_rest(alone);
        volume_free(&coarse);
    }
    fine = fine && segment_check(alone->ctx, springls_set_level_set(alone->ctx, alone->grid.data), "level set alone");
    return fine && segment_remove_islands(alone) /* and a model, to extract its surface */
        && segment_take_surface(alone);
}

struct distances_loop {
    const struct bvh *bvh;
    const float *positions;
    double *distance;
};

static void run_distances_loop(void *arg, int begin, int end)
{
    const struct distances_loop *loop = arg;
    for (int v = begin; v < end; ++v) {
        loop->distance[v] = (double)bvh_distance(loop->bvh, loop->positions + 3 * v, NULL, NULL);
    }
}

/* Computes mean and deviation of the distances from every vertex of one surface to the other one. */
static bool distances(const springls_mesh *from, const springls_mesh *to, double *mean, double *deviation)
{
    struct bvh bvh;
    double sum = 0.0, squares = 0.0, *distance = malloc(((size_t)from->vertex_count + 1) * sizeof *distance);
    if (!distance || from->vertex_count == 0
        || !bvh_build(&bvh, to->positions, (const uint32_t *)(const void *)to->triangles, (size_t)to->triangle_count)) {
        free(distance);
        return false;
    }
    struct distances_loop loop = {&bvh, from->positions, distance};
    threads_for(from->vertex_count, 256, run_distances_loop, &loop);
    for (int v = 0; v < from->vertex_count; ++v) { /* in one order for any number of threads */
        sum += distance[v];
        squares += distance[v] * distance[v];
    }
    free(distance);
    bvh_free(&bvh);
    *mean = sum / from->vertex_count;
    *deviation = sqrt(fmax(0.0, squares / from->vertex_count - *mean * *mean));
    return true;
}

bool segment_compare_level_set(struct segment *run)
{
    struct segment alone = *run; /* shares image and settings, but has its own model and result */
    struct segment_result ignored = *run->result, *result = run->result;
    const double begin = elapsed_seconds();
    alone.result = &ignored;
    alone.settings.common.quiet = true;
    alone.ctx = alone.truth_ctx = NULL;
    alone.frame_count = 0;
    memset(&alone.grid, 0, sizeof alone.grid);
    memset(&alone.start, 0, sizeof alone.start);
    alone.surface = NULL;
    memset(&alone.truth_surface, 0, sizeof alone.truth_surface);
    alone.distance = malloc(run->voxels * sizeof *alone.distance);
    alone.inside = malloc(run->voxels);
    bool fine = (alone.distance && alone.inside) || segment_no_memory();
    fine = fine && run_alone(&alone);
    result->level_set_seconds = elapsed_seconds() - begin;
    if (fine) {
        fine = segment_map_back(&alone);
        result->level_set_dice = overlap_masks(run->inside, alone.inside, run->voxels).dice;
        fine = fine && (distances(run->surface, alone.surface, &result->level_set_mean, &result->level_set_deviation)
                        || segment_fail("the level set alone has vanished"));
    }
    segment_end_object(&alone);
    free(alone.distance);
    free(alone.inside);
    return fine;
}
