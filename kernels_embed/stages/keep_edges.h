/* edges.h - sharp edges: about a place where the surface has a crease, its springls fall into sides, groups that face one
   way each with nothing between. On a smooth surface normals fill the range between any two of them, and there are no sides,
   however strong the curvature. */
#ifndef SPRINGLS__KERNEL_STAGES_KEEP_EDGES_H
#define SPRINGLS__KERNEL_STAGES_KEEP_EDGES_H

#include "../model/cell_list.h"
#include "../model/fit.h"
#include "../model/model.h"
#include "project.h"

#define SPRINGLS__SIDES 3  /* that can meet in a corner                                     */
#define SPRINGLS__TRIES 6  /* directions looked at for sides                             */
#define SPRINGLS__SAMPLE_SET_SIZE 96 /* springls about a place                                        */
#define SPRINGLS__APART 0.64f   /* cosine of 50 degrees: sides of a crease differ by more   */
#define SPRINGLS__TOGETHER 0.95f /* cosine of 18 degrees: springls of a side differ by less */
#define SPRINGLS__NARROW 0.4f   /* voxel: see springls__find_sides                           */
#define SPRINGLS__AWAY -0.5f    /* cosine: the other sheet of a thin object                 */

/* Of `count` sides; 0 or 1: no crease here. */
typedef struct springls__sides { springls__v3 normal[SPRINGLS__SIDES], middle[SPRINGLS__SIDES]; int count; } springls__sides;

/* The side that a normal belongs to; -1: none. */
SPRINGLS__MATHS int springls__side_of(const springls__sides sides, springls__v3 n)
{
    int s, best = -1;
    float most = SPRINGLS__TOGETHER, along;
    for (s = 0; s < sides.count; s++) {
        along = springls__dot(sides.normal[s], n);
        if (along <= most) continue;
        most = along;
        best = s;
    }
    return best;
}

/* Where the places of a side lie, in two tangent coordinates. */
typedef struct springls__patch { float count, u, v, uu, uv, vv; } springls__patch;

SPRINGLS__MATHS springls__patch springls__patch_begin(void)
{
    springls__patch patch;
    patch.count = patch.u = patch.v = patch.uu = patch.uv = patch.vv = 0.0f;
    return patch;
}

SPRINGLS__MATHS springls__patch springls__patch_add(springls__patch patch, springls__v3 d, springls__v3 e1, springls__v3 e2)
{
    float u = springls__dot(d, e1), v = springls__dot(d, e2);
    patch.count += 1.0f;
    patch.u += u;
    patch.v += v;
    patch.uu += u * u;
    patch.uv += u * v;
    patch.vv += v * v;
    return patch;
}

/* Their variance in the direction in which it is least. */
SPRINGLS__MATHS float springls__patch_width2(springls__patch patch)
{
    float one = 1.0f / springls__max(patch.count, 1.0f), u = patch.u * one, v = patch.v * one;
    float uu = patch.uu * one - u * u, uv = patch.uv * one - u * v, vv = patch.vv * one - v * v;
    float difference = 0.5f * (uu - vv);
    return 0.5f * (uu + vv) - springls__sqrt(difference * difference + uv * uv);
}

/* The direction that most of the weight that faces elsewhere than the sides tried yet agrees about, and that weight. */
typedef struct springls__support { springls__v3 normal; float weight; } springls__support;

SPRINGLS__MATHS springls__support springls__next_side(const springls__v3 *tried, int tries, const springls__v3 *n,
                                                      const float *weight, int count)
{
    springls__support best;
    int i, j, elsewhere, stride = count / 24 + 1; /* of many, some are asked */
    best.normal = springls__v3_make(0.0f, 0.0f, 0.0f);
    best.weight = 0.0f;
    for (i = 0; i < count; i += stride) {
        springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f);
        float support = 0.0f;
        for (elsewhere = 1, j = 0; j < tries; j++) elsewhere = elsewhere && springls__dot(tried[j], n[i]) < SPRINGLS__APART;
        if (!elsewhere) continue;
        for (j = 0; j < count; j++) {
            if (springls__dot(n[i], n[j]) <= SPRINGLS__TOGETHER) continue;
            support += weight[j];
            sum = springls__mad(sum, n[j], weight[j]);
        }
        if (support <= best.weight) continue;
        best.weight = support;
        best.normal = springls__normalize(sum);
    }
    return best;
}

