#include "character/skeleton_fit.h"

#include "base/vec3.h"
#include "character/skeleton_align.h"
#include "shapes/surface_fit.h"

#include <stdlib.h>
#include <string.h>

enum { CENTERS = 200, WARP_STEPS = 12 };

/* ---- bones ---- */

static bool leads_to_bones(const struct character *c, int joint)
{
    for (int j = c->joint_count - 1; j >= joint; --j) {
        for (int up = j; c->joints[j].bone && up >= joint; up = c->joints[up].parent) {
            if (up == joint) {
                return true;
            }
        }
    }
    return false;
}

int skeleton_bones(const struct character *c, struct bone *bones, int *joints)
{
    int count = 0;
    for (int j = 0; j < c->joint_count; ++j) {
        if (!c->joints[j].bone) {
            continue;
        }
        struct bone bone;
        bool last = true;
        joint_place(&c->joints[j], bone.from);
        for (int k = j + 1; k < c->joint_count; ++k) {
            if (c->joints[k].parent == j && leads_to_bones(c, k)) {
                joint_place(&c->joints[k], bone.to);
                joints[count] = j;
                bones[count++] = bone;
                last = false;
            }
        }
        if (last) {
            float before[3], extension[3] = {0.0f, 0.0f, 0.0f};
            if (c->joints[j].parent >= 0) {
                joint_place(&c->joints[c->joints[j].parent], before);
                vec3_sub(bone.from, before, extension);
            }
            vec3_add_scaled(bone.from, 0.5f, extension, bone.to);
            joints[count] = j;
            bones[count++] = bone;
        }
    }
    return count;
}

/* ---- fitting the donor's surface ---- */

struct fit {
    struct target target;
    struct similarity pose;
    struct warp now, next;
    float *normals, *points, *point_normals, *moved, *moved_normals;
    int *chosen, count;
};

static void fit_free(struct fit *f)
{
    target_free(&f->target);
    warp_free(&f->now);
    warp_free(&f->next);
    free(f->normals);
    free(f->points);
    free(f->point_normals);
    free(f->moved);
    free(f->moved_normals);
    free(f->chosen);
}

static bool choose_points(const struct character *donor, struct fit *f)
{
    const size_t capacity = 3 * CENTERS * sizeof(float);
    f->normals = malloc(3 * (size_t)donor->vertex_count * sizeof *f->normals);
    f->points = malloc(capacity);
    f->point_normals = malloc(capacity);
    f->moved = malloc(capacity);
    f->moved_normals = malloc(capacity);
    f->chosen = malloc(CENTERS * sizeof *f->chosen);
    if (!f->normals || !f->points || !f->point_normals || !f->moved || !f->moved_normals || !f->chosen) {
        return false;
    }
    mesh_normals(donor->positions, (size_t)donor->vertex_count, donor->triangles, (size_t)donor->triangle_count, f->normals);
    f->count = points_spread(donor->positions, donor->vertex_count, CENTERS, f->chosen);
    for (int i = 0; i < f->count; ++i) {
        memcpy(f->points + 3 * i, donor->positions + 3 * f->chosen[i], 3 * sizeof(float));
        memcpy(f->point_normals + 3 * i, f->normals + 3 * f->chosen[i], 3 * sizeof(float));
    }
    return true;
}

/* Transforms a normal by the cofactors of the derivative. */
static void move_normal(const float d[9], const float normal[3], float moved[3])
{
    float c[3];
    for (int i = 0; i < 3; ++i) {
        vec3_cross(d + 3 * ((i + 1) % 3), d + 3 * ((i + 2) % 3), c);
        moved[i] = vec3_dot(c, normal);
    }
    vec3_normalize(moved);
}

static bool lay_on(const struct character *donor, const float *positions, int vertex_count, const int *triangles,
                   int triangle_count, struct fit *f, double *distance)
{
    double center[3], size, cost;
    if (!choose_points(donor, f)
        || !target_create(positions, (size_t)vertex_count, triangles, (size_t)triangle_count, &f->target)) {
        return false;
    }
    shape_size(f->points, (size_t)f->count, center, &size);
    const struct warp_prior *prior = &warp_prior_rough;
    const struct fit_source source = {f->points, f->point_normals, NULL, f->count, 0, size, prior};
    bool good = surface_register(&f->target, &source, ORIENTATION_KNOWN, NULL, &f->pose, &cost)
        && warp_create(f->points, f->count, NULL, 0, size, prior, &f->now)
        && warp_create(f->points, f->count, NULL, 0, size, prior, &f->next);
    for (int s = 0; good && s < WARP_STEPS; ++s) {
        for (int i = 0; i < f->count; ++i) {
            float d[9];
            warp_apply(&f->now, f->points + 3 * i, f->moved + 3 * i, d);
            move_normal(d, f->point_normals + 3 * i, f->moved_normals + 3 * i);
        }
        good = warp_fit(&f->next, &f->target, &f->pose, f->moved, f->moved_normals, NULL) && warp_copy(&f->next, &f->now);
    }
    *distance = 0.0;
    for (int v = 0; good && v < donor->vertex_count; ++v) {
        float place[3], d[9];
        struct target_hit hit;
        warp_apply(&f->now, donor->positions + 3 * v, place, d);
        target_nearest(&f->target, &f->pose, place, &hit);
        *distance += fabs((double)hit.signed_distance) * f->pose.scale / donor->vertex_count;
    }
    return good;
}

