/* track4d.c - follows a body through a sequence of images with springls (paper, section 5.7).
 *
 *   track4d beat.nii.gz --labels heart.nii.gz --landmarks landmarks.csv --out result
 *   track4d beat.nii.gz --labels heart.nii.gz --fields 'to_%d.nii.gz' --out result     # displacement fields of elastix or ITK
 *   track4d beat.nii.gz --labels heart.nii.gz --beat 10 --true-field                   # a synthetic motion, exactly known
 *   track4d beat.nii.gz --labels heart.nii.gz --beat 10 --true-field --large-steps     # in 1, 2, 5 and 20 steps
 *   track4d breath_out.mha breath_in.mha --labels lung_out.mha                         # two files, each on a grid of its own
 *
 * The label of one frame becomes a model, with every triangle of its surface a springl. The other frames are registered to
 * that one; each displacement field moves the springls in a single step of Algorithm 3. Nothing is resampled, so springl i is
 * the same piece of the body in every frame. */
#include "springls/run_options.h"
#include "track4d/track.h"

#include <stdio.h>
#include <string.h>

/* Turns relaxation off: section 5.7 moves springls, rebuilds phi from them and lets it evolve. Where no springl is added or
 * removed there is nothing to relax, and a relaxed triangle would not be the same piece of surface any more. */
#define TRACKING_PARAMETERS "relax_iterations=0,contouring=0"

static int check_usage(const struct track_settings *set)
{
    const char *wrong = NULL;
    const char *mark = set->fields ? strstr(set->fields, "%d") : NULL;
    if (set->fields && (!mark || strchr(mark + 1, '%') || strchr(set->fields, '%') != mark)) {
        wrong = "--fields wants a name with one %d for the frame and no other %";
    } else if (set->beat == 1) {
        wrong = "--beat wants two frames at least";
    }
    return wrong ? cli_fail("track4d", CLI_EXIT_USAGE, "%s", wrong) : CLI_CONTINUE;
}

static int read_command_line(struct track *track, int argc, char **argv)
{
    struct track_settings *set = &track->settings;
    const char *similarity = "ssd";
    const struct cli_option options[] = {
        {"labels", CLI_STRING, &set->labels, "FILE", "label map of the reference frame, or of all frames", 0, 0, NULL},
        {"second-labels", CLI_STRING, &set->second_labels, "FILE", "label map of the second of two files, to compare", 0, 0,
         NULL},
        {"label", CLI_INT, &set->label, "K", "the label to follow; -1: all but 0", -1, 1e9, NULL},
        {"reference", CLI_INT, &set->reference, "K", "the frame that the model is made in, from 0", 0, 1e9, NULL},
        {"fields", CLI_STRING, &set->fields, "NAME",
         "displacement fields from the reference to frame %d, instead of registering", 0, 0,
         NULL},
        {"steps", CLI_INT, &set->steps, "K", "in which each frame's motion is applied", 1, 1000, NULL},
        {"similarity", CLI_CHOICE, &similarity, NULL, "squared differences, or local correlation", 0, 0, "ssd|lcc"},
        {"landmarks", CLI_STRING, &set->landmarks, "FILE", "CSV with landmark, frame, x_mm, y_mm, z_mm (RAS+), to compare", 0,
         0, NULL},
        {"beat", CLI_INT, &set->beat, "K", "follow a made motion of the first image, of K frames", 0, TRACK_MAX_FRAMES, NULL},
        {"true-field", CLI_FLAG, &set->true_field, NULL, "of the made motion: sample its field instead of registering", 0, 0,
         NULL},
        {"large-steps", CLI_FLAG, &set->large_steps, NULL,
         "one frame's motion in 1, 2, 5 and 20 steps, level sets alone beside it", 0, 0,
         NULL},
        {"frame", CLI_INT, &set->frame, "K", "the frame of --large-steps; -1: half way", -1, 1e9, NULL},
        {"set", CLI_STRING, &set->overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    static const struct cli_rule rules[] = {
        {.given = "second-labels", .needs = "SECOND"},
        {.given = "true-field", .needs = "beat"},
        {.given = "frame", .needs = "large-steps"},
        /* A field that is given is taken as it is, in one step. */
        {.given = "similarity+fields"},
        {.given = "steps+fields"},
        {.given = "large-steps+fields"},
        {.given = "similarity+true-field"},
        /* The made motion is of one image, the first. */
        {.given = "reference+beat"},
        {.given = "landmarks+beat"},
        {.given = "fields+beat"},
        /* Two files lie apart: the motion from one to the other begins with a rigid one, which is not cut into parts. */
        {.given = "SECOND", .only = "IMAGE|labels|second-labels|label|similarity|set|grid|params|backend|threads|json|out|quiet"},
        /* --large-steps compares numbers of steps, for one frame and without landmarks. */
        {.given = "steps+large-steps"},
        {.given = "landmarks+large-steps"},
    };
    static const struct cli_writes writes[] = {
        {.files = "tracked_[0-9]*.ply|surface_[0-9]*.ply|slices_[0-9]*.png|mode_[0-9]*.ply|modes.png|volume.png|film.png|report.json",
         .without = "large-steps"},
        {.files = "landmarks.png", .with = "landmarks", .without = "large-steps"},
        {.files = "particles.png", .with = "beat", .without = "large-steps"},
        {.files = "large_steps.png|large_steps.json", .with = "large-steps"},
    };
    const struct cli_positional images[] = {{"IMAGE", &set->image, "sequence of images, or the first of two", true},
                                            {"SECOND", &set->second, "the second of two images", false}};
    const struct cli_program program = {.name = "track4d",
                                        .summary = "follows a body through a sequence of images",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = images,
                                        .positional_count = 2,
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    track->registration.similarity = strcmp(similarity, "lcc") == 0 ? REGISTER_LCC : REGISTER_SSD;
    if (!set->labels) {
        return cli_fail("track4d", CLI_EXIT_USAGE, "--labels FILE is missing: what is to be followed?");
    }
    return check_usage(set);
}

int main(int argc, char **argv)
{
    struct track track = {.settings = {.label = -1, .steps = 1, .frame = -1}};
    char set[1024];
    track.settings.common = cli_common_defaults();
    track.registration = register_defaults();
    int status = read_command_line(&track, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (!track.settings.second) { /* in a sequence the patient lies still, and equal tissues have equal intensities */
        track.registration.align = REGISTER_ALIGN_NONE;
        track.registration.one_scale = true;
    }
    snprintf(set, sizeof set, TRACKING_PARAMETERS "%s%s", track.settings.overrides ? "," : "",
             track.settings.overrides ? track.settings.overrides : "");
    status = run_options("track4d", &track.settings.common, set, &track.params);
    if (status != CLI_CONTINUE) {
        return status;
    }
    bool done = track_read(&track) && (track.settings.large_steps ? track_large_steps(&track) : track_run(&track));
    if (done) {
        track_print(&track);
    }
    done = done && (!track.settings.common.out || track_write(&track))
           && (!track.settings.common.json || track_report(&track, track.settings.common.json));
    track_free(&track);
    return done ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
