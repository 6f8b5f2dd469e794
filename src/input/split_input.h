/* split_input.h - makes the springls of input triangles (params.split_input): divides those that are much larger than a voxel, at
   the middle of the longest edge, until no edge is too long. Whether and where an edge is divided depends on its two ends alone,
   so triangles are divided alike on both sides of it, and no gap can open between them when they move. */
#ifndef SPRINGLS__INPUT_SPLIT_INPUT_H
#define SPRINGLS__INPUT_SPLIT_INPUT_H

#include "../model/constellation.h"

enum { SPRINGLS__SPLIT_STACK = 256 };

/* Holds a part of an input triangle, in double precision: a part near the grid may be of a triangle with far corners. */
typedef struct springls__split_part { double q[3][3]; } springls__split_part;

/* Holds what parts are divided by. room: how many more springls there may be. */
typedef struct springls__split_rule { double longest2, lower[3], upper[3]; int room; } springls__split_rule;

/* Returns the rule for a model of `given` triangles. An equilateral triangle of the largest edge is no larger than split_area, so
   that resample leaves all parts as they are. */
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

/* Returns true when the bounds of a part meet the grid. */
SPRINGLS__FN bool springls__part_in_grid(const springls__split_rule *rule, const springls__split_part *part)
{
    int i, k;
    for (k = 0; k < 3; k++) {
        int below = 0, above = 0;
        for (i = 0; i < 3; i++) {
            below += part->q[i][k] < rule->lower[k];
            above += part->q[i][k] > rule->upper[k];
        }
        if (below == 3 || above == 3) return false;
    }
    return true;
}

/* Returns the longest edge: 0, 1 or 2, from that corner to the next; and its squared length. */
SPRINGLS__FN int springls__part_longest_edge(const springls__split_part *part, double *length2)
{
    int m, k, longest = 0;
    *length2 = -1.0;
    for (m = 0; m < 3; m++) {
        double sum = 0.0;
        for (k = 0; k < 3; k++) sum += (part->q[(m + 1) % 3][k] - part->q[m][k]) * (part->q[(m + 1) % 3][k] - part->q[m][k]);
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
        bool large = length2 > rule->longest2 && springls__part_in_grid(rule, &part);
        if (large && rule->room > 0 && top + 2 <= SPRINGLS__SPLIT_STACK) {
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
