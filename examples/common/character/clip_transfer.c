#include "character/clip_transfer.h"

#include "base/vec3.h"
#include "character/skeleton_limbs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_KEYS = 10000, COMPARED = 5 };

static const double SAME = 0.02; /* elements of the rotations of the same motion are no further apart, nor durations, relatively */

struct transfer {
    const struct character *source, *target;
    int *from;            /* of each joint of the target: the source's, or -1 */
    int root;             /* the first bone of the target that has one: it also moves */
    struct affine facing, back; /* rotation about y from the source's world to the target's, and back */
    double ratio;               /* of sizes */
    struct affine *straight;    /* for each joint of the target: turns its neutral limb parallel to the source's */
    struct affine *skin, *places, *turned; /* of the source; rotation of each joint of the target from its neutral pose */
};

static void transfer_free(struct transfer *t)
{
    free(t->from);
    free(t->skin);
    free(t->places);
    free(t->turned);
    free(t->straight);
}

/* Finds the turn about y and the ratio of sizes by least squares over all pairs of joints. */
static void find_facing(struct transfer *t)
{
    double mean[2][3] = {{0.0}}, cosine = 0.0, sine = 0.0, spread[2] = {0.0, 0.0};
    int count = 0;
    for (int pass = 0; pass < 2; ++pass) {
        for (int j = 0; j < t->target->joint_count; ++j) {
            float place[2][3];
            double d[2][3];
            if (t->from[j] < 0) {
                continue;
            }
            joint_place(&t->source->joints[t->from[j]], place[0]);
            joint_place(&t->target->joints[j], place[1]);
            for (int c = 0; c < 2; ++c) {
                for (int i = 0; i < 3; ++i) {
                    mean[c][i] += pass == 0 ? (double)place[c][i] : 0.0;
                    d[c][i] = (double)place[c][i] - (pass == 1 ? mean[c][i] / count : 0.0);
                    spread[c] += pass == 1 ? d[c][i] * d[c][i] : 0.0;
                }
            }
            count += pass == 0;
            cosine += pass == 1 ? d[0][0] * d[1][0] + d[0][2] * d[1][2] : 0.0;
            sine += pass == 1 ? d[0][2] * d[1][0] - d[0][0] * d[1][2] : 0.0;
        }
    }
    const double length = hypot(cosine, sine);
    t->facing = affine_identity();
    if (length > 0.0) {
        t->facing.m[0] = t->facing.m[10] = cosine / length;
        t->facing.m[2] = sine / length;
        t->facing.m[8] = -sine / length;
    }
    t->back = affine_inverse(&t->facing);
    t->ratio = spread[0] > 0.0 ? sqrt(spread[1] / spread[0]) : 1.0;
}

/* Turns arms and legs parallel to the source's, so that a T-pose may move an A-pose; trunk and tail keep their own posture. */
static bool find_straight(struct transfer *t)
{
    struct skeleton_limbs limbs;
    for (int j = 0; j < t->target->joint_count; ++j) {
        t->straight[j] = affine_identity();
    }
    if (!skeleton_limbs_find(t->target, &limbs)) {
        return false;
    }
    for (int role = LIMB_ARM_LEFT; role < LIMB_ROLES; ++role) {
        const struct limb *limb = &limbs.limbs[role];
        for (int i = 0; i < limb->count; ++i) {
            const int j = limb->joints[i], next = i + 1 < limb->count ? limb->joints[i + 1] : -1;
            float a[3], b[3], ours[3], theirs[3];
            if (t->from[j] < 0 || next < 0 || t->from[next] < 0) {
                t->straight[j] = i > 0 ? t->straight[limb->joints[i - 1]] : t->straight[j];
                continue;
            }
            joint_place(&t->source->joints[t->from[j]], a);
            joint_place(&t->source->joints[t->from[next]], b);
            vec3_sub(b, a, theirs);
            affine_apply(&t->facing, theirs, theirs);
            vec3_sub(limb->places[i + 1], limb->places[i], ours);
            if (vec3_length(ours) > 0.0f && vec3_length(theirs) > 0.0f) {
                t->straight[j] = affine_turn(ours, theirs);
            }
        }
    }
    return true;
}

