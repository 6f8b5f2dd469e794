#include "registration/register.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "imaging/resample.h"
#include "imaging/segment_image.h"
#include "registration/vgrid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RELATION_PASSES = 2, COARSE_PASSES = 4 }; /* on each grid: one brings the images closer, which makes their relation clearer */
enum { PATIENCE = 10 }; /* iterations in which the difference must fall by `min_gain` */
static const float min_gain = 0.01f;
static const float iterating_step = 0.5f, final_step = 0.05f; /* length of the first step of exp, voxels */
static const float nearly_one = 0.8f; /* common share of two windows from which on they count as one scale */
static const float noise_gradient = 0.01f; /* per voxel: a force needs a gradient above it; without, flat ground would move. */
static const float noise_gradient_local = 0.1f; /* The same of REGISTER_LCC and REGISTER_MIND, whose values have their own range */
static const float local_sigma = 3.0f, local_floor = 0.05f;   /* for REGISTER_LCC: voxels; intensity, range 0..1 */
static const double shading_shows = 0.12; /* share of what a line leaves unexplained that shading explains: a motion alone shows up
                                             to .07, a ramp of .7 to 1.3 shows .21 */
static const double explains_something = 0.3; /* share of the variance that a line explains, for intensities to count as alike */
static const double explains_much = 0.6;      /* and for them to do so before any deformation is known */
static const double unrelated = 0.3; /* share of the variance that has to be explained, else REGISTER_MIND */
enum { DESCRIPTORS = 6 };           /* channels of REGISTER_MIND */
static const float patch_sigma = 1.0f; /* its patches, voxels */

struct register_settings register_defaults(void)
{
    const struct register_settings settings = {.align = REGISTER_ALIGN_RIGID, .similarity = REGISTER_SSD, .iterations = 100,
                                               .update_sigma = 2.0f, .velocity_sigma = 0.5f, .longest_update = 1.0f};
    return settings;
}

/* ---- images ---- */

bool register_window_of(const struct volume *image, struct register_window *window)
{
    window->low = segment_percentile(image, 0.005);
    window->high = segment_percentile(image, 0.995);
    if (!(window->high > window->low)) { /* nearly all voxels are equal, as for a small object */
        window->low = image->minimum;
        window->high = image->maximum;
    }
    return window->high > window->low;
}

/* The same of an image of which minimum and maximum are not known. */
static bool window_of_known(struct volume *image, struct register_window *window)
{
    image->minimum = INFINITY;
    image->maximum = -INFINITY;
    image->replaced = 0;
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        if (isfinite(image->data[n])) {
            image->minimum = fminf(image->minimum, image->data[n]);
            image->maximum = fmaxf(image->maximum, image->data[n]);
        }
    }
    return register_window_of(image, window);
}

/* Takes a window of values that another window has normalized back to intensities. */
static void in_units(struct register_window whole, struct register_window *window)
{
    window->low = whole.low + window->low * (whole.high - whole.low);
    window->high = whole.low + window->high * (whole.high - whole.low);
}

/* Divides by what the same smoothing makes of ones and zeros, so that what has no data weighs nothing; puts the gaps back. */
static void divide_known(float *values, const float *known, const float *image, size_t count)
{
    for (size_t n = 0; n < count; ++n) {
        values[n] = isfinite(image[n]) ? values[n] / known[n] : NAN;
    }
}

static bool has_gaps(const float *values, size_t count)
{
    for (size_t n = 0; n < count; ++n) {
        if (!isfinite(values[n])) {
            return true;
        }
    }
    return false;
}

/* Prepares values: normalized, without outliers and without details that cubes of `side` mm cannot represent. */
static bool prepare(const struct volume *image, struct register_window window, float side, float *values)
{
    const size_t count = volume_voxels(image);
    for (size_t n = 0; n < count; ++n) {
        const float value = fmaxf(-0.5f, fminf(1.5f, (image->data[n] - window.low) / (window.high - window.low)));
        values[n] = isfinite(image->data[n]) ? value : 0.0f;
    }
    if (!has_gaps(image->data, count)) {
        return segment_blur(image, side, values);
    }
    float *known = malloc(count * sizeof *known);
    for (size_t n = 0; known && n < count; ++n) {
        known[n] = isfinite(image->data[n]) ? 1.0f : 0.0f;
    }
    const bool good = known && segment_blur(image, side, values) && segment_blur(image, side, known);
    if (good) {
        divide_known(values, known, image->data, count);
    }
    free(known);
    return good;
}

