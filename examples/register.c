/* register.c - deformable registration of two 3-D images: a dense displacement field and its inverse.
 *
 *   register fixed.nii.gz moving.nii.gz --out result
 *   register fixed.nii.gz moving.nii.gz --fixed-labels a.nii.gz --moving-labels b.nii.gz --json -
 *   register fixed.nii.gz moving.nii.gz --field deformationField.nii.gz --out result     # of another program
 *
 * The field maps points of the fixed image to the moving one, so the moving image sampled at the mapped points looks like the
 * fixed one. See registration/register.h for the method, registration/field.h for the files and the conventions of ITK and
 * elastix. */
#include "base/json.h"
#include "base/progress.h"
#include "base/vec3.h"
#include "imaging/overlap.h"
#include "imaging/slices.h"
#include "registration/field.h"
#include "registration/points.h"
#include "registration/register.h"
#include "springls.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct pair {
    double mean, max;
};

struct run {
    struct cli_common common;
    struct register_settings settings;
    const char *fixed_path, *moving_path, *field_path, *align, *similarity;
    const char *fixed_labels_path, *moving_labels_path, *fixed_points_path, *moving_points_path;
    int fixed_frame, moving_frame, label;
    struct volume fixed, moving;
    struct registration registration;
    struct field forward, inverse; /* on the fixed image's grid; on the moving one's */
    float *unmoved, *warped;       /* the moving image on the fixed one's grid, without and with the field */
    float *jacobian;
    float min_jacobian;
    struct pair inverse_error;     /* |inverse(forward(x)) - x|, mm */
    double rms_before, rms_after;  /* of the normalised images */
    bool has_labels, has_points;
    double dice_before, dice_after;
    struct pair points_before, points_after;
    size_t point_count;
    double seconds;
};

static bool fail(const char *text)
{
    cli_fail("register", CLI_EXIT_FAILURE, "%s", text);
    return false;
}

static bool no_memory(void) { return fail("not enough memory"); }

/* ---- command line ---- */

static int read_command_line(struct run *run, int argc, char **argv)
{
    static const char *const aligns[] = {"none", "translation", "rigid", "affine"};
    struct register_settings *set = &run->settings;
    const struct cli_option options[] = {
        {"align", CLI_CHOICE, &run->align, NULL, "what comes before the deformation", 0, 0, "none|translation|rigid|affine"},
        {"similarity", CLI_CHOICE, &run->similarity, NULL, "squared differences, or local correlation", 0, 0, "ssd|lcc"},
        {"one-scale", CLI_FLAG, &set->one_scale, NULL, "intensities mean the same in both images; without it this is found out",
         0, 0, NULL},
        {"one-sided", CLI_FLAG, &set->one_sided, NULL, "forces of the fixed image's side only: faster, not symmetric", 0, 0,
         NULL},
        {"levels", CLI_INT, &set->levels, "K", "grids, each twice as fine as the one before; 0: by the image's size", 0,
         REGISTER_MAX_LEVELS, NULL},
        {"iterations", CLI_INT, &set->iterations, "K", "at most on each grid", 0, 1e5, NULL},
        {"update-sigma", CLI_FLOAT, &set->update_sigma, "S", "Gaussian of the update, voxels (fluid)", 0, 20, NULL},
        {"velocity-sigma", CLI_FLOAT, &set->velocity_sigma, "S", "Gaussian of the velocity, voxels (elastic)", 0, 20, NULL},
        {"longest-update", CLI_FLOAT, &set->longest_update, "D", "voxels an iteration", 0.01, 5, NULL},
        {"field", CLI_STRING, &run->field_path, "FILE", "take this displacement field (NIfTI, mm, LPS+) and register nothing",
         0, 0,
         NULL},
        {"fixed-frame", CLI_INT, &run->fixed_frame, "K", "which image of a 4-D file, from 0", 0, 1e9, NULL},
        {"moving-frame", CLI_INT, &run->moving_frame, "K", "which image of a 4-D file, from 0", 0, 1e9, NULL},
        {"fixed-labels", CLI_STRING, &run->fixed_labels_path, "FILE", "label map of the fixed image, to compare", 0, 0, NULL},
        {"moving-labels", CLI_STRING, &run->moving_labels_path, "FILE", "label map of the moving image", 0, 0, NULL},
        {"label", CLI_INT, &run->label, "K", "the label to compare; -1: all but 0", -1, 1e9, NULL},
        {"fixed-points", CLI_STRING, &run->fixed_points_path, "FILE", "landmarks of the fixed image (elastix's text)", 0, 0,
         NULL},
        {"moving-points", CLI_STRING, &run->moving_points_path, "FILE", "the same landmarks in the moving image", 0, 0, NULL},
    };
    const struct cli_positional positionals[] = {{"FIXED", &run->fixed_path, "image that stays", true},
                                                 {"MOVING", &run->moving_path, "image that is deformed to look like it", true}};
    const struct cli_program program = {.name = "register",
                                        .summary = "finds the displacement field from one image to another, and its inverse",
                                        .common = &run->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = positionals,
                                        .positional_count = 2};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    while (strcmp(aligns[set->align], run->align) != 0) {
        set->align = (enum register_align)(((int)set->align + 1) % 4);
    }
    set->similarity = strcmp(run->similarity, "lcc") == 0 ? REGISTER_LCC : REGISTER_SSD;
    if (!run->fixed_labels_path != !run->moving_labels_path) {
        return cli_fail("register", CLI_EXIT_USAGE, "--fixed-labels and --moving-labels go together");
    }
    if (!run->fixed_points_path != !run->moving_points_path) {
        return cli_fail("register", CLI_EXIT_USAGE, "--fixed-points and --moving-points go together");
    }
    return CLI_CONTINUE;
}

