/* segmentation [NAME...] - Table 6 of the paper on real images: build/segment on the CT and MR volumes of SPRINGLS_DATA, with one
 * set of default parameters; what a row gives is the image's level or window, the start, and what to compare with. NAMEs
 * choose rows whose title holds one of them. Prints a table, writes build/bench/segmentation.json. Pictures and reports are
 * in build/segmentation/. */
#include "table.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ALL_BONES "25,26,27,28,29,30,31,32,33,75,76,77,78,92,93,94,95,96,97,98,99,100,101,102,103,104,105,106,107,108,109,110," \
                  "111,112,113,114,115"
#define PELVIS "ct/ct_pelvis_TS.nii.gz"
#define PELVIS_LABELS "labels/seg_pelvis_TS_104.nii.gz"
/* Paper: sphere, cube, torus, metasphere. All so large that they reach around the bones: then marrow stays inside. */
#define AROUND "--level 100 --solid --radius 180 --levels 1 --speed 1"
#define MIRRORED "--level 100 --init mask --mirror"

static const struct {
    const char *name, *image, *arguments;
    const char *mask, *mask_label;      /* NULL: none */
    const char *reference, *label;      /* NULL: none; all but 0 */
    bool beside_level_set;
} cases[] = {
    {"bones, sphere", PELVIS, AROUND " --init sphere", NULL, NULL, PELVIS_LABELS, ALL_BONES, false},
    {"bones, cube", PELVIS, AROUND " --init cube", NULL, NULL, PELVIS_LABELS, ALL_BONES, true},
    {"bones, torus", PELVIS, AROUND " --init torus", NULL, NULL, PELVIS_LABELS, ALL_BONES, false},
    {"bones, metasphere", PELVIS, AROUND " --init metasphere", NULL, NULL, PELVIS_LABELS, ALL_BONES, false},
    {"right hip from the left one", PELVIS, MIRRORED, PELVIS_LABELS, "77", PELVIS_LABELS, "78", true},
    {"left hip from the right one", PELVIS, MIRRORED, PELVIS_LABELS, "78", PELVIS_LABELS, "77", true},
    {"left hip, flow besides", PELVIS, MIRRORED " --gvf 0.5", PELVIS_LABELS, "78", PELVIS_LABELS, "77", false},
    {"left hip, flow at full resolution", PELVIS, MIRRORED " --gvf 0.5 --gvf-halvings 0", PELVIS_LABELS, "78",
     PELVIS_LABELS, "77", false},
    {"left hip, region besides", PELVIS, MIRRORED " --pressure 0.5 --region 0.5", PELVIS_LABELS, "78", PELVIS_LABELS, "77",
     false},
    {"brain tumour, region force alone", "labels/brain1_image.nrrd",
     "--init sphere --center -46,-17,16 --radius 12 --levels 1 --pressure 0 --region 1", NULL, NULL,
     "labels/brain1_label.nrrd", NULL, false},
    {"lung, sphere", "ct/ct_lung_elastix.mha", "--level -500 --dark", NULL, NULL,
     "labels/lung_elastix_baseline_mask.mha", NULL, false},
    {"aorta and heart, threshold", "ct/ct_cardiac_TS_aorta.nii.gz", "--level 180 --init threshold --largest --grid 128", NULL, NULL,
     "labels/seg_aorta_TS.nii.gz", NULL, false},
    {"head, sphere", "ct/ct_head_vtk_quarter.mhd", "--level 1150", NULL, NULL, NULL, NULL, false},
    {"head of 4 mm slices, threshold", "ct/ct_head_aniso_dicom2stl.nii.gz", "--level 200 --init threshold", NULL, NULL, NULL,
     NULL, false},
    {"chest, threshold, 128 cells", "ct/ct_chest_LIDC0314_2x.nii.gz", "--level 200 --init threshold --grid 128", NULL, NULL, NULL,
     NULL, false},
    {"chest, threshold, 256 cells", "ct/ct_chest_LIDC0314_2x.nii.gz", "--level 200 --init threshold --grid 256", NULL, NULL, NULL,
     NULL, false},
};
enum { CASES = sizeof cases / sizeof *cases };

