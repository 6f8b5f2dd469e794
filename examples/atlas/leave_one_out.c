/* leave_one_out.c - how well atlas segment does: each subject of a folder is segmented by an atlas of the others.
 *
 * Registrations to the templates, and with --profiles correspondences, are made once for all subjects, since those of one
 * subject do not depend on the others. What is learned over subjects is learned without the one that is left out: mean, modes,
 * profiles and votes without that subject, corrections without the fifth of the subjects that it belongs to. A subject that is
 * a template itself is segmented by the other templates; without others its votes are not measured. One thing remains: the
 * surface of the first subject is where the atlas's vertices come from. */
#define _POSIX_C_SOURCE 200809L

#include "atlas/atlas.h"

#include "base/json.h"
#include "base/progress.h"
#include "base/threads.h"
#include "springls/run_options.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FOLDS = 5, MAX_PATH = 1024 };

struct trial {
    const struct atlas_trial_settings *settings;
    const springls_params *params;
    struct atlas_build build; /* of all subjects */
    char images[MAX_PATH], (*paths)[MAX_PATH];
    float *corrections[FUSION_MAX_TEMPLATES][FOLDS];
    float levels[FUSION_MAX_TEMPLATES][FOLDS];
};

static int by_name(const void *left, const void *right) { return strcmp(left, right); }

static bool list_subjects(struct trial *trial)
{
    char folder[MAX_PATH];
    snprintf(folder, sizeof folder, "%s/labels", trial->settings->folder);
    snprintf(trial->images, sizeof trial->images, "%s/images", trial->settings->folder);
    DIR *directory = opendir(folder);
    trial->paths = calloc(ATLAS_MAX_SUBJECTS, sizeof *trial->paths);
    int count = 0;
    for (struct dirent *entry; directory && trial->paths && (entry = readdir(directory)) != NULL;) {
        if (entry->d_name[0] != '.' && count < ATLAS_MAX_SUBJECTS) {
            snprintf(trial->paths[count++], MAX_PATH, "%.500s/%.500s", folder, entry->d_name);
        }
    }
    if (directory) {
        closedir(directory);
    }
    if (!trial->paths) {
        return atlas_no_memory();
    }
    qsort(trial->paths, (size_t)count, sizeof *trial->paths, by_name);
    for (int s = 0; s < count; ++s) {
        trial->build.settings.names[s] = trial->paths[s];
    }
    trial->build.settings.count = count;
    return count > FUSION_MIN_SUBJECTS || atlas_fail("%s: expected more than %d label maps", folder, FUSION_MIN_SUBJECTS);
}

/* Prepares segmentation by votes alone, which needs correspondences on the templates only. */
static bool prepare_votes(struct trial *trial)
{
    struct atlas_build *build = &trial->build;
    const struct atlas_build_settings *set = &build->settings;
    int chosen[FUSION_MAX_TEMPLATES] = {0};
    if (!atlas_subjects_read(build) || !atlas_sides_agree(build)) {
        return false;
    }
    const struct atlas_subject *first = &build->subjects[0];
    const struct shape_mesh *mesh = &build->template.mesh;
    bool good = atlas_template_create(&first->mesh, first->target.open, true, set->common.grid, &build->params, NULL,
                                      &build->template)
             && atlas_mesh_copy(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, &build->atlas.mean);
    atlas_templates_choose(build, set->templates, chosen);
    for (int t = 0; good && t < set->templates; ++t) {
        good = atlas_correspond(&build->template, &build->subjects[chosen[t]], ORIENTATION_KNOWN);
    }
    build->atlas.oriented = true;
    build->atlas.voxel = build->template.voxel;
    return good && atlas_templates_make(build);
}

/* Learns the corrections without each fold. */
static bool learn_folds(struct trial *trial)
{
    struct atlas *atlas = &trial->build.atlas;
    bool include[ATLAS_MAX_SUBJECTS];
    for (int t = 0; t < atlas->template_count; ++t) {
        for (int f = 0; f < FOLDS; ++f) {
            for (int s = 0; s < trial->build.settings.count; ++s) {
                include[s] = s % FOLDS != f;
            }
            if (!fusion_learn(&atlas->templates[t], include)) {
                return atlas_no_memory();
            }
            trial->corrections[t][f] = atlas->templates[t].correction;
            trial->levels[t][f] = atlas->templates[t].level;
            atlas->templates[t].correction = NULL;
        }
    }
    return true;
}

