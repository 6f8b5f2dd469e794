#include "viewer/gl.h"

#include "base/vec3.h"
#include "viewer/shaders.h"

#ifdef __EMSCRIPTEN__
  #include <GLES3/gl3.h>
#else
  #include <epoxy/gl.h>
#endif

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(lines) ((int)(sizeof(lines) / sizeof *(lines)))

static GLuint compile(GLenum kind, const char *const *lines, int count, char *error, size_t size)
{
    const GLuint shader = glCreateShader(kind);
    GLint good = 0;
    glShaderSource(shader, count, lines, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (!good) {
        glGetShaderInfoLog(shader, (GLsizei)size, NULL, error);
    }
    return shader;
}

static GLuint link_program(const char *const *vertex, int vertex_lines, const char *const *fragment, int fragment_lines,
                           char *error, size_t size)
{
    const GLuint program = glCreateProgram();
    const GLuint v = compile(GL_VERTEX_SHADER, vertex, vertex_lines, error, size);
    const GLuint f = compile(GL_FRAGMENT_SHADER, fragment, fragment_lines, error, size);
    GLint good = 0;
    glAttachShader(program, v);
    glAttachShader(program, f);
    glLinkProgram(program);
    glDeleteShader(v);
    glDeleteShader(f);
    glGetProgramiv(program, GL_LINK_STATUS, &good);
    if (!good && !*error) {
        glGetProgramInfoLog(program, (GLsizei)size, NULL, error);
    }
    return program;
}

bool viewer_gl_create(struct viewer_gl *gl, char *error, size_t size)
{
    memset(gl, 0, sizeof *gl);
    error[0] = '\0';
    gl->surface_program = link_program(viewer_surface_vertex, COUNT(viewer_surface_vertex), viewer_surface_fragment,
                                       COUNT(viewer_surface_fragment), error, size);
    gl->flat_program = link_program(viewer_flat_vertex, COUNT(viewer_flat_vertex), viewer_flat_fragment,
                                    COUNT(viewer_flat_fragment), error, size);
    glGenVertexArrays(1, &gl->nothing);
    glGenTextures(1, &gl->picture);
    GLint maximum = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &maximum);
    gl->samples = maximum < 4 ? maximum : 4;
    for (char *c = error; *c; ++c) { /* drivers may return several lines */
        *c = *c == '\n' || *c == '\r' ? ' ' : *c;
    }
    return !*error;
}

static void free_target(struct viewer_gl *gl)
{
    glDeleteFramebuffers(1, &gl->target);
    glDeleteFramebuffers(1, &gl->resolved);
    glDeleteRenderbuffers(1, &gl->target_color);
    glDeleteRenderbuffers(1, &gl->target_depth);
    glDeleteRenderbuffers(1, &gl->resolved_color);
    gl->target = gl->resolved = gl->target_color = gl->target_depth = gl->resolved_color = 0;
}

void viewer_gl_destroy(struct viewer_gl *gl)
{
    free_target(gl);
    glDeleteProgram(gl->surface_program);
    glDeleteProgram(gl->flat_program);
    glDeleteVertexArrays(1, &gl->nothing);
    glDeleteTextures(1, &gl->picture);
    memset(gl, 0, sizeof *gl);
}

/* ---- surfaces ---- */

/* Copies the corners of triangles to edges[2 m], the beginning and the end of each edge. */
static void copy_edges(const unsigned char *triangles, size_t index_bytes, int triangle_count, unsigned char *edges)
{
    static const int ends[] = {0, 1, 1, 2, 2, 0};
    for (int t = 0; t < triangle_count; ++t, triangles += 3 * index_bytes) {
        for (int i = 0; i < 6; ++i, edges += index_bytes) {
            memcpy(edges, triangles + (size_t)ends[i] * index_bytes, index_bytes);
        }
    }
}

/* Writes the indices of triangles into the bound buffer, and those of their edges after them: WebGL has no other wireframes.
 * Without memory for them there are no edges. */
static void set_indices(struct viewer_surface *surface, const void *triangles, size_t index_bytes, int triangle_count)
{
    const size_t bytes = 3 * (size_t)triangle_count * index_bytes;
    unsigned char *edges = malloc(2 * bytes + 1);
    surface->indices = 3 * triangle_count;
    surface->edge_indices = edges ? 6 * triangle_count : 0;
    surface->index_type = index_bytes == 2 ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)(edges ? 3 * bytes : bytes), NULL, GL_STREAM_DRAW);
    glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, 0, (GLsizeiptr)bytes, triangles);
    if (edges) {
        copy_edges(triangles, index_bytes, triangle_count, edges);
        glBufferSubData(GL_ELEMENT_ARRAY_BUFFER, (GLintptr)bytes, (GLsizeiptr)(2 * bytes), edges);
    }
    free(edges);
}

