/* run.c - runs a contour to its object. */
#include "segment/segment.h"

#include "base/progress.h"
#include "imaging/segment_image.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 3 };

/* Speed, as a part of the speed at full pressure, above which a springl still moves. */
static const float rest_speed = 0.05f;

/* Puts an empty model on the present grid in the place of the one before. */
static bool empty_model(struct segment *run)
{
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid = segment_model_grid(run->grid.dims, run->grid.spacing, run->grid.origin, run->grid.direction[0]);
    desc.params = &run->params;
    desc.backend = run->backend;
    springls_destroy(run->ctx);
    run->ctx = NULL;
    return run_create("segment", &desc, &run->ctx) == CLI_CONTINUE;
}

bool segment_enter_level(struct segment *run, float side, struct volume *coarse)
{
    *coarse = run->grid;
    memset(&run->grid, 0, sizeof run->grid);
    if (!volume_create_cubes(&run->image, side, MARGIN, &run->grid)) {
        return segment_no_memory();
    }
    return segment_forces_enter(run, side) && empty_model(run);
}

/* While the contour moves, only a region force looks at the grid. */
static void leave_grid(struct segment *run)
{
    if (run->settings.region <= 0.0) {
        free(run->grid.data);
        run->grid.data = NULL;
    }
}

static bool copy_to_grid(struct segment *run)
{
    if (!run->grid.data && !(run->grid.data = malloc(volume_voxels(&run->grid) * sizeof *run->grid.data))) {
        return segment_no_memory();
    }
    return segment_check(run->ctx, springls_copy_level_set(run->ctx, run->grid.data), "level set");
}

static bool take_frame(struct segment *run)
{
    char caption[48];
    if (!run->settings.common.out || run->settings.no_pictures) {
        return true;
    }
    if (run->frame_count == 0) {
        snprintf(caption, sizeof caption, "start");
    } else {
        snprintf(caption, sizeof caption, "step %d, voxels of %.3g mm", run->result->steps, (double)run->grid.spacing[0]);
    }
    return model_frame_take_plain(run->ctx, caption, &run->frames[run->frame_count++]) || segment_no_memory();
}

bool segment_take_surface(struct segment *run)
{
    if (run->frame_count == 0) {
        memset(&run->frames[0], 0, sizeof run->frames[0]);
        if (!segment_check(run->ctx, springls_extract_mesh(run->ctx, &run->frames[0].surface), "surface")) {
            return false;
        }
        run->frame_count = 1;
    }
    run->surface = &run->frames[run->frame_count - 1].surface;
    return true;
}

float segment_fastest(const struct segment *run) { return 1.0f + (float)run->settings.gvf; }

/* Where a look changes a region's means, the contour follows them before the next one. */
int segment_look_every(const struct segment *run) { return run->settings.region > 0.0 ? 10 : 5; }

float segment_still(const struct segment *run)
{
    return rest_speed * (float)run->settings.speed * (float)segment_look_every(run);
}

/* Copies the level set to the grid on which the regions' means are taken. */
static bool region_follows(struct segment *run)
{
    return run->settings.region <= 0.0 || copy_to_grid(run);
}

/* Returns true if the contour is at rest, by the share of moving springls and by the volume. */
static bool look(struct segment *run, struct segment_watch *watch, double *volume)
{
    struct segment_result *result = run->result;
    springls_measures now;
    if (!segment_watch_look(watch, run->ctx, segment_still(run), &result->moving)) {
        return segment_no_memory();
    }
    if (!segment_check(run->ctx, springls_measure(run->ctx, &now), "measures")) {
        return false;
    }
    result->at_rest = segment_at_rest(result->moving, now.volume, segment_look_every(run), volume);
    return true;
}

/* Returns the work of `steps` steps on a grid and of all coarser ones: a grid half as fine has a quarter of the springls. */
static size_t progress_of(const struct segment *run, int level, int steps)
{
    const size_t most = (size_t)run->settings.steps;
    size_t before = 0, weight = 1;
    for (int l = run->result->levels - 1; l > level; --l, weight *= 4) {
        before += weight * most;
    }
    return before + weight * (size_t)steps;
}

