/* input.c - images, labels, landmarks and the reference's surface. */
#include "track4d/track.h"

#include "imaging/resample.h"
#include "imaging/segment_image.h"
#include "registration/points.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MARGIN = 5 }; /* voxels of the model's grid around the image */
static const double most_spread = 64.0; /* volume of a grid that covers two images, over theirs */
static const float noise = 0.005f; /* deviation of the noise in a synthetic sequence, as a part of the image's range */

/* ---- frames ---- */

struct beat_time track_beat(const struct track *track, int frame)
{
    const struct beat_time t = {&track->beat, beat_phase(frame, track->settings.beat)};
    return t;
}

/* Samples the map from a frame of the synthetic motion back to the reference, on the reference's grid. */
static bool backward_map(const struct track *track, int frame, struct field *back)
{
    struct beat_time t = track_beat(track, frame);
    t.s = -t.s;
    if (!field_create(&track->image, back)) {
        return false;
    }
    field_sample(beat_map, &t, back);
    return true;
}

/* Adds normal noise, each value the sum of twelve uniform ones. */
static void add_noise(struct volume *image, float deviation, uint32_t seed)
{
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        float sum = -6.0f;
        for (int i = 0; i < 12; ++i) {
            seed = seed * 1664525u + 1013904223u;
            sum += (float)(seed >> 8) / 16777216.0f;
        }
        image->data[n] += deviation * sum;
    }
}

/* Resamples a file on the common grid: images get their smallest value beyond the file, labels the nearest voxel's. */
static bool read_onto(const struct volume *grid, const char *path, bool labels, struct volume *volume)
{
    char error[VOLUME_TEXT];
    struct volume read;
    struct field still;
    memset(volume, 0, sizeof *volume);
    if (!(labels ? volume_read_companion(path, 0, &read, error) : volume_read(path, 0, &read, error))) {
        return track_fail("%s", error);
    }
    bool good = volume_create_padded(grid, 0, volume);
    if (good && read.ids) {
        volume->ids = malloc(volume_voxels(volume) * sizeof *volume->ids);
        good = volume->ids != NULL;
    }
    if (!good || !field_create(grid, &still)) {
        volume_free(volume);
        good = false;
    }
    if (good) {
        good = !volume->ids || field_warp_ids(&still, &read, volume->ids);
        (labels ? field_warp_labels(&still, &read, volume->data) : field_warp(&still, &read, read.minimum, volume->data));
        volume->minimum = read.minimum;
        volume->maximum = read.maximum;
        memcpy(volume->warning, read.warning, sizeof volume->warning);
        field_free(&still);
    }
    volume_free(&read);
    return good || track_no_memory();
}

static double voxel_volume(const struct volume *image)
{
    return (double)image->spacing[0] * (double)image->spacing[1] * (double)image->spacing[2];
}

/* Extends the reference's grid along its axes until it covers the other image. */
static bool common_grid(const struct volume *reference, const struct volume *other, struct volume *grid)
{
    int low[3] = {0, 0, 0}, dims[3];
    struct volume wide;
    int high[3] = {reference->dims[0] - 1, reference->dims[1] - 1, reference->dims[2] - 1};
    for (int corner = 0; corner < 8; ++corner) {
        float index[3], world[3];
        for (int a = 0; a < 3; ++a) {
            index[a] = corner >> a & 1 ? (float)(other->dims[a] - 1) : 0.0f;
        }
        volume_index_to_world(other, index, world);
        volume_world_to_index(reference, world, index);
        for (int a = 0; a < 3; ++a) {
            const float bounded = fmaxf(-1e4f, fminf(1e4f, index[a]));
            low[a] = (int)floorf(bounded) < low[a] ? (int)floorf(bounded) : low[a];
            high[a] = (int)ceilf(bounded) > high[a] ? (int)ceilf(bounded) : high[a];
        }
    }
    for (int a = 0; a < 3; ++a) {
        dims[a] = high[a] - low[a] + 1;
    }
    const double voxels = (double)dims[0] * dims[1] * dims[2];
    const double own = (double)volume_voxels(reference) * voxel_volume(reference) + (double)volume_voxels(other) * voxel_volume(other);
    if (voxels > 1e9 || voxels * voxel_volume(reference) > most_spread * own) {
        return track_fail("the headers place the two images too far from each other: a grid that covers both has %.3g voxels", voxels);
    }
    if (!volume_create(dims, reference->spacing, reference->origin, &wide)) {
        return track_no_memory();
    }
    memcpy(wide.affine, reference->affine, sizeof wide.affine);
    for (int r = 0; r < 3; ++r) {
        for (int a = 0; a < 3; ++a) {
            wide.affine[r][3] += reference->affine[r][a] * low[a];
        }
    }
    const bool good = volume_create_padded(&wide, 0, grid); /* derives all else from the affine map */
    volume_free(&wide);
    return good || track_no_memory();
}

