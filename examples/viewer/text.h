/* text.h - the text in the corner of the viewer's picture. */
#ifndef EXAMPLES_VIEWER_TEXT_H
#define EXAMPLES_VIEWER_TEXT_H

#include "pictures/image.h"
#include "viewer/app.h"

/* Builds the text: tool and its buttons, view, springls, `times`, message; or the manual. Lines that begin with '*' are
 * bright. */
void viewer_text(const struct viewer_app *app, const char *times, char *text, size_t size);

/* Draws bright letters on black in a picture as large as the text. Returns false if memory is short. */
bool viewer_text_picture(const char *text, struct image *picture);

#endif
