/* keep_edges.h - sharp edges: about a place where the surface has a crease, its springls fall into sides, groups that face one
   way each with no normals in between. On a smooth surface normals fill the range between any two of them, so that there are no
   sides, however strong the curvature. */
#ifndef SPRINGLS__KERNEL_STAGES_KEEP_EDGES_H
#define SPRINGLS__KERNEL_STAGES_KEEP_EDGES_H

#include "../model/cell_list.h"
#include "../model/fit.h"
#include "../model/model.h"
#include "project.h"

#define SPRINGLS__SIDES 3             /* at most: a corner                                         */
#define SPRINGLS__TRIES 6             /* directions tried for sides                                */
#define SPRINGLS__SAMPLE_SET_SIZE 96  /* springls about a place, at most                           */
#define SPRINGLS__APART 0.64f         /* cosine of 50 degrees: sides of a crease differ by more    */
#define SPRINGLS__TOGETHER 0.95f      /* cosine of 18 degrees: springls of one side differ by less */
#define SPRINGLS__NARROW 0.35f        /* voxel: see springls__find_sides                           */
#define SPRINGLS__AWAY -0.5f          /* cosine: the other sheet of a thin object                  */
#define SPRINGLS__CONVEX 1            /* kinds of edges, as bits                                   */
#define SPRINGLS__CONCAVE 2

/* `count` sides; 0 or 1: no crease here. */
typedef struct springls__sides { springls__v3 normal[SPRINGLS__SIDES], middle[SPRINGLS__SIDES]; int count; } springls__sides;

/* Returns the side that a normal belongs to; -1: none. */
SPRINGLS__MATHS int springls__side_of(const springls__sides *sides, springls__v3 n)
{
    int s, best = -1;
    float closest = SPRINGLS__TOGETHER, along;
    for (s = 0; s < sides->count; s++) {
        along = springls__dot(sides->normal[s], n);
        if (along <= closest) continue;
        closest = along;
        best = s;
    }
    return best;
}

/* Moments of the places of a side in two tangent coordinates. */
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

/* Returns the variance of the places of a patch in the direction in which it is least, voxel^2. */
SPRINGLS__MATHS float springls__patch_width2(springls__patch patch)
{
    float one = 1.0f / springls__max(patch.count, 1.0f), u = patch.u * one, v = patch.v * one;
    float uu = patch.uu * one - u * u, uv = patch.uv * one - u * v, vv = patch.vv * one - v * v;
    float difference = 0.5f * (uu - vv);
    return 0.5f * (uu + vv) - springls__sqrt(difference * difference + uv * uv);
}

#define SPRINGLS__DIRECTIONS 24 /* that are tried, at most: several for each side; a multiple of the lanes */

/* Directions that may be those of sides: normals n of some of the springls about a place; for each the mean direction (x, y, z) and
   the weight of all springls that face like it. */
typedef struct springls__directions {
    springls__v3 n[SPRINGLS__DIRECTIONS];
    float x[SPRINGLS__DIRECTIONS], y[SPRINGLS__DIRECTIONS], z[SPRINGLS__DIRECTIONS], weight[SPRINGLS__DIRECTIONS];
    int count;
} springls__directions;

/* Finds the mean directions of the springls that face like numbers i, i + 1, ..., one a lane, and their weights. */
SPRINGLS__MATHS void springls__find_support(springls__directions *directions, int i, const springls__v3 *n, const float *weight,
                                            int count)
{
    springls__vec3 facing = springls__vec_load_v3(directions->x + i, directions->y + i, directions->z + i), sum;
    springls__vec total = springls__vec_broadcast(0.0f), none = total;
    int j;
    sum = springls__vec_v3_make(none, none, none);
    for (j = 0; j < count; j++) {
        springls__vec3 other = springls__vec_broadcast3(n[j]);
        springls__vmask alike = springls__vec_dot(facing, other) > SPRINGLS__TOGETHER;
        springls__vec w = springls__vec_select(alike, springls__vec_broadcast(weight[j]), none);
        total = total + w;
        sum = springls__vec_mad(sum, other, w);
    }
    sum = springls__vec_normalize(sum);
    springls__vec_store(directions->x + i, sum.x);
    springls__vec_store(directions->y + i, sum.y);
    springls__vec_store(directions->z + i, sum.z);
    springls__vec_store(directions->weight + i, total);
}