/* Copies an array of the bound surface, or turns it off. */
static void set_array(const struct viewer_surface *surface, unsigned number, const float *values, int vertex_count)
{
    if (!values) {
        glDisableVertexAttribArray(number);
        return;
    }
    glBindBuffer(GL_ARRAY_BUFFER, surface->buffers[number]);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)vertex_count * 3 * (GLsizeiptr)sizeof(float), values, GL_STREAM_DRAW);
    glEnableVertexAttribArray(number);
    glVertexAttribPointer(number, 3, GL_FLOAT, GL_FALSE, 0, NULL);
}

void viewer_gl_set(struct viewer_surface *surface, const float *const arrays[VIEWER_GL_ARRAYS], int vertex_count,
                   const void *triangles, size_t index_bytes, int triangle_count)
{
    if (!surface->vertex_array) {
        glGenVertexArrays(1, &surface->vertex_array);
        glGenBuffers(VIEWER_GL_ARRAYS + 1, surface->buffers);
    }
    glBindVertexArray(surface->vertex_array);
    for (unsigned a = 0; a < VIEWER_GL_ARRAYS; ++a) {
        set_array(surface, a, arrays[a], vertex_count);
    }
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, surface->buffers[VIEWER_GL_ARRAYS]);
    set_indices(surface, triangles, index_bytes, triangle_count);
    glBindVertexArray(0);
}

void viewer_gl_set_colors(const struct viewer_surface *surface, const float *colors, int vertex_count)
{
    glBindVertexArray(surface->vertex_array);
    set_array(surface, VIEWER_GL_ARRAYS - 1, colors, vertex_count);
    glBindVertexArray(0);
}

void viewer_gl_unset(struct viewer_surface *surface)
{
    if (surface->vertex_array) {
        glDeleteVertexArrays(1, &surface->vertex_array);
        glDeleteBuffers(VIEWER_GL_ARRAYS + 1, surface->buffers);
    }
    memset(surface, 0, sizeof *surface);
}

void viewer_gl_set_panel(struct viewer_gl *gl, const struct image *picture)
{
    gl->picture_width = picture->width;
    gl->picture_height = picture->height;
    glBindTexture(GL_TEXTURE_2D, gl->picture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, picture->width, picture->height, 0, GL_RGB, GL_FLOAT, picture->rgb);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

/* ---- a frame ---- */

static GLuint make_buffer(GLenum format, int samples, int width, int height)
{
    GLuint buffer;
    glGenRenderbuffers(1, &buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, buffer);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
    return buffer;
}

/* Makes the render target, so that a picture does not depend on what covers the window. */
static bool make_target(struct viewer_gl *gl, int width, int height)
{
    free_target(gl);
    glGenFramebuffers(1, &gl->target);
    glGenFramebuffers(1, &gl->resolved);
    glBindFramebuffer(GL_FRAMEBUFFER, gl->target);
    gl->target_color = make_buffer(GL_RGBA8, gl->samples, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, gl->target_color);
    gl->target_depth = make_buffer(GL_DEPTH_COMPONENT24, gl->samples, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, gl->target_depth);
    bool good = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    glBindFramebuffer(GL_FRAMEBUFFER, gl->resolved);
    gl->resolved_color = make_buffer(GL_RGBA8, 0, width, height);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, gl->resolved_color);
    good = good && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    gl->width = good ? width : 0;
    gl->height = good ? height : 0;
    return good;
}

