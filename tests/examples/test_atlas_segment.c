/* From label maps to an atlas, from that to a segmented image, and on to a larger atlas.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_segment_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_segment_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "atlas_fixtures.h"

#include <sys/stat.h>
#include <unistd.h>

/* An atlas of three ellipsoids of two labels, written to the folder: before it has learned from their images, or after. */
static enum greatest_test_res write_ellipsoid_atlas(bool learned)
{
    static struct atlas_build build; /* made by the first call, freed by the last */
    if (!learned) {
        build = make_build();
        for (int s = 0; s < 3; ++s) {
            const float center[3] = {6.0f + (float)s, 28.0f - (float)s, 26.0f},
                        half[3] = {13.0f + (float)s, 9.0f, 8.0f - 0.5f * (float)s};
            ASSERT(write_subject(numbered(s, "labels%d.nii.gz", s), numbered(3 + s, "image%d.nii.gz", s), center, half));
            build.settings.names[s] = names[s];
        }
        build.settings.count = 3;
        ASSERT(atlas_build_run(&build));
        ASSERT(build.atlas.oriented);
        build.settings.common.out = folder;
        ASSERT(atlas_build_output(&build));
    } else { /* as from --images: here the names differ */
        for (int s = 0; s < 3; ++s) {
            char error[VOLUME_TEXT];
            ASSERT(volume_read(numbered(3 + s, "image%d.nii.gz", s), 0, &build.subjects[s].image, error));
        }
        ASSERT(atlas_learn(&build));
    }
    ASSERT(atlas_write(folder, &build.atlas));
    if (learned) atlas_build_free(&build);
    PASS();
}

/* The atlas has not seen the image's ellipsoid: it stands elsewhere and is larger. */
TEST atlas_finds_an_ellipsoid(bool learned)
{
    CHECK_CALL(write_ellipsoid_atlas(learned));
    struct atlas_segment run;
    const float center[3] = {11.0f, 24.0f, 28.0f}, half[3] = {16.0f, 10.5f, 8.5f};
    memset(&run, 0, sizeof run);
    run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(),
                                                   .level = learned ? (double)NAN : 150.0,
                                                   .gvf = 0.2,
                                                   .curvature = 0.05,
                                                   .modes = 10,
                                                   .steps = 100};
    run.settings.common.quiet = true;
    run.settings.image = numbered(6, "unseen.nii.gz", 0);
    run.settings.reference = numbered(7, "truth.nii.gz", 0);
    run.settings.atlas = numbered(8, "atlas.json", 0);
    run.params = springls_default_params();
    run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    ASSERT(write_subject(run.settings.reference, run.settings.image, center, half));
    ASSERT(atlas_segment_run(&run));
    ASSERT_EQ(learned, run.view.learned);
    const struct atlas_stage *last = &run.results[ATLAS_STAGES - 1];
    ASSERT(last->compared && last->dice > 0.95 && last->mean_distance < 0.5);
    ASSERT(last->dice > run.results[0].dice);
    const struct shape_mesh *surface = &run.stages[ATLAS_STAGES - 1];
    int right = 0, counted = 0;
    for (int v = 0; v < surface->vertex_count; ++v) { /* regions have arrived: by the side of the middle */
        const float x = surface->positions[3 * v] - center[0];
        counted += fabsf(x) > 2.0f;
        right += fabsf(x) > 2.0f && run.regions[v] == (x < 0.0f ? 1 : 2);
    }
    ASSERT(counted > 100 && right > 0.98 * counted);
    for (int v = right = counted = 0; v < run.atlas.mean.vertex_count; ++v) { /* and the atlas's vertices on it, too */
        const float *x = run.vertices + 3 * v;
        float square = 0.0f;
        for (int a = 0; a < 3; ++a) square += (x[a] - center[a]) * (x[a] - center[a]) / (half[a] * half[a]);
        ASSERT_IN_RANGE(1.0f, sqrtf(square), 0.15f);
        counted += fabsf(x[0] - center[0]) > 2.0f;
        right += fabsf(x[0] - center[0]) > 2.0f && run.atlas.regions[v] == (x[0] < center[0] ? 1 : 2);
    }
    ASSERT(counted > 100 && right > 0.98 * counted);
    run.settings.common.out = folder;
    ASSERT(atlas_segment_output(&run));
    atlas_segment_free(&run);
    PASS();
}

