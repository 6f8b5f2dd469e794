/* segment_report.c - output of `atlas segment`. */
#include "atlas/atlas.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "imaging/segment_image.h"
#include "imaging/slices.h"
#include "shapes/shape_pictures.h"
#include "springls/run_options.h"
#include "springls/segment_model.h"
#include "surface/mesh_io.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void print_stage(const struct atlas_stage *stage)
{
    printf("%-13s %6.1f s", stage->name, stage->seconds);
    if (stage->compared) {
        printf("   Dice %.4f, mean surface distance %.3f mm, HD95 %.3f mm", stage->dice, stage->mean_distance, stage->hd95);
    }
    if (stage->compared && stage->volume_ratio > 0.0) {
        printf(", volume ratio %.3f", stage->volume_ratio);
    }
    putchar('\n');
}

static void print_summary(const struct atlas_segment *run)
{
    for (int s = 0; s < ATLAS_STAGES; ++s) {
        print_stage(&run->results[s]);
    }
    if (run->without.name) {
        print_stage(&run->without);
    }
    if (run->confidence.known) {
        const struct atlas_confidence *c = &run->confidence;
        printf("agreement with the subjects %.3f, theirs %.3f to %.3f", c->agreement, c->least, c->most);
        if (!isnan(c->dice)) {
            printf("; predicted Dice %.3f +- %.3f", c->dice, c->dice_error);
        }
        putchar('\n');
    }
    for (int l = 0; l < run->part_count; ++l) {
        const struct atlas_part *part = &run->parts[l];
        printf("label %lu: %.4g ml, Dice of the subjects %.3f +- %.3f", (unsigned long)part->label, part->volume,
               run->confidence.label_dice[l], run->confidence.label_deviation[l]);
        if (!isnan(part->dice)) {
            printf("; Dice %.4f", part->dice);
        }
        putchar('\n');
    }
    printf("volume %.4g ml; %s after %d steps, %d springls\n", 1e-3 * run->confidence.volume,
           run->at_rest ? "springls at rest" : "step limit reached", run->steps, run->springls);
}

static void report_stage(struct json_writer *json, const char *key, const struct atlas_stage *stage)
{
    const double none = (double)NAN;
    json_object_begin(json, key);
    json_string(json, "name", stage->name);
    json_number(json, "seconds", stage->seconds);
    json_number(json, "dice", stage->compared ? stage->dice : none);
    json_number(json, "mean_distance_mm", stage->compared ? stage->mean_distance : none);
    json_number(json, "volume_ratio", stage->compared && stage->volume_ratio > 0.0 ? stage->volume_ratio : none);
    json_number(json, "hd95_mm", stage->compared ? stage->hd95 : none);
    json_object_end(json);
}

static void report_confidence(struct json_writer *json, const struct atlas_confidence *confidence)
{
    static const char *const doubts[] = {"none", "disagrees", "mirrored", "inverted", "size"};
    json_object_begin(json, "confidence");
    if (confidence->known) {
        json_number(json, "agreement", confidence->agreement);
        json_number(json, "subjects_least", confidence->least);
        json_number(json, "subjects_most", confidence->most);
        json_number(json, "predicted_dice", confidence->dice);
        json_number(json, "predicted_dice_error", confidence->dice_error);
    }
    json_number(json, "volume_ml", 1e-3 * confidence->volume);
    json_string(json, "doubt", doubts[confidence->doubt]);
    json_bool(json, "trusted", confidence->doubt == ATLAS_TRUSTED);
    json_object_end(json);
}