/* Copies rows of `length` floats without row `left_out`. */
static float *copy_others(const float *rows, size_t length, int count, int left_out)
{
    float *others = malloc((size_t)count * length * sizeof *others);
    for (int s = 0, o = 0; others && s < count; ++s) {
        if (s != left_out) {
            memcpy(others + (size_t)o++ * length, rows + (size_t)s * length, length * sizeof *others);
        }
    }
    return others;
}

/* Copies the labels of all subjects but one. */
static int *copy_labels(const struct fusion_template *from, int left_out)
{
    const size_t voxels = volume_voxels(&from->image), before = (size_t)left_out * voxels;
    int *others = malloc((size_t)(from->count - 1) * voxels * sizeof *others);
    if (others) {
        memcpy(others, from->labels, before * sizeof *others);
        memcpy(others + before, from->labels + before + voxels, ((size_t)from->count * voxels - before - voxels) * sizeof *others);
    }
    return others;
}

static bool copy_template(const struct trial *trial, int t, int left_out, struct fusion_template *copy)
{
    const struct fusion_template *from = &trial->build.atlas.templates[t];
    const size_t voxels = volume_voxels(&from->image);
    const int none[3] = {0, 0, 0}, fold = left_out % FOLDS;
    copy->self = from->self - (left_out < from->self);
    copy->count = from->count - 1;
    copy->vertices = from->vertices;
    copy->label_count = from->label_count;
    copy->labels = from->labels ? copy_labels(from, left_out) : NULL;
    copy->level = trial->levels[t][fold];
    copy->images = copy_others(from->images, voxels, from->count, left_out);
    copy->masks = copy_others(from->masks, voxels, from->count, left_out);
    copy->means = copy_others(from->means, voxels, from->count, left_out);
    copy->deviations = copy_others(from->deviations, voxels, from->count, left_out);
    copy->places = copy_others(from->places, 3 * (size_t)from->vertices, 1, -1);
    if (trial->corrections[t][fold]) {
        copy->correction = copy_others(trial->corrections[t][fold], (size_t)fusion_terms, 1, -1);
    }
    if (!copy->images || !copy->masks || !copy->means || !copy->deviations || !copy->places || (from->labels && !copy->labels)
        || (trial->corrections[t][fold] && !copy->correction)) {
        return atlas_no_memory();
    }
    const bool good = atlas_crop(&from->image, none, from->image.dims, &copy->image);
    copy->image.minimum = from->image.minimum;
    copy->image.maximum = from->image.maximum;
    return good;
}

/* Makes the atlas of all subjects but one; `others` borrows from trial->build. */
static bool make_atlas(const struct trial *trial, int left_out, struct atlas_build *others)
{
    const struct atlas_build *all = &trial->build;
    const int count = all->settings.count;
    *others = *all;
    memset(&others->atlas, 0, sizeof others->atlas);
    others->settings.count = count - 1;
    others->settings.samples = 0;
    others->subjects = calloc((size_t)count, sizeof *others->subjects);
    others->shapes = calloc((size_t)count, sizeof *others->shapes);
    if (!others->subjects || !others->shapes) {
        return atlas_no_memory();
    }
    for (int s = 0, o = 0; s < count; ++s) {
        if (s != left_out) {
            others->subjects[o++] = all->subjects[s];
        }
    }
    struct atlas *atlas = &others->atlas;
    const struct shape_mesh *mesh = &all->atlas.mean;
    atlas->oriented = all->atlas.oriented;
    memcpy(atlas->label_ids, all->atlas.label_ids, sizeof atlas->label_ids);
    if (trial->settings->profiles ? !atlas_model_make(others)
                                  : !atlas_mesh_copy(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count,
                                                     &atlas->mean)) {
        return false;
    }
    atlas->generalization = all->atlas.generalization;
    if (!trial->settings->profiles) { /* the mean alone: no modes, no regions */
        atlas->model.vertices = (size_t)mesh->vertex_count;
        atlas->model.mean = atlas->mean.positions;
        atlas->regions = calloc((size_t)mesh->vertex_count, sizeof *atlas->regions);
    }
    if (!atlas->regions) {
        return atlas_no_memory();
    }
    for (int t = 0; t < all->atlas.template_count; ++t) {
        if (all->atlas.templates[t].self != left_out) {
            if (!copy_template(trial, t, left_out, &atlas->templates[atlas->template_count++])) {
                return false;
            }
        }
    }
    return true;
}

