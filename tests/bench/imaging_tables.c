/* imaging_tables.c - what make imaging has to show, from the JSON reports of its steps. */
#include "imaging.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>

const struct imaging_section imaging_sections[IMAGING_KINDS] = {
    {"Images", "Made for this run.", NULL, "", {{NULL, NULL}}},
    {"Segmentation: active contours of springls",
     "From the paper's four starting shapes, or from a mask, until the springls are at rest. The level set column is the "
     "distance from the same segmentation without springls. Rows of a graph cut show the best to expect: seeds were put "
     "one after the other into the middle of the largest error against the reference, and the method's constants were compared on "
     "images of the same kind, these included; the page of segment tells what other seeds and other organs give.",
     "A pelvis in CT, 400 steps, 49 000 springls on average, 220 to 240 s (Table 6); 0.13 +- 0.15 mm from a level set alone.",
     "Object|Steps|Springls, mean|Time, s|Dice at start|Dice|Mean distance, mm|HD95, mm|From a level set alone, mm",
     {{"film.png", "The way there: the zero level, below it the springls."}, {"slices.png", "The result."}}},
    {"Registration: a displacement field and its inverse", "Symmetric log-domain diffeomorphic demons.",
     "By another program; no figures.",
     "Images|RMS before|RMS after|Dice before|Dice after|Landmarks before, mm|after, mm|Smallest Jacobian|Inverse error, mm|"
     "Time, s",
     {{"before_after.png", "The two images before and after; the fixed image and the Jacobian of the field."}}},
    {"Tracking: springls carried through a sequence",
     "One label becomes a model; every frame's displacement field moves it in one step of Algorithm 3. Nothing is resampled: "
     "springl i is the same piece of the body in every frame. Errors are means over all frames; particles: every springl against "
     "the exact motion, where that is known.",
     "A heart in 4-D CT, one to one; no figures.",
     "Sequence|Frames|Springls|Kept in all frames|Volume, ml|Dice, least|Landmarks, mm|voxels|Particles, mm|voxels|Mode 1|"
     "Time, s",
     {{"film.png", "The frames: colours are places on the reference."}, {"particles.png", "Springls against the exact motion."},
      {"landmarks.png", "Landmarks."}, {"volume.png", "Volume."},
      {"modes.png", "Modes of the motion at -2, 0 and +2 deviations."}}},
    {"Large steps: no CFL limit",
     "One motion in 1, 2, 5 and 20 steps by Algorithm 3, and by level sets without springls. Errors in voxels against the "
     "exactly moved surface.",
     "Such steps are possible; no figures.",
     "Method|Steps|Longest step|Surface, mean|HD95|Largest|Volume|Tracking, mean|Time, s",
     {{"large_steps.png", "Error against the length of a step."}}},
    {"Atlas: point distribution models", "Springls deformed to each subject are the correspondences.",
     "A pelvis and a heart; pictures of the mean and the first mode.",
     "Model|Subjects|Vertices|Modes|Mode 1|Generalisation, mm|Specificity, mm|Model to subjects, mm|Correspondence error, mm|"
     "voxels|Time, s",
     {{"modes.png", "The mean shape, and modes at -2 and +2 deviations: red goes outward, blue inward."},
      {"curves.png", "Compactness, generalisation (leave one out), specificity."},
      {"subjects.png", "Subjects: equal colours correspond."}}},
    {"Segmentation by an atlas", "Distances after each stage: the mean shape placed, pose, modes, springls. Times count from the "
     "start. Without atlas: an active contour on the same image.",
     "A pelvis: registered 1.56 +- 1.36 mm, ten modes 1.40 +- 1.32 mm; then 100 steps, 25 000 springls, 30 s (Table 6); 0.25 +- "
     "0.32 mm from a level set alone.",
     "Stage|Time, s|Dice|Mean distance, mm|HD95, mm",
     {{"stages.png", "The stages; colours are the atlas's regions."}, {"slices.png", "The result."}}},
};

/* The least and the largest of a member of the report's "frames". */
static void range_of_frames(const struct run *run, const char *key, double *least, double *most)
{
    cJSON *report = run->json ? cJSON_Parse(run->json) : NULL;
    const cJSON *frame;
    *least = *most = (double)NAN;
    cJSON_ArrayForEach(frame, cJSON_GetObjectItem(report, "frames"))
    {
        const cJSON *value = cJSON_GetObjectItem(frame, key);
        if (cJSON_IsNumber(value)) {
            *least = fmin(*least, value->valuedouble); /* NAN gives way */
            *most = fmax(*most, value->valuedouble);
        }
    }
    cJSON_Delete(report);
}

static int size_of(const struct run *run, const char *key)
{
    cJSON *report = run->json ? cJSON_Parse(run->json) : NULL;
    const int size = cJSON_GetArraySize(cJSON_GetObjectItem(report, key));
    cJSON_Delete(report);
    return size;
}

static void row_segment(struct table *table, const struct run *run, const char *title)
{
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s", title, run_cell(run, "%.0f", "steps"), run_cell(run, "%.0f", "springls_mean"),
              run_cell(run, "%.1f", "seconds"), run_cell(run, "%.3f", "against_reference.start_dice"),
              run_cell(run, "%.3f", "against_reference.dice"), run_cell(run, "%.2f", "against_reference.mean_distance_mm"),
              run_cell(run, "%.1f", "against_reference.hd95_mm"),
              cell2("%.2f +- %.2f", run_number(run, "against_level_set.mean_distance_mm"),
                    run_number(run, "against_level_set.deviation_mm")));
}

