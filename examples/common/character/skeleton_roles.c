/* skeleton_roles.c - which end of a body is which. */
#include "base/vec3.h"
#include "character/skeleton_embed.h"

#include <stdio.h>
#include <string.h>

static const float SAME_END = 0.15f; /* of the size: ends nearer to each other are those of one limb, such as fingers */

struct search {
    const struct skeleton_template *skeleton;
    const struct medial_tree *tree;
    int count;
    float place[MEDIAL_TIPS][3], distance[MEDIAL_TIPS][MEDIAL_TIPS], all_lengths, size, center[3];
    const float *up;
    float rest[5]; /* proportions of the rest pose, as of proportions() */
    struct skeleton_roles now, best;
    bool best_is_known;          /* the search looks for what else the roles may be */
    float other[SKELETON_ROLES]; /* least cost with another end in each role */
};

/* Returns the length of the way between two joints in the rest pose. */
static float rest_distance(const struct skeleton_template *s, int a, int b)
{
    float length = 0.0f, d[3];
    while (a != b) {
        int *low = a > b ? &a : &b;
        vec3_sub(s->joints[*low].position, s->joints[s->joints[*low].parent].position, d);
        length += vec3_length(d);
        *low = s->joints[*low].parent;
    }
    return length;
}

/* Computes of each pair of limbs the way from the head to where it branches off and its length, and last the way from head to
 * tail. In a tree these follow from distances between ends. */
static void proportions(float head_limb[2][2], const float across[2], float head_tail, float out[5])
{
    for (int l = 0; l < 2; ++l) {
        out[2 * l] = 0.5f * (head_limb[l][0] + head_limb[l][1] - across[l]);
        out[2 * l + 1] = 0.5f * across[l];
    }
    out[4] = head_tail;
}

static void rest_proportions(struct search *s)
{
    const struct skeleton_template *t = s->skeleton;
    float head_limb[2][2], across[2];
    for (int l = 0; l < 2; ++l) {
        for (int side = 0; side < 2; ++side) {
            head_limb[l][side] = rest_distance(t, t->trunk_end[0], t->limb_end[l][side]);
        }
        across[l] = rest_distance(t, t->limb_end[l][0], t->limb_end[l][1]);
    }
    proportions(head_limb, across, t->trunk_ends > 1 ? rest_distance(t, t->trunk_end[0], t->trunk_end[1]) : 0.0f,
                s->rest);
}

static void middle_of(const struct search *s, const int pair[2], float middle[3])
{
    for (int i = 0; i < 3; ++i) { middle[i] = 0.5f * (s->place[pair[0]][i] + s->place[pair[1]][i]); }
}

/* Returns how much farther the second pair of limbs is from the head than the first: where they branch off, or, on four legs, their
 * feet. The legs of a short deep trunk branch off anywhere in it. */
static float second_is_farther(const struct search *s, const float body[5])
{
    const struct skeleton_roles *r = &s->now;
    float far[2], d[3];
    if (!s->skeleton->ground[0] || !s->skeleton->ground[1]) { return body[2] - body[0]; }
    for (int l = 0; l < 2; ++l) {
        middle_of(s, r->limb[l], d);
        vec3_sub(s->place[r->trunk[0]], d, d);
        far[l] = vec3_length(d);
    }
    return far[1] - far[0];
}

/* Returns the variance of the logarithms of the body's proportions over those of the rest pose; in *order how far the limbs
 * are in another order, over the size. */
static float proportion_cost(const struct search *s, float *order)
{
    const struct skeleton_roles *r = &s->now;
    float head_limb[2][2], across[2], body[5], logs[5], mean = 0.0f, cost = 0.0f;
    for (int l = 0; l < 2; ++l) {
        for (int side = 0; side < 2; ++side) { head_limb[l][side] = s->distance[r->trunk[0]][r->limb[l][side]]; }
        across[l] = s->distance[r->limb[l][0]][r->limb[l][1]];
    }
    proportions(head_limb, across, r->trunk[1] >= 0 ? s->distance[r->trunk[0]][r->trunk[1]] : 0.0f, body);
    const int count = r->trunk[1] >= 0 ? 5 : 4;
    for (int i = 0; i < count; ++i) {
        logs[i] = logf(fmaxf(body[i], 1.0f) / s->rest[i]);
        mean += logs[i] / (float)count;
    }
    for (int i = 0; i < count; ++i) { cost += (logs[i] - mean) * (logs[i] - mean) / (float)count; }
    const float sign = s->rest[0] < s->rest[2] ? 1.0f : -1.0f;
    *order = fmaxf(0.0f, 0.02f * s->size - sign * second_is_farther(s, body)) / s->size;
    return cost;
}

static float difference(float a, float b) { return fabsf(a - b) / fmaxf(a + b, 1.0f); }

