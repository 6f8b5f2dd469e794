/* fusion_votes.c - weighted votes of registered subjects. */
#include "atlas/fusion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS = 2 }; /* of a patch: 5 x 5 x 5 voxels */

static const float perfect = 1.02f; /* above 1, so that one perfect patch does not outvote all others */
static const float flat = 1e-3f;    /* variance below which a patch has no pattern, in the image's variances */
static const float around = 0.02f;  /* share of the subjects that have a voxel, from which on it counts for the trust in a template */

/* Replaces values by their mean over a patch's extent along one axis; beyond the border values are constant. */
static void average_axis(const int dims[3], int axis, float *values, float *line)
{
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    const int b = (axis + 1) % 3, c = (axis + 2) % 3, length = dims[axis];
    for (int q = 0; q < dims[c]; ++q) {
        for (int p = 0; p < dims[b]; ++p) {
            float *at = values + (size_t)p * strides[b] + (size_t)q * strides[c];
            for (int i = 0; i < length; ++i) {
                line[i] = at[(size_t)i * strides[axis]];
            }
            for (int i = 0; i < length; ++i) {
                float sum = 0.0f;
                for (int o = -RADIUS; o <= RADIUS; ++o) {
                    sum += line[i + o < 0 ? 0 : i + o >= length ? length - 1 : i + o];
                }
                at[(size_t)i * strides[axis]] = sum / (float)(2 * RADIUS + 1);
            }
        }
    }
}

static void average_patches(const int dims[3], float *values, float *line)
{
    for (int axis = 0; axis < 3; ++axis) {
        average_axis(dims, axis, values, line);
    }
}

static size_t line_length(const int dims[3])
{
    const int longest = dims[0] > dims[1] ? dims[0] : dims[1];
    return (size_t)(longest > dims[2] ? longest : dims[2]);
}

/* Returns true if the patch around voxel n has a voxel of the mask. */
static bool near_mask(const int dims[3], const float *mask, size_t n)
{
    int place[3];
    volume_place(dims, n, place);
    for (int k = place[2] - RADIUS; k <= place[2] + RADIUS; ++k) {
        for (int j = place[1] - RADIUS; j <= place[1] + RADIUS; ++j) {
            for (int i = place[0] - RADIUS; i <= place[0] + RADIUS; ++i) {
                if (i >= 0 && j >= 0 && k >= 0 && i < dims[0] && j < dims[1] && k < dims[2]
                    && mask[(size_t)i + (size_t)dims[0] * ((size_t)j + (size_t)dims[1] * (size_t)k)] > 0.5f) {
                    return true;
                }
            }
        }
    }
    return false;
}

/* Computes mean and deviation of every patch. */
static void patch_moments(const int dims[3], size_t voxels, const float *values, float *mean, float *deviation, float *line)
{
    for (size_t n = 0; n < voxels; ++n) {
        mean[n] = values[n];
        deviation[n] = values[n] * values[n];
    }
    average_patches(dims, mean, line);
    average_patches(dims, deviation, line);
    for (size_t n = 0; n < voxels; ++n) {
        deviation[n] = sqrtf(fmaxf(flat, deviation[n] - mean[n] * mean[n]));
    }
}

void fusion_normalize(const struct fusion_template *template, float *values)
{
    const size_t voxels = volume_voxels(&template->image);
    const float *mask = template->masks + (size_t)template->self * voxels;
    double sum = 0.0, square = 0.0, count = 1e-30;
    for (size_t n = 0; n < voxels; ++n) {
        if (near_mask(template->image.dims, mask, n)) {
            sum += (double)values[n];
            square += (double)values[n] * (double)values[n];
            count += 1.0;
        }
    }
    const double mean = sum / count, variance = square / count - mean * mean, gain = variance > 0.0 ? 1.0 / sqrt(variance) : 1.0;
    for (size_t n = 0; n < voxels; ++n) {
        values[n] = (float)(((double)values[n] - mean) * gain);
    }
}

