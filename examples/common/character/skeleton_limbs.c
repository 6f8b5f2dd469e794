#include "character/skeleton_limbs.h"

#include "base/vec3.h"

#include <stdlib.h>
#include <string.h>

const char *limb_name(enum limb_role role)
{
    static const char *const names[LIMB_ROLES] = {"trunk", "tail", "left arm", "right arm", "left leg", "right leg"};
    return names[role];
}

/* ---- what moves with each joint ---- */

struct joint_share {
    int up;         /* the joint above in the tree of joints that lead to bones, -1: none; -2: leads to no bone */
    int mirror;     /* the joint nearest to the mirror image; itself: on the plane of symmetry */
    double area;    /* of the surface of which this joint moves the most */
    float middle[3];
    float place[3], tip[3]; /* tip: where the bone ends if no joint follows */
};

struct search {
    const struct character *character;
    struct joint_share *shares;
    int count;
    float left[3], origin[3], size;
};

static int strongest(const struct influences *in)
{
    int best = 0;
    for (int k = 1; k < CHARACTER_BONES; ++k) { best = in->weight[k] > in->weight[best] ? k : best; }
    return in->joint[best];
}

static float twice_area(const struct character *c, const int corner[3])
{
    float u[3], v[3], normal[3];
    vec3_sub(c->positions + 3 * corner[1], c->positions + 3 * corner[0], u);
    vec3_sub(c->positions + 3 * corner[2], c->positions + 3 * corner[0], v);
    vec3_cross(u, v, normal);
    return vec3_length(normal);
}

/* Sums the surface's area over the joints that move it most, a third of a triangle for each corner. */
static void share_surface(struct search *s)
{
    const struct character *c = s->character;
    for (int t = 0; t < c->triangle_count; ++t) {
        const int *corner = c->triangles + 3 * t;
        const float area = twice_area(c, corner) / 6.0f;
        for (int k = 0; k < 3; ++k) {
            struct joint_share *share = &s->shares[strongest(&c->influences[corner[k]])];
            share->area += (double)area;
            vec3_add_scaled(share->middle, area, c->positions + 3 * corner[k], share->middle);
        }
    }
    for (int j = 0; j < s->count; ++j) {
        struct joint_share *share = &s->shares[j];
        joint_place(&c->joints[j], share->place);
        for (int i = 0; i < 3; ++i) {
            share->middle[i] = share->area > 0.0 ? share->middle[i] / (float)share->area : share->place[i];
            share->tip[i] = 2.0f * share->middle[i] - share->place[i];
        }
    }
}

static float distance_of(const float a[3], const float b[3])
{
    float d[3];
    vec3_sub(a, b, d);
    return vec3_length(d);
}

static bool is_below(const struct search *s, int joint, int above)
{
    for (int steps = 0; joint >= 0 && joint != above && steps < s->count; ++steps) { joint = s->shares[joint].up; }
    return joint == above;
}

static bool has_bone_above(const struct search *s, int joint)
{
    for (joint = s->shares[joint].up; joint >= 0; joint = s->shares[joint].up) {
        if (s->character->joints[joint].bone) { return true; }
    }
    return false;
}

/* Links each joint that leads to bones to the joint above. A bone without a bone above, such as a foot that inverse kinematics
 * moves, hangs on the bone at whose end it is. */
static void link_joints(struct search *s)
{
    const struct character *c = s->character;
    for (int j = 0; j < s->count; ++j) { s->shares[j].up = -2; }
    for (int j = 0; j < s->count; ++j) {
        for (int up = j; c->joints[j].bone && up >= 0; up = c->joints[up].parent) { s->shares[up].up = c->joints[up].parent; }
    }
    for (int j = 0; j < s->count; ++j) {
        if (!c->joints[j].bone || has_bone_above(s, j)) { continue; }
        for (int k = 0; k < s->count; ++k) {
            const struct joint_share *end = &s->shares[k];
            if (c->joints[k].bone && !is_below(s, k, j)
                && distance_of(s->shares[j].place, end->tip) < 0.25f * distance_of(end->place, end->tip)) {
                s->shares[j].up = k;
            }
        }
    }
}

/* ---- the plane of symmetry ---- */

