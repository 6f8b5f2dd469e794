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

bool viewer_window_open(struct viewer_window *window, struct viewer_app *app, bool visible, char error[VIEWER_TEXT])
{
    char reason[VIEWER_TEXT] = "";
    memset(window, 0, sizeof *window);
    snprintf(trouble, sizeof trouble, "no reason given");
    window->app = app;
    window->handle = create_window(app, visible);
    if (!window->handle) {
        glfwTerminate();
        snprintf(error, VIEWER_TEXT, "no window with OpenGL 3.3: %.240s", trouble);
        return false;
    }
    glfwMakeContextCurrent(window->handle);
    glfwSwapInterval(visible);
    if (!viewer_scene_create(&window->scene, reason, sizeof reason)) {
        viewer_window_close(window);
        snprintf(error, VIEWER_TEXT, "OpenGL refuses the shaders: %.240s", reason);
        return false;
    }
    glfwSetWindowUserPointer(window->handle, window);
    glfwSetMouseButtonCallback(window->handle, on_button);
    glfwSetCursorPosCallback(window->handle, on_move);
    glfwSetScrollCallback(window->handle, on_scroll);
    glfwSetKeyCallback(window->handle, on_key);
    glfwSetDropCallback(window->handle, on_drop);
    glfwSetWindowSizeCallback(window->handle, on_size);
    glfwSetWindowRefreshCallback(window->handle, on_refresh);
    return true;
}

void viewer_window_close(struct viewer_window *window)
{
    viewer_scene_destroy(&window->scene);
    glfwDestroyWindow(window->handle);
    glfwTerminate();
    memset(window, 0, sizeof *window);
}

bool viewer_window_show(void *user, const char *picture)
{
    struct viewer_window *window = user;
    int width, height;
    glfwGetFramebufferSize(window->handle, &width, &height);
    if (width <= 0 || height <= 0) { /* minimized */
        return true;
    }
    if (!viewer_scene_draw(&window->scene, window->app, width, height)) {
        return false;
    }
    glfwSwapBuffers(window->handle);
    window->shown = window->app->looks;
    if (picture && !viewer_scene_save(&window->scene, picture)) {
        return write_error(window->app->message, sizeof window->app->message, picture);
    }
    return true;
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
