/* register.c - deformable registration of two 3-D images: a dense displacement field and its inverse.
 *
 *   register fixed.nii.gz moving.nii.gz --out result
 *   register fixed.nii.gz moving.nii.gz --fixed-labels a.nii.gz --moving-labels b.nii.gz --json -
 *   register fixed.nii.gz moving.nii.gz --field deformationField.nii.gz --out result     # of another program
 *
 * The field maps points of the fixed image to the moving one, so the moving image sampled at the mapped points looks like the
 * fixed one. See registration/register.h for the method, registration/field.h for the files and the conventions of ITK and
 * elastix. */
#include "register/run.h"

#include "base/progress.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int read_command_line(struct run *run, int argc, char **argv)
{
    static const char *const aligns[] = {"none", "translation", "rigid", "affine"};
    static const char *const similarities[] = {"ssd", "lcc", "mind", "auto"};
    static const char *const starts[] = {"centers", "headers", "search"};
    struct register_settings *set = &run->settings;
    const struct cli_option options[] = {
        {"align", CLI_CHOICE, &run->align, NULL, "what comes before the deformation", 0, 0, "none|translation|rigid|affine"},
        {"start", CLI_CHOICE, &run->start, NULL, "where that begins: centres of mass or headers; headers alone; any rotation", 0, 0,
         "centers|headers|search"},
        {"similarity", CLI_CHOICE, &run->similarity, NULL, "squared differences, local correlation, self-similarity; auto: by the images",
         0, 0, "auto|ssd|lcc|mind"},
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
        {"fixed-series", CLI_STRING, &run->fixed_series, "S", "which series of a folder of DICOM files: number or description", 0, 0, NULL},
        {"moving-series", CLI_STRING, &run->moving_series, "S", "the same of the moving image", 0, 0, NULL},
        {"fixed-frame", CLI_INT, &run->fixed_frame, "K", "which image of a 4-D file, from 0", -1, 1e9, NULL},
        {"moving-frame", CLI_INT, &run->moving_frame, "K", "which image of a 4-D file, from 0", -1, 1e9, NULL},
        {"fixed-mask", CLI_STRING, &run->fixed_mask_path, "FILE", "take only the fixed image's voxels that are not 0 here", 0, 0, NULL},
        {"moving-mask", CLI_STRING, &run->moving_mask_path, "FILE", "the same of the moving image", 0, 0, NULL},
        {"fixed-labels", CLI_STRING, &run->fixed_labels_path, "FILE", "label map of the fixed image, to compare", 0, 0, NULL},
        {"moving-labels", CLI_STRING, &run->moving_labels_path, "FILE", "label map of the moving image", 0, 0, NULL},
        {"label", CLI_INT, &run->label, "K", "the label to compare; -1: all but 0", -1, 1e9, NULL},
        {"fixed-points", CLI_STRING, &run->fixed_points_path, "FILE", "landmarks of the fixed image (elastix's text)", 0, 0,
         NULL},
        {"moving-points", CLI_STRING, &run->moving_points_path, "FILE", "the same landmarks in the moving image", 0, 0, NULL},
        {"warp-labels", CLI_STRING, &run->warp.labels, "FILE", "take a label map of the moving image to the fixed one", 0, 0, NULL},
        {"warp-points", CLI_STRING, &run->warp.points, "FILE", "the same for points (elastix's text)", 0, 0, NULL},
        {"warp-mesh", CLI_STRING, &run->warp.mesh, "FILE", "the same for a mesh, mm in RAS+ axes", 0, 0, NULL},
        {"inverse-labels", CLI_STRING, &run->inverse_warp.labels, "FILE", "take a label map of the fixed image to the moving one",
         0, 0, NULL},
        {"inverse-points", CLI_STRING, &run->inverse_warp.points, "FILE", "the same for points", 0, 0, NULL},
        {"inverse-mesh", CLI_STRING, &run->inverse_warp.mesh, "FILE", "the same for a mesh", 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "field",
         .only = "FIXED|MOVING|fixed-series|moving-series|fixed-frame|moving-frame|fixed-mask|moving-mask|fixed-labels|moving-labels|"
                 "label|fixed-points|moving-points|warp-labels|warp-points|warp-mesh|inverse-labels|inverse-points|inverse-mesh|"
                 "backend|threads|json|out|quiet"},
        {.given = "start+align=none"},
        {.given = "fixed-labels", .needs = "moving-labels"},
        {.given = "moving-labels", .needs = "fixed-labels"},
        {.given = "label", .needs = "fixed-labels"},
        {.given = "fixed-points", .needs = "moving-points"},
        {.given = "moving-points", .needs = "fixed-points"},
        {.given = "warp-labels", .needs = "out"},
        {.given = "warp-points", .needs = "out"},
        {.given = "warp-mesh", .needs = "out"},
        {.given = "inverse-labels", .needs = "out"},
        {.given = "inverse-points", .needs = "out"},
        {.given = "inverse-mesh", .needs = "out"},
    };
    static const struct cli_writes writes[] = {
        {.files = "forward.nii.gz|inverse.nii.gz|warped.nii.gz|jacobian.nii.gz|before_after.png|report.json"},
        {.files = "warped_labels.nii.gz", .with = "warp-labels"},
        {.files = "warped_points.txt", .with = "warp-points"},
        {.files = "warped_mesh.ply", .with = "warp-mesh"},
        {.files = "inverse_labels.nii.gz", .with = "inverse-labels"},
        {.files = "inverse_points.txt", .with = "inverse-points"},
        {.files = "inverse_mesh.ply", .with = "inverse-mesh"},
    };
    const struct cli_positional positionals[] = {{"FIXED", &run->fixed_path, "image that stays", true},
                                                 {"MOVING", &run->moving_path, "image that is deformed to look like it", true}};
    const struct cli_program program = {.name = "register",
                                        .summary = "finds the displacement field from one image to another, and its inverse",
                                        .common = &run->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = positionals,
                                        .positional_count = 2,
                                        .without = "grid|params",
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    while (strcmp(aligns[set->align], run->align) != 0) {
        set->align = (enum register_align)(((int)set->align + 1) % 4);
    }
    while (strcmp(starts[set->start], run->start) != 0) {
        set->start = (enum register_start)(((int)set->start + 1) % 3);
    }
    while (strcmp(similarities[set->similarity], run->similarity) != 0) {
        set->similarity = (enum register_similarity)(((int)set->similarity + 1) % 4);
    }
    return CLI_CONTINUE;
}

/* Returns how the images were compared, where it was not on one scale. */
static const char *how_compared(const struct run *run)
{
    const struct registration *reg = &run->registration;
    if (run->field_path) {
        return "";
    }
    if (reg->similarity != REGISTER_SSD) {
        return reg->similarity == REGISTER_LCC ? "; compared by local correlation" : "; compared by self-similarity";
    }
    if (reg->shaded) {
        return "; compared without the shading of one image";
    }
    return reg->relation.kind == RELATION_SAME ? "" : reg->relation.kind != RELATION_LINE ? "; intensities matched by a curve"
           : reg->relation.gain < 0.0f ? "; one image is inverted" : "; intensities matched by a line";
}

static void print_summary(const struct run *run)
{
    if (!cli_may_print(&run->common)) {
        return;
    }
    if (run->rms_before >= 0.0) {
        printf("difference (RMS, range 0..1) %.4f before, %.4f after; %.1f s\n", run->rms_before, run->rms_after, run->seconds);
    } else {
        printf("difference (RMS, range 0..1) %.4f, no overlap before; %.1f s\n", run->rms_after, run->seconds);
    }
    if (isnan(run->correlation_before)) {
        printf("correlation %.3f after; mutual information %.3f bits%s\n", run->correlation_after, run->information_after,
               how_compared(run));
    } else {
        printf("correlation %.3f before, %.3f after; mutual information %.3f and %.3f bits%s\n", run->correlation_before,
               run->correlation_after, run->information_before, run->information_after, how_compared(run));
    }
    printf("smallest Jacobian %.3f; inverse of forward: mean %.4f mm, largest %.3f mm\n", (double)run->min_jacobian,
           run->inverse_error.mean, run->inverse_error.max);
    if (run->folded > 0) {
        printf("note: the map folds at %zu voxels (%.3f %%)\n", run->folded,
               100.0 * (double)run->folded / (double)volume_voxels(&run->fixed));
    }
    if (run->has_labels) {
        printf("Dice %.4f before, %.4f after\n", run->dice_before, run->dice_after);
    }
    if (run->has_points) {
        printf("%zu points: %.2f mm before (largest %.2f), %.2f mm after (largest %.2f)\n", run->point_count,
               run->points_before.mean, run->points_before.max, run->points_after.mean, run->points_after.max);
    }
}

int main(int argc, char **argv)
{
    struct run run = {.align = "rigid", .start = "centers", .similarity = "auto", .label = -1, .fixed_frame = -1,
                      .moving_frame = -1};
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
    bool done = register_read(&run) && register_fields(&run);
    run.seconds = elapsed_seconds() - begin;
    done = done && register_measure(&run);
    if (done) {
        print_summary(&run);
    }
    done = done && (!run.common.out || (register_write(&run) && register_carry(&run)));
    done = done && (!run.common.json || register_report(&run, run.common.json));
    done = done && register_is_trusted(&run);
    register_free(&run);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