static void free_atlas(struct atlas_build *others)
{
    for (int s = 0; others->shapes && s < others->settings.count; ++s) {
        free(others->shapes[s]);
    }
    free(others->subjects);
    free(others->shapes);
    atlas_free(&others->atlas);
}

/* Segments one subject's image in one way. The atlas is lent to the run. labels (may be NULL): receives the Dice of each label. */
static bool segment(const struct trial *trial, int subject, const char *fit, const struct atlas *atlas,
                    struct atlas_stage stages[ATLAS_STAGES], double *labels, double *seconds)
{
    struct atlas_segment run;
    char image[2 * MAX_PATH];
    const char *path = trial->paths[subject];
    memset(&run, 0, sizeof run);
    snprintf(image, sizeof image, "%s%s", trial->images, strrchr(path, '/'));
    run.settings = (struct atlas_segment_settings){.common = trial->settings->common, .image = image, .reference = path,
                                                   .fit = fit, .level = (double)NAN, .gvf = 0.2, .curvature = 0.05,
                                                   .modes = 10, .steps = 100, .frame = -1};
    run.settings.common.quiet = true;
    run.params = *trial->params;
    run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    run.atlas = *atlas;
    const bool good = atlas_segment_image(&run);
    memcpy(stages, run.results, sizeof run.results);
    for (int l = 0; labels && l < run.part_count; ++l) {
        labels[l] = run.parts[l].dice;
    }
    *seconds = run.seconds;
    memset(&run.atlas, 0, sizeof run.atlas);
    atlas_segment_free(&run);
    return good;
}

/* ---- the table ---- */

enum { TABLE = 2 * ATLAS_STAGES - 1 };

/* Without --profiles only the last three. */
static const char *const names[TABLE] = {"start", "pose", "modes", "springls on profiles", "registration", "fusion", "springls"};

static int first_column(const struct trial *trial) { return trial->settings->profiles ? 0 : ATLAS_STAGES; }

struct table {
    struct atlas_stage *cells; /* TABLE a subject; NaN where it was not measured */
    double *labels;            /* Dice of each label by votes, trial_labels a subject; NaN: neither has it, or not measured */
    double *seconds;           /* of the segmentation by votes; NaN where there was none */
    int *subjects;
    int count;
};

static int trial_labels(const struct trial *trial) { return trial->build.atlas.templates[0].label_count; }

/* Marks a subject's segmentation by votes as not measured. */
static void clear_votes(struct atlas_stage cells[TABLE], double *labels, int label_count, double *seconds)
{
    for (int c = ATLAS_STAGES; c < TABLE; ++c) {
        cells[c].dice = cells[c].mean_distance = cells[c].hd95 = cells[c].volume_ratio = (double)NAN;
    }
    for (int l = 0; l < label_count; ++l) {
        labels[l] = (double)NAN;
    }
    *seconds = (double)NAN;
}

/* Leaves out one subject: stages start, pose, modes, springls by profiles, then registration, fusion, springls by votes, which
 * are not measured where no template is left. */
static bool leave_out(const struct trial *trial, int subject, struct atlas_stage cells[TABLE], double *labels, double *seconds)
{
    struct atlas_build others;
    struct atlas_stage by_votes[ATLAS_STAGES];
    double by_profiles = 0.0;
    clear_votes(cells, labels, trial_labels(trial), seconds);
    bool good = make_atlas(trial, subject, &others)
             && (!trial->settings->profiles || segment(trial, subject, "profiles", &others.atlas, cells, NULL, &by_profiles));
    if (good && others.atlas.template_count == 0) {
        fprintf(stderr, "atlas: %s: not measured by votes: it is the only template (see --templates)\n", trial->paths[subject]);
    } else if (good) {
        good = segment(trial, subject, "auto", &others.atlas, by_votes, labels, seconds);
        memcpy(cells + ATLAS_STAGES, by_votes + 1, (ATLAS_STAGES - 1) * sizeof *cells);
    }
    free_atlas(&others);
    return good;
}

