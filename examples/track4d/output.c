/* output.c - files, plots, report and summary. */
#include "track4d/track.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "imaging/slices.h"
#include "pictures/plot.h"
#include "shapes/shape_pictures.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PICTURES = 5, MODES_SHOWN = 2, TITLE = 96 };
static const float from_the_front[3] = {0.35f, 1.0f, 0.25f}, upwards[3] = {0.0f, 0.0f, 1.0f};

bool track_fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const bool failed = cli_failed("track4d", format, list);
    va_end(list);
    return failed;
}

bool track_no_memory(void) { return track_fail("not enough memory"); }

bool track_check(const springls_context *ctx, springls_status status, const char *doing)
{
    return run_check("track4d", ctx, status, doing);
}

/* ---- one frame ---- */

static bool write_meshes(struct track *track, int f)
{
    char name[32], path[1024], error[MESH_TEXT];
    springls_mesh surface;
    const struct mesh_arrays tracked = {.positions = track->frames[f].vertices,
                                     .vertex_count = (size_t)track->mesh.vertex_count,
                                     .indices = (const uint32_t *)(const void *)track->mesh.triangles,
                                     .triangle_count = (size_t)track->mesh.triangle_count,
                                     .originals = track->mesh.positions,
                                     .comment = "millimetres, RAS+; triangle i is springl i in every frame"};
    snprintf(name, sizeof name, "tracked_%03d.ply", f);
    if (!mesh_write_ply(run_path(track->settings.common.out, name, path, sizeof path), &tracked, error)) {
        return track_fail("%s", error);
    }
    if (!track_check(track->ctx, springls_extract_mesh(track->ctx, &surface), "surface")) {
        return false;
    }
    const struct mesh_arrays zero = {.positions = surface.positions,
                                  .vertex_count = (size_t)surface.vertex_count,
                                  .indices = (const uint32_t *)(const void *)surface.triangles,
                                  .triangle_count = (size_t)surface.triangle_count,
                                  .normals = surface.normals,
                                  .originals = surface.correspondences,
                                  .comment = "millimetres, RAS+; the zero level, watertight"};
    snprintf(name, sizeof name, "surface_%03d.ply", f);
    const bool good = mesh_write_ply(run_path(track->settings.common.out, name, path, sizeof path), &zero, error)
        || track_fail("%s", error);
    springls_mesh_free(track->ctx, &surface);
    return good;
}

static bool write_slices(const struct track *track, int f, const float *distance)
{
    char name[32], path[1024], title[TITLE];
    struct volume image;
    struct image picture;
    float *truth = NULL;
    if (!track_frame_image(track, f, &image)) {
        return false;
    }
    if (!track_frame_mask(track, f, &truth)) {
        volume_free(&image);
        return false;
    }
    const struct slices_contour contours[2] = {
        {.data = distance, .color = {1.0f, 0.35f, 0.2f}, .name = "springls"},
        {.data = truth, .any_label = true, .width = 1.2f, .color = {0.2f, 0.85f, 1.0f}, .name = "label"}};
    const struct slices_view view = {.volume = &image, .contours = contours, .contour_count = truth ? 2 : 1, .height = 300,
                                     .center = {-1, -1, -1}, .title = title};
    snprintf(title, sizeof title, "frame %d", f);
    snprintf(name, sizeof name, "slices_%03d.png", f);
    bool good = slices_render(&view, &picture) || track_no_memory();
    if (good) {
        good = image_write_png(&picture, run_path(track->settings.common.out, name, path, sizeof path))
               || cli_write_failed("track4d", path);
        image_free(&picture);
    }
    volume_free(&image);
    free(truth);
    return good;
}

/* Adds evenly chosen frames to the film. */
static bool take_picture(struct track *track, int f)
{
    const int shown = track->frame_count < MAX_PICTURES ? track->frame_count : MAX_PICTURES;
    char caption[48];
    for (int p = 0; p < shown; ++p) {
        if (f == p * (track->frame_count - 1) / (shown > 1 ? shown - 1 : 1)) {
            snprintf(caption, sizeof caption, "frame %d, %.0f ml", f, track->frames[f].volume_ml);
            track->picture_count = shown;
            return model_frame_take(track->ctx, caption, &track->pictures[p]) || track_no_memory();
        }
    }
    return true;
}

