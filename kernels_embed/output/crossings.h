/* crossings.h - springl contouring, the first half: where the surface that springls hold crosses the edges of the voxel grid.

   Hits: each springl's plane is intersected with the grid lines near its particle. Sides: along each line through a node (a voxel
   center) the cheapest sequence of in and out explains the hits; the three lines vote. Edges: the same search between two nodes whose
   sides are known finds runs of hits, and each run is a crossing. An edge may have several: so a sheet may be thinner than a voxel.

   The table has bricks of 8 x 8 x 8 nodes, those active in the grid and all around them, and each kernel writes its own brick only.
   Node (x, y, z) of a brick owns the edges, faces and the cell that begin there. */
#ifndef SPRINGLS__KERNEL_OUTPUT_CROSSINGS_H
#define SPRINGLS__KERNEL_OUTPUT_CROSSINGS_H

#include "../model/cell_list.h"
#include "../model/grid.h"
#include "../model/model.h"

/* Lengths in voxels and costs, found by experiment. */
#define SPRINGLS__HIT_RADIUS 1.6f       /* how far from its particle a springl is looked for; a large one: .7 beyond its radius */
#define SPRINGLS__LARGEST_HIT_RADIUS 2.5f
#define SPRINGLS__TRIM_RADIUS 1.6f
#define SPRINGLS__CREASE_COSINE 0.77f   /* of two normals: where it is less the springls are on two sides of a crease           */
#define SPRINGLS__OPPOSED_COSINE (-0.5f) /* less: on two sides of a sheet                                                       */
#define SPRINGLS__CROSSING_COST 0.45f   /* of a change of side that begins a run of hits                                        */
#define SPRINGLS__CHANGE_COST 1.5f      /* of one without hits                                                                  */
#define SPRINGLS__RUN_LENGTH 0.6f       /* hits of a run lie within it                                                          */
#define SPRINGLS__PHI_WEIGHT 0.1f       /* what the side of phi counts beside hits                                              */
#define SPRINGLS__LEAST_WEIGHT 0.02f    /* of a hit that places a crossing                                                      */
#define SPRINGLS__CROSSING_GAP (1.0f / 512.0f)
#define SPRINGLS__TRIM_GROUPS 6
#define SPRINGLS__TRIMS 96
#define SPRINGLS__LINE_HITS 256
#define SPRINGLS__LINE_EVENTS (SPRINGLS__LINE_HITS + 16)
#define SPRINGLS__EDGE_HITS 96
#define SPRINGLS__EDGE_CROSSINGS 6

/* Where a springl's plane meets a grid line. springl: its number, complemented where the line enters the body. */
typedef struct springls__hit { float t, own_weight, weight; int springl; } springls__hit;

/* Where the surface meets a grid edge. n: 0 where nothing is known but a change of side. side: 1 leaves the body along the axis, -1
   enters. springl: the one that counts most; -1: none. */
typedef struct springls__crossing { springls__v3 x, n; int side, springl; } springls__crossing;

/* A piece of the surface's section with a face, from a crossing that enters to one that leaves, as seen against the axis, over up to two
   corners; `rim` is the normal between two. */
typedef struct springls__arc { springls__v3 corner[2], rim; int from, to, corners; } springls__arc;

/* A brick of the table. around: the numbers of the 27 bricks around, -1: none. edge_end, face_end: [3 * node + axis], crossings and arcs up
   to there. */
typedef struct springls__surface_brick {
    int origin[3], around[27];
    uint32_t first_hit, line_begin[192], line_end[192]; /* hits of line (u & 7) + 8 (v & 7) + 64 axis */
    int first_crossing, first_arc, first_triangle, first_inner;   /* in the arrays of the contour */
    int triangles, inner, links, ready, hit, quiet; /* ready: 1 where kernels have nothing to do any more; hit: 1
                                                     where springls come; quiet: 1 where there are no hits around, either */
    uint32_t inside[16], beside_hits[16], conflict[16];           /* of nodes; of cells: triangles cross */
    int edge_end[1536], face_end[1536];
    uint8_t plain[512];  /* 1: the arcs of the cell's faces have no more corners than they need */
} springls__surface_brick;

typedef struct springls__contour {
    SPRINGLS__GLOBAL springls__surface_brick *brick;
    SPRINGLS__GLOBAL const springls__v3 *normal;     /* of springls                                */
    SPRINGLS__GLOBAL const uint8_t *creased;         /* of a springl: 1 beside others it is cut off by */
    SPRINGLS__GLOBAL springls__hit *hit;
    SPRINGLS__GLOBAL springls__crossing *crossing;
    SPRINGLS__GLOBAL springls__arc *arc;
    SPRINGLS__GLOBAL springls__crossing *inner;      /* vertices in cells                          */
    SPRINGLS__GLOBAL int *corners;                   /* three vertices a triangle: crossings, then two corners an arc, then `inner` */
    int first_corner, first_inner;                   /* numbers of those vertices                  */
} springls__contour;

/* ---- small helpers ---- */

