/* run.c - the frames of a morph: the shape of a frame, and a step of skinning that also pushes the model to it; what lags then,
 * active contours push (contour.c). */
#include "morph/morph.h"

#include "base/progress.h"
#include "base/vec3.h"
#include "character/mesh_voxels.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROD 1.4f      /* voxels: radius that limbs have at least before the target is reached */
#define VICINITY 5.0f /* voxels: up to where springls have the weights of the target near them */
#define BAND 0.9f     /* voxels: up to where signed distances of posed bodies are exact */

enum { MARGIN = 5, LEAD_IN = 8, LEAD_OUT = 12 }; /* voxels around; steps from the neutral pose to the first frame, and back */

#define COINCIDE 0.125  /* voxels: mean distance in both directions below which the two coincide... */
#define LEFT_OVER 0.005 /* ...if at most this share of the target is further than a voxel away, since tips grow last, */
#define WORST 2.0       /* and no particle or vertex is further from the other than this */

bool morph_fail(const char *format, ...)
{
    va_list arguments;
    fputs("morph: ", stderr);
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    return false;
}

bool morph_no_memory(void) { return morph_fail("not enough memory"); }

bool morph_check(springls_context *ctx, springls_status status, const char *what)
{
    const char *reason = springls_last_error(ctx);
    return status == SPRINGLS_OK || morph_fail("%s: %s", what, *reason ? reason : springls_status_string(status));
}

/* ---- reading ---- */

/* Notes what of a character could not be read, or has been changed. */
static void note_changes(const char *path, const struct character *character)
{
    if (character->missing_pictures > 0) {
        fprintf(stderr, "morph: %s: textures that cannot be read, and are left out: %d\n", path, character->missing_pictures);
    }
    if (character->unnormal > 0) {
        fprintf(stderr, "morph: %s: the bone weights of %d vertices do not sum to 1; they are scaled\n", path, character->unnormal);
    }
    if (character->unweighted > 0) {
        fprintf(stderr, "morph: %s: %d vertices have no bone weights; they follow the first bone of their part\n", path,
                character->unweighted);
    }
}

static bool read_one(const char *path, int number, const char *props, bool quiet, struct character *character)
{
    char error[CHARACTER_TEXT];
    const bool good = path ? character_read(path, props, character, error) : character_build(number, character, error);
    if (good && !quiet) { note_changes(path, character); }
    return good || morph_fail("%s", error);
}

bool morph_read_donor(const char *path, struct character *donor)
{
    char error[CHARACTER_TEXT];
    if (!character_read(path, NULL, donor, error)) { return morph_fail("%s", error); }
    if (donor->skinned) { return true; }
    character_free(donor);
    memset(donor, 0, sizeof *donor);
    return morph_fail("--donor %s: no part has bones", path);
}

/* Gives a body without bones the skeleton of --donor, or of the other character. */
static bool lend_bones(const struct morph *morph, struct character *body, const char *path, const struct character *other)
{
    struct character donor;
    struct rig_mesh mesh;
    if (body->skinned) {
        return true;
    }
    if (!morph->settings.donor && !other->skinned) {
        return morph_fail("%s: no part has bones, and there is no donor of any", path);
    }
    if (morph->settings.donor && !morph_read_donor(morph->settings.donor, &donor)) { return false; }
    const bool good = morph_rig(morph, body, morph->settings.donor ? &donor : other, &mesh);
    morph_rig_free(&mesh);
    if (morph->settings.donor) {
        character_free(&donor);
    }
    return good;
}

/* Checks that each name of --props is part of that of a rigid part of either. */
static bool check_props(const char *names, const struct character *source, const struct character *target)
{
    char name[CHARACTER_NAME];
    for (const char *at = names; at && strcmp(names, "all") != 0; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        snprintf(name, sizeof name, "%.*s", (int)strcspn(at, ","), at);
        if (!character_has_prop(source, name) && !character_has_prop(target, name)) {
            return morph_fail("--props: no rigid part on a bone is named like \"%s\" (see --list)", name);
        }
    }
    return true;
}

bool morph_read(struct morph *morph)
{
    const struct morph_settings *set = &morph->settings;
    struct character *source = &morph->source.character, *target = &morph->target.character;
    char error[CHARACTER_TEXT];
    if (!read_one(set->source, 0, set->props, set->common.quiet, source)
        || !read_one(set->target, 1, set->props, set->common.quiet, target)) {
        return false;
    }
    if (!check_props(set->props, source, target)) { return false; }
    if (!lend_bones(morph, source, set->source, target) || !lend_bones(morph, target, set->target, source)) {
        return false;
    }
    morph->animation = character_animation(target, set->animation);
    if (morph->animation < 0) {
        return morph_fail(set->animation ? "the target has no animation %s (see --list)" : "the target has no animation%s",
                          set->animation ? set->animation : "");
    }
    morph->source.pulls = malloc(3 * ((size_t)source->vertex_count + 1) * sizeof(float));
    morph->target.pulls = malloc(3 * ((size_t)target->vertex_count + 1) * sizeof(float));
    if (!morph->source.pulls || !morph->target.pulls) {
        return morph_no_memory();
    }
    if (!skeleton_align(source, target, set->map, &morph->alignment, error)) {
        return morph_fail("%s", error);
    }
    skeleton_rescale(source, target, &morph->alignment, morph->source.pulls, morph->target.pulls);
    return true;
}

/* ---- preparation ---- */

