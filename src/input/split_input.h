/* split_input.h - makes the springls of input triangles (params.split_input): divides those that are much larger than a voxel.
   A wide part is cut from the middle of its longest edge to the opposite corner; a narrow one would be cut into slivers and is
   divided as a strip instead, between the points of its longest edge and those of the other two. The points of an edge are the
   middles of its parts until none is too long: they depend on its two ends alone, so triangles are divided alike on both sides
   of it, and no gap can open between them when they move. */
#ifndef SPRINGLS__INPUT_SPLIT_INPUT_H
#define SPRINGLS__INPUT_SPLIT_INPUT_H

#include "../model/constellation.h"

enum { SPRINGLS__SPLIT_STACK = 256, SPRINGLS__CHAIN_DEPTH = 64 };

/* Holds a part of an input triangle, in double precision: a part near the grid may be of a triangle with far corners. */
typedef struct springls__split_part { double q[3][3]; } springls__split_part;

/* Holds a place on a chain of points: the point, and the ends of the parts ahead of it, the nearest last. */
typedef struct springls__chain { double at[3], ahead[SPRINGLS__CHAIN_DEPTH][3]; int count; } springls__chain;

/* Holds what parts are divided by. room: how many more springls there may be. */
typedef struct springls__split_rule { double longest2, lower[3], upper[3]; int room; } springls__split_rule;

/* Returns the rule for a model of `given` triangles. An equilateral triangle of the largest edge is no larger than split_area, so
   that resample leaves the parts as they are; in strips a few diagonals are longer. */
SPRINGLS__FN springls__split_rule springls__split_rule_of(const springls_context *ctx, int given)
{
    const double margin = 0.5 + (double)ctx->model.params.band_half_width; /* beyond the outermost voxels */
    const double edge = (double)ctx->model.params.split_edge, area = (double)ctx->model.params.split_area;
    const double edge2_of_area = 2.309401077; /* 4 / sqrt 3 */
    springls__split_rule rule;
    int k;
    rule.longest2 = edge * edge < edge2_of_area * area ? edge * edge : edge2_of_area * area;
    if (!ctx->model.params.split_input) rule.longest2 = DBL_MAX;
    rule.room = springls__imax(ctx->desc.max_springls - given, 0);
    for (k = 0; k < 3; k++) {
        rule.lower[k] = -margin;
        rule.upper[k] = (double)ctx->desc.grid.size[k] - 1.0 + margin;
    }
    return rule;
}

/* Returns true when the bounds of some points meet the grid. */
SPRINGLS__FN bool springls__points_in_grid(const springls__split_rule *rule, const double (*q)[3], int count)
{
    int i, k;
    for (k = 0; k < 3; k++) {
        int below = 0, above = 0;
        for (i = 0; i < count; i++) {
            below += q[i][k] < rule->lower[k];
            above += q[i][k] > rule->upper[k];
        }
        if (below == count || above == count) return false;
    }
    return true;
}

SPRINGLS__FN double springls__squared_distance(const double a[3], const double b[3])
{
    return (b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]) + (b[2] - a[2]) * (b[2] - a[2]);
}

/* Returns the longest edge: 0, 1 or 2, from that corner to the next; and its squared length. */
SPRINGLS__FN int springls__part_longest_edge(const springls__split_part *part, double *length2)
{
    int m, longest = 0;
    *length2 = -1.0;
    for (m = 0; m < 3; m++) {
        const double sum = springls__squared_distance(part->q[m], part->q[(m + 1) % 3]);
        if (sum <= *length2) continue;
        *length2 = sum;
        longest = m;
    }
    return longest;
}

/* Cuts a part from the middle of an edge to the opposite corner; both halves keep its orientation. */
SPRINGLS__FN void springls__part_halve(springls__split_part part, int edge, springls__split_part *first,
                                       springls__split_part *second)
{
    int next = (edge + 1) % 3, k;
    *first = *second = part;
    for (k = 0; k < 3; k++)
        first->q[next][k] = second->q[edge][k] = 0.5 * (part.q[edge][k] + part.q[next][k]);
}

/* Appends a springl; it comes from the input, and its particle is its correspondence. */
SPRINGLS__FN springls_status springls__part_append(springls_context *ctx, const springls__split_part *part)
{
    springls__springl s;
    int m;
    SPRINGLS__TRY(springls__constellation_reserve(ctx, ctx->model.set.count + 1));
    memset(&s, 0, sizeof s);
    for (m = 0; m < 3; m++) s.q[m] = springls__v3_make((float)part->q[m][0], (float)part->q[m][1], (float)part->q[m][2]);
    s.p = springls__tri_centroid(springls__springl_tri(s));
    springls__constellation_append(ctx, &s, s.p, 0u, 0u);
    return SPRINGLS_OK;
}

/* ---- narrow parts ---- */

/* Puts a chain at the first point of a path over three. */
SPRINGLS__FN void springls__chain_start(springls__chain *chain, const double from[3], const double over[3], const double to[3])
{
    memcpy(chain->at, from, sizeof chain->at);
    memcpy(chain->ahead[0], to, sizeof chain->ahead[0]);
    memcpy(chain->ahead[1], over, sizeof chain->ahead[1]);
    chain->count = 2;
}

