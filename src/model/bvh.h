/* bvh.h - builds a bounding volume hierarchy over triangles: by median splits along the longest axis of the triangles' centroids,
   ties broken by index. So the tree depends on the triangles alone, and is never deeper than log2(count). */
#ifndef SPRINGLS__MODEL_BVH_H
#define SPRINGLS__MODEL_BVH_H

#include "../../kernels_embed/language/triangle.h"
#include "../runtime/arrays.h"
#include "../runtime/memory.h"

enum { SPRINGLS__BVH_LEAF = 4, SPRINGLS__BVH_STACK = 64 };

/* A point of a surface; triangle is -1 when none was found. t: the parameter along the ray, for ray queries only. */
typedef struct springls__surface_hit { int triangle; float t; springls__tri_hit hit; } springls__surface_hit;

typedef struct springls__bvh_item { float center[3]; int triangle; } springls__bvh_item;

SPRINGLS__FN springls__tri springls__surface_triangle(const springls__surface *surface, int triangle)
{
    springls__tri t;
    t.a = surface->points[3 * triangle];
    t.b = surface->points[3 * triangle + 1];
    t.c = surface->points[3 * triangle + 2];
    return t;
}

SPRINGLS__FN void springls__surface_free(springls_context *ctx, springls__surface *surface)
{
    springls__buffer_free(ctx, &surface->points_memory);
    springls__buffer_free(ctx, &surface->order_memory);
    springls__buffer_free(ctx, &surface->nodes_memory);
    springls__buffer_free(ctx, &surface->dipoles_memory);
    springls__buffer_free(ctx, &surface->source_memory);
    springls__buffer_free(ctx, &surface->parts_memory);
    springls__buffer_free(ctx, &surface->joint_memory);
    memset(surface, 0, sizeof *surface);
}

/* Counts the bytes that a surface holds. */
SPRINGLS__FN size_t springls__surface_bytes(const springls__surface *surface)
{
    return surface->points_memory.bytes + surface->order_memory.bytes + surface->nodes_memory.bytes
         + surface->dipoles_memory.bytes + surface->source_memory.bytes + surface->parts_memory.bytes
         + surface->joint_memory.bytes;
}

/* Removes all triangles; keeps memory. */
SPRINGLS__FN void springls__surface_forget(springls__surface *surface)
{
    surface->count = surface->given = surface->node_count = surface->parts = surface->joints = 0;
    surface->dipoles = NULL;
    surface->source = NULL;
}

/* Returns whether item a comes before b along an axis. */
SPRINGLS__FN bool springls__bvh_before(springls__bvh_item a, springls__bvh_item b, int axis)
{
    if (a.center[axis] != b.center[axis]) return a.center[axis] < b.center[axis];
    return a.triangle < b.triangle;
}

/* Puts the item that a full sort would put at `middle` there, and smaller items before it. */
SPRINGLS__FN void springls__bvh_select(springls__bvh_item *items, int low, int high, int middle, int axis)
{
    while (low < high) {
        springls__bvh_item a = items[low], b = items[low + (high - low) / 2], c = items[high], pivot, t;
        int i = low, j = high;
        if (springls__bvh_before(b, a, axis)) { t = a; a = b; b = t; }
        pivot = springls__bvh_before(c, a, axis) ? a : springls__bvh_before(c, b, axis) ? c : b;
        while (i <= j) {
            while (springls__bvh_before(items[i], pivot, axis)) i++;
            while (springls__bvh_before(pivot, items[j], axis)) j--;
            if (i <= j) {
                t = items[i];
                items[i++] = items[j];
                items[j--] = t;
            }
        }
        if (middle <= j) high = j;
        else if (middle >= i) low = i;
        else return;
    }
}

/* Returns the axis along which the centroids of items [first, first+count) spread most. */
SPRINGLS__FN int springls__bvh_axis(const springls__bvh_item *items, int first, int count)
{
    float lower[3], upper[3];
    int i, k, axis = 0;
    for (k = 0; k < 3; k++) lower[k] = upper[k] = items[first].center[k];
    for (i = first + 1; i < first + count; i++)
        for (k = 0; k < 3; k++) {
            lower[k] = springls__min(lower[k], items[i].center[k]);
            upper[k] = springls__max(upper[k], items[i].center[k]);
        }
    for (k = 1; k < 3; k++)
        if (upper[k] - lower[k] > upper[axis] - lower[axis]) axis = k;
    return axis;
}

/* How much of a hierarchy has been built. */
typedef struct springls__bvh_progress {
    int stack[SPRINGLS__BVH_STACK], top; /* nodes that wait to be split  */
    int unbound;                         /* nodes that have no bounds yet */
} springls__bvh_progress;

SPRINGLS__FN void springls__bvh_begin(springls__surface *surface, springls__bvh_progress *progress)
{
    surface->nodes[0].first = 0;
    surface->nodes[0].count = surface->count;
    surface->node_count = 1;
    progress->stack[0] = 0;
    progress->top = 1;
    progress->unbound = -1;
}