/* ---- the fields ---- */

/* Measures mean and maximum of the inverse's error over the fixed image's voxels that stay inside both images; a root mean
 * square would not show where the inverse fails. */
static void compare_inverse(struct run *run)
{
    const struct volume *grid = &run->fixed;
    size_t number = 0;
    double sum = 0.0;
    for (size_t n = 0; n < volume_voxels(grid); ++n) {
        int place[3];
        float x[3], there[3], at[3], back[3];
        bool inside = true;
        volume_place(grid->dims, n, place);
        const float index[3] = {(float)place[0], (float)place[1], (float)place[2]};
        volume_index_to_world(grid, index, x);
        vec3_add_scaled(x, 1.0f, run->forward.mm + 3 * n, there);
        volume_world_to_index(&run->moving, there, at);
        for (int a = 0; a < 3; ++a) {
            inside = inside && at[a] >= 0.0f && at[a] <= (float)(run->moving.dims[a] - 1);
        }
        if (inside) {
            field_map(&run->inverse, there, back);
            vec3_sub(back, x, back);
            const double error = (double)vec3_length(back);
            sum += error;
            run->inverse_error.max = fmax(run->inverse_error.max, error);
            ++number;
        }
    }
    run->inverse_error.mean = number > 0 ? sum / (double)number : (double)NAN;
}

static bool make_fields(struct run *run)
{
    char error[VOLUME_TEXT];
    double remains = 0.0;
    if (run->field_path) {
        struct field read;
        if (!field_read(run->field_path, &read, error)) {
            return fail(error);
        }
        const bool good = field_create(&run->fixed, &run->forward);
        if (good) {
            field_sample(field_map_points, &read, &run->forward);
        }
        field_free(&read);
        return (good && field_invert(&run->forward, &run->moving, &run->inverse, &remains)) || no_memory();
    }
    if (!register_images(&run->fixed, &run->moving, &run->settings, NULL, &run->registration, error)) {
        return fail(error);
    }
    if (!field_create(&run->fixed, &run->forward) || !field_create(&run->moving, &run->inverse)) {
        return no_memory();
    }
    field_sample(registration_map, &run->registration, &run->forward);
    field_sample(registration_map_back, &run->registration, &run->inverse);
    return true;
}

/* ---- measures ---- */

static float normalized(float value, struct register_window window)
{
    return fmaxf(0.0f, fminf(1.0f, (value - window.low) / (window.high - window.low)));
}

/* Returns the root mean square difference where the moving image is defined; elsewhere `moved` is NaN. */
static double rms(const struct run *run, const float *moved, struct register_window fixed, struct register_window moving)
{
    const size_t total = volume_voxels(&run->fixed);
    double sum = 0.0, number = 0.0;
    for (size_t n = 0; n < total; ++n) {
        if (!isnan(moved[n])) {
            const double d = (double)(normalized(run->fixed.data[n], fixed) - normalized(moved[n], moving));
            sum += d * d;
            number += 1.0;
        }
    }
    return sqrt(sum / number);
}

