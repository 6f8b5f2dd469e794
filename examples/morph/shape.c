/* shape.c - the shape of a frame: a body between source and target, both in the frame's pose.
 *
 * The two signed distances are blended, limbs that only one body has are united with that, it is moved so that the volume is between
 * theirs, what falls apart is bridged, and what touches is parted. */
#include "morph/morph.h"

#include "base/threads.h"
#include "base/vec3.h"
#include "character/mesh_voxels.h"
#include "character/solid_handles.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define VICINITY 5.0f /* voxels: up to where springls have the weights of the target near them */
#define BAND 0.9f     /* voxels: up to where signed distances of posed bodies are exact */

/* ---- bodies in the present pose ---- */

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

struct pose_loop {
    const struct morph *morph;
    struct morph_body *body;
    float size;
    float *voxels;
};

static void run_pose_loop(void *arg, int begin, int end)
{
    const struct pose_loop *loop = arg;
    const struct morph *morph = loop->morph;
    struct morph_body *body = loop->body;
    const float size = loop->size;
    float *voxels = loop->voxels;
    for (int v = begin; v < end; ++v) {
        const struct affine blend = influences_blend(&body->influences[v], morph->skin);
        float place[3];
        vec3_add_scaled(body->mesh.positions + 3 * v, 1.0f - size, body->mesh_pulls + 3 * v, place);
        affine_apply(&blend, place, body->posed + 3 * v);
        morph_to_voxel(&morph->grid, body->posed + 3 * v, voxels + 3 * v);
    }
}

/* Moves a body's surface to the present pose, with limbs that the other lacks at `size` of theirs, and computes its signed
 * distance. Returns false if memory is short. */
static bool pose_body(struct morph *morph, struct morph_body *body, float size, float *phi, int *nearest)
{
    const struct solid_grid grid = morph_voxels(&morph->grid);
    float *voxels = malloc(3 * ((size_t)body->mesh.vertex_count + 1) * sizeof *voxels);
    struct pose_loop loop = {morph, body, size, voxels};
    threads_for((voxels ? body->mesh.vertex_count : 0), 256, run_pose_loop, &loop);
    const bool continued = body == &morph->target || body->has_alone; /* else nothing reads it beyond the band */
    const bool good = voxels && mesh_voxels(&grid, voxels, body->mesh.triangles, body->mesh.triangle_count, BAND, phi, nearest)
        && (!continued || continue_nearest(morph, phi, nearest));
    free(voxels);
    return good;
}

/* ---- between the two ---- */

struct volume_loop {
    const float *phi;
    float shift;
    int unit;
    int64_t *volume;
    int64_t *near;
};

static void run_volume_loop(void *arg, int begin, int end)
{
    const struct volume_loop *loop = arg;
    const float *phi = loop->phi;
    const float shift = loop->shift;
    const int unit = loop->unit;
    int64_t volume = 0;
    int64_t near = 0;
    for (int n = begin; n < end; ++n) {
        const float x = phi[n] + shift;
        volume += x <= -0.5f ? unit : x < 0.5f ? (int)((0.5f - x) * (float)unit) : 0;
        near += fabsf(x) < 0.5f;
    }
    threads_lock();
    *loop->volume += volume;
    *loop->near += near;
    threads_unlock();
}

/* Returns the volume of a level set, voxels, and in *area roughly that of its surface. What is summed are integers: their order,
 * and so the number of threads, changes no bit. */
static double volume_of(const struct morph *morph, const float *phi, float shift, double *area)
{
    const int count = (int)morph_voxel_count(morph), unit = 1 << 20;
    int64_t volume = 0, near = 0;
    struct volume_loop loop = {phi, shift, unit, &volume, &near};
    threads_for(count, 16384, run_volume_loop, &loop);
    *area = (double)near;
    return (double)volume / unit;
}

/* Unites a voxel of a level set with those limbs of a body that the other lacks. */
static float unite_alone(const struct morph *morph, const struct morph_body *body, float body_phi, int nearest, float phi)
{
    return body_phi < phi && body->has_alone && nearest >= 0 && morph_is_alone(morph, body, nearest) ? body_phi : phi;
}

struct blend_loop {
    struct morph *morph;
    float part;
    const float *source;
    const float *target;
};

static void run_blend_loop(void *arg, int begin, int end)
{
    const struct blend_loop *loop = arg;
    struct morph *morph = loop->morph;
    const float part = loop->part;
    const float *source = loop->source;
    const float *target = loop->target;
    for (int n = begin; n < end; ++n) {
        float phi = (1.0f - part) * source[n] + part * target[n];
        phi = unite_alone(morph, &morph->source, source[n], morph->source_nearest[n], phi);
        morph->shape[n] = unite_alone(morph, &morph->target, target[n], morph->target_nearest[n], phi);
    }
}

/* Blends the level sets of source and target, and unites limbs that only one has with them. */
static void blend_bodies(struct morph *morph, float part)
{
    const int count = (int)morph_voxel_count(morph);
    const float *source = morph->source_phi, *target = morph->target_phi;
    struct blend_loop loop = {morph, part, source, target};
    threads_for(count, 16384, run_blend_loop, &loop);
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

bool morph_shape(struct morph *morph, float part)
{
    const struct solid_grid voxels = morph_voxels(&morph->grid);
    const int count = (int)morph_voxel_count(morph);
    float *phi = morph->shape, *source = morph->source_phi, *target = morph->target_phi;
    double area, volumes[2] = {0.0, 0.0};
    struct solid_repair repair;
    struct solid_handles handles;
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
    morph_add_rods(morph, part, phi);
    morph_mark_limbs(morph, part);
    return (solid_repair(&voxels, phi, morph->limbs, morph->settings.reach, true, &repair)
            && solid_cut_handles(&voxels, phi, morph->limbs, 0, &handles))
        || morph_no_memory();
}

float morph_sample(const int size[3], const float *phi, const float place[3])
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
