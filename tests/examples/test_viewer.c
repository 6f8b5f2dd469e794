/* examples/viewer.c: the files that it reads and writes, and its pictures: without a display, and in a window on a virtual one,
 * where there is one. What it stands on: test_viewer_tools.c, test_viewer_events.c. Compiled like test_common.c, else skipped. */
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

#define main viewer_main
#include "../../examples/viewer/viewer.c"
#undef main
#include "../../examples/viewer/window.c"

#include "surface/mesh_io.h"
#include "viewer/file.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "viewer_fixtures.h"

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

/* ---- files ---- */

TEST a_saved_mesh_is_read_again(void)
{
    static const char *const names[] = {"saved.ply", "saved.obj", "saved.stl", "saved.glb"};
    struct viewer_model model = ball();
    for (int f = 0; f < 4; ++f) {
        struct mesh mesh;
        char error[MESH_TEXT];
        springls_mesh surface;
        ASSERT(viewer_save(&model, scratch(names[f]), 0));
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
    ASSERT_FALSE(viewer_save(&model, scratch("saved.txt"), 0));
    ASSERT(strstr(model.error, ".ply, .obj, .stl or .glb"));
    const uint64_t hash = springls_state_hash(model.ctx);
    ASSERT_FALSE(viewer_model_file(&model, &small, scratch("not there.ply"))); /* leaves what is there */
    ASSERT_EQ(hash, springls_state_hash(model.ctx));
    viewer_model_free(&model);
    PASS();
}

/* Returns the first PNG in a file, decoded. */
static bool picture_within(const char *path, struct image *image)
{
    static unsigned char bytes[1 << 22];
    FILE *file = fopen(path, "rb");
    const size_t size = file ? fread(bytes, 1, sizeof bytes, file) : 0;
    size_t at = 0;
    if (file) fclose(file);
    while (at + 4 < size && memcmp(bytes + at, "\x89PNG", 4) != 0) ++at;
    return at + 4 < size && image_read(bytes + at, size - at, image);
}

/* Saves a body that is blue and red with its colours in an image. */
static greatest_test_res save_texture(struct viewer_model *model)
{
    struct mesh mesh;
    struct image image;
    char error[MESH_TEXT];
    int red = 0, blue = 0;
    ASSERT(viewer_save(model, scratch("textured.glb"), 256));
    ASSERT(mesh_read(scratch("textured.glb"), &mesh, error));
    ASSERT_GT(mesh.triangle_count, 100);
    mesh_free(&mesh);
    ASSERT(picture_within(scratch("textured.glb"), &image));
    ASSERT_EQ(256, image.width);
    for (int i = 0; i < image.width * image.height; ++i) {
        red += image.rgb[3 * i] > 0.9f && image.rgb[3 * i + 2] < 0.1f;
        blue += image.rgb[3 * i + 2] > 0.9f && image.rgb[3 * i] < 0.1f;
    }
    image_free(&image);
    ASSERT_GT(red, 5000);
    ASSERT_GT(blue, 5000);
    ASSERT_FALSE(viewer_save(model, scratch("textured.ply"), 256));
    ASSERT(strstr(model->error, "GLB only"));
    ASSERT_FALSE(viewer_save(model, scratch("textured.glb"), 4));
    ASSERT(strstr(model->error, "too small"));
    PASS();
}

TEST a_texture_wants_colors(void)
{
    struct viewer_model model = ball();
    ASSERT_FALSE(viewer_save(&model, scratch("plain.glb"), 256));
    ASSERT(strstr(model.error, "no colours"));
    viewer_model_free(&model);
    PASS();
}

/* A mesh of two colours keeps them, each on its side, and they are written: at vertices, and as a texture. */
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
    ASSERT(viewer_save(&model, scratch("painted.obj"), 0));
    struct mesh again;
    ASSERT(mesh_read(scratch("painted.obj"), &again, error));
    ASSERT(again.colors);
    for (size_t v = 0; v < again.vertex_count; ++v) {
        const float x = again.positions[3 * v];
        if (fabsf(x) > 0.15f) ASSERT(again.colors[3 * v + (x > 0.0f ? 0 : 2)] > 0.9f);
    }
    mesh_free(&again);
    CHECK_CALL(save_texture(&model));
    viewer_model_free(&model);
    PASS();
}

