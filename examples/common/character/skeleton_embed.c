#include "character/skeleton_embed.h"

#include "base/vec3.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PATH = 8192 };

/* Parts of a limb on the way from its end to the trunk, found by measurement on bodies of several makes. */
static const float SHORTEST_BRANCH = 0.06f; /* of the longest side of the grid */
static const float LIMB_FROM = 0.4f; /* the limb leaves the trunk beyond this part of the way to the trunk's middle */
static const float LIMB_GROWTH = 1.8f; /* there its cross-section has grown by this */
static const float THINNER = 25.0f; /* weight of keeping the rest pose's place against being where the limb is thin */
static const float NARROWER = 6.0f; /* the same for the neck */
static const float ABOVE_CROTCH = 0.015f; /* of the height: how far hip joints are above it */
static const float UNDER = 0.06f;         /* of the height: the part of a shin under which an ankle is */
static const float NEXT_TO_TRUNK = 0.2f; /* of a limb's length */
static const float BENT = 0.03f;          /* of a limb's length: a leg that bends by less is straight */
static const float NEARLY_MOST = 0.9f; /* of what a leg stands out */
static const float OUTWARDS = 0.25f;      /* how much a knee within the trunk is nearer to where the leg leaves it */
static const float SNAP = 0.94f;          /* cosine: directions nearer to a coordinate axis are taken for it */
static const float CLEAR_FACING = 0.004f;

/* A curve in the body: places, lengths along it, depths. */
struct curve {
    int count;
    float (*place)[3];
    float *along, *depth; /* voxels of length; voxels below the surface */
};

struct limb {
    struct curve curve; /* from the trunk's middle to the end */
    float root;         /* where it leaves the trunk, along the curve */
    float level;        /* of a biped's leg: height of that place over the ground; else 0 */
};

struct embed {
    const struct skeleton_template *skeleton;
    const struct solid *solid;
    struct medial_tree tree;
    struct skeleton_embedding *out;
    struct limb limbs[2][2];
    struct curve trunk;
    float ground, lateral[3]; /* height of the lowest place along up; left or right */
    int *path;
    float *distance;
    int *before;
};

/* ---- curves ---- */

static void curve_free(struct curve *c)
{
    free(c->place);
    free(c->along);
    free(c->depth);
}

static void measure(struct curve *c, double spacing)
{
    for (int i = 0; i < c->count; ++i) {
        float d[3] = {0.0f, 0.0f, 0.0f};
        if (i > 0) { vec3_sub(c->place[i], c->place[i - 1], d); }
        c->along[i] = i > 0 ? c->along[i - 1] + vec3_length(d) / (float)spacing : 0.0f;
    }
}

/* Makes a smooth curve of a path of voxels. */
static bool curve_create(const struct solid *solid, const int *path, int count, struct curve *c)
{
    c->count = count;
    c->place = malloc(((size_t)count + 1) * sizeof *c->place);
    c->along = malloc(((size_t)count + 1) * sizeof *c->along);
    c->depth = malloc(((size_t)count + 1) * sizeof *c->depth);
    float(*rough)[3] = malloc(((size_t)count + 1) * sizeof *rough);
    const bool good = c->place && c->along && c->depth && rough && count > 0;
    for (int i = 0; good && i < count; ++i) { solid_place(solid, path[i], rough[i]); }
    for (int i = 0; good && i < count; ++i) {
        const int reach = i < 2 || count - 1 - i < 2 ? (i < count - 1 - i ? i : count - 1 - i) : 2;
        memset(c->place[i], 0, sizeof c->place[i]);
        c->depth[i] = 0.5f * solid->depth[path[i]]
            + 0.25f * (solid->depth[path[i > 0 ? i - 1 : 0]] + solid->depth[path[i + 1 < count ? i + 1 : i]]);
        for (int k = i - reach; k <= i + reach; ++k) {
            vec3_add_scaled(c->place[i], 1.0f / (float)(2 * reach + 1), rough[k], c->place[i]);
        }
    }
    free(rough);
    if (good) { measure(c, solid->grid.spacing); }
    return good;
}

static float curve_length(const struct curve *c) { return c->along[c->count - 1]; }

/* Computes the place at a length along the curve; returns the depth there. */
static float curve_at(const struct curve *c, float along, float place[3])
{
    int i = 0;
    while (i + 2 < c->count && c->along[i + 1] < along) { ++i; }
    const int next = i + 1 < c->count ? i + 1 : i;
    const float step = c->along[next] - c->along[i];
    const float t = step > 0.0f ? fmaxf(0.0f, fminf(1.0f, (along - c->along[i]) / step)) : 0.0f;
    for (int k = 0; k < 3; ++k) { place[k] = c->place[i][k] + t * (c->place[next][k] - c->place[i][k]); }
    return c->depth[i] + t * (c->depth[next] - c->depth[i]);
}

/* Returns the length along the curve of its place nearest to a point. */
static float curve_nearest(const struct curve *c, const float point[3])
{
    float least = INFINITY, along = 0.0f;
    for (int i = 0; i < c->count; ++i) {
        float d[3];
        vec3_sub(c->place[i], point, d);
        if (vec3_length(d) < least) {
            least = vec3_length(d);
            along = c->along[i];
        }
    }
    return along;
}

