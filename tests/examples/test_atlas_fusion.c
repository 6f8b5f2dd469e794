/* Votes of registered subjects: patches, corrections, fusion into an unseen image, and leaving one out.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_fusion_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_fusion_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "atlas_fixtures.h"

enum { SIDE = 20, CUBES = SIDE * SIDE * SIDE };

static bool make_fusion_template(int count, struct fusion_template *template)
{
    const int dims[3] = {SIDE, SIDE, SIDE};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    memset(template, 0, sizeof *template);
    template->count = count;
    template->level = 0.5f;
    template->images = calloc((size_t)count * CUBES, sizeof(float));
    template->masks = calloc((size_t)count * CUBES, sizeof(float));
    return template->images && template->masks && volume_create(dims, spacing, origin, &template->image);
}

/* A ball in subject s: brighter than its surroundings by `contrast`. */
static void put_ball(struct fusion_template *template, int s, const float center[3], float radius, float contrast, uint64_t *state)
{
    for (int n = 0; n < CUBES; ++n) {
        int at[3];
        volume_place(template->image.dims, (size_t)n, at);
        const float x = (float)at[0] - center[0], y = (float)at[1] - center[1], z = (float)at[2] - center[2];
        const bool inside = x * x + y * y + z * z < radius * radius;
        template->masks[(size_t)s * CUBES + (size_t)n] = inside ? 1.0f : 0.0f;
        template->images[(size_t)s * CUBES + (size_t)n] = (inside ? contrast : 0.0f) + 0.2f * noise(state);
    }
}

static double dice_of(const float *probability, float level, const float *mask, double *ratio)
{
    double both = 0.0, found = 0.0, truth = 0.0;
    for (int n = 0; n < CUBES; ++n) {
        const bool in = probability[n] > level;
        both += in && mask[n] > 0.5f;
        found += in;
        truth += mask[n] > 0.5f;
    }
    *ratio = found / truth;
    return 2.0 * both / (found + truth);
}

/* Of two subjects that have the place, the one that looks like the image says which part it is. */
TEST labels_are_voted_on_one_by_one(void)
{
    const float center[3] = {10.0f, 10.0f, 10.0f};
    const bool all[3] = {true, true, true};
    struct fusion_template template;
    struct fusion_votes votes;
    uint64_t state = 5;
    ASSERT(make_fusion_template(3, &template));
    template.label_count = 2;
    template.labels = calloc(3 * CUBES, sizeof *template.labels);
    ASSERT(template.labels);
    for (int s = 0; s < 3; ++s) {
        put_ball(&template, s, center, 5.0f, s == 0 ? 1.0f : -1.0f, &state);
        for (int n = 0; n < CUBES; ++n) {
            template.labels[s * CUBES + n] = template.masks[s * CUBES + n] < 0.5f ? 0 : s == 0 ? 1 : 2;
        }
    }
    ASSERT(fusion_prepare(&template));
    ASSERT(fusion_vote(&template, template.images, all, true, &votes));
    int first = 0, inside = 0;
    for (int n = 0; n < CUBES; ++n) {
        ASSERT(votes.shares[n] + votes.shares[CUBES + n] < 1.001f);
        inside += template.masks[n] > 0.5f;
        first += template.masks[n] > 0.5f && votes.shares[n] > votes.shares[CUBES + n];
    }
    ASSERT(first > 0.9 * inside); /* though two of three say the other */
    fusion_votes_free(&votes);
    fusion_template_free(&template);
    PASS();
}

