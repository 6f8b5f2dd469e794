/* segment_output.c - what segment.h writes and says. */
#include "segment.h"

#include "json.h"
#include "mesh_io.h"
#include "progress.h"
#include "run_options.h"
#include "segment_image.h"
#include "slices.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

bool segment_may_print(const struct segment *run)
{
    const struct cli_common *common = &run->settings.common;
    return !common->quiet && !(common->json && common->json[0] == '-' && common->json[1] == '\0');
}

bool segment_fail(const char *format, ...)
{
    char text[512];
    va_list list;
    va_start(list, format);
    vsnprintf(text, sizeof text, format, list);
    va_end(list);
    cli_fail("segment", CLI_EXIT_FAILURE, "%s", text);
    return false;
}

bool segment_no_memory(void) { return segment_fail("not enough memory"); }

bool segment_check(const springls_context *ctx, springls_status status, const char *doing)
{
    const char *why = status == SPRINGLS_OK ? "" : springls_last_error(ctx);
    if (status == SPRINGLS_EMPTY_MODEL) {
        return segment_fail("%s: no surface inside the image", doing);
    }
    return status == SPRINGLS_OK || segment_fail("%s: %s", doing, why[0] ? why : springls_status_string(status));
}

/* Grey values so that the level is in the middle. */
static void grey_window(const struct segment *run, float *lo, float *hi)
{
    const float least = segment_percentile(&run->image, 0.005), most = segment_percentile(&run->image, 0.995);
    const float low = fmaxf(run->low, least), high = fminf(run->high, most); /* open ends end here */
    const bool open = run->low < least || run->high > most;
    const float middle = open ? (run->low < least ? run->high : run->low) : 0.5f * (low + high);
    const float span = fmaxf(fminf(most - middle, middle - least), open ? 0.0f : high - low);
    *lo = middle - span;
    *hi = middle + span;
}

static bool draw(const struct segment *run, const char *slices_path, const char *surface_path, const char *film_path)
{
    const struct slices_contour contours[2] = {
        {.data = run->distance, .color = {1.0f, 0.35f, 0.2f}, .name = "springls"},
        {.data = run->reference.data, .any_label = true, .width = 1.2f, .color = {0.2f, 0.85f, 1.0f}, .name = "reference"}};
    struct slices_view view = {.volume = &run->image, .contours = contours, .contour_count = run->truth ? 2 : 1,
                               .center = {-1, -1, -1}};
    const struct model_view film = {.direction = {0.35f, 1.0f, 0.25f}, /* from the front */
                                    .up = {0.0f, 0.0f, 1.0f}, .over_surface = true};
    const struct model_frame *last = &run->frames[run->frame_count - 1];
    struct model_view portrait = film;
    struct image picture;
    portrait.width = 800;
    grey_window(run, &view.window_lo, &view.window_hi);
    if (!slices_render(&view, &picture)) {
        return segment_no_memory();
    }
    const bool written = image_write_png(&picture, slices_path);
    image_free(&picture);
    return (written || segment_fail("%s: cannot write there", slices_path))
        && (model_portrait_write(last, &portrait, 4.0f, surface_path) || segment_fail("%s: cannot draw it", surface_path))
        && (model_film_write(run->frames, run->frame_count, &film, film_path) || segment_fail("%s: cannot draw it", film_path));
}

static const char *how_it_ended(const struct segment *run) { return run->at_rest ? "springls at rest" : "step limit reached"; }

