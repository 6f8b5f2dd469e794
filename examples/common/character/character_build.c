/* character_build.c - two bodies that need no file: capsules along the bones of a skeleton, weights that blend at joints, a
 * checker as colors, and a walk. */
#include "character/character.h"

#include "base/vec3.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COLUMNS = 16, ROWS = 18, CAP_ROWS = 4, PART_VERTICES = (COLUMNS + 1) * ROWS, PART_TRIANGLES = 2 * COLUMNS * (ROWS - 1),
       MAX_PARTS = 24, WALK_KEYS = 25 };

#define WALK_SECONDS 1.2

struct limb { /* a joint, and the capsule from the joint to `end` */
    const char *name;
    int parent;
    float place[3], end[3], radius[2];
};

static const struct limb slim[] = {
    {"hips", -1, {0, 0.98f, 0}, {0, 1.20f, 0}, {0.145f, 0.115f}},
    {"chest", 0, {0, 1.22f, 0}, {0, 1.46f, 0}, {0.120f, 0.150f}},
    {"head", 1, {0, 1.56f, 0}, {0, 1.76f, 0.02f}, {0.085f, 0.125f}},
    {"arm.l", 1, {0.19f, 1.48f, 0}, {0.47f, 1.48f, 0}, {0.070f, 0.052f}},
    {"forearm.l", 3, {0.47f, 1.48f, 0}, {0.74f, 1.48f, 0}, {0.054f, 0.040f}},
    {"hand.l", 4, {0.74f, 1.48f, 0}, {0.86f, 1.48f, 0}, {0.050f, 0.050f}},
    {"arm.r", 1, {-0.19f, 1.48f, 0}, {-0.47f, 1.48f, 0}, {0.070f, 0.052f}},
    {"forearm.r", 6, {-0.47f, 1.48f, 0}, {-0.74f, 1.48f, 0}, {0.054f, 0.040f}},
    {"hand.r", 7, {-0.74f, 1.48f, 0}, {-0.86f, 1.48f, 0}, {0.050f, 0.050f}},
    {"leg.l", 0, {0.11f, 0.92f, 0}, {0.13f, 0.50f, 0}, {0.095f, 0.065f}},
    {"shin.l", 9, {0.13f, 0.50f, 0}, {0.14f, 0.10f, 0}, {0.066f, 0.045f}},
    {"foot.l", 10, {0.14f, 0.08f, -0.02f}, {0.15f, 0.05f, 0.16f}, {0.055f, 0.045f}},
    {"leg.r", 0, {-0.11f, 0.92f, 0}, {-0.13f, 0.50f, 0}, {0.095f, 0.065f}},
    {"shin.r", 12, {-0.13f, 0.50f, 0}, {-0.14f, 0.10f, 0}, {0.066f, 0.045f}},
    {"foot.r", 13, {-0.14f, 0.08f, -0.02f}, {-0.15f, 0.05f, 0.16f}, {0.055f, 0.045f}},
};

static const struct limb broad[] = {
    {"hips", -1, {0, 0.78f, 0}, {0, 1.00f, 0.02f}, {0.215f, 0.235f}},
    {"chest", 0, {0, 1.06f, 0.02f}, {0, 1.32f, 0}, {0.240f, 0.210f}},
    {"head", 1, {0, 1.52f, 0.06f}, {0, 1.58f, 0.20f}, {0.150f, 0.110f}},
    {"arm.l", 1, {0.27f, 1.36f, 0}, {0.60f, 1.32f, 0}, {0.115f, 0.080f}},
    {"forearm.l", 3, {0.60f, 1.32f, 0}, {0.92f, 1.29f, 0}, {0.085f, 0.095f}},
    {"hand.l", 4, {0.92f, 1.29f, 0}, {1.04f, 1.28f, 0}, {0.095f, 0.090f}},
    {"arm.r", 1, {-0.27f, 1.36f, 0}, {-0.60f, 1.32f, 0}, {0.115f, 0.080f}},
    {"forearm.r", 6, {-0.60f, 1.32f, 0}, {-0.92f, 1.29f, 0}, {0.085f, 0.095f}},
    {"hand.r", 7, {-0.92f, 1.29f, 0}, {-1.04f, 1.28f, 0}, {0.095f, 0.090f}},
    {"leg.l", 0, {0.17f, 0.72f, 0}, {0.20f, 0.40f, 0.02f}, {0.125f, 0.090f}},
    {"shin.l", 9, {0.20f, 0.40f, 0.02f}, {0.21f, 0.10f, 0}, {0.090f, 0.075f}},
    {"foot.l", 10, {0.21f, 0.09f, -0.02f}, {0.24f, 0.07f, 0.20f}, {0.085f, 0.070f}},
    {"leg.r", 0, {-0.17f, 0.72f, 0}, {-0.20f, 0.40f, 0.02f}, {0.125f, 0.090f}},
    {"shin.r", 12, {-0.20f, 0.40f, 0.02f}, {-0.21f, 0.10f, 0}, {0.090f, 0.075f}},
    {"foot.r", 13, {-0.21f, 0.09f, -0.02f}, {-0.24f, 0.07f, 0.20f}, {0.085f, 0.070f}},
    {"tail", 0, {0, 0.74f, -0.16f}, {0, 0.62f, -0.42f}, {0.090f, 0.065f}},
    {"tail tip", 15, {0, 0.62f, -0.42f}, {0, 0.78f, -0.66f}, {0.065f, 0.035f}},
    {"horn.l", 2, {0.10f, 1.64f, 0.06f}, {0.22f, 1.80f, 0.06f}, {0.050f, 0.022f}},
    {"horn.r", 2, {-0.10f, 1.64f, 0.06f}, {-0.22f, 1.80f, 0.06f}, {0.050f, 0.022f}},
};

