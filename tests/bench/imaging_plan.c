/* imaging_plan.c - the steps of make imaging on the data at hand. Every step has the programs' own defaults: what is said
 * here is the data, the level or window of its intensities, and the start. */
#include "imaging.h"

#include <glob.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WORD = 1024 };

static const char *const starts[] = {"sphere", "cube", "torus", "metasphere"};

/* A new step: the program with the rest of its command by printf. Its name is its folder's. */
static void add(struct imaging *imaging, enum imaging_kind kind, const char *name, const char *title, const char *format, ...)
{
    static const char *const programs[IMAGING_KINDS] = {"build/bench/prepare", "build/segment", "build/register",
                                                        "build/track4d", "build/track4d --large-steps", "build/atlas build",
                                                        "build/atlas segment"};
    char words[RUN_COMMAND];
    va_list arguments;
    if (imaging->count == IMAGING_STEPS) {
        fprintf(stderr, "imaging: more than %d steps\n", (int)IMAGING_STEPS);
        exit(1);
    }
    va_start(arguments, format);
    vsnprintf(words, sizeof words, format, arguments);
    va_end(arguments);
    struct run *run = &imaging->runs[imaging->count];
    imaging->steps[imaging->count++] = (struct imaging_step){kind, title};
    run_name(run, "%s", name);
    run_command(run, "%s %s", programs[kind], words);
    if (kind != IMAGING_PREPARE) {
        run_add(run, "--out %s/%s --quiet --json - --backend %s", imaging_folder, name, imaging->settings.backend);
    }
}

/* Like add, for subjects that are files: `most` of those that the pattern describes, but none with `without` in its name. */
static void add_build(struct imaging *imaging, const char *name, const char *title, const char *folder, const char *pattern,
                      const char *without, int most, const char *options)
{
    char path[WORD], word[WORD], words[RUN_COMMAND] = "";
    size_t used = 0;
    glob_t found;
    snprintf(path, sizeof path, "%s/%s", folder, pattern);
    if (glob(path, 0, NULL, &found) == 0) {
        for (size_t f = 0; f < found.gl_pathc && most > 0; ++f) {
            run_word(found.gl_pathv[f], word, sizeof word);
            if (strstr(word, without) == NULL && used + strlen(word) + 2 < sizeof words) {
                used += (size_t)snprintf(words + used, sizeof words - used, "%s ", word);
                --most;
            }
        }
        globfree(&found);
    }
    add(imaging, IMAGING_BUILD, name, title, "%s%s", words, options);
}

/* The four starting shapes of the paper, each beside a level set alone. */
static void add_starts(struct imaging *imaging, const char *words)
{
    static const char *const names[] = {"segment_sphere", "segment_cube", "segment_torus", "segment_metasphere"};
    for (int s = 0; s < 4; ++s) {
        add(imaging, IMAGING_SEGMENT, names[s], starts[s], "%s --init %s --compare-level-set", words, starts[s]);
    }
}

/* ---- one head of a Debian package ---- */

