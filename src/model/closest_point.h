/* closest_point.h - finds the point of a surface that is closest to a place, and all triangles near it. */
#ifndef SPRINGLS__MODEL_CLOSEST_POINT_H
#define SPRINGLS__MODEL_CLOSEST_POINT_H

#include "bvh.h"

/* Returns the squared distance from x to the bounds of a node. */
SPRINGLS__FN float springls__bvh_box_distance2(const springls__bvh_node *node, springls__v3 x)
{
    float dx = springls__max(springls__max(node->lower[0] - x.x, x.x - node->upper[0]), 0.0f);
    float dy = springls__max(springls__max(node->lower[1] - x.y, x.y - node->upper[1]), 0.0f);
    float dz = springls__max(springls__max(node->lower[2] - x.z, x.z - node->upper[2]), 0.0f);
    return dx * dx + dy * dy + dz * dz;
}

/* Returns the squared distance from x to the bounds of one triangle. */
SPRINGLS__FN float springls__bvh_triangle_distance2(const springls__v3 *p, springls__v3 x)
{
    float dx = springls__max(springls__max(springls__min(springls__min(p[0].x, p[1].x), p[2].x) - x.x,
                                           x.x - springls__max(springls__max(p[0].x, p[1].x), p[2].x)), 0.0f);
    float dy = springls__max(springls__max(springls__min(springls__min(p[0].y, p[1].y), p[2].y) - x.y,
                                           x.y - springls__max(springls__max(p[0].y, p[1].y), p[2].y)), 0.0f);
    float dz = springls__max(springls__max(springls__min(springls__min(p[0].z, p[1].z), p[2].z) - x.z,
                                           x.z - springls__max(springls__max(p[0].z, p[1].z), p[2].z)), 0.0f);
    return dx * dx + dy * dy + dz * dz;
}

/* A search for the closest triangle: the best so far, and the squared distance beyond which no box can hold a better one. */
typedef struct springls__closest_search {
    const springls__surface *surface;
    springls__v3 x;
    float slack, limit2;    /* slack: more than all rounding errors of a distance                               */
    springls__surface_hit best;
    struct { float d2; int node; } stack[SPRINGLS__BVH_STACK];
    int top;
} springls__closest_search;

/* Takes the triangle if it is closer than the best, or as close and of a lower index. */
SPRINGLS__FN void springls__closest_try(springls__closest_search *search, int triangle)
{
    springls__surface_hit *best = &search->best;
    springls__tri_hit h = springls__tri_closest(springls__surface_triangle(search->surface, triangle), search->x);
    if (h.d2 < best->hit.d2 || (h.d2 == best->hit.d2 && (best->triangle < 0 || triangle < best->triangle))) {
        float d = springls__sqrt(h.d2) + search->slack;
        best->triangle = triangle;
        best->hit = h;
        search->limit2 = d * d;
    }
}

/* Goes down to a leaf, each time by the nearer child; the other one waits on the stack. Returns NULL if all below is too
   far. */
SPRINGLS__FN const springls__bvh_node *springls__closest_leaf(springls__closest_search *search, const springls__bvh_node *node)
{
    while (!node->count) {
        const springls__bvh_node *child = &search->surface->nodes[node->first];
        float d0 = springls__bvh_box_distance2(&child[0], search->x), d1 = springls__bvh_box_distance2(&child[1], search->x);
        int further = d0 <= d1;
        if ((further ? d0 : d1) > search->limit2) return NULL;
        if ((further ? d1 : d0) <= search->limit2) {
            search->stack[search->top].d2 = further ? d1 : d0;
            search->stack[search->top++].node = node->first + further;
        }
        node = &child[!further];
    }
    return node;
}

/* Returns the point of the surface closest to x, if it is not further than max_distance; the lowest index among equals.
   `guess` is a triangle that is probably close, or -1: it saves time and cannot change the result, because boxes are left out
   only when they are further than the best so far by more than all rounding errors. */
SPRINGLS__FN springls__surface_hit springls__surface_closest_from(const springls__surface *surface, springls__v3 x,
                                                                  float max_distance, int guess)
{
    springls__closest_search search;
    const bool bounded = max_distance < 1e18f;
    int i;
    search.surface = surface;
    search.x = x;
    search.slack = 4e-6f * (surface->magnitude + springls__max_coordinate(x));
    memset(&search.best, 0, sizeof search.best);
    search.best.triangle = -1;
    search.best.hit.d2 = bounded ? max_distance * max_distance : FLT_MAX;
    search.limit2 = bounded ? (max_distance + search.slack) * (max_distance + search.slack) : FLT_MAX;
    if (!surface->count) return search.best;
    if (guess >= 0) springls__closest_try(&search, guess);
    search.stack[0].d2 = springls__bvh_box_distance2(&surface->nodes[0], x);
    search.stack[0].node = 0;
    search.top = 1;
    while (search.top) {
        const springls__bvh_node *leaf;
        search.top--;
        if (search.stack[search.top].d2 > search.limit2) continue;
        leaf = springls__closest_leaf(&search, &surface->nodes[search.stack[search.top].node]);
        for (i = 0; leaf && i < leaf->count; i++) {
            int triangle = surface->order[leaf->first + i];
            if (springls__bvh_triangle_distance2(surface->points + 3 * triangle, x) <= search.limit2)
                springls__closest_try(&search, triangle);
        }
    }
    return search.best;
}

SPRINGLS__FN springls__surface_hit springls__surface_closest(const springls__surface *surface, springls__v3 x,
                                                             float max_distance)
{
    return springls__surface_closest_from(surface, x, max_distance, -1);
}

/* ---- all triangles that are near ---- */

/* A walk over the triangles of all leaves whose bounds come within r of x. */
typedef struct springls__near_walk {
    const springls__surface *surface;
    springls__v3 x;
    float r;
    int stack[SPRINGLS__BVH_STACK], top, next, end;
} springls__near_walk;

SPRINGLS__FN springls__near_walk springls__near_walk_begin(const springls__surface *surface, springls__v3 x, float r)
{
    springls__near_walk walk;
    walk.surface = surface;
    walk.x = x;
    walk.r = r;
    walk.top = walk.next = walk.end = 0;
    if (surface->count) walk.stack[walk.top++] = 0;
    return walk;
}

/* Returns the next triangle, or -1 at the end. */
SPRINGLS__FN int springls__near_walk_next(springls__near_walk *walk)
{
    while (walk->next == walk->end) {
        const springls__bvh_node *node;
        if (!walk->top) return -1;
        node = &walk->surface->nodes[walk->stack[--walk->top]];
        if (springls__bvh_box_distance2(node, walk->x) > walk->r * walk->r) continue;
        if (node->count) {
            walk->next = node->first;
            walk->end = node->first + node->count;
        } else {
            walk->stack[walk->top++] = node->first + 1;
            walk->stack[walk->top++] = node->first;
        }
    }
    return walk->surface->order[walk->next++];
}

#endif