SPRINGLS__INNER float springls__along(springls__v3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

SPRINGLS__INNER springls__v3 springls__with_along(springls__v3 v, int axis, float x)
{
    if (axis == 0) v.x = x;
    else if (axis == 1) v.y = x;
    else v.z = x;
    return v;
}

SPRINGLS__INNER springls__v3 springls__zero3(void) { return springls__v3_make(0.0f, 0.0f, 0.0f); }
SPRINGLS__INNER int springls__axis_after(int axis) { return axis == 2 ? 0 : axis + 1; }
SPRINGLS__INNER int springls__hit_springl(springls__hit hit) { return hit.springl < 0 ? ~hit.springl : hit.springl; }
SPRINGLS__INNER int springls__hit_side(springls__hit hit) { return hit.springl < 0 ? -1 : 1; }

/* Places are multiples of 2^-16 voxel, so that the tests of whether triangles cross are exact in whole numbers. */
SPRINGLS__INNER float springls__snapped(float x) { return springls__floor(x * 65536.0f + 0.5f) / 65536.0f; }

SPRINGLS__INNER springls__v3 springls__snapped3(springls__v3 x)
{
    return springls__v3_make(springls__snapped(x.x), springls__snapped(x.y), springls__snapped(x.z));
}

/* Returns (1 - d2 / r2)^4, 0 beyond r. */
SPRINGLS__INNER float springls__hit_weight(float d2, float r2)
{
    float w = springls__max(1.0f - d2 / r2, 0.0f);
    w *= w;
    return w * w;
}

SPRINGLS__INNER bool springls__bit_of(SPRINGLS__GLOBAL const uint32_t *bits, int k) { return (bits[k >> 5] >> (k & 31) & 1u) != 0u; }

/* Finds where node `node` is in its brick, and in the grid. */
SPRINGLS__INNER void springls__node_of_brick(int node, int at[3])
{
    at[0] = node & 7;
    at[1] = node >> 3 & 7;
    at[2] = node >> 6;
}

SPRINGLS__INNER void springls__place_of_node(SPRINGLS__GLOBAL const springls__surface_brick *brick, int node, int at[3])
{
    springls__node_of_brick(node, at);
    at[0] += brick->origin[0];
    at[1] += brick->origin[1];
    at[2] += brick->origin[2];
}

/* Finds the brick and the node in it of a node that is up to 8 beyond a brick's own; -1: the table has none. */
SPRINGLS__INNER int springls__table_node(SPRINGLS__GLOBAL const springls__surface_brick *brick, const int of_node[3], int *node)
{
    *node = springls__voxel_in_brick(of_node[0], of_node[1], of_node[2]);
    return brick->around[13 + (of_node[0] >> 3) + 3 * (of_node[1] >> 3) + 9 * (of_node[2] >> 3)];
}

/* Returns the node (u, v) beside axis, at x along it. */
SPRINGLS__INNER int springls__line_node(int axis, int x, int line)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    return (x << 3 * axis) + ((line & 7) << 3 * b) + ((line >> 3) << 3 * c);
}

/* ---- trims: planes of the springls across a crease ---- */

typedef struct springls__trim { springls__v3 p, n; int group; } springls__trim;

/* Trims in groups of like normals. */
typedef struct springls__trims {
    springls__trim list[SPRINGLS__TRIMS];
    springls__v3 seed[SPRINGLS__TRIM_GROUPS];
    int in_group[SPRINGLS__TRIM_GROUPS], count, groups;
} springls__trims;

/* Returns whether springl `other` lies across a crease from springl i. */
SPRINGLS__INNER bool springls__across_crease(const springls__model *model, SPRINGLS__GLOBAL const springls__v3 *normal, int i,
                                             int other)
{
    const float r = SPRINGLS__TRIM_RADIUS, cosine = springls__dot(normal[i], normal[other]);
    if (cosine > SPRINGLS__CREASE_COSINE || cosine < SPRINGLS__OPPOSED_COSINE) return false;
    return springls__length2(springls__sub(model->set.s[other].p, model->set.s[i].p)) <= r * r;
}

/* Returns whether any springl lies across a crease from springl i. */
SPRINGLS__MATHS bool springls__is_creased(const springls__model *model, SPRINGLS__GLOBAL const springls__v3 *normal, int i)
{
    springls__cell_walk walk = springls__cell_walk_near(model, model->set.s[i].p, SPRINGLS__TRIM_RADIUS);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__across_crease(model, normal, i, other)) return true;
    return false;
}

/* Finds what cuts springl i off: on a convex crease what lies before the others' planes, on a concave one what lies behind. */
SPRINGLS__NOINLINE void springls__find_trims(const springls__model *model, const springls__contour *contour, int i,
                                             springls__trims *trims)
{
    const springls__v3 p = model->set.s[i].p, n = contour->normal[i];
    springls__cell_walk walk = springls__cell_walk_near(model, p, SPRINGLS__TRIM_RADIUS);
    int other, g;
    trims->count = trims->groups = 0;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0 && trims->count < SPRINGLS__TRIMS) {
        springls__trim *trim = &trims->list[trims->count];
        springls__v3 d, m = contour->normal[other];
        if (!springls__across_crease(model, contour->normal, i, other)) continue;
        trim->p = model->set.s[other].p;
        d = springls__sub(trim->p, p);
        trim->n = springls__dot(d, n) - springls__dot(d, m) < 0.0f ? m : springls__scale(m, -1.0f);
        for (g = 0; g < trims->groups && springls__dot(trims->seed[g], m) <= 0.8f; g++) continue;
        if (g == trims->groups && g < SPRINGLS__TRIM_GROUPS) {
            trims->seed[trims->groups] = m;
            trims->in_group[trims->groups++] = 0;
        }
        trim->group = springls__imin(g, SPRINGLS__TRIM_GROUPS - 1);
        trims->in_group[trim->group]++;
        trims->count++;
    }
}