/* Two of three subjects have the ball elsewhere, as large: a plain vote would follow them. */
TEST votes_go_by_the_agreement_of_patches(void)
{
    const float here[3] = {8.0f, 10.0f, 10.0f}, there[3] = {12.0f, 10.0f, 10.0f};
    const bool all[3] = {true, true, true}, others[3] = {false, true, true};
    struct fusion_template template;
    struct fusion_votes votes;
    uint64_t state = 7;
    double ratio;
    ASSERT(make_fusion_template(3, &template));
    put_ball(&template, 0, here, 5.0f, 1.0f, &state);
    put_ball(&template, 1, there, 5.0f, 1.0f, &state);
    put_ball(&template, 2, there, 5.0f, 1.0f, &state);
    ASSERT(fusion_prepare(&template));
    static float target[CUBES];
    for (int n = 0; n < CUBES; ++n) target[n] = 700.0f * template.images[n] - 90.0f; /* another scanner's scale */
    ASSERT(fusion_vote(&template, target, all, false, &votes));
    const double plain = dice_of(votes.mean, 0.5f, template.masks, &ratio);
    ASSERT(plain < 0.75);
    ASSERT(dice_of(votes.voted, 0.5f, template.masks, &ratio) > 0.95);
    const float trust = fusion_trust(&template, &votes);
    fusion_votes_free(&votes);
    ASSERT(fusion_vote(&template, target, others, false, &votes)); /* the one that fits is left out */
    ASSERT(dice_of(votes.voted, 0.5f, template.masks, &ratio) < 0.75);
    ASSERT(fusion_trust(&template, &votes) < 0.5f * trust);
    fusion_votes_free(&votes);
    fusion_template_free(&template);
    PASS();
}

/* Balls of all sizes lie anywhere near the middle: votes are vague, but the image shows them. What was learned from ten holds for
 * two others, in size too. */
TEST corrections_learn_what_votes_get_wrong(void)
{
    enum { LEARNED = 10, COUNT = 12 };
    struct fusion_template template;
    uint64_t state = 3;
    bool include[COUNT];
    static float probability[CUBES];
    double voted = 0.0, corrected = 0.0, volume = 0.0;
    ASSERT(make_fusion_template(COUNT, &template));
    for (int s = 0; s < COUNT; ++s) {
        const float center[3] = {9.5f + 4.0f * noise(&state), 9.5f + 4.0f * noise(&state), 9.5f + 4.0f * noise(&state)};
        put_ball(&template, s, center, 5.0f + 3.0f * noise(&state), -1.0f, &state);
        include[s] = s < LEARNED;
    }
    ASSERT(fusion_prepare(&template));
    ASSERT(fusion_learn(&template, include));
    for (int s = LEARNED; s < COUNT; ++s) {
        const float *mask = template.masks + (size_t)s * CUBES;
        struct fusion_votes votes;
        double ratio;
        ASSERT(fusion_vote(&template, template.images + (size_t)s * CUBES, include, false, &votes));
        voted += dice_of(votes.voted, 0.5f, mask, &ratio) / (COUNT - LEARNED);
        ASSERT(fusion_correct(&template, &votes, probability));
        corrected += dice_of(probability, template.level, mask, &ratio) / (COUNT - LEARNED);
        volume += ratio / (COUNT - LEARNED);
        fusion_votes_free(&votes);
    }
    ASSERT(corrected > 0.93);
    ASSERT(1.0 - corrected < 0.6 * (1.0 - voted));
    ASSERT_IN_RANGE(1.0, volume, 0.06);
    struct atlas atlas, again; /* the correction survives the atlas's file */
    ASSERT(make_atlas(&atlas));
    atlas.subjects = COUNT;
    atlas.template_count = 1;
    template.vertices = atlas.mean.vertex_count;
    template.places = calloc(3 * (size_t)template.vertices, sizeof(float));
    ASSERT(template.places);
    atlas.templates[0] = template;
    ASSERT(atlas_write(folder, &atlas));
    ASSERT(atlas_read(numbered(0, "atlas.json", 0), &again));
    ASSERT(again.templates[0].corrected);
    ASSERT_EQ(0, memcmp(template.correction, again.templates[0].correction, (size_t)fusion_terms * sizeof(float)));
    ASSERT_EQ(0, memcmp(template.deviations, again.templates[0].deviations, (size_t)COUNT * CUBES * sizeof(float)));
    atlas_free(&again);
    atlas_free(&atlas); /* and the template */
    PASS();
}

/* A long ellipsoid of labels 1 and FAR_LABEL, which a float does not hold, whose contrast fades to a tenth at one end: there an edge search
 * finds nothing. A bright neighbour shows where it ends. Every scan has its own scale of intensities. */
