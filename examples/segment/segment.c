/* segment.c - finds objects in a medical image with active contours (paper, section 5.6).
 *
 *   segment scan.nii.gz --level 110 --out result
 *   segment scan.nrrd --window "100,300;-900,-500" --init threshold --out result     two objects, one label map
 *   segment scan.nrrd --level 110 --seed 12,-30,45 --keep-largest          grown from a place in mm
 *   segment scan.nrrd --seed 12,-30,45 --outside-seed 40,-30,45 --cut      a graph cut, refined
 *   segment scan.mha --level 110 --init mask --mask left.nii.gz --mirror --reference labels.nii.gz --label 78
 *
 * Forces: pressure pushes outward where the intensity is inside the window and inward elsewhere; the region force pushes
 * towards the side with the nearer mean intensity; edges slow both; gradient vector flow pulls to edges from far away;
 * curvature smooths. The contour may start anywhere, split and merge. The model has a grid of cubes of its own; the forces are
 * sampled in the image's resolution, blurred where the grid is coarser. A starting shape runs on coarser grids first, where
 * fewer steps lead to the object. All places and lengths are millimetres in the image's RAS+ axes. */
#include "segment/segment.h"

#include "imaging/label_names.h"
#include "springls/run_options.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Copies the next item of a list, up to one of `ends`. Returns its length, 0 when it is empty or longer than `size` - 1. */
static size_t next_item(const char *text, const char *ends, char *item, size_t size)
{
    const size_t length = strcspn(text, ends);
    if (length >= size) {
        return 0;
    }
    memcpy(item, text, length);
    item[length] = '\0';
    return length;
}

/* Reads "a,b" with a < b. */
static bool read_window(const char *text, struct segment_object *object)
{
    char item[64];
    double *window = object->window;
    const size_t length = next_item(text, ",", item, sizeof item);
    return length > 0 && text[length] == ',' && cli_read_double(item, &window[0])
        && cli_read_double(text + length + 1, &window[1]) && window[0] < window[1];
}

static bool read_mask_label(const char *text, struct segment_object *object)
{
    object->any_label = strcmp(text, "-1") == 0;
    return object->any_label || label_read(text, &object->mask_label);
}

/* Reads "a,b,c". */
static bool read_labels(const char *text, struct segment_object *object)
{
    do {
        char item[16];
        const size_t length = next_item(text, ",", item, sizeof item);
        if (length == 0 || object->label_count == SEGMENT_MAX_LABELS
            || !label_read(item, &object->labels[object->label_count++])) {
            return false;
        }
        text += length;
    } while (*text++ == ',');
    return true;
}

/* Reads a list with an item for each object, between semicolons. Returns their number, 0 when one is wrong, 1 without a text, -1 if there
 * are too many. */
static int read_objects(const char *text, bool (*read)(const char *, struct segment_object *), struct segment_object *objects)
{
    int count = 0;
    if (!text) {
        return 1;
    }
    do {
        char item[512];
        const size_t length = next_item(text, ";", item, sizeof item);
        if (count == SEGMENT_MAX_OBJECTS) {
            return -1;
        }
        if (length == 0 || !read(item, &objects[count++])) {
            return 0;
        }
        text += length;
    } while (*text++ == ';');
    return count;
}

/* Reads as many objects as there are windows or labels of the mask; a single one is used for all. Returns NULL, or what is
 * wrong. */
static const char *read_all_objects(struct segment_settings *set)
{
    struct segment_object *objects = set->objects;
    for (int o = 0; o < SEGMENT_MAX_OBJECTS; ++o) {
        objects[o].any_label = true;
    }
    const int windows = read_objects(set->window_text, read_window, objects);
    const int masks = read_objects(set->mask_label_text, read_mask_label, objects);
    const int labels = read_objects(set->label_text, read_labels, objects);
    const int count = windows > masks ? windows : masks;
    set->object_count = count;
    if (windows < 0 || masks < 0 || labels < 0) {
        return "there are at most 32 objects; build/surfaces makes the surfaces of all labels of a map";
    }
    if (windows == 0) {
        return "--window wants LO,HI with LO < HI; more of them between semicolons";
    }
    if (masks == 0) {
        return "--mask-label wants whole numbers from -1 to 4294967295: K or K1;K2;...";
    }
    if (labels == 0) {
        return "--label wants whole numbers from 0 to 4294967295: K or K1,K2,..., 64 at most; for more than one object K1;K2,K3;...";
    }
    if ((windows > 1 && windows < count) || (masks > 1 && masks < count) || (set->label_text && labels != count)) {
        return "--window, --mask-label and --label do not name as many objects";
    }
    for (int o = 0; o < count; ++o) {
        struct segment_object *object = &objects[o];
        if (o > 0 && windows == 1) {
            memcpy(object->window, objects[0].window, sizeof object->window);
        }
        if (o > 0 && masks == 1) {
            object->mask_label = objects[0].mask_label;
            object->any_label = objects[0].any_label;
        }
        object->written = object->label_count > 0                          ? object->labels[0]
                          : !object->any_label && object->mask_label > 0 ? object->mask_label
                                                                         : (uint32_t)o + 1;
        if (object->written == 0) {
            return "labels that are to be written lie between 1 and 4294967295";
        }
    }
    return NULL;
}