/* The middle of those that face like n, and how narrow a strip they are: the least standard deviation, squared. */
typedef struct springls__strip { springls__v3 middle; float width2; } springls__strip;

SPRINGLS__MATHS springls__strip springls__strip_of(springls__v3 facing, const springls__v3 *p, const springls__v3 *n,
                                                   const float *weight, int count)
{
    springls__v3 e1 = springls__fabs(facing.x) < 0.6f ? springls__v3_make(1.0f, 0.0f, 0.0f)
                                                      : springls__v3_make(0.0f, 1.0f, 0.0f),
                 e2;
    springls__patch patch = springls__patch_begin();
    springls__strip strip;
    float sum = 0.0f;
    int i;
    e1 = springls__normalize(springls__cross(facing, e1));
    e2 = springls__cross(facing, e1);
    strip.middle = springls__v3_make(0.0f, 0.0f, 0.0f);
    for (i = 0; i < count; i++) {
        if (springls__dot(facing, n[i]) <= SPRINGLS__TOGETHER) continue;
        patch = springls__patch_add(patch, springls__sub(p[i], p[0]), e1, e2);
        strip.middle = springls__mad(strip.middle, p[i], weight[i]);
        sum += weight[i];
    }
    strip.middle = springls__scale(strip.middle, 1.0f / springls__max(sum, 1e-6f));
    strip.width2 = springls__patch_width2(patch);
    return strip;
}

/* Sides from the springls about a place. A crease has at least two with a twelfth of the weight each, none a strip narrower
   than `narrow` (rows of triangles round a thin rim are no sides), and next to nothing is on none of them: a sixth at most,
   other sheets left out, or half of that and more narrowly judged where the answer must be certain. A springl is on a side
   that it lies on, whichever of several ways it has been turned. */
SPRINGLS__MATHS springls__sides springls__find_sides(const springls__v3 *p, const springls__v3 *n, const float *weight,
                                                     int count, float narrow, int certain)
{
    const float on = certain ? 0.06f : 0.15f; /* voxel */
    springls__v3 tried[SPRINGLS__TRIES];
    springls__sides sides;
    float total = 0.0f, stray = 0.0f;
    int i, s, tries = 0;
    sides.count = 0;
    for (i = 0; i < count; i++) total += weight[i];
    while (tries < SPRINGLS__TRIES && sides.count < SPRINGLS__SIDES) {
        springls__support side = springls__next_side(tried, tries, n, weight, count);
        springls__strip strip;
        if (side.weight < total * (1.0f / 12.0f) || side.weight <= 0.0f) break;
        tried[tries++] = side.normal;
        strip = springls__strip_of(side.normal, p, n, weight, count);
        if (narrow > 0.0f && strip.width2 < narrow * narrow) continue;
        sides.middle[sides.count] = strip.middle;
        sides.normal[sides.count++] = side.normal;
    }
    for (total = 0.0f, i = 0; i < count; i++) {
        int lies = springls__side_of(sides, n[i]) >= 0, away = 1;
        for (s = 0; s < sides.count; s++) {
            float along = springls__dot(n[i], sides.normal[s]);
            lies = lies
                   || (along > 0.3f
                       && springls__fabs(springls__dot(springls__sub(p[i], sides.middle[s]), sides.normal[s])) < on);
            away = away && along < SPRINGLS__AWAY;
        }
        if (lies) total += weight[i];
        else if (!away) stray += weight[i];
    }
    if (stray * (certain ? 12.0f : 5.0f) > total) sides.count = 0;
    return sides;
}

/* True where two sides, each given by a place on it and its normal there, meet in a convex edge. */
SPRINGLS__MATHS int springls__is_convex(springls__v3 p, springls__v3 n, springls__v3 q, springls__v3 m)
{
    springls__v3 d = springls__sub(q, p);
    return springls__dot(d, n) - springls__dot(d, m) < 0.0f;
}

/* Heights over sides that meet, as one: the larger where the edge between them is convex, else the smaller. Of three the two
   that meet in the odd way come first. convex: of sides 0 and 1, 0 and 2, 1 and 2. */
SPRINGLS__MATHS float springls__meet(float a, float b, int convex) { return convex ? springls__max(a, b) : springls__min(a, b); }

