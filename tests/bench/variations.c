/* variations - one known motion of a beating heart, with the moving image on other scales, with padding, on other fields of view and in
 * other contrasts: the error at exact landmarks of build/register, of elastix by mean squares and by mutual information, and of plastimatch
 * by mutual information, where it is installed. Their fields are measured by build/register --field. Files are in build/variations/. */
#include "runs.h"
#include "table.h"

#include "examples/common/imaging/volume.h"
#include "tests/examples/elastix_parameters.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 2, METRICS = 2, REST = 0, BEAT = 5, MARGIN = 6, GRID_MM = 10 };
enum { REGISTER, ELASTIX, FIELD = ELASTIX + METRICS, PLASTIMATCH = FIELD + METRICS, PLASTIMATCH_FIELD, RUNS }; /* of one variation */

static const char folder[] = "build/variations";
static const char *const metrics[METRICS] = {
    ELASTIX_PARAMETERS("AdvancedMeanSquares"), ELASTIX_PARAMETERS("AdvancedMattesMutualInformation") "(NumberOfHistogramBins 32)\n"};
static const float air = -1000.0f;

static bool failed(const char *message)
{
    fprintf(stderr, "variations: %s\n", message);
    return false;
}

/* ---- the moving image's intensities: a voxel's value, its place, and the range of the image ---- */

struct voxel {
    float value, low, high, across, from_axis; /* across: 0..1 along i; from_axis: 1 at the circle around the slices' middle */
};

static float same(const struct voxel *v) { return v->value; }
static float plus_1024(const struct voxel *v) { return v->value + 1024.0f; }
static float scaled(const struct voxel *v) { return 0.37f * v->value + 90.0f; }
static float padded_2048(const struct voxel *v) { return v->from_axis > 1.0f ? -2048.0f : v->value; }
static float padded_3024(const struct voxel *v) { return v->from_axis > 1.0f ? -3024.0f : v->value; }
static float inverted(const struct voxel *v) { return -v->value; }
static float gamma_of(const struct voxel *v) { return 1000.0f * powf((v->value - v->low) / (v->high - v->low), 2.2f); }
static float ramp(const struct voxel *v) { return (v->value + 1024.0f) * (0.7f + 0.6f * v->across); }

/* Like MR: air and bone dark, fat bright, blood brighter than muscle. */
static float remapped(const struct voxel *v)
{
    static const float from[] = {-1100, -900, -200, -80, -20, 40, 120, 250, 400, 1500},
                       to[] = {0, 20, 300, 900, 500, 420, 700, 750, 150, 60};
    enum { LAST = sizeof from / sizeof *from - 1 };
    int i = 0;
    while (i < LAST - 1 && v->value > from[i + 1]) {
        ++i;
    }
    const float t = fmaxf(0.0f, fminf(1.0f, (v->value - from[i]) / (from[i + 1] - from[i])));
    return to[i] + t * (to[i + 1] - to[i]);
}

static const struct variation {
    const char *name;
    float (*change)(const struct voxel *v);
    int fixed_margin, moving_margin; /* voxels of air that are added around an image; less than 0: taken away */
} variations[] = {
    {"the same", same, 0, 0},
    {"plus 1024", plus_1024, 0, 0},
    {"times .37, plus 90", scaled, 0, 0},
    {"-2048 outside the circle", padded_2048, 0, 0},
    {"-3024 outside the circle", padded_3024, 0, 0},
    {"moving image padded with air", same, 0, MARGIN},
    {"fixed image cropped", same, -MARGIN, 0},
    {"inverted", inverted, 0, 0},
    {"remapped, like MR", remapped, 0, 0},
    {"gamma 2.2", gamma_of, 0, 0},
    {"ramp, .7 to 1.3", ramp, 0, 0},
};
enum { VARIATIONS = sizeof variations / sizeof *variations };

/* ---- files ---- */

static struct voxel voxel_at(const struct volume *image, const int at[3])
{
    const int *dims = image->dims;
    const float x = 2.0f * (float)at[0] / (float)(dims[0] - 1) - 1.0f, y = 2.0f * (float)at[1] / (float)(dims[1] - 1) - 1.0f;
    const size_t n = (size_t)at[0] + (size_t)dims[0] * ((size_t)at[1] + (size_t)dims[1] * (size_t)at[2]);
    return (struct voxel){image->data[n], image->minimum, image->maximum, 0.5f + 0.5f * x, hypotf(x, y)};
}

/* Writes an image changed, on a grid with a margin. */
static bool write_changed(const struct volume *image, float (*change)(const struct voxel *v), int margin, const char *path)
{
    struct volume changed;
    char error[VOLUME_TEXT] = "not enough memory";
    if (!volume_create_padded(image, margin, &changed)) {
        return failed(error);
    }
    for (size_t n = 0; n < volume_voxels(&changed); ++n) {
        int at[3];
        bool inside = true;
        volume_place(changed.dims, n, at);
        for (int a = 0; a < 3; ++a) {
            at[a] -= margin;
            inside = inside && at[a] >= 0 && at[a] < image->dims[a];
        }
        const struct voxel v = inside ? voxel_at(image, at) : (struct voxel){air, image->minimum, image->maximum, 0.5f, 0.0f};
        changed.data[n] = change(&v);
    }
    const bool written = volume_write(path, &changed, VOLUME_FLOAT32, changed.data, error);
    volume_free(&changed);
    return written || failed(error);
}