enum { FAR_LABEL = 2000000011 };

static bool write_scan(int s, const float center[3], const float half[3])
{
    const int dims[3] = {30, 22, 20};
    const float spacing[3] = {2.0f, 2.0f, 2.0f}, origin[3] = {0.0f, 0.0f, 0.0f}, gain = 1.0f + 3.0f * (float)(s % 3);
    struct volume volume;
    char error[VOLUME_TEXT];
    uint64_t state = (uint64_t)s + 1;
    uint32_t mask[30 * 22 * 20];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    for (size_t n = 0; n < volume_voxels(&volume); ++n) {
        int at[3];
        float square = 0.0f, d[3];
        volume_place(dims, n, at);
        for (int a = 0; a < 3; ++a) d[a] = (2.0f * (float)at[a] - center[a]) / half[a], square += d[a] * d[a];
        const float r = sqrtf(square), shown = d[0] > 0.3f ? 0.1f : 1.0f;
        const float edge = fmaxf(0.0f, fminf(1.0f, 0.5f + (1.0f - r) * half[1] / 2.0f)); /* of two voxels */
        const float dx = d[0] - 1.5f, neighbor = dx * dx + d[1] * d[1] + d[2] * d[2] < 0.16f ? 60.0f : 0.0f;
        mask[n] = r > 1.0f ? 0 : d[0] < 0.0f ? 1 : FAR_LABEL;
        volume.data[n] = gain * (100.0f + 80.0f * shown * edge + neighbor + 6.0f * noise(&state));
    }
    const bool good = volume_write_labels(numbered(0, "labels/scan%02d.nii.gz", s), &volume, mask, error)
                   && volume_write(numbered(0, "images/scan%02d.nii.gz", s), &volume, VOLUME_FLOAT32, volume.data, error);
    volume_free(&volume);
    return good;
}

enum { SCANS = 6 };

static bool write_scans(int count)
{
    char command[600];
    snprintf(command, sizeof command, "mkdir -p '%s/images' '%s/labels'", folder, folder);
    bool good = system(command) == 0;
    for (int s = 0; good && s < count; ++s) {
        const float t = (float)s, center[3] = {27.0f + 2.0f * sinf(t), 21.0f + 1.5f * cosf(2.0f * t), 19.0f},
                    half[3] = {16.0f + 2.0f * cosf(t), 9.0f + sinf(3.0f * t), 8.0f + cosf(1.7f * t)};
        good = write_scan(s, center, half);
    }
    return good;
}

