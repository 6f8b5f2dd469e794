/* Events of examples/viewer, played from scripts without a window: the pointer, keys, undo, and scripts that are wrong. Compiled
 * like test_common.c, else skipped. */
#define _POSIX_C_SOURCE 200809L

#include "greatest.h"

GREATEST_MAIN_DEFS();

#ifndef TEST_EXAMPLES_COMMON

TEST examples_viewer_events_built_without_their_libraries(void) { SKIP(); }

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    RUN_TEST(examples_viewer_events_built_without_their_libraries);
    GREATEST_MAIN_END();
}

#else

#include "viewer/file.h"

#include "viewer_fixtures.h"

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
    ASSERT(viewer_save(&half, scratch("half.ply"), 0));
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
    ASSERT_FALSE(play(&app, "drop /nowhere.obj\n", error)); /* a file that cannot be opened changes nothing */
    ASSERT_EQ(states, app.history.count);
    ASSERT(play(&app, "key 2\nmove 200 150\npress left\nframes 3\nrelease left\nrest\nkey Z ctrl\n", error)); /* tools work there */
    ASSERT_EQ(grown, springls_state_hash(app.model.ctx));
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

/* ---- each tool after each other ---- */

/* A stroke of each tool: the way there, and the work, of which the first frame changes the body. They are away from each other: a
 * cut leaves nothing to hold where it was. */
static const char *const strokes[VIEWER_TOOLS][2] = {
    {"key 1\nmove 175 165\npress left\n", "move 160 190 3\nrelease left\n"},
    {"key 2\nmove 215 175\n", "press left\nframes 2\nrelease left\n"},
    {"key 3\nmove 190 190\n", "press left\nframes 2\nrelease left\n"},
    {"key 4\nmove 225 160\n", "press left\nframes 2\nrelease left\n"},
    {"key 5\nmove 20 128\npress left\nmove 380 132\n", "release left\n"},
    {"key 6\nmove 235 175\npress left\nmove 240 180\nrelease left\n", "key enter\n"},
    {"key 7\nmove 200 180\n", "press left\nframes 2\nrelease left\n"},
};

static bool memory_is_short;

/* New memory is never 0, as in a program that has run for a while: what is read before it is written shows. */
static void *allocate_filled(size_t size, void *user)
{
    void *memory = memory_is_short ? NULL : malloc(size);
    (void)user;
    return memory ? memset(memory, 0x77, size) : NULL;
}

static void release_filled(void *memory, size_t size, void *user)
{
    (void)user;
    memset(memory, 0xff, size);
    free(memory);
}

/* A ball with two ears and a snout. */
static greatest_test_res open_bear(struct viewer_app *app, int grid)
{
    char error[VIEWER_TEXT];
    const springls_desc desc = {.grid = {.size = {grid, grid, grid}}, .allocator = {allocate_filled, release_filled, NULL}};
    memset(app, 0, sizeof *app);
    ASSERT(viewer_app_open(app, &desc, 400, 300));
    ASSERT(play(app,
                "key 6\nscroll 3 ctrl\nmove 160 110\npress left\nmove 155 103\nrelease left\nkey enter\nrest\n"
                "move 240 110\npress left\nmove 245 103\nrelease left\nkey enter\nrest\n"
                "move 200 160\npress left\nrelease left\nkey enter\nrest\nscroll -2 ctrl\n",
                error));
    ASSERT_EQ(3, app->history.count);
    PASS();
}

/* Hashes the model and its mask, which the library's hash leaves out. */
static uint64_t whole_hash(struct viewer_app *app)
{
    const springls_view mask = springls_view_attribute(app->model.ctx, app->model.mask);
    uint64_t hash = springls_state_hash(app->model.ctx);
    for (int i = 0; app->model.mask >= 0 && i < mask.count; ++i) {
        float value = viewer_model_mask_of(&mask, i);
        uint32_t bits;
        memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x100000001b3u;
    }
    return hash;
}

/* Two strokes, undone and redone one by one, have the same bits each time; then both are undone. `then`: events after each. */
static greatest_test_res undo_and_redo(struct viewer_app *app, int first, int second, const char *then)
{
    static char names[64];
    char error[VIEWER_TEXT];
    const int two[] = {first, second};
    uint64_t hash[3]; /* before each stroke, and after both */
    snprintf(names, sizeof names, "%s, then %s; %.4s", viewer_tool_names[first], viewer_tool_names[second], then);
    for (int i = 0; i < 2; ++i) {
        ASSERTm(names, play(app, strokes[two[i]][0], error));
        hash[i] = whole_hash(app);
        ASSERTm(names, play(app, strokes[two[i]][1], error) && play(app, then, error));
        hash[i + 1] = whole_hash(app);
        ASSERTm(names, hash[i + 1] != hash[i]);
    }
    for (int round = 0; round < 2; ++round) {
        for (int i = 1; i >= 0; --i) {
            ASSERTm(names, play(app, "key Z ctrl\n", error));
            ASSERT_STR_EQm(names, "undone", app->message);
            ASSERT_EQm(names, hash[i], whole_hash(app));
        }
        for (int i = 1; i < 3 && round == 0; ++i) {
            ASSERTm(names, play(app, "key Y ctrl\n", error));
            ASSERT_STR_EQm(names, "redone", app->message);
            ASSERT_EQm(names, hash[i], whole_hash(app));
        }
    }
    PASS();
}