/* Smooths where there are data. */
static bool smooth_known(const int dims[3], float sigma, float *values, float *scratch)
{
    const size_t count = vgrid_voxels(dims);
    if (!has_gaps(values, count)) {
        return vgrid_smooth(dims, 1, sigma, values, scratch);
    }
    float *known = malloc(count * sizeof *known), *image = malloc(count * sizeof *image);
    for (size_t n = 0; known && image && n < count; ++n) {
        image[n] = values[n];
        known[n] = isfinite(values[n]) ? 1.0f : 0.0f;
        values[n] = isfinite(values[n]) ? values[n] : 0.0f;
    }
    const bool good = known && image && vgrid_smooth(dims, 1, sigma, values, scratch) && vgrid_smooth(dims, 1, sigma, known, scratch);
    if (good) {
        divide_known(values, known, image, count);
    }
    free(known);
    free(image);
    return good;
}

/* Finds means and deviations of an image about each place, of the voxels that are known. */
static bool local_moments(const int dims[3], const float *image, float sigma, float *mean, float *deviation, float *scratch)
{
    const size_t total = vgrid_voxels(dims);
    for (size_t n = 0; n < total; ++n) {
        mean[n] = image[n];
        deviation[n] = image[n] * image[n];
    }
    if (!smooth_known(dims, sigma, mean, scratch) || !smooth_known(dims, sigma, deviation, scratch)) {
        return false;
    }
    for (size_t n = 0; n < total; ++n) {
        deviation[n] = sqrtf(fmaxf(0.0f, deviation[n] - mean[n] * mean[n]) + local_floor * local_floor);
    }
    return true;
}

/* Computes (I - local mean) / local deviation, whose squared differences measure the local correlation. */
static bool normalize_locally(const int dims[3], float *image)
{
    const size_t total = vgrid_voxels(dims);
    float *mean = malloc(total * sizeof *mean), *deviation = malloc(total * sizeof *deviation);
    float *scratch = malloc(total * sizeof *scratch);
    const bool good = mean && deviation && scratch && local_moments(dims, image, local_sigma, mean, deviation, scratch);
    for (size_t n = 0; good && n < total; ++n) {
        image[n] = (image[n] - mean[n]) / deviation[n];
    }
    free(mean);
    free(deviation);
    free(scratch);
    return good;
}

/* Computes (I(x) - I(x + step))^2, smoothed: the distance of two patches. */
static bool patch_distance(const int dims[3], const float *image, int channel, float *distance, float *scratch)
{
    const int axis = channel / 2, step = channel % 2 ? 1 : -1;
    size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                int at[3] = {i, j, k};
                at[axis] += step;
                at[axis] = at[axis] < 0 ? 0 : at[axis] < dims[axis] ? at[axis] : dims[axis] - 1;
                const float d = image[n] - image[(size_t)at[0] + (size_t)dims[0] * ((size_t)at[1] + (size_t)dims[1] * (size_t)at[2])];
                distance[n] = d * d;
            }
        }
    }
    return smooth_known(dims, patch_sigma, distance, scratch);
}

/* Computes the descriptors exp(-D / V) of a scalar image: D the distances to the patches of the six neighbours, V their mean; the
 * largest is 1. channels: DESCRIPTORS planes. The image is made up by its structure alone: values cancel. */
static bool describe(const int dims[3], const float *image, float *channels)
{
    const size_t total = vgrid_voxels(dims);
    float *scratch = malloc(total * sizeof *scratch);
    bool good = scratch != NULL;
    double sum = 0.0, number = 1.0;
    for (int c = 0; good && c < DESCRIPTORS; ++c) {
        good = patch_distance(dims, image, c, channels + (size_t)c * total, scratch);
        for (size_t n = 0; good && n < total; ++n) {
            const float d = channels[(size_t)c * total + n];
            sum += isfinite(d) ? (double)d : 0.0;
            number += isfinite(d) ? 1.0 : 0.0;
        }
    }
    const float least = fmaxf(1e-8f, (float)(0.1 * sum / number)); /* flat ground has no structure but noise */
    for (size_t n = 0; good && n < total; ++n) {
        float mean = 0.0f, smallest = INFINITY;
        for (size_t c = 0; c < DESCRIPTORS; ++c) {
            mean += channels[c * total + n] / (float)DESCRIPTORS;
            smallest = fminf(smallest, channels[c * total + n]);
        }
        for (size_t c = 0; c < DESCRIPTORS; ++c) {
            channels[c * total + n] = expf((smallest - channels[c * total + n]) / fmaxf(mean, least)) + 0.0f * mean;
        }
    }
    free(scratch);
    return good;
}

void register_identity(double map[3][4])
{
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 4; ++c) {
            map[r][c] = r == c ? 1.0 : 0.0;
        }
    }
}

static void invert_affine(const double m[3][4], double out[3][4])
{
    double determinant = 0.0;
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) { /* cofactors, cyclic indices carry the sign */
            const int r1 = (c + 1) % 3, r2 = (c + 2) % 3, c1 = (r + 1) % 3, c2 = (r + 2) % 3;
            out[r][c] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        }
    }
    for (int c = 0; c < 3; ++c) {
        determinant += m[0][c] * out[c][0];
    }
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
            out[r][c] /= determinant;
        }
        out[r][3] = -(out[r][0] * m[0][3] + out[r][1] * m[1][3] + out[r][2] * m[2][3]);
    }
}

