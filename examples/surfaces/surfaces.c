/* surfaces.c - every label of a map as a smooth surface.
 *
 *   surfaces labels.nii.gz --out organs                           # surfaces.glb, walls.vtk, a PLY a label, table.csv
 *   surfaces labels.nii.gz --table labels.txt --out organs        # with the names of a table
 *   surfaces Segmentation.seg.nrrd --name "liver;spleen" --out two
 *
 * All labels share one net of walls (net.h): where two of them touch they have the same triangles. */
#include "surfaces/surfaces.h"

#include "base/progress.h"
#include "springls/run_options.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

bool surfaces_fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    const bool failed = cli_failed("surfaces", format, list);
    va_end(list);
    return failed;
}

bool surfaces_no_memory(void) { return surfaces_fail("not enough memory"); }

static int read_command_line(struct surfaces_settings *set, int argc, char **argv)
{
    const struct cli_option options[] = {
        {"table", CLI_STRING, &set->table, "FILE", "names and colors: ITK-SNAP's label descriptions, or lines of id name R G B A", 0, 0,
         NULL},
        {"label", CLI_STRING, &set->chosen, "K[,K2..]", "write these labels only", 0, 0, NULL},
        {"name", CLI_STRING, &set->named, "NAME[;..]", "write these too, by their names", 0, 0, NULL},
        {"layer", CLI_INT, &set->layer, "K", "which layer of a file with several, from 0; without: all of a .seg.nrrd", 0, 1e9, NULL},
        {"smooth", CLI_INT, &set->smooth, "K", "steps that make the walls fair; 0: none, the steps of voxels stay", 0, 1e5, NULL},
        {"meshes", CLI_CHOICE, &set->format, NULL, "a file for each label besides", 0, 0, "ply|obj|stl|none"},
        {"no-pictures", CLI_FLAG, &set->no_pictures, NULL, "draw no picture", 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "meshes", .needs = "out"},
        {.given = "no-pictures", .needs = "out"},
    };
    static const struct cli_writes writes[] = {
        {.files = "surfaces.glb|walls.vtk|layer_*.vtk|table.csv|surfaces.png|report.json|"
                  "label_*.ply|label_*.obj|label_*.stl|layer_*.ply|layer_*.obj|layer_*.stl"},
    };
    const struct cli_positional labels = {"LABELS", &set->labels, "label map: NIfTI, NRRD (.seg.nrrd too) or MetaImage", true};
    const struct cli_program program = {.name = "surfaces",
                                        .summary = "every label of a map as a smooth surface",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &labels,
                                        .positional_count = 1,
                                        .without = "grid|params|backend",
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    return cli_parse(&program, argc, argv);
}

/* Makes the surfaces of one layer after the other. -1: of the only one. */
static bool make_all(struct surfaces *run)
{
    const bool every = run->settings.layer < 0 && run->names.count > 0 && !run->settings.table;
    int layer = every ? 0 : -1;
    do {
        const size_t from = run->count;
        const bool good = surfaces_read_layer(run, layer) && surfaces_make(run, from);
        volume_free(&run->map);
        if (!good) {
            return false;
        }
    } while (every && ++layer < run->layers);
    if (run->count == 0) {
        return surfaces_fail("%.200s: no voxel has a label", run->settings.labels);
    }
    return run->chosen > 0 || surfaces_fail("%.200s: no voxel has a label asked for (--label, --name)", run->settings.labels);
}

static void free_all(struct surfaces *run)
{
    for (size_t l = 0; l < run->count; ++l) {
        label_surface_free(&run->labels[l].mesh);
        free(run->labels[l].normals);
    }
    free(run->labels);
    surfaces_free_walls(run);
    label_names_free(&run->names);
}

int main(int argc, char **argv)
{
    struct surfaces run;
    springls_params params;
    memset(&run, 0, sizeof run);
    run.settings = (struct surfaces_settings){.common = cli_common_defaults(), .format = "ply", .layer = -1, .smooth = 40};
    const struct surfaces_settings *set = &run.settings;
    int status = read_command_line(&run.settings, argc, argv);
    status = status == CLI_CONTINUE ? run_options("surfaces", &run.settings.common, NULL, &params) : status;
    if (status != CLI_CONTINUE) {
        return status;
    }
    const double start = elapsed_seconds();
    bool good = surfaces_read_names(&run) && make_all(&run);
    run.seconds = elapsed_seconds() - start;
    if (good) {
        surfaces_print(&run);
    }
    good = good && (!set->common.out || surfaces_write(&run)) && (!set->common.json || surfaces_report(&run, set->common.json));
    free_all(&run);
    return good ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
