/* paper_pictures.c - Table 6 and the figures that the programs draw: 1, 9, 10, 16 to 21. */
#include "paper.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Figs. 9 and 10: the tests as films ---- */

/* Writes the options of a film into a folder of its grid: with KEEP=1 another grid's may be there. */
static void film_options(char options[PAPER_PATH], const char *name, int grid)
{
    snprintf(options, PAPER_PATH, "--frames 5 --out %s/%s_%d", paper_folder, name, grid);
}

static void film(struct paper *paper, const char *name, int grid, const char *program, const char *caption)
{
    char path[PAPER_PATH], file[RUN_NAME];
    struct image image;
    snprintf(file, sizeof file, "%s_%d/%s.png", name, grid, program);
    paper_path(path, file);
    image_read_file(path, &image);
    snprintf(file, sizeof file, "%s.png", name);
    paper_picture(paper, &image, 900, file, caption);
}

void paper_fig9(struct paper *paper)
{
    char options[PAPER_PATH];
    const int grid = paper_grid(paper, paper->full ? 256 : 128);
    film_options(options, "fig09", grid);
    const int run = paper_zalesak(paper, grid, "default", "_film", options);
    paper_do(paper, "Fig. 9");
    paper_say(paper, "%d^3 voxels, default parameters; %s springls in the mean.\n", grid,
              run_cell(&paper->runs[run], "%.0f", "springls_mean"));
    film(paper, "fig09", grid, "zalesak", "Fig. 9: Zalesak's sphere makes one turn; the zero level, below it the springls");
}

void paper_fig10(struct paper *paper)
{
    char options[PAPER_PATH];
    const int grid = paper_grid(paper, paper->full ? 256 : 128);
    film_options(options, "fig10", grid);
    const int run = paper_leveque(paper, grid, 3.0, "default", "_film", options);
    struct csv series;
    char name[RUN_NAME + 16], path[PAPER_PATH];
    double least = INFINITY, most = 0.0;
    paper_do(paper, "Fig. 10");
    snprintf(name, sizeof name, "runs/%s.csv", paper->runs[run].name);
    paper_path(path, name);
    csv_read(path, &series);
    for (int row = 0; row < series.rows; ++row) {
        const double springls = csv_at(&series, row, csv_column(&series, "springls"));
        least = fmin(least, springls);
        most = fmax(most, springls);
    }
    csv_free(&series);
    paper_say(paper, "%d^3 voxels, T = 3, default parameters; %.0f to %.0f springls.\n", grid, least, most);
    film(paper, "fig10", grid, "leveque", "Fig. 10: LeVeque's test; the zero level, below it the springls");
}

/* ---- what the imaging programs make of the packaged head ---- */

static const char *const imaging_folder = "build/imaging";

bool paper_imaging(struct paper *paper)
{
    static bool done, good;
    if (!done) {
        char command[PAPER_PATH];
        snprintf(command, sizeof command, "env -u SPRINGLS_DATA build/bench/imaging%s > %s/imaging.log",
                 paper->keep ? " --keep" : "", paper_folder);
        fprintf(stderr, "  build/bench/imaging, on the packaged head ...\n");
        done = true;
        good = system(command) == 0;
    }
    if (!good) {
        fprintf(stderr, "paper: build/bench/imaging failed; see %s/imaging.log\n", paper_folder);
        ++paper->failures;
    }
    return good;
}

/* Reads a picture of a step, or the part of it between these shares of its width and height. */
static bool step_picture(const char *path, float left, float top, float right, float bottom, struct image *image)
{
    struct image all;
    char full[PAPER_PATH];
    memset(image, 0, sizeof *image);
    snprintf(full, sizeof full, "%s/%s", imaging_folder, path);
    if (!image_read_file(full, &all)) {
        return false;
    }
    const int x = (int)(left * (float)all.width), y = (int)(top * (float)all.height);
    const bool good = image_create(image, (int)(right * (float)all.width) - x, (int)(bottom * (float)all.height) - y,
                                   color_rgb(1.0f, 1.0f, 1.0f));
    if (good) {
        image_paste(image, &all, -x, -y);
    }
    image_free(&all);
    return good;
}

