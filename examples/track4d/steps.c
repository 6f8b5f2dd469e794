/* steps.c - compares one motion in steps of several sizes, by springls and by level sets alone. */
#include "track4d/track.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "registration/vgrid.h"
#include "surface/surface_distances.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const int step_counts[TRACK_STEP_RUNS] = {1, 2, 5, 20};

struct study {
    struct track *track;
    int frame;
    float *exact;       /* the mesh's vertices after the whole motion, mm */
    float *phi, *other; /* dense level sets on the model's grid, voxels */
    float *u;           /* displacement of one step at the voxels of the model's grid, in voxels */
};

/* Maps points by the whole motion: the formula of a synthetic motion, else the field. */
static void exact_map(const struct study *study, const struct track_motion *motion, const float *points, size_t count,
                      float *mapped)
{
    const struct beat_time t = track_beat(study->track, study->frame);
    if (study->track->settings.beat > 0) {
        beat_map(&t, points, count, mapped);
    } else {
        field_map_points(&motion->forward, points, count, mapped);
    }
}

/* Compares the model's zero level with the exact surface. */
static bool compare(const struct study *study, struct track_step_run *run)
{
    struct track *track = study->track;
    const double side = (double)track->grid.spacing[0];
    struct surface_distances d;
    springls_mesh found;
    springls_measures measures;
    if (!track_check(track->ctx, springls_extract_mesh(track->ctx, &found), "surface")
        || !track_check(track->ctx, springls_measure(track->ctx, &measures), "measures")) {
        return false;
    }
    const struct surface a = {found.positions, (const uint32_t *)(const void *)found.triangles, (size_t)found.triangle_count};
    const struct surface b = {study->exact, (const uint32_t *)(const void *)track->mesh.triangles,
                              (size_t)track->mesh.triangle_count};
    const bool good = surface_distances_measure(&a, &b, 0, side, &d);
    double exact_volume = 0.0;
    for (size_t t = 0; t < b.triangle_count; ++t) { /* divergence theorem */
        const float *p = b.positions + 3 * b.indices[3 * t], *q = b.positions + 3 * b.indices[3 * t + 1];
        const float *r = b.positions + 3 * b.indices[3 * t + 2];
        float normal[3];
        vec3_cross(q, r, normal);
        exact_volume += (double)vec3_dot(p, normal) / 6.0;
    }
    if (good) {
        run->mean = d.assd / side;
        run->hd95 = d.hd95 / side;
        run->max = d.max / side;
        run->volume_error = 100.0 * (measures.volume / exact_volume - 1.0);
    }
    springls_mesh_free(track->ctx, &found);
    return good || track_no_memory();
}

static bool compare_tracking(const struct study *study, const struct track_motion *motion, struct track_step_run *run)
{
    struct track *track = study->track;
    const springls_view particles = springls_view_particles(track->ctx), originals = springls_view_correspondences(track->ctx);
    const double side = (double)track->grid.spacing[0];
    run->tracking_mean = run->tracking_max = 0.0;
    for (int i = 0; i < particles.count; ++i) {
        const char *p = (const char *)particles.data + (size_t)i * particles.stride;
        const char *a = (const char *)originals.data + (size_t)i * originals.stride;
        float place[3], start[3], there[3];
        springls_to_world(track->ctx, (const float *)(const void *)p, 1, place);
        springls_to_world(track->ctx, (const float *)(const void *)a, 1, start);
        exact_map(study, motion, start, 1, there);
        vec3_sub(place, there, place);
        const double error = (double)vec3_length(place) / side;
        run->tracking_mean += error / particles.count;
        run->tracking_max = fmax(run->tracking_max, error);
    }
    return true;
}

/* ---- a level set alone ---- */

/* Computes phi(x - u(x)), semi-Lagrangian. */
static void semi_lagrangian(const struct study *study)
{
    const int *dims = study->track->grid.dims;
    for (size_t n = 0; n < 3 * vgrid_voxels(dims); ++n) {
        study->u[n] = -study->u[n];
    }
    vgrid_warp(dims, study->phi, study->u, study->other);
    for (size_t n = 0; n < 3 * vgrid_voxels(dims); ++n) {
        study->u[n] = -study->u[n];
    }
}