static void plan_head(struct imaging *imaging)
{
    char head[WORD], words[RUN_COMMAND];
    const char *out = imaging_folder;
    run_word(imaging->settings.templates, head, sizeof head);
    imaging->about = "The Debian package mricron-data: one head in MR (ch2bet, the brain cut out), and two label maps of brain "
                     "regions (aal, drawn on that head; jhu189, on another). It has one image of each kind only. So the second "
                     "image to register is the head's mirror image, the sequence is that head under a made motion whose answer "
                     "is known, and the shape model has left thalami and mirrored right ones. Steps on the whole brain run "
                     "on voxels of 3 mm.";
    add(imaging, IMAGING_PREPARE, "brain", "brain on cubes of 3 mm", "%s/ch2bet.nii.gz %s/brain.nii.gz --voxel 3", head, out);
    add(imaging, IMAGING_PREPARE, "mask", "where the package has cut it out",
        "%s/ch2bet.nii.gz %s/mask.nii.gz --voxel 3 --above 10", head, out);
    add(imaging, IMAGING_PREPARE, "mirrored", "its mirror image", "%s/ch2bet.nii.gz %s/mirrored.nii.gz --voxel 3 --mirror", head,
        out);
    add(imaging, IMAGING_PREPARE, "regions", "its regions", "%s/aal.nii.gz %s/regions.nii.gz --voxel 3 --labels", head, out);
    add(imaging, IMAGING_PREPARE, "regions_mirrored", "their mirror image",
        "%s/aal.nii.gz %s/regions_mirrored.nii.gz --voxel 3 --labels --mirror", head, out);
    snprintf(words, sizeof words, "%s/brain.nii.gz --reference %s/mask.nii.gz", out, out);
    add_starts(imaging, words);
    add(imaging, IMAGING_REGISTER, "register", "a brain and its mirror image",
        "%s/brain.nii.gz %s/mirrored.nii.gz --fixed-labels %s/regions.nii.gz --moving-labels %s/regions_mirrored.nii.gz",
        out, out, out, out);
    snprintf(words, sizeof words, "%s/brain.nii.gz --labels %s/segment_sphere/labels.nii.gz --beat 4", out, out);
    add(imaging, IMAGING_TRACK, "track", "a brain that is made to beat, registered", "%s", words);
    add(imaging, IMAGING_LARGE_STEPS, "large_steps", "the same motion, sampled", "%s --true-field", words);
    add(imaging, IMAGING_BUILD, "atlas", "thalami: left ones, and right ones mirrored",
        "%s/aal.nii.gz:77 mirror:%s/aal.nii.gz:78 %s/jhu189.nii.gz:83 mirror:%s/jhu189.nii.gz:84", head, head, head, head);
    add(imaging, IMAGING_BUILD, "atlas_right", "the right hippocampus, mirrored, and its intensities",
        "mirror:%s/aal.nii.gz:38 --images %s/ch2bet.nii.gz", head, head);
    snprintf(words, sizeof words, "%s/ch2bet.nii.gz --reference %s/aal.nii.gz --label 37", head, head);
    add(imaging, IMAGING_SEGMENT, "without_atlas", "left hippocampus without an atlas: a sphere within it, grey matter",
        "%s --init sphere --center -25,-21,-10 --radius 6 --levels 1 --grid 128 --window 58,85", words);
    add(imaging, IMAGING_ATLAS, "atlas_segment", "left hippocampus by the atlas of the right one",
        "%s --atlas %s/atlas_right/atlas.json --beside %s/without_atlas/report.json", words, out, out);
}

/* ---- the collection ---- */

#define ALL_BONES "25,26,27,28,29,30,31,32,33,75,76,77,78,92,93,94,95,96,97,98,99,100,101,102,103,104,105,106,107,108,109,110," \
                  "111,112,113,114,115"

static void plan_collection_segment(struct imaging *imaging, const char *data)
{
    char words[RUN_COMMAND];
    snprintf(words, sizeof words, "%s/ct/ct_pelvis_TS.nii.gz --level 100 --solid --radius 180 --levels 1 --speed 1 --reference "
                                  "%s/labels/seg_pelvis_TS_104.nii.gz --label " ALL_BONES, data, data);
    add_starts(imaging, words);
    snprintf(words, sizeof words, "%s/ct/ct_pelvis_TS.nii.gz --level 100 --init mask --mirror --mask "
                                  "%s/labels/seg_pelvis_TS_104.nii.gz --reference %s/labels/seg_pelvis_TS_104.nii.gz",
             data, data, data);
    add(imaging, IMAGING_SEGMENT, "hip_right", "right hip from the left one mirrored", "%s --mask-label 77 --label 78", words);
    add(imaging, IMAGING_SEGMENT, "hip_left", "left hip from the right one mirrored", "%s --mask-label 78 --label 77", words);
    add(imaging, IMAGING_SEGMENT, "ventricle", "left ventricle of the echocardiogram",
        "%s/4d/echo4d_lv_11f.nii.gz --frame 0 --window 15,70 --ramp 20 --init sphere --center 108,107,109 --radius 30 "
        "--curvature 1 --stay 10 --levels 1 --topology preserved", data);
    add(imaging, IMAGING_SEGMENT, "heart_cut", "heart, a graph cut from six seeds",
        "%s/4d/ct4d_synthbeat_A.nii.gz --frame 0 --cut --seed \"-50,190,635;-25,190,610;0,150,680\" --outside-seed "
        "\"-10,190,675;-35,155,685;35,165,690\" --reference %s/4d/ct4d_synthbeat_A_label.nii.gz", data, data);
    add(imaging, IMAGING_SEGMENT, "tumour_cut", "brain tumour, a graph cut from two seeds",
        "%s/labels/brain1_image.nrrd --cut --seed -41,-24,26 --outside-seed -51,-34,39 --reference %s/labels/brain1_label.nrrd", data,
        data);
}