static double frame_time(const struct morph *morph, int frame) { return (double)frame / morph->settings.fps; }

static void pose(struct morph *morph, int frame, double blend)
{
    character_pose(&morph->target.character, morph->animation, frame_time(morph, frame), blend, morph->skin, morph->skin_places);
}

static void grow(const float *positions, int count, float lo[3], float hi[3])
{
    for (int v = 0; v < count; ++v) {
        for (int k = 0; k < 3; ++k) {
            lo[k] = fminf(lo[k], positions[3 * v + k]);
            hi[k] = fmaxf(hi[k], positions[3 * v + k]);
        }
    }
}

/* Makes one grid for both characters, in the neutral pose and in all poses of the animation. */
static bool make_grid(struct morph *morph)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    const struct character *both[2] = {&morph->source.character, &morph->target.character};
    const double duration = morph->target.character.animations[morph->animation].duration;
    const int poses = (int)fmin(200.0, ceil(duration * morph->settings.fps)) + 1;
    for (int c = 0; c < 2; ++c) {
        float *posed = malloc(3 * (size_t)both[c]->vertex_count * sizeof *posed);
        if (!posed) {
            return morph_no_memory();
        }
        grow(both[c]->positions, both[c]->vertex_count, lo, hi);
        for (int f = 0; f < poses; ++f) {
            pose(morph, f, 1.0);
            character_skin(both[c], morph->skin, posed);
            grow(posed, both[c]->vertex_count, lo, hi);
        }
        free(posed);
    }
    const int cells = morph->settings.common.grid;
    const double longest = (double)fmaxf(hi[0] - lo[0], fmaxf(hi[1] - lo[1], hi[2] - lo[2]));
    if (!(longest > 0.0) || !isfinite(longest)) {
        return morph_fail("the animation leaves no body that could be drawn");
    }
    const double voxel = longest / (cells - 2 * MARGIN);
    for (int k = 0; k < 3; ++k) {
        morph->grid.spacing[k] = voxel;
        morph->grid.size[k] = (int)fmax(8.0, ceil((double)(hi[k] - lo[k]) / voxel) + 2 * MARGIN);
        morph->grid.origin[k] = (double)lo[k] - MARGIN * voxel;
    }
    return true;
}

/* Returns true if a triangle of a body belongs to a limb that the other lacks. */
static bool is_alone(const struct morph *morph, const struct morph_body *body, int triangle)
{
    return vec3_length(body->mesh_pulls + 3 * body->mesh.triangles[3 * triangle]) > (float)morph->grid.spacing[0];
}

static bool make_body(springls_context *ctx, const struct morph *morph, struct morph_body *body)
{
    const struct morph_settings *set = &morph->settings;
    if (!places_create(&body->character, &body->places)) {
        return morph_no_memory();
    }
    const char *path = body == &morph->source ? set->source : set->target;
    if (!morph_solid_make(morph, ctx, &morph->grid, path, &body->character, &body->solid)
        || !morph_check(ctx, springls_extract_mesh(ctx, &body->mesh), "body")) {
        return false;
    }
    const size_t count = (size_t)body->mesh.vertex_count;
    body->influences = malloc(count * sizeof *body->influences);
    body->posed = malloc(3 * count * sizeof *body->posed);
    body->mesh_pulls = calloc(3 * count, sizeof *body->mesh_pulls);
    if (!body->influences || !body->posed || !body->mesh_pulls) {
        return morph_no_memory();
    }
#if defined(_OPENMP)
    #pragma omp parallel for schedule(dynamic, 256)
#endif
    for (int v = 0; v < body->mesh.vertex_count; ++v) {
        struct place place;
        places_find(&body->places, body->mesh.positions + 3 * v, &place);
        body->influences[v] = place_influences(&body->character, &place);
        for (int k = 0; k < 3; ++k) {
            const int corner = body->character.triangles[3 * place.triangle + k];
            vec3_add_scaled(body->mesh_pulls + 3 * v, place.weight[k], body->pulls + 3 * corner, body->mesh_pulls + 3 * v);
        }
    }
    for (int t = 0; t < body->mesh.triangle_count; ++t) { body->has_alone = body->has_alone || is_alone(morph, body, t); }
    return true;
}

/* Looks up the bone weights at a place on the source's surface. */
static struct influences weights_at(const struct morph *morph, const float correspondence[3])
{
    float world[3];
    struct place place;
    for (int k = 0; k < 3; ++k) {
        world[k] = (float)(morph->grid.origin[k] + morph->grid.spacing[k] * (double)correspondence[k]);
    }
    places_find(&morph->source.places, world, &place);
    return place_influences(&morph->source.character, &place);
}

static const float *springl_item(springls_view view, int index)
{
    return (const float *)(const void *)((const char *)view.data + (size_t)index * view.stride);
}

/* Returns where the weights of a correspondence are remembered, or would be: a place of a hash table that has free ones. */
static struct known_weights *known_weights(const struct morph *morph, const float correspondence[3])
{
    uint32_t bits[3], hash = 0;
    memcpy(bits, correspondence, sizeof bits);
    for (int k = 0; k < 3; ++k) { hash = (hash ^ bits[k]) * 0x9e3779b1u; hash ^= hash >> 15; }
    size_t at = hash % morph->known_room;
    while (morph->known[at].used && memcmp(morph->known[at].correspondence, correspondence, 3 * sizeof *correspondence) != 0) {
        at = (at + 1) % morph->known_room;
    }
    return &morph->known[at];
}

