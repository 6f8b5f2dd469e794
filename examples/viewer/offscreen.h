/* offscreen.h - an OpenGL 3.3 context without a window or a display, by EGL. */
#ifndef EXAMPLES_VIEWER_OFFSCREEN_H
#define EXAMPLES_VIEWER_OFFSCREEN_H

#include <stdbool.h>

struct viewer_offscreen {
    void *display, *context; /* of EGL; NULL: there is none */
};

/* Makes the context current. Returns false where EGL has none, with nothing to close. */
bool viewer_offscreen_open(struct viewer_offscreen *offscreen);
void viewer_offscreen_close(struct viewer_offscreen *offscreen);

#endif