TEST subjects_fuse_into_an_unseen_image(void)
{
    struct atlas_build build = make_build();
    struct atlas_segment run;
    struct atlas again;
    ASSERT(write_scans(SCANS));
    for (int s = 0; s + 1 < SCANS; ++s) build.settings.names[s] = numbered(s, "labels/scan%02d.nii.gz", s);
    build.settings.count = SCANS - 1;
    build.settings.images = numbered(10, "images", 0);
    build.settings.rounds = 1;
    build.settings.templates = 1;
    build.settings.common.grid = 16; /* few springls are enough */
    ASSERT(atlas_build_run(&build));
    ASSERT_EQ(1, build.atlas.template_count);
    ASSERT(atlas_write(folder, &build.atlas));
    ASSERT(atlas_read(numbered(11, "atlas.json", 0), &again)); /* templates survive their file */
    const struct fusion_template *from = &build.atlas.templates[0], *to = &again.templates[0];
    ASSERT_EQ(1, again.template_count);
    ASSERT(volume_same_grid(&from->image, &to->image));
    ASSERT_EQ(from->self, to->self);
    ASSERT_IN_RANGE(from->level, to->level, 1e-6f);
    ASSERT_EQ(0, memcmp(from->masks, to->masks, (size_t)from->count * volume_voxels(&from->image) * sizeof(float)));
    ASSERT_EQ(2, to->label_count);
    ASSERT_EQ(1u, again.label_ids[0]);
    ASSERT_EQ((uint32_t)FAR_LABEL, again.label_ids[1]);
    ASSERT_EQ(0, memcmp(from->labels, to->labels, (size_t)from->count * volume_voxels(&from->image) * sizeof(int)));
    ASSERT_FALSE(to->corrected); /* so few subjects teach no correction */
    atlas_free(&again);
    memset(&run, 0, sizeof run);
    run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = (double)NAN, .gvf = 0.2,
                                                   .curvature = 0.05, .modes = 10, .steps = 100};
    run.settings.common.quiet = true;
    run.settings.atlas = names[11];
    run.settings.image = numbered(12, "images/scan%02d.nii.gz", SCANS - 1);
    run.settings.reference = numbered(13, "labels/scan%02d.nii.gz", SCANS - 1);
    run.params = springls_default_params();
    run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    ASSERT(atlas_segment_run(&run));
    ASSERT(run.fused);
    ASSERT_STR_EQ("fusion", run.results[2].name);
    const struct atlas_stage *last = &run.results[ATLAS_STAGES - 1];
    ASSERT(last->compared && last->dice > 0.97);
    ASSERT(last->dice > run.results[1].dice); /* than the registration */
    ASSERT_IN_RANGE(1.0, last->volume_ratio, 0.02); /* though only eight voxels across */
    ASSERT_EQ(build.atlas.mean.vertex_count, run.stages[run.begin].vertex_count); /* the springls start from the atlas's vertices */
    const struct shape_mesh *surface = &run.stages[ATLAS_STAGES - 1];
    const float middle = 27.0f + 2.0f * sinf(5.0f);
    int right = 0, counted = 0;
    for (int v = 0; v < surface->vertex_count; ++v) { /* regions have arrived */
        const float x = surface->positions[3 * v] - middle;
        counted += fabsf(x) > 3.0f;
        right += fabsf(x) > 3.0f && run.regions[v] == (x < 0.0f ? 1u : (uint32_t)FAR_LABEL);
    }
    ASSERT(counted > 100 && right > 0.97 * counted);
    const struct atlas_confidence *confidence = &run.confidence;
    ASSERT(confidence->known && confidence->doubt == ATLAS_TRUSTED && confidence->least > 0.3);
    ASSERT(confidence->agreement > 0.8 * confidence->least);
    ASSERT_IN_RANGE(last->dice, confidence->dice, 0.05); /* predicted without the reference */
    ASSERT_EQ(2, run.part_count);
    for (int l = 0; l < 2; ++l) {
        ASSERT_EQ(l == 0 ? 1u : (uint32_t)FAR_LABEL, run.parts[l].label);
        ASSERT(run.parts[l].dice > 0.88); /* nothing in the image shows where one part ends: half a voxel is 0.06 */
        ASSERT_IN_RANGE(run.parts[l].dice, confidence->label_dice[l], 0.08);
    }
    ASSERT_IN_RANGE(1e-3 * confidence->volume, run.parts[0].volume + run.parts[1].volume, 0.05 * 1e-3 * confidence->volume);
    for (size_t n = 0; n < volume_voxels(&run.reference); ++n) { /* a label that the reference has nowhere is missed */
        run.reference.ids[n] = run.reference.ids[n] == (uint32_t)FAR_LABEL ? 0 : run.reference.ids[n];
    }
    ASSERT(atlas_measure_parts(&run));
    ASSERT(run.parts[0].dice > 0.88 && run.parts[1].dice == 0.0);
    run.settings.label_text = "1"; /* of others the reference does not tell */
    ASSERT(atlas_measure_parts(&run));
    ASSERT(run.parts[0].dice > 0.88 && isnan(run.parts[1].dice));
    run.settings.label_text = NULL;
    ASSERT(atlas_segment_output(&run));
    run.confidence.doubt = ATLAS_DISAGREES;
    ASSERT_FALSE(atlas_segment_output(&run));
    for (int o = 0; o < 3; ++o) { /* options that votes have no use for */
        const struct atlas_segment_settings settings = run.settings;
        const springls_params params = run.params;
        atlas_segment_free(&run);
        memset(&run, 0, sizeof run);
        run.settings = settings;
        run.params = params;
        run.settings.dark = o == 0;
        run.settings.ramp = o == 1 ? 5.0 : 0.0;
        run.settings.of_profiles = o == 2 ? "--gvf" : NULL;
        ASSERT_FALSE(atlas_segment_run(&run));
        ASSERT_EQ(0, run.stages[0].vertex_count);
    }
    atlas_segment_free(&run);
    atlas_build_free(&build);
    PASS();
}