/* ---- pictures ---- */

static bool can_draw; /* without a display */
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

static bool said(const char *text)
{
    char line[512] = "";
    FILE *file = fopen(scratch("stderr"), "r");
    if (file) {
        line[fread(line, 1, sizeof line - 1, file)] = '\0';
        fclose(file);
    }
    return strstr(line, text) != NULL;
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
    if (!can_draw) SKIPm("there is no OpenGL 3.3 by EGL");
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
    ASSERT_EQ(CLI_EXIT_OK, run_viewer(arguments));
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

/* Triangles at the outline have smooth normals that face away; they are lit as the outside, not darkened as the inside. */
TEST coarse_bodies_have_no_dark_outline(void)
{
    static pixels coarse;
    char path[512];
    if (!can_draw) SKIPm("there is no OpenGL 3.3 by EGL");
    snprintf(path, sizeof path, "%s", scratch("coarse.png"));
    const char *const arguments[] = {"viewer", "--grid", "8", "--width", "480", "--height", "360", "--screenshot", path, NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_viewer(arguments));
    ASSERT(read_picture("coarse.png", coarse));
    int darkest = 255;
    for (int y = HIGH / 4; y < HIGH; ++y) /* below the panel */
        for (int x = 0; x < WIDE; ++x) darkest = coarse[y][x][0] < darkest ? coarse[y][x][0] : darkest;
    ASSERT_GTE(darkest, 38); /* without a light: 0.26 of the clay's red, 41 */
    PASS();
}

/* One body, near by, fills most of the picture, and nothing is beyond half a pixel. */
TEST a_flight_draws_levels_of_detail(void)
{
    static pixels seen;
    char path[512], json[512], text[4096];
    if (!can_draw) SKIPm("there is no OpenGL 3.3 by EGL");
    snprintf(path, sizeof path, "%s", scratch("fly.png"));
    snprintf(json, sizeof json, "%s", scratch("fly.json"));
    const char *const arguments[] = {"viewer", "--fly", "6", "--grid", "128", "--width", "480", "--height", "360", "--screenshot", path,
                                     "--json", json, NULL};
    ASSERT_EQ(CLI_EXIT_OK, run_viewer(arguments));
    ASSERT(read_picture("fly.png", seen));
    int body = 0;
    for (int y = 0; y < HIGH; ++y)
        for (int x = 0; x < WIDE; ++x) body += difference(seen[y][x], seen[0][WIDE - 1]) > 40;
    ASSERT(body > WIDE * HIGH / 2 && body < WIDE * HIGH * 9 / 10);
    FILE *file = fopen(json, "r");
    ASSERT(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    ASSERT(strstr(text, "\"most_too_coarse\": 0,"));
    PASS();
}

TEST what_cannot_be_shown_ends_with_one_line(void)
{
    const char *const nowhere[] = {"viewer", "--grid", "16", "--screenshot", "/nowhere/at all.png", NULL};
    const char *const flight[] = {"viewer", "--fly", "2", "--grid", "128", "--screenshot", "/nowhere/at all.png", NULL};
    const char *const no_script[] = {"viewer", "--grid", "16", "--screenshot", "x.png", "--script", "/nowhere.txt", NULL};
    const char *const no_mesh[] = {"viewer", "/nowhere.obj", NULL}, *const usage[] = {"viewer", "--width", "0", NULL};
    ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_mesh));
    ASSERT_EQ(1, lines_said());
    ASSERT_EQ(CLI_EXIT_USAGE, run_viewer(usage));
    ASSERT_EQ(1, lines_said());
    const char *const vain[][6] = {{"viewer", "--bench", "--script", "a.txt"}, {"viewer", "--bench", "a.obj"},
                                   {"viewer", "--json", "-"}, {"viewer", "--out", "a"}, {"viewer", "--texture", "64"},
                                   {"viewer", "--texture", "64", "--save", "a.ply"},
                                   {"viewer", "--save", "a.ply", "--screenshot", "a.png"},
                                   {"viewer", "--fly", "2", "--grid", "100"}, {"viewer", "--fly", "2", "--bench"}};
    for (size_t i = 0; i < sizeof vain / sizeof *vain; ++i) {
        ASSERT_EQm(vain[i][1], CLI_EXIT_USAGE, run_viewer(vain[i]));
        ASSERT_EQ(1, lines_said());
    }
    if (can_draw) {
        ASSERT(write_text("save.txt", "save /nowhere/a.ply\n"));
        char script[512];
        snprintf(script, sizeof script, "%s", scratch("save.txt"));
        const char *const no_save[] = {"viewer", "--grid", "16", "--screenshot", "x.png", "--script", script, NULL};
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_save));
        ASSERT_EQ(1, lines_said());
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(nowhere));
        ASSERT_EQ(1, lines_said());
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(flight));
        ASSERT_EQ(1, lines_said());
        ASSERT(said("/nowhere/at all.png"));
        ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(no_script));
        ASSERT_EQ(1, lines_said());
    }
    const char *const window[] = {"viewer", "--grid", "16", NULL};
    ASSERT_EQ(CLI_EXIT_FAILURE, run_viewer(window)); /* without a display */
    ASSERT_EQ(1, lines_said());
    ASSERT(said("--screenshot FILE needs no display"));
    PASS();
}