/* Returns whether over half of a group's weight cuts x off. A springl alone cuts nothing. */
SPRINGLS__MATHS bool springls__is_trimmed(const springls__trims *trims, springls__v3 x)
{
    const float r2 = SPRINGLS__TRIM_RADIUS * SPRINGLS__TRIM_RADIUS, tolerance = 0.03f;
    float beyond[SPRINGLS__TRIM_GROUPS], all[SPRINGLS__TRIM_GROUPS];
    int k;
    for (k = 0; k < SPRINGLS__TRIM_GROUPS; k++) beyond[k] = all[k] = 0.0f;
    for (k = 0; k < trims->count; k++) {
        const springls__v3 d = springls__sub(x, trims->list[k].p);
        const float w = 1.0f - springls__length2(d) / r2;
        const int g = trims->list[k].group;
        if (w <= 0.0f) continue;
        all[g] += w;
        if (springls__dot(d, trims->list[k].n) > tolerance) beyond[g] += w;
    }
    for (k = 0; k < trims->groups; k++)
        if (beyond[k] > 0.5f * all[k] && trims->in_group[k] > 1) return true;
    return false;
}

/* ---- hits ---- */

/* The part of a springl's plane that counts, seen along an axis: a plane over the other two, and which nodes of a brick lie under it. */
typedef struct springls__disc {
    springls__v3 p;
    float radius2, slope_b, slope_c, pb, pc, pa;
    int axis, lo[2], hi[2];
} springls__disc;

SPRINGLS__INNER float springls__hit_radius(float bounding_radius)
{
    return springls__min(springls__max(SPRINGLS__HIT_RADIUS, 0.7f + bounding_radius), SPRINGLS__LARGEST_HIT_RADIUS);
}

/* Finds the disc of a springl for the lines of a brick along an axis; false: no line meets it. */
SPRINGLS__MATHS bool springls__disc_of(const springls__model *model, SPRINGLS__GLOBAL const springls__surface_brick *brick, int i,
                                       springls__v3 n, int axis, springls__disc *disc)
{
    const int other[2] = { springls__axis_after(axis), springls__axis_after(springls__axis_after(axis)) };
    const float na = springls__along(n, axis), r = springls__hit_radius(model->set.s[i].bounding_radius);
    int k;
    if (springls__fabs(na) < 0.03f) return false;
    disc->p = model->set.s[i].p;
    disc->axis = axis;
    disc->radius2 = r * r;
    disc->pa = springls__along(disc->p, axis);
    disc->pb = springls__along(disc->p, other[0]);
    disc->pc = springls__along(disc->p, other[1]);
    disc->slope_b = -springls__along(n, other[0]) / na;
    disc->slope_c = -springls__along(n, other[1]) / na;
    for (k = 0; k < 2; k++) {
        const float nk = springls__along(n, other[k]), at = springls__along(disc->p, other[k]);
        const float reach = r * springls__sqrt(springls__max(1.0f - nk * nk, 0.0f));
        const float first = (float)springls__imax(brick->origin[other[k]], 0);
        const float last = (float)(springls__imin(brick->origin[other[k]] + 8, model->grid.size[other[k]]) - 1);
        if (at + reach < first || at - reach > last) return false;
        disc->lo[k] = -(int)springls__floor(-springls__max(at - reach, first));
        disc->hi[k] = (int)springls__floor(springls__min(at + reach, last));
    }
    return true;
}

/* Finds where a line meets the disc; false: nowhere. */
SPRINGLS__INNER bool springls__disc_meets(const springls__disc *disc, int u, int v, springls__hit *hit)
{
    const float db = (float)u - disc->pb, dc = (float)v - disc->pc, da = db * disc->slope_b + dc * disc->slope_c;
    const float d2 = da * da + db * db + dc * dc;
    if (d2 >= disc->radius2) return false;
    hit->t = disc->pa + da;
    hit->own_weight = hit->weight = springls__hit_weight(d2, disc->radius2);
    return true;
}

/* Puts a hit into its line, in order. */
SPRINGLS__MATHS void springls__put_hit(const springls__contour *contour, SPRINGLS__GLOBAL springls__surface_brick *brick, int line,
                                       springls__hit hit)
{
    SPRINGLS__GLOBAL springls__hit *all = contour->hit + brick->first_hit;
    uint32_t at = brick->line_end[line]++;
    for (; at > brick->line_begin[line] && all[at - 1].t > hit.t; at--) all[at] = all[at - 1];
    all[at] = hit;
}

/* Marks the nodes at both ends of the edge that has a hit, `at` nodes along a line of a brick. */
SPRINGLS__INNER void springls__mark_beside_hit(SPRINGLS__GLOBAL springls__surface_brick *brick, int line, int at)
{
    int end;
    for (end = at + 1; at <= end; at++)
        if (at >= 0 && at < 8) {
            const int node = springls__line_node(line >> 6, at, line & 63);
            brick->beside_hits[node >> 5] |= 1u << (node & 31);
        }
}

/* Finds the hits of springl i on the lines of a brick along an axis: counts them in line_end, or stores them. */
SPRINGLS__MATHS void springls__springl_hits(const springls__model *model, const springls__contour *contour, int b, int i, int axis,
                                            const springls__trims *trims, bool store)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    const springls__v3 n = contour->normal[i];
    const int beside = springls__axis_after(axis), across = springls__axis_after(beside);
    const float first = (float)springls__imax(brick->origin[axis] - 1, 0);
    const float own = (float)springls__imax(brick->origin[axis], 0);
    const float last = (float)springls__imin(brick->origin[axis] + 8, model->grid.size[axis] - 1);
    springls__disc disc;
    int u, v;
    if (!springls__disc_of(model, brick, i, n, axis, &disc)) return;
    for (v = disc.lo[1]; v <= disc.hi[1]; v++)
        for (u = disc.lo[0]; u <= disc.hi[0]; u++) {
            const int line = 64 * axis + (u & 7) + 8 * (v & 7);
            springls__hit hit;
            if (!springls__disc_meets(&disc, u, v, &hit) || hit.t < first || hit.t >= last) continue;
            brick->hit = 1;
            if (!store) {
                brick->line_end[line] += hit.t >= own;
                continue;
            }
            if (trims->count) {
                springls__v3 x = springls__with_along(springls__zero3(), axis, hit.t);
                x = springls__with_along(springls__with_along(x, beside, (float)u), across, (float)v);
                if (springls__is_trimmed(trims, x)) continue;
            }
            springls__mark_beside_hit(brick, line, (int)springls__floor(hit.t) - brick->origin[axis]);
            hit.springl = springls__along(n, axis) > 0.0f ? i : ~i;
            if (hit.t >= own) springls__put_hit(contour, brick, line, hit);
        }
}

