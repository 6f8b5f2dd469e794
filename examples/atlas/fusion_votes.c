/* fusion_votes.c - weighted votes of registered subjects. */
#include "atlas/fusion.h"

#include "base/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS = 2 }; /* of a patch: 5 x 5 x 5 voxels */

static const float perfect = 1.02f; /* above 1, so that one perfect patch does not outvote all others */
static const float flat = 1e-3f;    /* variance below which a patch has no pattern, in the image's variances */
static const float around = 0.02f;  /* share of the subjects that have a voxel, from which on it counts for the trust in a template */

static size_t grid_voxels(const int dims[3]) { return (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2]; }

static int clamp(int i, int count) { return i < 0 ? 0 : i >= count ? count - 1 : i; }

/* Replaces a row by its means over the extent of a patch; beyond the border values are constant. line: length + 2 RADIUS floats. */
static void average_row(int length, float *row, float *line)
{
    for (int i = -RADIUS; i < length + RADIUS; ++i) {
        line[i + RADIUS] = row[clamp(i, length)];
    }
    for (int i = 0; i < length; ++i) {
        float sum = 0.0f;
        for (int o = 0; o <= 2 * RADIUS; ++o) {
            sum += line[i + o];
        }
        row[i] = sum / (float)(2 * RADIUS + 1);
    }
}

/* The same across rows of `length` values, `count` of them, `stride` apart. before: their values. */
static void average_across(int length, int count, size_t stride, const float *before, float *values)
{
    for (int r = 0; r < count; ++r) {
        float *out = values + (size_t)r * stride;
        for (int i = 0; i < length; ++i) {
            out[i] = 0.0f;
        }
        for (int o = -RADIUS; o <= RADIUS; ++o) {
            const float *row = before + (size_t)clamp(r + o, count) * stride;
            for (int i = 0; i < length; ++i) {
                out[i] += row[i];
            }
        }
        for (int i = 0; i < length; ++i) {
            out[i] /= (float)(2 * RADIUS + 1);
        }
    }
}

/* Returns the number of floats that average_patches works in. */
static size_t scratch_length(const int dims[3]) { return grid_voxels(dims) + (size_t)dims[0] + 2 * RADIUS; }

/* Replaces values by their means over the patches around them. */
static void average_patches(const int dims[3], float *values, float *scratch)
{
    const size_t row = (size_t)dims[0], slice = row * (size_t)dims[1], bytes = grid_voxels(dims) * sizeof *values;
    for (size_t at = 0; at < grid_voxels(dims); at += row) {
        average_row(dims[0], values + at, scratch);
    }
    memcpy(scratch, values, bytes);
    for (size_t at = 0; at < grid_voxels(dims); at += slice) {
        average_across(dims[0], dims[1], row, scratch + at, values + at);
    }
    memcpy(scratch, values, bytes);
    for (size_t at = 0; at < slice; at += row) {
        average_across(dims[0], dims[2], slice, scratch + at, values + at);
    }
}

/* Marks the voxels whose patches have a voxel of the mask. Returns NULL if memory is short. */
static bool *near_mask(const int dims[3], const float *mask)
{
    const size_t voxels = grid_voxels(dims), strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    bool *near = malloc(voxels * sizeof *near), *before = malloc(voxels * sizeof *before);
    for (size_t n = 0; near && before && n < voxels; ++n) {
        near[n] = mask[n] > 0.5f;
    }
    for (int a = 0; near && before && a < 3; ++a) {
        memcpy(before, near, voxels * sizeof *near);
        for (size_t n = 0; n < voxels; ++n) {
            const int at = (int)(n / strides[a] % (size_t)dims[a]);
            for (int o = -RADIUS; before[n] && o <= RADIUS; ++o) {
                if (at + o >= 0 && at + o < dims[a]) {
                    near[(size_t)((ptrdiff_t)n + o * (ptrdiff_t)strides[a])] = true;
                }
            }
        }
    }
    if (!before) {
        free(near);
        return NULL;
    }
    free(before);
    return near;
}

/* Computes mean and deviation of every patch. */
static void patch_moments(const int dims[3], size_t voxels, const float *values, float *mean, float *deviation, float *scratch)
{
    for (size_t n = 0; n < voxels; ++n) {
        mean[n] = values[n];
        deviation[n] = values[n] * values[n];
    }
    average_patches(dims, mean, scratch);
    average_patches(dims, deviation, scratch);
    for (size_t n = 0; n < voxels; ++n) {
        deviation[n] = sqrtf(fmaxf(flat, deviation[n] - mean[n] * mean[n]));
    }
}

bool fusion_normalize(const struct fusion_template *template, float *values)
{
    const size_t voxels = volume_voxels(&template->image);
    bool *near = near_mask(template->image.dims, template->masks + (size_t)template->self * voxels);
    double sum = 0.0, square = 0.0, count = 1e-30;
    if (!near) {
        return false;
    }
    for (size_t n = 0; n < voxels; ++n) {
        if (near[n]) {
            sum += (double)values[n];
            square += (double)values[n] * (double)values[n];
            count += 1.0;
        }
    }
    const double mean = sum / count, variance = square / count - mean * mean, gain = variance > 0.0 ? 1.0 / sqrt(variance) : 1.0;
    for (size_t n = 0; n < voxels; ++n) {
        values[n] = (float)(((double)values[n] - mean) * gain);
    }
    free(near);
    return true;
}

