#include "viewer/text.h"

#include <stdio.h>
#include <string.h>

#define LETTER 8.0f  /* pixels */
#define LINE 15
#define MARGIN 8

static const char *const tool_help[VIEWER_TOOLS] = {
    "what is in the brush follows the pointer",        "inward; shift: outward",
    "the brush; shift: deflate; ctrl: the whole body", "the brush; ctrl: the whole body",
    "along a stroke; shift: all to its right",         "click: a ball; drag it; enter: merge",
    "what is masked stays; shift: unmask",
};

void viewer_text(const struct viewer_app *app, const char *times, char *text, size_t size)
{
    const int count = springls_count(app->model.ctx);
    if (app->help) {
        snprintf(text, size, "%s", viewer_manual);
        return;
    }
    const struct viewer_brush *brush = &app->brush;
    snprintf(text, size, "*%s: %s\nbrush: %.0f voxels of %d, strength %.0f %%, %s, %s\nview: %s%s, %d springls%s%s\nH: help%s%s\n",
             viewer_tool_names[app->tool], tool_help[app->tool], (double)(brush->radius / app->model.voxel), app->model.grid,
             100.0 * (double)brush->strength, viewer_falloff_names[brush->falloff], viewer_symmetry_names[brush->symmetry],
             viewer_view_names[app->view], app->model.mask >= 0 ? ", masked" : "", count, *times ? ", " : "", times,
             *app->message ? "\n*" : "", app->message);
}

/* Calls `image_text` for each line, or only computes the width of the widest. */
static int each_line(const char *text, struct image *picture, float *widest)
{
    const struct color bright = color_rgb(1.0f, 0.95f, 0.7f), plain = color_rgb(0.85f, 0.87f, 0.9f);
    char line[256];
    int lines = 0;
    while (*text) {
        const size_t length = strcspn(text, "\n"), kept = length < sizeof line ? length : sizeof line - 1;
        memcpy(line, text, kept);
        line[kept] = '\0';
        const char *words = line + (line[0] == '*');
        *widest = image_text_width(LETTER, words) > *widest ? image_text_width(LETTER, words) : *widest;
        if (picture) {
            image_text(picture, MARGIN, (float)(MARGIN + LETTER + (float)(lines * LINE)), LETTER, 0.0f,
                       words > line ? bright : plain, words);
        }
        text += length + (text[length] == '\n');
        ++lines;
    }
    return lines;
}

bool viewer_text_picture(const char *text, struct image *picture)
{
    float widest = 0.0f;
    const int lines = each_line(text, NULL, &widest);
    if (!image_create(picture, (int)widest + 2 * MARGIN, lines * LINE + 2 * MARGIN - 4, color_rgb(0.0f, 0.0f, 0.0f))) {
        return false;
    }
    each_line(text, picture, &widest);
    return true;
}