static float over_ground(const struct embed *e, const float place[3])
{
    return vec3_dot(place, e->out->up) - e->ground;
}

/* ---- directions ---- */

/* Replaces a direction by the coordinate axis that it nearly has. */
static void snap(float direction[3])
{
    for (int i = 0; i < 3; ++i) {
        if (fabsf(direction[i]) > SNAP) {
            const float sign = direction[i] < 0.0f ? -1.0f : 1.0f;
            memset(direction, 0, 3 * sizeof *direction);
            direction[i] = sign;
        }
    }
}

static void remove_component(float v[3], const float unit[3])
{
    vec3_add_scaled(v, -vec3_dot(v, unit), unit, v);
    vec3_normalize(v);
}

static void tip_place(const struct embed *e, int tip, float place[3])
{
    solid_place(e->solid, e->tree.tip[tip], place);
}

static void middle_of(const struct embed *e, int limb, float middle[3])
{
    float a[3], b[3];
    tip_place(e, e->out->roles.limb[limb][0], a);
    tip_place(e, e->out->roles.limb[limb][1], b);
    for (int i = 0; i < 3; ++i) { middle[i] = 0.5f * (a[i] + b[i]); }
}

/* Finds up: across the plane of four feet; from two feet to the center of mass, and along the trunk from where the legs branch off
 * to where the arms do. */
static void find_up(struct embed *e, const float *known)
{
    const struct skeleton_template *s = e->skeleton;
    const struct skeleton_roles *r = &e->out->roles;
    float *up = e->out->up, center[3] = {0.0f, 0.0f, 0.0f}, feet[2][3], rise[3];
    for (int l = 0; l < 2; ++l) {
        float a[3], b[3];
        tip_place(e, r->limb[l][0], a);
        tip_place(e, r->limb[l][1], b);
        vec3_sub(a, b, a);
        vec3_add_scaled(e->lateral, 1.0f, a, e->lateral);
        middle_of(e, l, feet[l]);
    }
    vec3_normalize(e->lateral);
    for (int n = 0; n < e->solid->count; ++n) {
        float place[3];
        solid_place(e->solid, n, place);
        vec3_add_scaled(center, 1.0f / (float)e->solid->count, place, center);
    }
    const int standing = s->ground[0] ? 0 : 1;
    vec3_sub(center, feet[standing], rise);
    if (known) {
        memcpy(up, known, 3 * sizeof *up);
    } else if (s->ground[0] && s->ground[1]) {
        float along[3];
        vec3_sub(feet[1], feet[0], along);
        vec3_cross(e->lateral, along, up);
        if (vec3_dot(up, rise) < 0.0f) { vec3_add_scaled(up, -2.0f, up, up); }
    } else {
        float head[3];
        tip_place(e, r->trunk[0], head);
        vec3_sub(head, feet[standing], up);
        remove_component(up, e->lateral);
        remove_component(rise, e->lateral);
        vec3_add_scaled(up, 1.0f, rise, up);
    }
    vec3_normalize(up);
    snap(up);
    remove_component(e->lateral, up);
    snap(e->lateral);
    remove_component(e->lateral, up);
    float lowest = INFINITY, highest = -INFINITY;
    for (int n = 0; n < e->solid->count; ++n) {
        float place[3];
        solid_place(e->solid, n, place);
        lowest = fminf(lowest, vec3_dot(place, up));
        highest = fmaxf(highest, vec3_dot(place, up));
    }
    e->ground = lowest - 0.5f * (float)e->solid->grid.spacing;
    e->out->height = highest - lowest + (float)e->solid->grid.spacing;
}

/* ---- limbs ---- */

/* Returns the median of a few numbers, which it sorts. */
static float median(float *values, int count)
{
    for (int i = 1; i < count; ++i) {
        for (int k = i; k > 0 && values[k] < values[k - 1]; --k) {
            const float swap = values[k];
            values[k] = values[k - 1];
            values[k - 1] = swap;
        }
    }
    return values[count / 2];
}

/* Returns how far from the limb's end the limb leaves the trunk: there the number of voxels at a distance from the end, which is
 * the limb's cross-section, begins to grow. reach: distance of the trunk's middle. */
static float find_root(const struct embed *e, float reach)
{
    enum { WINDOW = 64 };
    const int shells = (int)reach + 2;
    float *section = calloc((size_t)shells, sizeof *section), result = 0.7f * reach;
    for (int n = 0; section && n < e->solid->count; ++n) {
        if (e->distance[n] < (float)shells - 1.0f) { /* half to the next shell, which smooths */
            section[(int)e->distance[n]] += 1.0f;
        }
    }
    const int window = (int)fmaxf(3.0f, fminf((float)WINDOW, 0.15f * reach));
    for (int r = (int)(LIMB_FROM * reach); section && r + 1 < shells && r < (int)reach; ++r) {
        float before[WINDOW];
        int count = 0;
        for (int k = r - window; k < r; ++k) {
            if (k >= 0) { before[count++] = section[k]; }
        }
        if (count > 0 && 0.5f * (section[r] + section[r + 1]) > LIMB_GROWTH * median(before, count) + 2.0f) {
            result = (float)r;
            break;
        }
    }
    free(section);
    return result;
}

