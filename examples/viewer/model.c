#include "viewer/model.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "pictures/raycast.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COLOR "color"          /* the name of the attribute */
#define MASK "mask"
#define WHOLLY_MASKED 0.999f
#define BODY_SHARE (2.0 / 3.0) /* of the side that desc->grid.size[0] gives */
#define LARGEST_GRID 4096

static const springls_attribute_desc mask_attribute = {MASK, 1, SPRINGLS_POLICY_COPY, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_COPY};

static const springls_attribute_desc color_attribute = {COLOR, 3, SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND,
                                                        SPRINGLS_POLICY_BLEND};

static bool refuse(struct viewer_model *model, const char *text)
{
    snprintf(model->error, sizeof model->error, "%s", text);
    return false;
}

bool viewer_model_check(struct viewer_model *model, springls_status status)
{
    const char *reason = model->ctx ? springls_last_error(model->ctx) : "";
    return status == SPRINGLS_OK || refuse(model, *reason ? reason : springls_status_string(status));
}

void viewer_model_free(struct viewer_model *model)
{
    if (model->ctx) {
        springls_chunks_destroy(model->ctx, model->chunks);
    }
    springls_destroy(model->ctx);
    free(model->force_user);
    free(model->force_samples);
    memset(model, 0, sizeof *model);
}

static void note_reason(void *user, int level, const char *message)
{
    if (level == 1) {
        snprintf(user, VIEWER_TEXT, "%s", message);
    }
}

static double clock_now(void *user)
{
    (void)user;
    return elapsed_seconds();
}

/* Creates the context of model->desc. */
static bool create_context(struct viewer_model *model)
{
    model->desc.trace.now = clock_now;
    springls_desc noting = model->desc; /* springls_create passes its reason only to the logger */
    noting.logger.log = note_reason;
    noting.logger.user = model->error;
    springls_context *trial;
    if (springls_create(&noting, &trial) != SPRINGLS_OK) {
        return false;
    }
    springls_destroy(trial);
    return viewer_model_check(model, springls_create(&model->desc, &model->ctx));
}

/* Creates a context with a cubic grid of `side` voxels around `middle`. */
static bool create_around(struct viewer_model *model, const springls_desc *desc, int side, const float middle[3], double spacing)
{
    memset(model, 0, sizeof *model);
    model->desc = *desc;
    model->grid = desc->grid.size[0];
    model->voxel = (float)spacing;
    model->colors = model->mask = -1;
    memcpy(model->middle, middle, sizeof model->middle);
    for (int a = 0; a < 3; ++a) {
        model->desc.grid.size[a] = side;
        model->desc.grid.spacing[a] = spacing;
        model->desc.grid.origin[a] = (double)middle[a] - 0.5 * spacing * (side - 1);
    }
    return create_context(model);
}

/* Creates a context for a body of this length, with room around it. Its bricks are only near the surface: room costs nothing. */
static bool create_roomy(struct viewer_model *model, const springls_desc *desc, const float middle[3], double longest)
{
    const int cube = desc->grid.size[0], most = cube > LARGEST_GRID ? cube : LARGEST_GRID;
    springls_desc roomy = *desc;
    roomy.follow = true;
    return create_around(model, &roomy, cube < most / VIEWER_ROOM ? VIEWER_ROOM * cube : most, middle,
                         longest / (BODY_SHARE * cube));
}

bool viewer_model_replace(struct viewer_model *model, struct viewer_model *made, bool good)
{
    if (good) {
        made->version = model->version + 1;
        made->chunk_generation = model->chunk_generation + 1;
        made->mask_version = model->mask_version + 1;
        made->budget = model->budget;
        viewer_model_free(model);
        *model = *made;
    } else {
        snprintf(model->error, sizeof model->error, "%s", made->error);
        springls_destroy(made->ctx);
    }
    return good;
}

