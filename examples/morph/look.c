/* look.c - how the model looks: colors and bone weights fade from the source's to the target's as its shape does.
 *
 * The source's are those at the place that a point came from, its correspondence; the target's those at the nearest place of the
 * target in the same pose, taken back to the neutral pose. */
#include "morph/morph.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "surface/texture_atlas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float APART = 4.0f; /* voxels: corners of a triangle that came from places further apart are not blended */

struct targets_loop {
    const struct morph_frame *frame;
    const struct morph_body *target;
    const springls_mesh *mesh;
    const struct bvh *bvh;
};

static void run_targets_loop(void *arg, int begin, int end)
{
    const struct targets_loop *loop = arg;
    const struct morph_frame *frame = loop->frame;
    const struct morph_body *target = loop->target;
    const springls_mesh *mesh = loop->mesh;
    const struct bvh *bvh = loop->bvh;
    for (int v = begin; v < end; ++v) {
        float closest[3] = {0.0f, 0.0f, 0.0f}, weight[3], *place = frame->targets + 3 * v;
        uint32_t triangle = 0;
        bvh_distance(bvh, mesh->positions + 3 * v, closest, &triangle);
        const int *corner = target->mesh.triangles + 3 * triangle;
        vec3_barycentric(target->posed + 3 * corner[0], target->posed + 3 * corner[1], target->posed + 3 * corner[2], closest,
                         weight);
        memset(place, 0, 3 * sizeof *place);
        for (int k = 0; k < 3; ++k) {
            vec3_add_scaled(place, weight[k], target->mesh.positions + 3 * corner[k], place);
        }
    }
}

/* Finds for each vertex the nearest place of the posed target, in the neutral pose. */
static bool find_targets(const struct morph *morph, struct morph_frame *frame)
{
    const struct morph_body *target = &morph->target;
    const springls_mesh *mesh = &frame->mesh;
    struct bvh bvh;
    frame->targets = malloc(3 * ((size_t)mesh->vertex_count + 1) * sizeof *frame->targets);
    if (!frame->targets
        || !bvh_build(&bvh, target->posed, (const uint32_t *)target->mesh.triangles, (size_t)target->mesh.triangle_count)) {
        return morph_no_memory();
    }
    struct targets_loop loop = {frame, target, mesh, &bvh};
    threads_for(mesh->vertex_count, 256, run_targets_loop, &loop);
    bvh_free(&bvh);
    return true;
}

/* Mixes the colors at a place of the source and at one of the target. */
static void mixed_color(const struct morph *morph, float share, const float source[3], const float target[3], float color[3])
{
    const struct places *places[2] = {&morph->source.places, &morph->target.places};
    const float *at[2] = {source, target}, part[2] = {1.0f - share, share};
    float sum[3] = {0.0f, 0.0f, 0.0f};
    for (int n = 0; n < 2; ++n) {
        struct place place;
        float one[3];
        if (part[n] > 0.0f) {
            places_find(places[n], at[n], &place);
            place_color(places[n]->character, &place, one);
            vec3_add_scaled(sum, part[n], one, sum);
        }
    }
    memcpy(color, sum, sizeof sum);
}

struct error_loop {
    const struct morph *morph;
    const springls_mesh *mesh;
    double *worst;
};

static void run_error_loop(void *arg, int begin, int end)
{
    const struct error_loop *loop = arg;
    const struct morph *morph = loop->morph;
    const springls_mesh *mesh = loop->mesh;
    double worst = 0.0;
    for (int v = begin; v < end; ++v) {
        struct place place;
        double sum = 0.0;
        places_find(&morph->source.places, mesh->correspondences + 3 * v, &place);
        const struct influences in = place_influences(&morph->source.character, &place);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            sum += (double)in.weight[k];
        }
        worst = fmax(worst, fabs(sum - 1.0));
    }
    threads_lock();
    *loop->worst = fmax(*loop->worst, worst);
    threads_unlock();
}

/* Returns the largest |sum - 1| of the bone weights at a mesh's correspondences. */
static double weight_error(const struct morph *morph, const springls_mesh *mesh)
{
    double worst = 0.0;
    struct error_loop loop = {morph, mesh, &worst};
    threads_for(mesh->vertex_count, 256, run_error_loop, &loop);
    return worst;
}

struct colors_loop {
    const struct morph *morph;
    const struct morph_frame *frame;
};