static int read_report(const char *path, double *dice)
{
    char line[256];
    int count = 0;
    FILE *file = fopen(path, "r");
    while (file && fgets(line, sizeof line, file) && count < 100) {
        const char *at = strstr(line, "\"dice\":");
        if (at && sscanf(at + 7, "%lf", &dice[count]) == 1) ++count;
    }
    if (file) fclose(file);
    return count;
}

/* An image from the other side of the body, one with the other contrast, and one of nothing agree with no subject: the first two are
 * named. A label map is no scan, and a trusted image may still show something of another size. */
TEST images_of_another_kind_are_not_trusted(void)
{
    static const enum atlas_doubt doubts[] = {ATLAS_MIRRORED, ATLAS_INVERTED, ATLAS_DISAGREES, ATLAS_TRUSTED};
    struct volume scan;
    struct atlas_segment run;
    char error[VOLUME_TEXT];
    for (int kind = 0; kind < 4; ++kind) {
        ASSERTm(error,
                volume_read(numbered(12, kind < 3 ? "images/scan%02d.nii.gz" : "labels/scan%02d.nii.gz", SCANS - 1), 0, &scan, error));
        const float most = scan.maximum;
        float *row = scan.data;
        for (size_t n = 0; n < volume_voxels(&scan); ++n) {
            const size_t i = n % (size_t)scan.dims[0], width = (size_t)scan.dims[0];
            row = i == 0 ? scan.data + n : row;
            if (kind == 0 && i < width / 2) {
                const float kept = row[i];
                row[i] = row[width - 1 - i];
                row[width - 1 - i] = kept;
            } else if (kind == 1 || kind == 2) {
                scan.data[n] = kind == 1 ? most - scan.data[n] : (float)(n * 2654435761u % 1000);
            }
        }
        ASSERTm(error, volume_write(numbered(14, "other%d.nii.gz", kind), &scan, VOLUME_FLOAT32, scan.data, error));
        volume_free(&scan);
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = (double)NAN, .gvf = 0.2,
                                                       .curvature = 0.05, .modes = 10, .steps = 2};
        run.settings.common.quiet = true;
        run.settings.atlas = numbered(11, "atlas.json", 0);
        run.settings.image = names[14];
        run.params = springls_default_params();
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        ASSERT_EQ(kind < 3, atlas_segment_run(&run));
        ASSERT_EQ(doubts[kind], run.confidence.doubt);
        ASSERT_EQ(kind == 3, atlas_is_trusted(&run));
        if (kind == 0) {
            run.confidence.doubt = ATLAS_TRUSTED;
            atlas_check_size(&run);
            ASSERT(run.confidence.volume > 0.0 && run.confidence.doubt == ATLAS_TRUSTED);
            for (int i = 0; i < 3 * run.atlas.mean.vertex_count; ++i) run.atlas.templates[0].places[i] *= 2.0f;
            atlas_check_size(&run);
            ASSERT_EQ(ATLAS_SIZE, run.confidence.doubt);
            ASSERT_FALSE(atlas_is_trusted(&run));
        }
        atlas_segment_free(&run);
    }
    PASS();
}

