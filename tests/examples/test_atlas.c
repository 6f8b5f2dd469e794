/* What examples/atlas.c shares in examples/common: similarity transforms, Procrustes alignment, principal modes, surfaces
 * laid on surfaces, atlas files, and the whole way from subjects to an atlas to a segmented image. Compiled like
 * test_common.c, else skipped. */
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

#include "../../examples/atlas/atlas.h"
#include "../../examples/common/surface/mesh_io.h"
#include "bench/vtk_image.h"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[256]; /* scratch, made by main */
static char names[16][512];

static const char *scratch(int slot, const char *format, int number)
{
    char name[128];
    snprintf(name, sizeof name, format, number);
    snprintf(names[slot], sizeof names[slot], "%s/%s", folder, name);
    return names[slot];
}

/* ---- shapes ---- */

enum { AROUND = 24, ACROSS = 11, BALL = AROUND * ACROSS + 2, BALL_TRIANGLES = 2 * AROUND * ACROSS };

/* A sphere's points, stretched: vertex v is the same place on each. */
static void make_ellipsoid(const float half[3], float *points)
{
    const float pi = 3.14159265f;
    for (int r = 0; r < ACROSS; ++r) {
        for (int c = 0; c < AROUND; ++c) {
            const float t = pi * (float)(r + 1) / (ACROSS + 1), u = 2.0f * pi * (float)c / AROUND;
            float *x = points + 3 * (r * AROUND + c);
            x[0] = half[0] * sinf(t) * cosf(u), x[1] = half[1] * sinf(t) * sinf(u), x[2] = half[2] * cosf(t);
        }
    }
    for (int pole = 0; pole < 2; ++pole) {
        float *x = points + 3 * (AROUND * ACROSS + pole);
        x[0] = x[1] = 0.0f, x[2] = pole ? -half[2] : half[2];
    }
}

static void make_ball_triangles(uint32_t *triangles)
{
    const uint32_t north = AROUND * ACROSS, south = north + 1, last = AROUND * (ACROSS - 1);
    uint32_t *t = triangles;
    for (uint32_t c = 0; c < AROUND; ++c) {
        const uint32_t d = (c + 1) % AROUND;
        *t++ = north, *t++ = c, *t++ = d;
        *t++ = south, *t++ = last + d, *t++ = last + c;
        for (uint32_t r = 0; r + 1 < ACROSS; ++r) {
            const uint32_t a = r * AROUND, b = a + AROUND;
            *t++ = a + c, *t++ = b + c, *t++ = b + d;
            *t++ = a + c, *t++ = b + d, *t++ = a + d;
        }
    }
}

static struct similarity some_pose(double angle)
{
    struct similarity s = similarity_identity();
    s.scale = 1.0 + 0.1 * angle;
    s.rotation[0][0] = cos(angle), s.rotation[0][1] = -sin(angle);
    s.rotation[1][0] = sin(angle), s.rotation[1][1] = cos(angle);
    s.translation[0] = 3.0 * angle, s.translation[2] = -5.0;
    return s;
}

TEST similarity_of_moved_points_is_found(void)
{
    float from[3 * BALL], to[3 * BALL], back[3 * BALL];
    const float half[3] = {5.0f, 4.0f, 3.0f};
    const struct similarity pose = some_pose(0.7);
    struct similarity found;
    make_ellipsoid(half, from);
    similarity_apply_all(&pose, from, BALL, to);
    ASSERT(similarity_fit(from, to, NULL, BALL, true, &found));
    ASSERT_IN_RANGE(pose.scale, found.scale, 1e-6);
    ASSERT_IN_RANGE(0.0, similarity_angle(&pose, &found), 1e-3);
    const struct similarity inverse = similarity_inverse(&found), nothing = similarity_after(&found, &inverse);
    similarity_apply_all(&nothing, from, BALL, back);
    ASSERT_IN_RANGE(0.0, shapes_distance(from, back, BALL), 1e-5);
    for (int v = 0; v < BALL; ++v) to[3 * v] = -to[3 * v]; /* a mirror image is no rotation */
    ASSERT(similarity_fit(from, to, NULL, BALL, false, &found));
    ASSERT_IN_RANGE(
        1.0,
        found.rotation[0][0] * (found.rotation[1][1] * found.rotation[2][2] - found.rotation[1][2] * found.rotation[2][1]) -
            found.rotation[0][1] * (found.rotation[1][0] * found.rotation[2][2] - found.rotation[1][2] * found.rotation[2][0]) +
            found.rotation[0][2] * (found.rotation[1][0] * found.rotation[2][1] - found.rotation[1][1] * found.rotation[2][0]),
        1e-6);
    PASS();
}