bool viewer_model_box(const struct viewer_model *model, float lower[3], float upper[3])
{
    const springls_view view = springls_view_particles(model->ctx);
    float corners[6] = {INFINITY, INFINITY, INFINITY, -INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < view.count; ++i) {
        const float *p = (const float *)(const void *)((const char *)view.data + (size_t)i * view.stride);
        raycast_grow_box(p, 1, corners, corners + 3);
    }
    if (view.count == 0) {
        return false;
    }
    springls_to_world(model->ctx, corners, 2, corners);
    memcpy(lower, corners, 3 * sizeof *lower);
    memcpy(upper, corners + 3, 3 * sizeof *upper);
    return true;
}

static bool take_box(struct viewer_model *model)
{
    springls_measures measures;
    if (!viewer_model_check(model, springls_measure(model->ctx, &measures))) {
        return false;
    }
    memcpy(model->lower, measures.lower, sizeof model->lower);
    memcpy(model->upper, measures.upper, sizeof model->upper);
    return true;
}

static bool set_implicit(struct viewer_model *model, springls_implicit_fn fn, void *user)
{
    return viewer_model_check(model, springls_set_implicit(model->ctx, fn, user)) && take_box(model);
}

/* Gives every springl the color of its place on the mesh; later springls inherit it. */
static bool take_colors(struct viewer_model *model, const struct mesh *mesh, const int *triangles)
{
    const int count = springls_count(model->ctx);
    springls_material *places = malloc((size_t)count * sizeof *places);
    float *values = malloc(3 * (size_t)count * sizeof *values);
    springls_status status = places && values ? springls_springl_materials(model->ctx, places) : SPRINGLS_OUT_OF_MEMORY;
    if (status == SPRINGLS_OK) {
        status = springls_interpolate_material(places, count, mesh->colors, 3, triangles, (int)mesh->triangle_count, values);
    }
    if (status == SPRINGLS_OK) {
        status = springls_add_attribute(model->ctx, &color_attribute, values, &model->colors);
    }
    free(places);
    free(values);
    return viewer_model_check(model, status);
}

static bool set_mesh(struct viewer_model *model, const struct mesh *mesh)
{
    int *triangles = malloc(3 * mesh->triangle_count * sizeof *triangles);
    if (!triangles) {
        return refuse(model, "not enough memory for the mesh");
    }
    for (size_t i = 0; i < 3 * mesh->triangle_count; ++i) {
        triangles[i] = (int)mesh->indices[i];
    }
    const springls_status status = springls_set_mesh(model->ctx, mesh->positions, (int)mesh->vertex_count, 0, triangles,
                                                     (int)mesh->triangle_count, NULL);
    const bool good = viewer_model_check(model, status) && viewer_model_check(model, springls_remesh(model->ctx))
                   && (!mesh->colors || take_colors(model, mesh, triangles));
    free(triangles);
    model->rest_steps_due = 2 * springls_get_params(model->ctx).resample_period;
    return good && take_box(model);
}

/* Computes the middle of the mesh's box; returns the length of its longest side. */
static float box_of(const struct mesh *mesh, float middle[3])
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY}, longest = 0.0f;
    raycast_grow_box(mesh->positions, mesh->vertex_count, lo, hi);
    for (int a = 0; a < 3; ++a) {
        middle[a] = 0.5f * (lo[a] + hi[a]);
        longest = fmaxf(longest, hi[a] - lo[a]);
    }
    return longest;
}

bool viewer_model_ball(struct viewer_model *model, const springls_desc *desc)
{
    springls_sphere ball = {{0.0f, 0.0f, 0.0f}, 1.0f};
    struct viewer_model made;
    const bool good =
        create_roomy(&made, desc, ball.center, 2.0) && set_implicit(&made, springls_implicit_sphere, &ball);
    return viewer_model_replace(model, &made, good);
}

bool viewer_model_mesh(struct viewer_model *model, const springls_desc *desc, const struct mesh *mesh)
{
    struct viewer_model made;
    float middle[3];
    const double longest = (double)box_of(mesh, middle);
    if (!(longest > 0.0)) {
        return refuse(model, "the mesh has no extent");
    }
    const bool good = create_roomy(&made, desc, middle, longest) && set_mesh(&made, mesh);
    return viewer_model_replace(model, &made, good);
}