bool viewer_gl_begin(struct viewer_gl *gl, int width, int height)
{
    if ((width != gl->width || height != gl->height) && !make_target(gl, width, height)) {
        return false;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, gl->target);
    glViewport(0, 0, width, height);
    glClearColor(0.90f, 0.91f, 0.93f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    return true;
}

static void set3(const struct viewer_gl *gl, const char *name, const float v[3])
{
    glUniform3fv(glGetUniformLocation(gl->surface_program, name), 1, v);
}

static void set1(const struct viewer_gl *gl, const char *name, int value)
{
    glUniform1i(glGetUniformLocation(gl->surface_program, name), value);
}

static void set_view(const struct viewer_gl *gl, const struct viewer_camera *camera)
{
    const float aspect = (float)gl->width / (float)gl->height;
    float matrix[16], eye[3];
    const struct raycast_frame frame = viewer_camera_frame(camera, aspect, eye);
    viewer_camera_matrix(camera, aspect, matrix);
    glUniformMatrix4fv(glGetUniformLocation(gl->surface_program, "to_clip"), 1, GL_FALSE, matrix);
    set3(gl, "eye", eye);
    set3(gl, "right", frame.right);
    set3(gl, "up", frame.up);
    set3(gl, "forward", frame.forward);
}

static void draw_triangles(const struct viewer_surface *surfaces, int count)
{
    for (int i = 0; i < count; ++i) {
        if (surfaces[i].indices > 0) {
            glBindVertexArray(surfaces[i].vertex_array);
            glDrawElements(GL_TRIANGLES, surfaces[i].indices, surfaces[i].index_type, NULL);
        }
    }
    glBindVertexArray(0);
}

static void draw_edges(const struct viewer_surface *surfaces, int count)
{
    for (int i = 0; i < count; ++i) {
        const struct viewer_surface *s = &surfaces[i];
        if (s->edge_indices > 0) {
            const size_t first = (size_t)s->indices * (s->index_type == GL_UNSIGNED_SHORT ? sizeof(uint16_t) : sizeof(uint32_t));
            glBindVertexArray(s->vertex_array);
            glDrawElements(GL_LINES, s->edge_indices, s->index_type, (const void *)first);
        }
    }
    glBindVertexArray(0);
}

/* Draws edges over a surface that only hides the edges behind it. */
static void draw_wires(const struct viewer_gl *gl, const struct viewer_surface *surfaces, int count)
{
    static const float paper[3] = {0.97f, 0.97f, 0.98f}, ink[3] = {0.15f, 0.2f, 0.35f};
    set1(gl, "plain", 1);
    set3(gl, "base", paper);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(1.0f, 1.0f);
    draw_triangles(surfaces, count);
    glDisable(GL_POLYGON_OFFSET_FILL);
    set3(gl, "base", ink);
    draw_edges(surfaces, count);
}

void viewer_gl_draw(const struct viewer_gl *gl, const struct viewer_surface *surfaces, int count,
                    const struct viewer_camera *camera, const struct viewer_paint *paint)
{
    static const float none[4] = {0.0f, 0.0f, 0.0f, 0.0f};
    const float base[3] = {paint->base.r, paint->base.g, paint->base.b};
    glUseProgram(gl->surface_program);
    glEnable(GL_DEPTH_TEST);
    set_view(gl, camera);
    set3(gl, "offset", paint->offset);
    set3(gl, "base", base);
    set3(gl, "middle", paint->middle ? paint->middle : none);
    set1(gl, "painting", paint->painting);
    set1(gl, "tinted", paint->tinted);
    set1(gl, "edges", paint->edges);
    set1(gl, "plain", 0);
    glUniform4fv(glGetUniformLocation(gl->surface_program, "brush"), 1, paint->brush ? paint->brush : none);
    if (paint->wires) {
        draw_wires(gl, surfaces, count);
    } else {
        draw_triangles(surfaces, count);
    }
    glDisable(GL_DEPTH_TEST);
}

/* Draws a quadrilateral; corners in pixels from the upper left corner of the window. */
static void draw_quadrilateral(const struct viewer_gl *gl, float corners[8], bool textured, struct color color)
{
    for (int i = 0; i < 8; i += 2) {
        corners[i] = 2.0f * corners[i] / (float)gl->width - 1.0f;
        corners[i + 1] = 1.0f - 2.0f * corners[i + 1] / (float)gl->height;
    }
    glUseProgram(gl->flat_program);
    glUniform2fv(glGetUniformLocation(gl->flat_program, "corners"), 4, corners);
    glUniform1i(glGetUniformLocation(gl->flat_program, "textured"), textured);
    glUniform4f(glGetUniformLocation(gl->flat_program, "color"), color.r, color.g, color.b, 1.0f);
    glBindTexture(GL_TEXTURE_2D, gl->picture);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glBindVertexArray(gl->nothing);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glBindVertexArray(0);
    glDisable(GL_BLEND);
}

void viewer_gl_line(const struct viewer_gl *gl, const float ends[4], struct color color)
{
    const float half_width = 1.5f;
    float along[3] = {ends[2] - ends[0], ends[3] - ends[1], 0.0f};
    if (vec3_length(along) > 0.0f) {
        vec3_normalize(along);
        const float x = -along[1] * half_width, y = along[0] * half_width;
        float corners[8] = {ends[0] - x, ends[1] - y, ends[2] - x, ends[3] - y,
                            ends[0] + x, ends[1] + y, ends[2] + x, ends[3] + y};
        draw_quadrilateral(gl, corners, false, color);
    }
}

void viewer_gl_panel(const struct viewer_gl *gl)
{
    const float w = (float)gl->picture_width, h = (float)gl->picture_height;
    float corners[8] = {0.0f, h, w, h, 0.0f, 0.0f, w, 0.0f};
    if (gl->picture_width > 0) {
        draw_quadrilateral(gl, corners, true, color_rgb(0.0f, 0.0f, 0.0f));
    }
}

static void copy(const struct viewer_gl *gl, GLuint from, GLuint to)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, from);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to);
    glBlitFramebuffer(0, 0, gl->width, gl->height, 0, 0, gl->width, gl->height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void viewer_gl_show(const struct viewer_gl *gl)
{
    copy(gl, gl->target, gl->resolved);
    if (!gl->windowless) {
        copy(gl, gl->resolved, 0);
    }
}

bool viewer_gl_read(const struct viewer_gl *gl, struct image *picture)
{
    if (!image_create(picture, gl->width, gl->height, color_rgb(0.0f, 0.0f, 0.0f))) {
        return false;
    }
    const size_t row = 3 * (size_t)gl->width;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, gl->resolved);
    for (int y = 0; y < gl->height; ++y) { /* OpenGL's first row is the lowest */
        glReadPixels(0, gl->height - 1 - y, gl->width, 1, GL_RGB, GL_FLOAT, picture->rgb + row * (size_t)y);
    }
    return glGetError() == GL_NO_ERROR;
}
