/* atlas.c - point distribution models made and used by springls (paper, sections 5.6 and 5.7; docs/atlas.md).
 *
 *   atlas build a.nii.gz b.nii.gz c.nii.gz --out hippocampus          # label maps: "a.nii.gz:1+2" for some labels only
 *   atlas build a.stl b.stl c.stl --landmarks marks --out tori
 *   atlas segment scan.nii.gz --atlas hippocampus/atlas.json --out result
 *   atlas add --atlas hippocampus/atlas.json result/correspondence.ply --out larger
 *   atlas leave-one-out hippocampi                                    # how well that works: a table */
#include "atlas/atlas.h"

#include "base/same_file.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Reads "a,b" with a < b. */
static bool read_window(const char *text, double window[2])
{
    char low[64];
    const size_t length = strcspn(text, ",");
    if (text[length] != ',' || length >= sizeof low) {
        return false;
    }
    memcpy(low, text, length);
    low[length] = '\0';
    return cli_read_double(low, &window[0]) && cli_read_double(text + length + 1, &window[1]) && window[0] < window[1];
}

/* Files of an atlas. */
static const struct cli_writes built[] = {
    {.files = "atlas.json|atlas.raw|mean.ply|mode[0-9]*.ply|modes.png|subjects.png|curves.png|weights.csv|report.json|"
              "subjects/[0-9]*|particles/[0-9]*"},
};

