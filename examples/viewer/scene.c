#include "viewer/scene.h"

#include "base/progress.h"
#include "viewer/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct color clay = {0.62f, 0.70f, 0.80f}, other_clay = {0.85f, 0.66f, 0.45f}, ink = {0.9f, 0.25f, 0.1f};

bool viewer_scene_create(struct viewer_scene *scene, char *error, size_t size)
{
    memset(scene, 0, sizeof *scene);
    return viewer_gl_create(&scene->gl, error, size);
}

static void forget_chunks(struct viewer_scene *scene)
{
    for (int i = 0; i < scene->chunk_room; ++i) {
        viewer_gl_unset(&scene->chunks[i]);
        free(scene->bricks[i].ids);
    }
    free(scene->chunks);
    free(scene->bricks);
    scene->chunks = NULL;
    scene->bricks = NULL;
    scene->chunk_room = scene->chunk_count = 0;
}

void viewer_scene_destroy(struct viewer_scene *scene)
{
    forget_chunks(scene);
    viewer_gl_unset(&scene->body);
    viewer_gl_unset(&scene->second);
    viewer_gl_destroy(&scene->gl);
}

/* Darkens the colors of a vertex, or white, by the mask of its springl. */
static void tint(const float *color, float mask, float out[3])
{
    for (int i = 0; i < 3; ++i) {
        out[i] = (color ? color[i] : 1.0f) * (1.0f - 0.65f * mask);
    }
}

/* Colors a mesh by what its springls carry: colors, if `textured`, and the mask. NULL: there is neither, or memory is short. */
static float *colors_of(struct viewer_model *model, const springls_mesh *mesh, bool textured)
{
    float *colors = textured ? viewer_model_colors(model, mesh) : NULL;
    const springls_view mask = springls_view_attribute(model->ctx, model->mask);
    if (model->mask < 0) {
        return colors;
    }
    float *tinted = malloc((size_t)mesh->vertex_count * 3 * sizeof *tinted);
    for (int v = 0; tinted && v < mesh->vertex_count; ++v) {
        tint(colors ? colors + 3 * v : NULL, viewer_model_mask_of(&mask, mesh->springls[v]), tinted + 3 * v);
    }
    free(colors);
    return tinted;
}

/* Uploads springls with the gaps between them, or the watertight surface. */
static bool send(struct viewer_surface *surface, struct viewer_model *model, enum viewer_view view)
{
    springls_mesh mesh;
    if (!viewer_model_finish(model)) {
        return false;
    }
    const springls_status status =
        view == VIEWER_SPRINGLS ? springls_extract_soup(model->ctx, &mesh) : springls_extract_mesh(model->ctx, &mesh);
    if (!viewer_model_check(model, status)) {
        return false;
    }
    float *colors = colors_of(model, &mesh, view == VIEWER_TEXTURE);
    const float *const arrays[VIEWER_GL_ARRAYS] = {mesh.positions, mesh.normals, mesh.correspondences, colors};
    viewer_gl_set(surface, arrays, mesh.vertex_count, mesh.triangles, sizeof *mesh.triangles, mesh.triangle_count);
    free(colors);
    springls_mesh_free(model->ctx, &mesh);
    return true;
}

/* Finds the place of a brick, or a free one. */
static int place_of(const struct viewer_brick *bricks, int room, const int brick[3])
{
    unsigned hash = (unsigned)brick[0] * 73856093u ^ (unsigned)brick[1] * 19349663u ^ (unsigned)brick[2] * 83492791u;
    for (;; ++hash) {
        const int place = (int)(hash & (unsigned)(room - 1));
        if (!bricks[place].used || memcmp(bricks[place].at, brick, sizeof bricks[place].at) == 0) {
            return place;
        }
    }
}

/* Makes room for one more chunk in a table that is at most half full. */
static bool grow_chunks(struct viewer_scene *scene)
{
    const int room = scene->chunk_room ? 2 * scene->chunk_room : 1024;
    if (2 * (scene->chunk_count + 1) <= scene->chunk_room) {
        return true;
    }
    struct viewer_surface *chunks = calloc((size_t)room, sizeof *chunks);
    struct viewer_brick *bricks = calloc((size_t)room, sizeof *bricks);
    if (!chunks || !bricks) {
        free(chunks);
        free(bricks);
        return false;
    }
    for (int i = 0; i < scene->chunk_room; ++i) {
        if (scene->bricks[i].used) {
            const int place = place_of(bricks, room, scene->bricks[i].at);
            chunks[place] = scene->chunks[i];
            bricks[place] = scene->bricks[i];
        }
    }
    free(scene->chunks);
    free(scene->bricks);
    scene->chunks = chunks;
    scene->bricks = bricks;
    scene->chunk_room = room;
    return true;
}