bool viewer_model_file(struct viewer_model *model, const springls_desc *desc, const char *path)
{
    struct mesh mesh;
    if (!mesh_read(path, &mesh, model->error)) {
        return false;
    }
    const bool good = viewer_model_mesh(model, desc, &mesh);
    mesh_free(&mesh);
    return good;
}

/* Creates the context of a second body: on the grid of `like`, in its window. */
static bool create_beside(struct viewer_model *made, const struct viewer_model *like)
{
    springls_desc desc = like->desc;
    springls_window_offset(like->ctx, desc.window);
    return create_around(made, &desc, like->desc.grid.size[0], like->middle, like->desc.grid.spacing[0]);
}

bool viewer_model_second(struct viewer_model *second, const struct viewer_model *like, springls_implicit_fn fn, void *user)
{
    struct viewer_model made;
    const bool good = create_beside(&made, like) && set_implicit(&made, fn, user);
    return viewer_model_replace(second, &made, good);
}

bool viewer_model_second_ball(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius)
{
    springls_sphere ball = {{place[0], place[1], place[2]}, radius};
    return viewer_model_second(second, like, springls_implicit_sphere, &ball);
}

bool viewer_model_second_file(struct viewer_model *second, const struct viewer_model *like, const float place[3], float radius,
                              const char *path)
{
    struct viewer_model made;
    struct mesh mesh;
    float middle[3];
    if (!mesh_read(path, &mesh, second->error)) {
        return false;
    }
    const float scale = 2.0f * radius / box_of(&mesh, middle);
    for (size_t i = 0; i < 3 * mesh.vertex_count; ++i) {
        mesh.positions[i] = place[i % 3] + scale * (mesh.positions[i] - middle[i % 3]);
    }
    const bool good = create_beside(&made, like) && set_mesh(&made, &mesh);
    mesh_free(&mesh);
    return viewer_model_replace(second, &made, good);
}

/* Adds gray as a color, so that a body without colors does not become black when the other one has some. */
static bool make_gray(struct viewer_model *model)
{
    const int count = springls_count(model->ctx);
    float *values = malloc(3 * (size_t)count * sizeof *values);
    springls_status status = SPRINGLS_OUT_OF_MEMORY;
    if (values) {
        for (int i = 0; i < 3 * count; ++i) {
            values[i] = 0.6f;
        }
        status = springls_add_attribute(model->ctx, &color_attribute, values, &model->colors);
    }
    free(values);
    return viewer_model_check(model, status);
}

bool viewer_model_combine(struct viewer_model *model, springls_operation operation, struct viewer_model *other)
{
    if (!viewer_model_finish(model)) {
        return false;
    }
    if (!viewer_model_finish(other)) {
        return refuse(model, other->error);
    }
    if (model->colors < 0 && other->colors >= 0 && !make_gray(model)) {
        return false;
    }
    if (model->colors >= 0 && other->colors < 0 && !make_gray(other)) {
        return viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    }
    ++model->version;
    model->rest_steps_due = springls_get_params(model->ctx).resample_period;
    return viewer_model_check(model, springls_combine(model->ctx, operation, other->ctx));
}

/* ---- steps, within a budget ---- */

#define LONG 1e9 /* seconds: as long as it takes */

static double budget_of(const struct viewer_model *model) { return model->budget > 0.0 ? model->budget : LONG; }

/* Ends the step in progress: its forces are not called any more. */
static void end_step(struct viewer_model *model)
{
    free(model->force_user);
    free(model->force_samples);
    model->force_user = NULL;
    model->force_samples = NULL;
    model->stepping = false;
    ++model->version;
}