/* Chooses directions, evenly among the springls, and finds the support of each; those behind directions->count are zero. */
SPRINGLS__MATHS void springls__find_directions(const springls__v3 *n, const float *weight, int count,
                                               springls__directions *directions)
{
    int i, stride = count / SPRINGLS__DIRECTIONS + 1;
    directions->count = 0;
    for (i = 0; i < SPRINGLS__DIRECTIONS; i++) {
        springls__v3 one = i * stride < count ? n[i * stride] : springls__v3_make(0.0f, 0.0f, 0.0f);
        directions->n[i] = one;
        directions->x[i] = one.x;
        directions->y[i] = one.y;
        directions->z[i] = one.z;
        directions->count += i * stride < count;
    }
    for (i = 0; i < directions->count; i += SPRINGLS__LANES) springls__find_support(directions, i, n, weight, count);
}

SPRINGLS__MATHS bool springls__is_tried(const springls__v3 *tried, int tries, springls__v3 n)
{
    int j;
    for (j = 0; j < tries; j++)
        if (springls__dot(tried[j], n) >= SPRINGLS__APART) return true;
    return false;
}

/* Returns the direction with the largest weight, away from those tried before; -1: none has any. */
SPRINGLS__MATHS int springls__next_side(const springls__v3 *tried, int tries, const springls__directions *directions)
{
    float most = 0.0f;
    int i, best = -1;
    for (i = 0; i < directions->count; i++) {
        if (directions->weight[i] <= most || springls__is_tried(tried, tries, directions->n[i])) continue;
        most = directions->weight[i];
        best = i;
    }
    return best;
}

/* The middle of the springls of a side, and how narrow a strip they are: their least variance, voxel^2. */
typedef struct springls__strip { springls__v3 middle; float width2; } springls__strip;