static int lines_of(const char *path)
{
    FILE *file = fopen(path, "r");
    int lines = 0;
    for (int c = 0; file && (c = fgetc(file)) != EOF;) lines += c == '\n';
    if (file) fclose(file);
    return lines;
}

/* What atlas build and atlas segment have written makes an atlas of one subject more, which keeps what was learned. */
TEST a_segmented_subject_is_added(void)
{
    static char larger[300];
    struct atlas old, new;
    struct atlas_build build = make_build();
    ASSERT(atlas_read(numbered(0, "atlas.json", 0), &old));
    const int vertices = old.mean.vertex_count, triangles = old.mean.triangle_count;
    ASSERT_EQ(1 + vertices, lines_of(numbered(1, "subjects/002_labels2.csv", 0)));
    ASSERT_EQ(1 + triangles, lines_of(numbered(1, "particles/002_labels2.csv", 0)));
    ASSERT_EQ(0, access(numbered(1, "particles/002_labels2.ply", 0), R_OK));
    ASSERT_EQ(1 + vertices, lines_of(numbered(1, "correspondence.csv", 0)));
    ASSERT_EQ(2, lines_of(numbered(1, "weights.csv", 0))); /* atlas segment wrote last */
    snprintf(larger, sizeof larger, "%s/larger", folder);
    ASSERT(mkdir(larger, 0777) == 0);
    build.settings.same_vertices = true;
    build.settings.extends = names[0];
    build.settings.names[0] = numbered(2, "correspondence.ply", 0);
    build.settings.count = 1;
    build.settings.common.out = larger;
    ASSERT(atlas_add_run(&build));
    ASSERT(atlas_build_output(&build));
    ASSERT_EQ(4, build.settings.count);
    ASSERT_EQ(5, lines_of(numbered(1, "larger/weights.csv", 0)));
    ASSERT(atlas_read(numbered(1, "larger/atlas.json", 0), &new));
    ASSERT(new.subjects == 4 && new.model.modes == 3 && new.oriented);
    ASSERT_EQ(0, memcmp(old.regions, new.regions, (size_t)vertices * sizeof *old.regions));
    ASSERT(new.samples == old.samples
           && memcmp(old.profiles, new.profiles, (size_t)(vertices * old.samples) * sizeof *old.profiles) == 0);
    atlas_free(&new);
    atlas_free(&old);
    atlas_build_free(&build);
    build = make_build(); /* an atlas without its subjects, and meshes of other triangles */
    build.settings.same_vertices = true;
    build.settings.extends = numbered(1, "nothing/atlas.json", 0);
    ASSERT_FALSE(atlas_add_run(&build));
    atlas_build_free(&build);
    build = make_build();
    build.settings.same_vertices = true;
    build.settings.names[0] = numbered(1, "mean.ply", 0);
    build.settings.names[1] = numbered(2, "surface.ply", 0);
    build.settings.count = 2;
    ASSERT_FALSE(atlas_build_run(&build));
    atlas_build_free(&build);
    PASS();
}

/* An image whose voxels have a wrong size, so that it cannot show the atlas's object, or that is constant, is refused before anything is
 * fitted, with one error; an image of two millimetres is warned of too. */
