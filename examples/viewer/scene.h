/* scene.h - the picture of a viewer_app: its surfaces, kept up to date with the model, and the text beside them. */
#ifndef EXAMPLES_VIEWER_SCENE_H
#define EXAMPLES_VIEWER_SCENE_H

#include "viewer/app.h"
#include "viewer/gl.h"

struct viewer_scene {
    struct viewer_gl gl;
    struct viewer_surface body, second;     /* whole meshes */
    struct viewer_surface *chunks;          /* or the body brick by brick, x fastest, chunks_side bricks a side */
    int chunks_side;
    unsigned chunk_generation;                       /* of the chunks: see model.h */
    unsigned body_version, second_version;  /* that the surfaces are of */
    enum viewer_view body_view;
    char text[2048];                       /* that the panel shows */
    double mesh_seconds, draw_seconds;     /* of the last picture: making and sending the surface; drawing */
    bool show_times;                       /* in the text: not where pictures are compared */
};

bool viewer_scene_create(struct viewer_scene *scene, char *error, size_t size);
void viewer_scene_destroy(struct viewer_scene *scene);

/* Draws into the window's frame of width * height pixels. False: no memory; app->message says so. */
bool viewer_scene_draw(struct viewer_scene *scene, struct viewer_app *app, int width, int height);

/* The last picture into a PNG file. */
bool viewer_scene_save(const struct viewer_scene *scene, const char *path);

#endif
