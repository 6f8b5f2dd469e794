/* output.c - files, report and summary. */
#include "segment/segment.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "base/write_error.h"
#include "imaging/segment_image.h"
#include "imaging/slices.h"
#include "springls/run_options.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool segment_fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const bool failed = cli_failed("segment", format, list);
    va_end(list);
    return failed;
}

bool segment_no_memory(void) { return segment_fail("not enough memory"); }

bool segment_check(const springls_context *ctx, springls_status status, const char *doing)
{
    return run_check("segment", ctx, status, doing);
}

/* Chooses a gray range with the level in the middle. */
static void gray_window(const struct segment *run, float *lo, float *hi)
{
    const struct segment_result *result = run->result;
    const float minimum = segment_percentile(&run->image, 0.005), maximum = segment_percentile(&run->image, 0.995);
    const float low = fmaxf(result->low, minimum), high = fminf(result->high, maximum); /* limit open ends */
    const bool open = result->low < minimum || result->high > maximum;
    const float middle = open ? (result->low < minimum ? result->high : result->low) : 0.5f * (low + high);
    const float span = fmaxf(fminf(maximum - middle, middle - minimum), open ? 0.0f : high - low);
    *lo = middle - span;
    *hi = middle + span;
}

/* Returns a map with 1 where the reference has a label of any object; the caller frees it. */
static float *all_references(const struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    float *mask = run->truth ? calloc(run->voxels, sizeof *mask) : NULL;
    for (int o = 0; mask && o < set->object_count; ++o) {
        segment_mask(&run->reference, set->objects[o].labels, set->objects[o].label_count, run->truth);
        for (size_t n = 0; n < run->voxels; ++n) {
            mask[n] = run->truth[n] ? 1.0f : mask[n];
        }
    }
    return mask;
}

static bool draw_slices(const struct segment *run, const char *path)
{
    const struct segment_settings *set = &run->settings;
    struct slices_contour contours[SEGMENT_MAX_OBJECTS + 1];
    float *reference = all_references(run);
    int count = 0;
    memset(contours, 0, sizeof contours);
    for (int o = 0; o < set->object_count; ++o, ++count) {
        const bool alone = set->object_count == 1;
        contours[count].data = alone ? run->distance : run->labels.data;
        contours[count].label = alone ? 0.0f : (float)(o + 1);
        contours[count].color = alone ? color_rgb(1.0f, 0.35f, 0.2f) : color_category(o);
        contours[count].name = alone ? "springls" : NULL;
    }
    if (reference) {
        contours[count++] = (struct slices_contour){.data = reference, .any_label = true, .width = 1.2f,
                                                    .color = {0.2f, 0.85f, 1.0f}, .name = "reference"};
    }
    struct slices_view view = {.volume = &run->image, .contours = contours, .contour_count = count, .center = {-1, -1, -1}};
    struct image picture;
    gray_window(run, &view.window_lo, &view.window_hi);
    const bool drawn = slices_render(&view, &picture) || segment_no_memory();
    const bool written = drawn && (image_write_png(&picture, path) || cli_write_failed("segment", path));
    if (drawn) {
        image_free(&picture);
    }
    free(reference);
    return written;
}

/* Builds "surface.ply", or with more than one object "surface_77.ply". */
static const char *object_path(const struct segment *run, const char *name, const char *extension, char *path, size_t size)
{
    char file[64];
    if (run->settings.object_count > 1) {
        snprintf(file, sizeof file, "%s_%lu%s", name, (unsigned long)run->result->object->written, extension);
    } else {
        snprintf(file, sizeof file, "%s%s", name, extension);
    }
    return run_path(run->settings.common.out, file, path, size);
}

/* Without pictures: those of an earlier run would show another result than the files beside them. */
static bool remove_picture(const char *path)
{
    return earlier_file_remove(path) || segment_fail("%s: an earlier run's picture cannot be removed: %s", path, write_reason());
}

static bool remove_model_pictures(const struct segment *run)
{
    char path[1024];
    return remove_picture(object_path(run, "surface", ".png", path, sizeof path))
        && remove_picture(object_path(run, "film", ".png", path, sizeof path));
}

/* Draws the surface, and how it got there. */
static bool draw_model(const struct segment *run)
{
    char path[1024];
    const struct model_view film = {.direction = {0.35f, 1.0f, 0.25f}, /* from the front */
                                    .up = {0.0f, 0.0f, 1.0f}, .over_surface = true};
    struct model_view portrait = film;
    portrait.width = 800;
    return (model_portrait_write(&run->frames[run->frame_count - 1], &portrait, 4.0f,
                                 object_path(run, "surface", ".png", path, sizeof path))
            || cli_write_failed("segment", path))
        && (model_film_write(run->frames, run->frame_count, &film, object_path(run, "film", ".png", path, sizeof path))
            || cli_write_failed("segment", path));
}