/* Remembers the weights of all springls. Few are new in a frame, and a step looks each up several times. */
static bool learn_weights(struct morph *morph)
{
    const springls_view places = springls_view_correspondences(morph->ctx);
    struct known_weights **fresh = malloc(((size_t)places.count + 1) * sizeof *fresh);
    int fresh_count = 0;
    if (!fresh) {
        return morph_no_memory();
    }
    if (morph->known_room < 4 * ((size_t)places.count + (size_t)morph->known_count)) {
        free(morph->known);
        morph->known_room = 16 * ((size_t)places.count + 1);
        morph->known_count = 0;
        morph->known = calloc(morph->known_room, sizeof *morph->known);
        if (!morph->known) {
            free(fresh);
            return morph_no_memory();
        }
    }
    for (int i = 0; i < places.count; ++i) {
        const float *correspondence = springl_item(places, i);
        struct known_weights *known = known_weights(morph, correspondence);
        if (!known->used) {
            memcpy(known->correspondence, correspondence, sizeof known->correspondence);
            known->used = true;
            fresh[fresh_count++] = known;
        }
    }
    morph->known_count += fresh_count;
#if defined(_OPENMP)
    #pragma omp parallel for schedule(dynamic, 16)
#endif
    for (int i = 0; i < fresh_count; ++i) { fresh[i]->influences = weights_at(morph, fresh[i]->correspondence); }
    free(fresh);
    return true;
}

/* Computes the weights of all springls, one channel a joint. */
static float *channel_values(const struct morph *morph)
{
    const springls_view places = springls_view_correspondences(morph->ctx);
    const size_t joints = (size_t)morph->target.character.joint_count;
    float *values = calloc((size_t)places.count * joints + 1, sizeof *values);
    for (int i = 0; values && i < places.count; ++i) {
        const struct influences in = weights_at(morph, springl_item(places, i));
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            values[(size_t)i * joints + (size_t)in.joint[k]] += in.weight[k];
        }
    }
    return values;
}

/* Adds the same weights as an attribute channel, which is blended where springls split and fill, to compare it with the look-up. */
static bool add_channels(struct morph *morph)
{
    const springls_attribute_desc desc = {"bone weights", morph->target.character.joint_count, SPRINGLS_POLICY_BLEND,
                                          SPRINGLS_POLICY_BLEND, SPRINGLS_POLICY_BLEND};
    float *values = channel_values(morph);
    const bool good = values ? morph_check(morph->ctx, springls_add_attribute(morph->ctx, &desc, values, NULL), "bone weights")
                             : morph_no_memory();
    free(values);
    return good;
}

static bool compare_channels(struct morph *morph)
{
    const springls_view channel = springls_view_attribute(morph->ctx, springls_find_attribute(morph->ctx, "bone weights"));
    const int joints = morph->target.character.joint_count;
    float *values = channel_values(morph);
    if (!values || !channel.data) {
        free(values);
        return morph_no_memory();
    }
    for (int i = 0; i < channel.count; ++i) {
        const float *carried = springl_item(channel, i);
        double sum = 0.0;
        for (int j = 0; j < joints; ++j) {
            sum += (double)carried[j];
            morph->channel_difference +=
                fabs((double)carried[j] - (double)values[(size_t)i * (size_t)joints + (size_t)j]) / channel.count;
        }
        morph->channel_sum_error = fmax(morph->channel_sum_error, fabs(sum - 1.0));
    }
    free(values);
    return true;
}

