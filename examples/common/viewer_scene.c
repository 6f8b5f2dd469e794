#include "viewer_scene.h"

#include "progress.h"
#include "viewer_text.h"

#include <stdio.h>
#include <string.h>

static const struct color clay = {0.62f, 0.70f, 0.80f}, other_clay = {0.85f, 0.66f, 0.45f}, ink = {0.9f, 0.25f, 0.1f};

bool viewer_scene_create(struct viewer_scene *scene, char *error, size_t size)
{
    memset(scene, 0, sizeof *scene);
    return viewer_gl_create(&scene->gl, error, size);
}

void viewer_scene_destroy(struct viewer_scene *scene)
{
    viewer_gl_unset(&scene->body);
    viewer_gl_unset(&scene->second);
    viewer_gl_destroy(&scene->gl);
}

/* Springls as they are, with the gaps between them, or the watertight surface. */
static bool send(struct viewer_surface *surface, struct viewer_model *model, bool springls)
{
    springls_mesh mesh;
    const springls_status status = springls ? springls_extract_soup(model->ctx, &mesh) : springls_extract_mesh(model->ctx, &mesh);
    if (!viewer_model_check(model, status)) {
        return false;
    }
    const float *const arrays[VIEWER_GL_ARRAYS] = {mesh.positions, mesh.normals, mesh.correspondences, NULL};
    viewer_gl_set(surface, arrays, mesh.vertex_count, mesh.triangles, mesh.triangle_count);
    springls_mesh_free(model->ctx, &mesh);
    return true;
}

/* Only what has changed is made again. */
static bool refresh(struct viewer_scene *scene, struct viewer_app *app)
{
    const bool springls = app->view == VIEWER_SPRINGLS, were_springls = scene->body_view == VIEWER_SPRINGLS;
    bool good = true;
    if (scene->body_version != app->model.version || springls != were_springls) {
        good = send(&scene->body, &app->model, springls);
        scene->body_version = app->model.version;
    }
    scene->body_view = app->view;
    if (!app->second.ctx) {
        viewer_gl_unset(&scene->second);
        scene->second_version = 0;
    } else if (scene->second_version != app->second.version) {
        good = good && send(&scene->second, &app->second, false);
        scene->second_version = app->second.version;
    }
    return good;
}

static void draw_surfaces(const struct viewer_scene *scene, const struct viewer_app *app)
{
    const float brush[4] = {app->brush.center[0], app->brush.center[1], app->brush.center[2], app->brush.radius};
    const bool shows_brush = app->hover || (app->hand == VIEWER_WORK && app->tool == VIEWER_DRAG);
    const bool whole = app->hand == VIEWER_WORK && app->modifiers & VIEWER_CTRL;
    float middle[3];
    for (int a = 0; a < 3; ++a) {
        middle[a] = 0.5f * (app->model.lower[a] + app->model.upper[a]);
    }
    struct viewer_paint paint = {.base = clay,
                                 .painting = app->view == VIEWER_TEXTURE,
                                 .edges = app->view == VIEWER_SPRINGLS,
                                 .wires = app->view == VIEWER_WIREFRAME,
                                 .middle = middle,
                                 .brush = shows_brush && !whole && app->tool != VIEWER_CUT ? brush : NULL};
    viewer_gl_draw(&scene->gl, &scene->body, &app->camera, &paint);
    struct viewer_paint second = {.base = other_clay, .wires = paint.wires};
    memcpy(second.offset, app->offset, sizeof second.offset);
    viewer_gl_draw(&scene->gl, &scene->second, &app->camera, &second);
}

static void draw_stroke(const struct viewer_scene *scene, const struct viewer_app *app)
{
    float ends[4];
    for (int i = 0; i < 4; ++i) { /* the window's unit need not be a pixel */
        ends[i] = app->stroke[i] * (i % 2 ? (float)scene->gl.height / (float)app->height : (float)scene->gl.width / (float)app->width);
    }
    if (app->hand == VIEWER_WORK && app->tool == VIEWER_CUT) {
        viewer_gl_line(&scene->gl, ends, ink);
    }
}

static void write_panel(struct viewer_scene *scene, const struct viewer_app *app)
{
    char text[sizeof scene->text];
    char times[128] = "";
    struct image picture;
    if (scene->show_times) {
        snprintf(times, sizeof times, "step %.0f ms, mesh %.0f ms, draw %.0f ms", 1e3 * app->model.step_seconds,
                 1e3 * scene->mesh_seconds, 1e3 * scene->draw_seconds);
    }
    viewer_text(app, times, text, sizeof text);
    if (strcmp(text, scene->text) != 0 && viewer_text_picture(text, &picture)) {
        memcpy(scene->text, text, sizeof text);
        viewer_gl_set_panel(&scene->gl, &picture);
        image_free(&picture);
    }
}

bool viewer_scene_draw(struct viewer_scene *scene, struct viewer_app *app, int width, int height)
{
    const double begin = elapsed_seconds();
    const bool good = refresh(scene, app);
    const double made = elapsed_seconds();
    if (!good || !viewer_gl_begin(&scene->gl, width, height)) {
        snprintf(app->message, sizeof app->message, "%s", good ? "no memory for the picture" : app->model.error);
        return false;
    }
    draw_surfaces(scene, app);
    draw_stroke(scene, app);
    write_panel(scene, app);
    viewer_gl_panel(&scene->gl);
    viewer_gl_show(&scene->gl);
    if (app->hand != VIEWER_IDLE || viewer_app_busy(app)) { /* times of frames that did something */
        scene->mesh_seconds = made - begin;
        scene->draw_seconds = elapsed_seconds() - made;
    }
    return true;
}

bool viewer_scene_save(const struct viewer_scene *scene, const char *path)
{
    struct image picture = {0};
    const bool good = viewer_gl_read(&scene->gl, &picture) && image_write_png(&picture, path);
    image_free(&picture);
    return good;
}
