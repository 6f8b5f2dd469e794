/* imaging - the imaging pipeline from end to end: segment, register, track4d, atlas. One HTML page, one report.
 *
 *   make imaging                                     on a head of the Debian package mricron-data
 *   SPRINGLS_DATA=... make imaging                   on the images of that collection
 *   make imaging IMAGE=ct.nii.gz LEVEL=150 LABELS=truth.nii.gz LABEL=1 SERIES=4d.nii.gz SERIES_LABELS=frame0.nii.gz
 *                SUBJECTS="a.nii.gz b.nii.gz c.nii.gz"     on yours; what is not given is left out
 *
 * Writes build/imaging/index.html, report.json, and a folder for every step. A step that fails is shown as failed; then the
 * exit status is 1. */
#include "imaging.h"

#include "examples/common/base/cli.h"

#include <stdio.h>
#include <stdlib.h>

const char *const imaging_folder = "build/imaging";

int main(int argc, char **argv)
{
    static struct imaging imaging = {.settings = {.templates = "/usr/share/mricron/templates", .backend = "scalar"}};
    struct imaging_settings *set = &imaging.settings;
    const struct cli_option options[] = {
        {"image", CLI_STRING, &set->image, "FILE", "your image, to be segmented", 0, 0, NULL},
        {"level", CLI_STRING, &set->level, "L", "its object is brighter than L; without: Otsu's threshold", 0, 0, NULL},
        {"labels", CLI_STRING, &set->labels, "FILE", "its label map, to compare with", 0, 0, NULL},
        {"label", CLI_STRING, &set->label, "K", "the label meant; without: all but 0", 0, 0, NULL},
        {"series", CLI_STRING, &set->series, "FILE", "your sequence of images, to be registered and tracked", 0, 0, NULL},
        {"series-labels", CLI_STRING, &set->series_labels, "FILE", "label map of its first or of all frames", 0, 0, NULL},
        {"landmarks", CLI_STRING, &set->landmarks, "FILE", "landmarks of its frames (see track4d)", 0, 0, NULL},
        {"subjects", CLI_STRING, &set->subjects, "LIST", "your label maps or meshes for an atlas, between blanks", 0, 0, NULL},
        {"templates", CLI_STRING, &set->templates, "DIR", "where mricron's images are", 0, 0, NULL},
        {"backend", CLI_CHOICE, &set->backend, NULL, "where the stages run", 0, 0, "scalar|opencl"},
        {"page", CLI_STRING, &set->page, "FILE", "writes the tables as Markdown, too", 0, 0, NULL},
        {"keep", CLI_FLAG, &set->keep, NULL, "take results of before where program and command are the same", 0, 0, NULL},
    };
    const struct cli_program program = {.name = "imaging",
                                        .summary = "runs the imaging programs one after the other and writes a page",
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    set->collection = getenv("SPRINGLS_DATA");
    if (set->series && !set->series_labels) {
        return cli_fail("imaging", CLI_EXIT_USAGE, "a series goes with labels of its first frame: what is to be followed?");
    }
    if ((set->labels || set->level) && !set->image) {
        return cli_fail("imaging", CLI_EXIT_USAGE, "level and labels go with an image");
    }
    imaging_plan(&imaging);
    char folder[200];
    snprintf(folder, sizeof folder, "%s/runs", imaging_folder);
    const struct run_options how = {.folder = folder, .label = "imaging", .at_once = 1, .keep = set->keep};
    imaging.failures = runs_do(imaging.runs, imaging.count, &how);
    const bool written = imaging_write_page(&imaging) && imaging_write_report(&imaging)
                      && (!set->page || imaging_write_markdown(&imaging, set->page));
    runs_free(imaging.runs, imaging.count);
    if (!written) {
        return cli_fail("imaging", CLI_EXIT_FAILURE, "%s: cannot write there", imaging_folder);
    }
    printf("see %s/index.html\n", imaging_folder);
    return imaging.failures > 0 ? CLI_EXIT_FAILURE : CLI_EXIT_OK;
}