TEST atlas_segment_refuses_images_without_the_object(void)
{
    static const struct { double factors[3]; const char *warning, *reason; } cases[] = {
        {{0.02, 0.02, 0.02}, "are its numbers metres?", "too small for the atlas's object of"},
        {{20.0, 20.0, 20.0}, NULL, "too coarse for the atlas's object of"},
        {{1.0, 1.0, 60.0}, NULL, "too coarse for the atlas's object of"},
        {{1.0, 1.0, 1.0}, NULL, "the image is constant"}};
    char error[VOLUME_TEXT];
    struct volume image;
    ASSERT(volume_read(numbered(6, "unseen.nii.gz", 0), 0, &image, error));
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        struct atlas_segment run;
        const float none[3] = {0.0f, 0.0f, 0.0f};
        float spacing[3];
        struct volume resized;
        for (int a = 0; a < 3; ++a) spacing[a] = (float)((double)image.spacing[a] * cases[c].factors[a]);
        ASSERT(volume_create(image.dims, spacing, none, &resized));
        const float *values = c < 3 ? image.data : resized.data; /* the last one is all zero */
        ASSERT(volume_write(numbered(9, "resized.nii.gz", 0), &resized, VOLUME_FLOAT32, values, error));
        volume_free(&resized);
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = 150.0, .steps = 2, .frame = -1};
        run.settings.common.quiet = true;
        run.settings.image = numbered(9, "resized.nii.gz", 0);
        run.settings.atlas = numbered(8, "atlas.json", 0);
        run.params = springls_default_params();
        fflush(stderr);
        const int kept = dup(STDERR_FILENO);
        ASSERT(kept >= 0 && freopen(numbered(10, "stderr.txt", 0), "w", stderr) != NULL);
        const bool good = atlas_segment_run(&run);
        fflush(stderr);
        dup2(kept, STDERR_FILENO);
        close(kept);
        FILE *file = fopen(numbered(10, "stderr.txt", 0), "r");
        char line[512] = "", more[8];
        ASSERT(file && fgets(line, sizeof line, file));
        if (cases[c].warning) ASSERTm(line, strstr(line, cases[c].warning) && fgets(line, sizeof line, file));
        ASSERT_FALSE(fgets(more, sizeof more, file));
        fclose(file);
        ASSERT_FALSE(good);
        ASSERTm(line, strstr(line, cases[c].reason) != NULL);
        ASSERT(run.image.data && run.atlas.mean.vertex_count > 0);
        ASSERT(run.stages[0].vertex_count == 0);
        atlas_segment_free(&run);
    }
    volume_free(&image);
    PASS();
}

/* What does not fit the image is refused before anything is fitted, and frames without --frame, and --series of a file. */
TEST atlas_segment_compares_only_what_fits(void)
{
    static const char *const references[] = {"small.nii.gz", "elsewhere.nii.gz", "truth.nii.gz", "truth.nii.gz"};
    const float none[3] = {0.0f, 0.0f, 0.0f}, ones[3] = {1.0f, 1.0f, 1.0f};
    const int dims[3] = {20, 20, 20};
    char error[VOLUME_TEXT];
    struct volume image, small;
    ASSERT(volume_read(numbered(6, "unseen.nii.gz", 0), 0, &image, error));
    ASSERT(volume_create(dims, ones, none, &small));
    for (int n = 0; n < 8000; ++n) small.data[n] = 1.0f;
    ASSERT(volume_write(numbered(9, "small.nii.gz", 0), &small, VOLUME_FLOAT32, small.data, error));
    volume_free(&small);
    ASSERT(volume_create(image.dims, image.spacing, none, &small)); /* the same voxels, but not there */
    for (size_t n = 0; n < volume_voxels(&small); ++n) small.data[n] = n % 2 > 0 ? 1.0f : 0.0f;
    ASSERT(volume_write(numbered(9, "elsewhere.nii.gz", 0), &small, VOLUME_FLOAT32, small.data, error));
    volume_free(&small);
    ASSERT(write_series(numbered(9, "series.nii", 0), &image));
    volume_free(&image);
    for (int c = 0; c < 7; ++c) {
        struct atlas_segment run;
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = 150.0, .steps = 2,
                                                       .frame = c >= 5 ? 1 : -1, .series = c == 6 ? "1" : NULL};
        run.settings.common.quiet = true;
        run.settings.image = numbered(6, c < 4 ? "unseen.nii.gz" : "series.nii", 0);
        run.settings.reference = c < 4 ? numbered(7, references[c], 0) : NULL;
        run.settings.label_text = c == 2 ? "7" : c == 3 ? "1+2" : NULL;
        run.settings.atlas = numbered(8, "atlas.json", 0);
        run.params = springls_default_params();
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        ASSERT_EQ(c == 3 || c == 5, atlas_segment_run(&run)); /* the third has no label 7 */
        ASSERT_EQ(c == 3 || c == 5, run.ctx != NULL);
        atlas_segment_free(&run);
    }
    PASS();
}

int main(int argc, char **argv)
{
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TESTp(atlas_finds_an_ellipsoid, false); /* by the level of its image */
    RUN_TESTp(atlas_finds_an_ellipsoid, true);  /* by what it has learned; needs the atlas of the first */
    RUN_TEST(a_segmented_subject_is_added);
    RUN_TEST(atlas_segment_refuses_images_without_the_object);
    RUN_TEST(atlas_segment_compares_only_what_fits);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