/* The mask by ids of springls. */
struct masks {
    float *values; /* NULL: nothing is masked, or memory is short */
    uint32_t count;
};

static struct masks masks_by_id(const struct viewer_model *model)
{
    const springls_view mask = springls_view_attribute(model->ctx, model->mask);
    const uint32_t *ids = springls_ids(model->ctx);
    struct masks masks = {NULL, 0};
    for (int i = 0; i < mask.count; ++i) {
        masks.count = ids[i] >= masks.count ? ids[i] + 1 : masks.count;
    }
    masks.values = mask.count ? calloc(masks.count, sizeof *masks.values) : NULL;
    for (int i = 0; masks.values && i < mask.count; ++i) {
        masks.values[ids[i]] = viewer_model_mask_of(&mask, i);
    }
    return masks;
}

/* Darkens what is masked of the chunk at a place. */
static void tint_chunk(struct viewer_scene *scene, int place, const struct masks *masks)
{
    const struct viewer_brick *brick = &scene->bricks[place];
    float *colors = brick->ids && masks->values ? malloc((size_t)brick->vertex_count * 3 * sizeof *colors) : NULL;
    for (int v = 0; colors && v < brick->vertex_count; ++v) {
        tint(NULL, brick->ids[v] < masks->count ? masks->values[brick->ids[v]] : 0.0f, colors + 3 * v);
    }
    viewer_gl_set_colors(&scene->chunks[place], colors, brick->vertex_count);
    free(colors);
}

/* Uploads a chunk. */
static bool send_chunk(struct viewer_scene *scene, const springls_chunk *chunk, const struct masks *masks)
{
    if (!grow_chunks(scene)) {
        return false;
    }
    const int place = place_of(scene->bricks, scene->chunk_room, chunk->brick);
    struct viewer_brick *brick = &scene->bricks[place];
    free(brick->ids);
    brick->ids = NULL;
    if (chunk->triangle_count == 0) {
        viewer_gl_unset(&scene->chunks[place]);
        return true;
    }
    scene->chunk_count += !brick->used;
    brick->used = true;
    memcpy(brick->at, chunk->brick, sizeof brick->at);
    brick->vertex_count = chunk->vertex_count;
    brick->ids = chunk->ids ? malloc((size_t)chunk->vertex_count * sizeof *brick->ids) : NULL;
    if (brick->ids) {
        memcpy(brick->ids, chunk->ids, (size_t)chunk->vertex_count * sizeof *brick->ids);
    }
    const float *const arrays[VIEWER_GL_ARRAYS] = {chunk->positions, chunk->normals, chunk->correspondences, NULL};
    viewer_gl_set(&scene->chunks[place], arrays, chunk->vertex_count, chunk->triangles, sizeof *chunk->triangles,
                  chunk->triangle_count);
    if (masks->values) {
        tint_chunk(scene, place, masks);
    }
    return true;
}

/* Uploads the surface's chunks that have changed, once all are made, and the mask if that has changed. */
static bool send_chunks(struct viewer_scene *scene, struct viewer_model *model, bool material)
{
    const springls_chunk *changed;
    int count;
    if (!viewer_model_chunks(model, material, &changed, &count)) {
        return false;
    }
    if (model->chunks_in_progress) { /* the chunks of before are drawn meanwhile */
        return true;
    }
    if (scene->chunk_generation != model->chunk_generation) {
        forget_chunks(scene);
        scene->chunk_generation = model->chunk_generation;
    }
    struct masks masks = masks_by_id(model);
    bool good = true;
    for (const springls_chunk *c = changed; good && c < changed + count; ++c) {
        good = send_chunk(scene, c, &masks);
    }
    for (int i = 0; i < scene->chunk_room && scene->mask_version != model->mask_version; ++i) {
        if (scene->bricks[i].ids) {
            tint_chunk(scene, i, &masks);
        }
    }
    scene->mask_version = model->mask_version;
    free(masks.values);
    return good || viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
}

/* Returns true if the surface is drawn in chunks; springls, and colors that they carry, are whole meshes. */
static bool in_chunks(const struct viewer_app *app)
{
    return app->view != VIEWER_SPRINGLS && (app->view != VIEWER_TEXTURE || app->model.colors < 0);
}