/* Returns how much distances differ between the sides. Tries the second pair both ways; *swapped: it was better so. */
static float asymmetry(const struct search *s, float left[2][3], bool *swapped)
{
    const struct skeleton_roles *r = &s->now;
    float cost = 0.0f;
    for (int e = 0; e < 2; ++e) {
        for (int l = 0; r->trunk[e] >= 0 && l < 2; ++l) {
            cost += difference(s->distance[r->trunk[e]][r->limb[l][0]], s->distance[r->trunk[e]][r->limb[l][1]]);
        }
    }
    *swapped = vec3_dot(left[0], left[1]) < 0.0f;
    const int *a = r->limb[0], b[2] = {r->limb[1][*swapped], r->limb[1][!*swapped]};
    cost += difference(s->distance[a[0]][b[0]], s->distance[a[1]][b[1]]);
    cost += difference(s->distance[a[0]][b[1]], s->distance[a[1]][b[0]]);
    const float cosine = vec3_dot(left[0], left[1]) / (vec3_length(left[0]) * vec3_length(left[1]) + 1e-30f);
    return cost + 0.7f * (1.0f - fabsf(cosine));
}

/* Computes up from how the body stands: across the plane of four feet, or from two feet to the center of mass. */
static void stand_up(const struct search *s, const float left[3], float up[3])
{
    const struct skeleton_template *t = s->skeleton;
    float feet[2][3], rise[3], along[3];
    middle_of(s, s->now.limb[0], feet[0]);
    middle_of(s, s->now.limb[1], feet[1]);
    const int standing = t->ground[0] ? 0 : 1;
    vec3_sub(s->center, feet[standing], rise);
    vec3_add_scaled(rise, -vec3_dot(rise, left), left, up);
    if (t->ground[0] && t->ground[1]) {
        vec3_sub(feet[1], feet[0], along);
        vec3_cross(left, along, up);
        if (vec3_dot(up, rise) < 0.0f) { vec3_add_scaled(up, -2.0f, up, up); }
    }
    vec3_normalize(up);
}

/* Returns the cost of heights: ends that are higher or lower above the ground, relative to each other, than in the rest pose. */
static float height_cost(const struct search *s, const float left[3])
{
    const struct skeleton_template *t = s->skeleton;
    const struct skeleton_roles *r = &s->now;
    float up[3], feet[3], d[3], cost = 0.0f, higher = 0.0f;
    if (s->up) {
        memcpy(up, s->up, sizeof up);
    } else {
        stand_up(s, left, up);
    }
    cost += 0.35f * (1.0f - fmaxf(0.0f, fmaxf(up[1], up[2]))); /* most files have y or z upwards */
    const int standing = t->ground[0] ? 0 : 1;
    middle_of(s, r->limb[standing], feet);
    vec3_sub(s->place[r->trunk[0]], feet, d);
    const float head = vec3_dot(d, up) / s->size;
    cost += fmaxf(0.0f, 0.1f - head);
    for (int i = 0; t->trunk_ends == 1 && i < s->count; ++i) {
        vec3_sub(s->place[i], feet, d);
        higher = fmaxf(higher, vec3_dot(d, up) / s->size - head);
    }
    cost += 1.5f * higher;
    if (r->trunk[1] >= 0) {
        vec3_sub(s->place[r->trunk[0]], s->place[r->trunk[1]], d);
        const float rest = t->joints[t->trunk_end[0]].position[1] - t->joints[t->trunk_end[1]].position[1];
        cost += 2.0f * fmaxf(0.0f, rest / s->rest[4] - vec3_dot(d, up) / s->size);
    }
    for (int l = 0; l < 2; ++l) { /* feet are below the rest */
        for (int side = 0; side < 2 && t->ground[l]; ++side) {
            vec3_sub(s->place[r->limb[l][side]], s->center, d);
            cost += fmaxf(0.0f, vec3_dot(d, up) / s->size + 0.05f);
        }
    }
    return cost;
}

/* Returns how far ends of the trunk and middles of pairs are from one plane of symmetry, over the size. */
static float plane_cost(const struct search *s, const float left[3])
{
    const struct skeleton_roles *r = &s->now;
    float middle[2][3], d[3], cost = 0.0f;
    middle_of(s, r->limb[0], middle[0]);
    middle_of(s, r->limb[1], middle[1]);
    vec3_sub(middle[1], middle[0], d);
    cost += fabsf(vec3_dot(d, left));
    for (int e = 0; e < 2; ++e) {
        if (r->trunk[e] >= 0) {
            vec3_sub(s->place[r->trunk[e]], middle[0], d);
            cost += fabsf(vec3_dot(d, left));
        }
    }
    return cost / s->size;
}

static bool is_same_end(const struct search *s, int a, int b)
{
    float d[3];
    if (a < 0 || b < 0) { return a == b; }
    vec3_sub(s->place[a], s->place[b], d);
    return vec3_length(d) < SAME_END * s->size;
}

