#include "viewer/bench.h"

#include "base/cli.h"
#include "base/json.h"
#include "base/progress.h"
#include "viewer/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { WARM = 10, FRAMES = 60, WIDTH = 960, HEIGHT = 720 };

struct times {
    double step[FRAMES], mesh[FRAMES], draw[FRAMES], frame[FRAMES];
};

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(struct json_writer *json, const char *key, double seconds[FRAMES])
{
    qsort(seconds, FRAMES, sizeof *seconds, ascending);
    json_object_begin(json, key);
    json_number(json, "median", 1e3 * seconds[FRAMES / 2]);
    json_number(json, "p95", 1e3 * seconds[FRAMES * 95 / 100]);
    json_number(json, "max", 1e3 * seconds[FRAMES - 1]);
    json_object_end(json);
}

/* Moves the brush around on the ball, as a modeler's hand does. */
static void move_pointer(struct viewer_app *app, int frame)
{
    const float turn = 0.1f * (float)frame;
    viewer_app_move(app, (0.5f + 0.1f * cosf(turn)) * WIDTH, (0.5f + 0.1f * sinf(turn)) * HEIGHT);
}

static bool one_frame(struct viewer_app *app, struct viewer_window *window, struct times *times, int frame)
{
    const double begin = elapsed_seconds();
    move_pointer(app, frame);
    viewer_app_work(app, 1.0 / 60.0);
    if (*app->message || (window && !viewer_window_show(window, NULL))) {
        return false;
    }
    if (frame >= WARM) {
        times->step[frame - WARM] = app->model.step_seconds;
        times->mesh[frame - WARM] = window ? window->scene.mesh_seconds : 0.0;
        times->draw[frame - WARM] = window ? window->scene.draw_seconds : 0.0;
        times->frame[frame - WARM] = elapsed_seconds() - begin;
    }
    return true;
}

static bool one_grid(struct json_writer *json, const springls_desc *desc, struct viewer_app *app, struct viewer_window *window)
{
    static struct times times;
    app->tool = VIEWER_PUSH;
    if (!viewer_app_open(app, desc, WIDTH, HEIGHT)) {
        cli_fail("viewer", 0, "%s", app->model.error);
        return false;
    }
    move_pointer(app, 0);
    viewer_app_button(app, VIEWER_LEFT, true, 0);
    for (int frame = 0; frame < WARM + FRAMES; ++frame) {
        if (!one_frame(app, window, &times, frame)) {
            cli_fail("viewer", 0, "%s", app->message);
            return false;
        }
    }
    json_object_begin(json, NULL);
    json_integer(json, "grid", desc->grid.size[0]);
    json_integer(json, "springls", springls_count(app->model.ctx));
    report(json, "frame_ms", times.frame);
    report(json, "step_ms", times.step);
    report(json, "mesh_ms", times.mesh);
    report(json, "draw_ms", times.draw);
    json_object_end(json);
    return true;
}

int viewer_bench(const springls_desc *desc, const char *path, const char *backend, int threads)
{
    static const int grids[] = {64, 96, 128, 192};
    const int asked = desc->grid.size[0];
    struct viewer_app app = {.width = WIDTH, .height = HEIGHT};
    struct viewer_window window;
    struct json_writer json;
    char error[VIEWER_TEXT];
    if (!json_open(&json, path ? path : "-")) {
        cli_write_failed("viewer", path);
        return CLI_EXIT_FAILURE;
    }
    const bool drawn = viewer_window_open(&window, &app, false, error);
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "viewer: push");
    json_string(&json, "backend", backend);
    json_integer(&json, "threads", threads);
    json_bool(&json, "drawn", drawn);
    json_array_begin(&json, "grids");
    bool good = true;
    for (size_t g = 0; good && g < sizeof grids / sizeof *grids; ++g) {
        springls_desc sized = *desc;
        sized.grid.size[0] = grids[g];
        if (asked > 0) {
            sized.grid.size[0] = asked;
            g = sizeof grids / sizeof *grids;
        }
        good = one_grid(&json, &sized, &app, drawn ? &window : NULL);
    }
    json_array_end(&json);
    json_object_end(&json);
    if (drawn) {
        viewer_window_close(&window);
    }
    viewer_app_close(&app);
    good = json_close(&json) && good;
    return good ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