SPRINGLS__MATHS springls__strip springls__strip_of(springls__v3 facing, const springls__v3 *p, const springls__v3 *n,
                                                   const float *weight, int count)
{
    springls__v3 e1 = springls__any_tangent(facing), e2 = springls__cross(facing, e1);
    springls__patch patch = springls__patch_begin();
    springls__strip strip;
    float sum = 0.0f;
    int i;
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

/* Finds sides with a twelfth of the weight each, at least, and none a strip narrower than `narrow`: rows of triangles round a
   thin rim are no sides. */
SPRINGLS__MATHS springls__sides springls__heaviest_sides(const springls__v3 *p, const springls__v3 *n, const float *weight,
                                                         int count, float narrow)
{
    springls__v3 tried[SPRINGLS__TRIES];
    springls__directions directions;
    springls__sides sides;
    float total = 0.0f;
    int i, tries = 0;
    sides.count = 0;
    for (i = 0; i < count; i++) total += weight[i];
    springls__find_directions(n, weight, count, &directions);
    while (tries < SPRINGLS__TRIES && sides.count < SPRINGLS__SIDES) {
        int d = springls__next_side(tried, tries, &directions);
        springls__strip strip;
        springls__v3 normal;
        if (d < 0 || directions.weight[d] < total * (1.0f / 12.0f)) break;
        normal = tried[tries++] = springls__v3_make(directions.x[d], directions.y[d], directions.z[d]);
        strip = springls__strip_of(normal, p, n, weight, count);
        if (narrow > 0.0f && strip.width2 < narrow * narrow) continue;
        sides.middle[sides.count] = strip.middle;
        sides.normal[sides.count++] = normal;
    }
    return sides;
}

/* Returns true when the planes of sides s and t meet nearby: those of sides that face away from each other within
   SPRINGLS__FIT_RADIUS. The two sheets of a thin object do not, nor the walls of a gap. */
SPRINGLS__MATHS bool springls__sides_meet(const springls__sides *sides, int s, int t)
{
    springls__v3 n = sides->normal[s], m = sides->normal[t], d = springls__sub(sides->middle[t], sides->middle[s]);
    float sine2 = springls__length2(springls__cross(n, m)), apart = springls__dot(d, springls__sub(n, m));
    return apart * apart <= 4.0f * SPRINGLS__FIT_RADIUS * SPRINGLS__FIT_RADIUS * sine2;
}

/* Leaves out sides that meet none of the others. A side alone stays. */
SPRINGLS__MATHS springls__sides springls__sides_that_meet(springls__sides all)
{
    springls__sides sides;
    int s, t;
    sides.count = 0;
    for (s = 0; s < all.count; s++) {
        bool meets = all.count == 1;
        for (t = 0; t < all.count; t++) meets = meets || (t != s && springls__sides_meet(&all, s, t));
        if (!meets) continue;
        sides.normal[sides.count] = all.normal[s];
        sides.middle[sides.count++] = all.middle[s];
    }
    return sides;
}

/* Returns true when a springl faces as a side does, or lies on one within `distance` (voxels), whichever of several ways it has
   been turned. */
SPRINGLS__MATHS bool springls__is_on_side(const springls__sides *sides, springls__v3 p, springls__v3 n, float distance)
{
    int s;
    if (springls__side_of(sides, n) >= 0) return true;
    for (s = 0; s < sides->count; s++)
        if (springls__dot(n, sides->normal[s]) > 0.3f
            && springls__fabs(springls__dot(springls__sub(p, sides->middle[s]), sides->normal[s])) < distance) return true;
    return false;
}

/* Returns true when a springl faces away from all sides: it is of another sheet. */
SPRINGLS__MATHS bool springls__faces_away(const springls__sides *sides, springls__v3 n)
{
    int s;
    for (s = 0; s < sides->count; s++)
        if (springls__dot(n, sides->normal[s]) >= SPRINGLS__AWAY) return false;
    return true;
}

/* Finds the sides of the springls about a place, given their weights. There are none unless almost all springls lie on one:
   springls on none, those of other sheets left out, may have a sixth of the weight. `certain`: half of that, and a smaller distance
   counts as on a side. */
SPRINGLS__NOINLINE springls__sides springls__find_sides(const springls__v3 *p, const springls__v3 *n, const float *weight,
                                                        int count, float narrow, bool certain)
{
    const float distance = certain ? 0.06f : 0.15f; /* voxel */
    springls__sides sides = springls__sides_that_meet(springls__heaviest_sides(p, n, weight, count, narrow));
    float on = 0.0f, stray = 0.0f;
    int i;
    for (i = 0; i < count; i++) {
        if (springls__is_on_side(&sides, p[i], n[i], distance)) on += weight[i];
        else if (!springls__faces_away(&sides, n[i])) stray += weight[i];
    }
    if (stray * (certain ? 12.0f : 5.0f) > on) sides.count = 0;
    return sides;
}

/* Returns true when two sides, each given by a place on it and its normal there, meet in a convex edge. */
SPRINGLS__MATHS bool springls__is_convex(springls__v3 p, springls__v3 n, springls__v3 q, springls__v3 m)
{
    springls__v3 d = springls__sub(q, p);
    return springls__dot(d, n) - springls__dot(d, m) < 0.0f;
}

/* Combines the heights over two sides that meet: the larger where the edge between them is convex, else the smaller. */
SPRINGLS__MATHS float springls__meet(float a, float b, bool convex) { return convex ? springls__max(a, b) : springls__min(a, b); }

/* Combines the heights over 1 to 3 sides; convex: of the edge between sides 0 and 1, 0 and 2, 1 and 2. Of three the two come
   first whose edge is of another kind than the others. */
SPRINGLS__MATHS float springls__height_over_sides(const float h[SPRINGLS__SIDES], int count, const bool convex[SPRINGLS__SIDES])
{
    if (count < 3) return count == 2 ? springls__meet(h[0], h[1], convex[0]) : h[0];
    if (convex[1] == convex[2]) return springls__meet(springls__meet(h[0], h[1], convex[0]), h[2], convex[1]);
    if (convex[0] == convex[2]) return springls__meet(springls__meet(h[0], h[2], convex[1]), h[1], convex[0]);
    return springls__meet(springls__meet(h[1], h[2], convex[2]), h[0], convex[0]);
}

/* Returns true when the height over the sides of a crease is close enough to phi to be of this surface. The limit is wider than
   in springls__corrected_phi, as triangles that stick out beyond an edge move the evolved value. */
SPRINGLS__MATHS bool springls__is_of_edge(float phi, float height) { return springls__fabs(height - phi) < 0.75f; }

/* Turns v by the least rotation that takes unit vector n to m; returns v itself when they are opposite. */
SPRINGLS__MATHS springls__v3 springls__turn_to(springls__v3 v, springls__v3 n, springls__v3 m)
{
    springls__v3 axis = springls__cross(n, m), u = springls__cross(axis, v);
    float c = springls__dot(n, m);
    if (c < -0.5f) return v;
    return springls__add(springls__add(v, u), springls__scale(springls__cross(axis, u), 1.0f / (1.0f + c)));
}

/* The springls about a place, with weights that fall with their distance. */
typedef struct springls__sample_set {
    springls__v3 p[SPRINGLS__SAMPLE_SET_SIZE], n[SPRINGLS__SAMPLE_SET_SIZE], a[SPRINGLS__SAMPLE_SET_SIZE];
    float weight[SPRINGLS__SAMPLE_SET_SIZE];
    int id[SPRINGLS__SAMPLE_SET_SIZE], count;
} springls__sample_set;

/* Adds a springl to the set; false when the set is full. */
SPRINGLS__MATHS bool springls__sample_set_add(springls__sample_set *samples, springls__v3 p, springls__v3 n, springls__v3 a,
                                              float weight, int id)
{
    int i = samples->count;
    if (i == SPRINGLS__SAMPLE_SET_SIZE) return false;
    samples->p[i] = p;
    samples->n[i] = n;
    samples->a[i] = a;
    samples->weight[i] = weight;
    samples->id[i] = id;
    samples->count++;
    return true;
}

/* Returns true when two surfaces with the unit normals n and m in voxels face elsewhere in the world, by the cosine `alike` or less. */
SPRINGLS__MATHS bool springls__turned_in_world(springls__metric metric, springls__v3 n, springls__v3 m, float alike)
{
    return springls__metric_product(metric, n, m) < alike * springls__world_slope(metric, n) * springls__world_slope(metric, m);
}

/* Finds the sides of a set: see springls__find_sides. In voxels that are longer along one axis a ball bends as sharply as a crease: there
   sides have to differ in the world too. */
SPRINGLS__MATHS springls__sides springls__sample_set_sides(const springls__sample_set *samples, springls__metric metric, float narrow,
                                                           bool certain)
{
    springls__sides sides = springls__find_sides(samples->p, samples->n, samples->weight, samples->count, narrow, certain);
    int i, j;
    if (springls__is_uniform(metric) || sides.count < 2) return sides;
    for (i = 1; i < sides.count; i++)
        for (j = 0; j < i; j++)
            if (!springls__turned_in_world(metric, sides.normal[i], sides.normal[j], SPRINGLS__APART)) sides.count = 0;
    return sides;
}

/* Returns the weight of springl i in the set about x; 0 or less beyond the radius. */
SPRINGLS__INNER float springls__sample_weight(const springls__model *model, int i, springls__v3 x, float radius)
{
    const float weight = 1.0f - springls__length2(springls__sub(model->set.s[i].p, x)) / (radius * radius);
    return weight > 0.0f ? weight * weight : 0.0f;
}

/* Leaves out the springls of a set that lie beyond a smaller radius. */
SPRINGLS__MATHS void springls__narrow_samples(const springls__model *model, springls__v3 x, float radius, springls__sample_set *samples)
{
    int k, count = 0;
    for (k = 0; k < samples->count; k++) {
        const int i = samples->id[k];
        samples->id[count] = i;
        samples->weight[count] = springls__sample_weight(model, i, x, radius);
        count += samples->weight[count] > 0.0f;
    }
    samples->count = count;
}

/* Collects the springls before `known` with particles within the radius, or within a smaller one that does not overfill the
   set. */
SPRINGLS__NOINLINE void springls__gather_samples(const springls__model *model, springls__v3 x, float radius, int known,
                                                 springls__sample_set *samples)
{
    springls__cell_walk walk = springls__cell_walk_near(model, x, radius);
    const float least = 0.3f; /* of the radius: nearer springls lie on each other, and those of the set are enough */
    int i, k;
    samples->count = 0;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        float weight = i < known ? springls__sample_weight(model, i, x, radius) : 0.0f;
        while (weight > 0.0f && samples->count == SPRINGLS__SAMPLE_SET_SIZE && radius >= least) {
            radius *= 0.8f;
            walk.r2 = radius * radius;
            springls__narrow_samples(model, x, radius, samples);
            weight = springls__sample_weight(model, i, x, radius);
        }
        if (!(weight > 0.0f)) continue;
        if (samples->count == SPRINGLS__SAMPLE_SET_SIZE) break;
        samples->id[samples->count] = i;
        samples->weight[samples->count++] = weight;
    }
    for (k = 0; k < samples->count; k++) { /* of those that stay */
        samples->p[k] = model->set.s[samples->id[k]].p;
        samples->n[k] = springls__springl_normal(model->set.s[samples->id[k]]);
        samples->a[k] = model->set.a[samples->id[k]];
    }
}