static void run_colors_loop(void *arg, int begin, int end)
{
    const struct colors_loop *loop = arg;
    const struct morph *morph = loop->morph;
    const struct morph_frame *frame = loop->frame;
    for (int v = begin; v < end; ++v) {
        mixed_color(morph, frame->share, frame->mesh.correspondences + 3 * v, frame->targets + 3 * v, frame->colors + 3 * v);
    }
}

bool morph_look(const struct morph *morph, struct morph_frame *frame)
{
    const int count = frame->mesh.vertex_count;
    frame->weight_error = weight_error(morph, &frame->mesh);
    if (!morph->settings.common.out) {
        return true;
    }
    frame->colors = malloc(3 * ((size_t)count + 1) * sizeof *frame->colors);
    if (!frame->colors) {
        return morph_no_memory();
    }
    if (!find_targets(morph, frame)) {
        return false;
    }
    struct colors_loop loop = {morph, frame};
    threads_for(count, 256, run_colors_loop, &loop);
    return true;
}

struct influences morph_mixed_influences(const struct morph *morph, const struct morph_frame *frame, int vertex)
{
    const struct places *places[2] = {&morph->source.places, &morph->target.places};
    const float *at[2] = {frame->mesh.correspondences + 3 * vertex, frame->targets + 3 * vertex},
                part[2] = {1.0f - frame->share, frame->share};
    struct influences sum;
    memset(&sum, 0, sizeof sum);
    for (int n = 0; n < 2; ++n) {
        struct place place;
        places_find(places[n], at[n], &place);
        const struct influences in = place_influences(places[n]->character, &place);
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            if (in.weight[k] * part[n] > 0.0f) {
                influences_add(&sum, in.joint[k], in.weight[k] * part[n]);
            }
        }
    }
    influences_normalize(&sum, 0);
    return sum;
}

/* ---- the atlas ---- */

struct bake {
    const struct morph *morph;
    const struct morph_frame *frame;
};

/* Interpolates places of a triangle's corners; where these are far apart, takes that of the nearest corner. */
static void place_within(const struct bake *bake, const float *places, int triangle, const float weight[3], float out[3])
{
    const int *corner = bake->frame->mesh.triangles + 3 * triangle,
              nearest = weight[0] >= weight[1] && weight[0] >= weight[2] ? 0 : weight[1] >= weight[2] ? 1 : 2;
    float sum[3] = {0.0f, 0.0f, 0.0f}, apart = 0.0f;
    for (int k = 0; k < 3; ++k) {
        float d[3];
        vec3_sub(places + 3 * corner[k], places + 3 * corner[(k + 1) % 3], d);
        apart = fmaxf(apart, vec3_length(d));
        vec3_add_scaled(sum, weight[k], places + 3 * corner[k], sum);
    }
    const bool torn = apart > APART * (float)bake->morph->grid.spacing[0];
    memcpy(out, torn ? places + 3 * corner[nearest] : sum, 3 * sizeof *out);
}

static void bake_color(const void *user, int triangle, const float weight[3], float color[3])
{
    const struct bake *bake = user;
    float source[3], target[3];
    place_within(bake, bake->frame->mesh.correspondences, triangle, weight, source);
    place_within(bake, bake->frame->targets, triangle, weight, target);
    mixed_color(bake->morph, bake->frame->share, source, target, color);
}

bool morph_bake(const struct morph *morph, const struct morph_frame *frame, const struct gltf_mesh *surface, int size, int material,
                struct textured_mesh *textured)
{
    const struct bake bake = {morph, frame};
    return textured_mesh_make(surface, size, material, bake_color, &bake, textured);
}

bool morph_texture_suffices(const struct morph *morph)
{
    const struct morph_body *bodies[2] = {&morph->source, &morph->target};
    const int size = morph->settings.texture;
    bool good = true;
    for (int b = 0; good && b < 2; ++b) {
        const springls_mesh *mesh = &bodies[b]->mesh;
        struct texture_atlas atlas;
        memset(&atlas, 0, sizeof atlas);
        good = texture_atlas_unwrap(mesh->positions, mesh->vertex_count, mesh->triangles, mesh->triangle_count, size, &atlas)
            || (atlas.full ? morph_fail("--texture %d: too few texels for the charts of a body", size) : morph_no_memory());
        texture_atlas_free(&atlas);
    }
    return good;
}