/* Prepares springls for the step until that is done, when the step begins, or the budget is spent. */
static bool prepare_step(struct viewer_model *model, double begin)
{
    enum { AT_ONCE = 512 };
    const springls_step_desc step = {.forces = &model->forces, .dt = 1.0f, .max_displacement = 2.0f};
    const int count = springls_count(model->ctx);
    while (model->prepare && model->prepared < count) {
        const int rest = count - model->prepared;
        if (!model->prepare(model, model->force_user, model->prepared, rest < AT_ONCE ? rest : AT_ONCE)) {
            return false;
        }
        model->prepared += AT_ONCE;
        if (elapsed_seconds() - begin > budget_of(model)) {
            return true;
        }
    }
    return viewer_model_check(model, springls_step_begin(model->ctx, &step));
}

bool viewer_model_continue(struct viewer_model *model)
{
    const double begin = elapsed_seconds();
    bool is_done = true;
    if (!model->stepping) {
        return true;
    }
    bool good = springls_step_in_progress(model->ctx) || prepare_step(model, begin);
    if (good && springls_step_in_progress(model->ctx)) {
        good = viewer_model_check(model, springls_step_continue(model->ctx, budget_of(model), &is_done));
    } else {
        is_done = false;
    }
    model->step_seconds += elapsed_seconds() - begin;
    if (is_done || !good) {
        end_step(model);
    }
    return good;
}

bool viewer_model_finish(struct viewer_model *model)
{
    const double budget = model->budget;
    model->budget = 0.0;
    const bool good = viewer_model_continue(model);
    model->budget = budget;
    return good;
}

/* Keeps springls that are wholly masked from relaxing, merging and splitting. */
static springls_status keep_masked(struct viewer_model *model)
{
    const springls_view mask = springls_view_attribute(model->ctx, model->mask);
    uint8_t *kept = malloc((size_t)mask.count + 1);
    for (int i = 0; kept && i < mask.count; ++i) {
        kept[i] = viewer_model_mask_of(&mask, i) > WHOLLY_MASKED;
    }
    const springls_status status = kept ? springls_set_keep_mask(model->ctx, kept) : SPRINGLS_OUT_OF_MEMORY;
    free(kept);
    return status;
}

bool viewer_model_step(struct viewer_model *model, const springls_forces *forces, size_t size, float *samples,
                       viewer_prepare_fn prepare)
{
    if (!viewer_model_finish(model)) {
        free(samples);
        return false;
    }
    model->forces = *forces;
    model->force_user = model->forces.user = size ? malloc(size) : NULL;
    model->force_samples = samples;
    model->prepare = prepare;
    model->prepared = 0;
    model->step_seconds = 0.0;
    model->rest_steps_due = springls_get_params(model->ctx).resample_period;
    model->stepping = true;
    springls_status status = size && !model->force_user ? SPRINGLS_OUT_OF_MEMORY : SPRINGLS_OK;
    if (status == SPRINGLS_OK && size) {
        memcpy(model->force_user, forces->user, size);
    }
    if (status == SPRINGLS_OK && model->mask >= 0) { /* springls have come since the last step */
        status = keep_masked(model);
    }
    if (!viewer_model_check(model, status)) {
        end_step(model);
        return false;
    }
    return viewer_model_continue(model);
}

bool viewer_model_rest_step(struct viewer_model *model)
{
    const springls_forces none = {0};
    const int due = model->rest_steps_due;
    const bool good = viewer_model_step(model, &none, 0, NULL, NULL);
    model->rest_steps_due = good && due > 0 ? due - 1 : 0;
    return good;
}

bool viewer_model_at_rest(const struct viewer_model *model) { return model->rest_steps_due == 0 && !model->stepping; }

bool viewer_model_chunks(struct viewer_model *model, bool material, const springls_chunk **changed, int *count)
{
    const springls_chunks_desc desc = {.correspondences = material || model->mask >= 0}; /* ids too, by which masks are found */
    bool is_done = false;
    *count = 0;
    if (model->chunks && desc.correspondences != model->chunks_with_material) {
        springls_chunks_destroy(model->ctx, model->chunks);
        model->chunks = NULL;
        model->chunks_in_progress = false;
    }
    if (!model->chunks) {
        ++model->chunk_generation;
        model->chunks_with_material = desc.correspondences;
        if (!viewer_model_check(model, springls_chunks_create(model->ctx, &desc, &model->chunks))) {
            return false;
        }
    }
    if (!model->chunks_in_progress) {
        if (!viewer_model_finish(model) || !viewer_model_check(model, springls_chunks_begin(model->ctx, model->chunks))) {
            return false;
        }
        model->chunks_in_progress = true;
    }
    const springls_status status =
        springls_chunks_continue(model->ctx, model->chunks, budget_of(model), changed, count, &is_done);
    model->chunks_in_progress = status == SPRINGLS_OK && !is_done;
    return viewer_model_check(model, status);
}

