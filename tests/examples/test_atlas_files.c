/* What examples/atlas reads and writes: atlas files, subjects and their landmarks, reports, repeated arguments.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_files_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_files_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "atlas_fixtures.h"

#include <unistd.h>

TEST a_run_without_atlas_is_read_from_its_report(void)
{
    const char *path = numbered(0, "without.json", 0);
    struct atlas_stage without;
    ASSERT(write_text(path, "{\"program\": \"segment\", \"seconds\": 3.5, \"against_reference\": {\"dice\": 0.75, "
                            "\"mean_distance_mm\": 2, \"hd95_mm\": 8}}"));
    ASSERT(atlas_read_without(path, &without));
    ASSERT_EQ(3.5, without.seconds);
    ASSERT(without.compared);
    ASSERT_EQ(0.75, without.dice);
    ASSERT_EQ(2.0, without.mean_distance);
    ASSERT_EQ(8.0, without.hd95);
    ASSERT(write_text(path, "{\"program\": \"segment\", \"seconds\": 3.5}")); /* no reference */
    ASSERT(atlas_read_without(path, &without));
    ASSERT_FALSE(without.compared);
    ASSERT(write_text(path, "{\"program\": \"register\", \"seconds\": 3.5}"));
    ASSERT_FALSE(atlas_read_without(path, &without));
    ASSERT(write_text(path, "{\"program\": \"segment\", \"objects\": []}"));
    ASSERT_FALSE(atlas_read_without(path, &without));
    ASSERT(write_text(path, "{"));
    ASSERT_FALSE(atlas_read_without(path, &without));
    PASS();
}

TEST atlases_survive_their_files(void)
{
    struct atlas atlas, again;
    ASSERT(make_atlas(&atlas));
    ASSERT(atlas_write(folder, &atlas));
    ASSERT(atlas_read(numbered(0, "atlas.json", 0), &again));
    ASSERT_EQ(BALL, again.mean.vertex_count);
    ASSERT_EQ(BALL_TRIANGLES, again.mean.triangle_count);
    ASSERT_EQ(2, again.model.modes);
    ASSERT_EQ(7, again.subjects);
    ASSERT(again.oriented);
    ASSERT_IN_RANGE(0.25, again.voxel, 1e-9);
    ASSERT_IN_RANGE(0.125, again.generalization, 1e-9);
    ASSERT_IN_RANGE(2.5, again.model.deviation[0], 1e-9);
    ASSERT_EQ(0, memcmp(atlas.mean.positions, again.mean.positions, 3 * BALL * sizeof(float)));
    ASSERT_EQ(0, memcmp(atlas.mean.triangles, again.mean.triangles, 3 * BALL_TRIANGLES * sizeof(int)));
    ASSERT_EQ(0, memcmp(atlas.model.mode, again.model.mode, 6 * BALL * sizeof(float)));
    ASSERT_EQ(0, memcmp(atlas.regions, again.regions, BALL * sizeof(int)));
    atlas_free(&again);
    atlas_free(&atlas);
    PASS();
}

static bool write_bytes(const char *path, const char *bytes, size_t count)
{
    FILE *file = fopen(path, "wb");
    const bool good = file && fwrite(bytes, 1, count, file) == count;
    return file && fclose(file) == 0 && good;
}