static bool transfer_begin(const struct character *source, const struct alignment *a, const struct character *target,
                           struct transfer *t)
{
    const size_t ours = (size_t)target->joint_count + 1, theirs = (size_t)source->joint_count + 1;
    memset(t, 0, sizeof *t);
    t->source = source, t->target = target, t->root = -1;
    t->from = malloc(ours * sizeof *t->from);
    t->turned = malloc(ours * sizeof *t->turned);
    t->straight = malloc(ours * sizeof *t->straight);
    t->skin = malloc(theirs * sizeof *t->skin);
    t->places = malloc(theirs * sizeof *t->places);
    if (!t->from || !t->turned || !t->straight || !t->skin || !t->places) {
        return false;
    }
    for (int j = 0; j < target->joint_count; ++j) {
        t->from[j] = -1;
    }
    for (int j = source->joint_count - 1; j >= 0; --j) { /* of several joints the one nearest to the root */
        if (a->map[j] >= 0) {
            t->from[a->map[j]] = j;
        }
    }
    for (int j = target->joint_count - 1; j >= 0; --j) {
        t->root = t->from[j] >= 0 && target->joints[j].bone ? j : t->root;
    }
    find_facing(t);
    return t->root < 0 || find_straight(t);
}

/* Computes how the target's joints turn: D = F R F^-1 S, where R turns the source's joint, F is the turn between the two worlds,
 * and S makes limbs parallel. Joints without a partner go with the one above. */
static void turn_joints(struct transfer *t, int clip, double time)
{
    character_pose(t->source, clip, time, 1.0, t->skin, t->places);
    for (int j = 0; j < t->target->joint_count; ++j) {
        const int up = t->target->joints[j].parent, from = t->from[j];
        t->turned[j] = up >= 0 ? t->turned[up] : affine_identity();
        if (from >= 0) {
            const struct affine turn = affine_rotation(&t->skin[from]), half = affine_after(&turn, &t->back),
                                whole = affine_after(&t->facing, &half);
            t->turned[j] = affine_after(&whole, &t->straight[j]);
        }
    }
}

static bool make_keys(struct keys *keys, int count, size_t width)
{
    keys->count = count;
    keys->times = malloc((size_t)count * sizeof *keys->times);
    keys->values = malloc(width * (size_t)count * sizeof *keys->values);
    return keys->times && keys->values;
}

/* Returns the rotation of a joint relative to the one above. */
static struct affine local_turn(const struct transfer *t, int joint)
{
    const struct joint *joints = t->target->joints;
    const int up = joints[joint].parent;
    const struct affine neutral = affine_rotation(&joints[joint].neutral), whole = affine_after(&t->turned[joint], &neutral);
    if (up < 0) {
        return whole;
    }
    const struct affine above = affine_rotation(&joints[up].neutral), turned = affine_after(&t->turned[up], &above),
                        back = affine_inverse(&turned);
    return affine_after(&back, &whole);
}

/* Computes where the root is relative to the joint above, which turns only. */
static void root_translation(const struct transfer *t, double out[3])
{
    const struct joint *joint = &t->target->joints[t->root];
    const int from = t->from[t->root];
    float before[3], now[3], moved[3];
    struct affine place = joint->neutral;
    joint_place(&t->source->joints[from], before);
    for (int i = 0; i < 3; ++i) {
        now[i] = (float)t->places[from].m[4 * i + 3];
    }
    vec3_sub(now, before, moved);
    affine_apply(&t->facing, moved, moved);
    for (int i = 0; i < 3; ++i) {
        place.m[4 * i + 3] += t->ratio * (double)moved[i];
    }
    if (joint->parent >= 0) {
        const struct affine *above = &t->target->joints[joint->parent].neutral;
        struct affine turned = affine_after(&t->turned[joint->parent], above);
        for (int i = 3; i < 12; i += 4) {
            turned.m[i] = above->m[i];
        }
        const struct affine back = affine_inverse(&turned);
        place = affine_after(&back, &place);
    }
    for (int i = 0; i < 3; ++i) {
        out[i] = place.m[4 * i + 3];
    }
}

static bool make_channels(const struct transfer *t, int keys, struct animation *to)
{
    to->channels = calloc((size_t)t->target->joint_count + 1, sizeof *to->channels);
    bool good = to->channels != NULL;
    for (int j = 0; good && j < t->target->joint_count; ++j) {
        if (t->from[j] >= 0) {
            struct channel *channel = &to->channels[to->channel_count++];
            channel->joint = j;
            good = make_keys(&channel->rotation, keys, 4) && (j != t->root || make_keys(&channel->translation, keys, 3));
        }
    }
    return good;
}