bool segment_report(const struct segment *run, const char *path)
{
    const struct segment_settings *set = &run->settings;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return segment_fail("%s: cannot write there", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "segment");
    json_string(&json, "image", set->image);
    json_string(&json, "init", set->init);
    json_number(&json, "window_low", (double)run->low);
    json_number(&json, "window_high", (double)run->high);
    json_number(&json, "ramp", (double)run->ramp);
    json_number(&json, "curvature", set->curvature);
    json_number(&json, "speed", set->speed);
    json_string(&json, "params", set->common.params);
    json_number(&json, "voxel_mm", (double)run->grid.spacing[0]);
    json_integer(&json, "levels", run->levels);
    json_integer(&json, "steps", run->steps);
    json_string(&json, "ended", how_it_ended(run));
    json_number(&json, "moving", (double)run->moving);
    json_integer(&json, "springls", springls_count(run->ctx));
    json_number(&json, "volume_ml", run->measures.volume / 1000.0);
    json_number(&json, "area_mm2", run->measures.area);
    json_integer(&json, "components", run->measures.components);
    json_integer(&json, "euler", run->measures.euler);
    json_string(&json, "backend", run_backend_name(run->backend));
    json_integer(&json, "threads", run_threads());
    json_number(&json, "seconds", run->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    if (run->truth) {
        const struct surface_distances *d = &run->distances;
        const double none = (double)NAN;
        json_object_begin(&json, "against_reference");
        json_string(&json, "reference", set->reference);
        json_string(&json, "label", set->label_text);
        json_number(&json, "dice", run->overlap.dice);
        json_number(&json, "jaccard", run->overlap.jaccard);
        json_number(&json, "reference_ml", metrics_millilitres(run->overlap.b, run->image.spacing));
        json_number(&json, "mean_distance_mm", run->has_distances ? d->assd : none);
        json_number(&json, "mean_to_reference_mm", run->has_distances ? d->mean_ab : none);
        json_number(&json, "mean_from_reference_mm", run->has_distances ? d->mean_ba : none);
        json_number(&json, "hd95_mm", run->has_distances ? d->hd95 : none);
        json_number(&json, "surface_dice", run->has_distances ? d->surface_dice : none);
        json_number(&json, "tolerance_mm", run->has_distances ? d->tolerance : none);
        json_object_end(&json);
    }
    json_object_end(&json);
    return json_close(&json) || segment_fail("%s: writing failed", path);
}

bool segment_write(const struct segment *run)
{
    static const char *const names[] = {"labels.nii.gz", "distance.nii.gz", "surface.ply", "slices.png",
                                        "surface.png", "film.png", "report.json"};
    char path[7][1024], error[VOLUME_TEXT];
    const struct mesh_ply ply = {.positions = run->surface.positions, .normals = run->surface.normals,
                                 .vertex_count = (size_t)run->surface.vertex_count,
                                 .indices = (const uint32_t *)(const void *)run->surface.triangles,
                                 .triangle_count = (size_t)run->surface.triangle_count,
                                 .originals = run->levels == 1 ? run->surface.correspondences : NULL, /* finer grids forget */
                                 .comment = "millimetres, RAS+"};
    for (int f = 0; f < 7; ++f) {
        run_path(run->settings.common.out, names[f], path[f], sizeof path[f]);
    }
    if (!volume_write(path[0], &run->image, VOLUME_UINT8, run->inside, error)
        || !volume_write(path[1], &run->image, VOLUME_FLOAT32, run->distance, error)
        || !mesh_write_ply(path[2], &ply, error)) {
        return segment_fail("%s", error);
    }
    return draw(run, path[3], path[4], path[5]) && segment_report(run, path[6]);
}

void segment_print_summary(const struct segment *run)
{
    if (!segment_may_print(run)) {
        return;
    }
    printf("%s after %d steps, %.1f s; %.2f %% of %d springls still moving\n", how_it_ended(run), run->steps, run->seconds,
           100.0 * (double)run->moving, springls_count(run->ctx));
    printf("volume %.2f ml, area %.1f cm2, components %d\n", run->measures.volume / 1000.0, run->measures.area / 100.0,
           run->measures.components);
    if (!run->truth) {
        return;
    }
    printf("reference %.2f ml: Dice %.4f", metrics_millilitres(run->overlap.b, run->image.spacing), run->overlap.dice);
    if (run->has_distances) {
        printf(", mean surface distance %.3f mm, HD95 %.3f mm", run->distances.assd, run->distances.hd95);
    }
    putchar('\n');
}

void segment_free(struct segment *run)
{
    for (int f = 0; f < run->frame_count; ++f) {
        model_frame_free(run->ctx, &run->frames[f]);
    }
    springls_mesh_free(run->truth_ctx, &run->truth_surface);
    springls_mesh_free(run->ctx, &run->surface);
    springls_destroy(run->truth_ctx);
    springls_destroy(run->ctx);
    springls_cl_destroy(run->backend);
    volume_free(&run->image);
    volume_free(&run->grid);
    volume_free(&run->pressure);
    volume_free(&run->reference);
    free(run->distance);
    free(run->inside);
    free(run->truth);
}