/* Reads "X,Y,Z;X,Y,Z;...". Returns NULL, or what is wrong with --seed and --outside-seed. */
static const char *read_seeds(const char *text, float seeds[SEGMENT_MAX_SEEDS][3], int *count)
{
    do {
        char item[128];
        const char *part = item;
        const size_t length = next_item(text, ";", item, sizeof item);
        double value[3];
        if (*count == SEGMENT_MAX_SEEDS) {
            return "there are at most 32 seeds";
        }
        for (int a = 0; a < 3; ++a) {
            char number[48];
            const size_t digits = length > 0 ? next_item(part, ",", number, sizeof number) : 0;
            if (digits == 0 || (part[digits] == ',') != (a < 2) || !cli_read_double(number, &value[a]) || fabs(value[a]) > 1e6) {
                return "a seed wants X,Y,Z in mm, at most 1e6 each, more of them between semicolons";
            }
            seeds[*count][a] = (float)value[a];
            part += digits + (a < 2 ? 1 : 0);
        }
        ++*count;
        text += length;
    } while (*text++ == ';');
    return NULL;
}

/* A cut without a level is refined by what is in it and what is not: nothing else says which intensities are the object's. */
static void choose_forces(struct segment_settings *set)
{
    const bool by_region = set->cut && isnan(set->pressure) && isnan(set->level) && !set->window_text && isnan(set->region);
    set->refines_by_region = by_region;
    set->pressure = !isnan(set->pressure) ? set->pressure : by_region ? 0.0 : 1.0;
    set->region = !isnan(set->region) ? set->region : by_region ? 1.0 : 0.0;
}

static int check_usage(struct segment_settings *set)
{
    const char *wrong = NULL;
    const bool seeded = set->seed_text != NULL;
    set->init = set->init ? set->init : seeded ? "seeds" : "sphere";
    choose_forces(set);
    if (seeded && (wrong = read_seeds(set->seed_text, set->seeds, &set->seed_count)) != NULL) {
        ;
    } else if (set->outside_text && (wrong = read_seeds(set->outside_text, set->outside_seeds, &set->outside_count)) != NULL) {
        ;
    } else if (set->cut && (wrong = segment_cut_lacks()) != NULL) {
        ;
    } else if (set->refines_by_region && (set->dark || set->ramp > 0.0 || set->solid)) {
        wrong = set->dark ? "--dark has no effect with --cut and no --level: a region force refines the cut, and knows no level"
            : set->solid  ? "--solid has no effect with --cut and no --level or --window: a region force refines the cut, without pressure"
                          : "--ramp has no effect with --cut and no --level or --window: a region force refines the cut, without pressure";
    } else if (strcmp(set->init, "mask") == 0 && !set->mask) {
        wrong = "--init mask wants --mask FILE";
    } else if (strcmp(set->init, "mesh") == 0 && !set->init_mesh) {
        wrong = "--init mesh wants --init-mesh FILE";
    } else if (!(set->pressure > 0.0 || set->region > 0.0 || set->gvf > 0.0)) {
        wrong = "without --pressure, --region and --gvf nothing moves the contour";
    } else if (set->compare_level_set && set->keep_topology) {
        wrong = "--compare-level-set goes without --topology preserved: the level set alone splits and merges";
    } else if ((wrong = read_all_objects(set)) == NULL && set->cut && set->object_count > 1) {
        wrong = "--cut finds one object: it goes with one --window";
    }
    return wrong ? cli_fail("segment", CLI_EXIT_USAGE, "%s", wrong) : CLI_CONTINUE;
}