/* Each copy of a good pair with one thing broken is refused, and leaves nothing behind. */
TEST broken_atlas_files_are_refused(void)
{
    static const char *const broken[][2] = {
        {"\"springls atlas\"", "\"something else\""},
        {"\"version\": 2", "\"version\": 1"},
        {"\"vertices\": 266", "\"vertices\": 267"},
        {"\"vertices\": 266", "\"vertices\": -26"},
        {"\"modes\": 2", "\"modes\": 3"},
        {"\"triangles\": 528", "\"triangles\": 1e9"},
        {"[2.5, 0.5]", "[2.5, 0.0]"},
        {"[2.5, 0.5]", "[2.5,\"a\"]"},
        {"\"atlas.raw\"", "\"../atlas.r\""},
        {"\"voxel_mm\"", "\"voxel_xx\""},
        {"\"count\": 798", "\"count\": 99999999999"},
        {"\"int32\"", "\"float32\""},
        {"\"regions\"", "\"modes\""},
        {"\"arrays\"", "\"array\""},
        {"{", "["},
    };
    struct atlas atlas;
    char text[8192], changed[8192];
    ASSERT(make_atlas(&atlas));
    ASSERT(atlas_write(folder, &atlas));
    FILE *file = fopen(numbered(0, "atlas.json", 0), "rb");
    ASSERT(file);
    const size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = '\0';
    struct atlas again;
    for (size_t b = 0; b < sizeof broken / sizeof *broken; ++b) {
        char *at = strstr(text, broken[b][0]);
        ASSERTm(broken[b][0], at != NULL);
        snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, broken[b][1], at + strlen(broken[b][0]));
        ASSERT(write_bytes(numbered(1, "broken.json", 0), changed, strlen(changed)));
        ASSERT_FALSEm(broken[b][1], atlas_read(names[1], &again));
        ASSERT_EQ(NULL, again.mean.positions);
    }
    ASSERT_FALSE(atlas_read(numbered(1, "missing.json", 0), &again));
    ASSERT(truncate(numbered(1, "atlas.raw", 0), 1000) == 0);
    ASSERT_FALSE(atlas_read(names[0], &again));
    atlas.mean.positions[5] = NAN;
    ASSERT(atlas_write(folder, &atlas));
    ASSERT_FALSE(atlas_read(names[0], &again));
    atlas.mean.positions[5] = 0.0f;
    atlas.mean.triangles[7] = BALL;
    ASSERT(atlas_write(folder, &atlas));
    ASSERT_FALSE(atlas_read(names[0], &again));
    atlas_free(&atlas);
    PASS();
}

TEST bad_subjects_are_refused(void)
{
    struct atlas_subject subject;
    ASSERT_FALSE(atlas_subject_read("/nowhere/mask.nii.gz", NULL, NULL, false, &subject));
    atlas_subject_free(&subject);
    ASSERT_FALSE(atlas_subject_read("mask.nii.gz:1+x", NULL, NULL, false, &subject));
    atlas_subject_free(&subject);
    ASSERT_FALSE(atlas_subject_read("shape.ply:3", NULL, NULL, false, &subject));
    atlas_subject_free(&subject);
    PASS();
}

/* A scan of 32 bits, nearly all of whose values differ, in place of a label map; as floats they were few. */
TEST scans_of_32_bits_are_no_labels(void)
{
    enum { SIDE = 64, VOXELS = SIDE * SIDE * SIDE };
    const int dims[3] = {SIDE, SIDE, SIDE};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    const char *path = numbered(0, "scan32.nii", 0);
    static uint32_t values[VOXELS];
    char error[VOLUME_TEXT];
    struct volume like;
    struct atlas_subject subject;
    for (int spread = 0; spread < 2; ++spread) { /* over all 32 bits, or over few floats */
        for (uint32_t n = 0; n < VOXELS; ++n) values[n] = spread == 0 ? n * 2654435761u : 4000000000u + n % 4096;
        ASSERT(volume_create(dims, spacing, origin, &like));
        ASSERTm(error, volume_write_labels(path, &like, values, error));
        volume_free(&like);
        ASSERTm(error, volume_read_companion(path, -1, &like, error));
        ASSERT_FALSE(volume_check_labels(&like, path, error));
        ASSERT(strstr(error, "looks like a scan"));
        volume_free(&like);
        ASSERT_FALSE(atlas_subject_read(path, NULL, NULL, false, &subject));
        atlas_subject_free(&subject);
    }
    PASS();
}

