/* web.c - the viewer in a browser: index.html passes events, and this works and draws with WebGL 2. A program of this machine,
 * made of the same sources without the drawing, prints the hashes with which the page compares its own. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"
#include "springls/exact_flows.h"
#include "surface/gltf_write.h"
#include "viewer/script.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { FLOW_GRID = 64, FLOW_PARTS = 24, STROKES_GRID = 64 };
#define FLOW_PERIOD 2.5 /* as `build/leveque --grid 64` has it: the state's hash is the same */

static struct viewer_app app;
static int flow_part = FLOW_PARTS; /* parts of the flow that are done */

static springls_desc cube(int grid)
{
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = grid;
    return desc;
}

static bool begin(int grid, int width, int height)
{
    const springls_desc desc = cube(grid);
    viewer_app_close(&app);
    memset(&app, 0, sizeof app);
    app.save = "body.obj";
    flow_part = FLOW_PARTS;
    return viewer_app_open(&app, &desc, width, height);
}

/* Sets LeVeque's sphere in the place of the body; its world is the grid. */
static bool begin_flow(void)
{
    const float n = (float)FLOW_GRID, middle = 0.5f * (n - 1.0f);
    springls_sphere sphere = {{0.35f * n, 0.35f * n, 0.35f * n}, 0.15f * n};
    struct viewer_model like = {.desc = cube(FLOW_GRID), .middle = {middle, middle, middle}};
    like.desc.grid.spacing[0] = 1.0;
    if (!begin(FLOW_GRID, app.width, app.height)
        || !viewer_model_second(&app.model, &like, springls_implicit_sphere, &sphere)) {
        return false;
    }
    app.brush.radius = 0.08f * n;
    app.view = VIEWER_TEXTURE;
    viewer_camera_fit(&app.camera, like.middle, 0.4f * n, 0.9f * n);
    app.camera.yaw = 1.2f;
    flow_part = 0;
    return true;
}

/* Takes the next part of the flow. */
static void flow_on(void)
{
    struct exact_flow flow = EXACT_DEFORMATION((float)FLOW_GRID, (float)FLOW_PERIOD);
    const springls_forces forces = {.velocity = exact_flow_velocity, .user = &flow};
    const springls_step_desc step = {.forces = &forces, .dt = (float)(FLOW_PERIOD / FLOW_PARTS), .max_displacement = 2.0f};
    springls_set_time(app.model.ctx, FLOW_PERIOD * flow_part / FLOW_PARTS);
    if (!viewer_model_check(&app.model, springls_step(app.model.ctx, &step))) {
        snprintf(app.message, sizeof app.message, "%s", app.model.error);
        flow_part = FLOW_PARTS;
        return;
    }
    ++flow_part;
    ++app.model.version;
    ++app.looks;
}

/* Shapes a ball as the script of the viewer's pictures has it. */
static bool play_strokes(const char *script)
{
    return begin(STROKES_GRID, 480, 360) && viewer_script_run(script, &app, NULL, NULL, app.message);
}

/* Writes nothing: the page saves OBJ. */
bool gltf_write_mesh(const char *path, const struct gltf_mesh *mesh, const struct gltf_look *look)
{
    (void)path;
    (void)mesh;
    (void)look;
    return false;
}

#ifdef __EMSCRIPTEN__
#include "viewer/scene.h"
#include "viewer/text.h"

#include <emscripten.h>
#include <emscripten/html5.h>

static struct viewer_scene scene;
static unsigned shown; /* app.looks of the last picture */

/* Leave the panel out: the page has its own text. */
void viewer_text(const struct viewer_app *of, const char *times, char *text, size_t size)
{
    (void)of;
    (void)times;
    snprintf(text, size, " ");
}

bool viewer_text_picture(const char *text, struct image *picture)
{
    (void)text;
    (void)picture;
    return false;
}

void image_free(struct image *picture) { (void)picture; }

/* Begins with a ball. Returns NULL, or the reason of a failure. */
EMSCRIPTEN_KEEPALIVE const char *web_open(int grid, int width, int height)
{
    static char error[VIEWER_TEXT];
    EmscriptenWebGLContextAttributes wanted;
    emscripten_webgl_init_context_attributes(&wanted);
    wanted.majorVersion = 2;
    wanted.antialias = wanted.alpha = false; /* the scene has a target of its own with both */
    const EMSCRIPTEN_WEBGL_CONTEXT_HANDLE gl = emscripten_webgl_create_context("#canvas", &wanted);
    if (gl <= 0 || emscripten_webgl_make_context_current(gl) != EMSCRIPTEN_RESULT_SUCCESS) {
        return "this browser has no WebGL 2";
    }
    if (!viewer_scene_create(&scene, error, sizeof error)) {
        return error;
    }
    return begin(grid, width, height) ? NULL : app.model.error;
}