bool track_write_frame(struct track *track, int f, const float *distance)
{
    return write_meshes(track, f) && write_slices(track, f, distance) && take_picture(track, f);
}

/* ---- plots ---- */

static bool write_plot(const struct track *track, const struct plot *plot, const char *name)
{
    char path[1024];
    struct image picture;
    if (!plot_render(plot, 900, 560, &picture)) {
        return track_no_memory();
    }
    const bool good = image_write_png(&picture, run_path(track->settings.common.out, name, path, sizeof path));
    image_free(&picture);
    return good || cli_write_failed("track4d", path);
}

static bool plot_volumes(const struct track *track)
{
    const size_t n = (size_t)track->frame_count;
    double *x = malloc(3 * n * sizeof *x);
    bool any_label = false;
    if (!x) {
        return track_no_memory();
    }
    for (size_t f = 0; f < n; ++f) {
        const struct track_frame *frame = &track->frames[f];
        x[f] = (double)f;
        x[n + f] = frame->volume_ml;
        x[2 * n + f] = frame->has_label ? frame->label_ml : (double)NAN;
        any_label = any_label || ((int)f != track->settings.reference && frame->has_label);
    }
    const struct plot_series series[2] = {{.label = "springls", .x = x, .y = x + n, .count = n, .marks = true},
                                          {.label = "labels", .x = x, .y = x + 2 * n, .count = n, .style = 1, .marks = true,
                                           .no_line = true}};
    const struct plot plot = {.title = "volume", .x_label = "frame", .y_label = "ml", .y_from_zero = true, .series = series,
                              .series_count = any_label ? 2 : 1};
    const bool good = write_plot(track, &plot, "volume.png");
    free(x);
    return good;
}

static bool plot_errors(const struct track *track)
{
    const size_t n = (size_t)track->frame_count;
    double *x = malloc(5 * n * sizeof *x);
    if (!x) {
        return track_no_memory();
    }
    for (size_t f = 0; f < n; ++f) {
        const struct track_frame *frame = &track->frames[f];
        x[f] = (double)f;
        x[n + f] = frame->landmarks_before.mean;
        x[2 * n + f] = frame->landmarks.mean;
        x[3 * n + f] = frame->field_landmarks.mean;
        x[4 * n + f] = frame->particles.mean;
    }
    const struct plot_series landmarks[3] = {{.label = "not moved", .x = x, .y = x + n, .count = n, .style = 2, .marks = true},
                                             {.label = "carried by springls", .x = x, .y = x + 2 * n, .count = n, .marks = true},
                                             {.label = "moved by the field", .x = x, .y = x + 3 * n, .count = n, .style = 1,
                                              .marks = true}};
    const struct plot_series particles = {.label = "particles", .x = x, .y = x + 4 * n, .count = n, .marks = true};
    struct plot plot = {.title = "mean landmark error", .x_label = "frame", .y_label = "mm", .y_from_zero = true,
                        .series = landmarks,
                        .series_count = 3};
    bool good = !track->landmarks || write_plot(track, &plot, "landmarks.png");
    plot.title = "mean error of particles against the true motion";
    plot.series = &particles;
    plot.series_count = 1;
    good = good && (track->settings.beat == 0 || write_plot(track, &plot, "particles.png"));
    free(x);
    return good;
}

/* Plots errors over the number of steps, one line a method. */
static bool plot_steps(const struct track *track)
{
    double x[TRACK_STEP_RUNS], y[3][TRACK_STEP_RUNS];
    struct plot_series series[3];
    for (int m = 0; m < 3; ++m) {
        for (int i = 0; i < TRACK_STEP_RUNS; ++i) {
            x[i] = track->runs[3 * i].longest;
            y[m][i] = track->runs[3 * i + m].mean;
        }
        series[m] = (struct plot_series){.label = track->runs[m].method, .x = x, .y = y[m], .count = TRACK_STEP_RUNS,
                                         .style = m, .marks = true};
    }
    const struct plot plot = {.title = "one motion in 20, 5, 2 and 1 steps", .x_label = "longest step, voxels",
                              .y_label = "mean surface error, voxels", .log_x = true, .log_y = true, .series = series,
                              .series_count = 3};
    return write_plot(track, &plot, "large_steps.png");
}

/* ---- modes ---- */

