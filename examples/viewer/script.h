/* script.h - events from a file in the place of a hand: for tests and for pictures that can be made again.
 *
 *   move X Y [FRAMES]          the pointer goes there, a share of the way in each frame (1)
 *   press left|right|middle [shift] [ctrl]
 *   release left|right|middle
 *   scroll NOTCHES [ctrl]
 *   key K [shift] [ctrl]       a letter, a digit, a bracket, enter, escape
 *   drop FILE
 *   frames N                   time passes: 1/60 s each
 *   rest                       until nothing moves any more
 *   screenshot FILE            the next picture into a PNG file
 *   # and what follows it is a remark
 *
 * Places are those of the window, (0, 0) its upper left corner. */
#ifndef EXAMPLES_VIEWER_SCRIPT_H
#define EXAMPLES_VIEWER_SCRIPT_H

#include "viewer/app.h"

/* Called after each frame's work to show it; picture: NULL, or the PNG file to write. False: it could not, and app->message says
 * why. The function itself may be NULL: then nothing is shown. */
typedef bool (*viewer_show_fn)(void *user, const char *picture);

/* False: one line in `error`. */
bool viewer_script_run(const char *path, struct viewer_app *app, viewer_show_fn show, void *user, char error[VIEWER_TEXT]);

#endif