/* One column over the subjects that were measured. */
struct column {
    int count;
    double dice, worst, distance, hd95, volume, volume_low, volume_high;
};

static struct column summarize(const struct table *table, int c)
{
    struct column sum = {.worst = INFINITY, .volume_low = INFINITY};
    for (int s = 0; s < table->count; ++s) {
        sum.count += !isnan(table->cells[s * TABLE + c].dice);
    }
    for (int s = 0; s < table->count; ++s) {
        const struct atlas_stage *cell = &table->cells[s * TABLE + c];
        if (isnan(cell->dice)) {
            continue;
        }
        sum.dice += cell->dice / sum.count;
        sum.worst = fmin(sum.worst, cell->dice);
        sum.distance += cell->mean_distance / sum.count;
        sum.hd95 += cell->hd95 / sum.count;
        sum.volume += cell->volume_ratio / sum.count;
        sum.volume_low = fmin(sum.volume_low, cell->volume_ratio);
        sum.volume_high = fmax(sum.volume_high, cell->volume_ratio);
    }
    return sum;
}

/* Prints mean and worst Dice of each label. */
static void print_labels(const struct trial *trial, const struct table *table)
{
    const int labels = trial_labels(trial);
    for (int l = 0; l < labels; ++l) {
        double sum = 0.0, worst = INFINITY;
        int count = 0;
        for (int s = 0; s < table->count; ++s) {
            const double dice = table->labels[s * labels + l];
            if (!isnan(dice)) {
                sum += dice;
                worst = fmin(worst, dice);
                ++count;
            }
        }
        if (count > 0) {
            printf("  label %-12u  %.4f %.4f\n", (unsigned)trial->build.atlas.label_ids[l], sum / count, worst);
        }
    }
}

static void print_table(const struct trial *trial, const struct table *table)
{
    double mean = 0.0, longest = 0.0;
    int measured = 0; /* in the end by votes */
    printf("%-20s  %6s %6s  %8s %7s  %s\n", "stage", "Dice", "worst", "mean mm", "HD95", "volume ratio");
    for (int c = first_column(trial); c < TABLE; ++c) {
        const struct column sum = summarize(table, c);
        measured = sum.count;
        if (measured == 0) {
            printf("%-20s  not measured\n", names[c]);
            continue;
        }
        printf("%-20s  %.4f %.4f  %8.3f %7.3f  %.3f (%.3f to %.3f)\n", names[c], sum.dice, sum.worst, sum.distance, sum.hd95,
               sum.volume, sum.volume_low, sum.volume_high);
    }
    for (int s = 0; s < table->count; ++s) {
        mean += isnan(table->seconds[s]) ? 0.0 : table->seconds[s] / measured;
        longest = fmax(longest, table->seconds[s]); /* which leaves out NaN */
    }
    print_labels(trial, table);
    if (measured < table->count) {
        printf("%d of %d subjects measured by votes\n", measured, table->count);
    }
    printf("%d subjects, %.1f s each by votes, at most %.1f s, %d threads\n", table->count, mean, longest, threads_count());
}

static bool report(const struct trial *trial, const struct table *table, const char *path)
{
    struct json_writer json;
    if (!json_open(&json, path)) {
        return cli_write_failed("atlas", path);
    }
    json_object_begin(&json, NULL);
    json_string(&json, "program", "atlas leave-one-out");
    json_integer(&json, "templates", trial->build.atlas.template_count);
    json_array_begin(&json, "labels"); /* in the order of label_dice */
    for (int l = 0; l < trial_labels(trial); ++l) {
        json_integer(&json, NULL, trial->build.atlas.label_ids[l]);
    }
    json_array_end(&json);
    json_array_begin(&json, "subjects");
    for (int s = 0; s < table->count; ++s) {
        json_object_begin(&json, NULL);
        json_string(&json, "subject", strrchr(trial->paths[table->subjects[s]], '/') + 1);
        json_number(&json, "seconds", table->seconds[s]);
        json_array_begin(&json, "stages");
        for (int c = first_column(trial); c < TABLE; ++c) {
            const struct atlas_stage *cell = &table->cells[s * TABLE + c];
            json_object_begin(&json, NULL);
            json_string(&json, "name", names[c]);
            json_number(&json, "dice", cell->dice);
            json_number(&json, "mean_distance_mm", cell->mean_distance);
            json_number(&json, "hd95_mm", cell->hd95);
            json_number(&json, "volume_ratio", cell->volume_ratio);
            json_object_end(&json);
        }
        json_array_end(&json);
        json_numbers(&json, "label_dice", table->labels + s * trial_labels(trial), (size_t)trial_labels(trial));
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json) || cli_write_failed("atlas", path);
}