/* Returns true if a label map, if there is one, lies on the grid of its image. */
static bool labels_fit(const char *path, const struct volume *image)
{
    char error[VOLUME_TEXT];
    struct volume labels;
    if (!path) {
        return true;
    }
    if (!volume_read_like(image, "its image", path, -1, &labels, error)) {
        return track_fail("%s", error);
    }
    volume_print_warning(&labels, "track4d", path);
    volume_free(&labels);
    return true;
}

/* Reads two files; the first becomes the reference, on a grid that covers both. */
static bool read_two(struct track *track)
{
    char error[VOLUME_TEXT];
    struct volume second, grid;
    if (track->image.frame_count > 1) {
        return track_fail("%s: %d images in one file; with a second image each file has one", track->settings.image,
                          track->image.frame_count);
    }
    if (!volume_read_one(track->settings.second, -1, NULL, &second, error)) {
        return track_fail("%s", error);
    }
    bool good = labels_fit(track->settings.labels, &track->image) && labels_fit(track->settings.second_labels, &second)
             && common_grid(&track->image, &second, &grid);
    volume_free(&second);
    if (good) {
        volume_free(&track->image);
        good = read_onto(&grid, track->settings.image, false, &track->image);
        volume_free(&grid);
    }
    return good;
}

/* Returns the file that has a frame's image. */
static const char *frame_file(const struct track *track, int frame)
{
    return track->settings.second && frame > 0 ? track->settings.second : track->settings.image;
}

bool track_frame_image(const struct track *track, int frame, struct volume *image)
{
    char error[VOLUME_TEXT];
    struct register_window window = {0.0f, 1.0f};
    struct field back;
    if (track->settings.second) {
        return read_onto(&track->image, frame_file(track, frame), false, image);
    }
    if (track->settings.beat == 0) {
        return volume_read(track->settings.image, frame, image, error) || track_fail("frame %d: %s", frame, error);
    }
    if (!volume_create_padded(&track->image, 0, image) || !backward_map(track, frame, &back)) {
        return track_no_memory();
    }
    register_window_of(&track->image, &window);
    field_warp(&back, &track->image, track->image.minimum, image->data);
    field_free(&back);
    add_noise(image, noise * (window.high - window.low), 1u + (uint32_t)frame);
    image->minimum = window.low;
    image->maximum = window.high;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        image->minimum = fminf(image->minimum, image->data[n]);
        image->maximum = fmaxf(image->maximum, image->data[n]);
    }
    return true;
}

static bool mask_of(const struct track *track, const char *path, int frame, const struct volume *labels, float **mask)
{
    char error[VOLUME_TEXT];
    const size_t total = volume_voxels(labels);
    unsigned char *inside = malloc(total);
    *mask = malloc(total * sizeof **mask);
    const int label = track->settings.label;
    const uint32_t wanted = (uint32_t)label;
    bool good = (inside && *mask) || track_no_memory();
    good = good && (volume_check_labels(labels, path, error) || track_fail("%s", error));
    if (good && segment_mask(labels, &wanted, label >= 0, inside) == 0) {
        good = track_fail("%s: no voxel has the label asked for in frame %d%s", path, frame, label >= 0 ? " (--label)" : "");
    }
    for (size_t n = 0; good && n < total; ++n) {
        (*mask)[n] = inside[n];
    }
    free(inside);
    if (!good) {
        free(*mask);
        *mask = NULL;
    }
    return good;
}

