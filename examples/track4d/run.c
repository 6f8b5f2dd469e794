/* run.c - moves springls through the frames and measures the results. */
#include "track4d/track.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "imaging/overlap.h"
#include "imaging/resample.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const float *springl_item(springls_view view, int index)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)index * view.stride);
}

bool track_move(struct track *track, int frame, const struct track_motion *motion, int steps)
{
    springls_forces forces;
    springls_step_desc step;
    char doing[32];
    float *values = malloc(3 * volume_voxels(&motion->substep.grid) * sizeof *values);
    bool good = values != NULL || track_no_memory();
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    if (good) {
        forces.velocity_grid = track_velocity(track, &motion->substep, values);
    }
    forces.voxel_units = true;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER; /* a displacement, not a velocity */
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_ELASTIC;
    step.dt = 1.0f;
    step.max_displacement = -1.0f;
    step.one_to_one = true;
    snprintf(doing, sizeof doing, "motion to frame %d", frame);
    for (int s = 0; good && s < steps; ++s) {
        good = track_check(track->ctx, springls_step(track->ctx, &step), doing);
    }
    free(values);
    return good;
}

/* Computes the mesh's vertices from the springls' corners, which coincide without relaxation. */
bool track_vertices(const struct track *track, float *vertices)
{
    const springls_view view = springls_view_vertices(track->ctx);
    const springls_mesh *mesh = &track->mesh;
    int *corners = calloc((size_t)mesh->vertex_count, sizeof *corners);
    if (!corners) {
        return track_no_memory();
    }
    memset(vertices, 0, 3 * (size_t)mesh->vertex_count * sizeof *vertices);
    for (int t = 0; t < view.count && t < mesh->triangle_count; ++t) {
        for (int k = 0; k < 3; ++k) {
            const int v = mesh->triangles[3 * t + track->corner[k]];
            vec3_add_scaled(vertices + 3 * v, 1.0f, springl_item(view, t) + 3 * k, vertices + 3 * v);
            ++corners[v];
        }
    }
    for (int v = 0; v < mesh->vertex_count; ++v) {
        for (int a = 0; a < 3; ++a) {
            vertices[3 * v + a] /= (float)(corners[v] > 0 ? corners[v] : 1);
        }
    }
    springls_to_world(track->ctx, vertices, mesh->vertex_count, vertices);
    free(corners);
    return true;
}

/* ---- landmarks ---- */

/* Computes a triangle's orthonormal axes, the normal last; returns the root of its area. */
static float triangle_axes(const float q[9], float axes[3][3])
{
    vec3_sub(q + 3, q, axes[0]);
    vec3_normalize(axes[0]);
    const float area = vec3_triangle_normal(q, axes[2]);
    vec3_cross(axes[2], axes[0], axes[1]);
    return sqrtf(area);
}

static void corners_of(const struct track *track, const float *vertices, int springl, float q[9])
{
    for (int k = 0; k < 3; ++k) {
        memcpy(q + 3 * k, vertices + 3 * track->mesh.triangles[3 * springl + track->corner[k]], 3 * sizeof *q);
    }
}

/* Moves a landmark with its springl by the similarity transform of the triangle. */
static void carry(const struct track *track, const springls_hit *anchor, const float start[3], const float *vertices,
                  float carried[3])
{
    float before[9], after[9], axes[3][3], moved[3][3], offset[3], base[3] = {0.0f, 0.0f, 0.0f};
    corners_of(track, track->mesh.positions, anchor->springl, before);
    corners_of(track, vertices, anchor->springl, after);
    const float scale = triangle_axes(after, moved) / triangle_axes(before, axes);
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(base, anchor->barycentric[k], before + 3 * k, base);
    }
    vec3_sub(start, base, offset);
    memset(carried, 0, 3 * sizeof *carried);
    for (int k = 0; k < 3; ++k) {
        vec3_add_scaled(carried, anchor->barycentric[k], after + 3 * k, carried);
    }
    for (int a = 0; a < 3; ++a) {
        vec3_add_scaled(carried, scale * vec3_dot(offset, axes[a]), moved[a], carried);
    }
}

static void add_error(struct track_error *error, const float a[3], const float b[3], size_t count)
{
    float d[3];
    vec3_sub(a, b, d);
    error->mean += (double)vec3_length(d) / (double)count;
    error->max = fmax(error->max, (double)vec3_length(d));
}