/* An image of another place, several in one file, and one that is constant. */
TEST images_have_to_show_their_subjects(void)
{
    const float none[3] = {0.0f, 0.0f, 0.0f}, center[3] = {6.0f, 28.0f, 26.0f}, half[3] = {13.0f, 9.0f, 8.0f};
    char error[VOLUME_TEXT];
    struct volume image, elsewhere;
    struct atlas_subject subject;
    ASSERT(write_subject(numbered(0, "labels%d.nii.gz", 0), numbered(3, "image%d.nii.gz", 0), center, half));
    ASSERT(volume_read(names[3], 0, &image, error));
    ASSERT(volume_create(image.dims, image.spacing, none, &elsewhere));
    ASSERT(volume_write(numbered(4, "far.nii.gz", 0), &elsewhere, VOLUME_FLOAT32, image.data, error));
    ASSERT(write_series(numbered(5, "many.nii", 0), &image));
    memset(image.data, 0, volume_voxels(&image) * sizeof *image.data);
    ASSERT(volume_write(numbered(7, "constant.nii.gz", 0), &image, VOLUME_FLOAT32, image.data, error));
    volume_free(&image);
    volume_free(&elsewhere);
    const char *const labels = numbered(0, "labels%d.nii.gz", 0);
    static const char *const images[] = {"image0.nii.gz", "far.nii.gz", "many.nii", "constant.nii.gz"};
    for (int i = 0; i < 4; ++i) {
        ASSERT_EQ(i == 0, atlas_subject_read(labels, numbered(3, images[i], 0), NULL, false, &subject));
        atlas_subject_free(&subject);
    }
    ASSERT_FALSE(atlas_subject_read(numbered(5, "many.nii", 0), NULL, NULL, false, &subject));
    atlas_subject_free(&subject);
    PASS();
}

TEST mirrored_subjects_lie_on_the_other_side(void)
{
    const float center[3] = {3.0f, 28.0f, 26.0f}, half[3] = {9.0f, 9.0f, 8.0f}, middle = -20.0f + 0.5f * 55.0f;
    struct atlas_subject plain, mirrored;
    ASSERT(write_subject(numbered(0, "labels%d.nii.gz", 0), NULL, center, half));
    ASSERT(atlas_subject_read(names[0], NULL, NULL, false, &plain));
    ASSERT(atlas_subject_read(names[0], NULL, NULL, true, &mirrored));
    ASSERT_IN_RANGE(3.0, plain.target.center[0], 0.1);
    ASSERT_IN_RANGE(2.0 * (double)middle - 3.0, mirrored.target.center[0], 0.1);
    ASSERT_EQ(1, atlas_label_at(&plain, (const float[3]){center[0] - 4.0f, center[1], center[2]}));
    ASSERT_EQ(1, atlas_label_at(&mirrored, (const float[3]){2.0f * middle - center[0] + 4.0f, center[1], center[2]}));
    struct target_hit hit; /* outward is outward still */
    const struct similarity identity = similarity_identity();
    target_nearest(&mirrored.target, &identity, (const float[3]){2.0f * middle - center[0], center[1], center[2]}, &hit);
    ASSERT(hit.signed_distance < -5.0f);
    atlas_subject_free(&plain);
    atlas_subject_free(&mirrored);
    char named[600]; /* one subject alone */
    snprintf(named, sizeof named, "mirror:%s:1+2", names[0]);
    ASSERT(atlas_subject_read(named, NULL, NULL, false, &mirrored));
    ASSERT_IN_RANGE(2.0 * (double)middle - 3.0, mirrored.target.center[0], 0.1);
    atlas_subject_free(&mirrored);
    ASSERT(atlas_subject_read(named, NULL, NULL, true, &mirrored)); /* twice mirrored */
    ASSERT_IN_RANGE(3.0, mirrored.target.center[0], 0.1);
    atlas_subject_free(&mirrored);
    PASS();
}