size_t morph_voxel_count(const struct morph *morph)
{
    const int *size = morph->grid.size;
    return (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
}

bool morph_prepare(struct morph *morph)
{
    springls_desc desc;
    const size_t joints = (size_t)morph->target.character.joint_count;
    morph->skin = malloc(joints * sizeof *morph->skin);
    morph->skin_before = malloc(joints * sizeof *morph->skin_before);
    morph->skin_places = malloc(joints * sizeof *morph->skin_places);
    morph->frames = calloc((size_t)morph->settings.frames, sizeof *morph->frames);
    if (!morph->skin || !morph->skin_before || !morph->skin_places || !morph->frames) {
        return morph_no_memory();
    }
    if (!make_grid(morph)) {
        return false;
    }
    memset(&desc, 0, sizeof desc);
    desc.grid = morph->grid;
    desc.params = &morph->params;
    desc.backend = morph->backend = run_backend("morph", &morph->settings.common);
    morph->pressure = malloc(morph_voxel_count(morph) * sizeof(float));
    morph->way = malloc(3 * morph_voxel_count(morph) * sizeof(float));
    morph->shape = malloc(morph_voxel_count(morph) * sizeof(float));
    morph->source_phi = malloc(morph_voxel_count(morph) * sizeof(float));
    morph->target_phi = malloc(morph_voxel_count(morph) * sizeof(float));
    morph->source_nearest = malloc(morph_voxel_count(morph) * sizeof(int));
    morph->target_nearest = malloc(morph_voxel_count(morph) * sizeof(int));
    morph->nearest_before = malloc(morph_voxel_count(morph) * sizeof(int));
    if (!morph->pressure || !morph->way || !morph->shape || !morph->source_phi || !morph->target_phi || !morph->source_nearest
        || !morph->target_nearest || !morph->nearest_before) {
        return morph_no_memory();
    }
    return run_create("morph", &desc, &morph->ctx) == CLI_CONTINUE && run_create("morph", &desc, &morph->other) == CLI_CONTINUE
        && make_body(morph->other, morph, &morph->target) && make_body(morph->ctx, morph, &morph->source)
        && (!morph->settings.common.out || morph->settings.texture == 0 || morph_texture_suffices(morph))
        && (!morph->settings.channel || add_channels(morph));
}

/* ---- the shape of a frame ---- */

/* Continues the nearest triangles of a posed body into all of it, and outside as far as springls move in a frame. Returns false if
 * memory is short. */
static bool continue_nearest(const struct morph *morph, const float *phi, int *nearest)
{
    const int *size = morph->grid.size, step[3] = {1, size[0], size[0] * size[1]}, count = size[0] * size[1] * size[2];
    int *queue = malloc((size_t)count * sizeof *queue), end = 0;
    if (!queue) {
        return false;
    }
    for (int n = 0; n < count; ++n) {
        if (nearest[n] >= 0) { queue[end++] = n; }
    }
    for (int done = 0; done < end; ++done) {
        for (int k = 0; k < 6; ++k) {
            const int next = queue[done] + (k % 2 ? step[k / 2] : -step[k / 2]);
            if (next >= 0 && next < count && nearest[next] < 0 && phi[next] < VICINITY) {
                nearest[next] = nearest[queue[done]];
                queue[end++] = next;
            }
        }
    }
    free(queue);
    return true;
}

/* Moves a body's surface to the present pose, with limbs that the other lacks at `size` of theirs, and computes its signed
 * distance. Returns false if memory is short. */
static bool pose_body(struct morph *morph, struct morph_body *body, float size, float *phi, int *nearest)
{
    const struct solid_grid grid = morph_voxels(&morph->grid);
    float *voxels = malloc(3 * ((size_t)body->mesh.vertex_count + 1) * sizeof *voxels);
#if defined(_OPENMP)
    #pragma omp parallel for
#endif
    for (int v = 0; v < (voxels ? body->mesh.vertex_count : 0); ++v) {
        const struct affine blend = influences_blend(&body->influences[v], morph->skin);
        float place[3];
        vec3_add_scaled(body->mesh.positions + 3 * v, 1.0f - size, body->mesh_pulls + 3 * v, place);
        affine_apply(&blend, place, body->posed + 3 * v);
        morph_to_voxel(&morph->grid, body->posed + 3 * v, voxels + 3 * v);
    }
    const bool continued = body == &morph->target || body->has_alone; /* else nothing reads it beyond the band */
    const bool good = voxels && mesh_voxels(&grid, voxels, body->mesh.triangles, body->mesh.triangle_count, BAND, phi, nearest)
        && (!continued || continue_nearest(morph, phi, nearest));
    free(voxels);
    return good;
}

/* Returns the volume of a level set, voxels, and in *area roughly that of its surface. What is summed are integers: their order,
 * and so the number of threads, changes no bit. */
static double volume_of(const struct morph *morph, const float *phi, float shift, double *area)
{
    const int count = (int)morph_voxel_count(morph), unit = 1 << 20;
    int64_t volume = 0, near = 0;
#if defined(_OPENMP)
    #pragma omp parallel for reduction(+ : volume, near)
#endif
    for (int n = 0; n < count; ++n) {
        const float x = phi[n] + shift;
        volume += x <= -0.5f ? unit : x < 0.5f ? (int)((0.5f - x) * (float)unit) : 0;
        near += fabsf(x) < 0.5f;
    }
    *area = (double)near;
    return (double)volume / unit;
}

/* Adds a rod of `radius` voxels to a level set. */
static void add_rod(const int size[3], float *phi, const float from[3], const float to[3], float radius)
{
    float axis[3];
    int lo[3], hi[3];
    vec3_sub(to, from, axis);
    const float square = vec3_dot(axis, axis);
    for (int k = 0; k < 3; ++k) {
        lo[k] = (int)fmaxf(1.0f, floorf(fminf(from[k], to[k]) - radius - BAND));
        hi[k] = (int)fminf((float)size[k] - 2.0f, ceilf(fmaxf(from[k], to[k]) + radius + BAND));
    }
    for (int z = lo[2]; z <= hi[2]; ++z) {
        for (int y = lo[1]; y <= hi[1]; ++y) {
            for (int x = lo[0]; x <= hi[0]; ++x) {
                const float p[3] = {(float)x, (float)y, (float)z};
                float d[3];
                vec3_sub(p, from, d);
                vec3_add_scaled(d, square > 0.0f ? -fmaxf(0.0f, fminf(1.0f, vec3_dot(d, axis) / square)) : 0.0f, axis, d);
                float *here = phi + ((size_t)z * (size_t)size[1] + (size_t)y) * (size_t)size[0] + (size_t)x;
                *here = fminf(*here, vec3_length(d) - radius);
            }
        }
    }
}

/* Keeps limbs at least as thick as a rod along their bones, so that none falls apart between two shapes. Those that the source
 * lacks have `grown` of their size. */
static void add_rods(const struct morph *morph, float radius, float grown, float *phi)
{
    const struct character *target = &morph->target.character;
    for (int j = 0; j < target->joint_count; ++j) {
        const int root = morph->alignment.grows[j], ends[2] = {j, root < 0 ? morph->alignment.bone_above[j]
                                                                  : j == root ? -1 : target->joints[j].parent};
        float places[2][3];
        for (int e = 0; e < 2 && ends[1] >= 0; ++e) {
            joint_place(&target->joints[ends[e]], places[e]);
            if (root >= 0) {
                float way[3];
                joint_place(&target->joints[root], way);
                vec3_sub(way, places[e], way);
                vec3_add_scaled(places[e], 1.0f - grown, way, places[e]);
            }
            affine_apply(&morph->skin[ends[e]], places[e], places[e]);
            morph_to_voxel(&morph->grid, places[e], places[e]);
        }
        if (ends[1] >= 0) { add_rod(morph->grid.size, phi, places[0], places[1], radius); }
    }
}

/* Unites a voxel of a level set with those limbs of a body that the other lacks. */
static float unite_alone(const struct morph *morph, const struct morph_body *body, float body_phi, int nearest, float phi)
{
    return body_phi < phi && body->has_alone && nearest >= 0 && is_alone(morph, body, nearest) ? body_phi : phi;
}

/* Blends the level sets of source and target, and unites limbs that only one has with them. */
static void blend_bodies(struct morph *morph, float part)
{
    const int count = (int)morph_voxel_count(morph);
    const float *source = morph->source_phi, *target = morph->target_phi;
#if defined(_OPENMP)
    #pragma omp parallel for
#endif
    for (int n = 0; n < count; ++n) {
        float phi = (1.0f - part) * source[n] + part * target[n];
        phi = unite_alone(morph, &morph->source, source[n], morph->source_nearest[n], phi);
        morph->shape[n] = unite_alone(morph, &morph->target, target[n], morph->target_nearest[n], phi);
    }
}

/* Returns the volume of a triangle and the origin. */
static double cone(const float a[3], const float b[3], const float c[3])
{
    float cross[3];
    vec3_cross(a, b, cross);
    return (double)vec3_dot(cross, c) / 6.0;
}

/* Returns the part of a body's volume that is left with limbs that the other lacks at `size` of theirs. */
static double volume_left(const struct morph_body *body, float size)
{
    double whole = 0.0, left = 0.0;
    for (int t = 0; t < body->mesh.triangle_count; ++t) {
        float shrunk[3][3];
        const float *corner[3];
        for (int k = 0; k < 3; ++k) {
            const int v = body->mesh.triangles[3 * t + k];
            corner[k] = body->mesh.positions + 3 * v;
            vec3_add_scaled(corner[k], 1.0f - size, body->mesh_pulls + 3 * v, shrunk[k]);
        }
        whole += cone(corner[0], corner[1], corner[2]);
        left += cone(shrunk[0], shrunk[1], shrunk[2]);
    }
    return fmax(0.1, left / whole);
}

/* Keeps the nearest triangles of the pose before: springls are still there when the step of skinning looks up weights. */
static void keep_nearest(struct morph *morph)
{
    int *before = morph->target_nearest;
    morph->target_nearest = morph->nearest_before; /* its memory */
    morph->nearest_before = before;
}

/* Makes the signed distance of the body between source and target. part: 0 the source, 1 the target. The level set is blended,
 * limbs that only one has are united with it, it is moved so that the volume is between theirs, and what falls apart is bridged. */
static bool pose_between(struct morph *morph, float part)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    const int count = (int)morph_voxel_count(morph);
    float *phi = morph->shape, *source = morph->source_phi, *target = morph->target_phi;
    double area, volumes[2] = {0.0, 0.0};
    struct solid_repair repair;
    const float sizes[2] = {fmaxf(0.05f, 1.0f - part), fmaxf(0.05f, part)}; /* of limbs that the other lacks */
    keep_nearest(morph);
    if (!pose_body(morph, &morph->target, sizes[1], target, morph->target_nearest)
        || (part < 1.0f && !pose_body(morph, &morph->source, sizes[0], source, morph->source_nearest))) {
        return morph_no_memory();
    }
    if (part < 1.0f) {
        volumes[0] = volume_of(morph, source, 0.0f, &area) / volume_left(&morph->source, sizes[0]);
        volumes[1] = volume_of(morph, target, 0.0f, &area) / volume_left(&morph->target, sizes[1]);
        blend_bodies(morph, part);
        const double wanted = (1.0 - (double)part) * volumes[0] + (double)part * volumes[1];
        float shift = 0.0f;
        for (int step = 0; step < 3; ++step) { /* Newton */
            const double volume = volume_of(morph, phi, shift, &area);
            shift += area > 0.0 ? (float)fmax(-1.0, fmin(1.0, (volume - wanted) / area)) : 0.0f;
        }
        for (int n = 0; n < count; ++n) { phi[n] += shift; }
    } else {
        memcpy(phi, target, (size_t)count * sizeof *phi);
    }
    const float rod = ROD * fminf(1.0f, 5.0f * (1.0f - part));
    if (rod > 0.0f) { add_rods(morph, rod, part, phi); }
    return solid_repair(&voxels, phi, morph->settings.reach, true, &repair) || morph_no_memory();
}