/* Fits the surface of one side, facing n, about x; side_of: the side of each sample. */
SPRINGLS__MATHS springls__fit_result springls__fit_side(const springls__sample_set *samples,
                                                        const int side_of[SPRINGLS__SAMPLE_SET_SIZE], int side, springls__v3 n,
                                                        springls__v3 x, springls__v3 a0)
{
    springls__fit fit = springls__fit_begin(x, n, a0);
    springls__fit_result result;
    int i;
    for (i = 0; i < samples->count; i++)
        if (side_of[i] == side) springls__fit_add(&fit, samples->p[i], samples->n[i], samples->a[i]);
    result = springls__fit_surface(&fit);
    if (springls__length2(springls__sub(result.point, x)) > 1.0f || springls__dot(result.normal, n) < 0.7f) result.ok = false;
    return result;
}

/* Fits the surface of every side about x, without springl `self`; returns how many fits are good. */
SPRINGLS__MATHS int springls__fit_sides(const springls__sample_set *samples, const springls__sides *sides, springls__v3 x,
                                        springls__v3 a0, int self, springls__fit_result fit[SPRINGLS__SIDES])
{
    int side_of[SPRINGLS__SAMPLE_SET_SIZE], i, side, good = 0;
    for (i = 0; i < samples->count; i++) side_of[i] = samples->id[i] == self ? -1 : springls__side_of(sides, samples->n[i]);
    for (side = 0; side < sides->count; side++) {
        fit[side] = springls__fit_side(samples, side_of, side, sides->normal[side], x, a0);
        good += fit[side].ok;
    }
    return good;
}