/* A bar with an arm to one side and upwards, of slightly another size in each subject; without an arm it is symmetric but for one voxel. */
static bool write_armed(int s, bool left, bool arm, const char *path)
{
    const int dims[3] = {26, 26, 26};
    const float spacing[3] = {1.0f, 1.0f, 1.0f}, origin[3] = {0.0f, 0.0f, 0.0f};
    struct volume volume;
    char error[VOLUME_TEXT];
    static uint8_t mask[26 * 26 * 26];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    for (size_t n = 0; n < sizeof mask; ++n) {
        int at[3];
        volume_place(dims, n, at);
        const int x = left ? 24 - at[0] : at[0];
        const bool bar = abs(x - 12) <= 3 && abs(at[1] - 12) <= 9 - s % 2 && abs(at[2] - 12) <= 3;
        const bool knob = x == 16 && at[1] == 9 + s % 5 && at[2] == 10 + s % 3;
        mask[n] = bar || (arm ? x >= 12 && x <= 20 - s % 3 && at[1] >= 16 && at[1] <= 20 && abs(at[2] - 13) <= 2 : knob);
    }
    const bool good = volume_write(path, &volume, VOLUME_UINT8, mask, error);
    volume_free(&volume);
    return good;
}

/* Sends stderr to a file from here on; returns what it was. */
static int catch_errors(const char *path)
{
    const int before = dup(STDERR_FILENO);
    fflush(stderr);
    return freopen(path, "w", stderr) ? before : -1;
}

/* Ends that, and returns true if `text` has been printed since. */
static bool was_printed(const char *path, int before, const char *text)
{
    char all[2000] = "";
    fflush(stderr);
    dup2(before, STDERR_FILENO);
    close(before);
    FILE *file = fopen(path, "r");
    if (!file) return false;
    all[fread(all, 1, sizeof all - 1, file)] = '\0';
    fclose(file);
    return strstr(all, text) != NULL;
}

/* Of subjects of both sides the fewer are named, one or as many as the others; a mirrored one mirrored once more is one of them.
 * Symmetric subjects have no side. */
TEST subjects_of_both_sides_are_refused(void)
{
    static const struct way {
        int lefts;
        bool arm, again, any, agree;
    } ways[] = {{0, true, false, false, true},  {1, true, false, false, false}, {1, true, true, false, true},
                {1, true, false, true, true},   {2, true, false, false, false}, {3, true, false, false, false},
                {4, true, false, false, false}, {6, true, false, false, true},  {3, false, false, false, true}};
    char mirrored[600];
    for (size_t w = 0; w < sizeof ways / sizeof *ways; ++w) {
        const struct way *way = &ways[w];
        struct atlas_build build = make_build();
        for (int s = 0; s < 6; ++s) {
            ASSERT(write_armed(s, s % 2 == 0 ? s / 2 < way->lefts : 3 + s / 2 < way->lefts, way->arm, numbered(s, "armed%d.nii.gz", s)));
            build.settings.names[s] = names[s];
        }
        snprintf(mirrored, sizeof mirrored, "mirror:%s", names[0]);
        build.settings.names[0] = way->again ? mirrored : names[0];
        build.settings.any_side = way->any;
        build.settings.count = 6;
        ASSERT(atlas_subjects_read(&build));
        ASSERT_EQ(way->agree, atlas_sides_agree(&build));
        atlas_build_free(&build);
    }
    struct atlas_build build = make_build(); /* 15 of 30 are more than the line has room for */
    for (int s = 0; s < 30; ++s) {
        if (s < 2) ASSERT(write_armed(s, s == 1, true, numbered(s, "armed%d.nii.gz", s)));
        build.settings.names[s] = names[s % 2];
    }
    build.settings.count = 30;
    ASSERT(atlas_subjects_read(&build));
    const int before = catch_errors(numbered(2, "errors", 0));
    ASSERT_FALSE(atlas_sides_agree(&build));
    ASSERT(was_printed(names[2], before, " more (mirror:FILE"));
    atlas_build_free(&build);
    PASS();
}