bool fusion_prepare(struct fusion_template *template)
{
    const size_t voxels = volume_voxels(&template->image), all = (size_t)template->count * voxels;
    float *scratch = malloc(scratch_length(template->image.dims) * sizeof *scratch);
    free(template->means);
    free(template->deviations);
    template->means = malloc(all * sizeof *template->means);
    template->deviations = malloc(all * sizeof *template->deviations);
    const bool good = scratch && template->means && template->deviations;
    for (size_t at = 0; good && at < all; at += voxels) {
        patch_moments(template->image.dims, voxels, template->images + at, template->means + at, template->deviations + at, scratch);
    }
    free(scratch);
    return good;
}

/* Returns the weight of something that correlates by r with the image. */
static float weight_of(float r)
{
    const float distance = perfect - fmaxf(-1.0f, fminf(1.0f, r));
    return 1.0f / (distance * distance * distance);
}

/* Votes on slabs of slices: a thread each. */
struct vote_loop {
    const struct fusion_template *template;
    const bool *include;
    const float *mean, *deviation; /* of the target's patches */
    const struct fusion_votes *votes;
    int slabs;
    int failed;
};

/* Some slices, and those that their patches reach besides. */
struct slab {
    int dims[3];    /* of all of them */
    size_t first;   /* voxel of the template at which they begin */
    size_t own, end; /* voxels of the template: the slices themselves */
};

static struct slab slab_of(const struct vote_loop *loop, int number)
{
    const int *dims = loop->template->image.dims;
    const size_t slice = (size_t)dims[0] * (size_t)dims[1];
    const int lo = number * dims[2] / loop->slabs, hi = (number + 1) * dims[2] / loop->slabs;
    const int from = lo > RADIUS ? lo - RADIUS : 0, to = hi + RADIUS < dims[2] ? hi + RADIUS : dims[2];
    const struct slab slab = {{dims[0], dims[1], to - from}, (size_t)from * slice, (size_t)lo * slice, (size_t)hi * slice};
    return slab;
}

/* Adds the votes of one subject, weighted by the correlation of the patches. */
static void add_votes(const struct vote_loop *loop, const struct slab *slab, int s, float *product, float *weights, float *scratch)
{
    const struct fusion_template *template = loop->template;
    const struct fusion_votes *votes = loop->votes;
    const size_t voxels = volume_voxels(&template->image), at = (size_t)s * voxels, length = grid_voxels(slab->dims);
    const float *image = template->images + at, *mask = template->masks + at;
    const float *mean = template->means + at, *deviation = template->deviations + at;
    const int *label = votes->shares ? template->labels + at : NULL;
    for (size_t n = 0; n < length; ++n) {
        product[n] = votes->target[slab->first + n] * image[slab->first + n];
    }
    average_patches(slab->dims, product, scratch);
    for (size_t n = slab->own; n < slab->end; ++n) {
        const float covariance = product[n - slab->first] - loop->mean[n] * mean[n];
        const float weight = weight_of(covariance / (loop->deviation[n] * deviation[n]));
        votes->mean[n] += mask[n];
        votes->voted[n] += weight * mask[n];
        votes->expected[n] += weight * image[n];
        weights[n - slab->first] += weight;
        if (label && label[n] > 0) {
            votes->shares[(size_t)(label[n] - 1) * voxels + n] += weight;
        }
    }
}

static bool vote_on_slab(const struct vote_loop *loop, const struct slab *slab)
{
    const struct fusion_template *template = loop->template;
    const struct fusion_votes *votes = loop->votes;
    const size_t voxels = volume_voxels(&template->image), length = grid_voxels(slab->dims);
    float *product = calloc(2 * length + scratch_length(slab->dims), sizeof *product), *weights = product + length;
    int voters = 0;
    for (int s = 0; product && s < template->count; ++s) {
        if (loop->include[s]) {
            add_votes(loop, slab, s, product, weights, weights + length);
            ++voters;
        }
    }
    for (size_t n = slab->own; product && n < slab->end; ++n) {
        const float all = fmaxf(weights[n - slab->first], 1e-12f);
        votes->mean[n] /= (float)(voters > 0 ? voters : 1);
        votes->voted[n] /= all;
        votes->expected[n] /= all;
        for (int l = 0; votes->shares && l < template->label_count; ++l) {
            votes->shares[(size_t)l * voxels + n] /= all;
        }
    }
    free(product);
    return product != NULL;
}

static void run_vote_loop(void *arg, int begin, int end)
{
    struct vote_loop *loop = arg;
    int failed = 0;
    for (int number = begin; number < end; ++number) {
        const struct slab slab = slab_of(loop, number);
        failed += !vote_on_slab(loop, &slab);
    }
    threads_lock();
    loop->failed += failed;
    threads_unlock();
}

bool fusion_vote(const struct fusion_template *template, const float *image, const bool *include, bool by_label,
                 struct fusion_votes *votes)
{
    const int *dims = template->image.dims;
    const size_t voxels = volume_voxels(&template->image), labels = by_label && template->labels ? (size_t)template->label_count : 0;
    float *moments = malloc((2 * voxels + scratch_length(dims)) * sizeof *moments);
    votes->mean = calloc((4 + labels) * voxels, sizeof *votes->mean);
    bool good = moments && votes->mean;
    if (good) {
        votes->voted = votes->mean + voxels;
        votes->expected = votes->voted + voxels;
        votes->target = votes->expected + voxels;
        votes->shares = labels > 0 ? votes->target + voxels : NULL;
        memcpy(votes->target, image, voxels * sizeof *image);
        good = fusion_normalize(template, votes->target);
    }
    if (good) {
        patch_moments(dims, voxels, votes->target, moments, moments + voxels, moments + 2 * voxels);
        struct vote_loop loop = {template, include, moments, moments + voxels, votes, threads_count(), 0};
        threads_for(loop.slabs, 1, run_vote_loop, &loop);
        good = loop.failed == 0;
    }
    free(moments);
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
