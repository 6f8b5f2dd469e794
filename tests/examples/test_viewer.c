/* examples/viewer.c: tools on a model and events without a window; scripts and pictures on a virtual display, where there is one.
   Compiled like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_viewer_built_without_its_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_viewer_built_without_its_libraries);
    GREATEST_MAIN_END();
}

#else

/* The program, whose inner functions are called here. */
#define main viewer_main
#include "../../examples/viewer/viewer.c"
#undef main
#include "../../examples/viewer/app.c"
#include "../../examples/viewer/bench.c"
#include "../../examples/viewer/camera.c"
#include "../../examples/viewer/file.c"
#include "../../examples/viewer/gl.c"
#include "../../examples/viewer/history.c"
#include "../../examples/viewer/model.c"
#include "../../examples/viewer/scene.c"
#include "../../examples/viewer/script.c"
#include "../../examples/viewer/solid.c"
#include "../../examples/viewer/text.c"
#include "../../examples/viewer/tools.c"
#include "../../examples/viewer/window.c"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "scratch.h"

/* A foreign header: its warnings are not ours. */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wshadow"
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

/* Mesa keeps some hundred bytes a window, and is unloaded before LeakSanitizer looks: the stacks have no names that a suppression
 * could match. So leaks are not looked for while a window is open; tools and events are tested without one. */
#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#define DRIVER_BEGIN __lsan_disable()
#define DRIVER_END __lsan_enable()
#else
#define DRIVER_BEGIN (void)0
#define DRIVER_END (void)0
#endif

static const springls_desc small = {.grid = {.size = {48, 48, 48}}};

/* A ball of radius 1 in a grid of 48^3. */
static struct viewer_model ball(void)
{
    struct viewer_model model = {0};
    viewer_model_ball(&model, &small);
    return model;
}

static const struct viewer_ray from_front = {{0.1f, 0.0f, 9.0f}, {0.0f, 0.0f, -1.0f}};

/* A brush of radius 0.4 where that ray meets the model. */
static struct viewer_brush front(struct viewer_model *model)
{
    struct viewer_brush brush = {.radius = 0.4f};
    viewer_pick(model, &from_front, &brush);
    return brush;
}

static springls_measures measured(struct viewer_model *model)
{
    springls_measures m;
    memset(&m, 0, sizeof m);
    springls_measure(model->ctx, &m);
    return m;
}

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

static struct viewer_cut stroke_across(struct viewer_model *model, float width, float from_x, float to_x, bool side)
{
    const float eye[3] = {0.0f, 0.0f, 6.0f};
    struct viewer_ray from = {{0.0f, 0.0f, 6.0f}, {0.0f, 0.0f, 0.0f}}, to = from;
    const float left[3] = {from_x, 0.0f, 0.0f}, right[3] = {to_x, 0.0f, 0.0f};
    struct viewer_cut cut;
    vec3_sub(left, eye, from.direction);
    vec3_sub(right, eye, to.direction);
    vec3_normalize(from.direction);
    vec3_normalize(to.direction);
    viewer_cut_between(&from, &to, width * model->voxel, side, &cut);
    return cut;
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

TEST a_saved_mesh_is_read_again(void)
{
    static const char *const names[] = {"saved.ply", "saved.obj", "saved.stl", "saved.glb"};
    struct viewer_model model = ball();
    for (int f = 0; f < 4; ++f) {
        struct mesh mesh;
        char error[MESH_TEXT];
        springls_mesh surface;
        ASSERT(viewer_save(&model, scratch(names[f])));
        ASSERT(mesh_read(scratch(names[f]), &mesh, error));
        ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(model.ctx, &surface));
        ASSERT_EQ((size_t)surface.vertex_count, mesh.vertex_count);
        ASSERT_EQ((size_t)surface.triangle_count, mesh.triangle_count);
        springls_mesh_free(model.ctx, &surface);
        mesh_free(&mesh);

        struct viewer_model again = {0};
        ASSERT(viewer_model_file(&again, &small, scratch(names[f])));
        ASSERT_IN_RANGE(measured(&model).volume, measured(&again).volume, 0.005 * measured(&model).volume);
        while (!viewer_model_at_rest(&again)) ASSERT(viewer_model_rest_step(&again));
        ASSERT_IN_RANGE(measured(&model).volume, measured(&again).volume, 0.005 * measured(&model).volume);
        viewer_model_free(&again);
    }
    ASSERT_FALSE(viewer_save(&model, scratch("saved.txt")));
    ASSERT(strstr(model.error, ".ply, .obj, .stl or .glb"));
    const uint64_t hash = springls_state_hash(model.ctx);
    ASSERT_FALSE(viewer_model_file(&model, &small, scratch("not there.ply"))); /* leaves what is there */
    ASSERT_EQ(hash, springls_state_hash(model.ctx));
    viewer_model_free(&model);
    PASS();
}

