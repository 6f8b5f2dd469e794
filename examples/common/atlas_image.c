/* atlas_image.c - what an atlas knows of intensities, for atlas.h. */
#include "atlas.h"

#include "vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MIDDLE = ATLAS_PROFILE_SAMPLES / 2, MOST_SHIFTS = 16 };

/* Profiles are trusted no more than this, however alike they were: a fraction of the contrast. */
static const float least_spread = 0.25f;

float atlas_intensity(const struct volume *image, const float place[3])
{
    float x[3], t[3], sum = 0.0f;
    size_t low[3], step[3];
    const size_t strides[3] = {1, (size_t)image->dims[0], (size_t)image->dims[0] * (size_t)image->dims[1]};
    volume_world_to_index(image, place, x);
    for (int a = 0; a < 3; ++a) {
        const float inside = fmaxf(0.0f, fminf((float)(image->dims[a] - 1), x[a]));
        low[a] = (size_t)inside;
        step[a] = low[a] + 1 < (size_t)image->dims[a] ? strides[a] : 0;
        t[a] = inside - (float)low[a];
    }
    const float *at = image->data + low[0] * strides[0] + low[1] * strides[1] + low[2] * strides[2];
    for (int corner = 0; corner < 8; ++corner) {
        const float *value = at;
        float weight = 1.0f;
        for (int a = 0; a < 3; ++a) {
            weight *= corner >> a & 1 ? t[a] : 1.0f - t[a];
            value += corner >> a & 1 ? step[a] : 0;
        }
        sum += weight * *value;
    }
    return sum;
}

/* `count` intensities on the normal's line, `spacing` apart, the middle one at `place`. */
static void sample_line(const struct volume *image, const float place[3], const float normal[3], float spacing, int count, float *values)
{
    for (int i = 0; i < count; ++i) {
        float at[3];
        vec3_add_scaled(place, spacing * (float)(i - count / 2), normal, at);
        values[i] = atlas_intensity(image, at);
    }
}

static void mean_and_deviation(const float *values, size_t count, float *mean, float *deviation)
{
    double sum = 0.0, square = 0.0;
    for (size_t i = 0; i < count; ++i) {
        sum += (double)values[i];
        square += (double)values[i] * (double)values[i];
    }
    sum /= (double)count;
    *mean = (float)sum;
    *deviation = (float)sqrt(fmax(square / (double)count - sum * sum, 0.0));
    *deviation = *deviation > 0.0f ? *deviation : 1.0f;
}

/* ---- learning ---- */

/* The subject's profiles, scaled to mean 0 and deviation 1. */
static void subject_profiles(const struct atlas_build *build, const struct atlas_subject *subject, float *normals, float *profiles)
{
    const struct atlas *atlas = &build->atlas;
    const size_t vertices = (size_t)atlas->mean.vertex_count, n = vertices * ATLAS_PROFILE_SAMPLES;
    float mean, deviation;
    mesh_normals(subject->shape, vertices, atlas->mean.triangles, (size_t)atlas->mean.triangle_count, normals);
    for (size_t v = 0; v < vertices; ++v) {
        sample_line(&subject->image, subject->shape + 3 * v, normals + 3 * v, (float)atlas->spacing, ATLAS_PROFILE_SAMPLES,
                    profiles + v * ATLAS_PROFILE_SAMPLES);
    }
    mean_and_deviation(profiles, n, &mean, &deviation);
    for (size_t i = 0; i < n; ++i) {
        profiles[i] = (profiles[i] - mean) / deviation;
    }
}

bool atlas_learn(struct atlas_build *build)
{
    struct atlas *atlas = &build->atlas;
    const struct volume *first = &build->subjects[0].image;
    if (!first->data) {
        return true;
    }
    const size_t vertices = (size_t)atlas->mean.vertex_count, n = vertices * ATLAS_PROFILE_SAMPLES;
    float *normals = malloc(3 * vertices * sizeof *normals), *one = malloc(n * sizeof *one);
    atlas->samples = ATLAS_PROFILE_SAMPLES;
    atlas->spacing = (double)fminf(first->spacing[0], fminf(first->spacing[1], first->spacing[2]));
    atlas->profiles = calloc(n, sizeof *atlas->profiles);
    atlas->spreads = calloc(n, sizeof *atlas->spreads);
    const bool good = (normals && one && atlas->profiles && atlas->spreads) || atlas_no_memory();
    const float share = 1.0f / (float)build->settings.count;
    for (int s = 0; good && s < build->settings.count; ++s) {
        subject_profiles(build, &build->subjects[s], normals, one);
        for (size_t i = 0; i < n; ++i) {
            atlas->profiles[i] += share * one[i];
            atlas->spreads[i] += share * one[i] * one[i];
        }
    }
    for (size_t i = 0; good && i < n; ++i) {
        const float variance = fmaxf(0.0f, atlas->spreads[i] - atlas->profiles[i] * atlas->profiles[i]);
        atlas->spreads[i] = fmaxf(least_spread, sqrtf(variance));
    }
    free(normals);
    free(one);
    return good;
}