/* Returns the height of the highest place on the shortest way from one foot's end to the other's, which goes through the crotch. */
static float crotch(const struct embed *e, int other)
{
    float highest = 0.0f, place[3];
    for (int at = other; at >= 0; at = e->before[at]) {
        solid_place(e->solid, at, place);
        highest = fmaxf(highest, over_ground(e, place));
    }
    return highest;
}

static bool trace_limb(struct embed *e, int limb, int side)
{
    const struct skeleton_roles *r = &e->out->roles;
    struct limb *to = &e->limbs[limb][side];
    const int tip = e->tree.tip[r->limb[limb][side]], other = e->tree.tip[r->limb[limb][!side]],
              head = e->tree.tip[r->trunk[0]];
    int middle = medial_tree_meet(&e->tree, tip, other);
    const int meets[2] = {medial_tree_meet(&e->tree, tip, head), medial_tree_meet(&e->tree, other, head)};
    for (int k = 0; k < 2;
         ++k) { /* of three ways through a tree, the place where all meet is the farthest of the three meetings */
        middle = e->tree.along[meets[k]] > e->tree.along[middle] ? meets[k] : middle;
    }
    const int count = medial_tree_path(&e->tree, middle, tip, e->path, MAX_PATH);
    if (!curve_create(e->solid, e->path, count, &to->curve)
        || !solid_distances(e->solid, &tip, 1, false, e->distance, e->before)) {
        return false;
    }
    int at = 0;
    if (e->skeleton->ground[limb] && e->skeleton->joints[e->skeleton->limb_root[limb][0]].place == PLACE_LIMB) {
        to->level = crotch(e, other) + ABOVE_CROTCH * e->out->height;
        while (at + 1 < count && over_ground(e, to->curve.place[at]) > to->level) { ++at; }
        to->root = to->curve.along[at];
        return true;
    }
    const float root = find_root(e, e->distance[middle]);
    while (at + 1 < count && e->distance[e->path[at]] > root) { ++at; }
    to->root = to->curve.along[at];
    return true;
}

/* Places the limb's first joint where it leaves the trunk, on the straight line through its upper part. */
static void place_at_trunk(const struct embed *e, const struct limb *limb, float place[3])
{
    const float length = curve_length(&limb->curve) - limb->root, from = limb->root;
    const bool leg = limb->level > 0.0f;
    float near[3], far[3], direction[3], d[3];
    curve_at(&limb->curve, from + (leg ? 0.3f : 0.08f) * length, near);
    curve_at(&limb->curve, from + (leg ? 0.5f : 0.35f) * length, far);
    vec3_sub(near, far, direction);
    vec3_normalize(direction);
    if (leg) { /* thighs are steeper than curves, which bend to the middle of the trunk */
        vec3_add_scaled(direction, 1.0f, e->out->up, direction);
        vec3_normalize(direction);
    }
    curve_at(&limb->curve, from, place);
    vec3_sub(place, near, d);
    const float rise = vec3_dot(direction, e->out->up);
    const float step =
        leg ? (limb->level - over_ground(e, near)) / fmaxf(rise, 0.5f) : fmaxf(0.0f, vec3_dot(d, direction));
    vec3_add_scaled(near, step, direction, place);
}

/* Places the limb's first joint over the limb's part next to the trunk, as high as the trunk's middle: below, legs of many animals
 * go back and forth. */
static void place_at_axis(const struct embed *e, const struct limb *limb, float place[3])
{
    float middle[3] = {0.0f, 0.0f, 0.0f}, axis[3];
    const float to = limb->root + NEXT_TO_TRUNK * (curve_length(&limb->curve) - limb->root);
    int count = 0;
    for (int i = 0; i < limb->curve.count; ++i) {
        if (limb->curve.along[i] >= limb->root && (count == 0 || limb->curve.along[i] <= to)) {
            vec3_add_scaled(middle, 1.0f, limb->curve.place[i], middle);
            ++count;
        }
    }
    for (int k = 0; k < 3; ++k) { place[k] = middle[k] / (float)count; }
    float level[3]; /* first as high as where the limb meets the trunk: lower down a tail may be nearer */
    vec3_add_scaled(place, over_ground(e, limb->curve.place[0]) - over_ground(e, place), e->out->up, level);
    for (int round = 0; round < 3; ++round) { /* the trunk's place above */
        curve_at(&e->trunk, curve_nearest(&e->trunk, level), axis);
        vec3_add_scaled(place, over_ground(e, axis) - over_ground(e, place), e->out->up, level);
    }
    memcpy(place, level, sizeof level);
}

/* ---- between ---- */

struct anchor {
    float rest, body; /* lengths along the rest pose and along the curve of the body */
};

