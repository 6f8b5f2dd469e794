/* examples/viewer.c: tools on a model without a window. Compiled like test_examples_common.c, else skipped. */
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

#define SPRINGLS_IMPLEMENTATION
#include "springls_cl.h"

#include "../examples/common/vec3.h"
#include "../examples/common/viewer_camera.c"
#include "../examples/common/viewer_file.c"
#define fail viewer_model_fail
#include "../examples/common/viewer_model.c"
#undef fail
#include "../examples/common/viewer_solid.c"
#include "../examples/common/viewer_tools.c"

#include <unistd.h>

static char folder[256]; /* scratch, made by main */

static const char *scratch(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

/* A ball of radius 1 in a grid of 48^3. */
static struct viewer_model ball(void)
{
    const springls_desc desc = {.grid = {.size = {48, 48, 48}}};
    struct viewer_model model = {0};
    viewer_model_ball(&model, &desc);
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
    springls_closest(model.ctx, brush.center, 1, &hit);
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

/* A bump grows lower in the brush; without a brush the ball shrinks as motion by curvature says: dR/dt = -2 / R. */
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
    const float voxels = 1.0f / model.voxel, expected = sqrtf(voxels * voxels - 4.0f * 20.0f * MOST_SMOOTHING) * model.voxel;
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
    cut = stroke_across(&model, 3.0f, -2.0f, 2.0f, false);
    ASSERT(viewer_subtract(&model, &cut));
    ASSERT_EQ(2, measured(&model).components);
    ASSERT_IN_RANGE(before - 3.14159265 * 3.0 * (double)model.voxel, measured(&model).volume, 0.01 * before);

    const float middle[3] = {0.0f, 0.0f, 0.0f}, offset[3] = {0.0f, 0.0f, 0.5f};
    struct viewer_model second = {0};
    ASSERT(viewer_model_second_ball(&second, &model, middle, 0.5f));
    ASSERT(viewer_merge(&model, &second, offset));
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
    static const char *const names[] = {"saved.ply", "saved.obj"};
    struct viewer_model model = ball();
    for (int f = 0; f < 2; ++f) {
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
        ASSERT(viewer_model_file(&again, &model.desc, scratch(names[f])));
        ASSERT_IN_RANGE(measured(&model).volume, measured(&again).volume, 0.005);
        while (!viewer_model_at_rest(&again)) ASSERT(viewer_model_settle(&again));
        ASSERT_IN_RANGE(measured(&model).volume, measured(&again).volume, 0.005 * measured(&model).volume);
        viewer_model_free(&again);
    }
    ASSERT_FALSE(viewer_save(&model, scratch("saved.txt")));
    ASSERT(strstr(model.error, ".ply or .obj"));
    const uint64_t hash = springls_state_hash(model.ctx);
    ASSERT_FALSE(viewer_model_file(&model, &model.desc, scratch("not there.ply"))); /* leaves what is there */
    ASSERT_EQ(hash, springls_state_hash(model.ctx));
    viewer_model_free(&model);
    PASS();
}

int main(int argc, char **argv)
{
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
    GREATEST_MAIN_END();
}

#endif
