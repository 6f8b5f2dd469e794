/* bvh_join.h - joins hierarchies: each stays a part, and a few nodes above hang the parts below one root. So it costs what is added, and
   n parts cost n log(n) more: combinations make one each, until a removal of unused triangles (combined_originals.h) leaves none in it.
   Which triangle is closest, or hit first, does not depend on the order in the hierarchy: ties go to the lowest index. */
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
    const size_t nodes = 1 + (size_t)surface->node_count + (size_t)other->node_count + 2 * parts; /* as springls__bvh_nodes says of both */
    SPRINGLS__TRY(springls__buffer_grow(ctx, &to->parts_memory, parts + 1, sizeof *root, (size_t)to->parts * sizeof *root));
    return springls__nodes_room(ctx, to, n, nodes, keep);
}

/* A node that is being copied, with what is below it. */
typedef struct springls__bvh_copied {
    const springls__bvh_node *node;
    springls__bvh_node *out;
    int first, beside;      /* triangles placed, and nodes there were, before                   */
    int child, left;        /* children that have been begun; triangles of the first            */
} springls__bvh_copied;

/* Triangles that are copied from one hierarchy to another: as number[i], -1: left out, or, where that is NULL, as i + shift. */
typedef struct springls__bvh_copy {
    const springls__surface *from;
    springls__surface *to;  /* after springls__bvh_make_parts; has points for all of them       */
    const int *number;
    int shift, placed;      /* placed: triangles of `to` in its order                           */
    int part;               /* of `from`, to be copied next                                     */
    springls__bvh_copied stack[SPRINGLS__BVH_STACK]; /* a node and those above it               */
    int top;
} springls__bvh_copy;

/* Begins to copy a node. Its children will lie side by side. */
SPRINGLS__FN void springls__bvh_copy_begin(springls__bvh_copy *copy, const springls__bvh_node *node, springls__bvh_node *out)
{
    springls__bvh_copied *copied = &copy->stack[copy->top++];
    copied->node = node;
    copied->out = out;
    copied->first = copy->placed;
    copied->beside = copy->to->node_count;
    copied->child = copied->left = 0;
    if (!node->count) copy->to->node_count += 2;
}

/* Places the triangles of a leaf. */
SPRINGLS__FN void springls__bvh_copy_triangles(springls__bvh_copy *copy, const springls__bvh_node *leaf)
{
    int i;
    for (i = leaf->first; i < leaf->first + leaf->count; i++) {
        const int triangle = copy->from->order[i], number = copy->number ? copy->number[triangle] : triangle + copy->shift;
        if (number >= 0) copy->to->order[copy->placed++] = number;
    }
}

/* Ends a node, after what is below it. One of few triangles becomes a leaf, and one without stays out. */
SPRINGLS__FN void springls__bvh_copy_end(springls__bvh_copy *copy, const springls__bvh_copied *copied)
{
    springls__bvh_node *out = copied->out;
    const int count = copy->placed - copied->first;
    out->count = count;
    out->first = copied->first;
    if (count <= SPRINGLS__BVH_LEAF) {
        copy->to->node_count = copied->beside;
        if (count == 0) return;
    } else if (copied->left == 0 || copied->left == count) {
        *out = copy->to->nodes[copied->beside + (copied->left == 0)];
        return;
    } else {
        out->first = copied->beside;
        out->count = 0;
    }
    springls__bvh_bound_node(copy->to, out);
}

/* Goes on with the topmost node: begins a child, or ends it. A part without triangles is left out. */
SPRINGLS__FN void springls__bvh_copy_node(springls__bvh_copy *copy)
{
    springls__bvh_copied *copied = &copy->stack[copy->top - 1];
    if (!copied->node->count && copied->child < 2) {
        const int child = copied->child++;
        if (child == 1) copied->left = copy->placed - copied->first;
        springls__bvh_copy_begin(copy, &copy->from->nodes[copied->node->first + child], &copy->to->nodes[copied->beside + child]);
        return;
    }
    springls__bvh_copy_triangles(copy, copied->node);
    springls__bvh_copy_end(copy, copied);
    copy->top--;
    if (!copy->top && copy->placed > copied->first) copy->to->parts++;
}

/* Copies the parts of a hierarchy as parts of another one, in at most so many visits of nodes. Returns false at the end. */
SPRINGLS__FN bool springls__bvh_copy_some(springls__bvh_copy *copy, int most)
{
    const springls__bvh_node *root;
    springls__bvh_node *own = (springls__bvh_node *)copy->to->parts_memory.data;
    const int parts = springls__bvh_parts(copy->from, &root);
    for (; (copy->top || copy->part < parts) && most > 0; most--)
        if (copy->top) springls__bvh_copy_node(copy);
        else springls__bvh_copy_begin(copy, &root[copy->part++], &own[copy->to->parts]);
    return copy->top || copy->part < parts;
}

/* Prepares a hierarchy, so that parts can be joined to it: its own root, if it has one, becomes that of a part. */
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

/* Hangs the parts of a hierarchy below one root, by median splits as in springls__bvh_split. The nodes that this takes lie from `next`
   on. items: room for as many as parts. */
SPRINGLS__FN void springls__bvh_hang(springls__surface *surface, springls__bvh_item *items, int next)
{
    const springls__bvh_node *part = (const springls__bvh_node *)surface->parts_memory.data;
    struct { int node, first, count; } stack[SPRINGLS__BVH_STACK];
    int i, k, top = 1;
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