TEST each_two_strokes_are_undone_and_redone(void)
{
    struct viewer_app app;
    CHECK_CALL(open_bear(&app, 32));
    for (int first = 0; first < VIEWER_TOOLS; ++first)
        for (int second = 0; second < VIEWER_TOOLS; ++second)
            if (first != second) CHECK_CALL(undo_and_redo(&app, first, second, first < second ? "" : "rest\n"));
    viewer_app_close(&app);
    PASS();
}

TEST strokes_on_a_fine_grid_are_undone_and_redone(void)
{
    struct viewer_app app;
    CHECK_CALL(open_bear(&app, 96));
    CHECK_CALL(undo_and_redo(&app, VIEWER_DRAG, VIEWER_PUSH, ""));
    CHECK_CALL(undo_and_redo(&app, VIEWER_SMOOTH, VIEWER_CUT, "rest\n"));
    viewer_app_close(&app);
    PASS();
}

/* ---- many strokes ---- */

enum { MANY = 100 };

/* A random number from 0 to below n. */
static int chance(unsigned *seed, int n)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (int)(*seed >> 16) % n;
}

/* Writes the events of a stroke by any tool, somewhere in the window: with other brushes, symmetry and falloff, in steps that the next
 * stroke may interrupt. */
static void random_stroke(unsigned *seed, char text[512])
{
    static const char *const before[] = {"", "key x\n", "key F\n", "scroll 1 ctrl\n", "scroll -1 ctrl\n", "key [\n", "key ]\n"};
    const int tool = chance(seed, VIEWER_TOOLS), x = 100 + chance(seed, 200), y = 60 + chance(seed, 180), frames = 1 + chance(seed, 4);
    const int dx = chance(seed, 81) - 40, dy = chance(seed, 81) - 40;
    snprintf(text, 512, "key %d\n%smove %d %d\npress left%s\nmove %d %d %d\nframes %d\nrelease left\n%s%s", tool + 1,
             before[chance(seed, 7)], x, y, chance(seed, 3) ? "" : " shift", x + dx, y + dy, frames, frames,
             tool == VIEWER_MERGE ? "key enter\n" : "", chance(seed, 2) ? "rest\n" : "");
}

/* Undoes as far as there is something to undo, or redoes to the end: each state has the bits that it had. */
static greatest_test_res walk(struct viewer_app *app, const char *name, const uint64_t *hash, int from, int to)
{
    char error[VIEWER_TEXT];
    const int step = to > from ? 1 : -1;
    for (int i = from + step; i != to + step; i += step) {
        ASSERTm(name, play(app, step > 0 ? "key Y ctrl\n" : "key Z ctrl\n", error));
        ASSERT_STR_EQm(name, step > 0 ? "redone" : "undone", app->message);
        ASSERT_EQm(name, hash[i], whole_hash(app));
    }
    PASS();
}

static greatest_test_res stroke_often(const char *name, const char *path, int grid)
{
    static uint64_t hash[MANY + 1];
    const springls_desc desc = {.grid = {.size = {grid, grid, grid}}};
    struct viewer_app app;
    char text[512], error[VIEWER_TEXT];
    unsigned seed = 7;
    int states = 0;
    memset(&app, 0, sizeof app);
    app.load = path;
    for (const char *c = name; *c; ++c) seed = 31u * seed + (unsigned char)*c;
    ASSERTm(name, viewer_app_open(&app, &desc, 400, 300) && play(&app, "rest\n", error)); /* as the first stroke finds it */
    hash[0] = whole_hash(&app);
    for (int k = 0; k < MANY; ++k) {
        const int before = app.history.at;
        random_stroke(&seed, text);
        ASSERTm(name, play(&app, text, error) && play(&app, "rest\n", error));
        ASSERTm(name, app.history.at == before || app.history.at == before + 1);
        states = app.history.at; /* a stroke beside the body, or a cut that is refused, changes nothing */
        hash[states] = whole_hash(&app);
    }
    ASSERT_GTm(name, states, MANY / 4);
    CHECK_CALL(walk(&app, name, hash, states, 0));
    ASSERTm(name, play(&app, "key Z ctrl\n", error) && strstr(app.message, "nothing more"));
    CHECK_CALL(walk(&app, name, hash, 0, states));
    viewer_app_close(&app);
    PASS();
}

TEST a_hundred_strokes_are_undone_and_redone(void)
{
    CHECK_CALL(stroke_often("a ball", NULL, 24));
    PASS();
}

TEST a_hundred_strokes_on_each_mesh_are_undone_and_redone(void)
{
    static const char *const names[] = {"armadillo.off", "bones.off", "bull.off", "knot1.off", "spot.obj"};
    const char *data = getenv("SPRINGLS_DATA");
    if (!data) SKIPm("SPRINGLS_DATA is not set");
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i) {
        char path[1024];
        snprintf(path, sizeof path, "%s/meshes/%s", data, names[i]);
        CHECK_CALL(stroke_often(names[i], path, 32));
    }
    PASS();
}