static void plan_collection_motion(struct imaging *imaging, const char *data)
{
    char beat[RUN_COMMAND], lung[RUN_COMMAND];
    snprintf(beat, sizeof beat, "%s/4d/ct4d_synthbeat_A.nii.gz --labels %s/4d/ct4d_synthbeat_A_label.nii.gz", data, data);
    snprintf(lung, sizeof lung, "%s/4d/lung_breath_baseline_mask.mha %s/4d/lung_breath_followup_mask.mha", data, data);
    add(imaging, IMAGING_REGISTER, "register_heart", "beating heart, frame 0 and the smallest",
        "%s/4d/ct4d_synthbeat_A.nii.gz %s/4d/ct4d_synthbeat_A.nii.gz --fixed-frame 0 --moving-frame 5 --fixed-labels "
        "%s/4d/ct4d_synthbeat_A_label.nii.gz --moving-labels %s/4d/ct4d_synthbeat_A_label.nii.gz --align none",
        data, data, data, data);
    add(imaging, IMAGING_REGISTER, "register_lung", "lung, breathed out and in",
        "%s --fixed-labels %s/4d/lung_breath_baseline_mask.mha --moving-labels %s/4d/lung_breath_followup_mask.mha "
        "--fixed-points %s/4d/lung_breath_baseline_landmarks_index.txt "
        "--moving-points %s/4d/lung_breath_followup_landmarks_index.txt",
        lung, data, data, data, data);
    add(imaging, IMAGING_TRACK, "track_heart", "beating heart, registered", "%s --landmarks %s/4d/ct4d_synthbeat_A_landmarks.csv",
        beat, data);
    add(imaging, IMAGING_TRACK, "track_true", "a made beat of the same heart, its true field sampled",
        "%s --beat 10 --true-field", beat);
    add(imaging, IMAGING_TRACK, "track_ventricle", "left ventricle in ultrasound",
        "%s/4d/echo4d_lv_11f.nii.gz --labels %s/ventricle/labels.nii.gz", data, imaging_folder);
    add(imaging, IMAGING_TRACK, "track_lung", "lung breathing in",
        "%s --labels %s/4d/lung_breath_baseline_mask.mha --second-labels %s/4d/lung_breath_followup_mask.mha", lung, data, data);
    add(imaging, IMAGING_LARGE_STEPS, "large_steps", "the made beat, half way", "%s --beat 10 --true-field", beat);
}

static void plan_collection_atlas(struct imaging *imaging, const char *data, const char *folder)
{
    char shapes[WORD], words[RUN_COMMAND];
    const char *out = imaging_folder;
    snprintf(shapes, sizeof shapes, "%s/shapes", folder);
    add(imaging, IMAGING_BUILD, "atlas_hip", "the left hip, mirrored, and its intensities",
        "mirror:%s/labels/seg_pelvis_TS_104.nii.gz:77 --images %s/ct/ct_pelvis_TS.nii.gz", data, data);
    snprintf(words, sizeof words, "--rounds 1 --images %s/shapes/hippocampus/images", data);
    add_build(imaging, "atlas_hippocampi", "24 hippocampi", shapes, "hippocampus/labels/*.nii.gz", "_011.", 24, words);
    add(imaging, IMAGING_BUILD, "atlas_vertebrae", "8 vertebral bodies",
        "%s/shapes/vertebral_bodies_8.mha:1 %s/shapes/vertebral_bodies_8.mha:2 %s/shapes/vertebral_bodies_8.mha:3 "
        "%s/shapes/vertebral_bodies_8.mha:4 %s/shapes/vertebral_bodies_8.mha:5 %s/shapes/vertebral_bodies_8.mha:6 "
        "%s/shapes/vertebral_bodies_8.mha:7 %s/shapes/vertebral_bodies_8.mha:8", data, data, data, data, data, data, data, data);
    add_build(imaging, "atlas_tori", "6 tori, 3 landmarks", shapes, "tori/*.stl", "\n", 6, "--vertex-landmarks 3");
    add_build(imaging, "atlas_faces", "9 faces, open, not aligned", shapes, "faces/*.stl", "\n", 9, "");
    snprintf(words, sizeof words, "%s/ct/ct_pelvis_TS.nii.gz --reference %s/labels/seg_pelvis_TS_104.nii.gz --label 78", data,
             data);
    add(imaging, IMAGING_SEGMENT, "without_atlas", "right hip without an atlas: a sphere around all bones",
        "%s --init sphere --level 100 --solid --radius 180 --levels 1 --speed 1", words);
    add(imaging, IMAGING_ATLAS, "atlas_segment_hip", "right hip by the atlas of the left one",
        "%s --atlas %s/atlas_hip/atlas.json --beside %s/without_atlas/report.json", words, out, out);
    add(imaging, IMAGING_ATLAS, "atlas_segment_hippocampus", "a hippocampus that the atlas has not seen",
        "%s/shapes/hippocampus/images/hippocampus_011.nii.gz --reference %s/shapes/hippocampus/labels/hippocampus_011.nii.gz "
        "--atlas %s/atlas_hippocampi/atlas.json", data, data, out);
}

