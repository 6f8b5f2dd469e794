#define _POSIX_C_SOURCE 200809L
#include "viewer/offscreen.h"

#include <stddef.h>
#include <stdlib.h>

#ifdef __has_include
  #if __has_include(<epoxy/egl.h>)
    #define HAS_EGL
  #endif
#endif

#ifdef HAS_EGL

#include <epoxy/egl.h>

enum { MAX_DEVICES = 16 };

/* Creates a context on a display and makes it current. Closes the display where that fails. */
static bool open_on(EGLDisplay display, struct viewer_offscreen *offscreen)
{
    static const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    static const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3,
                                     EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    EGLConfig config;
    EGLContext context = EGL_NO_CONTEXT;
    EGLint count = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL)) {
        return false;
    }
    if (eglBindAPI(EGL_OPENGL_API) && eglChooseConfig(display, wanted, &config, 1, &count) && count > 0) {
        context = eglCreateContext(display, config, EGL_NO_CONTEXT, version);
    }
    *offscreen = (struct viewer_offscreen){display, context};
    if (context == EGL_NO_CONTEXT || !eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        viewer_offscreen_close(offscreen);
        return false;
    }
    return true;
}

/* Tries Mesa's platform without surfaces first, which draws on the processor where there is nothing else. */
bool viewer_offscreen_open(struct viewer_offscreen *offscreen)
{
    EGLDeviceEXT devices[MAX_DEVICES];
    EGLint count = 0;
    *offscreen = (struct viewer_offscreen){NULL, NULL};
    setenv("EGL_LOG_LEVEL", "fatal", 0); /* Mesa prints lines of its own for each driver that it does not find */
    if (!epoxy_has_egl()) {
        return false;
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")
        && open_on(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL), offscreen)) {
        return true;
    }
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device")) {
        eglQueryDevicesEXT(MAX_DEVICES, devices, &count);
    }
    for (int i = 0; i < count; ++i) {
        if (open_on(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL), offscreen)) {
            return true;
        }
    }
    return false;
}

void viewer_offscreen_close(struct viewer_offscreen *offscreen)
{
    if (offscreen->display) {
        eglMakeCurrent(offscreen->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        if (offscreen->context) {
            eglDestroyContext(offscreen->display, offscreen->context);
        }
        eglTerminate(offscreen->display);
    }
    *offscreen = (struct viewer_offscreen){NULL, NULL};
}

#else

bool viewer_offscreen_open(struct viewer_offscreen *offscreen)
{
    *offscreen = (struct viewer_offscreen){NULL, NULL};
    return false;
}

void viewer_offscreen_close(struct viewer_offscreen *offscreen) { (void)offscreen; }

#endif
