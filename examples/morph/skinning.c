/* skinning.c - linear blend skinning as the affine force of eq. 1, and in the same step the push of an active contour to the shape
 * of the frame. */
#include "morph/morph.h"

#include "base/vec3.h"

#include <math.h>
#include <string.h>

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
        const struct influences in = morph_springl_weights(s->morph, a);
        const struct affine t = motion(s, batch->time, &in, s->part > 0.0f ? target_weights(s->morph, p) : NULL);
        to_velocity(&s->morph->grid, &t, map);
        if (left <= 1e-3f) { continue; } /* at the end of the step */
        for (int k = 0; k < 3; ++k) { place[k] = p[k] + left * (vec3_dot(map + 4 * k, p) + map[4 * k + 3]); }
        const float speed = morph_pressure(s->morph, morph_sample(s->morph->grid.size, s->morph->shape, place)) / left;
        for (int k = 0; k < 3; ++k) { map[4 * k + 3] += speed * batch->normals[3 * i + k]; }
    }
}

bool morph_skin(struct morph *morph, float part)
{
    struct skinning skinning = {morph, morph->skin_before, morph->skin, (float)springls_time(morph->ctx), part};
    springls_forces forces;
    springls_step_desc step;
    memset(&forces, 0, sizeof forces);
    memset(&step, 0, sizeof step);
    forces.voxel_units = true;
    forces.affine_batch = move_springls;
    forces.user = &skinning;
    forces.integrator = SPRINGLS_INTEGRATOR_EULER;
    step.forces = &forces;
    step.mode = SPRINGLS_MODE_FLUID;
    step.max_displacement = 3.0f;
    step.dt = 1.0f;
    return morph_cache_weights(morph) && morph_check(morph->ctx, springls_step(morph->ctx, &step), "skinning");
}
