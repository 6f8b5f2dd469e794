/* The tools of examples/viewer on a model, without a window: where rays meet it, brushes and their shapes, cuts and merges, masks,
 * grids that grow and move, and steps in pieces. Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_viewer_tools_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_viewer_tools_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

/* Its inner constants are read here. */
#include "../../examples/viewer/tools.c"

#include "viewer_fixtures.h"

/* How far the surface is from the origin in this direction. */
static float radius_along(struct viewer_model *model, float x, float y, float z)
{
    struct viewer_ray ray = {{9.0f * x, 9.0f * y, 9.0f * z}, {-x, -y, -z}};
    struct viewer_brush brush = {.radius = 1.0f};
    return viewer_pick(model, &ray, &brush) ? vec3_length(brush.center) : NAN;
}

TEST a_ray_finds_the_surface(void)
{
    struct viewer_model model = ball();
    const struct viewer_brush brush = front(&model);
    ASSERT_IN_RANGE(1.0f, vec3_length(brush.center), 0.005f);
    ASSERT_IN_RANGE(0.1f, brush.center[0], 1e-6f);
    for (int a = 0; a < 3; ++a) ASSERT_IN_RANGE(brush.center[a], brush.normal[a], 0.03f);
    const struct viewer_ray past = {{1.2f, 0.0f, 9.0f}, {0.0f, 0.0f, -1.0f}}, away = {{0.0f, 0.0f, 9.0f}, {0.0f, 0.0f, 1.0f}};
    struct viewer_brush none;
    ASSERT_FALSE(viewer_pick(&model, &past, &none));
    ASSERT_FALSE(viewer_pick(&model, &away, &none));
    viewer_model_free(&model);
    PASS();
}

/* What is in the brush follows it; the rest stays where it was. */
TEST drag_moves_its_region_and_not_the_rest(void)
{
    struct viewer_model model = ball();
    struct viewer_brush brush = front(&model);
    const float way[3] = {0.01f, 0.05f, 0.07f}, begin[3] = {brush.center[0], brush.center[1], brush.center[2]};
    for (int i = 0; i < 6; ++i) ASSERT(viewer_drag(&model, &brush, way));
    for (int a = 0; a < 3; ++a) ASSERT_IN_RANGE(begin[a] + 6.0f * way[a], brush.center[a], 1e-5f);
    float phi;
    springls_sample_distance(model.ctx, brush.center, 1, &phi);
    ASSERT_IN_RANGE(0.0f, phi, 0.5f * model.voxel);
    /* The springl there came from where the brush began. */
    springls_hit hit;
    springls_closest(model.ctx, SPRINGLS_SURFACE_WATERTIGHT, brush.center, 1, &hit);
    vec3_sub(hit.material, begin, hit.material);
    ASSERT(vec3_length(hit.material) < model.voxel);
    ASSERT_IN_RANGE(1.0f, radius_along(&model, 0.0f, 0.0f, -1.0f), 0.005f);
    ASSERT_IN_RANGE(1.0f, radius_along(&model, 1.0f, 0.0f, 0.0f), 0.005f);
    ASSERT_EQ(1, measured(&model).components);
    viewer_model_free(&model);
    PASS();
}

TEST push_makes_a_dent_or_a_bump(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        struct viewer_model model = ball();
        const struct viewer_brush brush = front(&model);
        const double before = measured(&model).volume;
        for (int i = 0; i < 4; ++i) ASSERT(viewer_push(&model, &brush, (float)sign * 0.04f));
        struct viewer_brush after = front(&model);
        ASSERT((float)sign * (vec3_length(after.center) - 1.0f) > 0.1f);
        ASSERT((float)sign * (float)(measured(&model).volume - before) > 0.01f);
        ASSERT_IN_RANGE(1.0f, radius_along(&model, 0.0f, 0.0f, -1.0f), 0.005f);
        viewer_model_free(&model);
    }
    PASS();
}

TEST inflate_grows_and_deflate_shrinks(void)
{
    struct viewer_model model = ball();
    const double before = measured(&model).volume;
    ASSERT(viewer_inflate(&model, NULL, 0.05f));
    const double grown = measured(&model).volume;
    ASSERT_IN_RANGE(before * 1.05 * 1.05 * 1.05, grown, 0.01 * before);
    ASSERT(viewer_inflate(&model, NULL, -0.05f));
    ASSERT_IN_RANGE(before, measured(&model).volume, 0.01 * before);
    const struct viewer_brush brush = front(&model);
    ASSERT(viewer_inflate(&model, &brush, 0.05f));
    const double part = measured(&model).volume;
    ASSERT(part > 1.001 * before && part < 1.05 * before);
    viewer_model_free(&model);
    PASS();
}