/* Returns whether the disc of springl i may meet the lines of a brick, or those between the nodes before it and its own. */
SPRINGLS__INNER bool springls__comes_near(const springls__model *model, SPRINGLS__GLOBAL const springls__surface_brick *brick, int i)
{
    const springls__v3 p = model->set.s[i].p;
    const float r = springls__hit_radius(model->set.s[i].bounding_radius);
    int k;
    for (k = 0; k < 3; k++) {
        const float at = springls__along(p, k) - (float)brick->origin[k];
        if (at + r < -1.0f || at - r > 8.0f) return false;
    }
    return true;
}

/* Counts the hits on the lines of brick b, trimmed ones too, or stores them. Precondition: line_end is 0, or where each line begins. */
SPRINGLS__MATHS void springls__brick_hits(const springls__model *model, const springls__contour *contour, int b, bool store,
                                          springls__trims *trims)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    const springls__v3 first = springls__v3_make((float)brick->origin[0], (float)brick->origin[1], (float)brick->origin[2]);
    const float before = SPRINGLS__LARGEST_HIT_RADIUS + 1.0f, behind = SPRINGLS__LARGEST_HIT_RADIUS + 8.0f;
    springls__cell_walk walk;
    int i, axis;
    if (store && !brick->hit) return;
    walk = springls__cell_walk_begin(model, springls__v3_make(first.x - before, first.y - before, first.z - before),
                                     springls__v3_make(first.x + behind, first.y + behind, first.z + behind));
    while ((i = springls__cell_walk_next(model, &walk)) >= 0) {
        if (!springls__comes_near(model, brick, i) || springls__is_overlapped(model, i)) continue;
        trims->count = 0;
        if (store && contour->creased[i]) springls__find_trims(model, contour, i, trims);
        for (axis = 0; axis < 3; axis++) springls__springl_hits(model, contour, b, i, axis, trims, store);
    }
}

/* ---- lines ---- */

/* What is known along a line: a hit (side 1 or -1), or a node and what speaks against its being on a side. */
typedef struct springls__event { float t, cost[2]; int side, node; } springls__event;

/* Working memory of one brick. */
typedef struct springls__line_work {
    springls__hit hit[SPRINGLS__LINE_HITS];
    springls__event event[SPRINGLS__LINE_EVENTS];
    float forward[SPRINGLS__LINE_EVENTS][2], margin[512];
    int group[SPRINGLS__EDGE_HITS], path[SPRINGLS__EDGE_HITS][2];
    int hits, events, line, axis, begin[3]; /* begin: of each brick's hits; the second is the brick's own */
} springls__line_work;

/* Gathers the hits of a line in a brick and three voxels before and behind it, with their own weights or the last ones. Of too many the
   nearest are taken. */
SPRINGLS__MATHS void springls__gather_line(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                           int line, bool weighed, springls__line_work *work)
{
    const int axis = line >> 6, stride = axis == 0 ? 1 : axis == 1 ? 3 : 9;
    const float low = (float)brick->origin[axis] - 3.0f, high = low + 14.0f;
    float least = 0.0f;
    int k, all;
    do {
        work->hits = all = 0;
        for (k = 0; k < 3; k++) {
            const int b = brick->around[13 + (k - 1) * stride];
            SPRINGLS__GLOBAL const springls__surface_brick *other = contour->brick + b;
            uint32_t at;
            work->begin[k] = work->hits;
            if (b < 0) continue;
            for (at = other->line_begin[line]; at < other->line_end[line]; at++) {
                const springls__hit hit = contour->hit[other->first_hit + at];
                if (hit.t < low || hit.t >= high || hit.own_weight <= least) continue;
                if (all++ < SPRINGLS__LINE_HITS) {
                    work->hit[work->hits] = hit;
                    if (!weighed) work->hit[work->hits].weight = hit.own_weight;
                    work->hits++;
                }
            }
        }
        least = least > 0.0f ? 2.0f * least : 1e-3f;
    } while (all > SPRINGLS__LINE_HITS);
    work->line = line;
    work->axis = axis;
}

/* Returns the place at t along a line of a brick. */
SPRINGLS__INNER springls__v3 springls__line_place(SPRINGLS__GLOBAL const springls__surface_brick *brick, int line, float t)
{
    const int axis = line >> 6, b = springls__axis_after(axis), c = springls__axis_after(b);
    springls__v3 x = springls__with_along(springls__zero3(), axis, t);
    x = springls__with_along(x, b, (float)(brick->origin[b] + (line & 7)));
    return springls__with_along(x, c, (float)(brick->origin[c] + (line >> 3 & 7)));
}

/* Returns how much of hits [first, end) of one orientation counts: less where their particles lie all to one side, since the surface ends
   there. */