/* ---- demons on one grid ---- */

struct demons {
    int dims[3];
    size_t total;
    size_t channels;
    float guard;               /* noise_gradient^2 */
    float *fixed, *moving;     /* on this grid, `channels` planes; `moving` already through the affine map; NaN: no data */
    unsigned char *valid;      /* 1 where the moving image is defined */
    float *v, *exp_v, *update; /* 3 a voxel */
    float *best;               /* the velocity of the smallest difference, */
    double least;              /* which is this */
    float *warped;             /* `channels` planes */
    float *scratch;
    double *slices; /* squared differences and numbers of voxels, by slice */
};

static void demons_free(struct demons *d)
{
    free(d->fixed);
    free(d->moving);
    free(d->valid);
    free(d->v);
    free(d->exp_v);
    free(d->update);
    free(d->best);
    free(d->warped);
    free(d->scratch);
    free(d->slices);
    memset(d, 0, sizeof *d);
}

static bool demons_create(const int dims[3], size_t channels, struct demons *d)
{
    memset(d, 0, sizeof *d);
    d->least = INFINITY;
    memcpy(d->dims, dims, sizeof d->dims);
    d->total = vgrid_voxels(dims);
    d->channels = channels;
    d->fixed = malloc(channels * d->total * sizeof *d->fixed);
    d->moving = malloc(channels * d->total * sizeof *d->moving);
    d->warped = malloc(channels * d->total * sizeof *d->warped);
    d->best = malloc(3 * d->total * sizeof *d->best);
    d->valid = malloc(d->total);
    d->v = calloc(3 * d->total, sizeof *d->v);
    d->exp_v = malloc(3 * d->total * sizeof *d->exp_v);
    d->update = malloc(3 * d->total * sizeof *d->update);
    d->scratch = malloc(3 * d->total * sizeof *d->scratch);
    d->slices = malloc(2 * (size_t)dims[2] * sizeof *d->slices);
    if (d->fixed && d->moving && d->warped && d->valid && d->v && d->exp_v && d->update && d->best && d->scratch
        && d->slices) {
        return true;
    }
    demons_free(d);
    return false;
}

/* Computes twice the gradient of `image`, per voxel, at a voxel inside. */
static inline void add_gradient(const int dims[3], const float *image, size_t n, const int place[3], float gradient[3])
{
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    for (int a = 0; a < 3; ++a) {
        const size_t up = place[a] + 1 < dims[a] ? strides[a] : 0, down = place[a] > 0 ? strides[a] : 0;
        gradient[a] += image[n + up] - image[n - down];
    }
}

/* Returns true if the pair of voxel n and its mapped place is valid; at_place: checks the mask there, else at n. */
static inline bool counts(const struct demons *d, const float *u, size_t n, const int place[3], bool at_place)
{
    float x[3];
    for (int a = 0; a < 3; ++a) {
        x[a] = (float)place[a] + u[3 * n + (size_t)a];
    }
    if (!resample_in_box(d->dims, x)) {
        return false;
    }
    if (!at_place) {
        return d->valid[n] != 0;
    }
    size_t at = 0;
    for (int a = 2; a >= 0; --a) {
        const int nearest = (int)(fmaxf(0.0f, x[a]) + 0.5f);
        at = at * (size_t)d->dims[a] + (size_t)(nearest < d->dims[a] ? nearest : d->dims[a] - 1);
    }
    return d->valid[at] != 0;
}

struct forces_loop {
    const struct demons *d;
    const float *still;
    bool still_is_moving;
    float weight;
    float damping;
    const int *dims;
};

static void run_forces_loop(void *arg, int begin, int end)
{
    const struct forces_loop *loop = arg;
    const struct demons *d = loop->d;
    const float *still = loop->still;
    const bool still_is_moving = loop->still_is_moving;
    const float weight = loop->weight;
    const float damping = loop->damping;
    const int *dims = loop->dims;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * (size_t)dims[0] * (size_t)dims[1];
        double sum = 0.0, number = 0.0;
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                float force[3] = {0.0f, 0.0f, 0.0f}, square = d->guard, squares = 0.0f;
                if (!counts(d, d->exp_v, n, place, !still_is_moving)) {
                    continue;
                }
                for (size_t c = 0; c < d->channels; ++c) {
                    float gradient[3] = {0.0f, 0.0f, 0.0f};
                    const float *a = still + c * d->total, *b = d->warped + c * d->total;
                    const float difference = a[n] - b[n];
                    add_gradient(dims, a, n, place, gradient);
                    add_gradient(dims, b, n, place, gradient);
                    vec3_add_scaled(force, 0.25f * difference, gradient, force);
                    square += 0.0625f * vec3_dot(gradient, gradient);
                    squares += difference * difference;
                }
                if (!isfinite(square) || !isfinite(squares)) { /* no data here or beside */
                    continue;
                }
                const float factor = weight / (square + damping * squares);
                vec3_add_scaled(d->update + 3 * n, factor, force, d->update + 3 * n);
                sum += (double)squares;
                number += 1.0;
            }
        }
        d->slices[2 * k] = sum;
        d->slices[2 * k + 1] = number;
    }
}