/* A bump grows lower in the brush; without a brush the ball shrinks by motion by curvature: dR/dt = -2 / R. */
TEST smooth_levels_a_bump(void)
{
    struct viewer_model model = ball();
    struct viewer_brush brush = front(&model);
    brush.radius = 0.25f;
    for (int i = 0; i < 4; ++i) ASSERT(viewer_push(&model, &brush, 0.04f));
    brush = front(&model);
    const float high = vec3_length(brush.center);
    for (int i = 0; i < 10; ++i) ASSERT(viewer_smooth(&model, &brush, 1.0f));
    brush = front(&model);
    ASSERT(vec3_length(brush.center) < high - 0.2f * (high - 1.0f));
    ASSERT(vec3_length(brush.center) > 1.0f - 0.1f * model.voxel);
    ASSERT_IN_RANGE(1.0f, radius_along(&model, 0.0f, 0.0f, -1.0f), 0.005f);
    viewer_model_free(&model);

    model = ball();
    for (int i = 0; i < 20; ++i) ASSERT(viewer_smooth(&model, NULL, 1.0f));
    const float voxels = 1.0f / model.voxel, expected = sqrtf(voxels * voxels - 4.0f * 20.0f * MAX_SMOOTHING) * model.voxel;
    ASSERT_IN_RANGE(expected, radius_along(&model, 0.0f, 0.0f, 1.0f), 0.1f * model.voxel);
    viewer_model_free(&model);
    PASS();
}

TEST cut_makes_two_and_merge_one(void)
{
    struct viewer_model model = ball();
    const double before = measured(&model).volume;
    struct viewer_cut cut = stroke_across(&model, 3.0f, -2.0f, 0.0f, false);
    ASSERT(viewer_subtract(&model, &cut)); /* half way across: a notch */
    ASSERT_EQ(1, measured(&model).components);
    ASSERT(measured(&model).volume < before - 1.0 * (double)model.voxel);
    viewer_model_free(&model);

    model = ball();
    cut = stroke_across(&model, 3.0f, -2.0f, 2.0f, false);
    ASSERT(viewer_subtract(&model, &cut));
    ASSERT_EQ(2, measured(&model).components);
    ASSERT_IN_RANGE(before - 3.14159265 * 3.0 * (double)model.voxel, measured(&model).volume, 0.01 * before);

    const float front_half[3] = {0.0f, 0.0f, 0.5f};
    struct viewer_model second = {0};
    ASSERT(viewer_model_second_ball(&second, &model, front_half, 0.5f));
    ASSERT(viewer_merge(&model, &second));
    ASSERT_EQ(1, measured(&model).components);
    ASSERT_IN_RANGE(1.0f, radius_along(&model, 0.0f, 0.0f, 1.0f), 0.5f * model.voxel);
    viewer_model_free(&second);

    cut = stroke_across(&model, 3.0f, -2.0f, 2.0f, true); /* to the right runs: what is below goes */
    ASSERT(viewer_subtract(&model, &cut));
    ASSERT(measured(&model).lower[1] > -0.5f * model.voxel);
    ASSERT(measured(&model).upper[1] > 0.9f);
    viewer_model_free(&model);
    PASS();
}

/* The radius at a place of the front and at its mirror image. */
static float right_and_left(struct viewer_model *model, float *left)
{
    *left = radius_along(model, -0.6f, 0.0f, 0.8f);
    return radius_along(model, 0.6f, 0.0f, 0.8f);
}