static void reflect(const struct search *s, const float place[3], float image[3])
{
    float d[3];
    vec3_sub(place, s->origin, d);
    vec3_add_scaled(place, -2.0f * vec3_dot(d, s->left), s->left, image);
}

/* Pairs each joint with the one nearest to its mirror image; returns their mean distance. */
static float mirror_joints(struct search *s)
{
    float sum = 0.0f;
    int count = 0;
    for (int j = 0; j < s->count; ++j) {
        float image[3], best = INFINITY;
        s->shares[j].mirror = j;
        reflect(s, s->shares[j].place, image);
        for (int k = 0; s->character->joints[j].bone && k < s->count; ++k) {
            const float distance = s->character->joints[k].bone ? distance_of(image, s->shares[k].place) : INFINITY;
            if (distance < best) {
                best = distance;
                s->shares[j].mirror = k;
            }
        }
        sum += best < INFINITY ? best : 0.0f;
        count += best < INFINITY;
    }
    return count > 0 ? sum / (float)count : 0.0f;
}

/* Finds the upright plane in which joints are nearest to each other's mirror images. */
static void find_plane(struct search *s)
{
    const float x_axis[3] = {1.0f, 0.0f, 0.0f};
    float best[6] = {1.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f}, least = INFINITY;
    for (int a = 0; a < s->count; ++a) {
        for (int b = a; b < s->count; ++b) { /* b = a: the plane x = 0 of the joint */
            if (!s->character->joints[a].bone || !s->character->joints[b].bone) { continue; }
            vec3_sub(s->shares[b].place, s->shares[a].place, s->left);
            const bool level = fabsf(s->left[1]) < 0.1f * vec3_length(s->left);
            if (a == b) { memcpy(s->left, x_axis, sizeof x_axis); }
            s->left[1] = 0.0f;
            if ((a != b && !level) || !(vec3_normalize(s->left) > 0.02f * s->size)) { continue; }
            for (int i = 0; i < 3; ++i) { s->origin[i] = 0.5f * (s->shares[a].place[i] + s->shares[b].place[i]); }
            const float cost = mirror_joints(s) + (a == b ? 0.01f * s->size : 0.0f);
            if (cost < least) {
                least = cost;
                memcpy(best, s->left, sizeof s->left);
                memcpy(best + 3, s->origin, sizeof s->origin);
            }
        }
    }
    memcpy(s->left, best, sizeof s->left);
    memcpy(s->origin, best + 3, sizeof s->origin);
    mirror_joints(s);
}

/* ---- chains ---- */

/* Returns the length of the longest way down from a joint, and the joint where it goes on. on_plane: only along the plane of
 * symmetry. */
static float longest_way(const struct search *s, int joint, bool on_plane, int *next)
{
    float best = -1.0f;
    *next = -1;
    for (int k = 0; k < s->count; ++k) {
        int beyond;
        if (s->shares[k].up != joint || (on_plane && s->shares[k].mirror != k)) { continue; }
        const float length = distance_of(s->shares[k].place, s->shares[joint].place) + longest_way(s, k, on_plane, &beyond);
        if (length > best) {
            best = length;
            *next = k;
        }
    }
    return *next >= 0 ? best : distance_of(s->shares[joint].place, s->shares[joint].tip);
}

/* Completes a chain whose joints are known. */
static void measure_chain(const struct search *s, struct limb *limb)
{
    float length = 0.0f;
    for (int k = 0; k <= limb->count; ++k) {
        const struct joint_share *share = &s->shares[limb->joints[k < limb->count ? k : limb->count - 1]];
        memcpy(limb->places[k], k < limb->count ? share->place : share->tip, sizeof limb->places[k]);
        length += k > 0 ? distance_of(limb->places[k], limb->places[k - 1]) : 0.0f;
        limb->along[k] = length;
    }
    for (int k = 0; k <= limb->count && length > 0.0f; ++k) { limb->along[k] /= length; }
}

/* Follows the longest way down from a joint. */
static void follow(const struct search *s, int joint, bool on_plane, struct limb *limb)
{
    limb->count = 0;
    while (joint >= 0 && limb->count < LIMB_JOINTS) {
        limb->joints[limb->count++] = joint;
        longest_way(s, joint, on_plane, &joint);
    }
    measure_chain(s, limb);
}

