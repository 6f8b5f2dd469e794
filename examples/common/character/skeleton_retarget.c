#include "character/skeleton_retarget.h"

#include "base/vec3.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- joints ---- */

bool skeleton_make_joints(const struct skeleton_template *s, const struct skeleton_embedding *e,
                          struct character *body, int *joint_of)
{
    character_free_rig(body);
    body->joints = calloc((size_t)s->count + 1, sizeof *body->joints);
    for (int t = 0; body->joints && t < s->count; ++t) {
        joint_of[t] = -1;
        if (!e->present[t] || s->joints[t].end) { continue; }
        struct joint *joint = &body->joints[body->joint_count];
        joint_of[t] = body->joint_count++;
        snprintf(joint->name, sizeof joint->name, "%s", s->joints[t].name);
        joint->parent = s->joints[t].parent >= 0 ? joint_of[s->joints[t].parent] : -1;
        joint->neutral = affine_identity();
        joint->rest = placement_identity();
        for (int i = 0; i < 3; ++i) {
            joint->neutral.m[4 * i + 3] = (double)e->place[t][i];
            joint->rest.translation[i] = (double)e->place[t][i]
                - (joint->parent >= 0 ? body->joints[joint->parent].neutral.m[4 * i + 3] : 0.0);
        }
    }
    body->skinned = body->joints != NULL;
    return body->joints != NULL;
}

/* ---- pairs ---- */

/* Returns whether a name contains one of the words, separated by '|', ignoring case and what is no letter or digit. */
static bool contains_word(const char *name, const char *words)
{
    char plain[CHARACTER_NAME];
    int length = 0;
    for (; *name && length < CHARACTER_NAME - 1; ++name) {
        if (isalnum((unsigned char)*name)) { plain[length++] = (char)tolower((unsigned char)*name); }
    }
    plain[length] = '\0';
    while (*words) {
        char word[CHARACTER_NAME];
        const size_t size = strcspn(words, "|");
        snprintf(word, sizeof word, "%.*s", (int)size, words);
        if (size > 0 && strstr(plain, word)) { return true; }
        words += size + (words[size] == '|');
    }
    return false;
}

static bool is_below(const struct character *c, int joint, int above)
{
    while (joint >= 0 && joint != above) { joint = c->joints[joint].parent; }
    return joint >= 0;
}

/* Returns how much nearer a joint counts for its name: a word of the template's joint, or of another joint only. */
static float name_bonus(const struct skeleton_template *s, int t, const char *name)
{
    if (contains_word(name, s->joints[t].hint)) { return 0.05f; }
    for (int k = 0; k < s->count; ++k) {
        if (!s->joints[k].end && contains_word(name, s->joints[k].hint)) { return -0.05f; }
    }
    return 0.0f;
}

/* Returns whether joint t may be paired with j: what is above and below it is paired with what is above and below j. */
static bool fits(const struct skeleton_template *s, const struct character *rigged, const int *pair, int t, int j)
{
    bool good = rigged->joints[j].bone;
    for (int other = 0; good && other < s->count; ++other) {
        if (pair[other] >= 0) {
            good = pair[other] != j && (!skeleton_template_below(s, t, other) || is_below(rigged, j, pair[other]))
                && (!skeleton_template_below(s, other, t) || is_below(rigged, pair[other], j));
        }
    }
    return good;
}

int skeleton_pair(const struct skeleton_template *s, const struct skeleton_embedding *e,
                  const struct character *rigged, int *pair)
{
    int pairs = 0;
    for (int t = 0; t < s->count; ++t) { pair[t] = -1; }
    for (;; ++pairs) { /* the best pair that is left */
        float best = 0.16f;
        int best_t = -1, best_j = -1;
        for (int t = 0; t < s->count; ++t) {
            for (int j = 0; e->present[t] && !s->joints[t].end && pair[t] < 0 && j < rigged->joint_count; ++j) {
                float place[3], d[3];
                joint_place(&rigged->joints[j], place);
                vec3_sub(place, e->place[t], d);
                const float distance = vec3_length(d) / e->height - name_bonus(s, t, rigged->joints[j].name);
                if (distance < best && fits(s, rigged, pair, t, j)) {
                    best = distance;
                    best_t = t;
                    best_j = j;
                }
            }
        }
        if (best_t < 0) { return pairs; }
        pair[best_t] = best_j;
    }
}

/* ---- motion ---- */

/* Makes the rotation whose columns are left, up and forward. */
static struct affine frame_of(const struct skeleton_embedding *e)
{
    struct affine f = affine_identity();
    for (int i = 0; i < 3; ++i) {
        f.m[4 * i] = (double)e->left[i];
        f.m[4 * i + 1] = (double)e->up[i];
        f.m[4 * i + 2] = (double)e->forward[i];
    }
    return f;
}

struct retarget {
    const struct skeleton_template *skeleton;
    const struct skeleton_embedding *ours, *theirs;
    const struct character *other;
    const int *joint_of, *pair;
    struct affine to_ours, to_theirs;          /* between their world directions and ours */
    struct affine straighten[TEMPLATE_JOINTS]; /* turns our limbs parallel to theirs in the neutral pose */
};

/* Returns the next joint of a limb that both have, -1: none. */
static int limb_child(const struct retarget *r, int t)
{
    for (int k = t + 1; k < r->skeleton->count; ++k) {
        if (r->skeleton->joints[k].parent == t && r->skeleton->joints[k].mirror >= 0 && r->pair[k] >= 0
            && r->joint_of[k] >= 0) {
            return k;
        }
    }
    return -1;
}