SPRINGLS__MATHS float springls__share_of_run(const springls__model *model, const springls__contour *contour,
                                             SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int end, int side,
                                             const springls__line_work *work)
{
    const float begins = 0.5f, over = 0.8f, r2 = SPRINGLS__HIT_RADIUS * SPRINGLS__HIT_RADIUS;
    springls__v3 x, aside = springls__zero3(), n = springls__zero3();
    float sum = 0.0f, t = 0.0f;
    int k;
    for (k = first; k < end; k++) {
        if (springls__hit_side(work->hit[k]) != side) continue;
        sum += work->hit[k].weight;
        t += work->hit[k].weight * work->hit[k].t;
    }
    x = springls__line_place(brick, work->line, t / (sum + 1e-9f));
    sum = 0.0f;
    for (k = first; k < end; k++) {
        const int i = springls__hit_springl(work->hit[k]);
        springls__v3 d;
        float w;
        if (springls__hit_side(work->hit[k]) != side) continue;
        d = springls__sub(model->set.s[i].p, x);
        w = springls__hit_weight(springls__length2(d), r2) + 1e-6f;
        aside = springls__mad(aside, d, w);
        n = springls__mad(n, contour->normal[i], w);
        sum += w;
    }
    aside = springls__scale(aside, 1.0f / sum);
    n = springls__normalize(n);
    aside = springls__mad(aside, n, -springls__dot(aside, n));
    return springls__clamp((over - springls__length(aside)) / (over - begins), 0.0f, 1.0f);
}

/* Weighs the hits of a gathered line, run by run of one orientation. */
SPRINGLS__MATHS void springls__weigh_line(const springls__model *model, const springls__contour *contour,
                                          SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                          springls__line_work *work)
{
    int side, first, k, end;
    for (side = -1; side <= 1; side += 2)
        for (first = 0; first < work->hits; first = end) {
            float t = work->hit[first].t, share;
            end = first + 1;
            if (springls__hit_side(work->hit[first]) != side) continue;
            for (; end < work->hits && work->hit[end].t - t < 0.5f; end++)
                if (springls__hit_side(work->hit[end]) == side) t = springls__max(t, work->hit[end].t - 0.25f);
            share = springls__share_of_run(model, contour, brick, first, end, side, work);
            if (share == 1.0f) continue;
            for (k = first; k < end; k++)
                if (springls__hit_side(work->hit[k]) == side) work->hit[k].weight *= share;
        }
}

/* ---- sides of nodes ---- */

/* The cheapest costs of being outside (0) and inside (1) at a place, and where the last crossing to each side was. */
typedef struct springls__side_path { float cost[2], since[2]; } springls__side_path;

SPRINGLS__INNER springls__side_path springls__side_path_begin(float outside, float inside)
{
    springls__side_path path;
    path.cost[0] = outside;
    path.cost[1] = inside;
    path.since[0] = path.since[1] = -1e9f;
    return path;
}

/* Goes on over a hit that leads to side `to`; weight: what it costs to leave it unexplained. came: from which side each is reached, and
   4 where the hit is explained. */
SPRINGLS__INNER springls__side_path springls__side_path_over_hit(springls__side_path path, float t, float weight, int to, int came[2])
{
    const int from = 1 - to;
    const bool in_run = springls__fabs(t - path.since[to]) <= SPRINGLS__RUN_LENGTH;
    springls__side_path next = path;
    next.cost[to] += in_run ? 0.0f : weight;
    next.cost[from] += weight;
    came[to] = to | (in_run ? 4 : 0);
    came[from] = from;
    if (path.cost[from] + SPRINGLS__CROSSING_COST < next.cost[to]) {
        next.cost[to] = path.cost[from] + SPRINGLS__CROSSING_COST;
        next.since[to] = t;
        came[to] = from | 4;
    }
    return next;
}

/* Goes on over a node, where the side may change without a hit. */
SPRINGLS__INNER springls__side_path springls__side_path_over_node(springls__side_path path, const float cost[2])
{
    springls__side_path next = path;
    int s;
    for (s = 0; s < 2; s++) {
        if (path.cost[1 - s] + SPRINGLS__CHANGE_COST < path.cost[s]) {
            next.cost[s] = path.cost[1 - s] + SPRINGLS__CHANGE_COST;
            next.since[s] = -1e9f;
        }
        next.cost[s] += cost[s];
    }
    return next;
}

SPRINGLS__INNER springls__side_path springls__side_path_over(springls__side_path path, const springls__event *event, bool forward)
{
    const float cost[2] = { event->cost[0], event->cost[1] };
    int came[2];
    if (event->side == 0) return springls__side_path_over_node(path, cost);
    return springls__side_path_over_hit(path, event->t, cost[0], (event->side < 0) == forward ? 1 : 0, came);
}

/* Returns what phi says about a node: below 0 inside. */
SPRINGLS__INNER float springls__phi_evidence(float phi, bool beside_hits)
{
    const float deep = springls__min(springls__fabs(phi), 1.0f);
    const float weight = !beside_hits ? 0.3f + 2.0f * deep : phi < 0.0f ? SPRINGLS__PHI_WEIGHT + deep : SPRINGLS__PHI_WEIGHT;
    return phi < 0.0f ? -weight : weight;
}

