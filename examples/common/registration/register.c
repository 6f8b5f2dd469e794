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

enum { PATIENCE = 10 }; /* iterations in which the difference must fall by `min_gain` */
static const float min_gain = 0.01f;
static const float iterating_step = 0.5f, final_step = 0.05f; /* length of the first step of exp, voxels */
static const float nearly_one = 0.8f; /* common share of two windows from which on they count as one scale */
static const float local_sigma = 3.0f, local_floor = 0.05f;   /* for REGISTER_LCC: voxels; intensity, range 0..1 */

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

/* Prepares values: normalized, without outliers and without details that cubes of `side` mm cannot represent. */
static bool prepare(const struct volume *image, struct register_window window, float side, float *values)
{
    for (size_t n = 0; n < volume_voxels(image); ++n) {
        values[n] = fmaxf(-0.5f, fminf(1.5f, (image->data[n] - window.low) / (window.high - window.low)));
    }
    return segment_blur(image, side, values);
}

/* Computes (I - local mean) / local deviation, whose squared differences measure the local correlation. */
static bool normalize_locally(const int dims[3], float *image)
{
    const size_t total = vgrid_voxels(dims);
    float *mean = malloc(total * sizeof *mean), *square = malloc(total * sizeof *square);
    float *scratch = malloc(total * sizeof *scratch);
    bool good = mean && square && scratch;
    for (size_t n = 0; good && n < total; ++n) {
        mean[n] = image[n];
        square[n] = image[n] * image[n];
    }
    good = good && vgrid_smooth(dims, 1, local_sigma, mean, scratch) && vgrid_smooth(dims, 1, local_sigma, square, scratch);
    for (size_t n = 0; good && n < total; ++n) {
        const float variance = fmaxf(0.0f, square[n] - mean[n] * mean[n]);
        image[n] = (image[n] - mean[n]) / sqrtf(variance + local_floor * local_floor);
    }
    free(mean);
    free(square);
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
    float *fixed, *moving;     /* on this grid; `moving` already through the affine map */
    unsigned char *valid;      /* 1 where the moving image is defined */
    float *v, *exp_v, *update; /* 3 a voxel */
    float *warped;
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
    free(d->warped);
    free(d->scratch);
    free(d->slices);
    memset(d, 0, sizeof *d);
}

static bool demons_create(const int dims[3], struct demons *d)
{
    memset(d, 0, sizeof *d);
    memcpy(d->dims, dims, sizeof d->dims);
    d->total = vgrid_voxels(dims);
    d->fixed = malloc(d->total * sizeof *d->fixed);
    d->moving = malloc(d->total * sizeof *d->moving);
    d->warped = malloc(d->total * sizeof *d->warped);
    d->valid = malloc(d->total);
    d->v = calloc(3 * d->total, sizeof *d->v);
    d->exp_v = malloc(3 * d->total * sizeof *d->exp_v);
    d->update = malloc(3 * d->total * sizeof *d->update);
    d->scratch = malloc(3 * d->total * sizeof *d->scratch);
    d->slices = malloc(2 * (size_t)dims[2] * sizeof *d->slices);
    if (d->fixed && d->moving && d->warped && d->valid && d->v && d->exp_v && d->update && d->scratch && d->slices) {
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
                float gradient[3] = {0.0f, 0.0f, 0.0f};
                const float difference = still[n] - d->warped[n];
                if (!counts(d, d->exp_v, n, place, !still_is_moving)) {
                    continue;
                }
                add_gradient(dims, still, n, place, gradient);
                add_gradient(dims, d->warped, n, place, gradient);
                for (int a = 0; a < 3; ++a) {
                    gradient[a] *= 0.25f;
                }
                const float square = vec3_dot(gradient, gradient) + damping * difference * difference;
                const float factor = square > 1e-12f ? weight * difference / square : 0.0f;
                for (size_t a = 0; a < 3; ++a) {
                    d->update[3 * n + a] += factor * gradient[a];
                }
                sum += (double)difference * (double)difference;
                number += 1.0;
            }
        }
        d->slices[2 * k] = sum;
        d->slices[2 * k + 1] = number;
    }
}

