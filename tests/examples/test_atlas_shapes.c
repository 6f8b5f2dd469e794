/* Statistics of shape in examples/common/shapes: similarity transforms, Procrustes alignment, principal modes, targets and warps.
 * Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_atlas_shapes_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_atlas_shapes_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

#include "atlas_fixtures.h"

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

TEST targets_have_sides_and_rims(void)
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

int main(int argc, char **argv)
{
    if (!make_folder()) return 1;
    GREATEST_MAIN_BEGIN();
    RUN_TEST(similarity_of_moved_points_is_found);
    RUN_TEST(alignment_takes_pose_and_size_away);
    RUN_TEST(modes_that_were_put_in_come_out);
    RUN_TEST(targets_have_sides_and_rims);
    RUN_TEST(noise_is_learned_from_the_target);
    remove_folder();
    GREATEST_MAIN_END();
}

#endif