SPRINGLS__MATHS float springls__height_over_sides(const float h[SPRINGLS__SIDES], int count, const int convex[SPRINGLS__SIDES])
{
    if (count < 3) return count == 2 ? springls__meet(h[0], h[1], convex[0]) : h[0];
    if (convex[1] == convex[2]) return springls__meet(springls__meet(h[0], h[1], convex[0]), h[2], convex[1]);
    if (convex[0] == convex[2]) return springls__meet(springls__meet(h[0], h[2], convex[1]), h[1], convex[0]);
    return springls__meet(springls__meet(h[1], h[2], convex[2]), h[0], convex[0]);
}

/* phi at a crease: the height over the sides, further off than springls__corrected_phi would take it, for triangles that stick
   out beyond an edge carry the evolved value away. What is a voxel off is another surface. */
SPRINGLS__MATHS float springls__edge_phi(float phi, float height) { return springls__fabs(height - phi) < 0.75f ? height : phi; }

/* A triangle turned about p by the least rotation that takes unit vector n to m; as it is when they are opposite. */
SPRINGLS__MATHS springls__v3 springls__turn_to(springls__v3 v, springls__v3 n, springls__v3 m)
{
    springls__v3 axis = springls__cross(n, m), u = springls__cross(axis, v);
    float c = springls__dot(n, m);
    if (c < -0.5f) return v;
    return springls__add(springls__add(v, u), springls__scale(springls__cross(axis, u), 1.0f / (1.0f + c)));
}

/* The springls about a place. */
typedef struct springls__sample_set {
    springls__v3 p[SPRINGLS__SAMPLE_SET_SIZE], n[SPRINGLS__SAMPLE_SET_SIZE], a[SPRINGLS__SAMPLE_SET_SIZE];
    float weight[SPRINGLS__SAMPLE_SET_SIZE];
    int id[SPRINGLS__SAMPLE_SET_SIZE], count;
} springls__sample_set;

/* False when it is full. */
SPRINGLS__MATHS bool springls__sample_set_add(springls__sample_set *crowd, springls__v3 p, springls__v3 n, springls__v3 a, float weight, int id)
{
    int i = crowd->count;
    if (i == SPRINGLS__SAMPLE_SET_SIZE) return false;
    crowd->p[i] = p;
    crowd->n[i] = n;
    crowd->a[i] = a;
    crowd->weight[i] = weight;
    crowd->id[i] = id;
    crowd->count++;
    return true;
}

/* narrow, certain: see springls__find_sides. */
SPRINGLS__MATHS springls__sides springls__sample_set_sides(const springls__sample_set *crowd, float narrow, bool certain)
{
    return springls__find_sides(crowd->p, crowd->n, crowd->weight, crowd->count, narrow, certain);
}

