/* viewer.c - shapes a body with the mouse: drag, push, inflate, smooth, cut, merge; shows springls, surface and tracked
 * texture.
 *
 *   viewer                                                  # a ball
 *   viewer bunny.obj --grid 128                             # a mesh (PLY, OBJ, STL, OFF, glTF); dropping a file does the same
 *   viewer --script strokes.txt --screenshot dent.png       # runs the events of a file, writes a picture and ends
 *   viewer --bench                                          # frame times of the tool push, as JSON
 *   viewer --fly 600 --grid 512                             # over a world of bodies, at levels of detail
 *
 * Keys and buttons: --help, or H in the window. */
#include "base/threads.h"
#include "springls/run_options.h"
#include "springls_cl.h"
#include "viewer/bench.h"
#include "viewer/fly.h"
#include "viewer/script.h"
#include "viewer/window.h"

#include <stdio.h>
#include <string.h>

struct settings {
    struct cli_common common;
    const char *mesh, *save, *script, *screenshot, *set;
    int width, height, texture, fly;
    bool bench;
};

static int read_command_line(struct settings *set, int argc, char **argv)
{
    static char summary[4096];
    const struct cli_option options[] = {
        {"save", CLI_RESULT, &set->save, "FILE", "where ctrl S saves to: PLY, OBJ, STL or GLB", 0, 0, NULL},
        {"texture", CLI_INT, &set->texture, "N", "a saved GLB has its colours in an image of N texels a side; 0: at its vertices", 0,
         8192, NULL},
        {"width", CLI_INT, &set->width, "N", "of the window", 64, 8192, NULL},
        {"height", CLI_INT, &set->height, "N", "of the window", 64, 8192, NULL},
        {"script", CLI_STRING, &set->script, "FILE", "events in the place of a hand (see docs/viewer.md)", 0, 0, NULL},
        {"screenshot", CLI_OUTPUT, &set->screenshot, "FILE", "write a picture (PNG), after the script, and end", 0, 0, NULL},
        {"bench", CLI_FLAG, &set->bench, NULL,
         "frame times of the tool push as JSON (--json: where to), on one --grid or several", 0, 0, NULL},
        {"fly", CLI_INT, &set->fly, "FRAMES",
         "over a world of bodies on --grid (128 each), at levels of detail; with --screenshot the frame after a third. Times as JSON",
         1, 5000, NULL},
        {"set", CLI_STRING, &set->set, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    const struct cli_positional mesh[] = {{"MESH", &set->mesh, "PLY, OBJ, STL, OFF or glTF; without it a ball", false}};
    const struct cli_rule rules[] = {
        {.given = "bench", .only = "grid|params|set|backend|threads|json|quiet"},
        {.given = "fly", .only = "grid|width|height|screenshot|set|params|threads|json|quiet"},
        {.given = "json", .needs = "bench|fly"},
        {.given = "save+screenshot", .needs = "script"},
        {.given = "texture", .needs = "save=.glb|script"},
    };
    const struct cli_program program = {.name = "viewer",
                                        .summary = summary,
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = mesh,
                                        .positional_count = 1,
                                        .without = "out",
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules)};
    snprintf(summary, sizeof summary, "a body to work on with the mouse\n\n%s", viewer_manual);
    return cli_parse(&program, argc, argv);
}

/* Opens the window, hidden for a screenshot, and runs the script, if any. Without a screenshot the window stays until it is
 * closed. */
static int view(struct viewer_app *app, const struct settings *set)
{
    struct viewer_window window;
    char error[VIEWER_TEXT];
    if (!viewer_window_open(&window, app, !set->screenshot, error)) {
        return cli_fail("viewer", CLI_EXIT_FAILURE, "%s", error);
    }
    bool good = !set->script || viewer_script_run(set->script, app, viewer_window_show, &window, error);
    if (good && set->screenshot) {
        good = viewer_window_show(&window, set->screenshot);
        snprintf(error, sizeof error, "%s", app->message);
    } else if (good) {
        good = viewer_window_loop(&window);
        snprintf(error, sizeof error, "%s", app->message);
    }
    viewer_window_close(&window);
    return good ? CLI_EXIT_OK : cli_fail("viewer", CLI_EXIT_FAILURE, "%s", error);
}

static int run(const struct settings *set, const springls_desc *desc)
{
    struct viewer_app app;
    memset(&app, 0, sizeof app);
    app.load = set->mesh;
    app.save = set->save;
    app.texture = set->texture;
    if (!viewer_app_open(&app, desc, set->width, set->height)) {
        return cli_fail("viewer", CLI_EXIT_FAILURE, "%s", app.model.error);
    }
    const int status = view(&app, set);
    viewer_app_close(&app);
    return status;
}

int main(int argc, char **argv)
{
    struct settings set = {.common = cli_common_defaults(), .save = "viewer.ply", .width = 960, .height = 720};
    springls_params params;
    springls_desc desc;
    int status = read_command_line(&set, argc, argv);
    if (status == CLI_CONTINUE) {
        status = run_options("viewer", &set.common, set.set, &params);
    }
    if (status == CLI_CONTINUE && set.screenshot) {
        status = run_check_output("viewer", set.screenshot);
    }
    if (status != CLI_CONTINUE) {
        return status;
    }
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = set.common.grid > 0 || set.bench ? set.common.grid : set.fly ? 256 : 96;
    desc.params = &params;
    desc.tasks = run_tasks();
    desc.backend = run_backend("viewer", &set.common);
    status = set.bench ? viewer_bench(&desc, set.common.json, run_backend_name(desc.backend), threads_count())
           : set.fly   ? viewer_fly(&desc, set.fly, set.width, set.height, set.screenshot, set.common.json)
                       : run(&set, &desc);
    springls_cl_destroy(desc.backend);
    return status;
}