bool fusion_prepare(struct fusion_template *template)
{
    const size_t voxels = volume_voxels(&template->image), all = (size_t)template->count * voxels;
    float *line = malloc(line_length(template->image.dims) * sizeof *line);
    free(template->means);
    free(template->deviations);
    template->means = malloc(all * sizeof *template->means);
    template->deviations = malloc(all * sizeof *template->deviations);
    const bool good = line && template->means && template->deviations;
    for (size_t at = 0; good && at < all; at += voxels) {
        patch_moments(template->image.dims, voxels, template->images + at, template->means + at, template->deviations + at, line);
    }
    free(line);
    return good;
}

/* Returns the weight of something that correlates by r with the image. */
static float weight_of(float r)
{
    const float distance = perfect - fmaxf(-1.0f, fminf(1.0f, r));
    return 1.0f / (distance * distance * distance);
}

struct work {
    float *mean, *deviation; /* of the target's patches */
    float *product, *weights, *line;
};

/* Adds the vote of one subject, weighted by the correlation of the patches. */
static void add_vote(const struct fusion_template *template, int s, const struct work *work, struct fusion_votes *votes)
{
    const size_t voxels = volume_voxels(&template->image), at = (size_t)s * voxels;
    const float *image = template->images + at, *mask = template->masks + at;
    const float *mean = template->means + at, *deviation = template->deviations + at;
    for (size_t n = 0; n < voxels; ++n) {
        work->product[n] = votes->target[n] * image[n];
    }
    average_patches(template->image.dims, work->product, work->line);
    for (size_t n = 0; n < voxels; ++n) {
        const float covariance = work->product[n] - work->mean[n] * mean[n];
        const float weight = weight_of(covariance / (work->deviation[n] * deviation[n]));
        votes->mean[n] += mask[n];
        votes->voted[n] += weight * mask[n];
        votes->expected[n] += weight * image[n];
        work->weights[n] += weight;
    }
}

bool fusion_vote(const struct fusion_template *template, const float *image, const bool *include, struct fusion_votes *votes)
{
    const size_t voxels = volume_voxels(&template->image);
    float *all = calloc(4 * voxels + line_length(template->image.dims), sizeof *all);
    const struct work work = {all, all + voxels, all + 2 * voxels, all + 3 * voxels, all + 4 * voxels};
    int voters = 0;
    votes->mean = calloc(4 * voxels, sizeof *votes->mean);
    votes->voted = votes->mean + voxels;
    votes->expected = votes->voted + voxels;
    votes->target = votes->expected + voxels;
    const bool good = all && votes->mean;
    if (good) {
        memcpy(votes->target, image, voxels * sizeof *image);
        fusion_normalize(template, votes->target);
        patch_moments(template->image.dims, voxels, votes->target, work.mean, work.deviation, work.line);
    }
    for (int s = 0; good && s < template->count; ++s) {
        if (include[s]) {
            add_vote(template, s, &work, votes);
            ++voters;
        }
    }
    for (size_t n = 0; good && n < voxels; ++n) {
        votes->mean[n] /= (float)(voters > 0 ? voters : 1);
        votes->voted[n] /= fmaxf(work.weights[n], 1e-12f);
        votes->expected[n] /= fmaxf(work.weights[n], 1e-12f);
    }
    free(all);
    return good;
}

double fusion_correlation(const struct fusion_template *template, const struct fusion_votes *votes)
{
    double a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0, count = 1e-30;
    for (size_t n = 0; n < volume_voxels(&template->image); ++n) {
        if (votes->mean[n] > around) {
            const double x = (double)votes->target[n], y = (double)votes->expected[n];
            a += x, b += y, aa += x * x, bb += y * y, ab += x * y, count += 1.0;
        }
    }
    const double spread = (aa - a * a / count) * (bb - b * b / count);
    return spread > 0.0 ? (ab - a * b / count) / sqrt(spread) : 0.0;
}

float fusion_trust(const struct fusion_template *template, const struct fusion_votes *votes)
{
    return weight_of((float)fusion_correlation(template, votes));
}

void fusion_votes_free(struct fusion_votes *votes)
{
    free(votes->mean); /* the others lie behind it */
    memset(votes, 0, sizeof *votes);
}