/* Remembers the cost for the roles that have other ends than in the best assignment. */
static void compare_with_best(struct search *s, float cost)
{
    for (int role = 0; role < SKELETON_ROLES; ++role) {
        bool same;
        if (role < SKELETON_FIRST_PAIR) {
            same = is_same_end(s, s->now.trunk[role], s->best.trunk[role]);
        } else {
            const int *a = s->now.limb[role - SKELETON_FIRST_PAIR], *b = s->best.limb[role - SKELETON_FIRST_PAIR];
            same = (is_same_end(s, a[0], b[0]) && is_same_end(s, a[1], b[1])) || (is_same_end(s, a[0], b[1]) && is_same_end(s, a[1], b[0]));
        }
        s->other[role] = same ? s->other[role] : fminf(s->other[role], cost);
    }
}

static void judge(struct search *s)
{
    struct skeleton_roles *r = &s->now;
    float side[2][3], left[3], used = 0.0f, order;
    bool swapped;
    for (int l = 0; l < 2; ++l) {
        vec3_sub(s->place[r->limb[l][0]], s->place[r->limb[l][1]], side[l]);
        used += s->tree->length[r->limb[l][0]] + s->tree->length[r->limb[l][1]];
    }
    for (int e = 0; e < 2; ++e) { used += r->trunk[e] >= 0 ? s->tree->length[r->trunk[e]] : 0.0f; }
    float cost = asymmetry(s, side, &swapped);
    vec3_add_scaled(side[0], swapped ? -1.0f : 1.0f, side[1], left);
    vec3_normalize(left);
    cost += 0.3f * proportion_cost(s, &order) + 20.0f * order;
    cost += plane_cost(s, left) + height_cost(s, left) + 1.0f - used / s->all_lengths;
    if (s->best_is_known) {
        compare_with_best(s, cost);
    } else if (cost < s->best.cost) {
        s->best = *r;
        s->best.cost = cost;
        if (swapped) { /* the same side first in both */
            s->best.limb[1][0] = r->limb[1][1];
            s->best.limb[1][1] = r->limb[1][0];
        }
    }
}

static bool is_used(const struct skeleton_roles *r, int limbs, int tip)
{
    bool used = tip == r->trunk[0] || tip == r->trunk[1];
    for (int l = 0; l < limbs; ++l) { used = used || tip == r->limb[l][0] || tip == r->limb[l][1]; }
    return used;
}

static void try_limbs(struct search *s, int limb)
{
    if (limb == 2) {
        judge(s);
        return;
    }
    for (int a = 0; a < s->count; ++a) {
        for (int b = a + 1; b < s->count; ++b) {
            if (!is_used(&s->now, limb, a) && !is_used(&s->now, limb, b)) {
                s->now.limb[limb][0] = a;
                s->now.limb[limb][1] = b;
                try_limbs(s, limb + 1);
            }
        }
    }
}

/* Judges all assignments. wanted: roles that every body has. */
static void try_all(struct search *s, int wanted)
{
    for (int head = 0; head < s->count; ++head) {
        s->now.trunk[0] = head;
        s->now.trunk[1] = -1;
        if (wanted == 5) { try_limbs(s, 0); }
        for (int tail = 0; s->skeleton->trunk_ends > 1 && tail < s->count; ++tail) {
            s->now.trunk[1] = tail;
            if (tail != head) { try_limbs(s, 0); }
        }
    }
}

bool skeleton_find_roles(const struct skeleton_template *skeleton, const struct solid *solid,
                         const struct medial_tree *tree, const float *up, struct skeleton_roles *roles,
                         char error[CHARACTER_TEXT])
{
    struct search s = {.skeleton = skeleton, .tree = tree, .count = tree->tip_count, .up = up};
    const int wanted = 5 + (skeleton->trunk_ends > 1 && !skeleton->joints[skeleton->trunk_end[1]].optional);
    if (tree->tip_count < wanted) {
        snprintf(error, CHARACTER_TEXT,
                 "the body has %d ends, such as a head, hands and feet; the template %s has %d", tree->tip_count,
                 skeleton->name, wanted);
        return false;
    }
    for (int i = 0; i < s.count; ++i) {
        solid_place(solid, tree->tip[i], s.place[i]);
        s.all_lengths += tree->length[i];
        for (int j = 0; j < s.count; ++j) {
            s.distance[i][j] = medial_tree_distance(tree, tree->tip[i], tree->tip[j]);
        }
    }
    for (int i = 0; i < s.count; ++i) {
        for (int j = 0; j < s.count; ++j) {
            float d[3];
            vec3_sub(s.place[i], s.place[j], d);
            s.size = fmaxf(s.size, vec3_length(d));
        }
    }
    for (int n = 0; n < solid->count; ++n) {
        float place[3];
        solid_place(solid, n, place);
        vec3_add_scaled(s.center, 1.0f / (float)solid->count, place, s.center);
    }
    rest_proportions(&s);
    s.best.cost = INFINITY;
    try_all(&s, wanted);
    s.best_is_known = true;
    for (int role = 0; role < SKELETON_ROLES; ++role) { s.other[role] = INFINITY; }
    try_all(&s, wanted);
    for (int role = 0; role < SKELETON_ROLES; ++role) {
        s.best.confidence[role] = 1.0f - s.best.cost / fmaxf(s.other[role], 1e-30f);
    }
    *roles = s.best;
    return true;
}
