/* segment_fusion.c - an image's object by the votes of an atlas's subjects (fusion.h). */
#include "atlas/atlas.h"

#include "base/vec3.h"
#include "imaging/resample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float unmoved[3] = {0.0f, 0.0f, 0.0f};
static const double near_enough = 0.5; /* correlation from which on a registration needs no search before it */

const struct volume *atlas_seen(const struct atlas_segment *run) { return run->part.data ? &run->part : &run->image; }

bool atlas_lies_near(struct atlas_segment *run)
{
    const struct fusion_template *template = &run->atlas.templates[0];
    const size_t bytes = 3 * (size_t)template->vertices * sizeof *run->placing.shape;
    if (fusion_agreement(&template->image, &run->image, unmoved) < near_enough) {
        return false;
    }
    run->placing.pose = similarity_identity();
    run->placing.shape = malloc(bytes);
    if (run->placing.shape) {
        memcpy(run->placing.shape, template->places, bytes);
    }
    return run->placing.shape != NULL;
}

/* Images of one protocol may lie on each other without a shift. */
void atlas_choose_shift(const struct atlas_segment *run, const struct volume *image, const struct fusion_template *template,
                        float shift[3])
{
    const size_t vertices = (size_t)template->vertices;
    double from[3], to[3], radius;
    shape_size(template->places, vertices, from, &radius);
    shape_size(run->placing.shape, vertices, to, &radius);
    for (int a = 0; a < 3; ++a) {
        shift[a] = (float)(to[a] - from[a]);
    }
    if (fusion_agreement(&template->image, image, unmoved) >= fusion_agreement(&template->image, image, shift)) {
        memset(shift, 0, 3 * sizeof *shift);
    }
}

/* Lets the subjects vote at the template's places in the image, and corrects the votes. */
static bool vote(const struct atlas_segment *run, const struct fusion_template *template, const struct fusion_map *map,
                 float *probability, float *shares, float *trust, double *agreement)
{
    const size_t voxels = volume_voxels(&template->image);
    bool all[ATLAS_MAX_SUBJECTS];
    struct fusion_votes votes = {.mean = NULL};
    float *image = malloc(voxels * sizeof *image);
    for (int s = 0; s < template->count; ++s) {
        all[s] = true;
    }
    if (image) {
        fusion_sample(map, &template->image, atlas_seen(run), image);
    }
    const bool good = image && fusion_vote(template, image, all, true, &votes) && fusion_correct(template, &votes, probability);
    *trust = good ? fusion_trust(template, &votes) : 0.0f;
    *agreement = good ? fusion_correlation(template, &votes) : 0.0;
    if (good && shares) {
        memcpy(shares, votes.shares, (size_t)template->label_count * voxels * sizeof *shares);
    }
    fusion_votes_free(&votes);
    free(image);
    return good || atlas_no_memory();
}

/* Asks one template. places: receives the atlas's vertices in the image. */
static bool ask_template(struct atlas_segment *run, int t, float *places, double *agreement)
{
    const struct fusion_template *template = &run->atlas.templates[t];
    float shift[3];
    char error[VOLUME_TEXT];
    atlas_choose_shift(run, atlas_seen(run), template, shift);
    if (!fusion_register(&template->image, atlas_seen(run), shift, &run->maps[t], error)) {
        return atlas_fail("%s: %s", run->settings.image, error);
    }
    const size_t voxels = volume_voxels(&template->image), labels = (size_t)template->label_count;
    run->probabilities[t] = malloc(voxels * sizeof *run->probabilities[t]);
    run->shares[t] = labels > 0 ? malloc(labels * voxels * sizeof *run->shares[t]) : NULL;
    fusion_forward(&run->maps[t], template->places, (size_t)template->vertices, places);
    return ((run->probabilities[t] && (run->shares[t] || labels == 0)) || atlas_no_memory())
        && vote(run, template, &run->maps[t], run->probabilities[t], run->shares[t], &run->trust[t], agreement);
}

bool atlas_fuse(struct atlas_segment *run, float *shape)
{
    const int count = run->atlas.template_count;
    const size_t length = 3 * (size_t)run->atlas.mean.vertex_count;
    float *places = malloc((size_t)count * length * sizeof *places), total = 0.0f;
    double agreement, most = -INFINITY;
    int best = 0; /* template */
    bool good = places || atlas_no_memory();
    for (int t = 0; good && t < count; ++t) {
        good = ask_template(run, t, places + (size_t)t * length, &agreement);
        total += run->trust[t];
        if (good && agreement > most) {
            most = agreement;
            best = t;
        }
    }
    good = good && atlas_judge(&run->atlas.templates[best], most, &run->confidence)
        && atlas_explain(run, &run->atlas.templates[best]);
    for (int t = 0; good && t < count; ++t) {
        run->trust[t] /= total;
        for (size_t i = 0; i < length; ++i) {
            shape[i] = (t > 0 ? shape[i] : 0.0f) + run->trust[t] * places[(size_t)t * length + i];
        }
    }
    free(places);
    return good;
}

float atlas_fused_at(const struct atlas_segment *run, const float place[3])
{
    float sum = 0.0f;
    for (int t = 0; t < run->atlas.template_count; ++t) {
        const struct fusion_template *template = &run->atlas.templates[t];
        float there[3], index[3];
        fusion_back(&run->maps[t], place, 1, there);
        volume_world_to_index(&template->image, there, index);
        sum += run->trust[t] * (resample_at(template->image.dims, run->probabilities[t], index) - template->level);
    }
    return sum;
}
