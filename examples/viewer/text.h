/* text.h - what the viewer tells in the corner of its picture. */
#ifndef EXAMPLES_VIEWER_TEXT_H
#define EXAMPLES_VIEWER_TEXT_H

#include "pictures/image.h"
#include "viewer/app.h"

/* Tool and what the buttons do with it, view, springls, `times`, message; or the manual. A line beginning with '*' is bright. */
void viewer_text(const struct viewer_app *app, const char *times, char *text, size_t size);

/* Bright letters on black, as large as the text is. False: no memory. */
bool viewer_text_picture(const char *text, struct image *picture);

#endif