static void plan_collection(struct imaging *imaging)
{
    char data[WORD];
    run_word(imaging->settings.collection, data, sizeof data);
    imaging->about = "The collection of images that SPRINGLS_DATA names: a CT of a pelvis with labels, a beating heart with "
                     "exact landmarks, an echocardiogram, a lung breathing, hippocampi, vertebral bodies, tori and faces.";
    plan_collection_segment(imaging, data);
    plan_collection_motion(imaging, data);
    plan_collection_atlas(imaging, data, imaging->settings.collection);
}

/* ---- the user's ---- */

static void plan_own(struct imaging *imaging)
{
    const struct imaging_settings *set = &imaging->settings;
    char file[WORD], other[WORD], words[RUN_COMMAND];
    imaging->about = "Your data.";
    if (set->image) {
        size_t used = (size_t)snprintf(words, sizeof words, "%s", run_word(set->image, file, sizeof file));
        if (set->level) {
            used += (size_t)snprintf(words + used, sizeof words - used, " --level %s", run_word(set->level, other, sizeof other));
        }
        if (set->labels) {
            used += (size_t)snprintf(words + used, sizeof words - used, " --reference %s",
                                     run_word(set->labels, other, sizeof other));
        }
        if (set->labels && set->label) {
            snprintf(words + used, sizeof words - used, " --label %s", run_word(set->label, other, sizeof other));
        }
        add_starts(imaging, words);
    }
    if (set->series) {
        run_word(set->series, file, sizeof file);
        run_word(set->series_labels, other, sizeof other);
        add(imaging, IMAGING_REGISTER, "register", "frames 0 and 1", "%s %s --fixed-frame 0 --moving-frame 1 --align none", file, file);
        snprintf(words, sizeof words, "%s --labels %s", file, other);
        add(imaging, IMAGING_TRACK, "track", "the sequence", set->landmarks ? "%s --landmarks %s" : "%s", words,
            set->landmarks ? run_word(set->landmarks, other, sizeof other) : "");
        add(imaging, IMAGING_LARGE_STEPS, "large_steps", "a made motion of the first frame", "%s --beat 10 --true-field", words);
    }
    if (set->subjects) {
        add(imaging, IMAGING_BUILD, "atlas", "your subjects", "%s", set->subjects);
    }
    if (set->subjects && set->image) {
        run_word(set->image, file, sizeof file);
        add(imaging, IMAGING_ATLAS, "atlas_segment", "your image by that atlas",
            set->labels ? "%s --atlas %s/atlas/atlas.json --reference %s%s%s" : "%s --atlas %s/atlas/atlas.json", file,
            imaging_folder, set->labels ? run_word(set->labels, other, sizeof other) : "", set->label ? " --label " : "",
            set->label ? set->label : "");
    }
}

void imaging_plan(struct imaging *imaging)
{
    const struct imaging_settings *set = &imaging->settings;
    if (set->image || set->series || set->subjects) {
        plan_own(imaging);
    } else if (set->collection && set->collection[0]) {
        plan_collection(imaging);
    } else {
        plan_head(imaging);
    }
}