/* ---- events ---- */

static struct viewer_app app_with_ball(void)
{
    const springls_desc desc = {.grid = {.size = {40, 40, 40}}};
    struct viewer_app app;
    memset(&app, 0, sizeof app);
    app.save = "viewer.ply";
    viewer_app_open(&app, &desc, 400, 300);
    return app;
}

static bool write_text(const char *name, const char *text)
{
    FILE *file = fopen(scratch(name), "w");
    if (!file) return false;
    fputs(text, file);
    return fclose(file) == 0;
}

static bool play(struct viewer_app *app, const char *events, char error[VIEWER_TEXT])
{
    error[0] = '\0';
    return write_text("events.txt", events) && viewer_script_run(scratch("events.txt"), app, NULL, NULL, error);
}

TEST the_pointer_pushes_and_drags(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    const double before = measured(&app.model).volume;
    ASSERT(play(&app, "key 2\nmove 200 150\nscroll 5 ctrl\npress left\nframes 20\nrelease left\nrest\n", error));
    ASSERT_FALSE(viewer_app_busy(&app));
    const double dented = measured(&app.model).volume;
    ASSERT(dented < before - 0.01);
    const uint64_t hash = springls_state_hash(app.model.ctx);
    ASSERT(play(&app, "frames 3\nmove 210 150\nscroll 1\nkey v\n", error)); /* at rest nothing is computed */
    ASSERT_EQ(hash, springls_state_hash(app.model.ctx));
    ASSERT_EQ(VIEWER_SPRINGLS, app.view);
    ASSERT(play(&app, "scroll -1\npress left shift\nframes 20\nrelease left\nrest\n", error));
    ASSERT(measured(&app.model).volume > dented + 0.01);

    struct viewer_ray ray = viewer_camera_ray(&app.camera, 200.0f, 50.0f, 400, 300);
    struct viewer_brush spot;
    ASSERT_FALSE(viewer_pick(&app.model, &ray, &spot));
    ASSERT(play(&app, "key 1\nmove 200 110\npress left\nmove 200 45 20\nframes 20\nrelease left\nrest\n", error));
    ASSERT(viewer_pick(&app.model, &ray, &spot)); /* the nose is under the pointer */
    viewer_app_close(&app);
    PASS();
}

TEST the_pointer_turns_the_camera(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    const struct viewer_camera begin = app.camera;
    const uint64_t hash = springls_state_hash(app.model.ctx);
    ASSERT(play(&app, "key 2\nmove 5 295\npress left\nmove 55 295 3\nrelease left\n", error)); /* beside the body */
    ASSERT(app.camera.yaw < begin.yaw);
    ASSERT(play(&app, "press middle\nmove 55 200\nrelease middle\nscroll 2\n", error));
    ASSERT(app.camera.target[1] < begin.target[1] - 0.1f);
    ASSERT(app.camera.distance < begin.distance);
    ASSERT(play(&app, "key F\n", error));
    ASSERT_EQ(0, memcmp(&app.camera, &begin, sizeof begin));
    ASSERT_EQ(hash, springls_state_hash(app.model.ctx));
    viewer_app_close(&app);
    PASS();
}