/* Adds `weight` times the demons' update that moves `warped` = other o exp(+-v) towards `still`; exp_v is exp(+-v):
 *   u = (still - warped) J / (|J|^2 + (still - warped)^2 / (2 longest)^2 + noise_gradient^2),   J = (grad still + grad warped) / 2
 * (eq. 5 of the 2009 paper, efficient second-order minimization; |u| <= longest), each product and square summed over the channels.
 * Returns the mean squared difference, NaN where no voxel counts. */
static double add_forces(const struct demons *d, const float *still, bool still_is_moving, float longest, float weight)
{
    const float damping = 1.0f / (4.0f * longest * longest);
    const int *dims = d->dims;
    struct forces_loop loop = {d, still, still_is_moving, weight, damping, dims};
    threads_for(dims[2], 1, run_forces_loop, &loop);
    double sum = 0.0, number = 0.0;
    for (int k = 0; k < dims[2]; ++k) {
        sum += d->slices[2 * k];
        number += d->slices[2 * k + 1];
    }
    return number > 0.0 ? sum / number : (double)NAN;
}

static void warp_channels(const struct demons *d, const float *image)
{
    for (size_t c = 0; c < d->channels; ++c) {
        vgrid_warp(d->dims, image + c * d->total, d->exp_v, d->warped + c * d->total);
    }
}

/* Returns the mean of the differences of both sides; where no voxel counts on one, the other's. */
static double mean_difference(double a, double b) { return isnan(a) ? b : isnan(b) ? a : 0.5 * (a + b); }

/* Updates v <- G_velocity * (v + G_update * (u_forward - u_back) / 2); computes the mean squared difference before it, NaN where no
 * voxel counts: v stays. */
static bool iterate(struct demons *d, const struct register_settings *set, double *difference)
{
    const float half = set->one_sided ? 1.0f : 0.5f;
    memset(d->update, 0, 3 * d->total * sizeof *d->update);
    vgrid_exp(d->dims, d->v, 1.0f, iterating_step, d->exp_v, d->scratch);
    warp_channels(d, d->moving);
    *difference = add_forces(d, d->fixed, false, set->longest_update, half);
    if (!set->one_sided) {
        vgrid_exp(d->dims, d->v, -1.0f, iterating_step, d->exp_v, d->scratch);
        warp_channels(d, d->fixed);
        *difference = mean_difference(*difference, add_forces(d, d->moving, true, set->longest_update, -half));
    }
    if (isnan(*difference)) {
        return true;
    }
    if (*difference < d->least) {
        d->least = *difference;
        memcpy(d->best, d->v, 3 * d->total * sizeof *d->v);
    }
    if (!vgrid_smooth(d->dims, 3, set->update_sigma, d->update, d->scratch)) {
        return false;
    }
    for (size_t n = 0; n < 3 * d->total; ++n) {
        d->v[n] += d->update[n];
    }
    return vgrid_smooth(d->dims, 3, set->velocity_sigma, d->v, d->scratch);
}

/* Iterates while the difference falls, and goes back to where it was smallest. */
static bool run_level(struct demons *d, const struct register_settings *set, struct register_level *level)
{
    double history[PATIENCE];
    d->least = INFINITY;
    for (level->iterations = 0; level->iterations < set->iterations; ++level->iterations) {
        double difference = 0.0, *slot = &history[level->iterations % PATIENCE];
        if (!iterate(d, set, &difference)) {
            return false;
        }
        level->start = level->iterations == 0 ? difference : level->start;
        if (isnan(difference) || difference == 0.0) { /* nothing to compare, or an image and itself */
            break;
        }
        if (level->iterations >= PATIENCE && difference > (1.0 - (double)min_gain) * *slot) {
            break;
        }
        *slot = difference;
    }
    level->end = isfinite(d->least) ? d->least : (double)NAN;
    if (isfinite(d->least)) {
        memcpy(d->v, d->best, 3 * d->total * sizeof *d->v);
    }
    return true;
}

/* ---- pyramid ---- */

struct transfer_loop {
    const struct volume *from;
    const float *v;
    const struct volume *to;
    float *out;
    float ratio;
    const float (*m)[4];
};