static double variance_share(const struct track *track, int mode)
{
    double sum = 0.0;
    for (int m = 0; m < track->motion.modes; ++m) {
        sum += track->motion.deviation[m] * track->motion.deviation[m];
    }
    return sum > 0.0 ? track->motion.deviation[mode] * track->motion.deviation[mode] / sum : 0.0;
}

/* Writes pictures and meshes of the first modes at -2, 0 and 2 deviations. */
static bool write_modes(const struct track *track)
{
    const int modes = track->motion.modes < MODES_SHOWN ? track->motion.modes : MODES_SHOWN;
    const struct shape_mesh mean = {track->motion.mean, track->mesh.triangles, track->mesh.vertex_count,
                                    track->mesh.triangle_count};
    const size_t count = 3 * (size_t)mean.vertex_count;
    struct image pictures[3 * MODES_SHOWN];
    char captions[3 * MODES_SHOWN][48], path[1024], name[32], error[MESH_TEXT];
    const char *list[3 * MODES_SHOWN];
    float *shape = malloc(count * sizeof *shape), *colors = malloc(count * sizeof *colors);
    bool good = (shape && colors) || track_no_memory();
    int done = 0;
    if (!good || modes == 0) {
        free(shape);
        free(colors);
        return good;
    }
    struct shape_view view = {.width = 420, .height = 420};
    view.camera = raycast_frame_points(mean.positions, (size_t)mean.vertex_count, from_the_front, upwards, 24.0f, 1.0f);
    view.camera.field_of_view *= 1.25f; /* other frames are larger */
    const float full = 2.0f * (float)(track->motion.deviation[0] / sqrt((double)mean.vertex_count));
    for (; good && done < 3 * modes; ++done) {
        double weights[MODES_SHOWN] = {0.0, 0.0};
        const int m = done / 3, sigma = 2 * (done % 3 - 1);
        weights[m] = sigma;
        shape_model_shape(&track->motion, weights, modes, shape);
        colors_by_offset(&mean, shape, full > 0.0f ? full : 1.0f, colors);
        const char *const which = sigma < 0 ? "-2 sigma" : sigma > 0 ? "+2 sigma" : "mean";
        snprintf(captions[done], sizeof captions[done], "mode %d (%.0f %% of the motion), %s", m + 1,
                 100.0 * variance_share(track, m), which);
        list[done] = captions[done];
        good = shape_picture(&mean, shape, colors, NULL, &view, &pictures[done]);
        if (!good) {
            track_no_memory();
            break;
        }
        const struct mesh_arrays ply = {.positions = shape, .vertex_count = (size_t)mean.vertex_count,
                                     .indices = (const uint32_t *)(const void *)mean.triangles,
                                     .triangle_count = (size_t)mean.triangle_count,
                                     .colors = colors, .comment = "millimetres, RAS+; outward of the mean red, inward blue"};
        snprintf(name, sizeof name, "mode_%d_%s.ply", m + 1, sigma < 0 ? "minus" : sigma > 0 ? "plus" : "mean");
        good = mesh_write_ply(run_path(track->settings.common.out, name, path, sizeof path), &ply, error)
            || track_fail("%s", error);
    }
    run_path(track->settings.common.out, "modes.png", path, sizeof path);
    if (good) {
        good = pictures_write(pictures, list, done, 3, path) || cli_write_failed("track4d", path);
    } else {
        for (int i = 0; i < done; ++i) {
            image_free(&pictures[i]);
        }
    }
    free(shape);
    free(colors);
    return good;
}

bool track_write(struct track *track)
{
    char path[1024];
    if (track->settings.large_steps) {
        return plot_steps(track)
            && track_report(track, run_path(track->settings.common.out, "large_steps.json", path, sizeof path));
    }
    const struct model_view film = {.direction = {from_the_front[0], from_the_front[1], from_the_front[2]},
                                    .up = {0.0f, 0.0f, 1.0f},
                                    .by_correspondence = true};
    return plot_volumes(track) && plot_errors(track) && write_modes(track)
           && (model_film_write(track->pictures, track->picture_count, &film,
                                run_path(track->settings.common.out, "film.png", path, sizeof path))
               || cli_write_failed("track4d", path))
           && track_report(track, run_path(track->settings.common.out, "report.json", path, sizeof path));
}

/* ---- reports ---- */