bool track_frame_mask(const struct track *track, int frame, float **mask)
{
    char error[VOLUME_TEXT];
    *mask = NULL;
    if (track->settings.beat > 0) {
        struct volume reference = track->image;
        struct field back;
        reference.data = track->mask;
        *mask = malloc(volume_voxels(&reference) * sizeof **mask);
        if (!*mask || !backward_map(track, frame, &back)) {
            free(*mask);
            *mask = NULL;
            return track_no_memory();
        }
        field_warp_labels(&back, &reference, *mask);
        field_free(&back);
        return true;
    }
    struct volume labels;
    const char *const second = track->settings.second_labels;
    if (track->settings.second && (frame == 0 || second)) {
        const char *const path = frame == 0 ? track->settings.labels : second;
        const bool good = read_onto(&track->image, path, true, &labels) && mask_of(track, path, frame, &labels, mask);
        volume_free(&labels);
        return good;
    }
    if (track->labelled == 1 && frame != track->settings.reference) {
        return true;
    }
    if (!volume_read_like(&track->image, "its image", track->settings.labels, frame, &labels, error)) {
        return track_fail("%s", error);
    }
    const bool good = mask_of(track, track->settings.labels, frame, &labels, mask);
    volume_free(&labels);
    return good;
}

/* ---- the reference ---- */

/* Makes the beat from the center and root mean square radius of the label, mm. */
static bool make_beat(struct track *track)
{
    double sum[3] = {0.0, 0.0, 0.0}, square = 0.0, number = 0.0;
    for (size_t n = 0; n < volume_voxels(&track->image); ++n) {
        int place[3];
        volume_place(track->image.dims, n, place);
        const float index[3] = {(float)place[0], (float)place[1], (float)place[2]};
        float x[3];
        if (track->mask[n] > 0.0f) {
            volume_index_to_world(&track->image, index, x);
            for (int a = 0; a < 3; ++a) {
                sum[a] += (double)x[a];
                square += (double)x[a] * (double)x[a];
            }
            number += 1.0;
        }
    }
    if (number < 2.0) {
        return track_fail("%s: a made motion needs an object of more than one voxel", track->settings.labels);
    }
    for (int a = 0; a < 3; ++a) {
        sum[a] /= number;
        square -= number * sum[a] * sum[a];
    }
    track->beat = beat_of(sum, sqrt(square / number));
    return true;
}

/* Returns the level of the blurred mask that encloses as many voxels as the mask: one half would shrink a ball. */
static float volume_level(const float *mask, const float *blurred, size_t total)
{
    float low = 0.0f, high = 1.0f;
    size_t wanted = 0;
    for (size_t n = 0; n < total; ++n) {
        wanted += mask[n] > 0.0f;
    }
    for (int i = 0; i < 20; ++i) {
        const float middle = 0.5f * (low + high);
        size_t above = 0;
        for (size_t n = 0; n < total; ++n) {
            above += blurred[n] > middle;
        }
        *(above > wanted ? &low : &high) = middle;
    }
    return 0.5f * (low + high);
}

/* Copies the label's mask into a volume with background around it: there a body that the image cuts off is closed. */
static bool pad_mask(const struct track *track, float blur, struct volume *padded)
{
    const float *spacing = track->image.spacing;
    const int *dims = track->image.dims;
    const int margin = 1 + (int)ceilf(2.0f * blur / fminf(spacing[0], fminf(spacing[1], spacing[2])));
    if (!volume_create_padded(&track->image, margin, padded)) {
        return false;
    }
    for (int z = 0; z < dims[2]; ++z) {
        for (int y = 0; y < dims[1]; ++y) {
            const size_t row = (size_t)z * (size_t)dims[1] + (size_t)y;
            const size_t padded_row = (size_t)(z + margin) * (size_t)padded->dims[1] + (size_t)(y + margin);
            memcpy(padded->data + padded_row * (size_t)padded->dims[0] + margin, track->mask + row * (size_t)dims[0],
                   (size_t)dims[0] * sizeof *padded->data);
        }
    }
    return true;
}

/* Makes the label's level set on the model's grid, negative inside: the mask blurred by about a voxel, at the level that keeps
 * the volume. */