static void row_register(struct table *table, const struct run *run, const char *title)
{
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", title, run_cell(run, "%.3f", "rms_before"),
              run_cell(run, "%.3f", "rms_after"), run_cell(run, "%.3f", "dice_before"), run_cell(run, "%.3f", "dice_after"),
              run_cell(run, "%.1f", "points_before_mm.mean"), run_cell(run, "%.1f", "points_after_mm.mean"),
              run_cell(run, "%.3f", "jacobian_min"), run_cell(run, "%.3f", "inverse_error_mm.mean"),
              run_cell(run, "%.1f", "seconds"));
}

static void row_track(struct table *table, const struct run *run, const char *title)
{
    double kept, volume[2], dice, most, modes[8];
    range_of_frames(run, "springls_kept", &kept, &most);
    range_of_frames(run, "volume_ml", &volume[0], &volume[1]);
    range_of_frames(run, "dice", &dice, &most);
    const int mode_count = run_numbers(run, "variance_of_modes", modes, 8);
    table_row(table, "%s|%d|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", title, size_of(run, "frames"), run_cell(run, "%.0f", "springls"),
              cell("%.0f", kept), cell2("%.0f to %.0f", volume[0], volume[1]), cell("%.3f", dice),
              run_cell(run, "%.2f", "landmarks_mean_mm"), run_cell(run, "%.3f", "landmarks_mean_voxels"),
              run_cell(run, "%.4f", "particles_mean_mm"), run_cell(run, "%.4f", "particles_mean_voxels"),
              cell("%.0f %%", mode_count > 0 ? 100.0 * modes[0] : (double)NAN), run_cell(run, "%.0f", "seconds"));
}

static double number_in(const cJSON *object, const char *key)
{
    const cJSON *value = cJSON_GetObjectItem(object, key);
    return cJSON_IsNumber(value) ? value->valuedouble : (double)NAN;
}

static const char *text_in(const cJSON *object, const char *key)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(object, key));
    return text ? text : "-";
}

static void rows_large_steps(struct table *table, const struct run *run)
{
    cJSON *report = run->json ? cJSON_Parse(run->json) : NULL;
    const cJSON *one;
    cJSON_ArrayForEach(one, cJSON_GetObjectItem(report, "runs"))
    {
        table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s", text_in(one, "method"), cell("%.0f", number_in(one, "steps")),
                  cell("%.2f", number_in(one, "longest_step_voxels")), cell("%.3f", number_in(one, "surface_mean_voxels")),
                  cell("%.3f", number_in(one, "surface_hd95_voxels")), cell("%.2f", number_in(one, "surface_max_voxels")),
                  cell("%+.2f %%", number_in(one, "volume_error_percent")), cell("%.4f", number_in(one, "tracking_mean_voxels")),
                  cell("%.1f", number_in(one, "seconds")));
    }
    cJSON_Delete(report);
}

static void row_build(struct table *table, const struct run *run, const char *title)
{
    double compact[64], general[64], specific[64];
    const int modes = run_numbers(run, "compactness", compact, 64);
    const int known = run_numbers(run, "generalisation_mm", general, 64) == modes
                   && run_numbers(run, "specificity_mm", specific, 64) == modes ? modes : 0;
    const double none = (double)NAN;
    table_row(table, "%s|%d|%s|%s|%s|%s|%s|%s|%s|%s|%s", title, size_of(run, "subjects"), run_cell(run, "%.0f", "vertices"),
              run_cell(run, "%.0f", "modes"), cell("%.0f %%", known ? 100.0 * compact[0] : none),
              cell("%.2f", known ? general[known - 1] : none), cell("%.2f", known ? specific[known - 1] : none),
              run_cell(run, "%.3f", "mean_distance_mm"),
              cell2("%.2f +- %.2f", run_number(run, "against_true_correspondences.mean_mm"),
                    run_number(run, "against_true_correspondences.std_mm")),
              run_cell(run, "%.2f", "against_true_correspondences.mean_voxels"), run_cell(run, "%.1f", "seconds"));
}

static void stage_row(struct table *table, const char *title, const cJSON *stage)
{
    table_row(table, "%s%s|%s|%s|%s|%s", title, text_in(stage, "name"), cell("%.1f", number_in(stage, "seconds")),
              cell("%.3f", number_in(stage, "dice")), cell("%.2f", number_in(stage, "mean_distance_mm")),
              cell("%.1f", number_in(stage, "hd95_mm")));
}

static void rows_atlas(struct table *table, const struct run *run, const char *title)
{
    char before[TABLE_CELL];
    cJSON *report = run->json ? cJSON_Parse(run->json) : NULL;
    const cJSON *stage, *beside = cJSON_GetObjectItem(report, "without_atlas");
    snprintf(before, sizeof before, "%.70s: ", title);
    cJSON_ArrayForEach(stage, cJSON_GetObjectItem(report, "stages"))
    {
        stage_row(table, before, stage);
    }
    if (cJSON_IsObject(beside)) {
        stage_row(table, before, beside);
    }
    cJSON_Delete(report);
}

void imaging_table(const struct imaging *imaging, enum imaging_kind kind, struct table *table)
{
    table_begin(table);
    table_row(table, "%s", imaging_sections[kind].columns);
    for (int s = 0; s < imaging->count; ++s) {
        const struct run *run = &imaging->runs[s];
        const char *title = imaging->steps[s].title;
        if (imaging->steps[s].kind != kind || !run->json) {
            continue;
        }
        switch (kind) {
        case IMAGING_SEGMENT: row_segment(table, run, title); break;
        case IMAGING_REGISTER: row_register(table, run, title); break;
        case IMAGING_TRACK: row_track(table, run, title); break;
        case IMAGING_LARGE_STEPS: rows_large_steps(table, run); break;
        case IMAGING_BUILD: row_build(table, run, title); break;
        case IMAGING_ATLAS: rows_atlas(table, run, title); break;
        default: break;
        }
    }
}