/* Does a frame's work, and draws it where the picture changes; `pixels` are those of a unit of the window. Returns true while
 * more work is due. */
EMSCRIPTEN_KEEPALIVE bool web_frame(double seconds, double pixels)
{
    if (app.hand == VIEWER_WORK) { /* a tool ends the flow */
        flow_part = FLOW_PARTS;
    }
    if (flow_part < FLOW_PARTS) {
        flow_on();
    } else {
        app.budget = VIEWER_BUDGET;
        viewer_app_work(&app, seconds < 0.1 ? seconds : 0.1);
    }
    if (shown != app.looks) {
        viewer_scene_draw(&scene, &app, (int)(app.width * pixels), (int)(app.height * pixels));
        shown = app.looks;
    }
    return flow_part < FLOW_PARTS || viewer_app_busy(&app);
}

EMSCRIPTEN_KEEPALIVE void web_resize(int width, int height) { viewer_app_resize(&app, width, height); }
EMSCRIPTEN_KEEPALIVE void web_move(float x, float y) { viewer_app_move(&app, x, y); }
EMSCRIPTEN_KEEPALIVE void web_scroll(float notches, int modifiers) { viewer_app_scroll(&app, notches, modifiers); }
EMSCRIPTEN_KEEPALIVE void web_button(int button, bool down, int modifiers) { viewer_app_button(&app, button, down, modifiers); }
EMSCRIPTEN_KEEPALIVE int web_tool(void) { return (int)app.tool; }
EMSCRIPTEN_KEEPALIVE int web_view(void) { return (int)app.view; }
EMSCRIPTEN_KEEPALIVE int web_count(void) { return springls_count(app.model.ctx); }
EMSCRIPTEN_KEEPALIVE const char *web_message(void) { return app.message; }

/* Describes the brush as the page has no panel for it. */
EMSCRIPTEN_KEEPALIVE const char *web_brush(void)
{
    static char text[80];
    snprintf(text, sizeof text, "strength %.0f %%, %s, %s", 100.0 * (double)app.brush.strength,
             viewer_falloff_names[app.brush.falloff], viewer_symmetry_names[app.brush.symmetry]);
    return text;
}

EMSCRIPTEN_KEEPALIVE void web_key(int key, int modifiers) { viewer_app_key(&app, key, modifiers); }

/* Shows the wireframe, or the surface again. */
EMSCRIPTEN_KEEPALIVE void web_wires(void)
{
    app.view = app.view == VIEWER_WIREFRAME ? VIEWER_SURFACE : VIEWER_WIREFRAME;
    ++app.looks;
}

/* Opens a mesh file; in the tool merge it is the second body. */
EMSCRIPTEN_KEEPALIVE void web_drop(const char *path)
{
    flow_part = FLOW_PARTS;
    app.message[0] = '\0';
    viewer_app_drop(&app, path);
}

EMSCRIPTEN_KEEPALIVE const char *web_hash(void)
{
    static char hash[17];
    snprintf(hash, sizeof hash, "%016" PRIx64, springls_state_hash(app.model.ctx));
    return hash;
}

EMSCRIPTEN_KEEPALIVE bool web_begin(int grid) { return begin(grid, app.width, app.height); }
EMSCRIPTEN_KEEPALIVE bool web_flow(void) { return begin_flow(); }

EMSCRIPTEN_KEEPALIVE bool web_strokes(void)
{
    const int width = app.width, height = app.height;
    const bool good = play_strokes("strokes.txt");
    viewer_app_resize(&app, width, height);
    return good;
}

#else

/* Prints the hashes of both examples as a line of JavaScript. */
int main(int argc, char **argv)
{
    app.width = app.height = 1;
    bool good = argc == 2 && begin_flow();
    while (good && flow_part < FLOW_PARTS) {
        flow_on();
    }
    good = good && !*app.message;
    printf("const native = {flow: \"%016" PRIx64 "\"", good ? springls_state_hash(app.model.ctx) : 0);
    good = good && play_strokes(argv[1]);
    printf(", strokes: \"%016" PRIx64 "\"};\n", good ? springls_state_hash(app.model.ctx) : 0);
    viewer_app_close(&app);
    return !good;
}

#endif