/* Those with particles within the radius, or as much of it as SPRINGLS__SAMPLE_SET_SIZE of them fill; before `known` only. */
SPRINGLS__MATHS void springls__gather_samples(const springls__model *model, springls__v3 x, float radius, int known,
                                            springls__sample_set *crowd)
{
    springls__cell_walk walk = springls__cell_walk_begin(model, springls__v3_make(x.x - radius, x.y - radius, x.z - radius),
                                                         springls__v3_make(x.x + radius, x.y + radius, x.z + radius));
    const float least = 0.3f;
    int i;
    crowd->count = 0;
    while ((i = springls__cell_walk_next(&walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[i];
        float weight = 1.0f - springls__length2(springls__sub(s->p, x)) / (radius * radius);
        if (i >= known || weight <= 0.0f) continue;
        if (springls__sample_set_add(crowd, s->p, springls__springl_normal(*s), model->set.a[i], weight * weight, i)) continue;
        if (radius < least) return; /* they lie on each other: these will do */
        radius *= 0.8f;             /* too many: begin again */
        walk = springls__cell_walk_begin(model, springls__v3_make(x.x - radius, x.y - radius, x.z - radius),
                                         springls__v3_make(x.x + radius, x.y + radius, x.z + radius));
        crowd->count = 0;
    }
}

/* One side's surface about x; springl `self` is not asked. */
SPRINGLS__MATHS springls__fit_result springls__fit_side(const springls__sample_set *crowd, springls__sides sides, int side,
                                                        springls__v3 x, springls__v3 a0, int self)
{
    springls__fit fit = springls__fit_begin(x, sides.normal[side], a0);
    springls__fit_result result;
    int i;
    for (i = 0; i < crowd->count; i++)
        if (crowd->id[i] != self && springls__side_of(sides, crowd->n[i]) == side)
            fit = springls__fit_add(fit, crowd->p[i], crowd->n[i], crowd->a[i]);
    result = springls__fit_solve(fit, fit.count >= 10 ? 6 : fit.count >= 4 ? 3 : 0);
    if (!result.ok && fit.count >= 10) result = springls__fit_solve(fit, 3);
    if (fit.count < 4 || springls__length2(springls__sub(result.point, x)) > 1.0f
        || springls__dot(result.normal, sides.normal[side]) < 0.7f)
        result.ok = 0;
    return result;
}

/* What a place near a crease belongs to: the side whose surface it is nearest to, or of two as near the one that its normal
   is nearer to; then on from there to where the sides meet, if that is beyond it. Not ok unless `at_least` sides are.
   ways: 1 when only a convex edge will do, 2 only a concave one, 3 either. */
SPRINGLS__MATHS springls__fit_result springls__side_at(const springls__sample_set *crowd, springls__sides sides, springls__v3 x,
                                                       springls__v3 n, springls__v3 a0, int self, int ways, int at_least)
{
    const float doubt = 0.1f; /* voxel: what a normal counts against a distance */
    springls__fit_result fit[SPRINGLS__SIDES], result;
    float least = FLT_MAX;
    int side, best = -1, good = 0;
    for (side = 0; side < sides.count; side++) {
        float off;
        fit[side] = springls__fit_side(crowd, sides, side, x, a0, self);
        if (!fit[side].ok) continue;
        good++;
        off = springls__length(springls__sub(fit[side].point, x)) + doubt * (1.0f - springls__dot(n, fit[side].normal));
        if (off >= least) continue;
        least = off;
        best = side;
    }
    result.ok = good >= at_least;
    result.point = x;
    result.normal = n;
    result.a = a0;
    if (!result.ok) return result;
    result = fit[best];
    for (side = 0; side < sides.count; side++) {
        int convex;
        float beyond;
        if (side == best || !fit[side].ok) continue;
        convex = springls__is_convex(sides.middle[best], sides.normal[best], sides.middle[side], sides.normal[side]);
        if (!(ways & (convex ? 1 : 2))) result.ok = 0;
        beyond = springls__dot(springls__sub(result.point, fit[side].point), fit[side].normal);
        if ((beyond > 0.0f) == (convex != 0)) result.point = springls__mad(result.point, fit[side].normal, -beyond);
    }
    return result;
}

/* Place and correspondence of a new springl near a crease, from one side of it only; false where there is no crease. */
SPRINGLS__MATHS bool springls__place_at_edge(const springls__model *model, springls__v3 x, springls__v3 n, springls__v3 a0,
                                             int known, springls__fit_result *result)
{
    springls__sample_set crowd;
    springls__sides sides;
    int i, edges = 0;
    if (model->set.at_edges == 0) return false;
    springls__gather_samples(model, x, SPRINGLS__FIT_RADIUS, known, &crowd);
    for (i = 0; i < crowd.count; i++) edges += model->set.edge[crowd.id[i]];
    if (edges == 0) return false;
    sides = springls__sample_set_sides(&crowd, SPRINGLS__NARROW, false);
    if (sides.count < 2) return false;
    *result = springls__side_at(&crowd, sides, x, n, a0, -1, 3, 2);
    return result->ok != 0;
}

/* Signed height of x over the sides about it; no weight where it is not clear what the sides are. */
SPRINGLS__MATHS springls__estimate springls__edge_distance(const springls__sample_set *crowd, springls__v3 x)
{
    springls__sides sides = springls__sample_set_sides(crowd, 0.0f, false), known;
    springls__v3 p[SPRINGLS__SIDES];
    float height[SPRINGLS__SIDES];
    springls__estimate all;
    int convex[SPRINGLS__SIDES] = { 0, 0, 0 }, side, i;
    all.weight = all.distance = 0.0f;
    if (sides.count == 0) return all;
    known.count = 0;
    for (side = 0; side < sides.count; side++) {
        springls__v3 middle = springls__v3_make(0.0f, 0.0f, 0.0f);
        float weight = 0.0f, value = 0.0f;
        for (i = 0; i < crowd->count; i++) {
            springls__estimate say;
            if (springls__side_of(sides, crowd->n[i]) != side) continue;
            say = springls__oriented_distance(x, sides.normal[side], crowd->p[i], crowd->n[i]);
            weight += say.weight;
            value += say.weight * say.distance;
            middle = springls__mad(middle, crowd->p[i], say.weight);
        }
        if (weight < 1e-3f) continue;
        p[known.count] = springls__scale(middle, 1.0f / weight);
        height[known.count] = value / weight;
        known.normal[known.count++] = sides.normal[side];
        all.weight += weight;
    }
    if (known.count == 0) return all;
    if (known.count > 1) convex[0] = springls__is_convex(p[0], known.normal[0], p[1], known.normal[1]);
    if (known.count > 2) {
        convex[1] = springls__is_convex(p[0], known.normal[0], p[2], known.normal[2]);
        convex[2] = springls__is_convex(p[1], known.normal[1], p[2], known.normal[2]);
    }
    all.distance = springls__height_over_sides(height, known.count, convex);
    return all;
}

/* ---- springls at a crease, before the level set follows: normals in SCRATCH4, suspects in SCRATCH6, what was an edge
   before in SCRATCH7 ---- */

SPRINGLS__MATHS void springls__edge_normal_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__side_normal(model)[i] = springls__springl_normal(model->set.s[i]);
    springls__was_at_edge(model)[i] = model->set.edge[i];
}

/* Which springls may lie at a crease: with neighbours that face elsewhere when edges are looked for anew (job.i[0]), later those
   beside the ones known. */
SPRINGLS__MATHS void springls__edge_suspect_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = 1.5f, turned = 0.77f; /* cosine of 40 degrees */
    SPRINGLS__GLOBAL const springls__v3 *normal = springls__side_normal(model);
    SPRINGLS__GLOBAL const uint8_t *was = springls__was_at_edge(model);
    springls__v3 p = model->set.s[i].p;
    springls__cell_walk walk = springls__cell_walk_near(model, p, radius);
    bool suspect = false;
    int other;
    while (!suspect && (other = springls__cell_walk_next(&walk)) >= 0) {
        float along = springls__dot(normal[i], normal[other]);
        if (args.edge.search ? along < turned && along > SPRINGLS__AWAY : was[other] != 0)
            suspect = springls__length2(springls__sub(p, model->set.s[other].p)) < radius * radius;
    }
    springls__edge_candidate(model)[i] = suspect;
}

