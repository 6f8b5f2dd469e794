#include "viewer/fly.h"

#include "base/cli.h"
#include "base/json.h"
#include "base/progress.h"
#include "springls/detail.h"
#include "viewer/window.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BUDGET 4e-3 /* seconds a frame for other levels */

static const struct color colors[DETAIL_LEVELS] = {
    {0.85f, 0.66f, 0.45f}, {0.62f, 0.70f, 0.80f}, {0.55f, 0.75f, 0.55f}, {0.75f, 0.60f, 0.75f}};

/* Milliseconds of every frame. */
struct times {
    double *levels, *upload_draw, *frame;
    int count;
};

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(struct json_writer *json, const char *key, double *ms, int count)
{
    qsort(ms, (size_t)count, sizeof *ms, ascending);
    json_object_begin(json, key);
    json_number(json, "p50", ms[count / 2]);
    json_number(json, "p95", ms[count * 95 / 100]);
    json_number(json, "max", ms[count - 1]);
    json_object_end(json);
}

/* A camera that looks ahead and down. y is up: what detail_eye calls height. */
static struct viewer_camera camera_at(double fraction, float grid, float eye[3])
{
    const float middle[3] = {0.5f * grid, 0.5f * grid, 0.5f * grid};
    struct viewer_camera camera;
    float place[3];
    detail_eye(fraction, grid, place);
    eye[0] = place[0];
    eye[1] = place[2];
    eye[2] = place[1];
    viewer_camera_fit(&camera, middle, grid, 0.9f * grid);
    camera.target[0] = eye[0] + 0.6f * grid;
    camera.target[1] = 0.4f * grid;
    const float d[3] = {eye[0] - camera.target[0], eye[1] - camera.target[1], eye[2] - camera.target[2]};
    camera.distance = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    camera.yaw = atan2f(d[0], d[2]);
    camera.pitch = asinf(d[1] / camera.distance);
    return camera;
}

/* Uploads chunks that have other triangles. */
static void upload(struct detail_world *world, struct viewer_surface *surfaces)
{
    for (int i = 0; i < world->count; ++i) {
        struct detail_place *place = &world->place[i];
        const float *const arrays[VIEWER_GL_ARRAYS] = {place->chunk.positions, place->chunk.normals, NULL, NULL};
        if (!place->changed) {
            continue;
        }
        place->changed = false;
        viewer_gl_set(&surfaces[i], arrays, place->chunk.vertex_count, place->lod.triangles, sizeof *place->lod.triangles,
                      place->lod.triangle_count);
    }
}

static void draw(const struct viewer_gl *gl, const struct detail_world *world, const struct viewer_surface *surfaces,
                 const struct viewer_camera *camera)
{
    for (int i = 0; i < world->group_count; ++i) {
        const struct detail_group *group = &world->group[i];
        const struct viewer_paint paint = {.base = colors[group->level], .middle = camera->middle};
        viewer_gl_draw(gl, surfaces + group->first, group->count, camera, &paint);
    }
    viewer_gl_show(gl);
}

/* What has been drawn, all frames together. */
struct sums {
    double triangles, coarse;
    int most_coarse;
};

static void add_frame(struct sums *sums, const struct detail_world *world)
{
    int coarse = 0;
    for (int i = 0; i < world->group_count; ++i) {
        const struct detail_group *group = &world->group[i];
        coarse += group->pixels > DETAIL_HALF_A_PIXEL && group->wanted < group->level ? group->count : 0;
    }
    for (int i = 0; i < world->count; ++i) {
        sums->triangles += world->place[i].lod.triangle_count;
    }
    sums->coarse += coarse;
    sums->most_coarse = coarse > sums->most_coarse ? coarse : sums->most_coarse;
}

/* Draws the frames, until the window is closed. Returns what has failed; "": that has been said; NULL: nothing. */
static const char *fly(struct viewer_window *window, struct detail_world *world, springls_context *model, float grid, int frames,
                       struct viewer_surface *surfaces, const char *picture, struct times *times, struct sums *sums)
{
    const int width = window->app->width, height = window->app->height;
    float eye[3];
    struct viewer_camera camera = camera_at(0.0, grid, eye);
    const float pixel = 2.0f * viewer_camera_frame(&camera, 1.0f, eye).half_height / (float)height;
    bool open = true;
    for (int changed = 1; changed;) { /* before the flight: all that it begins with */
        if (detail_update(world, model, detail_choose(world, eye, pixel), 1e30, &changed) < 0) {
            return springls_last_error(model);
        }
    }
    for (int i = 0; i < frames && open; ++i) {
        const double begin = elapsed_seconds();
        int changed;
        camera = camera_at((double)i / frames, grid, eye);
        if (detail_update(world, model, detail_choose(world, eye, pixel), detail_seconds() + BUDGET, &changed) < 0) {
            return springls_last_error(model);
        }
        const double chosen = elapsed_seconds();
        if (!viewer_gl_begin(&window->scene.gl, width, height)) {
            return "no memory for the picture";
        }
        upload(world, surfaces);
        draw(&window->scene.gl, world, surfaces, &camera);
        if (picture && i == frames / 3 && !viewer_scene_save(&window->scene, picture)) {
            cli_write_failed("viewer", picture);
            return "";
        }
        open = viewer_window_flip(window);
        add_frame(sums, world);
        times->levels[i] = 1e3 * (chosen - begin);
        times->upload_draw[i] = 1e3 * (elapsed_seconds() - chosen);
        times->frame[i] = 1e3 * (elapsed_seconds() - begin);
        times->count = i + 1;
    }
    return NULL;
}

