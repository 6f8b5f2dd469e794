/* confidence.c - how far the votes of an atlas's subjects on an image are to be trusted.
 *
 * Each subject of a template is voted on by the others, as the image is by all. That gives, for each subject, the correlation of its
 * image with what the others expect there (agreement), and the Dice of their answer with its own mask. A line fitted to these pairs
 * predicts the Dice of the image from its agreement. The subjects have taught the correction, so the prediction is a little high. */
#include "atlas/atlas.h"

#include <math.h>
#include <stdlib.h>

enum { MAX_JUDGED = 16 }; /* subjects, evenly chosen of all: more tell little more */

static const double least_share = 0.75; /* of the subjects' least agreement: an image with less is of another kind */
static const double searched_share = 0.9; /* the same, at the best of thousands of places: there chance alone brings some agreement */

/* Computes the Dice of what is above the template's level with a subject's mask. */
static double dice_of(const struct fusion_template *template, const float *probability, int subject)
{
    const size_t voxels = volume_voxels(&template->image);
    const float *mask = template->masks + (size_t)subject * voxels;
    size_t a = 0, b = 0, both = 0;
    for (size_t n = 0; n < voxels; ++n) {
        const bool found = probability[n] > template->level, true_one = mask[n] > 0.5f;
        a += found;
        b += true_one;
        both += found && true_one;
    }
    return a + b > 0 ? 2.0 * (double)both / (double)(a + b) : 1.0;
}

/* Computes the Dice of a label, which has the largest share within what is above the level, with a subject's own. */
static double label_dice_of(const struct fusion_template *template, const float *probability, const float *shares, int label, int subject)
{
    const size_t voxels = volume_voxels(&template->image);
    const int *truth = template->labels + (size_t)subject * voxels;
    size_t found = 0, there = 0, both = 0;
    for (size_t n = 0; n < voxels; ++n) {
        bool largest = probability[n] > template->level;
        for (int l = 0; largest && l < template->label_count; ++l) {
            largest = shares[(size_t)l * voxels + n] <= shares[(size_t)(label - 1) * voxels + n];
        }
        found += largest;
        there += truth[n] == label;
        both += largest && truth[n] == label;
    }
    return found + there > 0 ? 2.0 * (double)both / (double)(found + there) : 1.0;
}

/* Has one subject voted on by the others. labels: receives the Dice of each label. */
static bool judge(const struct fusion_template *template, int subject, float *probability, double *agreement, double *dice, double *labels)
{
    const size_t voxels = volume_voxels(&template->image);
    struct fusion_votes votes = {.mean = NULL};
    bool others[ATLAS_MAX_SUBJECTS];
    for (int s = 0; s < template->count; ++s) {
        others[s] = s != subject;
    }
    const bool good = fusion_vote(template, template->images + (size_t)subject * voxels, others, true, &votes)
        && fusion_correct(template, &votes, probability);
    if (good) {
        *agreement = fusion_correlation(template, &votes);
        *dice = dice_of(template, probability, subject);
        for (int l = 0; l < template->label_count; ++l) {
            labels[l] = label_dice_of(template, probability, votes.shares, l + 1, subject);
        }
    }
    fusion_votes_free(&votes);
    return good;
}

/* Predicts y at `at` by the line of least squares through the points, or by their mean where the line falls; error: root mean square of
   what lines through the others miss. */
static double predict(const double *x, const double *y, int count, double at, double *error)
{
    double mx = 0.0, my = 0.0, xx = 0.0, xy = 0.0, square = 0.0;
    for (int i = 0; i < count; ++i) {
        mx += x[i] / count;
        my += y[i] / count;
    }
    for (int i = 0; i < count; ++i) {
        xx += (x[i] - mx) * (x[i] - mx);
        xy += (x[i] - mx) * (y[i] - my);
    }
    const bool rises = xx > 1e-12 && xy > 0.0; /* more agreement is not less Dice: then the subjects are too few to tell */
    const double slope = rises ? xy / xx : 0.0;
    for (int i = 0; i < count; ++i) {
        const double leverage = 1.0 / count + (rises ? (x[i] - mx) * (x[i] - mx) / xx : 0.0);
        const double missed = (y[i] - my - slope * (x[i] - mx)) / fmax(1.0 - leverage, 1e-3);
        square += missed * missed / count;
    }
    *error = sqrt(square);
    return fmax(0.0, fmin(1.0, my + slope * (at - mx)));
}

bool atlas_disagrees(double agreement, const struct atlas_confidence *confidence)
{
    return agreement < (confidence->searched ? searched_share : least_share) * confidence->least;
}

bool atlas_judge(const struct fusion_template *template, double agreement, struct atlas_confidence *confidence)
{
    const int count = template->count < MAX_JUDGED ? template->count : MAX_JUDGED;
    double agreements[MAX_JUDGED], dices[MAX_JUDGED], labels[MAX_JUDGED][FUSION_MAX_LABELS];
    float *probability = malloc(volume_voxels(&template->image) * sizeof *probability);
    bool good = probability != NULL;
    confidence->least = INFINITY;
    confidence->most = -INFINITY;
    for (int i = 0; good && i < count; ++i) {
        good = judge(template, i * template->count / count, probability, &agreements[i], &dices[i], labels[i]);
        confidence->least = good ? fmin(confidence->least, agreements[i]) : 0.0;
        confidence->most = good ? fmax(confidence->most, agreements[i]) : 0.0;
    }
    free(probability);
    if (!good) {
        return atlas_no_memory();
    }
    for (int l = 0; l < template->label_count; ++l) {
        double sum = 0.0, square = 0.0;
        for (int i = 0; i < count; ++i) {
            sum += labels[i][l] / count;
            square += labels[i][l] * labels[i][l] / count;
        }
        confidence->label_dice[l] = sum;
        confidence->label_deviation[l] = sqrt(fmax(0.0, square - sum * sum));
    }
    confidence->known = true;
    confidence->agreement = agreement;
    confidence->dice = predict(agreements, dices, count, agreement, &confidence->dice_error);
    confidence->doubt = atlas_disagrees(agreement, confidence) ? ATLAS_DISAGREES : ATLAS_TRUSTED;
    if (confidence->doubt == ATLAS_DISAGREES) { /* the line does not reach so low */
        confidence->dice = confidence->dice_error = (double)NAN;
    }
    return true;
}
