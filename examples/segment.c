/* segment.c - finds an object in a medical image with an active contour (paper, section 5.6).
 *
 *   segment scan.nii.gz --level 110 --out result
 *   segment scan.nii.gz --window 100,300 --init torus --center 20,-35,10 --radius 40 --out result
 *   segment scan.nii.gz --level 110 --reference labels.nii.gz --label 77,78
 *
 * Pressure pushes the contour outward where the intensity is inside the window and inward elsewhere, curvature smooths
 * it. It may start anywhere, split and merge. It works on a grid of cubes of its own; the pressure is read from the image
 * in the image's resolution, blurred where the grid is coarser. A starting shape runs on coarser grids first: there the
 * way to the object is short. All places and lengths are millimetres in the image's RAS+ axes. */
#define SPRINGLS_IMPLEMENTATION
#include "springls_cl.h"

#include "common/run_options.h"
#include "common/segment.h"

#include <math.h>
#include <string.h>

/* The next of a comma-separated list: its length, or 0 when it is empty or longer than `size` - 1. */
static size_t next_item(const char *text, char *item, size_t size)
{
    const size_t length = strcspn(text, ",");
    if (length >= size) {
        return 0;
    }
    memcpy(item, text, length);
    item[length] = '\0';
    return length;
}

/* "a,b" with a < b. */
static bool read_window(const char *text, double *low, double *high)
{
    char item[64];
    const size_t length = next_item(text, item, sizeof item);
    return length > 0 && text[length] == ',' && cli_read_double(item, low) && cli_read_double(text + length + 1, high)
        && *low < *high;
}

/* "a,b,c": the count, or -1. */
static int read_labels(const char *text, int *labels)
{
    int count = 0;
    do {
        char item[16];
        const size_t length = next_item(text, item, sizeof item);
        if (length == 0 || count == SEGMENT_MOST_LABELS || !cli_read_int(item, &labels[count++])) {
            return -1;
        }
        text += length;
    } while (*text++ == ',');
    return count;
}

static int check_usage(struct segment_settings *set, const char *window)
{
    const char *wrong = NULL;
    if (window && (!isnan(set->level) || set->dark)) {
        wrong = "--window goes without --level and --dark";
    } else if (window && !read_window(window, &set->window[0], &set->window[1])) {
        wrong = "--window wants LO,HI with LO < HI";
    } else if ((strcmp(set->init, "mask") == 0) != (set->mask != NULL)) {
        wrong = "--init mask and --mask FILE go together";
    } else if ((strcmp(set->init, "mesh") == 0) != (set->init_mesh != NULL)) {
        wrong = "--init mesh and --init-mesh FILE go together";
    } else if (set->label_text && !set->reference) {
        wrong = "--label goes with --reference FILE";
    } else if (set->label_text && (set->label_count = read_labels(set->label_text, set->labels)) < 0) {
        wrong = "--label wants whole numbers: K or K1,K2,...";
    }
    return wrong ? cli_fail("segment", CLI_EXIT_USAGE, "%s", wrong) : CLI_GO_ON;
}

static int read_command_line(struct segment_settings *set, int argc, char **argv)
{
    const char *window = NULL, *topology = "free";
    const struct cli_option options[] = {
        {"level", CLI_DOUBLE, &set->level, "L", "the object is brighter than L; without: Otsu's threshold", 0, 0, NULL},
        {"dark", CLI_FLAG, &set->dark, NULL, "the object is darker than the level", 0, 0, NULL},
        {"window", CLI_STRING, &window, "LO,HI", "the object lies between LO and HI", 0, 0, NULL},
        {"ramp", CLI_DOUBLE, &set->ramp, "R", "full pressure this far from the level, at most half the window; 0: a tenth of "
         "the image's range without 0.5 % at each end", 0, 1e9, NULL},
        {"curvature", CLI_DOUBLE, &set->curvature, "W", "weight of the curvature against the pressure", 0, 1, NULL},
        {"init", CLI_CHOICE, &set->init, NULL, "where the contour starts", 0, 0,
         "sphere|cube|torus|metasphere|mask|threshold|mesh"},
        {"center", CLI_FLOAT3, set->center, "X,Y,Z", "centre of the starting shape, mm; without: of the image", 0, 0, NULL},
        {"radius", CLI_DOUBLE, &set->radius, "MM", "its radius or half side; 0: a third of the image's shortest side", 0,
         1e6, NULL},
        {"mask", CLI_STRING, &set->mask, "FILE", "label map to start from", 0, 0, NULL},
        {"mask-label", CLI_INT, &set->mask_label, "K", "its label; -1: all but 0", -1, 1e9, NULL},
        {"init-mesh", CLI_STRING, &set->init_mesh, "FILE", "mesh to start from, mm", 0, 0, NULL},
        {"largest", CLI_FLAG, &set->largest, NULL, "start on every grid with the largest part only, its cavities filled", 0,
         0, NULL},
        {"levels", CLI_INT, &set->levels, "K", "grids, each twice as fine as the one before; 0: by the kind of start", 0,
         SEGMENT_MOST_LEVELS, NULL},
        {"steps", CLI_INT, &set->steps, "K", "steps at most on each grid", 0, 1e6, NULL},
        {"speed", CLI_DOUBLE, &set->speed, "V", "voxels a step at full pressure", 0.001, 2, NULL},
        {"topology", CLI_CHOICE, &topology, NULL, "may the contour split and merge?", 0, 0, "free|preserved"},
        {"set", CLI_STRING, &set->overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
        {"frame", CLI_INT, &set->frame, "K", "which image of a 4-D file, from 0", -1, 1e9, NULL},
        {"reference", CLI_STRING, &set->reference, "FILE", "label map to compare with", 0, 0, NULL},
        {"label", CLI_STRING, &set->label_text, "K[,K2..]", "its labels; without: all but 0", 0, 0, NULL},
    };
    const struct cli_positional image = {"IMAGE", &set->image, "NIfTI image", true};
    const struct cli_program program = {.name = "segment",
                                        .summary = "finds an object in an image with an active contour",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &image,
                                        .positional_count = 1};
    const int status = cli_parse(&program, argc, argv);
    set->keep_topology = strcmp(topology, "preserved") == 0;
    return status == CLI_GO_ON ? check_usage(set, window) : status;
}

int main(int argc, char **argv)
{
    static struct segment run = {.settings = {.init = "sphere", .level = (double)NAN, .curvature = 0.05, .speed = 0.5,
                                              .steps = 200, .frame = -1, .mask_label = -1, .center = {NAN, NAN, NAN}}};
    run.settings.common = cli_common_defaults();
    int status = read_command_line(&run.settings, argc, argv);
    if (status == CLI_GO_ON) {
        status = run_options("segment", &run.settings.common, run.settings.overrides, &run.params);
    }
    if (status != CLI_GO_ON) {
        return status;
    }
    if (run.settings.keep_topology) {
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    }
    bool done = segment_read(&run) && segment_run(&run) && (!run.settings.reference || segment_compare(&run));
    if (done) {
        segment_print_summary(&run);
    }
    done = done && (!run.settings.common.out || segment_write(&run))
        && (!run.settings.common.json || segment_report(&run, run.settings.common.json));
    segment_free(&run);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
