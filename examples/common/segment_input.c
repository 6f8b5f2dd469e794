/* segment_input.c - image, reference, window and starting surface of segment.h. */
#include "segment.h"

#include "mesh_io.h"
#include "segment_image.h"
#include "segment_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The only image of a file, or the one that --frame names. */
static bool read_volume(const struct segment *run, const char *path, struct volume *volume)
{
    char error[VOLUME_TEXT];
    bool found = volume_read(path, 0, volume, error);
    if (found && volume->frame_count > 1 && run->settings.frame < 0) {
        return segment_fail("%.200s: %d images in one file (4-D): choose one with --frame", path, volume->frame_count);
    }
    if (found && volume->frame_count > 1 && run->settings.frame > 0) {
        volume_free(volume);
        found = volume_read(path, run->settings.frame, volume, error);
    }
    return found || segment_fail("%s", error);
}

static bool read_image(struct segment *run)
{
    struct volume *image = &run->image;
    if (!read_volume(run, run->settings.image, image)) {
        return false;
    }
    if (image->note[0] && segment_may_print(run)) {
        printf("note: %s\n", image->note);
    }
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
    struct volume *reference = &run->reference;
    if (!read_volume(run, run->settings.reference, reference)) {
        return false;
    }
    if (!volume_same_grid(&run->image, reference)) {
        return segment_fail("%.200s: not on the grid of the image", run->settings.reference);
    }
    run->truth = malloc(run->voxels);
    if (!run->truth) {
        return segment_no_memory();
    }
    if (segment_mask(reference, run->settings.labels, run->settings.label_count, run->truth) == 0) {
        return segment_fail("%.200s: no voxel has the label asked for", run->settings.reference);
    }
    for (size_t n = 0; n < run->voxels; ++n) {
        reference->data[n] = run->truth[n];
    }
    return true;
}

/* Low, high and ramp of the pressure. */
static bool choose_window(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    const struct volume *image = &run->image;
    const float range = image->maximum - image->minimum, never = 2.0f * range; /* an open end: the ramp never gets there */
    const float usual = segment_percentile(image, 0.995) - segment_percentile(image, 0.005);
    if (set->window[0] < set->window[1]) {
        run->low = (float)set->window[0];
        run->high = (float)set->window[1];
    } else {
        const float level = isnan(set->level) ? segment_otsu(image) : (float)set->level;
        run->low = set->dark ? image->minimum - never : level;
        run->high = set->dark ? level : image->maximum + never;
        if (isnan(set->level) && segment_may_print(run)) {
            printf("level %.6g (Otsu's threshold)\n", (double)level);
        }
    }
    if (run->low >= image->maximum || run->high <= image->minimum
        || (run->low < image->minimum && run->high > image->maximum)) {
        return segment_fail("the image's intensities, %g to %g, are all on one side of the level", (double)image->minimum,
                            (double)image->maximum);
    }
    run->ramp = set->ramp > 0.0 ? (float)set->ramp : 0.1f * (usual > 0.0f ? usual : range);
    run->ramp = fminf(run->ramp, 0.5f * (run->high - run->low)); /* the middle of a window pushes fully */
    return true;
}

bool segment_read(struct segment *run)
{
    return read_image(run) && choose_window(run) && (!run->settings.reference || read_reference(run));
}

/* ---- start ---- */

/* The level set on the present grid from the pressure, a mask, or the one of a coarser grid. */
bool segment_start_from(struct segment *run, const struct volume *from, const char *doing)
{
    struct volume *grid = &run->grid;
    segment_resample(from, from->data, grid, grid->data);
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
    const bool started = segment_start_from(run, &phi, "--init threshold");
    free(phi.data);
    return started;
}

static bool start_from_mask(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    struct volume mask;
    if (!read_volume(run, set->mask, &mask)) {
        volume_free(&mask);
        return false;
    }
    uint8_t *inside = malloc(volume_voxels(&mask));
    bool started = inside || segment_no_memory();
    if (started && segment_mask(&mask, &set->mask_label, set->mask_label < 0 ? 0 : 1, inside) == 0) {
        started = segment_fail("%.200s: no voxel has the label asked for", set->mask);
    }
    if (started) {
        for (size_t n = 0; n < volume_voxels(&mask); ++n) {
            mask.data[n] = inside[n] ? -0.5f : 0.5f;
        }
        started = segment_start_from(run, &mask, set->mask);
    }
    free(inside);
    volume_free(&mask);
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
    return segment_check(run->ctx, segment_model_shape(run->ctx, run->settings.init, center, radius), "the starting shape");
}

bool segment_starts_far(const struct segment *run)
{
    const char *init = run->settings.init;
    return strcmp(init, "mask") != 0 && strcmp(init, "mesh") != 0 && strcmp(init, "threshold") != 0;
}

bool segment_start(struct segment *run)
{
    const char *init = run->settings.init;
    return strcmp(init, "threshold") == 0 ? start_from_threshold(run)
           : strcmp(init, "mask") == 0    ? start_from_mask(run)
           : strcmp(init, "mesh") == 0    ? start_from_mesh(run)
                                          : start_from_shape(run);
}
