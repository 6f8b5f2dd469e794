/* scene.h - the picture of a viewer_app: surfaces that follow the model, and a text panel. */
#ifndef EXAMPLES_VIEWER_SCENE_H
#define EXAMPLES_VIEWER_SCENE_H

#include "viewer/app.h"
#include "viewer/gl.h"

struct viewer_scene {
    struct viewer_gl gl;
    struct viewer_surface body, second;     /* whole meshes */
    struct viewer_surface *chunks;          /* alternatively the body by bricks: a table of chunk_room places, found by hash */
    struct viewer_brick {
        int at[3];
        bool used;
        uint32_t *ids; /* of the springls at its vertices, by which masks are drawn; or NULL */
        int vertex_count;
    } *bricks; /* of these */
    int chunk_room, chunk_count;
    unsigned mask_version; /* of the model, as it is drawn */
    unsigned chunk_generation;                       /* model->chunk_generation of the chunks */
    unsigned body_version, second_version;  /* model versions of the surfaces */
    enum viewer_view body_view;
    char text[2048];                       /* on the panel */
    double mesh_seconds, draw_seconds;     /* of the last picture: extracting and uploading the surface; drawing */
    bool show_times;                       /* in the text; off where pictures are compared */
};

bool viewer_scene_create(struct viewer_scene *scene, char *error, size_t size);
void viewer_scene_destroy(struct viewer_scene *scene);

/* Draws into the window's frame of width * height pixels. Returns false with the reason in app->message if memory is short. */
bool viewer_scene_draw(struct viewer_scene *scene, struct viewer_app *app, int width, int height);

/* Writes the last picture to a PNG file. */
bool viewer_scene_save(const struct viewer_scene *scene, const char *path);

#endif
