#include "imaging/level_set.h"

#include "base/threads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { REDISTANCE = 4 }; /* iterations after a step */

static const float band_width = 3.0f, courant = 0.5f, max_curvature = 2.0f;
static const float min_slope = 0.8f, max_slope = 1.25f; /* slopes of phi beside its zero that still count as a distance */

static size_t total_of(const struct level_set *set)
{
    return (size_t)set->dims[0] * (size_t)set->dims[1] * (size_t)set->dims[2];
}

static float sign(float x) { return x < 0.0f ? -1.0f : 1.0f; }

/* Computes differences to the neighbors before and after along each axis; beyond the border values are constant. */
static void differences(const struct level_set *set, const float *values, size_t at, float before[3], float after[3])
{
    size_t step = 1;
    for (int a = 0; a < 3; ++a) {
        const size_t place = at / step % (size_t)set->dims[a];
        before[a] = place > 0 ? values[at] - values[at - step] : 0.0f;
        after[a] = place + 1 < (size_t)set->dims[a] ? values[at + step] - values[at] : 0.0f;
        step *= (size_t)set->dims[a];
    }
}

/* Returns the upwind |grad phi| for a front that moves towards larger phi (direction 1) or smaller phi (-1). */
static float godunov(const float before[3], const float after[3], float direction)
{
    float sum = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const float from = fmaxf(direction * before[a], 0.0f), to = fminf(direction * after[a], 0.0f);
        const float square = fmaxf(from * from, to * to);
        sum += square;
    }
    return sqrtf(sum);
}

/* Computes kappa |grad phi| from the 27 voxels around; 0 at the border of the grid. */
static float curvature_motion(const struct level_set *set, size_t at, float *slope)
{
    const float *p = set->phi + at;
    const size_t steps[3] = {1, (size_t)set->dims[0], (size_t)set->dims[0] * (size_t)set->dims[1]};
    float g[3], second[3], mixed[3], square = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const size_t place = at / steps[a] % (size_t)set->dims[a];
        if (place == 0 || place + 1 == (size_t)set->dims[a]) {
            return *slope = 0.0f;
        }
        g[a] = 0.5f * (p[steps[a]] - *(p - steps[a]));
        second[a] = p[steps[a]] - 2.0f * p[0] + *(p - steps[a]);
        square += g[a] * g[a];
    }
    for (int a = 0; a < 3; ++a) { /* of the other two axes */
        const size_t b = steps[(a + 1) % 3], c = steps[(a + 2) % 3];
        mixed[a] = 0.25f * (p[b + c] - *(p + b - c) - *(p + c - b) + *(p - b - c));
    }
    *slope = sqrtf(square);
    if (!(square > 1e-6f)) {
        return 0.0f;
    }
    float sum = 0.0f;
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        sum += g[a] * g[a] * (second[b] + second[c]) - 2.0f * g[b] * g[c] * mixed[a];
    }
    const float kappa = sum / (square * *slope);
    return fmaxf(-max_curvature, fminf(max_curvature, kappa)) * *slope;
}

/* Lists the voxels with |phi| within the band, and their neighbors. */
static void find_band(struct level_set *set)
{
    const size_t steps[3] = {1, (size_t)set->dims[0], (size_t)set->dims[0] * (size_t)set->dims[1]};
    const size_t total = total_of(set);
    memset(set->near, 0, total);
    for (size_t n = 0; n < total; ++n) {
        if (fabsf(set->phi[n]) < band_width) {
            set->near[n] = 1;
            for (int a = 0; a < 3; ++a) {
                const size_t place = n / steps[a] % (size_t)set->dims[a];
                set->near[place > 0 ? n - steps[a] : n] = 1;
                set->near[place + 1 < (size_t)set->dims[a] ? n + steps[a] : n] = 1;
            }
        }
    }
    set->band_count = 0;
    for (size_t n = 0; n < total; ++n) {
        if (set->near[n]) {
            set->band[set->band_count++] = n;
        }
    }
}

static void take_next(struct level_set *set)
{
    for (size_t b = 0; b < set->band_count; ++b) {
        const size_t at = set->band[b];
        set->phi[at] = fmaxf(-band_width, fminf(band_width, set->next[at]));
    }
}

struct advance_loop {
    struct level_set *set;
    float dt;
    size_t nx;
    size_t ny;
};