/* Returns the side whose fitted surface is nearest to x; of two as near the one that faces more like n. */
SPRINGLS__MATHS int springls__nearest_side(const springls__fit_result fit[SPRINGLS__SIDES], int count, springls__v3 x,
                                           springls__v3 n)
{
    const float doubt = 0.1f; /* voxel: what a normal counts against a distance */
    float least = FLT_MAX, off;
    int side, best = -1;
    for (side = 0; side < count; side++) {
        if (!fit[side].ok) continue;
        off = springls__length(springls__sub(fit[side].point, x)) + doubt * (1.0f - springls__dot(n, fit[side].normal));
        if (off >= least) continue;
        least = off;
        best = side;
    }
    return best;
}

/* Finds the place of a springl at x, facing n, near a crease: on the side that it is nearest to, and no further than where the
   sides meet. Not ok unless `at_least` sides are known; kinds: the edges that are allowed, SPRINGLS__CONVEX and
   SPRINGLS__CONCAVE. */
SPRINGLS__NOINLINE springls__fit_result springls__side_at(const springls__sample_set *samples, const springls__sides *sides,
                                                          springls__v3 x, springls__v3 n, springls__v3 a0, int self, int kinds,
                                                          int at_least)
{
    springls__fit_result fit[SPRINGLS__SIDES], result;
    int side, best, good = springls__fit_sides(samples, sides, x, a0, self, fit);
    result.ok = good >= at_least;
    result.point = x;
    result.normal = n;
    result.a = a0;
    if (!result.ok) return result;
    best = springls__nearest_side(fit, sides->count, x, n);
    result = fit[best];
    for (side = 0; side < sides->count; side++) {
        bool convex;
        float beyond;
        if (side == best || !fit[side].ok) continue;
        convex = springls__is_convex(sides->middle[best], sides->normal[best], sides->middle[side], sides->normal[side]);
        if (!(kinds & (convex ? SPRINGLS__CONVEX : SPRINGLS__CONCAVE))) result.ok = false;
        beyond = springls__dot(springls__sub(result.point, fit[side].point), fit[side].normal);
        if ((beyond > 0.0f) == convex) result.point = springls__mad(result.point, fit[side].normal, -beyond);
    }
    return result;
}