/* Lists hits [first, end) of the line and the nodes between and around them, in order. */
SPRINGLS__MATHS void springls__list_line_events(const springls__model *model, const springls__contour *contour,
                                           SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int end,
                                           springls__line_work *work)
{
    const springls__grid *g = &model->grid;
    const int axis = work->axis, o = brick->origin[axis], stride = axis == 0 ? 1 : axis == 1 ? 3 : 9;
    const int from = springls__imax((int)springls__floor(work->hit[first].t) - 1, springls__imax(o - 3, 0));
    const int to = springls__imin((int)springls__floor(work->hit[end - 1].t) + 2, springls__imin(o + 10, g->size[axis] - 1));
    const springls__v3 line = springls__line_place(brick, work->line, 0.0f);
    int at[3], x, n = 0, k = first;
    at[0] = (int)line.x;
    at[1] = (int)line.y;
    at[2] = (int)line.z;
    for (x = from; x <= to + 1; x++) {
        springls__event *event;
        float evidence;
        int b, node;
        for (; k < end && (x > to || work->hit[k].t < (float)x); k++) {
            event = &work->event[n++];
            event->t = work->hit[k].t;
            event->side = springls__hit_side(work->hit[k]);
            event->cost[0] = event->cost[1] = work->hit[k].weight;
            event->node = -1;
        }
        if (x > to) break;
        b = brick->around[13 + ((x - o) >> 3) * stride];
        node = springls__line_node(axis, x & 7, work->line & 63);
        at[axis] = x;
        evidence = springls__phi_evidence(springls__grid_phi(g, g->phi, at[0], at[1], at[2]),
                                          b >= 0 && springls__bit_of(contour->brick[b].beside_hits, node));
        event = &work->event[n++];
        event->t = (float)x;
        event->side = 0;
        event->cost[0] = springls__max(-evidence, 0.0f);
        event->cost[1] = springls__max(evidence, 0.0f);
        event->node = x >= o && x < o + 8 ? node : -1;
    }
    work->events = n;
}

/* Adds to each node of the events by how much cheaper it is to be outside than inside. */
SPRINGLS__MATHS void springls__vote_for_nodes(springls__line_work *work)
{
    springls__side_path path = springls__side_path_begin(0.0f, 0.0f);
    int k;
    for (k = 0; k < work->events; k++) {
        path = springls__side_path_over(path, &work->event[k], true);
        work->forward[k][0] = path.cost[0];
        work->forward[k][1] = path.cost[1];
    }
    path = springls__side_path_begin(0.0f, 0.0f);
    for (k = work->events - 1; k >= 0; k--) {
        const int node = work->event[k].node;
        if (node >= 0)
            work->margin[node] += springls__clamp(work->forward[k][1] + path.cost[1] - (work->forward[k][0] + path.cost[0]), -1.0f,
                                                  1.0f);
        path = springls__side_path_over(path, &work->event[k], false);
    }
}

/* Votes along a line for its nodes, in parts where hits are less than four voxels apart; keeps the weights of the brick's own hits. */
SPRINGLS__MATHS void springls__vote_on_line(const springls__model *model, const springls__contour *contour,
                                            SPRINGLS__GLOBAL const springls__surface_brick *brick, int line,
                                            springls__line_work *work)
{
    int first, end, k;
    uint32_t at;
    springls__gather_line(contour, brick, line, false, work);
    if (work->hits == 0) return;
    springls__weigh_line(model, contour, brick, work);
    for (first = 0; first < work->hits; first = end) {
        for (end = first + 1; end < work->hits && work->hit[end].t - work->hit[end - 1].t < 4.0f; end++) continue;
        springls__list_line_events(model, contour, brick, first, end, work);
        springls__vote_for_nodes(work);
    }
    at = brick->first_hit + brick->line_begin[line];
    for (k = work->begin[1]; k < work->begin[2]; k++) { /* in the same order; those left out of too many keep their own */
        while (contour->hit[at].t != work->hit[k].t || contour->hit[at].springl != work->hit[k].springl) at++;
        contour->hit[at].weight = work->hit[k].weight;
    }
}

/* Finds the sides of the nodes of brick b. */
SPRINGLS__MATHS void springls__find_node_sides(const springls__model *model, const springls__contour *contour, int b,
                                          springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    const springls__grid *g = &model->grid;
    int line, node, at[3];
    for (node = 0; node < 512; node++) work->margin[node] = 0.0f;
    for (line = 0; line < 192 && !brick->quiet; line++) springls__vote_on_line(model, contour, brick, line, work);
    for (node = 0; node < 16; node++) brick->inside[node] = 0u;
    for (node = 0; node < 512; node++) {
        float value;
        springls__place_of_node(brick, node, at);
        value = springls__grid_phi(g, g->phi, at[0], at[1], at[2]);
        if (springls__bit_of(brick->beside_hits, node)) value = work->margin[node] + springls__phi_evidence(value, true);
        if (value < 0.0f && springls__grid_contains(g, at[0], at[1], at[2])) brick->inside[node >> 5] |= 1u << (node & 31);
    }
}

/* ---- crossings of edges ---- */

/* Places a crossing among hits of one side of the surface, whose `group` is `which`: to second order, by the mean distance to their planes
   and particles. */