/* Adds `weight` times the demons' update that moves `warped` = other o exp(+-v) towards `still`; exp_v is exp(+-v):
 *   u = (still - warped) J / (|J|^2 + (still - warped)^2 / (2 longest)^2),   J = (grad still + grad warped) / 2
 * (eq. 5 of the 2009 paper, efficient second-order minimization; |u| <= longest). Returns the mean squared difference. */
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
    return number > 0.0 ? sum / number : 0.0;
}

/* Computes mean and deviation of a and of b over the valid voxels, in this order. */
static void moments(const struct demons *d, const float *a, const float *b, double out[4])
{
    double sum[5] = {0.0, 0.0, 0.0, 0.0, 1e-30};
    for (size_t n = 0; n < d->total; ++n) {
        if (d->valid[n]) {
            sum[0] += (double)a[n];
            sum[1] += (double)a[n] * (double)a[n];
            sum[2] += (double)b[n];
            sum[3] += (double)b[n] * (double)b[n];
            sum[4] += 1.0;
        }
    }
    for (int i = 0; i < 4; i += 2) {
        out[i] = sum[i] / sum[4];
        out[i + 1] = sqrt(fmax(1e-12, sum[i + 1] / sum[4] - out[i] * out[i]));
    }
}

/* Gives the moving image the mean and deviation of the fixed one, over the places that the present map brings together: this
 * improves with the map, while percentiles alone compare the images' contents, not the same places. */
static void match_scales(struct demons *d)
{
    double m[4];
    moments(d, d->fixed, d->warped, m);
    const float gain = (float)(m[1] / m[3]), offset = (float)(m[0] - m[2] * m[1] / m[3]);
    for (size_t n = 0; n < d->total; ++n) {
        d->moving[n] = gain * d->moving[n] + offset;
        d->warped[n] = gain * d->warped[n] + offset;
    }
}

/* Updates v <- G_velocity * (v + G_update * (u_forward - u_back) / 2); computes the mean squared difference before it. */
static bool iterate(struct demons *d, const struct register_settings *set, double *difference)
{
    const float half = set->one_sided ? 1.0f : 0.5f;
    memset(d->update, 0, 3 * d->total * sizeof *d->update);
    vgrid_exp(d->dims, d->v, 1.0f, iterating_step, d->exp_v, d->scratch);
    vgrid_warp(d->dims, d->moving, d->exp_v, d->warped);
    if (!set->one_scale && set->similarity == REGISTER_SSD) {
        match_scales(d);
    }
    *difference = add_forces(d, d->fixed, false, set->longest_update, half);
    if (!set->one_sided) {
        vgrid_exp(d->dims, d->v, -1.0f, iterating_step, d->exp_v, d->scratch);
        vgrid_warp(d->dims, d->fixed, d->exp_v, d->warped);
        *difference = 0.5 * (*difference + add_forces(d, d->moving, true, set->longest_update, -half));
    }
    if (!vgrid_smooth(d->dims, 3, set->update_sigma, d->update, d->scratch)) {
        return false;
    }
    for (size_t n = 0; n < 3 * d->total; ++n) {
        d->v[n] += d->update[n];
    }
    return vgrid_smooth(d->dims, 3, set->velocity_sigma, d->v, d->scratch);
}