/* Returns whether a springl before `known` within the radius lies at an edge: far from edges this ends a search for their sides. */
SPRINGLS__MATHS bool springls__edge_within(const springls__model *model, springls__v3 x, float radius, int known)
{
    springls__cell_walk walk = springls__cell_walk_near(model, x, radius);
    int i;
    while ((i = springls__cell_walk_next(model, &walk)) >= 0)
        if (i < known && model->set.edge[i] && springls__sample_weight(model, i, x, radius) > 0.0f) return true;
    return false;
}

/* Finds place and correspondence of a new springl near a crease, from one side of it only; false if there is no crease. */
SPRINGLS__MATHS bool springls__place_at_edge(const springls__model *model, springls__v3 x, springls__v3 n, springls__v3 a0,
                                             int known, springls__fit_result *result)
{
    springls__sample_set samples;
    springls__sides sides;
    int i, edges = 0;
    if (model->set.at_edges == 0 || !springls__edge_within(model, x, SPRINGLS__FIT_RADIUS, known)) return false;
    springls__gather_samples(model, x, SPRINGLS__FIT_RADIUS, known, &samples);
    for (i = 0; i < samples.count; i++) edges += model->set.edge[samples.id[i]];
    if (edges == 0) return false;
    sides = springls__sample_set_sides(&samples, model->grid.metric, SPRINGLS__NARROW, false);
    if (sides.count < 2) return false;
    *result = springls__side_at(&samples, &sides, x, n, a0, -1, SPRINGLS__CONVEX | SPRINGLS__CONCAVE, 2);
    return result->ok;
}