/* Makes nodes: splits in halves down to leaves of at most four triangles. Ends when none waits, or the nodes split had `most` items
   together. */
SPRINGLS__FN void springls__bvh_split(springls__surface *surface, springls__bvh_item *items, springls__bvh_progress *progress, int most)
{
    while (progress->top && most > 0) {
        springls__bvh_node *node = &surface->nodes[progress->stack[--progress->top]], *child = &surface->nodes[surface->node_count];
        int first = node->first, count = node->count, half = count / 2;
        if (count <= SPRINGLS__BVH_LEAF) continue;
        most -= count;
        springls__bvh_select(items, first, first + count - 1, first + half, springls__bvh_axis(items, first, count));
        node->first = surface->node_count;
        node->count = 0;
        child[0].first = first;
        child[0].count = half;
        child[1].first = first + half;
        child[1].count = count - half;
        progress->stack[progress->top++] = surface->node_count + 1;
        progress->stack[progress->top++] = surface->node_count;
        surface->node_count += 2;
    }
}

/* Computes the bounds of a node, whose children have theirs. */
SPRINGLS__FN void springls__bvh_bound_node(const springls__surface *surface, springls__bvh_node *node)
{
    int i, k;
    for (k = 0; k < 3; k++) { node->lower[k] = FLT_MAX; node->upper[k] = -FLT_MAX; }
    if (!node->count) {
        const springls__bvh_node *child = &surface->nodes[node->first];
        for (k = 0; k < 3; k++) {
            node->lower[k] = springls__min(child[0].lower[k], child[1].lower[k]);
            node->upper[k] = springls__max(child[0].upper[k], child[1].upper[k]);
        }
        return;
    }
    for (i = 0; i < 3 * node->count; i++) {
        springls__v3 p = surface->points[3 * surface->order[node->first + i / 3] + i % 3];
        node->lower[0] = springls__min(node->lower[0], p.x); node->upper[0] = springls__max(node->upper[0], p.x);
        node->lower[1] = springls__min(node->lower[1], p.y); node->upper[1] = springls__max(node->upper[1], p.y);
        node->lower[2] = springls__min(node->lower[2], p.z); node->upper[2] = springls__max(node->upper[2], p.z);
    }
}

/* Finds the largest coordinate: the root has its bounds, if there are triangles. */
SPRINGLS__FN void springls__bvh_magnitude(springls__surface *surface)
{
    int k;
    surface->magnitude = 0.0f;
    for (k = 0; k < 3 && surface->count; k++) {
        surface->magnitude = springls__max(surface->magnitude, springls__fabs(surface->nodes[0].lower[k]));
        surface->magnitude = springls__max(surface->magnitude, springls__fabs(surface->nodes[0].upper[k]));
    }
}

/* Computes the bounds of at most so many nodes, children before their parents; after the last, the largest coordinate. */
SPRINGLS__FN void springls__bvh_bound(springls__surface *surface, springls__bvh_progress *progress, int most)
{
    for (; progress->unbound > 0 && most > 0; most--) springls__bvh_bound_node(surface, &surface->nodes[--progress->unbound]);
    if (progress->unbound == 0) springls__bvh_magnitude(surface);
}

/* Makes room for the corners of n triangles; keeps the first `keep`. */
SPRINGLS__FN springls_status springls__points_room(springls_context *ctx, springls__surface *surface, size_t n, size_t keep)
{
    const springls_status status = springls__buffer_grow(ctx, &surface->points_memory, 3 * n, sizeof(springls__v3),
                                                         3 * keep * sizeof(springls__v3));
    surface->points = (springls__v3 *)surface->points_memory.data;
    return status;
}

/* Makes room for the joints of so many tools; keeps those that there are. */
SPRINGLS__FN springls_status springls__joints_room(springls_context *ctx, springls__surface *surface, int joints)
{
    const springls_status status = springls__buffer_grow(ctx, &surface->joint_memory, (size_t)joints + 1, sizeof(int),
                                                         (size_t)surface->joints * sizeof(int));
    surface->joint = (int *)surface->joint_memory.data;
    return status;
}

/* Returns the first triangle of a tool: 0 is the surface that was set; behind the last, how many triangles there are. */
SPRINGLS__FN int springls__tool_begin(const springls__surface *surface, int tool)
{
    return tool == 0 ? 0 : tool <= surface->joints ? surface->joint[tool - 1] : surface->count;
}