static bool is_wanted(const char *name, int count, char **words)
{
    bool wanted = count == 0;
    for (int w = 0; w < count; ++w) {
        wanted = wanted || strstr(name, words[w]) != NULL;
    }
    return wanted;
}

static void make_run(struct run *run, int which, const char *data)
{
    char folder[RUN_NAME];
    snprintf(folder, sizeof folder, "%s", cases[which].name);
    for (char *c = folder; *c; ++c) {
        *c = *c == ' ' || *c == ',' ? '_' : *c;
    }
    run_name(run, "%s", folder);
    run_command(run, "build/segment %s/%s %s --quiet --json - --out build/segmentation/%s", data, cases[which].image,
                cases[which].arguments, folder);
    if (cases[which].mask) {
        run_add(run, "--mask %s/%s --mask-label %s", data, cases[which].mask, cases[which].mask_label);
    }
    if (cases[which].reference) {
        run_add(run, "--reference %s/%s", data, cases[which].reference);
    }
    if (cases[which].label) {
        run_add(run, "--label %s", cases[which].label);
    }
    if (cases[which].beside_level_set) {
        run_add(run, "--compare-level-set");
    }
}

static void print(const struct run *runs, const char *const *names, int count, struct json_writer *json)
{
    struct table table;
    table_begin(&table);
    table_row(&table, "Experiment|Iterations|Mean springls|Time, s|Dice at start|Dice|Mean distance, mm|HD95, mm|"
                      "From a level set alone, mm|Peak memory, MiB");
    for (int r = 0; r < count; ++r) {
        const struct run *run = &runs[r];
        table_row(&table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", names[r], run_cell(run, "%.0f", "steps"),
                  run_cell(run, "%.0f", "springls_mean"), run_cell(run, "%.1f", "seconds"),
                  run_cell(run, "%.4f", "against_reference.start_dice"), run_cell(run, "%.4f", "against_reference.dice"),
                  run_cell(run, "%.2f", "against_reference.mean_distance_mm"), run_cell(run, "%.2f", "against_reference.hd95_mm"),
                  cell2("%.2f +- %.2f", run_number(run, "against_level_set.mean_distance_mm"),
                        run_number(run, "against_level_set.deviation_mm")),
                  run_cell(run, "%.0f", "peak_rss_mib"));
    }
    table_row(&table, "paper: pelvis|400|49K|220-240|||||0.13 +- 0.15|");
    table_row(&table, "paper: pelvis with atlas|100|25K|30|||||0.25 +- 0.32|");
    table_print(&table, stdout);
    table_json(&table, json, "Table 6");
}

int main(int argc, char **argv)
{
    static struct run runs[CASES];
    const char *names[CASES], *data = getenv("SPRINGLS_DATA");
    const struct run_options options = {.folder = "build/segmentation", .label = "segmentation", .at_once = 1,
                                        .keep = true};
    struct json_writer json;
    int count = 0;
    if (!data || !data[0]) {
        fprintf(stderr, "segmentation: SPRINGLS_DATA names no folder with images\n");
        return 1;
    }
    for (int c = 0; c < CASES; ++c) {
        if (is_wanted(cases[c].name, argc - 1, argv + 1)) {
            names[count] = cases[c].name;
            make_run(&runs[count++], c, data);
        }
    }
    if (count == 0) {
        fprintf(stderr, "segmentation: no row has such a name\n");
        return 2;
    }
    const int failures = runs_do(runs, count, &options);
    if (!json_open(&json, "build/bench/segmentation.json")) {
        fprintf(stderr, "segmentation: cannot write build/bench/segmentation.json\n");
        return 1;
    }
    json_object_begin(&json, NULL);
    json_array_begin(&json, "tables");
    print(runs, names, count, &json);
    json_array_end(&json);
    runs_json(runs, count, &json);
    json_object_end(&json);
    const bool written = json_close(&json);
    runs_free(runs, count);
    return failures > 0 || !written;
}