/* Samples a dense level set at a place in voxel coordinates, trilinearly. */
static float sample(const int size[3], const float *phi, const float place[3])
{
    size_t base = 0, step[3] = {1, (size_t)size[0], (size_t)size[0] * (size_t)size[1]};
    float part[3], sum = 0.0f;
    for (int k = 0; k < 3; ++k) {
        const float at = fmaxf(0.0f, fminf((float)size[k] - 1.001f, place[k]));
        base += (size_t)at * step[k];
        part[k] = at - floorf(at);
    }
    for (int c = 0; c < 8; ++c) {
        float weight = 1.0f;
        size_t at = base;
        for (int k = 0; k < 3; ++k) {
            weight *= c >> k & 1 ? part[k] : 1.0f - part[k];
            at += c >> k & 1 ? step[k] : 0;
        }
        sum += weight * phi[at];
    }
    return sum;
}

/* ---- skinning and the push to the shape: the affine force of eq. 1 ---- */

struct skinning {
    const struct morph *morph;
    const struct affine *before, *after;
    float start; /* time of the pose before; the one after is 1 later */
    float part;  /* of the target in the shape before */
};

/* Adds b - a to a sum of maps. */
static void add_change(struct affine *sum, double weight, const struct affine *a, const struct affine *b)
{
    affine_add(sum, weight, b);
    affine_add(sum, -weight, a);
}