/* Returns the mean distance of x over one side, and the middle of that side. */
SPRINGLS__MATHS springls__estimate springls__height_over_side(const springls__sample_set *samples, const springls__sides *sides,
                                                              int side, springls__v3 x, springls__v3 *middle)
{
    springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f);
    springls__estimate all;
    int i;
    all.weight = all.distance = 0.0f;
    for (i = 0; i < samples->count; i++) {
        springls__estimate one;
        if (springls__side_of(sides, samples->n[i]) != side) continue;
        one = springls__oriented_distance(x, sides->normal[side], samples->p[i], samples->n[i]);
        all.weight += one.weight;
        all.distance += one.weight * one.distance;
        sum = springls__mad(sum, samples->p[i], one.weight);
    }
    if (all.weight < SPRINGLS__MIN_WEIGHT) return all;
    *middle = springls__scale(sum, 1.0f / all.weight);
    all.distance = all.distance / all.weight;
    return all;
}

/* Returns the signed height of x over the sides about it; weight 0 if the sides are not clear. */
SPRINGLS__MATHS springls__estimate springls__edge_distance(const springls__sample_set *samples, springls__metric metric, springls__v3 x)
{
    springls__sides sides = springls__sample_set_sides(samples, metric, 0.0f, false), known;
    float height[SPRINGLS__SIDES];
    springls__estimate all, one;
    springls__v3 p[SPRINGLS__SIDES];
    bool convex[SPRINGLS__SIDES] = { false, false, false };
    int side;
    all.weight = all.distance = 0.0f;
    known.count = 0;
    for (side = 0; side < sides.count; side++) {
        one = springls__height_over_side(samples, &sides, side, x, &p[known.count]);
        if (one.weight < SPRINGLS__MIN_WEIGHT) continue;
        height[known.count] = one.distance;
        known.normal[known.count++] = sides.normal[side];
        all.weight += one.weight;
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

/* ---- the stage: springls at a crease are found, and each is turned into its side ---- */

/* Finds the cells of a slot that have springls which lay at an edge before, as bits. */
SPRINGLS__MATHS void springls__edge_cells_element(const springls__model *model, springls__arguments args, int i)
{
    SPRINGLS__GLOBAL const uint32_t *cell = model->grid.cell + (size_t)i * SPRINGLS__CELLS;
    SPRINGLS__GLOBAL const uint8_t *before = springls__was_at_edge(model);
    SPRINGLS__GLOBAL uint32_t *edge_cells = springls__edge_cells(model) + 2 * (size_t)i;
    uint32_t k;
    int c;
    (void)args;
    edge_cells[0] = edge_cells[1] = 0u;
    if (i < SPRINGLS__FIRST_SLOT || model->grid.slot_brick[i] < 0) return;
    for (c = 0; c < 64; c++)
        for (k = cell[c]; k < cell[c + 1]; k++)
            if (before[model->cells.ids[k]]) edge_cells[c >> 5] |= 1u << (c & 31);
}

/* Notes the normal of springl i, and whether it lay at an edge before, if one that is awake may ask. */
SPRINGLS__MATHS void springls__edge_normal_element(const springls__model *model, springls__arguments args, int i)
{
    (void)args;
    springls__was_at_edge(model)[i] = 0;
    if (springls__is_listed_fast_asleep(model, i)) return;
    springls__side_normal(model)[i] = springls__springl_normal(model->set.s[i]);
    springls__was_at_edge(model)[i] = model->set.edge[i];
}

/* Returns true when a neighbor of springl i faces elsewhere: it may lie at a crease. */
SPRINGLS__MATHS bool springls__neighbor_turned(const springls__model *model, int i, float radius)
{
    const float turned = 0.77f; /* cosine of 40 degrees */
    SPRINGLS__GLOBAL const springls__v3 *normal = springls__side_normal(model);
    springls__v3 p = model->set.s[i].p;
    springls__cell_walk walk = springls__cell_walk_near(model, p, radius);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0) {
        float along = springls__dot(normal[i], normal[other]);
        if (along < turned && along > SPRINGLS__AWAY
            && springls__length2(springls__sub(p, model->set.s[other].p)) < radius * radius) return true;
    }
    return false;
}

/* Returns true when a springl near springl i lay at an edge before. */
SPRINGLS__MATHS bool springls__neighbor_at_edge(const springls__model *model, int i, float radius)
{
    SPRINGLS__GLOBAL const uint8_t *before = springls__was_at_edge(model);
    springls__v3 p = model->set.s[i].p;
    springls__cell_walk walk = springls__cell_walk_near(model, p, radius);
    while (springls__cell_walk_row(model, &walk)) {
        if (walk.slot >= 0) { /* leaves out a row none of whose cells has a springl that lay at an edge */
            uint32_t word = springls__edge_cells(model)[2 * walk.slot + (walk.first >> 5)];
            if (((word >> (walk.first & 31)) & ((2u << (walk.last - walk.first)) - 1u)) == 0u) continue;
        }
        for (; walk.next < walk.end; walk.next++) {
            uint32_t other = walk.ids[walk.next];
            if (before[other] && springls__length2(springls__sub(p, model->set.s[other].p)) < radius * radius) return true;
        }
    }
    return false;
}

/* Finds out whether springl i may lie at a crease: with args.edge.search when a neighbor faces elsewhere, else when one lay at an
   edge before. */
SPRINGLS__MATHS void springls__edge_candidate_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = 1.5f;
    bool candidate = false;
    if (!springls__is_asleep(model, i))
        candidate = args.edge.search ? springls__neighbor_turned(model, i, radius) : springls__neighbor_at_edge(model, i, radius);
    springls__edge_candidate(model)[i] = candidate;
}