static int build_main(int argc, char **argv)
{
    static struct atlas_build build = {
        .settings = {.orientation = "auto", .rounds = 2, .modes = ATLAS_MAX_MODES, .samples = 100, .templates = 3}};
    struct atlas_build_settings *set = &build.settings;
    const char *overrides = NULL;
    set->common = cli_common_defaults();
    const struct cli_option options[] = {
        {"landmarks", CLI_STRING, &set->landmarks, "DIR", "DIR/NAME.csv, lines x,y,z: corresponding places on subject NAME.*",
         0, 0, NULL},
        {"vertex-landmarks", CLI_INT, &set->vertex_landmarks, "K",
         "instead: K vertices of meshes of the same triangles; 0: none, else 3 or more", 0, ATLAS_MAX_LANDMARKS, NULL},
        {"images", CLI_STRING, &set->images, "PATH",
         "images with the label maps' names, or the one image: the atlas learns intensities", 0, 0, NULL},
        {"orientation", CLI_CHOICE, &set->orientation, NULL,
         "of the subjects; auto: by landmarks, else known for label maps, else searched", 0, 0, "auto|known|search"},
        {"rounds", CLI_INT, &set->rounds, "K", "the first starts from the first subject, others from the mean shape", 1, 10,
         NULL},
        {"modes", CLI_INT, &set->modes, "K", "modes kept at most", 1, ATLAS_MAX_MODES, NULL},
        {"keep-scale", CLI_FLAG, &set->keep_scale, NULL, "sizes are part of the model: alignment does not scale", 0, 0, NULL},
        {"mirror", CLI_FLAG, &set->mirror, NULL, "the subjects' mirror images: a right side from left ones", 0, 0, NULL},
        {"any-side", CLI_FLAG, &set->any_side, NULL, "take label maps of both sides of the body", 0, 0, NULL},
        {"templates", CLI_INT, &set->templates, "K",
         "with --images: subjects to whose images all are registered, for segmentation by votes", 0, FUSION_MAX_TEMPLATES, NULL},
        {"same-vertices", CLI_FLAG, &set->same_vertices, NULL,
         "vertex k of each mesh is the same place already, as in meshes of track4d: nothing is fitted", 0, 0, NULL},
        {"samples", CLI_INT, &set->samples, "K", "random shapes for the specificity", 1, 100000, NULL},
        {"set", CLI_STRING, &overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "templates", .needs = "images"},
        {.given = "vertex-landmarks+landmarks"},
        {.given = "orientation+landmarks"},
        {.given = "same-vertices", .only = "SUBJECT...|images|modes|keep-scale|mirror|templates|samples|backend|threads|json|out|quiet"},
    };
    const struct cli_positional rest = {"SUBJECT...", set->names, "label map (NIfTI), FILE or FILE:LABEL[+LABEL..]; or mesh; "
                                        "mirror:... for its mirror image",
                                        true};
    const struct cli_program program = {.name = "atlas build",
                                        .summary = "makes a point distribution model: springls find the correspondences",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &rest,
                                        .positional_count = 1,
                                        .repeated = &set->count,
                                        .max_repeated = ATLAS_MAX_SUBJECTS,
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = built,
                                        .writes_count = (int)(sizeof built / sizeof *built)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE && set->vertex_landmarks > 0 && set->vertex_landmarks < 3) {
        status = cli_fail("atlas build", CLI_EXIT_USAGE, "--vertex-landmarks wants 3 or more");
    }
    if (status == CLI_CONTINUE) {
        status = run_options("atlas build", &set->common, overrides, &build.params);
    }
    if (status == CLI_CONTINUE) {
        status = atlas_build_run(&build) && atlas_build_output(&build) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    atlas_build_free(&build);
    return status;
}

/* Refuses an --out whose files would replace those of the atlas. */
static int check_out(const char *program, const char *atlas, const char *out)
{
    return out && file_fits(atlas, out, "*")
               ? cli_fail(program, CLI_EXIT_USAGE, "--out %s is the folder of the atlas, whose files would be replaced", out)
               : CLI_CONTINUE;
}

static int add_main(int argc, char **argv)
{
    static struct atlas_build build = {
        .settings = {.orientation = "auto", .rounds = 1, .modes = ATLAS_MAX_MODES, .samples = 100, .same_vertices = true}};
    struct atlas_build_settings *set = &build.settings;
    set->common = cli_common_defaults();
    const struct cli_option options[] = {
        {"atlas", CLI_STRING, &set->extends, "FILE", "atlas.json of atlas build, with the folder subjects/ beside it", 0, 0, NULL},
        {"modes", CLI_INT, &set->modes, "K", "modes kept at most", 1, ATLAS_MAX_MODES, NULL},
        {"keep-scale", CLI_FLAG, &set->keep_scale, NULL, "sizes are part of the model: alignment does not scale", 0, 0, NULL},
        {"samples", CLI_INT, &set->samples, "K", "random shapes for the specificity", 1, 100000, NULL},
    };
    const struct cli_positional rest = {"MESH...", set->names, "correspondence.ply of atlas segment with that atlas", true};
    const struct cli_program program = {.name = "atlas add",
                                        .summary = "takes segmented subjects into an atlas: a new mean and new modes",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &rest,
                                        .positional_count = 1,
                                        .repeated = &set->count,
                                        .max_repeated = ATLAS_MAX_SUBJECTS,
                                        .without = "grid|params|backend",
                                        .writes = built,
                                        .writes_count = (int)(sizeof built / sizeof *built)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE && (!set->extends || !set->common.out)) {
        status = cli_fail("atlas add", CLI_EXIT_USAGE, "--atlas FILE and --out DIR are needed");
    }
    status = status == CLI_CONTINUE ? check_out("atlas add", set->extends, set->common.out) : status;
    if (status == CLI_CONTINUE) {
        status = run_options("atlas add", &set->common, NULL, &build.params);
    }
    if (status == CLI_CONTINUE) {
        status = atlas_add_run(&build) && atlas_build_output(&build) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    atlas_build_free(&build);
    return status;
}

static int segment_main(int argc, char **argv)
{
    static struct atlas_segment run = {.settings = {.level = (double)NAN, .gvf = (double)NAN, .curvature = 0.05, .modes = -1,
                                                    .steps = 100, .frame = -1, .fit = "auto"}};
    struct atlas_segment_settings *set = &run.settings;
    const char *overrides = NULL, *window = NULL;
    int labels[ATLAS_MAX_LABELS];
    set->common = cli_common_defaults();
    const struct cli_option options[] = {
        {"atlas", CLI_STRING, &set->atlas, "FILE", "atlas.json of atlas build", 0, 0, NULL},
        {"level", CLI_DOUBLE, &set->level, "L",
         "the object is brighter than L; without: what the atlas has learned, else Otsu's threshold", 0, 0, NULL},
        {"dark", CLI_FLAG, &set->dark, NULL, "the object is darker than the level", 0, 0, NULL},
        {"window", CLI_STRING, &window, "LO,HI", "the object lies between LO and HI", 0, 0, NULL},
        {"ramp", CLI_DOUBLE, &set->ramp, "R", "full pressure this far from the level; 0: a tenth of the image's range", 0, 1e9,
         NULL},
        {"modes", CLI_INT, &set->modes, "K", "modes of the atlas that are fitted (default 10)", 0, ATLAS_MAX_MODES, NULL},
        {"fit", CLI_CHOICE, &set->fit, NULL,
         "by votes of the atlas's subjects, or by intensities along the normals; auto: votes where the atlas has images", 0, 0,
         "auto|profiles"},
        {"leash", CLI_DOUBLE, &set->leash, "MM",
         "how far springls may go from the fitted shape; 0: twice what the modes leave of a subject, or 0.05 of its size", 0,
         1e6, NULL},
        {"gvf", CLI_DOUBLE, &set->gvf, "W", "weight of gradient vector flow against the pressure (default 0.2)", 0, 10, NULL},
        {"curvature", CLI_DOUBLE, &set->curvature, "W", "weight of the curvature against the pressure", 0, 1, NULL},
        {"steps", CLI_INT, &set->steps, "K", "steps of the springls at most", 0, 1e6, NULL},
        {"series", CLI_STRING, &set->series, "S", "which series of a folder of DICOM files: number or description", 0, 0, NULL},
        {"frame", CLI_INT, &set->frame, "K", "which image of a 4-D file, from 0", -1, 1e9, NULL},
        {"reference", CLI_STRING, &set->reference, "FILE", "label map to compare with, on the image's grid", 0, 0, NULL},
        {"label", CLI_STRING, &set->label_text, "K[+K2..]", "its labels; without: all but 0", 0, 0, NULL},
        {"beside", CLI_STRING, &set->beside, "FILE", "report.json of build/segment on the same image: without an atlas", 0, 0,
         NULL},
        {"set", CLI_STRING, &overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "level+window"},
        {.given = "dark+window"},
        {.given = "label", .needs = "reference"},
    };
    static const struct cli_writes writes[] = {
        {.files = "labels.nii.gz|surface.ply|correspondence.*|weights.csv|stages.png|slices.png|report.json"},
    };
    const struct cli_positional image = {"IMAGE", &set->image, "image (NIfTI, NRRD, MetaImage)", true};
    const struct cli_program program = {.name = "atlas segment",
                                        .summary = "finds an atlas's object in an image: pose, modes, springls",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &image,
                                        .positional_count = 1,
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE && !set->atlas) {
        status = cli_fail("atlas segment", CLI_EXIT_USAGE, "--atlas FILE is missing");
    } else if (status == CLI_CONTINUE && window && !read_window(window, set->window)) {
        status = cli_fail("atlas segment", CLI_EXIT_USAGE, "--window wants LO,HI with LO < HI");
    } else if (status == CLI_CONTINUE && set->label_text && atlas_read_labels(set->label_text, labels) < 0) {
        status = cli_fail("atlas segment", CLI_EXIT_USAGE, "--label wants whole numbers K+K2+...");
    }
    status = status == CLI_CONTINUE ? check_out("atlas segment", set->atlas, set->common.out) : status;
    set->windowed = window != NULL;
    set->of_profiles = !isnan(set->gvf) ? "--gvf" : set->modes >= 0 ? "--modes" : NULL;
    set->gvf = isnan(set->gvf) ? 0.2 : set->gvf;
    set->modes = set->modes < 0 ? 10 : set->modes;
    if (status == CLI_CONTINUE) {
        status = run_options("atlas segment", &set->common, overrides, &run.params);
    }
    if (status == CLI_CONTINUE) {
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED; /* one object, as in the atlas */
        status = atlas_segment_run(&run) && atlas_segment_output(&run) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    atlas_segment_free(&run);
    return status;
}

static int leave_one_out_main(int argc, char **argv)
{
    static struct atlas_trial_settings set = {.templates = 3, .every = 1};
    static springls_params params;
    const char *overrides = NULL;
    set.common = cli_common_defaults();
    const struct cli_option options[] = {
        {"templates", CLI_INT, &set.templates, "K", "as of atlas build", 1, FUSION_MAX_TEMPLATES, NULL},
        {"first", CLI_INT, &set.first, "K", "the first subject that is left out, from 0", 0, ATLAS_MAX_SUBJECTS, NULL},
        {"every", CLI_INT, &set.every, "K", "then every K-th", 1, ATLAS_MAX_SUBJECTS, NULL},
        {"profiles", CLI_FLAG, &set.profiles, NULL, "also by intensities along the normals: start, pose, modes, springls", 0, 0, NULL},
        {"any-side", CLI_FLAG, &set.any_side, NULL, "take label maps of both sides of the body", 0, 0, NULL},
        {"set", CLI_STRING, &overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    static const struct cli_writes writes[] = {{.files = "report.json"}};
    const struct cli_positional folder = {"FOLDER", &set.folder, "with images/ and labels/, files of the same names", true};
    const struct cli_program program = {.name = "atlas leave-one-out",
                                        .summary = "segments each subject by an atlas of the others, and compares",
                                        .common = &set.common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &folder,
                                        .positional_count = 1,
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    int status = cli_parse(&program, argc, argv);
    if (status == CLI_CONTINUE) {
        status = run_options("atlas leave-one-out", &set.common, overrides, &params);
    }
    if (status == CLI_CONTINUE) {
        status = atlas_leave_one_out(&set, &params) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    return status;
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "segment") == 0) {
        return segment_main(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "build") == 0) {
        return build_main(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "add") == 0) {
        return add_main(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "leave-one-out") == 0) {
        return leave_one_out_main(argc - 1, argv + 1);
    }
    if (argc > 1 && strcmp(argv[1], "--help") == 0) {
        puts("usage: atlas build|segment|add|leave-one-out [options] ...\n"
             "point distribution models made and used by springls: see atlas build --help, atlas segment --help");
        return CLI_EXIT_OK;
    }
    return cli_fail("atlas", CLI_EXIT_USAGE, "expected build, segment, add or leave-one-out (see --help)");
}