bool segment_write_object(const struct segment *run)
{
    char path[1024], error[VOLUME_TEXT];
    const struct mesh_arrays ply = {.positions = run->surface->positions, .normals = run->surface->normals,
                                 .vertex_count = (size_t)run->surface->vertex_count,
                                 .indices = (const uint32_t *)(const void *)run->surface->triangles,
                                 .triangle_count = (size_t)run->surface->triangle_count, /* omits what only coarser grids had */
                                 .originals = run->result->levels == 1 && !run->refitted ? run->surface->correspondences : NULL,
                                 .comment = "millimetres, RAS+"};
    if (!mesh_write_ply(object_path(run, "surface", ".ply", path, sizeof path), &ply, error)
        || !volume_write(object_path(run, "distance", ".nii.gz", path, sizeof path), &run->image, VOLUME_FLOAT32, run->distance,
                         error)) {
        return segment_fail("%s", error);
    }
    return run->settings.no_pictures ? remove_model_pictures(run) : draw_model(run);
}

/* Writes the labels in the geometry of the image, as NIfTI and in the image's own format. */
static bool write_labels(const struct segment *run)
{
    char path[1024], name[32], error[VOLUME_TEXT];
    uint32_t *labels = malloc(run->voxels * sizeof *labels);
    if (!labels) {
        return segment_no_memory();
    }
    for (size_t n = 0; n < run->voxels; ++n) {
        const int object = run->depth ? (int)run->labels.data[n] : run->inside[n];
        labels[n] = object > 0 ? run->settings.objects[object - 1].written : 0;
    }
    const char *const extensions[] = {".nii.gz", run->image.extension};
    bool good = true;
    for (int f = 0; good && f < (strcmp(extensions[0], extensions[1]) == 0 ? 1 : 2); ++f) {
        snprintf(name, sizeof name, "labels%s", extensions[f]);
        run_path(run->settings.common.out, name, path, sizeof path);
        good = volume_write_labels(path, &run->image, labels, error) || segment_fail("%s", error);
    }
    free(labels);
    return good;
}

bool segment_write(const struct segment *run)
{
    char path[1024];
    const char *out = run->settings.common.out;
    if (!write_labels(run) || !segment_report(run, run_path(out, "report.json", path, sizeof path))) {
        return false;
    }
    run_path(out, "slices.png", path, sizeof path);
    return run->settings.no_pictures ? remove_picture(path) : draw_slices(run, path);
}

/* ---- figures ---- */

static const char *how_it_ended(const struct segment_result *result)
{
    return result->at_rest ? "springls at rest" : "step limit reached";
}

static void report_object(const struct segment *run, const struct segment_result *result, struct json_writer *json)
{
    const double none = (double)NAN;
    json_integer(json, "label", (int64_t)result->object->written);
    json_number(json, "window_low", (double)result->low);
    json_number(json, "window_high", (double)result->high);
    json_number(json, "ramp", (double)result->ramp);
    json_number(json, "voxel_mm", (double)result->voxel);
    json_integer(json, "levels", result->levels);
    json_integer(json, "steps", result->steps);
    json_string(json, "ended", how_it_ended(result));
    json_number(json, "moving", (double)result->moving);
    json_integer(json, "springls", result->springls);
    json_number(json, "springls_mean", result->springls_mean);
    json_number(json, "volume_ml", result->measures.volume / 1000.0);
    json_number(json, "area_mm2", result->measures.area);
    json_integer(json, "components", result->measures.components);
    json_integer(json, "label_components", result->label_components);
    json_integer(json, "islands_removed", result->islands);
    json_number(json, "image_share", result->share);
    json_number(json, "start_intensity", result->start_mean);
    json_integer(json, "euler", result->measures.euler);
    json_number(json, "coverage_min", result->coverage.least.area);
    json_number(json, "coverage_mean", result->coverage.mean.area);
    json_number(json, "coverage_max", result->coverage.most.area);
    json_number(json, "covered_min", result->coverage.least.covered);
    json_number(json, "covered_mean", result->coverage.mean.covered);
    json_number(json, "covered_twice_max", result->coverage.most.covered_twice);
    json_number(json, "seconds", result->seconds);
    json_bool(json, "trusted", result->trusted);
    if (run->truth) {
        const struct surface_distances *d = &result->distances;
        json_object_begin(json, "against_reference");
        json_string(json, "reference", run->settings.reference);
        json_string(json, "label", run->settings.label_text);
        json_number(json, "start_dice", result->start_dice);
        json_number(json, "dice", result->overlap.dice);
        json_number(json, "jaccard", result->overlap.jaccard);
        json_number(json, "reference_ml", overlap_milliliters(result->overlap.b, run->image.spacing));
        json_number(json, "mean_distance_mm", result->has_distances ? d->assd : none);
        json_number(json, "mean_to_reference_mm", result->has_distances ? d->mean_ab : none);
        json_number(json, "mean_from_reference_mm", result->has_distances ? d->mean_ba : none);
        json_string(json, "mean_distance_is", "mean of both directions weighted by area, from 100000 points on each surface");
        json_number(json, "hd95_mm", result->has_distances ? d->hd95 : none);
        json_number(json, "hd95_to_reference_mm", result->has_distances ? d->hd95_ab : none);
        json_number(json, "hd95_from_reference_mm", result->has_distances ? d->hd95_ba : none);
        json_string(json, "hd95_is", "the larger of the two directions' 95th percentiles");
        json_number(json, "surface_dice", result->has_distances ? d->surface_dice : none);
        json_number(json, "tolerance_mm", result->has_distances ? d->tolerance : none);
        json_object_end(json);
    }
    if (run->settings.compare_level_set) {
        json_object_begin(json, "against_level_set");
        json_number(json, "mean_distance_mm", result->level_set_mean);
        json_number(json, "deviation_mm", result->level_set_deviation);
        json_number(json, "dice", result->level_set_dice);
        json_number(json, "seconds", result->level_set_seconds);
        json_object_end(json);
    }
}