SPRINGLS__MATHS springls__crossing springls__place_crossing(const springls__model *model, const springls__contour *contour,
                                                            SPRINGLS__GLOBAL const springls__surface_brick *brick, int first,
                                                            int which, const springls__line_work *work)
{
    const float r2 = SPRINGLS__HIT_RADIUS * SPRINGLS__HIT_RADIUS;
    const int axis = work->axis;
    springls__crossing found;
    springls__v3 n = springls__zero3(), aside = springls__zero3();
    float sum = 0.0f, t = 0.0f, height = 0.0f, best = -1.0f, bend, along;
    int k;
    for (k = 0; first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++) {
        const springls__hit hit = work->hit[first + k];
        springls__v3 d;
        float w;
        if (work->group[k] != which) continue;
        d = springls__sub(springls__line_place(brick, work->line, hit.t), model->set.s[springls__hit_springl(hit)].p);
        w = hit.own_weight * (springls__hit_weight(springls__length2(d), r2) + 1e-4f);
        sum += w;
        t += w * hit.t;
    }
    found.x = springls__line_place(brick, work->line, t / sum);
    found.side = found.springl = 0;
    sum = 0.0f;
    for (k = 0; first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++) {
        const springls__hit hit = work->hit[first + k];
        const int i = springls__hit_springl(hit);
        springls__v3 d;
        float w;
        if (work->group[k] != which) continue;
        d = springls__sub(found.x, model->set.s[i].p);
        w = hit.own_weight * (springls__hit_weight(springls__length2(d), r2) + 1e-4f);
        sum += w;
        n = springls__mad(n, contour->normal[i], w);
        aside = springls__mad(aside, d, w);
        height += w * springls__dot(contour->normal[i], d);
        found.side = springls__hit_side(hit);
        if (w > best) {
            best = w;
            found.springl = i;
        }
    }
    bend = 1.0f - springls__length(n) / sum;
    found.n = springls__normalize(n);
    height = 0.5f * (springls__dot(found.n, aside) + height) / sum * (1.0f + 0.5f * bend);
    along = springls__along(found.n, axis);
    if (springls__fabs(along) > 0.1f)
        found.x = springls__with_along(found.x, axis, springls__along(found.x, axis) - springls__clamp(height / along, -0.3f, 0.3f));
    return found;
}

/* Places the crossing of a run, whose hits have its number as group. Where they are of the two sides of a crease the body is the
   intersection of the two, or their union. */
SPRINGLS__MATHS springls__crossing springls__place_run(const springls__model *model, const springls__contour *contour,
                                                       SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int run,
                                                       springls__line_work *work)
{
    const int second_side = SPRINGLS__EDGE_HITS + run;
    springls__crossing one, two;
    springls__v3 d;
    float one_t, two_t;
    bool convex, some = false;
    int k, best = -1;
    for (k = 0; first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++)
        if (work->group[k] == run && (best < 0 || work->hit[first + k].own_weight > work->hit[first + best].own_weight)) best = k;
    d = contour->normal[springls__hit_springl(work->hit[first + best])];
    for (k = 0; first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++) {
        if (work->group[k] != run) continue;
        if (springls__dot(contour->normal[springls__hit_springl(work->hit[first + k])], d) > SPRINGLS__CREASE_COSINE) continue;
        work->group[k] = second_side;
        some = true;
    }
    one = springls__place_crossing(model, contour, brick, first, run, work);
    if (!some) return one;
    two = springls__place_crossing(model, contour, brick, first, second_side, work);
    d = springls__sub(model->set.s[two.springl].p, model->set.s[one.springl].p);
    convex = springls__dot(d, one.n) - springls__dot(d, two.n) < 0.0f;
    one_t = springls__along(one.x, work->axis);
    two_t = springls__along(two.x, work->axis);
    return (two_t > one_t) == ((one.side < 0) == convex) ? two : one; /* into an intersection: at the later one */
}

/* Numbers the runs of hits that explain best how the line comes from one side to the other between nodes x and x + 1: work->group of the hits
   from `first` on; -1: of none. Returns how many there are. */
SPRINGLS__MATHS int springls__find_runs(int first, float x, int from, int to, springls__line_work *work)
{
    springls__side_path path = springls__side_path_begin(from ? 1e9f : 0.0f, from ? 0.0f : 1e9f);
    int n = 0, k, side = to, runs = 0, came[2];
    bool open = false;
    for (; first + n < work->hits && n < SPRINGLS__EDGE_HITS && work->hit[first + n].t <= x + 1.15f; n++) {
        const springls__hit hit = work->hit[first + n];
        work->group[n] = -1;
        work->path[n][0] = 0;
        work->path[n][1] = 1;
        if (hit.weight <= SPRINGLS__LEAST_WEIGHT) continue;
        path = springls__side_path_over_hit(path, hit.t, hit.t < x || hit.t > x + 1.0f ? 0.0f : hit.weight,
                                     springls__hit_side(hit) < 0 ? 1 : 0, came);
        work->path[n][0] = came[0];
        work->path[n][1] = came[1];
    }
    for (k = n; first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++) work->group[k] = -1;
    if (path.cost[to] > 1e8f) return 0;
    for (k = n - 1; k >= 0; k--) {
        const int before = work->path[k][side] & 3;
        if (work->path[k][side] & 4) {
            if (!open) runs++;
            work->group[k] = runs - 1;
            open = before == side;
        }
        side = before;
    }
    for (k = 0; k < n; k++) /* counted from the last: an edge's first runs are those that count, by pairs */
        if (work->group[k] >= 0) work->group[k] = runs - 1 - work->group[k];
    for (; runs > SPRINGLS__EDGE_CROSSINGS; runs -= 2) continue;
    return runs;
}

/* Makes a run of hits that weigh little: better than none, where the side changes. Returns 1 if there are any. */
SPRINGLS__MATHS int springls__find_weak_run(int first, float x, int side, springls__line_work *work)
{
    int k, best = -1;
    for (k = 0; first + k < work->hits && k < SPRINGLS__EDGE_HITS && work->hit[first + k].t <= x + 1.15f; k++)
        if (springls__hit_side(work->hit[first + k]) == side
            && (best < 0 || springls__fabs(work->hit[first + k].t - x - 0.5f) < springls__fabs(work->hit[first + best].t - x - 0.5f)))
            best = k;
    for (k = 0; best >= 0 && first + k < work->hits && k < SPRINGLS__EDGE_HITS; k++) {
        const bool with = springls__fabs(work->hit[first + k].t - work->hit[first + best].t) < 0.3f
                          && springls__hit_side(work->hit[first + k]) == side;
        work->group[k] = with ? 0 : -1;
    }
    return best >= 0;
}