/* Prints a subject's Dice and volume ratio at each stage. */
static void print_subject(const struct trial *trial, const struct table *table, int row)
{
    printf("%s:", strrchr(trial->paths[table->subjects[row]], '/') + 1);
    for (int c = first_column(trial); c < TABLE; ++c) {
        const struct atlas_stage *cell = &table->cells[row * TABLE + c];
        if (!isnan(cell->dice)) {
            printf("  %s %.3f (%.3f)", names[c], cell->dice, cell->volume_ratio);
        }
    }
    if (isnan(table->seconds[row])) {
        printf("  not measured by votes\n");
    } else {
        printf(", %.1f s\n", table->seconds[row]);
    }
    fflush(stdout);
}

static bool fill_table(const struct trial *trial, struct table *table)
{
    const struct atlas_trial_settings *set = trial->settings;
    const size_t count = (size_t)trial->build.settings.count;
    struct progress bar;
    bool good = true;
    table->cells = calloc(count * TABLE, sizeof *table->cells);
    table->labels = calloc(count * (size_t)trial_labels(trial) + 1, sizeof *table->labels);
    table->seconds = calloc(count, sizeof *table->seconds);
    table->subjects = calloc(count, sizeof *table->subjects);
    if (!table->cells || !table->labels || !table->seconds || !table->subjects) {
        return atlas_no_memory();
    }
    progress_begin(&bar, "leave one out", count, !cli_may_print(&set->common));
    for (int s = set->first; good && s < trial->build.settings.count; s += set->every) {
        const int row = table->count++;
        table->subjects[row] = s;
        good = leave_out(trial, s, table->cells + row * TABLE, table->labels + row * trial_labels(trial), &table->seconds[row]);
        if (good && cli_may_print(&set->common)) {
            print_subject(trial, table, row);
        }
        progress_update(&bar, (size_t)s + 1, trial->paths[s]);
    }
    progress_end(&bar);
    return good;
}

bool atlas_leave_one_out(const struct atlas_trial_settings *settings, const springls_params *params)
{
    static struct trial trial; /* large */
    struct table table = {.count = 0};
    char path[MAX_PATH];
    memset(&trial, 0, sizeof trial);
    trial.settings = settings;
    trial.params = params;
    trial.build.params = *params;
    trial.build.settings.common = settings->common;
    trial.build.settings.images = trial.images;
    trial.build.settings.orientation = "auto";
    trial.build.settings.rounds = 1;
    trial.build.settings.modes = ATLAS_MAX_MODES;
    trial.build.settings.samples = 1;
    trial.build.settings.templates = settings->templates;
    trial.build.settings.any_side = settings->any_side;
    trial.build.settings.folder = true;
    bool good = list_subjects(&trial) && (settings->profiles ? atlas_build_run(&trial.build) : prepare_votes(&trial))
             && (trial.build.atlas.template_count > 0 || atlas_fail("the subjects need images")) && learn_folds(&trial)
             && fill_table(&trial, &table);
    if (good && cli_may_print(&settings->common)) {
        print_table(&trial, &table);
    }
    if (good && settings->common.out) {
        run_path(settings->common.out, "report.json", path, sizeof path);
        good = report(&trial, &table, path);
    }
    good = good && (!settings->common.json || report(&trial, &table, settings->common.json));
    for (int t = 0; t < FUSION_MAX_TEMPLATES; ++t) {
        for (int f = 0; f < FOLDS; ++f) {
            free(trial.corrections[t][f]);
        }
    }
    free(table.cells);
    free(table.labels);
    free(table.seconds);
    free(table.subjects);
    atlas_build_free(&trial.build);
    free(trial.paths);
    return good;
}
