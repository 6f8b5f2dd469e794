/* gl.h - drawing with OpenGL 3.3 core or WebGL 2 in the current context: surfaces, the pointer's stroke, a panel of text. */
#ifndef EXAMPLES_VIEWER_GL_H
#define EXAMPLES_VIEWER_GL_H

#include "pictures/image.h"
#include "viewer/camera.h"

#include <stddef.h>

enum { VIEWER_GL_ARRAYS = 4 }; /* positions, normals, originals, colors: 3 floats a vertex */

struct viewer_surface {
    unsigned vertex_array, buffers[VIEWER_GL_ARRAYS + 1]; /* the last one: indices of triangles, then of their edges */
    int indices, edge_indices;
    unsigned index_type;
};

struct viewer_gl {
    unsigned surface_program, flat_program, nothing, picture;
    unsigned target, target_color, target_depth;  /* multisampled */
    unsigned resolved, resolved_color;
    int width, height, samples;
    bool windowless; /* there is no window to copy a frame to */
    int picture_width, picture_height;
};

/* How a surface is drawn. */
struct viewer_paint {
    struct color base;
    int painting;           /* 0 base, 1 the checker of the correspondences, 2 the vertices' colors */
    bool tinted;            /* base and checker are multiplied by the vertices' colors */
    bool edges, wires;
    float offset[3];
    const float *middle;    /* of the original's box */
    const float *brush;     /* centre and radius; NULL: none */
};

/* Creates programs and buffers. Returns false with one line in `error`. */
bool viewer_gl_create(struct viewer_gl *gl, char *error, size_t size);
void viewer_gl_destroy(struct viewer_gl *gl);

/* Copies a surface to the device. arrays: NULL or vertex_count * 3 floats each; triangles: uint16_t, or of 4 bytes. */
void viewer_gl_set(struct viewer_surface *surface, const float *const arrays[VIEWER_GL_ARRAYS], int vertex_count,
                   const void *triangles, size_t index_bytes, int triangle_count);
void viewer_gl_set_colors(const struct viewer_surface *surface, const float *colors, int vertex_count); /* the last array anew */
void viewer_gl_unset(struct viewer_surface *surface);
void viewer_gl_set_panel(struct viewer_gl *gl, const struct image *picture);

/* Draw a frame: begin, draw, line and panel in this order, show. `width` and `height` are pixels. begin returns false if there
 * is no memory for them. */
bool viewer_gl_begin(struct viewer_gl *gl, int width, int height);
void viewer_gl_draw(const struct viewer_gl *gl, const struct viewer_surface *surfaces, int count,
                    const struct viewer_camera *camera, const struct viewer_paint *paint);
void viewer_gl_line(const struct viewer_gl *gl, const float ends[4], struct color color); /* pixels from the upper left corner */
void viewer_gl_panel(const struct viewer_gl *gl);                                         /* draws it in the upper left corner */
void viewer_gl_show(const struct viewer_gl *gl); /* completes the frame and copies it to the window */

/* Copies the frame to a picture, for image_free. */
bool viewer_gl_read(const struct viewer_gl *gl, struct image *picture);

#endif