/* Returns the crossing of an edge without hits: phi's zero, or the border of the domain halfway. */
SPRINGLS__MATHS springls__crossing springls__plain_crossing(const springls__grid *g, const int at[3], int axis, int side)
{
    springls__crossing found;
    int to[3], k;
    float a, b, t = 0.5f;
    for (k = 0; k < 3; k++) to[k] = at[k] + (k == axis);
    found.side = side;
    found.springl = -1;
    found.n = springls__zero3();
    a = springls__grid_phi(g, g->phi, at[0], at[1], at[2]);
    b = springls__grid_phi(g, g->phi, to[0], to[1], to[2]);
    if (at[axis] < 0 || to[axis] >= g->size[axis]) found.n = springls__with_along(found.n, axis, (float)side);
    else if ((a < 0.0f) != (b < 0.0f)) t = springls__clamp(a / (a - b), 0.001f, 0.999f);
    found.x = springls__v3_make((float)at[0], (float)at[1], (float)at[2]);
    found.x = springls__with_along(found.x, axis, (float)at[axis] + t);
    return found;
}

/* Puts crossings of the edge from x to x + 1 in order, apart and within it. */
SPRINGLS__MATHS void springls__order_crossings(SPRINGLS__GLOBAL springls__crossing *c, int count, int axis, float x)
{
    const float gap = SPRINGLS__CROSSING_GAP;
    float before = x;
    int k;
    for (k = 0; k < count; k++) {
        const float t = springls__clamp(springls__along(c[k].x, axis), before + gap, x + 1.0f - gap * (float)(count - k));
        before = springls__snapped(t);
        c[k].x = springls__with_along(c[k].x, axis, before);
    }
}

/* Finds the crossings of the edge that begins at node `at`, x along the gathered line; from, to: whether its ends are inside. Returns how
   many; writes them unless `out` is NULL. */
SPRINGLS__MATHS int springls__edge_crossings(const springls__model *model, const springls__contour *contour,
                                             SPRINGLS__GLOBAL const springls__surface_brick *brick, const int at[3], int first,
                                             int from, int to, springls__line_work *work,
                                             SPRINGLS__GLOBAL springls__crossing *out)
{
    const float x = (float)at[work->axis];
    int runs = springls__find_runs(first, x, from, to, work), k;
    if (runs == 0 && from != to) {
        runs = springls__find_weak_run(first, x, from ? 1 : -1, work);
        if (runs == 0 && out) out[0] = springls__plain_crossing(&model->grid, at, work->axis, from ? 1 : -1);
        if (runs == 0) return 1;
    }
    for (k = 0; out && k < runs; k++) out[k] = springls__place_run(model, contour, brick, first, k, work);
    if (out) springls__order_crossings(out, runs, work->axis, x);
    return runs;
}

/* Counts the crossings of the edges of a line of brick b, or writes them (`store`). */
SPRINGLS__MATHS void springls__line_crossings(const springls__model *model, const springls__contour *contour, int b, int line,
                                              bool store, springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    const int axis = line >> 6, stride = axis == 0 ? 1 : axis == 1 ? 3 : 9, next = brick->around[13 + stride];
    int x, first = 0, at[3];
    springls__gather_line(contour, brick, line, true, work);
    for (x = 0; x < 8; x++) {
        const int node = springls__line_node(axis, x, line & 63), after = springls__line_node(axis, (x + 1) & 7, line & 63);
        const int edge = 3 * node + axis, from = springls__bit_of(brick->inside, node);
        const float t = (float)(brick->origin[axis] + x);
        int to = from;
        if (x < 7) to = springls__bit_of(brick->inside, after);
        else if (next >= 0) to = springls__bit_of(contour->brick[next].inside, after);
        while (first < work->hits && work->hit[first].t < t - 0.15f) first++;
        if (from == to && (first == work->hits || work->hit[first].t > t + 1.15f)) continue;
        springls__place_of_node(brick, node, at);
        if (!store) {
            brick->edge_end[edge] = springls__edge_crossings(model, contour, brick, at, first, from, to, work, NULL);
        } else {
            const int begin = edge ? brick->edge_end[edge - 1] : 0;
            if (brick->edge_end[edge] > begin)
                springls__edge_crossings(model, contour, brick, at, first, from, to, work,
                                         contour->crossing + brick->first_crossing + begin);
        }
    }
}

/* Returns whether all nodes of brick b and of the next one along each axis are on one side. */
SPRINGLS__MATHS bool springls__is_one_sided(const springls__contour *contour, int b)
{
    const uint32_t side = contour->brick[b].inside[0];
    uint32_t other = 0u;
    int k, axis;
    for (axis = -1; axis < 3; axis++) {
        const int next = contour->brick[b].around[axis < 0 ? 13 : axis == 0 ? 14 : axis == 1 ? 16 : 22];
        for (k = 0; k < 16 && next >= 0; k++) other |= contour->brick[next].inside[k] ^ side;
    }
    return (side == 0u || side == 0xffffffffu) && other == 0u;
}

/* Counts the crossings of the edges of brick b, then sums the counts up; or writes the crossings (`store`). */
SPRINGLS__MATHS void springls__find_crossings(const springls__model *model, const springls__contour *contour, int b, bool store,
                                              springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    int k, sum = 0;
    if (store && brick->edge_end[1535] == 0) return;
    for (k = 0; k < 1536 && !store; k++) brick->edge_end[k] = 0;
    if (brick->quiet && springls__is_one_sided(contour, b)) return;
    for (k = 0; k < 192; k++) springls__line_crossings(model, contour, b, k, store, work);
    for (k = 0; k < 1536 && !store; k++) brick->edge_end[k] = sum += brick->edge_end[k];
}

#endif