static int read_command_line(struct segment_settings *set, int argc, char **argv)
{
    const char *topology = "free";
    const struct cli_option options[] = {
        /* the object */
        {"level", CLI_DOUBLE, &set->level, "L", "the object is brighter than L; without: Otsu's threshold", 0, 0, NULL},
        {"dark", CLI_FLAG, &set->dark, NULL, "the object is darker than the level", 0, 0, NULL},
        {"window", CLI_STRING, &set->window_text, "LO,HI[;..]",
         "the object lies between LO and HI; more windows, more objects: each a label", 0, 0, NULL},
        {"ramp", CLI_DOUBLE, &set->ramp, "R",
         "full pressure this far from the level, at most half the window; 0: a tenth of the image's range without 0.5 % at each "
         "end",
         0, 1e9, NULL},
        {"solid", CLI_FLAG, &set->solid, NULL,
         "what the object shuts in belongs to it, as marrow to bone: where a ball of three voxels does not come from outside", 0, 0, NULL},

        /* the forces */
        {"pressure", CLI_DOUBLE, &set->pressure, "W", "weight of the pressure of level or window", 0, 10, NULL},
        {"region", CLI_DOUBLE, &set->region, "W",
         "weight of the region force: towards the side whose mean intensity is nearer (Chan and Vese)", 0, 10, NULL},
        {"region-means", CLI_CHOICE, &set->region_means, NULL,
         "where the two means are taken: in the narrow band about the contour, or all over", 0, 0, "band|image"},
        {"edge", CLI_DOUBLE, &set->edge, "W", "share of both that stops at edges of the image", 0, 1, NULL},
        {"gvf", CLI_DOUBLE, &set->gvf, "W", "weight of gradient vector flow, which pulls to edges of the object", 0, 10, NULL},
        {"gvf-halvings", CLI_INT, &set->gvf_halvings, "K", "its grid: 0 the image's, 1 half as fine, ...", 0, 3, NULL},
        {"curvature", CLI_DOUBLE, &set->curvature, "W", "weight of the curvature against the pressure", 0, 1, NULL},

        /* the start */
        {"init", CLI_CHOICE, &set->init, NULL, "where the contour starts; without: a sphere, or balls at the seeds", 0, 0,
         "sphere|cube|torus|metasphere|mask|threshold|mesh"},
        {"center", CLI_FLOAT3, set->center, "X,Y,Z",
         "centre of the starting shape, mm in RAS+ axes: x to the right, y to the front, z up; without: of the image", 0, 0, NULL},
        {"radius", CLI_DOUBLE, &set->radius, "MM",
         "its radius or half side; 0: a third of the image's shortest side, or of a seed's ball 2.5 cells", 0, 1e6, NULL},
        {"seed", CLI_STRING, &set->seed_text, "X,Y,Z[;..]", "grow from balls at these places instead, mm in RAS+ axes", 0, 0, NULL},
        {"cut", CLI_FLAG, &set->cut, NULL,
         "start from a graph cut between the seeds and the image's border; without a level, a region force of 1 refines it", 0, 0, NULL},
        {"outside-seed", CLI_STRING, &set->outside_text, "X,Y,Z[;..]", "of --cut: places that are not in the object", 0, 0, NULL},
        {"mask", CLI_STRING, &set->mask, "FILE", "label map to start from", 0, 0, NULL},
        {"mask-label", CLI_STRING, &set->mask_label_text, "K[;K2..]", "its label, without: all but 0; more labels, more objects", 0, 0,
         NULL},
        {"mirror", CLI_FLAG, &set->mirror, NULL,
         "start on the other side of the body: the mask mirrored, and laid where the image looks like it", 0, 0, NULL},
        {"stay", CLI_DOUBLE, &set->stay, "MM",
         "how far from the start the contour may go; 0: anywhere; without: one voxel of the image from a mask or a mesh, half of one "
         "from a cut, else anywhere",
         0, 1e6, NULL},
        {"init-mesh", CLI_STRING, &set->init_mesh, "FILE", "mesh to start from, mm", 0, 0, NULL},
        {"clear-edges", CLI_FLAG, &set->clear_edges, NULL,
         "start without the parts that reach one of the twelve edges of the image's box, such as the air around a body", 0, 0, NULL},
        {"largest", CLI_FLAG, &set->largest, NULL, "start on every grid with the largest part only, its cavities filled", 0, 0, NULL},

        /* the run */
        {"keep-largest", CLI_FLAG, &set->keep_largest, NULL, "of the result, keep only the largest part", 0, 0, NULL},
        {"min-volume", CLI_DOUBLE, &set->min_volume, "MM3",
         "of the result, keep parts of at least this volume; without: all that are more than a single voxel", 0, 1e12, NULL},
        {"levels", CLI_INT, &set->levels, "K", "grids, each twice as fine as the one before; 0: by the kind of start", 0,
         SEGMENT_MAX_LEVELS, NULL},
        {"steps", CLI_INT, &set->steps, "K", "steps at most on each grid", 0, 1e6, NULL},
        {"speed", CLI_DOUBLE, &set->speed, "V", "voxels a step at full pressure", 0.001, 2, NULL},
        {"topology", CLI_CHOICE, &topology, NULL, "may the contour split and merge?", 0, 0, "free|preserved"},
        {"set", CLI_STRING, &set->overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
        {"series", CLI_STRING, &set->series, "S", "which series of a folder of DICOM files: number or description", 0, 0, NULL},
        {"frame", CLI_INT, &set->frame, "K", "which image of a 4-D file, from 0", -1, 1e9, NULL},

        {"no-pictures", CLI_FLAG, &set->no_pictures, NULL, "of --out, write no pictures", 0, 0, NULL},

        /* the comparison */
        {"reference", CLI_STRING, &set->reference, "FILE", "label map to compare with", 0, 0, NULL},
        {"label", CLI_STRING, &set->label_text, "K[,K2..][;..]",
         "its labels, without: all but 0; of each object between semicolons, and the first one is written", 0, 0, NULL},
        {"compare-level-set", CLI_FLAG, &set->compare_level_set, NULL,
         "do the same by a level set without springls, and report how far apart the two surfaces are", 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "level+window"},
        {.given = "dark+window"},
        {.given = "region-means", .needs = "region"},
        {.given = "gvf-halvings", .needs = "gvf"},
        {.given = "init+seed"},
        {.given = "center+seed"},
        {.given = "cut", .needs = "seed"},
        {.given = "outside-seed", .needs = "cut"},
        {.given = "center+init=mask"},
        {.given = "center+init=mesh"},
        {.given = "center+init=threshold"},
        {.given = "radius+init=mask"},
        {.given = "radius+init=mesh"},
        {.given = "radius+init=threshold"},
        {.given = "mask", .needs = "init=mask"},
        {.given = "mask-label", .needs = "init=mask"},
        {.given = "mirror", .needs = "init=mask"},
        {.given = "init-mesh", .needs = "init=mesh"},
        {.given = "label", .needs = "reference"},
        {.given = "clear-edges", .needs = "init=threshold"},
        {.given = "no-pictures", .needs = "out"},
    };
    static const struct cli_writes writes[] = {
        {.files = "labels.*|distance.nii.gz|surface.ply|surface.png|film.png|slices.png|report.json|distance_[0-9]*.nii.gz|"
                  "surface_[0-9]*.ply|surface_[0-9]*.png|film_[0-9]*.png"},
    };
    const struct cli_positional image = {"IMAGE", &set->image, "NIfTI, NRRD, MetaImage, or a folder of DICOM files", true};
    const struct cli_program program = {.name = "segment",
                                        .summary = "finds objects in an image with active contours",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = &image,
                                        .positional_count = 1,
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    const int status = cli_parse(&program, argc, argv);
    set->keep_topology = strcmp(topology, "preserved") == 0;
    return status == CLI_CONTINUE ? check_usage(set) : status;
}

/* Runs one contour after the other. */
static bool find_objects(struct segment *run)
{
    const struct segment_settings *set = &run->settings;
    for (int o = 0; o < set->object_count; ++o) {
        if (!segment_begin(run, o) || !segment_run(run) || !segment_compare(run)
            || (set->compare_level_set && !segment_compare_level_set(run))) {
            return false;
        }
        segment_keep(run);
        segment_print_summary(run);
        run->result->trusted = segment_agrees_with_start(run);
        run->doubtful = !run->result->trusted || run->doubtful;
        run->lacks_files = (set->common.out && !segment_write_object(run)) || run->lacks_files;
        segment_end_object(run);
    }
    return true;
}

int main(int argc, char **argv)
{
    struct segment run = {.settings = {.region_means = "band", .level = (double)NAN, .pressure = (double)NAN, .region = (double)NAN,
                                       .curvature = 0.06, .gvf_halvings = 1, .speed = 0.5, .stay = (double)NAN, .steps = 200,
                                       .frame = -1, .min_volume = (double)NAN, .center = {NAN, NAN, NAN}}};
    const struct segment_settings *set = &run.settings;
    run.settings.common = cli_common_defaults();
    int status = read_command_line(&run.settings, argc, argv);
    if (status == CLI_CONTINUE) {
        /* A start's edges are not the object's. */
        status = run_options("segment", &run.settings.common, "keep_edges=0,contouring=0", &run.params);
    }
    if (status == CLI_CONTINUE) {
        status = run_set_members("segment", set->overrides, &run.params);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (set->keep_topology) {
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    }
    const bool done = segment_read(&run) && find_objects(&run) && (!set->common.out || segment_write(&run))
                   && (!set->common.json || segment_report(&run, set->common.json)) && !run.lacks_files
                   && !run.doubtful;
    segment_free(&run);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