/* Divides what is ahead until the next part is not too long, or lies outside of the grid. Returns the end of that part. */
SPRINGLS__FN const double *springls__chain_next(const springls__split_rule *rule, springls__chain *chain)
{
    for (; chain->count < SPRINGLS__CHAIN_DEPTH; chain->count++) {
        double part[2][3];
        int k;
        memcpy(part[0], chain->at, sizeof part[0]);
        memcpy(part[1], chain->ahead[chain->count - 1], sizeof part[1]);
        if (!(springls__squared_distance(part[0], part[1]) > rule->longest2)) break;
        if (!springls__points_in_grid(rule, (const double (*)[3])part, 2)) break;
        for (k = 0; k < 3; k++) chain->ahead[chain->count][k] = 0.5 * (part[0][k] + part[1][k]);
    }
    return chain->ahead[chain->count - 1];
}

/* Moves a chain to the end of the next part. */
SPRINGLS__FN void springls__chain_advance(const springls__split_rule *rule, springls__chain *chain)
{
    memcpy(chain->at, springls__chain_next(rule, chain), sizeof chain->at);
    chain->count--;
}

/* Puts the chains of a part at the start of its longest edge. base: over that edge; other: over the opposite corner. */
SPRINGLS__FN void springls__part_chains(const springls__split_part *part, int edge, springls__chain *base, springls__chain *other)
{
    const double *from = part->q[edge], *to = part->q[(edge + 1) % 3];
    double middle[3];
    int k;
    for (k = 0; k < 3; k++) middle[k] = 0.5 * (from[k] + to[k]);
    springls__chain_start(base, from, middle, to);
    springls__chain_start(other, from, part->q[(edge + 2) % 3], to);
}

/* Returns how many triangles divide a part as a strip, at most `most`. */
SPRINGLS__FN int springls__strip_size(const springls__split_rule *rule, const springls__split_part *part, int edge, int most)
{
    springls__chain chain[2];
    int i, points = 0;
    springls__part_chains(part, edge, &chain[0], &chain[1]);
    for (i = 0; i < 2; i++)
        for (; chain[i].count && points - 2 < most; points++) springls__chain_advance(rule, &chain[i]);
    return points - 2;
}

/* Returns true when the next triangle of a strip takes a point of the base: of the two diagonals, the shorter. The ends of the
   strip are not paired with points that lie on one line with them. */
SPRINGLS__FN bool springls__strip_takes_base(const springls__split_rule *rule, springls__chain *base, springls__chain *other)
{
    const double *next_base = springls__chain_next(rule, base), *next_other = springls__chain_next(rule, other);
    if (base->count == 1 || other->count == 1) return other->count == 1;
    return springls__squared_distance(next_base, other->at) <= springls__squared_distance(base->at, next_other);
}

/* Appends the triangles between the two chains of a part, oriented like it. */
SPRINGLS__FN springls_status springls__append_strip(springls_context *ctx, const springls__split_rule *rule,
                                                    const springls__split_part *part, int edge)
{
    springls__chain base, other;
    bool take_base = true;
    springls__part_chains(part, edge, &base, &other);
    springls__chain_advance(rule, &other);
    while (base.count) {
        springls__chain *taken = take_base ? &base : &other;
        springls__split_part piece;
        memcpy(piece.q[0], base.at, sizeof piece.q[0]);
        memcpy(piece.q[2], other.at, sizeof piece.q[2]);
        springls__chain_advance(rule, taken);
        memcpy(piece.q[1], taken->at, sizeof piece.q[1]);
        SPRINGLS__TRY(springls__part_append(ctx, &piece));
        if (base.count) take_base = springls__strip_takes_base(rule, &base, &other);
    }
    return SPRINGLS_OK;
}

/* Returns true when the height over the longest edge is no more than a springl's. */
SPRINGLS__FN bool springls__part_is_narrow(const springls__split_rule *rule, const springls__split_part *part, int edge,
                                           double length2)
{
    const double *a = part->q[edge], *b = part->q[(edge + 1) % 3], *c = part->q[(edge + 2) % 3];
    double along = 0.0;
    int k;
    for (k = 0; k < 3; k++) along += (b[k] - a[k]) * (c[k] - a[k]);
    return springls__squared_distance(a, c) - along * along / length2 <= rule->longest2;
}

/* Appends the springls of one triangle. Parts outside of the grid stay whole; so do those beyond max_springls, which are counted
   as refused. */
SPRINGLS__FN springls_status springls__append_divided(springls_context *ctx, springls__split_rule *rule, const springls__v3 q[3])
{
    springls__split_part stack[SPRINGLS__SPLIT_STACK];
    int top = 1, m;
    for (m = 0; m < 3; m++) {
        stack[0].q[m][0] = (double)q[m].x;
        stack[0].q[m][1] = (double)q[m].y;
        stack[0].q[m][2] = (double)q[m].z;
    }
    while (top) {
        const springls__split_part part = stack[--top];
        double length2;
        int edge = springls__part_longest_edge(&part, &length2);
        const bool large = length2 > rule->longest2 && springls__points_in_grid(rule, part.q, 3);
        const bool narrow = large && springls__part_is_narrow(rule, &part, edge, length2);
        const int more = narrow ? springls__strip_size(rule, &part, edge, springls__imin(rule->room, INT32_MAX - 4) + 2) - 1 : 0;
        if (narrow && more <= rule->room) {
            SPRINGLS__TRY(springls__append_strip(ctx, rule, &part, edge));
            rule->room -= more;
        } else if (large && rule->room > 0 && top + 2 <= SPRINGLS__SPLIT_STACK) {
            springls__part_halve(part, edge, &stack[top + 1], &stack[top]);
            rule->room--;
            top += 2;
        } else {
            ctx->stats.refused += large;
            SPRINGLS__TRY(springls__part_append(ctx, &part));
        }
    }
    return SPRINGLS_OK;
}

#endif