static bool compare_labels(struct run *run)
{
    char error[VOLUME_TEXT];
    struct volume fixed, moving;
    struct field still;
    float *moved = malloc(volume_voxels(&run->fixed) * sizeof *moved);
    if (!volume_read(run->fixed_labels_path, run->fixed_frame, &fixed, error)) {
        free(moved);
        return fail(error);
    }
    if (!volume_read(run->moving_labels_path, run->moving_frame, &moving, error)) {
        volume_free(&fixed);
        free(moved);
        return fail(error);
    }
    bool good = volume_same_grid(&fixed, &run->fixed);
    if (!good) {
        fail("the fixed labels do not lie on the fixed image's grid");
    } else if (!moved || !field_create(&run->fixed, &still)) {
        good = no_memory();
    } else {
        field_warp_labels(&still, &moving, moved);
        run->dice_before = overlap_labels(fixed.data, moved, volume_voxels(&fixed), (float)run->label).dice;
        field_warp_labels(&run->forward, &moving, moved);
        run->dice_after = overlap_labels(fixed.data, moved, volume_voxels(&fixed), (float)run->label).dice;
        run->has_labels = true;
        field_free(&still);
    }
    volume_free(&fixed);
    volume_free(&moving);
    free(moved);
    return good;
}

static bool compare_points(struct run *run)
{
    char error[VOLUME_TEXT];
    float *fixed = NULL, *moving = NULL;
    size_t count = 0, moving_count = 0;
    if (!points_read(run->fixed_points_path, &run->fixed, &fixed, &count, error)
        || !points_read(run->moving_points_path, &run->moving, &moving, &moving_count, error)) {
        free(fixed);
        return fail(error);
    }
    if (count != moving_count) {
        free(fixed);
        free(moving);
        return fail("there are not as many points in one image as in the other");
    }
    for (size_t n = 0; n < count; ++n) {
        float mapped[3], before[3], after[3];
        field_map(&run->forward, fixed + 3 * n, mapped);
        vec3_sub(fixed + 3 * n, moving + 3 * n, before);
        vec3_sub(mapped, moving + 3 * n, after);
        run->points_before.mean += (double)vec3_length(before) / (double)count;
        run->points_before.max = fmax(run->points_before.max, (double)vec3_length(before));
        run->points_after.mean += (double)vec3_length(after) / (double)count;
        run->points_after.max = fmax(run->points_after.max, (double)vec3_length(after));
    }
    run->has_points = true;
    run->point_count = count;
    free(fixed);
    free(moving);
    return true;
}

/* Chooses the windows as the registration does: a common one if both images have one scale. */
static void windows(const struct run *run, struct register_window *fixed, struct register_window *moving)
{
    *fixed = *moving = (struct register_window){0.0f, 1.0f};
    register_window_of(&run->fixed, fixed);
    register_window_of(&run->moving, moving);
    if (run->registration.one_scale) {
        moving->low = fixed->low = fminf(fixed->low, moving->low);
        moving->high = fixed->high = fmaxf(fixed->high, moving->high);
    }
}

static bool measure(struct run *run)
{
    struct register_window fixed, moving;
    struct field still;
    const size_t total = volume_voxels(&run->fixed);
    run->unmoved = malloc(total * sizeof *run->unmoved);
    run->warped = malloc(total * sizeof *run->warped);
    run->jacobian = malloc(total * sizeof *run->jacobian);
    if (!run->unmoved || !run->warped || !run->jacobian || !field_create(&run->fixed, &still)) {
        return no_memory();
    }
    field_warp(&still, &run->moving, NAN, run->unmoved);
    field_warp(&run->forward, &run->moving, NAN, run->warped);
    field_free(&still);
    run->min_jacobian = field_jacobian(&run->forward, run->jacobian);
    windows(run, &fixed, &moving);
    run->rms_before = rms(run, run->unmoved, fixed, moving);
    run->rms_after = rms(run, run->warped, fixed, moving);
    for (size_t n = 0; n < total; ++n) {
        run->unmoved[n] = isnan(run->unmoved[n]) ? run->moving.minimum : run->unmoved[n];
        run->warped[n] = isnan(run->warped[n]) ? run->moving.minimum : run->warped[n];
    }
    compare_inverse(run);
    return (!run->fixed_labels_path || compare_labels(run)) && (!run->fixed_points_path || compare_points(run));
}