static bool make_clip(struct transfer *t, int clip, int fps, struct animation *to)
{
    const struct animation *from = &t->source->animations[clip];
    const int keys = (int)fmin(MAX_KEYS, ceil(from->duration * fps)) + 1;
    memcpy(to->name, from->name, sizeof to->name);
    to->duration = from->duration;
    bool good = make_channels(t, keys, to);
    for (int k = 0; good && k < keys; ++k) {
        const double time = keys > 1 ? from->duration * k / (keys - 1) : 0.0;
        turn_joints(t, clip, fmin(time, 0.9999 * from->duration)); /* at its end a clip begins again */
        for (int c = 0; c < to->channel_count; ++c) {
            struct channel *channel = &to->channels[c];
            const struct affine local = local_turn(t, channel->joint);
            const struct placement p = placement_of(&local);
            channel->rotation.times[k] = time;
            quaternion_slerp(p.rotation, p.rotation, 0.0, channel->rotation.values + 4 * k); /* of length 1, despite shear */
            if (channel->joint == t->root) {
                channel->translation.times[k] = time;
                root_translation(t, channel->translation.values + 3 * k);
            }
        }
    }
    return good;
}

/* Finds whether a clip of the source turns the target's joints as one of its own does. Places are not compared: a transferred clip
 * moves the root only. */
static bool same_motion(struct transfer *t, int clip, int own, bool *same)
{
    const struct character *target = t->target;
    const double duration = t->source->animations[clip].duration;
    const size_t size = ((size_t)target->joint_count + 1) * sizeof(struct affine);
    struct affine *skin = malloc(size), *places = malloc(size);
    const bool good = skin && places;
    *same = fabs(target->animations[own].duration - duration) <= SAME * duration;
    for (int n = 0; good && *same && n < COMPARED; ++n) {
        turn_joints(t, clip, duration * n / COMPARED);
        character_pose(target, own, duration * n / COMPARED, 1.0, skin, places);
        for (int j = 0; j < target->joint_count; ++j) {
            if (t->from[j] < 0 || !target->joints[j].bone) { continue; }
            const struct affine ours = affine_rotation(&skin[j]);
            for (int i = 0; i < 12; ++i) { *same = *same && (i % 4 == 3 || fabs(ours.m[i] - t->turned[j].m[i]) <= SAME); }
        }
    }
    free(skin);
    free(places);
    return good;
}

void clips_free(struct animation *clips, int count)
{
    struct character only;
    memset(&only, 0, sizeof only);
    only.animations = clips;
    only.animation_count = count;
    character_free_rig(&only);
}

/* Names the clip, number `number` of the source; keeps it unless the target has it. */
static bool keep_clip(struct transfer *t, int number, struct animation *clip, int *count)
{
    const struct character *target = t->target;
    bool same = false, good = true, named = false;
    for (int a = 0; good && !same && a < target->animation_count; ++a) {
        if (strcmp(target->animations[a].name, clip->name) == 0) {
            named = true;
            good = same_motion(t, number, a, &same);
        }
    }
    if (named) {
        const size_t length = strlen(clip->name), room = sizeof clip->name - sizeof " (source)";
        snprintf(clip->name + (length < room ? length : room), sizeof " (source)", " (source)");
    }
    ++*count; /* for clips_free */
    if (same) {
        struct animation *last = malloc(sizeof *last);
        if (!last) {
            return false;
        }
        *last = *clip;
        clips_free(last, 1);
        memset(clip, 0, sizeof *clip);
        --*count;
    }
    return good;
}

bool clips_transfer(const struct character *source, const struct alignment *alignment, const struct character *target, int fps,
                    struct animation **clips, int *count)
{
    struct transfer t;
    *count = 0;
    *clips = calloc((size_t)source->animation_count + 1, sizeof **clips);
    memset(&t, 0, sizeof t);
    bool good = *clips && transfer_begin(source, alignment, target, &t);
    for (int a = 0; good && t.root >= 0 && a < source->animation_count; ++a) {
        struct animation *clip = &(*clips)[*count];
        if (make_clip(&t, a, fps, clip)) {
            good = keep_clip(&t, a, clip, count);
        } else {
            ++*count;
            good = false;
        }
    }
    transfer_free(&t);
    if (!good) {
        clips_free(*clips, *count);
        *clips = NULL;
        *count = 0;
    }
    return good;
}
