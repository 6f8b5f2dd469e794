#include "viewer/window.h"

#include "base/progress.h"
#include "base/write_error.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

static char trouble[VIEWER_TEXT]; /* GLFW's error callback has no user pointer */

static void on_error(int code, const char *text)
{
    (void)code;
    snprintf(trouble, sizeof trouble, "%s", text);
}

static struct viewer_app *app_of(GLFWwindow *handle)
{
    return ((struct viewer_window *)glfwGetWindowUserPointer(handle))->app;
}

static void on_button(GLFWwindow *handle, int button, int action, int modifiers)
{
    if (button <= GLFW_MOUSE_BUTTON_MIDDLE) {
        viewer_app_button(app_of(handle), button, action == GLFW_PRESS, modifiers);
    }
}

static void on_move(GLFWwindow *handle, double x, double y) { viewer_app_move(app_of(handle), (float)x, (float)y); }

static void on_scroll(GLFWwindow *handle, double x, double y)
{
    const bool ctrl = glfwGetKey(handle, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS
                   || glfwGetKey(handle, GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
    (void)x;
    viewer_app_scroll(app_of(handle), (float)y, ctrl ? VIEWER_CTRL : 0);
}

static void on_key(GLFWwindow *handle, int key, int scancode, int action, int modifiers)
{
    (void)scancode;
    if (action != GLFW_RELEASE) {
        viewer_app_key(app_of(handle), key == GLFW_KEY_KP_ENTER ? VIEWER_ENTER : key, modifiers);
    }
}

static void on_drop(GLFWwindow *handle, int count, const char **paths)
{
    for (int i = 0; i < count; ++i) {
        viewer_app_drop(app_of(handle), paths[i]);
    }
}

static void on_size(GLFWwindow *handle, int width, int height) { viewer_app_resize(app_of(handle), width, height); }

static void on_refresh(GLFWwindow *handle) { ++app_of(handle)->looks; }

static GLFWwindow *create_window(const struct viewer_app *app, bool visible)
{
    glfwSetErrorCallback(on_error);
    if (!glfwInit()) {
        return NULL;
    }
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_VISIBLE, visible);
    return glfwCreateWindow(app->width, app->height, "springls viewer", NULL, NULL);
}

static void receive_events(struct viewer_window *window)
{
    glfwSetWindowUserPointer(window->handle, window);
    glfwSetMouseButtonCallback(window->handle, on_button);
    glfwSetCursorPosCallback(window->handle, on_move);
    glfwSetScrollCallback(window->handle, on_scroll);
    glfwSetKeyCallback(window->handle, on_key);
    glfwSetDropCallback(window->handle, on_drop);
    glfwSetWindowSizeCallback(window->handle, on_size);
    glfwSetWindowRefreshCallback(window->handle, on_refresh);
}

/* Makes a context current: in a visible window, or without one, where a hidden window is the last resort. */
static bool open_context(struct viewer_window *window, bool visible, char error[VIEWER_TEXT])
{
    if (!visible && viewer_offscreen_open(&window->offscreen)) {
        return true;
    }
    snprintf(trouble, sizeof trouble, "no reason given");
    window->handle = create_window(window->app, visible);
    if (!window->handle) {
        glfwTerminate();
        snprintf(error, VIEWER_TEXT,
                 visible ? "no window with OpenGL 3.3 (%.120s); --screenshot FILE needs no display"
                         : "no OpenGL 3.3, neither by EGL (on Debian: packages libegl1, libgl1-mesa-dri) nor in a window (%.120s)",
                 trouble);
        return false;
    }
    glfwMakeContextCurrent(window->handle);
    glfwSwapInterval(visible);
    receive_events(window);
    return true;
}

bool viewer_window_open(struct viewer_window *window, struct viewer_app *app, bool visible, char error[VIEWER_TEXT])
{
    char reason[VIEWER_TEXT] = "";
    memset(window, 0, sizeof *window);
    window->app = app;
    if (!open_context(window, visible, error)) {
        return false;
    }
    if (!viewer_scene_create(&window->scene, reason, sizeof reason)) {
        viewer_window_close(window);
        snprintf(error, VIEWER_TEXT, "OpenGL refuses the shaders: %.240s", reason);
        return false;
    }
    window->scene.gl.windowless = !window->handle;
    return true;
}

void viewer_window_close(struct viewer_window *window)
{
    viewer_scene_destroy(&window->scene);
    if (window->handle) {
        glfwDestroyWindow(window->handle);
        glfwTerminate();
    }
    viewer_offscreen_close(&window->offscreen);
    memset(window, 0, sizeof *window);
}

bool viewer_window_show(void *user, const char *picture)
{
    struct viewer_window *window = user;
    int width = window->app->width, height = window->app->height;
    if (window->handle) {
        glfwGetFramebufferSize(window->handle, &width, &height);
    }
    if (width <= 0 || height <= 0) { /* minimized */
        return true;
    }
    if (!viewer_scene_draw(&window->scene, window->app, width, height)) {
        return false;
    }
    if (window->handle) {
        glfwSwapBuffers(window->handle);
    }
    window->shown = window->app->looks;
    if (picture && !viewer_scene_save(&window->scene, picture)) {
        return write_error(window->app->message, sizeof window->app->message, picture);
    }
    return true;
}

void viewer_window_take_no_events(struct viewer_window *window)
{
    if (window->handle) {
        glfwSetMouseButtonCallback(window->handle, NULL);
        glfwSetCursorPosCallback(window->handle, NULL);
        glfwSetScrollCallback(window->handle, NULL);
        glfwSetKeyCallback(window->handle, NULL);
        glfwSetDropCallback(window->handle, NULL);
        glfwSetWindowSizeCallback(window->handle, NULL);
        glfwSetWindowRefreshCallback(window->handle, NULL);
    }
}

bool viewer_window_flip(struct viewer_window *window)
{
    if (!window->handle) {
        return true;
    }
    glfwSwapBuffers(window->handle);
    glfwPollEvents();
    return !glfwWindowShouldClose(window->handle);
}

bool viewer_window_loop(struct viewer_window *window)
{
    double before = elapsed_seconds();
    window->scene.show_times = true;
    window->app->budget = VIEWER_BUDGET;
    while (!window->app->quit && !glfwWindowShouldClose(window->handle)) {
        if (viewer_app_busy(window->app)) {
            glfwPollEvents();
        } else { /* at rest nothing is computed or drawn */
            glfwWaitEvents();
            before = elapsed_seconds();
        }
        const double now = elapsed_seconds();
        viewer_app_work(window->app, fmin(now - before, 0.1));
        before = now;
        if (window->shown != window->app->looks && !viewer_window_show(window, NULL)) {
            return false;
        }
    }
    return true;
}
