/* raycast_rows.h - private to raycast.c: what the rays of a picture hit first. A triangle is tested against the rays through its own
 * projection only: far fewer tests than a search for each ray takes. */
#ifndef EXAMPLES_PICTURES_RAYCAST_ROWS_H
#define EXAMPLES_PICTURES_RAYCAST_ROWS_H

#include "base/bvh.h"
#include "pictures/raycast.h"

enum { RAYCAST_BAND = 4 }; /* rows of pixels that are worked on together */

/* A ray through a sample of the picture. */
struct raycast_ray {
    float origin[3], direction[3];
    struct bvh_hit hit; /* t INFINITY: nothing */
};

struct raycast_rows {
    const struct raycast_camera *camera;
    struct raycast_frame frame;
    const float *corners; /* 9 floats a triangle */
    int width, height;    /* of the picture, pixels */
    int samples;          /* along a side of a pixel */
    size_t *starts;       /* band b has the triangles items[starts[b] .. starts[b + 1]) */
    uint32_t *items;
};

/* Sorts the triangles into bands; the caller sets all but starts and items. Returns false if memory is short. */
bool raycast_rows_create(struct raycast_rows *rows, size_t triangle_count);
void raycast_rows_free(struct raycast_rows *rows);

int raycast_band_count(const struct raycast_rows *rows);

/* Returns where sample i of a row or column lies, in pixels; n samples a pixel. */
static inline float raycast_sample(int i, int n) { return (float)(i / n) + ((float)(i % n) + 0.5f) / (float)n; }

/* Fills the rays of a band: `samples` rows of width * samples rays for each row of pixels, from the top. */
void raycast_band_trace(const struct raycast_rows *rows, int band, struct raycast_ray *rays);

#endif