/* Puts an image of some kind into one of noise that is three times as long, wide and high. */
static bool write_within_noise(const char *from, bool of_labels, const char *to)
{
    struct volume part, whole;
    char error[VOLUME_TEXT];
    uint64_t state = 9;
    int dims[3];
    if (!volume_read(from, 0, &part, error)) return false;
    for (int a = 0; a < 3; ++a) dims[a] = 3 * part.dims[a];
    const float origin[3] = {-300.0f, 40.0f, 7.0f};
    bool good = volume_create(dims, part.spacing, origin, &whole);
    for (size_t n = 0; good && n < volume_voxels(&whole); ++n) {
        int at[3];
        bool in = true;
        volume_place(dims, n, at);
        for (int a = 0; a < 3; ++a) at[a] -= part.dims[a], in = in && at[a] >= 0 && at[a] < part.dims[a];
        const float around = of_labels ? 0.0f : part.minimum + (part.maximum - part.minimum) * (0.5f + 0.5f * noise(&state));
        whole.data[n] =
            in ? part.data[(size_t)at[0] + (size_t)part.dims[0] * ((size_t)at[1] + (size_t)part.dims[1] * (size_t)at[2])] : around;
    }
    good = good && volume_write(to, &whole, VOLUME_FLOAT32, whole.data, error);
    volume_free(&whole);
    volume_free(&part);
    return good;
}

/* Like a whole head: the object is found in it, or it is refused before the work. */
TEST much_larger_images_are_searched_first(void)
{
    struct atlas_segment run;
    for (int kind = 0; kind < 3; ++kind) {
        const bool there = kind == 0, noise_alone = kind == 1;
        ASSERT(write_within_noise(numbered(12, "images/scan%02d.nii.gz", SCANS - 1), false, numbered(14, "whole.nii.gz", 0)));
        ASSERT(write_within_noise(numbered(12, "labels/scan%02d.nii.gz", SCANS - 1), true, numbered(13, "whole_labels.nii.gz", 0)));
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = (double)NAN, .gvf = 0.2,
                                                       .curvature = 0.05, .modes = 10, .steps = 20};
        run.settings.common.quiet = true;
        run.settings.atlas = numbered(11, "atlas.json", 0);
        run.settings.image = names[14];
        run.settings.reference = there ? names[13] : NULL;
        run.params = springls_default_params();
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        if (!there) { /* nothing but noise, or the inverse */
            struct volume whole;
            char error[VOLUME_TEXT];
            uint64_t state = 4;
            ASSERT(volume_read(names[14], 0, &whole, error));
            for (size_t n = 0; n < volume_voxels(&whole); ++n) whole.data[n] = noise_alone ? noise(&state) : -whole.data[n];
            ASSERT(volume_write(names[14], &whole, VOLUME_FLOAT32, whole.data, error));
            volume_free(&whole);
        }
        ASSERT_EQ(there, atlas_segment_run(&run));
        ASSERT_EQ(there, run.part.data != NULL);
        if (there) {
            ASSERT_EQ(ATLAS_TRUSTED, run.confidence.doubt);
            ASSERT(run.results[ATLAS_STAGES - 1].dice > 0.96);
            ASSERT(volume_voxels(&run.part) < volume_voxels(&run.image) / 4);
        } else {
            ASSERT_EQ(0, run.stages[0].vertex_count);
        }
        atlas_segment_free(&run);
    }
    PASS();
}

TEST leaving_one_out_makes_a_table(void)
{
    struct atlas_trial_settings set = {.common = cli_common_defaults(), .folder = folder, .templates = 2, .first = 1, .every = 3};
    const springls_params params = springls_default_params();
    double dice[100];
    set.common.quiet = true;
    set.common.grid = 16;
    set.common.json = numbered(14, "trial.json", 0);
    ASSERT(write_scans(SCANS));
    ASSERT(atlas_leave_one_out(&set, &params));
    ASSERT_EQ(2 * 3, read_report(names[14], dice)); /* registration, fusion, springls */
    for (int s = 0; s < 2; ++s) ASSERT(dice[3 * s + 2] > 0.95);
    set.folder = numbered(15, "nowhere", 0);
    ASSERT_FALSE(atlas_leave_one_out(&set, &params));
    PASS();
}

int main(int argc, char **argv)
{
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(votes_go_by_the_agreement_of_patches);
    RUN_TEST(labels_are_voted_on_one_by_one);
    RUN_TEST(corrections_learn_what_votes_get_wrong);
    RUN_TEST(subjects_fuse_into_an_unseen_image);
    RUN_TEST(images_of_another_kind_are_not_trusted);
    RUN_TEST(much_larger_images_are_searched_first);
    RUN_TEST(leaving_one_out_makes_a_table);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
