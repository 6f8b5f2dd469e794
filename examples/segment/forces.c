/* forces.c - forces of an active contour: pressure, region, edges, flow, and the push back to the start. */
#include "segment/segment.h"

#include "imaging/resample.h"
#include "imaging/segment_image.h"
#include "springls/segment_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Smoothness of gradient vector flow, by Xu and Prince for clean images. */
static const float gvf_mu = 0.2f;

void segment_forces_free(struct segment *run)
{
    volume_free(&run->pressure);
    volume_free(&run->push);
    gvf_free(&run->flow);
    free(run->blurred);
    free(run->away);
    run->blurred = run->away = NULL;
}

bool segment_forces_enter(struct segment *run, float side)
{
    const struct segment_settings *set = &run->settings;
    const struct segment_result *result = run->result;
    const float *spacing = run->image.spacing;
    const int margin = (int)ceilf(side / fminf(spacing[0], fminf(spacing[1], spacing[2])));
    segment_forces_free(run);
    run->blurred = malloc(run->voxels * sizeof *run->blurred);
    if (!run->blurred || !volume_create_padded(&run->image, margin, &run->pressure)
        || (set->region > 0.0 && !volume_create_padded(&run->image, margin, &run->push))) {
        return segment_no_memory();
    }
    memcpy(run->blurred, run->image.data, run->voxels * sizeof *run->blurred);
    if (!segment_blur(&run->image, side, run->blurred)) {
        return segment_no_memory();
    }
    segment_pressure(&run->image, run->blurred, result->low, result->high, result->ramp, side, &run->pressure);
    if (set->solid && !segment_pressure_solid(&run->image, side, &run->pressure)) {
        return segment_no_memory();
    }
    if (set->region <= 0.0 && set->edge <= 0.0) { /* nothing else asks for intensities */
        free(run->blurred);
        run->blurred = NULL;
    }
    if (set->gvf > 0.0 && !gvf_compute(&run->pressure, set->gvf_halvings, gvf_mu, side, &run->flow)) {
        return segment_no_memory();
    }
    return true;
}

/* Computes the mean intensities inside and outside the contour, c1 and c2 of Chan and Vese, in the narrow band or the whole
 * image. */
static bool region_means(struct segment *run, float *inside, float *outside)
{
    const struct volume *grid = &run->grid;
    const size_t total = volume_voxels(grid);
    const bool all = strcmp(run->settings.region_means, "image") == 0;
    const float band = all ? INFINITY : run->params.band_half_width;
    float *resampled = malloc(total * sizeof *resampled);
    double sum[2] = {0, 0}, count[2] = {0, 0};
    if (!resampled) {
        return segment_no_memory();
    }
    resample_volume(&run->image, run->blurred, NULL, grid, resampled, NULL);
    for (size_t n = 0; n < total; ++n) {
        if (fabsf(grid->data[n]) < band) {
            const int side = grid->data[n] < 0.0f;
            sum[side] += (double)resampled[n];
            count[side] += 1.0;
        }
    }
    free(resampled);
    *inside = count[1] > 0.0 ? (float)(sum[1] / count[1]) : run->image.maximum;
    *outside = count[0] > 0.0 ? (float)(sum[0] / count[0]) : run->image.minimum;
    return true;
}

/* Sets the flow to zero where the contour may not go. */
static void limit_flow(struct segment *run)
{
    struct volume *grid = &run->flow.grid; /* its edge map is not needed any more */
    resample_volume(&run->start, run->start.data, NULL, grid, grid->data, NULL);
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        const float left = ((float)run->settings.stay - fabsf(grid->data[n])) / run->grid.spacing[0];
        for (int c = 0; c < 3; ++c) {
            run->flow.field[3 * n + (size_t)c] *= fmaxf(0.0f, fminf(1.0f, left));
        }
    }
}

bool segment_forces_update(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    if (!run->push.data) { /* no means will change it: in place */
        run->push = run->pressure;
        memset(&run->pressure, 0, sizeof run->pressure);
    }
    const float *pressure = run->pressure.data ? run->pressure.data : run->push.data;
    struct segment_push push = {.pressure = pressure, .image = run->blurred, .away = run->away,
                                .pressure_weight = (float)set->pressure, .region_weight = (float)set->region,
                                .edge_weight = (float)set->edge, .ramp = run->result->ramp, .stay = (float)set->stay,
                                .size = run->grid.spacing[0]};
    if (set->region > 0.0 && !region_means(run, &push.inside, &push.outside)) {
        return false;
    }
    if (set->stay > 0.0 && !run->away) {
        run->away = malloc(volume_voxels(&run->push) * sizeof *run->away);
        if (!run->away) {
            return segment_no_memory();
        }
        resample_volume(&run->start, run->start.data, NULL, &run->push, run->away, NULL);
        push.away = run->away;
        if (run->flow.field) {
            limit_flow(run);
        }
    }
    segment_combine(&run->image, &push, &run->push);
    return true;
}

/* Takes the flow's component along the normal: the tangential one would crowd springls where edges are strongest. */
static void flow_along_normal(void *user, const float *points, const float *normals, int count, float time, float *out)
{
    const struct segment *run = user;
    (void)time;
    for (int i = 0; i < count; ++i, points += 3, normals += 3) {
        float x[3], v[3];
        for (int r = 0; r < 3; ++r) {
            const float *m = run->flow_map[r];
            x[r] = m[0] * points[0] + m[1] * points[1] + m[2] * points[2] + m[3];
        }
        gvf_sample(&run->flow, x, v);
        out[i] = (float)run->settings.gvf * (v[0] * normals[0] + v[1] * normals[1] + v[2] * normals[2]);
    }
}

void segment_speed(struct segment *run, const float *points, const float *normals, int count, float *out)
{
    if (run->flow.field) {
        flow_along_normal(run, points, normals, count, 0.0f, out);
    } else {
        memset(out, 0, (size_t)count * sizeof *out);
    }
    for (int i = 0; i < count; ++i, points += 3) {
        float x[3];
        for (int r = 0; r < 3; ++r) {
            const float *m = run->push_map[r];
            x[r] = m[0] * points[0] + m[1] * points[1] + m[2] * points[2] + m[3];
        }
        out[i] += resample_at(run->push.dims, run->push.data, x);
    }
}

springls_forces segment_forces(struct segment *run)
{
    springls_forces forces;
    memset(&forces, 0, sizeof forces);
    forces.voxel_units = true;
    forces.pressure_grid.data = run->push.data;
    forces.pressure_grid.grid = segment_model_grid(run->push.dims, run->push.spacing, run->push.origin, run->push.direction[0]);
    forces.curvature_weight = (float)run->settings.curvature;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER; /* the path does not matter, only where it ends */
    resample_map(&run->grid, NULL, &run->push, run->push_map);
    if (run->flow.field) {
        resample_map(&run->grid, NULL, &run->flow.grid, run->flow_map);
        forces.pressure = flow_along_normal;
        forces.user = run;
    }
    return forces;
}
