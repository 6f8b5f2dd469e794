/* run.c - all frames of a morph: in each the shape (shape.c), a step of skinning that also pushes the model to it (skinning.c), and
 * active contours for what lags then (contour.c). */
#include "morph/morph.h"

#include "base/progress.h"

#include <math.h>
#include <string.h>

enum { LEAD_IN = 8, LEAD_OUT = 12 }; /* steps from the neutral pose to the first frame, and back */

#define COINCIDE 0.125  /* voxels: mean distance in both directions below which the two coincide... */
#define LEFT_OVER 0.005 /* ...if at most this share of the target is further than a voxel away, since tips grow last, */
#define WORST 2.0       /* and no particle or vertex is further from the other than this */

/* Returns how far the morph has come: 0 the source, 1 the target. */
static float part_of(const struct morph *morph, int frame)
{
    const float x = fmaxf(0.0f, fminf(1.0f, (float)frame / (float)morph->settings.blend));
    return x * x * (3.0f - 2.0f * x);
}

static bool run_frame(struct morph *morph, int f)
{
    struct morph_frame *frame = &morph->frames[f];
    const int steps_before = springls_get_stats(morph->ctx).steps;
    double clock[4];
    clock[0] = elapsed_seconds();
    bool good = morph_shape(morph, part_of(morph, f));
    clock[1] = elapsed_seconds();
    good = good && morph_skin(morph, part_of(morph, f - 1));
    clock[2] = elapsed_seconds();
    good = good && morph_contour(morph, f == morph->settings.frames - 1);
    clock[3] = elapsed_seconds();
    frame->share = part_of(morph, f);
    frame->seconds = clock[3] - clock[0];
    frame->seconds_target = clock[1] - clock[0];
    frame->seconds_skinning = clock[2] - clock[1];
    frame->seconds_contour = clock[3] - clock[2];
    frame->steps = springls_get_stats(morph->ctx).steps - steps_before;
    return good && morph_measure(morph, frame);
}

/* Poses the skeleton anew and keeps the pose before, from which the step of skinning goes. */
static void next_pose(struct morph *morph, int frame, double blend)
{
    memcpy(morph->skin_before, morph->skin, (size_t)morph->target.character.joint_count * sizeof *morph->skin);
    morph_pose(morph, frame, blend);
}

/* Takes the model back to the neutral pose, in which it is written with its skeleton, while it goes on becoming the target.
 * Skinning the last frame's vertices backwards would be no surface: where bodies have met or parted, neighbors have different
 * bones. */
static bool rest_pose(struct morph *morph)
{
    const int last = morph->frame_count - 1;
    bool good = true;
    for (int s = LEAD_OUT - 1; good && s >= 0; --s) {
        next_pose(morph, last, (double)s / LEAD_OUT);
        good = morph_shape(morph, part_of(morph, last)) && morph_skin(morph, part_of(morph, last))
            && morph_contour(morph, s == 0);
    }
    morph->rest.share = part_of(morph, last);
    return good && morph_measure(morph, &morph->rest);
}

bool morph_run(struct morph *morph)
{
    struct progress bar;
    bool good = true;
    morph->coincided = -1;
    morph_pose(morph, 0, 0.0);
    for (int s = 1; good && s < LEAD_IN; ++s) {
        next_pose(morph, 0, (double)s / LEAD_IN);
        good = morph_shape(morph, 0.0f) && morph_skin(morph, 0.0f) && morph_contour(morph, false);
    }
    progress_begin(&bar, "morph", (size_t)morph->settings.frames, morph->settings.common.quiet);
    for (int f = 0; good && f < morph->settings.frames && morph->coincided < 0; ++f) {
        next_pose(morph, f, 1.0);
        good = run_frame(morph, f);
        morph->frame_count += good;
        const struct morph_frame *frame = &morph->frames[f];
        if (good && f >= morph->settings.blend && frame->distance < COINCIDE && frame->missing < COINCIDE
            && frame->far < LEFT_OVER && fmax(frame->worst, frame->stray) < WORST) {
            morph->coincided = f;
        }
        progress_update(&bar, (size_t)f + 1, NULL);
    }
    progress_end(&bar);
    good = good && morph_compare_ends(morph) && (!morph->settings.channel || morph_compare_channels(morph));
    if (good) {
        morph_compare_weights(morph);
    }
    return good && (!morph->settings.common.out || rest_pose(morph));
}