static float chain_length(const struct limb *limb)
{
    float length = 0.0f;
    for (int k = 1; k <= limb->count; ++k) { length += distance_of(limb->places[k], limb->places[k - 1]); }
    return length;
}

static int limb_index(const struct limb *limb, int joint)
{
    for (int k = 0; k < limb->count; ++k) {
        if (limb->joints[k] == joint) { return k; }
    }
    return -1;
}

/* Finds the trunk: joints on the plane of symmetry down to the highest end of them, the head. */
static bool find_trunk(struct search *s, struct limb *trunk)
{
    int head = -1, path[LIMB_JOINTS], length = 0;
    for (int j = 0; j < s->count; ++j) {
        bool good = s->character->joints[j].bone && s->shares[j].mirror == j;
        for (int k = 0; good && k < s->count; ++k) {
            good = !(s->shares[k].up == j && s->shares[k].mirror == k && s->character->joints[k].bone);
        }
        if (good && (head < 0 || s->shares[j].middle[1] > s->shares[head].middle[1])) { head = j; }
    }
    for (int j = head; j >= 0 && length < LIMB_JOINTS; j = s->shares[j].up) { path[length++] = j; }
    bool begun = false;
    trunk->count = 0;
    for (int k = length - 1; k >= 0; --k) { /* from the first that is a bone or has limbs */
        begun = begun || s->character->joints[path[k]].bone;
        for (int j = 0; j < s->count; ++j) { begun = begun || (s->shares[j].up == path[k] && s->shares[j].mirror != j); }
        if (begun) { trunk->joints[trunk->count++] = path[k]; }
    }
    if (trunk->count > 0) { measure_chain(s, trunk); }
    return trunk->count > 0;
}

/* ---- roles ---- */

struct limb_pair {
    struct limb limbs[2]; /* on the side of `left`, on the other */
    int from;             /* joint of the trunk */
    float length;
};

static void keep_longest(struct limb_pair *pairs, const struct limb_pair *pair)
{
    const int place = pair->length > pairs[0].length ? 0 : pair->length > pairs[1].length ? 1 : 2;
    if (place == 0) { pairs[1] = pairs[0]; }
    if (place < 2) { pairs[place] = *pair; }
}

/* Finds the two longest pairs of chains that leave the trunk, the one nearer to the head first. */
static void find_pairs(const struct search *s, const struct limb *trunk, struct limb_pair pairs[2])
{
    memset(pairs, 0, 2 * sizeof *pairs);
    for (int j = 0; j < s->count; ++j) {
        const int from = s->shares[j].up >= 0 ? limb_index(trunk, s->shares[j].up) : -1;
        int other = s->shares[j].mirror;
        float d[3];
        vec3_sub(s->shares[j].place, s->origin, d);
        if (from < 0 || other == j || vec3_dot(d, s->left) < 0.0f) { continue; }
        while (other >= 0 && limb_index(trunk, s->shares[other].up) < 0) { other = s->shares[other].up; } /* where it begins */
        if (other < 0) { continue; }
        struct limb_pair pair;
        memset(&pair, 0, sizeof pair);
        follow(s, j, false, &pair.limbs[0]);
        follow(s, other, false, &pair.limbs[1]);
        pair.from = from;
        pair.length = chain_length(&pair.limbs[0]) + chain_length(&pair.limbs[1]);
        keep_longest(pairs, &pair);
    }
    const struct limb *first = &pairs[0].limbs[0], *second = &pairs[1].limbs[0];
    const float root = trunk->places[0][1];
    const bool swap = second->count > 0
        ? pairs[1].from > pairs[0].from
            || (pairs[1].from == pairs[0].from && second->places[second->count][1] > first->places[first->count][1])
        : first->count > 0 && first->places[first->count][1] < root - 0.25f * pairs[0].length;
    if (swap) { /* one pair alone is arms, unless it reaches far down */
        const struct limb_pair kept = pairs[0];
        pairs[0] = pairs[1];
        pairs[1] = kept;
    }
}