/* Interpolates between anchors, which rise. */
static float between(const struct anchor *anchors, int count, float rest)
{
    int i = 0;
    while (i + 2 < count && anchors[i + 1].rest < rest) { ++i; }
    const struct anchor *a = &anchors[i], *b = &anchors[i + 1 < count ? i + 1 : i];
    const float step = b->rest - a->rest;
    const float t = step > 0.0f ? fmaxf(0.0f, fminf(1.0f, (rest - a->rest) / step)) : 0.0f;
    return a->body + t * (b->body - a->body);
}

/* Moves a place along the curve to where the limb is thin, against a weight for staying. Returns the place. */
static float thinnest(const struct curve *c, float along, float from, float to, float weight)
{
    float mean = 0.0f, best = INFINITY, result = along;
    int count = 0;
    for (int i = 0; i < c->count; ++i) {
        if (c->along[i] >= from && c->along[i] <= to) {
            mean += c->depth[i];
            ++count;
        }
    }
    mean /= (float)(count > 0 ? count : 1);
    for (int i = 0; i < c->count; ++i) {
        const float t = (c->along[i] - along) / fmaxf(1.0f, to - from);
        const float cost = c->depth[i] / fmaxf(mean, 0.1f) + weight * t * t;
        if (c->along[i] >= from && c->along[i] <= to && cost < best) {
            best = cost;
            result = c->along[i];
        }
    }
    return result;
}

/* Lists a limb's joints from its root to its end; returns how many. */
static int limb_joints(const struct skeleton_template *s, int end, int root, int *joints)
{
    int count = 0;
    for (int j = end; j != root; j = s->joints[j].parent) { ++count; }
    joints[0] = root;
    for (int j = end, k = count; k > 0; --k, j = s->joints[j].parent) { joints[k] = j; }
    return count + 1;
}

static void rest_lengths(const struct skeleton_template *s, const int *joints, int count, float *rest)
{
    rest[0] = 0.0f;
    for (int k = 1; k < count; ++k) {
        float d[3];
        vec3_sub(s->joints[joints[k]].position, s->joints[joints[k - 1]].position, d);
        rest[k] = rest[k - 1] + vec3_length(d);
    }
}

/* Moves a place of a limb under the limb's part above it, so that an ankle is below the shin and not in the foot. */
static void set_under(const struct embed *e, const struct limb *limb, float along, float place[3])
{
    const float height = over_ground(e, place);
    float above[3] = {0.0f, 0.0f, 0.0f};
    int count = 0;
    for (int i = 0; i < limb->curve.count; ++i) {
        const float rise = over_ground(e, limb->curve.place[i]) - height;
        if (limb->curve.along[i] >= limb->root && limb->curve.along[i] <= along && rise < UNDER * e->out->height) {
            vec3_add_scaled(above, 1.0f, limb->curve.place[i], above);
            ++count;
        }
    }
    for (int i = 0; count > 0 && i < 3; ++i) { place[i] = above[i] / (float)count; }
    vec3_add_scaled(place, height - over_ground(e, place), e->out->up, place);
}

/* Returns how high a joint is wanted over the ground. lowest: of the rest pose. */
static float wanted_height(const struct embed *e, int joint, int first, float lowest)
{
    const struct template_joint *j = e->skeleton->joints;
    const float rest = j[joint].position[1] - lowest;
    return j[first].place == PLACE_AXIS ? rest / (j[first].position[1] - lowest) * over_ground(e, e->out->place[first])
                                        : rest / e->skeleton->height * e->out->height;
}

/* Returns how far, in voxels, a limb's curve stands out backwards there from the straight line to where it goes on to its end. */
static float stands_out(const struct embed *e, const struct curve *c, int at, const float from[3], const float to[3])
{
    float line[3], d[3];
    vec3_sub(to, from, line);
    vec3_sub(c->place[at], from, d);
    vec3_add_scaled(d, -vec3_dot(d, e->out->up) / vec3_dot(line, e->out->up), line, d);
    return -vec3_dot(d, e->out->forward) / (float)e->solid->grid.spacing;
}

/* Returns the length along a leg where it stands out backwards from the straight line from its first joint to its toes, as at a hock
 * or a heel: the highest place of those that do so nearly most. Less than 0: it is straight. toes: their height. */
static float bend_of(const struct embed *e, const struct limb *limb, int first, float toes)
{
    const struct curve *c = &limb->curve;
    const float *from = e->out->place[first];
    int last = c->count - 1;
    while (last > 0 && over_ground(e, c->place[last - 1]) < toes) { --last; }
    float most = BENT * (curve_length(c) - limb->root), along = -1.0f;
    for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < last && (pass == 0 || along < 0.0f); ++i) {
            const float out = c->along[i] > limb->root ? stands_out(e, c, i, from, c->place[last]) : 0.0f;
            if (pass == 0) {
                most = fmaxf(most, out);
            } else if (out > BENT * (curve_length(c) - limb->root) && out > NEARLY_MOST * most) {
                along = c->along[i];
            }
        }
    }
    return along;
}

/* Computes the place at a length along a limb; before it leaves the trunk, on the straight line from its first joint. */
static void limb_at(const struct embed *e, const struct limb *limb, int first, float from, float along, float place[3])
{
    curve_at(&limb->curve, fmaxf(along, limb->root), place);
    if (e->skeleton->joints[first].place == PLACE_AXIS && along < limb->root && from < limb->root) {
        float d[3];
        vec3_sub(place, e->out->place[first], d);
        vec3_add_scaled(e->out->place[first], (along - from) / (limb->root - from), d, place);
    }
}

