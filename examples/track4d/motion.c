/* motion.c - displacement fields from the reference to a frame: registered, exact, or read from files. */
#include "track4d/track.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "springls/segment_model.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Samples the three fields from maps of points; substep and forward may be the same. */
static bool sample_all(const struct track *track, field_map_fn map, const void *substep, const void *forward,
                       field_map_fn map_back, const void *back, struct track_motion *motion)
{
    if (!field_create(&track->image, &motion->substep) || !field_create(&track->image, &motion->forward)
        || !field_create(&track->image, &motion->back)) {
        return track_no_memory();
    }
    field_sample(map, forward, &motion->forward);
    if (substep == forward) {
        memcpy(motion->substep.mm, motion->forward.mm, 3 * volume_voxels(&track->image) * sizeof *motion->substep.mm);
    } else {
        field_sample(map, substep, &motion->substep);
    }
    field_sample(map_back, back, &motion->back);
    return true;
}

static bool true_motion(const struct track *track, int frame, int steps, struct track_motion *motion)
{
    const struct beat_time forward = track_beat(track, frame), substep = {forward.beat, forward.s / steps};
    const struct beat_time back = {forward.beat, -forward.s};
    return sample_all(track, beat_map, steps == 1 ? &forward : &substep, &forward, beat_map, &back, motion);
}

bool track_field_read(const struct track *track, int frame, struct field *field)
{
    char path[1024], error[VOLUME_TEXT];
    const char *pattern = track->settings.fields, *mark = strstr(pattern, "%d");
    snprintf(path, sizeof path, "%.*s%d%s", (int)(mark - pattern), pattern, frame, mark + 2);
    return field_read(path, field, error) || track_fail("%s", error);
}

static bool read_motion(const struct track *track, int frame, struct track_motion *motion)
{
    double remains = 0.0;
    struct field field;
    if (!track_field_read(track, frame, &field)) {
        return false;
    }
    const bool good = sample_all(track, field_map_points, &field, &field, field_map_points, &field, motion);
    field_free(&field);
    field_free(&motion->back);
    return good && (field_invert(&motion->forward, &track->image, &motion->back, &remains) || track_no_memory());
}

/* Reads a frame as it is registered: two files on their own grids, as on a common one padding would hide what does not overlap. */
static bool read_frame(const struct track *track, int frame, struct volume *image)
{
    const struct track_settings *set = &track->settings;
    char error[VOLUME_TEXT];
    if (!set->second) {
        return track_frame_image(track, frame, image);
    }
    return volume_read(frame == 0 ? set->image : set->second, 0, image, error) || track_fail("%s", error);
}

static bool register_motion(const struct track *track, int frame, int steps, const struct registration *start,
                            struct track_motion *motion)
{
    char error[VOLUME_TEXT];
    struct volume image, reference = track->image;
    struct registration substep;
    const bool same = track->settings.beat == 0 && !track->settings.second; /* in a synthetic motion every frame has its own noise */
    if (!read_frame(track, frame, &image)) {
        return false;
    }
    bool good = same || read_frame(track, track->settings.reference, &reference);
    if (good && !register_images(&reference, &image, &track->registration, start, &motion->registration, error)) {
        good = track_fail("frame %d: %s", frame, error);
    }
    if (!same) {
        volume_free(&reference);
    }
    volume_free(&image);
    if (!good) {
        return false;
    }
    if (steps == 1) {
        return sample_all(track, registration_map, &motion->registration, &motion->registration, registration_map_back,
                          &motion->registration, motion);
    }
    if (!registration_substep(&motion->registration, steps, &substep)) {
        return track_no_memory();
    }
    good = sample_all(track, registration_map, &substep, &motion->registration, registration_map_back, &motion->registration,
                      motion);
    registration_free(&substep);
    return good;
}

bool track_motion_make(const struct track *track, int frame, int steps, const struct registration *start,
                       struct track_motion *motion)
{
    const double begin = elapsed_seconds();
    memset(motion, 0, sizeof *motion);
    const bool good = track->settings.fields     ? read_motion(track, frame, motion)
                      : track->settings.true_field ? true_motion(track, frame, steps, motion)
                                                   : register_motion(track, frame, steps, start, motion);
    motion->seconds = elapsed_seconds() - begin;
    return good;
}

void track_motion_free(struct track_motion *motion)
{
    registration_free(&motion->registration);
    field_free(&motion->substep);
    field_free(&motion->forward);
    field_free(&motion->back);
}

springls_sampled_field track_velocity(const struct track *track, const struct field *field, float *values)
{
    const struct volume *grid = &track->grid, *own = &field->grid;
    const springls_grid_desc desc = segment_model_grid(own->dims, own->spacing, own->origin, own->direction[0]);
    const springls_sampled_field sampled = {values, desc, 0};
    for (size_t n = 0; n < volume_voxels(&field->grid); ++n) {
        for (int a = 0; a < 3; ++a) { /* the model's axes are perpendicular, so the transposed matrix is the inverse */
            const float axis[3] = {grid->direction[0][a], grid->direction[1][a], grid->direction[2][a]};
            values[3 * n + (size_t)a] = vec3_dot(axis, field->mm + 3 * n) / grid->spacing[a];
        }
    }
    return sampled;
}