/* ---- the fitted skeleton ---- */

static bool copy_keys(const struct keys *from, int numbers, struct keys *to)
{
    const size_t count = (size_t)from->count, width = (size_t)keys_width(from, numbers);
    to->times = malloc((count + 1) * sizeof *to->times);
    to->values = malloc((width * count + 1) * sizeof *to->values);
    if (!to->times || !to->values) {
        return false;
    }
    memcpy(to->times, from->times, count * sizeof *to->times);
    memcpy(to->values, from->values, width * count * sizeof *to->values);
    to->count = from->count;
    to->interpolation = from->interpolation;
    return true;
}

static bool copy_animations(const struct character *donor, struct character *body)
{
    body->animations = calloc((size_t)donor->animation_count + 1, sizeof *body->animations);
    bool good = body->animations != NULL;
    for (int a = 0; good && a < donor->animation_count; ++a) {
        const struct animation *from = &donor->animations[a];
        struct animation *to = &body->animations[body->animation_count++];
        memcpy(to->name, from->name, sizeof to->name);
        to->duration = from->duration;
        to->channels = calloc((size_t)from->channel_count + 1, sizeof *to->channels);
        good = to->channels != NULL;
        for (int c = 0; good && c < from->channel_count; ++c) {
            to->channels[c].joint = from->channels[c].joint;
            to->channel_count++;
            good = from->channels[c].rotation.count == 0
                   || copy_keys(&from->channels[c].rotation, 4, &to->channels[c].rotation);
        }
    }
    return good;
}

/* Places the joints by the fit and rotates them with the bones between them. */
static bool place_joints(const struct character *donor, const struct fit *f, struct character *body)
{
    const size_t count = (size_t)donor->joint_count;
    struct affine *turned = malloc(count * sizeof *turned);
    int *map = malloc(count * sizeof *map);
    body->joints = malloc(count * sizeof *body->joints);
    body->joint_count = body->joints ? donor->joint_count : 0;
    const bool good = turned && map && body->joints;
    for (int j = 0; good && j < donor->joint_count; ++j) {
        float place[3], moved[3], d[9];
        body->joints[j] = donor->joints[j];
        joint_place(&donor->joints[j], place);
        warp_apply(&f->now, place, moved, d);
        similarity_apply(&f->pose, moved, moved);
        for (int i = 0; i < 3; ++i) {
            body->joints[j].neutral.m[4 * i + 3] = (double)moved[i];
        }
        map[j] = donor->joints[j].bone || leads_to_bones(donor, j) ? j : -1;
    }
    if (good) {
        skeleton_fit_bones(donor, body, map, turned);
    }
    for (int j = 0; good && j < donor->joint_count; ++j) {
        struct joint *joint = &body->joints[j];
        const double scale = cbrt(fabs(affine_determinant(&turned[j])));
        struct affine place = affine_after(&turned[j], &donor->joints[j].neutral);
        for (int i = 0; i < 3; ++i) {
            for (int k = 0; k < 3; ++k) { /* keep the donor's scale */
                joint->neutral.m[4 * i + k] = place.m[4 * i + k] / scale;
            }
        }
        const struct affine up = joint->parent >= 0 ? affine_inverse(&body->joints[joint->parent].neutral) : affine_identity();
        const struct affine local = affine_after(&up, &joint->neutral);
        const struct placement p = placement_of(&local);
        memcpy(joint->rest.translation, p.translation, sizeof p.translation);
    }
    free(turned);
    free(map);
    return good;
}

bool skeleton_fit(const struct character *donor, const float *positions, int vertex_count, const int *triangles,
                  int triangle_count, struct character *body, double *distance)
{
    struct fit f;
    memset(&f, 0, sizeof f);
    character_free_rig(body);
    const bool good = lay_on(donor, positions, vertex_count, triangles, triangle_count, &f, distance)
                      && place_joints(donor, &f, body) && copy_animations(donor, body);
    fit_free(&f);
    if (!good) {
        character_free_rig(body);
    }
    body->skinned = good;
    return good;
}
