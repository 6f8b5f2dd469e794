/* crossings.h - springl contouring, the first half: where the surface that springls hold crosses the edges of the voxel grid.

   Hits: each springl's plane is intersected with the grid lines near its particle. Sides: along each line through a node (a voxel
   center) the cheapest sequence of in and out explains the hits; the three lines vote. Edges: the same search between two nodes whose
   sides are known finds runs of hits, and each run is a crossing. An edge may have several: so a sheet may be thinner than a voxel.

   The table has bricks of 8 x 8 x 8 nodes, those active in the grid and all around them, and each kernel writes its own brick only.
   Node (x, y, z) of a brick owns the edges, faces and the cell that begin there. Hits and crossings are stored by rows of eight edges
   along their axis, arcs by rows of eight faces along x. */
#ifndef SPRINGLS__KERNEL_OUTPUT_CROSSINGS_H
#define SPRINGLS__KERNEL_OUTPUT_CROSSINGS_H

#include "../model/cell_list.h"
#include "../model/grid.h"
#include "../model/model.h"

/* Lengths in voxels and costs, found by experiment. */
#define SPRINGLS__HIT_RADIUS 1.6f       /* how far from its particle a springl is looked for; a large one: .7 beyond its radius */
#define SPRINGLS__LARGEST_HIT_RADIUS 2.5f
#define SPRINGLS__HIT_SHARE 0.65f       /* of the squared radius: hits beyond it weigh less than .015, and are left out           */
#define SPRINGLS__TRIM_RADIUS 1.6f
#define SPRINGLS__CREASE_COSINE 0.77f   /* of two normals: where it is less the springls are on two sides of a crease           */
#define SPRINGLS__OPPOSED_COSINE (-0.5f) /* less: on two sides of a sheet                                                       */
#define SPRINGLS__CROSSING_COST 0.45f   /* of a change of side that begins a run of hits                                        */
#define SPRINGLS__CHANGE_COST 1.5f      /* of one without hits                                                                  */
#define SPRINGLS__RUN_LENGTH 0.6f       /* hits of a run lie within it                                                          */
#define SPRINGLS__PHI_WEIGHT 0.1f       /* what the side of phi counts beside hits                                              */
#define SPRINGLS__EDGE_MARGIN 0.15f     /* what hits beyond its ends an edge takes                                        */
#define SPRINGLS__LEAST_WEIGHT 0.02f    /* of a hit that places a crossing                                                      */
#define SPRINGLS__CROSSING_GAP (1.0f / 512.0f)
#define SPRINGLS__TRIM_GROUPS 6
#define SPRINGLS__TRIMS 96
#define SPRINGLS__LINE_HITS 256
#define SPRINGLS__LINE_EVENTS (SPRINGLS__LINE_HITS + 16)
#define SPRINGLS__EDGE_HITS 96
#define SPRINGLS__EDGE_CROSSINGS 6

/* A springl as a point with a normal. home: the brick of the table that it is in, -1: none; creased: 1 beside springls that cut it off. */
typedef struct springls__surfel { springls__v3 p, n; int home, creased; } springls__surfel;

/* Where a springl's plane meets a grid line. springl: its number, complemented where the line enters the body. */
typedef struct springls__hit { float t, own_weight, weight; int springl; } springls__hit;

/* A hit on a row: that is 192 times its brick, and the row there. */
typedef struct springls__row_hit { springls__hit hit; int row; } springls__row_hit;

/* Where the surface meets a grid edge. n: 0 if nothing is known but a change of side. side: 1 leaves the body along the axis, -1
   enters. springl: the one that counts most; -1: none. */
typedef struct springls__crossing { springls__v3 x, n; int side, springl; } springls__crossing;

/* A piece of the surface's section with a face, from a crossing that enters to one that leaves, as seen against the axis, over up to two
   corners; `rim` is the normal between two. */
typedef struct springls__arc { springls__v3 corner[2], rim; int from, to, corners; } springls__arc;

/* What a brick has in rows. */
#define SPRINGLS__OF_HITS 0
#define SPRINGLS__OF_CROSSINGS 1
#define SPRINGLS__OF_ARCS 2
#define SPRINGLS__TABLE_ROWS 192

/* A brick of the table. around: the numbers of the 27 bricks around, -1: none. Its edges are those of row (u & 7) + 8 (v & 7) + 64 axis, by
   8 row + place along the axis; its faces by 512 axis + node. */
typedef struct springls__surface_brick {
    int origin[3], around[27], slot;    /* slot: of the grid's brick there, -1 if not all of it is in the domain */
    int begin[3][SPRINGLS__TABLE_ROWS + 1];   /* where the hits, crossings and arcs of rows begin in the arrays of the contour */
    int first_triangle, first_inner;    /* in the arrays of the contour */
    int triangles, inner, links;
    int ready, quiet;                   /* ready: 1 where kernels have nothing to do any more; quiet: 1 if there are no hits around */
    uint32_t margin;                    /* beside a region, without cells: which of the bricks around are of that; else 0 */
    uint32_t inside[16], beside_hits[16], conflict[16]; /* of nodes; of cells: triangles cross                    */
    uint32_t enters[6], leaves[6];      /* of rows: they have hits that enter the body, that leave it                      */
    uint8_t crossings[1536], arcs[1536]; /* of edges and faces */
    uint8_t plain[512];                 /* 1: the arcs of the cell's faces have no more corners than they need      */
} springls__surface_brick;