static void run_transfer_loop(void *arg, int begin, int end)
{
    const struct transfer_loop *loop = arg;
    const struct volume *from = loop->from;
    const float *v = loop->v;
    const struct volume *to = loop->to;
    float *out = loop->out;
    const float ratio = loop->ratio;
    const float (*m)[4] = loop->m;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * (size_t)to->dims[0] * (size_t)to->dims[1];
        for (int j = 0; j < to->dims[1]; ++j) {
            for (int i = 0; i < to->dims[0]; ++i, ++n) {
                float x[3];
                resample_place(m, i, j, k, x);
                vgrid_sample(from->dims, 3, v, x, out + 3 * n);
                for (size_t c = 0; c < 3; ++c) {
                    out[3 * n + c] *= ratio;
                }
            }
        }
    }
}

/* Resamples velocities from one grid of cubes to another, each in its own voxels. */
static void transfer(const struct volume *from, const float *v, const struct volume *to, float *out)
{
    const float ratio = from->spacing[0] / to->spacing[0];
    float m[3][4];
    resample_map(to, NULL, from, m);
    struct transfer_loop loop = {from, v, to, out, ratio, (const float(*)[4])m};
    threads_for(to->dims[2], 1, run_transfer_loop, &loop);
}

struct pair {
    const struct volume *fixed, *moving;
    struct register_window fixed_window, moving_window;
    float *fixed_values, *moving_values; /* prepared, on the images' own grids */
};

static bool prepare_pair(struct pair *pair, float side)
{
    return prepare(pair->fixed, pair->fixed_window, side, pair->fixed_values)
           && prepare(pair->moving, pair->moving_window, side, pair->moving_values);
}

/* Returns true if shading explains more of what a line leaves than a motion could, and more than the relation found. */
static bool is_shaded(const struct demons *d, double line_leaves, const struct relation *found)
{
    const double share = relation_shading(d->fixed, d->warped, d->dims);
    return share > shading_shows && (found->kind == RELATION_LINE || (1.0 - share) * line_leaves < 1.0 - found->explained);
}

/* Chooses how the images are compared, from the pairs that the present map brings together: d->warped beside d->fixed. first: no
 * deformation is known yet. One looks like a curve of intensities (a ball that shrinks darkens its rim), so that a line that
 * explains something comes first. */
static bool choose(const struct demons *d, const struct register_settings *set, bool first, struct registration *reg)
{
    struct relation found;
    if (set->one_scale) {
        return true;
    }
    if (!relation_fit(d->fixed, d->warped, d->total, RELATION_LINE, &found)) {
        return false;
    }
    const double line_leaves = 1.0 - found.explained;
    if (!(first && found.explained > explains_much) && !relation_choose(d->fixed, d->warped, d->total, &found)) {
        return false;
    }
    if (reg->relation.kind != RELATION_SAME || found.kind != RELATION_LINE) {
        reg->relation = found;
    }
    if (set->similarity != REGISTER_AUTO || (first && reg->relation.kind == RELATION_SAME)) {
        return true;
    }
    if (is_shaded(d, line_leaves, &found)) {
        reg->shaded = true; /* and stays so: the images are closer after each level, so that it shows less */
    } else if (!first && found.explained < unrelated) {
        reg->similarity = REGISTER_MIND;
    }
    return true;
}

/* Warps the moving image by the present velocity, NaN beyond its box. */
static void warp_known(struct demons *d)
{
    vgrid_exp(d->dims, d->v, 1.0f, iterating_step, d->exp_v, d->scratch);
    warp_channels(d, d->moving);
    for (int k = 0; k < d->dims[2]; ++k) {
        size_t n = (size_t)k * (size_t)d->dims[0] * (size_t)d->dims[1];
        for (int j = 0; j < d->dims[1]; ++j) {
            for (int i = 0; i < d->dims[0]; ++i, ++n) {
                d->warped[n] = counts(d, d->exp_v, n, (const int[3]){i, j, k}, true) ? d->warped[n] : NAN;
            }
        }
    }
}

/* Takes the shading from the moving image: a gain and an offset that change slowly across space, from the pairs that the present map
 * brings together. Where these do not determine it, the line stands in. */
static void match_shading(struct demons *d, const struct relation *line)
{
    double shading[RELATION_SHADING];
    if (!relation_fit_shading(d->fixed, d->warped, d->dims, d->exp_v, line, shading)) {
        relation_apply(line, d->moving, d->total);
        return;
    }
    for (size_t n = 0; n < d->total; ++n) {
        int place[3];
        volume_place(d->dims, n, place);
        d->moving[n] = relation_unshade((const double *)shading, d->dims,
                                        (const float[3]){(float)place[0], (float)place[1], (float)place[2]}, d->moving[n]);
    }
}

/* Turns the images of a level into its channels. */
static bool make_channels(struct demons *d, enum register_similarity similarity)
{
    if (similarity == REGISTER_LCC) {
        return normalize_locally(d->dims, d->fixed) && normalize_locally(d->dims, d->moving);
    }
    if (similarity != REGISTER_MIND) {
        return true;
    }
    float *images[2] = {d->fixed, d->moving}, *channels[2], *warped = realloc(d->warped, DESCRIPTORS * d->total * sizeof *warped);
    bool good = warped != NULL;
    d->warped = warped ? warped : d->warped;
    for (int i = 0; i < 2; ++i) {
        channels[i] = malloc(DESCRIPTORS * d->total * sizeof *channels[i]);
        good = good && channels[i] && describe(d->dims, images[i], channels[i]);
        free(images[i]);
    }
    d->fixed = channels[0];
    d->moving = channels[1];
    d->channels = DESCRIPTORS;
    return good;
}