static bool report(const struct atlas_segment *run, const char *path)
{
    const struct atlas_segment_settings *set = &run->settings;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("atlas", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "atlas segment");
    json_string(&json, "image", set->image);
    json_string(&json, "image_warning", volume_warning(&run->image));
    json_string(&json, "atlas", set->atlas);
    json_string(&json, "params", set->common.params);
    json_string(&json, "fit", run->fused ? "fusion" : "profiles");
    json_string(&json, "intensities", run->view.learned ? "learned" : "window");
    if (!run->view.learned) {
        json_number(&json, "window_low", (double)run->view.low);
        json_number(&json, "window_high", (double)run->view.high);
        json_number(&json, "ramp", (double)run->view.ramp);
    }
    json_number(&json, "scale", run->placing.pose.scale);
    json_numbers(&json, "mode_weights", run->placing.weights, (size_t)run->placing.modes);
    json_integer(&json, "steps", run->steps);
    json_string(&json, "ended", run->at_rest ? "springls at rest" : "step limit reached");
    json_integer(&json, "springls", run->springls);
    json_string(&json, "reference", set->reference);
    json_string(&json, "label", set->label_text);
    json_array_begin(&json, "stages");
    for (int s = 0; s < ATLAS_STAGES; ++s) {
        report_stage(&json, NULL, &run->results[s]);
    }
    json_array_end(&json);
    if (run->without.name) {
        report_stage(&json, "without_atlas", &run->without);
    }
    report_confidence(&json, &run->confidence);
    json_array_begin(&json, "labels");
    for (int l = 0; l < run->part_count; ++l) {
        json_object_begin(&json, NULL);
        json_integer(&json, "label", (int64_t)run->parts[l].label);
        json_number(&json, "volume_ml", run->parts[l].volume);
        json_number(&json, "dice", run->parts[l].dice);
        json_number(&json, "subjects_dice", run->confidence.label_dice[l]);
        json_number(&json, "subjects_dice_deviation", run->confidence.label_deviation[l]);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_number(&json, "seconds", run->seconds);
    json_string(&json, "backend", run_backend_name(run->backend));
    json_integer(&json, "threads", threads_count());
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("atlas", path);
}

/* ---- pictures, labels, mesh ---- */

static bool draw_stages(const struct atlas_segment *run, const char *folder)
{
    const struct shape_mesh *last = &run->stages[ATLAS_STAGES - 1];
    struct shape_view view = shape_view_make(last, 360, 320);
    struct image pictures[ATLAS_STAGES + 1] = {{0, 0, NULL}};
    const char *captions[ATLAS_STAGES + 1];
    char path[1024];
    const int count = ATLAS_STAGES + (run->truth.vertex_count > 0);
    bool good = true;
    for (int s = 0; s < count; ++s) {
        const struct shape_mesh *mesh = s < ATLAS_STAGES ? &run->stages[s] : &run->truth;
        shape_view_include(&view, mesh->positions, mesh->vertex_count);
    }
    for (int s = 0; good && s < count; ++s) {
        const struct shape_mesh *mesh = s < ATLAS_STAGES ? &run->stages[s] : &run->truth;
        const uint32_t *regions = s == ATLAS_STAGES || (run->fused && s == 2) ? NULL
                                : s == ATLAS_STAGES - 1 ? run->regions : run->atlas.regions;
        float *colors = malloc(3 * (size_t)mesh->vertex_count * sizeof *colors);
        if (colors && regions) {
            colors_by_region(regions, mesh->vertex_count, colors);
        }
        captions[s] = s < ATLAS_STAGES ? run->results[s].name : "reference";
        good = (colors && shape_picture(mesh, mesh->positions, regions ? colors : NULL, NULL, &view, &pictures[s])) ||
               atlas_no_memory();
        free(colors);
    }
    run_path(folder, "stages.png", path, sizeof path);
    return good && (pictures_write(pictures, captions, count, count, path) || cli_write_failed("atlas", path));
}

static bool write_labels(const struct atlas_segment *run, const char *folder)
{
    char path[1024], error[VOLUME_TEXT];
    uint32_t *labels = malloc(volume_voxels(&run->image) * sizeof *labels);
    run_path(folder, "labels.nii.gz", path, sizeof path);
    const bool good = (labels || atlas_no_memory()) && atlas_segment_labels(run, &run->image, labels)
                   && (volume_write_labels(path, &run->image, labels, error) || atlas_fail("%s", error));
    free(labels);
    return good;
}

/* Draws contours of masks where the interpolated mask is one half. */
static bool draw_slices(const struct atlas_segment *run, const float *before, const float *after, const char *folder)
{
    const struct slices_contour contours[3] = {
        {.data = before, .level = -0.5f, .width = 1.2f, .color = {1.0f, 0.85f, 0.2f}, .name = "before springls"},
        {.data = after, .level = -0.5f, .color = {1.0f, 0.35f, 0.2f}, .name = "springls"},
        {.data = run->reference.data, .any_label = true, .width = 1.2f, .color = {0.2f, 0.85f, 1.0f}, .name = "reference"}};
    const bool same = run->reference.data && volume_same_grid(&run->image, &run->reference);
    const float *middle = run->stages[ATLAS_STAGES - 1].positions;
    struct slices_view view = {.volume = &run->image, .contours = contours, .contour_count = same ? 3 : 2};
    float center[3] = {0.0f, 0.0f, 0.0f}, index[3];
    struct image picture;
    char path[1024];
    for (int i = 0; i < 3 * run->stages[ATLAS_STAGES - 1].vertex_count; ++i) {
        center[i % 3] += middle[i] / (float)run->stages[ATLAS_STAGES - 1].vertex_count;
    }
    volume_world_to_index(&run->image, center, index);
    for (int a = 0; a < 3; ++a) {
        view.center[a] = (int)fmaxf(0.0f, fminf((float)(run->image.dims[a] - 1), floorf(index[a] + 0.5f)));
    }
    run_path(folder, "slices.png", path, sizeof path);
    if (!slices_render(&view, &picture)) {
        return atlas_no_memory();
    }
    const bool good = image_write_png(&picture, path);
    image_free(&picture);
    return good || cli_write_failed("atlas", path);
}

static bool write_volumes(const struct atlas_segment *run, const char *folder)
{
    const size_t voxels = volume_voxels(&run->image);
    uint8_t *mask = malloc(voxels);
    float *masks = malloc(2 * voxels * sizeof *masks);
    bool good = (mask && masks) || atlas_no_memory();
    for (int s = 0; good && s < 2; ++s) {
        good = atlas_segment_mask(run, s == 0 ? run->begin : ATLAS_STAGES - 1, &run->image, mask);
        for (size_t n = 0; good && n < voxels; ++n) {
            masks[(size_t)s * voxels + n] = -(float)mask[n];
        }
    }
    good = good && write_labels(run, folder) && draw_slices(run, masks, masks + voxels, folder);
    free(mask);
    free(masks);
    return good;
}

static bool write_surface(const struct atlas_segment *run, const char *folder)
{
    const struct shape_mesh *mesh = &run->stages[ATLAS_STAGES - 1];
    char path[1024], error[MESH_TEXT];
    float *colors = malloc(3 * (size_t)mesh->vertex_count * sizeof *colors);
    if (!colors) {
        return atlas_no_memory();
    }
    colors_by_region(run->regions, mesh->vertex_count, colors);
    const struct mesh_arrays ply = {.positions = mesh->positions, .vertex_count = (size_t)mesh->vertex_count,
                                 .indices = (const uint32_t *)(const void *)mesh->triangles,
                                 .triangle_count = (size_t)mesh->triangle_count, .colors = colors,
                                 .comment = "millimetres, RAS+; colours: regions of the atlas"};
    run_path(folder, "surface.ply", path, sizeof path);
    const bool good = mesh_write_ply(path, &ply, error);
    free(colors);
    return good || atlas_fail("%s", error);
}

/* Writes the atlas's vertices on the result, and the weights of the modes that are nearest to it. */
static bool write_points(const struct atlas_segment *run, const char *folder)
{
    const struct shape_mesh *mean = &run->atlas.mean;
    const size_t count = (size_t)mean->vertex_count;
    const char *const name = run->settings.image;
    struct similarity aligned;
    float *shape = malloc(3 * count * sizeof *shape);
    bool good = (shape || atlas_no_memory()) && atlas_write_vertices(folder, "correspondence", mean, run->vertices);
    if (good && similarity_fit(run->vertices, mean->positions, NULL, count, true, &aligned)) {
        similarity_apply_all(&aligned, run->vertices, count, shape);
        good = atlas_write_weights(folder, &run->atlas, &name, &shape, 1);
    }
    free(shape);
    return good;
}

bool atlas_segment_output(const struct atlas_segment *run)
{
    const struct cli_common *common = &run->settings.common;
    char path[1024];
    if (cli_may_print(common)) {
        print_summary(run);
    }
    if (common->out) {
        run_path(common->out, "report.json", path, sizeof path);
        if (!write_volumes(run, common->out) || !write_surface(run, common->out) || !write_points(run, common->out)
            || !draw_stages(run, common->out) || !report(run, path)) {
            return false;
        }
    }
    if (common->json && !report(run, common->json)) {
        return false;
    }
    return atlas_is_trusted(run);
}