typedef struct springls__contour {
    SPRINGLS__GLOBAL springls__surface_brick *brick;
    SPRINGLS__GLOBAL const springls__surfel *surfel; /* of springls                                */
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

/* Returns by how much the number of a direction to a brick around grows with a step along an axis. */
SPRINGLS__INNER int springls__direction_step(int axis) { return axis == 0 ? 1 : axis == 1 ? 3 : 9; }

/* Returns the brick before (-1) or after (1) a brick along an axis; -1: the table has none. */
SPRINGLS__INNER int springls__brick_beside(SPRINGLS__GLOBAL const springls__surface_brick *brick, int axis, int way)
{
    return brick->around[13 + way * springls__direction_step(axis)];
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
SPRINGLS__INNER bool springls__across_crease(SPRINGLS__GLOBAL const springls__surfel *surfel, int i, int other)
{
    const float r = SPRINGLS__TRIM_RADIUS, cosine = springls__dot(surfel[i].n, surfel[other].n);
    if (cosine > SPRINGLS__CREASE_COSINE || cosine < SPRINGLS__OPPOSED_COSINE) return false;
    return springls__length2(springls__sub(surfel[other].p, surfel[i].p)) <= r * r;
}

/* Returns whether any springl lies across a crease from springl i. */
SPRINGLS__MATHS bool springls__is_creased(const springls__model *model, SPRINGLS__GLOBAL const springls__surfel *surfel, int i)
{
    springls__cell_walk walk = springls__cell_walk_near(model, surfel[i].p, SPRINGLS__TRIM_RADIUS);
    int other;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__across_crease(surfel, i, other)) return true;
    return false;
}

/* Returns the cosine of half the angle of a crease, and a little more. */
SPRINGLS__INNER float springls__least_uncreased_cosine(void) { return springls__sqrt(0.5f + 0.5f * SPRINGLS__CREASE_COSINE) + 0.001f; }

/* Returns whether some springls near a box are perhaps across a crease from each other: false if all their normals, or the opposite
   ones, are within half the angle of a crease of one. */
SPRINGLS__MATHS bool springls__has_creases(const springls__model *model, SPRINGLS__GLOBAL const springls__surfel *surfel,
                                           springls__v3 lower, springls__v3 upper)
{
    const float r = SPRINGLS__TRIM_RADIUS, least = springls__least_uncreased_cosine();
    springls__cell_walk walk = springls__cell_walk_begin(model, springls__v3_make(lower.x - r, lower.y - r, lower.z - r),
                                                         springls__v3_make(upper.x + r, upper.y + r, upper.z + r));
    const int first = springls__cell_walk_next(model, &walk);
    int other;
    while (first >= 0 && (other = springls__cell_walk_next(model, &walk)) >= 0)
        if (springls__fabs(springls__dot(surfel[first].n, surfel[other].n)) < least) return true;
    return false;
}

/* Finds which springls of a brick of the grid are creased, by its eighths. */
SPRINGLS__MATHS void springls__find_creased(const springls__model *model, SPRINGLS__GLOBAL springls__surfel *surfel, int slot)
{
    SPRINGLS__GLOBAL const uint32_t *cell = springls__cells_of(&model->grid, slot);
    const float width = 4.0f;
    int o[3], eighth, row, k;
    uint32_t at;
    springls__slot_origin(&model->grid, slot, o);
    for (eighth = 0; eighth < 8; eighth++) {
        const int x = eighth & 1, y = eighth >> 1 & 1, z = eighth >> 2;
        const springls__v3 lower = springls__v3_make((float)(o[0] + 4 * x), (float)(o[1] + 4 * y), (float)(o[2] + 4 * z));
        const springls__v3 upper = springls__v3_make(lower.x + width, lower.y + width, lower.z + width);
        int creased = -1; /* not known yet */
        for (row = 0; row < 4; row++) {
            const int first = 2 * x + 4 * (2 * y + (row & 1)) + 16 * (2 * z + (row >> 1));
            for (at = cell[first]; at < cell[first + 2]; at++) {
                k = (int)model->cells.ids[at];
                if (creased < 0) creased = springls__has_creases(model, surfel, lower, upper);
                surfel[k].creased = creased && springls__is_creased(model, surfel, k);
            }
        }
    }
}

/* Finds the planes that cut springl i off at a crease. A convex crease removes what lies in front of the other side's planes, a concave
   crease what lies behind them. */
SPRINGLS__NOINLINE void springls__find_trims(const springls__model *model, const springls__contour *contour, int i,
                                             springls__trims *trims)
{
    const springls__v3 p = contour->surfel[i].p, n = contour->surfel[i].n;
    springls__cell_walk walk = springls__cell_walk_near(model, p, SPRINGLS__TRIM_RADIUS);
    int other, g;
    trims->count = trims->groups = 0;
    while ((other = springls__cell_walk_next(model, &walk)) >= 0 && trims->count < SPRINGLS__TRIMS) {
        springls__trim *trim = &trims->list[trims->count];
        springls__v3 d, m = contour->surfel[other].n;
        if (!springls__across_crease(contour->surfel, i, other)) continue;
        trim->p = contour->surfel[other].p;
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

/* The part of a springl's plane that counts, seen along an axis: a plane over the other two, and which nodes of the grid lie under it. */
typedef struct springls__disc {
    float radius2, slope_b, slope_c, pb, pc, pa;
    int lo[2], hi[2];
} springls__disc;

SPRINGLS__INNER float springls__hit_radius(float bounding_radius)
{
    return springls__min(springls__max(SPRINGLS__HIT_RADIUS, 0.7f + bounding_radius), SPRINGLS__LARGEST_HIT_RADIUS);
}

/* Finds the disc of a springl for the lines along an axis; false: no line meets it. */
SPRINGLS__MATHS bool springls__disc_of(const springls__grid *g, springls__v3 p, springls__v3 n, float radius, int axis,
                                       springls__disc *disc)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    const float na = springls__along(n, axis), nb = springls__along(n, b), nc = springls__along(n, c);
    const float r = radius * springls__sqrt(SPRINGLS__HIT_SHARE);
    float reach;
    if (springls__fabs(na) < 0.03f) return false;
    disc->radius2 = radius * radius;
    disc->pa = springls__along(p, axis);
    disc->pb = springls__along(p, b);
    disc->pc = springls__along(p, c);
    disc->slope_b = -nb / na;
    disc->slope_c = -nc / na;
    reach = r * springls__sqrt(springls__max(1.0f - nb * nb, 0.0f));
    disc->lo[0] = -(int)springls__floor(-springls__max(disc->pb - reach, 0.0f));
    disc->hi[0] = (int)springls__floor(springls__clamp(disc->pb + reach, -1.0f, (float)(g->size[b] - 1)));
    reach = r * springls__sqrt(springls__max(1.0f - nc * nc, 0.0f));
    disc->lo[1] = -(int)springls__floor(-springls__max(disc->pc - reach, 0.0f));
    disc->hi[1] = (int)springls__floor(springls__clamp(disc->pc + reach, -1.0f, (float)(g->size[c] - 1)));
    return true;
}

/* Finds where a line meets the disc; false: nowhere. */
SPRINGLS__INNER bool springls__disc_meets(const springls__disc *disc, int u, int v, springls__hit *hit)
{
    const float db = (float)u - disc->pb, dc = (float)v - disc->pc, da = db * disc->slope_b + dc * disc->slope_c;
    const float d2 = da * da + db * db + dc * dc;
    if (d2 >= SPRINGLS__HIT_SHARE * disc->radius2) return false;
    hit->t = disc->pa + da;
    hit->own_weight = hit->weight = springls__hit_weight(d2, disc->radius2);
    return true;
}

/* Returns the row of the brick that a hit lies in, given the brick of its springl; -1: the table has none. */
SPRINGLS__MATHS int springls__row_of_hit(SPRINGLS__GLOBAL const springls__surface_brick *home, int axis, float t, int u, int v)
{
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    int at[3], node, brick;
    at[axis] = (int)springls__floor(t) - home->origin[axis];
    at[b] = u - home->origin[b];
    at[c] = v - home->origin[c];
    brick = springls__table_node(home, at, &node);
    return brick < 0 ? -1 : brick * SPRINGLS__TABLE_ROWS + 64 * axis + (u & 7) + 8 * (v & 7);
}

/* Returns whether springl i has hits in the table. */
SPRINGLS__INNER bool springls__may_hit(const springls__model *model, const springls__contour *contour, int i)
{
    return contour->surfel[i].home >= 0 && !springls__is_overlapped(model, i);
}

/* Returns how many hits springl i has at most: a line along each axis through every node under its discs. */
SPRINGLS__MATHS int springls__most_hits(const springls__model *model, const springls__contour *contour, int i)
{
    const float radius = springls__hit_radius(model->set.s[i].bounding_radius);
    springls__disc disc;
    int axis, n = 0;
    if (!springls__may_hit(model, contour, i)) return 0;
    for (axis = 0; axis < 3; axis++)
        if (springls__disc_of(&model->grid, contour->surfel[i].p, contour->surfel[i].n, radius, axis, &disc))
            n += springls__imax(disc.hi[0] - disc.lo[0] + 1, 0) * springls__imax(disc.hi[1] - disc.lo[1] + 1, 0);
    return n;
}

/* Finds the hits of springl i on lines along an axis, but those that are trimmed. Returns how many; out: where they go. */
SPRINGLS__MATHS int springls__disc_hits(const springls__model *model, const springls__contour *contour, int i, int axis,
                                        const springls__trims *trims, SPRINGLS__GLOBAL springls__row_hit *out)
{
    const springls__surfel s = contour->surfel[i];
    const int b = springls__axis_after(axis), c = springls__axis_after(b);
    const float last = (float)(model->grid.size[axis] - 1);
    springls__disc disc;
    int u, v, n = 0;
    if (!springls__disc_of(&model->grid, s.p, s.n, springls__hit_radius(model->set.s[i].bounding_radius), axis, &disc)) return 0;
    for (v = disc.lo[1]; v <= disc.hi[1]; v++)
        for (u = disc.lo[0]; u <= disc.hi[0]; u++) {
            springls__row_hit found;
            springls__v3 x;
            if (!springls__disc_meets(&disc, u, v, &found.hit) || found.hit.t < 0.0f || found.hit.t >= last) continue;
            x = springls__with_along(springls__zero3(), axis, found.hit.t);
            x = springls__with_along(springls__with_along(x, b, (float)u), c, (float)v);
            if (trims->count && springls__is_trimmed(trims, x)) continue;
            found.row = springls__row_of_hit(contour->brick + s.home, axis, found.hit.t, u, v);
            if (found.row < 0) continue;
            found.hit.springl = springls__along(s.n, axis) > 0.0f ? i : ~i;
            out[n++] = found;
        }
    return n;
}

/* Finds the hits of springl i: see springls__disc_hits. */
SPRINGLS__MATHS int springls__springl_hits(const springls__model *model, const springls__contour *contour, int i,
                                           springls__trims *trims, SPRINGLS__GLOBAL springls__row_hit *out)
{
    int axis, n = 0;
    if (!springls__may_hit(model, contour, i)) return 0;
    trims->count = 0;
    if (contour->surfel[i].creased) springls__find_trims(model, contour, i, trims);
    for (axis = 0; axis < 3; axis++) n += springls__disc_hits(model, contour, i, axis, trims, out + n);
    return n;
}

/* Puts a hit into its row: begin[row + 1] is where the row's next hit goes. */
SPRINGLS__MATHS void springls__put_hit(const springls__contour *contour, springls__row_hit found)
{
    const int row = found.row % SPRINGLS__TABLE_ROWS;
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + found.row / SPRINGLS__TABLE_ROWS;
    contour->hit[brick->begin[SPRINGLS__OF_HITS][row + 1]++] = found.hit;
}

SPRINGLS__INNER bool springls__is_behind(springls__hit one, springls__hit other)
{
    return one.t > other.t || (one.t == other.t && springls__hit_springl(one) > springls__hit_springl(other));
}

/* Sorts the hits of each row of brick b, and marks the rows that they enter and leave on. */
SPRINGLS__MATHS void springls__sort_hits(const springls__contour *contour, int b)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    SPRINGLS__GLOBAL const int *begin = brick->begin[SPRINGLS__OF_HITS];
    int row, k;
    for (k = 0; k < SPRINGLS__TABLE_ROWS / 32; k++) brick->enters[k] = brick->leaves[k] = 0u;
    for (row = 0; row < SPRINGLS__TABLE_ROWS; row++)
        for (k = begin[row]; k < begin[row + 1]; k++) {
            const springls__hit hit = contour->hit[k];
            int at = k;
            for (; at > begin[row] && springls__is_behind(contour->hit[at - 1], hit); at--) contour->hit[at] = contour->hit[at - 1];
            contour->hit[at] = hit;
            if (hit.springl < 0) brick->enters[row >> 5] |= 1u << (row & 31);
            else brick->leaves[row >> 5] |= 1u << (row & 31);
        }
}

/* ---- lines ---- */

/* What is known along a line: a hit (side 1 or -1) and its weight, or a node and what speaks against its being inside; node: -1 for one of
   another brick. */
typedef struct springls__event { float t, cost; int side, node; } springls__event;

/* Working memory of one brick. */
typedef struct springls__line_work {
    springls__hit hit[SPRINGLS__LINE_HITS];
    springls__event event[SPRINGLS__LINE_EVENTS];
    float forward[SPRINGLS__LINE_EVENTS][2], margin[512];
    int group[SPRINGLS__EDGE_HITS], came[SPRINGLS__EDGE_HITS];
    int hits, events, line, axis, begin[3]; /* begin: of each brick's hits; those from begin[1] to begin[2] are the brick's own */
} springls__line_work;

SPRINGLS__INNER bool springls__has_hits(const springls__contour *contour, int b, int line)
{
    return b >= 0 && contour->brick[b].begin[SPRINGLS__OF_HITS][line] != contour->brick[b].begin[SPRINGLS__OF_HITS][line + 1];
}

/* Returns whether brick b of the table has hits, crossings or arcs in rows [first, end). */
SPRINGLS__INNER bool springls__has_some(const springls__contour *contour, int b, int of, int first, int end)
{
    return b >= 0 && contour->brick[b].begin[of][first] != contour->brick[b].begin[of][end];
}

/* Returns whether the lowest nodes of a brick, along some axes, are those of cells of the region. */
SPRINGLS__INNER bool springls__has_shared_nodes(SPRINGLS__GLOBAL const springls__surface_brick *brick)
{
    return brick->margin == 0u || (brick->margin & 0x161bu) != 0u; /* the seven bricks before it, along all three axes or fewer */
}

/* Returns whether the brick before (-1) or after (1) one of a margin is of the region. */
SPRINGLS__INNER bool springls__is_beside_region(SPRINGLS__GLOBAL const springls__surface_brick *brick, int axis, int way)
{
    return (brick->margin >> (13 + way * springls__direction_step(axis)) & 1u) != 0u;
}

/* Returns whether cells of the region have edges of a row. */
SPRINGLS__INNER bool springls__is_shared_row(SPRINGLS__GLOBAL const springls__surface_brick *brick, int row)
{
    return brick->margin == 0u || (springls__has_shared_nodes(brick) && ((row & 7) == 0 || (row & 56) == 0));
}

/* Returns whether cells of the region have edges of a row, or of the one before or after it along its axis. */
SPRINGLS__MATHS bool springls__is_beside_shared_row(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                                    int row)
{
    int way;
    for (way = -1; way < 2; way++) {
        const int b = springls__brick_beside(brick, row >> 6, way);
        if (b >= 0 && springls__is_shared_row(contour->brick + b, row)) return true;
    }
    return false;
}

/* Returns whether a brick, or the ones before and after it along an axis, have hits on lines along it. */
SPRINGLS__INNER bool springls__has_hits_along(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                              int axis)
{
    int k;
    for (k = -1; k < 2; k++)
        if (springls__has_some(contour, springls__brick_beside(brick, axis, k), SPRINGLS__OF_HITS, 64 * axis, 64 * axis + 64)) return true;
    return false;
}

/* Gathers the hits of a line in a brick and three voxels before and behind it, with their own weights or the last ones. Of too many the
   nearest are taken. */
SPRINGLS__MATHS void springls__gather_line(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                           int line, bool weighed, springls__line_work *work)
{
    const int axis = line >> 6;
    const float low = (float)brick->origin[axis] - 3.0f, high = low + 14.0f;
    float least = 0.0f;
    int k, all;
    work->line = line;
    work->axis = axis;
    do {
        work->hits = all = 0;
        for (k = 0; k < 3; k++) {
            const int b = springls__brick_beside(brick, axis, k - 1);
            int at, end;
            work->begin[k] = work->hits;
            if (!springls__has_hits(contour, b, line)) continue;
            end = contour->brick[b].begin[SPRINGLS__OF_HITS][line + 1];
            for (at = contour->brick[b].begin[SPRINGLS__OF_HITS][line]; at < end; at++) {
                SPRINGLS__GLOBAL const springls__hit *hit = contour->hit + at;
                /* springls__weigh_hits of a brick beside may be writing `weight` */
                SPRINGLS__GLOBAL const float *weight = weighed ? &hit->weight : &hit->own_weight;
                if (hit->t < low || hit->t >= high || hit->own_weight <= least) continue;
                if (all++ < SPRINGLS__LINE_HITS) {
                    work->hit[work->hits].t = hit->t;
                    work->hit[work->hits].own_weight = hit->own_weight;
                    work->hit[work->hits].springl = hit->springl;
                    work->hit[work->hits++].weight = *weight;
                }
            }
        }
        least = least > 0.0f ? 2.0f * least : 1e-3f;
    } while (all > SPRINGLS__LINE_HITS);
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
SPRINGLS__MATHS float springls__share_of_run(const springls__contour *contour,
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
        d = springls__sub(contour->surfel[i].p, x);
        w = springls__hit_weight(springls__length2(d), r2) + 1e-6f;
        aside = springls__mad(aside, d, w);
        n = springls__mad(n, contour->surfel[i].n, w);
        sum += w;
    }
    aside = springls__scale(aside, 1.0f / sum);
    n = springls__normalize(n);
    aside = springls__mad(aside, n, -springls__dot(aside, n));
    return springls__clamp((over - springls__length(aside)) / (over - begins), 0.0f, 1.0f);
}

/* Weighs the hits of a gathered line, run by run of one orientation with some of the brick's own. */
SPRINGLS__MATHS void springls__weigh_runs(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
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
            if (end <= work->begin[1] || first >= work->begin[2]) continue;
            share = springls__share_of_run(contour, brick, first, end, side, work);
            if (share == 1.0f) continue;
            for (k = first; k < end; k++)
                if (springls__hit_side(work->hit[k]) == side) work->hit[k].weight *= share;
        }
}