static void place_limb_joints(struct embed *e, int limb, int side, int first, int end)
{
    const struct skeleton_template *s = e->skeleton;
    const struct limb *l = &e->limbs[limb][side];
    const float length = curve_length(&l->curve), root = l->root;
    int joints[TEMPLATE_JOINTS], count = limb_joints(s, end, first, joints), anchor_count = 1, last_free = 0;
    float rest[TEMPLATE_JOINTS], lowest = INFINITY;
    struct anchor anchors[TEMPLATE_JOINTS];
    for (int j = 0; j < s->count; ++j) { lowest = fminf(lowest, s->joints[j].position[1]); }
    rest_lengths(s, joints, count, rest);
    anchors[0].rest = 0.0f;
    anchors[0].body = root;
    if (s->joints[first].place
        == PLACE_AXIS) { /* the curve bends into the trunk; the limb's length goes up to the joint */
        float d[3], at[3];
        curve_at(&l->curve, root, at);
        vec3_sub(e->out->place[first], at, d);
        anchors[0].body = root - vec3_length(d) / (float)e->solid->grid.spacing;
    }
    for (int k = 1; k < count; ++k) {
        const float bend = s->joints[joints[k]].place == PLACE_BEND && k + 1 < count
            ? bend_of(e, l, first, wanted_height(e, joints[k + 1], first, lowest))
            : -1.0f;
        if (bend > fmaxf(anchors[anchor_count - 1].body, 0.0f)) {
            anchors[anchor_count].rest = rest[k];
            anchors[anchor_count++].body = bend;
        } else if (s->joints[joints[k]].place == PLACE_HEIGHT || s->joints[joints[k]].place == PLACE_BEND) {
            const float wanted = wanted_height(e, joints[k], first, lowest);
            for (int i = 0; i < l->curve.count; ++i) {
                if (l->curve.along[i] > anchors[anchor_count - 1].body && l->curve.along[i] >= root
                    && over_ground(e, l->curve.place[i]) <= wanted) {
                    anchors[anchor_count].rest = rest[k];
                    anchors[anchor_count++].body = l->curve.along[i];
                    break;
                }
            }
        }
    }
    last_free = anchor_count > 1 ? 1 : 0; /* joints before the first anchor on the way may move to thin places */
    anchors[anchor_count].rest = rest[count - 1];
    anchors[anchor_count++].body = length;
    for (int k = 1; k < count; ++k) {
        float along = between(anchors, anchor_count, rest[k]);
        const bool free = s->joints[joints[k]].place == PLACE_BETWEEN
            && k + 2 < count /* wrists are where hands begin, not thin */
            && (!last_free || rest[k] < anchors[1].rest);
        if (free) {
            const float before = between(anchors, anchor_count, 0.6f * rest[k] + 0.4f * rest[k - 1]),
                        after = between(anchors, anchor_count, 0.6f * rest[k] + 0.4f * rest[k + 1]);
            const float whole = (last_free ? anchors[1].body : length) - anchors[0].body,
                        part = (after - before) / whole;
            along = along >= root ? thinnest(&l->curve, along, fmaxf(before, root), fmaxf(after, root), THINNER * part * part)
                                  : along + OUTWARDS * (root - along);
        }
        limb_at(e, l, first, anchors[0].body, along, e->out->place[joints[k]]);
        if (s->joints[joints[k]].place == PLACE_HEIGHT && s->joints[first].place == PLACE_LIMB) {
            set_under(e, l, along, e->out->place[joints[k]]);
        }
        e->out->present[joints[k]] = true;
    }
}

/* ---- trunk ---- */

/* Lists the trunk's joints from the tail's end, or from the first joint, to the head's end. */
static int trunk_joints(const struct embed *e, int *joints)
{
    const struct skeleton_template *s = e->skeleton;
    int count = 0, up[TEMPLATE_JOINTS];
    for (int j = e->out->roles.trunk[1] >= 0 ? s->trunk_end[1] : -1; j > 0; j = s->joints[j].parent) {
        joints[count++] = j;
    }
    const int head_count = limb_joints(s, s->trunk_end[0], 0, up);
    memcpy(joints + count, up, (size_t)head_count * sizeof *joints);
    return count + head_count;
}