static bool write_report(const char *path, int grid, const struct detail_world *world, struct times *times, const struct sums *sums)
{
    struct json_writer json;
    double all = 0.0;
    for (int i = 0; i < world->count; ++i) {
        all += world->place[i].chunk.triangle_count;
    }
    if (!json_open(&json, path ? path : "-")) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_string(&json, "problem", "viewer: fly");
    json_integer(&json, "grid", grid);
    json_integer(&json, "chunks", world->count);
    json_integer(&json, "frames", times->count);
    json_number(&json, "triangles_full", all);
    json_number(&json, "triangles_drawn", sums->triangles / times->count);
    json_number(&json, "too_coarse", sums->coarse / times->count);
    json_integer(&json, "most_too_coarse", sums->most_coarse);
    report(&json, "frame_ms", times->frame, times->count);
    report(&json, "levels_ms", times->levels, times->count);
    report(&json, "draw_ms", times->upload_draw, times->count);
    json_object_end(&json);
    return json_close(&json);
}

/* Makes the world and its window, and flies. Returns as fly does. */
static const char *fly_over(const springls_desc *desc, springls_context *model, int frames, struct viewer_app *app, const char *picture,
                            const char *json)
{
    static char error[VIEWER_TEXT];
    const int grid = desc->grid.size[0];
    struct viewer_window window;
    struct detail_world world;
    struct times times = {calloc((size_t)frames, sizeof(double)), calloc((size_t)frames, sizeof(double)),
                          calloc((size_t)frames, sizeof(double)), 0};
    struct sums sums = {0.0, 0.0, 0};
    struct viewer_surface *surfaces = NULL;
    const char *failed = NULL;
    memset(&world, 0, sizeof world);
    if (springls_set_implicit(model, detail_bodies, NULL) != SPRINGLS_OK) {
        failed = springls_last_error(model);
    } else if ((failed = detail_load(&world, model, desc->grid.size)) != NULL) {
        /* nothing to fly over */
    } else if (!times.levels || !times.upload_draw || !times.frame
               || !(surfaces = calloc((size_t)world.count + 1, sizeof *surfaces))) {
        failed = "out of memory";
    } else {
        failed = error;
        if (viewer_window_open(&window, app, !picture, error)) {
            viewer_window_take_no_events(&window);
            failed = fly(&window, &world, model, (float)grid, frames, surfaces, picture, &times, &sums);
            for (int i = 0; i < world.count; ++i) {
                viewer_gl_unset(&surfaces[i]);
            }
            viewer_window_close(&window);
        }
        if (!failed && !write_report(json, grid, &world, &times, &sums)) {
            cli_write_failed("viewer", json);
            failed = "";
        }
    }
    detail_free(&world);
    free(surfaces);
    free(times.levels);
    free(times.upload_draw);
    free(times.frame);
    return failed;
}

int viewer_fly(const springls_desc *desc, int frames, int width, int height, const char *picture, const char *json)
{
    springls_desc world = *desc;
    struct viewer_app app = {.width = width, .height = height};
    springls_context *model;
    if (desc->grid.size[0] % DETAIL_BODY) {
        return cli_fail("viewer", CLI_EXIT_USAGE, "--grid %d: --fly wants a multiple of %d", desc->grid.size[0], DETAIL_BODY);
    }
    world.grid.size[1] = world.grid.size[2] = world.grid.size[0];
    if (springls_create(&world, &model) != SPRINGLS_OK) {
        return cli_fail("viewer", CLI_EXIT_FAILURE, "%s", springls_create_error(&world));
    }
    const char *failed = fly_over(&world, model, frames, &app, picture, json);
    const int status = !failed ? CLI_EXIT_OK : *failed ? cli_fail("viewer", CLI_EXIT_FAILURE, "%s", failed) : CLI_EXIT_FAILURE;
    springls_destroy(model);
    return status;
}
