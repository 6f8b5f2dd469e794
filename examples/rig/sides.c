/* sides.c - bone weights keep to their side of the body's plane of symmetry.
 *
 * Heat conducts wherever the surface does: from one thigh to the other where legs touch, from a hand to the one that it meets. Near
 * the plane weights of both sides blend; farther away the smaller side's fade. It is not asked on which side a vertex lies: a leg may
 * stand across the plane. */
#include "rig/rig.h"

#include "base/vec3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const float NEAR_PLANE = 0.05f; /* of the height: weights of both sides beyond this are a fault... */
static const float BOTH = 0.2f;        /* ...if each is more than this */

/* The plane of symmetry, and the side of each joint of the body: 0 left, 1 right, 2 neither. */
struct sides {
    float middle[3];
    int *of;
};

static int side_of(const struct skeleton_template *s, int joint)
{
    for (int pair = 0; pair < s->limbs; ++pair) {
        for (int side = 0; side < 2; ++side) {
            const int root = s->limb_root[pair][side];
            if (joint == root || skeleton_template_below(s, joint, root)) { return side; }
        }
    }
    return 2;
}

static bool find_sides(const struct rig *rig, struct sides *sides)
{
    const struct skeleton_template *s = &rig->skeleton;
    const struct skeleton_embedding *e = &rig->body.embedding;
    int count = 0;
    memset(sides->middle, 0, sizeof sides->middle);
    sides->of = malloc(((size_t)rig->body.character.joint_count + 1) * sizeof *sides->of);
    for (int j = 0; sides->of && j < rig->body.character.joint_count; ++j) { sides->of[j] = 2; }
    for (int t = 0; sides->of && t < s->count; ++t) {
        if (!e->present[t]) { continue; }
        if (rig->joint_of[t] >= 0) { sides->of[rig->joint_of[t]] = side_of(s, t); }
        vec3_add_scaled(sides->middle, 1.0f, e->place[t], sides->middle);
        ++count;
    }
    for (int i = 0; i < 3; ++i) { sides->middle[i] /= (float)(count > 0 ? count : 1); }
    return sides->of != NULL;
}

/* Returns how far a place is from the plane, over the height; the weights of each side in *sum. */
static float look_at(const struct rig *rig, const struct sides *sides, const float place[3], const struct influences *in, float sum[3])
{
    float d[3];
    memset(sum, 0, 3 * sizeof *sum);
    for (int k = 0; k < CHARACTER_BONES; ++k) { sum[sides->of[in->joint[k]]] += in->weight[k]; }
    vec3_sub(place, sides->middle, d);
    return fabsf(vec3_dot(d, rig->body.embedding.left)) / rig->body.embedding.height;
}

/* Counts the vertices that have weights of both sides away from the plane. */
static int count_faults(const struct rig *rig, const struct sides *sides, const float *positions, const struct influences *influences,
                        int vertex_count)
{
    int count = 0;
    for (int v = 0; v < vertex_count; ++v) {
        float sum[3];
        const float far = look_at(rig, sides, positions + 3 * v, &influences[v], sum);
        count += far > NEAR_PLANE && sum[0] > BOTH && sum[1] > BOTH;
    }
    return count;
}

/* Lets the smaller side's weights fade: whole on the plane, gone beyond NEAR_PLANE. */
static void fade_sides(struct rig *rig, const struct sides *sides)
{
    for (int v = 0; v < rig->surface.vertex_count; ++v) {
        struct influences *in = &rig->influences[v];
        float sum[3];
        const float fade = fmaxf(0.0f, 1.0f - look_at(rig, sides, rig->surface.positions + 3 * v, in, sum) / NEAR_PLANE);
        const int smaller = sum[0] < sum[1] ? 0 : 1;
        for (int k = 0; k < CHARACTER_BONES; ++k) { in->weight[k] *= sides->of[in->joint[k]] == smaller ? fade : 1.0f; }
        influences_normalize(in, in->joint[0]);
    }
}

bool rig_part_sides(struct rig *rig)
{
    struct sides sides;
    if (!find_sides(rig, &sides)) { return rig_fail("not enough memory"); }
    rig->on_both_sides[0] = count_faults(rig, &sides, rig->surface.positions, rig->influences, rig->surface.vertex_count);
    fade_sides(rig, &sides);
    free(sides.of);
    return true;
}

bool rig_check_sides(struct rig *rig)
{
    const struct character *c = &rig->body.character;
    struct sides sides;
    if (!find_sides(rig, &sides)) { return rig_fail("not enough memory"); }
    rig->on_both_sides[1] = count_faults(rig, &sides, c->positions, c->influences, c->vertex_count);
    free(sides.of);
    return true;
}
