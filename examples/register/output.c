/* output.c - fields, images, pictures and the report of a registration. */
#include "register/run.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "imaging/slices.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdlib.h>

enum { PICTURES = 6, TILES = 6 };

static bool paint(const struct run *run, float *data, const char *title, float high, struct image *picture)
{
    struct volume shown = run->fixed; /* the fixed image's geometry with other voxels, which it does not own */
    const struct slices_view view = {.volume = &shown, .height = 260, .title = title, .window_hi = high,
                                     .center = {shown.dims[0] / 2, shown.dims[1] / 2, shown.dims[2] / 2}};
    shown.data = data;
    shown.header = NULL;
    return slices_render(&view, picture);
}

/* Draws the images before (left) and after (right): checkerboard, difference, fixed image, Jacobian. */
static bool draw(const struct run *run, const char *path)
{
    const char *const titles[PICTURES] = {"checkerboard before", "checkerboard after", "difference before", "difference after",
                                          "fixed image", "Jacobian, 0 to 2"};
    static const float whites[PICTURES] = {1.0f, 1.0f, 0.5f, 0.5f, 1.0f, 2.0f};
    struct register_window fixed, moving;
    struct image pictures[PICTURES], all;
    const int *dims = run->fixed.dims;
    const int tile = (dims[0] > dims[1] ? dims[0] : dims[1]) / TILES + 1;
    float *data = malloc(volume_voxels(&run->fixed) * sizeof *data);
    int done = 0;
    bool good = data != NULL;
    register_windows(run, &fixed, &moving);
    for (; good && done < PICTURES; done += good) {
        const float *moved = done % 2 ? run->warped : run->unmoved;
        for (size_t n = 0; n < volume_voxels(&run->fixed); ++n) {
            int place[3];
            volume_place(dims, n, place);
            float f = register_normalized(run->fixed.data[n], fixed), m = register_normalized(moved[n], moving);
            register_on_one_scale(run, &f, &m);
            const float checker = (place[0] / tile + place[1] / tile + place[2] / tile) % 2 ? f : m;
            data[n] = done < 2 ? checker : done < 4 ? fabsf(f - m) : done == 4 ? f : run->jacobian[n];
        }
        good = paint(run, data, titles[done], whites[done], &pictures[done]);
    }
    free(data);
    good = good && image_strip(pictures, NULL, PICTURES, 2, color_rgb(1.0f, 1.0f, 1.0f), &all);
    while (done > 0) {
        image_free(&pictures[--done]);
    }
    if (!good) {
        return register_no_memory();
    }
    good = image_write_png(&all, path);
    image_free(&all);
    return good || cli_write_failed("register", path);
}

static void json_pair(struct json_writer *json, const char *key, struct pair pair)
{
    json_object_begin(json, key);
    json_number(json, "mean", pair.mean);
    json_number(json, "max", pair.max);
    json_object_end(json);
}

bool register_report(const struct run *run, const char *path)
{
    const struct register_settings *set = &run->settings;
    const struct registration *reg = &run->registration;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("register", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "register");
    json_string(&json, "fixed", run->fixed_path);
    json_string(&json, "moving", run->moving_path);
    json_string(&json, "fixed_warning", volume_warning(&run->fixed));
    json_string(&json, "moving_warning", volume_warning(&run->moving));
    json_string(&json, "field", run->field_path);
    if (!run->field_path) {
        json_string(&json, "align", run->align);
        json_string(&json, "start", run->start);
        json_string(&json, "similarity", run->similarity);
        static const char *const similarities[] = {"ssd", "lcc", "mind"};
        static const char *const scales[] = {"one", "line", "curve of the moving image", "curve of the fixed image"};
        json_string(&json, "chosen", similarities[reg->similarity]);
        json_string(&json, "scale", reg->similarity == REGISTER_SSD ? scales[reg->relation.kind] : NULL);
        json_bool(&json, "shaded", reg->shaded);
        json_bool(&json, "one_scale", reg->relation.kind == RELATION_SAME);
        json_number(&json, "update_sigma", (double)set->update_sigma);
        json_number(&json, "velocity_sigma", (double)set->velocity_sigma);
        json_array_begin(&json, "affine_mm_ras");
        for (int r = 0; r < 3; ++r) {
            json_numbers(&json, NULL, reg->affine[r], 4);
        }
        json_array_end(&json);
        json_array_begin(&json, "levels");
        for (int l = reg->level_count - 1; l >= 0; --l) {
            json_object_begin(&json, NULL);
            json_number(&json, "voxel_mm", (double)reg->levels[l].side);
            json_integer(&json, "iterations", reg->levels[l].iterations);
            json_number(&json, "mean_square_start", reg->levels[l].start);
            json_number(&json, "mean_square_end", reg->levels[l].end);
            json_object_end(&json);
        }
        json_array_end(&json);
    }
    json_number(&json, "rms_before", run->rms_before);
    json_number(&json, "rms_after", run->rms_after);
    json_number(&json, "correlation_before", run->correlation_before);
    json_number(&json, "correlation_after", run->correlation_after);
    json_number(&json, "mutual_information_before", run->information_before);
    json_number(&json, "mutual_information_after", run->information_after);
    json_number(&json, "jacobian_max", (double)run->max_jacobian);
    json_number(&json, "jacobian_extreme_share", run->extreme);
    json_number(&json, "jacobian_min", (double)run->min_jacobian);
    json_integer(&json, "folded_voxels", (int64_t)run->folded);
    json_pair(&json, "inverse_error_mm", run->inverse_error);
    if (run->has_labels) {
        json_number(&json, "dice_before", run->dice_before);
        json_number(&json, "dice_after", run->dice_after);
    }
    if (run->has_points) {
        json_integer(&json, "points", (int64_t)run->point_count);
        json_pair(&json, "points_before_mm", run->points_before);
        json_pair(&json, "points_after_mm", run->points_after);
    }
    json_integer(&json, "threads", threads_count());
    json_number(&json, "seconds", run->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("register", path);
}

bool register_write(const struct run *run)
{
    static const char *const names[] = {"forward.nii.gz", "inverse.nii.gz", "warped.nii.gz", "jacobian.nii.gz",
                                        "before_after.png",
                                        "report.json"};
    char path[6][1024], error[VOLUME_TEXT];
    for (int f = 0; f < 6; ++f) {
        run_path(run->common.out, names[f], path[f], sizeof path[f]);
    }
    if (!field_write(path[0], &run->forward, error) || !field_write(path[1], &run->inverse, error)
        || !volume_write(path[2], &run->fixed, VOLUME_FLOAT32, run->warped, error)
        || !volume_write(path[3], &run->fixed, VOLUME_FLOAT32, run->jacobian, error)) {
        return register_fail("%s", error);
    }
    return draw(run, path[4]) && register_report(run, path[5]);
}