static void find_tail(const struct search *s, const struct limb *trunk, int arms_from, struct limb *tail)
{
    float longest = 0.15f * chain_length(trunk);
    for (int j = 0; j < s->count; ++j) {
        const int from = s->shares[j].up >= 0 ? limb_index(trunk, s->shares[j].up) : -1;
        if (from >= 0 && from < arms_from && s->shares[j].mirror == j && limb_index(trunk, j) < 0) {
            struct limb limb;
            follow(s, j, true, &limb);
            if (chain_length(&limb) > longest) {
                longest = chain_length(&limb);
                *tail = limb;
            }
        }
    }
}

/* Finds forward, and which side is left. */
static void find_directions(const struct search *s, struct skeleton_limbs *l)
{
    const struct limb *trunk = &l->limbs[LIMB_TRUNK];
    const float up[3] = {0.0f, 1.0f, 0.0f};
    float along[3], front[3];
    memcpy(l->up, up, sizeof up);
    memcpy(l->left, s->left, sizeof l->left);
    vec3_cross(l->left, l->up, l->forward);
    vec3_sub(trunk->places[trunk->count - 1], trunk->places[0], front);
    vec3_sub(s->shares[trunk->joints[trunk->count - 1]].middle, trunk->places[0], along);
    if (fabsf(vec3_dot(along, l->forward)) < fabsf(along[1])) { /* it stands: feet point forward */
        memset(front, 0, sizeof front);
        for (int side = 0; side < 2; ++side) {
            const struct limb *leg = &l->limbs[LIMB_LEG_LEFT + side];
            const int foot = leg->count - (leg->count > 3 ? 2 : 1); /* the ankle */
            for (int i = 0; i < 3 && leg->count > 0; ++i) { front[i] += leg->places[leg->count][i] - leg->places[foot][i]; }
        }
    }
    const float sign = vec3_dot(front, l->forward);
    if (sign < 0.0f || (!(sign > 0.0f) && l->forward[2] < 0.0f)) { /* glTF: characters face +z */
        for (int i = 0; i < 3; ++i) { l->left[i] = -l->left[i], l->forward[i] = -l->forward[i]; }
        for (int role = LIMB_ARM_LEFT; role <= LIMB_LEG_LEFT; role += 2) {
            const struct limb kept = l->limbs[role];
            l->limbs[role] = l->limbs[role + 1];
            l->limbs[role + 1] = kept;
        }
    }
}

/* Gives the joints of two limbs that mirror each other the same shares of the way, the mean: so both are paired alike, where an artist's
 * two sides differ a little. */
static void even_sides(struct limb *left, struct limb *right)
{
    for (int k = 0; left->count == right->count && k <= left->count; ++k) {
        left->along[k] = right->along[k] = 0.5f * (left->along[k] + right->along[k]);
    }
}

/* Returns the limb that a joint belongs to or hangs on. */
static int role_of(const struct search *s, const struct skeleton_limbs *l, int joint)
{
    for (; joint >= 0; joint = s->shares[joint].up) {
        for (int role = 0; role < LIMB_ROLES; ++role) {
            if (limb_index(&l->limbs[role], joint) >= 0) { return role; }
        }
    }
    return LIMB_TRUNK;
}

static float distance_from_limb(const struct limb *limb, const float point[3])
{
    float best = INFINITY;
    for (int k = 0; k < limb->count; ++k) {
        float axis[3], d[3], place[3];
        vec3_sub(limb->places[k + 1], limb->places[k], axis);
        vec3_sub(point, limb->places[k], d);
        const float square = vec3_dot(axis, axis);
        vec3_add_scaled(limb->places[k], square > 0.0f ? fmaxf(0.0f, fminf(1.0f, vec3_dot(d, axis) / square)) : 0.0f, axis, place);
        best = fminf(best, distance_of(point, place));
    }
    return best;
}