/* Samples both images on the grid of a level; d->v is the first guess. Intensities are brought to one scale once a level: in
 * every iteration they would follow the motion that follows them. */
static bool fill_level(struct pair *pair, const struct volume *grid, const struct register_settings *set, bool first,
                       struct registration *reg, struct demons *d)
{
    if (!prepare_pair(pair, grid->spacing[0])) {
        return false;
    }
    resample_volume(pair->fixed, pair->fixed_values, NULL, grid, d->fixed, NULL);
    resample_volume(pair->moving, pair->moving_values, (const double(*)[4])reg->affine, grid, d->moving, d->valid);
    if (reg->similarity == REGISTER_SSD) {
        warp_known(d);
        if (!choose(d, set, first, reg)) {
            return false;
        }
    }
    if (reg->similarity == REGISTER_SSD && reg->shaded) {
        struct relation line;
        if (!relation_fit(d->fixed, d->warped, d->total, RELATION_LINE, &line)) {
            return false;
        }
        match_shading(d, &line);
    } else if (reg->similarity == REGISTER_SSD) {
        relation_apply(&reg->relation, relation_of_fixed(&reg->relation) ? d->fixed : d->moving, d->total);
    }
    const float gradient = reg->similarity == REGISTER_SSD ? noise_gradient : noise_gradient_local;
    d->guard = gradient * gradient;
    return make_channels(d, reg->similarity);
}

/* Makes cubes over the fixed image, without data. */
static bool level_grid(const struct volume *fixed, float side, struct volume *grid)
{
    if (!volume_create_cubes(fixed, side, 0, grid)) {
        return false;
    }
    free(grid->data);
    grid->data = NULL;
    return true;
}

static bool demons_level(struct pair *pair, const struct register_settings *set, float side, const struct registration *start,
                         struct registration *reg, struct register_level *level)
{
    struct demons d;
    struct volume grid;
    level->side = side;
    if (!level_grid(pair->fixed, side, &grid) || !demons_create(grid.dims, 1, &d)) {
        return false;
    }
    if (reg->velocity) {
        transfer(&reg->grid, reg->velocity, &grid, d.v);
    } else if (start) {
        transfer(&start->grid, start->velocity, &grid, d.v);
    }
    const bool guessed = reg->velocity || start;
    bool good = true;
    int passes = level > reg->levels || reg->level_count == 1 ? COARSE_PASSES : RELATION_PASSES;
    for (int pass = 0; good && pass < passes; ++pass) {
        good = fill_level(pair, &grid, set, pass == 0 && !guessed, reg, &d) && run_level(&d, set, level);
        passes = reg->relation.kind == RELATION_SAME || reg->similarity != REGISTER_SSD ? 1 : passes;
    }
    free(reg->velocity);
    volume_free(&reg->grid);
    reg->grid = grid;
    reg->velocity = d.v;
    d.v = NULL;
    demons_free(&d);
    return good;
}

static bool exponentiate(struct registration *reg)
{
    const size_t bytes = 3 * volume_voxels(&reg->grid) * sizeof(float);
    float *scratch = malloc(bytes);
    reg->forward = malloc(bytes);
    reg->inverse = malloc(bytes);
    const bool good = scratch && reg->forward && reg->inverse;
    if (good) {
        vgrid_exp(reg->grid.dims, reg->velocity, 1.0f, final_step, reg->forward, scratch);
        vgrid_exp(reg->grid.dims, reg->velocity, -1.0f, final_step, reg->inverse, scratch);
    }
    free(scratch);
    return good;
}

/* Returns the common part of two windows as a share of their union. */
static float shared(const struct register_window *a, const struct register_window *b)
{
    return (fminf(a->high, b->high) - fmaxf(a->low, b->low)) / (fmaxf(a->high, b->high) - fminf(a->low, b->low));
}

/* Takes one window for both images where one scale is requested, or where their windows nearly agree over the voxels that the map
 * brings together: over the whole images they also show how much air each has. */
