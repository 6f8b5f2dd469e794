/* atlas.c - point distribution models made and used by springls (paper, sections 5.6 and 5.7; docs/atlas.md).
 *
 *   atlas build a.nii.gz b.nii.gz c.nii.gz --out hippocampus          # label maps: "a.nii.gz:1+2" for some labels only
 *   atlas build shapes/(star).stl --landmarks marks --out tori
 *   atlas segment scan.nii.gz --atlas hippocampus/atlas.json --out result */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include "common/atlas.h"
#include "common/run_options.h"

#include <stdio.h>
#include <string.h>

static int build_main(int argc, char **argv)
{
    static struct atlas_build build = {.settings = {.orientation = "auto", .rounds = 2, .modes = ATLAS_MOST_MODES, .samples = 100}};
    struct atlas_build_settings *set = &build.settings;
    const char *overrides = NULL;
    set->common = cli_common_defaults();
    const struct cli_option options[] = {
        {"landmarks", CLI_STRING, &set->landmarks, "DIR", "DIR/NAME.csv, lines x,y,z: corresponding places on subject NAME.*", 0, 0, NULL},
        {"images", CLI_STRING, &set->images, "DIR", "images with the label maps' names: the atlas learns intensities", 0, 0, NULL},
        {"orientation", CLI_CHOICE, &set->orientation, NULL, "of the subjects; auto: by landmarks, else known for label maps, else searched",
         0, 0, "auto|known|search"},
        {"rounds", CLI_INT, &set->rounds, "K", "the first starts from the first subject, others from the mean shape", 1, 10, NULL},
        {"modes", CLI_INT, &set->modes, "K", "modes kept at most", 1, ATLAS_MOST_MODES, NULL},
        {"keep-scale", CLI_FLAG, &set->keep_scale, NULL, "sizes are part of the model: alignment does not scale", 0, 0, NULL},
        {"mirror", CLI_FLAG, &set->mirror, NULL, "the subjects' mirror images: a right side from left ones", 0, 0, NULL},
        {"samples", CLI_INT, &set->samples, "K", "random shapes for the specificity", 1, 100000, NULL},
        {"set", CLI_STRING, &overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    const struct cli_positional rest = {"SUBJECT...", set->names, "label map (NIfTI), FILE or FILE:LABEL[+LABEL..]; or mesh", true};
    const struct cli_program program = {.name = "atlas build",
                                        .summary = "makes a point distribution model: springls find the correspondences",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &rest,
                                        .positional_count = 1,
                                        .repeated = &set->count,
                                        .repeated_most = ATLAS_MOST_SUBJECTS};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_GO_ON) {
        status = run_options("atlas build", &set->common, overrides, &build.params);
    }
    if (status == CLI_GO_ON) {
        status = atlas_build_run(&build) && atlas_build_output(&build) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    atlas_build_free(&build);
    return status;
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "build") == 0) {
        return build_main(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "--help") == 0) {
        puts("usage: atlas build|segment [options] ...\n"
             "point distribution models made and used by springls: see atlas build --help, atlas segment --help");
        return CLI_EXIT_OK;
    }
    return cli_fail("atlas", CLI_EXIT_USAGE, "expected build or segment (see --help)");
}