/* Finds the normal of the side that springl i is on, if it lies at an edge. */
SPRINGLS__MATHS void springls__edge_side_element(const springls__model *model, springls__arguments args, int i)
{
    const float radius = 2.5f, near_weight = 0.7f; /* within a voxel */
    const float slack = 0.05f; /* voxel: springls that lay on a side and moved with it still lie on it */
    SPRINGLS__GLOBAL const uint8_t *before = springls__was_at_edge(model);
    springls__springl s;
    springls__sample_set samples;
    springls__fit_result fit;
    springls__sides sides;
    bool was_edge = false; /* then the sides need not be certain: the edge may have worn, or have new springls */
    int k;
    (void)args;
    if (springls__is_asleep(model, i)) return;
    model->set.edge[i] = 0;
    if (!springls__edge_candidate(model)[i]) return;
    s = model->set.s[i];
    springls__gather_samples(model, s.p, radius, model->set.count, &samples);
    for (k = 0; k < samples.count; k++) was_edge = was_edge || (samples.weight[k] > near_weight && before[samples.id[k]]);
    sides = springls__sample_set_sides(&samples, model->grid.metric, SPRINGLS__NARROW, !was_edge);
    if (sides.count < 2) return;
    fit = springls__side_at(&samples, &sides, s.p, springls__springl_normal(s), model->set.a[i], i,
                            SPRINGLS__CONVEX | SPRINGLS__CONCAVE, 2);
    if (!fit.ok || springls__length2(springls__sub(fit.point, s.p)) > slack * slack) return;
    model->set.edge[i] = 1;
    springls__side_normal(model)[i] = fit.normal;
}

/* Turns springl i, about its particle, into its side. */
SPRINGLS__MATHS void springls__edge_turn_element(const springls__model *model, springls__arguments args, int i)
{
    springls__springl s = model->set.s[i];
    springls__v3 n = springls__springl_normal(s), side = springls__side_normal(model)[i];
    int m;
    (void)args;
    if (!model->set.edge[i] || model->set.mask[i] || springls__is_asleep(model, i)) return;
    for (m = 0; m < 3; m++) s.q[m] = springls__add(s.p, springls__turn_to(springls__sub(s.q[m], s.p), n, side));
    model->set.s[i] = springls__springl_finished(s);
}

#endif
