/* window.h - the window: GLFW's events go to a viewer_app, its picture comes back. */
#ifndef EXAMPLES_VIEWER_WINDOW_H
#define EXAMPLES_VIEWER_WINDOW_H

#include "viewer/scene.h"

struct viewer_window {
    struct GLFWwindow *handle;
    struct viewer_app *app;
    struct viewer_scene scene;
    unsigned shown; /* app->looks of the last picture */
};

/* False: no display, no OpenGL 3.3: one line in `error`, and nothing to close. */
bool viewer_window_open(struct viewer_window *window, struct viewer_app *app, bool visible, char error[VIEWER_TEXT]);
void viewer_window_close(struct viewer_window *window);

/* A picture of the app as it is, and into a PNG file where that is not NULL. A viewer_show_fn. */
bool viewer_window_show(void *window, const char *picture);

/* Until the window is closed or the app quits. */
bool viewer_window_loop(struct viewer_window *window);

#endif