TEST alignment_takes_pose_and_size_away(void)
{
    enum { COUNT = 4 };
    static float points[COUNT][3 * BALL], mean[3 * BALL];
    float *shapes[COUNT];
    const float half[3] = {5.0f, 4.0f, 3.0f};
    for (int s = 0; s < COUNT; ++s) {
        const struct similarity pose = some_pose(0.5 * s);
        make_ellipsoid(half, points[s]);
        similarity_apply_all(&pose, points[s], BALL, points[s]);
        shapes[s] = points[s];
    }
    ASSERT(shapes_align(shapes, COUNT, BALL, true, mean));
    for (int s = 0; s < COUNT; ++s) ASSERT_IN_RANGE(0.0, shapes_distance(points[s], mean, BALL), 1e-4);
    PASS();
}

/* Ellipsoids whose axes vary independently: two modes, the larger first, along the directions that were put in. */
TEST modes_that_were_put_in_come_out(void)
{
    enum { COUNT = 9 };
    static float points[COUNT][3 * BALL], unit[3 * BALL];
    float *shapes[COUNT];
    const float one[3] = {1.0f, 1.0f, 1.0f};
    double length[3] = {0.0, 0.0, 0.0}, weights[2];
    make_ellipsoid(one, unit);
    for (int i = 0; i < 3 * BALL; ++i) length[i % 3] += (double)(unit[i] * unit[i]);
    for (int s = 0; s < COUNT; ++s) { /* a grid of 3 x 3: -1, 0, 1 times 2 along x, times 1 along z */
        const float half[3] = {10.0f + 2.0f * (float)(s % 3 - 1), 8.0f, 6.0f + 1.0f * (float)(s / 3 - 1)};
        make_ellipsoid(half, points[s]);
        shapes[s] = points[s];
    }
    struct shape_model model;
    ASSERT(shape_model_build(shapes, COUNT, BALL, 10, &model));
    ASSERT_EQ(2, model.modes);
    ASSERT_IN_RANGE(2.0 * sqrt(6.0 / 8.0) * sqrt(length[0]), model.deviation[0], 1e-4);
    ASSERT_IN_RANGE(1.0 * sqrt(6.0 / 8.0) * sqrt(length[2]), model.deviation[1], 1e-4);
    for (int m = 0; m < 2; ++m) {
        double along = 0.0;
        for (int v = 0; v < BALL; ++v)
            along += (double)(model.mode[3 * BALL * m + 3 * v + 2 * m] * unit[3 * v + 2 * m]) / sqrt(length[2 * m]);
        ASSERT_IN_RANGE(1.0, fabs(along), 1e-5);
    }
    shape_model_weights(&model, points[8], 2, weights);
    ASSERT_IN_RANGE(sqrt(8.0 / 6.0), fabs(weights[0]), 1e-4);
    shape_model_shape(&model, weights, 2, unit);
    ASSERT_IN_RANGE(0.0, shapes_distance(unit, points[8], BALL), 1e-4);
    shape_model_free(&model);
    struct shape_curves curves;
    ASSERT(shape_curves_make(shapes, COUNT, BALL, 50, &curves));
    ASSERT_EQ(2, curves.modes);
    ASSERT_IN_RANGE(1.0, curves.compactness[1], 1e-9);
    ASSERT_IN_RANGE(0.0, curves.generalization[1], 1e-3); /* the others span the same two modes */
    ASSERT(curves.generalization[0] > 0.1);
    ASSERT(curves.specificity[0] > 0.0 && curves.specificity[0] < 2.0);
    shape_curves_free(&curves);
    PASS();
}

TEST targets_know_sides_and_rims(void)
{
    static float points[3 * BALL];
    static uint32_t triangles[3 * BALL_TRIANGLES];
    const float half[3] = {10.0f, 10.0f, 10.0f};
    const struct similarity identity = similarity_identity();
    struct target target;
    struct target_hit hit;
    make_ellipsoid(half, points);
    make_ball_triangles(triangles);
    ASSERT(target_create(points, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES, &target));
    ASSERT_FALSE(target.open);
    ASSERT_IN_RANGE(10.0, target.radius, 0.3);
    target_nearest(&target, &identity, (const float[3]){13.0f, 0.5f, 1.0f}, &hit);
    ASSERT_IN_RANGE(3.0f, hit.signed_distance, 0.3f);
    ASSERT(hit.normal[0] > 0.9f && !hit.on_rim);
    target_nearest(&target, &identity, (const float[3]){0.5f, -7.0f, 1.0f}, &hit);
    ASSERT_IN_RANGE(-3.0f, hit.signed_distance, 0.3f);
    struct similarity pose = identity;
    pose.scale = 2.0; /* the point is at 14, twice as far: 4 away there, 2 here */
    target_nearest(&target, &pose, (const float[3]){7.0f, 0.2f, 0.4f}, &hit);
    ASSERT_IN_RANGE(2.0f, hit.signed_distance, 0.2f);
    target_free(&target);
    ASSERT(target_create(points, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES / 2, &target));
    ASSERT(target.open); /* half of the meridians' triangles are gone */
    target_nearest(&target, &identity, (const float[3]){0.0f, -20.0f, 0.0f}, &hit);
    ASSERT(hit.on_rim);
    target_free(&target);
    PASS();
}