SPRINGLS__MATHS void springls__edge_side_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = 2.5f, beside = 0.7f; /* a weight: within a voxel */
    const float slack = 0.05f; /* voxel: springls were put on a side and carried, they lie on it */
    SPRINGLS__GLOBAL const uint8_t *was = springls__was_at_edge(model);
    springls__springl s = model->set.s[i];
    springls__sample_set crowd;
    springls__fit_result fit;
    springls__sides sides;
    bool was_edge = false; /* what was one may have worn a little, and a new springl may have come to it */
    int k;
    (void)args;
    model->set.edge[i] = 0;
    if (!springls__edge_candidate(model)[i]) return;
    springls__gather_samples(model, s.p, radius, model->set.count, &crowd);
    for (k = 0; k < crowd.count; k++) was_edge = was_edge || (crowd.weight[k] > beside && was[crowd.id[k]]);
    sides = springls__sample_set_sides(&crowd, SPRINGLS__NARROW, !was_edge);
    if (sides.count < 2) return;
    fit = springls__side_at(&crowd, sides, s.p, springls__springl_normal(s), model->set.a[i], i, 3, 2);
    if (!fit.ok || springls__length2(springls__sub(fit.point, s.p)) > slack * slack) return;
    model->set.edge[i] = 1;
    springls__side_normal(model)[i] = fit.normal;
}

SPRINGLS__MATHS void springls__edge_turn_element(const springls__model *model, springls__arguments args, int i)
{
    springls__springl s = model->set.s[i];
    springls__v3 n = springls__springl_normal(s), side = springls__side_normal(model)[i];
    int m;
    (void)args;
    if (!model->set.edge[i] || model->set.mask[i]) return;
    for (m = 0; m < 3; m++) s.q[m] = springls__add(s.p, springls__turn_to(springls__sub(s.q[m], s.p), n, side));
    model->set.s[i] = springls__springl_finished(s);
}

#endif