/* Marks the nodes of a row at the ends of edges with hits. */
SPRINGLS__MATHS void springls__mark_beside_hits(const springls__contour *contour, SPRINGLS__GLOBAL springls__surface_brick *brick, int row)
{
    const int axis = row >> 6, before = springls__brick_beside(brick, axis, -1), end = brick->begin[SPRINGLS__OF_HITS][row + 1];
    uint32_t edges = 0u;
    int k;
    for (k = brick->begin[SPRINGLS__OF_HITS][row]; k < end; k++)
        edges |= 2u << ((int)springls__floor(contour->hit[k].t) - brick->origin[axis]);
    if (springls__has_hits(contour, before, row)
        && contour->hit[contour->brick[before].begin[SPRINGLS__OF_HITS][row + 1] - 1].t >= (float)brick->origin[axis] - 1.0f) edges |= 1u;
    edges |= edges >> 1; /* of the edge before a node, and of its own */
    for (k = 0; k < 8; k++)
        if (edges >> k & 1u) {
            const int node = springls__line_node(axis, k, row & 63);
            brick->beside_hits[node >> 5] |= 1u << (node & 31);
        }
}

/* Weighs the hits of brick b, and marks the nodes beside them. Precondition: all are sorted. */
SPRINGLS__MATHS void springls__weigh_hits(const springls__contour *contour, int b, springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    SPRINGLS__GLOBAL const int *begin = brick->begin[SPRINGLS__OF_HITS];
    int row, at, k;
    for (row = 0; row < SPRINGLS__TABLE_ROWS && !brick->quiet; row++) {
        const bool some = springls__has_hits(contour, b, row);
        if ((row & 63) == 0 && !springls__has_hits_along(contour, brick, row >> 6)) {
            row += 63;
            continue;
        }
        if (some || springls__has_hits(contour, springls__brick_beside(brick, row >> 6, -1), row))
            springls__mark_beside_hits(contour, brick, row);
        if (!some || !springls__is_beside_shared_row(contour, brick, row)) continue;
        springls__gather_line(contour, brick, row, false, work);
        springls__weigh_runs(contour, brick, work);
        for (k = work->begin[1], at = begin[row]; k < work->begin[2]; k++, at++) { /* those left out of too many keep their own */
            while (contour->hit[at].t != work->hit[k].t || contour->hit[at].springl != work->hit[k].springl) at++;
            contour->hit[at].weight = work->hit[k].weight;
        }
    }
}