/* Undo that fails says so and leaves the body and all states as they were: so it can be tried again. */
TEST undo_that_fails_loses_nothing(void)
{
    char error[VIEWER_TEXT], script[700];
    struct viewer_app app;
    CHECK_CALL(open_bear(&app, 24));
    ASSERT(viewer_save(&app.model, scratch("bear.ply"), 0));
    const uint64_t bear = whole_hash(&app);
    snprintf(script, sizeof script, "key 1\ndrop %s\n", scratch("bear.ply"));
    ASSERT(play(&app, script, error)); /* undone in another grid, which takes memory */
    ASSERT(play(&app, strokes[VIEWER_PUSH][0], error) && play(&app, strokes[VIEWER_PUSH][1], error));
    ASSERT(play(&app, "key Z ctrl\n", error));
    const uint64_t before = whole_hash(&app);
    const int count = app.history.count, at = app.history.at;
    memory_is_short = true;
    ASSERT(play(&app, "key Z ctrl\n", error));
    memory_is_short = false;
    ASSERT(strstr(app.message, "not undone: "));
    ASSERT_EQ(before, whole_hash(&app));
    ASSERT(app.history.count == count && app.history.at == at);

    unsigned char *damaged = (unsigned char *)app.history.states[at - 1].block + app.history.states[at - 1].size / 2;
    *damaged ^= 1;
    ASSERT(play(&app, "key Z ctrl\n", error));
    *damaged ^= 1;
    ASSERT(strstr(app.message, "not undone: "));
    ASSERT_EQ(before, whole_hash(&app));
    ASSERT(play(&app, "key Y ctrl\n", error));
    ASSERT_STR_EQ("redone", app.message);
    ASSERT(play(&app, "key Z ctrl\nkey Z ctrl\n", error));
    ASSERT_STR_EQ("undone", app.message);
    ASSERT_EQ(bear, whole_hash(&app));
    viewer_app_close(&app);
    PASS();
}

/* A cut that leaves nothing is reverted, and cannot be redone. */
TEST a_failed_change_is_reverted(void)
{
    char error[VIEWER_TEXT];
    struct viewer_app app = app_with_ball();
    const uint64_t hash = whole_hash(&app);
    ASSERT(play(&app, "key 5\nmove 20 5\npress left shift\nmove 380 5\nrelease left\n", error)); /* all of the body is right of it */
    ASSERT(*app.message);
    ASSERT_EQ(hash, whole_hash(&app));
    ASSERT_EQ(0, app.history.count);
    ASSERT(play(&app, "key Y ctrl\n", error));
    ASSERT_STR_EQ("nothing more", app.message);
    ASSERT_EQ(hash, whole_hash(&app));
    viewer_app_close(&app);
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
    ASSERT(viewer_save(&app.model, scratch("midway.obj"), 0));
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
    FILE *file = fopen(scratch("zero.txt"), "wb");
    ASSERT(file && fwrite("key 3\n\0key 4\n", 1, 13, file) == 13 && fclose(file) == 0);
    ASSERT_FALSE(viewer_script_run(scratch("zero.txt"), &app, NULL, NULL, error));
    ASSERT(strstr(error, "line 2") && strstr(error, "a byte of 0"));
    ASSERT_EQ(VIEWER_INFLATE, app.tool);
    ASSERT_FALSE(viewer_script_run(scratch("none.txt"), &app, NULL, NULL, error));
    ASSERT(strstr(error, "cannot open"));
    ASSERT(play(&app, "# a remark\n\nkey 3 # another\n", error));
    ASSERT_EQ(VIEWER_INFLATE, app.tool);
    ASSERT_FALSE(play(&app, "drop nowhere.obj\n", error)); /* the model stays */
    ASSERT(strstr(error, "nowhere.obj: cannot open"));
    ASSERT(springls_count(app.model.ctx) > 0);
    viewer_app_close(&app);
    PASS();
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(the_pointer_pushes_and_drags);
    RUN_TEST(the_pointer_turns_the_camera);
    RUN_TEST(the_pointer_cuts_and_merges);
    RUN_TEST(keys_set_brush_and_mask);
    RUN_TEST(undo_goes_across_files);
    RUN_TEST(undo_restores_the_model_to_the_bit);
    RUN_TEST(each_two_strokes_are_undone_and_redone);
    RUN_TEST(strokes_on_a_fine_grid_are_undone_and_redone);
    RUN_TEST(a_hundred_strokes_are_undone_and_redone);
    RUN_TEST(a_hundred_strokes_on_each_mesh_are_undone_and_redone);
    RUN_TEST(undo_that_fails_loses_nothing);
    RUN_TEST(a_failed_change_is_reverted);
    RUN_TEST(a_step_in_progress_is_completed_first);
    RUN_TEST(a_failed_save_ends_a_script);
    RUN_TEST(a_script_that_is_wrong_is_refused);
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