static double mean_of(const struct track *track, size_t offset)
{
    double sum = 0.0;
    for (int f = 0; f < track->frame_count; ++f) {
        sum += ((const struct track_error *)(const void *)((const char *)&track->frames[f] + offset))->mean / track->frame_count;
    }
    return sum;
}
#define MEAN_OF(track, member) mean_of(track, offsetof(struct track_frame, member))

static void json_error(struct json_writer *json, const char *key, struct track_error error, double side)
{
    json_object_begin(json, key);
    json_number(json, "mean_mm", error.mean);
    json_number(json, "max_mm", error.max);
    json_number(json, "mean_voxels", error.mean / side);
    json_number(json, "max_voxels", error.max / side);
    json_object_end(json);
}

static void report_frame(struct json_writer *json, const struct track *track, int f)
{
    const struct track_frame *frame = &track->frames[f];
    const double side = (double)track->grid.spacing[0];
    json_object_begin(json, NULL);
    json_integer(json, "frame", f);
    json_string(json, "image_warning", frame->warning[0] ? frame->warning : NULL);
    json_number(json, "volume_ml", frame->volume_ml);
    json_number(json, "area_cm2", frame->area_cm2);
    json_integer(json, "components", frame->components);
    json_integer(json, "euler", frame->euler);
    json_integer(json, "springls_kept", frame->kept);
    json_number(json, "off_surface", frame->off_surface);
    json_number(json, "jacobian_min", frame->jacobian_min);
    json_integer(json, "folded_voxels", (int64_t)frame->folded);
    if (frame->has_label) {
        json_number(json, "label_ml", frame->label_ml);
        json_number(json, "dice", frame->dice);
        json_number(json, "field_dice", frame->field_dice);
    }
    if (track->landmarks) {
        json_error(json, "landmarks_before", frame->landmarks_before, side);
        json_error(json, "landmarks", frame->landmarks, side);
        json_error(json, "field_landmarks", frame->field_landmarks, side);
    }
    if (track->settings.beat > 0) {
        json_error(json, "particles", frame->particles, side);
    }
    json_number(json, "seconds_field", frame->registration_seconds);
    json_number(json, "seconds_springls", frame->model_seconds);
    json_object_end(json);
}

static void report_sequence(struct json_writer *json, const struct track *track)
{
    const double side = (double)track->grid.spacing[0];
    json_integer(json, "steps", track->settings.steps);
    if (track->landmarks) {
        json_number(json, "landmarks_mean_mm", MEAN_OF(track, landmarks));
        json_number(json, "landmarks_mean_voxels", MEAN_OF(track, landmarks) / side);
        json_number(json, "field_landmarks_mean_mm", MEAN_OF(track, field_landmarks));
        json_number(json, "landmarks_before_mean_mm", MEAN_OF(track, landmarks_before));
    }
    if (track->settings.beat > 0) {
        json_number(json, "particles_mean_mm", MEAN_OF(track, particles));
        json_number(json, "particles_mean_voxels", MEAN_OF(track, particles) / side);
    }
    json_array_begin(json, "variance_of_modes");
    for (int m = 0; m < track->motion.modes; ++m) {
        json_number(json, NULL, variance_share(track, m));
    }
    json_array_end(json);
    json_array_begin(json, "frames");
    for (int f = 0; f < track->frame_count; ++f) {
        report_frame(json, track, f);
    }
    json_array_end(json);
}

static void report_steps(struct json_writer *json, const struct track *track)
{
    json_integer(json, "frame", track->settings.frame);
    json_array_begin(json, "runs");
    for (int i = 0; i < track->run_count; ++i) {
        const struct track_step_run *run = &track->runs[i];
        json_object_begin(json, NULL);
        json_string(json, "method", run->method);
        json_integer(json, "steps", run->steps);
        json_number(json, "longest_step_voxels", run->longest);
        json_number(json, "surface_mean_voxels", run->mean);
        json_number(json, "surface_hd95_voxels", run->hd95);
        json_number(json, "surface_max_voxels", run->max);
        json_number(json, "volume_error_percent", run->volume_error);
        json_number(json, "tracking_mean_voxels", run->tracking_mean);
        json_number(json, "tracking_max_voxels", run->tracking_max);
        json_number(json, "seconds", run->seconds);
        json_object_end(json);
    }
    json_array_end(json);
}