/* Takes steps on one grid, halved `level` times, until the springls are at rest. */
static bool run_to_rest(struct segment *run, int level, struct progress *bar)
{
    const struct segment_settings *set = &run->settings;
    struct segment_result *result = run->result;
    struct segment_watch watch;
    springls_step_desc step;
    double volume = 0.0; /* at the last look */
    memset(&watch, 0, sizeof watch);
    memset(&step, 0, sizeof step);
    bool fine = region_follows(run) && segment_forces_update(run);
    const springls_forces forces = segment_forces(run);
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_FLUID;
    step.dt = (float)set->speed; /* a force of 1 moves by this many voxels */
    const float fastest = step.dt * (segment_fastest(run) + 2.0f * forces.curvature_weight); /* curvature is clamped at 2 */
    step.max_displacement = fastest > 0.75f ? 0.75f : -1.0f; /* cut into sub-steps; slower steps need no check of speeds */
    step.stop_at_topology = run->params.topology == SPRINGLS_TOPOLOGY_PRESERVED; /* eq. 24-25 */

    result->at_rest = false;
    fine = fine && look(run, &watch, &volume);
    for (int s = 1; fine && s <= set->steps && !result->at_rest && springls_count(run->ctx) > 0; ++s) {
        char note[64];
        fine = segment_check(run->ctx, springls_step(run->ctx, &step), "step");
        result->steps++;
        result->springls_mean += (double)springls_count(run->ctx);
        if (fine && s % segment_look_every(run) == 0) {
            fine = look(run, &watch, &volume);
            if (fine && set->region > 0.0 && !result->at_rest && springls_count(run->ctx) > 0) {
                fine = region_follows(run) && segment_forces_update(run);
            }
        }
        snprintf(note, sizeof note, "%d springls, %.1f %% moving", springls_count(run->ctx), 100.0 * (double)result->moving);
        progress_update(bar, progress_of(run, level, s), note);
    }
    segment_watch_free(&watch);
    segment_forces_free(run);
    if (fine && (set->common.json || set->common.out) && !coverage_add(run->ctx, &result->coverage)) {
        return segment_no_memory();
    }
    return fine;
}

static bool evolve(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    struct segment_result *result = run->result;
    struct volume coarse;
    struct progress bar;
    bool fine = true, started = false;
    if (!run->backend) {
        run->backend = run_backend("segment", &set->common);
    }
    result->voxel = run->side;
    result->levels = segment_choose_levels(run);
    const double begin = elapsed_seconds();
    progress_begin(&bar, "segment", progress_of(run, 0, set->steps), !cli_may_print(&set->common));
    for (int level = result->levels - 1; fine && level >= 0; --level) {
        fine = segment_enter_level(run, ldexpf(result->voxel, level), &coarse)
            && (started ? segment_start_from(run, &coarse, "from the coarser grid")
                        : segment_start(run) && segment_look_at_start(run));
        volume_free(&coarse);
        leave_grid(run);
        fine = fine && (level < result->levels - 1 || take_frame(run)) && run_to_rest(run, level, &bar) && copy_to_grid(run);
        started = fine && springls_count(run->ctx) > 0; /* if not, the next grid starts again */
        fine = fine && (!started || level > 0 || segment_remove_islands(run));
        fine = fine && (!started || take_frame(run));
    }
    progress_end(&bar);
    result->seconds = elapsed_seconds() - begin;
    result->springls_mean /= result->steps > 0 ? (double)result->steps : 1.0;
    result->springls = run->ctx ? springls_count(run->ctx) : 0;
    if (fine && !started) {
        return segment_fail("the contour vanished after %d steps: start closer to the object; cells of the grid, %.3g mm, have to "
                            "be smaller than it", result->steps, (double)result->voxel);
    }
    return fine && segment_take_surface(run)
        && segment_check(run->ctx, springls_measure(run->ctx, &result->measures), "measures");
}

bool segment_run(struct segment *run)
{
    if (!evolve(run) || !empty_model(run)) { /* what follows needs the model's surface, but not its memory */
        return false;
    }
    const bool mapped = segment_map_back(run);
    volume_free(&run->grid);
    return mapped;
}

/* Adds the result to the labels; a voxel in two contours belongs to the one in which it is deeper. */
void segment_keep(struct segment *run)
{
    for (size_t n = 0; run->depth && n < run->voxels; ++n) {
        if (run->distance[n] < run->depth[n]) {
            run->depth[n] = run->distance[n];
            run->labels.data[n] = (float)(run->result - run->results + 1);
        }
    }
}

static struct surface as_surface(const springls_mesh *mesh)
{
    const struct surface surface = {mesh->positions, (const uint32_t *)(const void *)mesh->triangles,
                                    (size_t)mesh->triangle_count};
    return surface;
}

bool segment_compare(struct segment *run)
{
    const struct surface found = as_surface(run->surface);
    const float *spacing = run->image.spacing;
    const char *reference = run->settings.reference;
    struct segment_result *result = run->result;
    springls_params params = springls_default_params();
    springls_desc desc;
    params.contouring = SPRINGLS_CONTOURING_LEVEL_SET; /* the mask's voxels have steps, which springls would show as edges */
    memset(&desc, 0, sizeof desc);
    desc.params = &params;
    desc.grid = segment_model_grid(run->image.dims, run->image.spacing, run->image.origin, run->image.direction[0]);
    if (!run->truth) {
        return true;
    }
    result->overlap = overlap_masks(run->inside, run->truth, run->voxels);
    if (run_create("segment", &desc, &run->truth_ctx) != CLI_CONTINUE
        || !segment_check(run->truth_ctx, segment_model_mask(run->truth_ctx, run->truth, run->voxels), reference)
        || !segment_check(run->truth_ctx, springls_extract_mesh(run->truth_ctx, &run->truth_surface), reference)) {
        return false;
    }
    const struct surface truth = as_surface(&run->truth_surface);
    const double tolerance = (double)fmaxf(spacing[0], fmaxf(spacing[1], spacing[2]));
    result->has_distances = surface_distances_measure(&found, &truth, 0, tolerance, &result->distances);
    return true;
}