/* Measures how thick limbs are, and how large the head is. */
static void measure_limbs(const struct search *s, struct skeleton_limbs *l)
{
    const struct character *c = s->character;
    const struct limb *trunk = &l->limbs[LIMB_TRUNK];
    const int head = trunk->joints[trunk->count - 1];
    double sums[LIMB_ROLES][2], size[2] = {0.0, 0.0};
    memset(sums, 0, sizeof sums);
    memcpy(l->head, s->shares[head].middle, sizeof l->head);
    for (int t = 0; t < c->triangle_count; ++t) {
        const int *corner = c->triangles + 3 * t;
        const double area = (double)twice_area(c, corner);
        for (int k = 0; k < 3; ++k) {
            const float *point = c->positions + 3 * corner[k];
            const int joint = strongest(&c->influences[corner[k]]), role = role_of(s, l, joint);
            if (joint == head) {
                const double d = (double)distance_of(point, l->head);
                size[0] += area * d * d;
                size[1] += area;
            } else {
                sums[role][0] += area * (double)distance_from_limb(&l->limbs[role], point);
                sums[role][1] += area;
            }
        }
    }
    l->head_size = size[1] > 0.0 ? (float)sqrt(size[0] / size[1]) : 0.0f;
    for (int role = 0; role < LIMB_ROLES; ++role) {
        l->limbs[role].radius = sums[role][1] > 0.0 ? (float)(sums[role][0] / sums[role][1]) : 0.0f;
    }
}

bool skeleton_limbs_find(const struct character *c, struct skeleton_limbs *l)
{
    struct search s = {.character = c, .count = c->joint_count};
    struct limb_pair pairs[2];
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    memset(l, 0, sizeof *l);
    s.shares = calloc((size_t)s.count + 1, sizeof *s.shares);
    if (!s.shares) { return false; }
    for (int v = 0; v < c->vertex_count; ++v) {
        for (int i = 0; i < 3; ++i) {
            lo[i] = fminf(lo[i], c->positions[3 * v + i]);
            hi[i] = fmaxf(hi[i], c->positions[3 * v + i]);
        }
    }
    s.size = l->size = distance_of(lo, hi);
    share_surface(&s);
    link_joints(&s);
    find_plane(&s);
    const bool good = find_trunk(&s, &l->limbs[LIMB_TRUNK]);
    if (good) {
        find_pairs(&s, &l->limbs[LIMB_TRUNK], pairs);
        for (int p = 0; p < 2; ++p) {
            for (int side = 0; side < 2; ++side) { l->limbs[LIMB_ARM_LEFT + 2 * p + side] = pairs[p].limbs[side]; }
        }
        find_tail(&s, &l->limbs[LIMB_TRUNK], pairs[0].limbs[0].count > 0 ? pairs[0].from + (pairs[0].from == 0) : LIMB_JOINTS,
                  &l->limbs[LIMB_TAIL]);
        find_directions(&s, l);
        even_sides(&l->limbs[LIMB_ARM_LEFT], &l->limbs[LIMB_ARM_RIGHT]);
        even_sides(&l->limbs[LIMB_LEG_LEFT], &l->limbs[LIMB_LEG_RIGHT]);
        measure_limbs(&s, l);
    }
    free(s.shares);
    return good;
}

/* ---- pairs ---- */

/* Computes the place at a share of the way along a limb. */
static void place_along(const struct limb *limb, float along, float place[3])
{
    int k = 0;
    while (k + 1 < limb->count && limb->along[k + 1] < along) { ++k; }
    const float way = limb->along[k + 1] - limb->along[k], t = way > 0.0f ? (along - limb->along[k]) / way : 0.0f;
    float axis[3];
    vec3_sub(limb->places[k + 1], limb->places[k], axis);
    vec3_add_scaled(limb->places[k], fmaxf(0.0f, fminf(1.0f, t)), axis, place);
}

/* Returns the joint of a limb nearest to a share of the way along it. */
static int nearest_joint(const struct limb *limb, float along)
{
    int best = 0;
    for (int k = 1; k < limb->count; ++k) {
        best = fabsf(limb->along[k] - along) < fabsf(limb->along[best] - along) ? k : best;
    }
    return best;
}

/* Converts a share of the way along a limb piecewise linearly, so that each `from` becomes its `to`. */
static float convert_along(const float *from, const float *to, int count, float along)
{
    int k = 0;
    while (k + 2 < count && along > from[k + 1]) { ++k; }
    const float way = from[k + 1] - from[k];
    return way > 0.0f ? to[k] + (to[k + 1] - to[k]) * (along - from[k]) / way : to[k];
}