/* ---- sides of nodes ---- */

/* The cheapest costs of being outside and inside at a place, and where the last crossing to each side was. */
typedef struct springls__side_path { float outside, inside, left, entered; } springls__side_path;

SPRINGLS__INNER springls__side_path springls__side_path_begin(float outside, float inside)
{
    springls__side_path path;
    path.outside = outside;
    path.inside = inside;
    path.left = path.entered = -1e9f;
    return path;
}

/* The cost of the side that a hit leads to, where the last crossing there was, and how it is reached: 1 from that side itself, 5 in a run,
   4 by crossing here. */
typedef struct springls__side_reached { float cost, since; int came; } springls__side_reached;

SPRINGLS__INNER springls__side_reached springls__reach_side(float from, float to, float since, float t, float weight)
{
    springls__side_reached next;
    const bool in_run = springls__fabs(t - since) <= SPRINGLS__RUN_LENGTH;
    next.cost = in_run ? to : to + weight;
    next.since = since;
    next.came = in_run ? 5 : 1;
    if (from + SPRINGLS__CROSSING_COST < next.cost) {
        next.cost = from + SPRINGLS__CROSSING_COST;
        next.since = t;
        next.came = 4;
    }
    return next;
}

/* Goes on over a hit that enters or leaves; weight: what it costs to leave it unexplained. came: how the side that it leads to is
   reached. */