/* Lays the points of an ellipsoid on a target and returns the noise that was learned, NaN if that failed. */
static double noise_learned_on(const float *points, const float *normals, const float *on, const uint32_t *triangles)
{
    enum { CENTERS = 100, STEPS = 12 };
    const struct similarity identity = similarity_identity();
    float at[3 * CENTERS], facing[3 * CENTERS], now[3 * CENTERS];
    int chosen[CENTERS];
    struct target target;
    struct warp warp;
    bool fine = points_spread(points, BALL, CENTERS, chosen) == CENTERS
             && target_create(on, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES, &target);
    for (int i = 0; fine && i < CENTERS; ++i) {
        memcpy(at + 3 * i, points + 3 * chosen[i], 3 * sizeof *at);
        memcpy(facing + 3 * i, normals + 3 * chosen[i], 3 * sizeof *facing);
    }
    memcpy(now, at, sizeof now);
    fine = fine && warp_create(at, CENTERS, NULL, 0, target.radius, &warp_prior_exact, &warp);
    if (!fine) return (double)NAN;
    for (int step = 0; fine && step < STEPS; ++step) {
        fine = warp_fit(&warp, &target, &identity, now, facing, NULL);
        for (int i = 0; i < CENTERS; ++i) warp_apply(&warp, at + 3 * i, now + 3 * i, NULL);
    }
    const double noise = fine ? warp.prior.noise : (double)NAN;
    warp_free(&warp);
    target_free(&target);
    return noise;
}

/* What a smooth displacement explains leaves a small noise, and what it does not a large one. */
TEST noise_is_learned_from_the_target(void)
{
    static float points[3 * BALL], normals[3 * BALL], smooth[3 * BALL], rough[3 * BALL];
    static uint32_t triangles[3 * BALL_TRIANGLES];
    make_ellipsoid((const float[3]){24.0f, 17.0f, 11.0f}, points);
    make_ball_triangles(triangles);
    mesh_normals(points, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES, normals);
    for (int v = 0; v < BALL; ++v) {
        const float away = v % 2 ? 1.0f : -1.0f;
        for (int k = 0; k < 3; ++k) {
            smooth[3 * v + k] = points[3 * v + k] * (k == 0 ? 1.1f : 1.0f);
            rough[3 * v + k] = smooth[3 * v + k] + away * normals[3 * v + k];
        }
    }
    ASSERT(noise_learned_on(points, normals, smooth, triangles) < 0.5 * warp_prior_exact.noise);
    ASSERT(noise_learned_on(points, normals, rough, triangles) > warp_prior_exact.noise);
    PASS();
}

/* ---- from meshes to an atlas ---- */

enum { SUBJECTS = 5 };

static struct atlas_build make_build(void)
{
    struct atlas_build build;
    memset(&build, 0, sizeof build);
    build.settings.common = cli_common_defaults();
    build.settings.common.quiet = true;
    build.settings.orientation = "auto";
    build.settings.rounds = 2;
    build.settings.modes = ATLAS_MAX_MODES;
    build.settings.samples = 20;
    build.params = springls_default_params();
    return build;
}

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
        build.settings.names[s] = scratch(s, "subject%d.ply", s);
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

/* ---- files ---- */

static bool make_atlas(struct atlas *atlas)
{
    static float points[3 * BALL];
    static uint32_t triangles[3 * BALL_TRIANGLES];
    const float half[3] = {3.0f, 2.0f, 1.0f};
    memset(atlas, 0, sizeof *atlas);
    make_ellipsoid(half, points);
    make_ball_triangles(triangles);
    if (!atlas_mesh_copy(points, BALL, (const int *)(const void *)triangles, BALL_TRIANGLES, &atlas->mean)) return false;
    atlas->model.vertices = BALL;
    atlas->model.mean = atlas->mean.positions;
    atlas->model.modes = 2;
    atlas->model.mode = malloc(2 * sizeof points);
    atlas->model.deviation = malloc(2 * sizeof(double));
    atlas->regions = malloc(BALL * sizeof(int));
    if (!atlas->model.mode || !atlas->model.deviation || !atlas->regions) return false;
    for (int i = 0; i < 6 * BALL; ++i) atlas->model.mode[i] = 0.001f * (float)i;
    for (int v = 0; v < BALL; ++v) atlas->regions[v] = v % 3;
    atlas->model.deviation[0] = 2.5, atlas->model.deviation[1] = 0.5;
    atlas->oriented = true;
    atlas->voxel = 0.25;
    atlas->generalization = 0.125;
    atlas->subjects = 7;
    return true;
}