bool segment_report(const struct segment *run, const char *path)
{
    const struct segment_settings *set = &run->settings;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("segment", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "segment");
    json_string(&json, "image", set->image);
    json_string(&json, "image_warning", volume_warning(&run->image));
    json_string(&json, "init", set->init);
    json_number(&json, "pressure", set->pressure);
    json_number(&json, "region", set->region);
    json_number(&json, "edge", set->edge);
    json_bool(&json, "solid", set->solid);
    json_number(&json, "gvf", set->gvf);
    json_number(&json, "curvature", set->curvature);
    json_number(&json, "stay_mm", set->stay);
    json_number(&json, "speed", set->speed);
    json_string(&json, "params", set->common.params);
    json_string(&json, "backend", run_backend_name(run->backend));
    json_integer(&json, "threads", threads_count());
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    if (set->object_count == 1) {
        report_object(run, &run->results[0], &json);
    } else {
        json_array_begin(&json, "objects");
        for (int o = 0; o < set->object_count; ++o) {
            json_object_begin(&json, NULL);
            report_object(run, &run->results[o], &json);
            json_object_end(&json);
        }
        json_array_end(&json);
    }
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("segment", path);
}

void segment_print_summary(const struct segment *run)
{
    const struct segment_result *result = run->result;
    if (!cli_may_print(&run->settings.common)) {
        return;
    }
    if (run->settings.object_count > 1) {
        printf("label %lu: ", (unsigned long)result->object->written);
    }
    printf("%s after %d steps, %.1f s; %.2f %% of %d springls still moving\n", how_it_ended(result), result->steps,
           result->seconds, 100.0 * (double)result->moving, result->springls);
    printf("volume %.2f ml, area %.1f cm2, components: %d of the surface, %d in the label map", result->measures.volume / 1000.0,
           result->measures.area / 100.0, result->measures.components, result->label_components);
    if (result->islands > 0) {
        printf(", %d removed", result->islands);
    }
    putchar('\n');
    if (result->share > 0.5) {
        printf("note: the object is %.0f %% of the image: is it the background?\n", 100.0 * result->share);
    }
    if (run->truth) {
        if (isfinite(result->start_dice)) {
            printf("mask at the start: Dice %.4f\n", result->start_dice);
        }
        printf("reference %.2f ml: Dice %.4f", overlap_milliliters(result->overlap.b, run->image.spacing), result->overlap.dice);
        if (result->has_distances) {
            const struct surface_distances *d = &result->distances;
            printf("; surface distance %.3f mm (mean of both directions; %.3f to the reference, %.3f from it), HD95 %.3f mm (larger of "
                   "%.3f to, %.3f from)", d->assd, d->mean_ab, d->mean_ba, d->hd95, d->hd95_ab, d->hd95_ba);
        }
        putchar('\n');
    }
    if (run->settings.compare_level_set) {
        printf("a level set alone: %.3f +- %.3f mm from it, Dice of the two %.4f, %.1f s\n", result->level_set_mean,
               result->level_set_deviation, result->level_set_dice, result->level_set_seconds);
    }
}

void segment_end_object(struct segment *run)
{
    for (int f = 0; f < run->frame_count; ++f) {
        model_frame_free(run->ctx, &run->frames[f]);
    }
    run->frame_count = 0;
    run->refitted = false;
    springls_mesh_free(run->truth_ctx, &run->truth_surface);
    run->surface = NULL;
    springls_destroy(run->truth_ctx);
    springls_destroy(run->ctx);
    run->truth_ctx = run->ctx = NULL;
    volume_free(&run->grid);
    volume_free(&run->start);
    segment_forces_free(run);
}

void segment_free(struct segment *run)
{
    segment_end_object(run);
    springls_cl_destroy(run->backend);
    run->backend = NULL;
    volume_free(&run->image);
    volume_free(&run->reference);
    volume_free(&run->labels);
    free(run->depth);
    free(run->distance);
    free(run->inside);
    free(run->truth);
}