TEST the_pointer_cuts_and_merges(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    ASSERT(play(&app, "key 5\nmove 20 150\npress left\nmove 380 160 4\nrelease left\nrest\n", error));
    ASSERT_EQ(2, measured(&app.model).components);
    ASSERT(play(&app, "key 6\nmove 200 110\nscroll 6 ctrl\npress left\nmove 200 150 5\nrelease left\n", error));
    ASSERT(app.second.ctx);
    ASSERT_EQ(2, measured(&app.model).components);
    ASSERT(play(&app, "key enter\nrest\n", error));
    ASSERT_FALSE(app.second.ctx);
    ASSERT_EQ(1, measured(&app.model).components);
    const uint64_t hash = springls_state_hash(app.model.ctx);
    ASSERT(play(&app, "press left\nrelease left\nkey escape\nkey enter\nrest\n", error)); /* thought better of it */
    ASSERT_EQ(hash, springls_state_hash(app.model.ctx));
    viewer_app_close(&app);
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

/* Keys change the brush; half the strength makes half the dent. A mask is painted, cleared, inverted and undone. */
TEST keys_set_brush_and_mask(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball(), weak = app_with_ball();
    static const char push[] = "key 2\nmove 200 150\nscroll 5 ctrl\npress left\nframes 10\nrelease left\nrest\n";
    const double before = measured(&app.model).volume;
    ASSERT(play(&weak, "key -\nkey -\nkey -\nkey -\nkey -\n", error));
    ASSERT_IN_RANGE(0.5f, weak.brush.strength, 1e-6f);
    ASSERT(play(&app, push, error) && play(&weak, push, error));
    const double dent = before - measured(&app.model).volume, half = before - measured(&weak.model).volume;
    ASSERT(half > 0.3 * dent && half < 0.7 * dent);
    for (int i = 0; i < 20; ++i) ASSERT(play(&weak, i < 12 ? "key -\n" : "key =\n", error));
    ASSERT_IN_RANGE(0.9f, weak.brush.strength, 1e-5f); /* from the least, a tenth */
    ASSERT(play(&weak, "key o\nkey x\nkey x\n", error));
    ASSERT_EQ(VIEWER_FALLOFF_POINTED, weak.brush.falloff);
    ASSERT_EQ(2, weak.brush.symmetry);
    ASSERT(play(&weak, "key o\nkey o\nkey x\nkey x\n", error));
    ASSERT_EQ(VIEWER_FALLOFF_SMOOTH, weak.brush.falloff);
    ASSERT_EQ(0, weak.brush.symmetry);
    viewer_app_close(&weak);

    const uint64_t bare = springls_state_hash(app.model.ctx);
    ASSERT(play(&app, "key 7\npress left\nframes 20\nrelease left\n", error));
    ASSERT(app.model.mask >= 0);
    const uint64_t masked = springls_state_hash(app.model.ctx);
    ASSERT(play(&app, "key 2\npress left shift\nframes 10\nrelease left\nrest\n", error));
    ASSERT_IN_RANGE(before - dent, measured(&app.model).volume, 0.1 * dent); /* the dent keeps its place */
    ASSERT(play(&app, "key Z ctrl\nkey i\nkey i\nkey c\n", error));
    ASSERT_EQ(-1, app.model.mask);
    ASSERT(play(&app, "key Z ctrl\nkey Z ctrl\nkey Z ctrl\n", error));
    ASSERT(app.model.mask >= 0);
    ASSERT_EQ(masked, springls_state_hash(app.model.ctx));
    ASSERT(play(&app, "key Z ctrl\n", error));
    ASSERT_EQ(-1, app.model.mask);
    ASSERT_EQ(bare, springls_state_hash(app.model.ctx));
    viewer_app_close(&app);
    PASS();
}

/* Opening a file, and beginning again, can be undone, in a grid of another size. */
TEST undo_goes_across_files(void)
{
    char error[VIEWER_TEXT], script[700];
    struct viewer_app app = app_with_ball();
    ASSERT(play(&app, "key 2\nmove 200 150\npress left\nframes 5\nrelease left\nrest\n", error));
    const uint64_t dented = springls_state_hash(app.model.ctx);
    const float voxel = app.model.voxel;
    const struct viewer_cut cut = stroke_across(&app.model, 3.0f, -2.0f, 2.0f, true);
    struct viewer_model half = ball();
    ASSERT(viewer_subtract(&half, &cut));
    ASSERT(viewer_save(&half, scratch("half.ply")));
    viewer_model_free(&half);
    snprintf(script, sizeof script, "drop %s\nrest\nkey 3\npress left ctrl\nframes 3\nrelease left\nrest\n", scratch("half.ply"));
    ASSERT(play(&app, script, error));
    const uint64_t grown = springls_state_hash(app.model.ctx);
    const float other = app.model.voxel;
    ASSERT(fabsf(other - voxel) > 1e-4f * voxel || grown != dented);
    ASSERT(play(&app, "key R\n", error));
    ASSERT(play(&app, "key Z ctrl\n", error));
    ASSERT_EQ(grown, springls_state_hash(app.model.ctx));
    ASSERT(play(&app, "key Z ctrl\nkey Z ctrl\n", error));
    ASSERT_EQ(dented, springls_state_hash(app.model.ctx));
    ASSERT_IN_RANGE(voxel, app.model.voxel, 0.0f);
    ASSERT(play(&app, "key Y ctrl\nkey Y ctrl\n", error));
    ASSERT_EQ(grown, springls_state_hash(app.model.ctx));
    ASSERT_IN_RANGE(other, app.model.voxel, 0.0f);
    const int states = app.history.count;
    ASSERT(play(&app, "drop /nowhere.obj\n", error)); /* a file that cannot be opened changes nothing */
    ASSERT_EQ(states, app.history.count);
    ASSERT(play(&app, "key 2\nmove 200 150\npress left\nframes 3\nrelease left\nrest\nkey Z ctrl\n", error)); /* tools work there */
    ASSERT_EQ(grown, springls_state_hash(app.model.ctx));
    viewer_app_close(&app);
    PASS();
}

/* A script ends where a file cannot be saved, by either event. */
TEST a_failed_save_ends_a_script(void)
{
    char error[VIEWER_TEXT], script[700];
    struct viewer_app app = app_with_ball();
    snprintf(script, sizeof script, "save %s\nkey 3\n", scratch("saved.glb"));
    ASSERT(play(&app, script, error));
    ASSERT_EQ(VIEWER_INFLATE, app.tool);
    ASSERT_FALSE(play(&app, "save /nowhere/a.ply\nkey 4\n", error));
    ASSERT(strstr(error, "/nowhere/a.ply"));
    ASSERT_FALSE(play(&app, "save a.txt\nkey 4\n", error));
    ASSERT(strstr(error, ".glb"));
    app.save = "/nowhere/b.stl";
    ASSERT_FALSE(play(&app, "key S ctrl\nkey 4\n", error));
    ASSERT(strstr(error, "/nowhere/b.stl"));
    ASSERT_EQ(VIEWER_INFLATE, app.tool); /* nothing after it was done */
    app.save = scratch("saved.stl");
    ASSERT(play(&app, "key S ctrl\nkey 4\n", error));
    ASSERT_EQ(VIEWER_SMOOTH, app.tool);
    viewer_app_close(&app);
    PASS();
}

TEST undo_restores_the_model_to_the_bit(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    uint64_t hash[4] = {springls_state_hash(app.model.ctx)};
    static const char *const changes[] = {"key 2\nmove 200 150\nscroll 5 ctrl\npress left\nframes 5\nrelease left\nrest\n",
                                          "key 5\nmove 20 150\npress left\nmove 380 160\nrelease left\nrest\n",
                                          "key 6\nmove 200 110\npress left\nrelease left\nkey enter\nrest\n"};
    for (int i = 0; i < 3; ++i) {
        ASSERT(play(&app, changes[i], error));
        hash[i + 1] = springls_state_hash(app.model.ctx);
        ASSERT(hash[i + 1] != hash[i]);
    }
    for (int i = 2; i >= 0; --i) {
        ASSERT(play(&app, "key Z ctrl\nframes 2\n", error));
        ASSERT_EQ(hash[i], springls_state_hash(app.model.ctx));
    }
    ASSERT(play(&app, "key Z ctrl\n", error));
    ASSERT(strstr(app.message, "nothing more"));
    for (int i = 1; i < 4; ++i) {
        ASSERT(play(&app, "key Y ctrl\nframes 2\n", error));
        ASSERT_EQ(hash[i], springls_state_hash(app.model.ctx));
    }
    ASSERT(play(&app, "key Y ctrl\n", error));
    ASSERT(strstr(app.message, "nothing more"));
    ASSERT(play(&app, "key Z ctrl\nkey Z ctrl\n", error));
    ASSERT(play(&app, changes[1], error)); /* the same again has the same result; what was undone is forgotten */
    ASSERT_EQ(hash[2], springls_state_hash(app.model.ctx));
    ASSERT(play(&app, "key Y ctrl\n", error));
    ASSERT_EQ(hash[2], springls_state_hash(app.model.ctx));
    viewer_app_close(&app);
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

/* Whatever comes while a step is in progress completes it first: undo, saving, a cut, the next tool. */
TEST a_step_in_progress_is_completed_first(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball(), other = app_with_ball();
    const uint64_t begin = springls_state_hash(app.model.ctx);
    static const char push[] = "key 2\nmove 200 150\nscroll 5 ctrl\npress left\nframes 1\n";
    ASSERT(play(&other, push, error));
    const uint64_t pushed = springls_state_hash(other.model.ctx);
    app.budget = 1e-6;
    ASSERT(play(&app, push, error));
    ASSERT(app.model.stepping);
    ASSERT(viewer_app_busy(&app));
    ASSERT(viewer_save(&app.model, scratch("midway.obj")));
    ASSERT_FALSE(app.model.stepping);
    ASSERT_EQ(pushed, springls_state_hash(app.model.ctx));
    ASSERT(play(&app, "frames 1\n", error)); /* another step */
    ASSERT(app.model.stepping);
    ASSERT(play(&app, "release left\nkey Z ctrl\n", error));
    ASSERT_FALSE(app.model.stepping);
    ASSERT_EQ(begin, springls_state_hash(app.model.ctx));
    ASSERT(play(&app, "key Y ctrl\nkey 2\npress left\nframes 2\n", error));
    ASSERT(app.model.stepping);
    ASSERT(play(&app, "release left\nkey 5\nmove 20 150\npress left\nmove 380 160\nrelease left\n", error));
    ASSERT_EQ(2, measured(&app.model).components);
    ASSERT(play(&app, "key 4\nmove 200 100\npress left ctrl\nframes 1\n", error));
    ASSERT(app.model.stepping);
    viewer_app_close(&app); /* leaks nothing */
    viewer_app_close(&other);
    PASS();
}

TEST a_script_that_is_wrong_is_refused(void)
{
    static const char *const wrong[] = {"jump 1 2\n", "move 1\n", "move 1 x\n", "press tail\n", "press left alt\n", "key\n",
                                        "frames 0\n", "move 1 2 3 4 5 6 7\n", "scroll nan\n", "screenshot\n"};
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
        ASSERT_FALSE(play(&app, wrong[i], error));
        ASSERT(strstr(error, "line 1"));
    }
    ASSERT_FALSE(viewer_script_run(scratch("none.txt"), &app, NULL, NULL, error));
    ASSERT(strstr(error, "cannot open"));
    ASSERT(play(&app, "# a remark\n\nkey 3 # another\n", error));
    ASSERT_EQ(VIEWER_INFLATE, app.tool);
    ASSERT(play(&app, "drop nowhere.obj\n", error)); /* shown in the window; the model stays */
    ASSERT(strstr(app.message, "nowhere.obj"));
    ASSERT(springls_count(app.model.ctx) > 0);
    viewer_app_close(&app);
    PASS();
}

/* A mesh of two colours keeps them, each on its side, and they are written. */
TEST colors_of_a_mesh_are_carried(void)
{
    char error[MESH_TEXT];
    struct viewer_model model = ball();
    springls_mesh surface;
    ASSERT_EQ(SPRINGLS_OK, springls_extract_mesh(model.ctx, &surface));
    float *colors = calloc(3 * (size_t)surface.vertex_count, sizeof *colors);
    for (int v = 0; v < surface.vertex_count; ++v) colors[3 * v + (surface.positions[3 * v] > 0.0f ? 0 : 2)] = 1.0f;
    const struct mesh_arrays ply = {.positions = surface.positions,
                                 .vertex_count = (size_t)surface.vertex_count,
                                 .indices = (const uint32_t *)surface.triangles,
                                 .triangle_count = (size_t)surface.triangle_count,
                                 .colors = colors};
    ASSERT(mesh_write_ply(scratch("painted.ply"), &ply, error));
    springls_mesh_free(model.ctx, &surface);
    free(colors);

    ASSERT(viewer_model_file(&model, &small, scratch("painted.ply")));
    const struct viewer_brush brush = front(&model);
    for (int i = 0; i < 8; ++i) ASSERT(viewer_push(&model, &brush, 0.02f));
    ASSERT(viewer_save(&model, scratch("painted.obj")));
    struct mesh again;
    ASSERT(mesh_read(scratch("painted.obj"), &again, error));
    ASSERT(again.colors);
    for (size_t v = 0; v < again.vertex_count; ++v) {
        const float x = again.positions[3 * v];
        if (fabsf(x) > 0.15f) ASSERT(again.colors[3 * v + (x > 0.0f ? 0 : 2)] > 0.9f);
    }
    mesh_free(&again);
    viewer_model_free(&model);
    PASS();
}

/* ---- pictures ---- */

static pid_t display; /* a virtual one; 0: there is none here */

/* Xvfb prints the number that it has chosen when it is ready. */
static void start_display(void)
{
    char number[16] = ":";
    int ends[2];
    if (pipe(ends) != 0) return;
    display = fork();
    if (display == 0) {
        char end[16];
        snprintf(end, sizeof end, "%d", ends[1]);
        if (!freopen("/dev/null", "w", stderr)) _exit(127);
        execlp("Xvfb", "Xvfb", "-displayfd", end, "-screen", "0", "800x600x24", "-nolisten", "tcp", (char *)NULL);
        _exit(127);
    }
    close(ends[1]);
    const ssize_t length = read(ends[0], number + 1, sizeof number - 2);
    close(ends[0]);
    if (length <= 0) {
        if (display > 0) waitpid(display, NULL, 0);
        display = 0;
        return;
    }
    number[1 + strcspn(number + 1, "\n")] = '\0';
    setenv("DISPLAY", number, 1);
}

static void stop_display(void)
{
    if (display > 0) {
        kill(display, SIGTERM);
        waitpid(display, NULL, 0);
    }
}

/* The program's status; its one line on stderr goes into a file. */
static int run_viewer(const char *const *arguments)
{
    int count = 0;
    while (arguments[count]) ++count;
    fflush(stderr);
    const int keep = dup(STDERR_FILENO);
    char said[512];
    snprintf(said, sizeof said, "%s/stderr", folder);
    if (!freopen(said, "w", stderr)) return -99;
    DRIVER_BEGIN;
    const int status = viewer_main(count, (char **)(uintptr_t)arguments);
    DRIVER_END;
    fflush(stderr);
    dup2(keep, STDERR_FILENO);
    close(keep);
    return status;
}

static int lines_said(void)
{
    int lines = 0;
    FILE *file = fopen(scratch("stderr"), "r");
    for (int c; file && (c = getc(file)) != EOF;) lines += c == '\n';
    if (file) fclose(file);
    return lines;
}

enum { WIDE = 480, HIGH = 360 };
typedef unsigned char pixels[HIGH][WIDE][3];

static bool read_picture(const char *name, pixels picture)
{
    int width = 0, height = 0, channels = 0;
    unsigned char *data = stbi_load(scratch(name), &width, &height, &channels, 3);
    const bool good = data && width == WIDE && height == HIGH;
    if (good) memcpy(picture, data, sizeof(pixels));
    stbi_image_free(data);
    return good;
}

static int difference(const unsigned char *a, const unsigned char *b)
{
    return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]);
}

