/* input.c - image, reference, window and starting surface. */
#include "segment/segment.h"

#include "imaging/mirror.h"
#include "imaging/resample.h"
#include "imaging/segment_image.h"
#include "springls/segment_model.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Default of --stay for a contour that starts from a mask or a mesh, and how far from a mask the two sides of a body are
 * compared, in voxels of the image. */
static const double usual_stay = 1.0;
static const float mirror_around = 4.0f;

/* Default radius of the ball around a seed, in cells of the grid. */
const float segment_seed_cells = 2.5f;

static bool read_image(struct segment *run)
{
    char error[VOLUME_TEXT];
    struct volume *image = &run->image;
    volume_choose_series(run->settings.series, "--series");
    const bool read = volume_read_one(run->settings.image, run->settings.frame, "--frame", image, error);
    volume_choose_series(NULL, NULL);
    if (!read) {
        return segment_fail("%s", error);
    }
    volume_print_warning(image, "segment", NULL);
    if (image->dims[0] < 4 || image->dims[1] < 4 || image->dims[2] < 4) {
        return segment_fail("%.200s: %d x %d x %d voxels are no volume: 4 are needed each way", run->settings.image,
                            image->dims[0], image->dims[1], image->dims[2]);
    }
    if (!(image->maximum > image->minimum)) {
        return segment_fail("%.200s: all voxels are equal", run->settings.image);
    }
    run->voxels = volume_voxels(image);
    run->distance = malloc(run->voxels * sizeof *run->distance);
    run->inside = malloc(run->voxels);
    return (run->distance && run->inside) || segment_no_memory();
}

static bool read_reference(struct segment *run)
{
    char error[VOLUME_TEXT];
    if (!run->settings.reference) {
        return true;
    }
    if (!volume_read_like(&run->image, "the image", run->settings.reference, run->settings.frame, &run->reference, error)
        || !volume_check_labels(&run->reference, run->settings.reference, error)) {
        return segment_fail("%s", error);
    }
    volume_print_warning(&run->reference, "segment", run->settings.reference);
    run->truth = malloc(run->voxels);
    return run->truth || segment_no_memory();
}

/* Chooses low, high and ramp of the pressure of run->result. */
static bool choose_window(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    const double *window = run->result->object->window;
    const struct volume *image = &run->image;
    const float range = image->maximum - image->minimum, never = 2.0f * range; /* an open end, which the ramp never reaches */
    const float usual = segment_percentile(image, 0.995) - segment_percentile(image, 0.005);
    float low, high, ramp;
    if (window[0] < window[1]) {
        low = (float)window[0];
        high = (float)window[1];
    } else {
        const float level = isnan(set->level) ? segment_otsu(image) : (float)set->level;
        low = set->dark ? image->minimum - never : level;
        high = set->dark ? level : image->maximum + never;
        if (isnan(set->level) && cli_may_print(&run->settings.common)) {
            printf("level %.6g (Otsu's threshold)\n", (double)level);
        }
    }
    if (low >= image->maximum || high <= image->minimum || (low < image->minimum && high > image->maximum)) {
        return segment_fail("the image's intensities, %g to %g, are all on one side of the level", (double)image->minimum,
                            (double)image->maximum);
    }
    ramp = set->ramp > 0.0 ? (float)set->ramp : 0.1f * (usual > 0.0f ? usual : range);
    run->result->low = low;
    run->result->high = high;
    run->result->ramp = fminf(ramp, 0.5f * (high - low)); /* the middle of a window has full pressure */
    return true;
}

bool segment_read(struct segment *run)
{
    struct segment_settings *set = &run->settings;
    if (!read_image(run) || !read_reference(run)) {
        return false;
    }
    if (set->object_count > 1
        && (!volume_create_padded(&run->image, 0, &run->labels) || !(run->depth = calloc(run->voxels, sizeof *run->depth)))) {
        return segment_no_memory();
    }
    if (isnan(set->stay)) { /* a start at the object should stay there */
        const float *spacing = run->image.spacing;
        const bool close = strcmp(set->init, "mask") == 0 || strcmp(set->init, "mesh") == 0;
        set->stay = close      ? usual_stay * cbrt((double)(spacing[0] * spacing[1] * spacing[2]))
                    : set->cut ? 0.5 * usual_stay * (double)segment_cut_side(&run->image)
                               : 0.0;
    }
    bool good = true;
    for (int o = 0; good && o < set->object_count; ++o) {
        run->result = &run->results[o];
        memset(run->result, 0, sizeof *run->result);
        run->result->object = &set->objects[o];
        run->result->start_dice = (double)NAN;
        good = choose_window(run);
    }
    if (good) {
        segment_choose_side(run);
    }
    return good;
}