/* ---- looking ---- */

void atlas_contrast(const struct atlas_view *view, const float *shape, const float *normals, float *mean, float *deviation)
{
    const size_t vertices = (size_t)view->atlas->mean.vertex_count;
    double sum = 0.0, square = 0.0;
    *mean = 0.0f;
    *deviation = 1.0f;
    if (!view->learned) {
        return;
    }
    for (size_t v = 0; v < vertices; ++v) {
        float line[ATLAS_PROFILE_SAMPLES], m, d;
        sample_line(view->image, shape + 3 * v, normals + 3 * v, (float)view->atlas->spacing, ATLAS_PROFILE_SAMPLES, line);
        mean_and_deviation(line, ATLAS_PROFILE_SAMPLES, &m, &d);
        for (int k = 0; k < ATLAS_PROFILE_SAMPLES; ++k) {
            sum += (double)line[k];
            square += (double)line[k] * (double)line[k];
        }
    }
    const double n = (double)vertices * ATLAS_PROFILE_SAMPLES;
    *mean = (float)(sum / n);
    *deviation = (float)sqrt(fmax(square / n - sum * sum / (n * n), 0.0));
    *deviation = *deviation > 0.0f ? *deviation : 1.0f;
}

static float by_window(const struct atlas_view *view, float intensity)
{
    return fmaxf(-1.0f, fminf(1.0f, fminf(intensity - view->low, view->high - intensity) / view->ramp));
}

float atlas_inside(const struct atlas_view *view, int v, float intensity, float mean, float deviation)
{
    if (!view->learned) {
        return by_window(view, intensity);
    }
    /* Nearer to what lies just inside the vertex, or to what lies just outside? Where these are alike, neither. */
    const float *profile = view->atlas->profiles + (size_t)v * ATLAS_PROFILE_SAMPLES;
    const float *spread = view->atlas->spreads + (size_t)v * ATLAS_PROFILE_SAMPLES;
    const float in = 0.5f * (profile[MIDDLE - 2] + profile[MIDDLE - 1]), out = 0.5f * (profile[MIDDLE + 1] + profile[MIDDLE + 2]);
    const float width = 0.5f * (spread[MIDDLE - 1] + spread[MIDDLE + 1]);
    const float value = (intensity - mean) / deviation;
    return fmaxf(-1.0f, fminf(1.0f, (value - 0.5f * (in + out)) * (in - out) / (width * width)));
}

void atlas_shift_costs(const struct atlas_view *view, int v, const float place[3], const float normal[3], float spacing,
                       int shifts, float mean, float deviation, float *costs)
{
    float line[2 * (MOST_SHIFTS + MIDDLE) + 1];
    const int count = 2 * (shifts + MIDDLE) + 1;
    sample_line(view->image, place, normal, spacing, count, line);
    for (int i = 0; i < count; ++i) {
        line[i] = view->learned ? (line[i] - mean) / deviation : by_window(view, line[i]);
    }
    for (int s = 0; s <= 2 * shifts; ++s) {
        float cost = 0.0f;
        for (int k = 0; k < ATLAS_PROFILE_SAMPLES; ++k) {
            const float value = line[s + k];
            if (view->learned) { /* how far from the mean profile, in its deviations */
                const float d = (value - view->atlas->profiles[(size_t)v * ATLAS_PROFILE_SAMPLES + (size_t)k])
                              / view->atlas->spreads[(size_t)v * ATLAS_PROFILE_SAMPLES + (size_t)k];
                cost += d * d / ATLAS_PROFILE_SAMPLES;
            } else if (k != MIDDLE) { /* inside should be inside, and outside outside */
                cost += (k < MIDDLE ? -value : value) / (2 * MIDDLE);
            }
        }
        costs[s] = cost;
    }
}