/* ---- surface ---- */

/* Computes the position along the bone and the width of a ring of the capsule with caps, for length 1. */
static void row_place(int row, const float radius[2], float length, float *along, float *width)
{
    const int body = ROWS - 2 * CAP_ROWS;
    if (row < CAP_ROWS) {
        const float a = 1.5707963f * (float)row / CAP_ROWS;
        *along = -radius[0] * cosf(a) / length;
        *width = radius[0] * sinf(a);
    } else if (row >= CAP_ROWS + body) {
        const float a = 1.5707963f * (float)(row - CAP_ROWS - body + 1) / CAP_ROWS;
        *along = 1.0f + radius[1] * sinf(a) / length;
        *width = radius[1] * cosf(a);
    } else {
        *along = (float)(row - CAP_ROWS) / (float)(body - 1);
        *width = radius[0] + *along * (radius[1] - radius[0]);
    }
}

/* Blends weights: half and half at a joint, all on the own bone beyond a fifth of its length. */
static struct influences blend_at(const struct limb *limbs, int count, int bone, float along)
{
    struct influences in;
    int child = -1;
    memset(&in, 0, sizeof in);
    for (int b = count - 1; b > bone; --b) {
        child = limbs[b].parent == bone ? b : child;
    }
    const float before = limbs[bone].parent >= 0 ? 0.5f - 2.5f * fmaxf(0.0f, along) : 0.0f;
    const float after = child >= 0 ? 0.5f - 2.5f * fmaxf(0.0f, 1.0f - along) : 0.0f;
    influences_add(&in, bone, 1.0f - fmaxf(0.0f, before) - fmaxf(0.0f, after));
    if (before > 0.0f) {
        influences_add(&in, limbs[bone].parent, before);
    }
    if (after > 0.0f) {
        influences_add(&in, child, after);
    }
    return in;
}

static void add_limb(struct character *c, const struct limb *limbs, int count, int bone)
{
    const struct limb *limb = &limbs[bone];
    const int first = c->vertex_count;
    float axis[3], u[3], v[3];
    vec3_sub(limb->end, limb->place, axis);
    const float length = vec3_length(axis), other[3] = {0.0f, fabsf(axis[1]) > 0.5f * length ? 0.0f : 1.0f,
                                                        fabsf(axis[1]) > 0.5f * length ? 1.0f : 0.0f};
    float unit[3] = {axis[0], axis[1], axis[2]};
    vec3_normalize(unit);
    vec3_cross(other, unit, u);
    vec3_normalize(u);
    vec3_cross(unit, u, v);
    for (int row = 0; row < ROWS; ++row) {
        float along, width;
        row_place(row, limb->radius, length, &along, &width);
        for (int column = 0; column <= COLUMNS; ++column) {
            const size_t at = (size_t)c->vertex_count++;
            const float turn = 6.2831853f * (float)(column % COLUMNS) / COLUMNS;
            float *p = c->positions + 3 * at;
            vec3_add_scaled(limb->place, along, axis, p);
            vec3_add_scaled(p, width * cosf(turn), u, p);
            vec3_add_scaled(p, width * sinf(turn), v, p);
            const struct color color = color_hsv(0.08f + 0.618f * (float)bone, 0.55f, (row / 3 + column / 4) % 2 ? 0.95f : 0.62f);
            c->colors[3 * at] = color.r, c->colors[3 * at + 1] = color.g, c->colors[3 * at + 2] = color.b;
            c->uvs[2 * at] = ((float)(bone % 5) + (float)column / COLUMNS) / 5.0f; /* an atlas of 5 x 4 */
            c->uvs[2 * at + 1] = ((float)(bone / 5) + (float)row / (ROWS - 1)) / 4.0f;
            c->influences[at] = blend_at(limbs, count, bone, along);
        }
    }
    for (int row = 0; row + 1 < ROWS; ++row) {
        for (int column = 0; column < COLUMNS; ++column) {
            const int a = first + row * (COLUMNS + 1) + column, b = a + COLUMNS + 1;
            const int two[6] = {a, a + 1, b, a + 1, b + 1, b};
            memcpy(c->triangles + 3 * c->triangle_count, two, sizeof two);
            c->triangle_count += 2;
        }
    }
    ++c->part_count;
}

/* ---- skeleton and walk ---- */