/* Puts a picture into the middle of a white one. */
static void set_size(struct image *image, int width, int height)
{
    struct image canvas;
    if (image_create(&canvas, width, height, color_rgb(1.0f, 1.0f, 1.0f))) {
        image_paste(&canvas, image, (width - image->width) / 2, (height - image->height) / 2);
        image_free(image);
        *image = canvas;
    }
}

void paper_fig1(struct paper *paper)
{
    enum { STAGES = 5 };
    static const char *const labels[STAGES] = {"localize: atlas placed", "register: checkerboard", "segment", "track: frame 2 of 4",
                                               "analyze: mode 1, +2 sigma"};
    struct image images[STAGES];
    if (!paper_imaging(paper)) {
        return;
    }
    step_picture("atlas_segment/stages.png", 0.2f, 0.1f, 0.4f, 0.75f, &images[0]);
    step_picture("register/before_after.png", 0.52f, 0.045f, 0.66f, 0.3f, &images[1]);
    step_picture("segment_torus/film.png", 0.67f, 0.02f, 1.0f, 0.47f, &images[2]);
    step_picture("track/film.png", 0.5f, 0.0f, 0.75f, 0.43f, &images[3]);
    step_picture("track/modes.png", 0.67f, 0.0f, 1.0f, 0.43f, &images[4]);
    for (int i = 0; i < STAGES; ++i) {
        image_shrink(&images[i], 300);
        set_size(&images[i], 310, 290);
    }
    paper_strip(paper, images, labels, STAGES, STAGES, 1000, "fig01.png",
                "Fig. 1: the imaging pipeline, each stage with the same representation, on the packaged head");
}

void paper_fig16(struct paper *paper)
{
    struct image images[2];
    if (paper_imaging(paper)) {
        step_picture("segment_cube/film.png", 0.0f, 0.0f, 1.0f, 1.0f, &images[0]);
        step_picture("segment_torus/film.png", 0.0f, 0.0f, 1.0f, 1.0f, &images[1]);
        paper_strip(paper, images, NULL, 2, 2, 900, "fig16.png", "Fig. 16: a brain segmented from a cube and from a torus");
    }
}

void paper_fig17(struct paper *paper)
{
    struct image image;
    if (paper_imaging(paper)) {
        step_picture("atlas/modes.png", 0.0f, 0.0f, 1.0f, 0.33f, &image);
        paper_picture(paper, &image, 800, "fig17.png", "Fig. 17: a point distribution model of thalami: mean shape, first mode");
        step_picture("atlas_segment/stages.png", 0.0f, 0.0f, 1.0f, 1.0f, &image);
        paper_picture(paper, &image, 1000, "fig18.png",
                      "Fig. 18: a hippocampus by an atlas: placed, registered, after the active contour");
    }
}

void paper_fig19(struct paper *paper)
{
    static const char *const labels[2] = {"reference", "tracked"};
    struct image images[2];
    if (paper_imaging(paper)) {
        step_picture("track/slices_000.png", 0.0f, 0.0f, 1.0f, 1.0f, &images[0]);
        step_picture("track/slices_002.png", 0.0f, 0.0f, 1.0f, 1.0f, &images[1]);
        paper_strip(paper, images, labels, 2, 2, 1000, "fig19.png",
                    "Fig. 19: the reference frame, and the springls carried to another frame");
        step_picture("track/modes.png", 0.0f, 0.0f, 1.0f, 0.5f, &images[0]);
        paper_picture(paper, &images[0], 800, "fig20.png",
                      "Fig. 20: the first mode of the motion: -2 deviations, mean, +2 deviations");
    }
}

/* Reads the report of a run of another driver. */
static void read_report(struct run *run, const char *folder, const char *name)
{
    char path[PAPER_PATH];
    memset(run, 0, sizeof *run);
    run_name(run, "%s", name);
    snprintf(path, sizeof path, "%s/%s.json", folder, name);
    run->json = read_whole_file(path);
}

