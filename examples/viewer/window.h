/* window.h - the window: passes GLFW's events to a viewer_app and shows its picture. Without one, pictures go to files. */
#ifndef EXAMPLES_VIEWER_WINDOW_H
#define EXAMPLES_VIEWER_WINDOW_H

#include "viewer/offscreen.h"
#include "viewer/scene.h"

struct viewer_window {
    struct GLFWwindow *handle;         /* NULL: the pictures are drawn without a window */
    struct viewer_offscreen offscreen; /* by this */
    struct viewer_app *app;
    struct viewer_scene scene;
    unsigned shown; /* app->looks of the last picture */
};

/* Opens the window; where it is not to be visible, OpenGL without a window or a display, or else a hidden window. Returns false
 * without a display or OpenGL 3.3, with one line in `error` and nothing to close. */
bool viewer_window_open(struct viewer_window *window, struct viewer_app *app, bool visible, char error[VIEWER_TEXT]);
void viewer_window_close(struct viewer_window *window);

/* Shows a picture of the app, and writes it to a PNG file unless `picture` is NULL. A viewer_show_fn. */
bool viewer_window_show(void *window, const char *picture);

/* For pictures that are not of the app: lets its events be; completes a frame that has been drawn, and returns false when the window is
 * to be closed. */
void viewer_window_take_no_events(struct viewer_window *window);
bool viewer_window_flip(struct viewer_window *window);

/* Runs until the window is closed or the app quits. */
bool viewer_window_loop(struct viewer_window *window);

#endif
