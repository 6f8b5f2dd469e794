/* bvh_join.h - joins hierarchies: each stays a part, and a few nodes above hang the parts below one root. So it costs what is added. What
   is closest, and what is near, does not depend on how triangles lie in a hierarchy. */
#ifndef SPRINGLS__MODEL_BVH_JOIN_H
#define SPRINGLS__MODEL_BVH_JOIN_H

#include "bvh.h"

/* Returns how many parts a hierarchy has, and their roots. */
SPRINGLS__FN int springls__bvh_parts(const springls__surface *surface, const springls__bvh_node **root)
{
    *root = surface->parts ? (const springls__bvh_node *)surface->parts_memory.data : surface->nodes;
    return surface->parts ? surface->parts : surface->count > 0;
}

/* Makes room for the hierarchy of a surface and that of another one: of n triangles together, `keep` of them in `to` already. */
SPRINGLS__FN springls_status springls__parts_room(springls_context *ctx, springls__surface *to, const springls__surface *surface,
                                                  const springls__surface *other, size_t n, size_t keep)
{
    const springls__bvh_node *root;
    const size_t parts = (size_t)springls__bvh_parts(surface, &root) + (size_t)springls__bvh_parts(other, &root);
    const size_t nodes = 1 + (size_t)surface->node_count + (size_t)other->node_count + 2 * parts;
    SPRINGLS__TRY(springls__buffer_grow(ctx, &to->parts_memory, parts + 1, sizeof *root, (size_t)to->parts * sizeof *root));
    return springls__nodes_room(ctx, to, n, nodes, keep);
}

/* Triangles that are copied from one hierarchy to another: as number[i], -1: left out, or, where that is NULL, as i + shift. */
typedef struct springls__bvh_copy {
    const springls__surface *from;
    springls__surface *to;  /* has points for all of them */
    const int *number;
    int shift, placed;      /* placed: triangles of `to` in its order */
} springls__bvh_copy;

/* Copies a node, and what is below it. A node of few triangles becomes a leaf, and one without stays out. Returns how many it has. */
SPRINGLS__FN int springls__bvh_copy_node(springls__bvh_copy *copy, const springls__bvh_node *node, springls__bvh_node *out)
{
    const int first = copy->placed, beside = copy->to->node_count;
    int i, left = 0;
    for (i = node->first; i < node->first + node->count; i++) {
        const int triangle = copy->from->order[i], number = copy->number ? copy->number[triangle] : triangle + copy->shift;
        if (number >= 0) copy->to->order[copy->placed++] = number;
    }
    if (!node->count) {
        springls__bvh_node *child = &copy->to->nodes[beside];
        copy->to->node_count += 2;
        left = springls__bvh_copy_node(copy, &copy->from->nodes[node->first], &child[0]);
        springls__bvh_copy_node(copy, &copy->from->nodes[node->first + 1], &child[1]);
    }
    out->count = copy->placed - first;
    out->first = first;
    if (out->count <= SPRINGLS__BVH_LEAF) {
        copy->to->node_count = beside;
        if (out->count == 0) return 0;
    } else if (left == 0 || left == out->count) {
        *out = copy->to->nodes[beside + (left == 0)];
        return copy->placed - first;
    } else {
        out->first = beside;
        out->count = 0;
    }
    springls__bvh_bound_node(copy->to, out);
    return copy->placed - first;
}

/* Copies part i of a hierarchy as a part of another one, which has at least one already or is empty; one without triangles is left out. */
SPRINGLS__FN void springls__bvh_copy_part(springls__bvh_copy *copy, int i)
{
    const springls__bvh_node *root;
    springls__bvh_node *own = (springls__bvh_node *)copy->to->parts_memory.data;
    springls__bvh_parts(copy->from, &root);
    if (springls__bvh_copy_node(copy, &root[i], &own[copy->to->parts]) > 0) copy->to->parts++;
}

/* Makes a hierarchy one that parts can be joined to: its own root, if it has one, becomes that of a part. */
SPRINGLS__FN void springls__bvh_make_parts(springls__surface *surface)
{
    if (surface->parts) return;
    if (surface->count) ((springls__bvh_node *)surface->parts_memory.data)[surface->parts++] = surface->nodes[0];
    surface->node_count = springls__imax(surface->node_count, 1);
}

/* Widens the bounds of a node to those of parts. */
SPRINGLS__FN void springls__bvh_bound_parts(springls__bvh_node *node, const springls__bvh_node *part, const springls__bvh_item *items,
                                            int count)
{
    int i, k;
    for (k = 0; k < 3; k++) { node->lower[k] = FLT_MAX; node->upper[k] = -FLT_MAX; }
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            node->lower[k] = springls__min(node->lower[k], part[items[i].triangle].lower[k]);
            node->upper[k] = springls__max(node->upper[k], part[items[i].triangle].upper[k]);
        }
}

/* Hangs the parts of a hierarchy below one root, by median splits as in springls__bvh_split. items: room for as many as parts. */
SPRINGLS__FN void springls__bvh_hang(springls__surface *surface, springls__bvh_item *items)
{
    const springls__bvh_node *part = (const springls__bvh_node *)surface->parts_memory.data;
    struct { int node, first, count; } stack[SPRINGLS__BVH_STACK];
    int i, k, top = 1, next = surface->node_count;
    for (i = 0; i < surface->parts; i++) {
        for (k = 0; k < 3; k++) items[i].center[k] = part[i].lower[k] + part[i].upper[k];
        items[i].triangle = i;
    }
    stack[0].node = stack[0].first = 0;
    stack[0].count = surface->parts;
    while (top && surface->parts) {
        const int first = stack[--top].first, count = stack[top].count, half = count / 2;
        springls__bvh_node *node = &surface->nodes[stack[top].node];
        if (count == 1) {
            *node = part[items[first].triangle];
            continue;
        }
        springls__bvh_select(items, first, first + count - 1, first + half, springls__bvh_axis(items, first, count));
        springls__bvh_bound_parts(node, part, items + first, count);
        node->first = next;
        node->count = 0;
        stack[top].node = next + 1;
        stack[top].first = first + half;
        stack[top++].count = count - half;
        stack[top].node = next;
        stack[top].first = first;
        stack[top++].count = half;
        next += 2;
    }
    springls__bvh_magnitude(surface);
}

#endif
