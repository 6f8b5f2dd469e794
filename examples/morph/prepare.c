/* prepare.c - one grid for both characters, a closed body of each with bone weights, and the memory of a run. */
#include "morph/morph.h"

#include "base/threads.h"
#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

size_t morph_voxel_count(const struct morph *morph)
{
    const int *size = morph->grid.size;
    return (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
}

void morph_pose(struct morph *morph, int frame, double blend)
{
    const double time = (double)frame / morph->settings.fps;
    character_pose(&morph->target.character, morph->animation, time, blend, morph->skin, morph->skin_places);
}

bool morph_grid_around(const float lo[3], const float hi[3], int cells, springls_grid_desc *grid)
{
    struct solid_grid voxels;
    const bool good = solid_grid_around(lo, hi, cells, &voxels);
    memset(grid, 0, sizeof *grid);
    for (int k = 0; good && k < 3; ++k) {
        grid->size[k] = voxels.size[k];
        grid->origin[k] = voxels.origin[k];
        grid->spacing[k] = voxels.spacing;
    }
    return good;
}

/* Extends lo..hi by points; infinite ones, unlike those of raycast_grow_box, make it infinite. */
static void grow(const float *points, int count, float lo[3], float hi[3])
{
    for (int i = 0; i < 3 * count; ++i) {
        lo[i % 3] = fminf(lo[i % 3], points[i]);
        hi[i % 3] = fmaxf(hi[i % 3], points[i]);
    }
}

/* Extends lo..hi by a character in the neutral pose and in all poses of the animation. */
static bool grow_by_poses(struct morph *morph, const struct character *character, float lo[3], float hi[3])
{
    const double duration = morph->target.character.animations[morph->animation].duration;
    const int poses = (int)fmin(200.0, ceil(duration * morph->settings.fps)) + 1;
    float *posed = malloc(3 * (size_t)character->vertex_count * sizeof *posed);
    if (!posed) {
        return morph_no_memory();
    }
    grow(character->positions, character->vertex_count, lo, hi);
    for (int f = 0; f < poses; ++f) {
        morph_pose(morph, f, 1.0);
        character_skin(character, morph->skin, posed);
        grow(posed, character->vertex_count, lo, hi);
    }
    free(posed);
    return true;
}

/* Makes one grid for both characters. */
static bool make_grid(struct morph *morph)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    return grow_by_poses(morph, &morph->source.character, lo, hi) && grow_by_poses(morph, &morph->target.character, lo, hi)
        && (morph_grid_around(lo, hi, morph->settings.common.grid, &morph->grid)
            || morph_fail("%s: the animation leaves no body that could be drawn", morph_name(morph->settings.target)));
}

bool morph_is_alone(const struct morph *morph, const struct morph_body *body, int triangle)
{
    return vec3_length(body->mesh_pulls + 3 * body->mesh.triangles[3 * triangle]) > (float)morph->grid.spacing[0];
}

struct attach_loop {
    struct morph_body *body;
};

static void run_attach_loop(void *arg, int begin, int end)
{
    const struct attach_loop *loop = arg;
    struct morph_body *body = loop->body;
    for (int v = begin; v < end; ++v) {
        float *pull = body->mesh_pulls + 3 * v;
        struct place place;
        places_find(&body->places, body->mesh.positions + 3 * v, &place);
        body->influences[v] = place_influences(&body->character, &place);
        for (int k = 0; k < 3; ++k) {
            const int corner = body->character.triangles[3 * place.triangle + k];
            vec3_add_scaled(pull, place.weight[k], body->pulls + 3 * corner, pull);
        }
    }
}

/* Gives each vertex of the closed body the bone weights, and the pull where its limb shrinks, of the nearest place of the
 * character. */
static void attach_to_character(struct morph_body *body)
{
    struct attach_loop loop = {body};
    threads_for(body->mesh.vertex_count, 256, run_attach_loop, &loop);
}