/* How many pixels differ. */
static int changed(pixels a, pixels b)
{
    int count = 0;
    for (int y = 0; y < HIGH; ++y)
        for (int x = 0; x < WIDE; ++x) count += difference(a[y][x], b[y][x]) > 24;
    return count;
}

TEST pictures_show_what_there_is(void)
{
    static pixels whole, dent, springls, texture, wires, masked, help;
    char script[2048];
    if (!display) SKIP();
    snprintf(script, sizeof script,
             "screenshot %s/whole.png\nkey 2\nmove 240 180\nscroll 5 ctrl\npress left\nframes 20\nrelease left\nmove 5 355\nrest\n"
             "screenshot %s/dent.png\nkey V\nscreenshot %s/springls.png\nkey V\nscreenshot %s/texture.png\n"
             "key V\nscreenshot %s/wires.png\nkey V\nkey 7\nmove 240 180\npress left\nframes 20\nrelease left\nmove 5 355\n"
             "screenshot %s/masked.png\nkey H\n",
             folder, folder, folder, folder, folder, folder);
    ASSERT(write_text("events.txt", script));
    char events[512], last[512];
    snprintf(events, sizeof events, "%s", scratch("events.txt"));
    snprintf(last, sizeof last, "%s", scratch("help.png"));
    const char *const arguments[] = {"viewer", "--grid",   "40",   "--width",      "480", "--height",
                                     "360",    "--script", events, "--screenshot", last,  NULL};
    const int status = run_viewer(arguments);
    if (status == CLI_EXIT_FAILURE && strstr(trouble, "GL")) SKIP(); /* a display without OpenGL 3.3 */
    ASSERT_EQ(CLI_EXIT_OK, status);
    ASSERT(read_picture("whole.png", whole) && read_picture("dent.png", dent) && read_picture("springls.png", springls));
    ASSERT(read_picture("texture.png", texture) && read_picture("wires.png", wires) && read_picture("help.png", help));

    const unsigned char *background = whole[HIGH - 1][0];
    ASSERT(background[0] > 200 && background[1] > 200 && background[2] > 200);
    ASSERT(difference(background, whole[0][WIDE - 1]) < 4 && difference(background, whole[HIGH - 1][WIDE - 1]) < 4);
    int body = 0, stripes = 0; /* the body is one piece in the middle: every row enters and leaves it once */
    for (int y = HIGH / 2; y < HIGH; ++y) {
        int edges = 0;
        for (int x = 1; x < WIDE; ++x) {
            const bool here = difference(whole[y][x], background) > 40, before = difference(whole[y][x - 1], background) > 40;
            body += here;
            edges += here != before;
        }
        stripes += edges != 0 && edges != 2;
    }
    ASSERT_EQ(0, stripes);
    ASSERT(body > WIDE * HIGH / 16 && body < WIDE * HIGH / 3);
    ASSERT(difference(whole[HIGH / 2][WIDE / 2], background) > 60);

    const int dented = changed(whole, dent);
    ASSERT(dented > 200 && dented < body); /* the dent and nothing else */
    ASSERT(difference(dent[HIGH - 1][0], background) < 4);
    ASSERT(changed(dent, springls) > 2000);
    ASSERT(changed(dent, texture) > 2000);
    ASSERT(changed(dent, wires) > 2000);
    ASSERT(read_picture("masked.png", masked)); /* dark where the brush was, and nowhere else */
    ASSERT(masked[HIGH / 2][WIDE / 2][1] < 0.6 * dent[HIGH / 2][WIDE / 2][1]);
    ASSERT(changed(dent, masked) > 200);
    ASSERT(difference(masked[HIGH * 3 / 4][WIDE / 2], dent[HIGH * 3 / 4][WIDE / 2]) < 24);
    ASSERT(changed(dent, help) > 2000); /* the manual's panel */
    int colored = 0;
    for (int y = 0; y < HIGH; ++y)
        for (int x = 0; x < WIDE; ++x)
            colored += abs(texture[y][x][0] - texture[y][x][1]) + abs(texture[y][x][1] - texture[y][x][2]) > 90;
    ASSERT(colored > 2000);
    PASS();
}