static bool make_level_set(const struct track *track)
{
    const float blur = 2.0f * track->grid.spacing[0];
    struct volume mask, blurred;
    memset(&mask, 0, sizeof mask);
    memset(&blurred, 0, sizeof blurred);
    bool good = pad_mask(track, blur, &mask) && volume_create_padded(&mask, 0, &blurred);
    if (good) {
        const size_t total = volume_voxels(&mask);
        memcpy(blurred.data, mask.data, total * sizeof *blurred.data);
        good = segment_blur(&mask, blur, blurred.data);
        const float level = volume_level(mask.data, blurred.data, total);
        resample_volume(&blurred, blurred.data, NULL, &track->grid, track->grid.data, NULL);
        for (size_t n = 0; n < volume_voxels(&track->grid); ++n) {
            track->grid.data[n] = level - track->grid.data[n];
        }
    }
    volume_free(&mask);
    volume_free(&blurred);
    return good || track_no_memory();
}

/* Returns the largest distance of a springl's corners from those of a triangle, voxels. */
static float apart(const struct track *track, const float *springl, const int *triangle, const int corner[3])
{
    float furthest = 0.0f;
    for (int k = 0; k < 3; ++k) {
        float place[3];
        springls_to_voxel(track->ctx, track->mesh.positions + 3 * triangle[corner[k]], 1, place);
        for (int a = 0; a < 3; ++a) {
            furthest = fmaxf(furthest, fabsf(place[a] - springl[3 * k + a]));
        }
    }
    return furthest;
}

/* Removes triangles from the mesh that the library skipped because they have no area, so that triangle i is springl i. */
static bool match_springls(struct track *track)
{
    static const int orders[4][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
    const springls_view view = springls_view_vertices(track->ctx);
    int *triangles = track->mesh.triangles, kept = 0;
    for (int o = 0; o < 4 && kept < view.count; ++o) {
        memcpy(track->corner, orders[o], sizeof track->corner);
        for (int t = kept = 0; t < track->mesh.triangle_count && kept < view.count; ++t) {
            const float *springl = (const float *)(const void *)((const char *)view.data + (size_t)kept * view.stride);
            if (apart(track, springl, triangles + 3 * t, track->corner) < 1e-3f) {
                const int same[3] = {triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]};
                memcpy(triangles + 3 * kept++, same, sizeof same);
            } else if (kept == 0 && t > 100) {
                break; /* not in this order */
            }
        }
    }
    track->mesh.triangle_count = kept;
    return kept == view.count || track_fail("the reference's mesh and its springls do not agree");
}

bool track_reference(struct track *track)
{
    const springls_mesh *m = &track->mesh;
    return track_check(track->ctx,
                       springls_set_mesh(track->ctx, m->positions, m->vertex_count, 0, m->triangles, m->triangle_count, NULL),
                       "reference");
}

/* Makes the level set of the label that of the model. */
static bool start_model(struct track *track)
{
    if (!make_level_set(track)) {
        return false;
    }
    const springls_status status = springls_set_level_set(track->ctx, track->grid.data);
    if (status == SPRINGLS_EMPTY_MODEL) {
        return track_fail("%s: the object of frame %d is too small for cells of %.3g mm (--grid)", track->settings.labels,
                          track->settings.reference, (double)track->grid.spacing[0]);
    }
    return track_check(track->ctx, status, "reference");
}

static bool make_model(struct track *track)
{
    const float *s = track->image.spacing;
    const int cells = track->settings.common.grid;
    const float longest = fmaxf(s[0] * (float)track->image.dims[0],
                                fmaxf(s[1] * (float)track->image.dims[1], s[2] * (float)track->image.dims[2]));
    const float side = cells > 0 ? longest / (float)cells : cbrtf(s[0] * s[1] * s[2]);
    springls_desc desc;
    if (!volume_create_cubes(&track->image, side, MARGIN, &track->grid)) {
        return track_no_memory();
    }
    memset(&desc, 0, sizeof desc);
    desc.grid = segment_model_grid(track->grid.dims, track->grid.spacing, track->grid.origin, track->grid.direction[0]);
    track->params.split_input = 0; /* springl i is triangle i of the reference */
    desc.params = &track->params;
    desc.backend = track->backend = run_backend("track4d", &track->settings.common);
    return run_create("track4d", &desc, &track->ctx) == CLI_CONTINUE && start_model(track)
           && track_check(track->ctx, springls_extract_mesh(track->ctx, &track->mesh), "reference") && track_reference(track)
           && match_springls(track);
}

