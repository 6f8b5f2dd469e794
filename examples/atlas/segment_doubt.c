/* segment_doubt.c - why a result is not to be trusted: the image agrees too little with the atlas's subjects, or what was found is much
 * smaller or larger than they are. Where the image agrees once it is mirrored, or once bright and dark change places, that is named. */
#include "atlas/atlas.h"

#include "surface/mesh_check.h"

#include <math.h>
#include <stdlib.h>

/* Templates are subjects from the middle of thirds, so the subjects' volumes reach some way beyond theirs. */
static const double smallest_share = 0.5, largest_share = 2.0;
static const double clearly_less = 0.6; /* of the disagreement: what a changed image has to leave, for the change to be the cause */

/* Returns the axis of the voxels that runs most along left and right. */
static int side_axis(const struct volume *image)
{
    int axis = 0;
    for (int a = 1; a < 3; ++a) {
        axis = fabsf(image->direction[0][a]) > fabsf(image->direction[0][axis]) ? a : axis;
    }
    return axis;
}

/* Fills `values` with the image's, from the other side of its box, or turned from bright to dark. */
static void change_image(const struct volume *image, enum atlas_doubt change, float *values)
{
    const int axis = side_axis(image);
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        int at[3];
        size_t from = n;
        if (change == ATLAS_MIRRORED) {
            volume_place(image->dims, n, at);
            at[axis] = image->dims[axis] - 1 - at[axis];
            from = (size_t)at[0] + (size_t)image->dims[0] * ((size_t)at[1] + (size_t)image->dims[1] * (size_t)at[2]);
        }
        values[n] = change == ATLAS_INVERTED ? image->maximum + image->minimum - image->data[n] : image->data[from];
    }
}

/* Computes the correlation of a changed image with what a template's subjects expect. */
static bool agreement_of(const struct atlas_segment *run, const struct fusion_template *template, const struct volume *changed,
                         double *agreement)
{
    struct fusion_map map;
    struct fusion_votes votes = {.mean = NULL};
    bool all[ATLAS_MAX_SUBJECTS];
    float shift[3], *seen = malloc(volume_voxels(&template->image) * sizeof *seen);
    char error[VOLUME_TEXT];
    bool good = seen || atlas_no_memory();
    for (int s = 0; s < template->count; ++s) {
        all[s] = true;
    }
    atlas_choose_shift(run, changed, template, shift);
    if (good && !fusion_register(&template->image, changed, shift, &map, error)) {
        good = atlas_fail("%s: %s", run->settings.image, error);
    } else if (good) {
        fusion_sample(&map, &template->image, changed, seen);
        good = fusion_vote(template, seen, all, false, &votes) || atlas_no_memory();
        *agreement = good ? fusion_correlation(template, &votes) : 0.0;
        fusion_votes_free(&votes);
        registration_free(&map.registration);
    }
    free(seen);
    return good;
}

bool atlas_explain(struct atlas_segment *run, const struct fusion_template *template)
{
    struct atlas_confidence *confidence = &run->confidence;
    const struct volume *seen = atlas_seen(run);
    struct volume changed = *seen; /* with values of its own */
    if (confidence->agreement >= confidence->least) {
        return true;
    }
    changed.data = malloc(volume_voxels(seen) * sizeof *changed.data);
    bool good = changed.data || atlas_no_memory();
    for (int c = ATLAS_MIRRORED; good && c <= ATLAS_INVERTED && confidence->doubt <= ATLAS_DISAGREES; ++c) {
        change_image(seen, (enum atlas_doubt)c, changed.data);
        double agreement = 0.0;
        good = agreement_of(run, template, &changed, &agreement);
        if (good && !atlas_disagrees(agreement, confidence) && 1.0 - agreement < clearly_less * (1.0 - confidence->agreement)) {
            confidence->doubt = (enum atlas_doubt)c;
            confidence->changed = agreement;
            confidence->dice = confidence->dice_error = (double)NAN;
        }
    }
    free(changed.data);
    return good;
}

void atlas_check_size(struct atlas_segment *run)
{
    struct atlas_confidence *confidence = &run->confidence;
    const struct shape_mesh *mean = &run->atlas.mean, *found = &run->stages[ATLAS_STAGES - 1];
    double least = INFINITY, most = 0.0;
    confidence->volume = mesh_volume(found->positions, found->triangles, found->triangle_count);
    for (int t = 0; t < run->atlas.template_count; ++t) {
        const double volume = mesh_volume(run->atlas.templates[t].places, mean->triangles, mean->triangle_count);
        least = fmin(least, volume);
        most = fmax(most, volume);
    }
    if (run->atlas.template_count == 0) {
        least = most = mesh_volume(mean->positions, mean->triangles, mean->triangle_count);
    }
    confidence->smallest = smallest_share * least;
    confidence->largest = largest_share * most;
    if (confidence->doubt == ATLAS_TRUSTED && least > 0.0 /* an open surface has none */
        && !(confidence->volume >= confidence->smallest && confidence->volume <= confidence->largest)) {
        confidence->doubt = ATLAS_SIZE;
    }
}

bool atlas_is_trusted(const struct atlas_segment *run)
{
    const struct atlas_confidence *c = &run->confidence;
    const char *image = run->settings.image;
    switch (c->doubt) {
    case ATLAS_TRUSTED: return true;
    case ATLAS_MIRRORED:
        return atlas_fail(
            "%.200s: not to be trusted: it is mirrored, or the other side of the body: its correlation with the atlas's prediction "
            "is %.2f with left and right exchanged, %.2f as it is",
            image, c->changed, c->agreement);
    case ATLAS_INVERTED:
        return atlas_fail("%.200s: not to be trusted: its contrast is that of the subjects inverted: its correlation with the atlas's "
                          "prediction is %.2f with bright and dark exchanged, %.2f as it is", image, c->changed, c->agreement);
    case ATLAS_SIZE:
        return atlas_fail("%.200s: not to be trusted: the object found has %.4g ml, expected %.4g to %.4g ml", image, 1e-3 * c->volume,
                          1e-3 * c->smallest, 1e-3 * c->largest);
    default:
        return atlas_fail("%.200s: not to be trusted: its correlation with the atlas's prediction is %.2f, the subjects' own is at least "
                          "%.2f: another contrast, or another part of the body", image, c->agreement, c->least);
    }
}