bool segment_begin(struct segment *run, int object)
{
    const struct segment_object *what = &run->settings.objects[object];
    run->result = &run->results[object];
    if (run->truth && segment_mask(&run->reference, what->labels, what->label_count, run->truth) == 0) {
        return segment_fail("%.200s: no voxel has the label asked for%s", run->settings.reference,
                            what->label_count ? " (--label)" : "");
    }
    return true;
}

/* ---- start ---- */

/* Sets the level set on the present grid from the pressure, a mask, or the level set of a coarser grid. */
bool segment_start_from(struct segment *run, const struct volume *from, const char *doing)
{
    struct volume *grid = &run->grid;
    resample_volume(from, from->data, NULL, grid, grid->data, NULL);
    if (run->settings.largest && !segment_keep_largest(grid->dims, grid->data)) {
        return segment_no_memory();
    }
    return segment_check(run->ctx, springls_set_level_set(run->ctx, grid->data), doing);
}

static bool start_from_threshold(struct segment *run)
{
    struct volume phi = run->pressure;
    phi.data = malloc(volume_voxels(&phi) * sizeof *phi.data);
    if (!phi.data) {
        return segment_no_memory();
    }
    for (size_t n = 0; n < volume_voxels(&phi); ++n) {
        phi.data[n] = -run->pressure.data[n];
    }
    const bool started = (!run->settings.clear_edges || segment_clear_edges(&run->image, &phi) || segment_no_memory())
                      && segment_start_from(run, &phi, "--init threshold");
    free(phi.data);
    return started;
}

/* Resamples the mask, -0.5 inside and 0.5 outside, on the image's grid; with --mirror, reflected to the matching place. */
static bool place_mask(struct segment *run, const struct volume *mask, struct volume *placed)
{
    if (!volume_create_padded(&run->image, 0, placed)) {
        return segment_no_memory();
    }
    resample_volume(mask, mask->data, NULL, placed, placed->data, NULL);
    if (!run->settings.mirror) {
        return true;
    }
    const struct segment_result *result = run->result;
    const float *spacing = run->image.spacing;
    const float around = mirror_around * fmaxf(spacing[0], fmaxf(spacing[1], spacing[2]));
    float *likeness = malloc(run->voxels * sizeof *likeness);
    uint8_t *inside = malloc(run->voxels);
    struct mirror mirror;
    bool good = likeness && inside;
    for (size_t n = 0; good && n < run->voxels; ++n) {
        const float value = run->image.data[n];
        likeness[n] = fmaxf(-1.0f, fminf(1.0f, fminf(value - result->low, result->high - value) / result->ramp));
        inside[n] = placed->data[n] < 0.0f;
    }
    good = good ? mirror_find(&run->image, likeness, inside, around, &mirror) || segment_fail("--mirror: there is no other side")
                : segment_no_memory();
    free(likeness);
    free(inside);
    if (good) {
        mirror_apply(&mirror, mask, placed, placed->data);
        if (cli_may_print(&run->settings.common)) {
            printf("mirrored: the two sides differ by %.3f of the ramp\n", mirror.misfit);
        }
    }
    return good;
}

/* Compares a start on the image's voxels with the reference, if there is one. */
static void compare_start(struct segment *run, const float *start)
{
    if (run->truth) {
        for (size_t n = 0; n < run->voxels; ++n) {
            run->inside[n] = start[n] < 0.0f;
        }
        run->result->start_dice = overlap_masks(run->inside, run->truth, run->voxels).dice;
    }
}

static bool start_from_cut(struct segment *run)
{
    struct volume start, placed;
    memset(&placed, 0, sizeof placed);
    bool started = segment_cut(run, &start) && (volume_create_padded(&run->image, 0, &placed) || segment_no_memory());
    if (started) {
        resample_volume(&start, start.data, NULL, &placed, placed.data, NULL);
        compare_start(run, placed.data);
        started = segment_start_from(run, &start, "--cut");
    }
    volume_free(&start);
    volume_free(&placed);
    return started;
}

static bool start_from_mask(struct segment *run)
{
    const struct segment_object *object = run->result->object;
    char error[VOLUME_TEXT];
    struct volume mask, placed;
    memset(&placed, 0, sizeof placed);
    if (!volume_read_companion(run->settings.mask, run->settings.frame, &mask, error)) {
        return segment_fail("%s", error);
    }
    uint8_t *inside = malloc(volume_voxels(&mask));
    bool started = inside || segment_no_memory();
    if (started && segment_mask(&mask, &object->mask_label, object->any_label ? 0 : 1, inside) == 0) {
        started = segment_fail("%.200s: no voxel has the label asked for%s", run->settings.mask,
                               object->any_label ? "" : " (--mask-label)");
    }
    if (started) {
        for (size_t n = 0; n < volume_voxels(&mask); ++n) {
            mask.data[n] = inside[n] ? -0.5f : 0.5f;
        }
        started = place_mask(run, &mask, &placed);
    }
    if (started) {
        compare_start(run, placed.data);
    }
    /* A mirrored mask is on the image's grid, another one on its own, which may be finer. */
    started = started && segment_start_from(run, run->settings.mirror ? &placed : &mask, run->settings.mask);
    free(inside);
    volume_free(&mask);
    volume_free(&placed);
    return started;
}