static bool make_body(const struct morph *morph, springls_context *ctx, const char *path, struct morph_body *body)
{
    if (!places_create(&body->character, &body->places)) {
        return morph_no_memory();
    }
    if (!morph_solid_make(morph, ctx, &morph->grid, path, &body->character, &body->solid)
        || !morph_check(ctx, springls_extract_mesh(ctx, &body->mesh), morph_name(path))) {
        return false;
    }
    const springls_mesh *mesh = &body->mesh;
    if (!mesh_check(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, &body->check)) {
        return morph_no_memory();
    }
    const size_t count = (size_t)mesh->vertex_count;
    body->influences = malloc(count * sizeof *body->influences);
    body->posed = malloc(3 * count * sizeof *body->posed);
    body->mesh_pulls = calloc(3 * count, sizeof *body->mesh_pulls);
    if (!body->influences || !body->posed || !body->mesh_pulls) {
        return morph_no_memory();
    }
    attach_to_character(body);
    for (int t = 0; t < body->mesh.triangle_count; ++t) { body->has_alone = body->has_alone || morph_is_alone(morph, body, t); }
    return true;
}

static bool allocate_poses(struct morph *morph)
{
    const size_t joints = (size_t)morph->target.character.joint_count;
    morph->skin = malloc(joints * sizeof *morph->skin);
    morph->skin_before = malloc(joints * sizeof *morph->skin_before);
    morph->skin_places = malloc(joints * sizeof *morph->skin_places);
    morph->frames = calloc((size_t)morph->settings.frames, sizeof *morph->frames);
    return (morph->skin && morph->skin_before && morph->skin_places && morph->frames) || morph_no_memory();
}

static bool allocate_volumes(struct morph *morph)
{
    const size_t voxels = morph_voxel_count(morph);
    morph->pressure = malloc(voxels * sizeof(float));
    morph->way = malloc(3 * voxels * sizeof(float));
    morph->limbs = calloc(voxels, 1);
    morph->shape = malloc(voxels * sizeof(float));
    morph->source_phi = malloc(voxels * sizeof(float));
    morph->target_phi = malloc(voxels * sizeof(float));
    morph->source_nearest = malloc(voxels * sizeof(int));
    morph->target_nearest = malloc(voxels * sizeof(int));
    morph->nearest_before = malloc(voxels * sizeof(int));
    return (morph->pressure && morph->way && morph->limbs && morph->shape && morph->source_phi && morph->target_phi && morph->source_nearest
            && morph->target_nearest && morph->nearest_before)
        || morph_no_memory();
}

static bool make_models(struct morph *morph)
{
    springls_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.grid = morph->grid;
    desc.params = &morph->params;
    desc.backend = morph->backend = run_backend("morph", &morph->settings.common);
    return run_create("morph", &desc, &morph->ctx) == CLI_CONTINUE && run_create("morph", &desc, &morph->other) == CLI_CONTINUE
        && make_body(morph, morph->other, morph->settings.target, &morph->target)
        && make_body(morph, morph->ctx, morph->settings.source, &morph->source) && morph_make_rods(morph);
}

bool morph_prepare(struct morph *morph)
{
    const struct morph_settings *set = &morph->settings;
    return allocate_poses(morph) && make_grid(morph) && allocate_volumes(morph) && make_models(morph)
        && (!set->common.out || set->texture == 0 || morph_texture_suffices(morph)) && (!set->channel || morph_add_channels(morph));
}

static void free_frame(struct morph *morph, struct morph_frame *frame)
{
    springls_mesh_free(morph->ctx, &frame->mesh);
    free(frame->colors);
    free(frame->targets);
}

static void free_body(springls_context *ctx, struct morph_body *body)
{
    springls_mesh_free(ctx, &body->mesh);
    places_free(&body->places);
    character_free(&body->character);
    free(body->influences);
    free(body->posed);
    free(body->pulls);
    free(body->mesh_pulls);
}

void morph_free(struct morph *morph)
{
    for (int f = 0; morph->frames && f < morph->settings.frames; ++f) {
        free_frame(morph, &morph->frames[f]);
    }
    free_frame(morph, &morph->rest);
    springls_mesh_free(morph->other, &morph->target_mesh);
    free_body(morph->ctx, &morph->source);
    free_body(morph->other, &morph->target);
    free(morph->frames);
    alignment_free(&morph->alignment);
    free(morph->rods.places);
    free(morph->skin);
    free(morph->skin_before);
    free(morph->skin_places);
    free(morph->pressure);
    free(morph->way);
    free(morph->limbs);
    free(morph->shape);
    free(morph->cache);
    free(morph->source_phi);
    free(morph->target_phi);
    free(morph->source_nearest);
    free(morph->target_nearest);
    free(morph->nearest_before);
    springls_destroy(morph->ctx);
    springls_destroy(morph->other);
    springls_cl_destroy(morph->backend);
}