/* Traces the middle of the trunk from the tail's end, or from between the hips, to the head's end. */
static bool trace_trunk(struct embed *e)
{
    const struct skeleton_roles *r = &e->out->roles;
    int start, count = 0;
    if (r->trunk[1] >= 0) {
        start = e->tree.tip[r->trunk[1]];
    } else {
        float place[2][3], middle[3];
        const int legs = e->skeleton->joints[e->skeleton->limb_root[0][0]].parent == 0 ? 0 : 1;
        const bool level = e->skeleton->joints[e->skeleton->limb_root[legs][0]].place == PLACE_AXIS;
        for (int side = 0; side < 2; ++side) { /* hips as high as the trunk are where the legs' curves meet */
            curve_at(&e->limbs[legs][side].curve, level ? 0.0f : e->limbs[legs][side].root, place[side]);
        }
        for (int i = 0; i < 3; ++i) { middle[i] = 0.5f * (place[0][i] + place[1][i]); }
        start = solid_nearest(e->solid, middle);
    }
    if (!solid_distances(e->solid, &start, 1, true, e->distance, e->before)) { return false; }
    for (int at = e->tree.tip[r->trunk[0]]; at >= 0 && count < MAX_PATH; at = e->before[at]) {
        e->path[count++] = at;
    }
    for (int i = 0; i < count / 2; ++i) {
        const int swap = e->path[i];
        e->path[i] = e->path[count - 1 - i];
        e->path[count - 1 - i] = swap;
    }
    return curve_create(e->solid, e->path, count, &e->trunk);
}

/* Moves a place of the trunk to the middle of the body around it, across the direction of the trunk: hollow bodies have no
 * medial axis where a spine is. */
static void center_in_section(const struct embed *e, float along, float radius, float place[3])
{
    float before[3], after[3], direction[3];
    curve_at(&e->trunk, along - 6.0f, before);
    curve_at(&e->trunk, along + 6.0f, after);
    vec3_sub(after, before, direction);
    vec3_normalize(direction);
    const float spacing = (float)e->solid->grid.spacing;
    for (int round = 0; round < 4; ++round) {
        float sum[3] = {0.0f, 0.0f, 0.0f};
        int count = 0;
        for (int n = 0; n < e->solid->count; ++n) {
            float p[3], d[3];
            solid_place(e->solid, n, p);
            vec3_sub(p, place, d);
            if (fabsf(vec3_dot(d, direction)) < spacing && vec3_length(d) < radius * spacing) {
                vec3_add_scaled(sum, 1.0f, d, sum);
                ++count;
            }
        }
        if (count > 0) {
            vec3_add_scaled(sum, -vec3_dot(sum, direction), direction, sum);
            vec3_add_scaled(place, 1.0f / (float)count, sum, place);
        }
    }
}

static int compare_anchors(const void *a, const void *b)
{
    const struct anchor *p = a, *q = b;
    return (p->rest > q->rest) - (p->rest < q->rest);
}

/* Adds anchors where pairs of limbs branch off: their middle on the trunk of the rest pose and of the body. */
static int anchor_limbs(const struct embed *e, const int *joints, const float *rest, int count,
                        struct anchor *anchors)
{
    const struct skeleton_template *s = e->skeleton;
    int added = 0;
    for (int l = 0; l < 2; ++l) {
        const int a = s->limb_root[l][0], b = s->limb_root[l][1];
        float middle[3], body[3], least = INFINITY, at = 0.0f;
        for (int i = 0; i < 3; ++i) {
            middle[i] = 0.5f * (s->joints[a].position[i] + s->joints[b].position[i]);
            body[i] = 0.5f * (e->out->place[a][i] + e->out->place[b][i]);
        }
        for (int k = 0; k + 1 < count; ++k) {
            const float *p = s->joints[joints[k]].position;
            float d[3], to[3], off[3];
            vec3_sub(s->joints[joints[k + 1]].position, p, d);
            vec3_sub(middle, p, to);
            const float square = vec3_dot(d, d);
            const float low = k == 0 ? -1.0f : 0.0f; /* hips may be above the thighs */
            const float t = square > 0.0f ? fmaxf(low, fminf(1.0f, vec3_dot(to, d) / square)) : 0.0f;
            vec3_add_scaled(to, -t, d, off);
            if (vec3_length(off) < least) {
                least = vec3_length(off);
                at = rest[k] + t * (rest[k + 1] - rest[k]);
            }
        }
        anchors[added].rest = at;
        anchors[added++].body = curve_nearest(&e->trunk, body);
    }
    return added;
}