static bool start_from_mesh(struct segment *run)
{
    char error[MESH_TEXT];
    struct mesh mesh;
    if (!mesh_read(run->settings.init_mesh, &mesh, error)) {
        return segment_fail("%s", error);
    }
    const springls_status status = springls_set_mesh(run->ctx, mesh.positions, (int)mesh.vertex_count, 0,
                                                     (const int *)(const void *)mesh.indices, (int)mesh.triangle_count, NULL);
    mesh_free(&mesh);
    return segment_check(run->ctx, status, run->settings.init_mesh);
}

static bool start_from_shape(struct segment *run)
{
    const struct volume *image = &run->image;
    float center[3], middle[3], shortest = INFINITY;
    for (int a = 0; a < 3; ++a) {
        middle[a] = 0.5f * (float)(image->dims[a] - 1);
        shortest = fminf(shortest, image->spacing[a] * (float)image->dims[a]);
    }
    volume_index_to_world(image, middle, center);
    if (!isnan(run->settings.center[0])) {
        memcpy(center, run->settings.center, sizeof center);
    }
    const float radius = run->settings.radius > 0.0 ? (float)run->settings.radius : shortest / 3.0f;
    if (radius < run->side) {
        return segment_fail("the starting %s has a radius of %.3g mm, less than a cell of the grid, %.3g mm: see --radius, --grid",
                            run->settings.init, (double)radius, (double)run->side);
    }
    return segment_check(run->ctx, segment_model_shape(run->ctx, run->settings.init, center, radius), "the starting shape");
}

/* Sets the model to balls around the seeds. */
static bool start_from_seeds(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    struct volume *grid = &run->grid;
    const float radius = set->radius > 0.0 ? (float)set->radius / grid->spacing[0] : segment_seed_cells;
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        grid->data[n] = INFINITY;
    }
    for (int s = 0; s < set->seed_count; ++s) {
        float seed[3], at[3];
        volume_world_to_index(&run->image, set->seeds[s], at);
        for (int a = 0; a < 3; ++a) {
            if (at[a] < -0.5f || at[a] > (float)run->image.dims[a] - 0.5f) {
                return segment_fail("--seed %g,%g,%g lies outside the image", (double)set->seeds[s][0], (double)set->seeds[s][1],
                                    (double)set->seeds[s][2]);
            }
        }
        volume_world_to_index(grid, set->seeds[s], seed);
        for (size_t n = 0; n < volume_voxels(grid); ++n) {
            int place[3];
            volume_place(grid->dims, n, place);
            const float x = (float)place[0] - seed[0], y = (float)place[1] - seed[1], z = (float)place[2] - seed[2];
            grid->data[n] = fminf(grid->data[n], sqrtf(x * x + y * y + z * z) - radius);
        }
    }
    return segment_check(run->ctx, springls_set_level_set(run->ctx, grid->data), "--seed");
}

bool segment_starts_far(const struct segment *run)
{
    const char *init = run->settings.init;
    return strcmp(init, "mask") != 0 && strcmp(init, "mesh") != 0 && strcmp(init, "threshold") != 0
        && strcmp(init, "seeds") != 0;
}

/* Stores the present level set as a distance in mm. */
static bool remember_start(struct segment *run)
{
    const float side = run->grid.spacing[0];
    volume_free(&run->start);
    if (!volume_create_padded(&run->grid, 0, &run->start)
        || springls_copy_level_set(run->ctx, run->start.data) != SPRINGLS_OK) {
        return segment_no_memory();
    }
    for (size_t n = 0; n < volume_voxels(&run->start); ++n) {
        run->start.data[n] *= side;
    }
    segment_extend_distance(&run->start, 2.0f * side, run->start.data);
    return true;
}

bool segment_start(struct segment *run)
{
    const char *init = run->settings.init;
    return (strcmp(init, "threshold") == 0 ? start_from_threshold(run)
            : strcmp(init, "mask") == 0    ? start_from_mask(run)
            : strcmp(init, "mesh") == 0    ? start_from_mesh(run)
            : run->settings.cut            ? start_from_cut(run)
            : strcmp(init, "seeds") == 0   ? start_from_seeds(run)
                                           : start_from_shape(run))
        && (run->settings.stay <= 0.0 || remember_start(run));
}
