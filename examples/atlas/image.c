/* image.c - intensity profiles of an atlas. */
#include "atlas/atlas.h"

#include "base/scalar.h"
#include "base/vec3.h"
#include "imaging/segment_image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MIDDLE = ATLAS_PROFILE_SAMPLES / 2, MAX_SHIFTS = 16 };

/* Smallest deviation of a profile, as a fraction of the contrast: few subjects can agree by chance. */
static const float min_spread = 0.25f;

float atlas_intensity(const struct volume *image, const float place[3])
{
    float x[3], t[3], sum = 0.0f;
    size_t low[3], step[3];
    const size_t strides[3] = {1, (size_t)image->dims[0], (size_t)image->dims[0] * (size_t)image->dims[1]};
    volume_world_to_index(image, place, x);
    for (int a = 0; a < 3; ++a) {
        const float inside = scalar_clamp(x[a], 0.0f, (float)(image->dims[a] - 1));
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

/* Samples `count` intensities along the normal, `spacing` mm apart, the middle one at `place`. */
static void sample_line(const struct volume *image, const float place[3], const float normal[3], float spacing, int count,
                        float *values) {
    for (int i = 0; i < count; ++i) {
        float at[3];
        vec3_add_scaled(place, spacing * (float)(i - count / 2), normal, at);
        values[i] = atlas_intensity(image, at);
    }
}

bool atlas_image_varies(const struct volume *image, const char *path)
{
    return image->minimum < image->maximum || atlas_fail("%.200s: the image is constant: there is nothing to find", path);
}

void atlas_contrast(const struct volume *image, float *mean, float *deviation)
{
    const float low = segment_percentile(image, 0.005), high = segment_percentile(image, 0.995);
    const size_t voxels = volume_voxels(image);
    double sum = 0.0, square = 0.0;
    for (size_t n = 0; n < voxels; ++n) {
        const double value = (double)fmaxf(low, fminf(high, image->data[n]));
        sum += value / (double)voxels;
        square += value * value / (double)voxels;
    }
    *mean = (float)sum;
    *deviation = (float)sqrt(fmax(square - sum * sum, 0.0));
    *deviation = *deviation > 0.0f ? *deviation : 1.0f;
}

/* ---- learning ---- */

/* Samples a subject's profiles, scaled to mean 0 and deviation 1. */
static void subject_profiles(const struct atlas_build *build, const struct atlas_subject *subject, float *normals,
                             float *profiles) {
    const struct atlas *atlas = &build->atlas;
    const size_t vertices = (size_t)atlas->mean.vertex_count, n = vertices * ATLAS_PROFILE_SAMPLES;
    float mean, deviation;
    mesh_normals(subject->shape, vertices, atlas->mean.triangles, (size_t)atlas->mean.triangle_count, normals);
    for (size_t v = 0; v < vertices; ++v) {
        sample_line(&subject->image, subject->shape + 3 * v, normals + 3 * v, (float)atlas->spacing, ATLAS_PROFILE_SAMPLES,
                    profiles + v * ATLAS_PROFILE_SAMPLES);
    }
    atlas_contrast(&subject->image, &mean, &deviation);
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
        atlas->spreads[i] = fmaxf(min_spread, sqrtf(variance));
    }
    free(normals);
    free(one);
    return good;
}

/* ---- matching ---- */

static float by_window(const struct atlas_view *view, float intensity)
{
    return fmaxf(-1.0f, fminf(1.0f, fminf(intensity - view->low, view->high - intensity) / view->ramp));
}

float atlas_inside(const struct atlas_view *view, int v, float intensity)
{
    if (!view->learned) {
        return by_window(view, intensity);
    }
    /* Rates the intensity by which is nearer: the profile just inside the vertex or just outside; 0 where these are alike. */
    const float *profile = view->atlas->profiles + (size_t)v * ATLAS_PROFILE_SAMPLES;
    const float *spread = view->atlas->spreads + (size_t)v * ATLAS_PROFILE_SAMPLES;
    const float in = 0.5f * (profile[MIDDLE - 2] + profile[MIDDLE - 1]), out = 0.5f * (profile[MIDDLE + 1] + profile[MIDDLE + 2]);
    const float width = 0.5f * (spread[MIDDLE - 1] + spread[MIDDLE + 1]);
    const float value = (intensity - view->mean) / view->deviation;
    return fmaxf(-1.0f, fminf(1.0f, (value - 0.5f * (in + out)) * (in - out) / (width * width)));
}

/* Returns the distance of the middle 2 MIDDLE + 1 values of `line` from the mean profile, in its deviations; for a window, how
 * badly inside and outside agree with it. */
static float profile_cost(const struct atlas_view *view, int v, const float *line)
{
    const float *profile = view->learned ? view->atlas->profiles + (size_t)v * ATLAS_PROFILE_SAMPLES : NULL;
    const float *spread = view->learned ? view->atlas->spreads + (size_t)v * ATLAS_PROFILE_SAMPLES : NULL;
    float cost = 0.0f;
    for (int k = 0; k < ATLAS_PROFILE_SAMPLES; ++k) {
        if (view->learned) {
            const float d = (line[k] - profile[k]) / spread[k];
            cost += d * d / ATLAS_PROFILE_SAMPLES;
        } else if (k != MIDDLE) {
            cost += (k < MIDDLE ? -line[k] : line[k]) / (2 * MIDDLE);
        }
    }
    return cost;
}

/* Scales raw intensities to the values that profile_cost compares. */
static void normalize_line(const struct atlas_view *view, int count, float *line)
{
    for (int i = 0; i < count; ++i) {
        line[i] = view->learned ? (line[i] - view->mean) / view->deviation : by_window(view, line[i]);
    }
}

void atlas_shift_costs(const struct atlas_view *view, int v, const float place[3], const float normal[3], float spacing,
                       int shifts, float *costs)
{
    float line[2 * (MAX_SHIFTS + MIDDLE) + 1];
    const int count = 2 * (shifts + MIDDLE) + 1;
    sample_line(view->image, place, normal, spacing, count, line);
    normalize_line(view, count, line);
    for (int s = 0; s <= 2 * shifts; ++s) {
        costs[s] = profile_cost(view, v, line + s);
    }
}

double atlas_surface_cost(const struct atlas_view *view, const struct similarity *pose, const int *vertices, int count,
                          const float *normals, float spacing)
{
    double cost = 0.0;
    for (int i = 0; i < count; ++i) {
        float place[3], normal[3], one;
        const float *n = normals + 3 * vertices[i];
        similarity_apply(pose, view->atlas->mean.positions + 3 * vertices[i], place);
        for (int r = 0; r < 3; ++r) {
            const double *row = pose->rotation[r];
            normal[r] = (float)(row[0] * (double)n[0] + row[1] * (double)n[1] + row[2] * (double)n[2]);
        }
        atlas_shift_costs(view, vertices[i], place, normal, spacing, 0, &one);
        cost += fmin((double)one, 9.0) / count; /* beyond 3 deviations the distance does not matter */
    }
    return cost;
}