SPRINGLS__INNER springls__side_path springls__side_path_over_hit(springls__side_path path, float t, float weight, bool enters, int *came)
{
    const springls__side_reached next = enters ? springls__reach_side(path.outside, path.inside, path.entered, t, weight)
                                               : springls__reach_side(path.inside, path.outside, path.left, t, weight);
    *came = next.came;
    if (enters) {
        path.inside = next.cost;
        path.entered = next.since;
        path.outside += weight;
    } else {
        path.outside = next.cost;
        path.left = next.since;
        path.inside += weight;
    }
    return path;
}

/* Goes on over a node, where the side may change without a hit; evidence: what speaks against inside, or below 0 against outside. */
SPRINGLS__INNER springls__side_path springls__side_path_over_node(springls__side_path path, float evidence)
{
    springls__side_path next = path;
    if (path.inside + SPRINGLS__CHANGE_COST < path.outside) {
        next.outside = path.inside + SPRINGLS__CHANGE_COST;
        next.left = -1e9f;
    }
    if (path.outside + SPRINGLS__CHANGE_COST < path.inside) {
        next.inside = path.outside + SPRINGLS__CHANGE_COST;
        next.entered = -1e9f;
    }
    next.outside += springls__max(-evidence, 0.0f);
    next.inside += springls__max(evidence, 0.0f);
    return next;
}

SPRINGLS__INNER springls__side_path springls__side_path_over(springls__side_path path, springls__event event, bool forward)
{
    int came;
    if (event.side == 0) return springls__side_path_over_node(path, event.cost);
    return springls__side_path_over_hit(path, event.t, event.cost, (event.side < 0) == forward, &came);
}

/* Weighs phi at a node as evidence of its side: below 0 inside; less beside hits, where nodes on the surface are inside. */
SPRINGLS__INNER float springls__phi_evidence(float phi, bool beside_hits)
{
    const float deep = springls__min(springls__fabs(phi), 1.0f);
    if (!beside_hits) return phi < 0.0f ? -0.3f - 2.0f * deep : 0.3f + 2.0f * deep;
    return phi < 0.0f ? -SPRINGLS__PHI_WEIGHT - deep : phi < SPRINGLS__CROSSING_GAP ? -SPRINGLS__PHI_WEIGHT : SPRINGLS__PHI_WEIGHT;
}

/* Returns phi at a node of a brick of the table. */
SPRINGLS__INNER float springls__node_phi(const springls__grid *g, SPRINGLS__GLOBAL const springls__surface_brick *brick, int node)
{
    int at[3];
    if (brick->slot >= 0) return g->phi[(size_t)brick->slot * SPRINGLS__BRICK_VOXELS + (size_t)node];
    springls__place_of_node(brick, node, at);
    return springls__grid_phi(g, g->phi, at[0], at[1], at[2]);
}

/* Returns the evidence of phi at a node of brick b, which the table may not have: the node is outside then. */
SPRINGLS__INNER float springls__node_evidence(const springls__grid *g, const springls__contour *contour, int b, int node)
{
    SPRINGLS__GLOBAL const springls__surface_brick *brick = contour->brick + b;
    if (b < 0) return springls__phi_evidence(1.0f, false);
    return springls__phi_evidence(springls__node_phi(g, brick, node), springls__bit_of(brick->beside_hits, node));
}

/* Returns whether a hit comes before the node at x of its line. Of a node on the surface any hit may say either: it is inside. */
SPRINGLS__INNER bool springls__is_before_node(springls__hit hit, float x)
{
    return hit.t < (springls__hit_side(hit) < 0 ? x + SPRINGLS__CROSSING_GAP : x - SPRINGLS__CROSSING_GAP);
}

/* Lists hits [first, end) of the line and the nodes between and around them, in order. */
SPRINGLS__MATHS void springls__list_line_events(const springls__model *model, const springls__contour *contour,
                                           SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int end,
                                           springls__line_work *work)
{
    const springls__grid *g = &model->grid;
    const int axis = work->axis, o = brick->origin[axis];
    const int from = springls__imax((int)springls__floor(work->hit[first].t) - 1, springls__imax(o - 3, 0));
    const int to = springls__imin((int)springls__floor(work->hit[end - 1].t) + 2, springls__imin(o + 10, g->size[axis] - 1));
    int x, n = 0, k = first;
    for (x = from; x <= to + 1; x++) {
        springls__event event;
        for (; k < end && (x > to || springls__is_before_node(work->hit[k], (float)x)); k++) {
            event.t = work->hit[k].t;
            event.side = springls__hit_side(work->hit[k]);
            event.cost = work->hit[k].weight;
            event.node = -1;
            work->event[n++] = event;
        }
        if (x > to) break;
        event.node = springls__line_node(axis, x & 7, work->line & 63);
        event.t = (float)x;
        event.side = 0;
        event.cost = springls__node_evidence(g, contour, springls__brick_beside(brick, axis, (x - o) >> 3), event.node);
        if (x < o || x >= o + 8) event.node = -1;
        work->event[n++] = event;
    }
    work->events = n;
}