TEST symmetry_doubles_the_brush(void)
{
    struct viewer_model model = ball();
    const struct viewer_ray ray = {{5.4f, 0.0f, 7.2f}, {-0.6f, 0.0f, -0.8f}};
    struct viewer_brush brush = {.radius = 0.4f, .symmetry = 1};
    float left;
    ASSERT(viewer_pick(&model, &ray, &brush));
    for (int i = 0; i < 4; ++i) ASSERT(viewer_push(&model, &brush, 0.04f));
    float right = right_and_left(&model, &left);
    ASSERT_GT(right, 1.1f);
    ASSERT_IN_RANGE(right, left, 0.1f * model.voxel);
    ASSERT(viewer_pick(&model, &ray, &brush));
    for (int i = 0; i < 3; ++i) ASSERT(viewer_inflate(&model, &brush, 0.03f));
    right = right_and_left(&model, &left);
    ASSERT_GT(right, 1.15f);
    ASSERT_IN_RANGE(right, left, 0.1f * model.voxel);
    for (int i = 0; i < 6; ++i) ASSERT(viewer_smooth(&model, &brush, 1.0f));
    ASSERT(right_and_left(&model, &left) < right - 0.01f);
    ASSERT_IN_RANGE(right_and_left(&model, &left), left, 0.1f * model.voxel);
    const float aside[3] = {0.05f, 0.0f, 0.0f};
    ASSERT(viewer_pick(&model, &ray, &brush));
    for (int i = 0; i < 4; ++i) ASSERT(viewer_drag(&model, &brush, aside)); /* to the right there, to the left here */
    const springls_measures m = measured(&model);
    ASSERT_IN_RANGE(0.0f, m.lower[0] + m.upper[0], 0.2f * model.voxel);
    brush.symmetry = 0; /* and alone again */
    ASSERT(viewer_pick(&model, &ray, &brush));
    for (int i = 0; i < 3; ++i) ASSERT(viewer_push(&model, &brush, 0.04f));
    right = right_and_left(&model, &left);
    ASSERT_GT(right, left + 0.1f);
    viewer_model_free(&model);
    PASS();
}

/* A flat brush moves more than a smooth one, a pointed one less, and all of them as much in the middle. */
TEST falloff_shapes_a_bump(void)
{
    double grown[VIEWER_FALLOFFS];
    for (int f = 0; f < VIEWER_FALLOFFS; ++f) {
        struct viewer_model model = ball();
        struct viewer_brush brush = front(&model);
        const double before = measured(&model).volume;
        brush.falloff = (enum viewer_falloff)f;
        for (int i = 0; i < 3; ++i) ASSERT(viewer_push(&model, &brush, 0.03f));
        grown[f] = measured(&model).volume - before;
        ASSERT_IN_RANGE(1.09f, vec3_length(front(&model).center), 0.4f * model.voxel);
        viewer_model_free(&model);
    }
    ASSERT(grown[VIEWER_FALLOFF_FLAT] > 1.3 * grown[VIEWER_FALLOFF_SMOOTH]);
    ASSERT(grown[VIEWER_FALLOFF_SMOOTH] > 1.3 * grown[VIEWER_FALLOFF_POINTED]);
    PASS();
}