bool track_report(const struct track *track, const char *path)
{
    const struct track_settings *set = &track->settings;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("track4d", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "track4d");
    json_string(&json, "image", set->image);
    json_string(&json, "labels", set->labels);
    json_string(&json, "fields", set->fields ? set->fields : set->true_field ? "true" : "registered");
    json_integer(&json, "beat", set->beat);
    json_integer(&json, "reference", set->reference);
    json_string(&json, "params", set->common.params);
    json_number(&json, "voxel_mm", (double)track->grid.spacing[0]);
    json_integer(&json, "springls", track->mesh.triangle_count);
    json_string(&json, "backend", run_backend_name(track->backend));
    json_integer(&json, "threads", threads_count());
    json_number(&json, "seconds", track->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    if (set->large_steps) {
        report_steps(&json, track);
    } else {
        report_sequence(&json, track);
    }
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("track4d", path);
}

static void print_steps(const struct track *track)
{
    printf("%-28s %5s %8s | %7s %7s %7s %9s | %8s %7s | %6s\n", "motion to frame, voxels", "steps", "longest", "surface", "HD95",
           "max", "volume", "tracking", "max", "s");
    for (int i = 0; i < track->run_count; ++i) {
        const struct track_step_run *run = &track->runs[i];
        printf("%-28s %5d %8.2f | ", run->method, run->steps, run->longest);
        if (isnan(run->mean)) {
            printf("the surface is gone\n");
            continue;
        }
        printf("%7.3f %7.3f %7.3f %+8.2f%% | ", run->mean, run->hd95, run->max, run->volume_error);
        if (isnan(run->tracking_mean)) {
            printf("%8s %7s | %6.2f\n", "-", "-", run->seconds);
        } else {
            printf("%8.3f %7.3f | %6.2f\n", run->tracking_mean, run->tracking_max, run->seconds);
        }
    }
}

void track_print(const struct track *track)
{
    const double side = (double)track->grid.spacing[0];
    if (!cli_may_print(&track->settings.common)) {
        return;
    }
    printf("%d springls, voxels of %.3g mm\n", track->mesh.triangle_count, side);
    if (track->settings.large_steps) {
        print_steps(track);
        return;
    }
    for (int f = 0; f < track->frame_count; ++f) {
        const struct track_frame *frame = &track->frames[f];
        printf("frame %2d: %7.1f ml, kept %d, off %.1f %%, Jacobian %.3f", f, frame->volume_ml, frame->kept,
               100.0 * frame->off_surface,
               frame->jacobian_min);
        if (frame->folded > 0) {
            printf(", the map folds at %zu voxels", frame->folded);
        }
        if (frame->has_label) {
            printf(", Dice %.4f (field %.4f)", frame->dice, frame->field_dice);
        }
        if (track->landmarks) {
            printf(", landmarks %.3f mm (largest %.2f, field %.3f, before %.2f)", frame->landmarks.mean, frame->landmarks.max,
                   frame->field_landmarks.mean, frame->landmarks_before.mean);
        }
        if (track->settings.beat > 0) {
            printf(", particles %.4f mm (largest %.3f)", frame->particles.mean, frame->particles.max);
        }
        printf("; %.1f + %.1f s\n", frame->registration_seconds, frame->model_seconds);
    }
    if (track->landmarks) {
        printf("landmarks, all frames: %.3f mm = %.3f voxels; moved by the field %.3f mm\n", MEAN_OF(track, landmarks),
               MEAN_OF(track, landmarks) / side, MEAN_OF(track, field_landmarks));
    }
    if (track->settings.beat > 0) {
        printf("particles, all frames: %.4f mm = %.4f voxels\n", MEAN_OF(track, particles), MEAN_OF(track, particles) / side);
    }
}

void track_free(struct track *track)
{
    for (int p = 0; p < track->picture_count; ++p) {
        model_frame_free(track->ctx, &track->pictures[p]);
    }
    for (int f = 0; track->frames && f < track->frame_count; ++f) {
        free(track->frames[f].vertices);
    }
    springls_mesh_free(track->ctx, &track->mesh);
    springls_destroy(track->ctx);
    springls_cl_destroy(track->backend);
    shape_model_free(&track->motion);
    volume_free(&track->image);
    volume_free(&track->grid);
    free(track->aligned_mean);
    free(track->mask);
    free(track->landmarks);
    free(track->anchors);
    free(track->frames);
}