/* leave-one-out refuses them with profiles and without, before the work. */
TEST both_sides_are_refused_by_leave_one_out(void)
{
    char command[600], file[40];
    struct atlas_trial_settings set = {.common = cli_common_defaults(), .templates = 1, .every = 1};
    const springls_params params = springls_default_params();
    snprintf(command, sizeof command, "mkdir -p '%s/sides/images' '%s/sides/labels'", folder, folder);
    ASSERT_EQ(0, system(command));
    for (int s = 0; s < 6; ++s) {
        snprintf(file, sizeof file, "sides/labels/subject%d.nii.gz", s);
        ASSERT(write_armed(s, s % 2 == 0, true, numbered(0, file, 0)));
        snprintf(file, sizeof file, "sides/images/subject%d.nii.gz", s);
        ASSERT(write_armed(s, s % 2 == 0, true, numbered(0, file, 0)));
    }
    set.common.quiet = true;
    set.folder = numbered(1, "sides", 0);
    for (int profiles = 0; profiles < 2; ++profiles) {
        set.profiles = profiles == 1;
        const int before = catch_errors(numbered(2, "errors", 0));
        ASSERT_FALSE(atlas_leave_one_out(&set, &params));
        ASSERT(was_printed(names[2], before, "than the others: "));
    }
    PASS();
}

TEST landmarks_are_mirrored_with_their_subject(void)
{
    const float center[3] = {3.0f, 28.0f, 26.0f}, half[3] = {9.0f, 9.0f, 8.0f}, middle = -20.0f + 0.5f * 55.0f;
    struct atlas_subject plain, mirrored;
    ASSERT(write_subject(numbered(0, "labels%d.nii.gz", 0), NULL, center, half));
    ASSERT(write_text(numbered(1, "labels%d.csv", 0), "12,28,26\n3,37,26\n3,28,34\n")); /* on the surface */
    ASSERT(atlas_subject_read(names[0], NULL, folder, false, &plain));
    ASSERT(atlas_subject_read(names[0], NULL, folder, true, &mirrored));
    ASSERT_EQ(3, mirrored.landmark_count);
    for (int l = 0; l < 3; ++l) {
        ASSERT_IN_RANGE(2.0f * middle - plain.landmarks[3 * l], mirrored.landmarks[3 * l], 1e-4f);
        ASSERT_EQ(plain.landmarks[3 * l + 1], mirrored.landmarks[3 * l + 1]);
        ASSERT_EQ(plain.landmarks[3 * l + 2], mirrored.landmarks[3 * l + 2]);
        struct target_hit hit; /* they lie on their surface still */
        const struct similarity identity = similarity_identity();
        target_nearest(&mirrored.target, &identity, mirrored.landmarks + 3 * l, &hit);
        ASSERT_IN_RANGE(0.0f, hit.signed_distance, 1.0f);
    }
    atlas_subject_free(&plain);
    atlas_subject_free(&mirrored);
    PASS();
}

TEST repeated_arguments_are_collected(void)
{
    const char *list[3];
    int count = 0;
    const struct cli_positional rest = {"ITEM...", list, NULL, true};
    const struct cli_program program = {
        .name = "test", .positionals = &rest, .positional_count = 1, .repeated = &count, .max_repeated = 3};
    char *three[] = {"test", "a", "b", "c"}, *four[] = {"test", "a", "b", "c", "d"}, *none[] = {"test"};
    ASSERT_EQ(CLI_CONTINUE, cli_parse(&program, 4, three));
    ASSERT_EQ(3, count);
    ASSERT_STR_EQ("c", list[2]);
    count = 0;
    ASSERT_EQ(CLI_EXIT_USAGE, cli_parse(&program, 5, four));
    count = 0;
    ASSERT_EQ(CLI_EXIT_USAGE, cli_parse(&program, 1, none));
    PASS();
}

int main(int argc, char **argv)
{
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(a_run_without_atlas_is_read_from_its_report);
    RUN_TEST(atlases_survive_their_files);
    RUN_TEST(broken_atlas_files_are_refused);
    RUN_TEST(bad_subjects_are_refused);
    RUN_TEST(scans_of_32_bits_are_no_labels);
    RUN_TEST(images_have_to_show_their_subjects);
    RUN_TEST(mirrored_subjects_lie_on_the_other_side);
    RUN_TEST(subjects_of_both_sides_are_refused);
    RUN_TEST(both_sides_are_refused_by_leave_one_out);
    RUN_TEST(landmarks_are_mirrored_with_their_subject);
    RUN_TEST(repeated_arguments_are_collected);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
