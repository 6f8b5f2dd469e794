/* model_pictures.h - ray-cast pictures of a springls_context: its zero level, its springls, films of both. */
#ifndef EXAMPLES_SPRINGLS_MODEL_PICTURES_H
#define EXAMPLES_SPRINGLS_MODEL_PICTURES_H

#include "pictures/image.h"
#include "pictures/raycast.h"
#include "springls.h"

/* A copy of the model at one time. Call model_frame_free before the context is destroyed. */
struct model_frame {
    springls_mesh surface, soup;
    float *corners;   /* of the springls, 9 each, counter-clockwise seen from outside; NULL: the soup has them */
    int corner_count; /* springls that they are of */
    char caption[48];
};

bool model_frame_take(springls_context *ctx, const char *caption, struct model_frame *frame);
/* Takes a frame for views that are not by correspondence: finding the places of all corners takes longer than all pictures. */
bool model_frame_take_plain(springls_context *ctx, const char *caption, struct model_frame *frame);
void model_frame_free(springls_context *ctx, struct model_frame *frame);

struct model_view {
    float direction[3], up[3]; /* from the object to the eye; the direction upwards */
    int width, height;         /* pixels of one picture; 0 = 420, and as high as wide */
    bool by_correspondence;    /* color by the place on the original surface; else gray */
    bool follow;               /* films: the camera moves with the body, without turning */
    bool over_surface;         /* draw springls on the pale zero level; else their gaps are transparent */
};

/* Writes the zero level and beside it a close-up of springls: a small square of the first picture, `zoom` times as large. */
bool model_portrait_write(const struct model_frame *frame, const struct model_view *view, float zoom, const char *path);

/* Writes two rows of pictures, zero level above and springls below, with one camera for all frames (or following). */
bool model_film_write(const struct model_frame *frames, int count, const struct model_view *view, const char *path);

#endif