static void place_trunk_joints(struct embed *e)
{
    const struct skeleton_template *s = e->skeleton;
    int joints[TEMPLATE_JOINTS], count = trunk_joints(e, joints);
    float rest[TEMPLATE_JOINTS], deepest = 0.0f;
    struct anchor anchors[TEMPLATE_JOINTS + 4];
    rest_lengths(s, joints, count, rest);
    int anchor_count = anchor_limbs(e, joints, rest, count, anchors);
    const float length = curve_length(&e->trunk), last = fmaxf(anchors[0].rest, anchors[1].rest),
                last_body = anchors[0].rest > anchors[1].rest ? anchors[0].body : anchors[1].body;
    for (int k = 0; k < count; ++k) {
        if (s->joints[joints[k]].place == PLACE_NARROW && rest[k] > last) {
            const float t = (rest[k] - last) / (rest[count - 1] - last), whole = length - last_body;
            anchors[anchor_count].rest = rest[k];
            anchors[anchor_count++].body =
                thinnest(&e->trunk, last_body + 0.7f * t * whole, last_body + 0.05f * whole, last_body + 0.6f * whole,
                         NARROWER * 0.3f);
        }
    }
    const float limbs = fabsf(anchors[1].body - anchors[0].body) / fmaxf(fabsf(anchors[1].rest - anchors[0].rest), 1e-6f);
    for (int k = 0; k + 1 < count; ++k) { /* a head goes with the trunk and not with the neck, which may be as long as a giraffe's */
        if (s->joints[joints[k]].place == PLACE_SHARE && rest[k] > last) {
            const float middle = 0.5f * (last_body + length);
            anchors[anchor_count].rest = rest[k];
            anchors[anchor_count++].body = s->joints[joints[k + 1]].end ? fmaxf(length - limbs * (rest[count - 1] - rest[k]), middle)
                                                                        : fminf(last_body + limbs * (rest[k] - last), middle);
        }
    }
    if (e->out->roles.trunk[1] >= 0) {
        anchors[anchor_count].rest = 0.0f;
        anchors[anchor_count++].body = 0.0f;
    }
    anchors[anchor_count].rest = rest[count - 1];
    anchors[anchor_count++].body = length;
    qsort(anchors, (size_t)anchor_count, sizeof *anchors, compare_anchors);
    const float from = e->out->roles.trunk[1] >= 0 ? fminf(anchors[1].body, anchors[2].body) : 0.0f;
    for (int i = 0; i < e->trunk.count; ++i) {
        if (e->trunk.along[i] >= from && e->trunk.along[i] <= last_body) {
            deepest = fmaxf(deepest, e->trunk.depth[i]);
        }
    }
    for (int k = 0; k < count; ++k) {
        const float along = between(anchors, anchor_count, rest[k]);
        const float depth = curve_at(&e->trunk, along, e->out->place[joints[k]]);
        e->out->present[joints[k]] = true;
        if (!s->joints[joints[k]].end && along >= from && depth > 0.0f) {
            center_in_section(e, along, 1.2f * deepest, e->out->place[joints[k]]);
        }
    }
    const int legs = s->joints[s->limb_root[0][0]].parent == 0 ? 0 : 1;
    if (e->out->roles.trunk[1] < 0 && s->joints[s->limb_root[legs][0]].place == PLACE_AXIS) {
        float d[3]; /* without a tail the curve begins before the hips: they are between the hind legs */
        for (int i = 0; i < 3; ++i) {
            d[i] = 0.5f * (e->out->place[s->limb_root[legs][0]][i] + e->out->place[s->limb_root[legs][1]][i])
                - e->out->place[0][i];
        }
        vec3_add_scaled(e->out->place[0], vec3_dot(d, e->out->forward), e->out->forward, e->out->place[0]);
    }
}

/* ---- left and right ---- */

/* Returns how far feet stand out along a direction: the middle of each foot before the leg above it. */
static float feet_before_legs(const struct embed *e, const float direction[3])
{
    const float height = e->out->height;
    float sum = 0.0f;
    for (int l = 0; l < 2; ++l) {
        for (int side = 0; side < 2 && e->skeleton->ground[l]; ++side) {
            const struct curve *c = &e->limbs[l][side].curve;
            float leg = 0.0f, foot = 0.0f, tip[3];
            int leg_count = 0, foot_count = 0;
            for (int i = 0; i < c->count; ++i) {
                const float at = over_ground(e, c->place[i]);
                if (at > 0.06f * height && at < 0.16f * height && c->along[i] >= e->limbs[l][side].root) {
                    leg += vec3_dot(c->place[i], direction);
                    ++leg_count;
                }
            }
            curve_at(c, curve_length(c), tip);
            for (int n = 0; n < e->solid->count; ++n) {
                float p[3], d[3];
                solid_place(e->solid, n, p);
                vec3_sub(p, tip, d);
                if (over_ground(e, p) < 0.045f * height && vec3_length(d) < 0.16f * height) {
                    foot += vec3_dot(p, direction);
                    ++foot_count;
                }
            }
            if (leg_count > 0 && foot_count > 0) { sum += foot / (float)foot_count - leg / (float)leg_count; }
        }
    }
    return sum / (2.0f * height);
}

/* Finds forward and left, and which side of each pair is left. */
static bool find_facing(struct embed *e, const float *known, char error[CHARACTER_TEXT])
{
    struct skeleton_embedding *out = e->out;
    const struct skeleton_template *s = e->skeleton;
    float forward[3];
    vec3_cross(e->lateral, out->up, forward);
    if (s->ground[0] && s->ground[1]) { /* from where the tail's end or hips are to the head */
        float d[3], head[3], tail[3];
        tip_place(e, out->roles.trunk[0], head);
        curve_at(&e->trunk, 0.0f, tail);
        vec3_sub(head, tail, d);
        out->facing = vec3_dot(d, forward) / out->height;
    } else {
        out->facing = feet_before_legs(e, forward);
    }
    const float side = known ? vec3_dot(known, forward) : out->facing;
    if (known ? fabsf(side) < 0.5f : fabsf(side) < CLEAR_FACING) {
        snprintf(error, CHARACTER_TEXT, "%s",
                 known ? "--facing is not across the body: it is upwards or to a side"
                       : "which way the body faces is unclear: its feet do not stand out; give --facing X,Y,Z");
        return false;
    }
    const float sign = side < 0.0f ? -1.0f : 1.0f;
    for (int i = 0; i < 3; ++i) { out->forward[i] = sign * forward[i]; }
    out->facing = fabsf(out->facing) * (known && side * out->facing < 0.0f ? -1.0f : 1.0f);
    vec3_cross(out->up, out->forward, out->left);
    return true;
}