static bool choose_scale(struct pair *pair, const struct volume *fixed, const struct volume *moving, const struct register_settings *set,
                         struct registration *reg)
{
    struct volume a = *fixed, b = *fixed;
    struct relation line;
    struct register_window f, m, *whole[2] = {&pair->fixed_window, &pair->moving_window};
    const size_t total = volume_voxels(fixed);
    a.data = malloc(total * sizeof *a.data);
    b.data = malloc(total * sizeof *b.data);
    const bool good = a.data && b.data;
    if (good) {
        register_through(moving, (const double(*)[4])reg->affine, fixed, b.data);
        for (size_t n = 0; n < total; ++n) {
            a.data[n] = isfinite(b.data[n]) ? fixed->data[n] : NAN;
            b.data[n] = isfinite(fixed->data[n]) ? b.data[n] : NAN;
        }
        const bool vary = window_of_known(&a, &f) && window_of_known(&b, &m);
        in_units(*whole[0], &f);
        in_units(*whole[1], &m);
        const bool alike = vary && relation_fit(a.data, b.data, total, RELATION_LINE, &line) && line.gain > 0.0f
                           && line.explained > explains_something && shared(&f, &m) > nearly_one;
        if (set->one_scale || alike) {
            reg->relation.kind = RELATION_SAME;
            whole[0]->low = whole[1]->low = fminf(whole[0]->low, whole[1]->low);
            whole[0]->high = whole[1]->high = fmaxf(whole[0]->high, whole[1]->high);
        }
    }
    free(a.data);
    free(b.data);
    return good;
}

/* Finds the affine map on the coarser half of the grids, where demons would need many iterations for it. *overlap: false where the
 * images do not. */
static bool align(struct pair *pair, const struct register_settings *set, float finest, int levels, struct registration *reg,
                  bool *overlap)
{
    bool good = true;
    *overlap = true;
    for (int l = levels - 1; good && *overlap && l >= (set->align == REGISTER_ALIGN_NONE ? levels - 1 : levels / 2); --l) {
        struct volume fixed, moving = *pair->moving; /* shares the geometry */
        good = prepare_pair(pair, ldexpf(finest, l)) && volume_create_cubes(pair->fixed, ldexpf(finest, l), 0, &fixed);
        if (good) {
            resample_volume(pair->fixed, pair->fixed_values, NULL, &fixed, fixed.data, NULL);
            moving.data = pair->moving_values;
            good = l < levels - 1
                   || register_find_start(&fixed, &moving, set, reg, overlap);
            good = good && register_affine_related(&fixed, &moving, set->align, reg->affine, &reg->relation);
            good = good && choose_scale(pair, &fixed, &moving, set, reg);
            volume_free(&fixed);
        }
    }
    invert_affine((const double(*)[4])reg->affine, reg->affine_inverse);
    return good;
}

static int choose_levels(const struct volume *fixed, float side, int wanted)
{
    float shortest = INFINITY;
    int levels = 1;
    for (int a = 0; a < 3; ++a) {
        shortest = fminf(shortest, (float)fixed->dims[a] * fixed->spacing[a] / side);
    }
    while (levels < REGISTER_MAX_LEVELS && ldexpf(shortest, -levels) >= (float)REGISTER_MIN_CELLS) {
        ++levels;
    }
    return wanted > 0 ? wanted : levels;
}

/* Finds the windows of intensities. */
static bool choose_windows(struct pair *pair, char error[VOLUME_TEXT])
{
    struct register_window *f = &pair->fixed_window, *m = &pair->moving_window;
    const bool fixed_varies = register_window_of(pair->fixed, f);
    if (!fixed_varies || !register_window_of(pair->moving, m)) {
        snprintf(error, VOLUME_TEXT, "the %s image is constant: there is nothing to register", fixed_varies ? "moving" : "fixed");
        return false;
    }
    return true;
}

static bool is_flat(const struct volume *image, const char *name, char error[VOLUME_TEXT])
{
    const bool flat = image->dims[0] < 2 || image->dims[1] < 2 || image->dims[2] < 2;
    if (flat) { /* without a gradient across its plane no map of space is determined */
        snprintf(error, VOLUME_TEXT, "the %s image is flat (%d x %d x %d voxels): only images of three dimensions are registered",
                 name, image->dims[0], image->dims[1], image->dims[2]);
    }
    return flat;
}

static double diagonal(const struct volume *image)
{
    double square = 0.0;
    for (int a = 0; a < 3; ++a) {
        const double side = (double)image->spacing[a] * image->dims[a];
        square += side * side;
    }
    return sqrt(square);
}

/* Returns true if boxes and voxels of the two images differ by the factor of two units: cm, inches or m taken for mm. */
static bool units_differ(const struct volume *fixed, const struct volume *moving, char error[VOLUME_TEXT])
{
    static const double units[] = {10.0, 25.4, 100.0, 1000.0};
    const double boxes = diagonal(moving) / diagonal(fixed);
    const double voxels = cbrt((double)moving->spacing[0] * (double)moving->spacing[1] * (double)moving->spacing[2]
                               / ((double)fixed->spacing[0] * (double)fixed->spacing[1] * (double)fixed->spacing[2]));
    for (size_t u = 0; u < sizeof units / sizeof *units; ++u) {
        for (int larger = 0; larger < 2; ++larger) {
            const double factor = larger ? units[u] : 1.0 / units[u];
            if (fabs(boxes / factor - 1.0) < 0.15 && fabs(voxels / factor - 1.0) < 0.15) {
                snprintf(error, VOLUME_TEXT, "the moving image is %.3g times as large as the fixed one, voxels and all: the unit of one "
                                             "header is wrong (cm or m for mm)", boxes);
                return true;
            }
        }
    }
    return false;
}