/* Returns how far along the trunk arms begin, between the hips and the last joint. */
static float arms_along(const struct skeleton_limbs *l)
{
    const struct limb *trunk = &l->limbs[LIMB_TRUNK];
    float middle[3], best = INFINITY, along = 0.0f;
    vec3_add_scaled(l->limbs[LIMB_ARM_LEFT].places[0], 1.0f, l->limbs[LIMB_ARM_RIGHT].places[0], middle);
    for (int i = 0; i < 3; ++i) { middle[i] *= 0.5f; }
    for (int k = 0; k <= 64; ++k) {
        const float at = trunk->along[trunk->count - 1] * (float)k / 64.0f;
        float place[3];
        place_along(trunk, at, place);
        if (distance_of(place, middle) < best) {
            best = distance_of(place, middle);
            along = at;
        }
    }
    return along;
}

/* Lists places of two limbs that correspond: ends, joints that are each other's nearest, and in the trunk arms and head. */
static int find_landmarks(const struct skeleton_limbs *ours, const struct skeleton_limbs *theirs, int role, float *from, float *to)
{
    const struct limb *a = &ours->limbs[role], *b = &theirs->limbs[role];
    int count = 1;
    from[0] = to[0] = 0.0f;
    if (role == LIMB_TRUNK) {
        const float ends[2] = {a->along[a->count - 1], b->along[b->count - 1]};
        if (ours->limbs[LIMB_ARM_LEFT].count > 0 && theirs->limbs[LIMB_ARM_LEFT].count > 0 && a->count > 1 && b->count > 1) {
            from[count] = fmaxf(0.2f * ends[0], fminf(0.95f * ends[0], arms_along(ours)));
            to[count++] = fmaxf(0.2f * ends[1], fminf(0.95f * ends[1], arms_along(theirs)));
        }
        if (ends[0] > 0.0f && ends[1] > 0.0f) {
            from[count] = ends[0];
            to[count++] = ends[1];
        }
    } else {
        for (int k = 1; k < a->count; ++k) {
            const int near = nearest_joint(b, a->along[k]);
            if (near > 0 && nearest_joint(a, b->along[near]) == k) {
                from[count] = a->along[k];
                to[count++] = b->along[near];
            }
        }
    }
    from[count] = to[count] = 1.0f;
    return count + 1;
}

/* Makes the rotation whose columns are left, up and forward. */
static struct affine frame_of(const struct skeleton_limbs *l)
{
    struct affine f = affine_identity();
    for (int i = 0; i < 3; ++i) {
        f.m[4 * i] = (double)l->left[i];
        f.m[4 * i + 1] = (double)l->up[i];
        f.m[4 * i + 2] = (double)l->forward[i];
    }
    return f;
}

/* Moves the map so that `from` goes to `to`. */
static void pin(struct affine *a, const float from[3], const float to[3])
{
    float moved[3];
    a->m[3] = a->m[7] = a->m[11] = 0.0;
    affine_apply(a, from, moved);
    for (int i = 0; i < 3; ++i) { a->m[4 * i + 3] = (double)(to[i] - moved[i]); }
}

/* Returns rotation * (scale `across` across the direction d, `lengthwise` along it). */
static struct affine stretch(const struct affine *rotation, const float d[3], double across, double lengthwise)
{
    struct affine s = affine_identity();
    const double square = (double)vec3_dot(d, d);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            s.m[4 * i + j] = across * (i == j) + (lengthwise - across) * (double)d[i] * (double)d[j] / square;
        }
    }
    return affine_after(rotation, &s);
}

static double within(double low, double x, double high) { return fmax(low, fmin(high, x)); }

