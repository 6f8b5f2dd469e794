/* Corresponding places on meshes: ellipsoids made here, and tori (SPRINGLS_DATA).
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "atlas_fixtures.h"
#include "bench/vtk_image.h"

enum { SUBJECTS = 5 };

/* Ellipsoids of one varying axis, posed anyhow in turn and size. Their vertices correspond: what is made of them without
 * that knowledge is near it, lies on the subjects, and has one mode. */
TEST springls_find_the_correspondence_of_ellipsoids(void)
{
    static float points[3 * BALL];
    static uint32_t triangles[3 * BALL_TRIANGLES];
    struct atlas_build build = make_build();
    make_ball_triangles(triangles);
    for (int s = 0; s < SUBJECTS; ++s) {
        char error[MESH_TEXT];
        const float half[3] = {24.0f + 2.0f * (float)(s - 2), 17.0f, 11.0f};
        const struct similarity pose = some_pose(0.1 * s);
        const struct mesh_arrays ply = {
            .positions = points, .vertex_count = BALL, .indices = triangles, .triangle_count = BALL_TRIANGLES};
        make_ellipsoid(half, points);
        for (int v = 0; v < BALL; ++v) points[3 * v + 2] += 0.02f * points[3 * v] * points[3 * v]; /* bent: no symmetry about x */
        for (int v = 0; v < BALL; ++v) points[3 * v] *= 1.0f + 0.012f * points[3 * v];              /* nor about y */
        similarity_apply_all(&pose, points, BALL, points);
        build.settings.names[s] = numbered(s, "subject%d.ply", s);
        ASSERT(mesh_write_ply(build.settings.names[s], &ply, error));
    }
    build.settings.count = SUBJECTS;
    build.settings.orientation = "known"; /* they turn by less than half a radian */
    ASSERT(atlas_build_run(&build));
    ASSERT(build.truth.known);
    ASSERT(build.truth.mean < 0.5 * build.atlas.voxel);
    ASSERT(build.truth.mean < build.truth.rigid_mean);
    for (int s = 0; s < SUBJECTS; ++s) ASSERT(build.subjects[s].mean_distance < 0.1 * build.atlas.voxel);
    ASSERT(build.curves.compactness[0] > 0.9);
    ASSERT_EQ(SUBJECTS - 1, build.curves.modes);
    atlas_build_free(&build);
    PASS();
}

/* Landmarks of the tori: places of the first one as far from each other as can be. */
static bool write_landmarks(const struct mesh *tori, int count, int landmarks)
{
    int chosen[16];
    if (points_spread(tori[0].positions, (int)tori[0].vertex_count, landmarks, chosen) != landmarks) return false;
    for (int s = 0; s < count; ++s) {
        FILE *file = fopen(numbered(15, "torus_%d.csv", s), "w");
        for (int l = 0; file && l < landmarks; ++l) {
            const float *x = tori[s].positions + 3 * chosen[l];
            fprintf(file, "%.4f,%.4f,%.4f\n", (double)x[0], (double)x[1], (double)x[2]);
        }
        if (!file || fclose(file) != 0) return false;
    }
    return true;
}

/* Six deformed tori. Three landmarks determine how each is turned, which the shape of a torus of revolution does not. */
TEST tori_correspond_within_three_fifths_of_a_voxel(void)
{
    enum { COUNT = 6 };
    const char *data = getenv("SPRINGLS_DATA");
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    struct mesh tori[COUNT];
    struct atlas_build build = make_build();
    for (int s = 0; s < COUNT; ++s) {
        char error[MESH_TEXT];
        snprintf(names[s], sizeof names[s], "%s/shapes/tori/torus_%d.stl", data, s);
        ASSERT(mesh_read(names[s], &tori[s], error));
        build.settings.names[s] = names[s];
    }
    ASSERT(write_landmarks(tori, COUNT, 3));
    for (int s = 0; s < COUNT; ++s) mesh_free(&tori[s]);
    build.settings.count = COUNT;
    build.settings.landmarks = folder;
    ASSERT(atlas_build_run(&build));
    ASSERT(build.truth.known);
    ASSERT(build.truth.mean < 0.6 * build.atlas.voxel);
    ASSERT(build.truth.mean < 0.3 * build.truth.rigid_mean);
    for (int s = 0; s < COUNT; ++s) ASSERT(build.subjects[s].mean_distance < 0.05 * build.atlas.voxel);
    atlas_build_free(&build);
    PASS();
}

TEST tori_images_are_read(void)
{
    const char *data = getenv("SPRINGLS_DATA");
    struct volume image;
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    snprintf(names[0], sizeof names[0], "%s/shapes/tori/torus_0.vtk.gz", data);
    ASSERT(vtk_image_read(names[0], &image));
    ASSERT_EQ(100, image.dims[2]);
    ASSERT_IN_RANGE(1.4494f, image.spacing[0], 1e-4f);
    ASSERT_EQ(0.0f, image.minimum);
    ASSERT_EQ(1000.0f, image.maximum);
    volume_free(&image);
    snprintf(names[0], sizeof names[0], "%s/shapes/tori/torus_0.stl", data);
    ASSERT_FALSE(vtk_image_read(names[0], &image));
    PASS();
}

int main(int argc, char **argv)
{
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(springls_find_the_correspondence_of_ellipsoids);
    RUN_TEST(tori_correspond_within_three_fifths_of_a_voxel);
    RUN_TEST(tori_images_are_read);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