/* Uploads what has changed. */
static bool refresh(struct viewer_scene *scene, struct viewer_app *app)
{
    bool good = true;
    if (app->model.chunks_in_progress || scene->body_version != app->model.version || scene->body_view != app->view) {
        if (!app->model.chunks_in_progress) {
            scene->body_version = app->model.version;
        }
        app->model.chunks_in_progress = app->model.chunks_in_progress && in_chunks(app); /* else nobody continues them */
        good = in_chunks(app) ? send_chunks(scene, &app->model, app->view == VIEWER_TEXTURE)
                              : send(&scene->body, &app->model, app->view);
    }
    scene->body_view = app->view;
    if (!app->second.ctx) {
        viewer_gl_unset(&scene->second);
        scene->second_version = 0;
    } else if (scene->second_version != app->second.version) {
        good = good && send(&scene->second, &app->second, VIEWER_SURFACE);
        scene->second_version = app->second.version;
    }
    return good;
}

static void draw_surfaces(const struct viewer_scene *scene, const struct viewer_app *app)
{
    const float brush[4] = {app->brush.center[0], app->brush.center[1], app->brush.center[2], app->brush.radius};
    const bool shows_brush = app->hover || (app->hand == VIEWER_WORK && app->tool == VIEWER_DRAG);
    const bool everywhere = app->hand == VIEWER_WORK && app->modifiers & VIEWER_CTRL;
    const bool without_texture = in_chunks(app) && scene->chunk_generation != app->model.chunk_generation; /* not made yet */
    float middle[3];
    for (int a = 0; a < 3; ++a) {
        middle[a] = 0.5f * (app->model.lower[a] + app->model.upper[a]);
    }
    struct viewer_paint paint = {.base = clay,
                                 .painting = app->view != VIEWER_TEXTURE || without_texture ? 0 : app->model.colors < 0 ? 1 : 2,
                                 .tinted = app->model.mask >= 0 && !without_texture,
                                 .edges = app->view == VIEWER_SPRINGLS,
                                 .wires = app->view == VIEWER_WIREFRAME,
                                 .middle = middle,
                                 .brush = shows_brush && !everywhere && app->tool != VIEWER_CUT ? brush : NULL};
    if (in_chunks(app)) {
        viewer_gl_draw(&scene->gl, scene->chunks, scene->chunk_room, &app->camera, &paint);
    } else {
        viewer_gl_draw(&scene->gl, &scene->body, 1, &app->camera, &paint);
    }
    struct viewer_paint second = {.base = other_clay, .wires = paint.wires};
    memcpy(second.offset, app->offset, sizeof second.offset);
    viewer_gl_draw(&scene->gl, &scene->second, 1, &app->camera, &second);
}

static void draw_stroke(const struct viewer_scene *scene, const struct viewer_app *app)
{
    const float width = (float)scene->gl.width, height = (float)scene->gl.height;
    const float scale[2] = {width / (float)app->width, height / (float)app->height}; /* pixels a unit of the window */
    float ends[4];
    for (int i = 0; i < 4; ++i) {
        ends[i] = app->stroke[i] * scale[i % 2];
    }
    if (app->hand == VIEWER_WORK && app->tool == VIEWER_CUT) {
        viewer_gl_line(&scene->gl, ends, ink);
    }
}

static void write_panel(struct viewer_scene *scene, const struct viewer_app *app)
{
    char text[sizeof scene->text];
    char times[128] = "";
    struct image picture;
    if (scene->show_times) {
        snprintf(times, sizeof times, "step %.0f ms, mesh %.0f ms, draw %.0f ms", 1e3 * app->model.step_seconds,
                 1e3 * scene->mesh_seconds, 1e3 * scene->draw_seconds);
    }
    viewer_text(app, times, text, sizeof text);
    if (strcmp(text, scene->text) != 0 && viewer_text_picture(text, &picture)) {
        memcpy(scene->text, text, sizeof text);
        viewer_gl_set_panel(&scene->gl, &picture);
        image_free(&picture);
    }
}

bool viewer_scene_draw(struct viewer_scene *scene, struct viewer_app *app, int width, int height)
{
    const double begin = elapsed_seconds();
    const bool good = refresh(scene, app);
    const double made = elapsed_seconds();
    if (!good || !viewer_gl_begin(&scene->gl, width, height)) {
        snprintf(app->message, sizeof app->message, "%s", good ? "no memory for the picture" : app->model.error);
        return false;
    }
    draw_surfaces(scene, app);
    draw_stroke(scene, app);
    write_panel(scene, app);
    viewer_gl_panel(&scene->gl);
    viewer_gl_show(&scene->gl);
    if (app->hand != VIEWER_IDLE || viewer_app_busy(app)) { /* show times only of frames with work */
        scene->mesh_seconds = made - begin;
        scene->draw_seconds = elapsed_seconds() - made;
    }
    return true;
}

bool viewer_scene_save(const struct viewer_scene *scene, const char *path)
{
    struct image picture = {0};
    errno = 0; /* not every failure below sets it */
    const bool good = viewer_gl_read(&scene->gl, &picture) && image_write_png(&picture, path);
    image_free(&picture);
    return good;
}
