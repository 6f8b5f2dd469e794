/* app.h - the viewer's state, and the effects of pointer and keys on it. It needs no window and no OpenGL, so a test or a
 * script can send the same events as a user. */
#ifndef EXAMPLES_VIEWER_APP_H
#define EXAMPLES_VIEWER_APP_H

#include "viewer/camera.h"
#include "viewer/history.h"
#include "viewer/model.h"
#include "viewer/tools.h"

enum viewer_tool {
    VIEWER_DRAG, VIEWER_PUSH, VIEWER_INFLATE, VIEWER_SMOOTH, VIEWER_CUT, VIEWER_MERGE, VIEWER_MASK, VIEWER_TOOLS
};
enum viewer_view { VIEWER_SURFACE, VIEWER_SPRINGLS, VIEWER_TEXTURE, VIEWER_WIREFRAME, VIEWER_VIEWS };
enum viewer_hand { VIEWER_IDLE, VIEWER_ORBIT, VIEWER_PAN, VIEWER_WORK };

enum viewer_button { VIEWER_LEFT, VIEWER_RIGHT, VIEWER_MIDDLE };  /* numbered as in GLFW, as are these */
enum viewer_modifier { VIEWER_SHIFT = 1, VIEWER_CTRL = 2 };
enum viewer_key { VIEWER_ENTER = 257, VIEWER_ESCAPE = 256 };       /* letters, digits: their capital ASCII code */

extern const char *const viewer_tool_names[VIEWER_TOOLS], *const viewer_view_names[VIEWER_VIEWS];
extern const char *const viewer_falloff_names[VIEWER_FALLOFFS], *const viewer_symmetry_names[4];
extern const char viewer_manual[]; /* keys and buttons, some lines */

#define VIEWER_BUDGET 0.006 /* seconds a frame for the step, and for the mesh, where frames count */

struct viewer_app {
    springls_desc desc;     /* of the models to be opened */
    struct viewer_model model;
    struct viewer_model second; /* to be merged; it has no context while there is none */
    float second_place[3], offset[3]; /* where it was made, and how far it has been dragged */
    float second_radius;
    char second_path[1024];     /* its file; empty: a ball */
    struct viewer_history history;
    bool kept;              /* the history has the model before the tool's first step */
    struct viewer_camera camera;
    int width, height; /* of the window, in the unit of pointer positions */
    enum viewer_tool tool;
    enum viewer_view view;
    enum viewer_hand hand;
    struct viewer_brush brush;
    bool hover;             /* the brush lies on the surface */
    float pointer[2];
    int modifiers;          /* when the button was pressed */
    float goal[3];          /* drag: target of the brush's center */
    float held_depth;       /* drag: depth of that place along the camera's axis */
    bool holds_second;      /* merge: the pointer drags the second body */
    float stroke[4];        /* cut: x0 y0 x1 y1, while the stroke is drawn */
    const char *load, *save; /* file names of the command line; load NULL: a ball */
    int texture; /* texels a side of a saved texture; 0: none */
    double budget; /* seconds a frame may take for the step, and as many for the mesh; 0: as long as they take */
    float seconds; /* that have passed since the tool's last step began */
    bool help, quit;
    bool save_failed;       /* the last time */
    unsigned framed_version; /* of the model, around which the camera's scene is */
    unsigned looks;         /* incremented when the picture changes */
    char message[VIEWER_TEXT];
};

/* Makes the model from app->load, or a ball. Returns false with the reason in model.error. */
bool viewer_app_open(struct viewer_app *app, const springls_desc *desc, int width, int height);
void viewer_app_close(struct viewer_app *app);

void viewer_app_resize(struct viewer_app *app, int width, int height);
void viewer_app_button(struct viewer_app *app, int button, bool down, int modifiers);
void viewer_app_move(struct viewer_app *app, float x, float y);
void viewer_app_scroll(struct viewer_app *app, float notches, int modifiers);
void viewer_app_key(struct viewer_app *app, int key, int modifiers);
bool viewer_app_drop(struct viewer_app *app, const char *path); /* the second body (tool merge) or a new model */
bool viewer_app_save(struct viewer_app *app, const char *path); /* returns false with the reason in app->message */

/* Does a frame's work within the budget, and begins one step at most, when the one before is done and meshed: the active tool's
 * for the `seconds` that have passed, else a step to rest if one is due, else nothing. */
void viewer_app_work(struct viewer_app *app, double seconds);
bool viewer_app_busy(const struct viewer_app *app); /* more work is due without a further event */

#endif