static void compare_landmarks(const struct track *track, int f, const struct track_motion *motion, struct track_frame *frame)
{
    const size_t count = track->landmark_count;
    const float *start = track->landmarks + 3 * count * (size_t)track->settings.reference;
    const float *truth = track->landmarks + 3 * count * (size_t)f;
    for (size_t n = 0; n < 3 * count; n += 3) {
        float mapped[3] = {start[n], start[n + 1], start[n + 2]}, carried[3];
        if (motion) {
            field_map(&motion->forward, start + n, mapped);
        }
        carry(track, &track->anchors[n / 3], start + n, frame->vertices, carried);
        add_error(&frame->landmarks_before, start + n, truth + n, count);
        add_error(&frame->field_landmarks, mapped, truth + n, count);
        add_error(&frame->landmarks, carried, truth + n, count);
    }
}

/* Compares particles with their correspondences, moved by the synthetic motion. */
static void compare_particles(const struct track *track, int f, struct track_frame *frame)
{
    const springls_view particles = springls_view_particles(track->ctx), originals = springls_view_correspondences(track->ctx);
    const struct beat_time t = track_beat(track, f);
    for (int i = 0; i < particles.count; ++i) {
        float p[3], a[3], there[3];
        springls_to_world(track->ctx, springl_item(particles, i), 1, p);
        springls_to_world(track->ctx, springl_item(originals, i), 1, a);
        beat_map(&t, a, 1, there);
        add_error(&frame->particles, p, there, (size_t)particles.count);
    }
}

/* ---- measures of a frame ---- */

static double dice(const float *a, const float *b, size_t count) { return overlap_labels(a, b, count, -1.0f).dice; }

/* Samples phi on the image's grid, mm. */
static bool copy_distance(struct track *track, float *distance)
{
    if (!track_check(track->ctx, springls_copy_level_set(track->ctx, track->grid.data), "level set")) {
        return false;
    }
    resample_volume(&track->grid, track->grid.data, NULL, &track->image, distance, NULL);
    for (size_t n = 0; n < volume_voxels(&track->image); ++n) {
        distance[n] *= track->grid.spacing[0];
    }
    return true;
}

static bool compare_labels(struct track *track, int f, const struct track_motion *motion, const float *distance,
                           struct track_frame *frame)
{
    const size_t total = volume_voxels(&track->image);
    struct volume reference = track->image;
    float *truth = NULL, *found = malloc(total * sizeof *found);
    const bool read = found ? track_frame_mask(track, f, &truth) : track_no_memory();
    if (!read || !truth) {
        free(found);
        return read;
    }
    size_t voxels = 0;
    for (size_t n = 0; n < total; ++n) {
        found[n] = distance[n] < 0.0f ? 1.0f : 0.0f;
        voxels += truth[n] > 0.0f;
    }
    frame->has_label = true;
    frame->label_ml = overlap_milliliters(voxels, track->image.spacing);
    frame->dice = dice(found, truth, total);
    reference.data = track->mask;
    if (motion) {
        field_warp_labels(&motion->back, &reference, found);
    }
    frame->field_dice = dice(motion ? found : track->mask, truth, total);
    free(truth);
    free(found);
    return true;
}

/* Counts the springls that are still the reference's and those on the zero level. */
static bool compare_springls(struct track *track, const uint32_t *before, int count, struct track_frame *frame)
{
    const springls_view particles = springls_view_particles(track->ctx);
    const uint32_t *ids = springls_ids(track->ctx);
    float *places = malloc(4 * (size_t)particles.count * sizeof *places);
    if (!places) {
        return track_no_memory();
    }
    float *distances = places + 3 * particles.count;
    for (int i = 0; i < particles.count; ++i) {
        frame->kept += i < count && ids[i] == before[i];
        springls_to_world(track->ctx, springl_item(particles, i), 1, places + 3 * i);
    }
    const bool good = track_check(track->ctx, springls_sample_distance(track->ctx, places, particles.count, distances),
                                  "distances");
    for (int i = 0; good && i < particles.count; ++i) {
        frame->off_surface += fabsf(distances[i]) > 0.5f * track->grid.spacing[0] ? 1.0 / particles.count : 0.0;
    }
    free(places);
    return good;
}

static bool measure_jacobian(const struct track_motion *motion, struct track_frame *frame)
{
    float *determinants = malloc(volume_voxels(&motion->forward.grid) * sizeof *determinants);
    if (!determinants) {
        return track_no_memory();
    }
    frame->jacobian_min = (double)field_jacobian(&motion->forward, determinants, &frame->folded);
    free(determinants);
    return true;
}