/* The front is masked: push, inflate and smooth leave it where it is, while the rest moves. */
TEST what_is_masked_stays(void)
{
    struct viewer_model model = ball();
    const struct viewer_ray from_back = {{0.1f, 0.0f, -9.0f}, {0.0f, 0.0f, 1.0f}};
    struct viewer_brush brush = front(&model), back = {.radius = 0.4f};
    ASSERT(viewer_mask(&model, &brush, 2.0f)); /* wholly in the middle, in part towards the rim */
    const int count = springls_count(model.ctx);
    springls_view mask = springls_view_attribute(model.ctx, model.mask);
    int whole = 0, part = 0;
    for (int i = 0; i < count; ++i) {
        const float value = viewer_model_mask_of(&mask, i);
        whole += value > 0.999f;
        part += value > 0.0f && value <= 0.999f;
    }
    ASSERT(whole > 50 && part > 50 && whole + part < count / 4);
    ASSERT_IN_RANGE(0.0f, viewer_model_mask_of(&mask, count), 0.0f);
    ASSERT(viewer_pick(&model, &from_back, &back));
    for (int i = 0; i < 3; ++i) {
        ASSERT(viewer_push(&model, &brush, 0.04f));
        ASSERT(viewer_push(&model, &back, 0.04f));
        ASSERT(viewer_inflate(&model, NULL, 0.02f));
        ASSERT(viewer_smooth(&model, NULL, 1.0f));
        ASSERT(viewer_smooth(&model, &brush, 1.0f));
    }
    while (!viewer_model_at_rest(&model)) ASSERT(viewer_model_rest_step(&model));
    ASSERT_IN_RANGE(1.0f, vec3_length(front(&model).center), 0.05f * model.voxel);
    ASSERT_GT(radius_along(&model, 0.1f, 0.0f, -1.0f), 1.12f);
    ASSERT_GT(radius_along(&model, 1.0f, 0.0f, 0.0f), 1.03f);
    ASSERT_EQ(2, measured(&model).euler);
    mask = springls_view_attribute(model.ctx, model.mask); /* springls that are kept are all still there */
    int kept = 0;
    for (int i = 0; i < mask.count; ++i) kept += viewer_model_mask_of(&mask, i) > 0.999f;
    ASSERT(kept >= whole);

    ASSERT(viewer_model_invert_mask(&model)); /* now the front alone may move */
    const float side = radius_along(&model, 1.0f, 0.0f, 0.0f);
    for (int i = 0; i < 3; ++i) ASSERT(viewer_inflate(&model, NULL, 0.03f));
    ASSERT_GT(vec3_length(front(&model).center), 1.06f);
    ASSERT_IN_RANGE(side, radius_along(&model, 1.0f, 0.0f, 0.0f), 0.05f * model.voxel);
    ASSERT(viewer_mask(&model, NULL, -1.0f)); /* taken away from the whole body */
    mask = springls_view_attribute(model.ctx, model.mask);
    for (int i = 0; i < mask.count; ++i) ASSERT_IN_RANGE(0.0f, viewer_model_mask_of(&mask, i), 0.0f);
    ASSERT(viewer_model_set_mask(&model, NULL));
    ASSERT_EQ(-1, model.mask);
    ASSERT(viewer_inflate(&model, NULL, 0.05f));
    ASSERT_GT(radius_along(&model, 1.0f, 0.0f, 0.0f), side + 0.04f);
    viewer_model_free(&model);
    PASS();
}

/* A body grows out of the cube that it was made for, in all directions and to three times its size. */
TEST the_grid_has_room_for_a_body_that_grows(void)
{
    const springls_desc desc = {.grid = {.size = {20, 20, 20}}};
    struct viewer_model model = {0};
    ASSERT(viewer_model_ball(&model, &desc));
    for (int i = 0; i < 20; ++i) ASSERT(viewer_inflate(&model, NULL, 0.1f));
    while (!viewer_model_at_rest(&model)) ASSERT(viewer_model_rest_step(&model));
    const springls_measures m = measured(&model);
    ASSERT_GT(3.0f, 10.0f * model.voxel); /* outside that cube */
    ASSERT_IN_RANGE(4.0 / 3.0 * 3.14159265 * 27.0, m.volume, 0.03 * 113.0);
    ASSERT_EQ(1, m.components);
    ASSERT_EQ(2, m.euler);
    viewer_model_free(&model);
    PASS();
}

/* A ball is carried 200 voxels to the right, further than the room in its grid, which follows; tools, cuts and second bodies act
 * where it is then. */
