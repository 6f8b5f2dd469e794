/* viewer_fixtures.h - what the tests of examples/viewer share: a ball to work on, strokes across it, and events from text. */
#ifndef VIEWER_FIXTURES_H
#define VIEWER_FIXTURES_H

#include "base/vec3.h"
#include "viewer/script.h"
#include "viewer/solid.h"
#include "viewer/tools.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "scratch.h"

static const springls_desc small = {.grid = {.size = {48, 48, 48}}};

/* A ball of radius 1 in a grid of 48^3. */
SHARED struct viewer_model ball(void)
{
    struct viewer_model model = {0};
    viewer_model_ball(&model, &small);
    return model;
}

static const struct viewer_ray from_front = {{0.1f, 0.0f, 9.0f}, {0.0f, 0.0f, -1.0f}};

/* A brush of radius 0.4 where that ray meets the model. */
SHARED struct viewer_brush front(struct viewer_model *model)
{
    struct viewer_brush brush = {.radius = 0.4f};
    viewer_pick(model, &from_front, &brush);
    return brush;
}

SHARED springls_measures measured(struct viewer_model *model)
{
    springls_measures m;
    memset(&m, 0, sizeof m);
    springls_measure(model->ctx, &m);
    return m;
}

SHARED struct viewer_cut stroke_across(struct viewer_model *model, float width, float from_x, float to_x,
                                       bool side)
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

SHARED struct viewer_app app_with_ball(void)
{
    const springls_desc desc = {.grid = {.size = {40, 40, 40}}};
    struct viewer_app app;
    memset(&app, 0, sizeof app);
    app.save = "viewer.ply";
    viewer_app_open(&app, &desc, 400, 300);
    return app;
}

SHARED bool write_text(const char *name, const char *text)
{
    FILE *file = fopen(scratch(name), "w");
    if (!file) return false;
    fputs(text, file);
    return fclose(file) == 0;
}

SHARED bool play(struct viewer_app *app, const char *events, char error[VIEWER_TEXT])
{
    error[0] = '\0';
    return write_text("events.txt", events) && viewer_script_run(scratch("events.txt"), app, NULL, NULL, error);
}

#endif