TEST what_cannot_be_shown_ends_with_one_line(void)
{
    const char *const nowhere[] = {"viewer", "--grid", "16", "--screenshot", "/nowhere/at all.png", NULL};
    const char *const no_script[] = {"viewer", "--grid", "16", "--screenshot", "x.png", "--script", "/nowhere.txt", NULL};
    const char *const no_mesh[] = {"viewer", "/nowhere.obj", NULL}, *const usage[] = {"viewer", "--width", "0", NULL};
    ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_mesh));
    ASSERT_EQ(1, lines_said());
    ASSERT_EQ(CLI_EXIT_USAGE, run_viewer(usage));
    ASSERT_EQ(1, lines_said());
    if (display) {
        ASSERT(write_text("save.txt", "save /nowhere/a.ply\n"));
        char script[512];
        snprintf(script, sizeof script, "%s", scratch("save.txt"));
        const char *const no_save[] = {"viewer", "--grid", "16", "--screenshot", "x.png", "--script", script, NULL};
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_save));
        ASSERT_EQ(1, lines_said());
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(nowhere));
        ASSERT_EQ(1, lines_said());
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_script));
        ASSERT_EQ(1, lines_said());
    }
    char *kept = getenv("DISPLAY") ? strdup(getenv("DISPLAY")) : NULL; /* without a display */
    unsetenv("DISPLAY");
    ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(nowhere));
    ASSERT_EQ(1, lines_said());
    ASSERT(*trouble);
    if (kept) setenv("DISPLAY", kept, 1);
    free(kept);
    PASS();
}