static bool read_landmarks(struct track *track)
{
    char error[VOLUME_TEXT];
    size_t frames = 0;
    if (!points_read_frames(track->settings.landmarks, &track->landmarks, &track->landmark_count, &frames, error)) {
        return track_fail("%s", error);
    }
    if (frames != (size_t)track->frame_count) {
        return track_fail("%s: landmarks of %zu frames, but there are %d images", track->settings.landmarks, frames,
                          track->frame_count);
    }
    track->anchors = malloc(track->landmark_count * sizeof *track->anchors);
    if (!track->anchors) {
        return track_no_memory();
    }
    const float *reference = track->landmarks + 3 * track->landmark_count * (size_t)track->settings.reference;
    return track_check(track->ctx, springls_closest(track->ctx, SPRINGLS_SURFACE_SOUP, reference, (int)track->landmark_count,
                                                    track->anchors), "landmarks");
}

/* Prints the warning of a frame's image, and keeps it for the report. */
static void keep_warning(struct track *track, int frame, const struct volume *image)
{
    char name[32];
    snprintf(name, sizeof name, "frame %d", frame);
    volume_print_warning(image, "track4d", name);
    memcpy(track->frames[frame].warning, image->warning, sizeof image->warning);
}

/* Refuses an image that cannot be registered. */
static bool check_image(const struct track *track, int frame, const struct volume *image)
{
    const bool registers = !track->settings.fields && !track->settings.true_field;
    return !registers || image->maximum > image->minimum
        || track_fail("%.200s: frame %d: all voxels are equal: there is nothing to register", frame_file(track, frame), frame);
}

/* Reads what a frame needs: image, label and field. */
static bool check_frame(struct track *track, int frame)
{
    const struct track_settings *set = &track->settings;
    float *mask = NULL;
    struct volume image;
    struct field field;
    if (!track_frame_image(track, frame, &image)) {
        return false;
    }
    keep_warning(track, frame, &image);
    const bool good = check_image(track, frame, &image) && track_frame_mask(track, frame, &mask);
    volume_free(&image);
    free(mask);
    if (!good || !set->fields || frame == set->reference) {
        return good;
    }
    const bool read = track_field_read(track, frame, &field);
    if (read) {
        field_free(&field);
    }
    return read;
}

/* Checks all frames before the work on the first one. Those of a made motion are made of the reference. */
static bool check_frames(struct track *track)
{
    const bool made = track->settings.beat > 0;
    bool good = !made || check_image(track, track->settings.reference, &track->image);
    for (int f = 0; good && !made && f < track->frame_count; ++f) {
        good = check_frame(track, f);
    }
    return good;
}

bool track_read(struct track *track)
{
    const struct track_settings *set = &track->settings;
    char error[VOLUME_TEXT];
    struct volume labels;
    if (!volume_read(set->image, set->reference, &track->image, error) || !volume_read(set->labels, 0, &labels, error)) {
        return track_fail("%s", error);
    }
    track->frame_count = set->beat > 0 ? set->beat : track->image.frame_count;
    track->labelled = labels.frame_count;
    volume_free(&labels);
    if (track->image.dimension > 4) {
        return track_fail("%s: %d-D: a sequence has one dimension beside space", set->image, track->image.dimension);
    }
    if (set->second) {
        track->frame_count = 2;
        track->labelled = 1;
        if (!read_two(track)) {
            return false;
        }
    }
    if (track->frame_count < 2 || track->frame_count > TRACK_MAX_FRAMES) {
        return track_fail("%s: a sequence has 2 to %d images, this one %d", set->image, TRACK_MAX_FRAMES, track->frame_count);
    }
    if (set->reference >= track->frame_count || set->frame >= track->frame_count) {
        return track_fail("there are frames 0 to %d only", track->frame_count - 1);
    }
    if (set->beat == 0 && track->labelled != 1 && track->labelled != track->frame_count) {
        return track_fail("%s: label maps of %d frames for %d images", set->labels, track->labelled, track->frame_count);
    }
    track->frames = calloc((size_t)track->frame_count, sizeof *track->frames);
    struct track first = *track; /* for a synthetic motion the reference's mask is the file's */
    first.settings.beat = 0;
    if (!track->frames) {
        return track_no_memory();
    }
    if (!track_frame_mask(&first, set->reference, &track->mask)) {
        return false;
    }
    return check_frames(track) && (set->beat == 0 || make_beat(track)) && make_model(track)
        && (!set->landmarks || read_landmarks(track));
}