/* Runs in a process of its own, because EGL looks for its drivers once. */
TEST without_a_driver_the_package_is_named(void)
{
    const char *const arguments[] = {"viewer", "--grid", "16", "--screenshot", scratch("vain.png"), NULL};
    int status = 0;
    const pid_t child = fork();
    if (child == 0) {
        setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json", 1); /* of libglvnd, which all of Linux has */
        _exit(run_viewer(arguments) & 0xff);
    }
    ASSERT(child > 0 && waitpid(child, &status, 0) == child && WIFEXITED(status));
    if (WEXITSTATUS(status) == CLI_EXIT_OK) SKIPm("EGL has found a driver that it was not to find");
    ASSERT_EQ(CLI_EXIT_FAILURE, WEXITSTATUS(status));
    ASSERT_EQ(1, lines_said());
    ASSERT(said("libegl1"));
    PASS();
}

/* Draws an app in a window, visible or not, into a file. */
static bool draw(bool visible, const char *name)
{
    struct viewer_app app = app_with_ball();
    struct viewer_window window;
    char error[VIEWER_TEXT];
    viewer_app_resize(&app, WIDE, HIGH);
    DRIVER_BEGIN;
    const bool open = viewer_window_open(&window, &app, visible, error), drawn = open && viewer_window_show(&window, scratch(name));
    if (open) viewer_window_close(&window);
    DRIVER_END;
    viewer_app_close(&app);
    return drawn;
}

TEST a_window_shows_the_same_picture(void)
{
    static pixels window, none;
    if (!display || !can_draw) SKIPm("there is no Xvfb, or no OpenGL 3.3 by EGL");
    if (!draw(true, "window.png")) SKIPm("the display has no OpenGL 3.3");
    ASSERT(draw(false, "none.png"));
    ASSERT(read_picture("window.png", window) && read_picture("none.png", none));
    ASSERT_EQ(0, changed(window, none));
    PASS();
}

static bool can_draw_without_a_display(void)
{
    struct viewer_offscreen offscreen;
    DRIVER_BEGIN;
    const bool can = viewer_offscreen_open(&offscreen);
    viewer_offscreen_close(&offscreen);
    DRIVER_END;
    return can;
}

int main(int argc, char **argv)
{
    GREATEST_MAIN_BEGIN();
    if (!make_folder()) return 1;
    RUN_TEST(a_saved_mesh_is_read_again);
    RUN_TEST(colors_of_a_mesh_are_carried);
    RUN_TEST(a_texture_wants_colors);
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    RUN_TEST(without_a_driver_the_package_is_named);
    can_draw = can_draw_without_a_display();
    RUN_TEST(pictures_show_what_there_is);
    RUN_TEST(coarse_bodies_have_no_dark_outline);
    RUN_TEST(a_flight_draws_levels_of_detail);
    RUN_TEST(what_cannot_be_shown_ends_with_one_line);
    start_display();
    RUN_TEST(a_window_shows_the_same_picture);
    stop_display();
    if (!remove_folder()) return 1;
    GREATEST_MAIN_END();
}

#endif