/* Adds to each node of the events by how much cheaper it is to be outside than inside. */
SPRINGLS__MATHS void springls__vote_for_nodes(springls__line_work *work)
{
    springls__side_path path = springls__side_path_begin(0.0f, 0.0f);
    int k;
    for (k = 0; k < work->events; k++) {
        path = springls__side_path_over(path, work->event[k], true);
        if (work->event[k].node < 0) continue;
        work->forward[k][0] = path.outside;
        work->forward[k][1] = path.inside;
    }
    path = springls__side_path_begin(0.0f, 0.0f);
    for (k = work->events - 1; k >= 0; k--) {
        const int node = work->event[k].node;
        if (node >= 0)
            work->margin[node] += springls__clamp(work->forward[k][1] + path.inside - (work->forward[k][0] + path.outside), -1.0f, 1.0f);
        path = springls__side_path_over(path, work->event[k], false);
    }
}

/* Votes along a line for its nodes, in parts where hits are less than four voxels apart. */
SPRINGLS__MATHS void springls__vote_on_line(const springls__model *model, const springls__contour *contour,
                                            SPRINGLS__GLOBAL const springls__surface_brick *brick, int line,
                                            springls__line_work *work)
{
    int first, end;
    springls__gather_line(contour, brick, line, true, work);
    for (first = 0; first < work->hits; first = end) {
        for (end = first + 1; end < work->hits && work->hit[end].t - work->hit[end - 1].t < 4.0f; end++) continue;
        springls__list_line_events(model, contour, brick, first, end, work);
        springls__vote_for_nodes(work);
    }
}

/* Returns whether some node of a brick's line is beside hits: the line votes for no others. */
SPRINGLS__INNER bool springls__has_node_beside_hits(SPRINGLS__GLOBAL const springls__surface_brick *brick, int line)
{
    int x;
    for (x = 0; x < 8; x++)
        if (springls__bit_of(brick->beside_hits, springls__line_node(line >> 6, x, line & 63))) return true;
    return false;
}

/* Finds the sides of the nodes of brick b. */
SPRINGLS__MATHS void springls__find_node_sides(const springls__model *model, const springls__contour *contour, int b,
                                          springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    const springls__grid *g = &model->grid;
    uint32_t beside = 0u;
    int line, node, k, at[3];
    for (node = 0; node < 512 && !brick->quiet; node++) work->margin[node] = 0.0f;
    for (line = 0; line < SPRINGLS__TABLE_ROWS && !brick->quiet; line++) {
        if ((line & 63) == 0 && !springls__has_hits_along(contour, brick, line >> 6)) {
            line += 63;
            continue;
        }
        if (!springls__is_shared_row(brick, line) && !springls__is_beside_region(brick, line >> 6, -1)) continue;
        for (k = -1; k < 2; k++)
            if (springls__has_hits(contour, springls__brick_beside(brick, line >> 6, k), line)) {
                if (springls__has_node_beside_hits(brick, line)) springls__vote_on_line(model, contour, brick, line, work);
                break;
            }
    }
    for (node = 0; node < 16; node++) {
        brick->inside[node] = 0u;
        beside |= brick->beside_hits[node];
    }
    if ((brick->slot == SPRINGLS__OUTSIDE && beside == 0u) || !springls__has_shared_nodes(brick)) return;
    for (node = 0; node < 512; node++) {
        float value = springls__node_phi(g, brick, node);
        if (springls__bit_of(brick->beside_hits, node)) value = work->margin[node] + springls__phi_evidence(value, true);
        if (!(value < 0.0f)) continue;
        springls__place_of_node(brick, node, at);
        if (brick->slot >= 0 || springls__grid_contains(g, at[0], at[1], at[2])) brick->inside[node >> 5] |= 1u << (node & 31);
    }
}

/* ---- crossings of edges ---- */

/* Places a crossing among hits of one side of the surface, whose `group` is `which`: to second order, by the mean distance to their planes
   and particles. */