static void straighten_limbs(struct retarget *r)
{
    for (int t = 0; t < r->skeleton->count; ++t) {
        const int child = r->pair[t] >= 0 && r->skeleton->joints[t].mirror >= 0 ? limb_child(r, t) : -1;
        r->straighten[t] = affine_identity();
        if (child >= 0) {
            float a[3], b[3], ours[3], theirs[3];
            joint_place(&r->other->joints[r->pair[t]], a);
            joint_place(&r->other->joints[r->pair[child]], b);
            vec3_sub(b, a, theirs);
            affine_apply(&r->to_ours, theirs, theirs);
            vec3_sub(r->ours->place[child], r->ours->place[t], ours);
            if (vec3_length(ours) > 0.0f && vec3_length(theirs) > 0.0f) {
                r->straighten[t] = affine_turn(ours, theirs);
            }
        }
    }
}

/* Computes the world rotation of each template joint of our body at a time. */
static void turn_joints(const struct retarget *r, const struct affine *skin, struct affine *turned)
{
    for (int t = 0; t < r->skeleton->count; ++t) {
        const int up = r->skeleton->joints[t].parent;
        turned[t] = up >= 0 ? turned[up] : affine_identity();
        if (r->pair[t] >= 0) {
            const struct affine change = affine_rotation(&skin[r->pair[t]]), half = affine_after(&change, &r->to_theirs),
                                whole = affine_after(&r->to_ours, &half);
            turned[t] = affine_after(&whole, &r->straighten[t]);
        }
    }
}

static bool make_channels(const struct retarget *r, int keys, struct animation *to)
{
    to->channels = calloc((size_t)r->skeleton->count + 1, sizeof *to->channels);
    bool good = to->channels != NULL;
    for (int t = 0; good && t < r->skeleton->count; ++t) {
        if (r->joint_of[t] < 0 || (r->pair[t] < 0 && r->skeleton->joints[t].parent >= 0)) { continue; }
        struct channel *channel = &to->channels[to->channel_count++];
        channel->joint = r->joint_of[t];
        struct keys *all[2] = {&channel->rotation, r->skeleton->joints[t].parent < 0 ? &channel->translation : NULL};
        for (int k = 0; good && k < 2 && all[k]; ++k) {
            all[k]->times = malloc((size_t)keys * sizeof *all[k]->times);
            all[k]->values = malloc(4 * (size_t)keys * sizeof *all[k]->values);
            all[k]->count = keys;
            good = all[k]->times && all[k]->values;
        }
    }
    return good;
}

/* Sets key k of all channels. */
static void set_keys(const struct retarget *r, int k, double time, const struct affine *turned,
                     const struct affine *places, struct animation *to)
{
    for (int t = 0, c = 0; c < to->channel_count; ++t) {
        struct channel *channel = &to->channels[c];
        if (channel->joint != r->joint_of[t]) { continue; }
        const int up = r->skeleton->joints[t].parent;
        const struct affine back = up >= 0 ? affine_inverse(&turned[up]) : affine_identity(),
                            local = affine_after(&back, &turned[t]);
        const struct placement p = placement_of(&local);
        channel->rotation.times[k] = time;
        memcpy(channel->rotation.values + 4 * k, p.rotation, sizeof p.rotation);
        ++c;
        if (up >= 0) { continue; }
        channel->translation.times[k] = time;
        float moved[3] = {0.0f, 0.0f, 0.0f};
        if (r->pair[t] >= 0) {
            float before[3], now[3];
            joint_place(&r->other->joints[r->pair[t]], before);
            for (int i = 0; i < 3; ++i) { now[i] = (float)places[r->pair[t]].m[4 * i + 3]; }
            vec3_sub(now, before, moved);
            affine_apply(&r->to_ours, moved, moved);
        }
        for (int i = 0; i < 3; ++i) {
            channel->translation.values[3 * k + i] =
                (double)(r->ours->place[t][i] + moved[i] * r->ours->height / r->theirs->height);
        }
    }
}

bool skeleton_retarget(const struct skeleton_template *s, const struct skeleton_embedding *ours, const int *joint_of,
                       const struct character *other, const struct skeleton_embedding *theirs, const int *pair,
                       int animation, int fps, struct character *body)
{
    struct retarget r = {
        .skeleton = s, .ours = ours, .theirs = theirs, .other = other, .joint_of = joint_of, .pair = pair};
    const struct animation *from = &other->animations[animation];
    const int keys = (int)fmin(10000.0, ceil(from->duration * fps)) + 1;
    const struct affine ours_frame = frame_of(ours), theirs_frame = frame_of(theirs),
                        theirs_back = affine_inverse(&theirs_frame);
    struct affine *skin = malloc((size_t)other->joint_count * sizeof *skin),
                  *places = malloc((size_t)other->joint_count * sizeof *places);
    body->animations = calloc(1, sizeof *body->animations);
    bool good = skin && places && body->animations;
    body->animation_count = body->animations ? 1 : 0;
    r.to_ours = affine_after(&ours_frame, &theirs_back);
    r.to_theirs = affine_inverse(&r.to_ours);
    straighten_limbs(&r);
    if (good) {
        memcpy(body->animations->name, from->name, sizeof from->name);
        body->animations->duration = from->duration;
        good = make_channels(&r, keys, body->animations);
    }
    for (int k = 0; good && k < keys; ++k) {
        struct affine turned[TEMPLATE_JOINTS];
        const double time =
            fmin((double)k / fps, 0.9999 * from->duration); /* the end of the animation is its beginning */
        character_pose(other, animation, time, 1.0, skin, places);
        turn_joints(&r, skin, turned);
        set_keys(&r, k, k + 1 < keys ? time : from->duration, turned, places, body->animations);
    }
    free(skin);
    free(places);
    return good;
}