/* Computes phi - u . grad phi by upwind differences, stable up to a voxel a step (CFL). */
static void upwind(const struct study *study)
{
    const int *dims = study->track->grid.dims;
    const size_t strides[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]};
    const float *phi = study->phi;
    size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
        for (int j = 0; j < dims[1]; ++j) {
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const int place[3] = {i, j, k};
                float change = 0.0f;
                for (int a = 0; a < 3; ++a) {
                    const float wind = study->u[3 * n + (size_t)a];
                    const float before = place[a] > 0 ? phi[n] - phi[n - strides[a]] : 0.0f;
                    const float after = place[a] + 1 < dims[a] ? phi[n + strides[a]] - phi[n] : 0.0f;
                    change += wind * (wind > 0.0f ? before : after);
                }
                study->other[n] = phi[n] - change;
            }
        }
    }
}

/* Takes steps of a scheme, each followed by restoring the distance. Returns false when the surface has disappeared. */
static bool advect_level_set(const struct study *study, void (*scheme)(const struct study *), int steps)
{
    struct track *track = study->track;
    const size_t bytes = volume_voxels(&track->grid) * sizeof *study->phi;
    bool good = springls_copy_level_set(track->ctx, study->phi) == SPRINGLS_OK;
    for (int s = 0; good && s < steps; ++s) {
        scheme(study);
        memcpy(study->phi, study->other, bytes);
        good = springls_set_level_set(track->ctx, study->phi) == SPRINGLS_OK
            && springls_copy_level_set(track->ctx, study->phi) == SPRINGLS_OK;
    }
    return good;
}

/* Samples the step's displacement at the model's voxels, in voxels. */
static bool sample_step(const struct study *study, const struct track_motion *motion)
{
    const struct volume *grid = &study->track->grid;
    struct field field;
    if (!field_create(grid, &field)) {
        return track_no_memory();
    }
    field_sample(field_map_points, &motion->substep, &field);
    track_velocity(study->track, &field, study->u);
    field_free(&field);
    return true;
}

static bool run_all(const struct study *study, int steps)
{
    static const char *const methods[3] = {"springls", "level set, semi-Lagrangian", "level set, upwind"};
    struct track *track = study->track;
    struct track_motion motion;
    bool good = track_motion_make(track, study->frame, steps, NULL, &motion) && sample_step(study, &motion);
    if (good) {
        exact_map(study, &motion, track->mesh.positions, (size_t)track->mesh.vertex_count, study->exact);
    }
    for (int m = 0; good && m < 3; ++m) {
        struct track_step_run *run = &track->runs[track->run_count++];
        const double none = (double)NAN;
        *run = (struct track_step_run){.method = methods[m], .steps = steps, .mean = none, .hd95 = none, .max = none,
                                       .volume_error = none, .tracking_mean = none, .tracking_max = none};
        run->longest = (double)vgrid_longest(track->grid.dims, study->u);
        good = track_reference(track);
        const double begin = elapsed_seconds();
        if (good && m == 0) {
            good = track_move(track, study->frame, &motion, steps);
        } else if (good && !advect_level_set(study, m == 1 ? semi_lagrangian : upwind, steps)) {
            continue;
        }
        run->seconds = elapsed_seconds() - begin;
        good = good && compare(study, run) && (m > 0 || compare_tracking(study, &motion, run));
    }
    track_motion_free(&motion);
    return good;
}

bool track_large_steps(struct track *track)
{
    const size_t voxels = volume_voxels(&track->grid);
    const int chosen = track->settings.frame;
    const int half_way = (track->settings.reference + track->frame_count / 2) % track->frame_count;
    struct study study = {.track = track, .frame = chosen >= 0 ? chosen : half_way};
    const double begin = elapsed_seconds();
    track->settings.frame = study.frame;
    study.exact = malloc(3 * (size_t)track->mesh.vertex_count * sizeof *study.exact);
    study.phi = malloc(voxels * sizeof *study.phi);
    study.other = malloc(voxels * sizeof *study.other);
    study.u = malloc(3 * voxels * sizeof *study.u);
    bool good = (study.exact && study.phi && study.other && study.u) || track_no_memory();
    for (int i = 0; good && i < TRACK_STEP_RUNS; ++i) {
        good = run_all(&study, step_counts[i]);
    }
    free(study.exact);
    free(study.phi);
    free(study.other);
    free(study.u);
    track->seconds = elapsed_seconds() - begin;
    return good;
}