/* Returns true if voxels of the two images differ so much in size that one has nothing to show the other. */
static bool sizes_differ(const struct volume *fixed, const struct volume *moving, char error[VOLUME_TEXT])
{
    const float most = 1000.0f;
    const float a = cbrtf(fixed->spacing[0] * fixed->spacing[1] * fixed->spacing[2]);
    const float b = cbrtf(moving->spacing[0] * moving->spacing[1] * moving->spacing[2]);
    const bool differ = fmaxf(a, b) > most * fminf(a, b);
    if (differ) {
        snprintf(error, VOLUME_TEXT, "the voxels of the two images, %.3g and %.3g mm, differ by more than a factor of %g", (double)a,
                 (double)b, (double)most);
    }
    return differ;
}

bool register_images(const struct volume *fixed, const struct volume *moving, const struct register_settings *set,
                     const struct registration *start, struct registration *result, char error[VOLUME_TEXT])
{
    struct pair pair = {.fixed = fixed, .moving = moving};
    const float side = cbrtf(fixed->spacing[0] * fixed->spacing[1] * fixed->spacing[2]);
    memset(result, 0, sizeof *result);
    register_identity(result->affine);
    if (is_flat(fixed, "fixed", error) || is_flat(moving, "moving", error) || units_differ(fixed, moving, error)
        || sizes_differ(fixed, moving, error)
        || !choose_windows(&pair, error)) {
        return false;
    }
    result->similarity = set->similarity == REGISTER_AUTO ? REGISTER_SSD : set->similarity;
    result->relation.kind = RELATION_LINE;
    pair.fixed_values = malloc(volume_voxels(fixed) * sizeof *pair.fixed_values);
    pair.moving_values = malloc(volume_voxels(moving) * sizeof *pair.moving_values);
    result->level_count = choose_levels(fixed, side, set->levels);
    bool overlap = true;
    bool good = pair.fixed_values && pair.moving_values && align(&pair, set, side, result->level_count, result, &overlap);
    snprintf(error, VOLUME_TEXT, overlap ? "not enough memory" : "the images do not overlap where their headers place them");
    good = good && overlap;
    for (int l = result->level_count - 1; good && l >= 0; --l) {
        good = demons_level(&pair, set, ldexpf(side, l), start, result, &result->levels[l]);
    }
    good = good && exponentiate(result);
    free(pair.fixed_values);
    free(pair.moving_values);
    if (!good) {
        registration_free(result);
    }
    return good;
}

bool registration_substep(const struct registration *registration, int substeps, struct registration *substep)
{
    const size_t count = 3 * volume_voxels(&registration->grid);
    memset(substep, 0, sizeof *substep);
    register_identity(substep->affine);
    register_identity(substep->affine_inverse);
    substep->velocity = malloc(count * sizeof *substep->velocity);
    bool good = substep->velocity && level_grid(&registration->grid, registration->grid.spacing[0], &substep->grid);
    for (size_t n = 0; good && n < count; ++n) {
        substep->velocity[n] = registration->velocity[n] / (float)substeps;
    }
    good = good && exponentiate(substep);
    if (!good) {
        registration_free(substep);
    }
    return good;
}

void registration_free(struct registration *registration)
{
    volume_free(&registration->grid);
    free(registration->velocity);
    free(registration->forward);
    free(registration->inverse);
    memset(registration, 0, sizeof *registration);
}

/* ---- the map ---- */

static void displace(const struct volume *grid, const float *u, const float world[3], float mapped[3])
{
    float index[3], shift[3];
    volume_world_to_index(grid, world, index);
    vgrid_sample(grid->dims, 3, u, index, shift);
    for (int a = 0; a < 3; ++a) {
        index[a] += shift[a];
    }
    volume_index_to_world(grid, index, mapped);
}

void registration_map(const void *registration, const float *points, size_t count, float *mapped)
{
    const struct registration *reg = registration;
    for (size_t n = 0; n < 3 * count; n += 3) {
        float there[3];
        displace(&reg->grid, reg->forward, points + n, there);
        volume_apply((const double(*)[4])reg->affine, there, mapped + n);
    }
}

void registration_map_back(const void *registration, const float *points, size_t count, float *mapped)
{
    const struct registration *reg = registration;
    for (size_t n = 0; n < 3 * count; n += 3) {
        float there[3];
        volume_apply((const double(*)[4])reg->affine_inverse, points + n, there);
        displace(&reg->grid, reg->inverse, there, mapped + n);
    }
}