static bool write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    const bool good = file && fputs(text, file) >= 0;
    return file && fclose(file) == 0 && good;
}

TEST a_run_without_atlas_is_read_from_its_report(void)
{
    const char *path = scratch(0, "without.json", 0);
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
    ASSERT(atlas_read(scratch(0, "atlas.json", 0), &again));
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
        {"{", "["},
    };
    struct atlas atlas;
    char text[8192], changed[8192];
    ASSERT(make_atlas(&atlas));
    ASSERT(atlas_write(folder, &atlas));
    FILE *file = fopen(scratch(0, "atlas.json", 0), "rb");
    ASSERT(file);
    const size_t length = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[length] = '\0';
    struct atlas again;
    for (size_t b = 0; b < sizeof broken / sizeof *broken; ++b) {
        char *at = strstr(text, broken[b][0]);
        ASSERTm(broken[b][0], at != NULL);
        snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - text), text, broken[b][1], at + strlen(broken[b][0]));
        ASSERT(write_bytes(scratch(1, "broken.json", 0), changed, strlen(changed)));
        ASSERT_FALSEm(broken[b][1], atlas_read(names[1], &again));
        ASSERT_EQ(NULL, again.mean.positions);
    }
    ASSERT_FALSE(atlas_read(scratch(1, "missing.json", 0), &again));
    ASSERT(truncate(scratch(1, "atlas.raw", 0), 1000) == 0);
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

/* ---- from label maps to an atlas to an image ---- */

/* An ellipsoid about `center`: labels 1 and 2 for x below and above it, intensities 200 within and 100 without, with a
 * pattern of 20 over all. */
static bool write_subject(const char *labels, const char *image, const float center[3], const float half[3])
{
    const int dims[3] = {56, 48, 40};
    const float spacing[3] = {1.0f, 1.0f, 1.2f}, origin[3] = {-20.0f, 5.0f, 3.0f};
    struct volume volume;
    char error[VOLUME_TEXT];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    const size_t voxels = volume_voxels(&volume);
    uint8_t *mask = malloc(voxels);
    size_t n = 0;
    for (int k = 0; mask && k < dims[2]; ++k)
        for (int j = 0; j < dims[1]; ++j)
            for (int i = 0; i < dims[0]; ++i, ++n) {
                const float index[3] = {(float)i, (float)j, (float)k};
                float x[3], square = 0.0f;
                volume_index_to_world(&volume, index, x);
                for (int a = 0; a < 3; ++a) square += (x[a] - center[a]) * (x[a] - center[a]) / (half[a] * half[a]);
                mask[n] = (uint8_t)(square > 1.0f ? 0 : x[0] < center[0] ? 1 : 2);
                volume.data[n] = (square > 1.0f ? 100.0f : 200.0f) + 20.0f * sinf(0.9f * x[0]) * sinf(0.8f * x[1]);
            }
    const bool good = mask && volume_write(labels, &volume, VOLUME_UINT8, mask, error)
                   && (!image || volume_write(image, &volume, VOLUME_FLOAT32, volume.data, error));
    free(mask);
    volume_free(&volume);
    return good;
}

