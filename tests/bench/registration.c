/* registration - build/register beside elastix, on two frames of a beating heart with exact landmarks: seconds, landmark error,
 * folds. elastix's field is measured by build/register --field. Files are in build/registration/. */
#include "runs.h"
#include "table.h"

#include "examples/common/imaging/volume.h"
#include "tests/examples/elastix_parameters.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { THREADS = 2, FRAMES = 2, METHODS = 4, RUNS = 2 * METHODS - 1 };

static const char folder[] = "build/registration";
static const int frames[FRAMES] = {0, 5};           /* the heart at its largest and smallest */
static const int grid_mm[METHODS] = {0, 6, 10, 16}; /* of elastix's B-spline; 0: register */

static bool failed(const char *message)
{
    fprintf(stderr, "registration: %s\n", message);
    return false;
}

/* Writes a frame's landmarks as a point set of voxel indices. */
static bool write_points(const struct csv *csv, int frame, FILE *file)
{
    const int columns[3] = {csv_column(csv, "i"), csv_column(csv, "j"), csv_column(csv, "k")}, of = csv_column(csv, "frame");
    int count = 0;
    for (int row = 0; row < csv->rows; ++row) {
        count += (int)csv_at(csv, row, of) == frame;
    }
    fprintf(file, "index\n%d\n", count);
    for (int row = 0; row < csv->rows; ++row) {
        if ((int)csv_at(csv, row, of) == frame) {
            fprintf(file, "%.4f %.4f %.4f\n", csv_at(csv, row, columns[0]), csv_at(csv, row, columns[1]),
                    csv_at(csv, row, columns[2]));
        }
    }
    return ferror(file) == 0;
}

static bool write_frame(const char *data, const struct csv *landmarks, int frame)
{
    char path[1024], error[VOLUME_TEXT];
    struct volume image;
    snprintf(path, sizeof path, "%s/4d/ct4d_synthbeat_A.nii.gz", data);
    if (!volume_read(path, frame, &image, error)) {
        return failed(error);
    }
    snprintf(path, sizeof path, "%s/frame%d.nii", folder, frame);
    const bool written = volume_write(path, &image, VOLUME_FLOAT32, image.data, error);
    volume_free(&image);
    snprintf(path, sizeof path, "%s/frame%d.txt", folder, frame);
    FILE *file = written ? fopen(path, "w") : NULL;
    const bool good = file && write_points(landmarks, frame, file);
    return (file == NULL || fclose(file) == 0) && good ? true : failed(written ? path : error);
}

static bool write_input(const char *data)
{
    char path[1024];
    struct csv landmarks;
    bool good = true;
    snprintf(path, sizeof path, "%s/4d/ct4d_synthbeat_A_landmarks.csv", data);
    if (!make_folder(folder) || !csv_read(path, &landmarks)) {
        return failed(path);
    }
    for (int f = 0; good && f < FRAMES; ++f) {
        good = write_frame(data, &landmarks, frames[f]);
    }
    csv_free(&landmarks);
    for (int m = 1; good && m < METHODS; ++m) {
        snprintf(path, sizeof path, "%s/elastix%d", folder, grid_mm[m]);
        good = make_folder(path);
        snprintf(path, sizeof path, "%s/elastix%d.txt", folder, grid_mm[m]);
        FILE *file = good ? fopen(path, "w") : NULL;
        if (!file) {
            return failed(path);
        }
        fprintf(file, "%s(FinalGridSpacingInPhysicalUnits %d)\n", elastix_parameters, grid_mm[m]);
        good = fclose(file) == 0;
    }
    return good;
}

/* The command that registers frames or measures a field, with exact landmarks. */
static void register_command(struct run *run, const char *options)
{
    run_command(run, "build/register %s/frame%d.nii %s/frame%d.nii --fixed-points %s/frame%d.txt --moving-points %s/frame%d.txt "
                     "--threads %d --quiet --json - %s", folder, frames[0], folder, frames[1], folder, frames[0], folder,
                frames[1], THREADS, options);
}

static void plan(struct run *runs)
{
    char text[RUN_COMMAND], word[RUN_COMMAND];
    run_name(&runs[0], "register");
    register_command(&runs[0], "--align none");
    for (int m = 1; m < METHODS; ++m) {
        const int mm = grid_mm[m];
        run_name(&runs[2 * m - 1], "elastix_%d", mm);
        snprintf(text, sizeof text, "elastix -threads %d -f %s/frame%d.nii -m %s/frame%d.nii -p %s/elastix%d.txt -out %s/elastix%d "
                                    "> %s/elastix%d.log && echo {}",
                 THREADS, folder, frames[0], folder, frames[1], folder, mm, folder, mm, folder, mm);
        run_command(&runs[2 * m - 1], "sh -c %s", run_word(text, word, sizeof word));
        run_name(&runs[2 * m], "field_%d", mm);
        snprintf(text, sizeof text, "--field %s/elastix%d/deformationField.nii", folder, mm);
        register_command(&runs[2 * m], text);
    }
}

/* Runs all but the measuring of a field, whose file transformix makes. */
static int do_all(struct run *runs)
{
    const struct run_options options = {.folder = folder, .label = "registration", .at_once = 1};
    int failures = runs_do(&runs[0], 1, &options);
    for (int m = 1; m < METHODS; ++m) {
        char command[1024];
        failures += runs_do(&runs[2 * m - 1], 1, &options);
        snprintf(command, sizeof command, "transformix -def all -tp %s/elastix%d/TransformParameters.0.txt -out %s/elastix%d > "
                                          "%s/transformix.log", folder, grid_mm[m], folder, grid_mm[m], folder);
        failures += system(command) != 0;
        failures += runs_do(&runs[2 * m], 1, &options);
    }
    return failures;
}

static void print(const struct run *runs)
{
    struct table table;
    table_begin(&table);
    table_row(&table, "%d threads|Seconds|CPU seconds|Landmarks, mean, mm|Largest|Smallest Jacobian|Folded voxels", THREADS);
    for (int m = 0; m < METHODS; ++m) {
        const struct run *timed = &runs[m > 0 ? 2 * m - 1 : 0], *measured = &runs[2 * m];
        char name[64] = "register";
        if (m == 0) {
            table_row(&table, "before|||%s|%s||", run_cell(measured, "%.2f", "points_before_mm.mean"),
                      run_cell(measured, "%.2f", "points_before_mm.max"));
        } else {
            snprintf(name, sizeof name, "elastix, B-spline of %d mm", grid_mm[m]);
        }
        table_row(&table, "%s|%.1f|%.1f|%s|%s|%s|%s", name, timed->wall, timed->cpu,
                  run_cell(measured, "%.3f", "points_after_mm.mean"), run_cell(measured, "%.2f", "points_after_mm.max"),
                  run_cell(measured, "%.2f", "jacobian_min"), run_cell(measured, "%.0f", "folded_voxels"));
    }
    table_print(&table, stdout);
}

int main(void)
{
    static struct run runs[RUNS];
    const char *data = getenv("SPRINGLS_DATA");
    if (!data || !data[0]) {
        return failed("SPRINGLS_DATA names no folder with images") ? 0 : 1;
    }
    if (system("elastix --version > /dev/null 2>&1") != 0) {
        return failed("elastix is not installed") ? 0 : 1;
    }
    if (!write_input(data)) {
        return 1;
    }
    plan(runs);
    const int failures = do_all(runs);
    print(runs);
    runs_free(runs, RUNS);
    return failures > 0;
}