SPRINGLS__MATHS springls__crossing springls__place_crossing(const springls__contour *contour,
                                                            SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int hits,
                                                            int which, const springls__line_work *work)
{
    const float r2 = SPRINGLS__HIT_RADIUS * SPRINGLS__HIT_RADIUS;
    const int axis = work->axis;
    springls__crossing found;
    springls__v3 n = springls__zero3(), aside = springls__zero3();
    float sum = 0.0f, t = 0.0f, height = 0.0f, best = -1.0f, bend, along;
    int k;
    for (k = 0; k < hits; k++) {
        const springls__hit hit = work->hit[first + k];
        springls__v3 d;
        float w;
        if (work->group[k] != which) continue;
        d = springls__sub(springls__line_place(brick, work->line, hit.t), contour->surfel[springls__hit_springl(hit)].p);
        w = hit.own_weight * (springls__hit_weight(springls__length2(d), r2) + 1e-4f);
        sum += w;
        t += w * hit.t;
    }
    found.x = springls__line_place(brick, work->line, t / sum);
    found.side = found.springl = 0;
    sum = 0.0f;
    for (k = 0; k < hits; k++) {
        const springls__hit hit = work->hit[first + k];
        const int i = springls__hit_springl(hit);
        springls__v3 d;
        float w;
        if (work->group[k] != which) continue;
        d = springls__sub(found.x, contour->surfel[i].p);
        w = hit.own_weight * (springls__hit_weight(springls__length2(d), r2) + 1e-4f);
        sum += w;
        n = springls__mad(n, contour->surfel[i].n, w);
        aside = springls__mad(aside, d, w);
        height += w * springls__dot(contour->surfel[i].n, d);
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
SPRINGLS__MATHS springls__crossing springls__place_run(const springls__contour *contour,
                                                       SPRINGLS__GLOBAL const springls__surface_brick *brick, int first, int hits, int run,
                                                       springls__line_work *work)
{
    const int second_side = SPRINGLS__EDGE_HITS + run;
    springls__crossing one, two;
    springls__v3 d;
    float one_t, two_t;
    bool convex, some = false;
    int k, best = -1;
    for (k = 0; k < hits; k++)
        if (work->group[k] == run && (best < 0 || work->hit[first + k].own_weight > work->hit[first + best].own_weight)) best = k;
    d = contour->surfel[springls__hit_springl(work->hit[first + best])].n;
    for (k = 0; k < hits; k++) {
        if (work->group[k] != run) continue;
        if (springls__dot(contour->surfel[springls__hit_springl(work->hit[first + k])].n, d) > SPRINGLS__CREASE_COSINE) continue;
        work->group[k] = second_side;
        some = true;
    }
    one = springls__place_crossing(contour, brick, first, hits, run, work);
    if (!some) return one;
    two = springls__place_crossing(contour, brick, first, hits, second_side, work);
    d = springls__sub(contour->surfel[two.springl].p, contour->surfel[one.springl].p);
    convex = springls__dot(d, one.n) - springls__dot(d, two.n) < 0.0f;
    one_t = springls__along(one.x, work->axis);
    two_t = springls__along(two.x, work->axis);
    return (two_t > one_t) == ((one.side < 0) == convex) ? two : one; /* into an intersection: at the later one */
}

/* Numbers the runs of the first n hits from `first` on, which explain best how the line comes from one side to the other: work->group of
   each; -1: of none. Returns how many there are. */
SPRINGLS__MATHS int springls__find_runs(int first, int n, float x, int from, int to, springls__line_work *work)
{
    springls__side_path path = springls__side_path_begin(from ? 1e9f : 0.0f, from ? 0.0f : 1e9f);
    int k, side = to, runs = 0;
    bool open = false;
    for (k = 0; k < n; k++) {
        const springls__hit hit = work->hit[first + k];
        work->group[k] = -1;
        work->came[k] = 0;
        if (hit.weight <= SPRINGLS__LEAST_WEIGHT) continue;
        path = springls__side_path_over_hit(path, hit.t, hit.t < x || hit.t > x + 1.0f ? 0.0f : hit.weight, springls__hit_side(hit) < 0,
                                            &work->came[k]);
    }
    if ((to ? path.inside : path.outside) > 1e8f) return 0;
    for (k = n - 1; k >= 0; k--) {
        if (work->came[k] < 4 || (springls__hit_side(work->hit[first + k]) < 0) != side) continue; /* this side is not reached by it */
        if (!open) runs++;
        work->group[k] = runs - 1;
        open = work->came[k] == 5;
        if (!open) side = 1 - side;
    }
    for (k = 0; k < n; k++) /* counted from the last: an edge's first runs are those that count, by pairs */
        if (work->group[k] >= 0) work->group[k] = runs - 1 - work->group[k];
    for (; runs > SPRINGLS__EDGE_CROSSINGS; runs -= 2) continue;
    return runs;
}

/* Takes some of n hits, which weigh little, as a run: better than none, where the side changes. Returns 1 if there are any. */
SPRINGLS__MATHS int springls__find_weak_run(int first, int n, float x, int side, springls__line_work *work)
{
    int k, best = -1;
    for (k = first; k < first + n; k++)
        if (springls__hit_side(work->hit[k]) == side
            && (best < 0 || springls__fabs(work->hit[k].t - x - 0.5f) < springls__fabs(work->hit[best].t - x - 0.5f))) best = k;
    for (k = first; best >= 0 && k < first + n; k++)
        work->group[k - first] = springls__hit_side(work->hit[k]) == side
                              && springls__fabs(work->hit[k].t - work->hit[best].t) < 0.3f ? 0 : -1;
    return best >= 0;
}

/* Returns the crossing of an edge without hits: phi's zero, or nearer to the end where phi is less sure; at the border of the domain
   halfway. */
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
    else if (a != 0.0f || b != 0.0f) t = springls__clamp(springls__fabs(a) / (springls__fabs(a) + springls__fabs(b)), 0.001f, 0.999f);
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

/* Return whether a hit lies before, or behind, what the edge from x to x + 1 takes: the same in floats where edges are counted
   (springls__count_at_edges). */
SPRINGLS__MATHS bool springls__is_before_edge(float t, float x) { return t + SPRINGLS__EDGE_MARGIN < x; }
SPRINGLS__MATHS bool springls__is_behind_edge(float t, float x) { return t - SPRINGLS__EDGE_MARGIN >= x + 1.0f; }

/* Returns whether a pair of runs, `run` and the next, is of the edge on the other side of `node`, an end of this one. Both edges take
   hits near their node. A pair of such hits alone is of the edge in which more of their weight lies, so that a sheet is crossed there
   once; with others, which the edge beyond does not take and so may have no pair, it stays. */
SPRINGLS__MATHS bool springls__is_beyond_node(int first, int n, int run, float node, bool at_end, const springls__line_work *work)
{
    float here = 0.0f, beyond = 0.0f;
    int k;
    for (k = 0; k < n; k++) {
        const springls__hit hit = work->hit[first + k];
        if (work->group[k] != run && work->group[k] != run + 1) continue;
        if (at_end ? springls__is_before_edge(hit.t, node) : springls__is_behind_edge(hit.t, node - 1.0f)) return false;
        if ((hit.t < node) == at_end) here += hit.weight;
        else beyond += hit.weight;
    }
    return at_end ? beyond > here : beyond >= here;
}

/* Leaves out the runs of an edge, from x on, that are of those before and behind it. Returns how many are left. */
SPRINGLS__MATHS int springls__runs_within(int first, int n, float x, int runs, springls__line_work *work)
{
    int k;
    if (runs >= 2 && springls__is_beyond_node(first, n, runs - 2, x + 1.0f, true, work)) runs -= 2;
    if (runs < 2 || !springls__is_beyond_node(first, n, 0, x, false, work)) return runs;
    for (k = 0; k < n; k++) work->group[k] = work->group[k] < 2 ? -1 : work->group[k] - 2;
    return runs - 2;
}

/* Finds the crossings of the edge that begins at node `at`, x along the gathered line, and writes them; from, to: whether its ends are
   inside. Returns how many. */
SPRINGLS__MATHS int springls__edge_crossings(const springls__model *model, const springls__contour *contour,
                                             SPRINGLS__GLOBAL const springls__surface_brick *brick, const int at[3], int first,
                                             int from, int to, springls__line_work *work,
                                             SPRINGLS__GLOBAL springls__crossing *out)
{
    const float x = (float)at[work->axis];
    int n = 0, runs, k;
    while (first + n < work->hits && n < SPRINGLS__EDGE_HITS && !springls__is_behind_edge(work->hit[first + n].t, x)) n++;
    runs = springls__runs_within(first, n, x, springls__find_runs(first, n, x, from, to, work), work);
    if (runs == 0 && from != to) runs = springls__find_weak_run(first, n, x, from ? 1 : -1, work);
    if (runs == 0 && from != to) {
        out[0] = springls__plain_crossing(&model->grid, at, work->axis, from ? 1 : -1);
        return 1;
    }
    for (k = 0; k < runs; k++) out[k] = springls__place_run(contour, brick, first, n, k, work);
    springls__order_crossings(out, runs, work->axis, x);
    return runs;
}

/* Returns whether the node `at` along a line of a brick is inside; beyond the table none is. */
SPRINGLS__INNER int springls__line_side(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick, int line,
                                        int at)
{
    const int axis = line >> 6, b = springls__brick_beside(brick, axis, at >> 3);
    return b >= 0 && springls__bit_of(contour->brick[b].inside, springls__line_node(axis, at & 7, line & 63)) ? 1 : 0;
}

/* Returns, as bits, which nodes of word w of a brick's sides differ from the next one along an axis. The last brick's last nodes do not. */
SPRINGLS__MATHS uint32_t springls__side_changes(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                                int axis, int w)
{
    const int next = springls__brick_beside(brick, axis, 1);
    const uint32_t own = brick->inside[w];
    uint32_t after;
    if (axis == 0) {
        after = next < 0 ? own : contour->brick[next].inside[w] << 7;
        after = (own >> 1 & 0x7f7f7f7fu) | (after & 0x80808080u);
    } else if (axis == 1) {
        after = w % 2 == 0 ? brick->inside[w + 1] << 24 : next < 0 ? own & 0xff000000u : contour->brick[next].inside[w - 1] << 24;
        after |= own >> 8;
    } else {
        after = w < 14 ? brick->inside[w + 2] : next < 0 ? own : contour->brick[next].inside[w - 14];
    }
    return own ^ after;
}

/* Returns whether hits of a line in a brick, or in the ones before and behind it, enter as well as leave. */
SPRINGLS__MATHS bool springls__has_both_sides(const springls__contour *contour, SPRINGLS__GLOBAL const springls__surface_brick *brick,
                                              int line)
{
    uint32_t enters = 0u, leaves = 0u;
    int k;
    for (k = -1; k < 2; k++) {
        const int b = springls__brick_beside(brick, line >> 6, k);
        if (b < 0) continue;
        enters |= contour->brick[b].enters[line >> 5];
        leaves |= contour->brick[b].leaves[line >> 5];
    }
    return (enters & leaves) >> (line & 31) & 1u;
}

/* Counts the hits of brick b that enter and leave at the edges of a line in a brick. */
SPRINGLS__MATHS void springls__count_at_edges(const springls__contour *contour, int b, int line, float origin, int entering[8],
                                              int leaving[8])
{
    const float margin = SPRINGLS__EDGE_MARGIN;
    int k, end;
    if (!springls__has_hits(contour, b, line)) return;
    end = contour->brick[b].begin[SPRINGLS__OF_HITS][line + 1];
    for (k = contour->brick[b].begin[SPRINGLS__OF_HITS][line]; k < end; k++) {
        const springls__hit hit = contour->hit[k];
        int x, last;
        if (hit.weight <= SPRINGLS__LEAST_WEIGHT || hit.t + margin < origin || hit.t - margin >= origin + 8.0f) continue;
        last = springls__imin((int)springls__floor(hit.t + margin - origin), 7);
        for (x = springls__imax((int)springls__floor(hit.t - margin - origin), 0); x <= last; x++) {
            entering[x] += hit.springl < 0;
            leaving[x] += hit.springl >= 0;
        }
    }
}

/* Adds the pairs of crossings that the edges of a line have at most: each needs a hit that enters and one that leaves. */
SPRINGLS__MATHS void springls__count_pairs(const springls__contour *contour, SPRINGLS__GLOBAL springls__surface_brick *brick, int line)
{
    const int axis = line >> 6;
    int entering[8] = { 0, 0, 0, 0, 0, 0, 0, 0 }, leaving[8] = { 0, 0, 0, 0, 0, 0, 0, 0 }, k;
    for (k = -1; k < 2; k++)
        springls__count_at_edges(contour, springls__brick_beside(brick, axis, k), line, (float)brick->origin[axis], entering, leaving);
    for (k = 0; k < 8; k++) {
        const int single = brick->crossings[8 * line + k], most = (SPRINGLS__EDGE_CROSSINGS - single) / 2;
        brick->crossings[8 * line + k] = (uint8_t)(single + 2 * springls__imin(springls__imin(entering[k], leaving[k]), most));
    }
}

/* Counts the crossings that the edges of brick b have at most. */
SPRINGLS__MATHS void springls__count_crossings(const springls__contour *contour, int b)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    int axis, line, w, k, at[3];
    for (k = 0; k < 1536; k++) brick->crossings[k] = 0;
    for (axis = 0; axis < 3; axis++) {
        const int p = springls__axis_after(axis), q = springls__axis_after(p);
        for (w = 0; w < 16; w++) {
            uint32_t changes = springls__side_changes(contour, brick, axis, w);
            for (; changes; changes &= changes - 1u) {
                springls__node_of_brick(32 * w + springls__lowest_bit(changes), at);
                if (springls__is_shared_row(brick, 64 * axis + at[p] + 8 * at[q]))
                    brick->crossings[8 * (64 * axis + at[p] + 8 * at[q]) + at[axis]] = 1;
            }
        }
    }
    for (line = 0; line < SPRINGLS__TABLE_ROWS && !brick->quiet; line++) {
        if ((line & 63) == 0 && !springls__has_hits_along(contour, brick, line >> 6)) {
            line += 63;
            continue;
        }
        if (springls__is_shared_row(brick, line) && springls__has_both_sides(contour, brick, line))
            springls__count_pairs(contour, brick, line);
    }
}

/* Finds the crossings of the edges of brick b, which have at most `crossings`, and stores how many there are. */
SPRINGLS__MATHS void springls__find_crossings(const springls__model *model, const springls__contour *contour, int b,
                                              springls__line_work *work)
{
    SPRINGLS__GLOBAL springls__surface_brick *brick = contour->brick + b;
    SPRINGLS__GLOBAL const int *begin = brick->begin[SPRINGLS__OF_CROSSINGS];
    int line, x, at[3];
    for (line = 0; line < SPRINGLS__TABLE_ROWS && begin[0] != begin[SPRINGLS__TABLE_ROWS]; line++) {
        int first = 0, count = 0;
        if (begin[line] == begin[line + 1]) continue;
        springls__gather_line(contour, brick, line, true, work);
        for (x = 0; x < 8; x++) {
            SPRINGLS__GLOBAL uint8_t *crossings = brick->crossings + 8 * line + x;
            if (*crossings == 0) continue;
            springls__place_of_node(brick, springls__line_node(line >> 6, x, line & 63), at);
            while (first < work->hits && springls__is_before_edge(work->hit[first].t, (float)at[line >> 6])) first++;
            *crossings = (uint8_t)springls__edge_crossings(model, contour, brick, at, first, springls__line_side(contour, brick, line, x),
                                                           springls__line_side(contour, brick, line, x + 1), work,
                                                           contour->crossing + begin[line] + count);
            count += *crossings;
        }
    }
}

#endif