static void swap_sides(struct embed *e)
{
    for (int l = 0; l < 2; ++l) {
        float a[3], b[3];
        tip_place(e, e->out->roles.limb[l][0], a);
        tip_place(e, e->out->roles.limb[l][1], b);
        vec3_sub(a, b, a);
        if (vec3_dot(a, e->out->left) < 0.0f) {
            const struct limb limb = e->limbs[l][0];
            const int tip = e->out->roles.limb[l][0];
            e->limbs[l][0] = e->limbs[l][1];
            e->limbs[l][1] = limb;
            e->out->roles.limb[l][0] = e->out->roles.limb[l][1];
            e->out->roles.limb[l][1] = tip;
        }
    }
}

/* Averages each joint with its partner's mirror image where the body is nearly symmetric. */
static void make_symmetric(struct embed *e)
{
    struct skeleton_embedding *out = e->out;
    const struct skeleton_template *s = e->skeleton;
    float plane = 0.0f, mirrored[TEMPLATE_JOINTS][3];
    int pairs = 0;
    for (int j = 0; j < s->count; ++j) {
        if (s->joints[j].mirror >= 0) {
            plane += vec3_dot(out->place[j], out->left);
            ++pairs;
        }
    }
    plane /= (float)pairs;
    out->asymmetry = 0.0f;
    for (int j = 0; j < s->count; ++j) {
        const int m = s->joints[j].mirror >= 0 ? s->joints[j].mirror : j;
        float d[3];
        vec3_add_scaled(out->place[m], 2.0f * (plane - vec3_dot(out->place[m], out->left)), out->left, mirrored[j]);
        vec3_sub(mirrored[j], out->place[j], d);
        out->asymmetry += m != j && !s->joints[j].end ? vec3_length(d) / (out->height * (float)pairs) : 0.0f;
    }
    for (int j = 0; out->asymmetry < 0.08f && j < s->count; ++j) {
        vec3_add_scaled(out->place[j], 1.0f, mirrored[j], out->place[j]);
        for (int i = 0; i < 3; ++i) { out->place[j][i] *= 0.5f; }
    }
}

static bool place_joints(struct embed *e, const float *facing, char error[CHARACTER_TEXT])
{
    const struct skeleton_template *s = e->skeleton;
    for (int l = 0; l < 2; ++l) {
        for (int side = 0; side < 2; ++side) {
            if (!trace_limb(e, l, side)) {
                snprintf(error, CHARACTER_TEXT, "not enough memory");
                return false;
            }
        }
    }
    if (!trace_trunk(e)) {
        snprintf(error, CHARACTER_TEXT, "not enough memory");
        return false;
    }
    if (!find_facing(e, facing, error)) { return false; }
    swap_sides(e);
    for (int l = 0; l < 2; ++l) {
        for (int side = 0; side < 2; ++side) {
            const int root = s->limb_root[l][side];
            if (s->joints[root].place == PLACE_AXIS) {
                place_at_axis(e, &e->limbs[l][side], e->out->place[root]);
            } else {
                place_at_trunk(e, &e->limbs[l][side], e->out->place[root]);
            }
            e->out->present[root] = true;
            place_limb_joints(e, l, side, root, s->limb_end[l][side]);
        }
    }
    place_trunk_joints(e);
    make_symmetric(e);
    return true;
}

bool skeleton_embed(const struct skeleton_template *skeleton, const struct solid *solid, const float *up,
                    const float *facing, struct skeleton_embedding *out, char error[CHARACTER_TEXT])
{
    const int *size = solid->grid.size;
    const int longest = size[0] > size[1] ? (size[0] > size[2] ? size[0] : size[2])
        : size[1] > size[2]               ? size[1]
                                          : size[2];
    struct embed e = {.skeleton = skeleton, .solid = solid, .out = out};
    memset(out, 0, sizeof *out);
    e.path = malloc(MAX_PATH * sizeof *e.path);
    e.distance = malloc(((size_t)solid->count + 1) * sizeof *e.distance);
    e.before = malloc(((size_t)solid->count + 1) * sizeof *e.before);
    bool good =
        e.path && e.distance && e.before && medial_tree_create(solid, SHORTEST_BRANCH * (float)longest, &e.tree);
    if (!good) { snprintf(error, CHARACTER_TEXT, "not enough memory"); }
    good = good && skeleton_find_roles(skeleton, solid, &e.tree, up, &out->roles, error);
    if (good) {
        find_up(&e, up);
        good = place_joints(&e, facing, error);
    }
    for (int l = 0; l < 2; ++l) {
        curve_free(&e.limbs[l][0].curve);
        curve_free(&e.limbs[l][1].curve);
    }
    curve_free(&e.trunk);
    medial_tree_free(&e.tree);
    free(e.path);
    free(e.distance);
    free(e.before);
    return good;
}