int main(int argc, char **argv)
{
    char command[300];
    GREATEST_MAIN_BEGIN();
    snprintf(folder, sizeof folder, "/tmp/springls_viewer_XXXXXX");
    if (!mkdtemp(folder)) return 1;
    RUN_TEST(a_ray_finds_the_surface);
    RUN_TEST(drag_moves_its_region_and_not_the_rest);
    RUN_TEST(push_makes_a_dent_or_a_bump);
    RUN_TEST(inflate_grows_and_deflate_shrinks);
    RUN_TEST(smooth_levels_a_bump);
    RUN_TEST(cut_makes_two_and_merge_one);
    RUN_TEST(a_saved_mesh_is_read_again);
    RUN_TEST(colors_of_a_mesh_are_carried);
    RUN_TEST(the_pointer_pushes_and_drags);
    RUN_TEST(the_pointer_turns_the_camera);
    RUN_TEST(the_pointer_cuts_and_merges);
    RUN_TEST(symmetry_doubles_the_brush);
    RUN_TEST(falloff_shapes_a_bump);
    RUN_TEST(what_is_masked_stays);
    RUN_TEST(the_grid_has_room_for_a_body_that_grows);
    RUN_TEST(keys_set_brush_and_mask);
    RUN_TEST(undo_goes_across_files);
    RUN_TEST(a_failed_save_ends_a_script);
    RUN_TEST(undo_restores_the_model_to_the_bit);
    RUN_TEST(tools_go_with_a_grid_that_moves);
    RUN_TEST(steps_and_chunks_come_in_pieces);
    RUN_TEST(a_step_in_progress_is_completed_first);
    RUN_TEST(a_script_that_is_wrong_is_refused);
    start_display();
    RUN_TEST(pictures_show_what_there_is);
    RUN_TEST(what_cannot_be_shown_ends_with_one_line);
    stop_display();
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    if (system(command) != 0) return 1;
    GREATEST_MAIN_END();
}

#endif