/* Returns the Dice coefficient of the stage "springls" of an atlas's report. */
static double last_dice(const struct run *run)
{
    const char *stage = run->json ? strstr(run->json, "\"name\": \"springls\"") : NULL;
    const char *dice = stage ? strstr(stage, "\"dice\": ") : NULL;
    return dice ? strtod(dice + 8, NULL) : NAN;
}

struct experiment {
    const char *title, *report;
};

static void experiment_row(struct table *table, const char *folder, const struct experiment *experiment)
{
    struct run run;
    read_report(&run, folder, experiment->report);
    const double distance = run_number(&run, "against_level_set.mean_distance_mm");
    const double dice = run_number(&run, "against_reference.dice");
    const bool atlas = !isfinite(run_number(&run, "springls_mean"));
    table_row(table, "%s|%s|%s|%s|%s", experiment->title, run_cell(&run, "%.0f", "steps"),
              run_cell(&run, "%.0f", atlas ? "springls" : "springls_mean"),
              isfinite(distance) ? cell2("%.2f +- %.2f mm", distance, run_number(&run, "against_level_set.deviation_mm")) : "",
              cell("%.3f", atlas ? last_dice(&run) : dice));
    runs_free(&run, 1);
}

/* Runs build/bench/segmentation on the paper's kind of image, where SPRINGLS_DATA has one; false: there is none, or it failed. */
static bool segment_pelvis(struct paper *paper)
{
    const char *data = getenv("SPRINGLS_DATA");
    if (!data || !data[0]) {
        return false;
    }
    fprintf(stderr, "  build/bench/segmentation, on the CT of SPRINGLS_DATA ...\n");
    const bool good = system("build/bench/segmentation 'bones, cube' 'hip from' > build/paper/segmentation.log") == 0;
    paper->failures += !good;
    return good;
}

void paper_table6(struct paper *paper)
{
    enum { PACKAGED = 5, PELVIS = 3 };
    static const struct experiment packaged[PACKAGED] = {{"brain from a sphere", "segment_sphere"},
                                                         {"brain from a cube", "segment_cube"},
                                                         {"brain from a torus", "segment_torus"},
                                                         {"brain from a metasphere", "segment_metasphere"},
                                                         {"hippocampus with atlas", "atlas_segment"}};
    static const struct experiment pelvis[PELVIS] = {{"CT: all bones of a pelvis, from a cube", "bones__cube"},
                                                     {"CT: right hip from the left one", "right_hip_from_the_left_one"},
                                                     {"CT: left hip from the right one", "left_hip_from_the_right_one"}};
    static struct table table;
    if (!paper_imaging(paper)) {
        return;
    }
    table_begin(&table);
    table_row(&table, "Experiment|Iterations|Springls|From the level set method|Dice");
    table_row(&table, "the paper: pelvis|400|49K|0.13 +- 0.15 mm|");
    table_row(&table, "the paper: pelvis with atlas|100|25K|0.25 +- 0.32 mm|");
    for (int r = 0; r < PACKAGED; ++r) {
        experiment_row(&table, "build/imaging/runs", &packaged[r]);
    }
    const bool ct = segment_pelvis(paper);
    for (int r = 0; ct && r < PELVIS; ++r) {
        experiment_row(&table, "build/segmentation", &pelvis[r]);
    }
    paper_table(paper, &table);
}

/* ---- Fig. 21 ---- */

void paper_fig21(struct paper *paper)
{
    char path[PAPER_PATH], command[PAPER_PATH];
    struct image image;
    snprintf(command, sizeof command, "build/morph --threads 1 --quiet --json - --out %s/fig21", paper_folder);
    const struct run *run = &paper->runs[paper_run(paper, "morph", command)];
    paper_do(paper, "Fig. 21");
    paper_say(paper, "%s frames. At the end the mean distance from the model to the target is %s voxel, from the target to\n"
                     "the model %s.\n",
              run_cell(run, "%.0f", "frames"), run_cell(run, "%.3f", "distance_to_target_mean_voxels"),
              run_cell(run, "%.3f", "distance_from_target_mean_voxels"));
    paper_path(path, "fig21/strip.png");
    image_read_file(path, &image);
    paper_picture(paper, &image, 1000, "fig21.png", "Fig. 21: one walking body becomes another");
}