/* Pairs the joints of a limb of both and computes their maps. turn: the rotation of what the limb hangs on. */
static int pair_limb(const struct skeleton_limbs *ours, const struct skeleton_limbs *theirs, int role, struct affine turn,
                     int *map, struct affine *bones)
{
    const struct limb *a = &ours->limbs[role], *b = &theirs->limbs[role];
    float from[LIMB_JOINTS + 2], to[LIMB_JOINTS + 2], place[3], next[3];
    const int landmarks = find_landmarks(ours, theirs, role, from, to);
    const double size = (double)(theirs->size / ours->size);
    const double across = a->radius > 0.0f && b->radius > 0.0f ? within(size / 3, (double)(b->radius / a->radius), 3 * size) : size;
    place_along(b, convert_along(from, to, landmarks, 0.0f), place);
    for (int k = 0; k < a->count; ++k) {
        const int joint = a->joints[k];
        const float along = convert_along(from, to, landmarks, a->along[k]);
        float d[3], e[3], turned[3];
        place_along(b, convert_along(from, to, landmarks, a->along[k + 1]), next);
        vec3_sub(a->places[k + 1], a->places[k], d);
        vec3_sub(next, place, e);
        map[joint] = b->joints[nearest_joint(b, along)];
        if (vec3_length(d) > 1e-3f * ours->size && vec3_length(e) > 1e-3f * theirs->size) {
            affine_apply(&turn, d, turned);
            const struct affine more = affine_turn(turned, e);
            turn = affine_after(&more, &turn);
            bones[joint] = stretch(&turn, d, across, (double)(vec3_length(e) / vec3_length(d)));
        } else {
            const float any[3] = {1.0f, 0.0f, 0.0f};
            bones[joint] = stretch(&turn, any, across, across);
        }
        pin(&bones[joint], a->places[k], place);
        memcpy(place, next, sizeof place);
    }
    return a->count;
}

int skeleton_limbs_pair(const struct character *source, const struct skeleton_limbs *ours, const struct skeleton_limbs *theirs,
                        int *map, struct affine *bones)
{
    const struct affine our_frame = frame_of(ours), their_frame = frame_of(theirs), back = affine_inverse(&our_frame);
    const struct affine turn = affine_after(&their_frame, &back);
    const struct limb *trunk = &ours->limbs[LIMB_TRUNK];
    const int head = trunk->joints[trunk->count - 1];
    int pairs = 0;
    for (int j = 0; j < source->joint_count; ++j) { map[j] = -1; }
    for (int role = 0; role < LIMB_ROLES; ++role) {
        if (ours->limbs[role].count > 0 && theirs->limbs[role].count > 0) {
            pairs += pair_limb(ours, theirs, role, turn, map, bones);
        }
    }
    if (ours->head_size > 0.0f && theirs->head_size > 0.0f) { /* a head keeps looking forward */
        const float any[3] = {1.0f, 0.0f, 0.0f};
        const double scale = (double)(theirs->head_size / ours->head_size);
        bones[head] = stretch(&turn, any, scale, scale);
        pin(&bones[head], ours->head, theirs->head);
        map[head] = theirs->limbs[LIMB_TRUNK].joints[theirs->limbs[LIMB_TRUNK].count - 1];
    }
    for (int j = 0; j < source->joint_count; ++j) { /* what hangs on a limb moves with it */
        if (map[j] < 0) {
            bones[j] = bones[source->joints[j].parent >= 0 && j != trunk->joints[0] ? source->joints[j].parent : trunk->joints[0]];
        }
    }
    return pairs;
}

int skeleton_limbs_alone(const struct character *character, const struct skeleton_limbs *ours,
                         const struct skeleton_limbs *theirs, int joint)
{
    for (int branch = -1; joint >= 0; branch = joint, joint = character->joints[joint].parent) {
        for (int role = 0; role < LIMB_ROLES; ++role) {
            if (limb_index(&ours->limbs[role], joint) >= 0) {
                return theirs->limbs[role].count > 0 ? branch : ours->limbs[role].joints[0];
            }
        }
    }
    return -1;
}

int skeleton_limbs_above(const struct character *character, const struct skeleton_limbs *l, int joint)
{
    for (int role = 0; role < LIMB_ROLES; ++role) {
        const int k = limb_index(&l->limbs[role], joint);
        if (k > 0) { return l->limbs[role].joints[k - 1]; }
        if (k == 0) {
            do { joint = character->joints[joint].parent; } while (joint >= 0 && limb_index(&l->limbs[LIMB_TRUNK], joint) < 0);
            return joint;
        }
    }
    return -1;
}