/* Returns the velocity of a springl on its way from pose to pose: B' B^-1, where B, the blend of bones from its neutral place,
 * changes evenly. So Euler's steps of any length take it where skinning from the neutral pose puts it. Near the target the target's
 * weights take part (theirs; NULL: none). Where B is nearly singular the bones' own motions are blended. */
static struct affine motion(const struct skinning *s, float time, const struct influences *ours, const struct influences *theirs)
{
    const struct influences *both[2] = {ours, theirs};
    const double share[2] = {theirs ? 1.0 - (double)s->part : 1.0, (double)s->part}, t = (double)(time - s->start);
    struct affine now = {{0}}, change = {{0}}, sum = {{0}};
    for (int b = 0; b < (theirs ? 2 : 1); ++b) {
        const struct affine before = influences_blend(both[b], s->before), after = influences_blend(both[b], s->after);
        add_change(&change, share[b], &before, &after);
        affine_add(&now, share[b], &before);
    }
    affine_add(&now, t, &change);
    if (fabs(affine_determinant(&now)) > 0.1) {
        const struct affine back = affine_inverse(&now);
        return affine_after(&change, &back);
    }
    for (int b = 0; b < (theirs ? 2 : 1); ++b) {
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (both[b]->weight[k] > 0.0f) {
                const int joint = both[b]->joint[k];
                const struct affine back = affine_inverse(&s->before[joint]), bone = affine_after(&s->after[joint], &back);
                affine_add(&sum, share[b] * (double)both[b]->weight[k], &bone);
            }
        }
    }
    for (int i = 0; i < 3; ++i) { sum.m[5 * i] -= 1.0; }
    return sum;
}

/* Returns the target's weights at the place of it that was nearest to a point in the pose before, in voxel coordinates. NULL: none
 * was near. */
static const struct influences *target_weights(const struct morph *morph, const float point[3])
{
    const int *size = morph->grid.size;
    size_t at = 0, step = 1;
    for (int k = 0; k < 3; ++k) {
        at += step * (size_t)fmaxf(0.0f, fminf((float)size[k] - 1.0f, floorf(point[k] + 0.5f)));
        step *= (size_t)size[k];
    }
    const int triangle = morph->nearest_before[at];
    return triangle >= 0 ? &morph->target.influences[morph->target.mesh.triangles[3 * triangle]] : NULL;
}

/* Converts a velocity of world coordinates, [R t], to voxels: that of voxel v is R v + (R o + t) / h. */
static void to_velocity(const springls_grid_desc *grid, const struct affine *t, float out[12])
{
    for (int i = 0; i < 3; ++i) {
        double shift = t->m[4 * i + 3];
        for (int j = 0; j < 3; ++j) {
            shift += t->m[4 * i + j] * grid->origin[j];
            out[4 * i + j] = (float)t->m[4 * i + j];
        }
        out[4 * i + 3] = (float)(shift / grid->spacing[0]);
    }
}

/* Moves springls by the bone weights at their places on the source's surface, and along their normals by the pressure of the active
 * contour at the place where these take them; in sub-steps, by even parts of it. */
static void move_springls(void *user, const springls_batch *batch, float *out)
{
    const struct skinning *s = user;
    const float left = s->start + 1.0f - batch->time; /* until the pose after */
    for (int i = 0; i < batch->count; ++i) {
        const float *a = batch->correspondences + 3 * i, *p = batch->points + 3 * i;
        float *map = out + 12 * i, place[3];
        const struct known_weights *known = known_weights(s->morph, a);
        const struct influences in = known->used ? known->influences : weights_at(s->morph, a);
        const struct affine t = motion(s, batch->time, &in, s->part > 0.0f ? target_weights(s->morph, p) : NULL);
        to_velocity(&s->morph->grid, &t, map);
        if (left <= 1e-3f) { continue; } /* at the end of the step */
        for (int k = 0; k < 3; ++k) { place[k] = p[k] + left * (vec3_dot(map + 4 * k, p) + map[4 * k + 3]); }
        const float speed = morph_pressure(s->morph, sample(s->morph->grid.size, s->morph->shape, place)) / left;
        for (int k = 0; k < 3; ++k) { map[4 * k + 3] += speed * batch->normals[3 * i + k]; }
    }
}

