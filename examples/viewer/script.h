/* script.h - events from a file instead of a user, for tests and for reproducible pictures.
 *
 *   move X Y [FRAMES]          moves the pointer there in equal steps, one in each frame (1)
 *   press left|right|middle [shift] [ctrl]
 *   release left|right|middle
 *   scroll NOTCHES [ctrl]
 *   key K [shift] [ctrl]       a letter, a digit, a sign, enter, escape
 *   drop FILE
 *   save FILE                  as ctrl S does; a failure ends the script
 *   frames N                   lets time pass, 1/60 s each
 *   rest                       waits until nothing moves
 *   screenshot FILE            writes the next picture to a PNG file
 *   # begins a comment
 *
 * Places are window coordinates, (0, 0) the upper left corner. */
#ifndef EXAMPLES_VIEWER_SCRIPT_H
#define EXAMPLES_VIEWER_SCRIPT_H

#include "viewer/app.h"

/* Shows a frame after its work; picture: NULL, or the PNG file to write. Returns false with the reason in app->message. The
 * function pointer may be NULL: then nothing is shown. */
typedef bool (*viewer_show_fn)(void *user, const char *picture);

/* Runs a script. Returns false with one line in `error`. */
bool viewer_script_run(const char *path, struct viewer_app *app, viewer_show_fn show, void *user, char error[VIEWER_TEXT]);

#endif