/* Returns the tool that triangle i is of. */
SPRINGLS__FN int springls__tool_of(const springls__surface *surface, int i)
{
    int low = 0, high = surface->joints;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (surface->joint[middle] <= i) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Returns how many nodes a hierarchy has room for: those of its parts, and two a part for what joins them. */
SPRINGLS__FN size_t springls__bvh_nodes(const springls__surface *surface)
{
    return (size_t)surface->node_count + 2 * (size_t)surface->parts;
}

/* Makes room for a hierarchy of n triangles and so many nodes; keep: the triangles whose nodes are kept, or 0. */
SPRINGLS__FN springls_status springls__nodes_room(springls_context *ctx, springls__surface *surface, size_t n, size_t nodes, size_t keep)
{
    const size_t kept = keep ? springls__bvh_nodes(surface) * sizeof(springls__bvh_node) : 0;
    springls_status status = springls__buffer_grow(ctx, &surface->order_memory, n, sizeof(int), keep * sizeof(int));
    if (status == SPRINGLS_OK) status = springls__buffer_grow(ctx, &surface->nodes_memory, nodes, sizeof(springls__bvh_node), kept);
    surface->order = (int *)surface->order_memory.data;
    surface->nodes = (springls__bvh_node *)surface->nodes_memory.data;
    return status;
}

/* Makes room for n triangles, to be built at once; keeps the first `keep` and their nodes. */
SPRINGLS__FN springls_status springls__surface_room(springls_context *ctx, springls__surface *surface, size_t n, size_t keep)
{
    const springls_status status = springls__points_room(ctx, surface, n, keep), of_nodes = springls__nodes_room(ctx, surface, n, n, keep);
    return status == SPRINGLS_OK ? of_nodes : status;
}

/* Makes room for count triangles; the caller writes surface->points (3 a triangle), then calls springls__surface_finish.
   On failure the surface is empty and can be freed. */
SPRINGLS__FN springls_status springls__surface_reserve(springls_context *ctx, springls__surface *surface, int count)
{
    size_t n = count > 0 ? (size_t)count : 1;
    springls__surface_forget(surface);
    return springls__surface_room(ctx, surface, n, 0);
}

/* Makes room for the builder's items of n triangles. They are no scratch, since a query can build a hierarchy between two phases
   of a step that keep theirs there. */
SPRINGLS__FN springls_status springls__bvh_reserve(springls_context *ctx, size_t n)
{
    return springls__buffer_grow(ctx, &ctx->bvh_memory, n, sizeof(springls__bvh_item), 0);
}

/* Begins to build the hierarchy of the first `count` triangles, more than 0, in surface->points. items: room for so many. */
SPRINGLS__FN void springls__surface_build_begin(springls__surface *surface, int count, springls__bvh_item *items,
                                                springls__bvh_progress *progress)
{
    int i;
    for (i = 0; i < count; i++) {
        const springls__v3 *p = surface->points + 3 * i;
        items[i].center[0] = p[0].x + p[1].x + p[2].x;
        items[i].center[1] = p[0].y + p[1].y + p[2].y;
        items[i].center[2] = p[0].z + p[1].z + p[2].z;
        items[i].triangle = i;
    }
    surface->count = surface->given = count;
    surface->parts = surface->joints = 0;
    springls__bvh_begin(surface, progress);
}

/* Goes on with that, by so much that the nodes split have `most` items together, or by so many bounds. Returns false at the end. */
SPRINGLS__FN bool springls__surface_build_more(springls__surface *surface, springls__bvh_item *items, springls__bvh_progress *progress,
                                               int most)
{
    int i;
    if (progress->top) {
        springls__bvh_split(surface, items, progress, most);
        return true;
    }
    if (progress->unbound < 0) {
        for (i = 0; i < surface->count; i++) surface->order[i] = items[i].triangle;
        progress->unbound = surface->node_count;
    }
    springls__bvh_bound(surface, progress, most);
    return progress->unbound > 0;
}

/* Builds the hierarchy of the first `count` triangles in surface->points. */
SPRINGLS__FN springls_status springls__surface_finish(springls_context *ctx, springls__surface *surface, int count)
{
    springls__bvh_progress progress;
    springls__bvh_item *items;
    if (count <= 0) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__bvh_reserve(ctx, (size_t)count));
    items = (springls__bvh_item *)ctx->bvh_memory.data;
    springls__surface_build_begin(surface, count, items, &progress);
    while (springls__surface_build_more(surface, items, &progress, INT32_MAX)) { }
    return SPRINGLS_OK;
}

/* Makes a surface of the triangles of springls, which must be finite. */
SPRINGLS__FN springls_status springls__surface_build(springls_context *ctx, springls__surface *surface,
                                                     const springls__springl *s, int count)
{
    int i, m;
    SPRINGLS__TRY(springls__surface_reserve(ctx, surface, count));
    for (i = 0; i < count; i++)
        for (m = 0; m < 3; m++) surface->points[3 * i + m] = s[i].q[m];
    return springls__surface_finish(ctx, surface, count);
}

SPRINGLS__FN float springls__max_coordinate(springls__v3 x)
{
    return springls__max(springls__max(springls__fabs(x.x), springls__fabs(x.y)), springls__fabs(x.z));
}

#endif