/* Moves the model to the shape and the pose of this frame. part: of the target in the shape before. */
static bool move_step(struct morph *morph, float part)
{
    struct skinning skinning = {morph, morph->skin_before, morph->skin, (float)springls_time(morph->ctx), part};
    springls_forces forces;
    springls_step_desc step;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.affine_batch = move_springls;
    forces.user = &skinning;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_FLUID;
    step.max_displacement = 3.0f;
    step.dt = 1.0f;
    return learn_weights(morph) && morph_check(morph->ctx, springls_step(morph->ctx, &step), "skinning");
}

/* ---- measures of a frame ---- */

/* Measures |phi| of the target at the model's particles. */
static void measure_stray(const struct morph *morph, struct morph_frame *frame)
{
    const springls_view particles = springls_view_particles(morph->ctx);
    frame->distance = frame->stray = 0.0;
    for (int i = 0; i < particles.count; ++i) {
        const double voxels = fabs((double)sample(morph->grid.size, morph->target_phi, springl_item(particles, i)));
        frame->distance += voxels / particles.count;
        frame->stray = fmax(frame->stray, voxels);
    }
}

/* Measures |phi| of the model at vertices of the target, except those inside it, where it overlaps itself. */
static bool measure_missing(const struct morph *morph, struct morph_frame *frame)
{
    const struct morph_body *target = &morph->target;
    const size_t vertices = (size_t)target->mesh.vertex_count + 1;
    float *world = malloc(3 * vertices * sizeof *world), *distance = malloc(vertices * sizeof *distance);
    int count = 0;
    for (int v = 0; world && v < target->mesh.vertex_count; ++v) {
        float place[3];
        morph_to_voxel(&morph->grid, target->posed + 3 * v, place);
        if (fabsf(sample(morph->grid.size, morph->target_phi, place)) < 0.5f) {
            memcpy(world + 3 * count++, target->posed + 3 * v, sizeof place);
        }
    }
    bool good = (world && distance) || morph_no_memory();
    good = good && morph_check(morph->ctx, springls_sample_distance(morph->ctx, world, count, distance), "distance");
    frame->missing = frame->far = frame->worst = 0.0;
    for (int i = 0; good && i < count; ++i) {
        const double voxels = fabs((double)distance[i]) / morph->grid.spacing[0];
        frame->missing += voxels / count;
        frame->far += voxels > 1.0 ? 1.0 / count : 0.0;
        frame->worst = fmax(frame->worst, voxels);
    }
    free(world);
    free(distance);
    return good;
}

/* Returns the volume inside a mesh by the divergence theorem. */
static double enclosed_volume(const springls_mesh *mesh)
{
    double sum = 0.0;
    for (int t = 0; t < mesh->triangle_count; ++t) {
        const int *corner = mesh->triangles + 3 * t;
        sum += cone(mesh->positions + 3 * corner[0], mesh->positions + 3 * corner[1], mesh->positions + 3 * corner[2]);
    }
    return sum;
}

static bool measure(struct morph *morph, struct morph_frame *frame)
{
    const double voxel = morph->grid.spacing[0], speck = MORPH_SPECK * voxel * voxel * voxel;
    measure_stray(morph, frame);
    const bool good = measure_missing(morph, frame)
        && morph_check(morph->ctx, springls_extract_mesh(morph->ctx, &frame->mesh), "mesh") && morph_look(morph, frame);
    frame->specks = good ? mesh_drop_specks(frame->mesh.positions, frame->mesh.vertex_count, frame->mesh.triangles,
                                            &frame->mesh.triangle_count, speck) : 0;
    if (frame->specks < 0) {
        return morph_no_memory();
    }
    frame->volume = good ? enclosed_volume(&frame->mesh) / (voxel * voxel * voxel) : 0.0;
    const springls_stats stats = springls_get_stats(morph->ctx);
    frame->springls = stats.springls;
    frame->split = stats.split;
    frame->added = stats.added;
    frame->removed = stats.removed;
    return good
           && (mesh_check(frame->mesh.positions, frame->mesh.vertex_count, frame->mesh.triangles, frame->mesh.triangle_count,
                          &frame->check)
               || morph_no_memory());
}

/* ---- all frames ---- */

/* Returns how far the morph has come: 0 the source, 1 the target. */
static float part_of(const struct morph *morph, int frame)
{
    const float x = fmaxf(0.0f, fminf(1.0f, (float)frame / (float)morph->settings.blend));
    return x * x * (3.0f - 2.0f * x);
}

static bool run_frame(struct morph *morph, int f)
{
    struct morph_frame *frame = &morph->frames[f];
    const int steps_before = springls_get_stats(morph->ctx).steps;
    double clock[4];
    clock[0] = elapsed_seconds();
    bool good = pose_between(morph, part_of(morph, f));
    clock[1] = elapsed_seconds();
    good = good && move_step(morph, part_of(morph, f - 1));
    clock[2] = elapsed_seconds();
    good = good && morph_contour(morph, f == morph->settings.frames - 1);
    clock[3] = elapsed_seconds();
    frame->share = part_of(morph, f);
    frame->seconds = clock[3] - clock[0];
    frame->seconds_target = clock[1] - clock[0];
    frame->seconds_skinning = clock[2] - clock[1];
    frame->seconds_contour = clock[3] - clock[2];
    frame->steps = springls_get_stats(morph->ctx).steps - steps_before;
    return good && measure(morph, frame);
}

static void next_pose(struct morph *morph, int frame, double blend)
{
    memcpy(morph->skin_before, morph->skin, (size_t)morph->target.character.joint_count * sizeof *morph->skin);
    pose(morph, frame, blend);
}