/* An atlas of three ellipsoids of two labels, written to the folder: before it has learned from their images, or after. */
static enum greatest_test_res write_ellipsoid_atlas(bool learned)
{
    static struct atlas_build build; /* made by the first call, freed by the last */
    if (!learned) {
        build = make_build();
        for (int s = 0; s < 3; ++s) {
            const float center[3] = {6.0f + (float)s, 28.0f - (float)s, 26.0f},
                        half[3] = {13.0f + (float)s, 9.0f, 8.0f - 0.5f * (float)s};
            ASSERT(write_subject(scratch(s, "labels%d.nii.gz", s), scratch(3 + s, "image%d.nii.gz", s), center, half));
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
            ASSERT(volume_read(scratch(3 + s, "image%d.nii.gz", s), 0, &build.subjects[s].image, error));
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
    run.settings.image = scratch(6, "unseen.nii.gz", 0);
    run.settings.reference = scratch(7, "truth.nii.gz", 0);
    run.settings.atlas = scratch(8, "atlas.json", 0);
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
    ASSERT(atlas_read(scratch(0, "atlas.json", 0), &old));
    const int vertices = old.mean.vertex_count, triangles = old.mean.triangle_count;
    ASSERT_EQ(1 + vertices, lines_of(scratch(1, "subjects/002_labels2.csv", 0)));
    ASSERT_EQ(1 + triangles, lines_of(scratch(1, "particles/002_labels2.csv", 0)));
    ASSERT_EQ(0, access(scratch(1, "particles/002_labels2.ply", 0), R_OK));
    ASSERT_EQ(1 + vertices, lines_of(scratch(1, "correspondence.csv", 0)));
    ASSERT_EQ(2, lines_of(scratch(1, "weights.csv", 0))); /* atlas segment wrote last */
    snprintf(larger, sizeof larger, "%s/larger", folder);
    ASSERT(mkdir(larger, 0777) == 0);
    build.settings.same_vertices = true;
    build.settings.extends = names[0];
    build.settings.names[0] = scratch(2, "correspondence.ply", 0);
    build.settings.count = 1;
    build.settings.common.out = larger;
    ASSERT(atlas_add_run(&build));
    ASSERT(atlas_build_output(&build));
    ASSERT_EQ(4, build.settings.count);
    ASSERT_EQ(5, lines_of(scratch(1, "larger/weights.csv", 0)));
    ASSERT(atlas_read(scratch(1, "larger/atlas.json", 0), &new));
    ASSERT(new.subjects == 4 && new.model.modes == 3 && new.oriented);
    ASSERT_EQ(0, memcmp(old.regions, new.regions, (size_t)vertices * sizeof *old.regions));
    ASSERT(new.samples == old.samples
           && memcmp(old.profiles, new.profiles, (size_t)(vertices * old.samples) * sizeof *old.profiles) == 0);
    atlas_free(&new);
    atlas_free(&old);
    atlas_build_free(&build);
    build = make_build(); /* an atlas without its subjects, and meshes of other triangles */
    build.settings.same_vertices = true;
    build.settings.extends = scratch(1, "nothing/atlas.json", 0);
    ASSERT_FALSE(atlas_add_run(&build));
    atlas_build_free(&build);
    build = make_build();
    build.settings.same_vertices = true;
    build.settings.names[0] = scratch(1, "mean.ply", 0);
    build.settings.names[1] = scratch(2, "surface.ply", 0);
    build.settings.count = 2;
    ASSERT_FALSE(atlas_build_run(&build));
    atlas_build_free(&build);
    PASS();
}

/* Makes a series of two equal images out of one: NIfTI has its sizes, 16 bits each, from byte 40 on. */
static bool write_series(const char *path, const struct volume *image)
{
    const int16_t four = 4, two = 2;
    char error[VOLUME_TEXT];
    FILE *file = volume_write(path, image, VOLUME_FLOAT32, image->data, error) ? fopen(path, "r+b") : NULL;
    bool good = file && fseek(file, 40, SEEK_SET) == 0 && fwrite(&four, sizeof four, 1, file) == 1
             && fseek(file, 48, SEEK_SET) == 0 && fwrite(&two, sizeof two, 1, file) == 1 && fseek(file, 0, SEEK_END) == 0
             && fwrite(image->data, sizeof *image->data, volume_voxels(image), file) == volume_voxels(image);
    return file && fclose(file) == 0 && good;
}

/* An image whose voxels have a wrong size, so that it cannot show the atlas's object, or that is constant, is refused before anything is fitted. */
TEST atlas_segment_refuses_images_without_the_object(void)
{
    static const struct { double factors[3]; const char *reason; } cases[] = {
        {{0.02, 0.02, 0.02}, "too small for the atlas's object of"},
        {{20.0, 20.0, 20.0}, "too coarse for the atlas's object of"},
        {{1.0, 1.0, 60.0}, "too coarse for the atlas's object of"},
        {{1.0, 1.0, 1.0}, "the image is constant"}};
    char error[VOLUME_TEXT];
    struct volume image;
    ASSERT(volume_read(scratch(6, "unseen.nii.gz", 0), 0, &image, error));
    for (size_t c = 0; c < sizeof cases / sizeof *cases; ++c) {
        struct atlas_segment run;
        const float none[3] = {0.0f, 0.0f, 0.0f};
        float spacing[3];
        struct volume resized;
        for (int a = 0; a < 3; ++a) spacing[a] = (float)((double)image.spacing[a] * cases[c].factors[a]);
        ASSERT(volume_create(image.dims, spacing, none, &resized));
        const float *values = c < 3 ? image.data : resized.data; /* the last one is all zero */
        ASSERT(volume_write(scratch(9, "resized.nii.gz", 0), &resized, VOLUME_FLOAT32, values, error));
        volume_free(&resized);
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = 150.0, .steps = 2, .frame = -1};
        run.settings.common.quiet = true;
        run.settings.image = scratch(9, "resized.nii.gz", 0);
        run.settings.atlas = scratch(8, "atlas.json", 0);
        run.params = springls_default_params();
        fflush(stderr);
        const int kept = dup(STDERR_FILENO);
        ASSERT(kept >= 0 && freopen(scratch(10, "stderr.txt", 0), "w", stderr) != NULL);
        const bool good = atlas_segment_run(&run);
        fflush(stderr);
        dup2(kept, STDERR_FILENO);
        close(kept);
        FILE *file = fopen(scratch(10, "stderr.txt", 0), "r");
        char line[512] = "", more[8];
        ASSERT(file && fgets(line, sizeof line, file) && !fgets(more, sizeof more, file));
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

/* What does not fit the image is refused before anything is fitted, and a series without --frame. */
TEST atlas_segment_compares_only_what_fits(void)
{
    static const char *const references[] = {"small.nii.gz", "elsewhere.nii.gz", "truth.nii.gz", "truth.nii.gz"};
    const float none[3] = {0.0f, 0.0f, 0.0f}, ones[3] = {1.0f, 1.0f, 1.0f};
    const int dims[3] = {20, 20, 20};
    char error[VOLUME_TEXT];
    struct volume image, small;
    ASSERT(volume_read(scratch(6, "unseen.nii.gz", 0), 0, &image, error));
    ASSERT(volume_create(dims, ones, none, &small));
    for (int n = 0; n < 8000; ++n) small.data[n] = 1.0f;
    ASSERT(volume_write(scratch(9, "small.nii.gz", 0), &small, VOLUME_FLOAT32, small.data, error));
    volume_free(&small);
    ASSERT(volume_create(image.dims, image.spacing, none, &small)); /* the same voxels, but not there */
    for (size_t n = 0; n < volume_voxels(&small); ++n) small.data[n] = n % 2 > 0 ? 1.0f : 0.0f;
    ASSERT(volume_write(scratch(9, "elsewhere.nii.gz", 0), &small, VOLUME_FLOAT32, small.data, error));
    volume_free(&small);
    ASSERT(write_series(scratch(9, "series.nii", 0), &image));
    volume_free(&image);
    for (int c = 0; c < 6; ++c) {
        struct atlas_segment run;
        memset(&run, 0, sizeof run);
        run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = 150.0, .steps = 2,
                                                       .frame = c == 5 ? 1 : -1};
        run.settings.common.quiet = true;
        run.settings.image = scratch(6, c < 4 ? "unseen.nii.gz" : "series.nii", 0);
        run.settings.reference = c < 4 ? scratch(7, references[c], 0) : NULL;
        run.settings.label_text = c == 2 ? "7" : c == 3 ? "1+2" : NULL;
        run.settings.atlas = scratch(8, "atlas.json", 0);
        run.params = springls_default_params();
        run.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
        ASSERT_EQ(c == 3 || c == 5, atlas_segment_run(&run)); /* the third has no label 7 */
        ASSERT_EQ(c == 3 || c == 5, run.ctx != NULL);
        atlas_segment_free(&run);
    }
    PASS();
}

/* An image of another place, and several in one file. */
TEST images_have_to_show_their_subjects(void)
{
    const float none[3] = {0.0f, 0.0f, 0.0f};
    char error[VOLUME_TEXT];
    struct volume image, elsewhere;
    struct atlas_subject subject;
    ASSERT(volume_read(scratch(3, "image%d.nii.gz", 0), 0, &image, error));
    ASSERT(volume_create(image.dims, image.spacing, none, &elsewhere));
    ASSERT(volume_write(scratch(4, "far.nii.gz", 0), &elsewhere, VOLUME_FLOAT32, image.data, error));
    ASSERT(write_series(scratch(5, "many.nii", 0), &image));
    volume_free(&image);
    volume_free(&elsewhere);
    const char *const labels = scratch(0, "labels%d.nii.gz", 0);
    static const char *const images[] = {"image0.nii.gz", "far.nii.gz", "many.nii"};
    for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(i == 0, atlas_subject_read(labels, scratch(3, images[i], 0), NULL, false, &subject));
        atlas_subject_free(&subject);
    }
    ASSERT_FALSE(atlas_subject_read(scratch(5, "many.nii", 0), NULL, NULL, false, &subject));
    atlas_subject_free(&subject);
    PASS();
}

/* ---- votes of registered subjects ---- */

enum { SIDE = 20, CUBES = SIDE * SIDE * SIDE };

static float noise(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (float)(*state >> 40) / 16777216.0f - 0.5f;
}

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
    ASSERT(fusion_vote(&template, target, all, &votes));
    const double plain = dice_of(votes.mean, 0.5f, template.masks, &ratio);
    ASSERT(plain < 0.75);
    ASSERT(dice_of(votes.voted, 0.5f, template.masks, &ratio) > 0.95);
    const float trust = fusion_trust(&template, &votes);
    fusion_votes_free(&votes);
    ASSERT(fusion_vote(&template, target, others, &votes)); /* the one that fits is left out */
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
        ASSERT(fusion_vote(&template, template.images + (size_t)s * CUBES, include, &votes));
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
    ASSERT(atlas_read(scratch(0, "atlas.json", 0), &again));
    ASSERT(again.templates[0].corrected);
    ASSERT_EQ(0, memcmp(template.correction, again.templates[0].correction, (size_t)fusion_terms * sizeof(float)));
    ASSERT_EQ(0, memcmp(template.deviations, again.templates[0].deviations, (size_t)COUNT * CUBES * sizeof(float)));
    atlas_free(&again);
    atlas_free(&atlas); /* and the template */
    PASS();
}