static void add_joint(struct character *c, const struct limb *limb)
{
    struct joint *joint = &c->joints[c->joint_count++];
    snprintf(joint->name, sizeof joint->name, "%s", limb->name);
    joint->parent = limb->parent;
    joint->neutral = affine_identity();
    joint->rest = placement_identity();
    joint->bone = true;
    for (int i = 0; i < 3; ++i) {
        joint->neutral.m[4 * i + 3] = (double)limb->place[i];
        joint->rest.translation[i] = (double)limb->place[i]
                                     - (limb->parent >= 0 ? c->joints[limb->parent].neutral.m[4 * i + 3] : 0.0);
    }
}

struct swing { /* angles about x: bias + size * sin(phase); drop: about z */
    const char *name;
    double bias, size, phase, drop;
};

static const struct swing walk[] = {
    {"leg.l", 0.0, -0.50, 0.0, 0.0},      {"leg.r", 0.0, 0.50, 0.0, 0.0},        {"shin.l", 0.35, 0.35, -0.9, 0.0},
    {"shin.r", 0.35, -0.35, -0.9, 0.0},   {"arm.l", 0.0, 0.45, 0.0, -1.05},      {"arm.r", 0.0, -0.45, 0.0, 1.05},
    {"forearm.l", 0.0, 0.0, 0.0, -0.25},  {"forearm.r", 0.0, 0.0, 0.0, 0.25},    {"tail", 0.0, 0.20, 0.6, 0.0},
    {"tail tip", 0.1, 0.35, 1.2, 0.0},    {"head", 0.0, 0.06, 0.5, 0.0},
};

static bool add_channel(struct character *c, struct animation *animation, const struct swing *swing)
{
    const int joint = character_joint(c, swing->name);
    if (joint < 0) {
        return true;
    }
    struct channel *channel = &animation->channels[animation->channel_count++];
    struct keys *keys = &channel->rotation;
    channel->joint = joint;
    keys->times = malloc(WALK_KEYS * sizeof *keys->times);
    keys->values = malloc(4 * WALK_KEYS * sizeof *keys->values);
    if (!keys->times || !keys->values) {
        return false;
    }
    keys->count = WALK_KEYS;
    for (int k = 0; k < WALK_KEYS; ++k) {
        const double part = (double)k / (WALK_KEYS - 1),
                     a = 0.5 * (swing->bias + swing->size * sin(6.2831853 * part + swing->phase));
        const double b = 0.5 * swing->drop;
        const double q[4] = {cos(a) * cos(b), sin(a) * cos(b), -sin(a) * sin(b), cos(a) * sin(b)}; /* about z, then about x */
        keys->times[k] = WALK_SECONDS * part;
        memcpy(keys->values + 4 * k, q, sizeof q);
    }
    return true;
}

static bool add_walk(struct character *c)
{
    const int count = (int)(sizeof walk / sizeof *walk);
    c->animations = calloc(1, sizeof *c->animations);
    if (!c->animations) {
        return false;
    }
    c->animation_count = 1;
    snprintf(c->animations->name, sizeof c->animations->name, "walk");
    c->animations->duration = WALK_SECONDS;
    c->animations->channels = calloc((size_t)count, sizeof *c->animations->channels);
    bool good = c->animations->channels != NULL;
    for (int s = 0; good && s < count; ++s) {
        good = add_channel(c, c->animations, &walk[s]);
    }
    return good;
}

bool character_build(int number, struct character *c, char error[CHARACTER_TEXT])
{
    const struct limb *limbs = number ? broad : slim;
    const int count = number ? (int)(sizeof broad / sizeof *broad) : (int)(sizeof slim / sizeof *slim);
    memset(c, 0, sizeof *c);
    c->skinned = true;
    c->joints = calloc(MAX_PARTS, sizeof *c->joints);
    c->positions = malloc(3 * MAX_PARTS * PART_VERTICES * sizeof *c->positions);
    c->uvs = malloc(2 * MAX_PARTS * PART_VERTICES * sizeof *c->uvs);
    c->colors = malloc(3 * MAX_PARTS * PART_VERTICES * sizeof *c->colors);
    c->influences = malloc(MAX_PARTS * PART_VERTICES * sizeof *c->influences);
    c->triangles = malloc(3 * MAX_PARTS * PART_TRIANGLES * sizeof *c->triangles);
    c->normals = malloc(3 * MAX_PARTS * PART_VERTICES * sizeof *c->normals);
    c->materials_of = calloc(MAX_PARTS * PART_TRIANGLES, sizeof *c->materials_of);
    c->materials = malloc(sizeof *c->materials);
    bool good = c->joints && c->positions && c->normals && c->uvs && c->colors && c->influences && c->triangles && c->materials_of
        && c->materials;
    for (int b = 0; good && b < count; ++b) {
        add_joint(c, &limbs[b]);
        add_limb(c, limbs, count, b);
    }
    if (good) {
        *c->materials = material_plain();
        c->material_count = 1;
    }
    good = good && character_smooth(c, 0, 0) && add_walk(c);
    if (!good) {
        snprintf(error, CHARACTER_TEXT, "not enough memory");
        character_free(c);
    }
    return good;
}