/* Compares the final bone weights with those of the target's artist at the same place. */
static void compare_weights(struct morph *morph)
{
    const struct morph_frame *last = &morph->frames[morph->frame_count - 1];
    const struct character *target = &morph->target.character;
    struct bvh bvh;
    double sum = 0.0;
    if (!bvh_build(&bvh, morph->target.posed, (const uint32_t *)morph->target.mesh.triangles,
                   (size_t)morph->target.mesh.triangle_count)) {
        return;
    }
    for (int v = 0; v < last->mesh.vertex_count; ++v) {
        struct place place;
        uint32_t triangle = 0;
        places_find(&morph->source.places, last->mesh.correspondences + 3 * v, &place);
        const struct influences mine = place_influences(&morph->source.character, &place);
        bvh_distance(&bvh, last->mesh.positions + 3 * v, NULL, &triangle);
        const struct influences *theirs = &morph->target.influences[morph->target.mesh.triangles[3 * triangle]];
        for (int j = 0; j < target->joint_count; ++j) {
            float a = 0.0f, b = 0.0f;
            for (int k = 0; k < CHARACTER_BONES; ++k) {
                a += mine.joint[k] == j ? mine.weight[k] : 0.0f;
                b += theirs->joint[k] == j ? theirs->weight[k] : 0.0f;
            }
            sum += fabs((double)a - (double)b) / last->mesh.vertex_count;
        }
    }
    morph->weight_difference = sum;
    bvh_free(&bvh);
}

static bool compare_ends(struct morph *morph)
{
    const struct morph_frame *last = &morph->frames[morph->frame_count - 1];
    const struct surface mine = {last->mesh.positions, (const uint32_t *)last->mesh.triangles, (size_t)last->mesh.triangle_count};
    const double voxel = morph->grid.spacing[0];
    springls_mesh *mesh = &morph->target_mesh;
    if (!morph_check(morph->other,
                     springls_set_mesh(morph->other, morph->target.posed, morph->target.mesh.vertex_count, 0,
                                       morph->target.mesh.triangles, morph->target.mesh.triangle_count, NULL),
                     "target")
        || !morph_check(morph->other, springls_extract_mesh(morph->other, mesh), "target")) {
        return false;
    }
    if (mesh_drop_specks(mesh->positions, mesh->vertex_count, mesh->triangles, &mesh->triangle_count,
                         MORPH_SPECK * voxel * voxel * voxel) < 0) {
        return morph_no_memory();
    }
    if (mine.triangle_count == 0 || mesh->triangle_count == 0) {
        return morph_fail("%s has no part of %d voxels: take a finer --grid", mesh->triangle_count == 0 ? "the target" : "the model",
                          MORPH_SPECK);
    }
    const struct surface target = {mesh->positions, (const uint32_t *)mesh->triangles, (size_t)mesh->triangle_count};
    return surface_distances_measure(&mine, &target, 20000, voxel, &morph->end) || morph_no_memory();
}

/* Takes the model back to the neutral pose, in which it is written with its skeleton, while it goes on becoming the target.
 * Skinning the last frame's vertices backwards would be no surface: where bodies have met or parted, neighbors have different
 * bones. */
static bool rest_pose(struct morph *morph)
{
    const int last = morph->frame_count - 1;
    bool good = true;
    for (int s = LEAD_OUT - 1; good && s >= 0; --s) {
        next_pose(morph, last, (double)s / LEAD_OUT);
        good = pose_between(morph, part_of(morph, last)) && move_step(morph, part_of(morph, last))
            && morph_contour(morph, s == 0);
    }
    morph->rest.share = part_of(morph, last);
    return good && measure(morph, &morph->rest);
}

bool morph_run(struct morph *morph)
{
    struct progress bar;
    bool good = true;
    morph->coincided = -1;
    pose(morph, 0, 0.0);
    for (int s = 1; good && s < LEAD_IN; ++s) {
        next_pose(morph, 0, (double)s / LEAD_IN);
        good = pose_between(morph, 0.0f) && move_step(morph, 0.0f) && morph_contour(morph, false);
    }
    progress_begin(&bar, "morph", (size_t)morph->settings.frames, morph->settings.common.quiet);
    for (int f = 0; good && f < morph->settings.frames && morph->coincided < 0; ++f) {
        next_pose(morph, f, 1.0);
        good = run_frame(morph, f);
        morph->frame_count += good;
        const struct morph_frame *frame = &morph->frames[f];
        if (good && f >= morph->settings.blend && frame->distance < COINCIDE && frame->missing < COINCIDE
            && frame->far < LEFT_OVER && fmax(frame->worst, frame->stray) < WORST) {
            morph->coincided = f;
        }
        progress_update(&bar, (size_t)f + 1, NULL);
    }
    progress_end(&bar);
    good = good && compare_ends(morph) && (!morph->settings.channel || compare_channels(morph));
    if (good) {
        compare_weights(morph);
    }
    return good && (!morph->settings.common.out || rest_pose(morph));
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
    free(morph->skin);
    free(morph->skin_before);
    free(morph->skin_places);
    free(morph->pressure);
    free(morph->way);
    free(morph->shape);
    free(morph->known);
    free(morph->source_phi);
    free(morph->target_phi);
    free(morph->source_nearest);
    free(morph->target_nearest);
    free(morph->nearest_before);
    springls_destroy(morph->ctx);
    springls_destroy(morph->other);
    springls_cl_destroy(morph->backend);
}