TEST tools_go_with_a_grid_that_moves(void)
{
    struct viewer_model model = ball(), second = {0};
    struct viewer_brush all = {.radius = 200.0f}, brush = {.radius = 0.4f};
    const springls_chunk *changed;
    int offset[3], count;
    float lower[3], upper[3];
    const double before = measured(&model).volume;
    const float way[3] = {20.0f * model.voxel, 0.0f, 0.0f};
    for (int i = 0; i < 10; ++i) ASSERT(viewer_drag(&model, &all, way));
    springls_window_offset(model.ctx, offset);
    ASSERT_GT(offset[0], 40);
    springls_measures m = measured(&model);
    ASSERT_IN_RANGE(before, m.volume, 0.02 * before);
    const float x = 0.5f * (m.lower[0] + m.upper[0]);
    ASSERT_IN_RANGE(200.0f * model.voxel, x, 0.1f);
    ASSERT(viewer_model_box(&model, lower, upper));
    ASSERT_IN_RANGE(m.lower[0], lower[0], model.voxel);
    ASSERT_IN_RANGE(m.upper[2], upper[2], model.voxel);
    ASSERT(viewer_model_chunks(&model, false, &changed, &count));
    for (int i = 0; i < count; ++i) ASSERT(changed[i].triangle_count == 0 || changed[i].brick[0] >= offset[0] / 8);

    const struct viewer_ray ray = {{x, 0.0f, 9.0f}, {0.0f, 0.0f, -1.0f}};
    ASSERT(viewer_pick(&model, &ray, &brush));
    const float level = brush.center[2];
    for (int i = 0; i < 4; ++i) ASSERT(viewer_push(&model, &brush, 0.04f));
    ASSERT(viewer_pick(&model, &ray, &brush));
    const float bump = brush.center[2];
    ASSERT_GT(bump, level + 0.1f);
    for (int i = 0; i < 10; ++i) ASSERT(viewer_smooth(&model, &brush, 1.0f)); /* its samples are where the brush is */
    ASSERT(viewer_pick(&model, &ray, &brush));
    ASSERT(brush.center[2] < bump - 0.1f * (bump - level));
    const float smoothed = brush.center[2];
    for (int i = 0; i < 3; ++i) ASSERT(viewer_inflate(&model, &brush, 0.03f));
    ASSERT(viewer_pick(&model, &ray, &brush));
    ASSERT_GT(brush.center[2], smoothed + 0.05f);

    struct viewer_cut cut = stroke_across(&model, 3.0f, -2.0f, 2.0f, false);
    cut.eye[0] += x;
    ASSERT(viewer_subtract(&model, &cut));
    ASSERT_EQ(2, measured(&model).components);
    const float at[3] = {x, 0.0f, 0.5f};
    ASSERT(viewer_model_second_ball(&second, &model, at, 0.5f));
    ASSERT(viewer_merge(&model, &second));
    ASSERT_EQ(1, measured(&model).components);
    viewer_model_free(&second);
    viewer_model_free(&model);
    PASS();
}

/* A step in pieces of a budget that is always too small has the bits of a whole one; so have the chunks. */
TEST steps_and_chunks_come_in_pieces(void)
{
    struct viewer_model whole = ball(), parts = ball();
    const struct viewer_brush brush = front(&whole);
    const springls_chunk *changed;
    int pieces = 0, count, all, calls = 1;
    for (int i = 0; i < 4; ++i) {
        parts.budget = 1e-6;
        ASSERT(viewer_push(&whole, &brush, 0.04f));
        ASSERT(viewer_push(&parts, &brush, 0.04f));
        ASSERT_FALSE(viewer_model_at_rest(&parts));
        for (; parts.stepping; ++pieces) ASSERT(viewer_model_continue(&parts));
        ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(parts.ctx));
    }
    ASSERT_GT(pieces, 20);
    const struct viewer_brush wide = {.center = {0.1f, 0.0f, 1.0f}, .radius = 1.5f};
    pieces = 0;
    ASSERT(viewer_smooth(&whole, &wide, 1.0f)); /* the curvatures are found in pieces too */
    ASSERT(viewer_smooth(&parts, &wide, 1.0f));
    for (; !springls_step_in_progress(parts.ctx); ++pieces) ASSERT(viewer_model_continue(&parts));
    ASSERT(pieces > springls_count(parts.ctx) / 1024);
    ASSERT(viewer_model_finish(&parts));
    ASSERT_EQ(springls_state_hash(whole.ctx), springls_state_hash(parts.ctx));
    ASSERT(viewer_model_chunks(&whole, true, &changed, &all));
    ASSERT(viewer_model_chunks(&parts, true, &changed, &count));
    for (; parts.chunks_in_progress; ++calls) {
        ASSERT_EQ(0, count);
        ASSERT(viewer_model_chunks(&parts, true, &changed, &count));
    }
    ASSERT_EQ(all, count);
    ASSERT_GT(calls, 3);
    viewer_model_free(&whole);
    viewer_model_free(&parts);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(a_ray_finds_the_surface);
    RUN_TEST(drag_moves_its_region_and_not_the_rest);
    RUN_TEST(push_makes_a_dent_or_a_bump);
    RUN_TEST(inflate_grows_and_deflate_shrinks);
    RUN_TEST(smooth_levels_a_bump);
    RUN_TEST(cut_makes_two_and_merge_one);
    RUN_TEST(symmetry_doubles_the_brush);
    RUN_TEST(falloff_shapes_a_bump);
    RUN_TEST(what_is_masked_stays);
    RUN_TEST(the_grid_has_room_for_a_body_that_grows);
    RUN_TEST(tools_go_with_a_grid_that_moves);
    RUN_TEST(steps_and_chunks_come_in_pieces);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
