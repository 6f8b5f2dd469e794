/* morph_fixtures.h - what the tests of examples/morph share: a mesh, a character made by hand, and other rigs for characters. */
#ifndef MORPH_FIXTURES_H
#define MORPH_FIXTURES_H

#include "character/character.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scratch.h"

/* assimp 5.2 loses memory of its own on some broken files; LeakSanitizer calls this function for what to ignore. */
const char *__lsan_default_suppressions(void);
const char *__lsan_default_suppressions(void) { return "leak:libassimp\n"; }

#define ASSERT_NEAR(expected, got, tolerance) ASSERT_IN_RANGE((double)(expected), (double)(got), (double)(tolerance))

/* Two tetrahedra that cut each other. */
static const float corners[] = {0,    0,    0,    1,    0,    0,    0,    1,    0,    0,    0,    1,
                                0.2f, 0.2f, 0.2f, 1.2f, 0.2f, 0.2f, 0.2f, 1.2f, 0.2f, 0.2f, 0.2f, 1.2f};
static const int tetrahedra[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2, 4, 6, 5, 4, 5, 7, 5, 6, 7, 4, 7, 6};

/* ---- a character made by hand: a bone at the origin, a second one above it that turns by a right angle ---- */

static float hand_positions[] = {0, 2, 0, 0, 2, 0, 0.5f, 1, 0};
static struct influences hand_influences[3];
static int hand_triangle[] = {0, 1, 2}, hand_material[] = {0};
static float hand_uvs[6], hand_colors[9];
static struct material hand_look;
static double hand_times[] = {0.0, 1.0}, hand_turns[] = {1, 0, 0, 0, 0.70710678118654752, 0, 0, 0.70710678118654752};
static struct joint hand_joints[2];
static struct channel hand_channel;
static struct animation hand_animation;

SHARED struct character by_hand(void)
{
    struct character c;
    memset(&c, 0, sizeof c);
    memset(hand_joints, 0, sizeof hand_joints);
    memset(hand_influences, 0, sizeof hand_influences);
    for (int j = 0; j < 2; ++j) {
        snprintf(hand_joints[j].name, sizeof hand_joints[j].name, j ? "Upper.Bone" : "root");
        hand_joints[j].parent = j - 1;
        hand_joints[j].rest = placement_identity();
        hand_joints[j].rest.translation[1] = j;
        hand_joints[j].neutral = affine_identity();
        hand_joints[j].neutral.m[7] = j;
        hand_joints[j].bone = true;
    }
    influences_add(&hand_influences[0], 1, 1.0f);
    influences_add(&hand_influences[1], 0, 0.5f);
    influences_add(&hand_influences[1], 1, 0.5f);
    influences_add(&hand_influences[2], 0, 1.0f);
    hand_channel.joint = 1;
    hand_channel.rotation.count = 2;
    hand_channel.rotation.times = hand_times;
    hand_channel.rotation.values = hand_turns;
    hand_animation.duration = 2.0;
    hand_animation.channel_count = 1;
    hand_animation.channels = &hand_channel;
    snprintf(hand_animation.name, sizeof hand_animation.name, "bow");
    c.joints = hand_joints, c.joint_count = 2;
    c.positions = hand_positions, c.influences = hand_influences, c.uvs = hand_uvs, c.colors = hand_colors, c.vertex_count = 3;
    c.triangles = hand_triangle, c.materials_of = hand_material, c.materials = &hand_look, c.triangle_count = 1;
    hand_look = material_plain();
    c.material_count = 1;
    c.animations = &hand_animation, c.animation_count = 1;
    c.skinned = true;
    return c;
}

/* Gives a character another rig: names without a meaning, joints whose names contain `joined` joined with those above, another
 * size, and another direction to face. */
SHARED void change_rig(struct character *c, const char *joined, double size, double turn)
{
    const double c_turn = size * cos(turn), s_turn = size * sin(turn);
    const struct affine t = {{c_turn, 0, s_turn, 0.3 * size, 0, size, 0, 0, -s_turn, 0, c_turn, 0}};
    for (int v = 0; v < c->vertex_count; ++v) {
        affine_apply(&t, c->positions + 3 * v, c->positions + 3 * v);
        struct influences *in = &c->influences[v];
        for (int k = 0; k < CHARACTER_BONES; ++k) {
            while (strstr(c->joints[in->joint[k]].name, joined)) in->joint[k] = c->joints[in->joint[k]].parent;
        }
    }
    for (int j = 0; j < c->joint_count; ++j) {
        struct joint *joint = &c->joints[j];
        joint->bone = joint->bone && !strstr(joint->name, joined);
        joint->neutral = affine_after(&t, &joint->neutral);
        for (int k = 0; k < 9; ++k) joint->neutral.m[4 * (k / 3) + k % 3] /= size;
        const struct affine up = j > 0 ? affine_inverse(&c->joints[joint->parent].neutral) : affine_identity();
        const struct affine local = affine_after(&up, &joint->neutral);
        joint->rest = placement_of(&local);
    }
    for (int j = 0; j < c->joint_count; ++j) snprintf(c->joints[j].name, CHARACTER_NAME, "%c%d", joined[0] + 1, 100 - j);
}

#endif