static void run_advance_loop(void *arg, int begin, int end)
{
    const struct advance_loop *loop = arg;
    struct level_set *set = loop->set;
    const float dt = loop->dt;
    const size_t nx = loop->nx;
    const size_t ny = loop->ny;
    for (size_t b = (size_t)begin; b < (size_t)end; ++b) {
        const size_t at = set->band[b];
        const float point[3] = {(float)(at % nx), (float)(at / nx % ny), (float)(at / (nx * ny))};
        float before[3], after[3], normal[3], length = 1e-6f, speed = 0.0f, slope;
        differences(set, set->phi, at, before, after);
        for (int a = 0; a < 3; ++a) {
            normal[a] = 0.5f * (before[a] + after[a]);
            length += normal[a] * normal[a];
        }
        length = sqrtf(length);
        for (int a = 0; a < 3; ++a) {
            normal[a] /= length;
        }
        set->speed(set->user, point, normal, 1, &speed);
        const float bent = set->curvature > 0.0f ? curvature_motion(set, at, &slope) : 0.0f;
        set->next[at] = set->phi[at] - dt * (speed * godunov(before, after, sign(speed)) - set->curvature * bent);
    }
}

static void advance(struct level_set *set, float dt)
{
    const size_t nx = (size_t)set->dims[0], ny = (size_t)set->dims[1];
    struct advance_loop loop = {set, dt, nx, ny};
    threads_for((int)set->band_count, 1024, run_advance_loop, &loop);
    take_next(set);
}

struct redistance_loop {
    struct level_set *set;
    const float *old;
};

static void run_redistance_loop(void *arg, int begin, int end)
{
    const struct redistance_loop *loop = arg;
    struct level_set *set = loop->set;
    const float *old = loop->old;
    for (size_t b = (size_t)begin; b < (size_t)end; ++b) {
        const size_t at = set->band[b];
        const float s = sign(old[at]);
        float before[3], after[3], slope = 0.0f, steepest = 0.0f;
        bool crossed = false;
        differences(set, old, at, before, after);
        for (int a = 0; a < 3; ++a) {
            const float middle = 0.5f * (before[a] + after[a]);
            steepest = fmaxf(steepest, fmaxf(fabsf(before[a]), fabsf(after[a])));
            crossed = crossed || s * (old[at] - before[a]) < 0.0f || s * (old[at] + after[a]) < 0.0f;
            slope += middle * middle;
        }
        if (crossed && slope > min_slope * min_slope && slope < max_slope * max_slope) {
            set->next[at] = set->phi[at]; /* close enough, and unchanged values cannot creep */
        } else if (crossed) { /* in the middle of a sheet central differences vanish: use the steepest one */
            slope = slope > 0.25f ? slope : fmaxf(steepest * steepest, 1e-6f);
            set->next[at] = set->phi[at] - courant * (s * fabsf(set->phi[at]) - old[at] / sqrtf(slope));
        } else {
            differences(set, set->phi, at, before, after);
            set->next[at] = set->phi[at] - courant * s * (godunov(before, after, s) - 1.0f);
        }
    }
}

/* Restores the distance: where the zero is less than a voxel away, phi moves towards the sub-voxel distance (Russo and
 * Smereka) of `before`, the values at the start. */
static void redistance(struct level_set *set)
{
    const float *old = set->before;
    memcpy(set->before, set->phi, total_of(set) * sizeof *set->phi);
    for (int i = 0; i < REDISTANCE; ++i) {
        struct redistance_loop loop = {set, old};
        threads_for((int)set->band_count, 1024, run_redistance_loop, &loop);
        take_next(set);
    }
}

void level_set_step(struct level_set *set, float dt)
{
    const int pieces = (int)ceilf(dt * set->fastest / courant);
    for (int i = 0; i < pieces; ++i) {
        find_band(set);
        advance(set, dt / (float)pieces);
        redistance(set);
    }
}

bool level_set_create(struct level_set *set, const int dims[3], const float *phi)
{
    const size_t total = (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2];
    memset(set, 0, sizeof *set);
    memcpy(set->dims, dims, sizeof set->dims);
    set->phi = malloc(total * sizeof *phi);
    set->next = malloc(total * sizeof *phi);
    set->before = malloc(total * sizeof *phi);
    set->looked = malloc(total * sizeof *phi);
    set->near = malloc(total);
    set->band = malloc(total * sizeof *set->band);
    if (!set->phi || !set->next || !set->before || !set->looked || !set->near || !set->band) {
        level_set_free(set);
        return false;
    }
    for (size_t n = 0; n < total; ++n) {
        set->phi[n] = fmaxf(-band_width, fminf(band_width, phi[n]));
    }
    return true;
}

float level_set_moving(struct level_set *set, float still)
{
    const size_t total = total_of(set);
    size_t beside = 0, moved = 0;
    for (size_t n = 0; set->has_looked && n < total; ++n) {
        const bool is_beside = fabsf(set->looked[n]) < 0.5f;
        beside += is_beside;
        moved += is_beside && fabsf(set->phi[n] - set->looked[n]) > still;
    }
    memcpy(set->looked, set->phi, total * sizeof *set->phi);
    set->has_looked = true;
    return beside > 0 ? (float)moved / (float)beside : 1.0f;
}

void level_set_free(struct level_set *set)
{
    free(set->phi);
    free(set->next);
    free(set->before);
    free(set->looked);
    free(set->near);
    free(set->band);
    memset(set, 0, sizeof *set);
}