/* A long ellipsoid of labels 1 and 2, whose contrast fades to a tenth at one end: there an edge search finds nothing. A bright
 * neighbour shows where it ends. Every scan has its own scale of intensities. */
static bool write_scan(int s, const float center[3], const float half[3])
{
    const int dims[3] = {30, 22, 20};
    const float spacing[3] = {2.0f, 2.0f, 2.0f}, origin[3] = {0.0f, 0.0f, 0.0f}, gain = 1.0f + 3.0f * (float)(s % 3);
    struct volume volume;
    char error[VOLUME_TEXT];
    uint64_t state = (uint64_t)s + 1;
    uint8_t mask[30 * 22 * 20];
    if (!volume_create(dims, spacing, origin, &volume)) return false;
    for (size_t n = 0; n < volume_voxels(&volume); ++n) {
        int at[3];
        float square = 0.0f, d[3];
        volume_place(dims, n, at);
        for (int a = 0; a < 3; ++a) d[a] = (2.0f * (float)at[a] - center[a]) / half[a], square += d[a] * d[a];
        const float r = sqrtf(square), shown = d[0] > 0.3f ? 0.1f : 1.0f;
        const float edge = fmaxf(0.0f, fminf(1.0f, 0.5f + (1.0f - r) * half[1] / 2.0f)); /* of two voxels */
        const float dx = d[0] - 1.5f, neighbor = dx * dx + d[1] * d[1] + d[2] * d[2] < 0.16f ? 60.0f : 0.0f;
        mask[n] = (uint8_t)(r > 1.0f ? 0 : d[0] < 0.0f ? 1 : 2);
        volume.data[n] = gain * (100.0f + 80.0f * shown * edge + neighbor + 6.0f * noise(&state));
    }
    const bool good = volume_write(scratch(0, "labels/scan%02d.nii.gz", s), &volume, VOLUME_UINT8, mask, error)
                   && volume_write(scratch(0, "images/scan%02d.nii.gz", s), &volume, VOLUME_FLOAT32, volume.data, error);
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
    for (int s = 0; s + 1 < SCANS; ++s) build.settings.names[s] = scratch(s, "labels/scan%02d.nii.gz", s);
    build.settings.count = SCANS - 1;
    build.settings.images = scratch(10, "images", 0);
    build.settings.rounds = 1;
    build.settings.templates = 1;
    build.settings.common.grid = 16; /* few springls are enough */
    ASSERT(atlas_build_run(&build));
    ASSERT_EQ(1, build.atlas.template_count);
    ASSERT(atlas_write(folder, &build.atlas));
    ASSERT(atlas_read(scratch(11, "atlas.json", 0), &again)); /* templates survive their file */
    const struct fusion_template *from = &build.atlas.templates[0], *to = &again.templates[0];
    ASSERT_EQ(1, again.template_count);
    ASSERT(volume_same_grid(&from->image, &to->image));
    ASSERT_EQ(from->self, to->self);
    ASSERT_IN_RANGE(from->level, to->level, 1e-6f);
    ASSERT_EQ(0, memcmp(from->masks, to->masks, (size_t)from->count * volume_voxels(&from->image) * sizeof(float)));
    ASSERT_FALSE(to->corrected); /* so few subjects teach no correction */
    atlas_free(&again);
    memset(&run, 0, sizeof run);
    run.settings = (struct atlas_segment_settings){.common = cli_common_defaults(), .level = (double)NAN, .gvf = 0.2,
                                                   .curvature = 0.05, .modes = 10, .steps = 100};
    run.settings.common.quiet = true;
    run.settings.atlas = names[11];
    run.settings.image = scratch(12, "images/scan%02d.nii.gz", SCANS - 1);
    run.settings.reference = scratch(13, "labels/scan%02d.nii.gz", SCANS - 1);
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
        right += fabsf(x) > 3.0f && run.regions[v] == (x < 0.0f ? 1 : 2);
    }
    ASSERT(counted > 100 && right > 0.97 * counted);
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