/* Processes a frame; motion NULL: the reference itself. */
static bool do_frame(struct track *track, int f, const struct track_motion *motion)
{
    struct track_frame *frame = &track->frames[f];
    springls_measures measures;
    const double begin = elapsed_seconds();
    if (!track_reference(track)) {
        return false;
    }
    const int count = springls_count(track->ctx);
    uint32_t *before = malloc((size_t)count * sizeof *before);
    float *distance = malloc(volume_voxels(&track->image) * sizeof *distance);
    frame->vertices = malloc(3 * (size_t)track->mesh.vertex_count * sizeof *frame->vertices);
    bool good = (before && distance && frame->vertices) || track_no_memory();
    if (good) {
        memcpy(before, springls_ids(track->ctx), (size_t)count * sizeof *before);
    }
    frame->jacobian_min = 1.0;
    good = good && (!motion || track_move(track, f, motion, track->settings.steps));
    frame->model_seconds = elapsed_seconds() - begin;
    good = good && track_vertices(track, frame->vertices) && compare_springls(track, before, count, frame)
           && track_check(track->ctx, springls_measure(track->ctx, &measures), "measures") && copy_distance(track, distance)
           && compare_labels(track, f, motion, distance, frame) && (!motion || measure_jacobian(motion, frame));
    if (good) {
        frame->volume_ml = measures.volume / 1000.0;
        frame->area_cm2 = measures.area / 100.0;
        frame->components = measures.components;
        frame->euler = measures.euler;
        frame->registration_seconds = motion ? motion->seconds : 0.0;
        frame->done = true;
        if (track->landmarks) {
            compare_landmarks(track, f, motion, frame);
        }
        if (track->settings.beat > 0) {
            compare_particles(track, f, frame);
        }
    }
    good = good && (!track->settings.common.out || track_write_frame(track, f, distance));
    free(before);
    free(distance);
    return good;
}

/* Follows the frames from the reference to the last or back to the first; each registration starts from the previous one. */
static bool follow_frames(struct track *track, int direction, struct progress *bar, size_t *done)
{
    struct track_motion motion, previous;
    bool good = true, any = false;
    memset(&previous, 0, sizeof previous);
    for (int f = track->settings.reference + direction; good && f >= 0 && f < track->frame_count; f += direction) {
        const struct registration *start = any && previous.registration.velocity ? &previous.registration : NULL;
        good = track_motion_make(track, f, track->settings.steps, start, &motion) && do_frame(track, f, &motion);
        track_motion_free(&previous);
        previous = motion;
        any = true;
        progress_update(bar, ++*done, NULL);
    }
    track_motion_free(&previous);
    return good;
}

/* Computes principal modes of the motion without its rigid part. */
static bool find_modes(struct track *track)
{
    const size_t vertices = (size_t)track->mesh.vertex_count;
    float **shapes = calloc((size_t)track->frame_count, sizeof *shapes);
    track->aligned_mean = malloc(3 * vertices * sizeof *track->aligned_mean);
    bool good = (shapes && track->aligned_mean) || track_no_memory();
    for (int f = 0; good && f < track->frame_count; ++f) {
        shapes[f] = malloc(3 * vertices * sizeof **shapes);
        good = shapes[f] || track_no_memory();
        if (good) {
            memcpy(shapes[f], track->frames[f].vertices, 3 * vertices * sizeof **shapes);
        }
    }
    good = good && ((shapes_align(shapes, track->frame_count, vertices, false, track->aligned_mean)
                     && shape_model_build(shapes, track->frame_count, vertices, track->frame_count - 1, &track->motion))
                    || track_fail("the motion has no principal modes: the meshes have no extent in some frame, or memory is short"));
    for (int f = 0; shapes && f < track->frame_count; ++f) {
        free(shapes[f]);
    }
    free(shapes);
    return good;
}

bool track_run(struct track *track)
{
    struct progress bar;
    size_t done = 1;
    const double begin = elapsed_seconds();
    progress_begin(&bar, "track4d", (size_t)track->frame_count, !cli_may_print(&track->settings.common));
    bool good = do_frame(track, track->settings.reference, NULL) && follow_frames(track, 1, &bar, &done)
             && follow_frames(track, -1, &bar, &done);
    progress_end(&bar);
    good = good && find_modes(track);
    track->seconds = elapsed_seconds() - begin;
    return good;
}