struct viewer_model viewer_model_grid(const struct viewer_model *model)
{
    struct viewer_model like = {.desc = model->desc, .grid = model->grid, .voxel = model->voxel};
    memcpy(like.middle, model->middle, sizeof like.middle);
    memcpy(like.lower, model->lower, sizeof like.lower);
    memcpy(like.upper, model->upper, sizeof like.upper);
    return like;
}

static void find_attributes(struct viewer_model *model)
{
    model->colors = springls_find_attribute(model->ctx, COLOR);
    model->mask = springls_find_attribute(model->ctx, MASK);
}

static bool restore(struct viewer_model *model, const void *block, size_t size)
{
    if (!viewer_model_check(model, springls_restore(model->ctx, block, size))) {
        return false;
    }
    find_attributes(model);
    ++model->mask_version;
    model->rest_steps_due = 0;
    ++model->version;
    return true;
}

bool viewer_model_restore(struct viewer_model *model, const struct viewer_model *like, const void *block, size_t size)
{
    const bool same = like->grid == model->grid && memcmp(&like->voxel, &model->voxel, sizeof like->voxel) == 0
                   && memcmp(like->middle, model->middle, sizeof like->middle) == 0;
    if (same) {
        return restore(model, block, size);
    }
    struct viewer_model made = *like;
    const bool good = create_context(&made) && restore(&made, block, size);
    return viewer_model_replace(model, &made, good);
}

/* ---- the mask ---- */

float viewer_model_mask_of(const springls_view *mask, int springl)
{
    return mask->data && springl >= 0 && springl < mask->count
             ? *(const float *)(const void *)((const char *)mask->data + (size_t)springl * mask->stride)
             : 0.0f;
}

bool viewer_model_set_mask(struct viewer_model *model, const float *values)
{
    springls_status status = SPRINGLS_OK;
    if (!viewer_model_finish(model)) {
        return false;
    }
    if (values) {
        status = model->mask < 0 ? springls_add_attribute(model->ctx, &mask_attribute, values, &model->mask)
                                 : springls_set_attribute(model->ctx, model->mask, values);
        status = status == SPRINGLS_OK ? keep_masked(model) : status;
    } else if (model->mask >= 0) {
        springls_remove_attribute(model->ctx, model->mask);
        status = springls_set_keep_mask(model->ctx, NULL);
        find_attributes(model);
    }
    ++model->mask_version;
    ++model->version;
    return viewer_model_check(model, status);
}

bool viewer_model_invert_mask(struct viewer_model *model)
{
    if (!viewer_model_finish(model)) {
        return false;
    }
    const springls_view mask = springls_view_attribute(model->ctx, model->mask);
    const int count = springls_count(model->ctx);
    float *values = malloc(((size_t)count + 1) * sizeof *values);
    for (int i = 0; values && i < count; ++i) {
        values[i] = 1.0f - viewer_model_mask_of(&mask, i);
    }
    const bool good = values ? viewer_model_set_mask(model, values) : viewer_model_check(model, SPRINGLS_OUT_OF_MEMORY);
    free(values);
    return good;
}

float *viewer_model_colors(struct viewer_model *model, const springls_mesh *mesh)
{
    float *colors = model->colors >= 0 ? malloc((size_t)mesh->vertex_count * 3 * sizeof *colors) : NULL;
    if (colors && springls_mesh_attribute(model->ctx, mesh, model->colors, colors) != SPRINGLS_OK) {
        free(colors);
        colors = NULL;
    }
    return colors;
}