TEST leaving_one_out_makes_a_table(void)
{
    struct atlas_trial_settings set = {.common = cli_common_defaults(), .folder = folder, .templates = 2, .first = 1, .every = 3};
    const springls_params params = springls_default_params();
    double dice[100];
    set.common.quiet = true;
    set.common.grid = 16;
    set.common.json = scratch(14, "trial.json", 0);
    ASSERT(write_scans(SCANS));
    ASSERT(atlas_leave_one_out(&set, &params));
    ASSERT_EQ(2 * 3, read_report(names[14], dice)); /* registration, fusion, springls */
    for (int s = 0; s < 2; ++s) ASSERT(dice[3 * s + 2] > 0.95);
    set.folder = scratch(15, "nowhere", 0);
    ASSERT_FALSE(atlas_leave_one_out(&set, &params));
    PASS();
}

TEST mirrored_subjects_lie_on_the_other_side(void)
{
    const float center[3] = {3.0f, 28.0f, 26.0f}, half[3] = {9.0f, 9.0f, 8.0f}, middle = -20.0f + 0.5f * 55.0f;
    struct atlas_subject plain, mirrored;
    ASSERT(write_subject(scratch(0, "labels%d.nii.gz", 0), NULL, center, half));
    ASSERT(atlas_subject_read(names[0], NULL, NULL, false, &plain));
    ASSERT(atlas_subject_read(names[0], NULL, NULL, true, &mirrored));
    ASSERT_IN_RANGE(3.0, plain.target.center[0], 0.1);
    ASSERT_IN_RANGE(2.0 * (double)middle - 3.0, mirrored.target.center[0], 0.1);
    ASSERT_EQ(1, atlas_label_at(&plain.labels, (const float[3]){center[0] - 4.0f, center[1], center[2]}));
    ASSERT_EQ(1, atlas_label_at(&mirrored.labels, (const float[3]){2.0f * middle - center[0] + 4.0f, center[1], center[2]}));
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

TEST landmarks_are_mirrored_with_their_subject(void)
{
    const float center[3] = {3.0f, 28.0f, 26.0f}, half[3] = {9.0f, 9.0f, 8.0f}, middle = -20.0f + 0.5f * 55.0f;
    struct atlas_subject plain, mirrored;
    ASSERT(write_subject(scratch(0, "labels%d.nii.gz", 0), NULL, center, half));
    ASSERT(write_text(scratch(1, "labels%d.csv", 0), "12,28,26\n3,37,26\n3,28,34\n")); /* on the surface */
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

/* ---- the command line's repeated argument ---- */

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

/* ---- real shapes ---- */

/* Landmarks of the tori: places of the first one as far from each other as can be. */
static bool write_landmarks(const struct mesh *tori, int count, int landmarks)
{
    int chosen[16];
    if (points_spread(tori[0].positions, (int)tori[0].vertex_count, landmarks, chosen) != landmarks) return false;
    for (int s = 0; s < count; ++s) {
        FILE *file = fopen(scratch(15, "torus_%d.csv", s), "w");
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
    const char *scratch_root = getenv("TMPDIR");
    char command[300];
    snprintf(folder, sizeof folder, "%s/springls_atlas_XXXXXX", scratch_root ? scratch_root : "/tmp");
    if (!mkdtemp(folder)) {
        perror(folder);
        return 1;
    }
    GREATEST_MAIN_BEGIN();
    RUN_TEST(similarity_of_moved_points_is_found);
    RUN_TEST(alignment_takes_pose_and_size_away);
    RUN_TEST(modes_that_were_put_in_come_out);
    RUN_TEST(targets_know_sides_and_rims);
    RUN_TEST(noise_is_learned_from_the_target);
    RUN_TEST(springls_find_the_correspondence_of_ellipsoids);
    RUN_TEST(a_run_without_atlas_is_read_from_its_report);
    RUN_TEST(atlases_survive_their_files);
    RUN_TEST(broken_atlas_files_are_refused);
    RUN_TEST(bad_subjects_are_refused);
    RUN_TESTp(atlas_finds_an_ellipsoid, false); /* by the level of its image */
    RUN_TESTp(atlas_finds_an_ellipsoid, true);  /* by what it has learned; needs the atlas of the first */
    RUN_TEST(a_segmented_subject_is_added);
    RUN_TEST(atlas_segment_refuses_images_without_the_object);
    RUN_TEST(atlas_segment_compares_only_what_fits);
    RUN_TEST(images_have_to_show_their_subjects);
    RUN_TEST(votes_go_by_the_agreement_of_patches);
    RUN_TEST(corrections_learn_what_votes_get_wrong);
    RUN_TEST(subjects_fuse_into_an_unseen_image);
    RUN_TEST(leaving_one_out_makes_a_table);
    RUN_TEST(mirrored_subjects_lie_on_the_other_side);
    RUN_TEST(landmarks_are_mirrored_with_their_subject);
    RUN_TEST(repeated_arguments_are_collected);
    RUN_TEST(tori_correspond_within_three_fifths_of_a_voxel);
    RUN_TEST(tori_images_are_read);
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) perror(folder);
    GREATEST_MAIN_END();
}

#endif