/* ---- output ---- */

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
    windows(run, &fixed, &moving);
    for (; good && done < PICTURES; done += good) {
        const float *moved = done % 2 ? run->warped : run->unmoved;
        for (size_t n = 0; n < volume_voxels(&run->fixed); ++n) {
            int place[3];
            volume_place(dims, n, place);
            const float f = normalized(run->fixed.data[n], fixed), m = normalized(moved[n], moving);
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
        return no_memory();
    }
    good = image_write_png(&all, path);
    image_free(&all);
    return good || fail("cannot write the picture");
}

static void json_pair(struct json_writer *json, const char *key, struct pair pair)
{
    json_object_begin(json, key);
    json_number(json, "mean", pair.mean);
    json_number(json, "max", pair.max);
    json_object_end(json);
}

static bool report(const struct run *run, const char *path)
{
    const struct register_settings *set = &run->settings;
    const struct registration *reg = &run->registration;
    struct json_writer json;
    if (!json_open(&json, path)) {
        return fail("cannot write the report");
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "register");
    json_string(&json, "fixed", run->fixed_path);
    json_string(&json, "moving", run->moving_path);
    json_string(&json, "field", run->field_path);
    if (!run->field_path) {
        json_string(&json, "align", run->align);
        json_string(&json, "similarity", run->similarity);
        json_bool(&json, "one_scale", reg->one_scale);
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
    json_number(&json, "jacobian_min", (double)run->min_jacobian);
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
    json_integer(&json, "threads", run_threads());
    json_number(&json, "seconds", run->seconds);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_object_end(&json);
    return json_close(&json) || fail("writing the report failed");
}

static bool write_all(const struct run *run)
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
        return fail(error);
    }
    return draw(run, path[4]) && report(run, path[5]);
}

static void print_summary(const struct run *run)
{
    if (!cli_may_print(&run->common)) {
        return;
    }
    printf("difference (RMS, range 0..1) %.4f before, %.4f after; %.1f s\n", run->rms_before, run->rms_after, run->seconds);
    printf("smallest Jacobian %.3f; inverse of forward: mean %.4f mm, largest %.3f mm\n", (double)run->min_jacobian,
           run->inverse_error.mean, run->inverse_error.max);
    if (run->has_labels) {
        printf("Dice %.4f before, %.4f after\n", run->dice_before, run->dice_after);
    }
    if (run->has_points) {
        printf("%zu points: %.2f mm before (largest %.2f), %.2f mm after (largest %.2f)\n", run->point_count,
               run->points_before.mean, run->points_before.max, run->points_after.mean, run->points_after.max);
    }
}

static bool read_images(struct run *run)
{
    char error[VOLUME_TEXT];
    return (volume_read(run->fixed_path, run->fixed_frame, &run->fixed, error)
            && volume_read(run->moving_path, run->moving_frame, &run->moving, error))
           || fail(error);
}

static void free_run(struct run *run)
{
    volume_free(&run->fixed);
    volume_free(&run->moving);
    registration_free(&run->registration);
    field_free(&run->forward);
    field_free(&run->inverse);
    free(run->unmoved);
    free(run->warped);
    free(run->jacobian);
}

int main(int argc, char **argv)
{
    struct run run = {.align = "rigid", .similarity = "ssd", .label = -1};
    springls_params params;
    run.common = cli_common_defaults();
    run.settings = register_defaults();
    int status = read_command_line(&run, argc, argv);
    if (status == CLI_CONTINUE) {
        status = run_options("register", &run.common, NULL, &params);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (strcmp(run.common.backend, "opencl") == 0 && !run.common.quiet) {
        fprintf(stderr, "register: no springls here: --backend opencl changes nothing\n");
    }
    const double begin = elapsed_seconds();
    bool done = read_images(&run) && make_fields(&run);
    run.seconds = elapsed_seconds() - begin;
    done = done && measure(&run);
    if (done) {
        print_summary(&run);
    }
    done = done && (!run.common.out || write_all(&run)) && (!run.common.json || report(&run, run.common.json));
    free_run(&run);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
