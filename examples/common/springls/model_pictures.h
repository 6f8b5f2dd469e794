/* model_pictures.h - ray-cast pictures of a springls_context: its zero level, its springls, films of both. */
#ifndef EXAMPLES_SPRINGLS_MODEL_PICTURES_H
#define EXAMPLES_SPRINGLS_MODEL_PICTURES_H

#include "pictures/image.h"
#include "pictures/raycast.h"
#include "springls.h"

/* The model at one time: copies, so that it may move on. Free with model_frame_free before the context goes. */
struct model_frame {
    springls_mesh surface, soup;
    char caption[48];
};

bool model_frame_take(springls_context *ctx, const char *caption, struct model_frame *frame);
void model_frame_free(springls_context *ctx, struct model_frame *frame);

struct model_view {
    float direction[3], up[3]; /* from the object to the eye; the direction upwards */
    int width, height;         /* pixels of one picture; 0 = 420, and as high as wide */
    bool by_correspondence;    /* colour = place on the original surface; else grey */
    bool follow;               /* films: the camera moves along with the body, without turning */
    bool over_surface;         /* springls lie on the pale zero level; else one looks through between them */
};

/* The zero level, and beside it springls nearby: what a small square in the first picture holds, `zoom` times as large. */
bool model_portrait_write(const struct model_frame *frame, const struct model_view *view, float zoom, const char *path);

/* Two rows of pictures, zero level above and springls below, one camera that sees all frames (or follows). */
bool model_film_write(const struct model_frame *frames, int count, const struct model_view *view, const char *path);

#endif