/* Writes a frame's landmarks in mm, LPS+. */
static bool write_points(const struct csv *csv, int frame)
{
    char path[256];
    int count = 0;
    snprintf(path, sizeof path, "%s/frame%d.txt", folder, frame);
    FILE *file = fopen(path, "w");
    if (!file) {
        return failed(path);
    }
    for (int row = 0; row < csv->rows; ++row) {
        count += (int)csv_at(csv, row, csv_column(csv, "frame")) == frame;
    }
    fprintf(file, "point\n%d\n", count);
    for (int row = 0; row < csv->rows; ++row) {
        if ((int)csv_at(csv, row, csv_column(csv, "frame")) == frame) {
            fprintf(file, "%.4f %.4f %.4f\n", -csv_at(csv, row, csv_column(csv, "x_mm")), -csv_at(csv, row, csv_column(csv, "y_mm")),
                    csv_at(csv, row, csv_column(csv, "z_mm")));
        }
    }
    return fclose(file) == 0 || failed(path);
}

static bool write_parameters(int metric)
{
    char path[256];
    snprintf(path, sizeof path, "%s/metric%d.txt", folder, metric);
    FILE *file = fopen(path, "w");
    if (!file) {
        return failed(path);
    }
    fprintf(file, "%s(FinalGridSpacingInPhysicalUnits %d)\n", metrics[metric], GRID_MM);
    return fclose(file) == 0 || failed(path);
}

static bool write_images(const struct volume frames[2], int which)
{
    const struct variation *v = &variations[which];
    char path[256];
    bool good = true;
    for (int m = 0; good && m < METRICS; ++m) {
        snprintf(path, sizeof path, "%s/%d_%d", folder, which, m);
        good = make_folder(path);
    }
    snprintf(path, sizeof path, "%s/fixed%d.nii", folder, which);
    good = good && write_changed(&frames[0], same, v->fixed_margin, path);
    snprintf(path, sizeof path, "%s/moving%d.nii", folder, which);
    return good && write_changed(&frames[1], v->change, v->moving_margin, path);
}

static bool write_input(const char *data)
{
    char path[1024], error[VOLUME_TEXT];
    struct csv landmarks;
    struct volume frames[2];
    snprintf(path, sizeof path, "%s/4d/ct4d_synthbeat_A_landmarks.csv", data);
    if (!make_folder(folder) || !csv_read(path, &landmarks)) {
        return failed(path);
    }
    bool good = write_points(&landmarks, REST) && write_points(&landmarks, BEAT) && write_parameters(0) && write_parameters(1);
    csv_free(&landmarks);
    snprintf(path, sizeof path, "%s/4d/ct4d_synthbeat_A.nii.gz", data);
    memset(frames, 0, sizeof frames);
    good = good && ((volume_read(path, REST, &frames[0], error) && volume_read(path, BEAT, &frames[1], error)) || failed(error));
    for (int v = 0; good && v < VARIATIONS; ++v) {
        good = write_images(frames, v);
    }
    volume_free(&frames[0]);
    volume_free(&frames[1]);
    return good;
}

/* ---- runs ---- */

static void register_command(char command[RUN_COMMAND], int which, const char *options)
{
    snprintf(command, RUN_COMMAND,
             "build/register %s/fixed%d.nii %s/moving%d.nii --fixed-points %s/frame%d.txt --moving-points %s/frame%d.txt "
             "--threads %d --quiet --json - %s",
             folder, which, folder, which, folder, REST, folder, BEAT, THREADS, options);
}

static void shell_command(struct run *run, const char *text)
{
    char word[RUN_COMMAND];
    run_command(run, "sh -c %s", run_word(text, word, sizeof word));
}

/* elastix's field is made by transformix. */
static void plan_elastix(struct run *runs, int which, int metric)
{
    char text[RUN_COMMAND], options[256], result[128];
    snprintf(result, sizeof result, "%s/%d_%d", folder, which, metric);
    run_name(&runs[ELASTIX + metric], "elastix_%d_%d", which, metric);
    snprintf(text, sizeof text, "elastix -threads %d -f %s/fixed%d.nii -m %s/moving%d.nii -p %s/metric%d.txt -out %s > %s/elastix.txt && "
                                "transformix -def all -tp %s/TransformParameters.0.txt -out %s > %s/transformix.txt && echo {}",
             THREADS, folder, which, folder, which, folder, metric, result, result, result, result, result);
    shell_command(&runs[ELASTIX + metric], text);
    run_name(&runs[FIELD + metric], "field_%d_%d", which, metric);
    snprintf(options, sizeof options, "--field %s/deformationField.nii || true", result); /* measured, whether trusted or not */
    register_command(text, which, options);
    shell_command(&runs[FIELD + metric], text);
}