static bool run_level(struct demons *d, const struct register_settings *set, struct register_level *level)
{
    double history[PATIENCE];
    for (level->iterations = 0; level->iterations < set->iterations; ++level->iterations) {
        double difference = 0.0, *slot = &history[level->iterations % PATIENCE];
        if (!iterate(d, set, &difference)) {
            return false;
        }
        level->start = level->iterations == 0 ? difference : level->start;
        level->end = difference;
        if (level->iterations >= PATIENCE && difference > (1.0 - (double)min_gain) * *slot) {
            break;
        }
        *slot = difference;
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

static bool fill_level(struct pair *pair, const struct volume *grid, const struct registration *reg,
                       enum register_similarity similarity, struct demons *d)
{
    if (!prepare_pair(pair, grid->spacing[0])) {
        return false;
    }
    resample_volume(pair->fixed, pair->fixed_values, NULL, grid, d->fixed, NULL);
    resample_volume(pair->moving, pair->moving_values, (const double(*)[4])reg->affine, grid, d->moving, d->valid);
    return similarity != REGISTER_LCC || (normalize_locally(d->dims, d->fixed) && normalize_locally(d->dims, d->moving));
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
    if (!level_grid(pair->fixed, side, &grid) || !demons_create(grid.dims, &d)) {
        return false;
    }
    bool good = fill_level(pair, &grid, reg, set->similarity, &d);
    if (reg->velocity) {
        transfer(&reg->grid, reg->velocity, &grid, d.v);
    } else if (start) {
        transfer(&start->grid, start->velocity, &grid, d.v);
    }
    good = good && run_level(&d, set, level);
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

/* Finds the affine map on the coarser half of the grids, where demons would need many iterations for it. *overlap: false where the
 * images do not. */
static bool align(struct pair *pair, const struct register_settings *set, float finest, int levels, struct registration *reg,
                  bool *overlap)
{
    bool good = true;
    *overlap = true;
    for (int l = levels - 1; good && *overlap && l >= (set->align == REGISTER_ALIGN_NONE ? levels - 1 : levels / 2); --l) {
        struct volume fixed, moving = *pair->moving;
        good = prepare_pair(pair, ldexpf(finest, l)) && volume_create_cubes(pair->fixed, ldexpf(finest, l), 0, &fixed);
        if (good) {
            resample_volume(pair->fixed, pair->fixed_values, NULL, &fixed, fixed.data, NULL);
            moving.data = pair->moving_values;
            good = l < levels - 1 || register_find_start(&fixed, &moving, set->align, set->start, reg->affine, overlap);
            good = good && (set->align == REGISTER_ALIGN_NONE || register_affine(&fixed, &moving, set->align, reg->affine));
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

/* Returns the common part of two windows as a share of their union. */
static float shared(const struct register_window *a, const struct register_window *b)
{
    return (fminf(a->high, b->high) - fmaxf(a->low, b->low)) / (fmaxf(a->high, b->high) - fminf(a->low, b->low));
}

/* Chooses the windows of intensities. *one_scale: set if requested, or if the windows nearly agree. */
static bool choose_windows(struct pair *pair, bool *one_scale, char error[VOLUME_TEXT])
{
    struct register_window *f = &pair->fixed_window, *m = &pair->moving_window;
    const bool fixed_varies = register_window_of(pair->fixed, f);
    if (!fixed_varies || !register_window_of(pair->moving, m)) {
        snprintf(error, VOLUME_TEXT, "the %s image is constant: there is nothing to register", fixed_varies ? "moving" : "fixed");
        return false;
    }
    *one_scale = *one_scale || shared(f, m) > nearly_one;
    if (*one_scale) {
        f->low = m->low = fminf(f->low, m->low);
        f->high = m->high = fmaxf(f->high, m->high);
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

bool register_images(const struct volume *fixed, const struct volume *moving, const struct register_settings *wanted,
                     const struct registration *start, struct registration *result, char error[VOLUME_TEXT])
{
    struct register_settings set = *wanted;
    struct pair pair = {.fixed = fixed, .moving = moving};
    const float side = cbrtf(fixed->spacing[0] * fixed->spacing[1] * fixed->spacing[2]);
    memset(result, 0, sizeof *result);
    register_identity(result->affine);
    if (is_flat(fixed, "fixed", error) || is_flat(moving, "moving", error) || sizes_differ(fixed, moving, error)
        || !choose_windows(&pair, &set.one_scale, error)) {
        return false;
    }
    result->one_scale = set.one_scale;
    pair.fixed_values = malloc(volume_voxels(fixed) * sizeof *pair.fixed_values);
    pair.moving_values = malloc(volume_voxels(moving) * sizeof *pair.moving_values);
    result->level_count = choose_levels(fixed, side, set.levels);
    bool overlap = true;
    bool good = pair.fixed_values && pair.moving_values && align(&pair, &set, side, result->level_count, result, &overlap);
    snprintf(error, VOLUME_TEXT, overlap ? "not enough memory" : "the images do not overlap where their headers place them");
    good = good && overlap;
    for (int l = result->level_count - 1; good && l >= 0; --l) {
        good = demons_level(&pair, &set, ldexpf(side, l), start, result, &result->levels[l]);
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