/* plastimatch's B-spline on three grids, the finest of 10 mm, as elastix's. */
static bool plan_plastimatch(struct run *runs, int which)
{
    char text[RUN_COMMAND], path[256], options[256];
    snprintf(path, sizeof path, "%s/plastimatch%d.txt", folder, which);
    FILE *file = fopen(path, "w");
    if (!file) {
        return failed(path);
    }
    fprintf(file, "[GLOBAL]\nfixed=%s/fixed%d.nii\nmoving=%s/moving%d.nii\nvf_out=%s/plastimatch%d.nii.gz\n", folder, which, folder, which,
            folder, which);
    for (int scale = 4; scale > 0; scale /= 2) {
        const int grid = scale == 4 ? 3 * GRID_MM : scale * GRID_MM;
        fprintf(file, "[STAGE]\nxform=bspline\nmetric=mi\noptim=lbfgsb\nmax_its=50\ngrid_spac=%d %d %d\nres=%d %d %d\n", grid, grid, grid,
                scale, scale, scale);
    }
    if (fclose(file) != 0) {
        return failed(path);
    }
    run_name(&runs[PLASTIMATCH], "plastimatch_%d", which);
    snprintf(text, sizeof text, "OMP_NUM_THREADS=%d plastimatch register %s > %s/plastimatch.txt 2>&1 && echo {}", THREADS, path, folder);
    shell_command(&runs[PLASTIMATCH], text);
    run_name(&runs[PLASTIMATCH_FIELD], "plastimatch_field_%d", which);
    snprintf(options, sizeof options, "--field %s/plastimatch%d.nii.gz || true", folder, which);
    register_command(text, which, options);
    shell_command(&runs[PLASTIMATCH_FIELD], text);
    return true;
}

/* Does the runs of one variation. */
static int do_variation(struct run *runs, int which, bool plastimatch)
{
    struct run_options options = {.folder = folder, .label = variations[which].name, .at_once = 1};
    char command[RUN_COMMAND];
    run_name(&runs[REGISTER], "register_%d", which);
    register_command(command, which, "--align none");
    run_command(&runs[REGISTER], "%s", command);
    for (int m = 0; m < METRICS; ++m) {
        plan_elastix(runs, which, m);
    }
    const int failures = runs_do(&runs[REGISTER], 1, &options);
    options.at_once = METRICS; /* seconds are of a processor */
    const int others = runs_do(&runs[ELASTIX], METRICS, &options) + runs_do(&runs[FIELD], METRICS, &options);
    if (!plastimatch) {
        return failures + others;
    }
    return failures + others
        + (plan_plastimatch(runs, which) ? runs_do(&runs[PLASTIMATCH], 1, &options) + runs_do(&runs[PLASTIMATCH_FIELD], 1, &options) : 1);
}

int main(void)
{
    static struct run runs[VARIATIONS][RUNS];
    const char *data = getenv("SPRINGLS_DATA");
    struct table table;
    int failures = 0;
    if (!data || !data[0]) {
        return failed("SPRINGLS_DATA names no folder with images") ? 0 : 1;
    }
    if (system("elastix --version > /dev/null 2>&1") != 0) {
        return failed("elastix is not installed") ? 0 : 1;
    }
    if (!write_input(data)) {
        return 1;
    }
    const bool plastimatch = system("plastimatch --version > /dev/null 2>&1") == 0;
    if (!plastimatch) {
        fprintf(stderr, "variations: plastimatch is not installed: its columns are empty\n");
    }
    table_begin(&table);
    table_row(&table,
              "Landmarks, mean (largest), mm|register|Folds|CPU seconds|elastix, mean squares|Folds|elastix, mutual information|Folds|"
              "CPU seconds|plastimatch, mutual information|Folds|CPU seconds");
    for (int v = 0; v < VARIATIONS; ++v) {
        failures += do_variation(runs[v], v, plastimatch);
        char cells[2 + METRICS][64] = {{0}};
        const struct run *const measured[2 + METRICS] = {&runs[v][REGISTER], &runs[v][FIELD], &runs[v][FIELD + 1],
                                                         &runs[v][PLASTIMATCH_FIELD]};
        for (int m = 0; m <= METRICS + plastimatch; ++m) {
            snprintf(cells[m], sizeof cells[m], "%.2f (%.1f)|%.0f", run_number(measured[m], "points_after_mm.mean"),
                     run_number(measured[m], "points_after_mm.max"), run_number(measured[m], "folded_voxels"));
        }
        char last[128] = "||";
        if (plastimatch) {
            snprintf(last, sizeof last, "%s|%.1f", cells[1 + METRICS], runs[v][PLASTIMATCH].cpu);
        }
        table_row(&table, "%s|%s|%.1f|%s|%s|%.1f|%s", variations[v].name, cells[0], runs[v][REGISTER].cpu, cells[1], cells[2],
                  runs[v][ELASTIX + 1].cpu, last);
    }
    table_print(&table, stdout);
    runs_free(runs[0], VARIATIONS * RUNS);
    return failures > 0;
}
